//! Storage of the evaluations of a run in `evaluations.sqlite` in its folder. A killed run can be resumed, and a study with
//! other demands can reuse the points. `docs/reference/run-files.md` describes the tables.

mod best;
mod bytes;
mod columns;
mod database;
mod ending;
mod identity;
mod lock;
mod memory;
mod recorder;
mod relocate;
mod replace;
mod runs;
#[cfg(test)]
mod tests;
mod writer;

use std::path::{Path, PathBuf};

use database::Database;
pub(crate) use identity::Identity;
pub(crate) use lock::FolderLock;
pub(crate) use recorder::{FinishedRun, OpenError, Recorder, Start, lock_folder};
pub(crate) use runs::{RunRow, RunState, row};

/// Returns the last run in a folder, and true if it is in progress; `None` if there is none or it cannot be read.
pub(crate) fn last_run(folder: &Path) -> Option<(RunRow, bool)> {
    let run = Database::open(&file(folder), false).ok()??.last_run().ok()??;
    Some((ending::Ending::complete(folder, run), FolderLock::is_locked(folder)))
}

/// Name of the database in the folder of a run.
pub(crate) const FILE: &str = "evaluations.sqlite";

/// Returns the path of the database in the folder of a run.
pub(crate) fn file(folder: &Path) -> PathBuf {
    folder.join(FILE)
}
