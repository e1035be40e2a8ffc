//! The Python classes and the tables of docs/scene.md that come from the rows of parameters are up to date.

use std::{collections::BTreeSet, fmt::Write};

use camlux::scene::{
    IndirectLight, Light, Limits, MetallicRoughness, Parameter, ParameterKind, ParameterValue,
    Parameters, Profile, Sensor, SensorNoise,
};

use crate::{header::read, layers::assert_part_is_checked_in, names::read_python_classes};

/// The limits in words: "0.002 to 0.5". Those that only rule out 0 or what overflows are left out.
fn limits(parameter: &Parameter) -> Option<String> {
    let Limits {
        least,
        most,
        is_above,
        ..
    } = parameter.limits?;
    let most_text = if most < 1e5 {
        most.to_string()
    } else {
        format!("{most:e}")
    };
    (most < 1e9).then(|| match is_above {
        true => format!("above {least}, up to {most_text}"),
        false => format!("{least} to {most_text}"),
    })
}

/// What the parameter is, as it stands after its name.
fn meaning(parameter: &Parameter) -> String {
    let text = parameter.meaning.trim();
    let mut letters = text.chars();
    let [first, second] = [letters.next(), letters.next()].map(Option::unwrap_or_default);
    match second.is_lowercase() {
        true => text.replacen(first, &first.to_lowercase().to_string(), 1),
        false => text.to_owned(),
    }
}

/// Lines of a docstring, at most as long as the lines of the package.
fn wrapped(text: &str, rest_indent: &str) -> String {
    const LONGEST: usize = 136;
    let mut lines = vec!["   ".to_owned()];
    for word in text.split_whitespace() {
        let length = lines[lines.len() - 1].chars().count();
        if length + 1 + word.chars().count() > LONGEST {
            lines.push(rest_indent.to_owned());
        }
        let last = lines.len() - 1;
        write!(lines[last], " {word}").expect("a string takes it");
    }
    lines.join("\n")
}

/// A class with these parameters. The fields before and after them are given as lines of its docstring and of its code.
fn python_class(
    name: &str,
    defaults: &dyn Parameters,
    [first_text, first]: [&str; 2],
    [last_text, last]: [&str; 2],
) -> String {
    let mut class = format!(
        "\n\n@dataclass(slots=True, eq=False)\nclass {name}(Fields):\n    \"\"\"{}\n\n{first_text}",
        defaults.about().trim()
    );
    let mut fields = first.to_owned();
    for (parameter, value) in defaults.named_values() {
        let name = parameter.name;
        let limits = limits(parameter).map(|limits| format!(" Limits: {limits}."));
        let text = format!(
            "{name}: {}{}",
            meaning(parameter),
            limits.unwrap_or_default()
        );
        writeln!(class, "{}", wrapped(&text, "       ")).expect("a string takes it");
        let kind = match parameter.kind {
            ParameterKind::Number => "Number".into(),
            ParameterKind::Pair => "Numbers".into(),
            ParameterKind::Bands => "Bands".into(),
            ParameterKind::Coefficients => "Numbers".into(),
            ParameterKind::Count | ParameterKind::LargeCount => "Whole".into(),
            ParameterKind::Flag => "bool".into(),
            ParameterKind::Name(names) => format!("Literal[\"{}\"]", names.join("\", \"")),
        };
        let or_none = if parameter.is_optional { " | None" } else { "" };
        let default = match value {
            _ if parameter.example.is_some() => String::new(),
            None => " = None".into(),
            Some(ParameterValue::Number(number)) => format!(" = {number:?}"),
            Some(ParameterValue::Pair(numbers)) => format!(" = {numbers:?}"),
            Some(ParameterValue::Bands([a, b, c]) | ParameterValue::Coefficients([a, b, c])) => {
                format!(" = ({a:?}, {b:?}, {c:?})")
            }
            Some(ParameterValue::Count(count)) => format!(" = {count}"),
            Some(ParameterValue::Name(word)) => format!(" = \"{word}\""),
            Some(ParameterValue::Flag(flag)) => {
                format!(" = {}", if flag { "True" } else { "False" })
            }
        };
        writeln!(fields, "    {name}: {kind}{or_none}{default}").expect("a string takes it");
    }
    class + last_text + "    \"\"\"\n\n" + &fields + last
}

/// The class of the same name as the struct.
fn python_struct(defaults: &dyn Parameters, first: &str) -> String {
    python_class(defaults.name(), defaults, ["", first], ["", ""])
}

fn light_class(kind: &str) -> String {
    let (first, rest) = kind.split_at(1);
    format!("{}{rest}Light", first.to_uppercase())
}

fn python_light(profile: Profile) -> Option<String> {
    let kind = profile.kind();
    let first = [
        "    position_m: position, m.\n    direction: of the axis, of any length.\n",
        &format!(
            "    kind: ClassVar[str] = \"{kind}\"\n    position_m: Vector\n    direction: Vector\n"
        ),
    ];
    let last = [
        "    power_w: power of each band, W.\n    relative_to: camera: position and directions are in the camera's axes \
         (x right, y down, z forward), and the light moves with it; None:\n        they are in world space.\n",
        "    power_w: Bands\n    relative_to: Literal[\"camera\"] | None = None\n",
    ];
    Some(python_class(
        &light_class(kind),
        profile.numbers()?,
        first,
        last,
    ))
}

fn union(name: &str, classes: &str) -> String {
    format!("\n\n{name}: TypeAlias = Union[{classes}]\n")
}

#[test]
fn the_python_classes_are_those_of_the_parameters() {
    let profiles = Light::KINDS.into_iter().filter_map(Profile::of_kind);
    let mut lights: String = profiles.filter_map(python_light).collect();
    // A projector is a light with a pattern.
    let classes = Light::KINDS.map(light_class).join(", ");
    lights += &union("Light", &classes.replace(" ProjectorLight,", ""));

    let microfacets = python_struct(&MetallicRoughness::DEFAULT, "");
    let of_noise = [
        "    noise: how electrons are counted; None: layers hold expected values.\n",
        "    noise: SensorNoise | None = None\n",
    ];
    let sensor = python_class("Sensor", &Sensor::DEFAULT, ["", ""], of_noise);
    let sensor = python_struct(&SensorNoise::DEFAULT, "") + &sensor;

    let estimators = IndirectLight::all();
    let classes = estimators.map(|indirect| indirect.parameters().name());
    let estimators = estimators.map(|indirect| {
        let first = format!("    estimator: ClassVar[str] = \"{}\"\n", indirect.name());
        python_struct(indirect.parameters(), &first)
    });
    let estimators = estimators.concat() + &union("Indirect", &classes.join(", "));

    for (what, made) in [
        ("lights", lights),
        ("microfacets", microfacets),
        ("sensor", sensor),
        ("indirect light", estimators),
    ] {
        let lines = [
            format!("# {what}: from the rows of the engine's parameters."),
            format!("\n\n# End of {what}.\n"),
        ];
        assert_part_is_checked_in(
            "python/camlux/scene.py",
            [&lines[0], &lines[1]],
            &format!("\n{made}"),
        );
    }
}

#[test]
fn the_python_package_has_the_classes_of_scenes() {
    let (package, scene) = ("python/camlux/__init__.py", read_python_classes());
    let class = |line| str::strip_prefix(line, "class ")?.strip_suffix("(Fields):");
    for (begin, end, quote) in [
        ("from .scene import (\n", ")\n", ""),
        ("__all__ = [\n", "]\n", "\""),
    ] {
        let text = read(package);
        let (_, rest) = text.split_once(begin).expect("a list begins");
        let (listed, _) = rest.split_once(end).expect("it ends");
        let lines = scene.lines().filter_map(class);
        let lines = lines.map(|class| format!("    {quote}{class}{quote},\n"));
        let all = BTreeSet::from_iter(listed.split_inclusive('\n').map(String::from).chain(lines));
        assert_part_is_checked_in(package, [begin, end], &String::from_iter(all));
    }
}

/// The keys of a table of scene files.
fn keys(defaults: &dyn Parameters) -> String {
    let mut table = "\n| key | value | when absent | meaning |\n|---|---|---|---|\n".to_owned();
    for (parameter, value) in defaults.named_values() {
        let value_kind = match (parameter.kind, limits(parameter)) {
            (ParameterKind::Name(names), _) => format!("`\"{}\"`", names.join("\"` or `\"")),
            (ParameterKind::Flag, _) => "`true` or `false`".into(),
            (_, Some(limits)) => limits,
            (kind, None) => match parameter.limits {
                Some(limits) if limits.is_above && kind == ParameterKind::Number => "above 0",
                Some(limits) if limits.is_above => "1 or more",
                _ => "0 or more",
            }
            .into(),
        };
        let default = match value {
            _ if parameter.example.is_some() => "(needed)".into(),
            None => String::new(),
            Some(ParameterValue::Name(word)) => format!("`\"{word}\"`"),
            Some(value) => format!("`{value}`"),
        };
        let (name, meaning) = (parameter.name, meaning(parameter));
        writeln!(
            table,
            "| `{name}` | {value_kind} | {default} | {} |",
            meaning
        )
        .expect("a string takes it");
    }
    table
}

#[test]
fn the_tables_of_scene_files_are_those_of_the_parameters() {
    let titled = |title: &str, parameters: &dyn Parameters| {
        format!("\nThe keys of {title}:\n{}", keys(parameters))
    };
    let of_light = |profile: Profile| {
        let kind = profile.kind();
        let title = format!("`kind = \"{kind}\"`, beside `position`, `direction` and `power_w`");
        Some(titled(&title, profile.numbers()?))
    };
    let profiles = Light::KINDS.into_iter().filter_map(Profile::of_kind);
    let estimators =
        IndirectLight::all().map(|each| titled(&format!("`{}`", each.name()), each.parameters()));
    for (what, made) in [
        ("lights", profiles.filter_map(of_light).collect()),
        ("[sensor.noise]", keys(&SensorNoise::DEFAULT)),
        ("microfacets", keys(&MetallicRoughness::DEFAULT)),
        ("estimators", estimators.concat()),
    ] {
        let lines = [
            format!("<!-- keys of {what}: from the rows of src/scene -->"),
            "<!-- end of the keys -->".into(),
        ];
        assert_part_is_checked_in("docs/scene.md", [&lines[0], &lines[1]], &made);
    }
}
