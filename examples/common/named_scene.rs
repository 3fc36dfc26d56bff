//! Scenes by the name that a command line gives.

use super::gltf_scene;
use lightfall::scene::{Scene, samples};
use std::path::Path;

/// `sample:NAME`, or the path of a `.glb` or `.gltf` file, at `time` seconds.
///
/// # Errors
/// One line that says what is wrong.
pub(crate) fn load(name: &str, time: f64) -> Result<Scene, String> {
    match name.strip_prefix("sample:") {
        Some(sample) => samples::by_name(sample, time).ok_or_else(|| {
            let known = samples::NAMES.join(", ");
            format!("no sample is called {sample:?}; there are {known}")
        }),
        None => gltf_scene::load(Path::new(name), time),
    }
}
