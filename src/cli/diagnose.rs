//! `mops diagnose`: runs a diagnosis of the model of a study, whatever the task of the study.

use std::process::ExitCode;

use clap::Args;
use mops_core::Catalogue;

use super::run::{CommonOptions, Search, execute};
use crate::terminal::CommandError;

/// Options of `mops diagnose`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    common: CommonOptions,
}

pub(super) fn diagnose(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    execute(catalogue, &arguments.common, &Search::Diagnosis)
}
