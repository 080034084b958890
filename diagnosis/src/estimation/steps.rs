//! Search over parameters that no derivative determines, as samples jump: the size of steps, the width of a gap, the
//! force at which a joint breaks away.

use mops_math as math;

use super::errors::Errors;
use super::estimate::{Estimate, Estimation, SETTLED};

/// Iterations in which the other unknowns follow one that is moved. Basis: where residuals are small each squares the
/// distance to the optimum. Source: J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition (2006), section 10.3.
pub const FOLLOW: usize = 2;

/// Trials for each parameter that no derivative moves. Basis: three at each stride.
const TRIALS: usize = 24;

/// Halvings of their stride, from which the end of an interval is searched with twice as many doublings. Basis: the
/// shortest stride is 0.4 % of the typical size, finer than an interval need be.
const HALVINGS: i32 = 8;

/// Turns of all such parameters. Basis: an assumption.
pub const TURNS: usize = 3;

/// Bisections in the search for the end of an interval. Basis: the end is known to 1.6 % of its distance, two digits.
const BISECTIONS: usize = 6;

/// Decrease of log-likelihood at the ends of a 95 % interval: half the quantile of chi-squared with one degree of
/// freedom.
pub const FALL: f64 = 1.920_729;

impl Estimation<'_> {
    /// Improves an estimate by least squares by a compass search over the parameters that no derivative determines, in
    /// turns with the others.
    ///
    /// Source: T. G. Kolda, R. M. Lewis, V. Torczon, Optimization by direct search, SIAM Review 45 (2003) 385.
    pub fn with_steps(&self, found: Estimate) -> Estimate {
        let globals = &self.fit.globals;
        let stepped: Vec<usize> = (0..globals.len()).filter(|&k| globals[k].is_stepped()).collect();
        let mut best = found;
        for _ in 0..if stepped.is_empty() { 0 } else { TURNS } {
            let before = best.log_likelihood;
            for &k in &stepped {
                let mut halvings = 0;
                for _ in 0..TRIALS {
                    if halvings > HALVINGS {
                        break;
                    }
                    let stride = globals[k].scale * math::powi(0.5, halvings);
                    let beside = |by: f64| {
                        let there = self.beside(&best, &Errors::White, k, by)?;
                        (there.log_likelihood > best.log_likelihood).then_some(there)
                    };
                    match [stride, -stride].into_iter().find_map(beside) {
                        Some(moved) => best = moved,
                        None => halvings += 1,
                    }
                }
            }
            if best.log_likelihood < before + SETTLED {
                break;
            }
            best = self.least_squares(best.point.clone()).unwrap_or(best);
        }
        best
    }

    /// Returns the 95 % interval of a parameter that no derivative determines, the others following: its ends by
    /// strides that double, then by bisection; `None` if the log-likelihood is unknown at the estimate.
    pub fn stepped_interval(&self, estimate: &Estimate, k: usize) -> Option<[f64; 2]> {
        let global = &self.fit.globals[k];
        let value = estimate.point.globals[k];
        let most = self.log_likelihood(&estimate.errors, &estimate.point)?;
        let is_within = |by: f64| {
            let there = self.beside(estimate, &estimate.errors, k, by);
            there.is_some_and(|there| there.log_likelihood >= most - FALL)
        };
        let place = |by: f64| (value + by).clamp(global.bounds[0], global.bounds[1]);
        let end = |side: f64| {
            let (mut inner, mut outer) = (0.0, side * global.scale * math::powi(0.5, HALVINGS));
            let farthest = outer.abs() * math::powi(2.0, 2 * HALVINGS);
            while is_within(outer) {
                if global.bounds.contains(&place(outer)) || outer.abs() >= farthest {
                    return place(outer);
                }
                (inner, outer) = (outer, 2.0 * outer);
            }
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (inner + outer);
                *(if is_within(middle) { &mut inner } else { &mut outer }) = middle;
            }
            // What lies between is not known to be within.
            place(outer)
        };
        Some([end(-1.0), end(1.0)])
    }

    /// Returns an estimate with a parameter moved, the others following under given hyperparameters.
    fn beside(&self, estimate: &Estimate, errors: &Errors, k: usize, by: f64) -> Option<Estimate> {
        let mut point = estimate.point.clone();
        let [low, high] = self.fit.globals[k].bounds;
        point.globals[k] = (point.globals[k] + by).clamp(low, high);
        self.with(errors, point, FOLLOW)
    }
}
