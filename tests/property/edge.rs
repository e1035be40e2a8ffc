//! Which pixels of a reference are on edges: silhouettes, creases and borders, but not facets of a smooth surface.

use std::f64::consts::PI;

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, sub_pixel_bits};
use crate::common::rooms::scene_of;
use camlux::{
    Scene,
    output::{Frame, Layer},
    reference::Reference,
    scene::{Intrinsics, Lens, Light, Mesh},
};
use glam::DVec3;

const SIZE: usize = 64;
/// Depth of the plane z = 0; a pixel is 1/16 m there.
const DISTANCE_M: f64 = 4.0;
/// x of the pixel centres of column 40.
const COLUMN_M: f64 = 8.5 / 16.0;

fn scene(meshes: Vec<Mesh>, camera_m: DVec3) -> Scene {
    let light = Light::point(DVec3::ONE, [1.0; 3]);
    let mut scene = scene_of(meshes, light, camera_m, camera_m - DVec3::Z);
    let half = SIZE as f64 / 2.0;
    scene.camera.lens = Lens::Intrinsics(Intrinsics {
        fx: 64.0,
        fy: 64.0,
        cx: half,
        cy: half,
        skew: 0.0,
    });
    scene
}

/// Column and row of the edge pixels.
fn edges(scene: &Scene) -> Vec<[usize; 2]> {
    let reference = Reference::new(scene, 1).expect("the scene is valid");
    let frame = reference.frame();
    let ids = frame.ids(Layer::Edge).expect("every reference has it");
    let marked = ids.iter().enumerate().filter(|(_, id)| **id > 0);
    marked.map(|(i, _)| [i % SIZE, i / SIZE]).collect()
}

/// Edge pixels in the middle rows and columns, without the outer borders of [`strips`].
fn edges_in_front(meshes: Vec<Mesh>) -> Vec<[usize; 2]> {
    let mut edges = edges(&scene(meshes, DISTANCE_M * DVec3::Z));
    edges.retain(|[column, row]| (12..52).contains(row) && (20..46).contains(column));
    edges
}

fn column_40() -> Vec<[usize; 2]> {
    (12..52).map(|row| [40, row]).collect()
}

/// Two strips along y that share the corners at (`x`, 0). The right strip recedes to `z`.
fn strips(x: f64, z: f64) -> Mesh {
    let at = |x: f64, z: f64| [[x, -1.5, z], [x, 1.5, z]];
    let positions = [at(-1.0, 0.0), at(x, 0.0), at(1.0, z)];
    let triangles = [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
    Mesh::from_slices("strips", positions.as_flattened(), &triangles, 0)
}

fn folded(angle_deg: f64) -> Mesh {
    let fall = angle_deg.to_radians().tan();
    strips(COLUMN_M, -fall * (1.0 - COLUMN_M))
}

#[test]
fn a_silhouette_through_pixel_centres() {
    let pixel_m = 1.0 / 16.0;
    for (off_px, is_near) in [
        (0.0, true),
        (0.007, true),
        (-0.007, true),
        (0.009, false),
        (-0.009, false),
        (0.5, false),
    ] {
        let mut mesh = strips(COLUMN_M + off_px * pixel_m, 0.0);
        mesh.triangles.truncate(2);
        mesh.triangle_materials.truncate(2);
        let expected = if is_near { column_40() } else { Vec::new() };
        assert_eq!(edges_in_front(vec![mesh]), expected, "{off_px} px");
    }
}

#[test]
fn creases_and_borders() {
    let none: [[usize; 2]; 0] = [];
    assert_eq!(edges_in_front(vec![folded(0.0)]), none);
    assert_eq!(edges_in_front(vec![folded(9.0)]), none);
    assert_eq!(edges_in_front(vec![folded(11.0)]), column_40());
    assert_eq!(edges_in_front(vec![folded(-80.0)]), column_40());

    // Shaded smoothly across the fold.
    let mut round = folded(40.0);
    round.normals = vec![DVec3::Z; 6];
    assert_eq!(edges_in_front(vec![round]), none);

    let mut painted = folded(0.0);
    painted.triangle_materials = vec![0, 0, 1, 1];
    let unseen = Mesh::from_slices("unseen", &[[0.0, 0.0, 9.0]; 3], &[[0, 1, 2]], 1);
    assert_eq!(edges_in_front(vec![painted, unseen]), column_40());

    let mut left = folded(0.0);
    let mut right = left.clone();
    left.triangles.truncate(2);
    left.triangle_materials.truncate(2);
    right.triangles.drain(..2);
    right.triangle_materials.drain(..2);
    assert_eq!(edges_in_front(vec![left, right]), column_40());
}

/// Two treads of one mesh, seen at four degrees. They have the same normal, and their offset in height is small for their distance.
#[test]
fn a_step_at_a_grazing_angle() {
    let eye_m = 0.3;
    // The upper tread's far border is seen at the pixel centres of row 36.
    let border = DISTANCE_M - 64.0 * eye_m / 4.5;
    let tread = |y: f64, near: f64, far: f64| {
        [
            [-1.0, y, near],
            [1.0, y, near],
            [1.0, y, far],
            [-1.0, y, far],
        ]
    };
    let positions = [tread(0.0, 2.0, border), tread(-0.02, 1.0, -30.0)];
    let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let mesh = Mesh::from_slices("treads", positions.as_flattened(), &triangles, 0);
    let found = edges(&scene(vec![mesh], DVec3::new(0.0, eye_m, DISTANCE_M)));
    for column in 26..38 {
        let rows: Vec<usize> = found
            .iter()
            .filter(|e| e[0] == column)
            .map(|e| e[1])
            .collect();
        assert_eq!(rows, [36], "column {column}");
    }
}

fn sphere(rings: u32, is_smooth: bool) -> Mesh {
    let sectors = 2 * rings;
    let point = |ring: u32, sector: u32| {
        let polar = PI * f64::from(ring) / f64::from(rings);
        let turn = 2.0 * PI * f64::from(sector) / f64::from(sectors);
        [
            polar.sin() * turn.cos(),
            polar.cos(),
            polar.sin() * turn.sin(),
        ]
    };
    let positions: Vec<[f64; 3]> = (0..=rings)
        .flat_map(|ring| (0..sectors).map(move |sector| point(ring, sector)))
        .collect();
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let index = |ring: u32, sector: u32| ring * sectors + sector % sectors;
            let [a, b] = [index(ring, sector), index(ring, sector + 1)];
            let [c, d] = [index(ring + 1, sector + 1), index(ring + 1, sector)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut mesh = Mesh::from_slices("sphere", &positions, &triangles, 0);
    if is_smooth {
        mesh.normals = mesh.positions_m.clone();
    }
    mesh
}

/// Flat-shaded facets of up to 8° and smoothly shaded facets of any size are one surface, up to the silhouette.
#[test]
fn facets_are_no_edges() {
    for (rings, is_smooth) in [
        (24, false),
        (100, false),
        (12, true),
        (24, true),
        (400, true),
    ] {
        let sphere = sphere(rings, is_smooth);
        let found = edges(&scene(vec![sphere], DISTANCE_M * DVec3::Z));
        let radius = |[column, row]: &[usize; 2]| {
            let [x, y] = [column, row].map(|&px| px as f64 + 0.5 - 32.0);
            x.hypot(y)
        };
        // 64 pixels times tan(asin(1/4)). The facets are within the sphere.
        let silhouette = 64.0 / 15_f64.sqrt();
        let inner = silhouette * (PI / f64::from(rings)).cos() - 0.1;
        let inside: Vec<_> = found.iter().filter(|e| radius(e) < inner).collect();
        println!(
            "{rings} rings, smooth {is_smooth}: {} edge pixels",
            found.len()
        );
        assert!(inside.is_empty(), "{rings} {is_smooth}: {inside:?}");
        assert!(found.len() < 20);
    }
}

/// The box's edges run through the pixel centres of the image's diagonals.
#[test]
fn edges_of_the_cornell_box() {
    let scene = demo_scene("cornell", [400, 400]);
    let frame = Reference::new(&scene, 1)
        .expect("the scene is valid")
        .frame();
    let ids = frame.ids(Layer::Edge).expect("every reference has it");
    let count = ids.iter().filter(|id| **id > 0).count();
    let diagonal = |i: &usize| i % 400 == i / 400 || i % 400 == 399 - i / 400;
    let on_diagonals = (0..ids.len())
        .filter(diagonal)
        .filter(|&i| ids[i] > 0)
        .count();
    println!(
        "{count} of {} pixels, {on_diagonals} on the diagonals",
        ids.len()
    );
    assert!(on_diagonals >= 70);
    assert!(count < ids.len() / 200, "{count}");
}

/// Where the engine shows another mesh or material than the reference, the pixel is on an edge.
#[test]
fn surfaces_differ_on_edges_only() {
    let mut gpu = Gpu::open();
    let mut differ = 0;
    for name in DEMO_SCENES {
        let scene = Scene {
            indirect: None,
            vignetting_map: None,
            left_out: Vec::new(),
            ..demo_scene(name, [400, 400])
        };
        let image = gpu.render(&scene);
        let truth = Reference::new(&scene, 1).expect("the scene is valid");
        let truth = truth.with_sub_pixel_bits(sub_pixel_bits()).frame();
        let edges = truth.ids(Layer::Edge).expect("every reference has it");
        let mut unmarked = Vec::new();
        for (pixel, &edge) in edges.iter().enumerate() {
            let is_other = |layer: Layer| {
                let at = |frame: &Frame| frame.ids(layer).expect("it is there")[pixel];
                at(&image) != at(&truth)
            };
            if is_other(Layer::InstanceId) || is_other(Layer::MaterialId) {
                differ += 1;
                if edge == 0 {
                    unmarked.push([pixel % 400, pixel / 400]);
                }
            }
        }
        let marked = edges.iter().filter(|edge| **edge > 0).count();
        println!("{name}: {marked} edge pixels; {differ} other surfaces so far");
        assert!(unmarked.is_empty(), "{name}: {unmarked:?}");
        // Each sub-pixel bit less doubles the number of edge pixels.
        let most = (edges.len() / 100) << (8 - sub_pixel_bits().min(8));
        assert!(marked < most, "{name}");
    }
    assert!(differ > 0);
}
