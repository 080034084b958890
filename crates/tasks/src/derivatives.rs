//! Derivatives at the reported point, compared with differences of simulations.

use mops_identification::NEGLIGIBLE;
use rand::Rng;
use schemars::JsonSchema;
use serde::Serialize;

use mops_core::{
    criterion::Usage,
    evaluation::{Evaluation, Objective},
    problem::Problem,
    solver::{Linearisation, Oracle, SMALL_OBJECTIVE},
};

/// Distances of the compared points, in the unit box, of ratio 10: a change that does not shrink with the distance is a
/// jump. At the smaller one, differences of values that repeat to 1e-9 are accurate to 1e-5.
const STEPS: [f64; 2] = [2e-4, 2e-3];

/// Distance, in the unit box, at which a tuner without derivatives is also moved.
const TENTH: f64 = 0.1;

/// Deviation of a derivative from the differences on both sides, relative to the largest of them, up to which it is
/// theirs.
const DEVIATION: f64 = 0.02;

/// Difference of two differences on one side, relative to the larger one, up to which they are a derivative.
const AGREEMENT: f64 = 0.1;

/// Change at the smaller distance, relative to that at the larger one, from which a criterion jumps.
const JUMP: f64 = 0.5;

/// The block `derivatives` of a result: the derivatives at the reported point, compared with differences of
/// simulations.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct DerivativesReport {
    /// Number of points evaluated for the comparison.
    pub evaluations: usize,
    /// Number of compared directions: that of the gradient, a random one, and the axis of each tuner whose derivatives
    /// are all 0.
    pub directions: usize,
    /// Number of directions that the budget did not cover.
    pub left_out: usize,
    /// Derivatives that contradict the differences.
    pub contradictions: Vec<Contradiction>,
    /// Tuners that have no effect near the point, but at a distance.
    pub beyond: Vec<Beyond>,
    /// Keys, `case/criterion`, of criteria that jump within a thousandth of the ranges of the tuners.
    pub jumps: Vec<String>,
    /// True if one of them jumps to a better value.
    pub jumps_to_better: bool,
}

/// Tuner whose derivatives are all 0, but that changes a criterion when it moves by a tenth of its range.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Beyond {
    /// Tuner.
    pub tuner: String,
    /// Key, `case/criterion`, of the criterion that changes most.
    pub key: String,
    /// Its scaled value at the point, and a tenth of the range away; null without a value.
    pub scaled: [f64; 2],
}

/// Derivative that contradicts the differences on both sides.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Contradiction {
    /// Key, `case/criterion`.
    pub key: String,
    /// Tuner along whose axis the scaled value was compared; null for a direction in which several tuners change.
    pub tuner: Option<String>,
    /// Derivative of the scaled value along the direction, per range of the tuners.
    pub derivative: f64,
    /// Differences backward and forward; null outside of the bounds.
    pub differences: [Option<f64>; 2],
}

/// Result of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Comparison {
    /// The derivative lies between the differences, or these show nothing.
    Consistent,
    /// The derivative lies outside of differences that agree with each other.
    Contradiction([Option<f64>; 2]),
    /// The value jumps, to this one.
    Jump(f64),
}

/// Compares a derivative with the values at [`STEPS`] on each side of a point with the value `here`.
fn compare(derivative: f64, here: f64, sides: [Option<[f64; 2]>; 2]) -> Comparison {
    let mut all = Vec::new();
    let mut differences = [None; 2];
    for (side, values) in sides.into_iter().enumerate() {
        let Some(values) = values else { continue };
        let [near, far] = values.map(|value| value - here);
        let negligible = NEGLIGIBLE * (here.abs() + SMALL_OBJECTIVE);
        if near.abs() > negligible && near.abs() > JUMP * far.abs() {
            return Comparison::Jump(values[0]);
        }
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let [near, far] = [sign * near / STEPS[0], sign * far / STEPS[1]];
        if (near - far).abs() > AGREEMENT * near.abs().max(far.abs()) + negligible {
            return Comparison::Consistent;
        }
        all.extend([near, far]);
        differences[side] = Some(near);
    }
    let largest = all.iter().fold(derivative.abs(), |most, difference| most.max(difference.abs()));
    let margin = DEVIATION * largest + NEGLIGIBLE * (here.abs() + SMALL_OBJECTIVE);
    let [low, high] = [f64::min, f64::max].map(|pick| all.iter().copied().reduce(pick).unwrap_or(derivative));
    if derivative < low - margin || derivative > high + margin {
        Comparison::Contradiction(differences)
    } else {
        Comparison::Consistent
    }
}

/// Direction of a comparison.
struct Direction {
    /// Change of each coordinate, at most 1.
    along: Vec<f64>,
    /// Coordinate, if it is the only one that changes.
    axis: Option<usize>,
}

impl Direction {
    /// Returns the direction with coordinates at a bound turned inwards.
    fn inwards(mut self, point: &[f64]) -> Self {
        for (d, &u) in self.along.iter_mut().zip(point) {
            if u < STEPS[1] {
                *d = d.abs();
            } else if u > 1.0 - STEPS[1] {
                *d = -d.abs();
            }
        }
        self
    }

    /// Returns the points at [`STEPS`] on a side, if they are within the box.
    fn points(&self, point: &[f64], sign: f64) -> Option<[Vec<f64>; 2]> {
        let at = |step: f64| -> Vec<f64> { point.iter().zip(&self.along).map(|(u, d)| u + sign * step * d).collect() };
        let points = STEPS.map(at);
        points[1].iter().all(|u| (0.0..=1.0).contains(u)).then_some(points)
    }
}

impl DerivativesReport {
    /// Compares exact derivatives at a point with differences: along the gradient of the objective, in a random
    /// direction, and along the axis of each tuner whose derivatives are all 0. Directions beyond the budget of the
    /// oracle are left out.
    pub fn of(problem: &Problem, oracle: &mut dyn Oracle, found: &Linearisation) -> Self {
        let mut report = Self::default();
        let (point, study) = (&found.at.point, problem.study());
        let Some(here) = &found.at.scaled else { return report };
        let counts = |i: &usize| problem.shape().rows[*i].0 != Usage::Monitor;
        let rows: Vec<usize> = (0..study.rows().len()).filter(counts).collect();
        let mut stream = oracle.stream("derivatives");
        let mut directions = Vec::new();
        directions.extend(steepest(problem, found, here));
        directions.push(Direction {
            along: point
                .iter()
                .map(|_| stream.random_range(0.5..=1.0) * if stream.random() { 1.0 } else { -1.0 })
                .collect(),
            axis: None,
        });
        let is_idle = |j: &usize| rows.iter().all(|&i| found.rows[i][*j] == 0.0);
        directions.extend((0..point.len()).filter(is_idle).map(|j| Direction {
            along: (0..point.len()).map(|k| f64::from(u8::from(k == j))).collect(),
            axis: Some(j),
        }));
        for direction in directions.into_iter().map(|direction| direction.inwards(point)) {
            let sides = [-1.0, 1.0].map(|sign| direction.points(point, sign));
            let points: Vec<Vec<f64>> = sides.iter().flatten().flatten().cloned().collect();
            let Ok(evaluations) = oracle.evaluate(&points) else {
                report.left_out += 1;
                continue;
            };
            report.directions += 1;
            report.evaluations += points.len();
            let changes = |at: &Evaluation| {
                let change = |i: usize| at.scaled.as_ref().map_or(f64::INFINITY, |scaled| (scaled[i] - here[i]).abs());
                rows.iter().any(|&i| change(i) > STEPS[1] * NEGLIGIBLE * (here[i].abs() + SMALL_OBJECTIVE))
            };
            // At a kink or a smooth extremum, the tuner has an effect near the point.
            if let Some(j) = direction.axis.filter(|_| !evaluations.iter().any(changes)) {
                report.move_far(problem, oracle, &found.at, &rows, j);
            }
            let mut values =
                evaluations.chunks(2).map(|pair| pair.iter().map(|at| at.scaled.as_ref()).collect::<Vec<_>>());
            let sides = sides.map(|side| side.and_then(|_| values.next()));
            for &i in &rows {
                let of_row = |side: &Option<Vec<Option<&Vec<f64>>>>| match side.as_deref() {
                    Some([Some(near), Some(far)]) => Some([near[i], far[i]]),
                    _ => None,
                };
                let derivative = found.rows[i].iter().zip(&direction.along).map(|(slope, d)| slope * d).sum();
                let key = || study.key(&study.rows()[i]);
                match compare(derivative, here[i], sides.each_ref().map(of_row)) {
                    Comparison::Consistent => {}
                    Comparison::Jump(there) => {
                        let level = |scaled: f64| match problem.shape().rows[i].0 {
                            Usage::Equality => (scaled - 1.0).abs(),
                            _ => scaled,
                        };
                        report.jumps_to_better |= level(there) < level(here[i]);
                        if !report.jumps.contains(&key()) {
                            report.jumps.push(key());
                        }
                    }
                    Comparison::Contradiction(differences) => report.contradictions.push(Contradiction {
                        key: key(),
                        tuner: direction.axis.map(|j| study.tuners()[problem.active()[j]].name.clone()),
                        derivative,
                        differences,
                    }),
                }
            }
        }
        report
    }
}

impl DerivativesReport {
    /// Moves a tuner without derivatives by a tenth of its range, and notes the criterion that changes most, if one
    /// does.
    fn move_far(&mut self, problem: &Problem, oracle: &mut dyn Oracle, at: &Evaluation, rows: &[usize], j: usize) {
        let mut point = at.point.clone();
        point[j] += if point[j] > 0.5 { -TENTH } else { TENTH };
        let Ok(there) = oracle.evaluate(&[point]) else { return };
        self.evaluations += 1;
        let scaled = |of: &Evaluation, i: usize| of.scaled.as_ref().map_or(f64::NAN, |scaled| scaled[i]);
        // Without a value, the change is the largest.
        let change = |i: usize| {
            let [here, there] = [at, &there[0]].map(|of| scaled(of, i));
            let change = (there - here).abs() / (here.abs() + SMALL_OBJECTIVE);
            if change.is_nan() { f64::INFINITY } else { change }
        };
        let most = rows.iter().copied().max_by(|&a, &b| change(a).total_cmp(&change(b)));
        if let Some(i) = most.filter(|&i| change(i) > NEGLIGIBLE) {
            let study = problem.study();
            self.beyond.push(Beyond {
                tuner: study.tuners()[problem.active()[j]].name.clone(),
                key: study.key(&study.rows()[i]),
                scaled: [at, &there[0]].map(|of| scaled(of, i)),
            });
        }
    }
}

/// Returns the direction of the gradient of the objective: of the sum of the minimised rows, or of the worst of them.
fn steepest(problem: &Problem, found: &Linearisation, here: &[f64]) -> Option<Direction> {
    let shape = problem.shape();
    let minimised = || (0..here.len()).filter(|&i| shape.rows[i].0 == Usage::Minimise);
    let gradient: Vec<f64> = if shape.objective == Objective::Sum {
        (0..found.at.point.len()).map(|j| minimised().map(|i| shape.rows[i].1 * found.rows[i][j]).sum()).collect()
    } else {
        let weighted = |i: usize| shape.rows[i].1 * here[i];
        let worst = minimised().max_by(|&a, &b| weighted(a).total_cmp(&weighted(b)))?;
        found.rows[worst].clone()
    };
    let largest = gradient.iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
    (largest > 0.0).then(|| Direction { along: gradient.iter().map(|slope| slope / largest).collect(), axis: None })
}

mops_outcome::finding!(
    DerivativesReport,
    "derivatives",
    "Derivatives at the reported point, compared with differences; null if there are none."
);

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    fn sides(f: impl Fn(f64) -> f64) -> [Option<[f64; 2]>; 2] {
        [-1.0, 1.0].map(|sign| Some(STEPS.map(|step| f(sign * step))))
    }

    #[test]
    fn a_derivative_that_is_0_or_has_another_sign_contradicts_the_differences() {
        let f = |x: f64| 1.0 + 0.3 * x + 2.0 * x * x;
        assert_eq!(compare(0.3, 1.0, sides(f)), Comparison::Consistent);
        for wrong in [0.0, -0.3, 0.36] {
            assert!(matches!(compare(wrong, 1.0, sides(f)), Comparison::Contradiction(_)), "{wrong}");
        }
    }

    #[test]
    fn at_a_kink_the_derivatives_of_both_sides_and_between_them_are_consistent() {
        let f = |x: f64| 1.0 + if x > 0.0 { 2.0 * x } else { -0.5 * x };
        for consistent in [2.0, -0.5, 0.7] {
            assert_eq!(compare(consistent, 1.0, sides(f)), Comparison::Consistent);
        }
        assert!(matches!(compare(2.5, 1.0, sides(f)), Comparison::Contradiction(_)));
    }

    #[test]
    fn a_change_that_does_not_shrink_with_the_distance_is_a_jump() {
        assert_eq!(compare(0.1, 1.0, sides(|x| if x > 1e-4 { 1.4 } else { 1.0 })), Comparison::Jump(1.4));
        // A jump between the two distances is no derivative either.
        assert_eq!(compare(0.1, 1.0, sides(|x| if x > 1e-3 { 1.4 } else { 1.0 + 0.1 * x })), Comparison::Consistent);
    }

    #[test]
    fn one_side_within_the_bounds_is_enough() {
        let one = |slope: f64| [None, Some(STEPS.map(|step| 1.0 + slope * step))];
        assert_eq!(compare(0.3, 1.0, one(0.3)), Comparison::Consistent);
        assert!(matches!(compare(0.0, 1.0, one(0.3)), Comparison::Contradiction([None, Some(_)])));
        assert_eq!(compare(0.3, 1.0, [None, None]), Comparison::Consistent);
    }

    #[test]
    fn noise_contradicts_nothing() {
        let noisy = |x: f64| 1.0 + 1e-7 * math::sin(1e7 * x);
        assert_eq!(compare(0.0, 1.0, sides(noisy)), Comparison::Consistent);
    }

    #[test]
    fn coordinates_at_a_bound_are_turned_inwards() {
        let direction = Direction { along: vec![-1.0, 0.5, 0.7], axis: None }.inwards(&[0.0, 0.5, 1.0]);
        assert_eq!(direction.along, [1.0, 0.5, -0.7]);
        assert!(
            direction.points(&[0.0, 0.5, 1.0], -1.0).is_none() && direction.points(&[0.0, 0.5, 1.0], 1.0).is_some()
        );
    }
}
