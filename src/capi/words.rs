//! The library names values as scene files do. This table says what they are in C.

/// What messages of the library contain, and what it is in C. A phrase stands before those that it contains.
const WORDS: [(&str, &str); 32] = [
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
