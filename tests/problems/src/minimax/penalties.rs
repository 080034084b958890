//! Constrained problems as exact penalty functions.

use mops_language::Scalar;

use crate::arithmetic::{fourth, penalised};
use crate::formula::Functions;
use crate::hock_schittkowski::common::{hs43, hs100, hs113, wong3};
use crate::problem::Problem;

pub(super) fn problems() -> Vec<Problem> {
    vec![
        Problem::new("Rosen-Suzuki", &[0.0; 4], -44.0, Functions::of(rosen_suzuki, rosen_suzuki)),
        Problem::new("Polak6", &[0.0; 4], -44.0, Functions::of(polak6, polak6)),
        Problem::new("Wong1", &[1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0], 680.6300574, Functions::of(wong1, wong1)),
        Problem::new("Wong2", &WONG2, 24.30620907, Functions::of(wong2, wong2)),
        Problem::new("Wong3", &WONG3, 133.7282762, Functions::of(all_of_wong3, all_of_wong3)),
    ]
}

pub(super) const WONG2: [f64; 10] = [2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0];
pub(super) const WONG3: [f64; 20] =
    [2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0, 2.0, 2.0, 6.0, 15.0, 1.0, 2.0, 1.0, 2.0, 1.0, 3.0];

fn rosen_suzuki<S: Scalar>(x: &[S]) -> Vec<S> {
    penalised(10.0, &hs43(x))
}

/// Rosen and Suzuki's functions of nonlinearly transformed coordinates.
fn polak6<S: Scalar>(x: &[S]) -> Vec<S> {
    let first = x[0] - fourth(x[3] + 1.0);
    rosen_suzuki(&[first, x[1] - fourth(first), x[2], x[3]])
}

fn wong1<S: Scalar>(x: &[S]) -> Vec<S> {
    penalised(10.0, &hs100(x))
}

fn wong2<S: Scalar>(x: &[S]) -> Vec<S> {
    penalised(10.0, &hs113(x))
}

fn all_of_wong3<S: Scalar>(x: &[S]) -> Vec<S> {
    let (f, constraints) = wong3(x);
    penalised(10.0, &[vec![f], constraints.concat()].concat())
}
