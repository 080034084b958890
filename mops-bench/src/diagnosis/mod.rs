//! Benchmark of the diagnosis: simulated experiments with known missing effects, and folders of external cases.

#[cfg(test)]
pub(crate) mod answers;
mod folder;
mod guarded;
mod judge;
mod names;
mod page;
mod plan;
pub(crate) mod settings;
mod statistics;
mod table;
mod tool;

use mops::{Catalogue, math::stream};
use mops_testbed::Trial;

use crate::parallel::each;
pub(crate) use folder::{Cases, Reply, schema};
use guarded::guarded;
pub(crate) use judge::Row;
#[cfg(test)]
pub(crate) use judge::{Judgement, Stated};
pub(crate) use page::page;
pub(crate) use plan::{Kind, Plan, Wish};
use rand::seq::SliceRandom;
pub(crate) use statistics::{Bin, Rate, brier, deciles, reliability, uniformity};
pub(crate) use table::{csv, strengths};
pub(crate) use tool::{Answer, Statement, Tools, spelt};

/// Results of the benchmark over simulated experiments.
pub(crate) struct Results {
    /// Cases in the order of the plan, with the answers of the diagnosis.
    pub rows: Vec<Row>,
    /// Cases with the answers of brute force, if requested.
    pub brute: Vec<Row>,
    /// Number of requested cases that could not be generated.
    pub unmade: usize,
}

/// Comparisons in addition to the diagnosis of every case.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Comparisons {
    /// True to run brute force as well.
    pub brute_force: bool,
    /// Number of additional diagnoses, each with a shuffled catalogue and another seed.
    pub orders: u64,
    /// True to restrict the catalogue to the missing effects.
    pub known_effects: bool,
    /// True to remove the missing effects from the catalogue.
    pub without_truth: bool,
}

/// Runs a plan on `jobs` threads.
pub(crate) fn run(plan: &Plan, tools: Tools<'_>, jobs: usize, comparisons: Comparisons) -> Results {
    let done = each(&plan.wishes(), jobs, tools.watch, |wish| {
        let trial = plan.make(wish);
        if trial.as_ref().is_some_and(|trial| !plan.wants(&trial.name)) {
            return None;
        }
        Some(trial.map(|trial| answered(plan, wish, &trial, tools, comparisons)))
    });
    // Cases selected by name belong to one kind; other kinds with the same number are not requested.
    let unmade = if plan.only.is_empty() { done.iter().filter(|case| case.is_none()).count() } else { 0 };
    let (rows, brute): (Vec<Row>, Vec<Option<Row>>) = done.into_iter().flatten().unzip();
    Results { rows, brute: brute.into_iter().flatten().collect(), unmade }
}

fn answered(plan: &Plan, wish: &Wish, trial: &Trial, tools: Tools<'_>, comparisons: Comparisons) -> (Row, Option<Row>) {
    let size = match wish.kind {
        Kind::Nothing => 0.0,
        Kind::Setting(_) => trial.truth.size,
        _ => plan.nearest(trial.truth.size),
    };
    let is_struck_out = comparisons.without_truth && !trial.truth.effects.is_empty();
    let row = |answer| Row { is_struck_out, ..Row::new(trial, wish.kind, size, answer) };
    let changed = if is_struck_out {
        Some(without_truth(tools.catalogue, trial))
    } else {
        comparisons.known_effects.then(|| only(tools.catalogue, trial))
    };
    let tools = Tools { catalogue: changed.as_ref().unwrap_or(tools.catalogue), ..tools };
    let read = |tools: Tools<'_>| tools.study("study.toml", &trial.study, &tool::InMemory(&trial.files));
    let answer = |tools: Tools<'_>| {
        guarded(|| tools.diagnose(&read(tools)?)).map(|(diagnosis, seconds)| Answer::of(&diagnosis, seconds))
    };
    let brute = comparisons.brute_force.then(|| row(guarded(|| tools.brute_force(&read(tools)?))));
    let mut row = row(answer(tools));
    if let Ok(first) = &row.answer {
        let agreeing = (1..=comparisons.orders).map(|order| {
            let catalogue = shuffled(tools.catalogue, order);
            let again = answer(Tools { catalogue: &catalogue, seed: tools.seed.wrapping_add(order), ..tools });
            again.is_ok_and(|again| first.agrees(&again))
        });
        row.agreeing = agreeing.collect();
    }
    (row, brute)
}

/// Returns the catalogue restricted to the missing effects.
fn only(catalogue: &Catalogue, trial: &Trial) -> Catalogue {
    let missing = |name| trial.truth.effects.iter().any(|e| names::names(&e.class, &e.strengths).contains(&name));
    let mut catalogue = catalogue.clone();
    catalogue.effects.retain(|effect| missing(effect.name()));
    catalogue
}

/// Returns the catalogue without the missing effects and those equivalent to them, under all names that are accepted
/// for them.
fn without_truth(catalogue: &Catalogue, trial: &Trial) -> Catalogue {
    let truth = &trial.truth;
    let is_true = |name: &str| truth.effects.iter().any(|e| names::names(&e.class, &e.strengths).contains(&name));
    let is_equivalent =
        |name: &str| truth.equivalents.iter().any(|(class, _)| names::names(class, &[]).contains(&name));
    let mut catalogue = catalogue.clone();
    catalogue.effects.retain(|effect| !is_true(effect.name()) && !is_equivalent(effect.name()));
    catalogue
}

/// Returns the catalogue with shuffled effects.
fn shuffled(catalogue: &Catalogue, order: u64) -> Catalogue {
    let mut catalogue = catalogue.clone();
    catalogue.effects.shuffle(&mut stream(order, "order of the catalogue"));
    catalogue
}

#[cfg(test)]
mod tests {
    use mops_testbed::{NOMINAL, Setting, disturbed};

    use super::*;

    fn catalogue() -> Catalogue {
        mops::catalogue()
    }

    #[test]
    fn a_catalogue_without_the_truth_has_no_accepted_name_and_all_others() {
        let all = catalogue();
        for nominal in NOMINAL {
            let make = |seed| disturbed(Setting::Effect, nominal.plant, nominal.effect, seed);
            let trial = (1..20).find_map(make).expect("a seed gives a trial");
            let rest = without_truth(&all, &trial);
            let truth = &trial.truth;
            let accepted: Vec<&str> = truth
                .effects
                .iter()
                .flat_map(|effect| names::names(&effect.class, &effect.strengths))
                .chain(truth.equivalents.iter().flat_map(|(class, _)| names::names(class, &[])))
                .collect();
            let struck_out: Vec<&str> =
                all.effects.iter().map(|e| e.name()).filter(|name| accepted.contains(name)).collect();
            assert!(!struck_out.is_empty(), "{}", trial.name);
            assert!(rest.effects.iter().all(|effect| !accepted.contains(&effect.name())), "{}", trial.name);
            assert_eq!(rest.effects.len() + struck_out.len(), all.effects.len());
        }
    }

    #[test]
    fn a_missing_effect_is_found_and_nothing_is_chosen_by_the_validation_record() {
        let effect = "coulomb-friction@joint:q";
        let mut trial =
            (1..20).find_map(|seed| disturbed(Setting::Effect, "driven-pendulum", effect, seed)).expect("a trial");
        let catalogue = only(&catalogue(), &trial);
        let tools =
            Tools { catalogue: &catalogue, watch: &(), seed: 1, settings: &mops::diagnosis::Settings::default() };
        let diagnosed = |trial: &Trial| {
            let study = tools.study("study.toml", &trial.study, &tool::InMemory(&trial.files)).unwrap();
            let (diagnosis, _) = tools.diagnose(&study).unwrap();
            Row::new(trial, Kind::Setting(Setting::Effect), 0.0, Ok(Answer::of(&diagnosis, 1.0)))
        };
        let first = diagnosed(&trial);
        assert!(first.judgement.first && first.judgement.stated.entries == [true], "{:?}", first.answer);
        let answer = first.answer.unwrap();
        assert!(answer.change(mops::core::Role::Validation).is_some_and(|change| change < 0.9));
        // The last record, replaced by one of constant level.
        let constant = |line: &str| format!("{},5.0\n", line.rsplit_once(',').expect("a line has several columns").0);
        let (header, lines) = trial.files[2].1.split_once('\n').expect("a file has a header");
        trial.files[2].1 = format!("{header}\n{}", lines.lines().map(constant).collect::<String>());
        let second = diagnosed(&trial).answer.unwrap();
        assert_eq!((&second.found, &second.statements), (&answer.found, &answer.statements));
        for ((name, now, _), (_, then, _)) in second.declared.iter().zip(&answer.declared) {
            assert!((now / then - 1.0).abs() < 1e-6, "{name}: {now}, not {then}");
        }
        assert!(second.records[2].before > 2.0 * answer.records[2].before);
    }
}
