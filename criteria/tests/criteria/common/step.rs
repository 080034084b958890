//! Tests of the step of a response: initial value, target and time.

use mops_criteria::overshoot::Overshoot;
use mops_math as math;

use crate::testing::{mistake, quantity, simulated, undefined, value};

fn overshoot() -> Overshoot {
    Overshoot { signal: "y".into(), ..Overshoot::default() }
}

#[test]
fn mistakes_name_the_option_and_the_way_out() {
    let mut unknown = overshoot();
    unknown.signal = "phii".into();
    assert_eq!(mistake(&unknown), "signal: the model has no signal `phii`; did you mean `phi`?");
    let seconds = Overshoot { target: Some(quantity("3 s")), ..overshoot() };
    assert_eq!(mistake(&seconds), "target: expected a quantity in `m`, found `s`");
    let infinite = Overshoot { target: Some(f64::INFINITY.into()), ..overshoot() };
    assert_eq!(mistake(&infinite), "target: `target` must be finite, not inf");
    let none = Overshoot { target: Some(2.0.into()), from: Some(2.0.into()), ..overshoot() };
    assert_eq!(mistake(&none), "target: the step has no height: `from` and `target` are both 2 m");
    let early = Overshoot { step_time: Some((-1.0).into()), ..overshoot() };
    assert_eq!(mistake(&early), "step-time: the step at -1 s is before the start of the simulation");
}

#[test]
fn a_response_without_a_step_has_no_value() {
    let still = simulated(2.0, |_| 3.0);
    assert_eq!(undefined(&overshoot(), &still), "the step from 3 to 3 has no height");
    let late = Overshoot { step_time: Some(5.0.into()), ..overshoot() };
    assert_eq!(undefined(&late, &still), "the step at 5 s is after the end of the simulation at 2 s");
}

#[test]
fn a_response_that_is_not_finite_has_no_value() {
    let pole = simulated(2.0, |t| if t > 1.0 { f64::NAN } else { t });
    assert_eq!(undefined(&overshoot(), &pole), "`y` is not finite throughout");
}

#[test]
fn a_response_without_a_target_is_noted_if_it_still_moves_at_the_end() {
    let note = |end: f64, f: &dyn Fn(f64) -> f64| value(&overshoot(), &simulated(end, f)).note;
    let moving = Some("still moving at the end");
    // A ramp leaves any band about its last value; a lag ends within 2 % of where it goes after 5 time constants, and
    // not after 3.
    assert_eq!(note(3.0, &|t| t), moving);
    let lag = |t: f64| 1.0 - math::exp(-t);
    assert_eq!((note(3.0, &lag), note(5.0, &lag)), (moving, None));
    // An oscillation within the band turns back again and again; one that accelerates away does not.
    assert_eq!(note(10.3, &|t| 1.0 - math::exp(-t) + 0.005 * math::sin(9.0 * t)), None);
    assert_eq!(note(5.0, &|t| 1.0 - math::exp(-4.0 * t) + 1e-3 * math::exp(t)), moving);
    // A given target is no assumption.
    let given = Overshoot { target: Some(1.0.into()), ..overshoot() };
    assert_eq!(value(&given, &simulated(3.0, lag)).note, None);
}
