//! The places of a model where effects may act, in one line.

use mops_core::Interface;

use super::families::{runs, spelled};

/// The names of the places, families as one; empty where there are none.
pub(super) fn places(model: &Interface) -> String {
    let names: Vec<String> = model.places().map(ToString::to_string).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let told = runs(&names).into_iter().map(|run| spelled(names[run.start], names[run.end - 1]));
    told.collect::<Vec<_>>().join(", ")
}
