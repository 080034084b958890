//! Baseline: the declared model, fitted to the calibration records by least squares.

use mops_core::Role;
use mops_math as math;
use mops_math::stream;
use mops_statistics::{Sampling, draw};
use rayon::prelude::*;

use super::fitted_set::{Start, estimation};
use crate::estimation::{ITERATIONS, ROUND_ITERATIONS};
use crate::fit::{Meter, Piece, Point, cut, pieces, problem};
use crate::records::Subject;

/// Windows that each record is first cut into, initial states free in each; then half as many. Basis: an assumption.
pub const WINDOWS: usize = 8;

/// Starts of the declared model in the box of its bounds, beside that of the study. Basis: the studies.
const SPREAD: usize = 8;

/// Starts of the declared model that are followed to the end. Basis: the studies.
const ROOTS: usize = 2;

/// Relative difference of two sums of squares up to which two starts have arrived at the same optimum. Basis: an
/// assumption.
const SAME_OPTIMUM: f64 = 1e-3;

/// Fitted values, and the sum of squares of the residuals in noises.
struct Fitted {
    tuners: Vec<f64>,
    locals: Vec<Vec<f64>>,
    sum: f64,
}

/// Fits the declared model by multiple shooting that grows to whole records, from the start of the study and from
/// spread ones; `None` if no simulation succeeds.
///
/// Source: H. G. Bock, Recent advances in parameter identification techniques for ODE, in Numerical Treatment of
/// Inverse Problems (1983) 95.
pub fn baseline(subject: &Subject, simulations: &Meter<'_>) -> Option<Start> {
    let whole = pieces::pieces(subject, |role| role == Role::Calibration);
    let in_windows = |count: usize| -> Vec<Piece> {
        let of = |p: &Piece| cut(p.measurement, &subject.measurements[p.measurement], subject.model.as_ref(), count);
        whole.iter().flat_map(of).collect()
    };
    let fit = |pieces: Vec<Piece>, tuners: &[f64], locals: Vec<Vec<f64>>, iterations: usize| -> Option<Fitted> {
        let (fit, point, variant) = problem(subject, &[], pieces, tuners, locals, &[], simulations);
        let estimation = estimation(subject, &fit, &variant, &[], &[], &point);
        let found = estimation.with(&crate::estimation::Errors::White, point, iterations)?;
        let sum = fit.all(&found.point)?.iter().flatten().map(|r| r * r).sum();
        let Point { globals, locals } = found.point;
        Some(Fitted { tuners: globals, locals, sum })
    };
    let shortest = in_windows(WINDOWS);
    let first = |tuners: &Vec<f64>| fit(shortest.clone(), tuners, pieces::first_locals(&shortest), ROUND_ITERATIONS);
    let mut starts = vec![subject.start()];
    starts.extend(spread(subject));
    let mut started: Vec<Fitted> = starts.par_iter().filter_map(first).collect();
    started.sort_by(|a, b| a.sum.total_cmp(&b.sum));
    started.dedup_by(|later, earlier| later.sum <= (1.0 + SAME_OPTIMUM) * earlier.sum);
    started.truncate(ROOTS);
    let to_the_end = |started: &Fitted| {
        let mut tuners = started.tuners.clone();
        let mut starts = begin_of_records(&whole, &shortest, &started.locals);
        for count in std::iter::successors(Some(WINDOWS / 2), |count| Some(count / 2)).take_while(|c| *c > 1) {
            let windows = in_windows(count);
            let locals = pieces::first_locals(&windows);
            let Some(fitted) = fit(windows.clone(), &tuners, locals, ITERATIONS / 2) else { continue };
            starts = begin_of_records(&whole, &windows, &fitted.locals);
            tuners = fitted.tuners;
        }
        fit(whole.clone(), &tuners, starts, ITERATIONS)
    };
    let mut ended: Vec<Fitted> = started.par_iter().filter_map(to_the_end).collect();
    // Windows help a poor start; a good one may need none.
    ended.extend(fit(whole.clone(), &subject.start(), pieces::first_locals(&whole), ITERATIONS));
    let best = ended.into_iter().min_by(|a, b| a.sum.total_cmp(&b.sum))?;
    Some(Start { tuners: best.tuners, locals: best.locals, added: Vec::new() })
}

/// Returns the initial states of whole records from those of their first windows.
fn begin_of_records(whole: &[Piece], windows: &[Piece], fitted: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut starts = pieces::first_locals(whole);
    for (piece, starts) in whole.iter().zip(&mut starts) {
        let Some(first) = windows.iter().position(|w| w.measurement == piece.measurement) else { continue };
        for (local, value) in piece.locals.iter().zip(starts) {
            if let Some(same) = windows[first].locals.iter().position(|l| l.parameter == local.parameter) {
                *value = fitted[first][same].clamp(local.bounds[0], local.bounds[1]);
            }
        }
    }
    starts
}

/// Returns starts from the box of the bounds by a Sobol sequence, in logarithms where the study looks for those; where
/// the box has no end, from as far to both sides of the start as the start is large.
fn spread(subject: &Subject) -> Vec<Vec<f64>> {
    let globals = pieces::globals(subject);
    let start = subject.start();
    let mut random = stream(subject.study.seed(), "spread starts");
    let place = |(k, u): (usize, &f64)| {
        let ([low, high], size) = (globals[k].bounds, start[k].abs().max(globals[k].scale));
        let low = if low.is_finite() { low } else { start[k] - size };
        let high = if high.is_finite() { high } else { start[k] + size };
        if globals[k].log && low > 0.0 { low * math::exp(u * math::ln(high / low)) } else { low + u * (high - low) }
    };
    let points = draw(Sampling::Sobol, SPREAD, globals.len(), &mut random);
    points.iter().map(|point| point.iter().enumerate().map(place).collect()).collect()
}
