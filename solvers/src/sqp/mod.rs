//! Sequential quadratic programming on the epigraph form of the min-max problem.

mod bundle;
mod hessian;
mod scaling;
mod state;

use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::epigraph::Direction;
use crate::linearised_criteria::LinearisedCriteria;
use crate::multistart::Multistart;
use crate::start::usable_start;
use state::{FEASIBILITY_TOLERANCE, State};

/// Sequential quadratic programming for `min max_i f_i` with constraints.
///
/// Every criterion is linearised on its own, and each step solves the epigraph subproblem in a trust region. So the
/// kink (non-differentiable point) where two criteria intersect is an ordinary solution. The Hessian of the Lagrangian
/// is a damped BFGS matrix; a rejected step receives one second-order correction. Inconsistent constraints are violated
/// as little as possible (elastic mode with exact l-infinity penalty). The penalty function may increase for one or two
/// steps.
///
/// A criterion may have kinks of its own: an overshoot is the largest of several peaks. If a step fails in spite of its
/// correction, the criteria are also linearised beyond the kink, and both linear models (cuts) count (bundle method).
///
/// For up to about 50 tuners. Converges fast, to the optimum of the basin of its starting point; hence it starts from
/// the initial guess of the study and from the best points of a sample of the box.
///
/// Source: R. Fletcher, Practical Methods of Optimization, 2nd edition (1987), section 14.4 (Sl1QP, second-order
/// correction), 14.6 (nonsmooth functions); M. J. D. Powell, in Numerical Analysis Dundee 1977, Lecture Notes in
/// Mathematics 630 (damped BFGS); R. M. Chamberlain, M. J. D. Powell, C. Lemarechal, H. C. Pedersen, Mathematical
/// Programming Study 16 (1982) 1-17 (watchdog technique); K. C. Kiwiel, Methods of Descent for Nondifferentiable
/// Optimization (1985) (bundles).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct SqpOptions {
    /// Predicted decrease below which the iteration stops, relative to 1 + |objective|.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Initial radius of the trust region, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub radius: f64,
    /// Largest number of starting points, including the initial guess of the study.
    #[schemars(range(min = 1, max = 10_000))]
    pub starts: usize,
    /// Maximum number of iterations per starting point.
    #[schemars(range(min = 1))]
    pub max_iterations: usize,
}

impl Default for SqpOptions {
    fn default() -> Self {
        Self { tolerance: 1e-12, radius: 1.0, starts: 8, max_iterations: 300 }
    }
}

impl SolverOptions for SqpOptions {
    const KIND: &'static str = "sqp";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Multistart::new(self.local(), self.starts))
    }
}

impl SqpOptions {
    /// Builds the solver from one starting point.
    pub fn local(&self) -> Box<dyn Solver> {
        Box::new(Sqp { options: self.clone(), state: None, workspace: Workspace::default() })
    }
}

/// Solver of the kind `sqp`.
struct Sqp {
    options: SqpOptions,
    state: Option<State>,
    workspace: Workspace,
}

/// Buffers that are reused between steps.
#[derive(Default)]
struct Workspace {
    direction: Direction,
    /// Second-order correction of the step.
    correction: Direction,
    /// Criteria after step and corrected step, without gradients.
    trial: [LinearisedCriteria; 2],
    /// Criteria of a linearisation.
    linear: LinearisedCriteria,
}

/// Radius below which the trust region has collapsed: at a kink or discontinuity that no model describes.
const MIN_RADIUS: f64 = 1e-9;

/// Gradient of the Lagrangian regarded as zero; initially the largest derivative of the objectives is about 1.
const STATIONARY: f64 = 1e-9;

/// Change of objective and violation regarded as zero, relative to 1 + |objective|, and number of successive such steps
/// that end the iteration. The rest is simulation noise.
const STALL_TOLERANCE: f64 = 1e-10;
const MAX_STALLED: usize = 8;

/// Smallest ratio of actual to predicted reduction.
const MIN_RATIO: f64 = 1e-4;

impl Solver for Sqp {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        if shape.spacing.iter().any(|&spacing| spacing > 0.0) {
            return Err(
                "`sqp` needs gradients, but a tuner has whole numbers or a list of values; use `pattern-search`".into(),
            );
        }
        Ok(())
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.state = None;
        let radius = self.options.radius;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let Some(at) = oracle.linearise(&start, radius)? else { return Ok(()) };
        self.state = Some(State::new(oracle.shape(), at, radius));
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        // Without a state, every evaluated point has failed.
        let Self { options, state, workspace } = self;
        let Some(state) = state else { return Ok(Progress::Stalled) };
        if state.iterate.at.point.is_empty() {
            return Ok(Progress::Converged);
        }
        state.iterations += 1;
        if state.iterations > options.max_iterations {
            return Ok(Progress::Stalled);
        }
        state.update_scaling();
        if state.direction(&mut workspace.direction).is_none() {
            // Reset the Hessian once: it may be the cause.
            if !state.hessian.has_curvature() {
                return Ok(Progress::Stalled);
            }
            state.hessian.reset();
            return Ok(Progress::Continue);
        }
        let direction = &workspace.direction;
        let merit = state.merit(&state.criteria);
        let predicted = merit
            - (direction.level
                + state.penalty * direction.violation
                + state.hessian.half_quadratic_form(&direction.step));
        let size = state.scaling.objective().min(1.0) + state.criteria.objective().abs();
        let tolerance = options.tolerance * size;
        if predicted <= tolerance || state.radius < MIN_RADIUS {
            return Ok(state.terminate_or_reset(direction, merit, tolerance, options.radius, predicted <= tolerance));
        }
        let previous = [state.criteria.objective(), state.criteria.violation()];
        let trial = state.try_corrected(oracle, workspace, merit, predicted)?;
        state.accept_or_reject(oracle, trial.as_ref(), workspace, merit, predicted)?;
        let change =
            (previous[0] - state.criteria.objective()).abs().max((previous[1] - state.criteria.violation()).abs());
        state.stalled_steps = if change <= STALL_TOLERANCE * size { state.stalled_steps + 1 } else { 0 };
        if state.stalled_steps >= MAX_STALLED {
            state.stalled_steps = 0;
            let optimal = predicted <= 1e4 * tolerance;
            return Ok(state.terminate_or_reset(&workspace.direction, merit, tolerance, options.radius, optimal));
        }
        Ok(Progress::Continue)
    }
}

impl State {
    /// Ends the iteration if no decrease is predicted or the trust region has collapsed. First resets bundle and
    /// Hessian once, because old cuts or excessive curvature may hide a descent direction.
    fn terminate_or_reset(
        &mut self,
        direction: &Direction,
        merit: f64,
        tolerance: f64,
        radius: f64,
        optimal: bool,
    ) -> Progress {
        let is_settled = self.merit_at_reset.is_some_and(|merit_at_reset| merit > merit_at_reset - 10.0 * tolerance);
        let is_stationary = optimal && self.bundle.is_empty() && self.stationarity_residual(direction) <= STATIONARY;
        if !is_settled && !is_stationary {
            self.merit_at_reset = Some(merit);
            self.bundle.clear();
            self.hessian.reset();
            self.radius = 0.01 * radius;
            return Progress::Continue;
        }
        if optimal && self.criteria.violation() <= 10.0 * FEASIBILITY_TOLERANCE {
            Progress::Converged
        } else {
            Progress::Stalled
        }
    }

    /// Evaluates the step and, if it fails, its second-order correction. The criteria of the better one come first.
    fn try_corrected(
        &mut self,
        oracle: &mut dyn Oracle,
        workspace: &mut Workspace,
        merit: f64,
        predicted: f64,
    ) -> Result<Option<Evaluation>, Halt> {
        let Workspace { direction, correction, trial: criteria, .. } = workspace;
        let trial = self.try_step(oracle, &direction.step, &mut criteria[0])?;
        if trial.is_none() {
            return Ok(None);
        }
        let trial_merit = self.merit(&criteria[0]);
        if trial_merit <= merit - 0.1 * predicted
            || self.correction(&criteria[0], &direction.step, correction).is_none()
        {
            return Ok(trial);
        }
        let corrected = self.try_step(oracle, &correction.step, &mut criteria[1])?;
        if corrected.is_none() || self.merit(&criteria[1]) >= trial_merit {
            return Ok(trial);
        }
        criteria.swap(0, 1);
        Ok(corrected)
    }

    /// Accepts or rejects the trial point and updates the trust region.
    fn accept_or_reject(
        &mut self,
        oracle: &mut dyn Oracle,
        trial: Option<&Evaluation>,
        workspace: &mut Workspace,
        merit: f64,
        predicted: f64,
    ) -> Result<(), Halt> {
        let Workspace { direction, trial: [criteria, _], linear, .. } = workspace;
        let length = direction.step.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
        let actual = trial.map_or(f64::NEG_INFINITY, |_| merit - self.merit(criteria));
        // A step that improves objective or violation may also be compared with the worst of the last two iterates.
        // Otherwise a slightly increasing penalty function would delay the path along a curved constraint.
        let allowance = self.reference_merit() - merit;
        let is_better_in_one = trial.is_some_and(|_| {
            criteria.objective() < self.criteria.objective() || criteria.violation() < self.criteria.violation()
        });
        let relaxed = if is_better_in_one { (actual + allowance) / (predicted + allowance) } else { f64::NEG_INFINITY };
        let ratio = (actual / predicted).max(relaxed);
        if ratio < 0.25 {
            // Minimiser of the parabola through both values and the derivative at the iterate.
            let descent = predicted + self.hessian.half_quadratic_form(&direction.step);
            let best = if actual.is_finite() { 0.5 * descent / (descent - actual) } else { 0.25 };
            self.radius = (length * best.clamp(0.1, 0.5)).min(0.5 * self.radius);
        } else if ratio > 0.75 && length > 0.99 * self.radius {
            let factor = if (ratio - 1.0).abs() < 0.1 { 4.0 } else { 2.0 };
            self.radius = (factor * self.radius).min(1.0);
        }
        let Some(evaluation) = trial else { return Ok(()) };
        let is_improvement = ratio > MIN_RATIO;
        self.rejected_steps = if is_improvement { 0 } else { self.rejected_steps + 1 };
        // Gradients are worth their cost only at a better point or beyond a kink.
        if !is_improvement && length > KINK_STEP && self.rejected_steps < 2 {
            return Ok(());
        }
        let Some(at) = oracle.linearise(&evaluation.point, self.radius)? else {
            self.radius *= 0.25;
            return Ok(());
        };
        self.linearise(oracle.shape(), &at, linear);
        if is_improvement {
            self.move_to(at, linear, direction);
        } else if length <= KINK_STEP && gradients_differ(&self.criteria, linear) {
            self.bundle.insert(&at.at.point, linear);
        } else {
            self.update_hessian(&at.at.point, linear, direction);
        }
        Ok(())
    }
}

/// Step length below which a failed step indicates a kink, if the gradients differ: linear models of smooth criteria
/// are accurate there.
const KINK_STEP: f64 = 0.02;

/// Returns true if a derivative changes by more than a tenth of the largest one.
fn gradients_differ(previous: &LinearisedCriteria, after: &LinearisedCriteria) -> bool {
    let pairs = |criteria: fn(&LinearisedCriteria) -> &Vec<crate::linearised_criteria::LinearModel>| {
        criteria(previous).iter().zip(criteria(after))
    };
    let all_criteria = pairs(|criteria| &criteria.objectives).chain(pairs(|criteria| &criteria.inequalities));
    all_criteria.into_iter().any(|(a, b)| {
        let size = a.gradient.iter().chain(&b.gradient).fold(0.0_f64, |largest, s| largest.max(s.abs()));
        a.gradient.iter().zip(&b.gradient).any(|(a, b)| (a - b).abs() > 0.1 * size)
    })
}
