//! Inputs as written in a study file: constants, functions of time, and sums.

use std::fmt;

use mops_core::case::Hold;
use mops_language::Quantity;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, IntoDeserializer, MapAccess, SeqAccess, Visitor};

/// An input: a quantity for a constant, a function of time, or a list of these for their sum.
#[derive(Debug)]
pub(super) enum InputEntry {
    Constant(Quantity),
    Function(Box<InputSection>),
    Sum(Vec<InputEntry>),
}

impl<'de> Deserialize<'de> for InputEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AnyForm;
        impl<'de> Visitor<'de> for AnyForm {
            type Value = InputEntry;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a quantity, a table or a list")
            }
            fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<InputEntry, E> {
                Ok(InputEntry::Constant(number.into()))
            }
            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<InputEntry, E> {
                Quantity::deserialize(number.into_deserializer()).map(InputEntry::Constant)
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<InputEntry, E> {
                Quantity::deserialize(text.into_deserializer()).map(InputEntry::Constant)
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<InputEntry, M::Error> {
                let section = InputSection::deserialize(MapAccessDeserializer::new(map))?;
                Ok(InputEntry::Function(Box::new(section)))
            }
            fn visit_seq<S: SeqAccess<'de>>(self, list: S) -> Result<InputEntry, S::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(list)).map(InputEntry::Sum)
            }
        }
        deserializer.deserialize_any(AnyForm)
    }
}

impl JsonSchema for InputEntry {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "InputEntry".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = json_schema!({
            "anyOf": [generator.subschema_for::<Quantity>(), generator.subschema_for::<InputSection>()],
        });
        json_schema!({ "anyOf": [one, { "type": "array", "items": one, "minItems": 1, "maxItems": 1000 }] })
    }
}

/// An input as a function of time.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) enum InputSection {
    /// Constant value.
    Constant(Quantity),
    /// A step.
    Step(StepSection),
    /// A ramp.
    Ramp(RampSection),
    /// A pulse, or a train of pulses.
    Pulse(PulseSection),
    /// A doublet.
    Doublet(DoubletSection),
    /// A sine.
    Sine(SineSection),
    /// A sum of sines with a low peak.
    Multisine(MultisineSection),
    /// A sine of changing frequency.
    Chirp(ChirpSection),
    /// A pseudo-random binary sequence.
    Prbs(PrbsSection),
    /// Samples.
    Table(TableSection),
    /// A column of a data file.
    File(FileSection),
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

/// Linear change from one value to another.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct RampSection {
    /// Start; a number without a unit is in s. Default 0.
    pub time: Option<Quantity>,
    /// Time from the start to the end of the change; a number without a unit is in s.
    pub duration: Quantity,
    /// Value before the ramp; default 0.
    pub before: Option<Quantity>,
    /// Value after the ramp.
    pub after: Quantity,
}

/// Rectangular pulse, once or periodically.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct PulseSection {
    /// Start; a number without a unit is in s. Default 0.
    pub time: Option<Quantity>,
    /// Duration of the pulse; a number without a unit is in s.
    pub width: Quantity,
    /// Value during the pulse.
    pub value: Quantity,
    /// Value before and after the pulse; default 0.
    pub before: Option<Quantity>,
    /// Time from one pulse to the next; a number without a unit is in s. Default: one pulse.
    pub period: Option<Quantity>,
}

/// `offset + amplitude` for a time, then `offset - amplitude` for the same time.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct DoubletSection {
    /// Start; a number without a unit is in s. Default 0.
    pub time: Option<Quantity>,
    /// Duration of each half; a number without a unit is in s.
    pub width: Quantity,
    /// Amplitude.
    pub amplitude: Quantity,
    /// Value before and after; default 0.
    pub offset: Option<Quantity>,
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

/// Sum of sines of equal amplitude and evenly spaced frequencies, with the phases of Schroeder (1970), which keep its
/// peaks low.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct MultisineSection {
    /// Amplitude of each sine.
    pub amplitude: Quantity,
    /// Lowest frequency; a number without a unit is in Hz.
    pub from: Quantity,
    /// Highest frequency; a number without a unit is in Hz.
    pub to: Quantity,
    /// Number of sines.
    #[schemars(range(min = 2, max = 1000))]
    pub count: usize,
    /// Mean value; default 0.
    pub offset: Option<Quantity>,
}

/// Sine whose frequency changes; `offset` before its start and after its end.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ChirpSection {
    /// Amplitude.
    pub amplitude: Quantity,
    /// Frequency at the start; a number without a unit is in Hz.
    pub from: Quantity,
    /// Frequency at the end; a number without a unit is in Hz.
    pub to: Quantity,
    /// Start; a number without a unit is in s. Default 0.
    pub time: Option<Quantity>,
    /// Duration; a number without a unit is in s. Default: to the end of the simulation.
    pub duration: Option<Quantity>,
    /// Change of the frequency: `linear` in time (default), or `logarithmic`, so that equal times have equal frequency
    /// ratios.
    pub sweep: Option<Sweep>,
    /// Mean value; default 0.
    pub offset: Option<Quantity>,
}

/// Change of a frequency over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Sweep {
    /// Linear in time.
    Linear,
    /// Exponential in time: equal times have equal frequency ratios.
    Logarithmic,
}

/// Pseudo-random binary sequence: `offset + amplitude` or `offset - amplitude` in each interval, from a shift register
/// that starts with ones. It repeats after `2^stages - 1` intervals.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct PrbsSection {
    /// Amplitude.
    pub amplitude: Quantity,
    /// Shortest time between two changes; a number without a unit is in s.
    pub interval: Quantity,
    /// Number of stages of the shift register, 2 to 18; default 7.
    #[schemars(range(min = 2, max = 18))]
    pub stages: Option<usize>,
    /// Start; a number without a unit is in s. Default 0.
    pub time: Option<Quantity>,
    /// Mean value, also before the start; default 0.
    pub offset: Option<Quantity>,
}

/// Samples of an input. Before the first and after the last sample, the input is constant.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct TableSection {
    /// Times, increasing; numbers without a unit are in s.
    pub time: Vec<Quantity>,
    /// Values at these times.
    pub value: Vec<Quantity>,
    /// Values between the samples: `first` (default) is linear, `zero` constant until the next sample, `band-limited`
    /// without content above half the sampling frequency.
    pub hold: Option<Hold>,
}

/// Column of a data file. Before the first and after the last sample, the input is constant.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct FileSection {
    /// Data file: CSV, or MATLAB level 4 or 5; the path is relative to the folder of the study.
    pub path: String,
    /// Column of the file.
    pub column: String,
    /// Unit of the column; default is the unit in the header, else that of the input.
    pub unit: Option<String>,
    /// Factor applied to the column.
    pub scale: Option<f64>,
    /// Offset added after scaling, in the unit of the column.
    pub offset: Option<Quantity>,
    /// Values between the samples: `zero` (default) is constant until the next sample, `first` linear, `band-limited`
    /// without content above half the sampling frequency.
    pub hold: Option<Hold>,
    /// Time added to the times of the file.
    pub shift: Option<Quantity>,
    /// Time column; its unit is taken from the header, by default s.
    pub time: Option<String>,
    /// Unit of the time column, if its header has none.
    pub time_unit: Option<String>,
    /// Time between two samples, if the file has no time column; the first sample is at 0.
    pub sample_time: Option<Quantity>,
}
