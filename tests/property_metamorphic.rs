//! What must happen to the image when the scene is changed in a way whose effect is known, on random rooms (proptest): no truth is
//! needed for that. Always the same rooms, so that a failure stays.
#![cfg(feature = "reference")]

mod gpu;
mod rmse;

use camlux::{
    Scene,
    doctor::scenes::{
        COLOURED, GLOSSY, GREY, amplified, cuboid, moved, point_light, scene_of, spot_light,
        with_sum,
    },
    glam::DVec3,
    output::{Frame, Layer},
    scene::{Bands, Estimator, Light, Mesh},
};
use gpu::Gpu;
use proptest::{
    prelude::*,
    test_runner::{Config, TestRunner},
};
use rmse::relative_rmse;

const BIT_FOR_BIT: [f64; 2] = [0.0; 2];
/// The rounding of other sums.
const ROUNDING: [f64; 2] = [1e-6; 2];
/// Of 576 pixels.
const MAX_EDGE_PIXELS: usize = 2;
/// Random rooms of each relation.
const ROOMS: u32 = 12;

fn vector(low: f64, high: f64) -> impl Strategy<Value = DVec3> {
    [low..high, low..high, low..high].prop_map(DVec3::from_array)
}

fn block() -> impl Strategy<Value = Mesh> {
    (
        vector(-0.8, 0.4),
        vector(0.05, 0.5),
        prop::sample::select(vec![GREY, COLOURED, GLOSSY]),
    )
        .prop_map(|(corner_m, size_m, material)| cuboid("block", corner_m, size_m, material))
}

fn light() -> impl Strategy<Value = Light> {
    let direction = || vector(-1.0, 1.0).prop_filter("it points somewhere", |d| d.length() > 0.1);
    prop_oneof![
        vector(-0.9, 0.9).prop_map(point_light),
        (vector(-0.9, 0.9), direction(), 5.0..40.0, 1.0..40.0).prop_map(
            |(at_m, direction, inner, more)| spot_light(at_m, direction, [inner, inner + more])
        ),
    ]
}

/// A room of 2 m, blocks in it, a camera and a light somewhere.
fn room() -> impl Strategy<Value = Scene> {
    let estimator = prop::sample::select(Estimator::ALL.to_vec());
    (
        prop::collection::vec(block(), 0..4),
        light(),
        vector(-0.9, 0.9),
        vector(-0.3, 0.3),
        estimator,
    )
        .prop_map(|(mut meshes, light, eye_m, look_at_m, estimator)| {
            meshes.push(cuboid("room", DVec3::splat(-1.0), DVec3::splat(2.0), GREY));
            with_sum(&scene_of(meshes, light, eye_m, look_at_m), estimator, 16)
        })
}

/// Direct and indirect light, each with the change that is expected, and the bounds of their relRMSE; 0: bit for bit.
fn assert_alike(
    gpu: &mut Gpu,
    [before, after]: [&Scene; 2],
    change: fn(Bands) -> Bands,
    bounds: [f64; 2],
) {
    let [before, after] = [before, after].map(|scene| gpu.render(scene));
    let values = |frame: &Frame, layer| frame.values(layer).expect("it is there").to_vec();
    // A pixel whose centre lies on an edge shows either of two surfaces, and both are right.
    let [normals, other_normals] = [&before, &after].map(|frame| values(frame, Layer::Normal));
    let is_same: Vec<bool> = normals
        .chunks_exact(3)
        .zip(other_normals.chunks_exact(3))
        .map(|(a, b)| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3))
        .collect();
    let other_count = is_same.iter().filter(|is_same| !**is_same).count();
    assert!(
        other_count
            <= if bounds == BIT_FOR_BIT {
                0
            } else {
                MAX_EDGE_PIXELS
            }
    );
    for (layer, bound) in [Layer::Direct, Layer::Indirect].into_iter().zip(bounds) {
        let of_surfaces = |frame: &Frame| -> Vec<[f32; 3]> {
            let values = values(frame, layer);
            let pixels = values.as_chunks().0.iter().zip(&is_same);
            pixels
                .filter_map(|(pixel, is_same)| is_same.then_some(*pixel))
                .collect()
        };
        let expected: Vec<Bands> = of_surfaces(&before)
            .into_iter()
            .map(|bands| change(bands.map(f64::from)))
            .collect();
        let found = of_surfaces(&after).into_flattened();
        let exact: Vec<f32> = expected.iter().flatten().map(|v| *v as f32).collect();
        if bound == 0.0 || exact.iter().all(|value| *value == 0.0) {
            assert!(found == exact, "{} is another", layer.name());
        } else {
            let error = relative_rmse(&found, &expected);
            assert!(
                error <= bound,
                "{}: {error:.1e} over {bound:.1e}",
                layer.name()
            );
        }
    }
}

/// Runs a relation on random rooms.
fn on_rooms(relation: impl Fn(&mut Gpu, &Scene)) {
    let config = Config {
        cases: ROOMS,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner = TestRunner::new_with_rng(
        config,
        proptest::test_runner::TestRng::deterministic_rng(
            proptest::test_runner::RngAlgorithm::ChaCha,
        ),
    );
    let gpu = std::cell::RefCell::new(Gpu::open());
    runner
        .run(&room(), |scene| {
            relation(&mut gpu.borrow_mut(), &scene);
            Ok(())
        })
        .expect("the relation holds in every room");
}

#[test]
fn four_times_the_power_is_four_times_the_image_bit_for_bit() {
    on_rooms(|gpu, scene| {
        let mut brighter = scene.clone();
        brighter.lights = vec![amplified(scene.lights[0], [4.0; 3])];
        assert_alike(
            gpu,
            [scene, &brighter],
            |bands| bands.map(|b| 4.0 * b),
            BIT_FOR_BIT,
        );
    });
}

#[test]
fn a_scene_of_twice_the_size_has_a_quarter_of_the_light() {
    on_rooms(|gpu, scene| {
        let twice = moved(scene, 2.0, DVec3::ZERO);
        // So has rsm-average, whose light on Q alone falls with the square.
        assert_alike(
            gpu,
            [scene, &twice],
            |bands| bands.map(|b| 0.25 * b),
            ROUNDING,
        );
    });
}

#[test]
fn bands_that_change_places_do_so_in_the_image() {
    on_rooms(|gpu, scene| {
        let swapped = |[r, g, b]: Bands| [b, r, g];
        let mut other = scene.clone();
        other.lights = vec![amplified(scene.lights[0], [1.0, 2.0, 0.5])];
        let mut turned = other.clone();
        for material in &mut turned.materials {
            material.kd = swapped(material.kd);
            material.ks = swapped(material.ks);
        }
        turned.lights = vec![amplified(scene.lights[0], swapped([1.0, 2.0, 0.5]))];
        assert_alike(gpu, [&other, &turned], swapped, BIT_FOR_BIT);
    });
}

#[test]
fn the_order_of_meshes_does_not_matter() {
    on_rooms(|gpu, scene| {
        let mut reversed = scene.clone();
        reversed.meshes.reverse();
        assert_alike(gpu, [scene, &reversed], |bands| bands, ROUNDING);
    });
}

#[test]
fn two_halves_of_a_light_are_the_light() {
    on_rooms(|gpu, scene| {
        let half = amplified(scene.lights[0], [0.5; 3]);
        let mut halves = scene.clone();
        halves.lights = vec![half, half];
        assert_alike(gpu, [scene, &halves], |bands| bands, ROUNDING);
    });
}

/// Each into four, at the middles of its edges.
#[test]
fn triangles_cut_in_four_look_the_same() {
    on_rooms(|gpu, scene| {
        let mut finer = scene.clone();
        for mesh in &mut finer.meshes {
            let corners = mesh.positions_m.clone();
            let (triangles, materials) = (mesh.triangles.clone(), mesh.triangle_materials.clone());
            mesh.triangles.clear();
            mesh.triangle_materials.clear();
            for ([a, b, c], material) in triangles.into_iter().zip(materials) {
                let mut middle = |i: u32, j: u32| {
                    // The same from either side.
                    let [p, q] = [i.min(j), i.max(j)].map(|index| corners[index as usize]);
                    mesh.positions_m.push(0.5 * (p + q));
                    mesh.positions_m.len() as u32 - 1
                };
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                mesh.triangles
                    .extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                mesh.triangle_materials.extend([material; 4]);
            }
        }
        // A texel of the RSM whose centre lies on an edge shows either of two surfaces, too: it is one of 1536.
        assert_alike(gpu, [scene, &finer], |bands| bands, [1e-5, 1e-3]);
    });
}
