//! The C header, the layouts that C checks, and the record of the interface agree with the source.

use std::{fmt::Write, fs, path::Path, sync::LazyLock};

use crate::layers::assert_constants_are_checked_in;
use crate::layouts::{Layout, layouts};

const UPDATE: &str =
    "run `UPDATE_HEADER=1 cargo test --test generated` and check in what it writes";

/// The sections of the header, in the order in which a reader needs them, and the files of `src/capi` that each declares.
const SECTIONS: [(&str, &[&str]); 11] = [
    ("Status and messages", &["status", "log"]),
    ("Handles", &["handle"]),
    ("Devices", &["device"]),
    (
        "Scenes: camera, sensor, how light is computed",
        &["scene", "camera", "indirect"],
    ),
    ("Time of flight", &["tof"]),
    ("Textures and materials", &["texture", "material"]),
    (
        "Meshes, poses, instances",
        &["args", "mesh", "poses", "instances"],
    ),
    ("Lights", &["pattern", "light"]),
    (
        "Renderers and jobs",
        &["target", "render_options", "renderer", "job"],
    ),
    ("Frames", &["layers", "frame", "frame_stats"]),
    (
        "Frames on the device: the host's own Vulkan, shared memory",
        &["vulkan", "shared_memory"],
    ),
];
const FIRST_VALUES: &str = "First values of the structs";

fn path(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

pub fn read(name: &str) -> String {
    fs::read_to_string(path(name)).unwrap_or_default()
}

pub fn assert_checked_in(name: &str, made: &str) {
    if std::env::var_os("UPDATE_HEADER").is_some() {
        fs::write(path(name), made).expect("the checkout is writable");
    }
    assert!(
        read(name) == made,
        "{name} differs from the source; {UPDATE}"
    );
}

fn header() -> &'static str {
    static HEADER: LazyLock<String> = LazyLock::new(|| {
        assert_constants_are_checked_in();
        write_header()
    });
    &HEADER
}

fn write_header() -> String {
    let mut header = read("src/capi/manual.h").trim_end().to_owned();
    let titles = SECTIONS.iter().map(|(title, _)| *title);
    let titles: Vec<&str> = titles.chain([FIRST_VALUES]).collect();
    let mut contents = String::new();
    for (i, title) in titles.iter().enumerate() {
        let _ = writeln!(contents, " *   {:2}  {title}", i + 1);
    }
    header = header.replace(" *   (the sections)\n", &contents);
    header += "\n\n#ifndef CAMLUX_H\n#define CAMLUX_H\n\n#include <stddef.h>\n#include <stdint.h>\n\n\
               #ifdef __cplusplus\nextern \"C\" {\n#endif\n";
    for (i, (title, sources)) in SECTIONS.iter().enumerate() {
        header += &section_title(i + 1, title);
        header += &for_c(&declarations(sources));
    }
    header += &section_title(titles.len(), FIRST_VALUES);
    header += &init_macros(&layouts());
    header + "\n#ifdef __cplusplus\n}\n#endif\n\n#endif  /* CAMLUX_H */\n"
}

fn section_title(number: usize, title: &str) -> String {
    let line = "-".repeat(118);
    format!("\n\n/* {line}\n * {number}. {title}\n * {line} */\n\n")
}

/// The declarations of files of `src/capi`.
fn declarations(sources: &[&str]) -> String {
    let mut config = cbindgen::Config {
        language: cbindgen::Language::C,
        no_includes: true,
        usize_is_size_t: true,
        documentation_style: cbindgen::DocumentationStyle::Doxy,
        style: cbindgen::Style::Both,
        line_length: 120,
        ..cbindgen::Config::default()
    };
    config.function.sort_by = Some(cbindgen::SortKey::None);
    config.constant.sort_by = Some(cbindgen::SortKey::None);
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in sources {
        builder = builder.with_src(path(&format!("src/capi/{source}.rs")));
    }
    let bindings = builder.generate().expect("cbindgen reads the source");
    let mut declarations = Vec::new();
    bindings.write(&mut declarations);
    String::from_utf8(declarations).expect("cbindgen writes UTF-8")
}

/// Tidies the output of cbindgen: short comments on one line, negative numbers in brackets, and the same form of struct names in every section.
fn for_c(header: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for line in header.lines() {
        let last_two = lines.iter().rev().take(2).map(|line| line.trim());
        let is_short = last_two.eq(lines
            .last()
            .map(|line| line.trim())
            .into_iter()
            .chain(["/**"]));
        if line.trim() == "*/" && is_short {
            let text = lines.pop().expect("there are two");
            let text = text.trim().trim_start_matches("* ").to_owned();
            let begin = lines.pop().expect("there are two");
            lines.push(format!("{begin} {text} */"));
        } else if let Some((name, number)) = line
            .split_once(" -")
            .filter(|_| line.starts_with("#define"))
        {
            lines.push(format!("{name} (-{number})"));
        } else if let Some(name) = line.strip_suffix(" 4294967295") {
            lines.push(format!("{name} UINT32_C(0xffffffff)"));
        } else if line.starts_with("typedef struct") {
            lines.push(line.to_owned());
        } else {
            lines.push(line.replace("struct camlux_", "camlux_"));
        }
    }
    lines.join("\n") + "\n"
}

/// The `_INIT` macros, with the initial values of Rust.
fn init_macros(layouts: &[Layout]) -> String {
    let mut text = String::from("/* As in: camlux_camera camera = CAMLUX_CAMERA_INIT; */\n");
    let mark = camlux::capi::CAMLUX_INITIALISED;
    let _ = write!(
        text,
        "\n/** What struct_size has beside the size of the struct: all members have a value. */\n\
         #define CAMLUX_INITIALISED UINT32_C({mark:#x})\n"
    );
    for Layout { name, fields, .. } in with_init(layouts) {
        let macro_name = init_macro(name);
        let _ = write!(
            text,
            "\n#define {macro_name} {{ CAMLUX_INITIALISED + sizeof({name})"
        );
        for field in &fields[1..] {
            let _ = write!(text, ", {}", field.first);
        }
        text.push_str(" }\n");
    }
    text
}

fn with_init(layouts: &[Layout]) -> impl Iterator<Item = &Layout> {
    layouts.iter().filter(|layout| !layout.init.is_empty())
}

fn init_macro(struct_name: &str) -> String {
    format!("{}_INIT", struct_name.to_uppercase())
}

#[test]
fn the_header_is_that_of_the_source() {
    assert_checked_in("include/camlux.h", header());
}

/// C code that fails to compile, as C99 and as C++, if a layout differs.
fn layout_checks(layouts: &[Layout], header: &str) -> String {
    let mut text = String::from(
        "/* Generated by tests/generated/header.rs: sizes and offsets as Rust has them. */\n\
         #define CHECK(name, is_so) typedef char check_##name[(is_so) ? 1 : -1]\n",
    );
    for Layout {
        name,
        bytes,
        fields,
        ..
    } in layouts
    {
        let _ = writeln!(text, "\nCHECK(size_of_{name}, sizeof({name}) == {bytes});");
        for field in fields {
            let (member, offset, bytes) = (field.name, field.offset, field.bytes);
            let _ = writeln!(
                text,
                "CHECK({name}_{member}_offset, offsetof({name}, {member}) == {offset});\n\
                 CHECK({name}_{member}_size, sizeof((({name} *)0)->{member}) == {bytes});"
            );
        }
    }
    // What the `_INIT` macros set, byte by byte.
    text.push_str("\nstruct init { const char *name; size_t bytes; const unsigned char *of_rust; const void *of_c; };\n");
    for Layout { name, init, .. } in with_init(layouts) {
        let macro_name = init_macro(name);
        let bytes: Vec<String> = init.iter().map(u8::to_string).collect();
        let _ = writeln!(
            text,
            "static const {name} init_of_{name} = {macro_name};\n\
             static const unsigned char rust_{name}[] = {{{}}};",
            bytes.join(",")
        );
    }
    text.push_str("static const struct init inits[] = {\n");
    for Layout { name, bytes, .. } in with_init(layouts) {
        let _ = writeln!(
            text,
            "    {{\"{name}\", {bytes}, rust_{name}, &init_of_{name}}},"
        );
    }
    text.push_str("};\n\nstatic const camlux_status statuses[] = {");
    let is_status = |name: &&str| {
        ["CAMLUX_OK", "CAMLUX_CANCELLED"].contains(name) || name.starts_with("CAMLUX_ERROR_")
    };
    for name in header.lines().filter_map(constant_name).filter(is_status) {
        let _ = write!(text, "{name}, ");
    }
    text.push_str("};\n");
    text
}

#[test]
fn c_checks_the_layouts_of_rust() {
    assert_checked_in("tests/c/layout.h", &layout_checks(&layouts(), header()));
}

fn constant_name(line: &str) -> Option<&str> {
    line.strip_prefix("#define ")?.split(' ').next()
}

/// Functions as the header declares them, one a line.
fn functions(header: &str) -> Vec<String> {
    let mut functions = Vec::new();
    let mut lines = header.lines();
    while let Some(line) = lines.next() {
        let is_function = !line.starts_with([' ', '#', '/', '*'])
            && line.contains("camlux_")
            && line.contains('(')
            && !line.starts_with("typedef");
        if !is_function {
            continue;
        }
        let mut declaration = line.to_owned();
        while !declaration.ends_with(';') {
            let next = lines.next().expect("a declaration ends");
            declaration.push(' ');
            declaration.push_str(next.trim());
        }
        functions.push(declaration);
    }
    functions
}

/// The interface in a form that shows in a diff what breaks old programs.
fn record(header: &str, layouts: &[Layout]) -> String {
    let mut text =
        String::from("# Generated by tests/generated/header.rs: the binary interface.\n");
    let mut declared = functions(header);
    declared.sort();
    for function in declared {
        let _ = writeln!(text, "{function}");
    }
    let constants = header.lines().filter(|line| {
        let is_plain = !line.contains('{') && *line != "#define CAMLUX_H";
        line.starts_with("#define CAMLUX_") && is_plain
    });
    for constant in constants {
        let _ = writeln!(text, "{constant}");
    }
    for layout in layouts {
        let Layout {
            name,
            bytes,
            version_1_bytes,
            fields,
            ..
        } = layout;
        let _ = writeln!(
            text,
            "struct {name} {bytes} bytes, {version_1_bytes} in version 1"
        );
        for field in fields {
            let (member, offset, bytes) = (field.name, field.offset, field.bytes);
            let _ = writeln!(text, "  {offset} {member} {bytes}");
        }
    }
    text
}

#[test]
fn the_record_of_the_interface_is_that_of_the_source() {
    assert_checked_in("tests/c/abi.txt", &record(header(), &layouts()));
}

#[test]
fn structs_have_no_padding_and_begin_with_their_size() {
    for layout in layouts() {
        let mut end = 0;
        for field in &layout.fields {
            assert_eq!(field.offset, end, "{}.{}", layout.name, field.name);
            end += field.bytes;
        }
        assert_eq!(end, layout.bytes, "{}", layout.name);
        if layout.version_1_bytes > 0 {
            assert_eq!(layout.fields[0].name, "struct_size", "{}", layout.name);
            assert!(layout.version_1_bytes <= layout.bytes, "{}", layout.name);
        }
    }
    // `layouts` has every struct of the header.
    let sized = header().matches("  uint32_t struct_size;").count();
    assert_eq!(sized + 1, layouts().len());
}

#[test]
fn the_version_is_that_of_the_crate() {
    use camlux::capi::{
        CAMLUX_VERSION_MAJOR, CAMLUX_VERSION_MINOR, CAMLUX_VERSION_PATCH, camlux_version,
    };
    let [major, minor, patch] = [
        CAMLUX_VERSION_MAJOR,
        CAMLUX_VERSION_MINOR,
        CAMLUX_VERSION_PATCH,
    ];
    assert_eq!(
        env!("CARGO_PKG_VERSION"),
        format!("{major}.{minor}.{patch}")
    );
    assert_eq!(camlux_version(), (major * 1000 + minor) * 1000 + patch);
}

/// Every function of the header documents which threads may call it, and its errors.
#[test]
fn every_function_is_documented() {
    let header = header();
    let lines: Vec<&str> = header.lines().collect();
    for function in functions(header) {
        let name = function.split('(').next().unwrap_or_default();
        let name = name.rsplit([' ', '*']).next().unwrap_or_default();
        let begin = function.split_inclusive('(').next().unwrap_or_default();
        let at = lines.iter().position(|line| line.starts_with(begin));
        let before = lines[..at.expect("it was found there")].iter().rev();
        let comment: String = before
            .take_while(|line| !line.trim().is_empty())
            .copied()
            .collect();
        assert!(comment.contains("\\threads"), "{name}: {comment}");
        let has_status = function.starts_with("camlux_status");
        assert!(!has_status || comment.contains("\\errors"), "{name}");
    }
}
