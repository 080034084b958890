//! Selection data help to choose; parameters come from calibration data; validation data decide nothing.

use std::sync::Arc;

use mops_core::{Effect, Input, Role, case::Hold};
use mops_math as math;

use crate::records::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::{Diagnosis, Verdict};

/// A block that slides on without friction, of which the data have some of the air: `v' = -k v |v|`.
const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { a = "m/s^2" }
der        = { x = "v", v = "v' = a" }
"#;
const DRAG: f64 = 0.2;
const NOISE: f64 = 0.01;

fn slide(label: &str, speed: f64, duration: f64) -> Record {
    const COUNT: u32 = 120;
    let step = duration / f64::from(COUNT - 1);
    let states = integrated(|_, x: &[f64; 2]| [x[1], -DRAG * x[1] * x[1].abs()], [0.0, speed], step, COUNT as usize);
    Record::of_first("x", &states, step, NOISE, label)
}

/// Slow slides to calibrate with; a fast one with a role of its own, and one to validate with that is moved by `shift`.
fn block(fast: Role, shift: f64) -> Subject {
    let mut last = slide("last", 3.0, 2.0);
    last.signals[0].1.iter_mut().enumerate().for_each(|(k, x)| *x += shift * math::sin(0.1 * k as f64));
    let mut subject =
        subject(BLOCK, &[-0.01, 0.0, 2.0], 2, vec![slide("slow", 1.5, 2.0), slide("fast", 6.0, 4.0), last]);
    subject.measurements[1].role = fast;
    subject.measurements[2].role = Role::Validation;
    subject
}

fn named() -> Vec<Arc<dyn Effect>> {
    catalogue(&["viscous-friction", "quadratic-drag", "cubic-drag"])
}

fn diagnosis(subject: &Subject) -> Diagnosis {
    diagnose(&study(subject), &named(), &Options { max_effects: 1, level: 0.05, ..Options::default() }, &())
        .expect("it simulates")
}

#[test]
#[ignore = "full tier"]
fn validation_data_change_no_bit_of_what_is_found() {
    let [one, other] = [0.0, 0.5].map(|shift| diagnosis(&block(Role::Selection, shift)));
    assert_eq!(format!("{:?}", one.found), format!("{:?}", other.found));
    assert_eq!(one.parameters, other.parameters);
    assert_eq!(format!("{:?}", one.ranked), format!("{:?}", other.ranked));
    assert_ne!(one.after[2], other.after[2]);
}

/// A gain of a signal that nothing foretells.
const AMPLIFIER: &str = r#"
states     = { x = "V" }
inputs     = { u = "V" }
parameters = { k = "1" }
der        = { x = "x' = -1 [1/s]*x" }
outputs    = { y = { value = "k*u", unit = "V" } }
"#;

#[test]
fn a_model_that_selection_data_contradict_is_not_called_right_although_no_signal_foretells_what_is_left() {
    let record = |label: &str, k: f64| {
        let times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let values = white(label, 1.0, 200);
        let y = values.iter().zip(white(&format!("{label} y"), NOISE, 200)).map(|(u, e)| k * u + e).collect();
        let input = Input::Sampled { times: times.clone(), values, hold: Hold::Zero };
        Record { inputs: vec![("u", input)], times, signals: vec![("y", y, NOISE)] }
    };
    let records = vec![record("amplifier 0", 1.0), record("amplifier 1", 1.0), record("amplifier 2", 1.1)];
    let mut subject = subject(AMPLIFIER, &[0.8, 0.0], 1, records);
    subject.measurements[2].role = Role::Selection;
    let none =
        diagnose(&study(&subject), &[], &Options { max_effects: 1, level: 0.01, ..Options::default() }, &()).unwrap();
    assert_eq!(none.verdict, Verdict::Unexplained, "{:?}", none.before);
}
