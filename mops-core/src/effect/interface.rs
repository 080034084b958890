//! Interface of effects.

use std::sync::Arc;

use mops_language::{Dual7, Scalar};

use super::declaration::{
    Characteristic, DeclaredTerm, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind,
};
use super::port::Port;

/// State of the port at which an effect is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct PortState<'a, S> {
    /// Time, s; with the derivatives of the time of a jump while a hysteresis state passes it.
    pub t: S,
    /// Command at an actuator, signal at a sensor, both before the effect; 0 elsewhere.
    pub value: S,
    /// Position of the joint; state at a process; else `value`.
    pub q: S,
    /// Speed of the joint; rate of `value` for an effect with a hysteresis state; 0 elsewhere.
    pub v: S,
    /// Acceleration of the joint without the effect, provided if [`Effect::is_inertial`]; else 0.
    pub a: S,
    /// Acceleration per unit force, provided if [`Effect::is_inertial`]; else 0.
    pub mobility: S,
    /// Value at the second port: position of a joint, state, input or signal; 0 without a second port.
    pub other: S,
    /// Speed at the second port, if it is a joint.
    pub other_speed: S,
    /// The inputs as they reach the plant.
    pub u: &'a [S],
    /// True if [`BoundEffect::gap`] is negative, fixed by the simulation for a whole step. `None` for an effect without
    /// a gap, or if the sign decides.
    pub closed: Option<bool>,
}

/// Dry friction of a joint; the kernel determines whether the joint sticks.
#[derive(Debug, Clone, Copy)]
pub struct DryFriction<S> {
    /// Friction force against forward and backward sliding, at the current speed; not negative.
    pub sliding: [S; 2],
    /// Break-away force of a joint at rest, forward and backward; at least the sliding force at speed 0.
    pub limit: [S; 2],
}

/// Largest part of the moving mass of a joint that effects take away together, so that some mass remains.
pub const MOST_LOST: f64 = 0.95;

/// An effect at given parameters.
pub trait BoundEffect<S: Scalar> {
    /// Writes the default initial values of the states of the effect.
    fn start(&self, _at: &PortState<'_, S>, _z: &mut [S]) {}

    /// Writes the rates of the states of the effect.
    fn rates(&self, _at: &PortState<'_, S>, _z: &[S], _dz: &mut [S]) {}

    /// Returns the output of the effect. At a joint or a process: the term added to the right-hand side of the
    /// equation, positive forward. At an actuator: the input that reaches the plant. At a sensor: the measured value.
    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S;

    /// Returns the mass or inertia that an effect with [`Effect::is_inertial`] adds to the joint; negative for a loss.
    /// The masses of all effects at a joint add up, and at most [`MOST_LOST`] of the moving mass is lost.
    fn inertia(&self, _at: &PortState<'_, S>) -> S {
        S::from(0.0)
    }

    /// Returns the term added to the equation of the second port, if both ports are joints or processes.
    fn onward(&self, _at: &PortState<'_, S>, _z: &[S]) -> S {
        S::from(0.0)
    }

    /// Returns the dry friction at a joint, in addition to [`BoundEffect::value`].
    fn friction(&self, _at: &PortState<'_, S>, _z: &[S]) -> Option<DryFriction<S>> {
        None
    }

    /// Returns the distance to the edge at which the law of the effect changes: the opening of a contact, the height of
    /// an edge above a level, the distance to the limit of an actuator or a sensor. It is negative beyond the edge, and
    /// depends on what the effect receives at its own place; an effect has one throughout a simulation or never. A
    /// simulation ends a step at its zero crossing, and tangents account for the event time. Within a step
    /// [`PortState::closed`] selects the law, also slightly beyond the crossing.
    fn gap(&self, _at: &PortState<'_, S>) -> Option<S> {
        None
    }

    /// Returns the delay of an actuator or a sensor, s.
    fn delay(&self) -> Option<S> {
        None
    }

    /// Returns the times at which the effect changes its form, s; steps end there.
    fn breaks(&self) -> Vec<S> {
        Vec::new()
    }

    /// Returns the largest step size that resolves the internal dynamics of the effect, s.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the largest step size at which an explicit method is stable for the decaying internal dynamics of the
    /// effect, s.
    fn damped_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Updates the hysteresis state ([`Effect::hysteresis_states`]), which is NaN before the first update: where the
    /// command jumps or bends, before and after it, and where [`BoundEffect::hysteresis_guard`] becomes negative.
    fn update_hysteresis(&self, _at: &PortState<'_, S>, _memory: &mut [S]) {}

    /// Returns a guard that becomes negative where the hysteresis state must be updated: the law of
    /// [`BoundEffect::hysteresis_value`] is valid until then.
    fn hysteresis_guard(&self, _at: &PortState<'_, S>, _memory: &[S]) -> S {
        S::from(1.0)
    }

    /// Returns the output, as [`BoundEffect::value`], for an effect with a hysteresis state.
    fn hysteresis_value(&self, at: &PortState<'_, S>, _memory: &[S]) -> S {
        self.value(at, &[])
    }
}

/// A physical effect that a model may lack.
pub trait Effect: Send + Sync {
    /// Returns the name in study files and results.
    fn name(&self) -> &'static str;

    /// Returns the description, one sentence.
    fn about(&self) -> &'static str;

    /// Returns the formula, for readers.
    fn formula(&self) -> &'static str;

    /// Returns the source of the formula.
    fn source(&self) -> &'static str;

    /// Returns the physical class.
    fn class(&self) -> EffectClass;

    /// Returns the more general effect that this effect is a form of, such as `backlash` for play in a coupling.
    fn form_of(&self) -> Option<&'static str> {
        None
    }

    /// Returns the kinds of ports that the effect acts at.
    fn ports(&self) -> &'static [PortKind];

    /// Returns units of the quantities that a state of its place may be, the temperature of a store or its level; none
    /// if it may be any. A state in the unit of another mechanical or thermal quantity is then no place of it; one in
    /// V, % or without a unit may be any quantity, as sensors show it.
    fn quantities(&self) -> &'static [&'static str] {
        &[]
    }

    /// Returns the kind of the second port, if one is needed: the origin of drag, a sensor with cross-talk.
    fn second_port(&self) -> Option<PortKind> {
        None
    }

    /// Returns true if the effect is symmetric in its two ports.
    fn mutual(&self) -> bool {
        false
    }

    /// Returns true if the effect of a joint may also act between two joints, as [`super::Between`]. Not for dry
    /// friction, nor for effects with a hysteresis state or proportional to an acceleration.
    fn acts_between(&self) -> bool {
        false
    }

    /// Returns the parameters; the effect vanishes if the first is at its null value.
    fn parameters(&self) -> &'static [EffectParameter];

    /// Returns the number of states; a diagnosis does not consider effects with more than eight.
    fn states(&self) -> usize {
        0
    }

    /// Returns the number of values of the hysteresis state; the first is the output.
    fn hysteresis_states(&self) -> usize {
        0
    }

    /// Returns the dimensions of the initial values that an experiment leaves free because they matter. They are those
    /// of all states, or of the output of an effect with a hysteresis state. A dimensionless one is a fraction of a
    /// limit, between -1 and 1.
    fn free_starts(&self) -> &'static [Dimension] {
        &[]
    }

    /// Returns true if the value that the effect passes on is a staircase.
    fn is_staircase(&self) -> bool {
        self.parameters().iter().any(|parameter| matches!(parameter.grid, InitialGrid::Steps))
    }

    /// Returns true if the value that the effect passes on depends on the way to it, as that of a play or a rate limit.
    fn is_path_dependent(&self) -> bool {
        self.hysteresis_states() > 0
            && self.ports().iter().any(|port| matches!(port, PortKind::Actuator | PortKind::Sensor))
    }

    /// Returns true if the effect can act on the value that another one passes on: the stairs of a staircase end no
    /// step of a simulation, so that the way from one to the next is not known.
    fn can_follow(&self, before: &dyn Effect) -> bool {
        !(before.is_staircase() && self.is_path_dependent())
    }

    /// Returns true if the effect needs the acceleration because its force is proportional to it.
    fn is_inertial(&self) -> bool {
        false
    }

    /// Returns true if the effect occurs once, in one experiment.
    fn is_one_off(&self) -> bool {
        false
    }

    /// Returns true if the effect is periodic over the turn of an angle, in rad: a position or signal in m or V has
    /// none.
    fn is_over_a_turn(&self) -> bool {
        false
    }

    /// Returns true if the effect is an exact sum of other effects of the catalogue. A diagnosis then looks for these,
    /// so that one model has one name.
    fn is_sum(&self) -> bool {
        false
    }

    /// Returns the characteristic of a place that the effect is; a place has each once at most.
    fn characteristic(&self) -> Option<Characteristic> {
        None
    }

    /// Returns the term of the declared model that the effect modifies or acts beside; without that term it is no
    /// candidate.
    fn modifies(&self) -> Option<DeclaredTerm> {
        None
    }

    /// Returns the rarity of the effect. Between effects that explain the data equally well, the smaller number is more
    /// plausible to a physicist.
    fn rarity(&self) -> u8 {
        1
    }

    /// Returns the effect at the given parameters.
    fn bind(&self, parameters: &[f64]) -> Box<dyn BoundEffect<f64>>;

    /// Returns the effect with tangents, at parameters with tangents.
    fn bind_dual(&self, parameters: &[Dual7]) -> Box<dyn BoundEffect<Dual7>>;
}

/// An effect at a place of a model.
#[derive(Clone)]
pub struct Placement {
    /// Name of the effect in the model; its parameters are called `name.parameter`.
    pub name: String,
    /// The effect.
    pub effect: Arc<dyn Effect>,
    /// Port that the effect acts at.
    pub port: Port,
    /// Second port, if the effect needs one.
    pub companion: Option<Port>,
}
