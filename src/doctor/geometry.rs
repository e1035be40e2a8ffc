//! Surfaces in corners, in one another, in the way of the camera, and thinner than anything that samples them.

use glam::{DMat3, DVec3};

use super::{
    Case, Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, largest, values},
    meshes,
    scenes::{
        COLOURED, GREY, grid, point_light, quad, room, rounded, scene_of, sphere, turned,
        two_walls, with_rays, with_sum,
    },
};
use crate::{
    Result, Scene,
    output::Layer,
    scene::{Intrinsics, Lens, Mesh, VplSum},
};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "corner_of_two_walls_down_to_a_millionth",
        hazard: "1/d² grows without bound as P and Q slide into the corner, and f32 positions lose d",
        remedy: "sums take d from one subtraction of rounded positions and divide once; rays weigh the ways to find Q against each other, so that nothing is left to grow",
        is_short: true,
        known_issue: None,
        run: corner_of_two_walls,
    },
    Case {
        name: "light_that_follows_into_the_corner",
        hazard: "VPLs, too, lie at a distance of 1e-5 of the scene's size from P, in sizes that f32 hardly tells apart",
        remedy: "positions come from the triangle and not along the ray, so that they are exact across its plane",
        is_short: true,
        known_issue: None,
        run: light_in_the_corner,
    },
    Case {
        name: "receiver_inside_the_texel_of_its_own_vpl",
        hazard: "a VPL stands for the texel that P lies in: as a point light it makes a spike, as rays it is counted twice",
        remedy: "the density of VPLs is the same function of the point for a VPL and for what a ray hits, so that the weights of both add up to 1",
        is_short: true,
        known_issue: None,
        run: inside_the_texel,
    },
    Case {
        name: "receiver_and_vpl_in_one_plane",
        hazard: "the cosine between two points of one tilted plane is rounding noise, which 1/d² blows up",
        remedy: "both cosines are taken with the same difference, so that one is positive only where the other is not",
        is_short: true,
        known_issue: None,
        run: one_plane,
    },
    Case {
        name: "receiver_at_the_vpl",
        hazard: "camera and light look from one place through one grid: P is Q, d is 0 and 0/0 is not a number",
        remedy: "P = Q has no direction and adds 0",
        is_short: false,
        known_issue: None,
        run: receiver_at_the_vpl,
    },
    Case {
        name: "wall_of_a_millimetre",
        hazard: "a depth bias that is larger than the wall lets light through",
        remedy: "no bias: what is in the way is decided by the triangles that the light sees, or by rays",
        is_short: true,
        known_issue: None,
        run: meshes::wall_of_a_millimetre,
    },
    Case {
        name: "wall_without_thickness_lit_on_one_side",
        hazard: "both sides lie at the same depth, so that a depth map cannot tell them apart",
        remedy: "normals are turned to the side that is seen, and a light behind it has no cosine",
        is_short: true,
        known_issue: None,
        run: meshes::wall_without_thickness,
    },
    Case {
        name: "slats_thinner_than_a_texel",
        hazard: "texels of a map pass between slats of 2 mm, and so do its shadows",
        remedy: "rays know no texels; VPLs are drawn where texels hit, and directions find the rest",
        is_short: false,
        known_issue: None,
        run: meshes::slats,
    },
    Case {
        name: "shadow_map_of_slats_thinner_than_a_texel",
        hazard: "a map has no texel for what is thinner than one",
        remedy: "nothing: shadow = \"rays\" is for that",
        is_short: false,
        known_issue: Some("what no texel of the map has seen throws no shadow"),
        run: meshes::shadow_map_of_slats,
    },
    Case {
        name: "meshes_that_pass_through_each_other",
        hazard: "points on one mesh inside another, and rays that start where two surfaces cross",
        remedy: "rays start off the surface by the bound of their rounding and no more",
        is_short: true,
        known_issue: None,
        run: meshes::interpenetrating,
    },
    Case {
        name: "two_meshes_in_one_place",
        hazard: "every surface twice: a ray from one of them meets the other at once",
        remedy: "rays start off the surface by more than rounding can have moved either of them",
        is_short: true,
        known_issue: None,
        run: meshes::two_meshes_in_one_place,
    },
    Case {
        name: "needles_and_triangles_without_area",
        hazard: "needles of aspect 1e6 have normals of noise, and triangles without area none at all",
        remedy: "planes come from f32 edges, a ray that misses its triangle by rounding takes the nearest point of it, and rays skip what has no area",
        is_short: true,
        known_issue: None,
        run: meshes::needles,
    },
    Case {
        name: "one_triangle_fills_the_view",
        hazard: "interpolation over a triangle of 20 km loses the metre before the camera",
        remedy: "the ray through the pixel meets the triangle's plane; attributes are not interpolated",
        is_short: true,
        known_issue: None,
        run: one_triangle,
    },
    Case {
        name: "triangle_through_the_camera",
        hazard: "the near plane cuts it, and points at depth 0 divide by 0",
        remedy: "reversed depth without a far plane; positions from the plane, clamped to the triangle's depths",
        is_short: false,
        known_issue: None,
        run: through_the_camera,
    },
    Case {
        name: "camera_on_a_surface",
        hazard: "a camera that stands on the floor sees it at a distance of 0, here and there",
        remedy: "what is at depth 0 is not drawn",
        is_short: true,
        known_issue: None,
        run: camera_on_a_surface,
    },
    Case {
        name: "views_of_a_thousandth_of_a_degree_and_of_179",
        hazard: "triangles a hundred thousand times as large as the image; pixels whose rays are 60 times as long as their depth",
        remedy: "the rasteriser decides which triangle is seen and nothing else; distances are those of P and not of the depth",
        is_short: true,
        known_issue: None,
        run: narrow_and_wide_views,
    },
    Case {
        name: "shading_normals_against_the_geometry",
        hazard: "a shading normal 60° off lights what the surface itself hides, and the other way round",
        remedy: "the shading normal is turned to the side that is seen; rays ask both normals",
        is_short: true,
        known_issue: None,
        run: shading_normals,
    },
    Case {
        name: "two_million_triangles",
        hazard: "triangles far smaller than a pixel and a texel: buffers over limits, ids that f32 cannot hold, leaks between neighbours",
        remedy: "ids below 2^24, edges that neighbours decide alike, a tree of boxes",
        is_short: false,
        known_issue: None,
        run: meshes::two_million_triangles,
    },
    Case {
        name: "two_materials_in_one_place",
        hazard: "black and white triangles in one place: which is seen is noise, and rays see another one than the camera",
        remedy: "the first of the scene is seen, by camera, light and rays",
        is_short: true,
        known_issue: None,
        run: meshes::two_materials_in_one_place,
    },
    Case {
        name: "mesh_with_t_junctions",
        hazard: "corners of small triangles on the edge of a large one, off it by rounding: light comes through the gaps",
        remedy: "gaps of 1e-7 of the scene's size, which hardly a ray finds",
        is_short: true,
        known_issue: None,
        run: meshes::t_junctions,
    },
    Case {
        name: "fan_of_three_thousand_needles",
        hazard: "one corner in three thousand triangles, in one pixel; boxes of a tree that all overlap there",
        remedy: "a pixel whose ray misses its needle by rounding takes the nearest point of it, which is not far along it",
        is_short: false,
        known_issue: None,
        run: meshes::needle_fan,
    },
    Case {
        name: "room_in_a_mirror",
        hazard: "scaled by −1, all triangles turn their backs",
        remedy: "sides are what is seen, whatever the order of corners",
        is_short: true,
        known_issue: None,
        run: meshes::room_in_a_mirror,
    },
    Case {
        name: "images_of_one_pixel_and_oblong_ones",
        hazard: "lattices, samples and workgroups that expect an image; pixels that are not square; a principal point outside",
        remedy: "every list takes any length; four focal parameters everywhere",
        is_short: true,
        known_issue: None,
        run: odd_images,
    },
    Case {
        name: "shading_normals_across_the_geometry",
        hazard: "shading normals at 90° to their triangles belong to neither side, and those at more light the back",
        remedy: "the side is that of the triangle; a light behind it is behind, whatever the shading normal says",
        is_short: true,
        known_issue: None,
        run: normals_across,
    },
    Case {
        name: "no_triangle_in_view",
        hazard: "lists without entries, dispatches of size 0, an error relative to nothing",
        remedy: "background is never gathered: it is exactly 0, at a depth of infinity",
        is_short: true,
        known_issue: None,
        run: no_triangle_in_view,
    },
    Case {
        name: "closed_box_with_camera_and_light_inside",
        hazard: "every ray starts and ends on walls: what starts behind one finds darkness",
        remedy: "a ray's start is moved towards the side that the camera sees",
        is_short: true,
        known_issue: None,
        run: closed_box,
    },
];

/// A camera that sees the corner from so far away, both in x and y.
fn corner_from(distance_m: f64, light_m: DVec3) -> Scene {
    let camera_m = distance_m * DVec3::new(1.0, 0.8, 0.0) + 0.013 * DVec3::Z;
    let look_at_m = DVec3::new(0.0, 0.0, 0.013 + 0.1 * distance_m);
    two_walls(point_light(light_m), camera_m, look_at_m)
}

/// The kernel's error does not grow: positions are those that the f64 kernels see. By rays the target holds however near.
fn corner_of_two_walls(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for distance_m in [1.0, 1e-1, 1e-3, 2e-5] {
        let scene = corner_from(distance_m, DVec3::new(0.7, 0.9, 0.11));
        let what = format!("camera at {distance_m:.0e} m");
        parts.push(examiner.sums(&what, &scene, 24, KERNEL_BOUND)?);
        parts.push(examiner.bounce(&what, &scene)?);
    }
    Ok(Measurement::of(parts))
}

fn light_in_the_corner(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for distance_m in [1e-1, 1e-3, 2e-5] {
        let light_m = distance_m * DVec3::new(0.7, 0.9, 0.1) + 0.013 * DVec3::Z;
        let scene = corner_from(distance_m, light_m);
        let what = format!("camera and light at {distance_m:.0e} m");
        // f32 keeps a place to 6e-8 of the scene's half size, 1 m, and so the distance to the light, which the f64 kernels and the
        // reference know better, to 1.2e-7/d of itself. Direct light has its square and a cosine, a VPL a cosine.
        let of_light = 1.2e-7 / distance_m;
        parts.push(examiner.direct(&what, &scene, DIRECT_BOUND + 3.0 * of_light)?);
        parts.push(examiner.sums(&what, &scene, 24, KERNEL_BOUND + of_light)?);
    }
    Ok(Measurement::of(parts))
}

/// An RSM of 2 x 2 texels a face: every receiver is inside the texel of some VPL.
fn inside_the_texel(examiner: &mut Examiner) -> Result<Measurement> {
    let scene = room();
    let mut parts = vec![examiner.sums("2 texels a face", &scene, 2, KERNEL_BOUND)?];
    // A light 5 cm from the wall: half its texels are the wall right beside it.
    let mut near = scene.clone();
    near.lights = vec![point_light(DVec3::new(0.95, 0.13, -0.1))];
    near.camera.look_at_m = DVec3::new(1.0, 0.1, -0.1);
    parts.push(examiner.bounce("light 5 cm from a wall", &near)?);
    Ok(Measurement::of(parts))
}

/// No point of a plane sees another. The normals of its triangles, though, are apart by the rounding of their corners.
fn one_plane(examiner: &mut Examiner) -> Result<Measurement> {
    let up = DVec3::new(0.31, 0.87, -0.22).normalize();
    let along = up.any_orthonormal_vector();
    let across = up.cross(along);
    let plane = [-along - across, 2.0 * along, 2.0 * across];
    let mesh = grid("plane", plane, [3, 5], GREY);
    let scene = scene_of(vec![mesh], point_light(0.3 * up), 1.5 * up, 0.1 * along);
    no_indirect_light(examiner, &scene, 1e-7)
}

/// Share of the direct light that the largest indirect value is, by every way of computing it. By rays it is exactly 0.
pub(super) fn no_indirect_light(
    examiner: &mut Examiner,
    scene: &Scene,
    bound_of_sums: f64,
) -> Result<Measurement> {
    let ways = [
        (
            "rsm-average",
            with_sum(scene, VplSum::RsmAverage, 48),
            bound_of_sums,
        ),
        (
            "instant-radiosity",
            with_sum(scene, VplSum::InstantRadiosity, 48),
            bound_of_sums,
        ),
        ("final-gather", with_rays(scene, 0.1), 0.0),
    ];
    let mut parts = Vec::new();
    for (what, scene, bound) in ways {
        let frame = examiner.render(&scene)?;
        let direct = largest(values(&frame, Layer::Direct));
        let share = largest(values(&frame, Layer::Indirect)) / direct;
        parts.push(Measurement::new(
            format!("{what}, share of direct light"),
            share,
            bound,
        ));
    }
    Ok(Measurement::of(parts))
}

/// A camera of 90° in the place of a point light, its pixels the texels of the light's face: in a room of flat walls, and in a
/// ball whose shading normals differ between two roundings of one point.
fn receiver_at_the_vpl(examiner: &mut Examiner) -> Result<Measurement> {
    let eye_m = DVec3::new(0.1, 0.2, 0.3);
    let ball = rounded(sphere(DVec3::ZERO, 1.0, 6, COLOURED), DVec3::ZERO);
    let mut parts = Vec::new();
    let room = room().meshes.iter().map(|mesh| Mesh::clone(mesh)).collect();
    for (what, meshes) in [("room", room), ("ball", vec![ball])] {
        let mut scene = scene_of(meshes, point_light(eye_m), eye_m, eye_m + DVec3::X);
        scene.camera.lens = Lens::FovY { fov_y_deg: 90.0 };
        parts.push(examiner.sums(what, &scene, 24, KERNEL_BOUND)?);
        parts.push(examiner.bounce(what, &scene)?);
    }
    Ok(Measurement::of(parts))
}

fn camera_on_a_surface(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.camera.position_m = DVec3::new(0.3, -1.0, 0.9);
    scene.camera.look_at_m = DVec3::new(0.0, -0.4, -0.5);
    examiner.all("", &scene, 24)
}

fn narrow_and_wide_views(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for fov_y_deg in [0.001, 179.0] {
        let mut scene = room();
        scene.camera.lens = Lens::FovY { fov_y_deg };
        parts.push(examiner.all(&format!("{fov_y_deg}°"), &scene, 24)?);
    }
    Ok(Measurement::of(parts))
}

/// A triangle of 20 km, 1 m below camera and light. f32 keeps places on it to 0.6 mm: 6e-8 of its half size.
fn one_triangle(examiner: &mut Examiner) -> Result<Measurement> {
    let corners = [[-1e4, 0.0, -1e4], [1.5e4, 0.0, -2e3], [-2e3, 0.0, 1.5e4]];
    let mesh = Mesh::from_slices("ground", &corners, &[[0, 1, 2]], GREY);
    let eye_m = DVec3::new(0.3, 1.0, 0.2);
    let scene = scene_of(
        vec![mesh],
        point_light(DVec3::new(0.0, 1.2, 0.0)),
        eye_m,
        DVec3::ZERO,
    );
    Ok(Measurement::of([
        // Twice a share of 1 mm in 1.2 m.
        examiner.direct("ground of 20 km, 1 m away", &scene, 2e-3)?,
        // One plane, as in `receiver_and_vpl_in_one_plane`.
        no_indirect_light(examiner, &scene, 1e-7)?,
    ]))
}

/// Sheets from behind the camera to before it, which pass it at a millimetre, or in which it lies: then they are not seen.
fn through_the_camera(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let eye_m = scene.camera.position_m;
    let view = (scene.camera.look_at_m - eye_m).normalize();
    let right = view.cross(DVec3::Y).normalize();
    let slanted = (view + right.cross(view)).normalize();
    let mut parts = Vec::new();
    for (what, along) in [("edge-on", view), ("at 45°", slanted)] {
        for beside_m in [0.0, 0.001] {
            let corner = eye_m - 0.5 * along - 0.25 * right - beside_m * right.cross(along);
            scene.meshes.truncate(3);
            scene
                .meshes
                .push(quad("sheet", corner, 0.9 * along, 0.6 * right, COLOURED).into());
            let what = format!("{what}, {} mm beside", 1e3 * beside_m);
            parts.push(examiner.sums(&what, &scene, 24, KERNEL_BOUND)?);
            parts.push(examiner.direct(&what, &scene, DIRECT_BOUND)?);
            parts.push(examiner.bounce(&what, &scene)?);
        }
    }
    Ok(Measurement::of(parts))
}

/// Normals that lean up to 60° from those of the triangles, otherwise in each corner.
fn shading_normals(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    for (index, mesh) in scene.meshes.iter_mut().enumerate() {
        let centre_m = mesh.positions_m.iter().sum::<DVec3>() / mesh.positions_m.len() as f64;
        let lean = DVec3::new(0.7, -0.3, 0.5) * (1.0 + index as f64);
        *mesh = rounded(Mesh::clone(mesh), centre_m).into();
        for (i, normal) in mesh.normals.iter_mut().enumerate() {
            *normal = (*normal + 0.5 * lean * ((i % 3) as f64 - 1.0)).normalize();
        }
    }
    let mut parts = vec![examiner.all("room", &scene, 24)?];
    // The same normals all turned inside out: the sides that are seen are what counts.
    for normal in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.normals) {
        *normal = -*normal;
    }
    parts.push(examiner.all("room inside out", &scene, 24)?);
    Ok(Measurement::of(parts))
}

/// On the floor, at right angles to its triangles and beyond.
fn normals_across(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for (what, height) in [("90°", 0.0), ("91°", -0.0175), ("100°", -0.176)] {
        let mut scene = room();
        let floor = grid(
            "floor",
            [
                DVec3::new(-1.0, -0.99, -1.0),
                2.0 * DVec3::Z,
                2.0 * DVec3::X,
            ],
            [4, 4],
            GREY,
        );
        let normals = (0..floor.positions_m.len()).map(|i| {
            let turn = 0.7 * i as f64;
            DVec3::new(turn.cos(), height, turn.sin())
        });
        scene.meshes.push(
            Mesh {
                normals: normals.collect(),
                ..floor
            }
            .into(),
        );
        parts.push(examiner.all(what, &scene, 24)?);
    }
    Ok(Measurement::of(parts))
}

/// One pixel, rows and columns of them, and pixels four times as high as wide whose principal point lies beside the image.
fn odd_images(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    for resolution_px in [[1, 1], [67, 1], [1, 67]] {
        let mut scene = room();
        scene.camera.resolution_px = resolution_px;
        scene.camera.lens = Lens::Intrinsics(Intrinsics {
            fx: 20.0,
            fy: 20.0,
            cx: 0.4 * f64::from(resolution_px[0]),
            cy: 0.6 * f64::from(resolution_px[1]),
        });
        let [width, height] = resolution_px;
        parts.push(examiner.all(&format!("{width} x {height}"), &scene, 24)?);
    }
    let mut scene = room();
    scene.camera.lens = Lens::Intrinsics(Intrinsics {
        fx: 60.0,
        fy: 15.0,
        cx: -30.0,
        cy: 9.0,
    });
    parts.push(examiner.all("oblong pixels", &scene, 24)?);
    Ok(Measurement::of(parts))
}

fn no_triangle_in_view(examiner: &mut Examiner) -> Result<Measurement> {
    let mut parts = Vec::new();
    let mut away = room();
    away.camera.position_m = DVec3::new(0.0, 0.0, 5.0);
    away.camera.look_at_m = DVec3::new(0.0, 0.0, 9.0);
    let nothing = Scene {
        meshes: Vec::new(),
        ..away.clone()
    };
    let mut point = room();
    for position in point
        .meshes
        .iter_mut()
        .flat_map(|mesh| &mut mesh.positions_m)
    {
        *position = DVec3::new(0.1, -0.2, 0.1);
    }
    for (what, scene) in [
        ("camera turned away", away),
        ("no mesh at all", nothing),
        ("all triangles in one point", point),
    ] {
        let ways = [
            with_sum(&scene, VplSum::RsmAverage, 16),
            with_sum(&scene, VplSum::InstantRadiosity, 16),
            with_rays(&scene, 0.1),
        ];
        for scene in ways {
            let frame = examiner.render(&scene)?;
            let radiance = largest(values(&frame, Layer::Radiance));
            let is_far = values(&frame, Layer::Depth)
                .iter()
                .all(|&d| d == f32::INFINITY);
            let error = if is_far { radiance } else { f64::INFINITY };
            parts.push(Measurement::new(format!("{what}, radiance"), error, 0.0));
        }
    }
    Ok(Measurement::of(parts))
}

fn closed_box(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.meshes.truncate(1);
    let mut parts = vec![examiner.all("empty room", &scene, 24)?];
    // Turned, so that no wall lies along an axis of the light's cube.
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, 0.5, 0.8).normalize(), 0.7);
    let turned = turned(&scene, turn);
    parts.push(examiner.all("turned room", &turned, 24)?);
    Ok(Measurement::of(parts))
}
