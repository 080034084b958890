//! `mops linearise`: a model of a study as a linear system, and the design of state feedback for it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use mops_core::linear::{Complex, TransferFunction, eigenvalues, lqr, place, zeros};
use mops_core::{
    Analysis, AnalysisKind, Catalogue, Diagnostic, Failure, Job, Linearise, Linearised, Mistake, Quantity, Resting,
    StateSpace, Study, Unit, Variable, suggestion,
};
use serde_json::{Value, json};

use super::families::folded;
use super::study::{StudyArguments, open};
use super::tables::{number, table};
use super::{Trouble, cannot_write, linear_plots, print};
use crate::files;
use crate::report::file_name;

/// What is linearised, and what is done with it.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
    /// The model; needed where the study has several.
    #[arg(long)]
    model: Option<String>,
    /// Value of a tuner, a parameter, a state or an input: --at theta="180 deg". States that are not named have their start
    /// value, inputs the value that the case gives them at the start.
    #[arg(long = "at", value_name = "NAME=VALUE")]
    at: Vec<String>,
    /// The case whose parameters and inputs hold; the first where absent.
    #[arg(long)]
    case: Option<String>,
    /// Only this input.
    #[arg(long)]
    input: Option<String>,
    /// Only this output.
    #[arg(long)]
    output: Option<String>,
    /// Move the operating point to the nearest equilibrium; states named with --at are held, and so are inputs.
    #[arg(long)]
    equilibrium: bool,
    /// A state or an input that the search for the equilibrium may move although it would be held.
    #[arg(long, value_name = "NAME", requires = "equilibrium")]
    free: Vec<String>,
    /// State feedback u = -K x that places the poles: --place=-5,-8,-2+3i,-2-3i (1/s).
    #[arg(long, value_name = "POLES", allow_hyphen_values = true)]
    place: Option<String>,
    /// State feedback u = -K x by linear-quadratic optimisation: weights of the states, then of the inputs.
    #[arg(long, value_name = "WEIGHTS", conflicts_with = "place")]
    lqr: Option<String>,
    /// Folder for the plots and linearised.json; nothing is written where absent.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn linearise(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, Trouble> {
    let study = open(catalogue, &arguments.study)?.study;
    let (job, model) = chosen(&study, arguments)?;
    let (name, case) = (&study.models[model].0, &study.cases[study.jobs[job].case]);
    let (parameters, at) = values(&study, job, &arguments.at)?;
    let found = found(&study, job, &parameters, at, arguments)?;
    let interface = study.models[model].1.interface();
    let system = narrowed(&found.system, arguments)?;

    print(&format!("{name} in case {}\n", case.name))?;
    let states = study.models[model].1.equation_states();
    if !states.is_empty() {
        print(&format!("\n{}", operating_point(&states, &interface.inputs, &found)))?;
        for joint in &found.frictionless {
            print(&format!("note: dry friction of `{joint}` is left out: a joint at rest has no linear friction\n"))?;
        }
    }
    let unit = |name: &str| unit_of(name, &states, &interface.inputs, &interface.signals);
    print(&matrices(&system, &unit))?;
    let poles = system.poles().map_err(Trouble::Failure)?;
    print(&poles_table("pole", &poles))?;
    let mut channels = Vec::new();
    let pairs = (0..system.inputs.len()).flat_map(|i| (0..system.outputs.len()).map(move |o| (i, o)));
    for (count, (i, o)) in pairs.enumerate() {
        if count >= MANY && arguments.out.is_none() {
            break;
        }
        let (text, value) = channel(&system.channel(i, o), &poles).map_err(Trouble::Failure)?;
        if count < MANY {
            print(&text)?;
        }
        channels.push(value);
    }
    let unseen = (system.inputs.len() * system.outputs.len()).saturating_sub(MANY);
    if unseen > 0 {
        print(&format!("\nand {unseen} more; --input and --output pick one, {WHERE} has all\n"))?;
    }
    let feedback = match design(&system, arguments)? {
        Some((heading, k)) => {
            let closed = eigenvalues(&(&system.a - &system.b * &k)).map_err(Trouble::Failure)?;
            let labels = |names: &[String]| labels(names, &unit);
            let shown = rounded_matrix(&k);
            print(&format!(
                "\n{heading}, u = -K x\n\n{}",
                named("K", &shown, &labels(&system.inputs), &labels(&system.states))
            ))?;
            print(&poles_table("closed-loop pole", &closed))?;
            json!({ "k": rows(&k), "poles": complex(&closed) })
        }
        None => Value::Null,
    };
    if let Some(folder) = &arguments.out {
        let content = json!({
            "model": name, "case": case.name, "states": system.states, "inputs": system.inputs, "outputs": system.outputs,
            "a": rows(&system.a), "b": rows(&system.b), "c": rows(&system.c), "d": rows(&system.d), "delay": system.delay,
            "at": { "states": found.states, "inputs": found.inputs, "rates": found.rates },
            "poles": complex(&system.poles().map_err(Trouble::Failure)?), "channels": channels, "feedback": feedback,
        });
        write(folder, &system, &content)?;
        print(&format!("\nlinearised.json and plots are in {}\n", folder.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// From how many states and channels on the terminal does not show all.
const MANY: usize = 12;

/// Where what is not shown can be found.
const WHERE: &str = "linearised.json (--out DIR)";

/// The job of the model and the case that are asked for.
fn chosen(study: &Study, arguments: &Arguments) -> Result<(usize, usize), Diagnostic> {
    let models: Vec<&str> = study.models.iter().map(|(name, _)| name.as_str()).collect();
    let model = match &arguments.model {
        Some(name) => models.iter().position(|m| m == name).ok_or_else(|| {
            let help = suggestion(name, models.iter().copied());
            Diagnostic::new(format!("the study has no model `{name}`")).with_help(help)
        })?,
        None if models.len() == 1 => 0,
        None => {
            let help = format!("add --model with one of {}", models.join(", "));
            return Err(Diagnostic::new("the study has several models").with_help(help));
        }
    };
    let jobs: Vec<usize> = (0..study.jobs.len()).filter(|&job| study.jobs[job].model == model).collect();
    let cases: Vec<&str> = jobs.iter().map(|&job| study.cases[study.jobs[job].case].name.as_str()).collect();
    let place = match &arguments.case {
        None if !jobs.is_empty() => 0,
        None => {
            return Err(Diagnostic::new(format!("no criterion of the study reads `{}`", models[model]))
                .with_help("add one with usage = \"monitor\", so that its parameters are known"));
        }
        Some(name) => cases.iter().position(|case| case == name).ok_or_else(|| {
            Diagnostic::new(format!("`{}` is analysed in no case `{name}`", models[model]))
                .with_help(suggestion(name, cases.iter().copied()))
        })?,
    };
    Ok((jobs[place], model))
}

type Named = Vec<(String, Quantity)>;

/// The parameters of the job, and what is left of `--at`: states and inputs.
fn values(study: &Study, job: usize, given: &[String]) -> Result<(Vec<f64>, Named), Diagnostic> {
    let plan = &study.jobs[job];
    let interface = study.models[plan.model].1.interface();
    let mut tuners = study.start();
    let (mut direct, mut rest) = (Vec::new(), Vec::new());
    for text in given {
        let wrong = |why: String| Diagnostic::new(format!("`--at {text}`: {why}"));
        let (name, value) = text.split_once('=').ok_or_else(|| {
            Diagnostic::new(format!("`--at {text}` names no value")).with_help("write it as --at theta=0.1")
        })?;
        let (name, quantity) = (name.trim(), Quantity::parse(value).map_err(wrong)?);
        if let Some(i) = study.tuners.iter().position(|t| t.name == name) {
            tuners[i] = quantity.to(&study.tuners[i].unit).map_err(wrong)?;
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

/// The system, with all inputs and outputs.
fn found(study: &Study, job: usize, parameters: &[f64], at: Named, arguments: &Arguments) -> Result<Resting, Trouble> {
    let plan = &study.jobs[job];
    let (model, case) = (&study.models[plan.model].1, &study.cases[plan.case]);
    let undefined = |failure: Failure| Trouble::Failure(format!("the model cannot be linearised there: {failure}"));
    if model.interface().analysis == AnalysisKind::Linear {
        if let Some((name, _)) = at.first() {
            return Err(Diagnostic::new(format!("`--at {name}`: a linear model has no such tuner or parameter"))
                .with_help("the operating point of a linearised model stands in the study, under `linearise`")
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
                    system,
                };
                Ok(none)
            }
            Analysis::Time(_) => unreachable!("a linear model gives linear systems"),
        };
    }
    let options =
        Linearise { at, equilibrium: arguments.equilibrium, free: arguments.free.clone(), ..Linearise::default() };
    let told = |Mistake { message, help, .. }: Mistake| Diagnostic { help, ..Diagnostic::new(message) };
    Linearised::new(Arc::clone(model), &options).map_err(told)?.at(case, parameters).map_err(undefined)
}

/// The system with the inputs and outputs that are asked for.
fn narrowed(system: &StateSpace, arguments: &Arguments) -> Result<StateSpace, Diagnostic> {
    let pick = |what: &str, wanted: &Option<String>, names: &[String]| -> Result<Vec<usize>, Diagnostic> {
        let Some(wanted) = wanted else {
            // Inputs are signals too; as outputs they say nothing, unless they are asked for.
            let told: Vec<usize> =
                (0..names.len()).filter(|&i| what == "input" || !system.inputs.contains(&names[i])).collect();
            return Ok(if told.is_empty() { (0..names.len()).collect() } else { told });
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

fn operating_point(states: &[Variable], inputs: &[Variable], found: &Resting) -> String {
    let of_states = states.iter().zip(found.states.iter().zip(&found.rates));
    let of_states =
        of_states.map(|(v, (value, rate))| vec![v.name.clone(), number(*value), v.unit.to_string(), number(*rate)]);
    let of_inputs = inputs.iter().zip(&found.inputs);
    let of_inputs = of_inputs.map(|(v, value)| vec![v.name.clone(), number(*value), v.unit.to_string(), String::new()]);
    let header = ["operating point", "value", "unit", "rate per s"];
    let mut text = table(&header, &[1, 3], folded(of_states.chain(of_inputs).collect(), 0));
    if found.rates.iter().any(|rate| rate.abs() > 1e-9) {
        text += "note: the model does not rest there; --equilibrium searches where it does\n";
    }
    text
}

fn unit_of(name: &str, states: &[Variable], inputs: &[Variable], signals: &[Variable]) -> String {
    let variable = states.iter().chain(inputs).chain(signals).find(|v| v.name == name);
    variable.map(|v| v.unit.to_string()).filter(|unit| unit != "1").unwrap_or_default()
}

/// Names with their units.
fn labels(names: &[String], unit: &dyn Fn(&str) -> String) -> Vec<String> {
    let label = |name: &String| match unit(name) {
        unit if unit.is_empty() => name.clone(),
        unit => format!("{name} [{unit}]"),
    };
    names.iter().map(label).collect()
}

fn matrices(system: &StateSpace, unit: &dyn Fn(&str) -> String) -> String {
    let rate = |name: &String| match unit(name) {
        unit if unit.is_empty() => format!("{name}' [1/s]"),
        unit => format!("{name}' [{}]", Unit::known(&unit).power(1, -1)),
    };
    let (states, rates) = (labels(&system.states, unit), system.states.iter().map(rate).collect());
    let (inputs, outputs) = (labels(&system.inputs, unit), labels(&system.outputs, unit));
    let mut text = String::new();
    if system.order() > MANY {
        text += &format!("\nA, B, C and D, with {} states, are in {WHERE}\n", system.order());
    }
    for (name, matrix, rows, columns) in [
        ("A", &system.a, &rates, &states),
        ("B", &system.b, &rates, &inputs),
        ("C", &system.c, &outputs, &states),
        ("D", &system.d, &outputs, &inputs),
    ] {
        if system.order() > MANY {
            break;
        }
        text += &format!("\n{}", named(name, matrix, rows, columns));
    }
    if system.delay != 0.0 {
        text += &format!("\ninputs act with a delay of {} s\n", number(system.delay));
    }
    text
}

fn named(name: &str, matrix: &nalgebra::DMatrix<f64>, rows: &[String], columns: &[String]) -> String {
    let header: Vec<&str> = [name].into_iter().chain(columns.iter().map(String::as_str)).collect();
    let numeric: Vec<usize> = (1..=columns.len()).collect();
    let line = |(i, row): (usize, &String)| {
        [row.clone()].into_iter().chain(matrix.row(i).iter().map(|x| number(*x))).collect()
    };
    table(&header, &numeric, rows.iter().enumerate().map(line).collect())
}

/// Numbers of which nothing is left that is rounding beside the largest of `all`.
fn rounded(numbers: &[Complex], all: &[Complex]) -> Vec<Complex> {
    let largest = all.iter().chain(numbers).map(|z| z.norm()).filter(|size| size.is_finite()).fold(0.0, f64::max);
    // Poles of one system may well lie nine decades apart.
    let part = |part: f64, size: f64| if part.abs() < 1e-12 * largest || part.abs() < 1e-9 * size { 0.0 } else { part };
    numbers.iter().map(|z| Complex::new(part(z.re, z.norm()), part(z.im, z.norm()))).collect()
}

/// A matrix without what is rounding beside its largest entry.
fn rounded_matrix(matrix: &nalgebra::DMatrix<f64>) -> nalgebra::DMatrix<f64> {
    let largest = matrix.amax();
    matrix.map(|x| if x.abs() < 1e-9 * largest { 0.0 } else { x })
}

/// A polynomial, its highest power first, without the terms that are rounding beside the others at every frequency of the
/// poles.
fn rounded_polynomial(coefficients: &[f64], poles: &[Complex]) -> Vec<f64> {
    let degree = coefficients.len().saturating_sub(1);
    let poles = rounded(poles, poles);
    let frequencies: Vec<f64> = poles.iter().map(|pole| pole.norm()).filter(|size| *size > 0.0).collect();
    let term = |i: usize, omega: f64| coefficients[i].abs() * omega.powi((degree - i) as i32);
    let counts = |i: usize, omega: f64| {
        let largest = (0..=degree).map(|j| term(j, omega)).fold(0.0, f64::max);
        term(i, omega) >= 1e-9 * largest
    };
    let frequencies = if frequencies.is_empty() { vec![1.0] } else { frequencies };
    let kept = |(i, &c): (usize, &f64)| if frequencies.iter().any(|&omega| counts(i, omega)) { c } else { 0.0 };
    coefficients.iter().enumerate().map(kept).collect()
}

fn spelled(z: Complex) -> String {
    match z.im {
        0.0 => number(z.re),
        im => format!("{} {} {}i", number(z.re), if im > 0.0 { "+" } else { "-" }, number(im.abs())),
    }
}

fn poles_table(what: &str, poles: &[Complex]) -> String {
    let mut sorted = rounded(poles, poles);
    sorted.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let row = |p: &Complex| {
        let damping = if p.norm() == 0.0 { String::new() } else { number(-p.re / p.norm()) };
        let constant = if p.re < 0.0 { number(-1.0 / p.re) } else { String::new() };
        vec![spelled(*p), damping, number(p.norm()), constant]
    };
    let header = [&format!("{what} (1/s)"), "damping", "frequency (rad/s)", "time constant (s)"];
    format!("\n{}", table(&header, &[1, 2, 3], sorted.iter().map(row).collect()))
}

/// Zeros and transfer function of one channel, as text and as JSON.
fn channel(system: &StateSpace, poles: &[Complex]) -> Result<(String, Value), String> {
    let zeros = zeros(system)?;
    let function = TransferFunction::of(system)?;
    let spelled_zeros: Vec<String> = rounded(&zeros, poles).iter().map(|z| spelled(*z)).collect();
    let spelled_zeros = match spelled_zeros.len() {
        count if count > MANY => vec![format!("{count} of them, in {WHERE}")],
        _ => spelled_zeros,
    };
    let (input, output) = (&system.inputs[0], &system.outputs[0]);
    let is_zero = function.numerator.iter().all(|c| *c == 0.0);
    let text = match (is_zero, spelled_zeros.is_empty()) {
        (true, _) => "  0\n".to_owned(),
        (false, empty) => format!(
            "{}  zeros (1/s): {}\n",
            if system.order() > MANY { String::new() } else { format!("  {}\n", quotient(&function, poles)) },
            if empty { "none".to_owned() } else { spelled_zeros.join(", ") }
        ),
    };
    let value = json!({
        "input": input, "output": output, "zeros": complex(&zeros),
        "numerator": function.numerator, "denominator": function.denominator, "delay": function.delay,
    });
    Ok((format!("\n{output}/{input}\n{text}"), value))
}

fn quotient(function: &TransferFunction, poles: &[Complex]) -> String {
    let polynomial = |coefficients: &[f64]| {
        let degree = coefficients.len() - 1;
        let mut text = String::new();
        for (i, &c) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let sign = match (text.is_empty(), c < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            let power = match degree - i {
                0 => String::new(),
                1 => "s".to_owned(),
                power => format!("s^{power}"),
            };
            let factor = if c.abs() == 1.0 && !power.is_empty() { String::new() } else { number(c.abs()) };
            let space = if factor.is_empty() || power.is_empty() { "" } else { " " };
            text += &format!("{sign}{factor}{space}{power}");
        }
        text
    };
    let delay = if function.delay == 0.0 { String::new() } else { format!(" exp(-{} s)", number(function.delay)) };
    let [numerator, denominator] =
        [&function.numerator, &function.denominator].map(|p| polynomial(&rounded_polynomial(p, poles)));
    format!("({numerator})/({denominator}){delay}")
}

/// The state feedback that is asked for.
fn design(
    system: &StateSpace,
    arguments: &Arguments,
) -> Result<Option<(&'static str, nalgebra::DMatrix<f64>)>, Diagnostic> {
    let (n, m) = (system.order(), system.inputs.len());
    if let Some(text) = &arguments.place {
        let poles: Vec<Complex> = text
            .split(',')
            .map(|part| {
                let part: String = part.split_whitespace().collect();
                part.parse().map_err(|_| {
                    Diagnostic::new(format!("`--place`: `{part}` is no number"))
                        .with_help("write real poles as -5, pairs as -2+3i,-2-3i")
                })
            })
            .collect::<Result<_, _>>()?;
        let placed = place(&system.a, &system.b, &poles).map_err(|why| Diagnostic::new(format!("`--place`: {why}")))?;
        return Ok(Some(("pole placement", placed.k)));
    }
    let Some(text) = &arguments.lqr else { return Ok(None) };
    let weights: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    if weights.len() != n + m || text.split(',').count() != n + m {
        return Err(Diagnostic::new(format!("`--lqr` takes {n} weights of states and {m} of inputs, not `{text}`"))
            .with_help(format!("in the order {}, {}", system.states.join(", "), system.inputs.join(", "))));
    }
    let diagonal = |list: &[f64]| nalgebra::DMatrix::from_diagonal(&nalgebra::DVector::from_column_slice(list));
    let k = lqr(&system.a, &system.b, &diagonal(&weights[..n]), &diagonal(&weights[n..]));
    Ok(Some(("linear-quadratic feedback", k.map_err(|why| Diagnostic::new(format!("`--lqr`: {why}")))?)))
}

fn rows(matrix: &nalgebra::DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn complex(numbers: &[Complex]) -> Vec<[f64; 2]> {
    numbers.iter().map(|z| [z.re, z.im]).collect()
}

fn write(folder: &Path, system: &StateSpace, content: &Value) -> Result<(), Trouble> {
    std::fs::create_dir_all(folder).map_err(cannot_write(folder))?;
    let path = folder.join("linearised.json");
    let text = serde_json::to_string_pretty(content).expect("numbers and names are JSON") + "\n";
    files::write(&path, text).map_err(cannot_write(&path))?;
    for i in 0..system.inputs.len() {
        for o in 0..system.outputs.len() {
            let channel = system.channel(i, o);
            let name = format!("{}/{}", channel.outputs[0], channel.inputs[0]);
            for (kind, plot) in linear_plots::plots(&channel, &name).map_err(Trouble::Failure)? {
                let path = folder.join(file_name(&format!("{kind}-{}-{}", channel.outputs[0], channel.inputs[0])));
                files::write(&path.with_extension("svg"), plot.svg()).map_err(cannot_write(&path))?;
                plot.write_png(&path.with_extension("png")).map_err(cannot_write(&path))?;
            }
        }
    }
    Ok(())
}
