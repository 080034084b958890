//! Recalibrated study as a Rust program: tuners as values; models, experiments and criteria as TOML tables.

use std::collections::HashSet;

use mops_language::plain::{acts, line};
use mops_outcome::diagnosis::Diagnosis;
use toml::{Table, Value};

use super::words;

/// Returns the program that builds and solves the study of the file `text`. Paths of data are relative to `folder`.
pub fn source(text: &str, diagnosis: &Diagnosis, folder: &str) -> String {
    let study: Table = text.parse().expect("the recalibrated study is valid TOML");
    // N.B.: names in a study are untrusted text. In comments they are kept on one line, elsewhere they are literals.
    let about = line(&words::verdict(diagnosis).replace('`', ""));
    let name = study.get("study").and_then(|s| s.get("name")).and_then(Value::as_str).unwrap_or_default();
    let mut imports = vec!["StudyBuilder", "Study", "Task", "TunerBuilder"];
    let tuners = entries(&study, "tuners").map(|(name, tuner)| entry(name, &self::tuner(tuner)));
    let tuners = items(tuners.collect(), 8);

    let (mut constants, mut taken) = (String::new(), HashSet::new());
    let mut list = |section: &str, make: &dyn Fn(&str, &str) -> String| -> Vec<String> {
        let mut items = Vec::new();
        for (name, table) in entries(&study, section) {
            let constant = unique(constant(section, name), &mut taken);
            constants += &format!("\n/// `{}`.\nconst {constant}: &str = {};\n", line(name), raw(&written(table)));
            items.push(make(name, &constant));
        }
        items
    };
    let models =
        items(list("models", &|name, text| entry(name, &format!("file::model(&catalogue, {text}, &Data)?"))), 4);
    let mut cases = list("cases", &|name, text| format!("file::cases({name:?}, {text}, &models, &Data)?"));
    cases.extend(list("experiments", &|name, text| format!("file::experiments({name:?}, {text}, &Data)?")));
    let cases = items(cases, 8);
    let cases = cases.trim_start_matches("vec!");
    let concatenated = if cases.contains('\n') { "\n        .concat()" } else { ".concat()" };
    let criteria = list("criteria", &|name, text| entry(name, &format!("file::criterion(&catalogue, {text})?")));
    let criteria = items(criteria, 8);
    let noise = |(signal, sensor): (&str, &Value)| sensor.get("noise").map(|noise| entry(signal, &quantity(noise)));
    let sensors: Vec<String> = entries(&study, "sensors").filter_map(noise).collect();
    let sensors = if sensors.is_empty() { String::new() } else { format!("        sensors: {},\n", items(sensors, 8)) };
    let quantities = format!("{tuners}{sensors}");
    let scale = if quantities.contains("Scale::") { "use mops::core::study::Scale;\n" } else { "" };
    imports.extend(["Quantity", "Unit"].iter().filter(|name| quantities.contains(&format!("{name}::"))));
    imports.sort_unstable();
    let seed = study.get("study").and_then(|s| s.get("seed")).and_then(Value::as_integer);
    let seed = seed.map_or_else(String::new, |seed| format!("        seed: {seed},\n"));

    let about = wrapped(&about, 116).join("\n//! ");
    format!(
        "//! {about}
//!
//! Written by `mops diagnose --export rust`. Requires the crate `mops` and the data files of the experiments.

use std::error::Error;
use std::path::Path;

{scale}use mops::language::files::Files;
use mops::{{{imports}, file}};

/// Folder that data paths are relative to.
const FOLDER: &str = {folder:?};
{constants}
/// Data files in [`FOLDER`].
struct Data;

impl Files for Data {{
    fn read(&self, path: &str) -> std::io::Result<Vec<u8>> {{
        std::fs::read(Path::new(FOLDER).join(path))
    }}

    fn show(&self, path: &str) -> String {{
        Path::new(FOLDER).join(path).display().to_string()
    }}

    fn list(&self, folder: &str) -> std::io::Result<Vec<String>> {{
        let entries = std::fs::read_dir(Path::new(\".\").join(FOLDER).join(folder))?;
        entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect()
    }}
}}

/// Builds the recalibrated study.
pub fn study() -> Result<Study, Box<dyn Error>> {{
    let catalogue = mops::catalogue();
    let models = {models};
    let draft = StudyBuilder {{
        name: {name:?}.into(),
        task: Task::calibration(),
{seed}        tuners: {tuners},
        cases: {cases}{concatenated},
{sensors}        criteria: {criteria},
        models,
        ..StudyBuilder::default()
    }};
    Ok(draft.build()?)
}}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn Error>> {{
    let outcome = mops::solve(study()?, &mops::Options::default(), &())?.outcome;
    for tuner in &outcome.tuners {{
        println!(\"{{}} = {{:.6e}} {{}}\", tuner.name, tuner.value, tuner.unit);
    }}
    for experiment in outcome.calibration.iter().flat_map(|calibration| &calibration.experiments) {{
        for channel in &experiment.channels {{
            println!(\"{{}} {{}}: rms {{:.4e}} {{}}\", experiment.name, channel.name, channel.rmse, channel.unit);
        }}
    }}
    Ok(())
}}
",
        imports = imports.join(", "),
    )
}

/// Returns the tables of a section, in their order.
fn entries<'t>(study: &'t Table, section: &str) -> impl Iterator<Item = (&'t str, &'t Value)> {
    study.get(section).and_then(Value::as_table).into_iter().flatten().map(|(name, value)| (name.as_str(), value))
}

/// Returns the code of a named item of a list.
fn entry(name: &str, value: &str) -> String {
    format!("({name:?}.into(), {value})")
}

/// Returns the code of a list, on one line if it is short.
fn items(items: Vec<String>, indent: usize) -> String {
    let short = format!("vec![{}]", items.join(", "));
    if short.len() <= 90 {
        return short;
    }
    let [inner, outer] = [" ".repeat(indent + 4), " ".repeat(indent)];
    format!("vec![\n{}{outer}]", items.iter().map(|item| format!("{inner}{item},\n")).collect::<String>())
}

/// Returns a table as TOML.
fn written(table: &Value) -> String {
    table.as_table().map(|table| toml::to_string(table).expect("a parsed table is valid TOML")).unwrap_or_default()
}

/// Returns a text as a raw string literal, or with escapes if it contains control characters.
fn raw(text: &str) -> String {
    if text.contains(acts) {
        return format!("{:?}", text.trim_start());
    }
    let hashes = (1..)
        .map(|n| "#".repeat(n))
        .find(|hashes| !text.contains(&format!("\"{hashes}")))
        .expect("some number of hashes is enough");
    format!("r{hashes}\"\n{}{}{hashes}", text.trim_start(), '"')
}

/// Returns the name of a constant: `MODEL_RIG`.
fn constant(section: &str, name: &str) -> String {
    let kind = match section {
        "criteria" => "criterion",
        plural => plural.trim_end_matches('s'),
    };
    let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    format!("{}_{}", kind.to_uppercase(), name.chars().map(letter).collect::<String>())
}

/// Returns a unique name: names of a study may map to the same identifier.
fn unique(name: String, taken: &mut HashSet<String>) -> String {
    let names = std::iter::once(name.clone()).chain((2..).map(|i| format!("{name}_{i}")));
    names.into_iter().find(|name| taken.insert(name.clone())).expect("some number is free")
}

/// Returns the code of a quantity.
fn quantity(value: &Value) -> String {
    match value {
        Value::String(text) => format!("Quantity::parse({text:?})?"),
        Value::Integer(value) => format!("{value}.0.into()"),
        Value::Float(value) => format!("{value:?}.into()"),
        other => other.to_string(),
    }
}

/// Returns the code of a tuner.
fn tuner(tuner: &Value) -> String {
    let Some(table) = tuner.as_table() else { return "TunerBuilder::default()".to_owned() };
    let number = |key: &str| match table.get(key) {
        Some(Value::Float(value)) => Some(*value),
        #[allow(clippy::cast_precision_loss)]
        Some(Value::Integer(value)) => Some(*value as f64),
        _ => None,
    };
    let log = table.get("scale").and_then(Value::as_str) == Some("log");
    let plain = table.keys().all(|key| ["start", "min", "max", "scale"].contains(&key.as_str()));
    if let (Some(start), Some(min), Some(max), true) = (number("start"), number("min"), number("max"), plain) {
        return format!("TunerBuilder::new({start:?}, {min:?}, {max:?}){}", if log { ".log()" } else { "" });
    }
    let mut fields = Vec::new();
    for (key, value) in table {
        let text = value.as_str().unwrap_or_default();
        fields.push(match key.as_str() {
            "start" | "min" | "max" => format!("{key}: Some({})", quantity(value)),
            "unit" => format!("unit: Some(Unit::parse({text:?})?)"),
            "scale" if log => "scale: Scale::Log".to_owned(),
            "scale" => "scale: Scale::Linear".to_owned(),
            "integer" => format!("integer: {value}"),
            "values" => {
                let values = value.as_array().into_iter().flatten().map(quantity).collect::<Vec<_>>();
                format!("values: Some(vec![{}])", values.join(", "))
            }
            "active" => format!("inactive: {}", !value.as_bool().unwrap_or(true)),
            "tie" => format!("tie: Some({text:?}.into())"),
            "starts" => {
                let starts = value.as_table().into_iter().flatten();
                let starts: Vec<String> =
                    starts.map(|(case, value)| format!("({case:?}.into(), {})", quantity(value))).collect();
                format!("starts: vec![{}]", starts.join(", "))
            }
            "per-case" if value.is_array() => {
                let cases = value.as_array().into_iter().flatten().filter_map(Value::as_str);
                let cases: Vec<String> = cases.map(|case| format!("{case:?}.into()")).collect();
                format!("separate_in: vec![{}]", cases.join(", "))
            }
            _ => format!("per_case: {value}"),
        });
    }
    format!("TunerBuilder {{ {}, ..TunerBuilder::default() }}", fields.join(", "))
}

/// Returns the lines of a text of at most so many characters, broken between words.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().expect("there is one");
        if last.is_empty() {
            last.push_str(word);
        } else if last.chars().count() + 1 + word.chars().count() <= width {
            *last += " ";
            *last += word;
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use mops_core::catalogue::CatalogueStudy;
    use mops_outcome::diagnosis::Removed;

    use super::super::made_up;
    use super::super::repaired::{Original, repaired};
    use super::*;

    /// N.B.: `examples/repaired.rs` is compiled with the other examples, and run by `tests/examples.rs`.
    #[test]
    fn the_example_is_the_program_for_the_swinging_pendulum() {
        let catalogue = crate::testing::catalogue();
        let Some(CatalogueStudy::Shipped(shipped)) = catalogue.study("furuta-swing") else {
            panic!("`furuta-swing` is a shipped study")
        };
        let text = std::str::from_utf8(shipped.file("study.toml").unwrap()).unwrap();
        let settings = ["tuners.ca.max=6e-3".to_owned()];
        let study = mops_file::read(&catalogue, "study.toml", text, &settings, shipped).unwrap().study;
        // Without the effect: the model of the pendulum contains it as a term.
        let removed = vec![Removed { term: "bp".into(), place: "joint:theta".into() }];
        let mut diagnosis = made_up::coulomb();
        diagnosis.found = Vec::new();
        diagnosis.removed = removed;
        let original = Original { text, settings: &settings, study: &study, effects: &catalogue.effects };
        let program = source(&repaired(&original, &diagnosis, &str::to_owned), &diagnosis, "studies/furuta-swing");
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/repaired.rs");
        if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
            std::fs::write(path, &program).unwrap();
        }
        assert_eq!(std::fs::read_to_string(path).unwrap(), program);
    }

    /// Returns the program without the content of its string literals, raw or with escapes.
    fn without_literals(program: &str) -> String {
        let (mut rest, mut code) = (program, String::new());
        while let Some(start) = rest.find('"') {
            let hashes = rest[..start].chars().rev().take_while(|c| *c == '#').count();
            let is_raw = rest[..start - hashes].ends_with('r');
            code.push_str(&rest[..start]);
            rest = &rest[start + 1..];
            let end = if is_raw { "\"".to_owned() + &"#".repeat(hashes) } else { "\"".to_owned() };
            let mut at = 0;
            let close = loop {
                let found = at + rest[at..].find(&end).expect("literals end");
                let slashes = rest[..found].chars().rev().take_while(|c| *c == '\\').count();
                if is_raw || slashes % 2 == 0 {
                    break found;
                }
                at = found + 1;
            };
            rest = &rest[close + end.len()..];
        }
        code + rest
    }

    #[test]
    fn no_name_of_a_study_becomes_code() {
        let names = [
            "a`.\nfn evil() {}\n/// `",
            "a\r\nfn evil() {}\r\n",
            "a\rfn evil() {}\r//",
            "\"#; fn evil() {} const A: &str = r#\"",
            "\"##;\nfn evil() {}\nr##\"",
            "*/ fn evil() {} /*",
            "\\\"); fn evil() {} (\"",
            "a\u{85}fn evil() {}\u{2028}fn evil() {}",
            "\u{202e}fn evil() {}\u{2066}",
            "{fn evil() {}}",
            "\0fn evil() {}\u{1b}[2J",
        ];
        for name in names {
            let key = mops_file::edit::key(name);
            let text = format!(
                "[study]\nname = {key}\nseed = 3\n[models.{key}.furuta]\ntolerance = 1e-9\n[tuners.{key}]\nstart = 1.0\nmin = 0.5\n\
                 max = 2.0\nunit = {key}\ntie = {key}\n[cases.{key}]\na = {key}\n[experiments.{key}]\nfile = {key}\n[criteria.{key}]\n\
                 overshoot = {{ signal = {key} }}\n",
                key = if key.starts_with(['"', '\'']) { key.clone() } else { format!("\"{key}\"") }
            );
            let program = source(&text, &made_up::coulomb(), name);
            let code: Vec<String> = without_literals(&program)
                .lines()
                .map(|line| line.split("//").next().unwrap_or_default().to_owned())
                .filter(|line| line.contains("evil"))
                .collect();
            assert!(code.is_empty(), "{name:?}: {code:?}");
            // No control character reaches an editor or a compiler.
            assert!(!program.contains(acts) && !program.contains('\r'), "{name:?}");
        }
    }

    #[test]
    fn names_with_the_same_identifier_have_separate_constants() {
        let text = "[cases.\"a-b\"]\nx = 1\n[cases.\"a.b\"]\nx = 2\n[cases.a_b]\nx = 3\n[cases.A_B]\nx = 4\n";
        let program = source(text, &made_up::coulomb(), ".");
        let names: Vec<&str> =
            program.lines().filter_map(|l| l.strip_prefix("const CASE")?.split(':').next()).collect();
        assert_eq!(names, ["_A_B", "_A_B_2", "_A_B_3", "_A_B_4"]);
    }

    #[test]
    fn every_key_of_a_tuner_is_in_the_program() {
        let of = |text: &str| tuner(&Value::Table(text.parse().unwrap()));
        assert_eq!(of("start = 1\nmin = 0.5\nmax = 2.0\nscale = \"log\""), "TunerBuilder::new(1.0, 0.5, 2.0).log()");
        assert_eq!(
            of("start = \"3 cm\"\nmin = 0\nmax = 1.0\nunit = \"m\"\nactive = false\nper-case = true"),
            "TunerBuilder { start: Some(Quantity::parse(\"3 cm\")?), min: Some(0.0.into()), max: Some(1.0.into()), \
             unit: Some(Unit::parse(\"m\")?), inactive: true, per_case: true, ..TunerBuilder::default() }"
        );
        assert_eq!(
            of("start = 1\nper-case = true\nstarts = { push = 2.0 }"),
            "TunerBuilder { start: Some(1.0.into()), per_case: true, starts: vec![(\"push\".into(), 2.0.into())], \
             ..TunerBuilder::default() }"
        );
        assert_eq!(of("tie = \"2*k\""), "TunerBuilder { tie: Some(\"2*k\".into()), ..TunerBuilder::default() }");
        assert_eq!(
            of("start = 2\nvalues = [1, 2]\ninteger = true"),
            "TunerBuilder { start: Some(2.0.into()), values: Some(vec![1.0.into(), 2.0.into()]), integer: true, ..TunerBuilder::default() }"
        );
    }
}
