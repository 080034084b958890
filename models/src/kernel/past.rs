//! Past of a plant, along the steps.

use mops_core::{Instant, Plant, Trace, plant::Past};
use mops_language::Scalar;

use super::weights::perturbed;
use super::{Driven, Step};

/// Limit on the number of halvings of a step for the past of a delay, whose size has no limit of its own.
const HALVINGS: u32 = 12;

impl<S: Scalar, P: Plant<S> + ?Sized> Driven<'_, S, P> {
    /// Stores the past of the plant over a step, halved until one quartic per part suffices.
    pub(super) fn remember(&mut self, step: &Step<S>) {
        self.remember_part(step, [0.0, 1.0], HALVINGS);
    }

    fn past(&self, t: f64, x: &[S]) -> Vec<S> {
        let past = |at: &Instant<'_, S>| self.plant.memory().map_or_else(Vec::new, |memory| memory.past(at));
        self.inputs().look(t, x, past)
    }

    fn store(&mut self, over: &Past<'_, S>) -> bool {
        self.plant.memory_mut().is_none_or(|memory| memory.remember(over))
    }

    fn remember_part(&mut self, step: &Step<S>, [from, to]: [f64; 2], halvings: u32) {
        let time = |s: f64| step.start + s * step.taken;
        let at = |s: f64| {
            let s = from + s * (to - from);
            self.past(time(s), &step.state_at(s))
        };
        let (values, checks) = (Trace::NODES.map(at), Trace::CHECKS.map(at));
        let over = Past {
            time: [from, to].map(|s| self.inputs().time(time(s))),
            values: &values,
            checks: &checks,
            roughness: &[],
            is_last: halvings == 0,
            restarts: step.restarts && from == 0.0,
        };
        if self.store(&over) {
            return;
        }
        // A difference of large terms is as rough as these are rounded; shorter parts do not help.
        let (middle, state) = (time(0.5 * (from + to)), step.state_at(0.5 * (from + to)));
        let (here, there) = (self.past(middle, &state), self.past(middle, &perturbed(&state)));
        let roughness: Vec<f64> = here.iter().zip(&there).map(|(a, b)| (a.value() - b.value()).abs()).collect();
        if !self.store(&Past { roughness: &roughness, ..over }) {
            let middle = 0.5 * (from + to);
            self.remember_part(step, [from, middle], halvings - 1);
            self.remember_part(step, [middle, to], halvings - 1);
        }
    }
}
