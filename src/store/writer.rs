//! The thread that writes: points in batches, and what is told of a run only once it is written.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use mops_core::{Evaluation, RowSlopes, RunState, Watch};

use super::database::{Database, PointRow};
use super::memory::{Memory, Message};

/// Points and derivatives that are written together, at most.
const BATCH: usize = 256;

/// How long a point waits to be written, at most.
const PERIOD: Duration = Duration::from_millis(500);

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
    written: Instant,
    trouble: Option<String>,
}

/// Writes until there is no more; the database, and what went wrong with it.
pub(super) fn write(
    (database, run, rows): (Database, i64, usize),
    messages: &Receiver<Message>,
    watch: &dyn Watch,
) -> (Database, Option<String>) {
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
        written: Instant::now(),
        trouble: None,
    };
    loop {
        match messages.recv_timeout(PERIOD.saturating_sub(writer.written.elapsed()).max(Duration::from_millis(1))) {
            Ok(Message::End) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(message) => writer.take(message),
            Err(RecvTimeoutError::Timeout) => writer.commit(),
        }
    }
    writer.commit();
    (writer.database, writer.trouble)
}

impl Writer<'_> {
    fn take(&mut self, message: Message) {
        match message {
            Message::Point(point) => self.points.push(point),
            Message::Slopes(tuners, reach, slopes) => self.slopes.push((tuners, reach, slopes)),
            Message::State(state) => {
                self.evaluations = state.evaluations;
                self.state = Some(state);
                if self.written.elapsed() >= PERIOD {
                    self.commit();
                }
            }
            Message::Best(best) => self.best = Some(best),
            Message::Stage(what, done) => {
                self.commit();
                self.watch.stage(&what, done);
            }
            Message::End => {}
        }
        if self.points.len() + self.slopes.len() >= BATCH {
            self.commit();
        }
    }

    /// Writes what there is, then tells of it.
    fn commit(&mut self) {
        let (points, slopes) = (std::mem::take(&mut self.points), std::mem::take(&mut self.slopes));
        let is_new = !points.is_empty() || !slopes.is_empty() || self.state.is_some();
        if is_new && self.trouble.is_none() {
            let written = self.database.write(self.run, self.rows, &points, &slopes, self.evaluations);
            self.trouble = written.err().map(|error| error.to_string());
        }
        self.written = Instant::now();
        if let Some(state) = self.state.take() {
            self.watch.evaluated(&state);
        }
        if let Some(best) = self.best.take() {
            self.watch.improved(&best);
        }
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
