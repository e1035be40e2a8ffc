//! Text of a scene file.

use crate::scene::{Intrinsics, Lens, Parameter, ParameterValue, TextureLookup};

/// Lines of TOML. Numbers have all digits of an f64.
pub(super) struct Toml(String);

impl Default for Toml {
    fn default() -> Self {
        Toml("version = 1\n".into())
    }
}

impl Toml {
    pub fn text(&self) -> &str {
        &self.0
    }

    fn line(&mut self, key: &str, value: &str) {
        self.0 += &format!("{key} = {value}\n");
    }

    /// `head`: with its brackets.
    pub fn table(&mut self, head: &str) {
        self.0 += &format!("\n{head}\n");
    }

    /// The table `[kind."name"]`.
    pub fn table_of(&mut self, kind: &str, name: &str) {
        self.table(&format!("[{kind}.{}]", quoted(name)));
    }

    pub fn number(&mut self, key: &str, value: f64) {
        self.line(key, &format!("{value:?}"));
    }

    pub fn numbers(&mut self, key: &str, values: &[f64]) {
        self.line(key, &format!("{values:?}"));
    }

    pub fn count(&mut self, key: &str, value: u64) {
        self.line(key, &value.to_string());
    }

    pub fn count_list(&mut self, key: &str, values: &[u32]) {
        self.line(key, &format!("{values:?}"));
    }

    pub fn flag(&mut self, key: &str, value: bool) {
        self.line(key, &value.to_string());
    }

    pub fn string(&mut self, key: &str, text: &str) {
        self.line(key, &quoted(text));
    }

    pub fn strings<'t>(&mut self, key: &str, texts: impl Iterator<Item = &'t str>) {
        let texts: Vec<String> = texts.map(quoted).collect();
        self.line(key, &format!("[{}]", texts.join(", ")));
    }

    /// An inline table of numbers.
    pub fn named(&mut self, key: &str, names: &[&str], values: &[f64]) {
        let pairs = names.iter().zip(values);
        let pairs: Vec<String> = pairs.map(|(name, v)| format!("{name} = {v:?}")).collect();
        self.line(key, &format!("{{ {} }}", pairs.join(", ")));
    }

    /// Those that have a value.
    pub fn parameters<'p>(
        &mut self,
        values: impl IntoIterator<Item = (&'p Parameter, Option<ParameterValue>)>,
    ) {
        for (Parameter { name, .. }, value) in values {
            match value {
                None => {}
                Some(ParameterValue::Number(number)) => self.number(name, number),
                Some(ParameterValue::Name(text)) => self.string(name, text),
                Some(value) => self.line(name, &value.to_string()),
            }
        }
    }

    pub fn lens(&mut self, lens: &Lens) {
        match lens {
            Lens::FovY { fov_y_deg } => self.number("fov_y_deg", *fov_y_deg),
            Lens::FovX { fov_x_deg } => self.number("fov_x_deg", *fov_x_deg),
            Lens::Equirectangular => self.string("projection", "equirectangular"),
            Lens::Orthographic { height_m } => {
                self.string("projection", "orthographic");
                self.number("height_m", *height_m);
            }
            Lens::Intrinsics(intrinsics) | Lens::Distorted { intrinsics, .. } => {
                self.intrinsics(intrinsics);
            }
        }
    }

    pub fn intrinsics(&mut self, intrinsics: &Intrinsics) {
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        } = *intrinsics;
        let values = [fx, fy, cx, cy, skew];
        // Most lenses have no skew.
        let count = if skew == 0.0 { 4 } else { 5 };
        self.named(
            "intrinsics_px",
            &["fx", "fy", "cx", "cy", "skew"],
            &values[..count],
        );
    }

    pub fn lookup(&mut self, key: &str, lookup: &TextureLookup) {
        let TextureLookup {
            texture,
            texcoord_set,
            transform,
            wrap: [along_u, along_v],
            filter,
        } = lookup;
        self.line(
            key,
            &format!(
                "{{ texture = {texture}, texcoord_set = {texcoord_set}, transform = {transform:?}, wrap = [\"{}\", \"{}\"], filter = \"{}\" }}",
                along_u.name(),
                along_v.name(),
                filter.name()
            ),
        );
    }
}

/// A string of TOML, which has the escapes of JSON, and refuses one more character as it is.
fn quoted(text: &str) -> String {
    let json = serde_json::Value::from(text).to_string();
    json.replace('\u{7f}', "\\u007f")
}
