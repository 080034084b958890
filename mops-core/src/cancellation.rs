//! How whoever waits for a run asks its simulations to end.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// The run is over before the solver is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Halt {
    /// The budget, of evaluations or of time, is spent.
    Budget,
    /// The user ended it.
    Interrupted,
}

/// A request to end, shared by all clones. A simulation asks for it at every step and then fails with
/// [`crate::Failure::Cancelled`]; a run keeps no such simulation, and ends.
///
/// There are two levels. A search ends at the first. What concludes it (the reported point in every case, its errors, its
/// plots) goes on with a [`Cancellation::patient`] view and ends at the second.
#[derive(Debug, Clone, Default)]
pub struct Cancellation {
    requests: Arc<AtomicU8>,
    patient: bool,
}

const BUDGET: u8 = 1;
const INTERRUPTED: u8 = 2;
const INSISTED: u8 = 4;

impl Cancellation {
    /// Asks searches to end. An interruption outweighs a spent budget.
    pub fn request(&self, why: Halt) {
        let bit = match why {
            Halt::Budget => BUDGET,
            Halt::Interrupted => INTERRUPTED,
        };
        self.requests.fetch_or(bit, Ordering::Relaxed);
    }

    /// Asks conclusions to end too, where searches were asked to.
    pub fn insist(&self) {
        self.requests.fetch_or(INSISTED, Ordering::Relaxed);
    }

    /// The view of what concludes a search.
    #[must_use]
    pub fn patient(&self) -> Self {
        Self { requests: Arc::clone(&self.requests), patient: true }
    }

    /// Why an end was requested, if it was.
    pub fn requested(&self) -> Option<Halt> {
        let requests = self.requests.load(Ordering::Relaxed);
        if self.patient && requests & INSISTED == 0 {
            return None;
        }
        match requests {
            requests if requests & INTERRUPTED != 0 => Some(Halt::Interrupted),
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
