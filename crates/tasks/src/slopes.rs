//! Derivatives of the criteria of a design with respect to its tuners, at the reported point.

use schemars::JsonSchema;
use serde::Serialize;

use mops_core::{
    criterion::Usage,
    evaluation::Evaluation,
    problem::Problem,
    solver::{Linearisation, Oracle},
};

/// The block `slopes` of a result.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SlopesReport {
    /// Names of the tuners that the solver could change.
    pub tuners: Vec<String>,
    /// Criteria that count, one entry per case.
    pub criteria: Vec<CriterionSlopes>,
}

/// Derivatives of a criterion in a case.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CriterionSlopes {
    /// Key, `case/criterion`.
    pub key: String,
    /// Derivative of the scaled value with respect to the position of each tuner within its bounds. The position is 0
    /// at the lower and 1 at the upper bound, logarithmic for logarithmic tuners. A hundredth of the derivative is the
    /// first-order change for a step of 1 % of the range.
    pub slopes: Vec<f64>,
    /// Derivatives to the left and to the right for each tuner, where they differ: at a kink, or at a jump, where they
    /// grow without limit. Null where they agree; absent for a criterion without such a tuner.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sides: Option<Vec<Option<[f64; 2]>>>,
}

/// Distance of the points that separate the derivatives of both sides, in the unit box: differences of values that
/// repeat to 1e-9 are accurate to 1e-5.
const BESIDE: f64 = 2e-4;

/// Difference of the derivatives of both sides, relative to the larger one, from which they are reported apart.
const APART: f64 = 0.1;

/// Ratio of the two steps that distinguish a kink from a strong curvature.
const CLOSER: f64 = 4.0;

/// Part of the difference of the sides that remains at the shorter step where a smooth criterion is curved, ideally a
/// quarter. At a kink or a jump more remains, and less at a kink beside the point.
const CURVED: [f64; 2] = [0.15, 0.4];

/// Ratio of the differences at both steps from which the criterion jumps, where it is ideally [`CLOSER`].
const STEEPER: f64 = 2.0;

/// Change over the whole range of a tuner, in scaled values, whose sides are not reported apart.
const SMALL: f64 = 1e-3;

impl SlopesReport {
    /// Returns the derivatives of a linearisation.
    pub fn of(problem: &Problem, found: &Linearisation) -> Self {
        let study = problem.study();
        let counts = |(i, _): &(usize, _)| problem.shape().rows[*i].0 != Usage::Monitor;
        let rows = study.rows().iter().enumerate().filter(counts);
        Self {
            tuners: problem.active().iter().map(|&i| study.tuners()[i].name.clone()).collect(),
            criteria: rows
                .map(|(i, row)| CriterionSlopes { key: study.key(row), slopes: found.rows[i].clone(), sides: None })
                .collect(),
        }
    }

    /// Adds the derivatives of both sides where they differ, by differences with two steps: the difference of the sides
    /// of a smooth criterion shrinks with the step, that at a kink remains, and that at a jump grows. Takes two points
    /// for every tuner, and two more for every tuner with different sides. Without enough budget, nothing is added.
    pub fn add_sides(&mut self, problem: &Problem, oracle: &mut dyn Oracle, at: &Evaluation) {
        let tuners: Vec<usize> = (0..at.point.len()).collect();
        let Some(wide) = pairs(oracle, at, &tuners, BESIDE) else { return };
        let counts = || (0..problem.study().rows().len()).filter(|i| problem.shape().rows[*i].0 != Usage::Monitor);
        let differs = |pair: &Pair, row: usize| {
            pair.sides(at, row, BESIDE).filter(|both| distance(both) > APART * both[0].abs().max(both[1].abs()) + SMALL)
        };
        let bent: Vec<usize> = wide
            .iter()
            .filter(|pair| counts().any(|row| differs(pair, row).is_some()))
            .map(|pair| pair.tuner)
            .collect();
        let Some(close) = pairs(oracle, at, &bent, BESIDE / CLOSER) else { return };
        for (row, criterion) in counts().zip(&mut self.criteria) {
            let mut sides = vec![None; at.point.len()];
            for near in &close {
                let Some(far) = wide.iter().find(|far| far.tuner == near.tuner) else { continue };
                let (Some(outer), Some(inner)) = (differs(far, row), near.sides(at, row, BESIDE / CLOSER)) else {
                    continue;
                };
                let share = distance(&inner) / distance(&outer);
                if !(CURVED[0]..CURVED[1]).contains(&share) {
                    sides[near.tuner] = if share > STEEPER { Some(inner) } else { far.beyond(near, row) };
                }
            }
            criterion.sides = sides.iter().any(Option::is_some).then_some(sides);
        }
    }
}

/// Points on both sides of a point along a tuner.
struct Pair {
    tuner: usize,
    below: Evaluation,
    above: Evaluation,
}

impl Pair {
    /// Returns the derivatives of a criterion to the left and to the right.
    fn sides(&self, at: &Evaluation, row: usize, step: f64) -> Option<[f64; 2]> {
        let here = value(at, row)?;
        Some([(here - value(&self.below, row)?) / step, (value(&self.above, row)? - here) / step])
    }

    /// Returns the derivatives between these points and those of a closer pair: at a kink within the closer pair they
    /// are exact.
    fn beyond(&self, closer: &Self, row: usize) -> Option<[f64; 2]> {
        let step = BESIDE - BESIDE / CLOSER;
        let between = |a: &Evaluation, b: &Evaluation| Some((value(b, row)? - value(a, row)?) / step);
        Some([between(&self.below, &closer.below)?, between(&closer.above, &self.above)?])
    }
}

fn value(of: &Evaluation, row: usize) -> Option<f64> {
    of.scaled.as_ref().map(|scaled| scaled[row])
}

fn distance([left, right]: &[f64; 2]) -> f64 {
    (right - left).abs()
}

/// Evaluates the points at a step on both sides along the tuners, without those that are closer to a bound. Returns
/// `None` if the budget does not suffice.
fn pairs(oracle: &mut dyn Oracle, at: &Evaluation, tuners: &[usize], step: f64) -> Option<Vec<Pair>> {
    let moved = |j: usize, step: f64| {
        let mut point = at.point.clone();
        point[j] += step;
        (0.0..=1.0).contains(&point[j]).then_some(point)
    };
    let within: Vec<(usize, [Vec<f64>; 2])> =
        tuners.iter().filter_map(|&j| Some((j, [moved(j, -step)?, moved(j, step)?]))).collect();
    let points: Vec<Vec<f64>> = within.iter().flat_map(|(_, pair)| pair.clone()).collect();
    if oracle.remaining() < points.len() {
        return None;
    }
    let mut found = oracle.evaluate(&points).ok()?.into_iter();
    Some(
        within
            .iter()
            .map_while(|(tuner, _)| Some(Pair { tuner: *tuner, below: found.next()?, above: found.next()? }))
            .collect(),
    )
}

mops_outcome::finding!(
    SlopesReport,
    "slopes",
    "Derivatives of a design's criteria with respect to the tuners at the reported point."
);
