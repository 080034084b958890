//! What an error of a step is measured against: the size of each state, on a scale of its own.

use mops_core::{Scalar, Tolerance};

use super::Dynamics;

/// Weights of the errors of all states: `relative |x_i| + floor_i`.
///
/// The size `|x_i|` is that of the state at both ends of the step, and at least what the state becomes at its rate in [`BRIEF`]
/// of the simulated time: a state that leaves 0 at a kink that no guard tells of would otherwise need infinitely short steps.
///
/// The floor is the tolerance where a state is small beside what it is elsewhere: `absolute` if the user gives it, else
/// `SHARE relative s_i`. The scale `s_i` is the one that is declared for the state, or the largest `|x_j|` that state has
/// had so far; a state that rests at 0 from the start has none, and its error counts against what it becomes in the step.
///
/// No error is asked for that rounding hides: the rates of states that are differences of large numbers are rough, and a step
/// of length `h` leaves `h` times that roughness whatever its length (see [`Weights::feel`]).
#[derive(Debug, Clone)]
pub struct Weights {
    relative: f64,
    /// A floor is the first number, plus the second times the scale of its state.
    floor: [f64; 2],
    /// Simulated time, s.
    span: f64,
    /// Largest absolute value so far, or what is declared.
    scales: Vec<f64>,
    /// The floors but for rounding.
    floors: Vec<f64>,
    /// How far rounding of the states moves each rate, per s.
    roughness: Vec<f64>,
    /// No rate is rough in shorter steps than this, s.
    smooth: f64,
    /// Attempts since the roughness was felt.
    attempts: usize,
}

/// Share of the relative tolerance that holds of a state's own scale where the state passes through 0: a hundredth, as the
/// absolute tolerance of 1e-10 is beside the relative one of 1e-8.
pub(super) const SHARE: f64 = 0.01;

/// Share of the simulated time in which a state that moves is no smaller than its rate makes it: far shorter than the motions
/// of a model that an explicit method can follow, far longer than the resolution of the clock.
const BRIEF: f64 = 1e-6;

/// Attempted steps after which the roughness is felt anew: often enough for states that grow, and a small part of the work.
const OFTEN: usize = 64;

/// Perturbation of a state, relative: a few units in the last place, so that sums of terms round differently.
const PERTURBATION: f64 = 16.0 * f64::EPSILON;

impl Weights {
    pub(super) fn new<S: Scalar, D: Dynamics<S> + ?Sized>(f: &D, x: &[S], span: f64, tolerance: &Tolerance) -> Self {
        let n = x.len();
        let scales = (0..n).map(|i| f.scale(i).unwrap_or(0.0)).collect();
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

    /// Takes the sizes of an accepted state into account.
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

    /// Finds out how rough the rates are, every so many attempts and where steps are rejected again and again: the rates are
    /// compared with those of a state whose components differ by a few units in the last place, each by another share.
    pub(super) fn feel<S: Scalar, D: Dynamics<S> + ?Sized>(
        &mut self,
        f: &D,
        (t, x): (f64, &[S]),
        rejected: usize,
    ) -> bool {
        self.attempts += 1;
        if self.attempts < OFTEN && rejected != 3 {
            return false;
        }
        self.attempts = 0;
        let (mut moved, mut here, mut there) = (x.to_vec(), x.to_vec(), x.to_vec());
        for (i, x) in moved.iter_mut().enumerate() {
            // Shares of the golden ratio: no two states move alike, so that their differences move too.
            #[allow(clippy::cast_precision_loss)]
            let share = 2.0 * (i as f64 * 0.618_033_988_749_894_9).fract() - 1.0;
            *x = *x * (1.0 + share * PERTURBATION);
        }
        f.derivative(t, x, &mut here);
        f.derivative(t, &moved, &mut there);
        let differences = here.iter().zip(&there).map(|(a, b)| (a.value() - b.value()).abs());
        for (roughness, difference) in self.roughness.iter_mut().zip(differences) {
            *roughness = if difference.is_finite() { difference } else { 0.0 };
        }
        // Floors do not fall.
        let limits = self.floors.iter().zip(&self.roughness);
        self.smooth = limits.fold(f64::INFINITY, |least, (floor, roughness)| least.min(floor / roughness));
        true
    }

    /// The norm of the errors of `n` states in a step of length `h`, before any is added.
    #[inline(always)]
    pub(super) fn norm(&self, h: f64, n: usize) -> Norm<'_> {
        let (floors, roughness) = (&self.floors[..n], &self.roughness[..n]);
        Norm { floors, roughness, relative: self.relative, brief: BRIEF * self.span, h, sum: 0.0 }
    }

    /// The relative tolerance.
    pub(super) fn relative(&self) -> f64 {
        self.relative
    }

    /// The size at which the error of a state begins to count relative to it.
    pub(super) fn small(&self, state: usize) -> f64 {
        self.floors[state] / self.relative
    }

    /// Whether in a step of length `h` rounding decides over the error of a state of these sizes more than its tolerance.
    pub(super) fn is_rough<S: Scalar>(&self, h: f64, x: &[S]) -> bool {
        let limits = self.floors.iter().zip(&self.roughness);
        h > self.smooth
            && x.iter()
                .zip(limits)
                .any(|(x, (floor, roughness))| h * roughness > floor + self.relative * x.value().abs())
    }
}

/// The root mean square of errors over their weights, as it is summed up.
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
    #[inline(always)] // With the number of states known, the divisions go in pairs.
    pub(super) fn add(&mut self, state: usize, error: f64, [before, after, rate]: [f64; 3]) {
        let size = larger(larger(before.abs(), after.abs()), self.brief * rate.abs());
        let ratio = error / (self.floors[state] + self.relative * size + self.h * self.roughness[state]);
        self.sum += ratio * ratio;
    }

    /// The root mean square of the errors that were added.
    #[inline(always)]
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn of_errors(self) -> f64 {
        (self.sum / self.floors.len().max(1) as f64).sqrt()
    }
}

/// The larger of two numbers, one of the processor's instructions: `f64::max` looks for NaN besides, which is in the errors too.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
