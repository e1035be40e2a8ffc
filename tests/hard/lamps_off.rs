//! Scenes without light: all lamps are off, or there is none.

use crate::common::gpu::{Gpu, demo_scene};
use camlux::{
    Plan, Scene,
    output::{Frame, Layer, LayerData, TofQuantity},
    scene::{IndirectLight, PixelFilter, PixelSampling, VplSum},
};

/// With all lamps off, no pass looks for light, and what does not depend on light is as before.
#[test]
fn lamps_that_are_off_cost_no_pass() {
    let mut gpu = Gpu::open();
    let off = |scene: &mut Scene| {
        for light in &mut scene.lights {
            *light = light.with_emission([0.0; 3]).into();
        }
    };
    let estimators = [
        None,
        Some(IndirectLight::final_gather(0.05)),
        Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8)),
        Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 8)),
    ];
    for name in ["tof_corner", "area"] {
        for (indirect, samples) in estimators
            .into_iter()
            .flat_map(|i| [(i, None), (i, Some(4))])
        {
            let mut scene = demo_scene(name, [16, 12]);
            scene.indirect = indirect;
            scene.camera.pixel_sampling = samples.map(|samples| PixelSampling {
                samples,
                filter: PixelFilter::default(),
            });
            if name == "area" && indirect.is_some_and(|indirect| indirect.sum().is_some()) {
                // Sums do not support area lights.
                continue;
            }
            let lit = gpu.render(&scene);
            let without: &dyn Fn(&mut Scene) = &|scene| scene.lights.clear();
            for (what, change) in [("off", &off as &dyn Fn(&mut Scene)), ("none", without)] {
                let mut scene = scene.clone();
                change(&mut scene);
                if let Some(tof) = &mut scene.tof {
                    tof.ambient_lights.clear();
                }
                let frame = gpu.render(&scene);
                let what = format!("{name}, {what}, {indirect:?}, {samples:?}");
                let names =
                    |frame: &Frame| frame.layers.iter().map(|(l, _)| *l).collect::<Vec<_>>();
                assert_eq!(names(&frame), names(&lit), "{what}");
                for ((layer, data), (_, before)) in frame.layers.iter().zip(&lit.layers) {
                    let is_of_light = matches!(
                        layer,
                        Layer::Radiance
                            | Layer::Direct
                            | Layer::Indirect
                            | Layer::Energy
                            | Layer::HalfPath
                            | Layer::Tof(..)
                    );
                    match (layer, data) {
                        (Layer::HalfPath, _) => {}
                        (Layer::Tof(_, TofQuantity::Wraps), _) => {}
                        (
                            Layer::Tof(_, TofQuantity::Range | TofQuantity::MultipathError),
                            LayerData::Float(values),
                        ) => assert!(values.iter().all(|v| v.is_nan()), "{what}: {layer:?}"),
                        (_, LayerData::Float(values)) if is_of_light => {
                            assert!(values.iter().all(|&v| v == 0.0), "{what}: {layer:?}");
                        }
                        _ => assert!(data == before, "{what}: {layer:?}"),
                    }
                }
                let of_light = [
                    "rsm",
                    "shadow",
                    "direct",
                    "vpl",
                    "light_rays",
                    "gather",
                    "trace",
                    "final_gather_emit",
                    "predict",
                ];
                let spent = frame
                    .stats
                    .passes
                    .iter()
                    .find(|pass| of_light.contains(&pass.name));
                assert_eq!(spent, None, "{what}");
                let stats = &frame.stats;
                assert_eq!((stats.vpl_count, stats.ray_count), (0, 0));
                let errors = [
                    stats.estimated_error,
                    stats.estimated_error_upper,
                    stats.estimated_interpolation_error,
                    stats.estimated_area_light_error,
                ];
                assert_eq!((errors, stats.stop), ([None; 4], None), "{what}");
                let plan = Plan::new(&scene, gpu.device.info())
                    .expect("a valid scene")
                    .to_string();
                assert!(plan.contains("lights: none emits anything"), "{plan}");
                assert!(
                    !plan.contains("  direct  ") && !plan.contains("gather  "),
                    "{plan}"
                );
            }
        }
    }
}
