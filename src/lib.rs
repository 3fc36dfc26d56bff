//! Global-illumination passes for wgpu.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod error;
pub mod frame;
mod gpu;
pub mod pass;
mod read_back;
#[cfg(feature = "reference")]
pub mod reference;
pub mod resource;
pub mod scene;
mod timestamps;
pub mod wgsl;

pub use error::Error;
pub use glam;
#[doc(hidden)]
pub use gpu::{CreationCount, creation_count};
pub use read_back::{read_buffer_blocking, read_rgba32float_blocking};
pub use timestamps::Timestamps;
pub use wgpu;
