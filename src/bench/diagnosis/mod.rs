//! How well missing effects are found: simulated experiments whose truth is known, and folders of cases of others.

mod folder;
mod judge;
mod names;
mod page;
mod plan;
mod statistics;
mod table;
mod tool;

use mops_testbed::Trial;

use super::each;
pub(crate) use folder::{Cases, Reply};
#[cfg(test)]
pub(crate) use judge::Judgement;
pub(crate) use judge::Row;
pub(crate) use page::page;
pub(crate) use plan::{Kind, Plan, Wish};
pub(crate) use statistics::{Bin, Rate, brier, deciles, reliability, uniformity};
pub(crate) use table::{csv, strengths};
pub(crate) use tool::{Answer, Tools, spelt};

/// What a benchmark over simulated experiments gives.
pub(crate) struct Results {
    /// The cases in the order of the plan, with the answers of the diagnosis.
    pub rows: Vec<Row>,
    /// The same cases with those of brute force, where it was asked.
    pub brute: Vec<Row>,
    /// Cases asked for that no plant could give.
    pub unmade: usize,
}

/// Runs a plan on so many threads.
pub(crate) fn run(plan: &Plan, tools: Tools<'_>, jobs: usize, against: bool) -> Results {
    let done = each(&plan.wishes(), jobs, tools.watch, |wish| {
        let trial = plan.make(wish);
        Some(trial.map(|trial| answered(plan, wish, &trial, tools, against)))
    });
    let unmade = done.iter().filter(|case| case.is_none()).count();
    let (rows, brute): (Vec<Row>, Vec<Option<Row>>) = done.into_iter().flatten().unzip();
    Results { rows, brute: brute.into_iter().flatten().collect(), unmade }
}

fn answered(plan: &Plan, wish: &Wish, trial: &Trial, tools: Tools<'_>, against: bool) -> (Row, Option<Row>) {
    let size = if wish.kind == Kind::Nothing { 0.0 } else { plan.nearest(trial.truth.size) };
    let row = |answer| Row::new(trial, wish.kind, size, answer);
    let study = match tools.study("study.toml", &trial.study, &tool::InMemory(&trial.files)) {
        Ok(study) => study,
        Err(why) => return (row(Err(why)), None),
    };
    let brute = against.then(|| row(tools.brute_force(&study)));
    let guarded = std::panic::AssertUnwindSafe(|| tools.diagnose(study));
    let answer = std::panic::catch_unwind(guarded).unwrap_or_else(|_| Err("the program broke".to_owned()));
    (row(answer.map(|(diagnosis, seconds)| Answer::of(&diagnosis, seconds))), brute)
}
