//! The thread that writes: points in batches, and what is told of a run only once it is written.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use mops_core::{Evaluation, Halt, RowSlopes, RunState, Watch};

use super::database::{Database, PointRow, is_passing};
use super::memory::{Memory, Message};

/// Points and derivatives that are written together, at most, unless earlier ones could not be written.
const BATCH: usize = 256;

/// Points and derivatives in one transaction, at most: of many that waited for room, some may find it.
const CHUNK: usize = 4096;

/// How long a point waits to be written, at most; and how long after a failure it is tried again.
const PERIOD: Duration = Duration::from_millis(500);

/// What could not be written to the end.
pub(super) struct Unwritten {
    /// Number of points.
    pub points: usize,
    pub why: String,
}

/// What is to be written and told.
struct Writer<'w> {
    database: Database,
    run: i64,
    /// Rows of the study.
    rows: usize,
    watch: &'w dyn Watch,
    points: Vec<PointRow>,
    slopes: Vec<(Vec<u64>, f64, Option<RowSlopes>)>,
    evaluations: usize,
    state: Option<RunState>,
    best: Option<Box<Evaluation>>,
    /// When it was last tried to write.
    tried: Instant,
    /// Why nothing can be written at present.
    trouble: Option<String>,
    /// Whether that is a lock, or a full disk.
    may_pass: bool,
}

/// Writes until there is no more, and then for `patience` what could not be written; the database, and what is left.
pub(super) fn write(
    (database, run, rows): (Database, i64, usize),
    messages: &Receiver<Message>,
    watch: &dyn Watch,
    patience: Duration,
) -> (Database, Option<Unwritten>) {
    let mut writer = Writer {
        database,
        run,
        rows,
        watch,
        points: Vec::new(),
        slopes: Vec::new(),
        evaluations: 0,
        state: None,
        best: None,
        tried: Instant::now(),
        trouble: None,
        may_pass: false,
    };
    loop {
        match messages.recv_timeout(PERIOD.saturating_sub(writer.tried.elapsed()).max(Duration::from_millis(1))) {
            Ok(Message::End) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(message) => writer.take(message),
            Err(RecvTimeoutError::Timeout) => writer.commit(),
        }
    }
    let until = Instant::now() + patience;
    loop {
        writer.commit();
        if writer.trouble.is_none() || !writer.may_pass || Instant::now() > until {
            break;
        }
        thread::sleep(PERIOD / 5);
    }
    let points = writer.points.len();
    (writer.database, writer.trouble.map(|why| Unwritten { points, why }))
}

impl Writer<'_> {
    fn take(&mut self, message: Message) {
        match message {
            Message::Point(point) => self.points.push(point),
            Message::Slopes(tuners, reach, slopes) => self.slopes.push((tuners, reach, slopes)),
            Message::State(state) => {
                self.evaluations = state.evaluations;
                self.state = Some(state);
                if self.tried.elapsed() >= PERIOD {
                    self.commit();
                }
            }
            Message::Best(best) => self.best = Some(best),
            Message::Stage(what, done) => {
                if self.trouble.is_none() {
                    self.commit();
                }
                self.watch.stage(&what, done);
            }
            Message::End => {}
        }
        if self.points.len() + self.slopes.len() >= BATCH && self.trouble.is_none() {
            self.commit();
        }
    }

    /// Writes what there is, then tells of it. What cannot be written stays, and nothing is told of it.
    fn commit(&mut self) {
        self.tried = Instant::now();
        if let Err(error) = self.write_all() {
            self.may_pass = is_passing(&error);
            if self.trouble.is_none() {
                self.watch.keeping(Some(&error.to_string()));
            }
            self.trouble = Some(error.to_string());
            return;
        }
        if self.trouble.take().is_some() {
            self.watch.keeping(None);
        }
        if let Some(state) = self.state.take() {
            self.watch.evaluated(&state);
        }
        if let Some(best) = self.best.take() {
            self.watch.improved(&best);
        }
    }
}

impl Writer<'_> {
    fn write_all(&mut self) -> rusqlite::Result<()> {
        while !self.points.is_empty() || !self.slopes.is_empty() || self.state.is_some() {
            let points = self.points.len().min(CHUNK);
            let slopes = self.slopes.len().min(CHUNK);
            let is_last = points == self.points.len() && slopes == self.slopes.len();
            let evaluations = is_last.then_some(self.evaluations);
            self.database.write(self.run, self.rows, &self.points[..points], &self.slopes[..slopes], evaluations)?;
            self.points.drain(..points);
            self.slopes.drain(..slopes);
            if is_last {
                break;
            }
        }
        Ok(())
    }
}

/// Looks on for somebody who is told only of what is written.
pub(super) struct Behind<'w> {
    pub memory: &'w Memory,
    pub watch: &'w dyn Watch,
}

impl Behind<'_> {
    fn send(&self, message: Message) {
        let _ = self.memory.sender.send(message);
    }
}

impl Watch for Behind<'_> {
    fn wants_stop(&self) -> bool {
        self.watch.wants_stop()
    }

    fn halt(&self) -> Halt {
        self.watch.halt()
    }

    fn evaluated(&self, state: &RunState) {
        self.send(Message::State(*state));
    }

    fn improved(&self, best: &Evaluation) {
        self.send(Message::Best(Box::new(Evaluation { residuals: Vec::new(), ..best.clone() })));
    }

    fn stage(&self, what: &str, done: f64) {
        self.send(Message::Stage(what.to_owned(), done));
    }
}
