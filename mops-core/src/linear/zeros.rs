//! Zeros of a linear system.

use nalgebra::{ComplexField, DMatrix};

use super::eigen::{balancing_factor, eigenvalues};
use super::{Complex, StateSpace};
use crate::math;

/// Magnitude below which an entry counts as zero, relative to the norm of the balanced system.
const SMALL: f64 = 1e-13;

/// System matrices during the reduction to fewer states.
struct Quadruple {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

/// Returns the zeros of a system, 1/s: numbers s at which `[A - s, B; C, D]` has less than its normal rank.
///
/// With one input and one output these are the zeros of the transfer function before cancellation. The delay has no
/// influence. Orthogonal transformations reduce the system to one with an invertible `D`; the remainder is an
/// eigenvalue problem.
///
/// Source: A. Emami-Naeini, P. Van Dooren, Computation of zeros of linear multivariable systems, Automatica 18 (1982)
/// 415-430.
///
/// # Errors
/// If an entry is not finite.
pub fn zeros(system: &StateSpace) -> Result<Vec<Complex>, String> {
    let StateSpace { a, b, c, d, .. } = system;
    if [a, b, c, d].iter().any(|m| m.iter().any(|x| !x.is_finite())) {
        return Err("a system with an entry that is not finite has no zeros".to_owned());
    }
    let balanced = Quadruple { a: a.clone(), b: b.clone(), c: c.clone(), d: d.clone() }.balanced();
    let small = SMALL * (balanced.a.norm() + balanced.b.norm() + balanced.c.norm() + balanced.d.norm());
    let Quadruple { a, b, c, d } = balanced.reduced(small).transposed().reduced(small).transposed();
    if a.nrows() == 0 || d.is_empty() {
        return eigenvalues(&a);
    }
    // [A - s, B; C, D] with D square and invertible: column combinations transform [C, D] to [0, D'].
    let (n, m) = (a.nrows(), d.nrows());
    let mut lower = DMatrix::zeros(n + m, m);
    lower.rows_mut(0, n).copy_from(&c.transpose());
    lower.rows_mut(n, m).copy_from(&d.transpose());
    let w = complement(&lower);
    let (w1, w2) = (w.rows(0, n).into_owned(), w.rows(n, m).into_owned());
    let left = &a * &w1 + &b * w2;
    match w1.lu().solve(&left) {
        Some(quotient) => eigenvalues(&quotient),
        None => Err("the zeros were not found: the system is singular".to_owned()),
    }
}

/// Returns orthonormal columns that complete those of `m` to a basis; `m` has full column rank.
pub(super) fn complement<T: ComplexField>(m: &DMatrix<T>) -> DMatrix<T> {
    let (rows, columns) = m.shape();
    let mut square = DMatrix::<T>::zeros(rows, rows);
    square.columns_mut(0, columns).copy_from(m);
    // Factor Q of the padded matrix: zero columns have trivial reflections.
    square.qr().q().columns(columns, rows - columns).into_owned()
}

impl Quadruple {
    /// Scales states, inputs and outputs by powers of two, so that the entries have similar magnitude.
    fn balanced(mut self) -> Self {
        for _ in 0..50 {
            let mut changed = false;
            for i in 0..self.a.nrows() {
                let own = self.a[(i, i)].abs();
                let column = self.a.column(i).lp_norm(1) - own + self.c.column(i).lp_norm(1);
                let row = self.a.row(i).lp_norm(1) - own + self.b.row(i).lp_norm(1);
                let factor = balancing_factor(row, column);
                if factor != 1.0 {
                    changed = true;
                    self.a.row_mut(i).unscale_mut(factor);
                    self.b.row_mut(i).unscale_mut(factor);
                    self.a.column_mut(i).scale_mut(factor);
                    self.c.column_mut(i).scale_mut(factor);
                }
            }
            if !changed {
                break;
            }
        }
        // Scaling of inputs and outputs does not move zeros; both are scaled to the magnitude of A.
        let size = if self.a.norm() > 0.0 { self.a.norm() } else { 1.0 };
        let power = |norm: f64| if norm > 0.0 { math::exp2(math::log2(size / norm).round()) } else { 1.0 };
        let (input, output) = (power(self.b.norm()), power(self.c.norm()));
        self.b *= input;
        self.c *= output;
        self.d *= input * output;
        self
    }

    fn transposed(self) -> Self {
        Self { a: self.a.transpose(), b: self.c.transpose(), c: self.b.transpose(), d: self.d.transpose() }
    }

    /// Removes states until `D` has full row rank: those that a vanishing output forces to zero.
    fn reduced(mut self, small: f64) -> Self {
        loop {
            let Self { a, b, c, d } = self;
            let (n, outputs) = (a.nrows(), c.nrows());
            if outputs == 0 {
                return Self { a, b, c, d };
            }
            // Step 1: independent rows of D, and rows that vanish.
            let (u, rank) = row_compression(&d, small);
            let (c, d) = (&u * c, &u * d);
            if rank == outputs {
                return Self { a, b, c, d };
            }
            let (upper_c, upper_d) = (c.rows(0, rank).into_owned(), d.rows(0, rank).into_owned());
            let lower = c.rows(rank, outputs - rank).into_owned();
            // Step 2: the states observed by these rows of C, moved to the end.
            let (v, seen) = row_compression(&lower.transpose(), small);
            if seen == 0 {
                return Self { a, b, c: upper_c, d: upper_d };
            }
            let v = DMatrix::from_fn(n, n, |i, j| v[((i + seen) % n, j)]);
            let (a, b, upper_c) = (&v * a * v.transpose(), &v * b, upper_c * v.transpose());
            let left = n - seen;
            // Step 3: these states and their derivatives are zero, which gives new outputs.
            self = Self {
                a: a.view((0, 0), (left, left)).into_owned(),
                b: b.rows(0, left).into_owned(),
                c: super::system::above(
                    &upper_c.columns(0, left).into_owned(),
                    &a.view((left, 0), (seen, left)).into_owned(),
                ),
                d: super::system::above(&upper_d, &b.rows(left, seen).into_owned()),
            };
        }
    }
}

/// Returns an orthogonal matrix whose product with `m` has the independent rows first and zero rows after them, and the
/// rank.
fn row_compression(m: &DMatrix<f64>, small: f64) -> (DMatrix<f64>, usize) {
    let n = m.nrows();
    if m.is_empty() {
        return (DMatrix::identity(n, n), 0);
    }
    // Padded to a square matrix, so that the left singular vectors form a complete basis.
    let mut square = DMatrix::zeros(n, n.max(m.ncols()));
    square.columns_mut(0, m.ncols()).copy_from(m);
    let svd = square.svd(true, false);
    let rank = svd.singular_values.iter().filter(|&&s| s > small).count();
    (svd.u.expect("the SVD computes U").transpose(), rank)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;
    use crate::linear::testing::{assert_same_set, c, random};
    use crate::math::complex;

    #[test]
    fn zeros_of_a_transfer_function_are_the_roots_of_its_numerator() {
        // (s^2 + 2 s + 5)(s - 3) over a denominator of order 5.
        let g = TransferFunction::new(vec![1.0, -1.0, -1.0, -15.0], vec![1.0, 15.0, 85.0, 225.0, 274.0, 120.0]);
        let system = g.state_space().unwrap();
        assert_same_set(&zeros(&system).unwrap(), &[c(3., 0.), c(-1., 2.), c(-1., -2.)], 1e-10);
    }

    #[test]
    fn with_a_direct_part_there_are_as_many_zeros_as_poles() {
        let g = TransferFunction::new(vec![1.0, 3.0, 2.0], vec![1.0, 7.0, 12.0]).state_space().unwrap();
        assert_same_set(&zeros(&g).unwrap(), &[c(-1., 0.), c(-2., 0.)], 1e-12);
    }

    #[test]
    fn a_hidden_mode_is_a_zero_and_a_pole() {
        // Two states, the second controllable but not observable.
        let system = StateSpace::new(
            DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, 0.0, -7.0]),
            DMatrix::from_row_slice(2, 1, &[1.0, 1.0]),
            DMatrix::from_row_slice(1, 2, &[1.0, 0.0]),
            DMatrix::zeros(1, 1),
        );
        assert_same_set(&zeros(&system).unwrap(), &[c(-7., 0.)], 1e-12);
    }

    #[test]
    fn the_system_loses_rank_at_each_zero_also_with_several_inputs_and_outputs() {
        let system = StateSpace::new(random(6, 6, 1), random(6, 2, 2), random(2, 6, 3), DMatrix::zeros(2, 2));
        let found = zeros(&system).unwrap();
        assert_eq!(found.len(), 4, "{found:?}");
        for zero in found {
            let response = system.response().unwrap().at(zero);
            assert!(complex::norm(response.determinant()) < 1e-10, "{zero} {response}");
        }
    }

    #[test]
    fn the_cart_with_a_badly_scaled_input_has_its_zeros() {
        // The linear pendulum of the thesis (section 5.2), from torque to arm angle: s^2 + 0.0458 s - 45.7597 plus the
        // coupling. Derived by hand: b2 (s^2 - a44 s - a43) + b4 (a23 + a24 s).
        let (a, b) = crate::linear::testing::furuta();
        let out = DMatrix::from_row_slice(1, 4, &[1.0, 0.0, 0.0, 0.0]);
        let system = StateSpace::new(a, b, out, DMatrix::zeros(1, 1));
        let (p, q) = (0.0458 - 1008.5 * 0.0255 / 1444.1, -45.7597 + 1008.5 * 25.4814 / 1444.1);
        let root = (0.25 * p * p - q).sqrt();
        assert_same_set(&zeros(&system).unwrap(), &[c(-0.5 * p + root, 0.0), c(-0.5 * p - root, 0.0)], 1e-11);
    }
}
