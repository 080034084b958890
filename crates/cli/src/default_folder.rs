//! Folder of the outputs without `--out`: `results/<study>`. It is never shared by two studies, nor elsewhere through a
//! link.

use std::path::{Path, PathBuf};

use mops_content::numbers::file_name;
use mops_core::Catalogue;
use mops_language::Diagnostic;

use super::home::Home;
use super::past_run::PastRun;

/// Returns the folder for a study of this name.
///
/// N.B.: the name of a study is never used as a path.
///
/// # Errors
/// If the folder is a symbolic link, which only `--out` follows.
pub(super) fn named(name: &str) -> Result<PathBuf, Diagnostic> {
    let results = Path::new("results");
    let folder = results.join(file_name(name));
    if let Some(link) = [results, &folder].into_iter().find(|path| path.is_symlink()) {
        return Err(Diagnostic::new(format!("`{}` is a symbolic link", link.display()))
            .with_help(format!("--out {} writes where it leads", folder.display())));
    }
    Ok(folder)
}

/// Returns the folder for a run of a study.
///
/// # Errors
/// As [`named`], or if the folder has a run of another study.
pub(super) fn of_study(catalogue: &Catalogue, home: &Home, name: &str) -> Result<PathBuf, Diagnostic> {
    let folder = named(name)?;
    let Some(past) = PastRun::read(&folder) else { return Ok(folder) };
    let refused = |of: String| {
        Err(Diagnostic::new(format!("{} has a run of {of}, which would be replaced", folder.display()))
            .with_help("choose another folder with --out, or rename the study"))
    };
    match past.name() {
        Some(other) if other != name => refused(format!("another study, `{other}`")),
        _ => match past.run.as_ref().map(|(run, _)| &run.home) {
            Some(other) if is_another(catalogue, other, &home.recorded()) => {
                refused(format!("another study of this name, `{}`", other.display()))
            }
            _ => Ok(folder),
        },
    }
}

/// Returns true if both studies exist and are different.
fn is_another(catalogue: &Catalogue, before: &Path, now: &Path) -> bool {
    let is_known = |path: &Path| path.to_str().is_some_and(|name| catalogue.study(name).is_some());
    match (before.canonicalize(), now.canonicalize()) {
        (Ok(before), Ok(now)) => before != now,
        (Ok(_), Err(_)) => before != now,
        (Err(_), _) => before != now && is_known(before),
    }
}
