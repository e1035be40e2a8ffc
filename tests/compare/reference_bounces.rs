//! More bounces of the path-sampled reference, against closed forms, radiosity by quadrature, and plain path tracing.

use std::f64::consts::{PI, TAU};

use crate::common::reference_frame::add_rounds;
use crate::common::rooms::{quad, scene_of};
use crate::reference::{lamp, lit_sphere};
use camlux::{
    Scene,
    hard_cases::scenes::with_tof,
    model::{Brdf, Phasor, SPEED_OF_LIGHT_M_S},
    output::{Frame, Layer, TofQuantity},
    reference::Reference,
    scene::{FinalGather, IndirectLight, Lens, Material, MetallicRoughness},
};
use glam::DVec3;

/// The single pixel of a camera that looks at a point, of so many bounces.
fn pixel_of(scene: &Scene, look_at_m: DVec3, bounces: u32, samples_per_round: u32) -> Frame {
    let mut scene = scene.clone();
    scene.camera.resolution_px = [1, 1];
    scene.camera.look_at_m = look_at_m;
    scene.camera.lens = Lens::FovY { fov_y_deg: 1e-3 };
    scene.indirect = Some(IndirectLight::FinalGather(FinalGather {
        bounces,
        ..FinalGather::DEFAULT
    }));
    let mut reference = Reference::new(&scene, samples_per_round).expect("a valid scene");
    add_rounds(&mut reference, 64);
    let frame = reference.frame();
    let said = frame.description.reference.expect("it is a reference");
    assert_eq!(said.bounces, bounces);
    frame
}

fn value(frame: &Frame, layer: Layer) -> f64 {
    frame.values(layer).expect("it is there")[0].into()
}

/// Within 3 standard errors, those of the expected value included, and 0.3 % or `share`, if that is more.
#[track_caller]
fn assert_agrees(what: &str, frame: &Frame, [expected, its_error]: [f64; 2], share: f64) {
    let off = value(frame, Layer::Indirect) - expected;
    let standard_error = value(frame, Layer::StandardError).hypot(its_error);
    println!(
        "{what}: expected {expected:.6e}, off by {:.1e} of it, {:.2} standard errors of {:.1e}",
        off / expected,
        off / standard_error,
        standard_error / expected
    );
    assert!(off.abs() <= share.max(3e-3) * expected, "{what}");
    assert!(off.abs() <= 3.0 * standard_error, "{what}");
}

/// All points of a sphere send each other the same share of light. Bounce k of direct light L is ρ^k·L. The last number is all but the
/// limit ρ/(1 − ρ).
#[test]
fn an_integrating_sphere_has_a_geometric_series() {
    let scene = lit_sphere(Vec::new(), DVec3::new(0.3, -0.2, 0.1));
    for bounces in [1, 2, 4, 8, 16] {
        let frame = pixel_of(&scene, DVec3::new(-0.4, 0.9, 0.3), bounces, 1024);
        let expected = 0.5 * (1.0 - 0.5_f64.powi(bounces as i32));
        // The facets are within 4e-5 of the sphere.
        let expected = [expected, 4e-5 * expected];
        assert_agrees(&format!("{bounces} bounces"), &frame, expected, 0.0);
    }
}

/// Chords between points of a sphere have the density d/(2R²) of their length d, whatever came before. So Z of bounce k is that of
/// direct light times (ρ·G)^k, with their characteristic function G(x) = 2[e^{ix}(1 − ix) − 1]/x², x = 4πfR/c.
#[test]
fn phasors_of_an_integrating_sphere_are_powers_of_its_chords() {
    let frequencies_hz = [20e6, 100e6];
    let camera_m = DVec3::new(0.3, -0.2, 0.1);
    let scene = with_tof(lit_sphere(Vec::new(), camera_m), &frequencies_hz);
    for bounces in [1, 2, 4, 8] {
        let frame = pixel_of(&scene, DVec3::X, bounces, 1024);
        for (i, frequency_hz) in frequencies_hz.into_iter().enumerate() {
            let phasor = |quantity| {
                let layer = Layer::Tof(i as u8, quantity);
                let z = frame.values(layer).expect("it is there");
                Phasor {
                    re: z[0].into(),
                    im: z[1].into(),
                }
            };
            let x = 2.0 * TAU * frequency_hz / SPEED_OF_LIGHT_M_S;
            let per_bounce = Phasor {
                re: x.cos() + x * x.sin() - 1.0,
                im: x.sin() - x * x.cos(),
            } * (0.5 * 2.0 / (x * x));
            let direct = phasor(TofQuantity::PhasorDirect);
            let each = (0..bounces).scan(direct, |before, _| {
                *before = *before * per_bounce;
                Some(*before)
            });
            let expected: Phasor = each.sum();
            let found = phasor(TofQuantity::PhasorIndirect);
            let off = (found.re - expected.re).hypot(found.im - expected.im);
            let noise = phasor(TofQuantity::PhasorStandardError).magnitude();
            println!(
                "{bounces} bounces, {frequency_hz:e} Hz: off by {:.1e}, {:.2} standard errors",
                off / expected.magnitude(),
                off / noise
            );
            assert!(off <= 3e-3 * expected.magnitude(), "{found:?}");
            assert!(off <= 3.0 * noise + 1e-4 * expected.magnitude());
        }
    }
}

/// The walls of a closed box, each as a corner and two edges.
const SIZE_M: DVec3 = DVec3::new(1.0, 0.8, 1.3);
fn walls() -> [[DVec3; 3]; 6] {
    let [x, y, z] = [
        SIZE_M.x * DVec3::X,
        SIZE_M.y * DVec3::Y,
        SIZE_M.z * DVec3::Z,
    ];
    [
        [DVec3::ZERO, z, x],
        [y, x, z],
        [DVec3::ZERO, x, y],
        [z, y, x],
        [DVec3::ZERO, y, z],
        [x, z, y],
    ]
}

const LAMP_M: DVec3 = DVec3::new(0.35, 0.5, 0.75);
const CAMERA_M: DVec3 = DVec3::new(0.6, 0.35, 0.4);

fn closed_box() -> Scene {
    let meshes = walls().into_iter().enumerate();
    let meshes = meshes.map(|(i, [corner, along, across])| {
        quad(&format!("wall {i}"), corner, along, across, i as u32)
    });
    scene_of(meshes.collect(), lamp(LAMP_M), CAMERA_M, DVec3::ZERO)
}

/// The surfaces of a room emit L and reflect ρ. Light that n of them have reflected is ρⁿ·L, whatever the room's shape.
#[test]
fn a_furnace_has_a_geometric_series() {
    let mut scene = closed_box();
    scene.lights.clear();
    let (reflectance, emission): (f64, f64) = (0.7, 3.0);
    for material in &mut scene.materials {
        material.kd = [reflectance; 3];
        material.emission_w_sr_m2 = [emission; 3];
    }
    for bounces in [1, 2, 3, 8] {
        // Emission that reaches P straight is part of it.
        let reflected = (1..=bounces as i32 + 1).map(|n| reflectance.powi(n));
        let expected = emission * reflected.sum::<f64>();
        let frame = pixel_of(&scene, DVec3::new(0.0, 0.3, 0.9), bounces, 2048);
        assert_agrees(&format!("{bounces} bounces"), &frame, [expected, 0.0], 0.0);
    }
}

/// The walls of the box in patches: their middles, inward normals, corners and reflectances.
struct Patch {
    middle: DVec3,
    normal: DVec3,
    corners: [DVec3; 4],
    wall: usize,
}

fn patches(along: u32) -> Vec<Patch> {
    let mut patches = Vec::new();
    for (wall, [corner, u, v]) in walls().into_iter().enumerate() {
        let [u, v] = [u, v].map(|edge| edge / f64::from(along));
        for (i, j) in (0..along).flat_map(|i| (0..along).map(move |j| (i, j))) {
            let start = corner + f64::from(i) * u + f64::from(j) * v;
            let middle = start + 0.5 * (u + v);
            let normal = u.cross(v).normalize();
            patches.push(Patch {
                middle,
                normal: normal * normal.dot(0.5 * SIZE_M - middle).signum(),
                corners: [start, start + u, start + u + v, start + v],
                wall,
            });
        }
    }
    patches
}

/// The share of the light of a uniform patch in the irradiance of a point (Lambert 1760), in closed form: Σ over edges of
/// angle·(axis · n)/2π.
fn form_factor(point: DVec3, normal: DVec3, patch: &Patch) -> f64 {
    let rays = patch.corners.map(|corner| (corner - point).normalize());
    let edges = (0..4).map(|i| {
        let (a, b) = (rays[i], rays[(i + 1) % 4]);
        let axis = a.cross(b);
        axis.length().atan2(a.dot(b)) * axis.normalize_or_zero().dot(normal)
    });
    edges.sum::<f64>().abs() / TAU
}

/// Irradiance of the lamp, 1 W/sr.
fn from_lamp(point: DVec3, normal: DVec3) -> f64 {
    let to_lamp = LAMP_M - point;
    normal.dot(to_lamp) / to_lamp.length().powi(3)
}

/// The walls' patches, and what each of them sends after 0, 1 and 2 bounces, times π.
struct Radiosity {
    patches: Vec<Patch>,
    sent: [Vec<f64>; 3],
}

impl Radiosity {
    fn new(kd: [f64; 6], along: u32) -> Radiosity {
        let patches = patches(along);
        let by_lamp = patches.iter().map(|patch| {
            // The mean over the patch, by Gauss's two points.
            let [a, b, _, d] = patch.corners;
            let nodes = [-1.0, 1.0].map(|side| 0.5 + side / 12.0_f64.sqrt());
            let points = nodes
                .map(|u| nodes.map(|v| from_lamp(a + u * (b - a) + v * (d - a), patch.normal)));
            kd[patch.wall] * points.as_flattened().iter().sum::<f64>() / 4.0
        });
        let mut sent = [by_lamp.collect(), Vec::new(), Vec::new()];
        for bounce in 1..3 {
            let before = &sent[bounce - 1];
            let reflected = patches.iter().map(|patch| {
                let Patch { middle, normal, .. } = *patch;
                kd[patch.wall] * irradiance(&patches, before, middle, normal, patch.wall)
            });
            sent[bounce] = reflected.collect();
        }
        Radiosity { patches, sent }
    }

    /// The irradiance at a point of a wall by 1, 2 and 3 bounces.
    fn irradiance(&self, at: DVec3, wall: usize) -> [f64; 3] {
        let mut own = self.patches.iter().filter(|patch| patch.wall == wall);
        let normal = own.next().expect("each wall has patches").normal;
        [0, 1, 2].map(|bounce| irradiance(&self.patches, &self.sent[bounce], at, normal, wall))
    }
}

fn irradiance(patches: &[Patch], sent: &[f64], at: DVec3, normal: DVec3, wall: usize) -> f64 {
    let others = patches.iter().zip(sent);
    let others = others.filter(|(patch, _)| patch.wall != wall);
    let light = others.map(|(patch, sent)| sent * form_factor(at, normal, patch));
    light.sum()
}

#[test]
fn a_box_has_its_radiosity() {
    let mut scene = closed_box();
    let kd = [0.8, 0.7, 0.3, 0.9, 0.6, 0.75];
    for (material, kd) in scene.materials.iter_mut().zip(kd) {
        material.kd = [kd; 3];
    }
    let finenesses = [14, 20].map(|along| Radiosity::new(kd, along));
    for (wall, at) in [
        (0, DVec3::new(0.5, 0.0, 0.7)),
        (4, DVec3::new(0.0, 0.05, 0.3)),
        (3, DVec3::new(0.9, 0.7, 1.3)),
    ] {
        let [coarse, fine] = finenesses.each_ref().map(|room| room.irradiance(at, wall));
        for bounces in 1..=3 {
            let sums =
                [fine, coarse].map(|each| kd[wall] / PI * each[..bounces].iter().sum::<f64>());
            // It falls with the patches' size, so the finer ones are nearer than this.
            let error = (sums[0] - sums[1]).abs();
            assert!(error < 2e-3 * sums[0]);
            let frame = pixel_of(&scene, at, bounces as u32, 2048);
            let what = format!("wall {wall}, {bounces} bounces");
            assert_agrees(&what, &frame, [sums[0], error], 0.0);
        }
    }
}

/// What plain path tracing finds at P: directions by the cosine alone, and the lamp's light at each hit. Each bounce's mean, and the
/// standard errors of their sums.
fn traced_plainly<const N: usize>(scene: &Scene, at: DVec3, wall: usize) -> [[f64; 2]; N] {
    const PATHS: u32 = 1_000_000;
    let brdfs: Vec<Brdf> = scene.materials.iter().map(Brdf::from).collect();
    let mut random = fastrand::Rng::with_seed(7);
    let inward = |wall: usize| {
        let [corner, u, v] = walls()[wall];
        let normal = u.cross(v).normalize();
        normal * normal.dot(0.5 * SIZE_M - corner).signum()
    };
    let normals: [DVec3; 6] = std::array::from_fn(inward);
    let planes = walls().map(|[corner, ..]| corner);
    // In a convex room, the nearest wall's plane is what a ray meets.
    let meets = |from: DVec3, direction: DVec3, own: usize| {
        let walls = (0..6).filter(|&wall| wall != own && direction.dot(normals[wall]) < 0.0);
        let hits = walls.map(|wall| {
            let distance = (planes[wall] - from).dot(normals[wall]) / direction.dot(normals[wall]);
            (distance, wall)
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut sums = [[0.0; 2]; N];
    for _ in 0..PATHS {
        let (mut p, mut own, mut weight) = (at, wall, 1.0);
        let mut viewer = (CAMERA_M - at).normalize();
        let mut found = 0.0;
        for sum in &mut sums {
            let normal = normals[own];
            let (x, y) = normal.any_orthonormal_pair();
            let (sine_squared, turn) = (random.f64(), TAU * random.f64());
            let direction = (x * turn.cos() + y * turn.sin()) * sine_squared.sqrt()
                + normal * (1.0 - sine_squared).sqrt();
            // cosθ/density = π
            weight *= PI * brdfs[own].eval(direction, normal, viewer)[0];
            let Some((distance, hit)) = meets(p, direction, own) else {
                break;
            };
            (p, own, viewer) = (p + distance * direction, hit, -direction);
            let to_lamp = (LAMP_M - p).normalize();
            let reflected = brdfs[own].eval(to_lamp, normals[own], viewer)[0];
            found += weight * reflected * from_lamp(p, normals[own]);
            sum[0] += found;
            sum[1] += found * found;
        }
    }
    sums.map(|[sum, squares]| {
        let mean = sum / f64::from(PATHS);
        let variance = squares / f64::from(PATHS) - mean * mean;
        [mean, (variance / f64::from(PATHS)).sqrt()]
    })
}

/// Lobes at P, between and at the last surface.
#[test]
fn glossy_rooms_agree_with_plain_path_tracing() {
    let mut scene = closed_box();
    let facets = |metallic, roughness| Material {
        microfacets: Some(MetallicRoughness {
            metallic,
            roughness,
            ..MetallicRoughness::DEFAULT
        }),
        ..Material::lambert("facets", [0.7; 3])
    };
    let phong = |kd, ks, shininess| Material {
        ks: [ks; 3],
        shininess,
        ..Material::lambert("phong", [kd; 3])
    };
    scene.materials = vec![
        phong(0.3, 0.5, 20.0),
        facets(1.0, 0.5),
        Material::lambert("plain", [0.6; 3]),
        phong(0.0, 0.8, 8.0),
        facets(0.0, 0.4),
        facets(0.5, 0.6),
    ];
    for (wall, at) in [
        (0, DVec3::new(0.7, 0.0, 0.9)),
        (1, DVec3::new(0.4, 0.8, 0.6)),
        (2, DVec3::new(0.5, 0.3, 0.0)),
        (4, DVec3::new(0.0, 0.3, 0.9)),
    ] {
        let expected = traced_plainly::<4>(&scene, at, wall);
        for (bounce, expected) in expected.into_iter().enumerate() {
            let frame = pixel_of(&scene, at, bounce as u32 + 1, 2048);
            let what = format!("wall {wall}, {} bounces", bounce + 1);
            assert_agrees(&what, &frame, expected, 0.01);
        }
    }
}
