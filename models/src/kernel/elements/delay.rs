//! Constant delay of a simulated signal.

use std::collections::VecDeque;

use mops_core::{
    Instant, Plant, Trace,
    plant::{Memory, Past, Tolerance},
};
use mops_language::Scalar;

use crate::kernel::{allowed, common, is_due};

/// Delay `y(t) = u(t - time)`, with `u(t) = before` for t < 0.
///
/// The model that owns a delay takes steps no longer than [`Delay::longest_step`] and ends steps at
/// [`Delay::next_break`]. It passes on `u` along every accepted step ([`Memory::remember`]). `u` is
/// stored as the quartic through its values at five nodes of each step. A step ends where a jump of `u`, of its rate or
/// of its curvature reaches the output.
///
/// Source: A. Bellen, M. Zennaro, Numerical Methods for Delay Differential Equations (2003), section 3.2 (method of
/// steps), 2.2 (propagation of jumps).
#[derive(Debug, Clone)]
pub struct Delay<S> {
    time: S,
    before: S,
    pieces: VecDeque<Piece<S>>,
    /// Jumps of `u` that have not reached the output yet.
    ahead: VecDeque<Arrival<S>>,
    /// Largest absolute value of `u` so far.
    size: f64,
    /// Time up to which jumps of `u` have reached the output, s.
    passed: f64,
    /// Restart of the integration at the next piece.
    restart: Option<Restart<S>>,
}

/// Course of `u` over a step.
#[derive(Debug, Clone)]
struct Piece<S> {
    /// Start and end, s.
    start: f64,
    end: f64,
    /// Coefficients in powers of the position within the piece, from 0 to 1.
    coefficients: [S; 5],
    /// True if `u` or a derivative jumps at the start of the piece.
    jumps: bool,
}

/// Jump on its way to the output.
#[derive(Debug, Clone, Copy)]
pub struct Arrival<S> {
    /// Time at which it reaches the output, s.
    pub time: f64,
    /// Derivatives of this time along the directions of the scalar, with value 0.
    pub moves: S,
    /// Lowest derivative of `u` that jumps.
    pub derivative: u8,
}

/// Restart of the integration, where `u` or its derivatives may jump.
#[derive(Debug, Clone, Copy)]
pub struct Restart<S> {
    /// Lowest derivative that is known to jump; `None` if a jump shows in `u` only.
    pub derivative: Option<u8>,
    /// Derivatives of its time along the directions of the scalar, with value 0.
    pub moves: S,
    /// True if a jump of `u` itself moves with it; otherwise such a jump has another cause, at a fixed time.
    pub jumps: bool,
}

impl<S: Scalar> Restart<S> {
    /// Restart at a fixed time.
    pub fn fixed() -> Self {
        Self { derivative: None, moves: S::from(0.0), jumps: false }
    }
}

/// Highest derivative whose jump ends a step because a lower one has arrived. The tangents with respect to the delay
/// jump one derivative lower, and are not part of the error of a step.
const HIGHEST: u8 = 4;

/// Smallest jump of the value, relative to its size: above the rounding of a quartic at its end.
const JUMP: f64 = 1e-9;

/// Smallest jumps of rate and curvature, times the length of the shorter piece and its square, in units of the
/// permitted error of a quartic. An error of a quartic that is 1 at most appears as up to 16 and 160 there (weights of
/// its derivatives at its ends).
const BENDS: [f64; 2] = [100.0, 1000.0];

impl<S: Scalar> Piece<S> {
    /// Returns value, rate and curvature at a position.
    fn motion(&self, s: f64) -> [f64; 3] {
        let [c0, c1, c2, c3, c4] = self.coefficients.map(Scalar::value);
        let length = self.end - self.start;
        [
            c0 + s * (c1 + s * (c2 + s * (c3 + s * c4))),
            (c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * 4.0 * c4))) / length,
            (2.0 * c2 + s * (6.0 * c3 + s * 12.0 * c4)) / (length * length),
        ]
    }
}

impl<S: Scalar> Delay<S> {
    /// Creates a delay of `time` (s, positive).
    pub fn new(time: S, before: S) -> Self {
        let (pieces, ahead) = (VecDeque::new(), VecDeque::new());
        Self { time, before, pieces, ahead, size: 0.0, passed: f64::NEG_INFINITY, restart: Some(Restart::fixed()) }
    }

    /// Returns the delay, s.
    pub fn time(&self) -> S {
        self.time
    }

    /// Returns the largest absolute value of the signal so far.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Takes the past as constant.
    pub fn hold(&mut self, before: S) {
        self.before = before;
        self.pieces.clear();
        self.ahead.clear();
    }

    /// Sets the value before the start.
    pub fn set_before(&mut self, before: S) {
        self.before = before;
    }

    /// Returns the value before the start.
    pub fn before(&self) -> S {
        self.before
    }

    /// Returns the longest step for which all required past values are known, s.
    pub fn longest_step(&self) -> f64 {
        0.5 * self.time.value()
    }

    /// Returns the piece that is at the output at `t`.
    fn piece_at(&self, t: f64) -> Option<&Piece<S>> {
        let time = self.time.value();
        // A jump that has not reached the output yet hides the pieces after it.
        let has_started = |piece: &&Piece<S>| match piece.jumps {
            true => is_due(piece.start + time, self.passed) && is_due(piece.start + time, t),
            false => piece.start + time <= t,
        };
        let later = self.pieces.partition_point(|piece| is_due(piece.start + time, t));
        self.pieces.range(..later).rev().find(has_started)
    }

    /// Returns the delayed signal at `t`.
    pub fn at(&self, t: f64) -> S {
        let Some(piece) = self.piece_at(t) else { return self.before };
        let s = (S::from(t - piece.start) - self.time) / (piece.end - piece.start);
        piece.coefficients.iter().rev().fold(S::from(0.0), |sum, &c| sum * s + c)
    }

    /// Returns the rate of the delayed signal at `t`, per s.
    pub fn slope(&self, t: f64) -> f64 {
        self.piece_at(t)
            .map_or(0.0, |piece| piece.motion((t - piece.start - self.time.value()) / (piece.end - piece.start))[1])
    }

    /// Stores `u` over a part of an accepted step, given at [`Trace::NODES`]; `error` is the permitted error of its
    /// quartic.
    pub fn push(&mut self, [start, end]: [f64; 2], u: [S; 5], error: f64) {
        self.size = u.iter().fold(self.size, |most, u| most.max(u.value().abs()));
        let mut piece = Piece { start, end, coefficients: Trace::quartic(u), jumps: false };
        let (last, length) = self
            .pieces
            .back()
            .map_or(([self.before.value(), 0.0, 0.0], f64::INFINITY), |last| (last.motion(1.0), last.end - last.start));
        let now = piece.motion(0.0);
        let length = length.min(end - start);
        let off = |k: usize| (now[k] - last[k]).abs();
        let is_of_value = off(0) > JUMP * last[0].abs().max(now[0].abs());
        if let Some(Restart { derivative, moves, jumps }) = self.restart.take() {
            let found =
                match [is_of_value, off(1) * length > BENDS[0] * error, off(2) * length * length > BENDS[1] * error] {
                    [true, ..] => Some(0),
                    [_, true, _] => Some(1),
                    [.., true] => Some(2),
                    _ => None,
                };
            let known = derivative.filter(|&derivative| derivative <= HIGHEST);
            if let Some(derivative) = found.into_iter().chain(known).min() {
                let moves = if derivative == 0 && !jumps { S::from(0.0) } else { moves };
                let moves = moves + (self.time - self.time.value());
                self.ahead.push_back(Arrival { time: start + self.time.value(), moves, derivative });
                piece.jumps = true;
            }
        }
        self.pieces.push_back(piece);
        while self.pieces.len() > 1 && self.pieces[1].start < start - self.time.value() {
            self.pieces.pop_front();
        }
    }

    /// Notes that the integration restarts now.
    pub fn restart(&mut self, restart: Restart<S>) {
        self.restart = Some(restart);
    }

    /// Returns the next time after `t` at which a jump of `u` reaches the output, s.
    pub fn next_break(&self, t: f64) -> f64 {
        self.ahead.iter().map(|arrival| arrival.time).find(|&time| time > t).unwrap_or(f64::INFINITY)
    }

    /// Handles a break: jumps that are due reach the output. Returns that of the lowest derivative.
    pub fn pass_break(&mut self, t: f64) -> Option<Arrival<S>> {
        self.passed = t;
        let mut arrived: Option<Arrival<S>> = None;
        while let Some(arrival) = self.ahead.front().copied().filter(|arrival| is_due(arrival.time, t)) {
            if arrived.is_none_or(|known| arrival.derivative < known.derivative) {
                arrived = Some(arrival);
            }
            self.ahead.pop_front();
        }
        arrived
    }

    /// Returns true if a jump of the value is due at the output at `t`.
    pub fn jumps_at(&self, t: f64) -> bool {
        self.ahead.iter().take_while(|arrival| is_due(arrival.time, t)).any(|arrival| arrival.derivative == 0)
    }
}

/// Highest derivative whose jump bends a signal.
const BENDING: u8 = 1;

/// Lets the jumps of delayed quantities that are due take effect; `settle` determines the mode of the plant. A jump
/// that moves with the parameters moves the state by the jump of its rates. Returns the derivatives of the time of the
/// jump of lowest derivative, NaN if several signals jump or bend with different ones.
pub(crate) fn pass_delays<S: Scalar, P: Plant<S> + Memory<S>>(
    plant: &mut P,
    delays: impl Fn(&mut P) -> &mut [Delay<S>],
    settle: impl Fn(&mut P, &Instant<'_, S>),
    at: &Instant<'_, S>,
    x: &mut [S],
) -> S {
    let mut first: Option<Arrival<S>> = None;
    let mut all: Option<S> = None;
    let mut jumps = vec![false; delays(plant).len()];
    for k in 0..delays(plant).len() {
        let moves = S::DIRECTIONS > 0 && delays(plant)[k].jumps_at(at.t);
        let look = |plant: &P, x: &[S]| {
            let (at, mut rates) = (Instant { x, ..*at }, x.to_vec());
            plant.rates(&at, &mut rates);
            (rates, plant.past(&at))
        };
        let before = moves.then(|| look(plant, x));
        let Some(arrival) = delays(plant)[k].pass_break(at.t) else { continue };
        if arrival.derivative <= BENDING {
            all = Some(all.map_or(arrival.moves, |all| common(all, arrival.moves)));
        }
        if first.is_none_or(|first| arrival.derivative < first.derivative) {
            first = Some(arrival);
        }
        let Some((before, past_before)) = before else { continue };
        settle(plant, &Instant { x, ..*at });
        let (after, past) = look(plant, x);
        for ((x, before), after) in x.iter_mut().zip(before).zip(after) {
            *x += arrival.moves * (before.value() - after.value());
        }
        for ((jumps, before), after) in jumps.iter_mut().zip(past_before).zip(past) {
            *jumps |= before.value() != after.value();
        }
    }
    let moves = first.map_or(S::from(0.0), |arrival| arrival.moves);
    // A jump that arrives in the rates is one derivative higher in the states.
    let derivative = first.map(|arrival| arrival.derivative + 1);
    let restart = |jumps: bool| Restart { derivative, moves, jumps };
    delays(plant).iter_mut().zip(jumps).for_each(|(delay, jumps)| delay.restart(restart(jumps)));
    all.unwrap_or(moves)
}

/// Stores delayed quantities over a part of a step, or returns false if a quartic through the values is not accurate
/// enough.
pub(crate) fn remember_delays<S: Scalar>(delays: &mut [Delay<S>], tolerance: &Tolerance, over: &Past<'_, S>) -> bool {
    let quartic = |k: usize| over.values.each_ref().map(|values| values[k]);
    let agrees = |(k, delay): (usize, &Delay<S>)| {
        let (values, checks) = (quartic(k).map(Scalar::value), over.checks.each_ref().map(|values| values[k].value()));
        let size = values.iter().chain(&checks).fold(0.0, |most: f64, value| most.max(value.abs()));
        let off = Trace::deviation(values, checks);
        let rough = over.roughness.get(k).copied().unwrap_or(0.0);
        off.is_nan() || off <= allowed(tolerance, delay.size(), size) + rough
    };
    if !over.is_last && !delays.iter().enumerate().all(agrees) {
        return false;
    }
    for (k, delay) in delays.iter_mut().enumerate() {
        if over.restarts {
            delay.restart(Restart::fixed());
        }
        let values = quartic(k);
        let size = values.iter().fold(delay.size(), |most, value| most.max(value.value().abs()));
        delay.push(over.time, values, allowed(tolerance, size, size));
    }
    true
}
