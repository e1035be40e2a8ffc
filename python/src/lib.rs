//! camlux for Python: the engine behind the package `camlux`, whose `scene.py` has the classes of a scene.
//!
//! Layers of a frame are numpy arrays that read the frame's own memory. Arrays for a scene are read in place and copied once.

mod arguments;
mod arrays;
mod attributes;
mod dataset;
mod device;
mod errors;
mod frame;
mod image;
mod layers;
mod mesh;
mod objects;
mod parts;
mod process;
mod program;
mod reference;
mod renderer;
mod scene;

use pyo3::prelude::*;

#[pymodule]
mod _camlux {
    #[pymodule_export]
    use crate::{
        dataset::{DatasetOptions, SceneState, hash_files},
        device::{Device, DeviceInfo, devices},
        frame::{Frame, FrameStats},
        image::{Comparison, Image, compare_arrays, preview, read_exr},
        layers::Layers,
        mesh::{Mesh, place_mesh},
        objects::load_scene,
        parts::{Pattern, ProjectedImage, Texture, restore_pattern},
        program::run_program,
        reference::reference,
        renderer::{Progress, Renderer},
        scene::{save_scene, scene_warnings, validate_scene},
    };

    #[pymodule_init]
    fn init(module: &super::Bound<'_, super::PyModule>) -> super::PyResult<()> {
        super::PyModuleMethods::add(module, "__version__", env!("CARGO_PKG_VERSION"))
    }
}
