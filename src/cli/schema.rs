//! `mops schema`: prints the JSON schema of study files.

use std::process::ExitCode;

use crate::terminal::{CommandError, print};
use mops_core::Catalogue;

/// Returns the schema as text.
pub(super) fn text(catalogue: &Catalogue) -> String {
    serde_json::to_string_pretty(&mops_core::file::study_schema(catalogue)).expect("a schema is JSON") + "\n"
}

pub(super) fn schema(catalogue: &Catalogue) -> Result<ExitCode, CommandError> {
    print(&text(catalogue))?;
    Ok(ExitCode::SUCCESS)
}
