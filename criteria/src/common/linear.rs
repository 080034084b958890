//! Common parts of criteria of linear systems: channel, value type, criterion.

use mops_core::{Analysis, Case, Criterion, Interface, Sense, StudyError, Value, Variable};
use mops_language::{Unit, suggestion};
use mops_linear::{Loop, StateSpace};
use schemars::JsonSchema;
use serde::Deserialize;

/// System whose poles or gains are evaluated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Of {
    /// The system itself.
    #[default]
    System,
    /// The closed loop with unity feedback, with the system as loop transfer function.
    ClosedLoop,
}

/// Input and output of a criterion.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Indices in the system.
    input: usize,
    output: usize,
    /// Unit of the output divided by that of the input.
    pub unit: Unit,
    /// Names and units of the input and the output.
    ends: [Variable; 2],
    /// Factor of the output: 1 except for a loop whose ends have different units of one dimension.
    factor: f64,
    /// True for a loop transfer function.
    is_loop: bool,
    /// True for cut loops. Read as a loop, the other loops are closed; otherwise all are open.
    is_cut: bool,
}

impl Channel {
    /// Selects the channel by names, which may be omitted if the model has one input, or one output, or if the input is
    /// that of a cut loop.
    pub fn bind(model: &Interface, input: Option<&String>, output: Option<&String>) -> Result<Self, StudyError> {
        let input = pick("input", input, &model.inputs)?;
        let output = if model.is_cut && output.is_none() { input } else { pick("output", output, &model.signals)? };
        let (from, to) = (model.inputs[input].unit.difference(), model.signals[output].unit.difference());
        let unit = match (to.to_string().as_str(), from.to_string().as_str()) {
            (to, "1") => Unit::known(to).difference(),
            (to, from) if to == from => Unit::one(),
            (to, from) => Unit::known(&format!("({to})/({from})")),
        };
        let ends = [model.inputs[input].clone(), model.signals[output].clone()];
        Ok(Self { input, output, unit, ends, factor: 1.0, is_loop: false, is_cut: model.is_cut })
    }

    /// Converts the channel to a loop transfer function: the output is fed back to the input, hence expressed in its
    /// unit.
    ///
    /// # Errors
    /// If the output does not have the dimension of the input.
    pub fn in_loop(self) -> Result<Self, StudyError> {
        let [from, to] = &self.ends;
        if self.is_cut && self.input != self.output {
            let fact = format!("the output of the loop cut at `{0}` is `-{0}`, not `{1}`", from.name, to.name);
            return Err(StudyError::new("output", fact).with_help("remove `output`"));
        }
        if !to.unit.is_compatible(&from.unit) {
            let fact = format!(
                "unity feedback cannot close a loop from `{}` in {} to `{}` in {}",
                from.name, from.unit, to.name, to.unit
            );
            return Err(StudyError::here(fact).with_help(
                "input and output of a loop need the same dimension: add the controller and the sensor to the model, or \
                 use another input or output",
            ));
        }
        let factor = to.unit.factor() / from.unit.factor();
        Ok(Self { factor, is_loop: true, ..self })
    }

    /// Returns the channel as a system, or as a loop transfer function.
    ///
    /// # Errors
    /// See [`Channel::in_loop`].
    pub fn read_as(self, of: Of) -> Result<Self, StudyError> {
        match of {
            Of::System => Ok(self),
            Of::ClosedLoop => self.in_loop(),
        }
    }

    /// Returns the system from the input to the output. If it is a loop, the other cut loops are closed.
    pub fn system(&self, analysis: &Analysis) -> Result<StateSpace, String> {
        let linear = analysis.linear().expect("checked when the study is built");
        if self.is_cut && self.is_loop {
            return linear.loop_at_a_time(self.input);
        }
        let mut system = linear.channel(self.input, self.output);
        if self.factor != 1.0 {
            system.c *= self.factor;
            system.d *= self.factor;
        }
        Ok(system)
    }
}

fn pick(key: &str, name: Option<&String>, known: &[Variable]) -> Result<usize, StudyError> {
    let names = || known.iter().map(|v| v.name.as_str());
    match name {
        Some(name) => names().position(|n| n == name).ok_or_else(|| {
            let names: Vec<&str> = names().collect();
            StudyError::new(key, format!("the model has no {key} `{name}`")).with_help(suggestion(name, names))
        }),
        None if known.len() == 1 => Ok(0),
        None => {
            let names: Vec<&str> = names().collect();
            Err(StudyError::here(format!("the model has {} {key}s, and the criterion names none", known.len()))
                .with_help(format!("add {key} = one of {}", names.join(", "))))
        }
    }
}

/// Unit, sense and range of the values of a criterion.
#[derive(Debug, Clone)]
pub struct Values {
    unit: Unit,
    sense: Sense,
    range: [f64; 2],
    demand: Option<f64>,
}

impl Values {
    /// Creates values that may be any number.
    pub fn of(unit: Unit, sense: Sense) -> Self {
        Self { unit, sense, range: [f64::NEG_INFINITY, f64::INFINITY], demand: None }
    }

    /// Limits the values to the range from `low` to `high`.
    pub fn within(self, low: f64, high: f64) -> Self {
        Self { range: [low, high], ..self }
    }

    /// Sets the default demand.
    pub fn demanding(self, demand: f64) -> Self {
        Self { demand: Some(demand), ..self }
    }
}

/// Criterion computed from one channel of a linear system.
pub struct LinearCriterion<F> {
    channel: Channel,
    values: Values,
    /// Function from the system of the channel to the value.
    value: F,
}

impl<F: Fn(StateSpace) -> Result<Value, String> + Send + Sync + 'static> LinearCriterion<F> {
    /// Creates the boxed criterion.
    pub fn boxed(channel: Channel, values: Values, value: F) -> Box<dyn Criterion> {
        Box::new(Self { channel, values, value })
    }
}

impl<F: Fn(StateSpace) -> Result<Value, String> + Send + Sync> Criterion for LinearCriterion<F> {
    fn unit(&self) -> Unit {
        self.values.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.channel.ends[1].name.clone()]
    }

    fn sense(&self) -> Sense {
        self.values.sense
    }

    fn range(&self) -> [f64; 2] {
        self.values.range
    }

    fn natural_demand(&self) -> Option<f64> {
        self.values.demand
    }

    fn feedback_channel(&self) -> Option<[String; 2]> {
        self.channel.is_loop.then(|| self.channel.ends.clone().map(|end| end.name))
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        (self.value)(self.channel.system(analysis)?)
    }
}

/// Returns a margin, limited to `most` and then noted.
pub fn capped(margin: f64, most: f64) -> Value {
    if margin > most { Value::noted(most, "infinite or above the limit") } else { margin.into() }
}

/// Returns the poles of the system or of the closed loop.
pub fn poles(system: &StateSpace, of: Of) -> Result<Vec<mops_linear::Complex>, String> {
    let poles = match of {
        Of::System => system.poles()?,
        Of::ClosedLoop => system.closed_loop_poles(1.0)?,
    };
    if poles.is_empty() { Err("the system has no poles".to_owned()) } else { Ok(poles) }
}

/// Returns the loop with this transfer function.
pub fn feedback(system: StateSpace) -> Result<Loop, String> {
    Loop::new(system)
}
