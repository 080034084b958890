//! Excitation reports on the inputs of a study.

use mops_core::{
    case::{Case, Input},
    study::{Study, Tuner},
    task::ExcitationTask,
};
use mops_identification::{excitation, start_parameters};

use super::report::ExcitationReport;
use super::words::{MANY, counted, distinct, percent};

/// Returns the excitation reports on the inputs of every case.
pub fn excitations(study: &Study) -> Vec<ExcitationReport> {
    let question =
        study.options::<ExcitationTask>().map(|task| task.question(study).expect("checked when the study was built"));
    let question = &question.unwrap_or_default();
    let mut reports = Vec::new();
    for (index, case) in study.cases().iter().enumerate() {
        let horizon = case.horizon.or_else(|| study.models().iter().find_map(|(_, m)| m.interface().horizon));
        for (name, input) in &case.inputs {
            if question.inputs.as_ref().is_some_and(|wanted| !wanted.contains(name)) {
                continue;
            }
            let Some((values, sample_time)) = samples(case, input, question.sample_time, horizon) else { continue };
            let noise = question.noise.iter().find(|(of, _)| of == name).map(|(_, noise)| *noise);
            let variables = study.models().iter().flat_map(|(_, m)| &m.interface().inputs);
            let unit = variables.into_iter().find(|v| v.name == *name).map(|v| v.unit.to_string()).unwrap_or_default();
            let parameters = question.parameters.unwrap_or_else(|| tuners_in(study, index));
            let names = [case.name.as_str(), name, &unit];
            reports.push(excitation_report(&values, noise, names, sample_time, Some(parameters)));
        }
    }
    reports
}

/// Returns the findings on inputs as sentences: one for each case, or for an input of many cases, that of the least
/// excited case and the orders of the others.
pub fn excitation_words(reports: &[ExcitationReport]) -> Vec<String> {
    let mut sentences = Vec::new();
    for input in distinct(reports.iter().map(|report| report.input.as_str())) {
        let own: Vec<&ExcitationReport> = reports.iter().filter(|report| report.input == input).collect();
        let worst = (0..own.len()).min_by_key(|&i| own[i].order).unwrap_or(0);
        if own.len() <= MANY {
            sentences.extend(own.iter().map(|report| report.words.clone()));
            continue;
        }
        sentences.push(own[worst].words.clone());
        let orders = || own.iter().enumerate().filter(|(i, _)| *i != worst).map(|(_, report)| report.order);
        let (low, high) = (orders().min().unwrap_or(0), orders().max().unwrap_or(0));
        let least = if own.iter().any(|report| report.at_least) { "at least " } else { "" };
        let orders = match low == high {
            true => format!("order {least}{low}"),
            false => format!("orders from {least}{low} to {least}{high}"),
        };
        sentences.push(format!("`{input}` in the other {} cases is persistently exciting of {orders}.", own.len() - 1));
    }
    sentences
}

/// Returns the report on one signal.
///
/// The names are those of the case or file, the signal and its unit; `sample_time` is in s. `parameters` is the number
/// of parameters to be estimated, if any.
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
        None => words += &format!(" (smallest eigenvalue: {} of the signal power)", percent(found.eigenvalue)),
        Some(next) if found.order > 0 => {
            words += &format!(
                ": the weakest direction has {} of the signal power, the next order {}",
                percent(found.eigenvalue),
                if next <= 1e-3 * found.zero { "none".to_owned() } else { percent(next) }
            );
        }
        Some(_) => words += ": no direction is excited persistently",
    }
    words += ". ";
    let linear =
        |n: usize| format!("a linear model (impulse response, transfer function) with {}", counted(n, "parameter"));
    words += &match (parameters, suffices) {
        (None, _) => format!("Asymptotically this suffices for {}.", linear(found.order)),
        (Some(0), _) => "No tuner acts in this case.".to_owned(),
        (Some(n), true) => format!(
            "Asymptotically this suffices for {}, as many as tuners act here; for their accuracy see the sensitivities.",
            linear(n)
        ),
        (Some(n), false) if found.is_at_least() => {
            format!(
                "For {} the result is undecided: the order is known only up to a third of {} samples, at most 200.",
                linear(n),
                values.len()
            )
        }
        (Some(n), false) => {
            let once = match found.transient {
                Some(share) if share > found.zero => " Transients such as an edge excite more.",
                _ => "",
            };
            format!(
                "Asymptotically this does not suffice for {}, as many as tuners act here.{once} A nonlinear model, or one whose \
                 parameters are related by physics, may need less: see the sensitivities.",
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

/// Returns the number of active tuners that act in a case. Initial states do not count, as inputs do not excite them.
fn tuners_in(study: &Study, case: usize) -> usize {
    let starts = start_parameters(study);
    let acts = |t: &&Tuner| t.active && t.case.is_none_or(|c| c == case) && !starts.contains(&t.parameter.as_str());
    study.tuners().iter().filter(acts).count()
}

/// Returns equally spaced samples of an input and their sample time, s; `None` if its duration is unknown.
fn samples(case: &Case, input: &Input, wanted: Option<f64>, horizon: Option<f64>) -> Option<(Vec<f64>, f64)> {
    let channels = case.experiment.iter().flat_map(|experiment| &experiment.channels);
    let end = channels.filter_map(|channel| channel.times.last()).copied().reduce(f64::max);
    // Samples of an input before and after the measurements, which a file may have, excite nothing that is measured.
    let during = |times: &[f64]| {
        let first = times.partition_point(|time| *time < 0.0);
        first..times.partition_point(|time| end.is_none_or(|end| *time <= end)).max(first)
    };
    let recorded = match input {
        Input::Sampled { times, .. } if case.experiment.is_some() => Some(&times[during(times)]),
        _ => case.experiment.as_ref().and_then(|e| e.channels.first()).map(|c| c.times.as_slice()),
    };
    if let (None, Input::Sampled { times, values, .. }) = (wanted, input)
        && let Some(step) = spacing(&times[during(times)])
    {
        return Some((values[during(times)].to_vec(), step));
    }
    let first = match (recorded, input) {
        (Some(times), Input::Sampled { .. }) => *times.first()?,
        _ => 0.0,
    };
    let end = recorded.and_then(|times| times.last().copied()).or(horizon)?;
    let step = wanted.or_else(|| recorded.map(median_step)).unwrap_or(end / 1000.0);
    if !(step > 0.0 && end > first) {
        return None;
    }
    // This number of samples suffices for the order of any record.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let count = (((end - first) / step + 1e-6).floor() as usize + 1).min(1_000_000);
    #[allow(clippy::cast_precision_loss)]
    let values = (0..count).map(|i| input.at(first + i as f64 * step)).collect();
    Some((values, step))
}

/// Returns the sample time of equally spaced samples, with a tolerance of 0.1 % of it; `None` otherwise.
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
