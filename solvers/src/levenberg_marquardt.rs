//! Levenberg-Marquardt method for sums of squares, with bounds and multistart.

use mops_core::math;
use mops_core::{Halt, Linearisation, Oracle, Progress, Shape, Solver, SolverOptions};
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::multistart::Multistart;
use crate::start::usable_start;

/// Levenberg-Marquardt method for calibration, where the objective is a sum of squares of residuals `r`.
/// ```text
/// (J'J + lambda D^2) d = -J'r,   D^2 the largest diagonal of J'J so far
/// ```
/// Bounds are handled by an active set: tuners that the step would move beyond a bound are fixed there, and the step is
/// recomputed.
///
/// The method runs from the initial guess of the study, then from the best points of a sample of the box. It then
/// restarts around the best point, until two rounds in succession improve it by less than a thousandth.
///
/// Source: J. J. More, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630 (1978); damping by H. B.
/// Nielsen, report IMM-REP-1999-05, Technical University of Denmark (1999).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct LevenbergMarquardtOptions {
    /// Predicted relative decrease of the sum of squares below which the iteration stops.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Number of starting points, including the initial guess of the study.
    #[schemars(range(min = 1, max = 10_000))]
    pub starts: usize,
    /// Maximum number of iterations per starting point.
    #[schemars(range(min = 1))]
    pub max_iterations: usize,
}

impl Default for LevenbergMarquardtOptions {
    fn default() -> Self {
        Self { tolerance: 1e-9, starts: 4, max_iterations: 200 }
    }
}

impl SolverOptions for LevenbergMarquardtOptions {
    const KIND: &'static str = "levenberg-marquardt";

    fn build(&self) -> Box<dyn Solver> {
        let local = self.local();
        Box::new(LevenbergMarquardt { starts: Multistart::new(local, self.starts).with_local_restarts() })
    }
}

impl LevenbergMarquardtOptions {
    /// Builds the method without multistart.
    pub fn local(&self) -> Box<dyn Solver> {
        Box::new(Local { options: self.clone(), state: None })
    }
}

/// Solver of the kind `levenberg-marquardt`.
struct LevenbergMarquardt {
    starts: Multistart,
}

impl Solver for LevenbergMarquardt {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.starts.begin(oracle, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        self.starts.step(oracle)
    }
}

fn accepts(shape: &Shape) -> Result<(), String> {
    if shape.residuals == 0 {
        return Err("`levenberg-marquardt` needs a sum of squares: objective = \"sum\" with `fit` or `normalised-error` criteria and simulations that succeed at the initial guess; otherwise use `sqp`".into());
    }
    if shape.has_constraints() {
        return Err("`levenberg-marquardt` supports bounds, but no other constraints; use `sqp`".into());
    }
    if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
        return Err(
            "`levenberg-marquardt` needs gradients, but a tuner has whole numbers or a list of values; use `pattern-search`"
                .into(),
        );
    }
    Ok(())
}

/// Levenberg-Marquardt iteration from one starting point.
struct Local {
    options: LevenbergMarquardtOptions,
    state: Option<State>,
}

struct State {
    iterate: Linearisation,
    jacobian: DMatrix<f64>,
    residuals: DVector<f64>,
    /// Squared scale of every coordinate.
    scale: DVector<f64>,
    damping: f64,
    damping_growth: f64,
    iterations: usize,
    /// Number of successive steps with negligible decrease.
    stalled_steps: usize,
}

impl Solver for Local {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let Some(at) = oracle.linearise(&start, 1.0)? else { return Ok(()) };
        let (jacobian, residuals) = matrices(&at);
        let scale = DVector::from_iterator(start.len(), jacobian.column_iter().map(|c| c.norm_squared().max(1e-30)));
        self.state = Some(State {
            iterate: at,
            jacobian,
            residuals,
            scale,
            damping: 1e-3,
            damping_growth: 2.0,
            iterations: 0,
            stalled_steps: 0,
        });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        state.iterations += 1;
        if state.iterate.at.point.is_empty() {
            return Ok(Progress::Converged);
        }
        if state.iterations > self.options.max_iterations {
            return Ok(Progress::Stalled);
        }
        let sum = state.residuals.norm_squared();
        let Some(step) = state.bounded_step() else { return Ok(Progress::Stalled) };
        let predicted = sum - (&state.residuals + &state.jacobian * &step).norm_squared();
        if predicted <= self.options.tolerance * sum {
            return Ok(state.termination());
        }
        let point: Vec<f64> = state.iterate.at.point.iter().zip(&step).map(|(u, d)| (u + d).clamp(0.0, 1.0)).collect();
        let answer = oracle.evaluate(std::slice::from_ref(&point))?.pop().expect("one point, one answer");
        let actual = if answer.scaled.is_some() { sum - answer.merit.objective } else { f64::NEG_INFINITY };
        let ratio = actual / predicted;
        if ratio <= 1e-4 {
            state.damping *= state.damping_growth;
            state.damping_growth *= 2.0;
            return Ok(if state.damping > 1e12 { state.termination() } else { Progress::Continue });
        }
        let Some(at) = oracle.linearise(&point, 1.0)? else { return Ok(Progress::Stalled) };
        (state.jacobian, state.residuals) = matrices(&at);
        state.iterate = at;
        for (scale, column) in state.scale.iter_mut().zip(state.jacobian.column_iter()) {
            *scale = scale.max(column.norm_squared());
        }
        state.damping *= (1.0 - math::powi(2.0 * ratio - 1.0, 3)).max(1.0 / 3.0);
        state.damping_growth = 2.0;
        state.stalled_steps = if actual <= 100.0 * self.options.tolerance * sum { state.stalled_steps + 1 } else { 0 };
        Ok(if state.stalled_steps >= 3 { state.termination() } else { Progress::Continue })
    }
}

fn matrices(at: &Linearisation) -> (DMatrix<f64>, DVector<f64>) {
    let columns: Vec<DVector<f64>> = at.residuals.iter().map(|c| DVector::from_column_slice(c)).collect();
    let residuals = DVector::from_column_slice(&at.at.residuals);
    let jacobian =
        if columns.is_empty() { DMatrix::zeros(residuals.len(), 0) } else { DMatrix::from_columns(&columns) };
    (jacobian, residuals)
}

impl State {
    /// Applies More's test: at an optimum the residuals are orthogonal to every column of the Jacobian of a free
    /// coordinate.
    fn termination(&self) -> Progress {
        /// Largest cosine regarded as orthogonal: the accuracy of finite-difference gradients.
        const ORTHOGONAL: f64 = 1e-3;
        let norm = self.residuals.norm();
        let cosine = |j: usize| {
            let column = self.jacobian.column(j);
            let gradient = column.dot(&self.residuals);
            let u = self.iterate.at.point[j];
            let fixed = (u <= 0.0 && gradient > 0.0) || (u >= 1.0 && gradient < 0.0);
            if fixed || gradient == 0.0 { 0.0 } else { gradient.abs() / (column.norm() * norm) }
        };
        let largest = (0..self.jacobian.ncols()).map(cosine).fold(0.0, f64::max);
        if largest <= ORTHOGONAL { Progress::Converged } else { Progress::Stalled }
    }

    /// Computes the damped step in the box: coordinates that would leave it are fixed at their bounds, one per pass.
    fn bounded_step(&self) -> Option<DVector<f64>> {
        let point = &self.iterate.at.point;
        let n = point.len();
        let mut fixed = DVector::<f64>::zeros(n);
        let mut free = vec![true; n];
        for _ in 0..=n {
            let indices: Vec<usize> = (0..n).filter(|&j| free[j]).collect();
            let mut step = fixed.clone();
            if !indices.is_empty() {
                let part = self.jacobian.select_columns(&indices);
                let target = &self.residuals + &self.jacobian * &fixed;
                let mut normal = part.transpose() * &part;
                for (i, &j) in indices.iter().enumerate() {
                    normal[(i, i)] += self.damping * self.scale[j];
                }
                let solved = normal.cholesky()?.solve(&(-(part.transpose() * target)));
                for (i, &j) in indices.iter().enumerate() {
                    step[j] = solved[i];
                }
            }
            let outside = |j: usize| (point[j] + step[j] - 1.0).max(-(point[j] + step[j]));
            let worst = indices.iter().copied().max_by(|&i, &j| outside(i).total_cmp(&outside(j)));
            match worst.filter(|&j| outside(j) > 0.0) {
                None => return Some(step),
                Some(j) => {
                    free[j] = false;
                    fixed[j] = if step[j] > 0.0 { 1.0 - point[j] } else { -point[j] };
                }
            }
        }
        None
    }
}
