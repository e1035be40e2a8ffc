//! Changes to an existing scene: many poses at once, and parts hidden, removed or replaced. Each frame equals that of a scene which was
//! built in the changed state.

use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::{
    capi::*,
    glam::{DQuat, DVec3},
    scene::{Encoding, Light, Mesh, Texels},
};

/// The Cornell box with two small cards and a second light.
fn room() -> camlux::Scene {
    let mut scene = engine_scene("cornell", [24, 20]);
    for (name, x_m) in [("left card", -0.5), ("right card", 0.4)] {
        let corners_m = [[0.0, 0.5], [0.25, 0.5], [0.25, 0.75], [0.0, 0.75]];
        let corners_m = corners_m.map(|[x, y]| [x + x_m, y, 0.5]);
        let card = Mesh::from_slices(name, &corners_m, &[[0, 1, 2], [0, 2, 3]], 1);
        scene.meshes.push(card.into());
    }
    scene
        .lights
        .push(Light::point(DVec3::new(0.5, 1.0, 0.8), [5.0, 10.0, 2.0]).into());
    scene
}

/// Renders both with the same renderer.
fn assert_same_frames(device: &Device, changed: &Scene, expected: &camlux::Scene) {
    let (renderer, built) = (device.renderer(), from_arrays(expected));
    let [found, due] = [changed, &built].map(|scene| renderer.render(scene).layers());
    assert!(found == due);
}

fn pose(position_m: [f64; 3], scale: f64) -> camlux_pose {
    init!(camlux_pose {
        position_m: position_m,
        orientation_xyzw: DQuat::from_rotation_z(0.5).to_array(),
        scale: scale
    })
}

#[test]
fn many_poses_are_each_pose() {
    /// A host's struct whose first member is a pose.
    #[repr(C)]
    struct Body {
        pose: camlux_pose,
        mass_kg: f64,
    }
    let device = Device::open();
    let mut expected = room();
    let scene = from_arrays(&expected);
    let bodies = [pose([0.1, 0.3, 0.0], 2.0), pose([0.0, 0.2, 0.1], 0.5)];
    let bodies = bodies.map(|pose| Body { pose, mass_kg: 1.0 });
    assert_eq!(bodies[0].mass_kg, 1.0);
    let move_bodies = |part, indices: &[u32], count, stride_bytes| {
        // SAFETY: `bodies` has two elements of that stride.
        unsafe {
            let poses = &raw const bodies[0].pose;
            camlux_scene_set_poses(
                scene.raw(),
                part,
                indices.as_ptr(),
                count,
                poses,
                stride_bytes,
            )
        }
    };
    let stride_bytes = size_of::<Body>();
    ok(move_bodies(CAMLUX_PART_INSTANCE, &[2, 1], 2, stride_bytes));
    for (index, body) in [2, 1].into_iter().zip(&bodies) {
        let found = scene.pose(CAMLUX_PART_INSTANCE, index);
        assert_eq!(found.position_m, body.pose.position_m);
        assert_eq!(found.scale, body.pose.scale);
        let turn = DQuat::from_array(body.pose.orientation_xyzw);
        assert!(DQuat::from_array(found.orientation_xyzw).angle_between(turn) < 1e-7);
        // The scale is a power of two, so nothing is rounded.
        let mesh = &mut *expected.meshes[index as usize];
        for position_m in &mut mesh.positions_m {
            let scaled_m = body.pose.scale * *position_m;
            *position_m = turn.normalize() * scaled_m + DVec3::from(body.pose.position_m);
        }
    }
    assert_same_frames(&device, &scene, &expected);

    // If one pose is refused, nothing moves.
    let far = [pose([0.5, 0.0, 0.0], 1.0), pose([1e30, 0.0, 0.0], 1.0)];
    let set = |part, poses: &[camlux_pose], stride_bytes| {
        // SAFETY: the count is that of `poses`, and the stride is theirs or is refused.
        unsafe {
            camlux_scene_set_poses(
                scene.raw(),
                part,
                null(),
                poses.len(),
                poses.as_ptr(),
                stride_bytes,
            )
        }
    };
    let stride_bytes = size_of::<camlux_pose>();
    let (camera, light, instance) = (CAMLUX_PART_CAMERA, CAMLUX_PART_LIGHT, CAMLUX_PART_INSTANCE);
    let (none, large) = ([pose([0.0; 3], 0.0)], [pose([0.0; 3], 2.0)]);
    for (part, poses, stride_bytes, status, words) in [
        (instance, &far[..], stride_bytes, SCENE, "pose 1: "),
        (light, &far[1..], stride_bytes, SCENE, "pose 0: "),
        (instance, &none, stride_bytes, SCENE, "scale is 0"),
        (light, &large, stride_bytes, SCENE, "set it to 1"),
        (camera, &far, stride_bytes, ARGUMENT, "part is 0"),
        (instance, &far, 0, ARGUMENT, "stride_bytes is 0"),
        (instance, &far, 8, ARGUMENT, "at least 64"),
    ] {
        fails(set(part, poses, stride_bytes), status, words);
    }
    assert_same_frames(&device, &scene, &expected);
    let missing = move_bodies(CAMLUX_PART_INSTANCE, &[0, 3], 2, size_of::<Body>());
    fails(missing, ARGUMENT, "pose 1: there is no instance 3 among 3");
    ok(set(CAMLUX_PART_INSTANCE, &[], 0));
}

/// Setting the pose that the getter returns moves nothing.
#[test]
fn a_pose_that_is_read_can_be_set() {
    let device = Device::open();
    let mut expected = room();
    expected.lights.push(
        Light::spot(
            DVec3::new(0.0, 1.5, 0.0),
            DVec3::new(0.0, -1.0, 0.0),
            camlux::scene::SpotCone {
                inner_half_angle_deg: 20.0,
                outer_half_angle_deg: 30.0,
            },
            [5.0; 3],
        )
        .into(),
    );
    expected.lights.push(
        Light::area(
            DVec3::new(0.0, 1.9, 0.5),
            DVec3::NEG_Y,
            DVec3::X,
            camlux::scene::AreaShape::Rectangle {
                size_m: [0.25, 0.5],
            },
            [5.0; 3],
        )
        .into(),
    );
    expected.indirect = None;
    let scene = from_arrays(&expected);
    let parts = [
        (CAMLUX_PART_CAMERA, 1),
        (CAMLUX_PART_LIGHT, expected.lights.len() as u32),
        (CAMLUX_PART_INSTANCE, expected.meshes.len() as u32),
    ];
    for (part, count) in parts {
        for index in 0..count {
            let found = scene.pose(part, index);
            ok(scene.set_pose(part, index, &found));
            let again = scene.pose(part, index);
            let turned = [found, again].map(|pose| DQuat::from_array(pose.orientation_xyzw));
            assert!(turned[0].angle_between(turned[1]) < 1e-7);
            assert_eq!(found.position_m, again.position_m);
        }
    }
    assert_same_frames(&device, &scene, &expected);
    let mut any = init!(camlux_pose {});
    // SAFETY: it points to a struct of that size.
    let missing = unsafe { camlux_scene_get_pose(scene.raw(), CAMLUX_PART_CAMERA, 1, &mut any) };
    fails(missing, ARGUMENT, "one camera");
}

#[test]
fn what_is_hidden_or_removed_is_not_there() {
    let device = Device::open();
    let expected = room();
    let scene = from_arrays(&expected);
    let [card, light] = [2, 1];
    let visible = |part, index, is| ok(camlux_scene_set_visible(scene.raw(), part, index, is));
    let without = |has_card: bool, has_light: bool| {
        let mut scene = expected.clone();
        scene.meshes.truncate(if has_card { 3 } else { 2 });
        scene.lights.truncate(if has_light { 2 } else { 1 });
        scene
    };
    visible(CAMLUX_PART_INSTANCE, card, 0);
    assert_same_frames(&device, &scene, &without(false, true));
    visible(CAMLUX_PART_LIGHT, light, 0);
    assert_same_frames(&device, &scene, &without(false, false));
    visible(CAMLUX_PART_INSTANCE, card, 1);
    assert_same_frames(&device, &scene, &without(true, false));
    visible(CAMLUX_PART_LIGHT, light, 1);
    assert_same_frames(&device, &scene, &expected);

    // The first light is removed, and instances keep their ids.
    ok(camlux_scene_remove(scene.raw(), CAMLUX_PART_LIGHT, 0));
    let mut dark = expected.clone();
    dark.lights.remove(0);
    assert_same_frames(&device, &scene, &dark);
    ok(camlux_scene_remove(scene.raw(), CAMLUX_PART_INSTANCE, 1));
    dark.meshes[1] = Mesh::default().into();
    assert_same_frames(&device, &scene, &dark);

    // A removed part cannot be used, and the next part takes its index.
    let removed = camlux_scene_remove(scene.raw(), CAMLUX_PART_LIGHT, 0);
    fails(removed, ARGUMENT, "light 0 was removed");
    let shown = camlux_scene_set_visible(scene.raw(), CAMLUX_PART_INSTANCE, 1, 1);
    fails(shown, ARGUMENT, "instance 1 was removed");
    let camera = camlux_scene_remove(scene.raw(), CAMLUX_PART_CAMERA, 0);
    fails(camera, ARGUMENT, "part is 0");
    let shown = camlux_scene_set_visible(scene.raw(), CAMLUX_PART_INSTANCE, 2, 2);
    fails(shown, ARGUMENT, "is_visible is 2");
    let first = c_light(&expected.lights[0]);
    fails(scene.set_light(0, &first), ARGUMENT, "removed");
    let moved = scene.set_pose(CAMLUX_PART_INSTANCE, 1, &pose([0.0; 3], 1.0));
    fails(moved, ARGUMENT, "removed");
    assert_eq!(scene.add_light(&first), Ok(0));
    let mut instance = 99;
    // SAFETY: the pose may be NULL.
    ok(unsafe { camlux_scene_add_instance(scene.raw(), 1, null(), &mut instance) });
    assert_eq!(instance, 1);
    assert_same_frames(&device, &scene, &expected);
}

#[test]
fn a_mesh_and_a_texture_are_replaced() {
    let device = Device::open();
    let mut expected = room();
    let scene = from_arrays(&expected);
    let positions_m = [[-0.6_f32, 0.5, 0.5], [-0.1, 0.5, 0.5], [-0.1, 1.2, 0.6]];
    let triangles = [[0_u32, 1, 2]];
    let mut mesh = init!(camlux_mesh {
        vertex_count: 3,
        triangle_count: 1,
        material: 2,
        positions_m: array(&positions_m, CAMLUX_FORMAT_F32),
        indices: array(&triangles, CAMLUX_FORMAT_U32),
    });
    ok(scene.set_mesh(1, &mesh));
    let corners_m = positions_m.map(|corner| corner.map(f64::from));
    expected.meshes[1] = Mesh::from_slices("deformed", &corners_m, &triangles, 2).into();
    assert_same_frames(&device, &scene, &expected);
    fails(
        scene.set_mesh(9, &mesh),
        ARGUMENT,
        "there is no mesh 9 among 3",
    );
    mesh.material = 99;
    fails(scene.set_mesh(1, &mesh), SCENE, "material");
    mesh.material = 2;
    // The mesh's positions are in range, but not after its instance's scale of 1e6.
    ok(scene.set_pose(CAMLUX_PART_INSTANCE, 1, &pose([0.0; 3], 1e6)));
    let far_m = [[1e11_f32, 0.0, 0.0]; 3];
    mesh.positions_m = array(&far_m, CAMLUX_FORMAT_F32);
    fails(scene.set_mesh(1, &mesh), SCENE, "instance 1");

    let mut textured = engine_scene("textured", [24, 24]);
    let scene = from_arrays(&textured);
    let texels = [[10_u8, 200, 30], [250, 20, 90]];
    let texture = init!(camlux_texture {
        width_px: 2,
        height_px: 1,
        pixels: texels.as_ptr().cast(),
        encoding: CAMLUX_ENCODING_LINEAR
    });
    ok(scene.set_texture(1, &texture));
    let missing = scene.set_texture(99, &texture);
    fails(missing, ARGUMENT, "there is no texture 99");
    let first = &mut *textured.textures[0];
    first.size_px = [2, 1];
    first.texels = Texels::U8(texels.to_vec(), Encoding::Linear);
    assert_same_frames(&device, &scene, &textured);
}

#[test]
fn a_material_is_read_as_it_is_set() {
    let expected = room();
    let scene = from_arrays(&expected);
    for (index, material) in expected.materials.iter().enumerate() {
        let mut found = init!(camlux_material {
            name: c"odd".as_ptr()
        });
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_material(scene.raw(), index as u32, &mut found) });
        assert_eq!(found.kd, material.kd);
        assert_eq!(found.ks, material.ks);
        assert_eq!(found.shininess, material.shininess);
        assert_eq!((found.kd_texture, found.name), (0, null()));
    }
    // SAFETY: NULL is refused.
    fails(
        unsafe { camlux_scene_get_material(scene.raw(), 0, null_mut()) },
        ARGUMENT,
        "NULL",
    );
}
