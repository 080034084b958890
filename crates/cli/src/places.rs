//! Places of a model where effects can act, in one line.

use mops_core::Interface;

use super::families::{runs, spelled};

/// Lists the places of a model, with families merged; empty if there are none.
pub(super) fn places(model: &Interface) -> String {
    let names: Vec<String> = model.places().map(ToString::to_string).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let merged = runs(&names).into_iter().map(|run| spelled(names[run.start], names[run.end - 1]));
    merged.collect::<Vec<_>>().join(", ")
}
