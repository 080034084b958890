//! Models of what a direction would improve, and their steepest step.

use mops_core::Shape;
use mops_core::solver::Linearisation;
use nalgebra::DMatrix;

use crate::epigraph::{Direction, Subproblem};
use crate::linearised_criteria::LinearisedCriteria;

/// Curvature of the model of a direction, in units of the trial step.
pub(super) const CURVATURE: f64 = 1e-6;

/// Improvement per unit of step, relative to the largest derivative of the criterion, below which a direction does not
/// count as a descent direction. Corresponds to the accuracy of finite-difference gradients.
pub(super) const IMPROVEMENT: f64 = 1e-3;

/// Decrease within a trial step that is regarded as zero, of the objective or, in the test of Pareto optimality, of
/// every criterion, relative to its value plus [`mops_core::solver::SMALL_OBJECTIVE`]: the sentences on both tests
/// state it.
pub(super) const NEGLIGIBLE: f64 = mops_core::solver::NEGLIGIBLE_DECREASE;

/// Length of a trial step, in the unit box.
pub(super) const TRIAL_STEP: f64 = 1e-3;

/// Height above the point, per unit of [`TRIAL_STEP`] and of the largest derivative, above which a cut lies beyond a
/// discontinuity. Such a cut says nothing about the point.
pub(super) const MAX_CUT_VALUE: f64 = 0.5;

/// Cutting-plane model of what a direction would improve.
pub(super) trait Model {
    /// Returns the step of at most [`TRIAL_STEP`] that improves most, and the predicted improvement; `None` if rounding
    /// errors prevent its computation, or as soon as `goes_on` returns false.
    fn direction(&self, point: &[f64], goes_on: &dyn Fn() -> bool) -> Option<Step>;

    /// Returns true if the scaled values of a trial are an improvement.
    fn is_improvement(&self, shape: &Shape, trial: &[f64]) -> bool;

    /// Adds the linear models at another point, extrapolated to `point`. Those beyond a discontinuity are ignored;
    /// returns true if there are any.
    fn add(&mut self, shape: &Shape, point: &[f64], beyond: &Linearisation) -> bool;
}

/// Step that a model proposes.
pub(super) struct Step {
    /// Step in the unit box.
    pub(super) step: Vec<f64>,
    /// True if the predicted improvement is negligible.
    pub(super) is_negligible: bool,
}

/// Returns the step within the box, in trial steps, that lowers criteria in units of the trial step most, followed by
/// `changing` further unknowns, the changes of objectives or of means of objectives, none of which is positive. Returns
/// `None` if rounding errors prevent the computation, or as soon as `goes_on` returns false.
///
/// `curvature` makes the step unique; it is small compared with the improvements that count.
#[allow(clippy::cast_precision_loss)]
pub(super) fn steepest_step(
    criteria: &LinearisedCriteria,
    point: &[f64],
    (changing, curvature): (usize, f64),
    goes_on: &dyn Fn() -> bool,
) -> Option<Direction> {
    let mut low: Vec<f64> = point.iter().map(|&u| if u < 1e-6 { 0.0 } else { -1.0 }).collect();
    let mut high: Vec<f64> = point.iter().map(|&u| if u > 1.0 - 1e-6 { 0.0 } else { 1.0 }).collect();
    // With derivatives of at most 1, no objective changes by more.
    low.extend(std::iter::repeat_n(-(point.len() as f64), changing));
    high.extend(std::iter::repeat_n(0.0, changing));
    let hessian = DMatrix::identity(low.len(), low.len()) * curvature;
    let mut direction = Direction::default();
    // A penalty above every multiplier keeps the step within the constraints.
    Subproblem::default().solve_while(goes_on, criteria, &hessian, [&low, &high], 1e4, &mut direction)?;
    Some(direction)
}
