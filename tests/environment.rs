//! Light from all around: seen, mirrored, and as suns on surfaces.
#![cfg(all(feature = "bvh", feature = "reference", feature = "samples"))]

mod common;

use common::{Component, Gpu, Offline, Reference, assert_no_errors, gpu, mean, offline};
use lightfall::Error;
use lightfall::frame::{GiRenderer, Settings, TracerKind};
use lightfall::glam::{DAffine3, DVec3, Vec3};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{
    Camera, EnvironmentImage, Instance, Light, LightKind, Material, Mesh, Projection, Scene, SceneSummary, samples,
};
use std::f64::consts::{FRAC_PI_2, PI};

fn settings() -> Settings {
    Settings {
        photons: 50_000,
        bounces: 2,
        shadow_map_size: 256,
        tracer_kind: TracerKind::Bvh,
        ..Settings::balanced()
    }
}

/// Another colour in each texel.
fn patches() -> EnvironmentImage {
    let (width, height) = (16, 8);
    EnvironmentImage {
        name: "patches".into(),
        width,
        height,
        rgb: (0..width * height)
            .map(|i| [1.0 + (i % 7) as f32, 0.2 * (i % 5) as f32, 0.5 + (i % 3) as f32])
            .collect(),
    }
}

fn sky(image: Option<usize>, rotation: f64) -> Light {
    Light {
        kind: LightKind::Environment { image, rotation },
        color: [2.0, 1.0, 0.5],
        ..Light::point(DVec3::ZERO, 1.0, [1.0; 3])
    }
}

/// A square of 200 m seen from 2 m above its middle, looking down or along it.
fn open_plane(material: Material, rotation_of_view: f64) -> Scene {
    Scene {
        meshes: vec![Mesh {
            positions: vec![
                [-100.0, 0.0, 100.0],
                [100.0, 0.0, 100.0],
                [100.0, 0.0, -100.0],
                [-100.0, 0.0, -100.0],
            ],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Mesh::default()
        }],
        materials: vec![material],
        instances: vec![Instance::new(0, 0)],
        cameras: vec![Camera {
            name: String::new(),
            transform: DAffine3::from_translation(2.0 * DVec3::Y) * DAffine3::from_rotation_x(rotation_of_view),
            projection: Projection::Perspective { fov_y: FRAC_PI_2 },
        }],
        ..Scene::default()
    }
}

fn render(gpu: &Gpu, scene: &Scene, settings: &Settings, size: [u32; 2], component: Component) -> Vec<[f32; 3]> {
    offline::render(gpu, scene, settings, size, component).unwrap()
}

/// Directions that a camera's pixels look along, world space.
fn directions(camera: &Camera, [width, height]: [u32; 2]) -> Vec<DVec3> {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let plane = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
    // A quarter turn of view: the image plane at distance 1 is 2 high.
    let aspect = f64::from(width) / f64::from(height);
    let direction = |(x, y)| {
        let local = DVec3::new(aspect * plane(x, width), -plane(y, height), -1.0);
        camera.transform.transform_vector3(local).normalize()
    };
    pixels.map(direction).collect()
}

/// Whether texels are the same a little to every side, so that rounding does not decide.
fn is_inside_texel(image: &EnvironmentImage, direction: DVec3, rotation: f64) -> bool {
    let own = image.texel_at(direction, rotation);
    let off = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    off.iter()
        .all(|o| image.texel_at(direction + 1e-3 * o, rotation) == own)
}

#[test]
fn the_eye_and_mirrors_see_the_texel_that_lies_in_their_direction() {
    let Some(gpu) = gpu() else { return };
    let (size, rotation) = ([96, 64], 0.8);
    let mirror = Material {
        metallic: 1.0,
        roughness: 0.0,
        ..Material::diffuse("mirror", [1.0; 3])
    };
    let image = patches();
    let strength = Vec3::new(2.0, 1.0, 0.5);
    // Along the plane: sky above, mirrored sky below.
    let mut scene = open_plane(mirror, 0.0);
    scene.environments.push(image.clone());
    scene.lights.push(sky(Some(0), rotation));
    // And from a rim, far from the middle of the region.
    let mut away = scene.clone();
    away.cameras[0].transform.translation += DVec3::new(0.0, 0.0, 95.0);
    for (kind, scene) in [
        (TracerKind::Bvh, &scene),
        (TracerKind::ImageSpace, &scene),
        (TracerKind::Bvh, &away),
    ] {
        let settings = Settings {
            tracer_kind: kind,
            ..settings()
        };
        let seen = render(&gpu, scene, &settings, size, Component::All);
        let mut counted = [0; 2];
        for (pixel, mut direction) in seen.iter().zip(directions(&scene.cameras[0], size)) {
            // Close to the horizon the plane ends.
            let is_mirrored = direction.y < 0.0;
            if direction.y.abs() < 0.05 {
                continue;
            }
            direction.y = direction.y.abs();
            if !is_inside_texel(&image, direction, rotation) {
                continue;
            }
            let [column, row] = image.texel_at(direction, rotation);
            let expected = strength * Vec3::from(image.rgb[(row * image.width + column) as usize]);
            let off = (Vec3::from(*pixel) - expected).length() / expected.length();
            assert!(off < 1e-4, "{kind:?}: {direction}: {pixel:?}, expected {expected}");
            counted[usize::from(is_mirrored)] += 1;
        }
        assert!(counted.iter().all(|&n| n > 1000), "{counted:?}");
    }
    // Light straight from the sky is direct, by way of a mirror as well.
    let parts = [Component::Direct, Component::Indirect].map(|c| render(&gpu, &scene, &settings(), size, c));
    assert!(parts[0] == render(&gpu, &scene, &settings(), size, Component::All));
    assert!(parts[1].iter().flatten().all(|&v| v == 0.0));
    assert_no_errors(&gpu);
}

#[test]
fn an_open_plane_gets_the_irradiance_of_the_upper_half() {
    let Some(gpu) = gpu() else { return };
    let mut scene = open_plane(Material::diffuse("grey", [0.5; 3]), -FRAC_PI_2);
    let image = patches();
    // Fine quadrature of L cos over the upper half.
    let mut exact = DVec3::ZERO;
    let (columns, rows) = (640, 640);
    for row in 0..rows {
        let theta = FRAC_PI_2 * (f64::from(row) + 0.5) / f64::from(rows);
        for column in 0..columns {
            let phi = 2.0 * PI * (f64::from(column) + 0.5) / f64::from(columns);
            let direction = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let [x, y] = image.texel_at(direction, 0.8);
            let radiance = Vec3::from(image.rgb[(y * image.width + x) as usize]).as_dvec3();
            exact += radiance * theta.cos() * theta.sin();
        }
    }
    exact *= FRAC_PI_2 / f64::from(rows) * 2.0 * PI / f64::from(columns);
    scene.environments.push(image);
    for (image, exact, name) in [(None, DVec3::splat(PI), "uniform"), (Some(0), exact, "patches")] {
        scene.lights = vec![sky(image, 0.8)];
        let seen = render(&gpu, &scene, &settings(), [16, 16], Component::Direct);
        for channel in 0..3 {
            let expected = 0.5 / PI * exact[channel] * f64::from(scene.lights[0].color[channel]);
            let found = mean(&seen, 16, channel, |_, _| true);
            let off = found / expected - 1.0;
            println!("{name}, channel {channel}: {:+.3} %", 100.0 * off);
            // 24 suns, taken for discs; parts whose colours differ lie along one direction.
            let most = if image.is_none() { 0.012 } else { 0.03 };
            assert!(off.abs() < most, "{name}: {found}, expected {expected}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn more_suns_come_closer_to_the_path_tracer_in_a_courtyard() {
    let Some(gpu) = gpu() else { return };
    let size = [64, 48];
    let scene = samples::courtyard(0.0);
    let reference = |component| {
        let paths = PathTracerSettings {
            component,
            bounces: 2,
            ..Default::default()
        };
        let mut reference = Reference::new(&gpu, scene.clone(), &paths, 0, size).unwrap();
        for _ in 0..512 {
            reference.render_sample(None).unwrap();
        }
        reference.read().unwrap().mean
    };
    let energy = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
    let relative = |found: &[[f32; 3]], truth: &[[f32; 3]]| {
        let floor = (0.01 * energy(truth) / (3.0 * truth.len() as f64)).powi(2);
        let error = |(&a, &b): (&f32, &f32)| f64::from(a - b).powi(2) / (f64::from(b).powi(2) + floor);
        found
            .as_flattened()
            .iter()
            .zip(truth.as_flattened())
            .map(error)
            .sum::<f64>()
            / (3.0 * truth.len() as f64)
    };
    let (direct, indirect) = (reference(PathComponent::Direct), reference(PathComponent::Indirect));
    let mut errors = Vec::new();
    for environment_suns in [4, 24, 48] {
        let settings = Settings {
            environment_suns,
            ..settings()
        };
        let ours = [Component::Direct, Component::Indirect].map(|c| render(&gpu, &scene, &settings, size, c));
        let bias = [
            energy(&ours[0]) / energy(&direct) - 1.0,
            energy(&ours[1]) / energy(&indirect) - 1.0,
        ];
        let error = [relative(&ours[0], &direct), relative(&ours[1], &indirect)];
        println!(
            "{environment_suns} suns: direct relMSE {:.4}, energy {:+.2} %; indirect {:.4}, {:+.2} %",
            error[0],
            100.0 * bias[0],
            error[1],
            100.0 * bias[1]
        );
        errors.push((error, bias));
    }
    assert!(errors[2].0[0] < errors[0].0[0], "{errors:?}");
    assert!(
        errors[1..].iter().all(|e| e.1.iter().all(|b| b.abs() < 0.05)),
        "{errors:?}"
    );
    assert_no_errors(&gpu);
}

/// The spare one left out.
fn shadow_layers(renderer: &GiRenderer) -> u32 {
    let texture = renderer.shadow_maps().unwrap().view().texture();
    texture.depth_or_array_layers() - 1
}

#[test]
fn suns_leave_room_for_other_lights_and_missing_images_are_errors() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut scene = samples::cornell(0.0);
    scene.lights = vec![Light::point(DVec3::new(2.78, 5.0, 2.795), 1.0, [1.0; 3]); 20];
    scene.lights.push(sky(Some(0), 0.0));
    scene.environments.push(patches());
    let summary = SceneSummary::of(&scene).unwrap();
    let settings = Settings {
        environment_suns: 48,
        shadow_map_size: 16,
        ..settings()
    };
    let mut renderer = GiRenderer::new(device, &settings).unwrap();
    let error = renderer.set_scene(queue, &summary, &scene.lights).unwrap_err();
    assert!(matches!(error, Error::MissingInput { .. }), "{error}");
    assert!(error.to_string().contains("set_environment"), "{error}");
    renderer.set_environment(queue, Some(&scene.environments[0])).unwrap();
    renderer.set_scene(queue, &summary, &scene.lights).unwrap();
    // Of 64 lights 20 are bulbs, with 6 layers each.
    assert_eq!(shadow_layers(&renderer), 20 * 6 + 44);
    let black = EnvironmentImage {
        rgb: vec![[0.0; 3]; 128],
        ..patches()
    };
    let bad = EnvironmentImage { width: 3, ..patches() };
    let error = renderer.set_environment(queue, Some(&bad)).unwrap_err();
    assert!(error.to_string().contains("patches"), "{error}");
    renderer.set_scene(queue, &summary, &scene.lights).unwrap();
    assert_eq!(shadow_layers(&renderer), 20 * 6 + 44);
    // Another image, and a turn of it, before and after `set_scene`.
    scene.lights = vec![sky(Some(0), 0.0)];
    let mut offline = Offline::new(&gpu, scene.clone(), &settings, 0, [16, 16], Component::All).unwrap();
    let mut picture = |scene: &Scene| {
        offline.set_scene(scene.clone()).unwrap();
        offline.render_frame(None).unwrap();
        offline.read().unwrap()
    };
    let first = picture(&scene);
    let mut turned = scene.clone();
    turned.lights = vec![sky(Some(0), 1.5)];
    assert!(picture(&turned) != first);
    let mut reversed = scene.clone();
    reversed.environments[0].rgb.reverse();
    assert!(picture(&reversed) != first);
    let back = picture(&scene);
    let off: f32 = back
        .iter()
        .flatten()
        .zip(first.iter().flatten())
        .map(|(a, b)| (a - b).abs())
        .sum();
    assert!(off <= 1e-4 * first.iter().flatten().sum::<f32>(), "{off}");
    // Nothing shines: no sun, and no picture either.
    scene.lights = vec![sky(Some(0), 0.0)];
    scene.environments = vec![black];
    let mut offline = Offline::new(&gpu, scene, &settings, 0, [16, 16], Component::All).unwrap();
    offline.render_frame(None).unwrap();
    assert!(offline.read().unwrap().iter().flatten().all(|&v| v == 0.0));
    assert_no_errors(&gpu);
}
