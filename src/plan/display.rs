//! A plan in words.

use std::fmt;

use super::{IndirectMethod, LightPlan, Plan, RefinementPlan, ShadowPlan, SumPlan};

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [width, height] = self.resolution_px;
        let brdf = if self.is_specular { "Phong" } else { "Lambert" };
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
            if let Some(RefinementPlan {
                coarsest_stride, ..
            }) = indirect.refinement()
            {
                writeln!(
                    f,
                    "  predict    every {coarsest_stride}th pixel, and those between where they vary"
                )?;
            }
            match indirect.method {
                IndirectMethod::Sum(SumPlan {
                    sum,
                    kernel,
                    refinement,
                }) => {
                    let (name, kernel) = (sum.name(), kernel.name());
                    if let Some(RefinementPlan { target_error, .. }) = refinement {
                        writeln!(
                            f,
                            "  gather     {name}, no visibility, interpolation error {target_error}, kernel {kernel}"
                        )?;
                    } else {
                        writeln!(f, "  receivers  pixels with a surface, compacted")?;
                        writeln!(f, "  gather     {name}, no visibility, kernel {kernel}")?;
                    }
                }
                IndirectMethod::Bounce(bounce) => {
                    let kernel = bounce.kernel.name();
                    let asked = bounce.refinement.target_error;
                    writeln!(
                        f,
                        "  bounce     final-gather, visibility by rays, target error {asked}, kernel {kernel}"
                    )?;
                }
            }
            if indirect.refinement().is_some() {
                writeln!(f, "  appraise   the error made, on a sample of pixels")?;
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
                self.indirect.is_some_and(|i| i.bounce().is_none()),
                "visibility between VPLs and pixels: see docs/model.md",
            ),
        ];
        for (_, what) in absent.iter().filter(|(is_absent, _)| *is_absent) {
            writeln!(f, "  {what}")?;
        }
        Ok(())
    }
}
