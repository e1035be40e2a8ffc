//! The kernels of final gathering, listed before they run, so that they can be made while the scene is copied to the device.

use super::{
    error_estimate, light_paths, light_rays, predict, resolve, sample_counts, scatter, smooth,
    smooth_residuals,
};
use crate::{
    Tracer,
    plan::Plan,
    vulkan::shaders::{Hit, Key, Receiver, Search, Traced},
};

/// The kernels that any frame of final gathering runs after its direct light. Those that only some frames need are made when they run.
pub(crate) fn of_final_gather(plan: &Plan) -> Vec<Key> {
    if !plan.has_final_gather() {
        return Vec::new();
    }
    let (brdf, phasors) = (plan.brdf(), plan.has_phasors());
    let (noisy, range) = (true, plan.target_range_error_m().is_some());
    let are_glossy: &[bool] = match plan.is_specular {
        true => &[false, true],
        false => &[false],
    };
    let gathers = are_glossy.iter().flat_map(|&is_glossy| {
        let receiver = plan.receiver(is_glossy);
        let of_one_bounce = [
            Key::FinalGatherEmit { receiver },
            Key::FinalGatherDraw { phasors, receiver },
            Key::FinalGatherSum {
                phasors,
                receiver,
                deep: false,
            },
        ];
        let of_more = keys_of_longer_paths(plan, receiver);
        let shade = shade_key(plan, receiver, false, false);
        let shade = (!plan.gathers_last_bounce_alone()).then_some(shade);
        of_one_bounce.into_iter().chain(shade).chain(of_more)
    });
    let first = [
        Key::ReceiversCount { brdf },
        Key::CompactScan {},
        Key::ReceiversWrite { brdf },
        Key::LightRaysEmit {},
        light_rays::shade_key(plan),
    ];
    let then = [
        error_estimate::key(plan, noisy, range),
        sample_counts::key(plan),
        scatter::key(plan, noisy, range),
        predict::key(plan, noisy, range),
        smooth::key(plan),
        smooth_residuals::key(plan),
        resolve::key(plan, noisy),
    ];
    let first = trace(plan).into_iter().chain(first);
    let first = first.chain(light_paths::keys(plan));
    first.chain(gathers).chain(then).collect()
}

/// The kernels that take the bounces after the first.
fn keys_of_longer_paths(plan: &Plan, receiver: Receiver) -> Vec<Key> {
    let extend = |bounce| extend_key(plan, receiver, bounce);
    match plan.bounces() {
        1 => Vec::new(),
        bounces => {
            let (phasors, deep) = (plan.has_phasors(), true);
            let shade = shade_key(plan, receiver, false, deep);
            let sum = Key::FinalGatherSum {
                phasors,
                receiver,
                deep,
            };
            let extends = (2..=bounces.min(3)).map(extend);
            extends.chain([shade, sum]).collect()
        }
    }
}

/// The kernel that makes paths of so many bounces.
pub(super) fn extend_key(plan: &Plan, receiver: Receiver, bounces: u32) -> Key {
    Key::FinalGatherExtend {
        phasors: plan.has_phasors(),
        receiver,
        surface: plan.surface(),
        instanced: plan.has_shared_meshes,
        deep: bounces > 2,
    }
}

pub(super) fn shade_key(plan: &Plan, receiver: Receiver, emissive: bool, deep: bool) -> Key {
    Key::FinalGatherShade {
        phasors: plan.has_phasors(),
        receiver,
        surface: plan.surface(),
        instanced: plan.has_shared_meshes,
        emissive,
        deep,
    }
}

/// Both kernels that trace rays, unless the host does.
fn trace(plan: &Plan) -> Vec<Key> {
    let search = match plan.tracer {
        Some(Tracer::Query) => Search::Query,
        Some(Tracer::Kernel) => Search::Kernel,
        Some(Tracer::Host) | None => return Vec::new(),
    };
    let traced = match plan.has_shared_meshes {
        true => Some(Traced::Instanced),
        false => plan.has_cutouts.then_some(Traced::Cutout),
    };
    let key = |hit| Key::Trace {
        hit,
        search,
        traced,
    };
    vec![key(Hit::Any), key(Hit::Closest)]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{super::final_gather::RAYS, *};
    use crate::{
        Device, DeviceOptions, RenderOptions, Renderer, Scene,
        scene::{FinalGather, IndirectLight},
    };

    /// What is made ahead is used, and final gathering makes nothing else but what only some frames need.
    #[test]
    fn a_frame_uses_what_is_made_ahead() {
        let device = Device::open(&DeviceOptions::default()).expect("a driver");
        for (name, bounces) in [
            ("cornell_spot", 1),
            ("cornell_spot", 3),
            ("glossy", 1),
            ("glossy", 2),
            ("leaves", 1),
            ("tof_corner", 1),
            ("tof_corner", 3),
        ] {
            let file = format!("scenes/{name}.toml");
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
            let mut scene = Scene::load(&file).expect("a scene");
            scene.camera.resolution_px = [64, 48];
            scene.camera.pixel_sampling = None;
            let gather = FinalGather::new(0.1);
            scene.indirect = Some(IndirectLight::FinalGather(FinalGather {
                bounces,
                ..gather
            }));
            let mut plan = Plan::new(&scene, device.info()).expect("a plan");
            plan.trace_by(Tracer::Kernel, device.info())
                .expect("it runs everywhere");
            let ahead = of_final_gather(&plan);
            // Kernels of the gather are known as such, as their time decides how much a submission holds.
            let of_gather = |key: &&Key| {
                matches!(
                    key,
                    Key::FinalGatherEmit { .. }
                        | Key::FinalGatherDraw { .. }
                        | Key::FinalGatherExtend { .. }
                        | Key::FinalGatherShade { .. }
                        | Key::FinalGatherSum { .. }
                        | Key::LightRaysEmit {}
                        | Key::LightRaysShade { .. }
                        | Key::LightPathsEmit { .. }
                        | Key::LightPathsShade { .. }
                        | Key::Trace { .. }
                )
            };
            let measured = ahead.iter().filter(|key| RAYS.is_done_by(key.pass()));
            assert_eq!(measured.count(), ahead.iter().filter(of_gather).count());
            let mut renderer = Renderer::new(&device).expect("a renderer");
            let mut options = RenderOptions {
                tracer: Some(Tracer::Kernel),
                ..RenderOptions::default()
            };
            renderer.render(&scene, &mut options).expect("a frame");
            let used = device.pipelines().used();
            let unused: Vec<_> = ahead.iter().filter(|key| !used.contains(key)).collect();
            assert!(unused.is_empty(), "{name}: {unused:?}");
            let of_some = ["unoccluded", "stderr", "sensor", "range_weights"];
            let is_later = |key: &&Key| {
                let pass = key.pass();
                let is_before = ["gbuffer", "direct", "shadow", "vertex", "rsm"];
                !is_before.iter().any(|name| pass.starts_with(name)) && !of_some.contains(&pass)
            };
            let missing: Vec<_> = used
                .iter()
                .filter(is_later)
                .filter(|key| !ahead.contains(key))
                .collect();
            assert!(missing.is_empty(), "{name}: {missing:?}");
            drop(renderer);
        }
    }
}
