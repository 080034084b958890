//! Certificates of points whose optimality is known.

use mops_core::math;
use mops_core::{Budget, Evaluation, Evaluator, Objective, Pareto, Run, Shape, Usage};
use mops_solvers::certificate;

/// Two criteria to be minimised over the unit cube, with finite-difference gradients.
struct Two {
    shape: Shape,
    rows: fn(&[f64]) -> [f64; 2],
}

impl Two {
    fn new(rows: fn(&[f64]) -> [f64; 2]) -> Self {
        let shape = Shape {
            spacing: vec![0.0; 3],
            rows: vec![(Usage::Minimise, 1.0); 2],
            objective: Objective::Each,
            ..Shape::default()
        };
        Self { shape, rows }
    }

    /// Returns the certificate of a point.
    fn certificate(&self, point: [f64; 3]) -> Pareto {
        certificate(&mut Run::new(self, Budget { evaluations: usize::MAX }, &()), &point).pareto
    }
}

impl Evaluator for Two {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn evaluate(&self, point: &[f64]) -> Evaluation {
        let scaled = (self.rows)(point).to_vec();
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
        assert_eq!(Two::new(kinked).certificate(on_the_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
}

#[test]
fn a_point_of_the_kink_that_both_rows_can_leave_behind_is_not_certified() {
    for x1 in [0.2, 0.25, 0.75, 0.8] {
        assert_ne!(Two::new(kinked).certificate(on_the_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
    // Also beside the kink.
    for x1 in [0.35, 0.5, 0.65] {
        let [a, b, c] = on_the_sheet(x1);
        assert_ne!(Two::new(kinked).certificate([a, b + 0.01, c]), Pareto::CertifiedLocal, "{x1}");
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
        assert_eq!(Two::new(steep).certificate(on_the_steep_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
    for x1 in [0.2, 0.25, 0.75, 0.8] {
        assert_ne!(Two::new(steep).certificate(on_the_steep_sheet(x1)), Pareto::CertifiedLocal, "{x1}");
    }
}

#[test]
fn a_jump_nearby_certifies_nothing() {
    // Below the discontinuity both criteria decrease along the second coordinate.
    let jump = |x: &[f64]| {
        let beyond = if x[1] > 0.5002 { 10.0 } else { 0.0 };
        [beyond - x[1] + math::powi(x[0] - 0.4, 2), beyond - 2.0 * x[1] + math::powi(x[0] - 0.6, 2)]
    };
    assert_ne!(Two::new(jump).certificate([0.5, 0.5, 0.5]), Pareto::CertifiedLocal);
}
