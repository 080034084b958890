//! Database in the folder of a run.

use std::path::{Path, PathBuf};

use crate::database::Database;
use crate::ending;
use crate::lock::FolderLock;
use crate::runs::RunRow;

/// Returns the last run in a folder, and true if it is in progress; `None` if there is none or it cannot be read.
pub fn last_run(folder: &Path) -> Option<(RunRow, bool)> {
    let run = Database::open(&file(folder), false).ok()??.last_run().ok()??;
    Some((ending::Ending::complete(folder, run), FolderLock::is_locked(folder)))
}

/// Name of the database in the folder of a run.
pub const FILE: &str = "evaluations.sqlite";

/// Returns the path of the database in the folder of a run.
pub fn file(folder: &Path) -> PathBuf {
    folder.join(FILE)
}
