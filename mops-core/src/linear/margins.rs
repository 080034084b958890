//! Margins of a feedback loop: how far its loop transfer function stays from -1, or what would bring it back to stability.

use std::cell::Cell;
use std::f64::consts::{PI, TAU};

use super::bounded_response::{BoundedResponse, Span};
use super::search::passes;
use super::{Complex, StateSpace};
use crate::math::{self, complex};

/// Gain of a loop from which on nothing is looked for: 200 dB.
pub(super) const STRONG: f64 = 1e10;

/// Where the response of a loop passes something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Angular frequency, rad/s; 0 and infinity are crossings too where the response ends on the negative real axis.
    pub frequency: f64,
    /// The loop transfer function there.
    pub response: Complex,
    /// Whether what is passed is passed upwards, by a gain or a phase that rises with frequency.
    pub rises: bool,
}

/// A loop transfer function L with unity negative feedback around it, its delay included.
///
/// Crossings are found by bounds of L over ranges of frequencies, from 0 to where L is faint, and made exact by bisection.
/// The number of unstable closed-loop poles is exact with a delay too: they cross the imaginary axis only where `|L| = 1`,
/// whatever the delay. Source: K. Walton, J. E. Marshall, Direct method for TDS stability analysis, IEE Proceedings D 134
/// (1987) 101-107.
#[derive(Debug, Clone)]
pub struct Loop {
    pub(super) system: StateSpace,
    pub(super) response: BoundedResponse,
    /// Where `|L| = 1`, by rising frequency.
    pub gain_crossovers: Vec<Crossing>,
    /// Number of closed-loop poles with a real part of 0 or more; none where it is infinite.
    pub unstable: Option<usize>,
}

impl Loop {
    /// The loop with this transfer function.
    ///
    /// # Errors
    /// Several inputs or outputs; an entry that is not finite; a loop without a solution.
    pub fn new(system: StateSpace) -> Result<Self, String> {
        if system.inputs.len() != 1 || system.outputs.len() != 1 {
            return Err("a loop transfer function has one input and one output".to_owned());
        }
        if !(system.delay >= 0.0 && system.delay.is_finite()) {
            return Err(format!("a delay must not be negative, but is {} s", system.delay));
        }
        let response = BoundedResponse::new(&system)?;
        let mut found = Self { system, response, gain_crossovers: Vec::new(), unstable: None };
        found.gain_crossovers = found.level(1.0)?;
        found.unstable = found.unstable_with(1.0, &found.gain_crossovers)?;
        Ok(found)
    }

    /// Whether the closed loop is stable.
    pub fn is_stable(&self) -> bool {
        self.unstable == Some(0)
    }

    /// The loop transfer function at an angular frequency, rad/s.
    pub fn at(&self, frequency: f64) -> Complex {
        self.response.at(frequency)
    }

    /// Where `|L|` is `level`, by rising frequency.
    pub(super) fn level(&self, level: f64) -> Result<Vec<Crossing>, String> {
        let level = math::ln(level);
        let mut found = Vec::new();
        let bounds = |span: &Span| span.gain().map(|gain| gain - level);
        passes(
            &self.response,
            |l| math::ln(complex::norm(l)) - level,
            bounds,
            |frequency, rises| {
                found.push(Crossing { frequency, response: self.at(frequency), rises });
                true
            },
        )?;
        Ok(found)
    }

    /// Calls `found` where L is real and negative, by rising frequency, in those ranges that `window` lets through.
    pub(super) fn phase_crossovers_in(
        &self,
        window: impl Fn(&Span) -> bool,
        mut found: impl FnMut(Crossing),
    ) -> Result<(), String> {
        let bounds = |span: &Span| if window(span) { span.angle() } else { [1.0, 1.0] };
        let start = self.at(0.0);
        if start.is_finite() && start.re < 0.0 {
            found(Crossing { frequency: 0.0, response: start, rises: false });
        }
        passes(
            &self.response,
            |l| complex::arg(-l),
            bounds,
            |frequency, rises| {
                found(Crossing { frequency, response: self.at(frequency), rises });
                true
            },
        )?;
        // With a delay the response turns around a circle at infinite frequency, and meets the axis on both sides.
        let end = self.system.d[(0, 0)];
        let end = if self.system.delay > 0.0 { -end.abs() } else { end };
        if end < 0.0 {
            found(Crossing { frequency: f64::INFINITY, response: Complex::new(end, 0.0), rises: false });
        }
        Ok(())
    }

    /// The number of closed-loop poles with a real part of 0 or more where L is multiplied by `gain`, whose gain
    /// crossovers are `crossovers`; none where it is infinite.
    pub(super) fn unstable_with(&self, gain: f64, crossovers: &[Crossing]) -> Result<Option<usize>, String> {
        let StateSpace { c, d, delay, .. } = &self.system;
        let without = StateSpace { c: c * gain, d: d * gain, delay: 0.0, ..self.system.clone() };
        let unstable = without.complementary_sensitivity()?.poles()?.iter().filter(|p| p.re >= 0.0).count();
        if *delay == 0.0 {
            return Ok(Some(unstable));
        }
        if gain * d[(0, 0)].abs() >= 1.0 {
            return Ok(None);
        }
        let mut unstable = unstable as f64;
        for crossing in crossovers {
            // As the delay grows from 0, a pair of poles crosses here whenever it has turned L to -1: into the right half
            // plane where |L| falls with frequency, out of it where it rises.
            let turned = crossing.frequency * delay;
            let first = angle_to_minus_one(crossing.response * complex::from_polar(1.0, turned));
            let turns = ((turned - first) / TAU).floor() + 1.0;
            unstable += if crossing.rises { -2.0 } else { 2.0 } * turns.max(0.0);
        }
        Ok(Some(unstable.max(0.0) as usize))
    }

    /// The phase margin: the smallest turn of L, either way, with which a point of it meets -1, rad; infinite where `|L|`
    /// never is 1. Where the closed loop is unstable: minus the smallest turn, either way, that makes it stable.
    ///
    /// # Errors
    /// An unstable loop that no turn makes stable.
    pub fn phase_margin(&self) -> Result<f64, String> {
        if self.is_stable() {
            let turns = self.gain_crossovers.iter().map(|c| complex::arg(-c.response).abs());
            return Ok(turns.fold(f64::INFINITY, f64::min));
        }
        let turn = self.stabilising_turn(|_| 1.0);
        turn.map(|turn| -turn)
            .ok_or_else(|| "the closed loop is unstable, and no turn of the phase makes it stable".into())
    }

    /// The gain margin: the smallest factor above 1 by which L may be multiplied until it meets -1, in dB; infinite where
    /// none does. With `both` the smallest change either way, for loops that become unstable with less gain. Where the
    /// closed loop is unstable: minus the smallest change of the gain, either way, that makes it stable.
    ///
    /// # Errors
    /// An unstable loop that no gain makes stable.
    pub fn gain_margin(&self, both: bool) -> Result<f64, String> {
        let decibel = |factor: f64| 20.0 * math::log10(factor).abs();
        if !self.is_stable() {
            return self.stabilising_gain().map(|factor| -decibel(factor));
        }
        // The largest response below 1, and the smallest above.
        let (below, above) = (Cell::new(0.0f64), Cell::new(f64::INFINITY));
        let window = |span: &Span| {
            let [low, high] = span.gain().map(math::exp);
            (low <= 1.0 && high > below.get()) || (both && high > 1.0 && low < above.get().min(STRONG))
        };
        self.phase_crossovers_in(window, |crossing| match complex::norm(crossing.response) {
            size if size <= 1.0 => below.set(below.get().max(size)),
            size => above.set(above.get().min(size)),
        })?;
        let up = decibel(1.0 / below.get());
        Ok(if both { up.min(decibel(1.0 / above.get())) } else { up })
    }

    /// The delay margin: the smallest further delay that makes the closed loop unstable, s; infinite where none does.
    /// Where it is unstable: minus the smallest change of the delay, less or more, that makes it stable. The loop may have
    /// less delay than would have to go.
    ///
    /// # Errors
    /// An unstable loop that no delay makes stable.
    pub fn delay_margin(&self) -> Result<f64, String> {
        if self.is_stable() {
            let delays = self.gain_crossovers.iter().map(|c| angle_to_minus_one(c.response) / c.frequency);
            return Ok(delays.fold(f64::INFINITY, f64::min));
        }
        let delay = self.stabilising_turn(|crossing| crossing.frequency);
        delay.map(|delay| -delay).ok_or_else(|| "the closed loop is unstable, and no delay makes it stable".into())
    }
}

/// The lag, from 0 to 2 pi, that turns a response to the negative real axis.
pub(super) fn angle_to_minus_one(response: Complex) -> f64 {
    (complex::arg(response) + PI).rem_euclid(TAU)
}

#[cfg(test)]
mod by_grid;
#[cfg(test)]
mod tests;
