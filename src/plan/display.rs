//! A plan in words.

use std::fmt;

use super::{GatherPlan, LightPlan, Plan, ShadowPlan};

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [width, height] = self.resolution_px;
        let brdf = self.brdf_name();
        writeln!(f, "passes")?;
        writeln!(f, "  gbuffer    {width} x {height} px, {brdf}")?;
        for (index, light) in self.lights.iter().enumerate() {
            let LightPlan {
                kind,
                faces,
                shadow,
            } = light;
            if let Some(indirect) = self.indirect {
                let size = indirect.rsm_size;
                writeln!(
                    f,
                    "  rsm        light {index} ({kind}): {faces} x {size}² texels"
                )?;
            }
            match shadow {
                ShadowPlan::Rsm { .. } => writeln!(f, "             read by the shadow test too")?,
                ShadowPlan::Map { size } => writeln!(
                    f,
                    "  shadow     light {index} ({kind}): {faces} x {size}² texels"
                )?,
                ShadowPlan::Rays(_) => {}
            }
            write!(f, "  direct     light {index}, {brdf}")?;
            match shadow {
                ShadowPlan::Rays(kernel) => writeln!(f, ", shadow rays, kernel {}", kernel.name())?,
                ShadowPlan::Rsm { .. } | ShadowPlan::Map { .. } => writeln!(f)?,
            }
        }
        if let Some(indirect) = self.indirect {
            writeln!(f, "  vpl        texels with flux, compacted")?;
            let stride = indirect.refinement.coarsest_stride;
            match indirect.refinement.target_error {
                None => writeln!(f, "  receivers  every pixel with a surface")?,
                Some(_) => writeln!(
                    f,
                    "  predict    one of {stride} x {stride} pixels, and those between where they vary"
                )?,
            }
            let (name, visibility, kernel, error) = match indirect.gather {
                GatherPlan::VplSum { sum, kernel } => (
                    sum.name(),
                    "no visibility",
                    kernel.name(),
                    "interpolation error",
                ),
                GatherPlan::FinalGather { kernel } => (
                    "final-gather",
                    "visibility by rays",
                    kernel.name(),
                    "target error",
                ),
            };
            let pass = if indirect.is_final_gather() {
                "bounce"
            } else {
                "gather"
            };
            write!(f, "  {pass:<10} {name}, {visibility}, kernel {kernel}")?;
            match indirect.refinement.target_error {
                Some(target) => writeln!(f, ", {error} {target}")?,
                None => writeln!(f)?,
            }
            if indirect.refinement.target_error.is_some() {
                writeln!(f, "  error_estimate  on a sample of pixels")?;
            }
        }
        if self.joule_per_irradiance.is_some() {
            writeln!(f, "  sensor")?;
        }
        writeln!(f, "left out")?;
        let absent = [
            (!self.is_specular, "specular terms: no material has k_s"),
            (!self.is_smooth, "shading normals: no mesh has any"),
            (
                !self.is_textured,
                "textures: no material on a mesh with texcoords has one",
            ),
            (
                self.own_map_size().is_none() && self.has_shadow_rays(),
                "shadow maps: [direct] asks for rays",
            ),
            (!self.has_rays(), "tree of boxes: nothing casts rays"),
            (
                self.indirect.is_none(),
                "RSM, VPLs and gather: the scene has no [indirect]",
            ),
            (
                self.joule_per_irradiance.is_none(),
                "sensor: the scene has no [sensor]",
            ),
            (
                self.indirect.is_some_and(|i| !i.is_final_gather()),
                "visibility between VPLs and pixels: see docs/model.md",
            ),
        ];
        for (_, what) in absent.iter().filter(|(is_absent, _)| *is_absent) {
            writeln!(f, "  {what}")?;
        }
        Ok(())
    }
}
