//! Pixels whose centre is on an edge, so that rounding decides which of two surfaces they show.

use glam::DVec3;

use super::{path::Transport, rays::Hit, surface::Surface, view_ray::view_ray};

/// Bits of a pixel that rasterisers round corners to.
pub const SUB_PIXEL_BITS: u32 = 8;
/// Normals that differ by more than this, 10°, belong to different surfaces.
const LEAST_COSINE: f64 = 0.984_807_753_012_208;
/// Allowed distance of corners from their common plane, relative to the scene's size: meshes come in f32.
const PLANE_ROUNDING: f64 = 1e-6;

/// Whether a neighbour of a point of the image plane shows another surface than the point. The neighbours are at twice the distance by
/// which a rasteriser rounds corners.
pub fn is_edge(
    transport: &Transport,
    [x_px, y_px]: [f64; 2],
    centre: Option<&Hit>,
    sub_pixel_bits: u32,
) -> bool {
    let near_px = 2.0 * f64::from(sub_pixel_bits).exp2().recip();
    let camera = &transport.surfaces.scene.camera;
    let surface_at = |hit: &Hit, [x_px, y_px]: [f64; 2]| {
        // It sees what it has hit.
        let direction = view_ray(camera, x_px, y_px).map_or(DVec3::ZERO, |ray| ray.direction);
        transport.surfaces.at(hit, direction)
    };
    let mut at_centre = None;
    let steps = [
        [-near_px, 0.0],
        [near_px, 0.0],
        [0.0, -near_px],
        [0.0, near_px],
    ];
    steps.into_iter().any(|[dx, dy]| {
        let near_px = [x_px + dx, y_px + dy];
        let ray = view_ray(camera, near_px[0], near_px[1]);
        let near = ray.and_then(|ray| transport.seen(&ray));
        let (Some(centre), Some(near)) = (centre, near) else {
            return centre.is_some() != near.is_some();
        };
        if centre.triangle == near.triangle {
            return false;
        }
        let [mesh_and_material, of_near] =
            [centre, &near].map(|hit| transport.surfaces.mesh_and_material(hit.triangle));
        let at_centre = at_centre.get_or_insert_with(|| surface_at(centre, [x_px, y_px]));
        mesh_and_material != of_near || !is_continued(at_centre, &surface_at(&near, near_px))
    })
}

/// Whether two triangles of a mesh are one surface between these points. A curved surface leaves the plane of a point by as much as its
/// normal turns on the way; a silhouette or a step leaves it by more.
fn is_continued(a: &Surface, b: &Surface) -> bool {
    let apart = b.position - a.position;
    let turn = a.geometric_normal.cross(b.geometric_normal).length();
    let off_plane = |normal: DVec3| normal.dot(apart).abs();
    let most = 2.0 * turn * apart.length() + PLANE_ROUNDING;
    a.normal.dot(b.normal) >= LEAST_COSINE
        && off_plane(a.geometric_normal) <= most
        && off_plane(b.geometric_normal) <= most
}
