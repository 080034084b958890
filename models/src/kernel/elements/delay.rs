//! Constant delay of a simulated signal.

use std::collections::VecDeque;

use mops_core::Scalar;

use crate::kernel::is_due;

/// Delay `y(t) = u(t - time)`, with `u(t) = before` for t < 0.
///
/// The model that owns a delay takes steps no longer than [`Delay::longest_step`] and ends steps at
/// [`Delay::next_break`]. It passes on `u` along every accepted step ([`crate::kernel::Dynamics::accepted`]). `u` is
/// stored as the quartic through its values at five nodes of each step. Where the integration restarts, `u` or a derivative may
/// jump ([`Delay::restart`]), and so does the output later.
///
/// Source: A. Bellen, M. Zennaro, Numerical Methods for Delay Differential Equations (2003), section 3.2 (method of
/// steps), 2.2 (propagation of jumps).
#[derive(Debug, Clone)]
pub struct Delay<S> {
    time: S,
    before: S,
    pieces: VecDeque<Piece<S>>,
    /// Largest absolute value of `u` so far.
    size: f64,
    /// Time up to which jumps of `u` have reached the output, s.
    passed: f64,
    /// Jump at the start of the next piece.
    jump: Option<Jump<S>>,
}

/// Possible jump of a signal or of its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Jump<S> {
    /// Lowest derivative that may jump.
    pub derivative: u8,
    /// Derivatives of the time of the jump along the directions of the scalar, with value 0.
    pub delay: S,
}

/// Course of `u` over a step.
#[derive(Debug, Clone)]
struct Piece<S> {
    /// Start and end, s.
    start: f64,
    end: f64,
    /// Coefficients in powers of the position within the piece, from 0 to 1.
    coefficients: [S; 5],
    /// Jump at the start of the piece.
    jump: Option<Jump<S>>,
}

/// Highest derivative whose jumps end steps: the method has order five.
const HIGHEST: u8 = 5;

impl<S: Scalar> Delay<S> {
    /// Nodes of a step, as fractions from 0 to 1, at which [`Delay::push`] expects `u`.
    pub const NODES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

    /// Creates a delay of `time` (s, positive).
    pub fn new(time: S, before: S) -> Self {
        Self {
            time,
            before,
            pieces: VecDeque::new(),
            size: 0.0,
            passed: f64::NEG_INFINITY,
            jump: Some(Jump { derivative: 0, delay: S::from(0.0) }),
        }
    }

    /// Returns the delay, s.
    pub fn time(&self) -> S {
        self.time
    }

    /// Returns the largest absolute value of the signal so far.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Sets the value before the start.
    pub fn set_before(&mut self, before: S) {
        self.before = before;
    }

    /// Returns the longest step for which all required past values are known, s.
    pub fn longest_step(&self) -> f64 {
        0.5 * self.time.value()
    }

    /// Returns the piece that is at the output at `t`.
    fn piece_at(&self, t: f64) -> Option<&Piece<S>> {
        let time = self.time.value();
        // A jump that has not reached the output yet hides the pieces after it.
        let begun = |piece: &&Piece<S>| match piece.jump {
            Some(_) => is_due(piece.start + time, self.passed) && is_due(piece.start + time, t),
            None => piece.start + time <= t,
        };
        let later = self.pieces.partition_point(|piece| is_due(piece.start + time, t));
        self.pieces.range(..later).rev().find(begun)
    }

    /// Returns the delayed signal at `t`.
    pub fn at(&self, t: f64) -> S {
        let Some(piece) = self.piece_at(t) else { return self.before };
        let s = (S::from(t - piece.start) - self.time) / (piece.end - piece.start);
        piece.coefficients.iter().rev().fold(S::from(0.0), |sum, &c| sum * s + c)
    }

    /// Returns the rate of the delayed signal at `t`, per s.
    pub fn slope(&self, t: f64) -> f64 {
        let Some(piece) = self.piece_at(t) else { return 0.0 };
        let length = piece.end - piece.start;
        let s = (t - piece.start - self.time.value()) / length;
        let [_, a, b, c, d] = piece.coefficients.map(Scalar::value);
        (a + s * (2.0 * b + s * (3.0 * c + s * 4.0 * d))) / length
    }

    /// Stores `u` over an accepted step, given at [`Delay::NODES`].
    pub fn push(&mut self, start: f64, end: f64, u: [S; 5]) {
        self.size = u.iter().fold(self.size, |most, u| most.max(u.value().abs()));
        let last = self
            .pieces
            .back()
            .map_or(self.before.value(), |piece| piece.coefficients.iter().fold(0.0, |sum, c| sum + c.value()));
        let jumps = (last - u[0].value()).abs() > 1e-9 * last.abs().max(u[0].value().abs());
        let jump = match self.jump.take() {
            // A derivative that arrives causes no jump of the signal itself, so that this one is of other origin, at a fixed time.
            Some(jump) if jumps && jump.derivative > 1 => Some(Jump { derivative: 0, delay: S::from(0.0) }),
            Some(jump) => Some(Jump { derivative: if jumps { 0 } else { jump.derivative.max(1) }, ..jump }),
            None => jumps.then_some(Jump { derivative: 0, delay: S::from(0.0) }),
        };
        let [a, b, c, d] = [1, 2, 3, 4].map(|i| u[i] - u[0]);
        // Newton's forward differences on the nodes k/4, expanded in powers of s.
        let coefficients = [
            u[0],
            a * 16.0 - b * 12.0 + c * (16.0 / 3.0) - d,
            (b * 228.0 - a * 208.0 - c * 112.0 + d * 22.0) / 3.0,
            a * 96.0 - b * 128.0 + c * (224.0 / 3.0) - d * 16.0,
            (b * 192.0 - a * 128.0 - c * 128.0 + d * 32.0) / 3.0,
        ];
        self.pieces.push_back(Piece { start, end, coefficients, jump });
        while self.pieces.len() > 1 && self.pieces[1].start < start - self.time.value() {
            self.pieces.pop_front();
        }
    }

    /// Notes that the integration restarts now, where `u` or its derivatives may jump.
    pub fn restart(&mut self, jump: Jump<S>) {
        self.jump = (jump.derivative <= HIGHEST).then_some(jump);
    }

    /// Returns the pieces whose jumps have not reached the output yet.
    fn ahead(&self) -> impl Iterator<Item = (&Piece<S>, f64)> + Clone {
        let jumps = self.pieces.iter().filter(|piece| piece.jump.is_some());
        jumps.map(|piece| (piece, piece.start + self.time.value())).filter(|(_, out)| !is_due(*out, self.passed))
    }

    /// Returns the next time after `t` at which a jump of `u` reaches the output, s.
    pub fn next_break(&self, t: f64) -> f64 {
        self.ahead().map(|(_, out)| out).find(|&out| out > t).unwrap_or(f64::INFINITY)
    }

    /// Returns the jump of the output at the break at `t`, of the lowest derivative; `None` without a jump.
    pub fn jump_at(&self, t: f64) -> Option<Jump<S>> {
        let moves = self.time - self.time.value();
        let due = self.ahead().filter(|(_, out)| is_due(*out, t)).filter_map(|(piece, _)| piece.jump);
        due.map(|jump| Jump { delay: jump.delay + moves, ..jump }).min_by_key(|jump| jump.derivative)
    }

    /// Handles a break: jumps that are due reach the output.
    pub fn pass_break(&mut self, t: f64) {
        self.passed = t;
    }
}
