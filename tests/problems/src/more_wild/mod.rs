//! `more-wild`: 53 problems for derivative-free solvers, from 22 functions; smooth, piecewise smooth and noisy. Solvers
//! see only the sum.

mod data;
mod functions;

use mops_language::Scalar;
use mops_math as math;

use crate::{Answer, Formula, Functions, Problem, Suite};
use functions::{residuals, start};

const SOURCE: &str = "J. J. More, S. M. Wild, SIAM J. Optimization 20 (2009) 172-191; functions: J. J. More, B. S. Garbow, \
                      K. E. Hillstrom, ACM Transactions on Mathematical Software 7 (1981) 17-41";

pub(crate) const SMOOTH: Suite = Suite {
    name: "more-wild",
    about: "53 derivative-free problems: sums of squares, passed to the solver as one number",
    source: SOURCE,
    accuracy: 1e-5,
    budget: |n| 100 * (n + 1),
    problems: || all(Kind::Smooth),
};

pub(crate) const PIECEWISE: Suite = Suite {
    name: "more-wild-piecewise",
    about: "the 53 problems of `more-wild` with sums of absolute values",
    source: SOURCE,
    accuracy: 1e-3,
    budget: |n| 100 * (n + 1),
    problems: || all(Kind::Piecewise),
};

pub(crate) const NOISY: Suite = Suite {
    name: "more-wild-noisy",
    about: "the 53 problems of `more-wild` with deterministic noise of 0.1 %",
    source: SOURCE,
    accuracy: 1e-3,
    budget: |n| 100 * (n + 1),
    problems: || all(Kind::Noisy),
};

/// Combination of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Sum of squares.
    Smooth,
    /// Sum of absolute values.
    Piecewise,
    /// Sum of squares times `1 + 1e-3 phi(x)`, with a polynomial of sines for `phi`.
    Noisy,
}

/// Function, variables, residuals, and the power of ten that scales the initial guess. From the table of the paper, in
/// the order of its data file; the rows were not checked against it.
const TABLE: [(u32, usize, usize, i32); 53] = [
    (1, 9, 45, 0),
    (1, 9, 45, 1),
    (2, 7, 35, 0),
    (2, 7, 35, 1),
    (3, 7, 35, 0),
    (3, 7, 35, 1),
    (4, 2, 2, 0),
    (4, 2, 2, 1),
    (5, 3, 3, 0),
    (5, 3, 3, 1),
    (6, 4, 4, 0),
    (6, 4, 4, 1),
    (7, 2, 2, 0),
    (7, 2, 2, 1),
    (8, 3, 15, 0),
    (8, 3, 15, 1),
    (9, 4, 11, 0),
    (10, 3, 16, 0),
    (11, 6, 31, 0),
    (11, 6, 31, 1),
    (11, 9, 31, 0),
    (11, 9, 31, 1),
    (11, 12, 31, 0),
    (11, 12, 31, 1),
    (12, 3, 10, 0),
    (13, 2, 10, 0),
    (14, 4, 20, 0),
    (14, 4, 20, 1),
    (15, 6, 6, 0),
    (15, 7, 7, 0),
    (15, 8, 8, 0),
    (15, 9, 9, 0),
    (15, 10, 10, 0),
    (15, 11, 11, 0),
    (16, 10, 10, 0),
    (17, 5, 33, 0),
    (18, 11, 65, 0),
    (18, 11, 65, 1),
    (19, 8, 8, 0),
    (19, 10, 12, 0),
    (19, 11, 14, 0),
    (19, 12, 16, 0),
    (20, 5, 5, 0),
    (20, 6, 6, 0),
    (20, 8, 8, 0),
    (21, 5, 5, 0),
    (21, 5, 5, 1),
    (21, 8, 8, 0),
    (21, 10, 10, 0),
    (21, 12, 12, 0),
    (21, 12, 12, 1),
    (22, 8, 8, 0),
    (22, 8, 8, 1),
];

fn all(kind: Kind) -> Vec<Problem> {
    let of = |&(function, n, m, power): &(u32, usize, usize, i32)| {
        let start: Vec<f64> = start(function, n).into_iter().map(|x| x * math::powi(10.0, power)).collect();
        let name = format!("{function} n{n} m{m}{}", if power > 0 { " far" } else { "" });
        let functions = Functions::with(Summed { function, m, kind });
        let least = if kind == Kind::Smooth { least(function, n, m) } else { None };
        Problem::new(&name, &start, least.map_or(Answer::Unknown, Answer::from), functions)
    };
    TABLE.iter().map(of).collect()
}

/// Returns the published minimum of the sum of squares, if any.
///
/// Source: More, Garbow, Hillstrom (1981), the minima listed with each function; cube and heart: their residuals vanish
/// at a point. N.B.: for Chebyquad with ten variables the paper lists the local minimum 6.50395e-3.
fn least(function: u32, n: usize, m: usize) -> Option<f64> {
    #[allow(clippy::cast_precision_loss)]
    let (variables, rows) = (n as f64, m as f64);
    Some(match (function, n) {
        (1, _) => rows - variables,
        (2, _) => rows * (rows - 1.0) / (2.0 * (2.0 * rows + 1.0)),
        (3, _) => (rows * rows + 3.0 * rows - 6.0) / (2.0 * (2.0 * rows - 3.0)),
        (8, _) => 8.21487e-3,
        (9, _) => 3.07505e-4,
        (10, _) => 87.9458,
        (11, 6) => 2.28767e-3,
        (11, 9) => 1.39976e-6,
        (11, 12) => 4.72238e-10,
        (13, _) => 124.362,
        (14, _) => 85822.2,
        (15, 8) => 3.51687e-3,
        (17, _) => 5.46489e-5,
        (18, _) => 4.01377e-2,
        (4..=7 | 12 | 16 | 20 | 22, _) | (15, 6 | 7 | 9) => 0.0,
        _ => return None,
    })
}

/// Combination of the residuals into one number.
struct Summed {
    function: u32,
    m: usize,
    kind: Kind,
}

impl Formula for Summed {
    fn at<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        // Some of the piecewise smooth functions are undefined for negative variables.
        let clipped = self.kind == Kind::Piecewise && [8, 9, 13, 16, 17, 18].contains(&self.function);
        let x: Vec<S> = x.iter().map(|x| if clipped && x.value() < 0.0 { S::from(0.0) } else { *x }).collect();
        let residuals = residuals(self.function, self.m, &x);
        let sum = |term: fn(S) -> S| residuals.iter().fold(S::from(0.0), |sum, r| sum + term(*r));
        let squares = |r: S| r * r;
        vec![match self.kind {
            Kind::Smooth => sum(squares),
            Kind::Piecewise => sum(S::abs),
            Kind::Noisy => sum(squares) * (noise(&x) * 1e-3 + 1.0),
        }]
    }
}

/// `phi (4 phi^2 - 3)` of a product of sines: between -1 and 1.
fn noise<S: Scalar>(x: &[S]) -> f64 {
    let values = || x.iter().map(|x| x.value().abs());
    let (one, two) = (values().sum::<f64>(), values().map(|x| x * x).sum::<f64>().sqrt());
    let phi = 0.9 * math::sin(100.0 * one) * math::cos(100.0 * values().fold(0.0, f64::max)) + 0.1 * math::cos(two);
    phi * (4.0 * phi * phi - 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn smooth(function: u32, n: usize) -> Problem {
        let index = TABLE.iter().position(|row| row.0 == function && row.1 == n && row.3 == 0).unwrap();
        all(Kind::Smooth).swap_remove(index)
    }

    #[test]
    fn there_are_53_problems_and_they_are_defined_at_their_starts() {
        for kind in [Kind::Smooth, Kind::Piecewise, Kind::Noisy] {
            let problems = all(kind);
            assert_eq!(problems.len(), 53);
            assert!(problems.iter().all(|p| p.functions.values(&p.start)[0].is_finite()));
        }
    }

    /// Source: More, Garbow, Hillstrom (1981), the minima listed with each function.
    #[test]
    fn functions_have_their_published_minima() {
        let known: [(u32, usize, &[f64], f64, f64); 6] = [
            (4, 2, &[1.0, 1.0], 0.0, 1e-20),
            (5, 3, &[1.0, 0.0, 0.0], 0.0, 1e-20),
            (7, 2, &[5.0, 4.0], 0.0, 1e-20),
            (7, 2, &[11.4128, -0.89681], 48.9842, 1e-3),
            (8, 3, &[0.082411, 1.133036, 2.343695], 8.21487e-3, 1e-7),
            (12, 3, &[1.0, 10.0, 1.0], 0.0, 1e-20),
        ];
        for (function, n, x, least, tolerance) in known {
            let value = smooth(function, n).functions.values(x)[0];
            assert!((value - least).abs() <= tolerance, "{function}: {value} {least}");
        }
    }

    #[test]
    fn least_values_are_those_at_known_minimisers() {
        let minimisers: [(u32, usize, usize, &[f64]); 5] = [
            (5, 3, 3, &[1.0, 0.0, 0.0]),
            (6, 4, 4, &[0.0; 4]),
            (12, 3, 10, &[1.0, 10.0, 1.0]),
            (20, 5, 5, &[1.0; 5]),
            (16, 10, 10, &[1.0; 10]),
        ];
        for (function, n, m, x) in minimisers {
            let value = smooth(function, n).functions.values(x)[0];
            assert!((value - least(function, n, m).unwrap()).abs() < 1e-20, "{function}: {value}");
        }
        // Rank one: any x with sum of j x_j = 3 / (2 m + 1).
        let (n, m) = (7, 35);
        let mut x = [0.0; 7];
        x[0] = 3.0 / (2.0 * 35.0 + 1.0);
        let value = smooth(2, n).functions.values(&x)[0];
        assert!((value - least(2, n, m).unwrap()).abs() < 1e-10, "{value}");
        x[0] += 1e-4;
        assert!(smooth(2, n).functions.values(&x)[0] > value);
    }

    /// Source: More, Garbow, Hillstrom (1981): the sum of squares at x = 0 of the linear function of full rank is m +
    /// n, and (-1, .., -1) gives m - n.
    #[test]
    fn the_linear_function_has_its_minimum_at_minus_one() {
        assert!((smooth(1, 9).functions.values(&[-1.0; 9])[0] - 36.0).abs() < 1e-12);
        assert_eq!(least(1, 9, 45), Some(36.0));
    }
}
