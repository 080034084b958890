//! Criteria: a number for every analysis, with its unit, sense and range.

mod demand;
mod in_unit;
mod interface;
mod loss;
mod samples;
mod value;
mod window;

pub use loss::Loss;
pub use samples::Samples;

use std::sync::Arc;

use crate::error::StudyError;
use crate::model::{AnalysisKind, Interface};

pub use demand::{Demand, Scaled};
pub(crate) use in_unit::InUnit;
pub use interface::{Criterion, Mark, Side, Tangent};
pub use value::{Missed, Sense, Usage, Value};
use window::Window;

/// Options of a criterion as written in the study; names and quantities are not yet checked against a model.
pub trait CriterionSpec: Send + Sync {
    /// Returns the kind of analysis that the criterion reads, `None` for any. A study rejects models with another kind
    /// of analysis.
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Time)
    }

    /// Checks names and units against the interface of the model.
    ///
    /// # Errors
    /// Returns an error for an unknown signal, a quantity in a wrong unit or an invalid option. The error names the
    /// option.
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError>;

    /// Returns the name of the measured signal if the criterion compares with a measurement; it then applies only to
    /// cases that have one.
    fn needs_measurement(&self) -> Option<&str> {
        None
    }

    /// Returns the names in the criterion that may be those of other criteria of the study.
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Binds the criterion as [`CriterionSpec::bind`] does, with what the study gives beside the model.
    ///
    /// # Errors
    /// Returns an error as [`CriterionSpec::bind`] does.
    fn bind_in(&self, model: &Interface, context: &BindContext<'_>) -> Result<Box<dyn Criterion>, StudyError> {
        let criterion = self.bind(model)?;
        Ok(match context.window {
            Some([from, until]) => Box::new(Window::new(criterion, from, until)),
            None => criterion,
        })
    }
}

/// What a study gives a criterion beside the model.
#[derive(Clone, Copy, Default)]
pub struct BindContext<'a> {
    /// Criteria of the same model that [`CriterionSpec::names`] refers to.
    pub others: &'a [Other],
    /// Part of the simulation to which the criterion is restricted, from one time to another, s; all times of the
    /// criterion then count from the first.
    pub window: Option<[f64; 2]>,
}

/// Another criterion of the study, by its name.
pub type Other = (String, Arc<dyn Criterion>);
