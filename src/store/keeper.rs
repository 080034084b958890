//! Opens the database of a run, and lets the run keep its points there.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread;
use std::time::{Duration, Instant};

use mops_core::{Cancellation, Diagnostic, Problem, Store, Study, Watch};
use rusqlite::ErrorCode;

use super::aside::make_room;
use super::best::best;
use super::claim::Claim;
use super::database::{Database, Points, Slopes, is_passing};
use super::ending::Ending;
use super::identity::Identity;
use super::memory::{Memory, Message, ROOM};
use super::runs::{RunRow, RunState};
use super::writer::{Behind, Unwritten, write};
use super::{FILE, file};

/// Messages that wait for the writer, at most: a run that is faster than the disk waits for it.
const QUEUE: usize = 4096;

/// What a run begins with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Start {
    /// Nothing.
    Fresh,
    /// What a run of the same study left in the folder.
    Resume,
    /// What a run of a study with the same models left in this folder.
    Reuse(PathBuf),
}

/// How long a lock or a full disk is waited for once the run is over.
const PATIENCE: Duration = Duration::from_secs(10);

/// Why a database is not opened.
pub(crate) enum Refusal {
    /// The user's mistake.
    Mistake(Diagnostic),
    /// The machine's trouble.
    Failure(String),
}

impl From<Diagnostic> for Refusal {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Mistake(diagnostic)
    }
}

/// The database of a run that goes, and what was known before it.
pub(crate) struct Keeper {
    database: Database,
    run: i64,
    rows: usize,
    memory: Arc<Memory>,
    messages: Receiver<Message>,
    /// Whether there was no database before.
    new: bool,
    /// What the user may want to know.
    pub note: Option<String>,
    /// What the run was asked, as a digest; and when it began.
    pub id: String,
    begun: i64,
    /// The point of the unit box where the run begins, if not at the start values.
    pub begin: Option<Vec<f64>>,
    /// The folder; none where it is only looked at.
    claim: Option<Claim>,
}

/// The database of a run that is over.
pub(crate) struct Opened {
    database: Database,
    run: i64,
    /// Points that were answered without a simulation.
    pub reused: usize,
    /// Points that were simulated.
    pub simulated: usize,
    unwritten: Option<Unwritten>,
    begun: i64,
    new: bool,
    claim: Option<Claim>,
}

impl Keeper {
    /// Opens the database in a folder, for a run of this study.
    ///
    /// # Errors
    /// It holds something else, another run has it, or it cannot be written.
    pub fn open(
        folder: &Path,
        start: &Start,
        study: &Study,
        identity: &Identity,
        run: &RunRow,
    ) -> Result<Self, Refusal> {
        let claim = claim(folder)?;
        Database::clear_draft(&file(folder));
        let (mut note, mut known) = (None, None);
        let kept = match start {
            Start::Fresh => None,
            Start::Resume if holds_nothing(folder) => {
                note = Some(format!("{} holds no evaluations yet: the run begins anew", folder.display()));
                None
            }
            Start::Resume => Some(continued(folder, identity)?),
            Start::Reuse(from) => {
                let source = reused(from, identity)?;
                if same_folder(from, folder) {
                    let before = before(&source, from)?;
                    drop(source);
                    let database = opened(folder, true)?;
                    if !before.has_uncertain_of(identity) {
                        database.forget_beyond(study.tuners.len()).map_err(|error| trouble(folder, &error))?;
                    }
                    if !before.has_coordinates_of(identity) {
                        database.forget_slopes().map_err(|error| trouble(folder, &error))?;
                    }
                    Some(database)
                } else {
                    known = Some(source);
                    None
                }
            }
        };
        let cannot = |error: rusqlite::Error| trouble(folder, &error);
        let (points, slopes) = match known.as_ref().or(kept.as_ref()) {
            Some(source) => read(source, study, identity).map_err(cannot)?,
            None => (Points::new(), Slopes::new()),
        };
        let begin = match (start, &kept) {
            (Start::Reuse(_), _) => {
                let problem = Problem::new(Arc::new(study.clone()));
                Some(best(&points, &problem).unwrap_or_else(|| problem.start()))
            }
            // A run that is continued begins where it began.
            (_, Some(kept)) => kept.last_run().map_err(cannot)?.and_then(|run| run.begin),
            (_, None) => None,
        };
        let run = RunRow { begin: begin.clone(), ..run.clone() };
        let (new, id, begun) = (kept.is_none(), run.id(), run.begun);
        let (database, run) = match kept {
            Some(database) => {
                let run = database.begin(&run).map_err(cannot)?;
                (database, run)
            }
            None => {
                let draft = Database::draft(&file(folder), &run).map_err(cannot)?;
                note = make_room(folder)?.or(note);
                let cannot = |error| Refusal::Failure(format!("{} cannot be written: {error}", file(folder).display()));
                draft.commit().map_err(cannot)?
            }
        };
        let taken = database.room_taken().map_err(cannot)?;
        database.write_ahead().and_then(|()| database.waits(false)).map_err(cannot)?;
        Ending::clear(folder);
        let (memory, messages) = memory((points, slopes), known.is_some(), taken, None);
        let rows = study.rows.len();
        Ok(Self { database, run, rows, memory, messages, new, note, id, begun, begin, claim: Some(claim) })
    }

    /// What is known in a folder, with nothing written there. At a point that is not known `end` is asked to end the run.
    ///
    /// # Errors
    /// It holds something else, or cannot be read.
    pub fn look(folder: &Path, study: &Study, identity: &Identity, end: &Cancellation) -> Result<Self, Refusal> {
        let source = reused(folder, identity)?;
        let cannot = |error: rusqlite::Error| trouble(folder, &error);
        let known = read(&source, study, identity).map_err(cannot)?;
        let (memory, messages) = memory(known, false, 0, Some(end.clone()));
        let begin = source.last_run().map_err(cannot)?.and_then(|run| run.begin);
        let database = Database::in_memory().map_err(cannot)?;
        let rows = study.rows.len();
        let id = String::new();
        Ok(Self { database, run: 0, rows, memory, messages, new: false, note: None, id, begun: 0, begin, claim: None })
    }

    /// Where the run finds and keeps its points.
    pub fn store(&self) -> Arc<dyn Store> {
        Arc::<Memory>::clone(&self.memory) as Arc<dyn Store>
    }

    /// The number of points known from before.
    pub fn known(&self) -> usize {
        self.memory.points.read().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Does `task`, which is watched by `watch`: it is told only of points that are written.
    pub fn run<T>(self, watch: &dyn Watch, task: impl FnOnce(&dyn Watch) -> T) -> (T, Opened) {
        let Self { database, run, rows, memory, messages, begun, new, claim, .. } = self;
        thread::scope(|scope| {
            let writer = scope.spawn(move || write((database, run, rows), &messages, watch, PATIENCE));
            let end = End(&memory);
            let done = task(&Behind { memory: &memory, watch });
            drop(end);
            let (database, unwritten) = writer.join().expect("the writer does not panic");
            let count = |counter: &AtomicUsize| counter.load(Ordering::Relaxed);
            let (reused, simulated) = (count(&memory.reused), count(&memory.simulated));
            (done, Opened { database, run, reused, simulated, unwritten, begun, new, claim })
        })
    }
}

/// Ends the writer, even where the task panics.
struct End<'m>(&'m Memory);

impl Drop for End<'_> {
    fn drop(&mut self) {
        let _ = self.0.sender.send(Message::End);
    }
}

impl Opened {
    /// Makes sure that the folder is still that of this run, and that its database is there, before its result is written:
    /// somebody may have removed them while the run went. What the user must know.
    ///
    /// # Errors
    /// Another run has the folder by now, or it cannot be made again.
    pub fn hold(&mut self) -> Result<Option<String>, String> {
        let Some(claim) = &mut self.claim else { return Ok(None) };
        let folder = claim.folder().display().to_string();
        match claim.renew() {
            Ok(true) => {}
            Ok(false) => {
                return Err(format!("{folder} was removed while the run went, and another run writes there now"));
            }
            Err(error) => {
                return Err(format!("{folder} was removed while the run went, and cannot be made again: {error}"));
            }
        }
        if self.database.is_in_place() {
            return Ok(None);
        }
        Ok(Some(match self.database.restore() {
            Ok(true) => format!("{folder}/{FILE} was removed while the run went; it is written again"),
            Ok(false) => format!("{folder}/{FILE} is another file now: the evaluations of this run are not kept"),
            Err(error) => {
                format!("{folder}/{FILE} was removed while the run went, and cannot be written again: {error}")
            }
        }))
    }

    /// Whether every point of the run is written.
    pub fn is_whole(&self) -> bool {
        self.unwritten.is_none()
    }

    /// Enters how the run ended, and how many points it has; why not all of it is kept, if it is not.
    pub fn end(self, state: RunState, evaluations: usize) -> Option<String> {
        let until = Instant::now() + PATIENCE;
        let ended = loop {
            match self.database.end(self.run, state, self.reused, evaluations) {
                Err(error) if is_passing(&error) && Instant::now() < until && self.unwritten.is_none() => {
                    thread::sleep(Duration::from_millis(50));
                }
                ended => break ended,
            }
        };
        if let (Err(_), Some(claim)) = (&ended, self.claim.as_ref().filter(|claim| claim.holds())) {
            Ending::note(claim.folder(), self.begun, state, evaluations);
        }
        match (self.unwritten, ended) {
            (Some(Unwritten { points, why }), _) => Some(format!("{points} evaluations could not be kept: {why}")),
            (None, Err(error)) => Some(format!("the end of the run could not be entered: {error}")),
            (None, Ok(())) => None,
        }
    }

    /// Takes back what was made for a run that did not begin.
    pub fn withdraw(self) {
        let Self { database, new, claim, .. } = self;
        drop(database);
        let Some(claim) = claim else { return };
        if new {
            let _ = fs::remove_file(file(claim.folder()));
        }
    }
}

/// Claims the folder of a run.
///
/// # Errors
/// Another run has it, or nothing can be written there.
pub(crate) fn claim(folder: &Path) -> Result<Claim, Refusal> {
    let cannot = |error: std::io::Error| Refusal::Failure(format!("{} cannot be written: {error}", folder.display()));
    Claim::take(folder).map_err(cannot)?.ok_or_else(|| {
        Diagnostic::new(format!("another run is writing in {}", folder.display()))
            .with_help("wait for it, or choose another folder with --out")
            .into()
    })
}

/// Whether a folder has no database, or one in which no run was ever entered.
fn holds_nothing(folder: &Path) -> bool {
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

/// The points and derivatives of a database that hold for a study.
fn read(database: &Database, study: &Study, identity: &Identity) -> rusqlite::Result<(Points, Slopes)> {
    let mut notes: HashMap<String, &'static str> = HashMap::new();
    // Notes are sentences of the program, a handful: each is made again once.
    let mut intern = |note: &str| *notes.entry(note.to_owned()).or_insert_with(|| note.to_owned().leak());
    let mut points = database.points(study, &mut intern)?;
    let before = database.last_run()?.and_then(|run| serde_json::from_str::<Identity>(&run.identity).ok());
    let alike = before.as_ref().is_some_and(|before| before.has_coordinates_of(identity));
    let mut slopes = if alike { database.slopes()? } else { Slopes::new() };
    if before.is_none_or(|before| !before.has_uncertain_of(identity)) {
        points.retain(|key, _| key.len() == study.tuners.len());
        slopes.retain(|(key, _), _| key.len() == study.tuners.len());
    }
    Ok((points, slopes))
}

/// The database of a run that is continued.
fn continued(folder: &Path, now: &Identity) -> Result<Database, Refusal> {
    let database = opened(folder, true)?;
    match before(&database, folder)?.refuses_to_continue(now) {
        None => Ok(database),
        Some(why) => Err(Diagnostic::new(format!("{} holds another run: {why}", folder.display()))
            .with_help(
                "run it into a folder of its own; with --reuse DIR it need not simulate again what is known in DIR",
            )
            .into()),
    }
}

/// The database whose points are used again.
fn reused(folder: &Path, now: &Identity) -> Result<Database, Refusal> {
    if !file(folder).is_file() {
        return Err(Diagnostic::new(format!("{} holds no {FILE}", folder.display()))
            .with_help("name the folder of a run, as --out had it")
            .into());
    }
    let database = opened(folder, false)?;
    match before(&database, folder)?.refuses_to_reuse(now) {
        None => Ok(database),
        Some(why) => {
            let message = format!("the values in {} are those of another study: {why}", folder.display());
            let help = "demands, usages, weights, bounds, start values and the solver may change; what a simulation computes may not";
            Err(Diagnostic::new(message).with_help(help).into())
        }
    }
}

fn before(database: &Database, folder: &Path) -> Result<Identity, Refusal> {
    let run = database.last_run().map_err(|error| trouble(folder, &error))?;
    let identity = run.and_then(|run| serde_json::from_str(&run.identity).ok());
    identity.ok_or_else(|| {
        Diagnostic::new(format!("{} names no run", file(folder).display())).with_help("run the study anew").into()
    })
}

fn opened(folder: &Path, writes: bool) -> Result<Database, Refusal> {
    let path = file(folder);
    Database::open(&path, writes).map_err(|error| trouble(folder, &error))?.ok_or_else(|| {
        Diagnostic::new(format!("{} is no database of this version of mops", path.display()))
            .with_help("choose another folder with --out")
            .into()
    })
}

fn same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn trouble(folder: &Path, error: &rusqlite::Error) -> Refusal {
    if matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked)) {
        let fact = format!("{} is locked by another program", file(folder).display());
        return Diagnostic::new(fact).with_help("close it there, or choose another folder with --out").into();
    }
    Refusal::Failure(format!("{}: {error}", file(folder).display()))
}
