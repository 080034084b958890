//! Programs with known solutions, and random programs checked by their optimality conditions.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

fn factor(hessian: &DMatrix<f64>) -> Vec<f64> {
    hessian.clone().cholesky().unwrap().l().as_slice().to_vec()
}

/// Largest error of the Karush-Kuhn-Tucker conditions, which hold only at the solution of a strictly convex program.
fn error(method: &ActiveSet, hessian: &DMatrix<f64>, c: &[f64], constraints: &Constraints) -> f64 {
    let n = c.len();
    let x = DVector::from_column_slice(method.x());
    let mut gradient = hessian * &x + DVector::from_column_slice(c);
    let mut worst = 0.0_f64;
    for (p, multiplier) in method.active() {
        let normal = DVector::from_column_slice(row(constraints, p, n));
        worst = worst.max((normal.dot(&x) - constraints.bounds[p]).abs()).max(-multiplier);
        gradient -= normal * multiplier;
    }
    let slacks =
        (0..constraints.bounds.len()).map(|p| dot(row(constraints, p, n), x.as_slice()) - constraints.bounds[p]);
    slacks.fold(worst.max(gradient.amax()), |worst, slack| worst.max(-slack))
}

#[test]
fn random_programs_are_solved_to_rounding() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut method = ActiveSet::default();
    for (n, m) in [(1, 3), (5, 10), (10, 30), (20, 60)].repeat(25) {
        let mut draw = || random.random_range(-1.0..1.0);
        let a = DMatrix::from_fn(n, n, |_, _| draw());
        let hessian = &a * a.transpose() + DMatrix::identity(n, n) * 0.1;
        let c: Vec<f64> = (0..n).map(|_| 5.0 * draw()).collect();
        // The constraints are feasible at a random point; every third one is an equality there.
        let inside = DVector::from_fn(n, |_, _| draw());
        let mut constraints = Constraints::default();
        for p in 0..m {
            let normal = DVector::from_fn(n, |_, _| draw());
            let slack = if p % 3 == 0 { 0.0 } else { draw().abs() };
            constraints.bounds.push(normal.dot(&inside) - slack);
            constraints.normals.extend(normal.iter());
        }
        assert!(method.solve(&|| true, &factor(&hessian), &c, &constraints, &[]), "{n} {m}");
        let error = error(&method, &hessian, &c, &constraints);
        assert!(error < 1e-10, "{n} {m}: {error:e}");
    }
}

#[test]
fn inconsistent_constraints_are_detected() {
    let hessian = DMatrix::identity(1, 1);
    let constraints = Constraints { normals: vec![1.0, -1.0], bounds: vec![1.0, 0.0] };
    assert!(!ActiveSet::default().solve(&|| true, &factor(&hessian), &[0.0], &constraints, &[]));
}

#[test]
fn duplicate_constraints_do_no_harm() {
    let hessian = DMatrix::identity(2, 2);
    let constraints = Constraints { normals: [1.0, 1.0].repeat(6), bounds: vec![2.0; 6] };
    let mut method = ActiveSet::default();
    assert!(method.solve(&|| true, &factor(&hessian), &[0.0, 0.0], &constraints, &[]));
    assert!(method.x().iter().all(|x| (x - 1.0).abs() < 1e-14), "{:?}", method.x());
}
