//! State feedback that gives the closed loop chosen poles.

use nalgebra::{DMatrix, DVector};

use super::system::beside;
use super::zeros::complement;
use super::{Complex, check_controllable};

/// The feedback `u = -K x` with which the eigenvalues of `A - B K` are `poles`, 1/s.
///
/// With one input `K` is unique; it is found by unitary deflation, one pole after the other, which stays accurate where
/// Ackermann's formula does not. With several inputs the freedom that is left goes into eigenvectors as independent as
/// possible, so that the poles hardly move with errors of the model.
///
/// Source: G. Miminis, C. C. Paige, An algorithm for pole assignment of time invariant linear systems, International
/// Journal of Control 35 (1982) 341-354; J. Kautsky, N. K. Nichols, P. Van Dooren, Robust pole assignment in linear state
/// feedback, ibid. 41 (1985) 1129-1155, method 0; for complex pairs A. L. Tits, Y. Yang, Globally convergent algorithms
/// for robust pole assignment by state feedback, IEEE Transactions on Automatic Control 41 (1996) 1432-1452.
///
/// # Errors
/// A number of poles other than that of the states; complex poles without their conjugates; modes that no input moves.
pub fn place(a: &DMatrix<f64>, b: &DMatrix<f64>, poles: &[Complex]) -> Result<DMatrix<f64>, String> {
    let n = a.nrows();
    if poles.len() != n {
        return Err(format!("{} poles are asked for, but the system has {n} states", poles.len()));
    }
    let finite = |matrix: &DMatrix<f64>| matrix.iter().all(|x| x.is_finite());
    if !finite(a) || !finite(b) || !poles.iter().all(|p| p.re.is_finite() && p.im.is_finite()) {
        return Err("the system and the poles must be finite".to_owned());
    }
    let poles = paired(poles)?;
    if n == 0 {
        return Ok(DMatrix::zeros(b.ncols(), 0));
    }
    check_controllable(a, b)?;
    let svd = b.clone().svd(true, true);
    let largest = svd.singular_values.max();
    let rank = svd.singular_values.iter().filter(|&&s| s > 1e-12 * largest).count();
    let most = poles.iter().map(|p| poles.iter().filter(|q| *q == p).count()).max().unwrap_or(0);
    if rank == 1 || most > rank {
        return deflated(a, b, &poles);
    }
    let range = svd.u.as_ref().expect("it was asked for").columns(0, rank).into_owned();
    let closed =
        robust(a, &range, &poles).ok_or("the poles cannot be placed: their eigenvectors depend on each other")?;
    let inverse = svd.pseudo_inverse(1e-12 * largest).map_err(str::to_owned)?;
    Ok(inverse * (a - closed))
}

/// Real poles first, then pairs with the upper one before its exact conjugate.
fn paired(poles: &[Complex]) -> Result<Vec<Complex>, String> {
    let mut sorted: Vec<Complex> = poles.iter().copied().filter(|p| p.im == 0.0).collect();
    let mut lower: Vec<Complex> = poles.iter().copied().filter(|p| p.im < 0.0).collect();
    for upper in poles.iter().filter(|p| p.im > 0.0) {
        let place = lower.iter().position(|p| (p.conj() - upper).norm() <= 1e-9 * upper.norm());
        match place {
            Some(place) => lower.swap_remove(place),
            None => return Err(format!("the pole at {upper} has no conjugate among the others")),
        };
        sorted.extend([*upper, upper.conj()]);
    }
    match lower.first() {
        Some(alone) => Err(format!("the pole at {alone} has no conjugate among the others")),
        None => Ok(sorted),
    }
}

/// Places one pole after the other: an eigenvector of the closed loop, then what is left on its complement.
fn deflated(a: &DMatrix<f64>, b: &DMatrix<f64>, poles: &[Complex]) -> Result<DMatrix<f64>, String> {
    let complex = |m: &DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
    let (n, inputs) = (a.nrows(), b.ncols());
    let (mut a, mut b) = (complex(a), complex(b));
    let mut basis = DMatrix::<Complex>::identity(n, n);
    let mut k = DMatrix::<Complex>::zeros(inputs, n);
    for &pole in poles {
        let left = a.nrows();
        // (A - pole) x = B v: all (x, v), of which the one with the smallest v is taken.
        let mut both = DMatrix::<Complex>::zeros(left, left + inputs);
        both.columns_mut(0, left).copy_from(&a);
        both.columns_mut(left, inputs).copy_from(&-&b);
        (0..left).for_each(|i| both[(i, i)] -= pole);
        let solutions = complement(&both.adjoint());
        let upper = solutions.rows(0, left).into_owned();
        let svd = upper.clone().svd(false, true);
        let best = svd.singular_values.imax();
        let weights = svd.v_t.expect("it was asked for").row(best).adjoint();
        let x: DVector<Complex> = upper * &weights;
        let v: DVector<Complex> = solutions.rows(left, inputs) * &weights;
        let norm = x.norm();
        let x = x / Complex::new(norm, 0.0);
        k += (v / Complex::new(norm, 0.0)) * (&basis * &x).adjoint();
        let rest = complement(&DMatrix::from_column_slice(left, 1, x.as_slice()));
        a = rest.adjoint() * a * &rest;
        b = rest.adjoint() * b;
        basis *= rest;
    }
    // One input leaves no choice, and a real one; several do, and complex eigenvectors need not come out in pairs.
    if k.iter().any(|z| z.im.abs() > 1e-8 * k.norm()) {
        return Err(
            "a pole is repeated more often than there are inputs, beside complex ones: move the repeated poles \
                    apart"
                .to_owned(),
        );
    }
    Ok(k.map(|z| z.re))
}

/// The closed loop `A - B K` with eigenvectors as independent as possible; `range` spans the columns of `B`.
fn robust(a: &DMatrix<f64>, range: &DMatrix<f64>, poles: &[Complex]) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let beyond = complement(range).map(|x| Complex::new(x, 0.0));
    // Eigenvectors to a pole are those that B can make so: the columns of its space.
    let leading: Vec<usize> = (0..n).filter(|&j| poles[j].im >= 0.0).collect();
    let space = |pole: Complex| {
        let shifted = a.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(n, n) * pole;
        complement(&(beyond.adjoint() * shifted).adjoint())
    };
    let spaces: Vec<DMatrix<Complex>> = leading.iter().map(|&j| space(poles[j])).collect();
    let mut x = DMatrix::<f64>::zeros(n, n);
    for (&j, space) in leading.iter().zip(&spaces) {
        let found = x.columns(0, j).into_owned();
        set(&mut x, j, poles[j], &first(space, &found));
    }
    let mut merit = x.determinant().abs();
    let mut best = (merit, x.clone());
    for _ in 0..100 {
        for (&j, space) in leading.iter().zip(&spaces) {
            let width = if poles[j].im == 0.0 { 1 } else { 2 };
            let others = beside(&x.columns(0, j).into_owned(), &x.columns(j + width, n - j - width).into_owned());
            set(&mut x, j, poles[j], &most_independent(space, &complement(&others)));
        }
        let next = x.determinant().abs();
        if next > best.0 {
            best = (next, x.clone());
        }
        if (next - merit).abs() <= 1e-8 * next {
            break;
        }
        merit = next;
    }
    let (x, mut modes) = (best.1, DMatrix::zeros(n, n));
    for &j in &leading {
        modes[(j, j)] = poles[j].re;
        if poles[j].im > 0.0 {
            modes[(j + 1, j + 1)] = poles[j].re;
            modes[(j, j + 1)] = poles[j].im;
            modes[(j + 1, j)] = -poles[j].im;
        }
    }
    let inverse = x.clone().try_inverse()?;
    let closed = x * modes * inverse;
    closed.iter().all(|z| z.is_finite()).then_some(closed)
}

/// A first eigenvector of the space, far from those found.
fn first(space: &DMatrix<Complex>, found: &DMatrix<f64>) -> DVector<Complex> {
    let rest = complement(found).map(|x| Complex::new(x, 0.0));
    let svd = (rest.adjoint() * space).svd(false, true);
    let v = svd.v_t.expect("it was asked for").adjoint();
    let second =
        if v.ncols() > 1 { v.column(1) * Complex::new(0.0, 0.5) } else { v.column(0) * Complex::new(0.0, 0.0) };
    space * (v.column(0) + second)
}

/// The vector of the space with which the determinant of all eigenvectors is largest: with its conjugate where the
/// `complement` of the others has two columns.
fn most_independent(space: &DMatrix<Complex>, complement: &DMatrix<f64>) -> DVector<Complex> {
    let y = complement.map(|x| Complex::new(x, 0.0));
    if y.ncols() == 1 {
        return space * (space.adjoint() * y.column(0));
    }
    let turn = (y.column(1) * y.column(0).adjoint() - y.column(0) * y.column(1).adjoint()) * Complex::i();
    let eigen = (space.adjoint() * turn * space).symmetric_eigen();
    space * eigen.eigenvectors.column(eigen.eigenvalues.iamax())
}

/// Puts an eigenvector in its place: its real part, and for a complex pole its imaginary part beside it.
fn set(x: &mut DMatrix<f64>, j: usize, pole: Complex, vector: &DVector<Complex>) {
    if pole.im == 0.0 {
        // The largest entry is made real, and with it all.
        let turn = vector[vector.icamax()];
        let real = (vector * (turn.conj() / turn.norm())).map(|z| z.re);
        x.set_column(j, &real.normalize());
    } else {
        let unit = vector / Complex::new(vector.norm(), 0.0);
        x.set_column(j, &unit.map(|z| z.re));
        x.set_column(j + 1, &unit.map(|z| z.im));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::testing::{assert_near, assert_same_set, c, furuta, random};
    use crate::linear::{TransferFunction, eigenvalues};

    #[test]
    fn the_pendulum_gets_the_feedback_of_the_thesis() {
        // Section 5.2 prints (-0.1387, -0.0690, -0.7345, -0.1354); further digits by SciPy 1.17.1, `place_poles`.
        let (a, b) = furuta();
        let k = place(&a, &b, &[-5.0, -8.0, -10.0, -14.0].map(|p| c(p, 0.0))).unwrap();
        for (found, expected) in k.iter().zip([-0.138_746_07, -0.068_978_83, -0.734_559_28, -0.135_415_5]) {
            assert_near(*found, expected, 5e-9);
        }
    }

    #[test]
    fn a_chain_of_integrators_gets_the_coefficients_of_its_polynomial_also_with_repeated_poles() {
        // Feedback of the companion form: the coefficients of (s + 1)^n, rising powers.
        let n = 10;
        let mut denominator = vec![0.0; n + 1];
        denominator[0] = 1.0;
        let chain = TransferFunction::new(vec![1.0], denominator).state_space().unwrap();
        let k = place(&chain.a, &chain.b, &vec![c(-1.0, 0.0); n]).unwrap();
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
        let k = place(&a, &b, &wanted).unwrap();
        assert_same_set(&eigenvalues(&(&a - &b * k)).unwrap(), &wanted, 1e-6);
    }

    #[test]
    fn with_several_inputs_the_poles_are_placed_and_hardly_move_with_the_model() {
        for (n, inputs, seed) in [(4, 2, 1), (6, 2, 2), (7, 3, 3), (5, 5, 4)] {
            let (a, b) = (random(n, n, seed), random(n, inputs, seed + 50));
            let mut wanted = vec![c(-1.0, 2.0), c(-1.0, -2.0), c(-2.0, 0.5), c(-2.0, -0.5)];
            wanted.extend((4..n).map(|i| c(-(i as f64) + 1.0, 0.0)));
            let k = place(&a, &b, &wanted).unwrap();
            assert_same_set(&eigenvalues(&(&a - &b * &k)).unwrap(), &wanted, 1e-9);
            // How far the poles move with the model, which is disturbed by a millionth.
            let disturbed = &a + random(n, n, seed + 90) * 1e-6;
            let moved = |k: &DMatrix<f64>| {
                let roots = eigenvalues(&(&disturbed - &b * k)).unwrap();
                let nearest = |z: &Complex| roots.iter().map(|root| (root - z).norm()).fold(f64::INFINITY, f64::min);
                wanted.iter().map(nearest).fold(0.0, f64::max)
            };
            assert!(moved(&k) < 2e-5, "{n} {inputs}: {}", moved(&k));
        }
    }

    #[test]
    fn eigenvectors_are_as_independent_as_those_of_another_implementation() {
        // Kautsky, Nichols, Van Dooren, example 1 (a chemical reactor). The condition of the eigenvectors by SciPy 1.17.1,
        // `place_poles`, is 4.28 with method KNV0 and 4.51 with YT.
        let a = [
            [1.38, -0.2077, 6.715, -5.676],
            [-0.5814, -4.29, 0.0, 0.675],
            [1.067, 4.273, -6.654, 5.893],
            [0.048, 4.273, 1.343, -2.104],
        ];
        let a = DMatrix::from_fn(4, 4, |i, j| a[i][j]);
        let b = DMatrix::from_row_slice(4, 2, &[0.0, 0.0, 5.679, 0.0, 1.136, -3.146, 1.136, 0.0]);
        let wanted = [-0.2, -0.5, -5.0566, -8.6659].map(|p| c(p, 0.0));
        let k = place(&a, &b, &wanted).unwrap();
        let closed = &a - &b * k;
        assert_same_set(&eigenvalues(&closed).unwrap(), &wanted, 1e-10);
        assert!(condition(&closed, &wanted) < 4.28, "{}", condition(&closed, &wanted));
    }

    /// Condition of the unit eigenvectors to real, simple eigenvalues.
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
        let k = place(&a, &b, &[c(-2.0, 0.0); 5]).unwrap();
        // A defective eigenvalue: its computed copies lie on a circle around it.
        assert!(eigenvalues(&(&a - &b * k)).unwrap().iter().all(|z| (z + 2.0).norm() < 0.02));
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
        let (a, b) = (random(5, 5, 8), random(5, 2, 9));
        let repeated = [c(-1.0, 0.0), c(-1.0, 0.0), c(-1.0, 0.0), c(-2.0, 1.0), c(-2.0, -1.0)];
        assert!(place(&a, &b, &repeated).unwrap_err().contains("repeated"));
    }
}
