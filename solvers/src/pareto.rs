//! Is a point Pareto-optimal, to first order?

use mops_core::{Linearisation, Objective, Oracle, Pareto, Shape, Usage};
use nalgebra::DMatrix;

use crate::active_set::dot;
use crate::epigraph::{Direction, Subproblem};
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Improvement per unit of step, relative to the steepest slope of its row, below which a direction is none: the accuracy
/// of slopes by differences.
const IMPROVEMENT: f64 = 1e-3;

/// Relative slope below which differences see nothing but noise.
const SMALLEST_GRADIENT: f64 = 1e-5;

/// How far a direction is followed, in the unit box.
const TRIAL_STEP: f64 = 1e-3;

/// Number of times that pieces beyond a kink are added.
const MAX_CUTS: usize = 12;

/// So many of them, and slopes are taken all around the point.
const CUTS_BEFORE_SAMPLING: usize = 2;

/// How far around the point that is, in the unit box.
const SAMPLING_RADIUS: f64 = 0.5 * TRIAL_STEP;

/// A piece from around the point that stands higher above it, per unit of [`AHEAD`], lies beyond a jump and says nothing of it.
const MAX_CUT_VALUE: f64 = 0.5;

/// Looks for a direction that lowers one row to be minimised and raises none, within the bounds and the active
/// constraints. None: `certified-local`. One, that also holds a small step ahead: `no`. No slopes, or a direction that
/// only the linear model sees: `not-shown`.
///
/// A criterion may have kinks of its own (an overshoot is the largest of several peaks), and an optimum lies on them as a rule:
/// where the problem does not keep what the slopes promise, they are taken a step ahead too, and both pieces count from then
/// on (C. Lemarechal's cutting planes; K. C. Kiwiel, Methods of Descent for Nondifferentiable Optimization (1985)). A step along
/// a kink stays on it, where differences see the mean of both sides: after a few steps slopes are taken a little to either side
/// along every coordinate as well, and `certified-local` then says that no direction improves for the slopes of all of these
/// points (A. A. Goldstein, Mathematical Programming 13 (1977) 14-22; J. V. Burke, A. S. Lewis, M. L. Overton, SIAM Journal on
/// Optimization 15 (2005) 751-779).
pub fn certify(oracle: &mut dyn Oracle, point: &[f64]) -> Pareto {
    certificate(oracle, point).pareto
}

/// What was shown of a point.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// Whether one criterion can be improved at no cost.
    pub pareto: Pareto,
    /// What a unit of each weighted scaled value to be minimised is worth, of a certified point: along the front, to first
    /// order, the changes times these sum to 0. From the multipliers of the rows, all of them positive.
    pub weights: Option<Vec<f64>>,
}

/// As [`certify`], with what the criteria are worth.
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
    let values = at.at.scaled.clone().expect("a point that was linearised has values");
    let Some(mut cone) = DescentCone::new(&shape, &at) else { return Pareto::NotShown };
    for added in 1..=MAX_CUTS {
        let Some((step, predicted, trade_offs)) = cone.direction(point) else { return Pareto::NotShown };
        if predicted <= IMPROVEMENT {
            *weights = Some(trade_offs);
            return Pareto::CertifiedLocal;
        }
        // The pieces known see an improvement: does the problem?
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
                // Where nothing can be simulated nothing is known.
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

/// The points a little to either side along every coordinate, as far as they lie in the box.
fn sampling_points(point: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let beside = move |j: usize, step: f64| {
        let u = point[j] + step;
        (0.0..=1.0).contains(&u).then(|| point.iter().enumerate().map(|(k, v)| if k == j { u } else { *v }).collect())
    };
    (0..point.len())
        .flat_map(move |j| [SAMPLING_RADIUS, -SAMPLING_RADIUS].into_iter().filter_map(move |step| beside(j, step)))
}

/// Whether no row is worse, one is better, and all constraints hold.
fn is_improvement(shape: &Shape, values: &[f64], trial_values: &[f64]) -> bool {
    let (before, after) = (shape.objectives(values), shape.objectives(trial_values));
    let none_worse = before.iter().zip(&after).all(|(b, a)| a <= b);
    let feasible = shape.inequalities(trial_values).iter().all(|c| *c <= mops_core::FEASIBLE)
        && shape.equalities(trial_values).iter().all(|c| c.abs() <= mops_core::FEASIBLE);
    none_worse && feasible && before != after
}

/// Directions along which no piece of any row rises.
struct DescentCone {
    /// Rows to be minimised, each measured from its value here in units of its steepest slope.
    objectives: Vec<LinearModel>,
    /// Their pieces beyond kinks: the row, and the piece.
    cuts: Vec<(usize, LinearModel)>,
    /// Constraints that are active, or nearly.
    inequalities: Vec<LinearModel>,
    equalities: Vec<LinearModel>,
    /// Value here and steepest slope of the rows to be minimised.
    scales: Vec<(f64, f64)>,
}

impl DescentCone {
    /// `None` where a row has no slope.
    fn new(shape: &Shape, at: &Linearisation) -> Option<Self> {
        // Every row on its own, also where the objective is their sum.
        let criteria =
            LinearisedCriteria::from_linearisation(&Shape { objective: Objective::Max, ..shape.clone() }, at);
        let steepest = |row: &LinearModel| row.gradient.iter().fold(0.0_f64, |a, s| a.max(s.abs()));
        let scales: Vec<(f64, f64)> = criteria.objectives.iter().map(|row| (row.value, steepest(row))).collect();
        if scales.iter().any(|(value, steepest)| *steepest < SMALLEST_GRADIENT * value.abs().max(f64::MIN_POSITIVE)) {
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

    /// The rows as they extend to here from a point beyond a kink; what lies above the row here is brought down to it, if it is
    /// not higher than `highest`.
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

    /// The step of at most [`AHEAD`] that lowers the rows most, none of them rising; with what it promises: the sum of what the
    /// rows fall by, per unit of step, and with what a unit of each row is worth.
    fn direction(&self, point: &[f64]) -> Option<(Vec<f64>, f64, Vec<f64>)> {
        // All lengths in units of the step, so that values and slopes are of one size.
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
        // The sum of the rows, and what keeps each of them from rising.
        let constraint_multipliers = &direction.multipliers.inequalities;
        let m = self.objectives.len();
        let mut weights: Vec<f64> = constraint_multipliers[..m].iter().map(|multiplier| 1.0 + multiplier).collect();
        for ((k, _), multiplier) in self.cuts.iter().zip(&constraint_multipliers[m..]) {
            weights[*k] += multiplier;
        }
        weights.iter_mut().zip(&self.scales).for_each(|(weight, (_, steepest))| *weight /= steepest);
        Some((direction.step.iter().map(|d| TRIAL_STEP * d).collect(), predicted, weights))
    }

    /// What a row falls by along a step, as all of its pieces see it.
    fn decrease(&self, row: usize, step: &[f64]) -> f64 {
        let linear_decrease = -dot(&self.objectives[row].gradient, step);
        let cuts = self.cuts.iter().filter(|(k, _)| *k == row);
        cuts.map(|(_, cut)| -(cut.value / TRIAL_STEP + dot(&cut.gradient, step))).fold(linear_decrease, f64::min)
    }
}

/// A row measured from `value`, in units of `slope`.
fn normalised(row: &LinearModel, (value, steepest): (f64, f64)) -> LinearModel {
    LinearModel { value: (row.value - value) / steepest, gradient: row.gradient.iter().map(|s| s / steepest).collect() }
}
