//! Parameters absorb what is missing: the fit is fine, the forecast is not.

use mops_core::Role;
use mops_effects::effects;
use mops_math as math;

use crate::records::Subject;
use crate::testing::{Record, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::Verdict;

/// A ball without drag, of which the data have some: `v' = -g - k v |v|`.
const BALL: &str = r#"
states     = { h = "m", v = "m/s" }
parameters = { g = "m/s^2" }
der        = { h = "v", v = "v' = -g" }
"#;
const GRAVITY: f64 = 9.81;
const DRAG: f64 = 0.05;
const NOISE: f64 = 0.08;

/// A ball dropped at rest: `h0 - ln(cosh(sqrt(g k) t))/k`.
fn drop(label: &str, height: f64, duration: f64) -> Record {
    let count = 100_u32;
    let times: Vec<f64> = (0..count).map(|i| duration * f64::from(i) / f64::from(count - 1)).collect();
    let fallen = |t: &f64| math::ln(math::cosh((GRAVITY * DRAG).sqrt() * t)) / DRAG;
    let noise = white(label, NOISE, times.len());
    let values = times.iter().zip(noise).map(|(t, e)| height - fallen(t) + e).collect();
    Record { inputs: Vec::new(), times, signals: vec![("h", values, NOISE)] }
}

/// Short drops to calibrate with, long ones to select and to validate with.
fn ball() -> Subject {
    let records = vec![drop("short", 10.0, 1.2), drop("long", 40.0, 2.5), drop("longest", 60.0, 3.5)];
    let mut subject = subject(BALL, &[9.0, 20.0, 0.0], 2, records);
    subject.measurements[1].role = Role::Selection;
    subject.measurements[2].role = Role::Validation;
    subject
}

#[test]
fn a_fit_that_is_fine_as_gravity_absorbs_the_drag_forecasts_badly_and_is_not_called_complete() {
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let found = diagnose(&study(&ball()), &effects(), &options, &()).expect("it simulates");
    let (errors, gravity) = (&found.before, found.parameters[0].before);
    assert!(errors[0].normalised < 1.15 && gravity < 8.5, "{errors:?} {gravity}");
    assert!(errors[1].normalised > 5.0 && errors[2].normalised > 20.0, "{errors:?}");
    // The calibration record alone is explained; the selection record contradicts.
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(found.found.iter().all(|found| !found.claimed), "{:?}", found.found);
}
