//! Earlier runs, as read from their folders.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use mops_core::file::StudyFile;
use mops_core::{Catalogue, Diagnostic};
use serde_json::Value;

use super::study::{read_at, without_settings};
use crate::files;
use crate::store::{self, RunRow, RunState};

/// Run in a folder.
pub(super) struct PastRun {
    pub folder: PathBuf,
    /// Content of result.json, if it belongs to the run in the database or there is no database.
    pub result: Option<Value>,
    /// Row of the run in the database, and true if the run is in progress.
    pub run: Option<(RunRow, bool)>,
    /// Start of the run or, if unknown, modification time of its result, in seconds since 1970-01-01 UTC.
    pub date: i64,
}

impl PastRun {
    /// Reads the run in a folder; returns `None` if there is none.
    pub fn read(folder: &Path) -> Option<Self> {
        let path = folder.join("result.json");
        let result = files::read(&path).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
        let result = result.filter(|result| result["format"].is_u64() && result["study"].is_string());
        let run = store::last_run(folder);
        // After a killed run the result may be that of an earlier run.
        let belongs = |result: &Value| match (&run, result["run"].as_str()) {
            (Some((run, _)), Some(id)) => run.id() == id,
            (Some((run, _)), None) => result["study"].as_str() == Some(&run.name),
            (None, _) => true,
        };
        let result = result.filter(belongs);
        let written = || {
            let since = fs::metadata(&path).ok()?.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
            i64::try_from(since.as_secs()).ok()
        };
        let date = run.as_ref().map(|(run, _)| run.started).or_else(written).unwrap_or(0);
        (result.is_some() || run.is_some()).then(|| Self { folder: folder.to_owned(), result, run, date })
    }

    /// Reads the run in a folder.
    ///
    /// # Errors
    /// If there is no run in the folder.
    pub fn open(folder: &Path) -> Result<Self, Diagnostic> {
        Self::read(folder).ok_or_else(|| {
            let what = if folder.is_dir() { "is not the folder of a run" } else { "is not a folder" };
            Diagnostic::new(format!("{} {what}", folder.display()))
                .with_help("name the output folder (--out) of a run; `mops history` lists them")
        })
    }

    /// Returns the state of the run in one word.
    pub fn state(&self) -> &str {
        match &self.run {
            Some((_, true)) => "running",
            Some((run, false)) if run.state == RunState::Running => "unfinished",
            Some((run, false)) => run.state.name(),
            None => self.result.as_ref().and_then(|result| result["stop"].as_str()).unwrap_or("unfinished"),
        }
    }

    /// Returns the result if the run has ended.
    pub fn finished_result(&self) -> Option<&Value> {
        self.result.as_ref().filter(|_| self.run.as_ref().is_none_or(|(run, _)| run.state != RunState::Running))
    }

    /// Returns the wall-clock time of the run, s, if it has ended.
    pub fn seconds(&self) -> Option<f64> {
        self.finished_result()?["seconds"].as_f64()
    }

    /// Reads the study of the run from its stored text; data are read from their files.
    ///
    /// # Errors
    /// If the study is not stored or its data cannot be read.
    pub fn study(&self, catalogue: &Catalogue) -> Result<StudyFile, Diagnostic> {
        let Some((run, _)) = &self.run else {
            let path = self.folder.join(store::FILE);
            return Err(match path.exists() {
                true => Diagnostic::new(format!("{} has no readable run", path.display()))
                    .with_help("the file is damaged or from another program; the result is in result.json"),
                false => Diagnostic::new(format!("{} has no {}", self.folder.display(), store::FILE))
                    .with_help("run the study with this version of mops, which writes it"),
            });
        };
        let text = without_settings(&run.text, &run.settings);
        read_at(catalogue, &run.home, text, &run.settings)
    }
}

/// Formats seconds since 1970-01-01 UTC as date and time, `2026-11-21 14:05`.
///
/// Source: H. Hinnant, chrono-Compatible Low-Level Date Algorithms (2013), `civil_from_days`.
pub(super) fn date(seconds: i64) -> String {
    let (days, second) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    let shifted = days + 719_468;
    let (era, day) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * month + 2) / 5 + 1;
    let (month, carry) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = year + era * 400 + carry;
    format!("{year:04}-{month:02}-{of_month:02} {:02}:{:02}", second / 3600, second / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::date;

    /// Reference: `date -u -d @SECONDS` of GNU coreutils.
    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(date(0), "1970-01-01 00:00");
        assert_eq!(date(951_782_400), "2000-02-29 00:00");
        assert_eq!(date(1_709_251_199), "2024-02-29 23:59");
        assert_eq!(date(4_107_542_400), "2100-03-01 00:00");
        assert_eq!(date(-1), "1969-12-31 23:59");
    }
}
