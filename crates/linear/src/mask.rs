//! Masks over frequency: bounds of a gain.

use mops_math as math;
use mops_math::complex;

use super::bounded_response::{BoundedResponse, Closed, Span};
use super::search::highest;
use super::{Complex, Loop, StateSpace};

/// Bound of a gain over a range of frequencies, log-log-linear between its points.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// Points: angular frequency, rad/s, positive and increasing, and natural logarithm of the gain.
    points: Vec<[f64; 2]>,
    /// True for an upper bound.
    is_upper: bool,
}

/// Transfer function whose gain a mask bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Masked {
    /// The system.
    System,
    /// Sensitivity `1/(1 + L)` of the loop with this transfer function.
    Sensitivity,
    /// Complementary sensitivity `L/(1 + L)` of the loop with this transfer function.
    Complementary,
}

impl Mask {
    /// Creates a mask from points of angular frequency, rad/s, and gain.
    ///
    /// # Errors
    /// If there are fewer than two points, frequencies do not increase from above 0, or a gain is not above 0.
    pub fn new(points: &[[f64; 2]], is_upper: bool) -> Result<Self, String> {
        if points.len() < 2 {
            return Err("a mask needs at least two points".to_owned());
        }
        if !points.iter().flatten().all(|x| *x > 0.0 && x.is_finite()) {
            return Err("frequencies and gains of a mask must be above 0".to_owned());
        }
        if let Some(pair) = points.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return Err(format!("frequencies must increase, but {} rad/s follows {} rad/s", pair[1][0], pair[0][0]));
        }
        Ok(Self { points: points.iter().map(|[w, gain]| [*w, math::ln(*gain)]).collect(), is_upper })
    }

    /// Returns the lowest angular frequency of the mask, rad/s.
    pub fn first(&self) -> f64 {
        self.ends()[0]
    }

    /// Returns the highest angular frequency of the mask, rad/s.
    pub fn last(&self) -> f64 {
        self.ends()[1]
    }

    fn ends(&self) -> [f64; 2] {
        [self.points[0][0], self.points[self.points.len() - 1][0]]
    }

    /// Returns the logarithm of the bound at a frequency within its range.
    fn at(&self, w: f64) -> f64 {
        let after = self.points.partition_point(|point| point[0] <= w).clamp(1, self.points.len() - 1);
        let [[w0, a], [w1, b]] = [self.points[after - 1], self.points[after]];
        a + (b - a) * math::ln(w / w0) / math::ln(w1 / w0)
    }

    /// Returns the ratio of a gain to an upper bound, or of a lower bound to a gain; 0 outside of the range.
    fn ratio(&self, w: f64, gain: f64) -> f64 {
        let [low, high] = self.ends();
        if !(low..=high).contains(&w) {
            return 0.0;
        }
        let bound = math::exp(self.at(w));
        if self.is_upper { gain / bound } else { bound / gain }
    }

    /// Returns the largest ratio of the gain to the bound if it is an upper one, of the bound to the gain if it is a
    /// lower one, and the angular frequency, rad/s: 1 where the gain touches its bound. Of a sampled system,
    /// frequencies up to half of the sampling frequency count. It is located by bounds of the response over ranges of
    /// frequencies.
    ///
    /// # Errors
    /// If the system has several inputs or outputs, or the closed loop is not stable.
    pub fn largest_ratio(&self, system: &StateSpace, of: Masked) -> Result<(f64, f64), String> {
        let closed = match of {
            Masked::System => None,
            Masked::Sensitivity => Some(Closed::SENSITIVITY),
            Masked::Complementary => Some(Closed::COMPLEMENTARY),
        };
        if closed.is_some() && !Loop::new(system.clone())?.is_stable() {
            return Err("the closed loop is not stable".to_owned());
        }
        let gain = |l: Complex| closed.map_or_else(|| complex::norm(l), |closed| closed.gain(l));
        let [low, high] = self.ends();
        let bounds = |span: &Span| {
            let (from, to) = (system.frequency(span.low).max(low), system.frequency(span.high).min(high));
            if from > to {
                return [f64::NEG_INFINITY; 2];
            }
            let gains = closed.map_or_else(|| span.gain(), |closed| span.closed(closed));
            let inner = self.points.iter().filter(|point| (from..=to).contains(&point[0])).map(|point| point[1]);
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for bound in inner.chain([self.at(from), self.at(to)]) {
                (least, most) = (least.min(bound), most.max(bound));
            }
            if self.is_upper { [gains[0] - most, gains[1] - least] } else { [least - gains[1], most - gains[0]] }
        };
        let response = BoundedResponse::new(system)?;
        let (ratio, v) = highest(&response, |v, l| self.ratio(system.frequency(v), gain(l)), bounds)?;
        let mut best = (ratio, system.frequency(v));
        // A bend of the mask, and its ends, are no maxima of smooth curves.
        let last = system.frequency(f64::INFINITY);
        for &[w, _] in self.points.iter().filter(|point| point[0] <= last) {
            let ratio = self.ratio(w, gain(response.at(system.on_axis(w))));
            if ratio > best.0 {
                best = (ratio, w);
            }
        }
        Ok(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;

    fn lag() -> StateSpace {
        TransferFunction::new(vec![2.0], vec![1.0, 1.0]).state_space().unwrap()
    }

    #[test]
    fn a_lag_touches_its_masks_where_computed_by_hand() {
        // |G| = 2/sqrt(1 + w^2); an upper bound 1 from 1 to 10 rad/s is exceeded most at 1 rad/s, by sqrt 2.
        let upper = Mask::new(&[[1.0, 1.0], [10.0, 1.0]], true).unwrap();
        let (ratio, w) = upper.largest_ratio(&lag(), Masked::System).unwrap();
        assert!((ratio - 2f64.sqrt()).abs() < 1e-9 && (w - 1.0).abs() < 1e-9, "{ratio} {w}");
        // A lower bound of slope -1 from (0.1, 4) to (10, 0.04): 0.4/w over |G| is 0.2 sqrt(1 + 1/w^2), largest at 0.1
        // rad/s.
        let lower = Mask::new(&[[0.1, 4.0], [10.0, 0.04]], false).unwrap();
        let (ratio, w) = lower.largest_ratio(&lag(), Masked::System).unwrap();
        assert!((ratio - 0.2 * 101f64.sqrt()).abs() < 1e-9 && (w - 0.1).abs() < 1e-9, "{ratio} {w}");
        // A bound with a dip in between: the largest ratio lies at the bend.
        let dip = Mask::new(&[[0.1, 10.0], [1.0, 0.5], [10.0, 10.0]], true).unwrap();
        let (ratio, w) = dip.largest_ratio(&lag(), Masked::System).unwrap();
        assert!((ratio - 2.0 * 2f64.sqrt()).abs() < 1e-9 && w == 1.0, "{ratio} {w}");
    }

    #[test]
    fn a_narrow_resonance_and_the_peak_of_a_loop_are_found() {
        // 1/(s^2 + 2 z s + 1): the peak is 1/(2 z sqrt(1 - z^2)).
        let z = 1e-4;
        let sharp = TransferFunction::new(vec![1.0], vec![1.0, 2.0 * z, 1.0]).state_space().unwrap();
        let flat = Mask::new(&[[0.01, 1.0], [100.0, 1.0]], true).unwrap();
        let (ratio, _) = flat.largest_ratio(&sharp, Masked::System).unwrap();
        assert!((ratio * 2.0 * z * (1.0 - z * z).sqrt() - 1.0).abs() < 1e-6, "{ratio}");
        let l = TransferFunction::new(vec![1.0], vec![1.0, 1.0, 0.0]).state_space().unwrap();
        let peak = Loop::new(l.clone()).unwrap().peak_sensitivity().unwrap();
        let (ratio, _) = flat.largest_ratio(&l, Masked::Sensitivity).unwrap();
        assert!((ratio - peak).abs() < 1e-6, "{ratio} {peak}");
        let unstable = TransferFunction::new(vec![9.0], vec![1.0, 3.0, 3.0, 1.0]).state_space().unwrap();
        assert_eq!(flat.largest_ratio(&unstable, Masked::Complementary).unwrap_err(), "the closed loop is not stable");
    }

    #[test]
    fn points_that_are_no_mask_are_refused() {
        assert!(Mask::new(&[[1.0, 1.0]], true).unwrap_err().contains("two points"));
        assert!(Mask::new(&[[1.0, 1.0], [1.0, 2.0]], true).unwrap_err().contains("must increase"));
        assert!(Mask::new(&[[0.0, 1.0], [1.0, 2.0]], true).unwrap_err().contains("above 0"));
    }
}
