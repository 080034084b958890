//! Order of points by merit: feasible points by objective, then infeasible points by violation, failures last.

use std::cmp::Ordering;

use mops_core::{Evaluation, Merit};

/// Compares two merits; the better one is less.
///
/// Source: K. Deb, Computer Methods in Applied Mechanics and Engineering 186 (2000) 311-338 (feasibility first).
pub fn compare(a: &Merit, b: &Merit) -> Ordering {
    let key = |m: &Merit| if m.is_feasible() { (0.0, m.objective) } else { (m.violation, m.objective) };
    let ((first_a, second_a), (first_b, second_b)) = (key(a), key(b));
    (first_a + 0.0).total_cmp(&first_b).then(second_a.total_cmp(&second_b))
}

/// Returns the indices of the evaluations, the best first; equal merits keep their order.
pub fn ranked(evaluations: &[Evaluation]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..evaluations.len()).collect();
    order.sort_by(|&a, &b| compare(&evaluations[a].merit, &evaluations[b].merit));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_the_merits() {
        let merit = |violation, objective| Merit { violation, objective };
        let merits =
            [merit(0.0, -3.0), merit(1e-9, 1.0), merit(0.0, 5.0), merit(0.1, 9.0), merit(0.2, 0.0), Merit::FAILED];
        for (i, a) in merits.iter().enumerate() {
            for (j, b) in merits.iter().enumerate() {
                assert_eq!(compare(a, b), i.cmp(&j), "{a:?} {b:?}");
                assert_eq!(compare(a, b) == Ordering::Less, a.is_better_than(b));
            }
        }
    }
}
