//! Whatever the scene, the light, the eye and the settings: what comes out is finite, energy is not made, the same comes again to
//! the bit, and the device has nothing to object.
//!
//! `PROPTEST_CASES` says how many are tried, `PROPTEST_RNG_SEED` which; those that ever failed are kept beside this file and tried
//! first.

use crate::common::meshes::{cube, soup, sphere};
use crate::common::{Component, assert_no_errors};
use crate::studio::{WAYS, assert_finite, studio};
use lightfall::glam::{DAffine3, DQuat, DVec3, EulerRot};
use lightfall::scene::{Camera, Instance, Light, LightKind, Material, Mesh, Projection, Scene};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::{PI, TAU};

/// Cases unless `PROPTEST_CASES` says otherwise.
const CASES: u32 = 24;

/// A number whose logarithm is spread evenly.
fn log_even(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, 0.0..TAU).prop_map(|(z, turn)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * turn.cos(), r * turn.sin(), z)
    })
}

fn place() -> impl Strategy<Value = DVec3> {
    [-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(|p| 3.0 * DVec3::from(p))
}

fn turned() -> impl Strategy<Value = DQuat> {
    [0.0..TAU, 0.0..TAU, 0.0..TAU].prop_map(|[a, b, c]| DQuat::from_euler(EulerRot::XYZ, a, b, c))
}

fn reflectance() -> impl Strategy<Value = [f32; 3]> {
    let channel = || prop_oneof![Just(0.0f32), Just(1.0), 0.0..1.0f32];
    [channel(), channel(), channel()]
}

fn material() -> impl Strategy<Value = Material> {
    let roughness = || prop_oneof![Just(0.0f32), Just(1e-4), Just(1.0), 0.0..1.0f32];
    let diffuse = reflectance().prop_map(|color| Material::diffuse("diffuse", color));
    let shining = (reflectance(), log_even(1e-3, 1e3)).prop_map(|(color, radiance)| Material {
        emission: [radiance as f32; 3],
        ..Material::diffuse("shining", color)
    });
    let metal = (reflectance(), roughness()).prop_map(|(color, roughness)| Material {
        metallic: 1.0,
        roughness,
        ..Material::diffuse("metal", color)
    });
    let index = prop_oneof![Just(1.0f32), Just(1.0001), 1.0..3.0f32];
    let glass = (reflectance(), roughness(), index).prop_map(|(color, roughness, index_of_refraction)| Material {
        transmission: 1.0,
        roughness,
        index_of_refraction,
        ..Material::diffuse("glass", color)
    });
    prop_oneof![4 => diffuse, 1 => shining, 1 => metal, 1 => glass]
}

fn mesh() -> impl Strategy<Value = Mesh> {
    let corner = || [-1.0..1.0f32, -1.0..1.0, -1.0..1.0];
    let triangle = move || [corner(), corner(), corner()];
    prop_oneof![
        2 => Just(cube()),
        1 => Just(sphere(5, 8, 0.0)),
        1 => prop::collection::vec(triangle(), 1..6).prop_map(|triangles| soup("soup", triangles)),
        // Of no area.
        1 => corner().prop_map(|p| soup("point", [[p; 3]])),
    ]
}

fn instance() -> impl Strategy<Value = (Mesh, Material, Instance)> {
    let scale = || prop_oneof![3 => log_even(0.1, 3.0), 1 => log_even(1e-5, 1e2)];
    let flags = any::<[bool; 2]>();
    (
        mesh(),
        material(),
        place(),
        turned(),
        [scale(), scale(), scale()],
        flags,
    )
        .prop_map(|(mesh, material, at, turned, scale, [in_env_maps, casts_shadow])| {
            let transform = DAffine3::from_scale_rotation_translation(DVec3::from(scale), turned, at);
            let instance = Instance {
                transform,
                in_env_maps,
                casts_shadow,
                ..Instance::new(0, 0)
            };
            (mesh, material, instance)
        })
}

fn light() -> impl Strategy<Value = Light> {
    let radius = || prop_oneof![Just(0.0), Just(1e-6), log_even(0.01, 10.0)];
    let point = (place(), radius()).prop_map(|(position, radius)| LightKind::Point { position, radius });
    let spot = (place(), direction(), radius(), 0.0..0.5 * PI, 0.0..=1.0f64).prop_map(
        |(position, direction, radius, outer_angle, share)| LightKind::Spot {
            position,
            direction,
            inner_angle: share * outer_angle,
            outer_angle: outer_angle.max(1e-4),
            radius,
        },
    );
    let angle = prop_oneof![Just(0.0), Just(1e-6), 0.0..0.5f64];
    let sun = (direction(), angle).prop_map(|(direction, angle)| LightKind::Directional { direction, angle });
    let lamp = (place(), turned(), log_even(1e-3, 3.0), log_even(1e-3, 3.0)).prop_map(|(center, turned, u, v)| {
        LightKind::Rectangle {
            center,
            half_u: turned * (u * DVec3::X),
            half_v: turned * (v * DVec3::Y),
        }
    });
    let intensity = prop_oneof![1 => Just(0.0), 8 => log_even(1e-6, 1e6)];
    (prop_oneof![point, spot, sun, lamp], reflectance(), intensity).prop_map(|(kind, color, intensity)| Light {
        name: "light".into(),
        kind,
        color,
        intensity: intensity as f32,
    })
}

fn camera() -> impl Strategy<Value = Camera> {
    let projection = prop_oneof![
        4 => (0.05..3.1f64).prop_map(|fov_y| Projection::Perspective { fov_y }),
        1 => log_even(0.01, 10.0).prop_map(|half_height| Projection::Orthographic { half_height }),
    ];
    (place(), turned(), projection).prop_map(|(eye, turned, projection)| Camera {
        name: "eye".into(),
        transform: DAffine3::from_rotation_translation(turned, 1.5 * eye),
        projection,
    })
}

fn scene() -> impl Strategy<Value = Scene> {
    let instances = prop::collection::vec(instance(), 1..6);
    let lights = prop::collection::vec(light(), 0..4);
    let sky = prop::option::weighted(0.15, log_even(1e-3, 1e3));
    (instances, lights, sky, camera()).prop_map(|(parts, mut lights, sky, camera)| {
        let mut scene = Scene::default();
        for (index, (mesh, material, instance)) in parts.into_iter().enumerate() {
            scene.meshes.push(mesh);
            scene.materials.push(material);
            scene.instances.push(Instance {
                mesh: index,
                material: index,
                ..instance
            });
        }
        lights.extend(sky.map(|radiance| Light {
            name: "sky".into(),
            kind: LightKind::Environment {
                image: None,
                rotation: 0.0,
            },
            color: [1.0; 3],
            intensity: radiance as f32,
        }));
        (scene.lights, scene.cameras) = (lights, vec![camera]);
        scene
    })
}

/// A few settings, by name, that are turned at random.
fn overrides() -> impl Strategy<Value = Vec<(&'static str, &'static str)>> {
    const KNOBS: [(&str, &[&str]); 16] = [
        ("photons", &["0", "1", "63", "500", "3000"]),
        ("bounces", &["0", "1", "2", "5", "9"]),
        ("env_maps.count", &["1", "2", "5"]),
        ("env_maps.size", &["8", "16", "33"]),
        ("shadow_maps.size", &["8", "33", "128"]),
        ("splatter.photons", &["1", "40", "1000"]),
        ("splatter.subsampling", &["1", "2", "4", "8"]),
        ("splatter.boundary", &["off", "kernel-area"]),
        ("splatter.kernel", &["constant", "cone", "epanechnikov"]),
        ("upsampler.levels", &["at-once", "by-levels"]),
        ("tracer.roulette_from", &["0", "1", "3"]),
        ("emission.first_hits", &["shadow-maps", "traced"]),
        ("caustic.photons", &["0", "1", "500"]),
        ("soft_shadow.method", &["hard", "pcf", "pcss", "cross", "disc"]),
        ("specular.paths", &["1", "3"]),
        ("environment.suns", &["0", "1", "9"]),
    ];
    prop::collection::vec((0..KNOBS.len(), 0..5usize), 0..5).prop_map(|turned| {
        let value = |(knob, value): (usize, usize)| (KNOBS[knob].0, KNOBS[knob].1[value % KNOBS[knob].1.len()]);
        turned.into_iter().map(value).collect()
    })
}

fn sides() -> impl Strategy<Value = [u32; 2]> {
    let side = || prop_oneof![1 => Just(1u32), 4 => 1..24u32];
    [side(), side()]
}

/// Most of the light that is reflected, of any channel.
fn highest_albedo(scene: &Scene) -> f64 {
    let colors = scene.materials.iter().flat_map(|m| m.base_color);
    f64::from(colors.fold(0.0, f32::max))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(CASES),
        rng_seed: match std::env::var("PROPTEST_RNG_SEED").ok().and_then(|n| n.parse().ok()) {
            Some(seed) => RngSeed::Fixed(seed),
            None => RngSeed::Fixed(1),
        },
        max_shrink_iters: 200,
        ..ProptestConfig::default()
    })]

    #[test]
    fn pictures_are_finite_repeat_and_make_no_energy(
        scene in scene(),
        way in 0..WAYS.len(),
        more in overrides(),
        size in sides(),
    ) {
        let Some(mut studio) = studio() else { return Ok(()) };
        let Some(studio) = studio.as_mut() else { return Ok(()) };
        let way = &WAYS[way];
        let mut pictures = Vec::new();
        for _ in 0..2 {
            let mut offline = match studio.stage(way, &more, &scene, size, Component::All) {
                Ok(offline) => offline,
                // Refused by name.
                Err(error) => {
                    prop_assert!(!error.to_string().is_empty());
                    break;
                }
            };
            for _ in 0..2 {
                if let Err(error) = offline.render_frame(None) {
                    prop_assert!(!error.to_string().is_empty());
                }
            }
            let rgb = offline.read().unwrap();
            assert_finite(&rgb, way.name);
            // What sets out from a surface came there, and was reflected.
            let hops = offline.statistics().unwrap();
            let albedo = highest_albedo(&scene);
            for pair in hops.windows(2) {
                for c in 0..3 {
                    let (came, leaves) = (f64::from(pair[0].stored[c]), f64::from(pair[1].emitted[c]));
                    prop_assert!(leaves <= came * albedo * 1.001 + 1e-6, "{leaves} of {came}, albedo {albedo}");
                }
            }
            pictures.push(rgb);
        }
        if let [first, second] = &pictures[..] {
            prop_assert!(first == second, "another picture the second time");
        }
        assert_no_errors(studio.gpu);
    }
}
