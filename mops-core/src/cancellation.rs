//! Cancellation of the simulations of a run.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Reason why a run ends before its solver finishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Halt {
    /// Budget of evaluations spent.
    Budget,
    /// Time limit reached.
    TimeLimit,
    /// Interrupted by the user.
    Interrupted,
}

/// A cancellation request, shared by all clones. A simulation polls the request at every step and then fails with
/// [`crate::Failure::Cancelled`]. A run discards such simulations and ends.
///
/// There are two levels. A search ends at the first. The conclusion of a search (the reported point in every case, its
/// errors, its plots) uses a [`Cancellation::patient`] view and ends at the second.
#[derive(Debug, Clone, Default)]
pub struct Cancellation {
    requests: Arc<AtomicU8>,
    patient: bool,
}

const BUDGET: u8 = 1;
const INTERRUPTED: u8 = 2;
const INSISTED: u8 = 4;
const TIME_LIMIT: u8 = 8;

impl Cancellation {
    /// Requests the end of searches. An interruption takes precedence over the time limit, and that over a spent
    /// budget.
    pub fn request(&self, why: Halt) {
        let bit = match why {
            Halt::Budget => BUDGET,
            Halt::TimeLimit => TIME_LIMIT,
            Halt::Interrupted => INTERRUPTED,
        };
        self.requests.fetch_or(bit, Ordering::Relaxed);
    }

    /// Requests the end of conclusions too, if the end of searches was requested.
    pub fn insist(&self) {
        self.requests.fetch_or(INSISTED, Ordering::Relaxed);
    }

    /// Returns the view for the conclusion of a search.
    #[must_use]
    pub fn patient(&self) -> Self {
        Self { requests: Arc::clone(&self.requests), patient: true }
    }

    /// Returns the reason of the request, if there is one.
    pub fn requested(&self) -> Option<Halt> {
        let requests = self.requests.load(Ordering::Relaxed);
        if self.patient && requests & INSISTED == 0 {
            return None;
        }
        match requests {
            requests if requests & INTERRUPTED != 0 => Some(Halt::Interrupted),
            requests if requests & TIME_LIMIT != 0 => Some(Halt::TimeLimit),
            requests if requests & BUDGET != 0 => Some(Halt::Budget),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_a_request_and_conclusions_end_once_it_is_insisted_on() {
        let cancellation = Cancellation::default();
        let (clone, patient) = (cancellation.clone(), cancellation.patient());
        assert_eq!((clone.requested(), patient.requested()), (None, None));
        clone.request(Halt::Budget);
        assert_eq!((cancellation.requested(), patient.requested()), (Some(Halt::Budget), None));
        cancellation.insist();
        assert_eq!((clone.requested(), patient.clone().requested()), (Some(Halt::Budget), Some(Halt::Budget)));
        patient.request(Halt::Interrupted);
        assert_eq!((clone.requested(), patient.requested()), (Some(Halt::Interrupted), Some(Halt::Interrupted)));
    }

    #[test]
    fn to_insist_on_nothing_ends_nothing() {
        let cancellation = Cancellation::default();
        cancellation.insist();
        assert_eq!((cancellation.requested(), cancellation.patient().requested()), (None, None));
    }
}
