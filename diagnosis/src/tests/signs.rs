//! The sign: friction takes energy, whatever the data would like.

use mops_core::{Input, case::Hold, effect::EffectClass};
use mops_effects::effects;
use mops_math as math;

use crate::testing::{Record, integrated, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::Verdict;

const SWING: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", k = "N/m" }
der        = { x = "v", v = "m*v' = u - k*x" }
"#;

#[test]
fn an_oscillation_that_is_driven_by_its_speed_is_never_put_down_to_negative_friction() {
    const STEP: f64 = 0.02;
    const COUNT: u32 = 400;
    let input = |t: f64| math::sin(1.3 * t);
    let states = integrated(
        |t, x: &[f64; 2]| [x[1], (input(t) - 8.0 * x[0] + 0.15 * x[1]) / 2.0],
        [0.2, 0.0],
        STEP,
        COUNT as usize,
    );
    let times: Vec<f64> = (0..COUNT).map(|k| f64::from(k) * STEP).collect();
    let values = states.iter().zip(white("driven", 2e-3, states.len())).map(|(s, e)| s[0] + e).collect();
    let samples = times.iter().map(|&t| input(t)).collect();
    let inputs = vec![("u", Input::Sampled { times: times.clone(), values: samples, hold: Hold::First })];
    let record = Record { inputs, times, signals: vec![("x", values, 2e-3)] };
    let subject = subject(SWING, &[2.1, 7.8, 0.2, 0.0], 2, vec![record]);
    let takes: Vec<_> = effects().into_iter().filter(|e| e.class() == EffectClass::Dissipative).collect();
    assert!(takes.len() > 5);
    let diagnosis =
        diagnose(&study(&subject), &takes, &Options { max_effects: 2, level: 0.05, ..Options::default() }, &())
            .expect("it simulates");
    assert!(diagnosis.before[0].normalised > 3.0, "{:?}", diagnosis.before);
    assert_eq!(diagnosis.verdict, Verdict::Unexplained, "{:?}", diagnosis.found);
    let strengths = diagnosis.found.iter().flat_map(|f| f.strengths.first().map(|s| (&f.effect, s)));
    let strengths = strengths.chain(diagnosis.ranked.iter().flat_map(|r| r.strengths.first().map(|s| (&r.effect, s))));
    for (effect, strength) in strengths {
        assert!(strength.value >= 0.0, "{effect}: {strength:?}");
    }
}
