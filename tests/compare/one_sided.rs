//! One-sided surfaces: the camera looks through their backs, light does not. By the rasteriser, by rays, and in the reference.

use crate::common::gpu::{Gpu, distort, radial};
use crate::common::reference_frame::{error_off_edges, reference_frame, values};
use crate::common::rooms::scene_of;
use camlux::{
    Plan, Scene,
    hard_cases::scenes::{cuboid, grid, quad},
    output::{Frame, Layer},
    scene::{IndirectLight, Instance, Lens, Light, Mesh},
};
use glam::{DAffine3, DMat3, DVec3};

/// A closed box around 0 whose walls are seen from inside. 384 triangles are enough to be shared on the device.
fn shell(half_m: f64) -> Mesh {
    let mut walls: Option<Mesh> = None;
    for axis in 0..3 {
        let [normal, across, up] = [0, 1, 2].map(|turn| DVec3::AXES[(axis + turn) % 3]);
        for side in [1.0, -1.0] {
            // The cross product of the edges points inwards.
            let (edge1, edge2) = (-2.0 * half_m * side * across, 2.0 * half_m * up);
            let corner = half_m * (side * normal + side * across - up);
            let wall = grid("shell", [corner, edge1, edge2], [4, 8], 0);
            match &mut walls {
                None => walls = Some(wall),
                Some(walls) => {
                    let first = walls.positions_m.len() as u32;
                    let triangles = wall.triangles.iter();
                    let triangles = triangles.map(|corners| corners.map(|corner| first + corner));
                    walls.triangles.extend(triangles);
                    walls.positions_m.extend(&wall.positions_m);
                    walls.triangle_materials.extend(&wall.triangle_materials);
                }
            }
        }
    }
    walls.expect("six walls")
}

/// Shells around a cube and a sheet over it, and a lamp between them. The camera is outside.
fn room(shells: usize, to_world: DMat3) -> Scene {
    let camera_m = DVec3::new(2.6, 2.1, 3.1);
    let lamp = Light::point(DVec3::new(0.1, 0.6, -0.2), [30.0, 20.0, 10.0]);
    let cube = cuboid("cube", DVec3::new(-0.3, -1.0, -0.2), DVec3::splat(0.5), 1);
    // Its front is below, so that the camera looks through it, but its shadow is on the cube and the floor.
    let corner = DVec3::new(-0.4, -0.1, -0.5);
    let sheet = quad("sheet", corner, 0.9 * DVec3::X, 0.8 * DVec3::Z, 2);
    let mut scene = scene_of(vec![shell(1.0), cube, sheet], lamp, camera_m, DVec3::ZERO);
    scene.camera.resolution_px = [32, 24];
    scene.camera.lens = Lens::FovY { fov_y_deg: 36.0 };
    for material in [0, 2] {
        scene.materials[material].is_one_sided = true;
    }
    scene.meshes[0].to_world = DAffine3::from_mat3(to_world);
    for outer in 1..shells {
        let scale = DMat3::from_diagonal(DVec3::splat(1.0 + 0.05 * outer as f64));
        scene.meshes.push(Instance {
            to_world: DAffine3::from_mat3(scale * to_world),
            ..scene.meshes[0].clone()
        });
    }
    scene
}

fn through_lens(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    distort(&mut scene, radial(-0.05, 0.01));
    scene
}

/// The camera sees the inner shell from inside, and the cube, and nothing of the other shells in front of them. The sheet has a shadow.
fn assert_inside_is_seen(what: &str, frame: &Frame) {
    let ids = frame.ids(Layer::InstanceId).expect("a layer");
    let vectors = |layer| values(frame, layer).as_chunks::<3>().0;
    let (positions, normals) = (vectors(Layer::Position), vectors(Layer::Normal));
    let mut shadows = 0;
    let (mut of_shell, mut of_cube) = (0, 0);
    for (pixel, &id) in ids.iter().enumerate() {
        let [position, normal] =
            [positions, normals].map(|of| glam::Vec3::from(of[pixel]).as_dvec3());
        let light = vectors(Layer::Direct)[pixel];
        match id {
            0 | 3 => assert_eq!(id, 0, "{what}: the sheet's back is seen"),
            2 => of_cube += 1,
            _ => {
                let inwards = -position.dot(normal);
                assert!(inwards > 0.9, "{what}: {position} {normal} of {id}");
                of_shell += usize::from(id == 1);
                shadows += usize::from(id == 1 && light == [0.0; 3]);
            }
        }
    }
    println!("{what}: {of_shell} pixels of the shell, {shadows} in shadow, {of_cube} of the cube");
    assert!(of_shell > 200 && of_cube > 5 && shadows > 5, "{what}");
}

#[test]
fn the_camera_looks_through_backs_and_light_does_not() {
    let mut gpu = Gpu::open();
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    // The rays of a camera meet the backs of 1 and of 7 walls.
    for (shells, to_world) in [
        (1, DMat3::IDENTITY),
        (1, mirror),
        (7, DMat3::IDENTITY),
        (7, mirror),
    ] {
        for is_flattened in [false, true] {
            let scene = room(shells, to_world);
            let scene = if is_flattened {
                scene.flattened()
            } else {
                scene
            };
            let lens = through_lens(&scene);
            let what = format!("{shells} shells, {to_world}, own meshes {is_flattened}");
            let plain = (reference_frame(&scene, 1, 0), vec![gpu.render(&scene)]);
            let bent = (
                reference_frame(&lens, 1, 0),
                gpu.render_by_each_tracer(&lens),
            );
            for (truth, frames) in [plain, bent] {
                assert_inside_is_seen(&format!("reference, {what}"), &truth);
                for frame in &frames {
                    assert_inside_is_seen(&what, frame);
                    let ids = [frame, &truth].map(|f| f.ids(Layer::InstanceId).expect("ids"));
                    let pairs = ids[0].iter().zip(ids[1]);
                    let others = pairs.filter(|(found, due)| found != due).count();
                    assert!(others <= 4, "{what}: {others} pixels show something else");
                    for (layer, bound) in [
                        (Layer::Position, 1e-5),
                        (Layer::Normal, 1e-4),
                        (Layer::Direct, 1e-4),
                    ] {
                        let error = error_off_edges(frame, &truth, layer);
                        assert!(error < bound, "{what}, {layer:?}: {error}");
                    }
                }
            }
        }
    }
}

/// What the camera looks through gives and hides as much light as any other surface.
#[test]
fn the_bounce_meets_both_sides() {
    let mut gpu = Gpu::open();
    let mut scene = room(1, DMat3::IDENTITY);
    scene.indirect = Some(IndirectLight::final_gather(0.03));
    let truth = reference_frame(&scene, 256, 8);
    let error = error_off_edges(&gpu.render(&scene), &truth, Layer::Indirect);
    println!("{error}");
    assert!(error < 0.06, "{error}");
    scene.materials[2].is_one_sided = false;
    let both_sides = reference_frame(&scene, 256, 8);
    let ids = both_sides.ids(Layer::InstanceId).expect("a layer");
    // But where the sheet itself is seen, its sides change nothing.
    let is_same = |layer| {
        let [one, both] = [&truth, &both_sides].map(|frame| values(frame, layer));
        let pixels = one.chunks(3).zip(both.chunks(3)).zip(ids);
        let mut others = pixels.filter(|(_, id)| **id != 3);
        others.all(|((one, both), _)| one == both)
    };
    assert!(is_same(Layer::Direct) && is_same(Layer::Indirect));
}

/// Two-sided materials, and one-sided ones that no mesh has, cost nothing.
#[test]
fn only_scenes_with_one_sided_surfaces_plan_for_them() {
    let gpu = Gpu::open();
    let mut scene = room(1, DMat3::IDENTITY);
    let says = |scene: &Scene| {
        let plan = Plan::new(scene, gpu.device.info()).expect("a plan");
        plan.to_string().contains("one-sided")
    };
    assert!(says(&scene));
    for material in &mut scene.materials {
        material.is_one_sided = false;
    }
    scene.materials.push(scene.materials[0].clone());
    scene.materials[3].is_one_sided = true;
    assert!(!says(&scene));
}
