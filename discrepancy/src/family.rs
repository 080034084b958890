//! Families of unknown signals: free over time, or functions of the position, the speed, the input or the time at a place;
//! each linear between knots, and smooth as far as the data do not say otherwise.

use std::ops::Range;

use mops_math as math;
use nalgebra::DMatrix;

use crate::gaussian::{joined, matern};

/// What a signal is a function of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// Of time, in each experiment another.
    Free,
    /// Of the position; at a process of its state, at a sensor of the signal.
    Position,
    /// Of the speed; at a sensor of the signal's rate.
    Speed,
    /// Of the input.
    Input,
    /// Of the time since the start of the experiment, the same in all.
    Time,
}

impl Over {
    /// As results spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free | Self::Time => "time",
            Self::Position => "position",
            Self::Speed => "speed",
            Self::Input => "input",
        }
    }
}

/// What a place looks like at a moment.
#[derive(Debug, Clone, Copy, Default)]
pub struct Look {
    /// Time since the start of the experiment, s.
    pub t: f64,
    /// Position.
    pub position: f64,
    /// Speed.
    pub speed: f64,
    /// Input.
    pub input: f64,
}

impl Look {
    /// The value of an argument.
    pub fn of(&self, over: Over) -> f64 {
        match over {
            Over::Free | Over::Time => self.t,
            Over::Position => self.position,
            Over::Speed => self.speed,
            Over::Input => self.input,
        }
    }
}

/// Knots of a part of a family.
#[derive(Debug, Clone)]
struct Block {
    /// The only piece in which it acts.
    piece: Option<usize>,
    /// Increasing values of the argument.
    knots: Vec<f64>,
    /// Where the knots lie in units of the range, as smoothness sees it.
    places: Vec<f64>,
}

/// A family: a column for every knot.
#[derive(Debug, Clone)]
pub struct Family {
    /// What the signal is a function of.
    pub over: Over,
    /// Its columns among those of the place.
    pub columns: Range<usize>,
    /// Lengths over which it may change that are tried, in units of the range.
    pub lengths: Vec<f64>,
    blocks: Vec<Block>,
}

/// Knots of a function of one argument; of the speed, where they are dense about 0; of the time, of which a function with
/// many would be free.
const KNOTS: u32 = 25;
const SPEEDS: u32 = 14;
const TIMES: u32 = 13;

impl Family {
    /// Signals that are free over time: about `total` knots, shared out among the pieces with these spans, at most
    /// one for two samples.
    #[allow(clippy::cast_precision_loss)]
    pub fn free(spans: &[[f64; 2]], samples: &[usize], total: usize, first: usize) -> Self {
        let share = (total / spans.len().max(1)).max(8);
        let counts: Vec<usize> = samples.iter().map(|n| share.min(n / 2).max(4)).collect();
        let even = |n: usize, [from, to]: [f64; 2]| {
            (0..n).map(move |k| from + (to - from) * k as f64 / (n - 1) as f64).collect()
        };
        let blocks = counts.iter().zip(spans).enumerate().map(|(piece, (&n, &span))| Block {
            piece: Some(piece),
            knots: even(n, span),
            places: even(n, [0.0, 1.0]),
        });
        let spacing = 1.0 / counts.iter().max().map_or(1.0, |&n| (n - 1) as f64);
        let lengths = [1.5, 5.0, 20.0, 80.0].map(|l| l * spacing).to_vec();
        Self {
            over: Over::Free,
            columns: first..first + counts.iter().sum::<usize>(),
            lengths,
            blocks: blocks.collect(),
        }
    }

    /// Signals that are a function of an argument, over the range of its values; `None` where that does not change.
    pub fn function(over: Over, values: impl Iterator<Item = f64>, first: usize) -> Option<Self> {
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
        if !(high - low > 1e-9 * (high.abs() + low.abs()) && high.is_finite() && low.is_finite()) {
            return None;
        }
        let (knots, places): (Vec<f64>, Vec<f64>) = if over == Over::Speed && low < 0.0 && high > 0.0 {
            // Friction jumps where the speed changes its sign: an even number of knots, dense about 0.
            let side = SPEEDS / 2;
            let shares = (1..=side).map(|k| f64::from(2 * k - 1) / f64::from(2 * side - 1));
            let back = shares.clone().rev().map(|s| (low * math::powf(s, 1.7), -0.5 * s));
            back.chain(shares.map(|s| (high * math::powf(s, 1.7), 0.5 * s))).unzip()
        } else {
            let count = if over == Over::Time { TIMES } else { KNOTS };
            let shares = (0..count).map(|k| f64::from(k) / f64::from(count - 1));
            shares.map(|s| (low + s * (high - low), s)).unzip()
        };
        let lengths = vec![0.06, 0.2, 0.7, 3.0];
        Some(Self {
            over,
            columns: first..first + knots.len(),
            lengths,
            blocks: vec![Block { piece: None, knots, places }],
        })
    }

    /// The root of the covariance of the values at the knots for a length.
    pub fn root(&self, length: f64) -> Option<DMatrix<f64>> {
        let roots: Option<Vec<DMatrix<f64>>> = self.blocks.iter().map(|b| matern(&b.places, length)).collect();
        let roots = roots?;
        Some(joined(&roots.iter().map(|root| (1.0, root)).collect::<Vec<_>>()))
    }

    /// The signals of unit value at one knot and 0 at the others, in a piece: column and signal.
    pub fn signals(&self, piece: usize, looks: &[Look]) -> Vec<(usize, Vec<f64>)> {
        let mut all = Vec::new();
        self.each(piece, |first, block| {
            let mut signals = vec![vec![0.0; looks.len()]; block.knots.len()];
            for (i, look) in looks.iter().enumerate() {
                let (k, share) = between(&block.knots, look.of(self.over));
                signals[k][i] += 1.0 - share;
                signals[k + 1][i] += share;
            }
            all.extend(signals.into_iter().enumerate().map(|(k, signal)| (first + k, signal)));
        });
        all
    }

    /// Adds the signal with these values at the knots, in a piece.
    pub fn add(&self, values: &[f64], piece: usize, looks: &[Look], signal: &mut [f64]) {
        self.each(piece, |first, block| {
            for (s, look) in signal.iter_mut().zip(looks) {
                let (k, share) = between(&block.knots, look.of(self.over));
                *s += (1.0 - share) * values[first + k] + share * values[first + k + 1];
            }
        });
    }

    /// Knots of a function of one argument.
    #[cfg(test)]
    fn knots(&self) -> Vec<f64> {
        self.blocks.iter().flat_map(|block| block.knots.iter().copied()).collect()
    }

    fn each(&self, piece: usize, mut look: impl FnMut(usize, &Block)) {
        let mut first = self.columns.start;
        for block in &self.blocks {
            if block.piece.is_none_or(|only| only == piece) {
                look(first, block);
            }
            first += block.knots.len();
        }
    }
}

/// The knot before a value, and the share of the way to the next; values outside count as the nearest knot.
fn between(knots: &[f64], x: f64) -> (usize, f64) {
    let k = knots.partition_point(|&knot| knot <= x).clamp(1, knots.len() - 1) - 1;
    (k, ((x - knots[k]) / (knots[k + 1] - knots[k])).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_is_linear_between_its_knots() {
        let family = Family::function(Over::Position, [-1.0, 3.0].into_iter(), 2).expect("it changes");
        let values: Vec<f64> = [0.0; 2].into_iter().chain(family.knots().iter().map(|x| 2.0 * x)).collect();
        let looks = [-2.0, -1.0, 0.1, 2.9, 5.0].map(|position| Look { position, ..Look::default() });
        let mut signal = vec![0.0; 5];
        family.add(&values, 0, &looks, &mut signal);
        for (s, expected) in signal.iter().zip([-2.0, -2.0, 0.2, 5.8, 6.0]) {
            assert!((s - expected).abs() < 1e-12, "{signal:?}");
        }
    }

    #[test]
    fn what_does_not_change_is_no_argument_and_a_speed_has_no_knot_at_rest() {
        assert!(Family::function(Over::Input, [2.0, 2.0].into_iter(), 0).is_none());
        let speed = Family::function(Over::Speed, [-1.0, 3.0].into_iter(), 0).expect("it changes");
        let knots = speed.knots();
        assert!(knots.windows(2).all(|w| w[0] < w[1]) && knots.iter().all(|x| x.abs() > 0.01), "{knots:?}");
        assert_eq!((knots[0], knots[13]), (-1.0, 3.0));
    }
}
