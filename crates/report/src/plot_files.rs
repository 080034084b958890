//! Plot files of a report: files of an earlier report that the present one does not write are removed. Other files in
//! the folder stay.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use mops_content::numbers::file_name;
use mops_output::Outputs;

use mops_language::files::read_regular;

/// File that lists the plots of a folder, one name without extension per line.
const LIST: &str = ".pictures";

/// Plot files of an earlier report.
pub(super) struct PlotFiles<'o> {
    folder: PathBuf,
    outputs: &'o Outputs,
    names: BTreeSet<String>,
}

impl<'o> PlotFiles<'o> {
    /// Reads the list of a folder; empty without a list.
    pub(super) fn of(folder: &Path, outputs: &'o Outputs) -> Self {
        let list = read_regular(&folder.join(LIST)).unwrap_or_default();
        let list = String::from_utf8_lossy(&list);
        // A name that leads out of the folder is not ours.
        let names = list.lines().filter(|name| file_name(name) == **name).map(str::to_owned).collect();
        Self { folder: folder.to_owned(), outputs, names }
    }

    /// Adds names to the list before the files are written, so that an interruption leaves no unlisted file.
    ///
    /// # Errors
    /// If the list cannot be written.
    pub(super) fn note<'n>(&'n self, names: impl Iterator<Item = &'n str>) -> io::Result<()> {
        self.write(names.chain(self.names.iter().map(String::as_str)).collect())
    }

    /// Removes the earlier files that are not among `names`.
    ///
    /// # Errors
    /// If a file cannot be removed or is an input, or the list cannot be written.
    pub(super) fn remove_others<'n>(&self, names: impl Iterator<Item = &'n str>) -> io::Result<()> {
        let names: BTreeSet<&str> = names.collect();
        for name in self.names.iter().filter(|name| !names.contains(name.as_str())) {
            for end in ["svg", "png"] {
                let path = self.folder.join(format!("{name}.{end}"));
                self.outputs.check(&path)?;
                match fs::remove_file(path) {
                    Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                    _ => {}
                }
            }
        }
        self.write(names)
    }

    fn write(&self, names: BTreeSet<&str>) -> io::Result<()> {
        let list: String = names.iter().map(|name| format!("{name}\n")).collect();
        self.outputs.write(&self.folder.join(LIST), list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plots_of_an_earlier_report_are_removed_and_other_files_stay() {
        let (folder, outputs) = (tempfile::tempdir().unwrap(), Outputs::default());
        let (plots, at) = (folder.path().join("plots"), |name: &str| folder.path().join("plots").join(name));
        fs::create_dir(&plots).unwrap();
        fs::write(folder.path().join("outside.svg"), "").unwrap();
        let draw = |names: &[&str]| {
            let earlier = PlotFiles::of(&plots, &outputs);
            earlier.note(names.iter().copied()).unwrap();
            for name in names {
                ["svg", "png"].iter().for_each(|end| fs::write(at(&format!("{name}.{end}")), "").unwrap());
            }
            earlier.remove_others(names.iter().copied()).unwrap();
        };
        fs::write(at("mine.svg"), "").unwrap();
        fs::write(at("notes.md"), "").unwrap();
        draw(&["a", "b"]);
        draw(&["b", "c"]);
        for (name, exists) in [
            ("a.svg", false),
            ("a.png", false),
            ("b.svg", true),
            ("c.png", true),
            ("mine.svg", true),
            ("notes.md", true),
        ] {
            assert_eq!(at(name).exists(), exists, "{name}");
        }
        // The next report removes the files of one that was killed.
        PlotFiles::of(&plots, &outputs).note(["d"].into_iter()).unwrap();
        fs::write(at("d.svg"), "").unwrap();
        fs::write(at(LIST), fs::read_to_string(at(LIST)).unwrap() + "../outside\n/etc/passwd\n").unwrap();
        draw(&["c"]);
        assert!(!at("d.svg").exists() && !at("b.png").exists() && at("c.svg").exists());
        assert!(folder.path().join("outside.svg").exists());
    }
}
