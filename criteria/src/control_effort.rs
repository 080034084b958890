//! Control effort.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value, Variable,
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, optional, trace};

/// Control effort `integral (u - offset)^2 dt` over the whole simulation, in signal^2 s; with `of = "absolute"`
/// `integral |u - offset| dt`, in signal s.
///
/// The square corresponds to the energy of a signal, the absolute value to its fuel. `offset` is the value at which the
/// actuator is at rest, 0 by default. Less is better. Range: from 0 up. The integral is that of the curve, exact up to
/// rounding.
///
/// Source: S. P. Boyd, C. H. Barratt, Linear Controller Design (1991), chapter 4 (norms of signals).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ControlEffort {
    /// Signal that is measured, usually a control signal.
    pub signal: String,
    /// Integrand: `square` (the default) or `absolute` value.
    #[serde(default)]
    pub of: Effort,
    /// Value at which the actuator is at rest, in the unit of the signal; 0 by default.
    pub offset: Option<Quantity>,
}

/// Integrand of the control effort.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// Square: energy.
    #[default]
    Square,
    /// Absolute value: fuel.
    Absolute,
}

impl CriterionOptions for ControlEffort {
    const KIND: &'static str = "control-effort";
}

impl CriterionSpec for ControlEffort {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let signal = model.signal(&self.signal)?.clone();
        let offset = optional("offset", self.offset.as_ref(), &signal.unit)?.unwrap_or(0.0);
        Ok(Box::new(Bound { signal, of: self.of, offset }))
    }
}

struct Bound {
    signal: Variable,
    of: Effort,
    offset: f64,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        match self.of {
            Effort::Square => self.signal.unit.power(2, 1),
            Effort::Absolute => self.signal.unit.power(1, 1),
        }
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.name.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let trace = trace(analysis, &self.signal.name)?;
        let effort = match self.of {
            Effort::Square => trace.integral(|_, u| (u - self.offset) * (u - self.offset)),
            Effort::Absolute => trace.integral_of_deviation(self.offset, |_, deviation| deviation),
        };
        Ok(effort.into())
    }
}
