//! Furuta pendulum whose pendulum can also tilt sideways against a spring.

use mops_core::{Failure, Interface, Model, ModelOptions, Parameter, Plant, StudyError};
use mops_language::{Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::furuta_2_joint::{ARM, Lumped, PENDULUM, arm_torque, body_parameters, peak, torque};
use crate::kernel::elements::{BearingFriction, SpringDamper};
use crate::kernel::mechanism::{self, Bodies, Joint, Mechanism};
use crate::kernel::{PlantModel, Simulated, Tolerance, seconds};

/// Furuta pendulum of `furuta-2-joint` with a third joint. At its top the pendulum tilts by `psi`, in the plane through
/// its swing axis, against a spring and a damper in parallel. The rod has no inertia about its own axis. With
/// `K = J + m l^2`, `C = -m r l`, speeds `(f, w, u) = (phi', theta', psi')`, and `st`, `ct`, `sp`, `cp` the sines and
/// cosines of theta and psi, `M q'' + h = torques`:
///
/// ```text
/// M11 = Ja + m r^2 + K (1 - cp^2 ct^2) - 2 C sp,  M12 = cp ct (K sp - C),  M13 = st (C sp - K),  M22 = K cp^2,  M23 = 0,  M33 = K
/// h1 = 2 K cp^2 st ct f w + 2 (K sp cp ct^2 - C cp) f u - cp st (K sp - C) w^2 + 2 ct sp (C - K sp) w u + C st cp u^2
/// h2 = -K cp^2 st ct f^2 + 2 K ct cp^2 f u - 2 K sp cp w u - m g l cp st
/// h3 = (C cp - K sp cp ct^2) f^2 - 2 K ct cp^2 f w + K sp cp w^2 - m g l sp ct + c psi + d psi'
/// ```
///
/// The bearing of the arm has a table of friction torque over speed: `tau11` at rest, `tau01` at `point0`, `tau05` at
/// `point1`, `tau12` at `point2`. The table is linear between its points and extrapolated beyond the last; the
/// break-away torque is `peak1 tau11`. The bearing of the pendulum has two entries as in `furuta-2-joint`. Negative
/// friction drives the joint, which is reported as an event. When the model is linearised, a joint at rest has no dry
/// friction, and a moving joint slides.
///
/// Parameters: those of `furuta-2-joint`; `tau01`, `tau05` (N m), `point0`, `point1`, `point2` (rad/s, increasing); `c`
/// (N m/rad), `d` (N m s/rad); and the additional initial states `psi0`, `dpsi0` (default 0).
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta`, `psi`, `dpsi`, `u`. Input: `u`, the torque on the arm, N m.
///
/// Source: the Lagrangian of the two bodies (R. Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 3, for the
/// method); friction and spring as in the Modelica Standard Library 2.2, Mechanics.Rotational.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Furuta3JointOptions {
    /// End of the simulation, unless an experiment gives it.
    horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    tolerance: Tolerance,
}

impl ModelOptions for Furuta3JointOptions {
    const KIND: &'static str = "furuta-3-joint";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.tolerance.check()?;
        let at = |name: &str, default| {
            let about = format!("speed of the arm at entry {} of its friction table", &name[5..]);
            Parameter::new(name, "rad/s", about).within(f64::MIN_POSITIVE, f64::INFINITY).with_default(default)
        };
        let positive =
            |name, unit, about| Parameter::new(name, unit, about).within(0.0, f64::INFINITY).with_default(0.0);
        let mut parameters = body_parameters();
        parameters.extend([
            torque("tau11", "friction of the arm at rest"),
            torque("tau01", "friction of the arm at `point0`"),
            torque("tau05", "friction of the arm at `point1`"),
            torque("tau12", "friction of the arm at `point2`"),
            at("point0", 0.1),
            at("point1", 0.5),
            at("point2", 1.0),
            peak("peak1", "arm"),
            torque("tau21", "friction of the pendulum at rest"),
            torque("tau22", "friction of the pendulum at 1 rad/s"),
            peak("peak2", "pendulum"),
            positive("c", "N m/rad", "spring against the tilt"),
            positive("d", "N m s/rad", "damper against the tilt"),
        ]);
        let interface = mechanism::interface(&[ARM, PENDULUM, TILT], parameters, vec![arm_torque()]);
        let ports = mechanism::ports(&["phi", "theta", "psi"], &["u"]);
        let horizon = seconds("horizon", self.horizon.as_ref())?;
        Ok(Box::new(Simulated::new(Furuta3Joint {
            interface: Interface { ports, horizon, ..interface },
            tolerance: self.tolerance,
        })))
    }
}

const TILT: Joint = Joint { angle: "psi", about: "pendulum's tilt", start: 0.0, events: [""; 4] };

/// Model of the kind `furuta-3-joint`.
struct Furuta3Joint {
    interface: Interface,
    tolerance: Tolerance,
}

impl PlantModel for Furuta3Joint {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        let (parameters, start) = parameters.split_at(parameters.len() - 6);
        let [bodies @ .., tau11, tau01, tau05, tau12, point0, point1, point2, peak1, tau21, tau22, peak2, c, d] =
            *parameters.first_chunk::<19>().expect("the model has nineteen parameters without the initial states");
        let [at_rest, at_one] = [S::from(0.0), S::from(1.0)];
        let friction = [
            BearingFriction::new(&[[at_rest, tau11], [point0, tau01], [point1, tau05], [point2, tau12]], peak1)?,
            BearingFriction::new(&[[at_rest, tau21], [at_one, tau22]], peak2)?,
            BearingFriction::none(),
        ];
        let bodies = ThreeBodies { lumped: Lumped::of(&bodies), tilt: SpringDamper::new(c, d) };
        Ok(Mechanism::new(bodies, friction, &[ARM, PENDULUM, TILT], start))
    }
}

/// Arm and pendulum, with the spring at the top of the pendulum; the input is the torque on the arm.
pub(crate) struct ThreeBodies<S> {
    pub lumped: Lumped<S>,
    pub tilt: SpringDamper<S>,
}

impl<S: Scalar> Bodies<S, 3> for ThreeBodies<S> {
    fn mass_and_force(&self, _: f64, input: &[S], q: &[S; 3], speed: &[S; 3]) -> ([[S; 3]; 3], [S; 3]) {
        let (k, arm, c, gravity) = (self.lumped.a, self.lumped.b, -self.lumped.c, self.lumped.d);
        let [f, w, u] = *speed;
        let (st, ct) = q[1].sin_cos();
        let (sp, cp) = q[2].sin_cos();
        let (cp2, ksp) = (cp * cp, k * sp);
        let m11 = arm + k - k * cp2 * ct * ct - c * sp * 2.0;
        let m12 = cp * ct * (ksp - c);
        let m13 = st * (c * sp - k);
        let mass = [[m11, m12, m13], [m12, k * cp2, S::from(0.0)], [m13, S::from(0.0), k]];
        let swing = k * cp2 * st * ct;
        let tilt = ksp * cp * ct * ct - c * cp;
        let h1 = swing * f * w * 2.0 + tilt * f * u * 2.0 - cp * st * (ksp - c) * w * w
            + ct * sp * (c - ksp) * w * u * 2.0
            + c * st * cp * u * u;
        let h2 = -swing * f * f + k * ct * cp2 * f * u * 2.0 - ksp * cp * w * u * 2.0 - gravity * cp * st;
        let h3 = -tilt * f * f - k * ct * cp2 * f * w * 2.0 + ksp * cp * w * w - gravity * sp * ct
            + self.tilt.torque(q[2], u);
        (mass, [-h1 + input[0], -h2, -h3])
    }
}
