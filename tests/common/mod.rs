//! What the tests share: a device, small scenes, statements about images.
#![allow(dead_code, unused_imports, reason = "each test file uses its own part of this")]

pub(crate) mod brute_force;
pub(crate) mod evaluate;
#[path = "../../examples/common/mod.rs"]
mod examples;
pub(crate) mod meshes;
pub(crate) mod statistics;
pub(crate) mod texture;

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
