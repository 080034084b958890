//! Plant with its inputs, as the explicit method evaluates it.

use mops_core::Plant;
use mops_language::Scalar;

use super::inputs::Inputs;

/// Plant with its inputs.
pub(super) struct WithInputs<'p, 'a, S, P> {
    pub(super) plant: &'p P,
    pub(super) inputs: &'p Inputs<'a, S>,
}

impl<S: Scalar, P: Plant<S>> WithInputs<'_, '_, S, P> {
    // Not a closure: those are not inlined into the stages.
    #[inline(always)]
    pub(super) fn derivative(&self, t: f64, x: &[S], dx: &mut [S]) {
        let varying;
        let at = match self.inputs.constant_at(t, x) {
            Some(at) => at,
            None => {
                varying = self.inputs.varying_at(t);
                varying.at(x)
            }
        };
        self.plant.rates(&at, dx);
    }
}
