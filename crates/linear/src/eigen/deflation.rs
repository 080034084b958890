//! Deflation of eigenvalues that are exactly 0 because rows of a matrix depend on one another: free bodies and
//! integrators.
//!
//! QR steps find a simple zero eigenvalue to rounding, `eps |A|`. They find the double one of a free body only to the
//! square root of that, on either side of the imaginary axis. Running error bounds decide whether a number is 0.
//!
//! Source (running error analysis): N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd edition (2002),
//! section 3.3.

use mops_math as math;
use nalgebra::DMatrix;

use crate::components::block;
use crate::extended::Real;

/// Number of roundings assumed in the given entries, which are computed from parameters in a few operations.
const ROUNDINGS: f64 = 4.0;

/// Ratio of an error bound to the terms above which the bound decides nothing, because bounds grow faster than errors.
///
/// The value is the square root of the machine precision, to which QR steps find double eigenvalues.
const CLEAR: f64 = 1e-8;

/// Matrix whose entries are known up to rounding.
#[derive(Debug, Clone)]
pub(super) struct Rounded<T: Real> {
    pub entries: DMatrix<T>,
    /// Bounds of the absolute errors of the entries.
    pub errors: DMatrix<f64>,
}

impl<T: Real> Rounded<T> {
    /// Wraps a given matrix, assuming a few roundings per entry of this relative size.
    pub fn given(entries: DMatrix<T>, rounding: f64) -> Self {
        let errors = entries.map(|x| ROUNDINGS * rounding * x.size());
        Self { entries, errors }
    }

    /// Returns the rows and columns with these indices.
    pub fn block(&self, indices: &[usize]) -> Self {
        Self { entries: block(&self.entries, indices), errors: block(&self.errors, indices) }
    }

    /// Returns the product with a power of two.
    pub fn scaled(&self, power: f64) -> Self {
        Self { entries: self.entries.map(|x| x.scaled(power)), errors: &self.errors * power }
    }

    /// Returns a matrix with the same eigenvalues except one zero, or `None` if the rows are independent.
    ///
    /// A combination `z = y'x` of the states has a zero rate if `y'A = 0`. It replaces the state with the largest
    /// share. The other states then have the rates of `A` with that state substituted.
    pub fn without_zero(&self) -> Option<Self> {
        let n = self.entries.nrows();
        let (y, dy) = Elimination::of(self).dependency()?;
        let out = (0..n).fold(0, |best, i| if y[i].size() > y[best].size() { i } else { best });
        let kept = |i: usize| if i < out { i } else { i + 1 };
        let share = |j: usize| y[kept(j)] / y[out];
        let doubt = |j: usize| (dy[kept(j)] + share(j).size() * dy[out]) / y[out].size();
        let entries = DMatrix::from_fn(n - 1, n - 1, |i, j| {
            self.entries[(kept(i), kept(j))] - self.entries[(kept(i), out)] * share(j)
        });
        let errors = DMatrix::from_fn(n - 1, n - 1, |i, j| {
            let (taken, error) = (self.entries[(kept(i), out)].size(), self.errors[(kept(i), out)]);
            let rounding = T::EPSILON * (taken * share(j).size() + entries[(i, j)].size());
            self.errors[(kept(i), kept(j))] + error * share(j).size() + taken * doubt(j) + rounding
        });
        let cleared = DMatrix::from_fn(n - 1, n - 1, |i, j| {
            let (entry, error) = (entries[(i, j)], errors[(i, j)]);
            let terms = self.entries[(kept(i), kept(j))].size();
            if entry.size() <= error && error <= CLEAR * terms { T::ZERO } else { entry }
        });
        Some(Self { entries: cleared, errors })
    }
}

/// Elimination of the transposed matrix with complete pivoting; its columns are the rows of the matrix.
struct Elimination<T: Real> {
    m: DMatrix<T>,
    errors: DMatrix<f64>,
    /// Row of the matrix for each column.
    order: Vec<usize>,
    /// Divisors of the rows of the matrix, so that a row of small entries does not count as dependent.
    sizes: Vec<f64>,
}

impl<T: Real> Elimination<T> {
    fn of(a: &Rounded<T>) -> Self {
        let n = a.entries.nrows();
        let (mut m, mut errors) = (a.entries.transpose(), a.errors.transpose());
        let divide = |m: &mut DMatrix<T>, errors: &mut DMatrix<f64>, at: &dyn Fn(usize) -> (usize, usize)| {
            let size = power_of_two((0..n).map(|i| m[at(i)].size()).fold(0.0, f64::max));
            (0..n).for_each(|i| m[at(i)] = m[at(i)].scaled(1.0 / size));
            (0..n).for_each(|i| errors[at(i)] /= size);
            size
        };
        let sizes = (0..n).map(|j| divide(&mut m, &mut errors, &|i| (i, j))).collect();
        (0..n).for_each(|i| {
            divide(&mut m, &mut errors, &|j| (i, j));
        });
        Self { m, errors, order: (0..n).collect(), sizes }
    }

    /// Returns factors `y` with `y'A = 0` and bounds of their errors, or `None` if the rows are independent.
    fn dependency(mut self) -> Option<(Vec<T>, Vec<f64>)> {
        let n = self.order.len();
        for k in 0..n {
            let Some((i, j)) = self.pivot(k) else {
                let doubt = self.errors.view((k, k), (n - k, n - k)).amax();
                return (doubt <= CLEAR).then(|| self.combination(k));
            };
            self.m.swap_rows(k, i);
            self.m.swap_columns(k, j);
            self.errors.swap_rows(k, i);
            self.errors.swap_columns(k, j);
            self.order.swap(k, j);
            self.eliminate(k);
        }
        None
    }

    /// Returns the position of the largest nonzero entry from row and column `k` on.
    fn pivot(&self, k: usize) -> Option<(usize, usize)> {
        let n = self.order.len();
        let mut best = (0.0, None);
        for j in k..n {
            for i in k..n {
                let size = self.m[(i, j)].size();
                if size > self.errors[(i, j)] && size > best.0 {
                    best = (size, Some((i, j)));
                }
            }
        }
        best.1
    }

    fn eliminate(&mut self, k: usize) {
        let n = self.order.len();
        let (pivot, own) = (self.m[(k, k)], self.errors[(k, k)]);
        for i in k + 1..n {
            let factor = self.m[(i, k)] / pivot;
            let size = factor.size();
            let doubt = (self.errors[(i, k)] + size * own) / pivot.size() + T::EPSILON * size;
            if size == 0.0 && doubt == 0.0 {
                continue;
            }
            for j in k + 1..n {
                let (above, error) = (self.m[(k, j)], self.errors[(k, j)]);
                self.m[(i, j)] -= factor * above;
                let rounding = T::EPSILON * (size * above.size() + self.m[(i, j)].size());
                self.errors[(i, j)] += size * error + doubt * above.size() + rounding;
            }
        }
    }

    /// Returns the linear combination that expresses column `rank` by the columns before it.
    fn combination(&self, rank: usize) -> (Vec<T>, Vec<f64>) {
        let n = self.order.len();
        let (mut y, mut dy) = (vec![T::ZERO; n], vec![0.0; n]);
        y[rank] = T::from(1.0);
        for i in (0..rank).rev() {
            let (mut sum, mut error) = (T::ZERO, 0.0);
            for j in i + 1..=rank {
                let (m, e) = (self.m[(i, j)], self.errors[(i, j)]);
                sum += m * y[j];
                error += e * y[j].size() + m.size() * dy[j] + T::EPSILON * (m * y[j]).size();
            }
            let pivot = self.m[(i, i)];
            y[i] = -sum / pivot;
            dy[i] = (error + self.errors[(i, i)] * y[i].size()) / pivot.size() + T::EPSILON * y[i].size();
        }
        let (mut own, mut errors) = (vec![T::ZERO; n], vec![0.0; n]);
        for (k, &row) in self.order.iter().enumerate() {
            own[row] = y[k].scaled(1.0 / self.sizes[row]);
            errors[row] = dy[k] / self.sizes[row];
        }
        (own, errors)
    }
}

fn power_of_two(size: f64) -> f64 {
    if size > 0.0 { math::exp2(math::log2(size).floor()) } else { 1.0 }
}
