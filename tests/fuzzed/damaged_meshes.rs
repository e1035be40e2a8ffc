//! Mesh files and material libraries damaged at random, as in `damaged`.

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, MTL, SceneFolder, TRIANGLE};
use crate::damaged::{TEXTURE, assert_some_load, images, scenes};
use crate::judge::{Bound, TEXT, check_scene, judge, take_turn};
use crate::mutate::{self, Random};
use camlux::Scene;

#[test]
fn meshes() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("mesh.mtl", MTL.replace("white", "left") + MTL);
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    let mut seeds = scenes("obj");
    let all_forms = "v 0 0 0 1\nv 2 0 0\nv 2 2 0\nv 0 1 0\nvt 0\nvt 1 1 0\nvn 0 0 1\nvn 0 0 0\n\
        usemtl white\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -4//-2 -3//-2 -2//-2\nf 1/1 2/2 \\\n 3/1\no a\ns off\nl 1 2\n";
    seeds.push(format!("{TRIANGLE}{all_forms}").into());
    seeds.push(TRIANGLE.into());
    // Colours, a polygon of which no corner sees all others, numbers of other programs, capitals.
    let of_others = "v 0 0 0 0.5 0.2 1\nv 3 0 0 255 0 9\nv 3 2 0 1 1 0 0\nv 2 2 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n\
        vn -1.#IND 0 1\nvn nan inf 1\nf 4 5 6 7 8 9 10 11\nF 4//1 5//2 6//1\nvp 1 2\np 1\ng\nunheard of\n";
    seeds.push(format!("{TRIANGLE}{of_others}").into());
    judge_texts(("mesh.obj", TEXT), &folder, &seeds, 3);
}

/// Judges damaged texts. Some of them load.
fn judge_texts(
    (name, bound): (&'static str, Bound),
    folder: &SceneFolder,
    seeds: &[Vec<u8>],
    seed: u64,
) {
    let mut random = Random::new(seed);
    let rounds = 3000;
    let loads = (0..rounds).filter(|_| {
        let bytes = mutate::text(&mut random, seeds);
        judge(name, &bytes, bound, |bytes| {
            folder.write(name, bytes);
            check_scene(Scene::load(&folder.path("scene.toml")))
        })
    });
    assert_some_load(loads.count(), rounds);
}

/// A folder with a scene that shows a mesh file.
fn folder_with(mesh: &str) -> SceneFolder {
    let folder = SceneFolder::new();
    let mesh =
        format!("[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"{mesh}\"\nmaterial = \"clay\"\n");
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{mesh}"));
    folder
}

/// Memory for what the header promises and the file may hold is allocated before it is read.
const BINARY: Bound = Bound {
    constant_bytes: 8 << 20,
    ..TEXT
};

/// Alternates between damaged texts and damaged binaries. Some of each load.
fn judge_both(
    (name, bound): (&'static str, Bound),
    folder: &SceneFolder,
    (texts, binaries): (&[Vec<u8>], &[Vec<u8>]),
    seed: u64,
) {
    let mut random = Random::new(seed);
    let rounds = 4000;
    let mut loads = [0; 2];
    for round in 0..rounds {
        let bytes = match round % 2 {
            0 => mutate::binary(&mut random, binaries),
            _ => mutate::text(&mut random, texts),
        };
        let is_loaded = judge(name, &bytes, bound, |bytes| {
            folder.write(name, bytes);
            check_scene(Scene::load(&folder.path("scene.toml")))
        });
        loads[round % 2] += usize::from(is_loaded);
    }
    for loaded in loads {
        assert_some_load(loaded, rounds / 2);
    }
}

#[test]
fn ply_files() {
    let _turn = take_turn();
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment a scan\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n\
            property short nx\nproperty char ny\nproperty float nz\nproperty float u\nproperty float v\n\
            element face 1\nproperty list uchar uint vertex_index\nproperty list uint float weights\nend_header\n"
        )
    };
    let text =
        "0 0 0 0 1 0 0 0\n1 0 0 0 1 0 1 0\n1 0 1 0 1 0 1 1\n0 0 1 0 1 0 0 1\n4 0 1 2 3 1 0.5\n";
    let texts = [(header("ascii") + text).into_bytes()];
    let mut binary = header("binary_little_endian").into_bytes();
    for corner in 0..4_u8 {
        binary.extend(f32::from(corner).to_le_bytes());
        binary.extend(f32::from(corner / 2).to_le_bytes());
        binary.extend(f64::from(corner % 2).to_le_bytes());
        binary.extend([0, 0, 1]);
        [0.5_f32, 0.0, 1.0]
            .iter()
            .for_each(|value| binary.extend(value.to_le_bytes()));
    }
    binary.extend([
        4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0,
    ]);
    binary.extend(1_f32.to_le_bytes());
    judge_both(
        ("scan.ply", BINARY),
        &folder_with("scan.ply"),
        (&texts, &[binary]),
        10,
    );
}

/// Strips, and texture coordinates, textures and colours of faces.
#[test]
fn ply_files_with_more_than_vertices_and_faces() {
    let _turn = take_turn();
    let folder = folder_with("scan.ply");
    folder.write("wood.png", &images()[0]);
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment TextureFile wood.png\ncomment TextureFile wood.png\n\
            element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
            element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n\
            property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n\
            element tristrips 1\nproperty list int int vertex_indices\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
        )
    };
    let corners = [[0_u8, 0], [1, 0], [0, 1], [1, 1]];
    let faces = [([0_i32, 1, 2], 0_i32), ([1, 3, 2], -1)];
    let strip = [0_i32, 1, 2, -1, 1, 3, 2, 0];
    let mut text = header("ascii");
    let mut binary = header("binary_big_endian").into_bytes();
    for [x, y] in corners {
        text += &format!("{x} {y} 0 255 {x} 9\n");
        for value in [x, y, 0] {
            binary.extend(f32::from(value).to_be_bytes());
        }
        binary.extend([255, x, 9]);
    }
    for (face, texture) in faces {
        let [a, b, c] = face;
        text += &format!("3 {a} {b} {c} 6 0 0 1 0 0.5 1 {texture} 1 2 3 255\n");
        binary.push(3);
        binary.extend(face.map(i32::to_be_bytes).as_flattened());
        binary.push(6);
        let texcoords = [0.0, 0.0, 1.0, 0.0, 0.5, 1.0].map(f32::to_be_bytes);
        binary.extend(texcoords.as_flattened());
        binary.extend(texture.to_be_bytes());
        binary.extend([1, 2, 3, 255]);
    }
    text += "8 0 1 2 -1 1 3 2 0\n0 1\n";
    binary.extend(8_i32.to_be_bytes());
    binary.extend(strip.map(i32::to_be_bytes).as_flattened());
    binary.extend([0; 8]);
    // Of the text, the texture is the largest part in memory.
    judge_both(
        ("scan.ply", BINARY),
        &folder,
        (&[text.into_bytes()], &[binary]),
        11,
    );
}

#[test]
fn stl_files() {
    let _turn = take_turn();
    let triangles: [[[f32; 3]; 4]; 2] = [
        [[0.0, 0.0, 1.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, -0.0],
        ],
    ];
    let mut text = String::from("solid a room\n");
    let mut binary = [b' '; 80].to_vec();
    binary[..12].copy_from_slice(b"solid COLOR=");
    binary.extend(2_u32.to_le_bytes());
    for [normal, corners @ ..] in triangles {
        let [x, y, z] = normal;
        text += &format!("facet normal {x} {y} {z}\nouter loop\n");
        for [x, y, z] in corners {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
        for value in [normal].iter().chain(&corners).flatten() {
            binary.extend(value.to_le_bytes());
        }
        binary.extend([0, 0x80]);
    }
    text += "endsolid a room\n";
    judge_both(
        ("part.stl", BINARY),
        &folder_with("part.stl"),
        (&[text.into_bytes()], &[binary]),
        12,
    );
}

#[test]
fn material_libraries() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    let mut seeds = scenes("mtl");
    for seed in &mut seeds {
        // Adds the material that the mesh names.
        let text = String::from_utf8(seed.clone()).unwrap();
        *seed = text
            .replacen("newmtl ", "newmtl white\nKd 1\nnewmtl ", 1)
            .into();
    }
    seeds.push(MTL.into());
    seeds.push("newmtl white\nKa 1 1 1\nKd 0.5\nKs 0.1 0.2 0.3\nNs 20\nillum 2\nd 1\n".into());
    judge_texts(("mesh.mtl", TEXT), &folder, &seeds, 4);
}

/// Maps with all options, of images that are there.
#[test]
fn material_libraries_with_maps() {
    let _turn = take_turn();
    let folder = SceneFolder::new();
    folder.write("scene.toml", format!("{CAMERA}{LIGHT}{MESH}"));
    folder.write(
        "mesh.obj",
        TRIANGLE.replace("f 1 2 3", "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3"),
    );
    folder.write("wood.png", &images()[0]);
    folder.write("my wood.png", &images()[0]);
    let seeds = [
        "newmtl white\nKd 0.5 0.4 0.3\nKs 0.1 0.2 0.3\nNs 20\nillum 2\nmap_Kd -s 2 3 1 -o 0.5 -clamp on wood.png\n\
        map_Ks -s 2 -bm 3 my wood.png\nmap_Ns \"my wood.png\"\nnorm -bm -2 .\\wood.png\nmap_d -imfchan l wood.png\n",
        "newmtl white\nmap_kd -blendu off -blendv on -mm 0.1 2 -texres 9 -boost 1 -cc on -t 1 2 3 wood.png\nTr 0.5\nd 0.5\nKe 1 1 1\n\
        Pm 1\nPr 0.5\nmap_Bump -bm 0.1 wood.png\ndisp wood.png\nrefl -type sphere wood.png\nunheard of\nTf 1 1 1\nNi 1.5\n",
    ]
    .map(|text| text.as_bytes().to_vec());
    // The images take memory, but are not part of the input.
    let bound = Bound {
        constant_bytes: TEXTURE.constant_bytes,
        ..TEXT
    };
    judge_texts(("mesh.mtl", bound), &folder, &seeds, 13);
}
