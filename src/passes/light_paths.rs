//! Light paths pass: makes the VPLs of further bounces, where light that VPLs reflect meets the scene.

use super::{
    Context,
    gatherer::LightRaySets,
    hits::HitScene,
    ray_table::RayTable,
    trace::{Find, no_list},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Buffer, Image, Resource, groups_in_rows,
        shaders::{Key, LightPathParameters},
    },
};

/// Fewest VPLs of a bounce.
const FEWEST_VPLS: u32 = 64;

/// VPLs of each bounce after the first, for so many of the first: half as many as of the bounce before.
pub(super) fn vpl_counts(of_first: u32, bounces: u32) -> Vec<u32> {
    let least = FEWEST_VPLS.min(of_first);
    let counts = (1..bounces).map(|halvings| (of_first >> halvings).max(least));
    counts.collect()
}

/// Upper limit of the VPLs of all bounces after the first, of all sets together.
pub(super) fn most_vpls(of_first: u32, bounces: u32, sets: u32) -> u32 {
    match bounces {
        1 => 0,
        _ => of_first + sets * bounces * FEWEST_VPLS,
    }
}

/// The area over which the VPLs are taken to be spread evenly, whatever their density is: that of the box around the scene, local units².
/// 0 with one bounce.
pub(super) fn assumed_area(context: &Context) -> f64 {
    if context.plan.bounces() == 1 {
        return 0.0;
    }
    let size_m = context.scene.bounding_box().map(|b| b.max_m - b.min_m);
    let size = size_m.unwrap_or_default() / context.space.metres_per_unit;
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
}

/// The density that the VPLs are given, per area.
pub(super) fn density(of_two_bounces: u32, set_size: u32, assumed_area: f64) -> f32 {
    let share = f64::from(of_two_bounces) / f64::from(set_size.max(1));
    (share / assumed_area.max(1e-12)) as f32
}

fn emit_key(plan: &Plan) -> Key {
    Key::LightPathsEmit {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
    }
}

fn shade_key(plan: &Plan) -> Key {
    Key::LightPathsShade {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        surface: plan.surface(),
        instanced: plan.has_shared_meshes,
    }
}

/// The kernels of a plan with more than one bounce.
pub(super) fn keys(plan: &Plan) -> Vec<Key> {
    match plan.bounces() {
        1 => Vec::new(),
        _ => vec![emit_key(plan), shade_key(plan)],
    }
}

/// Lets the light of the first bounce's VPLs go on, as the table says. `paths` has room for what as many rays carry as are in memory at a
/// time. Returns the number of rays.
pub(super) fn trace(
    context: &Context,
    scene: HitScene,
    vpls: &Image,
    paths: &Buffer,
    table: &RayTable,
    sets: LightRaySets,
) -> Result<u64> {
    let plan = context.plan;
    let mut before = (0, table.ray_count());
    let mut traced = 0;
    for (bounce, &vpl_count) in (2..).zip(&table.reflected) {
        let first_vpl = before.0 + before.1;
        let all_rays = vpl_count * sets.set_count;
        for first in (0..all_rays).step_by(plan.rays_at_once as usize) {
            let end = all_rays.min(first + plan.rays_at_once);
            let parameters = LightPathParameters {
                set_size: table.set_size,
                first_vpl,
                vpl_count,
                first_before: before.0,
                count_before: before.1,
                density: table.reflected_density,
                seed: sets.seed.wrapping_mul(0x9e37_79b9) ^ bounce,
                first_in_list: first,
                end_in_list: end,
            };
            let dispatch = |key| {
                let list = context.rays.borrow();
                let mut resources = list.as_ref().ok_or_else(no_list)?.resources();
                resources.extend(scene.resources());
                resources.extend([
                    ("light_paths", Resource::Buffer(paths)),
                    ("vpls", Resource::Image(vpls)),
                    ("drawn_vpls", Resource::Image(vpls)),
                ]);
                resources.extend(context.modulation());
                let groups = groups_in_rows((end - first).div_ceil(64));
                context.dispatch_groups(key, &resources, &parameters, groups)
            };
            dispatch(emit_key(plan))?;
            scene.tree.trace(context, Find::Closest, 0..end - first)?;
            dispatch(shade_key(plan))?;
        }
        traced += u64::from(all_rays);
        before = (first_vpl, vpl_count);
    }
    context.cost.borrow_mut().count_work("light_rays", traced);
    Ok(traced)
}
