//! What is claimed: the first set that the evidence and a forecast support, by class and place, and what remains.

use std::collections::BTreeMap;

use mops_core::math;

use super::fitted_set::Key;
use super::forecast::Forecasts;
use super::search::Search;
use crate::candidate::Candidate;
use crate::estimation::{ErrorModel, FreeCurve};

/// Class of effects at a place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Class, or `disturbance`.
    pub class: String,
    /// Place.
    pub place: String,
}

/// Result of a selection.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The first set that passed; empty for the declared model.
    pub set: Key,
    /// True if the effects of the set are claimed to be missing in the declared model.
    pub is_effect: bool,
    /// Class and place of its effects with the posterior probability of each.
    pub entries: Vec<(Entry, f64)>,
    /// Posterior probability of the declared model.
    pub nothing: f64,
    /// True if the set is the one of highest evidence.
    pub is_first: bool,
    /// Curve on the declared model with the largest gain, under its likeliest error model, and under the smooth output error.
    pub declared: [Option<FreeCurve>; 2],
    /// Curve on top of the set with the largest gain, under its likeliest error model.
    pub remaining: Option<FreeCurve>,
    /// Share of the error of the forecast above noise that the set removes.
    pub share: Option<f64>,
    /// Gain of correlated errors over white noise in log-likelihood at the declared model, nats.
    pub lack_of_fit: f64,
}

/// Gain of a curve in nats from which it fires.
const FIRES: f64 = 6.0;

/// Share of the gain of the set up to which a curve is small.
const SMALL: f64 = 0.3;

/// Share of the forecast error that a set must remove where a curve on top of it fires.
const MOST: f64 = 0.8;

/// Shares and probability that a set must have where only the ends of the calibration records are forecast.
const RUN_ON: f64 = 0.8;

/// Logarithm of the probability relative to the first set that passed below which a set does not count.
const NEGLIGIBLE: f64 = 8.0;

/// Probability that none of the candidates is right.
const OTHER: f64 = 0.05;

/// Decides on the sets of a search.
pub fn decide(search: &mut Search<'_, '_>, forecasts: &mut Forecasts) -> Verdict {
    let nothing = Key::new();
    let declared = search.log_posterior(search.get(&nothing).expect("it was fitted first"));
    let above: Vec<Key> = {
        let sets = search.sets.iter().filter(|set| !set.key.is_empty() && search.log_posterior(set) > declared);
        sets.filter(|set| !search.is_inert(set)).map(|set| set.key.clone()).collect()
    };
    let mut passed: Vec<Key> = Vec::new();
    let mut least = f64::NEG_INFINITY;
    for key in &above {
        let posterior = search.get(key).map_or(f64::NEG_INFINITY, |set| search.log_posterior(set));
        if posterior < least {
            break;
        }
        if forecasts.passes(search, key) {
            least = least.max(posterior - NEGLIGIBLE);
            passed.push(key.clone());
        }
    }
    let set = passed.first().cloned().unwrap_or_default();
    // Posterior over the declared model and all sets that passed.
    let weight =
        |key: &Key| math::exp(search.get(key).map_or(f64::NEG_INFINITY, |set| search.log_posterior(set)) - declared);
    let total: f64 = 1.0 + passed.iter().map(weight).sum::<f64>();
    let mut by_entry: BTreeMap<Entry, f64> = BTreeMap::new();
    for key in &passed {
        let mut entries: Vec<Entry> = key.iter().map(|&k| entry(search, &search.refit.candidates[k])).collect();
        entries.sort();
        entries.dedup();
        for entry in entries {
            *by_entry.entry(entry).or_default() += weight(key) / total;
        }
    }
    let mut entries: Vec<Entry> = set.iter().map(|&k| entry(search, &search.refit.candidates[k])).collect();
    entries.sort();
    entries.dedup();
    let probability = |entry: &Entry| by_entry.get(entry).copied().unwrap_or(0.0);
    let entries: Vec<(Entry, f64)> = entries.into_iter().map(|e| (e.clone(), probability(&e))).collect();
    let is_first = above.first() == Some(&set)
        || above.first().is_some_and(|first| !set.is_empty() && first.iter().all(|k| set.contains(k)));
    let curves = |key: &Key, kind: Option<ErrorModel>| {
        let set = search.get(key)?;
        let estimate = kind.map_or_else(|| set.likeliest().map(|(_, estimate)| estimate), |kind| set.estimate(kind))?;
        set.estimation(&search.refit.nominal).curves(estimate)?.into_iter().next()
    };
    let on_declared = [curves(&nothing, None), curves(&nothing, Some(ErrorModel::SmoothOutput))];
    let remaining = if set.is_empty() { None } else { curves(&set, None) };
    let share = if set.is_empty() { None } else { forecasts.share_of_declared(search, &set) };
    let gained = || {
        let log = |key: &Key| search.get(key).and_then(|set| set.likeliest()).map_or(0.0, |l| l.1.log_likelihood);
        log(&set) - log(&nothing)
    };
    let fires = remaining.as_ref().is_some_and(|curve| curve.gain >= FIRES && curve.gain >= SMALL * gained());
    let explains = !fires || share.is_some_and(|share| share >= MOST);
    let is_claimed = if forecasts.are_of_other_records() {
        true
    } else {
        is_first
            && forecasts.share(search, &set).is_some_and(|share| share >= RUN_ON)
            && entries.iter().any(|(_, probability)| *probability >= RUN_ON)
    };
    let white = search.get(&nothing).map_or(0.0, |set| set.least_squares.log_likelihood);
    let correlated = search.get(&nothing).and_then(|set| set.likeliest()).map_or(white, |l| l.1.log_likelihood);
    Verdict {
        is_effect: !set.is_empty() && explains && is_claimed,
        entries: entries.into_iter().map(|(entry, p)| (entry, p * (1.0 - OTHER))).collect(),
        nothing: 1.0 / total,
        set,
        is_first,
        declared: on_declared,
        remaining,
        share,
        lack_of_fit: correlated - white,
    }
}

/// Returns class and place of a candidate; what happens once in one record is a disturbance of that record.
fn entry(search: &Search<'_, '_>, candidate: &Candidate) -> Entry {
    let class = match candidate.only {
        Some(only) => format!("disturbance in {}", search.refit.subject.measurements[only].name),
        None => candidate.effect.class().name().to_owned(),
    };
    Entry { class, place: candidate.place() }
}
