pub mod error;
pub mod scene;
pub use error::{Error, Result};
pub mod output;
