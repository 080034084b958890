//! How well missing effects are found: simulated experiments whose truth is known, and folders of cases of others.

#[cfg(test)]
pub(crate) mod answers;
mod folder;
mod judge;
mod names;
mod page;
mod plan;
mod statistics;
mod table;
mod tool;

use mops::Catalogue;
use mops::core::stream;
use mops_testbed::Trial;
use rand::seq::SliceRandom;

use crate::parallel::each;
pub(crate) use folder::{Cases, Reply, schema};
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

/// What is asked beside the diagnosis of every case.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Beside {
    /// What brute force says.
    pub brute_force: bool,
    /// Further diagnoses, each with another order of the catalogue and another seed.
    pub orders: u64,
    /// The catalogue has what is missing, and no more.
    pub told: bool,
}

/// Runs a plan on so many threads.
pub(crate) fn run(plan: &Plan, tools: Tools<'_>, jobs: usize, beside: Beside) -> Results {
    let done = each(&plan.wishes(), jobs, tools.watch, |wish| {
        let trial = plan.make(wish);
        if trial.as_ref().is_some_and(|trial| !plan.wants(&trial.name)) {
            return None;
        }
        Some(trial.map(|trial| answered(plan, wish, &trial, tools, beside)))
    });
    // By name the kinds that have a case of that number are not all asked for.
    let unmade = if plan.only.is_empty() { done.iter().filter(|case| case.is_none()).count() } else { 0 };
    let (rows, brute): (Vec<Row>, Vec<Option<Row>>) = done.into_iter().flatten().unzip();
    Results { rows, brute: brute.into_iter().flatten().collect(), unmade }
}

/// What is asked for; a panic is a failure as any other.
fn guarded<T>(ask: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let broke = |_| Err("the program broke".to_owned());
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(ask)).unwrap_or_else(broke)
}

fn answered(plan: &Plan, wish: &Wish, trial: &Trial, tools: Tools<'_>, beside: Beside) -> (Row, Option<Row>) {
    let size = if wish.kind == Kind::Nothing { 0.0 } else { plan.nearest(trial.truth.size) };
    let row = |answer| Row::new(trial, wish.kind, size, answer);
    let missing = beside.told.then(|| only(tools.catalogue, trial));
    let tools = Tools { catalogue: missing.as_ref().unwrap_or(tools.catalogue), ..tools };
    let read = |tools: Tools<'_>| tools.study("study.toml", &trial.study, &tool::InMemory(&trial.files));
    let answer = |tools: Tools<'_>| {
        guarded(|| tools.diagnose(read(tools)?)).map(|(diagnosis, seconds)| Answer::of(&diagnosis, seconds))
    };
    let brute = beside.brute_force.then(|| row(guarded(|| tools.brute_force(&read(tools)?))));
    let mut row = row(answer(tools));
    if let Ok(first) = &row.answer {
        let agreeing = (1..=beside.orders).map(|order| {
            let catalogue = shuffled(tools.catalogue, order);
            let again = answer(Tools { catalogue: &catalogue, seed: tools.seed.wrapping_add(order), ..tools });
            again.is_ok_and(|again| first.agrees(&again))
        });
        row.agreeing = agreeing.collect();
    }
    (row, brute)
}

/// The catalogue with no more effects than are missing.
fn only(catalogue: &Catalogue, trial: &Trial) -> Catalogue {
    let missing = |name| trial.truth.effects.iter().any(|e| names::names(&e.class, &e.strengths).contains(&name));
    let mut catalogue = catalogue.clone();
    catalogue.effects.retain(|effect| missing(effect.name()));
    catalogue
}

/// The catalogue with its effects in another order.
fn shuffled(catalogue: &Catalogue, order: u64) -> Catalogue {
    let mut catalogue = catalogue.clone();
    catalogue.effects.shuffle(&mut stream(order, "order of the catalogue"));
    catalogue
}
