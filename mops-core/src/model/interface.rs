//! Interface of a model: its parameters, states, inputs and signals.

use mops_language::{Unit, suggestion};

use crate::effect::Port;
use crate::error::StudyError;

/// A named quantity of a model: a signal it offers, a parameter it takes, or an input that drives it.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Name used in study files.
    pub name: String,
    /// Unit in which the model computes.
    pub unit: Unit,
    /// Description in one line.
    pub about: String,
}

impl Variable {
    /// Creates a variable from a unit symbol.
    ///
    /// # Panics
    /// Panics if `unit` is not a unit.
    pub fn new(name: impl Into<String>, unit: &str, about: impl Into<String>) -> Self {
        Self { name: name.into(), unit: Unit::known(unit), about: about.into() }
    }
}

/// A parameter of a model.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name, unit and meaning.
    pub variable: Variable,
    /// Default value; without one, the study must give a value.
    pub default: Option<f64>,
    /// Smallest and largest meaningful value.
    pub range: [f64; 2],
    /// True if an infinite value is allowed and disables the effect of the parameter: an integral time, the stiffness
    /// of a rigid coupling.
    pub infinite: bool,
}

impl Parameter {
    /// Creates a parameter that may take any finite value.
    pub fn new(name: impl Into<String>, unit: &str, about: impl Into<String>) -> Self {
        let range = [f64::NEG_INFINITY, f64::INFINITY];
        Self { variable: Variable::new(name, unit, about), default: None, range, infinite: false }
    }

    /// Sets the default value.
    #[must_use]
    pub fn with_default(mut self, value: f64) -> Self {
        self.default = Some(value);
        self
    }

    /// Allows an infinite value.
    #[must_use]
    pub fn or_infinite(mut self) -> Self {
        self.infinite = true;
        self
    }

    /// Restricts the value to the range from `low` to `high`.
    #[must_use]
    pub fn within(mut self, low: f64, high: f64) -> Self {
        self.range = [low, high];
        self
    }
}

/// A state whose initial value an experiment may leave free.
#[derive(Debug, Clone)]
pub struct State {
    /// Name of the state.
    pub name: String,
    /// Name of the parameter that sets the initial value.
    pub start: String,
    /// Signal that equals the state, if there is one.
    pub signal: Option<String>,
    /// Signal whose rate of change is this state, if there is one.
    pub rate_of: Option<String>,
}

/// Signals, parameters, states, inputs and ports of a model; fixed once the model is built.
#[derive(Debug, Clone, Default)]
pub struct Interface {
    /// Signals that criteria can read.
    pub signals: Vec<Variable>,
    /// Parameters that tuners, cases and the study can set.
    pub parameters: Vec<Parameter>,
    /// States with an initial value.
    pub states: Vec<State>,
    /// Inputs that experiments and cases can drive; 0 if undriven.
    pub inputs: Vec<Variable>,
    /// Places where a missing effect may act.
    pub ports: Vec<Port>,
    /// Default end of the simulation, s, if no experiment gives one.
    pub horizon: Option<f64>,
    /// Kind of the analyses of the model; criteria reject models of the other kind.
    pub analysis: AnalysisKind,
    /// True for a loop transfer function of cut loops: each signal belongs to the input with its index, to which it
    /// returns, with negative sign, where the loop is closed.
    pub is_cut: bool,
}

impl Interface {
    /// Returns the ports that effects act at; a joint represents the equation of its speed.
    pub fn places(&self) -> impl Iterator<Item = &Port> {
        self.ports.iter().filter(|port| port.kind(&self.ports).is_some())
    }

    /// Returns the signal of this name.
    ///
    /// # Errors
    /// Returns an error at the key `signal`, with similar names, if there is no such signal.
    pub fn signal(&self, name: &str) -> Result<&Variable, StudyError> {
        let index = self.signal_index(name)?;
        Ok(&self.signals[index])
    }

    /// Returns the index of the signal of this name.
    ///
    /// # Errors
    /// As [`Self::signal`].
    pub fn signal_index(&self, name: &str) -> Result<usize, StudyError> {
        self.signals.iter().position(|signal| signal.name == name).ok_or_else(|| {
            StudyError::new("signal", format!("the model has no signal `{name}`"))
                .with_help(suggestion(name, self.signals.iter().map(|signal| signal.name.as_str())))
        })
    }

    /// Returns the number of external forces: one for every [`Port::Process`].
    pub fn forces(&self) -> usize {
        self.ports.iter().filter(|port| matches!(port, Port::Process { .. })).count()
    }
}

/// Kind of analysis that a model provides to criteria.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AnalysisKind {
    /// A simulation: signals over time.
    #[default]
    Time,
    /// A linear system: poles and frequency responses.
    Linear,
}
