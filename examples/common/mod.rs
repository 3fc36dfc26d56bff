//! What the examples and tests share: finding an adapter, loading scenes, rendering without a window, writing files.
#![allow(dead_code, reason = "each example uses its own part of this")]

pub(crate) mod adapter;
pub(crate) mod arguments;
pub(crate) mod clock;
#[cfg(feature = "reference")]
pub(crate) mod contact_sheet;
#[cfg(feature = "reference")]
pub(crate) mod difference;
pub(crate) mod environment_file;
pub(crate) mod exr_file;
pub(crate) mod gltf_scene;
pub(crate) mod lettering;
#[cfg(feature = "samples")]
pub(crate) mod named_scene;
pub(crate) mod offline;
pub(crate) mod picture;
pub(crate) mod progress;
#[cfg(all(feature = "bvh", feature = "reference"))]
pub(crate) mod reference;
#[cfg(feature = "reference")]
pub(crate) mod report;
pub(crate) mod sequence;
#[cfg(feature = "reference")]
pub(crate) mod truth_file;
