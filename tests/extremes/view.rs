//! Where the eye stands, what it takes in, and how many pixels it has.

use crate::common::{Component, assert_no_errors};
use crate::studio::{METHODS, SIZE, WAYS, assert_finite, by_name, mean, studio};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::PathComponent;
use lightfall::scene::{Camera, Projection, Scene, samples};

/// Where the eye of the box stands.
const OUTSIDE: DVec3 = DVec3::new(2.78, 2.73, -8.0);

fn seen(eye: DVec3, target: DVec3, degrees: f64) -> Scene {
    let mut scene = samples::cornell(0.3);
    let forward = (target - eye).normalize();
    let right = forward
        .cross(if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::X })
        .normalize();
    scene.cameras = vec![Camera {
        name: "eye".into(),
        transform: DAffine3::from_cols(right, right.cross(forward), -forward, eye),
        projection: Projection::Perspective {
            fov_y: degrees.to_radians(),
        },
    }];
    scene
}

#[test]
#[ignore = "takes a minute, and memory that the software driver keeps"]
fn the_eye_may_stand_and_look_where_it_likes() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let middle = DVec3::new(2.78, 2.73, 2.0);
    let wide = seen(middle.with_z(0.5), middle.with_z(5.0), 179.0);
    for (row, scene) in [
        (
            "in the back wall, looking in",
            seen(DVec3::new(2.78, 2.73, 5.592), OUTSIDE, 60.0),
        ),
        ("in a block", seen(DVec3::new(3.68, 1.6, 3.51), middle, 60.0)),
        (
            "grazing the floor",
            seen(DVec3::new(2.78, 1e-4, -0.5), DVec3::new(2.78, 0.0, 3.0), 40.0),
        ),
        ("field of view 179 degrees", wide.clone()),
    ] {
        for way in &WAYS {
            if way.sample == "cornell" {
                let all = studio.picture(way, &[], &scene, SIZE, Component::All).unwrap();
                assert_finite(&all, row);
            }
        }
    }
    studio.methods_keep_to_twice_the_nominal_error("field of view 179 degrees", &wide);
    assert_no_errors(studio.gpu);
}

/// A picture of next to one point is as bright as the point is in a wider one, where light is kept on surfaces. Kernels of photons
/// are at most 23 pixels wide: in such a picture they have few photons, and are noise.
#[test]
fn a_needle_of_a_view_shows_what_the_middle_of_a_wider_one_does() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let at = |degrees| seen(OUTSIDE, DVec3::new(1.3, 4.0, 5.592), degrees);
    for way in ["final gathering", "surface lights", "illumination maps"].map(by_name) {
        let mut of = |degrees| {
            studio
                .picture(&way, &[], &at(degrees), SIZE, Component::Indirect)
                .unwrap()
        };
        let (needle, wider) = (of(0.1), of(2.0));
        let side = SIZE[0] as usize;
        let middle: Vec<_> = [0, 1, side, side + 1]
            .map(|offset| wider[(side / 2 - 1) * (side + 1) + offset])
            .to_vec();
        let (own, expected) = (mean(&needle), mean(&middle));
        println!(
            "| field of view 0.1 degrees | {} | {own:.4}, in 2 degrees {expected:.4} | |",
            way.name
        );
        assert!((own / expected - 1.0).abs() < 0.1, "{}: {own} and {expected}", way.name);
    }
    assert_no_errors(studio.gpu);
}

#[test]
#[ignore = "takes minutes"]
fn pictures_may_have_one_pixel_be_a_line_and_have_odd_sides() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let scene = samples::cornell(0.3);
    for size in [[1, 1], [1, 1023], [1023, 1], [1, 4096], [33, 17], [7, 5], [2, 3]] {
        for way in &WAYS {
            let is_costly = size[0] * size[1] > 2048;
            if is_costly && !METHODS.contains(&way.name) {
                continue;
            }
            let scene = samples::by_name(way.sample, 0.3).unwrap();
            let all = studio.picture(way, &[], &scene, size, Component::All).unwrap();
            assert_eq!(all.len() as u32, size[0] * size[1]);
            assert_finite(&all, way.name);
        }
    }
    // The middle pixel of a picture of odd sides is that of a picture of one, seen through its share of the angle.
    let size = [33, 33];
    let Projection::Perspective { fov_y } = scene.cameras[0].projection else {
        return;
    };
    let mut one = scene.clone();
    one.cameras[0].projection = Projection::Perspective {
        fov_y: 2.0 * ((0.5 * fov_y).tan() / f64::from(size[1])).atan(),
    };
    for way in METHODS.map(by_name) {
        let of = |studio: &mut crate::studio::Studio, scene, size| {
            studio.picture(&way, &[], scene, size, Component::Direct).unwrap()
        };
        let (all, single) = (of(studio, &scene, size), of(studio, &one, [1, 1]));
        let (middle, single) = (all[all.len() / 2], single[0]);
        for c in 0..3 {
            assert!(
                (middle[c] / single[c] - 1.0).abs() < 1e-3,
                "{}: {middle:?}, {single:?}",
                way.name
            );
        }
    }
    let truth = studio.truth(&one, [1, 1], PathComponent::Indirect);
    for way in METHODS.map(by_name) {
        let rgb = studio.picture(&way, &[], &one, [1, 1], Component::Indirect).unwrap();
        println!("| 1 × 1 | {} | {:?} | {:?} |", way.name, rgb[0], truth.image.rgb[0]);
    }
    assert_no_errors(studio.gpu);
}
