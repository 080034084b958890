//! Progress of a run on the terminal.

use std::fmt::Write as _;
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use mops_core::{Cancellation, Evaluation, Halt, Study, Usage, Watch, run::State as RunState};
use mops_language::plain::plain;
use mops_outcome::{CriterionReport, criterion_reports};

use super::eprint::eprint_line;
use super::limits::{Limit, cancel_on_signal};
use super::sparkline::sparkline;
use super::table::number;

/// Progress bar on standard error with the best objective so far; forwards stop requests to the run.
pub struct Progress {
    bar: ProgressBar,
    cancellation: Cancellation,
    /// True if the bar shows stages instead of points.
    staged: AtomicBool,
    /// Stage that was last printed on its own line, and the time in s; `None` if a bar is shown.
    printed: Option<Mutex<(String, f64)>>,
    /// Study whose criteria are shown below the bar, if any.
    study: Option<Study>,
    /// Lines below the bar.
    dashboard: Mutex<Dashboard>,
}

/// Lines below the bar.
#[derive(Default)]
struct Dashboard {
    criteria: String,
    /// Number of evaluations and objective at each improvement of the best point.
    curve: Vec<(usize, f64)>,
}

impl Dashboard {
    /// Adds an improvement; every second one is dropped when the list is full.
    fn add(&mut self, evaluations: usize, objective: f64) {
        if self.curve.last().is_some_and(|(_, last)| objective.to_bits() == last.to_bits()) {
            return;
        }
        if self.curve.len() >= 8 * SPARKS {
            let mut index = 0;
            self.curve.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
        self.curve.push((evaluations, objective));
    }
}

/// Width of the sparkline, in characters.
const SPARKS: usize = 40;

impl Progress {
    /// Creates the progress bar of a run, visible if `shown`. Stages are printed as lines if standard error is no
    /// terminal.
    pub(crate) fn new(shown: bool, budget: usize, cancellation: &Cancellation) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(budget as u64), target);
        let style = "{bar:30} {pos}/{len} evaluations, at most {eta} left, {msg}";
        bar.set_style(ProgressStyle::with_template(style).expect("the template is valid"));
        Self::with(bar, shown, cancellation.clone())
    }

    /// Creates the progress bar of a benchmark, which keeps its finished cases when interrupted.
    #[must_use]
    pub fn of_cases(shown: bool) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        let limit = Limit { time_limit: None };
        Self::with(
            bar,
            shown,
            cancel_on_signal(limit, "interrupted: keeping the finished cases; press Ctrl-C again to quit now"),
        )
    }

    fn with(bar: ProgressBar, shown: bool, cancellation: Cancellation) -> Self {
        let printed = (shown && !std::io::stderr().is_terminal()).then(Mutex::default);
        Self { bar, cancellation, staged: AtomicBool::new(false), printed, study: None, dashboard: Mutex::default() }
    }

    /// Adds the convergence and the criteria of the best point below the bar.
    #[must_use]
    pub(crate) fn with_criteria_of(self, study: &Study) -> Self {
        Self { study: Some(study.clone()), ..self }
    }

    /// Returns the exit status of a finished benchmark: 4 after an interruption, else 0.
    #[must_use]
    pub fn status(&self) -> ExitCode {
        if self.wants_stop() { ExitCode::from(4) } else { ExitCode::SUCCESS }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Watch for Progress {
    fn wants_stop(&self) -> bool {
        self.cancellation.requested().is_some()
    }

    fn halt(&self) -> Halt {
        self.cancellation.requested().unwrap_or(Halt::Interrupted)
    }

    fn evaluated(&self, state: &RunState) {
        self.bar.set_position(state.evaluations as u64);
        let failed = if state.failed > 0 { format!(", {} failed", state.failed) } else { String::new() };
        let violation =
            if state.best.is_feasible() { String::new() } else { format!(", violation {:.3e}", state.best.violation) };
        let mut dashboard = self.dashboard.lock().unwrap_or_else(PoisonError::into_inner);
        let mut lines = String::new();
        if self.study.is_some() {
            dashboard.add(state.evaluations, state.best.objective);
            lines = format!("\n  {}{}", sparkline(&dashboard.curve, state.evaluations, SPARKS), dashboard.criteria);
        }
        let best = format!("best {:.6}{violation}{failed}", state.best.objective);
        if let Some(printed) = self.printed.as_ref().filter(|_| !self.staged.load(Ordering::Relaxed)) {
            let now = self.bar.elapsed().as_secs_f64();
            let mut printed = printed.lock().unwrap_or_else(PoisonError::into_inner);
            if now - printed.1 >= (RARER * now).max(FIRST) {
                eprint_line(&format!("{now:>7.1} s  {} evaluations, {best}", state.evaluations));
                printed.1 = now;
            }
        }
        self.bar.set_message(plain(&(best + &lines)).into_owned());
    }

    fn improved(&self, best: &Evaluation) {
        if let Some(study) = &self.study {
            let criteria = lines(&criterion_reports(study, best));
            self.dashboard.lock().unwrap_or_else(PoisonError::into_inner).criteria = criteria;
        }
    }

    fn stage(&self, what: &str, done: f64) {
        // Stages count no points: the bar shows the finished share, in thousandths.
        if !self.staged.swap(true, Ordering::Relaxed) {
            let style = "{bar:30} {percent:>3} %, {elapsed} so far, {msg}";
            self.bar.set_style(ProgressStyle::with_template(style).expect("the template is valid"));
            self.bar.set_length(1000);
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        self.bar.set_position((1000.0 * done.clamp(0.0, 1.0)) as u64);
        self.bar.set_message(plain(what).into_owned());
        if let Some(printed) = &self.printed {
            // A log has no bar to overwrite: lines of the same kind of stage become rarer as the run gets longer.
            let mut printed = printed.lock().unwrap_or_else(PoisonError::into_inner);
            let now = self.bar.elapsed().as_secs_f64();
            let kind = what.split([';', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']).next().unwrap_or(what);
            if printed.0 != kind || now - printed.1 >= (RARER * now).max(1.0) {
                eprint_line(&format!("{now:>7.1} s  {what}"));
                *printed = (kind.to_owned(), now);
            }
        }
    }

    fn keeping(&self, trouble: Option<&str>) {
        let text = match trouble {
            Some(why) => {
                format!("warning: evaluations cannot be written ({why}); they stay in memory until the next attempt")
            }
            None => "note: evaluations are written again; none is missing".to_owned(),
        };
        self.bar.suspend(|| eprint_line(&text));
    }
}

/// Time between two lines of a log, as a share of the time so far: a long run has few lines.
const RARER: f64 = 0.05;

/// Shortest time between two lines on evaluations, s. A run that is shorter has none.
const FIRST: f64 = 2.0;

/// Largest number of criteria shown.
const LINES: usize = 20;

/// Formats one line for each criterion: name, value, demand, and a bar of the scaled value from 0 to 2.
fn lines(criteria: &[CriterionReport]) -> String {
    let name = |criterion: &CriterionReport| format!("{}/{}", criterion.case, criterion.name);
    let width = criteria.iter().map(|criterion| name(criterion).chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for criterion in criteria.iter().take(LINES) {
        let unit = if criterion.unit == "1" { "" } else { &criterion.unit };
        let _ = write!(text, "\n  {:width$}  {:>10} {unit:<6}", name(criterion), number(criterion.value));
        if criterion.usage != Usage::Monitor {
            let limit = criterion.demand.or(criterion.bad).map(number).unwrap_or_default();
            let word = if criterion.met == Some(true) { "met" } else { "not met" };
            let _ = write!(text, "  demand {limit:>8}  {}  {word}", bar(criterion.scaled));
        }
    }
    if criteria.len() > LINES {
        let _ = write!(text, "\n  and {} more", criteria.len() - LINES);
    }
    text
}

/// Formats a scaled value as a bar of 20 characters; `|` marks the demand, 1.
fn bar(scaled: f64) -> String {
    let filled = if scaled.is_nan() { 0.0 } else { 10.0 * scaled.clamp(0.0, 2.0) };
    let place = |i: u32| if f64::from(i) < filled { '=' } else { ' ' };
    let half = |from: u32| (from..from + 10).map(place).collect::<String>();
    format!("[{}|{}]", half(0), half(10))
}

#[cfg(test)]
mod tests {
    use super::bar;

    #[test]
    fn the_bar_of_a_criterion_crosses_the_mark_where_the_demand_is_missed() {
        assert_eq!(bar(0.5), "[=====     |          ]");
        assert_eq!(bar(1.0), "[==========|          ]");
        assert_eq!(bar(1.5), "[==========|=====     ]");
        assert_eq!((bar(9.0), bar(f64::NAN)), ("[==========|==========]".into(), "[          |          ]".into()));
    }
}
