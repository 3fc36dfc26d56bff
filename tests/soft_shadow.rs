//! Statements about penumbrae: how wide they are, what their profile is, and where they are not.

mod common;

use common::{Gpu, assert_no_errors, gpu};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{
    Camera, Instance, Light, LightKind, Material, Mesh, Projection, Scene, SceneSummary, UnitFrame,
};
use lightfall::{creation_count, read_buffer_blocking, wgpu};
use std::f64::consts::{FRAC_PI_2, PI};

const SIZE: u32 = 128;
const FOUR_PLUS_FIVE: fn() -> SoftShadowSettings = SoftShadowSettings::default;

fn off() -> SoftShadowSettings {
    SoftShadowSettings {
        search: PenumbraSearch::Off,
        ..Default::default()
    }
}

// ---- Scenes ---------------------------------------------------------------------------------------------------------

/// Adds a quad, seen and shading from both sides.
fn quad(scene: &mut Scene, corners: [DVec3; 4]) {
    if scene.materials.is_empty() {
        scene.materials.push(Material::diffuse("grey", [0.5; 3]));
    }
    scene.meshes.push(Mesh {
        positions: corners.map(|c| c.as_vec3().to_array()).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    });
    scene.instances.push(Instance::new(scene.meshes.len() - 1, 0));
}

/// A horizontal quad between two corners.
fn level(scene: &mut Scene, y: f64, [x0, z0]: [f64; 2], [x1, z1]: [f64; 2]) {
    let at = |x, z| DVec3::new(x, y, z);
    quad(scene, [at(x0, z1), at(x1, z1), at(x1, z0), at(x0, z0)]);
}

fn light(kind: LightKind) -> Light {
    Light {
        kind,
        ..Light::point(DVec3::ZERO, 1.0, [1.0; 3])
    }
}

/// Looks along `direction`, parallel, at a square of `2 * half` around `target`.
fn parallel_camera(target: DVec3, direction: DVec3, distance: f64, half: f64) -> Camera {
    let back = -direction.normalize();
    let helper = if back.y.abs() > 0.99 { DVec3::NEG_Z } else { DVec3::Y };
    let right = helper.cross(back).normalize();
    Camera {
        name: String::new(),
        transform: DAffine3::from_cols(right, back.cross(right), back, target + distance * back),
        projection: Projection::Orthographic { half_height: half },
    }
}

/// Where a pixel's ray meets the floor y = 0.
fn floor_point(camera: &Camera, size: u32, x: u32, y: u32) -> DVec3 {
    let Projection::Orthographic { half_height: half } = camera.projection else {
        panic!("a parallel camera");
    };
    let at = |k: u32| (2.0 * (f64::from(k) + 0.5) / f64::from(size) - 1.0) * half;
    let start = camera.transform.transform_point3(DVec3::new(at(x), -at(y), 0.0));
    let ahead = camera.transform.transform_vector3(DVec3::NEG_Z);
    start - ahead * (start.y / ahead.y)
}

/// A floor, and over its half x < 0 a plate `gap` above it.
fn edge_scene(gap: f64, kind: LightKind, camera: Camera) -> Scene {
    let mut scene = Scene::default();
    level(&mut scene, 0.0, [-2.0, -2.0], [2.0, 2.0]);
    level(&mut scene, gap, [-1.8, -1.8], [0.0, 1.8]);
    scene.lights.push(light(kind));
    scene.cameras.push(camera);
    scene
}

// ---- Passes, composed by hand ---------------------------------------------------------------------------------------

/// What is rendered of a scene: each light's layer, and direct irradiance by layers and by the test in place.
struct Rendered {
    layers: Vec<Vec<f32>>,
    by_layers: Vec<[f32; 4]>,
    in_place: Vec<[f32; 4]>,
    passes: u64,
}

fn render(gpu: &Gpu, scene: &Scene, settings: &SoftShadowSettings, size: u32, map_size: u32) -> Rendered {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let size = [size; 2];
    let summary = SceneSummary::of(scene).unwrap();
    let frame = UnitFrame::new(&summary.bounds, summary.total_flux).unwrap();
    let mut geometry = MeshGeometry::new(device, queue, scene).unwrap();
    let shadow_maps = ShadowMaps::new(device, &scene.lights, map_size).unwrap();
    let mut lights = Lights::new(device).unwrap();
    lights.write(queue, &frame, &scene.lights, 0).unwrap();
    let mut camera = CameraView::new(&frame, &scene.cameras[0], size, [0.0; 2]);
    let mut views = vec![camera.capture];
    views.extend(shadow_maps.views(&frame, &scene.lights));
    (0..).zip(&mut views).for_each(|(i, v)| v.index = i);
    camera.capture = views[0];
    let context = PrepareContext {
        device,
        queue,
        frame: &frame,
    };
    geometry.prepare(&context, &views).unwrap();
    let timestamps = None;
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut g_buffer = GBuffer::new(device, size).unwrap();
    let shadow_inputs = ShadowMapCaptureInputs {
        shadow_maps: &shadow_maps,
        geometry: &geometry,
        views: &views[1..],
        timestamps,
    };
    let mut capture = ShadowMapCaptureResources::new(device, map_size).unwrap();
    ShadowMapCapture::new().record(&mut encoder, &mut capture, &shadow_inputs);
    let nearest = NearestOccluders::new(device, ShadowMaps::layers(&scene.lights)).unwrap();
    let nearest_inputs = NearestOccluderInputs {
        queue,
        lights: &lights,
        shadow_maps: &shadow_maps,
        nearest: &nearest,
        timestamps,
    };
    let mut nearest_own = NearestOccluderResources::new(device).unwrap();
    NearestOccluder::new(device).record(&mut encoder, &mut nearest_own, &nearest_inputs);
    let g_buffer_inputs = GBufferCaptureInputs {
        queue,
        geometry: &geometry,
        view: &camera,
        timestamps,
    };
    GBufferCapture::new().record(&mut encoder, &mut g_buffer, &g_buffer_inputs);
    let light_count = scene.lights.len() as u32;
    let visibility = Visibility::new(device, size, light_count).unwrap();
    let soft_inputs = SoftShadowInputs {
        queue,
        g_buffer: &g_buffer,
        lights: &lights,
        shadow_maps: &shadow_maps,
        nearest: &nearest,
        visibility: &visibility,
        settings,
        timestamps,
    };
    let mut soft = SoftShadowResources::new(device, size, light_count).unwrap();
    let before = creation_count().passes;
    SoftShadow::new(device).record(&mut encoder, &mut soft, &soft_inputs);
    let passes = creation_count().passes - before;
    let irradiance = [(); 2].map(|()| Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap());
    let direct = DirectLight::new(device);
    for (visibility, irradiance) in [Some(&visibility), None].into_iter().zip(&irradiance) {
        let inputs = DirectLightInputs {
            queue,
            g_buffer: &g_buffer,
            lights: &lights,
            shadow_maps: &shadow_maps,
            visibility,
            irradiance,
            timestamps,
        };
        direct.record(&mut encoder, &mut DirectLightResources::new(device).unwrap(), &inputs);
    }
    queue.submit([encoder.finish()]);
    let read = |i: &Irradiance| lightfall::read_rgba32float_blocking(device, queue, i.view().texture()).unwrap();
    let all = read_layers(gpu, &visibility);
    let pixels = (size[0] * size[1]) as usize;
    Rendered {
        layers: all
            .chunks(pixels)
            .take(scene.lights.len())
            .map(<[f32]>::to_vec)
            .collect(),
        by_layers: read(&irradiance[0]),
        in_place: read(&irradiance[1]),
        passes,
    }
}

/// All layers, one after the other. Rows must be of 64 pixels or a multiple, which need no padding.
fn read_layers(gpu: &Gpu, visibility: &Visibility) -> Vec<f32> {
    let texture = visibility.view().texture();
    let [width, height] = visibility.size();
    assert_eq!(width % 64, 0);
    let bytes = u64::from(width * height * texture.depth_or_array_layers()) * 4;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let target = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout: wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * 4),
            rows_per_image: Some(height),
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    gpu.queue.submit([encoder.finish()]);
    read_buffer_blocking(&gpu.device, &gpu.queue, &buffer).unwrap()
}

// ---- Profiles -------------------------------------------------------------------------------------------------------

/// Share of a disc of radius 1 that shows past a straight edge at x.
fn disc_profile(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.5 + (x * (1.0 - x * x).sqrt() + x.asin()) / PI
}

/// Mean visibility over z at each x, (x, V), x rising.
fn profile(camera: &Camera, size: u32, layer: &[f32]) -> Vec<(f64, f64)> {
    let mut columns: Vec<(f64, f64, f64)> = Vec::new();
    let mut all: Vec<(f64, f64)> = (0..size * size)
        .map(|i| {
            (
                floor_point(camera, size, i % size, i / size).x,
                f64::from(layer[i as usize]),
            )
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (x, v) in all {
        match columns.last_mut() {
            // A line of pixels of one x, but for rounding.
            Some(c) if x - c.0 < 1e-9 => *c = (c.0, c.1 + v, c.2 + 1.0),
            _ => columns.push((x, v, 1.0)),
        }
    }
    columns.into_iter().map(|(x, sum, count)| (x, sum / count)).collect()
}

/// Four standard deviations of the profile's derivative. A disc's chord has the variance R²/4, so that this is 2 R for
/// the exact profile.
fn width(profile: &[(f64, f64)]) -> f64 {
    let steps = || profile.windows(2).map(|w| (0.5 * (w[0].0 + w[1].0), w[1].1 - w[0].1));
    let total: f64 = steps().map(|s| s.1).sum();
    let mean = steps().map(|(x, d)| x * d).sum::<f64>() / total;
    let variance = steps().map(|(x, d)| (x - mean).powi(2) * d).sum::<f64>() / total;
    4.0 * variance.sqrt()
}

/// Maximum and root mean square of the difference to the exact profile of this radius, of means over lines; and the
/// latter of single pixels, inside the penumbra.
fn profile_errors(camera: &Camera, layer: &[f32], radius: f64) -> (f64, f64, f64) {
    let inside: Vec<f64> = profile(camera, SIZE, layer)
        .iter()
        .filter(|(x, _)| x.abs() <= radius)
        .map(|(x, v)| v - disc_profile(x / radius))
        .collect();
    let rms = |errors: &[f64]| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let pixels: Vec<f64> = (0..SIZE * SIZE)
        .map(|i| (floor_point(camera, SIZE, i % SIZE, i / SIZE).x, layer[i as usize]))
        .filter(|(x, _)| x.abs() <= radius)
        .map(|(x, v)| f64::from(v) - disc_profile(x / radius))
        .collect();
    let max = inside.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    (max, rms(&inside), rms(&pixels))
}

/// Distance from lamp to floor, and the lamp's radius.
const HEIGHT: f64 = 2.0;
const RADIUS: f64 = 0.2;

/// Looks straight down from below the plate at a square of three penumbra widths.
fn below_the_plate(gap: f64, penumbra: f64) -> Camera {
    parallel_camera(DVec3::ZERO, DVec3::NEG_Y, 0.5 * gap, 1.5 * penumbra)
}

#[test]
fn a_penumbra_is_as_wide_as_similar_triangles_say() {
    let Some(gpu) = gpu() else { return };
    let position = DVec3::new(0.0, HEIGHT, 0.0);
    let point = LightKind::Point {
        position,
        radius: RADIUS,
    };
    let spot = LightKind::Spot {
        position,
        direction: DVec3::NEG_Y,
        inner_angle: 0.5,
        outer_angle: 0.6,
        radius: RADIUS,
    };
    let angle = 0.05f64;
    let sun = LightKind::Directional {
        direction: DVec3::NEG_Y,
        angle,
    };
    println!("light, gap, camera, settings: measured, exact, ratio; max, rms of lines; rms of pixels");
    for (name, kind) in [("point", point), ("spot", spot), ("sun", sun)] {
        for gap in [0.15, 0.5, 1.1] {
            let exact = match kind {
                LightKind::Directional { .. } => 2.0 * gap * angle.tan(),
                _ => 2.0 * RADIUS * gap / (HEIGHT - gap),
            };
            let straight = below_the_plate(gap, exact);
            // 25 degrees above the floor, across the edge.
            let (s, c) = 25f64.to_radians().sin_cos();
            let oblique = parallel_camera(DVec3::ZERO, DVec3::new(-c, -s, 0.0), 0.4 * gap / s, 0.7 * exact);
            for (view, camera) in [("straight", &straight), ("oblique", &oblique)] {
                for (set, settings) in [("4+5", FOUR_PLUS_FIVE()), ("accurate", SoftShadowSettings::accurate())] {
                    let scene = edge_scene(gap, kind, camera.clone());
                    let layer = &render(&gpu, &scene, &settings, SIZE, 512).layers[0];
                    let measured = width(&profile(camera, SIZE, layer));
                    let (max, rms, pixels) = profile_errors(camera, layer, 0.5 * exact);
                    println!(
                        "{name:5} {gap:4} {view:8} {set:8}: {measured:.4} {exact:.4} {:.3}; {max:.3} {rms:.3}; {pixels:.3}",
                        measured / exact
                    );
                }
            }
        }
    }
    assert_no_errors(&gpu);
}
