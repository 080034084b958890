//! Checks a draft: every name, size, bound and unit, before anything runs.

use std::sync::Arc;

use super::draft::{CaseDraft, ChannelDraft, CriterionDraft, Draft, Free, Measured, Mistake, TunerDraft};
use super::{JobPlan, Objective, ParameterSource, Row, Study, Task, Tasks, tasks};
use crate::case::Case;
use crate::criterion::{Criterion, Demand, Usage};
use crate::diagnostic::suggestion;
use crate::experiment::{Channel, Experiment, Input};
use crate::expression::Expression;
use crate::model::{AnalysisKind, Interface, Model, Parameter, Variable};
use crate::tuner::{Grid, Scale, Tuner};
use crate::unit::{Quantity, Unit};

type Models = [(String, Arc<dyn Model>)];

pub(super) fn build(draft: Draft) -> Result<Study, Mistake> {
    if draft.models.is_empty() {
        return Err(Mistake::new("models", "the study has no model")
            .with_help("add a table such as [models.loop.pid-loop]; `mops list` names the kinds"));
    }
    let mut models: Vec<(String, Arc<dyn Model>)> = Vec::new();
    let mut fixed = Vec::new();
    for (name, draft) in draft.models {
        let Interface { parameters, horizon, .. } = draft.model.interface();
        let within = |mistake: Mistake| mistake.within(&name).within("models");
        check_horizon(*horizon).map_err(within)?;
        fixed.push(fixed_values(&draft.parameters, parameters).map_err(|m| within(m.within("parameters")))?);
        models.push((name, Arc::from(draft.model)));
    }
    let mut warnings = Vec::new();
    let drafts = if draft.cases.is_empty() {
        vec![CaseDraft { name: "nominal".into(), ..CaseDraft::default() }]
    } else {
        draft.cases
    };
    let cases: Vec<Case> = drafts
        .iter()
        .map(|case| build_case(case, &models, &mut warnings).map_err(|m| m.within(&case.name).within(section(case))))
        .collect::<Result<_, _>>()?;

    check_use(&draft.tuners, &models)?;
    let mut tuners = Vec::new();
    for (name, tuner) in &draft.tuners {
        build_tuner(name, tuner, &models, &cases, &mut tuners).map_err(|m| m.within(name).within("tuners"))?;
    }
    tie_tuners(&draft.tuners, &mut tuners)?;
    for (index, (case, case_draft)) in cases.iter().zip(&drafts).enumerate() {
        for free in case_draft.measured.iter().flat_map(|m| &m.free) {
            let tuner = free_start(free, index, case, &models)
                .map_err(|m| m.within("free").within(&case.name).within("experiments"))?;
            tuners.push(tuner);
        }
    }

    let objective =
        draft.objective.unwrap_or(match draft.task {
            Task::Design => Objective::Max,
            Task::Calibration => Objective::Sum,
            // As the study of which they tell would be solved.
            Task::Excitation | Task::Sensitivity | Task::Sweep => {
                if cases.iter().any(|case| case.experiment.is_some()) { Objective::Sum } else { Objective::Max }
            }
        });
    let mut study = Study {
        name: draft.name,
        task: draft.task,
        objective,
        seed: draft.seed,
        models,
        cases,
        tuners,
        rows: Vec::new(),
        jobs: Vec::new(),
        tasks: Tasks::default(),
        warnings,
    };
    // How rich an input is can be told without a criterion.
    if draft.criteria.is_empty() && study.task != Task::Excitation {
        return Err(Mistake::new("criteria", "the study has no criterion").with_help(
            "add one, such as [criteria] followed by overshoot = { overshoot = { signal = \"y\" }, demand = 0.1 }",
        ));
    }
    for (name, criterion) in draft.criteria {
        add_rows(&mut study, &name, criterion).map_err(|m| m.within(&name).within("criteria"))?;
    }
    for index in 0..study.jobs.len() {
        let JobPlan { model, case, .. } = study.jobs[index];
        complete(&mut study, index, &fixed[model])
            .map_err(|m| m.within(&drafts[case].name).within(section(&drafts[case])))?;
    }
    study.rows.sort_by_key(|row| study.jobs[row.job].case);
    study.tasks = tasks::build(draft.tasks, &study)?;
    Ok(study)
}

fn section(case: &CaseDraft) -> &'static str {
    if case.measured.is_some() { "experiments" } else { "cases" }
}

fn parameter<'a>(parameters: &'a [Parameter], name: &str) -> Option<&'a Parameter> {
    parameters.iter().find(|p| p.variable.name == name)
}

fn names(parameters: &[Parameter]) -> impl Iterator<Item = &str> + Clone {
    parameters.iter().map(|p| p.variable.name.as_str())
}

fn signal_names(signals: &[Variable]) -> impl Iterator<Item = &str> + Clone {
    signals.iter().map(|s| s.name.as_str())
}

fn check_horizon(end: Option<f64>) -> Result<(), Mistake> {
    match end {
        Some(end) if !(end.is_finite() && end > 0.0) => {
            Err(Mistake::new("horizon", format!("a simulation must end after its start, not at {end} s"))
                .with_help("it starts at 0 s; give the time of its end, such as \"60 s\""))
        }
        _ => Ok(()),
    }
}

/// Values of a model's parameters that the study fixes, in the parameters' units.
fn fixed_values(given: &[(String, Quantity)], known: &[Parameter]) -> Result<Vec<(String, f64)>, Mistake> {
    given
        .iter()
        .map(|(name, quantity)| {
            let parameter = parameter(known, name).ok_or_else(|| {
                Mistake::new(name, format!("the model has no parameter `{name}`"))
                    .with_help(suggestion(name, names(known)))
            })?;
            Ok((name.clone(), in_range(quantity, parameter).map_err(|m| m.within(name))?))
        })
        .collect()
}

/// The value of a parameter, in its unit.
fn in_range(quantity: &Quantity, parameter: &Parameter) -> Result<f64, Mistake> {
    let value = converted(quantity, &parameter.variable.unit)?;
    check_range(value, parameter)?;
    Ok(value)
}

fn check_range(value: f64, parameter: &Parameter) -> Result<(), Mistake> {
    let [low, high] = parameter.range;
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let Variable { name, unit, about } = &parameter.variable;
    let wanted = if high < f64::INFINITY {
        format!("lie between {low} and {}", unit.amount(high))
    } else if low == 0.0 {
        "not be negative".to_owned()
    } else if low == f64::MIN_POSITIVE {
        "be positive".to_owned()
    } else if low > f64::NEG_INFINITY {
        format!("be at least {}", unit.amount(low))
    } else {
        "be a number".to_owned()
    };
    Err(Mistake::here(format!("`{name}` must {wanted}, not {}", unit.amount(value)))
        .with_help(format!("`{name}` is: {about}")))
}

/// The number in `unit`.
fn converted(quantity: &Quantity, unit: &Unit) -> Result<f64, Mistake> {
    quantity.to(unit).map_err(|why| {
        let unit = unit.to_string();
        Mistake::here(why).with_help(match unit.as_str() {
            "1" => "write a pure number".to_owned(),
            _ => format!("a number without a unit counts in `{unit}`"),
        })
    })
}

fn build_case(draft: &CaseDraft, models: &Models, warnings: &mut Vec<String>) -> Result<Case, Mistake> {
    let mut parameters = Vec::new();
    for (name, quantity) in &draft.parameters {
        // In a file, an experiment has a table of them.
        let within = |mistake: Mistake| if draft.measured.is_some() { mistake.within("parameters") } else { mistake };
        let known: Vec<&Parameter> = models.iter().flat_map(|(_, m)| &m.interface().parameters).collect();
        let parameter = known.iter().find(|p| p.variable.name == *name).ok_or_else(|| {
            within(Mistake::new(name, format!("no model has a parameter `{name}`")))
                .with_help(suggestion(name, known.iter().map(|p| p.variable.name.as_str())))
        })?;
        parameters.push((name.clone(), in_range(quantity, parameter).map_err(|m| within(m.within(name)))?));
    }
    let inputs = draft.inputs.iter().map(|input| build_input(input, models)).collect::<Result<_, _>>()?;
    let experiment = match &draft.measured {
        Some(measured) => Some(build_experiment(&draft.name, measured, models, warnings)?),
        None => None,
    };
    // Frequency responses end at no time.
    let end = experiment.as_ref().map(Experiment::end).filter(|&end| end > 0.0);
    let horizon = draft.horizon.or(end);
    check_horizon(draft.horizon)?;
    Ok(Case { name: draft.name.clone(), parameters, inputs, experiment, horizon })
}

fn build_input(
    (name, input, unit): &(String, Input, Option<Unit>),
    models: &Models,
) -> Result<(String, Input), Mistake> {
    let known: Vec<&Variable> = models.iter().flat_map(|(_, m)| &m.interface().inputs).collect();
    let variable = known.iter().find(|v| v.name == *name).ok_or_else(|| {
        Mistake::new(name, format!("no model has an input `{name}`"))
            .with_help(suggestion(name, known.iter().map(|v| v.name.as_str())))
            .within("inputs")
    })?;
    let mut input = input.clone();
    if let Some(unit) = unit {
        let factor = unit.factor_to(&variable.unit).ok_or_else(|| {
            Mistake::new(name, format!("the input `{name}` is given in `{unit}`, the model takes `{}`", variable.unit))
                .with_help("take another column, or correct the unit: in the header of the file, or as `unit` here")
                .within("inputs")
        })?;
        match &mut input {
            Input::Constant(value) => *value *= factor,
            Input::Step { before, after, .. } => {
                *before *= factor;
                *after *= factor;
            }
            Input::Sine { amplitude, offset, .. } => {
                *amplitude *= factor;
                *offset *= factor;
            }
            Input::Sampled { values, .. } => values.iter_mut().for_each(|v| *v *= factor),
        }
    }
    Ok((name.clone(), input))
}

fn build_experiment(
    name: &str,
    draft: &Measured,
    models: &Models,
    warnings: &mut Vec<String>,
) -> Result<Experiment, Mistake> {
    let known: Vec<&Variable> = models.iter().flat_map(|(_, m)| &m.interface().signals).collect();
    let mut channels = Vec::new();
    for channel in &draft.channels {
        let variable = known.iter().find(|v| v.name == channel.signal).ok_or_else(|| {
            Mistake::new(&channel.signal, format!("no model has a signal `{}`", channel.signal))
                .with_help(suggestion(&channel.signal, known.iter().map(|v| v.name.as_str())))
                .within("channels")
        })?;
        let built = build_channel(channel, &variable.unit).map_err(|m| m.within(&channel.signal).within("channels"))?;
        warnings.extend(suspicious_start(name, &built));
        channels.push(built);
    }
    for response in &draft.responses {
        let known: Vec<&str> = models
            .iter()
            .filter(|(_, m)| m.interface().analysis == AnalysisKind::Linear)
            .flat_map(|(_, m)| signal_names(&m.interface().signals))
            .collect();
        if !known.contains(&response.signal.as_str()) {
            let fact = format!("no linear model has an output `{}`", response.signal);
            let help = suggestion(&response.signal, known.iter().copied());
            return Err(Mistake::new(&response.signal, fact).with_help(help).within("responses"));
        }
    }
    if channels.is_empty() && draft.responses.is_empty() {
        return Err(Mistake::new("channels", "the experiment measures nothing").with_help("name at least one channel"));
    }
    Ok(Experiment { channels, responses: draft.responses.clone(), role: draft.role })
}

fn build_channel(draft: &ChannelDraft, to: &Unit) -> Result<Channel, Mistake> {
    let factor = match &draft.unit {
        None => 1.0,
        Some(unit) => unit.factor_to(to).ok_or_else(|| {
            Mistake::new("column", format!("the column is in `{unit}`, the signal `{}` in `{to}`", draft.signal))
                .with_help("take another column, or correct the unit: in the header of the file, or as `unit` here")
        })?,
    };
    let noise = match &draft.noise {
        None => None,
        Some(noise) => {
            let value = converted(noise, to).map_err(|m| m.within("noise"))?;
            if !(value.is_finite() && value > 0.0) {
                return Err(Mistake::new("noise", format!("a standard deviation must be positive, not {value}"))
                    .with_help("leave `noise` out where it is not known; `mops data` estimates it"));
            }
            Some(value)
        }
    };
    let samples = draft.times.iter().zip(&draft.values).filter(|(_, value)| value.is_finite());
    let (times, values): (Vec<f64>, Vec<f64>) = samples.map(|(&t, &value)| (t, value * factor)).unzip();
    if let Some(early) = times.first().filter(|&&t| t < 0.0) {
        return Err(Mistake::new("column", format!("the first sample is at {early} s, before the simulation begins"))
            .with_help("a simulation begins at 0 s: leave `reset-time` away, or cut with `from`"));
    }
    if times.len() < 2 {
        let count = if times.is_empty() { "no sample" } else { "one sample" };
        return Err(Mistake::new("column", format!("{count} of the column is left, and two are needed"))
            .with_help("the others are gaps, or cut off by `from`, `to` and `skip`"));
    }
    Ok(Channel { signal: draft.signal.clone(), times, values, noise })
}

/// The thesis (4.2.3) found the very first sample wrong: say so where it lies far from what the next ones lead to.
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

/// Adds the tuner, or one for every case.
fn build_tuner(
    name: &str,
    draft: &TunerDraft,
    models: &Models,
    cases: &[Case],
    tuners: &mut Vec<Tuner>,
) -> Result<(), Mistake> {
    let known: Vec<&Parameter> = models.iter().flat_map(|(_, m)| &m.interface().parameters).collect();
    let parameter = known.iter().find(|p| p.variable.name == name);
    let unit = match (&draft.unit, parameter) {
        (Some(unit), Some(p)) if !unit.is_compatible(&p.variable.unit) => {
            return Err(Mistake::new(
                "unit",
                format!("`{name}` is in `{}` in the model, not in `{unit}`", p.variable.unit),
            )
            .with_help("give a unit that converts to it, or leave `unit` out"));
        }
        (Some(unit), _) => unit.clone(),
        (None, Some(p)) => p.variable.unit.clone(),
        (None, None) => Unit::one(),
    };
    let value = |key: &str, quantity: &Option<Quantity>| -> Result<Option<f64>, Mistake> {
        let Some(quantity) = quantity else { return Ok(None) };
        let value = converted(quantity, &unit).map_err(|m| m.within(key))?;
        if value.is_finite() {
            Ok(Some(value))
        } else {
            Err(Mistake::new(key, format!("`{key}` must be a finite number, not {value}"))
                .with_help("every tuner moves between two finite bounds"))
        }
    };
    let (start, mut min, mut max) =
        (value("start", &draft.start)?, value("min", &draft.min)?, value("max", &draft.max)?);
    let mut grid = if draft.integer { Grid::Integer } else { Grid::Continuous };
    if let Some(list) = &draft.values {
        let mut values: Vec<f64> = Vec::new();
        for quantity in list {
            values.push(converted(quantity, &unit).map_err(|m| m.within("values"))?);
        }
        values.sort_by(f64::total_cmp);
        values.dedup();
        if values.len() < 2 {
            return Err(Mistake::new("values", "a tuner needs at least two different values")
                .with_help("add values, or say `active = false` to keep the one"));
        }
        (min, max) = (values.first().copied(), values.last().copied());
        grid = Grid::List(values);
    }
    if let (Some(_), Some(key)) =
        (&draft.tie, [("start", start), ("min", min), ("max", max)].iter().find(|(_, v)| v.is_some()))
    {
        return Err(Mistake::new(key.0, format!("a tied tuner follows others and has no `{}` of its own", key.0))
            .with_help(format!("remove `{}`, or remove `tie`", key.0)));
    }
    let fixed = draft.inactive || draft.tie.is_some();
    let start = match (start, &draft.tie) {
        (Some(start), _) => start,
        (None, Some(_)) => f64::NAN,
        (None, None) => return Err(Mistake::here("the tuner has no start value").with_help("add `start = ...`")),
    };
    let bounds = match (min, max) {
        (Some(min), Some(max)) => [min, max],
        _ if fixed => [min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY)],
        (None, Some(_)) => return Err(Mistake::here("the tuner has no lower bound").with_help("add `min = ...`")),
        (Some(_), None) => return Err(Mistake::here("the tuner has no upper bound").with_help("add `max = ...`")),
        (None, None) => {
            return Err(Mistake::here("the tuner has no bounds").with_help("add `min = ...` and `max = ...`"));
        }
    };
    let [min, max] = bounds;
    if max <= min {
        return Err(Mistake::new("max", format!("the range is empty: min is {min}, max is {max}")).with_help(
            if max < min { "swap the bounds" } else { "widen the range, or say `active = false` to keep the value" },
        ));
    }
    if !fixed && !(min..=max).contains(&start) {
        let (start, max) = (unit.amount(start), unit.amount(max));
        return Err(Mistake::new("start", format!("the start value {start} is outside the bounds, {min} to {max}"))
            .with_help("correct it, or widen the bounds"));
    }
    let off_grid = match &grid {
        Grid::Continuous => None,
        Grid::Integer => {
            let is_fraction = |(_, value): &(&str, f64)| value.fract() != 0.0;
            let found = [("start", start), ("min", min), ("max", max)].into_iter().find(is_fraction);
            found.map(|(key, value)| {
                (key, value, "with `integer = true`, all of `start`, `min` and `max` are whole numbers")
            })
        }
        Grid::List(values) => (!values.contains(&start)).then_some(("start", start, "start at one of `values`")),
    };
    if let Some((key, value, way_out)) = off_grid.filter(|_| !fixed) {
        return Err(Mistake::new(key, format!("the tuner cannot be at {}", unit.amount(value))).with_help(way_out));
    }
    if draft.scale == Scale::Log && min <= 0.0 && max >= 0.0 {
        return Err(Mistake::new("scale", format!("a logarithmic range cannot reach zero, but `min` is {min}"))
            .with_help("raise `min`, or leave `scale` out"));
    }
    if let Some(parameter) = parameter {
        let factor = unit.factor_to(&parameter.variable.unit).expect("units are compatible");
        for (key, bound) in [("min", min), ("max", max)] {
            if bound.is_finite() {
                check_range(bound * factor, parameter).map_err(|m| m.within(key))?;
            }
        }
    }
    let tuner = Tuner {
        name: name.to_owned(),
        parameter: name.to_owned(),
        start,
        bounds,
        scale: draft.scale,
        grid,
        unit,
        case: None,
        active: !fixed,
        tie: None,
    };
    if draft.per_case {
        for (index, case) in cases.iter().enumerate() {
            tuners.push(Tuner { name: format!("{}/{name}", case.name), case: Some(index), ..tuner.clone() });
        }
    } else {
        tuners.push(tuner);
    }
    Ok(())
}

/// Every tuner must set a parameter, or be followed by one that does.
fn check_use(drafts: &[(String, TunerDraft)], models: &Models) -> Result<(), Mistake> {
    let known: Vec<&str> = models.iter().flat_map(|(_, m)| names(&m.interface().parameters)).collect();
    let ties: Vec<Expression> =
        drafts.iter().filter_map(|(_, draft)| Expression::parse(draft.tie.as_ref()?).ok()).collect();
    for (name, _) in drafts {
        let followed = ties.iter().any(|tie| tie.names().contains(name));
        if !followed && !known.contains(&name.as_str()) {
            return Err(Mistake::new(name, format!("no model has a parameter `{name}`"))
                .with_help(suggestion(name, known.iter().copied()))
                .within("tuners"));
        }
    }
    Ok(())
}

/// Binds the expressions of tied tuners, in an order in which each follows what it names.
fn tie_tuners(drafts: &[(String, TunerDraft)], tuners: &mut [Tuner]) -> Result<(), Mistake> {
    for (position, (name, draft)) in drafts.iter().enumerate() {
        let Some(text) = &draft.tie else { continue };
        let wrong =
            |message: String, help: &str| Mistake::new("tie", message).with_help(help).within(name).within("tuners");
        let expression = Expression::parse(text).map_err(|e| wrong(e.message, "as in tie = \"2*Ti + 0.1\""))?;
        let mut of = Vec::new();
        for used in expression.names() {
            let earlier: Vec<&str> = drafts[..position].iter().map(|(n, _)| n.as_str()).collect();
            if used == name {
                return Err(wrong("a tuner cannot follow itself".to_owned(), "name tuners that stand before it"));
            }
            if drafts[position..].iter().any(|(n, _)| n == used) {
                let fact = format!("`{used}` stands after this tuner");
                return Err(wrong(fact, &format!("a tie names tuners that stand before it: move `{used}` up")));
            }
            if !earlier.contains(&used.as_str()) {
                return Err(wrong(format!("there is no tuner `{used}`"), &suggestion(used, earlier.iter().copied())));
            }
            of.push(tuners.iter().position(|t| t.name == *used).ok_or_else(|| {
                wrong(format!("`{used}` has a value of its own in every case"), "tie to tuners of the whole study")
            })?);
        }
        for tuner in tuners.iter_mut().filter(|t| t.parameter == *name) {
            tuner.tie = Some((expression.clone(), of.clone()));
        }
    }
    Ok(())
}

/// The tuner of a free start value; guess and bounds from the data where the study gives none.
fn free_start(free: &Free, index: usize, case: &Case, models: &Models) -> Result<Tuner, Mistake> {
    let states: Vec<_> = models.iter().flat_map(|(_, m)| m.interface().states.iter().map(move |s| (m, s))).collect();
    let (model, state) = states.iter().find(|(_, s)| s.name == free.state).ok_or_else(|| {
        Mistake::new(&free.state, format!("no model has a state `{}`", free.state))
            .with_help(suggestion(&free.state, states.iter().map(|(_, s)| s.name.as_str())))
    })?;
    let parameter =
        parameter(&model.interface().parameters, &state.start).expect("a state's start value is a parameter");
    let unit = parameter.variable.unit.clone();
    let given = |key: &str, q: &Option<Quantity>| {
        q.as_ref().map(|q| converted(q, &unit).map_err(|m| m.within(key).within(&free.state))).transpose()
    };
    let (start, min, max) = (given("start", &free.start)?, given("min", &free.min)?, given("max", &free.max)?);
    let in_case = case.parameters.iter().find(|(name, _)| *name == state.start).map(|(_, value)| *value);
    let experiment = case.experiment.as_ref().expect("only experiments have free start values");
    let guess = guess_start(state.signal.as_deref(), state.rate_of.as_deref(), experiment);
    let (start, spread) = match (start.or(in_case), guess) {
        (Some(start), Some((_, spread))) => (start, spread),
        (None, Some(guess)) => guess,
        (start, None) if min.is_some() && max.is_some() => {
            (start.unwrap_or(0.5 * (min.unwrap_or(0.0) + max.unwrap_or(0.0))), 0.0)
        }
        _ => {
            return Err(Mistake::new(&free.state, format!("nothing measured tells where `{}` starts", free.state))
                .with_help(format!("write free = {{ {} = {{ start = ..., min = ..., max = ... }} }}", free.state)));
        }
    };
    let [low, high] = parameter.range;
    let bounds = [min.unwrap_or((start - spread).max(low)), max.unwrap_or((start + spread).min(high))];
    if bounds[0] >= bounds[1] || !(bounds[0]..=bounds[1]).contains(&start) {
        return Err(Mistake::new(
            &free.state,
            format!(
                "the start value {} does not lie inside its bounds, {} to {}",
                unit.amount(start),
                bounds[0],
                unit.amount(bounds[1])
            ),
        )
        .with_help("correct `start`, `min` and `max`; what is left out is read off the data"));
    }
    Ok(Tuner {
        name: format!("{}/{}", case.name, state.start),
        parameter: state.start.clone(),
        start,
        bounds,
        scale: Scale::Linear,
        grid: Grid::Continuous,
        unit,
        case: Some(index),
        active: true,
        tie: None,
    })
}

/// First value and half-width of the search: of a measured state, its first sample and half its range; of the rate of a
/// measured signal, the slope over the first samples and the largest slope anywhere.
fn guess_start(signal: Option<&str>, rate_of: Option<&str>, experiment: &Experiment) -> Option<(f64, f64)> {
    if let Some(channel) = signal.and_then(|s| experiment.channel(s)) {
        let (min, max) = channel.values.iter().fold((f64::MAX, f64::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        let floor = 4.0 * channel.noise.unwrap_or(0.0) + 1e-6 * max.abs().max(min.abs());
        return Some((channel.values[0], (0.5 * (max - min)).max(floor).max(f64::MIN_POSITIVE)));
    }
    let channel = rate_of.and_then(|s| experiment.channel(s))?;
    let slope = |i: usize, j: usize| (channel.values[j] - channel.values[i]) / (channel.times[j] - channel.times[i]);
    let n = channel.values.len();
    let span = (n - 1).min(3);
    let largest = (0..n - span).map(|i| slope(i, i + span).abs()).fold(0.0, f64::max);
    Some((slope(0, span), (1.5 * largest).max(f64::MIN_POSITIVE)))
}

fn add_rows(study: &mut Study, name: &str, draft: CriterionDraft) -> Result<(), Mistake> {
    let model = match &draft.model {
        Some(model) => study.models.iter().position(|(n, _)| n == model).ok_or_else(|| {
            Mistake::new("model", format!("the study has no model `{model}`"))
                .with_help(suggestion(model, study.models.iter().map(|(n, _)| n.as_str())))
        })?,
        None if study.models.len() == 1 => 0,
        None => {
            let known: Vec<String> = study.models.iter().map(|(name, _)| format!("model = \"{name}\"")).collect();
            return Err(Mistake::here("the study has several models, and the criterion does not say which it reads")
                .with_help(format!("add {}", known.join(" or "))));
        }
    };
    let interface = study.models[model].1.interface();
    check_sort(draft.criterion.reads(), interface.analysis, &study.models, model)?;
    let criterion: Arc<dyn Criterion> = Arc::from(draft.criterion.bind(interface)?);
    let signals = interface.signals.clone();
    let unit = criterion.unit();
    let demand = demand(&draft, &unit)?;
    if !(draft.weight.is_finite() && draft.weight > 0.0) {
        return Err(Mistake::new("weight", format!("a weight must be positive, not {}", draft.weight))
            .with_help("usage = \"monitor\" keeps a criterion out of the objective"));
    }
    for case in cases_of(study, &draft)? {
        let job = job(study, model, case, &criterion.signals(), &signals)?;
        study.rows.push(Row {
            name: name.to_owned(),
            job,
            criterion: Arc::clone(&criterion),
            usage: draft.usage,
            demand,
            weight: draft.weight,
            unit: unit.clone(),
        });
    }
    Ok(())
}

/// Refuses a criterion for a model whose analyses it cannot read.
fn check_sort(reads: AnalysisKind, gives: AnalysisKind, models: &Models, model: usize) -> Result<(), Mistake> {
    if reads == gives {
        return Ok(());
    }
    let name = &models[model].0;
    let fact = match gives {
        AnalysisKind::Time => format!("this criterion reads a linear system, but `{name}` is simulated over time"),
        AnalysisKind::Linear => format!("this criterion reads a simulation over time, but `{name}` is a linear system"),
    };
    let other = models.iter().find(|(_, model)| model.interface().analysis == reads);
    let way_out = match (other, reads) {
        (Some((other, _)), _) => format!("read another model: model = \"{other}\""),
        (None, AnalysisKind::Linear) => {
            "add a model that is linear: `linearise = { ... }` beside the kind makes one of a simulated model"
                .to_owned()
        }
        (None, AnalysisKind::Time) => "add a model that is simulated".to_owned(),
    };
    Err(Mistake::here(fact).with_help(way_out))
}

fn cases_of(study: &Study, draft: &CriterionDraft) -> Result<Vec<usize>, Mistake> {
    let reads = draft.criterion.reads();
    let measures = |case: &Case| match (draft.criterion.needs_measurement(), &case.experiment, reads) {
        (Some(signal), Some(experiment), AnalysisKind::Time) => experiment.channel(signal).is_some(),
        (Some(signal), Some(experiment), AnalysisKind::Linear) => experiment.response(signal).is_some(),
        (Some(_), None, _) => false,
        // Where only frequency responses were measured, nothing is simulated over time.
        (None, Some(experiment), AnalysisKind::Time) => !experiment.channels.is_empty(),
        (None, ..) => true,
    };
    let signal = draft.criterion.needs_measurement().unwrap_or_default();
    let way_out = match (reads, signal) {
        (_, "") => "name cases without a measurement over frequency, or experiments with `channels`".to_owned(),
        (AnalysisKind::Time, _) => format!("name experiments with `{signal}` among their `channels`"),
        (AnalysisKind::Linear, _) => format!("name experiments with `{signal}` among their `responses`"),
    };
    let chosen: Vec<usize> = match &draft.cases {
        None => (0..study.cases.len()).filter(|&i| measures(&study.cases[i])).collect(),
        Some(wanted) => wanted
            .iter()
            .map(|name| {
                let found = study.cases.iter().position(|c| c.name == *name).ok_or_else(|| {
                    Mistake::new(name, format!("the study has no case `{name}`"))
                        .with_help(suggestion(name, study.cases.iter().map(|c| c.name.as_str())))
                        .within("cases")
                })?;
                if measures(&study.cases[found]) {
                    Ok(found)
                } else {
                    let fact = match signal {
                        "" => {
                            format!("nothing is simulated over time in `{name}`, only frequency responses are measured")
                        }
                        signal => format!("nothing in `{name}` measures `{signal}`"),
                    };
                    Err(Mistake::new(name, fact).with_help(way_out.clone()).within("cases"))
                }
            })
            .collect::<Result<_, _>>()?,
    };
    if chosen.is_empty() {
        let help = match reads {
            AnalysisKind::Time => "add it to the `channels` of an experiment",
            AnalysisKind::Linear => "add it to the `responses` of an experiment with `frequency`",
        };
        return Err(match signal {
            "" => Mistake::here("no case is simulated over time: only frequency responses are measured")
                .with_help("add a case under [cases]"),
            signal => Mistake::new("signal", format!("no experiment measures `{signal}`")).with_help(help),
        });
    }
    Ok(chosen)
}

fn demand(draft: &CriterionDraft, unit: &Unit) -> Result<Demand, Mistake> {
    let value =
        |key: &str, q: &Option<Quantity>| q.as_ref().map(|q| converted(q, unit).map_err(|m| m.within(key))).transpose();
    let (demand, good, bad) = (value("demand", &draft.demand)?, value("good", &draft.good)?, value("bad", &draft.bad)?);
    match (demand, good, bad) {
        (Some(d), None, None) if d.is_finite() && d > 0.0 => Ok(Demand::Value(d)),
        (Some(d), None, None) => Err(Mistake::new("demand", format!("a demand must be positive, not {d}"))
            .with_help("the value is divided by it; where that does not fit, give `good` and `bad` instead, the values that scale to 0 and to 1")),
        (None, Some(good), Some(bad)) if good.is_finite() && bad.is_finite() && good != bad => Ok(Demand::Pair { good, bad }),
        (None, Some(_), Some(_)) => Err(Mistake::new("bad", "`good` and `bad` must be two different finite values")
            .with_help("`good` scales to 0, `bad` to 1")),
        (Some(_), _, _) => Err(Mistake::new("demand", "a demand and the pair `good`, `bad` exclude each other")
            .with_help("remove one or the other")),
        (None, None, None) if draft.usage == Usage::Monitor => Ok(Demand::None),
        (None, None, None) => Err(Mistake::here("the criterion has no demand").with_help("add `demand = ...`, or the pair `good` and `bad`")),
        (None, Some(_), None) => Err(Mistake::new("good", "`good` needs `bad` beside it")
            .with_help("add `bad = ...`, the value that scales to 1")),
        (None, None, Some(_)) => Err(Mistake::new("bad", "`bad` needs `good` beside it")
            .with_help("add `good = ...`, the value that scales to 0")),
    }
}

/// The job of a model in a case, made at the first need and still to be completed; the signals are added to those it
/// computes.
fn job(
    study: &mut Study,
    model: usize,
    case: usize,
    wanted: &[String],
    signals: &[Variable],
) -> Result<usize, Mistake> {
    let wanted = wanted.iter().map(|name| {
        signals.iter().position(|s| s.name == *name).ok_or_else(|| {
            Mistake::new("signal", format!("the model has no signal `{name}`"))
                .with_help(suggestion(name, signal_names(signals)))
        })
    });
    let wanted: Vec<usize> = wanted.collect::<Result<_, _>>()?;
    let index = match study.jobs.iter().position(|j| j.model == model && j.case == case) {
        Some(index) => index,
        None => {
            study.jobs.push(JobPlan { model, case, parameters: Vec::new(), signals: Vec::new(), horizon: 0.0 });
            study.jobs.len() - 1
        }
    };
    let job = &mut study.jobs[index];
    job.signals.extend(wanted);
    job.signals.sort_unstable();
    job.signals.dedup();
    Ok(index)
}

/// Gives a job its horizon and its parameters.
fn complete(study: &mut Study, index: usize, fixed: &[(String, f64)]) -> Result<(), Mistake> {
    let JobPlan { model, case, .. } = study.jobs[index];
    let interface = study.models[model].1.interface();
    let horizon = match (study.cases[case].horizon.or(interface.horizon), interface.analysis) {
        (Some(horizon), _) => horizon,
        (None, AnalysisKind::Linear) => 0.0,
        (None, AnalysisKind::Time) => {
            let fact = format!("nothing says how long `{}` is simulated", study.cases[case].name);
            return Err(Mistake::here(fact).with_help("give the case or the model a `horizon`"));
        }
    };
    let parameters = sources(study, interface, fixed, case)?;
    let job = &mut study.jobs[index];
    (job.horizon, job.parameters) = (horizon, parameters);
    Ok(())
}

/// Where each parameter comes from: a tuner of the case, a value in the case, a tuner of the study, the model's table,
/// the default.
fn sources(
    study: &Study,
    interface: &Interface,
    fixed: &[(String, f64)],
    case: usize,
) -> Result<Vec<ParameterSource>, Mistake> {
    let find = |list: &[(String, f64)], name: &str| list.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    interface
        .parameters
        .iter()
        .map(|p| {
            let name = &p.variable.name;
            let tuner = |of: Option<usize>| study.tuners.iter().position(|t| t.parameter == *name && t.case == of);
            if let Some(tuner) = tuner(Some(case)) {
                let factor = study.tuners[tuner].unit.factor_to(&p.variable.unit).unwrap_or(1.0);
                return Ok(ParameterSource::Tuner { tuner, factor });
            }
            if let Some(value) = find(&study.cases[case].parameters, name) {
                return Ok(ParameterSource::Constant(value));
            }
            if let Some(tuner) = tuner(None) {
                let factor = study.tuners[tuner].unit.factor_to(&p.variable.unit).unwrap_or(1.0);
                return Ok(ParameterSource::Tuner { tuner, factor });
            }
            find(fixed, name).or(p.default).map(ParameterSource::Constant).ok_or_else(|| {
                Mistake::here(format!("nothing gives a value to `{name}` in `{}`", study.cases[case].name)).with_help(
                    format!("make `{name}` a tuner, or give it a value in the case or in the model's `parameters`"),
                )
            })
        })
        .collect()
}
