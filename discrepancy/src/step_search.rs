//! Search over what no slope tells, as samples jump: the size of steps, the width of gaps, the force at which a joint breaks away.

use std::sync::OnceLock;

use crate::fit::{Fit, Fitted, Global, Residuals, Slopes};
use crate::least_squares::{damped_step, sum_of_squares};
use mops_core::math;

/// How thoroughly sizes are looked for.
struct Effort {
    /// How often the stride is halved at most.
    halvings: i32,
    /// How often a size is looked for on both sides of the best.
    looks: usize,
    /// How often sizes and the other unknowns take turns.
    turns: usize,
}

/// In a fit of at least so many iterations, and in a shorter one.
const LONG: usize = 10;
const THOROUGH: Effort = Effort { halvings: 8, looks: 24, turns: 4 };
const BRIEF: Effort = Effort { halvings: 2, looks: 6, turns: 1 };

impl Fit<'_> {
    /// A fit in which sizes of steps and the other unknowns have taken turns; `iterations` for the others each time. In a short
    /// one the sizes before the global `first` stay as they are.
    pub(crate) fn with_steps(&self, fitted: Fitted, iterations: usize, first: usize) -> Fitted {
        let mut fitted = fitted;
        let (effort, first) = if iterations < LONG { (BRIEF, first) } else { (THOROUGH, 0) };
        let stepped: Vec<usize> = (first..self.globals.len()).filter(|&k| self.globals[k].is_stepped()).collect();
        if stepped.is_empty() {
            return fitted;
        }
        for _ in 0..effort.turns {
            let before = fitted.chi2;
            for &k in &stepped {
                fitted = self.stepped(&fitted, k, &effort).unwrap_or(fitted);
            }
            if fitted.chi2 >= before * (1.0 - 1e-3) {
                break;
            }
            let Some(normal) = self.normal_at(&fitted) else { break };
            fitted = self.levenberg_marquardt(fitted.point, normal, iterations);
        }
        fitted
    }

    /// A fit with the best size of steps or width of a gap that a compass search finds, the others following to first order:
    /// they make up for most of a wrong size. `None` where the slopes cannot be had.
    ///
    /// The share of samples that are a step off, and with it the sum of squares, grows in proportion to the distance from the
    /// true size. Source of the method: T. G. Kolda, R. M. Lewis, V. Torczon, Optimization by direct search, SIAM Review 45
    /// (2003) 385.
    fn stepped(&self, fitted: &Fitted, k: usize, effort: &Effort) -> Option<Fitted> {
        let slopes = self.looks(&fitted.point, Slopes::Free)?;
        let global = &self.globals[k];
        let mut best = fitted.clone();
        let mut halvings = 0;
        for _ in 0..effort.looks {
            if halvings > effort.halvings {
                break;
            }
            let stride = global.scale * math::powi(0.5, halvings);
            let beside = |by: f64| self.beside(&best, &slopes, k, by);
            let better = |fitted: &Fitted| fitted.chi2 < best.chi2;
            match [stride, -stride].into_iter().find_map(|by| beside(by).filter(better)) {
                Some(moved) => best = moved,
                None => halvings += 1,
            }
        }
        Some(best)
    }

    /// The fit with the global `k` moved, the others following to first order; `slopes` are those where the search began.
    fn beside(&self, fitted: &Fitted, slopes: &[Residuals], k: usize, by: f64) -> Option<Fitted> {
        let [low, high] = self.globals[k].bounds;
        let mut point = fitted.point.clone();
        point.globals[k] = (point.globals[k] + by).clamp(low, high);
        let residuals = self.all(&point)?.into_iter().zip(slopes);
        let all = residuals.map(|(r, slopes)| Residuals { r, j: slopes.j.clone() }).collect();
        let normal = self.equations(&point, all);
        let step = damped_step(&normal, &self.held_by_slopes(&point, &normal.gradient), 1e-3)?;
        let point = self.moved(&point, &step);
        let residuals = self.all(&point)?;
        let chi2 = sum_of_squares(&residuals);
        Some(Fitted { point, chi2, residuals, normal: OnceLock::new(), count: fitted.count })
    }

    /// The interval around the global `k`, which no slope tells, beyond which the sum of squares is larger by `rise`, the others
    /// following to first order: its ends by strides that double, then by bisection. `None` where the slopes cannot be had.
    pub(crate) fn stepped_interval(&self, fitted: &Fitted, k: usize, rise: f64) -> Option<[f64; 2]> {
        const DOUBLINGS: i32 = 16;
        const BISECTIONS: usize = 6;
        let slopes = self.looks(&fitted.point, Slopes::Free)?;
        let Global { scale, bounds, .. } = self.globals[k];
        let value = fitted.point.globals[k];
        let is_within =
            |by: f64| self.beside(fitted, &slopes, k, by).is_some_and(|there| there.chi2 <= fitted.chi2 + rise);
        let end = |side: f64| {
            let place = |by: f64| (value + by).clamp(bounds[0], bounds[1]);
            let mut inner = 0.0;
            let mut outer = side * scale * math::powi(0.5, THOROUGH.halvings);
            let farthest = outer.abs() * math::powi(2.0, DOUBLINGS);
            while is_within(outer) {
                if place(outer) == bounds[0] || place(outer) == bounds[1] || outer.abs() >= farthest {
                    return place(outer);
                }
                inner = outer;
                outer *= 2.0;
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
}
