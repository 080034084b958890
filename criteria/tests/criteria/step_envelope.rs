//! Tests of the distance of a response from an envelope.

use mops_core::{
    Demand,
    criterion::{Mark, Side},
};
use mops_criteria::step_envelope::StepEnvelope;
use mops_language::Quantity;
use mops_math as math;

use crate::testing::{assert_near, bound, mistake, quantity, second_order, simulated, undefined, value};

fn points(points: &[[f64; 2]]) -> Vec<[Quantity; 2]> {
    points.iter().map(|point| point.map(Quantity::from)).collect()
}

fn envelope(upper: &[[f64; 2]], lower: &[[f64; 2]]) -> StepEnvelope {
    StepEnvelope { signal: "y".into(), upper: points(upper), lower: points(lower), step_time: None }
}

#[test]
fn the_worst_distance_from_either_bound_counts() {
    let response = simulated(20.0, second_order(0.5));
    let overshoot = math::exp(-std::f64::consts::PI * 0.5 / 0.75f64.sqrt());
    assert_near(value(&envelope(&[[0.0, 1.1]], &[]), &response).number, overshoot - 0.1, 1e-12);
    assert_near(value(&envelope(&[[0.0, 1.5]], &[[0.0, -0.2]]), &response).number, -0.2, 1e-12);
    let late = value(&envelope(&[[0.0, 1.5]], &[[1.0, 1.0], [1.5, 1.0]]), &response).number;
    assert_near(late, 1.0 - second_order(0.5)(1.0), 1e-12);
}

#[test]
fn the_distance_from_a_slanted_bound_is_largest_between_its_points() {
    // y = t (4 - t) above the line t/2 from (0, 0) to (4, 2): farthest at t = 7/4.
    let arch = simulated(4.0, |t| t * (4.0 - t));
    assert_near(value(&envelope(&[[0.0, 0.0], [4.0, 2.0]], &[]), &arch).number, 3.0625, 1e-12);
}

#[test]
fn a_bound_steps_where_two_points_share_a_time_and_stays_after_the_last() {
    let ramp = simulated(4.0, |t| t);
    assert_near(value(&envelope(&[[0.0, 9.0], [2.0, 9.0], [2.0, 5.0]], &[]), &ramp).number, -1.0, 1e-12);
    let late =
        StepEnvelope { step_time: Some(quantity("1 s")), ..envelope(&[], &[[0.0, 3.0], [2.0, 3.0], [2.0, 3.5]]) };
    assert_near(value(&late, &ramp).number, 2.0, 1e-12);
}

#[test]
fn an_envelope_needs_a_bound_in_order_within_the_simulation() {
    assert!(mistake(&envelope(&[], &[])).contains("an envelope needs at least one bound"));
    let reversed = mistake(&envelope(&[], &[[2.0, 0.0], [1.0, 0.0]]));
    assert_eq!(reversed, "lower: the points are not in order: 1 s follows 2 s; give the points by increasing time");
    let metres = StepEnvelope { upper: vec![[quantity("1 m"), quantity("1 m")]], ..envelope(&[], &[]) };
    assert_eq!(mistake(&metres), "upper: expected a quantity in `s`, found `m`");
    assert_eq!(
        undefined(&envelope(&[[9.0, 1.0]], &[]), &simulated(4.0, |t| t)),
        "the envelope starts after the end of the simulation at 4 s"
    );
}

#[test]
fn a_slanted_bound_runs_through_both_of_its_points() {
    // 1 above the line from (1, 0) to (3, 4) at its second point, 5 at t = 3.
    let ramp = simulated(3.0, |t| if t < 1.0 { 0.0 } else { 2.5 * (t - 1.0) });
    assert_near(value(&envelope(&[[1.0, 0.0], [3.0, 4.0]], &[]), &ramp).number, 1.0, 1e-12);
}

#[test]
fn plots_show_both_bounds_with_what_they_exclude() {
    let criterion = bound(&envelope(&[[0.0, 1.5], [2.0, 1.1]], &[[1.0, 0.9]]));
    let marks = criterion.marks(&Demand::None, &simulated(4.0, |t| t));
    let of = |mark: &Mark| (mark.times, mark.values, mark.excluded);
    assert_eq!(
        marks.iter().map(of).collect::<Vec<_>>(),
        [
            ([0.0, 2.0], [1.5, 1.1], Some(Side::Above)),
            ([2.0, f64::INFINITY], [1.1, 1.1], Some(Side::Above)),
            ([1.0, f64::INFINITY], [0.9, 0.9], Some(Side::Below)),
        ]
    );
}
