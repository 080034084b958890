//! Rates with confidence intervals, and the reliability of stated probabilities.

use mops::math;

/// Observed rate of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Rate {
    /// Number of occurrences.
    pub hits: usize,
    /// Number of trials.
    pub of: usize,
}

impl Rate {
    /// Counts the true values.
    pub fn of(facts: impl IntoIterator<Item = bool>) -> Self {
        facts.into_iter().fold(Self::default(), |rate, so| Self { hits: rate.hits + usize::from(so), of: rate.of + 1 })
    }

    /// Returns the relative frequency; NaN without trials.
    #[allow(clippy::cast_precision_loss)]
    pub fn share(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// Returns an interval that contains the true rate with probability at least 0.95.
    ///
    /// Source: C. J. Clopper, E. S. Pearson, The use of confidence or fiducial limits illustrated in the case of the
    /// binomial, Biometrika 26 (1934).
    pub fn interval95(self) -> [f64; 2] {
        let Self { hits, of } = self;
        let low = if hits == 0 { 0.0 } else { root(|p| at_least(hits, of, p) - 0.025) };
        let high = if hits == of { 1.0 } else { root(|p| 0.025 - (1.0 - at_least(hits + 1, of, p))) };
        [low, high]
    }
}

/// Returns the binomial probability of at least `hits` of `of` at a rate.
#[allow(clippy::cast_precision_loss)]
fn at_least(hits: usize, of: usize, rate: f64) -> f64 {
    let mut choose = 0.0; // logarithm of the number of ways
    let mut sum = 0.0;
    for k in 0..=of {
        if k > 0 {
            choose += math::ln((of - k + 1) as f64 / k as f64);
        }
        if k >= hits {
            sum += math::exp(choose + k as f64 * math::ln(rate) + (of - k) as f64 * math::ln_1p(-rate));
        }
    }
    sum
}

/// Returns the root of an increasing function in [0, 1], by bisection.
fn root(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Edges of the bins of a reliability diagram.
const EDGES: [f64; 9] = [0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 0.99, 1.0];

/// Bin of a reliability diagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bin {
    /// Lower and upper edge.
    pub edges: [f64; 2],
    /// Mean of the stated probabilities.
    pub stated: f64,
    /// Observed rate.
    pub observed: Rate,
}

/// Groups pairs of stated probability and outcome into bins; empty bins are omitted.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn reliability(stated: &[(f64, bool)]) -> Vec<Bin> {
    let bins = EDGES.windows(2).map(|edges| {
        let inside = |p: f64| p >= edges[0] && (p < edges[1] || (edges[1] == 1.0 && p <= 1.0));
        let members: Vec<&(f64, bool)> = stated.iter().filter(|(p, _)| inside(*p)).collect();
        let sum: f64 = members.iter().map(|(p, _)| p).sum();
        let observed = Rate::of(members.iter().map(|(_, so)| *so));
        Bin { edges: [edges[0], edges[1]], stated: sum / members.len() as f64, observed }
    });
    bins.filter(|bin| bin.observed.of > 0).collect()
}

/// Returns the Brier score: the mean squared difference between stated probability and outcome. Source: G. W. Brier,
/// Verification of forecasts expressed in terms of probability, Monthly Weather Review 78 (1950).
#[allow(clippy::cast_precision_loss)]
pub(crate) fn brier(stated: &[(f64, bool)]) -> f64 {
    stated.iter().map(|(p, so)| math::powi(p - f64::from(u8::from(*so)), 2)).sum::<f64>() / stated.len() as f64
}

/// Returns the Kolmogorov-Smirnov distance between the values and the uniform distribution on [0, 1], and its 5 %
/// critical value for this sample size. Source: M. A. Stephens, EDF statistics for goodness of fit and some
/// comparisons, JASA 69 (1974), table 1A.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn uniformity(values: &[f64]) -> (f64, f64) {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let gaps = sorted.iter().enumerate().map(|(i, v)| ((i + 1) as f64 / n - v).max(v - i as f64 / n));
    (gaps.fold(0.0, f64::max), 1.358 / (n.sqrt() + 0.12 + 0.11 / n.sqrt()))
}

/// Counts the values in each tenth of [0, 1].
pub(crate) fn deciles(values: &[f64]) -> [usize; 10] {
    let mut counts = [0; 10];
    for value in values.iter().filter(|v| v.is_finite()) {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let index = ((value.clamp(0.0, 1.0) * 10.0) as usize).min(9);
        counts[index] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_published_tables() {
        // 0 of n: 1 - 0.025^(1/n). 1 of 10 and 5 of 10: 0.0025 to 0.4450, 0.1871 to 0.8129.
        let [low, high] = Rate { hits: 0, of: 1000 }.interval95();
        assert!(low == 0.0 && (high - (1.0 - math::powf(0.025, 1e-3))).abs() < 1e-9, "{high}");
        for (hits, expected) in [(1, [0.0025, 0.4450]), (5, [0.1871, 0.8129]), (10, [0.6915, 1.0])] {
            let interval = Rate { hits, of: 10 }.interval95();
            assert!(interval.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{interval:?} {expected:?}");
        }
    }

    #[test]
    fn correct_probabilities_have_the_smallest_brier_score() {
        let stated = |p: f64| -> Vec<(f64, bool)> { (0..10).map(|i| (p, i < 7)).collect() };
        assert!((brier(&stated(0.7)) - 0.21).abs() < 1e-12);
        assert!(brier(&stated(0.9)) > brier(&stated(0.7)) && brier(&stated(0.5)) > brier(&stated(0.7)));
        let bins = reliability(&stated(0.7));
        assert_eq!((bins.len(), bins[0].edges, bins[0].observed), (1, [0.6, 0.8], Rate { hits: 7, of: 10 }));
        assert_eq!(reliability(&[(1.0, true), (0.995, false)])[0].observed.of, 2);
    }

    #[test]
    fn an_even_grid_is_uniform_and_its_square_is_not() {
        let even: Vec<f64> = (0..200).map(|i| (f64::from(i) + 0.5) / 200.0).collect();
        let (distance, limit) = uniformity(&even);
        assert!((distance - 0.0025).abs() < 1e-12 && (limit - 0.0951).abs() < 1e-3, "{distance} {limit}");
        let squares: Vec<f64> = even.iter().map(|v| v * v).collect();
        assert!((uniformity(&squares).0 - 0.25).abs() < 0.01);
        assert_eq!(deciles(&even), [20; 10]);
        assert_eq!(deciles(&[1.0, f64::NAN]), [0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
    }
}
