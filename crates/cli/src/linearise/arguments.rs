//! Arguments of the command, and numbers of its output.

use std::path::PathBuf;

use clap::Args;
use mops_linear::Complex;

use super::super::study::StudyArguments;
use crate::terminal::Limit;

/// Arguments of `mops linearise`.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(super) study: StudyArguments,
    /// Model; required if the study has several.
    #[arg(long)]
    pub(super) model: Option<String>,
    /// Value of a tuner, parameter, state or input: --at theta="180 deg". Other states have their initial value, other
    /// inputs the initial value of the case.
    #[arg(long = "at", value_name = "NAME=VALUE")]
    pub(super) at: Vec<String>,
    /// Case that supplies parameters and inputs [default: the first].
    #[arg(long)]
    pub(super) case: Option<String>,
    /// Show this input only.
    #[arg(long)]
    pub(super) input: Option<String>,
    /// Show this output only.
    #[arg(long)]
    pub(super) output: Option<String>,
    /// Move the operating point to the nearest equilibrium; inputs and the states of --at stay fixed.
    #[arg(long)]
    pub(super) equilibrium: bool,
    /// Fixed state or input that the equilibrium search may change nevertheless.
    #[arg(long, value_name = "NAME", requires = "equilibrium")]
    pub(super) free: Vec<String>,
    /// State feedback u = -K x by pole placement: --place=-5,-8,-2+3i,-2-3i (1/s).
    #[arg(long, value_name = "POLES", allow_hyphen_values = true)]
    pub(super) place: Option<String>,
    /// State feedback u = -K x by linear-quadratic regulation (LQR): weights of the states, then of the inputs.
    #[arg(long, value_name = "WEIGHTS", conflicts_with = "place")]
    pub(super) lqr: Option<String>,
    #[command(flatten)]
    pub(super) limit: Limit,
    /// Folder for plots and linearised.json; without it, no files are written.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
}

/// File that contains the parts that are not printed.
pub(super) const WHERE: &str = "linearised.json (--out DIR)";

pub(super) fn rows(matrix: &nalgebra::DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

pub(super) fn complex(numbers: &[Complex]) -> Vec<[f64; 2]> {
    numbers.iter().map(|z| [z.re, z.im]).collect()
}
