//! Reflectances at the ends of their range, and lobes from half a sphere wide to very narrow.

use glam::{DVec3, dvec3};

use super::{
    Case, Examiner,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, TARGET_ERROR},
    scenes::{COLOURED, GREY, empty_room, lit_by, point_light, quad, room, scene_of, spot_light},
};
use crate::{
    Result, Scene,
    scene::{Bands, Lens, Material, MetallicRoughness, Texels, Texture},
};

pub const CASES: &[Case] = &[
    Case::new(
        "diffuse_reflectance_of_zero_and_one",
        "a black surface has no lobe to sample: 0/0",
        "black lobes are not sampled; white needs no special case",
        black_and_white,
    ),
    Case::new(
        "mirror_like_reflectance_of_one",
        "k_s = 1 and k_d = 0: all light is in the lobe, and diffuse sampling finds nothing",
        "directions are sampled from both lobes and weighted against each other",
        |exam| specular_room(exam, 30.0),
    ),
    Case::new(
        "shininess_of_zero",
        "0^0, and a lobe that ends in a step",
        "the lobe is the open half space around the mirror direction",
        |exam| specular_room(exam, 0.0),
    )
    .long(),
    Case::new(
        "shininess_of_one",
        "a cosine lobe, easily confused with the surface's cosine",
        "one formula for every exponent",
        |exam| specular_room(exam, 1.0),
    )
    .long(),
    Case::new(
        "shininess_of_ten_thousand",
        "pow of a cosine that f32 keeps to 6e-8 is off by 6e-4",
        "1 − cosθ from the difference of the directions; log2 and exp2 by polynomials",
        needle_lobes,
    ),
    Case::new(
        "shininess_of_a_million",
        "a lobe of 0.1° between two texels: all or nothing",
        "the same; how a sum samples a lobe narrower than an RSM texel is the sum's own error",
        lobes_of_a_million,
    ),
    Case::new(
        "glossy_seen_in_glossy",
        "light by way of two lobes is found from neither end",
        "samples of both lobes, and VPLs with lobes of their own",
        |exam| specular_room(exam, 100.0),
    ),
    Case::new(
        "facets_almost_smooth",
        "roughness 0.03: a lobe of 0.1° whose density is the difference of two ones",
        "D from the sine of the half-way direction, not from its cosine",
        smooth_facets,
    ),
    Case::new(
        "facets_of_every_kind",
        "dielectrics reflect 4 % straight on and all at grazing angles, metals in colours; beside Phong lobes",
        "F is in the shape of the lobe, per band; its mean is the share that is interpolated",
        facets_of_every_kind,
    ),
    Case::new(
        "light_that_grazes_facets",
        "D, V and F all change most at the horizon, where visible normals are few",
        "directions follow the normals that are seen and mirror to above the surface",
        grazing_facets,
    ),
    Case::new(
        "texture_of_black_and_white",
        "texels of 0 and 1 side by side, a texture of one texel, texture coordinates of a thousand",
        "the kernel filters bilinearly with full f32 weights",
        textures,
    ),
    Case::new(
        "reflects_more_than_it_receives",
        "k_d + k_s over 1 creates light",
        "a warning names the material; the image still follows the formula",
        more_than_it_receives,
    ),
];

fn black_and_white(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    for material in &mut scene.materials {
        material.kd = [1.0; 3];
    }
    exam.all("white room", &scene)?;
    // A black box in the white room.
    scene.materials[COLOURED as usize].kd = [0.0; 3];
    exam.all("black box in it", &scene)
}

/// Makes a material reflect by its lobe alone.
fn make_specular(material: &mut Material, shininess: f64) {
    material.kd = [0.0; 3];
    material.ks = [1.0, 0.9, 0.8];
    material.shininess = shininess;
}

/// The room with materials that reflect by their lobes alone.
fn lobes_alone(shininess: f64) -> Scene {
    let mut scene = room();
    for material in &mut scene.materials {
        make_specular(material, shininess);
    }
    scene
}

/// Mirror directions are rounded by 1e-7 each, and the exponent multiplies that error. If few pixels carry the image, a few such errors do
/// not average out.
fn lobe_bound(shininess: f64) -> f64 {
    KERNEL_BOUND + 3e-7 * shininess.sqrt()
}

fn specular_room(exam: &mut Examiner, shininess: f64) -> Result<()> {
    let scene = lobes_alone(shininess);
    let what = format!("lobes of {shininess}");
    exam.direct(&what, &scene, DIRECT_BOUND + lobe_bound(shininess))?;
    exam.sums(&what, &scene, 24, lobe_bound(shininess))?;
    exam.bounce(&what, &scene)
}

/// Direct light: a light at the camera makes a highlight on the wall in front, which fills the image. Sums: without some diffuse light, a
/// lobe of 1e6 would find next to nothing.
fn sharp_lobes(exam: &mut Examiner, shininess: f64) -> Result<()> {
    let mut scene = lobes_alone(shininess);
    let what = format!("lobes of {shininess:.0e}");
    let mut highlight = lit_by(&scene, vec![point_light(scene.camera.position_m)]);
    highlight.camera.look_at_m = highlight.camera.position_m + DVec3::X;
    let fov_y_deg = 300.0 / shininess.sqrt();
    highlight.camera.lens = Lens::FovY { fov_y_deg };
    for material in &mut scene.materials {
        material.kd = [0.01; 3];
    }
    let bound = lobe_bound(shininess);
    exam.direct(&what, &highlight, DIRECT_BOUND + bound)?;
    exam.sums(&what, &scene, 24, bound)
}

/// Few pixels, because the reference, too, needs many samples to find light along two such lobes.
fn needle_lobes(exam: &mut Examiner) -> Result<()> {
    sharp_lobes(exam, 1e4)?;
    let mut scene = lobes_alone(1e4);
    scene.camera.resolution_px = [16, 16];
    exam.bounce_against(
        &exam.sampled(&scene, 1024)?,
        "lobes of 1e4",
        &scene,
        TARGET_ERROR,
    )
}

/// A floor that mirrors a ceiling lit by a spot. The floor itself receives no direct light, because a reference cannot be computed for
/// paths over two such lobes.
fn lobes_of_a_million(exam: &mut Examiner) -> Result<()> {
    sharp_lobes(exam, 1e6)?;
    let mut scene = mirror_under_ceiling();
    make_specular(&mut scene.materials[COLOURED as usize], 1e6);
    exam.sums("ceiling in a floor", &scene, 24, lobe_bound(1e6))?;
    exam.bounce("ceiling in a floor", &scene)
}

/// The floor is of the coloured material.
fn mirror_under_ceiling() -> Scene {
    let mut scene = empty_room();
    let corner = dvec3(-0.9, -0.99, -0.9);
    let mirror = quad("mirror", corner, 1.8 * DVec3::Z, 1.8 * DVec3::X, COLOURED);
    scene.meshes.push(mirror.into());
    let (at, up) = (dvec3(0.1, 0.2, -0.2), dvec3(0.2, 1.0, -0.3));
    scene.lights = vec![spot_light(at, up, [40.0, 44.0]).into()];
    scene.camera.look_at_m = dvec3(0.0, -0.9, -0.1);
    scene
}

fn facets(base_color: Bands, metallic: f64, roughness: f64) -> Material {
    Material {
        microfacets: Some(MetallicRoughness {
            metallic,
            roughness,
            ..MetallicRoughness::DEFAULT
        }),
        ..Material::lambert("facets", base_color)
    }
}

/// Like [`lobe_bound`]: α is about √(2/s) of a Phong lobe of the same width about h, whose angle is half of that about r.
fn facet_bound(roughness: f64) -> f64 {
    lobe_bound(0.5 / roughness.powi(4))
}

/// Direct light: a highlight that fills the image, as for sharp lobes. The bounce: a floor that mirrors a ceiling.
fn smooth_facets(exam: &mut Examiner) -> Result<()> {
    const ROUGHNESS: f64 = 0.03;
    let mut scene = room();
    for material in &mut scene.materials {
        *material = facets([1.0, 0.9, 0.8], 1.0, ROUGHNESS);
    }
    let mut highlight = lit_by(&scene, vec![point_light(scene.camera.position_m)]);
    highlight.camera.look_at_m = highlight.camera.position_m + DVec3::X;
    highlight.camera.lens = Lens::FovY { fov_y_deg: 0.4 };
    exam.direct("metal", &highlight, DIRECT_BOUND + facet_bound(ROUGHNESS))?;
    for material in &mut scene.materials {
        *material = facets([0.8, 0.5, 0.3], 0.0, ROUGHNESS);
    }
    exam.sums("dielectric", &scene, 24, facet_bound(ROUGHNESS))?;
    let mut scene = mirror_under_ceiling();
    scene.materials[COLOURED as usize] = facets([0.9, 0.8, 0.7], 1.0, ROUGHNESS);
    exam.bounce("ceiling in a floor", &scene)
}

fn facets_of_every_kind(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    for (metallic, roughness) in [(1.0, 0.3), (0.0, 0.2), (0.5, 1.0)] {
        let what = format!("metallic {metallic}, roughness {roughness}");
        for material in &mut scene.materials {
            *material = facets([0.9, 0.5, 0.2], metallic, roughness);
        }
        exam.direct(&what, &scene, DIRECT_BOUND + facet_bound(roughness))?;
        exam.sums(&what, &scene, 24, facet_bound(roughness))?;
        exam.bounce(&what, &scene)?;
    }
    // A metal beside a dielectric and a Phong lobe.
    scene.materials = room().materials;
    scene.materials[GREY as usize] = facets([0.6; 3], 0.0, 0.4);
    scene.materials[COLOURED as usize] = facets([0.9, 0.6, 0.2], 1.0, 0.25);
    exam.all("all together", &scene)
}

fn grazing_facets(exam: &mut Examiner) -> Result<()> {
    let corner = dvec3(-1.0, 0.0, -1.0);
    let [x, y, z] = DVec3::AXES.map(|axis| 2.0 * axis);
    let meshes = vec![
        quad("floor", corner, z, x, COLOURED),
        quad("wall", corner, x, y, GREY),
    ];
    let light = point_light(dvec3(-0.2, 0.3, -0.2));
    let mut scene = scene_of(meshes, light, dvec3(0.1, 0.2, 1.4), dvec3(0.0, 0.1, -1.0));
    for (what, metallic) in [("dielectric", 0.0), ("metal", 1.0)] {
        scene.materials[COLOURED as usize] = facets([0.7, 0.5, 0.4], metallic, 0.35);
        exam.direct(what, &scene, DIRECT_BOUND + facet_bound(0.35))?;
        exam.sums(what, &scene, 24, facet_bound(0.35))?;
        // Few of the reference's paths find light that reaches the floor at a grazing angle.
        let truth = exam.sampled(&scene, 4096)?;
        exam.bounce_against(&truth, what, &scene, TARGET_ERROR)?;
    }
    Ok(())
}

/// A checkerboard of 0 and 1, and a texture of one texel, with coordinates up to 1000.
fn textures(exam: &mut Examiner) -> Result<()> {
    let corner = dvec3(-1.0, 0.0, -1.0);
    let [x, y, z] = DVec3::AXES.map(|axis| 2.0 * axis);
    let meshes = vec![
        quad("floor", corner, z, x, 0),
        quad("wall", corner, x, y, 1),
    ];
    let light = point_light(dvec3(0.3, 0.9, 0.2));
    let mut scene = scene_of(meshes, light, dvec3(0.2, 1.0, 1.6), dvec3(0.0, 0.3, 0.0));
    let [black, white] = [[0.0; 3], [1.0; 3]];
    let checker = Texture {
        name: "checker".into(),
        size_px: [2, 2],
        texels: Texels::F32(vec![black, white, white, black]),
    };
    let one_texel = Texture {
        name: "one texel".into(),
        size_px: [1, 1],
        texels: Texels::F32(vec![[1.0, 0.5, 0.0]]),
    };
    scene.textures = vec![checker.into(), one_texel.into()];
    for index in [0, 1] {
        scene.materials[index].kd_texture = Some(index.into());
    }
    let mut map_to = |corners: [[f64; 2]; 4]| {
        for mesh in &mut scene.meshes {
            mesh.texcoords = corners.to_vec();
        }
        scene.clone()
    };
    for (what, n) in [("2 repeats", 2.0), ("1000 repeats", 1000.0)] {
        let repeated = map_to([[0.0, 0.0], [n, 0.0], [n, n], [0.0, n]]);
        // f32 keeps texture coordinates to a relative 6e-8; the slope is 2 per texel, with 2 texels per repeat. Positions of P have the
        // same relative error over the quad's 2 m.
        exam.by_rays(what, &repeated, DIRECT_BOUND + 4.0 * 2.0 * 1.2e-7 * n)?;
    }
    // All corners at one point of the texture, and at two: the visible part of the texture has no area.
    exam.all("one place of the texture", &map_to([[0.25, 0.25]; 4]))?;
    let line = map_to([[0.1, 0.7], [0.1, 0.7], [0.9, 0.7], [0.9, 0.7]]);
    exam.all("a line of the texture", &line)
}

fn more_than_it_receives(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    scene.materials[COLOURED as usize] = Material {
        ks: [0.6; 3],
        shininess: 10.0,
        ..Material::lambert("too bright", [0.7; 3])
    };
    let warnings = scene.warnings();
    let is_told = warnings.iter().any(|text| text.contains("too bright"));
    exam.record("", "missing warnings", f64::from(!is_told), 0.0);
    exam.all("room", &scene)
}
