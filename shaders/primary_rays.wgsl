// What the camera sees at each pixel's centre, by rays. Used for a lens with distortion, for surfaces that emit, and if the device's
// rasteriser is too coarse. One kernel emits the rays, another fills the G-buffer with the surfaces that they hit. In between, if a scene
// has one-sided surfaces, a kernel lets the rays go on that hit such a surface from behind. After both, one adds what the surfaces emit.

#import view
#import ray
#import plane_hit
#import hits

#if PEEL
struct PeelParameters {
    ray_count: u32,
    // Counted from 1.
    round: u32,
}

var<storage, read_write> rays: array<Ray>;
var<storage, read_write> hits: array<u32>;
// The last round in which a ray went on.
var<storage, read_write> last_round: atomic<u32>;
var<immediate> parameters: PeelParameters;

// A ray that has found what the camera sees keeps it instead of an origin.
fn ended(hit: u32) -> Ray {
    return Ray(vec3<f32>(f32(hit & 0xffffu), f32(hit >> 16u), 0.0), NO_RAY, vec3<f32>(0.0), 0.0);
}

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = 64u * (group.x + 65535u * group.y) + local;
    if (index >= parameters.ray_count) {
        return;
    }
    let ray = rays[index];
    if (ray.t_max < 0.0) {
        hits[index] = u32(ray.origin.x) | (u32(ray.origin.y) << 16u);
        return;
    }
    let seen = hits[index];
    var next = ended(seen);
    if (seen != NOTHING_HIT) {
        let found = located(seen);
        let corners = corners_of(found);
        let normal = vec3<f32>(corners.a.w, corners.b.w, corners.c.w);
        var along_front = dot(normal, ray.direction);
        if (INSTANCED) {
            along_front *= handedness(found.instance);
        }
        let has = u32(material_texel(MATERIAL_TEXELS * material_at(seen)).w);
        if (((has & HAS_ONE_SIDE) != 0u) & (along_front > 0.0)) {
            // In its plane, where the ray ignores it. More from round to round, so that no rounding keeps rays for ever.
            let end_height = f32(parameters.round) * ORIGIN_SHIFT;
            next = Ray(ray_hit(seen, ray.origin, ray.direction).position, NO_END, ray.direction, end_height);
            atomicMax(&last_round, parameters.round);
        }
    }
    rays[index] = next;
}
#else
struct PrimaryRayParameters {
    resolution_px: vec2<u32>,
    // Number of materials. The material list holds each one twice: with and without texture.
    material_count: u32,
    // Meshes in the scene's space.
    mesh_count: u32,
    // Where the rays cross their pixels, relative to the centre.
    offset_px: vec2<f32>,
    // The rows of pixels whose rays are in the list.
    first_row: u32,
    row_end: u32,
    // Weight of these points in their pixels, for the light that surfaces emit.
    share: f32,
}

// With a lens: the direction of each pixel's ray along the camera's axes Z, X, Y. The columns of view.ray_direction are these axes. Fourth: 1
// for a pixel that sees nothing.
var<storage, read> lens_rays: array<vec4<f32>>;
#if EMIT
var<storage, read_write> rays: array<Ray>;
#else
var<storage, read> hits: array<u32>;
#endif
#if EMISSIVE
var emission: texture_storage_2d<rgba32float, read_write>;
#endif
#if TRIANGLES
// As the kernel of gbuffer.wgsl fills it.
var seen_triangles: texture_storage_2d<rgba32float, write>;
#endif
#if SHADE
// For each mesh in the scene's space: number of triangles up to its end, and its instance id.
var<storage, read> mesh_ends: array<vec2<u32>>;
var position_instance: texture_storage_2d<rgba32float, write>;
var normal_geometric: texture_storage_2d<rgba32float, write>;
var kd_material: texture_storage_2d<rgba32float, write>;
var lobe_parameters: texture_storage_2d<rgba32float, write>;
#endif
var<immediate> parameters: PrimaryRayParameters;

fn ray_index(place: vec2<u32>) -> u32 {
    return (place.y - parameters.first_row) * parameters.resolution_px.x + place.x;
}

fn lens_ray(place: vec2<u32>) -> vec3<f32> {
    return lens_rays[place.y * parameters.resolution_px.x + place.x].xyz;
}

fn ray_direction(place: vec2<u32>) -> vec3<f32> {
    if (LENS) {
        // Between the pixels' centres the direction is linear in the place, to 1e-3 of a pixel.
        let last = parameters.resolution_px - 1u;
        let left = lens_ray(vec2<u32>(max(place.x, 1u) - 1u, place.y));
        let right = lens_ray(vec2<u32>(min(place.x + 1u, last.x), place.y));
        let above = lens_ray(vec2<u32>(place.x, max(place.y, 1u) - 1u));
        let below = lens_ray(vec2<u32>(place.x, min(place.y + 1u, last.y)));
        let is_inside = vec2<f32>(select(vec2<u32>(1u), vec2<u32>(2u), (place > vec2<u32>(0u)) & (place < last)));
        let steps = parameters.offset_px / is_inside;
        return view.ray_direction * (lens_ray(place) + steps.x * (right - left) + steps.y * (below - above));
    } else {
        return view.ray_direction * vec3<f32>(1.0, vec2<f32>(place) + 0.5);
    }
}

// Where the ray starts, from the view's origin: elsewhere only in a parallel view.
fn ray_offset(place: vec2<u32>) -> vec3<f32> {
    if (LENS) {
        return vec3<f32>(0.0);
    } else {
        return view.ray_offset * vec3<f32>(1.0, vec2<f32>(place) + 0.5);
    }
}

#if EMIT
@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let place = global.xy + vec2<u32>(0u, parameters.first_row);
    if (place.x < parameters.resolution_px.x && place.y < parameters.row_end) {
        var end = NO_END;
        if (LENS) {
            let is_unseen = lens_rays[place.y * parameters.resolution_px.x + place.x].w > 0.0;
            end = select(NO_END, NO_RAY, is_unseen);
        }
        rays[ray_index(place)] = Ray(view.origin + ray_offset(place), end, ray_direction(place), 0.0);
    }
}
#else
fn seen_surface(place: vec2<u32>, seen: u32) -> Hit {
    let direction = ray_direction(place);
    let axis = direction / dot(direction, direction);
    return hit_on_plane(triangle_at(seen), view.origin, ray_offset(place), direction, axis);
}
#endif

#if TRIANGLES
@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let place = global.xy + vec2<u32>(0u, parameters.first_row);
    if (place.x >= parameters.resolution_px.x || place.y >= parameters.row_end) {
        return;
    }
    let seen = hits[ray_index(place)];
    var shown = vec4<f32>(0.0);
    if (seen != NOTHING_HIT) {
        let direction = ray_direction(place);
        let axis = direction / dot(direction, direction);
        let b = place_on_plane(triangle_at(seen), view.origin, ray_offset(place), direction, axis);
        shown = vec4<f32>(f32(1u + scene_triangle(seen)), b.yz, 0.0);
    }
    textureStore(seen_triangles, place, shown);
}
#endif

#if EMISSIVE
@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let place = global.xy + vec2<u32>(0u, parameters.first_row);
    if (place.x >= parameters.resolution_px.x || place.y >= parameters.row_end) {
        return;
    }
    let seen = hits[ray_index(place)];
    if (seen != NOTHING_HIT) {
        let emitted = parameters.share * seen_surface(place, seen).emission;
        textureStore(emission, place, textureLoad(emission, place) + vec4<f32>(emitted, 0.0));
    }
}
#endif

#if SHADE
@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let place = global.xy + vec2<u32>(0u, parameters.first_row);
    if (place.x >= parameters.resolution_px.x || place.y >= parameters.row_end) {
        return;
    }
    let seen = hits[ray_index(place)];
    if (seen == NOTHING_HIT) {
        textureStore(position_instance, place, vec4<f32>(0.0));
        textureStore(normal_geometric, place, vec4<f32>(0.0));
        textureStore(kd_material, place, vec4<f32>(0.0));
        if (SPECULAR) {
            textureStore(lobe_parameters, place, vec4<f32>(0.0));
        }
        return;
    }
    let hit = seen_surface(place, seen);
    let material = material_at(seen) % parameters.material_count;
    textureStore(position_instance, place, vec4<f32>(hit.position, f32(instance_id_at(seen))));
    textureStore(normal_geometric, place, vec4<f32>(hit.shading_normal, pack_direction(hit.geometric_normal)));
    textureStore(kd_material, place, vec4<f32>(hit.brdf.kd, f32(1u + material)));
    if (SPECULAR) {
        textureStore(lobe_parameters, place, hit.brdf.lobe);
    }
}

fn instance_id_at(seen: u32) -> u32 {
    let instance = located(seen).instance;
    if (instance > 0u) {
        return instance_id_of(instance);
    }
    return mesh_ends[mesh_of(scene_triangle(seen))].y;
}

// The first mesh that ends after the triangle.
fn mesh_of(triangle: u32) -> u32 {
    var low = 0u;
    var high = parameters.mesh_count - 1u;
    loop {
        if (low >= high) {
            break;
        }
        let middle = (low + high) / 2u;
        let is_behind = mesh_ends[middle].x <= triangle;
        low = select(low, middle + 1u, is_behind);
        high = select(middle, high, is_behind);
    }
    return low;
}
#endif
#endif
