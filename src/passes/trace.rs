//! Trace pass: finds what the rays of a list hit, by the plan's tracer. Other passes emit the rays and shade the hits.

use std::{cell::RefCell, ops::Range, time::Instant};

#[cfg(feature = "test-hooks")]
use crate::vulkan::Buffer;

use super::{Context, rays::RayTriangles};
use crate::{
    Error, Result,
    plan::{Plan, Tracer},
    ray_tree,
    vulkan::{
        Allocate, BufferUse, Device, Resource, groups_in_rows,
        shaders::{self, TraceParameters},
    },
};
pub(crate) use ray_tree::Find;

/// The rays that are traced on this thread, if they are kept: for benches.
#[cfg(feature = "test-hooks")]
pub(crate) mod kept {
    use super::{Context, Find, ray_tree::Ray};
    use crate::Result;
    use std::{cell::RefCell, ops::Range};

    /// Neighbouring rays are kept together: one block of this many out of [`BLOCKS`].
    const BLOCK: usize = 4096;
    const BLOCKS: usize = 16;

    type Blocks = Vec<(Find, Vec<Ray>)>;

    thread_local! {
        pub(crate) static RAYS: RefCell<Option<Blocks>> = const { RefCell::new(None) };
    }

    pub(super) fn keep(context: &Context, find: Find, rays: &Range<u32>) -> Result<()> {
        if RAYS.with_borrow(Option::is_none) {
            return Ok(());
        }
        let list = super::read(context, |list| &list.rays, rays.end)?;
        let blocks = list[rays.start as usize..].chunks(BLOCK).step_by(BLOCKS);
        let block = blocks.flatten().copied().collect();
        RAYS.with_borrow_mut(|kept| kept.get_or_insert_default().push((find, block)));
        Ok(())
    }
}

/// Rays in memory: those that a pass has emitted, what they hit, and what they contribute.
pub(crate) struct RayList<A: Allocate = Device> {
    rays: A::Buffer,
    hits: A::Buffer,
    /// Only with final gathering.
    contributions: Option<A::Buffer>,
    is_for_host: bool,
    capacity: u32,
    contribution_bytes: usize,
}

impl<A: Allocate> RayList<A> {
    /// Allocates room for the plan's number of rays; `None` if nothing casts rays.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<RayList<A>>> {
        let Some(tracer) = plan.tracer else {
            return Ok(None);
        };
        let is_for_host = tracer == Tracer::Host;
        let usage = match is_for_host {
            true => BufferUse::Readback,
            false => BufferUse::Device,
        };
        let capacity = u64::from(plan.rays_at_once);
        let buffer =
            |name, bytes: usize, usage| allocate.buffer(name, capacity * bytes as u64, usage);
        let contribution_bytes = contribution_bytes(plan);
        let contributions = || {
            buffer(
                "contributions of rays",
                contribution_bytes,
                BufferUse::Device,
            )
        };
        Ok(Some(RayList {
            rays: buffer("rays", size_of::<shaders::Ray>(), usage)?,
            hits: buffer("hits", size_of::<u32>(), usage)?,
            contributions: plan.has_final_gather().then(contributions).transpose()?,
            is_for_host,
            capacity: plan.rays_at_once,
            contribution_bytes,
        }))
    }
}

/// Of a ray that leads to light. Those to VPLs have one vector more, but there are as many rays that have none.
fn contribution_bytes(plan: &Plan) -> usize {
    let vectors = 1 + usize::from(plan.has_microfacets) + usize::from(plan.bounced_tof().is_some());
    vectors * size_of::<[f32; 4]>()
}

impl RayList {
    /// Makes the list that the plan needs, unless it is there.
    pub fn update(list: &RefCell<Option<RayList>>, context: &Context) -> Result<()> {
        let plan = context.plan;
        let mut list = list.borrow_mut();
        let fits = list.as_ref().is_some_and(|list| {
            plan.tracer.map(|tracer| tracer == Tracer::Host) == Some(list.is_for_host)
                && plan.rays_at_once == list.capacity
                && plan.has_final_gather() == list.contributions.is_some()
                && contribution_bytes(plan) == list.contribution_bytes
        });
        if !fits {
            *list = None;
            *list = RayList::for_plan(context.device, plan)?;
        }
        Ok(())
    }

    /// The lists with their names in the shaders.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![
            ("rays", Resource::Buffer(&self.rays)),
            ("hits", Resource::Buffer(&self.hits)),
        ];
        let contributions = self.contributions.as_ref();
        resources.extend(contributions.map(|list| ("contributions", Resource::Buffer(list))));
        resources
    }

    /// Copies rays to the device.
    #[cfg(feature = "test-hooks")]
    pub fn upload(context: &Context, rays: &[ray_tree::Ray]) -> Result<()> {
        let staging = Buffer::filled(context.device, "rays", rays, BufferUse::Staging)?;
        context.submit(|recorder| {
            let list = context.rays.borrow();
            let list = list.as_ref().ok_or_else(no_list)?;
            recorder.copy_buffer(&staging, &list.rays, size_of_val(rays) as u64);
            Ok(())
        })
    }

    /// Reads what the first rays hit.
    #[cfg(feature = "test-hooks")]
    pub fn read_hits(context: &Context, count: u32) -> Result<Vec<u32>> {
        read(context, |list| &list.hits, count)
    }
}

/// Reads the first elements of one of the context's lists.
#[cfg(feature = "test-hooks")]
fn read<T: bytemuck::Pod>(
    context: &Context,
    list: impl Fn(&RayList) -> &Buffer,
    count: u32,
) -> Result<Vec<T>> {
    let bytes = u64::from(count) * size_of::<T>() as u64;
    let readback = Buffer::new(context.device, "read back", bytes, BufferUse::Readback)?;
    context.submit(|recorder| {
        let lists = context.rays.borrow();
        let lists = lists.as_ref().ok_or_else(no_list)?;
        recorder.barrier();
        recorder.copy_buffer(list(lists), &readback, bytes);
        Ok(())
    })?;
    Ok(readback.mapped(count as usize)?.to_vec())
}

impl RayTriangles {
    /// Finds what these rays of the context's list hit.
    pub fn trace(&self, context: &Context, find: Find, rays: Range<u32>) -> Result<()> {
        #[cfg(feature = "test-hooks")]
        kept::keep(context, find, &rays)?;
        if let Some(tracer) = self.host_tracer() {
            context.finish()?;
            let start = Instant::now();
            let mut list = context.rays.borrow_mut();
            let list = list.as_mut().ok_or_else(no_list)?;
            let rays = rays.start as usize..rays.end as usize;
            let all = list.rays.mapped::<ray_tree::Ray>(rays.end)?;
            let hits = list.hits.mapped_mut::<u32>(rays.end)?;
            tracer.trace(find, &all[rays.clone()], &mut hits[rays]);
            let mut cost = context.cost.borrow_mut();
            cost.add_host_pass("trace", start.elapsed());
            return Ok(());
        }
        let list = context.rays.borrow();
        let list = list.as_ref().ok_or_else(no_list)?;
        let mut resources = self.resources();
        resources.extend(list.resources());
        let parameters = TraceParameters {
            first_ray: rays.start,
            ray_count: rays.end - rays.start,
        };
        let groups = groups_in_rows(parameters.ray_count.div_ceil(64));
        context.dispatch_groups(self.key(find), &resources, &parameters, groups)
    }
}

pub(super) fn no_list() -> Error {
    Error::internal("there is no list of rays")
}

/// The host reads rays as the shaders write them.
const _: () = {
    assert!(size_of::<ray_tree::Ray>() == size_of::<shaders::Ray>());
    assert!(std::mem::offset_of!(shaders::Ray, t_max) == 12);
    assert!(std::mem::offset_of!(shaders::Ray, direction) == 16);
    assert!(std::mem::offset_of!(shaders::Ray, end_height) == 28);
};
