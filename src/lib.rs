mod error;
pub mod scene;
pub use error::Error;
pub use glam;
pub use wgpu;
