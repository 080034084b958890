//! Output files of a run: result, evaluations, report and plots. A diagnosis adds predictions, the repaired study and its
//! source; a Pareto front adds the study.

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use mops_core::{Effect, Task, catalogue::Shipped};
use mops_language::Diagnostic;
use mops_outcome::{diagnosis::Diagnosis, robustness::MonteCarloReport};

use super::study::Home;
use crate::diagnosis::{Original, predictions, repaired, source};
use crate::files::{self, Outputs, write_header};
use crate::numbers::counted;
use crate::report::Report;
use crate::search::Solved;
use crate::terminal::{CommandError, eprint_line};
use crate::toml_text::settled;

/// Time to wait for space on a full disk.
pub(super) const DISK_TIMEOUT: Duration = Duration::from_secs(10);

/// Outputs in the folder of every run.
const RUN: Names = Names {
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
pub(super) const REPORT: Names =
    Names { files: &["report.html", "evaluations.lock"], folders: &[("plots", &["svg", "png"])] };

/// Names of outputs that a command may write: files, and folders with the extensions of the files in them.
#[derive(Clone, Copy)]
pub(super) struct Names {
    files: &'static [&'static str],
    folders: &'static [(&'static str, &'static [&'static str])],
}

/// Further outputs of tasks.
const OF_TASKS: [(Task, Names); 3] = [
    (Task::MonteCarlo, Names { files: &["samples.csv"], folders: &[] }),
    (Task::Pareto, Names { files: &["study.toml"], folders: &[] }),
    (
        Task::Diagnosis,
        Names { files: &[DIAGNOSIS, "repaired.toml", "repaired.rs"], folders: &[("predictions", &["csv"])] },
    ),
];

/// Checks before a run that none of its outputs would replace an input.
///
/// # Errors
/// If one would; the error names the input.
pub(super) fn check_run(outputs: &Outputs, folder: &Path, task: Task) -> Result<(), CommandError> {
    let of_task = OF_TASKS.into_iter().filter(|(other, _)| *other == task).map(|(_, names)| names);
    [RUN, REPORT].into_iter().chain(of_task).try_for_each(|names| check_outputs(outputs, folder, names))
}

/// Checks that no output of these names would replace an input.
///
/// # Errors
/// If one would; the error names the input.
pub(super) fn check_outputs(outputs: &Outputs, folder: &Path, names: Names) -> Result<(), CommandError> {
    paths(folder, names).try_for_each(|path| outputs.check(&path).map_err(CommandError::cannot_write(&path)))
}

/// Returns the paths of the outputs of these names: files, folders, and the files in them.
fn paths(folder: &Path, names: Names) -> impl Iterator<Item = PathBuf> {
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
pub(super) fn of_any_run(folder: &Path) -> Vec<PathBuf> {
    let of_tasks = OF_TASKS.into_iter().map(|(_, names)| names);
    [RUN, REPORT].into_iter().chain(of_tasks).flat_map(|names| paths(folder, names)).collect()
}

/// Output files of a run.
pub(super) struct RunFiles<'a> {
    pub folder: &'a Path,
    pub outputs: &'a Outputs,
    pub solved: &'a Solved,
    /// Text of the study with all settings.
    pub text: &'a str,
    /// Text of the study without settings.
    pub plain: &'a str,
    /// Settings of the command line.
    pub own: &'a [String],
    /// Settings of the command line, and those made by the command itself.
    pub settings: &'a [String],
    pub home: &'a Home,
    pub effects: &'a [Arc<dyn Effect>],
    /// True if the repaired model is also written as source code.
    pub export: bool,
}

impl RunFiles<'_> {
    /// Writes result.json; an earlier file stays until the new one is on the disk. Waits at most `timeout` for space on a full
    /// disk.
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

    /// Writes the other files: evaluations, samples, report and plots, and those of the task. Returns the path of the study
    /// that the task wrote, if any.
    pub(super) fn write_others(&self) -> Result<Option<PathBuf>, CommandError> {
        let Self { folder, outputs, solved, .. } = *self;
        let evaluations = folder.join("evaluations.csv");
        write_evaluations(outputs, &evaluations, solved).map_err(CommandError::cannot_write(&evaluations))?;
        if let Some(found) = &solved.outcome.found.monte_carlo {
            let samples = folder.join("samples.csv");
            write_samples(outputs, &samples, found).map_err(CommandError::cannot_write(&samples))?;
        }
        let Solved { outcome, problem, best, archive, front } = solved;
        let missing = Report { outcome, problem, best, archive, front, text: self.text }
            .write_by(folder, outputs)
            .map_err(CommandError::cannot_write(folder))?;
        if missing > 0 {
            let plots = counted(missing, "plot");
            eprint_line(&format!(
                "warning: {plots} not written in time; `mops report {}` writes them",
                folder.display()
            ));
        }
        if let Some(diagnosis) = &outcome.found.diagnosis {
            let (text, settings, study) = (self.plain, self.own, problem.study());
            let original = Original { text, settings, study, effects: self.effects };
            write_diagnosis((folder, outputs), diagnosis, &original, self.home, self.export)?;
        }
        if outcome.task == Task::Pareto {
            write_study((folder, outputs), self.plain, self.settings, self.home)?;
        }
        let written = match outcome.task {
            Task::Pareto => Some("study.toml"),
            Task::Diagnosis => Some("repaired.toml"),
            _ => None,
        };
        Ok(written.map(|name| folder.join(name)).filter(|path| path.is_file()))
    }
}

/// Writes one line per sample: uncertain parameters, criteria.
fn write_samples(outputs: &Outputs, path: &Path, found: &MonteCarloReport) -> io::Result<()> {
    outputs.write_csv(path, |writer| {
        let parameters = found.parameters.iter().map(|p| format!("{}[{}]", p.name, p.unit));
        let criteria = found.criteria.iter().map(|c| format!("{}/{}[{}]", c.of.case, c.of.criterion, c.of.unit));
        write_header(writer, parameters.chain(criteria))?;
        for (parameters, values) in &found.table {
            writer.write_record(parameters.iter().chain(values).map(f64::to_string))?;
        }
        Ok(())
    })
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

/// File with everything that a diagnosis found, from which `mops report` writes its page again.
pub(super) const DIAGNOSIS: &str = "diagnosis.toml";

/// Returns the text of [`DIAGNOSIS`]: TOML has numbers that are not finite, JSON has not.
fn diagnosis_toml(diagnosis: &Diagnosis) -> String {
    toml::to_string(diagnosis).expect("a diagnosis is a table")
}

/// Reads the diagnosis that a run left in its folder.
///
/// # Errors
/// The run left none, or it cannot be read.
pub(super) fn read_diagnosis(folder: &Path) -> Result<Diagnosis, Diagnostic> {
    let path = folder.join(DIAGNOSIS);
    let refused = |why: String| {
        Diagnostic::new(format!("{} cannot be read: {why}", path.display()))
            .with_help("a diagnosis that reached a verdict writes it; `mops diagnose` runs one")
    };
    let text = files::read(&path).map_err(|error| refused(error.to_string()))?;
    let text = String::from_utf8(text).map_err(|error| refused(error.to_string()))?;
    toml::from_str(&text).map_err(|error| refused(error.message().to_owned()))
}

/// Writes `predictions/<experiment>.csv`; if the model was changed, also `repaired.toml` and, with `export`, `repaired.rs`.
fn write_diagnosis(
    (folder, outputs): (&Path, &Outputs),
    diagnosis: &Diagnosis,
    original: &Original<'_>,
    home: &Home,
    export: bool,
) -> Result<(), CommandError> {
    write(outputs, &folder.join(DIAGNOSIS), diagnosis_toml(diagnosis).as_bytes())?;
    let predicted = folder.join("predictions");
    outputs.folder(&predicted).map_err(CommandError::cannot_write(&predicted))?;
    for (name, table) in predictions(diagnosis) {
        write(outputs, &predicted.join(format!("{name}.csv")), table.as_bytes())?;
    }
    if !diagnosis.changes_study() {
        return Ok(());
    }
    let text = match home {
        Home::File(study) => repaired(original, diagnosis, &|path| relative_path(folder, study, path)),
        Home::Shipped(shipped) => {
            copy_data((folder, outputs), shipped)?;
            repaired(original, diagnosis, &str::to_owned)
        }
        // A study built in Rust has no text to be repaired.
        Home::Built(_) => return Ok(()),
    };
    write(outputs, &folder.join("repaired.toml"), text.as_bytes())?;
    if export {
        write(
            outputs,
            &folder.join("repaired.rs"),
            source(&text, diagnosis, &folder.display().to_string()).as_bytes(),
        )?;
    }
    Ok(())
}

/// Writes `study.toml`, the study of a Pareto front with its settings, for `mops pick`.
fn write_study(
    (folder, outputs): (&Path, &Outputs),
    text: &str,
    settings: &[String],
    home: &Home,
) -> Result<(), CommandError> {
    let text = match home {
        Home::File(study) => settled(text, settings, &|path| relative_path(folder, study, path)),
        Home::Shipped(shipped) => {
            copy_data((folder, outputs), shipped)?;
            settled(text, settings, &str::to_owned)
        }
        Home::Built(_) => return Ok(()),
    };
    write(outputs, &folder.join("study.toml"), text.into_text().as_bytes())
}

fn write(outputs: &Outputs, path: &Path, bytes: &[u8]) -> Result<(), CommandError> {
    outputs.write(path, bytes).map_err(CommandError::cannot_write(path))
}

/// Copies the data of a shipped study into the folder of the repaired study, which reads them there.
fn copy_data((folder, outputs): (&Path, &Outputs), shipped: &Shipped) -> Result<(), CommandError> {
    let is_data = |name: &str| ["csv", "mat"].iter().any(|end| Path::new(name).extension().is_some_and(|e| e == *end));
    for (name, bytes) in shipped.files.iter().filter(|(name, _)| is_data(name)) {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        if parent != folder {
            outputs.folder(parent).map_err(CommandError::cannot_write(parent))?;
        }
        write(outputs, &path, bytes)?;
    }
    Ok(())
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
    use mops_core::Catalogue;
    use mops_outcome::diagnosis::Removed;

    use super::super::study::{StudyArguments, home, open};
    use super::*;
    use crate::diagnosis::made_up;

    #[test]
    fn a_diagnosis_is_read_back_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        for mut diagnosis in [made_up::coulomb(), made_up::nothing(), made_up::unexplained()] {
            diagnosis.p_value = f64::NAN;
            fs::write(folder.path().join(DIAGNOSIS), diagnosis_toml(&diagnosis)).unwrap();
            let read = read_diagnosis(folder.path()).unwrap();
            assert_eq!(format!("{read:?}"), format!("{diagnosis:?}"));
        }
        fs::write(folder.path().join(DIAGNOSIS), "verdict = 3").unwrap();
        assert!(read_diagnosis(folder.path()).unwrap_err().message.contains("diagnosis.toml cannot be read"));
    }

    #[test]
    fn the_repaired_study_of_a_shipped_study_can_be_run_in_its_folder() {
        let catalogue = crate::catalogue();
        let (folder, outputs) = (tempfile::tempdir().unwrap(), Outputs::default());
        let arguments = |study: &str| StudyArguments { study: study.into(), settings: Vec::new() };
        let removed = vec![Removed { term: "bp".into(), place: "joint:theta".into() }];
        let mut diagnosis = made_up::coulomb();
        diagnosis.found = Vec::new();
        diagnosis.removed = removed;
        let shipped = arguments("furuta-swing");
        let file = open(&catalogue, &shipped).unwrap();
        let (text, study, effects) = (file.source.text.as_str(), &file.study, catalogue.effects.as_slice());
        let original = Original { text, settings: &[], study, effects };
        let result =
            write_diagnosis((folder.path(), &outputs), &diagnosis, &original, &home(&catalogue, &shipped), true);
        assert!(result.is_ok());
        for name in ["predictions/swing.csv", "predictions/push.csv", "repaired.rs", "data/upright.csv"] {
            assert!(folder.path().join(name).is_file(), "{name}");
        }
        let again = open(&catalogue, &arguments(folder.path().join("repaired.toml").to_str().unwrap())).unwrap();
        assert_eq!((again.study.cases().len(), again.study.tuners().len()), (2, file.study.tuners().len() - 1));
        // The data of a study in a file are not copied.
        let below = folder.path().join("below");
        fs::create_dir(&below).unwrap();
        let own = arguments(folder.path().join("repaired.toml").to_str().unwrap());
        assert!(write_diagnosis((&below, &outputs), &diagnosis, &original, &home(&catalogue, &own), false).is_ok());
        assert!(!below.join("data").exists() && !below.join("repaired.rs").exists());
        // No run has its database there.
        let again = arguments(below.join("repaired.toml").to_str().unwrap());
        assert!(open(&catalogue, &again).is_err());
        let reading = Catalogue { readable: vec![folder.path().to_owned()], ..catalogue };
        assert!(open(&reading, &again).is_ok());
    }

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
