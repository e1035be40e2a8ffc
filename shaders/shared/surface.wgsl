// Rasterises triangles as seen from a camera or from a light, and finds where the ray through a pixel's centre hits the triangle.

struct Draw {
    // k_d per band; a texture multiplies it.
    kd: vec3<f32>,
    // 1 + index of the instance, as a float: exact up to 2^24.
    instance_id: f32,
    lobe: LobeParameters,
    // 1 + index of the material.
    material_id: f32,
    // The first texel in `materials`, and its HAS_ bits.
    material: u32,
    has: u32,
    // The mesh's first vertex among the scene's.
    first_vertex: u32,
    texture: Texture,
}

#import view
#import instance

var<storage, read> positions: array<vec4<f32>>;
var<storage, read> indices: array<u32>;
var<storage, read> normals: array<vec4<f32>>;
var<storage, read> texcoords: array<vec2<f32>>;
var<immediate> draw: Draw;

// Imported here, so that its bindings come after those that both stages share.
#import plane_hit

fn tangent_in_scene(instance: u32, tangent: vec3<f32>) -> vec3<f32> {
    return placed_direction(to_scene(instance), tangent);
}

struct Raster {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) instance: u32,
}

fn corner(instance: u32, index: u32) -> Corner {
    var corner: Corner;
    corner.position = positions[index].xyz;
    if (SMOOTH | DETAILED) {
        corner.normal = normals[index].xyz;
    }
    // A loop that other surfaces skip: drivers that compute both sides of a branch would make them pay for it.
    for (var i = 0u; i < min(instance, 1u); i++) {
        corner.position = placed_point(to_scene(instance), corner.position);
        if (SMOOTH | DETAILED) {
            corner.normal = placed_normal(to_mesh(instance), corner.normal);
        }
    }
    if (TEXTURED | DETAILED) {
        corner.texcoord = texcoords[index];
    }
    return corner;
}

fn raster_triangle(raster: Raster) -> Triangle {
    var triangle: Triangle;
    triangle.corners[0] = corner(raster.instance, indices[3u * raster.triangle]);
    triangle.corners[1] = corner(raster.instance, indices[3u * raster.triangle + 1u]);
    triangle.corners[2] = corner(raster.instance, indices[3u * raster.triangle + 2u]);
    triangle.brdf = Brdf(draw.kd, draw.lobe);
    if (TEXTURED) {
        triangle.texture = draw.texture;
    }
    if (DETAILED) {
        let first = 3u * raster.triangle;
        triangle.vertices = vec3<u32>(indices[first], indices[first + 1u], indices[first + 2u]) - draw.first_vertex;
        triangle.material = draw.material;
        triangle.has = draw.has;
        triangle.instance = raster.instance;
        triangle.front = handedness(raster.instance);
    }
    return triangle;
}

fn raster_hit(raster: Raster) -> Hit {
    let pixel = vec3<f32>(1.0, raster.position.xy);
    return hit_on_plane(raster_triangle(raster), view.origin, view.ray_offset * pixel, view.ray_direction * pixel, view.forward);
}
