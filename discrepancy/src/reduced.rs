//! What can be left out of a model: effects that others make superfluous, declared terms that effects do.

use mops_core::Role;
use mops_core::math;
use rayon::prelude::*;

use crate::diagnose::UNEXPLAINED;
use crate::fit::dot;
use crate::search::{Search, Trial};
use crate::subject::Measurement;
use crate::variant::problem;
use crate::weigh::{Dispersion, by_chance};

impl<'a> Search<'a> {
    /// The trial without one of its effects, fitted again.
    pub fn without(&self, trial: &Trial<'a>, index: usize) -> Option<Trial<'a>> {
        let mut added = trial.added.clone();
        added.remove(index);
        self.from(trial, &added, 40)
    }

    /// The trial without effects that the others make superfluous, or that are at their limits; `None` where each is needed.
    /// To leave one out may not drive another to its limit.
    pub fn pruned(&self, trial: &Trial<'a>, level: f64) -> Option<Trial<'a>> {
        /// Directions that chance is allowed. An assumption: the rounds that found the effects looked in other numbers of them.
        const DIRECTIONS: f64 = 30.0;
        let mut pruned: Option<Trial<'a>> = None;
        let mut index = 0;
        loop {
            let last = pruned.as_ref().unwrap_or(trial);
            let is_alone = last.added.len() == 1 && last.is_physical();
            if is_alone || index >= last.added.len() {
                return pruned;
            }
            let superfluous = |without: &Trial<'a>| {
                let loss = (without.fitted.chi2 - last.fitted.chi2) / Dispersion::of(last).weight();
                last.added[index].is_at_limit() || (without.is_physical() && by_chance(loss, DIRECTIONS) > level)
            };
            match self.without(last, index).filter(superfluous) {
                Some(without) => (pruned, index) = (Some(without), 0),
                None => index += 1,
            }
        }
    }

    /// The trial less the one effect without which the model, fitted to calibration data alone, forecasts selection data best;
    /// `None` where each makes the forecast better, is not seen in these data, or is needed to explain all data. What helps the
    /// fit may hurt the forecast; a model that misses something forecasts badly whatever it has, and tells nothing of it.
    pub fn forecasting_better(&self, trial: &Trial<'a>) -> Option<Trial<'a>> {
        /// Squared distance of two forecasts, in units of the noise, from which on the data tell which is right: if one is, the
        /// sum of squares of the other is larger by a normal variable of mean `d^2` and deviation `2 d`, below 0 once in 140.
        const SEEN: f64 = 24.0;
        let is_selection = |m: &Measurement| m.role == Role::Selection;
        if trial.added.len() < 2 || trial.windows > 1 || !self.subject.measurements.iter().any(is_selection) {
            return None;
        }
        let whole = self.left_on_selection_data(trial)?;
        let weight = Dispersion::of(trial).weight();
        let less = |index: usize| {
            let explains = |less: &Trial<'a>| less.is_physical() && less.fitted.normalised() <= UNEXPLAINED;
            let less = self.without(trial, index).filter(explains)?;
            let left = self.left_on_selection_data(&less)?;
            let apart: f64 = left.iter().zip(&whole).map(|(a, b)| math::powi(a - b, 2)).sum();
            (apart / weight >= SEEN).then(|| (dot(&left, &left), less))
        };
        let tried: Vec<(f64, Trial<'a>)> = (0..trial.added.len()).into_par_iter().filter_map(less).collect();
        let (error, best) = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        (error < dot(&whole, &whole)).then_some(best)
    }

    /// The trial with declared terms at zero that the effects make superfluous, and which tuners those are: factors that
    /// may be zero, and are no larger than their uncertainty.
    pub fn without_declared(&self, trial: Trial<'a>) -> (Trial<'a>, Vec<usize>) {
        let mut held = Vec::new();
        let mut trial = trial;
        if trial.added.is_empty() {
            return (trial, held);
        }
        let covariance = |trial: &Trial<'_>| trial.fit.covariance(&trial.fitted, Dispersion::of(trial).weight());
        let mut errors = covariance(&trial);
        for k in 0..self.subject.globals.len() {
            let global = &trial.fit.globals[k];
            let value = trial.fitted.point.globals[k];
            let error = errors[(k, k)].max(0.0).sqrt();
            let at_least = value <= global.bounds[0] * (1.0 + 1e-9);
            let [low, high] = global.bounds;
            let zero = (low <= 0.0 && high >= 0.0) || (global.log && low > 0.0);
            if !(zero && (at_least || value.abs() < 2.0 * error)) {
                continue;
            }
            let mut tuners = trial.fitted.point.globals[..self.subject.globals.len()].to_vec();
            tuners[k] = 0.0;
            let (own, locals) = (self.pieces(trial.windows), self.own_locals(&trial));
            let all: Vec<usize> = held.iter().copied().chain([k]).collect();
            let made = problem(self.subject, &trial.added, own, &tuners, locals, &all, self.simulations);
            let Some(fitted) = made.0.solve(made.1, 40) else { continue };
            let of = Dispersion::of(&trial);
            if (fitted.chi2 - trial.fitted.chi2) / of.weight() < of.worth(fitted.count) {
                held = all;
                let (added, windows) = (trial.added.clone(), trial.windows);
                trial = Trial { added, windows, fit: made.0, variant: made.2, fitted }.read();
                errors = covariance(&trial);
            }
        }
        (trial, held)
    }
}
