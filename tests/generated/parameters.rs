//! The Python classes and the tables of docs/scene.md that come from the rows of parameters are up to date.

use std::fmt::Write;

use camlux::scene::{
    FinalGather, IndirectLight, InstantRadiosity, Limits, MetallicRoughness, Parameter,
    ParameterKind, ParameterValue, Parameters, RsmAverage, Sensor, SensorNoise,
};

use crate::layers::assert_part_is_checked_in;

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

fn python_class<T: Parameters>(name: &str, defaults: &T, first: &str) -> String {
    let mut class = format!(
        "\n\n@dataclass(slots=True, eq=False)\nclass {name}(Fields):\n    \"\"\"{}\n\n",
        T::ABOUT.trim()
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
            Some(ParameterValue::Count(count)) => format!(" = {count}"),
            Some(ParameterValue::Name(word)) => format!(" = \"{word}\""),
            Some(ParameterValue::Flag(flag)) => {
                format!(" = {}", if flag { "True" } else { "False" })
            }
        };
        writeln!(fields, "    {name}: {kind}{or_none}{default}").expect("a string takes it");
    }
    class + "    \"\"\"\n\n" + &fields
}

fn python_estimator<T: Parameters>(class: &str, defaults: &T, indirect: &IndirectLight) -> String {
    let first = format!("    estimator: ClassVar[str] = \"{}\"\n", indirect.name());
    python_class(class, defaults, &first)
}

#[test]
fn the_python_classes_are_those_of_the_parameters() {
    let [gather, average, radiosity] = IndirectLight::all();
    let sensor = [
        python_class("Sensor", &Sensor::DEFAULT, ""),
        python_class("SensorNoise", &SensorNoise::DEFAULT, ""),
    ];
    let microfacets = python_class("MetallicRoughness", &MetallicRoughness::DEFAULT, "");
    let estimators = [
        python_estimator("FinalGather", &FinalGather::DEFAULT, &gather),
        python_estimator("RsmAverage", &RsmAverage::DEFAULT, &average),
        python_estimator("InstantRadiosity", &InstantRadiosity::DEFAULT, &radiosity),
    ];
    for (what, made) in [
        ("microfacets", microfacets),
        ("sensor", sensor.concat()),
        ("indirect light", estimators.concat()),
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

/// The keys of a table of scene files.
fn keys<T: Parameters>(defaults: &T) -> String {
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
    for (what, made) in [
        ("final-gather", keys(&FinalGather::DEFAULT)),
        ("rsm-average", keys(&RsmAverage::DEFAULT)),
        ("instant-radiosity", keys(&InstantRadiosity::DEFAULT)),
        ("[tof.noise]", keys(&SensorNoise::DEFAULT)),
        ("microfacets", keys(&MetallicRoughness::DEFAULT)),
    ] {
        let lines = [
            format!("<!-- keys of {what}: from the rows of src/scene -->"),
            "<!-- end of the keys -->".into(),
        ];
        assert_part_is_checked_in("docs/scene.md", [&lines[0], &lines[1]], &made);
    }
}
