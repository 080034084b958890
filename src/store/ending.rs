//! How a run ended whose database could not be told: a note beside it, which the next run removes.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::runs::{RunRow, RunState};
use crate::files;

/// The end of a run, for the row of the run that began at the same time.
#[derive(Serialize, Deserialize)]
pub(super) struct Ending {
    begun: i64,
    state: String,
    evaluations: usize,
}

impl Ending {
    fn path(folder: &Path) -> PathBuf {
        folder.join("evaluations.ended.json")
    }

    /// Notes the end of a run, as far as that can be written either.
    pub(super) fn note(folder: &Path, begun: i64, state: RunState, evaluations: usize) {
        let ending = Self { begun, state: state.name().to_owned(), evaluations };
        let text = serde_json::to_string(&ending).expect("numbers and words are JSON") + "\n";
        let _ = files::write(&Self::path(folder), text);
    }

    /// The row of the last run with what the note says of it, if there is one.
    pub(super) fn complete(folder: &Path, run: RunRow) -> RunRow {
        let read = files::read(&Self::path(folder)).ok();
        let noted: Option<Self> = read.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        match noted.filter(|noted| noted.begun == run.begun && run.state == RunState::Running) {
            Some(noted) => RunRow { state: RunState::of(&noted.state), evaluations: noted.evaluations, ..run },
            None => run,
        }
    }

    /// Removes the note of an earlier run.
    pub(super) fn clear(folder: &Path) {
        let _ = fs::remove_file(Self::path(folder));
    }
}
