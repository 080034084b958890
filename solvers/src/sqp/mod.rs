//! Sequential quadratic programming on the epigraph form of the min-max problem.

mod bundle;
mod hessian;
mod scaling;
mod state;

use mops_core::{Evaluation, Halt, Oracle, Progress, Shape, Solver, SolverOptions};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::epigraph::Direction;
use crate::rows::Rows;
use crate::start::usable_start;
use state::{SATISFIED, State};

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
        Box::new(Sqp { options: self.clone(), state: None, room: Room::default() })
    }
}

/// The solver of the kind `sqp`.
struct Sqp {
    options: SqpOptions,
    state: Option<State>,
    room: Room,
}

/// Memory that is used again from step to step.
#[derive(Default)]
struct Room {
    direction: Direction,
    /// The second-order correction of the step.
    second: Direction,
    /// The rows after them, without slopes.
    tried: [Rows; 2],
    /// The rows of a linearisation.
    linear: Rows,
}

/// The radius below which the trust region has collapsed: a kink or a jump that no model describes.
const SMALLEST_RADIUS: f64 = 1e-9;

/// Slope of the Lagrangian that counts as none, where the steepest row has one of about 1 at the start.
const STATIONARY: f64 = 1e-9;

/// Change of objective and violation that is none, relative to 1 + |objective|; and so many steps of that kind in a row are
/// enough: what is left is the noise of simulations.
const IDLE: f64 = 1e-10;
const MOST_IDLE: usize = 8;

/// Share of the promise that a step must keep.
const ENOUGH: f64 = 1e-4;

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
        let Self { options, state, room } = self;
        let Some(state) = state else { return Ok(Progress::Stalled) };
        if state.at.at.point.is_empty() {
            return Ok(Progress::Converged);
        }
        state.iterations += 1;
        if state.iterations > options.max_iterations {
            return Ok(Progress::Stalled);
        }
        state.rescale();
        if state.direction(&mut room.direction).is_none() {
            // The Hessian may be at fault: forget it, once.
            if !state.hessian.has_learned() {
                return Ok(Progress::Stalled);
            }
            state.hessian.forget();
            return Ok(Progress::Continue);
        }
        let direction = &room.direction;
        let merit = state.merit(&state.rows);
        let promised =
            merit - (direction.level + state.penalty * direction.violation + state.hessian.half(&direction.step));
        let size = state.scaling.objective().min(1.0) + state.rows.objective().abs();
        let tolerance = options.tolerance * size;
        if promised <= tolerance || state.radius < SMALLEST_RADIUS {
            return Ok(state.conclude(direction, merit, tolerance, options.radius, promised <= tolerance));
        }
        let before = [state.rows.objective(), state.rows.violation()];
        let tried = state.try_corrected(oracle, room, merit, promised)?;
        state.judge(oracle, tried.as_ref(), room, merit, promised)?;
        let change = (before[0] - state.rows.objective()).abs().max((before[1] - state.rows.violation()).abs());
        state.idle = if change <= IDLE * size { state.idle + 1 } else { 0 };
        if state.idle >= MOST_IDLE {
            state.idle = 0;
            let optimal = promised <= 1e4 * tolerance;
            return Ok(state.conclude(&room.direction, merit, tolerance, options.radius, optimal));
        }
        Ok(Progress::Continue)
    }
}

impl State {
    /// Nothing is promised any more, or the trust region has collapsed: the end, unless old pieces or a curvature that is
    /// too large hide a descent.
    fn conclude(&mut self, direction: &Direction, merit: f64, tolerance: f64, radius: f64, optimal: bool) -> Progress {
        let settled = self.fresh_at.is_some_and(|fresh| merit > fresh - 10.0 * tolerance);
        let stationary = optimal && self.bundle.is_empty() && self.residual(direction) <= STATIONARY;
        if !settled && !stationary {
            self.fresh_at = Some(merit);
            self.bundle.clear();
            self.hessian.forget();
            self.radius = 0.01 * radius;
            return Progress::Continue;
        }
        if optimal && self.rows.violation() <= 10.0 * SATISFIED { Progress::Converged } else { Progress::Stalled }
    }

    /// Tries the step, and its second-order correction where the step fails; the rows of what is better come first.
    fn try_corrected(
        &mut self,
        oracle: &mut dyn Oracle,
        room: &mut Room,
        merit: f64,
        promised: f64,
    ) -> Result<Option<Evaluation>, Halt> {
        let Room { direction, second, tried: rows, .. } = room;
        let tried = self.try_step(oracle, &direction.step, &mut rows[0])?;
        if tried.is_none() {
            return Ok(None);
        }
        let reached = self.merit(&rows[0]);
        if reached <= merit - 0.1 * promised || self.correction(&rows[0], &direction.step, second).is_none() {
            return Ok(tried);
        }
        let again = self.try_step(oracle, &second.step, &mut rows[1])?;
        if again.is_none() || self.merit(&rows[1]) >= reached {
            return Ok(tried);
        }
        rows.swap(0, 1);
        Ok(again)
    }

    /// Accepts or rejects what was tried, and changes the trust region.
    fn judge(
        &mut self,
        oracle: &mut dyn Oracle,
        tried: Option<&Evaluation>,
        room: &mut Room,
        merit: f64,
        promised: f64,
    ) -> Result<(), Halt> {
        let Room { direction, tried: [rows, _], linear, .. } = room;
        let length = direction.step.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
        let achieved = tried.map_or(f64::NEG_INFINITY, |_| merit - self.merit(rows));
        // A step that is better in objective or violation may also be measured from the worst of the two iterates before:
        // the path along a curved constraint is not held up by a merit that rises a little.
        let before = self.reference() - merit;
        let trades =
            tried.is_some_and(|_| rows.objective() < self.rows.objective() || rows.violation() < self.rows.violation());
        let relaxed = if trades { (achieved + before) / (promised + before) } else { f64::NEG_INFINITY };
        let ratio = (achieved / promised).max(relaxed);
        if ratio < 0.25 {
            // Where the parabola through both values, with the slope here, has its minimum.
            let slope = promised + self.hessian.half(&direction.step);
            let best = if achieved.is_finite() { 0.5 * slope / (slope - achieved) } else { 0.25 };
            self.radius = (length * best.clamp(0.1, 0.5)).min(0.5 * self.radius);
        } else if ratio > 0.75 && length > 0.99 * self.radius {
            let factor = if (ratio - 1.0).abs() < 0.1 { 4.0 } else { 2.0 };
            self.radius = (factor * self.radius).min(1.0);
        }
        let Some(evaluation) = tried else { return Ok(()) };
        let improves = ratio > ENOUGH;
        self.rejected = if improves { 0 } else { self.rejected + 1 };
        // Slopes are worth their price where the point is better, or where it lies beyond a kink.
        if !improves && length > KINK && self.rejected < 2 {
            return Ok(());
        }
        let Some(at) = oracle.linearise(&evaluation.point, self.radius)? else {
            self.radius *= 0.25;
            return Ok(());
        };
        self.linearise(oracle.shape(), &at, linear);
        if improves {
            self.move_to(at, linear, direction);
        } else if length <= KINK && turns(&self.rows, linear) {
            self.bundle.remember(&at.at.point, linear);
        } else {
            self.learn(&at.at.point, linear, direction);
        }
        Ok(())
    }
}

/// A step shorter than this that fails has met a kink, if the slopes say so: smooth rows are well described by them there.
const KINK: f64 = 0.02;

/// Whether a slope changes by as much as a tenth of the steepest.
fn turns(before: &Rows, after: &Rows) -> bool {
    let pairs = |rows: fn(&Rows) -> &Vec<crate::rows::Linear>| rows(before).iter().zip(rows(after));
    let all = pairs(|rows| &rows.objectives).chain(pairs(|rows| &rows.inequalities));
    all.into_iter().any(|(a, b)| {
        let size = a.slope.iter().chain(&b.slope).fold(0.0_f64, |most, s| most.max(s.abs()));
        a.slope.iter().zip(&b.slope).any(|(a, b)| (a - b).abs() > 0.1 * size)
    })
}
