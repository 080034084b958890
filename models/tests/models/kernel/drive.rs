//! Tests of the inputs during a simulation: smooth within a step, with jumps at breaks.

use mops_core::Input;
use mops_core::case::Hold;
use mops_math as math;
use mops_models::kernel::drive::Drive;

#[test]
fn a_jump_waits_for_its_break() {
    let input = Input::Step { time: 1.0, before: 2.0, after: 3.0 };
    let mut drive: Drive<'_> = Drive::new(Some(&input));
    assert_eq!((drive.at(1.0), drive.next_break(0.0)), (2.0, 1.0));
    drive.pass_break(1.0);
    assert_eq!((drive.at(1.0), drive.next_break(1.0)), (3.0, f64::INFINITY));
}

#[test]
fn first_order_hold_is_a_straight_line() {
    let input = Input::Sampled { times: vec![0.0, 2.0], values: vec![1.0, 5.0], hold: Hold::First };
    assert_eq!(Drive::<f64>::new(Some(&input)).at(0.5), 2.0);
}

#[test]
fn rates_are_the_derivatives_of_the_curve() {
    let times: Vec<f64> = (0..100).map(|i| 0.1 * f64::from(i)).collect();
    let values = times.iter().map(|t| math::sin(3.0 * t)).collect();
    let sine = Input::Sine { amplitude: 1.0, frequency: 3.0 / std::f64::consts::TAU, phase: 0.0, offset: 0.0 };
    for input in [sine, Input::Sampled { times, values, hold: Hold::BandLimited }] {
        let mut drive: Drive<'_> = Drive::new(Some(&input));
        drive.pass_break(5.0);
        assert!((drive.at(5.05) - math::sin(15.15)).abs() < 1e-6, "{input:?}");
        assert!((drive.slope(5.05) - 3.0 * math::cos(15.15)).abs() < 1e-4, "{input:?}");
    }
}
