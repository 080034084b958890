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
pub(super) struct Weights {
    relative: f64,
    absolute: Option<f64>,
    /// Simulated time, s.
    span: f64,
    /// Largest absolute value so far, or what is declared.
    scales: Vec<f64>,
    /// The floors but for rounding.
    floors: Vec<f64>,
    /// How far rounding of the states moves each rate, per s.
    roughness: Vec<f64>,
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
    pub(super) fn new<S: Scalar, D: Dynamics<S>>(f: &D, x: &D::State, span: f64, tolerance: &Tolerance) -> Self {
        let n = x.as_ref().len();
        let scales = (0..n).map(|i| f.scale(i).unwrap_or(0.0)).collect();
        let mut weights = Self {
            relative: tolerance.relative,
            absolute: tolerance.absolute,
            span,
            scales,
            floors: vec![0.0; n],
            roughness: vec![0.0; n],
            attempts: 0,
        };
        weights.follow(x.as_ref());
        weights
    }

    /// Takes the sizes of an accepted state into account.
    #[inline]
    pub(super) fn follow<S: Scalar>(&mut self, x: &[S]) {
        for ((scale, floor), x) in self.scales.iter_mut().zip(&mut self.floors).zip(x) {
            *scale = scale.max(x.value().abs());
            *floor = self.absolute.unwrap_or(SHARE * self.relative * *scale).max(f64::MIN_POSITIVE);
        }
    }

    /// Finds out how rough the rates are, every so many attempts and where steps are rejected again and again: the rates are
    /// compared with those of a state whose components differ by a few units in the last place, each by another share.
    pub(super) fn feel<S: Scalar, D: Dynamics<S>>(&mut self, f: &D, (t, x): (f64, &D::State), rejected: usize) -> bool {
        self.attempts += 1;
        if self.attempts < OFTEN && rejected != 3 {
            return false;
        }
        self.attempts = 0;
        let (mut moved, mut here, mut there) = (x.clone(), x.clone(), x.clone());
        for (i, x) in moved.as_mut().iter_mut().enumerate() {
            // Shares of the golden ratio: no two states move alike, so that their differences move too.
            #[allow(clippy::cast_precision_loss)]
            let share = 2.0 * (i as f64 * 0.618_033_988_749_894_9).fract() - 1.0;
            *x = *x * (1.0 + share * PERTURBATION);
        }
        f.derivative(t, x, &mut here);
        f.derivative(t, &moved, &mut there);
        let differences = here.as_ref().iter().zip(there.as_ref()).map(|(a, b)| (a.value() - b.value()).abs());
        for (roughness, difference) in self.roughness.iter_mut().zip(differences) {
            *roughness = if difference.is_finite() { difference } else { 0.0 };
        }
        true
    }

    /// Root mean square of errors over their weights in a step of length `h`; each comes with the size of its state and with the
    /// size of its rate at the end of the step.
    #[inline]
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn norm(&self, h: f64, errors: impl ExactSizeIterator<Item = (f64, [f64; 2])>) -> f64 {
        let n = errors.len().max(1) as f64;
        let limits = self.floors.iter().zip(&self.roughness);
        let brief = BRIEF * self.span;
        let sum = errors.zip(limits).fold(0.0, |sum, ((error, [size, rate]), (floor, roughness))| {
            let size = size.max(brief * rate);
            let ratio = error / (floor + self.relative * size + h * roughness);
            sum + ratio * ratio
        });
        (sum / n).sqrt()
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
        x.iter().zip(limits).any(|(x, (floor, roughness))| h * roughness > floor + self.relative * x.value().abs())
    }
}
