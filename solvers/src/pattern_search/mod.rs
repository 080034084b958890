//! Pattern search: polls a pattern of points around the best one, and shrinks it where nothing is better.

mod barrier;
mod pattern;
mod point_buffer;
mod quadratic_models;
mod sample_set;
mod trust_region_subproblem;

use mops_core::math;
use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions, Stream};
use nalgebra::{DMatrix, DVector, DVectorView, DVectorViewMut};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::cholesky::with_cholesky;
use crate::linearised_criteria::LinearisedCriteria;
use crate::noise_detection::{Smoothness, detect_smoothness};
use crate::sqp::SqpOptions;
use crate::start::usable_start;
use barrier::{Barrier, PredictedReduction};
use pattern::Pattern;
use point_buffer::PointBuffer;
use quadratic_models::QuadraticModels;
use sample_set::SampleSet;
use trust_region_subproblem::{PenalisedObjective, TrustRegionSubproblem};

/// Mesh-adaptive direct search on the unit box: points of a pattern are polled around the best one, those first that look
/// best; a better one is taken, else the pattern shrinks and turns. Ends at a mesh size. Needs no slopes: for criteria that
/// jump, for noise, and for tuners with whole numbers or lists.
///
/// Before it polls, it searches: every row has a quadratic model of its own through the points around the best one, and the
/// point where the largest of the models is least is tried, inside a trust region. So the kink where two criteria meet is
/// seen. Constraints are kept by a progressive barrier: objective and violation are judged apart, and what may be violated
/// falls as the search goes on.
///
/// Where neither models nor pattern lead on although the models promise much, a row has kinks of its own: unless its values
/// are noise, slopes by differences are followed from there (as `sqp` does), as long as they lead on.
///
/// Source: C. Audet, J. E. Dennis, SIAM J. Optimization 17 (2006) 188-217 (MADS); turned patterns: M. A. Abramson, C. Audet,
/// J. E. Dennis, S. Le Digabel, SIAM J. Optimization 20 (2009) 948-966; models: A. R. Conn, K. Scheinberg, L. N. Vicente,
/// Introduction to Derivative-Free Optimization (SIAM 2009), chapters 5 and 10; one for every row: J. Larson, M. Menickelly,
/// S. M. Wild, SIAM J. Optimization 26 (2016) 2540-2563; barrier: C. Audet, J. E. Dennis, SIAM J. Optimization 20 (2009)
/// 445-472.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct PatternSearchOptions {
    /// First distance of the pattern's points, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub size: f64,
    /// Distance at which the search ends.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Factor of the pattern's size where nothing in it is better. Less leads to the end sooner; more polls more often.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub shrink: f64,
    /// Points that are evaluated at once: of a pattern, and beside a step of the models; 0 for whole patterns.
    #[schemars(range(max = 10_000))]
    pub batch: usize,
}

impl Default for PatternSearchOptions {
    fn default() -> Self {
        Self { size: 0.1, tolerance: 1e-7, shrink: 0.5, batch: 2 }
    }
}

impl SolverOptions for PatternSearchOptions {
    const KIND: &'static str = "pattern-search";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(PatternSearch { options: self.clone(), state: None, workspace: Workspace::default() })
    }
}

/// The solver of the kind `pattern-search`.
struct PatternSearch {
    options: PatternSearchOptions,
    state: Option<State>,
    workspace: Workspace,
}

/// Models of the rows, and memory that is used again from step to step.
#[derive(Default)]
struct Workspace {
    models: QuadraticModels,
    subproblem: TrustRegionSubproblem,
    /// The known points around the best one, with their distances.
    neighbours: Vec<(f64, usize)>,
    /// The trust region inside the box, in steps of the models.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Unknown points of the pattern, and their order: what looks best first.
    pattern: PointBuffer,
    order: Vec<(f64, usize)>,
    /// Points to ask for.
    trial_points: PointBuffer,
    step: Vec<f64>,
    values: Vec<f64>,
    /// Where the search stood.
    previous: Vec<f64>,
    spread: Vec<f64>,
}

struct State {
    best: Evaluation,
    samples: SampleSet,
    /// Size of the pattern and of the trust region.
    radius: f64,
    /// What the models promised at last.
    predicted: f64,
    /// Times that the search began again because of a kink.
    kink_restarts: i32,
    /// Times that the search went back from an infeasible end.
    feasibility_restarts: usize,
    /// Steps of the models in a row that led nowhere.
    model_failures: usize,
    /// The best point at the last turn of the pattern.
    point_at_last_rotation: Option<Vec<f64>>,
    /// Weight of the violation in the models' objective.
    penalty: f64,
    /// What may be moved to.
    barrier: Barrier,
    objective_scale: f64,
    pattern: Pattern,
    /// Points that are evaluated at once; 0 for whole patterns.
    batch: usize,
    random: Stream,
    spacing: Vec<f64>,
    /// Whether the first pattern has been polled.
    has_polled: bool,
    /// What follows a kink inside a row, while it does.
    gradient_solver: Option<Box<dyn Solver>>,
    /// What the best point was worth when slopes were last followed; infinite while they were not.
    gradient_start_value: f64,
    /// What the rows are like; `None` while nobody wanted to know.
    smoothness: Option<Smoothness>,
}

impl Workspace {
    /// Adds up to `count` points of the pattern to what is asked, in their order, from the one at `first` on.
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
            point_at_last_rotation: None,
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
        // The models still promise what the problem does not keep: a kink inside a row. Again, with more turns on the way.
        let penalised_value = state.penalised_value(oracle.shape(), &state.best);
        if state.predicted > FINAL_KINK_THRESHOLD * penalised_value.abs() && state.kink_restarts < MAX_KINK_RESTARTS {
            state.kink_restarts += 1;
            state.radius = options.shrink * options.size;
            return Ok(Progress::Continue);
        }
        // An infeasible end: on from the best feasible point, or with a wide pattern from here.
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

/// A promise at the end, relative to what the best point is worth, that tells of a kink.
const FINAL_KINK_THRESHOLD: f64 = 1e-10;

/// The same while the search goes on.
const KINK_THRESHOLD: f64 = 1e-4;

/// First radius of the steps along slopes, in those of the pattern.
const GRADIENT_RADIUS_FACTOR: f64 = 3.0;

/// Times that the search begins again because of a kink.
const MAX_KINK_RESTARTS: i32 = 4;

/// Times that the search goes back from an infeasible end.
const MAX_FEASIBILITY_RESTARTS: usize = 3;

/// Steps of the models in a row that lead nowhere before the pattern is polled.
const MAX_MODEL_FAILURES: usize = 2;

impl State {
    fn penalised_objective<'a>(&self, shape: &'a Shape) -> PenalisedObjective<'a> {
        PenalisedObjective { shape, objective_scale: self.objective_scale, penalty: self.penalty }
    }

    fn penalised_value(&self, shape: &Shape, evaluation: &Evaluation) -> f64 {
        evaluation.scaled.as_ref().map_or(f64::INFINITY, |scaled| self.penalised_objective(shape).value(scaled))
    }

    /// Evaluates points, keeps their values, and moves to the best if the barrier admits it; `true` when it moved. What is
    /// promised is promised of the first point.
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

    /// Goes on from a point that others have found.
    fn move_to(&mut self, best: &Evaluation) {
        self.best = best.clone();
        self.barrier.record(&best.merit);
        self.record(best);
    }

    /// Forgets the oldest points where there are many.
    fn drop_oldest(&mut self) {
        if self.samples.drop_oldest()
            && let Some(scaled) = &self.best.scaled
        {
            self.samples.insert(&self.best.point, scaled);
        }
    }

    /// Tries where the models are least, and beside it as much of the pattern as fills a batch; `true` while that is worth
    /// going on with, `false` when it is time to poll.
    fn search(&mut self, oracle: &mut dyn Oracle, workspace: &mut Workspace) -> Result<bool, Halt> {
        if self.spacing.iter().all(|&spacing| spacing > 0.0) || !self.fit(workspace) {
            return Ok(false);
        }
        let shape = oracle.shape();
        let mut objective = self.penalised_objective(shape);
        let found = self.solve_subproblem(&mut objective, workspace);
        if objective.penalty > self.penalty {
            self.penalty = objective.penalty;
            // Nothing is worth what it was.
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
            // The models were wrong for want of points.
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

    /// Lays models through the known points around the best one; `false` where these do not determine them.
    fn fit(&self, workspace: &mut Workspace) -> bool {
        self.samples.neighbours(&self.best.point, self.radius, &mut workspace.neighbours);
        workspace.models.fit(&self.samples, &workspace.neighbours, &self.best.point, self.radius)
    }

    /// Finds where the models are least, in the trust region and inside the box.
    fn solve_subproblem(&self, objective: &mut PenalisedObjective, workspace: &mut Workspace) -> bool {
        workspace.low.clear();
        workspace.low.extend(self.best.point.iter().map(|u| (-u / self.radius).max(-1.0)));
        workspace.high.clear();
        workspace.high.extend(self.best.point.iter().map(|u| ((1.0 - u) / self.radius).min(1.0)));
        workspace.subproblem.solve(objective, &workspace.models, &workspace.low, &workspace.high)
    }

    /// Adds a point in the direction in which those that the models go through tell least; `false` where they tell enough.
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

    /// Polls the pattern, what looks best first; `true` when a point was better.
    fn poll(&mut self, oracle: &mut dyn Oracle, workspace: &mut Workspace) -> Result<bool, Halt> {
        self.model_failures = 0;
        self.fit(workspace);
        self.rank_pattern(oracle.shape(), workspace);
        let count = workspace.order.len();
        // The first pattern is what the first models go through.
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

    /// Adds as much of the pattern to what is asked as fills a batch, what looks best first.
    fn fill_batch(&self, shape: &Shape, workspace: &mut Workspace) {
        if workspace.trial_points.len() < self.batch {
            self.rank_pattern(shape, workspace);
            workspace.push_pattern_points(0, self.batch - workspace.trial_points.len());
        }
    }

    /// Collects the unknown points of the pattern around the best one, in the order in which they look best to the models, if
    /// these were fitted.
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

    /// Goes on in the direction of a success, twice as far each time, while that is better.
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
            // At the edge of the box few are left.
            if workspace.trial_points.len() < self.batch {
                self.fit(workspace);
                self.fill_batch(oracle.shape(), workspace);
            }
            if !self.evaluate_and_move(oracle, workspace.trial_points.as_slice(), None)? {
                return Ok(());
            }
        }
    }

    /// Begins to follow slopes where the models promise what the problem does not keep; `false` where that is not so, where
    /// slopes led nowhere the last time, and where they would tell of noise.
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
            SqpOptions { radius: GRADIENT_RADIUS_FACTOR * self.radius, ..Default::default() }.build();
        gradient_solver.begin(oracle, &self.best.point)?;
        self.gradient_solver = Some(gradient_solver);
        self.gradient_start_value = penalised_value;
        Ok(true)
    }

    /// A step along slopes.
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

    /// Shrinks and turns the pattern; by less after every restart.
    fn shrink(&mut self, factor: f64) {
        self.radius *= math::powf(factor, math::powi(0.5, self.kink_restarts));
        // Where the search went tells where it may go on.
        match self.point_at_last_rotation.replace(self.best.point.clone()) {
            Some(previous) if previous != self.best.point => {
                let displacement = DVector::from_fn(previous.len(), |j, _| self.best.point[j] - previous[j]);
                self.pattern.align(&displacement);
            }
            _ => self.pattern.rotate_randomly(&mut self.random),
        }
    }

    fn is_on_finest_grid(&self) -> bool {
        self.spacing.iter().all(|&spacing| spacing > 0.0 && self.radius < 0.5 * spacing)
    }

    /// The point after a step of the models, inside the box and on the grids.
    fn point_at(&self, y: &[f64]) -> impl Iterator<Item = f64> {
        let coordinate = |j: usize| {
            let u = (self.best.point[j] + self.radius * y[j]).clamp(0.0, 1.0);
            let spacing = self.spacing[j];
            if spacing > 0.0 { ((u / spacing).round() * spacing).min(1.0) } else { u }
        };
        (0..y.len()).map(coordinate)
    }
}

/// Finds the direction in which the points that the models go through are least spread, by inverse iteration; `false` where
/// they are spread in all. It begins along no coordinate, and where two directions are spread about as little finds one between
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

/// Inverse iterations for an unknown direction: enough where the next spread is twice as large, for six figures.
const INVERSE_ITERATIONS: usize = 20;

/// What is added to all sums of squared steps, so that their matrix has an inverse.
const REGULARISATION: f64 = 1e-9;

/// A sum of squared steps along a direction below which that direction is unknown.
const MIN_SPREAD: f64 = 0.3;

#[cfg(test)]
mod tests {
    use super::quadratic_models::tests::through;
    use super::*;

    #[test]
    fn the_direction_across_points_near_a_line_is_unknown() {
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
