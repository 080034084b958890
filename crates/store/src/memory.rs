//! In-memory store of a run: points from earlier runs, and new points on their way to the writer.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{PoisonError, RwLock};

use mops_core::{
    Cancellation, Evaluation,
    run::{Known, RowSlopes, State as RunState, Store},
};

use super::bytes;
use super::database::{PointRow, Points, Slopes};

/// Largest size in bytes of the derivatives in a database. Beyond it, only criteria are stored.
pub(super) const ROOM: usize = 256 << 20;

/// Message to the writer, in chronological order.
pub(super) enum Message {
    /// New point.
    Point(PointRow),
    /// New derivatives.
    Slopes(Vec<u64>, f64, Option<RowSlopes>),
    /// Progress of the run, to be reported after all earlier messages are written.
    State(RunState),
    /// New best point.
    Best(Box<Evaluation>),
    /// Stage of work that evaluates no points.
    Stage(String, f64),
    /// Last message.
    End,
}

/// In-memory store of a run.
pub(super) struct Memory {
    /// Points of earlier runs and of this run: a certificate asks again for points of the search.
    pub points: RwLock<Points>,
    pub slopes: RwLock<Slopes>,
    /// Cancellation that is requested at a point that is not stored; `None` if such points are simulated.
    pub closed: Option<Cancellation>,
    /// True if the stored points are in another database, from which used points are copied.
    pub foreign: bool,
    pub sender: SyncSender<Message>,
    /// Remaining size in bytes for derivatives.
    pub room: AtomicUsize,
    /// Number of points answered without a simulation.
    pub reused: AtomicUsize,
    /// Number of simulated points.
    pub simulated: AtomicUsize,
}

impl Memory {
    /// Reserves space for `numbers` numbers; returns false if there is not enough.
    fn reserve(&self, numbers: usize) -> bool {
        let take = |left: usize| left.checked_sub(8 * numbers);
        numbers == 0 || self.room.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok()
    }

    // N.B.: a writer that has ended has reported the reason; the run continues without it.
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
        points.insert(key.clone(), new.clone());
        // Sent under the lock of the points, so that the last message holds the latest values of the point.
        self.send(Message::Point(PointRow { tuners: key, known: new }));
    }

    fn known_slopes(&self, tuners: &[f64], reach: f64) -> Option<Option<RowSlopes>> {
        let key = (bytes::key(tuners), reach.to_bits());
        self.slopes.read().unwrap_or_else(PoisonError::into_inner).get(&key).cloned()
    }

    fn learned_slopes(&self, tuners: &[f64], reach: f64, slopes: Option<RowSlopes>) {
        let numbers = slopes.iter().flatten().map(|(_, along)| 2 + along.len()).sum();
        if self.reserve(numbers) {
            self.send(Message::Slopes(bytes::key(tuners), reach, slopes));
        }
    }
}
