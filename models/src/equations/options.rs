//! Options of `[models.NAME.equations]` in a study file.

use mops_language::{
    Quantity,
    entries::{Entries, Short},
};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

use crate::kernel::Tolerance;

/// Plant model given by its equations, almost as written on paper:
///
/// ```text
/// [models.rig.equations]
/// states     = { th = "rad", w = "rad/s" }
/// inputs     = { u = "N m" }
/// parameters = { J = "kg m2", b = "N m s/rad" }
/// constants  = { m = "0.2 kg", g = "9.81 m/s^2", l = "0.3 m" }
/// der        = { th = "w", w = "J*w' = u - m*g*l*sin(th) - b*w" }
/// ```
///
/// A derivative is an expression, or an equation with `=` that contains `w'` (or `der(w)`), the derivative of `w`.
/// Equations may contain several derivatives, each to the first power; they are solved together, as with a mass matrix.
///
/// Expressions may contain `+ - * / ^`, parentheses, `pi` and `time` (s).
/// Smooth functions: `sin cos tan asin acos atan atan2(y, x) sinh cosh tanh exp ln log10 sqrt`.
/// Functions with kinks or jumps: `abs sign min max clip(x, low, high) deadzone(x, low, high)`.
/// `table(x, x1, y1, x2, y2, ..)` is piecewise linear through points. `if(condition, a, b)` takes conditions of
/// `> >= < <=`, `and`, `or`, `not`. A step of the integrator ends where a function with kinks or jumps, a table or an
/// `if` changes its branch. So no step crosses a kink or a jump.
///
/// `tables.torque = { file = "motor.csv", x = "speed", y = "torque" }` makes `torque(w)` a lookup table, linear or a
/// monotone spline between its points; `eta(w, T)` has two arguments.
///
/// `delay(x, "50 ms")` is the value of `x` at an earlier time; `x` is any expression, and before the start it is
/// constant. The time is a quantity, or an expression of parameters and constants. A step ends where a jump of `x` or
/// of its derivatives arrives.
///
/// Expressions use coherent SI units for all quantities, whatever unit they are declared in, and their dimensions are
/// checked. A number in a product is a pure number. A number that is a whole term has the SI unit of the other terms.
/// If one of these is declared in another unit, the number needs its own unit: `20 [degC]`. A quantity declared in `""`
/// has the unit that the equations require; one in `"1"` is a pure number. Hz counts cycles: `sin(2*pi*f*time)`.
/// Temperatures are in K.
///
/// A family of states is declared as `"T[1..100]" = "K"`. `"T[i]" = "k*(T[i-1] - 2*T[i] + T[i+1])"` gives the
/// derivatives of all members without an equation of their own; `"T[i=2..99]"` gives those of members 2 to 99. `let`,
/// `start`, `inputs` and `parameters` also accept families.
///
/// Signals are the states, the outputs and the inputs. The initial value of `th` is the parameter `th0`, 0 by default.
///
/// A clock samples the plant at fixed instants, as the program of a sampled controller does:
///
/// ```text
/// [models.rig.equations.clocks]
/// control = { every = "10 ms", delay = "2 ms", memory = { u = "N m", i = "rad" }, next = { i = "i + e", u = "k*e + ki*i" } }
/// ```
///
/// At the instants `offset + k every`, the values `next` are computed from the states and memory just before, and the
/// inputs then; the memory takes them after `delay`, and is constant in between. Clocks that are due at the same
/// instant read the same values. A memory is a signal and has an initial value, like a state. `next = { y_k = "y" }`
/// keeps a sample of `y`. A controller may also be given by its transfer function, in z or in s:
/// `filter = { u = { of = "r - y", continuous = { numerator = ["k*Ti", "k"], denominator = ["Ti", 0] }, method = "tustin", prewarp = "5 Hz" } }`; its memory is added.
///
/// `pid.u = { setpoint = "r", measured = "y", k = "k", Ti = "Ti" }` is a PID controller, continuous or sampled, whose
/// output takes the place of the input `u`.
///
/// A state whose derivative is another state, such as `th` above, is a joint. Its friction is given as
/// `friction.th = { coulomb = "c" }`; a stuck joint is exactly at rest. The places of possible missing effects are
/// the joints, the equations of the states, the inputs and the signals.
///
/// The linearisation of a model with clocks is its discrete equivalent, for inputs that are constant between the
/// instants of the slowest clock. A loop is cut with `open` at the memory of the slowest clock, or at an expression of
/// `let` that depends on it only.
///
/// Source: F. Cellier, E. Kofman, Continuous System Simulation (2006), chapters 7 (sorting and solving equations) and 9
/// (discontinuities); A. Bellen, M. Zennaro, Numerical Methods for Delay Differential Equations (2003), section 3.2.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EquationsOptions {
    /// States and their units: `th = "rad"`, `"T[1..100]" = "K"`; or a table with `unit`, `scale`, `about`.
    pub(super) states: Entries<Short<StateOptions>>,
    /// Inputs and their units. An input is 0 unless a case or an experiment gives it.
    #[serde(default)]
    pub(super) inputs: Entries<Short<Described>>,
    /// Parameters and their units: `b = "N m s/rad"`, or a table with `unit`, `default`, `min`, `max`, `about`. The
    /// unit `""` means the unit that the equations require.
    #[serde(default)]
    pub(super) parameters: Entries<Short<Settable>>,
    /// Constants: `g = "9.81 m/s^2"`. A constant without a unit has the unit that the equations require.
    #[serde(default)]
    pub(super) constants: Entries<Quantity>,
    /// Named expressions, in any order: `s = "sin(th)"`.
    #[serde(default, rename = "let")]
    pub(super) definitions: Entries<Formula>,
    /// Derivatives: an expression, `th = "w"`, or an equation that contains derivatives, `w = "J*w' = u - b*w"`.
    pub(super) der: Entries<Formula>,
    /// Mass matrix, if `der` gives forces. `"w,w" = "J"` is the factor of the derivative of `w` (second) in the
    /// equation of `w` (first). Rows that are not given are those of the identity matrix.
    #[serde(default)]
    pub(super) mass: Entries<Formula>,
    /// Further signals: `height = "l*cos(th)"`, or a table with `value`, `unit`, `about`.
    #[serde(default)]
    pub(super) outputs: Entries<Short<Output>>,
    /// Initial values of states: numbers, in the unit of the state unless they have their own, or expressions of
    /// parameters.
    #[serde(default)]
    pub(super) start: Entries<Formula>,
    /// Friction of joints, by their position or speed.
    #[serde(default)]
    pub(super) friction: Entries<Friction>,
    /// Events: `bounce = { guard = "h", reset = { v = "-e*v" }, at-rest = { h = 0, v = 0 } }` occurs when `h` becomes
    /// negative.
    #[serde(default)]
    pub(super) when: Entries<When>,
    /// Clocks that sample the model at fixed instants: `control = { every = "10 ms", memory = { u = "V" }, next = { u =
    /// "-k*x" } }`.
    #[serde(default)]
    pub(super) clocks: Entries<Clock>,
    /// PID controllers: `pid.u = { setpoint = "r", measured = "y", k = "k", Ti = "Ti", limit = ["-24 V", "24 V"] }`
    /// computes `u`, in place of the input `u` if there is one.
    #[serde(default)]
    pub(super) pid: Entries<Pid>,
    /// Lookup tables, used as functions in expressions: `torque = { file = "motor.csv", x = "speed", y = "torque" }`.
    #[serde(default)]
    pub(super) tables: Entries<Table>,
    /// Names of joints as places of effects: `arm = { joint = "phi" }`. Default: the name of the position.
    #[serde(default)]
    pub(super) ports: Entries<PortName>,
    /// End of the simulation, unless an experiment gives it.
    pub(super) horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    #[serde(default)]
    pub(super) tolerance: Tolerance,
}

/// Unit and description of a quantity.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Described {
    /// Unit.
    pub unit: String,
    /// Description, in one line.
    pub about: Option<String>,
}

impl From<String> for Described {
    fn from(unit: String) -> Self {
        Self { unit, about: None }
    }
}

/// Unit, typical size and description of a state.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StateOptions {
    /// Unit.
    pub unit: String,
    /// Typical size, positive: error tolerances are relative to it while the state is near 0. Default: the largest
    /// absolute value that the state has reached.
    pub scale: Option<Quantity>,
    /// Description, in one line.
    pub about: Option<String>,
}

impl From<String> for StateOptions {
    fn from(unit: String) -> Self {
        Self { unit, scale: None, about: None }
    }
}

/// Unit, range and description of a parameter.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Settable {
    /// Unit.
    pub unit: String,
    /// Default value.
    pub default: Option<Quantity>,
    /// Smallest meaningful value.
    pub min: Option<Quantity>,
    /// Largest meaningful value.
    pub max: Option<Quantity>,
    /// Description, in one line.
    pub about: Option<String>,
}

impl From<String> for Settable {
    fn from(unit: String) -> Self {
        Self { unit, default: None, min: None, max: None, about: None }
    }
}

/// Signal computed from other quantities.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Output {
    /// Expression of the signal.
    pub value: Formula,
    /// Unit. Default: the coherent SI unit of the expression.
    pub unit: Option<String>,
    /// Description, in one line.
    pub about: Option<String>,
}

impl From<String> for Output {
    fn from(value: String) -> Self {
        Self { value: Formula(value), unit: None, about: None }
    }
}

/// Friction of a joint: `-viscous v - coulomb sign(v)` in the equation of its speed `v`, with exact sticking at rest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Friction {
    /// Dry friction while the joint slides. At rest, friction balances any load up to `peak` times this value.
    pub coulomb: Option<Formula>,
    /// Viscous friction coefficient.
    pub viscous: Option<Formula>,
    /// Ratio of the break-away friction to the sliding friction at the smallest speed; at least 1, default 1.
    pub peak: Option<Formula>,
}

/// Instantaneous event.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct When {
    /// Guard: the event occurs when this expression becomes negative.
    pub guard: Formula,
    /// New values of states, computed from the values just before the event. Other states keep their values.
    #[serde(default)]
    pub reset: Entries<Formula>,
    /// Values of states at which accumulating events end. These states are kept there until their rates would increase
    /// the guard. Without `at-rest`, the simulation fails if the events accumulate.
    #[serde(default)]
    pub at_rest: Entries<Formula>,
}

/// Clock with memory that changes at fixed instants only.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Clock {
    /// Period: a time such as "10 ms", or an expression of constants.
    pub every: Formula,
    /// First instant; default 0.
    pub offset: Option<Formula>,
    /// Time between an instant and the change of the memory, such as a computation time; at most the period, default 0.
    pub delay: Option<Formula>,
    /// Values that are constant between the instants, and their units: `u = "V"`, or a table with `unit`, `about`.
    pub memory: Entries<Short<Described>>,
    /// New values of the memory, computed from the states and memory just before the instant and the inputs then.
    #[serde(default)]
    pub next: Entries<Formula>,
    /// Memory that is the output of a filter:
    /// `u = { of = "r - y", continuous = { numerator = ["k*Ti", "k"], denominator =
    /// ["Ti", 0] } }`.
    #[serde(default)]
    pub filter: Entries<Filter>,
}

/// Lookup table with one or two arguments.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Table {
    /// Data file: CSV, or MATLAB level 4 or 5; `x`, `y` and `z` are then names of columns. Units are those of its
    /// header.
    pub file: Option<String>,
    /// Values of the argument, increasing; numbers without a unit are in SI units.
    pub x: Points,
    /// Values of the table, or with `z` those of the second argument.
    pub y: Points,
    /// Values of a table with two arguments: one row for every `y`, with one value for every `x`; in a file, one value
    /// per row of the file, for every pair of `x` and `y`.
    pub z: Option<Grid>,
    /// `linear` (default), or `monotone`: a cubic spline that has no extrema between the points; with one argument.
    #[serde(default)]
    pub between: Between,
    /// Beyond the first and the last point: `extend` (default) as a straight line, or `constant`.
    #[serde(default)]
    pub outside: Outside,
}

/// Points of a lookup table: a column of its file, or a list.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Points {
    /// Name of a column.
    Column(String),
    /// Values.
    Values(Vec<Quantity>),
}

/// Values of a lookup table with two arguments.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Grid {
    /// Name of a column.
    Column(String),
    /// Rows of values.
    Rows(Vec<Vec<Quantity>>),
}

/// Interpolation between the points of a lookup table.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Between {
    /// Straight lines.
    #[default]
    Linear,
    /// Monotone cubic spline.
    Monotone,
}

/// Value of a lookup table beyond its points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Outside {
    /// Straight line.
    #[default]
    Extend,
    /// Value at the nearer end.
    Constant,
}

/// Filter of a sampled quantity, given by its transfer function.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Filter {
    /// Expression that is filtered.
    pub of: Formula,
    /// Transfer function in z.
    pub z: Option<Polynomials>,
    /// Transfer function in s, which `method` makes discrete.
    pub continuous: Option<Polynomials>,
    /// `tustin` (default): bilinear transform. `zero-order-hold`: exact for an input that is constant between the
    /// instants.
    pub method: Option<Method>,
    /// Frequency at which the bilinear transform keeps the frequency response; a number without a unit is in Hz.
    pub prewarp: Option<Quantity>,
}

/// PID controller with filtered derivative:
/// `v = k (wp r - y + 1/(Ti s) (r - y) + Td s/(Td/Nd s + 1) (wd r - y)) + feedforward`, and the output is `v` within
/// its limits. Values are quantities or expressions. A number without a unit is in the unit of the output for `limit`
/// and `feedforward`, in that of the measured quantity for `setpoint`, in s for times, and in SI units for `k`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Pid {
    /// Setpoint `r`.
    pub setpoint: Formula,
    /// Measured quantity `y`.
    pub measured: Formula,
    /// Gain `k`.
    pub k: Formula,
    /// Integral time; without it the controller has no integral part.
    #[serde(rename = "Ti")]
    pub ti: Option<Formula>,
    /// Derivative time; without it, or at 0, the controller has no derivative part.
    #[serde(rename = "Td")]
    pub td: Option<Formula>,
    /// Filter ratio of the derivative; default 10.
    #[serde(rename = "Nd")]
    pub nd: Option<Formula>,
    /// Setpoint weight of the proportional part; default 1.
    pub wp: Option<Formula>,
    /// Setpoint weight of the derivative part; default 1.
    pub wd: Option<Formula>,
    /// Tracking time of the anti-windup by back-calculation; default sqrt(Ti Td), or Ti without a derivative.
    #[serde(rename = "Tt")]
    pub tt: Option<Formula>,
    /// Expression that is added before the limits, such as the output at the operating point.
    pub feedforward: Option<Formula>,
    /// Lower and upper limit of the output.
    pub limit: Option<[Formula; 2]>,
    /// Unit of the output, unless it takes the place of an input.
    pub unit: Option<String>,
    /// Period of a sampled controller (backward differences, integral updated after the output).
    pub every: Option<Formula>,
    /// Time between a sample and the change of the output, at most the period.
    pub delay: Option<Formula>,
}

/// Numerator and denominator of a transfer function.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Polynomials {
    /// Coefficients in descending powers: numbers, or expressions of parameters and constants. A number before `s^n` is
    /// in `s^n`.
    pub numerator: Vec<Formula>,
    /// Coefficients in descending powers, at least as many as in the numerator.
    pub denominator: Vec<Formula>,
}

/// Conversion of a continuous filter to a discrete one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Method {
    /// Bilinear transform.
    Tustin,
    /// Step-invariant transform.
    ZeroOrderHold,
}

/// Name of a place.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct PortName {
    /// Position of the joint.
    pub joint: String,
}

/// Expression: a string or a number.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Formula(pub String);

impl<'de> Deserialize<'de> for Formula {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrText;
        impl Visitor<'_> for NumberOrText {
            type Value = Formula;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an expression or a number")
            }
            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Formula, E> {
                Ok(Formula(format!("{number:?}")))
            }
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Formula, E> {
                Ok(Formula(number.to_string()))
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Formula, E> {
                Ok(Formula(text.to_owned()))
            }
        }
        deserializer.deserialize_any(NumberOrText)
    }
}

impl JsonSchema for Formula {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Formula".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"] })
    }
}
