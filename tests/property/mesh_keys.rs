//! Any key of the specification of OBJ, MTL and PLY is used, or named in the one warning of its file.

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE, assert_says};
use camlux::Scene;

/// A triangle with texture coordinates.
const TEXTURED: &str = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
const MTL: &str = "newmtl white\nKd 0.5\nKs 0.1\nNs 20\n";

/// All statements of the OBJ specification, version 3, but those that group and name.
const OBJ_STATEMENTS: [&str; 36] = [
    "v 1 2 3",
    "vt 0.5 0.5",
    "vn 0 0 1",
    "vp 0 1",
    "deg 3 3",
    "bmat u 1 0 0 1",
    "step 1 1",
    "cstype bezier",
    "p 1",
    "l 1 2",
    "f 1 2 3",
    "curv 0 1 1 2",
    "curv2 1 2",
    "surf 0 1 0 1 1 2",
    "parm u 0 1",
    "trim 0 1 1",
    "hole 0 1 1",
    "scrv 0 1 1",
    "sp 1",
    "end",
    "con 1 0 1 1 2 0 1 1",
    "bevel on",
    "c_interp on",
    "d_interp on",
    "lod 3",
    "usemap wood",
    "maplib a.map",
    "shadow_obj a.obj",
    "trace_obj a.obj",
    "ctech cparm 1",
    "stech cparma 1 1",
    "call a.obj",
    "csh echo",
    "bsp 1",
    "bzp 1",
    "res 1 1",
];

/// All statements of the MTL specification and of its extension for physically based materials, with values that matter.
const MTL_STATEMENTS: [&str; 37] = [
    "Kd 0.25",
    "Ks 0.3",
    "Ns 7",
    "illum 1",
    "illum 0",
    "illum 7",
    "map_Kd a.png",
    "map_Ks a.png",
    "map_Ns a.png",
    "norm a.png",
    "map_Bump a.png",
    "bump a.png",
    "map_d a.png",
    "Ka 0.1 0.1 0.1",
    "Ke 1 1 1",
    "Tf 0.5 0.5 0.5",
    "Tr 0.5",
    "d 0.5",
    "d -halo 0.5",
    "Ni 1.5",
    "sharpness 60",
    "Pr 0.5",
    "Pm 1",
    "Ps 0.5",
    "Pc 0.5",
    "Pcr 0.5",
    "aniso 0.5",
    "anisor 0.5",
    "map_Ka a.png",
    "map_Ke a.png",
    "map_Pr a.png",
    "map_Pm a.png",
    "map_aat on",
    "disp a.png",
    "decal a.png",
    "refl -type sphere a.png",
    "map_refl a.png",
];

const OPTIONS: [&str; 13] = [
    "-s 2 2",
    "-o 0.5 0.5",
    "-clamp on",
    "-t 0.1 0.1 0.1",
    "-blendu off",
    "-blendv off",
    "-mm 0.1 0.8",
    "-imfchan r",
    "-texres 64",
    "-boost 1.5",
    "-cc on",
    "-type sphere",
    "-bm 2",
];

fn load(folder: &SceneFolder, obj: &str, mtl: &str) -> Scene {
    folder.write("mesh.mtl", mtl).write("mesh.obj", obj);
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}"));
    scene.unwrap_or_else(|error| panic!("{error}\n{obj}\n{mtl}"))
}

fn folder() -> SceneFolder {
    let folder = SceneFolder::new();
    let image = image::RgbaImage::from_fn(2, 2, |x, _| image::Rgba([200, 10, 9, 100 * x as u8]));
    image.save(folder.path("a.png")).unwrap();
    folder
}

/// Whether the scenes would look different.
fn differ(a: &Scene, b: &Scene) -> bool {
    a.hash() != b.hash()
}

/// Asserts that the warnings of `file` are one line, and that it names `key`.
#[track_caller]
fn names(scene: &Scene, file: &str, key: &str) {
    let warnings = scene.warnings();
    let of_file = warnings
        .iter()
        .filter(|w| w.contains(file) && w.contains("ignores"));
    let of_file: Vec<_> = of_file.collect();
    assert_eq!(of_file.len(), 1, "{key}: {warnings:#?}");
    assert_says(of_file[0], &[&format!("\"{key}\"")]);
}

#[test]
fn every_statement_of_obj_is_used_or_named() {
    let folder = folder();
    let plain = load(&folder, TRIANGLE, MTL);
    for statement in OBJ_STATEMENTS {
        let key = statement.split(' ').next().unwrap();
        // Coordinates and normals are used where a face names them.
        let is_value = matches!(key, "v" | "vt" | "vn");
        let face = match key {
            "v" => "f 1 2 4\n",
            "vt" => "f 1/1 2/1 3/1\n",
            "vn" => "f 1//1 2//1 3//1\n",
            _ => "",
        };
        let scene = load(&folder, &format!("{TRIANGLE}{statement}\n{face}"), MTL);
        match is_value || key == "f" {
            true => assert!(differ(&scene, &plain), "{statement}"),
            false => names(&scene, "mesh.obj", key),
        }
    }
    for statement in ["o a", "g a b", "s 1", "s off", "mg 1 0.5"] {
        let scene = load(&folder, &format!("{TRIANGLE}{statement}\n"), MTL);
        assert!(!differ(&scene, &plain) && scene.warnings().is_empty());
    }
}

#[test]
fn every_statement_of_mtl_is_used_or_named() {
    let folder = folder();
    let plain = load(&folder, TEXTURED, MTL);
    for statement in MTL_STATEMENTS {
        for in_capitals in [false, true] {
            let key = statement.split(' ').next().unwrap();
            let written = match in_capitals {
                true => statement.replacen(key, &key.to_uppercase(), 1),
                false => statement.to_owned(),
            };
            let scene = load(&folder, TEXTURED, &format!("{MTL}{written}\n"));
            if !differ(&scene, &plain) {
                names(&scene, "mesh.mtl", key);
            }
        }
    }
}

#[test]
fn every_option_of_maps_is_used_or_named() {
    let folder = folder();
    for key in [
        "map_Kd", "map_Ks", "map_Ns", "map_Ke", "norm", "map_Bump", "bump", "map_d",
    ] {
        let plain = load(&folder, TEXTURED, &format!("{MTL}{key} a.png\n"));
        for option in OPTIONS {
            let mtl = format!("{MTL}{key} {option} a.png\n");
            let scene = load(&folder, TEXTURED, &mtl);
            if !differ(&scene, &plain) {
                let name = option.split(' ').next().unwrap();
                names(&scene, "mesh.mtl", name);
            }
        }
        // What every exporter writes is nothing to warn of.
        for option in [
            "-s 1 1 1",
            "-o 0 0 0",
            "-clamp off",
            "-t 0 0 0",
            "-mm 0 1",
            "-blendu on",
        ] {
            let scene = load(&folder, TEXTURED, &format!("{MTL}{key} {option} a.png\n"));
            assert!(!differ(&scene, &plain), "{key} {option}");
            let warnings = scene.warnings().join("\n");
            assert!(!warnings.contains("camlux ignores"), "{warnings}");
        }
    }
}

#[test]
fn other_dialects_are_named_with_the_nearest_key() {
    let folder = folder();
    for (written, nearest) in [
        ("map_norm a.png", "norm"),
        ("map_Kn a.png", "map_K"),
        ("map_opacity a.png", "map_"),
        ("Kdd 0.5", "Kd"),
    ] {
        let scene = load(&folder, TEXTURED, &format!("{MTL}{written}\n"));
        let warnings = scene.warnings().join("\n");
        let key = written.split(' ').next().unwrap();
        assert_says(&warnings, &[&format!("the unknown \"{key}\", perhaps \"")]);
        assert!(warnings.contains(nearest), "{nearest}: {warnings}");
    }
    let obj = format!("{TRIANGLE}vertex 1 2 3\n");
    let warnings = load(&folder, &obj, MTL).warnings().join("\n");
    assert!(warnings.contains("the unknown \"vertex\""), "{warnings}");
}

#[test]
fn one_line_a_file_with_the_counts() {
    let folder = folder();
    let mtl = format!("{MTL}Ka 1 1 1\nd 0.5\nnewmtl red\nKd 1 0 0\nKa 1 0 0\n");
    let obj = format!("{TRIANGLE}l 1 2\np 1\nl 2 3\n");
    let scene = load(&folder, &obj, &mtl);
    let warnings = scene.warnings();
    let ends = |end: &str| warnings.iter().filter(|w| w.ends_with(end)).count();
    assert_eq!(
        ends("camlux ignores \"Ka\" (2 times); \"d\""),
        1,
        "{warnings:#?}"
    );
    let of_obj = "camlux ignores \"l\": lines (2 times); \"p\": points";
    assert_eq!(ends(of_obj), 1, "{warnings:#?}");
}

#[test]
fn values_without_effect_are_nothing_to_warn_of() {
    let folder = folder();
    let mtl = format!(
        "{MTL}Ka 0 0 0\nKe 0.0 0.0 0.0\nNi 1.0\nd 1.0\nTr 0\nTf 1 1 1\nillum 2\nPm 0\nmap_aat off\n"
    );
    assert_eq!(load(&folder, TEXTURED, &mtl).warnings(), [""; 0]);
}

#[test]
fn every_property_of_ply_is_used_or_named() {
    let folder = SceneFolder::new();
    let load = |vertex: &str, face: &str| -> Scene {
        let [more, of_face] = [vertex, face].map(|lines| " 7".repeat(lines.lines().count()));
        let file = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
            element face 1\nproperty list uchar int vertex_indices\n{face}end_header\n0 0 0{more}\n1 0 0{more}\n0 1 0{more}\n3 0 1 2{of_face}\n"
        );
        folder.write("scan.ply", &file);
        let mesh =
            "[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"scan.ply\"\nmaterial = \"clay\"\n";
        let scene = folder.load(&format!("{CAMERA}{LIGHT}{mesh}"));
        scene.unwrap_or_else(|error| panic!("{error}\n{file}"))
    };
    let plain = load("", "");
    assert_eq!(plain.warnings(), [""; 0]);
    for name in [
        "quality",
        "confidence",
        "intensity",
        "alpha",
        "red",
        "nx",
        "u",
        "my_own",
        "flags",
    ] {
        for kind in ["uchar", "float"] {
            let property = format!("property {kind} {name}\n");
            names(&load(&property, ""), "scan.ply", name);
            names(&load("", &property), "scan.ply", name);
        }
    }
    for group in [
        ["red", "green", "blue"],
        ["nx", "ny", "nz"],
        ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ] {
        let properties: String = group
            .iter()
            .map(|n| format!("property uchar {n}\n"))
            .collect();
        let scene = load(&properties, "");
        assert!(differ(&scene, &plain), "{group:?}");
        assert_eq!(scene.warnings(), [""; 0]);
    }
    let warnings = load("property uchar redd\n", "").warnings().join("\n");
    assert_says(&warnings, &["the unknown \"redd\", perhaps \"red\""]);
}
