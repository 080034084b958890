//! Solver of a study file.

use mops_core::catalogue::{Catalogue, SolverChoice, schema_once};
use mops_language::Diagnostic;

use crate::reading::kind;
use crate::sections::SolverCommon;
use crate::tree::Node;

pub(crate) fn read_solver(catalogue: &Catalogue, root: &Node<'_>) -> Result<(SolverChoice, Option<usize>), Diagnostic> {
    let default = || catalogue.solvers.first().expect("a catalogue has a solver").default_choice();
    let Some(node) = root.child("solver") else { return Ok((default(), None)) };
    let common: SolverCommon = node.only(SolverCommon::KEYS).read()?;
    if common.max_evaluations == Some(0) {
        let place = node.child("max-evaluations").expect("it was read");
        return Err(place
            .diagnostic("expected at least 1 evaluation, found 0".to_owned())
            .with_help("omit `max-evaluations` for the default"));
    }
    if node.entries()?.iter().all(|(key, _)| SolverCommon::KEYS.contains(&key.as_str())) {
        return Ok((default(), common.max_evaluations));
    }
    let (kind, options) = kind(&node, SolverCommon::KEYS, &catalogue.solvers, |k| k.name, "solver")?;
    Ok((options.read_with(&schema_once(kind.schema), kind.read)?, common.max_evaluations))
}
