// The surface that a ray hits on a triangle.

#import hit
#import trace

// Lists in images, like ray_triangles in trace.wgsl. Four texels per triangle, in the order of Geometry: the corners' normals (0: flat),
// their texture coordinates, the material.
var triangle_shading: texture_storage_2d<rgba32float, read>;
// Six texels per material. k_d per band, which a texture multiplies, and s, the Phong exponent; k_s per band, and the index in this list
// where its normal map is described, 0 without one. Then two texels for the texture: columns and rows (0 for none), words per texel, and
// whether it is encoded in sRGB; its first word, for word_index. Then the same two for the normal map.
var materials: texture_storage_2d<rgba32float, read>;

// `hit_triangle` is a value of ray_hit.
fn hit_surface(hit_triangle: u32, origin: vec3<f32>, direction: vec3<f32>) -> Hit {
    let corners = corners_of_hit(hit_triangle);
    let c0 = corners.a.xyz - origin;
    let c1 = corners.b.xyz - origin;
    let c2 = corners.c.xyz - origin;
    // As in triangle_hit.wgsl, from sums and differences of corners: their products do not cancel in small triangles.
    let weight = vec3<f32>(dot(direction, cross(c1 + c2, c2 - c1)), dot(direction, cross(c2 + c0, c0 - c2)),
        dot(direction, cross(c0 + c1, c1 - c0)));
    let total = weight.x + weight.y + weight.z;
    let shares = weight / select(total, 1.0, total == 0.0);
    let b1 = clamp(shares.y, 0.0, 1.0);
    let b2 = clamp(shares.z, 0.0, 1.0 - b1);
    return hit_at(triangle_at(hit_triangle), vec3<f32>(1.0 - b1 - b2, b1, b2), direction);
}

// The triangle with its shading.
fn triangle_at(hit_triangle: u32) -> Triangle {
    let found = located(hit_triangle);
    let corners = corners_of(found);
    let index = 4u * u32(triangle_texel(4u * found.triangle + 3u).x);
    let shading0 = textureLoad(triangle_shading, list_place(index));
    let shading1 = textureLoad(triangle_shading, list_place(index + 1u));
    let shading2 = textureLoad(triangle_shading, list_place(index + 2u));
    let shading3 = textureLoad(triangle_shading, list_place(index + 3u));
    let material = 6u * u32(shading3.w);
    let kd_shininess = textureLoad(materials, list_place(material));
    let ks_map = textureLoad(materials, list_place(material + 1u));
    var triangle: Triangle;
    triangle.corners[0] = Corner(corners.a.xyz, shading0.xyz, shading2.yz);
    triangle.corners[1] = Corner(corners.b.xyz, vec3<f32>(shading0.w, shading1.xy), vec2<f32>(shading2.w, shading3.x));
    triangle.corners[2] = Corner(corners.c.xyz, vec3<f32>(shading1.zw, shading2.x), shading3.yz);
    triangle.normal = vec3<f32>(corners.a.w, corners.b.w, corners.c.w);
#if SMOOTH BUMPED
#if INSTANCED SHADE
    for (var i = 0u; i < min(found.instance, 1u); i++) {
        let placement = to_mesh(found.instance);
        triangle.corners[0].normal = placed_normal(placement, triangle.corners[0].normal);
        triangle.corners[1].normal = placed_normal(placement, triangle.corners[1].normal);
        triangle.corners[2].normal = placed_normal(placement, triangle.corners[2].normal);
    }
#endif
#endif
    triangle.brdf = Brdf(kd_shininess.rgb, ks_map.rgb, kd_shininess.w);
#if TEXTURED BUMPED
    triangle.texture = texture_at(material + 2u);
#endif
#if BUMPED
    triangle.normal_map = u32(ks_map.w);
#endif
    return triangle;
}

#if BUMPED
fn normal_texture(map: u32) -> Texture {
    return texture_at(map);
}
#endif

#if TEXTURED BUMPED
// The texture that two texels of `materials` describe.
fn texture_at(index: u32) -> Texture {
    let texture = vec4<u32>(textureLoad(materials, list_place(index)));
    let first_word = word_index(textureLoad(materials, list_place(index + 1u)).xy);
    return Texture(texture.xy, first_word, texture.z, texture.w);
}
#endif

// The material's index in `materials`.
fn material_at(hit_triangle: u32) -> u32 {
    return u32(textureLoad(triangle_shading, list_place(4u * scene_triangle(hit_triangle) + 3u)).w);
}
