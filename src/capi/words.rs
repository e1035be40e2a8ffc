//! The library names values as scene files do. This table says what they are in C.

/// What messages of the library contain, and what it is in C. A phrase stands before those that it contains.
const WORDS: [(&str, &str); 36] = [
    // Hints.
    (
        "give the sensor a wavelength_nm and a quantum_efficiency",
        "set wavelength_nm and quantum_efficiency of camlux_sensor",
    ),
    (
        "give the time of flight its noise, which",
        "set noise of camlux_tof, which",
    ),
    (
        "list it in ambient_lights",
        "list it in ambient_lights of camlux_tof",
    ),
    (
        "set shadow to \"rays\", or leave it out",
        "set shadow to CAMLUX_SHADOW_RAYS or CAMLUX_SHADOW_DEFAULT",
    ),
    (
        "choose final gathering",
        "set estimator to CAMLUX_ESTIMATOR_FINAL_GATHER",
    ),
    ("or no limit", "or 0 for no limit"),
    ("coefficients and fx, fy", "coefficients and fx_px, fy_px"),
    ("crop resolution_px", "crop width_px and height_px"),
    (
        "correct the pattern",
        "see camlux_pattern and camlux_projected_image",
    ),
    (
        "set a shorter submission_target",
        "set a shorter submission_target_ms",
    ),
    // Layers.
    (
        "name it in the layers of the render",
        "name it in layers of camlux_render_options",
    ),
    ("give the scene a sensor", "call camlux_scene_set_sensor"),
    (
        "give the sensor noise, and neither bayer nor monochrome",
        "call camlux_scene_set_sensor_noise, and set neither bayer nor monochrome of camlux_sensor",
    ),
    (
        "give the sensor noise, and bayer or monochrome",
        "call camlux_scene_set_sensor_noise, and set bayer or monochrome of camlux_sensor",
    ),
    (
        "give the sensor bayer or monochrome",
        "set bayer or monochrome of camlux_sensor",
    ),
    (
        "set stderr_layer of its indirect light",
        "set stderr_layer of camlux_indirect",
    ),
    ("set samples of its camera", "set samples of camlux_camera"),
    (
        "give the scene time of flight (tof)",
        "call camlux_scene_set_tof",
    ),
    (
        "give the scene indirect light",
        "call camlux_scene_set_indirect",
    ),
    // Problems.
    ("output is \"dn\"", "output is CAMLUX_CHARGE_DN"),
    (
        "rsm-average and instant-radiosity do not",
        "CAMLUX_ESTIMATOR_RSM_AVERAGE and CAMLUX_ESTIMATOR_INSTANT_RADIOSITY do not",
    ),
    ("materials without map_d", "materials without alpha_texture"),
    (
        "the instant-radiosity estimator",
        "CAMLUX_ESTIMATOR_INSTANT_RADIOSITY",
    ),
    ("resolution_px is", "width_px x height_px is"),
    // Of an instance.
    ("position is", "position_m is"),
    (": fx is", ": fx_px is"),
    (": fy is", ": fy_px is"),
    ("cx, cy are", "cx_px, cy_px are"),
    (": skew is", ": skew_px is"),
    ("height_m of the image", "fov_y_deg, in metres,"),
    ("focal lengths fx, fy", "focal lengths fx_px, fy_px"),
    ("the weights of the bands are", "band_weights is"),
    ("the vertical angles", "gammas_deg"),
    ("the horizontal angles", "planes_deg"),
    // Warnings.
    ("that the layer P is", "that CAMLUX_LAYER_POSITION is"),
    (
        "use the layer P_camera, whose",
        "use CAMLUX_LAYER_CAMERA_POSITION, whose",
    ),
];

/// What it says of a scene without lights, and what that means where lights are hidden.
const OF_HIDDEN_LIGHTS: [(&str, &str); 2] = [
    (
        "there is no light; add one",
        "all lights are hidden; show one by camlux_scene_set_visible",
    ),
    (
        "there is no light, so every",
        "all lights are hidden, so every",
    ),
];

/// A message of the library in the words of C.
pub(super) fn in_c(message: &str) -> String {
    replaced(message, &WORDS)
}

/// A message about a scene that has hidden lights.
pub(super) fn of_hidden_lights(message: &str) -> String {
    replaced(message, &OF_HIDDEN_LIGHTS)
}

fn replaced(message: &str, words: &[(&str, &str)]) -> String {
    let replace = |message: String, (word, c): &(&str, &str)| message.replace(word, c);
    words.iter().fold(message.to_owned(), replace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{fs, path::Path};

    fn sources(folder: &Path, found: &mut String) {
        let entries = fs::read_dir(folder).expect("a folder of sources").flatten();
        for path in entries.map(|entry| entry.path()) {
            if path.is_dir() {
                if !path.ends_with("capi") {
                    sources(&path, found);
                }
            } else if path.extension().is_some_and(|end| end == "rs") {
                found.push_str(&fs::read_to_string(path).expect("UTF-8"));
            }
        }
    }

    /// A message that is reworded leaves no dead line in the table.
    #[test]
    fn the_library_still_says_so() {
        let mut text = String::new();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        sources(&folder, &mut text);
        for (word, _) in WORDS.into_iter().chain(OF_HIDDEN_LIGHTS) {
            let written = word.replace('"', "\\\"");
            // What comes before "is" or "are" may be an argument of its own.
            let end = [" is", " are"]
                .iter()
                .find_map(|end| word.strip_suffix(end));
            let argument = end.map(|name| format!("\"{}\"", name.trim_start_matches(": ")));
            let is_said =
                text.contains(&written) || argument.is_some_and(|name| text.contains(&name));
            assert!(is_said, "{word}");
        }
    }
}
