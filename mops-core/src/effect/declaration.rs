//! Declaration of an effect: its class, parameters and terms.

use serde::Serialize;

use super::port::Port;

/// Physical class of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EffectClass {
    /// Dissipates energy: friction, drag, losses.
    Dissipative,
    /// Stores energy: springs, stops, play.
    Elastic,
    /// Acts through weight: tilt, imbalance.
    Gravity,
    /// Inertia: mass and attached bodies.
    Inertial,
    /// Constant offset.
    Bias,
    /// Factor, or another static characteristic.
    Gain,
    /// Delay or lag.
    DelayLike,
    /// Periodic in position or time.
    Periodic,
    /// Depends on time.
    TimeVarying,
    /// Flow of matter or heat into or out of a store.
    Flow,
}

impl EffectClass {
    /// Returns the name of the class in results.
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

/// Kind of port that an effect acts at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PortKind {
    /// [`Port::Joint`]: a force against a coordinate of second order.
    Joint,
    /// [`Port::Speed`]: a force against a speed without a position.
    Speed,
    /// [`Port::Process`] of a state that is no speed: a rate.
    Process,
    /// [`Port::Actuator`].
    Actuator,
    /// [`Port::Sensor`].
    Sensor,
}

impl PortKind {
    /// Returns the name of the kind, the prefix of places.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Speed => "speed",
            Self::Process => "process",
            Self::Actuator => "actuator",
            Self::Sensor => "sensor",
        }
    }
}

impl Port {
    /// Returns the kind of the port; `None` for the equation of a speed, which its [`Port::Joint`] or [`Port::Speed`]
    /// represents.
    pub fn kind(&self, ports: &[Self]) -> Option<PortKind> {
        match self {
            Self::Joint { .. } => Some(PortKind::Joint),
            Self::Speed { .. } => Some(PortKind::Speed),
            Self::Process { state, .. } => {
                let is_force = |port: &Self| match port {
                    Self::Joint { velocity: speed, .. } | Self::Speed { state: speed, .. } => speed == state,
                    _ => false,
                };
                (!ports.iter().any(is_force)).then_some(PortKind::Process)
            }
            Self::Actuator { .. } => Some(PortKind::Actuator),
            Self::Sensor { .. } => Some(PortKind::Sensor),
        }
    }
}

/// Unit of an effect parameter, as powers of the units at its place.
///
/// `output` is the unit of the term that the effect adds. The term is a force, torque or flow in an equation. At an
/// actuator it has the unit of the input, at a sensor that of the signal. `position` and `speed` are the units of the
/// joint; at a process, of the state and its rate. `value` is the unit of the input or signal, `time` is s. The second
/// port provides `position` and `speed` at an actuator or sensor, and `value` at a joint or process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    /// Power of the unit of the added term.
    pub output: i8,
    /// Power of the unit of the position.
    pub position: i8,
    /// Power of the unit of the speed.
    pub speed: i8,
    /// Power of the unit of the input or signal.
    pub value: i8,
    /// Power of the unit of the time.
    pub time: i8,
}

impl Dimension {
    /// Dimensionless.
    pub const ONE: Self = Self { output: 0, position: 0, speed: 0, value: 0, time: 0 };
    /// Unit of the term that the effect adds.
    pub const OUTPUT: Self = Self { output: 1, ..Self::ONE };
    /// Unit of the position.
    pub const POSITION: Self = Self { position: 1, ..Self::ONE };
    /// Unit of the speed.
    pub const SPEED: Self = Self { speed: 1, ..Self::ONE };
    /// Unit of the input or signal.
    pub const VALUE: Self = Self { value: 1, ..Self::ONE };
    /// Unit of the time, s.
    pub const TIME: Self = Self { time: 1, ..Self::ONE };
    /// Unit of a rate, 1/s.
    pub const PER_TIME: Self = Self { time: -1, ..Self::ONE };

    /// Returns `self` divided by `other`.
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

    /// Returns `self` raised to a power.
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

/// Initial grid of an effect parameter, evaluated before any fit.
///
/// The grid is relative to the trajectories and needs no knowledge of the plant. The typical size of a parameter is the
/// product of the typical sizes at its place, raised to the powers of its [`Dimension`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialGrid {
    /// Single value: the added term is proportional to the parameter, and regression determines the factor.
    Linear,
    /// Multiples of the typical size.
    Scaled(&'static [f64]),
    /// Relative positions between the smallest and the largest position (of a process: state; of an actuator or sensor:
    /// value).
    Within(&'static [f64]),
    /// The zero of the temperature scale in which the state is declared; without one, these values.
    Zeros(&'static [f64]),
    /// Relative positions as in [`InitialGrid::Within`], and the centre of a dead band visible in the samples of a
    /// sensor.
    WithinAndGap(&'static [f64]),
    /// Multiples of the typical size, and half the width of a dead band visible in the samples of a sensor.
    ScaledAndGap(&'static [f64]),
    /// Relative positions between the smallest and the largest magnitude of a value.
    WithinSize(&'static [f64]),
    /// Fractions of the largest slew rate of a command, then multiples of the typical size.
    SlewAndScaled(&'static [f64], &'static [f64]),
    /// Listed values.
    Plain(&'static [f64]),
    /// Listed values of a parameter with discontinuous response, such as a break-away force.
    Jumps(&'static [f64]),
    /// Listed values, then multiples of the typical size: periods per turn, and along a rail.
    PlainAndScaled(&'static [f64], &'static [f64]),
    /// Frequencies in rad/s that the record can resolve: at least two thirds of a period in the record, at most 160
    /// periods or four samples per period. Each is above the one before by at least this share: a resonance of damping
    /// ratio d is 2 d times its frequency wide.
    Frequencies(f64),
    /// Quantisation steps: the largest value divided by the number of steps, from one step on. Neighbouring candidates
    /// differ by one step in about every eighth sample.
    Steps,
    /// Times within the record, as fractions of its length.
    Moments(&'static [f64]),
}

impl InitialGrid {
    /// Returns true if the residuals are discontinuous in the parameter, so that gradients carry no information.
    /// Examples: quantisation steps, the width of a dead band, a break-away force.
    pub fn jumps(&self) -> bool {
        matches!(self, Self::Steps | Self::ScaledAndGap(_) | Self::Jumps(_))
    }
}

/// Kind of an effect parameter. It decides which values are plausible before data are seen, and what data must show for
/// the parameter to be identifiable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// Magnitude; the effect vanishes at its null value.
    Strength,
    /// Magnitude of a contact or an edge, of which data often show only that it is large.
    Steepness,
    /// Shape, such as an exponent or a characteristic speed.
    Shape,
    /// Displacement over which a force builds up, or speed over which it falls. If the motion passes it in a fraction
    /// of a sample, data do not show how small it is.
    BuildUp,
    /// Value in the range visited at the place, such as the neutral position of a spring.
    Level,
    /// Value below which a stop acts: above it, part of the range visited is free of it.
    LowerEdge,
    /// Value above which a stop or an overflow acts: below it, part of the range visited is free of it.
    UpperEdge,
    /// Absolute temperature at the zero of the scale of the place: 273.15 for degC.
    Zero,
    /// Damping of a contact divided by its stiffness: shorter than the time in which the place moves, else the contact
    /// is a damper.
    Damping,
    /// Angle of a periodic function.
    Phase,
    /// Wave number along a position: 2 pi divided by the period.
    WaveNumber,
    /// Angular frequency.
    Frequency,
    /// Time in an experiment.
    Instant,
    /// Duration of an event.
    Duration,
}

impl ParameterKind {
    /// Returns true for a value that the place itself may have, on a temperature scale its temperature.
    #[must_use]
    pub fn is_value(self) -> bool {
        matches!(self, Self::Level | Self::LowerEdge | Self::UpperEdge)
    }

    /// Returns true for an edge, beyond which a stop or an overflow acts.
    #[must_use]
    pub fn is_edge(self) -> bool {
        matches!(self, Self::LowerEdge | Self::UpperEdge)
    }
}

/// Term of the declared model that an effect modifies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeclaredTerm {
    /// Force that depends on the position of the joint or, for an effect between two joints, on that of the other.
    Spring,
    /// Spring or damper between two joints: equal and opposite forces that depend on their relative position or speed.
    Coupling,
}

/// Characteristic that a place has once at most: effects of one characteristic exclude each other there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Characteristic {
    /// Friction at and about rest.
    Friction,
    /// Lag of an actuator or a sensor.
    Lag,
    /// Dead band of a sensor.
    DeadBand,
    /// Stops at which a motion ends: a record shows them only where the motion turns back or comes to rest.
    Stops,
}

/// Scope of an effect parameter: the plant or a single experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Shared by all experiments.
    Study,
    /// Separate value in each experiment, such as a phase.
    Experiment,
}

/// A parameter of an effect: a magnitude or a shape parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Name, such as `torque`.
    pub name: &'static str,
    /// Description in one line.
    pub about: &'static str,
    /// Kind.
    pub kind: ParameterKind,
    /// Unit.
    pub dimension: Dimension,
    /// Null value, 0 or infinity, at which the effect vanishes; `None` for a shape parameter.
    pub null_value: Option<f64>,
    /// Smallest and largest physically possible value.
    pub bounds: [f64; 2],
    /// Initial grid.
    pub grid: InitialGrid,
    /// Scope: the study or a single experiment.
    pub scope: Scope,
    /// True if the parameter keeps its grid value, such as an integer number of periods per turn.
    pub fixed: bool,
    /// Multiples of the typical size for restarts of a stuck fit, at every shape in the grid. A contact that starts too
    /// soft would act over the whole motion. If empty, the fit restarts from one and two times the estimate.
    pub restarts: &'static [f64],
    /// Names of the simpler effects that the effect is where the parameter is at the lower, and at the upper end of the
    /// values that are possible or that records can show: Stribeck friction without a rise is Coulomb friction.
    pub simpler: [&'static [&'static str]; 2],
}

impl EffectParameter {
    /// Creates a non-negative factor of the added term, with the null value 0: the strength, which only the first
    /// parameter of an effect is. At its null value the effect vanishes to the last bit, whatever the others are.
    pub const fn positive(name: &'static str, about: &'static str, dimension: Dimension) -> Self {
        Self {
            name,
            about,
            kind: ParameterKind::Strength,
            dimension,
            null_value: Some(0.0),
            bounds: [0.0, f64::INFINITY],
            grid: InitialGrid::Linear,
            scope: Scope::Study,
            fixed: false,
            restarts: &[],
            simpler: [&[]; 2],
        }
    }

    /// Creates a factor of the added term of either sign, with the null value 0; only the first parameter of an effect
    /// is one.
    pub const fn signed(name: &'static str, about: &'static str, dimension: Dimension) -> Self {
        Self { bounds: [f64::NEG_INFINITY, f64::INFINITY], ..Self::positive(name, about, dimension) }
    }

    /// Creates a shape parameter; it has no influence if the first parameter is at its null value.
    pub const fn shape(
        name: &'static str,
        about: &'static str,
        dimension: Dimension,
        bounds: [f64; 2],
        grid: InitialGrid,
    ) -> Self {
        let kind = match grid {
            InitialGrid::Within(_) | InitialGrid::WithinAndGap(_) | InitialGrid::WithinSize(_) => ParameterKind::Level,
            InitialGrid::Frequencies(_) => ParameterKind::Frequency,
            _ => ParameterKind::Shape,
        };
        Self { kind, bounds, grid, null_value: None, ..Self::positive(name, about, dimension) }
    }

    /// Sets another kind.
    #[must_use]
    pub const fn of_kind(mut self, kind: ParameterKind) -> Self {
        self.kind = kind;
        self
    }

    /// Sets another initial grid.
    #[must_use]
    pub const fn with_grid(mut self, grid: InitialGrid) -> Self {
        self.grid = grid;
        self
    }

    /// Sets another null value.
    #[must_use]
    pub const fn null_at(mut self, null_value: f64) -> Self {
        self.null_value = Some(null_value);
        self
    }

    /// Sets other bounds. A diagnosis discards an effect whose first parameter is estimated at a finite bound other
    /// than the null value, except at actuators. Such an estimate indicates a mistake, not an effect.
    #[must_use]
    pub const fn within(mut self, low: f64, high: f64) -> Self {
        self.bounds = [low, high];
        self
    }

    /// Makes the parameter separate in each experiment.
    #[must_use]
    pub const fn per_experiment(mut self) -> Self {
        self.scope = Scope::Experiment;
        self
    }

    /// Makes the parameter the steepness of a contact or an edge, with the multiples of the typical size from which a
    /// stuck fit is restarted.
    #[must_use]
    pub const fn restarted_from(mut self, multiples: &'static [f64]) -> Self {
        self.kind = ParameterKind::Steepness;
        self.restarts = multiples;
        self
    }

    /// Names the simpler effects that the effect is where the parameter is at its lower end.
    #[must_use]
    pub const fn least_is(mut self, simpler: &'static [&'static str]) -> Self {
        self.simpler[0] = simpler;
        self
    }

    /// Names the simpler effects that the effect is where the parameter is at its upper end.
    #[must_use]
    pub const fn most_is(mut self, simpler: &'static [&'static str]) -> Self {
        self.simpler[1] = simpler;
        self
    }

    /// Fixes the parameter at its grid value.
    #[must_use]
    pub const fn kept(mut self) -> Self {
        self.fixed = true;
        self
    }
}
