//! Declaration of a case in `case.json`, and its conversion to a study.

use std::fmt::Write;
use std::path::Path;

use mops::Unit;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::matching::matched;

/// Version of the format of `case.json`.
const FORMAT: u32 = 1;

/// Case of a folder, `case.json`: equations of a plant with unknown parameters, and the data files measured on it.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(title = "mops-bench case, format 1")]
pub(crate) struct Declared {
    /// Version of this format: 1, which is also the default.
    #[serde(default = "format")]
    format: u32,
    /// States of the plant.
    states: Vec<Named>,
    /// Inputs of the plant; none for a free motion.
    #[serde(default)]
    inputs: Vec<Named>,
    /// Measured outputs.
    pub(super) outputs: Vec<Output>,
    /// Equations, one for each state, in any order: `m*v' = u - b*v`. A prime marks the time derivative.
    equations: Vec<String>,
    /// Unknown parameters, which the diagnosis calibrates.
    parameters: Vec<Parameter>,
    /// Known constants: a number each, or an object with the number in `value`.
    #[serde(default)]
    constants: Map<String, Value>,
    /// Course of the inputs between samples, by its first word: `zero` (or `zoh`; the default), `first` (or `foh`, or
    /// any text with `linear`), `band-limited`.
    input_hold: Option<String>,
    /// Places at which an effect may be missing, `kind:name` with the kinds `process`, `joint`, `sensor`, `actuator`.
    /// The answer uses the same spelling.
    #[serde(default)]
    pub(super) locations: Vec<String>,
    /// Meaning of a place, for equations that cannot be assigned to states by their form: `... (3rd equation)`.
    #[serde(default)]
    location_meaning: Map<String, Value>,
    /// Data files (CSV), in the folder of the case, with the time in column `t`. `calibration*` is fitted,
    /// `validation*` and `selection*` select effects, all others are held out.
    pub(super) files: Vec<String>,
}

fn format() -> u32 {
    FORMAT
}

/// State or input.
#[derive(Debug, Deserialize, JsonSchema)]
struct Named {
    /// Name in the equations.
    name: String,
    /// Unit; 1 where absent or unknown.
    #[serde(default)]
    unit: String,
    /// Column of the data files; the name where absent.
    column: Option<String>,
}

/// Measured output.
#[derive(Debug, Deserialize, JsonSchema)]
pub(super) struct Output {
    /// Name.
    pub name: String,
    /// Unit; 1 where absent or unknown.
    #[serde(default)]
    unit: String,
    /// Column of the data files; the name where absent.
    column: Option<String>,
    /// State that is measured; the state of the output's name where this and `expression` are absent.
    equals_state: Option<String>,
    /// Expression of states, inputs and parameters that is measured; may also be called `equation` or `equals`.
    #[serde(alias = "equation", alias = "equals")]
    expression: Option<String>,
    /// Standard deviation of the measurement noise, quantisation included; may also be called `noise_std` or `noise`.
    /// Estimated from the data where absent.
    #[serde(alias = "noise_std", alias = "noise")]
    noise_std_total: Option<f64>,
}

/// Unknown parameter.
#[derive(Debug, Deserialize, JsonSchema)]
struct Parameter {
    /// Name in the equations.
    name: String,
    /// Unit; 1 where absent or unknown.
    #[serde(default)]
    unit: String,
    /// Initial guess.
    guess: f64,
    /// Lower bound; where it is positive, the parameter is searched on a logarithmic scale.
    lower: f64,
    /// Upper bound.
    upper: f64,
}

/// Returns the JSON schema of `case.json`.
pub(crate) fn schema() -> String {
    let schema = schemars::schema_for!(Declared);
    serde_json::to_string_pretty(&schema).expect("a schema is JSON") + "\n"
}

/// Returns a text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Returns the inline table `{ name = value, .. }`.
fn table(entries: impl Iterator<Item = (String, String)>) -> String {
    let entries: Vec<String> = entries.map(|(name, value)| format!("{} = {value}", quoted(&name))).collect();
    format!("{{ {} }}", entries.join(", "))
}

impl Output {
    /// Returns the state that is measured, if the output is a state.
    fn state(&self) -> Option<&str> {
        self.equals_state.as_deref().or_else(|| self.expression.is_none().then_some(self.name.as_str()))
    }
}

impl Declared {
    /// Reads a `case.json`.
    ///
    /// # Errors
    /// If the text is not a valid `case.json`.
    pub fn read(text: &str) -> Result<Self, String> {
        // N.B.: a file may contain both forms of the noise; the total is used.
        let mut value: Value = serde_json::from_str(text).map_err(|error| format!("case.json: {error}"))?;
        for output in value["outputs"].as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
            if output.contains_key("noise_std_total") {
                output.remove("noise_std");
            }
        }
        let declared: Self = serde_json::from_value(value).map_err(|error| format!("case.json: {error}"))?;
        if declared.format != FORMAT {
            return Err(format!("case.json: expected format {FORMAT}, found {}", declared.format));
        }
        Ok(declared)
    }

    /// Returns true if the equations hold for the numbers only: they contain constants without unit, and some quantity
    /// has a unit other than the coherent SI unit, so that the constants would change with it.
    pub fn is_numeric(&self) -> bool {
        let named = self.states.iter().chain(&self.inputs).map(|named| &named.unit);
        let units = named.chain(self.parameters.iter().map(|p| &p.unit)).chain(self.outputs.iter().map(|o| &o.unit));
        !self.constants.is_empty() && units.filter_map(|unit| Unit::parse(unit).ok()).any(|unit| !unit.is_coherent())
    }

    /// Returns the study file of the case, with data in the folder.
    ///
    /// # Errors
    /// If a state has no equation, or the input hold is unknown.
    pub fn study(&self, name: &str, folder: &Path) -> Result<String, String> {
        let mut text = format!("[study]\nname = {}\ntask = \"diagnosis\"\n\n[models.plant.equations]\n", quoted(name));
        let mut line = |key: &str, value: String| writeln!(text, "{key} = {value}").expect("a text takes everything");
        // A unit as a TOML string; `"1"` if unknown or not to be used.
        let is_numeric = self.is_numeric();
        let unit = |text: &str| quoted(if !is_numeric && Unit::parse(text).is_ok() { text } else { "1" });
        let units = |all: &[Named]| table(all.iter().map(|n| (n.name.clone(), unit(&n.unit))));
        line("states", units(&self.states));
        if !self.inputs.is_empty() {
            line("inputs", units(&self.inputs));
        }
        line("parameters", table(self.parameters.iter().map(|p| (p.name.clone(), unit(&p.unit)))));
        if !self.constants.is_empty() {
            line("constants", table(self.constants.iter().map(|(name, value)| (name.clone(), number(value)))));
        }
        let more = self.outputs.iter().filter(|o| o.state() != Some(o.name.as_str()));
        let more = more.map(|o| {
            let value = o.expression.as_deref().or(o.equals_state.as_deref()).unwrap_or_default();
            (o.name.clone(), format!("{{ value = {}, unit = {} }}", quoted(value), unit(&o.unit)))
        });
        let more: Vec<(String, String)> = more.collect();
        if !more.is_empty() {
            line("outputs", table(more.into_iter()));
        }
        let states: Vec<String> = self.states.iter().map(|s| s.name.clone()).collect();
        text.push_str("\n[models.plant.equations.der]\n");
        for (state, equation) in states.iter().zip(matched(&states, &self.equations, &self.meant())?) {
            writeln!(text, "{} = {}", quoted(state), quoted(equation)).expect("a text takes everything");
        }
        text.push_str("\n[tuners]\n");
        for Parameter { name, guess, lower, upper, .. } in &self.parameters {
            let scale = if *lower > 0.0 { ", scale = \"log\"" } else { "" };
            let name = quoted(name);
            writeln!(text, "{name} = {{ start = {guess:?}, min = {lower:?}, max = {upper:?}{scale} }}")
                .expect("a text takes everything");
        }
        let hold = self.hold()?;
        for file in &self.files {
            text.push_str(&self.experiment(file, hold, folder));
        }
        Ok(text)
    }

    /// Returns the hold of the inputs between samples, as spelt in a study.
    fn hold(&self) -> Result<&'static str, String> {
        let hold = self.input_hold.as_deref().unwrap_or("zero");
        let starts = |words: &[&str]| words.iter().any(|word| hold.starts_with(word));
        if self.inputs.is_empty() || starts(&["zoh", "zero"]) {
            Ok("zero")
        } else if starts(&["foh", "first"]) || hold.contains("linear") {
            Ok("first")
        } else if starts(&["band-limited"]) {
            Ok("band-limited")
        } else {
            Err(format!("case.json: expected `input_hold` zero, first or band-limited, found `{hold}`"))
        }
    }

    fn experiment(&self, file: &str, hold: &str, folder: &Path) -> String {
        let (stem, path) = (stem(file), std::path::absolute(folder.join(file)).unwrap_or_else(|_| folder.join(file)));
        let role = match stem {
            _ if stem.starts_with("calibration") => "calibration",
            _ if stem.starts_with("validation") || stem.starts_with("selection") => "selection",
            _ => "validation",
        };
        let inputs = self.inputs.iter().map(|i| {
            let column = quoted(i.column.as_deref().unwrap_or(&i.name));
            (i.name.clone(), format!("{{ column = {column}, hold = \"{hold}\" }}"))
        });
        let channels = self.outputs.iter().map(|o| {
            let column = quoted(o.column.as_deref().unwrap_or(&o.name));
            let noise = o.noise_std_total.map_or_else(String::new, |noise| format!(", noise = {noise:?}"));
            (o.name.clone(), format!("{{ column = {column}{noise} }}"))
        });
        let free: Vec<String> = self.states.iter().map(|s| quoted(&s.name)).collect();
        let (inputs, channels, free) = (table(inputs), table(channels), free.join(", "));
        let file = quoted(&path.display().to_string());
        let inputs = if self.inputs.is_empty() { String::new() } else { format!("inputs = {inputs}\n") };
        format!(
            "\n[experiments.{}]\nfile = {file}\ntime = \"t\"\n{inputs}channels = {channels}\nfree = [{free}]\nrole = \"{role}\"\n",
            quoted(stem)
        )
    }

    /// Returns pairs of state and equation (indices) from the meanings of places:
    /// `equation of the angle th (3rd equation)`. If the place is a position, this is the equation of its speed.
    fn meant(&self) -> Vec<(usize, usize)> {
        let state = |name: &str| self.states.iter().position(|s| s.name == name);
        let meanings = self.location_meaning.iter().filter_map(|(name, meaning)| {
            let ordinal = meaning.as_str()?.split(" equation)").next()?.rsplit('(').next()?;
            let number: usize = ordinal.trim_end_matches(|c: char| c.is_ascii_alphabetic()).parse().ok()?;
            let squeezed = |text: &str| text.split_whitespace().collect::<String>();
            let rate =
                self.equations.iter().find_map(|e| squeezed(e).strip_prefix(&format!("{name}'=")).and_then(state));
            Some((rate.or_else(|| state(name))?, number.checked_sub(1)?))
        });
        meanings.collect()
    }
}

/// Returns a constant: a number, or the `value` of an object.
fn number(value: &Value) -> String {
    let value = value.get("value").unwrap_or(value);
    value.as_f64().map_or_else(|| "nan".to_owned(), |number| format!("{number:?}"))
}

/// Returns a file name without its extension.
pub(super) fn stem(file: &str) -> &str {
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}
