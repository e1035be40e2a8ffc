//! The path-sampled reference on a mesh of 52 000 small triangles, against plain sampling: jittered cosine-distributed directions,
//! another ray tree, another triangle test and the formulas of `camlux::model`.

use std::f64::consts::{PI, TAU};

use crate::common::gpu::demo_scene;
use crate::common::ray_caster::{Hit, RayCaster, pixel::PixelRay};
use crate::common::reference_frame::add_rounds;
use camlux::{
    Scene, model,
    output::Layer,
    reference::Reference,
    scene::{Bands, Intrinsics, Lens},
};
use glam::DVec3;

const SIZE: u32 = 100;
/// Every third pixel of a row.
const STEP: u32 = 3;
/// Strata along each axis of the unit square from which directions are drawn.
const STRATA: u32 = 32;
/// Rays start this far from their surface, in a scene of 2 m.
const OFFSET_M: f64 = 1e-9;

/// The same numbers from 0 to 1 in every run (Knuth's MMIX generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn kd(scene: &Scene, hit: &Hit) -> Bands {
    let material = scene.meshes[hit.mesh].triangle_materials[hit.triangle];
    scene.materials[material as usize].kd
}

/// The green band of a matte point's radiance by one bounce from matte surfaces.
fn plainly_sampled(scene: &Scene, caster: &RayCaster, p: &Hit, numbers: &mut Numbers) -> f64 {
    let light = &scene.lights[0].light;
    let position_m = light.position_m().expect("the knot is lit by a spot");
    let (x, y) = p.normal.any_orthonormal_pair();
    let start_m = p.position_m + OFFSET_M * p.normal;
    let mut sum = 0.0;
    for stratum in 0..STRATA * STRATA {
        let [column, row] = [stratum % STRATA, stratum / STRATA].map(f64::from);
        let u = (column + numbers.next()) / f64::from(STRATA);
        let (sine, cosine) = (TAU * (row + numbers.next()) / f64::from(STRATA)).sin_cos();
        let direction: DVec3 = u.sqrt() * (cosine * x + sine * y) + (1.0 - u).sqrt() * p.normal;
        let Some(q) = caster.nearest(start_m, direction) else {
            continue;
        };
        let to_light_m = position_m - q.position_m;
        let cosine = q.normal.dot(to_light_m.normalize());
        let q_start_m = q.position_m + OFFSET_M * q.normal;
        let is_lit = cosine > 0.0 && caster.nearest_in(q_start_m, to_light_m, 0.0, 1.0).is_none();
        if is_lit {
            sum +=
                kd(scene, &q)[1] / PI * model::irradiance_facing(light, q.position_m)[1] * cosine;
        }
    }
    kd(scene, p)[1] * sum / f64::from(STRATA * STRATA)
}

/// The knot at the pixels (i·STEP, j) of an image of SIZE x SIZE.
fn some_pixels() -> Scene {
    let mut scene = demo_scene("knot", [SIZE, SIZE]);
    let Intrinsics { fx, fy, cx, cy, .. } = scene.camera.intrinsics_px();
    let step = f64::from(STEP);
    scene.camera.lens = Lens::Intrinsics(Intrinsics {
        fx: fx / step,
        fy,
        // i·STEP + ½ in the large image is i + ½ in this one.
        cx: (cx - 0.5) / step + 0.5,
        cy,
        skew: 0.0,
    });
    scene.camera.resolution_px = [SIZE.div_ceil(STEP), SIZE];
    scene
}

#[test]
fn fine_meshes_agree_with_plain_sampling() {
    let scene = some_pixels();
    let [width, height] = scene.camera.resolution_px;
    let mut reference = Reference::new(&scene, 256).expect("the scene is valid");
    add_rounds(&mut reference, 4);
    let frame = reference.frame();
    let indirect = frame.values(Layer::Indirect).expect("it is there");
    let instance_ids = frame.ids(Layer::InstanceId).expect("it is there");
    let caster = RayCaster::new(&scene);
    let mut numbers = Numbers(1);
    for (mesh, name, step) in [(0, "room", 4), (1, "knot", 1)] {
        let (mut plain, mut sampled, mut scatter, mut count) = (0.0, 0.0, 0.0, 0);
        for index in (0..width * height).step_by(step) {
            let (x, y) = (index % width, index / width);
            let (hit, _) = PixelRay::of_camera(&scene, x, y).cast(&caster);
            let is_same = instance_ids[index as usize] == 1 + mesh as u32;
            let Some(hit) = hit.filter(|hit| is_same && hit.mesh == mesh) else {
                continue;
            };
            let expected = plainly_sampled(&scene, &caster, &hit, &mut numbers);
            let found = f64::from(indirect[3 * index as usize + 1]);
            plain += expected;
            sampled += found;
            scatter += (found - expected).powi(2);
            count += 1;
        }
        let off = sampled / plain - 1.0;
        let standard_error = scatter.sqrt() / plain;
        println!(
            "{name}: {count} pixels, off by {off:.1e} with a standard error of {standard_error:.1e}"
        );
        assert!(count > 150);
        assert!(standard_error < 4e-3);
        assert!(off.abs() < 3.0 * standard_error, "{name}");
    }
}
