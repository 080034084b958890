//! What a model is: signals, parameters, states, inputs, and the analysis that criteria read.

use std::sync::Arc;

use nalgebra::DMatrix;
use serde::Serialize;

use crate::case::Case;
use crate::effect::Placement;
use crate::failure::Failure;
use crate::linear::StateSpace;
use crate::plant::Open;
use crate::port::Port;
use crate::trace::Trace;
use crate::unit::Unit;

/// A named quantity of a model: a signal it offers, a parameter it takes, or an input that drives it.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Name, as it stands in study files.
    pub name: String,
    /// Unit in which the model computes.
    pub unit: Unit,
    /// What it is, in one line.
    pub about: String,
}

impl Variable {
    /// A variable whose unit is written in the program.
    ///
    /// # Panics
    /// If `unit` is not a unit.
    pub fn new(name: impl Into<String>, unit: &str, about: impl Into<String>) -> Self {
        Self { name: name.into(), unit: Unit::known(unit), about: about.into() }
    }
}

/// A parameter of a model.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name, unit and meaning.
    pub variable: Variable,
    /// Value where the study gives none; without it the study must give one.
    pub default: Option<f64>,
    /// Smallest and largest meaningful value.
    pub range: [f64; 2],
    /// Whether it may be infinite, which takes away what it stands for: an integral time, the stiffness of a rigid coupling.
    pub infinite: bool,
}

impl Parameter {
    /// A parameter that may take any finite value.
    pub fn new(name: impl Into<String>, unit: &str, about: impl Into<String>) -> Self {
        let range = [f64::NEG_INFINITY, f64::INFINITY];
        Self { variable: Variable::new(name, unit, about), default: None, range, infinite: false }
    }

    /// Gives it a value where the study does not.
    #[must_use]
    pub fn with_default(mut self, value: f64) -> Self {
        self.default = Some(value);
        self
    }

    /// Lets it be infinite.
    #[must_use]
    pub fn or_infinite(mut self) -> Self {
        self.infinite = true;
        self
    }

    /// Restricts it to values from `low` to `high`.
    #[must_use]
    pub fn within(mut self, low: f64, high: f64) -> Self {
        self.range = [low, high];
        self
    }
}

/// A state whose start value an experiment may leave free.
#[derive(Debug, Clone)]
pub struct State {
    /// Name of the state.
    pub name: String,
    /// Name of the parameter that is its start value.
    pub start: String,
    /// The signal that shows it, if one does.
    pub signal: Option<String>,
    /// The signal of which it is the rate of change, if it is one.
    pub rate_of: Option<String>,
}

/// What a model offers and takes; fixed once it is built.
#[derive(Debug, Clone, Default)]
pub struct Interface {
    /// What criteria can read.
    pub signals: Vec<Variable>,
    /// What tuners, cases and the study can set.
    pub parameters: Vec<Parameter>,
    /// States with a start value.
    pub states: Vec<State>,
    /// What experiments and cases can drive; 0 where nothing does.
    pub inputs: Vec<Variable>,
    /// Places where a missing effect may act.
    pub ports: Vec<Port>,
    /// End of the simulation, s, where no experiment gives one.
    pub horizon: Option<f64>,
    /// What its analyses are: criteria refuse a model of the other sort.
    pub analysis: AnalysisKind,
}

impl Interface {
    /// Number of forces that may act from outside: one for every [`Port::Process`].
    pub fn forces(&self) -> usize {
        self.ports.iter().filter(|port| matches!(port, Port::Process { .. })).count()
    }
}

/// What a model gives to criteria.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AnalysisKind {
    /// A simulation: signals over time.
    #[default]
    Time,
    /// A linear system: poles and frequency responses.
    Linear,
}

/// What one analysis is asked for.
#[derive(Debug)]
pub struct Job<'a> {
    /// The case: inputs and, in an identification, what was measured.
    pub case: &'a Case,
    /// Values of the model's parameters, in the order of [`Interface::parameters`].
    pub parameters: &'a [f64],
    /// Signals that are wanted, as indices into [`Interface::signals`].
    pub signals: &'a [usize],
    /// End of the simulation, s.
    pub horizon: f64,
}

/// A model: turns parameters and a case into something criteria can read.
///
/// An analysis is a pure function of the job: no state, no clock, no random numbers.
pub trait Model: Send + Sync {
    /// What it offers and takes.
    fn interface(&self) -> &Interface;

    /// Assumptions made in reading the model, one sentence each; `mops check` prints them.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Analyses one case.
    ///
    /// # Errors
    /// A [`Failure`] is a value that loses against every success; it is counted and reported, and ends nothing. A simulation
    /// that takes long looks at `job.case.cancellation` and fails with [`Failure::Cancelled`] once an end is requested.
    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure>;

    /// The analysis and its derivative along each of the `seeds`, which have one number per parameter of the model. The
    /// analysis must have the same bits as [`Model::analyse`] gives. `None`: there are no exact derivatives, and slopes
    /// come from differences.
    fn tangents(&self, _job: &Job<'_>, _seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        None
    }

    /// The states of the model's equations, where it offers [`Model::local`]; the start value of each is the parameter that
    /// [`Interface::states`] names, else 0.
    fn equation_states(&self) -> Vec<Variable> {
        Vec::new()
    }

    /// Values of [`Model::equation_states`] at the start, where they are not just those of parameters.
    fn start_values(&self, _parameters: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// The model opened at its ports, where it has some.
    fn ported(&self) -> Option<&dyn Open> {
        None
    }

    /// The model without the effects that were added to it, and these effects, where it is such a model: its parameters are
    /// those of the model, then the strengths. More effects are added to the model without.
    fn augmented(&self) -> Option<(&Arc<dyn Model>, &[Placement])> {
        None
    }

    /// The equations at an operating point, to linearise the model there. `None`: it has none that can be linearised.
    fn local(&self, _at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
        None
    }
}

/// Where the equations of a model are looked at.
#[derive(Debug, Clone, Copy)]
pub struct OperatingPoint<'a, S = f64> {
    /// Values of the parameters, in the order of [`Interface::parameters`].
    pub parameters: &'a [S],
    /// Values of the states, in the order of [`Model::equation_states`].
    pub states: &'a [S],
    /// Values of the inputs, in the order of [`Interface::inputs`].
    pub inputs: &'a [S],
    /// Whether the model rests there, or a search for such a point passes: no joint then has dry friction, whatever its
    /// speed. Else joints have none whose speed is as good as 0, and the others slide the way they move.
    pub at_rest: bool,
}

/// The equations of a model at an operating point, with their exact slopes: what a linear system is made of.
#[derive(Debug, Clone)]
pub struct Local {
    /// Rates of change of the states.
    pub rates: Vec<f64>,
    /// Values of the signals, in the order of [`Interface::signals`].
    pub signals: Vec<f64>,
    /// Derivative of the rates, then of the signals (rows), by the states, then by the inputs (columns).
    pub slopes: DMatrix<f64>,
    /// The joints whose dry friction is left out, by the names of their positions: at rest it has no slope.
    pub frictionless: Vec<String>,
}

/// An analysis, and its derivatives: one analysis of the same form per direction.
pub type WithTangents = (Analysis, Vec<Analysis>);

/// What an analysis gives.
#[derive(Debug, Clone)]
pub enum Analysis {
    /// A simulation.
    Time(Response),
    /// A linear system.
    Linear(StateSpace),
}

impl Analysis {
    /// The simulation, if it is one.
    pub fn response(&self) -> Option<&Response> {
        match self {
            Self::Time(response) => Some(response),
            Self::Linear(_) => None,
        }
    }

    /// The linear system, if it is one.
    pub fn linear(&self) -> Option<&StateSpace> {
        match self {
            Self::Linear(system) => Some(system),
            Self::Time(_) => None,
        }
    }

    /// The trace of a signal.
    ///
    /// # Panics
    /// If the analysis is no simulation or the signal was not asked for: both are checked when the study is built.
    pub fn trace(&self, signal: &str) -> &Trace {
        self.response().and_then(|response| response.trace(signal)).expect("checked when the study is built")
    }

    /// This analysis moved by `distance` along its derivative `tangent`, to first order.
    #[must_use]
    pub fn moved(&self, tangent: &Self, distance: f64) -> Self {
        match (self, tangent) {
            (Self::Time(response), Self::Time(tangent)) => Self::Time(response.moved(tangent, distance)),
            (Self::Linear(system), Self::Linear(tangent)) => Self::Linear(system.moved(tangent, distance)),
            _ => unreachable!("a derivative has the form of its analysis"),
        }
    }
}

/// A simulated response: a trace for every signal that was asked for.
#[derive(Debug, Clone, Default)]
pub struct Response {
    /// Names and traces.
    pub traces: Vec<(String, Trace)>,
    /// Discrete events on the way (a joint stuck, a limit reached), in order of time.
    pub events: Vec<Event>,
    /// Work done.
    pub work: Work,
}

impl Response {
    /// The trace of a signal, if it was asked for.
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
    /// When, s.
    pub time: f64,
    /// What happened, such as `arm sticks`.
    pub what: String,
}

/// What a simulation cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Work {
    /// Steps accepted.
    pub steps: usize,
    /// Steps rejected by the error control.
    pub rejected: usize,
    /// Evaluations of the right-hand side.
    pub derivatives: usize,
    /// Accepted steps in which rounding of the states, not the tolerance, decided over the error of one of them.
    pub rough: usize,
}
