//! Readers of single tables of a study file, for studies assembled in Rust.

use mops_core::{
    catalogue::Catalogue,
    study::{CaseBuilder, CriterionBuilder, ModelBuilder},
};
use mops_language::Diagnostic;

use mops_language::files::Files;

use super::cases::read_cases;
use super::criterion::read_criterion;
use super::experiment::read as read_experiments;
use super::models::read_model;
use super::tree::Text;

/// Reads a model from the contents of `[models.NAME]`: its kind with options, `parameters` and other common keys.
///
/// # Errors
/// Returns the first error, with its location in `text`.
pub fn model(catalogue: &Catalogue, text: &str, files: &dyn Files) -> Result<ModelBuilder, Diagnostic> {
    let text = Text::new("model", text, &[]);
    read_model(catalogue, &text.parse()?, files)
}

/// Reads cases from a table under `[cases]`: one, or all of its `grid`. `models` provide the units of the inputs.
///
/// # Errors
/// Returns the first error, with its location in `text` or in the data of inputs.
pub fn cases(
    name: &str,
    text: &str,
    models: &[(String, ModelBuilder)],
    files: &dyn Files,
) -> Result<Vec<CaseBuilder>, Diagnostic> {
    let text = Text::new(name, text, &[]);
    read_cases(name, &text.parse()?, models, files)
}

/// Reads experiments from the contents of `[experiments.NAME]`: one, or several from several files or windows.
///
/// # Errors
/// Returns the first error, with its location in `text` or in the data.
pub fn experiments(name: &str, text: &str, files: &dyn Files) -> Result<Vec<CaseBuilder>, Diagnostic> {
    let text = Text::new(name, text, &[]);
    read_experiments(name, &text.parse()?, files)
}

/// Reads a criterion from its table under `[criteria]`.
///
/// # Errors
/// Returns the first error, with its location in `text`.
pub fn criterion(catalogue: &Catalogue, text: &str) -> Result<CriterionBuilder, Diagnostic> {
    let text = Text::new("criterion", text, &[]);
    read_criterion(catalogue, &text.parse()?)
}
