//! Best-first search over sets of effects.

use mops_core::effect::EffectClass;
use rayon::prelude::*;

use super::fitted_set::{FittedSet, Key, Start};
use super::refit::{HOPELESS, Rough, are_apart, price};
use super::screening::{Screened, Screening, pair_gain};
use super::sets::{FittedSets, NEGLIGIBLE, kinds, likelier_output, with, without};
use crate::candidates::Candidate;
use crate::estimation::{ALLOWANCE, CLEARLY, ErrorModel, Errors};
use crate::fit::{Added, Point};

/// Single effects and pairs of an expansion that are fitted under all error models. Basis: an assumption.
const IN_FULL: [usize; 2] = [4, 3];

/// Candidates of one parameter that leave little of the error by least squares, of which more are not fitted under the
/// error models. Basis: on the recordings at most seven did.
const LEAVE_LITTLE: usize = 10;

/// Sets that are fitted roughly before what they have reached decides which others are hopeless. Basis: an assumption.
const AT_A_TIME: usize = 4;

/// Gain that a pair must bring for each parameter beyond two to be fitted before another one, nats. Basis: an
/// assumption.
const PER_PARAMETER: f64 = 3.0;

impl<'a> FittedSets<'_, 'a> {
    /// Returns true if a set explains most of the mean square error of the declared model above noise: otherwise its
    /// effects describe what is missing roughly, whatever their names.
    fn explains_most(&self, set: &FittedSet<'_>) -> bool {
        let above = |set: &FittedSet<'_>| set.error().map(|error| error * error - 1.0);
        let both = above(set).zip(self.get(&Key::new()).and_then(above));
        both.is_some_and(|(own, declared)| own <= (1.0 - self.settings().explained) * declared)
    }

    /// Adds single effects and pairs to the declared model: screening, then fits of the best; none where wider ranges
    /// explain all.
    #[must_use]
    pub fn with_single_effects(mut self) -> Self {
        if self.is_explained_by_ranges() {
            return self;
        }
        self.refit.simulations.stage("single effects and pairs", 0.15);
        self.expand(&Key::new());
        self.note();
        self
    }

    /// Expands the most probable sets until they have all been; the declared model has been. Then exchanges their
    /// effects for others of their class.
    #[must_use]
    pub fn searched(mut self) -> Self {
        // Of sets with the same classes at the same places one is expanded.
        let mut expanded: Vec<Vec<(EffectClass, String)>> = vec![Vec::new()];
        while expanded.len() < self.settings().expansions && !self.is_range_at_fault() {
            let first = self.sets.first().map_or(f64::NEG_INFINITY, |set| self.log_posterior(set));
            let best = self.sets.iter().take(self.settings().beam).find(|set| {
                let is_promising = self.log_posterior(set) > first - NEGLIGIBLE;
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
        while swapped.len() < self.settings().beam {
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
        self
    }

    /// Fits the sets with one or two effects more, and those with one less.
    fn expand(&mut self, key: &Key) {
        let parent = self.get(key).expect("it was fitted").clone();
        let errors = output_errors(&parent);
        if errors.len() == 1 {
            return;
        }
        let Some(screening) = Screening::new(&parent, &errors) else { return };
        let all = &self.refit.candidates;
        let fits = |&index: &usize| parent.added.iter().all(|added| can_be_together(&added.candidate, &all[index]));
        // What happens once in one record is a rival of all else, but is stacked on its like only.
        let is_stacked = |&index: &usize| all[index].only.is_none() || key.iter().all(|&k| all[k].only.is_some());
        let wanted: Vec<usize> =
            (0..all.len()).filter(|index| !key.contains(index)).filter(fits).filter(is_stacked).collect();
        // Correlated errors may leave the basin of least squares: then the motion there is looked at, too.
        let estimation = parent.estimation(&[]);
        let apart = likelier_output(&parent)
            .filter(|likelier| are_apart(&estimation, &parent.least_squares, likelier, CLEARLY));
        let there = apart.and_then(|likelier| Screening::at(&parent, &likelier.point, &errors));
        let screened = match &there {
            Some(there) => screening.screen_with(there, all, &wanted),
            None => screening.screen(all, &wanted),
        };
        if key.is_empty() {
            self.screened.clone_from(&screened);
        }
        // What explains less than it costs is not fitted. On the declared model all may be nonlinear in what it
        // explains.
        let price = price(kinds(all));
        let pays = |gain: f64| ALLOWANCE * gain > price;
        let paying = || screened.iter().filter(|screened| pays(screened.correlated()));
        let mut singles: Vec<&Screened> = paying().take(self.settings().singles).collect();
        let mut raw: Vec<&Screened> = if key.is_empty() { screened.iter().collect() } else { paying().collect() };
        raw.sort_by(|a, b| b.gains[0].total_cmp(&a.gains[0]));
        // Where correlated errors take up whatever is missing, the gain in white noise is what there is.
        let is_missed = key.is_empty() && self.lacks_something(&parent);
        let others = self.settings().by_squares
            + if is_missed { self.settings().singles.saturating_sub(singles.len()) } else { 0 };
        for other in raw.into_iter().take(others) {
            if singles.iter().all(|single| single.index != other.index) {
                singles.push(other);
            }
        }
        // An edge or a stop bounds the motion on which its first order rests. Where nobody measures that motion, it is
        // tried.
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
        let pairs = if key.len() + 2 <= self.most { pairs(&screened, all, self.settings().pairs) } else { Vec::new() };
        let pairs: Vec<Vec<&Screened>> =
            pairs.into_iter().filter(|(gain, _)| pays(gain - best)).map(|(_, pair)| pair).collect();
        self.fit_best(&parent, &singles, IN_FULL[0]);
        if is_missed {
            self.fit_by_squares(&parent, &screened);
        }
        self.sort();
        // Where a set is found that lacks nothing, no pair is needed.
        if !pairs.is_empty() && self.sets.first().is_some_and(|set| self.lacks_something(set)) {
            self.fit_best(&parent, &pairs, IN_FULL[1]);
            self.sort();
        }
        // What no longer pays goes.
        let best = self.sets.first().map_or(f64::NEG_INFINITY, |first| self.log_posterior(first));
        let near = self.sets.iter().take_while(|set| self.log_posterior(set) > best - NEGLIGIBLE);
        let smaller = near.take(self.settings().beam).flat_map(|set| (0..set.key.len()).map(|k| without(&set.key, k)));
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
            let position = set.position(key[k]);
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
            let Some(screening) = Screening::new(&rest, &[Errors::White]) else { continue };
            let screened = screening.screen(all, &wanted);
            // The first-order gains of the others are trusted only if that of the effect itself predicts its actual
            // gain.
            let own = screened.iter().find(|own| own.index == key[k]);
            let is_predicted = own.is_some_and(|own| ALLOWANCE * own.gains[0] > white);
            let is_near = |single: &&Screened| {
                let gain = ALLOWANCE * single.gains[0];
                single.index != key[k] && (!is_predicted || gain > white - HOPELESS)
            };
            // Each is fitted with hyperparameters of its own: those of the set are narrow around its own optimum. Where
            // the set lacks nothing, squares decide. A fit below the set without the effect has failed.
            let own = self.get(key).filter(|set| !self.lacks_something(set));
            let least = own.map_or(f64::NEG_INFINITY, |set| set.least_squares.log_likelihood - HOPELESS);
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
            let near: Vec<&Screened> = screened.iter().filter(is_near).take(self.settings().singles).collect();
            let sets: Vec<FittedSet<'a>> = near.par_iter().filter_map(fitted).collect();
            self.add_all(sets, NEGLIGIBLE);
        }
        self.sort();
    }

    /// Fits sets with more effects roughly, by least squares and under the likelier output error of their parent, then
    /// those of highest evidence under all error models.
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
            parent.map_or(f64::NEG_INFINITY, |parent| parent.log_evidence + price / ALLOWANCE)
        };
        let mut trials: Vec<Trial> = Vec::new();
        // In groups: what earlier groups have reached decides which fits are hopeless.
        for group in new.chunks(AT_A_TIME) {
            let best = trials.iter().map(|trial| trial.rough.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
            let of = |new: &&Vec<&Screened>| {
                let likelier = best_start(parent, &given.point, new);
                let by_squares = self.by_squares(parent, new, likelier.as_slice(), f64::NEG_INFINITY)?;
                let begin: Vec<Start> = likelier.into_iter().chain([by_squares.start.clone()]).collect();
                let rough = self.refit.roughly(&begin, &given.errors, best - HOPELESS)?;
                Some(Trial { key: larger(parent, new), by_squares, rough })
            };
            let found: Vec<Option<Trial>> = group.par_iter().map(of).collect();
            trials.extend(found.into_iter().flatten());
        }
        let best = trials.iter().map(|trial| trial.rough.log_evidence).fold(f64::NEG_INFINITY, f64::max);
        let least = least.max(best - HOPELESS);
        trials.sort_by(|a, b| b.rough.log_evidence.total_cmp(&a.rough.log_evidence));
        let worth = trials.iter().take_while(|trial| trial.rough.log_evidence > least).count().min(full);
        let mut rest = trials.split_off(worth);
        if parent.key.is_empty() {
            // Correlated errors may take up what is missing; squares cannot.
            rest.sort_by(|a, b| b.by_squares.log_evidence.total_cmp(&a.by_squares.log_evidence));
            let leading = trials.iter().map(|trial| trial.by_squares.log_evidence).fold(f64::NEG_INFINITY, f64::max);
            trials.extend(
                rest.into_iter()
                    .take(self.settings().by_squares)
                    .filter(|trial| trial.by_squares.log_evidence > leading),
            );
        }
        let fitted = |Trial { key, by_squares, rough }: &Trial| {
            self.refit.least_squares(key, &[by_squares.start.clone(), rough.start.clone()])
        };
        let sets: Vec<FittedSet<'a>> = trials.par_iter().filter_map(fitted).collect();
        self.add_all(sets, HOPELESS);
    }

    /// Fits every candidate of one parameter by least squares, and those that leave little of the error under the error
    /// models: to first order all are alike where the residual is one smooth stroke, and correlated errors explain it
    /// without any.
    fn fit_by_squares(&mut self, parent: &FittedSet<'a>, screened: &[Screened]) {
        let is_plain = |screened: &&Screened| {
            let effect = &self.refit.candidates[screened.index].effect;
            effect.parameters().len() == 1 && !self.is_known(&with(&parent.key, screened.index))
        };
        let least = parent.with_little_error();
        let fitted = |single: &&Screened| {
            let rough = self.by_squares(parent, &[*single], &[], least)?;
            (rough.log_likelihood >= least).then_some((with(&parent.key, single.index), rough))
        };
        let plain: Vec<&Screened> = screened.iter().filter(is_plain).collect();
        let mut left: Vec<(Key, Rough)> = plain.par_iter().filter_map(fitted).collect();
        left.sort_by(|a, b| b.1.log_likelihood.total_cmp(&a.1.log_likelihood));
        left.truncate(LEAVE_LITTLE);
        let sets = left
            .par_iter()
            .filter_map(|(key, rough)| self.refit.least_squares(key, std::slice::from_ref(&rough.start)));
        let sets: Vec<FittedSet<'a>> = sets.collect();
        self.add_all(sets, HOPELESS);
    }

    /// Fits a set with more effects roughly by least squares: from the optimum of its parent by least squares, and from
    /// other starts. Gives up where the log-likelihood cannot become as large as `least`.
    fn by_squares(&self, parent: &FittedSet<'a>, new: &[&Screened], others: &[Start], least: f64) -> Option<Rough> {
        let mut from = starts(parent, &parent.least_squares.point, new);
        from.extend_from_slice(others);
        let rough = self.refit.roughly(&from, &Errors::White, least)?;
        let moved = self.refit.with_moved_states(&rough.start);
        let again = moved.and_then(|moved| self.refit.roughly(&[moved], &Errors::White, least));
        Some(again.filter(|again| again.log_likelihood > rough.log_likelihood).unwrap_or(rough))
    }
}

/// Set that was fitted roughly, by least squares and under an error model.
struct Trial {
    key: Key,
    by_squares: Rough,
    rough: Rough,
}

/// Returns the candidates of a set with further ones.
fn larger(parent: &FittedSet<'_>, new: &[&Screened]) -> Key {
    new.iter().fold(parent.key.clone(), |key, new| with(&key, new.index))
}

/// Returns white noise, and the error models of a set at the outputs.
fn output_errors(set: &FittedSet<'_>) -> Vec<Errors> {
    let of = |kind| set.estimate(kind).map(|estimate| estimate.errors.clone());
    let fitted = [ErrorModel::SmoothOutput, ErrorModel::RoughOutput].into_iter().filter_map(of);
    [Errors::White].into_iter().chain(fitted).collect()
}

/// Returns so many of the best pairs by their normal equations.
fn pairs<'s>(screened: &'s [Screened], candidates: &[Candidate], most: usize) -> Vec<(f64, Vec<&'s Screened>)> {
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
        .map(|(a, b)| (pair_gain(among[a], among[b]) - PER_PARAMETER * further(a, b), a, b))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(most).map(|(gain, a, b)| (gain, vec![among[b], among[a]])).collect()
}

/// Returns true if two candidates may act at once: a place has each characteristic once at most.
fn can_be_together(a: &Candidate, b: &Candidate) -> bool {
    let excludes = || a.effect.characteristic().is_some_and(|of| b.effect.characteristic() == Some(of));
    // Their order is not known.
    let can_follow = |a: &Candidate, b: &Candidate| a.effect.can_follow(b.effect.as_ref());
    a.index != b.index && (a.port != b.port || !excludes() && can_follow(a, b) && can_follow(b, a))
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
