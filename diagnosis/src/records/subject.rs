//! What is diagnosed: the model, its unknowns, and the experiments, taken from a study.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use mops_core::{
    Case, Job, Model, Role, Study, StudyError,
    effect::Port,
    study::{ParameterSource, Scale},
    task::DiagnosisTask,
};
use mops_language::{Dual, Scalar};

use super::hygiene::{noise_of, without_spikes};
use crate::settings::Settings;

/// Error of a step of a simulation, noises. Basis: an error of a few hundredths of the noise is indistinguishable from
/// it.
const STEP_ERROR: f64 = 0.03;

/// Loosest relative tolerance of a simulation. Basis: an assumption.
const LOOSEST: f64 = 1e-5;

/// A measured signal.
#[derive(Debug, Clone)]
pub struct Series {
    /// The signal, by its index in the interface of the model.
    pub signal: usize,
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// Samples, in the unit of the signal.
    pub values: Vec<f64>,
    /// Standard deviation of the noise.
    pub noise: f64,
}

/// An unknown of one experiment: a parameter of the model.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// Its index among the parameters of the model.
    pub parameter: usize,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
    /// First guess.
    pub start: f64,
    /// Typical size of a change.
    pub scale: f64,
}

/// An experiment.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Name.
    pub name: String,
    /// Role.
    pub role: Role,
    /// Inputs.
    pub case: Case,
    /// Index into the jobs of the study.
    pub job: usize,
    /// What is unknown of it: start values.
    pub locals: Vec<Local>,
    /// What was measured.
    pub series: Vec<Series>,
    /// Its end, s.
    pub horizon: f64,
}

/// What is diagnosed.
#[derive(Clone)]
pub struct Subject {
    /// The study.
    pub study: Arc<Study>,
    /// The model as declared.
    pub model: Arc<dyn Model>,
    /// Unknown tuners of the whole study, by index.
    pub globals: Vec<usize>,
    /// The experiments.
    pub measurements: Vec<Measurement>,
    /// What a reader should know of the data.
    pub notes: Vec<String>,
    /// Steps that a simulation of the declared model takes in a second of its time, once that is calibrated.
    pub pace: OnceLock<f64>,
    /// Relative tolerance of simulations.
    pub tolerance: f64,
    /// Settings of the diagnosis.
    pub settings: Settings,
}

/// Returns the relative tolerance of simulations that the noise of the most precise sensor, relative to its largest
/// value, wants.
fn tolerance(measurements: &[Measurement]) -> f64 {
    let of = |s: &Series| s.noise / s.values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let finest = measurements.iter().flat_map(|m| &m.series).map(of).fold(f64::INFINITY, f64::min);
    (STEP_ERROR * finest).min(LOOSEST)
}

/// Returns the options of the diagnosis of a study.
pub(crate) fn task_of(study: &Study) -> DiagnosisTask {
    study.options::<DiagnosisTask>().cloned().unwrap_or_default()
}

impl Subject {
    /// Takes it from a study.
    ///
    /// # Errors
    /// No experiment for calibration, no channels, several models, or a model without places for effects or without a
    /// linearisation.
    pub fn new(study: &Study, settings: &Settings) -> Result<Self, StudyError> {
        let measured = |job: &usize| {
            let case = &study.cases()[study.jobs()[*job].case];
            case.experiment.as_ref().is_some_and(|e| !e.channels.is_empty())
        };
        let jobs: Vec<usize> = (0..study.jobs().len()).filter(measured).collect();
        let Some(&first) = jobs.first() else {
            return Err(StudyError::new("experiments", "a diagnosis needs measured channels")
                .with_help("add an experiment with `channels`"));
        };
        let index = study.jobs()[first].model;
        if jobs.iter().any(|&job| study.jobs()[job].model != index) {
            return Err(StudyError::new(
                "models",
                "a diagnosis looks at one model, and the experiments belong to several",
            )
            .with_help("keep one model in the study"));
        }
        let (name, model) = &study.models()[index];
        if let Some(why) = model.not_linear() {
            let fact = format!("the model `{name}` cannot be diagnosed: {why}");
            return Err(StudyError::new("models", fact).with_help("calibrate it with `mops run`"));
        }
        if model.ported().is_none() && model.augmented().is_none() {
            let fact = format!("the model `{name}` does not open its equations: no effect can be added to it");
            return Err(
                StudyError::new("models", fact).with_help("`mops check` lists the places of the models of a study")
            );
        }
        let globals: Vec<usize> = (0..study.tuners().len())
            .filter(|&i| {
                study.tuners()[i].case.is_none() && study.tuners()[i].active && study.tuners()[i].tie.is_none()
            })
            .collect();
        let mut notes = Vec::new();
        let channels = || {
            let cases = jobs.iter().map(|&job| &study.cases()[study.jobs()[job].case]);
            cases.flat_map(|case| case.experiment.iter().flat_map(|e| &e.channels).map(move |channel| (case, channel)))
        };
        // One noise for each sensor, for all experiments that give none. Validation decides nothing, unless there is
        // nothing else.
        let estimated = |signal: &str| {
            let of_roles = |only_validation: bool| {
                let is_of = |case: &Case| {
                    case.experiment.as_ref().is_some_and(|e| (e.role == Role::Validation) == only_validation)
                };
                let of = channels().filter(|(case, channel)| channel.signal == signal && is_of(case));
                let records: Vec<(&[f64], &[f64])> = of.map(|(_, c)| (&c.times[..], &c.values[..])).collect();
                noise_of(&records)
            };
            of_roles(false).or_else(|| of_roles(true))
        };
        let mut estimates: BTreeMap<&str, Option<f64>> = BTreeMap::new();
        for (_, channel) in channels() {
            estimates.entry(&channel.signal).or_insert_with(|| estimated(&channel.signal));
        }
        let mut measurements = Vec::new();
        for &job in &jobs {
            let plan = &study.jobs()[job];
            let case = &study.cases()[plan.case];
            let experiment = case.experiment.as_ref().expect("it was looked for");
            let mut series = Vec::new();
            for channel in &experiment.channels {
                let signals = &model.interface().signals;
                let signal = signals.iter().position(|s| s.name == channel.signal).expect("checked by the study");
                let estimate = estimates[channel.signal.as_str()];
                let noise = channel.noise.or(estimate).ok_or_else(|| {
                    let fact = "the noise cannot be estimated from too few samples, or from samples that never change";
                    StudyError::new(format!("experiments.{}.channels.{}", case.name, channel.signal), fact)
                        .with_help("give its `noise`, the standard deviation")
                })?;
                let largest = estimate.map_or(noise, |estimate| noise.max(estimate));
                let (times, values, dropped) = without_spikes(&channel.times, &channel.values, largest);
                if dropped > 0 {
                    let (samples, are) = if dropped == 1 {
                        ("sample", "stands alone, far from its neighbours, and is")
                    } else {
                        ("samples", "stand alone, far from their neighbours, and are")
                    };
                    notes
                        .push(format!("{dropped} {samples} of `{}` in `{}` {are} left out", channel.signal, case.name));
                }
                let (name, unit) = (channel.signal.clone(), signals[signal].unit.to_string());
                series.push(Series { signal, name, unit, times, values, noise });
            }
            let horizon = series.iter().filter_map(|s| s.times.last().copied()).fold(0.0, f64::max);
            let mut locals = Vec::new();
            for (parameter, source) in plan.parameters.iter().enumerate() {
                let ParameterSource::Tuner { tuner, factor } = *source else { continue };
                let t = &study.tuners()[tuner];
                if t.case == Some(plan.case) && t.active && t.tie.is_none() {
                    let mut bounds = t.bounds.map(|b| b * factor);
                    let scale = ((bounds[1] - bounds[0]) / 20.0).abs();
                    // A sensor that saturates or is off lets a start value lie far from what it shows.
                    for (end, _) in t.guessed.iter().enumerate().filter(|(_, guessed)| **guessed) {
                        bounds[end] = model.interface().parameters[parameter].range[end];
                    }
                    locals.push(Local { parameter, bounds, start: t.start * factor, scale });
                }
            }
            let case = case.clone();
            measurements.push(Measurement {
                name: case.name.clone(),
                role: experiment.role,
                case,
                job,
                locals,
                series,
                horizon,
            });
        }
        for (signal, noise) in estimates.iter().filter_map(|(signal, noise)| Some((signal, (*noise)?))) {
            let without: Vec<&str> = channels()
                .filter(|(_, channel)| channel.signal == *signal && channel.noise.is_none())
                .map(|(case, _)| case.name.as_str())
                .collect();
            let Some(unit) = model.interface().signals.iter().find(|s| s.name == *signal).map(|s| &s.unit) else {
                continue;
            };
            let experiments = match (without.len(), measurements.len()) {
                (0, _) => continue,
                (1, 1) => String::new(),
                (count, all) if count == all => format!(" of {count} experiments"),
                _ => format!(" of {}", without.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")),
            };
            notes.push(format!(
                "the noise of `{signal}` was estimated from neighbouring samples{experiments}: {noise:.3e} {unit}"
            ));
        }
        let parameters = study.parameters(&study.jobs()[first], &study.start());
        if model.clocks(&parameters).is_ok_and(|clocks| !clocks.is_empty()) {
            notes.push("windows of a record start with the phase of each clock; its memory is fitted".to_owned());
        }
        if model.delays(&parameters).is_ok_and(|delays| !delays.is_empty()) {
            notes.push(
                "before a window of a record, delayed inputs have their recorded values, and delayed states those at its start"
                    .to_owned(),
            );
        }
        if !measurements.iter().any(|m| m.role == Role::Calibration) {
            return Err(StudyError::new("experiments", "no experiment is for calibration")
                .with_help("give one the role \"calibration\""));
        }
        Ok(Self {
            study: Arc::new(study.clone()),
            model: Arc::clone(model),
            globals,
            tolerance: tolerance(&measurements),
            measurements,
            notes,
            pace: OnceLock::new(),
            settings: settings.clone(),
        })
    }

    /// Whether the position of a joint, the state of a process, or a signal is measured.
    pub fn is_measured(&self, port: &Port) -> bool {
        let (Port::Joint { position: name, .. } | Port::Process { state: name, .. } | Port::Sensor { output: name }) =
            port
        else {
            return false;
        };
        self.measurements.iter().flat_map(|m| &m.series).any(|series| series.name == *name)
    }

    /// Notes how many steps the declared model takes with these globals: candidates are allowed as many, and more.
    #[allow(clippy::cast_precision_loss)]
    pub fn take_pace(&self, globals: &[f64]) {
        let of = |(index, m): (usize, &Measurement)| {
            let parameters = self.parameters(index, globals);
            let job = Job { case: &m.case, parameters: &parameters, signals: &[], horizon: m.horizon };
            let analysis = self.model.analyse(&job).ok()?;
            Some(analysis.response()?.work.steps as f64 / m.horizon)
        };
        let fastest = self.measurements.iter().enumerate().filter_map(of).fold(0.0, f64::max);
        self.pace.get_or_init(|| fastest);
    }

    /// Start values of the global unknowns.
    pub fn start(&self) -> Vec<f64> {
        self.globals.iter().map(|&g| self.study.tuners()[g].start).collect()
    }

    /// Whether an unknown is looked for in its logarithm.
    pub fn is_log(&self, global: usize) -> bool {
        self.study.tuners()[self.globals[global]].scale == Scale::Log
    }

    /// Values of all tuners for given globals; those of cases at their start.
    fn tuners(&self, globals: &[f64]) -> Vec<f64> {
        let mut tuners: Vec<f64> = self.study.tuners().iter().map(|t| t.start).collect();
        self.globals.iter().zip(globals).for_each(|(&g, &value)| tuners[g] = value);
        self.study.apply_ties(&mut tuners);
        tuners
    }

    /// The parameters of the declared model in an experiment, its locals at their start.
    pub fn parameters(&self, measurement: usize, globals: &[f64]) -> Vec<f64> {
        self.study.parameters(&self.study.jobs()[self.measurements[measurement].job], &self.tuners(globals))
    }

    /// The derivative of these by one of the globals.
    pub fn slopes(&self, measurement: usize, globals: &[f64], global: usize) -> Vec<f64> {
        let mut tuners: Vec<Dual<1>> = self.study.tuners().iter().map(|t| Dual::from(t.start)).collect();
        for (i, (&g, &value)) in self.globals.iter().zip(globals).enumerate() {
            tuners[g] = if i == global { Dual::variable(value, 0) } else { Dual::from(value) };
        }
        self.study.apply_ties(&mut tuners);
        let job = &self.study.jobs()[self.measurements[measurement].job];
        let tangents: Vec<f64> = tuners.iter().map(|t| t.tangents()[0]).collect();
        self.study.parameter_slopes(job, &tangents)
    }
}
