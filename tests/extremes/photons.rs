//! How many photons and bounces, and where they end.

use crate::common::{Component, assert_no_errors};
use crate::studio::{METHODS, SIZE, Studio, WAYS, assert_finite, box_lit_by, by_name, error_of, mean, report, studio};
use lightfall::Error;
use lightfall::glam::DVec3;
use lightfall::reference::PathComponent;
use lightfall::scene::{LightKind, samples};

#[test]
fn photons_may_be_none_one_and_too_many() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    for way in &WAYS {
        let scene = samples::by_name(way.sample, 0.3).unwrap();
        let mut with = |count: &str, component| studio.picture(way, &[("photons", count)], &scene, SIZE, component);
        let none = with("0", Component::Indirect).unwrap();
        assert!(way.sample != "cornell" || mean(&none) == 0.0, "{}", way.name);
        assert_finite(&none, way.name);
        assert_finite(&with("1", Component::All).unwrap(), way.name);
        // A pool has as many as it says itself.
        if way.name == "surface lights" {
            continue;
        }
        match with("10000000", Component::All) {
            Err(Error::LimitExceeded { .. }) => {}
            other => panic!("{}: ten million photons: {:?}", way.name, other.map(|rgb| mean(&rgb))),
        }
        // As if nothing had been.
        assert_finite(&with("5000", Component::All).unwrap(), way.name);
    }
    assert_no_errors(studio.gpu);
}

#[test]
fn photons_may_all_escape() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let away = LightKind::Spot {
        position: DVec3::new(2.78, 2.73, -4.0),
        direction: DVec3::NEG_Z,
        inner_angle: 0.2,
        outer_angle: 0.3,
        radius: 0.0,
    };
    let scene = box_lit_by(away, 20.0);
    for way in WAYS.iter().filter(|way| way.sample == "cornell") {
        let all = studio.picture(way, &[], &scene, SIZE, Component::All).unwrap();
        assert!(all.iter().flatten().all(|&v| v == 0.0), "{}", way.name);
    }
    assert_no_errors(studio.gpu);
}

#[test]
fn light_may_bounce_never_once_and_many_times() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let scene = samples::cornell(0.3);
    for way in METHODS.map(by_name) {
        let mut with = |bounces: &str| {
            let rgb = studio.picture(&way, &[("bounces", bounces)], &scene, SIZE, Component::Indirect);
            let rgb = rgb.unwrap();
            assert_finite(&rgb, way.name);
            mean(&rgb)
        };
        let [none, one, three, many] = ["0", "1", "3", "64"].map(&mut with);
        println!(
            "| bounces 0, 1, 3, 64 | {} | {none:.4}, {one:.4}, {three:.4}, {many:.4} | |",
            way.name
        );
        assert!(
            none == 0.0 && one > 0.0 && one < three && three < 1.05 * many,
            "{}",
            way.name
        );
        // Albedos of 0.73 at most leave little after a few bounces: no energy is made.
        assert!(many < 1.6 * three, "{}", way.name);
    }
    assert_no_errors(studio.gpu);
}

/// Stored flux is at most what albedos leave, however few the photons.
#[test]
#[ignore = "takes minutes"]
fn few_photons_are_noisy_and_right_in_the_mean() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let scene = samples::cornell(0.3);
    let truth = studio.truth(&scene, SIZE, PathComponent::Indirect);
    let way = by_name("triangles");
    let nominal = studio.nominal(&way);
    let rgb = |studio: &mut Studio, photons: &str| {
        studio
            .picture(&way, &[("photons", photons)], &scene, SIZE, Component::Indirect)
            .unwrap()
    };
    let more = rgb(studio, "40000");
    report("40 000 photons", way.name, error_of(more, SIZE, &truth), nominal);
}
