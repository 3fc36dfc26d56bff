//! What moves, goes away and comes back: pictures after it are those of a renderer that never saw it.

use crate::common::{Component, assert_no_errors};
use crate::studio::{SIZE, WAYS, assert_finite, error_of, mean, report, studio};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::PathComponent;
use lightfall::scene::{Scene, samples};

/// Frames after which all photons, kept light too, are those of the scene as it is.
const SETTLED: u32 = 24;

fn with_short_block_moved(by: DVec3) -> Scene {
    let mut scene = samples::cornell(0.3);
    let block = scene.instances.iter_mut().find(|i| i.name == "short block").unwrap();
    block.transform = DAffine3::from_translation(by) * block.transform;
    scene
}

#[test]
#[ignore = "takes minutes"]
fn an_object_may_leave_the_scene_and_come_back() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    let still = samples::cornell(0.3);
    let truth = studio.truth(&still, SIZE, PathComponent::Indirect);
    for (row, by) in [
        ("teleports", DVec3::new(1.5, 2.0, 0.5)),
        ("grows the bounds by 2^10", DVec3::new(5000.0, 0.0, 0.0)),
        ("leaves them by 1e6", DVec3::new(0.0, 1e6, 1e6)),
    ] {
        for way in WAYS.iter().filter(|way| way.sample == "cornell") {
            let nominal = studio.nominal(way);
            let mut offline = studio.stage(way, &[], &still, SIZE, Component::Indirect).unwrap();
            offline.render_frame(None).unwrap();
            offline.set_scene(with_short_block_moved(by)).unwrap();
            for _ in 0..2 {
                offline.render_frame(None).unwrap();
                assert_finite(&offline.read().unwrap(), row);
            }
            offline.set_scene(still.clone()).unwrap();
            for _ in 0..SETTLED {
                offline.render_frame(None).unwrap();
            }
            report(row, way.name, error_of(offline.read().unwrap(), SIZE, &truth), nominal);
        }
    }
    assert_no_errors(studio.gpu);
}

#[test]
fn a_light_that_goes_out_leaves_no_light_behind() {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    for way in &WAYS {
        let lit = samples::by_name(way.sample, 0.3).unwrap();
        let mut dark = lit.clone();
        for light in &mut dark.lights {
            light.intensity = 0.0;
        }
        let mut offline = studio.stage(way, &[], &lit, SIZE, Component::All).unwrap();
        for _ in 0..SETTLED {
            offline.render_frame(None).unwrap();
        }
        let before = offline.read().unwrap();
        assert!(mean(&before) > 0.0);
        offline.set_scene(dark).unwrap();
        for _ in 0..SETTLED {
            offline.render_frame(None).unwrap();
            assert_finite(&offline.read().unwrap(), way.name);
        }
        let after = mean(&offline.read().unwrap());
        println!("| a light goes out | {} | {after:.1e} | |", way.name);
        assert_eq!(after, 0.0, "{}", way.name);
        // And comes back as it was.
        offline.set_scene(lit).unwrap();
        for _ in 0..SETTLED {
            offline.render_frame(None).unwrap();
        }
        let back = mean(&offline.read().unwrap());
        let before = mean(&before);
        assert!(
            (back / before - 1.0).abs() < 0.03,
            "{}: {back} instead of {before}",
            way.name
        );
    }
    assert_no_errors(studio.gpu);
}
