//! Area light pass: the direct light of one light's area, in closed form times the share that its points see.

use super::{
    Context,
    direct::{DirectImages, SeenPoints},
    gbuffer::GBuffer,
    light::DeviceLight,
};
use crate::{
    Result,
    plan::{Plan, TofPlan},
    vulkan::{
        Allocate, BufferUse, Device, Image, ImageShape, Resource,
        shaders::{AreaLightParameters, Key},
    },
};

/// Pixels along the edge of a workgroup.
const GROUP_EDGE: u32 = 8;

/// Sums over points. The lights use these images one after the other.
pub(crate) struct AreaLightImages<A: Allocate = Device> {
    /// Radiance of each of the two halves of the points.
    halves: [A::Image; 2],
    /// Phasors of all points; only with time of flight.
    phasors: Option<A::Image>,
    differences: A::Buffer,
}

impl<A: Allocate> AreaLightImages<A> {
    /// `None` if no light has an area.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<AreaLightImages<A>>> {
        if plan.target_area_light_error.is_none() {
            return Ok(None);
        }
        let shape = ImageShape::plain(plan.resolution_px);
        let half = || allocate.image("half of an area's light", shape);
        let phasors = plan.tof.map(|tof| shape.with_layers(tof.pair_count()));
        let bytes = u64::from(group_count(plan)) * size_of::<[f32; 2]>() as u64;
        Ok(Some(AreaLightImages {
            halves: [half()?, half()?],
            phasors: allocate.image_if("phasors of an area's light", phasors)?,
            differences: allocate.buffer("differences", bytes, BufferUse::Readback)?,
        }))
    }
}

impl AreaLightImages {
    /// The images to which the points of one half are added.
    pub fn half(&self, index: usize) -> DirectImages<'_> {
        DirectImages {
            radiance: &self.halves[index],
            phasors: self.phasors.as_ref(),
        }
    }

    /// All images. They must be 0 before the first light.
    pub fn images(&self) -> impl Iterator<Item = &Image> {
        self.halves.iter().chain(&self.phasors)
    }

    /// Merges both halves of so many points into the first and returns their relative difference.
    /// If the halves are independent, this is the relRMSE of their mean.
    pub fn merge(
        &self,
        context: &Context,
        gbuffer: &GBuffer,
        light: &DeviceLight,
        points: u32,
    ) -> Result<f64> {
        let [first, second] = &self.halves;
        let mut resources = gbuffer.resources();
        resources.extend([
            ("light", Resource::Buffer(&light.uniform)),
            ("first_half", Resource::Image(first)),
            ("second_half", Resource::Image(second)),
            ("differences", Resource::Buffer(&self.differences)),
        ]);
        let size_px = context.plan.resolution_px;
        let parameters = AreaLightParameters {
            point_count: points as f32,
            ..AreaLightParameters::default()
        };
        let key = Key::AreaLightMerge {};
        context.dispatch(key, &resources, &parameters, size_px)?;
        context.finish()?;
        let found: &[[f32; 2]] = self
            .differences
            .mapped(group_count(context.plan) as usize)?;
        let sum = |i: usize| found.iter().map(|sums| f64::from(sums[i])).sum::<f64>();
        let (apart, together) = (sum(0), sum(1));
        Ok(match together > 0.0 {
            true => (apart / together).sqrt(),
            false => 0.0,
        })
    }

    /// Adds the mean of the first half, which has so many points, to the images of direct light.
    pub fn add_to(
        &self,
        context: &Context,
        seen: SeenPoints,
        light: &DeviceLight,
        direct: DirectImages,
        points: u32,
    ) -> Result<()> {
        let mut resources = seen.gbuffer.resources();
        resources.extend([
            ("light", Resource::Buffer(&light.uniform)),
            ("first_half", Resource::Image(&self.halves[0])),
            ("direct_radiance", Resource::Image(direct.radiance)),
        ]);
        let mut key = Key::AreaLightAdd { phasors: false };
        if let (Some(sums), Some(phasors)) = (&self.phasors, direct.phasors) {
            key = Key::AreaLightAdd { phasors: true };
            resources.push(("point_phasors", Resource::Image(sums)));
            resources.push(("direct_phasors", Resource::Image(phasors)));
        }
        let parameters = AreaLightParameters {
            share: seen.share.unwrap_or(1.0) as f32,
            point_count: points as f32,
            pair_count: context.plan.tof.map_or(0, TofPlan::pair_count),
        };
        let size_px = context.plan.resolution_px;
        context.dispatch(key, &resources, &parameters, size_px)
    }
}

fn group_count(plan: &Plan) -> u32 {
    let groups = plan.resolution_px.map(|size| size.div_ceil(GROUP_EDGE));
    groups.iter().product()
}
