//! What the raster passes see, against a ray cast in f64 through every pixel's and texel's centre.
//!
//! Only pixels and texels away from edges are compared: those where the eight rays 1/32 of a pixel away hit the same triangle.
//! Rasterisers snap vertices to 1/256 pixel, so nearer to an edge either side is right.

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene};
use crate::common::ray_caster::{Hit, RayCaster, pixel::PixelRay};
use crate::common::rooms;
use camlux::{
    RenderOptions, Scene,
    emission::EmissionDomain,
    internals::{Intermediates, LightIntermediates, SurfacePoint},
    output::{Frame, Layer},
    scene::{IndirectLight, Lens, Light, PlacedLight, Profile, SpotCone, VplSum},
};
use glam::DVec3;

/// Distance between positions, relative to the scene's size. Required: 1e-5; measured up to 6.5e-7 with f32 rays.
const POSITION: f64 = 1.5e-6;
/// Distance of a position from its triangle's plane, relative to the scene's size: f32 rounding, measured up to 5.9e-8.
const PLANE: f64 = 1.8e-7;
/// Distance between unit normals: f32 corners of small triangles and f32 weights of smooth normals, measured up to 4.1e-6.
const NORMAL: f64 = 1.2e-5;
/// The same for packed normals: the largest rounding of 12 bits per axis of the octahedron.
const GEOMETRIC_NORMAL: f64 = 1.04e-3;

/// The largest errors found, and the number of points compared.
#[derive(Debug, Default)]
pub struct Errors {
    position: f64,
    plane: f64,
    normal: f64,
    geometric_normal: f64,
    kd: f64,
    ks: f64,
    shininess: f64,
    depth: f64,
    falloff: f64,
    compared: usize,
    skipped: usize,
}

impl Errors {
    /// Compares a point with what the ray hits. Returns the hit if both see a surface, away from edges.
    fn point(
        &mut self,
        scene: &Scene,
        caster: &RayCaster,
        ray: &PixelRay,
        seen: Option<&SurfacePoint>,
    ) -> Option<Hit> {
        let (hit, is_inside) = ray.cast(caster);
        if !is_inside {
            self.skipped += 1;
            return None;
        }
        self.compared += 1;
        assert_eq!(hit.is_some(), seen.is_some(), "{hit:?} {seen:?}");
        let (hit, seen) = (hit?, seen?);
        let surface = rooms::surface_at(scene, &hit);
        let offset = (seen.position_m - hit.position_m) / size_m(scene);
        self.position = self.position.max(offset.length());
        self.plane = self.plane.max(offset.dot(hit.normal).abs());
        self.normal = self.normal.max(seen.normal.distance(surface.normal));
        self.geometric_normal = self
            .geometric_normal
            .max(seen.geometric_normal.distance(hit.normal));
        let [r, g, b, shininess] = seen.brdf.lobe.texel().map(f64::from);
        for (band, ks) in [r, g, b].into_iter().enumerate() {
            self.kd = self.kd.max((seen.brdf.kd[band] - surface.kd[band]).abs());
            self.ks = self.ks.max((ks - surface.ks[band]).abs());
        }
        let is_specular = surface.ks.iter().any(|&ks| ks > 0.0);
        if is_specular {
            let off = (shininess - surface.shininess).abs();
            self.shininess = self.shininess.max(off / surface.shininess.max(1.0));
        }
        Some(hit)
    }

    /// Checks that at most a share `skipped` of the pixels is at edges, and that the rest agrees.
    pub fn check(&self, what: &str, skipped: f64) {
        println!("{what}: {self:?}");
        assert!(self.compared > 0, "{what}: nothing was compared");
        let share = self.skipped as f64 / (self.compared + self.skipped) as f64;
        assert!(share <= skipped, "{what}: {share} at edges");
        assert!(self.position <= POSITION, "{what}: {self:?}");
        assert!(self.normal <= NORMAL, "{what}: {self:?}");
        assert!(self.plane <= PLANE, "{what}: {self:?}");
        assert!(
            self.geometric_normal <= GEOMETRIC_NORMAL,
            "{what}: {self:?}"
        );
        // f32 texture coordinates over some hundred texels: measured up to 6.2e-5.
        assert!(self.kd <= 1.5e-4, "{what}: {self:?}");
        // The same, where textures give them.
        assert!(self.ks <= 1.5e-4, "{what}: {self:?}");
        assert!(self.shininess <= 1.5e-4, "{what}: {self:?}");
        // Ratios of lengths from f32 positions: measured up to 3.8e-7, and 1.04e-6 through a fisheye lens.
        assert!(self.depth <= 1.5e-6, "{what}: {self:?}");
        // The same, squared: measured up to 1.5e-6.
        assert!(self.falloff <= 4e-6, "{what}: {self:?}");
    }
}

fn size_m(scene: &Scene) -> f64 {
    let bounds = scene.bounding_box().expect("there are surfaces");
    (bounds.max_m - bounds.min_m).max_element()
}

pub fn render(gpu: &mut Gpu, scene: &Scene) -> (Frame, Intermediates) {
    gpu.renderer
        .render_with_intermediates(scene, &mut RenderOptions::default())
        .expect("the scene renders")
}

/// Errors of the G-buffer and of the layers made from it.
pub fn camera_errors(scene: &Scene, frame: &Frame, kept: &Intermediates) -> Errors {
    let caster = RayCaster::new(scene);
    let [width, height] = frame.resolution_px;
    let values = |layer| frame.values(layer).expect("every frame has it");
    let ids = |layer| frame.ids(layer).expect("every frame has it");
    let (depth, range) = (values(Layer::Depth), values(Layer::Range));
    let (position, normal) = (values(Layer::Position), values(Layer::Normal));
    let (mesh, material) = (ids(Layer::InstanceId), ids(Layer::MaterialId));
    let mut errors = Errors::default();
    for (i, seen) in kept.gbuffer.iter().enumerate() {
        let (x, y) = (i as u32 % width, i as u32 / width);
        assert!(y < height);
        let ray = PixelRay::of_camera(scene, x, y);
        let vector =
            |values: &[f32]| DVec3::from_slice(&[0, 1, 2].map(|c| values[3 * i + c].into()));
        let Some(seen) = seen else {
            assert_eq!((mesh[i], material[i]), (0, 0));
            assert_eq!((depth[i], range[i]), (f32::INFINITY, f32::INFINITY));
            assert_eq!(
                (vector(position), vector(normal)),
                (DVec3::ZERO, DVec3::ZERO)
            );
            errors.point(scene, &caster, &ray, None);
            continue;
        };
        // The layers are the G-buffer, rounded to f32.
        let rounding = f64::from(f32::EPSILON);
        assert!(vector(position).distance(seen.position_m) <= rounding * seen.position_m.length());
        assert!(vector(normal).distance(seen.normal) <= 4.0 * rounding);
        let Some(hit) = errors.point(scene, &caster, &ray, Some(seen)) else {
            continue;
        };
        let material_index = scene.meshes[hit.mesh].triangle_materials[hit.triangle];
        assert_eq!(mesh[i], 1 + hit.mesh as u32);
        assert_eq!(material[i], 1 + material_index);
        let along_axis = ray.direction.dot(scene.camera.basis().forward);
        for (layer, truth_m) in [
            (depth, hit.distance * along_axis),
            (range, hit.distance * ray.direction.length()),
        ] {
            let off_m = (f64::from(layer[i]) - truth_m).abs();
            let range_m = hit.distance * ray.direction.length();
            errors.depth = errors.depth.max(off_m / range_m);
        }
    }
    errors
}

/// Errors of a light's RSM.
fn rsm_errors(scene: &Scene, light: &Light, kept: &LightIntermediates) -> Errors {
    let caster = RayCaster::new(scene);
    let domain = &kept.domain;
    let size = domain.size;
    let mut errors = Errors::default();
    assert_eq!(kept.rsm.len(), domain.texels.len());
    for (i, (seen, emission)) in kept.rsm.iter().zip(&domain.texels).enumerate() {
        let (x, row) = (i as u32 % size, i as u32 / size);
        let ray = PixelRay::of_texel(domain, (row / size) as usize, x, row % size);
        let point = seen.as_ref().map(|seen| &seen.point);
        let hit = errors.point(scene, &caster, &ray, point);
        let (Some(hit), Some(seen)) = (hit, seen) else {
            continue;
        };
        let spread = match light {
            Light::Directional { .. } => 1.0,
            _ => hit.position_m.distance_squared(domain.origin_m),
        };
        let falloff = seen.irradiance_per_intensity * spread;
        errors.falloff = errors.falloff.max((falloff - emission.falloff).abs());
        if let (Some(Profile::Cone(cone)), Some(direction)) =
            (light.lamp().map(|lamp| &lamp.profile), light.direction())
        {
            // The table holds s averaged over the texel. It is near s at the centre if faces and table have the same orientation.
            let centre = cone.falloff(direction.angle_between(ray.direction));
            let is_cut = emission.measure < 0.999 * whole_texel_measure(domain, &ray);
            assert!(
                is_cut || (emission.falloff - centre).abs() < 0.04,
                "texel {i}: {emission:?} {centre}"
            );
        }
    }
    errors
}

/// ΔΩ of a texel that is entirely inside the domain, to first order in its size.
fn whole_texel_measure(domain: &EmissionDomain, ray: &PixelRay) -> f64 {
    let texel = 2.0 * domain.faces[0].half_extent / f64::from(domain.size);
    // A lower bound: the first order is off by at most texel².
    (texel * texel / ray.direction.length().powi(3)) * (1.0 - texel * texel)
}

pub fn with_rsm(mut scene: Scene, rsm_size: u32) -> Scene {
    let estimator = VplSum::RsmAverage;
    scene.indirect = Some(IndirectLight::vpl_sum(estimator, rsm_size));
    scene
}

/// Renders a scene and compares everything that is rasterised.
pub fn compare(gpu: &mut Gpu, what: &str, scene: &Scene, skipped: f64) {
    let (frame, kept) = render(gpu, scene);
    camera_errors(scene, &frame, &kept).check(&format!("{what}, camera"), skipped);
    for (light, kept) in scene.lights.iter().zip(&kept.lights) {
        let what = format!(
            "{what}, {} x {} faces",
            light.kind(),
            kept.domain.faces.len()
        );
        rsm_errors(scene, light, kept).check(&what, skipped);
    }
}

#[test]
fn demo_scenes_lie_where_rays_hit() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        // The knot's triangles are smaller than a pixel: a quarter of the pixels has an edge within 1/32 pixel.
        let skipped = if name == "knot" { 0.3 } else { 0.05 };
        compare(
            &mut gpu,
            name,
            &with_rsm(demo_scene(name, [64, 64]), 32),
            skipped,
        );
    }
}

#[test]
fn smooth_normals_are_interpolated() {
    let mut scene = with_rsm(demo_scene("glossy", [64, 64]), 32);
    for mesh in &mut scene.meshes {
        let centre = mesh.positions_m.iter().sum::<DVec3>() / mesh.positions_m.len() as f64;
        let outward = mesh.positions_m.iter().map(|p| *p - centre);
        mesh.normals = outward.collect();
    }
    compare(&mut Gpu::open(), "smooth", &scene, 0.05);
}

#[test]
fn distance_and_scale_cost_nothing() {
    let mut gpu = Gpu::open();
    for (scale, shift_m) in [(1.0, 1e5), (1e-3, 0.0), (1e4, 0.0), (1e-3, 10.0)] {
        let shift_m = DVec3::new(shift_m, -0.5 * shift_m, 0.3 * shift_m);
        for name in ["cornell", "textured"] {
            let scene = with_rsm(demo_scene(name, [64, 64]), 32);
            let moved = rooms::moved(&scene, scale, shift_m);
            let what = format!("{name} x {scale} + {shift_m}");
            compare(&mut gpu, &what, &moved, 0.05);
        }
    }
}

/// A distant camera or light loses digits along its rays, but points stay on their surfaces.
#[test]
fn points_seen_from_afar_lie_on_their_surfaces() {
    let mut scene = with_rsm(demo_scene("cornell", [64, 64]), 32);
    let away = DVec3::new(0.0, 60.0, 300.0);
    scene.camera.position_m += away;
    scene.camera.lens = Lens::FovY { fov_y_deg: 0.5 };
    scene.lights = vec![
        Light::spot(
            away,
            -away,
            SpotCone {
                inner_half_angle_deg: 0.2,
                outer_half_angle_deg: 0.25,
            },
            [1.0; 3],
        )
        .into(),
    ];
    let (frame, kept) = render(&mut Gpu::open(), &scene);
    for errors in [
        camera_errors(&scene, &frame, &kept),
        rsm_errors(&scene, &scene.lights[0], &kept.lights[0]),
    ] {
        println!("from afar: {errors:?}");
        assert!(errors.compared > 500 && errors.plane <= PLANE, "{errors:?}");
        // A distance of 300 m costs this many digits.
        assert!(errors.position <= 65.0 * POSITION, "{errors:?}");
    }
}

/// Each of six walls has its own colour and four markers off its centre and diagonals. A face that is swapped, mirrored or
/// rotated shows another colour somewhere.
#[test]
fn all_six_faces_lie_right() {
    let mut gpu = Gpu::open();
    // An even and an odd number of texels, without and with a texel in the middle.
    for rsm_size in [32, 45] {
        let scene = with_rsm(rooms::marked_room(), rsm_size);
        compare(&mut gpu, "marked room", &scene, 0.05);
        let (_, kept) = render(&mut gpu, &scene);
        let light = &kept.lights[0];
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| [axis, -axis]);
        let forward = light.domain.faces.iter().map(|face| face.forward);
        assert!(forward.eq(axes.into_iter().flatten()));

        // Every texel of the closed room carries flux, and the device's f32 solid angles sum to the sphere's.
        let texels = light.domain.texels.iter().zip(&light.rsm);
        let seen = texels.filter(|(_, seen)| seen.is_some());
        let sum: f64 = seen.map(|(texel, _)| f64::from(texel.measure as f32)).sum();
        let error = sum / (4.0 * std::f64::consts::PI) - 1.0;
        println!("sum of solid angles: {error:.1e}");
        assert!(error.abs() < 1e-7, "{error:e}");
        assert_eq!(light.vpl_counts[0] as usize, light.rsm.len());

        // Each marker's colour is seen, and only on that marker.
        for (index, material) in scene.materials.iter().enumerate() {
            let of_material = |texel: &&_| rooms::has_kd(texel, material.kd);
            let found = light.rsm.iter().flatten().map(|texel| texel.point);
            let found: Vec<_> = found.filter(|point| of_material(&point)).collect();
            assert!(!found.is_empty(), "{} is not seen", material.name);
            for point in found {
                assert!(
                    rooms::is_on(&scene.meshes[index], point.position_m),
                    "{}",
                    material.name
                );
            }
        }
    }
}

#[test]
fn spots_and_parallel_light_lie_right() {
    let mut gpu = Gpu::open();
    let directions = [
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::X,
        DVec3::new(0.3, -0.9, 0.2),
        DVec3::new(-2.0, 1e-3, 0.5),
        DVec3::new(1e-9, 1.0, 0.0),
    ];
    for direction in directions {
        let mut scene = with_rsm(rooms::marked_room(), 32);
        let position_m = DVec3::new(0.11, -0.07, 0.05);
        let cones = [
            (0.5, 1.0),
            (20.0, 35.0),
            (50.0, 60.0),
            (40.0, 75.0),
            (60.0, 120.0),
            (170.0, 180.0),
        ];
        scene.lights = cones
            .map(|(inner, outer)| {
                PlacedLight::from(Light::spot(
                    position_m,
                    direction,
                    SpotCone {
                        inner_half_angle_deg: inner,
                        outer_half_angle_deg: outer,
                    },
                    [1.0; 3],
                ))
            })
            .to_vec();
        scene
            .lights
            .push(Light::directional(direction, [1.0; 3]).into());
        compare(
            &mut gpu,
            &format!("marked room along {direction}"),
            &scene,
            0.06,
        );
    }
}
