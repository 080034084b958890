//! Pattern search: polls a pattern of points around the best one and shrinks it after an unsuccessful poll.

mod barrier;
mod pattern;
mod point_buffer;
mod quadratic_models;
mod sample_set;
mod trust_region_subproblem;

use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use mops_math as math;
use mops_math::Stream;
use nalgebra::{DMatrix, DVector, DVectorView, DVectorViewMut};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::cholesky::with_cholesky;
use crate::linearised_criteria::LinearisedCriteria;
use crate::multistart::Multistart;
use crate::noise_detection::{Smoothness, detect_smoothness};
use crate::sqp::SqpOptions;
use crate::start::usable_start;
use barrier::{Barrier, PredictedReduction};
use pattern::Pattern;
use point_buffer::PointBuffer;
use quadratic_models::QuadraticModels;
use sample_set::SampleSet;
use trust_region_subproblem::{PenalisedObjective, TrustRegionSubproblem};

/// Mesh-adaptive direct search (MADS) with quadratic models. Needs no gradients: for discontinuous or noisy criteria
/// and for tuners with whole numbers or lists.
///
/// Poll: the points of a pattern around the best point are evaluated, the most promising first. A better point is
/// accepted; otherwise the pattern shrinks and changes its orientation. The search ends at a given pattern size.
///
/// Search: before each poll, every criterion has a quadratic model of its own through the points around the best one.
/// The point that minimises the largest model in a trust region is evaluated. So the search resolves the kinks
/// (non-differentiable points) where two criteria intersect. A progressive barrier handles constraints: objective and
/// violation are compared separately, and the permitted violation decreases.
///
/// Kinks inside a criterion: neither models nor polls succeed although the models predict a large decrease. Unless the
/// values are noisy, the search then follows finite-difference gradients (as `sqp` does) as long as they give progress.
///
/// Source: C. Audet, J. E. Dennis, SIAM J. Optimization 17 (2006) 188-217 (MADS); rotated patterns: M. A. Abramson, C.
/// Audet, J. E. Dennis, S. Le Digabel, SIAM J. Optimization 20 (2009) 948-966; models: A. R. Conn, K. Scheinberg, L. N.
/// Vicente, Introduction to Derivative-Free Optimization (SIAM 2009), chapters 5 and 10; one model per criterion: J.
/// Larson, M. Menickelly, S. M. Wild, SIAM J. Optimization 26 (2016) 2540-2563; barrier: C. Audet, J. E. Dennis, SIAM
/// J. Optimization 20 (2009) 445-472.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct PatternSearchOptions {
    /// Largest number of starting points: the initial guess of the study, and the best points of a sample of the box.
    #[schemars(range(min = 1, max = 10_000))]
    pub starts: usize,
    /// Initial size of the pattern, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// Pattern size at which the search ends, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Factor of the pattern size after an unsuccessful poll. Smaller values end the search sooner; larger values poll
    /// more often.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub shrink: f64,
    /// Number of points evaluated at once, in a poll and together with a model step; 0 for the whole pattern.
    #[schemars(range(max = 10_000))]
    pub batch: usize,
}

impl Default for PatternSearchOptions {
    fn default() -> Self {
        Self { starts: 8, size: 0.1, tolerance: 1e-7, shrink: 0.5, batch: 2 }
    }
}

impl SolverOptions for PatternSearchOptions {
    const KIND: &'static str = "pattern-search";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Multistart::new(self.local(), self.starts))
    }
}

impl PatternSearchOptions {
    /// Builds the solver from one starting point.
    pub fn local(&self) -> Box<dyn Solver> {
        Box::new(PatternSearch { options: self.clone(), state: None, workspace: Workspace::default() })
    }
}

/// Solver of the kind `pattern-search`.
struct PatternSearch {
    options: PatternSearchOptions,
    state: Option<State>,
    workspace: Workspace,
}

/// Models of the criteria and buffers that are reused between steps.
#[derive(Default)]
struct Workspace {
    models: QuadraticModels,
    subproblem: TrustRegionSubproblem,
    /// Known points around the best one, with their distances.
    neighbours: Vec<(f64, usize)>,
    /// Trust region intersected with the box, in steps of the models.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Points of the pattern, and their order by model value, without the points already known.
    pattern: PointBuffer,
    order: Vec<(f64, usize)>,
    /// Points to be evaluated next.
    trial_points: PointBuffer,
    step: Vec<f64>,
    values: Vec<f64>,
    /// Previous position of the search.
    previous: Vec<f64>,
    spread: Vec<f64>,
}

struct State {
    best: Evaluation,
    samples: SampleSet,
    /// Size of the pattern and radius of the trust region.
    radius: f64,
    /// Last predicted reduction of the penalised objective.
    predicted: f64,
    /// Number of restarts because of a kink.
    kink_restarts: i32,
    /// Number of restarts after an infeasible end.
    feasibility_restarts: usize,
    /// Number of successive model steps without success.
    model_failures: usize,
    /// Best point at the last reorientation of the pattern.
    point_at_last_reorientation: Option<Vec<f64>>,
    /// Weight of the violation in the penalised objective of the models.
    penalty: f64,
    /// Acceptance of points under constraints.
    barrier: Barrier,
    objective_scale: f64,
    pattern: Pattern,
    /// Number of points evaluated at once; 0 for the whole pattern.
    batch: usize,
    random: Stream,
    spacing: Vec<f64>,
    /// True after the first poll.
    has_polled: bool,
    /// Gradient-based solver, while it follows a kink inside a criterion.
    gradient_solver: Option<Box<dyn Solver>>,
    /// Penalised objective at the last start of the gradient-based solver; infinite before the first.
    gradient_start_value: f64,
    /// Smoothness of the criteria; `None` before it is needed.
    smoothness: Option<Smoothness>,
}

impl Workspace {
    /// Adds up to `count` points of the ranked pattern to the trial points, starting at rank `first`.
    fn push_pattern_points(&mut self, first: usize, count: usize) {
        for &(_, i) in self.order.iter().skip(first).take(count) {
            self.trial_points.push(self.pattern.as_slice()[i].iter().copied());
        }
    }
}

impl Solver for PatternSearch {
    fn accepts(&self, _: &Shape) -> Result<(), String> {
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let best = oracle.evaluate(&[start])?.pop().expect("one point, one answer");
        let n = best.point.len();
        let scaled = best.scaled.as_ref().expect("the start is usable");
        let mut samples = SampleSet::new(n, scaled.len());
        samples.insert(&best.point, scaled);
        self.workspace = Workspace { models: QuadraticModels::new(n, scaled.len()), ..Workspace::default() };
        self.state = Some(State {
            objective_scale: LinearisedCriteria::from_values(oracle.shape(), scaled).objective_scale(),
            samples,
            point_at_last_reorientation: None,
            radius: self.options.size,
            model_failures: 0,
            predicted: 0.0,
            kink_restarts: 0,
            feasibility_restarts: 0,
            penalty: 10.0,
            barrier: Barrier::new(&best.merit),
            pattern: Pattern::coordinate_axes(n),
            batch: self.options.batch,
            random: oracle.stream("pattern-search"),
            spacing: oracle.shape().spacing.clone(),
            has_polled: false,
            gradient_solver: None,
            gradient_start_value: f64::INFINITY,
            smoothness: None,
            best,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Self { options, state, workspace } = self;
        let Some(state) = state else { return Ok(Progress::Stalled) };
        if state.best.point.is_empty() {
            return Ok(Progress::Converged);
        }
        if state.gradient_solver.is_some() {
            state.gradient_step(oracle)?;
            return Ok(Progress::Continue);
        }
        state.drop_oldest();
        if state.has_polled && state.search(oracle, workspace)? {
            return Ok(Progress::Continue);
        }
        let better = state.poll(oracle, workspace)?;
        state.has_polled = true;
        if better || state.start_gradient_phase(oracle)? {
            return Ok(Progress::Continue);
        }
        if state.radius > options.tolerance && !state.is_on_finest_grid() {
            state.shrink(options.shrink);
            return Ok(Progress::Continue);
        }
        // The predicted reduction is not achieved: a kink inside a criterion. Restart with a slower shrinkage and more
        // orientations.
        let penalised_value = state.penalised_value(oracle.shape(), &state.best);
        if state.predicted > FINAL_KINK_THRESHOLD * penalised_value.abs() && state.kink_restarts < MAX_KINK_RESTARTS {
            state.kink_restarts += 1;
            state.radius = options.shrink * options.size;
            return Ok(Progress::Continue);
        }
        // Infeasible end: continue from the best feasible point, or with a wide pattern from here.
        if !state.best.merit.is_feasible() && state.feasibility_restarts < MAX_FEASIBILITY_RESTARTS {
            state.feasibility_restarts += 1;
            if let Some(best) = oracle.best().filter(|best| best.merit.is_feasible()) {
                state.move_to(best);
            }
            state.gradient_start_value = f64::INFINITY;
            state.radius = options.size;
            return Ok(Progress::Continue);
        }
        Ok(if state.best.merit.is_feasible() { Progress::Converged } else { Progress::Stalled })
    }
}

/// Predicted reduction at the end of the search, relative to the penalised objective, that indicates a kink.
const FINAL_KINK_THRESHOLD: f64 = 1e-10;

/// Predicted reduction during the search, relative to the penalised objective, that indicates a kink.
const KINK_THRESHOLD: f64 = 1e-4;

/// Initial trust-region radius of the gradient-based solver, in pattern sizes.
const GRADIENT_RADIUS_FACTOR: f64 = 3.0;

/// Maximum number of restarts because of a kink.
const MAX_KINK_RESTARTS: i32 = 4;

/// Maximum number of restarts after an infeasible end.
const MAX_FEASIBILITY_RESTARTS: usize = 3;

/// Number of successive model steps without success before a poll.
const MAX_MODEL_FAILURES: usize = 2;

impl State {
    fn penalised_objective<'a>(&self, shape: &'a Shape) -> PenalisedObjective<'a> {
        PenalisedObjective { shape, objective_scale: self.objective_scale, penalty: self.penalty }
    }

    fn penalised_value(&self, shape: &Shape, evaluation: &Evaluation) -> f64 {
        evaluation.scaled.as_ref().map_or(f64::INFINITY, |scaled| self.penalised_objective(shape).value(scaled))
    }

    /// Evaluates and stores points, and moves to the best one that the barrier accepts; returns true after a move. The
    /// predicted reduction applies to the first point.
    fn evaluate_and_move(
        &mut self,
        oracle: &mut dyn Oracle,
        points: &[Vec<f64>],
        predicted: Option<PredictedReduction>,
    ) -> Result<bool, Halt> {
        let previous = self.best.merit;
        let mut moved = false;
        for (index, answer) in oracle.evaluate(points)?.into_iter().enumerate() {
            self.record(&answer);
            if self.barrier.accepts(&self.best.merit, &answer.merit, predicted.filter(|_| index == 0)) {
                self.barrier.record(&answer.merit);
                self.best = answer;
                moved = true;
            }
        }
        if moved {
            self.barrier.tighten(&previous, &self.best.merit);
        }
        Ok(moved)
    }

    fn record(&mut self, answer: &Evaluation) {
        if let Some(scaled) = &answer.scaled {
            self.samples.insert(&answer.point, scaled);
        }
    }

    /// Continues from a point found by another solver.
    fn move_to(&mut self, best: &Evaluation) {
        self.best = best.clone();
        self.barrier.record(&best.merit);
        self.record(best);
    }

    /// Drops the oldest points if there are many.
    fn drop_oldest(&mut self) {
        if self.samples.drop_oldest()
            && let Some(scaled) = &self.best.scaled
        {
            self.samples.insert(&self.best.point, scaled);
        }
    }

    /// Evaluates the minimiser of the models, and points of the pattern to fill a batch. Returns false when a poll is
    /// due.
    fn search(&mut self, oracle: &mut dyn Oracle, workspace: &mut Workspace) -> Result<bool, Halt> {
        if self.spacing.iter().all(|&spacing| spacing > 0.0) || !self.fit(workspace) {
            return Ok(false);
        }
        let shape = oracle.shape();
        let mut objective = self.penalised_objective(shape);
        let found = self.solve_subproblem(&mut objective, workspace);
        if objective.penalty > self.penalty {
            self.penalty = objective.penalty;
            // A new penalty makes earlier values incomparable.
            self.gradient_start_value = f64::INFINITY;
        }
        if !found {
            self.predicted = 0.0;
            return self.improve_geometry(oracle, workspace);
        }
        let reduction = objective.predicted_reduction(workspace.models.constants(), workspace.subproblem.values());
        let relative_penalty = objective.relative_penalty();
        self.predicted = objective.penalised_reduction(&reduction);
        let y = workspace.subproblem.step();
        let length = self.radius * y.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        let floor = 1e-14 * self.penalised_value(shape, &self.best).abs();
        workspace.trial_points.clear();
        workspace.trial_points.push(self.point_at(y));
        if self.predicted <= floor || workspace.trial_points.as_slice()[0] == self.best.point {
            return self.improve_geometry(oracle, workspace);
        }
        self.fill_batch(shape, workspace);
        let previous = self.best.merit;
        let moved = self.evaluate_and_move(oracle, workspace.trial_points.as_slice(), Some(reduction))?;
        let ratio = if moved { reduction.reduction_ratio(&previous, &self.best.merit, relative_penalty) } else { 0.0 };
        if moved {
            self.model_failures = 0;
        } else if self.improve_geometry(oracle, workspace)? {
            // The models were inaccurate because of too few points.
            return Ok(true);
        } else {
            self.model_failures += 1;
        }
        if ratio >= 0.7 {
            self.radius = self.radius.max((2.0 * length).min(0.5));
        } else if ratio < 0.1 {
            self.radius = self.radius.min(length).max(0.1 * self.radius);
        }
        Ok(self.model_failures < MAX_MODEL_FAILURES)
    }

    /// Fits the models to the known points around the best one; returns false if these do not determine them.
    fn fit(&self, workspace: &mut Workspace) -> bool {
        self.samples.neighbours(&self.best.point, self.radius, &mut workspace.neighbours);
        workspace.models.fit(&self.samples, &workspace.neighbours, &self.best.point, self.radius)
    }

    /// Minimises the models in the trust region, inside the box.
    fn solve_subproblem(&self, objective: &mut PenalisedObjective, workspace: &mut Workspace) -> bool {
        workspace.low.clear();
        workspace.low.extend(self.best.point.iter().map(|u| (-u / self.radius).max(-1.0)));
        workspace.high.clear();
        workspace.high.extend(self.best.point.iter().map(|u| ((1.0 - u) / self.radius).min(1.0)));
        workspace.subproblem.solve(objective, &workspace.models, &workspace.low, &workspace.high)
    }

    /// Evaluates a point in the direction that the interpolation points cover least; returns false if their geometry is
    /// adequate.
    fn improve_geometry(&mut self, oracle: &mut dyn Oracle, workspace: &mut Workspace) -> Result<bool, Halt> {
        let Workspace { models, step, values, spread, .. } = &mut *workspace;
        if !least_sampled_direction(models, self.best.point.len(), spread, step) {
            return Ok(false);
        }
        let objective = self.penalised_objective(oracle.shape());
        let mut penalised_value = |step: &[f64]| {
            models.values(step, values);
            objective.value(values)
        };
        let there = penalised_value(step);
        step.iter_mut().for_each(|d| *d = -*d);
        if there <= penalised_value(step) {
            step.iter_mut().for_each(|d| *d = -*d);
        }
        workspace.trial_points.clear();
        workspace.trial_points.push(self.point_at(&workspace.step));
        if self.samples.contains(&workspace.trial_points.as_slice()[0]) {
            return Ok(false);
        }
        let count = self.samples.len();
        self.fill_batch(oracle.shape(), workspace);
        self.evaluate_and_move(oracle, workspace.trial_points.as_slice(), None)?;
        Ok(self.samples.len() > count)
    }

    /// Polls the pattern, the most promising points first; returns true if a point was accepted.
    fn poll(&mut self, oracle: &mut dyn Oracle, workspace: &mut Workspace) -> Result<bool, Halt> {
        self.model_failures = 0;
        self.fit(workspace);
        self.rank_pattern(oracle.shape(), workspace);
        let count = workspace.order.len();
        // The first models interpolate the whole first pattern.
        let batch = if self.has_polled && self.batch > 0 { self.batch } else { count.max(1) };
        for first in (0..count).step_by(batch) {
            workspace.trial_points.clear();
            workspace.push_pattern_points(first, batch);
            workspace.previous.clone_from(&self.best.point);
            if self.evaluate_and_move(oracle, workspace.trial_points.as_slice(), None)? {
                self.extrapolate(oracle, workspace)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Fills the batch with the most promising points of the pattern.
    fn fill_batch(&self, shape: &Shape, workspace: &mut Workspace) {
        if workspace.trial_points.len() < self.batch {
            self.rank_pattern(shape, workspace);
            workspace.push_pattern_points(0, self.batch - workspace.trial_points.len());
        }
    }

    /// Collects the unknown points of the pattern around the best one, ranked by the models if these are fitted.
    fn rank_pattern(&self, shape: &Shape, workspace: &mut Workspace) {
        let Workspace { models, pattern, order, step, values, .. } = workspace;
        self.pattern.points(&self.best.point, self.radius, &self.spacing, pattern);
        let objective = self.penalised_objective(shape);
        order.clear();
        for (i, point) in pattern.as_slice().iter().enumerate() {
            if self.samples.contains(point) {
                continue;
            }
            if models.is_fitted() {
                step.clear();
                step.extend(point.iter().zip(&self.best.point).map(|(a, b)| (a - b) / self.radius));
                models.values(step, values);
                order.push((objective.value(values), i));
            } else {
                order.push((0.0, i));
            }
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// Continues in the direction of a successful poll, doubling the step as long as points are accepted.
    fn extrapolate(&mut self, oracle: &mut dyn Oracle, workspace: &mut Workspace) -> Result<(), Halt> {
        loop {
            let here = &self.best.point;
            workspace.step.clear();
            workspace.step.extend(
                here.iter().zip(&workspace.previous).map(|(here, previous)| 2.0 * (here - previous) / self.radius),
            );
            workspace.trial_points.clear();
            for _ in 0..self.batch.max(1) {
                let is_new = |point: &[f64], previous: &[Vec<f64>]| {
                    point != here && previous.last().is_none_or(|last| point != last)
                };
                workspace.trial_points.push_if(self.point_at(&workspace.step), is_new);
                workspace.step.iter_mut().for_each(|step| *step *= 2.0);
            }
            if workspace.trial_points.len() == 0 {
                return Ok(());
            }
            workspace.previous.clone_from(here);
            // Near the boundary of the box few points remain.
            if workspace.trial_points.len() < self.batch {
                self.fit(workspace);
                self.fill_batch(oracle.shape(), workspace);
            }
            if !self.evaluate_and_move(oracle, workspace.trial_points.as_slice(), None)? {
                return Ok(());
            }
        }
    }

    /// Starts the gradient-based solver if the predicted reduction is not achieved. Returns false otherwise, if the
    /// last start gave no progress, or if the criteria are noisy.
    fn start_gradient_phase(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        let penalised_value = self.penalised_value(oracle.shape(), &self.best);
        let promising = self.predicted > KINK_THRESHOLD * penalised_value.abs();
        let was_useful = self.gradient_start_value - penalised_value > KINK_THRESHOLD * penalised_value.abs();
        if !promising || !was_useful || self.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Ok(false);
        }
        if self.smoothness.is_none() {
            self.smoothness = Some(detect_smoothness(oracle, &self.best.point)?);
        }
        if self.smoothness == Some(Smoothness::Noisy) {
            return Ok(false);
        }
        let mut gradient_solver =
            SqpOptions { radius: GRADIENT_RADIUS_FACTOR * self.radius, ..Default::default() }.local();
        gradient_solver.begin(oracle, &self.best.point)?;
        self.gradient_solver = Some(gradient_solver);
        self.gradient_start_value = penalised_value;
        Ok(true)
    }

    /// Does one step of the gradient-based solver.
    fn gradient_step(&mut self, oracle: &mut dyn Oracle) -> Result<(), Halt> {
        let Some(gradient_solver) = &mut self.gradient_solver else { return Ok(()) };
        if gradient_solver.step(oracle)? != Progress::Continue {
            self.gradient_solver = None;
        }
        let shape = oracle.shape();
        if let Some(best) = oracle.best()
            && self.penalised_value(shape, best) < self.penalised_value(shape, &self.best)
        {
            self.move_to(best);
        }
        Ok(())
    }

    /// Shrinks and reorients the pattern; the shrinkage is weaker after every restart.
    fn shrink(&mut self, factor: f64) {
        self.radius *= math::powf(factor, math::powi(0.5, self.kink_restarts));
        // Align the pattern with the last displacement.
        match self.point_at_last_reorientation.replace(self.best.point.clone()) {
            Some(previous) if previous != self.best.point => {
                let displacement = DVector::from_fn(previous.len(), |j, _| self.best.point[j] - previous[j]);
                self.pattern.align(&displacement);
            }
            _ => self.pattern.reorient_randomly(&mut self.random),
        }
    }

    fn is_on_finest_grid(&self) -> bool {
        self.spacing.iter().all(|&spacing| spacing > 0.0 && self.radius < 0.5 * spacing)
    }

    /// Returns the point after a step of the models, inside the box and on the grids.
    fn point_at(&self, y: &[f64]) -> impl Iterator<Item = f64> {
        let coordinate = |j: usize| {
            let u = (self.best.point[j] + self.radius * y[j]).clamp(0.0, 1.0);
            let spacing = self.spacing[j];
            if spacing > 0.0 { ((u / spacing).round() * spacing).min(1.0) } else { u }
        };
        (0..y.len()).map(coordinate)
    }
}

/// Computes, by inverse iteration, the direction in which the interpolation points are least spread. Returns false if
/// they are spread in all directions.
///
/// The iteration does not start along a coordinate. For two directions with almost equal spread the result lies between
/// them.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition (2013), section 7.6.1.
fn least_sampled_direction(
    models: &QuadraticModels,
    n: usize,
    memory: &mut Vec<f64>,
    direction: &mut Vec<f64>,
) -> bool {
    let spread = |spread: &mut DMatrix<f64>| {
        spread.fill_diagonal(REGULARISATION);
        for y in models.steps() {
            let length = y.iter().fold(1.0_f64, |most, y| most.max(y.abs()));
            let y = DVectorView::from_slice(y, n);
            spread.ger(1.0 / (length * length), &y, &y, 1.0);
        }
    };
    direction.clear();
    direction.extend((0..n).map(|j| 1.0 / (1.0 + j as f64)));
    let mut direction = DVectorViewMut::from_slice(direction, n);
    let smallest = with_cholesky(memory, n, spread, |factor| {
        let mut smallest = f64::INFINITY;
        for _ in 0..INVERSE_ITERATIONS {
            factor.solve_mut(&mut direction);
            smallest = 1.0 / direction.norm();
            direction *= smallest;
        }
        smallest
    });
    smallest.is_some_and(|smallest| smallest < MIN_SPREAD)
}

/// Number of inverse iterations: gives six digits if the next larger spread is at least twice the smallest.
const INVERSE_ITERATIONS: usize = 20;

/// Regularisation added to the sums of squared steps, so that their matrix is invertible.
const REGULARISATION: f64 = 1e-9;

/// Sum of squared steps along a direction below which that direction is not covered.
const MIN_SPREAD: f64 = 0.3;

#[cfg(test)]
mod tests {
    use super::quadratic_models::tests::through;
    use super::*;

    #[test]
    fn the_direction_across_points_near_a_line_is_not_covered() {
        let flat = |_: &[f64; 2]| vec![1.0];
        let along = through(&[[0.0, 0.0], [1.0, 0.5], [-1.0, -0.5], [0.5, 0.3]], flat);
        let (mut memory, mut direction) = (Vec::new(), Vec::new());
        assert!(least_sampled_direction(&along, 2, &mut memory, &mut direction));
        assert!(
            (2.0 * direction[0] + direction[1]).abs() < 0.1 && math::hypot(direction[0], direction[1]) > 0.999,
            "{direction:?}"
        );
        let around = through(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], flat);
        assert!(!least_sampled_direction(&around, 2, &mut memory, &mut direction));
    }
}
