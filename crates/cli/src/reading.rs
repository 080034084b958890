//! Folders whose files a study may read: its own, those of `--allow-read`, and for a study that mops wrote below the
//! folder of another one, the folder of that study.

use std::path::{Path, PathBuf};

use mops_core::Catalogue;
use mops_file::StudyFile;
use mops_language::files::{Folder, read_regular};

use super::home::Home;

/// Largest number of studies written from another one, each below the folder of the first.
const MOST_GENERATIONS: usize = 20;

/// Returns the source of the data files of the study in a file.
pub(super) fn folder(catalogue: &Catalogue, file: &Path) -> Folder {
    let own = file.parent().unwrap_or(Path::new(""));
    catalogue.folder(own).reading(origin(own, MOST_GENERATIONS))
}

/// Returns the folder of the study whose run wrote into `folder`, if `folder` is below it.
///
/// N.B.: the database of the run only names that study. Its file must be there, and be a study of this name: a folder
/// from an untrusted source cannot open the folders above it by what its own files say.
fn origin(folder: &Path, generations: usize) -> Option<PathBuf> {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let real = here.canonicalize().ok()?;
    let (run, _) = mops_store::last_run(&real).filter(|_| generations > 0)?;
    let is_study = |file: &Path| name_in(file).is_some_and(|name| name == run.name);
    let file = run.home.file_name()?;
    // A project that was moved as a whole still has the study above the run.
    let above = real.ancestors().skip(1).find(|above| is_study(&above.join(file)));
    let home = || run.home.parent().filter(|_| is_study(&run.home));
    let found = above.or_else(home)?.canonicalize().ok()?;
    let first = origin(&found, generations - 1).unwrap_or(found);
    real.starts_with(&first).then_some(first)
}

/// Returns the name of the study in a file.
fn name_in(file: &Path) -> Option<String> {
    let text = String::from_utf8(read_regular(file).ok()?).ok()?;
    let table: toml::Table = text.parse().ok()?;
    Some(table.get("study")?.get("name")?.as_str()?.to_owned())
}

/// Returns a note on the option that a study in the file `written`, with the data of the study at `home`, needs.
pub(super) fn note(catalogue: &Catalogue, home: &Home, file: &StudyFile, written: &Path) -> Option<String> {
    let Home::File(study) = home else { return None };
    let (before, now) = (folder(catalogue, study), folder(&Catalogue::default(), written));
    let paths = file.data.iter().map(|(name, _)| study.with_file_name("").join(name));
    let mut needed: Vec<PathBuf> =
        paths.filter(|path| now.root_of(path).is_none()).filter_map(|path| before.root_of(&path)).collect();
    needed.sort();
    needed.dedup();
    let words: String = needed.iter().map(|folder| format!(" --allow-read {}", shell_word(folder))).collect();
    let shown = written.display();
    (!words.is_empty()).then(|| format!("note: {shown} reads data outside of its folder; use it with{words}\n"))
}

/// Returns a path as one word of a shell.
fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = text.chars().all(|c| c.is_alphanumeric() || "/._-+".contains(c));
    if is_plain { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}
