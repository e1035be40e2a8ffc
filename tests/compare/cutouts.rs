//! Cut-outs, against the same surfaces as triangles and against the reference, which reads alpha textures with its own code.

use crate::common::gpu::{Gpu, demo_scene, distort, plain_sum, radial};
use crate::common::reference_frame::{error_off_edges, reference_frame, values};
use crate::common::rmse::relative_rmse_where;
use crate::common::rooms::{quad, scene_of};
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{Encoding, IndirectLight, Light, Shadow, Texels, Texture, TextureLookup, Wrap},
};
use glam::DVec3;

fn alpha(width: u32, values: &[u8]) -> Texture {
    Texture {
        name: "alpha".into(),
        size_px: [width, values.len() as u32 / width],
        texels: Texels::U8(values.iter().map(|&v| [v; 3]).collect(), Encoding::Linear),
    }
}

/// A card between a light, a floor and a wall. Its alpha texture keeps the half with u < 1/2; without one, the card is only that half.
fn card_over_floor(has_alpha: bool) -> Scene {
    let mut scene = card_of_width(if has_alpha { 1.0 } else { 0.5 });
    if has_alpha {
        // Bilinear between texels: it is 1/2 where u is 0 or 1/2.
        scene.textures = vec![alpha(4, &[255, 255, 0, 0]).into()];
        scene.materials[1].alpha_texture = Some(0.into());
    }
    scene
}

/// The same card, with u up to its width.
fn card_of_width(width: f64) -> Scene {
    let floor = quad(
        "floor",
        DVec3::new(-1.0, 0.0, 1.0),
        2.0 * DVec3::X,
        -2.0 * DVec3::Z,
        0,
    );
    let mut card = quad(
        "card",
        DVec3::new(-0.46, 0.4, 0.37),
        width * DVec3::new(1.0, 0.13, 0.0),
        DVec3::new(0.05, 0.21, -0.7),
        1,
    );
    card.texcoords = vec![[0.0, 0.0], [width, 0.0], [width, 1.0], [0.0, 1.0]];
    let wall = quad(
        "wall",
        DVec3::new(-1.0, 0.0, -1.0),
        2.0 * DVec3::X,
        2.0 * DVec3::Y,
        2,
    );
    let light = Light::point(DVec3::new(0.11, 1.5, -0.13), [10.0; 3]);
    let camera_m = DVec3::new(0.3, 1.1, 1.4);
    scene_of(vec![floor, card, wall], light, camera_m, DVec3::Y * 0.2)
}

/// Seen by the rasteriser or by rays, with direct light and an RSM. A pixel or texel on the card's rim may be on either side.
#[test]
fn a_card_with_half_of_it_cut_out_is_half_a_card() {
    let mut gpu = Gpu::open();
    for has_lens in [false, true] {
        let [cut, small] = [true, false].map(|has_alpha| {
            let mut scene = card_over_floor(has_alpha);
            scene.indirect = Some(IndirectLight::final_gather(0.03));
            let mut scene = plain_sum(scene, 64);
            scene.direct.shadow = Some(Shadow::Rays);
            if has_lens {
                distort(&mut scene, radial(-0.05, 0.01));
            }
            scene
        });
        let whole = {
            let mut scene = cut.clone();
            scene.materials[1].alpha_texture = None;
            gpu.render(&scene)
        };
        let [cut, small] = [cut, small].map(|scene| gpu.render_by_each_tracer(&scene));
        for (cut, small) in cut.iter().zip(&small) {
            let ids = [cut, small].map(|frame| frame.ids(Layer::InstanceId).expect("it is there"));
            let differing = ids[0].iter().zip(ids[1]).filter(|(a, b)| a != b).count();
            assert!(differing < 4, "{differing} pixels show another mesh");
            for (layer, bound) in [
                (Layer::Position, 1e-6),
                (Layer::Direct, 1e-6),
                (Layer::Indirect, 1e-6),
            ] {
                let [found, due] = [cut, small].map(|frame| values(frame, layer));
                let count = found.chunks(3).zip(due.chunks(3));
                let is_off = |(a, b): &(&[f32], &[f32])| {
                    a.iter()
                        .zip(*b)
                        .any(|(a, b)| (a - b).abs() > 1e-4 * b.abs().max(0.01))
                };
                let off = count.filter(is_off).count();
                let is_fine =
                    |pixel: usize| !is_off(&(&found[3 * pixel..][..3], &due[3 * pixel..][..3]));
                let error = relative_rmse_where(found, due, is_fine);
                println!("lens {has_lens}, {layer:?}: {error:.1e}, {off} pixels apart");
                assert!(error < bound && off < 4, "{layer:?}: {error}, {off}");
                let error = relative_rmse_where(values(&whole, layer), due, |_| true);
                assert!(
                    error > 0.05,
                    "the other half of the card is missed: {error}"
                );
            }
        }
    }
}

/// Alpha falls from 1 to 0 between the centres of two texels, u = 3/8 and 5/8. The cutoff says where between them the card ends.
#[test]
fn the_cutoff_says_where_a_card_ends() {
    let mut gpu = Gpu::open();
    for (cutoff, width) in [(0.1, 0.6), (0.5, 0.5), (0.9, 0.4), (0.0, 1.0)] {
        let mut cut = card_of_width(1.0);
        cut.textures = vec![alpha(4, &[255, 255, 0, 0]).into()];
        cut.materials[1].alpha_texture = Some(TextureLookup {
            wrap: [Wrap::Clamp; 2],
            ..0.into()
        });
        cut.materials[1].alpha_cutoff = cutoff;
        let mut small = card_of_width(width);
        for scene in [&mut cut, &mut small] {
            scene.direct.shadow = Some(Shadow::Rays);
        }
        let due = reference_frame(&small, 1, 0);
        let check = |what: &str, frame: &Frame| {
            let ids = [frame, &due].map(|frame| frame.ids(Layer::InstanceId).expect("it is there"));
            assert!(ids[1].contains(&2), "the card is seen");
            let others = ids[0].iter().zip(ids[1]).filter(|(a, b)| a != b).count();
            let direct = [frame, &due].map(|frame| values(frame, Layer::Direct));
            let most = direct[1].iter().copied().fold(0.0, f32::max);
            let pixels = direct[0].chunks(3).zip(direct[1].chunks(3));
            let unlike = pixels.filter(|(a, b)| (a[0] - b[0]).abs() > 1e-3 * most);
            // A pixel on the rim of the card or of its shadow may be on either side.
            let unlike = unlike.count();
            println!("cutoff {cutoff}, {what}: {others} of another mesh, {unlike} of other light");
            assert!(others < 4 && unlike < 6, "{what}: {others}, {unlike}");
        };
        check("reference", &reference_frame(&cut, 1, 0));
        for frame in gpu.render_by_each_tracer(&cut) {
            check("frame", &frame);
        }
    }
}

/// The textured room with holes of all sizes in its surfaces.
fn room_with_holes() -> Scene {
    let mut scene = demo_scene("textured", [40, 40]);
    let index = scene.textures.len();
    let random = &mut fastrand::Rng::with_seed(5);
    let texels: Vec<u8> = (0..16 * 16).map(|_| random.u8(40..)).collect();
    scene.textures.push(alpha(16, &texels).into());
    for material in &mut scene.materials {
        material.alpha_texture = Some(index.into());
    }
    scene
}

#[test]
fn the_reference_has_the_same_holes_and_light() {
    let mut gpu = Gpu::open();
    let mut scene = room_with_holes();
    scene.indirect = Some(IndirectLight::final_gather(0.03));
    let whole = {
        let mut scene = scene.clone();
        for material in &mut scene.materials {
            material.alpha_texture = None;
        }
        gpu.render(&scene)
    };
    let truth = reference_frame(&scene, 512, 8);
    let error = |frame: &Frame, layer| error_off_edges(frame, &truth, layer);
    for frame in gpu.render_by_each_tracer(&scene) {
        let [position, direct, indirect] =
            [Layer::Position, Layer::Direct, Layer::Indirect].map(|layer| error(&frame, layer));
        println!("P {position:.1e}, direct {direct:.1e}, indirect {indirect:.1e}");
        assert!(position < 1e-6 && direct < 2e-5, "{position} {direct}");
        assert!(indirect < 0.04, "{indirect}");
    }
    // The holes matter.
    assert!(error(&whole, Layer::Direct) > 0.1 && error(&whole, Layer::Indirect) > 0.1);
}
