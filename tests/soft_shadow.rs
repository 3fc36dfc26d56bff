//! Statements about penumbrae: how wide they are, what their profile is, and where they are not.

mod common;

use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::frame::{Settings, Stage};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{
    Camera, Instance, Light, LightKind, LightSources, Material, Mesh, Projection, Scene, SceneSummary, UnitFrame,
    samples,
};
use lightfall::{creation_count, read_buffer_blocking, wgpu};
use std::f64::consts::{PI, TAU};

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
    render_by(gpu, scene, std::slice::from_ref(settings), (size, map_size), None)
}

/// As [`render`]; `given` lights the surfaces instead of what was gathered.
fn render_by(
    gpu: &Gpu,
    scene: &Scene,
    settings: &[SoftShadowSettings],
    sizes: (u32, u32),
    given: Option<&Visibility>,
) -> Rendered {
    render_with(gpu, scene, settings, sizes, given, SoftShadowResources::new)
}

type NewResources = fn(&wgpu::Device, [u32; 2], u32) -> Result<SoftShadowResources, lightfall::Error>;

fn render_with(
    gpu: &Gpu,
    scene: &Scene,
    settings: &[SoftShadowSettings],
    (size, map_size): (u32, u32),
    given: Option<&Visibility>,
    resources: NewResources,
) -> Rendered {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let size = [size; 2];
    let summary = SceneSummary::of(scene).unwrap();
    let frame = UnitFrame::new(&summary.bounds, summary.total_flux).unwrap();
    let mut geometry = MeshGeometry::new(device, queue, scene).unwrap();
    let shadow_maps = ShadowMaps::new(device, &scene.lights, map_size).unwrap();
    let mut lights = Lights::new(device).unwrap();
    let sources = LightSources {
        lights: &scene.lights,
        ..Default::default()
    };
    lights.write(queue, &frame, &sources, 0).unwrap();
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
    let bvh = settings.iter().any(SoftShadowSettings::uses_triangles).then(|| {
        let mut bvh = BvhGeometry::new(device, queue, scene, &BvhGeometryConfig::default()).unwrap();
        bvh.prepare(queue, &frame).unwrap();
        bvh
    });
    let visibility = Visibility::new(device, size, light_count).unwrap();
    let soft_inputs = SoftShadowInputs {
        queue,
        g_buffer: &g_buffer,
        lights: &lights,
        shadow_maps: &shadow_maps,
        nearest: &nearest,
        bvh: bvh.as_ref(),
        target: ShadowTarget::Visibility(&visibility),
        settings,
        sample_offset: 0,
        timestamps,
    };
    let mut soft = resources(device, size, light_count).unwrap();
    let before = creation_count().passes;
    SoftShadow::new(device).record(&mut encoder, &mut soft, &soft_inputs);
    let passes = creation_count().passes - before;
    let irradiance = [(); 2].map(|()| Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap());
    let direct = DirectLight::new(device);
    for (visibility, irradiance) in [Some(given.unwrap_or(&visibility)), None].into_iter().zip(&irradiance) {
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
                let by = |method| SoftShadowSettings {
                    method,
                    disc_taps: 64,
                    rays: 64,
                    ..SoftShadowSettings::accurate()
                };
                for (set, settings) in [
                    ("4+5", FOUR_PLUS_FIVE()),
                    ("accurate", SoftShadowSettings::accurate()),
                    ("disc", by(ShadowMethod::Disc)),
                    ("pcss", by(ShadowMethod::Pcss)),
                    ("rays", by(ShadowMethod::Rays)),
                ] {
                    let scene = edge_scene(gap, kind, camera.clone());
                    let layer = &render(&gpu, &scene, &settings, SIZE, 512).layers[0];
                    let measured = width(&profile(camera, SIZE, layer));
                    let (max, rms, pixels) = profile_errors(camera, layer, 0.5 * exact);
                    let ratio = measured / exact;
                    // Asked for is a fifth; found are two hundredths.
                    assert!((ratio - 1.0).abs() < 0.05, "{name}, gap {gap}, {view}, {set}: {ratio}");
                    assert!(max < 0.05 && pixels < 0.05, "{name}, gap {gap}, {view}, {set}");
                    println!(
                        "{name:5} {gap:4} {view:8} {set:8}: {measured:.4} {exact:.4} {:.3}; {max:.3} {rms:.3}; {pixels:.3}",
                        ratio
                    );
                }
            }
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_floor_tilted_to_the_sun_stretches_its_penumbra() {
    let Some(gpu) = gpu() else { return };
    let (gap, angle) = (0.4, 0.04f64);
    println!("incidence, turn of the edge, settings: measured, exact, ratio");
    for incidence in [30f64, 60.0] {
        let slant = incidence.to_radians();
        for across in [true, false] {
            // Light that travels across the edge, or along it.
            let side = if across { DVec3::NEG_X } else { DVec3::NEG_Z };
            let kind = LightKind::Directional {
                direction: side * slant.sin() + DVec3::NEG_Y * slant.cos(),
                angle,
            };
            // The edge's shadow from the rim of the sun on either side: slanted by its angle more or less, or to the side
            // of a ray gap / cos long.
            let exact = if across {
                gap * ((slant + angle).tan() - (slant - angle).tan())
            } else {
                2.0 * gap / slant.cos() * angle.tan()
            };
            let x = if across { -gap * slant.tan() } else { 0.0 };
            let camera = parallel_camera(DVec3::new(x, 0.0, 0.0), DVec3::NEG_Y, 0.5 * gap, 1.5 * exact);
            for (set, settings) in [("4+5", FOUR_PLUS_FIVE()), ("accurate", SoftShadowSettings::accurate())] {
                let scene = edge_scene(gap, kind, camera.clone());
                let layer = &render(&gpu, &scene, &settings, SIZE, 512).layers[0];
                let measured = width(&profile(&camera, SIZE, layer));
                let ratio = measured / exact;
                println!("{incidence} across {across:5} {set:8}: {measured:.4} {exact:.4} {ratio:.3}");
                assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
            }
        }
    }
    assert_no_errors(&gpu);
}

/// A lamp to the side; a plate hovers, another stands on the floor. The camera sees the floor alone.
fn two_plates(radius: f64) -> Scene {
    let mut scene = Scene::default();
    level(&mut scene, 0.0, [-2.0, -2.0], [2.0, 2.0]);
    for plate in PLATES {
        let [a, u, v] = plate.map(DVec3::from);
        quad(&mut scene, [a, a + u, a + u + v, a + v]);
    }
    scene.lights.push(light(LightKind::Point {
        position: DVec3::from(LAMP),
        radius,
    }));
    scene.cameras.push(parallel_camera(DVec3::ZERO, DVec3::NEG_Y, 0.3, 1.0));
    scene
}

/// Corner and two sides of each plate.
const PLATES: [[[f64; 3]; 3]; 2] = [
    [[-0.9, 0.6, -0.6], [0.8, 0.0, 0.0], [0.0, 0.0, 0.7]],
    [[0.3, 0.0, -0.3], [0.0, 0.0, 0.6], [0.0, 0.7, 0.0]],
];
const LAMP: [f64; 3] = [0.9, 2.0, 0.3];
const LAMP_RADIUS: f64 = 0.15;

/// A low table, to receive shadows at another height beside the floor's.
const TABLE: [[f64; 3]; 3] = [[-0.9, 0.15, -0.1], [0.6, 0.0, 0.0], [0.0, 0.0, 0.5]];

/// Share of the lamp, a disc towards the receiver, that the plates leave visible, by this many rings of rays.
fn truth(p: DVec3, plates: &[[[f64; 3]; 3]], radius: f64, rings: u32) -> f64 {
    let lamp = DVec3::from(LAMP);
    let axis = (lamp - p).normalize();
    let (u, v) = axis.any_orthonormal_pair();
    let (mut seen, mut all) = (0u32, 0u32);
    for ring in 0..rings {
        // As many rays as the ring's share of the area: each stands for the same.
        let count = 6 * ring + 3;
        for i in 0..count {
            let (s, c) = (TAU * (f64::from(i) + 0.5) / f64::from(count)).sin_cos();
            let at = radius * (f64::from(ring) + 0.5) / f64::from(rings);
            let ray = lamp + at * (c * u + s * v) - p;
            all += 1;
            seen += u32::from(!plates.iter().any(|plate| crosses(p, ray, plate)));
        }
    }
    f64::from(seen) / f64::from(all)
}

/// Whether a segment crosses a parallelogram.
fn crosses(p: DVec3, ray: DVec3, plate: &[[f64; 3]; 3]) -> bool {
    let [a, u, v] = plate.map(DVec3::from);
    let normal = u.cross(v);
    let t = normal.dot(a - p) / normal.dot(ray);
    let q = p + t * ray - a;
    let (s, r) = (q.dot(u) / u.length_squared(), q.dot(v) / v.length_squared());
    (1e-9..=1.0).contains(&t) && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&r)
}

fn rmse(layer: &[f32], truth: &[f64]) -> f64 {
    let sum: f64 = layer.iter().zip(truth).map(|(v, t)| (f64::from(*v) - t).powi(2)).sum();
    (sum / truth.len() as f64).sqrt()
}

fn truth_image(camera: &Camera, radius: f64, rings: u32) -> Vec<f64> {
    (0..SIZE * SIZE)
        .map(|i| truth(floor_point(camera, SIZE, i % SIZE, i / SIZE), &PLATES, radius, rings))
        .collect()
}

#[test]
fn soft_shadows_are_nearer_to_many_shadow_rays_than_hard_ones() {
    let Some(gpu) = gpu() else { return };
    let scene = two_plates(LAMP_RADIUS);
    // 972 rays.
    let truth = truth_image(&scene.cameras[0], LAMP_RADIUS, 18);
    let error = |scene: &Scene, settings: &SoftShadowSettings| {
        rmse(&render(&gpu, scene, settings, SIZE, 1024).layers[0], &truth)
    };
    let hard = error(&two_plates(0.0), &FOUR_PLUS_FIVE());
    let off = error(&scene, &off());
    let few = error(&scene, &FOUR_PLUS_FIVE());
    let many = error(&scene, &SoftShadowSettings::accurate());
    println!("RMSE: hard {hard:.4}, search off {off:.4}, 4+5 {few:.4}, accurate {many:.4}");
    let vary = |name: &str, values: &[f32], set: fn(&mut SoftShadowSettings, f32)| {
        let with = |value: f32| {
            let mut settings = FOUR_PLUS_FIVE();
            set(&mut settings, value);
            format!("{value}: {:.4}", error(&scene, &settings))
        };
        println!(
            "{name} {}",
            values.iter().map(|&v| with(v)).collect::<Vec<_>>().join(", ")
        );
    };
    vary("search_taps", &[1.0, 2.0, 8.0, 16.0], |s, v| s.search_taps = v as u32);
    vary("blur_taps", &[1.0, 2.0, 8.0, 16.0], |s, v| s.blur_taps = v as u32);
    vary("max_radius", &[2.0, 4.0, 8.0, 16.0], |s, v| s.max_radius = v);
    assert!(few < 0.35 * hard, "{few} against {hard}");
    assert!(many <= few && few < off, "{many}, {few}, {off}");
    assert_no_errors(&gpu);
}

#[test]
fn a_penumbra_keeps_to_its_own_surface() {
    let Some(gpu) = gpu() else { return };
    let mut scene = two_plates(LAMP_RADIUS);
    let [a, u, v] = TABLE.map(DVec3::from);
    quad(&mut scene, [a, a + u, a + u + v, a + v]);
    let plates = [PLATES[0], PLATES[1], TABLE];
    let on_table = |p: DVec3| p.x > a.x && p.x < (a + u).x && p.z > a.z && p.z < (a + v).z;
    let truth: Vec<f64> = (0..SIZE * SIZE)
        .map(|i| {
            let p = floor_point(&scene.cameras[0], SIZE, i % SIZE, i / SIZE);
            let p = if on_table(p) { p.with_y(a.y) } else { p };
            truth(p, &plates, LAMP_RADIUS, 18)
        })
        .collect();
    let error = |range_scale: f32| {
        let settings = SoftShadowSettings {
            range_scale,
            ..FOUR_PLUS_FIVE()
        };
        rmse(&render(&gpu, &scene, &settings, SIZE, 1024).layers[0], &truth)
    };
    let errors = [0.05, 0.25, 0.5, 1.0, 2.0, 100.0].map(|c| (c, error(c)));
    println!("range_scale: {errors:.4?}");
    let (own, all) = (errors[2].1, errors[5].1);
    assert!(own < all, "{own} against {all} of a blur that knows no surfaces");
    assert_no_errors(&gpu);
}

#[test]
fn a_lamp_without_extent_casts_hard_shadows_bit_for_bit_and_without_a_search() {
    let Some(gpu) = gpu() else { return };
    let point = render(&gpu, &two_plates(0.0), &FOUR_PLUS_FIVE(), SIZE, 512);
    assert_eq!(point.passes, 1, "the test alone");
    assert!(point.layers[0].iter().all(|v| [0.0, 1.0].contains(v)));
    assert!(point.layers[0].contains(&0.0) && point.layers[0].contains(&1.0));
    assert!(point.by_layers == point.in_place);
    let lamp = render(&gpu, &two_plates(LAMP_RADIUS), &FOUR_PLUS_FIVE(), SIZE, 512);
    assert_eq!(lamp.passes, 4, "test, list, search, blur");
    assert!(
        lamp.in_place == point.in_place,
        "without visibility, extent changes nothing"
    );
    assert!(lamp.by_layers != point.by_layers);
    let unsearched = render(&gpu, &two_plates(LAMP_RADIUS), &off(), SIZE, 512);
    assert_eq!(unsearched.passes, 3, "test, list, blur");
    assert_no_errors(&gpu);
}

#[test]
fn a_lamp_that_shrinks_to_a_point_casts_a_points_shadow() {
    let Some(gpu) = gpu() else { return };
    let hard = render(&gpu, &two_plates(0.0), &FOUR_PLUS_FIVE(), SIZE, 512);
    for settings in [FOUR_PLUS_FIVE(), SoftShadowSettings::accurate(), off()] {
        let tiny = render(&gpu, &two_plates(1e-6), &settings, SIZE, 512);
        assert!(tiny.layers == hard.layers && tiny.by_layers == hard.by_layers);
    }
    assert_no_errors(&gpu);
}

#[test]
fn visibility_is_a_share_whatever_the_lamp() {
    let Some(gpu) = gpu() else { return };
    let is_a_share = |scene: &Scene, what: &str| {
        for settings in [FOUR_PLUS_FIVE(), SoftShadowSettings::accurate(), off()] {
            let rendered = render(&gpu, scene, &settings, SIZE, 128);
            let layer = &rendered.layers[0];
            assert!(layer.iter().all(|v| (0.0..=1.0).contains(v)), "{what}");
            assert!(rendered.by_layers.iter().flatten().all(|v| v.is_finite()), "{what}");
        }
    };
    for radius in [1e-30, 0.5, 2.0, 1e3, f64::MAX] {
        is_a_share(&two_plates(radius), &format!("radius {radius}"));
    }
    // Inside a closed box, against one of its sides.
    let mut walled_in = two_plates(LAMP_RADIUS);
    let lamp = DVec3::from(LAMP);
    for side in [DVec3::X, DVec3::Y, DVec3::Z] {
        let (u, v) = (
            0.1 * side.any_orthonormal_vector(),
            0.1 * side.cross(side.any_orthonormal_vector()),
        );
        for at in [lamp - 1e-5 * side, lamp + 0.1 * side] {
            quad(&mut walled_in, [at - u - v, at + u - v, at + u + v, at - u + v]);
        }
    }
    is_a_share(&walled_in, "inside an occluder");
    // A sun that fills the sky, on the horizon; one from below; receivers outside the spot's map; a lamp sunk into the
    // floor.
    for kind in [
        LightKind::Directional {
            direction: DVec3::new(1.0, -0.001, 0.0),
            angle: 1.5,
        },
        LightKind::Directional {
            direction: DVec3::Y,
            angle: 0.1,
        },
        LightKind::Spot {
            position: DVec3::new(0.0, 0.2, 0.0),
            direction: DVec3::new(1.0, -0.2, 0.0),
            inner_angle: 0.0,
            outer_angle: 0.3,
            radius: 0.5,
        },
        LightKind::Point {
            position: DVec3::new(0.0, 0.0, 0.0),
            radius: 0.5,
        },
    ] {
        let mut scene = two_plates(0.0);
        scene.lights[0].kind = kind;
        is_a_share(&scene, &format!("{kind:?}"));
    }
    // Seen along the floor, with sky above it and plates in the way.
    let mut grazing = two_plates(LAMP_RADIUS);
    grazing.cameras[0] = Camera {
        name: String::new(),
        transform: DAffine3::from_translation(DVec3::new(0.0, 0.02, 3.0)),
        projection: Projection::Perspective { fov_y: 1.0 },
    };
    is_a_share(&grazing, "along the floor");
    assert_no_errors(&gpu);
}

#[test]
fn powers_of_two_in_length_change_no_bit_and_neither_does_a_second_frame() {
    let Some(gpu) = gpu() else { return };
    let scene = two_plates(LAMP_RADIUS);
    let reference = render(&gpu, &scene, &FOUR_PLUS_FIVE(), SIZE, 256);
    assert!(render(&gpu, &scene, &FOUR_PLUS_FIVE(), SIZE, 256).layers == reference.layers);
    for exponent in [-30, -1, 7, 30] {
        let length = 2f64.powi(exponent);
        let mut scaled = two_plates(LAMP_RADIUS * length);
        for instance in &mut scaled.instances {
            instance.transform = DAffine3::from_scale(DVec3::splat(length));
        }
        scaled.cameras[0].transform.translation *= length;
        scaled.cameras[0].projection = Projection::Orthographic { half_height: length };
        scaled.lights[0].kind = LightKind::Point {
            position: DVec3::from(LAMP) * length,
            radius: LAMP_RADIUS * length,
        };
        let longer = render(&gpu, &scaled, &FOUR_PLUS_FIVE(), SIZE, 256);
        assert!(longer.layers == reference.layers, "lengths × 2^{exponent}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn nothing_changes_outside_every_penumbra() {
    let Some(gpu) = gpu() else { return };
    // A single edge: its blur reaches up to √2 radii, where it slants between the axes; and a pixel.
    let (gap, exact) = (0.5, 2.0 * RADIUS * 0.5 / (HEIGHT - 0.5));
    let kind = LightKind::Point {
        position: DVec3::new(0.0, HEIGHT, 0.0),
        radius: RADIUS,
    };
    for settings in [FOUR_PLUS_FIVE(), SoftShadowSettings::accurate()] {
        let camera = below_the_plate(gap, exact);
        let layer = &render(&gpu, &edge_scene(gap, kind, camera.clone()), &settings, SIZE, 512).layers[0];
        let (mut outside, mut worst_tail) = (0, 0f64);
        for i in 0..SIZE * SIZE {
            let x = floor_point(&camera, SIZE, i % SIZE, i / SIZE).x;
            let (v, hard) = (layer[i as usize], if x > 0.0 { 1.0 } else { 0.0 });
            if x.abs() > 2f64.sqrt() * 0.5 * exact + 3.0 * exact / f64::from(SIZE) {
                outside += 1;
                assert_eq!(v, hard, "at {x}");
            } else if x.abs() > 0.5 * exact {
                worst_tail = worst_tail.max(f64::from(v - hard).abs());
            }
        }
        println!("{outside} pixels outside keep their value; up to {worst_tail:.4} between 1 and √2 radii");
        assert!(outside > SIZE * SIZE / 8);
    }
    // Two occluders at different heights: what a lamp of twice the radius would light, or shade, as a whole. Here one's
    // wide penumbra may be taken for that of the other close by, at few pixels and faintly.
    let scene = two_plates(LAMP_RADIUS);
    let wide = truth_image(&scene.cameras[0], 2.0 * LAMP_RADIUS, 18);
    for (set, settings) in [("4+5", FOUR_PLUS_FIVE()), ("accurate", SoftShadowSettings::accurate())] {
        let layer = &render(&gpu, &scene, &settings, SIZE, 1024).layers[0];
        let outside = || wide.iter().zip(layer).filter(|(t, _)| **t == 0.0 || **t == 1.0);
        let changed = outside().filter(|(t, v)| f64::from(**v) != **t).count();
        let worst = outside().map(|(t, v)| (f64::from(*v) - t).abs()).fold(0.0, f64::max);
        println!(
            "{set}: {changed} of {} pixels outside changed, worst {worst:.4}",
            outside().count()
        );
        assert!(changed * 1000 <= outside().count() && worst < 0.05);
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_hosts_own_visibility_counts_like_the_crates() {
    let Some(gpu) = gpu() else { return };
    let scene = two_plates(LAMP_RADIUS);
    let own = render(&gpu, &scene, &FOUR_PLUS_FIVE(), SIZE, 256);
    // Half of it, in a texture of the host's that can only be read.
    let half: Vec<f32> = own.layers[0].iter().map(|v| 0.5 * v).collect();
    let size = wgpu::Extent3d {
        width: SIZE,
        height: SIZE,
        depth_or_array_layers: 2,
    };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * SIZE),
        rows_per_image: Some(SIZE),
    };
    let one_layer = wgpu::Extent3d {
        depth_or_array_layers: 1,
        ..size
    };
    let bytes = bytemuck::cast_slice(&half);
    gpu.queue
        .write_texture(texture.as_image_copy(), bytes, layout, one_layer);
    let visibility = Visibility::from_view(&texture.create_view(&Default::default())).unwrap();
    assert_eq!((visibility.lights(), visibility.memory_use()), (1, 0));
    assert!(visibility.layer_view(0).is_none(), "it cannot be written");
    let given = render_by(&gpu, &scene, &[FOUR_PLUS_FIVE()], (SIZE, 256), Some(&visibility));
    let is_half = |(given, own): (&[f32; 4], &[f32; 4])| (0..3).all(|c| given[c] == 0.5 * own[c]);
    assert!(given.by_layers.iter().zip(&own.by_layers).all(is_half));
    assert_no_errors(&gpu);
}

#[test]
fn each_light_has_its_own_layer_and_their_light_adds_up() {
    let Some(gpu) = gpu() else { return };
    let lights = [
        light(LightKind::Point {
            position: DVec3::new(-0.5, 1.6, -0.4),
            radius: 0.0,
        }),
        light(LightKind::Point {
            position: DVec3::from(LAMP),
            radius: LAMP_RADIUS,
        }),
        light(LightKind::Directional {
            direction: DVec3::new(0.4, -1.0, 0.3),
            angle: 0.06,
        }),
        light(LightKind::Spot {
            position: DVec3::new(-0.6, 1.9, 0.6),
            direction: DVec3::new(0.2, -1.0, -0.3),
            inner_angle: 0.3,
            outer_angle: 0.6,
            radius: 0.1,
        }),
    ];
    let with = |lights: &[Light]| {
        let mut scene = two_plates(0.0);
        scene.lights = lights.to_vec();
        render(&gpu, &scene, &FOUR_PLUS_FIVE(), SIZE, 256)
    };
    let all = with(&lights);
    assert_eq!(all.passes, 1 + 3 * 4);
    let alone: Vec<Rendered> = lights.iter().map(|l| with(std::slice::from_ref(l))).collect();
    for (light, own) in alone.iter().enumerate() {
        assert!(all.layers[light] == own.layers[0], "light {light}");
        let is_soft = own.layers[0].iter().any(|v| *v > 0.0 && *v < 1.0);
        assert_eq!(is_soft, light > 0);
    }
    // Each alone has its own unit of flux: compare shares of the four at full visibility.
    let scale = |lights: &[Light]| {
        let mut scene = two_plates(0.0);
        scene.lights = lights.to_vec();
        let summary = SceneSummary::of(&scene).unwrap();
        UnitFrame::new(&summary.bounds, summary.total_flux)
            .unwrap()
            .radiance_scale()
    };
    let whole = scale(&lights);
    let parts: Vec<f64> = lights.iter().map(|l| scale(std::slice::from_ref(l))).collect();
    for (i, sum) in all.by_layers.iter().enumerate() {
        let expected: f64 = alone
            .iter()
            .zip(&parts)
            .map(|(a, s)| f64::from(a.by_layers[i][0]) * s)
            .sum();
        assert!((f64::from(sum[0]) * whole - expected).abs() <= 1e-6 * expected);
    }
    assert_no_errors(&gpu);
}

#[test]
fn the_renderer_gathers_soft_shadows_only_where_a_light_has_an_extent() {
    let Some(gpu) = gpu() else { return };
    let settings = Settings {
        bounces: 0,
        shadow_map_size: 256,
        ..Settings::balanced()
    };
    let lamp = samples::penumbra(0.0);
    let mut bulb = lamp.clone();
    if let LightKind::Point { radius, .. } = &mut bulb.lights[0].kind {
        *radius = 0.0;
    }
    let size = [SIZE, 64];
    let mut offline = Offline::new(&gpu, bulb.clone(), &settings, 0, size, Component::Direct).unwrap();
    let bytes = |offline: &Offline<'_>| offline.memory_by_resource().iter().map(|r| r.1).sum::<u64>();
    let frame = |offline: &mut Offline<'_>| {
        let before = creation_count();
        offline.render_frame(None).unwrap();
        let after = creation_count();
        (after.passes - before.passes, after.bytes - before.bytes)
    };
    let (hard_passes, _) = frame(&mut offline);
    let hard = (offline.read().unwrap(), bytes(&offline));
    assert!(!offline.renderer.plan().unwrap().is_on(Stage::SoftShadow));
    assert!(offline.view.visibility().is_none());
    // Now with an extent: tiles of the shadow maps for the scene; test, list, search, blur for the view.
    offline.set_scene(lamp.clone()).unwrap();
    let (soft_passes, created) = frame(&mut offline);
    assert_eq!(soft_passes, hard_passes + 1 + 4);
    assert_eq!(bytes(&offline), hard.1 + created);
    let pixels = u64::from(size[0] * size[1]);
    assert_eq!(Visibility::size_in_bytes(size, 1), 8 * pixels);
    assert!(created > 20 * pixels && created < 20 * pixels + 8192, "{created}");
    let soft = offline.read().unwrap();
    assert!(soft != hard.0);
    let plan = offline.renderer.plan().unwrap().to_string();
    assert!(
        plan.contains("SoftShadow          on   1 light(s) with an extent"),
        "{plan}"
    );
    // What eyes see is the irradiance of the point times the layer.
    let layer = read_layers(&gpu, offline.view.visibility().unwrap());
    let is_product = |((soft, hard), v): ((&[f32; 3], &[f32; 3]), &f32)| {
        hard[0] == 0.0 || (soft[0] - v * hard[0]).abs() <= 1e-6 * hard[0]
    };
    assert!(soft.iter().zip(&hard.0).zip(&layer).all(is_product));
    // A second frame creates nothing.
    let settled = creation_count();
    assert_eq!(frame(&mut offline), (soft_passes, 0));
    assert_eq!(creation_count().bind_groups, settled.bind_groups);
    assert!(offline.read().unwrap() == soft);
    // And without: all as before.
    offline.set_scene(bulb).unwrap();
    assert_eq!(frame(&mut offline), (hard_passes, 0));
    assert_eq!(bytes(&offline), hard.1);
    assert!(offline.read().unwrap() == hard.0);
    assert_no_errors(&gpu);
}

fn by(method: ShadowMethod) -> SoftShadowSettings {
    SoftShadowSettings {
        method,
        ..Default::default()
    }
}

#[test]
fn rays_to_a_lamp_bring_the_share_of_its_light_that_arrives() {
    let Some(gpu) = gpu() else { return };
    let rays = SoftShadowSettings {
        rays: 256,
        ..by(ShadowMethod::Rays)
    };
    let scene = two_plates(LAMP_RADIUS);
    let disc = truth_image(&scene.cameras[0], LAMP_RADIUS, 18);
    // A rectangle: light arrives by both cosines over the squared distance.
    let lamp = DVec3::from(LAMP);
    let (half_u, half_v) = (0.3 * DVec3::X, 0.15 * DVec3::Z);
    let mut flat = scene.clone();
    flat.lights[0].kind = LightKind::Rectangle {
        center: lamp,
        half_u,
        half_v,
    };
    let side = 24;
    let rectangle: Vec<f64> = (0..SIZE * SIZE)
        .map(|i| {
            let p = floor_point(&scene.cameras[0], SIZE, i % SIZE, i / SIZE);
            let at = |k: u32| (2.0 * f64::from(k) + 1.0) / f64::from(side) - 1.0;
            let (mut seen, mut all) = (0.0, 0.0);
            for k in 0..side * side {
                let ray = lamp + at(k % side) * half_u + at(k / side) * half_v - p;
                let light = (ray.y / ray.length_squared()).powi(2);
                all += light;
                seen += if PLATES.iter().any(|plate| crosses(p, ray, plate)) {
                    0.0
                } else {
                    light
                };
            }
            seen / all
        })
        .collect();
    // A straight edge leaves an error of some 256^-3/4 = 0.016 in the penumbra, a quarter of the picture, and the truths have
    // as much.
    for (name, scene, truth) in [("disc", &scene, &disc), ("rectangle", &flat, &rectangle)] {
        let error = rmse(&render(&gpu, scene, &rays, SIZE, 256).layers[0], truth);
        println!("{name}: RMSE {error:.4}");
        assert!(error < 0.01, "{name}: {error}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn hard_shadows_are_those_of_a_point_and_exact_by_rays() {
    let Some(gpu) = gpu() else { return };
    let point = render(&gpu, &two_plates(0.0), &FOUR_PLUS_FIVE(), SIZE, 512);
    let lamp = render(&gpu, &two_plates(LAMP_RADIUS), &by(ShadowMethod::Hard), SIZE, 512);
    assert_eq!(lamp.passes, 1);
    assert!(lamp.layers == point.layers && lamp.by_layers == point.by_layers);
    let by_rays = SoftShadowSettings {
        test: OccluderTest::Triangles,
        ..by(ShadowMethod::Hard)
    };
    let exact = render(&gpu, &two_plates(LAMP_RADIUS), &by_rays, SIZE, 64);
    let scene = two_plates(0.0);
    let wrong = (0..SIZE * SIZE).zip(&exact.layers[0]).filter(|(i, v)| {
        let p = floor_point(&scene.cameras[0], SIZE, i % SIZE, i / SIZE);
        let ray = DVec3::from(LAMP) - p;
        let is_lit = !PLATES.iter().any(|plate| crosses(p, ray, plate));
        **v != if is_lit { 1.0 } else { 0.0 }
    });
    // The plate that stands on the floor has some of the points that the test looks at below it.
    let wrong = wrong.count();
    println!("{wrong} pixels differ from f64");
    assert!(wrong <= 8, "{wrong}");
    assert_no_errors(&gpu);
}

#[test]
fn each_light_may_have_a_method_of_its_own() {
    let Some(gpu) = gpu() else { return };
    let mut scene = two_plates(LAMP_RADIUS);
    let other = light(LightKind::Point {
        position: DVec3::new(-0.5, 1.6, -0.4),
        radius: 0.1,
    });
    scene.lights.push(other);
    let methods = [ShadowMethod::Pcss, ShadowMethod::Hard];
    let each = render_by(&gpu, &scene, &methods.map(by), (SIZE, 256), None);
    for (light, method) in methods.into_iter().enumerate() {
        let alone = render(&gpu, &scene, &by(method), SIZE, 256);
        assert!(each.layers[light] == alone.layers[light], "{method:?}");
    }
    // Without the textures that Cross and Disc gather in these are hard, and all else is as it was.
    let methods = [ShadowMethod::Pcss, ShadowMethod::Cross];
    let without = SoftShadowResources::without_gathering;
    let found = render_with(&gpu, &scene, &methods.map(by), (SIZE, 256), None, without);
    assert!(found.layers == each.layers);
    // The last entry counts for lights beyond; none at all is hard.
    let last = render_by(&gpu, &scene, &[by(ShadowMethod::Disc)], (SIZE, 256), None);
    assert!(
        last.layers
            .iter()
            .all(|layer| layer.iter().any(|v| *v > 0.0 && *v < 1.0))
    );
    let none = render_by(&gpu, &scene, &[], (SIZE, 256), None);
    assert!(none.layers.iter().flatten().all(|v| [0.0, 1.0].contains(v)));
    assert_no_errors(&gpu);
}

#[test]
fn the_renderer_spends_on_the_brightest_lights_and_asks_for_triangles() {
    let Some(gpu) = gpu() else { return };
    let mut scene = samples::penumbra(0.0);
    let mut dim = scene.lights[0].clone();
    dim.intensity *= 0.25;
    scene.lights.insert(0, dim);
    let settings = |name: &str, value: &str| {
        let mut settings = Settings {
            bounces: 0,
            shadow_map_size: 256,
            ..Settings::balanced()
        };
        settings.set(name, value).unwrap();
        settings
    };
    let layers = |settings: &Settings| {
        let size = [SIZE, 64];
        let mut offline = Offline::new(&gpu, scene.clone(), settings, 0, size, Component::Direct).unwrap();
        offline.render_frame(None).unwrap();
        let visibility = offline.view.visibility();
        let is_on = offline.renderer.plan().unwrap().is_on(Stage::SoftShadow);
        assert_eq!(is_on, visibility.is_some());
        let Some(visibility) = visibility else {
            return [false; 2];
        };
        let all = read_layers(&gpu, visibility);
        let is_soft = |layer: &[f32]| layer.iter().any(|v| *v > 0.0 && *v < 1.0);
        let pixels = (size[0] * size[1]) as usize;
        [is_soft(&all[..pixels]), is_soft(&all[pixels..2 * pixels])]
    };
    assert_eq!(layers(&settings("soft_shadow.lights", "64")), [true, true]);
    assert_eq!(layers(&settings("soft_shadow.lights", "1")), [false, true]);
    assert_eq!(layers(&settings("soft_shadow.lights", "0")), [false, false]);
    assert_eq!(layers(&settings("soft_shadow.method", "rays")), [true, true]);
    assert_no_errors(&gpu);
}

#[test]
fn accumulated_rays_go_elsewhere_in_each_frame_without_indirect_light_too() {
    let Some(gpu) = gpu() else { return };
    for overrides in [
        [("bounces", "0"), ("photons", "1000")],
        [("bounces", "3"), ("photons", "0")],
    ] {
        let mut settings = Settings {
            shadow_map_size: 128,
            frames: 2,
            ..Settings::fast()
        };
        let rays = [("soft_shadow.method", "rays"), ("soft_shadow.rays", "1")];
        for (name, value) in overrides.into_iter().chain(rays) {
            settings.set(name, value).unwrap();
        }
        let size = [64, 64];
        let scene = samples::penumbra(0.0);
        let mut offline = Offline::new(&gpu, scene, &settings, 0, size, Component::Direct).unwrap();
        let mut layer = || {
            offline.render_frame(None).unwrap();
            read_layers(&gpu, offline.view.visibility().unwrap())
        };
        let (first, second) = (layer(), layer());
        let differ = first.iter().zip(&second).filter(|(a, b)| a != b).count();
        assert!(differ > 50, "{overrides:?}: {differ}");
    }
    assert_no_errors(&gpu);
}

/// Pixels of which all around, so many to each side, are equal.
fn is_inside(layer: &[f32], size: u32, reach: i64, pixel: u32) -> bool {
    let (x, y) = (i64::from(pixel % size), i64::from(pixel / size));
    let own = layer[pixel as usize];
    (-reach..=reach).all(|dy| {
        (-reach..=reach).all(|dx| {
            let at = [x + dx, y + dy].map(|c| c.clamp(0, i64::from(size) - 1) as u32);
            layer[(at[1] * size + at[0]) as usize] == own
        })
    })
}

#[test]
fn hard_shadows_have_no_acne_and_stay_at_their_casters() {
    let Some(gpu) = gpu() else { return };
    const MAP: u32 = 256;
    let size = SIZE;
    // A floor, blocks that stand on it, a ramp and a plate just over it.
    let mut scene = Scene::default();
    level(&mut scene, 0.0, [-1.0, -1.0], [1.0, 1.0]);
    let at = |x, y, z| DVec3::new(x, y, z);
    for (x, height) in [(-0.5, 0.4), (0.1, 0.05)] {
        let (a, b) = (x - 0.1, x + 0.1);
        level(&mut scene, height, [a, -0.1], [b, 0.1]);
        quad(
            &mut scene,
            [at(a, 0.0, 0.1), at(b, 0.0, 0.1), at(b, height, 0.1), at(a, height, 0.1)],
        );
        quad(
            &mut scene,
            [
                at(b, 0.0, 0.1),
                at(b, 0.0, -0.1),
                at(b, height, -0.1),
                at(b, height, 0.1),
            ],
        );
        quad(
            &mut scene,
            [
                at(b, 0.0, -0.1),
                at(a, 0.0, -0.1),
                at(a, height, -0.1),
                at(b, height, -0.1),
            ],
        );
        quad(
            &mut scene,
            [
                at(a, 0.0, -0.1),
                at(a, 0.0, 0.1),
                at(a, height, 0.1),
                at(a, height, -0.1),
            ],
        );
    }
    quad(
        &mut scene,
        [
            at(0.4, 0.0, 0.5),
            at(0.9, 0.4, 0.5),
            at(0.9, 0.4, -0.5),
            at(0.4, 0.0, -0.5),
        ],
    );
    level(&mut scene, 0.02, [-0.2, 0.4], [0.2, 0.7]);
    scene
        .cameras
        .push(parallel_camera(DVec3::ZERO, at(0.3, -1.0, -0.6), 3.0, 1.1));
    let by_rays = SoftShadowSettings {
        test: OccluderTest::Triangles,
        ..by(ShadowMethod::Hard)
    };
    for height in [2.0, 0.7, 0.2] {
        let toward = at(-1.2, height, 0.7);
        let kinds = [
            LightKind::Point {
                position: toward,
                radius: 0.0,
            },
            LightKind::Spot {
                position: toward,
                direction: -toward,
                inner_angle: 1.0,
                outer_angle: 1.3,
                radius: 0.0,
            },
            LightKind::Directional {
                direction: -toward,
                angle: 0.0,
            },
        ];
        for kind in kinds {
            let mut scene = scene.clone();
            // The triangles' test needs an extent; its middle is what is tested.
            let mut soft = light(kind);
            match &mut soft.kind {
                LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => *radius = 1e-3,
                LightKind::Directional { angle, .. } => *angle = 1e-3,
                _ => {}
            }
            scene.lights.push(soft);
            let exact = &render(&gpu, &scene, &by_rays, size, MAP).layers[0];
            let found = &render(&gpu, &scene, &by(ShadowMethod::Hard), size, MAP).layers[0];
            // Two texels of the map, where it is coarsest: an eighth of a quarter turn from the light away.
            let texel = 2.0 * 2.5 / f64::from(MAP);
            let reach = (2.0 * texel / (2.2 / f64::from(size))).ceil() as i64;
            let wrong = |of: f32| {
                let inside = (0..size * size).filter(|&i| exact[i as usize] == of && is_inside(exact, size, reach, i));
                let (all, wrong) = inside.fold((0, 0), |(all, wrong), i| {
                    (all + 1, wrong + u32::from(found[i as usize] != of))
                });
                assert!(all > 100, "{kind:?}: {all} pixels of {of}");
                wrong
            };
            let (dark, lit) = (wrong(1.0), wrong(0.0));
            println!("{kind:?}: reach {reach}, {dark} dark by mistake, {lit} lit by mistake");
            assert_eq!((dark, lit), (0, 0), "{kind:?}");
        }
    }
    assert_no_errors(&gpu);
}
