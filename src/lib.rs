pub mod emission;
pub mod error;
pub mod model;
pub mod scene;
pub use error::{Error, Result};
