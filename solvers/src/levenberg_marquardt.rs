//! Levenberg-Marquardt method for sums of squares, with bounds and multistart.

use mops_core::{
    Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions, least_squares::LeastSquares,
    solver::Linearisation,
};
use mops_math as math;
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
/// A logarithmic scale may bend a straight valley: where steps in the scaled tuners bring little, steps in the tuners
/// themselves are tried as well.
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
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
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
    /// The iterate in the scaled tuners and, once these have brought little, in the tuners themselves.
    iterates: Vec<LeastSquares>,
    coordinates: [Coordinates; 2],
    /// Index of the coordinates of the last accepted step.
    preferred: usize,
    /// Number of successive accepted steps with a small decrease.
    slow_steps: usize,
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
        let log_ratios = oracle.shape().log_ratios.clone();
        let coordinates = [Coordinates { log_ratios: Vec::new() }, Coordinates { log_ratios }];
        let iterates = vec![coordinates[0].begin(&point, matrices(at))];
        let (slow_steps, iterations, stalled_steps) = (0, 0, 0);
        self.state = Some(State { iterates, coordinates, preferred: 0, slow_steps, iterations, stalled_steps });
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        state.iterations += 1;
        if state.iterates[0].point().is_empty() {
            return Ok(Progress::Converged);
        }
        if state.iterations > self.options.max_iterations {
            return Ok(Progress::Stalled);
        }
        let sum = state.iterates[0].sum();
        let tried: Vec<usize> =
            if state.slow_steps >= MANY_SLOW { (0..state.iterates.len()).collect() } else { vec![state.preferred] };
        let steps = tried.iter().map(|&k| state.iterates[k].step());
        let Some(steps) = steps.collect::<Option<Vec<_>>>() else { return Ok(Progress::Stalled) };
        if steps.iter().all(|step| step.predicted <= self.options.tolerance * sum) {
            return Ok(state.termination());
        }
        let points: Vec<Vec<f64>> =
            tried.iter().zip(&steps).map(|(&k, step)| state.coordinates[k].point_at(&step.to)).collect();
        let answers = oracle.evaluate(&points)?;
        let decrease = |answer: &Evaluation| match answer.scaled {
            Some(_) => sum - answer.merit.objective,
            None => f64::NEG_INFINITY,
        };
        let ratios: Vec<f64> = answers.iter().zip(&steps).map(|(a, step)| decrease(a) / step.predicted).collect();
        let accepted = (0..tried.len()).filter(|&i| LeastSquares::accepts(ratios[i]));
        let Some(best) = accepted.max_by(|&i, &j| decrease(&answers[i]).total_cmp(&decrease(&answers[j]))) else {
            let can_continue = tried.iter().zip(&ratios).map(|(&k, &ratio)| state.iterates[k].reject(ratio));
            let can_continue = can_continue.fold(false, |any, can| any | can);
            return Ok(if can_continue { Progress::Continue } else { state.termination() });
        };
        let Some(at) = oracle.linearise(&points[best], 1.0)? else { return Ok(Progress::Stalled) };
        let actual = decrease(&answers[best]);
        state.preferred = tried[best];
        state.slow_steps = if actual <= SLOW * sum { state.slow_steps + 1 } else { 0 };
        state.move_to(&points[best], matrices(at), &tried, &ratios);
        state.stalled_steps = if actual <= 100.0 * self.options.tolerance * sum { state.stalled_steps + 1 } else { 0 };
        Ok(if state.stalled_steps >= 3 { state.termination() } else { Progress::Continue })
    }
}

/// Relative decrease of the sum of squares that counts as small, and number of such steps after which both coordinates
/// are tried.
const SLOW: f64 = 0.1;
const MANY_SLOW: usize = 3;

/// Coordinates of the steps, in [0, 1]: the tuners themselves, relative to their ranges, where a scale is logarithmic
/// and listed here; else the scaled tuners.
struct Coordinates {
    /// Logarithm of the ratio of the bounds of every tuner, 0 for a linear scale; empty for steps in the scaled tuners.
    log_ratios: Vec<f64>,
}

impl Coordinates {
    /// Returns the tuners on a logarithmic scale, by index, with the logarithms of the ratios of their bounds.
    fn bent(&self) -> impl Iterator<Item = (usize, f64)> {
        self.log_ratios.iter().copied().enumerate().filter(|(_, ratio)| *ratio != 0.0)
    }

    /// Returns the place of a point of the unit box.
    fn place_of(&self, point: &[f64]) -> Vec<f64> {
        let mut place = point.to_vec();
        for (j, ratio) in self.bent() {
            place[j] = ((math::exp(ratio * point[j]) - 1.0) / (math::exp(ratio) - 1.0)).clamp(0.0, 1.0);
        }
        place
    }

    /// Returns the point of the unit box at a place.
    fn point_at(&self, place: &[f64]) -> Vec<f64> {
        let mut point = place.to_vec();
        for (j, ratio) in self.bent() {
            let value = 1.0 + place[j] * (math::exp(ratio) - 1.0);
            point[j] = (math::ln(value) / ratio).clamp(0.0, 1.0);
        }
        point
    }

    /// Changes derivatives with respect to a point of the unit box to those with respect to its place.
    fn transform(&self, point: &[f64], jacobian: &mut DMatrix<f64>) {
        for (j, ratio) in self.bent() {
            let slope = (math::exp(ratio) - 1.0) / (ratio * math::exp(ratio * point[j]));
            jacobian.column_mut(j).scale_mut(slope);
        }
    }

    /// Begins an iteration at a point of the unit box.
    fn begin(&self, point: &[f64], (mut jacobian, residuals): (DMatrix<f64>, DVector<f64>)) -> LeastSquares {
        self.transform(point, &mut jacobian);
        LeastSquares::new(vec![[0.0, 1.0]; point.len()], self.place_of(point), residuals, jacobian)
    }
}

fn matrices(at: Linearisation) -> (DMatrix<f64>, DVector<f64>) {
    let residuals = DVector::from_vec(at.at.residuals);
    let (rows, columns) = (residuals.len(), at.residuals.len());
    let jacobian = DMatrix::from_iterator(rows, columns, at.residuals.into_iter().flatten());
    (jacobian, residuals)
}

impl State {
    /// Moves the iterates to a point; `ratios` are those of the coordinates that were `tried`. Creates the second one
    /// if it is needed from now on.
    fn move_to(&mut self, point: &[f64], mut matrices: (DMatrix<f64>, DVector<f64>), tried: &[usize], ratios: &[f64]) {
        /// Ratio that leaves the damping as it is.
        const NEUTRAL: f64 = 0.5;
        let is_needed = self.slow_steps >= MANY_SLOW && self.coordinates[1].bent().next().is_some();
        if self.iterates.len() == 1 && is_needed {
            let damping = self.iterates[0].damping();
            self.iterates.push(self.coordinates[1].begin(point, matrices.clone()).damped(damping));
        }
        for k in 0..self.iterates.len() {
            let ratio = tried.iter().position(|&other| other == k).map_or(NEUTRAL, |i| ratios[i]);
            let ratio = if LeastSquares::accepts(ratio) {
                ratio
            } else {
                self.iterates[k].reject(ratio);
                NEUTRAL
            };
            let is_last = k + 1 == self.iterates.len();
            let (mut jacobian, residuals) = if is_last { std::mem::take(&mut matrices) } else { matrices.clone() };
            self.coordinates[k].transform(point, &mut jacobian);
            self.iterates[k].accept(self.coordinates[k].place_of(point), residuals, jacobian, ratio);
        }
    }

    /// Applies More's test: at an optimum the residuals are orthogonal to every column of the Jacobian of a free
    /// coordinate.
    fn termination(&self) -> Progress {
        /// Largest cosine regarded as orthogonal: the accuracy of finite-difference gradients.
        const ORTHOGONAL: f64 = 1e-3;
        if self.iterates[0].largest_cosine() <= ORTHOGONAL { Progress::Converged } else { Progress::Stalled }
    }
}
