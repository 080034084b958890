//! Verdict on a result, in one to three sentences, and warnings.

use mops_content::{
    numbers::{counted, percent, significant, with_unit},
    section::{Tone, Verdict},
};
use mops_core::{Stop, Usage, solver::Pareto};
use mops_outcome::{CriterionReport, Outcome};

use crate::room::{Judgement, Room, Solution};

/// Returns the verdict on a result.
pub fn verdict(of: &Solution<'_>, room: &dyn Room) -> Verdict {
    let outcome = of.outcome;
    let of_point = match room.verdict(of) {
        Judgement::Whole(verdict) => return verdict,
        Judgement::OfFindings(verdict) => return doubted(of, verdict),
        Judgement::OfPoint(verdict) => verdict,
    };
    if !outcome.objective.is_finite() {
        let text = "Failed: no point could be evaluated, as a simulation or a criterion failed at each of them.";
        return Verdict::new(Tone::Bad, text);
    }
    if !outcome.feasible {
        let violated = |c: &&CriterionReport| c.met == Some(false);
        let violated: Vec<_> =
            [Usage::Inequality, Usage::Equality].iter().flat_map(|u| used_as(of, *u)).filter(violated).collect();
        let worst = violated.iter().max_by(|a, b| violation(a).total_cmp(&violation(b)));
        let what = worst.map_or_else(|| "a constraint is violated".to_owned(), |worst| missed(worst));
        let others = violated.len().saturating_sub(1);
        let more =
            if others > 0 { format!(" {} also violated.", counted(others, "other constraint")) } else { String::new() };
        return Verdict::new(Tone::Bad, format!("No feasible point found: {what}.{more}"));
    }
    doubted(of, of_point)
}

/// Returns a verdict after the reason to doubt the design that it rests on, and after what cut off the work that
/// follows the design.
fn doubted(of: &Solution<'_>, verdict: Verdict) -> Verdict {
    let (outcome, task) = (of.outcome, of.problem.study().task());
    let Verdict { tone, text } = verdict;
    let follows = task.at().is_some() && !task.chooses_tuners() && tone != Tone::Bad;
    let cut_off = match outcome.stop {
        Stop::TimeLimit if follows => Some("The time limit ended the run before all was computed."),
        Stop::Interrupted if follows => Some("The run was interrupted before all was computed."),
        _ => None,
    };
    let doubt = outcome.end.as_ref().and_then(|end| end.doubt.as_deref());
    let before: Vec<&str> = doubt.into_iter().chain(cut_off).collect();
    match (before.is_empty(), tone) {
        (true, _) => Verdict { tone, text },
        (false, Tone::Good) => Verdict::new(Tone::Mixed, format!("{} {text}", before.join(" "))),
        (false, _) => Verdict::new(tone, format!("{} {text}", before.join(" "))),
    }
}

/// Returns the criteria with this usage in the problem. Criteria of data that are not calibration data are only
/// reported.
pub(crate) fn used_as<'a>(of: &Solution<'a>, usage: Usage) -> Vec<&'a CriterionReport> {
    let rows = of.outcome.criteria.iter().zip(&of.problem.shape().rows);
    rows.filter(|(_, (used, _))| *used == usage).map(|(criterion, _)| criterion).collect()
}

fn violation(criterion: &CriterionReport) -> f64 {
    if criterion.usage == Usage::Equality { (criterion.scaled - 1.0).abs() } else { criterion.scaled - 1.0 }
}

/// Returns a clause on the change of a quantity since the initial guess.
pub(crate) fn changed(what: &str, start: f64, now: f64) -> String {
    let [from, to] = [start, now].map(|v| significant(v, 4));
    match (start.is_finite(), now) {
        (false, _) => format!("{what} is {to}, without a value at the initial guess"),
        _ if from == to => format!("{what} stayed at {to}"),
        (_, now) if now < start => format!("{what} fell from {from} to {to}"),
        _ => format!("{what} rose from {from} to {to}"),
    }
}

/// Returns a clause on a missed demand, with the amount.
pub(crate) fn missed(criterion: &CriterionReport) -> String {
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
pub fn stop(outcome: &Outcome, room: &dyn Room) -> &'static str {
    match outcome.stop {
        Stop::Converged if outcome.solver == "none" => room.not_solved(),
        Stop::Converged => "Converged (solver tolerance reached)",
        Stop::Budget => "Budget exhausted; a larger budget may find a better point",
        Stop::TimeLimit => "Time limit reached; more time (--resume) may find a better point",
        Stop::Stalled => "Stalled: no further improvement found, convergence not reached",
        Stop::Interrupted => "Interrupted by the user",
    }
}

/// Returns what is known of the reported point at the end of the search.
pub fn end(outcome: &Outcome) -> Option<String> {
    outcome.end.as_ref().map(|end| end.words.join(" ")).filter(|words| !words.is_empty())
}

/// Returns the solver, with the methods that it has run.
pub fn solver(outcome: &Outcome) -> String {
    if outcome.methods.is_empty() {
        outcome.solver.clone()
    } else {
        format!("{}: {}", outcome.solver, outcome.methods.join(", "))
    }
}

/// Returns the Pareto status in words.
pub fn pareto(pareto: Pareto) -> &'static str {
    match pareto {
        Pareto::CertifiedLocal => "Locally Pareto-optimal to first order",
        Pareto::NotShown => "Not certified as Pareto-optimal",
        Pareto::No => {
            "Not Pareto-optimal: a step of a thousandth of the box improves one criterion by more than 0.005 % and worsens no other"
        }
    }
}

/// Returns the warnings of the run, the notes of criteria, and the failures at the reported point.
pub fn warnings(of: &Solution<'_>) -> Vec<String> {
    let (outcome, study) = (of.outcome, of.problem.study());
    let mut all = outcome.warnings.clone();
    let noted = |c: &CriterionReport| {
        let value = with_unit(c.value, &c.unit);
        c.note.map(|note| format!("`{}` in case `{}`, {value}: {note}", c.name, c.case))
    };
    all.extend(outcome.criteria.iter().filter_map(noted));
    for (job, failure) in &of.best.failures {
        all.push(format!(
            "at the reported point, case `{}` failed: {failure}",
            study.cases()[study.jobs()[*job].case].name
        ));
    }
    let failed: usize = of.archive.iter().filter(|r| r.merit.objective.is_infinite()).count();
    if failed > 0 {
        all.push(format!("{failed} of {} have no value; see Failures", counted(of.archive.len(), "point")));
    }
    all
}
