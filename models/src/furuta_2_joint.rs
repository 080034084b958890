//! Furuta pendulum as two rigid bodies with two bearings.

use mops_core::{Failure, Interface, Model, ModelOptions, Parameter, Plant, StudyError, Variable};
use mops_language::{Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::kernel::elements::BearingFriction;
use crate::kernel::mechanism::{self, Bodies, Joint, Mechanism};
use crate::kernel::{PlantModel, Simulated, Tolerance, seconds};

/// Furuta pendulum as two rigid bodies. The arm turns by `phi` about the vertical axis; the pendulum turns by `theta`
/// about the arm, 0 upright and pi hanging. With `K = J + m l^2`, `C = m r l`:
///
/// ```text
/// (Ja + m r^2 + K sin^2 theta) phi'' + C cos theta theta'' + 2 K sin theta cos theta phi' theta' - C sin theta theta'^2 = u - t1
/// C cos theta phi'' + K theta'' - K sin theta cos theta phi'^2 - m g l sin theta = -t2
/// ```
///
/// The bearings have dry friction. While the arm turns, `t1 = sign(phi') (tau11 + (tau12 - tau11) |phi'|)`; at rest,
/// `t1` balances any torque up to `peak1 tau11`. The friction of the pendulum is defined likewise by `tau21`, `tau22`
/// (N m, at 0 and at 1 rad/s) and `peak2`. Friction that decreases with speed becomes negative at some speed and drives
/// the joint, which is reported as an event. When the model is linearised, a joint at rest has no dry friction, and a
/// moving joint slides.
///
/// Parameters: `J` inertia of the pendulum about its centre of mass, `Ja` of the arm about its axis (kg m2), `m` mass
/// of pendulum and weight (kg), `l` distance of its centre of mass from the arm (m), `r` length of the arm (m, default
/// 0.245), `g` gravity (m/s2, default 9.81), the friction (default none, peaks 1), and the initial states `phi0`,
/// `dphi0`, `theta0` (default pi), `dtheta0`.
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta`, `u`. Input: `u`, the torque on the arm, N m.
///
/// Source: M. Gafvert, Derivation of Furuta pendulum dynamics, report TFRT-7574, Lund (1998); friction as in the
/// Modelica Standard Library 2.2, Mechanics.Rotational.BearingFriction.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Furuta2JointOptions {
    /// End of the simulation, unless an experiment gives it.
    horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    tolerance: Tolerance,
}

impl ModelOptions for Furuta2JointOptions {
    const KIND: &'static str = "furuta-2-joint";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.tolerance.check()?;
        let mut parameters = body_parameters();
        parameters.extend([
            torque("tau11", "friction of the arm at rest"),
            torque("tau12", "friction of the arm at 1 rad/s"),
            peak("peak1", "arm"),
            torque("tau21", "friction of the pendulum at rest"),
            torque("tau22", "friction of the pendulum at 1 rad/s"),
            peak("peak2", "pendulum"),
        ]);
        let interface = mechanism::interface(&[ARM, PENDULUM], parameters, vec![arm_torque()]);
        let ports = mechanism::ports(&["phi", "theta"], &["u"]);
        let horizon = seconds("horizon", self.horizon.as_ref())?;
        Ok(Box::new(Simulated::new(Furuta2Joint {
            interface: Interface { ports, horizon, ..interface },
            tolerance: self.tolerance,
        })))
    }
}

/// Model of the kind `furuta-2-joint`.
struct Furuta2Joint {
    interface: Interface,
    tolerance: Tolerance,
}

impl PlantModel for Furuta2Joint {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let [bodies @ .., tau11, tau12, peak1, tau21, tau22, peak2, _, _, _, _] =
            *parameters.first_chunk::<16>().expect("the model has sixteen parameters");
        let line = |at_rest: S, at_one: S| [[S::from(0.0), at_rest], [S::from(1.0), at_one]];
        let friction =
            [BearingFriction::new(&line(tau11, tau12), peak1)?, BearingFriction::new(&line(tau21, tau22), peak2)?];
        let bodies = TwoBodies(Lumped::of(&bodies));
        Ok(Mechanism::new(bodies, friction, &[ARM, PENDULUM], &parameters[12..]))
    }
}

/// Lumped parameters of arm and pendulum.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lumped<S> {
    /// Inertia of the pendulum about its joint, `J + m l^2`, kg m2.
    pub a: S,
    /// Inertia of the arm with the pendulum's mass at its end, `Ja + m r^2`, kg m2.
    pub b: S,
    /// Coupling, `m r l`, kg m2.
    pub c: S,
    /// Gravity torque, `m g l`, N m.
    pub d: S,
}

impl<S: Scalar> Lumped<S> {
    /// Computes the lumped parameters from values of [`body_parameters`].
    pub fn of(&[inertia, arm_inertia, m, l, r, g]: &[S; 6]) -> Self {
        Self { a: inertia + m * l * l, b: arm_inertia + m * r * r, c: m * r * l, d: m * g * l }
    }

    /// Returns the mass matrix, and the torques of gravity and of the rotating frame, in the order arm, pendulum.
    #[inline]
    pub fn mass_and_force(&self, theta: S, dphi: S, dtheta: S) -> ([[S; 2]; 2], [S; 2]) {
        let Self { a, b, c, d } = *self;
        let (sin, cos) = theta.sin_cos();
        let coupling = c * cos;
        let turning = a * sin * cos * dphi;
        let arm_force = c * sin * dtheta * dtheta - turning * dtheta * 2.0;
        ([[b + a * sin * sin, coupling], [coupling, a]], [arm_force, turning * dphi + d * sin])
    }
}

/// Arm and pendulum; the input is the torque on the arm.
pub(crate) struct TwoBodies<S>(pub Lumped<S>);

impl<S: Scalar> Bodies<S, 2> for TwoBodies<S> {
    #[inline]
    fn mass_and_force(&self, _: f64, u: &[S], q: &[S; 2], w: &[S; 2]) -> ([[S; 2]; 2], [S; 2]) {
        let (mass, [arm, pendulum]) = self.0.mass_and_force(q[1], w[0], w[1]);
        (mass, [arm + u[0], pendulum])
    }
}

/// Joint of the arm.
pub(crate) const ARM: Joint = Joint {
    angle: "phi",
    about: "arm",
    start: 0.0,
    events: ["arm sticks", "arm slides", "arm driven by negative friction", "arm braked by its friction again"],
};

/// Joint of the pendulum.
pub(crate) const PENDULUM: Joint = Joint {
    angle: "theta",
    about: "pendulum, 0 upright, pi hanging",
    start: std::f64::consts::PI,
    events: [
        "pendulum sticks",
        "pendulum slides",
        "pendulum driven by negative friction",
        "pendulum braked by its friction again",
    ],
};

/// Returns the parameters of the bodies: inertias, mass, lengths and gravity.
pub(crate) fn body_parameters() -> Vec<Parameter> {
    let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
    vec![
        positive("J", "kg m2", "inertia of the pendulum about its centre of mass"),
        positive("Ja", "kg m2", "inertia of the arm about its axis"),
        positive("m", "kg", "mass of pendulum and weight"),
        positive("l", "m", "distance of the pendulum's centre of mass from the arm"),
        positive("r", "m", "length of the arm").with_default(0.245),
        Parameter::new("g", "m/s2", "gravity").with_default(9.81),
    ]
}

/// Creates the parameter of a friction torque.
pub(crate) fn torque(name: &str, about: &str) -> Parameter {
    Parameter::new(name, "N m", about).with_default(0.0)
}

/// Creates the parameter of the ratio of break-away torque to sliding torque at rest.
pub(crate) fn peak(name: &str, joint: &str) -> Parameter {
    let about = format!("ratio of the break-away torque of the {joint} to its sliding friction at rest");
    Parameter::new(name, "1", about).within(1.0, f64::INFINITY).with_default(1.0)
}

/// Returns the input of all models of the pendulum.
pub(crate) fn arm_torque() -> Variable {
    Variable::new("u", "N m", "torque on the arm")
}
