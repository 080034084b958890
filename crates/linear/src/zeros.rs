//! Zeros of a linear system.

use mops_math as math;
use nalgebra::DMatrix;

use super::eigen::{balancing_factor, eigenvalues_of};
use super::extended::{Entry, Extended, Real, extended, product, solved, sum};
use super::qr_steps::reflection;
use super::system::above;
use super::{Complex, StateSpace};

/// Relative rounding error of the given entries, up to which their sums count as zero: some tens of the standard
/// deviation of a rounding, which is `2^-53/sqrt(3)`.
const GIVEN: f64 = 1e-14;

/// Relative error of the computation itself, up to which sums of numbers that count as exact are zero: some hundred
/// roundings.
const COMPUTED: f64 = 100.0 * <Extended as Entry>::EPSILON;

/// Matrix with twice the digits.
type Matrix = DMatrix<Extended>;

/// Matrix with the squares of the errors that the rounding of the given entries causes in its own. The errors are
/// independent, so that the squares add up.
#[derive(Clone)]
struct Known {
    entries: Matrix,
    squares: DMatrix<f64>,
}

impl Known {
    /// Wraps a given matrix, with this relative error of its entries.
    fn given(m: &DMatrix<f64>, rounding: f64) -> Self {
        Self { entries: extended(m), squares: m.map(|x| rounding * x * rounding * x) }
    }

    fn map(&self, entries: impl Fn(&Matrix) -> Matrix, squares: impl Fn(&DMatrix<f64>) -> DMatrix<f64>) -> Self {
        Self { entries: entries(&self.entries), squares: squares(&self.squares) }
    }

    fn transposed(&self) -> Self {
        self.map(DMatrix::transpose, DMatrix::transpose)
    }

    fn part(&self, (row, column): (usize, usize), (rows, columns): (usize, usize)) -> Self {
        let (from, size) = ((row, column), (rows, columns));
        self.map(|m| m.view(from, size).into_owned(), |m| m.view(from, size).into_owned())
    }

    fn above(&self, other: &Self) -> Self {
        Self { entries: above(&self.entries, &other.entries), squares: above(&self.squares, &other.squares) }
    }

    /// Reflects the columns of the matrix.
    fn reflect(&mut self, by: &Reflection) {
        let Reflection { first, v, factor } = by;
        for j in 0..self.entries.ncols() {
            let along =
                v.iter().enumerate().fold(Extended::ZERO, |sum, (i, v)| sum + *v * self.entries[(first + i, j)]);
            let along = *factor * along;
            v.iter().enumerate().for_each(|(i, v)| self.entries[(first + i, j)] -= *v * along);
            // The squares of the entries of the reflection.
            let squared = |i: usize| v[i].value() * v[i].value();
            let all: f64 = (0..v.len()).map(|i| squared(i) * self.squares[(first + i, j)]).sum();
            for i in 0..v.len() {
                let (own, f) = (self.squares[(first + i, j)], factor.value());
                let kept = 1.0 - f * squared(i);
                let others = (all - squared(i) * own).max(0.0);
                self.squares[(first + i, j)] = kept * kept * own + f * f * squared(i) * others;
            }
        }
    }

    /// Reflects the rows of the matrix.
    fn reflect_rows(&mut self, by: &Reflection) {
        let mut turned = self.transposed();
        turned.reflect(by);
        *self = turned.transposed();
    }
}

/// Reflection `1 - factor v v^T` of the entries from the first one on.
struct Reflection {
    first: usize,
    v: Vec<Extended>,
    factor: Extended,
}

/// System matrices during the reduction to fewer states.
struct Quadruple {
    a: Known,
    b: Known,
    c: Known,
    d: Known,
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
    zeros_up_to(system, GIVEN)
}

/// Returns the zeros of the given numbers as they stand, also those that only their rounding causes, far above all
/// poles. See [`zeros`].
///
/// # Errors
/// See [`zeros`].
pub(super) fn zeros_as_given(system: &StateSpace) -> Result<Vec<Complex>, String> {
    zeros_up_to(system, COMPUTED)
}

fn zeros_up_to(system: &StateSpace, rounding: f64) -> Result<Vec<Complex>, String> {
    let StateSpace { a, b, c, d, .. } = system;
    if [a, b, c, d].iter().any(|m| m.iter().any(|x| !x.is_finite())) {
        return Err("a system with an entry that is not finite has no zeros".to_owned());
    }
    let [a, b, c, d] = balanced([a, b, c, d].map(DMatrix::clone)).map(|m| Known::given(&m, rounding));
    let Quadruple { a, b, c, d } = Quadruple { a, b, c, d }.reduced().transposed().reduced().transposed();
    let [a, b, c, d] = [a, b, c, d].map(|known| known.entries);
    if a.nrows() == 0 || d.is_empty() {
        return eigenvalues_of(&a, Extended::EPSILON);
    }
    // [A - s, B; C, D] with D square and invertible: the zeros are the poles of the inverse system.
    match solved(d, c) {
        Some(quotient) => eigenvalues_of(&sum(&a, &product(&b, &quotient).map(|x| -x)), Extended::EPSILON),
        None => Err("the zeros were not found: the system is singular".to_owned()),
    }
}

/// Scales states, inputs and outputs by powers of two, so that the entries have similar magnitude.
fn balanced([mut a, mut b, mut c, mut d]: [DMatrix<f64>; 4]) -> [DMatrix<f64>; 4] {
    for _ in 0..50 {
        let mut changed = false;
        for i in 0..a.nrows() {
            let own = a[(i, i)].abs();
            let column = a.column(i).lp_norm(1) - own + c.column(i).lp_norm(1);
            let row = a.row(i).lp_norm(1) - own + b.row(i).lp_norm(1);
            let factor = balancing_factor(row, column);
            if factor != 1.0 {
                changed = true;
                a.row_mut(i).unscale_mut(factor);
                b.row_mut(i).unscale_mut(factor);
                a.column_mut(i).scale_mut(factor);
                c.column_mut(i).scale_mut(factor);
            }
        }
        if !changed {
            break;
        }
    }
    // Scaling of inputs and outputs does not move zeros; both are scaled to the magnitude of A.
    let size = if a.norm() > 0.0 { a.norm() } else { 1.0 };
    let power = |norm: f64| if norm > 0.0 { math::exp2(math::log2(size / norm).round()) } else { 1.0 };
    let (input, output) = (power(b.norm()), power(c.norm()));
    b *= input;
    c *= output;
    d *= input * output;
    [a, b, c, d]
}

impl Quadruple {
    fn transposed(self) -> Self {
        Self { a: self.a.transposed(), b: self.c.transposed(), c: self.b.transposed(), d: self.d.transposed() }
    }

    /// Removes states until `D` has full row rank: those that a vanishing output forces to zero.
    fn reduced(mut self) -> Self {
        loop {
            let Self { mut a, mut b, mut c, mut d } = self;
            let (n, outputs, inputs) = (a.entries.nrows(), c.entries.nrows(), b.entries.ncols());
            if outputs == 0 {
                return Self { a, b, c, d };
            }
            // Step 1: independent rows of D, and rows that vanish.
            let independent = row_compression(&d);
            independent.iter().for_each(|by| {
                c.reflect(by);
                d.reflect(by);
            });
            let rank = independent.len();
            if rank == outputs {
                return Self { a, b, c, d };
            }
            let (mut upper_c, upper_d) = (c.part((0, 0), (rank, n)), d.part((0, 0), (rank, inputs)));
            // Step 2: the states observed by these rows of C, moved to the front.
            let observed = row_compression(&c.part((rank, 0), (outputs - rank, n)).transposed());
            let (seen, left) = (observed.len(), n - observed.len());
            if seen == 0 {
                return Self { a, b, c: upper_c, d: upper_d };
            }
            observed.iter().for_each(|by| {
                a.reflect(by);
                a.reflect_rows(by);
                b.reflect(by);
                upper_c.reflect_rows(by);
            });
            // Step 3: these states and their derivatives are zero, which gives new outputs.
            self = Self {
                a: a.part((seen, seen), (left, left)),
                b: b.part((seen, 0), (left, inputs)),
                c: upper_c.part((0, seen), (rank, left)).above(&a.part((0, seen), (seen, left))),
                d: upper_d.above(&b.part((0, 0), (seen, inputs))),
            };
        }
    }
}

/// Returns the reflections after which `m` has its independent rows first and rows that are zero up to the errors after
/// them; as many as its rank.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition (2013), section 5.4.2 (reflections with column
/// pivoting).
fn row_compression(m: &Known) -> Vec<Reflection> {
    let (mut m, n) = (m.clone(), m.entries.nrows());
    let mut found = Vec::new();
    while found.len() < n.min(m.entries.ncols()) {
        let first = found.len();
        let square = |i: usize, j: usize| m.entries[(i, j)].size() * m.entries[(i, j)].size();
        let is_zero = |j: usize| (first..n).all(|i| square(i, j) <= m.squares[(i, j)]);
        let size = |j: usize| (first..n).map(|i| square(i, j)).sum::<f64>();
        let candidates = (first..m.entries.ncols()).filter(|&j| !is_zero(j));
        let Some(largest) = candidates.max_by(|&j, &k| size(j).total_cmp(&size(k))) else { break };
        m.entries.swap_columns(first, largest);
        m.squares.swap_columns(first, largest);
        let mut v: Vec<Extended> = (first..n).map(|i| m.entries[(i, first)]).collect();
        let (_, factor) = reflection(&mut v);
        let by = Reflection { first, v, factor };
        m.reflect(&by);
        found.push(by);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;
    use crate::testing::{assert_same_set, c, random};
    use mops_math::complex;

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
        let (a, b) = crate::testing::furuta();
        let out = DMatrix::from_row_slice(1, 4, &[1.0, 0.0, 0.0, 0.0]);
        let system = StateSpace::new(a, b, out, DMatrix::zeros(1, 1));
        let (p, q) = (0.0458 - 1008.5 * 0.0255 / 1444.1, -45.7597 + 1008.5 * 25.4814 / 1444.1);
        let root = f64::sqrt(0.25 * p * p - q);
        assert_same_set(&zeros(&system).unwrap(), &[c(-0.5 * p + root, 0.0), c(-0.5 * p - root, 0.0)], 1e-11);
    }
}
