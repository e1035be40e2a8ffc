// The surface where a ray hits it.

#import materials

struct Hit {
    position: vec3<f32>,
    // Unit normals, on the side that the ray hits.
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    // Includes textures and colours of vertices.
    brdf: Brdf,
    // Radiance; only where it is asked for.
    emission: vec3<f32>,
}

// The point with barycentric coordinates `b`, hit from `direction`.
fn hit_at(triangle: Triangle, b: vec3<f32>, direction: vec3<f32>) -> Hit {
    let c0 = triangle.corners[0];
    let c1 = triangle.corners[1];
    let c2 = triangle.corners[2];
    var hit: Hit;
    // Computed from the triangle, not along the ray: the ray's rounding would lift the point off the surface. So the point is on the
    // triangle's plane up to rounding, however far the origin is.
    hit.position = c0.position + b.y * (c1.position - c0.position) + b.z * (c2.position - c0.position);
    hit.geometric_normal = select(triangle.normal, -triangle.normal, dot(triangle.normal, direction) > 0.0);
    hit.shading_normal = hit.geometric_normal;
    hit.brdf = triangle.brdf;
    var has_normal = false;
    var is_turned = false;
    if (SMOOTH | DETAILED) {
        // Opposed normals may cancel; then the triangle's own normal stays.
        let blend = b.x * c0.normal + b.y * c1.normal + b.z * c2.normal;
        let length_squared = dot(blend, blend);
        has_normal = length_squared > 1e-12;
        let smooth_normal = blend * inverseSqrt(max(length_squared, 1e-12));
        is_turned = dot(smooth_normal, hit.geometric_normal) < 0.0;
        hit.shading_normal = select(hit.shading_normal, select(smooth_normal, -smooth_normal, is_turned), has_normal);
    }
    if (TEXTURED) {
        if (triangle.texture.size.x > 0u) {
            let texcoord = b.x * c0.texcoord + b.y * c1.texcoord + b.z * c2.texcoord;
            hit.brdf.kd *= sample_texture(triangle.texture, texcoord);
        }
    }
    if (DETAILED) {
        for (var i = 0u; i < turns(triangle, HAS_COLORS); i++) {
            hit.brdf.kd *= color_at(triangle, b);
        }
        for (var i = 0u; i < turns(triangle, HAS_KD_MAP); i++) {
            hit.brdf.kd *= sample_map(triangle, KD_MAP, b);
        }
        if (SPECULAR) {
            for (var map = 0u; map < LOBE_MAPS; map++) {
                for (var i = 0u; i < turns(triangle, HAS_LOBE_MAP << map); i++) {
                    hit.brdf.lobe = mapped_lobe(hit.brdf.lobe, map, sample_map(triangle, LOBE_MAP + map * MAP_TEXELS, b));
                }
            }
        }
        for (var i = 0u; i < turns(triangle, HAS_NORMAL_MAP); i++) {
            // The front is the side of the mesh's normals; without them, the side on which the corners turn counterclockwise.
            let is_behind = select(triangle.front * dot(triangle.normal, direction) > 0.0, is_turned, has_normal);
            hit.shading_normal = mapped_normal(triangle, b, hit.geometric_normal, hit.shading_normal, is_behind);
        }
    }
    if (EMISSIVE) {
        let is_back = (triangle.has & HAS_ONE_SIDE) != 0u & triangle.front * dot(triangle.normal, direction) > 0.0;
        hit.emission = select(material_texel(triangle.material + EMISSION).rgb, vec3<f32>(0.0), is_back);
        if (DETAILED) {
            if (texture_at(triangle.material + EMISSION_MAP).size.x > 0u) {
                hit.emission *= sample_map(triangle, EMISSION_MAP, b);
            }
        }
    }
    hit.brdf = brdf_of_material(hit.brdf);
    return hit;
}
