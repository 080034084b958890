//! Readers of single tables of a study file, for studies assembled in Rust.

use super::experiment::read as read_experiment;
use super::tree::Text;
use super::{Files, read_case, read_criterion, read_model};
use crate::catalogue::Catalogue;
use crate::diagnostic::Diagnostic;
use crate::study::{CaseBuilder, CriterionBuilder, ModelBuilder};

/// Reads a model from the contents of `[models.NAME]`: its kind with options, `parameters` and other common keys.
///
/// # Errors
/// Returns the first error, with its location in `text`.
pub fn model(catalogue: &Catalogue, text: &str) -> Result<ModelBuilder, Diagnostic> {
    let text = Text::new("model", text, &[]);
    read_model(catalogue, &text.parse()?)
}

/// Reads a case from its table under `[cases]`; `models` provide the units of the inputs.
///
/// # Errors
/// Returns the first error, with its location in `text`.
pub fn case(name: &str, text: &str, models: &[(String, ModelBuilder)]) -> Result<CaseBuilder, Diagnostic> {
    let text = Text::new(name, text, &[]);
    read_case(name.to_owned(), &text.parse()?, models)
}

/// Reads an experiment from the contents of `[experiments.NAME]`.
///
/// # Errors
/// Returns the first error, with its location in `text` or in the data.
pub fn experiment(name: &str, text: &str, files: &dyn Files) -> Result<CaseBuilder, Diagnostic> {
    let text = Text::new(name, text, &[]);
    read_experiment(name.to_owned(), &text.parse()?, files)
}

/// Reads a criterion from its table under `[criteria]`.
///
/// # Errors
/// Returns the first error, with its location in `text`.
pub fn criterion(catalogue: &Catalogue, text: &str) -> Result<CriterionBuilder, Diagnostic> {
    let text = Text::new("criterion", text, &[]);
    read_criterion(catalogue, &text.parse()?)
}
