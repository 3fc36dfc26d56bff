//! What accuracy is measured with. Nothing here runs on the frame path.

pub mod metrics;
