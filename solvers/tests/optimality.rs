//! Points whose optimality is known.

use mops_core::{
    Evaluation, Objective, Run, Shape, Usage,
    problem::Evaluator,
    run::Budget,
    solver::{Optimality, Pareto},
};
use mops_math as math;
use mops_math::stream;
use mops_solvers::{certificate, optimality};
use rand::Rng;

/// Scaled values at a point.
type Values = dyn Fn(&[f64]) -> Vec<f64> + Sync;

/// Criteria over the unit cube, with finite-difference gradients.
struct Rows {
    shape: Shape,
    values: Box<Values>,
}

impl Rows {
    /// Returns criteria with these usages.
    fn new(usages: &[Usage], objective: Objective, values: impl Fn(&[f64]) -> Vec<f64> + Sync + 'static) -> Self {
        let rows = usages.iter().map(|usage| (*usage, 1.0)).collect();
        let shape = Shape { spacing: vec![0.0; 3], rows, objective, ..Shape::default() };
        Self { shape, values: Box::new(values) }
    }

    /// Returns the certificate of a point.
    fn certificate(&self, point: [f64; 3]) -> Pareto {
        certificate(&mut Run::new(self, Budget { evaluations: usize::MAX }, &()), &point).pareto
    }

    /// Returns the classification of a point.
    fn optimality(&self, point: &[f64]) -> Optimality {
        optimality(&mut Run::new(self, Budget { evaluations: usize::MAX }, &()), point)
    }
}

/// Returns two criteria of a front.
fn two(values: fn(&[f64]) -> [f64; 2]) -> Rows {
    Rows::new(&[Usage::Minimise; 2], Objective::Each, move |x| values(x).to_vec())
}

impl Evaluator for Rows {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn evaluate(&self, point: &[f64]) -> Evaluation {
        let scaled = (self.values)(point);
        let merit = self.shape.merit(&scaled);
        Evaluation {
            point: point.to_vec(),
            tuners: point.to_vec(),
            readings: Vec::new(),
            scaled: Some(scaled),
            residuals: Vec::new(),
            merit,
            failures: Vec::new(),
        }
    }

    fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        point.to_vec()
    }

    fn seed(&self) -> u64 {
        1
    }
}

/// Distance from a curved surface, which is a kink of both criteria and contains their front.
fn off(x: &[f64]) -> f64 {
    (x[1] - 0.5 - 4.0 * math::powi(x[0] - 0.5, 2) - math::powi(x[2] - 0.4, 2)).abs()
}

/// On the surface the criteria are squared distances to two points; the front lies between them.
fn kinked(x: &[f64]) -> [f64; 2] {
    let distance = |x1: f64| math::powi(x[0] - x1, 2) + math::powi(x[2] - 0.4, 2);
    [distance(0.3) + 2.0 * off(x), distance(0.7) + 0.5 * off(x)]
}

fn on_the_sheet(x1: f64) -> [f64; 3] {
    [x1, 0.5 + 4.0 * math::powi(x1 - 0.5, 2), 0.4]
}

#[test]
fn points_of_a_front_on_a_bent_kink_are_certified() {
    for x1 in [0.35, 0.4, 0.45, 0.55, 0.6, 0.65] {
        assert_eq!(two(kinked).certificate(on_the_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
}

#[test]
fn a_point_of_the_kink_that_both_rows_can_leave_behind_is_not_certified() {
    for x1 in [0.2, 0.25, 0.75, 0.8] {
        assert_ne!(two(kinked).certificate(on_the_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
    // Also beside the kink.
    for x1 in [0.35, 0.5, 0.65] {
        let [a, b, c] = on_the_sheet(x1);
        assert_ne!(two(kinked).certificate([a, b + 0.01, c]), Pareto::CertifiedLocal, "{x1}");
    }
}

/// Steep, oblique and strongly curved kink of the first criterion: steps along it leave it, or average both sides.
fn steep(x: &[f64]) -> [f64; 2] {
    let off = x[1] - 0.5 - BENT * math::powi(x[0] - 0.5, 2) - (x[2] - 0.4);
    let distance = |x1: f64| math::powi(x[0] - x1, 2) + math::powi(x[2] - 0.4, 2);
    [distance(0.3) + (20.0 * off).max(-60.0 * off), distance(0.7)]
}

const BENT: f64 = 5.0;

fn on_the_steep_sheet(x1: f64) -> [f64; 3] {
    [x1, 0.5 + BENT * math::powi(x1 - 0.5, 2), 0.4]
}

#[test]
fn a_steep_kink_is_seen_from_both_sides() {
    for x1 in [0.32, 0.35, 0.4, 0.45, 0.55, 0.6, 0.65, 0.68] {
        assert_eq!(two(steep).certificate(on_the_steep_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
    for x1 in [0.2, 0.25, 0.75, 0.8] {
        assert_ne!(two(steep).certificate(on_the_steep_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
}

#[test]
fn a_jump_nearby_certifies_nothing() {
    // Below the discontinuity both criteria decrease along the second coordinate.
    let jump = |x: &[f64]| {
        let beyond = if x[1] > 0.5002 { 10.0 } else { 0.0 };
        [beyond - x[1] + math::powi(x[0] - 0.4, 2), beyond - 2.0 * x[1] + math::powi(x[0] - 0.6, 2)]
    };
    assert_ne!(two(jump).certificate([0.5, 0.5, 0.5]), Pareto::CertifiedLocal);
}

#[test]
fn a_criterion_without_slope_is_not_improved_at_the_cost_of_another_one() {
    // The second criterion is constant: the first one can be lowered at no cost.
    let flat = two(|x| [1.0 + x[0], 2.0]);
    assert_eq!(flat.certificate([0.5, 0.5, 0.5]), Pareto::No);
    // At the minimum of the second criterion the first one falls, but not without cost to the second order.
    let end = two(|x| [x[0], 1.0 + math::powi(x[0] - 0.5, 2)]);
    assert_eq!(end.certificate([0.5, 0.5, 0.5]), Pareto::NotShown);
}

fn distance(x: &[f64], y: [f64; 3]) -> f64 {
    x.iter().zip(y).map(|(a, b)| math::powi(a - b, 2)).sum()
}

const ONE: &[Usage] = &[Usage::Minimise];

#[test]
fn a_smooth_minimum_is_stationary_and_a_slope_is_a_descent() {
    let bowl = Rows::new(ONE, Objective::Max, |x| vec![1.0 + distance(x, [0.3, 0.4, 0.9])]);
    assert_eq!(bowl.optimality(&[0.3, 0.4, 0.9]), Optimality::Stationary);
    // As near as solvers end: the slope is not zero, but what it gains is negligible.
    assert!(bowl.optimality(&[0.3004, 0.4, 0.9]).is_stationary());
    assert_eq!(bowl.optimality(&[0.35, 0.4, 0.9]), Optimality::Descent);
}

#[test]
fn a_minimum_at_a_bound_or_at_a_constraint_is_stationary() {
    let outside = Rows::new(ONE, Objective::Max, |x| vec![1.0 + distance(x, [-0.5, 0.4, 1.5])]);
    assert_eq!(outside.optimality(&[0.0, 0.4, 1.0]), Optimality::Stationary);
    assert_eq!(outside.optimality(&[0.1, 0.4, 1.0]), Optimality::Descent);
    // The nearest point to the corner on a sphere around it.
    let limited = [Usage::Minimise, Usage::Inequality];
    let sphere = Rows::new(&limited, Objective::Max, |x| vec![1.0 + x[0] + x[1] + x[2], 1.25 - distance(x, [0.0; 3])]);
    let along = [0.25_f64.sqrt(), 0.0, 0.0];
    assert!(sphere.optimality(&along).is_stationary());
    assert_eq!(sphere.optimality(&[0.3, 0.4, 0.0]), Optimality::Descent);
}

#[test]
fn minima_of_maxima_and_at_kinks_are_stationary() {
    // Crossing criteria: an ordinary stationary point of the maximum.
    let crossing = |x: &[f64]| vec![1.0 + x[0], 2.0 - x[0], distance(x, [0.5; 3])];
    let two = Rows::new(&[Usage::Minimise; 3], Objective::Max, crossing);
    assert_eq!(two.optimality(&[0.5, 0.2, 0.9]), Optimality::Stationary);
    assert_eq!(two.optimality(&[0.45, 0.2, 0.9]), Optimality::Descent);
    let bent = Rows::new(ONE, Objective::Max, |x| vec![1.0 + distance(x, [0.3, 0.5, 0.4]) + 2.0 * off(x)]);
    assert_eq!(bent.optimality(&[0.3, 0.5 + 0.16, 0.4]), Optimality::Descent);
    let sharp =
        Rows::new(ONE, Objective::Max, |x| vec![1.0 + (x[0] - 0.3).abs() + 3.0 * (x[1] + x[0] - 0.8).abs() + x[2]]);
    assert!(sharp.optimality(&[0.3, 0.5, 0.0]).is_stationary());
    assert_eq!(sharp.optimality(&[0.31, 0.49, 0.0]), Optimality::Descent);
}

#[test]
fn a_jump_beside_the_point_shows_nothing() {
    let step = |x: &[f64]| if x[0] < 0.5 { 10.0 } else { 0.0 };
    let wall = Rows::new(ONE, Objective::Max, move |x| vec![1.0 + x[0] + step(x)]);
    assert_eq!(wall.optimality(&[0.5001, 0.5, 0.5]), Optimality::Jump);
    let limited = [Usage::Minimise, Usage::Inequality];
    let limit = Rows::new(&limited, Objective::Max, move |x| vec![1.0 + x[0], 0.9 + step(x)]);
    assert_eq!(limit.optimality(&[0.5001, 0.5, 0.5]), Optimality::Jump);
}

#[test]
fn no_plateau_of_saturated_criteria_is_stationary() {
    let mut random = stream(7, "plateaus");
    let mut shown = 0;
    for case in 0..200 {
        let centre: [f64; 3] = std::array::from_fn(|_| random.random());
        let (limit, steep) = (random.random_range(0.01..0.1), random.random_range(1.0..50.0));
        let saturated = Rows::new(&[Usage::Minimise; 2], Objective::Max, move |x| {
            vec![3.0_f64.min(1.0 + steep * distance(x, centre).max(limit)), 0.5 + x[0]]
        });
        let edge = (2.0 / steep).max(limit).sqrt() + 0.02;
        let point: [f64; 3] = std::array::from_fn(|_| random.random_range(0.02..0.98));
        let away = distance(&point, centre).sqrt();
        // Either far outside, where the first criterion has its largest value, or well within its smallest.
        let within: [f64; 3] = std::array::from_fn(|j| centre[j] + 0.3 * limit.sqrt() * (point[j] - centre[j]));
        if away > edge {
            assert_eq!(saturated.optimality(&point), Optimality::Plateau, "{case}: {point:?} of {centre:?}");
            shown += 1;
        }
        if within.iter().all(|u| (0.02..0.98).contains(u)) && 1.0 + steep * limit > 1.6 && steep * limit < 1.9 {
            assert_eq!(saturated.optimality(&within), Optimality::Plateau, "{case}: {within:?} of {centre:?}");
        }
    }
    assert!(shown > 100, "{shown}");
}
