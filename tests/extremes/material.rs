//! Surfaces that take all light, or none, and metal and glass between smooth and rough.

use crate::common::{Component, assert_no_errors};
use crate::studio::{METHODS, SIZE, Studio, WAYS, assert_finite, by_name, mean, studio};
use lightfall::reference::PathComponent;
use lightfall::scene::{Material, Scene, samples};

/// The box with both blocks of one material.
fn with_blocks_of(material: Material) -> Scene {
    let mut scene = samples::cornell(0.3);
    scene.materials.push(material);
    let last = scene.materials.len() - 1;
    for instance in &mut scene.instances {
        if instance.name.contains("block") {
            instance.material = last;
        }
    }
    scene
}

#[test]
#[ignore = "takes a minute, and memory that the software driver keeps"]
fn surfaces_may_take_all_light_or_none() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let mut white = samples::cornell(0.3);
    for material in &mut white.materials {
        material.base_color = [1.0; 3];
    }
    studio.methods_keep_to_twice_the_nominal_error("albedo 1 everywhere", &white);
    let black_blocks = with_blocks_of(Material::diffuse("soot", [0.0; 3]));
    studio.methods_keep_to_twice_the_nominal_error("albedo 0 of two blocks", &black_blocks);
    let mut black = white;
    for material in &mut black.materials {
        material.base_color = [0.0; 3];
    }
    for way in WAYS.iter().filter(|way| way.sample == "cornell") {
        let rgb = studio.picture(way, &[], &black, SIZE, Component::All).unwrap();
        assert!(rgb.iter().flatten().all(|&v| v == 0.0), "{}", way.name);
    }
    let too_bright = with_blocks_of(Material::diffuse("lamp black", [1.0, 1.000_001, 1.0]));
    let error = too_bright.validate().unwrap_err().to_string();
    assert!(error.contains("lamp black") && error.contains("base_color"), "{error}");
    assert_no_errors(studio.gpu);
}

/// Means of all light against that of paths, which do not find caustics of a bulb: a lamp with an extent lights the box.
#[test]
#[ignore = "takes minutes"]
fn metal_and_glass_may_be_smooth_rough_and_of_any_density() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let metal = |roughness| Material {
        metallic: 1.0,
        roughness,
        ..Material::diffuse("metal", [0.9; 3])
    };
    let glass = |index_of_refraction, roughness| Material {
        transmission: 1.0,
        index_of_refraction,
        roughness,
        ..Material::diffuse("glass", [1.0; 3])
    };
    let rows = [
        ("metal, roughness 0", metal(0.0)),
        ("metal, roughness 1e-4", metal(1e-4)),
        ("metal, roughness 1", metal(1.0)),
        ("glass, index 1", glass(1.0, 0.0)),
        ("glass, index 1.0001", glass(1.0001, 0.0)),
        ("glass, index 3", glass(3.0, 0.0)),
        ("glass, roughness 1", glass(1.5, 1.0)),
    ];
    for (row, material) in rows {
        let scene = with_blocks_of(material);
        let truth = studio.truth(&scene, SIZE, PathComponent::All);
        for way in ["environment maps", "hybrid", "triangles"].map(by_name) {
            let of = |studio: &mut Studio, component| studio.picture(&way, &[], &scene, SIZE, component).unwrap();
            let all = of(studio, Component::All);
            assert_finite(&all, row);
            println!(
                "| {row} | {} | {:.4} | paths {:.4} |",
                way.name,
                mean(&all),
                mean(&truth.image.rgb)
            );
        }
        for way in METHODS.map(by_name) {
            let all = studio.picture(&way, &[], &scene, SIZE, Component::All).unwrap();
            assert_finite(&all, row);
        }
    }
    assert_no_errors(studio.gpu);
}
