//! Problems without a known minimum: each run is compared with the best of all runs.
//!
//! Solved to `tau`: `f(x0) - f >= (1 - tau)(f(x0) - f_L)`. `f_L` is the smallest value of all runs of the benchmark and
//! of five additional solvers, with the same budget and finite differences. If the published minimum is smaller, `f_L`
//! is that minimum.
//!
//! Source: J. J. More, S. M. Wild, SIAM Journal on Optimization 20 (2009) 172-191, section 2.

use mops::{
    Catalogue, SolverKind,
    core::{Merit, catalogue::SolverChoice, evaluation::FEASIBLE},
};

use super::plan::ROUGH;
use super::results::Done;

/// Returns the additional solvers.
pub(super) fn rivals(catalogue: &Catalogue) -> Vec<SolverChoice> {
    let wanted = ["sqp", "pattern-search", "l-bfgs", "cma-es", "nelder-mead"];
    let kinds = wanted.iter().filter_map(|name| catalogue.solvers.iter().find(|kind| kind.name == *name));
    kinds.map(SolverKind::default_choice).collect()
}

/// Sets the known minimum of each run, and the evaluations until solved.
pub(super) fn judge(found: &mut [Done], others: &[Done], fine: f64) {
    let published = |done: &Done| done.row.known.unwrap_or(f64::INFINITY);
    let least = |done: &Done| least_of(&done.row.problem, found, others).min(published(done));
    let least: Vec<f64> = found.iter().map(least).collect();
    for (done, least) in found.iter_mut().zip(least) {
        let start = done.history.first().map_or(f64::INFINITY, |merit| merit.objective);
        let to = |tau: f64| {
            let limit = start - (1.0 - tau) * (start - least);
            done.history
                .iter()
                .position(|merit| merit.violation <= FEASIBLE && merit.objective <= limit)
                .map(|at| at + 1)
        };
        let (rough, fine) = (to(ROUGH), to(fine));
        done.row.known = Some(least);
        (done.row.to_rough, done.row.to_fine, done.row.solved) = (rough, fine, fine.is_some());
    }
}

fn least_of(problem: &str, found: &[Done], others: &[Done]) -> f64 {
    let of = found.iter().chain(others).filter(|done| done.row.problem == problem);
    let feasible = |merit: &&Merit| merit.violation <= FEASIBLE;
    of.flat_map(|done| done.history.iter().filter(feasible)).map(|merit| merit.objective).fold(f64::INFINITY, f64::min)
}
