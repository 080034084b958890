//! Tests of the settling time of a step response.

use mops_core::criterion::{Missed, Side};
use mops_core::{Demand, Trace, Value};
use mops_criteria::settling_time::SettlingTime;
use mops_math as math;

use crate::testing::{analysis, assert_near, bound, mistake, quantity, second_order, simulated, value};

#[test]
fn the_demand_excludes_values_outside_of_the_band_after_the_demanded_time() {
    let criterion = bound(&settling(0.1));
    let marks = criterion.marks(&Demand::AtMost(3.0), &simulated(10.0, |t| 1.0 - math::exp(-t)));
    let of = |i: usize| (marks[i].times[0], marks[i].values[0], marks[i].excluded);
    assert_eq!((of(0), of(1)), ((3.0, 1.1, Some(Side::Above)), (3.0, 0.9, Some(Side::Below))));
    let reported = criterion.marks(&Demand::None, &simulated(10.0, |t| 1.0 - math::exp(-t)));
    assert!(reported.iter().all(|mark| mark.times[0] == 0.0 && mark.excluded.is_none()));
    let within = marks[0].clone().within(0.0, 5.0).unwrap();
    assert_eq!(within.times, [3.0, 5.0]);
    assert_eq!(marks[0].clone().within(0.0, 2.0), None);
    // 5 % of a step from 1 to 3, at 2 s.
    let step = SettlingTime {
        from: Some(1.0.into()),
        target: Some(3.0.into()),
        step_time: Some(2.0.into()),
        band: None,
        relative_band: Some(0.05.into()),
        ..settling(0.1)
    };
    let marks = bound(&step).marks(&Demand::AtMost(4.0), &simulated(10.0, |t| if t < 2.0 { 1.0 } else { 3.0 }));
    let of = |i: usize| (marks[i].times[0], marks[i].values[0]);
    assert_eq!((of(0), of(1)), ((6.0, 3.1), (6.0, 2.9)));
}

fn settling(band: f64) -> SettlingTime {
    SettlingTime { signal: "y".into(), target: Some(1.0.into()), band: Some(band.into()), ..SettlingTime::default() }
}

#[test]
fn a_first_order_lag_settles_after_the_logarithm_of_the_band() {
    let lag = simulated(40.0, |t| 1.0 - math::exp(-t / 3.0));
    assert_near(value(&settling(0.01), &lag).number, 3.0 * math::ln(100.0), 1e-9);
    let by_default = SettlingTime { band: None, ..settling(1.0) };
    assert_near(value(&by_default, &lag).number, 3.0 * math::ln(50.0), 1e-9);
    let percent = SettlingTime { relative_band: Some(quantity("5 %")), ..by_default };
    assert_near(value(&percent, &lag).number, 3.0 * math::ln(20.0), 1e-9);
}

#[test]
fn an_oscillation_settles_at_its_last_crossing() {
    let response = second_order(0.2);
    // The last crossing of 1 +- 0.05 by bisection on the closed form; |y - 1| < 0.05 from 15 s on, as exp(-3) <
    // 0.05.
    let outside = (0..150_000).rev().find(|&i| (response(f64::from(i) * 1e-4) - 1.0).abs() > 0.05).unwrap();
    let (mut inside, mut outside) = (f64::from(outside + 1) * 1e-4, f64::from(outside) * 1e-4);
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if (response(middle) - 1.0).abs() > 0.05 { outside = middle } else { inside = middle }
    }
    assert_near(value(&settling(0.05), &simulated(30.0, response)).number, inside, 1e-10);
}

#[test]
fn an_extremum_that_touches_the_band_does_not_leave_it() {
    // From 0 to 1 within 1 s, then an arch of height 1/4 (exact in binary) from 1 s to 3 s.
    let arch = |height: f64| {
        let mut trace = Trace::starting_at(0.0, 3);
        trace.push_polynomial(1.0, [0.0, 1.0, 0.0, 0.0, 0.0]);
        trace.push_polynomial(3.0, [1.0, 4.0 * height, -4.0 * height, 0.0, 0.0]);
        trace.push_polynomial(4.0, [1.0, 0.0, 0.0, 0.0, 0.0]);
        analysis(&trace)
    };
    assert_eq!(value(&settling(0.25), &arch(0.25)).number, 0.75);
    assert_near(value(&settling(0.25), &arch(0.25 + 1e-12)).number, 2.0, 1e-5);
    assert_near(value(&settling(0.25), &arch(0.5)).number, 2.0 + 0.5f64.sqrt(), 1e-14);
}

#[test]
fn a_response_outside_the_band_at_the_end_has_not_settled() {
    let lag = simulated(4.0, |t| 1.0 - math::exp(-t));
    // Mean distance over the last tenth of the time from the step.
    let mean = |tenth: f64| (math::exp(tenth - 4.0) - math::exp(-4.0)) / tenth;
    let exact = |length: f64| length * (1.0 + mean(0.1 * length) / (mean(0.1 * length) + 0.01));
    let missed = value(&settling(0.01), &lag);
    assert_near(missed.number, exact(4.0), 1e-9);
    assert_eq!((missed.missed, missed.note), (Some(Missed { horizon: Some(4.0) }), Some("not settled at the end")));
    let later = SettlingTime { step_time: Some(1.0.into()), ..settling(0.01) };
    assert_near(value(&later, &lag).number, exact(3.0), 1e-9);
    assert_eq!(value(&settling(2.0), &lag), Value::noted(0.0, "never leaves the band"));
}

#[test]
fn a_response_that_crosses_the_band_at_the_end_has_not_settled() {
    let noted = |end: f64, damping: f64| value(&settling(0.05), &simulated(end, second_order(damping))).note;
    // The first crossing of the target is at 1.9 s and 3.2 s; the peaks at 3.2 s and 3.6 s are 1.53 and 1.16.
    for (end, damping) in [(1.75, 0.2), (1.8, 0.2), (1.85, 0.2), (2.4, 0.5), (2.45, 0.5)] {
        assert_eq!(noted(end, damping), Some("crosses the band at the end"), "{end} {damping}");
    }
    assert_eq!(noted(1.6, 0.2), Some("not settled at the end"));
    // Motions that end within the band: an approach, a decay with turns, a peak that stays inside, a slow ramp.
    let approach = simulated(3.1, |t| 1.0 - math::exp(-t));
    assert_near(value(&settling(0.05), &approach).number, math::ln(20.0), 1e-9);
    for damping in [0.05, 0.2, 0.7, 0.9] {
        for end in [70.0, 71.3, 72.6, 80.0] {
            assert_eq!(noted(end, damping), None, "{end} {damping}");
        }
    }
    let creeping = simulated(10.0, |t| if t < 1.0 { 0.0 } else { 1.0 + 1e-3 * t });
    assert_eq!(value(&settling(0.05), &creeping).note, None);
}

#[test]
fn a_response_that_still_moves_has_no_settling_time_of_its_own() {
    let own = |end: f64| {
        value(&SettlingTime { target: None, band: None, ..settling(1.0) }, &simulated(end, |t| 1.0 - math::exp(-t)))
    };
    for end in [0.1, 1.0, 3.0] {
        assert!(own(end).missed.is_some(), "{end}");
    }
    assert!(own(5.0).missed.is_none() && own(20.0).missed.is_none());
    let growing = value(&SettlingTime { target: None, band: None, ..settling(1.0) }, &simulated(5.0, math::exp));
    assert_eq!(growing.note, Some("still moving at the end"));
}

#[test]
fn the_time_counts_from_the_step() {
    let late = simulated(30.0, |t| if t < 2.0 { 0.0 } else { 1.0 - math::exp(2.0 - t) });
    let settling = SettlingTime { step_time: Some(2.0.into()), ..settling(0.1) };
    assert_near(value(&settling, &late).number, math::ln(10.0), 1e-10);
}

#[test]
fn two_bands_or_a_band_of_no_width_are_mistakes() {
    let two = SettlingTime { relative_band: Some(0.02.into()), ..settling(0.01) };
    assert_eq!(mistake(&two), "relative-band: `band` and `relative-band` exclude each other; remove one of them");
    assert_eq!(mistake(&settling(0.0)), "band: `band` must be positive, not 0 m");
}
