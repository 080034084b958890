//! Studies: models, cases, tuners and criteria that belong together. A [`Study`] is valid once built.

mod build;
mod distribution;
mod draft;
mod moved;
mod rows;
mod scenarios;
pub mod task;
mod tuner;
mod uncertain;
mod valid;
mod wildcard;

pub use crate::error::StudyError;
pub use tuner::{Grid, Scale, Tuner};
pub use wildcard::matches_pattern;

pub use distribution::{Distribution, Uncertain};
pub use draft::{
    CaseBuilder, ChannelBuilder, CriterionBuilder, Free, Measured, ModelBuilder, StudyBuilder, TunerBuilder,
};
pub use scenarios::Scenario;
pub use uncertain::{DistributionBuilder, UncertainBuilder};

pub use rows::{JobPlan, ParameterSource, Row};
pub use valid::Study;
