//! Best-first search over sets of effects.

use std::cell::OnceCell;

use mops_core::effect::EffectClass;
use mops_math as math;
use rayon::prelude::*;

use super::fitted_set::{FittedSet, Key, Start, evidence};
use super::refit::{Refit, Rough, are_apart, price};
use super::screening::{Scene, Screened, pair_gain};
use super::verdict::is_contradicted;
use crate::candidate::Candidate;
use crate::estimation::{ErrorModel, Errors, Estimate};
use crate::fit::{Point, Sets};
use crate::settings::settings;
use crate::trace_of::sizes_for;
use crate::variant::Added;

/// Sets that are fitted under the error models at once. Those before them decide for which of them this is hopeless.
const TOGETHER: usize = 2;

/// Sets that a search has fitted under all error models, the most probable first.
pub struct Search<'r, 'a> {
    /// Fits sets.
    pub refit: &'r Refit<'a>,
    /// Fitted sets; the declared model is among them.
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

impl<'r, 'a> Search<'r, 'a> {
    /// Begins with the declared model, fitted by least squares. A lack of fit is significant if it occurs by chance with
    /// probability `level`: twice its log-likelihood ratio is chi-squared with two degrees of freedom, the further parameters of
    /// one error model.
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

    /// Returns true if correlated errors are significantly likelier than white noise at the optimum of a set, or selection records
    /// contradict it.
    pub fn lacks_something(&self, set: &FittedSet<'_>) -> bool {
        set.lack_of_fit().is_none_or(|nats| nats > self.significant) || is_contradicted(set)
    }

    /// Returns true if a set explains most of the mean square error of the declared model above noise: otherwise its effects describe
    /// what is missing roughly, whatever their names.
    fn explains_most(&self, set: &FittedSet<'_>) -> bool {
        let above = |set: &FittedSet<'_>| set.error().map(|error| error * error - 1.0);
        let both = above(set).zip(self.get(&Key::new()).and_then(above));
        both.is_some_and(|(own, declared)| own <= (1.0 - settings().explained) * declared)
    }

    /// Notes the most probable set if it has changed.
    fn note(&mut self) {
        let Some(first) = self.sets.first().map(|set| set.key.clone()) else { return };
        if self.history.last().map_or(!first.is_empty(), |last| *last != first) {
            self.history.push(first);
        }
    }

    /// Adds single effects and pairs to the declared model.
    pub fn begin(&mut self) {
        self.refit.simulations.stage("single effects and pairs", 0.15);
        self.expand(&Key::new());
        self.note();
    }

    /// Expands the most probable sets until they have all been; the declared model has been.
    pub fn run(&mut self) {
        // Of sets with the same classes at the same places one is expanded.
        let mut expanded: Vec<Vec<(EffectClass, String)>> = vec![Vec::new()];
        while expanded.len() < settings().expansions {
            let first = self.sets.first().map_or(f64::NEG_INFINITY, |set| self.log_posterior(set));
            let best = self.sets.iter().take(settings().beam).find(|set| {
                let is_promising = self.log_posterior(set) > first - settings().negligible;
                is_promising && set.key.len() < self.most && !expanded.contains(&self.kinds_of(&set.key))
            });
            let Some(key) = best.map(|set| set.key.clone()) else { break };
            if !self.sets.first().is_some_and(|set| self.lacks_something(set)) {
                break;
            }
            #[allow(clippy::cast_precision_loss)]
            let done = 0.15 + 0.12 * expanded.len() as f64;
            self.refit.simulations.stage("further effects", done);
            self.expand(&key);
            self.note();
            expanded.push(self.kinds_of(&key));
        }
        let mut swapped: Vec<Key> = Vec::new();
        while swapped.len() < settings().beam {
            let Some(key) = self.sets.first().filter(|set| self.explains_most(set)).map(|set| set.key.clone()) else {
                break;
            };
            if swapped.contains(&key) {
                break;
            }
            self.refit.simulations.stage("other effects of the same class", 0.8);
            self.swap(&key);
            self.note();
            swapped.push(key);
        }
    }

    /// Returns classes and places of the effects of a set.
    fn kinds_of(&self, key: &Key) -> Vec<(EffectClass, String)> {
        let of = |&k: &usize| (self.refit.candidates[k].effect.class(), self.refit.candidates[k].place());
        let mut kinds: Vec<(EffectClass, String)> = key.iter().map(of).collect();
        kinds.sort();
        kinds
    }

    /// Returns the position of a candidate among the effects of a set.
    fn position(&self, set: &FittedSet<'a>, index: usize) -> usize {
        let is_it = |added: &Added| self.refit.candidates[index].is(&added.candidate);
        set.added.iter().position(is_it).expect("the set holds it")
    }

    /// Returns a fitted set.
    pub fn get(&self, key: &Key) -> Option<&FittedSet<'a>> {
        self.sets.iter().find(|set| set.key == *key)
    }

    /// Returns the logarithm of the posterior probability of a set, up to a constant.
    pub fn log_posterior(&self, set: &FittedSet<'a>) -> f64 {
        #[allow(clippy::cast_precision_loss)]
        let size = set.key.len() as f64;
        set.log_evidence() - size * price(kinds(&self.refit.candidates))
    }

    /// Returns true if an effect of a set does nothing under every error model.
    pub fn is_inert(&self, set: &FittedSet<'a>) -> bool {
        let gain = |smaller: &FittedSet<'a>, kind: ErrorModel| {
            let (own, theirs) = (set.estimate(kind)?, smaller.estimate(kind)?);
            Some(own.log_likelihood - theirs.log_likelihood)
        };
        let subsets = (0..set.key.len()).filter_map(|k| self.get(&without(&set.key, k)));
        subsets.into_iter().any(|smaller| {
            ErrorModel::ALL.into_iter().filter_map(|kind| gain(smaller, kind)).all(|gain| gain < settings().inert)
        })
    }

    /// Returns true if an effect of a set is as strong as is physically possible, or at an end of what the records cover.
    pub fn is_at_limit(&self, set: &FittedSet<'a>) -> bool {
        let motion = OnceCell::new();
        let sizes = |added: &Added| {
            let trajectories = motion.get_or_init(|| set.trajectories(&set.least_squares.point)).as_ref()?;
            sizes_for(&added.candidate, &set.variant.model, &set.fit.pieces, trajectories)
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

    /// Returns the set in whose name a set counts: itself, or the one with a simpler effect in place of one of its effects that is at
    /// a limit. At a bound of a parameter beside the first it is the simpler effect in all but name.
    pub fn simpler(&self, set: &FittedSet<'a>) -> Option<Key> {
        let likeliest = set.likeliest().map(|(kind, estimate)| (Some(*kind), estimate));
        let estimates = [(None, &set.least_squares)].into_iter().chain(likeliest);
        estimates.into_iter().find_map(|(kind, estimate)| {
            let added = set.start_at(&estimate.point).added;
            let is_at_limit = |&index: &usize| {
                let parameters =
                    added[index].candidate.effect.parameters().iter().zip(&added[index].strengths).enumerate();
                parameters.into_iter().skip(1).any(|(k, (parameter, value))| {
                    let ends = added[index].sizes.bounds(parameter);
                    !parameter.fixed && ends.contains(value) && !self.is_wide(set, &added[index], index, k)
                })
            };
            let at_limit = (0..added.len()).filter(is_at_limit);
            at_limit.into_iter().find_map(|index| self.matched(set, &added[index].candidate, kind, estimate))
        })
    }

    /// Returns true if the records allow most values that are tried of a parameter that no derivative determines.
    fn is_wide(&self, set: &FittedSet<'a>, added: &Added, index: usize, k: usize) -> bool {
        let parameter = &added.candidate.effect.parameters()[k];
        let sets = Sets::Parameter(set.variant.first[index] + k);
        let position = set.fit.globals.iter().position(|global| global.sets == sets && global.is_stepped());
        let mut tried = added.sizes.values(parameter.dimension, parameter.grid, parameter.bounds);
        tried.retain(|value| !parameter.bounds.contains(value));
        let interval = position.zip(likelier_output(set).or(Some(&set.least_squares)));
        let interval = interval.and_then(|(g, at)| set.estimation(&[]).stepped_interval(at, g));
        let allowed = |[low, high]: [f64; 2]| tried.iter().filter(|v| (low..=high).contains(*v)).count();
        interval.is_some_and(|interval| 2 * allowed(interval) >= tried.len())
    }

    /// Returns the simplest set with a simpler effect in place of one that is about as likely, by least squares or under an error model.
    fn matched(
        &self,
        set: &FittedSet<'a>,
        candidate: &Candidate,
        kind: Option<ErrorModel>,
        estimate: &Estimate,
    ) -> Option<Key> {
        let candidates = &self.refit.candidates;
        let at = set.key.iter().position(|k| candidates[*k].is(candidate))?;
        let rest = without(&set.key, at);
        let matching = self.sets.iter().filter(|other| {
            let new = other.key.iter().find(|k| !rest.contains(k));
            let theirs = kind.map_or(Some(&other.least_squares), |kind| other.estimate(kind));
            other.key.len() == set.key.len()
                && rest.iter().all(|k| other.key.contains(k))
                && new.is_some_and(|&k| candidates[k].has_fewer_strengths_than(candidate))
                && theirs
                    .is_some_and(|theirs| theirs.log_likelihood > estimate.log_likelihood - 0.5 * settings().strong)
        });
        matching.min_by_key(|set| set.parameters()).map(|simplest| simplest.key.clone())
    }

    /// Fits the sets with one or two effects more, and those with one less.
    fn expand(&mut self, key: &Key) {
        let parent = self.get(key).expect("it was fitted").clone();
        let errors = output_errors(&parent);
        if errors.len() == 1 {
            return;
        }
        let Some(scene) = Scene::new(&parent, &errors) else { return };
        let all = &self.refit.candidates;
        let fits = |&index: &usize| parent.added.iter().all(|added| can_be_together(&added.candidate, &all[index]));
        // What happens once in one record is a rival of all else, but is stacked on its like only.
        let is_stacked = |&index: &usize| all[index].only.is_none() || key.iter().all(|&k| all[k].only.is_some());
        let wanted: Vec<usize> =
            (0..all.len()).filter(|index| !key.contains(index)).filter(fits).filter(is_stacked).collect();
        // Correlated errors may leave the basin of least squares: then the motion there is looked at, too.
        let estimation = parent.estimation(&[]);
        let apart = likelier_output(&parent)
            .filter(|likelier| are_apart(&estimation, &parent.least_squares, likelier, settings().clearly));
        let there = apart.and_then(|likelier| Scene::at(&parent, &likelier.point, &errors));
        let screened = match &there {
            Some(there) => scene.screen_with(there, all, &wanted),
            None => scene.screen(all, &wanted),
        };
        if key.is_empty() {
            self.screened.clone_from(&screened);
        }
        // What explains less than it costs is not fitted. On the declared model all may be nonlinear in what it explains.
        let price = price(kinds(all));
        let pays = |gain: f64| settings().allowance * gain > price;
        let paying = || screened.iter().filter(|screened| pays(screened.correlated()));
        let mut singles: Vec<&Screened> = paying().take(settings().singles).collect();
        let mut raw: Vec<&Screened> = if key.is_empty() { screened.iter().collect() } else { paying().collect() };
        raw.sort_by(|a, b| b.gains[0].total_cmp(&a.gains[0]));
        // Where correlated errors take up whatever is missing, the gain in white noise is what there is.
        let is_missed = key.is_empty() && self.lacks_something(&parent);
        let others =
            settings().by_squares + if is_missed { settings().singles.saturating_sub(singles.len()) } else { 0 };
        for other in raw.into_iter().take(others) {
            if singles.iter().all(|single| single.index != other.index) {
                singles.push(other);
            }
        }
        // An edge or a stop bounds the motion on which its first order rests. Where nobody measures that motion, it is tried.
        let bounds = |single: &&Screened| {
            is_missed && all[single.index].has_restarts() && !self.refit.subject.is_measured(&all[single.index].port)
        };
        for other in screened.iter().filter(bounds) {
            if singles.iter().all(|single| single.index != other.index) {
                singles.push(other);
            }
        }
        let singles: Vec<Vec<&Screened>> = singles.into_iter().map(|single| vec![single]).collect();
        let best = screened.first().map_or(0.0, Screened::correlated);
        let pairs = if key.len() + 2 <= self.most { pairs(&screened, all) } else { Vec::new() };
        let pairs: Vec<Vec<&Screened>> =
            pairs.into_iter().filter(|(gain, _)| pays(gain - best)).map(|(_, pair)| pair).collect();
        self.fit_best(&parent, &singles, settings().in_full[0]);
        self.sort();
        // Where a set is found that lacks nothing, no pair is needed.
        if !pairs.is_empty() && self.sets.first().is_some_and(|set| self.lacks_something(set)) {
            self.fit_best(&parent, &pairs, settings().in_full[1]);
            self.sort();
        }
        // What no longer pays goes.
        let best = self.sets.first().map_or(f64::NEG_INFINITY, |first| self.log_posterior(first));
        let near = self.sets.iter().take_while(|set| self.log_posterior(set) > best - settings().negligible);
        let smaller = near.take(settings().beam).flat_map(|set| (0..set.key.len()).map(|k| without(&set.key, k)));
        let mut smaller: Vec<Key> = smaller.collect();
        smaller.sort();
        smaller.dedup();
        self.ensure(&smaller);
        self.correct(&smaller);
    }

    /// Fits the sets in which an effect is exchanged for another of its class at its place.
    fn swap(&mut self, key: &Key) {
        for k in 0..key.len() {
            let smaller = without(key, k);
            if !self.ensure(std::slice::from_ref(&smaller)) {
                continue;
            }
            let (Some(set), Some(parent)) = (self.get(key), self.get(&smaller).cloned()) else { continue };
            // Where the set is at its optimum, what an effect does is all that is missing without it.
            let position = self.position(set, key[k]);
            let start = set.start_at(&set.least_squares.point);
            let exchanged = start.added[position].clone();
            let start = start.without(position);
            let white = set.least_squares.log_likelihood;
            let Some(rest) = self.refit.at_start(&smaller, &start) else { continue };
            let white = white - rest.least_squares.log_likelihood;
            let all = &self.refit.candidates;
            let alike = |&index: &usize| {
                let (this, other) = (&all[key[k]], &all[index]);
                this.effect.class() == other.effect.class() && this.port == other.port && !key.contains(&index)
            };
            let fits = |&index: &usize| parent.added.iter().all(|added| can_be_together(&added.candidate, &all[index]));
            let is_new = |index: &usize| !self.is_known(&with(&smaller, *index));
            let others: Vec<usize> = (0..all.len()).filter(alike).filter(fits).filter(is_new).collect();
            let wanted = with(&others, key[k]);
            let Some(scene) = Scene::new(&rest, &[Errors::White]) else { continue };
            let screened = scene.screen(all, &wanted);
            // The first-order gains of the others are trusted only if that of the effect itself predicts its actual gain.
            let own = screened.iter().find(|own| own.index == key[k]);
            let is_predicted = own.is_some_and(|own| settings().allowance * own.gains[0] > white);
            let is_near = |single: &&Screened| {
                let gain = settings().allowance * single.gains[0];
                single.index != key[k] && (!is_predicted || gain > white - settings().hopeless)
            };
            // Each is fitted with hyperparameters of its own: those of the set are narrow around its own optimum. Where the set
            // lacks nothing, squares decide. A fit below the set without the effect has failed.
            let own = self.get(key).filter(|set| !self.lacks_something(set));
            let least = own.map_or(f64::NEG_INFINITY, |set| set.least_squares.log_likelihood - settings().hopeless);
            let least = least.max(parent.least_squares.log_likelihood);
            let fitted = |single: &&Screened| {
                let new = [*single];
                let likelier = likelier_output(&parent).and_then(|likelier| best_start(&parent, &likelier.point, &new));
                let named = start.with(&single.guesses[0].named_like(&exchanged));
                let others: Vec<Start> = likelier.into_iter().chain([named]).collect();
                let rough = self.by_squares(&rest, &new, &others, least)?;
                let is_hopeless = rough.log_likelihood < least;
                if is_hopeless { None } else { self.refit.least_squares(&larger(&parent, &new), &[rough.start]) }
            };
            let near: Vec<&Screened> = screened.iter().filter(is_near).take(settings().singles).collect();
            let sets: Vec<FittedSet<'a>> = near.par_iter().filter_map(fitted).collect();
            self.add_all(sets, settings().negligible);
        }
        self.sort();
    }

    /// Fits sets with more effects roughly, by least squares and under the likelier output error of their parent, then those of
    /// highest evidence under all error models.
    fn fit_best(&mut self, parent: &FittedSet<'a>, new: &[Vec<&Screened>], full: usize) {
        let unknown = |new: &&Vec<&Screened>| !self.is_known(&larger(parent, new));
        let new: Vec<&Vec<&Screened>> = new.iter().filter(unknown).collect();
        let Some(given) = likelier_output(parent) else { return };
        // What does not pay is not worth it, but on the declared model a few are tried whatever is expected of them.
        let least = if parent.key.is_empty() {
            f64::NEG_INFINITY
        } else {
            let added = new.first().map_or(0, |new| new.len());
            #[allow(clippy::cast_precision_loss)]
            let price = added as f64 * price(kinds(&self.refit.candidates));
            let parent = self.refit.roughly(&[parent.start_at(&given.point)], &given.errors, f64::NEG_INFINITY);
            parent.map_or(f64::NEG_INFINITY, |parent| parent.log_evidence + price / settings().allowance)
        };
        let mut trials: Vec<Trial> = Vec::new();
        // In groups: what earlier groups have reached decides which fits are hopeless.
        for group in new.chunks(settings().at_a_time) {
            let best = trials.iter().map(|trial| trial.rough.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
            let of = |new: &&Vec<&Screened>| {
                let likelier = best_start(parent, &given.point, new);
                let by_squares = self.by_squares(parent, new, likelier.as_slice(), f64::NEG_INFINITY)?;
                let begin: Vec<Start> = likelier.into_iter().chain([by_squares.start.clone()]).collect();
                let rough = self.refit.roughly(&begin, &given.errors, best - settings().hopeless)?;
                Some(Trial { key: larger(parent, new), by_squares, rough })
            };
            let found: Vec<Option<Trial>> = group.par_iter().map(of).collect();
            trials.extend(found.into_iter().flatten());
        }
        let best = trials.iter().map(|trial| trial.rough.log_evidence).fold(f64::NEG_INFINITY, f64::max);
        let least = least.max(best - settings().hopeless);
        trials.sort_by(|a, b| b.rough.log_evidence.total_cmp(&a.rough.log_evidence));
        let worth = trials.iter().take_while(|trial| trial.rough.log_evidence > least).count().min(full);
        let mut rest = trials.split_off(worth);
        if parent.key.is_empty() {
            // Correlated errors may take up what is missing; squares cannot.
            rest.sort_by(|a, b| b.by_squares.log_evidence.total_cmp(&a.by_squares.log_evidence));
            let leading = trials.iter().map(|trial| trial.by_squares.log_evidence).fold(f64::NEG_INFINITY, f64::max);
            trials.extend(
                rest.into_iter().take(settings().by_squares).filter(|trial| trial.by_squares.log_evidence > leading),
            );
        }
        let fitted = |Trial { key, by_squares, rough }: &Trial| {
            self.refit.least_squares(key, &[by_squares.start.clone(), rough.start.clone()])
        };
        let sets: Vec<FittedSet<'a>> = trials.par_iter().filter_map(fitted).collect();
        self.add_all(sets, settings().hopeless);
    }

    /// Fits a set with more effects roughly by least squares: from the optimum of its parent by least squares, and from other
    /// starts. Gives up where the log-likelihood cannot become as large as `least`.
    fn by_squares(&self, parent: &FittedSet<'a>, new: &[&Screened], others: &[Start], least: f64) -> Option<Rough> {
        let mut from = starts(parent, &parent.least_squares.point, new);
        from.extend_from_slice(others);
        let rough = self.refit.roughly(&from, &Errors::White, least)?;
        let moved = self.refit.with_moved_states(&rough.start);
        let again = moved.and_then(|moved| self.refit.roughly(&[moved], &Errors::White, least));
        Some(again.filter(|again| again.log_likelihood > rough.log_likelihood).unwrap_or(rough))
    }

    /// Fits a set from fitted ones with one effect less. Returns false if there are none, or the fits fail.
    pub fn fit(&mut self, key: &Key) -> bool {
        let mut best: Option<FittedSet<'a>> = None;
        for k in 0..key.len() {
            let Some(parent) = self.get(&without(key, k)) else { continue };
            let Some(scene) = Scene::new(parent, &[Errors::White]) else { continue };
            for screened in scene.screen(&self.refit.candidates, &[key[k]]) {
                let mut starts = starts(parent, &parent.least_squares.point, &[&screened]);
                let smooth = parent.estimate(ErrorModel::SmoothOutput);
                starts.extend(smooth.and_then(|smooth| best_start(parent, &smooth.point, &[&screened])));
                let Some(set) = self.refit.least_squares(key, &starts) else { continue };
                let log = |set: &FittedSet<'a>| set.least_squares.log_likelihood;
                if best.as_ref().is_none_or(|best| log(&set) > log(best)) {
                    best = Some(set);
                }
            }
        }
        best.map(|set| self.add_under(vec![set], f64::NEG_INFINITY)).is_some()
    }

    /// Makes sure that sets are fitted under all error models, from sets with one effect more. Returns false if one cannot be.
    pub fn ensure(&mut self, keys: &[Key]) -> bool {
        let unknown: Vec<&Key> = keys.iter().filter(|key| self.get(key).is_none()).collect();
        let fitted = |key: &&Key| {
            let starts: Vec<Start> = self.sets.iter().filter_map(|larger| self.reduced(larger, key)).collect();
            self.refit.least_squares(key, &starts)
        };
        let sets: Vec<FittedSet<'a>> = unknown.par_iter().filter_map(fitted).collect();
        let is_complete = sets.len() == unknown.len();
        if !sets.is_empty() {
            self.add(sets, settings().hopeless);
            self.sort();
        }
        is_complete
    }

    /// Returns the values of a set at its optimum without the effect that another one lacks; `None` if that is not one effect less.
    fn reduced(&self, larger: &FittedSet<'a>, key: &Key) -> Option<Start> {
        let is_extra = |added: &Added| !key.iter().any(|&k| self.refit.candidates[k].is(&added.candidate));
        let contains = key.iter().all(|k| larger.key.contains(k)) && larger.key.len() == key.len() + 1;
        let extra = larger.added.iter().position(is_extra).filter(|_| contains)?;
        Some(larger.start_at(&larger.least_squares.point).without(extra))
    }

    /// Fits those of some sets again that describe the records worse than a probable set with one effect more does without that
    /// effect: these were in another basin.
    fn correct(&mut self, keys: &[Key]) {
        let best = self.sets.first().map_or(f64::NEG_INFINITY, |first| self.log_posterior(first));
        let corrected = |key: &Key| {
            let known = self.get(key)?;
            let near = self.sets.iter().filter(|set| self.log_posterior(set) > best - settings().negligible);
            let is_better = |start: &Start| {
                let there = self.refit.at_start(key, start);
                there.is_some_and(|there| {
                    there.least_squares.log_likelihood > known.least_squares.log_likelihood + settings().worse
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

    /// Returns the fitted sets with one effect less, or else the declared model.
    fn nested(&self, key: &Key) -> Vec<&FittedSet<'a>> {
        let contained = |smaller: &&FittedSet<'a>| {
            smaller.key.len() + 1 == key.len() && smaller.key.iter().all(|k| key.contains(k))
        };
        let nested: Vec<&FittedSet<'a>> = self.sets.iter().filter(contained).collect();
        let declared = self.sets.iter().filter(|set| set.key.is_empty() && nested.is_empty() && !key.is_empty());
        nested.iter().copied().chain(declared).collect()
    }

    /// Adds sets, the simplest first; what is a simpler one in all but name is only noted.
    fn add_all(&mut self, mut sets: Vec<FittedSet<'a>>, margin: f64) {
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

    /// Returns true if a set was fitted, or is a simpler one in all but name.
    fn is_known(&self, key: &Key) -> bool {
        self.get(key).is_some() || self.aliases.iter().any(|(alias, _)| alias == key)
    }

    /// Fits sets under the error models that can bring them within a margin of the highest evidence, nats, and adds them.
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

    fn sort(&mut self) {
        let mut keyed: Vec<(f64, FittedSet<'a>)> =
            std::mem::take(&mut self.sets).into_iter().map(|set| (self.log_posterior(&set), set)).collect();
        keyed.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.sets = keyed.into_iter().map(|(_, set)| set).collect();
    }
}

/// Set that was fitted roughly, by least squares and under an error model.
struct Trial {
    key: Key,
    by_squares: Rough,
    rough: Rough,
}

/// Returns the fit of a set under the output error under which it has more evidence.
pub fn likelier_output<'s>(set: &'s FittedSet<'_>) -> Option<&'s Estimate> {
    let outputs = set.under.iter().filter(|(kind, _)| *kind != ErrorModel::Force);
    outputs.map(|(_, estimate)| estimate).max_by(|a, b| evidence(a).total_cmp(&evidence(b)))
}

/// Returns a set with one more candidate.
fn with(key: &Key, index: usize) -> Key {
    let mut larger = key.clone();
    larger.push(index);
    larger.sort_unstable();
    larger
}

/// Returns the candidates of a set with further ones.
fn larger(parent: &FittedSet<'_>, new: &[&Screened]) -> Key {
    new.iter().fold(parent.key.clone(), |key, new| with(&key, new.index))
}

/// Returns a set at a point with further effects: the first of them at each of its guesses, the others at their best.
fn starts(parent: &FittedSet<'_>, at: &Point, new: &[&Screened]) -> Vec<Start> {
    let [first, rest @ ..] = new else { return Vec::new() };
    let known = rest.iter().fold(parent.start_at(at), |start, new| start.with(&new.guesses[0]));
    let again = first.guesses.iter().filter(|_| rest.is_empty()).flat_map(Added::restarts);
    first.guesses.iter().cloned().chain(again).map(|guess| known.with(&guess)).collect()
}

/// Returns a set at a point with further effects, each at its best guess.
fn best_start(parent: &FittedSet<'_>, at: &Point, new: &[&Screened]) -> Option<Start> {
    starts(parent, at, new).into_iter().next()
}

/// Returns white noise, and the error models of a set at the outputs.
fn output_errors(set: &FittedSet<'_>) -> Vec<Errors> {
    let of = |kind| set.estimate(kind).map(|estimate| estimate.errors.clone());
    let fitted = [ErrorModel::SmoothOutput, ErrorModel::RoughOutput].into_iter().filter_map(of);
    [Errors::White].into_iter().chain(fitted).collect()
}

/// Returns the best pairs by their normal equations.
fn pairs<'s>(screened: &'s [Screened], candidates: &[Candidate]) -> Vec<(f64, Vec<&'s Screened>)> {
    let among: Vec<&Screened> = screened.iter().filter(|screened| candidates[screened.index].only.is_none()).collect();
    #[allow(clippy::cast_precision_loss)]
    let further = |a: usize, b: usize| {
        let count = |k: usize| candidates[among[k].index].effect.parameters().len();
        (count(a) + count(b) - 2) as f64
    };
    let mut all: Vec<(f64, usize, usize)> = (0..among.len())
        .into_par_iter()
        .flat_map_iter(|a| (0..a).map(move |b| (a, b)))
        .filter(|&(a, b)| can_be_together(&candidates[among[a].index], &candidates[among[b].index]))
        .map(|(a, b)| (pair_gain(among[a], among[b]) - settings().per_parameter * further(a, b), a, b))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(settings().pairs).map(|(gain, a, b)| (gain, vec![among[b], among[a]])).collect()
}

/// Returns true if two candidates may act at once: a place has each characteristic once at most.
fn can_be_together(a: &Candidate, b: &Candidate) -> bool {
    let excludes = || a.effect.characteristic().is_some_and(|of| b.effect.characteristic() == Some(of));
    // Their order is not known.
    let can_follow = |a: &Candidate, b: &Candidate| a.effect.can_follow(b.effect.as_ref());
    !a.is(b) && (a.port != b.port || !excludes() && can_follow(a, b) && can_follow(b, a))
}

/// Returns a set without one of its effects.
pub fn without(key: &Key, index: usize) -> Key {
    let mut smaller = key.clone();
    smaller.remove(index);
    smaller
}

/// Returns the number of candidates that the prior counts: one that acts in a single record counts once for all records.
pub fn kinds(candidates: &[Candidate]) -> usize {
    let same = |a: &Candidate, b: &Candidate| {
        a.effect.name() == b.effect.name() && a.port == b.port && a.companion == b.companion
    };
    (0..candidates.len()).filter(|&k| !candidates[..k].iter().any(|earlier| same(earlier, &candidates[k]))).count()
}
