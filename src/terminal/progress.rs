//! Shows how a run goes.

use std::fmt::Write as _;
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use mops_core::{Cancellation, CriterionReport, Evaluation, Halt, RunState, Study, Usage, Watch, criterion_reports};

use super::limits::{Limit, listen};
use super::sparkline::sparkline;
use super::table::number;
use super::write::say;
use crate::plain::plain;

/// A progress bar on standard error, with the best objective so far; it passes on that an end is wanted.
pub struct Progress {
    bar: ProgressBar,
    cancellation: Cancellation,
    /// Whether the bar shows stages instead of points.
    staged: AtomicBool,
    /// The stage that was last said in a line of its own, and when, in seconds; `None` where a bar says it.
    said: Option<Mutex<(String, f64)>>,
    /// The study whose criteria are shown below the bar, where they are.
    study: Option<Study>,
    /// What stands below the bar.
    below: Mutex<Below>,
}

/// The lines below the bar.
#[derive(Default)]
struct Below {
    criteria: String,
    /// Evaluations and objective where the best point got better.
    curve: Vec<(usize, f64)>,
}

impl Below {
    /// A better point; of many, every second one goes.
    fn better(&mut self, evaluations: usize, objective: f64) {
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

/// Letters of the curve.
const SPARKS: usize = 40;

impl Progress {
    /// Shows the bar, where `shown`; stages in lines where standard error is no terminal.
    pub(crate) fn new(shown: bool, budget: usize, cancellation: &Cancellation) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(budget as u64), target);
        let style = "{bar:30} {pos}/{len} evaluations, at most {eta} left, {msg}";
        bar.set_style(ProgressStyle::with_template(style).expect("the template is right"));
        Self::with(bar, shown, cancellation.clone())
    }

    /// Creates the progress bar of a benchmark, which keeps its finished cases when interrupted.
    #[must_use]
    pub fn of_cases(shown: bool) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        let limit = Limit { time_limit: None };
        Self::with(bar, shown, listen(limit, "interrupted: keeping the finished cases; press Ctrl-C again to quit now"))
    }

    fn with(bar: ProgressBar, shown: bool, cancellation: Cancellation) -> Self {
        let said = (shown && !std::io::stderr().is_terminal()).then(Mutex::default);
        Self { bar, cancellation, staged: AtomicBool::new(false), said, study: None, below: Mutex::default() }
    }

    /// Shows the convergence, and the criteria of the best point, below the bar.
    #[must_use]
    pub(crate) fn with_criteria_of(self, study: &Study) -> Self {
        Self { study: Some(study.clone()), ..self }
    }

    /// Returns the exit status of a finished benchmark: 4 after an interruption, else 0.
    #[must_use]
    pub fn status(&self) -> ExitCode {
        if self.wants_stop() { ExitCode::from(4) } else { ExitCode::SUCCESS }
    }

    /// Takes the bar away.
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
        let violation = if state.best.is_feasible() {
            String::new()
        } else {
            format!(", violated by {:.3e}", state.best.violation)
        };
        let mut below = self.below.lock().unwrap_or_else(PoisonError::into_inner);
        let mut lines = String::new();
        if self.study.is_some() {
            below.better(state.evaluations, state.best.objective);
            lines = format!("\n  {}{}", sparkline(&below.curve, state.evaluations, SPARKS), below.criteria);
        }
        let best = format!("best {:.6}{violation}{failed}{lines}", state.best.objective);
        self.bar.set_message(plain(&best).into_owned());
    }

    fn improved(&self, best: &Evaluation) {
        if let Some(study) = &self.study {
            let criteria = lines(&criterion_reports(study, best));
            self.below.lock().unwrap_or_else(PoisonError::into_inner).criteria = criteria;
        }
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
        self.bar.set_message(plain(what).into_owned());
        if let Some(said) = &self.said {
            // A log has no bar to overwrite: the longer a run, the rarer the lines, but for stages of another kind.
            let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
            let now = self.bar.elapsed().as_secs_f64();
            let kind = what.split([';', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']).next().unwrap_or(what);
            if said.0 != kind || now - said.1 >= (0.05 * now).max(1.0) {
                say(&format!("{now:>7.1} s  {what}"));
                *said = (kind.to_owned(), now);
            }
        }
    }

    fn keeping(&self, trouble: Option<&str>) {
        let text = match trouble {
            Some(why) => {
                format!("warning: evaluations cannot be written ({why}); they wait in memory and are tried again")
            }
            None => "note: evaluations are written again, and none is missing".to_owned(),
        };
        self.bar.suspend(|| say(&text));
    }
}

/// Criteria on the terminal, at most.
const LINES: usize = 20;

/// A line for every criterion: name, value, demand, and a bar from 0 to 2 in whose middle the demand is.
fn lines(criteria: &[CriterionReport]) -> String {
    let name = |criterion: &CriterionReport| format!("{}/{}", criterion.case, criterion.name);
    let width = criteria.iter().map(|criterion| name(criterion).chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for criterion in criteria.iter().take(LINES) {
        let unit = if criterion.unit == "1" { "" } else { &criterion.unit };
        let _ = write!(text, "\n  {:width$}  {:>10} {unit:<6}", name(criterion), number(criterion.value));
        if criterion.usage != Usage::Monitor {
            let limit = criterion.demand.or(criterion.bad).map(number).unwrap_or_default();
            let word = if criterion.met { "met" } else { "not met" };
            let _ = write!(text, "  demand {limit:>8}  {}  {word}", bar(criterion.scaled));
        }
    }
    if criteria.len() > LINES {
        let _ = write!(text, "\n  and {} more", criteria.len() - LINES);
    }
    text
}

/// A scaled value as a bar of 20 places; `|` is the demand.
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
