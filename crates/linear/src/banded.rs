//! Banded matrices and their LU factors with row pivoting; a full matrix is the widest band.
//!
//! Source: G. Golub, C. Van Loan, Matrix Computations, 4th edition (2013), section 4.3.5.

/// Matrix of size `n` x `n` with `lower` diagonals below the main diagonal and `upper` above it; first the matrix, then
/// its LU factors.
#[derive(Debug, Clone)]
pub struct Banded {
    n: usize,
    lower: usize,
    /// Stored diagonals above the main diagonal: `upper`, plus the fill-in from row exchanges.
    reach: usize,
    /// Entries row by row, from the lowest diagonal to the highest.
    rows: Vec<f64>,
    /// Pivot row of each row, after factorisation.
    exchanged: Vec<usize>,
}

impl Banded {
    /// Creates a matrix of zeros with `lower` diagonals below the main diagonal and `upper` above it.
    #[must_use]
    pub fn zeros(n: usize, lower: usize, upper: usize) -> Self {
        let reach = (upper + lower).min(n.saturating_sub(1));
        Self { n, lower, reach, rows: vec![0.0; n * (lower + reach + 1)], exchanged: (0..n).collect() }
    }

    #[inline]
    fn width(&self) -> usize {
        self.lower + self.reach + 1
    }

    #[inline]
    fn index(&self, row: usize, column: usize) -> usize {
        row * self.width() + column + self.lower - row
    }

    /// Sets every entry to 0.
    pub fn clear(&mut self) {
        self.rows.fill(0.0);
    }

    /// Sets an entry; its place must be inside the band.
    #[inline]
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        let index = self.index(row, column);
        self.rows[index] = value;
    }

    /// Sets the matrix to `I - factor matrix`, for a matrix of the same band.
    #[inline]
    pub fn set_shifted(&mut self, matrix: &Self, factor: f64) {
        for (own, other) in self.rows.iter_mut().zip(&matrix.rows) {
            *own = -factor * other;
        }
        for i in 0..self.n {
            let diagonal = self.index(i, i);
            self.rows[diagonal] += 1.0;
        }
    }

    /// Replaces the matrix by its LU factors; returns false if it is singular.
    pub fn factorise(&mut self) -> bool {
        let width = self.width();
        for k in 0..self.n {
            let last = (k + self.lower).min(self.n - 1);
            let size = |row: usize| self.rows[self.index(row, k)].abs();
            let pivot = (k..=last).fold(k, |best, row| if size(row) > size(best) { row } else { best });
            if size(pivot) == 0.0 || !size(pivot).is_finite() {
                return false;
            }
            self.exchanged[k] = pivot;
            let end = (k + self.reach).min(self.n - 1);
            if pivot != k {
                for column in k..=end {
                    let (a, b) = (self.index(k, column), self.index(pivot, column));
                    self.rows.swap(a, b);
                }
            }
            let (top, below) = self.rows.split_at_mut((k + 1) * width);
            let length = end - k;
            let head = &top[k * width + self.lower..][..=length];
            for (row, below) in (k + 1..=last).zip(below.chunks_exact_mut(width)) {
                let part = &mut below[k + self.lower - row..][..=length];
                let factor = part[0] / head[0];
                part[0] = factor;
                if factor != 0.0 {
                    for (a, b) in part[1..].iter_mut().zip(&head[1..]) {
                        *a -= factor * b;
                    }
                }
            }
        }
        true
    }

    /// Solves `A x = b` with the LU factors: `b` becomes `x`.
    #[inline]
    pub fn solve(&self, b: &mut [f64]) {
        let width = self.width();
        for k in 0..self.n {
            b.swap(k, self.exchanged[k]);
            let known = b[k];
            if known != 0.0 {
                for row in k + 1..=(k + self.lower).min(self.n - 1) {
                    b[row] -= self.rows[self.index(row, k)] * known;
                }
            }
        }
        for k in (0..self.n).rev() {
            let length = self.reach.min(self.n - 1 - k);
            let row = &self.rows[k * width + self.lower..][..=length];
            let sum: f64 = row[1..].iter().zip(&b[k + 1..]).map(|(a, b)| a * b).sum();
            b[k] = (b[k] - sum) / row[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solves with a matrix of this band, with entries from a recurrence, and checks the residual.
    fn check(n: usize, lower: usize, upper: usize) {
        let mut seed = 0.3;
        let mut random = || {
            seed = (seed * 997.0 + 0.123_f64).fract();
            seed - 0.5
        };
        let mut matrix = Banded::zeros(n, lower, upper);
        let mut full = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in i.saturating_sub(lower)..=(i + upper).min(n - 1) {
                full[i][j] = random();
                matrix.set(i, j, full[i][j]);
            }
        }
        let b: Vec<f64> = (0..n).map(|_| random()).collect();
        let mut x = b.clone();
        assert!(matrix.factorise());
        matrix.solve(&mut x);
        let size = x.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        for i in 0..n {
            let sum: f64 = full[i].iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((sum - b[i]).abs() < 1e-13 * size, "n {n}, band {lower} {upper}, row {i}: {sum} {}", b[i]);
        }
    }

    #[test]
    fn bands_of_every_shape_are_solved() {
        for (n, lower, upper) in [(1, 0, 0), (5, 4, 4), (12, 11, 11), (30, 1, 1), (30, 2, 0), (30, 0, 3), (40, 3, 1)] {
            check(n, lower, upper);
        }
    }

    #[test]
    fn a_singular_matrix_is_reported() {
        let mut matrix = Banded::zeros(3, 1, 1);
        matrix.set(0, 0, 1.0);
        assert!(!matrix.factorise());
    }
}
