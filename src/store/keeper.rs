//! Opens the database of a run, and lets the run keep its points there.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, PoisonError, RwLock};

use mops_core::{Diagnostic, Merit, Problem, Store, Study, Watch};

use super::bytes;
use super::database::{Database, Points, RunRow, RunState, Slopes, now};
use super::identity::Identity;
use super::lock::Lock;
use super::memory::{Memory, Message, ROOM};
use super::writer::{Behind, write};
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
    /// As [`Start::Resume`], to look at: nothing is written.
    Look,
}

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
    folder: PathBuf,
    /// Whether there was no database before.
    new: bool,
    /// What the user may want to know.
    pub note: Option<String>,
    /// The point of the unit box where the run begins, if not at the start values.
    pub begin: Option<Vec<f64>>,
    lock: Option<Lock>,
}

/// The database of a run that is over.
pub(crate) struct Opened {
    database: Database,
    run: i64,
    /// Points that were answered without a simulation.
    pub reused: usize,
    /// Points that were simulated.
    pub simulated: usize,
    /// Why points were not written.
    pub trouble: Option<String>,
    folder: PathBuf,
    new: bool,
    lock: Option<Lock>,
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
        if *start == Start::Look {
            return Self::look(folder, study, identity);
        }
        let cannot =
            |error: std::io::Error| Refusal::Failure(format!("{} cannot be written: {error}", folder.display()));
        fs::create_dir_all(folder).map_err(cannot)?;
        let lock = Lock::take(folder).map_err(cannot)?.ok_or_else(|| {
            Diagnostic::new(format!("another run is writing in {}", folder.display()))
                .with_help("wait for it, or choose another folder with --out")
        })?;
        let (mut note, mut known) = (None, None);
        let kept = match start {
            Start::Fresh => {
                note = put_away(folder)?;
                None
            }
            Start::Look | Start::Resume if !file(folder).is_file() => {
                note = Some(format!("{} holds no evaluations yet: the run begins anew", folder.display()));
                None
            }
            Start::Look | Start::Resume => Some(continued(folder, identity)?),
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
                    note = put_away(folder)?;
                    None
                }
            }
        };
        let new = kept.is_none();
        let database = match kept {
            Some(database) => database,
            None => Database::create(&file(folder)).map_err(|error| trouble(folder, &error))?,
        };
        let (points, slopes) =
            read(known.as_ref().unwrap_or(&database), study, identity).map_err(|e| trouble(folder, &e))?;
        let taken = database.room_taken().map_err(|error| trouble(folder, &error))?;
        let begin = match start {
            Start::Fresh => None,
            // A run that is continued begins where it began.
            Start::Look | Start::Resume => {
                database.last_run().map_err(|e| trouble(folder, &e))?.and_then(|run| run.begin)
            }
            Start::Reuse(_) => {
                let problem = Problem::new(Arc::new(study.clone()));
                Some(best(&points, &problem).unwrap_or_else(|| problem.start()))
            }
        };
        let run = RunRow { begin: begin.clone(), ..run.clone() };
        let run = database.begin(&run).map_err(|error| trouble(folder, &error))?;
        let (memory, messages) = memory(points, slopes, known.is_some(), taken);
        let (rows, folder) = (study.rows.len(), folder.to_owned());
        Ok(Self { database, run, rows, memory, messages, folder, new, note, begin, lock: Some(lock) })
    }

    /// What is known in a folder, with nothing written there.
    fn look(folder: &Path, study: &Study, identity: &Identity) -> Result<Self, Refusal> {
        let source = reused(folder, identity)?;
        let (points, slopes) = read(&source, study, identity).map_err(|error| trouble(folder, &error))?;
        let (memory, messages) = memory(points, slopes, false, 0);
        let begin = source.last_run().map_err(|error| trouble(folder, &error))?.and_then(|run| run.begin);
        let database = Database::create(Path::new(":memory:")).map_err(|error| trouble(folder, &error))?;
        let (rows, folder) = (study.rows.len(), folder.to_owned());
        Ok(Self { database, run: 0, rows, memory, messages, folder, new: false, note: None, begin, lock: None })
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
        let Self { database, run, rows, memory, messages, folder, new, lock, .. } = self;
        std::thread::scope(|scope| {
            let writer = scope.spawn(move || write((database, run, rows), &messages, watch));
            let end = End(&memory);
            let done = task(&Behind { memory: &memory, watch });
            drop(end);
            let (database, trouble) = writer.join().expect("the writer does not panic");
            let count = |counter: &AtomicUsize| counter.load(Ordering::Relaxed);
            let (reused, simulated) = (count(&memory.reused), count(&memory.simulated));
            (done, Opened { database, run, reused, simulated, trouble, folder, new, lock })
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
    /// Enters how the run ended, and how many points it has.
    pub fn end(self, state: RunState, evaluations: usize) -> Option<String> {
        let ended = self.database.end(self.run, state, self.reused, evaluations).err().map(|error| error.to_string());
        self.trouble.or(ended)
    }

    /// Takes back what was made for a run that did not begin.
    pub fn withdraw(self) {
        let Self { database, folder, new, lock, .. } = self;
        drop(database);
        if new {
            let _ = fs::remove_file(file(&folder));
        }
        drop(lock);
        // A folder with something in it stays.
        let _ = fs::remove_dir(&folder);
    }
}

fn memory(points: Points, slopes: Slopes, foreign: bool, taken: usize) -> (Arc<Memory>, Receiver<Message>) {
    let (sender, messages) = sync_channel(QUEUE);
    let (reused, simulated) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let room = AtomicUsize::new(ROOM.saturating_sub(taken));
    let (points, slopes) = (RwLock::new(points), RwLock::new(slopes));
    (Arc::new(Memory { points, slopes, foreign, sender, room, reused, simulated }), messages)
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

/// Makes room for a new database; one of a run that came to no end is kept beside it.
fn put_away(folder: &Path) -> Result<Option<String>, Refusal> {
    let path = file(folder);
    if !path.exists() {
        return Ok(None);
    }
    let unfinished = Database::open(&path, true).ok().flatten().and_then(|old| {
        let run = old.last_run().ok().flatten()?;
        let count = old.count().ok().filter(|count| *count > 0)?;
        matches!(run.state, RunState::Running | RunState::Interrupted).then_some(count)
    });
    let cannot = |error: std::io::Error| Refusal::Failure(format!("{} cannot be replaced: {error}", path.display()));
    for end in ["-wal", "-shm"] {
        let _ = fs::remove_file(folder.join(format!("{FILE}{end}")));
    }
    let Some(count) = unfinished else {
        fs::remove_file(&path).map_err(cannot)?;
        return Ok(None);
    };
    let aside = folder.join("evaluations.previous.sqlite");
    fs::rename(&path, &aside).map_err(cannot)?;
    Ok(Some(format!(
        "the {count} evaluations of an unfinished run are now in {}; --resume would have continued it",
        aside.display()
    )))
}

fn same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn trouble(folder: &Path, error: &rusqlite::Error) -> Refusal {
    Refusal::Failure(format!("{}: {error}", file(folder).display()))
}

/// The point of the unit box at which the best known point under the demands of the problem lies, of those that the problem
/// can reach: within the bounds, and with its values of the tuners that are kept.
fn best(points: &Points, problem: &Problem) -> Option<Vec<f64>> {
    let mut best: Option<(Merit, &Vec<u64>, Vec<f64>)> = None;
    for (key, known) in points {
        if key.len() != problem.study().tuners.len() {
            continue;
        }
        let tuners: Vec<f64> = key.iter().map(|&bits| f64::from_bits(bits)).collect();
        let Some(found) = problem.known(&tuners, known).filter(|found| found.scaled.is_some()) else { continue };
        // Of equals the one with the smaller key, whatever the order of a map.
        let wins = best.as_ref().is_none_or(|(merit, of, _)| {
            found.merit.is_better_than(merit) || (!merit.is_better_than(&found.merit) && key < *of)
        });
        if wins {
            let point: Vec<f64> = problem.active().iter().map(|&i| position(problem, i, tuners[i])).collect();
            if bytes::key(&problem.tuners_at(&point)) == *key {
                best = Some((found.merit, key, point));
            }
        }
    }
    Some(best?.2)
}

/// The place of a tuner's value within its bounds, to the bit: the place from which that very value comes, if there is one.
fn position(problem: &Problem, tuner: usize, value: f64) -> f64 {
    let tuner = &problem.study().tuners[tuner];
    let near = tuner.position_of(value);
    let (mut up, mut down) = (near, near);
    for _ in 0..64 {
        for place in [up, down] {
            if (0.0..=1.0).contains(&place) && tuner.value_at(place) == value {
                return place;
            }
        }
        (up, down) = (up.next_up(), down.next_down());
    }
    near
}

/// The row of a run that begins now.
pub(crate) fn row(identity: &Identity) -> RunRow {
    RunRow {
        begun: now(),
        state: RunState::Running,
        mops: env!("CARGO_PKG_VERSION").to_owned(),
        command: std::env::args().collect::<Vec<_>>().join(" "),
        home: String::new(),
        settings: Vec::new(),
        name: String::new(),
        task: String::new(),
        text: String::new(),
        identity: serde_json::to_string(identity).expect("an identity is JSON"),
        seed: 0,
        solver: String::new(),
        max_evaluations: 0,
        begin: None,
        evaluations: 0,
    }
}
