//! Linear least squares.

use mops_math as math;
use nalgebra::{DMatrix, DVector};

/// Share of the largest singular value below which one counts as zero, for unit-length columns: rounding error.
const ZERO: f64 = 1e-10;

/// Least-squares estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Parameters; if not unique, the minimum-norm solution for unit-length columns.
    pub parameters: Vec<f64>,
    /// Standard errors for white residuals; NaN if a parameter is not unique or no degree of freedom is left.
    pub std_errors: Vec<f64>,
    /// Standard deviation of the residuals, `sqrt(sum e^2 / (N - rank))`; NaN if `N` is the rank.
    pub residual: f64,
    /// Number of independent columns.
    pub rank: usize,
}

/// Returns the parameters that minimise `sum (y(t) - phi(t)' theta)^2`; `regressors` has a row `phi(t)'` per sample.
///
/// Uses QR of the scaled columns, then SVD of the triangle, so that the condition is not squared as in the normal
/// equations.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition (2013), section 5.5.
///
/// # Panics
/// If `y` does not have one value per row, or if there is no column.
#[allow(clippy::cast_precision_loss)]
pub fn least_squares(regressors: &DMatrix<f64>, y: &DVector<f64>) -> Estimate {
    let (rows, n) = regressors.shape();
    assert!(rows == y.len() && n > 0, "one row per value, and at least one column");
    let norms: Vec<f64> = regressors.column_iter().map(|c| c.norm()).map(|v| if v > 0.0 { v } else { 1.0 }).collect();
    let mut scaled = regressors.clone();
    scaled.column_iter_mut().zip(&norms).for_each(|(mut column, norm)| column /= *norm);
    let (triangle, target) = if rows > n {
        let qr = scaled.clone().qr();
        let mut target = y.clone();
        qr.q_tr_mul(&mut target);
        (qr.r(), target.rows(0, n).into_owned())
    } else {
        (scaled.clone(), y.clone())
    };
    let svd = triangle.svd(true, true);
    let (u, v_t) = (svd.u.as_ref().expect("the SVD computes U"), svd.v_t.as_ref().expect("the SVD computes V"));
    let largest = svd.singular_values.max();
    let kept: Vec<usize> = (0..svd.singular_values.len())
        .filter(|&i| svd.singular_values[i] > ZERO * largest && svd.singular_values[i] > 0.0)
        .collect();
    let mut solution = DVector::zeros(n);
    let mut variances = vec![0.0; n];
    let mut covered = vec![0.0; n];
    for &i in &kept {
        let s = svd.singular_values[i];
        solution += v_t.row(i).transpose() * (u.column(i).dot(&target) / s);
        for k in 0..n {
            variances[k] += math::powi(v_t[(i, k)] / s, 2);
            covered[k] += math::powi(v_t[(i, k)], 2);
        }
    }
    let rank = kept.len();
    let residuals = y - &scaled * &solution;
    let residual = if rows > rank { (residuals.norm_squared() / (rows - rank) as f64).sqrt() } else { f64::NAN };
    let unique = |k: usize| covered[k] > 1.0 - 1e-8;
    Estimate {
        parameters: (0..n).map(|k| solution[k] / norms[k]).collect(),
        std_errors: (0..n)
            .map(|k| if unique(k) { residual * variances[k].sqrt() / norms[k] } else { f64::NAN })
            .collect(),
        residual,
        rank,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks Longley's data, an ill-conditioned benchmark. Certified values: NIST Statistical Reference Datasets,
    /// Longley.
    #[test]
    fn longleys_regression_has_its_certified_values() {
        #[rustfmt::skip]
        let data = [
            60323.0, 83.0, 234289.0, 2356.0, 1590.0, 107608.0, 1947.0,
            61122.0, 88.5, 259426.0, 2325.0, 1456.0, 108632.0, 1948.0,
            60171.0, 88.2, 258054.0, 3682.0, 1616.0, 109773.0, 1949.0,
            61187.0, 89.5, 284599.0, 3351.0, 1650.0, 110929.0, 1950.0,
            63221.0, 96.2, 328975.0, 2099.0, 3099.0, 112075.0, 1951.0,
            63639.0, 98.1, 346999.0, 1932.0, 3594.0, 113270.0, 1952.0,
            64989.0, 99.0, 365385.0, 1870.0, 3547.0, 115094.0, 1953.0,
            63761.0, 100.0, 363112.0, 3578.0, 3350.0, 116219.0, 1954.0,
            66019.0, 101.2, 397469.0, 2904.0, 3048.0, 117388.0, 1955.0,
            67857.0, 104.6, 419180.0, 2822.0, 2857.0, 118734.0, 1956.0,
            68169.0, 108.4, 442769.0, 2936.0, 2798.0, 120445.0, 1957.0,
            66513.0, 110.8, 444546.0, 4681.0, 2637.0, 121950.0, 1958.0,
            68655.0, 112.6, 482704.0, 3813.0, 2552.0, 123366.0, 1959.0,
            69564.0, 114.2, 502601.0, 3931.0, 2514.0, 125368.0, 1960.0,
            69331.0, 115.7, 518173.0, 4806.0, 2572.0, 127852.0, 1961.0,
            70551.0, 116.9, 554894.0, 4007.0, 2827.0, 130081.0, 1962.0,
        ];
        let rows = DMatrix::from_row_slice(16, 7, &data);
        let regressors = rows.clone().remove_column(0).insert_column(0, 1.0);
        let found = least_squares(&regressors, &rows.column(0).into_owned());
        let certified = [
            (-3_482_258.634_595_82, 890_420.383_607_373),
            (15.061_872_271_373_3, 84.914_925_774_766_9),
            (-0.358_191_792_925_910e-1, 0.334_910_077_722_432e-1),
            (-2.020_229_803_816_83, 0.488_399_681_651_699),
            (-1.033_226_867_173_59, 0.214_274_163_161_675),
            (-0.511_041_056_535_807e-1, 0.226_073_200_069_370),
            (1_829.151_464_613_55, 455.478_499_142_212),
        ];
        for (k, (value, error)) in certified.into_iter().enumerate() {
            assert!((found.parameters[k] / value - 1.0).abs() < 1e-8, "{k}: {} {value}", found.parameters[k]);
            assert!((found.std_errors[k] / error - 1.0).abs() < 1e-8, "{k}: {} {error}", found.std_errors[k]);
        }
        assert!((found.residual / 304.854_073_561_965 - 1.0).abs() < 1e-9 && found.rank == 7);
    }

    #[test]
    fn what_is_not_unique_has_no_standard_error_and_the_rest_keeps_its_own() {
        let regressors = DMatrix::from_row_slice(4, 3, &[1., 2., 0., 2., 4., 1., 3., 6., 0., 4., 8., 1.]);
        let y = DVector::from_vec(vec![5.0, 13.0, 15.0, 23.0]);
        let found = least_squares(&regressors, &y);
        let [a, b, c] = found.parameters[..] else { panic!("three columns") };
        assert!((a + 2.0 * b - 5.0).abs() < 1e-12 && (c - 3.0).abs() < 1e-12, "{found:?}");
        assert!(found.rank == 2 && found.std_errors[0].is_nan() && found.std_errors[2] < 1e-12, "{found:?}");
    }
}
