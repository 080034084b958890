//! Simulated experiments: models in closed form, noise of a fixed seed, and the study that calibrates them.

use mops::{
    Analysis, CaseBuilder, CriterionBuilder, Failure, Interface, Model, ModelBuilder, Options, Outcome, Parameter,
    StudyBuilder, Trace, TunerBuilder, Variable,
    core::{
        Job, Response, Role,
        model::WithTangents,
        study::{ChannelBuilder, Measured},
        task::{CalibrationTask, UncertaintyTask},
    },
    criteria::{fit::Fit, normalised_error::NormalisedError},
    math::stream,
    outcome::ParameterReport,
};
use mops_math as math;
use rand::Rng;

/// The normalised error of a signal, as a criterion.
pub fn normalised(signal: &str) -> CriterionBuilder {
    CriterionBuilder::minimise(NormalisedError { signal: signal.into(), ..NormalisedError::default() }, 1.0)
}

/// The fit of a signal, as a criterion.
pub fn fit(signal: &str) -> CriterionBuilder {
    CriterionBuilder::minimise(Fit { signal: signal.into(), ..Fit::default() }, 1.0)
}

/// Two lines with a common slope: `y = a + slope t`, `z = b + slope t`.
pub fn lines() -> ModelBuilder {
    let (constant, time, none) = ([1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, 0.0], [0.0; 5]);
    let signals = [("y", vec![constant, none, time]), ("z", vec![none, constant, time])];
    Polynomials::new(&["a", "b", "slope"], &signals).into()
}

/// Signals that are sums of parameters times polynomials of the time.
pub struct Polynomials {
    interface: Interface,
    /// Coefficients of `t^0 ... t^4` for every signal and parameter.
    terms: Vec<Vec<[f64; 5]>>,
}

impl Polynomials {
    pub fn new(parameters: &[&str], signals: &[(&str, Vec<[f64; 5]>)]) -> Self {
        let interface = interface(parameters, &signals.iter().map(|(name, _)| *name).collect::<Vec<_>>());
        Self { interface, terms: signals.iter().map(|(_, terms)| terms.clone()).collect() }
    }

    fn response(&self, job: &Job<'_>, parameters: &[f64]) -> Analysis {
        let trace = |&i: &usize| {
            let mut trace = Trace::starting_at(0.0, 1);
            let coefficient = |power: usize| {
                let sum: f64 = self.terms[i].iter().zip(parameters).map(|(term, p)| p * term[power]).sum();
                sum * math::powi(job.horizon, i32::try_from(power).unwrap())
            };
            trace.push_polynomial(job.horizon, [0, 1, 2, 3, 4].map(coefficient));
            (self.interface.signals[i].name.clone(), trace)
        };
        Analysis::Time(Response { traces: job.signals.iter().map(trace).collect(), ..Response::default() })
    }
}

impl Model for Polynomials {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        Ok(self.response(job, job.parameters))
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        let along = seeds.iter().map(|seed| self.response(job, seed)).collect();
        Some(Ok((self.response(job, job.parameters), along)))
    }
}

/// A signal `y = f(parameters, t)`, exact at 161 evenly spaced times.
pub struct Curve {
    interface: Interface,
    f: fn(&[f64], f64) -> f64,
}

impl Curve {
    pub fn new(parameters: &[&str], f: fn(&[f64], f64) -> f64) -> Self {
        Self { interface: interface(parameters, &["y"]), f }
    }

    fn response(horizon: f64, f: impl Fn(f64) -> f64) -> Analysis {
        const PIECES: u32 = 40;
        let mut trace = Trace::starting_at(0.0, PIECES as usize);
        for i in 0..PIECES {
            let [from, to] = [i, i + 1].map(|i| horizon * f64::from(i) / f64::from(PIECES));
            trace.push(to, Trace::NODES.map(|s| f(from + s * (to - from))));
        }
        Analysis::Time(Response { traces: vec![("y".into(), trace)], ..Response::default() })
    }
}

impl Model for Curve {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        Ok(Self::response(job.horizon, |t| (self.f)(job.parameters, t)))
    }

    /// Differences of the closed form, accurate to ten digits.
    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        let along = |seed: &Vec<f64>| {
            let moved = |by: f64| -> Vec<f64> { job.parameters.iter().zip(seed).map(|(p, d)| p + by * d).collect() };
            let size = |(p, d): (&f64, &f64)| if *d == 0.0 { 0.0 } else { d.abs() / p.abs().max(1e-3) };
            let step = 1e-6 / job.parameters.iter().zip(seed).map(size).fold(f64::MIN_POSITIVE, f64::max);
            let [high, low] = [moved(step), moved(-step)];
            Self::response(job.horizon, |t| ((self.f)(&high, t) - (self.f)(&low, t)) / (2.0 * step))
        };
        Some(self.analyse(job).map(|analysis| (analysis, seeds.iter().map(along).collect())))
    }
}

fn interface(parameters: &[&str], signals: &[&str]) -> Interface {
    Interface {
        signals: signals.iter().map(|name| Variable::new(*name, "1", "output")).collect(),
        parameters: parameters.iter().map(|name| Parameter::new(*name, "1", "parameter")).collect(),
        horizon: Some(1.0),
        ..Interface::default()
    }
}

/// Channel of an experiment: signal and noise.
#[derive(Clone)]
pub struct Channel {
    pub experiment: &'static str,
    pub role: Role,
    pub signal: &'static str,
    pub times: Vec<f64>,
    /// Measured signal, divided by the gain.
    pub truth: fn(f64) -> f64,
    pub gain: f64,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Declared standard deviation of the noise.
    pub declared: Option<f64>,
    /// Correlation of adjacent samples.
    pub correlation: f64,
    /// Only every n-th sample is present; the others are gaps.
    pub every: usize,
    /// Share of the samples with a spike, and whether all spikes are upwards.
    pub spikes: (f64, bool),
}

/// Sizes of spikes, in standard deviations of the noise.
const SPIKES: [f64; 2] = [10.0, 60.0];

impl Channel {
    /// Channel of a calibration experiment with undeclared white noise, sampled uniformly from 0 to `end`.
    pub fn new(
        experiment: &'static str,
        signal: &'static str,
        count: u32,
        end: f64,
        truth: fn(f64) -> f64,
        noise: f64,
    ) -> Self {
        let times = (0..count).map(|i| end * f64::from(i) / f64::from(count - 1)).collect();
        let (role, declared, gain, correlation, every) = (Role::Calibration, None, 1.0, 0.0, 1);
        let spikes = (0.0, false);
        Self { experiment, role, signal, times, truth, gain, noise, declared, correlation, every, spikes }
    }

    pub fn declared(self) -> Self {
        Self { declared: Some(self.noise), ..self }
    }

    /// Replaces all but every n-th sample by gaps.
    pub fn kept(self, every: usize) -> Self {
        Self { every, ..self }
    }

    /// Returns the samples with the noise of this seed; NaN is a gap.
    pub fn values(&self, seed: u64) -> Vec<f64> {
        let mut random = stream(seed, &format!("{} {}", self.experiment, self.signal));
        // G. E. P. Box, M. E. Muller, Annals of Mathematical Statistics 29 (1958) 610-611.
        let mut normal = || {
            let [u, v]: [f64; 2] = [random.random(), random.random()];
            (-2.0 * math::ln(1.0 - u)).sqrt() * math::cos(std::f64::consts::TAU * v)
        };
        let mut error = normal();
        let mut next = || {
            let now = error;
            error = self.correlation * error + (1.0 - math::powi(self.correlation, 2)).sqrt() * normal();
            self.noise * now
        };
        let sample = |(i, &t): (usize, &f64)| {
            if i % self.every == 0 { self.gain * (self.truth)(t) + next() } else { f64::NAN }
        };
        let mut values: Vec<f64> = self.times.iter().enumerate().map(sample).collect();
        let (share, upwards) = self.spikes;
        let mut random = stream(seed, &format!("{} {} spikes", self.experiment, self.signal));
        for value in values.iter_mut().filter(|_| share > 0.0) {
            let [drawn, size, side]: [f64; 3] = [random.random(), random.random(), random.random()];
            if drawn < share {
                let sign = if upwards || side < 0.5 { 1.0 } else { -1.0 };
                *value += sign * self.noise * (SPIKES[0] + size * (SPIKES[1] - SPIKES[0]));
            }
        }
        values
    }

    fn measured(&self, seed: u64) -> ChannelBuilder {
        ChannelBuilder {
            signal: self.signal.into(),
            times: self.times.clone(),
            values: self.values(seed),
            noise: self.declared.map(Into::into),
            ..ChannelBuilder::default()
        }
    }
}

/// Calibration problem.
pub struct Calibration {
    pub model: Box<dyn Fn() -> ModelBuilder>,
    pub tuners: Vec<(&'static str, TunerBuilder)>,
    pub channels: Vec<Channel>,
    pub criteria: Box<dyn Fn() -> Vec<(&'static str, CriterionBuilder)>>,
    pub uncertainty: Option<UncertaintyTask>,
}

impl Calibration {
    /// Calibrates once, with the noise of this seed.
    pub fn run(&self, seed: u64) -> Outcome {
        let mut cases: Vec<CaseBuilder> = Vec::new();
        for channel in &self.channels {
            if cases.iter().all(|case| case.name != channel.experiment) {
                let measured = Measured { role: channel.role, ..Measured::default() };
                let name = channel.experiment.into();
                cases.push(CaseBuilder { name, measured: Some(measured), ..CaseBuilder::default() });
            }
            let case = cases.iter_mut().find(|case| case.name == channel.experiment).unwrap();
            case.measured.as_mut().unwrap().channels.push(channel.measured(seed));
        }
        let draft = StudyBuilder {
            name: "calibration".into(),
            task: CalibrationTask { uncertainty: self.uncertainty.clone() }.into(),
            seed: 1,
            models: vec![("model".into(), (self.model)())],
            tuners: self.tuners.iter().map(|(name, tuner)| ((*name).to_owned(), tuner.clone())).collect(),
            cases,
            criteria: (self.criteria)().into_iter().map(|(name, criterion)| (name.to_owned(), criterion)).collect(),
            ..StudyBuilder::default()
        };
        let options = Options { jobs: Some(1), ..Options::default() };
        mops::solve(draft.build().unwrap(), &options, &()).unwrap().outcome
    }
}

/// Returns the parameters of a calibration.
pub fn parameters(outcome: &Outcome) -> &[ParameterReport] {
    &outcome.calibration.as_ref().unwrap().parameters
}

/// Returns the sentences on identifiability in one text.
pub fn words(outcome: &Outcome) -> String {
    outcome.calibration.as_ref().unwrap().sensitivity.as_ref().unwrap().words.join("\n")
}
