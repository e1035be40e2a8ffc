//! Metamorphic tests on random rooms: a change of the scene must have its known effect on the image, so no reference is needed. Here
//! for direct light and for both estimators as plain sums.
#![cfg(feature = "reference")]

use crate::common::gpu::Gpu;
use crate::common::rmse::relative_rmse;
use crate::relations;
use crate::relations::{
    Effect, Nearness, brightened, of_pieces, on_a_grid, on_random, room, swapped, turn, values,
};
use camlux::{
    Scene,
    glam::DVec3,
    hard_cases::scenes::{moved, turned, with_sum},
    output::Layer,
    scene::{Bands, VplSum},
};

/// The rounding of different sums.
const ROUNDING: Nearness = Nearness::Within(1e-6);

/// Asserts that a change leaves the image as it is, up to rounding.
fn assert_without_effect(change: impl Fn(&Scene) -> Scene, direct: Nearness, indirect: Nearness) {
    on_random(room(), |gpu, scene| {
        Effect::none(direct, indirect).assert(gpu, [&scene, &change(&scene)])
    });
}

/// The engine compares no light with a constant, and factors that are powers of two round nothing.
#[test]
fn four_times_the_power_is_four_times_the_image_bit_for_bit() {
    on_random(room(), |gpu, scene| {
        let brighter = brightened(&scene, [4.0; 3]);
        Effect::times(|bands| bands.map(|b| 4.0 * b), Nearness::BitForBit)
            .assert(gpu, [&scene, &brighter])
    });
}

/// This includes rsm-average, where only the light on Q falls with the square of the distance. The device computes in the same space
/// for both scenes, with powers that differ by a power of two.
#[test]
fn a_scene_of_twice_the_size_has_a_quarter_of_the_light_bit_for_bit() {
    on_random(room(), |gpu, scene| {
        let twice = moved(&scene, 2.0, DVec3::ZERO);
        Effect::times(|bands| bands.map(|b| 0.25 * b), Nearness::BitForBit)
            .assert(gpu, [&scene, &twice])
    });
}

/// Other coordinates round differently. For sums, the error is 1e-7 over the squared distance of P and Q. Few pairs are closer than a
/// tenth of the room.
#[test]
fn a_scene_of_any_size_has_its_light() {
    on_random((room(), 1e-3..1e3), |gpu, (scene, size)| {
        let other = moved(&scene, size, DVec3::ZERO);
        let other = brightened(&other, [size * size; 3]);
        Effect::none(Nearness::Rounding, Nearness::Within(1e-5)).assert(gpu, [&scene, &other])
    });
}

/// Bands share weights, and nothing is summed over them.
#[test]
fn bands_that_change_places_do_so_in_the_image_bit_for_bit() {
    on_random(room(), |gpu, scene| {
        let coloured = brightened(&scene, [1.0, 2.0, 0.5]);
        let turned = relations::with_bands_swapped(&coloured);
        Effect::times(swapped, Nearness::BitForBit).assert(gpu, [&coloured, &turned])
    });
}

/// No sum runs over meshes, and visibility does not depend on their order.
#[test]
fn the_order_of_meshes_does_not_matter() {
    let reversed = relations::with_meshes_reversed;
    assert_without_effect(reversed, Nearness::BitForBit, Nearness::BitForBit);
}

/// A light of half the power gives exactly half of every value. The sum of two halves is rounded once more, and so are sums over VPLs.
#[test]
fn two_halves_of_a_light_are_the_light() {
    assert_without_effect(relations::with_light_in_two, ROUNDING, ROUNDING);
}

/// Planes through other corners round differently. An RSM texel whose centre is on an edge may show the other surface: it is one of
/// 1536 texels.
#[test]
fn triangles_cut_in_two_look_the_same() {
    let cut = relations::with_triangles_in_two;
    assert_without_effect(cut, of_pieces(), Nearness::Within(1e-3));
}

/// As with two pieces.
#[test]
fn triangles_cut_in_four_look_the_same() {
    let cut = relations::with_triangles_in_four;
    assert_without_effect(cut, of_pieces(), Nearness::Within(1e-3));
}

/// The origin moves with the scene, in f64, and the shift rounds nothing.
#[test]
fn a_scene_moved_far_away_looks_the_same_bit_for_bit() {
    let shifts_m = [
        DVec3::new(1e5, -62_000.0, 37_000.0),
        DVec3::new(-3.7e6, 1e7, 6.2e6),
    ];
    for shift_m in shifts_m {
        on_random(room(), |gpu, scene| {
            let here = on_a_grid(&scene);
            let there = moved(&here, 1.0, shift_m);
            Effect::none(Nearness::BitForBit, Nearness::BitForBit).assert(gpu, [&here, &there])
        });
    }
}

/// The shift rounds the scene's own coordinates, by up to 1e-9 m at 10⁷ m. So a few f32 coordinates round to the other side, by 6e-8 m.
/// A texel on an edge may show the other surface.
#[test]
fn a_scene_moved_anywhere_looks_the_same() {
    on_random(
        (room(), relations::vector(-1e7, 1e7)),
        |gpu, (scene, shift_m)| {
            let there = moved(&scene, 1.0, shift_m);
            Effect::none(Nearness::Rounding, Nearness::Within(1e-3)).assert(gpu, [&scene, &there])
        },
    );
}

/// Positions round differently. The texels of an RSM follow the world's axes or the spot's frame and do not turn with the scene, so
/// sums agree only up to the effect of texels. An RSM of half the size shows that effect: its error is about twice as large, so an image
/// is about as far from the ground truth as from the coarser image. The bound is twice that, because the coarse images may err to the
/// same side. Both scenes are turned askew: in the upright room, whole rows of texels end on edges in both sizes.
#[test]
fn a_scene_turned_anyhow_looks_the_same_but_for_texels() {
    const RSM_SIZE: u32 = 64;
    // Measured up to 0.11, where a light close to a wall makes bright spots.
    const MOST_OF_TEXELS: f64 = 0.2;
    on_random(
        (room(), turn(), turn()),
        |gpu, (scene, turn, other_turn)| {
            let scene = turned(&scene, other_turn);
            let mut is_lit = true;
            for estimator in VplSum::ALL {
                let sum = |rsm_size| with_sum(&scene, estimator, rsm_size);
                let [coarse, fine] = [sum(RSM_SIZE / 2), sum(RSM_SIZE)];
                let [turned_coarse, turned_fine] =
                    [&coarse, &fine].map(|scene| turned(scene, turn));
                let of_texels = indirect_apart(gpu, [&fine, &coarse])
                    + indirect_apart(gpu, [&turned_fine, &turned_coarse]);
                is_lit &= Effect {
                    on_normals: turn,
                    ..Effect::none(
                        Nearness::Rounding,
                        Nearness::Within((1e-5 + 2.0 * of_texels).min(MOST_OF_TEXELS)),
                    )
                }
                .assert(gpu, [&fine, &turned_fine]);
            }
            is_lit
        },
    );
}

/// relRMSE between the indirect light of two scenes that show the same surfaces.
fn indirect_apart(gpu: &mut Gpu, scenes: [&Scene; 2]) -> f64 {
    let [truth, other] = scenes.map(|scene| values(&gpu.render(scene), Layer::Indirect).to_vec());
    if truth.iter().all(|value| *value == 0.0) {
        return 0.0;
    }
    let truth: Vec<Bands> = truth
        .as_chunks()
        .0
        .iter()
        .map(|pixel| pixel.map(f64::from))
        .collect();
    relative_rmse(&other, &truth)
}
