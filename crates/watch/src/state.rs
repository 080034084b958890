//! Latest state of a run for the live page.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use mops_core::{Evaluation, Merit, Problem, Study, Usage, run::State as RunState};
use mops_outcome::criterion_reports;
use serde_json::{Value, json};

/// Largest number of points of the curve; every second one of more is dropped.
const CURVE: usize = 600;

/// Time between two simulations for viewers, in units of the time that one takes, so that a run is hardly delayed.
const SHARE: u32 = 20;

/// Latest state of a run, shared with the viewers; unread states are overwritten.
pub(super) struct Live {
    problem: Problem,
    solver: String,
    started: Instant,
    state: Mutex<Newest>,
    changed: Condvar,
    responses: Mutex<Responses>,
}

/// Responses that were computed last.
#[derive(Default)]
struct Responses {
    /// Number of the best point.
    of: u64,
    json: String,
    /// Earliest time of the next computation.
    next: Option<Instant>,
}

#[derive(Clone)]
struct Newest {
    /// Number of changes, starting at 1.
    version: u64,
    run: RunState,
    stage: Option<(String, f64)>,
    best: Option<Evaluation>,
    /// Number of best points so far.
    improvements: u64,
    /// Number of evaluations and merit at each change of the best point.
    curve: Vec<(usize, Merit)>,
    /// Reason why evaluations cannot be written, if so.
    write_error: Option<String>,
    /// Time in s and folder of the result, after the end of the run.
    over: Option<(f64, String)>,
}

impl Live {
    pub fn new(study: Study, solver: &str, budget: usize) -> Self {
        let run = RunState { evaluations: 0, budget, failed: 0, best: Merit::FAILED };
        let state = Newest {
            version: 1,
            run,
            stage: None,
            best: None,
            improvements: 0,
            curve: Vec::new(),
            write_error: None,
            over: None,
        };
        Self {
            problem: Problem::new(Arc::new(study)),
            solver: solver.to_owned(),
            started: Instant::now(),
            state: Mutex::new(state),
            changed: Condvar::new(),
            responses: Mutex::default(),
        }
    }

    // After a panic of a viewer the state is still valid.
    fn newest(&self) -> MutexGuard<'_, Newest> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut Newest)) {
        let mut newest = self.newest();
        change(&mut newest);
        newest.version += 1;
        drop(newest);
        self.changed.notify_all();
    }

    pub fn evaluated(&self, run: &RunState) {
        self.change(|newest| {
            let moved = newest.curve.last().is_none_or(|(_, merit)| run.best.is_better_than(merit));
            if moved && run.best.objective.is_finite() {
                if newest.curve.len() >= CURVE {
                    let mut index = 0;
                    newest.curve.retain(|_| {
                        index += 1;
                        index % 2 == 1
                    });
                }
                newest.curve.push((run.evaluations, run.best));
            }
            newest.run = *run;
        });
    }

    pub fn improved(&self, best: &Evaluation) {
        let best = Evaluation { residuals: Vec::new(), ..best.clone() };
        self.change(|newest| {
            newest.best = Some(best);
            newest.improvements += 1;
        });
    }

    pub fn stage(&self, what: &str, done: f64) {
        self.change(|newest| newest.stage = Some((what.to_owned(), done)));
    }

    pub fn keeping(&self, error: Option<&str>) {
        self.change(|newest| newest.write_error = error.map(str::to_owned));
    }

    pub fn finish(&self, folder: &str) {
        let seconds = self.started.elapsed().as_secs_f64();
        self.change(|newest| newest.over = Some((seconds, folder.to_owned())));
    }

    /// Waits for the given time, or until the run is over.
    pub fn pause(&self, time: Duration) {
        let in_progress = |newest: &mut Newest| newest.over.is_none();
        drop(self.changed.wait_timeout_while(self.newest(), time, in_progress));
    }

    /// Waits until the state is newer than version `seen`, at most for `timeout`. Returns the version, true if the run
    /// is over, and the state as JSON.
    pub fn after(&self, seen: u64, timeout: Duration) -> (u64, bool, String) {
        let newest = self.newest();
        let is_old = |newest: &mut Newest| newest.version <= seen;
        let waited = self.changed.wait_timeout_while(newest, timeout, is_old);
        let (guard, _) = waited.unwrap_or_else(PoisonError::into_inner);
        // The run does not wait until a viewer has its text.
        let newest = guard.clone();
        drop(guard);
        (newest.version, newest.over.is_some(), self.json(&newest).to_string())
    }

    /// Returns the number of the best point and its responses as JSON, if it is later than point `drawn`. During the
    /// run simulations for viewers take at most one [`SHARE`]th of the time; until the next one is due, the responses
    /// are those of an earlier point.
    pub fn responses(&self, drawn: u64) -> Option<(u64, String)> {
        // One viewer simulates, the others wait for its result.
        let mut last = self.responses.lock().unwrap_or_else(PoisonError::into_inner);
        let newest = self.newest();
        let (of, tuners) = (newest.improvements, newest.best.as_ref().map(|best| best.tuners.clone()));
        let due = newest.over.is_some() || last.next.is_none_or(|next| Instant::now() >= next);
        drop(newest);
        if let Some(tuners) = tuners.filter(|_| due && of > last.of) {
            let start = Instant::now();
            last.json = json!({ "of": of, "plots": mops_report::live_responses(&self.problem, &tuners) }).to_string();
            (last.of, last.next) = (of, Some(Instant::now() + SHARE * start.elapsed()));
        }
        (last.of > drawn).then(|| (last.of, last.json.clone()))
    }

    fn json(&self, newest: &Newest) -> Value {
        let run = newest.run;
        let seconds =
            newest.over.as_ref().map_or_else(|| self.started.elapsed().as_secs_f64(), |(seconds, _)| *seconds);
        let share = match &newest.stage {
            Some((_, done)) => *done,
            #[allow(clippy::cast_precision_loss)]
            None => run.evaluations as f64 / run.budget.max(1) as f64,
        };
        // Extrapolated from the speed so far; an upper bound, as a solver that converges ends earlier.
        let left = (share > 0.0).then(|| (seconds * (1.0 / share - 1.0)).max(0.0));
        json!({
            "study": self.problem.study().name(), "task": self.problem.study().task(), "solver": self.solver,
            "evaluations": run.evaluations, "budget": run.budget, "failed": run.failed,
            "seconds": seconds, "left": left, "share": share,
            "stage": newest.stage.as_ref().map(|(what, _)| what),
            "trouble": &newest.write_error,
            "over": newest.over.as_ref().map(|(_, folder)| folder),
            "best": newest.best.as_ref().map(|best| json!({
                "objective": best.merit.objective, "violation": best.merit.violation, "feasible": best.merit.is_feasible(),
            })),
            "criteria": newest.best.as_ref().map(|best| self.criteria(best)),
            "tuners": newest.best.as_ref().map(|best| self.tuners(best)),
            "convergence": mops_report::live_convergence(self.problem.study(), &newest.curve, run.evaluations),
        })
    }

    fn criteria(&self, best: &Evaluation) -> Vec<Value> {
        let reports = criterion_reports(self.problem.study(), best);
        let criteria = reports.into_iter().map(|criterion| {
            json!({
                "name": criterion.name, "case": criterion.case, "usage": criterion.usage, "unit": criterion.unit,
                "demand": criterion.demand.or(criterion.bad), "at_least": criterion.at_least,
                "value": criterion.value, "scaled": criterion.scaled, "met": criterion.met,
                "constraint": matches!(criterion.usage, Usage::Inequality | Usage::Equality),
            })
        });
        criteria.collect()
    }

    fn tuners(&self, best: &Evaluation) -> Vec<Value> {
        let tuners = self.problem.study().tuners().iter().zip(&best.tuners);
        let json_of = |(tuner, value): (&mops_core::study::Tuner, &f64)| {
            json!({
                "name": tuner.name, "value": value, "unit": tuner.unit.to_string(), "active": tuner.active,
                "position": tuner.active.then(|| tuner.position_of(*value)),
            })
        };
        tuners.map(json_of).collect()
    }
}
