//! What is claimed: the first set that the evidence and a forecast support, by class and place, and what remains.

use mops_core::Role;
use mops_math as math;
use mops_outcome::diagnosis::{Dependence, NamedBy};

use super::contradiction::{fitted_together, is_contradicted};
use super::entry::{Entry, entries_of, entry};
use super::fitted_set::{FittedSet, Key, STRONG, correlation, growth, largest};
use super::forecast::Forecasts;
use super::least_squares::{Proposal, by_least_squares, is_in_proportion};
use super::sets::FittedSets;
use crate::fit::dot;

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
    /// Classes and places of effects in its place that the records cannot distinguish from it.
    pub alike: Vec<Entry>,
    /// Posterior probability of the entry or one that is alike, with a share for what is in no catalogue; NaN where
    /// something else than it decides against a claim.
    pub probability: f64,
    /// True if class and place are claimed; otherwise the effect is a proposal.
    pub is_claimed: bool,
}

/// Result of a selection.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The set that is named; empty for the declared model.
    pub set: Key,
    /// What named it.
    pub named_by: NamedBy,
    /// True if wider ranges of declared parameters explain as much as the effects that would be named.
    pub is_range: bool,
    /// Sets with an effect that does nothing or is at a limit, and those that are simpler ones in all but name.
    pub excluded: Vec<Key>,
    /// Sets that passed, with their posterior probabilities; those that are simpler ones in all but name under the keys
    /// of these.
    pub passed: Vec<(Key, f64)>,
    /// True if selection records contradict what the set and its error model expect.
    pub is_contradicted: bool,
    /// True if most remains: a free curve on top of the set shows it, selection records contradict, or the set is not
    /// first.
    pub is_refused: bool,
    /// True if a free curve on top of the set fires: its effects are the best description of what is missing, no more.
    pub is_description: bool,
    /// Conclusion.
    pub conclusion: Conclusion,
    /// Class and place of the effects of the set.
    pub stated: Vec<Stated>,
    /// Posterior probability of the declared model.
    pub nothing: f64,
    /// True if the set is the one of highest evidence.
    pub is_first: bool,
    /// Curves on top of the set under its likeliest error model, that with the largest gain first; none without a set.
    pub remaining: Vec<Dependence>,
    /// Gain of correlated errors over white noise of fitted size in log-likelihood at the declared model on calibration
    /// records, nats.
    pub lack_of_fit: f64,
}

const SOME: f64 = 0.01;

/// Set that evidence names.
struct ByEvidence {
    set: Key,
    /// Sets that passed with their posterior probabilities, those that are simpler ones under the keys of these.
    weights: Vec<(Key, f64)>,
    /// Posterior probability of the declared model.
    nothing: f64,
    /// Sets that are simpler ones in all but name.
    aliases: Vec<Key>,
}

/// Names the first of the sets that passed, or a simpler one that says the same, and weighs them all.
fn by_evidence(sets: &FittedSets<'_, '_>, forecasts: &Forecasts) -> ByEvidence {
    let declared = sets.log_posterior(sets.declared());
    let mut passed = forecasts.passed.clone();
    // What is a simpler effect in all but name counts for that.
    let simpler = |key: &Key| sets.get(key).and_then(|set| sets.simpler(set));
    let mut named: Vec<Key> = passed.iter().map(|key| simpler(key).unwrap_or_else(|| key.clone())).collect();
    for (_, simpler) in &sets.aliases {
        if passed.contains(simpler) {
            named.push(simpler.clone());
            passed.push(simpler.clone());
        }
    }
    let set = simplest(sets, &named);
    // Posterior over the declared model and all sets that passed.
    let log = |key: &Key| sets.get(key).map_or(f64::NEG_INFINITY, |set| sets.log_posterior(set));
    let most = passed.iter().map(log).fold(declared, f64::max);
    let weight = |log: f64| math::exp(log - most);
    let total: f64 = weight(declared) + passed.iter().map(|key| weight(log(key))).sum::<f64>();
    let weights = passed.iter().zip(&named).map(|(key, named)| (named.clone(), weight(log(key)) / total)).collect();
    let aliases = passed.into_iter().zip(named).filter(|(a, b)| a != b).map(|(a, _)| a).collect();
    ByEvidence { set, weights, nothing: weight(declared) / total, aliases }
}

/// Decides which set is named, and what is claimed of it.
pub fn decide(sets: &FittedSets<'_, '_>, forecasts: &Forecasts) -> Verdict {
    let settings = sets.settings();
    let ByEvidence { set, weights, nothing, aliases } = by_evidence(sets, forecasts);
    // Where what evidence names leaves much, least squares is asked. It alone claims nothing.
    let is_in_proportion = is_in_proportion(sets, forecasts, &set);
    let proposal = if is_in_proportion { None } else { by_least_squares(sets, forecasts) };
    let is_agreed = |proposal: &Proposal| set.len() == 1 && entries_of(sets, &set).contains(&proposal.entry);
    let (set, named_by, alone) = match proposal {
        Some(proposal) if is_agreed(&proposal) => (proposal.set, NamedBy::Evidence, None),
        Some(proposal) => (proposal.set.clone(), NamedBy::LeastSquares, Some(proposal)),
        None => (set, NamedBy::Evidence, None),
    };
    // What wider ranges of declared parameters explain as well is no effect.
    let is_range = sets.get(&set).and_then(|set| sets.widened_for(set)).is_some()
        && (!set.is_empty() || sets.ranges_remove_most());
    let set = if is_range { Key::new() } else { set };
    let own = entries_of(sets, &set);
    let entries: Vec<(Entry, Vec<Entry>, f64)> = own
        .iter()
        .map(|own| {
            if let Some(proposal) = &alone {
                return (own.clone(), proposal.alike.clone(), f64::NAN);
            }
            let alike = alike(sets, &set, own, &weights);
            let counts = |key: &Key| entries_of(sets, key).iter().any(|e| e == own || alike.contains(e));
            let probability = weights.iter().filter(|(key, _)| counts(key)).map(|(_, weight)| weight).sum();
            (own.clone(), alike, probability)
        })
        .collect();
    let of_first = forecasts.first.as_ref().map_or_else(Vec::new, |first| entries_of(sets, first));
    let is_first = !own.is_empty() && !of_first.is_empty() && of_first.iter().all(|entry| own.contains(entry));
    // What has higher evidence says the same, and more that forecasts no better.
    let is_within = !own.is_empty()
        && entries.iter().all(|(own, alike, _)| of_first.contains(own) || alike.iter().any(|e| of_first.contains(e)));
    let remains = Remains::of(sets, forecasts, &set);
    // Where a set of higher evidence says something else, or other records contradict, there is more to it, too.
    let explains = remains.is_little() && (is_first || is_within) || remains.is_share_removed;
    let least = if forecasts.are_of_other_records() { settings.claimed } else { settings.most };
    let most = if is_first { 1.0 } else { settings.claimed };
    let is_supported = forecasts.are_of_other_records()
        || is_first && forecasts.share(sets, &set).is_some_and(|share| share >= settings.most);
    let may_claim = explains && is_supported && alone.is_none();
    let matters = matters(sets, forecasts, &set);
    let state = |(entry, alike, probability): (Entry, Vec<Entry>, f64)| {
        let is_probable = probability >= least;
        let is_claimed = may_claim && is_probable && matters.contains(&entry);
        // Of what is not claimed although it is probable, something else than the probability says so.
        let is_stated = is_claimed || probability < least && explains;
        let probability = if is_stated { (probability * (1.0 - settings.other)).min(most) } else { f64::NAN };
        Stated { is_claimed, probability, entry, alike }
    };
    let stated: Vec<Stated> = entries.into_iter().map(state).collect();
    let lacks = lacks(sets.declared());
    let conclusion = if stated.iter().any(|stated| stated.is_claimed) {
        Conclusion::Effect
    } else if lacks.iter().any(|(nats, error)| *nats > sets.significant && *error > settings.matters) {
        Conclusion::Unexplained
    } else {
        Conclusion::None
    };
    Verdict {
        conclusion,
        named_by,
        is_range,
        stated,
        nothing,
        is_contradicted: remains.is_contradicted,
        is_refused: !explains,
        is_description: remains.fires,
        excluded: forecasts.excluded.iter().cloned().chain(aliases).collect(),
        passed: weights,
        set,
        is_first,
        remaining: remains.curves,
        lack_of_fit: lacks[0].0,
    }
}

/// What remains on top of a set.
struct Remains {
    curves: Vec<Dependence>,
    /// True if a curve on top of the set fires.
    fires: bool,
    is_contradicted: bool,
    /// True if the set removes most of the forecast error of the declared model.
    is_share_removed: bool,
}

impl Remains {
    fn of(sets: &FittedSets<'_, '_>, forecasts: &Forecasts, key: &Key) -> Self {
        let settings = sets.settings();
        let Some(set) = sets.get(key).filter(|set| !set.key.is_empty()) else {
            return Self { curves: Vec::new(), fires: false, is_contradicted: false, is_share_removed: false };
        };
        let curves = sets.free_curves(key);
        let log = |set: &FittedSet<'_>| set.likeliest().map_or(0.0, |likeliest| likeliest.1.log_likelihood);
        let gained = log(set) - log(sets.declared());
        let share = forecasts.share_of_declared(sets, key);
        Self {
            fires: curves.first().is_some_and(|c| c.gain >= settings.fires && c.gain >= settings.small * gained),
            is_contradicted: is_contradicted(set),
            is_share_removed: share.is_some_and(|share| share >= settings.most),
            curves,
        }
    }

    fn is_little(&self) -> bool {
        !self.fires && !self.is_contradicted
    }
}

/// Returns classes and places of the effects of a set without which the forecast is worse by a share that matters: one
/// that forecasts hardly better is a proposal.
fn matters(sets: &FittedSets<'_, '_>, forecasts: &Forecasts, set: &Key) -> Vec<Entry> {
    let matters = |&index: &usize| {
        // What happens once in one record can be distinguished from what it lacks by another record only.
        let is_once = sets.refit.candidates[set[index]].only.is_some();
        (forecasts.are_of_other_records() || !is_once)
            && forecasts.share_of(sets, set, index).is_some_and(|share| share >= sets.settings().least)
    };
    (0..set.len()).filter(matters).map(|index| entry(sets, &sets.refit.candidates[set[index]])).collect()
}

/// Returns classes and places of effects that the records cannot distinguish from those of an entry of a set: in place
/// of one of them, what they change in the outputs is the same.
fn alike(sets: &FittedSets<'_, '_>, set: &Key, own: &Entry, weights: &[(Key, f64)]) -> Vec<Entry> {
    let candidates = &sets.refit.candidates;
    let mut all: Vec<Entry> = Vec::new();
    for (key, _) in weights.iter().filter(|(_, weight)| *weight > SOME) {
        let Some([replaced, new]) = swapped(sets, set, key) else { continue };
        let [theirs, replaced] = [new, replaced].map(|k| entry(sets, &candidates[k]));
        if replaced == *own && theirs != *own && !all.contains(&theirs) {
            all.push(theirs);
        }
    }
    all
}

/// Returns the effect of a set and that of another one in its place if nothing else differs, and the records cannot
/// distinguish what the two change in the outputs.
fn swapped(sets: &FittedSets<'_, '_>, set: &Key, other: &Key) -> Option<[usize; 2]> {
    let only = |a: &Key, b: &Key| {
        let mut own = a.iter().filter(|k| !b.contains(k));
        own.next().copied().filter(|_| own.next().is_none())
    };
    let (replaced, new) = only(set, other).zip(only(other, set))?;
    let residuals = |key: &Key| -> Option<Vec<f64>> {
        let set = sets.get(key)?;
        Some(set.fit.all(&set.least_squares.point)?.concat())
    };
    let rest: Key = set.iter().copied().filter(|k| *k != replaced).collect();
    let before = residuals(&rest)?;
    let change =
        |key: &Key| -> Option<Vec<f64>> { Some(residuals(key)?.iter().zip(&before).map(|(r, b)| r - b).collect()) };
    let (ours, theirs) = (change(set)?, change(other)?);
    let cosine = dot(&ours, &theirs) / (dot(&ours, &ours) * dot(&theirs, &theirs)).sqrt();
    (cosine > sets.refit.subject.settings.alike).then_some([replaced, new])
}

/// Returns the first of the sets that passed, or the simplest one that says the same, unless the evidence for the first
/// is strong: with the fewest parameters among those of the same classes and places, and those that the records cannot
/// distinguish from it.
fn simplest(sets: &FittedSets<'_, '_>, passed: &[Key]) -> Key {
    let Some(first) = passed.first() else { return Key::new() };
    let log = |key: &Key| sets.get(key).map_or(f64::NEG_INFINITY, |set| sets.log_posterior(set));
    let parameters =
        |key: &Key| -> usize { key.iter().map(|&k| sets.refit.candidates[k].effect.parameters().len()).sum() };
    let entries = entries_of(sets, first);
    let is_alike = |key: &&Key| {
        key.len() == first.len()
            && log(key) > log(first) - 0.5 * STRONG
            && sets.get(key).zip(sets.get(first)).is_some_and(|(own, first)| sets.leaves_as_little(own, first))
            && (entries_of(sets, key) == entries || swapped(sets, first, key).is_some())
    };
    passed.iter().filter(is_alike).min_by_key(|key| parameters(key)).unwrap_or(first).clone()
}

/// Returns the lack of fit of a model and its largest error of a record: on calibration records, then on these and
/// selection records together, if any. There it is either correlation, or errors that are larger than on the former
/// alone.
fn lacks(set: &FittedSet<'_>) -> Vec<(f64, f64)> {
    let on_calibration = (set.lack_of_fit().unwrap_or(f64::INFINITY), set.largest_error().unwrap_or(f64::INFINITY));
    if !set.fit.subject.measurements.iter().any(|m| m.role == Role::Selection) {
        return vec![on_calibration];
    }
    // All parameters may move: what calibration records leave open is no lack of the model.
    let together = || {
        let (fit, point) = fitted_together(set)?;
        let residuals = fit.all(&point)?;
        let own = set.fit.all(&set.least_squares.point)?;
        let grown = growth((&set.fit.pieces, &own), (&fit.pieces, &residuals));
        Some((correlation(&fit.pieces, &residuals, &set.fit.subject.settings)?.max(grown), largest(&residuals)))
    };
    vec![on_calibration, together().unwrap_or((f64::INFINITY, f64::INFINITY))]
}
