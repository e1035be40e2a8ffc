//! Surfaces in corners, inside one another, at the camera, and thinner than any sampling step.

use glam::{DMat3, DVec3, dvec3};

use super::{
    Case, Examiner,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, largest, values},
    meshes::{self, room_with_slats},
    scenes::{
        COLOURED, GREY, empty_room, grid, lit_by, point_light, quad, room, rounded, scene_of,
        sphere, turned, two_walls, with_each_estimator,
    },
};
use crate::{
    Result, Scene,
    output::Layer,
    scene::{Intrinsics, Lens, Mesh},
};

pub const CASES: &[Case] = &[
    Case::new(
        "corner_of_two_walls_down_to_a_millionth",
        "1/d² grows without bound as P and Q approach the corner, and f32 positions lose the digits of d",
        "sums subtract the rounded positions once and divide once; rays weight the techniques that find Q against each other, so no term grows",
        corner_of_two_walls,
    ),
    Case::new(
        "light_that_follows_into_the_corner",
        "VPLs, too, are 1e-5 of the scene's size away from P, which f32 hardly resolves",
        "positions come from the triangle, not from the ray, so they are exact across its plane",
        light_in_the_corner,
    ),
    Case::new(
        "receiver_inside_the_texel_of_its_own_vpl",
        "a VPL stands for the texel that contains P: as a point light it makes a spike, with rays it is counted twice",
        "the density of VPLs is the same function of the point for a VPL and for a ray's hit, so the weights of both add up to 1",
        inside_the_texel,
    ),
    Case::new(
        "receiver_and_vpl_in_one_plane",
        "the cosine between two points of one tilted plane is rounding noise, which 1/d² amplifies",
        "both cosines use the same difference, so one is positive only where the other is not",
        one_plane,
    ),
    Case::new(
        "receiver_at_the_vpl",
        "camera and light are in one place and use one grid: P = Q, d = 0, and 0/0 is not a number",
        "P = Q has no direction and adds 0",
        receiver_at_the_vpl,
    )
    .long(),
    Case::new(
        "wall_of_a_millimetre",
        "a depth bias larger than the wall lets light through",
        "no bias: the triangles that the light sees decide what is in the way, or rays do",
        meshes::wall_of_a_millimetre,
    ),
    Case::new(
        "wall_without_thickness_lit_on_one_side",
        "both sides are at the same depth, so a depth map cannot tell them apart",
        "normals are turned to the visible side, and a light behind that side adds 0",
        meshes::wall_without_thickness,
    ),
    Case::new(
        "slats_thinner_than_a_texel",
        "the texels of a map pass between slats of 2 mm, and so do its shadows",
        "rays do not depend on texels; VPLs are sampled where texels hit, and sampled directions find the rest",
        |exam| exam.by_rays("40 slats of 2 mm", &room_with_slats(), DIRECT_BOUND),
    )
    .long(),
    Case::new(
        "shadow_map_of_slats_thinner_than_a_texel",
        "a map has no texel for objects thinner than a texel",
        "nothing: use shadow = \"rays\"",
        |exam| exam.direct_by_map("40 slats of 2 mm", &room_with_slats(), DIRECT_BOUND),
    )
    .long()
    .with_known_issue("an object that no texel of the map has seen throws no shadow"),
    Case::new(
        "meshes_that_pass_through_each_other",
        "points of one mesh are inside another, and rays start where two surfaces cross",
        "rays start off the surface by the bound of their rounding error and no more",
        meshes::interpenetrating,
    ),
    Case::new(
        "two_meshes_in_one_place",
        "every surface exists twice: a ray from one copy hits the other at once",
        "rays start off the surface by more than rounding can move either copy",
        meshes::two_meshes_in_one_place,
    ),
    Case::new(
        "needles_and_triangles_without_area",
        "needles of aspect 1e6 have noisy normals, and triangles without area have none",
        "planes come from f32 edges; a ray that misses its triangle by rounding uses the triangle's nearest point; rays skip triangles without area",
        meshes::needles,
    ),
    Case::new(
        "one_triangle_fills_the_view",
        "interpolation over a triangle of 20 km loses the metre in front of the camera",
        "the pixel's ray is intersected with the triangle's plane; attributes are not interpolated",
        one_triangle,
    ),
    Case::new(
        "triangle_through_the_camera",
        "the near plane cuts it, and points at depth 0 divide by 0",
        "reversed depth without a far plane; positions come from the plane, clamped to the triangle's depths",
        through_the_camera,
    )
    .long(),
    Case::new(
        "camera_on_a_surface",
        "a camera on the floor sees it at distance 0 in some pixels",
        "surfaces at depth 0 are not drawn",
        camera_on_a_surface,
    ),
    Case::new(
        "views_of_a_thousandth_of_a_degree_and_of_179",
        "triangles a hundred thousand times as large as the image; pixels whose rays are 60 times as long as their depth",
        "the rasteriser decides only which triangle is visible; distances are measured to P, not taken from the depth",
        narrow_and_wide_views,
    ),
    Case::new(
        "shading_normals_against_the_geometry",
        "a shading normal 60° off lights what the surface itself hides, and the reverse",
        "the shading normal is turned to the visible side; rays test both normals",
        shading_normals,
    ),
    Case::new(
        "two_million_triangles",
        "triangles far smaller than a pixel or a texel: buffers over limits, ids that f32 cannot hold, leaks between neighbours",
        "ids are below 2^24, edge tests agree between neighbours, and rays use a ray tree (BVH)",
        meshes::two_million_triangles,
    )
    .long(),
    Case::new(
        "two_materials_in_one_place",
        "black and white triangles in one place: noise decides which is visible, and rays hit another one than the camera sees",
        "camera, light and rays all see the first one in the scene",
        meshes::two_materials_in_one_place,
    ),
    Case::new(
        "mesh_with_t_junctions",
        "rounding moves corners of small triangles off the edge of a large one, and light comes through the gaps",
        "the gaps are 1e-7 of the scene's size, and hardly any ray finds one",
        meshes::t_junctions,
    ),
    Case::new(
        "fan_of_three_thousand_needles",
        "three thousand triangles share one corner, in one pixel; all boxes of the ray tree overlap there",
        "a pixel whose ray misses its needle by rounding uses the needle's nearest point, which is not far along it",
        meshes::needle_fan,
    )
    .long(),
    Case::new(
        "room_in_a_mirror",
        "scaling by −1 turns all triangles back to front",
        "the visible side counts, whatever the order of corners",
        meshes::room_in_a_mirror,
    ),
    Case::new(
        "images_of_one_pixel_and_oblong_ones",
        "lattices, samples and workgroups that assume many rows and columns; pixels that are not square; a principal point outside the image",
        "every list takes any length; all code uses the four focal parameters",
        odd_images,
    ),
    Case::new(
        "shading_normals_across_the_geometry",
        "shading normals at 90° to their triangles belong to neither side, and those beyond 90° light the back",
        "the triangle decides the side; a light behind it adds 0, whatever the shading normal",
        normals_across,
    ),
    Case::new(
        "no_triangle_in_view",
        "lists without entries, dispatches of size 0, an error relative to nothing",
        "the background is never gathered: it is exactly 0, at an infinite depth",
        no_triangle_in_view,
    ),
    Case::new(
        "closed_box_with_camera_and_light_inside",
        "every ray starts and ends on walls, and a ray that starts behind one finds darkness",
        "a ray's start is moved towards the side that the camera sees",
        closed_box,
    ),
];

/// A camera at this distance from the corner in x and y.
fn corner_from(distance_m: f64, light_m: DVec3) -> Scene {
    let camera_m = distance_m * dvec3(1.0, 0.8, 0.0) + 0.013 * DVec3::Z;
    let look_at_m = dvec3(0.0, 0.0, 0.013 + 0.1 * distance_m);
    two_walls(point_light(light_m), camera_m, look_at_m)
}

/// The kernel's error does not grow, because the f64 kernels see the same positions. With rays, the target error is met at any distance.
fn corner_of_two_walls(exam: &mut Examiner) -> Result<()> {
    for distance_m in [1.0, 1e-1, 1e-3, 2e-5] {
        let scene = corner_from(distance_m, dvec3(0.7, 0.9, 0.11));
        let what = format!("camera at {distance_m:.0e} m");
        exam.sums(&what, &scene, 24, KERNEL_BOUND)?;
        exam.bounce(&what, &scene)?;
    }
    Ok(())
}

fn light_in_the_corner(exam: &mut Examiner) -> Result<()> {
    for distance_m in [1e-1, 1e-3, 2e-5] {
        let light_m = distance_m * dvec3(0.7, 0.9, 0.1) + 0.013 * DVec3::Z;
        let scene = corner_from(distance_m, light_m);
        let what = format!("camera and light at {distance_m:.0e} m");
        // f32 keeps a position to 6e-8 of the scene's half size, 1 m. The distance to the light, which the f64 kernels and the reference
        // know better, has a relative error of 1.2e-7/d. Direct light has its square and a cosine, a VPL one cosine.
        let of_light = 1.2e-7 / distance_m;
        exam.direct(&what, &scene, DIRECT_BOUND + 3.0 * of_light)?;
        exam.sums(&what, &scene, 24, KERNEL_BOUND + of_light)?;
    }
    Ok(())
}

/// An RSM of 2 x 2 texels per face: every receiver is inside the texel of some VPL.
fn inside_the_texel(exam: &mut Examiner) -> Result<()> {
    exam.sums("2 texels a face", &room(), 2, KERNEL_BOUND)?;
    // A light 5 cm from the wall: half of its texels are on that wall.
    let mut near = lit_by(&room(), vec![point_light(dvec3(0.95, 0.13, -0.1))]);
    near.camera.look_at_m = dvec3(1.0, 0.1, -0.1);
    exam.bounce("light 5 cm from a wall", &near)
}

/// No point of a plane sees another one. The normals of its triangles differ, however, because their corners are rounded.
fn one_plane(exam: &mut Examiner) -> Result<()> {
    let up = dvec3(0.31, 0.87, -0.22).normalize();
    let along = up.any_orthonormal_vector();
    let across = up.cross(along);
    let plane = [-along - across, 2.0 * along, 2.0 * across];
    let mesh = grid("plane", plane, [3, 5], GREY);
    let scene = scene_of(vec![mesh], point_light(0.3 * up), 1.5 * up, 0.1 * along);
    no_indirect_light(exam, "plane", &scene, 1e-7)
}

/// The largest indirect value divided by the largest direct one, for each estimator. With rays it is exactly 0.
pub(super) fn no_indirect_light(
    exam: &mut Examiner,
    what: &str,
    scene: &Scene,
    bound_of_sums: f64,
) -> Result<()> {
    for (estimator, scene) in with_each_estimator(scene, 48, 0.1) {
        let frame = exam.render(&scene)?;
        let [direct, indirect] =
            [Layer::Direct, Layer::Indirect].map(|layer| largest(values(&frame, layer)));
        let is_sum = estimator != "final-gather";
        let bound = if is_sum { bound_of_sums } else { 0.0 };
        let what = format!("{what}, {estimator}");
        exam.record(&what, "share of direct light", indirect / direct, bound);
    }
    Ok(())
}

/// A camera of 90° at the position of a point light; its pixels are the texels of the light's face. Once in a room of flat walls, and once
/// in a ball whose shading normals differ between two roundings of one point.
fn receiver_at_the_vpl(exam: &mut Examiner) -> Result<()> {
    let eye_m = dvec3(0.1, 0.2, 0.3);
    let ball = rounded(sphere(DVec3::ZERO, 1.0, 6, COLOURED), DVec3::ZERO);
    for (what, meshes) in [("room", room().meshes), ("ball", vec![ball.into()])] {
        let mut scene = scene_of(vec![], point_light(eye_m), eye_m, eye_m + DVec3::X);
        scene.meshes = meshes;
        scene.camera.lens = Lens::FovY { fov_y_deg: 90.0 };
        exam.sums(what, &scene, 24, KERNEL_BOUND)?;
        exam.bounce(what, &scene)?;
    }
    Ok(())
}

fn camera_on_a_surface(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    scene.camera.position_m = dvec3(0.3, -1.0, 0.9);
    scene.camera.look_at_m = dvec3(0.0, -0.4, -0.5);
    exam.all("", &scene)
}

fn narrow_and_wide_views(exam: &mut Examiner) -> Result<()> {
    for fov_y_deg in [0.001, 179.0] {
        let mut scene = room();
        scene.camera.lens = Lens::FovY { fov_y_deg };
        exam.all(&format!("{fov_y_deg}°"), &scene)?;
    }
    Ok(())
}

/// A triangle of 20 km, 1 m below camera and light. f32 keeps positions on it to 0.6 mm: 6e-8 of its half size.
fn one_triangle(exam: &mut Examiner) -> Result<()> {
    let corners = [[-1e4, 0.0, -1e4], [1.5e4, 0.0, -2e3], [-2e3, 0.0, 1.5e4]];
    let ground = Mesh::from_slices("ground", &corners, &[[0, 1, 2]], GREY);
    let light = point_light(dvec3(0.0, 1.2, 0.0));
    let scene = scene_of(vec![ground], light, dvec3(0.3, 1.0, 0.2), DVec3::ZERO);
    // Twice the relative error of 1 mm in 1.2 m.
    exam.direct("ground of 20 km, 1 m away", &scene, 2e-3)?;
    // One plane, as in `receiver_and_vpl_in_one_plane`.
    no_indirect_light(exam, "ground", &scene, 1e-7)
}

/// Sheets that reach from behind the camera to the front of it. They pass the camera at a distance of a millimetre, or contain it and are
/// then invisible.
fn through_the_camera(exam: &mut Examiner) -> Result<()> {
    let eye_m = room().camera.position_m;
    let view = (room().camera.look_at_m - eye_m).normalize();
    let right = view.cross(DVec3::Y).normalize();
    let slanted = (view + right.cross(view)).normalize();
    for (what, along) in [("edge-on", view), ("at 45°", slanted)] {
        for beside_m in [0.0, 0.001] {
            let corner = eye_m - 0.5 * along - 0.25 * right - beside_m * right.cross(along);
            let sheet = quad("sheet", corner, 0.9 * along, 0.6 * right, COLOURED);
            let mut scene = room();
            scene.meshes.push(sheet.into());
            let what = format!("{what}, {} mm beside", 1e3 * beside_m);
            exam.by_rays(&what, &scene, DIRECT_BOUND)?;
        }
    }
    Ok(())
}

/// Normals that lean up to 60° from those of the triangles, differently in each corner.
fn shading_normals(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    for (index, mesh) in scene.meshes.iter_mut().enumerate() {
        let centre_m = mesh.positions_m.iter().sum::<DVec3>() / mesh.positions_m.len() as f64;
        let lean = dvec3(0.7, -0.3, 0.5) * (1.0 + index as f64);
        *mesh = rounded(Mesh::clone(mesh), centre_m).into();
        for (i, normal) in mesh.normals.iter_mut().enumerate() {
            *normal = (*normal + 0.5 * lean * ((i % 3) as f64 - 1.0)).normalize();
        }
    }
    exam.all("room", &scene)?;
    // The same normals, all turned inside out: only the visible side of a surface counts.
    for normal in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.normals) {
        *normal = -*normal;
    }
    exam.all("room inside out", &scene)
}

/// Shading normals of the floor at right angles to its triangles, and beyond.
fn normals_across(exam: &mut Examiner) -> Result<()> {
    let plane = [dvec3(-1.0, -0.99, -1.0), 2.0 * DVec3::Z, 2.0 * DVec3::X];
    for (what, height) in [("90°", 0.0), ("91°", -0.0175), ("100°", -0.176)] {
        let mut floor = grid("floor", plane, [4, 4], GREY);
        let turns = (0..floor.positions_m.len()).map(|i| 0.7 * i as f64);
        floor.normals = turns
            .map(|turn| dvec3(turn.cos(), height, turn.sin()))
            .collect();
        let mut scene = room();
        scene.meshes.push(floor.into());
        exam.all(what, &scene)?;
    }
    Ok(())
}

/// One pixel, single rows and columns of pixels, and pixels four times as high as wide with a principal point outside the image.
fn odd_images(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    for resolution_px in [[1, 1], [67, 1], [1, 67]] {
        let [width, height] = resolution_px;
        scene.camera.resolution_px = resolution_px;
        scene.camera.lens = Lens::Intrinsics(Intrinsics {
            fx: 20.0,
            fy: 20.0,
            cx: 0.4 * f64::from(width),
            cy: 0.6 * f64::from(height),
            skew: 0.0,
        });
        exam.all(&format!("{width} x {height}"), &scene)?;
    }
    let mut scene = room();
    scene.camera.lens = Lens::Intrinsics(Intrinsics {
        fx: 60.0,
        fy: 15.0,
        cx: -30.0,
        cy: 9.0,
        skew: 0.0,
    });
    exam.all("oblong pixels", &scene)
}

fn no_triangle_in_view(exam: &mut Examiner) -> Result<()> {
    let mut away = room();
    away.camera.position_m = dvec3(0.0, 0.0, 5.0);
    away.camera.look_at_m = dvec3(0.0, 0.0, 9.0);
    let mut nothing = away.clone();
    nothing.meshes.clear();
    let mut point = room();
    for mesh in &mut point.meshes {
        mesh.positions_m.fill(dvec3(0.1, -0.2, 0.1));
    }
    for (what, scene) in [
        ("camera turned away", away),
        ("no mesh at all", nothing),
        ("all triangles in one point", point),
    ] {
        for (_, scene) in with_each_estimator(&scene, 16, 0.1) {
            let frame = exam.render(&scene)?;
            let depths = values(&frame, Layer::Depth);
            let error = if depths.iter().all(|&depth| depth == f32::INFINITY) {
                largest(values(&frame, Layer::Radiance))
            } else {
                f64::INFINITY
            };
            exam.record(what, "radiance", error, 0.0);
        }
    }
    Ok(())
}

fn closed_box(exam: &mut Examiner) -> Result<()> {
    exam.all("empty room", &empty_room())?;
    // Turned, so that no wall is parallel to an axis of the light's cube.
    let turn = DMat3::from_axis_angle(dvec3(0.3, 0.5, 0.8).normalize(), 0.7);
    exam.all("turned room", &turned(&empty_room(), turn))
}
