//! Candidates: every effect of the catalogue at every place that it fits, and the values of its parameters that are
//! tried first.

mod candidate;
mod sizes;

pub(crate) use candidate::{Candidate, candidates, numbered};
pub(crate) use sizes::Sizes;
