//! Is a point Pareto-optimal, to first order?

use mops_core::{Linearisation, Objective, Oracle, Pareto, Shape, Usage};
use nalgebra::DMatrix;

use crate::active_set::dot;
use crate::epigraph::{Direction, Subproblem};
use crate::rows::{Linear, Rows};

/// Improvement per unit of step, relative to the steepest slope of its row, below which a direction is none: the accuracy
/// of slopes by differences.
const IMPROVEMENT: f64 = 1e-3;

/// Relative slope below which differences see nothing but noise.
const SMALLEST_SLOPE: f64 = 1e-5;

/// How far a direction is followed, in the unit box.
const AHEAD: f64 = 1e-3;

/// Number of times that pieces beyond a kink are added.
const MOST_PIECES: usize = 12;

/// So many of them, and slopes are taken all around the point.
const FEW_PIECES: usize = 2;

/// How far around the point that is, in the unit box.
const AROUND: f64 = 0.5 * AHEAD;

/// A piece from around the point that stands higher above it, per unit of [`AHEAD`], lies beyond a jump and says nothing of it.
const JUMP: f64 = 0.5;

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
    let pareto = shown(oracle, point, &mut weights);
    Certificate { pareto, weights: weights.filter(|_| pareto == Pareto::CertifiedLocal) }
}

fn shown(oracle: &mut dyn Oracle, point: &[f64], weights: &mut Option<Vec<f64>>) -> Pareto {
    let Ok(Some(at)) = oracle.linearise(point, 0.1 * AHEAD) else { return Pareto::NotShown };
    let shape = oracle.shape().clone();
    if point.is_empty() || !shape.rows.iter().any(|(usage, _)| *usage == Usage::Minimise) {
        return Pareto::NotShown;
    }
    let here = at.at.scaled.clone().expect("a point that was linearised has values");
    let Some(mut cone) = Cone::new(&shape, &at) else { return Pareto::NotShown };
    for added in 1..=MOST_PIECES {
        let Some((step, promised, worth)) = cone.direction(point) else { return Pareto::NotShown };
        if promised <= IMPROVEMENT {
            *weights = Some(worth);
            return Pareto::CertifiedLocal;
        }
        // The pieces known see an improvement: does the problem?
        let ahead: Vec<f64> = point.iter().zip(&step).map(|(u, d)| (u + d).clamp(0.0, 1.0)).collect();
        let Ok(mut answers) = oracle.evaluate(std::slice::from_ref(&ahead)) else { return Pareto::NotShown };
        let Some(there) = answers.pop().and_then(|answer| answer.scaled) else { return Pareto::NotShown };
        if improves(&shape, &here, &there) {
            return Pareto::No;
        }
        let Ok(Some(beyond)) = oracle.linearise(&ahead, 0.1 * AHEAD) else { return Pareto::NotShown };
        cone.add(&shape, point, &beyond, f64::INFINITY);
        if added == FEW_PIECES {
            for beside in around(point) {
                // Where nothing can be simulated nothing is known.
                match oracle.linearise(&beside, 0.1 * AHEAD) {
                    Ok(Some(beside)) => cone.add(&shape, point, &beside, JUMP * AHEAD),
                    Ok(None) => {}
                    Err(_) => return Pareto::NotShown,
                }
            }
        }
    }
    Pareto::NotShown
}

/// The points a little to either side along every coordinate, as far as they lie in the box.
fn around(point: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let beside = move |j: usize, step: f64| {
        let u = point[j] + step;
        (0.0..=1.0).contains(&u).then(|| point.iter().enumerate().map(|(k, v)| if k == j { u } else { *v }).collect())
    };
    (0..point.len()).flat_map(move |j| [AROUND, -AROUND].into_iter().filter_map(move |step| beside(j, step)))
}

/// Whether no row is worse, one is better, and all constraints hold.
fn improves(shape: &Shape, here: &[f64], there: &[f64]) -> bool {
    let (before, after) = (shape.objectives(here), shape.objectives(there));
    let none_worse = before.iter().zip(&after).all(|(b, a)| a <= b);
    let feasible = shape.inequalities(there).iter().all(|c| *c <= mops_core::FEASIBLE)
        && shape.equalities(there).iter().all(|c| c.abs() <= mops_core::FEASIBLE);
    none_worse && feasible && before != after
}

/// Directions along which no piece of any row rises.
struct Cone {
    /// Rows to be minimised, each measured from its value here in units of its steepest slope.
    objectives: Vec<Linear>,
    /// Their pieces beyond kinks: the row, and the piece.
    pieces: Vec<(usize, Linear)>,
    /// Constraints that are active, or nearly.
    inequalities: Vec<Linear>,
    equalities: Vec<Linear>,
    /// Value here and steepest slope of the rows to be minimised.
    scales: Vec<(f64, f64)>,
}

impl Cone {
    /// `None` where a row has no slope.
    fn new(shape: &Shape, at: &Linearisation) -> Option<Self> {
        // Every row on its own, also where the objective is their sum.
        let rows = Rows::of(&Shape { objective: Objective::Max, ..shape.clone() }, at);
        let steepest = |row: &Linear| row.slope.iter().fold(0.0_f64, |a, s| a.max(s.abs()));
        let scales: Vec<(f64, f64)> = rows.objectives.iter().map(|row| (row.value, steepest(row))).collect();
        if scales.iter().any(|(value, slope)| *slope < SMALLEST_SLOPE * value.abs().max(f64::MIN_POSITIVE)) {
            return None;
        }
        let still = |row: &Linear| Linear { value: 0.0, slope: row.slope.clone() };
        Some(Self {
            objectives: rows.objectives.iter().zip(&scales).map(|(row, scale)| scaled(row, *scale)).collect(),
            pieces: Vec::new(),
            inequalities: rows.inequalities.iter().filter(|row| row.value > -1e-4).map(still).collect(),
            equalities: rows.equalities.iter().map(still).collect(),
            scales,
        })
    }

    /// The rows as they extend to here from a point beyond a kink; what lies above the row here is brought down to it, if it is
    /// not higher than `highest`.
    fn add(&mut self, shape: &Shape, here: &[f64], beyond: &Linearisation, highest: f64) {
        let rows = Rows::of(&Shape { objective: Objective::Max, ..shape.clone() }, beyond);
        let back: Vec<f64> = here.iter().zip(&beyond.at.point).map(|(a, b)| a - b).collect();
        let extended = |row: Linear| {
            let value = row.value + dot(&row.slope, &back);
            (value <= highest).then(|| Linear { value: value.min(0.0), slope: row.slope })
        };
        for (k, (row, scale)) in rows.objectives.iter().zip(&self.scales).enumerate() {
            self.pieces.extend(extended(scaled(row, *scale)).map(|piece| (k, piece)));
        }
        let inequalities = rows.inequalities.into_iter().filter_map(extended);
        self.inequalities.extend(inequalities.filter(|row| row.value > -1e-4));
    }

    /// The step of at most [`AHEAD`] that lowers the rows most, none of them rising; with what it promises: the sum of what the
    /// rows fall by, per unit of step, and with what a unit of each row is worth.
    fn direction(&self, point: &[f64]) -> Option<(Vec<f64>, f64, Vec<f64>)> {
        // All lengths in units of the step, so that values and slopes are of one size.
        let n = point.len();
        let near = |row: &Linear| Linear { value: row.value / AHEAD, slope: row.slope.clone() };
        let mut inequalities: Vec<Linear> = self.objectives.iter().map(near).collect();
        inequalities.extend(self.pieces.iter().map(|(_, piece)| near(piece)));
        inequalities.extend(self.inequalities.iter().map(near));
        let sum = |slope: Vec<f64>, row: &Linear| slope.iter().zip(&row.slope).map(|(a, b)| a + b).collect();
        let total = Linear { value: 0.0, slope: self.objectives.iter().fold(vec![0.0; n], sum) };
        let cone = Rows { objectives: vec![total], inequalities, equalities: self.equalities.clone() };
        let low: Vec<f64> = point.iter().map(|&u| if u < 1e-6 { 0.0 } else { -1.0 }).collect();
        let high: Vec<f64> = point.iter().map(|&u| if u > 1.0 - 1e-6 { 0.0 } else { 1.0 }).collect();
        // A penalty above every multiplier keeps the direction inside the cone.
        let mut direction = Direction::default();
        let hessian = DMatrix::identity(n, n) * 1e-6;
        Subproblem::default().solve(&cone, &hessian, [&low, &high], 1e4, &mut direction)?;
        let promised = (0..self.objectives.len()).map(|k| self.fall(k, &direction.step)).sum();
        // The sum of the rows, and what keeps each of them from rising.
        let held = &direction.multipliers.inequalities;
        let m = self.objectives.len();
        let mut weights: Vec<f64> = held[..m].iter().map(|multiplier| 1.0 + multiplier).collect();
        for ((k, _), multiplier) in self.pieces.iter().zip(&held[m..]) {
            weights[*k] += multiplier;
        }
        weights.iter_mut().zip(&self.scales).for_each(|(weight, (_, slope))| *weight /= slope);
        Some((direction.step.iter().map(|d| AHEAD * d).collect(), promised, weights))
    }

    /// What a row falls by along a step, as all of its pieces see it.
    fn fall(&self, row: usize, step: &[f64]) -> f64 {
        let own = -dot(&self.objectives[row].slope, step);
        let pieces = self.pieces.iter().filter(|(k, _)| *k == row);
        pieces.map(|(_, piece)| -(piece.value / AHEAD + dot(&piece.slope, step))).fold(own, f64::min)
    }
}

/// A row measured from `value`, in units of `slope`.
fn scaled(row: &Linear, (value, slope): (f64, f64)) -> Linear {
    Linear { value: (row.value - value) / slope, slope: row.slope.iter().map(|s| s / slope).collect() }
}
