//! Cases of a study file.

use mops_core::case::Input;
use mops_core::study::{CaseBuilder, ModelBuilder};
use mops_language::files::Files;
use mops_language::{Diagnostic, Quantity};

use crate::columns::entry;
use crate::inputs::Reader;
use crate::reading::read_seconds;
use crate::sections::CaseOptions;
use crate::tree::Node;

/// Largest number of cases of a grid.
const MOST_CASES: usize = 1000;

/// Reads the cases of a table: one, or one for every combination of the values in its `grid`.
pub(crate) fn read_cases(
    name: &str,
    node: &Node<'_>,
    models: &[(String, ModelBuilder)],
    files: &dyn Files,
) -> Result<Vec<CaseBuilder>, Diagnostic> {
    let entries = node.entries()?;
    let options: CaseOptions = node.only(CaseOptions::KEYS).read()?;
    let mut parameters = Vec::new();
    for (key, value) in entries {
        if !CaseOptions::KEYS.contains(&key.as_str()) {
            parameters.push((key, value.read::<Quantity>()?));
        }
    }
    let horizon = read_seconds(node, "horizon", options.horizon.as_ref())?;
    let interfaces = || models.iter().map(|(_, draft)| draft.model.interface());
    let longest = interfaces().filter_map(|interface| interface.horizon).reduce(f64::max);
    let until = horizon.or(longest);
    let mut inputs = Vec::new();
    for (name, section) in &options.inputs.0 {
        let known = interfaces().flat_map(|interface| &interface.inputs).find(|v| v.name == *name);
        let input = match known {
            Some(v) => Reader { unit: &v.unit, until, files }.read(section, &entry(node, "inputs", name))?,
            // Rejected when the study is built.
            None => Input::Constant(0.0),
        };
        inputs.push((name.clone(), input, None));
    }
    let one = CaseBuilder { name: name.to_owned(), parameters, inputs, horizon, ..CaseBuilder::default() };
    let mut cases = vec![one];
    for (parameter, values) in &options.grid.0 {
        let place = entry(node, "grid", parameter);
        if values.is_empty() {
            return Err(place.diagnostic(format!("`{parameter}` has no values")).with_help("list at least one"));
        }
        if cases[0].parameters.iter().any(|(known, _)| known == parameter) {
            let fact = format!("`{parameter}` is given twice, in the case and in its `grid`");
            return Err(place.key_diagnostic(fact).with_help("remove one of them"));
        }
        if cases.len() * values.len() > MOST_CASES {
            let fact = format!("the grid has more than {MOST_CASES} cases");
            return Err(place.key_diagnostic(fact).with_help("list fewer values"));
        }
        let with = |case: &CaseBuilder, value: &Quantity| {
            let unit = value.unit.as_ref().map(|unit| unit.to_string().replace(' ', "")).unwrap_or_default();
            let mut case = case.clone();
            case.name += &format!("-{parameter}={}{unit}", value.number);
            case.parameters.push((parameter.clone(), value.clone()));
            case
        };
        cases = cases.iter().flat_map(|case| values.iter().map(|value| with(case, value))).collect();
    }
    Ok(cases)
}
