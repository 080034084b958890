//! Non-identifiable directions: a readable basis of them, and their wording.

use nalgebra::DMatrix;

use super::coordinate::Coordinate;
use super::words::{coefficient, listed, percent};

/// Share of the largest entry below which a tuner takes no part in a direction, in coordinates with unit-length
/// Jacobian columns.
pub(super) const NO_PART: f64 = 1e-5;

/// Share of the largest entry below which a tuner takes no part if its relative change is also small.
const SMALL_PART: f64 = 1e-3;

/// Share of the largest change below which a change is not listed by name.
const NAMED: f64 = 0.05;

/// Difference below which relative changes count as equal.
const EQUAL: f64 = 2e-3;

/// Reason why a direction is not determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// No change along the direction.
    Nothing,
    /// Change along the direction below the noise.
    Noise,
    /// Change along the direction below the accuracy of the derivatives.
    Slopes,
}

/// Direction of the tuners that is not determined, to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct BlindDirection {
    /// Reason why the direction is not determined.
    pub limit: Limit,
    /// Change of each tuner that takes part, by index and relative to [`Coordinate::scale`]; the largest is 1.
    pub changes: Vec<(usize, f64)>,
    /// Clause that states what can be estimated, and what cannot.
    pub words: String,
    /// True for a straight line in the tuners; false for one in their logarithms, as for products and ratios.
    pub straight: bool,
    /// Clause for a straight line that has the same direction, if the clause is that of a product or a ratio of two
    /// tuners.
    pub sum: Option<String>,
}

/// Returns a basis of directions that are not determined, reduced by elimination so that each involves few tuners.
///
/// The rows of `null` span the directions in coordinates in which column `k` of the Jacobian has unit length instead of
/// `lengths[k]`.
pub(super) fn directions(
    mut null: DMatrix<f64>,
    lengths: &[f64],
    coordinates: &[Coordinate],
    limit: Limit,
) -> Vec<BlindDirection> {
    let n = coordinates.len();
    eliminate(&mut null);
    (0..null.nrows())
        .map(|i| {
            let row: Vec<f64> = null.row(i).iter().copied().collect();
            let shares: Vec<f64> = (0..n).map(|k| row[k] / lengths[k] / coordinates[k].scale()).collect();
            let largest = |values: &[f64]| values.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            let (most, most_share) = (largest(&row), largest(&shares));
            let takes_part = |k: &usize| {
                let (part, share) = (row[*k].abs() / most, shares[*k].abs() / most_share);
                part > SMALL_PART || (part > NO_PART && share > SMALL_PART)
            };
            let members: Vec<usize> = (0..n).filter(takes_part).collect();
            let first = members.first().map_or(1.0, |&k| shares[k].signum());
            let most = members.iter().map(|&k| shares[k].abs()).fold(0.0, f64::max);
            let changes: Vec<(usize, f64)> = members.iter().map(|&k| (k, first * shares[k] / most)).collect();
            let words = words(&changes, coordinates);
            // Text outside the names, which are between backticks.
            let message: String = words.split('`').step_by(2).collect();
            let multiplied = ["ratio", "product", "^", "factor"].iter().any(|sign| message.contains(sign));
            let sum = match changes.as_slice() {
                [a, b] if multiplied => Some(sum(*a, *b, coordinates)),
                _ => None,
            };
            BlindDirection { limit, straight: !multiplied, words, changes, sum }
        })
        .collect()
}

/// Performs Gauss-Jordan elimination, with the largest entry of each row as the pivot.
fn eliminate(null: &mut DMatrix<f64>) {
    let (rows, n) = null.shape();
    let mut free = vec![true; n];
    for i in 0..rows {
        let Some(pivot) =
            (0..n).filter(|&k| free[k]).max_by(|&a, &b| null[(i, a)].abs().total_cmp(&null[(i, b)].abs()))
        else {
            return;
        };
        free[pivot] = false;
        let value = null[(i, pivot)];
        if value == 0.0 {
            continue;
        }
        null.row_mut(i).scale_mut(1.0 / value);
        for other in (0..rows).filter(|&other| other != i) {
            let factor = null[(other, pivot)];
            let row = null.row(i).into_owned();
            let mut changed = null.row_mut(other);
            changed -= row * factor;
        }
    }
}

/// Returns a clause that states what can be estimated, and what cannot. Names are between backticks.
fn words(changes: &[(usize, f64)], coordinates: &[Coordinate]) -> String {
    let name = |k: usize| format!("`{}`", coordinates[k].name);
    let relative = changes.iter().all(|&(k, _)| coordinates[k].value != 0.0);
    match changes {
        [] => "this direction is not determined".to_owned(),
        [(one, _)] => format!("{} has no effect", name(*one)),
        [(a, x), (b, y)] => {
            let (ratio, near) = (y / x, |wanted: f64| (y / x - wanted).abs() < EQUAL * wanted.abs());
            let [a_name, b_name] = [name(*a), name(*b)];
            // Along the direction ln a moves by x and ln b by y, so that a power of a times a power of b is constant.
            let power = [2u8, 3].into_iter().find(|&p| {
                let times = f64::from(p);
                let more = if ratio.abs() > 1.0 { times } else { 1.0 / times };
                near(more) || near(-more)
            });
            match power {
                _ if relative && near(1.0) => {
                    format!("only the ratio {a_name}/{b_name} can be estimated: a common factor of both has no effect")
                }
                _ if relative && near(-1.0) => format!("only the product {a_name} {b_name} can be estimated"),
                Some(p) if relative => {
                    let [high, low] = if ratio.abs() > 1.0 { [a_name, b_name] } else { [b_name, a_name] };
                    let joint = if ratio > 0.0 { "/" } else { " " };
                    format!("only {high}^{p}{joint}{low} can be estimated")
                }
                _ => sum((*a, *x), (*b, *y), coordinates),
            }
        }
        many if relative && many.iter().all(|(_, share)| (share - many[0].1).abs() < EQUAL) => {
            let names: Vec<String> = many.iter().map(|&(k, _)| name(k)).collect();
            format!("a common factor of {} has no effect: only their ratios can be estimated", listed(&names))
        }
        many => {
            let change = |&(k, share): &(usize, f64)| {
                let verb = if share < 0.0 { "decreases" } else { "increases" };
                let Coordinate { value, unit, .. } = &coordinates[k];
                let by = match *value {
                    0.0 => format!("{} {unit}", coefficient(0.01 * share.abs() * coordinates[k].scale())),
                    _ => percent(0.01 * share.abs()),
                };
                format!("{} {verb} by {by}", name(k))
            };
            let main: Vec<String> = many.iter().filter(|(_, share)| share.abs() >= NAMED).map(change).collect();
            let less = match many.len() - main.len() {
                0 => String::new(),
                1 => ", with a smaller change of another tuner".to_owned(),
                count => format!(", with smaller changes of {count} other tuners"),
            };
            format!("no effect if {}{less}", listed(&main))
        }
    }
}

/// Returns the clause for a direction along which a weighted sum of two tuners is constant.
fn sum((a, x): (usize, f64), (b, y): (usize, f64), coordinates: &[Coordinate]) -> String {
    let slope = -(x * coordinates[a].scale()) / (y * coordinates[b].scale());
    let sign = if slope < 0.0 { "-" } else { "+" };
    let [a, b] = [a, b].map(|k| &coordinates[k].name);
    format!("only `{a}` {sign} {} `{b}` can be estimated", coefficient(slope.abs()))
}

#[cfg(test)]
mod tests {
    use mops_math as math;
    use nalgebra::DVector;

    use super::super::sensitivity::{Sensitivity, TANGENTS};
    use super::*;

    /// Returns the sensitivity of 200 residuals that depend on the tuners through these combinations, one gradient
    /// each.
    fn found(tuners: &[(&str, f64)], gradients: &[Vec<f64>]) -> Sensitivity {
        let coordinates = tuners
            .iter()
            .map(|(name, value)| Coordinate {
                name: (*name).into(),
                value: *value,
                range: 1.0,
                span: 1.0,
                unit: "m".into(),
                counts_from_any_zero: false,
            })
            .collect();
        let signals =
            DMatrix::from_fn(200, gradients.len(), |t, i| math::sin(0.01 * (1.0 + i as f64) * t as f64 + i as f64));
        let slopes = DMatrix::from_columns(&gradients.iter().map(|g| DVector::from_vec(g.clone())).collect::<Vec<_>>());
        Sensitivity::of(&(signals * slopes.transpose()), coordinates, TANGENTS)
    }

    fn words(tuners: &[(&str, f64)], gradients: &[Vec<f64>]) -> Vec<String> {
        found(tuners, gradients).blind.into_iter().map(|b| b.words).collect()
    }

    #[test]
    fn pairs_are_named_as_sum_difference_product_and_ratio() {
        let (a, b) = (3.0, 0.2);
        let pair = |gradient: Vec<f64>| words(&[("a", a), ("b", b)], &[gradient]).concat();
        assert_eq!(pair(vec![1.0, 4.0]), "only `a` + 4.00 `b` can be estimated");
        assert_eq!(pair(vec![1.0, -0.125]), "only `a` - 0.125 `b` can be estimated");
        assert_eq!(pair(vec![b, a]), "only the product `a` `b` can be estimated");
        assert_eq!(
            pair(vec![1.0 / b, -a / b / b]),
            "only the ratio `a`/`b` can be estimated: a common factor of both has no effect"
        );
        assert_eq!(pair(vec![2.0 * a * b, a * a]), "only `a`^2 `b` can be estimated");
        assert_eq!(pair(vec![1.0 / b / b, -2.0 * a / b / b / b]), "only `b`^2/`a` can be estimated");
    }

    #[test]
    fn a_common_scale_of_many_is_named_beside_what_is_determined() {
        // Observable: a/b, b/c and d; not observable: a common factor of a, b, c.
        let (a, b, c) = (2.0, 0.5, 1e-3);
        let gradients =
            [vec![1.0 / b, -a / b / b, 0.0, 0.0], vec![0.0, 1.0 / c, -b / c / c, 0.0], vec![0.0, 0.0, 0.0, 1.0]];
        let found = found(&[("a", a), ("b", b), ("c", c), ("d", 1.0)], &gradients);
        assert_eq!(
            found.blind[0].words,
            "a common factor of `a`, `b` and `c` has no effect: only their ratios can be estimated"
        );
        assert!(found.together[0].is_nan() && found.together[3].is_finite(), "{:?}", found.together);
    }

    #[test]
    fn two_blind_directions_are_separated_and_other_ones_are_given_in_percent() {
        // Observable: a b and c d^3.
        let (a, b, c, d) = (2.0, 5.0, 1.0, 0.3);
        let gradients = [vec![b, a, 0.0, 0.0], vec![0.0, 0.0, math::powi(d, 3), 3.0 * c * d * d]];
        let mut both = words(&[("a", a), ("b", b), ("c", c), ("d", d)], &gradients);
        both.sort();
        assert_eq!(both, ["only `d`^3 `c` can be estimated", "only the product `a` `b` can be estimated"]);
        let three = words(&[("a", 2.0), ("b", 4.0), ("c", 0.0)], &[vec![1.0, 0.25, 0.0], vec![0.0, 1.0, 8.0]]);
        assert_eq!(three.len(), 1);
        assert!(three[0].starts_with("no effect if `a` increases by"), "{three:?}");
    }
}
