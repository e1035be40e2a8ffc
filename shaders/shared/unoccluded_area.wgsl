// The light of an area without occlusion, in closed form: Lambert's formula for a polygon (Photometria, 1760), cut off at the receiver's
// horizon. A disc is a polygon of as large an area.

#import light

const DISC_EDGES: u32 = 32u;
// √(2π/32/sin(2π/32)): radius of the corners over that of the disc.
const DISC_CORNER: f32 = 1.0032250;
// Distance over the area's size from which points are as good as the closed form, whose terms cancel each other there.
const FAR: f32 = 32.0;

fn area_corner(light: Light, index: u32) -> vec3<f32> {
    let is_disc = light.area_aspect < 0.0;
    let turn = 2.0 * PI * f32(index) / f32(DISC_EDGES);
    let of_rectangle = vec2<f32>(select(-1.0, 1.0, index % 4u == 1u | index % 4u == 2u), select(-1.0, 1.0, index % 4u >= 2u));
    let across = select(of_rectangle, DISC_CORNER * vec2<f32>(cos(turn), sin(turn)), is_disc);
    return across.x * light.plane_0 + across.y * abs(light.area_aspect) * cross(light.axis, light.plane_0);
}

// Where an edge meets the horizon, if `a` and `b` are on different sides of it, at these heights.
fn at_horizon(a: vec3<f32>, b: vec3<f32>, heights: vec2<f32>) -> vec3<f32> {
    return a + (heights.x / (heights.x - heights.y)) * (b - a);
}

// Angle that an edge subtends, times the cosine between the normal and the plane of the edge and the receiver.
fn of_edge(a: vec3<f32>, b: vec3<f32>, normal: vec3<f32>) -> f32 {
    let across = cross(a, b);
    let sine = length(across);
    return angle_of(sine, dot(a, b)) * dot(across, normal) / max(sine, 1e-37);
}

// ∫ cosθ_P dω over the area: E_P over its radiance. Negative: the area is too far away for it.
fn area_form_factor(light: Light, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    let middle = light.position - position;
    let size_squared = dot(light.plane_0, light.plane_0) * (1.0 + light.area_aspect * light.area_aspect);
    let is_behind = dot(light.axis, middle) >= 0.0;
    let edges = select(4u, DISC_EDGES, light.area_aspect < 0.0);
    var sum = 0.0;
    // Where the outline sinks below the horizon, and where it rises.
    var sinks = vec3<f32>(0.0);
    var rises = vec3<f32>(0.0);
    for (var i = 0u; i < edges; i++) {
        let a = middle + area_corner(light, i);
        let b = middle + area_corner(light, (i + 1u) % edges);
        let heights = vec2<f32>(dot(a, normal), dot(b, normal));
        let is_above = heights > vec2<f32>(0.0);
        let meeting = at_horizon(a, b, heights);
        sinks = select(sinks, meeting, is_above.x & !is_above.y);
        rises = select(rises, meeting, !is_above.x & is_above.y);
        let part = of_edge(select(meeting, a, is_above.x), select(meeting, b, is_above.y), normal);
        sum += select(0.0, part, is_above.x | is_above.y);
    }
    // The edge along the horizon; 0 if there is none.
    sum += of_edge(sinks, rises, normal);
    let is_far = dot(middle, middle) > FAR * FAR * size_squared;
    return select(select(0.5 * abs(sum), 0.0, is_behind), -1.0, is_far);
}

// Area, local units².
fn area_of(light: Light) -> f32 {
    let square = dot(light.plane_0, light.plane_0) * abs(light.area_aspect);
    return square * select(4.0, PI, light.area_aspect < 0.0);
}

// The factor to the mean light of some points which makes it right if nothing is hidden: a ratio estimator (after Heitz et al., "Combining
// analytic direct illumination and stochastic shadows", 2018). `unoccluded` is the mean over the points, all bands together.
fn area_ratio(light: Light, form_factor: f32, unoccluded: f32) -> f32 {
    // Radiance, all bands together.
    let radiance = dot(light.intensity, vec3<f32>(1.0)) / area_of(light);
    let is_known = form_factor >= 0.0 && unoccluded > 0.0;
    return select(1.0, form_factor * radiance / max(unoccluded, 1e-37), is_known);
}
