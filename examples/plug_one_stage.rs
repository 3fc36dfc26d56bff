//! Plugging single stages into somebody else's engine: `common/foreign_host.rs`, which draws, lights and submits by
//! itself and has a G-buffer of its own. Indirect irradiance comes from photons that the engine makes on the CPU and
//! lightfall gathers, at every other pixel, and up-samples; or, with `--walk`, from photons that lightfall carries on
//! through environment maps which the engine draws. `docs/guide.md` goes through all stages.
//!
//! `cargo run --release --example plug_one_stage [FILE.png] [--walk]` (default `plug_one_stage.png`)

mod common;
#[path = "common/foreign_host.rs"]
pub(crate) mod foreign_host;

use common::picture;
use foreign_host::world::{Landing, World};
use foreign_host::{Engine, Formats};
use lightfall::glam::{DMat4, DQuat, DVec3, Vec3};
use lightfall::pass::{
    EnvMapCapture, EnvMapCaptureInputs, EnvMapCaptureResources, ImageSpaceTracer, ImageSpaceTracerInputs,
    ImageSpaceTracerResources, ImageSpaceTracerSettings, PhotonSplatter, PhotonSplatterConfig, PhotonSplatterInputs,
    PhotonSplatterResources, PhotonSplatterSettings, TraceMethod, Upsampler, UpsamplerInputs, UpsamplerResources,
    UpsamplerSettings,
};
use lightfall::resource::{
    CameraView, CapturePurpose, CaptureView, EnvMaps, GBuffer, GBufferViews, Geometry as _, Irradiance, Photon,
    PhotonState, Photons, PrepareContext, Radiance, Subsampling,
};
use lightfall::scene::{SceneBounds, UnitFrame};
use lightfall::{Error, wgpu};

/// Pixels drawn, and pixels that the engine's targets hold: resolution may rise without new textures.
const SIZE: [u32; 2] = [480, 360];
const LARGEST: [u32; 2] = [640, 480];
const FRAMES: u32 = 4;
const PATHS: u32 = 30_000;
const BOUNCES: u32 = 3;
const EXPOSURE: f32 = 0.5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (options, files): (Vec<&String>, Vec<&String>) = arguments.iter().partition(|a| a.starts_with("--"));
    let path = files.first().map_or("plug_one_stage.png", |f| f.as_str());
    let walks = options.iter().any(|o| *o == "--walk");

    // The engine's own: device, scene, textures, pipelines.
    let (device, queue) = foreign_host::open_device()?;
    let gpu = (&device, &queue);
    let mut engine = Engine::new(gpu, World::room(), Formats::PACKED, SIZE, LARGEST);

    // Once: what plugs in.
    let buffer = photon_buffer(&device, PATHS, BOUNCES);
    let photons = Photons::from_buffer(&buffer, PATHS, BOUNCES)?;
    let mut indirect = IndirectLight::new(&engine, photons, Subsampling::Half)?;
    let mut walk = if walks {
        Some(Walk::new(&engine, &indirect)?)
    } else {
        None
    };

    for frame in 0..FRAMES {
        engine.world.set_time(0.25 * f64::from(frame));

        // Photons: hop 0 is where light first lands. Who makes the others is the engine's choice.
        let hops = if walks { 0 } else { BOUNCES };
        let landings = engine.world.trace_paths(PATHS, hops, 1);
        let records = photon_records(&indirect.frame, &landings, PATHS);
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&records));

        // The engine's uniforms. Irradiance comes in the unit frame; its scale turns it back into W/m².
        engine.upload(indirect.frame.output_scale(1.0)?, 1.0);
        if let Some(walk) = &mut walk {
            walk.prepare(&mut engine, &indirect.frame)?;
        }

        // One encoder: the engine's pass, lightfall's, the engine's again. Then the engine submits.
        let mut encoder = device.create_command_encoder(&Default::default());
        engine.record_g_buffer(&mut encoder);
        if let Some(walk) = &mut walk {
            walk.record(&mut encoder, &engine, &indirect.photons)?;
        }
        indirect.record(&mut encoder, &engine);
        engine.record_lighting(&mut encoder, indirect.irradiance.view());
        queue.submit([encoder.finish()]);
    }
    picture::write_png(gpu, path.as_ref(), &Radiance::from_view(&engine.targets.hdr)?, EXPOSURE)?;
    println!("{path}: {FRAMES} frames of somebody else's engine");
    Ok(())
}

/// Photons to irradiance: one stage of lightfall in the engine's frame, or two where it leaves pixels out.
pub(crate) struct IndirectLight {
    /// Where numbers on lightfall's side live. It stays while the scene keeps its size, place and power.
    pub(crate) frame: UnitFrame,
    pub(crate) photons: Photons,
    pub(crate) irradiance: Irradiance,
    pub(crate) g_buffer: GBuffer,
    /// How wide kernels are, and what is done at edges.
    pub(crate) settings: PhotonSplatterSettings,
    area: f32,
    subsampling: Subsampling,
    splatter: PhotonSplatter,
    splatter_resources: PhotonSplatterResources,
    /// While pixels are left out.
    upsampling: Option<Upsampling>,
}

/// The second stage, and what lies between the two.
struct Upsampling {
    coarse: Irradiance,
    upsampler: Upsampler,
    resources: UpsamplerResources,
}

impl IndirectLight {
    pub(crate) fn new(engine: &Engine, photons: Photons, subsampling: Subsampling) -> Result<Self, Error> {
        let (device, size) = (&engine.device, engine.size);

        // Scale: the region's centre becomes the origin, its radius lies in (1/2, 1], the flux is near one.
        let [min, max] = engine.world.bounds();
        let frame = UnitFrame::new(&SceneBounds::new(min, max)?, engine.world.flux().element_sum())?;

        // The engine's own textures, as they are: depth in its own convention, packed normals, eight bits of colour,
        // and the part in use. Base colour's alpha says where a surface is; emission the engine shades by itself.
        let targets = &engine.targets;
        let g_buffer = GBuffer::from_views(
            device,
            GBufferViews {
                depth: targets.depth.clone(),
                normal: targets.normal.clone(),
                normal_encoding: engine.formats.normals().into(),
                base_color: targets.base_color.clone(),
                emission: black_texel(device),
                surfaces: None,
                rectangle: Some([0, 0, size[0], size[1]]),
            },
        )?;

        // The estimate is the slowest stage, and indirect light mostly smooth: a quarter of the pixels will often do.
        let config = PhotonSplatterConfig::default();
        let estimated = subsampling.size(size);
        let upsampling = match subsampling {
            Subsampling::Full => None,
            _ => Some(Upsampling {
                coarse: Irradiance::new(device, estimated, wgpu::TextureFormat::Rgba32Float)?,
                upsampler: Upsampler::new(device),
                resources: UpsamplerResources::new(device)?,
            }),
        };
        Ok(Self {
            area: frame.area(engine.world.area()),
            frame,
            irradiance: Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?,
            splatter: PhotonSplatter::new(device, &config)?,
            splatter_resources: PhotonSplatterResources::new(device, &config, &photons, estimated)?,
            subsampling,
            settings: PhotonSplatterSettings::default(),
            upsampling,
            photons,
            g_buffer,
        })
    }

    /// Between the engine's G-buffer pass and its lighting pass. `irradiance` then holds indirect irradiance.
    pub(crate) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, engine: &Engine) {
        self.g_buffer.set_view(&engine.queue, &camera_view(engine, &self.frame));
        let inputs = PhotonSplatterInputs {
            queue: &engine.queue,
            photons: &self.photons,
            g_buffer: &self.g_buffer,
            subsampling: self.subsampling,
            irradiance: self.upsampling.as_ref().map_or(&self.irradiance, |u| &u.coarse),
            area: self.area,
            radius: self.frame.radius(),
            sample_offset: 0,
            settings: &self.settings,
            timestamps: None,
        };
        self.splatter.record(encoder, &mut self.splatter_resources, &inputs);
        if let Some(upsampling) = &mut self.upsampling {
            let inputs = UpsamplerInputs {
                queue: &engine.queue,
                g_buffer: &self.g_buffer,
                coarse: &upsampling.coarse,
                subsampling: self.subsampling,
                target: Subsampling::Full,
                irradiance: &self.irradiance,
                marked: None,
                settings: &UpsamplerSettings::default(),
                timestamps: None,
            };
            upsampling.upsampler.record(encoder, &mut upsampling.resources, &inputs);
        }
    }
}

/// The engine's camera as lightfall wants it: from the unit frame, instead of render space, to the engine's clip space.
pub(crate) fn camera_view(engine: &Engine, frame: &UnitFrame) -> CameraView {
    let render_from_unit = DMat4::from_scale_rotation_translation(
        DVec3::splat(frame.length_scale()),
        DQuat::IDENTITY,
        frame.center() - engine.origin,
    );
    let clip_from_unit = (engine.clip_from_render().as_dmat4() * render_from_unit).as_mat4();
    let eye = frame.point(engine.world.eye.position).extend(1.0);
    let pixels_per_radian = 0.5 * f64::from(engine.size[1]) / (0.5 * engine.world.eye.fov_y).tan();
    CameraView::from_matrix(
        clip_from_unit.to_cols_array_2d(),
        eye.to_array(),
        pixels_per_radian as f32,
    )
}

/// The engine's own buffer for photon records.
pub(crate) fn photon_buffer(device: &wgpu::Device, paths: u32, bounces: u32) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("engine's photons"),
        size: Photons::size_in_bytes(paths, bounces),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Where the engine's light arrived, as photon records. Slot `hop · paths + i` is hop `hop` of path `i`, as in the
/// engine's list. Hop 0 comes straight from the lamp: it is marked so, and is not splatted, because the engine shades
/// direct light by itself.
pub(crate) fn photon_records(frame: &UnitFrame, landings: &[Option<Landing>], paths: u32) -> Vec<Photon> {
    let record = |(slot, landing): (usize, &Option<Landing>)| {
        let Some(landing) = landing else {
            return bytemuck::Zeroable::zeroed();
        };
        let is_first = slot < paths as usize;
        Photon {
            position: frame.point(landing.position).to_array(),
            state: PhotonState::Stored as u32 | if is_first { Photon::FIRST_HIT } else { 0 },
            flux: frame.intensity(landing.flux).to_array(),
            // Per area, so it scales with the square of a length.
            density: (landing.density * frame.length_scale().powi(2)) as f32,
            normal: Photon::pack_unit_vector(landing.normal.as_vec3()),
            direction: Photon::pack_unit_vector(landing.direction.as_vec3()),
            reflectance: Photon::pack_reflectance(landing.reflectance.as_vec3().to_array()),
            light_and_surface: 0,
        }
    };
    landings.iter().enumerate().map(record).collect()
}

/// Black, for an engine that shades emission by itself.
fn black_texel(device: &wgpu::Device) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("black"),
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Two stages more: environment maps that the engine draws, and photons that walk through them from where the engine
/// says that light first lands.
pub(crate) struct Walk {
    pub(crate) env_maps: EnvMaps,
    views: Vec<CaptureView>,
    capture: EnvMapCapture,
    capture_resources: EnvMapCaptureResources,
    tracer: ImageSpaceTracer,
    tracer_resources: ImageSpaceTracerResources,
}

impl Walk {
    pub(crate) const MAP_SIZE: u32 = 64;

    pub(crate) fn new(engine: &Engine, indirect: &IndirectLight) -> Result<Self, Error> {
        let device = &engine.device;
        // Places that between them see all sides of the box: near the corners of the room, above it. Unit frame.
        let reach = 0.3;
        let centers = [[-1.0, 0.4, -1.0], [1.0, 0.4, -1.0], [-1.0, 0.2, 1.0], [1.0, 0.2, 1.0]];
        let centers = centers.map(|c| reach * Vec3::from(c) + indirect.frame.point(indirect.frame.center()));
        let mut env_maps = EnvMaps::new(device, centers.len() as u32, Self::MAP_SIZE)?;
        env_maps.set_centers(&engine.queue, &centers)?;
        Ok(Self {
            env_maps,
            views: Vec::new(),
            capture: EnvMapCapture::new(),
            capture_resources: EnvMapCaptureResources::new(device, Self::MAP_SIZE)?,
            tracer: ImageSpaceTracer::new(device, TraceMethod::OrderedMarch),
            tracer_resources: ImageSpaceTracerResources::new(device)?,
        })
    }

    /// Before any pass: the engine hears of every view that it will be asked to draw.
    pub(crate) fn prepare(&mut self, engine: &mut Engine, frame: &UnitFrame) -> Result<(), Error> {
        self.views = self.env_maps.views(CapturePurpose::EnvMap).collect();
        for (index, view) in (0..).zip(&mut self.views) {
            view.index = index;
        }
        let (device, queue) = (engine.device.clone(), engine.queue.clone());
        let context = PrepareContext {
            device: &device,
            queue: &queue,
            frame,
        };
        engine.prepare(&context, &self.views)
    }

    /// Captures what surrounds the centres and carries the photons on, hop after hop.
    pub(crate) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        engine: &Engine,
        photons: &Photons,
    ) -> Result<(), Error> {
        let inputs = EnvMapCaptureInputs {
            env_maps: &self.env_maps,
            geometry: engine,
            views: &self.views,
            layers: None,
            timestamps: None,
        };
        self.capture.record(encoder, &mut self.capture_resources, &inputs);
        let inputs = ImageSpaceTracerInputs {
            queue: &engine.queue,
            env_maps: &self.env_maps,
            // The march needs none.
            hierarchy: None,
            photons,
            shared: None,
            guiding: None,
            sample_offset: 0,
            settings: &ImageSpaceTracerSettings::default(),
            timestamps: None,
        };
        self.tracer.record(encoder, &mut self.tracer_resources, &inputs)
    }
}
