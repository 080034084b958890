//! The result in words: what an engineer would say of the run in a sentence or two.

use mops_core::{CriterionReport, Outcome, Pareto, Record, Role, Stop, Task, Usage};

use super::Report;
use crate::numbers::{counted, percent, significant, with_unit};

/// How good the news is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Good,
    Mixed,
    Bad,
}

/// The verdict, and how good it is.
pub(super) fn verdict(report: &Report<'_>) -> (Tone, String) {
    let outcome = report.outcome;
    if let Some(found) = report.diagnosis {
        return super::diagnosis::verdict(found);
    }
    if outcome.task == Task::Excitation {
        return excitation(outcome);
    }
    if let Some(told) = super::robustness::verdict(outcome) {
        return told;
    }
    if !outcome.objective.is_finite() {
        let why = "No point could be evaluated: at each of them a simulation or a criterion failed.";
        return (Tone::Bad, format!("Failed. {why}"));
    }
    if !outcome.feasible {
        let violated = |c: &&CriterionReport| !c.met;
        let violated: Vec<_> =
            [Usage::Inequality, Usage::Equality].iter().flat_map(|u| used_as(report, *u)).filter(violated).collect();
        let worst = violated.iter().max_by(|a, b| violation(a).total_cmp(&violation(b)));
        let what = worst.map_or_else(|| "a constraint is violated".to_owned(), |worst| missed(worst));
        let others = violated.len().saturating_sub(1);
        let more = if others > 0 {
            format!(" {} violated as well.", counted(others, "other constraint"))
        } else {
            String::new()
        };
        return (Tone::Bad, format!("No feasible point was found: {what}.{more}"));
    }
    match outcome.task {
        Task::Design => design(report),
        Task::Pareto => match outcome.found.trade_offs.iter().flat_map(|found| &found.words).next() {
            Some(words) => (Tone::Good, words.clone()),
            None => (Tone::Bad, "No front was found.".to_owned()),
        },
        Task::Calibration => calibration(outcome, report.archive),
        Task::Excitation => excitation(outcome),
        Task::Sensitivity => sensitivity(outcome),
        Task::Sweep => match outcome.found.sweep.iter().flat_map(|sweep| &sweep.words).next() {
            Some(words) => (Tone::Good, words.clone()),
            None => (Tone::Bad, "Nothing was swept.".to_owned()),
        },
        Task::Diagnosis => (Tone::Bad, "Nothing was diagnosed.".to_owned()),
        Task::WorstCase | Task::MonteCarlo => (Tone::Bad, "Nothing was found: the run was interrupted.".to_owned()),
    }
}

fn excitation(outcome: &Outcome) -> (Tone, String) {
    let inputs = outcome.found.excitation.iter().flat_map(|found| &found.inputs);
    let poor: Vec<_> = inputs.clone().filter(|input| !input.suffices).collect();
    match (inputs.clone().next(), poor.first()) {
        (None, _) => (Tone::Mixed, "There is no input to look at.".to_owned()),
        (Some(first), None) if inputs.count() == 1 => (Tone::Good, first.words.clone()),
        (_, None) => (Tone::Good, "Every input is rich enough for a linear model with as many parameters as tuners act in its case; whether it is for \
             these tuners, the sensitivities tell.".to_owned()),
        (_, Some(worst)) => (Tone::Mixed, worst.words.clone()),
    }
}

fn sensitivity(outcome: &Outcome) -> (Tone, String) {
    let Some(found) = &outcome.found.sensitivity else {
        return (Tone::Bad, "The sensitivities could not be computed.".to_owned());
    };
    let sound = found.rank == found.tuners.len() && found.tuners.iter().all(|t| t.trust == "determined");
    let blind = found.tuners.len() - found.rank;
    (if sound { Tone::Good } else { Tone::Mixed }, found.words[..(1 + blind).min(found.words.len())].join(" "))
}

/// The criteria that the problem uses so; those of data that only report are used for nothing.
fn used_as<'a>(report: &Report<'a>, usage: Usage) -> Vec<&'a CriterionReport> {
    let rows = report.outcome.criteria.iter().zip(&report.problem.shape().rows);
    rows.filter(|(_, (used, _))| *used == usage).map(|(criterion, _)| criterion).collect()
}

fn violation(criterion: &CriterionReport) -> f64 {
    if criterion.usage == Usage::Equality { (criterion.scaled - 1.0).abs() } else { criterion.scaled - 1.0 }
}

fn design(report: &Report<'_>) -> (Tone, String) {
    let outcome = report.outcome;
    let mut text = "Feasible. ".to_owned();
    let minimised = used_as(report, Usage::Minimise);
    if minimised.is_empty() {
        return (Tone::Good, text + "Every constraint holds; nothing was to be minimised.");
    }
    text.push_str(&changed("The worst scaled criterion", outcome.start.worst_scaled, outcome.worst_scaled));
    match minimised.iter().filter(|c| !c.met).max_by(|a, b| a.scaled.total_cmp(&b.scaled)) {
        None => (Tone::Good, text + "; every demand is met."),
        Some(worst) => {
            let others = minimised.iter().filter(|c| !c.met).count() - 1;
            let more =
                if others > 0 { format!(", and {} not met", counted(others, "other demand")) } else { String::new() };
            (Tone::Mixed, format!("{text}. {}{more}.", missed(worst)))
        }
    }
}

fn calibration(outcome: &Outcome, archive: &[Record]) -> (Tone, String) {
    let start = archive.first().map_or(f64::NAN, |record| record.merit.objective);
    let mut text = changed("The objective", start, outcome.objective) + ".";
    for role in [Role::Calibration, Role::Selection, Role::Validation] {
        let experiments = outcome.calibration.iter().flat_map(|c| &c.experiments).filter(|e| e.role == role);
        let channels = experiments.flat_map(|e| e.channels.iter().map(move |c| (e, c)));
        let worst = channels
            .filter(|(_, c)| c.fit_percent.is_finite())
            .min_by(|a, b| a.1.fit_percent.total_cmp(&b.1.fit_percent));
        if let Some((experiment, channel)) = worst {
            text.push_str(&format!(
                " On {} data the worst fit is {:.1} % (`{}` in `{}`).",
                role.name(),
                channel.fit_percent,
                channel.name,
                experiment.name
            ));
        }
    }
    (Tone::Good, text)
}

fn changed(what: &str, start: f64, now: f64) -> String {
    let [from, to] = [start, now].map(|v| significant(v, 4));
    match (start.is_finite(), now) {
        (false, _) => format!("{what} is {to}; at the start it had no value"),
        _ if from == to => format!("{what} stayed at {to}"),
        (_, now) if now < start => format!("{what} fell from {from} to {to}"),
        _ => format!("{what} rose from {from} to {to}"),
    }
}

/// By how much a criterion misses its demand.
fn missed(criterion: &CriterionReport) -> String {
    let CriterionReport { name, case, unit, value, .. } = criterion;
    let place = format!("`{name}` in case `{case}`");
    match (criterion.demand, criterion.bad) {
        _ if criterion.scaled.is_nan() => format!("{place} has no value"),
        (Some(demand), _) if criterion.usage == Usage::Equality => {
            format!("{place} is {}, but must be {}", with_unit(*value, unit), with_unit(demand, unit))
        }
        (Some(demand), _) if value.is_nan() => {
            let note = criterion.note.unwrap_or("no value");
            format!("{place} is demanded to be {}: {note}", with_unit(demand, unit))
        }
        (Some(_), _) if criterion.at_least => {
            format!("{place} falls short of its demand by {}", percent(criterion.scaled - 1.0))
        }
        (Some(_), _) => format!("{place} exceeds its demand by {}", percent(criterion.scaled - 1.0)),
        (None, bad) => format!(
            "{place} is {}, where {} is demanded",
            with_unit(*value, unit),
            with_unit(bad.unwrap_or(f64::NAN), unit)
        ),
    }
}

/// Why the run stopped, in words.
pub(super) fn stop(outcome: &Outcome) -> &'static str {
    match outcome.stop {
        Stop::Converged if outcome.task == Task::Excitation => {
            "nothing was solved or simulated: the inputs were looked at"
        }
        Stop::Converged if outcome.solver == "none" && outcome.task == Task::Sweep => {
            "nothing was solved: the tuners that are not swept stand at their start values"
        }
        Stop::Converged if outcome.solver == "none" => "nothing was solved: the start values were looked at",
        Stop::Converged => "converged: the solver met its own test of an optimum",
        Stop::Budget => "the budget was spent; a larger one may find a better point",
        Stop::Stalled => "no more improvement was found, but no optimum was shown",
        Stop::Interrupted => "interrupted by the user",
    }
}

/// The solver, and those that it has run.
pub(super) fn solver(outcome: &Outcome) -> String {
    if outcome.methods.is_empty() {
        outcome.solver.clone()
    } else {
        format!("{}: {}", outcome.solver, outcome.methods.join(", "))
    }
}

/// The Pareto status, in words.
pub(super) fn pareto(pareto: Pareto) -> &'static str {
    match pareto {
        Pareto::CertifiedLocal => {
            "Pareto-optimal to first order: near this point no criterion can be improved at no cost to another"
        }
        Pareto::NotShown => "not certified: another point may be better in one criterion and as good in all others",
        Pareto::No => "not Pareto-optimal: one criterion can be improved at no cost to the others",
    }
}

/// What to know before trusting the numbers: warnings of the run, notes of criteria, failures at the reported point.
pub(super) fn warnings(report: &Report<'_>) -> Vec<String> {
    let (outcome, study) = (report.outcome, report.problem.study());
    let mut all = outcome.warnings.clone();
    let noted = |c: &CriterionReport| {
        let value = with_unit(c.value, &c.unit);
        c.note.map(|note| format!("`{}` in case `{}`, {value}: {note}", c.name, c.case))
    };
    all.extend(outcome.criteria.iter().filter_map(noted));
    for (job, failure) in &report.best.failures {
        all.push(format!(
            "at the reported point, case `{}` failed: {failure}",
            study.cases()[study.jobs()[*job].case].name
        ));
    }
    let failed: usize = report.archive.iter().filter(|r| r.merit.objective.is_infinite()).count();
    if failed > 0 {
        all.push(format!("{failed} of {} had no value; see Failures", counted(report.archive.len(), "point")));
    }
    all
}
