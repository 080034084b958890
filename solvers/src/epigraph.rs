//! Quadratic subproblem of a min-max problem in its smooth (epigraph) form, with elastic constraints.
//!
//! Given values and gradients of the criteria at a point, the subproblem for the step `d` is
//! ```text
//! min over d, t, e   1/2 d'Bd + t + penalty e
//! subject to         f_i + g_i d <= t         every objective
//!                    c_j + a_j d <= e         every inequality
//!                    |h_k + b_k d| <= e       every equality
//!                    low <= d <= high,  e >= 0
//! ```
//! A solution always exists: if the linearised constraints are inconsistent, `e` stays positive.

use nalgebra::DMatrix;

use crate::active_set::{ActiveSet, Constraints, dot};
use crate::cholesky::factorise;
use crate::linearised_criteria::{LinearModel, LinearisedCriteria, Multipliers};

/// Solution of the subproblem.
#[derive(Debug, Clone, Default)]
pub struct Direction {
    /// Step.
    pub step: Vec<f64>,
    /// Largest linearised objective after the step.
    pub level: f64,
    /// Largest linearised violation after the step.
    pub violation: f64,
    /// Multipliers of the criteria.
    pub multipliers: Multipliers,
}

/// Solver for the subproblem; reuses its memory from one step to the next.
///
/// The level `t` and the elastic violation `e` have no curvature of their own. A small curvature is added, centred at
/// the present level and at zero violation, so that it has no influence at a solution.
#[derive(Debug, Default)]
pub struct Subproblem {
    method: ActiveSet,
    constraints: Constraints,
    factor: Vec<f64>,
    linear: Vec<f64>,
    gradient: Vec<f64>,
    weights: Vec<f64>,
}

impl Subproblem {
    /// Curvature of level and violation, relative to the possible decrease of the objective.
    const CURVATURE: f64 = 1e-7;

    /// Computes the step between `low` and `high`. Returns `None` if the Hessian is not positive definite or rounding
    /// errors prevent convergence.
    #[must_use]
    pub fn solve(
        &mut self,
        criteria: &LinearisedCriteria,
        hessian: &DMatrix<f64>,
        [low, high]: [&[f64]; 2],
        penalty: f64,
        into: &mut Direction,
    ) -> Option<()> {
        self.solve_while(&|| true, criteria, hessian, [low, high], penalty, into)
    }

    /// Computes the step as [`Subproblem::solve`] does; returns `None` as soon as `goes_on` returns false, which is
    /// asked before every step of the active-set method.
    #[must_use]
    pub fn solve_while(
        &mut self,
        goes_on: &dyn Fn() -> bool,
        criteria: &LinearisedCriteria,
        hessian: &DMatrix<f64>,
        [low, high]: [&[f64]; 2],
        penalty: f64,
        into: &mut Direction,
    ) -> Option<()> {
        let n = low.len();
        let level = criteria.objective();
        let first = self.assemble_constraints(criteria, level, low, high);
        self.factor(hessian, &criteria.objectives[first].gradient)?;
        self.linear.clear();
        self.linear.resize(n, 0.0);
        self.linear.extend([1.0, penalty]);
        let no_violation = self.constraints.bounds.len() - 1;
        if !self.method.solve(goes_on, &self.factor, &self.linear, &self.constraints, &[first, no_violation]) {
            return None;
        }
        into.step.clear();
        into.step.extend((0..n).map(|j| self.method.x()[j].clamp(low[j], high[j])));
        let after = |row: &LinearModel| row.value + dot(&row.gradient, &into.step);
        into.level = criteria.objectives.iter().map(after).fold(f64::NEG_INFINITY, f64::max);
        let violation = criteria.inequalities.iter().map(after).fold(0.0, f64::max);
        into.violation = criteria.equalities.iter().map(|row| after(row).abs()).fold(violation, f64::max);
        self.read_multipliers(criteria, &mut into.multipliers);
        Some(())
    }

    /// Writes the criteria as constraints on step, level and violation: first the criteria in their order, then the
    /// box, then `e >= 0`. Returns the index of the largest objective.
    fn assemble_constraints(&mut self, criteria: &LinearisedCriteria, level: f64, low: &[f64], high: &[f64]) -> usize {
        self.constraints.clear();
        for row in &criteria.objectives {
            self.push(row, -1.0, [1.0, 0.0], row.value - level);
        }
        for row in &criteria.inequalities {
            self.push(row, -1.0, [0.0, 1.0], row.value);
        }
        for row in &criteria.equalities {
            self.push(row, -1.0, [0.0, 1.0], row.value);
            self.push(row, 1.0, [0.0, 1.0], -row.value);
        }
        let n = low.len();
        for (j, (low, high)) in low.iter().zip(high).enumerate() {
            for (sign, bound) in [(1.0, *low), (-1.0, -high)] {
                let begin = self.constraints.normals.len();
                self.constraints.normals.resize(begin + n + 2, 0.0);
                self.constraints.normals[begin + j] = sign;
                self.constraints.bounds.push(bound);
            }
        }
        self.constraints.normals.extend(std::iter::repeat_n(0.0, n + 1).chain([1.0]));
        self.constraints.bounds.push(0.0);
        criteria.objectives.iter().position(|row| row.value >= level).unwrap_or(0)
    }

    fn push(&mut self, row: &LinearModel, sign: f64, rest: [f64; 2], bound: f64) {
        self.constraints.normals.extend(row.gradient.iter().map(|s| sign * s));
        self.constraints.normals.extend(rest);
        self.constraints.bounds.push(bound);
    }

    /// Computes the Cholesky factor of the Hessian, extended by the small curvatures.
    fn factor(&mut self, hessian: &DMatrix<f64>, gradient: &[f64]) -> Option<()> {
        let n = gradient.len();
        let size = n + 2;
        self.factor.clear();
        self.factor.resize(size * size, 0.0);
        let l = &mut self.factor;
        for k in 0..n {
            l[k * size + k..k * size + n].copy_from_slice(&hessian.as_slice()[k * n + k..(k + 1) * n]);
        }
        if !factorise(l, n, size) {
            return None;
        }
        // Predicted decrease of one objective alone: |L^-1 g|^2.
        let y = &mut self.gradient;
        y.clear();
        y.extend_from_slice(gradient);
        for k in 0..n {
            y[k] = (y[k] - (0..k).map(|m| l[m * size + k] * y[m]).sum::<f64>()) / l[k * size + k];
        }
        let small = (Self::CURVATURE / (1.0 + dot(y, y))).sqrt();
        l[n * size + n] = small;
        l[(n + 1) * size + n + 1] = small;
        Some(())
    }

    /// Reads the multipliers of the criteria at the solution.
    fn read_multipliers(&mut self, criteria: &LinearisedCriteria, multipliers: &mut Multipliers) {
        let (f, c, h) = (criteria.objectives.len(), criteria.inequalities.len(), criteria.equalities.len());
        let all = &mut self.weights;
        all.clear();
        all.resize(f + c + h, 0.0);
        for (p, multiplier) in self.method.active() {
            match p {
                p if p < f + c => all[p] = multiplier,
                p if p < f + c + 2 * h => {
                    let (row, side) = ((p - f - c) / 2, (p - f - c) % 2);
                    all[f + c + row] += if side == 0 { multiplier } else { -multiplier };
                }
                _ => {}
            }
        }
        for (group, range) in [
            (&mut multipliers.objectives, 0..f),
            (&mut multipliers.inequalities, f..f + c),
            (&mut multipliers.equalities, f + c..f + c + h),
        ] {
            group.clear();
            group.extend_from_slice(&all[range]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(
        criteria: &LinearisedCriteria,
        hessian: &DMatrix<f64>,
        low: &[f64],
        high: &[f64],
        penalty: f64,
    ) -> Option<Direction> {
        let mut direction = Direction::default();
        Subproblem::default().solve(criteria, hessian, [low, high], penalty, &mut direction).map(|()| direction)
    }

    fn linear(value: f64, gradient: &[f64]) -> LinearModel {
        LinearModel { value, gradient: gradient.to_vec() }
    }

    #[test]
    fn two_crossing_lines_meet_in_the_middle() {
        // Without curvature, max(1 + d, 4 - 2 d) has its minimum 2 at d = 1.
        let criteria = LinearisedCriteria {
            objectives: vec![linear(1.0, &[1.0]), linear(4.0, &[-2.0])],
            inequalities: vec![],
            equalities: vec![],
        };
        let d = solve(&criteria, &(DMatrix::identity(1, 1) * 1e-6), &[-5.0], &[5.0], 1.0).unwrap();
        assert!((d.step[0] - 1.0).abs() < 1e-8 && (d.level - 2.0).abs() < 1e-8, "{d:?}");
        assert!((d.multipliers.objectives[0] - 2.0 / 3.0).abs() < 1e-6, "{d:?}");
    }

    #[test]
    fn inconsistent_constraints_have_the_least_possible_violation() {
        // d <= -1 and d >= 1 are inconsistent: the best step is d = 0, with violation 1.
        let criteria = LinearisedCriteria {
            objectives: vec![linear(0.0, &[0.1])],
            inequalities: vec![linear(1.0, &[1.0]), linear(1.0, &[-1.0])],
            equalities: vec![],
        };
        let d = solve(&criteria, &(DMatrix::identity(1, 1) * 1e-6), &[-5.0], &[5.0], 100.0).unwrap();
        assert!(d.step[0].abs() < 1e-7 && (d.violation - 1.0).abs() < 1e-7, "{d:?}");
    }

    #[test]
    fn a_consistent_equality_is_satisfied() {
        let criteria = LinearisedCriteria {
            objectives: vec![linear(0.0, &[1.0, 1.0])],
            inequalities: vec![],
            equalities: vec![linear(-1.0, &[1.0, -1.0])],
        };
        let d = solve(&criteria, &DMatrix::identity(2, 2), &[-5.0; 2], &[5.0; 2], 10.0).unwrap();
        assert!((d.step[0] - d.step[1] - 1.0).abs() < 1e-8, "{d:?}");
    }
}
