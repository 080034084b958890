//! Dry friction at ports: stuck joints and their friction forces, found by evaluating the plant.

use mops_core::{
    effect::DryFriction,
    plant::{EventInstant, PlantScalar},
};

use super::contacts::{Joint, solve};
use super::plant::{Affected, with_states};
use crate::kernel::friction::Contact;

impl<S: PlantScalar> Affected<'_, S> {
    /// Adds the friction forces of stuck joints to `w`, so that their accelerations are 0. Returns the friction force
    /// of each contact, 0 if it slides.
    pub(super) fn hold(&self, here: &EventInstant<'_, S>, u: &[S], w: &mut [S], dx: &mut [S]) -> Vec<S> {
        let joints = &self.contacts.joints;
        let stuck: Vec<usize> = (0..joints.len()).filter(|&i| joints[i].contact == Contact::Stuck).collect();
        let n = stuck.len();
        let mut moved = w.to_vec();
        self.moved(here, u, &mut moved, dx);
        let free: Vec<S> = stuck.iter().map(|&i| dx[joints[i].velocity]).collect();
        let mut columns = Vec::with_capacity(n);
        for &j in &stuck {
            moved.copy_from_slice(w);
            moved[joints[j].w] += S::from(1.0);
            self.moved(here, u, &mut moved, dx);
            columns.push((0..n).map(|i| dx[joints[stuck[i]].velocity] - free[i]).collect::<Vec<S>>());
        }
        // Joints that the plant itself keeps stuck need no force, and do not move.
        let moves: Vec<usize> = (0..n).filter(|&k| columns[k][k].value() != 0.0).collect();
        let pick = |list: &[S]| moves.iter().map(|&k| list[k]).collect::<Vec<S>>();
        let fixed = solve(&moves.iter().map(|&k| pick(&columns[k])).collect::<Vec<_>>(), &pick(&free));
        let mut forces = vec![S::from(0.0); joints.len()];
        for (&k, &fixed) in moves.iter().zip(&fixed) {
            forces[stuck[k]] = fixed;
            w[joints[stuck[k]].w] += fixed;
        }
        self.moved(here, u, w, dx);
        for &j in &stuck {
            dx[joints[j].velocity] = S::from(0.0);
        }
        forces
    }

    /// Returns the friction at a joint with a contact: sliding forces and limits against forward and backward motion.
    fn friction(&self, joint: &Joint, here: &EventInstant<'_, S>, u: &[S]) -> DryFriction<S> {
        let mut sum = DryFriction { sliding: [S::from(0.0); 2], limit: [S::from(0.0); 2] };
        for &index in &joint.effects {
            let effect = &self.effects[index];
            let at = self.at(effect, here, u, S::from(0.0));
            let one = effect.effect.friction(&at, effect.states(here.at.x)).expect("it has friction from the start");
            for side in 0..2 {
                sum.sliding[side] += one.sliding[side];
                sum.limit[side] += one.limit[side];
            }
        }
        sum
    }

    pub(super) fn contact_guard(&self, index: usize, here: &EventInstant<'_, S>) -> S {
        let joint = &self.contacts.joints[index];
        if joint.contact != Contact::Stuck {
            return here.at.x[joint.velocity] * joint.contact.sign();
        }
        self.balanced_with(here, |u, _, fixed| {
            let fixed = fixed[index] * self.forward(joint.w);
            // A backward friction force is limited by the friction against forward motion.
            let friction = self.friction(joint, here, u);
            friction.limit[usize::from(fixed.value() > 0.0)] - fixed.abs()
        })
    }

    /// Returns for each stuck joint its force, its speed as a state, and the largest force that holds it.
    pub(super) fn holding(&self, here: &EventInstant<'_, S>) -> Vec<(usize, usize, f64)> {
        let stuck = self.contacts.joints.iter().filter(|joint| joint.contact == Contact::Stuck);
        let most = |joint: &Joint| {
            let limit = self.friction(joint, here, here.at.u).limit;
            limit[0].value().max(limit[1].value())
        };
        stuck.map(|joint| (joint.w, joint.velocity, most(joint))).collect()
    }

    /// Switches a contact after its guard became negative. Returns true if the joint is now stuck.
    pub(super) fn contact_switch(&mut self, index: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> bool {
        let Joint { w: force, velocity, contact, .. } = self.contacts.joints[index];
        if contact == Contact::Stuck {
            let (mut u, mut w, mut dx) = (Vec::new(), Vec::new(), vec![S::from(0.0); self.own]);
            let fixed = self.balance(event, &mut u, &mut w, &mut dx)[index].value() * self.forward(force);
            self.contacts.joints[index].contact = if fixed < 0.0 { Contact::Forward } else { Contact::Backward };
            self.settle_contacts(event, Some(index));
        } else {
            x[velocity] = S::from(0.0);
            self.contacts.joints[index].contact = Contact::Stuck;
            let now = x.to_vec();
            self.settle_contacts(&with_states(event, &now), None);
        }
        self.contacts.joints[index].contact == Contact::Stuck
    }

    /// Finds the contacts of joints at rest that are consistent with the forces and nearest to the previous contacts.
    /// Moving joints slide in their direction of motion. The joint `released` has just exceeded its limit and does not
    /// stick again.
    pub(super) fn settle_contacts(&mut self, here: &EventInstant<'_, S>, released: Option<usize>) {
        const CHOICES: [Contact; 3] = [Contact::Stuck, Contact::Forward, Contact::Backward];
        let n = self.contacts.len();
        let before: Vec<Contact> = self.contacts.joints.iter().map(|joint| joint.contact).collect();
        let mut resting = Vec::new();
        for i in 0..n {
            let speed = here.at.x[self.contacts.joints[i].velocity].value();
            if speed == 0.0 {
                resting.push(i);
            } else {
                self.contacts.joints[i].contact = Contact::of(speed);
            }
        }
        if resting.is_empty() {
            return;
        }
        let mut best: Option<(f64, Vec<Contact>)> = None;
        let (mut u, mut w, mut dx) = (Vec::new(), Vec::new(), vec![S::from(0.0); self.own]);
        for code in 0..3_usize.pow(u32::try_from(resting.len()).expect("few joints")) {
            let mut digits = code;
            for &i in &resting {
                self.contacts.joints[i].contact = CHOICES[digits % 3];
                digits /= 3;
            }
            let fixed = self.balance(here, &mut u, &mut w, &mut dx);
            let mut excess: f64 = 0.0;
            let mut departures = 0.0;
            for &i in &resting {
                let joint = &self.contacts.joints[i];
                departures += f64::from(u8::from(joint.contact != before[i]));
                if joint.contact == Contact::Stuck {
                    let friction = self.friction(joint, here, &u);
                    let fixed = fixed[i].value() * self.forward(joint.w);
                    let limit = friction.limit[usize::from(fixed > 0.0)].value();
                    let never = limit == 0.0 || released == Some(i);
                    excess = if never { f64::INFINITY } else { excess.max((fixed.abs() - limit) / limit) };
                } else {
                    // Any acceleration against the direction of sliding is inconsistent.
                    let a = dx[joint.velocity].value() * joint.contact.sign();
                    excess = excess.max(if a < 0.0 { 1.0 - a } else { 0.0 });
                }
            }
            let rank = if excess <= 1e-9 { departures } else { 10.0 + excess };
            if best.as_ref().is_none_or(|(least, _)| rank < *least) {
                best = Some((rank, self.contacts.joints.iter().map(|joint| joint.contact).collect()));
            }
        }
        for (joint, contact) in self.contacts.joints.iter_mut().zip(best.expect("there are choices").1) {
            joint.contact = contact;
        }
    }
}
