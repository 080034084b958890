//! Disk margin of feedback loops.

use mops_core::{
    Analysis, AnalysisKind, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value,
};
use mops_language::Unit;
use mops_linear::disk_margin;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, capped};

/// Disk margin `alpha = 1/max_w |S(j w) + (skew - 1)/2|`, dimensionless: the size of simultaneous variations of gain
/// and phase that the closed loop tolerates.
///
/// The model is the loop transfer function L, with unity negative feedback, and `S = 1/(1 + L)`. The loop stays stable
/// with any factor `f = (1 + (1 - skew)/2 delta)/(1 - (1 + skew)/2 delta)`, `|delta| < alpha`, which may vary with
/// frequency. For skew 0 and `alpha` below 2, the gain may change by a factor between `(2 - alpha)/(2 + alpha)` and its
/// reciprocal, or the phase by `2 atan(alpha/2)`: 1/2 allows a factor of 1.67 or 28 deg, 2/3 a factor of 2 or 37 deg.
/// With skew 1 it is the modulus margin `1/Ms`.
///
/// For several cut loops (`open = ["u1", "u2"]`) it is the multiloop disk margin, for independent, simultaneous
/// variations in all loops, unless `input` selects one loop; the others are then closed. For more than three loops it
/// is a lower bound, usually less than 15 % below the true margin.
///
/// More is better. Range: from 0 up to 100; at most 2 for skew 0 if L is strictly proper. From 2 on, any positive gain
/// factor is tolerated. There is no value if the closed loop is unstable, or for several loops with a delay.
///
/// Source: P. Seiler, A. Packard, P. Gahinet, An introduction to disk margins, IEEE Control Systems Magazine 40(5)
/// (2020) 78-95.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct DiskMargin {
    /// Input of the loop transfer function; may be omitted if there is only one, or for all loops at once.
    pub input: Option<String>,
    /// Output of the loop transfer function; may be omitted if there is only one, if `input` names a cut loop, or for
    /// all loops at once.
    pub output: Option<String>,
    /// Skew of the disk. 0 (default): the gain may increase and decrease by the same factor; above 0: more increase;
    /// below 0: more decrease.
    pub skew: f64,
}

impl CriterionOptions for DiskMargin {
    const KIND: &'static str = "disk-margin";
}

impl CriterionSpec for DiskMargin {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let skew = self.skew;
        if !skew.is_finite() {
            return Err(StudyError::new("skew", format!("expected a finite skew, found {skew}")));
        }
        if model.is_cut && model.inputs.len() > 1 && self.input.is_none() && self.output.is_none() {
            return Ok(Box::new(OfAllLoops { signals: model.signals.iter().map(|s| s.name.clone()).collect(), skew }));
        }
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let values = Values::of(Unit::one(), Sense::More).within(0.0, MOST);
        Ok(LinearCriterion::boxed(channel, values, move |system| Ok(capped(disk_margin(&system, skew)?, MOST))))
    }
}

/// Largest value: a loop without feedback has an infinite margin.
const MOST: f64 = 100.0;

/// Disk margin of all cut loops at once.
struct OfAllLoops {
    signals: Vec<String>,
    skew: f64,
}

impl Criterion for OfAllLoops {
    fn unit(&self) -> Unit {
        Unit::one()
    }

    fn signals(&self) -> Vec<String> {
        self.signals.clone()
    }

    fn sense(&self) -> Sense {
        Sense::More
    }

    fn range(&self) -> [f64; 2] {
        [0.0, MOST]
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let system = analysis.linear().expect("checked when the study is built");
        Ok(capped(disk_margin(system, self.skew)?, MOST))
    }
}
