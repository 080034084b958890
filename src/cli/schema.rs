//! `mops schema`: the JSON schema of study files.

use std::process::ExitCode;

use mops_core::Catalogue;

use super::{Trouble, print};

/// The schema as text.
pub(super) fn text(catalogue: &Catalogue) -> String {
    serde_json::to_string_pretty(&mops_core::file::study_schema(catalogue)).expect("a schema is JSON") + "\n"
}

pub(super) fn schema(catalogue: &Catalogue) -> Result<ExitCode, Trouble> {
    print(&text(catalogue))?;
    Ok(ExitCode::SUCCESS)
}
