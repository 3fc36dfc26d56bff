//! What a view has of indirect light: the estimate at a part of its pixels, and the levels from there to all of them.

use super::indirect_scene::{IndirectScene, PhotonPasses};
use super::ray_tracers::{RayTracers, TracedScene};
use super::surface_light_view::SurfaceLightView;
use super::{CausticMethod, GlossyMethod, IndirectMethod, Settings, Upsampling, ViewInputs};
use crate::Error;
use crate::pass::{
    CausticFilter, FinalGather, FinalGatherInputs, FinalGatherResources, GlossyLight, IrradianceFilter,
    IrradianceFilterInputs, IrradianceFilterResources, IrradianceFilterSettings, MarkedSplatInputs,
    PhotonGuidingInputs, PhotonGuidingResources, PhotonSplatter, PhotonSplatterInputs, PhotonSplatterResources,
    PhotonSplatterSettings, SpecularPaths, SplatShape, SurfaceLightShading, TexelShading, TexelShadingInputs,
    TexelShadingResources, Upsampler, UpsamplerInputs, UpsamplerResources, progressive_scale,
};
use crate::resource::{GBuffer, Irradiance, Lights, MarkedPixels, Photons, Subsampling, SurfaceRays};

/// Most rays of a band, 64 bytes each with what they meet: two of its lists fit what every device grants.
pub(super) const MOST_RAYS: u64 = 1 << 21;

/// From photons to the pixels of a view.
#[derive(Debug)]
pub(super) struct ViewPasses {
    pub(super) photon_splatter: PhotonSplatter,
    /// If they gather.
    final_gather: Option<FinalGather>,
    /// If they even noise out.
    irradiance_filter: Option<IrradianceFilter>,
    /// If the settings take surface lights.
    pub(super) surface_light_shading: Option<SurfaceLightShading>,
    /// If they take illumination maps.
    texel_shading: Option<TexelShading>,
    /// If caustics are filtered.
    pub(super) caustic_filter: Option<CausticFilter>,
    upsampler: Upsampler,
    pub(super) specular_paths: SpecularPaths,
    /// If the settings light rough metal by photons.
    pub(super) glossy_light: Option<GlossyLight>,
}

/// Allocated while there is indirect light.
#[derive(Debug)]
pub(super) struct IndirectView {
    estimate: Estimate,
    estimated: Irradiance,
    /// If noise is evened out: what it was before.
    filter: Option<(Irradiance, IrradianceFilterResources)>,
    subsampling: Subsampling,
    /// If photons are guided.
    guiding: Option<PhotonGuidingResources>,
    /// From coarse to fine, while fewer pixels are estimated than seen; without the last where that is left to the sum.
    levels: Vec<UpsampledLevel>,
}

/// By [`IndirectMethod`].
#[derive(Debug)]
enum Estimate {
    Splatting(Box<PhotonSplatterResources>),
    FinalGather(Box<GatherView>),
    SurfaceLights(Box<SurfaceLightView>),
    IlluminationMaps(Box<TexelShadingResources>),
}

#[derive(Debug)]
struct GatherView {
    /// Of one band after the other.
    rays: SurfaceRays,
    band_rows: u32,
    /// Of each band.
    own: Vec<FinalGatherResources>,
    tracers: RayTracers,
}

/// Irradiance made of that of the level before.
#[derive(Debug)]
struct UpsampledLevel {
    subsampling: Subsampling,
    irradiance: Irradiance,
    upsampler: UpsamplerResources,
    /// What is estimated anew.
    marked: Option<MarkedPixels>,
}

/// What recording needs beside a host's inputs.
#[derive(Clone, Copy)]
pub(super) struct IndirectViewInputs<'a> {
    pub(super) view: &'a ViewInputs<'a>,
    pub(super) settings: &'a Settings,
    pub(super) passes: (&'a ViewPasses, &'a PhotonPasses),
    pub(super) scene: &'a IndirectScene,
    pub(super) lights: &'a Lights,
    pub(super) g_buffer: &'a GBuffer,
    /// Of all surfaces, unit frame.
    pub(super) area: f32,
    /// Of the region, unit frame.
    pub(super) radius: f32,
    /// Of the photons.
    pub(super) sample_offset: u32,
    /// Whether what is seen of photons guides the next ones.
    pub(super) counts_guiding: bool,
}

impl<'a> IndirectViewInputs<'a> {
    /// What rays of the view meet.
    pub(super) fn traced_scene(&self) -> TracedScene<'a> {
        let scene = self.scene;
        TracedScene {
            queue: self.view.queue,
            passes: self.passes.1,
            settings: self.settings,
            #[cfg(feature = "bvh")]
            bvh: self.view.bvh,
            maps: scene.env_maps().map(|maps| (maps, scene.depth_hierarchy())),
            timestamps: self.view.timestamps,
        }
    }
}

impl ViewPasses {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings) -> Result<Self, Error> {
        let gathers = settings.indirect_method == IndirectMethod::FinalGather;
        Ok(Self {
            photon_splatter: PhotonSplatter::new(device, &settings.splatter_config)?,
            final_gather: gathers.then(|| FinalGather::new(device)),
            irradiance_filter: settings.filters().then(|| IrradianceFilter::new(device)),
            surface_light_shading: (settings.indirect_method == IndirectMethod::SurfaceLights)
                .then(|| SurfaceLightShading::new(device)),
            texel_shading: (settings.indirect_method == IndirectMethod::IlluminationMaps)
                .then(|| TexelShading::new(device)),
            caustic_filter: (settings.caustic.method == CausticMethod::Filter).then(|| CausticFilter::new(device)),
            upsampler: Upsampler::new(device),
            specular_paths: SpecularPaths::new(
                device,
                settings.splatter_config.kernel,
                settings.splatter_config.keeps_to_surfaces,
            ),
            glossy_light: (settings.glossy_method == GlossyMethod::Photons)
                .then(|| GlossyLight::new(device, settings.splatter_config.kernel)),
        })
    }
}

impl IndirectView {
    pub(super) fn new(
        device: &wgpu::Device,
        settings: &Settings,
        photons: &Photons,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let config = &settings.splatter_config;
        let estimated = settings.subsampling.size(size);
        let splats = settings.indirect_method == IndirectMethod::Splatting;
        let mut format = wgpu::TextureFormat::Rgba32Float;
        let estimate = match settings.indirect_method {
            IndirectMethod::Splatting => {
                let own = PhotonSplatterResources::new(device, config, photons, estimated)?;
                Estimate::Splatting(Box::new(own))
            }
            IndirectMethod::FinalGather => {
                Estimate::FinalGather(Box::new(GatherView::new(device, settings, estimated)?))
            }
            IndirectMethod::SurfaceLights => {
                format = SurfaceLightView::format(device, settings);
                Estimate::SurfaceLights(Box::new(SurfaceLightView::new(device)?))
            }
            IndirectMethod::IlluminationMaps => {
                Estimate::IlluminationMaps(Box::new(TexelShadingResources::new(device)?))
            }
        };
        let filter = || -> Result<_, Error> {
            let noisy = Irradiance::new(device, estimated, format)?;
            Ok((noisy, IrradianceFilterResources::new(device)?))
        };
        let filter = settings.filters().then(filter).transpose()?;
        if filter.is_some() {
            format = wgpu::TextureFormat::Rgba32Float;
        }
        let estimated = Irradiance::new(device, estimated, format)?;
        let by_levels = settings.upsampling == Upsampling::ByLevels;
        let mut levels = Vec::new();
        let mut finer = settings.subsampling.finer();
        while let Some(subsampling) = finer {
            finer = subsampling.finer();
            if settings.fuses_composite && finer.is_none() {
                break;
            }
            if by_levels || finer.is_none() {
                let is_marked = by_levels && splats && config.shape == SplatShape::Tiled;
                levels.push(UpsampledLevel::new(device, subsampling, size, is_marked)?);
            }
        }
        let guiding = (settings.guided_photons > 0.0).then(|| PhotonGuidingResources::new(device));
        Ok(Self {
            estimate,
            estimated,
            filter,
            subsampling: settings.subsampling,
            guiding: guiding.transpose()?,
            levels,
        })
    }

    /// The finest there is, and where its samples stand.
    pub(super) fn samples(&self) -> (&Irradiance, Subsampling) {
        let estimated = (&self.estimated, self.subsampling);
        self.levels.last().map_or(estimated, |l| (&l.irradiance, l.subsampling))
    }

    /// Makes or drops what depends on the scene's surface lights.
    pub(super) fn follow(
        &mut self,
        device: &wgpu::Device,
        settings: &Settings,
        scene: &IndirectScene,
    ) -> Result<(), Error> {
        if let (Estimate::SurfaceLights(own), Some(lights)) = (&mut self.estimate, scene.surface_lights()) {
            own.follow(device, settings, lights, self.estimated.size())?;
        }
        Ok(())
    }

    /// At all pixels, unless the step to them is left to the sum.
    pub(super) fn irradiance(&self) -> Option<&Irradiance> {
        let (irradiance, subsampling) = self.samples();
        (subsampling == Subsampling::Full).then_some(irradiance)
    }

    /// What was estimated anew at each level, from coarse to fine.
    pub(super) fn marked_pixels(&self) -> impl Iterator<Item = &MarkedPixels> {
        self.levels.iter().filter_map(|l| l.marked.as_ref())
    }

    /// Records the estimate, the levels up to all pixels, and what counts for the next photons.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &IndirectViewInputs<'_>,
    ) -> Result<(), Error> {
        let estimated = self.filter.as_ref().map_or(&self.estimated, |f| &f.0);
        match &mut self.estimate {
            Estimate::Splatting(own) => splat(encoder, own, estimated, inputs),
            Estimate::FinalGather(own) => own.record(encoder, estimated, inputs)?,
            Estimate::SurfaceLights(own) => own.record(encoder, estimated, inputs)?,
            Estimate::IlluminationMaps(own) => shade_texels(encoder, own, estimated, inputs),
        }
        self.even_out(encoder, inputs);
        self.upsample(encoder, inputs);
        self.count_guiding(encoder, inputs);
        Ok(())
    }

    /// Records what evens out the noise of rays.
    fn even_out(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &IndirectViewInputs<'_>) {
        let (Some(pass), Some((noisy, own))) = (&inputs.passes.0.irradiance_filter, &mut self.filter) else {
            return;
        };
        let near = match &self.estimate {
            Estimate::SurfaceLights(own) => own.near(),
            Estimate::Splatting(_) | Estimate::FinalGather(_) | Estimate::IlluminationMaps(_) => None,
        };
        let plus = near.zip(inputs.scene.surface_lights().map(|s| s.share().recip()));
        let filter_inputs = IrradianceFilterInputs {
            queue: inputs.view.queue,
            g_buffer: inputs.g_buffer,
            subsampling: inputs.settings.subsampling,
            estimate: noisy,
            plus,
            irradiance: &self.estimated,
            settings: &IrradianceFilterSettings {
                radius: inputs.settings.filter_radius(),
                normal_agreement: inputs.settings.upsampler.normal_agreement,
                plane_distance: inputs.settings.upsampler.plane_distance,
            },
            timestamps: inputs.view.timestamps,
        };
        pass.record(encoder, own, &filter_inputs);
    }

    /// Records the levels between the pixels that were estimated and all of them.
    fn upsample(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &IndirectViewInputs<'_>) {
        let (passes, view) = (inputs.passes.0, inputs.view);
        let (mut coarse, mut subsampling) = (&self.estimated, inputs.settings.subsampling);
        for level in &mut self.levels {
            let upsampler_inputs = UpsamplerInputs {
                queue: view.queue,
                g_buffer: inputs.g_buffer,
                coarse,
                subsampling,
                target: level.subsampling,
                irradiance: &level.irradiance,
                marked: level.marked.as_ref(),
                settings: &inputs.settings.upsampler,
                timestamps: view.timestamps,
            };
            passes
                .upsampler
                .record(encoder, &mut level.upsampler, &upsampler_inputs);
            if let (Some(marked), Estimate::Splatting(own)) = (&level.marked, &mut self.estimate) {
                let marked_inputs = MarkedSplatInputs {
                    queue: view.queue,
                    g_buffer: inputs.g_buffer,
                    subsampling: level.subsampling,
                    irradiance: &level.irradiance,
                    marked,
                    timestamps: view.timestamps,
                };
                passes.photon_splatter.record_marked(encoder, own, &marked_inputs);
            }
            (coarse, subsampling) = (&level.irradiance, level.subsampling);
        }
    }

    fn count_guiding(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &IndirectViewInputs<'_>) {
        if let (Some(pass), Some(tables), Some(own)) = (
            &inputs.passes.1.photon_guiding,
            inputs.scene.guiding_tables(),
            &mut self.guiding,
        ) && inputs.counts_guiding
        {
            let guiding_inputs = PhotonGuidingInputs {
                queue: inputs.view.queue,
                photons: inputs.scene.photons(),
                lights: inputs.lights,
                g_buffer: inputs.g_buffer,
                tables,
                timestamps: inputs.view.timestamps,
            };
            pass.record(encoder, own, &guiding_inputs);
        }
    }

    /// Bytes by resource.
    pub(super) fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let mut list = vec![("indirect_irradiance", self.estimated.memory_use())];
        list.push(match &self.estimate {
            Estimate::Splatting(own) => ("splatter", own.memory_use()),
            Estimate::FinalGather(own) => ("final_gather", own.memory_use()),
            Estimate::SurfaceLights(own) => ("surface_light_shading", own.memory_use()),
            Estimate::IlluminationMaps(own) => ("texel_shading", own.memory_use()),
        });
        if let Some((noisy, own)) = &self.filter {
            list.push(("irradiance_filter", noisy.memory_use() + own.memory_use()));
        }
        if let Some(guiding) = &self.guiding {
            list.push(("photon_guiding", guiding.memory_use()));
        }
        if !self.levels.is_empty() {
            let levels = self.levels.iter().map(UpsampledLevel::memory_use);
            list.push(("upsampled_irradiance", levels.sum()));
        }
        list
    }
}

/// Records the estimate of photons around.
fn splat(
    encoder: &mut wgpu::CommandEncoder,
    own: &mut PhotonSplatterResources,
    estimated: &Irradiance,
    inputs: &IndirectViewInputs<'_>,
) {
    let settings = PhotonSplatterSettings {
        radius_scale: progressive_scale(inputs.view.accumulated, inputs.settings.radius_alpha),
        ..inputs.settings.splatter
    };
    let splatter_inputs = PhotonSplatterInputs {
        queue: inputs.view.queue,
        photons: inputs.scene.photons(),
        g_buffer: inputs.g_buffer,
        subsampling: inputs.settings.subsampling,
        irradiance: estimated,
        area: inputs.area,
        radius: inputs.radius,
        sample_offset: inputs.sample_offset,
        settings: &settings,
        timestamps: inputs.view.timestamps,
    };
    inputs.passes.0.photon_splatter.record(encoder, own, &splatter_inputs);
}

/// Records the light of texels around.
fn shade_texels(
    encoder: &mut wgpu::CommandEncoder,
    own: &mut TexelShadingResources,
    estimated: &Irradiance,
    inputs: &IndirectViewInputs<'_>,
) {
    let (Some(pass), Some(scene)) = (&inputs.passes.0.texel_shading, inputs.scene.illumination()) else {
        return;
    };
    let shading_inputs = TexelShadingInputs {
        queue: inputs.view.queue,
        g_buffer: inputs.g_buffer,
        subsampling: inputs.settings.subsampling,
        lights: scene.lights(),
        map: scene.map(),
        reach: inputs.settings.illumination_maps.reach,
        irradiance: estimated,
        timestamps: inputs.view.timestamps,
    };
    pass.record(encoder, own, &shading_inputs);
}

impl GatherView {
    fn new(device: &wgpu::Device, settings: &Settings, size: [u32; 2]) -> Result<Self, Error> {
        let rays_a_row = u64::from(size[0]) * u64::from(settings.final_gather.rays);
        let band_rows = (MOST_RAYS / rays_a_row).clamp(1, u64::from(size[1])) as u32;
        let rays = u32::try_from(rays_a_row * u64::from(band_rows)).unwrap_or(u32::MAX);
        let own = (0..size[1].div_ceil(band_rows)).map(|_| FinalGatherResources::new(device));
        Ok(Self {
            rays: SurfaceRays::new(device, rays)?,
            band_rows,
            own: own.collect::<Result<_, _>>()?,
            tracers: RayTracers::new(device)?,
        })
    }

    /// Records the rays, what they meet, and what they bring back.
    fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        estimated: &Irradiance,
        inputs: &IndirectViewInputs<'_>,
    ) -> Result<(), Error> {
        let (Some(pass), Some(env_maps), Some(light)) = (
            &inputs.passes.0.final_gather,
            inputs.scene.env_maps(),
            inputs.scene.env_map_irradiance(),
        ) else {
            return Ok(());
        };
        let mut gather_inputs = FinalGatherInputs {
            queue: inputs.view.queue,
            g_buffer: inputs.g_buffer,
            subsampling: inputs.settings.subsampling,
            rows: [0, self.band_rows],
            rays_a_pixel: inputs.settings.final_gather.rays,
            rays: &self.rays,
            env_maps,
            light,
            irradiance: estimated,
            sample_offset: inputs.sample_offset,
            timestamps: inputs.view.timestamps,
        };
        for own in &mut self.own {
            pass.record_rays(encoder, own, &gather_inputs);
            self.tracers.record(encoder, &self.rays, &inputs.traced_scene())?;
            pass.record(encoder, own, &gather_inputs);
            gather_inputs.rows[0] += self.band_rows;
        }
        Ok(())
    }

    fn memory_use(&self) -> u64 {
        let own: u64 = self.own.iter().map(FinalGatherResources::memory_use).sum();
        self.rays.memory_use() + own + self.tracers.memory_use()
    }
}

impl UpsampledLevel {
    fn new(device: &wgpu::Device, subsampling: Subsampling, full: [u32; 2], is_marked: bool) -> Result<Self, Error> {
        let size = subsampling.size(full);
        Ok(Self {
            subsampling,
            irradiance: Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?,
            upsampler: UpsamplerResources::new(device)?,
            marked: is_marked.then(|| MarkedPixels::new(device, size)).transpose()?,
        })
    }

    fn memory_use(&self) -> u64 {
        let marked = self.marked.as_ref().map_or(0, MarkedPixels::memory_use);
        self.irradiance.memory_use() + self.upsampler.memory_use() + marked
    }
}
