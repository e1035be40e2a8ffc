//! What must happen to the image when the scene is changed in a way whose effect is known, on random rooms: no truth is needed for
//! that. Here of direct light and of both estimators as plain sums.
#![cfg(feature = "reference")]

use crate::common::gpu::Gpu;
use crate::common::rmse::relative_rmse;
use crate::relations;
use crate::relations::{
    Effect, Nearness, brightened, of_pieces, on_a_grid, on_random, room, swapped, turn, values,
};
use camlux::{
    Scene,
    doctor::scenes::{moved, turned, with_sum},
    glam::DVec3,
    output::Layer,
    scene::{Bands, VplSum},
};

/// The rounding of other sums.
const ROUNDING: Nearness = Nearness::Within(1e-6);

/// A change that leaves the image as it is, but for rounding.
fn assert_without_effect(change: impl Fn(&Scene) -> Scene, direct: Nearness, indirect: Nearness) {
    on_random(room(), |gpu, scene| {
        Effect::none(direct, indirect).assert(gpu, [&scene, &change(&scene)])
    });
}

/// Nothing is compared with a constant of the dimension of light, and powers of two round nothing.
#[test]
fn four_times_the_power_is_four_times_the_image_bit_for_bit() {
    on_random(room(), |gpu, scene| {
        let brighter = brightened(&scene, [4.0; 3]);
        Effect::times(|bands| bands.map(|b| 4.0 * b), Nearness::BitForBit)
            .assert(gpu, [&scene, &brighter])
    });
}

/// So has rsm-average, whose light on Q alone falls with the square. The device computes in the same space for both scenes, and the
/// powers in it are apart by a power of two.
#[test]
fn a_scene_of_twice_the_size_has_a_quarter_of_the_light_bit_for_bit() {
    on_random(room(), |gpu, scene| {
        let twice = moved(&scene, 2.0, DVec3::ZERO);
        Effect::times(|bands| bands.map(|b| 0.25 * b), Nearness::BitForBit)
            .assert(gpu, [&scene, &twice])
    });
}

/// Other coordinates are rounded otherwise. Of sums this is 1e-7 over the distance of P and Q, squared, which is less than a tenth of
/// the room for few of the pairs only.
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

/// No sum is over meshes; what is seen does not depend on which comes first.
#[test]
fn the_order_of_meshes_does_not_matter() {
    let reversed = relations::with_meshes_reversed;
    assert_without_effect(reversed, Nearness::BitForBit, Nearness::BitForBit);
}

/// A half is the exact half of everything, bit for bit, but the sum of two halves is rounded once more, and so are sums of VPLs.
#[test]
fn two_halves_of_a_light_are_the_light() {
    assert_without_effect(relations::with_light_in_two, ROUNDING, ROUNDING);
}

/// Planes through other corners are rounded otherwise, as above. A texel of the RSM whose centre lies on an edge shows either of two
/// surfaces, too: it is one of 1536.
#[test]
fn triangles_cut_in_two_look_the_same() {
    let cut = relations::with_triangles_in_two;
    assert_without_effect(cut, of_pieces(), Nearness::Within(1e-3));
}

/// As in two.
#[test]
fn triangles_cut_in_four_look_the_same() {
    let cut = relations::with_triangles_in_four;
    assert_without_effect(cut, of_pieces(), Nearness::Within(1e-3));
}

/// The origin moves with the scene, in f64, and nothing is rounded on the way there.
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

/// Where the shift rounds the scene's own coordinates, by up to 1e-9 m 10⁷ m away, a few of those in f32 are rounded to the other
/// side: to 6e-8 m, as above. A texel on an edge may show the other surface.
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

/// Places are rounded otherwise, as above. The texels of an RSM, though, lie along the world's axes or those of the spot's frame, and
/// do not turn with the scene: sums remain as far as texels do not matter. How far they do is seen from half as many along an edge, whose
/// error is about twice as large: either image is as far from the truth as from the one of fewer texels. Twice that, for both of the
/// latter may be off to one side. Two turns that are both askew are compared, for in the upright room whole rows of texels end on
/// edges, in both sizes alike.
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
