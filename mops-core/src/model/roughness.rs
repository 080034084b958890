//! Detection of points at which a function is not differentiable with the given derivatives.

use std::ops::Range;

/// Distances at which derivatives are compared with finite differences, relative to a variable, or absolute if it is 0.
const DISTANCES: [f64; 5] = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12];

/// Magnitude below which a variable may be the rounding error of a zero, such as that of an equilibrium. Differences
/// over distances relative to such a variable are noise, so that distances relative to 1 count as well.
const ROUNDED_ZERO: f64 = 1e-9;

/// Relative tolerance, with respect to the terms of a row, within which a difference agrees with the derivative.
const CLOSE: f64 = 1e-5;

/// Ratio of the deviations at successive distances below which the function counts as differentiable.
///
/// Over a factor of 100 in distance, a smooth function gives 1/100, and `x^1.5` gives 1/10. At a kink the ratio is 1,
/// and at an infinite derivative it exceeds 1.
const FALLING: f64 = 0.5;

/// Function of several variables at a point, with its derivatives.
pub(crate) struct Point<'a> {
    /// Variables.
    pub x: &'a [f64],
    /// Values.
    pub values: &'a [f64],
    /// Jacobian: derivatives of the values (rows) with respect to the variables (columns).
    pub slopes: &'a nalgebra::DMatrix<f64>,
    /// Rows that are changes of the variables with the same indices: new values minus old ones, with the rounding of
    /// these.
    pub changes: &'a [Range<usize>],
}

impl Point<'_> {
    /// Returns the pairs of row and column whose derivative is not that of the function: it jumps or is infinite.
    ///
    /// `f` returns the values at other points, or `None` if undefined. Only these `rows` and `columns` are checked. A
    /// direction that moves all variables shows whether any pair exists; only then is each variable moved alone.
    pub fn rough(
        &self,
        mut f: impl FnMut(&[f64]) -> Option<Vec<f64>>,
        rows: &[usize],
        columns: &[usize],
    ) -> Vec<(usize, usize)> {
        // Fractions of the golden ratio with alternating sign, so that no two variables move alike.
        let mixed = |i: usize| {
            (0.3 + 0.7 * (0.618_033_988_749_894_9 * (i + 1) as f64).fract())
                * if i.is_multiple_of(2) { 1.0 } else { -1.0 }
        };
        let all: Vec<(usize, f64)> = columns.iter().enumerate().map(|(i, &j)| (j, mixed(i))).collect();
        if self.rough_at_all_scales(&mut f, rows, &all).iter().all(|rough| !rough) {
            return Vec::new();
        }
        let mut found = Vec::new();
        for &column in columns {
            let rough = self.rough_at_all_scales(&mut f, rows, &[(column, 1.0)]);
            found.extend(rows.iter().zip(rough).filter(|(_, rough)| *rough).map(|(&row, _)| (row, column)));
        }
        found
    }

    /// Returns for each row whether the function lacks a derivative along a direction, for distances relative to the
    /// variables, and, if some are rounded zeros, also for distances relative to 1. A kink, a jump or an infinite
    /// derivative at the point shows at both scales.
    fn rough_at_all_scales(
        &self,
        f: &mut impl FnMut(&[f64]) -> Option<Vec<f64>>,
        rows: &[usize],
        direction: &[(usize, f64)],
    ) -> Vec<bool> {
        let mut rough = self.rough_rows(f, rows, direction, 0.0);
        let is_tiny = |j: usize| self.x[j] != 0.0 && self.x[j].abs() < ROUNDED_ZERO;
        if rough.contains(&true) && direction.iter().any(|(j, _)| is_tiny(*j)) {
            let coarse = self.rough_rows(f, rows, direction, ROUNDED_ZERO);
            rough.iter_mut().zip(coarse).for_each(|(rough, coarse)| *rough &= coarse);
        }
        rough
    }

    /// Returns for each row whether the function lacks a derivative along a direction, given by weights of the columns.
    /// Variables up to `zero` in magnitude count as 0.
    ///
    /// A side on which the function is undefined is ignored, unless it is undefined on both.
    fn rough_rows(
        &self,
        f: &mut impl FnMut(&[f64]) -> Option<Vec<f64>>,
        rows: &[usize],
        direction: &[(usize, f64)],
        zero: f64,
    ) -> Vec<bool> {
        let size = |j: usize| if self.x[j].abs() <= zero { 1.0 } else { self.x[j].abs() };
        let mut sides = [vec![Verdict::default(); rows.len()], vec![Verdict::default(); rows.len()]];
        let mut seen = [false; 2];
        for distance in DISTANCES {
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let mut x = self.x.to_vec();
                let mut moved = Vec::with_capacity(direction.len());
                for &(j, part) in direction {
                    x[j] += sign * distance * part * size(j);
                    // Actual movement of the variable after rounding.
                    moved.push((j, x[j] - self.x[j]));
                }
                let Some(values) = f(&x) else { continue };
                seen[side] = true;
                for (verdict, &row) in sides[side].iter_mut().zip(rows) {
                    let terms = |(j, by): &(usize, f64)| self.slopes[(row, *j)] * by;
                    let expected: f64 = moved.iter().map(terms).sum();
                    let size: f64 = moved.iter().map(|term| terms(term).abs()).sum();
                    let off = (values[row] - self.values[row] - expected).abs();
                    let old = if self.changes.iter().any(|rows| rows.contains(&row)) { x[row].abs() } else { 0.0 };
                    let terms = values[row].abs() + self.values[row].abs() + self.inner(row) + old;
                    let noise = 8.0 * f64::EPSILON * terms;
                    verdict.take(off, noise, size, distance);
                }
            }
            if (0..2).all(|side| seen[side] && sides[side].iter().all(|verdict| verdict.smooth)) {
                break;
            }
        }
        let rough = |k: usize| sides.iter().any(|side| side[k].is_rough()) || !(seen[0] || seen[1]);
        (0..rows.len()).map(rough).collect()
    }

    /// Returns the sum of the magnitudes of the terms of a value, estimated from its derivatives.
    fn inner(&self, row: usize) -> f64 {
        self.x.iter().enumerate().map(|(j, x)| (self.slopes[(row, j)] * x).abs()).sum()
    }
}

/// Result of the differences on one side for one row.
#[derive(Debug, Clone, Default)]
struct Verdict {
    /// True if the derivative agrees with the function.
    smooth: bool,
    /// Last deviation above the noise, per distance.
    deviation: Option<f64>,
}

impl Verdict {
    /// Includes a difference with deviation `off` and this `noise`, from terms of total magnitude `size`.
    fn take(&mut self, off: f64, noise: f64, size: f64, distance: f64) {
        let falls = self.deviation.is_some_and(|before| (off + noise) / distance <= FALLING * before);
        self.smooth |= falls || off.max(noise) <= CLOSE * size;
        if off > noise {
            self.deviation = Some(off / distance);
        }
    }

    fn is_rough(&self) -> bool {
        !self.smooth && self.deviation.is_some()
    }
}

#[cfg(test)]
mod tests {
    use mops_math as math;
    use nalgebra::DMatrix;

    use super::*;

    /// Returns true if a function of one variable with this derivative at x is found rough there.
    fn is_rough(f: impl Fn(f64) -> f64, slope: f64, x: f64) -> bool {
        let (x, values, slopes) = ([x], [f(x)], DMatrix::from_element(1, 1, slope));
        let point = Point { x: &x, values: &values, slopes: &slopes, changes: &[] };
        let value = |x: &[f64]| Some(vec![f(x[0])]).filter(|values| values[0].is_finite());
        !point.rough(value, &[0], &[0]).is_empty()
    }

    #[test]
    fn kinks_jumps_and_infinite_slopes_are_rough() {
        assert!(is_rough(f64::sqrt, 0.0, 0.0) && is_rough(|x| 3.0 - 2.0 * x.sqrt(), 0.0, 0.0));
        assert!(is_rough(|x| math::cbrt(x.abs()), 0.0, 0.0) && is_rough(math::acos, 0.0, 1.0));
        assert!(is_rough(f64::abs, 0.0, 0.0) && is_rough(f64::abs, 1.0, 0.0));
        assert!(is_rough(|x| x.clamp(-2.0, 2.0), 1.0, 2.0) && is_rough(|x| x.max(0.5) * 1e-9, 0.0, 0.5));
        assert!(is_rough(|x| if x > 0.0 { 1.0 } else { -1.0 }, 0.0, 0.0));
        assert!(is_rough(|x| 1e3 + x + 0.01 * x.abs(), 1.0, 0.0));
        assert!(is_rough(|x| (x - 1e-16).abs(), 1.0, 1e-16) && is_rough(|x| (x + 1e-12).sqrt(), 0.0, -1e-12));
        // A wrong derivative is detected too.
        assert!(is_rough(math::sin, 0.5, 0.3));
    }

    #[test]
    fn smooth_functions_are_not_rough_however_steep_or_large_they_are() {
        assert!(!is_rough(|x| 4.0 * x + 1e6, 4.0, 0.0) && !is_rough(|x| 4.0 * x - 8e5, 4.0, 2e5));
        assert!(!is_rough(|x| 4.0 * x + 1e12, 4.0, 0.0) && !is_rough(|x| 1e3 + math::cos(x), 0.0, 0.0));
        assert!(!is_rough(math::cos, 0.0, 0.0) && !is_rough(|x| x * x.abs(), 0.0, 0.0));
        assert!(!is_rough(|x| math::tanh(1e6 * x), 1e6, 0.0) && !is_rough(|x| math::sin(1e-6 * x), 1e-6, 0.0));
        assert!(!is_rough(f64::sqrt, 0.5 / 1e-12f64.sqrt(), 1e-12) && !is_rough(f64::sqrt, 0.5e15, 1e-30));
        assert!(!is_rough(math::exp, math::exp(20.0), 20.0) && !is_rough(|_| 7.0, 0.0, 0.0));
        // Defined on one side only, with a derivative there.
        assert!(!is_rough(|x| math::powf(x, 1.5), 0.0, 0.0));
        // A rounded zero in a value that cancels: the rounding of 3.3 is larger than the movement.
        for x in [-1.3e-16, 2e-17, -4e-13] {
            assert!(!is_rough(|x| (0.3 * x + (3.3 + x) - (3.3 + x)) / 0.013, 0.3 / 0.013, x), "{x}");
        }
        // Smooth near a kink, even very close to it.
        assert!(!is_rough(f64::abs, 1.0, 1e-9) && !is_rough(|x| (x - 1.0).abs(), 1.0, 1.001));
    }

    #[test]
    fn the_rows_and_columns_without_slope_are_named() {
        let f = |x: &[f64]| vec![x[0] * x[1], x[0] + x[2].abs(), (x[1] - 1.0).abs()];
        let x = [2.0, 1.0, 0.0];
        let slopes = DMatrix::from_row_slice(3, 3, &[1.0, 2.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        let point = Point { x: &x, values: &f(&x), slopes: &slopes, changes: &[] };
        let found = |rows: &[usize], columns: &[usize]| point.rough(|x| Some(f(x)), rows, columns);
        assert_eq!(found(&[0, 1, 2], &[0, 1, 2]), [(2, 1), (1, 2)]);
        assert_eq!(found(&[0, 1], &[0, 1]), []);
    }

    #[test]
    fn the_rounding_of_memory_in_its_change_is_no_kink() {
        // The slowest memories of filters at fast sampling: their changes are far below the rounding of their new
        // values.
        let n = 40;
        let part = |i: usize| 1e-16 * (i + 3) as f64;
        let f = |x: &[f64]| (0..n).map(|i| (x[i] - part(i) * x[i]) - x[i]).collect::<Vec<f64>>();
        let slopes = DMatrix::from_fn(n, n, |i, j| if i == j { (1.0 - part(i)) - 1.0 } else { 0.0 });
        let (x, all) = (vec![0.0; n], (0..n).collect::<Vec<_>>());
        let found = |changes: &[Range<usize>]| {
            let point = Point { x: &x, values: &f(&x), slopes: &slopes, changes };
            point.rough(|x| Some(f(x)), &all, &all)
        };
        assert!(!found(&[]).is_empty());
        let memory = 0..n;
        assert_eq!(found(&[memory]), []);
    }
}
