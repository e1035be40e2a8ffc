//! Reflectances at the ends of their range, and lobes from a half space to a needle.

use glam::DVec3;

use super::{
    Case, Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, TARGET_ERROR},
    scenes::{COLOURED, point_light, quad, room, scene_of, spot_light},
};
use crate::{
    Result, Scene,
    scene::{Lens, Material, Texture},
};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "diffuse_reflectance_of_zero_and_one",
        hazard: "a black surface has no lobe to draw from: 0/0",
        remedy: "what is black is not drawn from; white is like any other",
        is_short: true,
        known_issue: None,
        run: black_and_white,
    },
    Case {
        name: "mirror_like_reflectance_of_one",
        hazard: "k_s = 1 and k_d = 0: all light is in the lobe, and a diffuse draw finds nothing",
        remedy: "directions are drawn from both lobes and weighed against each other",
        is_short: true,
        known_issue: None,
        run: |examiner| specular_room(examiner, 30.0),
    },
    Case {
        name: "shininess_of_zero",
        hazard: "0^0, and a lobe that ends in a step",
        remedy: "the lobe is the open half space around the mirror direction",
        is_short: false,
        known_issue: None,
        run: |examiner| specular_room(examiner, 0.0),
    },
    Case {
        name: "shininess_of_one",
        hazard: "the lobe of a cosine, not to be confused with the cosine of the surface",
        remedy: "one formula for every exponent",
        is_short: false,
        known_issue: None,
        run: |examiner| specular_room(examiner, 1.0),
    },
    Case {
        name: "shininess_of_ten_thousand",
        hazard: "pow of a cosine that f32 keeps to 6e-8 is off by 6e-4",
        remedy: "1 − cosθ from the difference of the directions, log2 and exp2 by polynomials",
        is_short: true,
        known_issue: None,
        run: needle_lobes,
    },
    Case {
        name: "shininess_of_a_million",
        hazard: "a lobe of 0.1° between two texels: nothing or everything",
        remedy: "the same; how a lobe narrower than an RSM texel is sampled is the sum's own error",
        is_short: true,
        known_issue: None,
        run: lobes_of_a_million,
    },
    Case {
        name: "glossy_seen_in_glossy",
        hazard: "light by way of two lobes is found from neither end",
        remedy: "draws of both lobes, and VPLs with lobes of their own",
        is_short: true,
        known_issue: None,
        run: |examiner| specular_room(examiner, 100.0),
    },
    Case {
        name: "texture_of_black_and_white",
        hazard: "texels of 0 and 1 side by side, one texel alone, texture coordinates of a thousand",
        remedy: "bilinear by hand with full f32 weights",
        is_short: true,
        known_issue: None,
        run: textures,
    },
    Case {
        name: "reflects_more_than_it_receives",
        hazard: "k_d + k_s over 1 makes light",
        remedy: "a warning that names the material; the image is the formula's all the same",
        is_short: true,
        known_issue: None,
        run: more_than_it_receives,
    },
];

fn black_and_white(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    for material in &mut scene.materials {
        material.kd = [1.0; 3];
    }
    let mut parts = vec![examiner.all("white room", &scene, 24)?];
    // Some black among the white.
    scene.materials[COLOURED as usize].kd = [0.0; 3];
    parts.push(examiner.all("black box in it", &scene, 24)?);
    Ok(Measurement::of(parts))
}

/// The room with all its light in lobes.
fn lobes_alone(shininess: f64) -> Scene {
    let mut scene = room();
    for material in &mut scene.materials {
        material.kd = [0.0; 3];
        material.ks = [1.0, 0.9, 0.8];
        material.shininess = shininess;
    }
    scene
}

/// Mirror directions are rounded to 1e-7 each, which the exponent multiplies; where few pixels carry the image, a few such
/// errors do not average out.
fn lobe_bound(shininess: f64) -> f64 {
    KERNEL_BOUND + 3e-7 * shininess.sqrt()
}

fn specular_room(examiner: &mut Examiner, shininess: f64) -> Result<Measurement> {
    let scene = lobes_alone(shininess);
    let what = format!("lobes of {shininess}");
    Ok(Measurement::of([
        examiner.direct(&what, &scene, DIRECT_BOUND + lobe_bound(shininess))?,
        examiner.sums(&what, &scene, 24, lobe_bound(shininess))?,
        examiner.bounce(&what, &scene)?,
    ]))
}

/// The highlight that a light in the camera's place makes on the wall before it fills the image; and sums, of which a lobe of 1e6
/// finds next to nothing without some diffuse light.
fn sharp_lobes(examiner: &mut Examiner, shininess: f64) -> Result<Measurement> {
    let mut scene = lobes_alone(shininess);
    let what = format!("lobes of {shininess:.0e}");
    let mut highlight = scene.clone();
    highlight.camera.look_at_m = highlight.camera.position_m + DVec3::X;
    highlight.camera.lens = Lens::FovY {
        fov_y_deg: 300.0 / shininess.sqrt(),
    };
    highlight.lights = vec![point_light(highlight.camera.position_m)];
    for material in &mut scene.materials {
        material.kd = [0.01; 3];
    }
    let bound = lobe_bound(shininess);
    Ok(Measurement::of([
        examiner.direct(&what, &highlight, DIRECT_BOUND + bound)?,
        examiner.sums(&what, &scene, 24, bound)?,
    ]))
}

/// Few pixels: the reference, too, takes many samples to find light by way of two such lobes.
fn needle_lobes(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = lobes_alone(1e4);
    scene.camera.resolution_px = [16, 16];
    Ok(Measurement::of([
        sharp_lobes(examiner, 1e4)?,
        examiner.bounce_within("lobes of 1e4", &scene, TARGET_ERROR, 1024)?,
    ]))
}

/// A floor that mirrors a ceiling on which a spot stands, but takes no light itself: of two such lobes on one way there is no truth to
/// be had.
fn lobes_of_a_million(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let wall = quad(
        "mirror",
        DVec3::new(-0.9, -0.99, -0.9),
        1.8 * DVec3::Z,
        1.8 * DVec3::X,
        COLOURED,
    );
    scene.meshes.truncate(1);
    scene.meshes.push(wall.into());
    let material = &mut scene.materials[COLOURED as usize];
    material.kd = [0.0; 3];
    material.ks = [1.0, 0.9, 0.8];
    material.shininess = 1e6;
    let at = DVec3::new(0.1, 0.2, -0.2);
    scene.lights = vec![spot_light(at, DVec3::new(0.2, 1.0, -0.3), [40.0, 44.0])];
    scene.camera.look_at_m = DVec3::new(0.0, -0.9, -0.1);
    Ok(Measurement::of([
        sharp_lobes(examiner, 1e6)?,
        examiner.sums("ceiling in a floor", &scene, 24, lobe_bound(1e6))?,
        examiner.bounce("ceiling in a floor", &scene)?,
    ]))
}

/// A checkerboard of 0 and 1, and a texture of one texel, with coordinates up to a thousand.
fn textures(examiner: &mut Examiner) -> Result<Measurement> {
    let plane = [DVec3::new(-1.0, 0.0, -1.0), 2.0 * DVec3::Z, 2.0 * DVec3::X];
    let floor = quad("floor", plane[0], plane[1], plane[2], 0);
    let wall = quad("wall", plane[0], 2.0 * DVec3::X, 2.0 * DVec3::Y, 1);
    let light = point_light(DVec3::new(0.3, 0.9, 0.2));
    let eye_m = DVec3::new(0.2, 1.0, 1.6);
    let mut scene = scene_of(vec![floor, wall], light, eye_m, DVec3::new(0.0, 0.3, 0.0));
    let [black, white] = [[0.0; 3], [1.0; 3]];
    scene.textures = vec![
        Texture {
            name: "checker".into(),
            size_px: [2, 2],
            linear_rgb: vec![black, white, white, black],
        }
        .into(),
        Texture {
            name: "one texel".into(),
            size_px: [1, 1],
            linear_rgb: vec![[1.0, 0.5, 0.0]],
        }
        .into(),
    ];
    let mut parts = Vec::new();
    for (what, repeats) in [("2 repeats", 2.0), ("1000 repeats", 1000.0)] {
        for (index, mesh) in scene.meshes.iter_mut().enumerate() {
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            mesh.texcoords = corners.map(|uv| uv.map(|t| t * repeats)).to_vec();
            scene.materials[index].kd_texture = Some(index);
        }
        // f32 keeps texture coordinates to 6e-8 of themselves, a slope of 2 per texel and 2 texels a repeat; places of P are
        // off by as much of the quad's 2 m.
        let bound = DIRECT_BOUND + 4.0 * 2.0 * 1.2e-7 * repeats;
        parts.push(examiner.direct(what, &scene, bound)?);
        parts.push(examiner.sums(what, &scene, 24, KERNEL_BOUND)?);
        parts.push(examiner.bounce(what, &scene)?);
    }
    // All corners in one point of the texture, and in two: what is seen there has no size.
    for (what, corners) in [
        ("one place of the texture", [[0.25, 0.25]; 4]),
        (
            "a line of the texture",
            [[0.1, 0.7], [0.1, 0.7], [0.9, 0.7], [0.9, 0.7]],
        ),
    ] {
        for mesh in &mut scene.meshes {
            mesh.texcoords = corners.to_vec();
        }
        parts.push(examiner.all(what, &scene, 24)?);
    }
    Ok(Measurement::of(parts))
}

fn more_than_it_receives(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.materials[COLOURED as usize] = Material {
        ks: [0.6; 3],
        shininess: 10.0,
        ..Material::lambert("too bright", [0.7; 3])
    };
    let is_told = scene
        .warnings()
        .iter()
        .any(|text| text.contains("too bright"));
    Ok(Measurement::of([
        Measurement::new("warnings that are missing", f64::from(!is_told), 0.0),
        examiner.all("room", &scene, 24)?,
    ]))
}
