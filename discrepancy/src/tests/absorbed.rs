//! Parameters absorb what is missing: the fit is fine, the forecast is not.

use mops_core::Role;
use mops_core::math;
use mops_effects::effects;

use crate::base;
use crate::meter::Meter;
use crate::search::{Limits, Search};
use crate::subject::Subject;
use crate::testing::{Record, subject, white};
use crate::weigh::{Dispersion, criterion, probabilities};

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
fn a_fit_that_is_fine_as_gravity_absorbs_the_drag_forecasts_badly_and_the_drag_is_found() {
    let (subject, simulations, effects) = (ball(), Meter::new(&()), effects());
    let alone = base::fit(&subject, 1, &simulations).expect("it simulates");
    assert!(alone.normalised() < 1.15 && alone.point.globals[0] < 8.5, "{} {:?}", alone.normalised(), alone.point);

    let limits = Limits::at(0.01);
    let search = Search::new(&subject, &effects, limits, &simulations);
    let declared = search.declared(&alone).expect("it simulates");
    let forecast = search.calibrate(&declared, &[]).expect("it simulates").errors(&subject.measurements);
    assert!(forecast[1].normalised > 5.0 && forecast[2].normalised > 20.0, "{forecast:?}");

    let round = search.round(&search.over_or_in_windows(&declared)).expect("it simulates");
    let best = &round.trials[0];
    let shared = Dispersion::of(best);
    let shares = probabilities(&round.trials.iter().map(|t| criterion(t, &shared)).collect::<Vec<_>>());
    assert_eq!(best.added[0].candidate.effect.name(), "quadratic-drag");
    assert!(shares[0] > 0.9 && best.fitted.normalised() < 1.1, "{shares:?} {}", best.fitted.normalised());
    let [gravity, drag] = [best.fitted.point.globals[0], best.added[0].strengths[0]];
    assert!((gravity - GRAVITY).abs() < 0.1 && (drag - DRAG).abs() < 0.1 * DRAG, "{gravity} {drag}");
}
