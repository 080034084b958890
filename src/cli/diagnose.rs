//! `mops diagnose`: finds what the model of a study lacks, whatever the study is for.

use std::process::ExitCode;

use clap::Args;
use mops_core::Catalogue;

use super::run::{Common, Search, go};
use crate::terminal::CommandError;

/// What can be said to a diagnosis.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    common: Common,
}

pub(super) fn diagnose(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    go(catalogue, &arguments.common, &Search::Diagnosis)
}
