//! First-order certificate of Pareto optimality.

use mops_core::{Linearisation, Objective, Oracle, Pareto, Shape, Usage};
use nalgebra::DMatrix;

use crate::active_set::dot;
use crate::epigraph::{Direction, Subproblem};
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Improvement per unit of step, relative to the largest derivative of the criterion, below which a direction does not
/// count as a descent direction. Corresponds to the accuracy of finite-difference gradients.
const IMPROVEMENT: f64 = 1e-3;

/// Relative derivative below which finite differences show only noise.
const MIN_GRADIENT: f64 = 1e-5;

/// Length of a trial step, in the unit box.
const TRIAL_STEP: f64 = 1e-3;

/// Maximum number of cuts added from trial points.
const MAX_CUTS: usize = 12;

/// Number of cuts after which gradients are sampled around the point.
const CUTS_BEFORE_SAMPLING: usize = 2;

/// Distance of the sampled gradients from the point, in the unit box.
const SAMPLING_RADIUS: f64 = 0.5 * TRIAL_STEP;

/// Normalised height above the point, per unit of [`TRIAL_STEP`], above which a sampled cut lies beyond a
/// discontinuity. Such a cut is ignored.
const MAX_CUT_VALUE: f64 = 0.5;

/// Searches for a direction that lowers one criterion and raises none, within the bounds and the active constraints.
///
/// Returns `certified-local` if there is none, and `no` if a small step in that direction is an actual improvement.
/// Returns `not-shown` without gradients, or if only the linear model improves.
///
/// A criterion may have kinks of its own (an overshoot is the largest of several peaks), and optima often lie on them.
/// If a trial step does not achieve the predicted decrease, gradients are also evaluated at its end; both linear models
/// (cuts) then count. Source: C. Lemarechal's cutting planes; K. C. Kiwiel, Methods of Descent for Nondifferentiable
/// Optimization (1985).
///
/// A step along a kink stays on the kink, where finite differences average both sides. After a few steps, gradients are
/// therefore sampled on either side along every coordinate. `certified-local` then means that no direction improves for
/// all sampled gradients. Source: A. A. Goldstein, Mathematical Programming 13 (1977) 14-22; J. V. Burke, A. S. Lewis,
/// M. L. Overton, SIAM Journal on Optimization 15 (2005) 751-779.
pub fn certify(oracle: &mut dyn Oracle, point: &[f64]) -> Pareto {
    certificate(oracle, point).pareto
}

/// Result of the optimality test of a point.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// Pareto optimality: whether one criterion can be improved without loss in another.
    pub pareto: Pareto,
    /// Trade-off weights of the weighted scaled values to be minimised, at a certified point. Along the front, the
    /// changes of these values multiplied by the weights sum to 0, to first order. The weights follow from the
    /// multipliers and are positive.
    pub weights: Option<Vec<f64>>,
}

/// Certifies a point as [`certify`] does, with the trade-off weights of the criteria.
pub fn certificate(oracle: &mut dyn Oracle, point: &[f64]) -> Certificate {
    let mut weights = None;
    let pareto = check(oracle, point, &mut weights);
    Certificate { pareto, weights: weights.filter(|_| pareto == Pareto::CertifiedLocal) }
}

fn check(oracle: &mut dyn Oracle, point: &[f64], weights: &mut Option<Vec<f64>>) -> Pareto {
    let Ok(Some(at)) = oracle.linearise(point, 0.1 * TRIAL_STEP) else { return Pareto::NotShown };
    let shape = oracle.shape().clone();
    if point.is_empty() || !shape.rows.iter().any(|(usage, _)| *usage == Usage::Minimise) {
        return Pareto::NotShown;
    }
    let values = at.at.scaled.clone().expect("a linearised point has values");
    let Some(mut cone) = DescentCone::new(&shape, &at) else { return Pareto::NotShown };
    for added in 1..=MAX_CUTS {
        let Some((step, predicted, trade_offs)) = cone.direction(point) else { return Pareto::NotShown };
        if predicted <= IMPROVEMENT {
            *weights = Some(trade_offs);
            return Pareto::CertifiedLocal;
        }
        // The known cuts predict an improvement: compare with an evaluation.
        let trial: Vec<f64> = point.iter().zip(&step).map(|(u, d)| (u + d).clamp(0.0, 1.0)).collect();
        let Ok(mut answers) = oracle.evaluate(std::slice::from_ref(&trial)) else { return Pareto::NotShown };
        let Some(trial_values) = answers.pop().and_then(|answer| answer.scaled) else { return Pareto::NotShown };
        if is_improvement(&shape, &values, &trial_values) {
            return Pareto::No;
        }
        let Ok(Some(beyond)) = oracle.linearise(&trial, 0.1 * TRIAL_STEP) else { return Pareto::NotShown };
        cone.add(&shape, point, &beyond, f64::INFINITY);
        if added == CUTS_BEFORE_SAMPLING {
            for beside in sampling_points(point) {
                // A failed simulation gives no information.
                match oracle.linearise(&beside, 0.1 * TRIAL_STEP) {
                    Ok(Some(beside)) => cone.add(&shape, point, &beside, MAX_CUT_VALUE * TRIAL_STEP),
                    Ok(None) => {}
                    Err(_) => return Pareto::NotShown,
                }
            }
        }
    }
    Pareto::NotShown
}

/// Returns the neighbours of a point on either side along every coordinate, if inside the box.
fn sampling_points(point: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let beside = move |j: usize, step: f64| {
        let u = point[j] + step;
        (0.0..=1.0).contains(&u).then(|| point.iter().enumerate().map(|(k, v)| if k == j { u } else { *v }).collect())
    };
    (0..point.len())
        .flat_map(move |j| [SAMPLING_RADIUS, -SAMPLING_RADIUS].into_iter().filter_map(move |step| beside(j, step)))
}

/// Returns true if no criterion is worse, at least one is better, and all constraints are satisfied.
fn is_improvement(shape: &Shape, values: &[f64], trial_values: &[f64]) -> bool {
    let (before, after) = (shape.objectives(values), shape.objectives(trial_values));
    let none_worse = before.iter().zip(&after).all(|(b, a)| a <= b);
    let feasible = shape.inequalities(trial_values).iter().all(|c| *c <= mops_core::FEASIBLE)
        && shape.equalities(trial_values).iter().all(|c| c.abs() <= mops_core::FEASIBLE);
    none_worse && feasible && before != after
}

/// Cone of directions along which no cut of any criterion increases.
struct DescentCone {
    /// Criteria to be minimised, relative to their value at the point, in units of their largest derivative.
    objectives: Vec<LinearModel>,
    /// Cuts beyond kinks, each with the index of its criterion.
    cuts: Vec<(usize, LinearModel)>,
    /// Active or nearly active constraints.
    inequalities: Vec<LinearModel>,
    equalities: Vec<LinearModel>,
    /// Value at the point and largest derivative of every criterion to be minimised.
    scales: Vec<(f64, f64)>,
}

impl DescentCone {
    /// Creates the cone; `None` if the gradient of a criterion vanishes.
    fn new(shape: &Shape, at: &Linearisation) -> Option<Self> {
        // Every criterion counts on its own, even if the objective is the sum.
        let criteria =
            LinearisedCriteria::from_linearisation(&Shape { objective: Objective::Max, ..shape.clone() }, at);
        let steepest = |row: &LinearModel| row.gradient.iter().fold(0.0_f64, |a, s| a.max(s.abs()));
        let scales: Vec<(f64, f64)> = criteria.objectives.iter().map(|row| (row.value, steepest(row))).collect();
        if scales.iter().any(|(value, steepest)| *steepest < MIN_GRADIENT * value.abs().max(f64::MIN_POSITIVE)) {
            return None;
        }
        let at_zero = |row: &LinearModel| LinearModel { value: 0.0, gradient: row.gradient.clone() };
        Some(Self {
            objectives: criteria.objectives.iter().zip(&scales).map(|(row, scale)| normalised(row, *scale)).collect(),
            cuts: Vec::new(),
            inequalities: criteria.inequalities.iter().filter(|row| row.value > -1e-4).map(at_zero).collect(),
            equalities: criteria.equalities.iter().map(at_zero).collect(),
            scales,
        })
    }

    /// Adds the linear models at another point, extrapolated to `point`. Models above the value at `point` are lowered
    /// to it; those above `max_value` are ignored.
    fn add(&mut self, shape: &Shape, point: &[f64], beyond: &Linearisation, max_value: f64) {
        let criteria =
            LinearisedCriteria::from_linearisation(&Shape { objective: Objective::Max, ..shape.clone() }, beyond);
        let offset: Vec<f64> = point.iter().zip(&beyond.at.point).map(|(a, b)| a - b).collect();
        let extended = |row: LinearModel| {
            let value = row.value + dot(&row.gradient, &offset);
            (value <= max_value).then(|| LinearModel { value: value.min(0.0), gradient: row.gradient })
        };
        for (k, (row, scale)) in criteria.objectives.iter().zip(&self.scales).enumerate() {
            self.cuts.extend(extended(normalised(row, *scale)).map(|cut| (k, cut)));
        }
        let inequalities = criteria.inequalities.into_iter().filter_map(extended);
        self.inequalities.extend(inequalities.filter(|row| row.value > -1e-4));
    }

    /// Computes the step of at most [`TRIAL_STEP`] with the steepest descent in the cone.
    ///
    /// Returns the step, the sum of the predicted decreases per unit of step, and the trade-off weights of the
    /// criteria.
    fn direction(&self, point: &[f64]) -> Option<(Vec<f64>, f64, Vec<f64>)> {
        // Lengths in units of the step: values and gradients are then of the same order.
        let n = point.len();
        let in_step_units =
            |row: &LinearModel| LinearModel { value: row.value / TRIAL_STEP, gradient: row.gradient.clone() };
        let mut inequalities: Vec<LinearModel> = self.objectives.iter().map(in_step_units).collect();
        inequalities.extend(self.cuts.iter().map(|(_, cut)| in_step_units(cut)));
        inequalities.extend(self.inequalities.iter().map(in_step_units));
        let sum =
            |gradient: Vec<f64>, row: &LinearModel| gradient.iter().zip(&row.gradient).map(|(a, b)| a + b).collect();
        let total = LinearModel { value: 0.0, gradient: self.objectives.iter().fold(vec![0.0; n], sum) };
        let cone = LinearisedCriteria { objectives: vec![total], inequalities, equalities: self.equalities.clone() };
        let low: Vec<f64> = point.iter().map(|&u| if u < 1e-6 { 0.0 } else { -1.0 }).collect();
        let high: Vec<f64> = point.iter().map(|&u| if u > 1.0 - 1e-6 { 0.0 } else { 1.0 }).collect();
        // A penalty above every multiplier keeps the direction inside the cone.
        let mut direction = Direction::default();
        let hessian = DMatrix::identity(n, n) * 1e-6;
        Subproblem::default().solve(&cone, &hessian, [&low, &high], 1e4, &mut direction)?;
        let predicted = (0..self.objectives.len()).map(|k| self.decrease(k, &direction.step)).sum();
        // The weights are those of the sum plus the multipliers that keep each criterion from increasing.
        let constraint_multipliers = &direction.multipliers.inequalities;
        let m = self.objectives.len();
        let mut weights: Vec<f64> = constraint_multipliers[..m].iter().map(|multiplier| 1.0 + multiplier).collect();
        for ((k, _), multiplier) in self.cuts.iter().zip(&constraint_multipliers[m..]) {
            weights[*k] += multiplier;
        }
        weights.iter_mut().zip(&self.scales).for_each(|(weight, (_, steepest))| *weight /= steepest);
        Some((direction.step.iter().map(|d| TRIAL_STEP * d).collect(), predicted, weights))
    }

    /// Returns the decrease of a criterion along a step, according to all of its cuts.
    fn decrease(&self, row: usize, step: &[f64]) -> f64 {
        let linear_decrease = -dot(&self.objectives[row].gradient, step);
        let cuts = self.cuts.iter().filter(|(k, _)| *k == row);
        cuts.map(|(_, cut)| -(cut.value / TRIAL_STEP + dot(&cut.gradient, step))).fold(linear_decrease, f64::min)
    }
}

/// Returns the linear model relative to `value`, in units of the largest derivative `steepest`.
fn normalised(row: &LinearModel, (value, steepest): (f64, f64)) -> LinearModel {
    LinearModel { value: (row.value - value) / steepest, gradient: row.gradient.iter().map(|s| s / steepest).collect() }
}
