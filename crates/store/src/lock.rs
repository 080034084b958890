//! Lock on the folder of a run, which admits one run at a time.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use mops_output::is_at;

const FILE: &str = "evaluations.lock";

/// Time during which a lock is retried, as a process that only checks for a running run holds it for a moment.
const RETRY_PERIOD: Duration = Duration::from_millis(300);

/// Lock on the folder of a run: no other run writes there. The operating system releases it when the process ends.
pub struct FolderLock {
    folder: PathBuf,
    file: File,
    /// True if the folder was created by this lock.
    created: bool,
}

impl FolderLock {
    /// Locks a folder, and creates it if necessary; returns `None` if another run has locked it.
    ///
    /// # Errors
    /// If the folder or the lock file cannot be created.
    pub(super) fn take(folder: &Path) -> io::Result<Option<Self>> {
        let created = !folder.exists();
        fs::create_dir_all(folder)?;
        let until = Instant::now() + RETRY_PERIOD;
        loop {
            let file = open(&folder.join(FILE))?;
            match file.try_lock() {
                // The previous owner may have removed the file meanwhile; this lock would then exclude nobody.
                Ok(()) if !is_named(&file, &folder.join(FILE)) => {}
                // On a file system without locks, the user must not start two runs at once.
                Ok(()) | Err(TryLockError::Error(_)) => {
                    return Ok(Some(Self { folder: folder.to_owned(), file, created }));
                }
                Err(TryLockError::WouldBlock) if Instant::now() > until => return Ok(None),
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(10)),
            }
        }
    }

    /// Locks the folder again if the folder or the lock file was removed; returns `false` if another run has locked it
    /// since.
    ///
    /// # Errors
    /// As [`FolderLock::take`].
    pub(super) fn renew(&mut self) -> io::Result<bool> {
        if self.is_valid() {
            return Ok(true);
        }
        let Some(new) = Self::take(&self.folder)? else { return Ok(false) };
        *self = new;
        Ok(true)
    }

    /// Returns true if the lock file is still in place.
    pub(super) fn is_valid(&self) -> bool {
        is_named(&self.file, &self.folder.join(FILE))
    }

    /// Returns the locked folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns true if a run has locked the folder.
    pub(super) fn is_locked(folder: &Path) -> bool {
        let path = folder.join(FILE);
        // To open a pipe would wait for its writer.
        let file = fs::symlink_metadata(&path).ok().filter(fs::Metadata::is_file).map(|_| File::open(&path));
        file.is_some_and(|file| file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))))
    }
}

/// Opens or creates the lock file. A symbolic link of its name is replaced; a pipe, which would be waited for, is
/// refused.
fn open(path: &Path) -> io::Result<File> {
    loop {
        match OpenOptions::new().write(true).create_new(true).open(path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            created => return created,
        }
        match fs::symlink_metadata(path) {
            Ok(entry) if entry.is_symlink() => fs::remove_file(path)?,
            Ok(entry) if !entry.is_file() => {
                return Err(io::Error::new(ErrorKind::InvalidInput, format!("{} is not a file", path.display())));
            }
            _ => match OpenOptions::new().write(true).open(path) {
                // The file was removed in between.
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                opened => return opened,
            },
        }
    }
}

/// Returns true if `path` names the open file.
fn is_named(file: &File, path: &Path) -> bool {
    file.metadata().is_ok_and(|file| is_at(path, &file))
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // The file is removed before the lock is released, so that no other process locks a file that is about to
        // vanish.
        if self.is_valid() {
            let _ = fs::remove_file(self.folder.join(FILE));
            if self.created {
                // Fails for a folder that is not empty.
                let _ = fs::remove_dir(&self.folder);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_run_at_a_time_locks_a_folder_and_the_lock_file_is_removed() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        let lock = FolderLock::take(&folder).unwrap().unwrap();
        assert!(FolderLock::is_locked(&folder));
        assert!(FolderLock::take(&folder).unwrap().is_none());
        drop(lock);
        assert!(!FolderLock::is_locked(&folder));
        assert!(!folder.exists());
        fs::create_dir(&folder).unwrap();
        drop(FolderLock::take(&folder).unwrap().unwrap());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        assert!(!FolderLock::is_locked(&root.path().join("nowhere")));
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_on_a_removed_file_excludes_nobody() {
        let root = tempfile::tempdir().unwrap();
        let (folder, lock) = (root.path(), root.path().join(FILE));
        // The owner removes the file between the opening and the locking by another process.
        let lost = open(&lock).unwrap();
        fs::remove_file(&lock).unwrap();
        lost.lock().unwrap();
        assert!(!is_named(&lost, &lock));
        let lock = FolderLock::take(folder).unwrap().unwrap();
        assert!(FolderLock::take(folder).unwrap().is_none());
        drop(lock);
    }

    #[cfg(unix)]
    #[test]
    fn a_removed_folder_is_locked_again_unless_another_run_has_locked_it() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a");
        let mut lock = FolderLock::take(&folder).unwrap().unwrap();
        assert!(lock.renew().unwrap());
        fs::remove_dir_all(&folder).unwrap();
        assert!(lock.renew().unwrap() && FolderLock::is_locked(&folder));
        fs::remove_dir_all(&folder).unwrap();
        let other = FolderLock::take(&folder).unwrap().unwrap();
        assert!(!lock.renew().unwrap());
        drop(lock);
        assert!(FolderLock::is_locked(&folder));
        drop(other);
        assert!(!folder.exists());
    }
}
