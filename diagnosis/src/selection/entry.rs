//! Class and place of an effect: what is claimed or proposed.

use super::fitted_set::Key;
use super::sets::FittedSets;
use crate::candidates::Candidate;

/// Class of effects at a place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Class, or `disturbance`.
    pub class: String,
    /// Place.
    pub place: String,
}

/// Returns classes and places of the effects of a set, each once.
pub fn entries_of(sets: &FittedSets<'_, '_>, key: &Key) -> Vec<Entry> {
    let mut entries: Vec<Entry> = key.iter().map(|&k| entry(sets, &sets.refit.candidates[k])).collect();
    entries.sort();
    entries.dedup();
    entries
}

/// Returns class and place of a candidate; what happens once in one record is a disturbance of that record.
pub fn entry(sets: &FittedSets<'_, '_>, candidate: &Candidate) -> Entry {
    let class = match candidate.only {
        Some(only) => format!("disturbance in {}", sets.refit.subject.measurements[only].name),
        None => candidate.effect.class().name().to_owned(),
    };
    Entry { class, place: candidate.places() }
}
