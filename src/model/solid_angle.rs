//! Solid angles of flat shapes.

use glam::DVec3;

/// Solid angle in sr of the triangle a, b, c seen from the origin (van Oosterom & Strackee 1983).
///
/// The triple product uses the triangle's edges, which keeps the relative accuracy of small triangles. The triple product of three nearly
/// parallel vectors would cancel.
pub fn triangle_solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (a_length, b_length, c_length) = (a.length(), b.length(), c.length());
    let triple = a.dot((b - a).cross(c - a)).abs();
    let denominator = a_length * b_length * c_length
        + a.dot(b) * c_length
        + b.dot(c) * a_length
        + c.dot(a) * b_length;
    2.0 * triple.atan2(denominator)
}

/// Solid angle in sr of the rectangle [u0, u1]×[v0, v1] in the plane at distance 1 from the origin.
pub fn rectangle_solid_angle([u0, u1]: [f64; 2], [v0, v1]: [f64; 2]) -> f64 {
    let [a, b, c, d] = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| DVec3::new(u, v, 1.0));
    triangle_solid_angle(a, b, c) + triangle_solid_angle(a, c, d)
}
