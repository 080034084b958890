//! What is diagnosed: the model, its unknowns, and the experiments, taken from a study.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use mops_core::{
    Job, Model, Role, Study, StudyError,
    effect::Port,
    study::{Scale, Tuner},
    task::DiagnosisTask,
};
use mops_language::{Dual, Scalar};

use super::hygiene::noise_beside;
use super::measurement::{Measurement, Series};
use super::sensor_noise::SensorNoise;
use crate::settings::Settings;

/// Error of a step of a simulation, noises. Basis: an error of a few hundredths of the noise is indistinguishable from
/// it.
const STEP_ERROR: f64 = 0.03;

/// Loosest relative tolerance of a simulation. Basis: an assumption.
const LOOSEST: f64 = 1e-5;

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
    /// Noise of the sensors that the study does not give.
    pub sensor_noise: SensorNoise,
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

/// Returns the jobs of a study with measured channels, and the index of their model.
fn jobs_of(study: &Study) -> Result<(Vec<usize>, usize), StudyError> {
    let is_measured = |job: &usize| {
        let case = &study.cases()[study.jobs()[*job].case];
        case.experiment.as_ref().is_some_and(|e| !e.channels.is_empty())
    };
    let jobs: Vec<usize> = (0..study.jobs().len()).filter(is_measured).collect();
    let Some(&first) = jobs.first() else {
        return Err(StudyError::new("experiments", "a diagnosis needs measured channels")
            .with_help("add an experiment with `channels`"));
    };
    let index = study.jobs()[first].model;
    if jobs.iter().any(|&job| study.jobs()[job].model != index) {
        let fact = "a diagnosis looks at one model, and the experiments belong to several";
        return Err(StudyError::new("models", fact).with_help("keep one model in the study"));
    }
    Ok((jobs, index))
}

/// Checks that effects can be added to a model, and that it has a linear system along a motion.
fn check(name: &str, model: &dyn Model) -> Result<(), StudyError> {
    if let Some(why) = model.not_linear() {
        let fact = format!("the model `{name}` cannot be diagnosed: {why}");
        return Err(StudyError::new("models", fact).with_help("calibrate it with `mops run`"));
    }
    if model.ported().is_none() && model.augmented().is_none() {
        let fact = format!("the model `{name}` does not open its equations: no effect can be added to it");
        return Err(StudyError::new("models", fact).with_help("`mops check` lists the places of the models of a study"));
    }
    Ok(())
}

/// Returns what a reader should know of the windows of records, given the parameters of the model.
fn notes_on_windows(model: &dyn Model, parameters: &[f64]) -> Vec<String> {
    let mut notes = Vec::new();
    if model.clocks(parameters).is_ok_and(|clocks| !clocks.is_empty()) {
        notes.push("windows of a record start with the phase of each clock; its memory is fitted".to_owned());
    }
    if model.delays(parameters).is_ok_and(|delays| !delays.is_empty()) {
        notes.push(
            "before a window of a record, delayed inputs have their recorded values, and delayed states those at its start"
                .to_owned(),
        );
    }
    notes
}

impl Subject {
    /// Takes it from a study.
    ///
    /// # Errors
    /// No experiment for calibration, no channels, several models, or a model without places for effects or without a
    /// linearisation.
    pub fn new(study: &Study, settings: &Settings) -> Result<Self, StudyError> {
        let (jobs, index) = jobs_of(study)?;
        let (name, model) = &study.models()[index];
        check(name, model.as_ref())?;
        let is_global = |tuner: &Tuner| tuner.case.is_none() && tuner.active && tuner.tie.is_none();
        let globals = (0..study.tuners().len()).filter(|&i| is_global(&study.tuners()[i])).collect();
        let noise = SensorNoise::of(study, &jobs);
        let mut notes = Vec::new();
        let measurements: Vec<Measurement> = jobs
            .iter()
            .map(|&job| Measurement::new(study, job, model.as_ref(), &noise, &mut notes))
            .collect::<Result<_, _>>()?;
        notes.extend(notes_on_windows(model.as_ref(), &study.parameters(&study.jobs()[jobs[0]], &study.start())));
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
            sensor_noise: noise,
            pace: OnceLock::new(),
            settings: settings.clone(),
        })
    }

    /// Returns what a reader should know of the data: all notes.
    pub fn all_notes(&self) -> Vec<String> {
        let jobs: Vec<usize> = self.measurements.iter().map(|m| m.job).collect();
        let of_noise = self.sensor_noise.notes(&self.study, &jobs, self.model.interface());
        self.notes.iter().cloned().chain(of_noise).collect()
    }

    /// Whether a noise was estimated.
    pub fn has_estimated_noise(&self) -> bool {
        self.measurements.iter().flat_map(|m| &m.series).any(|series| series.is_noise_estimated)
    }

    /// Returns it with the noise that the study does not give estimated again, from the residuals of the declared model
    /// in some records, in noises.
    #[must_use]
    pub fn with_motion_removed(mut self, residuals: &[(usize, Vec<f64>)]) -> Self {
        let mut left: BTreeMap<String, Vec<(&Series, Vec<f64>)>> = BTreeMap::new();
        for (measurement, residuals) in residuals {
            for (series, own) in Series::with_parts(&self.measurements[*measurement].series, residuals) {
                let own = own.iter().map(|r| r * series.noise).collect();
                left.entry(series.name.clone()).or_default().push((series, own));
            }
        }
        let mut noise = self.sensor_noise.clone();
        for (signal, records) in &left {
            let [samples, left]: [Vec<(&[f64], &[f64])>; 2] = [
                records.iter().map(|(series, _)| (&series.times[..], &series.values[..])).collect(),
                records.iter().map(|(series, left)| (&series.times[..], &left[..])).collect(),
            ];
            noise.improve(signal, noise_beside(&samples, &left));
        }
        for series in self.measurements.iter_mut().flat_map(|m| &mut m.series).filter(|s| s.is_noise_estimated) {
            series.noise = noise.estimate(&series.name).unwrap_or(series.noise);
        }
        self.sensor_noise = noise;
        self.tolerance = tolerance(&self.measurements);
        self
    }

    /// Whether the position of a joint, the state of a process, or a signal is measured.
    pub fn is_measured(&self, port: &Port) -> bool {
        let (Port::Joint { position: name, .. }
        | Port::Speed { state: name, .. }
        | Port::Process { state: name, .. }
        | Port::Sensor { output: name }) = port
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
