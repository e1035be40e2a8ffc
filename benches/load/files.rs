//! A surface, and the files that hold it.

use std::f32::consts::{PI, TAU};
use std::fs::File;
use std::io::{BufWriter, Result, Write};
use std::path::Path;

pub struct Surface {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    texcoords: Vec<[f32; 2]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// A sphere with bumps, of `2 * rows * columns` triangles.
    pub fn bumpy_sphere(rows: u32, columns: u32) -> Self {
        let mut surface = Surface {
            positions: Vec::new(),
            normals: Vec::new(),
            texcoords: Vec::new(),
            triangles: Vec::new(),
        };
        for row in 0..=rows {
            // Not up to the poles, where triangles would have no area.
            let v = 0.01 + 0.98 * row as f32 / rows as f32;
            for column in 0..=columns {
                let u = column as f32 / columns as f32;
                let (sine, cosine) = (v * PI).sin_cos();
                let (sine_u, cosine_u) = (u * TAU).sin_cos();
                let normal = [sine * cosine_u, -cosine, -sine * sine_u];
                let radius = 1.0 + 0.05 * (40.0 * u).sin() * (20.0 * v).sin();
                surface.positions.push(normal.map(|axis| radius * axis));
                surface.normals.push(normal);
                surface.texcoords.push([u, v]);
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
                surface.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        surface
    }
}

type Writer = fn(&Surface, &mut BufWriter<File>) -> Result<()>;

/// Writes a file of each kind and returns their names.
pub fn write_all(surface: &Surface, folder: &Path) -> Result<[&'static str; 7]> {
    let writers: [(&str, Writer); 7] = [
        ("positions.obj", |s, file| obj(s, file, false)),
        ("all.obj", |s, file| obj(s, file, true)),
        ("binary.ply", |s, file| ply(s, file, true)),
        ("text.ply", |s, file| ply(s, file, false)),
        ("binary.stl", stl),
        ("text.stl", stl_text),
        ("all.glb", glb),
    ];
    for (name, write) in writers {
        let mut file = BufWriter::new(File::create(folder.join(name))?);
        write(surface, &mut file)?;
        file.flush()?;
    }
    Ok(writers.map(|(name, _)| name))
}

fn obj(surface: &Surface, file: &mut BufWriter<File>, has_all: bool) -> Result<()> {
    for [x, y, z] in &surface.positions {
        writeln!(file, "v {x} {y} {z}")?;
    }
    if !has_all {
        for triangle in &surface.triangles {
            let [a, b, c] = triangle.map(|vertex| vertex + 1);
            writeln!(file, "f {a} {b} {c}")?;
        }
        return Ok(());
    }
    for [u, v] in &surface.texcoords {
        writeln!(file, "vt {u} {v}")?;
    }
    for [x, y, z] in &surface.normals {
        writeln!(file, "vn {x} {y} {z}")?;
    }
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|vertex| vertex + 1);
        writeln!(file, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?;
    }
    Ok(())
}

fn ply(surface: &Surface, file: &mut BufWriter<File>, is_binary: bool) -> Result<()> {
    let format = match is_binary {
        true => "binary_little_endian",
        false => "ascii",
    };
    let (vertices, faces) = (surface.positions.len(), surface.triangles.len());
    writeln!(file, "ply\nformat {format} 1.0\nelement vertex {vertices}")?;
    writeln!(file, "property float x\nproperty float y\nproperty float z")?;
    writeln!(file, "element face {faces}")?;
    writeln!(file, "property list uchar int vertex_indices\nend_header")?;
    for position in &surface.positions {
        let [x, y, z] = position;
        match is_binary {
            true => file.write_all(&floats(position))?,
            false => writeln!(file, "{x} {y} {z}")?,
        }
    }
    for triangle in &surface.triangles {
        let [a, b, c] = triangle;
        match is_binary {
            true => {
                file.write_all(&[3])?;
                file.write_all(&indices(triangle))?;
            }
            false => writeln!(file, "3 {a} {b} {c}")?,
        }
    }
    Ok(())
}

fn stl(surface: &Surface, file: &mut BufWriter<File>) -> Result<()> {
    file.write_all(&[0; 80])?;
    file.write_all(&(surface.triangles.len() as u32).to_le_bytes())?;
    for triangle in &surface.triangles {
        file.write_all(&floats(&surface.normals[triangle[0] as usize]))?;
        for &vertex in triangle {
            file.write_all(&floats(&surface.positions[vertex as usize]))?;
        }
        file.write_all(&[0; 2])?;
    }
    Ok(())
}

fn stl_text(surface: &Surface, file: &mut BufWriter<File>) -> Result<()> {
    writeln!(file, "solid sphere")?;
    for triangle in &surface.triangles {
        let [x, y, z] = surface.normals[triangle[0] as usize];
        writeln!(file, "facet normal {x} {y} {z}\nouter loop")?;
        for &vertex in triangle {
            let [x, y, z] = surface.positions[vertex as usize];
            writeln!(file, "vertex {x} {y} {z}")?;
        }
        writeln!(file, "endloop\nendfacet")?;
    }
    writeln!(file, "endsolid sphere")
}

fn glb(surface: &Surface, file: &mut BufWriter<File>) -> Result<()> {
    let parts = [
        floats(surface.positions.as_flattened()),
        floats(surface.normals.as_flattened()),
        floats(surface.texcoords.as_flattened()),
        indices(surface.triangles.as_flattened()),
    ];
    let vertices = surface.positions.len();
    let corners = 3 * surface.triangles.len();
    let kinds = [
        (5126, vertices, "VEC3"),
        (5126, vertices, "VEC3"),
        (5126, vertices, "VEC2"),
        (5125, corners, "SCALAR"),
    ];
    let (mut views, mut accessors, mut length) = (Vec::new(), Vec::new(), 0);
    for (index, (part, (component, count, shape))) in parts.iter().zip(kinds).enumerate() {
        let bytes = part.len();
        views.push(format!(
            r#"{{"buffer":0,"byteOffset":{length},"byteLength":{bytes}}}"#
        ));
        accessors.push(format!(
            r#"{{"bufferView":{index},"componentType":{component},"count":{count},"type":"{shape}"}}"#
        ));
        length += bytes;
    }
    let (views, accessors) = (views.join(","), accessors.join(","));
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3}}]}}],
        "buffers":[{{"byteLength":{length}}}],"bufferViews":[{views}],"accessors":[{accessors}]}}"#
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let word = |number: usize| (number as u32).to_le_bytes();
    file.write_all(b"glTF\x02\0\0\0")?;
    file.write_all(&word(28 + json.len() + length))?;
    file.write_all(&word(json.len()))?;
    file.write_all(b"JSON")?;
    file.write_all(json.as_bytes())?;
    file.write_all(&word(length))?;
    file.write_all(b"BIN\0")?;
    parts.iter().try_for_each(|part| file.write_all(part))
}

fn floats(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

fn indices(values: &[u32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}
