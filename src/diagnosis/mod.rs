//! Output files of a diagnosis besides its report: block of `result.json`, predictions, recalibrated study.

pub(crate) mod errors;
#[cfg(test)]
pub(crate) mod made_up;
#[cfg(feature = "cli")]
mod predictions;
#[cfg(feature = "cli")]
mod repaired;
#[cfg(feature = "cli")]
mod source;
pub(crate) mod words;

#[cfg(feature = "cli")]
pub(crate) use predictions::predictions;
#[cfg(feature = "cli")]
pub(crate) use repaired::{Original, repaired};
#[cfg(feature = "cli")]
pub(crate) use source::source;

#[cfg(test)]
mod tests;
