//! Earlier runs, as read from their folders.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use mops_core::Catalogue;
use mops_file::StudyFile;
use mops_language::{Diagnostic, files::read_regular};
use mops_output::Inputs;
use mops_store::{RunRow, RunState};
use mops_tasks::room;
use serde_json::Value;

use super::study::{read_at, without_settings};

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
        let result = read_regular(&path).ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
        let result = result.filter(|result| result["format"].is_u64() && result["study"].is_string());
        let run = mops_store::last_run(folder);
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

    /// Adds the files of the run that are read, and its study, to the inputs of a command.
    pub fn add_to(&self, catalogue: &Catalogue, inputs: &mut Inputs) {
        let shown = self.folder.display();
        inputs.add(&self.folder.join("result.json"), &format!("the result of the run in {shown}"));
        inputs.add(&mops_store::file(&self.folder), &format!("the evaluations of the run in {shown}"));
        for name in catalogue.tasks.iter().filter_map(|kind| room(kind).restored_from()) {
            inputs.add(&self.folder.join(name), &format!("the findings in {shown}"));
        }
        if let Some((run, _)) = &self.run {
            inputs.add(&run.home, &format!("the study of the run in {shown}"));
        }
    }

    /// Adds the data of the study of the run to the inputs of a command.
    pub fn add_data_to(&self, inputs: &mut Inputs, file: &StudyFile) {
        let Some((run, _)) = &self.run else { return };
        for (name, _) in &file.data {
            let path = run.home.with_file_name("").join(name);
            inputs.add(&path, &format!("the data file `{name}` of the run in {}", self.folder.display()));
        }
    }

    /// Returns the name of the study.
    pub fn name(&self) -> Option<&str> {
        let of_result = || self.result.as_ref().and_then(|result| result["study"].as_str());
        self.run.as_ref().map(|(run, _)| run.name.as_str()).or_else(of_result)
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
            let path = self.folder.join(mops_store::FILE);
            return Err(match path.exists() {
                true => Diagnostic::new(format!("{} has no readable run", path.display()))
                    .with_help("the file is damaged or from another program; the result is in result.json"),
                false => Diagnostic::new(format!("{} has no {}", self.folder.display(), mops_store::FILE))
                    .with_help("run the study with this version of mops, which writes it"),
            });
        };
        let text = without_settings(&run.text, &run.settings);
        read_at(catalogue, &run.home, text, &run.settings)
    }
}
