//! A device that goes away, and inputs that it cannot take: an error that says what, and the next good frame is as good as ever.

use crate::common::{Component, Offline, assert_no_errors, gpu};
use crate::studio::{METHODS, SIZE, by_name, settings};
use lightfall::Error;
use lightfall::frame::Settings;
use lightfall::scene::samples;

#[test]
fn a_device_lost_between_frames_is_an_error_and_a_new_one_renders_the_same() {
    let scene = samples::cornell(0.3);
    let picture = |loses_device: bool| {
        let gpu = gpu()?;
        let own = settings(by_name("hybrid").overrides);
        let mut offline = Offline::new(&gpu, scene.clone(), &own, 0, SIZE, Component::All).unwrap();
        offline.render_frame(None).unwrap();
        if loses_device {
            gpu.device.destroy();
            // What is recorded for a device that is gone goes nowhere; whatever reads it back says so.
            let rendered = offline.render_frame(None);
            let read = offline.read();
            assert!(
                matches!(read, Err(Error::ReadBack { .. })),
                "{:?}",
                read.map(|rgb| rgb.len())
            );
            println!("a frame on a lost device: {rendered:?}; reading it: {read:?}");
            return Some(Vec::new());
        }
        let rgb = offline.read().unwrap();
        assert_no_errors(&gpu);
        Some(rgb)
    };
    let Some(before) = picture(false) else { return };
    picture(true);
    assert!(picture(false) == Some(before));
}

#[test]
fn after_what_does_not_fit_the_next_frame_is_as_before() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.3);
    for way in METHODS.map(by_name) {
        let good = settings(way.overrides);
        let mut offline = Offline::new(&gpu, scene.clone(), &good, 0, SIZE, Component::All).unwrap();
        let frames = |offline: &mut Offline<'_>| {
            for _ in 0..2 {
                offline.render_frame(None).unwrap();
            }
            offline.read().unwrap()
        };
        let before = frames(&mut offline);
        let mut too_many = Settings {
            photons: 10_000_000,
            ..good.clone()
        };
        too_many.surface_lights.pool = 10_000_000;
        let is_refused = match offline.set_settings(&too_many) {
            Err(error) => panic!("{}: {error}", way.name),
            Ok(()) => {
                matches!(offline.render_frame(None), Err(Error::LimitExceeded { needed, limit, .. }) if needed > limit)
            }
        };
        assert!(is_refused, "{}", way.name);
        offline.set_settings(&good).unwrap();
        offline.refill();
        let after = frames(&mut offline);
        let worst = before.as_flattened().iter().zip(after.as_flattened());
        let worst = worst.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("{}: {worst:e}", way.name);
        // A view of no size, and of one that no device has.
        for size in [
            [0, 4],
            [4, 0],
            [u32::MAX, 1],
            [1, gpu.device.limits().max_texture_dimension_2d + 1],
        ] {
            let refused = offline.renderer.resize_view(&mut offline.view, size);
            assert!(
                matches!(refused, Err(Error::LimitExceeded { .. })),
                "{size:?}: {refused:?}"
            );
        }
        assert!(before == after && frames(&mut offline) == after, "{}", way.name);
        assert_no_errors(&gpu);
    }
}
