//! Interface of the one-step methods.

use mops_core::model::Work;
use mops_language::Scalar;

use super::Driven;
use super::attempt::Attempt;
use super::integrable::Integrable;
use super::weights::Weights;

/// One-step method with error estimate and dense output.
pub(super) trait Method<S: Scalar> {
    /// Order of the error of a step in its length `h`.
    const ERROR_ORDER: f64;
    /// True for an explicit method, which damps fast decaying modes only in short steps.
    const IS_EXPLICIT: bool;

    fn new<P: Integrable<S> + ?Sized>(f: &Driven<'_, S, P>, x: &[S]) -> Self;

    /// Restarts at `x`: at the start, and where an event or a break made the right-hand side jump.
    fn restart<P: Integrable<S> + ?Sized>(&mut self, f: &Driven<'_, S, P>, t: f64, x: &[S], work: &mut Work);

    /// Returns the derivative at the start of the next step.
    fn slope(&self) -> &[S];

    /// Computes the state after the step. Returns the weighted error norm, NaN if there is none.
    fn attempt<P: Integrable<S> + ?Sized>(
        &mut self,
        f: &Driven<'_, S, P>,
        at: Attempt<'_, S>,
        next: &mut [S],
        work: &mut Work,
    ) -> f64;

    /// Returns the longest step that damps all modes, estimated from the step last attempted; `None` for a method that
    /// damps them in every step, or if the step does not show it.
    fn stable_step(&self, _next: &[S], _weights: &Weights) -> Option<f64> {
        None
    }

    /// Moves to the start of the next step after the step was accepted.
    fn advance(&mut self);

    /// Computes the coefficients of [`Step`] for the step last attempted.
    fn dense(&self, h: f64, x: &[S], next: &[S], dense: &mut [Vec<S>; 5]);
}
