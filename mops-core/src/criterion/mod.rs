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
    /// Returns the kind of analysis that the criterion reads. A study rejects models with another kind of analysis.
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Time
    }

    /// Returns true if the criterion reads both kinds of analysis.
    fn reads_any(&self) -> bool {
        false
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

    /// Checks names and units as [`CriterionSpec::bind`] does, with the criteria of the same model that
    /// [`CriterionSpec::names`] refers to.
    ///
    /// # Errors
    /// Returns an error as [`CriterionSpec::bind`] does.
    fn bind_with(&self, model: &Interface, _others: &[Other]) -> Result<Box<dyn Criterion>, StudyError> {
        self.bind(model)
    }

    /// Binds the criterion as [`CriterionSpec::bind_with`] does, restricted to a part of the simulation from one time
    /// to another, s. All its times then count from the first.
    ///
    /// # Errors
    /// Returns an error as [`CriterionSpec::bind`] does.
    fn bind_within(
        &self,
        model: &Interface,
        others: &[Other],
        [from, until]: [f64; 2],
    ) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Window::new(self.bind_with(model, others)?, from, until)))
    }
}

/// Another criterion of the study, by its name.
pub type Other = (String, Arc<dyn Criterion>);
