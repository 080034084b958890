//! The forecast rule: a set must forecast other records better than the declared model and than every set with one effect less.

use std::collections::HashMap;

use mops_core::Role;

use super::fitted_set::{FittedSet, Key};
use super::search::{Search, without};
use crate::base;
use crate::estimation::ErrorModel;
use crate::fit::{Piece, Point};
use crate::variant::problem;

/// Whose parameters forecast.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameters {
    /// Those of least squares.
    LeastSquares,
    /// Those under the smooth output error.
    SmoothOutput,
}

/// Forecasts, each computed once.
#[derive(Default)]
pub struct Forecasts {
    known: HashMap<(Key, Parameters, bool), Option<f64>>,
}

impl Forecasts {
    /// Returns true if a set forecasts the records of role selection better than the declared model and every set with one effect
    /// less, with the parameters of least squares and with those under the smooth output error.
    pub fn passes(&mut self, search: &mut Search<'_, '_>, key: &Key) -> bool {
        let mut rivals: Vec<Key> = (0..key.len()).map(|k| without(key, k)).collect();
        if key.len() > 1 {
            rivals.push(Vec::new());
        }
        rivals.iter().all(|rival| {
            search.ensure(rival)
                && [Parameters::LeastSquares, Parameters::SmoothOutput].into_iter().all(|parameters| {
                    let own = self.of(search, key, parameters, Role::Selection);
                    let theirs = self.of(search, rival, parameters, Role::Selection);
                    own.is_some_and(|own| theirs.is_none_or(|theirs| own < theirs))
                })
        })
    }

    /// Returns the mean square error in noises of the free run of the records of a role, with free initial states; `None` if there
    /// are no such records, or a simulation fails.
    pub fn of(&mut self, search: &Search<'_, '_>, key: &Key, parameters: Parameters, role: Role) -> Option<f64> {
        *self.known.entry((key.clone(), parameters, role == Role::Selection)).or_insert_with(|| {
            let set = search.get(key)?;
            let point = match parameters {
                Parameters::LeastSquares => &set.least_squares.point,
                Parameters::SmoothOutput => &set.estimate(ErrorModel::SmoothOutput)?.point,
            };
            free_run(set, point, base::pieces(set.fit.subject, |r| r == role))
        })
    }
}

/// Returns the mean square error in noises of records, with the parameters of a point and free initial states.
pub fn free_run(set: &FittedSet<'_>, point: &Point, pieces: Vec<Piece>) -> Option<f64> {
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
    let found = super::fitted_set::estimation(subject, &fit, &variant, &start.added, &[]).least_squares(point)?;
    let residuals = fit.all(&found.point)?;
    #[allow(clippy::cast_precision_loss)]
    let count = residuals.iter().map(Vec::len).sum::<usize>() as f64;
    Some(residuals.iter().flatten().map(|r| r * r).sum::<f64>() / count)
}
