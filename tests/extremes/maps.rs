//! Environment maps where they see little.

use crate::common::meshes::cube;
use crate::common::{Component, assert_no_errors};
use crate::studio::{SIZE, WAYS, assert_finite, box_lit_from, mean, studio};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::PathComponent;
use lightfall::scene::{Instance, Light, Scene, samples};

/// Ways that trace through environment maps.
fn ways() -> impl Iterator<Item = &'static crate::studio::Way> {
    let reads_maps =
        |way: &&crate::studio::Way| way.sample == "cornell" && !way.overrides.contains(&("tracer.kind", "bvh"));
    WAYS.iter().filter(reads_maps)
}

#[test]
fn one_map_and_maps_in_walls_keep_energy_below_what_there_is() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let scene = samples::cornell(0.3);
    let truth = mean(&studio.truth(&scene, SIZE, PathComponent::Indirect).image.rgb);
    for (row, centers) in [
        ("one map in the middle", vec![DVec3::new(2.78, 2.73, 2.795)]),
        ("a map in the back wall", vec![DVec3::new(2.0, 3.0, 5.592)]),
        ("a map in a block", vec![DVec3::new(3.68, 1.6, 3.51)]),
        ("a map in a corner", vec![DVec3::ZERO]),
        ("a map outside", vec![DVec3::new(2.78, 2.73, 30.0)]),
    ] {
        for way in ways() {
            let mut offline = studio.stage(way, &[], &scene, SIZE, Component::Indirect).unwrap();
            offline
                .renderer
                .set_env_map_centers(&studio.gpu.queue, &centers)
                .unwrap();
            for _ in 0..2 {
                offline.render_frame(None).unwrap();
            }
            let rgb = offline.read().unwrap();
            assert_finite(&rgb, row);
            println!("| {row} | {} | {:.4} | of {truth:.4} |", way.name, mean(&rgb));
            assert!(mean(&rgb) < 1.35 * truth, "{row}, {}: {}", way.name, mean(&rgb));
        }
    }
    assert_no_errors(studio.gpu);
}

/// A solid block seen from outside: every candidate stands in it. And a room in a block.
#[test]
fn no_place_for_a_map_is_no_error() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let mut block = samples::cornell(0.3);
    block.meshes = vec![cube()];
    block.instances = vec![Instance::new(0, 0)];
    block.lights = vec![Light::point(DVec3::new(2.0, 2.0, -2.0), 10.0, [1.0; 3])];
    block.cameras[0].transform.translation = DVec3::new(0.0, 0.0, -4.0);
    let mut closed: Scene = box_lit_from(DVec3::new(2.78, 5.0, 2.795));
    closed.meshes.push(cube());
    closed.instances.push(Instance {
        transform: DAffine3::from_translation(DVec3::new(2.78, 2.744, 2.796))
            * DAffine3::from_scale(DVec3::new(2.77, 2.74, 2.79)),
        ..Instance::new(closed.meshes.len() - 1, 0)
    });
    for (row, scene) in [("a solid block", block), ("a closed box around all candidates", closed)] {
        for way in ways() {
            let all = studio.picture(way, &[], &scene, SIZE, Component::All).unwrap();
            assert_finite(&all, row);
            println!("| {row} | {} | {:.4} | |", way.name, mean(&all));
        }
    }
    assert_no_errors(studio.gpu);
}
