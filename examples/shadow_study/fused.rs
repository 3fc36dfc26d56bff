//! From hard shadow tests to the finished picture: one pass after the other, or all in one.

use super::bench::Bench;
use super::common::adapter::Gpu;
use super::common::clock::median;
use lightfall::pass::{
    Composite, CompositeInputs, CompositeResources, CompositeSettings, DirectLight, DirectLightInputs,
    DirectLightResources, FusedComposite, FusedCompositeInputs, FusedCompositeResources, ShadowMethod, ShadowTarget,
    SoftShadowInputs, SoftShadowResources, SoftShadowSettings, Upsampler, UpsamplerInputs, UpsamplerResources,
    UpsamplerSettings,
};
use lightfall::resource::{Environment, Irradiance, PendingPenumbrae, Radiance, Subsampling};
use lightfall::{Error, wgpu};
use std::time::Instant;

/// Of indirect light.
const SUBSAMPLING: Subsampling = Subsampling::Quarter;

/// What both ways share of a scene, and what each has.
pub(super) struct Shading<'b, 'a> {
    bench: &'b mut Bench<'a>,
    coarse: Irradiance,
    environment: Environment,
    radiance: Radiance,
    separate: Separate,
    fused: Fused,
}

struct Separate {
    indirect: Irradiance,
    direct: Irradiance,
    upsampler: (Upsampler, UpsamplerResources),
    direct_light: (DirectLight, DirectLightResources),
    composite: (Composite, CompositeResources),
}

struct Fused {
    pending: PendingPenumbrae,
    shadows: SoftShadowResources,
    pass: FusedComposite,
    own: FusedCompositeResources,
}

type Record<'b, 'a> = fn(&mut Shading<'b, 'a>, &mut wgpu::CommandEncoder, &SoftShadowSettings);

/// Milliseconds, and bytes of the textures and buffers between the G-buffer and the picture.
pub(super) struct Cost {
    pub(super) ms: f64,
    pub(super) allocated: u64,
    /// Bytes a pixel that the passes read and write at the least, each texel once a pass: where no tile holds a penumbra, and
    /// where all do.
    pub(super) moved: [u64; 2],
}

impl<'b, 'a> Shading<'b, 'a> {
    pub(super) fn new(bench: &'b mut Bench<'a>) -> Result<Self, Error> {
        let (device, size) = (&bench.gpu.device, [bench.size; 2]);
        let irradiance = |size| Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float);
        let lights = bench.lights.count();
        Ok(Self {
            coarse: irradiance(SUBSAMPLING.size(size))?,
            environment: Environment::black(device)?,
            radiance: Radiance::new(device, size)?,
            separate: Separate {
                indirect: irradiance(size)?,
                direct: irradiance(size)?,
                upsampler: (Upsampler::new(device), UpsamplerResources::new(device)?),
                direct_light: (DirectLight::new(device), DirectLightResources::new(device)?),
                composite: (
                    Composite::new(device, wgpu::TextureFormat::Rgba32Float),
                    CompositeResources::new(device)?,
                ),
            },
            fused: Fused {
                pending: PendingPenumbrae::new(device, size, lights)?,
                shadows: SoftShadowResources::without_gathering(device, size, lights)?,
                pass: FusedComposite::new(device, wgpu::TextureFormat::Rgba32Float),
                own: FusedCompositeResources::new(device)?,
            },
            bench,
        })
    }

    /// Of one pass after the other by each of these, and of all in one by the last of them: medians of rounds in which each
    /// has its turn.
    pub(super) fn costs(&mut self, all: &[SoftShadowSettings], rounds: usize) -> Result<Vec<Cost>, Error> {
        let mut times = vec![Vec::new(); all.len() + 1];
        // The first round makes pipelines.
        for round in 0..=rounds {
            for (i, times) in times.iter_mut().enumerate() {
                let (settings, record) = match all.get(i) {
                    Some(settings) => (settings, Self::record_separate as Record<'b, 'a>),
                    None => (&all[all.len() - 1], Self::record_fused as Record<'b, 'a>),
                };
                // What runs after something long takes longer: the second one counts.
                self.run(settings, record)?;
                let ms = self.run(settings, record)?;
                if round > 0 {
                    times.push(ms);
                }
            }
        }
        let costs = times.iter().enumerate().map(|(i, times)| Cost {
            ms: median(times),
            allocated: if i < all.len() {
                self.allocated_separate()
            } else {
                self.allocated_fused()
            },
            moved: [0, 1].map(|tiles| match all.get(i) {
                Some(settings) => self.moved_separate(settings, tiles),
                None => self.moved_fused(),
            }),
        });
        Ok(costs.collect())
    }

    fn run(&mut self, settings: &SoftShadowSettings, record: Record<'b, 'a>) -> Result<f64, Error> {
        let Gpu { device, queue, .. } = self.bench.gpu;
        let start = Instant::now();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(self, &mut encoder, settings);
        queue.submit([encoder.finish()]);
        super::common::offline::wait(device)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    fn record_separate(&mut self, encoder: &mut wgpu::CommandEncoder, settings: &SoftShadowSettings) {
        let (queue, bench, own) = (&self.bench.gpu.queue, &mut *self.bench, &mut self.separate);
        let shadow_inputs = SoftShadowInputs {
            queue,
            g_buffer: &bench.g_buffer,
            lights: &bench.lights,
            shadow_maps: &bench.shadow_maps,
            nearest: &bench.nearest,
            bvh: None,
            target: ShadowTarget::Visibility(&bench.visibility),
            settings: std::slice::from_ref(settings),
            sample_offset: 0,
            timestamps: None,
        };
        bench.pass.record(encoder, &mut bench.own, &shadow_inputs);
        let direct_inputs = DirectLightInputs {
            queue,
            g_buffer: &bench.g_buffer,
            lights: &bench.lights,
            shadow_maps: &bench.shadow_maps,
            visibility: Some(&bench.visibility),
            irradiance: &own.direct,
            timestamps: None,
        };
        let (direct_light, direct_own) = &mut own.direct_light;
        direct_light.record(encoder, direct_own, &direct_inputs);
        let upsampler_inputs = UpsamplerInputs {
            queue,
            g_buffer: &bench.g_buffer,
            coarse: &self.coarse,
            subsampling: SUBSAMPLING,
            target: Subsampling::Full,
            irradiance: &own.indirect,
            marked: None,
            settings: &UpsamplerSettings::default(),
            timestamps: None,
        };
        let (upsampler, upsampler_own) = &mut own.upsampler;
        upsampler.record(encoder, upsampler_own, &upsampler_inputs);
        let composite_inputs = CompositeInputs {
            queue,
            g_buffer: &bench.g_buffer,
            direct: &own.direct,
            indirect: &own.indirect,
            caustic: None,
            specular: None,
            environment: &self.environment,
            radiance: &self.radiance,
            settings: &CompositeSettings::default(),
            timestamps: None,
        };
        let (composite, composite_own) = &mut own.composite;
        composite.record(encoder, composite_own, &composite_inputs);
    }

    fn record_fused(&mut self, encoder: &mut wgpu::CommandEncoder, settings: &SoftShadowSettings) {
        let (queue, bench, own) = (&self.bench.gpu.queue, &*self.bench, &mut self.fused);
        let shadow_inputs = SoftShadowInputs {
            queue,
            g_buffer: &bench.g_buffer,
            lights: &bench.lights,
            shadow_maps: &bench.shadow_maps,
            nearest: &bench.nearest,
            bvh: None,
            target: ShadowTarget::Pending(&own.pending),
            settings: std::slice::from_ref(settings),
            sample_offset: 0,
            timestamps: None,
        };
        bench.pass.record(encoder, &mut own.shadows, &shadow_inputs);
        let fused_inputs = FusedCompositeInputs {
            queue,
            g_buffer: &bench.g_buffer,
            lights: &bench.lights,
            shadow_maps: &bench.shadow_maps,
            penumbrae: Some((&own.pending, &bench.nearest)),
            indirect: &self.coarse,
            subsampling: SUBSAMPLING,
            upsampler: &UpsamplerSettings::default(),
            caustic: None,
            specular: None,
            environment: &self.environment,
            radiance: &self.radiance,
            settings: &CompositeSettings::default(),
            timestamps: None,
        };
        own.pass.record(encoder, &mut own.own, &fused_inputs);
    }

    fn allocated_separate(&self) -> u64 {
        let own = &self.separate;
        let irradiances = own.direct.memory_use() + own.indirect.memory_use();
        irradiances + self.bench.visibility.memory_use() + self.bench.own.memory_use()
    }

    fn allocated_fused(&self) -> u64 {
        let own = &self.fused;
        own.pending.memory_use() + own.shadows.memory_use() + own.own.memory_use()
    }

    /// Bytes of a pixel in the textures that a test or a step of the gathering reads: where its surface is and how it faces.
    fn place(&self) -> u64 {
        let views = self.bench.g_buffer.views();
        texel(&views.depth) + texel(&views.normal)
    }

    /// Of the hard test, without what it writes.
    fn tested(&self) -> u64 {
        self.place() + texel(&self.bench.g_buffer.views().base_color)
    }

    fn moved_separate(&self, settings: &SoftShadowSettings, tiles: u64) -> u64 {
        let (own, views) = (&self.separate, self.bench.g_buffer.views());
        let lights = u64::from(self.bench.lights.count());
        let one = texel(self.bench.visibility.view());
        let [direct, indirect] = [&own.direct, &own.indirect].map(|i| texel(i.view()));
        // It writes visibility, distances, and a copy of visibility for the second axis.
        let test = self.tested() + 3 * one;
        let search = self.place() + 2 * one;
        // Each reads radii and a source, and writes.
        let blur = self.place() + 3 * one;
        let blurs = if settings.method == ShadowMethod::Disc { 1 } else { 2 };
        let shadows = lights * (test + tiles * (search + blurs * blur));
        let upsampler = self.tested() + self.surface() + self.samples() + indirect;
        let direct_light = self.tested() + lights * one + direct;
        let seen = texel(&views.base_color) + texel(&views.emission) + self.surface();
        let composite = seen + direct + indirect + texel(self.radiance.view());
        shadows + upsampler + direct_light + composite
    }

    fn moved_fused(&self) -> u64 {
        let lights = u64::from(self.bench.lights.count());
        let one = texel(self.bench.visibility.view());
        let seen = self.tested() + texel(&self.bench.g_buffer.views().emission) + self.surface();
        let fused = seen + self.samples() + lights * one + texel(self.radiance.view());
        lights * (self.tested() + one) + fused
    }

    /// Of its number, and how it scatters.
    fn surface(&self) -> u64 {
        self.bench.g_buffer.views().surfaces.as_ref().map_or(0, texel)
    }

    /// Bytes of a sample of indirect light, a pixel.
    fn samples(&self) -> u64 {
        texel(self.coarse.view()) / u64::from(SUBSAMPLING.factor().pow(2))
    }
}

fn texel(view: &wgpu::TextureView) -> u64 {
    let format = view.texture().format();
    let bytes = format.block_copy_size(Some(wgpu::TextureAspect::All));
    // What `None` stands for is a depth format that cannot be copied.
    bytes
        .or(format.block_copy_size(Some(wgpu::TextureAspect::DepthOnly)))
        .map_or(4, u64::from)
}
