//! Modes of a model from text: the active branches and the stuck joints.

use mops_core::{Failure, Instant, Plant};
use mops_language::Scalar;

use super::bank::Bank;
use super::running::Running;
use crate::kernel::{Tolerance, rests};

impl<S: Scalar, B: Bank<S>> Running<'_, S, B> {
    pub(super) fn set_mode(&mut self, mode: usize, value: f64) {
        self.modes[mode] = value;
        self.bank.borrow_mut().set(self.model.layout.mode(mode), S::from(value));
    }

    pub(super) fn is(&self, mode: usize) -> bool {
        self.modes[mode] > 0.0
    }

    /// Sets the modes of all conditions and contacts for this instant.
    pub(super) fn settle_modes(&mut self, at: &Instant<'_, S>) {
        self.settle_switches(at);
        self.find_contacts(at);
    }

    fn settle_switches(&mut self, at: &Instant<'_, S>) {
        for k in 0..self.model.switches.len() {
            let switch = &self.model.switches[k];
            let sides @ [difference, _] = self.results(&switch.sides, at).map(Scalar::value);
            let holds = difference > 0.0 || difference == 0.0 && !switch.strict;
            self.set_mode(switch.mode, f64::from(u8::from(holds)));
            self.set_slack(k, sides);
        }
    }

    /// Sets the tolerance of a switch. A kink is passed by a tenth of the error tolerance, which prevents chattering; a
    /// jump is exact. The tolerance is relative to the magnitude of both sides of the condition, now or at an earlier
    /// evaluation.
    pub(super) fn set_slack(&mut self, k: usize, [difference, right]: [f64; 2]) {
        let Tolerance { relative, absolute, .. } = self.tolerance;
        let size = &mut self.spans[k];
        *size = size.max(difference.abs()).max(right.abs());
        self.slack[k] = match self.model.switches[k].jumps {
            true => 0.0,
            false => 0.1 * (absolute.unwrap_or(0.0) + relative * *size),
        };
    }

    /// Finds the contacts of all joints. Moving joints slide in their direction of motion. A joint at rest is stuck if
    /// the torque that this requires is within its limit, else it slides in the direction of its acceleration. The
    /// choice must be consistent for all joints, see [`crate::kernel::friction`].
    pub(super) fn find_contacts(&mut self, at: &Instant<'_, S>) {
        let model = self.model;
        let mut resting = Vec::new();
        for (j, joint) in model.joints.iter().enumerate() {
            let speed = at.x[joint.contact.velocity].value();
            let [_, limit, ..] = self.results::<4>(&joint.balance, at);
            // A derivative of the friction needs the direction of motion.
            self.frictionless[j] =
                joint.is_fixed && limit.value() == 0.0 && limit.tangents().iter().all(|&slope| slope == 0.0);
            if speed == 0.0 && limit.value() > 0.0 {
                resting.push(j);
            }
            self.set_contact(j, if speed >= 0.0 { 1.0 } else { -1.0 });
        }
        let mut best = (f64::INFINITY, 0);
        let choices = 3_usize.pow(u32::try_from(resting.len()).expect("few joints"));
        for code in 0..choices {
            self.choose_contacts(&resting, code);
            let discord = resting.iter().map(|&j| {
                let joint = &model.joints[j];
                let [torque, limit, coulomb, acceleration] = self.results(&joint.balance, at).map(Scalar::value);
                let direction = self.modes[joint.contact.direction];
                if direction == 0.0 {
                    torque.abs() / limit - 1.0
                } else {
                    // Rounding leaves an acceleration near 0 with either sign.
                    -direction * acceleration / (acceleration.abs() + coulomb.abs() + f64::MIN_POSITIVE)
                }
            });
            let discord = discord.fold(f64::NEG_INFINITY, f64::max).max(0.0);
            if discord < best.0 {
                best = (discord, code);
            }
            if discord == 0.0 {
                break;
            }
        }
        self.choose_contacts(&resting, best.1);
    }

    pub(super) fn choose_contacts(&mut self, resting: &[usize], mut code: usize) {
        for &j in resting {
            self.set_contact(j, [0.0, 1.0, -1.0][code % 3]);
            code /= 3;
        }
    }

    pub(super) fn set_contact(&mut self, joint: usize, direction: f64) {
        let contact = self.model.joints[joint].contact;
        self.set_mode(contact.direction, direction);
        self.set_mode(contact.stuck, f64::from(u8::from(direction == 0.0)));
    }

    /// Sets the modes for linearisation at an operating point: moving joints slide, joints at rest have no dry
    /// friction. Returns the positions, as states, of joints whose friction is left out.
    pub(super) fn look(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Vec<usize> {
        self.settle_switches(at);
        let mut left_out = Vec::new();
        for joint in &self.model.joints {
            let contact = joint.contact;
            let speed = at.x[contact.velocity];
            let rests = rests(at_rest, speed);
            self.set_mode(contact.direction, if rests { 0.0 } else { speed.value().signum() });
            self.set_mode(contact.stuck, 0.0);
            let [_, limit, coulomb, _] = self.results::<4>(&joint.balance, at).map(Scalar::value);
            if rests && (limit != 0.0 || coulomb != 0.0) {
                left_out.push(contact.position);
            }
        }
        left_out
    }

    /// Checks that friction and tables are valid, and that equations solved together have a solution at the start.
    pub(super) fn check_start(&self, at: &Instant<'_, S>) -> Result<(), Failure> {
        for joint in &self.model.joints {
            let [_, limit, coulomb, _] = self.results::<4>(&joint.balance, at).map(Scalar::value);
            if coulomb < 0.0 || limit < coulomb {
                return Err(Failure::Undefined(format!(
                    "where {}, friction is {coulomb} and break-away friction {limit}; expected `coulomb` of at least 0 \
                     and `peak` of at least 1",
                    joint.slides
                )));
            }
        }
        let (orders, tape) = &self.model.orders;
        let mut bank = self.bank.borrow_mut();
        tape.run(&mut *bank);
        for ((what, strict), pair) in orders.iter().zip(tape.results.chunks(2)) {
            let [low, high] = [pair[0], pair[1]].map(|register| bank.get(register).value());
            if low > high || *strict && low == high {
                return Err(Failure::Undefined(format!("{what} must increase, found {high} after {low}")));
            }
        }
        drop(bank);
        if let Some(delay) =
            self.delays.iter().map(|delay| delay.time().value()).find(|time| time.is_nan() || *time <= 0.0)
        {
            return Err(Failure::Undefined(format!("the time of a `delay` is {delay} s; expected a positive time")));
        }
        let mut slope = at.x.to_vec();
        self.rates(at, &mut slope);
        if slope.iter().all(|d| d.value().is_finite()) {
            return Ok(());
        }
        let mut bank = self.bank.borrow_mut();
        for tape in &self.model.matrices {
            self.load(&mut bank, at);
            tape.run(&mut *bank);
            let entries: Vec<f64> = tape.results.iter().map(|&r| bank.get(r).value()).collect();
            if determinant(entries) == 0.0 {
                return Err(Failure::Undefined("the mass matrix is singular at the start".to_owned()));
            }
        }
        Ok(())
    }
}

/// Returns the determinant of a square matrix, given row by row.
fn determinant(mut m: Vec<f64>) -> f64 {
    let n = m.len().isqrt();
    let mut product = 1.0;
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if m[i * n + k].abs() > m[best * n + k].abs() { i } else { best });
        product *= m[pivot * n + k];
        if product == 0.0 {
            return 0.0;
        }
        for j in 0..n {
            m.swap(k * n + j, pivot * n + j);
        }
        for i in k + 1..n {
            let factor = m[i * n + k] / m[k * n + k];
            for j in k..n {
                m[i * n + j] -= factor * m[k * n + j];
            }
        }
    }
    product
}
