//! Requirements on every criterion: it is documented, and a study file can refer to it.

use std::collections::HashSet;
use std::io;

use mops_core::{
    Analysis, AnalysisKind, Catalogue, Failure, Interface, Job, Model, ModelOptions, Problem, Response, Solver,
    SolverOptions, StudyError, Trace, Variable,
    catalogue::{ModelKind, SolverKind},
};
use mops_criteria::kinds;
use mops_file::{describe, read};
use mops_language::files::Files;
use mops_math as math;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::testing::sampled;

/// Every kind in the order of the catalogue, simulated ones before linear ones, with options as written in a study
/// file.
const EXAMPLES: &[(&str, &str)] = &[
    ("overshoot", "{ signal = 'y', target = 1, from = 0, step-time = '0 s', absolute = false }"),
    ("undershoot", "{ signal = 'y', target = '100 cm' }"),
    ("peak", "{ signal = 'y', of = 'absolute' }"),
    ("settling-time", "{ signal = 'y', target = 1, relative-band = '2 %' }"),
    ("rise-time", "{ signal = 'y', target = 1, low = 0.1, high = '90 %' }"),
    ("delay-time", "{ signal = 'y', target = 1, level = 0.5 }"),
    ("steady-state-error", "{ signal = 'y', target = 1, window = '1 s' }"),
    ("final-value", "{ signal = 'y' }"),
    ("expression", "{ value = 'maximum(y) - integral(y^2)/1 [m s]' }"),
    ("ise", "{ signal = 'y', target = 1, step-time = 0 }"),
    ("iae", "{ signal = 'y', target = 1 }"),
    ("itae", "{ signal = 'y', target = 1 }"),
    ("itse", "{ signal = 'y', target = 1 }"),
    ("control-effort", "{ signal = 'y', of = 'absolute', offset = '1 m' }"),
    ("maximum-rate", "{ signal = 'y' }"),
    ("step-envelope", "{ signal = 'y', upper = [[0, 1.1], ['2000 ms', '1.02 m']], lower = [[3, 0.9]] }"),
    ("model-tracking", "{ signal = 'y', target = 1, frequency = '1 Hz', damping = 0.7 }"),
    ("fit", "{ signal = 'y', weight = 2.5 }"),
    ("normalised-error", "{ signal = 'y', noise = '1 mm' }"),
    ("rmse", "{ signal = 'y' }"),
    ("fit-percent", "{ signal = 'y' }"),
    ("gain-margin", "{ input = 'u', output = 'y', either-way = true }"),
    ("phase-margin", "{}"),
    ("delay-margin", "{}"),
    ("disk-margin", "{ skew = 0.0 }"),
    ("maximum-sensitivity", "{}"),
    ("maximum-complementary-sensitivity", "{}"),
    ("bandwidth", "{ of = 'closed-loop' }"),
    ("crossover-frequency", "{}"),
    ("damping-ratio", "{ of = 'closed-loop' }"),
    ("slowest-pole", "{ of = 'system' }"),
    ("gain-mask", "{ upper = [['1 Hz', 10], [100, 5]], lower = [[1, 1e-6], [2, 1e-6]] }"),
    ("h2-norm", "{}"),
    ("hinf-norm", "{}"),
    ("frequency-fit", "{ signal = 'y', input = 'u', absolute = false }"),
];

/// First kind of criterion that evaluates linear systems; all later ones do too.
const FIRST_LINEAR: &str = "gain-margin";

fn is_linear(kind: &str) -> bool {
    let place = |kind| EXAMPLES.iter().position(|(name, _)| *name == kind);
    place(kind) >= place(FIRST_LINEAR)
}

#[test]
fn every_kind_has_one_name_and_the_examples_cover_them_all() {
    let names: Vec<&str> = kinds().iter().map(|kind| kind.name).collect();
    assert_eq!(names, EXAMPLES.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    assert_eq!(names.iter().collect::<HashSet<_>>().len(), names.len());
}

#[test]
fn every_page_of_the_manual_opens_with_a_formula_and_names_its_source() {
    for kind in kinds() {
        let page = describe(kind.name, &(kind.schema)());
        let about = page.lines().nth(2).unwrap_or_default();
        assert!(about.contains('`'), "{page}");
        assert!(page.contains("Source: ") && page.contains("Range:"), "{page}");
        assert!(page.contains(" better"), "the page states which values are better: {page}");
        let schema = (kind.schema)();
        let options = schema.as_value()["properties"].as_object().expect("a criterion has options").clone();
        assert!(options.values().all(|option| option["description"].is_string()), "{page}");
    }
}

#[test]
fn every_kind_is_read_from_a_study_file_and_has_a_value() {
    let criteria: String = EXAMPLES
        .iter()
        .map(|(name, options)| {
            let model = if is_linear(name) { "linear" } else { "lag" };
            format!("{name} = {{ {name} = {options}, model = '{model}', usage = 'monitor' }}\n")
        })
        .collect();
    let problem = Problem::new(read_study(&criteria).expect("it is a study").into());
    let evaluation = problem.evaluate_at(&problem.study().start());
    assert!(evaluation.failures.is_empty(), "{:?}", evaluation.failures);
    // In the case and in both experiments; criteria over time not in the frequency experiment; criteria of measurements
    // only where one exists.
    let measured = ["fit", "normalised-error", "rmse", "fit-percent", "frequency-fit"].len();
    let linear = EXAMPLES.iter().filter(|(name, _)| is_linear(name)).count() - 1;
    let simulated = EXAMPLES.len() - linear - measured;
    assert_eq!(evaluation.readings.iter().flatten().count(), 2 * simulated + 3 * linear + measured);
}

/// Kind, sense, range, default demand, unit, and the signals or channels that it reads, where the model has the signal
/// `y` in m and the input `u` in m: as the definitions say.
const FACTS: &str = "
    overshoot Less 0..inf - 1 y
    undershoot Less 0..inf - 1 y
    peak Less 0..inf - m y
    settling-time Less 0..inf - s y
    rise-time Less 0..inf - s y
    delay-time Less 0..inf - s y
    steady-state-error Less 0..inf - m y
    final-value Open -inf..inf - m y
    expression Open -inf..inf - m y,y
    ise Less 0..inf - m^2 s y
    iae Less 0..inf - m s y
    itae Less 0..inf - m s^2 y
    itse Less 0..inf - m^2 s^2 y
    control-effort Less 0..inf - m s y
    maximum-rate Less 0..inf - m/s y
    step-envelope Less -inf..inf - m y
    model-tracking Less 0..inf - m y (assumes)
    fit Less 0..inf - m^2 s y
    normalised-error Less 0..inf 1 1 y
    rmse Less 0..inf - m y
    fit-percent More -inf..100 - % y
    gain-margin More -200..200 - dB y
    phase-margin More -3.141592653589793..3.141592653589793 - rad y
    delay-margin More -inf..1000000 - s y
    disk-margin More 0..100 - 1 y
    maximum-sensitivity Less 0..inf - 1 y
    maximum-complementary-sensitivity Less 0..inf - 1 y
    bandwidth More 0..inf - rad/s y
    crossover-frequency Target 0..inf - rad/s y
    damping-ratio More -1..1 - 1 y
    slowest-pole Less -inf..0 - 1/s y
    gain-mask Less 0..inf 1 1 y
    h2-norm Less 0..inf - 1 y
    hinf-norm Less 0..inf - 1 y
    frequency-fit Less 0..inf - 1 y
";

#[test]
fn every_kind_states_its_sense_range_demand_unit_and_signals() {
    let criteria = EXAMPLES.iter().map(|(name, options)| {
        let model = if is_linear(name) { "linear" } else { "lag" };
        format!("{name} = {{ {name} = {options}, model = '{model}', usage = 'monitor' }}\n")
    });
    let study = read_study(&criteria.collect::<String>()).expect("it is a study");
    let fact = |(name, _): &(&str, &str)| {
        let row = study.rows().iter().find(|row| row.name == *name).expect("it is evaluated somewhere");
        let criterion = &row.criterion;
        let [low, high] = criterion.range();
        let demand = criterion.natural_demand().map_or_else(|| "-".to_owned(), |demand| demand.to_string());
        let (sense, unit, signals) = (criterion.sense(), criterion.unit(), criterion.signals().join(","));
        let assumption = if criterion.assumption().is_some() { " (assumes)" } else { "" };
        format!("{name} {sense:?} {low}..{high} {demand} {unit} {signals}{assumption}")
    };
    let found: Vec<String> = EXAMPLES.iter().map(fact).collect();
    let expected: Vec<&str> = FACTS.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    assert_eq!(found, expected, "{}", found.join("\n"));
}

#[test]
fn without_a_target_a_step_assumes_the_last_value_and_says_so() {
    for kind in ["overshoot", "undershoot", "settling-time", "rise-time", "delay-time", "iae"] {
        let band = if kind == "settling-time" { ", relative-band = '2 %'" } else { "" };
        let text = format!("c = {{ {kind} = {{ signal = 'y'{band} }}, model = 'lag', usage = 'monitor' }}");
        let study = read_study(&text).expect("it is a study");
        let assumption = study.rows()[0].criterion.assumption().expect("no target is given");
        assert!(assumption.contains("the value of the signal at the end"), "{kind}: {assumption}");
    }
}

#[test]
fn a_formula_over_a_time_that_was_not_reached_is_missed_by_as_much() {
    // The lag never reaches 2, half of the step to 4.
    let study = |criteria: &str| read_study(criteria).expect("it is a study");
    let of = "slow = { delay-time = { signal = 'y', target = 4, from = 0 }, model = 'lag', usage = 'monitor' }";
    let twice = format!("{of}\ntwice = {{ expression = {{ value = '2*slow' }}, model = 'lag', usage = 'monitor' }}");
    let problem = Problem::new(study(&twice).into());
    let evaluation = problem.evaluate_at(&problem.study().start());
    let read = |name: &str| {
        let row = problem.study().rows().iter().position(|row| row.name == name).expect("it is a row");
        evaluation.readings[row].expect("it is evaluated")
    };
    let (slow, twice) = (read("slow"), read("twice"));
    assert!(slow.value.is_nan() && twice.value.is_nan());
    assert_eq!(twice.note, Some("a criterion in the formula was not reached"));
    // Its size is relative to the time available, so that missed times of different lengths can be added.
    let trace = sampled(6.0, 500, |t| 1.0 - math::exp(-t));
    let analysis = Analysis::Time(Response { traces: vec![("y".into(), trace)], ..Response::default() });
    let value = |row: usize| {
        let row = &problem.study().rows()[row];
        row.criterion.value_with(problem.study().case_of(row), &analysis, &[1.0]).expect("it is missed, not undefined")
    };
    let place = |name: &str| problem.study().rows().iter().position(|row| row.name == name).expect("it is a row");
    let (slow, twice) = (value(place("slow")), value(place("twice")));
    let horizon = slow.missed.and_then(|missed| missed.horizon).expect("a time has a horizon");
    assert!(twice.number == slow.number / horizon && twice.number > 0.0, "{} {}", twice.number, slow.number);
}

#[test]
fn a_criterion_refuses_a_model_of_the_other_sort_and_names_one_that_fits() {
    let wrong =
        read_study("margin = { gain-margin = {}, model = 'lag', usage = 'monitor' }").err().expect("a simulation");
    assert!(wrong.to_string().contains("reads a linear system, but `lag` is simulated"), "{wrong}");
    assert!(wrong.help.unwrap().contains("model = \"linear\""));
    let wrong =
        read_study("top = { peak = { signal = 'y' }, model = 'linear', usage = 'monitor' }").err().expect("linear");
    assert!(wrong.to_string().contains("`linear` is a linear system"), "{wrong}");
    let wrong = read_study("margin = { gain-margin = { input = 'v' }, model = 'linear', usage = 'monitor' }").err();
    let wrong = wrong.expect("no such input");
    assert!(wrong.to_string().contains(":14:36: the model has no input `v`"), "{wrong}");
}

#[test]
fn a_mistake_in_an_option_is_reported_at_its_place() {
    let wrong = read_study("speed = { settling-time = { signal = 'y', band = '3 s' }, model = 'lag', demand = 1 }")
        .err()
        .expect("the unit is wrong");
    assert!(wrong.to_string().contains(":14:50: expected a quantity in `m`, found `s`"), "{wrong}");
}

fn read_study(criteria: &str) -> Result<mops_core::Study, mops_language::Diagnostic> {
    let catalogue = Catalogue { criteria: kinds(), ..Catalogue::default() }
        .with_model(ModelKind::of::<Lag>())
        .with_model(ModelKind::of::<LinearLag>())
        .with_solver(SolverKind::of::<NoSolver>());
    let text = format!(
        "[study]\nname = 'test'\n[models]\nlag = {{ lag = {{}} }}\nlinear = {{ linear-lag = {{}} }}\n[tuners]\nT = {{ start = 1, min = 0.5, max = 2 }}\n\
         [cases]\nstep = {{ horizon = 6 }}\n[experiments]\nlog = {{ file = 'log.csv', channels = {{ y = 'y' }} }}\n\
         sweep = {{ file = 'sweep.csv', frequency = 'f', responses = {{ y = {{ real = 're', imaginary = 'im' }} }} }}\n\
         [criteria]\n{criteria}"
    );
    read(&catalogue, "study.toml", &text, &[], &Data).map(|file| file.study)
}

/// Measurement of all tests.
struct Data;

impl Files for Data {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        if path == "sweep.csv" {
            return Ok(b"f [Hz],re,im\n0.1,2,-1\n0.2,1,-1\n".to_vec());
        }
        Ok(b"time [s],y [m]\n0,0\n2,0.8\n4,1.0\n".to_vec())
    }

    fn show(&self, path: &str) -> String {
        path.to_owned()
    }
}

/// First-order lag, `y = 1 - exp(-t/T)`.
#[derive(Deserialize, JsonSchema)]
struct Lag {}

struct LagModel(Interface);

impl ModelOptions for Lag {
    const KIND: &'static str = "lag";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        let signals = vec![Variable::new("y", "m", "output")];
        let parameters = vec![mops_core::Parameter::new("T", "s", "time constant")];
        Ok(Box::new(LagModel(Interface { signals, parameters, ..Interface::default() })))
    }
}

impl Model for LagModel {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let trace: Trace = sampled(job.horizon, 500, |t| 1.0 - math::exp(-t / job.parameters[0]));
        Ok(Analysis::Time(Response { traces: vec![("y".into(), trace)], ..Response::default() }))
    }
}

/// Linear system `3/((T s + 1)(s + 1))`.
#[derive(Deserialize, JsonSchema)]
struct LinearLag {}

struct LinearLagModel(Interface);

impl ModelOptions for LinearLag {
    const KIND: &'static str = "linear-lag";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        Ok(Box::new(LinearLagModel(Interface {
            signals: vec![Variable::new("y", "m", "output")],
            inputs: vec![Variable::new("u", "m", "input")],
            parameters: vec![mops_core::Parameter::new("T", "s", "time constant")],
            analysis: AnalysisKind::Linear,
            ..Interface::default()
        })))
    }
}

impl Model for LinearLagModel {
    fn interface(&self) -> &Interface {
        &self.0
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let t = job.parameters[0];
        Ok(crate::testing::linear(&[3.0], &[t, 1.0 + t, 1.0]))
    }
}

/// Solver for the catalogue of study files; these tests never run it.
#[derive(Deserialize, JsonSchema)]
struct NoSolver {}

impl SolverOptions for NoSolver {
    const KIND: &'static str = "none";

    fn build(&self) -> Box<dyn Solver> {
        unreachable!("no study is run")
    }
}
