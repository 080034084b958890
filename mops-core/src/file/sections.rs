//! Tables of a study file. The documentation of each key is part of the schema that `mops schema` writes for editors.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};

use super::entries::Entries;
use crate::criterion::Usage;
use crate::evaluation::Objective;
use crate::experiment::{Hold, Input, Role};
use crate::linearised::Linearise;
use crate::study::Task;
use crate::study_error::StudyError;
use crate::tuner::Scale;
use crate::unit::{Quantity, Unit};

/// General settings of the study.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StudySection {
    /// Name used in reports.
    pub name: String,
    /// Task: `design` (default), `calibration`, `diagnosis`, `excitation`, `monte-carlo`, `pareto`, `sensitivity`, `sweep`
    /// or `worst-case`.
    #[serde(default)]
    pub task: Task,
    /// Combination of the scaled values: `max` (default of a design), `sum` (default of a calibration) or `each` (default of
    /// `pareto`).
    pub objective: Option<Objective>,
    /// Seed of all random numbers; default 1.
    pub seed: Option<u64>,
}

/// Common keys of all models.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ModelCommon {
    /// Parameter values, used unless a tuner or a case sets the parameter.
    #[serde(default)]
    pub parameters: Entries<Quantity>,
    /// Model from which this one takes all keys that it does not give itself: `like = "servo"`. Tables are merged key by key.
    pub like: Option<String>,
    /// Cuts the loop at a variable, and replaces the model by the linearised open loop `L`, for margins and sensitivities:
    /// `open = "u"`. `L` is the transfer function from an input in the place of the variable to minus its computed value, so
    /// that the poles of the closed loop are the zeros of `1 + L`. The operating point is the equilibrium of the closed loop
    /// with the inputs of the case at time 0; `linearise = { equilibrium = false, at = { .. } }` gives another one. For models
    /// of the kind `equations`, the variable is a named expression of `let`.
    pub open: Option<String>,
    /// Replaces the model by its linearisation, for criteria of linear systems:
    /// `linearise = { inputs = ["u"], outputs = ["theta"], at = { theta = "180 deg" } }`. `{}` selects all inputs and
    /// outputs.
    pub linearise: Option<LineariseSection>,
    /// Physical effects at places of the model, under names of your choice:
    /// `arm = { coulomb-friction = { place = "joint:phi" } }` adds the parameter `arm.c`. `mops list` shows the effects,
    /// `mops check` the places.
    #[serde(default)]
    pub effects: Entries<Entries<EffectSection>>,
}

impl ModelCommon {
    pub const KEYS: &[&str] = &["like", "parameters", "open", "linearise", "effects"];
}

/// Place of an effect. The effect parameters are model parameters, set by tuners, cases and `parameters`. By default they
/// have their null value, at which the effect vanishes.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct EffectSection {
    /// Place: `joint:NAME`, `process:NAME`, `actuator:NAME` or `sensor:NAME`.
    pub place: String,
    /// Second place, for effects that need one: the rotation that causes an actuator ripple, the joint that exerts drag.
    pub companion: Option<String>,
}

/// Operating point, inputs and outputs of a linearisation.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LineariseSection {
    /// Inputs; default all.
    pub inputs: Option<Vec<String>>,
    /// Signals used as outputs; default all.
    pub outputs: Option<Vec<String>>,
    /// Values of states and inputs at the operating point. By default, states have their initial value and inputs the
    /// initial value of the case.
    #[serde(default)]
    pub at: Entries<Quantity>,
    /// `true` moves the operating point to the nearest equilibrium (default with `open`); the inputs, and the states in `at`, stay fixed.
    #[serde(default)]
    pub equilibrium: Option<bool>,
    /// States and inputs that the equilibrium search may vary although they would be fixed.
    #[serde(default)]
    pub free: Vec<String>,
}

impl From<LineariseSection> for Linearise {
    fn from(section: LineariseSection) -> Self {
        let LineariseSection { inputs, outputs, at, equilibrium, free } = section;
        Self { inputs, outputs, at: at.0, equilibrium: equilibrium.unwrap_or(false), free }
    }
}

/// A quantity that a solver may change; it has the name of a model parameter.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct TunerSection {
    /// Initial guess.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Unit of the values; default is the unit of the parameter.
    pub unit: Option<String>,
    /// Mapping of the range: `linear` or `log`.
    #[serde(default)]
    pub scale: Scale,
    /// `true` allows integers only.
    #[serde(default)]
    pub integer: bool,
    /// List of the allowed values.
    pub values: Option<Vec<Quantity>>,
    /// `false` keeps the tuner at its initial guess.
    pub active: Option<bool>,
    /// Expression of tuners defined before this one, such as `"4*Td"`; the tuner takes its value.
    pub tie: Option<String>,
    /// `true` gives every case or experiment a separate value. In selection and validation experiments the value is
    /// estimated from their own data, as initial states are.
    #[serde(default)]
    pub per_case: bool,
    /// Initial guesses of single cases or experiments, by name; requires `per-case`.
    #[serde(default)]
    pub starts: Entries<Quantity>,
}

/// Keys of a case in addition to parameter values.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct CaseOptions {
    /// Inputs of the model; all others are 0. Each is a `constant`, `step` or `sine`:
    /// `inputs.u.step = { time = "1 s", before = 0, after = "60 deg" }`. Numbers without a unit are in the unit of the
    /// input. Recorded inputs belong in [experiments].
    #[serde(default)]
    pub inputs: Entries<InputSection>,
    /// End of the simulation.
    pub horizon: Option<Quantity>,
}

impl CaseOptions {
    pub const KEYS: &[&str] = &["inputs", "horizon"];
}

/// An input as a function of time.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) enum InputSection {
    /// Constant value.
    Constant(Quantity),
    /// A step.
    Step(StepSection),
    /// A sine.
    Sine(SineSection),
}

/// Step from one value to another.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StepSection {
    /// Time of the step; a number without a unit is in s. Default 0.
    pub time: Option<Quantity>,
    /// Value before the step; default 0.
    pub before: Option<Quantity>,
    /// Value after the step.
    pub after: Quantity,
}

/// Sine `offset + amplitude sin(2 pi frequency t + phase)`.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SineSection {
    /// Amplitude.
    pub amplitude: Quantity,
    /// Frequency; a number without a unit is in Hz.
    pub frequency: Quantity,
    /// Phase; a number without a unit is in rad. Default 0.
    pub phase: Option<Quantity>,
    /// Mean value; default 0.
    pub offset: Option<Quantity>,
}

impl InputSection {
    /// Returns the input, with values in `unit`. Errors have the key of the value.
    pub fn input(&self, unit: &Unit) -> Result<Input, StudyError> {
        let number = |key: &'static str, quantity: &Quantity, unit: &Unit| {
            let unitless = |m: StudyError| m.with_help(format!("a number without a unit is in `{unit}`"));
            let value = quantity.to(unit).map_err(|why| unitless(StudyError::new(key, why)))?;
            let finite = || StudyError::new(key, format!("expected a finite value of the input, found {value}"));
            value.is_finite().then_some(value).ok_or_else(|| finite().with_help("give a number"))
        };
        let or_zero = |key: &'static str, quantity: &Option<Quantity>, unit: &Unit| {
            quantity.as_ref().map_or(Ok(0.0), |quantity| number(key, quantity, unit))
        };
        let known = Unit::known;
        Ok(match self {
            Self::Constant(value) => Input::Constant(number("constant", value, unit)?),
            Self::Step(step) => {
                let within = |m: StudyError| m.within("step");
                Input::Step {
                    time: or_zero("time", &step.time, &known("s")).map_err(within)?,
                    before: or_zero("before", &step.before, unit).map_err(within)?,
                    after: number("after", &step.after, unit).map_err(within)?,
                }
            }
            Self::Sine(sine) => {
                let within = |m: StudyError| m.within("sine");
                Input::Sine {
                    amplitude: number("amplitude", &sine.amplitude, &unit.difference()).map_err(within)?,
                    frequency: number("frequency", &sine.frequency, &known("Hz")).map_err(within)?,
                    phase: or_zero("phase", &sine.phase, &known("rad")).map_err(within)?,
                    offset: or_zero("offset", &sine.offset, unit).map_err(within)?,
                }
            }
        })
    }
}

/// A measurement.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ExperimentSection {
    /// Data file: CSV, or MATLAB level 4 or 5; the path is relative to the folder of the study.
    pub file: String,
    /// Time column; its unit is taken from the header, by default s.
    pub time: Option<String>,
    /// Unit of the time column, if its header has none.
    pub time_unit: Option<String>,
    /// Frequency column, for frequency responses instead of signals over time; its unit is taken from the header, by default
    /// rad/s.
    pub frequency: Option<String>,
    /// Unit of the frequency column, if its header has none: `Hz` or `rad/s`.
    pub frequency_unit: Option<String>,
    /// Measured frequency responses, by the output of a linear model: `y = { magnitude = "column", phase = "column" }` or
    /// `y = { real = "column", imaginary = "column" }`.
    #[serde(default)]
    pub responses: Entries<ResponseTable>,
    /// Measured signals: `theta = "column"`, or a table with `column`, `unit`, `scale`, `offset`, `noise`.
    #[serde(default)]
    pub channels: Entries<ChannelSection>,
    /// Recorded inputs: `u = "column"`, or a table with `column`, `unit`, `scale`, `offset`, `hold`, `shift`. Between samples an
    /// input is constant (`hold = "zero"`, default) or interpolated linearly (`hold = "first"`).
    #[serde(default)]
    pub inputs: Entries<InputColumn>,
    /// Role: `calibration` (default), `selection` or `validation`.
    #[serde(default)]
    pub role: Role,
    /// States whose initial values are estimated: `["phi", "theta"]`, or a table with `start`, `min`, `max` for each.
    #[serde(default)]
    pub free: FreeSection,
    /// Parameter values of this experiment.
    #[serde(default)]
    pub parameters: Entries<Quantity>,
    /// Start of the used part of the file, as time in the file.
    pub from: Option<Quantity>,
    /// End of the used part of the file, as time in the file.
    pub to: Option<Quantity>,
    /// Number of samples dropped at the start of the file; the first sample of a sensor is often wrong.
    #[serde(default)]
    pub skip: usize,
    /// `false` keeps the times of the file. The simulation then starts at 0 s, with inputs from the file from that time on,
    /// even before `from`. By default the simulation starts at the first sample used.
    pub reset_time: Option<bool>,
}

/// Columns of a measured frequency response.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ResponseTable {
    /// Column of the real part.
    pub real: Option<String>,
    /// Column of the imaginary part.
    pub imaginary: Option<String>,
    /// Column of the magnitude. It is in dB if its header or `decibel` specifies dB, else in the unit of its header. The
    /// default is the unit of the output divided by that of the input.
    pub magnitude: Option<String>,
    /// Column of the phase; its unit is taken from the header, by default deg.
    pub phase: Option<String>,
    /// `true` for a magnitude in dB whose header does not specify dB.
    #[serde(default)]
    pub decibel: bool,
}

/// Sensor of a signal that experiments measure.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SensorSection {
    /// Standard deviation of the noise, in all experiments whose channel gives none; a number is in the unit of the signal.
    pub noise: Quantity,
}

/// Column of a measured signal, and its conversion to the signal of the model.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ChannelTable {
    /// Column of the file.
    pub column: String,
    /// Unit of the column; default is the unit in the header, else that of the signal.
    pub unit: Option<String>,
    /// Factor applied to the column, such as -1 for a sensor mounted in the opposite direction.
    pub scale: Option<f64>,
    /// Offset added after scaling, in the unit of the column.
    pub offset: Option<Quantity>,
    /// Standard deviation of the noise, used to weight residuals.
    pub noise: Option<Quantity>,
}

/// Column of a recorded input, and its conversion to the input of the model.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct InputTable {
    /// Column of the file.
    pub column: String,
    /// Unit of the column; default is the unit in the header, else that of the input.
    pub unit: Option<String>,
    /// Factor applied to the column.
    pub scale: Option<f64>,
    /// Offset added after scaling, in the unit of the column.
    pub offset: Option<Quantity>,
    /// Interpolation between samples. `zero` (default): constant until the next sample, as a digital controller outputs it.
    /// `first`: linear interpolation, for smooth inputs. `band-limited`: no content above half the sampling frequency, for
    /// inputs filtered before sampling.
    pub hold: Option<Hold>,
    /// Time added to the time stamps of the input: negative for an input that acts before them, such as a flow that is logged at the
    /// end of its interval.
    pub shift: Option<Quantity>,
}

/// A state whose initial value is estimated; absent values are derived from the data.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct FreeTable {
    /// Initial guess.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
}

/// Common keys of all criteria.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct CriterionCommon {
    /// Model that the criterion reads; required if there are several.
    pub model: Option<String>,
    /// Cases in which the criterion is evaluated; default all.
    pub cases: Option<Vec<String>>,
    /// `minimise` (the default), `inequality`, `equality` or `monitor`.
    pub usage: Option<Usage>,
    /// Demand: an upper limit (positive) if less is better, a lower limit if more is better. Some kinds have a default.
    pub demand: Option<Quantity>,
    /// Value that scales to 0, as an alternative to `demand`; requires `bad`.
    pub good: Option<Quantity>,
    /// Value that scales to 1, as an alternative to `demand`; requires `good`.
    pub bad: Option<Quantity>,
    /// Weight of the scaled value in the objective; default 1.
    pub weight: Option<f64>,
}

impl CriterionCommon {
    pub const KEYS: &[&str] = &["model", "cases", "usage", "demand", "good", "bad", "weight"];
}

/// Common keys of all solvers.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SolverCommon {
    /// Maximum number of evaluated points.
    pub max_evaluations: Option<usize>,
}

impl SolverCommon {
    pub const KEYS: &[&str] = &["max-evaluations"];
}

/// A string, or a table: `"column"` is short for `{ column = "column" }`.
macro_rules! column_or_table {
    ($name:ident, $table:ident, $short:expr) => {
        #[derive(Debug)]
        pub(super) struct $name(pub $table);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Either;
                impl<'de> Visitor<'de> for Either {
                    type Value = $name;
                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str("a column name, or a table with `column`")
                    }
                    fn visit_str<E>(self, column: &str) -> Result<$name, E> {
                        let make: fn(String) -> $table = $short;
                        Ok($name(make(column.to_owned())))
                    }
                    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<$name, M::Error> {
                        $table::deserialize(serde::de::value::MapAccessDeserializer::new(map)).map($name)
                    }
                }
                deserializer.deserialize_any(Either)
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }
            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                json_schema!({ "anyOf": [{ "type": "string" }, generator.subschema_for::<$table>()] })
            }
        }
    };
}

column_or_table!(ChannelSection, ChannelTable, |column| ChannelTable {
    column,
    unit: None,
    scale: None,
    offset: None,
    noise: None
});
column_or_table!(InputColumn, InputTable, |column| InputTable {
    column,
    unit: None,
    scale: None,
    offset: None,
    hold: None,
    shift: None
});

/// Free initial states: a list of states, or a table.
#[derive(Debug, Default)]
pub(super) struct FreeSection(pub Vec<(String, FreeTable)>);

impl<'de> Deserialize<'de> for FreeSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = FreeSection;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of states, or a table with `start`, `min`, `max` for each")
            }
            fn visit_seq<S: serde::de::SeqAccess<'de>>(self, mut list: S) -> Result<FreeSection, S::Error> {
                let mut states = Vec::new();
                while let Some(state) = list.next_element::<String>()? {
                    states.push((state, FreeTable::default()));
                }
                Ok(FreeSection(states))
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<FreeSection, M::Error> {
                Entries::deserialize(serde::de::value::MapAccessDeserializer::new(map)).map(|e| FreeSection(e.0))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl JsonSchema for FreeSection {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "FreeSection".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<Entries<FreeTable>>();
        json_schema!({ "anyOf": [{ "type": "array", "items": { "type": "string" } }, table] })
    }
}
