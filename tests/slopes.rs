//! Derivatives of criteria with respect to the parameters of effects, compared with differences of simulations.
//!
//! Pairs of effects at every place of three plants and across places, with a step, a sloped recording and a sine; every
//! criterion over time is asked for its slope alone.
//! `MOPS_SLOPES=all cargo test --release --test slopes -- --include-ignored --nocapture` runs all of them; the full
//! tier runs a tenth.

#[path = "slopes/criteria.rs"]
mod criteria;
#[path = "slopes/differences.rs"]
mod differences;
#[path = "common/plants.rs"]
#[allow(dead_code)] // The comparison of pairs with independent simulations reads more of it.
mod plants;
#[path = "slopes/systems.rs"]
mod systems;

use std::collections::BTreeMap;

use mops_core::{Analysis, Case, Job, Value, criterion::Tangent};
use rayon::prelude::*;

use criteria::{Asked, asked};
use differences::{Verdict, judge};
use plants::{Chosen, Setup, setups};
use systems::systems;

/// Distance along the derivative, in units of the parameter, within which a slope is to describe the criterion.
const REACH: f64 = 1e-6;

/// Share of the slopes that may stay undecided.
const UNDECIDED: f64 = 0.1;

/// Share of the slopes that may be off: those of effects whose law has an infinite derivative at a threshold, or bends
/// where a joint reverses (see ADR 5).
const OFF: f64 = 0.003;

/// One of so many setups is compared in the full tier.
const TENTH: usize = 10;

/// Comparison of a slope with differences.
struct Compared {
    setup: usize,
    criterion: String,
    parameter: String,
    verdict: Verdict,
}

fn analyse(setup: &Setup, asked: &[Asked], parameters: &[f64]) -> Option<(Analysis, Vec<f64>)> {
    let case = setup.case();
    let job = setup.job(&case, parameters);
    let analysis = setup.model.analyse(&job).ok()?;
    let values = values(&case, asked, &analysis, parameters);
    Some((analysis, values))
}

fn values(case: &Case, asked: &[Asked], analysis: &Analysis, parameters: &[f64]) -> Vec<f64> {
    let value = |asked: &Asked| match asked.criterion.value_with(case, analysis, parameters) {
        Ok(Value { number, missed: None, .. }) => number,
        _ => f64::NAN,
    };
    asked.iter().map(value).collect()
}

/// Compares all slopes of a setup.
fn compare(index: usize, setup: &Setup) -> Vec<Compared> {
    let asked = asked(setup.model.interface());
    let Some((_, here)) = analyse(setup, &asked, &setup.parameters) else { return Vec::new() };
    let (case, interface) = (setup.case(), setup.model.interface());
    let job: Job<'_> = setup.job(&case, &setup.parameters);
    let ranges: Vec<f64> = setup.varied.iter().map(|&i| setup.parameters[i].abs().max(0.05)).collect();
    let seed = |(&i, &range): (&usize, &f64)| {
        let mut seed = vec![0.0; setup.parameters.len()];
        seed[i] = range;
        seed
    };
    let seeds: Vec<Vec<f64>> = setup.varied.iter().zip(&ranges).map(seed).collect();
    let Some(Ok((analysis, tangents))) = setup.model.tangents(&job, &seeds) else { return Vec::new() };
    let mut found = Vec::new();
    for ((&i, &range), (along, seed)) in setup.varied.iter().zip(&ranges).zip(tangents.iter().zip(&seeds)) {
        let at = |by: f64| {
            let mut parameters = setup.parameters.clone();
            parameters[i] += by * range;
            analyse(setup, &asked, &parameters).map_or_else(|| vec![f64::NAN; asked.len()], |(_, values)| values)
        };
        let around = differences::STEPS.map(|by| [at(-by), at(by)]);
        for (k, asked) in asked.iter().enumerate().filter(|(k, _)| here[*k].is_finite()) {
            let Ok(value) = asked.criterion.value_with(&case, &analysis, &setup.parameters) else { continue };
            let (parameters, reach) = (&setup.parameters[..], REACH);
            let tangent = Tangent { analysis: &analysis, value: &value, along, parameters, seed, reach };
            // Refused, as instants coincide.
            let Ok(Value { number: reported, .. }) = asked.criterion.slope(&case, &tangent) else { continue };
            let values = around.each_ref().map(|[low, high]| [low[k], high[k]]);
            found.push(Compared {
                setup: index,
                criterion: asked.name.clone(),
                parameter: interface.parameters[i].variable.name.clone(),
                verdict: judge(reported, here[k], &values),
            });
        }
    }
    found
}

/// Compares the slopes of some setups, and fails if one is off, or too many are undecided.
fn check(setups: &[&Setup]) {
    let compared: Vec<Compared> = (0..setups.len()).into_par_iter().flat_map_iter(|i| compare(i, setups[i])).collect();
    let of = |wanted: fn(&Verdict) -> bool| compared.iter().filter(|c| wanted(&c.verdict)).count();
    let (off, undecided) = (of(|v| matches!(v, Verdict::Off { .. })), of(|v| *v == Verdict::Undecided));
    // Of every parameter of a setup, the number of slopes that are off, and the one that is off most.
    let mut worst: BTreeMap<String, (usize, f64, String)> = BTreeMap::new();
    for Compared { setup, criterion, parameter, verdict } in &compared {
        let Verdict::Off { reported, sides } = verdict else { continue };
        let Setup { name, effects, .. } = setups[*setup];
        let off =
            sides.map(|side| (reported - side).abs() / side.abs().max(1e-3)).into_iter().fold(f64::INFINITY, f64::min);
        let entry = worst.entry(format!("{effects}, {parameter}")).or_default();
        entry.0 += 1;
        if off >= entry.1 {
            let [left, right] = sides;
            (entry.1, entry.2) = (off, format!("{name}: {criterion} {reported:.6}, not {left:.6} or {right:.6}"));
        }
    }
    for (pair, (count, off, line)) in &worst {
        println!("{count:6} {off:8.1e} {pair}\n       {line}");
    }
    println!("{} setups, {} slopes: {off} off, {undecided} undecided", setups.len(), compared.len());
    let share = |count: usize| count as f64 / compared.len() as f64;
    assert!(share(off) <= OFF, "{off} of {} slopes are off", compared.len());
    assert!(share(undecided) <= UNDECIDED, "{:.1} % of the slopes are undecided", 100.0 * share(undecided));
}

#[test]
fn slopes_of_jumps_and_corners_at_moving_times_are_the_differences_of_simulations() {
    let systems = systems();
    check(&systems.iter().collect::<Vec<_>>());
}

#[test]
#[ignore = "full tier"]
fn slopes_of_pairs_of_effects_are_the_differences_of_simulations() {
    let all = std::env::var("MOPS_SLOPES").is_ok_and(|which| which == "all");
    let only = std::env::var("MOPS_SLOPES_OF").unwrap_or_default();
    let setups: Vec<Setup> =
        setups(Chosen::Differentiable).into_iter().filter(|setup| setup.name.contains(&only)).collect();
    let chosen = |(index, _): &(usize, &Setup)| all || index % TENTH == 0;
    check(&setups.iter().enumerate().filter(chosen).map(|(_, setup)| setup).collect::<Vec<_>>());
}
