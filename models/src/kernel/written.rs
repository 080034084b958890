//! A model whose simulation and equations are written once over the scalar.

use mops_core::{
    Along, Analysis, Failure, Interface, Job, Local, Model, Open, OperatingPoint, Plant, Scalar, Variable, WithTangents,
};

use super::{Equations, Simulate, Tolerance, analyse, local, tangents};

/// What a model tells beside its simulation and its equations; [`Kernel`] makes a [`Model`] of all three.
pub trait Written: Simulate + Equations + Send + Sync {
    /// What it offers and takes.
    fn interface(&self) -> &Interface;

    /// The states of its equations.
    fn states(&self) -> Vec<Variable>;

    /// Accuracy and limits of its simulations.
    fn tolerance(&self) -> Tolerance;

    /// Its plant, opened at the ports of its interface, where that has some.
    ///
    /// # Errors
    /// Parameters for which it is not defined.
    fn plant<'a, S: Scalar>(&'a self, _parameters: &'a [S]) -> Result<Box<dyn Plant<S> + 'a>, Failure> {
        Err(Failure::Undefined("the model has no ports".into()))
    }
}

/// The model: simulated, with exact tangents, linearised, and open at its ports.
pub struct Kernel<M>(pub M);

impl<M: Written> Model for Kernel<M> {
    fn interface(&self) -> &Interface {
        self.0.interface()
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        analyse(&self.0, job)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        Some(tangents(&self.0, job, seeds))
    }

    fn equation_states(&self) -> Vec<Variable> {
        self.0.states()
    }

    fn local(&self, at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
        Some(local(&self.0, at))
    }

    fn ported(&self) -> Option<&dyn Open> {
        (!self.0.interface().ports.is_empty()).then_some(self)
    }
}

impl<M: Written> Open for Kernel<M> {
    fn open<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure> {
        self.0.plant(parameters)
    }

    fn open_along<'a>(&'a self, parameters: &'a [Along]) -> Result<Box<dyn Plant<Along> + 'a>, Failure> {
        self.0.plant(parameters)
    }

    fn tolerance(&self) -> Tolerance {
        self.0.tolerance()
    }
}
