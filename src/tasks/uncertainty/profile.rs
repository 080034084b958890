//! Profiles of the likelihood: one parameter held, all others estimated again.

use mops_core::{Chosen, ProfileReport, Watch};

use super::{Calibrated, held_at, refit};
use crate::tasks::batches::{Stage, each};

/// Steps to each side, at most, and how many standard errors they go far.
const STEPS: usize = 14;
const FARTHEST: f64 = 10.0;

/// The root of the likelihood ratio meets its limit to this share.
const ACCURATE: f64 = 1e-3;

/// An objective lower by more than this share is a better fit, not the solver's tolerance.
const BETTER: f64 = 1e-4;

/// One side of a profile.
struct Side {
    /// Value and signed root of the likelihood ratio, away from the estimate.
    points: Vec<(f64, f64)>,
    end: f64,
    why: &'static str,
    simulations: usize,
    /// The least objective that was met.
    least: f64,
}

/// What profiling brought.
pub(super) struct Profiles {
    pub profiles: Vec<ProfileReport>,
    pub simulations: usize,
    /// An objective below that of the estimates, if one was met: they are then not the best fit.
    pub better: Option<f64>,
}

/// Profiles of the tuners that are chosen.
///
/// With `S(v)` the least sum of squares where the parameter is held at `v`, and `s^2` that at the estimate per degree of
/// freedom, the interval holds where `(S(v) - S_min)/s^2 <= t^2`; for a linear model it is the t interval exactly.
///
/// Source: D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its Applications (1988), section 6.1.2.
pub(super) fn profiles(calibrated: &Calibrated<'_>, chosen: &Chosen, watch: &dyn Watch) -> Profiles {
    let problem = calibrated.problem;
    let study = problem.study();
    let picked: Vec<usize> =
        (0..problem.active().len()).filter(|&k| chosen.has(&study.tuners[problem.active()[k]].name)).collect();
    let sides: Vec<(usize, f64)> = picked.iter().flat_map(|&k| [(k, -1.0), (k, 1.0)]).collect();
    let stage = Stage { what: "profiling the likelihood", from: 0.0, to: 1.0 };
    let found = each(&sides, stage, watch, |&(k, sign)| side(calibrated, k, sign, watch));
    let simulations = found.iter().map(|side| side.simulations).sum();
    let report = |(&k, sides): (&usize, &[Side])| {
        let [below, above] = sides else { unreachable!("two sides of every profile") };
        let tuner = &study.tuners[problem.active()[k]];
        let value = calibrated.best.tuners[problem.active()[k]];
        let half = calibrated.limit * calibrated.covariance.matrix[(k, k)].sqrt();
        let mut points: Vec<(f64, f64)> = below.points.iter().rev().copied().collect();
        points.push((value, 0.0));
        points.extend(&above.points);
        ProfileReport {
            parameter: tuner.name.clone(),
            unit: tuner.unit.to_string(),
            value,
            interval: [below.end, above.end],
            ends: [below.why, above.why],
            linear_interval: [value - half, value + half],
            points,
            limit: calibrated.limit,
        }
    };
    let best = calibrated.best.merit.objective;
    let least = found.iter().map(|side| side.least).fold(best, f64::min);
    Profiles {
        profiles: picked.iter().zip(found.chunks_exact(2)).map(report).collect(),
        simulations,
        better: (least < best * (1.0 - BETTER)).then_some(least),
    }
}

fn side(calibrated: &Calibrated<'_>, k: usize, sign: f64, watch: &dyn Watch) -> Side {
    let Calibrated { problem, best, covariance, limit, .. } = calibrated;
    let index = problem.active()[k];
    let tuner = &problem.study().tuners[index];
    let value = best.tuners[index];
    let bound = if sign < 0.0 { tuner.bounds[0] } else { tuner.bounds[1] };
    let known = covariance.matrix[(k, k)].sqrt();
    let error = if known > 0.0 && known.is_finite() { known } else { 0.05 * (tuner.bounds[1] - tuner.bounds[0]) };
    let mut side = Side { points: Vec::new(), end: f64::NAN, why: "open", simulations: 0, least: best.merit.objective };
    let mut at = best.tuners.clone();
    let mut next = value + sign * 0.5 * limit * error;
    for _ in 0..STEPS {
        let v = if (next - bound) * sign >= 0.0 { bound } else { next };
        let (last, last_root) = side.points.last().copied().unwrap_or((value, 0.0));
        if v == last || watch.wants_stop() {
            break;
        }
        at[index] = v;
        let mut study = held_at(problem, &at, Some(index));
        study.apply_ties(&mut at);
        study.tuners[index].start = v;
        let (found, simulations) = refit(study, watch);
        side.simulations += simulations;
        let Some(found) = found else { break };
        side.least = side.least.min(found.merit.objective);
        let excess = (found.merit.objective - best.merit.objective).max(0.0);
        let root = sign * excess.sqrt() / covariance.deviation;
        at.clone_from(&found.tuners);
        side.points.push((v, root));
        if root.abs() >= *limit {
            (side.end, side.why) =
                (crossing(calibrated, k, [(last, last_root), (v, root)], &at, &mut side, watch), "data");
            break;
        }
        if v == bound {
            (side.end, side.why) = (bound, "bound");
            break;
        }
        // Along the slope so far, so that the limit is near after few steps; not farther than twice as far at once.
        let slope = (root.abs() / (v - value).abs()).max(1e-3 / error);
        let wanted = 1.02 * limit / slope;
        let reach = wanted.min(2.0 * (v - value).abs()).max(1.1 * (v - value).abs());
        next = value + sign * reach;
        if reach > FARTHEST * limit * error && covariance.undetermined == 0 {
            break;
        }
    }
    side
}

/// Where the root of the likelihood ratio meets the limit between two points: by the rule of false position.
fn crossing(
    calibrated: &Calibrated<'_>,
    k: usize,
    mut between: [(f64, f64); 2],
    near: &[f64],
    side: &mut Side,
    watch: &dyn Watch,
) -> f64 {
    let Calibrated { problem, best, covariance, limit, .. } = calibrated;
    let index = problem.active()[k];
    let target = limit * between[1].1.signum();
    let mut at = near.to_vec();
    for _ in 0..8 {
        let [(a, fa), (b, fb)] = between;
        let v = a + (b - a) * ((target - fa) / (fb - fa)).clamp(0.02, 0.98);
        if (fb - target).abs() <= ACCURATE * limit {
            return b;
        }
        at[index] = v;
        let (found, simulations) = refit(held_at(problem, &at, Some(index)), watch);
        side.simulations += simulations;
        let Some(found) = found else { return b };
        let root =
            target.signum() * (found.merit.objective - best.merit.objective).max(0.0).sqrt() / covariance.deviation;
        at.clone_from(&found.tuners);
        side.points.push((v, root));
        side.points.sort_by(|x, y| (x.0 - best.tuners[index]).abs().total_cmp(&(y.0 - best.tuners[index]).abs()));
        if (root - target).abs() <= ACCURATE * limit {
            return v;
        }
        between = if root.abs() < limit.abs() { [(v, root), (b, fb)] } else { [(a, fa), (v, root)] };
    }
    let [(a, fa), (b, fb)] = between;
    a + (b - a) * (target - fa) / (fb - fa)
}
