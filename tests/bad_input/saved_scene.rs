//! Mistakes in what `Scene::save` writes: textures, materials with textures, meshes that stay as they are, patterns.

use crate::common::rows::rows;
use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder, assert_says};

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar uint vertex_indices\nproperty uint material_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 0\n";
const CLAY: &str = "[material.clay]\nkd = 0.5\n";
const MESH: &str = "[[mesh]]\npath = \"mesh.ply\"\nto_world = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]\nmaterials = [\"clay\"]\n";

fn folder() -> SceneFolder {
    let folder = SceneFolder::new();
    folder.write("mesh.ply", PLY);
    image::RgbImage::new(1, 1)
        .save(folder.path("t.png"))
        .unwrap();
    folder
}

#[track_caller]
fn refuses(more: &str, parts: &[&str]) {
    let folder = folder();
    let scene = format!("{CAMERA}{LIGHT}{more}");
    assert_says(&folder.error(folder.load(&scene)), parts);
}

#[test]
fn textures_and_their_lookups() {
    folder().load(&format!("{CAMERA}{LIGHT}[[texture]]\npath = \"t.png\"\n{CLAY}kd_texture = {{ texture = 0, wrap = [\"clamp\", \"mirror\"] }}\n{MESH}")).unwrap();
    let texture = "[[texture]]\npath = \"t.png\"\n";
    rows! { refuses;
        "[[texture]]\n" => "[[texture]] has no \"path\"";
        "[[texture]]\npath = \"no.png\"\n" => "cannot read the texture", "no.png";
        "[[texture]]\npath = \"no.exr\"\n" => "cannot read the texture", "no.exr";
        "[[texture]]\npath = \"no.exr\"\nencoding = \"srgb\"\n" =>
            "scene.toml:13: \"encoding\"", "OpenEXR, which is linear";
        format!("{texture}encoding = \"srgb\"\n{CLAY}normal_texture = 0\n{MESH}") =>
            "the texture of normal_texture is encoded as sRGB";
        format!("{texture}encoding = \"gamma\"\n") => "unknown encoding \"gamma\"", "linear, srgb";
        format!("{texture}{CLAY}kd_texture = 1\n") =>
            "scene.toml:15: \"kd_texture\"", "is 1, and there are 1 [[texture]] tables";
        format!("{texture}{CLAY}kd_texture = {{ texture = 0, wrap = [\"clamp\"] }}\n") =>
            "there are 1 values", "along u and along v";
        format!("{texture}{CLAY}kd_texture = {{ texture = 0, filter = \"cubic\" }}\n") =>
            "unknown filter \"cubic\"", "bilinear, nearest";
        format!("{texture}{CLAY}kd_texture = \"t.png\"\n") =>
            "\"kd_texture\" in [material.clay] is the string";
    }
}

#[test]
fn meshes_that_stay_as_they_are() {
    let mesh = |from: &str, to: &str| format!("{CLAY}{}", MESH.replace(from, to));
    rows! { refuses;
        mesh("materials = [\"clay\"]\n", "") => "has no \"materials\"";
        mesh("\"clay\"", "\"cly\"") => "no [material.cly]", "did you mean \"clay\"";
        mesh("mesh.ply", "mesh.obj") => "\"to_world\"", "is for PLY files";
        mesh("materials", "scale = 2\nmaterials") => "\"scale\"", "beside \"to_world\"";
        mesh(", 0, 0, 0]", "]") => "an array of 12 finite numbers";
        format!("{CLAY}[[mesh]]\npath = \"mesh.ply\"\nname = \"a\"\n") =>
            "\"name\" in [[mesh]] belongs to a mesh with \"to_world\"";
    }
    let folder = folder();
    folder.write("mesh.ply", PLY.replace("3 0 1 2 0", "3 0 1 2 1"));
    let scene = format!("{CAMERA}{LIGHT}{CLAY}{MESH}");
    assert_says(
        &folder.error(folder.load(&scene)),
        &["mesh.ply:14", "material_index 1, but the [[mesh]] lists 1"],
    );
}

#[test]
fn patterns_and_carriers() {
    let lamp = "[[light]]\nkind = \"pattern\"\nposition = [0, 0, 0]\ndirection = [0, -1, 0]\nup = [0, 0, 1]\npower_w = 1\npattern = \"lamp.json\"\n";
    for (text, parts) in [
        ("{", &["lamp.json: not a pattern in JSON"][..]),
        ("{}", &["no list of numbers \"gammas_rad\""]),
        (
            "{\"gammas_rad\": [0, 1], \"planes_rad\": [0, 1], \"intensities\": [1, 1, 1, 1]}",
            &["from 0 to 360 degrees"],
        ),
    ] {
        let folder = folder();
        folder.write("lamp.json", text);
        let scene = format!("{CAMERA}{lamp}");
        assert_says(&folder.error(folder.load(&scene)), parts);
    }
    let projector = "[[light]]\nkind = \"projector\"\nposition = [0, 0, 0]\ndirection = [0, -1, 0]\nup = [0, 0, 1]\nfov_y_deg = 20\npower_w = 1\nimage = \"t.png\"\n";
    rows! { refuses;
        format!("{projector}white = 1\n") => "white is given", "t.png is no OpenEXR image";
        format!("{projector}white = 0\n") => "\"white\"", "give a number above 0";
    }
    let light = "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\npower_w = 1\nmoves_with = \"mesh\"\nmesh = 3\n";
    refuses(light, &["is 3, and there are 0 meshes"]);
    let light = light.replace("mesh = 3", "relative_to = \"camera\"");
    refuses(&light, &["conflicts with \"relative_to\""]);
}
