//! Stabilisation of an unstable loop: the nearest gain, phase shift or delay.

use std::cell::RefCell;
use std::f64::consts::TAU;

use mops_math as math;
use mops_math::complex;

use super::Loop;
use super::bounded_response::Span;
use super::margins::{Crossing, STRONG};

/// Largest number of crossings of the negative real axis in the search for a stabilising gain.
const MOST: usize = 20_000;

impl Loop {
    /// Returns the factor nearest to 1, in the logarithm, at which L multiplied by it reaches the stability limit.
    ///
    /// The closed loop is stable on the far side of the factor. A closed loop that is already stable has the factor 1.
    /// The number of unstable poles changes only at gains at which L meets -1, by at most two per crossing. It is
    /// counted between the crossings, so that a crossing that does not lead to stability is skipped.
    ///
    /// # Errors
    /// If no such factor exists within 200 dB.
    pub(super) fn stabilising_gain(&self) -> Result<f64, String> {
        let end = self.last_useful_crossing()?;
        let gains = RefCell::new(Vec::new());
        let window = |span: &Span| {
            let [low, high] = span.gain().map(math::exp);
            low < STRONG && high > 1.0 / STRONG && span.low < end && gains.borrow().len() <= MOST
        };
        self.phase_crossovers_in(window, |crossing| gains.borrow_mut().push(1.0 / complex::norm(crossing.response)))?;
        let gains = gains.into_inner();
        if gains.len() > MOST {
            return Err("the closed loop is unstable, and its delay is too long to find a stabilising gain".to_owned());
        }
        let mut down: Vec<f64> = gains.iter().copied().filter(|gain| *gain <= 1.0).collect();
        let mut up: Vec<f64> = gains.into_iter().filter(|gain| *gain >= 1.0).collect();
        down.sort_by(|a, b| b.total_cmp(a));
        up.sort_by(f64::total_cmp);
        let found = [self.first_stable(&down, 0.5)?, self.first_stable(&up, 2.0)?].into_iter().flatten();
        let nearest = found.min_by(|a, b| math::ln(*a).abs().total_cmp(&math::ln(*b).abs()));
        nearest
            .ok_or_else(|| "the closed loop is unstable, and no gain change of up to 200 dB stabilises it".to_owned())
    }

    /// Returns the first of these gains, ordered away from 1, beyond which the closed loop is stable. `beyond` is the
    /// factor to a gain beyond the last one.
    fn first_stable(&self, gains: &[f64], beyond: f64) -> Result<Option<f64>, String> {
        let mut i = 0;
        while i < gains.len() {
            let next = gains.get(i + 1).copied().unwrap_or(gains[i] * beyond);
            let between = (gains[i] * next).sqrt();
            // No gain lies between two equal ones.
            if math::ln(next / gains[i]).abs() <= 1e-9 {
                i += 1;
                continue;
            }
            match self.unstable_with(between, &self.level(1.0 / between)?)? {
                Some(0) => return Ok(Some(gains[i])),
                // That many crossings are needed, each of which removes two poles; one less because of poles on the
                // axis.
                Some(unstable) => i += (unstable / 2).saturating_sub(1).max(1),
                None => i += 1,
            }
        }
        Ok(None)
    }

    /// Returns the highest frequency of phase crossovers that can lead to stability.
    ///
    /// With a delay there are infinitely many crossovers. Beyond the corners of L each adds two unstable poles, and no
    /// more of these can be removed than there are crossovers below.
    fn last_useful_crossing(&self) -> Result<f64, String> {
        let delay = self.system.delay;
        if delay == 0.0 {
            return Ok(f64::INFINITY);
        }
        // The phase falls where the delay turns it faster than all poles and zeros, each by at most |root|/w^2.
        let high = self.response.corners()[1];
        let falling = (100.0 * high).max(2.0 * (self.response.order() as f64 * high / delay).sqrt());
        // Upper bound of the crossovers below: turns of the delay, and half a turn per pole or zero.
        let crossovers = falling * delay / TAU + 0.5 * self.response.order() as f64;
        Ok(falling + (crossovers.ceil() + 3.0) * TAU / delay)
    }

    /// Returns the smallest phase shift, lead or lag, that makes the closed loop stable.
    ///
    /// At every gain crossover it turns L by `rate` rad per unit. When a point of L passes -1, the number of unstable
    /// poles changes by two. It decreases with a lead where `|L|` falls, or with a lag where `|L|` rises.
    pub(super) fn stabilising_turn(&self, rate: impl Fn(&Crossing) -> f64) -> Option<f64> {
        let unstable = i64::try_from(self.unstable?).ok()?;
        let turns = unstable / 2 + self.gain_crossovers.len() as i64 + 1;
        let way = |direction: f64| {
            let mut events: Vec<(f64, i64)> = Vec::new();
            for crossing in &self.gain_crossovers {
                // The lag to -1, or the lead.
                let to = (-direction * complex::arg(-crossing.response)).rem_euclid(TAU);
                let change = if (direction > 0.0) == crossing.rises { 2 } else { -2 };
                events.extend((0..=turns).map(|k| ((to + k as f64 * TAU) / rate(crossing), change)));
            }
            events.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut left = unstable;
            events.into_iter().find_map(|(turn, change)| {
                left += change;
                (left == 0).then_some(turn)
            })
        };
        [way(1.0), way(-1.0)].into_iter().flatten().min_by(f64::total_cmp)
    }
}
