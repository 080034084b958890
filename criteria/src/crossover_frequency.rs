//! Gain crossover frequency of a feedback loop.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value};
use mops_language::Unit;
use mops_linear::StateSpace;
use mops_math::complex;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, feedback};

/// Gain crossover frequency: the highest `w` with `|L(j w)| = 1`, in rad/s, located exactly. The model is the loop
/// transfer function L; a delay has no influence.
///
/// Range: above 0. Neither less nor more is better: demand it with usage = "equality", or by the pair `good` and `bad`.
/// If `|L|` is never 1, there is no value and no demand is met.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 9.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct CrossoverFrequency {
    /// Input of the loop transfer function; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the loop transfer function; may be omitted if there is only one.
    pub output: Option<String>,
}

/// Distance from a gain of 1 that counts as near.
const NEAR: f64 = 0.01;

impl CriterionOptions for CrossoverFrequency {
    const KIND: &'static str = "crossover-frequency";
}

impl CriterionSpec for CrossoverFrequency {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let value = |system: StateSpace| {
            let still = complex::norm(system.response()?.scalar(0.0));
            match feedback(system)?.gain_crossovers.last() {
                Some(crossing) => Ok(crossing.frequency.into()),
                None => Ok(Value::missed(None, (still - 1.0).abs(), NEAR, "the loop gain is never 1")),
            }
        };
        Ok(LinearCriterion::boxed(
            channel,
            Values::of(Unit::known("rad/s"), Sense::Target).within(0.0, f64::INFINITY),
            value,
        ))
    }
}
