//! One run at a time in a folder.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use crate::files::is_at;

const FILE: &str = "evaluations.lock";

/// How long a lock is tried: who only asks whether a run goes holds it for a moment.
const TRIED: Duration = Duration::from_millis(300);

/// A claim on the folder of a run: no other run writes there. The system lets go of it when the process ends, however it ends.
pub(crate) struct Claim {
    folder: PathBuf,
    file: File,
    /// Whether the folder was not there before.
    made: bool,
}

impl Claim {
    /// Claims a folder, which is made where it is not there; `None` where another run has it.
    ///
    /// # Errors
    /// The folder or the file cannot be made.
    pub fn take(folder: &Path) -> io::Result<Option<Self>> {
        let made = !folder.exists();
        fs::create_dir_all(folder)?;
        let until = Instant::now() + TRIED;
        loop {
            let file = open(&folder.join(FILE))?;
            match file.try_lock() {
                // Who had the name before may have removed it meanwhile: then this lock keeps nobody away.
                Ok(()) if !is_named(&file, &folder.join(FILE)) => {}
                // A file system without locks: two runs at once are the user's care.
                Ok(()) | Err(TryLockError::Error(_)) => {
                    return Ok(Some(Self { folder: folder.to_owned(), file, made }));
                }
                Err(TryLockError::WouldBlock) if Instant::now() > until => return Ok(None),
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(10)),
            }
        }
    }

    /// Claims the folder again where it, or the file, was removed meanwhile; `false` where another run has it by now.
    ///
    /// # Errors
    /// As [`Claim::take`].
    pub fn renew(&mut self) -> io::Result<bool> {
        if self.holds() {
            return Ok(true);
        }
        let Some(new) = Self::take(&self.folder)? else { return Ok(false) };
        *self = new;
        Ok(true)
    }

    /// Whether the folder is still that of this claim.
    pub fn holds(&self) -> bool {
        is_named(&self.file, &self.folder.join(FILE))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether a run has the folder now.
    pub fn is_held(folder: &Path) -> bool {
        let file = OpenOptions::new().read(true).open(folder.join(FILE));
        file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

/// Opens the file to lock; where it is not there, a link of its name makes none elsewhere.
fn open(path: &Path) -> io::Result<File> {
    loop {
        match OpenOptions::new().write(true).create_new(true).open(path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return made,
        }
        match OpenOptions::new().write(true).open(path) {
            // Removed in between.
            Err(error) if error.kind() == ErrorKind::NotFound && !path.is_symlink() => {}
            opened => return opened,
        }
    }
}

/// Whether the open file is the one that has this name.
fn is_named(file: &File, path: &Path) -> bool {
    file.metadata().is_ok_and(|file| is_at(path, &file))
}

impl Drop for Claim {
    fn drop(&mut self) {
        // The name goes before the lock does, so that nobody takes a file that is about to vanish.
        if self.holds() {
            let _ = fs::remove_file(self.folder.join(FILE));
            if self.made {
                // A folder with something in it stays.
                let _ = fs::remove_dir(&self.folder);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_has_a_folder_and_leaves_nothing_there() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        let claim = Claim::take(&folder).unwrap().unwrap();
        assert!(Claim::is_held(&folder));
        assert!(Claim::take(&folder).unwrap().is_none());
        drop(claim);
        assert!(!Claim::is_held(&folder));
        assert!(!folder.exists());
        fs::create_dir(&folder).unwrap();
        drop(Claim::take(&folder).unwrap().unwrap());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        assert!(!Claim::is_held(&root.path().join("nowhere")));
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_on_a_name_that_is_gone_keeps_nobody_away() {
        let root = tempfile::tempdir().unwrap();
        let (folder, lock) = (root.path(), root.path().join(FILE));
        // As if its owner had removed it between the opening and the lock of another.
        let lost = open(&lock).unwrap();
        fs::remove_file(&lock).unwrap();
        lost.lock().unwrap();
        assert!(!is_named(&lost, &lock));
        let claim = Claim::take(folder).unwrap().unwrap();
        assert!(Claim::take(folder).unwrap().is_none());
        drop(claim);
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_was_removed_is_claimed_again_unless_another_run_has_it() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a");
        let mut claim = Claim::take(&folder).unwrap().unwrap();
        assert!(claim.renew().unwrap());
        fs::remove_dir_all(&folder).unwrap();
        assert!(claim.renew().unwrap() && Claim::is_held(&folder));
        fs::remove_dir_all(&folder).unwrap();
        let other = Claim::take(&folder).unwrap().unwrap();
        assert!(!claim.renew().unwrap());
        drop(claim);
        assert!(Claim::is_held(&folder));
        drop(other);
        assert!(!folder.exists());
    }
}
