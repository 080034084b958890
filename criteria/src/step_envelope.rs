//! Distance of a response from an envelope.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Demand, Interface, Sense, StudyError, Trace, Value,
    Variable,
    criterion::{Mark, Side},
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{number, part, second, step_time, trace};

/// Largest violation of an envelope, `max_t max(y - upper(t), lower(t) - y)`, in the unit of the signal.
///
/// Inside the envelope the value is negative: minus the margin. Each bound is given by points `[time, value]` with
/// linear interpolation. It starts at its first point and keeps the value of its last one. Two points at the same time
/// are a step. At least one bound is needed. Example: `upper = [[0, 1.2], [5, 1.2], [5, 1.02]]`,
/// `lower = [[3, 0.9], [10, 0.98]]`.
///
/// Less is better. Range: any number. A demand is positive; to require that the response stays inside, use the pair
/// `good = -0.1`, `bad = 0`. The scaled value then is 1 if the response touches its envelope, and 0 with a margin of
/// 0.1.
///
/// Source: S. P. Boyd, C. H. Barratt, Linear Controller Design (1991), section 8.1.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct StepEnvelope {
    /// Signal that is measured.
    pub signal: String,
    /// Points `[time, value]` of the upper bound, by increasing time; without points there is no upper bound.
    #[serde(default)]
    pub upper: Vec<[Quantity; 2]>,
    /// Points `[time, value]` of the lower bound, by increasing time; without points there is no lower bound.
    #[serde(default)]
    pub lower: Vec<[Quantity; 2]>,
    /// Time of the step, from which the times of the points count; 0 s by default.
    pub step_time: Option<Quantity>,
}

impl CriterionOptions for StepEnvelope {
    const KIND: &'static str = "step-envelope";
}

impl CriterionSpec for StepEnvelope {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let signal = model.signal(&self.signal)?.clone();
        if self.upper.is_empty() && self.lower.is_empty() {
            return Err(StudyError::here("an envelope needs at least one bound")
                .with_help("add `upper = [[time, value], ...]` or `lower = [[time, value], ...]`"));
        }
        let step_time = step_time(self.step_time.as_ref())?;
        let upper = stretches("upper", &self.upper, &signal.unit, step_time)?;
        let lower = stretches("lower", &self.lower, &signal.unit, step_time)?;
        Ok(Box::new(Bound { signal, upper, lower }))
    }
}

/// Straight part of a bound: times and values at both ends.
struct Stretch {
    time: [f64; 2],
    value: [f64; 2],
}

fn stretches(key: &str, points: &[[Quantity; 2]], unit: &Unit, step_time: f64) -> Result<Vec<Stretch>, StudyError> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for [time, value] in points {
        let (time, value) = (step_time + number(key, time, &second())?, number(key, value, unit)?);
        if let Some(last) = stretches.last_mut() {
            if time < last.time[0] {
                let before = last.time[0] - step_time;
                return Err(StudyError::new(
                    key,
                    format!("the points are not in order: {} s follows {before} s", time - step_time),
                )
                .with_help("give the points by increasing time"));
            }
            last.time[1] = time;
            last.value[1] = value;
        }
        stretches.push(Stretch { time: [time, f64::INFINITY], value: [value, value] });
    }
    Ok(stretches)
}

impl Stretch {
    /// Returns the bound at a time within the stretch.
    fn at(&self, t: f64) -> f64 {
        let ([t0, t1], [v0, v1]) = (self.time, self.value);
        if v0 == v1 { v0 } else { v0 + (v1 - v0) * (t - t0) / (t1 - t0) }
    }

    /// Returns `max_t sign (y - bound)`; `None` if the stretch is outside of the simulation.
    fn violation(&self, trace: &Trace, sign: f64) -> Option<f64> {
        let (from, to) = (self.time[0].max(trace.start()), self.time[1].min(trace.end()));
        (from < to).then(|| part(trace, &[from, to], |t, y| sign * (y - self.at(t))).maximum().0)
    }
}

struct Bound {
    signal: Variable,
    upper: Vec<Stretch>,
    lower: Vec<Stretch>,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.signal.unit.difference()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.name.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let trace = trace(analysis, &self.signal.name)?;
        let above = self.upper.iter().filter_map(|stretch| stretch.violation(trace, 1.0));
        let below = self.lower.iter().filter_map(|stretch| stretch.violation(trace, -1.0));
        let worst = above.chain(below).reduce(f64::max);
        worst
            .map(Value::from)
            .ok_or_else(|| format!("the envelope starts after the end of the simulation at {} s", trace.end()))
    }

    fn marks(&self, _: &Demand, _: &Analysis) -> Vec<Mark> {
        let mark = |stretch: &Stretch, excluded| Mark {
            signal: self.signal.name.clone(),
            label: "envelope".into(),
            times: stretch.time,
            values: stretch.value,
            excluded: Some(excluded),
        };
        let upper = self.upper.iter().map(|stretch| mark(stretch, Side::Above));
        upper.chain(self.lower.iter().map(|stretch| mark(stretch, Side::Below))).collect()
    }
}
