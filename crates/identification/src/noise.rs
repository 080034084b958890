//! Noise of the residuals of a calibration, record by record: the basis of the standard errors of estimates.

use mops_core::criterion::Loss;
use mops_math as math;
use nalgebra::{DMatrix, DVector};

use crate::pools::{self, Fitted, Pool, SHOWN, Sharing, Weighted};
use crate::records::Record;
use crate::whiteness::whiteness;

/// Largest leverage of a sample whose residual still shows its noise.
///
/// A sample with higher leverage is fitted by a parameter of its own; its residual is 0 up to rounding.
const FITTED_ALONE: f64 = 0.999;

/// Noise of all residuals.
///
/// A record whose residuals are white with constant variance has a single variance (`Sharing::variances`):
/// - Each record without a declared noise level has its own variance.
/// - Records with a declared noise level share one factor on their declared variances. Records that contradict the
///   others (F test) have their own variance too.
///
/// Every other record enters with its own residuals, corrected for leverage, `e_s / sqrt(1 - h_s)`. Their squares enter
/// and, if they are not white, also products of neighbours with Bartlett's window. That estimate is uncertain and
/// biased low; it never counts for less than white noise of the same magnitude.
///
/// Sources: H. White, Econometrica 48 (1980) 817-838 (sandwich); J. G. MacKinnon, H. White, Journal of Econometrics 29
/// (1985) 305-325 (HC2, leverage); W. K. Newey, K. D. West, Econometrica 55 (1987) 703-708 (correlated residuals).
#[derive(Debug, Clone)]
pub struct Noise {
    sources: Vec<Source>,
    pools: Vec<Pool>,
    /// Change and standard error of the estimate of every tuner with samples weighted by their noise level only, to
    /// first order.
    weighted: Vec<(f64, f64)>,
    /// Large deviations on one side, beside robust losses.
    one_sided: Vec<OneSided>,
}

/// Noise of one record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordNoise<'a> {
    /// Index of the record's case.
    pub case: usize,
    /// Measured signal.
    pub signal: &'a str,
    /// Noise level of one sample that the residuals show, in the unit of the signal; NaN if they do not show it.
    pub level: f64,
    /// Declared noise level of one sample.
    pub declared: Option<f64>,
    /// True if the residuals contradict the declared noise level.
    pub is_disputed: bool,
    /// True if the residuals are white but their variance changes.
    pub is_changing: bool,
}

/// Large deviations of a record that are on one side.
#[derive(Debug, Clone)]
pub struct OneSided {
    /// Index of the record's case.
    pub case: usize,
    /// Measured signal.
    pub signal: String,
    /// Number of large deviations.
    pub count: usize,
    /// Number of them with a measured value above the simulated one.
    pub above: usize,
    /// Change of the estimate of every tuner without these samples, in its unit, to first order.
    pub changes: Vec<f64>,
}

/// Ratio of the samples to the large deviations below which these are no outliers: the model does not describe the
/// data.
const OUTLIERS: usize = 5;

/// Probability below which large deviations are on one side by more than chance.
const BY_CHANCE: f64 = 0.01;

/// Record and its noise model.
#[derive(Debug, Clone)]
struct Source {
    record: Record,
    shape: Shape,
    /// Index of the pool that defines the variance of the record.
    pool: usize,
    /// True if the residuals contradict the declared noise level.
    disputed: bool,
    /// True if the residuals are white but their variance changes.
    changing: bool,
}

/// Noise model of a record, up to the variance of its pool.
#[derive(Debug, Clone)]
enum Shape {
    /// White noise with this standard deviation.
    White(f64),
    /// Sampled noise: deviations corrected for leverage; products of samples less than `bandwidth` apart count.
    Sampled { deviations: Vec<f64>, bandwidth: usize },
}

/// Contribution `variance * matrix` to the covariance of estimates; the pool has the variance and its degrees of
/// freedom.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub matrix: DMatrix<f64>,
    pub pool: Pool,
}

/// Standard deviation of a quantity, with its degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation; NaN if the data do not show the noise.
    pub deviation: f64,
    /// Degrees of freedom of Student's t; infinite if the noise is known.
    pub freedom: f64,
}

impl Spread {
    /// Returns half the width of the confidence interval of the given `level`: t quantile times standard deviation. NaN
    /// below one degree of freedom.
    pub fn half_width(&self, level: f64) -> f64 {
        if self.freedom < 1.0 || self.freedom.is_nan() {
            return f64::NAN;
        }
        self.deviation * mops_statistics::t_quantile(0.5 + 0.5 * level, self.freedom)
    }

    /// Returns the square root of a weighted sum of pool variances. Source: F. E. Satterthwaite, Biometrics Bulletin 2
    /// (1946) 110-114.
    pub(crate) fn of_sum(shares: impl Iterator<Item = (f64, Pool)>) -> Self {
        let (mut total, mut uncertain) = (0.0, 0.0);
        // N.B.: an unknown variance with weight zero does not count.
        for (share, pool) in shares.filter(|(share, _)| *share != 0.0) {
            let variance = share * pool.variance;
            total += variance;
            uncertain += variance * variance / pool.freedom;
        }
        let freedom = if uncertain == 0.0 { f64::INFINITY } else { total * total / uncertain };
        Self { deviation: total.max(0.0).sqrt(), freedom }
    }
}

impl Noise {
    /// Estimates the noise from residuals and their Jacobian.
    ///
    /// `basis` spans the directions of the tuners that the Jacobian resolves, such that `J basis` has orthonormal
    /// columns.
    pub(crate) fn of(records: Vec<Record>, residuals: &[f64], jacobian: &DMatrix<f64>, basis: &DMatrix<f64>) -> Self {
        let fitted = |record: Record| {
            let deviations = DVector::from_vec(record.deviations(residuals));
            let slopes = record.per_deviation(jacobian) * basis;
            Fitted::new(record, deviations, slopes)
        };
        let fitted: Vec<Fitted> = records.into_iter().map(fitted).collect();
        // Each record alone shows the character of its noise.
        let alone = Sharing::none(fitted.len());
        let own = alone.variances(&fitted);
        let found: Vec<Character> =
            fitted.iter().enumerate().map(|(i, of)| Character::of(of, &own, alone.variance(&own.pools, i))).collect();
        let white: Vec<bool> = found.iter().map(|found| matches!(found.shape, Shape::White(_))).collect();
        let (sharing, disputed) = pools::sharing(&fitted, &own.pools, &white);
        let weighted = sharing.variances(&fitted);
        let one_sided = fitted.iter().filter_map(|of| OneSided::of(of, basis)).collect();
        let [step, errors] = [basis * &weighted.step, (basis * &weighted.covariance * basis.transpose()).diagonal()];
        let mut pools = weighted.pools;
        let mut sources = Vec::with_capacity(fitted.len());
        for (i, (of, mut found)) in fitted.into_iter().zip(found).enumerate() {
            let pool = &mut pools[sharing.of_record[i]];
            match &mut found.shape {
                Shape::White(deviation) => *deviation = sharing.relative[i],
                // The window leaves about that many independent products: the reciprocal of the integral of its square,
                // 2/3.
                #[allow(clippy::cast_precision_loss)]
                Shape::Sampled { bandwidth, .. } => {
                    let window = (2.0 * *bandwidth as f64 / 3.0).max(1.0);
                    *pool = Pool { variance: 1.0, freedom: pool.freedom / window };
                }
            }
            if pool.freedom < SHOWN {
                let is_declared = white[i] && of.record.noise.is_some();
                let known = Pool { variance: 1.0, freedom: f64::INFINITY };
                *pool = if is_declared { known } else { Pool { variance: f64::NAN, ..*pool } };
            }
            sources.push(Source {
                record: of.record,
                shape: found.shape,
                changing: found.changing,
                pool: sharing.of_record[i],
                disputed: disputed.contains(&i),
            });
        }
        let weighted = step.iter().zip(&errors).map(|(step, error)| (*step, error.max(0.0).sqrt())).collect();
        Self { sources, pools, weighted, one_sided }
    }

    /// Returns the noise declared in a study, for records whose residuals show none; `tuners` is the number of tuners.
    pub(crate) fn declared(records: Vec<Record>, tuners: usize) -> Self {
        let known = Pool { variance: 1.0, freedom: f64::INFINITY };
        let unknown = Pool { variance: f64::NAN, freedom: 0.0 };
        let source = |record: Record| Source {
            shape: Shape::White(record.noise.unwrap_or(1.0)),
            pool: usize::from(record.noise.is_none()),
            record,
            disputed: false,
            changing: false,
        };
        let sources = records.into_iter().map(source).collect();
        Self {
            sources,
            pools: vec![known, unknown],
            weighted: vec![(f64::NAN, f64::NAN); tuners],
            one_sided: Vec::new(),
        }
    }

    /// Returns the covariance of `columns' * residuals`, in parts of independent noise.
    pub(crate) fn parts(&self, columns: &DMatrix<f64>) -> Vec<Part> {
        let n = columns.ncols();
        let mut matrices = vec![DMatrix::zeros(n, n); self.pools.len()];
        for source in &self.sources {
            matrices[source.pool] += source.shape.covariance(source.record.collected(columns));
        }
        matrices.into_iter().zip(&self.pools).map(|(matrix, pool)| Part { matrix, pool: *pool }).collect()
    }

    /// Returns the spread of a weighted sum of the residuals, with one weight each.
    pub fn along(&self, weights: &[f64]) -> Spread {
        let column = DMatrix::from_column_slice(weights.len(), 1, weights);
        let parts = self.parts(&column);
        Spread::of_sum(parts.iter().map(|part| (part.matrix[(0, 0)], part.pool)))
    }

    /// Returns the degrees of freedom of all noise together; infinite if the noise of some record is known.
    pub fn freedom(&self) -> f64 {
        let is_known = |pool: &usize| self.pools[*pool].variance.is_finite();
        let mut pools: Vec<usize> = self.sources.iter().map(|source| source.pool).filter(is_known).collect();
        pools.sort_unstable();
        pools.dedup();
        pools.into_iter().map(|pool| self.pools[pool].freedom).sum()
    }

    /// Returns the noise level of one sample of a channel in a case. NaN if the data do not show it, `None` if the
    /// channel is not fitted.
    pub fn of_channel(&self, case: usize, signal: &str) -> Option<f64> {
        let is_wanted =
            |source: &&Source| (source.record.case, source.record.signal.as_deref()) == (case, Some(signal));
        self.sources.iter().find(is_wanted).map(|source| self.deviation(source))
    }

    /// Returns the loss of a channel in a case, and its unit; `None` if the channel is not fitted.
    pub fn loss_of_channel(&self, case: usize, signal: &str) -> Option<(Loss, f64)> {
        let is_wanted = |record: &&Record| (record.case, record.signal.as_deref()) == (case, Some(signal));
        self.records().find(is_wanted).map(Record::loss)
    }

    /// Returns the noise of every record of a measured signal.
    pub fn of_records(&self) -> impl Iterator<Item = RecordNoise<'_>> {
        self.sources.iter().filter_map(|source| {
            Some(RecordNoise {
                case: source.record.case,
                signal: source.record.signal.as_deref()?,
                level: self.deviation(source),
                declared: source.record.noise,
                is_disputed: source.disputed,
                is_changing: source.changing,
            })
        })
    }

    /// Returns the large deviations on one side, beside robust losses.
    pub fn one_sided(&self) -> &[OneSided] {
        &self.one_sided
    }

    /// Returns the change and standard error of the estimate of every tuner, in its unit, with samples weighted by
    /// their noise level only.
    ///
    /// The change is one Gauss-Newton step. Source: E. L. Lehmann, G. Casella, Theory of Point Estimation, 2nd edition
    /// (1998), section 6.4.
    pub(crate) fn weighted(&self) -> &[(f64, f64)] {
        &self.weighted
    }

    /// Returns all records.
    pub(crate) fn records(&self) -> impl Iterator<Item = &Record> {
        self.sources.iter().map(|source| &source.record)
    }

    fn deviation(&self, source: &Source) -> f64 {
        let variance = match &source.shape {
            Shape::White(deviation) => deviation * deviation,
            Shape::Sampled { deviations, .. } => mean_square(deviations),
        };
        (self.pools[source.pool].variance * variance).sqrt()
    }
}

impl OneSided {
    /// Returns the large deviations of a record with a robust loss, if a sign test finds them on one side; `basis` as
    /// for [`Noise::of`].
    ///
    /// Without these samples, the normal equations of the step `x` are `sum w (s x + d) s = 0` over the others; over
    /// all samples, `sum w d s = 0` and `sum w s s' = 1`.
    fn of(of: &Fitted, basis: &DMatrix<f64>) -> Option<Self> {
        let tail = of.record.tail.as_ref()?;
        let count = tail.samples.len();
        let rare = tail.above.min(count - tail.above);
        // Where a good part of the samples is that far off, the model is, and not the samples.
        if OUTLIERS * count > of.record.len() || 2.0 * half_binomial(count, rare) >= BY_CHANCE {
            return None;
        }
        let n = of.slopes.ncols();
        let (mut information, mut pull) = (DMatrix::identity(n, n), DVector::zeros(n));
        for &sample in &tail.samples {
            let (slopes, weight) = (of.slopes.row(sample).transpose(), of.record.weight_of(sample));
            information -= &slopes * slopes.transpose() * weight;
            pull += &slopes * (weight * of.deviations[sample]);
        }
        let step = information.cholesky()?.solve(&pull);
        Some(Self {
            case: of.record.case,
            signal: of.record.signal.clone()?,
            count,
            above: tail.above,
            changes: (basis * step).as_slice().to_vec(),
        })
    }
}

/// Returns the probability that at most `most` of `count` tosses of a coin are heads.
#[allow(clippy::cast_precision_loss)]
fn half_binomial(count: usize, most: usize) -> f64 {
    // From the largest term down: the smallest ones are below the number range.
    let [n, k] = [count, most].map(|x| x as f64);
    let choices = math::ln_gamma(n + 1.0) - math::ln_gamma(k + 1.0) - math::ln_gamma(n - k + 1.0);
    let (mut term, mut sum) = (math::exp(choices - n * std::f64::consts::LN_2), 0.0);
    for k in (0..=most).rev() {
        sum += term;
        term *= k as f64 / (count - k + 1) as f64;
    }
    sum
}

/// Character of the residuals of a record.
struct Character {
    shape: Shape,
    /// True if the residuals are white but their variance changes.
    changing: bool,
}

impl Character {
    /// Determines the character of a record from the noise-weighted fit, whose residuals are not distorted by other
    /// records. `variance` is that of the record.
    fn of(of: &Fitted, fit: &Weighted, variance: f64) -> Self {
        let deviations = &of.deviations + &of.slopes * &fit.step;
        let squares: Vec<f64> = deviations.iter().map(|e| e * e).collect();
        let is_white = |values: &[f64]| whiteness(values).is_none_or(|found| found.is_white());
        let white = is_white(deviations.as_slice());
        // Squares that are not white indicate a changing variance. Source: A. I. McLeod, W. K. Li, Journal of Time
        // Series Analysis 4 (1983) 269-273.
        let changing = white && !is_white(&squares);
        if white && !changing {
            return Self { shape: Shape::White(1.0), changing };
        }
        let spread = &of.slopes * &fit.covariance;
        let leverages: Vec<f64> =
            (0..of.record.len()).map(|s| spread.row(s).dot(&of.slopes.row(s)) / variance).collect();
        let bandwidth = if changing { 1 } else { bandwidth(deviations.as_slice()) };
        Self { shape: Shape::Sampled { deviations: corrected(deviations.as_slice(), &leverages), bandwidth }, changing }
    }
}

impl Shape {
    /// Returns the covariance of sums over samples under this noise; `pull` has a row per sample and a column per sum.
    fn covariance(&self, pull: DMatrix<f64>) -> DMatrix<f64> {
        match self {
            Self::White(deviation) => pull.tr_mul(&pull) * (deviation * deviation),
            Self::Sampled { deviations, bandwidth } => {
                let mut scores = pull.clone();
                for (mut row, deviation) in scores.row_iter_mut().zip(deviations) {
                    row *= *deviation;
                }
                if *bandwidth == 1 {
                    return scores.tr_mul(&scores);
                }
                let sums = window_sums(&scores, *bandwidth);
                let found = sums.tr_mul(&sums);
                let white = pull.tr_mul(&pull) * mean_square(deviations);
                let least = |k: usize| {
                    let ratio = white[(k, k)] / found[(k, k)];
                    if ratio > 1.0 { ratio.sqrt() } else { 1.0 }
                };
                let factors: Vec<f64> = (0..found.ncols()).map(least).collect();
                DMatrix::from_fn(found.nrows(), found.ncols(), |a, b| factors[a] * found[(a, b)] * factors[b])
            }
        }
    }
}

/// Returns sums over all windows of `bandwidth` neighbours, divided by the square root of `bandwidth`; partial windows
/// at the ends count.
///
/// Their sum of squares equals products of samples with the weights `1 - lag/bandwidth`: the Newey-West estimate.
fn window_sums(scores: &DMatrix<f64>, bandwidth: usize) -> DMatrix<f64> {
    let count = scores.nrows();
    let mut sums = DMatrix::zeros(count + bandwidth - 1, scores.ncols());
    #[allow(clippy::cast_precision_loss)]
    let root = (bandwidth as f64).sqrt();
    for (mut sums, scores) in sums.column_iter_mut().zip(scores.column_iter()) {
        let mut sum = 0.0;
        for s in 0..sums.len() {
            if s < count {
                sum += scores[s];
            }
            if s >= bandwidth {
                sum -= scores[s - bandwidth];
            }
            sums[s] = sum / root;
        }
    }
    sums
}

#[allow(clippy::cast_precision_loss)]
fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

/// Returns the deviations divided by `sqrt(1 - leverage)`, so that their squares have the variance of homoscedastic
/// noise.
#[allow(clippy::cast_precision_loss)]
fn corrected(deviations: &[f64], leverages: &[f64]) -> Vec<f64> {
    let free = || deviations.iter().zip(leverages).filter(|(_, h)| **h < FITTED_ALONE);
    let correct = |(e, h): (&f64, &f64)| e / (1.0 - h).sqrt();
    let usual = (free().map(correct).map(|e| e * e).sum::<f64>() / free().count().max(1) as f64).sqrt();
    deviations.iter().zip(leverages).map(|(e, h)| if *h < FITTED_ALONE { correct((e, h)) } else { usual }).collect()
}

/// Returns the bandwidth for correlated deviations, in samples.
///
/// The value is Andrews' for first-order noise with the lag-1 autocorrelation of the deviations. It is at least the
/// Newey-West rule of thumb, and at most a third of the record.
///
/// Sources: D. W. K. Andrews, Econometrica 59 (1991) 817-858, equations 6.2 and 6.4; W. K. Newey, K. D. West, Review of
/// Economic Studies 61 (1994) 631-653.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn bandwidth(deviations: &[f64]) -> usize {
    /// Largest autocorrelation; beyond it the rule grows without bounds. Source: D. W. K. Andrews, J. C. Monahan,
    /// Econometrica 60 (1992) 953-966.
    const MOST: f64 = 0.97;
    let n = deviations.len() as f64;
    let rho = whiteness(deviations).map_or(0.0, |found| found.lag1.clamp(-MOST, MOST));
    let alpha = 4.0 * rho * rho / (math::powi(1.0 - rho, 2) * math::powi(1.0 + rho, 2));
    let andrews = 1.1447 * math::cbrt(alpha * n);
    let usual = 1.0 + 4.0 * math::powf(n / 100.0, 2.0 / 9.0);
    (andrews.max(usual).round() as usize).clamp(1, (deviations.len() / 3).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_over_windows_have_the_squares_of_newey_and_west() {
        let scores = DMatrix::from_fn(50, 2, |s, k| math::sin((s * s) as f64 * 0.7 + k as f64));
        for bandwidth in [1, 2, 7, 49] {
            let sums = window_sums(&scores, bandwidth);
            let found = sums.tr_mul(&sums);
            for (a, b) in [(0, 0), (0, 1), (1, 1)] {
                let products = |lag: usize| (lag..50).map(|s| scores[(s, a)] * scores[(s - lag, b)]).sum::<f64>();
                let turned = |lag: usize| (lag..50).map(|s| scores[(s, b)] * scores[(s - lag, a)]).sum::<f64>();
                let weight = |lag: usize| 1.0 - lag as f64 / bandwidth as f64;
                let exact = products(0) + (1..bandwidth).map(|l| weight(l) * (products(l) + turned(l))).sum::<f64>();
                assert!((found[(a, b)] - exact).abs() < 1e-12 * 50.0, "{bandwidth}");
            }
        }
    }

    /// Checks Welch's two-sample test: (1 + 2)^2 / (1^2/9 + 2^2/4) degrees of freedom.
    #[test]
    fn a_sum_of_variances_has_the_freedom_of_satterthwaite() {
        let pool = |variance: f64, freedom: f64| Pool { variance, freedom };
        let sum = Spread::of_sum([(1.0, pool(1.0, 9.0)), (0.5, pool(4.0, 4.0))].into_iter());
        assert!((sum.deviation - 3f64.sqrt()).abs() < 1e-15 && (sum.freedom - 9.0 / (1.0 / 9.0 + 1.0)).abs() < 1e-12);
        let known = Spread::of_sum([(1.0, pool(1.0, f64::INFINITY)), (0.0, pool(f64::NAN, 0.0))].into_iter());
        assert_eq!(known, Spread { deviation: 1.0, freedom: f64::INFINITY });
        assert!((known.half_width(0.95) - 1.959_964).abs() < 1e-6);
        assert!(Spread::of_sum([(1.0, pool(f64::NAN, 0.5))].into_iter()).half_width(0.95).is_nan());
    }

    #[test]
    fn a_sign_test_sums_the_tail_of_the_binomial_distribution() {
        // Of ten tosses: 1 + 10 of 1024.
        assert!((half_binomial(10, 1) - 11.0 / 1024.0).abs() < 1e-13);
        assert!((half_binomial(0, 0) - 1.0).abs() < 1e-13 && (half_binomial(7, 7) - 1.0).abs() < 1e-13);
        assert!((half_binomial(4001, 2000) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn correlated_noise_counts_for_no_less_than_white_noise_of_its_size() {
        let pull = DMatrix::from_element(40, 1, 1.0);
        let of = |value: fn(i32) -> f64| {
            let deviations: Vec<f64> = (0..40).map(value).collect();
            Shape::Sampled { deviations, bandwidth: 8 }.covariance(pull.clone())[(0, 0)]
        };
        // Neighbours of opposite signs cancel in a mean; runs of ten add up.
        assert!((of(|i| if i % 2 == 0 { 1.0 } else { -1.0 }) - 40.0).abs() < 1e-12);
        assert!(of(|i| if i % 20 < 10 { 1.0 } else { -1.0 }) > 120.0);
    }
}
