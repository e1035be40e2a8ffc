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

// Sides of triangles that emit, by their corners, counterclockwise as the receiver sees them if they face it. The first corner has the
// radiance, all bands together. Before them: their number; 0 if the closed form is not for them.
var<storage, read> emissive_sides: array<vec4<f32>>;

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

// The outline of an area above the receiver's horizon: the sum over its edges, where it sinks below the horizon, and where it rises.
struct Outline {
    sum: f32,
    sinks: vec3<f32>,
    rises: vec3<f32>,
}

fn add_edge(outline: ptr<function, Outline>, a: vec3<f32>, b: vec3<f32>, normal: vec3<f32>) {
    let heights = vec2<f32>(dot(a, normal), dot(b, normal));
    let is_above = heights > vec2<f32>(0.0);
    let meeting = at_horizon(a, b, heights);
    (*outline).sinks = select((*outline).sinks, meeting, is_above.x & !is_above.y);
    (*outline).rises = select((*outline).rises, meeting, !is_above.x & is_above.y);
    let part = of_edge(select(meeting, a, is_above.x), select(meeting, b, is_above.y), normal);
    (*outline).sum += select(0.0, part, is_above.x | is_above.y);
}

// ∫ cosθ_P dω over what the outline encloses. The edge along the horizon is 0 if there is none.
fn enclosed(outline: Outline, normal: vec3<f32>) -> f32 {
    return 0.5 * abs(outline.sum + of_edge(outline.sinks, outline.rises, normal));
}

// ∫ cosθ_P dω over the area: E_P over its radiance. Negative: the area is too far away for it.
fn area_form_factor(light: Light, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    let middle = light.position - position;
    let size_squared = dot(light.plane_0, light.plane_0) * (1.0 + light.area_aspect * light.area_aspect);
    let is_behind = dot(light.axis, middle) >= 0.0;
    let edges = select(4u, DISC_EDGES, light.area_aspect < 0.0);
    var outline: Outline;
    for (var i = 0u; i < edges; i++) {
        add_edge(&outline, middle + area_corner(light, i), middle + area_corner(light, (i + 1u) % edges), normal);
    }
    let is_far = dot(middle, middle) > FAR * FAR * size_squared;
    return select(select(enclosed(outline, normal), 0.0, is_behind), -1.0, is_far);
}

// ∫ cosθ_P dω over a triangle with corners relative to P. Far away, where the terms of the outline cancel each other, by three points.
fn triangle_form_factor(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, normal: vec3<f32>) -> f32 {
    let across = cross(b - a, c - a);
    var outline: Outline;
    add_edge(&outline, a, b, normal);
    add_edge(&outline, b, c, normal);
    add_edge(&outline, c, a, normal);
    var of_points = 0.0;
    let middles = array(0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    for (var i = 0u; i < 3u; i++) {
        let distance_squared = max(dot(middles[i], middles[i]), 1e-18);
        of_points += max(dot(middles[i], normal), 0.0) * max(-dot(across, middles[i]), 0.0) / (6.0 * distance_squared * distance_squared);
    }
    let is_far = dot(a, a) > FAR * FAR * max(dot(b - a, b - a), dot(c - a, c - a));
    let is_behind = dot(across, a) >= 0.0;
    return select(select(enclosed(outline, normal), of_points, is_far), 0.0, is_behind);
}

// E_P of the area without occlusion, all bands together. Negative: not known.
fn unoccluded_irradiance(light: Light, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    if (SURFACES) {
        let count = u32(emissive_sides[0].x);
        var sum = 0.0;
        for (var i = 0u; i < count; i++) {
            let a = emissive_sides[1u + 3u * i];
            let b = emissive_sides[2u + 3u * i].xyz;
            let c = emissive_sides[3u + 3u * i].xyz;
            sum += a.w * triangle_form_factor(a.xyz - position, b - position, c - position, normal);
        }
        return select(-1.0, sum, count > 0u);
    } else {
        // Radiance, all bands together.
        let radiance = dot(light.intensity, vec3<f32>(1.0)) / area_of(light);
        return radiance * area_form_factor(light, position, normal);
    }
}

// Area, local units².
fn area_of(light: Light) -> f32 {
    let square = dot(light.plane_0, light.plane_0) * abs(light.area_aspect);
    return square * select(4.0, PI, light.area_aspect < 0.0);
}

// The factor to the mean light of some points which makes it right if nothing is hidden: a ratio estimator (after Heitz et al., "Combining
// analytic direct illumination and stochastic shadows", 2018). Both are without occlusion, all bands together: in closed form, and the mean
// over the points.
fn area_ratio(closed_form: f32, of_points: f32) -> f32 {
    let is_known = closed_form >= 0.0 && of_points > 0.0;
    return select(1.0, closed_form / max(of_points, 1e-37), is_known);
}
