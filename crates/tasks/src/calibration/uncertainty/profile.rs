//! Profile likelihood: one parameter is fixed, all others are estimated again.

use mops_core::{Evaluation, Solver, SolverOptions, Watch, study::Tuner, task::Chosen};
use mops_identification::noise::Spread;
use mops_solvers::levenberg_marquardt::LevenbergMarquardtOptions;
use mops_statistics::t_quantile;

use crate::calibration::ProfileReport;

use super::calibrated::{Calibrated, fixed_at, refit};
use crate::batches::{Stage, each};

/// First distance from the estimate of a parameter without a standard error, as a share of its range.
const FIRST: f64 = 0.02;

/// Smallest and largest growth factor of the distance from the estimate. The smallest factor reaches the bound in fewer
/// than
/// [`STEPS`] steps from any standard error that double precision resolves.
const GROWTH: [f64; 2] = [1.3, 2.5];

/// Largest number of steps to each side, and within the bracket of an end.
const STEPS: usize = 150;

/// Largest number of searches for all ends, each relative to the best fit found by the previous one.
const PASSES: usize = 3;

/// Relative tolerance of the root of the likelihood ratio at an end.
const ACCURATE: f64 = 1e-3;

/// Smallest width of the bracket of an end, relative to its distance from the estimate; reached at a discontinuity.
const NARROW: f64 = 1e-4;

/// Root of the likelihood ratio of a better fit than the estimates above which the interval refers to that fit.
const LOWER: f64 = 0.1;
/// Root of the likelihood ratio of a better fit than the estimates above which a warning is given: the estimates are
/// then off by a standard error.
const BETTER: f64 = 1.0;

/// Result of profiling.
pub(super) struct Profiles {
    pub profiles: Vec<ProfileReport>,
    pub simulations: usize,
    /// Objective far below that of the estimates, if found; the estimates are then not the best fit.
    pub better: Option<f64>,
}

/// Computes the profiles of the chosen tuners.
///
/// With `S(v)` the minimum sum of squares for the parameter fixed at `v`, the interval is
/// `{v : S(v) - S_min <= t^2 s(v)^2}`. The scale `s(v)^2` is the variance of the noise along the change of the
/// residuals from the estimate to `v`. For a linear model, the interval is then that of the standard error,
/// `estimate +- t error`, whatever the weights. For residuals of equal variance, `s(v)^2` is that variance.
///
/// Sources: D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its Applications (1988), section 6.1.2; J. T.
/// Kent, Biometrika 69 (1982) 19-27 (likelihood ratios of weights that are not those of the noise).
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
                let (lower, cost) = refit(fixed_at(problem, &least.tuners, None), local, watch);
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

/// Returns the root of the likelihood ratio of a fit and a better one, `((S - S_better) / s^2)^(1/2)`; 0 if the fit is
/// no worse.
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

/// Returns the t quantile for the estimate of a tuner; for a tuner that the data do not determine, with the degrees of
/// freedom of all residuals.
fn limit(calibrated: &Calibrated<'_>, k: usize) -> f64 {
    let Spread { freedom, .. } = calibrated.covariance.of_tuner(k);
    let freedom = if freedom >= 1.0 { freedom } else { calibrated.covariance.noise().freedom() };
    t_quantile(0.5 + 0.5 * calibrated.level, freedom)
}

/// One side of a profile.
struct Side {
    /// Value and signed root of the likelihood ratio, in the order of the distance from the estimate.
    points: Vec<(f64, f64)>,
    end: f64,
    why: &'static str,
    simulations: usize,
    /// Fit with the smallest objective found.
    least: Evaluation,
}

/// Point of a profile: the parameter is fixed, all others are estimated again.
struct ProfilePoint {
    /// Position of the value on the tuner's scale, 0 to 1.
    position: f64,
    /// Root of the likelihood ratio.
    root: f64,
    /// Values of all tuners.
    tuners: Vec<f64>,
}

/// Search for the end of one side. Distances are on the scale of the tuner.
struct Search<'a> {
    calibrated: &'a Calibrated<'a>,
    /// Best fit.
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

    /// Steps from the estimate towards the bound with growing steps; an end is bracketed by the last point within the
    /// limit and the first one beyond.
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
        let mut within = vec![ProfilePoint { position: start, root: 0.0, tuners: best.tuners.clone() }];
        for _ in 0..STEPS {
            let position = (start + self.sign * reach).clamp(0.0, 1.0);
            let Some(mut point) = self.refit_at(position, &within, &best.tuners) else { return self.side };
            if point.root >= self.limit {
                match self.end_between(start, &mut within, point) {
                    Some(farther) => point = farther,
                    None => return self.side,
                }
            }
            if point.position == bound {
                (self.side.end, self.side.why) = (self.tuner.value_at(bound), "bound");
                return self.side;
            }
            // Extrapolates to just beyond the limit.
            let [least, most] = GROWTH;
            let wanted = if point.root > 0.0 { 1.02 * self.limit / point.root } else { most };
            reach = (point.position - start).abs() * wanted.clamp(least, most);
            within.push(point);
        }
        self.side
    }

    /// Locates the end between the last point within the limit and one beyond, by regula falsi. A step that does not
    /// halve the bracket is followed by a bisection. Returns `None` if the end is found or the search is over. Returns
    /// the point beyond if a refit shows that it is within the limit.
    fn end_between(
        &mut self,
        start: f64,
        within: &mut Vec<ProfilePoint>,
        mut beyond: ProfilePoint,
    ) -> Option<ProfilePoint> {
        let mut halve = false;
        for _ in 0..STEPS {
            let last = within.last().expect("the estimate is within the limit");
            let width = beyond.position - last.position;
            if beyond.root - self.limit <= ACCURATE * self.limit {
                (self.side.end, self.side.why) = (self.tuner.value_at(beyond.position), "data");
                return None;
            }
            if width.abs() <= NARROW * (beyond.position - start).abs() {
                // Discontinuity of the likelihood, or a change of the local minimum reached by the estimates beyond.
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
            let point = self.refit_at(position, within, &beyond.tuners)?;
            if (point.root - self.limit).abs() <= ACCURATE * self.limit {
                (self.side.end, self.side.why) = (self.tuner.value_at(position), "data");
                return None;
            }
            let left = if point.root < self.limit {
                (beyond.position - position).abs()
            } else {
                (position - last.position).abs()
            };
            halve = left > 0.5 * width.abs();
            if point.root < self.limit { within.push(point) } else { beyond = point }
        }
        None
    }

    /// Estimates all other tuners with the parameter fixed. The initial guess is extrapolated from the last two points
    /// within the limit. If the result is beyond the limit, the last point and `other` are tried as well. Returns
    /// `None` if no simulation succeeds or a stop is requested.
    fn refit_at(&mut self, position: f64, within: &[ProfilePoint], other: &[f64]) -> Option<ProfilePoint> {
        let last = within.last().expect("the estimate is within the limit");
        let guess = within.len().checked_sub(2).map(|i| self.extrapolated(&within[i], last, position));
        let mut best: Option<ProfilePoint> = None;
        for start in guess.iter().map(Vec::as_slice).chain([last.tuners.as_slice(), other]) {
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

    /// Returns the tuners on the straight line through two points in the unit box, where the parameter has `position`.
    fn extrapolated(&self, from: &ProfilePoint, to: &ProfilePoint, position: f64) -> Vec<f64> {
        let problem = self.calibrated.problem;
        let share = (position - to.position) / (to.position - from.position);
        let ends = [from, to].map(|point| problem.point_of(&point.tuners));
        let point: Vec<f64> =
            ends[0].iter().zip(&ends[1]).map(|(a, b)| (b + share * (b - a)).clamp(0.0, 1.0)).collect();
        problem.tuners_at(&point)
    }

    /// Estimates all other tuners with the parameter fixed, from an initial guess.
    fn estimated(&mut self, position: f64, start: &[f64], solver: Box<dyn Solver>) -> Option<ProfilePoint> {
        let problem = self.calibrated.problem;
        let index = problem.active()[self.k];
        let mut tuners = start.to_vec();
        tuners[index] = self.tuner.value_at(position);
        let (found, simulations) = refit(fixed_at(problem, &tuners, Some(index)), solver, self.watch);
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
        Some(ProfilePoint { position, root, tuners: found.tuners })
    }
}
