//! Problems with known answers, to measure solvers with: for tests, for `mops-bench`, and to read.
//!
//! Every problem is written once, over [`mops_core::Scalar`]: values come from plain numbers, exact slopes from dual ones.
//! A run ([`mops_core::Run`]) solves it as it solves a study: same budget, same cache, same slopes by differences.

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

pub use formula::{Formula, Functions, Outputs};
pub use measure::{FrontFound, Measured, Truth, measure};
pub use posed::{Posed, Slope};
pub use problem::{Answer, Problem, Sense};

/// A suite: problems that belong together.
#[derive(Debug, Clone, Copy)]
pub struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// What it holds, in one sentence.
    pub about: &'static str,
    /// Where its definitions come from.
    pub source: &'static str,
    /// Accuracy that counts as solved, relative to the larger of 1 and the size of the optimum.
    pub accuracy: f64,
    /// Points a run may evaluate, for so many variables.
    pub budget: fn(usize) -> usize,
    /// Its problems.
    pub problems: fn() -> Vec<Problem>,
}

/// Every suite. A new one is a file, and a line here.
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
