// What a camera or a light sees: a ray for each pixel or texel.
//
// Lengths are local units (see LocalSpace): the scene is about 1 large and around 0.

struct View {
    // Clip position of an offset from the origin; reversed depth, no far plane.
    clip_from_offset: mat4x4<f32>,
    // Camera centre C, light position L, or the centre of a directional light's plane.
    origin: vec3<f32>,
    // Unit vector along which depth is measured.
    forward: vec3<f32>,
    // The ray of pixel (x, y): origin + ray_offset·(1, x, y) + t · ray_direction·(1, x, y). The direction's component along `forward` is 1,
    // so t is the depth. In a perspective view the offset is 0; in a parallel view the direction is the same for all pixels.
    ray_offset: mat3x3<f32>,
    ray_direction: mat3x3<f32>,
    // Texels of the faces before this one, and texels along a face's edge (light views).
    first_texel: u32,
    size_px: u32,
    // 1 for a parallel view, else 0.
    is_parallel: u32,
}

var<uniform> view: View;
