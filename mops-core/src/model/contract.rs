//! What a model does: simulation and linearisation.

use std::sync::Arc;

use mops_linear::Clock;
use nalgebra::DMatrix;

use super::analysis::{Analysis, WithTangents};
use super::interface::{Interface, Variable};
use crate::case::Case;
use crate::effect::Placement;
use crate::error::StudyError;
use crate::failure::Failure;
use crate::plant::{Ported, Selected};

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
