//! Note on the end of a run, next to a database that could not be written. The next run removes it.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::runs::{RunRow, RunState};
use mops_language::files::read_regular;
use mops_output::Outputs;

/// End of a run, for the row with the same start time.
#[derive(Serialize, Deserialize)]
pub(super) struct Ending {
    #[serde(rename = "begun")]
    started: i64,
    state: String,
    evaluations: usize,
}

impl Ending {
    fn path(folder: &Path) -> PathBuf {
        folder.join("evaluations.ended.json")
    }

    /// Writes a note on the end of a run; errors are ignored.
    pub(super) fn note(folder: &Path, started: i64, state: RunState, evaluations: usize) {
        let ending = Self { started, state: state.name().to_owned(), evaluations };
        let text = serde_json::to_string(&ending).expect("numbers and words are JSON") + "\n";
        // A run that reads this file is refused before it starts.
        let _ = Outputs::default().write(&Self::path(folder), text);
    }

    /// Completes the row of the last run from the note, if there is one.
    pub(super) fn complete(folder: &Path, run: RunRow) -> RunRow {
        let read = read_regular(&Self::path(folder)).ok();
        let noted: Option<Self> = read.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        match noted.filter(|noted| noted.started == run.started && run.state == RunState::Running) {
            Some(noted) => RunRow { state: RunState::of(&noted.state), evaluations: noted.evaluations, ..run },
            None => run,
        }
    }

    /// Removes the note of an earlier run.
    pub(super) fn clear(folder: &Path) {
        let _ = fs::remove_file(Self::path(folder));
    }
}
