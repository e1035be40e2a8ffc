//! Cameras and lights as views that the rasteriser draws.

use glam::{DVec2, DVec3};

use crate::{
    emission::{EmissionDomain, EmissionFace, Projection},
    local_space::LocalSpace,
    scene::{Camera, CameraBasis, Intrinsics},
    vulkan::shaders::View,
};

/// Distance of the near plane, local units. With reversed depth, such a small distance costs no precision.
const NEAR: f32 = 1.0 / (1 << 20) as f32;

/// The camera's view: C, and a ray through each pixel at this offset from its centre.
pub(crate) fn of_camera(camera: &Camera, space: &LocalSpace, offset_px: DVec2) -> View {
    let [width, height] = camera.resolution_px.map(f64::from);
    let intrinsics = camera.intrinsics_px();
    let basis = camera.basis();
    let (fx, fy, skew) = (intrinsics.fx, intrinsics.fy, intrinsics.skew);
    let (cx, cy) = (intrinsics.cx - offset_px.x, intrinsics.cy - offset_px.y);
    if camera.is_orthographic() {
        return parallel_camera(camera, space, offset_px);
    }
    let row_x = basis.right * (2.0 * fx / width)
        + basis.down * (2.0 * skew / width)
        + basis.forward * (2.0 * cx / width - 1.0);
    let row_y = basis.down * (2.0 * fy / height) + basis.forward * (2.0 * cy / height - 1.0);
    // If the lens distorts the image, its rays are listed in these axes.
    let ray_direction = match camera.distortion() {
        Some(_) => [basis.forward, basis.right, basis.down],
        None => [
            basis.forward - basis.right * ((cx - skew * cy / fy) / fx) - basis.down * (cy / fy),
            basis.right / fx,
            basis.down / fy - basis.right * (skew / fx / fy),
        ],
    };
    View {
        clip_from_offset: perspective(row_x, row_y, basis.forward),
        origin: space.to_local(camera.position_m),
        forward: basis.forward.as_vec3().to_array(),
        ray_direction: columns(ray_direction),
        ..View::default()
    }
}

/// The same of an orthographic camera.
fn parallel_camera(camera: &Camera, space: &LocalSpace, offset_px: DVec2) -> View {
    let CameraBasis {
        right,
        down,
        forward,
    } = camera.basis();
    let Intrinsics { fx, fy, cx, cy, .. } = camera.intrinsics_px();
    let [column, row] = [space.length(1.0 / fx), space.length(1.0 / fy)];
    let [cx, cy] = [cx - offset_px.x, cy - offset_px.y];
    let [width, height] = camera.resolution_px.map(f64::from);
    // The scene is within a radius of √3 around the local origin. Rays from farther away begin there, where f32 keeps their digits. A little
    // farther, because surfaces at depth 0 are not drawn.
    let radius = 1.75;
    let position = (camera.position_m - space.origin_m) / space.metres_per_unit;
    let along = forward.dot(position);
    let start = along.max(-radius);
    // All of a scene that is behind the camera is clipped.
    let range = (radius - start).max(f64::from(NEAR));
    let [at_x, at_y] = [2.0 * cx / width - 1.0, 2.0 * cy / height - 1.0].map(|at| at as f32);
    View {
        clip_from_offset: columns_of_rows(
            [
                right * (2.0 / (column * width)),
                down * (2.0 / (row * height)),
                -forward / range,
                DVec3::ZERO,
            ],
            [at_x, at_y, 1.0, 1.0],
        ),
        origin: (position + (start - along) * forward).as_vec3().to_array(),
        forward: forward.as_vec3().to_array(),
        ray_offset: columns([
            -right * (cx * column) - down * (cy * row),
            right * column,
            down * row,
        ]),
        ray_direction: columns([forward, DVec3::ZERO, DVec3::ZERO]),
        is_parallel: 1,
        ..View::default()
    }
}

/// The view of one face of a light's map of `size`² texels.
pub(crate) fn of_light_face(
    domain: &EmissionDomain,
    face_index: usize,
    size: u32,
    space: &LocalSpace,
) -> View {
    let EmissionFace {
        right,
        up,
        forward,
        half_extent,
    } = domain.faces[face_index];
    let step = 2.0 / f64::from(size);
    let common = View {
        origin: space.to_local(domain.origin_m),
        forward: forward.as_vec3().to_array(),
        first_texel: face_index as u32 * size * size,
        size_px: size,
        ..View::default()
    };
    match domain.projection {
        Projection::Perspective => View {
            clip_from_offset: perspective(right / half_extent, -up / half_extent, forward),
            ray_direction: columns([
                forward + half_extent * (up - right),
                half_extent * step * right,
                -half_extent * step * up,
            ]),
            ..common
        },
        Projection::Orthographic => {
            let half_extent = space.length(half_extent);
            // A little farther than the scene, because surfaces at depth 0 are not drawn.
            let range = 1.001 * space.length(domain.depth_range_m);
            View {
                clip_from_offset: columns_of_rows(
                    [
                        right / half_extent,
                        -up / half_extent,
                        -forward / range,
                        DVec3::ZERO,
                    ],
                    [0.0, 0.0, 1.0, 1.0],
                ),
                ray_offset: columns([
                    half_extent * (up - right),
                    half_extent * step * right,
                    -half_extent * step * up,
                ]),
                ray_direction: columns([forward, DVec3::ZERO, DVec3::ZERO]),
                is_parallel: 1,
                ..common
            }
        }
    }
}

/// clip = (row_x·o, row_y·o, near, forward·o): depth runs from 1 at the near plane to 0 at infinity.
fn perspective(row_x: DVec3, row_y: DVec3, forward: DVec3) -> [[f32; 4]; 4] {
    columns_of_rows([row_x, row_y, DVec3::ZERO, forward], [0.0, 0.0, NEAR, 0.0])
}

fn columns_of_rows(rows: [DVec3; 4], constants: [f32; 4]) -> [[f32; 4]; 4] {
    let column = |axis: usize| rows.map(|row| row[axis] as f32);
    [column(0), column(1), column(2), constants]
}

fn columns(columns: [DVec3; 3]) -> [[f32; 4]; 3] {
    columns.map(|column| column.extend(0.0).as_vec4().to_array())
}
