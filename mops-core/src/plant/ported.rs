//! Models whose plant is open at its ports, so that effects can be added.

use mops_language::{Dual7, Scalar};

use super::Plant;
use crate::effect::{BoundEffect, Effect};
use crate::failure::Failure;
use crate::plant::Tolerance;

/// A model whose plant can be had, with its ports.
pub trait Ported: Send + Sync {
    /// Returns the plant at the given parameter values.
    ///
    /// # Errors
    /// Returns an error if the model is not defined for the parameters.
    fn plant<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure>;

    /// Returns the plant with tangents, at parameter values with tangents.
    ///
    /// # Errors
    /// Returns an error as [`Ported::plant`] does.
    fn dual_plant<'a>(&'a self, parameters: &'a [Dual7]) -> Result<Box<dyn Plant<Dual7> + 'a>, Failure>;

    /// Returns the accuracy and the limits of simulations of the model.
    fn tolerance(&self) -> Tolerance;
}

/// Scalar type of plants with ports and of effects: a number, or a number with tangents.
pub trait PlantScalar: Scalar {
    /// Calls [`Ported::plant`] or [`Ported::dual_plant`].
    ///
    /// # Errors
    /// Returns an error as these functions do.
    fn plant<'a>(model: &'a dyn Ported, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure>;

    /// Calls [`Effect::bind`] or [`Effect::bind_dual`].
    fn bind(effect: &dyn Effect, parameters: &[Self]) -> Box<dyn BoundEffect<Self>>;
}

impl PlantScalar for f64 {
    fn plant<'a>(model: &'a dyn Ported, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure> {
        model.plant(parameters)
    }
    fn bind(effect: &dyn Effect, parameters: &[Self]) -> Box<dyn BoundEffect<Self>> {
        effect.bind(parameters)
    }
}

impl PlantScalar for Dual7 {
    fn plant<'a>(model: &'a dyn Ported, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure> {
        model.dual_plant(parameters)
    }
    fn bind(effect: &dyn Effect, parameters: &[Self]) -> Box<dyn BoundEffect<Self>> {
        effect.bind_dual(parameters)
    }
}
