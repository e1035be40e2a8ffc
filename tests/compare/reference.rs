//! The path-sampled reference against closed forms and quadrature: within 3 of its standard errors, and within 0.3 %.

use std::f64::consts::PI;

use crate::common::quadrature::{unit_interval, unit_square};
use crate::common::reference_frame::add_rounds;
use crate::common::rooms::{floor, quad, scene_of};
use camlux::{
    Scene,
    model::Brdf,
    output::{Frame, Layer},
    reference::Reference,
    scene::{Lens, Light, Material, Mesh, MetallicRoughness},
};
use glam::{DQuat, DVec3};

/// Values of one band; all three are equal.
struct Sampled {
    direct: f64,
    indirect: f64,
    standard_error: f64,
}

/// The single pixel of a camera that looks at a point.
fn sample(scene: &Scene, look_at_m: DVec3) -> Sampled {
    sample_with(scene, look_at_m, 4096)
}

fn sample_with(scene: &Scene, look_at_m: DVec3, samples_per_round: u32) -> Sampled {
    Sampled::of(&frame_of(scene, look_at_m, samples_per_round))
}

/// Also returns the mesh; `None` for the background.
fn sample_seen(scene: &Scene, look_at_m: DVec3) -> Option<(u32, Sampled)> {
    let frame = frame_of(scene, look_at_m, 512);
    let mesh = frame.ids(Layer::InstanceId).expect("it is there")[0].checked_sub(1)?;
    Some((mesh, Sampled::of(&frame)))
}

fn frame_of(scene: &Scene, look_at_m: DVec3, samples_per_round: u32) -> Frame {
    let mut scene = scene.clone();
    scene.camera.resolution_px = [1, 1];
    scene.camera.look_at_m = look_at_m;
    scene.camera.lens = Lens::FovY { fov_y_deg: 1.0 };
    let mut reference = Reference::new(&scene, samples_per_round).expect("the scene is valid");
    add_rounds(&mut reference, 64);
    reference.frame()
}

impl Sampled {
    fn of(frame: &Frame) -> Sampled {
        let value = |layer: Layer| f64::from(frame.values(layer).expect("it is there")[0]);
        Sampled {
            direct: value(Layer::Direct),
            indirect: value(Layer::Indirect),
            standard_error: value(Layer::StandardError),
        }
    }
}

#[track_caller]
fn assert_agrees(what: &str, sampled: &Sampled, expected: f64) {
    let off = sampled.indirect - expected;
    println!(
        "{what}: expected {expected:.6e}, off by {:.1e} of it, {:.2} standard errors of {:.1e}",
        off / expected,
        off / sampled.standard_error,
        sampled.standard_error / expected
    );
    assert!(off.abs() <= 3.0 * sampled.standard_error, "{what}");
    assert!(off.abs() <= 3e-3 * expected, "{what}");
}

/// A point light of 1 W/sr.
pub fn lamp(position_m: DVec3) -> Light {
    Light::point(position_m, [4.0 * PI; 3])
}

/// A sphere of radius 1 whose facets are within 4e-5 of it.
fn sphere() -> Mesh {
    const RINGS: u32 = 256;
    const SECTORS: u32 = 512;
    let point = |ring: u32, sector: u32| {
        let polar = PI * f64::from(ring) / f64::from(RINGS);
        let turn = 2.0 * PI * f64::from(sector % SECTORS) / f64::from(SECTORS);
        let sine = if ring.is_multiple_of(RINGS) {
            0.0
        } else {
            polar.sin()
        };
        [sine * turn.cos(), polar.cos(), sine * turn.sin()]
    };
    let positions: Vec<[f64; 3]> = (0..=RINGS)
        .flat_map(|ring| (0..SECTORS).map(move |sector| point(ring, sector)))
        .collect();
    let index = |ring: u32, sector: u32| ring * SECTORS + sector % SECTORS;
    let mut triangles = Vec::new();
    for ring in 0..RINGS {
        for sector in 0..SECTORS {
            let [a, b, c, d] = [
                index(ring, sector),
                index(ring, sector + 1),
                index(ring + 1, sector + 1),
                index(ring + 1, sector),
            ];
            if ring > 0 {
                triangles.push([a, b, c]);
            }
            if ring + 1 < RINGS {
                triangles.push([a, c, d]);
            }
        }
    }
    Mesh::from_slices("sphere", &positions, &triangles, 0)
}

/// Samples per round, few enough that the error of the sphere's facets is below the standard error.
const FEW: u32 = 1024;

/// A sphere with k_d = 0.5 around a light of π W/sr, with other meshes in it.
pub fn lit_sphere(others: Vec<Mesh>, camera_m: DVec3) -> Scene {
    let light = Light::point(DVec3::ZERO, [4.0 * PI * PI; 3]);
    let mut meshes = vec![sphere()];
    meshes.extend(others);
    let mut scene = scene_of(meshes, light, camera_m, DVec3::X);
    scene.materials[0].kd = [0.5; 3];
    scene
}

/// Every point receives π W/m² from the light, so it sends 0.5 W/sr/m². It receives 0.5 · π from the others and sends 0.5 / π of it.
#[test]
fn unit_sphere() {
    let scene = lit_sphere(Vec::new(), DVec3::new(0.3, -0.2, 0.1));
    for look_at in [DVec3::X, DVec3::new(-0.4, 0.9, 0.3), DVec3::NEG_Y] {
        let sampled = sample_with(&scene, look_at, FEW);
        assert!((sampled.direct - 0.5).abs() < 5e-5, "{}", sampled.direct);
        assert_agrees("sphere", &sampled, 0.25);
    }
}

/// A glossy patch in the sphere reflects the uniform 0.5 W/sr/m² around it: 0.5 · ∫ f cosθ dω.
/// Along its normal the lobe gives 0.5 · k_s for every s; at other angles a quadrature gives the value.
#[test]
fn phong_lobes_under_uniform_light() {
    // The patch faces the light and casts its shadow only on what it cannot see.
    let side = 1e-3;
    let corner = DVec3::new(0.5, -0.5 * side, -0.5 * side);
    let patch = quad("patch", corner, side * DVec3::Y, side * DVec3::Z, 1);
    for shininess in [1.0, 20.0, 300.0, 1e4] {
        for sine in [0.0, 0.5, 0.95] {
            let to_camera = DVec3::new(-f64::sqrt(1.0 - sine * sine), 0.0, sine);
            let centre = DVec3::new(0.5, 0.0, 0.0);
            let mut scene = lit_sphere(vec![patch.clone()], centre + 0.1 * to_camera);
            let (kd, ks) = (0.25, 0.5);
            scene.materials[1] = Material {
                kd: [kd; 3],
                ks: [ks; 3],
                shininess,
                ..scene.materials[1].clone()
            };
            let sampled = sample_with(&scene, centre, FEW);
            // Around the mirror direction m, with angle α and azimuth φ, dω = dφ d(cos α); cosθ = n·l, n = −x.
            let mirror = DVec3::new(to_camera.x, to_camera.y, -to_camera.z);
            let (x, y) = mirror.any_orthonormal_pair();
            let lobe = unit_square(1e-6, |u, v| {
                // u = (cos α)^(s+1) flattens the lobe.
                let cos_alpha = u.powf(1.0 / (shininess + 1.0));
                let (sin_turn, cos_turn) = (2.0 * PI * v).sin_cos();
                let across = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
                let l = mirror * cos_alpha + (x * cos_turn + y * sin_turn) * across;
                (-l.x).max(0.0)
            });
            let expected = 0.5 * (kd + ks * (shininess + 2.0) / (shininess + 1.0) * lobe);
            if sine == 0.0 {
                let in_closed_form = 0.5 * (kd + ks);
                assert!((expected - in_closed_form).abs() < 1e-5 * in_closed_form);
            }
            assert_agrees(
                &format!("lobe s = {shininess}, sin = {sine}"),
                &sampled,
                expected,
            );
        }
    }
}

/// The same for facets, by the formula of the model in f64 and a quadrature over h.
#[test]
fn facets_under_uniform_light() {
    let side = 1e-3;
    let corner = DVec3::new(0.5, -0.5 * side, -0.5 * side);
    let patch = quad("patch", corner, side * DVec3::Y, side * DVec3::Z, 1);
    for (metallic, roughness) in [(1.0, 0.03), (1.0, 0.4), (0.0, 0.1), (0.3, 1.0)] {
        for sine in [0.0, 0.5, 0.95] {
            let to_camera = DVec3::new(-f64::sqrt(1.0 - sine * sine), 0.0, sine);
            let centre = DVec3::new(0.5, 0.0, 0.0);
            let mut scene = lit_sphere(vec![patch.clone()], centre + 0.1 * to_camera);
            scene.materials[1] = Material {
                microfacets: Some(MetallicRoughness {
                    metallic,
                    roughness,
                    ..MetallicRoughness::DEFAULT
                }),
                ..Material::lambert("facets", [0.6; 3])
            };
            let sampled = sample_with(&scene, centre, FEW);
            let brdf = Brdf::from(&scene.materials[1]);
            let lobe = Brdf {
                kd: [0.0; 3],
                ..brdf
            };
            let alpha = roughness * roughness;
            let reflected = unit_square(1e-6, |u, v| {
                // u is the share of facets nearer to the normal: tan²θ = α²·u/(1−u).
                let tangent = alpha * (u / (1.0 - u)).sqrt();
                let cosine = (1.0 + tangent * tangent).sqrt().recip();
                let (sin_turn, cos_turn) = (2.0 * PI * v).sin_cos();
                let h = DVec3::new(-1.0, cos_turn * tangent, sin_turn * tangent) * cosine;
                let l = 2.0 * h.dot(to_camera) * h - to_camera;
                if l.x >= 0.0 || h.dot(to_camera) <= 0.0 {
                    return 0.0;
                }
                let density = alpha * alpha
                    / (PI * cosine.powi(3) * (alpha * alpha + tangent * tangent).powi(2));
                lobe.eval(l, DVec3::NEG_X, to_camera)[0] * -l.x * 4.0 * h.dot(to_camera) / density
            });
            let what = format!("metallic {metallic}, roughness {roughness}, sin = {sine}");
            assert_agrees(&what, &sampled, 0.5 * (brdf.kd[0] + reflected));
        }
    }
}

/// L_{P→C} by one bounce from a parallelogram, without occluders: ∫ k_d/π · k_d/π · I/d_LQ² · cosines · dA / d_PQ².
fn from_wall(p: DVec3, n_p: DVec3, light: DVec3, wall: [DVec3; 3], kd: [f64; 2]) -> f64 {
    let [corner, edge1, edge2] = wall;
    let doubled = edge1.cross(edge2);
    let n_q = doubled.normalize();
    unit_square(1e-6, |u, v| {
        let q = corner + u * edge1 + v * edge2;
        let (pq, lq) = (q - p, q - light);
        let cosines = n_p.dot(pq).max(0.0) * n_q.dot(pq).abs() * n_q.dot(lq).abs();
        cosines / (pq.length().powi(4) * lq.length().powi(3))
    }) * doubled.length()
        * kd[0]
        * kd[1]
        / (PI * PI)
}

#[test]
fn parallel_plates() {
    let ceiling = [DVec3::new(-1.0, 1.0, -1.0), 2.0 * DVec3::X, 2.0 * DVec3::Z];
    let floor = [DVec3::new(-1.0, 0.0, -1.0), 2.0 * DVec3::X, 2.0 * DVec3::Z];
    let light = DVec3::new(0.2, 0.5, 0.1);
    let meshes = vec![
        quad("floor", floor[0], floor[1], floor[2], 0),
        quad("ceiling", ceiling[0], ceiling[1], ceiling[2], 1),
    ];
    let mut scene = scene_of(meshes, lamp(light), DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO);
    scene.materials[0].kd = [0.8; 3];
    scene.materials[1].kd = [0.6; 3];
    for p in [
        DVec3::ZERO,
        DVec3::new(0.7, 0.0, -0.4),
        DVec3::new(-0.95, 0.0, 0.9),
    ] {
        let expected = from_wall(p, DVec3::Y, light, ceiling, [0.8, 0.6]);
        assert_agrees("plates", &sample(&scene, p), expected);
    }
}

/// Down to a thousandth of the wall's size from the corner, where most of the bounce comes from as near.
#[test]
fn perpendicular_corner() {
    let wall = [DVec3::NEG_Z, DVec3::Y, 2.0 * DVec3::Z];
    let light = DVec3::new(0.7, 0.6, 0.2);
    let meshes = vec![
        quad("floor", DVec3::NEG_Z, DVec3::X, 2.0 * DVec3::Z, 0),
        quad("wall", wall[0], wall[1], wall[2], 1),
    ];
    let mut scene = scene_of(meshes, lamp(light), DVec3::new(0.5, 1.5, 0.3), DVec3::ZERO);
    scene.materials[0].kd = [0.8; 3];
    scene.materials[1].kd = [0.6; 3];
    for x in [0.5, 0.1, 0.01, 1e-3] {
        let p = DVec3::new(x, 0.0, 0.1);
        let expected = from_wall(p, DVec3::Y, light, wall, [0.8, 0.6]);
        assert_agrees(&format!("corner at {x}"), &sample(&scene, p), expected);
    }
}

/// A floor and a wall that meet or cross at the z axis, rotated and moved so that no coordinate is exact.
#[derive(Clone, Copy)]
struct Corner {
    turn: DQuat,
    shift_m: DVec3,
}

/// The same rotations in every run.
fn corners() -> impl Iterator<Item = Corner> {
    (0..12).map(|i| {
        let i = f64::from(i);
        let axis = DVec3::new((1.7 * i).sin(), (2.3 * i).cos(), (0.9 * i + 0.4).sin());
        Corner {
            turn: DQuat::from_axis_angle(axis.normalize(), 0.3 + 0.77 * i),
            shift_m: 0.37 * DVec3::new((3.1 * i).cos(), (0.7 * i).sin(), (1.3 * i).cos()),
        }
    })
}

impl Corner {
    fn place(&self, point_m: DVec3) -> DVec3 {
        self.turn * point_m + self.shift_m
    }

    /// Floor and wall reach `behind` the axis. The camera is 2 m from (0, 0, z), at this angle to the floor.
    fn scene(&self, behind: f64, light: DVec3, [angle_deg, z]: [f64; 2]) -> Scene {
        let wall = |name: &str, across: DVec3, material: u32| {
            let corner = DVec3::NEG_Z - behind * across;
            let mut mesh = quad(name, corner, (1.0 + behind) * across, 2.0 * DVec3::Z, 0);
            for position_m in &mut mesh.positions_m {
                *position_m = self.place(*position_m);
            }
            mesh.triangle_materials = vec![material; 2];
            mesh
        };
        let (sine, cosine) = angle_deg.to_radians().sin_cos();
        let camera_m = DVec3::new(2.0 * cosine, 2.0 * sine, z + 0.1);
        let meshes = vec![wall("floor", DVec3::X, 0), wall("wall", DVec3::Y, 1)];
        let mut scene = scene_of(
            meshes,
            lamp(self.place(light)),
            self.place(camera_m),
            DVec3::ZERO,
        );
        scene.camera.up = self.turn * DVec3::new(0.3, 0.2, 1.0);
        scene.materials[0].kd = [0.8; 3];
        scene.materials[1].kd = [0.6; 3];
        scene
    }
}

/// P is within rounding of a second wall, also seen at a degree to one of them. The result must be the limit at the corner, where
/// the other wall fills half of P's view.
#[test]
fn in_the_corner() {
    let light = DVec3::new(0.7, 0.6, 0.2);
    let mut seen = [0; 2];
    let mut most: f64 = 0.0;
    for (corner, behind) in corners().flat_map(|corner| [(corner, 0.0), (corner, 0.3)]) {
        for view in [
            [1.0, 0.13],
            [1.0, -0.41],
            [30.0, 0.07],
            [45.0, 0.0],
            [89.0, -0.29],
        ] {
            let p = DVec3::new(0.0, 0.0, view[1]);
            let look_at_m = corner.place(p);
            let scene = corner.scene(behind, light, view);
            let Some((mesh, sampled)) = sample_seen(&scene, look_at_m) else {
                // The ray passes between two walls that end at the axis.
                assert!(behind == 0.0);
                continue;
            };
            seen[mesh as usize] += 1;
            let to_light = light - p;
            let irradiance = |cosine: f64| cosine / to_light.length().powi(3);
            let [on_floor, on_wall] = [irradiance(to_light.y), irradiance(to_light.x)];
            let (own, other, kd) = match mesh {
                0 => (on_floor, on_wall, 0.8),
                _ => (on_wall, on_floor, 0.6),
            };
            let what = format!("{view:?}, {behind} behind, mesh {mesh}");
            assert!(
                (sampled.direct / (kd / PI * own) - 1.0).abs() < 1e-6,
                "{what}"
            );
            // Of a hundred points, some may be off by more than 3 standard errors.
            let off = sampled.indirect / (0.5 * 0.8 * 0.6 / PI * other) - 1.0;
            assert!(off.abs() < 3e-3, "{what}: {off}");
            most = most.max(off.abs());

            // Light behind the wall, or below the floor, does not get through.
            for light in [DVec3::new(-0.2, 0.6, 0.2), DVec3::new(0.7, -0.2, 0.2)] {
                let scene = corner.scene(0.3, light, view);
                let (_, sampled) =
                    sample_seen(&scene, look_at_m).expect("walls that cross are tight");
                assert_eq!(
                    [sampled.direct, sampled.indirect],
                    [0.0; 2],
                    "{what}, {light}"
                );
            }
        }
    }
    println!("{seen:?} points on the floor and on the wall, off by {most:.1e} at most");
    assert!(seen.into_iter().all(|count| count > 20));
}

/// A black screen ends in the plane of symmetry between P and a lit patch: half of the light is gone.
#[test]
fn half_occluded_patch() {
    let patch = [DVec3::new(-0.2, 1.0, -0.2), 0.4 * DVec3::X, 0.4 * DVec3::Z];
    let light = DVec3::new(0.0, 0.8, 0.0);
    let meshes = vec![
        floor(1.0),
        quad("patch", patch[0], patch[1], patch[2], 1),
        quad(
            "screen",
            DVec3::new(-1.0, 0.5, -1.0),
            DVec3::Z,
            2.0 * DVec3::X,
            2,
        ),
    ];
    let mut scene = scene_of(meshes, lamp(light), DVec3::new(1.3, 0.2, 0.0), DVec3::ZERO);
    scene.materials[0].kd = [0.8; 3];
    scene.materials[1].kd = [0.6; 3];
    scene.materials[2].kd = [0.0; 3];
    for x in [0.0, 0.3] {
        let p = DVec3::new(x, 0.0, 0.0);
        let expected = 0.5 * from_wall(p, DVec3::Y, light, patch, [0.8, 0.6]);
        assert_agrees("half a patch", &sample(&scene, p), expected);
    }
}

/// The same wall, lit by a spot and by a directional light.
#[test]
fn other_lights_bounce_too() {
    let meshes = vec![
        quad("floor", DVec3::NEG_Z, DVec3::X, 2.0 * DVec3::Z, 0),
        quad("wall", DVec3::NEG_Z, DVec3::Y, 2.0 * DVec3::Z, 1),
    ];
    let travel = DVec3::new(-0.8, -0.6, 0.0);
    let sun = Light::directional(travel, [3.0; 3]);
    let mut scene = scene_of(meshes, sun, DVec3::new(0.5, 1.5, 0.3), DVec3::ZERO);
    scene.materials[0].kd = [0.8; 3];
    scene.materials[1].kd = [0.6; 3];
    let p = DVec3::new(0.2, 0.0, 0.1);
    let per_square = |q: DVec3| {
        let pq = q - p;
        0.8 * 0.6 / (PI * PI) * pq.y.max(0.0) * pq.x.abs() / pq.length().powi(4)
    };
    let wall = |u: f64, v: f64| DVec3::new(0.0, u, 2.0 * v - 1.0);
    let from_sun = unit_square(1e-6, |u, v| per_square(wall(u, v)) * 3.0 * 0.8) * 2.0;
    assert_agrees("directional", &sample(&scene, p), from_sun);

    let position_m = DVec3::new(0.7, 0.6, 0.2);
    let cone = camlux::scene::SpotCone {
        inner_half_angle_deg: 10.0,
        outer_half_angle_deg: 25.0,
    };
    scene.lights = vec![Light::spot(position_m, DVec3::NEG_X, cone, [2.0; 3]).into()];
    let [inner, outer] = [10.0, 25.0].map(f64::to_radians);
    let falloff = |theta: f64| match theta {
        t if t <= inner => 1.0,
        t if t < outer => (0.5 * PI * (t - inner) / (outer - inner)).cos(),
        _ => 0.0,
    };
    let solid_angle =
        2.0 * PI * outer * unit_interval(1e-9, |t| falloff(t * outer) * (t * outer).sin());
    let from_spot = unit_square(1e-6, |u, v| {
        let q = wall(u, v);
        let lq = q - position_m;
        let cosine = lq.normalize().dot(DVec3::NEG_X);
        let intensity = 2.0 / solid_angle * falloff(cosine.acos());
        per_square(q) * intensity * cosine / lq.length_squared()
    }) * 2.0;
    assert_agrees("spot", &sample(&scene, p), from_spot);
}
