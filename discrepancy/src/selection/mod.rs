//! Which effects a model lacks: sets of effects, fitted under the error models, compared by evidence and by forecast.

mod baseline;
mod coverage;
mod fitted_set;
mod forecast;
mod refit;
mod report;
mod screening;
mod search;
#[cfg(test)]
mod tests;
mod verdict;

pub use report::{Selection, SetFit, SetOfEffects, compare, select};
pub use verdict::{Conclusion, Entry, Stated, Verdict};
