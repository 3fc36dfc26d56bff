//! What scenes and settings may go to: units of length and power, distance from the origin. Each method of indirect light, each
//! tracer, each shadow.
#![cfg(all(feature = "bvh", feature = "reference"))]

mod common;

use common::{Component, Gpu, Offline, Reference, assert_no_errors, gpu};
use lightfall::frame::Settings;
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::metrics::{self, Image};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{LightKind, Scene, samples};

const SIZE: [u32; 2] = [32, 32];

/// Frames of a picture, each of which may change.
const FRAMES: u32 = 3;

/// Name of a way, a sample, and settings that make it.
type Way = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const WAYS: [Way; 17] = [
    ("environment maps", "cornell", &[]),
    ("a march through them", "cornell", &[("tracer.method", "ordered-march")]),
    ("the paper's search in them", "cornell", &[("tracer.method", "paper")]),
    ("hybrid", "cornell", &[("tracer.kind", "hybrid")]),
    ("triangles", "cornell", &[("tracer.kind", "bvh")]),
    ("quads", "cornell", &[("splatter.shape", "quads")]),
    ("volumes", "cornell", &[("splatter.shape", "volumes")]),
    ("densities on the screen", "cornell", &[("splatter.density", "screen")]),
    (
        "guided photons",
        "two-rooms",
        &[("tracer.kind", "bvh"), ("photons.guided", "0.5")],
    ),
    (
        "selective photons",
        "cornell",
        &[("tracer.kind", "bvh"), ("selective", "on")],
    ),
    (
        "final gathering",
        "cornell",
        &[
            ("tracer.kind", "bvh"),
            ("indirect.method", "final-gather"),
            ("final_gather.rays", "16"),
        ],
    ),
    (
        "surface lights",
        "cornell",
        &[
            ("tracer.kind", "bvh"),
            ("indirect.method", "surface-lights"),
            ("surface_lights.pool", "5000"),
        ],
    ),
    (
        "illumination maps",
        "cornell",
        &[
            ("tracer.kind", "bvh"),
            ("indirect.method", "illumination-maps"),
            ("illumination_maps.texels", "100"),
        ],
    ),
    ("a lamp's penumbra", "penumbra", &[]),
    (
        "a lamp's penumbra by rays",
        "penumbra",
        &[("tracer.kind", "bvh"), ("soft_shadow.method", "rays")],
    ),
    (
        "caustics",
        "glass-sphere",
        &[("tracer.kind", "bvh"), ("caustic.photons", "5000")],
    ),
    ("one pass at last", "cornell", &[("composite.fused", "on")]),
];

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        photons: 5_000,
        env_map_count: 3,
        env_map_size: 32,
        shadow_map_size: 64,
        ..Settings::balanced()
    };
    for (key, value) in overrides {
        settings.set(key, value).unwrap();
    }
    settings
}

fn picture(gpu: &Gpu, scene: &Scene, settings: &Settings, component: Component) -> Vec<[f32; 3]> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, SIZE, component).unwrap();
    for _ in 0..FRAMES {
        offline.render_frame(None).unwrap();
    }
    offline.read().unwrap()
}

/// The scene with all lengths and all power multiplied by powers of two.
fn scaled(scene: &Scene, [lengths, power]: [i32; 2]) -> Scene {
    let length = 2f64.powi(lengths);
    let mut scene = scene.clone();
    for instance in &mut scene.instances {
        instance.transform = DAffine3::from_scale(DVec3::splat(length)) * instance.transform;
    }
    for camera in &mut scene.cameras {
        camera.transform.translation *= length;
    }
    for light in &mut scene.lights {
        light.intensity *= 2f32.powi(power);
        match &mut light.kind {
            LightKind::Point { position, radius } | LightKind::Spot { position, radius, .. } => {
                *position *= length;
                *radius *= length;
            }
            LightKind::Rectangle { center, half_u, half_v } => {
                for v in [center, half_u, half_v] {
                    *v *= length;
                }
            }
            LightKind::Directional { .. } | LightKind::Environment { .. } => {}
        }
    }
    scene
}

/// The scene somewhere else.
fn moved(scene: &Scene, by: DVec3) -> Scene {
    let mut scene = scene.clone();
    for instance in &mut scene.instances {
        instance.transform.translation += by;
    }
    for camera in &mut scene.cameras {
        camera.transform.translation += by;
    }
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => *position += by,
            LightKind::Rectangle { center, .. } => *center += by,
            LightKind::Directional { .. } | LightKind::Environment { .. } => {}
        }
    }
    scene
}

#[test]
fn powers_of_two_in_length_and_power_change_no_bit() {
    let Some(gpu) = gpu() else { return };
    let mut is_same = true;
    for (way, sample, overrides) in WAYS {
        let scene = samples::by_name(sample, 0.3).unwrap();
        let settings = settings(overrides);
        let nominal = picture(&gpu, &scene, &settings, Component::All);
        assert!(nominal.iter().flatten().any(|&v| v > 0.0), "{way}: black");
        for [lengths, power] in [[-40, -60], [40, 60]] {
            let own = picture(&gpu, &scaled(&scene, [lengths, power]), &settings, Component::All);
            // Radiance of a point light falls with the square of distance.
            let back = 2f32.powi(2 * lengths - power);
            let same = own.iter().zip(&nominal).all(|(a, b)| a.map(|v| v * back) == *b);
            println!("{way}: lengths × 2^{lengths}, power × 2^{power}: {same}");
            is_same &= same;
        }
    }
    assert!(is_same);
    assert_no_errors(&gpu);
}

#[test]
fn far_from_the_origin_errors_are_at_most_twice_the_nominal_ones() {
    let Some(gpu) = gpu() else { return };
    for (way, sample, overrides) in WAYS {
        if sample != "cornell" {
            continue;
        }
        let scene = samples::by_name(sample, 0.3).unwrap();
        let settings = settings(overrides);
        let paths = PathTracerSettings {
            component: PathComponent::Indirect,
            bounces: settings.bounces,
            spans_pixel: false,
            ..Default::default()
        };
        let mut reference = Reference::new(&gpu, scene.clone(), &paths, 0, SIZE).unwrap();
        let truth = reference.truth(256).unwrap();
        let image = |rgb| Image {
            width: SIZE[0],
            height: SIZE[1],
            rgb,
        };
        let error = |scene: &Scene| {
            let rgb = picture(&gpu, scene, &settings, Component::Indirect);
            let comparison = metrics::compare(&image(rgb), &truth).unwrap();
            assert!(comparison.finite, "{way}");
            comparison.relmse
        };
        let nominal = error(&scene);
        for sizes in [1e6, 1e8] {
            let by = 10.0 * sizes * DVec3::new(0.6, -0.3, 0.7);
            let far = error(&moved(&scene, by));
            println!("{way}: {nominal:.4}, {sizes:.0e} sizes away {far:.4}");
            assert!(
                far <= 2.0 * nominal,
                "{way}, {sizes:.0e} sizes away: {far} instead of {nominal}"
            );
        }
    }
    assert_no_errors(&gpu);
}
