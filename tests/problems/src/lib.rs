//! Problems with known answers to measure solvers: for tests, for `mops-bench` and as a reference.
//!
//! Every problem is written once, over [`mops_language::Scalar`]: plain numbers give values, dual numbers exact
//! gradients. A run ([`mops_core::Run`]) solves a problem as it solves a study, with the same budget, cache and finite
//! differences.

mod arithmetic;
pub mod bbob;
mod bounds;
mod formula;
mod fronts;
mod hock_schittkowski;
mod measure;
mod minimax;
mod more_wild;
mod posed;
mod problem;
mod suite;

pub use formula::{Formula, Functions, Outputs};
pub use measure::{FrontFound, Measured, Truth, measure};
pub use posed::{Posed, Slope};
pub use problem::{Answer, Problem, Sense};
pub use suite::Suite;

/// Returns every suite. A new suite is one file and one line here.
pub fn suites() -> Vec<Suite> {
    vec![
        hock_schittkowski::SUITE,
        minimax::SUITE,
        more_wild::SMOOTH,
        more_wild::PIECEWISE,
        more_wild::NOISY,
        bbob::SUITE,
        fronts::ZDT,
        fronts::DTLZ,
        fronts::WFG,
        fronts::CONSTRAINED,
    ]
}
