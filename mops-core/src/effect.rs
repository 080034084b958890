//! Effects: what a model may lack at one of its ports, each with strengths that can be neutral.

use std::sync::Arc;

use serde::Serialize;

use crate::port::Port;
use crate::scalar::{Along, Scalar};

/// What sort of physics an effect is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EffectClass {
    /// Takes energy: friction, drag, losses.
    Dissipative,
    /// Stores it: springs, stops, play.
    Elastic,
    /// Weight: tilt, imbalance.
    Gravity,
    /// Mass and what hangs on it.
    Inertial,
    /// A constant.
    Bias,
    /// A factor, or another static curve.
    Gain,
    /// Comes late.
    DelayLike,
    /// Repeats over position or time.
    Periodic,
    /// Depends on time.
    TimeVarying,
    /// A stream of matter or heat into or out of a store.
    Flow,
}

impl EffectClass {
    /// Its name, as results spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dissipative => "dissipative",
            Self::Elastic => "elastic",
            Self::Gravity => "gravity",
            Self::Inertial => "inertial",
            Self::Bias => "bias",
            Self::Gain => "gain",
            Self::DelayLike => "delay-like",
            Self::Periodic => "periodic",
            Self::TimeVarying => "time-varying",
            Self::Flow => "flow",
        }
    }
}

/// The sort of port that an effect acts at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PortKind {
    /// [`Port::Joint`]: a force against a coordinate of second order.
    Joint,
    /// [`Port::Process`] of a state that is no speed of a joint: a rate.
    Process,
    /// [`Port::Actuator`].
    Actuator,
    /// [`Port::Sensor`].
    Sensor,
}

impl PortKind {
    /// Its name, as places begin with it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Process => "process",
            Self::Actuator => "actuator",
            Self::Sensor => "sensor",
        }
    }
}

impl Port {
    /// Its sort; `None` for the equation of a joint's speed, which its [`Port::Joint`] stands for.
    pub fn kind(&self, ports: &[Self]) -> Option<PortKind> {
        match self {
            Self::Joint { .. } => Some(PortKind::Joint),
            Self::Process { state, .. } => {
                let of_joint = |port: &Self| matches!(port, Self::Joint { velocity, .. } if velocity == state);
                (!ports.iter().any(of_joint)).then_some(PortKind::Process)
            }
            Self::Actuator { .. } => Some(PortKind::Actuator),
            Self::Sensor { .. } => Some(PortKind::Sensor),
        }
    }
}

/// The unit of a strength, as powers of the units at its place.
///
/// `output` is what the effect adds: a force, torque or flow in the equation, the unit of the input at an actuator, of the
/// signal at a sensor. `position` and `speed` are those of the joint (at a process: of the state and its rate), `value` that
/// of the input or signal, `time` is s. Of a companion are the position and speed at an actuator or sensor, and the value at
/// a joint or process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    /// Power of what it adds.
    pub output: i8,
    /// Power of the position.
    pub position: i8,
    /// Power of the speed.
    pub speed: i8,
    /// Power of the value that passes.
    pub value: i8,
    /// Power of the time.
    pub time: i8,
}

impl Dimension {
    /// No unit.
    pub const ONE: Self = Self { output: 0, position: 0, speed: 0, value: 0, time: 0 };
    /// What the effect adds.
    pub const OUTPUT: Self = Self { output: 1, ..Self::ONE };
    /// A position.
    pub const POSITION: Self = Self { position: 1, ..Self::ONE };
    /// A speed.
    pub const SPEED: Self = Self { speed: 1, ..Self::ONE };
    /// An input or a signal.
    pub const VALUE: Self = Self { value: 1, ..Self::ONE };
    /// A time.
    pub const TIME: Self = Self { time: 1, ..Self::ONE };
    /// A rate, 1/s.
    pub const PER_TIME: Self = Self { time: -1, ..Self::ONE };

    /// `self` over `other`.
    #[must_use]
    pub const fn over(self, other: Self) -> Self {
        Self {
            output: self.output - other.output,
            position: self.position - other.position,
            speed: self.speed - other.speed,
            value: self.value - other.value,
            time: self.time - other.time,
        }
    }

    /// `self` to a power.
    #[must_use]
    pub const fn power(self, n: i8) -> Self {
        Self {
            output: self.output * n,
            position: self.position * n,
            speed: self.speed * n,
            value: self.value * n,
            time: self.time * n,
        }
    }
}

/// The values of a strength that are tried before anything is fitted.
///
/// They are relative to what the trajectories show, so that they need no knowledge of the plant: the typical size of a
/// strength is the product of the typical sizes at its place to the powers of its [`Dimension`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trials {
    /// What the effect adds is proportional to it: one value will do, and regression finds the factor.
    Linear,
    /// These multiples of its typical size.
    Scaled(&'static [f64]),
    /// These places between the smallest and the largest position (of a process: state; of an actuator or sensor: value).
    Within(&'static [f64]),
    /// The same, and the middle of a gap that samples show at a sensor.
    WithinAndGap(&'static [f64]),
    /// These multiples of its typical size, and half the width of a gap that samples show at a sensor.
    ScaledAndGap(&'static [f64]),
    /// These places between the smallest and the largest size of a value, whatever its sign.
    WithinSize(&'static [f64]),
    /// These shares of the largest slew rate of a command, then these multiples of its typical size.
    SlewAndScaled(&'static [f64], &'static [f64]),
    /// These values.
    Plain(&'static [f64]),
    /// These values, of a strength at whose changes samples jump: a level at which what stands still breaks away.
    Jumps(&'static [f64]),
    /// These values, then these multiples of its typical size: periods in a turn, and along a rail.
    PlainAndScaled(&'static [f64], &'static [f64]),
    /// Frequencies in rad/s that the record can resolve: from two thirds of a period in the record to 160 periods, or four samples
    /// a period.
    Frequencies,
    /// Sizes of steps: the largest value over numbers of steps from one on, so close together that about every eighth sample of a
    /// neighbour is a step off.
    Steps,
    /// Times within the record, at these shares of its length.
    Moments(&'static [f64]),
}

impl Trials {
    /// Whether no slope tells the strength, as samples that it moves jump: sizes of steps, the width of a gap, a level at which
    /// what stands still breaks away.
    pub fn jumps(&self) -> bool {
        matches!(self, Self::Steps | Self::ScaledAndGap(_) | Self::Jumps(_))
    }
}

/// Whether a strength belongs to the plant or to one experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The same in all experiments.
    Study,
    /// Its own in each experiment: a phase.
    Experiment,
}

/// A number that says how strong an effect is, or what shape it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// Name, such as `torque`.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Its unit.
    pub dimension: Dimension,
    /// The value at which the effect is not there, 0 or infinity; `None` for a shape, which has none.
    pub neutral: Option<f64>,
    /// Smallest and largest value that physics allows.
    pub bounds: [f64; 2],
    /// Values that are tried first.
    pub trials: Trials,
    /// What it belongs to.
    pub scope: Scope,
    /// Whether it stays at the value that was tried: a whole number of periods in a turn.
    pub fixed: bool,
    /// Multiples of its typical size from which a fit is restarted, at every shape tried, where one from nothing has stuck: a
    /// contact that is soft at first spreads over the whole motion. Empty: restarted from once and twice what was found.
    pub restarts: &'static [f64],
}

impl Strength {
    /// A factor of what the effect adds: neutral at 0, at least 0.
    pub const fn positive(name: &'static str, about: &'static str, dimension: Dimension) -> Self {
        Self {
            name,
            about,
            dimension,
            neutral: Some(0.0),
            bounds: [0.0, f64::INFINITY],
            trials: Trials::Linear,
            scope: Scope::Study,
            fixed: false,
            restarts: &[],
        }
    }

    /// A factor of what the effect adds: neutral at 0, of either sign.
    pub const fn signed(name: &'static str, about: &'static str, dimension: Dimension) -> Self {
        Self { bounds: [f64::NEG_INFINITY, f64::INFINITY], ..Self::positive(name, about, dimension) }
    }

    /// A shape: it vanishes with the first strength.
    pub const fn shape(
        name: &'static str,
        about: &'static str,
        dimension: Dimension,
        bounds: [f64; 2],
        trials: Trials,
    ) -> Self {
        Self { bounds, trials, neutral: None, ..Self::positive(name, about, dimension) }
    }

    /// With other trials.
    #[must_use]
    pub const fn tried(mut self, trials: Trials) -> Self {
        self.trials = trials;
        self
    }

    /// With another neutral value.
    #[must_use]
    pub const fn neutral_at(mut self, neutral: f64) -> Self {
        self.neutral = Some(neutral);
        self
    }

    /// With other bounds. A diagnosis does not tell an effect whose first strength the data press against an end that is finite
    /// and not neutral, but at actuators: there it is a mistake, not an effect.
    #[must_use]
    pub const fn within(mut self, low: f64, high: f64) -> Self {
        self.bounds = [low, high];
        self
    }

    /// Of its own in each experiment.
    #[must_use]
    pub const fn per_experiment(mut self) -> Self {
        self.scope = Scope::Experiment;
        self
    }

    /// Restarted from these multiples of its typical size where a fit from nothing has stuck.
    #[must_use]
    pub const fn restarted_from(mut self, multiples: &'static [f64]) -> Self {
        self.restarts = multiples;
        self
    }

    /// Kept at the value that was tried.
    #[must_use]
    pub const fn kept(mut self) -> Self {
        self.fixed = true;
        self
    }
}

/// What an effect sees at its place.
#[derive(Debug, Clone, Copy)]
pub struct At<'a, S> {
    /// Time, s.
    pub t: f64,
    /// At an actuator the command, at a sensor the signal, before the effect; 0 elsewhere.
    pub value: S,
    /// Position of the joint; at a process the state; else `value`.
    pub q: S,
    /// Speed of the joint; else 0.
    pub v: S,
    /// Acceleration of the joint without the effect, for those that ask ([`Effect::is_inertial`]); else 0.
    pub a: S,
    /// What a unit force adds to the acceleration, likewise.
    pub mobility: S,
    /// At the companion: the position of a joint, a state, an input, a signal; 0 without one.
    pub other: S,
    /// The speed of the companion, if it is a joint.
    pub other_speed: S,
    /// The inputs as they reach the plant.
    pub u: &'a [S],
    /// Whether the contact of the effect is closed, as a simulation holds it throughout a step; `None` where there is no
    /// contact, or the sign of [`Acting::gap`] is to tell.
    pub closed: Option<bool>,
}

/// Dry friction: the kernel finds out whether the joint sticks.
#[derive(Debug, Clone, Copy)]
pub struct DryFriction<S> {
    /// Force against forward and backward motion while it slides, at the present speed; not negative.
    pub sliding: [S; 2],
    /// Force up to which a joint at rest sticks against being moved forward and backward; at least that of sliding there.
    pub limit: [S; 2],
}

/// An effect at given strengths.
pub trait Acting<S: Scalar> {
    /// Writes the start values of its states, where nothing else is known of them.
    fn start(&self, _at: &At<'_, S>, _z: &mut [S]) {}

    /// Writes the rates of its states.
    fn rates(&self, _at: &At<'_, S>, _z: &[S], _dz: &mut [S]) {}

    /// At a joint or a process: what is added to the right-hand side of the equation, positive forward. At an actuator: the
    /// input that reaches the plant. At a sensor: what is measured.
    fn value(&self, at: &At<'_, S>, z: &[S]) -> S;

    /// At a joint or process whose companion is one too: what is added to the companion's equation.
    fn onward(&self, _at: &At<'_, S>, _z: &[S]) -> S {
        S::from(0.0)
    }

    /// Dry friction on top of [`Acting::value`], at a joint.
    fn friction(&self, _at: &At<'_, S>, _z: &[S]) -> Option<DryFriction<S>> {
        None
    }

    /// How far a contact at a joint is open; negative while it is closed. It depends on positions and speeds alone, and an
    /// effect has it throughout a simulation or never. A simulation ends a step where it changes sign, and tangents account
    /// for that moment; within a step [`At::closed`] says which law holds, also a little beyond the change.
    fn gap(&self, _at: &At<'_, S>) -> Option<S> {
        None
    }

    /// The time by which an actuator or a sensor comes late, s.
    fn delay(&self) -> Option<S> {
        None
    }

    /// Times at which it changes its form: steps end there, s.
    fn breaks(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Longest step within which what it does by itself is well resolved, s.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Longest step in which an explicit method damps what decays in it by itself, s.
    fn damped_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Moves what is remembered from one moment to the next ([`Effect::memory`]), NaN before the first: at an actuator
    /// whenever the command jumps or changes its slope, before and after it, at a sensor along the simulation.
    fn remember(&self, _at: &At<'_, S>, _memory: &mut [S]) {}

    /// As [`Acting::value`] for an effect that remembers.
    fn recall(&self, at: &At<'_, S>, _memory: &[S]) -> S {
        self.value(at, &[])
    }
}

/// A physical effect that a model may lack.
pub trait Effect: Send + Sync {
    /// Name in study files and results.
    fn name(&self) -> &'static str;

    /// What it is, in one sentence.
    fn about(&self) -> &'static str;

    /// Its formula, for people.
    fn formula(&self) -> &'static str;

    /// Where the formula comes from.
    fn source(&self) -> &'static str;

    /// Its class.
    fn class(&self) -> EffectClass;

    /// The effect in a wider sense that it is a form of: of backlash, play in a coupling.
    fn form_of(&self) -> Option<&'static str> {
        None
    }

    /// Ports that it acts at.
    fn ports(&self) -> &'static [PortKind];

    /// The sort of a second place that it needs: where drag comes from, a sensor that talks across.
    fn companion(&self) -> Option<PortKind> {
        None
    }

    /// Whether it is the same with its place and its companion exchanged.
    fn mutual(&self) -> bool {
        false
    }

    /// Its strengths; the first is the one that makes it vanish.
    fn strengths(&self) -> &'static [Strength];

    /// Number of its states; one that has more than eight is no candidate of a diagnosis.
    fn states(&self) -> usize {
        0
    }

    /// Number of values that it remembers from one moment to the next; the first of them is what it let through.
    fn memory(&self) -> usize {
        0
    }

    /// Dimensions of the start values that an experiment leaves free as they matter: those of all its states, or that of what
    /// an effect with a memory lets through. One without unit is a share of a limit, between -1 and 1.
    fn free_starts(&self) -> &'static [Dimension] {
        &[]
    }

    /// Whether it asks for the acceleration: its force is proportional to it.
    fn is_inertial(&self) -> bool {
        false
    }

    /// Whether it happens once, in one experiment.
    fn is_one_off(&self) -> bool {
        false
    }

    /// Which of two effects that explain the data equally well a physicist thinks of first: the smaller number.
    fn rarity(&self) -> u8 {
        1
    }

    /// The effect at these strengths.
    fn act(&self, strengths: &[f64]) -> Box<dyn Acting<f64>>;

    /// The same with tangents.
    fn act_along(&self, strengths: &[Along]) -> Box<dyn Acting<Along>>;
}

/// An effect at a place of a model.
#[derive(Clone)]
pub struct Placement {
    /// Its name in the model: its strengths are the parameters `name.strength`.
    pub name: String,
    /// The effect.
    pub effect: Arc<dyn Effect>,
    /// The port that it acts at.
    pub port: Port,
    /// A second port, where the effect needs one.
    pub companion: Option<Port>,
}
