//! One and the same effect twice at one place: each is a finding of its own, by a name of its own.

use std::f64::consts::TAU;

use mops_math as math;

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};

/// A block on a spring, of which the data have gusts: `v' = -k x - d v + g(t)`.
const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { k = "1/s^2", d = "1/s" }
der        = { x = "v", v = "v' = -k*x - d*v" }
"#;
const NOISE: f64 = 0.005;

/// A force that swells and fades in 0.8 s, as that of CS-25, section 25.341.
fn blown(label: &str, at: f64, force: f64) -> Record {
    let gust =
        |t: f64| if t > at && t < at + 0.8 { 0.5 * force * (1.0 - math::cos(TAU * (t - at) / 0.8)) } else { 0.0 };
    let states = integrated(|t, x: &[f64; 2]| [x[1], -9.0 * x[0] - 0.4 * x[1] + gust(t)], [1.0, 0.0], 0.02, 250);
    Record::of_first("x", &states, 0.02, NOISE, label)
}

#[test]
fn gusts_in_two_experiments_are_two_findings() {
    let records = vec![blown("one", 1.0, 2.0), blown("other", 2.5, -3.0)];
    let subject = subject(BLOCK, &[8.0, 0.5, 1.0, 0.0], 2, records);
    let options = Options { max_effects: 3, level: 0.01, ..Options::default() };
    let diagnosis = diagnose(&study(&subject), &catalogue(&["wind-gust"]), &options, &()).expect("it simulates");
    let found = diagnosis.found;
    let mut made: Vec<(Option<&str>, f64)> = found.iter().map(|f| (f.only.as_deref(), f.strengths[0].value)).collect();
    made.sort_by(|a, b| a.0.cmp(&b.0));
    assert_eq!(made.len(), 2, "{made:?}");
    assert_eq!([made[0].0, made[1].0], [Some("record 0"), Some("record 1")]);
    assert!((made[0].1 - 2.0).abs() < 0.1 && (made[1].1 + 3.0).abs() < 0.1, "{made:?}");
    assert_ne!(found[0].name, found[1].name);
    // Each is drawn in its own experiment.
    let drawn = diagnosis.latent.iter().find(|e| e.place == found[0].place).expect("its place has a course");
    let peaks: Vec<f64> = drawn.over_time.iter().map(|(_, c)| c.found.iter().copied().fold(0.0, f64::max)).collect();
    let least: Vec<f64> = drawn.over_time.iter().map(|(_, c)| c.found.iter().copied().fold(0.0, f64::min)).collect();
    assert!(peaks[0] > 1.8 && least[0] == 0.0 && peaks[1] == 0.0 && least[1] < -2.8, "{peaks:?}, {least:?}");
}
