//! Sequential quadratic programming on the epigraph form of the min-max problem.

use mops_core::{Evaluation, Halt, Linearisation, Oracle, Progress, Shape, Solver, SolverOptions};
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::epigraph::{self, Direction, Rows};
use crate::start::usable_start;

/// Sequential quadratic programming for `min max_i f_i` with constraints: every row is linearised on its own, so that
/// the kink where two criteria meet is an ordinary solution, and a step solves the epigraph subproblem inside a trust
/// region. The Hessian of the Lagrangian is a damped BFGS matrix; a rejected step gets one second-order correction;
/// constraints that contradict each other are violated as little as can be (elastic mode, exact l-infinity penalty).
///
/// A criterion may have kinks of its own: an overshoot is the largest of several peaks. Where a step fails in spite of
/// its correction, the rows are linearised beyond the kink too, and both pieces count from then on (a bundle).
///
/// For up to about 50 tuners; converges fast. It finds the optimum of the basin it starts in.
///
/// Source: R. Fletcher, Practical Methods of Optimization, 2nd edition (1987), section 14.4 (Sl1QP, second-order
/// correction), 14.6 (nonsmooth pieces); M. J. D. Powell, in Numerical Analysis Dundee 1977, Lecture Notes in Mathematics
/// 630 (damped BFGS); K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization (1985) (bundles).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct SqpOptions {
    /// Stop when the subproblem promises less than this, relative to 1 + |objective|.
    pub tolerance: f64,
    /// First radius of the trust region, in the unit box.
    pub radius: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
}

impl Default for SqpOptions {
    fn default() -> Self {
        Self { tolerance: 1e-10, radius: 0.1, max_iterations: 200 }
    }
}

impl SolverOptions for SqpOptions {
    const KIND: &'static str = "sqp";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Sqp { options: self.clone(), state: None })
    }
}

/// The solver of the kind `sqp`.
struct Sqp {
    options: SqpOptions,
    state: Option<State>,
}

struct State {
    at: Linearisation,
    rows: Rows,
    /// Factor of the objective, so that it is of the order of 1.
    unit: f64,
    /// Points beyond kinks, with the rows there.
    bundle: Vec<(Vec<f64>, Rows)>,
    hessian: DMatrix<f64>,
    /// Whether the Hessian has seen a step yet.
    scaled: bool,
    radius: f64,
    penalty: f64,
    iterations: usize,
    /// Merit at which the memory was last thrown away.
    fresh_at: Option<f64>,
}

/// The radius below which the trust region has collapsed: a kink or a jump that no model describes.
const SMALLEST_RADIUS: f64 = 1e-9;

impl Solver for Sqp {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Err(
                "`sqp` follows slopes and cannot treat tuners with whole numbers or lists; take `pattern-search`"
                    .into(),
            );
        }
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let Some(at) = oracle.linearise(&start, self.options.radius)? else { return Ok(()) };
        let n = start.len();
        let rows = Rows::of(oracle.shape(), &at);
        let unit = rows.unit();
        self.state = Some(State {
            rows: rows.with_objective_times(unit),
            unit,
            bundle: Vec::new(),
            at,
            hessian: DMatrix::identity(n, n) * 0.1,
            scaled: false,
            radius: self.options.radius,
            penalty: 10.0,
            iterations: 0,
            fresh_at: None,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        // Every point tried has failed, or there is nothing to change.
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if state.at.at.point.is_empty() {
            return Ok(Progress::Converged);
        }
        state.iterations += 1;
        if state.iterations > self.options.max_iterations {
            return Ok(Progress::Stalled);
        }
        let Some(direction) = state.subproblem() else {
            // The Hessian may be at fault: forget it, once.
            if !state.scaled {
                return Ok(Progress::Stalled);
            }
            state.forget();
            return Ok(Progress::Continue);
        };
        let merit = state.merit(&state.rows);
        let curvature = 0.5 * quadratic(&state.hessian, &direction.step);
        let promised = merit - (direction.level + state.penalty * direction.violation + curvature);
        let tolerance = self.options.tolerance * (1.0 + merit.abs());
        if promised <= tolerance || state.radius < SMALLEST_RADIUS {
            // Old pieces or curvature may hide a descent: look once more without them.
            let settled = state.fresh_at.is_some_and(|fresh| merit > fresh - 10.0 * tolerance);
            if !settled {
                state.refresh(merit, self.options.radius);
                return Ok(Progress::Continue);
            }
            return Ok(if promised <= tolerance { Progress::Converged } else { Progress::Stalled });
        }

        let mut tried = state.try_step(oracle, &direction.step)?;
        if let Some((_, rows)) = &tried
            && state.merit(rows) > merit - 0.1 * promised
        {
            // Second-order correction: the same slopes through the values at the new point.
            let corrected = state.rows.corrected(rows, &direction.step);
            if let Some(second) = state.solve(&corrected) {
                let again = state.try_step(oracle, &second.step)?;
                if again.as_ref().is_some_and(|(_, again)| state.merit(again) < state.merit(rows)) {
                    tried = again;
                }
            }
        }
        let length = direction.step.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
        let achieved = tried.as_ref().map_or(f64::NEG_INFINITY, |(_, rows)| merit - state.merit(rows));
        let ratio = achieved / promised;
        let edge = length > 0.99 * state.radius;
        if ratio < 0.25 {
            state.radius = (0.5 * state.radius).min(if ratio <= 0.0 { 0.25 * length } else { 0.5 * length });
        } else if ratio > 0.75 && edge {
            state.radius = (2.0 * state.radius).min(1.0);
        }
        if let Some((evaluation, _)) = tried {
            let improves = ratio > 1e-4;
            // Slopes are worth their price where the point is better, or where it lies beyond a kink.
            if improves || length < KINK {
                match oracle.linearise(&evaluation.point, state.radius)? {
                    Some(at) if improves => state.move_to(oracle.shape(), at, &direction),
                    Some(at) => state.remember(at.at.point.clone(), state.rows_of(oracle.shape(), &at)),
                    None => state.radius *= 0.25,
                }
            }
        }
        Ok(Progress::Continue)
    }
}

/// A step shorter than this that fails has met a kink: smooth rows are well described by their slopes there.
const KINK: f64 = 0.02;

impl State {
    /// Begins anew from here.
    fn refresh(&mut self, merit: f64, radius: f64) {
        self.fresh_at = Some(merit);
        self.bundle.clear();
        self.forget();
        self.radius = 0.1 * radius;
    }

    /// Forgets the curvature.
    fn forget(&mut self) {
        let n = self.at.at.point.len();
        self.hessian = DMatrix::identity(n, n) * 0.1;
        self.scaled = false;
    }

    /// Keeps a piece beyond a kink, and forgets the oldest ones and those far away.
    fn remember(&mut self, point: Vec<f64>, rows: Rows) {
        let n = point.len();
        self.bundle.push((point, rows));
        let excess = self.bundle.len().saturating_sub(2 * (n + 1));
        self.bundle.drain(..excess);
    }

    /// The rows here, and those of the bundle as they extend to here.
    fn with_bundle(&self, rows: &Rows) -> Rows {
        let here = &self.at.at.point;
        let mut all = rows.clone();
        for (point, pieces) in &self.bundle {
            let back: Vec<f64> = here.iter().zip(point).map(|(a, b)| a - b).collect();
            all.add_pieces(pieces, &back);
        }
        all
    }

    /// The exact penalty function.
    fn merit(&self, rows: &Rows) -> f64 {
        rows.objective() + self.penalty * rows.violation()
    }

    /// The step of the subproblem; the penalty grows until the violation falls as far as the trust region allows.
    fn subproblem(&mut self) -> Option<Direction> {
        let mut direction = self.solve(&self.rows)?;
        let violation = self.rows.violation();
        while direction.violation > 1e-9 && self.penalty < 1e7 {
            // What can be reached if nothing but the constraints counts.
            let least = epigraph::solve(&self.with_bundle(&self.rows), &self.hessian, &self.low(), &self.high(), 1e9)?
                .violation;
            if direction.violation <= least + 0.5 * (violation - least).max(0.0) + 1e-9
                && direction.violation < violation
            {
                break;
            }
            if direction.violation <= least + 1e-9 {
                break;
            }
            self.penalty *= 10.0;
            direction = self.solve(&self.rows)?;
        }
        // Exactness: the penalty must exceed the sum of the multipliers.
        let multipliers = &direction.multipliers;
        let sum: f64 = multipliers.inequalities.iter().chain(&multipliers.equalities).map(|m| m.abs()).sum();
        if direction.violation < 1e-9 && 1.5 * sum > self.penalty {
            self.penalty = 2.0 * sum;
        }
        Some(direction)
    }

    fn solve(&self, rows: &Rows) -> Option<Direction> {
        epigraph::solve(&self.with_bundle(rows), &self.hessian, &self.low(), &self.high(), self.penalty)
    }

    fn low(&self) -> Vec<f64> {
        self.at.at.point.iter().map(|u| (-u).max(-self.radius)).collect()
    }

    fn high(&self) -> Vec<f64> {
        self.at.at.point.iter().map(|u| (1.0 - u).min(self.radius)).collect()
    }

    fn rows_of(&self, shape: &Shape, at: &Linearisation) -> Rows {
        Rows::of(shape, at).with_objective_times(self.unit)
    }

    /// The rows after a step, without slopes; `None` where the point fails.
    fn try_step(&self, oracle: &mut dyn Oracle, step: &[f64]) -> Result<Option<(Evaluation, Rows)>, Halt> {
        let point: Vec<f64> = self.at.at.point.iter().zip(step).map(|(u, d)| (u + d).clamp(0.0, 1.0)).collect();
        let evaluation = oracle.evaluate(&[point])?.pop().expect("one point, one answer");
        let shape = oracle.shape();
        let none = vec![vec![0.0; shape.dimension()]; shape.rows.len()];
        let rows =
            evaluation.scaled.as_ref().map(|scaled| Rows::new(shape, scaled, &none).with_objective_times(self.unit));
        Ok(rows.map(|rows| (evaluation, rows)))
    }

    fn move_to(&mut self, shape: &Shape, at: Linearisation, direction: &Direction) {
        let rows = self.rows_of(shape, &at);
        let n = at.at.point.len();
        let s = DVector::from_fn(n, |j, _| at.at.point[j] - self.at.at.point[j]);
        let before = DVector::from_vec(self.rows.lagrangian_slope(&direction.multipliers));
        let after = DVector::from_vec(rows.lagrangian_slope(&direction.multipliers));
        self.update_hessian(&s, &(after - before));
        // What was here is a piece too as long as kinks are near; pieces far away describe nothing here.
        if !self.bundle.is_empty() {
            let (point, rows) = (self.at.at.point.clone(), self.rows.clone());
            self.remember(point, rows);
        }
        let reach = 10.0 * self.radius;
        let near = |point: &[f64]| point.iter().zip(&at.at.point).all(|(a, b)| (a - b).abs() <= reach);
        self.bundle.retain(|(point, _)| near(point));
        self.at = at;
        self.rows = rows;
    }

    /// Powell's damped BFGS update: `B` stays positive definite whatever the curvature.
    fn update_hessian(&mut self, s: &DVector<f64>, y: &DVector<f64>) {
        if s.norm() < 1e-12 {
            return;
        }
        let n = s.len();
        if !self.scaled {
            // The first curvature seen sets the scale (Nocedal, Wright, equation 6.20).
            let scale = if s.dot(y) > 0.0 { y.dot(y) / s.dot(y) } else { 0.1 };
            self.hessian = DMatrix::identity(n, n) * scale.clamp(1e-3, 1e3);
            self.scaled = true;
        }
        // Across a kink or a jump the slopes change at once: that is no curvature.
        if y.norm() > LARGEST_CURVATURE * s.norm() {
            return;
        }
        let bs = &self.hessian * s;
        let sbs = s.dot(&bs);
        let sy = s.dot(y);
        let theta = if sy >= 0.2 * sbs { 1.0 } else { 0.8 * sbs / (sbs - sy) };
        let r = y * theta + &bs * (1.0 - theta);
        self.hessian += &r * r.transpose() / s.dot(&r) - &bs * bs.transpose() / sbs;
        // Differences leave noise in the slopes; a curvature beyond reason would freeze the iteration.
        if self.hessian.iter().any(|h| !h.is_finite() || h.abs() > 1e8) {
            self.forget();
        }
    }
}

/// Curvature in the unit box beyond which a change of slope is taken for a kink.
const LARGEST_CURVATURE: f64 = 1e3;

fn quadratic(matrix: &DMatrix<f64>, x: &[f64]) -> f64 {
    let x = DVector::from_column_slice(x);
    x.dot(&(matrix * &x))
}
