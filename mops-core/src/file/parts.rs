//! Single tables of a study file, for studies that are put together in Rust.

use super::experiment::read as read_experiment;
use super::tree::Text;
use super::{Files, read_case, read_criterion, read_model};
use crate::catalogue::Catalogue;
use crate::diagnostic::Diagnostic;
use crate::study::{CaseDraft, CriterionDraft, ModelDraft};

/// A model by what stands under `[models.NAME]`: its kind with options, `parameters` and the like.
///
/// # Errors
/// The first mistake, with its place in `text`.
pub fn model(catalogue: &Catalogue, text: &str) -> Result<ModelDraft, Diagnostic> {
    let text = Text::new("model", text, &[]);
    read_model(catalogue, &text.parse()?)
}

/// A case by what stands under `[cases]` beside its name; `models` tell the units of inputs.
///
/// # Errors
/// The first mistake, with its place in `text`.
pub fn case(name: &str, text: &str, models: &[(String, ModelDraft)]) -> Result<CaseDraft, Diagnostic> {
    let text = Text::new(name, text, &[]);
    read_case(name.to_owned(), &text.parse()?, models)
}

/// An experiment by what stands under `[experiments.NAME]`.
///
/// # Errors
/// The first mistake, with its place in `text` or in the data.
pub fn experiment(name: &str, text: &str, files: &dyn Files) -> Result<CaseDraft, Diagnostic> {
    let text = Text::new(name, text, &[]);
    read_experiment(name.to_owned(), &text.parse()?, files)
}

/// A criterion by what stands under `[criteria]` beside its name.
///
/// # Errors
/// The first mistake, with its place in `text`.
pub fn criterion(catalogue: &Catalogue, text: &str) -> Result<CriterionDraft, Diagnostic> {
    let text = Text::new("criterion", text, &[]);
    read_criterion(catalogue, &text.parse()?)
}
