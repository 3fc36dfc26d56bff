//! The renderer as a piece of a host's frame: it equals what a host composes by hand, allocates once, runs on a device
//! that does nothing, and leaves out what a scene does not need.

mod common;

use common::{Component, Gpu, Offline, assert_no_errors, gpu, mean, offline};
use lightfall::frame::{
    FinalGatherSettings, GiRenderer, IndirectMethod, SceneInputs, Settings, Stage, TracerKind, ViewInputs,
    ViewResources,
};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{
    EnvironmentImage, Light, LightKind, LightSources, Material, Scene, SceneBounds, SceneSummary, samples,
};
use lightfall::{creation_count, read_rgba32float_blocking, wgpu};
use std::f64::consts::PI;

fn small() -> Settings {
    Settings {
        photons: 5_000,
        env_map_count: 3,
        env_map_size: 32,
        shadow_map_size: 64,
        selector: EnvMapSelectorSettings {
            candidates: 40,
            ..Default::default()
        },
        subsampling: Subsampling::Full,
        ..Settings::balanced()
    }
}

fn triangles(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> BvhGeometry {
    BvhGeometry::new(device, queue, scene, &BvhGeometryConfig::default()).unwrap()
}

/// A renderer whose environment maps have their places.
fn placed(gpu: &Gpu, settings: &Settings, scene: &Scene, geometry: &mut MeshGeometry) -> GiRenderer {
    let mut renderer = GiRenderer::new(&gpu.device, settings).unwrap();
    let summary = SceneSummary::of(scene).unwrap();
    renderer.set_scene(&gpu.queue, &summary, &scene.lights).unwrap();
    renderer.place_env_maps_blocking(&gpu.queue, geometry).unwrap();
    renderer
}

/// One frame recorded by the renderer, not submitted.
fn record(
    renderer: &mut GiRenderer,
    view: &mut ViewResources,
    (geometry, bvh): (&mut MeshGeometry, &mut BvhGeometry),
    scene: &Scene,
    (device, queue): (&wgpu::Device, &wgpu::Queue),
) -> wgpu::CommandEncoder {
    let summary = SceneSummary::of(scene).unwrap();
    record_as_told(renderer, view, (geometry, bvh), (scene, &summary), (device, queue))
}

fn record_as_told(
    renderer: &mut GiRenderer,
    view: &mut ViewResources,
    (geometry, bvh): (&mut MeshGeometry, &mut BvhGeometry),
    (scene, summary): (&Scene, &SceneSummary),
    (device, queue): (&wgpu::Device, &wgpu::Queue),
) -> wgpu::CommandEncoder {
    if let Some(image) = scene.environment_image() {
        renderer.set_environment(queue, Some(image)).unwrap();
    }
    let frame = renderer.set_scene(queue, summary, &scene.lights).unwrap();
    bvh.prepare(queue, &frame).unwrap();
    let size = view.g_buffer().size();
    let mut cameras = [CameraView::new(&frame, &scene.cameras[0], size, [0.0; 2])];
    renderer.prepare(queue, geometry, &mut cameras).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let scene_inputs = SceneInputs {
        queue,
        geometry,
        bvh: Some(bvh),
        sample_offset: 0,
        timestamps: None,
    };
    renderer.record_scene(&mut encoder, &scene_inputs).unwrap();
    let composite = CompositeSettings {
        output_scale: frame.output_scale(1.0).unwrap(),
        ..Default::default()
    };
    let view_inputs = ViewInputs {
        queue,
        geometry,
        bvh: Some(bvh),
        view: &cameras[0],
        accumulated: 0,
        composite: &composite,
        timestamps: None,
    };
    renderer.record_view(&mut encoder, view, &view_inputs).unwrap();
    encoder
}

#[test]
fn every_pass_is_made_and_recorded_on_a_device_that_grants_only_the_defaults() {
    let descriptor = wgpu::DeviceDescriptor::default();
    assert_eq!(descriptor.required_limits, wgpu::Limits::default());
    assert_eq!(descriptor.required_features, wgpu::Features::empty());
    let (device, queue) = wgpu::Device::noop(&descriptor);
    make_and_record_every_pass(&device, &queue, &samples::NAMES);
    if let Some(gpu) = gpu() {
        // Each renderer compiles its shaders anew.
        make_and_record_every_pass(&gpu.device, &gpu.queue, &samples::NAMES[..1]);
        assert_no_errors(&gpu);
    }
}

fn make_and_record_every_pass(device: &wgpu::Device, queue: &wgpu::Queue, names: &[&str]) {
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    use IndirectMethod::{FinalGather as G, Splatting as P};
    use {Kernel as K, SplatShape as Shape, Subsampling as S, TraceMethod as Method, TracerKind as Kind};
    let combinations = [
        (
            Shape::Tiled,
            K::Epanechnikov,
            Kind::ImageSpace,
            Method::OrderedMarch,
            S::Full,
            P,
        ),
        (Shape::Tiled, K::Cone, Kind::Bvh, Method::Plane, S::Half, P),
        (
            Shape::Tiled,
            K::Cone,
            Kind::ImageSpace,
            Method::VerifiedWalk,
            S::Half,
            P,
        ),
        (Shape::Tiled, K::Cone, Kind::ImageSpace, Method::NearestWalk, S::Half, P),
        (
            Shape::Tiled,
            K::Cone,
            Kind::ImageSpace,
            Method::NearestMarch,
            S::Half,
            P,
        ),
        (
            Shape::Quads,
            K::Constant,
            Kind::ImageSpace,
            Method::Paper,
            S::Quarter,
            P,
        ),
        (Shape::Quads, K::Cone, Kind::Hybrid, Method::OrderedWalk, S::Full, P),
        (
            Shape::Tiled,
            K::Constant,
            Kind::Hybrid,
            Method::OrderedMarch,
            S::Eighth,
            P,
        ),
        (
            Shape::Tiled,
            K::Cone,
            Kind::ImageSpace,
            Method::OrderedWalk,
            S::Quarter,
            G,
        ),
        (Shape::Tiled, K::Cone, Kind::Bvh, Method::Plane, S::Eighth, G),
        (Shape::Tiled, K::Cone, Kind::Hybrid, Method::Paper, S::Half, G),
    ];
    for (index, (shape, kernel, kind, method, subsampling, indirect_method)) in combinations.into_iter().enumerate() {
        let mut settings = small();
        settings.subsampling = subsampling;
        settings.splatter_config.shape = shape;
        settings.splatter_config.kernel = kernel;
        settings.splatter_config.keeps_to_surfaces = index % 2 == 0;
        settings.tracer_kind = kind;
        settings.trace_method = method;
        settings.indirect_method = indirect_method;
        settings.final_gather.rays = 16;
        settings.final_gather.filter_radius = index as u32 % 2;
        settings.guided_photons = 0.5 * (index % 2) as f32;
        // The furnished ones, which take longest, once.
        let most = if index == 0 { names.len() } else { names.len().min(7) };
        for name in &names[..most] {
            let scene = samples::by_name(name, 0.5).unwrap();
            let mut geometry = MeshGeometry::new(device, queue, &scene).unwrap();
            let mut bvh = triangles(device, queue, &scene);
            let mut renderer = GiRenderer::new(device, &settings).unwrap();
            let mut view = renderer.new_view([33, 17]).unwrap();
            let both = (&mut geometry, &mut bvh);
            let encoder = record(&mut renderer, &mut view, both, &scene, (device, queue));
            queue.submit([encoder.finish()]);
            renderer.place_env_maps_blocking(queue, &mut geometry).unwrap();
        }
    }
    record_the_other_passes(device, queue);
    let error = pollster::block_on(scope.pop());
    assert!(error.is_none(), "{error:?}");
}

/// Those that the renderer does not use.
fn record_the_other_passes(device: &wgpu::Device, queue: &wgpu::Queue) {
    let size = [9, 5];
    let mut encoder = device.create_command_encoder(&Default::default());
    let radiance = Radiance::new(device, size).unwrap();
    let mut sums = AccumulatorResources::new(device, size).unwrap();
    let inputs = AccumulatorInputs {
        queue,
        radiance: &radiance,
        timestamps: None,
    };
    Accumulator::new(device).record(&mut encoder, &mut sums, &inputs);
    let target = Radiance::new(device, size).unwrap();
    let tone_inputs = ToneMapInputs {
        queue,
        radiance: sums.mean(),
        target: target.view(),
        settings: &ToneMapSettings::default(),
        timestamps: None,
    };
    let pass = ToneMap::new(device, wgpu::TextureFormat::Rgba32Float);
    pass.record(&mut encoder, &mut ToneMapResources::new(device).unwrap(), &tone_inputs);
    let photons = Photons::new(device, 100, 2).unwrap();
    let mut statistics = TraceStatisticsResources::new(device, &photons).unwrap();
    let statistics_inputs = TraceStatisticsInputs {
        queue,
        photons: &photons,
        timestamps: None,
    };
    TraceStatistics::new(device).record(&mut encoder, &mut statistics, &statistics_inputs);
    queue.submit([encoder.finish()]);
}

/// The photon walk over one tracer, or over both in turns.
fn walk_by_hand(
    encoder: &mut wgpu::CommandEncoder,
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    settings: &Settings,
    (env_maps, hierarchy): (&EnvMaps, Option<&DepthHierarchy>),
    (geometry, photons): (&BvhGeometry, &Photons),
) {
    let lost = PathList::new(device, photons).unwrap();
    let bounces = photons.bounces();
    let (image_space, triangles) = (
        ImageSpaceTracer::new(device, settings.trace_method),
        BvhTracer::new(device),
    );
    let mut image_space_own = ImageSpaceTracerResources::for_shared_hops(device, bounces).unwrap();
    let mut triangles_own = BvhTracerResources::for_shared_hops(device, bounces).unwrap();
    let mut inputs = ImageSpaceTracerInputs {
        queue,
        env_maps,
        hierarchy,
        photons,
        shared: None,
        guiding: None,
        sample_offset: 0,
        settings: &settings.tracer,
        timestamps: None,
    };
    let mut bvh_inputs = BvhTracerInputs {
        queue,
        geometry,
        photons,
        shared: None,
        guiding: None,
        sample_offset: 0,
        roulette_from: settings.tracer.roulette_from,
        timestamps: None,
    };
    match settings.tracer_kind {
        TracerKind::ImageSpace => image_space.record(encoder, &mut image_space_own, &inputs).unwrap(),
        TracerKind::Bvh => triangles.record(encoder, &mut triangles_own, &bvh_inputs),
        TracerKind::Hybrid => {
            for number in 1..=bounces {
                inputs.shared = Some(SharedHop { number, lost: &lost });
                bvh_inputs.shared = inputs.shared;
                image_space.record(encoder, &mut image_space_own, &inputs).unwrap();
                triangles.record(encoder, &mut triangles_own, &bvh_inputs);
            }
        }
    }
}

/// The frame of `record`, composed by hand from public passes and resources.
fn by_hand(gpu: &Gpu, scene: &Scene, settings: &Settings, size: [u32; 2], centers: &[Vec3]) -> Vec<[f32; 4]> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let summary = SceneSummary::of(scene).unwrap();
    let frame = lightfall::scene::UnitFrame::new(&summary.bounds, summary.total_flux).unwrap();
    let mut geometry = MeshGeometry::new(device, queue, scene).unwrap();
    let mut lights = Lights::new(device).unwrap();
    let sources = LightSources {
        lights: &scene.lights,
        ..Default::default()
    };
    lights.write(queue, &frame, &sources, settings.photons).unwrap();
    let shadow_maps = ShadowMaps::new(device, &scene.lights, settings.shadow_map_size).unwrap();
    let mut env_maps = EnvMaps::new(device, settings.env_map_count, settings.env_map_size).unwrap();
    env_maps.set_centers(queue, centers).unwrap();
    let photons = Photons::new(device, settings.photons, settings.bounces).unwrap();
    let mut g_buffer = GBuffer::new(device, size).unwrap();
    let irradiance = || Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
    let direct = irradiance();
    let estimated = settings.subsampling.size(size);
    let coarse = Irradiance::new(device, estimated, wgpu::TextureFormat::Rgba32Float).unwrap();
    let radiance = Radiance::new(device, size).unwrap();

    let mut camera = CameraView::new(&frame, &scene.cameras[0], size, [0.0; 2]);
    let mut views = vec![camera.capture];
    views.extend(shadow_maps.views(&frame, &scene.lights));
    let maps_from = views.len();
    views.extend(env_maps.views(CapturePurpose::EnvMap));
    for (index, view) in (0..).zip(&mut views) {
        view.index = index;
    }
    camera.capture = views[0];
    let context = PrepareContext {
        device,
        queue,
        frame: &frame,
    };
    geometry.prepare(&context, &views).unwrap();

    let timestamps = None;
    let mut encoder = device.create_command_encoder(&Default::default());
    let shadow_inputs = ShadowMapCaptureInputs {
        shadow_maps: &shadow_maps,
        geometry: &geometry,
        views: &views[1..maps_from],
        timestamps,
    };
    let mut shadow_depth = ShadowMapCaptureResources::new(device, settings.shadow_map_size).unwrap();
    ShadowMapCapture::new().record(&mut encoder, &mut shadow_depth, &shadow_inputs);
    let map_inputs = EnvMapCaptureInputs {
        env_maps: &env_maps,
        geometry: &geometry,
        views: &views[maps_from..],
        layers: None,
        timestamps,
    };
    let mut map_depth = EnvMapCaptureResources::new(device, settings.env_map_size).unwrap();
    EnvMapCapture::new().record(&mut encoder, &mut map_depth, &map_inputs);
    let emitter_inputs = PhotonEmitterInputs {
        queue,
        lights: &lights,
        shadow_maps: &shadow_maps,
        photons: &photons,
        spread: PhotonSpread::Even,
        first_hits: FirstHits::ShadowMaps,
        sample_offset: 0,
        timestamps,
    };
    let mut emitter = PhotonEmitterResources::new(device).unwrap();
    PhotonEmitter::new(device).record(&mut encoder, &mut emitter, &emitter_inputs);
    let mut bvh = triangles(device, queue, scene);
    bvh.prepare(queue, &frame).unwrap();
    let hierarchy = DepthHierarchy::new(device, &env_maps).unwrap();
    let build_inputs = DepthHierarchyBuildInputs {
        queue,
        env_maps: &env_maps,
        hierarchy: &hierarchy,
        maps: None,
        timestamps,
    };
    let mut build = DepthHierarchyBuildResources::new(device, &env_maps).unwrap();
    DepthHierarchyBuild::new(device).record(&mut encoder, &mut build, &build_inputs);
    let maps = (&env_maps, Some(&hierarchy));
    walk_by_hand(&mut encoder, (device, queue), settings, maps, (&bvh, &photons));
    let g_buffer_inputs = GBufferCaptureInputs {
        queue,
        geometry: &geometry,
        view: &camera,
        timestamps,
    };
    GBufferCapture::new().record(&mut encoder, &mut g_buffer, &g_buffer_inputs);
    let direct_inputs = DirectLightInputs {
        queue,
        g_buffer: &g_buffer,
        lights: &lights,
        shadow_maps: &shadow_maps,
        visibility: None,
        irradiance: &direct,
        timestamps,
    };
    let mut direct_own = DirectLightResources::new(device).unwrap();
    DirectLight::new(device).record(&mut encoder, &mut direct_own, &direct_inputs);
    let unit = frame.length_scale();
    let splatter_inputs = PhotonSplatterInputs {
        queue,
        photons: &photons,
        g_buffer: &g_buffer,
        subsampling: settings.subsampling,
        irradiance: &coarse,
        area: (summary.area / (unit * unit)) as f32,
        radius: frame.radius(),
        sample_offset: 0,
        settings: &settings.splatter,
        timestamps,
    };
    let config = settings.splatter_config;
    let mut splatter = PhotonSplatterResources::new(device, &config, &photons, estimated).unwrap();
    let pass = PhotonSplatter::new(device, &config).unwrap();
    pass.record(&mut encoder, &mut splatter, &splatter_inputs);
    // The renderer leaves it out where every pixel is estimated: it would change no bit.
    let targets: &[Subsampling] = match settings.subsampling {
        Subsampling::Quarter => &[Subsampling::Half, Subsampling::Full],
        _ => &[Subsampling::Full],
    };
    let upsample = Upsampler::new(device);
    let (mut from, mut samples) = (coarse, settings.subsampling);
    for &target in targets {
        let size = target.size(size);
        let finer = Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
        let marked = MarkedPixels::new(device, size).unwrap();
        let upsampler_inputs = UpsamplerInputs {
            queue,
            g_buffer: &g_buffer,
            coarse: &from,
            subsampling: samples,
            target,
            irradiance: &finer,
            marked: Some(&marked),
            settings: &settings.upsampler,
            timestamps,
        };
        let mut upsampler = UpsamplerResources::new(device).unwrap();
        upsample.record(&mut encoder, &mut upsampler, &upsampler_inputs);
        if settings.subsampling != Subsampling::Full {
            let marked_inputs = MarkedSplatInputs {
                queue,
                g_buffer: &g_buffer,
                subsampling: target,
                irradiance: &finer,
                marked: &marked,
                timestamps,
            };
            pass.record_marked(&mut encoder, &mut splatter, &marked_inputs);
        }
        (from, samples) = (finer, target);
    }
    let indirect = from;
    let composite_inputs = CompositeInputs {
        queue,
        g_buffer: &g_buffer,
        direct: &direct,
        indirect: &indirect,
        caustic: None,
        specular: None,
        environment: &Environment::black(device).unwrap(),
        radiance: &radiance,
        settings: &CompositeSettings {
            output_scale: frame.output_scale(1.0).unwrap(),
            ..Default::default()
        },
        timestamps,
    };
    let composite = Composite::new(device, wgpu::TextureFormat::Rgba32Float);
    composite.record(
        &mut encoder,
        &mut CompositeResources::new(device).unwrap(),
        &composite_inputs,
    );
    queue.submit([encoder.finish()]);
    read_rgba32float_blocking(device, queue, radiance.view().texture()).unwrap()
}

#[test]
fn the_renderer_equals_the_passes_composed_by_hand_bit_for_bit() {
    let Some(gpu) = gpu() else { return };
    for (tracer_kind, subsampling) in [
        (TracerKind::ImageSpace, Subsampling::Full),
        (TracerKind::ImageSpace, Subsampling::Quarter),
        (TracerKind::Bvh, Subsampling::Full),
        (TracerKind::Hybrid, Subsampling::Full),
    ] {
        let settings = Settings {
            tracer_kind,
            subsampling,
            ..small()
        };
        equals_by_hand(&gpu, &samples::cornell(0.4), &settings, [42, 30]);
    }
    assert_no_errors(&gpu);
}

fn equals_by_hand(gpu: &Gpu, scene: &Scene, settings: &Settings, size: [u32; 2]) {
    let mut geometry = MeshGeometry::new(&gpu.device, &gpu.queue, scene).unwrap();
    let mut bvh = triangles(&gpu.device, &gpu.queue, scene);
    let mut renderer = placed(gpu, settings, scene, &mut geometry);
    let mut view = renderer.new_view(size).unwrap();
    let both = (&mut geometry, &mut bvh);
    let encoder = record(&mut renderer, &mut view, both, scene, (&gpu.device, &gpu.queue));
    gpu.queue.submit([encoder.finish()]);
    let composed = read_rgba32float_blocking(&gpu.device, &gpu.queue, view.radiance().view().texture()).unwrap();
    let centers = renderer.env_maps().map_or(&[][..], EnvMaps::centers);
    let by_hand = by_hand(gpu, scene, settings, size, centers);
    assert!(composed.iter().flatten().any(|&v| v > 0.0));
    assert!(composed == by_hand);
}

#[test]
fn nothing_is_created_after_the_first_frame_and_memory_use_is_what_was_created() {
    for subsampling in [Subsampling::Full, Subsampling::Half] {
        creates_once(&Settings { subsampling, ..small() });
    }
    for tracer_kind in [TracerKind::ImageSpace, TracerKind::Bvh, TracerKind::Hybrid] {
        // More hops than bind groups of one use are remembered.
        creates_once(&Settings {
            tracer_kind,
            bounces: 12,
            ..small()
        });
        creates_once(&Settings {
            tracer_kind,
            indirect_method: IndirectMethod::FinalGather,
            // More than one band of rows.
            final_gather: FinalGatherSettings {
                rays: 1024,
                filter_radius: 1,
                ..Default::default()
            },
            guided_photons: 0.5,
            ..small()
        });
    }
}

fn creates_once(settings: &Settings) {
    let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
    let scene = samples::cornell(0.0);
    let before = creation_count();
    let mut geometry = MeshGeometry::new(&device, &queue, &scene).unwrap();
    let mut bvh = triangles(&device, &queue, &scene);
    let mut renderer = GiRenderer::new(&device, settings).unwrap();
    let mut view = renderer.new_view([64, 48]).unwrap();
    let of_triangles = bvh.memory_use();
    let mut frame = |time: f64, renderer: &mut GiRenderer, view: &mut ViewResources, geometry: &mut MeshGeometry| {
        let scene = samples::cornell(time);
        for (index, instance) in scene.instances.iter().enumerate() {
            geometry.set_transform(index, instance.transform).unwrap();
            bvh.set_transform(index, instance.transform).unwrap();
        }
        let encoder = record(renderer, view, (geometry, &mut bvh), &scene, (&device, &queue));
        queue.submit([encoder.finish()]);
    };
    // The second frame is the first that has photons to select places for environment maps by.
    for _ in 0..2 {
        frame(0.0, &mut renderer, &mut view, &mut geometry);
    }
    let settled = creation_count();
    let in_use = renderer.memory_use() + view.memory_use() + geometry.memory_use() + of_triangles;
    // The one-entry view buffer that the geometry started with was replaced when the views of the frame were known.
    let replaced = 256;
    assert_eq!(settled.bytes - before.bytes, in_use + replaced);
    for step in 1..4 {
        frame(0.3 * f64::from(step), &mut renderer, &mut view, &mut geometry);
    }
    let later = creation_count();
    assert!(later.passes > settled.passes);
    assert_eq!(
        lightfall::CreationCount {
            passes: settled.passes,
            ..later
        },
        settled
    );
}

#[test]
fn a_stage_that_is_not_needed_allocates_and_records_nothing_and_changes_no_pixel() {
    let Some(gpu) = gpu() else { return };
    let mut black = samples::cornell(0.0);
    for material in &mut black.materials {
        material.base_color = [0.0; 3];
    }
    let mut unlit = samples::cornell(0.0);
    unlit.lights.clear();
    unlit.materials.push(Material::default());
    let lit = samples::cornell(0.0);
    let passes = |scene: &Scene, settings: &Settings| {
        let mut offline = Offline::new(&gpu, scene.clone(), settings, 0, [16, 16], Component::All).unwrap();
        let before = creation_count().passes;
        offline.render_frame(None).unwrap();
        let bytes: u64 = offline.memory_by_resource().iter().map(|r| r.1).sum();
        let plan = offline.renderer.plan().unwrap().clone();
        (creation_count().passes - before, bytes, plan, offline.read().unwrap())
    };
    let all = passes(&lit, &small());
    let no_bounces = passes(&lit, &Settings { bounces: 0, ..small() });
    let direct_only = offline::render(&gpu, &lit, &small(), [16, 16], Component::Direct).unwrap();
    assert!(all.2.is_on(Stage::PhotonSplatter) && !no_bounces.2.is_on(Stage::PhotonSplatter));
    // This frame's share of the candidates, 18 environment-map faces, hierarchies, emission, walk, splatting in four.
    assert_eq!(all.0 - no_bounces.0, 1 + 18 + 3 + 4);
    assert!(no_bounces.1 < all.1 / 2, "{} of {} bytes", no_bounces.1, all.1);
    assert!(
        no_bounces.3 == direct_only,
        "direct light is the same without the indirect stages"
    );
    let black = passes(&black, &small());
    assert_eq!(black.0, no_bounces.0);
    assert!(black.3.iter().flatten().all(|&v| v == 0.0));
    // G-buffer and composite only.
    let unlit = passes(&unlit, &small());
    assert_eq!(unlit.0, 2);
    assert!(unlit.3.iter().flatten().all(|&v| v == 0.0));
    assert_no_errors(&gpu);
}

/// A lamp under the ceiling of the Cornell box that shines down, and light from all around by an image of 2 × 1 texels.
fn rectangle_and_environment(scene: &mut Scene) -> [Light; 2] {
    scene.environments.push(EnvironmentImage {
        name: "two halves".into(),
        width: 2,
        height: 1,
        rgb: vec![[1.0; 3], [0.25, 0.5, 3.0]],
    });
    [
        LightKind::Rectangle {
            center: DVec3::new(2.78, 5.4, 2.795),
            half_u: 0.65 * DVec3::X,
            half_v: 0.5 * DVec3::Z,
        },
        LightKind::Environment {
            image: Some(0),
            rotation: 1.0,
        },
    ]
    .map(|kind| Light {
        kind,
        ..Light::point(DVec3::ZERO, 7.0, [1.0; 3])
    })
}

#[test]
fn an_environment_without_suns_leaves_a_scene_black_and_the_plan_says_so() {
    let Some(gpu) = gpu() else { return };
    let mut scene = samples::cornell(0.0);
    scene.lights = rectangle_and_environment(&mut scene)[1..].to_vec();
    scene.validate().unwrap();
    let summary = SceneSummary::of(&scene).unwrap();
    let radius = summary.bounds.radius();
    let settings = Settings {
        environment_suns: 0,
        ..small()
    };
    let mut offline = Offline::new(&gpu, scene.clone(), &settings, 0, [16, 16], Component::All).unwrap();
    let before = creation_count().passes;
    offline.render_frame(None).unwrap();
    // G-buffer and composite only.
    assert_eq!(creation_count().passes - before, 2);
    assert!(offline.read().unwrap().iter().flatten().all(|&v| v == 0.0));
    let plan = offline.renderer.plan().unwrap().to_string();
    assert!(plan.contains("no light but an environment"), "{plan}");
    assert!(plan.contains("lights no diffuse surface"), "{plan}");
    assert!(offline.renderer.shadow_maps().is_none() && offline.renderer.photons().is_none());
    // The unit of flux is near what it emits all the same, image and all.
    let means = [0.625, 0.75, 2.0];
    let sky = 7.0 * means.iter().sum::<f64>() * 4.0 * (PI * radius).powi(2);
    assert!((summary.total_flux / sky - 1.0).abs() < 1e-12);
    let unit = offline.renderer.frame().unwrap().flux_scale();
    assert!(unit >= summary.total_flux && unit < 2.0 * summary.total_flux);
    assert_no_errors(&gpu);
}

#[test]
fn an_environment_without_suns_among_other_lights_changes_no_bit() {
    let Some(gpu) = gpu() else { return };
    let at = DVec3::new(2.78, 5.0, 2.795);
    let spot = |outer_angle: f64, radius| LightKind::Spot {
        position: at,
        direction: DVec3::new(0.2, -1.0, 0.1),
        inner_angle: 0.3,
        outer_angle,
        radius,
    };
    // One, six, one and six layers of shadow maps, with and without a penumbra.
    let kinds = [
        LightKind::Directional {
            direction: DVec3::new(0.3, -1.0, 0.8),
            angle: 0.05,
        },
        spot(1.4, 0.0),
        spot(0.6, 0.2),
        LightKind::Point {
            position: at,
            radius: 0.3,
        },
    ];
    let mut scene = samples::cornell(0.0);
    scene.lights = kinds
        .map(|kind| Light {
            kind,
            ..Light::point(at, 10.0, [1.0, 0.8, 0.6])
        })
        .to_vec();
    let settings = Settings {
        environment_suns: 0,
        ..small()
    };
    let render = |scene: &Scene| offline::render(&gpu, scene, &settings, [32, 32], Component::All).unwrap();
    let reference = render(&scene);
    assert!(mean(&reference, 32, 1, |_, _| true) > 0.0);
    let [_, environment] = rectangle_and_environment(&mut scene);
    scene.lights.insert(2, environment);
    // It is seen past the box.
    let seen = render(&scene);
    let beside: Vec<_> = seen.iter().zip(&reference).filter(|(_, b)| **b == [0.0; 3]).collect();
    assert!(beside.iter().any(|(a, _)| a[2] > 0.0) && beside.len() < 32 * 32 / 4);
    assert!(seen.iter().zip(&reference).all(|(a, b)| a == b || *b == [0.0; 3]));
    assert_no_errors(&gpu);
}

#[test]
fn each_tracer_allocates_and_records_what_it_reads_and_no_more() {
    let Some(gpu) = gpu() else { return };
    let measure = |tracer_kind: TracerKind, bounces| {
        let settings = Settings {
            tracer_kind,
            bounces,
            ..small()
        };
        let scene = samples::cornell(0.0);
        let mut offline = Offline::new(&gpu, scene, &settings, 0, [16, 16], Component::All).unwrap();
        let before = creation_count().passes;
        offline.render_frame(None).unwrap();
        let passes = creation_count().passes - before;
        let renderer = &offline.renderer;
        assert_eq!(
            renderer.env_maps().is_some(),
            tracer_kind.uses_env_maps() && bounces > 0
        );
        let memory = renderer.memory_by_resource();
        let has = |name| memory.iter().any(|&(n, bytes)| n == name && bytes > 0);
        (passes, ["env_maps", "env_map_selector", "lost_rays"].map(has))
    };
    let (direct_light, nothing) = measure(TracerKind::Hybrid, 0);
    assert_eq!(nothing, [false; 3]);
    // This frame's share of the candidates, 18 environment-map faces, hierarchies, emission, walk, splatting in four.
    let image_space = measure(TracerKind::ImageSpace, 3);
    assert_eq!(image_space, (direct_light + 1 + 18 + 3 + 4, [true, true, false]));
    // Emission, walk, splatting.
    assert_eq!(measure(TracerKind::Bvh, 3), (direct_light + 2 + 4, [false; 3]));
    // Each of three hops is walked, listed and walked again.
    let hybrid = measure(TracerKind::Hybrid, 3);
    assert_eq!(hybrid, (image_space.0 - 1 + 3 * 3, [true; 3]));
    assert_no_errors(&gpu);
}

/// World box of an instance.
fn extent(scene: &Scene, instance: usize) -> SceneBounds {
    let instance = &scene.instances[instance];
    let world = scene.meshes[instance.mesh].positions.iter().map(|&p| {
        let position = Vec3::from(p).as_dvec3();
        instance.transform.transform_point3(position)
    });
    let (min, max) = world.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
        (min.min(p), max.max(p))
    });
    SceneBounds::new(min, max).unwrap()
}

#[test]
fn only_what_may_have_changed_is_captured_again_and_no_pixel_tells() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let first = samples::cornell(0.0);
    let centers = [(2.8, 4.0, 1.0), (0.7, 2.5, 2.5), (4.8, 2.0, 1.5)].map(|(x, y, z)| DVec3::new(x, y, z));
    let images = |says_what_changed: bool| {
        let mut geometry = MeshGeometry::new(device, queue, &first).unwrap();
        let mut bvh = triangles(device, queue, &first);
        let mut renderer = GiRenderer::new(device, &small()).unwrap();
        let summary = SceneSummary::of(&first).unwrap();
        renderer.set_scene(queue, &summary, &first.lights).unwrap();
        renderer.set_env_map_centers(queue, &centers).unwrap();
        let mut view = renderer.new_view([32, 32]).unwrap();
        let mut last = first.clone();
        let mut shown = Vec::new();
        for time in [0.0, 0.0, 0.4, 0.8, 0.8] {
            let scene = samples::cornell(time);
            let moved = (0..scene.instances.len()).filter(|&i| scene.instances[i] != last.instances[i]);
            let changes: Vec<_> = moved.flat_map(|i| [extent(&last, i), extent(&scene, i)]).collect();
            for (index, instance) in scene.instances.iter().enumerate() {
                geometry.set_transform(index, instance.transform).unwrap();
            }
            if says_what_changed {
                renderer.set_changes(&changes);
            }
            let before = creation_count().passes;
            let both = (&mut geometry, &mut bvh);
            let encoder = record(&mut renderer, &mut view, both, &scene, (device, queue));
            let passes = creation_count().passes - before;
            queue.submit([encoder.finish()]);
            let image = read_rgba32float_blocking(device, queue, view.radiance().view().texture()).unwrap();
            shown.push((passes, image));
            last = scene;
        }
        shown
    };
    let (always, wanted) = (images(false), images(true));
    for (frame, (all, some)) in always.iter().zip(&wanted).enumerate() {
        assert!(all.1 == some.1, "frame {frame}");
        assert_eq!(all.0, always[0].0);
    }
    let passes: Vec<_> = wanted.iter().map(|w| w.0).collect();
    println!("{passes:?} passes instead of {}", always[0].0);
    // Nothing moved: neither the 18 faces nor their hierarchies, nor what the bulb sees, another six. A block moved: some faces,
    // hierarchies, and all that the bulb sees.
    assert_eq!(passes[0], always[0].0);
    assert_eq!([passes[1], passes[4]], [always[0].0 - 19 - 6; 2]);
    assert!(passes[2] < always[0].0 - 4 && passes[2] > passes[1] + 6 + 1);
    assert_ne!(wanted[1].1, wanted[3].1, "the block moved");
    assert_no_errors(&gpu);
}

#[test]
fn shadow_maps_that_stay_are_those_of_what_there_is() {
    let Some(gpu) = gpu() else { return };
    let gpus = (&gpu.device, &gpu.queue);
    let (device, queue) = gpus;
    let settings = |search: &str| {
        let mut settings = Settings {
            tracer_kind: TracerKind::Bvh,
            ..small()
        };
        settings.set("soft_shadow.search", search).unwrap();
        settings
    };
    let mut scene = samples::cornell(0.0);
    let LightKind::Point { position, .. } = scene.lights[0].kind else {
        panic!("the lamp of the box is a point");
    };
    scene.lights[0].kind = LightKind::Point { position, radius: 0.4 };
    scene.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Directional {
            direction: DVec3::new(0.1, -0.2, 1.0).normalize(),
            angle: 0.05,
        },
        color: [1.0; 3],
        intensity: 2.0,
    });
    let mut turned = scene.clone();
    turned.lights[1].kind = LightKind::Directional {
        direction: DVec3::new(-0.2, -0.3, 1.0).normalize(),
        angle: 0.05,
    };
    let mut wider = turned.clone();
    wider.lights[0].kind = LightKind::Point { position, radius: 0.8 };
    let mut dimmed = wider.clone();
    dimmed.lights[1].intensity = 1.0;
    let summary = SceneSummary::of(&dimmed).unwrap();
    let mut grown = summary.clone();
    grown.bounds = SceneBounds::new(summary.bounds.min, summary.bounds.max + DVec3::splat(0.8)).unwrap();
    // What is said of each frame, and whether anything of it stays.
    let said = |scene: &Scene| (scene.clone(), SceneSummary::of(scene).unwrap());
    let frames = [
        (said(&scene), "on", false),
        (said(&scene), "on", true),
        (said(&turned), "on", false),
        (said(&wider), "on", false),
        (said(&dimmed), "on", true),
        ((dimmed.clone(), grown.clone()), "on", false),
        ((dimmed.clone(), grown.clone()), "off", false),
        ((dimmed.clone(), grown), "on", false),
    ];
    let images = |says_that_nothing_moved: bool| {
        let mut geometry = MeshGeometry::new(device, queue, &scene).unwrap();
        let mut bvh = triangles(device, queue, &scene);
        let mut renderer = GiRenderer::new(device, &settings("on")).unwrap();
        let mut view = renderer.new_view([32, 32]).unwrap();
        let render = |((scene, summary), search, _): &((Scene, SceneSummary), &str, bool)| {
            renderer.set_settings(&settings(search)).unwrap();
            if says_that_nothing_moved {
                renderer.set_changes(&[]);
            }
            let before = creation_count().passes;
            let both = (&mut geometry, &mut bvh);
            let encoder = record_as_told(&mut renderer, &mut view, both, (scene, summary), gpus);
            let passes = creation_count().passes - before;
            queue.submit([encoder.finish()]);
            let image = read_rgba32float_blocking(device, queue, view.radiance().view().texture()).unwrap();
            (passes, image)
        };
        frames.iter().map(render).collect::<Vec<_>>()
    };
    let (always, wanted) = (images(false), images(true));
    for (index, ((all, some), (_, _, stays))) in always.iter().zip(&wanted).zip(&frames).enumerate() {
        assert!(all.1 == some.1, "frame {index}");
        // Six faces of the bulb and the sun's, and what stands nearest before them.
        let left_out = all.0 - some.0;
        assert_eq!(left_out >= 7, *stays, "frame {index}: {left_out} passes fewer");
    }
    assert_no_errors(&gpu);
}

#[test]
fn shadow_maps_of_a_frame_that_was_refused_do_not_count_as_captured() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let scene = samples::cornell(0.0);
    let summary = SceneSummary::of(&scene).unwrap();
    let mut geometry = MeshGeometry::new(device, queue, &scene).unwrap();
    let mut bvh = triangles(device, queue, &scene);
    let settings = Settings {
        tracer_kind: TracerKind::Bvh,
        ..small()
    };
    let mut image = |is_refused_first: bool| {
        let mut renderer = GiRenderer::new(device, &settings).unwrap();
        let mut view = renderer.new_view([16, 16]).unwrap();
        if is_refused_first {
            renderer.set_scene(queue, &summary, &scene.lights).unwrap();
            renderer.set_changes(&[]);
            renderer.prepare(queue, &mut geometry, &mut []).unwrap();
            let inputs = SceneInputs {
                queue,
                geometry: &geometry,
                bvh: None,
                sample_offset: 0,
                timestamps: None,
            };
            let mut encoder = device.create_command_encoder(&Default::default());
            assert!(renderer.record_scene(&mut encoder, &inputs).is_err());
            renderer.set_changes(&[]);
        }
        let both = (&mut geometry, &mut bvh);
        let encoder = record(&mut renderer, &mut view, both, &scene, (device, queue));
        queue.submit([encoder.finish()]);
        read_rgba32float_blocking(device, queue, view.radiance().view().texture()).unwrap()
    };
    assert!(image(true) == image(false));
    assert_no_errors(&gpu);
}

#[test]
fn maps_at_lights_stand_beside_those_selected() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let LightKind::Point { position, .. } = scene.lights[0].kind else {
        panic!("the lamp of the box is a point");
    };
    let settings = Settings {
        env_maps_at_lights: 2,
        ..small()
    };
    let mut geometry = MeshGeometry::new(&gpu.device, &gpu.queue, &scene).unwrap();
    let renderer = placed(&gpu, &settings, &scene, &mut geometry);
    let centers = renderer.env_maps().unwrap().centers();
    let at_light = renderer.frame().unwrap().point(position);
    assert_eq!(centers.len(), small().env_map_count as usize + 1);
    assert_eq!(centers.iter().position(|&c| c == at_light), Some(centers.len() - 1));
    let lit = offline::render(&gpu, &scene, &settings, [16, 16], Component::Indirect).unwrap();
    assert!(mean(&lit, 16, 0, |_, _| true) > 0.0);
    assert_no_errors(&gpu);
}

#[test]
fn the_energy_of_every_hop_adds_up() {
    let Some(gpu) = gpu() else { return };
    let mut under_lamp = samples::cornell(0.0);
    under_lamp.lights[0].kind = LightKind::Rectangle {
        center: DVec3::new(2.78, 5.3, 2.795),
        half_u: DVec3::new(0.7, 0.0, 0.0),
        half_v: DVec3::new(0.0, 0.0, 0.5),
    };
    for scene in [samples::cornell(0.0), under_lamp] {
        for tracer_kind in [TracerKind::ImageSpace, TracerKind::Hybrid, TracerKind::Bvh] {
            let settings = Settings { tracer_kind, ..small() };
            let mut offline = Offline::new(&gpu, scene.clone(), &settings, 0, [8, 8], Component::All).unwrap();
            offline.render_frame(None).unwrap();
            let hops = offline.statistics().unwrap();
            assert_eq!(hops.len(), 4);
            let frame = offline.renderer.frame().unwrap();
            let flux = scene.lights[0].flux(1.0);
            for channel in 0..3 {
                let emitted = f64::from(hops[0].emitted[channel]) * frame.flux_scale();
                let error = (emitted / flux[channel] - 1.0).abs();
                assert!(error < 1e-5, "{tracer_kind:?}: {emitted} of {}", flux[channel]);
                for pair in hops.windows(2) {
                    let passed_on = pair[0].stored[channel] - pair[0].absorbed[channel];
                    let error = (pair[1].emitted[channel] / passed_on - 1.0).abs();
                    assert!(error < 1e-4, "{tracer_kind:?}, hop: {error}");
                }
            }
            println!("{tracer_kind:?}: {hops:#?}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn long_walks_end_and_keep_their_energy_with_roulette() {
    let Some(gpu) = gpu() else { return };
    let settings = Settings {
        bounces: 64,
        photons: 20_000,
        ..small()
    };
    let mut offline = Offline::new(&gpu, samples::cornell(0.0), &settings, 0, [8, 8], Component::All).unwrap();
    offline.render_frame(None).unwrap();
    let hops = offline.statistics().unwrap();
    assert_eq!(hops.len(), 65);
    // Scattering 4 is the first that roulette may end: flux is kept on average, paths are not.
    let (before, after) = (&hops[3], &hops[4]);
    let passed_on: f32 = (0..3).map(|c| before.stored[c] - before.absorbed[c]).sum();
    let ratio = after.emitted.iter().sum::<f32>() / passed_on;
    println!(
        "flux after roulette over before: {ratio:.3}; paths {} of {}",
        after.stored_count, before.stored_count
    );
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    assert!(f64::from(after.stored_count as u32) < 0.75 * before.stored_count as f64);
    assert_eq!(
        hops[64].stored_count, 0,
        "no path of these albedos survives 64 scatterings"
    );
    assert_no_errors(&gpu);
}

#[test]
fn a_mesh_that_the_host_deforms_is_seen_where_it_went() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::plane();
    let mut offline = Offline::new(&gpu, scene, &small(), 0, [8, 8], Component::Direct).unwrap();
    offline.render_frame(None).unwrap();
    let flat = offline.read().unwrap();
    // Positions of the plane's four vertices, lowered by 1 m: the light is now twice as far above the middle.
    let buffer = offline.geometry.deform(0).unwrap().clone();
    for (vertex, corner) in [[-100.0f32, 100.0], [100.0, 100.0], [100.0, -100.0], [-100.0, -100.0]]
        .iter()
        .enumerate()
    {
        let position = [corner[0], -1.0, corner[1]];
        let offset = vertex as u64 * MeshGeometry::VERTEX_BYTES;
        gpu.queue.write_buffer(&buffer, offset, bytemuck::cast_slice(&position));
    }
    offline.render_frame(None).unwrap();
    let lowered = offline.read().unwrap();
    let middle = 8 * 4 + 4;
    println!("{} then {}", flat[middle][0], lowered[middle][0]);
    // Pixel (4, 4) looks half a pixel off the axis: 2 m and 3 m below, 0.25 m and 0.375 m aside in x and z.
    let expected = |height: f64, aside: f64| {
        let r2 = height * height + 2.0 * aside * aside;
        0.5 / std::f64::consts::PI * 10.0 * height / (r2 * r2.sqrt())
    };
    for (pixel, wanted) in [
        (flat[middle], expected(1.0, 0.25)),
        (lowered[middle], expected(2.0, 0.375)),
    ] {
        assert!(
            (f64::from(pixel[0]) / wanted - 1.0).abs() < 1e-3,
            "{} against {wanted}",
            pixel[0]
        );
    }
    assert!(offline.geometry.deform(7).is_none());
    assert_no_errors(&gpu);
}

/// Records one frame of several views in one submission and returns their images, and the passes recorded for the scene
/// and for the views.
fn record_views(
    gpu: &Gpu,
    renderer: &mut GiRenderer,
    geometry: &mut MeshGeometry,
    scene: &Scene,
    views: &mut [&mut ViewResources],
) -> (Vec<Vec<[f32; 4]>>, [u64; 2]) {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let summary = SceneSummary::of(scene).unwrap();
    let frame = renderer.set_scene(queue, &summary, &scene.lights).unwrap();
    let mut cameras: Vec<CameraView> = views
        .iter()
        .map(|view| CameraView::new(&frame, &scene.cameras[0], view.g_buffer().size(), [0.0; 2]))
        .collect();
    renderer.prepare(queue, geometry, &mut cameras).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let before = creation_count().passes;
    let scene_inputs = SceneInputs {
        queue,
        geometry,
        bvh: None,
        sample_offset: 0,
        timestamps: None,
    };
    renderer.record_scene(&mut encoder, &scene_inputs).unwrap();
    let for_scene = creation_count().passes - before;
    for (view, camera) in views.iter_mut().zip(&cameras) {
        let inputs = ViewInputs {
            queue,
            geometry,
            bvh: None,
            view: camera,
            accumulated: 0,
            composite: &CompositeSettings::default(),
            timestamps: None,
        };
        renderer.record_view(&mut encoder, view, &inputs).unwrap();
    }
    let for_views = creation_count().passes - before - for_scene;
    queue.submit([encoder.finish()]);
    let read =
        |view: &&mut ViewResources| read_rgba32float_blocking(device, queue, view.radiance().view().texture()).unwrap();
    (views.iter().map(read).collect(), [for_scene, for_views])
}

#[test]
fn two_views_trace_once_and_each_shows_what_it_shows_alone() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let mut geometry = MeshGeometry::new(&gpu.device, &gpu.queue, &scene).unwrap();
    let mut renderer = placed(&gpu, &small(), &scene, &mut geometry);
    let mut wide = renderer.new_view([32, 32]).unwrap();
    let mut small_view = renderer.new_view([24, 16]).unwrap();
    let mut show = |views: &mut [&mut ViewResources]| record_views(&gpu, &mut renderer, &mut geometry, &scene, views);
    let (both, passes) = show(&mut [&mut wide, &mut small_view]);
    // Six shadow faces, 18 map faces, hierarchies, emission, walk; G-buffer, direct light, splatting in four, composite,
    // twice.
    assert_eq!(passes, [6 + 18 + 3, 2 * 7]);
    assert!(both.iter().flatten().filter(|p| p[0] > 0.0).count() > (32 * 32 + 24 * 16) / 2);
    let (alone, passes) = show(&mut [&mut small_view]);
    assert_eq!(passes, [6 + 18 + 3, 7]);
    assert!(alone[0] == both[1]);
    assert!(show(&mut [&mut wide]).0[0] == both[0]);
    assert_no_errors(&gpu);
}

#[test]
fn a_resized_view_shows_what_a_new_one_of_that_size_shows() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::penumbra(0.0);
    for subsampling in [Subsampling::Full, Subsampling::Quarter] {
        let settings = Settings { subsampling, ..small() };
        let mut geometry = MeshGeometry::new(&gpu.device, &gpu.queue, &scene).unwrap();
        let mut renderer = placed(&gpu, &settings, &scene, &mut geometry);
        let mut view = renderer.new_view([48, 20]).unwrap();
        record_views(&gpu, &mut renderer, &mut geometry, &scene, &mut [&mut view]);
        for size in [[21, 33], [1, 1], [48, 20]] {
            renderer.resize_view(&mut view, size).unwrap();
            let mut fresh = renderer.new_view(size).unwrap();
            let mut views = [&mut view, &mut fresh];
            let images = record_views(&gpu, &mut renderer, &mut geometry, &scene, &mut views).0;
            assert_eq!(images[0].len() as u32, size[0] * size[1]);
            assert!(images[0] == images[1], "{size:?}");
        }
        let texture = view.radiance().view().clone();
        renderer.resize_view(&mut view, [48, 20]).unwrap();
        assert_eq!(*view.radiance().view(), texture, "the same size keeps what there is");
        assert!(renderer.resize_view(&mut view, [0, 7]).is_err());
        assert_eq!(view.g_buffer().size(), [48, 20], "a refused size changes nothing");
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_view_made_for_other_settings_is_made_anew() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let device = (&gpu.device, &gpu.queue);
    let mut geometry = MeshGeometry::new(device.0, device.1, &scene).unwrap();
    let fewer = Settings {
        photons: 500,
        ..small()
    };
    let mut few = placed(&gpu, &fewer, &scene, &mut geometry);
    let mut many = placed(&gpu, &small(), &scene, &mut geometry);
    let mut reused = few.new_view([24, 24]).unwrap();
    let mut own = many.new_view([24, 24]).unwrap();
    let mut bvh = triangles(device.0, device.1, &scene);
    let mut show = |renderer: &mut GiRenderer, view: &mut ViewResources| {
        let encoder = record(renderer, view, (&mut geometry, &mut bvh), &scene, device);
        gpu.queue.submit([encoder.finish()]);
        read_rgba32float_blocking(device.0, device.1, view.radiance().view().texture()).unwrap()
    };
    show(&mut few, &mut reused);
    assert!(show(&mut many, &mut reused) == show(&mut many, &mut own));
    assert_no_errors(&gpu);
}

#[test]
fn maps_stay_where_they_were_placed_while_the_light_is_off() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let scene = samples::cornell(0.0);
    let mut geometry = MeshGeometry::new(device, queue, &scene).unwrap();
    let mut renderer = GiRenderer::new(device, &small()).unwrap();
    let summary = SceneSummary::of(&scene).unwrap();
    let dark = SceneSummary {
        lights: 0,
        ..summary.clone()
    };
    renderer.set_scene(queue, &dark, &[]).unwrap();
    assert!(renderer.env_maps().is_none() && renderer.shadow_maps().is_none());
    renderer.place_env_maps_blocking(queue, &mut geometry).unwrap();
    renderer.set_scene(queue, &summary, &scene.lights).unwrap();
    let placed = renderer.env_maps().unwrap().centers().to_vec();
    let frame = *renderer.frame().unwrap();
    let candidates = EnvMapSelector::candidates(frame.point(summary.bounds.min), frame.point(summary.bounds.max), 3);
    assert_ne!(
        placed, candidates,
        "the first candidate stands in the tall block and was passed over"
    );
    renderer.set_scene(queue, &dark, &[]).unwrap();
    renderer.set_scene(queue, &summary, &scene.lights).unwrap();
    assert_eq!(renderer.env_maps().unwrap().centers(), placed);
    assert_no_errors(&gpu);
}

#[test]
fn a_subject_is_another_one_when_camera_light_or_geometry_have_changed() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let summary = SceneSummary::of(&scene).unwrap();
    let mut renderer = GiRenderer::new(&gpu.device, &small()).unwrap();
    let set = |renderer: &mut GiRenderer, lights: &[Light]| {
        renderer.set_scene(&gpu.queue, &summary, lights).unwrap();
    };
    set(&mut renderer, &scene.lights);
    let camera = &scene.cameras[0];
    let first = renderer.subject(camera);
    set(&mut renderer, &scene.lights);
    renderer.set_changes(&[]);
    assert_eq!(renderer.subject(camera), first, "nothing has changed");
    let mut moved = camera.clone();
    moved.transform.translation.x += 1e-12;
    assert_ne!(renderer.subject(&moved), first);
    let mut wider = camera.clone();
    wider.projection = lightfall::scene::Projection::Perspective { fov_y: 0.9 };
    assert_ne!(renderer.subject(&wider), first);
    let mut seen = vec![first];
    let mut lights = scene.lights.clone();
    lights[0].color[1] *= 0.5;
    set(&mut renderer, &lights);
    seen.push(renderer.subject(camera));
    renderer.geometry_changed();
    seen.push(renderer.subject(camera));
    renderer.set_changes(&[summary.bounds]);
    seen.push(renderer.subject(camera));
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 4);
    assert_no_errors(&gpu);
}

#[test]
fn an_accumulation_begins_anew_by_itself() {
    let Some(gpu) = gpu() else { return };
    let settings = Settings {
        frames: 8,
        tracer_kind: TracerKind::Bvh,
        ..small()
    };
    let bright = samples::cornell(0.0);
    let mut dim = bright.clone();
    dim.lights[0].color = dim.lights[0].color.map(|c| 0.3 * c);
    let new = |scene: &Scene| Offline::new(&gpu, scene.clone(), &settings, 0, [24, 16], Component::All).unwrap();
    let render = |offline: &mut Offline<'_>, frames: u32| {
        for _ in 0..frames {
            offline.render_frame(None).unwrap();
        }
        offline.read().unwrap()
    };
    let mut changing = new(&bright);
    let three = render(&mut changing, 3);
    changing.set_scene(dim.clone()).unwrap();
    let found = render(&mut changing, 2);
    assert_eq!(found, render(&mut new(&dim), 2), "as if it had begun with the change");
    assert_ne!(found, three);
    assert_no_errors(&gpu);
}

#[test]
fn the_accumulator_tells_how_noisy_its_mean_is() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    // Powers of two that would overflow, or vanish, if they were squared.
    for scale in [1.0, 2f64.powi(80), 2f64.powi(-80)] {
        let radiance = Radiance::new(device, [5, 3]).unwrap();
        let (pass, mut resources) = (
            Accumulator::new(device),
            AccumulatorResources::new(device, [5, 3]).unwrap(),
        );
        let frames = [3.0, 5.0, 4.0, 0.0, 6.0, 4.5, 3.0, 1.0, 7.0];
        for (index, light) in frames.iter().enumerate() {
            clear(
                &gpu,
                radiance.view(),
                [light * scale, 2.0 * light * scale, 0.0, (index % 2) as f64],
            );
            let mut encoder = device.create_command_encoder(&Default::default());
            let inputs = AccumulatorInputs {
                queue,
                radiance: &radiance,
                timestamps: None,
            };
            pass.record(&mut encoder, &mut resources, &inputs);
            queue.submit([encoder.finish()]);
            let told = resources.relative_variance_blocking(device, queue).unwrap();
            let all = &frames[..=index];
            let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
            if index == 0 {
                assert_eq!(told, f64::INFINITY);
            } else {
                // The first 1, 2, 2, 4, ... of 2, 3, 4, 5, ... frames, and the others.
                let (first, others) = all.split_at(1 << index.ilog2());
                let apart = (mean(first) - mean(others)).powi(2);
                let variance = apart * (first.len() * others.len()) as f64 / (all.len() as f64).powi(2);
                // Red and green relate to the guard as light does to a hundredth of a third of 1 + 2 of it; blue is black.
                let of = |share: f64| share * share / (share * share + 1e-4);
                let exact = variance / mean(all).powi(2) * (of(1.0) + of(2.0)) / 3.0;
                assert!(
                    (told - exact).abs() <= 1e-5 * exact + 1e-12,
                    "{index}, {scale:e}: {told} {exact}"
                );
            }
            let shown = read_rgba32float_blocking(device, queue, resources.mean().view().texture()).unwrap()[7];
            let coverage = (all.len() / 2) as f64 / all.len() as f64;
            let wanted = [mean(all) * scale, 2.0 * mean(all) * scale, 0.0, coverage];
            assert!(
                shown
                    .iter()
                    .zip(wanted)
                    .all(|(&a, b)| (f64::from(a) - b).abs() <= 1e-6 * b),
                "{shown:?}"
            );
        }
    }
    assert_no_errors(&gpu);
}

/// Fills an image with a colour.
fn clear(gpu: &Gpu, view: &wgpu::TextureView, [r, g, b, a]: [f64; 4]) {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    gpu.queue.submit([encoder.finish()]);
}

#[test]
#[cfg(feature = "bvh")]
fn other_settings_are_as_those_of_a_new_renderer() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.3);
    let with = |changes: &[(&str, &str)]| {
        let mut settings = Settings {
            photons: 4000,
            bounces: 2,
            shadow_map_size: 64,
            tracer_kind: TracerKind::Bvh,
            ..Settings::fast()
        };
        changes
            .iter()
            .for_each(|(key, value)| settings.set(key, value).unwrap());
        settings
    };
    let all = [
        with(&[]),
        with(&[("photons", "9000"), ("bounces", "3"), ("splatter.photons", "50")]),
        with(&[("splatter.subsampling", "1"), ("shadow_maps.size", "128")]),
        with(&[("splatter.shape", "quads"), ("photons", "2000")]),
        with(&[("photons", "0")]),
        with(&[("upsampler.levels", "by-levels"), ("composite.fused", "on")]),
        with(&[
            ("bounces", "0"),
            ("indirect.method", "surface-lights"),
            ("surface_lights.filter_radius", "0"),
        ]),
        with(&[
            ("bounces", "2"),
            ("indirect.method", "surface-lights"),
            ("surface_lights.filter_radius", "0"),
        ]),
        with(&[("selective", "on")]),
        with(&[
            ("selective", "on"),
            ("photons", "2000"),
            ("emission.first_hits", "traced"),
        ]),
    ];
    let mut kept = Offline::new(&gpu, scene.clone(), &all[0], 0, [48, 32], Component::All).unwrap();
    for settings in all.iter().chain(&all[..2]) {
        let mut fresh = Offline::new(&gpu, scene.clone(), settings, 0, [48, 32], Component::All).unwrap();
        kept.points = fresh.points.clone();
        fresh.render_frame(None).unwrap();
        kept.renderer.set_settings(settings).unwrap();
        kept.render_frame(None).unwrap();
        assert!(
            kept.read().unwrap() == fresh.read().unwrap(),
            "{:?}",
            settings.entries()
        );
        let bytes = |offline: &Offline<'_>| (offline.renderer.memory_use(), offline.view.memory_use());
        assert_eq!(bytes(&kept), bytes(&fresh));
    }
    let refused = Settings {
        bounces: 65,
        ..with(&[])
    };
    assert!(kept.renderer.set_settings(&refused).is_err());
    assert_eq!(kept.renderer.settings(), &all[1]);
    kept.render_frame(None).unwrap();
    assert_no_errors(&gpu);
}
