//! One run at a time in a folder.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// Holds the folder of a run; the system lets go of it when the process ends, however it ends.
pub(super) struct Lock {
    path: PathBuf,
    file: Option<File>,
}

impl Lock {
    /// Takes the folder; `None` where another run has it.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn take(folder: &Path) -> io::Result<Option<Self>> {
        let path = folder.join("evaluations.lock");
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(&path)?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Self { path, file: Some(file) })),
            Err(TryLockError::WouldBlock) => Ok(None),
            // A file system without locks: two runs at once are the user's care.
            Err(TryLockError::Error(_)) => Ok(Some(Self { path, file: Some(file) })),
        }
    }

    /// Whether a run has the folder now.
    pub fn is_held(folder: &Path) -> bool {
        let file = OpenOptions::new().write(true).open(folder.join("evaluations.lock"));
        file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // The name goes before the lock does, so that nobody takes a file that is about to vanish.
        let _ = fs::remove_file(&self.path);
        drop(self.file.take());
    }
}
