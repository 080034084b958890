//! Noise of sensors: one level for each, estimated for all experiments that give none.

use std::collections::BTreeMap;

use mops_core::{Case, Interface, Role, Study, case::Channel};

use super::hygiene::noise_of;

/// Estimated noise of every measured signal.
#[derive(Debug, Clone, Default)]
pub struct SensorNoise(BTreeMap<String, Estimate>);

/// Estimated noise of a signal.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    /// Standard deviation; `None` if the samples are too few, or never change.
    noise: Option<f64>,
    /// True if the motion of the declared model was taken out of the samples first.
    is_beside_model: bool,
}

/// Returns the channels of experiments, each with its case.
fn channels<'s>(study: &'s Study, jobs: &'s [usize]) -> impl Iterator<Item = (&'s Case, &'s Channel)> {
    let cases = jobs.iter().map(|&job| &study.cases()[study.jobs()[job].case]);
    cases.flat_map(|case| case.experiment.iter().flat_map(|e| &e.channels).map(move |channel| (case, channel)))
}

impl SensorNoise {
    /// Estimates the noise of every signal that the jobs measure. Validation decides nothing, unless there is nothing
    /// else.
    pub fn of(study: &Study, jobs: &[usize]) -> Self {
        let of_roles = |signal: &str, only_validation: bool| {
            let is_of =
                |case: &Case| case.experiment.as_ref().is_some_and(|e| (e.role == Role::Validation) == only_validation);
            let of = channels(study, jobs).filter(|(case, channel)| channel.signal == signal && is_of(case));
            let records: Vec<(&[f64], &[f64])> = of.map(|(_, c)| (&c.times[..], &c.values[..])).collect();
            noise_of(&records)
        };
        let mut estimates = BTreeMap::new();
        for (_, Channel { signal, .. }) in channels(study, jobs) {
            let estimate = || Estimate {
                noise: of_roles(signal, false).or_else(|| of_roles(signal, true)),
                is_beside_model: false,
            };
            estimates.entry(signal.clone()).or_insert_with(estimate);
        }
        Self(estimates)
    }

    /// Returns the estimate for a signal; `None` if its samples are too few, or never change.
    pub fn estimate(&self, signal: &str) -> Option<f64> {
        self.0.get(signal)?.noise
    }

    /// Takes the estimate for a signal from samples without the motion of the declared model, if it is smaller: what
    /// the model lacks moves, too.
    pub fn improve(&mut self, signal: &str, beside_model: Option<f64>) {
        let Some(estimate) = self.0.get_mut(signal) else { return };
        if let Some(smaller) = beside_model.filter(|own| estimate.noise.is_some_and(|noise| *own < noise)) {
            *estimate = Estimate { noise: Some(smaller), is_beside_model: true };
        }
    }

    /// Returns the estimates that are used, a sentence each.
    pub fn notes(&self, study: &Study, jobs: &[usize], model: &Interface) -> Vec<String> {
        let note = |(signal, estimate): (&String, &Estimate)| {
            let noise = estimate.noise?;
            let of = if estimate.is_beside_model { "residuals of the declared model" } else { "samples" };
            let without: Vec<&str> = channels(study, jobs)
                .filter(|(_, channel)| channel.signal == *signal && channel.noise.is_none())
                .map(|(case, _)| case.name.as_str())
                .collect();
            let unit = &model.signals.iter().find(|s| s.name == *signal)?.unit;
            let experiments = match (without.len(), jobs.len()) {
                (0, _) => return None,
                (1, 1) => String::new(),
                (count, all) if count == all => format!(" of {count} experiments"),
                _ => format!(" of {}", without.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")),
            };
            Some(format!(
                "the noise of `{signal}` was estimated from neighbouring {of}{experiments}: {noise:.3e} {unit}"
            ))
        };
        self.0.iter().filter_map(note).collect()
    }
}
