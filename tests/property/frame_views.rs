//! What a frame tells of itself: its warnings, and its preview.

use camlux::output::{Frame, Layer, LayerData, OutputFile, PngView, StopReason, write_png};

use crate::common::gather::gather;
use crate::output::{HEIGHT, WIDTH, frame, set};

#[test]
fn a_frame_warns_of_what_it_does_not_show() {
    let mut frame = frame();
    assert_eq!(frame.warnings(), Vec::<String>::new());
    let black = vec![0.0; (3 * WIDTH * HEIGHT) as usize];
    set(&mut frame, Layer::Indirect, black.clone());
    let says = |frame: &Frame, part: &str| {
        let warnings = frame.warnings();
        assert!(
            warnings.len() == 1 && warnings[0].contains(part),
            "{warnings:?}"
        );
    };
    says(&frame, "no indirect light reaches what is in view");
    says(&frame, "the lights shine at no surface");
    frame.stats.vpl_count = 9;
    says(&frame, "it faces away from all 9 VPLs");
    frame.stats.ray_count = 700;
    says(&frame, "700 rays from it found no lit surface");
    set(&mut frame, Layer::Radiance, black);
    says(&frame, "the image is black: it is in shadow");
    frame.stats.vpl_count = 0;
    says(&frame, "the image is black: the lights shine at no surface");
    let light = &mut frame.description.lights[0];
    *light = light.with_emission([0.0; 3]);
    says(&frame, "the image is black: every light emits 0");
    for (layer, data) in &mut frame.layers {
        if *layer == Layer::InstanceId {
            *data = LayerData::Id(vec![0; (WIDTH * HEIGHT) as usize]);
        }
    }
    says(&frame, "nothing is in view");
}

#[test]
fn a_target_that_was_not_met_is_said_with_its_reason() {
    let mut frame = frame();
    let indirect = gather!(0.02, max_ms = Some(250.0), max_rays = Some(5_000_000_000));
    frame.description.indirect = Some(indirect);
    let rays = frame.stats.ray_count;
    let mut says = |stop, error| {
        frame.stats.stop = stop;
        frame.stats.estimated_error = error;
        frame.stats.estimated_error_upper = error.map(|error| 2.0 * error);
        frame.warnings()
    };
    assert_eq!(says(None, None), Vec::<String>::new());
    let met = says(Some(StopReason::TargetMet), Some(0.01));
    assert_eq!(met, Vec::<String>::new());
    let spent = format!(
        "the budget (max_ms = 250, max_rays = 5000000000) was spent on {rays} rays before the target error was met: requested 2.00 %, "
    );
    assert_eq!(
        says(Some(StopReason::BudgetSpent), Some(0.031)),
        [format!(
            "{spent}estimated 3.10 %, below 6.20 % with 95 % confidence; give more, or raise target_error"
        )]
    );
    assert_eq!(
        says(Some(StopReason::BudgetSpent), None),
        [format!(
            "{spent}not estimated; give more, or raise target_error"
        )]
    );
    let missed = says(Some(StopReason::SamplesExhausted), Some(0.031));
    assert_eq!(missed.len(), 1);
    assert!(
        missed[0].starts_with("the target error was missed"),
        "{missed:?}"
    );
    assert!(missed[0].contains("set a larger rsm_size"), "{missed:?}");
}

#[test]
fn preview_shows_the_panels_in_one_exposure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut frame = frame();
    let values = (WIDTH * HEIGHT * 3) as usize;
    set(&mut frame, Layer::Direct, vec![1.5; values]);
    set(&mut frame, Layer::Indirect, vec![0.5; values]);
    let mut radiance = vec![2.0; values];
    // One burnt-out pixel of 35 must not darken the others: it is above the 99th percentile.
    radiance[0] = 1e9;
    // NaN becomes black and does not crash.
    radiance[3] = f32::NAN;
    radiance[4] = 0.0;
    radiance[5] = 0.0;
    set(&mut frame, Layer::Radiance, radiance);
    let mut emission = vec![0.0; values];
    // A surface that emits must not, either.
    emission[0] = 1e9;
    set(&mut frame, Layer::Emission, emission);

    let view = PngView::for_frame(&frame);
    let preview = write_png(OutputFile::create(&path).unwrap(), &frame, view).unwrap();
    assert_eq!(preview.white_radiance, 2.0);
    let image = image::open(&path).unwrap().to_rgb8();
    assert_eq!(image.dimensions(), (3 * WIDTH, HEIGHT));
    let at = |panel: u32, x: u32| image.get_pixel(panel * WIDTH + x, 0).0;
    // sRGB of 0.75 is 0.8808, of 0.25 it is 0.5371 (IEC 61966-2-1); times 255, rounded.
    assert_eq!(at(0, 2), [225; 3]);
    assert_eq!(at(1, 2), [137; 3]);
    assert_eq!(at(2, 2), [255; 3]);
    assert_eq!(at(2, 0)[0], 255);
    assert_eq!(at(2, 1), [0; 3]);
}

#[test]
fn preview_of_direct_light_is_one_panel_and_black_stays_black() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut frame = frame();
    frame.layers.retain(|(layer, _)| *layer != Layer::Indirect);
    set(
        &mut frame,
        Layer::Radiance,
        vec![0.0; (WIDTH * HEIGHT * 3) as usize],
    );
    let view = PngView::for_frame(&frame);
    assert_eq!(view, PngView::Radiance);
    write_png(OutputFile::create(&path).unwrap(), &frame, view).unwrap();
    let image = image::open(&path).unwrap().to_rgb8();
    assert_eq!(image.dimensions(), (WIDTH, HEIGHT));
    assert!(image.into_raw().iter().all(|&byte| byte == 0));
}
