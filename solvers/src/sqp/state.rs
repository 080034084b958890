//! State of the iteration: linearised criteria, Hessian, trust region and penalty.

use mops_core::{Evaluation, Halt, Oracle, Shape, solver::Linearisation};

use super::bundle::Bundle;
use super::hessian::Hessian;
use super::scaling::Scaling;
use crate::epigraph::{Direction, Subproblem};
use crate::linearised_criteria::LinearisedCriteria;

pub(super) struct State {
    /// Values and gradients at the iterate.
    pub iterate: Linearisation,
    /// Scaled criteria at the iterate.
    pub criteria: LinearisedCriteria,
    pub scaling: Scaling,
    /// Cuts beyond kinks.
    pub bundle: Bundle,
    pub hessian: Hessian,
    /// Radius of the trust region, in the unit box.
    pub radius: f64,
    /// Weight of the violation in the exact penalty function.
    pub penalty: f64,
    pub iterations: usize,
    /// Number of successive rejected steps.
    pub rejected_steps: usize,
    /// Number of successive steps with negligible change.
    pub stalled_steps: usize,
    /// Objective and violation of the two previous iterates.
    previous: [Option<[f64; 2]>; 2],
    /// Penalty function at the last reset of bundle and Hessian.
    pub merit_at_reset: Option<f64>,
    subproblem: Subproblem,
    workspace: Workspace,
}

/// Buffers that are reused between steps.
#[derive(Default)]
struct Workspace {
    low: Vec<f64>,
    high: Vec<f64>,
    /// Criteria at the iterate with the cuts of the bundle.
    all_criteria: LinearisedCriteria,
    corrected: LinearisedCriteria,
    /// Trial point.
    point: Vec<f64>,
    step: Vec<f64>,
    /// Gradients of the Lagrangian before and after a step.
    gradients: [Vec<f64>; 2],
    /// Step that minimises the violation alone.
    feasibility_direction: Direction,
}

impl State {
    pub fn new(shape: &Shape, at: Linearisation, radius: f64) -> Self {
        let n = at.at.point.len();
        let mut criteria = LinearisedCriteria::from_linearisation(shape, &at);
        let scaling = Scaling::new(&criteria);
        let hessian = Hessian::new(n, criteria.objectives.len());
        scaling.apply(&mut criteria);
        Self {
            criteria,
            scaling,
            bundle: Bundle::default(),
            iterate: at,
            hessian,
            radius,
            penalty: 10.0,
            iterations: 0,
            rejected_steps: 0,
            stalled_steps: 0,
            previous: [None; 2],
            merit_at_reset: None,
            subproblem: Subproblem::default(),
            workspace: Workspace::default(),
        }
    }

    /// Rescales constraints whose gradients have changed substantially to the order of 1.
    pub fn update_scaling(&mut self) {
        self.scaling.update(&mut self.criteria);
    }

    /// Returns the exact penalty function.
    pub fn merit(&self, criteria: &LinearisedCriteria) -> f64 {
        criteria.objective() + self.penalty * criteria.violation()
    }

    /// Returns the largest penalty function of this iterate and the two before.
    pub fn reference_merit(&self) -> f64 {
        let previous =
            self.previous.iter().flatten().map(|[objective, violation]| objective + self.penalty * violation);
        previous.fold(self.merit(&self.criteria), f64::max)
    }

    /// Computes the step of the subproblem; the penalty grows until the violation falls as far as the trust region
    /// permits.
    #[must_use]
    pub fn direction(&mut self, into: &mut Direction) -> Option<()> {
        let violation = self.criteria.violation();
        self.solve(self.penalty, into)?;
        if into.violation > FEASIBILITY_TOLERANCE {
            // The smallest violation in the trust region.
            let mut feasibility_direction = std::mem::take(&mut self.workspace.feasibility_direction);
            let found = self.solve(LARGEST_PENALTY, &mut feasibility_direction);
            let least = feasibility_direction.violation;
            self.workspace.feasibility_direction = feasibility_direction;
            found?;
            let target = least + 0.1 * (violation - least).max(0.0) + FEASIBILITY_TOLERANCE;
            while into.violation > target && self.penalty < LARGEST_PENALTY {
                self.penalty *= 10.0;
                self.solve(self.penalty, into)?;
            }
        }
        // Exactness: the penalty must exceed the sum of the multipliers.
        let sum = into.multipliers.constraint_sum();
        if into.violation <= FEASIBILITY_TOLERANCE && 1.5 * sum > self.penalty {
            self.penalty = 2.0 * sum;
        }
        Some(())
    }

    /// Computes the second-order correction: the gradients at the iterate with the values at the trial point.
    #[must_use]
    pub fn correction(&mut self, trial: &LinearisedCriteria, step: &[f64], into: &mut Direction) -> Option<()> {
        let mut corrected = std::mem::take(&mut self.workspace.corrected);
        corrected.assign_second_order_correction(&self.criteria, trial, step);
        std::mem::swap(&mut corrected, &mut self.criteria);
        let found = self.solve(self.penalty, into);
        std::mem::swap(&mut corrected, &mut self.criteria);
        self.workspace.corrected = corrected;
        found
    }

    /// Solves the subproblem for the criteria and the bundle.
    fn solve(&mut self, penalty: f64, into: &mut Direction) -> Option<()> {
        let Self { iterate, criteria, bundle, hessian, subproblem, radius, workspace, .. } = self;
        let here = &iterate.at.point;
        workspace.low.clear();
        workspace.low.extend(here.iter().map(|u| (-u).max(-*radius)));
        workspace.high.clear();
        workspace.high.extend(here.iter().map(|u| (1.0 - u).min(*radius)));
        if bundle.is_empty() {
            return subproblem.solve(criteria, hessian.matrix(), [&workspace.low, &workspace.high], penalty, into);
        }
        bundle.add_to(criteria, here, &mut workspace.all_criteria);
        subproblem.solve(&workspace.all_criteria, hessian.matrix(), [&workspace.low, &workspace.high], penalty, into)
    }

    /// Sets scaled criteria from a linearisation.
    pub fn linearise(&self, shape: &Shape, at: &Linearisation, criteria: &mut LinearisedCriteria) {
        criteria.linearise(shape, at);
        self.scaling.apply(criteria);
    }

    /// Evaluates the point after a step and sets its scaled criteria, without gradients; `None` if the point fails.
    pub fn try_step(
        &mut self,
        oracle: &mut dyn Oracle,
        step: &[f64],
        criteria: &mut LinearisedCriteria,
    ) -> Result<Option<Evaluation>, Halt> {
        let point = &mut self.workspace.point;
        point.clear();
        point.extend(self.iterate.at.point.iter().zip(step).map(|(u, d)| (u + d).clamp(0.0, 1.0)));
        let evaluation = oracle.evaluate(std::slice::from_ref(point))?.pop().expect("one point, one answer");
        let Some(scaled) = &evaluation.scaled else { return Ok(None) };
        criteria.evaluate(oracle.shape(), scaled);
        self.scaling.apply(criteria);
        Ok(Some(evaluation))
    }

    /// Updates the Hessian with the gradients at another point.
    pub fn update_hessian(&mut self, point: &[f64], criteria: &LinearisedCriteria, direction: &Direction) {
        let Workspace { step, gradients: [previous, after], .. } = &mut self.workspace;
        step.clear();
        step.extend(point.iter().zip(&self.iterate.at.point).map(|(there, here)| there - here));
        self.criteria.lagrangian_gradient(&direction.multipliers, previous);
        criteria.lagrangian_gradient(&direction.multipliers, after);
        after.iter_mut().zip(previous).for_each(|(after, previous)| *after -= *previous);
        self.hessian.update(step, after);
    }

    /// Moves to another point and swaps its criteria with those of the iterate.
    pub fn move_to(&mut self, at: Linearisation, criteria: &mut LinearisedCriteria, direction: &Direction) {
        self.update_hessian(&at.at.point, criteria, direction);
        self.previous = [Some([self.criteria.objective(), self.criteria.violation()]), self.previous[0]];
        // While kinks are near, the old iterate becomes a cut, too.
        if !self.bundle.is_empty() {
            self.bundle.insert(&self.iterate.at.point, &self.criteria);
        }
        self.bundle.retain_near(&at.at.point, 10.0 * self.radius);
        self.iterate = at;
        std::mem::swap(&mut self.criteria, criteria);
    }

    /// Returns the largest entry of the Lagrangian's gradient among the coordinates not fixed at a bound.
    pub fn stationarity_residual(&mut self, direction: &Direction) -> f64 {
        let gradient = &mut self.workspace.gradients[0];
        self.criteria.lagrangian_gradient(&direction.multipliers, gradient);
        let is_fixed = |(u, s): &(&f64, &f64)| (**u <= 0.0 && **s > 0.0) || (**u >= 1.0 && **s < 0.0);
        self.iterate
            .at
            .point
            .iter()
            .zip(&*gradient)
            .filter(|pair| !is_fixed(pair))
            .fold(0.0, |largest, (_, s)| largest.max(s.abs()))
    }
}

/// Violation of scaled constraints regarded as zero.
pub(super) const FEASIBILITY_TOLERANCE: f64 = 1e-10;

/// Maximum penalty; above it the objective would have no influence.
const LARGEST_PENALTY: f64 = 1e8;
