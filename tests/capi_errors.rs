//! What is refused by the C interface, with which status and words, and that nothing is changed by it.

mod capi;

use std::{
    ffi::c_void,
    ptr::{null, null_mut, without_provenance_mut},
};

use camlux::capi::*;
use capi::*;

const HANDLE: i32 = CAMLUX_ERROR_INVALID_HANDLE;
const ARGUMENT: i32 = CAMLUX_ERROR_INVALID_ARGUMENT;
const SCENE: i32 = CAMLUX_ERROR_SCENE;

/// A call with a handle, all other arguments as a program might have them.
type Call = (&'static str, fn(usize) -> camlux_status);

macro_rules! call {
    ($name:ident($($argument:expr),*)) => {
        (stringify!($name), |handle| {
            // SAFETY: nulls, and places of the test's own.
            #[allow(unused_unsafe, reason = "not all are unsafe")]
            unsafe { $name(without_provenance_mut(handle) $(, $argument)*) }
        })
    };
}

fn device_calls() -> Vec<Call> {
    vec![
        call!(camlux_device_retain()),
        call!(camlux_device_info_of(null_mut())),
        call!(camlux_device_validation_count(null_mut())),
        call!(camlux_renderer_create(null_mut())),
    ]
}

fn scene_calls() -> Vec<Call> {
    vec![
        call!(camlux_scene_retain()),
        call!(camlux_scene_validate()),
        call!(camlux_scene_get_counts(null_mut())),
        call!(camlux_scene_get_bounds(null_mut())),
        call!(camlux_scene_set_camera(null())),
        call!(camlux_scene_get_camera(null_mut())),
        call!(camlux_scene_set_sensor(null())),
        call!(camlux_scene_set_indirect(null())),
        call!(camlux_scene_set_direct(null())),
        call!(camlux_scene_add_texture(null(), null_mut())),
        call!(camlux_scene_add_material(null(), null_mut())),
        call!(camlux_scene_set_material(0, null())),
        call!(camlux_scene_add_mesh(null(), null_mut())),
        call!(camlux_scene_add_instance(0, null(), null_mut())),
        call!(camlux_scene_set_pose(0, 0, null())),
        call!(camlux_scene_add_light(null(), null_mut())),
        call!(camlux_scene_set_light(0, null())),
        call!(camlux_scene_get_light(0, null_mut())),
    ]
}

fn renderer_calls() -> Vec<Call> {
    vec![
        call!(camlux_renderer_retain()),
        call!(camlux_renderer_cancel()),
        call!(camlux_renderer_render(null_mut(), null(), null_mut())),
    ]
}

fn frame_calls() -> Vec<Call> {
    vec![
        call!(camlux_frame_retain()),
        call!(camlux_frame_layer_count(null_mut())),
        call!(camlux_frame_get_layer(0, null_mut())),
        call!(camlux_frame_view(0, null_mut())),
        call!(camlux_frame_copy(0, null_mut(), 0, 0)),
        call!(camlux_frame_write_exr(null(), null())),
        call!(camlux_frame_write_png(null())),
        call!(camlux_frame_get_stats(null_mut())),
        call!(camlux_frame_get_pass(0, null_mut())),
    ]
}

fn release_calls() -> [Call; 4] {
    [
        call!(camlux_device_release()),
        call!(camlux_scene_release()),
        call!(camlux_renderer_release()),
        call!(camlux_frame_release()),
    ]
}

#[test]
fn wrong_handles_are_found_out() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 8, 8);
    plain_sum(scene, 8);
    let renderer = device.renderer();
    let frame = render(renderer, scene);
    let live = [device.0.addr(), scene.addr(), renderer.addr(), frame.addr()];
    // Released ones, in slots that have another object since.
    let stale = [scene.addr(), renderer.addr(), frame.addr()];
    let calls = [
        device_calls(),
        scene_calls(),
        renderer_calls(),
        frame_calls(),
    ];
    for (kind, calls) in calls.iter().enumerate() {
        let release = release_calls()[kind];
        assert_eq!(release.1(0), CAMLUX_OK, "releasing NULL is fine");
        for (name, call) in calls.iter().chain([&release]) {
            if *name != release.0 {
                fails(call(0), HANDLE, "NULL");
            }
            for (other, &handle) in live.iter().enumerate() {
                if other != kind {
                    fails(call(handle), HANDLE, "is a camlux_");
                }
            }
            for made_up in [1, 0xdead_beef, usize::MAX, usize::MAX >> 4] {
                fails(call(made_up), HANDLE, "no handle");
            }
            // Right in kind, with a slot or a generation that never was.
            fails(call(live[kind] ^ 0x00ff_0000), HANDLE, "released");
            fails(call(live[kind] ^ 1 << 40), HANDLE, "released");
            assert!(last_error().starts_with(name), "{}", last_error());
        }
    }
    ok(camlux_frame_release(frame));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
    let others = [new_scene(), new_scene(), new_scene()];
    for handle in stale {
        for (_, call) in scene_calls()
            .iter()
            .chain(&renderer_calls())
            .chain(&frame_calls())
        {
            assert_eq!(call(handle), HANDLE);
        }
        for (_, release) in release_calls() {
            assert_eq!(release(handle), HANDLE);
        }
    }
    for scene in others {
        ok(camlux_scene_release(scene));
    }
}

#[test]
fn references_are_counted() {
    let scene = new_scene();
    ok(camlux_scene_retain(scene));
    ok(camlux_scene_release(scene));
    fails(camlux_scene_validate(scene), SCENE, "there is no light");
    ok(camlux_scene_release(scene));
    fails(camlux_scene_release(scene), HANDLE, "has been released");
}

#[test]
fn null_arguments_are_named() {
    let scene = new_scene();
    for (name, call) in scene_calls() {
        match name {
            "camlux_scene_retain" => {
                ok(call(scene.addr()));
                ok(camlux_scene_release(scene));
            }
            // A scene without a light, a mesh that is not there.
            "camlux_scene_validate" => fails(call(scene.addr()), SCENE, "light"),
            "camlux_scene_add_instance" => fails(call(scene.addr()), ARGUMENT, "no mesh 0 among 0"),
            "camlux_scene_get_light" => fails(call(scene.addr()), ARGUMENT, "no light 0 among 0"),
            // What can be left out.
            "camlux_scene_set_sensor" | "camlux_scene_set_indirect" | "camlux_scene_set_direct" => {
                ok(call(scene.addr()));
            }
            _ => fails(call(scene.addr()), ARGUMENT, "is NULL"),
        }
    }
    // SAFETY: nulls.
    unsafe {
        fails(camlux_scene_create(null_mut()), ARGUMENT, "scene is NULL");
        fails(
            camlux_device_create(null(), null_mut()),
            ARGUMENT,
            "device is NULL",
        );
        fails(camlux_device_count(null_mut()), ARGUMENT, "count is NULL");
        fails(camlux_device_get_info(0, null_mut()), ARGUMENT, "is NULL");
        fails(camlux_handle_count(null_mut()), ARGUMENT, "count is NULL");
        fails(camlux_set_log(5, None, null_mut()), ARGUMENT, "level is 5");
        fails(
            camlux_scene_load_file(null(), null_mut()),
            ARGUMENT,
            "path is NULL",
        );
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn struct_sizes_are_checked() {
    let scene = new_scene();
    let mut room = [0_u64; 600];
    let at = room.as_mut_ptr();
    let set = |bytes: u32, beyond: u64| {
        let camera = init!(camlux_camera {
            struct_size: bytes,
            width_px: 77
        });
        // SAFETY: there is room for both, and for what the size says.
        unsafe {
            at.cast::<camlux_camera>().write(camera);
            at.cast::<u8>()
                .add(size_of::<camlux_camera>())
                .cast::<u64>()
                .write(beyond);
            camlux_scene_set_camera(scene, at.cast())
        }
    };
    let known = size_of::<camlux_camera>() as u32;
    for bytes in [0, 1, known - 1, 4097, u32::MAX] {
        fails(set(bytes, 0), ARGUMENT, "CAMLUX_CAMERA_INIT");
    }
    fails(set(known + 8, 1), ARGUMENT, "newer");
    fails(set(known + 1, 1), ARGUMENT, "newer");
    let mut camera = init!(camlux_camera {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_camera(scene, &mut camera) });
    assert_eq!(camera.width_px, 640, "a call that fails changes nothing");
    ok(set(known + 8, 0));
    ok(set(known, 1));
    // SAFETY: as above.
    ok(unsafe { camlux_scene_get_camera(scene, &mut camera) });
    assert_eq!((camera.width_px, camera.struct_size), (77, known));
    // A longer struct of results is filled as far as it is known.
    room[..20].fill(u64::MAX);
    room[0] = u64::from(known + 8);
    // SAFETY: there is room for what the size says.
    ok(unsafe { camlux_scene_get_camera(scene, room.as_mut_ptr().cast()) });
    assert_eq!(room[0] as u32, known + 8);
    assert_eq!(room[known as usize / 8], u64::MAX);
    ok(camlux_scene_release(scene));
}

#[test]
fn misaligned_structs_and_results_are_found_out() {
    let scene = new_scene();
    let mut room = [0_u64; 200];
    let off = room.as_mut_ptr().cast::<u8>().wrapping_add(1);
    // SAFETY: nothing is read at a misaligned place.
    unsafe {
        fails(
            camlux_scene_set_camera(scene, off.cast()),
            ARGUMENT,
            "aligned",
        );
        fails(
            camlux_scene_get_counts(scene, off.cast()),
            ARGUMENT,
            "aligned",
        );
        fails(
            camlux_scene_add_light(scene, &init!(camlux_light {}), off.cast()),
            ARGUMENT,
            "aligned",
        );
        fails(camlux_handle_count(off.cast()), ARGUMENT, "aligned");
        fails(camlux_scene_create(off.cast()), ARGUMENT, "aligned");
        let mut counts = init!(camlux_scene_counts {});
        ok(camlux_scene_get_counts(scene, &mut counts));
        assert_eq!(counts.lights, 0);
    }
    ok(camlux_scene_release(scene));
}

/// A scene with a material, and a mesh that is fine.
struct Room {
    scene: *mut camlux_scene,
    positions_m: [[f32; 3]; 4],
    indices: [[u16; 3]; 2],
}

impl Room {
    fn new() -> Room {
        let scene = new_scene();
        // SAFETY: a struct of that size; no index wanted.
        ok(unsafe { camlux_scene_add_material(scene, &init!(camlux_material {}), null_mut()) });
        Room {
            scene,
            positions_m: [
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
            ],
            indices: [[0, 1, 2], [0, 2, 3]],
        }
    }

    fn mesh(&self) -> camlux_mesh {
        init!(camlux_mesh {
            vertex_count: 4,
            triangle_count: 2,
            positions_m: array(&self.positions_m, CAMLUX_FORMAT_F32),
            indices: array(&self.indices, CAMLUX_FORMAT_U16),
        })
    }

    fn add(&self, mesh: camlux_mesh) -> camlux_status {
        let mut index = 99;
        // SAFETY: what is wrong with its arrays is found out before they are read.
        let status = unsafe { camlux_scene_add_mesh(self.scene, &mesh, &mut index) };
        assert!(status == CAMLUX_OK || index == 99);
        status
    }

    #[track_caller]
    fn refuses(&self, change: impl FnOnce(&mut camlux_mesh), status: i32, words: &str) {
        let mut mesh = self.mesh();
        change(&mut mesh);
        fails(self.add(mesh), status, words);
        let mut counts = init!(camlux_scene_counts {});
        // SAFETY: a struct of that size.
        ok(unsafe { camlux_scene_get_counts(self.scene, &mut counts) });
        assert_eq!(counts.meshes, 0);
    }
}

#[test]
fn meshes_are_checked() {
    let mut room = Room::new();
    let off = |array: &mut camlux_array, bytes| array.data = array.data.wrapping_byte_add(bytes);
    room.refuses(
        |m| m.positions_m.data = null(),
        ARGUMENT,
        "positions_m is NULL, for 4",
    );
    room.refuses(
        |m| m.indices.data = null(),
        ARGUMENT,
        "indices is NULL, for 2",
    );
    room.refuses(
        |m| off(&mut m.positions_m, 2),
        ARGUMENT,
        "not aligned to 4 bytes",
    );
    room.refuses(
        |m| off(&mut m.indices, 1),
        ARGUMENT,
        "not aligned to 2 bytes",
    );
    room.refuses(
        |m| m.positions_m.format = 0,
        ARGUMENT,
        "the format of positions_m is 0",
    );
    room.refuses(
        |m| m.positions_m.format = CAMLUX_FORMAT_U32,
        ARGUMENT,
        "CAMLUX_FORMAT_F32 (1)",
    );
    room.refuses(
        |m| m.indices.format = CAMLUX_FORMAT_F32,
        ARGUMENT,
        "CAMLUX_FORMAT_U16 (3)",
    );
    room.refuses(
        |m| m.positions_m.stride_bytes = 8,
        ARGUMENT,
        "of at least 12",
    );
    room.refuses(
        |m| m.positions_m.stride_bytes = 13,
        ARGUMENT,
        "multiple of 4",
    );
    room.refuses(|m| m.positions_m.reserved = 1, ARGUMENT, "reserved");
    room.refuses(|m| m.vertex_count = usize::MAX, ARGUMENT, "vertex_count");
    room.refuses(|m| m.triangle_count = 1 << 32, ARGUMENT, "triangle_count");
    room.refuses(
        |m| m.positions_m.stride_bytes = usize::MAX - 3,
        ARGUMENT,
        "more than memory has",
    );
    room.refuses(
        |m| m.positions_m.stride_bytes = 1 << 61,
        ARGUMENT,
        "more than memory has",
    );
    room.refuses(|m| m.material = 1, SCENE, "material 1 of 1");
    room.refuses(|m| m.vertex_count = 3, SCENE, "vertices [0, 2, 3] of 3");
    room.refuses(|m| m.name = c"\xff".as_ptr(), ARGUMENT, "UTF-8");
    room.refuses(|m| m.normals = m.positions_m, SCENE, "normal of vertex 0");
    room.positions_m[2][1] = f32::NAN;
    room.refuses(|_| (), SCENE, "vertex 2");
    room.positions_m[2][1] = 1.0;
    ok(room.add(room.mesh()));
    // Nothing at all is a mesh as well.
    ok(room.add(init!(camlux_mesh {})));
    ok(camlux_scene_release(room.scene));
}

#[test]
fn meshes_are_read_as_they_lie_in_memory() {
    #[repr(C)]
    struct Vertex {
        padding: u32,
        uv: [f32; 2],
        position_m: [f32; 3],
    }
    let room = Room::new();
    let vertices = room.positions_m.map(|position_m| Vertex {
        padding: u32::MAX,
        uv: [0.0; 2],
        position_m,
    });
    let indices = room
        .indices
        .map(|[a, b, c]| [a.into(), b.into(), c.into(), u32::MAX]);
    let interleaved = |offset, components: usize| camlux_array {
        data: vertices.as_ptr().wrapping_byte_add(offset).cast::<c_void>(),
        stride_bytes: size_of::<Vertex>(),
        format: if components > 0 { CAMLUX_FORMAT_F32 } else { 0 },
        reserved: 0,
    };
    let mut mesh = room.mesh();
    mesh.positions_m = interleaved(std::mem::offset_of!(Vertex, position_m), 3);
    mesh.texcoords = interleaved(std::mem::offset_of!(Vertex, uv), 2);
    mesh.indices = array(&indices, CAMLUX_FORMAT_U32);
    mesh.indices.stride_bytes = 16;
    mesh.triangle_materials = array(&[0_u16, 0], CAMLUX_FORMAT_U16);
    ok(room.add(mesh));
    let mut bounds = init!(camlux_bounds {});
    // SAFETY: structs of their size; no index wanted.
    unsafe {
        ok(camlux_scene_get_bounds(room.scene, &mut bounds));
        assert_eq!(bounds.is_empty, 1);
        let pose = init!(camlux_pose {
            position_m: [5.0, 0.0, 0.0]
        });
        ok(camlux_scene_add_instance(room.scene, 0, &pose, null_mut()));
        ok(camlux_scene_get_bounds(room.scene, &mut bounds));
    }
    assert_eq!(
        (bounds.is_empty, bounds.min_m, bounds.max_m),
        (0, [5.0, 0.0, 0.0], [6.0, 1.0, 0.0])
    );
    ok(camlux_scene_release(room.scene));
}

#[test]
fn values_are_checked() {
    let Room { scene, .. } = Room::new();
    let nan = f64::NAN;
    // SAFETY: structs of their size; no index wanted.
    unsafe {
        let camera = |camera: camlux_camera| camlux_scene_set_camera(scene, &camera);
        fails(
            camera(init!(camlux_camera { width_px: 0 })),
            SCENE,
            "0 x 480",
        );
        fails(
            camera(init!(camlux_camera { lens: 2 })),
            ARGUMENT,
            "lens is 2",
        );
        fails(
            camera(init!(camlux_camera {
                position_m: [nan, 0.0, 0.0]
            })),
            ARGUMENT,
            "position_m",
        );
        fails(
            camera(init!(camlux_camera {
                look_at_m: [0.0; 3]
            })),
            SCENE,
            "look_at",
        );
        fails(
            camera(init!(camlux_camera {
                up: [0.0, 0.0, 2.0]
            })),
            SCENE,
            "parallel",
        );
        fails(
            camera(init!(camlux_camera { fov_y_deg: nan })),
            SCENE,
            "fov_y_deg",
        );
        fails(
            camera(init!(camlux_camera { fov_y_deg: 180.0 })),
            SCENE,
            "fov_y_deg",
        );
        fails(
            camera(init!(camlux_camera {
                lens: CAMLUX_LENS_INTRINSICS
            })),
            SCENE,
            "fx",
        );
        let sensor = |sensor: camlux_sensor| camlux_scene_set_sensor(scene, &sensor);
        fails(sensor(init!(camlux_sensor {})), SCENE, "pixel_pitch_um");
        fails(
            sensor(init!(camlux_sensor {
                exposure_time_s: nan
            })),
            ARGUMENT,
            "exposure_time_s",
        );
        fails(
            sensor(init!(camlux_sensor { reserved: 1 })),
            ARGUMENT,
            "reserved",
        );
        let indirect = |indirect: camlux_indirect| camlux_scene_set_indirect(scene, &indirect);
        fails(
            indirect(init!(camlux_indirect { estimator: 2 })),
            ARGUMENT,
            "estimator is 2",
        );
        fails(
            indirect(init!(camlux_indirect { visibility: -1 })),
            ARGUMENT,
            "visibility is -1",
        );
        fails(
            indirect(init!(camlux_indirect { target_error: nan })),
            ARGUMENT,
            "target_error",
        );
        fails(
            indirect(init!(camlux_indirect { target_error: 0.6 })),
            SCENE,
            "target_error",
        );
        fails(
            indirect(init!(camlux_indirect {
                visibility: CAMLUX_VISIBILITY_NONE
            })),
            SCENE,
            "rsm_size",
        );
        fails(
            indirect(init!(camlux_indirect {
                estimator: CAMLUX_ESTIMATOR_RSM_AVERAGE,
                visibility: CAMLUX_VISIBILITY_RAYS
            })),
            SCENE,
            "visibility",
        );
        fails(
            camlux_scene_set_direct(scene, &init!(camlux_direct { shadow: 3 })),
            ARGUMENT,
            "shadow is 3",
        );
        let light = |light: camlux_light| camlux_scene_add_light(scene, &light, null_mut());
        fails(
            light(init!(camlux_light { kind: 3 })),
            ARGUMENT,
            "kind is 3",
        );
        fails(
            light(init!(camlux_light { power_w: [nan; 3] })),
            ARGUMENT,
            "power_w",
        );
        fails(
            light(init!(camlux_light { power_w: [-1.0; 3] })),
            SCENE,
            "power_w",
        );
        fails(
            light(init!(camlux_light {
                position_m: [f64::INFINITY; 3]
            })),
            ARGUMENT,
            "position_m",
        );
        fails(
            light(init!(camlux_light {
                kind: CAMLUX_LIGHT_DIRECTIONAL
            })),
            SCENE,
            "direction",
        );
        let direction = [0.0, 0.0, 1.0];
        fails(
            light(init!(camlux_light {
                kind: CAMLUX_LIGHT_SPOT,
                direction: direction
            })),
            SCENE,
            "outer",
        );
        fails(
            camlux_scene_set_light(scene, 0, &init!(camlux_light {})),
            ARGUMENT,
            "no light 0 among 0",
        );
        let material =
            |material: camlux_material| camlux_scene_add_material(scene, &material, null_mut());
        fails(
            material(init!(camlux_material { kd: [nan; 3] })),
            ARGUMENT,
            "kd",
        );
        fails(
            material(init!(camlux_material { kd: [1.5; 3] })),
            SCENE,
            "kd",
        );
        fails(
            material(init!(camlux_material { ks: [0.5; 3] })),
            ARGUMENT,
            "shininess",
        );
        fails(
            material(init!(camlux_material { kd_texture: 0 })),
            SCENE,
            "kd_texture",
        );
        fails(
            camlux_scene_set_material(scene, 1, &init!(camlux_material {})),
            ARGUMENT,
            "material 1 among 1",
        );
        let pose =
            |part, index, pose: camlux_pose| camlux_scene_set_pose(scene, part, index, &pose);
        fails(pose(3, 0, init!(camlux_pose {})), ARGUMENT, "part is 3");
        fails(
            pose(CAMLUX_PART_CAMERA, 1, init!(camlux_pose {})),
            ARGUMENT,
            "index 0",
        );
        fails(
            pose(CAMLUX_PART_LIGHT, 0, init!(camlux_pose {})),
            ARGUMENT,
            "no light 0",
        );
        fails(
            pose(CAMLUX_PART_INSTANCE, 7, init!(camlux_pose {})),
            ARGUMENT,
            "no instance 7",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    orientation_xyzw: [0.0; 4]
                }),
            ),
            ARGUMENT,
            "unit quaternion",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    orientation_xyzw: [nan; 4]
                }),
            ),
            ARGUMENT,
            "finite",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    position_m: [nan; 3]
                }),
            ),
            ARGUMENT,
            "finite",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    position_m: [1e13; 3]
                }),
            ),
            SCENE,
            "position",
        );
        fails(
            pose(0, 0, init!(camlux_pose { reserved: 1 })),
            ARGUMENT,
            "reserved",
        );
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn textures_are_checked_and_decoded() {
    let Room { scene, .. } = Room::new();
    let bytes = [0_u8, 128, 255, 255, 128, 0, 9, 9];
    let wide = [0_u16, 0, 0];
    let add = |texture: camlux_texture| {
        // SAFETY: a struct of that size, pixels as many as it says; no index wanted.
        unsafe { camlux_scene_add_texture(scene, &texture, null_mut()) }
    };
    let texture = || {
        init!(camlux_texture {
            width_px: 1,
            height_px: 2,
            pixels: bytes.as_ptr().cast(),
            row_stride_bytes: 3,
        })
    };
    let refuses = |change: fn(&mut camlux_texture), status, words: &str| {
        let mut texture = texture();
        change(&mut texture);
        fails(add(texture), status, words);
    };
    refuses(|t| t.pixels = null(), ARGUMENT, "pixels is NULL");
    refuses(|t| t.width_px = 0, ARGUMENT, "0 x 2 pixels");
    refuses(|t| t.channels = 2, ARGUMENT, "channels is 2");
    refuses(|t| t.component = 3, ARGUMENT, "component is 3");
    refuses(|t| t.encoding = 2, ARGUMENT, "encoding is 2");
    refuses(|t| t.row_stride_bytes = 2, ARGUMENT, "at least 3");
    ok(add(texture()));
    let mut grey = texture();
    (grey.channels, grey.row_stride_bytes) = (1, 4);
    ok(add(grey));
    let mut of_16_bits = texture();
    of_16_bits.pixels = wide.as_ptr().cast();
    (
        of_16_bits.component,
        of_16_bits.height_px,
        of_16_bits.row_stride_bytes,
    ) = (CAMLUX_COMPONENT_U16, 1, 0);
    ok(add(of_16_bits));
    of_16_bits.pixels = of_16_bits.pixels.wrapping_byte_add(1);
    fails(add(of_16_bits), ARGUMENT, "aligned");
    let nan = [f32::NAN; 3];
    let mut real = of_16_bits;
    (real.component, real.pixels) = (CAMLUX_COMPONENT_F32, nan.as_ptr().cast());
    fails(add(real), SCENE, "texel 0");
    ok(camlux_scene_release(scene));
}

#[test]
fn files_and_devices_that_are_not_there_are_named() {
    let mut scene = null_mut();
    let mut device = null_mut();
    let mut info = init!(camlux_device_info {});
    // SAFETY: strings, structs of their size, and pointers to pointers.
    unsafe {
        fails(
            camlux_scene_load_file(c"/no/such.toml".as_ptr(), &mut scene),
            SCENE,
            "/no/such.toml",
        );
        fails(
            camlux_scene_load_file(c"\xff\xfe".as_ptr(), &mut scene),
            ARGUMENT,
            "UTF-8",
        );
        fails(
            camlux_scene_load_file(c"".as_ptr(), &mut scene),
            ARGUMENT,
            "path is empty",
        );
        let create =
            |options: camlux_device_options, device| camlux_device_create(&options, device);
        let by_name = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_NAME
        });
        fails(create(by_name, &mut device), ARGUMENT, "name is NULL");
        let by_name = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_NAME,
            name: c"no such GPU".as_ptr()
        });
        fails(
            create(by_name, &mut device),
            CAMLUX_ERROR_NO_DEVICE,
            "no such GPU",
        );
        let by_index = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_INDEX,
            index: 99
        });
        fails(create(by_index, &mut device), CAMLUX_ERROR_NO_DEVICE, "99");
        fails(
            create(init!(camlux_device_options { choice: 7 }), &mut device),
            ARGUMENT,
            "choice is 7",
        );
        fails(
            create(init!(camlux_device_options { validation: 2 }), &mut device),
            ARGUMENT,
            "validation is 2",
        );
        fails(
            camlux_device_get_info(99, &mut info),
            ARGUMENT,
            "no device 99",
        );
        let mut count = 0;
        ok(camlux_device_count(&mut count));
        assert!(count > 0);
        ok(camlux_device_get_info(0, &mut info));
        assert!(info.name[0] != 0 && info.max_image_px > 0);
    }
    assert!(scene.is_null() && device.is_null());
}

#[test]
fn frames_are_checked() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 8, 8);
    plain_sum(scene, 8);
    let renderer = device.renderer();
    let mut frame = null_mut();
    // SAFETY: structs of their size, memory as large as it says.
    unsafe {
        let render = |options: camlux_render_options, frame| {
            camlux_renderer_render(renderer, scene, &options, frame)
        };
        fails(
            render(
                init!(camlux_render_options {
                    submission_target_ms: 0
                }),
                &mut frame,
            ),
            ARGUMENT,
            "is 0",
        );
        fails(
            render(init!(camlux_render_options {}), null_mut()),
            ARGUMENT,
            "frame is NULL",
        );
        let empty = new_scene();
        fails(
            camlux_renderer_render(renderer, empty, null(), &mut frame),
            SCENE,
            "no light",
        );
        resize(scene, 100_000, 8);
        fails(
            camlux_renderer_render(renderer, scene, null(), &mut frame),
            CAMLUX_ERROR_DEVICE_LIMIT,
            "100000",
        );
        ok(camlux_scene_release(empty));
        assert!(frame.is_null());
        resize(scene, 8, 8);
        ok(camlux_scene_set_sensor(scene, null()));
        frame = capi::render(renderer, scene);
        let mut view = init!(camlux_view {});
        fails(
            camlux_frame_view(frame, CAMLUX_LAYER_ENERGY, &mut view),
            ARGUMENT,
            "camlux_scene_set_sensor",
        );
        fails(
            camlux_frame_view(frame, 10, &mut view),
            ARGUMENT,
            "layer is 10",
        );
        fails(
            camlux_frame_view(frame, -1, &mut view),
            ARGUMENT,
            "layer is -1",
        );
        let mut room = [0.0_f32; 192];
        let to = room.as_mut_ptr().cast();
        let copy =
            |bytes, stride| camlux_frame_copy(frame, CAMLUX_LAYER_RADIANCE, to, bytes, stride);
        ok(copy(768, 0));
        fails(copy(767, 0), ARGUMENT, "do not fit in 767");
        fails(copy(768, 95), ARGUMENT, "a row has 96");
        fails(copy(768, 100), ARGUMENT, "do not fit");
        fails(copy(768, usize::MAX), ARGUMENT, "do not fit");
        let mut layer = 0;
        fails(
            camlux_frame_get_layer(frame, 99, &mut layer),
            ARGUMENT,
            "no layer 99",
        );
        let mut pass = init!(camlux_pass_time {});
        fails(
            camlux_frame_get_pass(frame, 99, &mut pass),
            ARGUMENT,
            "no pass 99",
        );
        let path = c"/no/such/folder/x.exr".as_ptr();
        fails(
            camlux_frame_write_exr(frame, path, null()),
            CAMLUX_ERROR_OUTPUT,
            "/no/such/folder",
        );
        fails(
            camlux_frame_write_png(frame, path),
            CAMLUX_ERROR_OUTPUT,
            "/no/such/folder",
        );
        let exr = |options: camlux_exr_options| {
            camlux_frame_write_exr(frame, c"x.exr".as_ptr(), &options)
        };
        fails(
            exr(init!(camlux_exr_options { half: 2 })),
            ARGUMENT,
            "half is 2",
        );
        fails(
            exr(init!(camlux_exr_options { layers: 1 << 10 })),
            ARGUMENT,
            "no layer",
        );
        fails(
            exr(init!(camlux_exr_options {
                layers: 1 << CAMLUX_LAYER_ENERGY
            })),
            CAMLUX_ERROR_OUTPUT,
            "energy",
        );
    }
    ok(camlux_frame_release(frame));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

#[test]
fn messages_are_a_threads_own() {
    fails(camlux_scene_validate(null_mut()), HANDLE, "NULL");
    std::thread::spawn(|| assert_eq!(last_error(), ""))
        .join()
        .expect("no panic");
    // A success leaves the message.
    ok(camlux_scene_release(null_mut()));
    assert!(last_error().contains("NULL"));
}
