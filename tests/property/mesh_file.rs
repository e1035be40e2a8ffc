//! What an OBJ file and its MTL mean: transforms, normals, materials, triangulation.

use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, TRIANGLE};
use camlux::scene::Scene;
use glam::{DMat3, DVec3};

/// Rotated positions of a few metres: a handful of roundings of 1e-16 each.
const ROUNDING: f64 = 1e-14;

fn load_obj(obj: &str) -> Scene {
    SceneFolder::new().load_obj(obj).unwrap()
}

#[track_caller]
fn assert_near(actual: DVec3, expected: DVec3, tolerance: f64) {
    let distance = actual.distance(expected);
    assert!(
        distance <= tolerance,
        "{actual} is {distance:e} from {expected}"
    );
}

#[test]
fn scale_then_x_then_y_then_z_then_translate() {
    let toml = format!(
        "{CAMERA}{LIGHT}{MESH}scale = 2\nrotate_deg = [90, 90, 0]\ntranslate = [10, 20, 30]\n"
    );
    let mesh = &SceneFolder::new().load(&toml).unwrap().meshes[0];
    // Vertex (0, 1, 0): scaled (0, 2, 0), about x to (0, 0, 2), about y to (2, 0, 0), moved. The other order of the
    // rotations would give (10, 20, 32).
    assert_near(mesh.positions_m[2], DVec3::new(12.0, 20.0, 30.0), ROUNDING);
    let toml = toml.replace("[90, 90, 0]", "[0, 90, 90]");
    let mesh = &SceneFolder::new().load(&toml).unwrap().meshes[0];
    // Vertex (1, 0, 0): scaled (2, 0, 0), about y to (0, 0, -2), about z unmoved.
    assert_near(mesh.positions_m[1], DVec3::new(10.0, 20.0, 28.0), ROUNDING);
}

#[test]
fn normals_turn_with_the_mesh_and_become_unit_vectors() {
    let folder = SceneFolder::new();
    folder.write(
        "mesh.obj",
        "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 3e-200\nvn 3 0 4\nf 1//1 2//2 3//1\n",
    );
    let toml = format!("{CAMERA}{LIGHT}{MESH}scale = 5\nrotate_deg = [30, 40, 50]\n");
    let mesh = &folder.load(&toml).unwrap().meshes[0];
    let [x, y, z] = [30.0_f64, 40.0, 50.0].map(f64::to_radians);
    let rotation =
        DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    for (normal, local) in mesh
        .normals
        .iter()
        .zip([DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Z])
    {
        assert_near(*normal, rotation * local, ROUNDING);
    }
    let flat = folder.load(&format!("{toml}flat = true\n")).unwrap();
    assert!(flat.meshes[0].normals.is_empty());
}

/// f32 would hold 10⁷ + 0.001 as 10⁷; f64 holds it to 2e-9.
#[test]
fn detail_far_from_the_origin_survives() {
    let far = TRIANGLE.replace("v 1 0 0", "v 10000000.001 0 -9999999.999");
    let vertex = load_obj(&far).meshes[0].positions_m[1];
    assert_eq!(vertex, DVec3::new(10000000.001, 0.0, -9999999.999));

    let toml = format!("{CAMERA}{LIGHT}{MESH}translate = [1e7, 0, 0]\nscale = 0.001\n");
    let vertex = SceneFolder::new().load(&toml).unwrap().meshes[0].positions_m[1];
    assert_eq!(vertex.x - 1e7, 10000000.001 - 1e7);
}

#[test]
fn mtl_values_arrive_and_unused_materials_do_not() {
    let folder = SceneFolder::new();
    folder.write(
        "mesh.mtl",
        "newmtl unused\nKd 7 7 7\nnewmtl my white # 1\nKa 9 9 9\nKd 0.25\nKs .1 .2 .3 # comment\nNs 8\nillum 2\n",
    );
    let obj = TRIANGLE.replace("usemtl white", "usemtl my white # 1");
    let scene = folder.load_obj(&obj).unwrap();
    assert_eq!(scene.materials.len(), 1);
    let material = &scene.materials[0];
    assert_eq!(material.name, "my white # 1");
    assert_eq!(material.kd, [0.25; 3]);
    assert_eq!(material.ks, [0.1, 0.2, 0.3]);
    assert_eq!(material.shininess, 8.0);
}

#[test]
fn several_libraries_and_materials_in_one_mesh() {
    let folder = SceneFolder::new();
    folder
        .write("a b.mtl", "newmtl red\nKd 1 0 0\n")
        .write("c.mtl", "newmtl green\nKd 0 1 0\n");
    let obj = "mtllib mesh.mtl c.mtl\nmtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0
usemtl red\nf 1 2 3\no other\nusemtl green\nf 1 2 3\nusemtl red\nf -3 -2 -1\n";
    let scene = folder.load_obj(obj).unwrap();
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.meshes[0].triangle_materials, [0, 1, 0]);
    assert_eq!(scene.materials[0].kd, [1.0, 0.0, 0.0]);
    assert_eq!(scene.materials[1].kd, [0.0, 1.0, 0.0]);
}

#[test]
fn faces_without_normals_stay_flat_beside_smooth_ones() {
    let obj = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1
vn 0 0.6 0.8\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1 2 4\nf 1//1 2//2 4//1\n";
    let mesh = &load_obj(obj).meshes[0];
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(mesh.normals.len(), mesh.positions_m.len());
    let normals = |t: usize| mesh.triangles[t].map(|v| mesh.normals[v as usize]);
    for normal in normals(0) {
        assert_near(normal, DVec3::new(0.0, 0.6, 0.8), ROUNDING);
    }
    // Without normals, and with a zero normal: (1,0,0)×(0,0,1) = (0,-1,0).
    assert_eq!(normals(1), [DVec3::NEG_Y; 3]);
    assert_eq!(normals(2), [DVec3::NEG_Y; 3]);
    let corners = mesh.triangles[2].map(|v| mesh.positions_m[v as usize]);
    assert_eq!(corners, [DVec3::ZERO, DVec3::X, DVec3::Z]);
}

#[test]
fn texture_coordinates_follow_their_corners() {
    let obj = "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 0 1 0
vt 0.25\nvt 0.5 1 0\nvt -1 2\nf 1/3 2/2 3/1\nf 1 2 3\n";
    let mesh = &load_obj(obj).meshes[0];
    assert_eq!(mesh.texcoords.len(), mesh.positions_m.len());
    let first = mesh.triangles[0].map(|v| mesh.texcoords[v as usize]);
    assert_eq!(first, [[-1.0, 2.0], [0.5, 1.0], [0.25, 0.0]]);
}

/// A polyline is not a face. Comments and colours are not coordinates. A backslash continues a line but not a comment.
#[test]
fn obj_statements_beside_triangles() {
    let obj =
        "\u{feff}# \\\nmtllib mesh.mtl\r\n\tusemtl\twhite\nv 0 0 0 0.5\nv 1 0 0 1 0 0\nv 0 1 0 # up
l 1 2 3\np 1\ns off\ng a b\nf 1 2 \\\n 3 # face\n";
    let mesh = &load_obj(obj).meshes[0];
    assert_eq!(mesh.triangles.len(), 1);
    let corners = mesh.triangles[0].map(|v| mesh.positions_m[v as usize]);
    assert_eq!(corners, [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn comments_that_are_not_utf8() {
    let folder = SceneFolder::new();
    let mut obj = b"# caf\xe9\n".to_vec();
    obj.extend(TRIANGLE.as_bytes());
    folder.write("mesh.obj", obj);
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{MESH}")).unwrap();
    assert_eq!(scene.meshes[0].triangles.len(), 1);
}

/// Whichever corner comes first, the triangles cover the polygon once: their areas add up to its area, and none is
/// flipped.
#[test]
fn polygons_are_filled_without_folds() {
    // An arrow head: concave at the fourth corner, area 2·(½·2·1) = 2.
    let arrow = [[0.0, 0.0], [2.0, -1.0], [0.0, 3.0], [-2.0, -1.0]];
    let newell: f64 = (0..4)
        .map(|i| {
            let (a, b) = (arrow[i], arrow[(i + 1) % 4]);
            0.5 * (a[0] * b[1] - b[0] * a[1])
        })
        .sum();
    for start in 0..4 {
        let mut obj = String::from("mtllib mesh.mtl\nusemtl white\n");
        for i in 0..4 {
            let [x, y] = arrow[(start + i) % 4];
            obj += &format!("v {x} {y} 5\n");
        }
        obj += "f 1 2 3 4\n";
        let mesh = &load_obj(&obj).meshes[0];
        assert_eq!(mesh.triangles.len(), 2);
        let areas = mesh.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|v| mesh.positions_m[v as usize]);
            0.5 * (b - a).cross(c - a).z
        });
        let areas: Vec<f64> = areas.collect();
        assert!(areas.iter().all(|&area| area > 0.0), "{start}: {areas:?}");
        assert!((areas.iter().sum::<f64>() - newell).abs() < ROUNDING);
    }
    let convex =
        "mtllib mesh.mtl\nusemtl white\nv 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n";
    assert_eq!(load_obj(convex).meshes[0].triangles.len(), 3);
}
