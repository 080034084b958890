//! How many simulations were made, and whether there may be more.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use mops_core::Watch;

/// Counts simulations. Once its watch wants an end it admits none: every fit that is under way then fails. What has
/// been found is still reported on.
pub struct Meter<'a> {
    count: AtomicUsize,
    is_reporting: AtomicBool,
    watch: &'a dyn Watch,
}

impl<'a> Meter<'a> {
    /// Nothing simulated so far.
    pub fn new(watch: &'a dyn Watch) -> Self {
        Self { count: AtomicUsize::new(0), is_reporting: AtomicBool::new(false), watch }
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
        !self.is_reporting.load(Ordering::Relaxed) && self.watch.wants_stop()
    }

    /// Ends the search: simulations for the report are admitted in any case. Returns true if an end was wanted.
    pub fn conclude(&self) -> bool {
        let is_stopped = self.is_over();
        self.is_reporting.store(true, Ordering::Relaxed);
        is_stopped
    }

    /// Reports a stage of the work to the watch, with the share of it that is done.
    pub fn stage(&self, what: &str, done: f64) {
        self.watch.stage(what, done);
    }

    /// Simulations so far.
    pub fn count(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }
}
