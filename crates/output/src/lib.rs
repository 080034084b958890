//! Output files: each is written completely or not at all, and none replaces an input of the same command.
//!
//! A file is written under a temporary name in its folder and then renamed. [`Outputs`] writes the files of a command,
//! and refuses to write ([`Overwrites`]) where one of its [`Inputs`] is. [`AtomicFile`] is one file being written.

mod inputs;

use std::fmt;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

pub use inputs::Inputs;

/// Prefix of a file name during writing. The name is fixed, so that the next process replaces the remains of a killed
/// one; only one process at a time writes in the folder of a run.
const TEMPORARY_PREFIX: &str = ".new-";

/// Writer of all output files of a command. It refuses to replace a file that the command reads, and follows no
/// symbolic link below the folder of the outputs: a link is replaced.
#[derive(Debug, Default)]
pub struct Outputs {
    inputs: Inputs,
}

/// Refusal to replace an input.
#[derive(Debug)]
pub struct Overwrites {
    path: PathBuf,
    what: String,
}

impl fmt::Display for Overwrites {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` would overwrite {}", self.path.display(), self.what)
    }
}

impl std::error::Error for Overwrites {}

impl Outputs {
    /// Creates the writer of a command that reads `inputs`.
    pub fn besides(inputs: Inputs) -> Self {
        Self { inputs }
    }

    /// Checks that no input has a path, or the temporary path of its file.
    ///
    /// # Errors
    /// If writing the path would replace an input ([`Overwrites`]).
    pub fn check(&self, path: &Path) -> io::Result<()> {
        let what = self.inputs.at(path).or_else(|| self.inputs.at(&temporary_path(path)));
        match what {
            None => Ok(()),
            Some(what) => Err(io::Error::other(Overwrites { path: path.to_owned(), what: what.to_owned() })),
        }
    }

    /// Creates the temporary file for `path`.
    ///
    /// # Errors
    /// If the path is that of an input, or the folder is not writable.
    pub fn create(&self, path: &Path) -> io::Result<AtomicFile> {
        self.check(path)?;
        AtomicFile::create(path)
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// As [`Outputs::create`]; an existing file then remains unchanged.
    pub fn write(&self, path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
        let mut file = self.create(path)?;
        file.write_all(content.as_ref())?;
        file.commit()
    }

    /// Writes a CSV file.
    ///
    /// # Errors
    /// As [`Outputs::write`].
    pub fn write_csv(
        &self,
        path: &Path,
        fill: impl FnOnce(&mut csv::Writer<AtomicFile>) -> Result<(), csv::Error>,
    ) -> io::Result<()> {
        let mut writer = csv::Writer::from_writer(self.create(path)?);
        fill(&mut writer)?;
        writer.into_inner().map_err(csv::IntoInnerError::into_error)?.commit()
    }

    /// Creates a folder in the folder of the outputs. A symbolic link of its name is replaced.
    ///
    /// # Errors
    /// If an input is read through such a link, or the folder cannot be created.
    pub fn folder(&self, path: &Path) -> io::Result<()> {
        if path.is_symlink() {
            self.check(path)?;
            fs::remove_file(path)?;
        }
        fs::create_dir_all(path)
    }
}

/// File being written. If dropped before [`AtomicFile::commit`], an existing file remains unchanged.
///
/// N.B.: a symbolic link at either name is replaced, not followed.
pub struct AtomicFile {
    file: Option<BufWriter<File>>,
    temporary: PathBuf,
    path: PathBuf,
}

impl AtomicFile {
    fn create(path: &Path) -> io::Result<Self> {
        let temporary = cleared_temporary_path(path)?;
        let file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        Ok(Self { file: Some(BufWriter::new(file)), temporary, path: path.to_owned() })
    }

    /// Renames the temporary file to its final path.
    ///
    /// # Errors
    /// If the file cannot be written or renamed.
    pub fn commit(mut self) -> io::Result<()> {
        self.close()?;
        fs::rename(&self.temporary, &self.path)
    }

    /// Syncs the bytes to the disk and renames the temporary file, so that the file also survives a loss of power.
    ///
    /// # Errors
    /// As [`AtomicFile::commit`].
    pub fn commit_synced(mut self) -> io::Result<()> {
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
pub fn temporary_path(path: &Path) -> PathBuf {
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

/// Returns true if `path` names the given file.
#[cfg(unix)]
pub fn is_at(path: &Path, file: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).is_ok_and(|there| (there.dev(), there.ino()) == (file.dev(), file.ino()))
}

/// Returns true if `path` exists: on this platform an open file cannot be replaced.
#[cfg(not(unix))]
pub fn is_at(path: &Path, _: &Metadata) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_stays() {
        let (folder, outputs) = (tempfile::tempdir().unwrap(), Outputs::default());
        let path = folder.path().join("a.json");
        outputs.write(&path, "old").unwrap();
        let mut file = outputs.create(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        // The leftover of a killed process is replaced.
        fs::write(temporary_path(&path), "left").unwrap();
        outputs.write(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(outputs.write(&folder.path().join("none/a"), "").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_are_replaced_and_their_targets_stay() {
        use std::os::unix::fs::symlink;
        let (folder, outputs) = (tempfile::tempdir().unwrap(), Outputs::default());
        let at = |name: &str| folder.path().join(name);
        fs::write(at("precious"), "mine").unwrap();
        symlink(at("precious"), at("result.json")).unwrap();
        symlink(at("precious"), at(".new-result.json")).unwrap();
        outputs.write(&at("result.json"), "new").unwrap();
        assert_eq!(fs::read_to_string(at("precious")).unwrap(), "mine");
        assert!(!at("result.json").is_symlink() && !at(".new-result.json").exists());
        assert_eq!(fs::read_to_string(at("result.json")).unwrap(), "new");
    }
}
