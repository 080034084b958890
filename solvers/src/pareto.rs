//! Is a point Pareto-optimal, to first order?

use mops_core::{Objective, Oracle, Pareto, Shape, Usage};
use nalgebra::DMatrix;

use crate::active_set::dot;
use crate::epigraph::{Linear, Rows, solve};

/// Looks for a direction that lowers one row to be minimised and raises none, within the bounds and the active
/// constraints. None: `certified-local`. One, that also holds a small step ahead: `no`. No slopes, or a direction that
/// only the linear model sees: `not-shown`.
pub fn certify(oracle: &mut dyn Oracle, point: &[f64]) -> Pareto {
    /// Improvement per unit of step, relative to the steepest slope of its row, below which a direction is none: the
    /// accuracy of slopes by differences.
    const IMPROVEMENT: f64 = 1e-3;
    /// Relative slope below which differences see nothing but noise.
    const SMALLEST_SLOPE: f64 = 1e-5;
    let Ok(Some(at)) = oracle.linearise(point, 1e-4) else { return Pareto::NotShown };
    let shape = oracle.shape().clone();
    let n = shape.dimension();
    // Every row on its own, also where the objective is their sum.
    let mut rows = Rows::of(&Shape { objective: Objective::Max, ..shape.clone() }, &at);
    if n == 0 || !shape.rows.iter().any(|(usage, _)| *usage == Usage::Minimise) {
        return Pareto::NotShown;
    }
    // Each row by its own steepest slope, so that loose demands hide nothing.
    for row in &mut rows.objectives {
        let steepest = row.slope.iter().fold(0.0_f64, |a, s| a.max(s.abs()));
        if steepest < SMALLEST_SLOPE * row.value.abs().max(f64::MIN_POSITIVE) {
            return Pareto::NotShown;
        }
        row.slope.iter_mut().for_each(|s| *s /= steepest);
    }
    // min sum_i g_i d subject to g_i d <= 0, a_j d <= 0 where active, |b_k d| <= 0, |d| <= 1 inside the box:
    // as the subproblem with the sum as its one objective and all rows as elastic constraints.
    let sum = |slope: Vec<f64>, row: &Linear| slope.iter().zip(&row.slope).map(|(a, b)| a + b).collect();
    let total = Linear { value: 0.0, slope: rows.objectives.iter().fold(vec![0.0; n], sum) };
    let homogeneous = |row: &Linear| Linear { value: 0.0, slope: row.slope.clone() };
    let mut inequalities: Vec<Linear> = rows.objectives.iter().map(homogeneous).collect();
    inequalities.extend(rows.inequalities.iter().filter(|row| row.value > -1e-4).map(homogeneous));
    let equalities = rows.equalities.iter().map(homogeneous).collect();
    let cone = Rows { objectives: vec![total], inequalities, equalities };
    let low: Vec<f64> = point.iter().map(|&u| if u < 1e-6 { 0.0 } else { -1.0 }).collect();
    let high: Vec<f64> = point.iter().map(|&u| if u > 1.0 - 1e-6 { 0.0 } else { 1.0 }).collect();
    // A penalty above every multiplier keeps the direction inside the cone.
    let Some(direction) = solve(&cone, &(DMatrix::identity(n, n) * 1e-6), &low, &high, 1e4) else {
        return Pareto::NotShown;
    };
    if dot(&cone.objectives[0].slope, &direction.step) > -IMPROVEMENT {
        return Pareto::CertifiedLocal;
    }
    // The linear model sees an improvement: does the problem?
    let ahead: Vec<f64> = point.iter().zip(&direction.step).map(|(u, d)| (u + 1e-3 * d).clamp(0.0, 1.0)).collect();
    let Ok(mut answers) = oracle.evaluate(&[ahead]) else { return Pareto::NotShown };
    let (Some(here), Some(there)) = (&at.at.scaled, answers.pop().and_then(|a| a.scaled)) else {
        return Pareto::NotShown;
    };
    let (before, after) = (shape.objectives(here), shape.objectives(&there));
    let none_worse = before.iter().zip(&after).all(|(b, a)| a <= b);
    let feasible = shape.inequalities(&there).iter().all(|c| *c <= mops_core::FEASIBLE)
        && shape.equalities(&there).iter().all(|c| c.abs() <= mops_core::FEASIBLE);
    if none_worse && feasible && before != after { Pareto::No } else { Pareto::NotShown }
}
