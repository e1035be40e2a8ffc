//! The maps of MTL materials: options, then a path.

use std::path::{Path, PathBuf};

use crate::Result;
use crate::import::lines::{Line, named_file};
use crate::import::unused::Unused;
use crate::keys::did_you_mean;
use crate::scene::{TextureLookup, Wrap};

/// A texture file that a material names, and how it is used.
#[derive(Debug, Clone)]
pub(super) struct Map {
    pub file: PathBuf,
    /// The line that names it.
    pub named_at: String,
    /// The factor for slopes.
    pub strength: f64,
    /// Whether grey values are heights.
    pub may_be_heights: bool,
    /// How its texture is looked up.
    transform: [[f64; 3]; 2],
    wrap: [Wrap; 2],
}

/// The options of the format: name, the numbers of their values, and the default.
pub(super) const OPTIONS: [(&str, usize, usize, &str); 14] = [
    ("-s", 1, 3, "1"),
    ("-o", 1, 3, "0"),
    ("-clamp", 1, 1, "off"),
    ("-bm", 1, 1, "1"),
    ("-t", 1, 3, "0"),
    ("-blendu", 1, 1, "on"),
    ("-blendv", 1, 1, "on"),
    ("-mm", 1, 2, "0 1"),
    ("-imfchan", 1, 1, ""),
    ("-texres", 1, 1, ""),
    ("-boost", 1, 1, ""),
    ("-cc", 1, 1, "off"),
    ("-type", 1, 1, ""),
    ("-colorspace", 1, 1, "sRGB"),
];

/// No system has longer paths. A longer text is not looked up for each of its options.
const MOST_PATH_BYTES: usize = 1 << 15;

impl Map {
    /// Reads the options and the path of a map.
    pub fn read(key: &str, line: &Line, folder: &Path, unused: &mut Unused) -> Result<Map> {
        let is_of_normals = matches!(key, "norm" | "map_Bump" | "bump");
        let mut rest = line.rest();
        let (mut scale, mut offset) = ([1.0; 2], [0.0; 2]);
        let mut strength = 1.0;
        let mut wrap = Wrap::Repeat;
        let is_path =
            |text: &str| text.len() <= MOST_PATH_BYTES && named_file(folder, text).exists();
        while rest.starts_with('-') && !is_path(rest) {
            let (name, values) = first_word(rest);
            let Some(&(known, least, most, default)) = OPTIONS
                .iter()
                .find(|(known, ..)| known.eq_ignore_ascii_case(name))
            else {
                let names = OPTIONS.map(|(name, ..)| name);
                let problem = format!("has the unknown option \"{name}\"");
                return Err(line.error(problem, did_you_mean(name, &names)));
            };
            let (words, after) = values_of(values, known, least, most);
            rest = after;
            let wrong = |expected: &str| {
                let problem = format!("has a {known} that is not {expected}");
                let hint = format!("write the values of {known} and then the path of the image");
                line.error(problem, hint)
            };
            if words.len() < least {
                return Err(wrong("followed by its value"));
            }
            let numbers = || {
                let number = |word: &&str| word.parse().ok().filter(|n: &f64| n.abs() <= 1e6);
                words.iter().map(number).collect::<Option<Vec<f64>>>()
            };
            match known {
                "-s" | "-o" => {
                    let numbers = numbers().ok_or_else(|| wrong("numbers up to a million"))?;
                    let of_both = if known == "-s" {
                        &mut scale
                    } else {
                        &mut offset
                    };
                    // The third number is for textures of three dimensions.
                    of_both.iter_mut().zip(numbers).for_each(|(to, n)| *to = n);
                }
                "-bm" if is_of_normals => {
                    let is_valid = |numbers: &Vec<f64>| numbers[0].abs() <= 1e3;
                    let numbers = numbers().filter(is_valid);
                    strength = numbers.ok_or_else(|| wrong("a number from -1000 to 1000"))?[0];
                }
                "-clamp" => match words[0].to_ascii_lowercase().as_str() {
                    "on" => wrap = Wrap::Clamp,
                    "off" => wrap = Wrap::Repeat,
                    _ => return Err(wrong("on or off")),
                },
                _ if is_default(&words, default) => {}
                _ => unused.add(&format!("\"{known}\" of \"{key}\"")),
            }
        }
        Ok(Map {
            file: image_file(rest, line, folder)?,
            named_at: line.at(),
            strength,
            may_be_heights: key != "norm",
            transform: [[scale[0], 0.0, offset[0]], [0.0, scale[1], offset[1]]],
            wrap: [wrap; 2],
        })
    }

    /// Looks the texture of this index up as the options say.
    pub fn lookup(&self, texture: usize) -> TextureLookup {
        TextureLookup {
            transform: self.transform,
            wrap: self.wrap,
            ..texture.into()
        }
    }
}

/// The values of an option, and what follows. A number that may be a value is one, unless no path would be left.
fn values_of<'t>(
    text: &'t str,
    option: &str,
    least: usize,
    most: usize,
) -> (Vec<&'t str>, &'t str) {
    let mut words = Vec::new();
    let mut rest = text;
    while words.len() < most && !rest.is_empty() {
        let (word, after) = first_word(rest);
        let is_value = words.len() < least || word.parse::<f64>().is_ok();
        if !is_value || (words.len() >= least && after.is_empty()) {
            break;
        }
        // An option cannot be the value of another one, but a negative number can.
        let is_option = OPTIONS.iter().any(|(name, ..)| *name == word);
        if is_option && option != word {
            break;
        }
        words.push(word);
        rest = after;
    }
    (words, rest)
}

fn first_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

fn is_default(words: &[&str], default: &str) -> bool {
    let mut defaults = default.split(' ').cycle();
    !default.is_empty()
        && words.iter().all(|word| {
            let default = defaults.next().unwrap_or_default();
            match default.parse::<f64>() {
                Ok(number) => word.parse() == Ok(number),
                Err(_) => word.eq_ignore_ascii_case(default),
            }
        })
}

/// The file that a path names. It may contain blanks, and a comment may follow it.
fn image_file(path: &str, line: &Line, folder: &Path) -> Result<PathBuf> {
    let file = |path: &str| named_file(folder, path);
    if path.is_empty() || path.starts_with('#') {
        return Err(line.error("names no file", "write the path of an image after it"));
    }
    let whole = file(path);
    let comment = path.find(" #").or_else(|| path.find("\t#"));
    Ok(match comment {
        Some(end) if !whole.exists() => file(path[..end].trim_end()),
        _ => whole,
    })
}
