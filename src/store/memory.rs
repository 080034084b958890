//! What a run knows from before, and the way of what it learns to the writer.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{PoisonError, RwLock};

use mops_core::{Cancellation, Evaluation, Known, RowSlopes, RunState, Store, Value};

use super::bytes;
use super::database::{PointRow, Points, Slopes};

/// Bytes that residuals and derivatives may take in a database; beyond them points keep their criteria alone, and what a
/// solver needs of their residuals is simulated again.
pub(super) const ROOM: usize = 256 << 20;

/// What goes to the writer, in the order in which it happened.
pub(super) enum Message {
    /// A point was learned.
    Point(PointRow),
    /// Derivatives were learned.
    Slopes(Vec<u64>, f64, Option<RowSlopes>),
    /// Where the run stands: may be told once all before it is written.
    State(RunState),
    /// The best point changed.
    Best(Box<Evaluation>),
    /// A stage of what counts no points.
    Stage(String, f64),
    /// There is no more.
    End,
}

/// The memory of a run.
pub(super) struct Memory {
    /// What is known from before, and what the run learns: a certificate asks again what a search asked.
    pub points: RwLock<Points>,
    pub slopes: RwLock<Slopes>,
    /// Where nothing new is looked for: who is asked to end at a point that is not known.
    pub closed: Option<Cancellation>,
    /// Whether what is known stands in another database, from which it is taken over point by point.
    pub foreign: bool,
    pub sender: SyncSender<Message>,
    /// Bytes that are left for residuals and derivatives.
    pub room: AtomicUsize,
    /// Points answered without a simulation, and points simulated.
    pub reused: AtomicUsize,
    pub simulated: AtomicUsize,
}

impl Memory {
    /// Takes room for so many numbers, if there is some.
    fn takes(&self, numbers: usize) -> bool {
        let take = |left: usize| left.checked_sub(8 * numbers);
        numbers == 0 || self.room.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok()
    }

    // N.B.: a writer that is gone has told why; the run goes on without it.
    fn send(&self, message: Message) {
        let _ = self.sender.send(message);
    }
}

impl Store for Memory {
    fn known(&self, tuners: &[f64]) -> Option<Known> {
        self.points.read().unwrap_or_else(PoisonError::into_inner).get(&bytes::key(tuners)).cloned()
    }

    fn is_known(&self, tuners: &[f64]) -> bool {
        self.points.read().unwrap_or_else(PoisonError::into_inner).contains_key(&bytes::key(tuners))
    }

    fn closed(&self) -> Option<&Cancellation> {
        self.closed.as_ref()
    }

    fn answered(&self, tuners: &[f64], learned: Option<Known>) {
        let key = bytes::key(tuners);
        let mut points = self.points.write().unwrap_or_else(PoisonError::into_inner);
        let known = points.get(&key);
        let Some(mut new) = learned else {
            self.reused.fetch_add(1, Ordering::Relaxed);
            if let Some(known) = known.filter(|_| self.foreign) {
                self.send(Message::Point(PointRow { tuners: key, known: known.clone() }));
            }
            return;
        };
        self.simulated.fetch_add(1, Ordering::Relaxed);
        known.into_iter().for_each(|known| new.complete(known));
        if !self.takes(values(&new).map(|value| value.residuals.len()).sum()) {
            new.jobs.iter_mut().filter_map(|(_, values)| values.as_mut().ok()).flatten().for_each(|(_, value)| {
                if let Ok(value) = value {
                    value.residuals.clear();
                }
            });
        }
        points.insert(key.clone(), new.clone());
        // Before somebody else adds to the point: what is written last is what is known last.
        self.send(Message::Point(PointRow { tuners: key, known: new }));
    }

    fn known_slopes(&self, tuners: &[f64], reach: f64) -> Option<Option<RowSlopes>> {
        let key = (bytes::key(tuners), reach.to_bits());
        self.slopes.read().unwrap_or_else(PoisonError::into_inner).get(&key).cloned()
    }

    fn learned_slopes(&self, tuners: &[f64], reach: f64, slopes: Option<RowSlopes>) {
        let numbers = slopes.iter().flatten().flat_map(|(_, along)| along).map(|slope| 3 + slope.residuals.len()).sum();
        if self.takes(numbers) {
            self.send(Message::Slopes(bytes::key(tuners), reach, slopes));
        }
    }
}

fn values(known: &Known) -> impl Iterator<Item = &Value> {
    known.jobs.iter().filter_map(|(_, values)| values.as_ref().ok()).flatten().filter_map(|(_, v)| v.as_ref().ok())
}
