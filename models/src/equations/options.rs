//! What stands in a study file under `[models.NAME.equations]`.

use mops_core::Quantity;
use mops_core::file::{Entries, Short};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};

use crate::kernel::Tolerance;

/// A plant written down as its equations, as short as on paper:
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
/// A derivative is an expression, or an equation with `=` in which `w'` (or `der(w)`) stands for the derivative of `w`;
/// equations may contain several derivatives, each to the first power: they are solved together, as with a mass matrix.
///
/// Expressions: `+ - * / ^`, parentheses, `pi`, `time` (s); `sin cos tan asin acos atan atan2(y, x) sinh cosh tanh exp ln
/// log10 sqrt`; `abs sign min max clip(x, low, high) deadzone(x, low, high)`; `table(x, x1, y1, x2, y2, ..)`, straight
/// lines through points; `if(condition, a, b)`, with conditions of `> >= < <=`, `and`, `or`, `not`. Where one of the
/// second row, a table or an `if` changes its branch, a step of the integrator ends: none crosses a kink or a jump.
/// Numbers are in the units that stand beside the names; nothing is converted within an equation.
///
/// A family of states is declared as `"T[1..100]" = "K"`; `"T[i]" = "k*(T[i-1] - 2*T[i] + T[i+1])"` gives the derivative
/// of every member that has none of its own, `"T[i=2..99]"` of these. `let`, `start`, `inputs` and `parameters` have
/// families too.
///
/// Signals are the states, the outputs and the inputs. The start value of `th` is the parameter `th0`, 0 by default.
///
/// A state whose derivative is another state, as `th` above, is a joint: friction acts on it with `friction.th = {
/// coulomb = "c" }`, exactly at rest while it is stuck. The places where an effect may be missing are its joints, the
/// equations of its states, its inputs and its signals.
///
/// Source: F. Cellier, E. Kofman, Continuous System Simulation (2006), chapters 7 (sorting and solving equations) and 9
/// (discontinuities).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EquationsOptions {
    /// States and their units: `th = "rad"`, `"T[1..100]" = "K"`; or a table with `unit`, `scale`, `about`.
    pub(super) states: Entries<Short<StateOptions>>,
    /// Inputs and their units; 0 where no case or experiment drives them.
    #[serde(default)]
    pub(super) inputs: Entries<Short<Described>>,
    /// Parameters and their units: `b = "N m s/rad"`, or a table with `unit`, `default`, `min`, `max`, `about`.
    #[serde(default)]
    pub(super) parameters: Entries<Short<Settable>>,
    /// Numbers that never change: `g = "9.81 m/s^2"`.
    #[serde(default)]
    pub(super) constants: Entries<Quantity>,
    /// Names for expressions, in any order: `s = "sin(th)"`.
    #[serde(default, rename = "let")]
    pub(super) definitions: Entries<Formula>,
    /// Derivatives: `th = "w"`, or an equation that contains them: `w = "J*w' = u - b*w"`.
    pub(super) der: Entries<Formula>,
    /// Mass matrix, where `der` gives forces: `"w,w" = "J"` multiplies the derivative of `w` (second) in the equation of
    /// `w` (first); rows that are not named are those of the unit matrix.
    #[serde(default)]
    pub(super) mass: Entries<Formula>,
    /// More signals: `height = "l*cos(th)"`, or a table with `value`, `unit`, `about`.
    #[serde(default)]
    pub(super) outputs: Entries<Short<Output>>,
    /// Values at the start: numbers, or expressions of parameters.
    #[serde(default)]
    pub(super) start: Entries<Formula>,
    /// Friction of joints, by their position or speed.
    #[serde(default)]
    pub(super) friction: Entries<Friction>,
    /// Events: `bounce = { guard = "h", reset = { v = "-e*v" }, at-rest = { h = 0, v = 0 } }` happens when `h` becomes
    /// negative.
    #[serde(default)]
    pub(super) when: Entries<When>,
    /// Names for joints as places of effects: `arm = { joint = "phi" }`; the position's own where absent.
    #[serde(default)]
    pub(super) ports: Entries<PortName>,
    /// End of the simulation where no experiment gives one.
    pub(super) horizon: Option<Quantity>,
    /// Accuracy and limits of the simulation.
    #[serde(default)]
    pub(super) tolerance: Tolerance,
}

/// A quantity's unit and meaning.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Described {
    /// Unit.
    pub unit: String,
    /// What it is, in one line.
    pub about: Option<String>,
}

impl From<String> for Described {
    fn from(unit: String) -> Self {
        Self { unit, about: None }
    }
}

/// A state's unit, size and meaning.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StateOptions {
    /// Unit.
    pub unit: String,
    /// Typical size, positive: errors of the simulation count relative to it where the state is near 0. Where it is absent
    /// the largest absolute value that the state has had takes its place.
    pub scale: Option<Quantity>,
    /// What it is, in one line.
    pub about: Option<String>,
}

impl From<String> for StateOptions {
    fn from(unit: String) -> Self {
        Self { unit, scale: None, about: None }
    }
}

/// A parameter's unit, range and meaning.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Settable {
    /// Unit.
    pub unit: String,
    /// Value where the study gives none.
    pub default: Option<Quantity>,
    /// Smallest meaningful value.
    pub min: Option<Quantity>,
    /// Largest meaningful value.
    pub max: Option<Quantity>,
    /// What it is, in one line.
    pub about: Option<String>,
}

impl From<String> for Settable {
    fn from(unit: String) -> Self {
        Self { unit, default: None, min: None, max: None, about: None }
    }
}

/// A signal that follows from others.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Output {
    /// Its expression.
    pub value: Formula,
    /// Unit; a pure number where absent.
    pub unit: Option<String>,
    /// What it is, in one line.
    pub about: Option<String>,
}

impl From<String> for Output {
    fn from(value: String) -> Self {
        Self { value: Formula(value), unit: None, about: None }
    }
}

/// Friction of a joint: `-viscous v - coulomb sign(v)` in the equation of its speed `v`, and a state of rest.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Friction {
    /// Dry friction while it moves; at rest the joint is held by whatever it takes, up to `peak` times this.
    pub coulomb: Option<Formula>,
    /// Viscous friction.
    pub viscous: Option<Formula>,
    /// Ratio of what breaks the joint away to the friction at the smallest speed; at least 1, and 1 where absent.
    pub peak: Option<Formula>,
}

/// Something that happens at once.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct When {
    /// It happens when this becomes negative.
    pub guard: Formula,
    /// New values of states, from the values just before; states that are not named stay.
    #[serde(default)]
    pub reset: Entries<Formula>,
    /// Values of states where events that come closer and closer end. These states are held there until their rates would
    /// make the guard rise. Without it events that accumulate are a failure of the simulation.
    #[serde(default)]
    pub at_rest: Entries<Formula>,
}

/// A place that gets a name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct PortName {
    /// Position of the joint.
    pub joint: String,
}

/// An expression: a text, or a number.
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
