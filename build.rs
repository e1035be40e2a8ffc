//! Compiles `shaders/*.wgsl` to SPIR-V for every permutation, and writes what the engine must know of each module
//! (bindings, workgroup size, buffer layouts) as Rust, both from naga's reflection. Neither is written by hand.
//!
//! The result lies in OUT_DIR; the same files are checked in under `spirv/`, for reading, for the drift test, and for
//! builds without naga (`default-features = false`).

use std::{env, fs, path::Path};

#[cfg(feature = "naga")]
#[path = "build/describe.rs"]
mod describe;
#[cfg(feature = "naga")]
#[path = "build/permutations.rs"]
mod permutations;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    let root = env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    let (root, out) = (Path::new(&root), Path::new(&out).join("spirv"));
    // A module that is no longer a permutation must not linger.
    let _ = fs::remove_dir_all(&out);
    fs::create_dir_all(&out).expect("OUT_DIR is writable");

    #[cfg(feature = "naga")]
    {
        println!("cargo::rerun-if-changed=shaders");
        if let Err(message) = compile::all(&root.join("shaders"), &out) {
            panic!("{message}");
        }
    }
    #[cfg(not(feature = "naga"))]
    {
        println!("cargo::rerun-if-changed=spirv");
        for entry in fs::read_dir(root.join("spirv")).expect("spirv/ is part of the package") {
            let path = entry.expect("spirv/ is readable").path();
            fs::copy(
                &path,
                out.join(path.file_name().expect("a file has a name")),
            )
            .expect("OUT_DIR is writable");
        }
    }
    println!("cargo::rustc-env=CAMLUX_SPIRV={}", out.display());
}

#[cfg(feature = "naga")]
mod compile {
    use std::{
        collections::{BTreeMap, BTreeSet},
        fmt::Write as _,
        fs,
        path::Path,
    };

    use naga::{
        AddressSpace, Module, TypeInner,
        back::spv,
        compact::{KeepUnused, compact},
        proc::{BoundsCheckPolicies, BoundsCheckPolicy},
        valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
    };

    use crate::{
        describe::Described,
        permutations::{self, Kernel, Permutation},
    };

    pub fn all(shaders: &Path, out: &Path) -> Result<(), String> {
        let (axes, kernels) = permutations::parse(&read(&shaders.join("permutations.txt"))?)?;
        let permutations: Vec<_> = kernels.iter().flat_map(Kernel::permutations).collect();
        let flags = permutations
            .iter()
            .flat_map(|p| p.flags.iter().chain(&p.switches));
        let vocabulary: BTreeSet<String> = flags.cloned().collect();
        let mut described = Described::default();
        for permutation in permutations {
            let name = permutation.name.clone();
            let text = source_of(&permutation, &vocabulary, shaders)?;
            let (mut module, info, constants) = parse(&unroll(&text)?, &name)?;
            let marked = mark_switches(&mut module, &permutation.switches);
            let mut words = emit(&module, &info).map_err(|error| format!("{name}: {error}"))?;
            if !permutation.switches.is_empty() {
                words =
                    with_switches(&words, &marked).map_err(|error| format!("{name}: {error}"))?;
            }
            let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            write(&out.join(format!("{name}.spv")), &bytes)?;
            described
                .add(&module, &info, permutation, constants)
                .map_err(|error| format!("{name}: {error}"))?;
        }
        for (name, text) in described.files(&axes, &kernels) {
            write(&out.join(name), text.as_bytes())?;
        }
        Ok(())
    }

    fn read(path: &Path) -> Result<String, String> {
        fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
    }

    fn write(path: &Path, bytes: &[u8]) -> Result<(), String> {
        fs::write(path, bytes).map_err(|error| format!("{}: {error}", path.display()))
    }

    /// Copies the lines between `#repeat NAME N` and `#endrepeat` N times, NAME standing for 0 to N − 1: WGSL wants the
    /// lane of a broadcast as a literal. N is a number or a constant of the source.
    fn unroll(source: &str) -> Result<String, String> {
        let mut text = String::new();
        let mut lines = source.lines();
        while let Some(line) = lines.next() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let ["#repeat", name, count] = words.as_slice() else {
                text += line;
                text.push('\n');
                continue;
            };
            let body: Vec<&str> = lines
                .by_ref()
                .take_while(|line| line.trim() != "#endrepeat")
                .collect();
            let constant = format!("const {count}: u32 = ");
            let count = source
                .lines()
                .find_map(|line| line.strip_prefix(&constant)?.strip_suffix("u;"))
                .unwrap_or(count);
            let count: u32 = count.parse().map_err(|_| format!("not a count: {line}"))?;
            for i in 0..count {
                for line in &body {
                    text += &line.replace(name, &i.to_string());
                    text.push('\n');
                }
            }
        }
        Ok(text)
    }

    /// WGSL of a permutation, as naga takes it. Each flag of the permutation file is a bool: a constant, or an override for a switch.
    fn source_of(
        permutation: &Permutation,
        vocabulary: &BTreeSet<String>,
        folder: &Path,
    ) -> Result<String, String> {
        let mut source = Source {
            folder,
            permutation,
            text: String::new(),
            imported: BTreeSet::new(),
        };
        for flag in vocabulary {
            let capitals = flag.to_uppercase();
            let _ = match permutation.switches.contains(flag) {
                true => writeln!(source.text, "override {capitals}: bool = false;"),
                false => {
                    let is_defined = permutation.flags.contains(flag);
                    writeln!(source.text, "const {capitals}: bool = {is_defined};")
                }
            };
        }
        source.import(&permutation.pass)?;
        Ok(source.text)
    }

    /// WGSL as naga takes it.
    struct Source<'p> {
        folder: &'p Path,
        permutation: &'p Permutation,
        imported: BTreeSet<String>,
        text: String,
    }

    impl Source<'_> {
        /// Adds a file, once, after those that it imports: a kernel, or a file of `shared/`. `#if FLAG…` (any of them) / `#else` / `#endif`
        /// choose between declarations. In functions, flags are conditions like others.
        fn import(&mut self, name: &str) -> Result<(), String> {
            if !self.imported.insert(name.into()) {
                return Ok(());
            }
            let kernel = self.folder.join(format!("{name}.wgsl"));
            let shared = self.folder.join(format!("shared/{name}.wgsl"));
            let text = read(if shared.exists() { &shared } else { &kernel })?;
            // Whether the lines after each open `#if` are taken.
            let mut open: Vec<bool> = Vec::new();
            for line in text.lines() {
                let fail = |what: &str| Err(format!("{name}.wgsl: {what}: {line}"));
                let is_taken = !open.contains(&false);
                let words: Vec<&str> = line.split_whitespace().collect();
                match words.as_slice() {
                    ["#if", any @ ..] if !any.is_empty() => {
                        let is_among = |list: &[String]| {
                            any.iter().any(|flag| list.contains(&flag.to_lowercase()))
                        };
                        if is_among(&self.permutation.switches) {
                            return fail("a switch decides nothing outside of functions");
                        }
                        open.push(is_among(&self.permutation.flags));
                    }
                    ["#else"] => match open.last_mut() {
                        Some(taken) => *taken = !*taken,
                        None => return fail("no #if before"),
                    },
                    ["#endif"] => match open.pop() {
                        Some(_) => {}
                        None => return fail("no #if before"),
                    },
                    ["#import", file] if is_taken => self.import(file)?,
                    ["#loader", name, image] if is_taken => {
                        self.text += &loader(&self.text, name, image)?;
                    }
                    ["#import", _] | ["#loader", _, _] => {}
                    // WGSL has them before all else.
                    ["enable", _] if is_taken => self.text.insert_str(0, &format!("{line}\n")),
                    [word, ..]
                        if word.starts_with('#') && !["#repeat", "#endrepeat"].contains(word) =>
                    {
                        return fail("unknown directive");
                    }
                    _ if is_taken => {
                        self.text += line;
                        self.text.push('\n');
                    }
                    _ => {}
                }
            }
            if !open.is_empty() {
                return Err(format!("{name}.wgsl: #if without #endif"));
            }
            Ok(())
        }
    }

    /// Literals from here on stand for the switches in what naga writes.
    const MARK: u32 = 0x5bec_0000;

    /// naga's SPIR-V writer knows no overrides. Each use of a switch becomes a literal that occurs nowhere else.
    fn mark_switches(module: &mut Module, switches: &[String]) -> Vec<u32> {
        let names: BTreeMap<_, _> = module
            .overrides
            .iter()
            .map(|(handle, switch)| (handle, switch.name.clone().unwrap_or_default()))
            .collect();
        let index = |handle| {
            let name = names[&handle].to_lowercase();
            switches
                .iter()
                .position(|switch| *switch == name)
                .unwrap_or_default() as u32
        };
        let functions = module.functions.iter_mut().map(|(_, function)| function);
        let points = module
            .entry_points
            .iter_mut()
            .map(|point| &mut point.function);
        for function in functions.chain(points) {
            for (_, expression) in function.expressions.iter_mut() {
                if let naga::Expression::Override(handle) = *expression {
                    *expression =
                        naga::Expression::Literal(naga::Literal::U32(MARK + index(handle)));
                }
            }
        }
        (0..switches.len() as u32).map(|i| MARK + i).collect()
    }

    /// Replaces the constants that stand for switches by specialisation constants. Their ids are the indices of the switches.
    fn with_switches(words: &[u32], marks: &[u32]) -> Result<Vec<u32>, String> {
        const DECORATE: u32 = 71;
        const SPEC_ID: u32 = 1;
        const TYPE_BOOL: u32 = 20;
        const CONSTANT: u32 = 43;
        const SPEC_CONSTANT_FALSE: u32 = 49;
        const FUNCTION: u32 = 54;
        let (header, mut rest) = words.split_at(5);
        let (mut annotations, mut declarations, mut functions) =
            (Vec::new(), Vec::new(), Vec::new());
        let (mut bool_type, mut found) = (None, Vec::new());
        while let [first, ..] = *rest {
            let (opcode, length) = (first & 0xffff, (first >> 16) as usize);
            let (instruction, after) = rest.split_at(length);
            rest = after;
            match *instruction {
                [_, _, id, value] if opcode == CONSTANT && marks.contains(&value) => {
                    found.push((id, value - MARK));
                    continue;
                }
                [_, id] if opcode == TYPE_BOOL => bool_type = Some(id),
                _ => {}
            }
            let place = if opcode == FUNCTION || !functions.is_empty() {
                &mut functions
            } else if (19..=59).contains(&opcode) || !declarations.is_empty() {
                &mut declarations
            } else {
                &mut annotations
            };
            place.extend_from_slice(instruction);
        }
        for (id, index) in found {
            let bool_type = bool_type.ok_or("a switch, but no type bool")?;
            annotations.extend([4 << 16 | DECORATE, id, SPEC_ID, index]);
            declarations.extend([3 << 16 | SPEC_CONSTANT_FALSE, bool_type, id]);
        }
        let all = [header, &annotations, &declarations, &functions].concat();
        match all.iter().any(|word| marks.contains(word)) {
            true => Err("a switch that is not only a condition".into()),
            false => Ok(all),
        }
    }

    /// A function `load_name` for a struct that lies in texels of an image as it would in a buffer.
    fn loader(source: &str, name: &str, image: &str) -> Result<String, String> {
        let module = front(&unroll(source)?, name)?;
        let mut types = module.types.iter();
        let (ty, _) = types
            .find(|(_, ty)| ty.name.as_deref() == Some(name))
            .ok_or_else(|| format!("no struct {name}"))?;
        let texels = module.types[ty].inner.size(module.to_ctx()) / 16;
        let function = name.to_lowercase();
        let mut text = format!("fn load_{function}(index: u32) -> {name} {{\nvar value: {name};\n");
        for texel in 0..texels {
            let place = format!("list_place({texels}u * index + {texel}u)");
            let _ = writeln!(text, "let texel_{texel} = textureLoad({image}, {place});");
        }
        load_members(&mut text, &module, ty, "value", 0);
        Ok(text + "return value;\n}\n")
    }

    fn load_members(
        text: &mut String,
        module: &Module,
        ty: naga::Handle<naga::Type>,
        path: &str,
        offset: u32,
    ) {
        match &module.types[ty].inner {
            TypeInner::Struct { members, .. } => {
                for member in members {
                    let path = format!("{path}.{}", member.name.as_deref().unwrap_or_default());
                    load_members(text, module, member.ty, &path, offset + member.offset);
                }
            }
            TypeInner::Array { base, size, stride } => {
                let naga::ArraySize::Constant(count) = *size else {
                    return;
                };
                for i in 0..count.get() {
                    let path = format!("{path}[{i}]");
                    load_members(text, module, *base, &path, offset + i * stride);
                }
            }
            inner => {
                let [first, count] =
                    [offset % 16, inner.size(module.to_ctx())].map(|n| n as usize / 4);
                let components = &"xyzw"[first..first + count];
                let is_uint = inner.scalar_kind() == Some(naga::ScalarKind::Uint);
                let cast = if is_uint { "bitcast<u32>" } else { "" };
                let texel = offset / 16;
                let _ = writeln!(text, "{path} = {cast}(texel_{texel}.{components});");
            }
        }
    }

    fn front(source: &str, name: &str) -> Result<Module, String> {
        naga::front::wgsl::parse_str(source)
            .map_err(|error| error.emit_to_string_with_path(source, name))
    }

    /// A module, what naga knows of it, and its named u32 constants.
    type Parsed = (Module, ModuleInfo, Vec<(String, u32)>);

    /// The module without what its flags leave out.
    ///
    /// Resources get their bindings in the order of their declarations, so that the stages of a raster pass, which share what comes
    /// first, agree.
    fn parse(source: &str, name: &str) -> Result<Parsed, String> {
        let mut module = front(source, name)?;
        let mut variables: Vec<_> = module
            .global_variables
            .iter()
            .map(|(handle, _)| handle)
            .collect();
        variables.sort_by_key(|&handle| {
            module
                .global_variables
                .get_span(handle)
                .to_range()
                .map(|span| span.start)
        });
        let mut bindings = 0..;
        for variable in variables {
            let variable = module.global_variables.get_mut(variable);
            if let AddressSpace::Uniform | AddressSpace::Storage { .. } | AddressSpace::Handle =
                variable.space
            {
                variable.binding = bindings
                    .next()
                    .map(|binding| naga::ResourceBinding { group: 0, binding });
            }
        }
        let constants = named_constants(&module);
        decide_words(&mut module);
        compact(&mut module, KeepUnused::No);
        let capabilities = Capabilities::all() & spv::supported_capabilities();
        let info = Validator::new(ValidationFlags::all(), capabilities)
            .validate(&module)
            .map_err(|error| error.emit_to_string_with_path(source, name))?;
        Ok((module, info, constants))
    }

    fn named_constants(module: &Module) -> Vec<(String, u32)> {
        let constants = module.constants.iter();
        let named =
            constants.filter_map(
                |(_, constant)| match module.global_expressions[constant.init] {
                    naga::Expression::Literal(naga::Literal::U32(value)) => {
                        Some((constant.name.clone()?, value))
                    }
                    _ => None,
                },
            );
        named.collect()
    }

    /// Replaces each `if` on constants by its branch. What follows a branch that returns stays, so the other branch belongs in an `else`.
    fn decide_words(module: &mut Module) {
        let (constants, globals) = (&module.constants, &module.global_expressions);
        let functions = module.functions.iter_mut().map(|(_, function)| function);
        let points = module.entry_points.iter_mut();
        for function in functions.chain(points.map(|point| &mut point.function)) {
            let mut body = std::mem::take(&mut function.body);
            decide_block(&mut body, &|condition| {
                let mut known = &function.expressions[condition];
                if let naga::Expression::Constant(constant) = *known {
                    known = &globals[constants[constant].init];
                }
                match *known {
                    naga::Expression::Literal(naga::Literal::Bool(value)) => Some(value),
                    _ => None,
                }
            });
            function.body = body;
            // What has a name counts as needed.
            function.named_expressions.clear();
        }
    }

    fn decide_block(
        block: &mut naga::Block,
        value: &dyn Fn(naga::Handle<naga::Expression>) -> Option<bool>,
    ) {
        use naga::Statement;
        for statement in block.iter_mut() {
            if let Statement::If {
                condition,
                accept,
                reject,
            } = statement
                && let Some(is_true) = value(*condition)
            {
                let taken = std::mem::take(if is_true { accept } else { reject });
                *statement = Statement::Block(taken);
            }
            match statement {
                Statement::Block(inner) => decide_block(inner, value),
                Statement::If { accept, reject, .. } => {
                    decide_block(accept, value);
                    decide_block(reject, value);
                }
                Statement::Loop {
                    body, continuing, ..
                } => {
                    decide_block(body, value);
                    decide_block(continuing, value);
                }
                Statement::Switch { cases, .. } => {
                    for case in cases {
                        decide_block(&mut case.body, value);
                    }
                }
                _ => {}
            }
        }
    }

    /// Bounds checks, loop guards and zeroed workgroup memory cost 2 to 14 % here and guard nothing: every index is
    /// bounded by a count that the host knows. Nor do checks of ray queries, each of which begins before it is asked.
    fn emit(module: &Module, info: &ModuleInfo) -> Result<Vec<u32>, String> {
        let [entry] = module.entry_points.as_slice() else {
            return Err("not one entry point".into());
        };
        let unchecked = BoundsCheckPolicy::Unchecked;
        let options = spv::Options {
            lang_version: (1, 5),
            flags: spv::WriterFlags::LABEL_VARYINGS,
            fake_missing_bindings: true,
            bounds_check_policies: BoundsCheckPolicies {
                index: unchecked,
                buffer: unchecked,
                image_load: unchecked,
                binding_array: unchecked,
            },
            zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
            force_loop_bounding: false,
            emit_int_div_checks: false,
            ray_query_initialization_tracking: false,
            ..Default::default()
        };
        let pipeline = spv::PipelineOptions {
            shader_stage: entry.stage,
            entry_point: entry.name.clone(),
        };
        spv::write_vec(module, info, &options, Some(&pipeline)).map_err(|error| error.to_string())
    }
}
