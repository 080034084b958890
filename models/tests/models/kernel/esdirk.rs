//! Tests of the implicit Runge-Kutta method, compared with published values and closed forms.

use mops_core::{Failure, Instant, Plant};
use mops_language::{Dual, Scalar};
use mops_math as math;
use mops_models::kernel::{Driven, IntegrationMethod, Tolerance, integrate};

fn stiff(relative: f64) -> Tolerance {
    Tolerance { relative, method: IntegrationMethod::Stiff, ..Tolerance::DEFAULT }
}

/// Van der Pol oscillator `x'' = mu (1 - x^2) x' - x`.
struct VanDerPol<S>(S);
impl<S: Scalar> Plant<S> for VanDerPol<S> {
    fn start(&self) -> Vec<S> {
        vec![S::from(2.0), S::from(0.0)]
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let x = at.x;
        dx.copy_from_slice(&[x[1], self.0 * (-x[0] * x[0] + 1.0) * x[1] - x[0]]);
    }
}

#[test]
fn van_der_pol_agrees_with_its_published_value() {
    // Reference at t = 2000 for mu = 1000 from (2, 0): 1.706167732170483 (test set for IVP solvers, Bari, vdpolm).
    let (x, work) =
        integrate(&mut Driven::alone(VanDerPol(1000.0)), 0.0, 2000.0, &[2.0, 0.0], &stiff(1e-8), &mut ()).unwrap();
    assert!((x[0] - 1.706_167_732_170_483).abs() < 1e-6, "{x:?} {work:?}");
    let explicit = Tolerance { method: IntegrationMethod::Explicit, ..stiff(1e-8) };
    let failure = integrate(&mut Driven::alone(VanDerPol(1000.0)), 0.0, 2000.0, &[2.0, 0.0], &explicit, &mut ());
    assert!(matches!(failure, Err(Failure::StepLimit(..))));
}

#[test]
fn the_error_falls_with_the_fourth_power_of_the_step() {
    // The solution of `x' = -cos(t) x^2`, `x(0) = 1` is `1/(1 + sin t)`.
    struct Rational;
    impl Plant<f64> for Rational {
        fn start(&self) -> Vec<f64> {
            vec![1.0]
        }
        fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
            dx[0] = -math::cos(at.t) * at.x[0] * at.x[0];
        }
    }
    let run = |relative: f64| {
        let (x, work) = integrate(&mut Driven::alone(Rational), 0.0, 2.0, &[1.0], &stiff(relative), &mut ()).unwrap();
        ((x[0] - 1.0 / (1.0 + math::sin(2.0))).abs(), work.steps)
    };
    // The length of the steps follows the tolerance.
    let ((large, few), (small, many)) = (run(1e-8), run(1e-11));
    #[allow(clippy::cast_precision_loss)]
    let order = math::ln(large / small) / math::ln(many as f64 / few as f64);
    assert!(many > 4 * few && (order - 4.0).abs() < 0.25, "{order}: {few} and {many} steps");
}

#[test]
fn tangents_are_exact_and_change_no_value() {
    let tolerance = stiff(1e-9);
    let run =
        |mu: f64| integrate(&mut Driven::alone(VanDerPol(mu)), 0.0, 5.0, &[2.0, 0.0], &tolerance, &mut ()).unwrap().0;
    let start = [Dual::from(2.0), Dual::from(0.0)];
    let mut dual = Driven::alone(VanDerPol(Dual::<1>::variable(10.0, 0)));
    let (x, _) = integrate(&mut dual, 0.0, 5.0, &start, &tolerance, &mut ()).unwrap();
    assert_eq!(x.iter().map(|x| x.value).collect::<Vec<_>>(), run(10.0));
    let (high, low) = (run(10.0 + 1e-3), run(10.0 - 1e-3));
    for i in 0..2 {
        let slope = (high[i] - low[i]) / 2e-3;
        assert!((x[i].tangent[0] - slope).abs() < 1e-5 * slope.abs().max(1e-2), "{:?} {slope}", x[i]);
    }
}

#[test]
fn a_chain_that_rests_at_zero_is_driven() {
    /// Chain of integrators `x1' = x2`, ..., `xn' = push(t)`, with all states 0 at the start.
    struct Chain<const N: usize>(fn(f64) -> f64);
    impl<const N: usize> Plant<f64> for Chain<N> {
        fn start(&self) -> Vec<f64> {
            vec![0.0; N]
        }
        fn rates(&self, at: &Instant<'_, f64>, dx: &mut [f64]) {
            dx.copy_from_slice(at.x);
            dx.rotate_left(1);
            dx[N - 1] = self.0(at.t);
        }
    }
    fn end<const N: usize>(push: fn(f64) -> f64) -> f64 {
        integrate(&mut Driven::alone(Chain::<N>(push)), 0.0, 1.0, &[0.0; N], &stiff(1e-8), &mut ()).unwrap().0[0]
    }
    for unit in [1.0, 1e-30, 1e30] {
        let near = |found: f64, exact: f64| assert!((found - exact).abs() < 1e-6 * exact.abs(), "{found} {exact}");
        let push: fn(f64) -> f64 = match unit {
            1.0 => |_| 1.0,
            1e-30 => |_| 1e-30,
            _ => |_| 1e30,
        };
        let found = [end::<1>(push), end::<2>(push), end::<3>(push), end::<4>(push)];
        found.into_iter().zip([1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0]).for_each(|(x, exact)| near(x, exact * unit));
    }
    let driven = end::<2>(math::sin);
    assert!((driven - (1.0 - math::sin(1.0))).abs() < 1e-7, "{driven}");
}
