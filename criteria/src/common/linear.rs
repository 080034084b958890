//! What criteria of linear systems share: the channel they read, and a value computed from it.

use mops_core::linear::Loop;
use mops_core::{Analysis, Case, Criterion, Interface, Mistake, Sense, StateSpace, Unit, Value, Variable, suggestion};
use schemars::JsonSchema;
use serde::Deserialize;

/// Which poles or gains are looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Of {
    /// Those of the system itself.
    #[default]
    System,
    /// Those of the closed loop with unity feedback, of which the system is the loop transfer function.
    ClosedLoop,
}

/// The input and the output that a criterion looks at.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Indices in the system.
    input: usize,
    output: usize,
    /// Name of the output.
    signal: String,
    /// Unit of the output over that of the input.
    pub unit: Unit,
}

impl Channel {
    /// The channel of these names; they may be left out where the model has one input, or one output.
    pub fn bind(model: &Interface, input: Option<&String>, output: Option<&String>) -> Result<Self, Mistake> {
        let input = pick("input", input, &model.inputs)?;
        let output = pick("output", output, &model.signals)?;
        let (from, to) = (model.inputs[input].unit.difference(), model.signals[output].unit.difference());
        let unit = match (to.to_string().as_str(), from.to_string().as_str()) {
            (to, "1") => Unit::known(to).difference(),
            (to, from) if to == from => Unit::one(),
            (to, from) => Unit::known(&format!("({to})/({from})")),
        };
        Ok(Self { input, output, signal: model.signals[output].name.clone(), unit })
    }

    /// The system from the input to the output.
    pub fn system(&self, analysis: &Analysis) -> StateSpace {
        analysis.linear().expect("checked when the study is built").channel(self.input, self.output)
    }
}

fn pick(key: &str, name: Option<&String>, known: &[Variable]) -> Result<usize, Mistake> {
    let names = || known.iter().map(|v| v.name.as_str());
    match name {
        Some(name) => names().position(|n| n == name).ok_or_else(|| {
            let names: Vec<&str> = names().collect();
            Mistake::new(key, format!("the model has no {key} `{name}`")).with_help(suggestion(name, names))
        }),
        None if known.len() == 1 => Ok(0),
        None => {
            let names: Vec<&str> = names().collect();
            Err(Mistake::here(format!(
                "the model has {} {key}s, and the criterion does not say which it reads",
                known.len()
            ))
            .with_help(format!("add {key} = one of {}", names.join(", "))))
        }
    }
}

/// What the values of a criterion are.
#[derive(Debug, Clone)]
pub struct Values {
    unit: Unit,
    sense: Sense,
    range: [f64; 2],
}

impl Values {
    /// Values of which any number is possible.
    pub fn of(unit: Unit, sense: Sense) -> Self {
        Self { unit, sense, range: [f64::NEG_INFINITY, f64::INFINITY] }
    }

    /// Only values from `low` to `high` are possible.
    pub fn within(self, low: f64, high: f64) -> Self {
        Self { range: [low, high], ..self }
    }
}

/// A criterion that is computed from one channel of a linear system.
pub struct LinearCriterion<F> {
    channel: Channel,
    values: Values,
    /// The value for the system of the channel.
    value: F,
}

impl<F: Fn(StateSpace) -> Result<Value, String> + Send + Sync + 'static> LinearCriterion<F> {
    /// The criterion, ready to be given away.
    pub fn boxed(channel: Channel, values: Values, value: F) -> Box<dyn Criterion> {
        Box::new(Self { channel, values, value })
    }
}

impl<F: Fn(StateSpace) -> Result<Value, String> + Send + Sync> Criterion for LinearCriterion<F> {
    fn unit(&self) -> Unit {
        self.values.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.channel.signal.clone()]
    }

    fn sense(&self) -> Sense {
        self.values.sense
    }

    fn range(&self) -> [f64; 2] {
        self.values.range
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        (self.value)(self.channel.system(analysis))
    }
}

/// A margin, which may be infinite: then `most` stands for it, with a word on it.
pub fn capped(margin: f64, most: f64) -> Value {
    if margin > most { Value::noted(most, "infinite, or as good as") } else { margin.into() }
}

/// The poles that are looked at, for criteria of all poles.
pub fn poles(system: &StateSpace, of: Of) -> Result<Vec<mops_core::linear::Complex>, String> {
    let poles = match of {
        Of::System => system.poles()?,
        Of::ClosedLoop => system.complementary_sensitivity()?.poles()?,
    };
    if poles.is_empty() { Err("the system has no poles".to_owned()) } else { Ok(poles) }
}

/// The loop with this transfer function.
pub fn feedback(system: StateSpace) -> Result<Loop, String> {
    Loop::new(system)
}
