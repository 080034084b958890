use mops_math as math;
use mops_math::{complex, stream};
use nalgebra::DMatrix;
use proptest::prelude::*;
use rand::Rng;

use super::*;
use crate::components::block;
use crate::reference;
use crate::testing::{assert_same_set, c, random};

#[test]
fn eigenvalues_of_a_companion_matrix_are_the_roots_of_its_polynomial() {
    // (s + 1)(s + 2)(s^2 + 2 s + 10).
    let a = DMatrix::from_row_slice(4, 4, &[-5., -18., -34., -20., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.]);
    let roots = eigenvalues(&a).unwrap();
    assert_same_set(&roots, &[c(-1., 0.), c(-2., 0.), c(-1., 3.), c(-1., -3.)], 1e-12);
    assert_eq!(roots.iter().filter(|z| z.im != 0.0).map(|z| z.im).sum::<f64>(), 0.0, "pairs are exact");
}

#[test]
fn a_badly_scaled_matrix_is_balanced_first() {
    // A similarity transformation of [[1, 2], [3, 4]] by 1e8.
    let a = DMatrix::from_row_slice(2, 2, &[1.0, 2e8, 3e-8, 4.0]);
    let exact = (33.0f64).sqrt();
    assert_same_set(&eigenvalues(&a).unwrap(), &[c(2.5 - 0.5 * exact, 0.), c(2.5 + 0.5 * exact, 0.)], 1e-14);
}

#[test]
fn sums_and_products_of_eigenvalues_are_trace_and_determinant() {
    for n in 1..=12 {
        let a = random(n, n, n as u64);
        let roots = eigenvalues(&a).unwrap();
        assert_eq!(roots.len(), n);
        let (sum, product) = (roots.iter().sum::<Complex>(), roots.iter().product::<Complex>());
        assert!(complex::norm(sum - a.trace()) < 1e-12 * n as f64, "{n}: {sum} {}", a.trace());
        assert!(complex::norm(product - a.determinant()) < 1e-11 * (1.0 + complex::norm(product)), "{n}");
    }
}

#[test]
fn cyclic_shifts_and_zero_matrices_converge() {
    // Eigenvalues of a cyclic shift are the roots of unity, on which plain QR steps stagnate.
    let n = 6;
    let a = DMatrix::from_fn(n, n, |i, j| if (i + 1) % n == j { 1.0 } else { 0.0 });
    let exact: Vec<Complex> =
        (0..n).map(|k| complex::from_polar(1.0, std::f64::consts::TAU * k as f64 / n as f64)).collect();
    assert_same_set(&eigenvalues(&a).unwrap(), &exact, 1e-13);
    assert!(eigenvalues(&DMatrix::zeros(3, 3)).unwrap().iter().all(|z| complex::norm(*z) == 0.0));
    assert!(eigenvalues(&DMatrix::from_element(1, 1, f64::NAN)).is_err());
}

#[test]
fn poles_of_chains_are_exact() {
    // A crane: four carts that roll freely and one on a spring, coupled in one direction.
    let axes = 5;
    let mut a = DMatrix::zeros(2 * axes, 2 * axes);
    for i in 0..axes {
        a[(i, axes + i)] = 1.0;
        if i > 0 {
            a[(axes + i, i - 1)] = 3.0 + i as f64;
        }
    }
    a[(axes, 0)] = -4.0;
    let roots = eigenvalues(&a).unwrap();
    assert_eq!(roots.iter().filter(|z| complex::norm(**z) == 0.0).count(), 8, "{roots:?}");
    assert_same_set(&roots[..2], &[c(0.0, 2.0), c(0.0, -2.0)], 1e-15);
    // Three equal lags in series.
    let lags = DMatrix::from_row_slice(3, 3, &[-0.7, 0.0, 0.0, 1.0, -0.7, 0.0, 0.0, 1.0, -0.7]);
    assert_eq!(eigenvalues(&lags).unwrap(), [c(-0.7, 0.0); 3]);
}

#[test]
fn eigenvalues_that_rounding_alone_keeps_off_the_axis_are_named() {
    // Poles on the axis, hidden by a change of coordinates: rounding moves the computed ones off it.
    let hidden = |j: &DMatrix<f64>| {
        let (p, inverse) = unimodular(j.nrows(), 3);
        &p * j * inverse
    };
    let undamped = hidden(&DMatrix::from_row_slice(3, 3, &[0.0, 2.0, 0.0, -2.0, 0.0, 0.0, 0.0, 0.0, -1.0]));
    assert_eq!(undecided(&undamped).unwrap().len(), 2);
    // A small pole is not an uncertain one.
    let slow = DMatrix::from_row_slice(2, 2, &[-1.0, 1.0, 1.0, -1.000_001]);
    assert!(undecided(&slow).unwrap().is_empty());
    assert!(undecided(&DMatrix::from_element(1, 1, 1e-300)).unwrap().is_empty());
}

#[test]
fn poles_at_zero_are_exact_whatever_the_coordinates() {
    // A double pole at 0; two free bodies on springs, one of them of several masses.
    let double = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
    let (p, inverse) = unimodular(3, 3);
    let zeros = |a: &DMatrix<f64>| eigenvalues(a).unwrap().into_iter().filter(|z| complex::norm(*z) == 0.0).count();
    assert_eq!(zeros(&(p * double * inverse)), 2);
    let mut stream = stream(5, "free masses");
    for masses in 2..=6 {
        for _ in 0..20 {
            let mut of = |low: f64, high: f64| math::powf(10.0, stream.random_range(low..high));
            let mass: Vec<f64> = (0..masses).map(|_| of(-3.0, 3.0)).collect();
            let mut a = DMatrix::zeros(2 * masses, 2 * masses);
            for i in 0..masses {
                a[(i, masses + i)] = 1.0;
            }
            for i in 1..masses {
                let (spring, damper) = (of(0.0, 6.0), of(-2.0, 2.0));
                for (k, l) in [(i - 1, i), (i, i - 1)] {
                    for (offset, factor) in [(0, spring), (masses, damper)] {
                        a[(masses + k, offset + k)] -= factor / mass[k];
                        a[(masses + k, offset + l)] += factor / mass[k];
                    }
                }
            }
            assert_eq!(zeros(&a), 2, "{a}");
            // A spring to the ground with 1e-6 of the other stiffnesses fixes the body: no pole is 0.
            a[(masses, 0)] -= 1.0 / mass[0];
            assert_eq!(zeros(&a), 0, "{a}");
        }
    }
}

/// Returns an integer matrix with determinant 1 and its inverse, both exact: the product of a lower and an upper
/// triangular matrix.
fn unimodular(n: usize, seed: u64) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut stream = stream(seed, "unimodular");
    let mut triangle = |lower: bool| {
        DMatrix::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Equal => 1.0,
            order if (order == std::cmp::Ordering::Greater) == lower => f64::from(stream.random_range(-1..=1)),
            _ => 0.0,
        })
    };
    let (l, u) = (triangle(true), triangle(false));
    // Columns of the inverses by substitution, in integers.
    let solve = |t: &DMatrix<f64>, lower: bool| {
        let mut x = DMatrix::<f64>::identity(n, n);
        for column in 0..n {
            let order: Vec<usize> = if lower { (0..n).collect() } else { (0..n).rev().collect() };
            for &i in &order {
                let sum: f64 = (0..n).filter(|&k| k != i).map(|k| t[(i, k)] * x[(k, column)]).sum();
                x[(i, column)] = f64::from(u8::from(i == column)) - sum;
                if (lower && i < column) || (!lower && i > column) {
                    x[(i, column)] = 0.0;
                }
            }
        }
        x
    };
    let inverse = solve(&u, false) * solve(&l, true);
    let p = l * u;
    assert_eq!(&p * &inverse, DMatrix::identity(n, n), "both are exact");
    (p, inverse)
}

/// Hard matrix, its exact eigenvalues, and the size of the largest Jordan block.
struct Hard {
    a: DMatrix<f64>,
    exact: Vec<Complex>,
    block: usize,
}

/// Returns a matrix of one of five kinds whose eigenvalues are known in closed form.
fn hard(kind: u8, n: usize, seed: u64) -> Hard {
    let mut stream = stream(seed, "hard");
    match kind {
        // Axes that move freely or on springs, coupled in one direction, in a random order of the states.
        0 => {
            let axes = n.div_ceil(2);
            let mut a = DMatrix::zeros(2 * axes, 2 * axes);
            let mut exact = Vec::new();
            for i in 0..axes {
                let stiffness = if stream.random_bool(0.5) { f64::from(stream.random_range(1..50)) } else { 0.0 };
                a[(i, axes + i)] = 1.0;
                a[(axes + i, i)] = -stiffness;
                let omega = f64::sqrt(stiffness);
                exact.extend([c(0.0, omega), c(0.0, -omega)]);
                for j in 0..i {
                    if stream.random_bool(0.4) {
                        a[(axes + i, j)] = f64::from(stream.random_range(-99..99));
                        a[(axes + i, axes + j)] = f64::from(stream.random_range(-9..9));
                    }
                }
            }
            Hard { a: shuffled(&a, seed), exact, block: 1 }
        }
        // One Jordan block and simple eigenvalues, in other coordinates.
        1 => {
            let block = 1 + n / 3;
            let root = f64::from(stream.random_range(-3..=3));
            let diagonal = |i: usize| if i < block { root } else { root - 2.0 - i as f64 };
            let j = DMatrix::from_fn(n, n, |i, j| match () {
                () if i == j => diagonal(i),
                () if j == i + 1 && j < block => 1.0,
                () => 0.0,
            });
            let (p, inverse) = unimodular(n, seed);
            Hard { a: &p * j * inverse, exact: (0..n).map(|i| c(diagonal(i), 0.0)).collect(), block }
        }
        // Graded and badly scaled: simple eigenvalues of magnitudes 2^-30 to 2^30, states in units of equal spread.
        2 => {
            let diagonal: Vec<f64> = (0..n).map(|i| math::exp2(f64::from(4 * i as i32 - 2 * n as i32)) * 3.0).collect();
            let mut t = DMatrix::from_fn(n, n, |i, j| match () {
                () if i == j => diagonal[i],
                () if j > i => stream.random_range(-1.0..1.0) * diagonal[i].min(diagonal[j]),
                () => 0.0,
            });
            for i in 0..n {
                let unit = math::exp2(f64::from(stream.random_range(-30..30)));
                t.row_mut(i).scale_mut(unit);
                t.column_mut(i).unscale_mut(unit);
            }
            Hard { a: shuffled(&t, seed), exact: diagonal.into_iter().map(|d| c(d, 0.0)).collect(), block: 1 }
        }
        // A circulant with zeros on the diagonal, in other units.
        3 => {
            let first: Vec<f64> =
                (0..n).map(|k| if k == 0 { 0.0 } else { f64::from(stream.random_range(-2..=2)) }).collect();
            let turn = |k: usize| complex::from_polar(1.0, std::f64::consts::TAU * k as f64 / n as f64);
            let exact = (0..n).map(|k| (0..n).map(|j| turn(j * k % n) * first[j]).sum()).collect();
            let mut a = DMatrix::from_fn(n, n, |i, j| first[(j + n - i) % n]);
            for i in 0..n {
                let unit = math::exp2(f64::from(stream.random_range(-20..20)));
                a.row_mut(i).scale_mut(unit);
                a.column_mut(i).unscale_mut(unit);
            }
            Hard { a, exact, block: 1 }
        }
        // Nilpotent in other coordinates: every eigenvalue is 0, and the diagonal has no zeros.
        _ => {
            let j = DMatrix::from_fn(n, n, |i, j| if j == i + 1 && i % 3 != 2 { 1.0 } else { 0.0 });
            let (p, inverse) = unimodular(n, seed);
            Hard { a: &p * j * inverse, exact: vec![c(0.0, 0.0); n], block: 3.min(n) }
        }
    }
}

/// Returns the system with its states in random order.
fn shuffled(a: &DMatrix<f64>, seed: u64) -> DMatrix<f64> {
    let mut stream = stream(seed, "order");
    let mut order: Vec<usize> = (0..a.nrows()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, stream.random_range(0..=i));
    }
    block(a, &order)
}

#[test]
fn every_eigenvalue_of_two_hundred_hard_matrices_is_found() {
    for case in 0..200u64 {
        let (kind, n) = ((case % 5) as u8, 3 + (case as usize / 5) % 10);
        let Hard { a, exact, block } = hard(kind, n, case);
        let found = eigenvalues(&a).unwrap_or_else(|why| panic!("{case}: {why}"));
        // Close or defective eigenvalues move by the root of the rounding error.
        for z in &exact {
            let size = if kind == 2 {
                complex::norm(*z)
            } else {
                a.norm().min(exact.iter().map(|z| complex::norm(*z)).fold(1.0, f64::max))
            };
            let sensitivity = if matches!(kind, 1 | 4) { a.norm() } else { 1.0 };
            let error = math::powf(1e-13 * sensitivity * sensitivity, 1.0 / block as f64)
                * size.max(f64::from(u8::from(kind != 2)));
            let here = |list: &[Complex], radius: f64| list.iter().filter(|w| complex::norm(*w - z) <= radius).count();
            let expected = here(&exact, 0.0);
            assert!(here(&found, error) >= expected, "{case}, kind {kind}: {z} of {exact:?}, not in {found:?}");
        }
        assert_eq!(found.len(), exact.len());
        let pairs: f64 = found.iter().map(|z| z.im).sum();
        assert_eq!(pairs, 0.0, "{case}: pairs are exact");
    }
}

proptest! {
    #![proptest_config(mops_tiers::property(2_000))]

    #[test]
    fn eigenvalues_agree_with_roots_of_the_characteristic_polynomial_in_thirty_digits(
        n in 1usize..9, seed in 0u64..1_000_000_000, zeros in 0.0f64..0.8, decades in 0.0f64..8.0,
    ) {
        let mut stream = stream(seed, "sparse");
        let mut a = DMatrix::from_fn(n, n, |_, _| {
            if stream.random_bool(zeros) { 0.0 } else { stream.random_range(-1.0..1.0) }
        });
        for i in 0..n {
            let unit = math::exp2((stream.random_range(-0.5..0.5) * decades * 3.3f64).round());
            a.row_mut(i).scale_mut(unit);
            a.column_mut(i).unscale_mut(unit);
        }
        let (found, exact) = (eigenvalues(&a).unwrap(), reference::eigenvalues(&a));
        prop_assert_eq!(found.len(), n);
        for z in &exact {
            let nearest = found.iter().map(|w| complex::norm(w - z)).fold(f64::INFINITY, f64::min);
            // Near a multiple eigenvalue the error is the root of the rounding error, in coordinates of magnitude 1.
            let gap = exact.iter().filter(|w| *w != z).map(|w| complex::norm(w - z)).fold(1.0, f64::min);
            let multiplicity = exact.iter().filter(|w| complex::norm(*w - z) < 1e-3).count() as f64;
            let error = if gap > 1e-3 { 1e-11 / (gap * gap) } else { math::powf(1e-12, 1.0 / multiplicity) };
            prop_assert!(nearest <= error, "{} is {} from {:?}", z, nearest, found);
        }
    }
}
