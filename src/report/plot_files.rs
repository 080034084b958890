//! Which pictures are those of a report: what an earlier one drew in the folder, and this one does not, goes. What others put
//! there stays.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::files;
use crate::numbers::file_name;

/// The file that lists the pictures of a folder, a name without ending in each line.
const LIST: &str = ".pictures";

/// PlotFiles that an earlier report left in its folder.
pub(super) struct PlotFiles {
    folder: PathBuf,
    names: BTreeSet<String>,
}

impl PlotFiles {
    /// Those of a folder; none where nothing was noted.
    pub(super) fn of(folder: &Path) -> Self {
        let list = files::read(&folder.join(LIST)).unwrap_or_default();
        let list = String::from_utf8_lossy(&list);
        // A list that leads out of the folder is none of ours.
        let names = list.lines().filter(|name| file_name(name) == **name).map(str::to_owned).collect();
        Self { folder: folder.to_owned(), names }
    }

    /// Notes these beside the earlier ones, before they are drawn: whatever happens then, all of them are known.
    ///
    /// # Errors
    /// The list cannot be written.
    pub(super) fn note<'n>(&'n self, names: impl Iterator<Item = &'n str>) -> io::Result<()> {
        self.write(names.chain(self.names.iter().map(String::as_str)).collect())
    }

    /// Removes the earlier ones that are none of these.
    ///
    /// # Errors
    /// A picture cannot be removed, or the list not be written.
    pub(super) fn remove_others<'n>(&self, names: impl Iterator<Item = &'n str>) -> io::Result<()> {
        let names: BTreeSet<&str> = names.collect();
        for name in self.names.iter().filter(|name| !names.contains(name.as_str())) {
            for end in ["svg", "png"] {
                match fs::remove_file(self.folder.join(format!("{name}.{end}"))) {
                    Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                    _ => {}
                }
            }
        }
        self.write(names)
    }

    fn write(&self, names: BTreeSet<&str>) -> io::Result<()> {
        let list: String = names.iter().map(|name| format!("{name}\n")).collect();
        files::write(&self.folder.join(LIST), list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_an_earlier_report_go_and_all_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (plots, at) = (folder.path().join("plots"), |name: &str| folder.path().join("plots").join(name));
        fs::create_dir(&plots).unwrap();
        fs::write(folder.path().join("outside.svg"), "").unwrap();
        let draw = |names: &[&str]| {
            let earlier = PlotFiles::of(&plots);
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
        for (name, there) in [
            ("a.svg", false),
            ("a.png", false),
            ("b.svg", true),
            ("c.png", true),
            ("mine.svg", true),
            ("notes.md", true),
        ] {
            assert_eq!(at(name).exists(), there, "{name}");
        }
        // Of one that was killed while it drew, the next one knows all.
        PlotFiles::of(&plots).note(["d"].into_iter()).unwrap();
        fs::write(at("d.svg"), "").unwrap();
        fs::write(at(LIST), fs::read_to_string(at(LIST)).unwrap() + "../outside\n/etc/passwd\n").unwrap();
        draw(&["c"]);
        assert!(!at("d.svg").exists() && !at("b.png").exists() && at("c.svg").exists());
        assert!(folder.path().join("outside.svg").exists());
    }
}
