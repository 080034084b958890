//! Writer thread: writes points in batches, and reports progress of a run only after it is written.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use mops_core::{
    Evaluation, Halt, Watch,
    run::{RowSlopes, State as RunState},
};

use super::database::{Database, PointRow, is_temporary};
use super::memory::{Memory, Message};

/// Number of points and derivatives after which they are written, unless the last attempt failed.
const BATCH: usize = 256;

/// Largest number of points and derivatives in one transaction. After a full disk, some of many chunks may fit.
const CHUNK: usize = 4096;

/// Longest time before a point is written, and time between attempts after a failure.
const PERIOD: Duration = Duration::from_millis(500);

/// Points that could not be written.
pub(super) struct Unwritten {
    /// Number of points.
    pub points: usize,
    pub why: String,
}

/// Writer with its pending messages.
struct Writer<'w> {
    database: Database,
    run: i64,
    /// Number of rows of the study.
    rows: usize,
    watch: &'w dyn Watch,
    points: Vec<PointRow>,
    slopes: Vec<(Vec<u64>, f64, Option<RowSlopes>)>,
    evaluations: usize,
    state: Option<RunState>,
    best: Option<Box<Evaluation>>,
    /// Time of the last attempt to write.
    tried: Instant,
    /// Error of the last attempt, if it failed.
    error: Option<String>,
    /// True if the error is a lock or a full disk.
    is_temporary: bool,
}

/// Writes all messages, then retries unwritten points for at most `timeout`. Returns the database, and the points that
/// could not be written.
pub(super) fn write(
    (database, run, rows): (Database, i64, usize),
    messages: &Receiver<Message>,
    watch: &dyn Watch,
    timeout: Duration,
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
        error: None,
        is_temporary: false,
    };
    loop {
        match messages.recv_timeout(PERIOD.saturating_sub(writer.tried.elapsed()).max(Duration::from_millis(1))) {
            Ok(Message::End) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(message) => writer.take(message),
            Err(RecvTimeoutError::Timeout) => writer.commit(),
        }
    }
    let until = Instant::now() + timeout;
    loop {
        writer.commit();
        if writer.error.is_none() || !writer.is_temporary || Instant::now() > until {
            break;
        }
        thread::sleep(PERIOD / 5);
    }
    let points = writer.points.len();
    (writer.database, writer.error.map(|why| Unwritten { points, why }))
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
                if self.error.is_none() {
                    self.commit();
                }
                self.watch.stage(&what, done);
            }
            Message::End => {}
        }
        if self.points.len() + self.slopes.len() >= BATCH && self.error.is_none() {
            self.commit();
        }
    }

    /// Writes the pending points, then reports the progress. After an error, points stay pending and nothing is
    /// reported.
    fn commit(&mut self) {
        self.tried = Instant::now();
        if let Err(error) = self.write_all() {
            self.is_temporary = is_temporary(&error);
            if self.error.is_none() {
                self.watch.keeping(Some(&error.to_string()));
            }
            self.error = Some(error.to_string());
            return;
        }
        if self.error.take().is_some() {
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

/// Observer that passes progress to the writer, which reports it to `watch` after it is written.
pub(super) struct DelayedWatch<'w> {
    pub memory: &'w Memory,
    pub watch: &'w dyn Watch,
}

impl DelayedWatch<'_> {
    fn send(&self, message: Message) {
        let _ = self.memory.sender.send(message);
    }
}

impl Watch for DelayedWatch<'_> {
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
