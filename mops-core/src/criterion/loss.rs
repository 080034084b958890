//! Losses: how much a deviation counts, in standard deviations of the noise.

use schemars::JsonSchema;
use serde::Deserialize;

use mops_math as math;

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
/// Source: K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, Journal
/// of the American Statistical Association 84 (1989) 881-896.
const FREEDOM: f64 = 4.0;

/// Largest number of steps of a location, and the last change of one, in standard deviations: far below the error of a
/// mean.
const ROUNDS: usize = 200;
const ACCURATE: f64 = 1e-9;

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

    /// Returns the deviation that has this residual: the inverse of [`Self::residual`].
    pub fn deviation(self, residual: f64) -> f64 {
        match self {
            Self::Huber if residual.abs() > LINEAR => {
                (0.5 * (residual * residual / LINEAR + LINEAR)).copysign(residual)
            }
            Self::Squares | Self::Huber => residual,
            Self::Student => (FREEDOM * math::exp_m1(residual * residual / (FREEDOM + 1.0))).sqrt().copysign(residual),
        }
    }

    /// Returns half the derivative of the loss, the score `psi` of M-estimates, and its derivative.
    pub fn score(self, e: f64) -> [f64; 2] {
        match self {
            Self::Huber if e.abs() > LINEAR => [LINEAR.copysign(e), 0.0],
            Self::Squares | Self::Huber => [e, 1.0],
            Self::Student => {
                let (factor, square) = ((FREEDOM + 1.0) / FREEDOM, e * e / FREEDOM);
                [factor * e / (1.0 + square), factor * (1.0 - square) / math::powi(1.0 + square, 2)]
            }
        }
    }

    /// Returns the location of deviations: the number whose distances to them have scores with the sum 0; for squares,
    /// their mean.
    ///
    /// Iteratively reweighted means from the median. Source: P. J. Huber, E. M. Ronchetti, Robust Statistics (2nd ed.,
    /// 2009), section 6.7.
    #[allow(clippy::cast_precision_loss)]
    pub fn location(self, deviations: &[f64]) -> f64 {
        if self == Self::Squares {
            return deviations.iter().sum::<f64>() / deviations.len() as f64;
        }
        let mut sorted = deviations.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mut location = sorted[sorted.len() / 2];
        for _ in 0..ROUNDS {
            let weight = |e: f64| if e == 0.0 { self.score(0.0)[1] } else { self.score(e)[0] / e };
            let (mut sum, mut total) = (0.0, 0.0);
            for deviation in deviations {
                let weight = weight(deviation - location);
                (sum, total) = (sum + weight * deviation, total + weight);
            }
            let change = sum / total - location;
            location += change;
            if change.abs() <= ACCURATE {
                break;
            }
        }
        location
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: f64, exact: f64, tolerance: f64) {
        assert!((found - exact).abs() <= tolerance, "{found}, not {exact}");
    }

    #[test]
    fn residuals_have_their_derivatives_and_grow_slower_than_deviations() {
        for loss in [Loss::Squares, Loss::Huber, Loss::Student] {
            for e in [-20.0, -2.0, -1.0, -1e-9, 0.0, 0.3, 1.3, 1.4, 5.0, 1e6] {
                let [value, slope] = loss.residual(e);
                let h = 1e-6 * (1.0f64).max(e.abs());
                let difference = (loss.residual(e + h)[0] - loss.residual(e - h)[0]) / (2.0 * h);
                assert_near(slope, difference, 1e-5 * (1.0 + slope.abs()));
                assert!(value * e >= 0.0, "{loss:?} {e}");
                assert_near(loss.deviation(value), e, 1e-9 * e.abs());
                // Half the derivative of the squared residual.
                let [score, change] = loss.score(e);
                assert_near(score, value * slope, 1e-12 * (1.0 + score.abs()));
                let difference = (loss.score(e + h)[0] - loss.score(e - h)[0]) / (2.0 * h);
                assert_near(change, difference, 1e-5 * (1.0 + change.abs()));
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

    #[test]
    fn a_location_has_scores_that_cancel() {
        let values = [0.1, -0.4, 0.7, 0.2, -0.3, 25.0, 0.0];
        assert_near(Loss::Squares.location(&values), 25.3 / 7.0, 1e-14);
        for loss in [Loss::Huber, Loss::Student] {
            let at = loss.location(&values);
            assert_near(values.iter().map(|v| loss.score(v - at)[0]).sum(), 0.0, 1e-7);
            assert!(at.abs() < 0.5, "{loss:?} {at}");
        }
    }
}
