//! Properties of a reference that hold for any scene.

use crate::common::rooms;
use std::ops::ControlFlow;

use crate::common::gpu::demo_scene;
use crate::common::reference_frame::add_rounds;
use camlux::{
    Error, Scene,
    output::{ExrOptions, Frame, Layer, OutputFile, write_exr},
    reference::{Goal, Reference},
    scene::{Light, Shadow},
};
use glam::DVec3;

fn sampled(scene: &Scene, rounds: u32) -> Frame {
    let mut reference = Reference::new(scene, 64).expect("the scene is valid");
    add_rounds(&mut reference, rounds);
    reference.frame()
}

fn values(frame: &Frame, layer: Layer) -> Vec<f64> {
    let values = frame.values(layer).expect("it is there").iter();
    values.map(|&value| value.into()).collect()
}

/// Number of values that differ by more than this share of the mean.
#[track_caller]
fn count_different(a: &[f64], b: &[f64], share: f64) -> usize {
    let mean = a.iter().sum::<f64>() / a.len() as f64;
    assert!(mean > 0.0, "a black image proves nothing");
    assert_eq!(a.len(), b.len());
    let agree = |(a, b): (&f64, &f64)| (a - b).abs() <= share * mean;
    a.len() - a.iter().zip(b).filter(|pair| agree(*pair)).count()
}

#[test]
fn one_and_two_threads_give_the_same_image() {
    let scene = demo_scene("glossy", [24, 24]);
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        pool.install(|| sampled(&scene, 3)).layers
    };
    assert!(with_threads(1) == with_threads(2));
}

/// Scenes of 1 mm and 10 km trace the same rays, because no length is built in. 1e-3 and 1e4 are not powers of two, so all
/// values round differently. A ray that meets an edge may fall on its other side.
#[test]
fn scale_does_not_matter() {
    for name in ["cornell", "glossy"] {
        let scene = demo_scene(name, [32, 32]);
        let at_scale = |scale: f64| {
            let mut scaled = rooms::moved(&scene, scale, DVec3::ZERO);
            for light in &mut scaled.lights {
                light.light =
                    light.with_emission(light.emission().map(|power| power * scale * scale));
            }
            let frame = sampled(&scaled, 2);
            (
                values(&frame, Layer::Direct),
                values(&frame, Layer::Indirect),
            )
        };
        let (direct, indirect) = at_scale(1.0);
        for scale in [1e-3, 1e4] {
            let (scaled_direct, scaled_indirect) = at_scale(scale);
            let different = [
                count_different(&direct, &scaled_direct, 1e-6),
                count_different(&indirect, &scaled_indirect, 1e-6),
            ];
            println!(
                "{name} times {scale:e}: {different:?} of {} values differ",
                direct.len()
            );
            // Pixels and samples on the edge between two triangles.
            assert!(different[0] <= 24 && different[1] <= 40, "{name} {scale:e}");
        }
    }
}

/// f64 keeps 1e-9 m at 10⁷ m; the scene's size is 2 m.
#[test]
fn far_from_the_origin() {
    let scene = demo_scene("cornell", [32, 32]);
    let here = sampled(&scene, 2);
    let far = sampled(&rooms::moved(&scene, 1.0, DVec3::new(1e7, -1e7, 1e7)), 2);
    for layer in [Layer::Direct, Layer::Indirect] {
        let different = count_different(&values(&here, layer), &values(&far, layer), 1e-6);
        println!("{layer:?}: {different} values differ");
        // Pixels and samples on an edge, within 1e-9 m.
        assert!(different <= 40, "{layer:?}: {different}");
    }
}

#[test]
fn going_on_is_never_having_stopped() {
    let scene = demo_scene("cornell", [16, 16]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("truth.exr");
    let mut first = Reference::new(&scene, 64).expect("the scene is valid");
    add_rounds(&mut first, 3);
    let file = OutputFile::create(&path).expect("the folder is writable");
    write_exr(file, &first.frame(), &ExrOptions::default()).expect("it is written");

    let mut second = Reference::resume(&scene, &path).expect("it is of this scene");
    assert_eq!(second.samples_per_pixel(), 192);
    add_rounds(&mut second, 2);
    assert_eq!(second.samples_per_pixel(), 320);
    let (resumed, whole) = (second.frame(), sampled(&scene, 5));
    for layer in [Layer::Indirect, Layer::StandardError] {
        // The file stores f32.
        let different = count_different(&values(&resumed, layer), &values(&whole, layer), 5e-6);
        assert_eq!(different, 0, "{layer:?}");
    }
    assert_eq!(resumed.ids(Layer::Edge), whole.ids(Layer::Edge));

    // Another resolution makes another scene.
    let mut other = scene.clone();
    other.camera.resolution_px = [8, 8];
    let refused = Reference::resume(&other, &path).expect_err("it is another image");
    assert!(refused.to_string().contains("another scene"), "{refused}");
    // The engine's settings for shadows and indirect light, and the sensor, do not.
    let mut same = scene.clone();
    same.direct.shadow = Some(Shadow::Rays);
    same.indirect = None;
    same.sensor = None;
    Reference::resume(&same, &path).expect("the same light");
}

#[test]
fn cancelling_keeps_whole_rounds() {
    let scene = demo_scene("cornell", [16, 16]);
    let mut reference = Reference::new(&scene, 64).expect("the scene is valid");
    add_rounds(&mut reference, 2);
    let before = reference.frame();
    let cancelled = reference.add_round(&mut |_| ControlFlow::Break(()));
    assert!(matches!(cancelled, Err(Error::Cancelled)));
    assert!(reference.frame().layers == before.layers);
}

#[test]
fn goals_are_met() {
    let scene = demo_scene("cornell", [24, 24]);
    let reach = |goal: Goal| {
        let started = Reference::start(&scene, goal, &mut |_| ControlFlow::Continue(()));
        let mut reference = started.expect("the scene is valid");
        assert_eq!(reference.rounds(), 0);
        while !reference.meets(goal) {
            add_rounds(&mut reference, 1);
        }
        reference
    };
    let by_count = reach(Goal::SamplesPerPixel(1000));
    assert!((1000..1128).contains(&by_count.samples_per_pixel()));
    let by_error = reach(Goal::StandardError(0.05));
    let error = by_error
        .relative_standard_error()
        .expect("there are rounds");
    assert!(error <= 0.05, "{error}");
    assert!(by_error.rounds() >= 8);
}

/// One round gives no standard error, but can be resumed.
#[test]
fn a_single_round_has_no_standard_error() {
    let scene = demo_scene("cornell", [16, 16]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("truth.exr");
    let frame = sampled(&scene, 1);
    assert!(frame.values(Layer::StandardError).is_none());
    let file = OutputFile::create(&path).expect("the folder is writable");
    write_exr(file, &frame, &ExrOptions::default()).expect("it is written");
    let mut resumed = Reference::resume(&scene, &path).expect("it is of this scene");
    assert_eq!(resumed.relative_standard_error(), None);
    add_rounds(&mut resumed, 2);
    let (resumed, whole) = (resumed.frame(), sampled(&scene, 3));
    for layer in [Layer::Indirect, Layer::StandardError] {
        let different = count_different(&values(&resumed, layer), &values(&whole, layer), 5e-6);
        assert_eq!(different, 0, "{layer:?}");
    }
}

/// Without a bounce there is nothing to sample, so the goal is met.
#[test]
fn convex_bodies_get_no_bounce() {
    let floor = rooms::floor(1.0);
    let light = Light::point(DVec3::Y, [1.0; 3]);
    let scene = rooms::scene_of(vec![floor], light, DVec3::new(0.0, 1.0, 2.0), DVec3::ZERO);
    let mut reference = Reference::new(&scene, 16).expect("the scene is valid");
    add_rounds(&mut reference, 8);
    assert!(reference.meets(Goal::StandardError(0.01)));
    let indirect = values(&reference.frame(), Layer::Indirect);
    assert!(indirect.iter().all(|&value| value == 0.0));
}
