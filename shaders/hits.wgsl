// What a ray finds on a triangle.

#import trace

// Lists in images, as that of triangles in trace.wgsl. Four texels a triangle, in the order of the scene: the corners' normals
// (0: flat), their texture coordinates, the material.
var triangle_shading: texture_storage_2d<rgba32float, read>;
// Three a material: k_d per band, which a texture multiplies, and s, the Phong exponent; k_s per band, and where the texture's
// texels begin; their columns and rows, 0 for none.
var materials: texture_storage_2d<rgba32float, read>;
#if TEXTURED
var texels: texture_storage_2d<rgba32float, read>;
#endif

struct Hit {
    position: vec3<f32>,
    // Unit normals, turned to the side that the ray hits.
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    kd: vec3<f32>,
    ks: vec3<f32>,
    shininess: f32,
}

// `hit_triangle` is that of ray_hit.
fn hit_surface(hit_triangle: u32, origin: vec3<f32>, direction: vec3<f32>) -> Hit {
    let corner0 = triangle_texel(4u * hit_triangle);
    let corner1 = triangle_texel(4u * hit_triangle + 1u);
    let corner2 = triangle_texel(4u * hit_triangle + 2u);
    let c0 = corner0.xyz - origin;
    let c1 = corner1.xyz - origin;
    let c2 = corner2.xyz - origin;
    // As in trace.wgsl: from sums and differences of corners, whose products do not cancel in small triangles.
    let weight = vec3<f32>(dot(direction, cross(c1 + c2, c2 - c1)), dot(direction, cross(c2 + c0, c0 - c2)),
        dot(direction, cross(c0 + c1, c1 - c0)));
    let total = weight.x + weight.y + weight.z;
    let shares = weight / select(total, 1.0, total == 0.0);
    let b1 = clamp(shares.y, 0.0, 1.0);
    let b2 = clamp(shares.z, 0.0, 1.0 - b1);
    let b = vec3<f32>(1.0 - b1 - b2, b1, b2);

    var hit: Hit;
    hit.position = corner0.xyz + b.y * (corner1.xyz - corner0.xyz) + b.z * (corner2.xyz - corner0.xyz);
    let normal = vec3<f32>(corner0.w, corner1.w, corner2.w);
    hit.geometric_normal = select(normal, -normal, dot(normal, direction) > 0.0);
    hit.shading_normal = hit.geometric_normal;
    let triangle = scene_triangle(hit_triangle);
    let word0 = textureLoad(triangle_shading, list_place(4u * triangle));
    let word1 = textureLoad(triangle_shading, list_place(4u * triangle + 1u));
    let word2 = textureLoad(triangle_shading, list_place(4u * triangle + 2u));
    let word3 = textureLoad(triangle_shading, list_place(4u * triangle + 3u));
#if SMOOTH
    let blend = b.x * word0.xyz + b.y * vec3<f32>(word0.w, word1.xy) + b.z * vec3<f32>(word1.zw, word2.x);
    let length_squared = dot(blend, blend);
    let smooth_normal = blend * inverseSqrt(max(length_squared, 1e-12));
    let turned = select(smooth_normal, -smooth_normal, dot(smooth_normal, hit.geometric_normal) < 0.0);
    hit.shading_normal = select(hit.shading_normal, turned, length_squared > 1e-12);
#endif
    let material = 3u * u32(word3.w);
    let kd_shininess = textureLoad(materials, list_place(material));
    let ks_first_texel = textureLoad(materials, list_place(material + 1u));
    hit.kd = kd_shininess.rgb;
    hit.ks = ks_first_texel.rgb;
    hit.shininess = kd_shininess.w;
#if TEXTURED
    let size = vec2<u32>(textureLoad(materials, list_place(material + 2u)).xy);
    if (size.x > 0u) {
        let texcoord = b.x * word2.yz + b.y * vec2<f32>(word2.w, word3.x) + b.z * word3.yz;
        hit.kd *= sample_kd(texcoord, u32(ks_first_texel.w), size);
    }
#endif
    return hit;
}

#if TEXTURED
// Bilinear, repeating, v up, as the raster passes do it.
fn sample_kd(texcoord: vec2<f32>, first: u32, size: vec2<u32>) -> vec3<f32> {
    let place = fract(vec2<f32>(texcoord.x, 1.0 - texcoord.y)) * vec2<f32>(size) - 0.5;
    let corner = floor(place);
    let weight = place - corner;
    let low = (vec2<u32>(vec2<i32>(corner) + vec2<i32>(size))) % size;
    let high = (low + 1u) % size;
    let above = mix(texel(first + low.y * size.x + low.x), texel(first + low.y * size.x + high.x), weight.x);
    let below = mix(texel(first + high.y * size.x + low.x), texel(first + high.y * size.x + high.x), weight.x);
    return mix(above, below, weight.y);
}

fn texel(index: u32) -> vec3<f32> {
    return textureLoad(texels, list_place(index)).rgb;
}
#endif
