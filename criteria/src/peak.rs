//! Largest or smallest value of a signal.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Demand, Interface, Sense, StudyError, Value, Variable,
    criterion::{Mark, Side},
};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, trace};

/// Peak `max_t y`, `min_t y` or `max_t |y|` over the whole simulation, in the unit of the signal.
///
/// Which values are better depends on the signal. `demand` limits a maximum or an absolute peak from above; the pair
/// `good` and `bad` works in either direction. A minimum takes no `demand`, because its direction would be ambiguous:
/// use the pair, or `usage = "equality"`. Range: any number; never negative for `absolute`. The extremum is that of the
/// curve, not of samples. For a limit that is zero or negative, use the pair.
///
/// Source: S. P. Boyd, C. H. Barratt, Linear Controller Design (1991), chapter 4 (the peak norm of a signal).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Peak {
    /// Signal that is measured.
    pub signal: String,
    /// Kind of peak: `maximum` (the default), `minimum`, or `absolute` for the largest distance from zero.
    #[serde(default)]
    pub of: Extremum,
}

/// Kind of extremum of a signal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Extremum {
    /// Largest value.
    #[default]
    Maximum,
    /// Smallest value.
    Minimum,
    /// Largest distance from zero.
    Absolute,
}

impl CriterionOptions for Peak {
    const KIND: &'static str = "peak";
}

impl CriterionSpec for Peak {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Bound { signal: model.signal(&self.signal)?.clone(), of: self.of }))
    }
}

struct Bound {
    signal: Variable,
    of: Extremum,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.signal.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.name.clone()]
    }

    fn sense(&self) -> Sense {
        match self.of {
            Extremum::Absolute => Sense::Less,
            Extremum::Maximum => Sense::Open,
            // A demand of 5 degC on the lowest temperature is ambiguous.
            Extremum::Minimum => Sense::Target,
        }
    }

    fn range(&self) -> [f64; 2] {
        if self.of == Extremum::Absolute { NOT_NEGATIVE } else { [f64::NEG_INFINITY, f64::INFINITY] }
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let trace = trace(analysis, &self.signal.name)?;
        let peak = match self.of {
            Extremum::Maximum => trace.maximum().0,
            Extremum::Minimum => trace.minimum().0,
            Extremum::Absolute => trace.maximum().0.max(-trace.minimum().0),
        };
        Ok(peak.into())
    }

    fn marks(&self, demand: &Demand, _: &Analysis) -> Vec<Mark> {
        let mark = |level, excluded| Mark {
            signal: self.signal.name.clone(),
            label: "peak".into(),
            times: [f64::NEG_INFINITY, f64::INFINITY],
            values: [level; 2],
            excluded,
        };
        let side = if demand.asks_for_more() { Side::Below } else { Side::Above };
        match (demand.limit(), self.of) {
            (None, _) => Vec::new(),
            (Some(limit), Extremum::Absolute) => {
                vec![mark(limit, Some(Side::Above)), mark(-limit, Some(Side::Below))]
            }
            (Some(limit), _) => vec![mark(limit, Some(side))],
        }
    }
}
