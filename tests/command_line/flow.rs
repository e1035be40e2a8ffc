//! Flow to the previous frame, and occlusion, against closed forms.

use camlux::glam::{DMat3, DVec2, DVec3};
use camlux::output::{Layer, LayeredImage};

use crate::jobs::{Jobs, SCENE};

const SIZE_PX: usize = 64;

/// Focal length: 64 pixels over 50°. The camera looks along -z.
fn focal_px() -> f64 {
    0.5 * SIZE_PX as f64 / 25.0_f64.to_radians().tan()
}

fn image(jobs: &Jobs, frame: u32) -> LayeredImage {
    LayeredImage::read(jobs.path(&format!("set/frames/{frame:06}.exr"))).unwrap()
}

fn vectors<const N: usize>(image: &LayeredImage, layer: Layer) -> Vec<[f64; N]> {
    let (values, _) = image.values(layer).unwrap().as_chunks::<N>();
    values.iter().map(|v| v.map(f64::from)).collect()
}

fn numbers(image: &LayeredImage, layer: Layer) -> Vec<f32> {
    image.layer(layer.name()).unwrap().values.clone()
}

/// A job of so many frames at 64 × 64 pixels, with a second mesh.
fn jobs(second: &str, job: &str) -> Jobs {
    let layers = r#"layers = ["P", "N", "range", "id.instance", "flow", "flow_backward", "scene_flow_backward", "flow_occlusion", "flow_occlusion_backward"]"#;
    let jobs = Jobs::new(&format!(
        "[job]\nscene = \"scene.toml\"\nsize = [{SIZE_PX}, {SIZE_PX}]\n{layers}\n{job}"
    ));
    let mesh = "[[mesh]]\npath = \"second.obj\"\nmaterial = \"white\"\n[material.white]";
    jobs.write("scene.toml", &SCENE.replace("[material.white]", mesh));
    jobs.write("second.obj", second);
    jobs.succeed("set", &[]);
    jobs
}

/// A square of half this edge at a depth z.
fn square(half_m: f64, z_m: f64) -> String {
    let h = half_m;
    let corners = [[-h, -h], [h, -h], [h, h], [-h, h]];
    let vertices: String = corners
        .iter()
        .map(|[x, y]| format!("v {x} {y} {z_m}\n"))
        .collect();
    vertices + "f 1 2 3\nf 1 3 4\n"
}

#[test]
fn backward_flow_undoes_the_flow_of_the_frame_before() {
    let job = r#"
        [camera]
        poses = [
            { position = [0.0, 0.0, 3.0], look_at = [0.0, 0.0, 0.0] },
            { position = [0.15, 0.1, 2.9], look_at = [0.0, 0.0, 0.0] },
        ]
        [[mesh]]
        index = 1
        poses = [
            { position = [0.0, 0.0, 0.0] },
            { position = [0.1, 0.0, 0.2], rotation = [0.0, 0.17364817766693033, 0.0, 0.984807753012208] },
        ]
    "#;
    let jobs = jobs(&square(0.5, 0.5), job);
    let [first, second] = [0, 1].map(|frame| image(&jobs, frame));
    let flow = vectors::<2>(&first, Layer::Flow);
    let (backward, steps) = (
        vectors::<2>(&second, Layer::BackwardFlow),
        vectors::<3>(&second, Layer::BackwardSceneFlow),
    );
    let [ids, next_ids] = [&first, &second].map(|image| numbers(image, Layer::InstanceId));
    let hidden = numbers(&first, Layer::FlowOcclusion);
    let mut seen = [0, 0];
    let mut worst = 0.0_f64;
    for i in 0..ids.len() {
        if ids[i] == 0.0 || hidden[i] == 1.0 {
            continue;
        }
        let place = DVec2::new((i % SIZE_PX) as f64, (i / SIZE_PX) as f64);
        let to = place + DVec2::from(flow[i]);
        let (at, rest) = (to.floor(), to - to.floor());
        let pixels = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|step| {
            let pixel = (at + step).clamp(DVec2::ZERO, DVec2::splat(SIZE_PX as f64 - 1.0));
            pixel.y as usize * SIZE_PX + pixel.x as usize
        });
        // Where the four are of another surface, or one is at the border, there is nothing to interpolate.
        let is_whole = pixels.iter().all(|&pixel| next_ids[pixel] == ids[i]);
        if !is_whole || pixels[0] == pixels[3] {
            continue;
        }
        let weights = [
            (1.0 - rest.x) * (1.0 - rest.y),
            rest.x * (1.0 - rest.y),
            (1.0 - rest.x) * rest.y,
            rest.x * rest.y,
        ];
        let back: DVec2 = pixels
            .iter()
            .zip(weights)
            .map(|(&pixel, weight)| weight * DVec2::from(backward[pixel]))
            .sum();
        worst = worst.max(back.distance(-DVec2::from(flow[i])));
        seen[ids[i] as usize - 1] += 1;
    }
    // The flow on a plane is a rational function of the place. On the turned square its second derivatives are up to 0.0115 along x and 0.0011
    // along y, px/px^2, and interpolation is off by at most an eighth of their sum.
    println!("{seen:?}: {worst:.1e} px");
    assert!(
        seen[0] > 500 && seen[1] > 200 && worst < 1.7e-3,
        "{seen:?} {worst}"
    );
    // In the world, the wall stays and the square goes back.
    let positions = vectors::<3>(&second, Layer::Position);
    let turn = DMat3::from_rotation_y(20.0_f64.to_radians());
    for i in 0..next_ids.len() {
        let (p, step) = (DVec3::from(positions[i]), DVec3::from(steps[i]));
        match next_ids[i] {
            0.0 => assert!(step.is_nan()),
            1.0 => assert_eq!(step, DVec3::ZERO),
            _ => {
                let before = turn.transpose() * (p - DVec3::new(0.1, 0.0, 0.2));
                assert!((before - p).distance(step) < 1e-6, "{step}");
            }
        }
    }
    // At the ends of a sequence there is no other frame.
    for (image, flow, occlusion) in [
        (&first, Layer::BackwardFlow, Layer::BackwardFlowOcclusion),
        (&second, Layer::Flow, Layer::FlowOcclusion),
    ] {
        assert!(
            vectors::<2>(image, flow)
                .iter()
                .flatten()
                .all(|v| v.is_nan())
        );
        let ids = numbers(image, Layer::InstanceId);
        let hidden = numbers(image, occlusion);
        assert!(
            hidden
                .iter()
                .zip(ids)
                .all(|(&hidden, id)| (hidden == 1.0) == (id > 0.0))
        );
    }
}

/// A square before a wall, seen from two places: a point of the wall is hidden where the way to it meets the square.
#[test]
fn what_a_square_hides_is_occluded() {
    const HALF_M: f64 = 0.3;
    let eyes = [DVec3::new(0.0, 0.0, 3.0), DVec3::new(0.6, 0.1, 3.0)];
    // Without `look_at` the camera keeps its direction.
    let poses =
        "[camera]\nposes = [{ position = [0.0, 0.0, 3.0] }, { position = [0.6, 0.1, 3.0] }]\n";
    let jobs = jobs(&square(HALF_M, 1.0), poses);
    let mut counts = [0; 3];
    for (frame, layer) in [(0, Layer::FlowOcclusion), (1, Layer::BackwardFlowOcclusion)] {
        let image = image(&jobs, frame);
        let eye = eyes[1 - frame as usize];
        let ids = numbers(&image, Layer::InstanceId);
        let positions = vectors::<3>(&image, Layer::Position);
        for (i, &hidden) in numbers(&image, layer).iter().enumerate() {
            if ids[i] == 0.0 {
                assert_eq!(hidden, 0.0);
                continue;
            }
            let p = DVec3::from(positions[i]);
            let shown = (DVec2::new(p.x - eye.x, eye.y - p.y) * focal_px() / (eye.z - p.z))
                + 0.5 * SIZE_PX as f64;
            let is_outside = shown.min_element() < 0.0 || shown.max_element() > SIZE_PX as f64;
            // On the square's plane, in pixels there beyond its edge; below 0: inside.
            let crossing = eye + (p - eye) * (eye.z - 1.0) / (eye.z - p.z);
            let beyond_m = crossing.truncate().abs().max_element() - HALF_M;
            let beyond_px = beyond_m * focal_px() / (eye.z - 1.0);
            let is_wall = ids[i] == 1.0;
            match (is_outside, is_wall) {
                (true, _) => counts[0] += 1,
                (false, true) if beyond_px < 0.0 => counts[1] += 1,
                _ => counts[2] += 1,
            }
            // The other frame knows the square's edge to a pixel.
            if is_outside || !is_wall || beyond_px.abs() > 1.0 {
                let due = is_outside || is_wall && beyond_px < 0.0;
                assert_eq!(hidden == 1.0, due, "{p} {shown} {beyond_px}");
            }
        }
    }
    assert!(counts.iter().all(|&count| count > 50), "{counts:?}");
}

/// A sphere seen from two sides: it hides its own back and nothing of its front, although its surface is bent.
#[test]
fn a_sphere_hides_its_back_alone() {
    let (rings, sectors, radius_m) = (48, 96, 0.9);
    let mut sphere = String::new();
    for ring in 0..=rings {
        for sector in 0..sectors {
            let up = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let turn = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
            let at = DVec3::new(up.sin() * turn.cos(), up.cos(), up.sin() * turn.sin());
            let DVec3 { x, y, z } = radius_m * at + DVec3::Z;
            sphere += &format!("v {x} {y} {z}\nvn {} {} {}\n", at.x, at.y, at.z);
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let next = (sector + 1) % sectors;
            let corner = |ring: i32, sector: i32| {
                let index = 1 + ring * sectors + sector;
                format!("{index}//{index}")
            };
            let corners = [
                (ring, sector),
                (ring, next),
                (ring + 1, next),
                (ring + 1, sector),
            ];
            let corners = corners.map(|(ring, sector)| corner(ring, sector)).join(" ");
            sphere += &format!("f {corners}\n");
        }
    }
    let eyes = [DVec3::new(0.0, 0.0, 4.0), DVec3::new(2.4, 0.0, 2.8)];
    let poses = eyes.map(|eye| format!("{{ position = {eye}, look_at = [0.0, 0.0, 1.0] }}"));
    let jobs = jobs(
        &sphere,
        &format!("[camera]\nposes = [{}]\n", poses.join(", ")),
    );
    for (frame, layer) in [(0, Layer::FlowOcclusion), (1, Layer::BackwardFlowOcclusion)] {
        let image = image(&jobs, frame);
        let eye = eyes[1 - frame as usize];
        let ids = numbers(&image, Layer::InstanceId);
        let positions = vectors::<3>(&image, Layer::Position);
        let mut counts = [0; 2];
        for (i, &hidden) in numbers(&image, layer).iter().enumerate() {
            if ids[i] != 2.0 {
                continue;
            }
            let p = DVec3::from(positions[i]);
            let cosine = (p - DVec3::Z).normalize().dot((eye - p).normalize());
            // A pixel is 4.4 cm wide there, an 18th of the radius: it resolves the surface down to a cosine of (1/18)^(1/3).
            match cosine {
                0.38.. => assert_eq!(hidden, 0.0, "{p} {cosine}"),
                ..-0.1 => assert_eq!(hidden, 1.0, "{p} {cosine}"),
                _ => continue,
            }
            counts[usize::from(cosine < 0.0)] += 1;
        }
        println!("{counts:?}");
        assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    }
}
