//! Ranges: every number of a study is checked at both ends. The test walks the schema of study files.

use std::collections::{BTreeMap, BTreeSet};

use mops::{
    core::{Catalogue, Problem},
    file,
    language::{Diagnostic, files::Folder},
};
use serde_json::Value;
use toml::Value as Toml;

/// Studies that together set every number of the schema.
const STUDIES: [&str; 3] = ["loops", "equations", "recordings"];

/// Ends of paths without a limit: any finite number has a meaning, or the largest is limited by time and memory alone.
/// `+` stands for no largest value, `-` for no smallest one.
const UNLIMITED: &[(&str, &str)] = &[
    // Numbers of a plant, a case or a formula.
    ("models.*.parameters.*", "+-"),
    ("experiments.*.parameters.*", "+-"),
    ("cases.*.*", "+-"),
    ("grid.*.#", "+-"),
    ("linearise.at.*", "+-"),
    ("poles.#", "+-"),
    ("zeros.#", "+-"),
    ("gain", "+-"),
    ("numerator.#", "+-"),
    ("denominator.#", "+-"),
    ("a.#.#", "+-"),
    ("b.#", "+-"),
    ("b.#.#", "+-"),
    ("c.#", "+-"),
    ("c.#.#", "+-"),
    ("d.#.#", "+-"),
    ("constants.*", "+-"),
    ("let.*", "+-"),
    ("der.*", "+-"),
    ("start.*", "+-"),
    ("outputs.*.value", "+-"),
    ("reset.*", "+-"),
    ("at-rest.*", "+-"),
    ("x.#", "+-"),
    ("y.#", "+-"),
    ("z.#.#", "+-"),
    ("friction.*.coulomb", "+"),
    ("friction.*.viscous", "+-"),
    ("friction.*.peak", "+"),
    ("states.*.scale", "+"),
    ("parameters.*.default", "+-"),
    ("parameters.*.min", "-"),
    ("parameters.*.max", "+"),
    // Controllers.
    ("setpoint", "+-"),
    ("wp", "+-"),
    ("wd", "+-"),
    ("feedforward", "+-"),
    ("limit.#", "+-"),
    ("Ti", "+"),
    ("Td", "+"),
    ("Nd", "+"),
    ("Tt", "+"),
    ("every", "+"),
    ("clocks.*.offset", "+"),
    ("pid-loop.sample-time", "+"),
    ("pid-loop.setpoint.time", "+"),
    ("pid-loop.setpoint.size", "+-"),
    ("pid-loop.load.time", "+"),
    ("pid-loop.load.size", "+-"),
    // The effort of a simulation or a search.
    ("horizon", "+"),
    ("delay", "+"),
    ("max-step", "+"),
    ("max-steps", "+"),
    ("max-evaluations", "+"),
    ("max-iterations", "+"),
    ("patience", "+"),
    ("restarts", "+"),
    ("generations", "+"),
    ("seed", "+"),
    // Inputs over time: what is before or after the simulation counts as far as it reaches.
    ("inputs.*", "+-"),
    ("constant", "+-"),
    ("before", "+-"),
    ("after", "+-"),
    ("pulse.value", "+-"),
    ("amplitude", "+-"),
    ("sine.offset", "+-"),
    ("doublet.offset", "+-"),
    ("multisine.offset", "+-"),
    ("chirp.offset", "+-"),
    ("prbs.offset", "+-"),
    ("file.offset", "+-"),
    ("inputs.*.step.time", "+-"),
    ("inputs.*.ramp.time", "+-"),
    ("inputs.*.ramp.duration", "+"),
    ("inputs.*.pulse.time", "+-"),
    ("inputs.*.pulse.period", "+"),
    ("inputs.*.doublet.time", "+-"),
    ("inputs.*.doublet.width", "+"),
    ("inputs.*.sine.frequency", "+"),
    ("inputs.*.sine.phase", "+-"),
    ("inputs.*.multisine.from", "+"),
    ("inputs.*.multisine.to", "+"),
    ("inputs.*.chirp.from", "+"),
    ("inputs.*.chirp.to", "+"),
    ("inputs.*.chirp.time", "+-"),
    ("inputs.*.chirp.duration", "+"),
    ("inputs.*.prbs.interval", "+"),
    ("inputs.*.prbs.time", "+-"),
    ("inputs.*.table.time.#", "+-"),
    ("inputs.*.table.value.#", "+-"),
    ("inputs.*.file.shift", "+"),
    // Recordings: the part of a file that there is.
    ("scale", "+-"),
    ("channels.*.offset", "+-"),
    ("inputs.*.offset", "+-"),
    ("channels.*.shift", "+"),
    ("noise", "+"),
    ("noise.*", "+"),
    ("experiments.*.from", "-"),
    ("experiments.*.to", "+"),
    ("free.*.min", "-"),
    ("free.*.max", "+"),
    // Bounds and demands.
    ("tuners.*.min", "-"),
    ("tuners.*.max", "+"),
    ("values.#", "+"),
    ("uncertain.*.min", "-"),
    ("uncertain.*.max", "+"),
    ("interval.#", "+-"),
    ("median", "+"),
    ("log-normal.deviation", "+"),
    ("demand", "+"),
    ("bad", "+"),
    ("weight", "+"),
    ("target", "+-"),
    ("overshoot.from", "+-"),
    ("undershoot.from", "+-"),
    ("settling-time.from", "+-"),
    ("rise-time.from", "+-"),
    ("delay-time.from", "+-"),
    ("model-tracking.from", "+-"),
    ("settling-time.band", "+"),
    ("time-constant", "+"),
    ("frequency", "+"),
    ("damping", "+"),
    ("control-effort.offset", "+-"),
    ("upper.#.#", "+-"),
    ("lower.#.#", "+-"),
    ("skew", "+-"),
    // Compared with the records or the tuners when the task runs.
    ("uncertainty.block", "+"),
    ("uncertainty.bootstrap", "+"),
    ("excitation.parameters", "+"),
    ("excitation.sample-time", "+"),
    ("excitation.regressions.*.delay", "+"),
];

/// Ends of paths at which infinity has a meaning, too: `i`, and `j` for minus infinity.
const INFINITE: &[(&str, &str)] = &[
    ("criteria.*.until", "i"),
    ("experiments.*.from", "j"),
    ("experiments.*.to", "i"),
    ("limit.#", "ij"),
    ("parameters.*.min", "j"),
    ("parameters.*.max", "i"),
];

/// A number in the schema: path of keys, with `*` for names and `#` for elements, and true for an integer.
type Leaves = BTreeMap<Vec<String>, bool>;

/// Collects the numbers of a schema.
fn walk(schema: &Value, root: &Value, path: &mut Vec<String>, leaves: &mut Leaves) {
    let root = if schema.get("$defs").is_some() { schema } else { root };
    if let Some(name) = schema["$ref"].as_str() {
        let target = root.pointer(name.trim_start_matches('#')).expect("a reference has a target");
        // Lists of inputs contain inputs: once is enough.
        if path.len() < 12 {
            walk(target, root, path, leaves);
        }
        return;
    }
    let is = |name: &str| match &schema["type"] {
        Value::String(one) => one == name,
        Value::Array(several) => several.iter().any(|one| one == name),
        _ => false,
    };
    if is("number") || is("integer") {
        leaves.insert(path.clone(), !is("number"));
    }
    for choice in ["anyOf", "oneOf", "allOf"] {
        for alternative in schema[choice].as_array().into_iter().flatten() {
            walk(alternative, root, path, leaves);
        }
    }
    let mut below = |key: &str, schema: &Value| {
        path.push(key.to_owned());
        walk(schema, root, path, leaves);
        path.pop();
    };
    for (key, schema) in schema["properties"].as_object().into_iter().flatten() {
        below(key, schema);
    }
    if schema["additionalProperties"].is_object() {
        below("*", &schema["additionalProperties"]);
    }
    if schema["items"].is_object() {
        below("#", &schema["items"]);
    }
    for element in schema["prefixItems"].as_array().into_iter().flatten() {
        below("#", element);
    }
}

/// Key of a table, or index of a list.
#[derive(Clone, Debug)]
enum Step {
    Key(String),
    Index(usize),
}

/// Collects the values of a study that are no tables and no lists.
fn values(of: &Toml, path: &mut Vec<Step>, found: &mut Vec<Vec<Step>>) {
    match of {
        Toml::Table(table) => {
            for (key, value) in table {
                path.push(Step::Key(key.clone()));
                values(value, path, found);
                path.pop();
            }
        }
        Toml::Array(list) => {
            for (index, value) in list.iter().enumerate() {
                path.push(Step::Index(index));
                values(value, path, found);
                path.pop();
            }
        }
        _ => found.push(path.clone()),
    }
}

/// Returns the leaf of the schema at a path: the one with the most keys of its own.
fn leaf<'l>(leaves: &'l Leaves, path: &[Step]) -> Option<(&'l Vec<String>, bool)> {
    let fits = |leaf: &&Vec<String>| {
        leaf.len() == path.len()
            && leaf.iter().zip(path).all(|(key, step)| match step {
                Step::Index(_) => key == "#",
                Step::Key(name) => key == "*" || key == name,
            })
    };
    let found = leaves.keys().filter(fits).min_by_key(|leaf| leaf.iter().filter(|key| *key == "*").count())?;
    Some((found, leaves[found]))
}

fn parsed(text: &str) -> Toml {
    Toml::Table(toml::from_str(text).unwrap())
}

fn at<'t>(of: &'t mut Toml, path: &[Step]) -> &'t mut Toml {
    path.iter().fold(of, |of, step| match step {
        Step::Key(key) => &mut of[key.as_str()],
        Step::Index(index) => &mut of[*index],
    })
}

/// Reads a study, and returns the mistake in it: one of the file, or the failure at the initial guess.
fn mistake(catalogue: &Catalogue, study: &Toml, folder: &Folder) -> Option<String> {
    let text = toml::to_string(study).unwrap();
    match file::read(catalogue, "study.toml", &text, &[], folder) {
        Err(Diagnostic { message, .. }) => Some(message),
        Ok(read) => {
            let problem = Problem::new(read.study.into());
            let evaluation = problem.evaluate_at(&problem.study().start());
            evaluation.failures.first().map(|(_, failure)| failure.to_string())
        }
    }
}

/// Returns the value with the number of a quantity replaced, in its unit; `None` if it is a formula.
fn replaced(value: &Toml, number: &str) -> Option<Toml> {
    let plain = |number: &str| {
        number.parse::<i64>().map(Toml::Integer).unwrap_or_else(|_| Toml::Float(number.parse().unwrap()))
    };
    match value {
        Toml::Integer(_) | Toml::Float(_) => Some(plain(number)),
        Toml::String(text) => {
            let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))).unwrap_or(text.len());
            (end > 0).then(|| Toml::String(format!("{number}{}", &text[end..])))
        }
        _ => None,
    }
}

/// Returns the numbers of the schema, without those of elements of sums of inputs, which are inputs.
fn numbers(catalogue: &Catalogue) -> Leaves {
    let mut leaves = Leaves::new();
    let schema = file::study_schema(catalogue);
    walk(&schema, &schema, &mut Vec::new(), &mut leaves);
    leaves.retain(|path, _| !path.join(".").contains("inputs.*.#"));
    leaves
}

/// Returns the studies of this test: those of the files, and one for each number of a solver, which has a default.
fn studies(leaves: &Leaves) -> Vec<Toml> {
    let mut studies: Vec<Toml> = STUDIES
        .iter()
        .map(|name| parsed(&std::fs::read_to_string(format!("tests/ranges/{name}.toml")).unwrap()))
        .collect();
    for path in leaves.keys().filter(|path| path.len() == 3 && path[0] == "solver") {
        let mut study = parsed(
            "[study]\nname = 's'\n[models.m.transfer-function]\nnumerator = ['k']\ndenominator = [1, 1]\n\
             [tuners]\nk = { start = 1, min = 0, max = 2 }\n[criteria]\nc = { hinf-norm = {}, demand = 1 }\n",
        );
        let solver = parsed(&format!("[{}]\n{} = 1\n", path[1], path[2]));
        study.as_table_mut().unwrap().insert("solver".to_owned(), solver);
        studies.push(study);
    }
    studies
}

#[test]
fn every_number_of_the_schema_is_set_in_a_study_of_this_test() {
    let leaves = numbers(&mops::catalogue());
    let mut missing: BTreeSet<&Vec<String>> = leaves.keys().collect();
    for study in studies(&leaves) {
        let mut all = Vec::new();
        values(&study, &mut Vec::new(), &mut all);
        for path in all {
            leaf(&leaves, &path).map(|(found, _)| missing.remove(found));
        }
    }
    let missing: Vec<String> = missing.iter().map(|path| path.join(".")).collect();
    assert!(missing.is_empty(), "set these in tests/ranges/*.toml: {missing:#?}");
}

/// Returns true if a list has an entry that ends the path, with this sign.
fn is_listed(list: &[(&str, &str)], path: &[String], sign: char) -> bool {
    list.iter().any(|(pattern, signs)| {
        let keys: Vec<&str> = pattern.split('.').collect();
        let ends = path.len() >= keys.len() && keys.iter().rev().zip(path.iter().rev()).all(|(a, b)| a == b);
        ends && signs.contains(sign)
    })
}

#[test]
#[ignore = "full tier"]
fn every_number_of_a_study_is_checked_at_both_ends() {
    let catalogue = mops::catalogue();
    let leaves = numbers(&catalogue);
    let folder = Folder::new("tests/ranges");
    let mut accepted = BTreeSet::new();
    for study in studies(&leaves) {
        let mut all = Vec::new();
        values(&study, &mut Vec::new(), &mut all);
        for path in all {
            let Some((leaf, is_integer)) = leaf(&leaves, &path) else { continue };
            let tried: &[(&str, char)] = if is_integer {
                &[("-1", '-'), ("9000000000000000000", '+')]
            } else {
                &[("nan", 'n'), ("inf", 'i'), ("-inf", 'j'), ("1e300", '+'), ("-1e300", '-')]
            };
            for &(number, sign) in tried {
                let mut changed = study.clone();
                let place = at(&mut changed, &path);
                let Some(value) = replaced(place, number) else { continue };
                *place = value;
                let list = if "ij".contains(sign) { INFINITE } else { UNLIMITED };
                if !is_listed(list, leaf, sign) && mistake(&catalogue, &changed, &folder).is_none() {
                    accepted.insert(format!("{} {number}", leaf.join(".")));
                }
            }
        }
    }
    assert!(accepted.is_empty(), "neither refused nor listed as unlimited: {accepted:#?}");
}

#[test]
fn the_studies_of_this_test_are_valid() {
    for name in STUDIES {
        let text = std::fs::read_to_string(format!("tests/ranges/{name}.toml")).unwrap();
        let read = file::read(&mops::catalogue(), name, &text, &[], &Folder::new("tests/ranges"));
        assert!(read.is_ok(), "{}", read.err().unwrap());
    }
}
