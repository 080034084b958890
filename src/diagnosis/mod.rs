//! What a diagnosis leaves behind beside its report: its block of `result.json`, predictions, the repaired model.

mod block;
pub(crate) mod errors;
#[cfg(test)]
pub(crate) mod made_up;
mod predictions;
mod repaired;
mod source;
pub(crate) mod words;

pub(crate) use block::block;
pub(crate) use predictions::predictions;
pub(crate) use repaired::{Original, repaired};
pub(crate) use source::source;
