//! Cases, inputs and experiments.

use mops_language::{Quantity, Unit, suggestion};

use super::models::Models;
use super::values::{check_horizon, converted, in_range, signal_names};
use crate::cancellation::Cancellation;
use crate::case::{Case, Channel, Experiment, Input, ResponseData};
use crate::error::StudyError;
use crate::model::{AnalysisKind, Parameter, Variable};
use crate::study::draft::{CaseBuilder, ChannelBuilder, Measured};

pub(super) fn build_case(draft: &CaseBuilder, models: &Models, warnings: &mut Vec<String>) -> Result<Case, StudyError> {
    warnings.extend(draft.warnings.iter().cloned());
    let mut parameters = Vec::new();
    for (name, quantity) in &draft.parameters {
        // In a file, the parameters of an experiment are in a table of their own.
        let within =
            |mistake: StudyError| if draft.measured.is_some() { mistake.within("parameters") } else { mistake };
        let known: Vec<&Parameter> = models.iter().flat_map(|(_, m)| &m.interface().parameters).collect();
        let parameter = known.iter().find(|p| p.variable.name == *name).ok_or_else(|| {
            within(StudyError::new(name, format!("no model has a parameter `{name}`"))).with_help(similar(
                name,
                "parameters",
                known.iter().map(|p| p.variable.name.as_str()),
            ))
        })?;
        parameters.push((name.clone(), in_range(quantity, parameter).map_err(|m| within(m.within(name)))?));
    }
    let inputs = draft.inputs.iter().map(|input| build_input(input, models)).collect::<Result<_, _>>()?;
    let experiment = match &draft.measured {
        Some(measured) => Some(build_experiment(&draft.name, measured, models, warnings)?),
        None => None,
    };
    // Frequency responses have no end time.
    let end = experiment.as_ref().map(Experiment::end).filter(|&end| end > 0.0);
    let horizon = draft.horizon.or(end);
    check_horizon(draft.horizon)?;
    Ok(Case {
        name: draft.name.clone(),
        parameters,
        inputs,
        disturbances: Vec::new(),
        experiment,
        horizon,
        begins: 0.0,
        cancellation: Cancellation::default(),
    })
}

/// Returns the way out of an unknown name: a similar one, or to remove it if the models have none of the kind.
fn similar<'a>(name: &str, what: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match known.clone().next() {
        Some(_) => suggestion(name, known),
        None => format!("the models of the study have no {what}: remove `{name}`"),
    }
}

fn build_input(
    (name, input, unit): &(String, Input, Option<Unit>),
    models: &Models,
) -> Result<(String, Input), StudyError> {
    let known: Vec<&Variable> = models.iter().flat_map(|(_, m)| &m.interface().inputs).collect();
    let variable = known.iter().find(|v| v.name == *name).ok_or_else(|| {
        StudyError::new(name, format!("no model has an input `{name}`"))
            .with_help(similar(name, "inputs", known.iter().map(|v| v.name.as_str())))
            .within("inputs")
    })?;
    same_unit(name, &variable.unit, &known).map_err(|m| m.within("inputs"))?;
    let mut input = input.clone();
    if let Some(unit) = unit {
        let difference = unit.factor_to(&variable.unit).ok_or_else(|| {
            StudyError::new(
                name,
                format!("the input `{name}` is in `{unit}`, but the model expects `{}`", variable.unit),
            )
            .with_help("choose another column, or correct the unit in the file header or in `unit`")
            .within("inputs")
        })?;
        let convert = |value: f64| unit.convert(value, &variable.unit).expect("the units are compatible");
        input = input.mapped(&convert, difference);
    }
    if let Some(at) = input.uneven() {
        return Err(StudyError::new(name, format!("the input `{name}` is not evenly sampled at {at} s"))
            .with_help("hold = \"band-limited\" needs even sampling: cut the record with `from` and `to`, or use hold = \"first\"")
            .within("inputs"));
    }
    Ok((name.clone(), input))
}

/// Checks that a signal or input recorded once for all models has one unit in all of them.
fn same_unit(name: &str, unit: &Unit, known: &[&Variable]) -> Result<(), StudyError> {
    match known.iter().find(|variable| variable.name == name && variable.unit != *unit) {
        Some(other) => {
            let fact = format!("`{name}` is in {unit} in one model and in {} in another", other.unit);
            Err(StudyError::new(name, fact).with_help("declare it in one unit in all models"))
        }
        None => Ok(()),
    }
}

/// Returns notes on recordings without a unit for quantities with one: each signal or input with its experiments.
pub(super) fn assumed_units(drafts: &[CaseBuilder], models: &Models) -> Vec<String> {
    let interfaces = || models.iter().map(|(_, model)| model.interface());
    let signals: Vec<&Variable> = interfaces().flat_map(|interface| &interface.signals).collect();
    let inputs: Vec<&Variable> = interfaces().flat_map(|interface| &interface.inputs).collect();
    let unit = |name: &str, known: &[&Variable]| {
        known.iter().find(|v| v.name == name).map(|v| v.unit.to_string()).filter(|unit| unit != "1")
    };
    let mut assumed: Vec<(&str, String, Vec<String>)> = Vec::new();
    for draft in drafts {
        let channels = draft.measured.iter().flat_map(|m| &m.channels).filter(|channel| channel.unit.is_none());
        let channels = channels.map(|channel| (channel.signal.as_str(), &signals));
        let sampled = |input: &Input| matches!(input, Input::Sampled { .. });
        let recorded =
            draft.inputs.iter().filter(|(_, input, unit)| draft.measured.is_some() && unit.is_none() && sampled(input));
        for (name, known) in channels.chain(recorded.map(|(name, ..)| (name.as_str(), &inputs))) {
            let Some(unit) = unit(name, known) else { continue };
            let own = format!("`{}`", draft.name);
            match assumed.iter_mut().find(|(other, ..)| *other == name) {
                Some((.., experiments)) => experiments.push(own),
                None => assumed.push((name, unit, vec![own])),
            }
        }
    }
    let note = |(name, unit, experiments): (&str, String, Vec<String>)| {
        format!("`{name}` has no unit in the file of {}: assumed {unit}", experiments.join(", "))
    };
    assumed.into_iter().map(note).collect()
}

fn build_experiment(
    name: &str,
    draft: &Measured,
    models: &Models,
    warnings: &mut Vec<String>,
) -> Result<Experiment, StudyError> {
    let known: Vec<&Variable> = models.iter().flat_map(|(_, m)| &m.interface().signals).collect();
    let mut channels = Vec::new();
    for channel in &draft.channels {
        let variable = known.iter().find(|v| v.name == channel.signal).ok_or_else(|| {
            StudyError::new(&channel.signal, format!("no model has a signal `{}`", channel.signal))
                .with_help(similar(&channel.signal, "signals", known.iter().map(|v| v.name.as_str())))
                .within("channels")
        })?;
        same_unit(&channel.signal, &variable.unit, &known).map_err(|m| m.within("channels"))?;
        let built = build_channel(channel, &variable.unit).map_err(|m| m.within(&channel.signal).within("channels"))?;
        warnings.extend(suspicious_start(name, &built));
        if channel.unwrap == Some(true) {
            warnings.extend(gap_of(&built).map(|t| {
                format!(
                    "`{}` in `{name}` has a gap at {t} s: turns within it are not counted by `unwrap`, so that the angle after it may \
                     be off by whole turns; give each part an experiment with `from` and `to`",
                    built.signal
                )
            }));
        }
        warnings.extend(channel.unwrap.is_none().then(|| wrapped(name, &built, &variable.unit)).flatten());
        channels.push(built);
    }
    warnings.extend(gaps(name, &channels));
    for response in &draft.responses {
        let known: Vec<&str> = models
            .iter()
            .filter(|(_, m)| m.interface().analysis == AnalysisKind::Linear)
            .flat_map(|(_, m)| signal_names(&m.interface().signals))
            .collect();
        if !known.contains(&response.signal.as_str()) {
            let fact = format!("no linear model has an output `{}`", response.signal);
            let help = suggestion(&response.signal, known.iter().copied());
            return Err(StudyError::new(&response.signal, fact).with_help(help).within("responses"));
        }
    }
    let responses = draft.responses.iter().map(|response| build_response(response, models));
    let responses = responses.collect::<Result<_, _>>()?;
    if channels.is_empty() && draft.responses.is_empty() {
        return Err(StudyError::new("channels", "the experiment has no channels and no responses")
            .with_help("add at least one channel"));
    }
    Ok(Experiment { channels, responses, role: draft.role })
}

/// Returns a measured frequency response, converted to the units of the model that it fits.
fn build_response(draft: &ResponseData, models: &Models) -> Result<ResponseData, StudyError> {
    let Some(unit) = &draft.unit else { return Ok(draft.clone()) };
    let linear = models.iter().map(|(_, model)| model.interface()).filter(|i| i.analysis == AnalysisKind::Linear);
    let ratios = linear.flat_map(|interface| {
        let outputs = interface.signals.iter().filter(|v| v.name == draft.signal);
        outputs.flat_map(|output| {
            interface.inputs.iter().map(|input| Unit::product(&[(&output.unit, 1), (&input.unit, -1)]))
        })
    });
    let ratios: Vec<Unit> = ratios.collect();
    let factor = ratios.iter().find_map(|ratio| unit.factor_to(ratio)).ok_or_else(|| {
        let wanted = ratios.first().map_or_else(String::new, ToString::to_string);
        let fact = format!("expected a response in `{wanted}`, found `{unit}`");
        StudyError::new(&draft.signal, fact)
            .with_help("choose other columns, or correct the unit in the header of the file")
            .within("responses")
    })?;
    let values = draft.values.iter().map(|value| value.map(|part| part * factor)).collect();
    Ok(ResponseData { values, unit: None, ..draft.clone() })
}

/// Gives the noise of its sensor to each channel without one.
pub(super) fn with_sensors(
    mut drafts: Vec<CaseBuilder>,
    sensors: &[(String, Quantity)],
    models: &Models,
) -> Result<Vec<CaseBuilder>, StudyError> {
    let mut channels: Vec<&mut ChannelBuilder> =
        drafts.iter_mut().filter_map(|case| case.measured.as_mut()).flat_map(|m| &mut m.channels).collect();
    for (signal, noise) in sensors {
        let mut own = channels.iter_mut().filter(|channel| channel.signal == *signal).peekable();
        if own.peek().is_none() {
            let fact = format!("no experiment has a channel `{signal}`");
            let measured = channels.iter().map(|channel| channel.signal.as_str());
            return Err(StudyError::new(signal, fact).with_help(suggestion(signal, measured)));
        }
        own.filter(|channel| channel.noise.is_none()).for_each(|channel| channel.noise = Some(noise.clone()));
        let known = models.iter().flat_map(|(_, model)| &model.interface().signals);
        if let Some(variable) = known.into_iter().find(|variable| variable.name == *signal) {
            standard_deviation(noise, &variable.unit).map_err(|m| m.within(signal))?;
        }
    }
    Ok(drafts)
}

/// Returns the standard deviation of a noise in the unit of its signal.
fn standard_deviation(noise: &Quantity, unit: &Unit) -> Result<f64, StudyError> {
    let value = converted(noise, &unit.difference()).map_err(|m| m.within("noise"))?;
    if !(value.is_finite() && value > 0.0) {
        return Err(StudyError::new("noise", format!("a standard deviation must be positive, not {value}"))
            .with_help("omit `noise` if it is unknown; `mops data` estimates it"));
    }
    Ok(value)
}

fn build_channel(draft: &ChannelBuilder, to: &Unit) -> Result<Channel, StudyError> {
    let unit = draft.unit.as_ref().unwrap_or(to);
    if !unit.is_compatible(to) {
        let fact = format!("the column is in `{unit}`, but the signal `{}` is in `{to}`", draft.signal);
        return Err(StudyError::new("column", fact)
            .with_help("choose another column, or correct the unit in the file header or in `unit`"));
    }
    let noise = draft.noise.as_ref().map(|noise| standard_deviation(noise, to)).transpose()?;
    let samples = draft.times.iter().zip(&draft.values).filter(|(_, value)| value.is_finite());
    let in_model = |value: f64| unit.convert(value, to).expect("the units are compatible");
    let (times, mut values): (Vec<f64>, Vec<f64>) = samples.map(|(&t, &value)| (t, in_model(value))).unzip();
    if draft.unwrap == Some(true) {
        let turn = turn(to).ok_or_else(|| {
            let fact = format!("the signal `{}` in `{to}` is not an angle", draft.signal);
            StudyError::new("unwrap", fact).with_help("remove `unwrap`")
        })?;
        unwrap(&mut values, turn);
    }
    if let Some(early) = times.first().filter(|&&t| t < 0.0) {
        return Err(StudyError::new(
            "column",
            format!("the first sample is at {early} s, before the start of the simulation at 0 s"),
        )
        .with_help("omit `reset-time`, or cut the record with `from`"));
    }
    if times.len() < 2 {
        let count = if times.is_empty() { "none" } else { "one" };
        return Err(StudyError::new("column", format!("expected at least two samples of the column, found {count}"))
            .with_help("missing samples and samples cut off by `from`, `to` and `skip` do not count"));
    }
    Ok(Channel { signal: draft.signal.clone(), times, values, noise })
}

/// Smallest deviation of a sample from the mean of its neighbours that makes it an outlier, in robust standard
/// deviations of such deviations.
const OUTLYING: f64 = 12.0;

/// Returns a warning about outliers: far from both neighbours, which agree with theirs, and from the lines through the
/// neighbours on either side. A corner lies on one of these lines.
pub(super) fn outliers(experiment: &str, channel: &Channel) -> Option<String> {
    let v = &channel.values;
    let off = |k: usize| (v[k] - 0.5 * (v[k - 1] + v[k + 1])).abs();
    let mut sorted: Vec<f64> = (1..v.len().saturating_sub(1)).map(off).collect();
    if sorted.len() < 20 {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    // Factor: P. Rousseeuw, A. Leroy, Robust Regression and Outlier Detection (1987), section 4.4.
    let spread = 1.4826 * sorted[sorted.len() / 2];
    // The neighbours of such a sample are off by half as much, because of it; those of a jump or a fast motion by as
    // much.
    let is_outlier = |&k: &usize| {
        let around = [k - 1, k + 1].into_iter().filter(|&n| n > 0 && n + 1 < v.len()).map(off).fold(0.0, f64::max);
        let continues = |a: Option<usize>, b: Option<usize>| match (a.and_then(|k| v.get(k)), b.and_then(|k| v.get(k)))
        {
            (Some(near), Some(far)) => (v[k] - (2.0 * near - far)).abs() < 0.6 * off(k),
            _ => false,
        };
        let is_corner = continues(Some(k - 1), k.checked_sub(2)) || continues(Some(k + 1), Some(k + 2));
        spread > 0.0 && off(k) > OUTLYING * spread && around < 0.6 * off(k) && !is_corner
    };
    let alone: Vec<usize> = (1..v.len() - 1).filter(is_outlier).collect();
    // Times are sums of rounded numbers; a nanosecond is below the spacing of any samples.
    let at = (1e9 * channel.times[*alone.first()?]).round() / 1e9;
    let count = match alone.len() {
        1 => {
            format!("the sample at {at} s of `{}` in `{experiment}` is an outlier", channel.signal)
        }
        n => {
            format!("{n} samples of `{}` in `{experiment}` (the first at {at} s) are outliers", channel.signal)
        }
    };
    Some(format!("{count}: loss = \"huber\" or \"student\" of `normalised-error` limits the influence of outliers"))
}

/// Returns a whole turn in a unit; `None` for units other than of an angle.
fn turn(unit: &Unit) -> Option<f64> {
    let radian = Unit::known("rad");
    let is_angle = unit.to_string() != "1" && unit.is_compatible(&radian);
    is_angle.then(|| radian.factor_to(unit)).flatten().map(|factor| std::f64::consts::TAU * factor)
}

/// Adds whole turns so that no step exceeds half a turn.
fn unwrap(values: &mut [f64], turn: f64) {
    let mut added = 0.0;
    for k in 1..values.len() {
        let step = values[k] + added - values[k - 1];
        added -= turn * (step / turn).round();
        values[k] += added;
    }
}

/// Returns the time before the first step that is more than three times as long as the median one, s.
fn gap_of(channel: &Channel) -> Option<f64> {
    let mut steps: Vec<f64> = channel.times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let longest = 3.0 * steps.get(steps.len() / 2)?;
    channel.times.windows(2).find(|pair| pair[1] - pair[0] > longest).map(|pair| pair[0])
}

/// Smallest distance of two samples that is a gap, in typical distances.
const GAP: f64 = 3.0;

/// Share of the distances between samples that are at most the typical one: loggers are seldom exactly periodic.
const TYPICAL: f64 = 0.95;

/// Smallest number of samples of a record with a typical distance.
const FEW: usize = 10;

/// Returns warnings on gaps in the records of an experiment: each with the signals that have it.
fn gaps(experiment: &str, channels: &[Channel]) -> Vec<String> {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for channel in channels.iter().filter(|channel| channel.times.len() >= FEW) {
        let steps: Vec<f64> = channel.times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, clippy::cast_sign_loss)]
        let typical = sorted[(TYPICAL * (sorted.len() - 1) as f64) as usize];
        let is_gap = |step: &f64| *step > GAP * typical;
        let count = steps.iter().filter(|step| is_gap(step)).count();
        let Some(longest) =
            (0..steps.len()).filter(|&k| is_gap(&steps[k])).max_by(|&a, &b| steps[a].total_cmp(&steps[b]))
        else {
            continue;
        };
        let rounded = |time: f64| (time * 1e6).round() / 1e6;
        let others = match count - 1 {
            0 => String::new(),
            1 => ", the longer of 2".to_owned(),
            _ => format!(", the longest of {count}"),
        };
        let fact = format!("a gap of {} s at {} s{others}", rounded(steps[longest]), rounded(channel.times[longest]));
        match found.iter_mut().find(|(known, _)| *known == fact) {
            Some((_, signals)) => signals.push(format!("`{}`", channel.signal)),
            None => found.push((fact, vec![format!("`{}`", channel.signal)])),
        }
    }
    let warning = |(fact, signals): (String, Vec<String>)| {
        let (signals, have) = (signals.join(", "), if signals.len() == 1 { "has" } else { "have" });
        format!(
            "{signals} in `{experiment}` {have} {fact}: inputs are continued across it; give each part an experiment with `from` and \
             `to` if they changed meanwhile"
        )
    };
    found.into_iter().map(warning).collect()
}

/// Steps that look like a sensor that starts a new turn, in turns, if the median step is at most [`SLOW`].
const WRAPS: std::ops::Range<f64> = 0.75..1.25;

/// Largest median step of an angle that is sampled fast enough to distinguish a new turn from a motion, in turns.
const SLOW: f64 = 0.1;

/// Returns a warning if an angle steps by a whole turn.
fn wrapped(experiment: &str, channel: &Channel, unit: &Unit) -> Option<String> {
    let turn = turn(unit)?;
    let steps: Vec<f64> = channel.values.windows(2).map(|pair| (pair[1] - pair[0]).abs() / turn).collect();
    let first = steps.iter().position(|step| WRAPS.contains(step))?;
    let mut sorted = steps;
    sorted.sort_by(f64::total_cmp);
    (sorted[sorted.len() / 2] <= SLOW).then(|| {
        format!(
            "`{}` in `{experiment}` steps by about a turn at {} s: use unwrap = true for an angle that is counted within one turn, \
             or unwrap = false to confirm the step and suppress this warning",
            channel.signal,
            channel.times[first + 1]
        )
    })
}

/// Returns a warning if the first sample lies far from the extrapolation of the next ones. The thesis (4.2.3) found the
/// very first sample wrong.
fn suspicious_start(experiment: &str, channel: &Channel) -> Option<String> {
    let v = &channel.values;
    if v.len() < 8 {
        return None;
    }
    let expected = 2.0 * v[1] - v[2];
    let typical = (2..7).map(|i| (v[i + 1] - 2.0 * v[i] + v[i - 1]).abs()).fold(0.0, f64::max);
    ((v[0] - expected).abs() > 10.0 * typical && typical > 0.0).then(|| {
        format!(
            "the first sample of `{}` in `{experiment}` ({}) lies far from the next ones ({}, {}); drop it with `skip = 1`",
            channel.signal, v[0], v[1], v[2]
        )
    })
}
