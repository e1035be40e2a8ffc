// A light, and how it reaches a point. Lengths are local units.

#import math
#import random

// Height of a light over a plane that rounding of either may make up, for each component of the normal. A lamp that is mounted on a
// surface lights what is before it: for its rays and for its RSM the surface is not there.
const LIGHT_IN_PLANE: f32 = 12.0 * 5.9604645e-8;
// Longer than the scene, local units.
const T_MAX: f32 = 8.0;

// One face of a light's map: the direction of (u, v) in [−1, 1]² is forward + half_extent·(u·right + v·up).
struct LightFace {
    right: vec3<f32>,
    up: vec3<f32>,
    forward: vec3<f32>,
}

// Of a cube; spots and parallel light have one.
const MAX_FACES: u32 = 6u;

struct Light {
    // L; directional: the centre of the map's plane.
    position: vec3<f32>,
    // Tangent of the half opening of a face; directional: half the edge of the map's plane.
    half_extent: f32,
    // Unit vector: axis of the cone (spot), of the pattern or of the projector, direction in which the light travels (directional).
    axis: vec3<f32>,
    // θ_o, rad; spot only.
    outer_half_angle: f32,
    // I_0 per band over the local unit squared, so that I_0/d² is W/m²; directional: E_L, W/m².
    intensity: vec3<f32>,
    // 1/(θ_o − θ_i); huge where they are equal; spot only.
    inverse_penumbra: f32,
    faces: array<LightFace, MAX_FACES>,
    face_count: u32,
    // Texels along a face's edge of the map that the shadow test reads.
    shadow_size: u32,
    // Cells along a face's edge of the emission domain: texels of the RSM, or tiles that final gathering sends rays through.
    emission_size: u32,
    // ΣΔΩ over the cells: the measure of the emission domain.
    emission_measure: f32,
    // 1 for a directional light, else 0.
    is_parallel: u32,
    // Where its VPLs, or its tiles, begin in lists that all lights share.
    first_vpl: u32,
    first_tile: u32,
    // 1 where it is modulated.
    is_modulated: u32,
    // Phase at the local origin of each frequency of the modulation.
    origin_turns: vec4<f32>,
    // The plane C = 0 of a pattern, or up in the image of a projector: a unit vector. Nodes of γ and of C, or pixels of a row and rows; 0 without a
    // pattern.
    plane_0: vec3<f32>,
    pattern_columns: u32,
    pattern_rows: u32,
    // 1 for a projector, else 0.
    is_projected: u32,
    // Where it begins in a list of lights, texels.
    first_pattern: u32,
    // Of a light with an area, whose half width is then plane_0: height over width; below 0 of a disc. 0 for all others.
    area_aspect: f32,
}

// From the middle of a light's area to a place, one of the unit square; 0 without an area.
fn area_offset(light: Light, place: vec2<f32>) -> vec3<f32> {
    let turn = 2.0 * PI * place.y;
    let across = select(2.0 * place - 1.0, sqrt(place.x) * vec2<f32>(cos(turn), sin(turn)), light.area_aspect < 0.0);
    let upright = abs(light.area_aspect) * cross(light.axis, light.plane_0);
    return select(vec3<f32>(0.0), across.x * light.plane_0 + across.y * upright, light.area_aspect != 0.0);
}

// A point of the unit square for each number, which are even over it however many there are (src/lattice.rs), shifted by a seed.
fn area_place(number: u32, seed: u32) -> vec2<f32> {
    let x = f32(reverseBits(number) >> 8u) * 5.9604645e-8;
    return fract(vec2<f32>(x, fract(99.0 * x)) + vec2<f32>(unit(hash(seed)), unit(hash(seed ^ 0x9e3779b9u))));
}

// A light as rays lead to it: its position and 1, or a direction to it, longer than the scene, and 0.
fn light_end(light: Light) -> vec4<f32> {
    return select(vec4<f32>(light.position, 1.0), vec4<f32>(-T_MAX * light.axis, 0.0), light.is_parallel == 1u);
}

// How a light reaches a point where nothing is in its way.
struct Illumination {
    // Unit vector.
    to_light: vec3<f32>,
    // s(θ)·I_0/d², p·I_0/d² or E_L: what a surface receives that faces the light.
    irradiance: vec3<f32>,
}

// By a lamp that emits alike in all directions.
fn illuminate_evenly(light: Light, position: vec3<f32>) -> Illumination {
    let from_light = position - light.position;
    let distance_squared = max(dot(from_light, from_light), 1e-18);
    let to_light = -from_light * inverseSqrt(distance_squared);
    // A light in the surface itself lights nothing there: the direction to it is not defined.
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
    // Half the edge of the map's square that the point lies in.
    half_extent: f32,
    // 0 to 1 over the map's columns and rows; outside for a point that the map does not show.
    place: vec2<f32>,
}

fn map_place(light: Light, from_light: vec3<f32>) -> MapPlace {
    var face = 0u;
    var depth = dot(from_light, light.faces[0].forward);
    var right = light.faces[0].right;
    var up = light.faces[0].up;
    // A light with fewer faces has copies of its first.
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

// Area of a cell of the emission domain where its ray meets a surface that faces the light, local units². Not cut at the rim of
// the domain.
fn facing_cell_area(light: Light, from_light: vec3<f32>, depth: f32) -> f32 {
    let edge = 2.0 * light.half_extent / f32(light.emission_size);
    // ΔΩ·d² = edge²·(depth/d)³·d²
    let narrowing = depth * depth * depth * inverseSqrt(max(dot(from_light, from_light), 1e-18));
    return edge * edge * select(narrowing, 1.0, light.is_parallel == 1u);
}
