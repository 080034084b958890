//! Models given by their plants.

use std::sync::Arc;

use mops_core::model::Cut;
use mops_core::{Failure, Input, Interface, Model, Plant, StudyError, Variable};
use mops_language::Scalar;

use super::Tolerance;

/// Plant that is written once over the scalar, with its interface; [`super::Simulated`] turns it into a model.
///
/// [`Interface::states`] names the states; a state with a signal has the unit of that signal. Effects act at
/// [`Interface::ports`], in the order of the forces `w` that the plant adds to its equations.
pub trait PlantModel: Send + Sync {
    /// Returns the interface of the model: parameters, inputs, signals, states and ports.
    fn interface(&self) -> &Interface;

    /// Returns the plant at these values of the parameters.
    ///
    /// # Errors
    /// The parameters are outside the domain of the model.
    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure>;

    /// Returns the plant to which effects are added, if it is a different object.
    ///
    /// # Errors
    /// See [`PlantModel::plant`].
    fn ported_plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        self.plant(parameters)
    }

    /// Returns the states of the plant, in order.
    fn states(&self) -> Vec<Variable> {
        let Interface { states, signals, .. } = self.interface();
        let variable = |name: &str, signal: Option<&String>| {
            let shown = signals.iter().find(|v| signal.is_some_and(|signal| v.name == *signal));
            shown.map_or_else(|| Variable::new(name, "1", "state"), |v| Variable { name: name.to_owned(), ..v.clone() })
        };
        states.iter().map(|state| variable(&state.name, state.signal.as_ref())).collect()
    }

    /// Returns the default of an input, by its index, for cases that do not give it; `None` means zero.
    fn input(&self, _index: usize) -> Option<&Input> {
        None
    }

    /// Returns the accuracy and the limits of the simulations.
    fn tolerance(&self) -> Tolerance {
        Tolerance::default()
    }

    /// Returns the reason why the model has no linearisation, if so; see [`Model::not_linear`].
    fn not_linear(&self) -> Option<&'static str> {
        None
    }

    /// Returns the model with its loops cut at variables; see [`Model::cut`].
    fn cut(&self, _variables: &[String]) -> Option<Result<Cut, StudyError>> {
        None
    }

    /// Returns the constants that can be changed; see [`Model::constants`].
    fn constants(&self) -> Vec<(Variable, f64)> {
        Vec::new()
    }

    /// Returns the model with another value of a constant; see [`Model::with_constant`].
    fn with_constant(&self, _name: &str, _value: f64) -> Option<Arc<dyn Model>> {
        None
    }

    /// Returns the assumptions made in reading the model, one sentence each.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Returns for each signal the index of the state that it equals, if any. A state equals the signal that the interface
/// gives for it. A state that is not in the interface equals the signal of its own name.
pub(crate) fn shown(interface: &Interface, states: &[Variable]) -> Vec<Option<usize>> {
    let signal_of = |state: &Variable| match interface.states.iter().find(|s| s.name == state.name) {
        Some(named) => named.signal.clone(),
        None => Some(state.name.clone()),
    };
    let signals: Vec<Option<String>> = states.iter().map(signal_of).collect();
    interface.signals.iter().map(|v| signals.iter().position(|signal| signal.as_ref() == Some(&v.name))).collect()
}
