//! Tests of the dry friction of coupled joints: the torque balance decides which joints stick and which slide.

use mops_models::kernel::friction::{Contact, Moment, balance, contacts};

const MASS: [[f64; 2]; 2] = [[2.0, 0.5], [0.5, 1.0]];

#[test]
fn joints_at_rest_stick_until_the_torque_exceeds_the_limit() {
    let limit = [1.0, 1.0];
    assert_eq!(contacts(&MASS, &[0.9, -0.9], &limit, &[0.0, 0.0]), [Contact::Stuck, Contact::Stuck]);
    assert_eq!(contacts(&MASS, &[1.1, 0.0], &limit, &[0.0, 0.0]), [Contact::Forward, Contact::Stuck]);
    assert_eq!(contacts(&MASS, &[0.0, -1.1], &limit, &[0.0, 0.0])[1], Contact::Backward);
}

#[test]
fn a_joint_that_moves_can_tear_another_loose() {
    // Joint 0 accelerates by about 10/2; through M01 joint 1 needs a torque of 2.5, above its limit of 1.
    let contact = contacts(&MASS, &[10.0, 0.0], &[0.0, 1.0], &[1.0, 0.0]);
    assert_eq!(contact, [Contact::Forward, Contact::Backward]);
}

#[test]
fn the_torques_balance_for_any_contacts() {
    for contact in
        [[Contact::Stuck, Contact::Stuck], [Contact::Forward, Contact::Stuck], [Contact::Backward, Contact::Forward]]
    {
        let (force, limit) = ([0.7, -0.3], [0.4, 0.6]);
        let (q, tau) = balance(&MASS, &force, &limit, &contact);
        for i in 0..2 {
            let left = MASS[i][0] * q[0] + MASS[i][1] * q[1];
            assert!((left - (force[i] - tau[i])).abs() < 1e-14);
            assert!(contact[i] != Contact::Stuck || q[i] == 0.0);
        }
    }
}

#[test]
fn a_joint_between_sliding_and_break_away_keeps_doing_what_it_did() {
    let (force, sliding, limit) = ([1.5, 0.0], [1.0, 1.0], [2.0, 2.0]);
    let moment = Moment { mass: &MASS, force: &force, sliding: &sliding, limit: &limit, speed: &[0.0, 0.0] };
    let slides = [Contact::Forward, Contact::Stuck];
    assert_eq!(moment.contacts(&[Contact::Stuck; 2], None), [Contact::Stuck; 2]);
    assert_eq!(moment.contacts(&slides, None), slides);
    assert_eq!(moment.contacts(&[Contact::Stuck; 2], Some(0)), slides);
}

#[test]
fn consistent_contacts_exist_for_all_forces_at_rest() {
    for i in -20..=20 {
        for j in -20..=20 {
            let force = [f64::from(i) * 0.1, f64::from(j) * 0.1];
            let contact = contacts(&MASS, &force, &[1.0, 0.5], &[0.0, 0.0]);
            let (q, tau) = balance(&MASS, &force, &[1.0, 0.5], &contact);
            for k in 0..2 {
                match contact[k] {
                    Contact::Stuck => assert!(tau[k].abs() <= [1.0, 0.5][k] + 1e-12),
                    sliding => assert!(sliding.sign() * q[k] >= -1e-12, "{force:?} {contact:?} {q:?}"),
                }
            }
        }
    }
}
