//! Profiles of the likelihood: one parameter held, all others estimated again.

use mops_core::identification::Spread;
use mops_core::statistics::t_quantile;
use mops_core::{Chosen, Evaluation, ProfileReport, Solver, SolverOptions, Tuner, Watch};
use mops_solvers::levenberg_marquardt::LevenbergMarquardtOptions;

use super::{Calibrated, held_at, refit};
use crate::tasks::batches::{Stage, each};

/// First distance from the estimate of a parameter without a standard error, as a share of its range.
const FIRST: f64 = 0.02;

/// How much farther from the estimate a step goes than the last, at least and at most. The least leads from any standard error
/// that double precision resolves to the bound in fewer than [`STEPS`].
const FARTHER: [f64; 2] = [1.3, 2.5];

/// Steps to each side, and within the bracket of an end, at most.
const STEPS: usize = 150;

/// Searches for all ends, each against the best fit that the last has met, at most.
const PASSES: usize = 3;

/// The root of the likelihood ratio meets its limit to this share.
const ACCURATE: f64 = 1e-3;

/// Width of the bracket of an end that is not met more closely, as at a jump, as a share of its distance from the estimate.
const NARROW: f64 = 1e-4;

/// Root of the likelihood ratio of a fit better than the estimates from which on the interval belongs to that fit, and from which
/// on it is worth a warning: there the estimates are off by a standard error.
const LOWER: f64 = 0.1;
const BETTER: f64 = 1.0;

/// What profiling brought.
pub(super) struct Profiles {
    pub profiles: Vec<ProfileReport>,
    pub simulations: usize,
    /// An objective far below that of the estimates, if one was met: they are then not the best fit.
    pub better: Option<f64>,
}

/// Profiles of the tuners that are chosen.
///
/// With `S(v)` the least sum of squares where the parameter is held at `v`, the interval holds where
/// `S(v) - S_min <= t^2 s(v)^2`. The scale `s(v)^2` is the variance of the noise along the change of the residuals from the
/// estimate to `v`. It makes the interval of a linear model that of the standard error, `estimate +- t error`, whatever the
/// weights; of residuals of one variance it is that variance.
///
/// Sources: D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its Applications (1988), section 6.1.2; J. T. Kent,
/// Biometrika 69 (1982) 19-27 (likelihood ratios of weights that are not those of the noise).
pub(super) fn profiles(calibrated: &Calibrated<'_>, chosen: &Chosen, watch: &dyn Watch) -> Profiles {
    let problem = calibrated.problem;
    let study = problem.study();
    let picked: Vec<usize> =
        (0..problem.active().len()).filter(|&k| chosen.has(&study.tuners()[problem.active()[k]].name)).collect();
    let sides: Vec<(usize, f64)> = picked.iter().flat_map(|&k| [(k, -1.0), (k, 1.0)]).collect();
    let stage = Stage { what: "profiling the likelihood", from: 0.0, to: 1.0 };
    let mut reference = calibrated.best.clone();
    let (mut simulations, mut passes) = (0, 0);
    let found = loop {
        passes += 1;
        let found = each(&sides, stage, watch, |&(k, sign)| Search::new(calibrated, &reference, k, sign, watch).side());
        simulations += found.iter().map(|side| side.simulations).sum::<usize>();
        let least = found.iter().map(|side| &side.least).min_by(|a, b| a.merit.objective.total_cmp(&b.merit.objective));
        match least.filter(|least| passes < PASSES && root(calibrated, least, &reference) > LOWER) {
            Some(least) => {
                let local = LevenbergMarquardtOptions::default().local();
                let (lower, cost) = refit(held_at(problem, &least.tuners, None), local, watch);
                simulations += cost;
                reference = lower.unwrap_or_else(|| least.clone());
            }
            None => break found,
        }
    };
    let report = |(&k, sides): (&usize, &[Side])| {
        let [below, above] = sides else { unreachable!("two sides of every profile") };
        let tuner = &study.tuners()[problem.active()[k]];
        let value = calibrated.best.tuners[problem.active()[k]];
        let half = calibrated.covariance.of_tuner(k).half_width(calibrated.level);
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
            limit: limit(calibrated, k),
        }
    };
    let better = root(calibrated, &reference, calibrated.best) > BETTER;
    Profiles {
        profiles: picked.iter().zip(found.chunks_exact(2)).map(report).collect(),
        simulations,
        better: better.then_some(reference.merit.objective),
    }
}

/// Root of the likelihood ratio of a fit and a better one, `((S - S_better) / s^2)^(1/2)`; 0 where the fit is no worse.
fn root(calibrated: &Calibrated<'_>, better: &Evaluation, fit: &Evaluation) -> f64 {
    let excess = fit.merit.objective - better.merit.objective;
    let change: Vec<f64> = fit.residuals.iter().zip(&better.residuals).map(|(a, b)| a - b).collect();
    let size = change.iter().map(|d| d * d).sum::<f64>().sqrt();
    if excess <= 0.0 || size == 0.0 {
        return 0.0;
    }
    let direction: Vec<f64> = change.iter().map(|d| d / size).collect();
    excess.sqrt() / calibrated.covariance.noise().along(&direction).deviation
}

/// The t quantile of the estimate of a tuner; of all noise where the data do not determine the tuner.
fn limit(calibrated: &Calibrated<'_>, k: usize) -> f64 {
    let Spread { freedom, .. } = calibrated.covariance.of_tuner(k);
    let freedom = if freedom >= 1.0 { freedom } else { calibrated.covariance.noise().freedom() };
    t_quantile(0.5 + 0.5 * calibrated.level, freedom)
}

/// One side of a profile.
struct Side {
    /// Value and signed root of the likelihood ratio, away from the estimate.
    points: Vec<(f64, f64)>,
    end: f64,
    why: &'static str,
    simulations: usize,
    /// The fit with the least objective that was met.
    least: Evaluation,
}

/// A value of the parameter, all others estimated again.
struct Held {
    /// Position of the value on the tuner's scale, 0 to 1.
    position: f64,
    /// Root of the likelihood ratio.
    root: f64,
    /// Values of all tuners.
    tuners: Vec<f64>,
}

/// The search for the end of one side. Distances are those of the tuner's scale.
struct Search<'a> {
    calibrated: &'a Calibrated<'a>,
    /// The best fit.
    reference: &'a Evaluation,
    watch: &'a dyn Watch,
    k: usize,
    sign: f64,
    tuner: &'a Tuner,
    limit: f64,
    side: Side,
}

impl<'a> Search<'a> {
    fn new(
        calibrated: &'a Calibrated<'a>,
        reference: &'a Evaluation,
        k: usize,
        sign: f64,
        watch: &'a dyn Watch,
    ) -> Self {
        let tuner = &calibrated.problem.study().tuners()[calibrated.problem.active()[k]];
        let least = reference.clone();
        let side = Side { points: Vec::new(), end: f64::NAN, why: "open", simulations: 0, least };
        Self { calibrated, reference, watch, k, sign, tuner, limit: limit(calibrated, k), side }
    }

    /// Goes from the estimate to the bound in growing steps; an end lies between the last point within the limit and the first
    /// beyond.
    fn side(mut self) -> Side {
        let best = self.calibrated.best;
        let value = best.tuners[self.calibrated.problem.active()[self.k]];
        let start = self.tuner.position_of(value);
        let bound = if self.sign < 0.0 { 0.0 } else { 1.0 };
        if start == bound {
            (self.side.end, self.side.why) = (value, "bound");
            return self.side;
        }
        let error = self.calibrated.covariance.of_tuner(self.k).deviation / self.tuner.slope_at(value).abs();
        let mut reach = if error > 0.0 { 0.5 * self.limit * error } else { FIRST };
        // The points within the limit, the farthest last.
        let mut within = vec![Held { position: start, root: 0.0, tuners: best.tuners.clone() }];
        for _ in 0..STEPS {
            let position = (start + self.sign * reach).clamp(0.0, 1.0);
            let Some(mut held) = self.held(position, &within, &best.tuners) else { return self.side };
            if held.root >= self.limit {
                match self.end_between(start, &mut within, held) {
                    Some(farther) => held = farther,
                    None => return self.side,
                }
            }
            if held.position == bound {
                (self.side.end, self.side.why) = (self.tuner.value_at(bound), "bound");
                return self.side;
            }
            // Along the slope so far, just beyond the limit.
            let [least, most] = FARTHER;
            let wanted = if held.root > 0.0 { 1.02 * self.limit / held.root } else { most };
            reach = (held.position - start).abs() * wanted.clamp(least, most);
            within.push(held);
        }
        self.side
    }

    /// Sets the end between the last point within the limit and one beyond, by the rule of false position and, wherever that does
    /// not halve the bracket, by halving. `None` where it is found, or the search is over; else the point beyond, which is within
    /// the limit after all.
    fn end_between(&mut self, start: f64, within: &mut Vec<Held>, mut beyond: Held) -> Option<Held> {
        let mut halve = false;
        for _ in 0..STEPS {
            let last = within.last().expect("the estimate is within the limit");
            let width = beyond.position - last.position;
            if beyond.root - self.limit <= ACCURATE * self.limit {
                (self.side.end, self.side.why) = (self.tuner.value_at(beyond.position), "data");
                return None;
            }
            if width.abs() <= NARROW * (beyond.position - start).abs() {
                // A jump of the likelihood, or of the minimum that the estimates beyond have been led to.
                let elsewhere =
                    self.estimated(beyond.position, &beyond.tuners, LevenbergMarquardtOptions::default().build())?;
                if elsewhere.root < self.limit {
                    return Some(elsewhere);
                }
                (self.side.end, self.side.why) = (self.tuner.value_at(beyond.position), "data");
                return None;
            }
            let straight = (self.limit - last.root) / (beyond.root - last.root);
            let share = if halve { 0.5 } else { straight.clamp(0.05, 0.95) };
            let position = last.position + share * width;
            let held = self.held(position, within, &beyond.tuners)?;
            if (held.root - self.limit).abs() <= ACCURATE * self.limit {
                (self.side.end, self.side.why) = (self.tuner.value_at(position), "data");
                return None;
            }
            let left = if held.root < self.limit {
                (beyond.position - position).abs()
            } else {
                (position - last.position).abs()
            };
            halve = left > 0.5 * width.abs();
            if held.root < self.limit { within.push(held) } else { beyond = held }
        }
        None
    }

    /// All other tuners estimated again with the parameter held: from where the last two points within the limit lead, and, where
    /// that is beyond the limit, from the last of them and from another start. `None` where no simulation succeeds, or the user
    /// wants an end.
    fn held(&mut self, position: f64, within: &[Held], other: &[f64]) -> Option<Held> {
        let last = within.last().expect("the estimate is within the limit");
        let ahead = within.len().checked_sub(2).map(|i| self.ahead(&within[i], last, position));
        let mut best: Option<Held> = None;
        for start in ahead.iter().map(Vec::as_slice).chain([last.tuners.as_slice(), other]) {
            if self.watch.wants_stop() {
                return None;
            }
            let local = LevenbergMarquardtOptions::default().local();
            let found = self.estimated(position, start, local);
            best = match (best, found) {
                (Some(best), Some(found)) if found.root < best.root => Some(found),
                (best, found) => best.or(found),
            };
            if best.as_ref().is_some_and(|best| best.root < self.limit) {
                break;
            }
        }
        best
    }

    /// Values of all tuners on the straight line through two points, in the unit box.
    fn ahead(&self, from: &Held, to: &Held, position: f64) -> Vec<f64> {
        let problem = self.calibrated.problem;
        let share = (position - to.position) / (to.position - from.position);
        let ends = [from, to].map(|held| problem.point_of(&held.tuners));
        let point: Vec<f64> =
            ends[0].iter().zip(&ends[1]).map(|(a, b)| (b + share * (b - a)).clamp(0.0, 1.0)).collect();
        problem.tuners_at(&point)
    }

    /// All other tuners estimated again with the parameter held, from a start.
    fn estimated(&mut self, position: f64, start: &[f64], solver: Box<dyn Solver>) -> Option<Held> {
        let problem = self.calibrated.problem;
        let index = problem.active()[self.k];
        let mut tuners = start.to_vec();
        tuners[index] = self.tuner.value_at(position);
        let (found, simulations) = refit(held_at(problem, &tuners, Some(index)), solver, self.watch);
        self.side.simulations += simulations;
        let found = found?;
        let root = root(self.calibrated, self.reference, &found);
        if found.merit.objective < self.side.least.merit.objective {
            self.side.least = found.clone();
        }
        let point = (tuners[index], self.sign * root);
        let place = self.side.points.partition_point(|&(other, _)| (point.0 - other) * self.sign > 0.0);
        match self.side.points.get_mut(place).filter(|(value, _)| *value == point.0) {
            Some(known) if root < known.1.abs() => *known = point,
            Some(_) => {}
            None => self.side.points.insert(place, point),
        }
        Some(Held { position, root, tuners: found.tuners })
    }
}
