//! Runs of `mops` on the text of a study, and values of their criteria.

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

#[path = "result.rs"]
mod result;

/// Runs a study in a folder and returns its result.
pub fn run(folder: &Path, text: &str) -> Value {
    let study = folder.join("study.toml");
    std::fs::write(&study, text).unwrap();
    let out = folder.join("out");
    let output = cargo_bin_cmd!("mops")
        .args(["run", study.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    result::read(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}\n{text}", String::from_utf8_lossy(&output.stderr)))
}

/// Returns the value of a criterion in a case.
pub fn value(result: &Value, case: &str, criterion: &str) -> f64 {
    let all = result["criteria"].as_array().unwrap();
    let found = all.iter().find(|c| c["case"] == case && c["name"] == criterion);
    found.unwrap_or_else(|| panic!("no {case}/{criterion}: {result}"))["value"].as_f64().unwrap()
}
