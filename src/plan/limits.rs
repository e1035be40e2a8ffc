//! What the device must hold for a plan.

use super::{IndirectPlan, MAX_TRIANGLES, PIXEL_BYTES, Plan};
use crate::{
    Error, Result, bvh,
    scene::{Scene, Texture},
    vulkan::DeviceInfo,
};

impl Plan {
    /// Refuses what the device cannot hold.
    pub(super) fn check_limits(&self, scene: &Scene, device: &DeviceInfo) -> Result<()> {
        let limits = &device.limits;
        let check = |what: &str, asked: u64, limit: u64, mend: &str| {
            if asked <= limit {
                return Ok(());
            }
            Err(Error::DeviceLimit {
                what: what.into(),
                asked,
                limit,
                device: device.name.clone(),
                mend: mend.into(),
            })
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
        check(
            "an image of the G-buffer (bytes)",
            pixels * PIXEL_BYTES,
            limits.max_allocation_bytes,
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
            check(
                "rsm_size (texels)",
                rsm_size.into(),
                max_image_px,
                smaller_rsm,
            )?;
            let texels = u64::from(self.max_faces()) * u64::from(rsm_size) * u64::from(rsm_size);
            check(
                "an image of the RSM (bytes)",
                texels * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_rsm,
            )?;
            // Each light's VPLs begin a row, which holds 1024.
            let lists = match indirect.refinement() {
                Some(_) => self.lights.len() as u64,
                None => 1,
            };
            let vpl_rows = lists * texels.div_ceil(1024);
            check(
                "the list of VPLs (rows)",
                vpl_rows,
                max_image_px,
                smaller_rsm,
            )?;
            // Members of a record are layers of an image.
            let members = if self.is_specular { 5 } else { 3 };
            check(
                "the list of VPLs (bytes)",
                vpl_rows * 1024 * members * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_rsm,
            )?;
            check(
                "the table of the RSM's texels (bytes)",
                texels * 8,
                limits.max_storage_buffer_bytes,
                smaller_rsm,
            )?;
        }
        let textures: &[Texture] = if self.is_textured {
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
                limits.max_allocation_bytes,
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
        if self.has_shadow_rays() {
            check(
                "the tree of boxes (bytes)",
                bvh::max_bytes(triangles),
                storage,
                "set shadow = \"map\" in [direct], simplify the meshes, or choose another device",
            )?;
        }
        check("the number of triangles", triangles, MAX_TRIANGLES, fewer)
    }
}
