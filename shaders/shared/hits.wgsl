// The surface that a ray hits on a triangle.

#import hit
#import hit_triangle

// Lists in images, like ray_triangles in hit_triangle.wgsl. Four texels per triangle, in the order of Geometry: the corners' normals (0: flat),
// their texture coordinates, the material.
var triangle_shading: texture_storage_2d<rgba32float, read>;
// `hit_triangle` is what the trace pass found.
fn ray_hit(hit_triangle: u32, origin: vec3<f32>, direction: vec3<f32>) -> Hit {
    let corners = corners_of(located(hit_triangle));
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
    let material = MATERIAL_TEXELS * u32(shading3.w);
    let kd_has = material_texel(material);
    var triangle: Triangle;
    triangle.corners[0] = Corner(corners.a.xyz, shading0.xyz, shading2.yz);
    triangle.corners[1] = Corner(corners.b.xyz, vec3<f32>(shading0.w, shading1.xy), vec2<f32>(shading2.w, shading3.x));
    triangle.corners[2] = Corner(corners.c.xyz, vec3<f32>(shading1.zw, shading2.x), shading3.yz);
    triangle.normal = vec3<f32>(corners.a.w, corners.b.w, corners.c.w);
    if (SMOOTH | DETAILED) {
        if (INSTANCED) {
            for (var i = 0u; i < min(found.instance, 1u); i++) {
                let placement = to_mesh(found.instance);
                triangle.corners[0].normal = placed_normal(placement, triangle.corners[0].normal);
                triangle.corners[1].normal = placed_normal(placement, triangle.corners[1].normal);
                triangle.corners[2].normal = placed_normal(placement, triangle.corners[2].normal);
            }
        }
    }
    triangle.brdf = Brdf(kd_has.rgb, material_texel(material + 1u));
    if (TEXTURED) {
        triangle.texture = texture_at(material + KD_MAP);
    }
    if (DETAILED | EMISSIVE) {
        triangle.material = material;
        triangle.has = u32(kd_has.w);
        triangle.front = 1.0;
        if (INSTANCED) {
            triangle.front = handedness(found.instance);
        }
    }
    if (DETAILED) {
        triangle.instance = found.instance;
        for (var i = 0u; i < turns(triangle, HAS_VERTICES); i++) {
            triangle.vertices = corners_in_mesh(material, index / 4u);
        }
    }
    return triangle;
}

fn tangent_in_scene(instance: u32, tangent: vec3<f32>) -> vec3<f32> {
    var placed = tangent;
    if (INSTANCED) {
        for (var i = 0u; i < min(instance, 1u); i++) {
            placed = placed_direction(to_scene(instance), tangent);
        }
    }
    return placed;
}

// The material's place in `materials`.
fn material_at(hit_triangle: u32) -> u32 {
    return u32(textureLoad(triangle_shading, list_place(4u * scene_triangle(hit_triangle) + 3u)).w);
}
