//! Reads `shaders/permutations.txt`: kernels, their axes, and the modules for all combinations.

use std::slice::from_ref;

/// A choice among lists of flags.
#[derive(Clone)]
pub struct Axis {
    pub name: String,
    pub choices: Vec<Vec<String>>,
    /// In Rust a declared axis is an enum, and one that is on or off a `bool`.
    pub is_declared: bool,
}

/// A line of the file. There is a module for each combination of `axes`.
pub struct Kernel {
    pub pass: String,
    own_flags: Vec<String>,
    pub axes: Vec<Axis>,
    /// The axes in brackets, decided when a pipeline is made.
    pub switches: Vec<Axis>,
}

/// One module.
pub struct Permutation {
    pub name: String,
    pub pass: String,
    /// The keys that it serves, as a pattern in Rust.
    pub keys: String,
    /// Flags for which it is compiled.
    pub flags: Vec<String>,
    /// Flags that are decided when a pipeline is made.
    pub switches: Vec<String>,
}

/// The declared axes, and the kernels.
pub fn parse(text: &str) -> Result<(Vec<Axis>, Vec<Kernel>), String> {
    let (mut declared, mut kernels): (Vec<Axis>, Vec<Kernel>) = Default::default();
    for line in text.lines() {
        let code = line.split('#').next().unwrap_or_default();
        let mut parts = code.split_whitespace();
        let Some(first) = parts.next() else { continue };
        if let Some(name) = first.strip_suffix(':') {
            declared.push(Axis::new(name, parts.next().unwrap_or_default(), true));
            continue;
        }
        let mut kernel = Kernel {
            pass: first.into(),
            own_flags: Vec::new(),
            axes: Vec::new(),
            switches: Vec::new(),
        };
        for part in parts {
            let bracketed = part.strip_prefix('[').and_then(|p| p.strip_suffix(']'));
            let part = bracketed.unwrap_or(part);
            let on_or_off = part.strip_prefix("-|").filter(|flag| !flag.contains('|'));
            let axis = match (declared.iter().find(|axis| axis.name == part), on_or_off) {
                (Some(axis), _) => axis.clone(),
                (None, Some(flag)) => Axis::new(flag, part, false),
                _ if bracketed.is_none() && !part.contains('|') => {
                    kernel.own_flags.push(part.into());
                    continue;
                }
                _ => return Err(format!("permutations.txt: {part} is not declared: {line}")),
            };
            match bracketed {
                Some(_) => kernel.switches.push(axis),
                None => kernel.axes.push(axis),
            }
        }
        kernels.push(kernel);
    }
    Ok((declared, kernels))
}

/// The name of a type or a variant in Rust.
pub fn camel(names: &[String]) -> String {
    let parts = names.iter().flat_map(|name| name.split('_'));
    parts
        .map(|part| part[..1].to_uppercase() + &part[1..])
        .collect()
}

impl Axis {
    fn new(name: &str, choices: &str, is_declared: bool) -> Axis {
        let flags = |choice: &str| match choice {
            "-" => Vec::new(),
            some => some.split('+').map(String::from).collect(),
        };
        Axis {
            name: name.into(),
            choices: choices.split('|').map(flags).collect(),
            is_declared,
        }
    }

    pub fn type_name(&self) -> String {
        camel(from_ref(&self.name))
    }

    fn is_optional(&self) -> bool {
        self.choices.iter().any(Vec::is_empty)
    }

    /// The field of a key.
    pub fn field(&self) -> String {
        let Axis { name, .. } = self;
        let of = self.type_name();
        match (self.is_declared, self.is_optional()) {
            (false, _) => format!("{name}: bool"),
            (true, false) => format!("{name}: {of}"),
            (true, true) => format!("{name}: Option<{of}>"),
        }
    }

    /// A value of that field.
    fn value(&self, choice: &[String]) -> String {
        let Axis { name, .. } = self;
        let value = || format!("{}::{}", self.type_name(), camel(choice));
        match (self.is_declared, choice.is_empty(), self.is_optional()) {
            (false, is_off, _) => format!("{name}: {}", !is_off),
            (true, true, _) => format!("{name}: None"),
            (true, false, true) => format!("{name}: Some({})", value()),
            (true, false, false) => format!("{name}: {}", value()),
        }
    }
}

impl Kernel {
    /// The variant of `Key`.
    pub fn key(&self) -> String {
        camel(&[from_ref(&self.pass), &self.own_flags[..]].concat())
    }

    pub fn permutations(&self) -> Vec<Permutation> {
        let mut switches = Vec::new();
        for flag in self.switches.iter().flat_map(|axis| axis.choices.concat()) {
            if !switches.contains(&flag) {
                switches.push(flag);
            }
        }
        // Flags, and values of fields.
        let mut combinations = vec![(self.own_flags.clone(), String::new())];
        for axis in &self.axes {
            let with = |(flags, values): (Vec<String>, String)| {
                let with = move |choice: &Vec<String>| {
                    let flags = [&flags[..], choice].concat();
                    (flags, format!("{values}{}, ", axis.value(choice)))
                };
                axis.choices.iter().map(with)
            };
            combinations = combinations.into_iter().flat_map(with).collect();
        }
        let permutation = |(flags, values): (Vec<String>, String)| Permutation {
            name: [from_ref(&self.pass), &flags[..]].concat().join("_"),
            pass: self.pass.clone(),
            keys: format!("Key::{} {{ {values}.. }}", self.key()),
            flags,
            switches: switches.clone(),
        };
        combinations.into_iter().map(permutation).collect()
    }
}
