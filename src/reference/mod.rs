//! What accuracy is measured with. Nothing here runs on the frame path.

#[cfg(feature = "bvh")]
pub(crate) mod emitters;
pub mod metrics;
#[cfg(feature = "bvh")]
pub(crate) mod path_tracer;

#[cfg(feature = "bvh")]
pub use emitters::Emitters;
#[cfg(feature = "bvh")]
pub use path_tracer::{
    PathComponent, PathEstimate, PathTracer, PathTracerInputs, PathTracerResources, PathTracerSettings,
};
