//! The forecast rule: a set must forecast better than the declared model and than every set with one effect less.

use std::collections::HashMap;

use mops_core::Role;
use rayon::prelude::*;

use super::baseline::WINDOWS;
use super::fitted_set::{FittedSet, Key, estimation};
use super::sets::{FittedSets, NEGLIGIBLE, without};
use crate::estimation::{ErrorModel, Errors, Estimate, ITERATIONS, LOOK};
use crate::fit::{Fit, Piece, Point, pieces, problem};
use crate::records::{Local, Subject};

/// What is forecast, with whose parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Forecast {
    /// Other records, with the parameters of least squares.
    LeastSquares,
    /// Other records, with the parameters under the smooth output error.
    SmoothOutput,
    /// The ends of the calibration records, with the parameters of least squares for their beginnings.
    RunOn,
}

/// Forecasts of the sets that were tested, and which of them passed.
pub struct Forecasts {
    kinds: &'static [Forecast],
    known: HashMap<(Key, Forecast), Option<f64>>,
    tested: HashMap<Key, bool>,
    /// Sets that passed, the most probable first.
    pub passed: Vec<Key>,
    /// Sets that were not tested: an effect of theirs does nothing or is at a limit, or their fit says nothing.
    pub excluded: Vec<Key>,
    /// The most probable set that is more probable than the declared model, whether it passed or not.
    pub first: Option<Key>,
}

impl Forecasts {
    /// Forecasts with sets, the most probable first, until what follows does not count; fits those with one effect less
    /// that this needs. Forecasts other records if there are any, else the ends of the calibration records.
    pub fn of<'r, 'a>(mut sets: FittedSets<'r, 'a>) -> (FittedSets<'r, 'a>, Self) {
        sets.take_up();
        let declared = sets.log_posterior(sets.declared());
        let all = sets.sets.iter().filter(|set| !set.key.is_empty());
        let (excluded, candidates): (Vec<&FittedSet<'_>>, Vec<&FittedSet<'_>>) =
            all.partition(|set| sets.is_inert(set) || sets.is_at_limit(set) || sets.is_inconsistent(set));
        let keys = |sets: Vec<&FittedSet<'_>>| sets.into_iter().map(|set| set.key.clone()).collect::<Vec<Key>>();
        let (excluded, candidates) = (keys(excluded), keys(candidates));
        let posterior = |sets: &FittedSets<'_, '_>, key: &Key| {
            sets.get(key).map_or(f64::NEG_INFINITY, |set| sets.log_posterior(set))
        };
        let mut forecasts = Self {
            kinds: kinds(sets.refit.subject),
            known: HashMap::new(),
            tested: HashMap::new(),
            passed: Vec::new(),
            excluded,
            first: candidates.first().filter(|key| posterior(&sets, key) > declared).cloned(),
        };
        // What is less probable than the declared model is not chosen, but counts for the probabilities.
        let mut least = f64::NEG_INFINITY;
        for key in candidates {
            let posterior = posterior(&sets, &key);
            if posterior < least || posterior <= declared && forecasts.passed.is_empty() {
                break;
            }
            if forecasts.passes(&mut sets, &key) {
                least = least.max(posterior - NEGLIGIBLE);
                forecasts.passed.push(key);
            }
        }
        (sets, forecasts)
    }

    /// Returns true if other records are forecast.
    pub fn are_of_other_records(&self) -> bool {
        self.kinds.len() > 1
    }

    /// Returns true if a set forecasts better than the declared model and than every set with one effect less, with the
    /// parameters of each kind.
    fn passes(&mut self, sets: &mut FittedSets<'_, '_>, key: &Key) -> bool {
        let (known, new): (Vec<Key>, Vec<Key>) = Self::rivals(key).into_iter().partition(|key| sets.get(key).is_some());
        let passes = self.beats(sets, key, &known) && sets.ensure(&new) && self.beats(sets, key, &new);
        self.tested.insert(key.clone(), passes);
        passes
    }

    /// Returns true if a set forecasts better than all rivals.
    fn beats(&mut self, sets: &FittedSets<'_, '_>, key: &Key, rivals: &[Key]) -> bool {
        rivals.iter().all(|rival| {
            self.forecast(sets, &[key, rival]);
            self.kinds.iter().all(|&kind| {
                let own = self.error(sets, key, kind);
                let theirs = self.error(sets, rival, kind);
                own.is_some_and(|own| theirs.is_none_or(|theirs| own < theirs))
            })
        })
    }

    /// Returns whether a set passes, if it was tested.
    pub fn is_passed(&self, key: &Key) -> Option<bool> {
        self.tested.get(key).copied()
    }

    /// Returns the smallest share of the mean square error above noise of a set with one effect less that a set
    /// removes.
    pub fn share(&self, sets: &FittedSets<'_, '_>, key: &Key) -> Option<f64> {
        let kind = self.kinds[0];
        let own = self.error(sets, key, kind)?;
        let rivals = Self::rivals(key).into_iter();
        let shares = rivals.filter_map(|rival| Some(share(own, self.error(sets, &rival, kind)?)));
        shares.min_by(f64::total_cmp)
    }

    /// Returns the share of the mean square error of the declared model above noise that a set removes.
    pub fn share_of_declared(&self, sets: &FittedSets<'_, '_>, key: &Key) -> Option<f64> {
        let kind = self.kinds[0];
        Some(share(self.error(sets, key, kind)?, self.error(sets, &Vec::new(), kind)?))
    }

    /// Returns the root mean square error of a set on the records of a role, in noises; `None` if there are none, or
    /// the forecast fails.
    pub fn error_on(set: &FittedSet<'_>, role: Role) -> Option<f64> {
        let pieces = pieces::pieces(set.fit.subject, |of| of == role);
        free_run(set, &set.least_squares.point, pieces).map(f64::sqrt)
    }

    /// Returns the share of the mean square error above noise of the set without an effect that the effect removes.
    pub fn share_of(&self, sets: &FittedSets<'_, '_>, key: &Key, index: usize) -> Option<f64> {
        let kind = self.kinds[0];
        Some(share(self.error(sets, key, kind)?, self.error(sets, &without(key, index), kind)?))
    }

    /// Returns the sets with one effect less, and the declared model.
    fn rivals(key: &Key) -> Vec<Key> {
        let mut rivals: Vec<Key> = (0..key.len()).map(|k| without(key, k)).collect();
        if key.len() > 1 {
            rivals.push(Vec::new());
        }
        rivals
    }

    /// Forecasts by sets, at once.
    fn forecast(&mut self, sets: &FittedSets<'_, '_>, keys: &[&Key]) {
        let all = keys.iter().flat_map(|key| self.kinds.iter().map(|kind| ((*key).clone(), *kind)));
        let new: Vec<(Key, Forecast)> = all.filter(|forecast| !self.known.contains_key(forecast)).collect();
        let errors: Vec<Option<f64>> = new.par_iter().map(|(key, kind)| error(sets, key, *kind)).collect();
        self.known.extend(new.into_iter().zip(errors));
    }

    /// Returns the mean square error of a forecast in noises; `None` if it fails.
    fn error(&self, sets: &FittedSets<'_, '_>, key: &Key, kind: Forecast) -> Option<f64> {
        self.known.get(&(key.clone(), kind)).copied().unwrap_or_else(|| error(sets, key, kind))
    }
}

/// Returns what can be forecast: other records if there are any, else the ends of the calibration records.
pub fn kinds(subject: &Subject) -> &'static [Forecast] {
    match subject.measurements.iter().any(|m| m.role == Role::Selection) {
        true => &[Forecast::LeastSquares, Forecast::SmoothOutput],
        false => &[Forecast::RunOn],
    }
}

/// Returns the mean square error of a forecast by a set, in noises; `None` if it fails.
fn error(sets: &FittedSets<'_, '_>, key: &Key, kind: Forecast) -> Option<f64> {
    error_of(sets.get(key)?, kind)
}

/// Returns the mean square error of a forecast by a fitted set, in noises; `None` if it fails.
pub fn error_of(set: &FittedSet<'_>, kind: Forecast) -> Option<f64> {
    let others = || pieces::pieces(set.fit.subject, |role| role == Role::Selection);
    match kind {
        Forecast::LeastSquares => free_run(set, &set.least_squares.point, others()),
        Forecast::SmoothOutput => free_run(set, &set.estimate(ErrorModel::SmoothOutput)?.point, others()),
        Forecast::RunOn => run_on(set),
    }
}

/// Returns the share of a mean square error above noise that is removed.
fn share(own: f64, theirs: f64) -> f64 {
    1.0 - (own - 1.0) / (theirs - 1.0).max(f64::MIN_POSITIVE)
}

/// Returns the mean square error in noises of records, with the parameters of a point and free initial states.
pub fn free_run(set: &FittedSet<'_>, point: &Point, pieces: Vec<Piece>) -> Option<f64> {
    let (fit, point) = with_free_starts(set, point, pieces)?;
    mean_square(fit.all(&point)?.into_iter().flatten())
}

/// Fits the initial states of records, with the parameters of a point, to whole records and to beginnings that grow:
/// the better of both; `None` if there are none, or they cannot be simulated. Initial states of effects, which no
/// sensor shows, are fitted to the first part of a record only: what they explain later is a forecast.
pub fn with_free_starts<'a>(set: &FittedSet<'a>, point: &Point, pieces: Vec<Piece>) -> Option<(Fit<'a>, Point)> {
    if pieces.is_empty() {
        return None;
    }
    let start = set.start_at(point);
    let locals = pieces::first_locals(&pieces);
    let subject = set.fit.subject;
    let (mut fit, mut point, variant) =
        problem(subject, &start.added, pieces, &start.tuners, locals, &[], set.fit.simulations);
    for (global, value) in fit.globals.iter_mut().zip(&mut point.globals) {
        global.bounds = [*value; 2];
    }
    let fitted = |fit: &Fit<'a>, from: &Point, iterations: usize| {
        let estimation = estimation(subject, fit, &variant, &start.added, &[], from);
        estimation.with(&Errors::White, from.clone(), iterations)
    };
    let settled = |fit: &Fit<'a>, from: &Point| {
        let mut grown = from.clone();
        let shares = std::iter::successors(Some(2 * WINDOWS), |windows| Some(windows / 2));
        for windows in shares.take_while(|windows| *windows > 1) {
            #[allow(clippy::cast_precision_loss)]
            let beginning = beginning(fit, 1.0 / windows as f64);
            if let Some(found) = fitted(&beginning, &grown, LOOK) {
                grown = found.point;
            }
        }
        let ends = [&grown, from].into_iter().filter_map(|start| fitted(fit, start, ITERATIONS));
        Some(ends.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?.point)
    };
    let declared = subject.model.interface().parameters.len();
    let is_hidden = |local: &Local| local.parameter >= declared;
    if fit.pieces.iter().flat_map(|piece| &piece.locals).any(is_hidden) {
        point = settled(&beginning(&fit, 1.0 - subject.settings.beginning), &point)?;
        for (piece, values) in fit.pieces.iter_mut().zip(&point.locals) {
            let hidden = piece.locals.iter_mut().zip(values).filter(|(local, _)| is_hidden(local));
            hidden.for_each(|(local, value)| local.bounds = [*value; 2]);
        }
    }
    let best = settled(&fit, &point)?;
    Some((fit, best))
}

/// Returns a fit to the beginnings of its records.
fn beginning<'a>(fit: &Fit<'a>, share: f64) -> Fit<'a> {
    let mut beginning = fit.clone();
    for piece in &mut beginning.pieces {
        piece.horizon *= share;
        for series in &mut piece.series {
            let count = series.times.partition_point(|&t| t <= piece.horizon);
            series.times.truncate(count);
            series.values.truncate(count);
        }
    }
    beginning
}

/// Returns the mean square error in noises at the ends of the calibration records, run on from least squares on their
/// beginnings.
fn run_on(set: &FittedSet<'_>) -> Option<f64> {
    let beginning = beginning(&set.fit, set.fit.subject.settings.beginning);
    let ends: Vec<f64> = beginning.pieces.iter().map(|piece| piece.horizon).collect();
    let estimation = estimation(set.fit.subject, &beginning, &set.variant, &set.added, &[], &set.least_squares.point);
    // From the optimum of every error model: at a kink, one start may end early.
    let starts = [&set.least_squares].into_iter().chain(set.under.iter().map(|(_, estimate)| estimate));
    let starts: Vec<&Point> = starts.map(|start| &start.point).collect();
    let look = |start: &&Point| estimation.with(&Errors::White, (*start).clone(), LOOK);
    let looks: Vec<Estimate> = starts.par_iter().filter_map(look).collect();
    let best = looks.into_iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?;
    let fitted = if best.converged { best } else { estimation.least_squares(best.point)? };
    let mut errors = Vec::new();
    for ((index, piece), end) in set.fit.pieces.iter().enumerate().zip(&ends) {
        let residuals = set.fit.residuals(index, &fitted.point)?;
        let times = piece.series.iter().flat_map(|series| &series.times);
        errors.extend(residuals.into_iter().zip(times).filter(|(_, t)| *t > end).map(|(r, _)| r));
    }
    mean_square(errors.into_iter())
}

fn mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    (count > 0.0).then_some(sum / count)
}
