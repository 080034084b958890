//! Smooth problems with constraints.

pub(crate) mod common;
