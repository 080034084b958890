//! Sensor effects with a delay: applied after the simulation, as no other quantity depends on them.

use mops_core::{plant::PlantScalar, trace::Earlier};

use super::place::Site;
use super::plant::Affected;
use crate::kernel::Recording;

impl<S: PlantScalar> Affected<'_, S> {
    /// Applies sensor effects with a delay to the recording.
    pub(super) fn delayed_sensors(
        &self,
        mut recording: Recording,
        signals: &[(usize, String)],
        earlier: Earlier,
    ) -> Recording {
        for effect in &self.effects {
            let Site::Sensor { signal } = effect.place.site else { continue };
            let Some(index) = signals.iter().position(|(s, _)| *s == signal) else { continue };
            if let Some(delay) = effect.effect.delay() {
                let time = delay.value();
                let value = &mut recording.response.traces[index].1;
                for (tangent, &late) in recording.tangents.iter_mut().zip(delay.tangents()) {
                    let trace = &mut tangent.traces[index].1;
                    *trace = value.delayed_along(trace, (time, late), earlier);
                }
                *value = value.delayed(time, earlier);
            }
        }
        recording
    }
}
