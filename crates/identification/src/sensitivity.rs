//! Sensitivity matrix: which directions of the tuners the data determine.

use nalgebra::{DMatrix, DVector, RowDVector, SymmetricEigen};

use crate::blind::{self, BlindDirection, Limit, NO_PART};
use crate::coordinate::Coordinate;
use crate::noise::Noise;

/// Relative singular value that tangents of the simulation do not resolve: their accuracy is that of the integration,
/// 1e-8 at its default tolerance.
pub const TANGENTS: f64 = 1e-8;

/// Relative singular value that differences do not resolve.
///
/// Noise of 1e-9 over steps of 2e-4 causes an error of 5e-6 of a strong tuner's derivative, and more of a weak one's.
pub const DIFFERENCES: f64 = 1e-4;

/// Share of the largest column, scaled by the tuners' ranges, below which a column is rounding error: no effect.
const NO_EFFECT: f64 = 1e-15;

/// Eigenvalues, descending, with their unit-length eigenvectors.
pub type Eigen = Vec<(f64, Vec<f64>)>;

/// Sensitivity matrix `J' J` of residuals `r` with `J = dr/dtuner`.
///
/// The matrix is half the Hessian of `r' r` if the residuals are small or nearly linear. Divided by the variance of
/// white noise it is the Fisher information. Along an eigenvector of eigenvalue zero nothing changes to first order:
/// the tuners are not locally identifiable.
///
/// A direction counts as determined if the derivatives resolve it and the noise does not hide it
/// (`Sensitivity::judge`). Derivatives resolve singular values of `J` down to `zero` times the largest; smaller ones
/// may be exact zeros within their accuracy. The columns of `J` have unit length, so that units do not matter.
///
/// Source: E. Walter, L. Pronzato, Identification of Parametric Models from Experimental Data (1997), sections 2.6,
/// 5.2; A. van der Sluis, Numerische Mathematik 14 (1969) 14-23 (columns of unit length are nearly the best scaling).
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// Tuners.
    pub coordinates: Vec<Coordinate>,
    /// Matrix `J' J` in the tuners' own units.
    pub matrix: DMatrix<f64>,
    /// Eigenvalues and eigenvectors of the matrix.
    pub own: Eigen,
    /// Eigenvalues and eigenvectors for relative changes of the tuners; eigenvalues in the unit of `r' r`.
    pub relative: Eigen,
    /// Singular values of `J` with unit-length columns, descending.
    pub singular_values: Vec<f64>,
    /// Number of directions that the data determine.
    pub rank: usize,
    /// Share of the largest singular value that counts as zero.
    pub zero: f64,
    /// Directions that are not determined.
    pub blind: Vec<BlindDirection>,
    /// True for each tuner that takes part in one of them.
    pub undetermined: Vec<bool>,
    /// Inverse `(J' J)^-1` in the tuners' own units, over the resolved directions.
    pub inverse: DMatrix<f64>,
    /// Resolved directions: `basis basis' = (J' J)^-1`, and `J basis` has orthonormal columns.
    pub basis: DMatrix<f64>,
    /// Standard error of each tuner for residuals of unit variance if all others were known: `1/|J_k|`.
    pub alone: Vec<f64>,
    /// Standard error of each tuner for residuals of unit variance with all others estimated too: root of the diagonal
    /// of `(J' J)^-1`; NaN if undetermined.
    pub together: Vec<f64>,
    /// Correlations of the estimates; NaN if undetermined.
    pub correlation: DMatrix<f64>,
    /// Unresolved directions, as rows, in coordinates in which column `k` of `J` has unit length instead of
    /// `lengths[k]`.
    null: DMatrix<f64>,
    /// Lengths of the columns of `J`; 1 for a column without effect.
    lengths: Vec<f64>,
}

impl Sensitivity {
    /// Computes the sensitivity matrix from the Jacobian in the tuners' own units: one column per coordinate.
    ///
    /// # Panics
    /// If there is no tuner or no residual, or if the number of columns is not that of the coordinates.
    pub fn of(jacobian: &DMatrix<f64>, coordinates: Vec<Coordinate>, zero: f64) -> Self {
        let n = coordinates.len();
        assert!(n > 0 && jacobian.ncols() == n && jacobian.nrows() > 0, "one column per tuner");
        let scales: Vec<f64> = coordinates.iter().map(Coordinate::scale).collect();
        let strength: Vec<f64> = (0..n).map(|k| jacobian.column(k).norm() * coordinates[k].range).collect();
        let strongest = strength.iter().copied().fold(0.0, f64::max);
        let norms: Vec<f64> =
            (0..n).map(|k| if strength[k] > NO_EFFECT * strongest { jacobian.column(k).norm() } else { 0.0 }).collect();
        // Rows of zeros give a singular value to each direction if there are fewer residuals than tuners.
        let rows = jacobian.nrows().max(n);
        let unit = DMatrix::from_fn(rows, n, |i, k| {
            if i < jacobian.nrows() && norms[k] > 0.0 { jacobian[(i, k)] / norms[k] } else { 0.0 }
        });
        let svd = unit.svd(false, true);
        let v_t = svd.v_t.as_ref().expect("the SVD computes V");
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| svd.singular_values[j].total_cmp(&svd.singular_values[i]));
        let singular_values: Vec<f64> = order.iter().map(|&i| svd.singular_values[i]).collect();
        let rank = singular_values.iter().filter(|&&s| s > zero * singular_values[0] && s > 0.0).count();
        let null = DMatrix::from_fn(n - rank, n, |i, k| v_t[(order[rank + i], k)]);
        // A negligible column is a direction of its own, so that any length is valid.
        let lengths: Vec<f64> = norms.iter().map(|&norm| if norm > 0.0 { norm } else { 1.0 }).collect();
        let basis = DMatrix::from_fn(n, rank, |k, i| v_t[(order[i], k)] / (svd.singular_values[order[i]] * lengths[k]));
        let inverse = &basis * basis.transpose();
        let blind = blind::directions(null.clone(), &lengths, &coordinates, Limit::Nothing);
        let undetermined: Vec<bool> = (0..n).map(|k| null.column(k).norm() > NO_PART).collect();
        let together: Vec<f64> =
            (0..n).map(|k| if undetermined[k] { f64::NAN } else { inverse[(k, k)].sqrt() }).collect();
        let matrix = jacobian.tr_mul(jacobian);
        let scaled = DMatrix::from_fn(n, n, |a, b| matrix[(a, b)] * scales[a] * scales[b]);
        Self {
            own: eigen(&matrix),
            relative: eigen(&scaled),
            matrix,
            singular_values,
            rank,
            zero,
            blind,
            alone: norms.iter().map(|&norm| if norm > 0.0 { 1.0 / norm } else { f64::INFINITY }).collect(),
            together,
            correlation: correlation(&inverse, &undetermined),
            undetermined,
            inverse,
            basis,
            null,
            lengths,
            coordinates,
        }
    }

    /// Returns the number of unresolved directions.
    pub fn unresolved(&self) -> usize {
        self.null.nrows()
    }

    /// Compares directions with the noise of the residuals, given the covariance of the estimates.
    ///
    /// A direction is not determined if one standard error along it moves a tuner through its whole range. The change
    /// of the residuals is then below the noise. An unresolved direction is unknown if its computed change would be
    /// above the noise.
    pub(crate) fn judge(&mut self, jacobian: &DMatrix<f64>, noise: &Noise, covariance: &DMatrix<f64>) {
        let n = self.coordinates.len();
        let spans: Vec<f64> = self.coordinates.iter().map(|coordinate| coordinate.span).collect();
        let hidden = |row: &RowDVector<f64>| {
            let step = DVector::from_fn(n, |k, _| row[k] / self.lengths[k]);
            let farthest = (0..n).map(|k| (step[k] / spans[k]).abs()).fold(0.0, f64::max);
            let change = jacobian * step;
            let size = change.norm();
            // N.B.: an unknown noise level hides everything.
            let level = noise.along((&change / size.max(f64::MIN_POSITIVE)).as_slice()).deviation;
            size / farthest <= level || level.is_nan()
        };
        let (nothing, unknown): (Vec<_>, Vec<_>) =
            self.null.row_iter().map(|row| row.into_owned()).partition(|row| hidden(row));
        let own = SymmetricEigen::new(DMatrix::from_fn(n, n, |a, b| covariance[(a, b)] / (spans[a] * spans[b])));
        let mut noisy = Vec::new();
        for (value, vector) in own.eigenvalues.iter().zip(own.eigenvectors.column_iter()) {
            let error = value.max(0.0).sqrt();
            let lost: Vec<usize> = (0..n).filter(|&k| error * vector[k].abs() > 1.0).collect();
            if !lost.is_empty() {
                for k in lost {
                    (self.undetermined[k], self.together[k]) = (true, f64::NAN);
                }
                noisy.push(RowDVector::from_fn(n, |_, k| vector[k] * spans[k] * self.lengths[k]).normalize());
            }
        }
        self.rank -= noisy.len();
        let classes = [(nothing, Limit::Nothing), (noisy, Limit::Noise), (unknown, Limit::Slopes)];
        let rows =
            |rows: Vec<RowDVector<f64>>| if rows.is_empty() { DMatrix::zeros(0, n) } else { DMatrix::from_rows(&rows) };
        self.blind = (classes.into_iter())
            .flat_map(|(class, limit)| blind::directions(rows(class), &self.lengths, &self.coordinates, limit))
            .collect();
        self.correlation = correlation(covariance, &self.undetermined);
    }

    /// Computes the sensitivities from the matrix `J' J`, in the tuners' own units. Half of the digits are lost if the
    /// matrix is nearly singular.
    pub fn of_matrix(matrix: &DMatrix<f64>, coordinates: Vec<Coordinate>, zero: f64) -> Self {
        let eigen = SymmetricEigen::new(matrix.clone());
        let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        let jacobian = DMatrix::from_diagonal(&roots) * eigen.eigenvectors.transpose();
        let sensitivity = Self::of(&jacobian, coordinates, zero);
        Self { own: self::eigen(matrix), matrix: matrix.clone(), ..sensitivity }
    }
}

/// Returns the correlations of estimates with this covariance; NaN if a tuner is undetermined.
fn correlation(covariance: &DMatrix<f64>, undetermined: &[bool]) -> DMatrix<f64> {
    DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |a, b| match undetermined[a] || undetermined[b] {
        _ if a == b => 1.0,
        true => f64::NAN,
        false => covariance[(a, b)] / (covariance[(a, a)] * covariance[(b, b)]).sqrt(),
    })
}

/// Returns the eigenvalues, descending; the largest entry of every eigenvector is positive.
fn eigen(matrix: &DMatrix<f64>) -> Eigen {
    let eigen = SymmetricEigen::new(matrix.clone());
    let mut pairs: Eigen = (0..matrix.nrows())
        .map(|i| {
            let vector: Vec<f64> = eigen.eigenvectors.column(i).iter().copied().collect();
            let largest = vector.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(1.0);
            (eigen.eigenvalues[i], vector.iter().map(|v| v * largest.signum()).collect())
        })
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blind::Invariant;
    use crate::coordinate::coordinates;
    use mops_math as math;

    /// Checks the published matrix for the inertia about the centre of mass and the mass of an arm, 0.1225 m apart.
    #[test]
    fn of_inertia_and_mass_of_an_arm_only_one_combination_can_be_estimated() {
        let matrix = DMatrix::from_row_slice(2, 2, &[431_064.0, 6456.3, 6456.3, 97.0671]);
        // The printed digits limit a singular value to 1e-3.
        let found = Sensitivity::of_matrix(&matrix, coordinates(&[("J_c", 0.0014), ("m_arm", 0.165)]), 0.05);
        let [(large, along), (small, across)] = &found.own[..] else { panic!("two of them") };
        assert!((large - 431_160.70).abs() < 0.01 && (small - 0.367_20).abs() < 1e-4, "{large} {small}");
        for (found, exact) in along.iter().chain(across).zip([0.999_888, 0.014_976, -0.014_976, 0.999_888]) {
            assert!((found - exact).abs() < 1e-6, "{found} {exact}");
        }
        assert_eq!(found.rank, 1);
        assert_eq!(found.blind[0].invariant, Invariant::Sum(0, 1));
        let weight = found.blind[0].weight(&found.coordinates).unwrap();
        assert!((weight - 0.015).abs() < 5e-5, "{weight}");
        assert!(found.together.iter().all(|error| error.is_nan()));
    }

    #[test]
    fn standard_errors_and_correlations_are_those_of_a_straight_line() {
        // y = a + b t at t = 0, ..., 9: the covariance of a and b is the inverse of (n, sum t; sum t, sum t^2).
        let jacobian = DMatrix::from_fn(10, 2, |t, k| if k == 0 { 1.0 } else { t as f64 });
        let found = Sensitivity::of(&jacobian, coordinates(&[("a", 1.0), ("b", 2.0)]), TANGENTS);
        let determinant: f64 = 10.0 * 285.0 - 45.0 * 45.0;
        let exact = [(285.0 / determinant).sqrt(), (10.0 / determinant).sqrt()];
        assert!(found.together.iter().zip(exact).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
        assert!((found.correlation[(0, 1)] + 45.0 / 2850f64.sqrt()).abs() < 1e-12);
        assert!((found.alone[1] - 1.0 / 285f64.sqrt()).abs() < 1e-12 && found.rank == 2 && found.blind.is_empty());
    }

    #[test]
    fn the_rank_does_not_depend_on_units() {
        let jacobian = DMatrix::from_fn(20, 3, |t, k| math::sin((k + 1) as f64 * t as f64 * 0.1) * [1e-9, 1.0, 1e9][k]);
        let mut some = coordinates(&[("a", 1e9), ("b", 1.0), ("c", 1e-9)]);
        for (coordinate, range) in some.iter_mut().zip([1e9, 1.0, 1e-9]) {
            coordinate.range = range;
        }
        assert_eq!(Sensitivity::of(&jacobian, some, TANGENTS).rank, 3);
    }

    #[test]
    fn fewer_residuals_than_tuners_leave_directions_open() {
        let jacobian = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let found = Sensitivity::of(&jacobian, coordinates(&[("a", 1.0), ("b", 1.0)]), TANGENTS);
        assert_eq!((found.rank, found.blind[0].invariant), (1, Invariant::Everything(1)));
        assert!((found.together[0] - 1.0).abs() < 1e-12 && found.together[1].is_nan());
    }
}
