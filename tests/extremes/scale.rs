//! Units of length and power, distance from the origin, lights of unlike power.

use crate::common::{Component, assert_no_errors};
use crate::studio::{SIZE, WAYS, error_of, report, studio};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::PathComponent;
use lightfall::scene::{LightKind, Scene, samples};

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
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let mut is_same = true;
    for way in &WAYS {
        let scene = samples::by_name(way.sample, 0.3).unwrap();
        let nominal = studio.picture(way, &[], &scene, SIZE, Component::All).unwrap();
        assert!(nominal.iter().flatten().any(|&v| v > 0.0), "{}: black", way.name);
        for [lengths, power] in [[-40, -60], [40, 60]] {
            let scaled = scaled(&scene, [lengths, power]);
            let own = studio.picture(way, &[], &scaled, SIZE, Component::All).unwrap();
            // Radiance of a point light falls with the square of distance.
            let back = 2f32.powi(2 * lengths - power);
            let same = own.iter().zip(&nominal).all(|(a, b)| a.map(|v| v * back) == *b);
            println!("{}: lengths × 2^{lengths}, power × 2^{power}: {same}", way.name);
            is_same &= same;
        }
    }
    assert!(is_same);
    assert_no_errors(studio.gpu);
}

#[test]
fn far_from_the_origin_errors_are_at_most_twice_the_nominal_ones() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let scene = samples::cornell(0.3);
    let truth = studio.truth(&scene, SIZE, PathComponent::Indirect);
    for way in WAYS.iter().filter(|way| way.sample == "cornell") {
        let nominal = studio.nominal(way);
        for sizes in [1e6, 1e8] {
            let far = moved(&scene, 10.0 * sizes * DVec3::new(0.6, -0.3, 0.7));
            let rgb = studio.picture(way, &[], &far, SIZE, Component::Indirect).unwrap();
            report(
                &format!("{sizes:.0e} sizes away"),
                way.name,
                error_of(rgb, SIZE, &truth),
                nominal,
            );
        }
    }
    assert_no_errors(studio.gpu);
}
