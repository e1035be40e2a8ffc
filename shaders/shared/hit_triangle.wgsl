// The triangles that rays hit: src/ray_tree describes the list.

#import instance
#import texel_list

// Four texels per triangle: its corners, each with a component of the unit normal; its index in the scene, and 1 + its index among the
// triangles with cut-outs, if it has any. The fourth texel of the first triangle also holds the index where the second geometry of an
// acceleration structure begins, and the number of triangles. After all triangles, those with cut-outs follow again, three texels each: the
// texture coordinates of the corners, columns and rows of the alpha texture; its first word, for word_index; the cutoff; and flags.
var ray_triangles: texture_storage_2d<rgba32float, read>;

fn triangle_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_triangles, list_place(index));
}

// The corners of a triangle, each with a component of the unit normal.
struct Corners {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
}

fn corners_at(triangle: u32) -> Corners {
    return Corners(triangle_texel(4u * triangle), triangle_texel(4u * triangle + 1u), triangle_texel(4u * triangle + 2u));
}

// A triangle that was hit, and the instance.
struct Located {
    triangle: u32,
    instance: u32,
}

fn located(hit: u32) -> Located {
    var triangle = hit;
    var low = 0u;
    if (INSTANCED) {
        // Counts the instances whose first hit is not after `hit`.
        var high = instance_count();
        while (low < high) {
            let middle = (low + high) / 2u;
            let is_behind = first_hit(1u + middle) > hit;
            high = select(high, middle, is_behind);
            low = select(middle + 1u, low, is_behind);
        }
        for (var i = 0u; i < min(low, 1u); i++) {
            triangle -= hit_offset(low);
        }
    }
    return Located(triangle, low);
}

// In the scene's space.
fn corners_of(found: Located) -> Corners {
    var corners = corners_at(found.triangle);
    if (INSTANCED) {
        // A loop that other triangles skip: drivers that compute both sides of a branch would make all of them pay for it.
        for (var i = 0u; i < min(found.instance, 1u); i++) {
            let placement = to_scene(found.instance);
            let normal = placed_triangle_normal(found.instance, vec3<f32>(corners.a.w, corners.b.w, corners.c.w));
            corners.a = vec4<f32>(placed_point(placement, corners.a.xyz), normal.x);
            corners.b = vec4<f32>(placed_point(placement, corners.b.xyz), normal.y);
            corners.c = vec4<f32>(placed_point(placement, corners.c.xyz), normal.z);
        }
    }
    return corners;
}

// The index in triangle_shading of the triangle that was hit.
fn scene_triangle(hit: u32) -> u32 {
    return u32(triangle_texel(4u * located(hit).triangle + 3u).x);
}
