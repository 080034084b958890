//! Pooling of record variances, and their estimation by restricted maximum likelihood.

use mops_math as math;
use mops_statistics::f_cdf;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::records::Record;

/// Probability below which a record contradicts the noise level declared for it and for the others.
const CONTRADICTED: f64 = 0.01;

/// Degrees of freedom below which residuals do not show their noise.
pub(crate) const SHOWN: f64 = 1.0;

/// Relative change of the variances that ends the iteration: far below their uncertainty at any degrees of freedom.
const ACCURATE: f64 = 1e-6;

/// Maximum number of iterations. The convergence rate is about the share of the degrees of freedom that estimates take.
const ROUNDS: usize = 200;

/// Eigenvalue of the augmented information, for a unit diagonal, below which it counts as rounding error.
const DEPENDENT: f64 = 1e-9;

/// Smallest variance of a record in weights, relative to the largest: rounding.
const ROUNDING: f64 = 1e-30;

/// Variance shared by records: a factor on the squares of their relative deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pool {
    /// Variance; NaN with too few degrees of freedom.
    pub variance: f64,
    /// Degrees of freedom of the variance; infinite if declared.
    pub freedom: f64,
}

/// Record with its fitted model, in tuner coordinates in which the estimates are uncorrelated.
pub(crate) struct Fitted {
    pub record: Record,
    /// Simulated minus measured value of every sample.
    pub deviations: DVector<f64>,
    /// Derivatives of the simulated signal with respect to the coordinates.
    pub slopes: DMatrix<f64>,
    /// Products `slopes' slopes` and `slopes' deviations`, and the sum of squared deviations.
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
}

impl Fitted {
    pub fn new(record: Record, deviations: DVector<f64>, slopes: DMatrix<f64>) -> Self {
        let (matrix, gradient) = (slopes.tr_mul(&slopes), slopes.tr_mul(&deviations));
        Self { squares: deviations.norm_squared(), record, deviations, slopes, matrix, gradient }
    }

    /// Returns the sum of squared deviations after a step of the coordinates.
    fn squares_at(&self, step: &DVector<f64>) -> f64 {
        (self.squares + 2.0 * self.gradient.dot(step) + step.dot(&(&self.matrix * step))).max(0.0)
    }

    #[allow(clippy::cast_precision_loss)]
    fn count(&self) -> f64 {
        self.record.len() as f64
    }
}

/// Assignment of records to shared variances.
#[derive(Debug, Clone)]
pub(crate) struct Sharing {
    /// Index of the pool of every record.
    pub of_record: Vec<usize>,
    /// Standard deviation of every record for a pool variance of 1.
    pub relative: Vec<f64>,
    /// Number of pools.
    pub count: usize,
}

/// Variances, and the fit weighted by them.
pub(crate) struct Weighted {
    pub pools: Vec<Pool>,
    /// Change of the coordinates from the estimates to that fit.
    pub step: DVector<f64>,
    /// Covariance of the coordinates in that fit.
    pub covariance: DMatrix<f64>,
}

impl Sharing {
    /// Creates one pool per record.
    pub fn none(count: usize) -> Self {
        Self { of_record: (0..count).collect(), relative: vec![1.0; count], count }
    }

    /// Returns the variance of a record.
    pub fn variance(&self, pools: &[Pool], record: usize) -> f64 {
        pools[self.of_record[record]].variance * math::powi(self.relative[record], 2)
    }

    /// Returns the variances of the pools by restricted maximum likelihood.
    ///
    /// Each is the sum of squares in the variance-weighted fit divided by the remaining degrees of freedom. Of the
    /// residuals of that fit, only the part independent of the estimates counts ([`Sharing::independent`]).
    ///
    /// Source: H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545-554.
    pub fn variances(&self, fitted: &[Fitted]) -> Weighted {
        let mean = |of: &Fitted| of.squares / of.count();
        let members = |pool: usize| (0..fitted.len()).filter(move |&i| self.of_record[i] == pool);
        let begin = |pool: usize| {
            let sum: f64 = members(pool).map(|i| fitted[i].squares / math::powi(self.relative[i], 2)).sum();
            Pool { variance: sum / members(pool).map(|i| fitted[i].count()).sum::<f64>(), freedom: 0.0 }
        };
        let least = ROUNDING * fitted.iter().map(mean).fold(0.0, f64::max);
        let n = fitted.first().map_or(0, |of| of.slopes.ncols());
        let mut found = Weighted {
            pools: (0..self.count).map(begin).collect(),
            step: DVector::zeros(n),
            covariance: DMatrix::zeros(n, n),
        };
        for _ in 0..ROUNDS {
            let change = self.iterate(fitted, least.max(f64::MIN_POSITIVE), &mut found);
            if change <= ACCURATE {
                break;
            }
        }
        self.independent(fitted, least.max(f64::MIN_POSITIVE), &mut found.pools);
        found
    }

    /// Updates the variances from residuals that are independent of the estimates, so that estimate over standard error
    /// has Student's t distribution.
    ///
    /// For noise `V`, estimates with the weights `W` depend on `X' W y` only. The residuals of a fit with the columns
    /// `X` and `V W X` are contrasts of `y` independent of the estimates and the tuners. A pool without degrees of
    /// freedom in that fit keeps its variance.
    fn independent(&self, fitted: &[Fitted], least: f64, pools: &mut [Pool]) {
        let n = fitted.first().map_or(0, |of| of.slopes.ncols());
        let variances: Vec<f64> = (0..fitted.len()).map(|i| self.variance(pools, i).max(least)).collect();
        let ratios: Vec<f64> = fitted.iter().zip(&variances).map(|(of, v)| v * of.record.weight()).collect();
        let largest = ratios.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        // Columns of a record: its derivatives, and these times its ratio.
        let factors = |i: usize| [1.0, ratios[i] / largest];
        let (mut information, mut gradient) = (DMatrix::zeros(2 * n, 2 * n), DVector::zeros(2 * n));
        for (i, of) in fitted.iter().enumerate() {
            for (a, fa) in factors(i).into_iter().enumerate() {
                let mut part = gradient.rows_mut(a * n, n);
                part += &of.gradient * (fa / variances[i]);
                for (b, fb) in factors(i).into_iter().enumerate() {
                    let mut block = information.view_mut((a * n, b * n), (n, n));
                    block += &of.matrix * (fa * fb / variances[i]);
                }
            }
        }
        let inverse = pseudo_inverse(&information);
        let step = -(&inverse * gradient);
        let (mut squares, mut freedom) = (vec![0.0; self.count], vec![0.0; self.count]);
        for (i, of) in fitted.iter().enumerate() {
            let [one, ratio] = factors(i);
            let step = step.rows(0, n) * one + step.rows(n, n) * ratio;
            let covariance = inverse.view((0, 0), (n, n)) * (one * one)
                + (inverse.view((0, n), (n, n)) + inverse.view((n, 0), (n, n))) * (one * ratio)
                + inverse.view((n, n), (n, n)) * (ratio * ratio);
            squares[self.of_record[i]] += of.squares_at(&step) / math::powi(self.relative[i], 2);
            freedom[self.of_record[i]] += of.count() - of.matrix.dot(&covariance) / variances[i];
        }
        for (pool, (squares, freedom)) in pools.iter_mut().zip(squares.into_iter().zip(freedom)) {
            if freedom >= SHOWN {
                *pool = Pool { variance: squares / freedom, freedom };
            }
        }
    }

    /// Performs one iteration and returns the largest relative change of a variance.
    fn iterate(&self, fitted: &[Fitted], least: f64, found: &mut Weighted) -> f64 {
        let n = found.step.len();
        let weights: Vec<f64> = (0..fitted.len()).map(|i| 1.0 / self.variance(&found.pools, i).max(least)).collect();
        let (mut information, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (of, &weight) in fitted.iter().zip(&weights) {
            information += &of.matrix * weight;
            gradient += &of.gradient * weight;
        }
        if n > 0 {
            let Some(factor) = information.cholesky() else { return 0.0 };
            (found.step, found.covariance) = (-factor.solve(&gradient), factor.inverse());
        }
        let (mut squares, mut freedom) = (vec![0.0; self.count], vec![0.0; self.count]);
        for (i, of) in fitted.iter().enumerate() {
            let pool = self.of_record[i];
            squares[pool] += of.squares_at(&found.step) / math::powi(self.relative[i], 2);
            freedom[pool] += of.count() - weights[i] * of.matrix.dot(&found.covariance);
        }
        let mut change = 0.0f64;
        for (pool, known) in found.pools.iter_mut().enumerate() {
            known.freedom = freedom[pool];
            // A pool whose residuals do not show the noise keeps its weight.
            if known.freedom >= SHOWN {
                let variance = squares[pool] / known.freedom;
                change = change.max((variance - known.variance).abs() / variance.max(f64::MIN_POSITIVE));
                known.variance = variance;
            }
        }
        change
    }
}

/// Returns the pseudo-inverse of a positive semidefinite matrix, scaled to a unit diagonal.
fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    if n == 0 {
        return matrix.clone();
    }
    let scale: Vec<f64> =
        (0..n).map(|k| if matrix[(k, k)] > 0.0 { 1.0 / matrix[(k, k)].sqrt() } else { 0.0 }).collect();
    let eigen = SymmetricEigen::new(DMatrix::from_fn(n, n, |a, b| matrix[(a, b)] * scale[a] * scale[b]));
    let least = DEPENDENT * eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let inverse = eigen.eigenvalues.map(|value| if value > least { 1.0 / value } else { 0.0 });
    let found = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(n, n, |a, b| found[(a, b)] * scale[a] * scale[b])
}

/// Returns the pools of records, and the records whose residuals contradict the declared noise level.
///
/// `own` has the variance of each record alone. Records that are not `white` share no pool.
pub(crate) fn sharing(fitted: &[Fitted], own: &[Pool], white: &[bool]) -> (Sharing, Vec<usize>) {
    let declares = |&i: &usize| white[i] && fitted[i].record.noise.is_some();
    let (declared, disputed) = undisputed((0..fitted.len()).filter(declares).collect(), fitted, own);
    // If a record is too short to show its noise, all records of that channel share one variance.
    let same_channel = |i: usize, j: usize| {
        let [a, b] = [i, j].map(|i| &fitted[i].record.signal);
        white[j] && !declared.contains(&j) && a.is_some() && a == b
    };
    let leader = |i: usize| -> usize {
        if declared.contains(&i) {
            return declared[0];
        }
        let alike: Vec<usize> = (0..fitted.len()).filter(|&j| white[i] && same_channel(i, j)).collect();
        let is_short = alike.iter().any(|&j| own[j].freedom < SHOWN);
        if is_short { alike[0] } else { i }
    };
    let leaders: Vec<usize> = (0..fitted.len()).map(leader).collect();
    let mut kept = leaders.clone();
    kept.sort_unstable();
    kept.dedup();
    let sharing = Sharing {
        of_record: leaders.iter().map(|leader| kept.binary_search(leader).expect("leaders are in the list")).collect(),
        relative: (0..fitted.len())
            .map(|i| fitted[i].record.noise.filter(|_| declared.contains(&i)).unwrap_or(1.0))
            .collect(),
        count: kept.len(),
    };
    (sharing, disputed)
}

/// Splits records with a declared noise level into those that agree and those that contradict the others, worst first.
fn undisputed(mut kept: Vec<usize>, fitted: &[Fitted], own: &[Pool]) -> (Vec<usize>, Vec<usize>) {
    let mut disputed = Vec::new();
    let ratio = |i: usize| own[i].variance / math::powi(fitted[i].record.noise.unwrap_or(1.0), 2);
    loop {
        // Two-sided p-value of the F test of this variance against the others.
        let chance = |i: usize| -> f64 {
            let others = || kept.iter().filter(|&&j| j != i && own[j].freedom >= SHOWN);
            let freedom: f64 = others().map(|&j| own[j].freedom).sum();
            let usual = others().map(|&j| ratio(j) * own[j].freedom).sum::<f64>() / freedom;
            let known = own[i].freedom >= SHOWN && freedom >= SHOWN && usual > 0.0;
            if !known {
                return 1.0;
            }
            let below = f_cdf(ratio(i) / usual, own[i].freedom, freedom);
            2.0 * below.min(1.0 - below)
        };
        let least = kept.iter().map(|&i| (i, chance(i))).min_by(|a, b| a.1.total_cmp(&b.1));
        // Of two contradicting records, the one farther from its declared noise level is disputed.
        let least = match (kept.as_slice(), least) {
            ([a, b], Some((_, chance))) if math::ln(ratio(*a)).abs() > math::ln(ratio(*b)).abs() => Some((*a, chance)),
            ([_, b], Some((_, chance))) => Some((*b, chance)),
            (_, least) => least,
        };
        match least.filter(|(_, chance)| *chance < CONTRADICTED) {
            None => return (kept, disputed),
            Some((worst, _)) => {
                kept.retain(|&i| i != worst);
                disputed.push(worst);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a record of `deviations.len()` samples of a channel; their mean is the only coordinate.
    fn constant(signal: &str, noise: Option<f64>, first: usize, deviations: &[f64]) -> Fitted {
        let n = deviations.len();
        let record = Record::new(0, Some(signal.into()), noise, first, vec![1.0; n]);
        Fitted::new(record, DVector::from_column_slice(deviations), DMatrix::from_element(n, 1, 1.0))
    }

    fn chirp(n: i32, size: f64) -> Vec<f64> {
        (0..n).map(|i| size * math::sin(f64::from(i * i))).collect()
    }

    #[test]
    fn the_variance_of_one_record_is_that_about_its_mean() {
        let values = chirp(30, 1.0);
        let mean = values.iter().sum::<f64>() / 30.0;
        let exact = values.iter().map(|v| math::powi(v - mean, 2)).sum::<f64>() / 29.0;
        let found = Sharing::none(1).variances(&[constant("y", None, 0, &values)]);
        assert!((found.pools[0].variance / exact - 1.0).abs() < 1e-9 && (found.pools[0].freedom - 29.0).abs() < 1e-9);
        assert!((found.step[0] + mean).abs() < 1e-12);
    }

    /// Checks that an estimate which depends on two records takes a degree of freedom of both, unlike a noise-weighted
    /// one.
    #[test]
    fn a_shared_estimate_takes_a_degree_of_freedom_of_every_record_that_it_depends_on() {
        let fitted = [constant("y", None, 0, &chirp(100, 1e-3)), constant("z", None, 100, &chirp(10, 1.0))];
        let found = Sharing::none(2).variances(&fitted);
        assert!((found.pools[0].freedom - 99.0).abs() < 1e-6 && (found.pools[1].freedom - 9.0).abs() < 1e-6);
        let values = chirp(10, 1.0);
        let mean = values.iter().sum::<f64>() / 10.0;
        let exact = values.iter().map(|v| math::powi(v - mean, 2)).sum::<f64>() / 9.0;
        assert!((found.pools[1].variance / exact - 1.0).abs() < 1e-6);
    }

    #[test]
    fn declared_noises_are_pooled_unless_a_record_contradicts_the_others() {
        let of = |size: f64, noise: f64, first: usize| constant("y", Some(noise), first, &chirp(40, size));
        let shared = |fitted: &[Fitted]| {
            let own = Sharing::none(fitted.len()).variances(fitted).pools;
            let (sharing, disputed) = sharing(fitted, &own, &vec![true; fitted.len()]);
            (sharing.of_record, disputed)
        };
        assert_eq!(shared(&[of(1.0, 1.0, 0), of(2.0, 2.0, 40), of(3.0, 3.0, 80)]), (vec![0, 0, 0], vec![]));
        assert_eq!(shared(&[of(1.0, 1.0, 0), of(2.0, 20.0, 40), of(3.0, 3.0, 80)]), (vec![0, 1, 0], vec![1]));
    }

    #[test]
    fn a_record_without_freedom_takes_the_variance_of_its_channel() {
        let single = |first: usize| {
            let record = Record::new(0, Some("y".into()), None, first, vec![1.0]);
            let slopes = DMatrix::from_row_slice(1, 2, &[0.0, 1.0]);
            Fitted::new(record, DVector::zeros(1), slopes)
        };
        let mut long = constant("y", None, 0, &chirp(40, 1.0));
        long = Fitted::new(long.record, long.deviations, long.slopes.insert_column(1, 0.0));
        let fitted = [long, single(40)];
        let own = Sharing::none(2).variances(&fitted).pools;
        assert_eq!(sharing(&fitted, &own, &[true, true]).0.of_record, [0, 0]);
    }
}
