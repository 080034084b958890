//! Where the iteration stands: the rows at the best point, their curvature, the trust region and the penalty.

use mops_core::{Evaluation, Halt, Linearisation, Oracle, Shape};
use nalgebra::DVector;

use super::bundle::Bundle;
use super::hessian::Hessian;
use super::scaling::Scaling;
use crate::epigraph::{Direction, Rows, Subproblem};

pub(super) struct State {
    /// Values and slopes at the iterate.
    pub at: Linearisation,
    /// Its rows.
    pub rows: Rows,
    pub scaling: Scaling,
    /// Pieces beyond kinks.
    pub bundle: Bundle,
    pub hessian: Hessian,
    /// Radius of the trust region, in the unit box.
    pub radius: f64,
    /// Factor of the violation in the exact penalty function.
    pub penalty: f64,
    pub iterations: usize,
    /// Steps in a row that brought nothing.
    pub rejected: usize,
    /// Steps in a row that changed almost nothing.
    pub idle: usize,
    /// Objective and violation of the two iterates before.
    before: [Option<[f64; 2]>; 2],
    /// Merit at which the memory was last thrown away.
    pub fresh_at: Option<f64>,
    subproblem: Subproblem,
}

/// A point that was tried, with its rows, which have no slopes.
pub(super) type Tried = (Evaluation, Rows);

impl State {
    pub fn new(shape: &Shape, at: Linearisation, radius: f64) -> Self {
        let n = at.at.point.len();
        let rows = Rows::of(shape, &at);
        let scaling = Scaling::of(&rows);
        let hessian = Hessian::new(n, rows.objectives.len());
        Self {
            rows: scaling.apply(rows),
            scaling,
            bundle: Bundle::default(),
            at,
            hessian,
            radius,
            penalty: 10.0,
            iterations: 0,
            rejected: 0,
            idle: 0,
            before: [None; 2],
            fresh_at: None,
            subproblem: Subproblem::default(),
        }
    }

    /// Brings constraints whose slopes have changed by much back to the order of 1.
    pub fn rescale(&mut self) {
        self.scaling.renew(&mut self.rows);
    }

    /// The exact penalty function.
    pub fn merit(&self, rows: &Rows) -> f64 {
        rows.objective() + self.penalty * rows.violation()
    }

    /// The largest merit of this iterate and the two before.
    pub fn reference(&self) -> f64 {
        let before = self.before.iter().flatten().map(|[objective, violation]| objective + self.penalty * violation);
        before.fold(self.merit(&self.rows), f64::max)
    }

    /// The step of the subproblem; the penalty grows until the violation falls as far as the trust region allows.
    pub fn direction(&mut self) -> Option<Direction> {
        let violation = self.rows.violation();
        let mut direction = self.solve(None, self.penalty)?;
        if direction.violation > SATISFIED {
            // What can be reached if nothing but the constraints counts.
            let least = self.solve(None, LARGEST_PENALTY)?.violation;
            let wanted = least + 0.1 * (violation - least).max(0.0) + SATISFIED;
            while direction.violation > wanted && self.penalty < LARGEST_PENALTY {
                self.penalty *= 10.0;
                direction = self.solve(None, self.penalty)?;
            }
        }
        // Exactness: the penalty must exceed the sum of the multipliers.
        let sum = direction.multipliers.of_constraints();
        if direction.violation <= SATISFIED && 1.5 * sum > self.penalty {
            self.penalty = 2.0 * sum;
        }
        Some(direction)
    }

    /// The step to where the same slopes lead from the values at a point that was tried.
    pub fn correction(&mut self, tried: &Rows, step: &[f64]) -> Option<Direction> {
        let corrected = self.rows.corrected(tried, step);
        self.solve(Some(&corrected), self.penalty)
    }

    /// The step for the rows here, or for others in their place.
    fn solve(&mut self, others: Option<&Rows>, penalty: f64) -> Option<Direction> {
        let Self { at, rows, bundle, hessian, subproblem, radius, .. } = self;
        let here = &at.at.point;
        let low: Vec<f64> = here.iter().map(|u| (-u).max(-*radius)).collect();
        let high: Vec<f64> = here.iter().map(|u| (1.0 - u).min(*radius)).collect();
        let rows = others.unwrap_or(rows);
        if bundle.is_empty() {
            return subproblem.solve(rows, hessian.matrix(), &low, &high, penalty);
        }
        let mut all = rows.clone();
        bundle.add_to(&mut all, here);
        subproblem.solve(&all, hessian.matrix(), &low, &high, penalty)
    }

    pub fn rows_of(&self, shape: &Shape, at: &Linearisation) -> Rows {
        self.scaling.apply(Rows::of(shape, at))
    }

    /// The rows after a step, without slopes; `None` where the point fails.
    pub fn try_step(&self, oracle: &mut dyn Oracle, step: &[f64]) -> Result<Option<Tried>, Halt> {
        let point: Vec<f64> = self.at.at.point.iter().zip(step).map(|(u, d)| (u + d).clamp(0.0, 1.0)).collect();
        let evaluation = oracle.evaluate(&[point])?.pop().expect("one point, one answer");
        let shape = oracle.shape();
        let none = vec![Vec::new(); shape.rows.len()];
        let rows = evaluation.scaled.as_ref().map(|scaled| self.scaling.apply(Rows::new(shape, scaled, &none)));
        Ok(rows.map(|rows| (evaluation, rows)))
    }

    /// Takes in what the slopes at another point say of the curvature.
    pub fn learn(&mut self, point: &[f64], rows: &Rows, direction: &Direction) {
        let s = DVector::from_fn(point.len(), |j, _| point[j] - self.at.at.point[j]);
        let before = DVector::from_vec(self.rows.lagrangian_slope(&direction.multipliers));
        let after = DVector::from_vec(rows.lagrangian_slope(&direction.multipliers));
        self.hessian.learn(&s, &(after - before));
    }

    pub fn move_to(&mut self, at: Linearisation, rows: Rows, direction: &Direction) {
        self.learn(&at.at.point, &rows, direction);
        self.before = [Some([self.rows.objective(), self.rows.violation()]), self.before[0]];
        // What was here is a piece too as long as kinks are near.
        if !self.bundle.is_empty() {
            self.bundle.remember(self.at.at.point.clone(), self.rows.clone());
        }
        self.bundle.keep_near(&at.at.point, 10.0 * self.radius);
        self.at = at;
        self.rows = rows;
    }

    /// How far the slope of the Lagrangian is from 0 where no bound is in the way.
    pub fn residual(&self, direction: &Direction) -> f64 {
        let slope = self.rows.lagrangian_slope(&direction.multipliers);
        let held = |(u, s): &(&f64, &f64)| (**u <= 0.0 && **s > 0.0) || (**u >= 1.0 && **s < 0.0);
        self.at.at.point.iter().zip(&slope).filter(|pair| !held(pair)).fold(0.0, |most, (_, s)| most.max(s.abs()))
    }
}

/// Violation in scaled rows that counts as none.
pub(super) const SATISFIED: f64 = 1e-10;

/// Beyond it the objective counts nothing.
const LARGEST_PENALTY: f64 = 1e8;
