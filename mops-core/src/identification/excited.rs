//! How rich the inputs of a study are, in numbers and sentences.

use super::excitation;
use super::local::start_parameters;
use super::report::ExcitationReport;
use super::words::{counted, percent};
use crate::case::Case;
use crate::experiment::Input;
use crate::study::{ExcitationQuestion, Study};
use crate::tuner::Tuner;

/// How rich the inputs of every case are.
pub fn excitations(study: &Study, question: &ExcitationQuestion) -> Vec<ExcitationReport> {
    let mut reports = Vec::new();
    for (index, case) in study.cases.iter().enumerate() {
        let horizon = case.horizon.or_else(|| study.models.iter().find_map(|(_, m)| m.interface().horizon));
        for (name, input) in &case.inputs {
            if question.inputs.as_ref().is_some_and(|wanted| !wanted.contains(name)) {
                continue;
            }
            let Some((values, sample_time)) = samples(case, input, question.sample_time, horizon) else { continue };
            let noise = question.noise.iter().find(|(of, _)| of == name).map(|(_, noise)| *noise);
            let variables = study.models.iter().flat_map(|(_, m)| &m.interface().inputs);
            let unit = variables.into_iter().find(|v| v.name == *name).map(|v| v.unit.to_string()).unwrap_or_default();
            let parameters = question.parameters.unwrap_or_else(|| tuners_in(study, index));
            let names = [case.name.as_str(), name, &unit];
            reports.push(excitation_report(&values, noise, names, sample_time, Some(parameters)));
        }
    }
    reports
}

/// The report on one signal: names of its case or file, its own and that of its unit; the time between samples, s; and the
/// number of parameters that are to be estimated, where there are some.
pub fn excitation_report(
    values: &[f64],
    noise: Option<f64>,
    [case, input, unit]: [&str; 3],
    sample_time: f64,
    parameters: Option<usize>,
) -> ExcitationReport {
    let found = excitation(values, noise);
    let suffices = found.suffices(parameters.unwrap_or(0));
    let order = if found.is_at_least() { format!("at least {}", found.order) } else { found.order.to_string() };
    let mut words = format!("`{input}` in `{case}` is persistently exciting of order {order}");
    match found.next {
        None => words += &format!(" (smallest eigenvalue {} of its power)", percent(found.eigenvalue)),
        Some(next) if found.order > 0 => {
            words += &format!(
                ": its weakest direction carries {} of its power, the next order {}",
                percent(found.eigenvalue),
                if next <= 1e-3 * found.zero { "none".to_owned() } else { percent(next) }
            );
        }
        Some(_) => words += ": it stays excited in no direction",
    }
    words += ". ";
    let linear =
        |n: usize| format!("a linear model (impulse response, transfer function) with {}", counted(n, "parameter"));
    words += &match (parameters, suffices) {
        (None, _) => format!("In the long run that suffices for {}.", linear(found.order)),
        (Some(0), _) => "No tuner depends on it.".to_owned(),
        (Some(n), true) => format!(
            "In the long run that suffices for {}, as many as tuners act here; what it tells of these, the sensitivities say.",
            linear(n)
        ),
        (Some(n), false) if found.is_at_least() => {
            format!("Whether it suffices for {} cannot be told from {} samples.", linear(n), values.len())
        }
        (Some(n), false) => {
            let once = match found.transient {
                Some(share) if share > found.zero => " What happens only once (an edge) excites more.",
                _ => "",
            };
            format!(
                "In the long run that does not suffice for {}, as many as tuners act here.{once} A model that is nonlinear, or \
                 whose parameters are tied by physics, may need less: what the data tell of the tuners, the sensitivities say.",
                linear(n)
            )
        }
    };
    ExcitationReport {
        words,
        case: case.to_owned(),
        input: input.to_owned(),
        unit: unit.to_owned(),
        samples: found.samples,
        sample_time,
        order: found.order,
        at_least: found.is_at_least(),
        power: found.power,
        eigenvalue: found.eigenvalue,
        next_eigenvalue: found.next,
        transient: found.transient,
        zero: found.zero,
        parameters,
        suffices,
        spectrum: found.spectrum,
    }
}

/// Active tuners that act in a case; start values are not excited by inputs and do not count.
fn tuners_in(study: &Study, case: usize) -> usize {
    let starts = start_parameters(study);
    let acts = |t: &&Tuner| t.active && t.case.is_none_or(|c| c == case) && !starts.contains(&t.parameter.as_str());
    study.tuners.iter().filter(acts).count()
}

/// Equally spaced samples of an input and the time between them, s; `None` where nothing says how long it lasts.
fn samples(case: &Case, input: &Input, wanted: Option<f64>, horizon: Option<f64>) -> Option<(Vec<f64>, f64)> {
    let recorded = match input {
        Input::Sampled { times, .. } => Some(times.as_slice()),
        _ => case.experiment.as_ref().and_then(|e| e.channels.first()).map(|c| c.times.as_slice()),
    };
    if let (None, Input::Sampled { times, values, .. }) = (wanted, input)
        && let Some(step) = spacing(times)
    {
        return Some((values.clone(), step));
    }
    let first = if let Input::Sampled { times, .. } = input { times[0] } else { 0.0 };
    let end = recorded.and_then(|times| times.last().copied()).or(horizon)?;
    let step = wanted.or_else(|| recorded.map(median_step)).unwrap_or(end / 1000.0);
    if !(step > 0.0 && end > first) {
        return None;
    }
    // No record is so long that this many samples would not tell its order.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let count = (((end - first) / step + 1e-6).floor() as usize + 1).min(1_000_000);
    #[allow(clippy::cast_precision_loss)]
    let values = (0..count).map(|i| input.at(first + i as f64 * step)).collect();
    Some((values, step))
}

/// The time between samples that are equally spaced, to a thousandth of it.
pub fn spacing(times: &[f64]) -> Option<f64> {
    let step = median_step(times);
    let even = |pair: &[f64]| (pair[1] - pair[0] - step).abs() <= 1e-3 * step;
    (step > 0.0 && times.windows(2).all(even)).then_some(step)
}

fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}
