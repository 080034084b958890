//! Search for the worst case of one criterion: an ordinary solver, applied to the criterion with reversed sign.

use std::sync::Arc;

use mops_core::{
    Demand, Evaluation, Oracle, Problem, Run, Solver, SolverOptions, Study, Usage, Watch,
    run::{Budget, Quiet, Store},
};
use mops_solvers::{cma_es::CmaEsOptions, pattern_search::PatternSearchOptions, sqp::SqpOptions};

use crate::copies::Copies;

/// Problem of a search: the maximum of a criterion, or the minimum for the other side of an equality.
pub(super) struct Goal {
    pub row: usize,
    pub problem: Problem,
    pub upwards: bool,
    store: Option<Copies>,
}

impl Goal {
    /// Creates the search for the maximum or minimum of a row of a study over its uncertain parameters.
    pub(super) fn new(study: &Study, row: usize, upwards: bool, store: Option<&Copies>) -> Self {
        let mut only = study.rows()[row].clone();
        (only.usage, only.weight) = (Usage::Minimise, 1.0);
        only.reversed = upwards;
        if only.demand == Demand::None {
            only.demand = Demand::AtMost(1.0);
        }
        let study = study.clone().with_rows(vec![only]);
        let store = store.map(|store| store.of_row(row));
        Self { row, problem: Problem::new(Arc::new(study)), upwards, store }
    }

    /// Creates the searches of all rows: the maximum of every row, and the minimum of equalities.
    pub(super) fn all(study: &Study, store: Option<&Copies>) -> Vec<Self> {
        let rows = study.rows().iter().enumerate();
        rows.flat_map(|(i, row)| {
            let down = (row.usage == Usage::Equality).then(|| Self::new(study, i, false, store));
            std::iter::once(Self::new(study, i, true, store)).chain(down)
        })
        .collect()
    }
}

/// Result of a search.
pub(super) struct End {
    pub evaluation: Option<Evaluation>,
    pub simulations: usize,
    pub failed: Vec<(String, Vec<f64>)>,
}

/// Searches from one start: gradient-based, then derivative-free, as the worst case may be at a discontinuity.
pub(super) fn local(goal: &Goal, start: &[f64], watch: &dyn Watch) -> End {
    let n = start.len();
    let steps: [(_, usize); 2] = [
        (SqpOptions { radius: 0.25, ..SqpOptions::default() }.local(), 40 * (n + 1)),
        (PatternSearchOptions { size: 0.02, tolerance: 1e-6, ..PatternSearchOptions::default() }.local(), 60 * (n + 1)),
    ];
    let mut end = End { evaluation: None, simulations: 0, failed: Vec::new() };
    for (mut solver, evaluations) in steps {
        let from = end.evaluation.as_ref().map_or_else(|| start.to_vec(), |e| e.point.clone());
        search_once(goal, solver.as_mut(), &from, evaluations, watch, &mut end);
    }
    end
}

/// Searches the whole box by CMA-ES, then locally.
pub(super) fn whole(goal: &Goal, start: &[f64], watch: &dyn Watch) -> End {
    let mut end = End { evaluation: None, simulations: 0, failed: Vec::new() };
    let mut solver = CmaEsOptions { restarts: 0, tolerance: 1e-6, ..CmaEsOptions::default() }.build();
    search_once(goal, solver.as_mut(), start, 80 * (start.len() + 1), watch, &mut end);
    let from = end.evaluation.as_ref().map_or_else(|| start.to_vec(), |e| e.point.clone());
    let polished = local(goal, &from, watch);
    end.simulations += polished.simulations;
    end.failed.extend(polished.failed);
    End { evaluation: polished.evaluation, ..end }
}

fn search_once(
    goal: &Goal,
    solver: &mut dyn Solver,
    from: &[f64],
    evaluations: usize,
    watch: &dyn Watch,
    end: &mut End,
) {
    let quiet = Quiet(watch);
    let store = goal.store.as_ref().map(|store| store as &dyn Store);
    let mut run = Run::new(&goal.problem, Budget { evaluations }, &quiet).keeping(store);
    run.solve(solver, from);
    end.simulations += (run.archive().len() + run.linearisations()) * goal.problem.simulations();
    let why = run.failures().first().map_or_else(String::new, |failure| failure.first.to_string());
    let failed = run.archive().iter().filter(|record| record.merit.objective.is_infinite());
    end.failed.extend(failed.map(|record| (why.clone(), record.tuners.clone())));
    let found = run.best().filter(|best| best.scaled.is_some());
    if let Some(found) = found {
        let better = end.evaluation.as_ref().is_none_or(|known| found.merit.is_better_than(&known.merit));
        if better {
            end.evaluation = Some(found.clone());
        }
    }
}
