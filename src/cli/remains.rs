//! What is left in the folder beside result and report: predictions, the repaired study and its source by a diagnosis, the
//! study by a front.

use std::fs;
use std::path::{Component, Path, PathBuf};

use mops_core::Shipped;
use mops_discrepancy::Diagnosis;

use super::study::Home;
use super::{Trouble, cannot_write};
use crate::diagnosis::{Original, predictions, repaired, source};
use crate::files;
use crate::toml_text::settled;

/// Writes `predictions/<experiment>.csv`, and where something was found `repaired.toml` and, where asked for, `repaired.rs`.
pub(super) fn leave(
    folder: &Path,
    diagnosis: &Diagnosis,
    original: &Original<'_>,
    home: &Home,
    export: bool,
) -> Result<(), Trouble> {
    let predicted = folder.join("predictions");
    fs::create_dir_all(&predicted).map_err(cannot_write(&predicted))?;
    for (name, table) in predictions(diagnosis) {
        write(&predicted.join(format!("{name}.csv")), table.as_bytes())?;
    }
    if diagnosis.found.is_empty() && diagnosis.removed.is_empty() {
        return Ok(());
    }
    let text = match home {
        Home::File(study) => repaired(original, diagnosis, &|path| seen_from(folder, study, path)),
        Home::Shipped(shipped) => {
            copy_data(folder, shipped)?;
            repaired(original, diagnosis, &str::to_owned)
        }
    };
    write(&folder.join("repaired.toml"), text.as_bytes())?;
    if export {
        write(&folder.join("repaired.rs"), source(&text, diagnosis, &folder.display().to_string()).as_bytes())?;
    }
    Ok(())
}

/// Writes `study.toml`: the study of a front, with its settings, so that a point can be picked from it later.
pub(super) fn leave_study(folder: &Path, text: &str, settings: &[String], home: &Home) -> Result<(), Trouble> {
    let text = match home {
        Home::File(study) => settled(text, settings, &|path| seen_from(folder, study, path)),
        Home::Shipped(shipped) => {
            copy_data(folder, shipped)?;
            settled(text, settings, &str::to_owned)
        }
    };
    write(&folder.join("study.toml"), text.into_text().as_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Trouble> {
    files::write(path, bytes).map_err(cannot_write(path))
}

/// The data of a shipped study: the repaired one needs them in its own folder.
fn copy_data(folder: &Path, shipped: &Shipped) -> Result<(), Trouble> {
    let is_data = |name: &str| ["csv", "mat"].iter().any(|end| Path::new(name).extension().is_some_and(|e| e == *end));
    for (name, bytes) in shipped.files.iter().filter(|(name, _)| is_data(name)) {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(cannot_write(parent))?;
        write(&path, bytes)?;
    }
    Ok(())
}

/// The path of a data file, which counts from the folder of the study, as it counts from another folder.
fn seen_from(folder: &Path, study: &Path, path: &str) -> String {
    if Path::new(path).is_absolute() {
        return path.to_owned();
    }
    let file = study.parent().unwrap_or(Path::new("")).join(path);
    match (folder.canonicalize(), file.canonicalize()) {
        (Ok(folder), Ok(file)) => from(&folder, &file).display().to_string(),
        _ => std::path::absolute(&file).unwrap_or(file).display().to_string(),
    }
}

/// The way from a folder to a file, both absolute.
fn from(folder: &Path, file: &Path) -> PathBuf {
    let [folder, file] = [folder, file].map(|path| path.components().collect::<Vec<_>>());
    let common = folder.iter().zip(&file).take_while(|(a, b)| a == b).count();
    // On another drive there is no way.
    if common == 0 {
        return file.iter().collect();
    }
    let up = folder[common..].iter().map(|_| Component::ParentDir);
    up.chain(file[common..].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use mops_discrepancy::Removed;

    use super::super::study::{StudyArguments, home, open};
    use super::*;
    use crate::diagnosis::made_up;

    #[test]
    fn what_a_diagnosis_of_a_shipped_study_leaves_can_be_run_where_it_stands() {
        let catalogue = crate::catalogue();
        let folder = tempfile::tempdir().unwrap();
        let arguments = |study: &str| StudyArguments { study: study.into(), settings: Vec::new() };
        let removed = vec![Removed { term: "bp".into(), place: "joint:theta".into() }];
        let diagnosis = Diagnosis { found: Vec::new(), removed, ..made_up::coulomb() };
        let shipped = arguments("furuta-swing");
        let file = open(&catalogue, &shipped).unwrap();
        let (text, study, effects) = (file.source.text.as_str(), &file.study, catalogue.effects.as_slice());
        let original = Original { text, settings: &[], study, effects };
        let result = leave(folder.path(), &diagnosis, &original, &home(&catalogue, &shipped), true);
        assert!(result.is_ok());
        for name in ["predictions/swing.csv", "predictions/push.csv", "repaired.rs", "data/upright.csv"] {
            assert!(folder.path().join(name).is_file(), "{name}");
        }
        let again = open(&catalogue, &arguments(folder.path().join("repaired.toml").to_str().unwrap())).unwrap();
        assert_eq!((again.study.cases.len(), again.study.tuners.len()), (2, file.study.tuners.len() - 1));
        // The effect of a study in a file: its data stay where they are.
        let below = folder.path().join("below");
        fs::create_dir(&below).unwrap();
        let own = arguments(folder.path().join("repaired.toml").to_str().unwrap());
        assert!(leave(&below, &diagnosis, &original, &home(&catalogue, &own), false).is_ok());
        assert!(!below.join("data").exists() && !below.join("repaired.rs").exists());
        assert!(open(&catalogue, &arguments(below.join("repaired.toml").to_str().unwrap())).is_ok());
    }

    #[test]
    fn data_are_found_from_the_folder_of_the_result_as_from_that_of_the_study() {
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
            let seen = seen_from(&at(folder), &at(study), path);
            assert!(!Path::new(&seen).is_absolute() && at(folder).join(&seen).is_file(), "{seen}");
        }
        assert_eq!(
            seen_from(&at("results/swing"), &at("studies/study.toml"), "data/a.csv"),
            "../../studies/data/a.csv"
        );
        let absolute = at("studies/data/a.csv").display().to_string();
        assert_eq!(seen_from(&at("results"), &at("studies/study.toml"), &absolute), absolute);
        let gone = seen_from(&at("results"), &at("studies/study.toml"), "gone.csv");
        assert!(Path::new(&gone).is_absolute(), "{gone}");
    }
}
