//! Pixels that show one of two surfaces by chance: their centre lies on an edge, and rounding decides.

use glam::DVec3;

use super::{path::Transport, rays::Hit, surface::Surface, view_ray::view_ray};

/// To how many bits of a pixel rasterisers round corners.
pub const SUB_PIXEL_BITS: u32 = 8;
/// Two directions from here on are another surface's: 10°.
const LEAST_COSINE: f64 = 0.984_807_753_012_208;
/// How far apart corners of one plane may be, over the scene's size: meshes come in f32.
const PLANE_ROUNDING: f64 = 1e-6;

/// Whether the places next to a point of the image plane do not all show what that point shows, twice as far off as a rasteriser
/// rounds corners.
pub fn is_edge(
    transport: &Transport,
    [x_px, y_px]: [f64; 2],
    centre: Option<&Hit>,
    sub_pixel_bits: u32,
) -> bool {
    let near_px = 2.0 * f64::from(sub_pixel_bits).exp2().recip();
    let camera = &transport.surfaces.scene.camera;
    let origin = transport.to_local(camera.position_m);
    let surface_at = |hit: &Hit, [x_px, y_px]: [f64; 2]| {
        let direction = view_ray(camera, x_px, y_px).0;
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
        let direction = view_ray(camera, near_px[0], near_px[1]).0;
        let near = transport.trace(origin, direction);
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

/// Whether two triangles of a mesh are one surface between these points. Where it bends, it leaves the plane of a point by as
/// much as its normal turns on the way; a silhouette or a step leaves it by more.
fn is_continued(a: &Surface, b: &Surface) -> bool {
    let apart = b.position - a.position;
    let turn = a.geometric_normal.cross(b.geometric_normal).length();
    let off_plane = |normal: DVec3| normal.dot(apart).abs();
    let most = 2.0 * turn * apart.length() + PLANE_ROUNDING;
    a.normal.dot(b.normal) >= LEAST_COSINE
        && off_plane(a.geometric_normal) <= most
        && off_plane(b.geometric_normal) <= most
}
