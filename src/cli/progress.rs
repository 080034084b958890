//! Shows how a run goes, and hears Ctrl-C.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use mops_core::{RunState, Watch};

/// A progress bar on standard error, with the best objective so far; and the ear for Ctrl-C.
pub(super) struct Progress {
    bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
    /// Whether the bar shows stages instead of points.
    staged: AtomicBool,
}

impl Progress {
    /// Begins to listen, and to show the bar where `shown` and standard error is a terminal.
    pub fn new(shown: bool, budget: usize) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(budget as u64), target);
        let style = "{bar:30} {pos}/{len} evaluations, at most {eta} left, {msg}";
        bar.set_style(ProgressStyle::with_template(style).expect("the template is right"));
        Self::with(bar, "interrupted: writing the best point so far; again to end at once")
    }

    /// The same for a benchmark, which keeps the cases that are done.
    pub fn of_cases(shown: bool) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        Self::with(bar, "interrupted: the cases so far count; again to end at once")
    }

    fn with(bar: ProgressBar, heard: &'static str) -> Self {
        let interrupted = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&interrupted);
        // Where a handler cannot be set, Ctrl-C ends the program as usual.
        let _ = ctrlc::set_handler(move || {
            if flag.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
            eprintln!("{heard}");
        });
        Self { bar, interrupted, staged: AtomicBool::new(false) }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Watch for Progress {
    fn wants_stop(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn evaluated(&self, state: &RunState) {
        self.bar.set_position(state.evaluations as u64);
        let failed = if state.failed > 0 { format!(", {} failed", state.failed) } else { String::new() };
        let violation = if state.best.is_feasible() {
            String::new()
        } else {
            format!(", violated by {:.3e}", state.best.violation)
        };
        self.bar.set_message(format!("best {:.6}{violation}{failed}", state.best.objective));
    }

    fn stage(&self, what: &str, done: f64) {
        // Stages are no points: the bar shows their share of the whole, in thousandths.
        if !self.staged.swap(true, Ordering::Relaxed) {
            let style = "{bar:30} {percent:>3} %, {elapsed} so far, {msg}";
            self.bar.set_style(ProgressStyle::with_template(style).expect("the template is right"));
            self.bar.set_length(1000);
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        self.bar.set_position((1000.0 * done.clamp(0.0, 1.0)) as u64);
        self.bar.set_message(what.to_owned());
    }
}
