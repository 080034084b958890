//! Verdict of a run, in one to three sentences, and warnings.

use mops_core::{Role, Stop, Task, Usage, run::Record, solver::Pareto};
use mops_outcome::{ChannelReport, CriterionReport, Outcome};

use super::Report;
use crate::numbers::{counted, percent, significant, with_unit};

/// Tone of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Good,
    Mixed,
    Bad,
}

/// Returns the verdict in words, with its tone.
pub(super) fn verdict(report: &Report<'_>) -> (Tone, String) {
    let outcome = report.outcome;
    if let Some(found) = report.outcome.found.diagnosis.as_ref() {
        return super::diagnosis::verdict(found);
    }
    if outcome.task == Task::Excitation {
        return excitation(outcome);
    }
    if let Some(verdict) = super::robustness::verdict(outcome) {
        return if outcome.found.robust.is_some() { verdict } else { doubted(outcome, verdict) };
    }
    if !outcome.objective.is_finite() {
        let text = "Failed: no point could be evaluated, as a simulation or a criterion failed at each of them.";
        return (Tone::Bad, text.to_owned());
    }
    if !outcome.feasible {
        let violated = |c: &&CriterionReport| c.met == Some(false);
        let violated: Vec<_> =
            [Usage::Inequality, Usage::Equality].iter().flat_map(|u| used_as(report, *u)).filter(violated).collect();
        let worst = violated.iter().max_by(|a, b| violation(a).total_cmp(&violation(b)));
        let what = worst.map_or_else(|| "a constraint is violated".to_owned(), |worst| missed(worst));
        let others = violated.len().saturating_sub(1);
        let more =
            if others > 0 { format!(" {} also violated.", counted(others, "other constraint")) } else { String::new() };
        return (Tone::Bad, format!("No feasible point found: {what}.{more}"));
    }
    doubted(outcome, solved(report))
}

/// Returns a verdict after the reason to doubt the design that it rests on, and after what cut off the work that follows the design.
fn doubted(outcome: &Outcome, (tone, text): (Tone, String)) -> (Tone, String) {
    let follows = matches!(outcome.task, Task::Sweep | Task::Sensitivity | Task::WorstCase | Task::MonteCarlo)
        && tone != Tone::Bad;
    let cut_off = match outcome.stop {
        Stop::TimeLimit if follows => Some("The time limit ended the run before all was computed."),
        Stop::Interrupted if follows => Some("The run was interrupted before all was computed."),
        _ => None,
    };
    let doubt = outcome.end.as_ref().and_then(|end| end.doubt.as_deref());
    let before: Vec<&str> = doubt.into_iter().chain(cut_off).collect();
    match (before.is_empty(), tone) {
        (true, _) => (tone, text),
        (false, Tone::Good) => (Tone::Mixed, format!("{} {text}", before.join(" "))),
        (false, _) => (tone, format!("{} {text}", before.join(" "))),
    }
}

/// Returns the verdict on the result of a task that ended with a feasible point.
fn solved(report: &Report<'_>) -> (Tone, String) {
    let outcome = report.outcome;
    match outcome.task {
        Task::Design => design(report),
        Task::Pareto => match outcome.found.trade_offs.iter().flat_map(|found| &found.words).next() {
            Some(words) => {
                let points = outcome.found.trade_offs.iter().flat_map(|found| found.points.iter().enumerate());
                let doubts =
                    points.filter_map(|(i, point)| Some(format!("Point {}: {} ", i + 1, point.doubt.as_ref()?)));
                let doubts: String = doubts.collect();
                let is_cut_off = matches!(outcome.stop, Stop::Budget | Stop::TimeLimit | Stop::Interrupted);
                let tone = if is_cut_off || !doubts.is_empty() { Tone::Mixed } else { Tone::Good };
                (tone, doubts + words)
            }
            None => (Tone::Bad, "No Pareto front found.".to_owned()),
        },
        Task::Calibration => calibration(outcome, report.archive),
        Task::Excitation => excitation(outcome),
        Task::Sensitivity => sensitivity(outcome),
        Task::Sweep => match outcome.found.sweep.iter().flat_map(|sweep| &sweep.words).next() {
            Some(words) => (Tone::Good, words.clone()),
            None => (Tone::Bad, "No sweep: the run was interrupted.".to_owned()),
        },
        Task::Diagnosis => (Tone::Bad, "No diagnosis: the run was interrupted.".to_owned()),
        Task::WorstCase | Task::MonteCarlo => (Tone::Bad, "No result: the run was interrupted.".to_owned()),
    }
}

fn excitation(outcome: &Outcome) -> (Tone, String) {
    let inputs = outcome.found.excitation.iter().flat_map(|found| &found.inputs);
    let poor: Vec<_> = inputs.clone().filter(|input| !input.suffices).collect();
    match (inputs.clone().next(), poor.first()) {
        (None, _) => (Tone::Mixed, "No input to analyse.".to_owned()),
        (Some(first), None) if inputs.count() == 1 => (Tone::Good, first.words.clone()),
        (_, None) => {
            let text = "Every input is persistently exciting of sufficient order for a linear model with as many parameters \
                as tuners in its case. The sensitivities show whether these tuners are determined.";
            (Tone::Good, text.to_owned())
        }
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

/// Returns the criteria with this usage in the problem. Criteria of data that are not calibration data are only reported.
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
        return (Tone::Good, text + "All constraints are satisfied; no criterion is minimised.");
    }
    text.push_str(&changed("The worst scaled value", outcome.start.worst_scaled, outcome.worst_scaled));
    match minimised.iter().filter(|c| c.met == Some(false)).max_by(|a, b| a.scaled.total_cmp(&b.scaled)) {
        None => (Tone::Good, text + "; all demands are met."),
        Some(worst) => {
            let others = minimised.iter().filter(|c| c.met == Some(false)).count() - 1;
            let more = if others > 0 { format!("; {} missed", counted(others, "other demand")) } else { String::new() };
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
    let doubts = doubts_of_fit(outcome);
    let tone = if doubts.is_empty() { Tone::Good } else { Tone::Mixed };
    (tone, doubts + &text)
}

/// Residuals above this multiple of the noise show that the model does not describe the data.
const MISFIT: f64 = 2.0;

/// Returns what speaks against a calibrated model, as sentences: residuals far above the noise, a fit worse than the mean of the data,
/// tuners at their bounds.
fn doubts_of_fit(outcome: &Outcome) -> String {
    let experiments = outcome.calibration.iter().flat_map(|c| &c.experiments);
    let channels: Vec<_> = experiments.flat_map(|e| e.channels.iter().map(move |c| (e, c))).collect();
    let ratio = |channel: &ChannelReport| channel.noise.map_or(0.0, |noise| channel.rmse / noise);
    let mut text = String::new();
    let misfit = channels.iter().filter(|(e, _)| e.role == Role::Calibration);
    if let Some((experiment, channel)) = misfit.max_by(|a, b| ratio(a.1).total_cmp(&ratio(b.1)))
        && ratio(channel) > MISFIT
    {
        text += &format!(
            "The residuals of `{}` in `{}` are {} times the stated noise: the model does not describe the data, the noise is \
             larger, or the data have outliers. ",
            channel.name,
            experiment.name,
            significant(ratio(channel), 3)
        );
    }
    if let Some((experiment, channel)) = channels.iter().find(|(_, c)| c.fit_percent < 0.0) {
        text +=
            &format!("The mean of the data fits `{}` in `{}` better than the model. ", channel.name, experiment.name);
    }
    let bounds: Vec<String> =
        outcome.tuners.iter().filter(|t| t.at_bound.is_some()).map(|tuner| format!("`{}`", tuner.name)).collect();
    if !bounds.is_empty() {
        text += &format!("At a bound: {}. ", bounds.join(", "));
    }
    text
}

fn changed(what: &str, start: f64, now: f64) -> String {
    let [from, to] = [start, now].map(|v| significant(v, 4));
    match (start.is_finite(), now) {
        (false, _) => format!("{what} is {to}, without a value at the initial guess"),
        _ if from == to => format!("{what} stayed at {to}"),
        (_, now) if now < start => format!("{what} fell from {from} to {to}"),
        _ => format!("{what} rose from {from} to {to}"),
    }
}

/// Returns a clause on a missed demand, with the amount.
fn missed(criterion: &CriterionReport) -> String {
    let CriterionReport { name, case, unit, value, .. } = criterion;
    let place = format!("`{name}` in case `{case}`");
    match (criterion.demand, criterion.bad) {
        _ if criterion.scaled.is_nan() => format!("{place} has no value"),
        (Some(demand), _) if criterion.usage == Usage::Equality => {
            format!("{place} is {} instead of {}", with_unit(*value, unit), with_unit(demand, unit))
        }
        (Some(demand), _) if value.is_nan() => {
            let note = criterion.note.unwrap_or("no value");
            format!("{place} has no value for the demand {}: {note}", with_unit(demand, unit))
        }
        (Some(_), _) if criterion.at_least => {
            format!("{place} falls short of its demand by {}", percent(criterion.scaled - 1.0))
        }
        (Some(_), _) => format!("{place} exceeds its demand by {}", percent(criterion.scaled - 1.0)),
        (None, bad) => format!(
            "{place} is {}, but the demand is {}",
            with_unit(*value, unit),
            with_unit(bad.unwrap_or(f64::NAN), unit)
        ),
    }
}

/// Returns the reason why the run stopped.
pub(super) fn stop(outcome: &Outcome) -> &'static str {
    match outcome.stop {
        Stop::Converged if outcome.task == Task::Excitation => "Not solved: the inputs were analysed",
        Stop::Converged if outcome.solver == "none" && outcome.task == Task::Sweep => {
            "Not solved: the tuners that are not swept are at the initial guess"
        }
        Stop::Converged if outcome.solver == "none" => "Not solved: the initial guess was evaluated",
        Stop::Converged => "Converged (solver tolerance reached)",
        Stop::Budget => "Budget exhausted; a larger budget may find a better point",
        Stop::TimeLimit => "Time limit reached; more time (--resume) may find a better point",
        Stop::Stalled => "Stalled: no further improvement found, convergence not reached",
        Stop::Interrupted => "Interrupted by the user",
    }
}

/// Returns what is known of the reported point at the end of the search.
pub(super) fn end(outcome: &Outcome) -> Option<String> {
    outcome.end.as_ref().map(|end| end.words.join(" ")).filter(|words| !words.is_empty())
}

/// Returns the solver, with the methods that it has run.
pub(super) fn solver(outcome: &Outcome) -> String {
    if outcome.methods.is_empty() {
        outcome.solver.clone()
    } else {
        format!("{}: {}", outcome.solver, outcome.methods.join(", "))
    }
}

/// Returns the Pareto status in words.
pub(super) fn pareto(pareto: Pareto) -> &'static str {
    match pareto {
        Pareto::CertifiedLocal => "Locally Pareto-optimal to first order",
        Pareto::NotShown => "Not certified as Pareto-optimal",
        Pareto::No => {
            "Not Pareto-optimal: a step of a thousandth of the box improves one criterion by more than 0.005 % and worsens no other"
        }
    }
}

/// Returns the warnings of the run, the notes of criteria, and the failures at the reported point.
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
        all.push(format!("{failed} of {} have no value; see Failures", counted(report.archive.len(), "point")));
    }
    all
}
