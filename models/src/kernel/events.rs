//! Events: when they occur, in which order, and how often.
//!
//! **Guards.** A mode is active while its guards are not negative. An event is the first instant at which a guard is
//! negative. [`mops_core::plant::Events::switch`] then changes the mode, and the state where it jumps. Events do not
//! depend on where steps end.
//!
//! **Location.** Within a step the state is a polynomial in time, so that every guard is a function of time.
//! [`mops_core::plant::Bounds::of_guard`] may give bounds of a guard and of its rate over a part of the step. The first
//! zero crossing is then found by branch and bound. A part whose bounds exclude negative values is discarded. A part
//! over which the guard is monotone is decided by its ends. Any other part is halved, the earlier half first. This
//! finds a guard that is negative only briefly, however long the step is. The guard may depend on states, on inputs or
//! on time. Models written in Rust have no bounds; their guards vary as smoothly as their states. Their guards are
//! evaluated at four nodes of a step and at a minimum below 0 of the quartic through these values.
//!
//! **Event time.** A zero is located to the resolution of the clock. The event occurs at the end of the bracket where
//! the guard *is* negative. So rounding cannot leave the guard positive, and one crossing is never found twice. A guard
//! that has crossed zero is negative at the start of the next step. A mode that waits for it to become positive starts
//! from there.
//!
//! **Simultaneous events.** Instants closer than the resolution count as one. At an instant inputs and clocks first
//! take their new values ([`mops_core::plant::Breaks::pass`]). Then the negative guard with the lowest index switches,
//! until no guard is negative. An event therefore sees the inputs that are valid from its instant on, at all rates of
//! samples and events.
//!
//! **Arming.** The state of a guard after its event, armed or not, is part of the mode and decided by the plant.
//!
//! **Accumulation (Zeno behaviour).** The events of a guard accumulate if it switches [`REPEATS`] times in succession
//! at decreasing intervals below [`CLOSE`] of the simulated time. Intervals below [`NONE`] of the simulated time count
//! as zero. [`mops_core::plant::Events::rest`] may then move the state to its rest state; otherwise the simulation
//! fails, as it cannot proceed beyond that instant.
//!
//! Source: T. Park, P. Barton, State event location in differential-algebraic models, ACM TOMACS 6 (1996) 137-165; J.
//! Esposito, V. Kumar, G. Pappas, Accurate event detection for simulating hybrid systems, HSCC 2001, 204-217; J. Zhang,
//! K. Johansson, J. Lygeros, S. Sastry, Zeno hybrid systems, Int. J. Robust Nonlinear Control 11 (2001) 435-451.

use mops_core::Failure;
use mops_language::{Scalar, enclosure::Enclosure};
use mops_math as math;

use super::driven::{Driven, shift};
use super::instants::common;
use super::integrable::Integrable;
use super::sink::Sink;
use super::step::Step;

/// Number of successive switches of a guard at decreasing intervals from which its events count as accumulating. A
/// sequence that does not accumulate reaches this number very rarely by chance, and intervals still exceed rounding.
const REPEATS: u32 = 20;

/// Fraction of the simulated time below which intervals between events are close: 1e5 to 1e6 times the resolution of
/// the clock.
const CLOSE: f64 = 1e-10;

/// Fraction of the simulated time below which an interval between events of one guard counts as zero: rounding of the
/// states determines it.
const NONE: f64 = 1e-13;

/// Ratio to the last interval below which an interval counts as shorter; events at a fixed rate never do.
const SHORTER: f64 = 0.999;

/// Relative time difference up to which instants count as one: the rounding error of a few additions.
const RESOLUTION: f64 = 16.0 * f64::EPSILON;

/// Width of the bracket in which an event is located, as a fraction of the resolution. An event therefore coincides
/// with an instant closer than the resolution.
const BRACKET: f64 = 0.25;

/// Limit on the number of bounds computed for one guard in one step; parts then undecided are decided by their ends. A
/// guard that crosses zero takes some 20 bounds, one that touches zero some 100. Each place without bounds before the
/// first zero, such as a jump of `atan2` or a pole of `tan`, takes some 60.
const MOST_BOUNDS: usize = 2000;

/// Limit on the number of halvings of a step: a part of 1e-9 of its length.
const HALVINGS: u32 = 30;

/// Event location and handling of a simulation.
pub(super) struct Events<S> {
    /// Simulated time, s.
    span: f64,
    /// Values of the guards at the present instant.
    values: Vec<f64>,
    /// Switching history of every guard.
    past: Vec<Past>,
    /// Bounds of the state over the step, and over a part of the step.
    whole: Vec<Enclosure>,
    bounds: Vec<Enclosure>,
    /// States at the inner nodes [`INNER`].
    inner: [Vec<S>; 3],
}

/// Switching history of a guard.
#[derive(Debug, Clone, Copy)]
struct Past {
    /// Time of the last switch, s.
    last: f64,
    /// Interval before the last switch, s.
    interval: f64,
    /// Number of successive intervals that were close and shorter than the one before.
    closer: u32,
}

impl<S: Scalar> Events<S> {
    pub(super) fn new(span: f64, x: &[S]) -> Self {
        let inner = std::array::from_fn(|_| x.to_vec());
        Self { span, values: Vec::new(), past: Vec::new(), whole: Vec::new(), bounds: Vec::new(), inner }
    }

    /// Returns the time difference below which two times count as one instant, s.
    pub(super) fn resolution(&self, t: f64) -> f64 {
        RESOLUTION * t.abs().max(1e-3 * self.span)
    }

    /// Returns true if the current mode has guards.
    pub(super) fn are_watched(&self) -> bool {
        !self.values.is_empty()
    }

    /// Handles all events of an instant: the negative guard with the lowest index switches, until no guard is negative.
    /// Each event occurs at the time of its own crossing, the events that it causes at the same time: for the
    /// derivatives, the state is moved there before an event, and back after the last one.
    pub(super) fn settle<P: Integrable<S> + ?Sized>(
        &mut self,
        system: &mut Driven<'_, S, P>,
        (t, crossings): (f64, &[Crossing<S>]),
        (x, spare): (&mut [S], &mut [S]),
        sink: &mut impl Sink<S, P>,
    ) -> Result<(), Failure> {
        let mut index = 0;
        let mut late = S::from(0.0);
        self.values.resize(system.guards(), 0.0);
        while index < self.values.len() {
            let value = system.guard(index, t, x).value();
            self.values[index] = value;
            if value >= 0.0 || value.is_nan() {
                index += 1;
                continue;
            }
            if let Some(own) = crossings.iter().find(|crossing| crossing.guard == index) {
                shift(system, t, x, spare, own.late - late);
                late = own.late;
                system.delay_events(late);
            }
            if self.accumulates(index, t) {
                match system.rest(index, t, CLOSE * self.span, x) {
                    Ok(rest) => sink.event(t, rest),
                    Err(why) => return Err(Failure::EventsAccumulate(t, why)),
                }
                self.past[index].closer = 0;
            } else {
                sink.event(t, system.switch(index, t, x));
            }
            self.values.resize(system.guards(), 0.0);
            index = 0;
        }
        if !crossings.is_empty() {
            system.delay_events(S::from(0.0));
            shift(system, t, x, spare, -late);
        }
        Ok(())
    }

    /// Records a switch of a guard; returns true if its events accumulate.
    fn accumulates(&mut self, index: usize, t: f64) -> bool {
        let never = Past { last: f64::NEG_INFINITY, interval: f64::INFINITY, closer: 0 };
        if self.past.len() <= index {
            self.past.resize(index + 1, never);
        }
        let past = &mut self.past[index];
        let interval = t - past.last;
        let is_closer = interval <= NONE * self.span || interval < SHORTER * past.interval;
        past.closer = if interval <= CLOSE * self.span && is_closer { past.closer + 1 } else { 0 };
        (past.last, past.interval) = (t, interval);
        past.closer >= REPEATS
    }

    /// Returns the guard that is the first to become negative within the step, and ends the step there. `arrival` is
    /// the time and state at the end of the step.
    pub(super) fn first<P: Integrable<S> + ?Sized>(
        &mut self,
        system: &Driven<'_, S, P>,
        step: &mut Step<S>,
        arrival: (f64, &[S]),
        x: &mut [S],
    ) -> Option<usize> {
        let mut first = None;
        let mut end = 1.0;
        if !self.are_watched() {
            return None;
        }
        let has_bounds = system.has_bounds();
        if has_bounds {
            step.enclose(0.0, 1.0, &mut self.whole);
        }
        let mut has_inner = false;
        for index in 0..self.values.len() {
            let mut value = |theta: f64| {
                if theta >= 1.0 {
                    return system.guard(index, arrival.0, arrival.1).value();
                }
                step.at(theta, x);
                system.guard(index, step.time(theta), x).value()
            };
            let start = self.values[index];
            let last = value(end);
            let time = |from: f64, to: f64| Enclosure::of_time(step.time(from), step.time(to));
            let whole = match has_bounds {
                true => system.enclose_guard(index, time(0.0, 1.0), &self.whole),
                false => Enclosure::UNKNOWN,
            };
            let ends = [(0.0, start), (end, last)];
            let bounds = &mut self.bounds;
            let mut enclose = |from: f64, to: f64| {
                step.enclose(from, to, bounds);
                system.enclose_guard(index, time(from, to), bounds)
            };
            let bracket = if whole.value.low >= 0.0 {
                None
            } else if has_bounds && bounds_narrow(whole, &mut enclose) {
                Search { value: &mut value, enclose: &mut enclose, length: step.length, left: MOST_BOUNDS }
                    .first(ends, whole, HALVINGS)
            } else if has_bounds || end < 1.0 {
                let inner = INNER.map(|place| value(place * end));
                looks(&mut value, ends, inner)
            } else if let Some((state, factor)) = system.guard_state(index) {
                let inner = INNER.map(|place| (step.component(place, state) * factor).value());
                looks(&mut value, ends, inner)
            } else {
                if !has_inner {
                    step.states_at(&INNER, &mut self.inner);
                    has_inner = true;
                }
                let inner = system.guard_at(index, &INNER.map(|place| step.time(place)), &self.inner);
                looks(&mut value, ends, inner.map(Scalar::value))
            };
            // Most steps end without an event; the values at their end are those at the start of the next step.
            if first.is_none() {
                self.values[index] = last;
            }
            if let Some(bracket) = bracket {
                // The bracket may be far shorter than the step, so the resolution is taken at its own time.
                let width = BRACKET * self.resolution(step.time(bracket[1].0)) / step.length;
                let place = zero_between(bracket, width, &mut value);
                if first.is_none() || place < end {
                    (first, end) = (Some(index), place);
                }
            }
        }
        if first.is_some() {
            step.end_at(end);
        }
        first
    }
}

/// Returns true if the bounds of a guard over narrow parts of a step are narrower than those over the whole, so that
/// halving the step decides where the guard is negative. A jump or a pole may prevent bounds over the whole. Bounds
/// that stay as they are come from a quantity without bounds, such as a delayed one, in a function that has bounds
/// everywhere.
fn bounds_narrow(whole: Enclosure, enclose: &mut impl FnMut(f64, f64) -> Enclosure) -> bool {
    // Irregularly placed, and far narrower than the time between jumps.
    const WIDTH: f64 = 1e-6;
    let width = |of: Enclosure| of.value.high - of.value.low;
    [0.137, 0.457, 0.829].into_iter().any(|place| {
        let part = enclose(place, place + WIDTH);
        part.value.low > f64::NEG_INFINITY && (part.value.low >= 0.0 || width(part) < 0.5 * width(whole))
    })
}

/// Position in a step, as a fraction of its length, and the value of a guard there.
type Look = (f64, f64);

/// Two evaluations between which a guard becomes negative.
type Bracket = [Look; 2];

/// Search by bounds for the first instant at which a guard is negative.
struct Search<'a, V, B> {
    value: &'a mut V,
    enclose: &'a mut B,
    /// Length of the step, s.
    length: f64,
    /// Number of bounds that may still be computed.
    left: usize,
}

impl<V: FnMut(f64) -> f64, B: FnMut(f64, f64) -> Enclosure> Search<'_, V, B> {
    /// Returns the first bracket between two evaluations, the earlier of which is not negative; `bounds` are those
    /// between them.
    fn first(&mut self, [a, b]: Bracket, bounds: Enclosure, halvings: u32) -> Option<Bracket> {
        let by_ends = (b.1 < 0.0).then_some([a, b]);
        let (value, rate) = (bounds.value, bounds.rate);
        if value.low >= 0.0 || rate.low >= 0.0 {
            // Not negative anywhere, or nowhere less than at its start.
            return None;
        }
        if rate.high <= 0.0 {
            return by_ends;
        }
        // The guard lies above the lines from both ends with the extreme rates; `lowest` is their intersection times
        // the difference of the rates.
        let width = (b.0 - a.0) * self.length;
        let lowest = rate.high * a.1 - rate.low * b.1 + rate.low * rate.high * width;
        if b.1 >= 0.0 && lowest >= 0.0 {
            return None;
        }
        if halvings == 0 || self.left == 0 {
            return by_ends;
        }
        let middle = 0.5 * (a.0 + b.0);
        let middle = (middle, (self.value)(middle));
        let first = self.half([a, middle], halvings);
        // If the guard is negative in the middle, the first half contains a bracket.
        first.or_else(|| self.half([middle, b], halvings))
    }

    fn half(&mut self, [a, b]: Bracket, halvings: u32) -> Option<Bracket> {
        self.left = self.left.saturating_sub(1);
        let bounds = (self.enclose)(a.0, b.0);
        self.first([a, b], bounds, halvings - 1)
    }
}

/// Nodes of a step at which a guard without bounds is evaluated.
const PLACES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Nodes of [`PLACES`] within the step.
const INNER: [f64; 3] = [PLACES[1], PLACES[2], PLACES[3]];

/// Returns the first bracket of a guard without bounds, from its values at the ends and at the inner nodes. The bracket
/// lies between two of these values, or at a minimum below 0 of the quartic through them.
#[inline]
fn looks(value: &mut impl FnMut(f64) -> f64, ends: Bracket, inner: [f64; 3]) -> Option<Bracket> {
    let values = [ends[0].1, inner[0], inner[1], inner[2], ends[1].1];
    if is_far(&values) { None } else { look_closer(value, ends, &values) }
}

/// Returns true if all values are positive and exceed their spread, so that no quartic through them becomes negative.
/// Most guards are of this kind.
#[inline]
fn is_far(values: &[f64; 5]) -> bool {
    let [mut low, mut high] = [values[0]; 2];
    for &value in values {
        low = if value < low { value } else { low };
        high = if value > high { value } else { high };
    }
    low > high - low
}

fn look_closer(value: &mut impl FnMut(f64) -> f64, [start, last]: Bracket, values: &[f64; 5]) -> Option<Bracket> {
    let width = last.0;
    let at = |k: usize| (PLACES[k] * width, values[k]);
    let look = [start, at(1), at(2), at(3), last];
    for k in 1..look.len() {
        if look[k].1 < 0.0 {
            return Some(rise_before([look[k - 1], look[k]], value));
        }
        if let Some(place) = dip(values, k - 1) {
            let dip = (place * width, value(place * width));
            if dip.1 < 0.0 {
                return Some(rise_before([look[k - 1], dip], value));
            }
        }
    }
    None
}

/// Returns the position between two nodes of [`PLACES`] where the quartic through the values has a minimum below 0, to
/// a sixteenth of their distance.
fn dip(values: &[f64; 5], between: usize) -> Option<f64> {
    const PARTS: u32 = 16;
    let (from, to) = (PLACES[between], PLACES[between + 1]);
    let places = (1..PARTS).map(|k| from + (to - from) * f64::from(k) / f64::from(PARTS));
    let (place, value) =
        places.map(|p| (p, quartic(values, p))).fold((from, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
    (value < 0.0).then_some(place)
}

/// Evaluates the quartic through values at [`PLACES`], by Newton's divided differences.
fn quartic(values: &[f64; 5], place: f64) -> f64 {
    let mut d = *values;
    for order in 1..5 {
        for k in (order..5).rev() {
            d[k] = (d[k] - d[k - 1]) / (PLACES[k] - PLACES[k - order]);
        }
    }
    (0..4).rev().fold(d[4], |sum, k| d[k] + (place - PLACES[k]) * sum)
}

/// Refines a bracket whose guard is zero at its start and may rise before it falls. An example is the speed of a joint
/// that just broke away.
fn rise_before([a, b]: Bracket, value: &mut impl FnMut(f64) -> f64) -> Bracket {
    if a.1 > 0.0 {
        return [a, b];
    }
    let mut end = b;
    for k in 1..=40 {
        let theta = a.0 + (b.0 - a.0) * math::powi(0.5, k);
        let look = (theta, value(theta));
        if look.1 > 0.0 {
            return [look, end];
        }
        if look.1 < 0.0 {
            end = look;
        }
    }
    [a, end]
}

/// Returns a position where the value is negative, at most `resolution` after one where it is not. Uses the secant
/// through both ends, shifted by the resolution towards the end that it does not replace. Bisects where the secant
/// converges slowly.
fn zero_between([mut a, mut b]: Bracket, resolution: f64, value: &mut impl FnMut(f64) -> f64) -> f64 {
    let resolution = resolution.max(f64::EPSILON * a.0);
    let mut width = b.0 - a.0;
    let mut slow = 0;
    while b.0 - a.0 > resolution {
        let secant = (a.0 * b.1 - b.0 * a.1) / (b.1 - a.1);
        let beside = if secant - a.0 < b.0 - secant { secant + resolution } else { secant - resolution };
        let halve = slow > 1 || !(beside > a.0 && beside < b.0);
        let middle = if halve { 0.5 * (a.0 + b.0) } else { beside };
        if !(middle > a.0 && middle < b.0) {
            break;
        }
        let look = (middle, value(middle));
        *(if look.1 < 0.0 { &mut b } else { &mut a }) = look;
        slow = if halve || b.0 - a.0 < 0.5 * width { 0 } else { slow + 1 };
        width = b.0 - a.0;
    }
    b.0
}

/// Guard that becomes negative at an instant by itself, not because of an event there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing<S> {
    guard: usize,
    /// Derivatives of the time of the crossing, with value 0.
    late: S,
}

impl<S: Scalar> Crossing<S> {
    /// Returns the crossings at the end of the step, the first of them found in it; only that one without tangents.
    pub(super) fn all<P: Integrable<S> + ?Sized>(
        f: &Driven<'_, S, P>,
        first: usize,
        step: &Step<S>,
        x: &mut [S],
    ) -> Vec<Self> {
        let of = |guard: usize, x: &mut [S]| Self { guard, late: delay(f, guard, step, x) };
        let mut all = vec![of(first, x)];
        if S::DIRECTIONS > 0 {
            for guard in (0..f.guards()).filter(|&guard| guard != first) {
                step.at(step.share, x);
                if f.guard(guard, step.time(step.share), x).value() < 0.0 {
                    all.push(of(guard, x));
                }
            }
        }
        all
    }

    /// Returns the derivatives of the time of all crossings, of which there is at least one; NaN if they differ.
    pub(super) fn common(all: &[Self]) -> S {
        all.iter().skip(1).fold(all[0].late, |late, other| common(late, other.late))
    }
}

/// Returns the tangents of the event time, as a number with zero value: `dt = -dg / (dg/dt)` by the implicit function
/// theorem. The rate of the guard along the solution is exact if the plant provides it, else taken from the dense
/// output. If the guard only grazes zero, the event time has no derivative and 0 is returned.
///
/// Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition (1993), section
/// I.14; jumps of tangents at events: S. Galan, W. Feehery, P. Barton, Applied Numerical Mathematics 31 (1999) 17-47.
fn delay<S: Scalar, P: Integrable<S> + ?Sized>(f: &Driven<'_, S, P>, index: usize, step: &Step<S>, x: &mut [S]) -> S {
    /// Distance of the two evaluations that give the rate from the event, as a fraction of the step.
    const APART: f64 = 1e-3;
    if S::DIRECTIONS == 0 {
        return S::from(0.0);
    }
    let theta = step.share;
    let guard = |theta: f64, x: &mut [S]| {
        step.at(theta, x);
        f.guard(index, step.time(theta), x)
    };
    let here = guard(theta, x);
    let rate = f.guard_rate(index, step.time(theta), x).unwrap_or_else(|| {
        let rise = guard(theta + APART, x).value() - guard(theta - APART, x).value();
        rise / (2.0 * APART * step.length)
    });
    let delay = -(here - here.value()) / rate;
    if delay.tangents().iter().all(|d| d.is_finite()) { delay } else { S::from(0.0) }
}
