//! Tables of a study file. The documentation of each key is part of the schema that `mops schema` writes for editors.

use std::fmt;

use mops_core::{
    case::{Hold, Role},
    criterion::Usage,
    evaluation::Objective,
    model::Linearise,
    study::Scale,
};
use mops_language::{
    Quantity,
    entries::{Entries, Short},
};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, IntoDeserializer, MapAccess, Visitor};

use super::input_sections::InputEntry;

/// General settings of the study.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StudySection {
    /// Name used in reports.
    pub name: String,
    /// Task; default `design`.
    pub task: Option<String>,
    /// Combination of the scaled values: `max` (default of a design), `sum` (default of a calibration) or `each`
    /// (default of `pareto`).
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
    /// Model from which this one takes all keys that it does not give itself: `like = "servo"`. Tables are merged key
    /// by key.
    pub like: Option<String>,
    /// Simulates several models side by side, to compare their signals: `join = ["loop", "reference"]`, beside
    /// `parameters` only. The signal `y` of `loop` is `loop_y`. Parameters and initial values of the same name are one.
    /// An input that the case gives acts in all models that have it; otherwise each model keeps its default.
    pub join: Option<Vec<String>>,
    /// Cuts the loop at a variable, and replaces the model by the linearised open loop `L`, for margins and
    /// sensitivities: `open = "u"`. `L` is the transfer function from an input in the place of the variable to minus
    /// its computed value, so that the poles of the closed loop are the zeros of `1 + L`. The operating point is the
    /// equilibrium of the closed loop with the inputs of the case at time 0;
    /// `linearise = { equilibrium = false, at = { .. } }` gives another one. For models of the kind `equations`, the
    /// variable is a named expression of `let`, or the memory of a clock: `L` is then the discrete transfer function
    /// `L(z)`, and frequencies are those of `z = exp(j omega T)`, up to half of the sampling frequency.
    ///
    /// A list, `open = ["u1", "u2"]`, cuts several loops, for a disk margin of all of them. Criteria of loops select
    /// one by `input = "u1"`, with the others closed; criteria of other linear systems read the loop transfer function
    /// with all loops open.
    pub open: Option<OneOrMore>,
    /// Replaces the model by its linearisation, for criteria of linear systems:
    /// `linearise = { inputs = ["u"], outputs = ["theta"], at = { theta = "180 deg" } }`. `{}` selects all inputs and
    /// outputs.
    pub linearise: Option<LineariseSection>,
    /// Physical effects at places of the model, under names of your choice:
    /// `arm = { coulomb-friction = { place = "joint:phi" } }` adds the parameter `arm.c`. `mops list` shows the
    /// effects, `mops check` the places.
    #[serde(default)]
    pub effects: Entries<Entries<EffectSection>>,
}

impl ModelCommon {
    pub const KEYS: &[&str] = &["like", "join", "parameters", "open", "linearise", "effects"];
}

/// Place of an effect. The effect parameters are model parameters, set by tuners, cases and `parameters`. By default
/// they have their null value, at which the effect vanishes.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct EffectSection {
    /// Place: `joint:NAME`, `process:NAME`, `actuator:NAME` or `sensor:NAME`.
    pub place: String,
    /// Second place, for effects that need one: the rotation that causes an actuator ripple, the joint that exerts
    /// drag.
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
    /// `true` moves the operating point to the nearest equilibrium (default with `open`); the inputs, and the states in
    /// `at`, stay fixed.
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
    /// `true` gives every case or experiment a separate value; a list of names or patterns gives one to each of these,
    /// and a common one to all others. In selection and validation experiments the value is estimated from their own
    /// data, as initial states are.
    #[serde(default)]
    pub per_case: PerCase,
    /// Initial guesses of single cases or experiments, by name; requires `per-case`.
    #[serde(default)]
    pub starts: Entries<Quantity>,
}

/// A name, or a list of names.
#[derive(Debug, Clone, serde::Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum OneOrMore {
    One(String),
    More(Vec<String>),
}

/// Cases in which a tuner has a separate value: all, none, or those of a list.
#[derive(Debug, Clone, PartialEq, serde::Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum PerCase {
    All(bool),
    In(Vec<String>),
}

impl Default for PerCase {
    fn default() -> Self {
        Self::All(false)
    }
}

/// Keys of a case in addition to parameter values.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct CaseOptions {
    /// Inputs of the model; all others are 0. Each is a quantity, which is constant, or one of `constant`, `step`,
    /// `ramp`, `pulse`, `doublet`, `sine`, `multisine`, `chirp`, `prbs`, `table` and `file`:
    /// `inputs.u.step = { time = "1 s", before = 0, after = "60 deg" }`. A list is their sum:
    /// `inputs.u = [{ constant = 2 }, { sine = { amplitude = 1, frequency = "3 Hz" } }]`, in which one term at most is
    /// in degC or degF and the others are differences. Numbers without a unit are in the unit of the input.
    #[serde(default)]
    pub inputs: Entries<InputEntry>,
    /// End of the simulation.
    pub horizon: Option<Quantity>,
    /// Parameters with lists of values: one case for every combination, `grid = { J = [1, 2], load = ["0 N", "5 N"] }`.
    /// Case `NAME` becomes `NAME-J=1-load=0N` and so on; `cases = ["NAME-*"]` selects them all for a criterion.
    #[serde(default)]
    pub grid: Entries<Vec<Quantity>>,
}

impl CaseOptions {
    pub const KEYS: &[&str] = &["inputs", "horizon", "grid"];
}

/// A measurement.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ExperimentSection {
    /// Data file: CSV, or MATLAB level 4 or 5; the path is relative to the folder of the study.
    pub file: Option<String>,
    /// Data files of several experiments with the same columns: `files = "swing_*.csv"`, where `*` stands for any text
    /// in the name of a file. Each file is an experiment of its own, called `NAME-FILE`.
    pub files: Option<String>,
    /// Length of windows: `windows = "2 s"` divides the used part of each file into experiments of this length, called
    /// `NAME-1`, `NAME-2`, .. Each has initial states of its own. A remainder of less than half the length is left out.
    pub windows: Option<Quantity>,
    /// Time column, of numbers or of time stamps such as `2024-05-17T10:30:00.5`, which count from the first one on.
    /// The unit of numbers is taken from the header, by default s.
    pub time: Option<String>,
    /// Unit of the time column, if its header has none.
    pub time_unit: Option<String>,
    /// Time between two samples, if the file has no time column; the first sample is at 0.
    pub sample_time: Option<Quantity>,
    /// Frequency column, for frequency responses instead of signals over time; its unit is taken from the header, by
    /// default rad/s.
    pub frequency: Option<String>,
    /// Unit of the frequency column, if its header has none: `Hz` or `rad/s`.
    pub frequency_unit: Option<String>,
    /// Measured frequency responses, by the output of a linear model: `y = { magnitude = "column", phase = "column" }`
    /// or `y = { real = "column", imaginary = "column" }`.
    #[serde(default)]
    pub responses: Entries<ResponseTable>,
    /// Measured signals: `theta = "column"`, or a table with `column`, `unit`, `scale`, `offset`, `noise`, `unwrap`,
    /// `shift`. A signal from another file, also with another rate, has the keys `file` and `time` or `sample-time`.
    #[serde(default)]
    pub channels: Entries<Short<ChannelTable>>,
    /// Inputs: recorded, `u = "column"`, or a table with `column`, `unit`, `scale`, `offset`, `hold`, `shift`; or
    /// constant, `u = 0` or `u = { constant = "20 degC" }`. An input from another file has the keys `file` and `time`
    /// or `sample-time`. Between samples an input is constant (`hold = "zero"`, default) or interpolated linearly
    /// (`hold = "first"`). If the file has columns that nothing uses, every input of the model must be given.
    #[serde(default)]
    pub inputs: Entries<RecordedInput>,
    /// Role: `calibration` (default), `selection` or `validation`.
    #[serde(default)]
    pub role: Role,
    /// States whose initial values are estimated: `["phi", "theta"]`, or a table with `start`, `min`, `max` for each.
    #[serde(default)]
    pub free: FreeSection,
    /// Parameter values of this experiment.
    #[serde(default)]
    pub parameters: Entries<Quantity>,
    /// Start of the used part of the file, as time in the file; a number is in s.
    pub from: Option<Quantity>,
    /// End of the used part of the file, as time in the file; a number is in s.
    pub to: Option<Quantity>,
    /// Number of samples dropped at the start of the file, those of inputs included; the first sample of a sensor is
    /// often wrong. `from` keeps the inputs before it, which delays need.
    #[serde(default)]
    pub skip: usize,
    /// `false` keeps the times of the file. The simulation then starts at 0 s, with inputs from the file from that time
    /// on, even before `from`. By default the simulation starts at the first sample used.
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
    /// Column of the magnitude. It is in dB if its header or `decibel` specifies dB, else in the unit of its header.
    /// The default is the unit of the output divided by that of the input.
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
    /// Standard deviation of the noise, in all experiments whose channel gives none; a number is in the unit of the
    /// signal.
    pub noise: Quantity,
}

/// Column of a measured signal, and its conversion to the signal of the model.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
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
    /// `true` for an angle that a sensor counts within one turn: whole turns are added so that no step exceeds half a
    /// turn. `false` confirms that steps of a turn are real.
    pub unwrap: Option<bool>,
    /// Time added to the time stamps of the channel, such as a negative one for a sensor that reports late.
    pub shift: Option<Quantity>,
    /// File of this column, if it is not that of the experiment. Its times are on the same clock.
    pub file: Option<String>,
    /// Time column of that file.
    pub time: Option<String>,
    /// Unit of that time column, if its header has none.
    pub time_unit: Option<String>,
    /// Time between two samples of that file, if it has no time column; the first is at 0.
    pub sample_time: Option<Quantity>,
}

/// Column of a recorded input, and its conversion to the input of the model.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct InputTable {
    /// Column of the file.
    #[serde(default)]
    pub column: String,
    /// Value of an input that is not recorded and does not change: the only key then. A number is in the unit of the
    /// input.
    pub constant: Option<Quantity>,
    /// Unit of the column; default is the unit in the header, else that of the input.
    pub unit: Option<String>,
    /// Factor applied to the column.
    pub scale: Option<f64>,
    /// Offset added after scaling, in the unit of the column.
    pub offset: Option<Quantity>,
    /// Interpolation between samples. `zero` (default): constant until the next sample, as a digital controller outputs
    /// it; a missing sample keeps the value. `first`: linear interpolation, for smooth inputs. `band-limited`: no
    /// content above half the sampling frequency, for inputs filtered before sampling.
    pub hold: Option<Hold>,
    /// Time added to the time stamps of the input: negative for an input that acts before them, such as a flow that is
    /// logged at the end of its interval.
    pub shift: Option<Quantity>,
    /// File of this column, if it is not that of the experiment. Its times are on the same clock.
    pub file: Option<String>,
    /// Time column of that file.
    pub time: Option<String>,
    /// Unit of that time column, if its header has none.
    pub time_unit: Option<String>,
    /// Time between two samples of that file, if it has no time column; the first is at 0.
    pub sample_time: Option<Quantity>,
}

/// Input of an experiment: the name of a column, a number for a constant, or a table.
#[derive(Debug)]
pub(super) struct RecordedInput(pub InputTable);

impl<'de> Deserialize<'de> for RecordedInput {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AnyForm;
        impl<'de> Visitor<'de> for AnyForm {
            type Value = InputTable;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a column, a number or a table")
            }
            fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<InputTable, E> {
                Ok(InputTable { constant: Some(number.into()), ..InputTable::default() })
            }
            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<InputTable, E> {
                let constant = Quantity::deserialize(number.into_deserializer())?;
                Ok(InputTable { constant: Some(constant), ..InputTable::default() })
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<InputTable, E> {
                Ok(text.to_owned().into())
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<InputTable, M::Error> {
                InputTable::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(AnyForm).map(RecordedInput)
    }
}

impl JsonSchema for RecordedInput {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "RecordedInput".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": ["string", "number"] }, generator.subschema_for::<InputTable>()] })
    }
}

impl From<String> for ChannelTable {
    fn from(column: String) -> Self {
        Self { column, ..Self::default() }
    }
}

impl From<String> for InputTable {
    fn from(column: String) -> Self {
        Self { column, ..Self::default() }
    }
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
    /// Cases in which the criterion is evaluated; default all. `*` stands for any text: `cases = ["load-*"]`.
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
    /// Start of the part of the simulation that the criterion reads; default is the start of the simulation. All times
    /// of the criterion count from there, so that a settling time with `from = "5 s"` is that of a disturbance at 5 s.
    pub from: Option<Quantity>,
    /// End of the part of the simulation that the criterion reads; default is the end of the simulation.
    pub until: Option<Quantity>,
    /// Unit of the values in all outputs, and of demands without a unit. By default, outputs are in the unit of
    /// `demand`, `bad` or `good`, or else in that of the kind.
    pub unit: Option<String>,
}

impl CriterionCommon {
    pub const KEYS: &[&str] = &["model", "cases", "usage", "demand", "good", "bad", "weight", "from", "until", "unit"];
}

/// Solver of a design: common keys, and one table named after the kind with its options:
/// `solver = { max-evaluations = 2000, sqp = {} }`. `mops list` shows the kinds; without one, `auto` chooses.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SolverCommon {
    /// Maximum number of evaluated points.
    pub max_evaluations: Option<usize>,
}

impl SolverCommon {
    pub const KEYS: &[&str] = &["max-evaluations"];
}

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
                Entries::deserialize(MapAccessDeserializer::new(map)).map(|e| FreeSection(e.0))
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
