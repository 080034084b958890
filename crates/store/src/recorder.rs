//! Database of a run: opened before the run, filled during the run, closed after it.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread;
use std::time::{Duration, Instant};

use mops_core::{Cancellation, Problem, Study, Watch, run::Store};
use mops_language::Diagnostic;
use rusqlite::ErrorCode;

use super::best::best;
use super::companions::obstacle;
use super::database::{Database, Points, Slopes, is_of_machine, is_temporary};
use super::ending::Ending;
use super::identity::Identity;
use super::lock::FolderLock;
use super::memory::{Memory, Message, ROOM};
use super::open_error::OpenError;
use super::replace::make_room;
use super::runs::{RunRow, RunState};
use super::writer::{DelayedWatch, Unwritten, write};
use super::{FILE, file};

/// Largest number of pending messages to the writer; a run that is faster than the disk waits.
const QUEUE: usize = 4096;

/// Stored points that a run starts with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Start {
    /// No points.
    Fresh,
    /// Points of a run of the same study in the output folder.
    Resume,
    /// Points in this folder, of a run of a study with the same models.
    Reuse(PathBuf),
}

/// Time to wait for a lock or a full disk after the end of a run.
const WRITE_TIMEOUT: Duration = Duration::from_secs(10);

/// Database of a new run, with the stored points of earlier runs.
pub struct Recorder {
    database: Database,
    run: i64,
    rows: usize,
    memory: Arc<Memory>,
    messages: Receiver<Message>,
    /// True if there was no database before.
    new: bool,
    /// Note for the user.
    pub note: Option<String>,
    /// Digest of the identity of the run.
    pub id: String,
    /// Start of the run, in seconds since 1970-01-01 UTC.
    started: i64,
    /// Initial guess in the unit box, if not the start values.
    pub start_point: Option<Vec<f64>>,
    /// Lock on the folder; `None` for a replay.
    lock: Option<FolderLock>,
}

/// Database of a finished run.
pub struct FinishedRun {
    database: Database,
    run: i64,
    /// Number of points answered without a simulation.
    pub reused: usize,
    /// Number of simulated points.
    pub simulated: usize,
    unwritten: Option<Unwritten>,
    started: i64,
    new: bool,
    lock: Option<FolderLock>,
}

impl Recorder {
    /// Opens the database in a folder, for a run of this study.
    ///
    /// # Errors
    /// If the database is incompatible, in use by another run, or cannot be written.
    pub fn open(
        folder: &Path,
        start: &Start,
        study: &Study,
        identity: &Identity,
        run: &RunRow,
    ) -> Result<Self, OpenError> {
        let lock = lock_folder(folder)?;
        Database::clear_draft(&file(folder));
        let (mut note, mut known) = (None, None);
        let kept = match start {
            Start::Fresh => None,
            Start::Resume if is_empty(folder) => {
                note = Some(format!("no stored evaluations in {}; starting a new run", folder.display()));
                None
            }
            Start::Resume => Some(open_to_resume(folder, identity)?),
            Start::Reuse(from) => {
                let source = open_to_reuse(from, identity)?;
                if same_folder(from, folder) {
                    let before = stored_identity(&source, from)?;
                    drop(source);
                    let database = open_database(folder, true)?;
                    if !before.has_uncertain_of(identity) {
                        database.forget_beyond(study.tuners().len()).map_err(|error| database_error(folder, &error))?;
                    }
                    if !before.has_coordinates_of(identity) {
                        database.forget_slopes().map_err(|error| database_error(folder, &error))?;
                    }
                    Some(database)
                } else {
                    known = Some(source);
                    None
                }
            }
        };
        let cannot = |error: rusqlite::Error| database_error(folder, &error);
        let (points, slopes) = match known.as_ref().or(kept.as_ref()) {
            Some(source) => read(source, study, identity).map_err(cannot)?,
            None => (Points::new(), Slopes::new()),
        };
        let start_point = match (start, &kept) {
            (Start::Reuse(_), _) => {
                let problem = Problem::new(Arc::new(study.clone()));
                Some(best(&points, &problem).unwrap_or_else(|| problem.start()))
            }
            // A resumed run starts at its original initial guess.
            (_, Some(kept)) => kept.last_run().map_err(cannot)?.and_then(|run| run.start_point),
            (_, None) => None,
        };
        let run = RunRow { start_point: start_point.clone(), ..run.clone() };
        let (new, id, started) = (kept.is_none(), run.id(), run.started);
        let (database, run) = match kept {
            Some(database) => {
                let run = database.insert_run(&run).map_err(cannot)?;
                (database, run)
            }
            None => {
                let draft = Database::draft(&file(folder), &run).map_err(cannot)?;
                note = make_room(folder)?.or(note);
                let cannot = |error| OpenError::Failure(format!("cannot write {}: {error}", file(folder).display()));
                draft.commit().map_err(cannot)?
            }
        };
        let taken = database.room_taken().map_err(cannot)?;
        database.write_ahead().and_then(|()| database.waits(false)).map_err(cannot)?;
        Ending::clear(folder);
        let (memory, messages) = memory((points, slopes), known.is_some(), taken, None);
        let rows = study.rows().len();
        Ok(Self { database, run, rows, memory, messages, new, note, id, started, start_point, lock: Some(lock) })
    }

    /// Reads the stored points of a folder without writing there. At a point that is not stored, `end` is requested.
    ///
    /// # Errors
    /// If the database is incompatible or cannot be read.
    pub fn replay(folder: &Path, study: &Study, identity: &Identity, end: &Cancellation) -> Result<Self, OpenError> {
        let source = open_to_reuse(folder, identity)?;
        let cannot = |error: rusqlite::Error| database_error(folder, &error);
        let known = read(&source, study, identity).map_err(cannot)?;
        let (memory, messages) = memory(known, false, 0, Some(end.clone()));
        let start_point = source.last_run().map_err(cannot)?.and_then(|run| run.start_point);
        let database = Database::in_memory().map_err(cannot)?;
        let rows = study.rows().len();
        let id = String::new();
        Ok(Self {
            database,
            run: 0,
            rows,
            memory,
            messages,
            new: false,
            note: None,
            id,
            started: 0,
            start_point,
            lock: None,
        })
    }

    /// Returns the store of the points of the run.
    pub fn store(&self) -> Arc<dyn Store> {
        Arc::<Memory>::clone(&self.memory) as Arc<dyn Store>
    }

    /// Returns the number of stored points.
    pub fn known(&self) -> usize {
        self.memory.points.read().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Runs `task` and stores its points; `watch` is notified of points only after they are written.
    pub fn run<T>(self, watch: &dyn Watch, task: impl FnOnce(&dyn Watch) -> T) -> (T, FinishedRun) {
        let Self { database, run, rows, memory, messages, started, new, lock, .. } = self;
        thread::scope(|scope| {
            let writer = scope.spawn(move || write((database, run, rows), &messages, watch, WRITE_TIMEOUT));
            let end = End(&memory);
            let done = task(&DelayedWatch { memory: &memory, watch });
            drop(end);
            let (database, unwritten) = writer.join().expect("the writer does not panic");
            let count = |counter: &AtomicUsize| counter.load(Ordering::Relaxed);
            let (reused, simulated) = (count(&memory.reused), count(&memory.simulated));
            (done, FinishedRun { database, run, reused, simulated, unwritten, started, new, lock })
        })
    }
}

/// Guard that ends the writer, even if the task panics.
struct End<'m>(&'m Memory);

impl Drop for End<'_> {
    fn drop(&mut self) {
        let _ = self.0.sender.send(Message::End);
    }
}

impl FinishedRun {
    /// Restores the folder and the database before the result is written, if they were removed during the run. Returns
    /// a note for the user.
    ///
    /// # Errors
    /// If another run has locked the folder, or the folder cannot be created again.
    pub fn ensure_in_place(&mut self) -> Result<Option<String>, String> {
        let Some(lock) = &mut self.lock else { return Ok(None) };
        let folder = lock.folder().display().to_string();
        match lock.renew() {
            Ok(true) => {}
            Ok(false) => {
                return Err(format!("{folder} was removed during the run and is now used by another run"));
            }
            Err(error) => {
                return Err(format!("{folder} was removed during the run and cannot be created again: {error}"));
            }
        }
        if self.database.is_in_place() {
            return Ok(None);
        }
        Ok(Some(match self.database.restore() {
            Ok(true) => format!("{folder}/{FILE} was removed during the run and has been restored"),
            Ok(false) => {
                format!("{folder}/{FILE} was replaced during the run: the evaluations of this run are not stored")
            }
            Err(error) => {
                format!("{folder}/{FILE} was removed during the run and cannot be restored: {error}")
            }
        }))
    }

    /// Returns true if every point of the run is written.
    pub fn is_whole(&self) -> bool {
        self.unwritten.is_none()
    }

    /// Writes the end of the run and the number of its points; returns an error message if part of the run is not
    /// stored.
    pub fn end(self, state: RunState, evaluations: usize) -> Option<String> {
        let until = Instant::now() + WRITE_TIMEOUT;
        let ended = loop {
            match self.database.end(self.run, state, self.reused, evaluations) {
                Err(error) if is_temporary(&error) && Instant::now() < until && self.unwritten.is_none() => {
                    thread::sleep(Duration::from_millis(50));
                }
                ended => break ended,
            }
        };
        if let (Err(_), Some(lock)) = (&ended, self.lock.as_ref().filter(|lock| lock.is_valid())) {
            Ending::note(lock.folder(), self.started, state, evaluations);
        }
        match (self.unwritten, ended) {
            (Some(Unwritten { points, why }), _) => Some(format!("{points} evaluations could not be stored: {why}")),
            (None, Err(error)) => Some(format!("the end of the run could not be stored: {error}")),
            (None, Ok(())) => None,
        }
    }

    /// Removes the new database of a run that was refused.
    pub fn discard(self) {
        let Self { database, new, lock, .. } = self;
        drop(database);
        let Some(lock) = lock else { return };
        if new {
            let _ = fs::remove_file(file(lock.folder()));
        }
    }
}

/// Locks the folder of a run.
///
/// # Errors
/// If another run has locked the folder, or the folder cannot be written.
pub fn lock_folder(folder: &Path) -> Result<FolderLock, OpenError> {
    let cannot = |error: std::io::Error| OpenError::Failure(format!("cannot write in {}: {error}", folder.display()));
    FolderLock::take(folder).map_err(cannot)?.ok_or_else(|| {
        Diagnostic::new(format!("the folder {} is in use by another run", folder.display()))
            .with_help("wait until that run ends, or choose another folder with --out")
            .into()
    })
}

/// Returns true if a folder has no database, or a database without a run.
fn is_empty(folder: &Path) -> bool {
    let path = file(folder);
    match fs::symlink_metadata(&path) {
        Err(_) => true,
        Ok(_) => Database::is_blank(&path),
    }
}

fn memory(
    (points, slopes): (Points, Slopes),
    foreign: bool,
    taken: usize,
    closed: Option<Cancellation>,
) -> (Arc<Memory>, Receiver<Message>) {
    let (sender, messages) = sync_channel(QUEUE);
    let (reused, simulated) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let room = AtomicUsize::new(ROOM.saturating_sub(taken));
    let (points, slopes) = (RwLock::new(points), RwLock::new(slopes));
    (Arc::new(Memory { points, slopes, foreign, closed, sender, room, reused, simulated }), messages)
}

/// Reads the points and derivatives of a database that are valid for a study.
fn read(database: &Database, study: &Study, identity: &Identity) -> rusqlite::Result<(Points, Slopes)> {
    let mut notes: HashMap<String, &'static str> = HashMap::new();
    // Notes are a few fixed sentences of the program; each is leaked once.
    let mut intern = |note: &str| *notes.entry(note.to_owned()).or_insert_with(|| note.to_owned().leak());
    let mut points = database.points(study, &mut intern)?;
    let before = database.last_run()?.and_then(|run| serde_json::from_str::<Identity>(&run.identity).ok());
    let alike = before.as_ref().is_some_and(|before| before.has_coordinates_of(identity));
    let mut slopes = if alike { database.slopes()? } else { Slopes::new() };
    if before.is_none_or(|before| !before.has_uncertain_of(identity)) {
        points.retain(|key, _| key.len() == study.tuners().len());
        slopes.retain(|(key, _), _| key.len() == study.tuners().len());
    }
    Ok((points, slopes))
}

/// Opens the database of a run to be resumed.
fn open_to_resume(folder: &Path, now: &Identity) -> Result<Database, OpenError> {
    let database = open_database(folder, true)?;
    match stored_identity(&database, folder)?.refuses_to_continue(now) {
        None => Ok(database),
        Some(why) => Err(Diagnostic::new(format!("{} contains another run: {why}", folder.display()))
            .with_help("choose another folder with --out; --reuse DIR reuses the evaluations stored in DIR")
            .into()),
    }
}

/// Opens the database whose points are reused.
fn open_to_reuse(folder: &Path, now: &Identity) -> Result<Database, OpenError> {
    if !file(folder).is_file() {
        return Err(Diagnostic::new(format!("{} contains no {FILE}", folder.display()))
            .with_help("name the output folder (--out) of a run")
            .into());
    }
    let database = open_database(folder, false)?;
    match stored_identity(&database, folder)?.refuses_to_reuse(now) {
        None => Ok(database),
        Some(why) => {
            let message = format!("the values in {} belong to another study: {why}", folder.display());
            let help = "only demands, usages, weights, bounds, start values and the solver may differ";
            Err(Diagnostic::new(message).with_help(help).into())
        }
    }
}

fn stored_identity(database: &Database, folder: &Path) -> Result<Identity, OpenError> {
    let run = database.last_run().map_err(|error| database_error(folder, &error))?;
    let identity = run.and_then(|run| serde_json::from_str(&run.identity).ok());
    identity.ok_or_else(|| {
        Diagnostic::new(format!("{} contains no run", file(folder).display())).with_help("run the study again").into()
    })
}

fn open_database(folder: &Path, writes: bool) -> Result<Database, OpenError> {
    let path = file(folder);
    if writes && path.is_symlink() {
        return Err(Diagnostic::new(format!("{} is a symbolic link, which a run does not follow", path.display()))
            .with_help("copy the database to its place, or choose its folder with --out")
            .into());
    }
    if let Some(other) = obstacle(&path).filter(|other| *other != path) {
        return Err(Diagnostic::new(format!("{} is not a file, and SQLite would wait for it", other.display()))
            .with_help("remove it, or choose another folder with --out")
            .into());
    }
    Database::open(&path, writes).map_err(|error| database_error(folder, &error))?.ok_or_else(|| {
        Diagnostic::new(format!("{} is not a database of this version of mops", path.display()))
            .with_help("choose another folder with --out")
            .into()
    })
}

fn same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn database_error(folder: &Path, error: &rusqlite::Error) -> OpenError {
    if matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked)) {
        let fact = format!("{} is locked by another program", file(folder).display());
        return Diagnostic::new(fact).with_help("close it there, or choose another folder with --out").into();
    }
    let shown = file(folder);
    let shown = shown.display();
    if is_of_machine(error) {
        return OpenError::Failure(format!("{shown}: {error}"));
    }
    Diagnostic::new(format!("{shown} is damaged: {error}"))
        .with_help("a run without --resume begins anew, and renames the damaged file")
        .into()
}
