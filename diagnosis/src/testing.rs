//! Subjects for tests: a model from text, and records that the test computes by itself.

use std::sync::{Arc, OnceLock};

use mops_core::{
    Case, Effect, Input, Model, ModelOptions, Role, Study,
    case::{Channel, Experiment},
    study::{Grid, JobPlan, ParameterSource, Scale, Tuner},
    task::DiagnosisTask,
};
use mops_effects::effects;
use mops_language::Unit;
use mops_math as math;
use mops_math::stream;
use mops_models::equations::EquationsOptions;

use crate::estimation::Errors;
use crate::fit::pieces::{first_locals, pieces};
use crate::fit::{Fit, Meter, Point, Variant, problem};
use crate::motion::Trajectory;
use crate::records::{Local, Measurement, SensorNoise, Series, Subject};
use crate::selection::{FittedSets, Forecasts, Screening, Verdict, decide, estimation, prepare, with_given};
use crate::settings::Settings;

/// A measured experiment.
pub struct Record {
    /// Inputs by name.
    pub inputs: Vec<(&'static str, Input)>,
    /// Times of all samples, s.
    pub times: Vec<f64>,
    /// Signals: name, samples, noise.
    pub signals: Vec<(&'static str, Vec<f64>, f64)>,
}

impl Record {
    /// A record without inputs of the first of two states at evenly spaced times, with white noise.
    pub fn of_first(signal: &'static str, states: &[[f64; 2]], step: f64, noise: f64, label: &str) -> Self {
        #[allow(clippy::cast_precision_loss)]
        let times = (0..states.len()).map(|k| k as f64 * step).collect();
        let values = states.iter().zip(white(label, noise, states.len())).map(|(s, e)| s[0] + e).collect();
        Self { inputs: Vec::new(), times, signals: vec![(signal, values, noise)] }
    }
}

/// A model by its equations.
pub fn model(text: &str) -> Arc<dyn Model> {
    let options: EquationsOptions = toml::from_str(text).expect("it is TOML");
    Arc::from(options.build().expect("it is a model"))
}

/// A subject with every parameter of the model unknown, those at the end named in `starts` for each record.
pub fn subject(text: &str, parameters: &[f64], starts: usize, records: Vec<Record>) -> Subject {
    let model = model(text);
    let globals = parameters.len() - starts;
    let tuner = |(k, &start): (usize, &f64)| Tuner {
        name: model.interface().parameters[k].variable.name.clone(),
        parameter: model.interface().parameters[k].variable.name.clone(),
        start,
        bounds: [start - 10.0 * start.abs(), start + 10.0 * start.abs()],
        scale: Scale::Linear,
        grid: Grid::Continuous,
        unit: Unit::one(),
        case: None,
        active: true,
        tie: None,
        guessed: [false; 2],
    };
    let source = |(k, &value): (usize, &f64)| {
        if k < globals { ParameterSource::Tuner { tuner: k, factor: 1.0 } } else { ParameterSource::Constant(value) }
    };
    let local = |k: usize| Local { parameter: k, bounds: [-100.0, 100.0], start: parameters[k], scale: 0.1 };
    let (mut measurements, mut jobs, mut cases) = (Vec::new(), Vec::new(), Vec::new());
    for (index, record) in records.into_iter().enumerate() {
        let inputs = record.inputs.into_iter().map(|(name, input)| (name.to_owned(), input)).collect();
        let case = Case { name: format!("record {index}"), inputs, ..Case::default() };
        let horizon = record.times[record.times.len() - 1];
        let series = record.signals.into_iter().map(|(name, values, noise)| Series {
            signal: model.interface().signals.iter().position(|s| s.name == name).expect("the model has it"),
            name: name.to_owned(),
            unit: String::new(),
            times: record.times.clone(),
            values,
            noise,
            is_noise_estimated: false,
        });
        measurements.push(Measurement {
            name: case.name.clone(),
            role: Role::Calibration,
            case: case.clone(),
            job: index,
            locals: (globals..parameters.len()).map(local).collect(),
            series: series.collect(),
            horizon,
        });
        let parameters = parameters.iter().enumerate().map(source).collect();
        jobs.push(JobPlan { model: 0, case: index, parameters, signals: Vec::new(), horizon });
        cases.push(case);
    }
    let study = Study::unchecked(
        DiagnosisTask::default().into(),
        vec![("plant".to_owned(), Arc::clone(&model))],
        cases,
        parameters[..globals].iter().enumerate().map(tuner).collect(),
        jobs,
    );
    Subject {
        study: Arc::new(study),
        model,
        globals: (0..globals).collect(),
        measurements,
        notes: Vec::new(),
        sensor_noise: SensorNoise::default(),
        pace: OnceLock::new(),
        tolerance: 0.0,
        settings: Settings::default(),
    }
}

/// Parts of a study that a test may change.
pub struct Parts {
    pub task: DiagnosisTask,
    pub cases: Vec<Case>,
    pub tuners: Vec<Tuner>,
    pub jobs: Vec<JobPlan>,
}

impl Parts {
    /// The parts of the study that a subject could have been taken from.
    pub fn of(subject: &Subject) -> Self {
        let study = &subject.study;
        let (mut cases, mut tuners, mut jobs) =
            (study.cases().to_vec(), study.tuners().to_vec(), study.jobs().to_vec());
        for (index, m) in subject.measurements.iter().enumerate() {
            let channel = |s: &Series| Channel {
                signal: s.name.clone(),
                times: s.times.clone(),
                values: s.values.clone(),
                noise: Some(s.noise),
            };
            let channels = m.series.iter().map(channel).collect();
            cases[index].experiment = Some(Experiment { channels, role: m.role, ..Experiment::default() });
            for local in &m.locals {
                jobs[index].parameters[local.parameter] = ParameterSource::Tuner { tuner: tuners.len(), factor: 1.0 };
                let parameter = subject.model.interface().parameters[local.parameter].variable.name.clone();
                tuners.push(Tuner {
                    name: format!("{}/{parameter}", m.name),
                    parameter,
                    start: local.start,
                    bounds: local.bounds,
                    scale: Scale::Linear,
                    grid: Grid::Continuous,
                    unit: Unit::one(),
                    case: Some(index),
                    active: true,
                    tie: None,
                    guessed: [false; 2],
                });
            }
        }
        Self { task: DiagnosisTask::default(), cases, tuners, jobs }
    }

    /// The study of these parts and the model of a subject.
    pub fn study(self, subject: &Subject) -> Study {
        let models = vec![("plant".to_owned(), Arc::clone(&subject.model))];
        Study::unchecked(self.task.into(), models, self.cases, self.tuners, self.jobs)
    }
}

/// The study that a subject could have been taken from.
pub fn study(subject: &Subject) -> Study {
    Parts::of(subject).study(subject)
}

/// The subject's model fitted to its records by least squares, and the motion there.
pub fn fitted<'a>(subject: &'a Subject, simulations: &'a Meter<'a>) -> (Fit<'a>, Variant, Point, Vec<Trajectory>) {
    let pieces = pieces(subject, |_| true);
    let locals = first_locals(&pieces);
    let (fit, point, variant) = problem(subject, &[], pieces, &subject.start(), locals, &[], simulations);
    let found = estimation(subject, &fit, &variant, &[], &[], &point).least_squares(point).expect("it simulates");
    let along = |piece: usize| Trajectory::new(&fit, &variant.model, piece, &found.point).expect("it simulates");
    let trajectories = (0..fit.pieces.len()).map(along).collect();
    (fit, variant, found.point, trajectories)
}

/// Searches the sets of effects of a subject, two at most, and decides on them.
pub fn selected<T>(
    subject: &Subject,
    effects: &[Arc<dyn Effect>],
    look: impl FnOnce(&FittedSets<'_, '_>, &Forecasts, &Verdict) -> T,
) -> T {
    let simulations = Meter::new(&());
    let (refit, declared) = prepare(subject, effects, &simulations).expect("it simulates");
    let sets = with_given(&refit, declared, &[], 2, 0.05).expect("it is fitted");
    let (sets, forecasts) = Forecasts::of(sets.with_single_effects().searched());
    let verdict = decide(&sets, &forecasts);
    look(&sets, &forecasts, &verdict)
}

/// Screens effects on the fitted model of a subject; returns them, the best first, with their gains in log-likelihood
/// in white noise, nats.
pub fn screened(subject: &Subject, effects: &[Arc<dyn Effect>], simulations: &Meter<'_>) -> Vec<(String, f64)> {
    let (refit, declared) = prepare(subject, effects, simulations).expect("it simulates");
    let white = [Errors::White];
    let all: Vec<usize> = (0..refit.candidates.len()).collect();
    let screened = Screening::new(&declared, &white).expect("it simulates").screen(&refit.candidates, &all);
    screened.iter().map(|s| (refit.candidates[s.index].effect.name().to_owned(), s.gains[0])).collect()
}

/// The effects of these names.
pub fn catalogue(names: &[&str]) -> Vec<Arc<dyn Effect>> {
    effects().into_iter().filter(|e| names.contains(&e.name())).collect()
}

/// White noise.
pub fn white(label: &str, size: f64, count: usize) -> Vec<f64> {
    let mut random = stream(7, label);
    (0..count).map(|_| size * math::normal(&mut random)).collect()
}

/// States at evenly spaced times by the classical Runge-Kutta method, 20 steps between samples.
pub fn integrated<const N: usize>(
    rates: impl Fn(f64, &[f64; N]) -> [f64; N],
    start: [f64; N],
    step: f64,
    count: usize,
) -> Vec<[f64; N]> {
    const PARTS: u32 = 20;
    let h = step / f64::from(PARTS);
    let mut x = start;
    let mut all = vec![x];
    for k in 1..count {
        for part in 0..PARTS {
            #[allow(clippy::cast_precision_loss)]
            let t = (k - 1) as f64 * step + f64::from(part) * h;
            let moved = |by: f64, slope: &[f64; N]| std::array::from_fn(|i| x[i] + by * slope[i]);
            // Just inside the step, so that what jumps at its ends is taken from within.
            let k1 = rates(t + 1e-3 * h, &x);
            let k2 = rates(t + 0.5 * h, &moved(0.5 * h, &k1));
            let k3 = rates(t + 0.5 * h, &moved(0.5 * h, &k2));
            let k4 = rates(t + (1.0 - 1e-3) * h, &moved(h, &k3));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        all.push(x);
    }
    all
}
