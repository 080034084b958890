//! Equilibria of a system.

use std::fmt;

use nalgebra::{DMatrix, DVector};
use rand::Rng;

use mops_math as math;
use mops_math::stream;

/// Residual of the equilibrium condition, with its derivatives.
#[derive(Debug, Clone)]
pub struct Balance {
    /// Rates of change of the states.
    pub rates: Vec<f64>,
    /// Derivatives of the rates with respect to states, then inputs; one row per rate.
    pub slopes: DMatrix<f64>,
}

/// Reason why a search found no equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub enum NoEquilibrium {
    /// Rates undefined at the initial guess.
    Undefined(String),
    /// Search that ended without an equilibrium, with the state that changes fastest.
    Restless {
        /// Index of the state.
        state: usize,
        /// Rate of change of the state, per s, positive.
        rate: f64,
    },
}

impl fmt::Display for NoEquilibrium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Undefined(why) => f.write_str(why),
            Self::Restless { state, rate } => {
                write!(f, "no equilibrium found: the search ends where state {state} changes by {rate:.3e} per s")
            }
        }
    }
}

/// Weighted rates that count as rounding, relative to the largest coordinate.
const SMALL: f64 = 1e-12;

/// Step size that counts as rounding, relative to the largest coordinate.
const SHORT: f64 = 1e-10;

/// Weighted rates up to which a point counts as an equilibrium if no step reduces them.
const ROUNDING: f64 = 1e-9;

/// Distances of further initial guesses from the first, relative to a coordinate, or absolute if it is 0.
const AROUND: [f64; 8] = [1e-6, 1e-4, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e4];

/// Smallest step of a continuation, as part of the way: with smaller ones it would cost more points than the search may
/// evaluate.
const SHORTEST: f64 = 1e-3;

/// Maximum number of points evaluated before the search fails.
const MOST: usize = 4_000;

/// Returns a point near `start` at which all rates vanish; only the `free` states and inputs vary.
///
/// Newton's method starts from `start`. If it fails, for example at a zero or infinite derivative, it restarts from
/// points around it at increasing distances. Of the equilibria found from one distance, the one nearest to `start` is
/// returned. If all fail, the equilibrium is followed from where the fixed states and inputs are 0.
///
/// # Errors
/// If the rates are undefined at `start`, or if no equilibrium is found.
pub fn equilibrium(
    rates: impl FnMut(&[f64]) -> Result<Balance, String>,
    start: &[f64],
    free: &[bool],
) -> Result<Vec<f64>, NoEquilibrium> {
    let moving: Vec<usize> = (0..start.len()).filter(|&i| free[i]).collect();
    let mut search = Search { rates, moving, origin: start, looked: 0 };
    let first = match search.newton(start, false) {
        Ok(x) => return Ok(x),
        Err(why) => why,
    };
    for distance in AROUND {
        let mut found: Vec<Vec<f64>> = Vec::new();
        for x in search.around(distance) {
            found.extend(search.newton(&x, false));
        }
        let nearest = found.into_iter().min_by(|a, b| search.distance(a).total_cmp(&search.distance(b)));
        if let Some(x) = nearest {
            return Ok(x);
        }
    }
    // A limit that is active at the start only, such as that of a controller beside a step of its setpoint.
    search.looked = 0;
    if let Some(x) = search.by_continuation() {
        return Ok(x);
    }
    // If nothing changes a rate, it may be zero up to rounding.
    search.looked = 0;
    search.newton(start, true).map_err(|_| first)
}

/// Returns the magnitude of a coordinate.
fn size(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.abs() }
}

struct Search<'a, R> {
    rates: R,
    /// Indices of the free coordinates.
    moving: Vec<usize>,
    /// Initial guess.
    origin: &'a [f64],
    /// Number of points evaluated so far.
    looked: usize,
}

impl<R: FnMut(&[f64]) -> Result<Balance, String>> Search<'_, R> {
    fn look(&mut self, x: &[f64]) -> Result<Balance, String> {
        self.looked += 1;
        let here = (self.rates)(x)?;
        let finite = here.rates.iter().chain(here.slopes.iter()).all(|x| x.is_finite());
        if finite { Ok(here) } else { Err("the rates or their derivatives are not finite".to_owned()) }
    }

    /// Returns the distance of a point from the initial guess, relative to the magnitudes of the coordinates.
    fn distance(&self, x: &[f64]) -> f64 {
        x.iter().zip(self.origin).map(|(a, b)| math::powi((a - b) / size(*b), 2)).sum::<f64>().sqrt()
    }

    /// Returns points at a distance from the initial guess: each free coordinate up and down, and all together in a few
    /// directions.
    fn around(&self, distance: f64) -> Vec<Vec<f64>> {
        let mut stream = stream(0, "equilibrium");
        let n = self.moving.len();
        let mut directions: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        directions.push(vec![1.0; n]);
        directions.extend((0..3).map(|_| (0..n).map(|_| if stream.random() { 1.0 } else { -1.0 }).collect()));
        let point = |direction: &[f64], sign: f64| {
            let mut x = self.origin.to_vec();
            self.moving.iter().zip(direction).for_each(|(&j, part)| x[j] += sign * distance * part * size(x[j]));
            x
        };
        directions.iter().flat_map(|direction| [point(direction, 1.0), point(direction, -1.0)]).collect()
    }

    /// Performs Newton's method with the minimum-norm step and backtracking where a full step does not reduce the
    /// rates.
    ///
    /// With `lenient`, a rate that nothing changes may be small; otherwise it must be 0.
    ///
    /// Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition (2006), sections 10.3, 11.2.
    fn newton(&mut self, start: &[f64], lenient: bool) -> Result<Vec<f64>, NoEquilibrium> {
        let mut x = start.to_vec();
        let from_beside = start != self.origin;
        let mut here = self.look(&x).map_err(NoEquilibrium::Undefined)?;
        let moving = self.moving.clone();
        // Rates in different units are weighted by their largest derivative.
        let reach = |at: &Balance, i: usize| moving.iter().map(|&j| at.slopes[(i, j)].abs()).fold(0.0, f64::max);
        let weights: Vec<f64> = (0..here.rates.len())
            .map(|i| match reach(&here, i) {
                0.0 => 1.0,
                reach => 1.0 / reach,
            })
            .collect();
        let distance = |at: &Balance| {
            at.rates.iter().zip(&weights).map(|(rate, weight)| math::powi(rate * weight, 2)).sum::<f64>().sqrt()
        };
        for _ in 0..200 {
            let far = distance(&here);
            let largest = x.iter().map(|x| x.abs()).fold(1.0, f64::max);
            let kept = |i: usize| here.rates[i] != 0.0 && reach(&here, i) == 0.0;
            let stuck = !lenient && (0..here.rates.len()).any(kept);
            let slopes =
                DMatrix::from_fn(here.rates.len(), moving.len(), |i, j| weights[i] * here.slopes[(i, moving[j])]);
            let wanted = DVector::from_fn(here.rates.len(), |i, _| -weights[i] * here.rates[i]);
            let svd = slopes.svd(true, true);
            let threshold = 1e-10 * svd.singular_values.iter().copied().fold(0.0, f64::max);
            let Ok(step) = svd.solve(&wanted, threshold.max(f64::MIN_POSITIVE)) else { break };
            if far <= SMALL * largest && !stuck && (far == 0.0 || step.amax() <= SHORT * largest) {
                return Ok(self.without_rounding(x, far, distance));
            }
            // Near a zero derivative full steps go far; a step may be ten times the distance covered so far.
            let gone = self.distance(&x);
            let reached: Vec<f64> = moving.iter().zip(step.iter()).map(|(&j, dx)| dx / size(self.origin[j])).collect();
            let length = reached.iter().map(|dx| dx * dx).sum::<f64>().sqrt();
            let mut share = if gone > 0.0 && from_beside { (10.0 * gone / length).min(1.0) } else { 1.0 };
            let least = 1e-10 * share;
            loop {
                let mut next = x.clone();
                moving.iter().zip(step.iter()).for_each(|(&j, dx)| next[j] += share * dx);
                // A point with undefined rates is too far.
                if let Ok(there) = self.look(&next)
                    && distance(&there) < far * (1.0 - 1e-4 * share)
                {
                    (x, here) = (next, there);
                    break;
                }
                share *= 0.5;
                if share < least || self.looked > MOST {
                    // Rates at rounding level cannot be reduced further.
                    if far <= ROUNDING * largest && !stuck {
                        return Ok(self.without_rounding(x, far, distance));
                    }
                    return Err(no_equilibrium(&here));
                }
            }
        }
        Err(no_equilibrium(&here))
    }

    /// Returns the equilibrium that is reached as the fixed coordinates grow from 0 to their values, from an
    /// equilibrium near the start.
    ///
    /// Each step follows the tangent, so that limits that are inactive along the way stay so.
    ///
    /// Source: E. L. Allgower, K. Georg, Introduction to Numerical Continuation Methods (2003), chapter 2.
    fn by_continuation(&mut self) -> Option<Vec<f64>> {
        let origin = self.origin;
        let fixed: Vec<usize> = (0..origin.len()).filter(|i| !self.moving.contains(i) && origin[*i] != 0.0).collect();
        if fixed.is_empty() {
            return None;
        }
        let at = |x: &[f64], share: f64| {
            let mut x = x.to_vec();
            fixed.iter().for_each(|&i| x[i] = share * origin[i]);
            x
        };
        let mut x = self.newton(&at(origin, 0.0), false).ok()?;
        let (mut share, mut step) = (0.0, 1.0f64);
        while share < 1.0 {
            let here = self.look(&x).ok()?;
            let n = here.rates.len();
            let weight = |i: usize| match self.moving.iter().map(|&j| here.slopes[(i, j)].abs()).fold(0.0, f64::max) {
                0.0 => 1.0,
                reach => 1.0 / reach,
            };
            let slopes = DMatrix::from_fn(n, self.moving.len(), |i, j| weight(i) * here.slopes[(i, self.moving[j])]);
            let along = |i: usize| fixed.iter().map(|&j| here.slopes[(i, j)] * origin[j]).sum::<f64>();
            let wanted = DVector::from_fn(n, |i, _| -weight(i) * along(i));
            let svd = slopes.svd(true, true);
            let threshold = 1e-10 * svd.singular_values.iter().copied().fold(0.0, f64::max);
            let tangent = svd.solve(&wanted, threshold.max(f64::MIN_POSITIVE)).ok()?;
            let next = loop {
                let to = (share + step).min(1.0);
                let mut guess = at(&x, to);
                self.moving.iter().zip(tangent.iter()).for_each(|(&j, slope)| guess[j] += slope * (to - share));
                match self.newton(&guess, false) {
                    Ok(found) => break Some((found, to)),
                    Err(_) if step > SHORTEST => step *= 0.25,
                    Err(_) => break None,
                }
            };
            (x, share) = next?;
        }
        Some(x)
    }

    /// Returns the point with coordinates set to 0 where they are 0 up to rounding and the rates do not increase.
    fn without_rounding(&mut self, mut x: Vec<f64>, mut far: f64, distance: impl Fn(&Balance) -> f64) -> Vec<f64> {
        let largest = x.iter().map(|x| x.abs()).fold(1.0, f64::max);
        for j in self.moving.clone() {
            if x[j] == 0.0 || x[j].abs() > ROUNDING * largest {
                continue;
            }
            let mut next = x.clone();
            next[j] = 0.0;
            if let Ok(there) = self.look(&next)
                && distance(&there) <= far
            {
                (x, far) = (next, distance(&there));
            }
        }
        x
    }
}

fn no_equilibrium(here: &Balance) -> NoEquilibrium {
    let sizes = here.rates.iter().map(|rate| rate.abs()).enumerate();
    let (state, rate) = sizes.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    NoEquilibrium::Restless { state, rate }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::testing::assert_near;

    /// Pendulum with torque: x = (angle, speed), u = torque; `9.81 sin(angle) + torque = 0` at equilibrium.
    fn pendulum(z: &[f64]) -> Result<Balance, String> {
        Ok(Balance {
            rates: vec![z[1], 9.81 * math::sin(z[0]) - 0.1 * z[1] + z[2]],
            slopes: DMatrix::from_row_slice(2, 3, &[0.0, 1.0, 0.0, 9.81 * math::cos(z[0]), -0.1, 1.0]),
        })
    }

    #[test]
    fn from_a_start_the_state_moves_to_where_it_can_rest() {
        let x = equilibrium(pendulum, &[2.8, 0.3, 0.0], &[true, true, false]).unwrap();
        assert_near(x[0], PI, 1e-12);
        assert_eq!((x[1].abs() < 1e-14, x[2]), (true, 0.0));
    }

    #[test]
    fn with_a_fixed_state_the_input_of_the_equilibrium_is_found() {
        let x = equilibrium(pendulum, &[0.5, 0.0, 0.0], &[false, true, true]).unwrap();
        assert_near(x[2], -9.81 * math::sin(0.5), 1e-12);
        assert_eq!(x[0], 0.5);
    }

    /// Returns one state x and one input u: `x' = f(x, u)` with its derivatives.
    fn scalar(f: impl Fn(f64, f64) -> [f64; 3]) -> impl Fn(&[f64]) -> Result<Balance, String> {
        move |z| {
            let [rate, by_state, by_input] = f(z[0], z[1]);
            if rate.is_nan() {
                return Err("not defined".to_owned());
            }
            Ok(Balance { rates: vec![rate], slopes: DMatrix::from_row_slice(1, 2, &[by_state, by_input]) })
        }
    }

    #[test]
    fn a_start_at_which_a_slope_is_zero_or_infinite_or_nothing_is_defined_does_not_end_the_search() {
        let near = |f: &dyn Fn(&[f64]) -> Result<Balance, String>, u: f64, start: f64, expected: f64| {
            let x = equilibrium(f, &[start, u], &[true, false]).unwrap();
            assert_near(x[0], expected, 1e-8 * (1.0 + expected.abs()));
        };
        // u - 2 x^3 from x = 0, where it is flat; tiny and large inputs.
        let cubic = scalar(|x, u| [u - 2.0 * math::powi(x, 3), -6.0 * x * x, 1.0]);
        for u in [54.0, -54.0, 1e-6, 2e-15, 2e9] {
            near(&cubic, u, 0.0, math::cbrt(0.5 * u));
        }
        // A tank, u - 3 sqrt(x): the derivative at 0 is given as 0 or infinite.
        for slope in [0.0, f64::NEG_INFINITY] {
            let tank = scalar(move |x, u| [u - 3.0 * x.sqrt(), if x == 0.0 { slope } else { -1.5 / x.sqrt() }, 1.0]);
            for u in [0.9, 3.0, 60.0, 1e-4] {
                near(&tank, u, 0.0, math::powi(u / 3.0, 2));
            }
            near(&tank, 0.9, -1e-3, 0.09);
        }
        // A dead zone with flat sides, a saturation with zero derivative at the initial guess, a cosine at its maximum.
        let dead = scalar(|x, u| [u - (x - 1.0).max(0.0), if x > 1.0 { -1.0 } else { 0.0 }, 1.0]);
        near(&dead, 0.25, 0.0, 1.25);
        let saturated = scalar(|x, u| [u - x.clamp(-1.0, 1.0), if x.abs() < 1.0 { -1.0 } else { 0.0 }, 1.0]);
        near(&saturated, 0.5, 3.0, 0.5);
        let top = scalar(|x, u| [u + math::cos(x), -math::sin(x), 1.0]);
        near(&top, 0.5, 0.0, 2.0 * PI / 3.0);
        // ln x, undefined at the initial guess.
        near(&scalar(|x, u| [u + math::ln(x), 1.0 / x, 1.0]), 2.0, 0.0, math::exp(-2.0));
    }

    #[test]
    fn a_multiple_root_is_followed_to_its_end_and_what_is_zero_but_for_rounding_is_zero() {
        let flat =
            equilibrium(scalar(|x, _| [-math::powi(x, 3), -3.0 * x * x, 0.0]), &[1.0, 0.0], &[true, false]).unwrap();
        assert!(flat[0].abs() < 1e-8, "{flat:?}");
        let empty = scalar(|x, u| [u - x.sqrt(), if x == 0.0 { 0.0 } else { -0.5 / x.sqrt() }, 1.0]);
        assert_eq!(equilibrium(empty, &[0.37, 0.0], &[true, false]).unwrap()[0], 0.0);
    }

    #[test]
    fn a_limit_that_is_active_at_the_start_only_does_not_stop_the_search() {
        // A servo y' = v, v' = clip(k (r - y), -1, 1) - v: at the start the limit is active, and nothing depends on y.
        for (gain, setpoint) in [(10.0, 3.0), (1e3, 30.0), (1e4, -200.0)] {
            let servo = |z: &[f64]| {
                let law: f64 = gain * (z[2] - z[0]);
                let slope = if law.abs() < 1.0 { gain } else { 0.0 };
                Ok(Balance {
                    rates: vec![z[1], law.clamp(-1.0, 1.0) - z[1]],
                    slopes: DMatrix::from_row_slice(2, 3, &[0.0, 1.0, 0.0, -slope, -1.0, slope]),
                })
            };
            let x = equilibrium(servo, &[0.0, 0.0, setpoint], &[true, true, false]).unwrap();
            assert_near(x[0], setpoint, 1e-9 * setpoint.abs());
        }
    }

    #[test]
    fn without_an_equilibrium_the_search_reports_the_fastest_state() {
        let error = equilibrium(pendulum, &[0.5, 0.0, 20.0], &[true, true, false]).unwrap_err();
        assert!(matches!(error, NoEquilibrium::Restless { state: 1, rate } if rate > 10.0), "{error}");
    }
}
