//! Global-illumination passes for wgpu: direct light with soft shadows and diffuse indirect light, for any host that
//! can draw its geometry.
//!
//! Photons start at the lights and land where the lights' shadow maps see a surface. From there they bounce through
//! environment maps, which hold distance, normal and reflectance around a few points and are captured anew each frame.
//! Where they arrive they are gathered as irradiance at the pixels of a G-buffer. Nothing is precomputed. Core WebGPU
//! with [`Features::empty()`](wgpu::Features) and default [`Limits`](wgpu::Limits) suffices.
//!
//! # Layers
//!
//! Each layer uses those above it in this table.
//!
//! | Module | Holds |
//! |---|---|
//! | [`scene`] | what a scene is, on the CPU: meshes, materials, lights, cameras, and the [`UnitFrame`](scene::UnitFrame) that normalises scale |
//! | [`resource`] | what crosses a seam between passes: textures and buffers of documented format; the host's draws as a [`Geometry`](resource::Geometry) |
//! | [`pass`] | one technique each, recorded into the host's encoder |
//! | [`frame`] | everything composed: [`Settings`](frame::Settings), [`Plan`](frame::Plan), [`GiRenderer`](frame::GiRenderer) |
//! | [`mod@reference`] | beside the layers: what accuracy is measured with, a path tracer and error metrics |
//!
//! A pass knows the resources at its seams and no other pass. A host may use [`GiRenderer`](frame::GiRenderer), or single
//! passes with resources of its own.
//!
//! # A frame
//!
//! 1. [`set_scene`](frame::GiRenderer::set_scene): what there is. Returns the unit frame. Before it, where an environment's image
//!    has changed, [`set_environment`](frame::GiRenderer::set_environment).
//! 2. [`prepare`](frame::GiRenderer::prepare): the geometry, and every camera of the frame.
//! 3. [`record_scene`](frame::GiRenderer::record_scene), once: shadow maps, environment maps, photons.
//! 4. [`record_view`](frame::GiRenderer::record_view), for each camera: G-buffer, direct and indirect irradiance, their
//!    sum as [`Radiance`](resource::Radiance).
//! 5. The host submits.
//!
//! The host owns device, queue, encoder and submission. Only functions with `_blocking` in their name wait for the GPU.
//! Uniforms are written through the queue and land before the whole submission, so two views in one submission need two
//! [`ViewResources`](frame::ViewResources).
//!
//! # Example
//!
//! ```
//! # #[cfg(all(feature = "samples", feature = "bvh"))]
//! # fn main() -> Result<(), lightfall::Error> {
//! use lightfall::frame::{GiRenderer, SceneInputs, Settings, ViewInputs};
//! use lightfall::pass::CompositeSettings;
//! use lightfall::resource::{CameraView, MeshGeometry};
//! use lightfall::scene::{SceneSummary, samples};
//! use lightfall::wgpu;
//!
//! // The host's own. This device checks every call and draws nothing; a real one takes the same calls.
//! let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
//! let scene = samples::cornell(0.0);
//!
//! // Once.
//! let mut geometry = MeshGeometry::new(&device, &queue, &scene)?;
//! let mut renderer = GiRenderer::new(&device, &Settings::fast())?;
//! renderer.set_scene(&queue, &SceneSummary::of(&scene)?, &scene.lights)?;
//! renderer.place_env_maps_blocking(&queue, &mut geometry)?;
//! let mut view = renderer.new_view([128, 128])?;
//!
//! // Each frame: what there is, and from where it is seen.
//! let frame = renderer.set_scene(&queue, &SceneSummary::of(&scene)?, &scene.lights)?;
//! let mut cameras = [CameraView::new(&frame, &scene.cameras[0], [128, 128], [0.0; 2])];
//! renderer.prepare(&queue, &mut geometry, &mut cameras)?;
//!
//! // Once for all views, then for each view.
//! let mut encoder = device.create_command_encoder(&Default::default());
//! let scene_inputs = SceneInputs {
//!     queue: &queue,
//!     geometry: &geometry,
//!     bvh: None,
//!     sample_offset: 0,
//!     timestamps: None,
//! };
//! renderer.record_scene(&mut encoder, &scene_inputs)?;
//! let composite = CompositeSettings {
//!     output_scale: frame.output_scale(1.0)?,
//!     ..Default::default()
//! };
//! let view_inputs = ViewInputs {
//!     queue: &queue,
//!     geometry: &geometry,
//!     bvh: None,
//!     view: &cameras[0],
//!     accumulated: 0,
//!     composite: &composite,
//!     timestamps: None,
//! };
//! renderer.record_view(&mut encoder, &mut view, &view_inputs)?;
//! queue.submit([encoder.finish()]);
//!
//! // The image: linear radiance in world units.
//! let image = view.radiance().view();
//! # assert_eq!(image.texture().size().width, 128);
//! # Ok(())
//! # }
//! # #[cfg(not(all(feature = "samples", feature = "bvh")))]
//! # fn main() {}
//! ```
//!
//! # Features
//!
//! All are on by default. Without them there are the passes that need no triangles.
//!
//! - `bvh`: rays against triangles, [`resource::BvhGeometry`] and [`pass::BvhTracer`].
//! - `samples`: procedural test scenes, [`scene::samples`].
//! - `reference`: error metrics, [`reference::metrics`], and with `bvh` the renderer that is right,
//!   [`reference::PathTracer`].
//!
//! The crate enables no backend of wgpu: the host does.
//!
//! # What is not modelled
//!
//! A surface is diffuse, metal or glass, none of them at once, and an environment lights surfaces as some suns do.
//! [`Plan::simplifications`](frame::Plan::simplifications) names what this means for a given scene.

#![cfg_attr(docsrs, feature(doc_cfg))]

#[cfg(all(test, feature = "bvh"))]
mod bvh_tests;
#[cfg(feature = "bvh")]
mod bvh_tree;
mod error;
pub mod frame;
mod gpu;
mod halton;
pub mod pass;
mod read_back;
#[cfg(feature = "reference")]
pub mod reference;
pub mod resource;
pub mod scene;
#[cfg(test)]
mod shader_tests;
mod timestamps;
pub mod wgsl;

// Unit tests share modules with the other tests, where the crate has a name.
#[cfg(test)]
extern crate self as lightfall;

pub use error::Error;
pub use glam;
#[doc(hidden)]
pub use gpu::{CreationCount, creation_count};
pub use read_back::{read_buffer_blocking, read_rgba32float_blocking};
pub use timestamps::Timestamps;
pub use wgpu;

/// The code in the README, compiled as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The code in the guide.
#[cfg(doctest)]
#[doc = include_str!("../docs/guide.md")]
struct Guide;
