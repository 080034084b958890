//! An actuator that was just switched on is not yet where its command is.

use mops_core::{Input, case::Hold};

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};

/// A tank that a pump fills: `x' = k u - d x`.
const TANK: &str = r#"
states     = { x = "m" }
inputs     = { u = "V" }
parameters = { k = "m/(V s)", d = "1/s" }
der        = { x = "x' = k*u - d*x" }
"#;
/// V/s.
const RATE: f64 = 2.0;

/// A record in which the command is `first` for 4 s, then `next`, and the pump, which follows no faster than [`RATE`],
/// begins at `begins`.
fn pumped(begins: f64, first: f64, next: f64) -> Record {
    let command = |t: f64| if t < 4.0 { first } else { next };
    let rates = |t: f64, x: &[f64; 2]| {
        let behind = command(t) - x[1];
        [0.3 * x[1] - 0.5 * x[0], (behind / 1e-3).clamp(-RATE, RATE)]
    };
    let mut record =
        Record::of_first("x", &integrated(rates, [0.2, begins], 0.02, 400), 0.02, 1e-3, &format!("{next}"));
    let input = Input::Sampled { times: vec![0.0, 4.0], values: vec![first, next], hold: Hold::Zero };
    record.inputs = vec![("u", input)];
    record
}

#[test]
fn an_actuator_of_limited_speed_may_begin_elsewhere_than_its_command() {
    let records = vec![pumped(0.0, 5.0, 1.0), pumped(-1.0, 3.0, 6.0)];
    let subject = subject(TANK, &[0.35, 0.45, 0.2], 1, records);
    let some = catalogue(&["input-rate-limit", "actuator-lag", "input-delay", "input-gain", "quadratic-input"]);
    let options = Options { max_effects: 2, level: 0.01, ..Options::default() };
    let diagnosis = diagnose(&study(&subject), &some, &options, &()).expect("it simulates");
    let effects: Vec<&str> = diagnosis.found.iter().map(|f| f.effect.as_str()).collect();
    assert_eq!(effects, ["input-rate-limit"]);
    let rate = diagnosis.found[0].strengths[0].value;
    assert!((rate / RATE - 1.0).abs() < 0.01, "{rate}");
    // Behind its command by as much as that was when it was switched on; the repaired study begins there.
    let begins = diagnosis.starts.iter().filter(|(_, name, _)| name == "u-input-rate-limit.start1");
    let begins: Vec<f64> = begins.map(|(_, _, value)| *value).collect();
    let all_right = begins.iter().zip([-5.0, -4.0]).all(|(begins, truth)| (begins - truth).abs() < 0.1);
    assert!(begins.len() == 2 && all_right, "{begins:?}");
    assert!(diagnosis.after.iter().all(|error| error.normalised < 1.1), "{:?}", diagnosis.after);
}
