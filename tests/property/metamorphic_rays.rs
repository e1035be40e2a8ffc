//! Metamorphic tests on random rooms: a change of the scene must have its known effect on the image, so no reference is needed. Here
//! for the bounce by rays, which is random but repeats in every run. Where a change leaves draws and decisions alone, the effect is
//! exact bit for bit. Elsewhere it holds within the images' estimated errors.
#![cfg(feature = "reference")]

use crate::relations::{
    Effect,
    Nearness::{BitForBit, Noise, Rounding, Within},
    brightened, of_pieces, on_a_grid, on_random, room_by_rays, swapped, turn, with_bands_swapped,
    with_light_in_two, with_meshes_reversed, with_triangles_in_four, with_triangles_in_two,
};
use camlux::{
    glam::DVec3,
    hard_cases::scenes::{moved, turned},
};

/// Every decision uses a share of the image's light, and powers of two round nothing.
#[test]
fn four_times_the_power_is_four_times_the_image_bit_for_bit() {
    on_random(room_by_rays(), |gpu, scene| {
        let brighter = brightened(&scene, [4.0; 3]);
        Effect::times(|bands| bands.map(|b| 4.0 * b), BitForBit).assert(gpu, [&scene, &brighter])
    });
}

/// The device computes in the same space for both scenes, and offsets the starts of rays by a share of it.
#[test]
fn a_scene_of_twice_the_size_has_a_quarter_of_the_light_bit_for_bit() {
    on_random(room_by_rays(), |gpu, scene| {
        let twice = moved(&scene, 2.0, DVec3::ZERO);
        Effect::times(|bands| bands.map(|b| 0.25 * b), BitForBit).assert(gpu, [&scene, &twice])
    });
}

/// The draws are the same, but rounding changes a few decisions.
#[test]
fn a_scene_of_any_size_has_its_light() {
    on_random((room_by_rays(), 1e-3..1e3), |gpu, (scene, size)| {
        let other = moved(&scene, size, DVec3::ZERO);
        let other = brightened(&other, [size * size; 3]);
        Effect::none(Rounding, Noise).assert(gpu, [&scene, &other])
    });
}

/// Decisions use the sum of all bands, which rounds differently in another order. So do the VPLs' shares of the draws: now and then a
/// draw falls to the neighbouring tile. That is one of more than a hundred draws, in one of 576 pixels.
#[test]
fn bands_that_change_places_do_so_in_the_image() {
    on_random(room_by_rays(), |gpu, scene| {
        let coloured = brightened(&scene, [1.0, 2.0, 0.5]);
        let other = with_bands_swapped(&coloured);
        Effect {
            direct: BitForBit,
            ..Effect::times(swapped, Within(1e-3))
        }
        .assert(gpu, [&coloured, &other])
    });
}

#[test]
fn the_order_of_meshes_does_not_matter() {
    on_random(room_by_rays(), |gpu, scene| {
        let reversed = with_meshes_reversed(&scene);
        Effect::none(BitForBit, BitForBit).assert(gpu, [&scene, &reversed])
    });
}

/// Each half light has its own VPLs, and so other draws.
#[test]
fn two_halves_of_a_light_are_the_light() {
    on_random(room_by_rays(), |gpu, scene| {
        let halves = with_light_in_two(&scene);
        Effect::none(Within(1e-6), Noise).assert(gpu, [&scene, &halves])
    });
}

/// Rays meet other triangles, whose planes round differently.
#[test]
fn triangles_cut_in_two_look_the_same() {
    on_random(room_by_rays(), |gpu, scene| {
        let finer = with_triangles_in_two(&scene);
        Effect::none(of_pieces(), Noise).assert(gpu, [&scene, &finer])
    });
}

/// As with two pieces.
#[test]
fn triangles_cut_in_four_look_the_same() {
    on_random(room_by_rays(), |gpu, scene| {
        let finer = with_triangles_in_four(&scene);
        Effect::none(of_pieces(), Noise).assert(gpu, [&scene, &finer])
    });
}

/// The axes for sampling directions around normals do not turn with the scene, and the VPLs are elsewhere, so all draws differ.
#[test]
fn a_scene_turned_anyhow_has_its_light() {
    on_random((room_by_rays(), turn()), |gpu, (scene, turn)| {
        let other = turned(&scene, turn);
        Effect {
            on_normals: turn,
            ..Effect::none(Rounding, Noise)
        }
        .assert(gpu, [&scene, &other])
    });
}

/// The origin moves with the scene, in f64, and the shift rounds nothing.
#[test]
fn a_scene_moved_far_away_looks_the_same_bit_for_bit() {
    let shifts_m = [
        DVec3::new(1e5, -62_000.0, 37_000.0),
        DVec3::new(-3.7e6, 1e7, 6.2e6),
    ];
    for shift_m in shifts_m {
        on_random(room_by_rays(), |gpu, scene| {
            let here = on_a_grid(&scene);
            let there = moved(&here, 1.0, shift_m);
            Effect::none(BitForBit, BitForBit).assert(gpu, [&here, &there])
        });
    }
}
