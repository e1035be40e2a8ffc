//! Varied scenes of generated meshes, for measuring speed against the error of indirect light.

mod blob;
mod clutter;
mod far_light;
mod gear;
mod glossy_head;
mod grass;
mod isosurface;
mod materials;
mod mesh;
mod noise;
mod room;
mod scan;
mod shapes;
mod terrain;
mod two_lights;

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;

use super::knot;
use materials::Material;
use mesh::Mesh;

/// A scene file, and the mesh that it names as NAME.obj.
pub struct MeshScene {
    pub name: &'static str,
    toml: &'static str,
    parts: fn() -> Vec<Part>,
}

/// A mesh and its material.
struct Part {
    material: Material,
    mesh: Mesh,
}

fn part(material: Material, mesh: Mesh) -> Part {
    Part { material, mesh }
}

macro_rules! scene {
    ($name:ident) => {
        MeshScene {
            name: stringify!($name),
            toml: include_str!(concat!(stringify!($name), ".toml")),
            parts: $name::parts,
        }
    };
}

pub const SCENES: [MeshScene; 9] = [
    scene!(blob),
    scene!(clutter),
    scene!(far_light),
    scene!(gear),
    scene!(glossy_head),
    scene!(grass),
    scene!(scan),
    scene!(terrain),
    scene!(two_lights),
];

/// For scenes whose lights have a position: parallel light has no path length.
const TIME_OF_FLIGHT: &str = "
[sensor]
pixel_pitch_um = [10.0, 10.0]
exposure_time_s = 1.0e-3
duty_cycle = 1.0
wavelength_nm = 850.0
quantum_efficiency = 0.5

[tof]
frequencies_mhz = [20.0, 100.0]
contrast = 0.75
band = \"R\"
";

impl MeshScene {
    /// Writes NAME.toml, NAME.obj and NAME.mtl. If the scene's light can be modulated, also writes NAME_tof.toml: the scene for a
    /// time-of-flight camera.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let parts = (self.parts)();
        let write = |end: &str, text: &str| {
            let file = folder.join(format!("{}{end}", self.name));
            fs::write(file, text)
        };
        write(".toml", self.toml)?;
        if !self.toml.contains("\"directional\"") {
            write("_tof.toml", &format!("{}{TIME_OF_FLIGHT}", self.toml))?;
        }
        write(".obj", &obj(self.name, &parts))?;
        write(".mtl", &mtl(&parts))
    }
}

/// Writes knot_N.toml and its meshes: the knot of `scenes/knot.toml` with about N triangles, in the same room.
pub fn write_knot(triangle_count: usize, folder: &Path) -> io::Result<()> {
    let name = format!("knot_{triangle_count}");
    let toml = include_str!("knot.toml").replace("NAME", &name);
    fs::write(folder.join(format!("{name}.toml")), toml)?;
    let obj = knot::obj_of_about(triangle_count);
    fs::write(folder.join(format!("{name}.obj")), obj)?;
    let room_obj = include_str!("../../../scenes/knot_room.obj");
    fs::write(folder.join("knot_room.obj"), room_obj)?;
    let room_mtl = include_str!("../../../scenes/knot_room.mtl");
    fs::write(folder.join("knot_room.mtl"), room_mtl)
}

/// Writes knots_N.toml: N small instances of that knot, each rotated differently, in the same room.
pub fn write_knots(count: usize, triangle_count: usize, folder: &Path) -> io::Result<()> {
    write_knot(triangle_count, folder)?;
    let name = format!("knot_{triangle_count}");
    let toml = include_str!("knot.toml").replace("NAME", &name);
    let (head, tail) = toml.rsplit_once("[[mesh]]").unwrap_or((toml.as_str(), ""));
    let (_, materials) = tail.split_once("[material").unwrap_or(("", tail));
    let edge = (count as f64).cbrt().ceil().max(1.0);
    let cell_m = 2.0 / edge;
    let mut text = head.to_owned();
    for index in 0..count {
        let place = |divisor: f64| (index as f64 / divisor).floor() % edge;
        let [x, y, z] =
            [place(1.0), place(edge), place(edge * edge)].map(|cell| (cell + 0.5) * cell_m);
        let turns = [37.0, 61.0, 17.0].map(|degrees| degrees * index as f64 % 360.0);
        writeln!(
            text,
            "[[mesh]]\npath = \"{name}.obj\"\nmaterial = \"ivory\"\nscale = {:e}\nrotate_deg = {turns:?}\ntranslate = [{:.4}, {y:.4}, {:.4}]\n",
            0.8e-5 * cell_m,
            x - 1.0,
            z - 1.0,
        )
        .expect(NEVER_FAILS);
    }
    writeln!(text, "[material{materials}").expect(NEVER_FAILS);
    fs::write(folder.join(format!("knots_{count}.toml")), text)
}

const NEVER_FAILS: &str = "a String takes all that is written to it";

fn obj(name: &str, parts: &[Part]) -> String {
    let mut text = format!("# Made by examples/generate_scenes.\nmtllib {name}.mtl\n");
    let mut first_position = 1;
    let mut first_normal = 1;
    for Part { material, mesh } in parts {
        writeln!(text, "usemtl {}", material.name).expect(NEVER_FAILS);
        for position in &mesh.positions {
            // Rounded, because the last bit of the platform's sine differs between machines and must not reach the file.
            let [x, y, z] = position.to_array();
            writeln!(text, "v {x:.6} {y:.6} {z:.6}").expect(NEVER_FAILS);
        }
        for normal in &mesh.normals {
            let [x, y, z] = normal.to_array();
            writeln!(text, "vn {x:.4} {y:.4} {z:.4}").expect(NEVER_FAILS);
        }
        let is_smooth = !mesh.normals.is_empty();
        for triangle in &mesh.triangles {
            text.push('f');
            for index in triangle {
                write!(text, " {}", first_position + index).expect(NEVER_FAILS);
                if is_smooth {
                    write!(text, "//{}", first_normal + index).expect(NEVER_FAILS);
                }
            }
            text.push('\n');
        }
        first_position += mesh.positions.len() as u32;
        first_normal += mesh.normals.len() as u32;
    }
    text
}

fn mtl(parts: &[Part]) -> String {
    let mut written = Vec::new();
    let mut text = String::new();
    for Part { material, .. } in parts {
        if written.contains(material) {
            continue;
        }
        written.push(*material);
        let Material {
            name,
            kd: [red, green, blue],
            ks,
            shininess,
        } = material;
        writeln!(
            text,
            "newmtl {name}\nKd {red} {green} {blue}\nKs {ks} {ks} {ks}\nNs {shininess}\n"
        )
        .expect(NEVER_FAILS);
    }
    text
}
