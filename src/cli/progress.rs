//! Shows how a run goes, and hears Ctrl-C.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use mops_core::{CriterionReport, Evaluation, RunState, Study, Usage, Watch, criterion_reports};

use super::sparkline::sparkline;
use super::tables::number;

/// A progress bar on standard error, with the best objective so far; and the ear for Ctrl-C.
pub(super) struct Progress {
    bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
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
    /// Begins to listen, and, where `shown`, to show the bar; stages in lines where standard error is no terminal.
    pub fn new(shown: bool, budget: usize) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(budget as u64), target);
        let style = "{bar:30} {pos}/{len} evaluations, at most {eta} left, {msg}";
        bar.set_style(ProgressStyle::with_template(style).expect("the template is right"));
        Self::with(bar, shown, "interrupted: writing the best point so far; again to end at once")
    }

    /// The same for a benchmark, which keeps the cases that are done.
    pub fn of_cases(shown: bool) -> Self {
        let target = if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(None, target);
        Self::with(bar, shown, "interrupted: the cases so far count; again to end at once")
    }

    fn with(bar: ProgressBar, shown: bool, heard: &'static str) -> Self {
        let interrupted = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&interrupted);
        // Where a handler cannot be set, Ctrl-C ends the program as usual.
        let _ = ctrlc::set_handler(move || {
            if flag.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
            let _ = writeln!(std::io::stderr(), "{heard}");
        });
        let said = (shown && !std::io::stderr().is_terminal()).then(Mutex::default);
        Self { bar, interrupted, staged: AtomicBool::new(false), said, study: None, below: Mutex::default() }
    }

    /// Shows the convergence, and the criteria of the best point, below the bar.
    #[must_use]
    pub fn with_criteria_of(self, study: &Study) -> Self {
        Self { study: Some(study.clone()), ..self }
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
        let mut below = self.below.lock().unwrap_or_else(PoisonError::into_inner);
        let mut lines = String::new();
        if self.study.is_some() {
            below.better(state.evaluations, state.best.objective);
            lines = format!("\n  {}{}", sparkline(&below.curve, state.evaluations, SPARKS), below.criteria);
        }
        self.bar.set_message(format!("best {:.6}{violation}{failed}{lines}", state.best.objective));
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
        self.bar.set_message(what.to_owned());
        if let Some(said) = &self.said {
            // A log has no bar to overwrite: the longer a run, the rarer the lines, but for stages of another kind.
            let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
            let now = self.bar.elapsed().as_secs_f64();
            let kind = what.split([';', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']).next().unwrap_or(what);
            if said.0 != kind || now - said.1 >= (0.05 * now).max(1.0) {
                let _ = writeln!(std::io::stderr(), "{now:>7.1} s  {what}");
                *said = (kind.to_owned(), now);
            }
        }
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
