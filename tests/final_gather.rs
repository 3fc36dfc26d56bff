//! Lit environment maps and what rays bring back from them, against arithmetic: walls of even light, and the same photons added
//! up on the screen. Also splatting over faces of environment maps, and the whole through the renderer.
#![cfg(feature = "bvh")]

mod common;

#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/bench.rs"]
mod bench;
#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/judge.rs"]
mod judge;

use bench::{Bench, Maps};
use common::meshes::room;
use common::statistics::Random;
use common::{Component, Gpu, assert_no_errors, gpu, mean, offline};
use lightfall::frame::{FinalGatherSettings, GiRenderer, IndirectMethod, Settings, Stage, TracerKind, ViewInputs};
use lightfall::glam::{DAffine3, DVec3, Vec3};
use lightfall::pass::*;
use lightfall::resource::cube_face::CUBE_FACES;
use lightfall::resource::*;
use lightfall::scene::{Camera, LightSources, Projection, SceneSummary, samples};
use lightfall::{Error, read_rgba32float_blocking, wgpu};

/// That of the plane at distance 1 from the eye: further off than points near the eye, whose differences have no digits.
const DEPTH: f32 = 1.0 / 16_777_216.0;

/// Photons of hop 1 at these places of the room's walls, whose half extent is `half`, in the unit frame: for each wall,
/// coordinates in [−1, 1]² and flux.
fn on_walls(gpu: &Gpu, half: f32, mut places: impl FnMut() -> Vec<([f32; 2], [f32; 3])>) -> Photons {
    let mut records = Vec::new();
    for face in CUBE_FACES {
        records.extend(places().into_iter().map(|([s, t], flux)| Photon {
            position: (half * (face.forward + s * face.right + t * face.up)).to_array(),
            state: PhotonState::Stored as u32,
            flux,
            density: 1.0,
            normal: Photon::pack_unit_vector(-face.forward),
            direction: 0,
            reflectance: 0,
            light_and_surface: 0,
        }));
    }
    let count = records.len() as u32;
    let photons = Photons::new(&gpu.device, count, 1).unwrap();
    let offset = u64::from(count) * PHOTON_BYTES;
    gpu.queue
        .write_buffer(photons.buffer(), offset, bytemuck::cast_slice(&records));
    photons
}

/// The light of photons alone on what maps show, `size`² texels a face: layer after layer.
fn light_maps(
    bench: &Bench<'_>,
    maps: &Maps,
    photons: &Photons,
    size: u32,
    settings: &EnvMapLightingSettings,
) -> (EnvMapIrradiance, Vec<[f32; 4]>) {
    let Gpu { device, queue, .. } = bench.gpu;
    let mut lights = Lights::new(device).unwrap();
    lights.write(queue, &bench.frame, &LightSources::default(), 0).unwrap();
    let shadow_maps = ShadowMaps::new(device, &bench.scene.lights, 4).unwrap();
    let irradiance = EnvMapIrradiance::new(device, &maps.maps, size).unwrap();
    let pass = EnvMapLighting::new(device, Kernel::Epanechnikov, false);
    let mut resources = EnvMapLightingResources::new(device, photons).unwrap();
    let inputs = EnvMapLightingInputs {
        queue,
        env_maps: &maps.maps,
        photons,
        lights: &lights,
        shadow_maps: &shadow_maps,
        irradiance: &irradiance,
        area: 1.0,
        radius: 1.0,
        sample_offset: 0,
        settings,
        timestamps: None,
    };
    let mut encoder = device.create_command_encoder(&Default::default());
    pass.record(&mut encoder, &mut resources, &inputs);
    queue.submit([encoder.finish()]);
    let texels = read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap();
    (irradiance, texels)
}

/// A G-buffer of the scene from a view.
fn capture(bench: &mut Bench<'_>, mut view: CameraView, size: [u32; 2]) -> GBuffer {
    let Gpu { device, queue, .. } = bench.gpu;
    let mut views = [view.capture];
    bench.prepare(&mut views).unwrap();
    view.capture = views[0];
    let mut g_buffer = GBuffer::new(device, size).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let inputs = GBufferCaptureInputs {
        queue,
        geometry: &bench.geometry,
        view: &view,
        timestamps: None,
    };
    GBufferCapture::new().record(&mut encoder, &mut g_buffer, &inputs);
    queue.submit([encoder.finish()]);
    g_buffer
}

fn camera(bench: &Bench<'_>, size: [u32; 2]) -> CameraView {
    let camera = Camera {
        name: String::new(),
        transform: DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.7)),
        projection: Projection::Perspective { fov_y: 1.6 },
    };
    CameraView::new(&bench.frame, &camera, size, [0.0; 2])
}

/// Fixed kernels of this radius, unit frame.
fn kernels(radius: f32, boundary: BoundaryCorrection) -> EnvMapLightingSettings {
    EnvMapLightingSettings {
        bandwidth: Bandwidth::Fixed(radius),
        boundary,
    }
}

#[test]
fn walls_of_even_light_give_back_what_they_reflect() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, room(DVec3::ONE)).unwrap();
    let half = bench.frame.point(DVec3::ONE).x;
    let maps = bench
        .capture(
            &[Vec3::new(0.3, -0.2, 0.1) * half, Vec3::new(-0.5, 0.4, -0.2) * half],
            64,
        )
        .unwrap();
    // An irradiance of one everywhere: 50 × 50 photons a wall.
    let side = 50;
    let flux = (2.0 * half / side as f32).powi(2);
    let photons = on_walls(&gpu, half, || {
        let at = |i: usize| (2.0 * i as f32 + 1.0) / side as f32 - 1.0;
        (0..side * side)
            .map(|i| ([at(i % side), at(i / side)], [flux, 2.0 * flux, 0.0]))
            .collect()
    });
    let settings = kernels(0.12, BoundaryCorrection::KernelArea);
    let (light, texels) = light_maps(&bench, &maps, &photons, 16, &settings);
    let lit = &texels[..2 * 6 * 256];
    let worst = lit.iter().map(|t| (t[0] - 1.0).abs()).fold(0f32, f32::max);
    let energy = lit.iter().map(|t| t[0]).sum::<f32>() / lit.len() as f32;
    println!("texels: {energy:.4} in the mean, off by {worst:.3} at most");
    assert!(
        lit.iter()
            .all(|t| t[3] == 1.0 && (t[1] - 2.0 * t[0]).abs() < 1e-5 && t[2] == 0.0)
    );
    // A corner holds 16 of the 64 points: two more or less are an eighth.
    assert!(worst < 0.15 && (energy - 1.0).abs() < 0.01);

    let size = [24, 20];
    let view = camera(&bench, size);
    let g_buffer = capture(&mut bench, view, size);
    let Gpu { device, queue, .. } = &gpu;
    for subsampling in [Subsampling::Full, Subsampling::Half] {
        let estimated = subsampling.size(size);
        let irradiance = Irradiance::new(device, estimated, wgpu::TextureFormat::Rgba32Float).unwrap();
        let rays = SurfaceRays::new(device, 64 * estimated[0] * estimated[1]).unwrap();
        let inputs = FinalGatherInputs {
            queue,
            g_buffer: &g_buffer,
            subsampling,
            rows: [0, estimated[1]],
            rays_a_pixel: 64,
            rays: &rays,
            env_maps: &maps.maps,
            light: &light,
            irradiance: &irradiance,
            sample_offset: 0,
            timestamps: None,
        };
        let pass = FinalGather::new(device);
        let mut own = FinalGatherResources::new(device).unwrap();
        let image_space = ImageSpaceTracer::new(device, TraceMethod::OrderedWalk);
        let mut image_space_own = ImageSpaceTracerResources::new(device).unwrap();
        let triangles = BvhTracer::new(device);
        let mut triangles_own = BvhTracerResources::new(device).unwrap();
        for traces_triangles in [false, true] {
            let mut encoder = device.create_command_encoder(&Default::default());
            pass.record_rays(&mut encoder, &mut own, &inputs);
            if traces_triangles {
                let ray_inputs = BvhTracerSurfaceRayInputs {
                    queue,
                    geometry: &bench.bvh,
                    rays: &rays,
                    timestamps: None,
                };
                triangles.record_surface_rays(&mut encoder, &mut triangles_own, &ray_inputs);
            } else {
                let ray_inputs = ImageSpaceTracerRayInputs {
                    queue,
                    env_maps: &maps.maps,
                    hierarchy: Some(&maps.hierarchy),
                    rays: &rays,
                    settings: &ImageSpaceTracerSettings::default(),
                    timestamps: None,
                };
                image_space
                    .record_rays(&mut encoder, &mut image_space_own, &ray_inputs)
                    .unwrap();
            }
            pass.record(&mut encoder, &mut own, &inputs);
            queue.submit([encoder.finish()]);
            let pixels = read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap();
            // What is lost brings nothing.
            let hits: Vec<SurfaceHit> = lightfall::read_buffer_blocking(device, queue, rays.hits()).unwrap();
            let wanted = hits.chunks(64).map(|of_pixel| {
                let lost = of_pixel.iter().filter(|h| h.kind() == SurfaceHitKind::Lost).count();
                0.7 * (1.0 - lost as f32 / 64.0)
            });
            let wanted: Vec<f32> = wanted.collect();
            let pairs = pixels.iter().zip(&wanted);
            let worst = pairs.map(|(p, w)| (p[0] - w).abs()).fold(0f32, f32::max);
            let energy = pixels.iter().map(|p| p[0]).sum::<f32>() / wanted.iter().sum::<f32>();
            println!(
                "{subsampling:?}, triangles {traces_triangles}: {energy:.4} of what is found, off by {worst:.3} at most"
            );
            assert!(pixels.iter().all(|p| p[3] == 1.0));
            assert!((energy - 1.0).abs() < 0.01 && worst < 0.05);
            assert!(!traces_triangles || wanted.iter().all(|&w| w == 0.7));
            if traces_triangles {
                // In bands of seven rows, the last of fewer, through one list.
                let band = SurfaceRays::new(device, 64 * estimated[0] * 7).unwrap();
                let mut encoder = device.create_command_encoder(&Default::default());
                let banded = Irradiance::new(device, estimated, wgpu::TextureFormat::Rgba32Float).unwrap();
                for first in (0..estimated[1]).step_by(7) {
                    let inputs = FinalGatherInputs {
                        rows: [first, 7],
                        rays: &band,
                        irradiance: &banded,
                        ..inputs
                    };
                    let mut own = FinalGatherResources::new(device).unwrap();
                    pass.record_rays(&mut encoder, &mut own, &inputs);
                    let ray_inputs = BvhTracerSurfaceRayInputs {
                        queue,
                        geometry: &bench.bvh,
                        rays: &band,
                        timestamps: None,
                    };
                    triangles.record_surface_rays(&mut encoder, &mut triangles_own, &ray_inputs);
                    pass.record(&mut encoder, &mut own, &inputs);
                }
                queue.submit([encoder.finish()]);
                let banded = read_rgba32float_blocking(device, queue, banded.view().texture()).unwrap();
                assert!(banded == pixels);
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn faces_of_environment_maps_are_splatted_over_like_any_g_buffer_and_lit_the_same() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, room(DVec3::new(1.0, 0.7, 0.9))).unwrap();
    let half = bench.frame.point(DVec3::X).x;
    let center = Vec3::new(0.2, -0.1, 0.3) * half;
    let size = 16;
    let maps = bench.capture(&[center], size).unwrap();
    let mut random = Random(5);
    let photons = on_walls(&gpu, half, || {
        let mut unit = || random.unit();
        let mut place = || ([2.0 * unit() - 1.0, 2.0 * unit() - 1.0], [unit(), unit(), unit()]);
        (0..2000).map(|_| place()).collect()
    });
    let radius = 0.15;
    let (_, lit) = light_maps(&bench, &maps, &photons, size, &kernels(radius, BoundaryCorrection::Off));
    let views: Vec<_> = maps.maps.views(CapturePurpose::Camera).collect();
    let Gpu { device, queue, .. } = &gpu;
    let (mut sum, mut off) = (0.0, 0.0);
    for (face, view) in views.into_iter().enumerate() {
        let view = CameraView::from_matrix(view.view_projection, view.eye, view.pixels_per_radian);
        let g_buffer = capture(&mut bench, view, [size; 2]);
        let config = PhotonSplatterConfig::default();
        let pass = PhotonSplatter::new(device, &config).unwrap();
        let mut own = PhotonSplatterResources::new(device, &config, &photons, [size; 2]).unwrap();
        let irradiance = Irradiance::new(device, [size; 2], wgpu::TextureFormat::Rgba32Float).unwrap();
        let inputs = PhotonSplatterInputs {
            queue,
            photons: &photons,
            g_buffer: &g_buffer,
            subsampling: Subsampling::Full,
            irradiance: &irradiance,
            area: 1.0,
            radius: 1.0,
            sample_offset: 0,
            settings: &PhotonSplatterSettings {
                bandwidth: Bandwidth::Fixed(radius),
                boundary: BoundaryCorrection::Off,
                ..Default::default()
            },
            timestamps: None,
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        pass.record(&mut encoder, &mut own, &inputs);
        queue.submit([encoder.finish()]);
        let splatted = read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap();
        for (a, b) in splatted.iter().zip(&lit[face * splatted.len()..]) {
            sum += f64::from(a[1]);
            off += f64::from((a[1] - b[1]).abs());
        }
    }
    // Positions differ by the rounding of depths and distances; a kernel's rim is steep but continuous.
    println!("{:.2e} of the light is elsewhere", off / sum);
    assert!(sum > 0.0 && off < 1e-3 * sum);
    assert_no_errors(&gpu);
}

/// Few photons, but rays.
fn gathering(tracer_kind: TracerKind) -> Settings {
    Settings {
        tracer_kind,
        indirect_method: IndirectMethod::FinalGather,
        final_gather: FinalGatherSettings {
            rays: 64,
            filter_radius: 1,
            ..Default::default()
        },
        photons: 30_000,
        ..Settings::fast()
    }
}

#[test]
fn gathered_light_has_the_energy_of_splatted_light_and_is_the_same_every_frame() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::by_name("cornell", 0.0).unwrap();
    let light = |settings: &Settings| offline::render(&gpu, &scene, settings, [48, 48], Component::Indirect).unwrap();
    // Of triangles, for it loses nothing. What is gathered has one bounce more.
    let splatted = light(&Settings {
        indirect_method: IndirectMethod::Splatting,
        photons: 300_000,
        bounces: 4,
        ..gathering(TracerKind::Bvh)
    });
    for kind in [TracerKind::Bvh, TracerKind::Hybrid, TracerKind::ImageSpace] {
        let gathered = light(&gathering(kind));
        assert_eq!(gathered, light(&gathering(kind)));
        for channel in 0..3 {
            let [a, b] = [&gathered, &splatted].map(|pixels| mean(pixels, 48, channel, |_, _| true));
            println!("{kind:?}, channel {channel}: {a:.4} gathered, {b:.4} splatted");
            assert!((a / b - 1.0).abs() < 0.04, "{kind:?}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_view_that_needs_triangles_and_has_none_is_refused() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::by_name("cornell", 0.0).unwrap();
    let mut renderer = GiRenderer::new(&gpu.device, &gathering(TracerKind::Bvh)).unwrap();
    let summary = SceneSummary::of(&scene).unwrap();
    let frame = renderer.set_scene(&gpu.queue, &summary, &scene.lights).unwrap();
    assert!(renderer.plan().unwrap().is_on(Stage::FinalGather));
    assert!(!renderer.plan().unwrap().is_on(Stage::PhotonSplatter));
    let geometry = MeshGeometry::new(&gpu.device, &gpu.queue, &scene).unwrap();
    let mut view = renderer.new_view([8, 8]).unwrap();
    let camera = CameraView::new(&frame, &scene.cameras[0], [8, 8], [0.0; 2]);
    let inputs = ViewInputs {
        queue: &gpu.queue,
        geometry: &geometry,
        bvh: None,
        view: &camera,
        accumulated: 0,
        composite: &CompositeSettings::default(),
        timestamps: None,
    };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    match renderer.record_view(&mut encoder, &mut view, &inputs).unwrap_err() {
        Error::MissingInput { stage, input, .. } => assert_eq!((stage, input), ("FinalGather", "ViewInputs::bvh")),
        other => panic!("{other:?}"),
    }
    assert_no_errors(&gpu);
}

#[test]
fn the_filter_keeps_even_light_and_edges_and_evens_out_noise() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, room(DVec3::ONE)).unwrap();
    let size = [40, 32];
    let view = camera(&bench, size);
    let g_buffer = capture(&mut bench, view, size);
    let Gpu { device, queue, .. } = &gpu;
    let normals = {
        // Which wall a pixel sees, by where it lies.
        let inverse = lightfall::glam::Mat4::from_cols_array_2d(&view.inverse_view_projection);
        let half = bench.frame.point(DVec3::ONE).x;
        let eye = Vec3::from_slice(&view.capture.eye[..3]);
        let wall = move |x: u32, y: u32| {
            let ndc = |i: u32, n: u32| 2.0 * (i as f32 + 0.5) / n as f32 - 1.0;
            let toward = inverse.project_point3(Vec3::new(ndc(x, size[0]), -ndc(y, size[1]), DEPTH)) - eye;
            let to_walls = (Vec3::splat(half).copysign(toward) - eye) / toward;
            to_walls.min_position()
        };
        (0..size[0] * size[1])
            .map(|i| wall(i % size[0], i / size[0]))
            .collect::<Vec<_>>()
    };
    let filtered = |texels: &[[f32; 4]], radius: u32| {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * size[0]),
            rows_per_image: None,
        };
        queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(texels),
            layout,
            texture.size(),
        );
        let estimate = Irradiance::from_view(&texture.create_view(&Default::default())).unwrap();
        let irradiance = Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
        let inputs = IrradianceFilterInputs {
            queue,
            g_buffer: &g_buffer,
            subsampling: Subsampling::Full,
            estimate: &estimate,
            plus: None,
            irradiance: &irradiance,
            settings: &IrradianceFilterSettings {
                radius,
                normal_agreement: 0.7,
                plane_distance: 0.5,
            },
            timestamps: None,
        };
        let mut own = IrradianceFilterResources::new(device).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        IrradianceFilter::new(device).record(&mut encoder, &mut own, &inputs);
        queue.submit([encoder.finish()]);
        read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap()
    };
    // Another light on each pair of walls: none crosses an edge.
    let by_wall: Vec<[f32; 4]> = normals.iter().map(|&axis| [1.0 + axis as f32, 0.5, 0.0, 1.0]).collect();
    for radius in [0, 1, 3] {
        for (before, after) in by_wall.iter().zip(filtered(&by_wall, radius)) {
            assert!((before[0] - after[0]).abs() < 1e-5 && after[3] == 1.0, "{radius}");
        }
    }
    // By its weights, Σw² / (Σw)², it leaves a twentieth of the variance where all pixels around are on one wall.
    let mut random = Random(11);
    let noise: Vec<[f32; 4]> = normals.iter().map(|_| [2.0 * random.unit(), 0.0, 0.0, 1.0]).collect();
    let variance =
        |texels: &[[f32; 4]]| texels.iter().map(|t| (f64::from(t[0]) - 1.0).powi(2)).sum::<f64>() / texels.len() as f64;
    let (before, after) = (variance(&noise), variance(&filtered(&noise, 2)));
    println!("variance {before:.4}, after the filter {after:.4}");
    assert_eq!(filtered(&noise, 0), noise);
    assert!(after < 0.15 * before);
    assert_no_errors(&gpu);
}
