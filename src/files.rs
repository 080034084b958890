//! Files that are whole or not there: each is written beside its place and renamed into it.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What stands before the name of a file while it is written. The name is always the same, so that what a killed process left
/// is replaced by the next one; one process at a time writes in the folder of a run.
const BESIDE: &str = ".new-";

/// A file that is being written. Dropped before [`Beside::settle`] it leaves the file that was there as it was.
///
/// N.B.: neither name is followed where it is a symbolic link: the link is replaced.
pub(crate) struct Beside {
    file: Option<BufWriter<File>>,
    beside: PathBuf,
    path: PathBuf,
}

impl Beside {
    /// Begins to write the file that will be at `path`.
    ///
    /// # Errors
    /// Nothing can be written there.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let beside = free(path)?;
        let file = OpenOptions::new().write(true).create_new(true).open(&beside)?;
        Ok(Self { file: Some(BufWriter::new(file)), beside, path: path.to_owned() })
    }

    /// Moves what was written to its place.
    ///
    /// # Errors
    /// It cannot be written, or moved.
    pub(crate) fn settle(mut self) -> io::Result<()> {
        self.close()?;
        fs::rename(&self.beside, &self.path)
    }

    /// The same once all bytes are on the disk, so that the file survives a loss of power too.
    ///
    /// # Errors
    /// As [`Beside::settle`].
    pub(crate) fn settle_on_disk(mut self) -> io::Result<()> {
        self.close()?.sync_data()?;
        fs::rename(&self.beside, &self.path)
    }

    fn close(&mut self) -> io::Result<File> {
        let file = self.file.take().expect("it is closed once");
        file.into_inner().map_err(io::IntoInnerError::into_error)
    }
}

impl Write for Beside {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().expect("it is open").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().expect("it is open").flush()
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        // Renamed files have no such name any more.
        let _ = fs::remove_file(&self.beside);
    }
}

/// Where a file is written before it is renamed.
pub(crate) fn beside(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(BESIDE);
    name.push(path.file_name().unwrap_or_default());
    path.with_file_name(name)
}

/// The same, with nothing there.
fn free(path: &Path) -> io::Result<PathBuf> {
    let beside = beside(path);
    match fs::remove_file(&beside) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(beside),
    }
}

/// Lets `write` make a file, for those who want a path, and moves it to its place.
///
/// # Errors
/// It cannot be written, or moved.
pub(crate) fn make(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let beside = free(path)?;
    let made = write(&beside).and_then(|()| fs::rename(&beside, path));
    if made.is_err() {
        let _ = fs::remove_file(&beside);
    }
    made
}

/// Writes a table as CSV.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_csv(
    path: &Path,
    fill: impl FnOnce(&mut csv::Writer<Beside>) -> Result<(), csv::Error>,
) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(Beside::create(path)?);
    fill(&mut writer)?;
    writer.into_inner().map_err(csv::IntoInnerError::into_error)?.settle()
}

/// Writes a whole file.
///
/// # Errors
/// The file cannot be written; what was there before is as it was.
pub(crate) fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file = Beside::create(path)?;
    file.write_all(content.as_ref())?;
    file.settle()
}

/// Whether the file of this name is this one.
#[cfg(unix)]
pub(crate) fn is_at(path: &Path, file: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).is_ok_and(|there| (there.dev(), there.ino()) == (file.dev(), file.ino()))
}

/// Whether the file of this name is this one: elsewhere a file that is open cannot be replaced.
#[cfg(not(unix))]
pub(crate) fn is_at(path: &Path, _: &Metadata) -> bool {
    path.exists()
}

/// The bytes of a regular file. Devices and pipes, which may have no end, are refused.
///
/// # Errors
/// The file cannot be read, or is none.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    mops_core::data::read_regular(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write(&path, "old").unwrap();
        let mut file = Beside::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        // What a killed process left is in nobody's way.
        fs::write(beside(&path), "left").unwrap();
        write(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write(&folder.path().join("none/a"), "").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_replaced_and_what_they_lead_to_stays() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("precious"), "mine").unwrap();
        symlink(at("precious"), at("result.json")).unwrap();
        symlink(at("precious"), at(".new-result.json")).unwrap();
        write(&at("result.json"), "new").unwrap();
        assert_eq!(fs::read_to_string(at("precious")).unwrap(), "mine");
        assert!(!at("result.json").is_symlink() && !at(".new-result.json").exists());
        assert_eq!(fs::read_to_string(at("result.json")).unwrap(), "new");
    }
}
