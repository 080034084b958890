//! Atomic file writes: each file is written under a temporary name in the same folder and then renamed.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Prefix of a file name during writing. The name is fixed, so that the next process replaces the remains of a killed one;
/// only one process at a time writes in the folder of a run.
const TEMPORARY_PREFIX: &str = ".new-";

/// File being written. If dropped before [`AtomicFile::commit`], an existing file remains unchanged.
///
/// N.B.: a symbolic link at either name is replaced, not followed.
pub(crate) struct AtomicFile {
    file: Option<BufWriter<File>>,
    temporary: PathBuf,
    path: PathBuf,
}

impl AtomicFile {
    /// Creates the temporary file for `path`.
    ///
    /// # Errors
    /// If the folder is not writable.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let temporary = cleared_temporary_path(path)?;
        let file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        Ok(Self { file: Some(BufWriter::new(file)), temporary, path: path.to_owned() })
    }

    /// Renames the temporary file to its final path.
    ///
    /// # Errors
    /// If the file cannot be written or renamed.
    pub(crate) fn commit(mut self) -> io::Result<()> {
        self.close()?;
        fs::rename(&self.temporary, &self.path)
    }

    /// Syncs the bytes to the disk and renames the temporary file, so that the file also survives a loss of power.
    ///
    /// # Errors
    /// As [`AtomicFile::commit`].
    pub(crate) fn commit_synced(mut self) -> io::Result<()> {
        self.close()?.sync_data()?;
        fs::rename(&self.temporary, &self.path)
    }

    fn close(&mut self) -> io::Result<File> {
        let file = self.file.take().expect("it is closed once");
        file.into_inner().map_err(io::IntoInnerError::into_error)
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().expect("it is open").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().expect("it is open").flush()
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        // After a rename the temporary name no longer exists.
        let _ = fs::remove_file(&self.temporary);
    }
}

/// Returns the temporary path of a file during writing.
pub(crate) fn temporary_path(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(TEMPORARY_PREFIX);
    name.push(path.file_name().unwrap_or_default());
    path.with_file_name(name)
}

/// Returns the temporary path of a file, after removing a leftover there.
fn cleared_temporary_path(path: &Path) -> io::Result<PathBuf> {
    let temporary = temporary_path(path);
    match fs::remove_file(&temporary) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(temporary),
    }
}

/// Lets `write` create a file at a temporary path and renames it, for writers that need a path.
///
/// # Errors
/// If the file cannot be written or renamed.
pub(crate) fn make(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let temporary = cleared_temporary_path(path)?;
    let made = write(&temporary).and_then(|()| fs::rename(&temporary, path));
    if made.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    made
}

/// Writes a CSV file.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write_csv(
    path: &Path,
    fill: impl FnOnce(&mut csv::Writer<AtomicFile>) -> Result<(), csv::Error>,
) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(AtomicFile::create(path)?);
    fill(&mut writer)?;
    writer.into_inner().map_err(csv::IntoInnerError::into_error)?.commit()
}

/// Writes a whole file.
///
/// # Errors
/// If the file cannot be written; an existing file then remains unchanged.
pub(crate) fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(content.as_ref())?;
    file.commit()
}

/// Returns true if `path` names the given file.
#[cfg(unix)]
pub(crate) fn is_at(path: &Path, file: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).is_ok_and(|there| (there.dev(), there.ino()) == (file.dev(), file.ino()))
}

/// Returns true if `path` exists: on this platform an open file cannot be replaced.
#[cfg(not(unix))]
pub(crate) fn is_at(path: &Path, _: &Metadata) -> bool {
    path.exists()
}

/// Reads a regular file. Devices and pipes are refused, as they may be endless.
///
/// # Errors
/// If the file cannot be read or is not a regular file.
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
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        // The leftover of a killed process is replaced.
        fs::write(temporary_path(&path), "left").unwrap();
        write(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write(&folder.path().join("none/a"), "").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_replaced_and_their_targets_stay() {
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
