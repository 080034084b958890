//! Tests of the common parts of criteria.

mod comparison;
mod linear;
mod part;
mod step;
