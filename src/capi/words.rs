//! The library names values as scene files do. This table says what they are in C.

/// What messages of the library contain, and what it is in C. A phrase stands before those that it contains.
const WORDS: [(&str, &str); 37] = [
    // Hints.
    (
        "give [sensor] a wavelength_nm and a quantum_efficiency",
        "set wavelength_nm and quantum_efficiency of camlux_sensor",
    ),
    ("add [tof.noise], which", "set noise of camlux_tof, which"),
    (
        "give it modulated = false,",
        "add its index to ambient_lights of camlux_tof,",
    ),
    (
        "set shadow to \"rays\", or leave it out",
        "set shadow to CAMLUX_SHADOW_RAYS or CAMLUX_SHADOW_DEFAULT",
    ),
    (
        "choose the estimator \"final-gather\"",
        "set estimator to CAMLUX_ESTIMATOR_FINAL_GATHER",
    ),
    ("or leave it out for no limit", "or 0 for no limit"),
    ("move look_at to", "move look_at_m to"),
    ("coefficients and fx, fy", "coefficients and fx_px, fy_px"),
    (
        "correct the pattern",
        "see camlux_pattern and camlux_projected_image",
    ),
    (
        "set a shorter submission_target",
        "set a shorter submission_target_ms",
    ),
    // Layers.
    ("add [sensor] to the scene", "call camlux_scene_set_sensor"),
    (
        "add stderr_layer = true to [indirect]",
        "set stderr_layer of camlux_indirect",
    ),
    ("add samples to [camera]", "set samples of camlux_camera"),
    ("add [tof] to the scene", "call camlux_scene_set_tof"),
    (
        "add [indirect] to the scene",
        "call camlux_scene_set_indirect",
    ),
    // Problems.
    ("output is \"dn\"", "output is CAMLUX_CHARGE_DN"),
    (
        "rsm-average and instant-radiosity do not",
        "CAMLUX_ESTIMATOR_RSM_AVERAGE and CAMLUX_ESTIMATOR_INSTANT_RADIOSITY do not",
    ),
    ("cut-outs (map_d)", "cut-outs (alpha_texture)"),
    ("materials without map_d", "materials without alpha_texture"),
    (
        "the instant-radiosity estimator",
        "CAMLUX_ESTIMATOR_INSTANT_RADIOSITY",
    ),
    // Warnings.
    ("that the layer P is", "that CAMLUX_LAYER_POSITION is"),
    (
        "use the layer P_camera, whose place in the world is the header's cameraToWorld",
        "use CAMLUX_LAYER_CAMERA_POSITION and the pose of the camera",
    ),
    (
        "the camera's position and look_at",
        "position_m and look_at_m of the camera",
    ),
    ("phases is", "phase_count is"),
    ("the vertical angles", "gammas_deg"),
    ("the horizontal angles", "planes_deg"),
    ("position and look_at are", "position_m and look_at_m are"),
    ("position is", "position_m is"),
    ("look_at is", "look_at_m is"),
    ("resolution is", "width_px x height_px is"),
    (": fx is", ": fx_px is"),
    (": fy is", ": fy_px is"),
    ("cx, cy are", "cx_px, cy_px are"),
    ("focal lengths fx, fy", "focal lengths fx_px, fy_px"),
    (": size is", ": size_m is"),
    (": radius is", ": radius_m is"),
    ("the weights of the bands are", "band_weights is"),
];

/// A message of the library in the words of C.
pub(super) fn in_c(message: &str) -> String {
    let replace = |message: String, (word, c): &(&str, &str)| message.replace(word, c);
    WORDS.iter().fold(message.to_owned(), replace)
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
        for (word, _) in WORDS {
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
