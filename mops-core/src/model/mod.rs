//! Models: signals, parameters, states, inputs, and the analysis that criteria read.

mod joined;
mod linearised;
mod roughness;

pub use joined::Joined;
pub use linearised::{Linearise, Linearised, Resting, Rough};

use std::sync::Arc;

use mops_language::{Unit, suggestion};
use mops_linear::{Clock, StateSpace};
use nalgebra::DMatrix;
use serde::Serialize;

use crate::case::Case;
use crate::effect::{Placement, Port};
use crate::error::StudyError;
use crate::failure::Failure;
use crate::plant::{Ported, Selected};
use crate::trace::Trace;

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

/// Input of one analysis.
#[derive(Debug)]
pub struct Job<'a> {
    /// Case: inputs and, in an identification, measurements.
    pub case: &'a Case,
    /// Values of the model's parameters, in the order of [`Interface::parameters`].
    pub parameters: &'a [f64],
    /// Requested signals, as indices into [`Interface::signals`].
    pub signals: &'a [usize],
    /// End of the simulation, s.
    pub horizon: f64,
}

/// A model: computes the analysis of a case at given parameters.
///
/// An analysis is a pure function of the job: no state, no clock, no random numbers.
pub trait Model: Send + Sync {
    /// Returns the interface of the model.
    fn interface(&self) -> &Interface;

    /// Returns the assumptions made in reading the model, one sentence each; `mops check` prints them.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Analyses one case.
    ///
    /// # Errors
    /// A [`Failure`] ranks worse than every success; it is counted and reported and does not end the run. A long
    /// simulation polls `job.case.cancellation` and returns [`Failure::Cancelled`] once cancellation is requested.
    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure>;

    /// Computes the analysis and its directional derivatives along `seeds`, each with one number per parameter. The
    /// analysis must be bitwise equal to the result of [`Model::analyse`]. `None` means that exact derivatives are not
    /// available and finite differences are used.
    fn tangents(&self, _job: &Job<'_>, _seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        None
    }

    /// Returns the states of the model equations if [`Model::local`] is available. Their initial values are the
    /// parameters named in [`Interface::states`], else 0.
    fn equation_states(&self) -> Vec<Variable> {
        Vec::new()
    }

    /// Returns the initial values of [`Model::equation_states`] if they are not simply parameters.
    fn start_values(&self, _parameters: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Returns the delays of the equations, s: one for each quantity whose delayed value they contain.
    ///
    /// # Errors
    /// Returns an error if the model is not defined for the parameters.
    fn delays(&self, _parameters: &[f64]) -> Result<Vec<f64>, Failure> {
        Ok(Vec::new())
    }

    /// Returns the clocks of the equations, whose memory is among [`Model::equation_states`].
    ///
    /// # Errors
    /// Returns an error if the model is not defined for the parameters.
    fn clocks(&self, _parameters: &[f64]) -> Result<Vec<Clock>, Failure> {
        Ok(Vec::new())
    }

    /// Returns the reason why the equations have no linearisation, if so.
    fn not_linear(&self) -> Option<&'static str> {
        None
    }

    /// Returns the model with its loops cut at variables: for each, a new input of this name acts in its place, and a
    /// new signal is minus the value that the model computes. `None` if the model has no loop that can be cut.
    ///
    /// # Errors
    /// The model has no such variable.
    fn cut(&self, _variables: &[String]) -> Option<Result<Cut, StudyError>> {
        None
    }

    /// Returns the constants of the model that [`Model::with_constant`] can change, with their values in their units.
    fn constants(&self) -> Vec<(Variable, f64)> {
        Vec::new()
    }

    /// Returns the model with another value of a constant, in its unit; `None` without such a constant, or if the model
    /// is not defined for the value.
    fn with_constant(&self, _name: &str, _value: f64) -> Option<Arc<dyn Model>> {
        None
    }

    /// Returns the open model, for access at its ports; `None` if the model has no ports.
    fn ported(&self) -> Option<&dyn Ported> {
        None
    }

    /// Returns the nominal model and the added effects if the model is augmented. The parameters are those of the
    /// nominal model, followed by those of the effects. Further effects are added to the nominal model.
    fn augmented(&self) -> Option<(&Arc<dyn Model>, &[Placement])> {
        None
    }

    /// Returns the linearised equations at an operating point; `None` if the model cannot be linearised.
    fn local(&self, _at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
        None
    }
}

/// Model with cut loops.
pub struct Cut {
    /// The model.
    pub model: Arc<dyn Model>,
    /// For each variable, by their indices: the input that acts in its place, and the signal that is minus the value
    /// that the model computes.
    pub ends: Vec<[usize; 2]>,
}

/// Operating point at which the model equations are evaluated.
#[derive(Debug, Clone, Copy)]
pub struct OperatingPoint<'a, S = f64> {
    /// Values of the parameters, in the order of [`Interface::parameters`].
    pub parameters: &'a [S],
    /// Values of the states, in the order of [`Model::equation_states`].
    pub states: &'a [S],
    /// Values of the inputs, in the order of [`Interface::inputs`].
    pub inputs: &'a [S],
    /// Delayed values of the quantities in [`Model::delays`].
    pub past: &'a [S],
    /// True at an equilibrium, or during the search for one: no joint then has dry friction, whatever its speed. If
    /// false, dry friction is omitted only for joints with practically zero speed; the others slide in their direction
    /// of motion.
    pub at_rest: bool,
}

/// Model equations at an operating point, with exact derivatives: the data of a linearisation.
#[derive(Debug, Clone)]
pub struct Local {
    /// Rates of change of the states; of the memory of a clock, its change at an instant.
    pub rates: Vec<f64>,
    /// Values of the signals, in the order of [`Interface::signals`].
    pub signals: Vec<f64>,
    /// Values of the quantities in [`Model::delays`], without delay.
    pub past: Vec<f64>,
    /// Derivatives of the rates, then of the signals, then of the quantities in [`Model::delays`] (rows), with respect
    /// to the states, then to the inputs, then to the delayed quantities (columns).
    pub slopes: DMatrix<f64>,
    /// Joints whose dry friction is omitted, as names of their positions: dry friction at rest has no derivative.
    pub frictionless: Vec<String>,
    /// Values that conditions select, as their derivatives with respect to the columns of `slopes`.
    pub selected: Vec<Selected<Vec<f64>>>,
    /// Limit beyond which the point lies although the equations are those within it.
    pub exceeded: Option<&'static str>,
}

/// An analysis and its directional derivatives: one analysis of the same form per direction.
pub type WithTangents = (Analysis, Vec<Analysis>);

/// Result of an analysis.
#[derive(Debug, Clone)]
pub enum Analysis {
    /// A simulation.
    Time(Response),
    /// A linear system.
    Linear(StateSpace),
}

impl Analysis {
    /// Returns the simulation, if the analysis is one.
    pub fn response(&self) -> Option<&Response> {
        match self {
            Self::Time(response) => Some(response),
            Self::Linear(_) => None,
        }
    }

    /// Returns the linear system, if the analysis is one.
    pub fn linear(&self) -> Option<&StateSpace> {
        match self {
            Self::Linear(system) => Some(system),
            Self::Time(_) => None,
        }
    }

    /// Returns the trace of a signal.
    ///
    /// # Panics
    /// Panics if the analysis is not a simulation or the signal was not requested. Both are checked when the study is
    /// built.
    pub fn trace(&self, signal: &str) -> &Trace {
        self.response().and_then(|response| response.trace(signal)).expect("checked when the study is built")
    }

    /// Returns the analysis moved by `distance` along its derivative `tangent`, to first order.
    #[must_use]
    pub fn moved(&self, tangent: &Self, distance: f64) -> Self {
        match (self, tangent) {
            (Self::Time(response), Self::Time(tangent)) => Self::Time(response.moved(tangent, distance)),
            (Self::Linear(system), Self::Linear(tangent)) => Self::Linear(system.moved(tangent, distance)),
            _ => unreachable!("a derivative has the form of its analysis"),
        }
    }

    /// Returns the largest distance up to which [`Analysis::moved`] keeps the order of the instants at which signals
    /// jump or bend; NaN if instants coincide whose order changes with the parameters.
    pub fn room(&self, tangent: &Self) -> f64 {
        match (self, tangent) {
            (Self::Time(response), Self::Time(tangent)) => {
                let room = |((_, trace), (_, tangent)): (&(String, Trace), &(String, Trace))| trace.room(tangent);
                let least = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) };
                response.traces.iter().zip(&tangent.traces).map(room).fold(f64::INFINITY, least)
            }
            _ => f64::INFINITY,
        }
    }
}

/// A simulated response: one trace for every requested signal.
#[derive(Debug, Clone, Default)]
pub struct Response {
    /// Names and traces.
    pub traces: Vec<(String, Trace)>,
    /// Discrete events during the simulation (a joint stuck, a limit reached), in order of time.
    pub events: Vec<Event>,
    /// Computational work.
    pub work: Work,
}

impl Response {
    /// Returns the trace of a signal, if the signal was requested.
    pub fn trace(&self, signal: &str) -> Option<&Trace> {
        self.traces.iter().find(|(name, _)| name == signal).map(|(_, trace)| trace)
    }

    fn moved(&self, tangent: &Self, distance: f64) -> Self {
        let moved = |((name, trace), (_, tangent)): (&(String, Trace), &(String, Trace))| {
            (name.clone(), trace.moved(tangent, distance))
        };
        Self { traces: self.traces.iter().zip(&tangent.traces).map(moved).collect(), ..self.clone() }
    }
}

/// A discrete event of a simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Time, s.
    pub time: f64,
    /// Description, such as `arm sticks`.
    pub what: String,
}

/// Computational work of a simulation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Work {
    /// Accepted steps.
    pub steps: usize,
    /// Steps rejected by the error control.
    pub rejected: usize,
    /// Evaluations of the right-hand side.
    pub derivatives: usize,
    /// Accepted steps in which rounding, not the tolerance, determined the error of at least one state.
    pub rough: usize,
}
