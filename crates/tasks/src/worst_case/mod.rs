//! `task = "worst-case"`: largest scaled value of every criterion over a box of uncertain parameters.

mod climb;
mod search;
mod section;

use mops_core::{Problem, Stop, Study, Usage, Watch, study::Row, task::WorstCaseTask};

use crate::uncertain::{CoordinateReport, Slice, WorstCaseReport, WorstReport, uncertain_reports};

pub(crate) use search::{Effort, Region, Worst};
pub(crate) use section::{lines, table};

use mops_content::{
    numbers::{counted, significant},
    section::{Block, Section, Tone, Verdict},
};
use mops_outcome::{BlockKind, Outcome};

use crate::batches::{Stage, each};
use crate::room::{Judgement, Room, Solution, TaskCommand, solve_at};
use crate::search::{Options, SolveError, Solved};
use crate::uncertain::{interrupted, lines_of_parameters};

/// Number of values along each parameter through a worst case.
const SLICE: usize = 61;

/// Caveat of every search for worst cases.
pub(crate) const NO_GUARANTEE: &str =
    "These are the worst cases that were found, not a guarantee: the box may contain worse ones.";

/// `task = "worst-case"`.
pub struct WorstCase;

impl Room for WorstCase {
    fn title(&self) -> &'static str {
        "Worst case"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        perform(study, options, watch)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "worst-case",
            about: "Search the uncertain parameters of a study for the worst cases of its criteria",
            after_help: "",
            has_solver: true,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<WorstCaseReport>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let Some(found) = of.outcome.found.get::<WorstCaseReport>() else { return Judgement::OfPoint(interrupted()) };
        Judgement::OfFindings(verdict(found))
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        of.outcome.found.get::<WorstCaseReport>().map(|found| section::of(of, found)).into_iter().collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        let Some(found) = outcome.found.get::<WorstCaseReport>() else { return Vec::new() };
        vec![
            Block::Table(lines_of_parameters(&found.parameters)),
            Block::Table(lines(&found.criteria, &found.parameters)),
            Block::Findings(found.words.clone()),
        ]
    }

    fn samples_uncertain(&self, _study: &Study) -> bool {
        true
    }
}

fn verdict(found: &WorstCaseReport) -> Verdict {
    if found.criteria.is_empty() {
        return Verdict::new(Tone::Bad, found.words.join(" "));
    }
    if found.criteria.iter().all(|c| c.at.is_empty()) {
        return Verdict::new(Tone::Bad, "No criterion has a value anywhere in the box.");
    }
    let demanded = found.criteria.iter().filter(|c| c.of.demand.is_some());
    let is_demanded = demanded.clone().next().is_some();
    let are_met = demanded.clone().all(|c| c.met) && found.criteria.iter().all(|c| c.failed == 0);
    let worst = demanded.filter(|c| !c.met).max_by(|a, b| a.scaled.total_cmp(&b.scaled));
    let failed: usize = found.criteria.iter().map(|c| c.failed).sum();
    let text = match (worst, failed) {
        (Some(worst), _) => format!(
            "Demand missed in the box: `{}` in case `{}` has the worst scaled value {}.",
            worst.of.criterion,
            worst.of.case,
            significant(worst.scaled, 4)
        ),
        (None, _) if !is_demanded => found.criteria.iter().map(sentence).next().unwrap_or_default(),
        (None, 0) => "All demands are met at every evaluated point of the box.".to_owned(),
        (None, _) => {
            format!(
                "{} in the box failed; all demands are met at the other evaluated points.",
                counted(failed, "simulation")
            )
        }
    };
    Verdict::new(if are_met { Tone::Good } else { Tone::Mixed }, text)
}

fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.options::<WorstCaseTask>().cloned().unwrap_or_default();
    let mut solved = solve_at(task.at, study, options, watch)?;
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
    solved.outcome.found.add(WorstCaseReport { words, parameters, criteria, simulations, guaranteed: false });
    Ok(solved)
}

/// Evaluates every criterion along every parameter through its worst case.
#[allow(clippy::cast_precision_loss)]
fn slices(region: &Region, worst: &[Worst], watch: &dyn Watch) -> Vec<Vec<Slice>> {
    let study = region.study();
    let first = study.tuners().len() - study.uncertain().len();
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
pub(crate) fn place(at: &[CoordinateReport]) -> String {
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

pub(crate) fn sentence(worst: &WorstReport) -> String {
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
