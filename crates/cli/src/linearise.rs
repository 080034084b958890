//! `mops linearise`: linearises a model of a study and designs state feedback for it.

mod arguments;
mod feedback;
mod files;
mod text;

use std::process::ExitCode;
use std::sync::Arc;

use mops_core::{
    Analysis, AnalysisKind, Catalogue, Failure, Job, Study, StudyError,
    model::{Linearise, Linearised, Resting},
    study::JobPlan,
};
use mops_language::{Diagnostic, Quantity, suggestion};
use mops_linear::{Complex, StateSpace, TransferFunction, eigenvalues, zeros};
use serde_json::{Value, json};

use self::feedback::Wanted;
use self::text::MANY;
use super::study::{home, open, outputs};
use crate::terminal::{CommandError, exit_after, print};
pub(super) use arguments::Arguments;
use arguments::{WHERE, complex, rows};

pub(super) fn linearise(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    exit_after(arguments.limit);
    let file = open(catalogue, &arguments.study)?;
    let outputs = outputs(&home(catalogue, &arguments.study), &file);
    let study = file.study;
    let plan = chosen(&study, arguments)?;
    let model = plan.model;
    let (name, case) = (&study.models()[model].0, &study.cases()[plan.case]);
    let (parameters, at) = values(&study, &plan, &arguments.at)?;
    let found = found(&study, &plan, &parameters, at, arguments)?;
    let interface = study.models()[model].1.interface();
    let system = narrowed(&found.system, arguments)?;

    let wanted = Wanted::of(&system, arguments)?;

    print(&format!("{name} in case {}\n", case.name))?;
    let states = study.models()[model].1.equation_states();
    if !states.is_empty() {
        print(&format!("\n{}", text::operating_point(&states, &interface.inputs, &found)))?;
        for joint in &found.frictionless {
            print(&format!("note: dry friction of `{joint}` is ignored: it has no linearisation at zero speed\n"))?;
        }
        for rough in found.rough.iter().filter(|rough| system.outputs.contains(&rough.of)) {
            print(&format!("note: {rough}; C and D are one-sided derivatives\n"))?;
        }
    }
    let unit = |name: &str| text::unit_of(name, &states, &interface.inputs, &interface.signals);
    // The matrices of a sampled system are those of its difference equation, its poles are those in z.
    let equation = system.difference_equation().unwrap_or_else(|| system.clone());
    print(&text::matrices(&equation, system.period, &unit))?;
    let in_z = |root: Complex| system.period.map_or(root, |period| StateSpace::z(root, period));
    let poles = eigenvalues(&system.a).map(|roots| roots.into_iter().map(in_z).collect::<Vec<_>>());
    match &poles {
        Ok(poles) => print(&(text::poles_table("pole", poles, system.period) + &text::undecided_note(&system)))?,
        Err(why) => print(&format!("\nnote: no poles: {why}\n"))?,
    }
    let known: &[Complex] = poles.as_deref().unwrap_or_default();
    let channels = channels(&equation, system.period, known, arguments.out.is_some())?;
    let feedback = wanted.map(|wanted| wanted.design(&system, &unit));
    if let Some(Ok((text, _))) = &feedback {
        print(text)?;
    }
    if let Some(folder) = &arguments.out {
        let feedback = match &feedback {
            Some(Ok((_, value))) => value.clone(),
            _ => Value::Null,
        };
        let content = json!({
            "model": name, "case": case.name, "states": system.states, "inputs": system.inputs, "outputs": system.outputs,
            "a": rows(&equation.a), "b": rows(&equation.b), "c": rows(&equation.c), "d": rows(&equation.d),
            "delay": system.delay, "period": system.period,
            "at": { "states": found.states, "inputs": found.inputs, "rates": found.rates },
            "poles": poles.ok().map(|poles| complex(&poles)), "channels": channels, "feedback": feedback,
        });
        print(&files::write((folder, &outputs), &system, &content)?)?;
    }
    // A failed design is reported after all other output.
    feedback.transpose()?;
    Ok(ExitCode::SUCCESS)
}

/// Prints zeros and transfer functions of the channels, and returns them as JSON: of all channels if `all`, else of the
/// printed ones.
fn channels(
    system: &StateSpace,
    period: Option<f64>,
    poles: &[Complex],
    all: bool,
) -> Result<Vec<Value>, CommandError> {
    let mut values = Vec::new();
    let pairs = (0..system.inputs.len()).flat_map(|i| (0..system.outputs.len()).map(move |o| (i, o)));
    for (count, (i, o)) in pairs.enumerate() {
        if count >= MANY && !all {
            break;
        }
        let channel = system.channel(i, o);
        let (input, output) = (&channel.inputs[0], &channel.outputs[0]);
        let found = zeros(&channel).and_then(|zeros| Ok((TransferFunction::of(&channel)?, zeros)));
        let (text, value) = match found {
            Ok((function, zeros)) => {
                let TransferFunction { numerator, denominator, delay } = &function;
                let value = json!({
                    "input": input, "output": output, "zeros": complex(&zeros),
                    "numerator": numerator, "denominator": denominator, "delay": delay,
                });
                (text::channel(&channel, period, &zeros, &function, poles), value)
            }
            Err(why) => {
                let nothing =
                    json!({ "input": input, "output": output, "zeros": null, "numerator": null, "denominator": null });
                (format!("  note: no transfer function: {why}\n"), nothing)
            }
        };
        if count < MANY {
            print(&format!("\n{output}/{input}\n{text}"))?;
        }
        values.push(value);
    }
    let unseen = (system.inputs.len() * system.outputs.len()).saturating_sub(MANY);
    if unseen > 0 {
        print(&format!("\nand {unseen} more; select one with --input and --output, or see {WHERE}\n"))?;
    }
    Ok(values)
}

/// Returns the requested model in the requested case. Unless a case is given, it is the first one in which a criterion
/// reads the model, or else the first of all.
fn chosen(study: &Study, arguments: &Arguments) -> Result<JobPlan, Diagnostic> {
    let find = |what: &str, wanted: &str, names: Vec<&str>| {
        names.iter().position(|name| *name == wanted).ok_or_else(|| {
            let help = suggestion(wanted, names.iter().copied());
            Diagnostic::new(format!("the study has no {what} `{wanted}`")).with_help(help)
        })
    };
    let models: Vec<&str> = study.models().iter().map(|(name, _)| name.as_str()).collect();
    let model = match &arguments.model {
        Some(name) => find("model", name, models)?,
        None if models.len() == 1 => 0,
        None => {
            let help = format!("add --model with one of {}", models.join(", "));
            return Err(Diagnostic::new("the study has several models").with_help(help));
        }
    };
    let case = match &arguments.case {
        Some(name) => find("case", name, study.cases().iter().map(|case| case.name.as_str()).collect())?,
        None => study.jobs().iter().find(|job| job.model == model).map_or(0, |job| job.case),
    };
    let diagnostic = |StudyError { message, help, .. }: StudyError| Diagnostic { help, ..Diagnostic::new(message) };
    let set: Vec<&str> = arguments.at.iter().filter_map(|text| text.split_once('=')).map(|at| at.0.trim()).collect();
    let parameters = study.parameter_sources(model, case, &set).map_err(diagnostic)?;
    Ok(JobPlan { model, case, parameters, signals: Vec::new(), horizon: 0.0 })
}

type Named = Vec<(String, Quantity)>;

/// Returns the parameters of the job, and the remaining values of `--at`: states and inputs.
fn values(study: &Study, plan: &JobPlan, given: &[String]) -> Result<(Vec<f64>, Named), Diagnostic> {
    let interface = study.models()[plan.model].1.interface();
    let mut tuners = study.start();
    let (mut direct, mut rest) = (Vec::new(), Vec::new());
    for text in given {
        let wrong = |why: String| Diagnostic::new(format!("`--at {text}`: {why}"));
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| Diagnostic::new(format!("`--at {text}` has no value")).with_help("write --at theta=0.1"))?;
        let (name, quantity) = (name.trim(), Quantity::parse(value).map_err(wrong)?);
        if let Some(i) = study.tuners().iter().position(|t| t.name == name) {
            tuners[i] = quantity.to(&study.tuners()[i].unit).map_err(wrong)?;
        } else if let Some(i) = interface.parameters.iter().position(|p| p.variable.name == name) {
            direct.push((i, quantity.to(&interface.parameters[i].variable.unit).map_err(wrong)?));
        } else {
            rest.push((name.to_owned(), quantity));
        }
    }
    study.apply_ties(&mut tuners);
    let mut parameters = study.parameters(plan, &tuners);
    direct.into_iter().for_each(|(i, value)| parameters[i] = value);
    Ok((parameters, rest))
}

/// Linearises the model between the requested inputs and outputs.
fn found(
    study: &Study,
    plan: &JobPlan,
    parameters: &[f64],
    at: Named,
    arguments: &Arguments,
) -> Result<Resting, CommandError> {
    let (model, case) = (&study.models()[plan.model].1, &study.cases()[plan.case]);
    let undefined = |failure: Failure| CommandError::Failure(format!("the model cannot be linearised here: {failure}"));
    if model.interface().analysis == AnalysisKind::Linear {
        if let Some((name, _)) = at.first() {
            return Err(Diagnostic::new(format!("`--at {name}`: the linear model has no such tuner or parameter"))
                .with_help("the operating point of a linearised model is set in the study, under `linearise`")
                .into());
        }
        let request = Job { case, parameters, signals: &[], horizon: plan.horizon };
        return match model.analyse(&request).map_err(undefined)? {
            Analysis::Linear(system) => {
                let none = Resting {
                    states: Vec::new(),
                    inputs: Vec::new(),
                    rates: Vec::new(),
                    frictionless: Vec::new(),
                    rough: Vec::new(),
                    system,
                };
                Ok(none)
            }
            Analysis::Time(_) => unreachable!("a linear model gives linear systems"),
        };
    }
    let named = |name: &Option<String>| name.clone().map(|name| vec![name]);
    let options = Linearise {
        inputs: named(&arguments.input),
        outputs: named(&arguments.output),
        at,
        equilibrium: arguments.equilibrium,
        free: arguments.free.clone(),
    };
    let diagnostic = |StudyError { message, help, .. }: StudyError| Diagnostic { help, ..Diagnostic::new(message) };
    let linearised = Linearised::new(Arc::clone(model), &options).map_err(diagnostic)?;
    let found = linearised.at(case, parameters).map_err(undefined)?;
    match found.rough.iter().find(|rough| rough.is_rate) {
        Some(rough) => Err(CommandError::Failure(format!(
            "the model cannot be linearised here: {rough}; choose another operating point with --at"
        ))),
        None => Ok(found),
    }
}

/// Returns the system reduced to the requested inputs and outputs.
fn narrowed(system: &StateSpace, arguments: &Arguments) -> Result<StateSpace, Diagnostic> {
    let pick = |what: &str, wanted: &Option<String>, names: &[String]| -> Result<Vec<usize>, Diagnostic> {
        let Some(wanted) = wanted else {
            // Inputs are signals, too; as outputs they are trivial and shown only on request.
            let shown: Vec<usize> =
                (0..names.len()).filter(|&i| what == "input" || !system.inputs.contains(&names[i])).collect();
            return Ok(if shown.is_empty() { (0..names.len()).collect() } else { shown });
        };
        let place = names.iter().position(|name| name == wanted).ok_or_else(|| {
            Diagnostic::new(format!("the model has no {what} `{wanted}`"))
                .with_help(suggestion(wanted, names.iter().map(String::as_str)))
        })?;
        Ok(vec![place])
    };
    let inputs = pick("input", &arguments.input, &system.inputs)?;
    let outputs = pick("output", &arguments.output, &system.outputs)?;
    Ok(StateSpace {
        b: system.b.select_columns(&inputs),
        c: system.c.select_rows(&outputs),
        d: system.d.select_columns(&inputs).select_rows(&outputs),
        inputs: inputs.iter().map(|&i| system.inputs[i].clone()).collect(),
        outputs: outputs.iter().map(|&i| system.outputs[i].clone()).collect(),
        ..system.clone()
    })
}
