//! What is claimed: the first set that the evidence and a forecast support, by class and place, and what remains.

use std::collections::BTreeMap;

use mops_core::math;

use super::fitted_set::Key;
use super::forecast::Forecasts;
use super::search::Search;
use crate::candidate::Candidate;
use crate::estimation::ErrorModel;
use mops_core::diagnosis::Dependence;

/// Class of effects at a place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Class, or `disturbance`.
    pub class: String,
    /// Place.
    pub place: String,
}

/// Conclusion on the declared model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conclusion {
    /// Effects are missing; class and place of at least one of them are claimed.
    Effect,
    /// Something is missing that no set of effects explains well enough.
    Unexplained,
    /// Nothing is missing that the records show.
    None,
}

/// Class and place of an effect of the set, with their posterior probability.
#[derive(Debug, Clone)]
pub struct Stated {
    /// Class and place.
    pub entry: Entry,
    /// Posterior probability, with a share for what is in no catalogue.
    pub probability: f64,
    /// True if the probability suffices for a claim; otherwise the effect is a proposal.
    pub is_claimed: bool,
}

/// Result of a selection.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The first set that passed; empty for the declared model.
    pub set: Key,
    /// Sets that passed, with their posterior probabilities.
    pub passed: Vec<(Key, f64)>,
    /// True if a free curve on top of the set shows that most remains.
    pub is_refused_by_curve: bool,
    /// Conclusion.
    pub conclusion: Conclusion,
    /// Class and place of the effects of the set.
    pub stated: Vec<Stated>,
    /// Posterior probability of the declared model.
    pub nothing: f64,
    /// True if the set is the one of highest evidence.
    pub is_first: bool,
    /// Curves on the declared model, that with the largest gain first, under its likeliest error model, and under the smooth
    /// output error.
    pub declared: [Vec<Dependence>; 2],
    /// Curves on top of the set under its likeliest error model, that with the largest gain first; none without a set.
    pub remaining: Vec<Dependence>,
    /// Share of the error of the forecast above noise that the set removes.
    pub share: Option<f64>,
    /// Gain of correlated errors over white noise of fitted size in log-likelihood at the declared model, nats.
    pub lack_of_fit: f64,
    /// Largest root mean square error of a calibration record at the declared model, in noises.
    pub largest_error: f64,
}

/// Gain of a curve in nats from which it fires.
pub const FIRES: f64 = 6.0;

/// Share of the gain of the set up to which a curve is small.
const SMALL: f64 = 0.3;

/// Share of the forecast error that a set must remove where a curve on top of it fires.
const MOST: f64 = 0.8;

/// Posterior probability from which class and place are claimed, and the largest one that is reported if the set of highest
/// evidence did not pass.
const CLAIMED: f64 = 0.9;

/// Error of a record, in noises, above which a significant lack of fit matters.
const MATTERS: f64 = 1.1;

/// Shares and probability that a set must have where only the ends of the calibration records are forecast.
const RUN_ON: f64 = 0.8;

/// Logarithm of the probability relative to the first set that passed below which a set does not count: less than 1 %.
const NEGLIGIBLE: f64 = 5.0;

/// Probability that none of the candidates is right.
pub const OTHER: f64 = 0.05;

/// Decides on the sets of a search.
pub fn decide(search: &mut Search<'_, '_>, forecasts: &mut Forecasts) -> Verdict {
    let nothing = Key::new();
    let declared = search.log_posterior(search.get(&nothing).expect("it was fitted first"));
    let candidates: Vec<Key> = {
        let sets = search.sets.iter().filter(|set| !set.key.is_empty());
        sets.filter(|set| !search.is_inert(set) && !search.is_degenerate(set)).map(|set| set.key.clone()).collect()
    };
    // What is less probable than the declared model is not chosen, but counts for the probabilities.
    let first = candidates.first().filter(|key| search.get(key).is_some_and(|set| search.log_posterior(set) > declared));
    let first = first.cloned();
    let mut passed: Vec<Key> = Vec::new();
    let mut least = f64::NEG_INFINITY;
    for key in &candidates {
        let posterior = search.get(key).map_or(f64::NEG_INFINITY, |set| search.log_posterior(set));
        if posterior < least || posterior <= declared && passed.is_empty() {
            break;
        }
        if forecasts.passes(search, key) {
            least = least.max(posterior - NEGLIGIBLE);
            passed.push(key.clone());
        }
    }
    let set = passed.first().cloned().unwrap_or_default();
    // Posterior over the declared model and all sets that passed.
    let log = |key: &Key| search.get(key).map_or(f64::NEG_INFINITY, |set| search.log_posterior(set));
    let most = passed.iter().map(log).fold(declared, f64::max);
    let weight = |log: f64| math::exp(log - most);
    let total: f64 = weight(declared) + passed.iter().map(|key| weight(log(key))).sum::<f64>();
    let mut by_entry: BTreeMap<Entry, f64> = BTreeMap::new();
    for key in &passed {
        let mut entries: Vec<Entry> = key.iter().map(|&k| entry(search, &search.refit.candidates[k])).collect();
        entries.sort();
        entries.dedup();
        for entry in entries {
            *by_entry.entry(entry).or_default() += weight(log(key)) / total;
        }
    }
    let nothing_probability = weight(declared) / total;
    let weights: Vec<(Key, f64)> = passed.iter().map(|key| (key.clone(), weight(log(key)) / total)).collect();
    let mut entries: Vec<Entry> = set.iter().map(|&k| entry(search, &search.refit.candidates[k])).collect();
    entries.sort();
    entries.dedup();
    let probability = |entry: &Entry| by_entry.get(entry).copied().unwrap_or(0.0);
    let entries: Vec<(Entry, f64)> = entries.into_iter().map(|e| (e.clone(), probability(&e))).collect();
    let is_first = first.is_some_and(|first| !set.is_empty() && first.iter().all(|k| set.contains(k)));
    let curves = |key: &Key, kind: Option<ErrorModel>| {
        let set = search.get(key)?;
        let estimate = kind.map_or_else(|| set.likeliest().map(|(_, estimate)| estimate), |kind| set.estimate(kind))?;
        set.estimation(&search.refit.nominal).curves(estimate)
    };
    let on_declared = [None, Some(ErrorModel::SmoothOutput)].map(|kind| curves(&nothing, kind).unwrap_or_default());
    let remaining = if set.is_empty() { Vec::new() } else { curves(&set, None).unwrap_or_default() };
    let share = if set.is_empty() { None } else { forecasts.share_of_declared(search, &set) };
    let gained = || {
        let log = |key: &Key| search.get(key).and_then(|set| set.likeliest()).map_or(0.0, |l| l.1.log_likelihood);
        log(&set) - log(&nothing)
    };
    let fires = remaining.first().is_some_and(|curve| curve.gain >= FIRES && curve.gain >= SMALL * gained());
    let explains = !fires || share.is_some_and(|share| share >= MOST);
    let least = if forecasts.are_of_other_records() { CLAIMED } else { RUN_ON };
    let most = if is_first { 1.0 } else { CLAIMED };
    let state = |(entry, probability): (Entry, f64)| Stated {
        is_claimed: probability >= least,
        probability: (probability * (1.0 - OTHER)).min(most),
        entry,
    };
    let stated: Vec<Stated> = entries.into_iter().map(state).collect();
    let is_supported = forecasts.are_of_other_records()
        || is_first && forecasts.share(search, &set).is_some_and(|share| share >= RUN_ON);
    let is_effect = explains && is_supported && stated.iter().any(|stated| stated.is_claimed);
    let declared_model = search.get(&nothing).expect("it was fitted first");
    let lack_of_fit = declared_model.lack_of_fit().unwrap_or(f64::INFINITY);
    let largest_error = declared_model.largest_error().unwrap_or(f64::INFINITY);
    let conclusion = if is_effect {
        Conclusion::Effect
    } else if lack_of_fit > search.significant && largest_error > MATTERS {
        Conclusion::Unexplained
    } else {
        Conclusion::None
    };
    Verdict {
        conclusion,
        stated,
        nothing: nothing_probability,
        is_refused_by_curve: !explains,
        passed: weights,
        set,
        is_first,
        declared: on_declared,
        remaining,
        share,
        lack_of_fit,
        largest_error,
    }
}

/// Returns class and place of a candidate; what happens once in one record is a disturbance of that record.
pub fn entry(search: &Search<'_, '_>, candidate: &Candidate) -> Entry {
    let class = match candidate.only {
        Some(only) => format!("disturbance in {}", search.refit.subject.measurements[only].name),
        None => candidate.effect.class().name().to_owned(),
    };
    Entry { class, place: candidate.place() }
}
