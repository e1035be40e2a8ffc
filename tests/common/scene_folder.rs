//! A folder with a scene file and its meshes, deleted when the test ends.

use std::path::PathBuf;

use camlux::scene::Scene;

pub use super::rows::assert_says;

pub const CAMERA: &str = "[camera]
resolution = [8, 6]
position = [0, 1, 3]
look_at = [0.0, 1.0, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 50.0
";
pub const LIGHT: &str = "[[light]]
kind = \"point\"
position = [0.0, 1.98, 0.0]
power_w = 50.0
";
pub const MESH: &str = "[[mesh]]
path = \"mesh.obj\"
";
pub const MTL: &str = "newmtl white
Kd 0.7 0.6 0.5
Ks 0 0 0
Ns 1
";
pub const TRIANGLE: &str = "mtllib mesh.mtl
usemtl white
v 0 0 0
v 1 0 0
v 0 1 0
f 1 2 3
";

pub struct SceneFolder(tempfile::TempDir);

impl SceneFolder {
    /// A triangle in `mesh.obj` with `mesh.mtl`.
    pub fn new() -> Self {
        let folder = SceneFolder(tempfile::tempdir().unwrap());
        folder.write("mesh.obj", TRIANGLE).write("mesh.mtl", MTL);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        std::fs::write(self.path(name), content).unwrap();
        self
    }

    pub fn load(&self, scene_toml: &str) -> camlux::Result<Scene> {
        self.write("scene.toml", scene_toml);
        Scene::load(&self.path("scene.toml"))
    }

    /// Loads a scene with `mesh.obj` replaced.
    pub fn load_obj(&self, obj: &str) -> camlux::Result<Scene> {
        self.write("mesh.obj", obj);
        self.load(&format!("{CAMERA}{LIGHT}{MESH}"))
    }

    /// The message of a load that must fail, without the folder's path.
    pub fn error(&self, result: camlux::Result<Scene>) -> String {
        let message = result.expect_err("the load should fail").to_string();
        message.replace(&format!("{}/", self.0.path().display()), "")
    }
}
