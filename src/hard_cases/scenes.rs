//! Building blocks for the scenes of the cases.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3, dvec3};

use crate::scene::{
    Bands, Camera, ChargeUnit, Direct, IndirectLight, Instance, Lens, Light, Material, Mesh,
    PlacedLight, Scene, Sensor, Shadow, SpotCone, TimeOfFlight, VplSum,
};

/// Material 0 is grey, 1 is coloured, 2 is a mild gloss.
pub const GREY: u32 = 0;
pub const COLOURED: u32 = 1;
pub const GLOSSY: u32 = 2;

/// Radiant intensity of 1 W/sr in all directions.
pub const UNIT_POWER_W: Bands = [4.0 * PI; 3];

/// Meshes under one light, seen by a camera of 24 x 24 pixels and 70°, with shadow rays and without indirect light.
pub fn scene_of(meshes: Vec<Mesh>, light: Light, position_m: DVec3, look_at_m: DVec3) -> Scene {
    let glossy = Material {
        ks: [0.4, 0.3, 0.2],
        shininess: 20.0,
        ..Material::lambert("glossy", [0.3, 0.4, 0.5])
    };
    let view = (look_at_m - position_m).normalize();
    Scene {
        camera: Camera {
            resolution_px: [24, 24],
            position_m,
            look_at_m,
            up: if view.y.abs() > 0.99 {
                DVec3::Z
            } else {
                DVec3::Y
            },
            lens: Lens::FovY { fov_y_deg: 70.0 },
            pixel_sampling: None,
        },
        sensor: None,
        tof: None,
        lights: vec![light.into()],
        meshes: meshes.into_iter().map(Instance::from).collect(),
        materials: vec![
            Material::lambert("grey", [0.5; 3]),
            Material::lambert("coloured", [0.75, 0.5, 0.25]),
            glossy,
        ],
        textures: Vec::new(),
        direct: Direct {
            shadow: Some(Shadow::Rays),
        },
        indirect: None,
        vignetting_map: None,
        left_out: Vec::new(),
    }
}

pub fn point_light(position_m: DVec3) -> Light {
    Light::point(position_m, UNIT_POWER_W)
}

pub fn spot_light(position_m: DVec3, direction: DVec3, half_angles_deg: [f64; 2]) -> Light {
    let cone = SpotCone {
        inner_half_angle_deg: half_angles_deg[0],
        outer_half_angle_deg: half_angles_deg[1],
    };
    Light::spot(position_m, direction, cone, UNIT_POWER_W)
}

pub fn directional_light(direction: DVec3) -> Light {
    Light::directional(direction, [PI; 3])
}

/// The light with its emission multiplied by one factor per band.
pub fn amplified(light: &Light, factors: Bands) -> Light {
    let emission = light.emission();
    light.with_emission([0, 1, 2].map(|band| emission[band] * factors[band]))
}

/// A parallelogram of two triangles.
pub fn quad(name: &str, corner_m: DVec3, edge1_m: DVec3, edge2_m: DVec3, material: u32) -> Mesh {
    let far_m = corner_m + edge1_m + edge2_m;
    let corners = [corner_m, corner_m + edge1_m, far_m, corner_m + edge2_m];
    let positions = corners.map(|corner| corner.to_array());
    Mesh::from_slices(name, &positions, &[[0, 1, 2], [0, 2, 3]], material)
}

/// A parallelogram cut into `columns` x `rows` cells of two triangles.
pub fn grid(
    name: &str,
    [corner_m, edge1_m, edge2_m]: [DVec3; 3],
    [columns, rows]: [u32; 2],
    material: u32,
) -> Mesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let along = edge1_m * (f64::from(column) / f64::from(columns));
            let across = edge2_m * (f64::from(row) / f64::from(rows));
            positions.push((corner_m + along + across).to_array());
            if row < rows && column < columns {
                let first = row * (columns + 1) + column;
                let above = first + columns + 1;
                triangles.push([first, first + 1, above + 1]);
                triangles.push([first, above + 1, above]);
            }
        }
    }
    Mesh::from_slices(name, &positions, &triangles, material)
}

/// A box from its lowest corner, with faces along the axes.
pub fn cuboid(name: &str, corner_m: DVec3, size_m: DVec3, material: u32) -> Mesh {
    let corners: Vec<[f64; 3]> = (0..8)
        .map(|i| dvec3((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into()))
        .map(|unit| (corner_m + unit * size_m).to_array())
        .collect();
    let sides = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let triangles: Vec<[u32; 3]> = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Mesh::from_slices(name, &corners, &triangles, material)
}

/// A sphere around a point: the six faces of a cube with `steps` x `steps` cells each, projected to the radius.
pub fn sphere(centre_m: DVec3, radius_m: f64, steps: u32, material: u32) -> Mesh {
    let mut sphere = Mesh {
        name: "sphere".into(),
        ..Mesh::default()
    };
    for axis in 0..3 {
        let [normal, along, across] = [0, 1, 2].map(|turn| DVec3::AXES[(axis + turn) % 3]);
        for side in [1.0, -1.0] {
            let corner = side * normal - along - across;
            let plane = [corner, 2.0 * along, 2.0 * across];
            append(&mut sphere, grid("", plane, [steps; 2], material));
        }
    }
    // Cells of nearly equal size: equal angles along the cube's edges.
    for p in &mut sphere.positions_m {
        let on_face = DVec3::from(p.to_array().map(|p| (p * PI / 4.0).tan()));
        *p = centre_m + radius_m * on_face.normalize();
    }
    sphere
}

/// Adds the triangles of another mesh.
pub fn append(mesh: &mut Mesh, other: Mesh) {
    let first = mesh.positions_m.len() as u32;
    mesh.positions_m.extend(other.positions_m);
    let triangles = other.triangles.iter().map(|t| t.map(|i| first + i));
    mesh.triangles.extend(triangles);
    mesh.triangle_materials.extend(other.triangle_materials);
}

/// A convex ball around 0: meridians and parallels `turn / (2 * steps)` apart, with flat cells.
pub fn globe(radius_m: f64, steps: u32, material: u32) -> Mesh {
    let columns = f64::from(2 * steps);
    let map = [DVec3::ZERO, columns * DVec3::X, f64::from(steps) * DVec3::Y];
    let mut globe = grid("globe", map, [2 * steps, steps], material);
    for p in &mut globe.positions_m {
        let [turn, polar] = [p.x % columns, p.y].map(|cells| cells * PI / f64::from(steps));
        let (sine, cosine) = polar.sin_cos();
        *p = radius_m * dvec3(sine * turn.cos(), cosine, sine * turn.sin());
    }
    globe
}

/// The mesh with shading normals that point away from a point.
pub fn rounded(mut mesh: Mesh, centre_m: DVec3) -> Mesh {
    let outwards = mesh.positions_m.iter().map(|p| (*p - centre_m).normalize());
    mesh.normals = outwards.collect();
    mesh
}

/// A closed room of 2 m around 0 with two boxes in it, camera and point light inside.
pub fn room() -> Scene {
    let (tall, low) = (dvec3(0.5, 1.1, 0.4), dvec3(0.45, 0.4, 0.5));
    let mut room = empty_room();
    room.meshes.extend([
        cuboid("tall box", dvec3(-0.6, -0.999, -0.7), tall, COLOURED).into(),
        cuboid("low box", dvec3(0.2, -0.999, -0.3), low, GREY).into(),
    ]);
    room
}

/// The same room without the boxes.
pub fn empty_room() -> Scene {
    let room = cuboid("room", DVec3::splat(-1.0), DVec3::splat(2.0), GREY);
    let light = point_light(dvec3(0.23, 0.71, 0.17));
    let look_at_m = dvec3(-0.04, -0.31, -0.6);
    scene_of(vec![room], light, dvec3(0.13, 0.09, 0.93), look_at_m)
}

/// A floor and a wall of 2 m that meet at right angles in the line x = y = 0, and nothing else.
pub fn two_walls(light: Light, camera_m: DVec3, look_at_m: DVec3) -> Scene {
    let [x, y, z] = DVec3::AXES.map(|axis| 2.0 * axis);
    let meshes = vec![
        quad("floor", -DVec3::Z, z, x, GREY),
        quad("wall", -DVec3::Z, y, z, COLOURED),
    ];
    scene_of(meshes, light, camera_m, look_at_m)
}

/// The scene scaled about 0, then moved.
pub fn moved(scene: &Scene, scale: f64, shift_m: DVec3) -> Scene {
    let mut scene = scene.clone();
    let place = |point_m: &mut DVec3| *point_m = scale * *point_m + shift_m;
    let to_place = DAffine3::from_scale(DVec3::splat(scale));
    let to_place = DAffine3::from_translation(shift_m) * to_place;
    for instance in &mut scene.meshes {
        match instance.is_in_world_space() {
            true => instance.positions_m.iter_mut().for_each(place),
            false => instance.to_world = to_place * instance.to_world,
        }
    }
    place(&mut scene.camera.position_m);
    place(&mut scene.camera.look_at_m);
    if let Lens::Orthographic { height_m } = &mut scene.camera.lens {
        *height_m *= scale;
    }
    for light in &mut scene.lights {
        if let Some(position_m) = light.position_m_mut() {
            place(position_m);
        }
    }
    scene
}

/// The scene turned about 0 with its camera and lights.
pub fn turned(scene: &Scene, turn: DMat3) -> Scene {
    let mut scene = scene.clone();
    let rotate = |vector: &mut DVec3| *vector = turn * *vector;
    for mesh in &mut scene.meshes {
        mesh.positions_m.iter_mut().for_each(rotate);
        mesh.normals.iter_mut().for_each(rotate);
    }
    let camera = &mut scene.camera;
    for vector in [
        &mut camera.position_m,
        &mut camera.look_at_m,
        &mut camera.up,
    ] {
        rotate(vector);
    }
    for light in &mut scene.lights {
        if let Some(position_m) = light.position_m_mut() {
            rotate(position_m);
        }
        if let Some(direction) = light.direction_mut() {
            rotate(direction);
        }
    }
    scene
}

/// The scene under other lights.
pub fn lit_by(scene: &Scene, lights: Vec<impl Into<PlacedLight>>) -> Scene {
    Scene {
        lights: lights.into_iter().map(Into::into).collect(),
        ..scene.clone()
    }
}

/// The scene with a plain sum over an RSM.
pub fn with_sum(scene: &Scene, sum: VplSum, rsm_size: u32) -> Scene {
    with_indirect(scene, IndirectLight::vpl_sum(sum, rsm_size))
}

/// The scene with final gathering.
pub fn with_rays(scene: &Scene, target_error: f64) -> Scene {
    with_indirect(scene, IndirectLight::final_gather(target_error))
}

/// The scene with each estimator of indirect light, and the estimator's name.
pub fn with_each_estimator(
    scene: &Scene,
    rsm_size: u32,
    target_error: f64,
) -> [(&'static str, Scene); 3] {
    let sums = VplSum::ALL.map(|sum| IndirectLight::vpl_sum(sum, rsm_size));
    [sums[0], sums[1], IndirectLight::final_gather(target_error)]
        .map(|indirect| (indirect.name(), with_indirect(scene, indirect)))
}

fn with_indirect(scene: &Scene, indirect: IndirectLight) -> Scene {
    Scene {
        indirect: Some(indirect),
        ..scene.clone()
    }
}

/// The scene seen in band R by a time-of-flight camera without noise. All lights are modulated.
pub fn with_tof(scene: Scene, frequencies_hz: &[f64]) -> Scene {
    Scene {
        sensor: Some(Sensor {
            pixel_pitch_um: [10.0; 2],
            exposure_time_s: 1e-3,
            duty_cycle: 0.5,
            f_number: None,
            vignetting: None,
            wavelength_nm: Some(850.0),
            quantum_efficiency: Some(0.8),
            ..Sensor::DEFAULT
        }),
        tof: Some(TimeOfFlight {
            frequencies_hz: frequencies_hz.into(),
            phase_count: 4,
            contrasts: vec![0.75; frequencies_hz.len()],
            band_weights: [1.0, 0.0, 0.0],
            phase_offset_deg: 0.0,
            ambient_lights: Vec::new(),
            output: ChargeUnit::Electrons,
            noise: None,
        }),
        ..scene
    }
}

/// The scene with another shadow method.
pub fn with_shadow(scene: &Scene, shadow: Shadow) -> Scene {
    let shadow = Some(shadow);
    Scene {
        direct: Direct { shadow },
        ..scene.clone()
    }
}
