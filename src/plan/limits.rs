//! What the device must hold for a plan.

use super::{IndirectPlan, MAX_TRIANGLES, PIXEL_BYTES, Plan};
use crate::{
    Error, Result,
    ray_tree::max_triangle_texels,
    scene::{Scene, Shadow, Shared, Texture},
    vulkan::{
        DeviceInfo, ROW_TEXELS,
        shaders::{BindingKind, MODULES, Module},
    },
};

impl Plan {
    /// Refuses what the device cannot hold.
    pub(super) fn check_limits(&self, scene: &Scene, device: &DeviceInfo) -> Result<()> {
        let limits = &device.limits;
        let check = |what: &str, requested: u64, limit: u64, hint: &str| {
            check_limit(device, what, requested, limit, hint)
        };
        let smaller_image = "render a smaller image, or choose another device";
        let smaller_rsm = "set a smaller rsm_size, or choose another device";
        let [width, height] = self.resolution_px;
        let pixels = u64::from(width) * u64::from(height);
        let max_image_px = limits.max_image_px.into();
        check(
            "the image's width (px)",
            width.into(),
            max_image_px,
            smaller_image,
        )?;
        check(
            "the image's height (px)",
            height.into(),
            max_image_px,
            smaller_image,
        )?;
        if let Some(indirect) = self.indirect {
            check(
                "rsm_size (texels)",
                indirect.rsm_size.into(),
                max_image_px,
                smaller_rsm,
            )?;
        }
        self.check_memory(scene, device)?;
        check(
            "an image of the G-buffer (bytes)",
            pixels * PIXEL_BYTES,
            limits.max_allocation_bytes,
            smaller_image,
        )?;
        check(
            "an image on its way to the host (bytes)",
            pixels * PIXEL_BYTES,
            limits.max_buffer_bytes,
            smaller_image,
        )?;
        if let Some(indirect) = self.indirect {
            let IndirectPlan { rsm_size, .. } = indirect;
            check(
                "the list of pixels (bytes)",
                pixels * 4,
                limits.max_storage_buffer_bytes,
                smaller_image,
            )?;
            if indirect.is_final_gather() {
                check(
                    "the light on the coarsest grid (bytes)",
                    self.smoothing_bytes(indirect.refinement.coarsest_stride),
                    limits.max_storage_buffer_bytes,
                    smaller_image,
                )?;
            }
            let texels = u64::from(self.max_faces()) * u64::from(rsm_size) * u64::from(rsm_size);
            check(
                "an image of the RSM (bytes)",
                texels * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_rsm,
            )?;
            let what = "the list of all lights' VPLs";
            let hint = "set a smaller rsm_size, use fewer lights, or choose another device";
            let lists = self.lights.len() as u64;
            let rows = lists * texels.div_ceil(ROW_TEXELS);
            check(&format!("{what} (rows)"), rows, max_image_px, hint)?;
            // Members of a record are layers of an image.
            let members = if self.is_specular { 5 } else { 3 };
            check(
                &format!("{what} (bytes)"),
                rows * ROW_TEXELS * members * PIXEL_BYTES,
                limits.max_allocation_bytes,
                hint,
            )?;
            check(
                "the table of the RSM's texels (bytes)",
                texels * 8,
                limits.max_storage_buffer_bytes,
                smaller_rsm,
            )?;
        }
        let textures: &[Shared<Texture>] = if self.is_textured {
            &scene.textures
        } else {
            &[]
        };
        for texture in textures {
            let [width, height] = texture.size_px;
            check(
                &format!("the longer edge of texture \"{}\" (px)", texture.name),
                width.max(height).into(),
                max_image_px,
                "scale the texture down, or choose another device",
            )?;
            check(
                &format!("texture \"{}\" (bytes)", texture.name),
                u64::from(width) * u64::from(height) * PIXEL_BYTES,
                largest_list(device),
                "scale the texture down, or choose another device",
            )?;
        }
        if let Some(size) = self.own_map_size() {
            check(
                "the shadow map (bytes)",
                u64::from(self.max_faces()) * u64::from(size) * u64::from(size) * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_image,
            )?;
        }
        let vertices: u64 = scene
            .meshes
            .iter()
            .map(|m| m.positions_m.len() as u64)
            .sum();
        let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
        let fewer = "simplify the meshes, or choose another device";
        let storage = limits.max_storage_buffer_bytes;
        check(
            "the list of vertices (bytes)",
            vertices * 16,
            storage,
            fewer,
        )?;
        check(
            "the list of triangles (bytes)",
            triangles * 12,
            storage,
            fewer,
        )?;
        check("the number of triangles", triangles, MAX_TRIANGLES, fewer)?;
        let is_shadow_asked = scene.direct.shadow == Some(Shadow::Rays);
        if self.has_final_gather() {
            // Each with and without its texture, in three texels.
            let rows = (6 * scene.materials.len() as u64).div_ceil(ROW_TEXELS);
            check(
                "the materials that rays hit (rows)",
                rows,
                max_image_px,
                "set estimator = \"instant-radiosity\" in [indirect], use fewer materials, or choose another device",
            )?;
        }
        self.check_ray_limits(triangles, textures, is_shadow_asked, device)
    }

    /// What rays find the triangles in, and what they find on them.
    fn check_ray_limits(
        &self,
        triangles: u64,
        textures: &[Shared<Texture>],
        is_shadow_asked: bool,
        device: &DeviceInfo,
    ) -> Result<()> {
        if !self.has_rays() {
            return Ok(());
        }
        let limits = &device.limits;
        let without_rays = [
            // Shadows are not asked of rays by themselves.
            (is_shadow_asked, "shadow = \"map\" in [direct]"),
            (
                self.has_final_gather(),
                "estimator = \"instant-radiosity\" in [indirect]",
            ),
        ];
        let without_rays: Vec<&str> = without_rays
            .iter()
            .filter_map(|&(is_asked, without)| is_asked.then_some(without))
            .collect();
        let hint = format!(
            "set {}, simplify the meshes, or choose another device",
            without_rays.join(" and ")
        );
        // Their boxes take half of that, and what rays find on them as much.
        let rows = max_triangle_texels(triangles).div_ceil(ROW_TEXELS);
        check_limit(
            device,
            "the triangles for rays (rows)",
            rows,
            limits.max_image_px.into(),
            &hint,
        )?;
        check_limit(
            device,
            "the triangles for rays (bytes)",
            rows * ROW_TEXELS * PIXEL_BYTES,
            largest_list(device),
            &hint,
        )?;
        if !self.has_final_gather() {
            return Ok(());
        }
        let texels: u64 = textures
            .iter()
            .map(|texture| texture.size_px.map(u64::from).iter().product::<u64>())
            .sum();
        check_limit(
            device,
            "the lists that a kernel of the bounce reads (storage images)",
            storage_images_of_bounce(),
            limits.max_storage_images.into(),
            "set estimator = \"instant-radiosity\" in [indirect], or choose another device",
        )?;
        let rows = texels.div_ceil(ROW_TEXELS);
        let smaller = "set estimator = \"instant-radiosity\" in [indirect], scale the textures down, or choose another device";
        check_limit(
            device,
            "the textures that rays hit (rows, all together)",
            rows,
            limits.max_image_px.into(),
            smaller,
        )?;
        check_limit(
            device,
            "the textures that rays hit (bytes, all together)",
            rows * ROW_TEXELS * PIXEL_BYTES,
            largest_list(device),
            smaller,
        )
    }
}

/// Bytes of a list that goes to an image through a buffer.
fn largest_list(device: &DeviceInfo) -> u64 {
    let limits = &device.limits;
    limits.max_allocation_bytes.min(limits.max_buffer_bytes)
}

/// The most that any of its kernels has.
fn storage_images_of_bounce() -> u64 {
    let kernels = MODULES.iter().filter(|m| m.name.starts_with("bounce_"));
    let images = |module: &Module| {
        let kinds = module.bindings.iter().map(|binding| binding.kind);
        kinds
            .filter(|kind| *kind == BindingKind::StorageImage)
            .count()
    };
    kernels.map(images).max().unwrap_or_default() as u64
}

fn check_limit(
    device: &DeviceInfo,
    what: &str,
    requested: u64,
    limit: u64,
    hint: &str,
) -> Result<()> {
    if requested <= limit {
        return Ok(());
    }
    Err(Error::DeviceLimit {
        what: what.into(),
        requested,
        limit,
        device: device.name.clone(),
        hint: hint.into(),
    })
}
