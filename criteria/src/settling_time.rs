//! Settling time of a step response.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Demand, Interface, Sense, StudyError, Value,
    criterion::{Mark, Side},
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, Step, StepOptions, positive, second};

/// Settling time `sup { t : |y - target| > band }`, counted from the step, in s: from then on the signal stays within
/// the band.
///
/// The band is `band` in the unit of the signal, or `relative-band` as a fraction of `|target - from|`; by default 2 %
/// of the step. Touching the edge of the band does not count as leaving it. The time is that of the curve's last
/// crossing of the edge, not that of a sample. It jumps when an extremum comes to touch the edge.
///
/// Less is better. Range: from 0 to the length of the simulation. A signal outside of the band at the end has no
/// settling time and meets no demand, noted `not settled at the end`. The same applies if the final motion leads out of
/// the band, noted `crosses the band at the end`: simulate longer. Without a `target`, the last value of the signal is
/// the target; a signal that still moves at the end then has no settling time. Give a target if it is known. A signal
/// that never leaves the band has a settling time of 0, with a note.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2nd ed., 2021), section 6.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SettlingTime {
    /// Signal that is measured.
    pub signal: String,
    /// Value at which the signal should settle; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Value before the step; by default the signal's first value. Used by `relative-band` only.
    pub from: Option<Quantity>,
    /// Time of the step, from which the settling time counts; 0 s by default.
    pub step_time: Option<Quantity>,
    /// Largest distance from the target that counts as settled, in the unit of the signal.
    pub band: Option<Quantity>,
    /// Band as a fraction of the step, instead of `band`, such as 0.02 or "2 %" (the default).
    pub relative_band: Option<Quantity>,
}

impl CriterionOptions for SettlingTime {
    const KIND: &'static str = "settling-time";
}

impl CriterionSpec for SettlingTime {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: self.from.as_ref(),
            step_time: self.step_time.as_ref(),
        };
        let step = options.bind(model)?;
        let absolute = positive("band", self.band.as_ref(), &step.unit)?;
        let relative = positive("relative-band", self.relative_band.as_ref(), &Unit::one())?;
        if let Some(relative) = relative.filter(|relative| *relative >= 1.0) {
            let fact = format!("a band of {relative} times the step contains the initial value");
            return Err(StudyError::new("relative-band", fact)
                .with_help(format!("write a fraction of the step below 1; for percent write \"{relative} %\"")));
        }
        let band = match (absolute, relative) {
            (Some(_), Some(_)) => {
                return Err(StudyError::new("relative-band", "`band` and `relative-band` exclude each other")
                    .with_help("remove one of them"));
            }
            (Some(band), None) => Band::Absolute(band),
            (None, relative) => Band::Relative(relative.unwrap_or(0.02)),
        };
        Ok(Box::new(Bound { step, band }))
    }
}

struct Bound {
    step: Step,
    band: Band,
}

enum Band {
    /// Band in the unit of the signal.
    Absolute(f64),
    /// Band as a fraction of the step.
    Relative(f64),
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        second()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.step.signal.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn assumption(&self) -> Option<String> {
        self.step.assumption()
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let answer = self.step.answer(analysis)?;
        let band = match self.band {
            Band::Absolute(band) => band,
            Band::Relative(fraction) => fraction * answer.height()?.abs(),
        };
        let missed = |note| Ok(answer.missed(answer.length(), answer.target, band, note));
        let Some(left) = answer.last_outside(band) else {
            return Ok(Value::noted(0.0, "never leaves the band"));
        };
        if left >= answer.trace.end() {
            return missed("not settled at the end");
        }
        if !answer.stays_within(band, left) {
            let note = if answer.is_assumed { "still moving at the end" } else { "crosses the band at the end" };
            return missed(note);
        }
        Ok((left - answer.time).into())
    }

    fn marks(&self, demand: &Demand, analysis: &Analysis) -> Vec<Mark> {
        let Ok(answer) = self.step.answer(analysis) else { return Vec::new() };
        let band = match self.band {
            Band::Absolute(band) => band,
            Band::Relative(fraction) => fraction * (answer.target - answer.from).abs(),
        };
        let limit = demand.limit();
        // The demand excludes values outside of the band from the demanded settling time on.
        let from = answer.time + limit.unwrap_or(0.0);
        let edge = |label, level, side| self.step.mark(label, from, level, limit.map(|_| side));
        vec![edge("band", answer.target + band, Side::Above), edge("", answer.target - band, Side::Below)]
    }
}
