//! Meshes and textures in a host's own memory layout, and the ones that are refused.

use std::{
    ffi::c_void,
    ptr::{null, null_mut},
};

use crate::host::*;
use camlux::capi::*;

/// A scene with a material, and the arrays of a valid mesh.
struct Room {
    scene: Scene,
    positions_m: [[f32; 3]; 4],
    indices: [[u16; 3]; 2],
}

impl Room {
    fn new() -> Room {
        let scene = new_scene();
        let material = init!(camlux_material {});
        scene.add_material(&material).expect("it is added");
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

    #[track_caller]
    fn refuses(&self, change: impl FnOnce(&mut camlux_mesh), status: i32, words: &str) {
        let mut mesh = self.mesh();
        change(&mut mesh);
        fails(self.scene.add_mesh(&mesh).unwrap_err(), status, words);
        assert_eq!(self.scene.counts().meshes, 0);
    }
}

#[test]
fn meshes_are_checked() {
    let mut room = Room::new();
    let off = |array: &mut camlux_array, bytes| array.data = array.data.wrapping_byte_add(bytes);
    let words = "camlux_mesh.positions_m is NULL, but vertex_count is 4";
    room.refuses(|m| m.positions_m.data = null(), ARGUMENT, words);
    let words = "camlux_mesh.indices is NULL, but triangle_count is 2";
    room.refuses(|m| m.indices.data = null(), ARGUMENT, words);
    let words = "not aligned to 4 bytes";
    room.refuses(|m| off(&mut m.positions_m, 2), ARGUMENT, words);
    let words = "not aligned to 2 bytes";
    room.refuses(|m| off(&mut m.indices, 1), ARGUMENT, words);
    let words = "the format of camlux_mesh.positions_m is 0";
    room.refuses(|m| m.positions_m.format = 0, ARGUMENT, words);
    let (of_ids, of_reals) = (CAMLUX_FORMAT_U32, CAMLUX_FORMAT_F32);
    let words = "CAMLUX_FORMAT_F32 (1)";
    room.refuses(|m| m.positions_m.format = of_ids, ARGUMENT, words);
    let words = "CAMLUX_FORMAT_U16 (3)";
    room.refuses(|m| m.indices.format = of_reals, ARGUMENT, words);
    for (stride_bytes, words) in [
        (8, "of at least 12"),
        (13, "multiple of 4"),
        (usize::MAX - 3, "more than memory can hold"),
        (1 << 61, "more than memory can hold"),
    ] {
        let change = |m: &mut camlux_mesh| m.positions_m.stride_bytes = stride_bytes;
        room.refuses(change, ARGUMENT, words);
    }
    room.refuses(|m| m.positions_m.reserved = 1, ARGUMENT, "reserved");
    room.refuses(|m| m.vertex_count = usize::MAX, ARGUMENT, "vertex_count");
    room.refuses(|m| m.triangle_count = 1 << 32, ARGUMENT, "triangle_count");
    room.refuses(|m| m.material = 1, SCENE, "material 1 of 1");
    room.refuses(|m| m.vertex_count = 3, SCENE, "vertices [0, 2, 3] of 3");
    room.refuses(|m| m.name = c"\xff".as_ptr(), ARGUMENT, "UTF-8");
    room.refuses(|m| m.normals = m.positions_m, SCENE, "normal of vertex 0");
    room.positions_m[2][1] = f32::NAN;
    room.refuses(|_| (), SCENE, "vertex 2");
    room.positions_m[2][1] = 1.0;
    // An empty mesh is valid.
    for mesh in [room.mesh(), init!(camlux_mesh {})] {
        room.scene.add_mesh(&mesh).expect("it is added");
    }
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
    room.scene.add_mesh(&mesh).expect("it is added");
    let mut bounds = init!(camlux_bounds {});
    // SAFETY: structs of their size; no index requested.
    unsafe {
        ok(camlux_scene_get_bounds(room.scene.raw(), &mut bounds));
        assert_eq!(bounds.is_empty, 1);
        let pose = init!(camlux_pose {
            position_m: [5.0, 0.0, 0.0]
        });
        ok(camlux_scene_add_instance(
            room.scene.raw(),
            0,
            &pose,
            null_mut(),
        ));
        ok(camlux_scene_get_bounds(room.scene.raw(), &mut bounds));
    }
    assert_eq!(
        (bounds.is_empty, bounds.min_m, bounds.max_m),
        (0, [5.0, 0.0, 0.0], [6.0, 1.0, 0.0])
    );
}

#[test]
fn textures_are_checked_and_decoded() {
    let Room { scene, .. } = Room::new();
    let bytes = [0_u8, 128, 255, 255, 128, 0, 9, 9];
    let wide = [0_u16, 0, 0];
    let add = |texture: camlux_texture| scene.add_texture(&texture);
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
        fails(add(texture).unwrap_err(), status, words);
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
    add(texture()).expect("it is added");
    let mut grey = texture();
    (grey.channels, grey.row_stride_bytes) = (1, 4);
    add(grey).expect("it is added");
    let mut of_16_bits = texture();
    of_16_bits.pixels = wide.as_ptr().cast();
    (
        of_16_bits.component,
        of_16_bits.height_px,
        of_16_bits.row_stride_bytes,
    ) = (CAMLUX_COMPONENT_U16, 1, 0);
    add(of_16_bits).expect("it is added");
    of_16_bits.pixels = of_16_bits.pixels.wrapping_byte_add(1);
    fails(add(of_16_bits).unwrap_err(), ARGUMENT, "aligned");
    let nan = [f32::NAN; 3];
    let mut real = of_16_bits;
    (real.component, real.pixels) = (CAMLUX_COMPONENT_F32, nan.as_ptr().cast());
    fails(add(real).unwrap_err(), SCENE, "texel 0");
    let transparent = [0.5_f32, 0.5, 0.5, 2.0];
    (real.channels, real.pixels) = (4, transparent.as_ptr().cast());
    fails(add(real).unwrap_err(), SCENE, "alpha of texel 0 is 2.0");
    real.channels = 3;
    let double = [2.0_f32; 3];
    real.pixels = double.as_ptr().cast();
    fails(add(real).unwrap_err(), SCENE, "texel 0 is [2.0, 2.0, 2.0]");
    real.encoding = CAMLUX_ENCODING_SRGB;
    fails(add(real).unwrap_err(), SCENE, "texel 0 is [2.0, 2.0, 2.0]");
}
