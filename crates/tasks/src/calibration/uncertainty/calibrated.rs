//! Calibration whose uncertainty is asked for.

use mops_core::run::{Budget, Quiet};
use mops_core::{Evaluation, Oracle, Problem, Run, Solver, Study, Watch};
use mops_identification::Covariance;

/// Calibrated problem, the common input of all three methods.
pub(super) struct Calibrated<'a> {
    pub(super) problem: &'a Problem,
    pub(super) best: &'a Evaluation,
    pub(super) covariance: Covariance,
    /// Confidence of the intervals.
    pub(super) level: f64,
}

/// Estimates the active tuners of a study again, from their start values; returns the fit and the number of
/// simulations.
pub(super) fn refit(study: Study, mut solver: Box<dyn Solver>, watch: &dyn Watch) -> (Option<Evaluation>, usize) {
    let problem = Problem::new(std::sync::Arc::new(study));
    let start = problem.start();
    if problem.active().is_empty() {
        let at = problem.evaluate(&start);
        return (Some(at).filter(|e| e.scaled.is_some()), problem.simulations());
    }
    let quiet = Quiet(watch);
    let mut run = Run::new(&problem, Budget { evaluations: 100 * (problem.active().len() + 1) }, &quiet);
    run.solve(solver.as_mut(), &start);
    let simulations = (run.archive().len() + run.linearisations()) * problem.simulations();
    (run.best().filter(|best| best.scaled.is_some()).cloned(), simulations)
}

/// Returns the study with its tuners at given values, and one of them fixed.
pub(super) fn fixed_at(problem: &Problem, tuners: &[f64], fixed: Option<usize>) -> Study {
    let mut study = Study::clone(problem.study());
    for (i, &value) in tuners.iter().enumerate() {
        study.set_start(i, value);
        if Some(i) == fixed || !problem.active().contains(&i) {
            study.fix(i);
        }
    }
    study
}
