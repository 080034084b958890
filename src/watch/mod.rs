//! A live page of a run, for this machine alone: `http://127.0.0.1:PORT/TOKEN/`. It shows and changes nothing.
//!
//! The port is the system's choice and the token 128 random bits, so that no other page or user finds it by guessing. The
//! run only leaves its newest state; viewers, each on a thread of their own, take it when they can, and one that is slow
//! misses states and holds up nobody.

mod request;
mod server;
mod state;

use std::io;
use std::path::Path;
use std::sync::Arc;

use mops_core::{Evaluation, Halt, RunState, Study, Watch};

use server::Server;
use state::Live;

/// The live page of a run.
pub(crate) struct Page {
    server: Server,
    live: Arc<Live>,
}

impl Page {
    /// Opens the page for a run of this study.
    ///
    /// # Errors
    /// No port of this machine can be listened to.
    pub fn open(study: &Study, solver: &str, budget: usize) -> io::Result<Self> {
        let live = Arc::new(Live::new(study.clone(), solver, budget));
        Ok(Self { server: Server::open(Arc::clone(&live))?, live })
    }

    /// Where it can be looked at.
    pub fn address(&self) -> String {
        self.server.address()
    }

    /// Tells that the run is over and where its result is; viewers have a moment to hear it.
    pub fn finish(self, folder: &Path) {
        self.live.finish(&folder.display().to_string());
        self.server.close();
    }
}

/// Watches for the page, and for somebody else.
pub(crate) struct Both<'w> {
    pub(crate) page: &'w Page,
    pub(crate) other: &'w dyn Watch,
}

impl Watch for Both<'_> {
    fn wants_stop(&self) -> bool {
        self.other.wants_stop()
    }

    fn halt(&self) -> Halt {
        self.other.halt()
    }

    fn evaluated(&self, state: &RunState) {
        self.page.live.evaluated(state);
        self.other.evaluated(state);
    }

    fn improved(&self, best: &Evaluation) {
        self.page.live.improved(best);
        self.other.improved(best);
    }

    fn stage(&self, what: &str, done: f64) {
        self.page.live.stage(what, done);
        self.other.stage(what, done);
    }

    fn keeping(&self, trouble: Option<&str>) {
        self.page.live.keeping(trouble);
        self.other.keeping(trouble);
    }
}
