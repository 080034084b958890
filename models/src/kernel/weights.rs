//! Error weights: the size of each state, relative to its own scale.

use mops_core::plant::Tolerance;
use mops_language::Scalar;

use super::by_size::by_size;

/// Weights of the errors of all states: `relative |x_i| + floor_i`.
///
/// The size `|x_i|` is the larger of the values at both ends of the step. The size is at least the change over
/// [`BRIEF`] of the simulated time at the rate at the end of the step. A state that leaves 0 at a kink without a guard
/// would otherwise need infinitely short steps.
///
/// The floor is the tolerance for a state that is small relative to its usual size: `absolute` if the user gives it,
/// else `SHARE relative s_i`. The scale `s_i` is declared for the state, or else the largest `|x_i|` so far. A state
/// that rests at 0 from the start has no scale. Its error is relative to the value that the state reaches in the step.
///
/// The weights allow for rounding errors, which no step size can reduce. Rates of states that are differences of large
/// numbers are rough. A step of length `h` has at least an error of `h` times that roughness (see [`Weights::feel`]).
#[derive(Debug, Clone)]
pub struct Weights {
    relative: f64,
    /// Coefficients of the floor: the first, plus the second times the scale of the state.
    floor: [f64; 2],
    /// Simulated time, s.
    span: f64,
    /// Largest absolute value so far, or the declared scale.
    scales: Vec<f64>,
    /// Floors without the allowance for rounding.
    floors: Vec<f64>,
    /// Change of each rate caused by rounding of the states, per s.
    roughness: Vec<f64>,
    /// Step size below which no rate is rough, s.
    smooth: f64,
    /// Attempts since the roughness was last measured.
    attempts: usize,
}

/// Part of the relative tolerance that applies to the scale of a state which passes through 0. A hundredth is the ratio
/// of the absolute tolerance 1e-10 to the relative tolerance 1e-8.
pub(super) const SHARE: f64 = 0.01;

/// Fraction of the simulated time over which the rate of a state sets a lower bound on its size. Far shorter than the
/// motions that an explicit method can follow, far longer than the resolution of the clock.
const BRIEF: f64 = 1e-6;

/// Attempted steps between measurements of the roughness: frequent enough for growing states, and little work.
const OFTEN: usize = 64;

/// Relative perturbation of a state: a few units in the last place, so that sums of terms round differently.
pub(super) const PERTURBATION: f64 = 16.0 * f64::EPSILON;

impl Weights {
    /// Returns the weights at the start; `declared` gives the scale of a state, if the plant declares it.
    pub(super) fn new<S: Scalar>(
        declared: impl Fn(usize) -> Option<f64>,
        x: &[S],
        span: f64,
        tolerance: &Tolerance,
    ) -> Self {
        let n = x.len();
        let scales = (0..n).map(|i| declared(i).unwrap_or(0.0)).collect();
        let mut weights = Self {
            relative: tolerance.relative,
            floor: tolerance
                .absolute
                .map_or([f64::MIN_POSITIVE, SHARE * tolerance.relative], |a| [a.max(f64::MIN_POSITIVE), 0.0]),
            span,
            scales,
            floors: vec![0.0; n],
            roughness: vec![0.0; n],
            smooth: f64::INFINITY,
            attempts: 0,
        };
        weights.follow(x);
        weights
    }

    /// Updates the scales with an accepted state.
    #[inline]
    pub(super) fn follow<S: Scalar>(&mut self, x: &[S]) {
        by_size!(x.len(), S, N => self.follow_of::<S, N>(x));
    }

    #[inline(always)]
    fn follow_of<S: Scalar, const N: usize>(&mut self, x: &[S]) {
        let n = if N == 0 { x.len() } else { N };
        let (scales, floors, x) = (&mut self.scales[..n], &mut self.floors[..n], &x[..n]);
        for j in 0..n {
            scales[j] = larger(scales[j], x[j].value().abs());
            floors[j] = self.floor[0] + self.floor[1] * scales[j];
        }
    }

    /// Measures the roughness of the rates that `rates_at` gives, after every [`OFTEN`] attempts and after the third
    /// rejection of a step. The rates are compared with those of a [`perturbed`] state. After the third rejection, the
    /// state after a step of length `h` along the rates counts as well: states that are 0 before the step have no
    /// rounding errors yet. Returns the number of evaluations of the rates.
    pub(super) fn feel<S: Scalar>(
        &mut self,
        rates_at: impl Fn(f64, &[S], &mut [S]),
        (t, h, x): (f64, f64, &[S]),
        rejected: usize,
    ) -> usize {
        self.attempts += 1;
        if self.attempts < OFTEN && rejected != 3 {
            return 0;
        }
        self.attempts = 0;
        self.roughness.fill(0.0);
        let mut rates = x.to_vec();
        self.compare(&rates_at, (t, x), &mut rates);
        if rejected == 3 {
            let ahead: Vec<S> = x.iter().zip(&rates).map(|(&x, &rate)| x + rate * h).collect();
            self.compare(&rates_at, (t + h, &ahead), &mut rates);
        }
        // Floors do not decrease.
        let limits = self.floors.iter().zip(&self.roughness);
        self.smooth = limits.fold(f64::INFINITY, |least, (floor, roughness)| least.min(floor / roughness));
        if rejected == 3 { 4 } else { 2 }
    }

    /// Raises the roughness to the difference of the rates at a state and at the perturbed state. `here` becomes the
    /// rates.
    fn compare<S: Scalar>(&mut self, rates_at: &impl Fn(f64, &[S], &mut [S]), (t, x): (f64, &[S]), here: &mut [S]) {
        let mut there = x.to_vec();
        rates_at(t, x, here);
        rates_at(t, &perturbed(x), &mut there);
        let differences = here.iter().zip(&there).map(|(a, b)| (a.value() - b.value()).abs());
        for (roughness, difference) in self.roughness.iter_mut().zip(differences) {
            if difference.is_finite() {
                *roughness = roughness.max(difference);
            }
        }
    }

    /// Returns the norm of the errors of `n` states in a step of length `h`, before any error is added.
    #[inline(always)]
    pub(super) fn norm(&self, h: f64, n: usize) -> Norm<'_> {
        let (floors, roughness) = (&self.floors[..n], &self.roughness[..n]);
        Norm { floors, roughness, relative: self.relative, brief: BRIEF * self.span, h, sum: 0.0 }
    }

    /// Returns the largest absolute value of a state so far, or its declared scale.
    #[inline(always)]
    pub(super) fn scale(&self, state: usize) -> f64 {
        self.scales[state]
    }

    /// Returns the change of a rate that rounding of the states causes, per s.
    #[inline(always)]
    pub(super) fn roughness(&self, state: usize) -> f64 {
        self.roughness[state]
    }

    /// Returns the relative tolerance.
    pub(super) fn relative(&self) -> f64 {
        self.relative
    }

    /// Returns the size above which the error of a state counts relative to the state.
    pub(super) fn small(&self, state: usize) -> f64 {
        self.floors[state] / self.relative
    }

    /// Returns true if in a step of length `h` rounding contributes more to the error of a state than its tolerance.
    pub(super) fn is_rough<S: Scalar>(&self, h: f64, x: &[S]) -> bool {
        let limits = self.floors.iter().zip(&self.roughness);
        h > self.smooth
            && x.iter()
                .zip(limits)
                .any(|(x, (floor, roughness))| h * roughness > floor + self.relative * x.value().abs())
    }
}

/// Root mean square of the weighted errors, as a running sum.
pub(super) struct Norm<'a> {
    floors: &'a [f64],
    roughness: &'a [f64],
    relative: f64,
    brief: f64,
    h: f64,
    sum: f64,
}

impl Norm<'_> {
    /// Adds the error of a state, with its values at both ends of the step and its rate at the end.
    #[inline(always)] // With a known number of states, the divisions are vectorised in pairs.
    pub(super) fn add(&mut self, state: usize, error: f64, [before, after, rate]: [f64; 3]) {
        let size = larger(larger(before.abs(), after.abs()), self.brief * rate.abs());
        let ratio = error / (self.floors[state] + self.relative * size + self.h * self.roughness[state]);
        self.sum += ratio * ratio;
    }

    /// Returns the root mean square of the errors that were added.
    #[inline(always)]
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn of_errors(self) -> f64 {
        (self.sum / self.floors.len().max(1) as f64).sqrt()
    }
}

/// Returns a state whose components differ by a few units in the last place, each by a different amount.
pub(super) fn perturbed<S: Scalar>(x: &[S]) -> Vec<S> {
    // Multiples of the golden ratio: no two states change alike, so that their differences change too.
    #[allow(clippy::cast_precision_loss)]
    let share = |i: usize| 2.0 * (i as f64 * 0.618_033_988_749_894_9).fract() - 1.0;
    x.iter().enumerate().map(|(i, &x)| x * (1.0 + share(i) * PERTURBATION)).collect()
}

/// Returns the larger of two numbers by a single processor instruction. `f64::max` also checks for NaN, which appears
/// in the errors anyway.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
