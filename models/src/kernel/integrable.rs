//! Loops over the equations of a plant, compiled together with them.

use mops_core::Plant;
use mops_language::Scalar;

use super::attempt::Attempt;
use super::by_size::by_size;
use super::dormand_prince::DormandPrince;
use super::inputs::Inputs;
use super::with_inputs::WithInputs;

/// Plant that can be integrated: every plant. The loop over steps is compiled once for all plants; what it does many
/// times in a step is compiled with the equations of each. As calls, the stages take 6 % of the instructions of
/// `pid-design`.
pub trait Integrable<S: Scalar>: Plant<S> {
    /// Attempts a step of the explicit method: writes the state after the step to `next` and returns its weighted error
    /// norm.
    #[doc(hidden)]
    fn attempt(&self, inputs: &Inputs<'_, S>, method: &mut DormandPrince<S>, at: Attempt<'_, S>, next: &mut [S])
    -> f64;

    /// Returns the values of a signal at several instants.
    #[doc(hidden)]
    fn signals(&self, inputs: &Inputs<'_, S>, signal: usize, times: &[f64; 5], states: &[Vec<S>; 5]) -> [S; 5];

    /// Returns the value of a guard.
    #[doc(hidden)]
    fn guard(&self, inputs: &Inputs<'_, S>, index: usize, t: f64, x: &[S]) -> S;

    /// Returns the values of a guard at several instants.
    #[doc(hidden)]
    fn guards(&self, inputs: &Inputs<'_, S>, index: usize, times: &[f64; 3], states: &[Vec<S>; 3]) -> [S; 3];
}

impl<S: Scalar, P: Plant<S>> Integrable<S> for P {
    fn attempt(
        &self,
        inputs: &Inputs<'_, S>,
        method: &mut DormandPrince<S>,
        at: Attempt<'_, S>,
        next: &mut [S],
    ) -> f64 {
        let f = WithInputs { plant: self, inputs };
        by_size!(at.x.len(), S, N => method.attempt_of::<P, N>(&f, at, next))
    }

    fn signals(&self, inputs: &Inputs<'_, S>, signal: usize, times: &[f64; 5], states: &[Vec<S>; 5]) -> [S; 5] {
        let mut values = [S::from(0.0); 5];
        for ((value, &t), x) in values.iter_mut().zip(times).zip(states) {
            *value = inputs.look(t, x, |at| self.signal(signal, at));
        }
        values
    }

    fn guard(&self, inputs: &Inputs<'_, S>, index: usize, t: f64, x: &[S]) -> S {
        let Some(events) = self.events() else { return S::from(1.0) };
        inputs.with_rates(t, |du| inputs.look(t, x, |at| events.guard(index, at, du)))
    }

    fn guards(&self, inputs: &Inputs<'_, S>, index: usize, times: &[f64; 3], states: &[Vec<S>; 3]) -> [S; 3] {
        let mut values = [S::from(0.0); 3];
        for ((value, &t), x) in values.iter_mut().zip(times).zip(states) {
            *value = Integrable::guard(self, inputs, index, t, x);
        }
        values
    }
}
