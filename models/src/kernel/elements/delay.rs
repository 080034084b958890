//! Constant delay of a simulated signal.

use std::collections::VecDeque;

use mops_core::Scalar;

/// Delay `y(t) = u(t - time)`, with `u(t) = before` for t < 0.
///
/// The model that owns a delay takes steps no longer than [`Delay::longest_step`] and ends steps at
/// [`Delay::next_break`]. It passes on `u` along every accepted step ([`crate::kernel::Dynamics::accepted`]). `u` is
/// stored as the quartic through its values at five nodes of each step. Tangents with respect to `time` are exact if
/// `u` has no jumps.
///
/// Source: A. Bellen, M. Zennaro, Numerical Methods for Delay Differential Equations (2003), section 3.2 (method of
/// steps), 2.2 (propagation of jumps).
#[derive(Debug, Clone)]
pub struct Delay<S> {
    time: S,
    before: S,
    pieces: VecDeque<Piece<S>>,
    /// Jumps of `u` up to this time have reached the output, s.
    passed: f64,
}

/// Course of `u` over a step.
#[derive(Debug, Clone)]
struct Piece<S> {
    /// Start and end, s.
    start: f64,
    end: f64,
    /// Coefficients in powers of the position within the piece, from 0 to 1.
    coefficients: [S; 5],
    /// True if `u` jumps at the start of the piece, or is first known there.
    jumps: bool,
}

impl<S: Scalar> Delay<S> {
    /// Nodes of a step, as fractions from 0 to 1, at which [`Delay::push`] expects `u`.
    pub const NODES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

    /// Creates a delay of `time` (s, positive).
    pub fn new(time: S, before: S) -> Self {
        Self { time, before, pieces: VecDeque::new(), passed: f64::NEG_INFINITY }
    }

    /// Returns the longest step for which all required past values are known, s.
    pub fn longest_step(&self) -> f64 {
        0.5 * self.time.value()
    }

    /// Returns the delayed signal at `t`.
    pub fn at(&self, t: f64) -> S {
        let then = t - self.time.value();
        // A jump that has not reached the output yet hides the pieces after it.
        let begun = |piece: &&Piece<S>| {
            if piece.jumps { piece.start <= self.passed && piece.start <= then + ROUNDING } else { piece.start <= then }
        };
        let Some(piece) = self.pieces.iter().rev().find(begun) else { return self.before };
        let s = (S::from(t - piece.start) - self.time) / (piece.end - piece.start);
        piece.coefficients.iter().rev().fold(S::from(0.0), |sum, &c| sum * s + c)
    }

    /// Stores `u` over an accepted step, given at [`Delay::NODES`].
    pub fn push(&mut self, start: f64, end: f64, u: [S; 5]) {
        let jumps = self.pieces.back().is_none_or(|piece| {
            let last = piece.coefficients.iter().fold(0.0, |sum, c| sum + c.value());
            (last - u[0].value()).abs() > 1e-9 * last.abs().max(u[0].value().abs())
        });
        let [a, b, c, d] = [1, 2, 3, 4].map(|i| u[i] - u[0]);
        // Newton's forward differences on the nodes k/4, expanded in powers of s.
        let coefficients = [
            u[0],
            a * 16.0 - b * 12.0 + c * (16.0 / 3.0) - d,
            (b * 228.0 - a * 208.0 - c * 112.0 + d * 22.0) / 3.0,
            a * 96.0 - b * 128.0 + c * (224.0 / 3.0) - d * 16.0,
            (b * 192.0 - a * 128.0 - c * 128.0 + d * 32.0) / 3.0,
        ];
        self.pieces.push_back(Piece { start, end, coefficients, jumps });
        while self.pieces.len() > 1 && self.pieces[1].start < start - self.time.value() {
            self.pieces.pop_front();
        }
    }

    /// Returns the next time after `t` at which a jump of `u` reaches the output, s.
    pub fn next_break(&self, t: f64) -> f64 {
        let due = self.pieces.iter().filter(|piece| piece.jumps && piece.start > self.passed);
        due.map(|piece| piece.start + self.time.value()).find(|&out| out > t).unwrap_or(f64::INFINITY)
    }

    /// Handles a break: jumps that are due reach the output.
    pub fn pass_break(&mut self, t: f64) {
        self.passed = t - self.time.value() + ROUNDING;
    }
}

/// Time difference up to which two times count as equal, s.
const ROUNDING: f64 = 1e-12;
