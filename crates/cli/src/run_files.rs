//! Output files of a run: result, evaluations, report and plots. A diagnosis adds predictions, the repaired study and
//! its source; a Pareto front adds the study.

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use mops_content::{numbers::counted, write_header};
use mops_core::{Catalogue, Effect};
use mops_output::Outputs;
use mops_report::Report;
use mops_tasks::{Origin, OutputFile, OutputNames, Room, Solved, room};

use super::home::Home;
use crate::terminal::{CommandError, eprint_line};

/// Time to wait for space on a full disk.
pub(super) const DISK_TIMEOUT: Duration = Duration::from_secs(10);

/// Outputs in the folder of every run.
const RUN: OutputNames = OutputNames {
    files: &[
        "result.json",
        "evaluations.csv",
        "evaluations.sqlite",
        "evaluations.sqlite-wal",
        "evaluations.sqlite-shm",
        "evaluations.sqlite-journal",
        "evaluations.ended.json",
    ],
    folders: &[],
};

/// Outputs of every report.
pub(super) const REPORT: OutputNames =
    OutputNames { files: &["report.html", "evaluations.lock"], folders: &[("plots", &["svg", "png"])] };

/// Checks before a run that none of its outputs would replace an input.
///
/// # Errors
/// If one would; the error names the input.
pub(super) fn check_run(outputs: &Outputs, folder: &Path, room: &dyn Room) -> Result<(), CommandError> {
    [RUN, REPORT, room.outputs()].into_iter().try_for_each(|names| check_outputs(outputs, folder, names))
}

/// Checks that no output of these names would replace an input.
///
/// # Errors
/// If one would; the error names the input.
pub(super) fn check_outputs(outputs: &Outputs, folder: &Path, names: OutputNames) -> Result<(), CommandError> {
    paths(folder, names).try_for_each(|path| outputs.check(&path).map_err(CommandError::cannot_write(&path)))
}

/// Returns the paths of the outputs of these names: files, folders, and the files in them.
fn paths(folder: &Path, names: OutputNames) -> impl Iterator<Item = PathBuf> {
    let files = names.files.iter().map(|name| folder.join(name));
    let folders = names.folders.iter().map(|(name, ends)| (folder.join(name), ends));
    let below = folders.flat_map(|(folder, ends)| {
        let entries = fs::read_dir(&folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let written = entries.filter(|path| path.extension().is_some_and(|end| ends.iter().any(|known| end == *known)));
        let written: Vec<PathBuf> = written.collect();
        std::iter::once(folder).chain(written)
    });
    files.chain(below)
}

/// Returns the paths of all files that a run of any task may have written into a folder.
pub(super) fn of_any_run(catalogue: &Catalogue, folder: &Path) -> Vec<PathBuf> {
    let of_tasks = catalogue.tasks.iter().map(|kind| room(kind).outputs());
    [RUN, REPORT].into_iter().chain(of_tasks).flat_map(|names| paths(folder, names)).collect()
}

/// Output files of a run.
pub(super) struct RunFiles<'a> {
    pub folder: &'a Path,
    pub outputs: &'a Outputs,
    pub solved: &'a Solved,
    pub room: &'a dyn Room,
    /// Text of the study with all settings.
    pub text: &'a str,
    /// Text of the study without settings.
    pub plain: &'a str,
    /// Settings of the command line.
    pub own: &'a [String],
    /// Settings of the command line, and those made by the command itself.
    pub settings: &'a [String],
    pub home: &'a Home,
    /// Converts the path of a data file from relative to the study to relative to the folder of the run.
    pub locate: &'a dyn Fn(&str) -> String,
    pub effects: &'a [Arc<dyn Effect>],
    /// True if the repaired model is also written as source code.
    pub export: bool,
}

impl RunFiles<'_> {
    /// Writes result.json; an earlier file stays until the new one is on the disk. Waits at most `timeout` for space on
    /// a full disk.
    pub(super) fn write_result(&self, timeout: Duration) -> Result<(), CommandError> {
        fs::create_dir_all(self.folder).map_err(CommandError::cannot_write(self.folder))?;
        let path = self.folder.join("result.json");
        let json = serde_json::to_string_pretty(&self.solved.outcome).expect("a result is JSON") + "\n";
        let until = Instant::now() + timeout;
        let is_full = |error: &io::Error| matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
        loop {
            let written = self.outputs.create(&path).and_then(|mut file| {
                file.write_all(json.as_bytes())?;
                file.commit_synced()
            });
            match written {
                Err(error) if is_full(&error) && Instant::now() < until => thread::sleep(Duration::from_millis(100)),
                written => return written.map_err(CommandError::cannot_write(&path)),
            }
        }
    }

    /// Writes the other files: evaluations, samples, report and plots, and those of the task. Returns the path of the
    /// study that the task wrote, if any.
    pub(super) fn write_others(&self) -> Result<Option<PathBuf>, CommandError> {
        let Self { folder, outputs, solved, .. } = *self;
        let evaluations = folder.join("evaluations.csv");
        write_evaluations(outputs, &evaluations, solved).map_err(CommandError::cannot_write(&evaluations))?;
        let missing = Report::new(solved, self.room, self.text)
            .write_by(folder, outputs)
            .map_err(CommandError::cannot_write(folder))?;
        if missing > 0 {
            let plots = counted(missing, "plot");
            eprint_line(&format!(
                "warning: {plots} not written in time; `mops report {}` writes them",
                folder.display()
            ));
        }
        for OutputFile { path, bytes } in self.room.files(&solved.into(), &self.origin()) {
            let path = folder.join(path);
            let parent = path.parent().unwrap_or(folder);
            if parent != folder {
                outputs.folder(parent).map_err(CommandError::cannot_write(parent))?;
            }
            outputs.write(&path, bytes).map_err(CommandError::cannot_write(&path))?;
        }
        Ok(self.room.written_study().map(|name| folder.join(name)).filter(|path| path.is_file()))
    }

    /// Returns where the study comes from.
    fn origin(&self) -> Origin<'_> {
        Origin {
            text: match self.home {
                Home::Built(_) => None,
                Home::File(_) | Home::Shipped(_) => Some(self.plain),
            },
            own: self.own,
            settings: self.settings,
            shipped: match self.home {
                Home::Shipped(shipped) => Some(shipped),
                Home::File(_) | Home::Built(_) => None,
            },
            locate: self.locate,
            folder: self.folder,
            effects: self.effects,
            is_exported: self.export,
        }
    }
}

/// Writes one line per point: tuners, criteria, objective, violation.
fn write_evaluations(outputs: &Outputs, path: &Path, solved: &Solved) -> io::Result<()> {
    let study = solved.problem.study();
    outputs.write_csv(path, |writer| {
        let tuners = study.tuners().iter().map(|t| format!("{}[{}]", t.name, t.unit));
        let rows = study.rows().iter().map(|row| format!("{}[{}]", study.key(row), row.unit));
        write_header(writer, tuners.chain(rows).chain(["objective".into(), "violation".into()]))?;
        for record in &solved.archive {
            let merit = [&record.merit.objective, &record.merit.violation];
            writer.write_record(record.tuners.iter().chain(&record.values).chain(merit).map(f64::to_string))?;
        }
        Ok(())
    })
}

/// Converts the path of a data file from relative to the study to relative to `folder`.
pub(super) fn relative_path(folder: &Path, study: &Path, path: &str) -> String {
    if Path::new(path).is_absolute() {
        return path.to_owned();
    }
    let file = study.parent().unwrap_or(Path::new("")).join(path);
    match (folder.canonicalize(), file.canonicalize()) {
        (Ok(folder), Ok(file)) => relative(&folder, &file).display().to_string(),
        _ => std::path::absolute(&file).unwrap_or(file).display().to_string(),
    }
}

/// Returns the relative path from a folder to a file, both absolute.
fn relative(folder: &Path, file: &Path) -> PathBuf {
    let [folder, file] = [folder, file].map(|path| path.components().collect::<Vec<_>>());
    let common = folder.iter().zip(&file).take_while(|(a, b)| a == b).count();
    // No relative path leads to another drive.
    if common == 0 {
        return file.iter().collect();
    }
    let up = folder[common..].iter().map(|_| Component::ParentDir);
    up.chain(file[common..].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_paths_are_converted_to_the_folder_of_the_result() {
        let root = tempfile::tempdir().unwrap();
        let at = |path: &str| root.path().join(path);
        fs::create_dir_all(at("studies/data")).unwrap();
        fs::create_dir_all(at("results/swing")).unwrap();
        fs::write(at("studies/data/a.csv"), "t\n").unwrap();
        for (folder, study, path) in [
            ("results/swing", "studies/study.toml", "data/a.csv"),
            ("studies", "studies/study.toml", "data/a.csv"),
            ("studies/data", "studies/data/study.toml", "./a.csv"),
        ] {
            let seen = relative_path(&at(folder), &at(study), path);
            assert!(!Path::new(&seen).is_absolute() && at(folder).join(&seen).is_file(), "{seen}");
        }
        assert_eq!(
            relative_path(&at("results/swing"), &at("studies/study.toml"), "data/a.csv"),
            "../../studies/data/a.csv"
        );
        let absolute = at("studies/data/a.csv").display().to_string();
        assert_eq!(relative_path(&at("results"), &at("studies/study.toml"), &absolute), absolute);
        let gone = relative_path(&at("results"), &at("studies/study.toml"), "gone.csv");
        assert!(Path::new(&gone).is_absolute(), "{gone}");
    }
}
