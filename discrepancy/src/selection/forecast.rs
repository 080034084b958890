//! The forecast rule: a set must forecast better than the declared model and than every set with one effect less.

use std::collections::HashMap;

use mops_core::Role;
use rayon::prelude::*;

use super::fitted_set::{FittedSet, Key, estimation};
use super::search::{Search, without};
use crate::base;
use crate::estimation::{ErrorModel, Errors, Estimate};
use crate::fit::{Fit, Piece, Point};
use crate::settings::settings;
use crate::variant::problem;

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

/// Forecasts, each computed once.
pub struct Forecasts {
    kinds: Vec<Forecast>,
    known: HashMap<(Key, Forecast), Option<f64>>,
    passed: HashMap<Key, bool>,
}

impl Forecasts {
    /// Forecasts other records if there are any, else the ends of the calibration records.
    pub fn new(has_selection: bool) -> Self {
        let kinds = match has_selection {
            true => vec![Forecast::LeastSquares, Forecast::SmoothOutput],
            false => vec![Forecast::RunOn],
        };
        Self { kinds, known: HashMap::new(), passed: HashMap::new() }
    }

    /// Returns what is forecast.
    pub fn kinds(&self) -> &[Forecast] {
        &self.kinds
    }

    /// Returns true if other records are forecast.
    pub fn are_of_other_records(&self) -> bool {
        self.kinds.len() > 1
    }

    /// Returns true if a set forecasts better than the declared model and than every set with one effect less, with the
    /// parameters of each kind.
    pub fn passes(&mut self, search: &mut Search<'_, '_>, key: &Key) -> bool {
        let (known, new): (Vec<Key>, Vec<Key>) =
            Self::rivals(key).into_iter().partition(|key| search.get(key).is_some());
        let passes = self.beats(search, key, &known) && search.ensure(&new) && self.beats(search, key, &new);
        self.passed.insert(key.clone(), passes);
        passes
    }

    /// Returns true if a set forecasts better than all rivals.
    fn beats(&mut self, search: &Search<'_, '_>, key: &Key, rivals: &[Key]) -> bool {
        rivals.iter().all(|rival| {
            self.forecast(search, &[key, rival]);
            self.kinds.clone().into_iter().all(|kind| {
                let own = self.error(search, key, kind);
                let theirs = self.error(search, rival, kind);
                own.is_some_and(|own| theirs.is_none_or(|theirs| own < theirs))
            })
        })
    }

    /// Returns whether a set passes, if it was tested.
    pub fn passed(&self, key: &Key) -> Option<bool> {
        self.passed.get(key).copied()
    }

    /// Returns the smallest share of the mean square error above noise of a set with one effect less that a set removes.
    pub fn share(&mut self, search: &mut Search<'_, '_>, key: &Key) -> Option<f64> {
        let kind = self.kinds[0];
        let own = self.error(search, key, kind)?;
        let rivals = Self::rivals(key).into_iter();
        let shares = rivals.filter_map(|rival| Some(share(own, self.error(search, &rival, kind)?)));
        shares.min_by(f64::total_cmp)
    }

    /// Returns the share of the mean square error of the declared model above noise that a set removes.
    pub fn share_of_declared(&mut self, search: &Search<'_, '_>, key: &Key) -> Option<f64> {
        let kind = self.kinds[0];
        Some(share(self.error(search, key, kind)?, self.error(search, &Vec::new(), kind)?))
    }

    /// Returns the root mean square error of a set on the records of a role, in noises; `None` if there are none, or the forecast
    /// fails.
    pub fn error_on(set: &FittedSet<'_>, role: Role) -> Option<f64> {
        let pieces = base::pieces(set.fit.subject, |of| of == role);
        free_run(set, &set.least_squares.point, pieces).map(f64::sqrt)
    }

    /// Returns the share of the mean square error above noise of the set without an effect that the effect removes.
    pub fn share_of(&mut self, search: &Search<'_, '_>, key: &Key, index: usize) -> Option<f64> {
        let kind = self.kinds[0];
        Some(share(self.error(search, key, kind)?, self.error(search, &without(key, index), kind)?))
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
    fn forecast(&mut self, search: &Search<'_, '_>, keys: &[&Key]) {
        let all = keys.iter().flat_map(|key| self.kinds.iter().map(|kind| ((*key).clone(), *kind)));
        let new: Vec<(Key, Forecast)> = all.filter(|forecast| !self.known.contains_key(forecast)).collect();
        let errors: Vec<Option<f64>> = new.par_iter().map(|(key, kind)| error(search, key, *kind)).collect();
        self.known.extend(new.into_iter().zip(errors));
    }

    /// Returns the mean square error of a forecast in noises; `None` if it fails.
    fn error(&mut self, search: &Search<'_, '_>, key: &Key, kind: Forecast) -> Option<f64> {
        *self.known.entry((key.clone(), kind)).or_insert_with(|| error(search, key, kind))
    }
}

/// Returns the mean square error of a forecast by a set, in noises; `None` if it fails.
fn error(search: &Search<'_, '_>, key: &Key, kind: Forecast) -> Option<f64> {
    error_of(search.get(key)?, kind)
}

/// Returns the mean square error of a forecast by a fitted set, in noises; `None` if it fails.
pub fn error_of(set: &FittedSet<'_>, kind: Forecast) -> Option<f64> {
    let others = || base::pieces(set.fit.subject, |role| role == Role::Selection);
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

/// Fits the initial states of records, with the parameters of a point, to whole records and to beginnings that grow: the better of
/// both; `None` if there are none, or they cannot be simulated.
pub fn with_free_starts<'a>(set: &FittedSet<'a>, point: &Point, pieces: Vec<Piece>) -> Option<(Fit<'a>, Point)> {
    if pieces.is_empty() {
        return None;
    }
    let start = set.start_at(point);
    let locals = base::first_locals(&pieces);
    let subject = set.fit.subject;
    let (mut fit, mut point, variant) =
        problem(subject, &start.added, pieces, &start.tuners, locals, &[], set.fit.simulations);
    for (global, value) in fit.globals.iter_mut().zip(&mut point.globals) {
        global.bounds = [*value; 2];
    }
    let fitted = |fit: &Fit<'a>, from: &Point, iterations: usize| {
        let estimation = estimation(subject, fit, &variant, &start.added, &[], &point);
        estimation.with(&Errors::White, from.clone(), iterations)
    };
    let mut grown = point.clone();
    let shares = std::iter::successors(Some(2 * settings().windows), |windows| Some(windows / 2));
    for windows in shares.take_while(|windows| *windows > 1) {
        #[allow(clippy::cast_precision_loss)]
        let beginning = beginning(&fit, 1.0 / windows as f64);
        if let Some(found) = fitted(&beginning, &grown, settings().look) {
            grown = found.point;
        }
    }
    let ends = [&grown, &point].into_iter().filter_map(|start| fitted(&fit, start, settings().iterations));
    let best = ends.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?.point;
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

/// Fits a set to calibration and selection records together by least squares; `None` if they cannot be simulated.
pub fn fitted_together<'a>(set: &FittedSet<'a>) -> Option<(Fit<'a>, Point)> {
    let subject = set.fit.subject;
    let start = set.start_at(&set.least_squares.point);
    let pieces = base::pieces(subject, |role| role != Role::Validation);
    let mut locals = base::first_locals(&pieces);
    for (known, piece) in start.locals.iter().zip(&set.fit.pieces) {
        if let Some(index) = pieces.iter().position(|p| p.measurement == piece.measurement) {
            locals[index].clone_from(known);
        }
    }
    let (fit, point, variant) = problem(subject, &start.added, pieces, &start.tuners, locals, &[], set.fit.simulations);
    let point = estimation(subject, &fit, &variant, &start.added, &[], &point).least_squares(point)?.point;
    Some((fit, point))
}

/// Returns the mean square error in noises at the ends of the calibration records, run on from least squares on their beginnings.
fn run_on(set: &FittedSet<'_>) -> Option<f64> {
    let beginning = beginning(&set.fit, settings().beginning);
    let ends: Vec<f64> = beginning.pieces.iter().map(|piece| piece.horizon).collect();
    let estimation = estimation(set.fit.subject, &beginning, &set.variant, &set.added, &[], &set.least_squares.point);
    // From the optimum of every error model: at a kink, one start may end early.
    let starts = [&set.least_squares].into_iter().chain(set.under.iter().map(|(_, estimate)| estimate));
    let starts: Vec<&Point> = starts.map(|start| &start.point).collect();
    let look = |start: &&Point| estimation.with(&Errors::White, (*start).clone(), settings().look);
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
