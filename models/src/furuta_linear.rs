//! The Furuta pendulum near its upright position, linearised.

use mops_core::{
    Failure, Interface, Job, Mistake, Model, ModelOptions, OperatingPoint, Parameter, Quantity, Scalar, Variable,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::furuta_2_joint::{ARM, Lumped, PENDULUM, arm_torque};
use crate::kernel::drive::Drive;
use crate::kernel::elements::SpringDamper;
use crate::kernel::mechanism::{self, Joint};
use crate::kernel::{
    Dynamics, Equations, Kernel, Recording, Simulate, Tolerance, Written, rates_and_signals, record, seconds, wanted,
};

/// The Furuta pendulum linearised about the upright position, with a spring and a damper in parallel in each joint:
///
/// ```text
/// b phi'' + c theta'' = u - c1 phi - d1 phi'
/// c phi'' + a theta'' = d theta - c2 theta - d2 theta'
/// ```
///
/// Parameters: `a` pendulum inertia about its joint, `b` inertia of the arm with the pendulum's mass at its end, `c`
/// coupling (all kg m2), `d` gravity torque (N m), springs `c1`, `c2` (N m/rad) and dampers `d1`, `d2` (N m s/rad) of arm
/// and pendulum (default 0), and the start values `phi0`, `dphi0`, `theta0`, `dtheta0` (default 0).
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta` (rad, rad/s), `u`. Input: `u`, the torque on the arm, N m.
///
/// Source: M. Gafvert, Derivation of Furuta pendulum dynamics, report TFRT-7574, Lund (1998), linearised.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct FurutaLinearOptions {
    /// End of the simulation where no experiment gives one.
    horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    tolerance: Tolerance,
}

impl ModelOptions for FurutaLinearOptions {
    const KIND: &'static str = "furuta-linear";

    fn build(self) -> Result<Box<dyn Model>, Mistake> {
        self.tolerance.check()?;
        let interface = mechanism::interface(&upright_joints(), lumped_parameters(), vec![arm_torque()]);
        let horizon = seconds("horizon", self.horizon.as_ref())?;
        Ok(Box::new(Kernel(FurutaLinear { interface: Interface { horizon, ..interface }, tolerance: self.tolerance })))
    }
}

/// The model of the kind `furuta-linear`.
struct FurutaLinear {
    interface: Interface,
    tolerance: Tolerance,
}

impl Written for FurutaLinear {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn states(&self) -> Vec<Variable> {
        self.interface.signals[..4].to_vec()
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }
}

impl Equations for FurutaLinear {
    fn equations<S: Scalar>(&self, at: &OperatingPoint<'_, S>) -> Result<[Vec<S>; 2], Failure> {
        let dynamics = Self::dynamics(at.parameters, Drive::held(at.inputs[0]))?;
        let x = at.states.try_into().expect("the pendulum has four states");
        Ok(rates_and_signals(&dynamics, &x, self.interface.signals.len(), &Self::signal))
    }
}

impl Simulate for FurutaLinear {
    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        let mut dynamics = Self::dynamics(parameters, Drive::new(job.case.input("u")))?;
        let start = *parameters.last_chunk().expect("four start values come last");
        record(&mut dynamics, start, job.horizon, &self.tolerance, &wanted(job, &self.interface.signals), &Self::signal)
    }
}

impl FurutaLinear {
    fn dynamics<'a, S: Scalar>(parameters: &[S], drive: Drive<'a, S>) -> Result<Driven<'a, S>, Failure> {
        let plant = *parameters.first_chunk().expect("the plant comes first");
        Ok(Driven { plant: Upright::of(plant)?, drive })
    }

    /// The value of a signal: the states, then the torque.
    fn signal<S: Scalar>(dynamics: &Driven<'_, S>, signal: usize, t: f64, x: &[S; 4]) -> S {
        if signal < 4 { x[signal] } else { dynamics.drive.at(t) }
    }
}

/// Joints of a pendulum that starts upright.
pub(crate) fn upright_joints() -> [Joint; 2] {
    [ARM, Joint { start: 0.0, ..PENDULUM }]
}

/// Parameters of [`Upright`].
pub(crate) fn lumped_parameters() -> Vec<Parameter> {
    let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
    let element = |name, unit, about| Parameter::new(name, unit, about).within(0.0, f64::INFINITY).with_default(0.0);
    vec![
        positive("a", "kg m2", "inertia of the pendulum about its joint"),
        positive("b", "kg m2", "inertia of the arm with the pendulum's mass at its end"),
        Parameter::new("c", "kg m2", "coupling of the joints"),
        Parameter::new("d", "N m", "gravity torque of the pendulum"),
        element("c1", "N m/rad", "spring of the arm"),
        element("d1", "N m s/rad", "damper of the arm"),
        element("c2", "N m/rad", "spring of the pendulum"),
        element("d2", "N m s/rad", "damper of the pendulum"),
    ]
}

/// The pendulum and the springs and dampers of its joints, near the upright position or, by the same parameters, anywhere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Upright<S> {
    lumped: Lumped<S>,
    elements: [SpringDamper<S>; 2],
}

impl<S: Scalar> Upright<S> {
    /// From values of [`lumped_parameters`].
    pub fn of([a, b, c, d, c1, d1, c2, d2]: [S; 8]) -> Result<Self, Failure> {
        let [ab, cc] = [(a * b).value(), (c * c).value()];
        if ab <= cc {
            let fact = format!("the mass matrix is not positive definite: a b = {ab} <= c^2 = {cc}");
            return Err(Failure::Undefined(fact));
        }
        Ok(Self { lumped: Lumped { a, b, c, d }, elements: [SpringDamper::new(c1, d1), SpringDamper::new(c2, d2)] })
    }

    /// Accelerations of arm and pendulum by the linearised equations.
    pub fn linear(&self, x: &[S; 4], u: S) -> [S; 2] {
        let Lumped { a, b, c, d } = self.lumped;
        self.accelerations([[b, c], [c, a]], [u, d * x[2]], x)
    }

    /// Accelerations of arm and pendulum by the nonlinear equations.
    pub fn nonlinear(&self, x: &[S; 4], u: S) -> [S; 2] {
        let (mass, [arm, pendulum]) = self.lumped.mass_and_force(x[2], x[1], x[3]);
        self.accelerations(mass, [arm + u, pendulum], x)
    }

    fn accelerations(&self, mass: [[S; 2]; 2], force: [S; 2], x: &[S; 4]) -> [S; 2] {
        let arm = force[0] - self.elements[0].torque(x[0], x[1]);
        let pendulum = force[1] - self.elements[1].torque(x[2], x[3]);
        let [[m11, m12], [_, m22]] = mass;
        let determinant = m11 * m22 - m12 * m12;
        [(m22 * arm - m12 * pendulum) / determinant, (m11 * pendulum - m12 * arm) / determinant]
    }
}

/// The linearised pendulum with a torque from outside.
struct Driven<'a, S> {
    plant: Upright<S>,
    drive: Drive<'a, S>,
}

impl<S: Scalar> Dynamics<S> for Driven<'_, S> {
    type State = [S; 4];

    fn shows(&self, signal: usize) -> Option<usize> {
        (signal < 4).then_some(signal)
    }

    fn derivative(&self, t: f64, x: &[S; 4], dx: &mut [S; 4]) {
        let [arm, pendulum] = self.plant.linear(x, self.drive.at(t));
        *dx = [x[1], arm, x[3], pendulum];
    }

    fn next_break(&self, t: f64) -> f64 {
        self.drive.next_break(t)
    }

    fn longest_step(&self) -> f64 {
        self.drive.longest_step()
    }

    fn pass_break(&mut self, t: f64, _: &mut [S; 4]) {
        self.drive.pass_break(t);
    }
}
