//! Alignment: recorded inputs that act earlier than their time stamps, or that are interpolated otherwise between their
//! samples.
//!
//! An input that acts later is a delay, which is an effect.

use std::sync::OnceLock;

use mops_core::{Input, case::Hold};
use mops_outcome::diagnosis::Alignment;
use rayon::prelude::*;

use super::fitted_set::{FittedSet, Key, Start};
use super::forecast::{Forecast, error_of, kinds as forecast_kinds};
use super::refit::{Refit, Rough, price};
use super::sets::{FittedSets, kinds, likelier_output};
use crate::records::Subject;

impl Subject {
    /// Returns the subject with inputs that act at other times.
    fn aligned(&self, inputs: &[Alignment]) -> Self {
        let mut aligned = Self { pace: OnceLock::new(), ..self.clone() };
        for (name, input) in aligned.measurements.iter_mut().flat_map(|m| &mut m.case.inputs) {
            let Some(own) = inputs.iter().find(|own| own.input == *name) else { continue };
            if let Input::Sampled { times, hold, .. } = input {
                times.iter_mut().for_each(|t| *t += own.shift);
                *hold = own.hold;
            }
        }
        aligned
    }
}

/// Returns the subject with the alignment of its inputs that describes the calibration records better than the declared
/// one does with any single effect, and that forecasts better than the declared one; `None` if there is none. The
/// effects have been added to the declared model one by one.
pub fn align(sets: &FittedSets<'_, '_>) -> Option<(Subject, Vec<Alignment>)> {
    let is_open = |declared: &&FittedSet<'_>| !sets.is_explained_by_ranges() && sets.lacks_something(declared);
    let declared = sets.get(&Key::new()).filter(is_open)?;
    let likelier = likelier_output(declared)?;
    let starts = [&likelier.point, &declared.least_squares.point].map(|point| declared.start_at(point));
    let Refit { subject, candidates, nominal, simulations, .. } = sets.refit;
    let alternatives = alternatives(subject);
    let nominal = || nominal.clone();
    let trial = |index: usize| {
        let subject = subject.aligned(&alternatives[index]);
        let refit = Refit { subject: &subject, candidates: Vec::new(), nominal: nominal(), widened: None, simulations };
        let Rough { start, log_evidence, .. } =
            refit.roughly(&starts[..1], &likelier.errors, likelier.log_likelihood)?;
        Some((log_evidence, index, start))
    };
    let tried: Vec<(f64, usize, Start)> = (0..alternatives.len()).into_par_iter().filter_map(trial).collect();
    let (_, best, start) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let inputs = &alternatives[best];
    let aligned = subject.aligned(inputs);
    let is_better = {
        let refit = Refit { subject: &aligned, candidates: Vec::new(), nominal: nominal(), widened: None, simulations };
        let mut set = refit.least_squares(&Key::new(), &[start, starts[1].clone()])?;
        let price = price(kinds(candidates) + alternatives.len());
        let singles = sets.sets.iter().filter(|other| other.key.len() < 2);
        let rival = singles.map(|single| sets.log_posterior(single)).fold(f64::NEG_INFINITY, f64::max);
        refit.under_error_models(&mut set, &[declared], rival + price);
        let forecasts_better = |kind: &Forecast| {
            let errors = error_of(&set, *kind).zip(error_of(declared, *kind));
            errors.is_some_and(|(own, theirs)| own < theirs)
        };
        set.log_evidence() - price > rival && forecast_kinds(subject).iter().all(forecasts_better)
    };
    is_better.then(|| (aligned, inputs.clone()))
}

/// Returns the alignments that are tried: of each recorded input, and of all together, with the same time between
/// samples in mind.
fn alternatives(subject: &Subject) -> Vec<Vec<Alignment>> {
    let mut inputs: Vec<(&String, Hold, f64)> = Vec::new();
    for (name, input) in subject.measurements.iter().flat_map(|m| &m.case.inputs) {
        let Input::Sampled { times, hold, .. } = input else { continue };
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let Some(&step) = steps.get(steps.len() / 2) else { continue };
        if inputs.iter().all(|(known, ..)| *known != name) {
            inputs.push((name, *hold, step));
        }
    }
    let each = inputs.iter().map(|input| vec![*input]);
    let all = (inputs.len() > 1).then(|| inputs.clone());
    let groups: Vec<Vec<(&String, Hold, f64)>> = each.chain(all).collect();
    let mut alternatives: Vec<Vec<Alignment>> = Vec::new();
    for group in &groups {
        for hold in [Hold::Zero, Hold::First] {
            for samples in 0..=subject.settings.earlier {
                let of = |(name, declared, step): &(&String, Hold, f64)| {
                    let hold = if *declared == Hold::BandLimited { *declared } else { hold };
                    Alignment { input: (*name).clone(), hold, shift: -f64::from(samples) * step }
                };
                let aligned: Vec<Alignment> = group.iter().map(of).collect();
                let is_declared =
                    samples == 0 && group.iter().zip(&aligned).all(|(declared, own)| declared.1 == own.hold);
                if !is_declared && !alternatives.contains(&aligned) {
                    alternatives.push(aligned);
                }
            }
        }
    }
    alternatives
}
