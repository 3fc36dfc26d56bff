//! What scenes, lights, views and settings may go to: one row after the other. Each method of indirect light, each tracer,
//! each shadow renders small pictures of it, of which every value is finite; its error stays within twice that of the nominal
//! case, or it is refused with a named error. Rows that are ignored are open, or take minutes: `-- --ignored`.
#![cfg(all(feature = "bvh", feature = "reference"))]

#[path = "../common/mod.rs"]
mod common;

mod device;
mod geometry;
mod light;
mod long;
mod maps;
mod material;
mod motion;
mod photons;
mod properties;
mod scale;
mod studio;
mod view;
