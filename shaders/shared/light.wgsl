// A light, and how it reaches a point. Lengths are local units.

#import math
#import random
#import ray

// Height of a light over a plane that rounding of either may cause, for each component of the normal. A lamp mounted on a surface lights
// what is in front of it: its rays and its RSM ignore that surface.
const LIGHT_IN_PLANE: f32 = 12.0 * 5.9604645e-8;
// Longer than the scene, in local units.
const T_MAX: f32 = 8.0;

// One face of a light's map: the direction of (u, v) in [−1, 1]² is forward + half_extent·(u·right + v·up).
struct LightFace {
    right: vec3<f32>,
    up: vec3<f32>,
    forward: vec3<f32>,
}

// The faces of a cube. Spot and directional lights have one face.
const MAX_FACES: u32 = 6u;

struct Light {
    // L; directional: the centre of the map's plane.
    position: vec3<f32>,
    // Tangent of half a face's opening angle; directional: half the edge of the map's plane.
    half_extent: f32,
    // Unit vector: the axis of the cone (spot), of the pattern or of the projector; or the direction in which the light travels
    // (directional).
    axis: vec3<f32>,
    // θ_o, rad; spot only.
    outer_half_angle: f32,
    // I_0 per band over the local unit squared, so that I_0/d² is W/m²; directional: E_L, W/m².
    intensity: vec3<f32>,
    // 1/(θ_o − θ_i); huge where they are equal; spot only.
    inverse_penumbra: f32,
    faces: array<LightFace, MAX_FACES>,
    face_count: u32,
    // Texels along a face's edge in the map that the shadow test reads.
    shadow_size: u32,
    // Cells along a face's edge of the emission domain: texels of the RSM, or the tiles that final gathering sends rays through.
    emission_size: u32,
    // ΣΔΩ over the cells: the measure of the emission domain.
    emission_measure: f32,
    // 1 for a directional light, else 0.
    is_parallel: u32,
    // First index of its VPLs and of its tiles, in lists that all lights share.
    first_vpl: u32,
    first_tile: u32,
    // 1 if it is modulated.
    is_modulated: u32,
    // Phase at the local origin, for each frequency of the modulation.
    origin_turns: vec4<f32>,
    // Unit vector: the plane C = 0 of a pattern, or up in a projector's image. Then the number of nodes of γ and of C, or pixels per row
    // and rows; 0 without a pattern.
    plane_0: vec3<f32>,
    pattern_columns: u32,
    pattern_rows: u32,
    // 1 for a projector, else 0.
    is_projected: u32,
    // Where its pattern or its points begin in a list of lights, in texels.
    first_pattern: u32,
    // Area lights: height over width, negative for a disc; half the width is then plane_0. 0 for all other lights.
    area_aspect: f32,
    // Points that stand for emissive surfaces; 0 for all other lights.
    emission_points: u32,
}

// Offset from the centre of the light's area to `place`, a point of the unit square; 0 without an area.
fn area_offset(light: Light, place: vec2<f32>) -> vec3<f32> {
    let turn = 2.0 * PI * place.y;
    let across = select(2.0 * place - 1.0, sqrt(place.x) * vec2<f32>(cos(turn), sin(turn)), light.area_aspect < 0.0);
    let upright = abs(light.area_aspect) * cross(light.axis, light.plane_0);
    return select(vec3<f32>(0.0), across.x * light.plane_0 + across.y * upright, light.area_aspect != 0.0);
}

// A point of the unit square for each number, shifted by a seed. Any number of these points covers the square evenly (src/lattice.rs).
fn area_place(number: u32, seed: u32) -> vec2<f32> {
    let x = f32(reverseBits(number) >> 8u) * 5.9604645e-8;
    return fract(vec2<f32>(x, fract(99.0 * x)) + vec2<f32>(unit(hash(seed)), unit(hash(seed ^ 0x9e3779b9u))));
}

// A light as rays lead to it: its position and 1; or a direction to it, longer than the scene, and 0.
fn light_end(light: Light) -> vec4<f32> {
    return select(vec4<f32>(light.position, 1.0), vec4<f32>(-T_MAX * light.axis, 0.0), light.is_parallel == 1u);
}

// A ray to a light. It is relative to its start, near which positions are exact: the light may be far away. The rounding of its direction
// moves its end.
fn ray_to_light(start: vec3<f32>, light_end: vec4<f32>, is_wanted: bool) -> Ray {
    return Ray(start, select(NO_RAY, 1.0, is_wanted), light_end.xyz - light_end.w * start, 2.0 * LIGHT_IN_PLANE);
}

// Light that reaches a point if nothing blocks it.
struct Illumination {
    // Unit vector.
    to_light: vec3<f32>,
    // s(θ)·I_0/d², p·I_0/d² or E_L: irradiance of a surface that faces the light.
    irradiance: vec3<f32>,
}

// From a lamp that emits equally in all directions.
fn illuminate_evenly(light: Light, position: vec3<f32>) -> Illumination {
    let from_light = position - light.position;
    let distance_squared = max(dot(from_light, from_light), 1e-18);
    let to_light = -from_light * inverseSqrt(distance_squared);
    // A light at the point itself lights nothing there: the direction to it is not defined.
    let irradiance = select(vec3<f32>(0.0), light.intensity / distance_squared, any(from_light != vec3<f32>(0.0)));
    return Illumination(to_light, irradiance);
}

// s(θ): 1 inside θ_i, cos(½π·(θ−θ_i)/(θ_o−θ_i)) up to θ_o, 0 outside.
fn spot_falloff(light: Light, direction: vec3<f32>) -> f32 {
    let angle = angle_between(light.axis, direction);
    let inside = clamp((light.outer_half_angle - angle) * light.inverse_penumbra, 0.0, 1.0);
    return sin_quarter(inside * (0.5 * PI));
}

// Where a light's map shows a point.
struct MapPlace {
    face: u32,
    // Along the face's axis.
    depth: f32,
    // Half the edge of the map's square at the depth of the point.
    half_extent: f32,
    // 0 to 1 over the map's columns and rows; outside this range if the map does not show the point.
    place: vec2<f32>,
}

fn map_place(light: Light, from_light: vec3<f32>) -> MapPlace {
    var face = 0u;
    var depth = dot(from_light, light.faces[0].forward);
    var right = light.faces[0].right;
    var up = light.faces[0].up;
    // A light with fewer faces has copies of its first face.
#repeat FACE 6
    let along_FACE = dot(from_light, light.faces[FACE].forward);
    let is_deeper_FACE = along_FACE > depth;
    face = select(face, FACEu, is_deeper_FACE);
    depth = select(depth, along_FACE, is_deeper_FACE);
    right = select(right, light.faces[FACE].right, is_deeper_FACE);
    up = select(up, light.faces[FACE].up, is_deeper_FACE);
#endrepeat
    let half_extent = light.half_extent * select(depth, 1.0, light.is_parallel == 1u);
    let across = vec2<f32>(dot(from_light, right), -dot(from_light, up));
    return MapPlace(face, depth, half_extent, 0.5 + 0.5 * (across / half_extent));
}

// Area of a cell of the emission domain where its ray hits a surface that faces the light, local units². The rim of the domain does not cut
// it.
fn facing_cell_area(light: Light, from_light: vec3<f32>, depth: f32) -> f32 {
    let edge = 2.0 * light.half_extent / f32(light.emission_size);
    // ΔΩ·d² = edge²·(depth/d)³·d²
    let narrowing = depth * depth * depth * inverseSqrt(max(dot(from_light, from_light), 1e-18));
    return edge * edge * select(narrowing, 1.0, light.is_parallel == 1u);
}
