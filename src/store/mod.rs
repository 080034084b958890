//! The evaluations of a run, kept as they come in `evaluations.sqlite` in its folder: a run that was killed goes on where it
//! was, and a study that asks for something else simulates no known point again. `docs/reference/run-files.md` has the tables.

mod aside;
mod best;
mod bytes;
mod claim;
mod columns;
mod database;
mod ending;
mod identity;
mod keeper;
mod memory;
mod place;
mod runs;
#[cfg(test)]
mod tests;
mod writer;

use std::path::{Path, PathBuf};

pub(crate) use claim::Claim;
use database::Database;
pub(crate) use identity::Identity;
pub(crate) use keeper::{Keeper, Opened, Refusal, Start, claim};
pub(crate) use runs::{RunRow, RunState, row};

/// The run that last wrote in a folder, and whether it goes on; `None` where there is none, or it cannot be read.
pub(crate) fn last_run(folder: &Path) -> Option<(RunRow, bool)> {
    let run = Database::open(&file(folder), false).ok()??.last_run().ok()??;
    Some((ending::Ending::complete(folder, run), Claim::is_held(folder)))
}

/// Name of the database in the folder of a run.
pub(crate) const FILE: &str = "evaluations.sqlite";

/// The database in the folder of a run.
pub(crate) fn file(folder: &Path) -> PathBuf {
    folder.join(FILE)
}
