//! What becomes of the database that a new run finds in its folder: a finished run of this version is replaced, all else set
//! aside.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use mops_core::Diagnostic;
use rusqlite::{Connection, OpenFlags};

use super::database::{Database, is_passing};
use super::file;
use super::keeper::Refusal;
use super::place::with_companions;
use super::runs::RunState;

/// Makes room for the database of a new run; what the user may want to know of the old one.
///
/// # Errors
/// The old one is open in another program: a file that is moved under its feet may be damaged, or damage the new one
/// (<https://sqlite.org/howtocorrupt.html>, section 1.4).
pub(super) fn make_room(folder: &Path) -> Result<Option<String>, Refusal> {
    let path = file(folder);
    if fs::symlink_metadata(&path).is_err() {
        // What SQLite kept beside a database that is gone would be taken for part of the new one.
        set_aside(folder)?;
        return Ok(None);
    }
    let in_use = |what: &str| {
        Refusal::Mistake(
            Diagnostic::new(format!("{} is open in another program, and {what}", path.display()))
                .with_help("close it there, or choose another folder with --out"),
        )
    };
    if Database::is_blank(&path) {
        return if is_alone(&path) { Ok(None) } else { Err(in_use("cannot be replaced")) };
    }
    let old = match Database::open(&path, true) {
        Err(error) if is_passing(&error) => return Err(in_use("cannot be replaced")),
        // What cannot be read is not understood.
        old => old.ok().flatten(),
    };
    let Some(old) = old else {
        if !is_alone(&path) {
            return Err(in_use("is no database of this version of mops: it cannot be set aside"));
        }
        let aside = set_aside(folder)?;
        let aside = aside.display();
        return Ok(Some(format!("{} was no database of this version of mops; it is now {aside}", path.display())));
    };
    let gathered = old.gather();
    let (run, count) = (old.last_run(), old.count());
    drop(old);
    match gathered {
        Ok(true) => {}
        Ok(false) => return Err(in_use("cannot be replaced")),
        Err(error) => return Err(Refusal::Failure(format!("{}: {error}", path.display()))),
    }
    let unfinished = match (run, count) {
        (_, Ok(0)) => None,
        (Ok(Some(run)), Ok(_)) if !matches!(run.state, RunState::Running | RunState::Interrupted) => None,
        (_, count) => Some(count.map_or_else(|_| "the".to_owned(), |count| format!("the {count}"))),
    };
    let Some(which) = unfinished else { return Ok(None) };
    let aside = set_aside(folder)?;
    let aside = aside.display();
    Ok(Some(format!("{which} evaluations of an unfinished run are now in {aside}; --resume would have continued it")))
}

/// Whether a database of others is open in no other program; what is no database is. Then all of it is in one file: the last
/// connection that closes takes over what SQLite kept beside it.
fn is_alone(path: &Path) -> bool {
    let Ok(connection) = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE) else { return true };
    let tried = connection
        .busy_timeout(Duration::from_secs(1))
        .and_then(|()| connection.pragma_update(None, "locking_mode", "EXCLUSIVE"))
        .and_then(|()| connection.execute_batch("BEGIN EXCLUSIVE; ROLLBACK;"));
    !tried.is_err_and(|error| is_passing(&error))
}

/// Moves the database to a name that is free, with what is beside it and SQLite could not take over; where to.
fn set_aside(folder: &Path) -> Result<PathBuf, Refusal> {
    let path = file(folder);
    let names = (1..).map(|i| match i {
        1 => "evaluations.previous.sqlite".to_owned(),
        i => format!("evaluations.previous-{i}.sqlite"),
    });
    // The log of another database beside it would be taken for a part of this one.
    let is_free = |aside: &PathBuf| with_companions(aside).iter().all(|name| fs::symlink_metadata(name).is_err());
    let aside = names.map(|name| folder.join(name)).find(is_free).expect("some name is free");
    // The database comes last: a kill in between leaves it where the next run finds it.
    for (from, to) in with_companions(&path).into_iter().zip(with_companions(&aside)).rev() {
        if fs::symlink_metadata(&from).is_ok() {
            let cannot = |error| Refusal::Failure(format!("{} cannot be set aside: {error}", path.display()));
            fs::rename(&from, &to).map_err(cannot)?;
        }
    }
    Ok(aside)
}
