//! Rough metal that the eye sees, lit by the photons that arrive there.
#![cfg(all(feature = "bvh", feature = "reference", feature = "samples"))]

mod common;

use common::{Component, Gpu, Reference, assert_no_errors, gpu, mean, offline};
use lightfall::frame::{GlossyMethod, Settings, TracerKind};
use lightfall::glam::DVec3;
use lightfall::pass::{Bandwidth, PhotonSplatterSettings};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{Light, LightKind, Material, Scene, samples};

const SIZE: [u32; 2] = [48, 48];

fn settings() -> Settings {
    Settings {
        photons: 100_000,
        frames: 8,
        bounces: 3,
        shadow_map_size: 512,
        tracer_kind: TracerKind::Bvh,
        glossy_method: GlossyMethod::Photons,
        specular_paths: 1,
        specular_surfaces: 4,
        splatter: PhotonSplatterSettings {
            bandwidth: Bandwidth::Density {
                photons: 40.0,
                clamp: [0.25, 4.0],
            },
            ..Default::default()
        },
        ..Settings::balanced()
    }
}

/// The Cornell box with a glossy floor.
fn glossy_floor(material: Material, light: LightKind) -> Scene {
    let mut scene = samples::cornell(0.0);
    assert_eq!(scene.instances[0].name, "floor");
    scene.materials.push(material);
    scene.instances[0].material = scene.materials.len() - 1;
    scene.lights = vec![Light {
        kind: light,
        ..Light::point(DVec3::ZERO, 10.0, [1.0, 0.8, 0.5])
    }];
    scene
}

fn phong(exponent: f32) -> Material {
    Material {
        metallic: 1.0,
        phong_exponent: Some(exponent),
        ..Material::diffuse("Phong", [0.8, 0.7, 0.6])
    }
}

fn rough(roughness: f32) -> Material {
    Material {
        metallic: 1.0,
        roughness,
        ..Material::diffuse("metal", [0.8, 0.7, 0.6])
    }
}

fn bulb() -> LightKind {
    LightKind::Point {
        position: DVec3::new(2.78, 3.4, 2.2),
        radius: 0.0,
    }
}

fn panel() -> LightKind {
    LightKind::Rectangle {
        center: DVec3::new(2.78, 5.4, 2.795),
        half_u: DVec3::new(1.0, 0.0, 0.0),
        half_v: DVec3::new(0.0, 0.0, 1.0),
    }
}

fn truth(gpu: &Gpu, scene: &Scene, component: PathComponent) -> Vec<[f32; 3]> {
    let paths = PathTracerSettings {
        component,
        bounces: 3,
        ..Default::default()
    };
    let mut reference = Reference::new(gpu, scene.clone(), &paths, 0, SIZE).unwrap();
    (0..512).for_each(|_| reference.render_sample(None).unwrap());
    reference.read().unwrap().mean
}

#[test]
fn photons_light_rough_metal_as_the_path_tracer_does() {
    let Some(gpu) = gpu() else { return };
    for (name, material, light) in [
        ("Phong 20, panel", phong(20.0), panel()),
        ("roughness 0.6, bulb", rough(0.6), bulb()),
    ] {
        let scene = glossy_floor(material, light);
        let expected = truth(&gpu, &scene, PathComponent::Specular);
        let found = offline::render(&gpu, &scene, &settings(), SIZE, Component::Specular).unwrap();
        let share = |c| mean(&found, SIZE[0], c, |_, _| true) / mean(&expected, SIZE[0], c, |_, _| true);
        let off = [0, 1, 2].map(|c| share(c) - 1.0);
        println!(
            "{name}: {:+.2}, {:+.2}, {:+.2} %",
            100.0 * off[0],
            100.0 * off[1],
            100.0 * off[2]
        );
        assert!(off.iter().all(|o| o.abs() < 0.04), "{name}: {off:?}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn direct_and_indirect_light_of_rough_metal_add_up_to_all_of_it() {
    let Some(gpu) = gpu() else { return };
    let scene = glossy_floor(rough(0.5), panel());
    let [all, direct, indirect] = [Component::All, Component::Direct, Component::Indirect].map(|component| {
        let settings = Settings {
            frames: 16,
            ..settings()
        };
        offline::render(&gpu, &scene, &settings, SIZE, component).unwrap()
    });
    let parts = direct.as_flattened().iter().zip(indirect.as_flattened());
    for (all, (direct, indirect)) in all.as_flattened().iter().zip(parts) {
        assert!(
            (direct + indirect - all).abs() <= 1e-3 * all,
            "{direct} + {indirect}, {all}"
        );
    }
    assert_no_errors(&gpu);
}
