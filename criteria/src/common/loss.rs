//! Losses: how much a deviation counts, in standard deviations of the noise.

use mops_core::math;
use schemars::JsonSchema;
use serde::Deserialize;

/// Loss of a deviation `e`, in standard deviations of the noise.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// `e^2`.
    #[default]
    Squares,
    /// `e^2` up to 1.345, linear beyond.
    Huber,
    /// `5 ln(1 + e^2/4)`, that of Student's distribution with 4 degrees of freedom.
    Student,
}

/// Deviation from which Huber's loss is linear: 95 % efficiency for normal noise.
/// Source: P. W. Holland, R. E. Welsch, Robust regression using iteratively reweighted least-squares, Communications in
/// Statistics A6 (1977) 813-827.
const LINEAR: f64 = 1.345;

/// Degrees of freedom of Student's distribution.
/// Source: K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, Journal of the
/// American Statistical Association 84 (1989) 881-896.
const FREEDOM: f64 = 4.0;

impl Loss {
    /// Returns the residual whose square is the loss, with the sign of the deviation, and its derivative.
    pub fn residual(self, e: f64) -> [f64; 2] {
        match self {
            Self::Squares => [e, 1.0],
            Self::Huber if e.abs() <= LINEAR => [e, 1.0],
            Self::Huber => {
                let size = (LINEAR * (2.0 * e.abs() - LINEAR)).sqrt();
                [size.copysign(e), LINEAR / size]
            }
            Self::Student => {
                let slope = ((FREEDOM + 1.0) / FREEDOM).sqrt();
                let size = ((FREEDOM + 1.0) * math::ln_1p(e * e / FREEDOM)).sqrt();
                if size == 0.0 {
                    return [0.0, slope];
                }
                [size.copysign(e), slope * slope * e.abs() / ((1.0 + e * e / FREEDOM) * size)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::assert_near;

    #[test]
    fn residuals_have_their_derivatives_and_grow_slower_than_deviations() {
        for loss in [Loss::Squares, Loss::Huber, Loss::Student] {
            for e in [-20.0, -2.0, -1.0, -1e-9, 0.0, 0.3, 1.3, 1.4, 5.0, 1e6] {
                let [value, slope] = loss.residual(e);
                let h = 1e-6 * (1.0f64).max(e.abs());
                let difference = (loss.residual(e + h)[0] - loss.residual(e - h)[0]) / (2.0 * h);
                assert_near(slope, difference, 1e-5 * (1.0 + slope.abs()));
                assert!(value * e >= 0.0, "{loss:?} {e}");
            }
        }
        assert_near(Loss::Huber.residual(10.0)[0], (1.345f64 * 18.655).sqrt(), 1e-14);
        assert_near(Loss::Student.residual(2.0)[0], (5.0 * std::f64::consts::LN_2).sqrt(), 1e-14);
    }

    #[test]
    fn normal_noise_has_the_mean_losses_of_the_manual() {
        // Riemann sum over the normal density.
        let mean = |loss: Loss| {
            let step = 1e-3;
            let term = |k: i32| {
                let e = step * f64::from(k);
                math::powi(loss.residual(e)[0], 2) * math::exp(-0.5 * e * e)
            };
            (-12_000..=12_000).map(term).sum::<f64>() * step / std::f64::consts::TAU.sqrt()
        };
        assert_near(mean(Loss::Squares), 1.0, 1e-6);
        assert_near(mean(Loss::Huber), 0.933, 5e-4);
        assert_near(mean(Loss::Student), 0.969, 5e-4);
    }
}
