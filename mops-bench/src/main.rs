//! The command `mops-bench`: solvers on problems with known solutions, and the diagnosis on simulated experiments.

mod command;
mod diagnosis;
mod page;
mod parallel;
mod solvers;

use std::process::ExitCode;

fn main() -> ExitCode {
    command::main(&mops::catalogue())
}
