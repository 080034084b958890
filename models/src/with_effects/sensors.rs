//! Sensor effects with hysteresis or delay: applied after the simulation, as no other quantity depends on them.

use mops_core::{Opening, PortState, Trace};

use super::Site;
use super::dynamics::Driven;
use crate::kernel::Recording;

impl<S: Opening> Driven<'_, S> {
    /// Applies sensor effects with a delay or a hysteresis state to the recording.
    pub(super) fn remembered(&mut self, mut recording: Recording, signals: &[(usize, String)]) -> Recording {
        for actor in &mut self.actors {
            let Site::Sensor { signal } = actor.place.site else { continue };
            let Some(index) = signals.iter().position(|(s, _)| *s == signal) else { continue };
            if let Some(delay) = actor.acting.delay() {
                let time = delay.value();
                let value = &mut recording.response.traces[index].1;
                *value = value.delayed(time);
                let rate = value.derivative();
                for (tangent, &late) in recording.tangents.iter_mut().zip(delay.tangents()) {
                    let trace = &mut tangent.traces[index].1;
                    *trace = trace.delayed(time).moved(&rate, -late);
                }
            }
            if !actor.memory.is_empty() {
                let knots = recording.response.traces[index].1.knots().to_vec();
                let before: Vec<Trace> = std::iter::once(&recording.response)
                    .chain(&recording.tangents)
                    .map(|response| response.traces[index].1.clone())
                    .collect();
                let mut after = vec![Trace::starting_at(knots[0], knots.len()); before.len()];
                for ends in knots.windows(2) {
                    let mut nodes = vec![[0.0; 5]; before.len()];
                    for (node, s) in Trace::NODES.into_iter().enumerate() {
                        // Just inside the segment, because the trace may jump at its ends.
                        let t = ends[0] + (ends[1] - ends[0]) * s.clamp(1e-9, 1.0 - 1e-9);
                        let mut value = S::from(before[0].at(t));
                        (0..S::DIRECTIONS).for_each(|d| value.set_tangent(d, before[1 + d].at(t)));
                        let zero = S::from(0.0);
                        let at = PortState {
                            t,
                            value,
                            q: value,
                            v: zero,
                            a: zero,
                            mobility: zero,
                            other: zero,
                            other_speed: zero,
                            u: &[],
                            closed: None,
                        };
                        let measured = actor.follow(&at);
                        nodes[0][node] = measured.value();
                        (0..S::DIRECTIONS).for_each(|d| nodes[1 + d][node] = measured.tangents()[d]);
                    }
                    after.iter_mut().zip(nodes).for_each(|(trace, nodes)| trace.push(ends[1], nodes));
                }
                let responses = std::iter::once(&mut recording.response).chain(&mut recording.tangents);
                responses.zip(after).for_each(|(response, trace)| response.traces[index].1 = trace);
            }
        }
        recording
    }
}
