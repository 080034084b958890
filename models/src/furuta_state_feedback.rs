//! Furuta pendulum balanced upright by state feedback, with a setpoint for the angle of the arm.

use std::sync::Arc;

use mops_core::{
    Failure, Instant, Interface, Model, ModelOptions, Parameter, StudyError, Variable,
    model::Cut,
    plant::{EventInstant, Events, InputRates, LeftOut},
};
use mops_language::{Quantity, Scalar};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::furuta_linear::{Upright, lumped_parameters, upright_joints};
use crate::kernel::elements::{Lag, Saturation};
use crate::kernel::{PlantModel, Simulated, Tolerance, cut_at, mechanism, seconds};

/// Upright Furuta pendulum with a spring and a damper in each joint, under state feedback with a filtered reference:
///
/// ```text
/// ref = setpoint (1 - exp(-t/T))
/// v = -(k1 (phi - ref) + k2 phi' + k3 theta + k4 theta'),   u = min(max(v, -limit), limit)
/// ```
///
/// The setpoint moves the arm from 0 to `setpoint`. A first-order filter keeps the reference from jumping, so that the
/// pendulum does not fall. `u` is the torque on the arm. The plant is that of `furuta-linear`, or with
/// `plant = "nonlinear"` (the default) its nonlinear equations.
///
/// Parameters: gains `k1`, `k3` (N m/rad) and `k2`, `k4` (N m s/rad); `setpoint` (rad); `T` time constant of the filter
/// (s, default 0.05); `limit` of the torque (N m, default 0.05); those of the plant (`a`, `b`, `c`, `d`, `c1`, `d1`,
/// `c2`, `d2`) and the initial states as in `furuta-linear`.
///
/// Signals: `phi`, `dphi`, `theta`, `dtheta`, `ref` (rad, rad/s), `u` (N m). The loop can be cut at `u`.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2nd ed., 2021), section 7.2 (state feedback).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FurutaStateFeedbackOptions {
    /// End of the simulation.
    horizon: Quantity,
    /// Equations of the pendulum.
    #[serde(default)]
    plant: Plant,
    /// Accuracy and limits of the simulation.
    #[serde(default)]
    tolerance: Tolerance,
}

/// Equations of the pendulum.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Plant {
    /// Nonlinear equations of two rigid bodies.
    #[default]
    Nonlinear,
    /// Equations linearised about the upright position.
    Linear,
}

impl ModelOptions for FurutaStateFeedbackOptions {
    const KIND: &'static str = "furuta-state-feedback";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.tolerance.check()?;
        let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
        let mut parameters = vec![
            Parameter::new("k1", "N m/rad", "gain of the arm's angle"),
            Parameter::new("k2", "N m s/rad", "gain of the arm's speed"),
            Parameter::new("k3", "N m/rad", "gain of the pendulum's angle"),
            Parameter::new("k4", "N m s/rad", "gain of the pendulum's speed"),
            Parameter::new("setpoint", "rad", "setpoint of the arm's angle"),
            positive("T", "s", "time constant of the filter of the reference").with_default(0.05),
            positive("limit", "N m", "largest torque").with_default(0.05),
        ];
        parameters.extend(lumped_parameters());
        let mut interface = mechanism::interface(&upright_joints(), parameters, Vec::new());
        interface.signals.push(Variable::new("ref", "rad", "reference of the arm's angle"));
        interface.signals.push(Variable::new("u", "N m", "torque on the arm"));
        interface.horizon = seconds("horizon", Some(&self.horizon))?;
        let Self { plant, tolerance, .. } = self;
        Ok(Box::new(Simulated::new(FurutaStateFeedback { interface, plant, is_cut: false, tolerance })))
    }
}

/// Model of the kind `furuta-state-feedback`.
#[derive(Clone)]
struct FurutaStateFeedback {
    interface: Interface,
    plant: Plant,
    /// True if an input acts in the place of the torque.
    is_cut: bool,
    tolerance: Tolerance,
}

impl PlantModel for FurutaStateFeedback {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    /// Returns the states of the pendulum, then the reference.
    fn states(&self) -> Vec<Variable> {
        self.interface.signals[..5].to_vec()
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn cut(&self, variables: &[String]) -> Option<Result<Cut, StudyError>> {
        Some(cut_at("u", &self.interface, variables).map(|(interface, ends)| {
            let model = Self { interface, is_cut: true, ..self.clone() };
            Cut { model: Arc::new(Simulated::new(model)), ends }
        }))
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl mops_core::Plant<S>, Failure> {
        let p: [S; 19] = parameters.try_into().expect("the study gives every parameter");
        let [k1, k2, k3, k4, setpoint, time, limit, plant @ .., phi, dphi, theta, dtheta] = p;
        Ok(Loop {
            gains: [k1, k2, k3, k4],
            setpoint,
            filter: Lag { time },
            actuator: Saturation::new(-limit, limit),
            equations: self.plant,
            is_cut: self.is_cut,
            plant: Upright::of(plant)?,
            start: [phi, dphi, theta, dtheta, S::from(0.0)],
        })
    }
}

/// Closed loop; state: that of the plant, then the reference.
struct Loop<S> {
    gains: [S; 4],
    setpoint: S,
    filter: Lag<S>,
    actuator: Saturation<S>,
    equations: Plant,
    is_cut: bool,
    plant: Upright<S>,
    start: [S; 5],
}

impl<S: Scalar> Loop<S> {
    /// Returns the torque that the feedback requests, N m.
    fn demand(&self, x: &[S]) -> S {
        let [k1, k2, k3, k4] = self.gains;
        -(k1 * (x[0] - x[4]) + k2 * x[1] + k3 * x[2] + k4 * x[3])
    }

    /// Returns the torque of the actuator, N m.
    fn torque(&self, x: &[S]) -> S {
        self.actuator.output(self.demand(x))
    }
}

impl<S: Scalar> mops_core::Plant<S> for Loop<S> {
    fn start(&self) -> Vec<S> {
        self.start.to_vec()
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let x = at.x;
        let plant = x.first_chunk().expect("the pendulum has four states");
        let torque = if self.is_cut { at.u[0] } else { self.torque(x) };
        let [arm, pendulum] = match self.equations {
            Plant::Nonlinear => self.plant.nonlinear(plant, torque),
            Plant::Linear => self.plant.linear(plant, torque),
        };
        dx.copy_from_slice(&[x[1], arm, x[3], pendulum, self.filter.derivative(self.setpoint, x[4])]);
    }

    /// Returns a state, the torque, or the output of the cut loop.
    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        let torque = || if signal == at.x.len() { self.torque(at.x) } else { -self.torque(at.x) };
        at.x.get(signal).copied().unwrap_or_else(torque)
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        self.actuator.settle(self.demand(at.x));
    }

    /// Linearises within the torque limit.
    fn linearise(&mut self, at: &Instant<'_, S>, _: bool) -> Result<LeftOut<S>, Failure> {
        let is_within = self.actuator.holds(self.demand(at.x));
        let exceeded = (!is_within).then_some("the torque exceeds its `limit`");
        Ok(LeftOut { exceeded, ..LeftOut::default() })
    }

    fn events(&self) -> Option<&dyn Events<S>> {
        Some(self)
    }

    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        Some(self)
    }
}

impl<S: Scalar> Events<S> for Loop<S> {
    fn guards(&self) -> usize {
        1
    }

    fn guard(&self, _: usize, at: &Instant<'_, S>, _: InputRates<'_>) -> S {
        self.actuator.guard(self.demand(at.x))
    }

    fn switch(&mut self, _: usize, event: &EventInstant<'_, S>, _: &mut [S]) -> &str {
        let limited = self.actuator.switch(self.demand(event.at.x));
        if limited { "torque reaches its limit" } else { "torque leaves its limit" }
    }
}
