//! What is seen of a polygon or a strip: the pixels that it covers, counted by hand.

use crate::common::gpu::Gpu;
use crate::common::scene_folder::{LIGHT, SceneFolder};
use camlux::output::Layer;

/// A camera 4 m before the plane z = 0, in which the square of −1 to 1 takes this many pixels along an edge.
fn camera(edge_px: u32) -> String {
    let size_px = edge_px + 8;
    let half_height_m = f64::from(size_px) / f64::from(edge_px);
    let fov_y_deg = 2.0 * (half_height_m / 4.0).atan().to_degrees();
    format!(
        "[camera]\nresolution = [{size_px}, {size_px}]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov_y_deg = {fov_y_deg}\n"
    )
}

fn pixels(gpu: &mut Gpu, edge_px: u32, name: &str, content: &str) -> usize {
    let folder = SceneFolder::new();
    folder.write(name, content);
    let mesh =
        format!("[material.clay]\nkd = 0.5\n[[mesh]]\npath = \"{name}\"\nmaterial = \"clay\"\n");
    let scene = folder.load(&format!("{}{LIGHT}{mesh}", camera(edge_px)));
    let frame = gpu.render(&scene.unwrap());
    let ids = frame.ids(Layer::InstanceId).expect("every frame has it");
    ids.iter().filter(|&&id| id != 0).count()
}

fn ply(vertices: &[[f64; 2]], element: &str, list: &str) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
        element {element}\nproperty list int int vertex_indices\nend_header\n",
        vertices.len()
    );
    for [x, y] in vertices {
        text += &format!("{x} {y} 0\n");
    }
    text + list + "\n"
}

fn obj(vertices: &[[f64; 2]], face: &str) -> String {
    let lines = vertices.iter().map(|[x, y]| format!("v {x} {y} 0\n"));
    lines.collect::<String>() + face + "\n"
}

#[test]
fn concave_polygons_show_their_area() {
    let mut gpu = Gpu::open();
    let corner = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 0.0],
        [0.0, 0.0],
        [0.0, 1.0],
        [-1.0, 1.0],
    ];
    // Three quarters of 92 × 92 pixels.
    let due = 6348;
    let file = ply(&corner, "face 1", "6 1 2 3 4 5 0");
    assert_eq!(pixels(&mut gpu, 92, "l.ply", &file), due);
    let file = obj(&corner, "f 2 3 4 5 6 1");
    assert_eq!(pixels(&mut gpu, 92, "l.obj", &file), due);
    // A U, which no fan of triangles fills: the square without a quarter in the middle of its upper half.
    let u = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [0.5, 1.0],
        [0.5, 0.0],
        [-0.5, 0.0],
        [-0.5, 1.0],
        [-1.0, 1.0],
    ];
    let file = ply(&u, "face 1", "8 0 1 2 3 4 5 6 7");
    assert_eq!(pixels(&mut gpu, 92, "u.ply", &file), due);
    let file = obj(&u, "f 1 2 3 4 5 6 7 8");
    assert_eq!(pixels(&mut gpu, 92, "u.obj", &file), due);
    // A dart: half of the square less the notch, 2 − 1/2 of 4.
    let dart = [[-1.0, -1.0], [0.0, -0.5], [1.0, -1.0], [0.0, 1.0]];
    let whole = f64::from(92 * 92);
    for first in 0..4 {
        let order = [0, 1, 2, 3].map(|i| (first + i) % 4);
        let list = format!("4 {} {} {} {}", order[0], order[1], order[2], order[3]);
        let seen = pixels(&mut gpu, 92, "d.ply", &ply(&dart, "face 1", &list)) as f64;
        assert!((seen / whole - 1.5 / 4.0).abs() < 0.01, "{seen}");
    }
}

#[test]
fn strips_show_all_their_triangles() {
    let mut gpu = Gpu::open();
    let vertices = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [-1.0, 0.0],
        [1.0, 0.0],
        [-1.0, 1.0],
        [1.0, 1.0],
    ];
    let file = ply(&vertices, "tristrips 1", "9 0 1 2 3 -1 2 3 4 5");
    assert_eq!(pixels(&mut gpu, 22, "s.ply", &file), 484);
}
