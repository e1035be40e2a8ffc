//! Meshes placed in the world, so that their fronts and their normal maps stay as they are on the mesh.

use glam::{DMat3, DVec3};

use crate::scene::{Instance, Mesh, Shared};

/// The instance's mesh in world space.
pub fn placed(instance: &Instance) -> Shared<Mesh> {
    if instance.is_in_world_space() {
        return instance.mesh.clone();
    }
    let mut mesh = Mesh::clone(&instance.mesh);
    for position_m in &mut mesh.positions_m {
        *position_m = instance.to_world.transform_point3(*position_m);
    }
    let linear = instance.to_world.matrix3;
    let largest = linear
        .to_cols_array()
        .into_iter()
        .fold(0.0, |most, value| f64::max(most, value.abs()));
    // The scale matters neither to normals nor to tangents. Without it, products of small numbers would be 0.
    let linear = if largest > 0.0 {
        linear * largest.recip()
    } else {
        linear
    };
    let is_mirrored = linear.determinant() < 0.0;
    let side = if is_mirrored { -1.0 } else { 1.0 };
    // Two edges of a surface go to L·a and L·b, and (L·a) × (L·b) = cof(L)·(a × b), which a mirror turns to the back.
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = linear;
    let cofactors = side * DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    for normal in &mut mesh.normals {
        let short = *normal / normal.abs().max_element();
        *normal = (cofactors * short).normalize_or(DVec3::Z);
    }
    for [tx, ty, tz, sign] in &mut mesh.tangents {
        let tangent = linear * DVec3::new((*tx).into(), (*ty).into(), (*tz).into());
        [*tx, *ty, *tz] = tangent.as_vec3().to_array();
        // Normal × tangent does not follow a mirror, as v does.
        *sign *= side as f32;
    }
    if is_mirrored {
        for [_, b, c] in &mut mesh.triangles {
            std::mem::swap(b, c);
        }
    }
    mesh.into()
}
