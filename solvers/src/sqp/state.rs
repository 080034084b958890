//! Where the iteration stands: the rows at the best point, their curvature, the trust region and the penalty.

use mops_core::{Evaluation, Halt, Linearisation, Oracle, Shape};

use super::bundle::Bundle;
use super::hessian::Hessian;
use super::scaling::Scaling;
use crate::epigraph::{Direction, Subproblem};
use crate::rows::Rows;

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
    room: Room,
}

/// Memory that is used again from step to step.
#[derive(Default)]
struct Room {
    low: Vec<f64>,
    high: Vec<f64>,
    /// The rows here with the pieces of the bundle.
    all: Rows,
    corrected: Rows,
    /// The point that is tried.
    point: Vec<f64>,
    step: Vec<f64>,
    /// Slopes of the Lagrangian before and after a step.
    slopes: [Vec<f64>; 2],
    /// The step where nothing but the constraints counts.
    most: Direction,
}

impl State {
    pub fn new(shape: &Shape, at: Linearisation, radius: f64) -> Self {
        let n = at.at.point.len();
        let mut rows = Rows::of(shape, &at);
        let scaling = Scaling::of(&rows);
        let hessian = Hessian::new(n, rows.objectives.len());
        scaling.apply(&mut rows);
        Self {
            rows,
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
            room: Room::default(),
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

    /// Finds the step of the subproblem; the penalty grows until the violation falls as far as the trust region allows.
    #[must_use]
    pub fn direction(&mut self, into: &mut Direction) -> Option<()> {
        let violation = self.rows.violation();
        self.solve(self.penalty, into)?;
        if into.violation > SATISFIED {
            // What can be reached if nothing but the constraints counts.
            let mut most = std::mem::take(&mut self.room.most);
            let found = self.solve(LARGEST_PENALTY, &mut most);
            let least = most.violation;
            self.room.most = most;
            found?;
            let wanted = least + 0.1 * (violation - least).max(0.0) + SATISFIED;
            while into.violation > wanted && self.penalty < LARGEST_PENALTY {
                self.penalty *= 10.0;
                self.solve(self.penalty, into)?;
            }
        }
        // Exactness: the penalty must exceed the sum of the multipliers.
        let sum = into.multipliers.of_constraints();
        if into.violation <= SATISFIED && 1.5 * sum > self.penalty {
            self.penalty = 2.0 * sum;
        }
        Some(())
    }

    /// Finds the step to where the same slopes lead from the values at a point that was tried.
    #[must_use]
    pub fn correction(&mut self, tried: &Rows, step: &[f64], into: &mut Direction) -> Option<()> {
        let mut corrected = std::mem::take(&mut self.room.corrected);
        corrected.correct(&self.rows, tried, step);
        std::mem::swap(&mut corrected, &mut self.rows);
        let found = self.solve(self.penalty, into);
        std::mem::swap(&mut corrected, &mut self.rows);
        self.room.corrected = corrected;
        found
    }

    /// Finds the step for the rows.
    fn solve(&mut self, penalty: f64, into: &mut Direction) -> Option<()> {
        let Self { at, rows, bundle, hessian, subproblem, radius, room, .. } = self;
        let here = &at.at.point;
        room.low.clear();
        room.low.extend(here.iter().map(|u| (-u).max(-*radius)));
        room.high.clear();
        room.high.extend(here.iter().map(|u| (1.0 - u).min(*radius)));
        if bundle.is_empty() {
            return subproblem.solve(rows, hessian.matrix(), [&room.low, &room.high], penalty, into);
        }
        bundle.add_to(rows, here, &mut room.all);
        subproblem.solve(&room.all, hessian.matrix(), [&room.low, &room.high], penalty, into)
    }

    /// Reads the rows of a linearisation.
    pub fn linearise(&self, shape: &Shape, at: &Linearisation, rows: &mut Rows) {
        rows.linearise(shape, at);
        self.scaling.apply(rows);
    }

    /// Evaluates the point after a step, and reads its rows, which have no slopes; `None` where the point fails.
    pub fn try_step(
        &mut self,
        oracle: &mut dyn Oracle,
        step: &[f64],
        rows: &mut Rows,
    ) -> Result<Option<Evaluation>, Halt> {
        let point = &mut self.room.point;
        point.clear();
        point.extend(self.at.at.point.iter().zip(step).map(|(u, d)| (u + d).clamp(0.0, 1.0)));
        let evaluation = oracle.evaluate(std::slice::from_ref(point))?.pop().expect("one point, one answer");
        let Some(scaled) = &evaluation.scaled else { return Ok(None) };
        rows.evaluate(oracle.shape(), scaled);
        self.scaling.apply(rows);
        Ok(Some(evaluation))
    }

    /// Takes in what the slopes at another point say of the curvature.
    pub fn learn(&mut self, point: &[f64], rows: &Rows, direction: &Direction) {
        let Room { step, slopes: [before, after], .. } = &mut self.room;
        step.clear();
        step.extend(point.iter().zip(&self.at.at.point).map(|(there, here)| there - here));
        self.rows.lagrangian_slope(&direction.multipliers, before);
        rows.lagrangian_slope(&direction.multipliers, after);
        after.iter_mut().zip(before).for_each(|(after, before)| *after -= *before);
        self.hessian.learn(step, after);
    }

    /// Moves to another point; its rows change places with those here.
    pub fn move_to(&mut self, at: Linearisation, rows: &mut Rows, direction: &Direction) {
        self.learn(&at.at.point, rows, direction);
        self.before = [Some([self.rows.objective(), self.rows.violation()]), self.before[0]];
        // What was here is a piece too as long as kinks are near.
        if !self.bundle.is_empty() {
            self.bundle.remember(&self.at.at.point, &self.rows);
        }
        self.bundle.keep_near(&at.at.point, 10.0 * self.radius);
        self.at = at;
        std::mem::swap(&mut self.rows, rows);
    }

    /// How far the slope of the Lagrangian is from 0 where no bound is in the way.
    pub fn residual(&mut self, direction: &Direction) -> f64 {
        let slope = &mut self.room.slopes[0];
        self.rows.lagrangian_slope(&direction.multipliers, slope);
        let held = |(u, s): &(&f64, &f64)| (**u <= 0.0 && **s > 0.0) || (**u >= 1.0 && **s < 0.0);
        self.at.at.point.iter().zip(&*slope).filter(|pair| !held(pair)).fold(0.0, |most, (_, s)| most.max(s.abs()))
    }
}

/// Violation in scaled rows that counts as none.
pub(super) const SATISFIED: f64 = 1e-10;

/// Beyond it the objective counts nothing.
const LARGEST_PENALTY: f64 = 1e8;
