//! BFGS with a line search, for one function that may have kinks.

use mops_core::{Halt, Objective, Oracle, Progress, Shape, Solver, Usage, solver::Linearisation};
use nalgebra::{DMatrix, DVector};

use crate::linearised_criteria::LinearisedCriteria;
use crate::start::usable_start;

/// BFGS for one function without constraints; used by `auto` for such problems.
///
/// The line search satisfies the weak Wolfe conditions, which have a solution at kinks, too. The curvature across a
/// kink grows without bound, so that the steps follow the kink. Coordinates at a bound are fixed if the descent
/// direction leaves the box.
///
/// Source: A. S. Lewis, M. L. Overton, Nonsmooth optimization via quasi-Newton methods, Mathematical Programming 141
/// (2013) 135-163, algorithms 2.1 and 2.6.
///
/// N.B.: a first step, whose length is unknown, must satisfy a stricter decrease condition. The curvature condition is
/// waived for steps with a negligible predicted decrease.
#[derive(Default)]
pub struct QuasiNewton {
    state: Option<State>,
    /// True if the iteration ends at the coarse tolerance.
    coarse: bool,
}

impl QuasiNewton {
    /// Creates a solver that ends when steps decrease the value by less than a millionth; [`QuasiNewton::refine`]
    /// continues it.
    pub fn coarse() -> Self {
        Self { coarse: true, ..Self::default() }
    }

    /// Continues to full accuracy.
    pub fn refine(&mut self) {
        self.coarse = false;
        if let Some(state) = &mut self.state {
            state.stalled_steps = 0;
        }
    }
}

struct State {
    iterate: Linearisation,
    value: f64,
    gradient: DVector<f64>,
    /// Approximation of the inverse Hessian.
    inverse: DMatrix<f64>,
    /// True once the inverse Hessian contains curvature information.
    has_curvature: bool,
    /// Radius within which gradients have to describe the function.
    gradient_radius: f64,
    /// Value at the last reset of the inverse Hessian.
    value_at_reset: f64,
    /// Number of successive iterations with negligible decrease.
    stalled_steps: usize,
    /// Number of successive steps that have probably crossed a kink.
    kink_steps: usize,
}

/// Armijo constant: required share of the predicted decrease.
const ARMIJO: f64 = 1e-4;

/// Armijo constant of a first step, whose length is unknown. A longer step may cross a valley into a flat region, as
/// for the problem Osborne 1. The step to the minimum of a parabola achieves one half.
const ARMIJO_FIRST: f64 = 0.3;

/// Wolfe constant: permitted share of the initial directional derivative after a step.
const WOLFE: f64 = 0.9;

/// Length of the first step, in the unit box.
const FIRST_STEP: f64 = 0.05;

/// Maximum number of function values per line search.
const MAX_TRIALS: usize = 40;

/// Radii within which gradients have to describe the function: at first wide, then small, near kinks.
const GRADIENT_RADII: [f64; 2] = [1.0, 1e-6];

/// Relative decrease regarded as zero, and number of successive such steps that end the iteration.
const STALL_TOLERANCE: f64 = 1e-11;
const MAX_STALLED: usize = 4;

/// Tolerances of the coarse end: most studies need three or four digits.
const COARSE_STALL_TOLERANCE: f64 = 1e-6;
const MAX_STALLED_COARSE: usize = 2;

/// Error of the trapezoidal rule along a step, relative to the change of the directional derivative, that indicates a
/// kink; far smaller for smooth functions. After several such steps in succession, a solver for kinks has to continue.
const KINK_RATIO: f64 = 0.12;
const MAX_KINK_STEPS: usize = 3;

impl Solver for QuasiNewton {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        let minimised = shape.rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count();
        let is_scalar = minimised == 1 || (minimised > 1 && shape.objective == Objective::Sum);
        let is_continuous = shape.spacing.iter().all(|&spacing| spacing == 0.0);
        if is_scalar && is_continuous && !shape.has_constraints() {
            return Ok(());
        }
        Err("BFGS minimises one function of continuous tuners without constraints; use `sqp`".into())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let Some(at) = oracle.linearise(&start, GRADIENT_RADII[0])? else { return Ok(()) };
        let (value, gradient) = objective_and_gradient(oracle.shape(), &at);
        let n = start.len();
        let inverse = DMatrix::zeros(n, n);
        let mut state = State {
            iterate: at,
            value,
            gradient,
            inverse,
            has_curvature: false,
            gradient_radius: GRADIENT_RADII[0],
            value_at_reset: f64::INFINITY,
            stalled_steps: 0,
            kink_steps: 0,
        };
        state.reset_curvature();
        self.state = Some(state);
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let Some(state) = &mut self.state else { return Ok(Progress::Stalled) };
        if state.iterate.at.point.is_empty() {
            return Ok(Progress::Converged);
        }
        let direction = state.direction();
        let descent_rate = -state.gradient.dot(&direction);
        let is_stationary =
            descent_rate <= STALL_TOLERANCE * STALL_TOLERANCE * state.value.abs() || !descent_rate.is_finite();
        if !is_stationary && state.kink_steps >= MAX_KINK_STEPS {
            return Ok(Progress::Stalled);
        }
        let before = state.value;
        let (tolerance, max_stalled) =
            if self.coarse { (COARSE_STALL_TOLERANCE, MAX_STALLED_COARSE) } else { (STALL_TOLERANCE, MAX_STALLED) };
        if !is_stationary && state.search(oracle, &direction, descent_rate)? {
            state.stalled_steps =
                if before - state.value <= tolerance * before.abs() { state.stalled_steps + 1 } else { 0 };
            if state.stalled_steps < max_stalled {
                return Ok(Progress::Continue);
            }
        }
        if self.coarse { Ok(Progress::Converged) } else { state.restart(oracle) }
    }
}

/// Returns value and gradient of the objective.
fn objective_and_gradient(shape: &Shape, at: &Linearisation) -> (f64, DVector<f64>) {
    let objective = LinearisedCriteria::from_linearisation(shape, at).objectives.swap_remove(0);
    (objective.value, DVector::from_vec(objective.gradient))
}

impl State {
    /// Resets the inverse Hessian to a first step of given length.
    fn reset_curvature(&mut self) {
        let n = self.gradient.len();
        self.inverse = DMatrix::identity(n, n) * (FIRST_STEP / self.gradient.amax().max(f64::MIN_POSITIVE));
        self.has_curvature = false;
        self.stalled_steps = 0;
    }

    /// Returns true if a coordinate is at a bound and descent would leave the box.
    fn is_fixed_at_bound(&self, j: usize) -> bool {
        let (u, s) = (self.iterate.at.point[j], self.gradient[j]);
        (u <= 0.0 && s > 0.0) || (u >= 1.0 && s < 0.0)
    }

    /// Returns the gradient with zeros for the coordinates fixed at a bound.
    fn projected_gradient(&self) -> DVector<f64> {
        DVector::from_fn(self.gradient.len(), |j, _| if self.is_fixed_at_bound(j) { 0.0 } else { self.gradient[j] })
    }

    /// Returns the quasi-Newton step of the free coordinates.
    fn direction(&self) -> DVector<f64> {
        let step = -(&self.inverse * self.projected_gradient());
        DVector::from_fn(step.len(), |j, _| if self.is_fixed_at_bound(j) { 0.0 } else { step[j] })
    }

    /// Returns the largest multiple of a direction that stays in the box.
    fn max_step_within_bounds(&self, direction: &DVector<f64>) -> f64 {
        let to_bound = |(u, d): (&f64, &f64)| match d {
            d if *d > 0.0 => (1.0 - u) / d,
            d if *d < 0.0 => -u / d,
            _ => f64::INFINITY,
        };
        self.iterate.at.point.iter().zip(direction.iter()).map(to_bound).fold(f64::INFINITY, f64::min)
    }

    /// Line search for the weak Wolfe conditions, limited by the box; returns false if no point is better.
    fn search(&mut self, oracle: &mut dyn Oracle, direction: &DVector<f64>, descent_rate: f64) -> Result<bool, Halt> {
        let max_step = self.max_step_within_bounds(direction);
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut t = 1.0_f64.min(max_step);
        let mut accepted: Option<(Linearisation, f64, DVector<f64>)> = None;
        for _ in 0..MAX_TRIALS {
            if t <= 0.0 {
                break;
            }
            let point: Vec<f64> =
                self.iterate.at.point.iter().zip(direction.iter()).map(|(u, d)| (u + t * d).clamp(0.0, 1.0)).collect();
            if point == self.iterate.at.point {
                break;
            }
            let answer = oracle.evaluate(std::slice::from_ref(&point))?.pop().expect("one point, one answer");
            let value = answer.scaled.as_ref().map_or(f64::INFINITY, |_| answer.merit.objective);
            let armijo = if self.has_curvature { ARMIJO } else { ARMIJO_FIRST };
            if !(value <= self.value - armijo * t * descent_rate && value < self.value) {
                high = t;
                // Minimiser of the interpolating parabola, or bisection if an earlier step was acceptable.
                let minimiser = 0.5 * t * t * descent_rate / (value - self.value + t * descent_rate);
                let interpolated = if minimiser.is_finite() { minimiser.clamp(0.1 * t, 0.5 * t) } else { 0.1 * t };
                t = if low > 0.0 { 0.5 * (low + high) } else { interpolated };
                continue;
            }
            let Some(at) = oracle.linearise(&point, self.gradient_radius)? else {
                high = t;
                t = 0.5 * (low + high);
                continue;
            };
            let (value, gradient) = objective_and_gradient(oracle.shape(), &at);
            let remaining = -gradient.dot(direction);
            accepted = Some((at, value, gradient));
            // For a negligible predicted decrease, finite-difference gradients are unreliable too.
            if remaining <= WOLFE * descent_rate || t >= max_step || t * descent_rate <= STALL_TOLERANCE * value.abs() {
                break;
            }
            low = t;
            t = if high.is_finite() { 0.5 * (low + high) } else { (2.0 * t).min(max_step) };
        }
        let Some((at, value, gradient)) = accepted else { return Ok(false) };
        let s = DVector::from_fn(gradient.len(), |j, _| at.at.point[j] - self.iterate.at.point[j]);
        let y = &gradient - &self.gradient;
        let quadrature_error = value - self.value - 0.5 * (&gradient + &self.gradient).dot(&s);
        self.kink_steps = if quadrature_error.abs() > KINK_RATIO * y.dot(&s).abs() { self.kink_steps + 1 } else { 0 };
        (self.iterate, self.value, self.gradient) = (at, value, gradient);
        self.update(&s, &y);
        Ok(true)
    }

    /// Updates the inverse Hessian with a step and the change of the gradient along it.
    fn update(&mut self, s: &DVector<f64>, y: &DVector<f64>) {
        let sy = s.dot(y);
        if sy <= 1e-14 * s.norm() * y.norm() {
            return;
        }
        let n = s.len();
        if !self.has_curvature {
            self.inverse = DMatrix::identity(n, n) * (sy / y.norm_squared());
            self.has_curvature = true;
        }
        let hy = &self.inverse * y;
        let factor = (1.0 + y.dot(&hy) / sy) / sy;
        self.inverse.ger(factor, s, s, 1.0);
        self.inverse.ger(-1.0 / sy, s, &hy, 1.0);
        self.inverse.ger(-1.0 / sy, &hy, s, 1.0);
        if self.inverse.iter().any(|h| !h.is_finite()) {
            self.reset_curvature();
        }
    }

    /// Restarts after a failed line search, with gradients of a smaller radius and without curvature information. Ends
    /// if the value has not decreased since the last restart.
    fn restart(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let has_improved =
            self.value_at_reset.is_infinite() || self.value_at_reset - self.value > 1e-8 * self.value.abs();
        if !has_improved {
            // Curvature from a kink shortens the steps: test the gradient instead.
            let stationary = self.projected_gradient().amax() <= 1e-4 * self.value.abs();
            return Ok(if stationary { Progress::Converged } else { Progress::Stalled });
        }
        self.value_at_reset = self.value;
        self.gradient_radius = GRADIENT_RADII[1];
        let point = self.iterate.at.point.clone();
        let Some(at) = oracle.linearise(&point, self.gradient_radius)? else { return Ok(Progress::Stalled) };
        (self.value, self.gradient) = objective_and_gradient(oracle.shape(), &at);
        self.iterate = at;
        self.reset_curvature();
        self.inverse *= 0.02;
        Ok(Progress::Continue)
    }
}
