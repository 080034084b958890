//! Sessions drift: a long record runs out of phase where a parameter has moved a little, and a few periods do not.

use mops_core::Role;
use mops_math as math;

use crate::testing::{Record, integrated, study, subject};
use crate::{Options, diagnose};

const PENDULUM: &str = r#"
states     = { q = "rad", w = "rad/s" }
parameters = { k = "1/s2", b = "1/s" }
der        = { q = "w", w = "w' = -k*sin(q) - b*w" }
"#;
const NOISE: f64 = 2e-3;

fn swing(label: &str, k: f64, b: f64) -> Record {
    const STEP: f64 = 0.02;
    const COUNT: usize = 800;
    let states = integrated(|_, x: &[f64; 2]| [x[1], -k * math::sin(x[0]) - b * x[1]], [1.0, 0.0], STEP, COUNT);
    Record::of_first("q", &states, STEP, NOISE, label)
}

#[test]
#[ignore = "full tier"]
fn a_session_with_twice_the_friction_is_judged_over_the_whole_record_and_in_windows() {
    let records = vec![swing("first", 40.0, 0.05), swing("months later", 40.4, 0.1)];
    let mut subject = subject(PENDULUM, &[41.0, 0.06, 1.0, 0.0], 2, records);
    subject.measurements[1].role = Role::Validation;
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let diagnosis = diagnose(&study(&subject), &[], &options, &()).expect("it simulates");
    let [own, later] = &diagnosis.after[..] else { panic!("{:?}", diagnosis.after) };
    let [own_windows, later_windows] = [own, later].map(|e| e.in_windows.as_ref().expect("it is long enough"));
    assert!(own.normalised < 1.1 && own_windows.normalised < 1.1, "{own:?}");
    // 16 s at about one period a second, four periods in a window.
    assert!((3..=5).contains(&own_windows.count), "{own_windows:?}");
    assert!((own_windows.length * own_windows.count as f64 - 15.98).abs() < 1e-9, "{own_windows:?}");
    assert!(later.normalised > 20.0 && later_windows.normalised < 0.5 * later.normalised, "{later:?}");
    assert!(later_windows.normalised > 1.5, "the friction still shows: {later_windows:?}");
}
