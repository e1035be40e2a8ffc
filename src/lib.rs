pub mod emission;
pub mod error;
pub mod model;
pub mod scene;
mod vulkan;
pub use error::{Error, Result};
pub mod output;
