//! Which effects a model lacks: sets of effects, fitted under the error models, compared by evidence and by forecast.

mod alignment;
mod baseline;
mod coverage;
mod fitted_set;
mod forecast;
mod preparation;
mod refit;
mod report;
mod screening;
mod search;
#[cfg(test)]
mod tests;
mod verdict;

pub(crate) use alignment::align;
#[cfg(test)]
pub(crate) use baseline::baseline;
pub(crate) use fitted_set::{FittedSet, Key, estimation};
pub(crate) use forecast::{Forecasts, with_free_starts};
pub(crate) use preparation::{prepare, with_given};
pub(crate) use refit::price;
pub(crate) use screening::{Scene as Screening, Screened};
pub(crate) use search::{Search, without};
pub(crate) use verdict::{decide, entry};

pub use report::{Selection, SetFit, SetOfEffects, compare, select};
pub use verdict::{Conclusion, Entry, Stated, Verdict};
