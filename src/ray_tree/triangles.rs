//! Triangles as rays test them.

use glam::{DVec3, Vec3};

use super::Texel;
use crate::{LocalSpace, scene::Mesh};

/// Texels per triangle: its corners, each with a component of the unit normal; then its place in the scene and the number of its cut-outs.
pub(crate) const TRIANGLE_TEXELS: usize = 4;

/// The corners of a valid mesh's triangles, in a space of the device.
pub(crate) fn corners_of(mesh: &Mesh, space: &LocalSpace) -> Vec<[Vec3; 3]> {
    let local = |corner: u32| space.to_local(mesh.positions_m[corner as usize]).into();
    let triangles = mesh.triangles.iter();
    triangles.map(|corners| corners.map(local)).collect()
}

/// The texels of triangles in this order, for rays that need no tree.
pub(crate) fn triangle_texels_in(
    order: &[u32],
    corners: &[[Vec3; 3]],
    cutouts: &[u32],
) -> Vec<Texel> {
    let texels = order.iter().map(|&place| {
        let at = place as usize;
        triangle_texels(corners[at], [place, cutouts[at]])
    });
    texels.flatten().collect()
}

pub(super) fn triangle_texels(corners: [Vec3; 3], numbers: [u32; 2]) -> [Texel; TRIANGLE_TEXELS] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    // Computed in f64, so that the normals of slivers are right to rounding. A triangle without area has no normal and is never hit.
    let normal: DVec3 = (b - a).cross(c - a).normalize_or_zero();
    let normal = normal.as_vec3();
    let [a, b, c] = [0, 1, 2].map(|i| corners[i].extend(normal[i]).to_array());
    let [place, cutout] = numbers.map(|number| number as f32);
    [a, b, c, [place, cutout, 0.0, 0.0]]
}
