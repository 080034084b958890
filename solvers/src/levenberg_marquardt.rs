//! Levenberg-Marquardt method for sums of squares, with bounds and multistart.

use mops_core::{Halt, LeastSquares, Linearisation, Oracle, Progress, Shape, Solver, SolverOptions};
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
    /// Largest number of starting points, including the initial guess of the study.
    #[schemars(range(min = 1, max = 10_000))]
    pub starts: usize,
    /// Maximum number of iterations per starting point.
    #[schemars(range(min = 1))]
    pub max_iterations: usize,
}

impl Default for LevenbergMarquardtOptions {
    fn default() -> Self {
        Self { tolerance: 1e-9, starts: 6, max_iterations: 200 }
    }
}

impl SolverOptions for LevenbergMarquardtOptions {
    const KIND: &'static str = "levenberg-marquardt";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Multistart::new(self.local(), self.starts).thorough().with_local_restarts())
    }
}

impl LevenbergMarquardtOptions {
    /// Builds the method without multistart.
    pub fn local(&self) -> Box<dyn Solver> {
        Box::new(Local { options: self.clone(), state: None })
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
    iterate: LeastSquares,
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
        let point = at.at.point.clone();
        let (jacobian, residuals) = matrices(at);
        let iterate = LeastSquares::new(vec![[0.0, 1.0]; start.len()], point, residuals, jacobian);
        self.state = Some(State { iterate, iterations: 0, stalled_steps: 0 });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        state.iterations += 1;
        if state.iterate.point().is_empty() {
            return Ok(Progress::Converged);
        }
        if state.iterations > self.options.max_iterations {
            return Ok(Progress::Stalled);
        }
        let sum = state.iterate.sum();
        let Some(step) = state.iterate.step() else { return Ok(Progress::Stalled) };
        if step.predicted <= self.options.tolerance * sum {
            return Ok(state.termination());
        }
        let answer = oracle.evaluate(std::slice::from_ref(&step.to))?.pop().expect("one point, one answer");
        let actual = if answer.scaled.is_some() { sum - answer.merit.objective } else { f64::NEG_INFINITY };
        let ratio = actual / step.predicted;
        if !LeastSquares::accepts(ratio) {
            return Ok(if state.iterate.reject(ratio) { Progress::Continue } else { state.termination() });
        }
        let Some(at) = oracle.linearise(&step.to, 1.0)? else { return Ok(Progress::Stalled) };
        let (jacobian, residuals) = matrices(at);
        state.iterate.accept(step.to, residuals, jacobian, ratio);
        state.stalled_steps = if actual <= 100.0 * self.options.tolerance * sum { state.stalled_steps + 1 } else { 0 };
        Ok(if state.stalled_steps >= 3 { state.termination() } else { Progress::Continue })
    }
}

fn matrices(at: Linearisation) -> (DMatrix<f64>, DVector<f64>) {
    let residuals = DVector::from_vec(at.at.residuals);
    let (rows, columns) = (residuals.len(), at.residuals.len());
    let jacobian = DMatrix::from_iterator(rows, columns, at.residuals.into_iter().flatten());
    (jacobian, residuals)
}

impl State {
    /// Applies More's test: at an optimum the residuals are orthogonal to every column of the Jacobian of a free
    /// coordinate.
    fn termination(&self) -> Progress {
        /// Largest cosine regarded as orthogonal: the accuracy of finite-difference gradients.
        const ORTHOGONAL: f64 = 1e-3;
        if self.iterate.largest_cosine() <= ORTHOGONAL { Progress::Converged } else { Progress::Stalled }
    }
}
