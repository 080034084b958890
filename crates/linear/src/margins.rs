//! Stability margins of a feedback loop: distance of the loop transfer function from -1, or the change that restores
//! stability.

use std::cell::Cell;
use std::f64::consts::{PI, TAU};

use mops_math as math;
use mops_math::complex;

use super::bounded_response::{BoundedResponse, Span};
use super::search::passes;
use super::{Complex, StateSpace};

/// Loop gain above which crossings are ignored: 200 dB.
pub(super) const STRONG: f64 = 1e10;

/// Crossing of a level or of the negative real axis by the response of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Angular frequency, rad/s. 0 and infinity, or half of the sampling frequency, also count as crossings if the
    /// response ends on the negative real axis.
    pub frequency: f64,
    /// Loop transfer function at the crossing.
    pub response: Complex,
    /// True if the gain or phase rises with frequency at the crossing.
    pub rises: bool,
}

/// Loop transfer function L, including its delay, with unity negative feedback.
///
/// Crossings are located by bounds of L over ranges of frequencies, from 0 to where L is negligible, and refined by
/// bisection. The number of unstable closed-loop poles is exact with a delay too: poles cross the imaginary axis only
/// where `|L| = 1`, for any delay.
///
/// Source: K. Walton, J. E. Marshall, Direct method for TDS stability analysis, IEE Proceedings D 134 (1987) 101-107.
#[derive(Debug, Clone)]
pub struct Loop {
    pub(super) system: StateSpace,
    pub(super) response: BoundedResponse,
    /// Crossings of `|L| = 1`, by ascending frequency.
    pub gain_crossovers: Vec<Crossing>,
    /// Number of closed-loop poles with a real part of 0 or more; `None` if infinite.
    pub unstable: Option<usize>,
}

impl Loop {
    /// Creates the loop with this transfer function.
    ///
    /// # Errors
    /// If there are several inputs or outputs, an entry is not finite, the delay is negative, or the loop is not
    /// well-posed.
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

    /// Returns true if the closed loop is stable.
    pub fn is_stable(&self) -> bool {
        self.unstable == Some(0)
    }

    /// Returns the loop transfer function at an angular frequency, rad/s.
    pub fn at(&self, frequency: f64) -> Complex {
        self.response.at(self.system.on_axis(frequency))
    }

    /// Returns the crossing at the point `j v` of the imaginary axis.
    fn crossing(&self, v: f64, rises: bool) -> Crossing {
        Crossing { frequency: self.system.frequency(v), response: self.response.at(v), rises }
    }

    /// Returns the crossings of `|L| = level`, by ascending frequency.
    pub(super) fn level(&self, level: f64) -> Result<Vec<Crossing>, String> {
        let level = math::ln(level);
        let mut found = Vec::new();
        let bounds = |span: &Span| span.gain().map(|gain| gain - level);
        passes(
            &self.response,
            |l| math::ln(complex::norm(l)) - level,
            bounds,
            |v, rises| {
                found.push(self.crossing(v, rises));
                true
            },
        )?;
        Ok(found)
    }

    /// Calls `found` where L is real and negative, by ascending frequency, within the ranges that `window` accepts.
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
            |v, rises| {
                found(self.crossing(v, rises));
                true
            },
        )?;
        // A sampled response ends at half of the sampling frequency. At infinite frequency a response with delay turns
        // on a circle, and crosses the axis on both sides.
        let end = self.system.d[(0, 0)];
        let end = if self.system.delay > 0.0 { -end.abs() } else { end };
        if end < 0.0 {
            let frequency = self.system.frequency(f64::INFINITY);
            found(Crossing { frequency, response: Complex::new(end, 0.0), rises: false });
        }
        Ok(())
    }

    /// Returns the number of closed-loop poles with a real part of 0 or more when L is multiplied by `gain`; `None` if
    /// infinite.
    ///
    /// `crossovers` are the gain crossovers for that gain.
    pub(super) fn unstable_with(&self, gain: f64, crossovers: &[Crossing]) -> Result<Option<usize>, String> {
        let (d, delay) = (&self.system.d, self.system.delay);
        let without = StateSpace { delay: 0.0, ..self.system.clone() };
        let unstable = without.closed_loop_eigenvalues(gain)?.iter().filter(|p| p.re >= 0.0).count();
        if delay == 0.0 {
            return Ok(Some(unstable));
        }
        if gain * d[(0, 0)].abs() >= 1.0 {
            return Ok(None);
        }
        let mut unstable = unstable as f64;
        for crossing in crossovers {
            // As the delay grows from 0, a pair of poles crosses the axis whenever L reaches -1. It enters the right
            // half-plane where |L| falls with frequency, and leaves it where |L| rises.
            let turned = crossing.frequency * delay;
            let first = angle_to_minus_one(crossing.response * complex::from_polar(1.0, turned));
            let turns = ((turned - first) / TAU).floor() + 1.0;
            unstable += if crossing.rises { -2.0 } else { 2.0 } * turns.max(0.0);
        }
        Ok(Some(unstable.max(0.0) as usize))
    }

    /// Returns the phase margin, rad: the smallest phase shift of either sign at which L meets -1.
    ///
    /// The margin is infinite if `|L|` is never 1. For an unstable closed loop: minus the smallest phase shift of
    /// either sign that makes it stable.
    ///
    /// # Errors
    /// If the loop is unstable and no phase shift stabilises it.
    pub fn phase_margin(&self) -> Result<f64, String> {
        if self.is_stable() {
            let turns = self.gain_crossovers.iter().map(|c| complex::arg(-c.response).abs());
            return Ok(turns.fold(f64::INFINITY, f64::min));
        }
        let turn = self.stabilising_turn(|_| 1.0);
        turn.map(|turn| -turn).ok_or_else(|| "the closed loop is unstable, and no phase shift stabilises it".into())
    }

    /// Returns the gain margin, dB: the smallest factor above 1 by which L must be multiplied to meet -1.
    ///
    /// The margin is infinite if no factor does. With `both`, the smallest change of either sign, for loops that lose
    /// stability with less gain. For an unstable closed loop: minus the smallest gain change of either sign that makes
    /// it stable.
    ///
    /// # Errors
    /// If the loop is unstable and no gain stabilises it.
    pub fn gain_margin(&self, both: bool) -> Result<f64, String> {
        let decibel = |factor: f64| 20.0 * math::log10(factor).abs();
        if !self.is_stable() {
            return self.stabilising_gain().map(|factor| -decibel(factor));
        }
        // Largest response magnitude below 1, and smallest above.
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

    /// Returns the gain crossover that determines the phase margin of a stable loop, and the phase crossover that
    /// determines its gain margin; `None` for an infinite margin.
    ///
    /// # Errors
    /// If the bounds of the response cannot be computed.
    pub fn critical(&self) -> Result<[Option<Crossing>; 2], String> {
        let turn = |crossing: &Crossing| complex::arg(-crossing.response).abs();
        let of_phase = self.gain_crossovers.iter().copied().min_by(|a, b| turn(a).total_cmp(&turn(b)));
        let largest = Cell::new(0.0f64);
        let mut of_gain: Option<Crossing> = None;
        let window = |span: &Span| {
            let [low, high] = span.gain().map(math::exp);
            low <= 1.0 && high > largest.get()
        };
        self.phase_crossovers_in(window, |crossing| {
            let size = complex::norm(crossing.response);
            if size <= 1.0 && size > largest.get() {
                largest.set(size);
                of_gain = Some(crossing);
            }
        })?;
        Ok([of_phase, of_gain])
    }

    /// Returns the delay margin, s: the smallest additional delay that makes the closed loop unstable, or infinity.
    ///
    /// For a sampled loop, the delay of the sampled values; it is exact for whole periods, and between them takes the
    /// values as those of a signal without frequencies above half of the sampling frequency.
    ///
    /// For an unstable loop: minus the smallest change of the delay, of either sign, that makes it stable. A reduction
    /// may exceed the delay of the loop.
    ///
    /// # Errors
    /// If the loop is unstable and no delay stabilises it.
    pub fn delay_margin(&self) -> Result<f64, String> {
        if self.is_stable() {
            let delays = self.gain_crossovers.iter().map(|c| angle_to_minus_one(c.response) / c.frequency);
            return Ok(delays.fold(f64::INFINITY, f64::min));
        }
        let delay = self.stabilising_turn(|crossing| crossing.frequency);
        delay.map(|delay| -delay).ok_or_else(|| "the closed loop is unstable, and no delay stabilises it".into())
    }
}

/// Returns the lag, from 0 to 2 pi, that turns a response to the negative real axis.
pub(super) fn angle_to_minus_one(response: Complex) -> f64 {
    (complex::arg(response) + PI).rem_euclid(TAU)
}

#[cfg(test)]
pub(super) mod by_grid;
#[cfg(test)]
mod tests;
