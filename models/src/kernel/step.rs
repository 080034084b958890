//! An accepted step and its dense output.

use mops_core::Scalar;
use mops_core::enclosure::{Enclosure, Interval};

/// An accepted step from `start` to `start + taken`, with its dense output.
pub struct Step<X> {
    /// Time at which it begins, s.
    pub start: f64,
    /// Length of the step for which the dense output was made, s.
    pub length: f64,
    /// Part of it that holds, s: less than `length` where an event ended it.
    pub taken: f64,
    /// The same part as a share of `length`.
    pub(super) share: f64,
    /// `r0 .. r4` of [`Step::at`].
    pub(super) dense: [X; 5],
}

impl<X: Clone> Step<X> {
    pub(super) fn new(x: &X) -> Self {
        Self { start: 0.0, length: 0.0, taken: 0.0, share: 1.0, dense: std::array::from_fn(|_| x.clone()) }
    }
}

impl<X> Step<X> {
    /// A new step, of which all holds.
    #[inline]
    pub(super) fn begin(&mut self, start: f64, length: f64) {
        (self.start, self.length, self.taken, self.share) = (start, length, length, 1.0);
    }

    /// An event ends the step at this share of its length.
    pub(super) fn end_at(&mut self, share: f64) {
        (self.taken, self.share) = (share * self.length, share);
    }

    /// The time at a share of its length, s.
    #[inline]
    pub(super) fn time(&self, theta: f64) -> f64 {
        self.start + theta * self.length
    }

    /// The state at `start + s taken`, `s` in [0, 1].
    #[inline]
    pub fn state<S: Scalar>(&self, s: f64, x: &mut X)
    where
        X: AsRef<[S]> + AsMut<[S]>,
    {
        self.at(s * self.share, x);
    }

    /// One component of [`Step::state`].
    #[inline]
    pub(super) fn component<S: Scalar>(&self, s: f64, i: usize) -> S
    where
        X: AsRef<[S]>,
    {
        let theta = s * self.share;
        let back = 1.0 - theta;
        let [r0, r1, r2, r3, r4] = &self.dense;
        let (r0, r1, r2, r3, r4) = (r0.as_ref()[i], r1.as_ref()[i], r2.as_ref()[i], r3.as_ref()[i], r4.as_ref()[i]);
        r0 + (r1 + (r2 + (r3 + r4 * back) * theta) * back) * theta
    }

    /// The state at `start + theta length`: `r0 + theta (r1 + (1 - theta)(r2 + theta (r3 + (1 - theta) r4)))`.
    #[inline]
    pub(super) fn at<S: Scalar>(&self, theta: f64, x: &mut X)
    where
        X: AsRef<[S]> + AsMut<[S]>,
    {
        let back = 1.0 - theta;
        let [r0, r1, r2, r3, r4] = &self.dense;
        let (r0, r1, r2, r3, r4) = (r0.as_ref(), r1.as_ref(), r2.as_ref(), r3.as_ref(), r4.as_ref());
        for (i, x) in x.as_mut().iter_mut().enumerate() {
            *x = r0[i] + (r1[i] + (r2[i] + (r3[i] + r4[i] * back) * theta) * back) * theta;
        }
    }

    /// Bounds of the values of all components from the share `from` to the share `to`, and of their rates.
    pub(super) fn enclose<S: Scalar>(&self, from: f64, to: f64, bounds: &mut Vec<Enclosure>)
    where
        X: AsRef<[S]>,
    {
        let (m, radius) = (0.5 * (from + to), 0.5 * (to - from));
        let per_second = Interval::point(1.0 / self.length);
        let [r0, r1, r2, r3, r4] = &self.dense;
        bounds.clear();
        bounds.extend((0..r0.as_ref().len()).map(|i| {
            let r = [r0, r1, r2, r3, r4].map(|r| r.as_ref()[i].value());
            let Enclosure { value, rate } = Enclosure::of_polynomial(&taylor(r, m), radius);
            Enclosure { value, rate: rate * per_second }
        }));
    }
}

/// Coefficients of the dense output in powers of `theta - m`.
fn taylor([r0, r1, r2, r3, r4]: [f64; 5], m: f64) -> [f64; 5] {
    // In powers of theta: theta (1 - theta) = theta - theta^2, and so on.
    let c = [r0, r1 + r2, r3 + r4 - r2, -(r3 + 2.0 * r4), r4];
    let value = c[0] + m * (c[1] + m * (c[2] + m * (c[3] + m * c[4])));
    let first = c[1] + m * (2.0 * c[2] + m * (3.0 * c[3] + m * 4.0 * c[4]));
    let second = c[2] + m * (3.0 * c[3] + m * 6.0 * c[4]);
    [value, first, second, c[3] + 4.0 * m * c[4], c[4]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_the_dense_output_and_its_slope() {
        let mut step = Step::new(&[0.0]);
        step.begin(2.0, 0.5);
        step.dense = [[1.0], [-2.0], [3.0], [0.5], [-4.0]];
        let mut bounds = Vec::new();
        let at = |theta: f64| {
            let mut x = [0.0];
            step.at(theta, &mut x);
            x[0]
        };
        for (from, to) in [(0.0, 1.0), (0.2, 0.3), (0.7, 1.0)] {
            step.enclose(from, to, &mut bounds);
            for k in 0..=20 {
                let theta = from + (to - from) * f64::from(k) / 20.0;
                let slope = (at(theta + 1e-6) - at(theta - 1e-6)) / (2e-6 * step.length);
                let wider = |i: Interval| (i.low - 1e-7, i.high + 1e-7);
                let (value, rate) = (wider(bounds[0].value), wider(bounds[0].rate));
                assert!(value.0 <= at(theta) && at(theta) <= value.1, "{bounds:?} {theta}");
                assert!(rate.0 <= slope && slope <= rate.1, "{bounds:?} {theta} {slope}");
            }
        }
    }
}
