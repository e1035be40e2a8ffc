//! Bad scene files: each is refused with a message that states what is wrong, in which line, and how to mend it.

use crate::common::rows::rows;
use crate::common::scene_folder::{CAMERA, LIGHT, MESH, SceneFolder, assert_says};
use camlux::scene::Scene;

#[track_caller]
fn refuses_toml(toml: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    assert_says(&folder.error(folder.load(toml)), parts);
}

const SENSOR: &str = "[sensor]\npixel_pitch_um = [1, 1]\nexposure_time_s = 1\n";

/// A camera block with one line replaced.
fn camera_with(line: &str, replacement: &str) -> String {
    assert!(CAMERA.contains(line));
    format!("{}{LIGHT}", CAMERA.replace(line, replacement))
}

#[test]
fn time_of_flight_that_is_not_all_there() {
    let scene = |tof: &str, of_light: &str| format!("{CAMERA}{LIGHT}{of_light}{tof}");
    let tof = "[tof]\nfrequencies_mhz = [20]\ncontrast = 0.75\nband = \"R\"\n";
    rows! { refuses_toml;
        scene(tof, "") => "scene.toml:11, tof: the quantum efficiency of the pixels is not known";
        scene("", "modulated = true\n") =>
            "scene.toml:11: \"modulated\" in [[light]] has no effect without [tof]";
        scene(tof, "modulated = 1\n") => "scene.toml:11: \"modulated\"", "give true or false";
        scene(&tof.replace("[20]", "[]"), "") => "scene.toml:12: \"frequencies_mhz\" is empty";
        scene(&tof.replace("\"R\"", "\"X\""), "") => "unknown band \"X\" in [tof]", "R, G, B";
        scene(&tof.replace("0.75", "\"much\""), "") =>
            "\"contrast\" in [tof] is the string \"much\"";
        scene("[sensor]\npixel_pitch_um = [1, 1]\nexposure_time_s = 1\nduty_cycle = 1\nwavelength_nm = 850\n", "") =>
            "scene.toml:11, sensor: has only one of wavelength_nm and quantum_efficiency";
    }
}

#[test]
fn images_of_vignetting_that_are_none() {
    let folder = SceneFolder::new();
    let save = |name: &str, grey: [f32; 2]| {
        let pixel = |x: usize, _| (grey[x], grey[x], grey[x]);
        exr::prelude::write_rgb_file(folder.path(name), 2, 1, pixel).unwrap();
    };
    save("below.exr", [1.0, -0.5]);
    save("counts.exr", [1.0, 3000.0]);
    save("black.exr", [0.0; 2]);
    save("fine.exr", [0.5, 1.0]);
    let coloured = image::RgbImage::from_pixel(2, 1, image::Rgb([9, 9, 8]));
    coloured.save(folder.path("coloured.png")).unwrap();
    let with = |lens: &str| {
        let toml = format!("{CAMERA}{SENSOR}[lens]\n{lens}\n{LIGHT}{MESH}");
        folder.load(&toml)
    };
    for (file, words) in [
        (
            "none.exr",
            ["scene.toml:12: cannot read the image", "none.exr"],
        ),
        (
            "coloured.png",
            ["coloured.png is not grey", "save one grey channel"],
        ),
        (
            "below.exr",
            [
                "below.exr: a pixel is -0.5",
                "save finite values of 0 or more",
            ],
        ),
        (
            "counts.exr",
            ["pixel (1, 0) is 3000", "divide the image of the flat field"],
        ),
        (
            "black.exr",
            ["all pixels are 0", "give the light over that on the axis"],
        ),
    ] {
        let refused = with(&format!("f_number = 2.8\nvignetting = \"{file}\""));
        assert_says(&folder.error(refused), &words);
    }
    let alone = with("vignetting = \"fine.exr\"");
    let words = ["vignetting is given without an f_number", "give f_number"];
    assert_says(&folder.error(alone), &words);
    let scene = with("f_number = 2.8\nvignetting = \"fine.exr\"").unwrap();
    assert_eq!(scene.vignetting_map.unwrap().values, [0.5, 1.0]);
}

#[test]
fn unreadable_and_invalid_scene_files() {
    let folder = SceneFolder::new();
    let missing = Scene::load(&folder.path("none.toml"));
    assert_says(
        &folder.error(missing),
        &["none.toml: cannot read the scene file", "check the path"],
    );
    rows! { refuses_toml;
        "[camera\n" => "scene.toml:1: not valid TOML", "correct this line";
        "[camera]\nup = 1\nup = 2\n" => "scene.toml:3", "duplicate key";
        "" => "scene.toml: the scene file has no \"camera\"";
        format!("version = 2\n{CAMERA}{LIGHT}") =>
            "scene.toml:1: scene file version 2 is not known; write version = 1";
    }
}

#[test]
fn unknown_keys_name_the_nearest_one_and_the_line() {
    rows! { refuses_toml;
        format!("{CAMERA}{LIGHT}[meshes]\n") =>
            "scene.toml:11: unknown key \"meshes\" in the scene file", "did you mean \"mesh\"?";
        format!("[job]\nscene = \"scene.toml\"\n{CAMERA}") =>
            "scene.toml: this is a job file", "camlux batch";
        // The message suggests no key: "position" is already present, and no other key is similar.
        camera_with("look_at", "positions") =>
            "scene.toml:4: unknown key \"positions\" in [camera]",
            "keys not used yet: look_at, camera_to_world, world_to_camera, axes, fov_x_deg";
        format!("{CAMERA}{}", LIGHT.replace("power_w", "intensity")) =>
            "scene.toml:10: unknown key \"intensity\" in [[light]]", "; keys not used yet: power_w";
        camera_with("fov_y_deg", "filter = \"box\"\nfov_y_deg") =>
            "scene.toml:6: \"filter\" in [camera] is given without samples to filter",
            "give samples = 16, too";
        camera_with("fov_y_deg", "samples = 16\nfilter = \"tent\"\nfov_y_deg") =>
            "scene.toml:7: unknown filter \"tent\" in [camera]", "gaussian";
        camera_with("fov_y_deg", "samples = 0\nfov_y_deg") =>
            "samples is 0", "give 1 for the pixels' centres, or up to 4096";
        camera_with("fov_y_deg", "fov") =>
            "scene.toml:6: unknown key \"fov\" in [camera]", "did you mean \"fov_y_deg\"?";
        camera_with("fov_y_deg = 50.0", "intrinsics_px = { fx = 1, fy = 1, cx = 1, cz = 1 }") =>
            "scene.toml:6: unknown key \"cz\" in intrinsics_px", "did you mean \"cy\"?";
        format!("{CAMERA}{}", LIGHT.replace("power_w", "power")) =>
            "scene.toml:10: unknown key \"power\" in [[light]]", "did you mean \"power_w\"?";
        format!("{CAMERA}[lens]\nf_number = 2.8\n{LIGHT}{MESH}") =>
            "scene.toml:7: [lens] has no effect without [sensor]", "add a [sensor] table";
        format!("{CAMERA}{SENSOR}[lens]\nvignetting = -0.3\n{LIGHT}{MESH}") =>
            "scene.toml:11: \"vignetting\" in [lens] is the number -0.3", "give an array of 3 finite numbers";
        format!("{CAMERA}{SENSOR}[lens]\nvignetting = [-0.3, 0, 0]\n{LIGHT}{MESH}") =>
            "scene.toml:11, sensor: vignetting is given without an f_number", "give f_number";
        format!("{CAMERA}{SENSOR}[lens]\nf_number = 2.8\nvignetting = [-1.5, 0, 0]\n{LIGHT}{MESH}") =>
            "scene.toml:12, sensor: vignetting makes the factor -0.500 in pixel (",
            "give coefficients of a polynomial that is above 0";
        format!("{CAMERA}{SENSOR}[lens]\nf_number = 2.8\nvignetting = \"none.exr\"\n{LIGHT}{MESH}") =>
            "scene.toml:12: cannot read the image", "none.exr";
        format!("{CAMERA}{LIGHT}relative_to = \"robot\"\n") =>
            "scene.toml:11: unknown relative_to \"robot\" in [[light]]",
            "choose one of: camera, mesh";
        format!("{CAMERA}{LIGHT}relative_to = \"mesh\"\n{MESH}") =>
            "scene.toml:7: [[light]] has no \"mesh\"", "add mesh = 0, its place in this file";
        format!("{CAMERA}{LIGHT}relative_to = \"mesh\"\nmesh = 1\n{MESH}") =>
            "scene.toml:12: \"mesh\" in [[light]] is 1, and there are 1 meshes", "count from 0";
        format!("{CAMERA}{}", LIGHT.replace("point", "pint")) =>
            "scene.toml:8: unknown kind \"pint\" in [[light]]", "did you mean \"point\"?";
        format!("{CAMERA}{LIGHT}{MESH}scael = 2\n") =>
            "scene.toml:13: unknown key \"scael\" in [[mesh]]", "did you mean \"scale\"?";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nshiny = 2\n") =>
            "scene.toml:13: unknown key \"shiny\" in [material.clay]",
            "did you mean \"shininess\"?";
        format!("{CAMERA}{LIGHT}{MESH}material = \"clai\"\n[material.clay]\nkd = 0.5\n") =>
            "scene.toml:13: there is no [material.clai]", "did you mean \"clay\"?";
        format!("{CAMERA}{LIGHT}{MESH}material = \"clay\"\n") =>
            "scene.toml:13: there is no [material.clay]", "add a [material.clay] table";
        format!("{CAMERA}{LIGHT}[sensor]\nexposure = 1\n") =>
            "scene.toml:12: unknown key \"exposure\" in [sensor]",
            "did you mean \"exposure_time_s\"?";
        format!("{CAMERA}{LIGHT}[direct]\nshadows = \"rays\"\n") =>
            "scene.toml:12: unknown key \"shadows\" in [direct]", "did you mean \"shadow\"?";
        format!("{CAMERA}{LIGHT}[direct]\nshadow = \"ray\"\n") =>
            "scene.toml:12: unknown shadow \"ray\" in [direct]", "did you mean \"rays\"?";
        format!("{CAMERA}{LIGHT}[direct]\n") =>
            "scene.toml:11: [direct] has no \"shadow\"", "add shadow = \"map\" or \"rays\"";
        format!("{CAMERA}{LIGHT}[indirect]\nestimater = \"rsm-average\"\n") =>
            "scene.toml:12: unknown key \"estimater\" in [indirect]", "did you mean \"estimator\"?";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"instant_radiosity\"\nrsm_size = 8\n") =>
            "scene.toml:12: unknown estimator \"instant_radiosity\" in [indirect]",
            "did you mean \"instant-radiosity\"?";
    }
}

#[test]
fn missing_keys() {
    rows! { refuses_toml;
        camera_with("position = [0, 1, 3]\n", "") =>
            "scene.toml:1: [camera] has no \"position\"", "add position = [x, y, z]";
        camera_with("fov_y_deg = 50.0\n", "") =>
            "scene.toml:1: [camera] has neither \"fov_y_deg\" nor \"intrinsics_px\"",
            "add fov_y_deg";
        format!("{CAMERA}intrinsics_px = {{ fx = 9, fy = 9, cx = 4, cy = 3 }}\n{LIGHT}") =>
            "scene.toml:7: \"intrinsics_px\" in [camera] conflicts with \"fov_y_deg\"", "keep one";
        camera_with("fov_y_deg = 50.0", "intrinsics_px = { fx = 9, fy = 9, cx = 4 }") =>
            "scene.toml:6: intrinsics_px has no \"cy\"", "add all four";
        format!("{CAMERA}{}", LIGHT.replace("power_w = 50.0\n", "")) =>
            "scene.toml:7: [[light]] has no \"power_w\"", "add power_w = 50.0";
        format!("{CAMERA}[[light]]\n") =>
            "scene.toml:7: [[light]] has no \"kind\"", "\"directional\"";
        format!("{CAMERA}{LIGHT}[[mesh]]\n") =>
            "scene.toml:11: [[mesh]] has no \"path\"", "add path";
        format!("{CAMERA}{LIGHT}[indirect]\nrsm_size = 64\n") =>
            "scene.toml:11: [indirect] has no \"estimator\"",
            "\"final-gather\" or \"rsm-average\" or \"instant-radiosity\"";
        format!("{CAMERA}{LIGHT}[sensor]\npixel_pitch_um = [3, 3]\nexposure_time_s = 1e-3\nnoises = 1\n") =>
            "scene.toml:14: unknown key \"noises\" in [sensor]", "did you mean \"noise\"?";
        format!("{CAMERA}{LIGHT}[sensor]\npixel_pitch_um = [3, 3]\nexposure_time_s = 1e-3\nbayer = \"RGBG\"\n") =>
            "scene.toml:14: unknown bayer \"RGBG\" in [sensor]", "did you mean \"RGGB\"?";
        format!("{CAMERA}{LIGHT}[sensor]\npixel_pitch_um = [3, 3]\nexposure_time_s = 1e-3\n[sensor.noise]\n") =>
            "scene.toml:14: [sensor.noise] has no \"full_well_e\"", "electrons per well";
        format!("{CAMERA}{LIGHT}[material.clay]\n") =>
            "scene.toml:11: [material.clay] has no \"kd\"", "add kd";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nks = 0.2\n") =>
            "scene.toml:11: [material.clay] has no \"shininess\"", "add shininess";
        format!("{CAMERA}{LIGHT}[material.clay]\nbase_color = 0.5\nmetallic = 1\n") =>
            "scene.toml:11: [material.clay] has no \"roughness\"", "add roughness = 0.4";
        format!("{CAMERA}{LIGHT}[material.clay]\nbase_color = 0.5\nroughness = 0.5\nkd = 0.5\n") =>
            "scene.toml:14: \"kd\" in [material.clay] is of a Phong lobe", "remove it, or base_color";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nroughness = 0.5\n") =>
            "scene.toml:13: \"roughness\" in [material.clay] is of a surface of microfacets",
            "add base_color = 0.8";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nemission_w_m2 = 2.0\n") =>
            "scene.toml:13: unknown key \"emission_w_m2\" in [material.clay]", "did you mean \"emission_w_sr_m2\"?";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\none_sided = 1\n") =>
            "scene.toml:13: \"one_sided\" in [material.clay] is the integer 1", "give true or false";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nemission_w_sr_m2 = [1, 2]\n") =>
            "scene.toml:13: \"emission_w_sr_m2\" in [material.clay]", "one finite number or an array [r, g, b]";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 0.5\nemission_texture = 0\n") =>
            "scene.toml:13: \"emission_texture\" in [material.clay] is 0, and there are 0 [[texture]] tables";
    }
}

#[test]
fn wrong_types() {
    rows! { refuses_toml;
        camera_with("[8, 6]", "[8.5, 6]") =>
            "scene.toml:2: \"resolution\" in [camera] is the array [8.5, 6]", "2 whole numbers";
        camera_with("[8, 6]", "[-8, 6]") => "scene.toml:2", "2 whole numbers";
        camera_with("[0, 1, 3]", "[0, 1]") =>
            "scene.toml:3: \"position\" in [camera] is the array",
            "give an array of 3 finite numbers";
        camera_with("[0, 1, 3]", "[0, nan, 3]") =>
            "scene.toml:3", "give an array of 3 finite numbers";
        camera_with("50.0", "\"50\"") =>
            "scene.toml:6: \"fov_y_deg\" in [camera] is the string \"50\"", "give a finite number";
        camera_with("50.0", "1e999") => "scene.toml:6", "give a finite number";
        format!("camera = 3\n{LIGHT}") =>
            "scene.toml:1: \"camera\" in the scene file is the integer 3", "give a table";
        format!("{CAMERA}{}", LIGHT.replace("[[light]]", "[light]")) =>
            "\"light\" in the scene file is a table", "[[light]], in double brackets";
        format!("{CAMERA}{}", LIGHT.replace("\"point\"", "1")) =>
            "scene.toml:8: \"kind\" in [[light]] is the integer 1", "give a string in quotes";
        format!("{CAMERA}{}", LIGHT.replace("50.0", "[1, 2]")) =>
            "scene.toml:10: \"power_w\" in [[light]]", "one finite number or an array [r, g, b]";
        format!("{CAMERA}{LIGHT}{MESH}flat = 1\n") =>
            "scene.toml:13: \"flat\" in [[mesh]] is the integer 1", "give true or false";
        format!("{CAMERA}{LIGHT}{MESH}scale = 0\n") =>
            "scene.toml:13: \"scale\" in [[mesh]] is 0", "give a number above 0";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"rsm-average\"\nrsm_size = -1\n") =>
            "scene.toml:13: \"rsm_size\" in [indirect] is the integer -1",
            "give a whole number from 0";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"final-gather\"\ntarget_error = \"2 %\"\n") =>
            "scene.toml:13: \"target_error\" in [indirect] is the string \"2 %\"",
            "give a finite number";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"final-gather\"\nmax_rays = 1e9\n") =>
            "scene.toml:13: \"max_rays\" in [indirect] is the number 1e9",
            "give a whole number of 0 or more";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"final-gather\"\nerror_norm = \"locally\"\n") =>
            "scene.toml:13: unknown error_norm \"locally\" in [indirect]",
            "did you mean \"local\"? choose one of: image, local";
    }
}

/// For a scene file, errors of [`Scene::validate`] name the line of the key.
#[test]
fn values_out_of_range_are_reported_with_their_line() {
    let spot = "[[light]]\nkind = \"spot\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\ninner_half_angle_deg = 40\nouter_half_angle_deg = 30\npower_w = 1\n";
    rows! { refuses_toml;
        camera_with("[8, 6]", "[0, 0]") =>
            "scene.toml:2, camera: resolution is 0 x 0", "at least 1 x 1";
        format!("{CAMERA}{LIGHT}{}", LIGHT.replace("50.0", "-50.0")) =>
            "scene.toml:14, light 1 (point): power_w is [-50.0, -50.0, -50.0]", "0 or more";
        format!("{CAMERA}{spot}") =>
            "scene.toml:11, light 0 (spot): inner_half_angle_deg 40 is larger than outer_half_angle_deg 30",
            "no wider";
        format!("{CAMERA}[[light]]\nkind = \"directional\"\ndirection = [0, 0, 0]\nirradiance_w_m2 = 1\n") =>
            "scene.toml:9, light 0 (directional): direction is [0, 0, 0]", "any length but zero";
        format!("{CAMERA}{LIGHT}[material.clay]\nkd = 1.5\n") =>
            "scene.toml:12, material 0 (\"clay\"): kd is [1.5, 1.5, 1.5]", "from 0 to 1";
        format!("{CAMERA}{LIGHT}{MESH}translate = [0, 0, 1e13]\n") =>
            "scene.toml:11, mesh 0 (\"mesh.obj\"): vertex 0 is", "1e12 m";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"rsm-average\"\nrsm_size = 0\n") =>
            "scene.toml:13, indirect: rsm_size is 0", "such as 64";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"final-gather\"\ntarget_error = 2\n") =>
            "scene.toml:13, indirect: target_error is 2", "from 0.002 to 0.5, such as 0.02";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"final-gather\"\nmax_ms = -1\n") =>
            "scene.toml:13, indirect: max_ms is -1",
            "give finite milliseconds above 0, such as 500";
        format!("{CAMERA}{LIGHT}[indirect]\nestimator = \"rsm-average\"\nrsm_size = 8\ninterpolation_error = 0.6\n") =>
            "scene.toml:14, indirect: interpolation_error is 0.6",
            "from 0.002 to 0.5, such as 0.02";
    }
}

fn refuses_key((estimator, key): &(&str, &str), words: &[&str]) {
    let indirect = format!("[indirect]\nestimator = \"{estimator}\"\nrsm_size = 8\n{key}\n");
    let toml = format!("{CAMERA}{LIGHT}{indirect}");
    refuses_toml(&toml, &[&["scene.toml:14: "], words].concat());
}

#[test]
fn keys_of_another_estimator_and_removed_keys_name_what_replaces_them() {
    rows! { refuses_key;
        ("instant-radiosity", "visibility = \"rays\"") =>
            "\"visibility\" in [indirect] follows from the estimator",
            "set estimator = \"final-gather\"";
        ("instant-radiosity", "visibility = \"none\"") =>
            "\"visibility\" in [indirect] follows from the estimator",
            "remove it: rsm-average and instant-radiosity have none";
        ("rsm-average", "visibility = \"none\"") =>
            "\"visibility\" in [indirect] follows from the estimator",
            "remove it: rsm-average and instant-radiosity have none";
        ("rsm-average", "target_error = 0.05") =>
            "\"target_error\" in [indirect] is relative to the true bounce, to which rsm-average does not converge",
            "use interpolation_error";
        ("instant-radiosity", "target_error = 0.05") =>
            "\"target_error\" in [indirect] is relative to the true bounce, to which instant-radiosity does not converge",
            "set estimator = \"final-gather\"";
        ("instant-radiosity", "interpolation_error = 0.05") =>
            "\"interpolation_error\" in [indirect] belongs to rsm-average: instant-radiosity is summed at every pixel",
            "remove it";
        ("rsm-average", "error_norm = \"local\"") =>
            "\"error_norm\" in [indirect] belongs to final-gather: rsm-average has no target_error",
            "remove it, or set estimator = \"final-gather\"";
        ("instant-radiosity", "max_ms = 500") =>
            "\"max_ms\" in [indirect] belongs to final-gather: instant-radiosity has no target_error",
            "remove it, or set estimator = \"final-gather\"";
        ("instant-radiosity", "stderr_layer = true") =>
            "\"stderr_layer\" in [indirect] belongs to final-gather: instant-radiosity has no target_error",
            "remove it, or set estimator = \"final-gather\"";
        ("rsm-average", "target_range_error_mm = 5") =>
            "\"target_range_error_mm\" in [indirect] belongs to final-gather: rsm-average has no target_error",
            "remove it, or set estimator = \"final-gather\"";
        ("rsm-average", "max_rays = 500") =>
            "\"max_rays\" in [indirect] belongs to final-gather: rsm-average has no target_error",
            "remove it, or set estimator = \"final-gather\"";
        ("final-gather", "interpolation_error = 0.05") =>
            "\"interpolation_error\" in [indirect] is relative to a sum over VPLs, which final-gather does not compute",
            "use target_error";
    }
}
