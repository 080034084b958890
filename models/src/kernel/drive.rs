//! Inputs during a simulation: smooth within a step, with jumps at breaks.

use mops_core::{
    Input,
    case::{
        Chirp, Hold,
        band_limited::{piece, polynomial},
    },
};
use mops_language::{Scalar, enclosure::Enclosure};
use mops_math as math;

use super::next_of;

/// Input with its current value and rate.
///
/// A step of the integrator ends where the input jumps, and evaluates the input there from the left. Only
/// [`Drive::pass_break`] changes to the value from the right. Inputs of a case are numbers. With a scalar that has
/// tangents, a drive can be fixed at a value with tangents, to differentiate with respect to the input.
#[derive(Debug, Clone)]
pub struct Drive<'a, S = f64> {
    input: Option<&'a Input>,
    since: f64,
    value: S,
    slope: f64,
    /// Index of the first sample after `since`.
    after: usize,
    /// Index of the first sample under zero-order hold that differs from the one before.
    change: usize,
    /// Curve added to the value instead of a straight line.
    curve: Option<Curve<'a>>,
}

#[derive(Debug, Clone)]
enum Curve<'a> {
    /// Sine `amplitude sin(angular t + phase)`; the angular frequency in rad/s.
    Sine { amplitude: f64, angular: f64, phase: f64 },
    /// Polynomial in `(t - since)/step`.
    Piece { since: f64, step: f64, coefficients: [f64; 6] },
    /// Sine of changing frequency, between its start and its end.
    Chirp(&'a Chirp),
    /// Sum of inputs.
    Sum(Vec<Drive<'a>>),
}

impl Curve<'_> {
    // If inlined, the sine would be evaluated for every input: the compiler considers it cheap enough to compute
    // speculatively.
    #[inline(never)]
    fn at(&self, t: f64) -> f64 {
        match self {
            Self::Sine { amplitude, angular, phase } => amplitude * math::sin(angular * t + phase),
            Self::Piece { since, step, coefficients } => polynomial(coefficients, (t - since) / step).0,
            Self::Chirp(chirp) => chirp.sine(t),
            Self::Sum(parts) => parts.iter().map(|part| part.at(t)).sum(),
        }
    }

    fn is_constant(&self) -> bool {
        matches!(self, Self::Sum(parts) if parts.iter().all(Drive::is_constant))
    }

    fn enclose(&self, time: Enclosure) -> Enclosure {
        match self {
            Self::Sine { amplitude, angular, phase } => {
                let angle = time * Enclosure::from(*angular) + Enclosure::from(*phase);
                angle.sin() * Enclosure::from(*amplitude)
            }
            Self::Piece { since, step, coefficients } => {
                let share = (time - Enclosure::from(*since)) / Enclosure::from(*step);
                let horner = |sum: Enclosure, c: &f64| sum * share + Enclosure::from(*c);
                coefficients.iter().rev().fold(Enclosure::from(0.0), horner)
            }
            Self::Chirp(chirp) => chirp.enclose(time),
            Self::Sum(parts) => {
                parts.iter().map(|part| part.enclose(time)).fold(Enclosure::from(0.0), |sum, part| sum + part)
            }
        }
    }

    fn slope(&self, t: f64) -> f64 {
        match self {
            Self::Sine { amplitude, angular, phase } => amplitude * angular * math::cos(angular * t + phase),
            Self::Piece { since, step, coefficients } => polynomial(coefficients, (t - since) / step).1 / step,
            Self::Chirp(chirp) => chirp.slope(t),
            Self::Sum(parts) => parts.iter().map(|part| part.slope(t)).sum(),
        }
    }
}

impl<S: Scalar> Drive<'_, S> {
    /// Creates a drive with a constant value.
    pub fn fixed(value: S) -> Self {
        Self { input: None, since: 0.0, value, slope: 0.0, after: 0, change: 0, curve: None }
    }
}

impl<'a, S: Scalar> Drive<'a, S> {
    /// Creates a drive at time 0; without an `input` it is zero.
    pub fn new(input: Option<&'a Input>) -> Self {
        input.map_or_else(|| Self::fixed(S::from(0.0)), |input| Self::from(input, 0.0))
    }

    /// Creates a drive with the value that is valid from `t` on.
    fn from(input: &'a Input, t: f64) -> Self {
        let mut drive = Self { input: Some(input), ..Self::fixed(S::from(0.0)) };
        drive.pass_break(t);
        drive
    }

    /// Returns the value at `t`.
    #[inline]
    pub fn at(&self, t: f64) -> S {
        match &self.curve {
            Some(curve) => self.value + curve.at(t),
            None => self.value + self.slope * (t - self.since),
        }
    }

    /// Returns the earliest time from which on the value is known, at most 0 s.
    pub fn first_known(&self) -> f64 {
        self.input.map_or(0.0, Input::first_known)
    }

    /// Returns true if the value jumps at time 0.
    pub fn jumps_at_start(&self) -> bool {
        self.input.is_some_and(|input| input.at(-f64::MIN_POSITIVE) != input.at(0.0))
    }

    /// Takes the value just before `t`, up to the next break that is passed.
    pub fn hold_before(&mut self, t: f64) {
        if let Some(input) = self.input {
            self.value = S::from(input.at(t.next_down()));
            (self.slope, self.curve) = (0.0, None);
        }
    }

    /// Returns true if the value is constant up to the next break.
    pub fn is_constant(&self) -> bool {
        self.curve.as_ref().is_none_or(Curve::is_constant) && self.slope == 0.0
    }

    /// Returns bounds over a time span between two breaks.
    pub fn enclose(&self, time: Enclosure) -> Enclosure {
        let value = Enclosure::from(self.value.value());
        match &self.curve {
            Some(curve) => value + curve.enclose(time),
            None if self.slope == 0.0 => value,
            None => value + (time - Enclosure::from(self.since)) * Enclosure::from(self.slope),
        }
    }

    /// Returns the rate at `t`, per s.
    pub fn slope(&self, t: f64) -> f64 {
        self.curve.as_ref().map_or(self.slope, |curve| curve.slope(t))
    }

    /// Returns the next time after `t` at which the value or its rate jumps. Under zero-order hold, samples equal to
    /// the previous one are skipped.
    pub fn next_break(&self, t: f64) -> f64 {
        if let Some(Curve::Sum(parts)) = &self.curve {
            // Breaks at one instant up to rounding are one, as between different inputs.
            return next_of(parts.iter().map(|part| part.next_break(t)));
        }
        let Some(Input::Sampled { times, values, hold: Hold::Zero }) = self.input else { return self.next_sample(t) };
        let after = self.first_after(times, t);
        let is_ahead = (self.after..=self.change).contains(&after);
        let change = if is_ahead { self.change } else { first_change(values, after) };
        times.get(change).copied().unwrap_or(f64::INFINITY)
    }

    /// Returns the next time after `t` at which the value or its rate jumps; every sample counts, also if equal to the
    /// previous one.
    pub fn next_sample(&self, t: f64) -> f64 {
        match self.input {
            Some(Input::Sampled { times, .. }) => {
                times.get(self.first_after(times, t)).copied().unwrap_or(f64::INFINITY)
            }
            Some(input) => input.next_break(t),
            None => f64::INFINITY,
        }
    }

    /// Returns the index of the first sample after `t`, searched first near the current position of the drive.
    fn first_after(&self, times: &[f64], t: f64) -> usize {
        const NEAR: usize = 3;
        let near = self.after..times.len().min(self.after + NEAR);
        let behind = self.after == 0 || times.get(self.after - 1).is_some_and(|&before| before <= t);
        near.into_iter().find(|&k| behind && times[k] > t).unwrap_or_else(|| times.partition_point(|&time| time <= t))
    }

    /// Returns one sixteenth of the shortest period of a sine, s; infinity for inputs without sines.
    pub fn longest_step(&self) -> f64 {
        let sixteenth = |frequency: f64| 1.0 / (16.0 * frequency.abs());
        match (self.input, &self.curve) {
            (Some(Input::Sine { frequency, .. }), _) => sixteenth(*frequency),
            (Some(Input::Chirp(Chirp { frequencies: [from, to], .. })), Some(_)) => sixteenth(from.max(*to)),
            (_, Some(Curve::Sum(parts))) => parts.iter().map(Drive::longest_step).fold(f64::INFINITY, f64::min),
            _ => f64::INFINITY,
        }
    }

    /// Moves on to the value and rate that are valid from `t` on.
    pub fn pass_break(&mut self, t: f64) {
        let Some(input) = self.input else { return };
        self.since = t;
        (self.value, self.slope) = (S::from(0.0), 0.0);
        match input {
            Input::Sine { amplitude, frequency, phase, offset } => {
                self.value = S::from(*offset);
                let angular = std::f64::consts::TAU * frequency;
                self.curve = Some(Curve::Sine { amplitude: *amplitude, angular, phase: *phase });
            }
            Input::Chirp(chirp) => {
                self.curve = (chirp.start <= t && t < chirp.end).then_some(Curve::Chirp(chirp));
            }
            Input::Sum(inputs) => match &mut self.curve {
                Some(Curve::Sum(parts)) => parts.iter_mut().for_each(|part| part.pass_break(t)),
                _ => self.curve = Some(Curve::Sum(inputs.iter().map(|input| Drive::from(input, t)).collect())),
            },
            Input::Sampled { times, hold: Hold::First, .. } => {
                self.after = self.first_after(times, t);
                let value = input.at(t);
                self.value = S::from(value);
                let next = input.next_break(t);
                if next.is_finite() {
                    self.slope = (input.at(next) - value) / (next - t);
                }
            }
            Input::Sampled { times, values, hold: Hold::BandLimited } => {
                self.after = self.first_after(times, t);
                self.curve = (1..times.len()).contains(&self.after).then(|| {
                    let (since, next) = (times[self.after - 1], times[self.after]);
                    Curve::Piece { since, step: next - since, coefficients: piece(values, self.after - 1) }
                });
                self.value = S::from(if self.curve.is_some() { 0.0 } else { input.at(t) });
            }
            Input::Sampled { times, values, hold: Hold::Zero } => {
                self.after = self.first_after(times, t);
                self.change = first_change(values, self.after);
                self.value = S::from(values[self.after.saturating_sub(1)]);
            }
            _ => self.value = S::from(input.at(t)),
        }
    }
}

/// Returns the index of the first value, at `after` or later, that differs from the value before it.
fn first_change(values: &[f64], after: usize) -> usize {
    let same = |k: &usize| *k > 0 && values[*k] == values[*k - 1];
    (after..values.len()).find(|k| !same(k)).unwrap_or(values.len())
}
