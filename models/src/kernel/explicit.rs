//! Explicit method: the stages of [`DormandPrince`] in the loop over steps.

use mops_core::model::Work;
use mops_language::Scalar;

use super::attempt::Attempt;
use super::by_size::by_size;
use super::dormand_prince::{DormandPrince, dense_output};
use super::driven::Driven;
use super::integrable::Integrable;
use super::method::Method;
use super::weights::Weights;

/// Longest stable step times the size of a decaying eigenvalue. The method is stable up to 3.3 along the real axis; at
/// 2.5 it multiplies a mode by 0.24.
const STABLE: f64 = 2.5;

/// Difference of the last two stages, relative to the states, from which it shows an eigenvalue: rounding is far
/// smaller.
const SEEN: f64 = 1e-9;

/// Multiple of the measured effect of rounding on a rate up to which a difference of rates is rounding.
const ROUNDED: f64 = 4.0;

impl<S: Scalar> Method<S> for DormandPrince<S> {
    const ERROR_ORDER: f64 = 5.0;
    const IS_EXPLICIT: bool = true;

    fn new<P: Integrable<S> + ?Sized>(_: &Driven<'_, S, P>, x: &[S]) -> Self {
        Self { k: std::array::from_fn(|_| x.to_vec()), stage: x.to_vec() }
    }

    fn restart<P: Integrable<S> + ?Sized>(&mut self, f: &Driven<'_, S, P>, t: f64, x: &[S], work: &mut Work) {
        f.derivative(t, x, &mut self.k[0]);
        work.derivatives += 1;
    }

    fn slope(&self) -> &[S] {
        &self.k[0]
    }

    fn attempt<P: Integrable<S> + ?Sized>(
        &mut self,
        f: &Driven<'_, S, P>,
        at: Attempt<'_, S>,
        next: &mut [S],
        work: &mut Work,
    ) -> f64 {
        work.derivatives += 6;
        f.attempt(self, at, next)
    }

    #[inline]
    fn stable_step(&self, next: &[S], weights: &Weights) -> Option<f64> {
        let (mut slopes, mut states) = (0.0, 0.0);
        for (j, next) in next.iter().enumerate() {
            // In fixed units, so that a state near 0 does not make slopes steep.
            let size = weights.scale(j).max(f64::MIN_POSITIVE);
            let difference = (self.k[6][j].value() - self.k[5][j].value()).abs();
            let slope = (difference - ROUNDED * weights.roughness(j)).max(0.0) / size;
            let state = (next.value() - self.stage[j].value()) / size;
            slopes += slope * slope;
            states += state * state;
        }
        (states > SEEN * SEEN).then(|| STABLE * (states / slopes).sqrt())
    }

    #[inline]
    fn advance(&mut self) {
        self.k.swap(0, 6); // First same as last.
    }

    #[inline]
    fn dense(&self, h: f64, x: &[S], next: &[S], dense: &mut [Vec<S>; 5]) {
        by_size!(x.len(), S, N => dense_output::<S, N>(h, x, next, &self.k, dense));
    }
}
