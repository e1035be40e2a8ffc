//! Formats a plan as text.

use std::fmt;

use super::{GatherPlan, LightPlan, Plan, ShadowPlan, TofPlan, Tracer};
use crate::scene::{ErrorNorm, PixelSampling};

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [width, height] = self.resolution_px;
        let brdf = self.brdf_name();
        writeln!(f, "passes")?;
        match self.has_primary_rays {
            false => writeln!(f, "  gbuffer    {width} x {height} px, {brdf}")?,
            true => {
                let why = match (self.has_distortion, self.is_emissive) {
                    (true, _) => "the lens distorts the image",
                    (false, true) => "surfaces emit light",
                    (false, false) => "the device's rasteriser is coarse",
                };
                writeln!(f, "  primary_rays  {width} x {height} px, {brdf}: {why}")?;
            }
        }
        if self.has_one_sided {
            writeln!(f, "             through the backs of one-sided surfaces")?;
        }
        for (index, light) in self.lights.iter().enumerate() {
            let LightPlan { kind, faces, .. } = light;
            if light.emission_points > 0 {
                let points = light.emission_points;
                writeln!(
                    f,
                    "  light {index}    surfaces that emit, by {points} points"
                )?;
                continue;
            }
            let map = |size| format!("light {index} ({kind}): {faces} x {size}² texels");
            if let Some(size) = self.rsm_size() {
                writeln!(f, "  rsm        {}", map(size))?;
            }
            let mut rays = "";
            match light.shadow {
                ShadowPlan::Rsm { .. } => writeln!(f, "             read by the shadow test too")?,
                ShadowPlan::Map { size } => writeln!(f, "  shadow     {}", map(size))?,
                ShadowPlan::Rays => rays = ", shadow rays",
            }
            writeln!(f, "  direct     light {index}, {brdf}{rays}")?;
        }
        if let Some(indirect) = self.bounce() {
            match indirect.rsm_size() {
                Some(_) => writeln!(f, "  vpl        texels with flux, compacted")?,
                None => writeln!(
                    f,
                    "  light_rays VPLs from {}² tiles per face, subdivided where they matter",
                    indirect.emission_size
                )?,
            }
            let stride = indirect.refinement.coarsest_stride;
            let target = indirect.refinement.target_error;
            match target {
                None => writeln!(f, "  receivers  every pixel with a surface")?,
                Some(_) => writeln!(
                    f,
                    "  predict    one pixel in each block of {stride} x {stride}, and more where the light varies"
                )?,
            }
            let (gather, error) = match indirect.gather {
                GatherPlan::VplSum { sum, kernel } => {
                    let (sum, kernel) = (sum.name(), kernel.name());
                    (
                        format!("gather     {sum}, no visibility, kernel {kernel}"),
                        "interpolation error",
                    )
                }
                GatherPlan::FinalGather { bounces } => {
                    let more = match bounces {
                        1 => String::new(),
                        _ => format!(", up to {bounces} bounces"),
                    };
                    (
                        format!("final_gather  visibility by rays{more}"),
                        "target error",
                    )
                }
            };
            let mut aim = target.map_or(String::new(), |target| format!(", {error} {target}"));
            if indirect.is_final_gather() {
                aim += match indirect.refinement.error_norm {
                    ErrorNorm::Image => " over the image",
                    ErrorNorm::Local => " over each part of the image",
                };
            }
            writeln!(f, "  {gather}{aim}")?;
            if let Some(target_m) = self.target_range_error_m() {
                let mm = 1e3 * target_m;
                writeln!(f, "             target error of the range {mm} mm")?;
            }
            if let Some(ms) = indirect.refinement.max_ms {
                writeln!(f, "             for {ms} ms at most")?;
            }
            if let Some(rays) = indirect.refinement.max_rays {
                writeln!(f, "             with {rays} rays at most")?;
            }
            if indirect.has_stderr_layer {
                writeln!(f, "             with the layer stderr")?;
            }
            if target.is_some() {
                writeln!(f, "  error_estimate  on a sample of pixels")?;
            }
        }
        if let Some(PixelSampling { samples, filter }) = self.pixel_sampling {
            let filter = filter.name();
            writeln!(
                f,
                "  pixel_filter  {samples} samples a pixel, {filter}: gbuffer and direct for each sample, gather for samples of a surface that no pixel's centre shows"
            )?;
        }
        if let Some(tof) = self.tof {
            let TofPlan {
                frequency_count,
                phase_count,
                ..
            } = tof;
            writeln!(
                f,
                "             with phasors of {frequency_count} frequencies, {phase_count} phase images each"
            )?;
        }
        if let Some(tracer) = self.tracer {
            let (name, at_once) = (tracer.name(), self.rays_at_once);
            writeln!(f, "  trace      by {name}, up to {at_once} rays at a time")?;
        }
        if self.joule_per_irradiance.is_some() {
            let vignetting = match self.irradiance_per_radiance {
                None => "",
                Some(_) if self.vignetting.is_some() => {
                    "     behind an aperture, measured vignetting"
                }
                Some(_) if self.is_orthographic => "     behind an aperture",
                Some(_) => "     behind an aperture, cos⁴",
            };
            writeln!(f, "  sensor{vignetting}")?;
        }
        writeln!(f, "left out")?;
        let is_sum = self.bounce().is_some_and(|i| !i.is_final_gather());
        let has_maps = self.own_map_size().is_some() || !self.has_shadow_rays();
        for (is_there, what) in [
            (self.is_specular, "specular terms: no material has a lobe"),
            (self.is_smooth, "shading normals: no mesh has any"),
            (
                self.is_textured,
                "textures: no material on a mesh with texcoords has one",
            ),
            (
                self.has_cutouts,
                "cut-outs: no material on a mesh with texcoords has an alpha texture",
            ),
            (
                self.has_shared_meshes,
                "shared meshes: no large mesh has several instances or an instance with a transform",
            ),
            (has_maps, "shadow maps: rays find shadows"),
            (self.tracer.is_some(), "ray tree (BVH): nothing casts rays"),
            (
                self.tracer != Some(Tracer::Query),
                "ray tree (BVH): the device has its own",
            ),
            (!self.lights.is_empty(), "lights: none emits anything"),
            (
                self.indirect.is_some(),
                "RSM, VPLs and gather: the scene has no [indirect]",
            ),
            (
                self.joule_per_irradiance.is_some(),
                "sensor: the scene has no [sensor]",
            ),
            (self.tof.is_some(), "phasors: the scene has no [tof]"),
            (
                !is_sum,
                "visibility between VPLs and pixels: see docs/model.md",
            ),
        ] {
            if !is_there {
                writeln!(f, "  {what}")?;
            }
        }
        Ok(())
    }
}
