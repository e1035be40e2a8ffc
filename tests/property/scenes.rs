//! Generated scenes: files under `scenes/` are what the generator makes, and all meshes are sound.

#[path = "../../examples/generate_scenes/knot.rs"]
mod knot;
#[path = "../../examples/generate_scenes/leaves.rs"]
mod leaves;
#[path = "../../examples/generate_scenes/meshes/mod.rs"]
mod meshes;
#[path = "../../examples/generate_scenes/textures.rs"]
mod textures;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use camlux::scene::{Scene, Shadow};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn committed_knot() -> String {
    fs::read_to_string(scenes().join("knot.obj")).expect("scenes/knot.obj is checked in")
}

/// Numbers after the keyword in every line that starts with it.
fn rows(obj: &str, keyword: &str) -> Vec<Vec<i64>> {
    obj.lines()
        .filter_map(|line| line.strip_prefix(keyword))
        .map(|rest| {
            rest.split_whitespace()
                .map(|word| word.parse().expect("whole numbers only"))
                .collect()
        })
        .collect()
}

/// Vertex indices from 0, each quad cut along its first diagonal as OBJ readers do.
fn triangles(obj: &str) -> Vec<[usize; 3]> {
    rows(obj, "f ")
        .iter()
        .flat_map(|quad| {
            let [a, b, c, d] = quad[..] else {
                panic!("not a quad: {quad:?}")
            };
            [[a, b, c], [a, c, d]].map(|corners| corners.map(|index| index as usize - 1))
        })
        .collect()
}

#[test]
fn the_leaves_are_what_the_generator_makes() {
    let committed = fs::read_to_string(scenes().join("leaves.obj")).expect("it is checked in");
    assert!(
        committed == leaves::obj(),
        "scenes/leaves.obj differs from its generator; run: cargo run --release --example generate_scenes"
    );
}

#[test]
fn the_knot_is_what_the_generator_makes() {
    // Not assert_eq, which would print a megabyte.
    assert!(
        committed_knot() == knot::obj(),
        "scenes/knot.obj differs from its generator; run: cargo run --release --example generate_scenes"
    );
}

#[test]
fn the_textures_are_what_the_generator_makes() {
    // Compares pixels, because the bytes of a PNG depend on the version of the encoder.
    for (file, made) in [
        ("tiles.png", textures::tiles().into()),
        ("bricks.png", textures::bricks().into()),
        ("brick_heights.png", textures::brick_heights().into()),
        ("leaf.png", textures::leaf().into()),
        ("stripes.png", textures::stripes().into()),
    ] {
        let made: image::DynamicImage = made;
        let committed = image::open(scenes().join(file)).expect("the texture is checked in");
        assert_eq!(committed.width(), made.width(), "{file}");
        assert!(
            committed.into_rgba8() == made.into_rgba8(),
            "scenes/{file} differs from its generator; run: cargo run --release --example generate_scenes"
        );
    }
}

#[test]
fn the_knot_has_at_least_50_000_triangles() {
    assert!(triangles(&committed_knot()).len() >= 50_000);
}

#[test]
fn the_knot_is_closed_and_evenly_oriented() {
    let mut uses_of_edge: HashMap<[usize; 2], u32> = HashMap::new();
    for [a, b, c] in triangles(&committed_knot()) {
        for edge in [[a, b], [b, c], [c, a]] {
            *uses_of_edge.entry(edge).or_default() += 1;
        }
    }
    for ([from, to], uses) in &uses_of_edge {
        assert_eq!(*uses, 1, "edge {from}-{to} is used twice in one direction");
        assert_eq!(
            uses_of_edge.get(&[*to, *from]),
            Some(&1),
            "edge {from}-{to} has no second triangle"
        );
    }
}

#[test]
fn the_knot_has_no_degenerate_triangle_and_no_lone_vertex() {
    let obj = committed_knot();
    let positions = rows(&obj, "v ");
    let mut is_used = vec![false; positions.len()];
    for corners in triangles(&obj) {
        let [a, b, c] = corners.map(|index| &positions[index]);
        let u: [i64; 3] = std::array::from_fn(|i| b[i] - a[i]);
        let v: [i64; 3] = std::array::from_fn(|i| c[i] - a[i]);
        // Exact in whole numbers: only a triangle without area gives zero.
        let double_area = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        assert_ne!(double_area, [0; 3], "triangle {corners:?}");
        for index in corners {
            is_used[index] = true;
        }
    }
    assert!(is_used.iter().all(|used| *used));
}

#[test]
fn the_knot_faces_outwards() {
    let obj = committed_knot();
    let positions = rows(&obj, "v ");
    let six_volumes: i128 = triangles(&obj)
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|index| &positions[index]);
            i128::from(
                a[0] * (b[1] * c[2] - b[2] * c[1])
                    + a[1] * (b[2] * c[0] - b[0] * c[2])
                    + a[2] * (b[0] * c[1] - b[1] * c[0]),
            )
        })
        .sum();
    let volume_m3 = six_volumes as f64 / 6.0 * 1e-15;
    // The tube's cross-section, π·(0.115² + 0.012²/2) m², times 7.21 m of centre line: 0.301 m³. Its 52 sides reduce this by
    // 0.2 %. Inward faces would make it negative.
    assert!((0.298..0.302).contains(&volume_m3), "{volume_m3} m³");
}

#[test]
fn the_mesh_scenes_load_and_have_sound_surfaces() {
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    for mesh_scene in meshes::SCENES {
        let name = mesh_scene.name;
        mesh_scene
            .write(folder.path())
            .expect("the folder can be written");
        let scene = load(folder.path(), name);
        let triangle_count = check_surfaces(&scene, name);
        assert!(
            (40_000..130_000).contains(&triangle_count),
            "{name} has {triangle_count} triangles"
        );
        assert_eq!(scene.warnings(), [""; 0], "{name}");
        assert_eq!(scene.direct.shadow, Some(Shadow::Rays), "{name}");
        let is_lit_from_a_place = scene.lights.iter().all(|l| l.position_m().is_some());
        let of_tof = format!("{name}_tof");
        let has_tof = folder.path().join(format!("{of_tof}.toml")).exists();
        assert_eq!(has_tof, is_lit_from_a_place, "{name}");
        if has_tof {
            let tof = load(folder.path(), &of_tof).tof.expect("a camera");
            assert_eq!(tof.frequencies_hz, [20e6, 100e6], "{name}");
        }
        let brightest = scene.materials.iter().flat_map(|material| material.kd);
        assert!(brightest.fold(0.0, f64::max) <= 0.8, "{name} has k_d > 0.8");
    }
}

#[test]
fn the_knot_has_as_many_triangles_as_asked() {
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    for asked in [1_000, 10_000, 100_000] {
        meshes::write_knot(asked, folder.path()).expect("the folder can be written");
        let name = format!("knot_{asked}");
        let made = check_surfaces(&load(folder.path(), &name), &name);
        let off = (made as f64 / asked as f64 - 1.0).abs();
        assert!(off < 0.05, "{made} triangles instead of {asked}");
    }
}

/// A mesh that a scene file names several times is loaded once and instanced.
#[test]
fn a_hundred_knots_share_a_mesh() {
    let folder = tempfile::tempdir().expect("there is room for temporary files");
    meshes::write_knots(100, 1_000, folder.path()).expect("the folder can be written");
    let scene = load(folder.path(), "knots_100");
    let [room, knots @ ..] = &scene.meshes[..] else {
        panic!("no meshes");
    };
    assert!(room.is_in_world_space());
    assert_eq!(knots.len(), 100);
    let bounds = scene.bounding_box().expect("it has triangles");
    for knot in knots {
        assert!(knot.mesh.ptr_eq(&knots[0].mesh) && !knot.is_in_world_space());
        // Within the room.
        let centre_m = knot.to_world.translation;
        assert!(centre_m.cmpgt(bounds.min_m).all() && centre_m.cmplt(bounds.max_m).all());
    }
    assert_ne!(knots[0].to_world, knots[1].to_world);
}

fn load(folder: &Path, name: &str) -> Scene {
    Scene::load(&folder.join(format!("{name}.toml"))).unwrap_or_else(|error| panic!("{error}"))
}

/// Checks that each triangle has an area and unit normals. Returns the number of triangles.
fn check_surfaces(scene: &Scene, name: &str) -> usize {
    let mut triangle_count = 0;
    for mesh in &scene.meshes {
        triangle_count += mesh.triangles.len();
        for triangle in &mesh.triangles {
            let corners = triangle.map(|index| index as usize);
            let [a, b, c] = corners.map(|index| mesh.positions_m[index]);
            let double_area_m2 = (b - a).cross(c - a).length();
            assert!(double_area_m2 > 0.0, "{name}: no area: {triangle:?}");
            for index in corners.into_iter().filter(|_| !mesh.normals.is_empty()) {
                let shading_normal = mesh.normals[index];
                assert!(
                    shading_normal.is_normalized(),
                    "{name}: {triangle:?} has normal {shading_normal}"
                );
            }
        }
    }
    triangle_count
}
