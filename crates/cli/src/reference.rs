//! Generated part of the pages in `docs/reference`: kinds, keys of study files, command line, keys of `result.json`.
//!
//! The part of a page above [`MARK`] is written by hand. `REFERENCE=update cargo test -p mops-cli reference` replaces
//! the part below.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use clap::CommandFactory;
use mops_catalogue::catalogue;
use mops_file as file;
use schemars::Schema;
use serde_json::Value;

use super::{Arguments, effect};

/// Line between the two parts of a page.
const MARK: &str = "<!-- Generated from the program by `REFERENCE=update cargo test -p mops-cli reference`. -->\n";

/// Compares the generated part of a page with the file, or replaces it.
fn check(page: &str, generated: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference").join(page);
    let stored = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let written = stored.split(MARK).next().expect("a split has a first part");
    let present = format!("{written}{MARK}\n{generated}");
    if std::env::var("REFERENCE").is_ok_and(|update| update == "update") {
        fs::write(&path, present).unwrap();
    } else {
        assert!(stored == present, "{page} is out of date: REFERENCE=update cargo test -p mops-cli reference");
    }
}

/// Returns a text as part of a list item or a paragraph, on one line.
fn on_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn list(entries: &[file::Entry], depth: usize) -> String {
    let indent = "  ".repeat(depth);
    let item = |entry: &file::Entry| {
        let below = list(&entry.below, depth + 1);
        let each = entry.any_name.as_ref().map_or("", |_| " Keys under each name:");
        let about = on_one_line(&entry.about) + each;
        let colon = if about.is_empty() { "" } else { ": " };
        format!("{indent}- `{}` ({}){colon}{about}\n{below}", entry.name, entry.facts)
    };
    entries.iter().map(item).collect()
}

/// Returns the sections of kinds or tables, each with its documentation and its keys.
fn sections<'n>(kinds: impl Iterator<Item = (&'n str, Schema)>, keys: &str) -> String {
    let section = |(name, schema): (&str, Schema)| {
        let entries = file::entries(&schema);
        let keys = if entries.is_empty() { String::new() } else { format!("\n{keys}:\n\n{}", list(&entries, 0)) };
        format!("## {name}\n\n{}\n{keys}", file::about(&schema))
    };
    kinds.map(section).collect::<Vec<_>>().join("\n")
}

#[test]
fn pages_of_kinds_show_the_catalogue() {
    let catalogue = catalogue();
    check("models.md", &sections(catalogue.models.iter().map(|kind| (kind.name, (kind.schema)())), "Options"));
    check("criteria.md", &sections(catalogue.criteria.iter().map(|kind| (kind.name, (kind.schema)())), "Options"));
    check("solvers.md", &sections(catalogue.solvers.iter().map(|kind| (kind.name, (kind.schema)())), "Options"));
    check("study-file.md", &sections(file::tables(&catalogue).into_iter(), "Keys"));
}

#[test]
fn the_page_of_effects_shows_the_catalogue() {
    let section = |effect: &dyn mops_core::Effect| {
        let facts: String = effect::facts(effect).into_iter().map(|fact| fact + ".\n").collect();
        let parameter = |of: &mops_core::effect::EffectParameter| {
            format!("- `{}` ({}): {}\n", of.name, effect::parameter_facts(of), on_one_line(of.about))
        };
        let parameters: String = effect.parameters().iter().map(parameter).collect();
        let (name, about, formula, source) = (effect.name(), effect.about(), effect.formula(), effect.source());
        format!("### {name}\n\n{about}\n\n    {formula}\n\n{facts}\nParameters:\n\n{parameters}\nSource: {source}.\n")
    };
    let sections: Vec<String> = catalogue().effects.iter().map(|effect| section(effect.as_ref())).collect();
    check("effects.md", &format!("## Catalogue\n\n{}", sections.join("\n")));
}

#[test]
fn the_page_of_the_command_line_shows_the_help() {
    // Not the width of the terminal that runs the test.
    let mut command = super::tasks::add_commands(Arguments::command(), &catalogue()).term_width(100);
    command.build();
    let help = |command: &mut clap::Command| command.render_long_help().to_string();
    let mut page = format!("## mops\n\n```text\n{}```\n", help(&mut command));
    for command in command.get_subcommands_mut().filter(|command| command.get_name() != "help") {
        let text = help(command);
        page += &format!("\n## mops {}\n\n```text\n{text}```\n", command.get_name());
    }
    check("command-line.md", &page);
}

/// A part of the result: its path, such as `calibration.parameters[]`, and its schema.
struct Part {
    path: String,
    schema: Value,
}

/// Writer of the sections of the result, one per object.
struct Sections<'r> {
    root: &'r Value,
    /// Path at which an object is described, by its schema.
    described: HashMap<String, String>,
}

impl Sections<'_> {
    /// Returns the section of a part, followed by those of the parts below it.
    fn of(&mut self, part: &Part) -> String {
        let about = text(&part.schema);
        let mut page =
            if part.path.is_empty() { String::new() } else { format!("\n## `{}`\n\n{about}\n\n", part.path) };
        page += "| key | type | content |\n|---|---|---|\n";
        let required: Vec<&str> =
            part.schema["required"].as_array().into_iter().flatten().flat_map(Value::as_str).collect();
        let mut below = Vec::new();
        for (key, value) in part.schema["properties"].as_object().expect("an object") {
            let path = if part.path.is_empty() { key.clone() } else { format!("{}.{key}", part.path) };
            let (mut kind, inside) = self.kind(value, &path);
            if let Some(part) = inside {
                let path = self.described.entry(part.schema.to_string()).or_insert_with(|| part.path.clone());
                if *path == part.path {
                    below.push(part);
                } else {
                    kind += &format!(", as `{path}`");
                }
            }
            if !required.contains(&key.as_str()) {
                kind = format!("{}; may be absent", kind.trim_end_matches(" or null"));
            }
            page += &format!("| `{key}` | {kind} | {} |\n", text(value).replace('|', "\\|"));
        }
        page + &below.iter().map(|part| self.of(part)).collect::<String>()
    }

    /// Returns the type of a value in words, and the object that it contains.
    fn kind(&self, value: &Value, path: &str) -> (String, Option<Part>) {
        let quoted = |words: Vec<&str>| words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
        if let Some(name) = value["$ref"].as_str() {
            return self.kind(self.root.pointer(&name[1..]).expect("a definition"), path);
        }
        if let Some(all) = value["allOf"].as_array() {
            return self.kind(&all[0], path);
        }
        if let Some(choices) = value["anyOf"].as_array() {
            let (kind, inside) = self.kind(&choices[0], path);
            return (format!("{kind} or null"), inside);
        }
        if let Some(choices) = value["oneOf"].as_array() {
            return (quoted(choices.iter().filter_map(|choice| choice["const"].as_str()).collect()), None);
        }
        if let Some(words) = value["enum"].as_array() {
            return (quoted(words.iter().filter_map(Value::as_str).collect()), None);
        }
        if value["properties"].is_object() {
            return ("object".to_owned(), Some(Part { path: path.to_owned(), schema: value.clone() }));
        }
        if value["additionalProperties"].is_object() {
            let (kind, inside) = self.kind(&value["additionalProperties"], &format!("{path}.NAME"));
            return (format!("{kind} by name"), inside);
        }
        if value["items"].is_object() {
            let (kind, inside) = self.kind(&value["items"], &format!("{path}[]"));
            let number = value["minItems"].as_u64().map_or_else(String::new, |n| format!("{n} "));
            return (format!("list of {number}{kind}"), inside);
        }
        if let Some(items) = value["items"].as_array() {
            let kinds: Vec<String> = items.iter().map(|item| self.kind(item, path).0).collect();
            return (format!("[{}]", kinds.join(", ")), None);
        }
        // Every number may be null, as the page says.
        let name = match &value["type"] {
            Value::Array(names) if names[0] == "number" => "number".to_owned(),
            Value::Array(names) => names.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" or "),
            name => name.as_str().expect("a type").to_owned(),
        };
        (name, None)
    }
}

/// Returns the documentation of a value, on one line.
fn text(schema: &Value) -> String {
    on_one_line(schema["description"].as_str().unwrap_or_default())
}

#[test]
fn the_page_of_the_result_shows_its_schema() {
    let root = mops_tasks::result_schema(&catalogue());
    let mut sections = Sections { root: &root, described: HashMap::new() };
    check("result-json.md", &sections.of(&Part { path: String::new(), schema: root.clone() }));
}
