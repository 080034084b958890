//! Experiments: what was measured, and what is unknown of each.

use mops_core::{
    Case, Model, Role, Study, StudyError,
    case::Channel,
    study::{JobPlan, ParameterSource},
};

use super::hygiene::without_spikes;
use super::sensor_noise::SensorNoise;

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
    /// True if the study does not give it.
    pub is_noise_estimated: bool,
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

impl Measurement {
    /// Returns the experiment of a job, without samples that stand alone; notes say of how many.
    ///
    /// # Errors
    /// A channel whose noise is neither given nor can be estimated.
    pub fn new(
        study: &Study,
        job: usize,
        model: &dyn Model,
        noise: &SensorNoise,
        notes: &mut Vec<String>,
    ) -> Result<Self, StudyError> {
        let plan = &study.jobs()[job];
        let case = &study.cases()[plan.case];
        let experiment = case.experiment.as_ref().expect("it was looked for");
        let series = experiment.channels.iter().map(|channel| Series::new(channel, case, model, noise, notes));
        let series: Vec<Series> = series.collect::<Result<_, _>>()?;
        Ok(Self {
            name: case.name.clone(),
            role: experiment.role,
            horizon: series.iter().filter_map(|s| s.times.last().copied()).fold(0.0, f64::max),
            case: case.clone(),
            job,
            locals: locals(study, plan, model),
            series,
        })
    }
}

impl Series {
    /// Returns series, each with its part of values that stand one series after the other.
    pub fn with_parts<'v>(all: &'v [Self], values: &'v [f64]) -> impl Iterator<Item = (&'v Self, &'v [f64])> {
        let mut rest = values;
        all.iter().map(move |series| {
            let (own, others) = rest.split_at(series.times.len());
            rest = others;
            (series, own)
        })
    }

    fn new(
        channel: &Channel,
        case: &Case,
        model: &dyn Model,
        noise: &SensorNoise,
        notes: &mut Vec<String>,
    ) -> Result<Self, StudyError> {
        let signals = &model.interface().signals;
        let signal = signals.iter().position(|s| s.name == channel.signal).expect("checked by the study");
        let estimate = noise.estimate(&channel.signal);
        let noise = channel.noise.or(estimate).ok_or_else(|| {
            let fact = "the noise cannot be estimated from too few samples, or from samples that never change";
            StudyError::new(format!("experiments.{}.channels.{}", case.name, channel.signal), fact)
                .with_help("give its `noise`, the standard deviation")
        })?;
        let largest = estimate.map_or(noise, |estimate| noise.max(estimate));
        let (times, values, dropped) = without_spikes(&channel.times, &channel.values, largest);
        if dropped > 0 {
            let (samples, are) = match dropped {
                1 => ("sample", "stands alone, far from its neighbours, and is"),
                _ => ("samples", "stand alone, far from their neighbours, and are"),
            };
            notes.push(format!("{dropped} {samples} of `{}` in `{}` {are} left out", channel.signal, case.name));
        }
        Ok(Self {
            signal,
            name: channel.signal.clone(),
            unit: signals[signal].unit.to_string(),
            times,
            values,
            noise,
            is_noise_estimated: channel.noise.is_none(),
        })
    }
}

/// Returns the unknowns of the experiment of a job.
fn locals(study: &Study, plan: &JobPlan, model: &dyn Model) -> Vec<Local> {
    let local = |(parameter, source): (usize, &ParameterSource)| {
        let ParameterSource::Tuner { tuner, factor } = *source else { return None };
        let tuner = &study.tuners()[tuner];
        if tuner.case != Some(plan.case) || !tuner.active || tuner.tie.is_some() {
            return None;
        }
        let mut bounds = tuner.bounds.map(|b| b * factor);
        let scale = ((bounds[1] - bounds[0]) / 20.0).abs();
        // A sensor that saturates or is off lets a start value lie far from what it shows.
        for (end, _) in tuner.guessed.iter().enumerate().filter(|(_, guessed)| **guessed) {
            bounds[end] = model.interface().parameters[parameter].range[end];
        }
        Some(Local { parameter, bounds, start: tuner.start * factor, scale })
    };
    plan.parameters.iter().enumerate().filter_map(local).collect()
}
