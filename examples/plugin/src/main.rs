//! The command line of mops, with the additions of this crate.

use std::process::ExitCode;

fn main() -> ExitCode {
    mops::main!(mops_plugin::catalogue())
}
