//! Live page of a run on localhost, `http://127.0.0.1:PORT/TOKEN/`. The page is read-only.
//!
//! The operating system chooses the port. The token has 128 random bits, so that other pages and users cannot guess the
//! URL. The run only publishes its latest state. Each viewer reads it on a thread of its own; a slow viewer misses
//! states and delays neither the run nor other viewers.
//!
//! [`Page`] is the page, and [`Both`] the observer of a run that publishes to it.
//!
//! | module | content |
//! |---|---|
//! | `state` | the latest state of a run; unread states are overwritten |
//! | `request` | what a request asks for, or why it is refused |
//! | `server` | one thread for each connection, with limits |

mod request;
mod server;
mod state;

use std::io;
use std::path::Path;
use std::sync::Arc;

use mops_core::{Evaluation, Halt, Study, Watch, run::State as RunState};

use server::Server;
use state::Live;

/// Live page of a run.
pub struct Page {
    server: Server,
    live: Arc<Live>,
}

impl Page {
    /// Opens the page for a run of this study.
    ///
    /// # Errors
    /// If no port of this machine is available.
    pub fn open(study: &Study, solver: &str, budget: usize) -> io::Result<Self> {
        let live = Arc::new(Live::new(study.clone(), solver, budget));
        Ok(Self { server: Server::open(Arc::clone(&live))?, live })
    }

    /// Returns the URL of the page.
    pub fn address(&self) -> String {
        self.server.address()
    }

    /// Publishes the end of the run and the folder of its result, and gives viewers a moment to read it.
    pub fn finish(self, folder: &Path) {
        self.live.finish(&folder.display().to_string());
        self.server.close();
    }
}

/// Observer that notifies the page and another observer.
pub struct Both<'w> {
    /// Page.
    pub page: &'w Page,
    /// Other observer, which also decides on the end of the run.
    pub other: &'w dyn Watch,
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
