//! Furuta pendulum: an arm that turns about the vertical axis, and a pendulum that swings at its end.

use mops_core::{
    Failure, Instant, Interface, Model, ModelOptions, Parameter, Plant, StudyError, Variable,
    model::State,
    plant::{EventInstant, Events, InputRates, LeftOut},
};
use mops_language::{Quantity, Scalar, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::kernel::friction::{Contact, contacts};
use crate::kernel::{PlantModel, Simulated, Tolerance, mechanism, rests};

/// Furuta pendulum in its four lumped parameters, with viscous and Coulomb friction in both joints:
///
/// ```text
/// a theta'' + c cos(theta) phi''                    = a phi'^2 sin(theta) cos(theta) + d sin(theta) - bp theta' - tp
/// c cos(theta) theta'' + (b + a sin(theta)^2) phi'' = c theta'^2 sin(theta) - 2 a theta' phi' sin(theta) cos(theta) + u - ba phi' - ta
/// ```
///
/// `phi` is the angle of the arm, `theta` that of the pendulum, 0 upright and pi hanging, both in rad. `u` is the
/// torque on the arm in N m. While the arm moves, `ta = ca sign(phi')`; at rest, `ta` balances any torque up to `ca`.
/// `tp` is defined likewise with `cp`. A joint at rest is exactly at rest, and breaks away according to the balance of
/// torques.
///
/// Parameters: `a` inertia of the pendulum about its joint, `b` inertia of arm and load, `c` coupling (all kg m2), `d`
/// gravity torque (N m), `ba`, `bp` viscous friction (N m s/rad), `ca`, `cp` Coulomb friction (N m), and the initial
/// states `phi0`, `dphi0`, `theta0`, `dtheta0`. The mass matrix must be positive definite: `a b > c^2`. When the model
/// is linearised, a joint at rest has no Coulomb friction, and a moving joint slides.
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta`, `u`. Input: `u`.
///
/// Source: M. Gafvert, Derivation of Furuta pendulum dynamics, report TFRT-7574, Lund (1998).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct FurutaOptions {
    /// End of the simulation, unless an experiment gives it.
    horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    tolerance: Tolerance,
}

impl ModelOptions for FurutaOptions {
    const KIND: &'static str = "furuta";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.tolerance.check()?;
        let horizon = self.horizon.as_ref().map(|q| q.to(&Unit::known("s"))).transpose();
        let horizon = horizon.map_err(|e| StudyError::new("horizon", e))?;
        Ok(Box::new(Furuta::model(horizon, self.tolerance)))
    }
}

/// Model of the kind `furuta`.
pub struct Furuta {
    interface: Interface,
    tolerance: Tolerance,
}

impl Furuta {
    /// Creates a Furuta pendulum that is simulated to `horizon` (s), unless an experiment gives the end.
    pub fn model(horizon: Option<f64>, tolerance: Tolerance) -> Simulated<Self> {
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
                start("phi0", "rad", "initial angle of the arm"),
                start("dphi0", "rad/s", "initial speed of the arm"),
                start("theta0", "rad", "initial angle of the pendulum"),
                start("dtheta0", "rad/s", "initial speed of the pendulum"),
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
            ..Interface::default()
        };
        Simulated::new(Self { interface, tolerance })
    }
}

impl PlantModel for Furuta {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let [a, b, c, d, ba, bp, ca, cp, start @ ..] =
            *parameters.first_chunk::<12>().expect("the model has twelve parameters");
        let [ab, cc] = [(a * b).value(), (c * c).value()];
        if ab <= cc {
            let fact = format!("the mass matrix is not positive definite: a b = {ab} <= c^2 = {cc}");
            return Err(Failure::Undefined(fact));
        }
        let (viscous, coulomb) = ([bp, ba], [cp, ca]);
        Ok(FurutaPlant { a, b, c, d, viscous, coulomb, start, contact: [Contact::Forward; 2] })
    }
}

/// Furuta pendulum with its current contacts; joints in the order pendulum, arm; states `phi, phi', theta, theta'`.
pub struct FurutaPlant<S> {
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
    /// Initial states.
    pub start: [S; 4],
    /// Contacts of pendulum and arm.
    pub contact: [Contact; 2],
}

impl<S: Scalar> FurutaPlant<S> {
    /// Returns the coupling and the arm inertia at this angle, and the torques without Coulomb friction. The inertia of
    /// the pendulum is `a`.
    #[inline(always)]
    fn terms(&self, at: &Instant<'_, S>) -> (S, S, [S; 2]) {
        let [_, dphi, theta, dtheta] = *state(at.x);
        let (sin, cos) = theta.sin_cos();
        let coupling = self.c * cos;
        let arm = self.b + self.a * sin * sin;
        let turning = self.a * dphi * sin * cos;
        let pendulum_force = turning * dphi + self.d * sin - self.viscous[0] * dtheta + at.w[1];
        let arm_force =
            self.c * dtheta * dtheta * sin - turning * dtheta * 2.0 - self.viscous[1] * dphi + at.u[0] + at.w[0];
        (coupling, arm, [pendulum_force, arm_force])
    }

    fn limits(&self) -> [f64; 2] {
        self.coulomb.map(Scalar::value)
    }

    fn find_contacts(&mut self, at: &Instant<'_, S>) {
        let (coupling, arm, force) = self.terms(at);
        let mass = [[self.a.value(), coupling.value()], [coupling.value(), arm.value()]];
        let speed = SPEED.map(|speed| at.x[speed].value());
        self.contact = contacts(&mass, &force.map(Scalar::value), &self.limits(), &speed);
    }

    fn is_stuck(&self, joint: usize) -> bool {
        self.limits()[joint] > 0.0 && self.contact[joint] == Contact::Stuck
    }

    /// Returns the friction torque of a stuck joint, for which its acceleration is 0.
    fn holding_torque(&self, at: &Instant<'_, S>, joint: usize) -> S {
        let (coupling, _, force) = self.terms(at);
        let mut dx = *state(at.x);
        self.rates(at, &mut dx);
        force[joint] - coupling * dx[SPEED[1 - joint]]
    }
}

/// Indices of the speeds of pendulum and arm in the state.
const SPEED: [usize; 2] = [3, 1];

#[inline(always)]
fn state<S>(x: &[S]) -> &[S; 4] {
    x.first_chunk().expect("the pendulum has four states")
}

impl<S: Scalar> Plant<S> for FurutaPlant<S> {
    fn start(&self) -> Vec<S> {
        self.start.to_vec()
    }

    // Called at each of the six stages of a step: function calls would cost a fifth of the simulation time.
    #[inline(always)]
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let (coupling, arm, [mut pendulum_force, mut arm_force]) = self.terms(at);
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
        let [_, dphi, _, dtheta] = *state(at.x);
        *dx.first_chunk_mut().expect("the pendulum has four rates") = [dphi, ddphi, dtheta, ddtheta];
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        self.find_contacts(at);
    }

    fn linearise(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Result<LeftOut<S>, Failure> {
        let mut frictionless = Vec::new();
        for (position, joint) in [(0, 1), (2, 0)] {
            let speed = at.x[SPEED[joint]];
            if rests(at_rest, speed) {
                if self.coulomb[joint].value() != 0.0 {
                    frictionless.push(position);
                }
                self.coulomb[joint] = S::from(0.0);
            }
            self.contact[joint] = Contact::of(speed.value());
        }
        Ok(LeftOut { frictionless, ..LeftOut::default() })
    }

    fn events(&self) -> Option<&dyn Events<S>> {
        Some(self)
    }

    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        Some(self)
    }
}

impl<S: Scalar> Events<S> for FurutaPlant<S> {
    fn guards(&self) -> usize {
        if self.limits().iter().all(|&limit| limit == 0.0) { 0 } else { 2 }
    }

    /// Returns the speed in the direction of sliding, or the margin to the limit of a stuck joint.
    #[inline]
    fn guard(&self, joint: usize, at: &Instant<'_, S>, _: InputRates<'_>) -> S {
        let limit = self.coulomb[joint];
        if limit.value() == 0.0 {
            S::from(1.0)
        } else if self.is_stuck(joint) {
            limit - self.holding_torque(at, joint).abs()
        } else {
            at.x[SPEED[joint]] * self.contact[joint].sign()
        }
    }

    fn guard_state(&self, joint: usize) -> Option<(usize, f64)> {
        let slides = self.coulomb[joint].value() != 0.0 && !self.is_stuck(joint);
        slides.then(|| (SPEED[joint], self.contact[joint].sign()))
    }

    fn switch(&mut self, joint: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
        if self.is_stuck(joint) {
            let torque = self.holding_torque(&event.at, joint);
            self.contact[joint] = if torque.value() > 0.0 { Contact::Forward } else { Contact::Backward };
        } else {
            x[SPEED[joint]] = S::from(0.0);
            self.find_contacts(&Instant { x, ..event.at });
        }
        match (joint, self.is_stuck(joint)) {
            (0, true) => "pendulum sticks",
            (0, false) => "pendulum slides",
            (_, true) => "arm sticks",
            (_, false) => "arm slides",
        }
    }
}
