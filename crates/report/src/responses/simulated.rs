//! Simulations with plots.

use super::super::Report;
use super::super::comparison::Comparison;

/// Simulation of a job at the initial guess and at the reported point.
pub(super) struct Simulated {
    pub(super) job: usize,
    pub(super) both: Comparison,
}

/// Returns the largest scaled value of every job at the reported point; infinity if a criterion has no value.
pub(super) fn worst(report: &Report<'_>) -> Vec<f64> {
    let study = report.solution.problem.study();
    let mut worst = vec![f64::NEG_INFINITY; study.jobs().len()];
    for (row, reading) in study.rows().iter().zip(&report.solution.best.readings) {
        let scaled = reading.map_or(f64::INFINITY, |reading| reading.scaled);
        // N.B.: `max` ignores NaN.
        worst[row.job] = worst[row.job].max(scaled);
    }
    worst
}
