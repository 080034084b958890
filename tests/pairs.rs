//! Simulations of plants with two effects at one place, compared with independent simulations.
//!
//! Pairs of effects at every place of three plants, with a step, a sloped recording and a sine. The twins of the
//! testbed share no code with the models: the laws follow the documented formulas, the integrator has fixed steps.
//! `MOPS_SLOPES=all cargo test --release
//! --test pairs -- --include-ignored --nocapture` compares all pairs; the full tier compares a tenth.

#[path = "common/plants.rs"]
#[allow(dead_code)]
mod plants;
#[path = "pairs/twin.rs"]
mod twin;

use std::collections::BTreeMap;

use mops_core::Job;
use rayon::prelude::*;

use plants::{Chosen, HORIZON, Setup, setups};

/// Number of times at which signals are compared.
const TIMES: u32 = 100;

/// Permitted deviation of a signal, relative to its largest magnitude.
const TOLERANCE: f64 = 1e-5;

/// Largest integration steps of a twin, s: the second one is used where signals deviate, the others where a smaller
/// step changes the twin's own signals.
const STEPS: [f64; 5] = [5e-4, 2.5e-4, 1e-4, 2.5e-5, 1e-5];

/// Change of the twin's signals with the step size up to which they have converged, relative to the largest magnitude.
const CONVERGED: f64 = 1e-6;

/// Change of a signal around a time, relative to its largest magnitude, beyond which it jumps there.
const JUMP: f64 = 1e-3;

/// Size of the twin's signals from which on the plant diverges with its effects.
const DIVERGED: f64 = 1e3;

/// Half the width of the interval around a time in which a jump is looked for, s.
const AROUND: f64 = 1e-6;

/// One of so many setups is compared in the full tier.
const TENTH: usize = 10;

/// Pairs that are always compared.
const ALWAYS: [&str; 16] = [
    "coulomb-friction + stribeck-friction",
    "stiction + asymmetric-friction",
    "input-delay + actuator-lag",
    "actuator-lag + input-delay",
    "input-dead-zone + backlash",
    "backlash + input-dead-zone",
    "sensor-delay + sensor-saturation",
    "sensor-saturation + sensor-delay",
    "added-mass + added-mass",
    "mass-loss + added-mass",
    "actuator-lag + input-rate-limit",
    "second-order-lag + backlash",
    "backlash + sensor-lag",
    "input-saturation + backlash",
    "input-dead-zone + input-rate-limit",
    "sensor-gap + backlash",
];

/// Largest difference between the simulations of a setup.
#[derive(Debug, Clone)]
struct Deviation {
    /// Difference relative to the largest magnitude of the signal; infinite if the model fails.
    size: f64,
    /// Signal, time, and both values.
    line: String,
}

/// Signals by time, and which of them jump there.
type Signals = Vec<Vec<(f64, bool)>>;

fn times() -> Vec<f64> {
    let time = |k: u32| HORIZON * (f64::from(k) - 0.37) / f64::from(TIMES);
    (1..=TIMES).map(time).collect()
}

/// Simulates the model.
fn simulate(setup: &Setup, times: &[f64]) -> Result<Signals, String> {
    let case = setup.case();
    let signals: Vec<usize> = (0..setup.model.interface().signals.len()).collect();
    let job = Job { case: &case, parameters: &setup.parameters, signals: &signals, horizon: HORIZON };
    let analysis = setup.model.analyse(&job).map_err(|failure| format!("{failure:?}"))?;
    let response = analysis.response().expect("a simulation");
    let sizes: Vec<f64> =
        response.traces.iter().map(|(_, trace)| trace.maximum().1.abs().max(trace.minimum().1.abs())).collect();
    let row = |&t: &f64| {
        let value = |((_, trace), size): (&(String, mops_core::Trace), &f64)| {
            let jumps = (trace.at(t + AROUND) - trace.at(t - AROUND)).abs() > JUMP * size;
            (trace.at(t), jumps)
        };
        response.traces.iter().zip(&sizes).map(value).collect()
    };
    Ok(times.iter().map(row).collect())
}

/// Returns the largest difference of signals relative to their largest magnitudes, with its signal and time.
fn largest(a: &Signals, b: &Signals) -> (f64, usize, usize) {
    let mut found = (0.0, 0, 0);
    for signal in 0..a[0].len() {
        let sizes = a.iter().chain(b).map(|row| row[signal].0.abs());
        let size = sizes.fold(f64::MIN_POSITIVE, f64::max);
        for k in (0..a.len()).filter(|&k| !a[k][signal].1) {
            let off = (a[k][signal].0 - b[k][signal].0).abs() / size;
            if off > found.0 || off.is_nan() {
                found = (off, signal, k);
            }
        }
    }
    found
}

/// Compares the simulations of a setup.
fn compare(setup: &Setup) -> Deviation {
    let times = times();
    let model = match simulate(setup, &times) {
        Ok(model) => model,
        Err(line) => {
            let diverges =
                twin::simulate(setup, &times, STEPS[0]).iter().flatten().any(|y| y.0.is_nan() || y.0.abs() > DIVERGED);
            return Deviation { size: if diverges { 0.0 } else { f64::INFINITY }, line };
        }
    };
    let mut last: Option<Signals> = None;
    let mut found = (f64::INFINITY, 0, 0);
    for step in STEPS {
        let twin = twin::simulate(setup, &times, step);
        found = largest(&model, &twin);
        let converged = last.as_ref().is_some_and(|last| largest(last, &twin).0 <= CONVERGED);
        last = Some(twin);
        if found.0 <= CONVERGED || converged {
            break;
        }
    }
    let (size, signal, k) = found;
    let (name, twin) = (&setup.model.interface().signals[signal].name, last.expect("a step size is tried"));
    let line = format!("{name}({:.4} s) = {:.9}, not {:.9}", times[k], model[k][signal].0, twin[k][signal].0);
    Deviation { size, line }
}

/// Compares the simulations of some setups, and fails if one is off.
fn check(setups: &[&Setup]) {
    let compared: Vec<Deviation> = setups.par_iter().map(|setup| compare(setup)).collect();
    let mut worst: BTreeMap<&str, (usize, f64, String)> = BTreeMap::new();
    let mut off = 0;
    for (setup, Deviation { size, line }) in setups.iter().zip(&compared) {
        if *size <= TOLERANCE {
            continue;
        }
        off += 1;
        let entry = worst.entry(&setup.effects).or_default();
        entry.0 += 1;
        if *size >= entry.1 {
            (entry.1, entry.2) = (*size, format!("{}: {line}", setup.name));
        }
    }
    for (pair, (count, size, line)) in &worst {
        println!("{count:6} {size:8.1e} {pair}\n       {line}");
    }
    let largest = compared.iter().map(|found| found.size).filter(|size| *size <= TOLERANCE).fold(0.0, f64::max);
    println!("{} setups: {off} off; largest deviation of the others {largest:.1e}", setups.len());
    assert!(!setups.is_empty() && off == 0, "{off} of {} simulations are off", setups.len());
}

/// Returns the pairs at one place that are compared. The side on which a sensor saturates is a whole number.
fn pairs() -> Vec<Setup> {
    let mut setups = setups(Chosen::All);
    setups.retain(|setup| setup.is_at_one_place() && !twin::is_too_stiff(setup));
    for setup in &mut setups {
        let named = setup.model.interface().parameters.iter().map(|parameter| &parameter.variable.name);
        let is_side: Vec<bool> = named.map(|name| name.ends_with(".side")).collect();
        for (value, _) in setup.parameters.iter_mut().zip(is_side).filter(|(_, is_side)| *is_side) {
            *value = value.round();
        }
    }
    setups
}

#[test]
fn every_effect_has_an_independent_law() {
    for effect in mops::effects::effects() {
        let (name, parameters) = (effect.name(), effect.parameters().len());
        assert!(mops_testbed::twins::has_law(name, parameters), "`{name}` needs its law in tests/testbed/src/twins");
    }
}

#[test]
fn pairs_of_effects_whose_order_or_sum_matters_are_simulated_as_independently() {
    let pairs = pairs();
    check(&pairs.iter().filter(|setup| ALWAYS.contains(&&setup.effects[..])).collect::<Vec<_>>());
}

#[test]
#[ignore = "full tier"]
fn pairs_of_effects_at_one_place_are_simulated_as_independently() {
    let all = std::env::var("MOPS_SLOPES").is_ok_and(|which| which == "all");
    let only = std::env::var("MOPS_SLOPES_OF").unwrap_or_default();
    let pairs: Vec<Setup> =
        pairs().into_iter().filter(|setup| format!("{} {}", setup.name, setup.effects).contains(&only)).collect();
    let chosen = |(index, _): &(usize, &Setup)| all || index % TENTH == 0;
    check(&pairs.iter().enumerate().filter(chosen).map(|(_, setup)| setup).collect::<Vec<_>>());
}
