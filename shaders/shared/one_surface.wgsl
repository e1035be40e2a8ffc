// Decides which pixels show one surface, and fits planes over the image to their values.

#import reflect

var normal_geometric: texture_2d<f32>;

// Least cosine between the normals of two pixels.
const MIN_COSINE: f32 = 0.9;
// Largest distance of a pixel's point from the other's tangent plane, over the distance between the two points.
const MAX_SLOPE: f32 = 0.08;

// What a pixel shows.
struct Facing {
    position: vec3<f32>,
    normal: vec3<f32>,
    lobe: LobeParameters,
}

fn facing_at(pixel: vec2<u32>) -> Facing {
    return Facing(textureLoad(position_instance, pixel).xyz, textureLoad(normal_geometric, pixel, 0).xyz, lobe_at(pixel));
}

fn is_one_surface(a: Facing, b: Facing) -> bool {
    let offset = b.position - a.position;
    let off_plane = max(abs(dot(offset, a.normal)), abs(dot(offset, b.normal)));
    let is_even = dot(a.normal, b.normal) > MIN_COSINE && off_plane <= MAX_SLOPE * length(offset);
    return is_even && is_one_lobe(a.lobe, b.lobe);
}

// Sums over neighbours of weight · value, and of that times the neighbours' places: enough for a plane through the values.
struct Plane {
    sum: vec3<f32>,
    sum_x: vec3<f32>,
    sum_y: vec3<f32>,
}

fn add(plane: ptr<function, Plane>, value: vec3<f32>, weight: f32, at: vec2<f32>) {
    let weighted = weight * value;
    (*plane).sum += weighted;
    (*plane).sum_x += at.x * weighted;
    (*plane).sum_y += at.y * weighted;
}

// `shares` are the factors of the three sums.
fn value_of(plane: Plane, shares: vec3<f32>) -> vec3<f32> {
    return shares.x * plane.sum + shares.y * plane.sum_x + shares.z * plane.sum_y;
}
