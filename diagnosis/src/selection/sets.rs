//! Sets of effects that were fitted: their probabilities, and what makes one no answer of its own.

use std::cell::OnceCell;

use mops_core::effect::EffectClass;
use mops_math as math;
use mops_outcome::diagnosis::Dependence;
use rayon::prelude::*;

use super::contradiction::is_contradicted;
use super::fitted_set::{FittedSet, Key, Start, evidence};
use super::refit::{HOPELESS, Refit, WORSE, price};
use super::screening::Screened;
use super::widened::Widened;
use crate::candidates::Candidate;
use crate::estimation::{ErrorModel, Estimate, STALLS};
use crate::fit::{Added, Sets};
use crate::motion::sizes_for;
use crate::settings::Settings;

/// Logarithm of the probability relative to a more probable set below which a set does not count. Basis: less than 1 %.
pub const NEGLIGIBLE: f64 = 5.0;

/// Times that a fit which has not converged is taken up again. Basis: what three times the iterations of a fit do not
/// bring to an end is no answer.
const TRIES: usize = 2;

/// Sets that are fitted under the error models at once. Those before them decide for which of them this is hopeless.
const TOGETHER: usize = 2;

/// Sets of effects that were fitted under all error models.
pub struct FittedSets<'r, 'a> {
    /// Fits sets.
    pub refit: &'r Refit<'a>,
    /// The sets, the most probable first; the declared model is among them.
    pub sets: Vec<FittedSet<'a>>,
    /// Largest number of effects of a set.
    pub most: usize,
    /// Gain of correlated errors over white noise in log-likelihood, nats, from which a lack of fit is significant.
    pub significant: f64,
    /// Candidates screened on the declared model, the best first.
    pub screened: Vec<Screened>,
    /// Sets that were the most probable one after the other.
    pub history: Vec<Key>,
    /// Sets that are simpler ones in all but name, with these.
    pub aliases: Vec<(Key, Key)>,
}

impl<'r, 'a> FittedSets<'r, 'a> {
    /// Begins with the declared model, fitted by least squares. A lack of fit is significant if it occurs by chance
    /// with probability `level`: twice its log-likelihood ratio is chi-squared with two degrees of freedom, the further
    /// parameters of one error model.
    pub fn new(refit: &'r Refit<'a>, mut declared: FittedSet<'a>, most: usize, level: f64) -> Self {
        refit.under_error_models(&mut declared, &[], f64::NEG_INFINITY);
        let significant = -math::ln(level);
        Self {
            refit,
            sets: vec![declared],
            most,
            significant,
            screened: Vec::new(),
            history: Vec::new(),
            aliases: Vec::new(),
        }
    }

    /// Returns the settings of the diagnosis.
    pub fn settings(&self) -> &'r Settings {
        &self.refit.subject.settings
    }

    /// Returns a fitted set.
    pub fn get(&self, key: &Key) -> Option<&FittedSet<'a>> {
        self.sets.iter().find(|set| set.key == *key)
    }

    /// Returns the declared model.
    pub fn declared(&self) -> &FittedSet<'a> {
        self.get(&Key::new()).expect("it was fitted first")
    }

    /// Returns the free curves on top of a set under its likeliest error model, the one with the largest gain first;
    /// none if a simulation fails.
    pub fn free_curves(&self, key: &Key) -> Vec<Dependence> {
        let set = self.get(key);
        let likeliest = set.and_then(FittedSet::likeliest).map(|(_, estimate)| estimate);
        let curves =
            set.zip(likeliest).and_then(|(set, likeliest)| set.estimation(&self.refit.nominal).curves(likeliest));
        curves.unwrap_or_default()
    }

    /// Returns the logarithm of the posterior probability of a set, up to a constant.
    pub fn log_posterior(&self, set: &FittedSet<'a>) -> f64 {
        #[allow(clippy::cast_precision_loss)]
        let size = set.key.len() as f64;
        set.log_evidence() - size * price(kinds(&self.refit.candidates))
    }

    /// Returns true if correlated errors are significantly likelier than white noise at the optimum of a set, or
    /// selection records contradict it.
    pub fn lacks_something(&self, set: &FittedSet<'_>) -> bool {
        set.lack_of_fit().is_none_or(|nats| nats > self.significant) || is_contradicted(set)
    }

    /// Returns classes and places of the effects of a set.
    pub fn kinds_of(&self, key: &Key) -> Vec<(EffectClass, String)> {
        let of = |&k: &usize| (self.refit.candidates[k].effect.class(), self.refit.candidates[k].place());
        let mut kinds: Vec<(EffectClass, String)> = key.iter().map(of).collect();
        kinds.sort();
        kinds
    }

    /// Returns true if an effect of a set does nothing under every error model.
    pub fn is_inert(&self, set: &FittedSet<'a>) -> bool {
        let gain = |smaller: &FittedSet<'a>, kind: ErrorModel| {
            let (own, theirs) = (set.estimate(kind)?, smaller.estimate(kind)?);
            Some(own.log_likelihood - theirs.log_likelihood)
        };
        let subsets = (0..set.key.len()).filter_map(|k| self.get(&without(&set.key, k)));
        subsets.into_iter().any(|smaller| {
            ErrorModel::ALL.into_iter().filter_map(|kind| gain(smaller, kind)).all(|gain| gain < self.settings().inert)
        })
    }

    /// Returns true if an effect of a set is as strong as is physically possible, or at an end of what the records
    /// cover.
    pub fn is_at_limit(&self, set: &FittedSet<'a>) -> bool {
        let motion = OnceCell::new();
        let sizes = |added: &Added| {
            let trajectories = motion.get_or_init(|| set.trajectories(&set.least_squares.point)).as_ref()?;
            sizes_for(&added.candidate, &set.variant.model, &set.fit.pieces, trajectories, self.settings().coverage)
        };
        let is_shown = |added: &Added| {
            let mut parameters = added.candidate.effect.parameters().iter().zip(&added.strengths);
            parameters.all(|(parameter, value)| {
                let of_motion = if parameter.kind.is_edge() { sizes(added) } else { None };
                of_motion.unwrap_or(added.sizes).shows(parameter, *value)
            })
        };
        set.start_at(&set.least_squares.point).added.iter().any(|added| added.is_at_limit() || !is_shown(added))
    }

    /// Returns the set in whose name a set counts, if that was fitted: the one with a simpler effect in place of one
    /// that is this at an end of one of its parameters, by least squares or under the likeliest error model.
    pub fn simpler(&self, set: &FittedSet<'a>) -> Option<Key> {
        let likeliest = set.likeliest().map(|(_, estimate)| estimate);
        let estimates = [&set.least_squares].into_iter().chain(likeliest);
        let candidates = &self.refit.candidates;
        estimates.into_iter().find_map(|estimate| {
            let added = set.start_at(&estimate.point).added;
            added.iter().find_map(|added| {
                let names = added.simpler(|parameter| self.is_wide(set, added, parameter));
                let at = set.key.iter().position(|k| *k == added.candidate.index)?;
                let rest = without(&set.key, at);
                let is_simpler = |k: &usize| {
                    names.contains(&candidates[*k].effect.name()) && candidates[*k].port == added.candidate.port
                };
                let simpler = (0..candidates.len()).filter(is_simpler).map(|k| with(&rest, k));
                simpler.into_iter().find(|key| self.get(key).is_some_and(|simpler| self.leaves_as_little(simpler, set)))
            })
        })
    }

    /// Returns true if a set leaves about as little of the error on calibration records as another one, or little of
    /// that of the declared model.
    pub fn leaves_as_little(&self, set: &FittedSet<'_>, other: &FittedSet<'_>) -> bool {
        let hardly_more = 1.0 + self.settings().least;
        set.least_squares.log_likelihood >= other.with_share_of_error(hardly_more * hardly_more, 0.0)
            || self.leaves_little(set)
    }

    /// Returns true if a set leaves little of the error above noise of the declared model on calibration records.
    pub fn leaves_little(&self, set: &FittedSet<'_>) -> bool {
        let declared = self.declared();
        let is_above_noise = declared.least_squares.log_likelihood < declared.with_share_of_error(0.0, 1.0);
        is_above_noise && set.least_squares.log_likelihood >= declared.with_little_error()
    }

    /// Returns true if a set describes calibration records worse than the declared model, or its fit by least squares
    /// still gains in further tries: it is not known what it says.
    pub fn is_inconsistent(&self, set: &FittedSet<'_>) -> bool {
        !set.is_settled || set.least_squares.log_likelihood < self.declared().least_squares.log_likelihood
    }

    /// Returns the declared model with wider ranges if it leaves hardly more than a set, and clearly less than within
    /// the declared ones.
    pub fn widened_for(&self, set: &FittedSet<'_>) -> Option<&Widened> {
        let hardly_more = 1.0 + self.settings().least;
        let is_as_close = |widened: &&Widened| {
            let errors = set.error().zip(self.declared().error());
            errors.is_some_and(|(own, declared)| {
                widened.error <= hardly_more * own && hardly_more * widened.error < declared
            })
        };
        self.refit.widened.as_ref().filter(is_as_close)
    }

    /// Returns true if wider ranges leave nothing to be explained.
    pub fn is_explained_by_ranges(&self) -> bool {
        let matters = self.settings().matters;
        self.widened_for(self.declared()).is_some_and(|widened| widened.largest <= matters)
    }

    /// Returns true if no set that was fitted leaves less than wider ranges do.
    pub fn is_range_at_fault(&self) -> bool {
        let leaves_more =
            |widened: &Widened| self.sets.iter().all(|set| set.error().is_none_or(|error| error >= widened.error));
        self.widened_for(self.declared()).is_some_and(leaves_more)
    }

    /// Returns true if wider ranges remove most of the mean square error above noise of calibration records.
    pub fn ranges_remove_most(&self) -> bool {
        let above = |error: f64| error * error - 1.0;
        let declared = self.declared().error().map_or(f64::NAN, above);
        self.refit.widened.as_ref().is_some_and(|w| above(w.error) <= (1.0 - self.settings().most) * declared)
    }

    /// Takes fits by least squares that have not converged up again from where they stopped, of the sets that may be
    /// named: those that are more probable than the declared model, or leave little of its error.
    pub fn take_up(&mut self) {
        let declared = self.log_posterior(self.declared());
        let little = self.declared().with_little_error();
        let counts =
            |set: &FittedSet<'a>| self.log_posterior(set) > declared || set.least_squares.log_likelihood >= little;
        let continued = |set: &FittedSet<'a>| {
            let mut set = set.clone();
            for _ in 0..if counts(&set) { TRIES } else { 0 } {
                if set.is_settled {
                    break;
                }
                let still = set.with_share_of_error(1.0 - STALLS, 0.0);
                let again = set.estimation(&[]).least_squares(set.least_squares.point.clone())?;
                set.is_settled = again.converged || again.log_likelihood < still;
                set.least_squares = again;
            }
            Some(set)
        };
        let continued: Vec<Option<FittedSet<'a>>> = self.sets.par_iter().map(continued).collect();
        for (set, again) in self.sets.iter_mut().zip(continued) {
            if let Some(again) = again {
                *set = again;
            }
        }
    }

    /// Returns true if the records allow most values that are tried of a parameter of an effect that no derivative
    /// determines.
    fn is_wide(&self, set: &FittedSet<'a>, added: &Added, parameter: usize) -> bool {
        let of = &added.candidate.effect.parameters()[parameter];
        let sets = Sets::Parameter(set.variant.first[set.position(added.candidate.index)] + parameter);
        let position = set.fit.globals.iter().position(|global| global.sets == sets && global.is_stepped());
        let mut tried = added.sizes.values(of.dimension, of.grid, of.bounds);
        tried.retain(|value| !of.bounds.contains(value));
        let interval = position.zip(likelier_output(set).or(Some(&set.least_squares)));
        let interval = interval.and_then(|(global, at)| set.estimation(&[]).stepped_interval(at, global));
        let allowed = |[low, high]: [f64; 2]| tried.iter().filter(|v| (low..=high).contains(*v)).count();
        interval.is_some_and(|interval| 2 * allowed(interval) >= tried.len())
    }

    /// Returns true if a set was fitted, or is a simpler one in all but name.
    pub fn is_known(&self, key: &Key) -> bool {
        self.get(key).is_some() || self.aliases.iter().any(|(alias, _)| alias == key)
    }

    /// Notes the most probable set if it has changed.
    pub fn note(&mut self) {
        let Some(first) = self.sets.first().map(|set| set.key.clone()) else { return };
        if self.history.last().map_or(!first.is_empty(), |last| *last != first) {
            self.history.push(first);
        }
    }

    /// Makes sure that sets are fitted under all error models, from sets with one effect more. Returns false if one
    /// cannot be.
    pub fn ensure(&mut self, keys: &[Key]) -> bool {
        let unknown: Vec<&Key> = keys.iter().filter(|key| self.get(key).is_none()).collect();
        let fitted = |key: &&Key| {
            let starts: Vec<Start> = self.sets.iter().filter_map(|larger| self.reduced(larger, key)).collect();
            self.refit.least_squares(key, &starts)
        };
        let sets: Vec<FittedSet<'a>> = unknown.par_iter().filter_map(fitted).collect();
        let is_complete = sets.len() == unknown.len();
        if !sets.is_empty() {
            self.add(sets, HOPELESS);
            self.sort();
        }
        is_complete
    }

    /// Fits those of some sets again that describe the records worse than a probable set with one effect more does
    /// without that effect: these were in another basin.
    pub fn correct(&mut self, keys: &[Key]) {
        let best = self.sets.first().map_or(f64::NEG_INFINITY, |first| self.log_posterior(first));
        let corrected = |key: &Key| {
            let known = self.get(key)?;
            let near = self.sets.iter().filter(|set| self.log_posterior(set) > best - NEGLIGIBLE);
            let is_better = |start: &Start| {
                let there = self.refit.at_start(key, start);
                there.is_some_and(|there| {
                    there.least_squares.log_likelihood > known.least_squares.log_likelihood + WORSE
                })
            };
            let starts: Vec<Start> = near.filter_map(|larger| self.reduced(larger, key)).filter(is_better).collect();
            let mut again = self.refit.least_squares(key, &starts)?;
            self.refit.under_error_models(&mut again, &self.nested(key), f64::NEG_INFINITY);
            (again.log_evidence() > known.log_evidence()).then_some(again)
        };
        let corrected: Vec<FittedSet<'a>> = keys.par_iter().filter_map(corrected).collect();
        for again in corrected {
            self.sets.retain(|set| set.key != again.key);
            self.sets.push(again);
        }
        self.sort();
    }

    /// Adds sets, the simplest first; what is a simpler one in all but name is only noted.
    pub fn add_all(&mut self, mut sets: Vec<FittedSet<'a>>, margin: f64) {
        sets.sort_by_key(|set| set.parameters());
        let mut sets = sets.into_iter().peekable();
        while sets.peek().is_some() {
            let (simpler, new): (Vec<_>, Vec<_>) = sets
                .by_ref()
                .take(TOGETHER)
                .map(|set| (self.simpler(&set), set))
                .partition(|(alias, _)| alias.is_some());
            self.aliases.extend(simpler.into_iter().filter_map(|(alias, set)| Some((set.key, alias?))));
            self.add(new.into_iter().map(|(_, set)| set).collect(), margin);
        }
    }

    /// Fits sets under the error models that can bring them within a margin of the highest evidence, nats, and adds
    /// them.
    fn add(&mut self, sets: Vec<FittedSet<'a>>, margin: f64) {
        let best = self.sets.iter().map(FittedSet::log_evidence).fold(f64::NEG_INFINITY, f64::max);
        self.add_under(sets, best - margin);
    }

    fn add_under(&mut self, sets: Vec<FittedSet<'a>>, least: f64) {
        let fitted = |mut set: FittedSet<'a>| {
            if self.get(&set.key).is_some() {
                return None;
            }
            let nested = self.nested(&set.key);
            self.refit.under_error_models(&mut set, &nested, least);
            (!set.under.is_empty()).then_some(set)
        };
        let fitted: Vec<FittedSet<'a>> = sets.into_par_iter().filter_map(fitted).collect();
        self.sets.extend(fitted);
    }

    /// Returns the fitted sets with one effect less, or else the declared model.
    fn nested(&self, key: &Key) -> Vec<&FittedSet<'a>> {
        let contained = |smaller: &&FittedSet<'a>| {
            smaller.key.len() + 1 == key.len() && smaller.key.iter().all(|k| key.contains(k))
        };
        let nested: Vec<&FittedSet<'a>> = self.sets.iter().filter(contained).collect();
        let declared = self.sets.iter().filter(|set| set.key.is_empty() && nested.is_empty() && !key.is_empty());
        nested.iter().copied().chain(declared).collect()
    }

    /// Returns the values of a set at its optimum without the effect that another one lacks; `None` if that is not one
    /// effect less.
    fn reduced(&self, larger: &FittedSet<'a>, key: &Key) -> Option<Start> {
        let is_extra = |added: &Added| !key.contains(&added.candidate.index);
        let contains = key.iter().all(|k| larger.key.contains(k)) && larger.key.len() == key.len() + 1;
        let extra = larger.added.iter().position(is_extra).filter(|_| contains)?;
        Some(larger.start_at(&larger.least_squares.point).without(extra))
    }

    /// Brings the sets into the order of their probabilities.
    pub fn sort(&mut self) {
        let mut keyed: Vec<(f64, FittedSet<'a>)> =
            std::mem::take(&mut self.sets).into_iter().map(|set| (self.log_posterior(&set), set)).collect();
        keyed.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.sets = keyed.into_iter().map(|(_, set)| set).collect();
    }
}

/// Returns the fit of a set under the output error under which it has more evidence.
pub fn likelier_output<'s>(set: &'s FittedSet<'_>) -> Option<&'s Estimate> {
    let outputs = set.under.iter().filter(|(kind, _)| *kind != ErrorModel::Force);
    outputs.map(|(_, estimate)| estimate).max_by(|a, b| evidence(a).total_cmp(&evidence(b)))
}

/// Returns a set with one more candidate.
pub fn with(key: &Key, index: usize) -> Key {
    let mut larger = key.clone();
    larger.push(index);
    larger.sort_unstable();
    larger
}

/// Returns a set without one of its effects.
pub fn without(key: &Key, index: usize) -> Key {
    let mut smaller = key.clone();
    smaller.remove(index);
    smaller
}

/// Returns the number of candidates that the prior counts: one that acts in a single record counts once for all
/// records.
pub fn kinds(candidates: &[Candidate]) -> usize {
    let same = |a: &Candidate, b: &Candidate| {
        a.effect.name() == b.effect.name() && a.port == b.port && a.companion == b.companion
    };
    (0..candidates.len()).filter(|&k| !candidates[..k].iter().any(|earlier| same(earlier, &candidates[k]))).count()
}
