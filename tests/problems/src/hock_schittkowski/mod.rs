//! Smooth problems with bounds, inequalities and equalities.
//!
//! N.B.: an initial guess outside the bounds is moved to the nearest bound. Optima were compared with newer
//! computations, because some in the book, or in files derived from it, are wrong or are one of several.

pub(crate) mod common;
mod hs001_020;
mod hs021_040;
mod hs041_060;
mod hs061_070;
mod hs071_086;
mod hs088_100;
mod hs101_110;
mod hs111_119;
mod least_squares;
mod notation;

use crate::Suite;
use crate::problem::Problem;

pub(crate) const SUITE: Suite = Suite {
    name: "hock-schittkowski",
    about: "smooth problems with constraints, 2 to 16 variables",
    source: "W. Hock, K. Schittkowski, Test examples for nonlinear programming codes, Lecture Notes in Economics and \
             Mathematical Systems 187, Springer (1981)",
    accuracy: 1e-6,
    budget: |n| 1000 * (n + 1),
    problems,
};

fn problems() -> Vec<Problem> {
    let mut all: Vec<(u32, Problem)> = [
        hs001_020::problems(),
        hs021_040::problems(),
        hs041_060::problems(),
        hs061_070::problems(),
        hs071_086::problems(),
        hs088_100::problems(),
        hs101_110::problems(),
        hs111_119::problems(),
        least_squares::problems(),
    ]
    .into_iter()
    .flatten()
    .collect();
    all.sort_by_key(|(number, _)| *number);
    all.into_iter().map(|(_, problem)| problem).collect()
}
