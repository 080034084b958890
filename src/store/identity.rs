//! What a study says, and which of it determines the values of points.

use mops_core::Study;
use mops_core::file::StudyFile;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Which study a run was for: two runs with the same one are the same run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Identity {
    /// Version of the program: another one may compute other values.
    mops: String,
    /// What the study file says, settings included.
    study: Value,
    /// Data files, with a digest of their bytes.
    data: Vec<(String, String)>,
    /// Names of the tuners, in their order.
    tuners: Vec<String>,
    /// Names of the rows, in their order.
    rows: Vec<String>,
    /// Names and units of the uncertain parameters, in their order.
    uncertain: Vec<String>,
    /// The solver of the run.
    solver: String,
    /// The seed of the run.
    seed: u64,
}

/// Where two studies differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Difference {
    /// Keys from the study down.
    path: Vec<String>,
    before: String,
    after: String,
}

/// What a difference means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    /// The values of points may be others.
    Values,
    /// Points have the same values, and the solver takes another way among them.
    Way,
    /// How long the run may be.
    Budget,
}

impl Identity {
    /// Of a study that is about to be run.
    pub fn of(file: &StudyFile, study: &Study, solver: &str) -> Self {
        Self {
            mops: env!("CARGO_PKG_VERSION").to_owned(),
            study: file.content.clone(),
            data: file.data.clone(),
            tuners: study.tuners().iter().map(|tuner| tuner.name.clone()).collect(),
            rows: study.rows().iter().map(|row| study.key(row)).collect(),
            uncertain: study.tasks().uncertain.iter().map(|u| format!("{}[{}]", u.name, u.unit)).collect(),
            solver: solver.to_owned(),
            seed: study.seed(),
        }
    }

    /// What keeps a run of `self` from being continued as one of `now`, in words.
    pub fn refuses_to_continue(&self, now: &Self) -> Option<String> {
        told(self.differences(now).iter().filter(|d| d.meaning() != Meaning::Budget))
    }

    /// What makes the values of points in a run of `self` unfit for one of `now`, in words.
    pub fn refuses_to_reuse(&self, now: &Self) -> Option<String> {
        told(self.differences(now).iter().filter(|d| d.meaning() == Meaning::Values))
    }

    /// Whether the coordinates of the unit box mean the same, so that derivatives do.
    pub fn has_coordinates_of(&self, now: &Self) -> bool {
        let of = |identity: &Self, table: &str| identity.study.get(table).cloned();
        ["tuners", "cases", "experiments"].iter().all(|table| of(self, table) == of(now, table))
    }

    /// Whether values of the uncertain parameters mean the same.
    pub fn has_uncertain_of(&self, now: &Self) -> bool {
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
            ["study", "models" | "cases", ..] | ["mops" | "data" | "rows", ..] => Meaning::Values,
            ["tuners", ..] => Meaning::Values,
            ["study", "experiments", _, "role"] => Meaning::Way,
            ["study", "experiments", ..] => Meaning::Values,
            ["study", "criteria", _, "usage" | "demand" | "good" | "bad" | "weight"] => Meaning::Way,
            ["study", "criteria", ..] => Meaning::Values,
            ["study", "tuners", _, "start" | "min" | "max" | "scale" | "integer" | "values" | "active"] => Meaning::Way,
            ["study", "tuners", ..] => Meaning::Values,
            _ => Meaning::Way,
        }
    }

    fn text(&self) -> String {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        let name = match path.as_slice() {
            ["study", rest @ ..] => rest.join("."),
            ["data", ..] => return "a data file is another".to_owned(),
            ["tuners", ..] => return "the tuners are others".to_owned(),
            ["rows", ..] => return "the criteria are others".to_owned(),
            ["uncertain", ..] => return "the uncertain parameters are others".to_owned(),
            ["mops"] => "the version of mops".to_owned(),
            _ => path.join("."),
        };
        format!("`{name}` was {} and is {}", self.before, self.after)
    }
}

/// The first differences in one sentence.
fn told<'d>(differences: impl Iterator<Item = &'d Difference>) -> Option<String> {
    let mut texts: Vec<String> = Vec::new();
    for text in differences.map(Difference::text) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    let more = texts.len().saturating_sub(3);
    texts.truncate(3);
    let told = texts.join("; ");
    match more {
        0 if told.is_empty() => None,
        0 => Some(told),
        more => Some(format!("{told}; and {more} more")),
    }
}

/// Values that differ, with the keys that lead to them; values that are no table differ as a whole.
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
        // A table that was written short, or not at all, is compared key by key all the same.
        (Value::Object(_), Value::Null) => compare(path, before, &Value::Object(serde_json::Map::default()), found),
        (Value::Null, Value::Object(_)) => compare(path, &Value::Object(serde_json::Map::default()), after, found),
        _ if before == after => {}
        _ => found.push(Difference { path: path.clone(), before: short(before), after: short(after) }),
    }
}

/// A value in an error message.
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
