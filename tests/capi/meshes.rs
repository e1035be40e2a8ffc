//! Meshes and textures in a host's own memory layout, and the ones that are refused.

use std::{
    ffi::c_void,
    ptr::{null, null_mut},
};

use crate::host::*;
use camlux::capi::*;

const ARGUMENT: i32 = CAMLUX_ERROR_INVALID_ARGUMENT;
const SCENE: i32 = CAMLUX_ERROR_SCENE;

/// A scene with a material, and the arrays of a valid mesh.
struct Room {
    scene: *mut camlux_scene,
    positions_m: [[f32; 3]; 4],
    indices: [[u16; 3]; 2],
}

impl Room {
    fn new() -> Room {
        let scene = new_scene();
        // SAFETY: a struct of that size; no index requested.
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
        // SAFETY: invalid arrays are refused before they are read.
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
        "camlux_mesh.positions_m is NULL, but vertex_count is 4",
    );
    room.refuses(
        |m| m.indices.data = null(),
        ARGUMENT,
        "camlux_mesh.indices is NULL, but triangle_count is 2",
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
        "the format of camlux_mesh.positions_m is 0",
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
        "more than memory can hold",
    );
    room.refuses(
        |m| m.positions_m.stride_bytes = 1 << 61,
        ARGUMENT,
        "more than memory can hold",
    );
    room.refuses(|m| m.material = 1, SCENE, "material 1 of 1");
    room.refuses(|m| m.vertex_count = 3, SCENE, "vertices [0, 2, 3] of 3");
    room.refuses(|m| m.name = c"\xff".as_ptr(), ARGUMENT, "UTF-8");
    room.refuses(|m| m.normals = m.positions_m, SCENE, "normal of vertex 0");
    room.positions_m[2][1] = f32::NAN;
    room.refuses(|_| (), SCENE, "vertex 2");
    room.positions_m[2][1] = 1.0;
    ok(room.add(room.mesh()));
    // An empty mesh is valid.
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
    // SAFETY: structs of their size; no index requested.
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
fn textures_are_checked_and_decoded() {
    let Room { scene, .. } = Room::new();
    let bytes = [0_u8, 128, 255, 255, 128, 0, 9, 9];
    let wide = [0_u16, 0, 0];
    let add = |texture: camlux_texture| {
        // SAFETY: a struct of that size, with pixels of its size; no index requested.
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
    refuses(
        |t| t.pixels = null(),
        ARGUMENT,
        "camlux_texture.pixels is NULL, but height_px is ",
    );
    refuses(|t| t.width_px = 0, SCENE, "0 x 2");
    refuses(|t| (t.width_px, t.height_px) = (0, 0), SCENE, "0 x 0");
    refuses(|t| t.channels = 2, ARGUMENT, "channels is 2");
    refuses(|t| t.component = 3, ARGUMENT, "component is 3");
    refuses(|t| t.encoding = 3, ARGUMENT, "encoding is 3");
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
    let transparent = [0.5_f32, 0.5, 0.5, 2.0];
    (real.channels, real.pixels) = (4, transparent.as_ptr().cast());
    fails(add(real), SCENE, "alpha of texel 0 is 2.0");
    real.channels = 3;
    let double = [2.0_f32; 3];
    real.pixels = double.as_ptr().cast();
    fails(add(real), SCENE, "texel 0 is [2.0, 2.0, 2.0]");
    real.encoding = CAMLUX_ENCODING_SRGB;
    fails(add(real), SCENE, "texel 0 is [2.0, 2.0, 2.0]");
    ok(camlux_scene_release(scene));
}
