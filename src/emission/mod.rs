//! The emission domain of a light, cut into the faces and texels of its reflective shadow map (RSM).
//!
//! The GPU draws the faces. The tables made here state how much of the light's emission each texel represents. Their sums are exact: the
//! texels of a point or spot light carry the power P_L, those of a directional light the power that crosses the disc over the scene.

mod pattern;
mod projected;
mod texels;

use std::f64::consts::PI;

use glam::DVec3;

use crate::model::{CompensatedSum, peak_intensity};
use crate::scene::{
    Bands, BoundingSphere, ConeIntegral, EmissiveSurfaces, Lamp, Light, Pattern, PatternAxes,
    Profile, SpotCone,
};
use pattern::PatternTexels;
use projected::projected_face;
use texels::ConeFace;

/// Widest outer half angle for which a spot light or a pattern gets one perspective face. With a wider one, texels at the rim would be more
/// than eight times smaller (cos³ 60°) than those at the axis.
const SINGLE_FACE_OUTER_HALF_ANGLE_DEG: f64 = 60.0;

/// A face is this much larger than the cone or disc in it, so that f32 rounding cannot clip the rim.
const FACE_MARGIN: f64 = 1.0 + 1e-6;

/// The orthographic depth range is this much longer than the scene, so that f32 rounding cannot clip its ends.
const DEPTH_MARGIN: f64 = 1.01;

/// How a face is projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// Rays start at the light and pass through the texel centres.
    Perspective,
    /// Rays start at the texel centres and run along `forward`.
    Orthographic,
}

/// One square face. `right`, `up`, `forward` are orthonormal with right = forward × up, as for the camera.
///
/// The centre of texel (x, y) is half_extent·(u·right + v·up) from the middle, with u = 2(x+½)/size − 1 and v = 1 − 2(y+½)/size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EmissionFace {
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Perspective: tangent of half the opening angle. Orthographic: half the edge, metres.
    pub half_extent: f64,
}

/// The emission that one texel represents.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TexelEmission {
    /// The part of the texel that is inside the emission domain: solid angle ΔΩ in sr, or for a directional light perpendicular area
    /// ΔA_perp in m². 0 outside.
    pub measure: f64,
    /// Mean of s(θ) over that part; 1 for point and directional lights, 0 where the measure is 0.
    pub falloff: f64,
}

/// The emission domain of a light: sphere, cone, or for a directional light the disc of the scene as the light sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct EmissionDomain {
    pub projection: Projection,
    /// L; for a directional light the centre of the face, outside the scene on the light's side.
    pub origin_m: DVec3,
    /// Distance from the origin that contains the whole scene, measured along the rays.
    pub depth_range_m: f64,
    /// Texels along one edge of a face.
    pub size: u32,
    pub faces: Vec<EmissionFace>,
    /// Face by face, row by row from the top: `faces.len()`·size² values, texel (x, y) of face f at (f·size + y)·size + x.
    pub texels: Vec<TexelEmission>,
    /// I_0 in W/sr: radiant intensity where the falloff, or the pattern, is 1. For a directional light E_L in W/m².
    pub axial_intensity: Bands,
}

impl EmissionDomain {
    /// Cuts the emission of a validated light into faces of `size`² texels.
    ///
    /// - Point: six faces along the world axes, in the order +x −x +y −y +z −z.
    /// - Spot: one face around the axis. For wide cones, the faces of a cube aligned with the axis, without those that the cone does not
    ///   reach.
    /// - Pattern: as for a spot light, but the cube is also aligned with the plane C = 0. A projector has one face, which contains its
    ///   image.
    /// - Emissive surfaces: six faces as for a point.
    /// - Area: what its middle emits with all of the power; every point of the area emits the same.
    /// - Directional: one orthographic face. The domain is the disc of the bounding sphere as the light sees it, not the square of the
    ///   face: `rsm-average` divides by the domain, and with the square the result would depend on the rotation of the face about the
    ///   light's direction.
    pub fn new(light: &Light, size: u32, scene: &BoundingSphere) -> Self {
        match light {
            Light::Lamp(lamp) => {
                let (faces, texels) = faces_of_profile(lamp, size);
                EmissionDomain {
                    projection: Projection::Perspective,
                    origin_m: lamp.position_m,
                    depth_range_m: lamp.position_m.distance(scene.centre_m) + scene.radius_m,
                    size,
                    faces,
                    texels,
                    axial_intensity: peak_intensity(lamp),
                }
            }
            Light::Directional {
                direction,
                irradiance_w_m2,
            } => {
                let forward = direction.normalize_or_zero();
                let half_extent = scene.radius_m * FACE_MARGIN;
                EmissionDomain {
                    projection: Projection::Orthographic,
                    origin_m: scene.centre_m - forward * (scene.radius_m * DEPTH_MARGIN),
                    depth_range_m: 2.0 * scene.radius_m * DEPTH_MARGIN,
                    size,
                    faces: vec![face(forward, forward.any_orthonormal_vector(), half_extent)],
                    texels: texels::disc_face(size, half_extent, scene.radius_m),
                    axial_intensity: *irradiance_w_m2,
                }
            }
        }
    }

    /// The face, column and row of the cell at a place of a face, 0 to 1 over its columns and rows. A place beyond the face's edges gives
    /// the cell of another face in that direction. A face has `cells_per_edge` cells along an edge. `None` if no face shows the place.
    pub fn cell_at(&self, face: usize, place: [f64; 2], cells_per_edge: u32) -> Option<[u32; 3]> {
        let of = &self.faces[face];
        let [right, down] = place.map(|place| of.half_extent * (2.0 * place - 1.0));
        let sideways = of.right * right - of.up * down;
        let (index, across) = match self.projection {
            Projection::Orthographic => (face, place.map(|place| 2.0 * place - 1.0)),
            Projection::Perspective => {
                let direction = of.forward + sideways;
                let depth = |face: &EmissionFace| face.forward.dot(direction);
                let faces = self.faces.iter().enumerate();
                let (index, shown) =
                    faces.max_by(|(_, a), (_, b)| depth(a).total_cmp(&depth(b)))?;
                let scale = 1.0 / (depth(shown) * shown.half_extent);
                let across = [shown.right.dot(direction), -shown.up.dot(direction)];
                (index, across.map(|across| across * scale))
            }
        };
        let count = f64::from(cells_per_edge);
        let cells = across.map(|across| ((0.5 + 0.5 * across) * count).floor());
        let is_inside = |cell: &f64| (0.0..count).contains(cell);
        let [column, row] = cells;
        cells
            .iter()
            .all(is_inside)
            .then_some([index as u32, column as u32, row as u32])
    }

    /// Measure of the whole domain, ΣΔΩ in sr or ΣΔA_perp in m²: 4π, 2π·(1 − cos θ_o), or π·radius².
    pub fn total_measure(&self) -> f64 {
        let sum: CompensatedSum = self.texels.iter().map(|texel| texel.measure).collect();
        sum.value()
    }

    /// Power in W that the light sends into a texel: I_0·falloff·ΔΩ, or E_L·ΔA_perp.
    pub fn incident_power_w(&self, texel: &TexelEmission) -> Bands {
        self.axial_intensity
            .map(|intensity| intensity * texel.falloff * texel.measure)
    }
}

/// Makes a face from two of its axes.
fn face(forward: DVec3, up: DVec3, half_extent: f64) -> EmissionFace {
    EmissionFace {
        right: forward.cross(up),
        up,
        forward,
        half_extent,
    }
}

/// The faces of a cube with `axis` up on its four sides. `side` is perpendicular to `axis`; both are unit vectors.
/// Order: the sides ±(axis × side), then ±axis, then ±side.
fn cube_faces(axis: DVec3, side: DVec3) -> [EmissionFace; 6] {
    let other_side = axis.cross(side);
    [
        face(other_side, axis, 1.0),
        face(-other_side, axis, 1.0),
        face(axis, side, 1.0),
        face(-axis, side, 1.0),
        face(side, axis, 1.0),
        face(-side, axis, 1.0),
    ]
}

/// Points of emissive surfaces whose normals stand for all.
const NORMALS: u32 = 256;

/// The faces of a cube for emissive surfaces, which have many normals. The falloff is the mean of those of the surfaces' points.
fn faces_of_surfaces(
    surfaces: &EmissiveSurfaces,
    size: u32,
) -> (Vec<EmissionFace>, Vec<TexelEmission>) {
    let faces = cube_faces(DVec3::Y, DVec3::Z).to_vec();
    let normals: Vec<DVec3> = surfaces
        .points(NORMALS, 0)
        .iter()
        .map(|p| p.normal)
        .collect();
    let across = |index: u32| 2.0 * (f64::from(index) + 0.5) / f64::from(size) - 1.0;
    let mut texels = texels::cube_face(size).repeat(6);
    for (index, texel) in texels.iter_mut().enumerate() {
        let of_face = index as u32 % size.pow(2);
        let EmissionFace {
            right, up, forward, ..
        } = faces[index / size.pow(2) as usize];
        let direction = forward + across(of_face % size) * right - across(of_face / size) * up;
        let direction = direction.normalize();
        let cosines = normals.iter().map(|normal| normal.dot(direction).max(0.0));
        texel.falloff = cosines.sum::<f64>() / f64::from(NORMALS);
    }
    (faces, texels)
}

/// The faces that a point of a lamp emits into, and their texels.
fn faces_of_profile(lamp: &Lamp, size: u32) -> (Vec<EmissionFace>, Vec<TexelEmission>) {
    if let Some(surfaces) = &lamp.surfaces {
        return faces_of_surfaces(surfaces, size);
    }
    match lamp.profile_of_points() {
        Profile::Uniform => {
            let faces = cube_faces(DVec3::Y, DVec3::Z).to_vec();
            (faces, texels::cube_face(size).repeat(6))
        }
        Profile::Cone(cone) => cone_faces(lamp.direction.normalize_or_zero(), size, *cone),
        Profile::Measured(pattern) => pattern_faces(&lamp.axes(), size, pattern),
        Profile::Projected(image) => {
            let axes = lamp.axes();
            let extents = image.edges().concat().into_iter().map(f64::abs);
            let half_extent = extents.fold(0.0, f64::max) * FACE_MARGIN;
            let face = face(axes.direction, axes.plane_0, half_extent);
            (vec![face], projected_face(image, size, half_extent))
        }
    }
}

/// Faces and texels of a spot light: one face if its cone is narrow, otherwise the faces of a cube about its axis that it reaches.
fn cone_faces(axis: DVec3, size: u32, cone: SpotCone) -> (Vec<EmissionFace>, Vec<TexelEmission>) {
    let integral = ConeIntegral::new(cone);
    let up = axis.any_orthonormal_vector();
    if cone.outer_half_angle_deg <= SINGLE_FACE_OUTER_HALF_ANGLE_DEG {
        let half_extent = integral.outer_rad.tan() * FACE_MARGIN;
        let texels = texels::cone_face(size, half_extent, &integral, ConeFace::Front);
        return (vec![face(axis, up, half_extent)], texels);
    }
    let [front, back, side] = [ConeFace::Front, ConeFace::Back, ConeFace::Side]
        .map(|kind| texels::cone_face(size, 1.0, &integral, kind));
    let tables = [&side, &side, &front, &back, &side, &side];
    lit_faces(cube_faces(axis, up), tables)
}

/// Faces and texels of a pattern: one face if it is narrow, otherwise the faces of a cube about its axes that it reaches.
fn pattern_faces(
    axes: &PatternAxes,
    size: u32,
    pattern: &Pattern,
) -> (Vec<EmissionFace>, Vec<TexelEmission>) {
    let tables = PatternTexels::new(pattern);
    let widest_rad = pattern.widest_rad();
    if widest_rad <= SINGLE_FACE_OUTER_HALF_ANGLE_DEG.to_radians() {
        let half_extent = widest_rad.tan() * FACE_MARGIN;
        let face = face(axes.direction, axes.plane_0, half_extent);
        let texels = tables.face(size, half_extent, ConeFace::Front, 0.0);
        return (vec![face], texels);
    }
    let cube = cube_faces(axes.direction, axes.plane_0);
    // The sides look along −C90, C90, C0 and C180.
    let kinds = [
        (ConeFace::Side, 1.5 * PI),
        (ConeFace::Side, 0.5 * PI),
        (ConeFace::Front, 0.0),
        (ConeFace::Back, 0.0),
        (ConeFace::Side, 0.0),
        (ConeFace::Side, PI),
    ];
    let tables = kinds.map(|(kind, turn_rad)| tables.face(size, 1.0, kind, turn_rad));
    lit_faces(cube, tables.each_ref())
}

/// The faces that have a lit texel, and their texels.
fn lit_faces(
    faces: [EmissionFace; 6],
    tables: [&Vec<TexelEmission>; 6],
) -> (Vec<EmissionFace>, Vec<TexelEmission>) {
    let mut lit: (Vec<_>, Vec<_>) = Default::default();
    for (face, table) in faces.into_iter().zip(tables) {
        if table.iter().any(|texel| texel.measure > 0.0) {
            lit.0.push(face);
            lit.1.extend_from_slice(table);
        }
    }
    lit
}
