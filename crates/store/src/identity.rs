//! Identity of a run, and the differences between two studies that change the values of points.

use mops_core::Study;
use mops_file::StudyFile;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Identity of a run: study, data, solver and seed. Two runs with equal identities have the same result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program; another version may compute other values.
    mops: String,
    /// Content of the study file, settings included.
    study: Value,
    /// Data files, with a digest of their bytes.
    data: Vec<(String, String)>,
    /// Digest of the program, if its own code computes values.
    #[serde(default)]
    program: Option<String>,
    /// Names of the tuners, in order.
    tuners: Vec<String>,
    /// Names of the rows, in order.
    rows: Vec<String>,
    /// Names and units of the uncertain parameters, in order.
    uncertain: Vec<String>,
    /// Solver of the run.
    solver: String,
    /// Seed of the run.
    seed: u64,
}

/// Difference between two studies.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Difference {
    /// Keys that lead to the value.
    path: Vec<String>,
    before: String,
    after: String,
}

/// Consequence of a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    /// The values of points may change.
    Values,
    /// The values of points stay the same, but the solver may visit other points.
    Path,
    /// Only the budget changes.
    Budget,
}

impl Identity {
    /// Returns the identity of a run of the study.
    pub fn of(file: &StudyFile, study: &Study, solver: &str) -> Self {
        Self {
            mops: env!("CARGO_PKG_VERSION").to_owned(),
            study: file.content.clone(),
            data: file.data.clone(),
            program: file.program.clone(),
            tuners: study.tuners().iter().map(|tuner| tuner.name.clone()).collect(),
            rows: study.rows().iter().map(|row| format!("{} [{}]", study.key(row), row.unit)).collect(),
            uncertain: study.uncertain().iter().map(|u| format!("{}[{}]", u.name, u.unit)).collect(),
            solver: solver.to_owned(),
            seed: study.seed(),
        }
    }

    /// Returns the differences that prevent a run of `self` from being continued as a run of `now`, as text.
    pub(super) fn refuses_to_continue(&self, now: &Self) -> Option<String> {
        summary(self.differences(now).iter().filter(|d| d.meaning() != Meaning::Budget))
    }

    /// Returns the differences that make the points of a run of `self` invalid for a run of `now`, as text.
    pub(super) fn refuses_to_reuse(&self, now: &Self) -> Option<String> {
        summary(self.differences(now).iter().filter(|d| d.meaning() == Meaning::Values))
    }

    /// Returns true if the coordinates of the unit box, and hence the derivatives, have the same meaning.
    pub(super) fn has_coordinates_of(&self, now: &Self) -> bool {
        let of = |identity: &Self, table: &str| identity.study.get(table).cloned();
        ["tuners", "cases", "experiments"].iter().all(|table| of(self, table) == of(now, table))
    }

    /// Returns true if the values of the uncertain parameters have the same meaning.
    pub(super) fn has_uncertain_of(&self, now: &Self) -> bool {
        self.uncertain == now.uncertain
    }

    fn differences(&self, now: &Self) -> Vec<Difference> {
        let value = |identity: &Self| serde_json::to_value(identity).expect("an identity is JSON");
        let mut found = Vec::new();
        compare(&mut Vec::new(), &value(self), &value(now), &mut found);
        found
    }
}

impl Difference {
    fn meaning(&self) -> Meaning {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        match path.as_slice() {
            ["study", "solver", "max-evaluations"] => Meaning::Budget,
            ["study", "models" | "cases" | "sensors", ..] | ["mops" | "data" | "program" | "rows", ..] => {
                Meaning::Values
            }
            ["tuners", ..] => Meaning::Values,
            ["study", "experiments", _, "role"] => Meaning::Path,
            ["study", "experiments", ..] => Meaning::Values,
            ["study", "criteria", _, "usage" | "demand" | "good" | "bad" | "weight"] => Meaning::Path,
            ["study", "criteria", ..] => Meaning::Values,
            ["study", "tuners", _, "start" | "min" | "max" | "scale" | "integer" | "values" | "active"] => {
                Meaning::Path
            }
            ["study", "tuners", ..] => Meaning::Values,
            _ => Meaning::Path,
        }
    }

    fn text(&self) -> String {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        let name = match path.as_slice() {
            ["study", rest @ ..] => rest.join("."),
            ["program"] => {
                return "the program was rebuilt, and its own models, criteria or studies may have changed".to_owned();
            }
            ["data", ..] => return "a data file has changed".to_owned(),
            ["tuners", ..] => return "the tuners have changed".to_owned(),
            ["rows", ..] => return "the criteria or their units have changed".to_owned(),
            ["uncertain", ..] => return "the uncertain parameters have changed".to_owned(),
            ["mops"] => "the version of mops".to_owned(),
            _ => path.join("."),
        };
        format!("`{name}` was {} and is {}", self.before, self.after)
    }
}

/// Formats the first three differences in one sentence; returns `None` without differences.
fn summary<'d>(differences: impl Iterator<Item = &'d Difference>) -> Option<String> {
    let mut texts: Vec<String> = Vec::new();
    for text in differences.map(Difference::text) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    let more = texts.len().saturating_sub(3);
    texts.truncate(3);
    let text = texts.join("; ");
    match more {
        0 if text.is_empty() => None,
        0 => Some(text),
        more => Some(format!("{text}; and {more} more")),
    }
}

/// Collects the values that differ, with their keys; values other than tables are compared as a whole.
fn compare(path: &mut Vec<String>, before: &Value, after: &Value, found: &mut Vec<Difference>) {
    match (before, after) {
        (Value::Object(a), Value::Object(b)) => {
            let new = b.keys().filter(|key| !a.contains_key(*key));
            for key in a.keys().chain(new) {
                path.push(key.clone());
                compare(path, a.get(key).unwrap_or(&Value::Null), b.get(key).unwrap_or(&Value::Null), found);
                path.pop();
            }
        }
        // A missing table is compared as an empty one.
        (Value::Object(_), Value::Null) => compare(path, before, &Value::Object(serde_json::Map::default()), found),
        (Value::Null, Value::Object(_)) => compare(path, &Value::Object(serde_json::Map::default()), after, found),
        _ if before == after => {}
        _ => found.push(Difference { path: path.clone(), before: short(before), after: short(after) }),
    }
}

/// Formats a value for an error message, shortened to 60 characters.
fn short(value: &Value) -> String {
    match value {
        Value::Null => "absent".to_owned(),
        other => {
            let text = other.to_string();
            match text.char_indices().nth(60) {
                Some((end, _)) => format!("{}...", &text[..end]),
                None => text,
            }
        }
    }
}
