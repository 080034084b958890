//! Pattern search: polls a pattern of points around the best one, and shrinks it where nothing is better.

use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::epigraph::{self, Rows};
use crate::penalty::penalised;
use crate::start::usable_start;

/// Generalised pattern search on the unit box: all `2 n` points of a pattern are polled in parallel, the best one is
/// taken if it is better, else the pattern shrinks; it ends at a mesh size. Needs no slopes: for criteria that jump, for
/// noise, and for tuners with whole numbers or lists.
///
/// A pattern alone stops at the kinks of a maximum. Therefore each full poll also gives a linear model of every row,
/// and the point where the models' maximum is least is tried before the pattern shrinks. The pattern is turned at random
/// (by Householder reflections) whenever it shrinks, so that no direction is blind for good. Constraints enter by an
/// exact penalty, which grows while the search ends at infeasible points.
///
/// Source: V. Torczon, SIAM J. Optimization 7 (1997) 1-25; turned patterns: M. A. Abramson, C. Audet, J. E. Dennis,
/// S. Le Digabel, SIAM J. Optimization 20 (2009) 948-966.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct PatternSearchOptions {
    /// First distance of the pattern's points, in the unit box.
    pub size: f64,
    /// Distance at which the search ends.
    pub tolerance: f64,
}

impl Default for PatternSearchOptions {
    fn default() -> Self {
        Self { size: 0.1, tolerance: 1e-6 }
    }
}

impl SolverOptions for PatternSearchOptions {
    const KIND: &'static str = "pattern-search";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(PatternSearch { options: self.clone(), state: None })
    }
}

/// The solver of the kind `pattern-search`.
struct PatternSearch {
    options: PatternSearchOptions,
    state: Option<State>,
}

struct State {
    best: Evaluation,
    size: f64,
    penalty: f64,
    /// Directions of the pattern, one per column.
    basis: DMatrix<f64>,
    random: mops_core::Stream,
    spacing: Vec<f64>,
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
        let random = oracle.stream("pattern-search");
        let spacing = oracle.shape().spacing.clone();
        self.state = Some(State {
            best,
            size: self.options.size,
            penalty: 10.0,
            basis: DMatrix::identity(n, n),
            random,
            spacing,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if state.best.point.is_empty() {
            return Ok(Progress::Converged);
        }
        // Poll.
        let points = state.pattern();
        let answers = oracle.evaluate(&points)?;
        let mut better = state.better_of(answers.iter());
        // Search: where the rows' linear models have their least maximum.
        if let Some(point) = state.model_point(oracle.shape(), &answers) {
            let answer = oracle.evaluate(&[point])?;
            better = state.better_of(better.iter().chain(&answer));
        }
        if let Some(better) = better {
            state.best = better;
            state.size = (2.0 * state.size).min(0.5);
            return Ok(Progress::Continue);
        }
        if state.size > self.options.tolerance && !state.is_on_finest_grid() {
            state.size *= 0.5;
            state.turn();
            return Ok(Progress::Continue);
        }
        // An infeasible end: the penalty was too small, or nothing is feasible.
        if !state.best.merit.is_feasible() && state.penalty < 1e6 {
            state.penalty *= 100.0;
            state.size = self.options.size;
            return Ok(Progress::Continue);
        }
        Ok(if state.best.merit.is_feasible() { Progress::Converged } else { Progress::Stalled })
    }
}

impl State {
    fn worth(&self, evaluation: &Evaluation) -> f64 {
        if evaluation.scaled.is_none() {
            return f64::INFINITY;
        }
        penalised(evaluation) + (self.penalty - 10.0) * evaluation.merit.violation
    }

    /// The best of the answers, if it is better than the best so far.
    fn better_of<'a>(&self, answers: impl Iterator<Item = &'a Evaluation>) -> Option<Evaluation> {
        let best = answers.min_by(|a, b| self.worth(a).total_cmp(&self.worth(b)))?;
        (self.worth(best) < self.worth(&self.best)).then(|| best.clone())
    }

    /// The points of the pattern: both ways along every direction, at least one value of a grid away.
    fn pattern(&self) -> Vec<Vec<f64>> {
        let n = self.best.point.len();
        let mut points = Vec::with_capacity(2 * n);
        for j in 0..n {
            for side in [1.0, -1.0] {
                let at = |i: usize| {
                    let mut by = side * self.size * self.basis[(i, j)];
                    if self.spacing[i] > 0.0 {
                        // Along a grid the pattern keeps to its own coordinate, by whole steps.
                        by = if i == j {
                            side * (self.size / self.spacing[i]).round().max(1.0) * self.spacing[i]
                        } else {
                            0.0
                        };
                    }
                    (self.best.point[i] + by).clamp(0.0, 1.0)
                };
                points.push((0..n).map(at).collect());
            }
        }
        points
    }

    fn is_on_finest_grid(&self) -> bool {
        self.spacing.iter().all(|&spacing| spacing > 0.0 && self.size < 0.5 * spacing)
    }

    /// The least maximum of the rows' linear models within twice the pattern.
    fn model_point(&self, shape: &Shape, answers: &[Evaluation]) -> Option<Vec<f64>> {
        let here = self.best.scaled.as_ref()?;
        let n = self.best.point.len();
        if self.spacing.iter().any(|&s| s > 0.0) {
            return None;
        }
        // Slopes along the pattern's directions: central where both sides are there, else one-sided.
        let mut slopes = vec![vec![0.0; n]; here.len()];
        let mut directions = DMatrix::zeros(n, n);
        for j in 0..n {
            let usable = |side: &'_ Evaluation| side.scaled.is_some() && side.point != self.best.point;
            let [up, down] =
                [&answers[2 * j], &answers[2 * j + 1]].map(|side| if usable(side) { side } else { &self.best });
            let along = DVector::from_fn(n, |i, _| up.point[i] - down.point[i]);
            let length = along.norm();
            if length == 0.0 {
                return None;
            }
            directions.set_column(j, &(along / length));
            let (high, low) = (up.scaled.as_ref()?, down.scaled.as_ref()?);
            for row in 0..here.len() {
                slopes[row][j] = (high[row] - low[row]) / length;
            }
        }
        let turn = directions.transpose().try_inverse()?;
        let slopes: Vec<Vec<f64>> =
            slopes.into_iter().map(|s| (&turn * DVector::from_vec(s)).iter().copied().collect()).collect();
        let rows = Rows::new(shape, here, &slopes);
        let unit = rows.unit();
        let rows = rows.with_objective_times(unit);
        let reach = 2.0 * self.size;
        let low: Vec<f64> = self.best.point.iter().map(|u| (-u).max(-reach)).collect();
        let high: Vec<f64> = self.best.point.iter().map(|u| (1.0 - u).min(reach)).collect();
        // A little curvature makes the solution unique.
        let direction = epigraph::solve(&rows, &(DMatrix::identity(n, n) * 1e-6), &low, &high, self.penalty)?;
        let point: Vec<f64> =
            self.best.point.iter().zip(&direction.step).map(|(u, d)| (u + d).clamp(0.0, 1.0)).collect();
        (point != self.best.point).then_some(point)
    }

    /// Turns the pattern by a random reflection `I - 2 v v'`.
    fn turn(&mut self) {
        let n = self.best.point.len();
        let v = DVector::from_fn(n, |_, _| self.random.random_range(-1.0..1.0));
        let norm = v.norm_squared();
        if norm > 1e-6 {
            self.basis = DMatrix::identity(n, n) - &v * v.transpose() * (2.0 / norm);
        }
    }
}
