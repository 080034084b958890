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
use crate::start::usable_start;
use state::{FEASIBILITY_TOLERANCE, State};

/// Sequential quadratic programming for `min max_i f_i` with constraints: every row is linearised on its own, so that
/// the kink where two criteria meet is an ordinary solution, and a step solves the epigraph subproblem inside a trust
/// region. The Hessian of the Lagrangian is a damped BFGS matrix; a rejected step gets one second-order correction;
/// constraints that contradict each other are violated as little as can be (elastic mode, exact l-infinity penalty, which
/// may rise for a step or two).
///
/// A criterion may have kinks of its own: an overshoot is the largest of several peaks. Where a step fails in spite of
/// its correction, the rows are linearised beyond the kink too, and both pieces count from then on (a bundle).
///
/// For up to about 50 tuners; converges fast. It finds the optimum of the basin it starts in.
///
/// Source: R. Fletcher, Practical Methods of Optimization, 2nd edition (1987), section 14.4 (Sl1QP, second-order
/// correction), 14.6 (nonsmooth pieces); M. J. D. Powell, in Numerical Analysis Dundee 1977, Lecture Notes in Mathematics
/// 630 (damped BFGS); R. M. Chamberlain, M. J. D. Powell, C. Lemarechal, H. C. Pedersen, Mathematical Programming Study 16
/// (1982) 1-17 (merit that may rise); K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization (1985) (bundles).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct SqpOptions {
    /// Stop when the subproblem promises less than this, relative to 1 + |objective|.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// First radius of the trust region, in the unit box.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub radius: f64,
    /// Largest number of iterations.
    #[schemars(range(min = 1))]
    pub max_iterations: usize,
}

impl Default for SqpOptions {
    fn default() -> Self {
        Self { tolerance: 1e-12, radius: 1.0, max_iterations: 300 }
    }
}

impl SolverOptions for SqpOptions {
    const KIND: &'static str = "sqp";

    fn build(&self) -> Box<dyn Solver> {
        Box::new(Sqp { options: self.clone(), state: None, workspace: Workspace::default() })
    }
}

/// The solver of the kind `sqp`.
struct Sqp {
    options: SqpOptions,
    state: Option<State>,
    workspace: Workspace,
}

/// Memory that is used again from step to step.
#[derive(Default)]
struct Workspace {
    direction: Direction,
    /// The second-order correction of the step.
    correction: Direction,
    /// The rows after them, without slopes.
    trial: [LinearisedCriteria; 2],
    /// The rows of a linearisation.
    linear: LinearisedCriteria,
}

/// The radius below which the trust region has collapsed: a kink or a jump that no model describes.
const MIN_RADIUS: f64 = 1e-9;

/// Slope of the Lagrangian that counts as none, where the steepest row has one of about 1 at the start.
const STATIONARY: f64 = 1e-9;

/// Change of objective and violation that is none, relative to 1 + |objective|; and so many steps of that kind in a row are
/// enough: what is left is the noise of simulations.
const STALL_TOLERANCE: f64 = 1e-10;
const MAX_STALLED: usize = 8;

/// Share of the promise that a step must keep.
const MIN_RATIO: f64 = 1e-4;

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
        let radius = self.options.radius;
        let Some(start) = usable_start(oracle, start)? else { return Ok(()) };
        let Some(at) = oracle.linearise(&start, radius)? else { return Ok(()) };
        self.state = Some(State::new(oracle.shape(), at, radius));
        Ok(())
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        // Every point tried has failed, or there is nothing to change.
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
            // The Hessian may be at fault: forget it, once.
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
    /// Nothing is promised any more, or the trust region has collapsed: the end, unless old pieces or a curvature that is
    /// too large hide a descent.
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

    /// Tries the step, and its second-order correction where the step fails; the rows of what is better come first.
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

    /// Accepts or rejects what was tried, and changes the trust region.
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
        // A step that is better in objective or violation may also be measured from the worst of the two iterates before:
        // the path along a curved constraint is not held up by a merit that rises a little.
        let allowance = self.reference_merit() - merit;
        let is_better_in_one = trial.is_some_and(|_| {
            criteria.objective() < self.criteria.objective() || criteria.violation() < self.criteria.violation()
        });
        let relaxed = if is_better_in_one { (actual + allowance) / (predicted + allowance) } else { f64::NEG_INFINITY };
        let ratio = (actual / predicted).max(relaxed);
        if ratio < 0.25 {
            // Where the parabola through both values, with the slope here, has its minimum.
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
        // Slopes are worth their price where the point is better, or where it lies beyond a kink.
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

/// A step shorter than this that fails has met a kink, if the slopes say so: smooth rows are well described by them there.
const KINK_STEP: f64 = 0.02;

/// Whether a slope changes by as much as a tenth of the steepest.
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
