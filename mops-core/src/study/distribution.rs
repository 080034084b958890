//! Uncertain parameters: range and distribution.

use mops_language::Unit;
use mops_math as math;
use mops_statistics::{normal_cdf, normal_quantile};

/// An uncertain parameter of models, or an uncertain tuner.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// Name of the parameter or tuner.
    pub name: String,
    /// Index of the tuner, if the parameter is a tuner.
    pub tuner: Option<usize>,
    /// Unit of all numbers.
    pub unit: Unit,
    /// Smallest and largest value; infinite if unbounded.
    pub bounds: [f64; 2],
    /// Largest relative deviation of a tuner from its value; the bounds follow from the design.
    pub tolerance: Option<f64>,
    /// Distribution of the values.
    pub distribution: Distribution,
}

/// Distribution of an uncertain parameter, truncated at the bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Uniform between the bounds.
    Uniform,
    /// Normal, with the density proportional to `exp(-(x - mean)^2 / (2 deviation^2))`.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
    /// Log-normal: the logarithm is normal.
    LogNormal {
        /// Median.
        median: f64,
        /// Standard deviation of the natural logarithm.
        deviation: f64,
    },
    /// Triangular: the density rises linearly from the lower bound to the mode and falls to the upper bound.
    Triangular {
        /// Most probable value.
        mode: f64,
    },
}

impl Distribution {
    /// Returns the probability of a value up to `x`, without truncation; `bounds` only define uniform and triangular
    /// distributions.
    pub(super) fn below(self, x: f64, [min, max]: [f64; 2]) -> f64 {
        match self {
            Self::Uniform => ((x - min) / (max - min)).clamp(0.0, 1.0),
            Self::Normal { mean, deviation } => normal_cdf((x - mean) / deviation),
            Self::LogNormal { .. } if x <= 0.0 => 0.0,
            Self::LogNormal { median, deviation } => normal_cdf(math::ln(x / median) / deviation),
            Self::Triangular { mode } if x <= mode => {
                if x <= min {
                    0.0
                } else {
                    math::powi(x - min, 2) / ((max - min) * (mode - min))
                }
            }
            Self::Triangular { mode } => {
                if x >= max {
                    1.0
                } else {
                    1.0 - math::powi(max - x, 2) / ((max - min) * (max - mode))
                }
            }
        }
    }

    /// Returns the `p` quantile, without truncation.
    fn quantile(self, p: f64, [min, max]: [f64; 2]) -> f64 {
        match self {
            Self::Uniform => min + p * (max - min),
            Self::Normal { mean, deviation } => mean + deviation * normal_quantile(p),
            Self::LogNormal { median, deviation } => median * math::exp(deviation * normal_quantile(p)),
            Self::Triangular { mode } => {
                let (span, rise) = (max - min, mode - min);
                if p * span <= rise {
                    min + (p * span * rise).sqrt()
                } else {
                    max - ((1.0 - p) * span * (max - mode)).sqrt()
                }
            }
        }
    }
}

impl Uncertain {
    /// Returns the `p` quantile of the truncated distribution, for `p` in (0, 1).
    pub fn quantile(&self, p: f64) -> f64 {
        let [low, high] = self.bounds.map(|bound| self.distribution.below(bound, self.bounds));
        let value = self.distribution.quantile(low + p * (high - low), self.bounds);
        value.clamp(self.bounds[0], self.bounds[1])
    }

    /// Returns true if both bounds are finite.
    pub fn is_bounded(&self) -> bool {
        self.tolerance.is_some() || self.bounds.iter().all(|bound| bound.is_finite())
    }

    /// Returns the uncertain parameter for a design: a tolerance becomes bounds.
    pub(super) fn at(&self, tuners: &[f64]) -> Self {
        let mut settled = self.clone();
        if let (Some(share), Some(tuner)) = (self.tolerance, self.tuner) {
            let half = share * tuners[tuner].abs();
            settled.bounds = [tuners[tuner] - half, tuners[tuner] + half];
        }
        settled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uncertain(distribution: Distribution, bounds: [f64; 2]) -> Uncertain {
        Uncertain { name: "a".into(), tuner: None, unit: Unit::one(), bounds, tolerance: None, distribution }
    }

    const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Published quantiles of the normal distribution: 0.8413447, 0.9772499 at one and two deviations.
    #[test]
    fn quantiles_are_those_of_closed_forms() {
        let normal = uncertain(Distribution::Normal { mean: 2.0, deviation: 0.5 }, FREE);
        let log = uncertain(Distribution::LogNormal { median: 3.0, deviation: 0.2 }, [0.0, f64::INFINITY]);
        let triangle = uncertain(Distribution::Triangular { mode: 1.0 }, [0.0, 4.0]);
        let uniform = uncertain(Distribution::Uniform, [-1.0, 3.0]);
        for (found, exact) in [
            (normal.quantile(0.841_344_746_068_542_9), 2.5),
            (normal.quantile(0.022_750_131_948_179_21), 1.0),
            (log.quantile(0.841_344_746_068_542_9), 3.0 * math::exp(0.2)),
            (log.quantile(0.5), 3.0),
            (triangle.quantile(0.25), 1.0),
            (triangle.quantile(0.0625), 0.5),
            (triangle.quantile(1.0 - 1.0 / 12.0), 3.0),
            (uniform.quantile(0.25), 0.0),
        ] {
            assert!((found - exact).abs() < 1e-9, "{found} {exact}");
        }
    }

    #[test]
    fn distributions_are_truncated_at_the_bounds() {
        // The median of half a normal distribution is the upper quartile of the full one.
        let half = uncertain(Distribution::Normal { mean: 0.0, deviation: 1.0 }, [0.0, f64::INFINITY]);
        assert!((half.quantile(0.5) - 0.674_489_750_196_081_7).abs() < 1e-9);
        let narrow = uncertain(Distribution::Normal { mean: 0.0, deviation: 1.0 }, [-0.1, 0.3]);
        assert!((0..=100).all(|i| (-0.1..=0.3).contains(&narrow.quantile(f64::from(i) / 100.0))));
    }
}
