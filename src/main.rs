//! The command `mops`.

use std::process::ExitCode;

fn main() -> ExitCode {
    mops::main!(mops::catalogue())
}
