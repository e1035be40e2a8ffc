//! Generates scene files by grammar: the keys are valid, and most values, too.

use super::mutate::{NUMBERS, Random};

/// A scene file. About one value in `oddity` is odd.
pub fn scene(random: &mut Random, oddity: usize) -> String {
    let mut writer = Writer {
        random,
        oddity,
        text: String::new(),
    };
    writer.camera();
    for _ in 0..writer.random.below(4) {
        writer.light();
    }
    if writer.happens(2) {
        writer.line("[sensor]");
        writer.key("pixel_pitch_um", |w| w.vector(2, "3.45"));
        writer.key("exposure_time_s", |w| w.number("1e-3"));
        writer.key("duty_cycle", |w| w.number("0.5"));
        if writer.happens(2) {
            writer.key("wavelength_nm", |w| w.number("850"));
            writer.key("quantum_efficiency", |w| w.number("0.8"));
        }
    }
    if writer.happens(3) {
        writer.line("[tof]");
        writer.key("frequencies_mhz", |w| w.vector(2, "20"));
        writer.key("phases", |w| w.number("4"));
        writer.key("contrast", |w| w.number("0.75"));
        writer.key("band", |w| w.word(&["R", "G"]));
        writer.key("phase_offset_deg", |w| w.number("5"));
    }
    if writer.happens(2) {
        writer.line("[direct]");
        writer.key("shadow", |w| w.word(&["map", "rays"]));
    }
    if writer.happens(2) {
        writer.indirect();
    }
    if writer.happens(2) {
        writer.line("[material.clay]");
        writer.key("kd", |w| w.bands("0.5"));
        writer.key("ks", |w| w.bands("0.2"));
        writer.key("shininess", |w| w.number("20"));
    }
    for _ in 0..writer.random.below(3) {
        writer.mesh();
    }
    writer.text
}

struct Writer<'a> {
    random: &'a mut Random,
    oddity: usize,
    text: String,
}

impl Writer<'_> {
    fn happens(&mut self, one_in: usize) -> bool {
        self.random.below(one_in) == 0
    }

    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// Writes a key. One in 20 · `oddity` is left out, and one in 20 · `oddity` is written twice.
    fn key(&mut self, key: &str, value: impl Fn(&mut Self) -> String) {
        let count = match self.random.below(20 * self.oddity) {
            0 => 0,
            1 => 2,
            _ => 1,
        };
        for _ in 0..count {
            let value = if self.happens(self.oddity) {
                self.odd()
            } else {
                value(self)
            };
            self.line(&format!("{key} = {value}"));
        }
    }

    /// A value of any type.
    fn odd(&mut self) -> String {
        match self.random.below(9) {
            0 => "true".into(),
            1 => "\"a\\u0007\\nb\"".into(),
            2 => "1979-05-27T07:32:00Z".into(),
            3 => "{ fx = 9, fy = 9, cx = 4, cy = 3 }".into(),
            4 => "[[[[1]]], {a = []}]".into(),
            5 => format!("[{}]", vec!["1"; self.random.below(300)].join(", ")),
            6 => format!("\"{}\"", "x".repeat(self.random.below(3000))),
            _ => (*self.random.pick(&NUMBERS)).into(),
        }
    }

    fn number(&mut self, usual: &str) -> String {
        if self.happens(self.oddity) {
            (*self.random.pick(&NUMBERS)).into()
        } else {
            usual.into()
        }
    }

    fn vector(&mut self, count: usize, usual: &str) -> String {
        let numbers: Vec<String> = (0..count).map(|_| self.number(usual)).collect();
        format!("[{}]", numbers.join(", "))
    }

    /// Three numbers, picked independently, for a position.
    fn place(&mut self) -> String {
        let usual = ["0.5", "-1.25", "2.0", "0", "3"];
        let numbers: Vec<String> = (0..3)
            .map(|_| {
                let usual = *self.random.pick(&usual);
                self.number(usual)
            })
            .collect();
        format!("[{}]", numbers.join(", "))
    }

    fn bands(&mut self, usual: &str) -> String {
        if self.happens(2) {
            self.number(usual)
        } else {
            self.vector(3, usual)
        }
    }

    fn word(&mut self, words: &[&str]) -> String {
        format!("\"{}\"", self.random.pick(words))
    }

    fn camera(&mut self) {
        self.line("[camera]");
        self.key("resolution", |w| w.vector(2, "8"));
        self.key("position", Self::place);
        self.key("look_at", Self::place);
        self.key("up", |w| w.word(&["x"]).replace("\"x\"", "[0.1, 1, 0.3]"));
        if self.happens(2) {
            self.key("fov_y_deg", |w| w.number("50"));
        } else {
            self.key("intrinsics_px", |w| {
                let [fx, fy, cx, cy] = ["900", "9", "4", "3"].map(|usual| w.number(usual));
                format!("{{ fx = {fx}, fy = {fy}, cx = {cx}, cy = {cy} }}")
            });
        }
    }

    fn light(&mut self) {
        self.line("[[light]]");
        let kind = self.random.below(3);
        self.line(
            [
                "kind = \"point\"",
                "kind = \"spot\"",
                "kind = \"directional\"",
            ][kind],
        );
        if kind < 2 {
            self.key("position", Self::place);
            self.key("power_w", |w| w.bands("50"));
        }
        if kind == 1 {
            self.key("inner_half_angle_deg", |w| w.number("20"));
            self.key("outer_half_angle_deg", |w| w.number("30"));
        }
        if kind > 0 {
            self.key("direction", |w| w.vector(3, "1"));
        }
        if kind == 2 {
            self.key("irradiance_w_m2", |w| w.bands("1000"));
        }
    }

    fn indirect(&mut self) {
        self.line("[indirect]");
        self.key("estimator", |w| {
            w.word(&["final-gather", "rsm-average", "instant-radiosity"])
        });
        if self.happens(2) {
            self.key("rsm_size", |w| w.number("64"));
        }
        if self.happens(2) {
            let key = ["target_error", "interpolation_error"][usize::from(self.happens(2))];
            self.key(key, |w| w.number("0.05"));
        }
        if self.happens(4) {
            self.key("error_norm", |w| w.word(&["image", "local"]));
        }
        if self.happens(4) {
            self.key("stderr_layer", |w| {
                w.word(&["true", "false"]).replace('"', "")
            });
        }
        for (key, usual) in [
            ("max_ms", "250"),
            ("max_rays", "100000"),
            ("target_range_error_mm", "5"),
        ] {
            if self.happens(4) {
                self.key(key, |w| w.number(usual));
            }
        }
    }

    fn mesh(&mut self) {
        self.line("[[mesh]]");
        self.key("path", |_| "\"mesh.obj\"".into());
        for (key, usual) in [("rotate_deg", "90"), ("translate", "1")] {
            if self.happens(2) {
                self.key(key, |w| w.vector(3, usual));
            }
        }
        if self.happens(2) {
            self.key("scale", |w| w.number("2"));
        }
        if self.happens(3) {
            self.key("flat", |w| w.word(&["true", "false"]).replace('"', ""));
        }
        if self.happens(3) {
            self.key("material", |w| w.word(&["clay", "cla"]));
        }
    }
}
