//! Tests of the largest rate of change of a signal.

use mops_core::Trace;
use mops_criteria::maximum_rate::MaximumRate;
use mops_language::Unit;
use mops_math as math;

use crate::testing::{analysis, assert_near, bound, simulated, undefined, value};

fn rate() -> MaximumRate {
    MaximumRate { signal: "y".into() }
}

#[test]
fn the_largest_rate_is_that_of_the_curve_whichever_its_sign() {
    assert_near(value(&rate(), &simulated(9.0, |t| 2.0 * math::sin(3.0 * t))).number, 6.0, 1e-8);
    assert_near(value(&rate(), &simulated(9.0, |t| 5.0 * math::exp(-2.0 * t))).number, 10.0, 1e-6);
    assert_eq!(bound(&rate()).unit(), Unit::known("m/s"));
}

#[test]
fn a_kink_has_the_larger_of_its_two_rates() {
    let mut trace = Trace::starting_at(0.0, 2);
    trace.push_polynomial(2.0, [0.0, 1.0, 0.0, 0.0, 0.0]);
    trace.push_polynomial(3.0, [1.0, -4.0, 0.0, 0.0, 0.0]);
    assert_eq!(value(&rate(), &analysis(&trace)).number, 4.0);
}

#[test]
fn a_jump_has_no_rate() {
    let mut step = Trace::starting_at(0.0, 2);
    step.push(1.0, [0.0; 5]);
    step.push(2.0, [3.0; 5]);
    assert_eq!(
        undefined(&rate(), &analysis(&step)),
        "`y` jumps by 3 m, so that its rate is infinite: use a continuous signal, or filter this one"
    );
}

#[test]
fn a_jump_of_rounding_size_is_none_however_negative_the_signal() {
    let mut trace = Trace::starting_at(0.0, 2);
    trace.push_polynomial(1.0, [-1e6, 3.0, 0.0, 0.0, 0.0]);
    trace.push_polynomial(2.0, [-999_997.0 + 1e-7, -2.0, 0.0, 0.0, 0.0]);
    assert_near(value(&rate(), &analysis(&trace)).number, 3.0, 1e-9);
}
