//! `mops schema`: prints the JSON schema of study files or of results.

use mops_tasks::result_schema;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use mops_core::Catalogue;

use crate::terminal::{CommandError, print};

/// Arguments of `mops schema`.
#[derive(Args)]
pub(super) struct Arguments {
    /// File to print the schema of.
    #[arg(value_enum, value_name = "FILE", default_value = "study")]
    of: File,
}

/// File with a schema.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum File {
    /// Study file, with all kinds of models, criteria, solvers and effects.
    Study,
    /// result.json.
    Result,
}

/// Returns the schema as text.
pub(super) fn text(of: File, catalogue: &Catalogue) -> String {
    let schema = match of {
        File::Study => mops_file::study_schema(catalogue),
        File::Result => result_schema(catalogue),
    };
    serde_json::to_string_pretty(&schema).expect("a schema is JSON") + "\n"
}

pub(super) fn schema(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    print(&text(arguments.of, catalogue))?;
    Ok(ExitCode::SUCCESS)
}
