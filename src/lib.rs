pub mod error;
pub mod scene;
mod vulkan;
pub use error::{Error, Result};
pub mod output;
