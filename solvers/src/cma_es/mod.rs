//! CMA-ES: samples a normal distribution and adapts its mean, step size and covariance matrix to the best samples.

mod bipop;
mod coordinate_search;
mod distribution;
mod strategy;
mod termination;

use mops_core::{Evaluation, Halt, Merit, Oracle, Progress, Shape, Solver, SolverOptions};
use mops_math::Stream;
use nalgebra::DMatrix;
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::polishing::Polished;
use crate::ranking::ranked;
use crate::start::usable_start;
use bipop::{Bipop, Plan};
use coordinate_search::CoordinateSearch;
use distribution::Distribution;
use strategy::Strategy;
use termination::{End, History};

/// Covariance matrix adaptation evolution strategy with restarts in two regimes (BIPOP). A derivative-free global
/// search that is invariant to rotation, linear scaling and monotonic transformation of the objective.
///
/// A whole generation is evaluated in parallel. The method uses two numbers per point: the objective and the largest
/// violation. Feasible points rank first, then infeasible ones by violation, failures last. Points outside the
/// box are reflected at its faces. After the first run, line searches along every coordinate look for basins aligned
/// with the axes.
///
/// For up to about 100 tuners, rough or multimodal criteria, and budgets of at least several hundred evaluations per
/// tuner.
///
/// Source: N. Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772 (2016), with negative weights; restarts:
/// N. Hansen, GECCO (2009) 2389-2396; line searches between them: I. Loshchilov, M. Schoenauer, M. Sebag, GECCO
/// companion (2013) 1177-1184.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct CmaEsOptions {
    /// Population size of the first run; 0 for `4 + 3 ln n` with `n` tuners.
    #[schemars(range(max = 1_000_000))]
    pub population: usize,
    /// Initial standard deviation, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// A run ends when the best values of its last generations differ by less than this, relative to the objective.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Number of restarts with a doubled population. Runs with small populations use as many evaluations in total.
    #[schemars(range(max = 30))]
    pub restarts: usize,
    /// Whether local searches start from the best points at the end, with a fifth of the budget.
    pub polish: bool,
}

impl Default for CmaEsOptions {
    fn default() -> Self {
        Self { population: 0, size: 0.2, tolerance: 1e-10, restarts: 9, polish: true }
    }
}

impl SolverOptions for CmaEsOptions {
    const KIND: &'static str = "cma-es";

    fn build(&self) -> Box<dyn Solver> {
        let search = Box::new(CmaEs { options: self.clone(), state: None });
        if self.polish { Box::new(Polished::new(Self::KIND, search)) } else { search }
    }
}

/// Solver of the kind `cma-es`.
struct CmaEs {
    options: CmaEsOptions,
    state: Option<State>,
}

struct State {
    random: Stream,
    restarts: Bipop,
    run: Run,
    /// Best point, its merit, and whether the run that found it has converged.
    point: Vec<f64>,
    best: Merit,
    converged: bool,
    /// Line searches along the coordinates after the first run: the active search, and whether it is still pending.
    coordinate_search: Option<CoordinateSearch>,
    coordinate_search_pending: bool,
    /// Order of magnitude of the objective at the start, at most 1.
    unit: f64,
}

/// Run between two restarts.
struct Run {
    plan: Plan,
    distribution: Distribution,
    /// Buffer for the members of a generation.
    members: Vec<Vec<f64>>,
    history: History,
    evaluations: usize,
    improved: bool,
}

impl Solver for CmaEs {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        if start.is_empty() {
            return Ok(());
        }
        let at = oracle.evaluate(std::slice::from_ref(&start))?.pop().expect("one point, one answer");
        let default = Strategy::default_population(start.len());
        let population = if self.options.population > 0 { self.options.population } else { default };
        let restarts = Bipop::new(population, self.options.size);
        let run = self.run(restarts.first_run(), start.clone(), &oracle.shape().spacing);
        let unit = at.merit.objective.abs().min(1.0);
        let random = oracle.stream("cma-es");
        self.state = Some(State {
            random,
            restarts,
            run,
            point: start,
            best: at.merit,
            converged: false,
            coordinate_search: None,
            coordinate_search_pending: self.options.restarts > 0 && oracle.shape().dimension() > 1,
            unit,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        if oracle.shape().dimension() == 0 {
            return Ok(Progress::Converged);
        }
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if let Some(coordinate_search) = &mut state.coordinate_search {
            coordinate_search.search(oracle)?;
            return if coordinate_search.is_finished() {
                self.finish_coordinate_search(oracle)
            } else {
                Ok(Progress::Continue)
            };
        }
        let Some(end) = state.generation(oracle)? else { return Ok(Progress::Continue) };
        if state.run.improved {
            state.converged = end == End::Converged;
        }
        if std::mem::take(&mut state.coordinate_search_pending) {
            state.coordinate_search = Some(CoordinateSearch::new(state.point.clone(), state.best));
            return Ok(Progress::Continue);
        }
        self.restart(oracle)
    }
}

impl CmaEs {
    /// Starts the next run, if there is one.
    fn restart(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        let (last, evaluations) = (state.run.plan, state.run.evaluations);
        let Some(plan) = state.restarts.next(&last, evaluations, self.options.restarts, &mut state.random) else {
            return Ok(if state.converged { Progress::Converged } else { Progress::Stalled });
        };
        let n = oracle.shape().dimension();
        let start = (0..n).map(|_| state.random.random()).collect();
        let mut state = self.state.take().expect("the state exists");
        state.run = self.run(plan, start, &oracle.shape().spacing);
        self.state = Some(state);
        Ok(Progress::Continue)
    }

    /// Starts a small run at the end of the coordinate search, or the next regular run if that search found no
    /// improvement.
    fn finish_coordinate_search(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        let Some((point, merit)) = state.coordinate_search.take().and_then(CoordinateSearch::improvement) else {
            return self.restart(oracle);
        };
        (state.point, state.best, state.converged) = (point.clone(), merit, false);
        let plan = state.restarts.small_run(coordinate_search::RESTART_SIGMA);
        let mut state = self.state.take().expect("the state exists");
        state.run = self.run(plan, point, &oracle.shape().spacing);
        self.state = Some(state);
        Ok(Progress::Continue)
    }

    fn run(&self, plan: Plan, start: Vec<f64>, spacing: &[f64]) -> Run {
        // A fifth of the spacing still reaches the neighbouring value every few generations.
        let min_deviation = spacing.iter().map(|spacing| 0.2 * spacing).collect();
        Run {
            distribution: Distribution::new(start, plan.sigma, plan.population, min_deviation),
            members: vec![vec![0.0; spacing.len()]; plan.population.max(Strategy::MIN_POPULATION)],
            history: History::new(plan.sigma, self.options.tolerance),
            plan,
            evaluations: 0,
            improved: false,
        }
    }
}

impl State {
    /// Samples, evaluates and ranks a generation, and updates the distribution. Returns the reason if the run has
    /// ended.
    fn generation(&mut self, oracle: &mut dyn Oracle) -> Result<Option<End>, Halt> {
        let run = &mut self.run;
        let steps = run.distribution.sample(&mut self.random);
        place_members(&mut run.members, &run.distribution, &steps);
        let answers = oracle.evaluate(&run.members)?;
        run.evaluations += answers.len();
        let order = ranked(&answers);
        if answers[order[0]].merit.is_better_than(&self.best) {
            self.best = answers[order[0]].merit;
            self.point.clone_from(&run.members[order[0]]);
            run.improved = true;
        }
        run.distribution.update(&steps, &order);
        let values: Vec<f64> = order.iter().map(|&member| scalar_merit(&answers[member])).collect();
        let generation_best = answers[order[0]].merit;
        let comparable = generation_best.is_feasible() && self.best.is_feasible();
        let deficit = if comparable { generation_best.objective - self.best.objective } else { 0.0 };
        let end = run.history.record(&values, self.unit, deficit, &run.distribution);
        // A run that has found the best point is not limited.
        let over = run.evaluations >= run.plan.evaluations && !run.improved;
        Ok(end.or_else(|| over.then_some(End::Stagnated)))
    }
}

/// Returns a scalar that decreases as the merit improves, for the convergence tests.
fn scalar_merit(evaluation: &Evaluation) -> f64 {
    let Merit { objective, violation } = evaluation.merit;
    if evaluation.merit.is_feasible() { objective } else { violation.min(f64::MAX) }
}

/// Computes the members of a generation from their steps, reflected into the box.
fn place_members(members: &mut [Vec<f64>], distribution: &Distribution, steps: &DMatrix<f64>) {
    for (member, step) in members.iter_mut().zip(steps.column_iter()) {
        for ((coordinate, m), y) in member.iter_mut().zip(&distribution.mean).zip(&step) {
            *coordinate = reflect_into_box(m + distribution.sigma * y);
        }
    }
}

/// Returns the coordinate in [0, 1] obtained by reflection at the faces of the box.
fn reflect_into_box(u: f64) -> f64 {
    let v = u.rem_euclid(2.0);
    if v <= 1.0 { v } else { (2.0 - v).max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_outside_the_box_are_reflected() {
        for (u, v) in [(0.3, 0.3), (-0.25, 0.25), (1.25, 0.75), (2.5, 0.5), (-1.5, 0.5), (1.0, 1.0), (0.0, 0.0)] {
            assert_eq!(reflect_into_box(u), v, "{u}");
        }
    }
}
