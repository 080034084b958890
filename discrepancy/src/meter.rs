//! How many simulations were made, and whether there may be more.

use std::sync::atomic::{AtomicUsize, Ordering};

use mops_core::Watch;

/// Counts simulations. Once its watch wants an end it admits none: every fit that is under way then fails.
pub struct Meter<'a> {
    count: AtomicUsize,
    watch: &'a dyn Watch,
}

impl<'a> Meter<'a> {
    /// Nothing simulated so far.
    pub fn new(watch: &'a dyn Watch) -> Self {
        Self { count: AtomicUsize::new(0), watch }
    }

    /// Whether there may be another simulation, which is then counted.
    pub fn admits(&self) -> bool {
        let goes_on = !self.is_over();
        if goes_on {
            self.count.fetch_add(1, Ordering::Relaxed);
        }
        goes_on
    }

    /// Whether an end is wanted: nothing more will be simulated.
    pub fn is_over(&self) -> bool {
        self.watch.wants_stop()
    }

    /// Simulations so far.
    pub fn count(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }
}
