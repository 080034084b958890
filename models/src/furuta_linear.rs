//! Furuta pendulum linearised about its upright position.

use mops_core::{Failure, Instant, Interface, Model, ModelOptions, Parameter, Plant, StudyError};
use mops_language::{Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::furuta_2_joint::{ARM, Lumped, PENDULUM, arm_torque};
use crate::kernel::elements::SpringDamper;
use crate::kernel::mechanism::{self, Joint};
use crate::kernel::{PlantModel, Simulated, Tolerance, seconds};

/// Furuta pendulum linearised about the upright position, with a spring and a damper in parallel in each joint:
///
/// ```text
/// b phi'' + c theta'' = u - c1 phi - d1 phi'
/// c phi'' + a theta'' = d theta - c2 theta - d2 theta'
/// ```
///
/// Parameters: `a` inertia of the pendulum about its joint, `b` inertia of the arm with the pendulum's mass at its end,
/// `c` coupling (all kg m2), `d` gravity torque (N m), springs `c1`, `c2` (N m/rad) and dampers `d1`, `d2` (N m s/rad)
/// of arm and pendulum (default 0), and the initial states `phi0`, `dphi0`, `theta0`, `dtheta0` (default 0).
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta` (rad, rad/s), `u`. Input: `u`, the torque on the arm, N m.
///
/// Source: M. Gafvert, Derivation of Furuta pendulum dynamics, report TFRT-7574, Lund (1998), linearised.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct FurutaLinearOptions {
    /// End of the simulation, unless an experiment gives it.
    horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    tolerance: Tolerance,
}

impl ModelOptions for FurutaLinearOptions {
    const KIND: &'static str = "furuta-linear";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.tolerance.check()?;
        let interface = mechanism::interface(&upright_joints(), lumped_parameters(), vec![arm_torque()]);
        let horizon = seconds("horizon", self.horizon.as_ref())?;
        let interface = Interface { horizon, ..interface };
        Ok(Box::new(Simulated::new(FurutaLinear { interface, tolerance: self.tolerance })))
    }
}

/// Model of the kind `furuta-linear`.
struct FurutaLinear {
    interface: Interface,
    tolerance: Tolerance,
}

impl PlantModel for FurutaLinear {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let (plant, start) = parameters.split_first_chunk().expect("the plant comes first");
        Ok(LinearPlant { plant: Upright::of(*plant)?, start })
    }
}

/// Returns the joints of a pendulum that starts upright.
pub(crate) fn upright_joints() -> [Joint; 2] {
    [ARM, Joint { start: 0.0, ..PENDULUM }]
}

/// Returns the parameters of [`Upright`].
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

/// Pendulum with springs and dampers in its joints: linearised about the upright position, or nonlinear with the same
/// parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Upright<S> {
    lumped: Lumped<S>,
    elements: [SpringDamper<S>; 2],
}

impl<S: Scalar> Upright<S> {
    /// Creates the pendulum from values of [`lumped_parameters`].
    pub fn of([a, b, c, d, c1, d1, c2, d2]: [S; 8]) -> Result<Self, Failure> {
        let [ab, cc] = [(a * b).value(), (c * c).value()];
        if ab <= cc {
            let fact = format!("the mass matrix is not positive definite: a b = {ab} <= c^2 = {cc}");
            return Err(Failure::Undefined(fact));
        }
        Ok(Self { lumped: Lumped { a, b, c, d }, elements: [SpringDamper::new(c1, d1), SpringDamper::new(c2, d2)] })
    }

    /// Returns the accelerations of arm and pendulum by the linearised equations.
    pub fn linear(&self, x: &[S; 4], u: S) -> [S; 2] {
        let Lumped { a, b, c, d } = self.lumped;
        self.accelerations([[b, c], [c, a]], [u, d * x[2]], x)
    }

    /// Returns the accelerations of arm and pendulum by the nonlinear equations.
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

/// Linearised pendulum; the input is the torque on the arm.
struct LinearPlant<'a, S> {
    plant: Upright<S>,
    start: &'a [S],
}

impl<S: Scalar> Plant<S> for LinearPlant<'_, S> {
    fn start(&self) -> Vec<S> {
        self.start.to_vec()
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let x = at.x.first_chunk().expect("the pendulum has four states");
        let [arm, pendulum] = self.plant.linear(x, at.u[0]);
        dx.copy_from_slice(&[x[1], arm, x[3], pendulum]);
    }
}
