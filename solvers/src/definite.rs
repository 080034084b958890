//! Factors of positive definite matrices.

use nalgebra::{Cholesky, DMatrix, Dyn};

/// Factors a symmetric matrix of size `n`, of which `fill` gives the lower triangle over zeros, and hands the factor on; `None`
/// where the matrix is not positive definite. The memory is used again.
pub fn factored<T>(
    memory: &mut Vec<f64>,
    n: usize,
    fill: impl FnOnce(&mut DMatrix<f64>),
    then: impl FnOnce(&Cholesky<f64, Dyn>) -> T,
) -> Option<T> {
    let mut entries = std::mem::take(memory);
    entries.clear();
    entries.resize(n * n, 0.0);
    let mut matrix = DMatrix::from_vec(n, n, entries);
    fill(&mut matrix);
    let factor = Cholesky::new(matrix)?;
    let answer = then(&factor);
    *memory = factor.unpack_dirty().data.into();
    Some(answer)
}

/// Turns the lower triangle of a positive definite matrix of size `n` into its Cholesky factor; columns lie `stride` apart.
/// `false` where the matrix is not positive definite.
pub fn cholesky(l: &mut [f64], n: usize, stride: usize) -> bool {
    for k in 0..n {
        for i in k..n {
            let known: f64 = (0..k).map(|m| l[m * stride + i] * l[m * stride + k]).sum();
            let left = l[k * stride + i] - known;
            l[k * stride + i] = if i > k { left / l[k * stride + k] } else { left.sqrt() };
        }
        if !(l[k * stride + k] > 0.0 && l[k * stride + k].is_finite()) {
            return false;
        }
    }
    true
}
