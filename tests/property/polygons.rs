//! Any simple polygon becomes triangles that cover its area once, in every format that has polygons. The order of vertices and corners
//! changes no triangle.

use std::fmt::Write;

use crate::common::scene_folder::{CAMERA, LIGHT, SceneFolder};
use camlux::scene::Mesh;
use glam::{DQuat, DVec2, DVec3};

const ROUNDS: usize = 400;

/// A random simple polygon, counterclockwise in its plane.
fn outline(random: &mut fastrand::Rng) -> Vec<DVec2> {
    let count = 3 + random.usize(..30);
    match random.usize(..4) {
        // A star: the radius varies, and no angle repeats.
        0 => {
            let corner = |i: usize| {
                let angle = std::f64::consts::TAU * i as f64 / count as f64;
                DVec2::from_angle(angle) * (0.1 + random.f64())
            };
            (0..count).map(corner).collect()
        }
        // A comb, whose teeth have random lengths.
        1 => {
            let mut corners = vec![DVec2::new(count as f64, -1.0)];
            for tooth in (0..count).rev() {
                let x = tooth as f64;
                let length = 0.5 + random.f64();
                corners.push(DVec2::new(x + 0.9, 0.0));
                corners.push(DVec2::new(x + 0.9, length));
                corners.push(DVec2::new(x + 0.4, length));
                corners.push(DVec2::new(x + 0.4, 0.0));
            }
            corners.push(DVec2::new(0.0, -1.0));
            corners
        }
        // A spiral: out along one arm, back along a narrower one.
        2 => {
            let arm = |width: f64| {
                (0..=4 * count).map(move |i| {
                    let angle = 0.3 * f64::from(i as u32);
                    DVec2::from_angle(angle) * (0.2 + width + 0.1 * angle)
                })
            };
            let inner: Vec<DVec2> = arm(0.0).collect();
            arm(0.15).chain(inner.into_iter().rev()).collect()
        }
        // Corners along straight edges.
        _ => {
            let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from);
            let edges = (0..4).map(|i| (square[i], square[(i + 1) % 4]));
            let part = |a: DVec2, b: DVec2, i: usize| a.lerp(b, i as f64 / count as f64);
            let points = edges.map(|(a, b)| (0..count).map(move |i| part(a, b, i)));
            points.flatten().collect()
        }
    }
}

/// The outline in a random plane, near the origin or far from it.
fn placed(outline: &[DVec2], random: &mut fastrand::Rng) -> Vec<DVec3> {
    let turn = DQuat::from_euler(
        glam::EulerRot::XYZ,
        7.0 * random.f64(),
        7.0 * random.f64(),
        7.0 * random.f64(),
    );
    let origin = match random.bool() {
        true => DVec3::ZERO,
        false => DVec3::new(4e5, -5e6, 30.0),
    };
    let start = random.usize(..outline.len());
    let corners = (0..outline.len()).map(|i| outline[(start + i) % outline.len()]);
    corners
        .map(|corner| origin + turn * corner.extend(0.0))
        .collect()
}

fn obj(corners: &[DVec3], face: &[usize]) -> String {
    let mut text = String::new();
    for [x, y, z] in corners.iter().map(DVec3::to_array) {
        writeln!(text, "v {x:?} {y:?} {z:?}").unwrap();
    }
    let face: Vec<String> = face.iter().map(|i| (i + 1).to_string()).collect();
    writeln!(text, "f {}", face.join(" ")).unwrap();
    text
}

fn ply(corners: &[DVec3], face: &[usize]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n",
        corners.len()
    );
    for [x, y, z] in corners.iter().map(DVec3::to_array) {
        writeln!(text, "{x:?} {y:?} {z:?}").unwrap();
    }
    let face_words: Vec<String> = face.iter().map(ToString::to_string).collect();
    writeln!(text, "{} {}", face.len(), face_words.join(" ")).unwrap();
    text
}

fn load(folder: &SceneFolder, name: &str, content: &str) -> Mesh {
    folder.write(name, content);
    let mesh =
        format!("[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"{name}\"\nmaterial = \"clay\"\n");
    let scene = folder.load(&format!("{CAMERA}{LIGHT}{mesh}")).unwrap();
    Mesh::clone(&scene.meshes[0])
}

/// The corners of the triangles, in their order, each beginning with its least corner.
fn triangles(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    let position = |vertex: u32| mesh.positions_m[vertex as usize];
    mesh.triangles.iter().map(|t| t.map(position)).collect()
}

fn double_area(outline: &[DVec3]) -> DVec3 {
    let first = outline[0];
    let pairs = outline.windows(2);
    pairs
        .map(|pair| (pair[0] - first).cross(pair[1] - first))
        .sum()
}

#[test]
fn any_simple_polygon_is_covered_once_in_every_format() {
    let folder = SceneFolder::new();
    let mut random = fastrand::Rng::with_seed(48);
    for round in 0..ROUNDS {
        let corners = placed(&outline(&mut random), &mut random);
        let in_order: Vec<usize> = (0..corners.len()).collect();
        let due = double_area(&corners);
        // Coordinates of a million metres have 1e-9 m, and areas the products of that.
        let largest = corners.iter().map(|c| c.length()).fold(1.0, f64::max);
        let tolerance = 1e-13 * largest * corners.len() as f64;
        for (name, text) in [
            ("a.obj", obj(&corners, &in_order)),
            ("a.ply", ply(&corners, &in_order)),
        ] {
            let mesh = load(&folder, name, &text);
            let areas: Vec<DVec3> = triangles(&mesh).iter().map(|t| double_area(t)).collect();
            let sum: f64 = areas.iter().map(|area| area.length()).sum();
            // If the triangles do not overlap, and none is on its back, the sum of their areas is that of the polygon.
            assert!(
                (sum - due.length()).abs() <= tolerance,
                "{round} {name}: {sum} for {}\n{text}",
                due.length()
            );
            let turned = areas
                .iter()
                .filter(|a| a.dot(due) < -tolerance * due.length());
            assert_eq!(turned.count(), 0, "{round} {name}\n{text}");
        }
    }
}

#[test]
fn the_order_of_vertices_changes_no_triangle() {
    let folder = SceneFolder::new();
    let mut random = fastrand::Rng::with_seed(49);
    for _ in 0..ROUNDS / 4 {
        let corners = placed(&outline(&mut random), &mut random);
        let in_order: Vec<usize> = (0..corners.len()).collect();
        let mut shuffled = in_order.clone();
        random.shuffle(&mut shuffled);
        // Each corner is at another place of the list, where some are twice.
        let mut list = vec![DVec3::ZERO; corners.len()];
        for (from, &to) in shuffled.iter().enumerate() {
            list[to] = corners[from];
        }
        list.extend(corners.iter().take(2));
        shuffled[0] = corners.len();
        for (name, plain, reindexed) in [
            ("a.obj", obj(&corners, &in_order), obj(&list, &shuffled)),
            ("a.ply", ply(&corners, &in_order), ply(&list, &shuffled)),
        ] {
            let plain = triangles(&load(&folder, name, &plain));
            assert_eq!(triangles(&load(&folder, name, &reindexed)), plain, "{name}");
        }
    }
}

#[test]
fn a_reversed_polygon_is_covered_from_the_other_side() {
    let folder = SceneFolder::new();
    let mut random = fastrand::Rng::with_seed(50);
    for _ in 0..ROUNDS / 4 {
        let corners = placed(&outline(&mut random), &mut random);
        let mut order: Vec<usize> = (0..corners.len()).collect();
        let total = |order: &[usize]| -> DVec3 {
            let mesh = load(&folder, "a.obj", &obj(&corners, order));
            triangles(&mesh).iter().map(|t| double_area(t)).sum()
        };
        let forwards = total(&order);
        order.reverse();
        let backwards = total(&order);
        let largest = corners.iter().map(|c| c.length()).fold(1.0, f64::max);
        assert!((forwards + backwards).length() <= 1e-12 * largest * corners.len() as f64);
    }
}
