//! `task = "worst-case"`: largest scaled value of every criterion over a box of uncertain parameters.

mod climb;
mod search;

use mops_core::{Problem, Stop, Study, Usage, Watch, study::Row};
use mops_outcome::robustness::{CoordinateReport, Slice, WorstCaseReport, WorstReport, uncertain_reports};

pub(super) use search::{Effort, Region, Worst};

use super::at;
use super::batches::{Stage, each};
use crate::numbers::significant;
use crate::search::{Options, SolveError, Solved};

/// Number of values along each parameter through a worst case.
const SLICE: usize = 61;

/// Caveat of every search for worst cases.
pub(super) const NO_GUARANTEE: &str =
    "These are the worst cases that were found, not a guarantee: the box may contain worse ones.";

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.tasks().worst_case.clone();
    let mut solved = at(task.at, study, options, watch)?;
    let study = solved.problem.study();
    let none_counts = study.rows().iter().all(|row| row.usage == Usage::Monitor);
    let wanted = |row: &Row| match &task.criteria {
        Some(names) => names.contains(&row.name),
        None => none_counts || row.usage != Usage::Monitor,
    };
    let effort = Effort { samples: task.samples, starts: task.starts };
    let region = Region::new(study, &solved.best.tuners, wanted, effort).keeping(options, study);
    let stage = Stage { what: "searching the worst cases", from: 0.0, to: 0.9 };
    let (worst, simulations) = region.search(watch, stage);
    let mut criteria: Vec<WorstReport> = worst.iter().map(|worst| worst.report.clone()).collect();
    let drawn = slices(&region, &worst, watch);
    let simulations = simulations + drawn.iter().flatten().map(|slice| slice.x.len()).sum::<usize>();
    criteria.iter_mut().zip(drawn).for_each(|(of, slices)| of.slices = slices);
    if criteria.is_empty() {
        solved.outcome.stop = watch.halt().into();
    }
    let words = words(&criteria, solved.outcome.stop);
    let parameters = uncertain_reports(region.study());
    solved.outcome.simulations += simulations;
    solved.outcome.found.worst_case =
        Some(WorstCaseReport { words, parameters, criteria, simulations, guaranteed: false });
    Ok(solved)
}

/// Evaluates every criterion along every parameter through its worst case.
#[allow(clippy::cast_precision_loss)]
fn slices(region: &Region, worst: &[Worst], watch: &dyn Watch) -> Vec<Vec<Slice>> {
    let study = region.study();
    let first = study.tuners().len() - study.tasks().uncertain.len();
    let problem = Problem::new(std::sync::Arc::new(study.clone()));
    let mut points = Vec::new();
    for (w, worst) in worst.iter().enumerate().filter(|(_, worst)| !worst.at.is_empty()) {
        for parameter in 0..worst.at.len() {
            let tuner = &study.tuners()[first + parameter];
            for i in 0..SLICE {
                let mut tuners = study.start();
                tuners[first..].copy_from_slice(&worst.at);
                tuners[first + parameter] = tuner.value_at(i as f64 / (SLICE - 1) as f64);
                points.push((w, parameter, tuners));
            }
        }
    }
    let stage = Stage { what: "plotting the worst cases", from: 0.9, to: 1.0 };
    let values = each(&points, stage, watch, |(w, _, tuners)| {
        let row = &study.rows()[worst[*w].row];
        problem.value_at(row, tuners).unwrap_or(f64::NAN)
    });
    let mut slices = vec![Vec::new(); worst.len()];
    for (chunk, values) in points.chunks(SLICE).zip(values.chunks_exact(SLICE)) {
        let (w, parameter, _) = chunk[0];
        let tuner = &study.tuners()[first + parameter];
        slices[w].push(Slice {
            parameter: tuner.name.clone(),
            unit: tuner.unit.to_string(),
            x: chunk.iter().map(|(_, _, tuners)| tuners[first + parameter]).collect(),
            y: values.to_vec(),
        });
    }
    slices
}

/// Formats the parameters of a worst case.
pub(super) fn place(at: &[CoordinateReport]) -> String {
    let one = |c: &CoordinateReport| {
        let unit = if c.unit == "1" { String::new() } else { format!(" {}", c.unit) };
        let end = c.at_bound.map_or_else(String::new, |side| format!(" ({side} end)"));
        format!("`{}` = {}{unit}{end}", c.name, significant(c.value, 4))
    };
    at.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Formats the worst cases as sentences.
fn words(criteria: &[WorstReport], stop: Stop) -> Vec<String> {
    if criteria.is_empty() {
        let cause = if stop == Stop::TimeLimit { "ended by the time limit" } else { "interrupted" };
        return vec![format!("The search of the box was {cause}, without a result.")];
    }
    let mut words: Vec<String> = criteria.iter().map(sentence).collect();
    words.push(NO_GUARANTEE.to_owned());
    words
}

pub(super) fn sentence(worst: &WorstReport) -> String {
    let of = &worst.of;
    let amount = |value: f64| match of.unit.as_str() {
        "1" => significant(value, 5),
        unit => format!("{} {unit}", significant(value, 5)),
    };
    if worst.at.is_empty() {
        let why = worst.failure.as_ref().map_or_else(String::new, |failure| format!(": {}", failure.why));
        return format!("`{}` in case `{}` has no value anywhere in the box{why}.", of.criterion, of.case);
    }
    let scaled =
        if worst.scaled.is_finite() { format!(", scaled {}", significant(worst.scaled, 4)) } else { String::new() };
    let nominal = if of.nominal.is_finite() { format!(" (nominal {})", amount(of.nominal)) } else { String::new() };
    let mut text = format!(
        "Worst case of `{}` in case `{}`: {}{scaled}{nominal}, at {}; found by {} of {} searches.",
        of.criterion,
        of.case,
        amount(worst.value),
        place(&worst.at),
        worst.ended_here,
        worst.starts
    );
    if worst.failed > 0 {
        let first =
            worst.failure.as_ref().map_or_else(String::new, |f| format!(", first at {}: {}", place(&f.at), f.why));
        text += &format!(" {} simulations in the box failed{first}. They may hide a worse case.", worst.failed);
    }
    text
}
