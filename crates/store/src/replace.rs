//! Replacement of an existing database by that of a new run. A finished run of this version is replaced, any other file
//! is renamed.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use mops_language::Diagnostic;
use rusqlite::{Connection, OpenFlags};

use super::companions::{obstacle, with_companions};
use super::database::{Database, is_of_machine, is_temporary};
use super::file;
use super::open_error::OpenError;
use super::runs::RunState;

/// Makes room for the database of a new run; returns a note for the user if an old database was renamed.
///
/// # Errors
/// If the old database is open in another program: moving it could damage both databases
/// (<https://sqlite.org/howtocorrupt.html>, section 1.4).
pub(super) fn make_room(folder: &Path) -> Result<Option<String>, OpenError> {
    let path = file(folder);
    let Ok(entry) = fs::symlink_metadata(&path) else {
        // SQLite would read the leftover log of a removed database as part of the new one.
        set_aside(folder)?;
        return Ok(None);
    };
    let renamed = |fact: &str| {
        let aside = set_aside(folder)?;
        Ok(Some(format!("{} {fact}; renamed to {}", path.display(), aside.display())))
    };
    if !entry.is_file() {
        return renamed("is not a database of this version of mops");
    }
    if let Some(other) = obstacle(&path) {
        return renamed(&format!("cannot be read beside {}, which is not a file", other.display()));
    }
    let in_use = |what: &str| {
        OpenError::Mistake(
            Diagnostic::new(format!("{} is open in another program, and {what}", path.display()))
                .with_help("close it there, or choose another folder with --out"),
        )
    };
    if Database::is_blank(&path) {
        return if is_alone(&path) { Ok(None) } else { Err(in_use("cannot be replaced")) };
    }
    let old = match Database::open(&path, true) {
        Err(error) if is_temporary(&error) => return Err(in_use("cannot be replaced")),
        // An unreadable file counts as foreign.
        old => old.ok().flatten(),
    };
    let Some(old) = old else {
        if !is_alone(&path) {
            return Err(in_use("cannot be renamed; it is not a database of this version of mops"));
        }
        return renamed("is not a database of this version of mops");
    };
    let gathered = old.gather();
    let (run, count) = (old.last_run(), old.count());
    drop(old);
    match gathered {
        Ok(true) => {}
        Ok(false) => return Err(in_use("cannot be replaced")),
        Err(error) if is_of_machine(&error) => return Err(OpenError::Failure(format!("{}: {error}", path.display()))),
        Err(_) if !is_alone(&path) => return Err(in_use("cannot be renamed; it is damaged")),
        Err(_) => return renamed("is damaged"),
    }
    let unfinished = match (run, count) {
        (_, Ok(0)) => None,
        (Ok(Some(run)), Ok(_)) if !matches!(run.state, RunState::Running | RunState::Interrupted) => None,
        (_, count) => Some(count.map_or_else(|_| "the".to_owned(), |count| format!("the {count}"))),
    };
    let Some(which) = unfinished else { return Ok(None) };
    let aside = set_aside(folder)?;
    let aside = aside.display();
    Ok(Some(format!(
        "{which} evaluations of an unfinished run were moved to {aside}; --resume would have continued it"
    )))
}

/// Returns true if no other program has the foreign database open, or if the file is not a database. All of the
/// database is then in one file, as the last connection that closes merges the log of SQLite into it.
fn is_alone(path: &Path) -> bool {
    let Ok(connection) = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE) else { return true };
    let tried = connection
        .busy_timeout(Duration::from_secs(1))
        .and_then(|()| connection.pragma_update(None, "locking_mode", "EXCLUSIVE"))
        .and_then(|()| connection.execute_batch("BEGIN EXCLUSIVE; ROLLBACK;"));
    !tried.is_err_and(|error| is_temporary(&error))
}

/// Renames the database, with companion files that SQLite could not merge, to a free name; returns the new path.
fn set_aside(folder: &Path) -> Result<PathBuf, OpenError> {
    let path = file(folder);
    let names = (1..).map(|i| match i {
        1 => "evaluations.previous.sqlite".to_owned(),
        i => format!("evaluations.previous-{i}.sqlite"),
    });
    // SQLite would read the log of another database next to it as part of this one.
    let is_free = |aside: &PathBuf| with_companions(aside).iter().all(|name| fs::symlink_metadata(name).is_err());
    let aside = names.map(|name| folder.join(name)).find(is_free).expect("some name is free");
    // The database is moved last: after a kill in between, the next run still finds it.
    for (from, to) in with_companions(&path).into_iter().zip(with_companions(&aside)).rev() {
        if fs::symlink_metadata(&from).is_ok() {
            let cannot = |error| OpenError::Failure(format!("cannot rename {}: {error}", path.display()));
            fs::rename(&from, &to).map_err(cannot)?;
        }
    }
    Ok(aside)
}
