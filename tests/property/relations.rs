//! Random rooms (proptest), changes to them, and the comparison of two images of a room. The rooms are always the same, so that
//! failures repeat.

use std::cell::{Cell, RefCell};

use camlux::{
    Scene,
    glam::{DMat3, DQuat, DVec3},
    hard_cases::scenes::{
        COLOURED, GLOSSY, GREY, amplified, cuboid, point_light, scene_of, spot_light, with_rays,
        with_sum,
    },
    output::{Frame, Layer},
    reference::Reference,
    scene::{Bands, Light, Mesh, VplSum},
};
use proptest::{
    prelude::*,
    test_runner::{Config, RngAlgorithm, TestRng, TestRunner},
};

use crate::common::{
    gpu::{Gpu, sub_pixel_bits},
    rmse::relative_rmse,
};

/// Number of random rooms per relation.
const ROOMS: u32 = 12;
/// Target error (relRMSE) of the bounce by rays.
const TARGET_ERROR: f64 = 0.05;
/// Limit on the sum of the estimated errors of two such images. Each true error may be 1.3 times the target error
/// (`tests/compare/final_gather.rs`).
const MAX_NOISE: f64 = 2.0 * 1.3 * TARGET_ERROR;
/// At least this many rooms must have light in view. With the light inside a block, the image is black.
const LIT_ROOMS: u32 = ROOMS / 2;

/// How near two images must be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nearness {
    BitForBit,
    /// As relRMSE.
    Within(f64),
    /// Within the effect of rounding the positions of light and surfaces: see [`rounding`].
    Rounding,
    /// Within the sum of both images' estimated upper bounds, at most [`MAX_NOISE`]. By the triangle inequality this holds even if their
    /// errors are correlated.
    Noise,
}

/// What a change of the scene must do to the image.
#[derive(Clone, Copy)]
pub struct Effect {
    pub on_bands: fn(Bands) -> Bands,
    pub on_normals: DMat3,
    pub direct: Nearness,
    pub indirect: Nearness,
}

impl Effect {
    /// No effect: direct and indirect light must remain this near.
    pub fn none(direct: Nearness, indirect: Nearness) -> Effect {
        Effect {
            on_bands: |bands| bands,
            on_normals: DMat3::IDENTITY,
            direct,
            indirect,
        }
    }

    pub fn times(factor: fn(Bands) -> Bands, nearness: Nearness) -> Effect {
        Effect {
            on_bands: factor,
            ..Effect::none(nearness, nearness)
        }
    }

    /// Asserts the effect on the images of the scene before and after the change. Returns whether they have direct and indirect light.
    #[must_use]
    pub fn assert(&self, gpu: &mut Gpu, [before, after]: [&Scene; 2]) -> bool {
        let frames = [before, after].map(|scene| gpu.render(scene));
        let is_same = self.same_surfaces(before, &frames);
        let mut is_lit = true;
        for (layer, nearness) in [
            (Layer::Direct, self.direct),
            (Layer::Indirect, self.indirect),
        ] {
            let [expected, found] = frames.each_ref().map(|frame| {
                let pixels = values(frame, layer).as_chunks::<3>().0.iter();
                let pixels = pixels.zip(&is_same).filter(|(_, is_same)| **is_same);
                pixels.map(|(pixel, _)| *pixel).collect::<Vec<_>>()
            });
            let expected: Vec<Bands> = expected
                .into_iter()
                .map(|bands| (self.on_bands)(bands.map(f64::from)))
                .collect();
            let exact: Vec<f32> = expected.iter().flatten().map(|v| *v as f32).collect();
            let found = found.into_flattened();
            let is_dark = exact.iter().all(|value| *value == 0.0);
            is_lit &= !is_dark;
            if nearness == Nearness::BitForBit || is_dark {
                let off = exact.iter().zip(&found).filter(|(a, b)| a != b).count();
                assert!(off == 0, "{}: {off} values are others", layer.name());
                continue;
            }
            let bound = match nearness {
                Nearness::BitForBit => 0.0,
                Nearness::Within(bound) => bound,
                Nearness::Rounding => rounding(before, &frames[0]),
                Nearness::Noise => frames
                    .iter()
                    .map(|frame| {
                        frame
                            .stats
                            .estimated_error_upper
                            .expect("some light is found")
                    })
                    .sum::<f64>()
                    .min(MAX_NOISE),
            };
            let error = relative_rmse(&found, &expected);
            println!("{}: {error:.1e} of {bound:.1e}", layer.name());
            assert!(
                error <= bound,
                "{}: {error:.1e} over {bound:.1e}",
                layer.name()
            );
        }
        is_lit
    }

    /// The pixels to compare. Where the image need not be the same bit for bit, pixels are left out whose centre is on an edge, as near as the
    /// device rounds corners: they may show either surface or the edge itself. All other pixels must show the same surface.
    fn same_surfaces(&self, scene: &Scene, frames: &[Frame; 2]) -> Vec<bool> {
        let truth = Reference::new(scene, 1).expect("the scene is valid");
        let truth = truth.with_sub_pixel_bits(sub_pixel_bits()).frame();
        let edges = truth.ids(Layer::Edge).expect("every reference has it");
        let is_exact = self.direct == Nearness::BitForBit;
        let is_away = edges.iter().map(|edge| is_exact || *edge == 0);
        let [before, after] = frames.each_ref().map(|frame| {
            let normals = values(frame, Layer::Normal).as_chunks::<3>().0.iter();
            normals.map(|normal| DVec3::from(normal.map(f64::from)))
        });
        let pixels = is_away.zip(before.zip(after));
        let is_same = |(is_away, (before, after)): (bool, (DVec3, DVec3))| {
            let is_same = (self.on_normals * before).abs_diff_eq(after, 1e-3);
            assert!(is_same || !is_away, "{before} has become {after}");
            is_away
        };
        pixels.map(is_same).collect()
    }
}

/// relRMSE of direct light where triangles are cut. Blocks are at least 5 cm wide. The corners of their pieces, of 2.5 cm, are rounded to
/// 6e-8 m, which turns normals by up to 5e-6. A lobe of exponent 20 changes by twenty times that. Corners are also rounded to a part of a
/// pixel, so a pixel shows a point of its piece beside the one on its ray. Each sub-pixel bit less doubles that distance.
pub fn of_pieces() -> Nearness {
    Nearness::Within(1e-4 * f64::from(8 - sub_pixel_bits().min(8)).exp2())
}

/// relRMSE of direct light where all positions are rounded, each to 6e-8 of half the room, 1 m. Light depends on its squared path and a
/// cosine: three times that rounding over the distance to the nearest surface. 4e-6 is the error bound of the engine's direct light.
fn rounding(room: &Scene, frame: &Frame) -> f64 {
    let nearest_m = room.lights.iter().flat_map(|light| {
        let position_m = light.position_m().expect("rooms have no other lights");
        let seen = values(frame, Layer::Position).as_chunks::<3>().0.iter();
        seen.map(move |place| DVec3::from(place.map(f64::from)).distance(position_m))
    });
    // In no room is the light closer than 8 cm to a visible surface.
    4e-6 + 3.0 * 1.2e-7 / nearest_m.fold(f64::INFINITY, f64::min).max(0.05)
}

pub fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).expect("the layer is there")
}

pub fn vector(low: f64, high: f64) -> impl Strategy<Value = DVec3> {
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

/// A room of 2 m with blocks, and a camera and a light at random positions; without indirect light.
fn bare_room() -> impl Strategy<Value = Scene> {
    (
        prop::collection::vec(block(), 0..4),
        light(),
        vector(-0.9, 0.9),
        vector(-0.3, 0.3),
    )
        .prop_map(|(mut meshes, light, eye_m, look_at_m)| {
            meshes.push(cuboid("room", DVec3::splat(-1.0), DVec3::splat(2.0), GREY));
            scene_of(meshes, light, eye_m, look_at_m)
        })
}

/// Such a room with the sum of either estimator.
pub fn room() -> impl Strategy<Value = Scene> {
    let estimator = prop::sample::select(VplSum::ALL.to_vec());
    (bare_room(), estimator).prop_map(|(scene, estimator)| with_sum(&scene, estimator, 16))
}

/// Such a room with the bounce by rays.
pub fn room_by_rays() -> impl Strategy<Value = Scene> {
    bare_room().prop_map(|scene| with_rays(&scene, TARGET_ERROR))
}

/// A random rotation.
pub fn turn() -> impl Strategy<Value = DMat3> {
    let component = || -1.0..1.0;
    [component(), component(), component(), component()]
        .prop_map(DQuat::from_array)
        .prop_filter("evenly on the sphere", |q| (0.1..1.0).contains(&q.length()))
        .prop_map(|q| DMat3::from_quat(q.normalize()))
}

/// Runs a relation on random rooms or other random values. The relation returns whether there was light to compare.
pub fn on_random<S: Strategy>(rooms: S, relation: impl Fn(&mut Gpu, S::Value) -> bool) {
    let config = Config {
        cases: ROOMS,
        failure_persistence: None,
        ..Config::default()
    };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let gpu = RefCell::new(Gpu::open());
    let lit_rooms = Cell::new(0);
    runner
        .run(&rooms, |room| {
            let is_lit = relation(&mut gpu.borrow_mut(), room);
            lit_rooms.set(lit_rooms.get() + u32::from(is_lit));
            Ok(())
        })
        .expect("the relation holds in every room");
    println!("{} of {ROOMS} rooms are lit", lit_rooms.get());
    assert!(lit_rooms.get() >= LIT_ROOMS, "the rooms are dark");
}

/// The scene with each band of its lights multiplied by its own factor.
pub fn brightened(scene: &Scene, factors: Bands) -> Scene {
    let mut scene = scene.clone();
    for light in &mut scene.lights {
        *light = amplified(light, factors).into();
    }
    scene
}

/// The scene with red, green and blue of lights and materials permuted.
pub fn with_bands_swapped(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for material in &mut scene.materials {
        material.kd = swapped(material.kd);
        material.ks = swapped(material.ks);
    }
    for light in &mut scene.lights {
        light.light = light.with_emission(swapped(light.emission()));
    }
    scene
}

pub fn swapped([r, g, b]: Bands) -> Bands {
    [b, r, g]
}

/// The scene with its meshes in reverse order.
pub fn with_meshes_reversed(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.meshes.reverse();
    scene
}

/// The scene with two lights of half the power in place of one.
pub fn with_light_in_two(scene: &Scene) -> Scene {
    let mut scene = brightened(scene, [0.5; 3]);
    scene.lights.push(scene.lights[0].clone());
    scene
}

/// The scene with each triangle cut in two at the middle of its longest edge. Neighbours that share that edge are cut at the same point.
pub fn with_triangles_in_two(scene: &Scene) -> Scene {
    with_triangles_cut(scene, |mesh, [a, b, c]| {
        let length = |i: u32, j: u32| {
            let [p, q] = [i, j].map(|index| mesh.positions_m[index as usize]);
            p.distance_squared(q)
        };
        let turned = [[a, b, c], [b, c, a], [c, a, b]];
        let by_length =
            |x: &[u32; 3], y: &[u32; 3]| length(x[0], x[1]).total_cmp(&length(y[0], y[1]));
        let [a, b, c] = turned.into_iter().max_by(by_length).expect("one of three");
        let middle = push_middle(mesh, a, b);
        vec![[a, middle, c], [middle, b, c]]
    })
}

/// The scene with each triangle cut in four at the middles of its edges.
pub fn with_triangles_in_four(scene: &Scene) -> Scene {
    with_triangles_cut(scene, |mesh, [a, b, c]| {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[i, j]| push_middle(mesh, i, j));
        vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    })
}

/// Adds a vertex midway between two, the same for either order of the two.
fn push_middle(mesh: &mut Mesh, i: u32, j: u32) -> u32 {
    let [p, q] = [i.min(j), i.max(j)].map(|index| mesh.positions_m[index as usize]);
    mesh.positions_m.push(0.5 * (p + q));
    mesh.positions_m.len() as u32 - 1
}

fn with_triangles_cut(scene: &Scene, cut: impl Fn(&mut Mesh, [u32; 3]) -> Vec<[u32; 3]>) -> Scene {
    let mut scene = scene.clone();
    for mesh in &mut scene.meshes {
        let triangles = std::mem::take(&mut mesh.triangles);
        let materials = std::mem::take(&mut mesh.triangle_materials);
        for (triangle, material) in triangles.into_iter().zip(materials) {
            let pieces = cut(mesh, triangle);
            mesh.triangle_materials.extend(vec![material; pieces.len()]);
            mesh.triangles.extend(pieces);
        }
    }
    scene
}

/// The scene with every position on a grid of 2⁻²⁰ m. A position 10⁷ m away needs 44 of the 53 bits of f64, so a shift rounds nothing.
pub fn on_a_grid(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let place = |point_m: &mut DVec3| {
        let steps = f64::from(1 << 20);
        *point_m = (*point_m * steps).round() / steps;
    };
    for mesh in &mut scene.meshes {
        mesh.positions_m.iter_mut().for_each(place);
    }
    place(&mut scene.camera.position_m);
    place(&mut scene.camera.look_at_m);
    for light in &mut scene.lights {
        if let Some(position_m) = light.position_m_mut() {
            place(position_m);
        }
    }
    scene
}
