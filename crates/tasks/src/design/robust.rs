//! Robust design with `[robust]`: worst cases in a box are searched and added until none is worse.

use mops_core::task::DesignTask;
use std::iter;
use std::sync::Arc;

use mops_core::{
    Evaluation, Halt, Oracle, Problem, Run, Stop, Study, Usage, Watch,
    evaluation::FEASIBLE,
    run::{Budget, Patience, Record, State as RunState, Store},
    solver::Pareto,
    study::{Scenario, Uncertain},
    task::RobustTask,
};
use mops_outcome::{Ending, StartReport, conclude};

use crate::uncertain::{AddedReport, RobustReport, RoundReport, uncertain_reports};

use mops_content::numbers::{counted, significant};

use super::searched::search_design;
use crate::batches::Stage;
use crate::copies::Copies;
use crate::search::{EvaluationStore, Options, SolveError, Solved};
use crate::worst_case::{Effort, NO_GUARANTEE, Region, Worst, sentence};

/// Outer approximation: solves for the present cases, searches the box for worse cases, adds them, and repeats.
///
/// A design against cases that are still to be added is not worth a long search: a round has a share of the budget, and
/// it ends when its design hardly improves any more. Once no worse case is found, the search of the last design is
/// repeated with more patience.
///
/// The optimum over the present cases is a lower bound for every design, provided that the solver finds the optimum.
/// The worst case found in the box is the value of the present design.
///
/// Source: J. W. Blankenship, J. E. Falk, Journal of Optimization Theory and Applications 19 (1976) 261-281 (algorithm
/// 2.1). N.B.: the paper assumes an exact worst case; here it is the result of a search, so that no guarantee is given.
pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.options::<DesignTask>().and_then(|design| design.robust.clone()).expect("the study asks for it");
    let mut rounds = Rounds { study, task, scenarios: Vec::new(), done: Vec::new(), worst: Vec::new() };
    let mut left = options.max_evaluations;
    let (mut stop, mut archive, mut simulations, mut reused) = (Stop::Stalled, Vec::new(), 0, 0);
    let mut last: Option<Solved>;
    let mut is_thorough = false;
    loop {
        let before = options.max_evaluations - left;
        let is_last = rounds.done.len() + 1 == rounds.task.rounds;
        let share = if is_thorough || is_last { left } else { left.div_ceil(ROUND_SHARE) };
        let factor = if is_thorough { THOROUGH } else { 1 };
        let patience = Patience {
            least: factor * LEAST_PATIENCE * (Problem::outline(&rounds.study).dimension() + 1),
            ratio: factor,
            gain: rounds.task.tolerance,
        };
        let designing = Designing { watch, round: rounds.done.len() + 1, cases: rounds.scenarios.len(), before };
        let study = rounds.to_solve();
        let keeping = rounds.keeping(&study, options);
        let solved = search_design(
            study,
            &Options { max_evaluations: share, patience: Some(patience), keeping, ..options.clone() },
            &designing,
        )?;
        reused += solved.outcome.reused.unwrap_or(0);
        left = left.saturating_sub(solved.outcome.evaluations);
        simulations += solved.outcome.simulations;
        archive.extend(solved.archive.iter().cloned());
        let more = !watch.wants_stop() && solved.best.scaled.is_some() && rounds.search(&solved, options, watch);
        simulations += rounds.done.last().map_or(0, |round| round.simulations);
        last = Some(solved);
        if watch.wants_stop() {
            stop = watch.halt().into();
            break;
        }
        let found = last.as_ref().map_or(stop, |solved| solved.outcome.stop);
        if !more && (is_thorough || found == Stop::Converged || left == 0) {
            stop = found;
            break;
        }
        is_thorough = !more;
        if rounds.done.len() == rounds.task.rounds {
            break;
        }
        if left == 0 {
            stop = Stop::Budget;
            break;
        }
    }
    let last = last.expect("there is a first round");
    let mut solved = rounds.conclude(last, options, stop);
    (solved.outcome.evaluations, solved.outcome.simulations) = (options.max_evaluations - left, simulations);
    solved.outcome.reused = options.keeping.as_ref().and_then(|keeping| keeping.begin.as_ref()).map(|_| reused);
    // Cases are appended: rows added after a round have no value in its points.
    let rows = solved.problem.study().rows().len();
    archive.iter_mut().for_each(|record: &mut Record| record.values.resize(rows, f64::NAN));
    solved.archive = archive;
    Ok(solved)
}

/// Doubt about a design whose worst cases are unknown.
const NOT_SEARCHED: &str = "No search for worst cases was completed: the values hold for the given cases only; continue the run with \
                            a higher limit (--resume).";

/// Share of the remaining budget that a round may spend: one part of so many.
const ROUND_SHARE: usize = 3;

/// Smallest number of evaluations without gain after which the design of a round is given up, in numbers of points that
/// a gradient by differences needs.
const LEAST_PATIENCE: usize = 30;

/// Patience with the last design, relative to that with the design of a round.
const THOROUGH: usize = 5;

/// Distance of two worst cases of a criterion up to which they lie side by side, as a share of the box.
const BESIDE: f64 = 0.05;

/// Steps between two such cases by which a further one lies beyond them.
const FARTHER: f64 = 10.0;

/// Relative difference of two values of an uncertain parameter up to which they are one: the rounding of a ratio.
const SAME: f64 = 1e-12;

/// Observer of the design search of one round; reports it as a stage, and counts its points in the whole run.
struct Designing<'a> {
    watch: &'a dyn Watch,
    round: usize,
    cases: usize,
    /// Number of points of the previous rounds.
    before: usize,
}

impl Watch for Designing<'_> {
    fn wants_stop(&self) -> bool {
        self.watch.wants_stop()
    }

    fn halt(&self) -> Halt {
        self.watch.halt()
    }

    fn improved(&self, best: &Evaluation) {
        self.watch.improved(best);
    }

    #[allow(clippy::cast_precision_loss)]
    fn evaluated(&self, state: &RunState) {
        let (evaluations, budget) = (self.before + state.evaluations, self.before + state.budget);
        self.watch.evaluated(&RunState { evaluations, budget, ..*state });
        let what = format!(
            "round {}: designing with {} worst cases, best {}",
            self.round,
            self.cases,
            significant(state.best.objective, 5)
        );
        self.watch.stage(&what, state.evaluations as f64 / state.budget as f64);
    }
}

/// Rounds so far.
struct Rounds {
    study: Study,
    task: RobustTask,
    /// Added worst cases.
    scenarios: Vec<Scenario>,
    done: Vec<RoundReport>,
    /// Worst cases found in the box in each round.
    worst: Vec<Vec<Worst>>,
}

impl Rounds {
    /// Returns the study with all cases, starting at the design of the previous round.
    fn to_solve(&self) -> Study {
        let mut study = self.study.with_scenarios(&self.scenarios);
        if let Some(before) = self.done.last() {
            for (tuner, &value) in before.tuners.iter().enumerate() {
                if study.tuners()[tuner].active {
                    study.set_start(tuner, value);
                }
            }
        }
        study
    }

    /// Returns the store for the points of a round, which is that of the study. The first round starts where the run
    /// starts, later rounds at the design of the previous round.
    fn keeping(&self, study: &Study, options: &Options) -> Option<EvaluationStore> {
        let store: Arc<dyn Store> = Arc::new(Copies::of(options, &self.study, study, &self.scenarios)?);
        let begin = options.keeping.as_ref().and_then(|keeping| keeping.begin.clone());
        let here = || Problem::new(Arc::new(study.clone())).start();
        let begin = begin.map(|begin| if self.done.is_empty() { begin } else { here() });
        Some(EvaluationStore { study: study.clone(), store, begin })
    }

    /// Searches the box around a design and adds the cases that are worse than the present ones. Returns true if a case
    /// was added.
    fn search(&mut self, solved: &Solved, options: &Options, watch: &dyn Watch) -> bool {
        let effort = Effort { samples: self.task.samples, starts: self.task.starts };
        let counts = |row: &mops_core::study::Row| row.usage != Usage::Monitor;
        let region = Region::new(&self.study, &solved.best.tuners, counts, effort).keeping(options, &self.study);
        let what = format!("round {}: searching the worst cases", self.done.len() + 1);
        let (worst, simulations) = region.search(watch, Stage { what: &what, from: 0.0, to: 1.0 });
        let merit = solved.best.merit;
        let constrained = |worst: &Worst| worst.subject.usage != Usage::Minimise;
        let largest = |list: &mut dyn Iterator<Item = f64>| list.reduce(f64::max);
        let violated = largest(&mut worst.iter().filter(|w| constrained(w)).map(|w| violation(w).max(0.0)));
        let found = largest(&mut worst.iter().filter(|w| !constrained(w)).map(|w| w.weight * w.scaled));
        let cases = solved.problem.study().cases().len();
        let mut added = Vec::new();
        for worst in &worst {
            let excess = match constrained(worst) {
                true => violation(worst) - merit.violation.max(0.0),
                false => worst.weight * worst.scaled - merit.objective,
            };
            let failed = worst.report.failure.as_ref().map(|f| f.at.iter().map(|c| c.value).collect::<Vec<f64>>());
            let values = match failed {
                // A failed criterion counts as a violation.
                Some(at) => at,
                None if excess > self.task.tolerance => worst.at.clone(),
                None => continue,
            };
            let (criterion, case) = (&worst.subject.criterion, worst.case);
            let values = self.relative(values, &solved.best.tuners);
            let beyond = self.beyond(case, &values, criterion);
            for (values, scaled) in iter::once((values, Some(worst.scaled))).chain(beyond.map(|values| (values, None)))
            {
                let scenario = Scenario { name: self.name(criterion), case, values };
                if self.is_known(&scenario) {
                    break;
                }
                let at = region.coordinates(&self.absolute(&scenario.values, &solved.best.tuners));
                added.push(AddedReport { name: scenario.name.clone(), criterion: criterion.clone(), scaled, at });
                self.scenarios.push(scenario);
            }
        }
        let any = !added.is_empty();
        self.done.push(RoundReport {
            cases,
            tuners: solved.best.tuners.clone(),
            for_cases: solved.outcome.worst_scaled,
            violation_for_cases: merit.violation,
            found: found.unwrap_or(f64::NAN),
            violation_found: violated.unwrap_or(0.0),
            evaluations: solved.outcome.evaluations,
            simulations,
            added,
        });
        self.worst.push(worst);
        any
    }

    /// Returns true if a scenario of these values was added before.
    fn is_known(&self, scenario: &Scenario) -> bool {
        let is_same = |(a, b): (&f64, &f64)| (a - b).abs() <= SAME * a.abs();
        let same = |known: &Scenario| known.values.iter().zip(&scenario.values).all(is_same);
        self.scenarios.iter().any(|known| known.case == scenario.case && same(known))
    }

    /// Returns the values beyond a new worst case in those uncertain parameters in which it lies beside the last one of
    /// its criterion, in the direction from the last one to the new one and within the box; `None` if there are none. A
    /// parameter without effect has any value.
    ///
    /// Cases side by side lie at the edge of a jump, which each design moves by a little: one by one, they would not
    /// come to an end.
    fn beyond(&self, case: usize, new: &[f64], criterion: &str) -> Option<Vec<f64>> {
        let before =
            self.done.iter().rev().flat_map(|round| &round.added).find(|added| added.criterion == criterion)?;
        let before = self.scenarios.iter().find(|known| known.name == before.name && known.case == case)?;
        let ends = |uncertain: &Uncertain| match (uncertain.tuner, uncertain.tolerance) {
            (Some(_), Some(tolerance)) => [1.0 - tolerance, 1.0 + tolerance],
            _ => uncertain.bounds,
        };
        let farther = |((now, before), uncertain): ((&f64, &f64), &Uncertain)| {
            let ([low, high], step) = (ends(uncertain), now - before);
            let is_beside = (high - low).is_finite() && step.abs() <= BESIDE * (high - low);
            if is_beside { (now + FARTHER * step).clamp(low, high) } else { *now }
        };
        let pairs = new.iter().zip(&before.values).zip(self.study.uncertain());
        let values: Vec<f64> = pairs.map(farther).collect();
        (values != new).then_some(values)
    }

    /// Returns the values of a scenario: those of tuners with a tolerance relative to the design.
    fn relative(&self, mut values: Vec<f64>, tuners: &[f64]) -> Vec<f64> {
        for (value, uncertain) in values.iter_mut().zip(self.study.uncertain()) {
            if let Some(tuner) = uncertain.tuner {
                *value = if tuners[tuner] == 0.0 { 1.0 } else { *value / tuners[tuner] };
            }
        }
        values
    }

    /// Returns the values of a scenario at a design, the inverse of [`Rounds::relative`].
    fn absolute(&self, values: &[f64], tuners: &[f64]) -> Vec<f64> {
        let of = |(value, uncertain): (&f64, &Uncertain)| value * uncertain.tuner.map_or(1.0, |tuner| tuners[tuner]);
        values.iter().zip(self.study.uncertain()).map(of).collect()
    }

    /// Returns an unused case name.
    fn name(&self, criterion: &str) -> String {
        let taken = |name: &String| {
            self.study.cases().iter().any(|c| c.name == *name) || self.scenarios.iter().any(|s| s.name == *name)
        };
        (1..)
            .map(|i| format!("worst-{criterion}-{i}"))
            .find(|name| !taken(name))
            .expect("there is always a next number")
    }

    /// Returns the round whose design has the best worst case.
    fn chosen(&self) -> Option<usize> {
        let tolerance = self.task.tolerance;
        let merit = |i: usize| {
            let RoundReport { violation_found: violation, found, .. } = self.done[i];
            // An interrupted search has no result.
            let known = !self.worst[i].is_empty();
            if known { (if violation > tolerance { violation } else { 0.0 }, found) } else { (f64::INFINITY, found) }
        };
        let failing = |i: usize| self.worst[i].iter().any(|w| w.report.failed > 0 || w.at.is_empty());
        (0..self.done.len()).min_by(|&i, &j| {
            let (a, b) = (merit(i), merit(j));
            failing(i).cmp(&failing(j)).then(a.0.total_cmp(&b.0)).then(a.1.total_cmp(&b.1))
        })
    }

    /// Returns the outcome of the chosen design over all cases, including those found last.
    fn conclude(self, last: Solved, options: &Options, stop: Stop) -> Solved {
        let chosen = self.chosen().filter(|&chosen| !self.worst[chosen].is_empty());
        let Some(chosen) = chosen else {
            let mut outcome = last.outcome;
            outcome.stop = stop;
            if let Some(end) = &mut outcome.end {
                end.doubt = Some(NOT_SEARCHED.to_owned());
            }
            return Solved { outcome, archive: Vec::new(), ..last };
        };
        // A search that did not take place, or was cut off, shows nothing.
        let settled = self.done[chosen].added.is_empty();
        let cut_off = self.worst.last().is_some_and(Vec::is_empty);
        let design = &self.done[chosen].tuners;
        let problem = Problem::new(Arc::new(self.study.with_scenarios(&self.scenarios))).concluding();
        let mut run = Run::new(&problem, Budget { evaluations: 1 }, &());
        if run.evaluate(&[problem.point_of(design)]).is_err() {
            // Cancelled: returns the result of the last round.
            let mut outcome = last.outcome;
            outcome.stop = stop;
            return Solved { outcome, archive: Vec::new(), ..last };
        }
        let pareto = if chosen + 1 == self.done.len() { last.outcome.pareto } else { Pareto::NotShown };
        let end = last.outcome.end.clone().filter(|_| chosen + 1 == self.done.len());
        let (mut outcome, best) = conclude(&run, &options.solver, Ending { stop, end, pareto, seconds: 0.0 });
        drop(run);
        // The run has the design only.
        let start = problem.evaluate_at(&problem.study().start());
        outcome.start = StartReport::of(problem.study(), &start);
        if !settled && start.scaled.is_some() && start.merit.is_better_than(&best.merit) {
            outcome.warnings.push(
                "over the cases found, the initial guess is better than the reported design: no round was completed that shows \
                 a better one; continue the run (--resume)"
                    .to_owned(),
            );
        }
        (outcome.failures, outcome.methods) = (last.outcome.failures, last.outcome.methods);
        let effort = Effort { samples: 1, starts: 1 };
        let region = Region::new(&self.study, design, |_| true, effort);
        let mut report = RobustReport {
            words: Vec::new(),
            parameters: uncertain_reports(region.study()),
            criteria: self.worst[chosen].iter().map(|worst| worst.report.clone()).collect(),
            rounds: self.done,
            chosen,
            settled,
            tolerance: self.task.tolerance,
            guaranteed: false,
        };
        report.words = words(&report, outcome.worst_scaled, if cut_off { End::CutOff } else { End::of(stop) });
        outcome.found.add(report);
        Solved { outcome, problem, best, archive: Vec::new(), front: Vec::new() }
    }
}

/// Returns the violation of a constraint at its worst case.
fn violation(worst: &Worst) -> f64 {
    if worst.subject.usage == Usage::Equality { worst.severity() } else { worst.scaled - 1.0 }
}

/// Reason why no further round followed.
enum End {
    /// The search for worst cases of the last round did not take place, or was cut off.
    CutOff,
    Interrupted,
    Budget,
    TimeLimit,
    Rounds,
}

impl End {
    fn of(stop: Stop) -> Self {
        match stop {
            Stop::Interrupted => Self::Interrupted,
            Stop::Budget => Self::Budget,
            Stop::TimeLimit => Self::TimeLimit,
            Stop::Converged | Stop::Stalled => Self::Rounds,
        }
    }
}

/// Returns the findings as sentences. `over_all` is the worst scaled value of the reported design over the cases of all
/// rounds.
fn words(report: &RobustReport, over_all: f64, end: End) -> Vec<String> {
    let round = &report.rounds[report.chosen];
    let added: usize = report.rounds.iter().map(|round| round.added.len()).sum();
    let number = |value: f64| significant(value, 4);
    let rounds = report.rounds.len();
    let after = counted(rounds, "round");
    let found = round.found.max(over_all);
    let still = format!("worse cases were still found (scaled value {})", number(found));
    let end = match (report.settled, end) {
        (true, _) => {
            format!("after {after} no case was found that is worse by more than {}", number(report.tolerance))
        }
        (false, End::CutOff) => format!("{still}, and the search for worst cases of the last round was cut off"),
        (false, End::Interrupted) => format!("interrupted while {still}"),
        (false, End::Budget) => format!("the budget was spent while {still}"),
        (false, End::TimeLimit) => format!("the time limit was reached while {still}"),
        (false, End::Rounds) => format!("{still} after {after}"),
    };
    let were = if added == 1 { "was" } else { "were" };
    let mut words = vec![format!("{} {were} added; {end}.", counted(added, "worst case"))];
    let violated = match number(round.violation_found) {
        _ if round.violation_found <= FEASIBLE => String::new(),
        by if round.violation_found <= report.tolerance => {
            format!(
                "; a constraint is violated by {by} of its demand, within the tolerance of {}",
                number(report.tolerance)
            )
        }
        by => format!("; a constraint is violated by {by} of its demand"),
    };
    if round.found.is_finite() {
        words.push(format!(
            "Design of round {}: worst scaled value {} over the cases of the design, {} found in the box{violated}.",
            report.chosen + 1,
            number(round.for_cases),
            number(found)
        ));
    }
    let best = report.rounds.iter().map(|round| round.for_cases).filter(|v| v.is_finite()).fold(f64::NAN, f64::max);
    if best.is_finite() && round.found.is_finite() {
        // A design that violates a constraint is no upper bound.
        let gap = match round.violation_found <= report.tolerance {
            true => format!("; gap {}", number((found - best).max(0.0))),
            false => String::new(),
        };
        let condition = "if the solver found the optimum for the cases of every round";
        words.push(format!("Lower bound {} ({condition}){gap}.", number(best)));
    }
    words.extend(report.criteria.iter().map(sentence));
    words.push(NO_GUARANTEE.to_owned());
    words
}
