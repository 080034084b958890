//! Non-identifiable directions: a basis of them in which each involves few tuners, and what is constant along each.

use nalgebra::DMatrix;

use crate::coordinate::Coordinate;

/// Share of the largest entry below which a tuner takes no part in a direction, in coordinates with unit-length
/// Jacobian columns.
pub(crate) const NO_PART: f64 = 1e-5;

/// Share of the largest entry below which a tuner takes no part if its relative change is also small.
const SMALL_PART: f64 = 1e-3;

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
    /// What is constant along the direction, as far as the changes show it.
    pub invariant: Invariant,
}

/// Quantity that is constant along a direction. Tuners are given by their index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Invariant {
    /// Everything: a single tuner without effect.
    Everything(usize),
    /// Ratio of two tuners.
    Ratio(usize, usize),
    /// Product of two tuners.
    Product(usize, usize),
    /// Product, or if `divided` ratio, of a power of one tuner and another tuner.
    Power {
        /// Tuner with the power.
        base: usize,
        /// Exponent, 2 or 3.
        exponent: u8,
        /// The other tuner.
        other: usize,
        /// True for a ratio.
        divided: bool,
    },
    /// Weighted sum of two tuners, see [`BlindDirection::weight`].
    Sum(usize, usize),
    /// All ratios of three tuners or more.
    Ratios,
    /// No simple expression.
    Unnamed,
}

impl Invariant {
    /// Returns true if the direction is a straight line in the tuners; false for one in their logarithms.
    #[must_use]
    pub fn is_straight(self) -> bool {
        matches!(self, Self::Everything(_) | Self::Sum(..) | Self::Unnamed)
    }

    /// Returns the invariant of the changes, relative to the scales of the coordinates.
    fn of(changes: &[(usize, f64)], coordinates: &[Coordinate]) -> Self {
        let relative = changes.iter().all(|&(k, _)| coordinates[k].value != 0.0);
        match *changes {
            [(one, _)] => Self::Everything(one),
            [(a, x), (b, y)] => {
                let (ratio, near) = (y / x, |wanted: f64| (y / x - wanted).abs() < EQUAL * wanted.abs());
                // Along the direction ln a moves by x and ln b by y, so that a power of a times a power of b is
                // constant.
                let power = [2u8, 3].into_iter().find(|&p| {
                    let times = f64::from(p);
                    let more = if ratio.abs() > 1.0 { times } else { 1.0 / times };
                    near(more) || near(-more)
                });
                match power {
                    _ if relative && near(1.0) => Self::Ratio(a, b),
                    _ if relative && near(-1.0) => Self::Product(a, b),
                    Some(exponent) if relative => {
                        let [base, other] = if ratio.abs() > 1.0 { [a, b] } else { [b, a] };
                        Self::Power { base, exponent, other, divided: ratio > 0.0 }
                    }
                    _ => Self::Sum(a, b),
                }
            }
            [(_, first), _, ..] if relative && changes.iter().all(|(_, share)| (share - first).abs() < EQUAL) => {
                Self::Ratios
            }
            _ => Self::Unnamed,
        }
    }
}

impl BlindDirection {
    /// Returns the weight `w` for which `a + w b` is constant along a straight line through the point, if the direction
    /// is of two tuners `a` and `b`.
    #[must_use]
    pub fn weight(&self, coordinates: &[Coordinate]) -> Option<f64> {
        let [(a, x), (b, y)] = *self.changes else { return None };
        Some(-(x * coordinates[a].scale()) / (y * coordinates[b].scale()))
    }
}

/// Returns a basis of directions that are not determined, reduced by elimination so that each involves few tuners.
///
/// The rows of `null` span the directions in coordinates in which column `k` of the Jacobian has unit length instead of
/// `lengths[k]`.
pub(crate) fn directions(
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
            BlindDirection { limit, invariant: Invariant::of(&changes, coordinates), changes }
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

#[cfg(test)]
mod tests {
    use mops_math as math;
    use nalgebra::DVector;

    use super::*;
    use crate::coordinate::coordinates;
    use crate::sensitivity::{Sensitivity, TANGENTS};

    /// Returns the sensitivity of 200 residuals that depend on the tuners through these combinations, one gradient
    /// each.
    fn found(tuners: &[(&str, f64)], gradients: &[Vec<f64>]) -> Sensitivity {
        let signals =
            DMatrix::from_fn(200, gradients.len(), |t, i| math::sin(0.01 * (1.0 + i as f64) * t as f64 + i as f64));
        let slopes = DMatrix::from_columns(&gradients.iter().map(|g| DVector::from_vec(g.clone())).collect::<Vec<_>>());
        Sensitivity::of(&(signals * slopes.transpose()), coordinates(tuners), TANGENTS)
    }

    fn invariants(tuners: &[(&str, f64)], gradients: &[Vec<f64>]) -> Vec<Invariant> {
        found(tuners, gradients).blind.into_iter().map(|direction| direction.invariant).collect()
    }

    #[test]
    fn pairs_have_a_constant_sum_product_or_ratio() {
        let (a, b) = (3.0, 0.2);
        let pair = |gradient: Vec<f64>| invariants(&[("a", a), ("b", b)], &[gradient]);
        let power = |base, divided| vec![Invariant::Power { base, exponent: 2, other: 1 - base, divided }];
        assert_eq!(pair(vec![1.0, 4.0]), [Invariant::Sum(0, 1)]);
        assert_eq!(pair(vec![b, a]), [Invariant::Product(0, 1)]);
        assert_eq!(pair(vec![1.0 / b, -a / b / b]), [Invariant::Ratio(0, 1)]);
        assert_eq!(pair(vec![2.0 * a * b, a * a]), power(0, false));
        assert_eq!(pair(vec![1.0 / b / b, -2.0 * a / b / b / b]), power(1, true));
        let difference = found(&[("a", a), ("b", b)], &[vec![1.0, -0.125]]);
        let weight = difference.blind[0].weight(&difference.coordinates).unwrap();
        assert!((weight + 0.125).abs() < 1e-12, "{weight}");
    }

    #[test]
    fn a_common_scale_of_many_is_found_beside_what_is_determined() {
        // Observable: a/b, b/c and d; not observable: a common factor of a, b, c.
        let (a, b, c) = (2.0, 0.5, 1e-3);
        let gradients =
            [vec![1.0 / b, -a / b / b, 0.0, 0.0], vec![0.0, 1.0 / c, -b / c / c, 0.0], vec![0.0, 0.0, 0.0, 1.0]];
        let found = found(&[("a", a), ("b", b), ("c", c), ("d", 1.0)], &gradients);
        assert_eq!((found.blind[0].invariant, found.blind[0].changes.len()), (Invariant::Ratios, 3));
        assert!(found.together[0].is_nan() && found.together[3].is_finite(), "{:?}", found.together);
    }

    #[test]
    fn two_blind_directions_are_separated_and_others_stay_unnamed() {
        // Observable: a b and c d^3.
        let (a, b, c, d) = (2.0, 5.0, 1.0, 0.3);
        let gradients = [vec![b, a, 0.0, 0.0], vec![0.0, 0.0, math::powi(d, 3), 3.0 * c * d * d]];
        let both = invariants(&[("a", a), ("b", b), ("c", c), ("d", d)], &gradients);
        let cubic = Invariant::Power { base: 3, exponent: 3, other: 2, divided: false };
        assert!(both.len() == 2 && both.contains(&Invariant::Product(0, 1)) && both.contains(&cubic), "{both:?}");
        let three = invariants(&[("a", 2.0), ("b", 4.0), ("c", 0.0)], &[vec![1.0, 0.25, 0.0], vec![0.0, 1.0, 8.0]]);
        assert_eq!(three, [Invariant::Unnamed]);
    }
}
