//! What the tests share: a device, small scenes, statements about images.
#![allow(dead_code, unused_imports, reason = "each test file uses its own part of this")]

pub(crate) mod brute_force;
pub(crate) mod evaluate;
#[path = "../../examples/common/mod.rs"]
mod examples;
pub(crate) mod meshes;
pub(crate) mod rooms;
pub(crate) mod statistics;
pub(crate) mod texture;

use lightfall::glam::DVec3;

pub(crate) use examples::adapter::{self, Gpu, Wishes};
pub(crate) use examples::offline::{self, Component, Offline};
#[cfg(all(feature = "bvh", feature = "reference"))]
pub(crate) use examples::reference::{self, Reference};
pub(crate) use examples::{exr_file, gltf_scene, sequence, truth_file};

/// A device, or `None` with a printed reason where the machine has no usable adapter; a failure where
/// `LIGHTFALL_REQUIRE_GPU=1` says that there must be one.
pub(crate) fn gpu() -> Option<Gpu> {
    gpu_with(Wishes::default())
}

/// As [`gpu`], with more than the defaults.
pub(crate) fn gpu_with(wishes: Wishes) -> Option<Gpu> {
    match Gpu::open(None, wishes) {
        Ok(gpu) => Some(gpu),
        Err(reason) if std::env::var("LIGHTFALL_REQUIRE_GPU").as_deref() == Ok("1") => panic!("{reason}"),
        Err(reason) => {
            println!("skipped: {reason}");
            None
        }
    }
}

/// Fails on any validation error that the device reported.
pub(crate) fn assert_no_errors(gpu: &Gpu) {
    let errors = gpu.take_errors();
    assert!(errors.is_empty(), "the device reported: {errors:#?}");
}

/// Mean over pixels of one channel, where `keep(x, y)`.
pub(crate) fn mean(pixels: &[[f32; 3]], width: u32, channel: usize, keep: impl Fn(u32, u32) -> bool) -> f64 {
    let kept = (0..).zip(pixels).filter(|(i, _)| keep(i % width, i / width));
    let (sum, count) = kept.fold((0.0, 0), |(s, n), (_, p)| (s + f64::from(p[channel]), n + 1));
    sum / f64::from(count)
}

/// Irradiance of a plane by a disc in the sky over that across the disc: quadrature over what stands above the horizon.
pub(crate) fn disc_over_horizon(elevation: f64, angle: f64) -> f64 {
    let axis = DVec3::new(elevation.cos(), elevation.sin(), 0.0);
    let (side, up) = (DVec3::Z, DVec3::Z.cross(axis));
    let steps = 1000;
    let mut sums = [0.0; 2];
    for ring in 0..steps {
        let theta = angle * (f64::from(ring) + 0.5) / f64::from(steps);
        for step in 0..steps {
            let phi = std::f64::consts::TAU * (f64::from(step) + 0.5) / f64::from(steps);
            let toward = theta.cos() * axis + theta.sin() * (phi.cos() * side + phi.sin() * up);
            sums[0] += toward.y.max(0.0) * theta.sin();
            sums[1] += toward.dot(axis) * theta.sin();
        }
    }
    sums[0] / sums[1]
}
