//! What may stand in the tables of a study file. The documentation of each key is what `mops schema` gives to editors.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};

use super::entries::Entries;
use crate::criterion::Usage;
use crate::evaluation::Objective;
use crate::experiment::{Hold, Input, Role};
use crate::linearised::Linearise;
use crate::mistake::Mistake;
use crate::study::Task;
use crate::tuner::Scale;
use crate::unit::{Quantity, Unit};

/// What the study is.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StudySection {
    /// Name, as it stands in reports.
    pub name: String,
    /// What it is for: `design` (the default), `calibration`, `diagnosis`, `excitation`, `monte-carlo`, `pareto`,
    /// `sensitivity`, `sweep` or `worst-case`.
    #[serde(default)]
    pub task: Task,
    /// How scaled values are combined: `max` (of a design) or `sum` (of a calibration).
    pub objective: Option<Objective>,
    /// Seed of all random numbers; 1 where absent.
    pub seed: Option<u64>,
}

/// What every model may have beside its kind.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ModelCommon {
    /// Values of parameters that neither a tuner nor a case sets.
    #[serde(default)]
    pub parameters: Entries<Quantity>,
    /// Makes it the linearisation of the model, to be read by criteria of linear systems:
    /// `linearise = { inputs = ["u"], outputs = ["theta"], at = { theta = "180 deg" } }`; `{}` for all of them.
    pub linearise: Option<LineariseSection>,
    /// Physical effects at places of the model, by names of your choice: `arm = { coulomb-friction = { place = "joint:phi" } }`
    /// adds the parameter `arm.c`. `mops list` names the effects, `mops check` the places.
    #[serde(default)]
    pub effects: Entries<Entries<EffectSection>>,
}

impl ModelCommon {
    pub const KEYS: &[&str] = &["parameters", "linearise", "effects"];
}

/// Where an effect acts. Its strengths are parameters of the model, which tuners, cases and `parameters` set; where nothing
/// does they are neutral, and the effect is not there.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct EffectSection {
    /// The place: `joint:NAME`, `process:NAME`, `actuator:NAME` or `sensor:NAME`.
    pub place: String,
    /// A second place, for effects that need one: what an actuator's ripple turns with, the joint that drag comes from.
    pub companion: Option<String>,
}

/// Where a model is linearised, and between what.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LineariseSection {
    /// Inputs; all where absent.
    pub inputs: Option<Vec<String>>,
    /// Signals that are outputs; all where absent.
    pub outputs: Option<Vec<String>>,
    /// Values of states and inputs at the operating point; states that are not named have their start value, inputs the
    /// value that the case gives them at the start.
    #[serde(default)]
    pub at: Entries<Quantity>,
    /// `true` moves the operating point to the nearest equilibrium; what `at` names is held, and so are the inputs.
    #[serde(default)]
    pub equilibrium: bool,
    /// States and inputs that the search for the equilibrium may move although they would be held.
    #[serde(default)]
    pub free: Vec<String>,
}

impl From<LineariseSection> for Linearise {
    fn from(section: LineariseSection) -> Self {
        let LineariseSection { inputs, outputs, at, equilibrium, free } = section;
        Self { inputs, outputs, at: at.0, equilibrium, free }
    }
}

/// A quantity that a solver may change; its name is that of a model's parameter.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct TunerSection {
    /// Value at the start.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Unit of the values; the parameter's where absent.
    pub unit: Option<String>,
    /// How the range is spread: `linear` or `log`.
    #[serde(default)]
    pub scale: Scale,
    /// Whole numbers only.
    #[serde(default)]
    pub integer: bool,
    /// These values only.
    pub values: Option<Vec<Quantity>>,
    /// `false` keeps the tuner at its start value.
    pub active: Option<bool>,
    /// Expression of tuners that stand before this one, such as `"4*Td"`; the tuner follows it.
    pub tie: Option<String>,
    /// One value for every case or experiment instead of one for the study. In selection and validation experiments it is
    /// estimated from their own data, as start values are.
    #[serde(default)]
    pub per_case: bool,
    /// Values at the start in cases or experiments that begin elsewhere, by their names; with `per-case`.
    #[serde(default)]
    pub starts: Entries<Quantity>,
}

/// What a case may have beside values of parameters.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct CaseOptions {
    /// What drives the model's inputs; an input that is not named is 0. Each moves as `constant`, `step` or `sine`:
    /// `inputs.u.step = { time = "1 s", before = 0, after = "60 deg" }`. Numbers without a unit count in that of the input.
    /// What was recorded is an input of [experiments].
    #[serde(default)]
    pub inputs: Entries<InputSection>,
    /// End of the simulation.
    pub horizon: Option<Quantity>,
}

impl CaseOptions {
    pub const KEYS: &[&str] = &["inputs", "horizon"];
}

/// How an input moves.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) enum InputSection {
    /// The same value throughout.
    Constant(Quantity),
    /// A step.
    Step(StepSection),
    /// A sine.
    Sine(SineSection),
}

/// One value up to a time, another from then on.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StepSection {
    /// When it steps; a number without a unit counts in s. 0 where absent.
    pub time: Option<Quantity>,
    /// Value before; 0 where absent.
    pub before: Option<Quantity>,
    /// Value from then on.
    pub after: Quantity,
}

/// `offset + amplitude sin(2 pi frequency t + phase)`.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SineSection {
    /// Amplitude.
    pub amplitude: Quantity,
    /// Frequency; a number without a unit counts in Hz.
    pub frequency: Quantity,
    /// Phase; a number without a unit counts in rad. 0 where absent.
    pub phase: Option<Quantity>,
    /// Mean value; 0 where absent.
    pub offset: Option<Quantity>,
}

impl InputSection {
    /// The input, with values in `unit`. Mistakes carry the key of the value.
    pub fn input(&self, unit: &Unit) -> Result<Input, Mistake> {
        let number = |key: &'static str, quantity: &Quantity, unit: &Unit| {
            let unitless = |m: Mistake| m.with_help(format!("a number without a unit counts in `{unit}`"));
            let value = quantity.to(unit).map_err(|why| unitless(Mistake::new(key, why)))?;
            let finite = || Mistake::new(key, format!("an input must be finite, not {value}"));
            value.is_finite().then_some(value).ok_or_else(|| finite().with_help("give a number"))
        };
        let or_zero = |key: &'static str, quantity: &Option<Quantity>, unit: &Unit| {
            quantity.as_ref().map_or(Ok(0.0), |quantity| number(key, quantity, unit))
        };
        let known = Unit::known;
        Ok(match self {
            Self::Constant(value) => Input::Constant(number("constant", value, unit)?),
            Self::Step(step) => {
                let within = |m: Mistake| m.within("step");
                Input::Step {
                    time: or_zero("time", &step.time, &known("s")).map_err(within)?,
                    before: or_zero("before", &step.before, unit).map_err(within)?,
                    after: number("after", &step.after, unit).map_err(within)?,
                }
            }
            Self::Sine(sine) => {
                let within = |m: Mistake| m.within("sine");
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
    /// Data file: CSV, or MATLAB level 4 or 5; its path from the study's folder.
    pub file: String,
    /// Column of the time; its unit is the header's, else s.
    pub time: Option<String>,
    /// Unit of the time column, where its header does not say.
    pub time_unit: Option<String>,
    /// Column of the frequency, where frequency responses were measured instead of signals over time; its unit is the
    /// header's, else rad/s.
    pub frequency: Option<String>,
    /// Unit of the frequency column, where its header does not say: `Hz` or `rad/s`.
    pub frequency_unit: Option<String>,
    /// Measured frequency responses, by the output of a linear model: `y = { magnitude = "column", phase = "column" }` or
    /// `y = { real = "column", imaginary = "column" }`.
    #[serde(default)]
    pub responses: Entries<ResponseTable>,
    /// Measured signals: `theta = "column"`, or a table with `column`, `unit`, `scale`, `offset`, `noise`.
    #[serde(default)]
    pub channels: Entries<ChannelSection>,
    /// Recorded inputs: `u = "column"`, or a table with `column`, `unit`, `scale`, `offset`, `hold`. Between samples an
    /// input stays (`hold = "zero"`, the default) or moves on straight lines (`hold = "first"`).
    #[serde(default)]
    pub inputs: Entries<InputColumn>,
    /// What it is used for: `calibration` (the default), `selection` or `validation`.
    #[serde(default)]
    pub role: Role,
    /// States whose start values are estimated: `["phi", "theta"]`, or a table with `start`, `min`, `max` for each.
    #[serde(default)]
    pub free: FreeSection,
    /// Values of parameters that hold in this experiment.
    #[serde(default)]
    pub parameters: Entries<Quantity>,
    /// Time in the file from which it is used.
    pub from: Option<Quantity>,
    /// Time in the file up to which it is used.
    pub to: Option<Quantity>,
    /// Number of samples dropped at the start of the file; sensors often begin with a wrong one.
    #[serde(default)]
    pub skip: usize,
    /// `false` keeps the times of the file: the simulation begins at 0 s, and inputs are taken from the file from then on, also
    /// before `from`. Otherwise the simulation begins at the first sample used.
    pub reset_time: Option<bool>,
}

/// Where a measured frequency response stands in the file.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ResponseTable {
    /// Column of the real part.
    pub real: Option<String>,
    /// Column of the imaginary part.
    pub imaginary: Option<String>,
    /// Column of the magnitude: in dB where its header or `decibel` says so, else in the unit of its header, else in that of
    /// the output over that of the input.
    pub magnitude: Option<String>,
    /// Column of the phase: in the unit of its header, else deg.
    pub phase: Option<String>,
    /// `true` for a magnitude in dB whose header does not say so.
    #[serde(default)]
    pub decibel: bool,
}

/// Where a measured signal stands in the file, and what makes it the model's.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ChannelTable {
    /// Column of the file.
    pub column: String,
    /// Unit of the column; the header's, else the signal's, where absent.
    pub unit: Option<String>,
    /// Factor that the column is multiplied by, such as -1 for a sensor mounted the other way round.
    pub scale: Option<f64>,
    /// What is added after scaling, in the column's unit.
    pub offset: Option<Quantity>,
    /// Standard deviation of the noise; residuals are weighted by it.
    pub noise: Option<Quantity>,
}

/// Where a recorded input stands in the file.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct InputTable {
    /// Column of the file.
    pub column: String,
    /// Unit of the column; the header's, else the input's, where absent.
    pub unit: Option<String>,
    /// Factor that the column is multiplied by.
    pub scale: Option<f64>,
    /// What is added after scaling, in the column's unit.
    pub offset: Option<Quantity>,
    /// How it acts between samples: `zero` (the default: it stays until the next one, as a computer puts it out), `first`
    /// (straight lines from sample to sample, as for one that moves smoothly) or `band-limited` (nothing above half the sampling
    /// frequency, as for one that was filtered before it was sampled).
    pub hold: Option<Hold>,
}

/// A state whose start value is estimated; what is absent is read off the data.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct FreeTable {
    /// First guess.
    pub start: Option<Quantity>,
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
}

/// What every criterion may have beside its kind.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct CriterionCommon {
    /// The model it reads; needed where there are several.
    pub model: Option<String>,
    /// The cases it is evaluated in; all where absent.
    pub cases: Option<Vec<String>>,
    /// `minimise` (the default), `inequality`, `equality` or `monitor`.
    pub usage: Option<Usage>,
    /// The value to reach: the criterion is divided by it. Must be positive; some kinds have one of their own.
    pub demand: Option<Quantity>,
    /// Value that scales to 0, where a demand does not fit; goes with `bad`.
    pub good: Option<Quantity>,
    /// Value that scales to 1, where a demand does not fit; goes with `good`.
    pub bad: Option<Quantity>,
    /// Weight of its scaled value in the objective; 1 where absent.
    pub weight: Option<f64>,
}

impl CriterionCommon {
    pub const KEYS: &[&str] = &["model", "cases", "usage", "demand", "good", "bad", "weight"];
}

/// What every solver may have beside its kind.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SolverCommon {
    /// Largest number of points that are evaluated.
    pub max_evaluations: Option<usize>,
}

impl SolverCommon {
    pub const KEYS: &[&str] = &["max-evaluations"];
}

/// A text, or a table: `"column"` is short for `{ column = "column" }`.
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
                        f.write_str("the name of a column, or a table with `column`")
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
    hold: None
});

/// Free start values: a list of states, or a table.
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
