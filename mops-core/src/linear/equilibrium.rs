//! Where a system can rest.

use std::fmt;

use nalgebra::{DMatrix, DVector};

/// What must vanish, with its slopes.
#[derive(Debug, Clone)]
pub struct Balance {
    /// The rates of change of the states.
    pub rates: Vec<f64>,
    /// Their derivative by states, then inputs: as many rows as rates.
    pub slopes: DMatrix<f64>,
}

/// Why a search ended without an equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub enum NoEquilibrium {
    /// The rates are not defined at the start.
    Undefined(String),
    /// The search ends where this state changes fastest, at this rate per s.
    Restless {
        /// Index of the state.
        state: usize,
        /// Its rate of change, positive.
        rate: f64,
    },
}

impl fmt::Display for NoEquilibrium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Undefined(why) => f.write_str(why),
            Self::Restless { state, rate } => {
                write!(f, "no equilibrium was found: the search ends where state {state} changes by {rate:.3e} per s")
            }
        }
    }
}

/// A point near `start` at which all rates vanish, where only the `free` ones of states and inputs move.
///
/// Newton's method, with the shortest step where several points are possible, and shorter steps where a whole one does not
/// bring the rates down. Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition (2006), sections 10.3, 11.2.
///
/// # Errors
/// What the rates refuse at the start; no point found.
pub fn equilibrium(
    mut rates: impl FnMut(&[f64]) -> Result<Balance, String>,
    start: &[f64],
    free: &[bool],
) -> Result<Vec<f64>, NoEquilibrium> {
    /// Sum of weighted rates that is rounding.
    const SMALL: f64 = 1e-12;
    let moving: Vec<usize> = (0..start.len()).filter(|&i| free[i]).collect();
    let mut x = start.to_vec();
    let mut here = rates(&x).map_err(NoEquilibrium::Undefined)?;
    // Rates of different units are weighed by what moves them.
    let weigh = |at: &Balance| -> DVector<f64> {
        let row = |i: usize| moving.iter().map(|&j| at.slopes[(i, j)].abs()).fold(0.0, f64::max);
        DVector::from_fn(at.rates.len(), |i, _| if row(i) > 0.0 { 1.0 / row(i) } else { 1.0 })
    };
    let weights = weigh(&here);
    let distance = |at: &Balance| {
        let weighed = at.rates.iter().zip(weights.iter()).map(|(rate, weight)| (rate * weight).powi(2));
        weighed.sum::<f64>().sqrt()
    };
    for _ in 0..200 {
        let far = distance(&here);
        let size = x.iter().map(|x| x.abs()).fold(1.0, f64::max);
        if far <= SMALL * size {
            return Ok(x);
        }
        let slopes = DMatrix::from_fn(here.rates.len(), moving.len(), |i, j| weights[i] * here.slopes[(i, moving[j])]);
        let wanted = DVector::from_fn(here.rates.len(), |i, _| -weights[i] * here.rates[i]);
        let svd = slopes.svd(true, true);
        let threshold = 1e-10 * svd.singular_values.iter().copied().fold(0.0, f64::max);
        let Ok(step) = svd.solve(&wanted, threshold.max(f64::MIN_POSITIVE)) else { break };
        let mut share = 1.0;
        loop {
            let mut next = x.clone();
            for (&j, dx) in moving.iter().zip(step.iter()) {
                next[j] += share * dx;
            }
            // A point at which the rates are not defined is too far.
            if let Ok(there) = rates(&next)
                && distance(&there) < far * (1.0 - 1e-4 * share)
            {
                (x, here) = (next, there);
                break;
            }
            share *= 0.5;
            if share < 1e-10 {
                // Rounding leaves what cannot be brought down further.
                if far <= 1e-9 * size {
                    return Ok(x);
                }
                return Err(no_equilibrium(&here));
            }
        }
    }
    Err(no_equilibrium(&here))
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
    use crate::linear::testing::assert_near;

    /// A pendulum with torque: x = (angle, speed), u = torque; `9.81 sin(angle) + torque = 0` at rest.
    fn pendulum(z: &[f64]) -> Result<Balance, String> {
        Ok(Balance {
            rates: vec![z[1], 9.81 * z[0].sin() - 0.1 * z[1] + z[2]],
            slopes: DMatrix::from_row_slice(2, 3, &[0.0, 1.0, 0.0, 9.81 * z[0].cos(), -0.1, 1.0]),
        })
    }

    #[test]
    fn from_a_start_the_state_moves_to_where_it_can_rest() {
        let x = equilibrium(pendulum, &[2.8, 0.3, 0.0], &[true, true, false]).unwrap();
        assert_near(x[0], PI, 1e-12);
        assert_eq!((x[1].abs() < 1e-14, x[2]), (true, 0.0));
    }

    #[test]
    fn with_the_state_held_the_input_that_keeps_it_is_found() {
        let x = equilibrium(pendulum, &[0.5, 0.0, 0.0], &[false, true, true]).unwrap();
        assert_near(x[2], -9.81 * 0.5f64.sin(), 1e-12);
        assert_eq!(x[0], 0.5);
    }

    #[test]
    fn without_an_equilibrium_the_search_says_so() {
        let error = equilibrium(pendulum, &[0.5, 0.0, 20.0], &[true, true, false]).unwrap_err();
        assert!(matches!(error, NoEquilibrium::Restless { state: 1, rate } if rate > 10.0), "{error}");
    }
}
