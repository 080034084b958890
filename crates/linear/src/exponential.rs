//! Matrix exponential.

use nalgebra::DMatrix;

use super::eigen::balance;

/// Returns the exponential of a square matrix minus 1, without cancellation for a small matrix: the Taylor series of a
/// part whose norm is at most 1/2, squared repeatedly.
///
/// Source: C. Moler, C. Van Loan, Nineteen dubious ways to compute the exponential of a matrix, twenty-five years
/// later, SIAM Review 45 (2003) 3-49, method 3.
///
/// # Panics
/// If the matrix is not square.
pub fn exponential_m1(of: &DMatrix<f64>) -> DMatrix<f64> {
    assert!(of.is_square(), "the exponential of a square matrix");
    // States in units of their own would cost digits; a power of two is a similarity without rounding.
    let mut part = of.clone();
    let scales = balance(&mut part);
    let norm = part.row_iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let mut squarings = 0;
    let mut size = norm;
    while size > 0.5 && size.is_finite() {
        size *= 0.5;
        part *= 0.5;
        squarings += 1;
    }
    let mut term = part.clone();
    let mut sum = term.clone();
    // The remainder after 16 terms is below 0.5^17/17!, less than rounding.
    for k in 2..=16 {
        term = &term * &part / f64::from(k);
        sum += &term;
    }
    // (1 + x)^2 - 1
    let sum = (0..squarings).fold(sum, |power, _| &power * &power + &power * 2.0);
    DMatrix::from_fn(of.nrows(), of.ncols(), |i, j| sum[(i, j)] * (scales[i] / scales[j]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    fn exponential(of: &DMatrix<f64>) -> DMatrix<f64> {
        exponential_m1(of) + DMatrix::identity(of.nrows(), of.nrows())
    }

    #[test]
    fn the_exponential_of_a_rotation_a_decay_and_a_chain_is_known() {
        let of = DMatrix::from_row_slice(2, 2, &[-0.5, 8.0, -8.0, -0.5]);
        let (sin, cos) = math::sin_cos(8.0);
        let exact = DMatrix::from_row_slice(2, 2, &[cos, sin, -sin, cos]) * math::exp(-0.5);
        assert!((exponential(&of) - exact).amax() < 1e-14);
        let chain = DMatrix::from_row_slice(3, 3, &[0.0, 3.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
        let exact = DMatrix::from_row_slice(3, 3, &[1.0, 3.0, 4.5, 0.0, 1.0, 3.0, 0.0, 0.0, 1.0]);
        assert!((exponential(&chain) - exact).amax() < 1e-14);
        assert_eq!(exponential(&DMatrix::zeros(2, 2)), DMatrix::identity(2, 2));
    }
}
