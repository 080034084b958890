//! Tests of the part of a trace, with knots at given times.

use mops_core::Trace;
use mops_criteria::part;
use mops_math as math;

use crate::testing::{assert_near, sampled};

#[test]
fn a_part_has_the_values_and_the_extrema_of_the_whole() {
    let whole = sampled(10.0, 40, math::sin);
    let part = part(&whole, &[1.0, 1.3, 8.0], |_, y| y);
    assert_eq!((part.start(), part.end()), (1.0, 8.0));
    for i in 0..=70 {
        let t = 1.0 + 0.1 * f64::from(i);
        assert_near(part.at(t), whole.at(t), 1e-14);
    }
    assert_near(part.maximum().0, whole.maximum().0, 1e-14);
}

#[test]
fn a_jump_stays_a_jump_and_the_cut_has_the_later_value() {
    let mut step = Trace::starting_at(0.0, 2);
    step.push(1.0, [0.0; 5]);
    step.push(2.0, [3.0; 5]);
    let both = part(&step, &[0.5, 2.0], |t, y| y + t);
    assert_eq!((both.largest_jump(), both.first(), both.last()), (3.0, 0.5, 5.0));
    assert_eq!(part(&step, &[1.0, 2.0], |_, y| y).first(), 3.0);
}
