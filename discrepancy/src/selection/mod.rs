//! Which effects a model lacks: sets of effects, fitted under the error models, compared by evidence and by forecast.

mod fitted_set;
mod forecast;
mod report;
mod screening;
mod search;
mod refit;

pub use report::{SetFit, SetOfEffects, compare, select};
