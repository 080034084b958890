//! Differentiating: what is left of an acceleration by differences is noise, where outputs still show the effect.

use std::sync::Arc;

use mops_core::{Effect, Input, case::Hold};
use mops_effects::effects;
use mops_math as math;

use crate::fit::Meter;
use crate::testing::{Record, integrated, screened, subject, white};

const CART: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", k = "N/m", d = "N s/m" }
der        = { x = "v", v = "m*v' = u - k*x - d*v" }
"#;
const STEP: f64 = 0.01;
const COUNT: u32 = 500;
const NOISE: f64 = 2e-3;
const RUNS: usize = 9;

fn command(t: f64) -> f64 {
    2.0 * math::sin(1.7 * t) + math::cos(4.1 * t)
}

/// Positions of a cart with a spring that stiffens.
fn record(run: usize) -> Record {
    let rates =
        |t: f64, x: &[f64; 2]| [x[1], (command(t) - 12.0 * x[0] - 0.5 * x[1] - 2.0 * math::powi(x[0], 3)) / 1.5];
    let states = integrated(rates, [0.3, 0.0], STEP, COUNT as usize);
    let times: Vec<f64> = (0..COUNT).map(|k| f64::from(k) * STEP).collect();
    let noise = white(&format!("run {run}"), NOISE, states.len());
    let values = states.iter().zip(noise).map(|(s, e)| s[0] + e).collect();
    let samples = times.iter().map(|&t| command(t)).collect();
    let inputs = vec![("u", Input::Sampled { times: times.clone(), values: samples, hold: Hold::First })];
    Record { inputs, times, signals: vec![("x", values, NOISE)] }
}

/// A force by position and speed.
type Force = fn(f64, f64) -> f64;

/// Terms of a force.
const TERMS: [(&str, Force); 4] = [
    ("cubic-stiffness", |x, _| x * x * x),
    ("coulomb-friction", |_, v| v.signum()),
    ("quadratic-drag", |_, v| v * v.abs()),
    ("cubic-drag", |_, v| v * v * v),
];

/// The term that least squares on central differences of the positions finds, with mass, spring and damper beside it.
fn by_differences(record: &Record) -> &'static str {
    let y = &record.signals[0].1;
    let inner = 1..y.len() - 1;
    let left = |term: Force| {
        let row = |i: usize| {
            let v = (y[i + 1] - y[i - 1]) / (2.0 * STEP);
            let a = (y[i + 1] - 2.0 * y[i] + y[i - 1]) / (STEP * STEP);
            [command(record.times[i]), y[i], v, term(y[i], v), a]
        };
        let rows: Vec<[f64; 5]> = inner.clone().map(row).collect();
        let a = nalgebra::DMatrix::from_fn(rows.len(), 4, |i, j| rows[i][j]);
        let b = nalgebra::DVector::from_fn(rows.len(), |i, _| rows[i][4]);
        let x = a.clone().svd(true, true).solve(&b, 1e-14).expect("both sides were asked for");
        (a * x - b).norm_squared()
    };
    TERMS.iter().min_by(|a, b| left(a.1).total_cmp(&left(b.1))).expect("there are four").0
}

/// The effect that the score on outputs puts first.
fn by_outputs(record: Record) -> String {
    let mut subject = subject(CART, &[1.5, 14.0, 0.5, 0.3, 0.0], 2, vec![record]);
    subject.measurements[0].locals[0].start = 0.3;
    let simulations = Meter::new(&());
    let named: Vec<Arc<dyn Effect>> =
        effects().into_iter().filter(|e| TERMS.iter().any(|(name, _)| *name == e.name())).collect();
    assert_eq!(named.len(), TERMS.len());
    screened(&subject, &named, &simulations).remove(0).0
}

#[test]
fn outputs_show_the_effect_where_differences_drown_it() {
    let (mut differences, mut outputs) = (0, 0);
    for run in 0..RUNS {
        let record = record(run);
        differences += usize::from(by_differences(&record) == "cubic-stiffness");
        outputs += usize::from(by_outputs(record) == "cubic-stiffness");
    }
    assert_eq!(outputs, RUNS);
    assert!(differences < RUNS - 2, "{differences} of {RUNS}");
}
