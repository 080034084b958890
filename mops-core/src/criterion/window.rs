//! Criterion of a part of a simulation.

use mops_language::Unit;

use super::{Criterion, Demand, Mark, Sense, Tangent, Value};
use crate::case::{Case, Channel, Experiment};
use crate::criterion::Samples;
use crate::error::StudyError;
use crate::model::{Analysis, Response};

/// Criterion that reads a simulation from one time to another, as if it began at the first: all times count from there.
pub(crate) struct Window {
    inner: Box<dyn Criterion>,
    /// Start, s.
    from: f64,
    /// End, s; infinity for the end of the simulation.
    until: f64,
}

impl Window {
    pub(crate) fn new(inner: Box<dyn Criterion>, from: f64, until: f64) -> Self {
        Self { inner, from, until }
    }

    /// Returns the part of the case.
    fn case(&self, case: &Case) -> Case {
        let channel = |channel: &Channel| {
            let samples = channel.times.iter().zip(&channel.values);
            let within = samples.filter(|(t, _)| (self.from..=self.until).contains(*t));
            let (times, values) = within.map(|(t, &value)| (t - self.from, value)).unzip();
            Channel { times, values, ..channel.clone() }
        };
        let experiment =
            |of: &Experiment| Experiment { channels: of.channels.iter().map(channel).collect(), ..of.clone() };
        Case {
            inputs: case.inputs.iter().map(|(name, input)| (name.clone(), input.since(self.from))).collect(),
            experiment: case.experiment.as_ref().map(experiment),
            horizon: case.horizon.map(|horizon| horizon.min(self.until) - self.from),
            begins: case.begins + self.from,
            ..case.clone()
        }
    }

    /// Returns the part of the analysis.
    fn part(&self, analysis: &Analysis) -> Result<Analysis, String> {
        let Analysis::Time(response) = analysis else { return Ok(analysis.clone()) };
        let part = |(name, trace): &(String, crate::trace::Trace)| {
            if trace.end() <= self.from {
                return Err(format!(
                    "`from` at {} s is not before the end of the simulation at {} s",
                    self.from,
                    trace.end()
                ));
            }
            Ok((name.clone(), trace.between(self.from, self.until)))
        };
        let traces = response.traces.iter().map(part).collect::<Result<_, String>>()?;
        Ok(Analysis::Time(Response { traces, ..response.clone() }))
    }
}

impl Criterion for Window {
    fn unit(&self) -> Unit {
        self.inner.unit()
    }

    fn signals(&self) -> Vec<String> {
        self.inner.signals()
    }

    fn suits(&self, case: &Case) -> Result<(), StudyError> {
        let part = self.case(case);
        let mut channels = part.experiment.iter().flat_map(|e| &e.channels);
        if let Some(empty) = channels.find(|c| c.times.len() < 2 && self.inner.signals().contains(&c.signal)) {
            let fact = format!("less than two samples of `{}` in `{}` are within the window", empty.signal, case.name);
            return Err(StudyError::new("from", fact).with_help("choose other times, or list other `cases`"));
        }
        self.inner.suits(&part)
    }

    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        self.inner.value(&self.case(case), &self.part(analysis)?)
    }

    fn value_with(&self, case: &Case, analysis: &Analysis, parameters: &[f64]) -> Result<Value, String> {
        self.inner.value_with(&self.case(case), &self.part(analysis)?, parameters)
    }

    fn sense(&self) -> Sense {
        self.inner.sense()
    }

    fn range(&self) -> [f64; 2] {
        self.inner.range()
    }

    fn assumption(&self) -> Option<String> {
        self.inner.assumption()
    }

    fn natural_demand(&self) -> Option<f64> {
        self.inner.natural_demand()
    }

    fn slope(&self, case: &Case, tangent: &Tangent<'_>) -> Result<Value, String> {
        let (analysis, along) = (self.part(tangent.analysis)?, self.part(tangent.along)?);
        self.inner.slope(&self.case(case), &Tangent { analysis: &analysis, along: &along, ..*tangent })
    }

    fn samples(&self, case: &Case) -> Option<Samples> {
        let samples = self.inner.samples(&self.case(case))?;
        let channel = case.experiment.as_ref()?.channel(&samples.signal)?;
        let before = channel.times.partition_point(|&t| t < self.from);
        Some(Samples { first: samples.first + before, ..samples })
    }

    fn feedback_channel(&self) -> Option<[String; 2]> {
        self.inner.feedback_channel()
    }

    fn marks(&self, demand: &Demand, analysis: &Analysis) -> Vec<Mark> {
        let marks = self.part(analysis).map(|part| self.inner.marks(demand, &part)).unwrap_or_default();
        marks.into_iter().filter_map(|mark| mark.within(self.from, self.until)).collect()
    }
}
