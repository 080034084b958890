//! The Furuta pendulum: an arm that turns about the vertical, a pendulum that swings at its end.

use mops_core::{
    AnalysisKind, Failure, Interface, Job, Mistake, Model, ModelOptions, OperatingPoint, Parameter, Plant, Quantity,
    Scalar, State, Unit, Variable,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::kernel::drive::Drive;
use crate::kernel::friction::{Contact, contacts};
use crate::kernel::{
    Dynamics, Equations, Holds, Kernel, Opened, Recording, Simulate, Tolerance, Written, mechanism, rates_and_signals,
    record, rests, wanted,
};

/// The Furuta pendulum in its four lumped parameters, with viscous and Coulomb friction in both joints:
///
/// ```text
/// a theta'' + c cos(theta) phi''                    = a phi'^2 sin(theta) cos(theta) + d sin(theta) - bp theta' - tp
/// c cos(theta) theta'' + (b + a sin(theta)^2) phi'' = c theta'^2 sin(theta) - 2 a theta' phi' sin(theta) cos(theta) + u - ba phi' - ta
/// ```
///
/// `phi` is the angle of the arm, `theta` that of the pendulum, 0 upright and pi hanging, both in rad; `u` is the torque
/// on the arm in N m. `ta = ca sign(phi')` while the arm moves; at rest it is whatever holds the arm, up to `ca`. `tp`
/// likewise with `cp`. A joint at rest is exactly at rest: it breaks away by the balance of torques.
///
/// Parameters: `a` pendulum inertia about its joint, `b` inertia of arm and load, `c` coupling (all kg m2), `d` gravity
/// torque (N m), `ba`, `bp` viscous friction (N m s/rad), `ca`, `cp` Coulomb friction (N m), and the start values `phi0`,
/// `dphi0`, `theta0`, `dtheta0`. The mass matrix must be positive definite: `a b > c^2`. Linearised, a
/// joint at rest has no Coulomb friction, and one that moves slides.
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta`, `u`. Input: `u`.
///
/// Source: M. Gafvert, Derivation of Furuta pendulum dynamics, report TFRT-7574, Lund (1998).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct FurutaOptions {
    /// End of the simulation where no experiment gives one.
    horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    tolerance: Tolerance,
}

impl ModelOptions for FurutaOptions {
    const KIND: &'static str = "furuta";

    fn build(self) -> Result<Box<dyn Model>, Mistake> {
        self.tolerance.check()?;
        let horizon = self.horizon.as_ref().map(|q| q.to(&Unit::known("s"))).transpose();
        let horizon = horizon.map_err(|e| Mistake::new("horizon", e))?;
        Ok(Box::new(Furuta::model(horizon, self.tolerance)))
    }
}

/// The model of the kind `furuta`.
pub struct Furuta {
    interface: Interface,
    tolerance: Tolerance,
}

impl Furuta {
    /// A Furuta pendulum that is simulated to `horizon` (s) where no experiment says otherwise.
    pub fn model(horizon: Option<f64>, tolerance: Tolerance) -> Kernel<Self> {
        let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
        let friction =
            |name, unit, about| Parameter::new(name, unit, about).within(0.0, f64::INFINITY).with_default(0.0);
        let start = |name, unit, about| Parameter::new(name, unit, about).with_default(0.0);
        let state = |name: &str, start: &str, signal: &str, rate_of: Option<&str>| State {
            name: name.into(),
            start: start.into(),
            signal: Some(signal.into()),
            rate_of: rate_of.map(Into::into),
        };
        let interface = Interface {
            signals: vec![
                Variable::new("phi", "rad", "angle of the arm"),
                Variable::new("dphi", "rad/s", "speed of the arm"),
                Variable::new("theta", "rad", "angle of the pendulum, 0 upright, pi hanging"),
                Variable::new("dtheta", "rad/s", "speed of the pendulum"),
                Variable::new("u", "N m", "torque on the arm"),
            ],
            parameters: vec![
                positive("a", "kg m2", "inertia of the pendulum about its joint"),
                positive("b", "kg m2", "inertia of the arm with the pendulum's mass at its end"),
                Parameter::new("c", "kg m2", "coupling of the joints"),
                Parameter::new("d", "N m", "gravity torque of the pendulum"),
                friction("ba", "N m s/rad", "viscous friction of the arm"),
                friction("bp", "N m s/rad", "viscous friction of the pendulum"),
                friction("ca", "N m", "Coulomb friction of the arm"),
                friction("cp", "N m", "Coulomb friction of the pendulum"),
                start("phi0", "rad", "angle of the arm at the start"),
                start("dphi0", "rad/s", "speed of the arm at the start"),
                start("theta0", "rad", "angle of the pendulum at the start"),
                start("dtheta0", "rad/s", "speed of the pendulum at the start"),
            ],
            states: vec![
                state("phi", "phi0", "phi", None),
                state("dphi", "dphi0", "dphi", Some("phi")),
                state("theta", "theta0", "theta", None),
                state("dtheta", "dtheta0", "dtheta", Some("theta")),
            ],
            inputs: vec![Variable::new("u", "N m", "torque on the arm")],
            ports: mechanism::ports(&["phi", "theta"], &["u"]),
            horizon,
            analysis: AnalysisKind::Time,
        };
        Kernel(Self { interface, tolerance })
    }
}

impl Written for Furuta {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn states(&self) -> Vec<Variable> {
        self.interface.signals[..4].to_vec()
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<Box<dyn Plant<S> + 'a>, Failure> {
        let dynamics = Self::dynamics(parameters, Drive::held(S::from(0.0)))?;
        Ok(Box::new(Opened::new(dynamics, Self::start(parameters), Self::signal)))
    }
}

impl Equations for Furuta {
    /// Joints at rest without Coulomb friction, which has no slope there.
    fn equations<S: Scalar>(&self, at: &OperatingPoint<'_, S>) -> Result<[Vec<S>; 2], Failure> {
        let x: [S; 4] = at.states.try_into().expect("the pendulum has four states");
        let mut dynamics = Self::dynamics(at.parameters, Drive::held(at.inputs[0]))?;
        for (joint, speed) in SPEED.into_iter().enumerate() {
            if rests(at, x[speed]) {
                dynamics.coulomb[joint] = S::from(0.0);
            }
            dynamics.contact[joint] = Contact::of(x[speed].value());
        }
        Ok(rates_and_signals(&dynamics, &x, self.interface.signals.len(), &Self::signal))
    }

    fn frictionless(&self, at: &OperatingPoint<'_>) -> Vec<String> {
        let left_out = |&&(_, speed, coulomb): &&(&str, usize, usize)| {
            rests(at, at.states[speed]) && at.parameters[coulomb] != 0.0
        };
        let joints = [("phi", SPEED[1], 6), ("theta", SPEED[0], 7)];
        joints.iter().filter(left_out).map(|(name, ..)| (*name).to_owned()).collect()
    }
}

impl Furuta {
    /// The equations with given parameters and torque.
    fn dynamics<'a, S: Scalar>(parameters: &[S], drive: Drive<'a, S>) -> Result<FurutaDynamics<'a, S>, Failure> {
        let [a, b, c, d, ba, bp, ca, cp, ..] = *parameters else { panic!("the study gives every parameter") };
        let [ab, cc] = [(a * b).value(), (c * c).value()];
        if ab <= cc {
            let fact = format!("the mass matrix is not positive definite: a b = {ab} <= c^2 = {cc}");
            return Err(Failure::Undefined(fact));
        }
        let (viscous, coulomb) = ([bp, ba], [cp, ca]);
        let outside = [S::from(0.0); 2];
        Ok(FurutaDynamics { a, b, c, d, viscous, coulomb, drive, outside, contact: [Contact::Forward; 2] })
    }

    /// The start values.
    fn start<S: Scalar>(parameters: &[S]) -> [S; 4] {
        parameters[8..].try_into().expect("four start values come last")
    }

    /// The value of a signal: the states, then the torque.
    fn signal<S: Scalar>(dynamics: &FurutaDynamics<'_, S>, signal: usize, t: f64, x: &[S; 4]) -> S {
        if signal < 4 { x[signal] } else { dynamics.drive.at(t) }
    }
}

impl Simulate for Furuta {
    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        let mut dynamics = Self::dynamics(parameters, Drive::new(job.case.input("u")))?;
        let start = Self::start(parameters);
        record(&mut dynamics, start, job.horizon, &self.tolerance, &wanted(job, &self.interface.signals), &Self::signal)
    }
}

/// The equations, with the present torque and contacts; joints in the order pendulum, arm; states `phi, phi', theta, theta'`.
pub struct FurutaDynamics<'a, S> {
    /// Inertia of the pendulum, kg m2.
    pub a: S,
    /// Inertia of the arm, kg m2.
    pub b: S,
    /// Coupling, kg m2.
    pub c: S,
    /// Gravity torque, N m.
    pub d: S,
    /// Viscous friction of pendulum and arm, N m s/rad.
    pub viscous: [S; 2],
    /// Coulomb friction of pendulum and arm, N m.
    pub coulomb: [S; 2],
    /// Torque on the arm, N m.
    pub drive: Drive<'a, S>,
    /// Torques on pendulum and arm from outside the model, N m.
    pub outside: [S; 2],
    /// How pendulum and arm move.
    pub contact: [Contact; 2],
}

impl<S: Scalar> Holds<S> for FurutaDynamics<'_, S> {
    fn hold(&mut self, u: &[S], w: &[S]) {
        self.drive = Drive::held(u[0]);
        self.outside = [w[1], w[0]];
    }
}

impl<S: Scalar> FurutaDynamics<'_, S> {
    /// Coupling and arm inertia at this angle (the pendulum's own is `a`), and the forces without Coulomb friction.
    #[inline]
    fn terms(&self, t: f64, x: &[S; 4]) -> (S, S, [S; 2]) {
        let [_, dphi, theta, dtheta] = *x;
        let (sin, cos) = theta.sin_cos();
        let coupling = self.c * cos;
        let arm = self.b + self.a * sin * sin;
        let turning = self.a * dphi * sin * cos;
        let pendulum_force = turning * dphi + self.d * sin - self.viscous[0] * dtheta + self.outside[0];
        let arm_force = self.c * dtheta * dtheta * sin - turning * dtheta * 2.0 - self.viscous[1] * dphi
            + self.drive.at(t)
            + self.outside[1];
        (coupling, arm, [pendulum_force, arm_force])
    }

    fn mass_and_force(&self, t: f64, x: &[S; 4]) -> ([[f64; 2]; 2], [f64; 2]) {
        let (coupling, arm, force) = self.terms(t, x);
        let mass = [[self.a.value(), coupling.value()], [coupling.value(), arm.value()]];
        (mass, force.map(Scalar::value))
    }

    fn limits(&self) -> [f64; 2] {
        self.coulomb.map(Scalar::value)
    }

    fn find_contacts(&mut self, t: f64, x: &[S; 4]) {
        let (mass, force) = self.mass_and_force(t, x);
        self.contact = contacts(&mass, &force, &self.limits(), &[x[3].value(), x[1].value()]);
    }

    fn is_stuck(&self, joint: usize) -> bool {
        self.limits()[joint] > 0.0 && self.contact[joint] == Contact::Stuck
    }

    /// The torque that holds a stuck joint: what its equation needs with no acceleration of its own.
    fn holding_torque(&self, t: f64, x: &[S; 4], joint: usize) -> S {
        let (coupling, _, force) = self.terms(t, x);
        let mut dx = *x;
        self.derivative(t, x, &mut dx);
        force[joint] - coupling * dx[SPEED[1 - joint]]
    }
}

/// Index of the speed of pendulum and arm in the state.
const SPEED: [usize; 2] = [3, 1];

impl<S: Scalar> Dynamics<S> for FurutaDynamics<'_, S> {
    type State = [S; 4];

    fn shows(&self, signal: usize) -> Option<usize> {
        (signal < 4).then_some(signal)
    }

    // At each of the six stages of a step: as calls they would cost a fifth of a simulation.
    #[inline(always)]
    fn derivative(&self, t: f64, x: &[S; 4], dx: &mut [S; 4]) {
        let (coupling, arm, [mut pendulum_force, mut arm_force]) = self.terms(t, x);
        pendulum_force -= self.coulomb[0] * self.contact[0].sign();
        arm_force -= self.coulomb[1] * self.contact[1].sign();
        let (ddtheta, ddphi) = match [self.is_stuck(0), self.is_stuck(1)] {
            [false, false] => {
                let determinant = self.a * arm - coupling * coupling;
                (
                    (arm * pendulum_force - coupling * arm_force) / determinant,
                    (self.a * arm_force - coupling * pendulum_force) / determinant,
                )
            }
            [false, true] => (pendulum_force / self.a, S::from(0.0)),
            [true, false] => (S::from(0.0), arm_force / arm),
            [true, true] => (S::from(0.0), S::from(0.0)),
        };
        *dx = [x[1], ddphi, x[3], ddtheta];
    }

    fn guards(&self) -> usize {
        if self.limits().iter().all(|&limit| limit == 0.0) { 0 } else { 2 }
    }

    /// Sliding: the speed in its direction. Stuck: what is left of the limit.
    fn guard(&self, joint: usize, t: f64, x: &[S; 4]) -> S {
        let limit = self.coulomb[joint];
        if limit.value() == 0.0 {
            S::from(1.0)
        } else if self.is_stuck(joint) {
            limit - self.holding_torque(t, x, joint).abs()
        } else {
            x[SPEED[joint]] * self.contact[joint].sign()
        }
    }

    fn switch(&mut self, joint: usize, t: f64, x: &mut [S; 4]) -> &str {
        if self.is_stuck(joint) {
            let torque = self.holding_torque(t, x, joint);
            self.contact[joint] = if torque.value() > 0.0 { Contact::Forward } else { Contact::Backward };
        } else {
            x[SPEED[joint]] = S::from(0.0);
            self.find_contacts(t, x);
        }
        match (joint, self.is_stuck(joint)) {
            (0, true) => "pendulum sticks",
            (0, false) => "pendulum slides",
            (_, true) => "arm sticks",
            (_, false) => "arm slides",
        }
    }

    fn next_break(&self, t: f64) -> f64 {
        self.drive.next_break(t)
    }

    fn longest_step(&self) -> f64 {
        self.drive.longest_step()
    }

    fn pass_break(&mut self, t: f64, x: &mut [S; 4]) {
        self.drive.pass_break(t);
        self.find_contacts(t, x);
    }
}
