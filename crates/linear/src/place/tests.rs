use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use mops_math as math;
use mops_math::complex;
use rand::Rng as _;

use super::*;
use crate::testing::{assert_near, assert_same_set, c, furuta, random};
use crate::transfer::polynomial;
use crate::{TransferFunction, eigenvalues, reference};

#[test]
fn the_pendulum_gets_the_feedback_of_the_thesis() {
    // Section 5.2 of the thesis gives (-0.1387, -0.0690, -0.7345, -0.1354); further digits from SciPy 1.17.1,
    // `place_poles`.
    let (a, b) = furuta();
    let k = place(&a, &b, &[-5.0, -8.0, -10.0, -14.0].map(|p| c(p, 0.0))).unwrap().k;
    for (found, expected) in k.iter().zip([-0.138_746_07, -0.068_978_83, -0.734_559_28, -0.135_415_5]) {
        assert_near(*found, expected, 5e-9);
    }
}

#[test]
fn a_chain_of_integrators_gets_the_coefficients_of_its_polynomial_also_with_repeated_poles() {
    // Feedback of the companion form: the coefficients of (s + 1)^n, ascending powers.
    let n = 10;
    let mut denominator = vec![0.0; n + 1];
    denominator[0] = 1.0;
    let chain = TransferFunction::new(vec![1.0], denominator).state_space().unwrap();
    let k = place(&chain.a, &chain.b, &vec![c(-1.0, 0.0); n]).unwrap().k;
    let mut binomial = 1.0;
    for i in 0..n {
        assert_near(k[(0, i)], binomial, 1e-9 * binomial);
        binomial *= (n - i) as f64 / (i + 1) as f64;
    }
}

#[test]
fn poles_are_placed_with_one_input_in_ten_states() {
    let (a, b) = (random(10, 10, 1), random(10, 1, 2));
    let mut wanted: Vec<Complex> = (0..4).map(|i| c(-1.0 - f64::from(i), 0.0)).collect();
    wanted.extend((0..3).flat_map(|i| [1.0, -1.0].map(|sign| c(-1.0, sign * (1.0 + f64::from(i))))));
    let k = place(&a, &b, &wanted).unwrap().k;
    assert_same_set(&eigenvalues(&(&a - &b * k)).unwrap(), &wanted, 1e-6);
}

#[test]
fn with_several_inputs_the_poles_are_placed_and_hardly_move_with_the_model() {
    for (n, inputs, seed) in [(4, 2, 1), (6, 2, 2), (7, 3, 3), (5, 5, 4)] {
        let (a, b) = (random(n, n, seed), random(n, inputs, seed + 50));
        let mut wanted = vec![c(-1.0, 2.0), c(-1.0, -2.0), c(-2.0, 0.5), c(-2.0, -0.5)];
        wanted.extend((4..n).map(|i| c(-(i as f64) + 1.0, 0.0)));
        let k = place(&a, &b, &wanted).unwrap().k;
        assert_same_set(&eigenvalues(&(&a - &b * &k)).unwrap(), &wanted, 1e-9);
        // Movement of the poles when the model is perturbed by 1e-6.
        let disturbed = &a + random(n, n, seed + 90) * 1e-6;
        let moved = |k: &DMatrix<f64>| {
            let roots = eigenvalues(&(&disturbed - &b * k)).unwrap();
            let nearest = |z: &Complex| roots.iter().map(|root| complex::norm(root - z)).fold(f64::INFINITY, f64::min);
            wanted.iter().map(nearest).fold(0.0, f64::max)
        };
        assert!(moved(&k) < 2e-5, "{n} {inputs}: {}", moved(&k));
    }
}

#[test]
fn eigenvectors_are_as_independent_as_those_of_another_implementation() {
    // Kautsky, Nichols, Van Dooren, example 1 (a chemical reactor). SciPy 1.17.1, `place_poles`, gives an eigenvector
    // condition number of 4.28 with method KNV0 and of 4.51 with YT.
    let a = [
        [1.38, -0.2077, 6.715, -5.676],
        [-0.5814, -4.29, 0.0, 0.675],
        [1.067, 4.273, -6.654, 5.893],
        [0.048, 4.273, 1.343, -2.104],
    ];
    let a = DMatrix::from_fn(4, 4, |i, j| a[i][j]);
    let b = DMatrix::from_row_slice(4, 2, &[0.0, 0.0, 5.679, 0.0, 1.136, -3.146, 1.136, 0.0]);
    let wanted = [-0.2, -0.5, -5.0566, -8.6659].map(|p| c(p, 0.0));
    let k = place(&a, &b, &wanted).unwrap().k;
    let closed = &a - &b * k;
    assert_same_set(&eigenvalues(&closed).unwrap(), &wanted, 1e-10);
    assert!(condition(&closed, &wanted) < 4.28, "{}", condition(&closed, &wanted));
}

/// Returns the condition number of the unit eigenvectors of real, simple eigenvalues.
fn condition(a: &DMatrix<f64>, roots: &[Complex]) -> f64 {
    let n = a.nrows();
    let mut x = DMatrix::zeros(n, n);
    for (j, root) in roots.iter().enumerate() {
        let svd = (a - DMatrix::identity(n, n) * root.re).svd(false, true);
        let least = svd.singular_values.imin();
        x.set_column(j, &svd.v_t.unwrap().row(least).transpose());
    }
    let values = x.singular_values();
    values.max() / values.min()
}

#[test]
fn several_inputs_may_repeat_a_pole_more_often_than_there_are_inputs() {
    let (a, b) = (random(5, 5, 8), random(5, 2, 9));
    let k = place(&a, &b, &[c(-2.0, 0.0); 5]).unwrap().k;
    // Defective eigenvalue: its computed copies lie on a circle around the exact one.
    assert!(eigenvalues(&(&a - &b * k)).unwrap().iter().all(|z| complex::norm(z + 2.0) < 0.02));
}

#[test]
fn what_cannot_be_placed_is_refused() {
    let (a, b) = furuta();
    assert!(place(&a, &b, &[c(-1.0, 0.0)]).unwrap_err().contains("4 states"));
    let alone = [c(-1.0, 1.0), c(-1.0, 0.0), c(-2.0, 0.0), c(-3.0, 0.0)];
    assert!(place(&a, &b, &alone).unwrap_err().contains("no conjugate"));
    let stuck = DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, 0.0, -3.0]);
    let one = DMatrix::from_row_slice(2, 1, &[1.0, 0.0]);
    assert!(place(&stuck, &one, &[c(-5.0, 0.0), c(-6.0, 0.0)]).unwrap_err().contains("not controllable"));
    assert!(place(&a, &b, &[c(f64::NAN, 0.0); 4]).unwrap_err().contains("finite"));
}

/// Returns the error of the characteristic polynomial of `A - B K`, in 30 digits, against that of the specified poles.
///
/// Coefficients are relative to those of poles of equal magnitude on the negative real axis.
fn error_of_polynomial(a: &DMatrix<f64>, b: &DMatrix<f64>, k: &DMatrix<f64>, poles: &[Complex]) -> f64 {
    use reference::{characteristic, exactly, minus, times};
    let closed = minus(&exactly(a), &times(&exactly(b), &exactly(k)));
    let found = characteristic(&closed);
    let sizes: Vec<Complex> = poles.iter().map(|p| c(-complex::norm(*p), 0.0)).collect();
    let (wanted, size) = (polynomial(poles), polynomial(&sizes));
    let n = poles.len();
    (0..n).map(|i| (found[i].0 - wanted[n - i]).abs() / size[n - i]).fold(0.0, f64::max)
}

/// Third-order axis and first-order heater.
fn axis_and_heater(gain: f64, lag: f64, loss: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let a = [[0.0, 1.0, 0.0, 0.0], [0.0, -0.3, 3.0, 0.0], [0.0, -2.0, -lag, 0.0], [0.0, 0.0, 0.0, -loss]];
    let b = [[0.0, 0.0], [0.0, 0.0], [gain, 0.0], [0.0, 0.7]];
    (DMatrix::from_fn(4, 4, |i, j| a[i][j]), DMatrix::from_fn(4, 2, |i, j| b[i][j]))
}

#[test]
fn poles_that_the_controllability_indices_allow_in_jordan_blocks_only_are_placed_in_them() {
    // Controllability indices (3, 1): two double poles cannot have four independent eigenvectors.
    for (gain, lag, loss) in [(4.0, 8.0, 0.2), (1e-3, 8.0, 0.2), (1e4, 8.0, 5.0), (4.0, 300.0, 1e-3)] {
        let (a, b) = axis_and_heater(gain, lag, loss);
        for poles in [[-3.0, -3.0, -5.0, -5.0], [-1.0, -1.0, -20.0, -20.0], [-2.0, -2.0, -2.0, -7.0], [-4.0; 4]] {
            let poles = poles.map(|p| c(p, 0.0));
            let placed = place(&a, &b, &poles).unwrap();
            let error = error_of_polynomial(&a, &b, &placed.k, &poles);
            assert!(error < 1e-12, "{gain} {lag} {loss} {poles:?}: {error}");
            assert_eq!(placed.defective, Some(vec![3, 1]));
            assert!(placed.k.amax() < 1e3 * 400.0 / gain.min(0.7), "{}", placed.k);
        }
        // A double pole and two simple ones, or four simple ones, allow independent eigenvectors.
        for poles in [[-3.0, -4.0, -5.0, -5.0], [-3.0, -4.0, -5.0, -6.0]] {
            let poles = poles.map(|p| c(p, 0.0));
            let placed = place(&a, &b, &poles).unwrap();
            assert!(placed.defective.is_none() && error_of_polynomial(&a, &b, &placed.k, &poles) < 1e-12);
            assert!(placed.error < 1e-9 * 6.0, "{}", placed.error);
        }
    }
}

#[test]
fn repeated_pairs_are_placed_with_several_inputs_too() {
    // A chain of five driven at its end and in the middle, one of three and one of two, and full matrices.
    let chain = DMatrix::from_fn(5, 5, |i, j| f64::from(u8::from(j == i + 1)));
    let ends = DMatrix::from_fn(5, 2, |i, j| f64::from(u8::from((i, j) == (4, 0) || (i, j) == (3, 1))));
    let middle = DMatrix::from_fn(5, 2, |i, j| f64::from(u8::from((i, j) == (4, 0) || (i, j) == (2, 1))));
    let pairs = [c(-1.0, 2.0), c(-1.0, -2.0), c(-1.0, 2.0), c(-1.0, -2.0), c(-3.0, 0.0)];
    let triple = [c(-2.0, 0.0), c(-2.0, 0.0), c(-2.0, 0.0), c(-1.0, 1.0), c(-1.0, -1.0)];
    for (a, b) in [
        (chain.clone(), ends.clone()),
        (chain, middle),
        (random(5, 5, 8), random(5, 2, 9)),
        (random(5, 5, 10), random(5, 3, 11)),
        (random(5, 5, 12), random(5, 1, 13)),
        (DMatrix::zeros(5, 5), DMatrix::identity(5, 5)),
    ] {
        for poles in [pairs, triple] {
            let placed = place(&a, &b, &poles).unwrap();
            let error = error_of_polynomial(&a, &b, &placed.k, &poles);
            assert!(error < 1e-10 && placed.error < 1e-3, "{error} {} {a} {b}", placed.error);
        }
    }
}

#[test]
fn an_ill_conditioned_request_reports_the_pole_movement_or_is_refused() {
    // Ten nearly equal stable poles moved far to the left with one input: the gains are huge.
    let n = 10;
    let a = DMatrix::from_fn(n, n, |i, j| if i == j { -1.0 - 0.5 * i as f64 } else { 0.0 });
    let b = DMatrix::from_element(n, 1, 1.0);
    let wanted: Vec<Complex> = (0..n).map(|i| c(-50.0 - i as f64, 0.0)).collect();
    match place(&a, &b, &wanted) {
        Ok(placed) => assert!(placed.error > 1e-3 || placed.sensitivity > 1e-3),
        Err(why) => assert!(why.contains("ill-conditioned"), "{why}"),
    }
    // With four poles the same request is accepted, but sensitive.
    let (a, b) = (a.view((0, 0), (4, 4)).into_owned(), b.rows(0, 4).into_owned());
    let placed = place(&a, &b, &wanted[..4]).unwrap();
    assert!(placed.error < 10.0 && placed.sensitivity > 1.0, "{} {}", placed.error, placed.sensitivity);
}

/// Checks the characteristic polynomial in 30 digits and the reported distance of the poles.
fn check(a: &DMatrix<f64>, b: &DMatrix<f64>, poles: &[Complex]) -> Result<(), TestCaseError> {
    let placed = match place(a, b, poles) {
        Ok(placed) => placed,
        Err(why) => return Err(TestCaseError::fail(format!("{why}: {a} {b} {poles:?}"))),
    };
    let error = error_of_polynomial(a, b, &placed.k, poles);
    let closed = reference::minus(
        &reference::exactly(a),
        &reference::times(&reference::exactly(b), &reference::exactly(&placed.k)),
    );
    let exact = reference::roots(&reference::characteristic(&closed));
    let far = distance(&exact, poles, |_| 1.0);
    prop_assert!(error < 1e-7, "{} {} {} {:?} {}", error, a, b, poles, placed.k);
    // The reference has 30 digits; a multiple root keeps only a fraction of them.
    let copies = poles.iter().map(|p| poles.iter().filter(|q| *q == p).count()).max().unwrap_or(1);
    prop_assert!(
        far <= 10.0 * placed.error + 100.0 * math::powf(1e-29, 1.0 / copies as f64) + 1e-10,
        "{} {} {:?}",
        far,
        placed.error,
        poles
    );
    Ok(())
}

/// Returns random poles with their conjugates, some of them repeated.
fn random_poles(n: usize, seed: u64, repeats: f64) -> Vec<Complex> {
    let mut stream = stream(seed, "poles");
    let mut poles: Vec<Complex> = Vec::new();
    while poles.len() < n {
        let again = !poles.is_empty() && stream.random_bool(repeats);
        let z = if again {
            poles[stream.random_range(0..poles.len())]
        } else if stream.random_bool(0.4) {
            c(stream.random_range(-4.0..-0.5), stream.random_range(0.3..4.0))
        } else {
            c(stream.random_range(-5.0..-0.5), 0.0)
        };
        if z.im == 0.0 {
            poles.push(z);
        } else if poles.len() + 2 <= n {
            poles.extend([z, z.conj()]);
        }
    }
    poles
}

proptest! {
    #![proptest_config(mops_tiers::property(2_000))]

    #[test]
    fn random_systems_get_the_poles_asked_for_repeated_ones_too(
        n in 1usize..7, inputs in 1usize..4, seed in 0u64..1_000_000_000, repeats in 0.0f64..0.9,
    ) {
        let (a, b) = (random(n, n, seed) * 2.0, random(n, inputs, seed + 1));
        check(&a, &b, &random_poles(n, seed, repeats))?;
    }

    #[test]
    fn chains_in_other_coordinates_get_the_poles_asked_for(
        first in 1usize..5, second in 1usize..4, seed in 0u64..1_000_000_000, repeats in 0.3f64..0.9,
    ) {
        // Two chains of integrators that act on each other: the controllability indices are their lengths.
        let n = first + second;
        let mut a = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(j == i + 1 && i + 1 != first)));
        let mut b = DMatrix::zeros(n, 2);
        (b[(first - 1, 0)], b[(n - 1, 1)]) = (1.0, 1.0);
        let noise = random(n, n, seed);
        a.row_mut(first - 1).copy_from(&noise.row(0));
        a.row_mut(n - 1).copy_from(&noise.row(n - 1));
        let turn = random(n, n, seed + 2).qr().q();
        check(&(&turn * a * turn.transpose()), &(&turn * b), &random_poles(n, seed, repeats))?;
    }
}
