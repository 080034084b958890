//! Cholesky factorisation: by nalgebra for large systems, and in place for repeated attempts on matrices that may be
//! indefinite.

use nalgebra::{Cholesky, DMatrix, Dyn};

/// Factorises a symmetric matrix of size `n` and passes the factor to `use_factor`.
///
/// `fill` writes the lower triangle into a zero matrix. Returns `None` if the matrix is not positive definite; `buffer`
/// is then lost, otherwise it is reused.
pub fn with_cholesky<T>(
    buffer: &mut Vec<f64>,
    n: usize,
    fill: impl FnOnce(&mut DMatrix<f64>),
    use_factor: impl FnOnce(&Cholesky<f64, Dyn>) -> T,
) -> Option<T> {
    let mut entries = std::mem::take(buffer);
    entries.clear();
    entries.resize(n * n, 0.0);
    let mut matrix = DMatrix::from_vec(n, n, entries);
    fill(&mut matrix);
    let factor = Cholesky::new(matrix)?;
    let answer = use_factor(&factor);
    *buffer = factor.unpack_dirty().data.into();
    Some(answer)
}

/// Replaces the lower triangle of a matrix of size `n` by its Cholesky factor; `stride` is the distance between
/// columns. Returns false if the matrix is not positive definite.
pub fn factorise(l: &mut [f64], n: usize, stride: usize) -> bool {
    for k in 0..n {
        // First column that reaches row k; of a diagonal matrix none does.
        let first = (0..k).find(|&m| l[m * stride + k] != 0.0).unwrap_or(k);
        for i in k..n {
            let sum: f64 = (first..k).map(|m| l[m * stride + i] * l[m * stride + k]).sum();
            let rest = l[k * stride + i] - sum;
            l[k * stride + i] = if i > k { rest / l[k * stride + k] } else { rest.sqrt() };
        }
        if !(l[k * stride + k] > 0.0 && l[k * stride + k].is_finite()) {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_factorisations_agree() {
        let entries = [4.0, 2.0, 0.4, 2.0, 3.0, 1.0, 0.4, 1.0, 5.0];
        let mut buffer = Vec::new();
        let matrix = DMatrix::from_row_slice(3, 3, &entries);
        let l = with_cholesky(&mut buffer, 3, |m| m.copy_from(&matrix), |factor| factor.l()).unwrap();
        let mut in_place = entries;
        assert!(factorise(&mut in_place, 3, 3));
        for k in 0..3 {
            assert!((k..3).all(|i| (in_place[3 * k + i] - l[(i, k)]).abs() < 1e-15));
        }
        let small = with_cholesky(&mut buffer, 1, |m| m[(0, 0)] = 9.0, |factor| factor.l()).unwrap();
        assert_eq!(small[(0, 0)], 3.0);
        assert!(with_cholesky(&mut buffer, 2, |m| m[(0, 0)] = 1.0, |_| ()).is_none());
        assert!(!factorise(&mut [1.0, 2.0, 2.0, 1.0], 2, 2) && !factorise(&mut [f64::NAN], 1, 1));
    }
}
