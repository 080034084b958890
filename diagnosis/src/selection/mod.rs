//! Which effects a model lacks: sets of effects, fitted under the error models, compared by evidence and by forecast.

mod alignment;
mod baseline;
mod contradiction;
mod entry;
mod fitted_set;
mod forecast;
mod least_squares;
mod preparation;
mod refit;
mod screening;
mod search;
mod sets;
#[cfg(test)]
mod tests;
mod verdict;
mod widened;

pub(crate) use alignment::align;
#[cfg(test)]
pub(crate) use baseline::baseline;
pub(crate) use entry::entry;
pub(crate) use fitted_set::{FittedSet, Key, STRONG, estimation};
pub(crate) use forecast::{Forecasts, with_free_starts};
pub(crate) use preparation::{prepare, prepare_from, with_given, without_motion};
pub(crate) use refit::{WORSE, price};
pub(crate) use screening::{Screened, Screening};
pub(crate) use sets::{FittedSets, without};
pub(crate) use verdict::{Conclusion, Stated, Verdict, decide};
