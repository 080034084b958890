//! Tests of the step of a response: initial value, target and time.

use mops_criteria::overshoot::Overshoot;

use crate::testing::{mistake, quantity, simulated, undefined};

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
