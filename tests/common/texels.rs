//! The rays through the texels of an RSM.

use camlux::emission::{EmissionDomain, EmissionFace, Projection};
use glam::DVec3;

/// Direction of the ray through the centre of texel (x, y) of a face, scaled so that its component along `forward` is 1.
pub fn texel_direction(domain: &EmissionDomain, face: &EmissionFace, x: u32, y: u32) -> DVec3 {
    match domain.projection {
        Projection::Perspective => face.forward + texel_offset(domain, face, x, y),
        Projection::Orthographic => face.forward,
    }
}

/// Where that ray starts: L, or for a directional light a point of the face.
pub fn texel_origin_m(domain: &EmissionDomain, face: &EmissionFace, x: u32, y: u32) -> DVec3 {
    match domain.projection {
        Projection::Perspective => domain.origin_m,
        Projection::Orthographic => domain.origin_m + texel_offset(domain, face, x, y),
    }
}

/// half_extent·(u·right + v·up) of a texel centre.
fn texel_offset(domain: &EmissionDomain, face: &EmissionFace, x: u32, y: u32) -> DVec3 {
    let size = f64::from(domain.size);
    let u = (2.0 * f64::from(x) + 1.0) / size - 1.0;
    let v = 1.0 - (2.0 * f64::from(y) + 1.0) / size;
    face.half_extent * (u * face.right + v * face.up)
}
