//! Fits of sets of effects: the ladder of starts, and the error models.

use std::sync::OnceLock;

use mops_core::Role;
use mops_math as math;
use rayon::prelude::*;

use super::fitted_set::{FittedSet, Key, Start, evidence, start_at};
use super::widened::Widened;
use crate::candidates::Candidate;
use crate::estimation::{ErrorModel, Errors, Estimate, Estimation, FOLLOW, LOOK, TURNS};
use crate::fit::{Fit, Meter, Point, Variant, pieces, problem};
use crate::records::Subject;

/// Standard errors up to which a declared term may be 0. Basis: a 95 % interval.
const UNCERTAIN: f64 = 2.0;

/// Distance below the best from which a fit is given up, nats. Basis: odds of 3e-7, more than the priors and Occam
/// factors of three parameters.
pub const HOPELESS: f64 = 15.0;

/// Starts that are fitted to the end; of more, the likeliest third is followed for an iteration, the best third of
/// these for two more, and so on. Source: K. Jamieson, A. Talwalkar, Non-stochastic best arm identification and
/// hyperparameter optimization, AISTATS (2016).
const FOLLOWED: usize = 3;

/// Distance of two optima from which each is a start for the other's error model, standard errors. Basis: closer ones
/// differ by less than 1/8 nat.
const APART: f64 = 0.5;

/// Decrease of log-likelihood from which a set fits worse than one that it contains, nats. Basis: what a parameter
/// without effect gains by chance, half the mean of chi-squared with one degree of freedom.
pub const WORSE: f64 = 0.5;

/// Distances from 0 at which an initial state of an effect is tried, scales. Basis: an assumption.
const DISTANCES: [f64; 6] = [-5.0, 5.0, -10.0, 10.0, -20.0, 20.0];

/// Share of its strength with which an effect is added to the optimum of a set that lacks it. Basis: an assumption.
const FAINT: f64 = 0.05;

/// Fits sets of effects to the calibration records.
pub struct Refit<'a> {
    /// What is diagnosed.
    pub subject: &'a Subject,
    /// Candidates that the data cover.
    pub candidates: Vec<Candidate>,
    /// Nominal rate of each balance along the motion of the baseline.
    pub nominal: Vec<f64>,
    /// The declared model with wider ranges, where parameters stand at the ends of theirs.
    pub widened: Option<Widened>,
    /// Counts simulations, and ends them.
    pub simulations: &'a Meter<'a>,
}

/// Set of effects that was fitted roughly under given hyperparameters.
pub struct Rough {
    /// Where the fit ended.
    pub start: Start,
    /// Log-likelihood there.
    pub log_likelihood: f64,
    /// Logarithm of the evidence for these hyperparameters.
    pub log_evidence: f64,
}

impl<'a> Refit<'a> {
    /// Returns the problem of fitting a set to the calibration records, with the point of a start.
    fn problem(&self, start: &Start) -> (Fit<'a>, Point, Variant) {
        let Start { tuners, locals, added } = start;
        let pieces = pieces::pieces(self.subject, |role| role == Role::Calibration);
        problem(self.subject, added, pieces, tuners, locals.clone(), &[], self.simulations)
    }

    /// Fits a set by least squares: a few iterations from each start, then the best to the end. `None` if all fail.
    pub fn least_squares(&self, key: &Key, starts: &[Start]) -> Option<FittedSet<'a>> {
        let first = |start: &Start| self.from(key, start, LOOK);
        let mut looks: Vec<FittedSet<'a>> = starts.par_iter().filter_map(first).collect();
        looks.sort_by(|a, b| b.least_squares.log_likelihood.total_cmp(&a.least_squares.log_likelihood));
        let mut best = looks.into_iter().next()?;
        if !best.least_squares.converged {
            best.least_squares = best.estimation(&[]).least_squares(best.least_squares.point.clone())?;
        }
        best.least_squares = best.estimation(&[]).with_steps(best.least_squares.clone());
        best.is_settled = best.least_squares.converged;
        Some(best)
    }

    /// Returns a set at a start, without a fit; `None` if it cannot be simulated there.
    pub fn at_start(&self, key: &Key, start: &Start) -> Option<FittedSet<'a>> {
        self.from(key, start, 0)
    }

    fn from(&self, key: &Key, start: &Start, iterations: usize) -> Option<FittedSet<'a>> {
        let added = start.added.clone();
        let (fit, point, variant) = self.problem(start);
        let estimation = super::fitted_set::estimation(self.subject, &fit, &variant, &added, &[], &point);
        let least_squares = estimation.with(&Errors::White, point, iterations)?;
        Some(FittedSet {
            key: key.clone(),
            added,
            fit,
            variant,
            is_settled: least_squares.converged,
            least_squares,
            under: Vec::new(),
            contradicted: OnceLock::new(),
        })
    }

    /// Fits a set roughly under an error model at the outputs whose hyperparameters are given, from the most promising
    /// of the starts; `None` if all fail. Gives up where the log-likelihood cannot become as large as `least`.
    pub fn roughly(&self, starts: &[Start], errors: &Errors, least: f64) -> Option<Rough> {
        let mut left = starts.to_vec();
        let mut iterations = 0;
        while left.len() > FOLLOWED {
            let further = |start: &Start| {
                self.at(start, |estimation, variant, point| {
                    if iterations == 0 {
                        return Some((estimation.log_likelihood(errors, &point)?, start.clone()));
                    }
                    let found = estimation.with(errors, point, iterations)?;
                    Some((found.log_likelihood, start_at(&start.added, estimation.fit, variant, &found.point)))
                })
            };
            let mut looks: Vec<(f64, Start)> = left.par_iter().filter_map(further).collect();
            looks.sort_by(|a, b| b.0.total_cmp(&a.0));
            looks.truncate(left.len().div_ceil(3).max(FOLLOWED));
            left = looks.into_iter().map(|look| look.1).collect();
            iterations = (2 * iterations).max(1);
        }
        let fitted = |start: &Start| {
            self.at(start, |estimation, variant, point| {
                let found = estimation.roughly(errors, point, least)?;
                Some((start_at(&start.added, estimation.fit, variant, &found.point), found))
            })
        };
        let all = left.par_iter().filter_map(fitted).collect::<Vec<(Start, Estimate)>>();
        let best = all.into_iter().max_by(|a, b| evidence(&a.1).total_cmp(&evidence(&b.1)))?;
        Some(Rough { log_likelihood: best.1.log_likelihood, log_evidence: evidence(&best.1), start: best.0 })
    }

    /// Returns a start with other initial states of effects that no derivative has moved from 0, where these describe
    /// the records clearly better; `None` if there are none. An actuator of limited rate that begins at its command
    /// follows at once: started beside it, it catches up in a time in proportion to the distance, so that what it adds
    /// is of second order.
    pub fn with_moved_states(&self, start: &Start) -> Option<Start> {
        let (fit, point, variant) = self.problem(start);
        let declared = self.subject.model.interface().parameters.len();
        let is_silent =
            |piece: usize, k: usize| fit.pieces[piece].locals[k].parameter >= declared && point.locals[piece][k] == 0.0;
        let silent =
            (0..fit.pieces.len()).flat_map(|piece| (0..fit.pieces[piece].locals.len()).map(move |k| (piece, k)));
        let silent: Vec<(usize, usize)> = silent.filter(|&(piece, k)| is_silent(piece, k)).collect();
        let estimation = super::fitted_set::estimation(self.subject, &fit, &variant, &start.added, &[], &point);
        // The other unknowns had made up for a state that begins elsewhere.
        let followed = |point: Point| estimation.with(&Errors::White, point, FOLLOW);
        let mut best = if silent.is_empty() { None } else { followed(point.clone()) }?;
        let mut is_moved = false;
        for (piece, k) in silent {
            let trial = |distance: &f64| {
                let mut point = best.point.clone();
                point.locals[piece][k] = distance * fit.pieces[piece].locals[k].scale;
                followed(point)
            };
            let tried: Vec<Estimate> = DISTANCES.par_iter().filter_map(trial).collect();
            let likeliest = tried.into_iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
            if let Some(moved) = likeliest.filter(|moved| moved.log_likelihood > best.log_likelihood + HOPELESS) {
                (best, is_moved) = (moved, true);
            }
        }
        is_moved.then(|| start_at(&start.added, &fit, &variant, &best.point))
    }

    /// Returns what is computed of the estimation problem of a set at a start.
    fn at<T>(&self, start: &Start, compute: impl Fn(&Estimation<'_>, &Variant, Point) -> Option<T>) -> Option<T> {
        let (fit, point, variant) = self.problem(start);
        let estimation = super::fitted_set::estimation(self.subject, &fit, &variant, &start.added, &[], &point);
        compute(&estimation, &variant, point)
    }

    /// Fits a set under all error models, from its optimum by least squares and from those of the other error models,
    /// and makes sure that it fits no worse than the sets that it contains.
    /// The force error, which costs most, is left out if even with the most that it has gained so far over the others
    /// the evidence would stay below `least`.
    pub fn under_error_models(&self, set: &mut FittedSet<'a>, nested: &[&FittedSet<'a>], least: f64) {
        let estimation = set.estimation(&self.nominal);
        let start = set.least_squares.point.clone();
        let slopes = set.fit.slopes(&start);
        let from = |kind: ErrorModel, start: &Point, before: Option<&Errors>| {
            let known = slopes.clone().filter(|_| *start == set.least_squares.point);
            Some((kind, estimation.under(kind, start.clone(), before, known)?))
        };
        let errors_of = |kind: ErrorModel| {
            let estimates = nested.iter().filter_map(|nested| nested.estimate(kind));
            estimates.max_by(|a, b| evidence(a).total_cmp(&evidence(b))).map(|estimate| &estimate.errors)
        };
        let outputs = [ErrorModel::SmoothOutput, ErrorModel::RoughOutput];
        let mut first: Vec<(ErrorModel, Estimate)> =
            outputs.par_iter().filter_map(|&kind| from(kind, &start, errors_of(kind))).collect();
        // A force costs most: from the optimum under the smooth output error only, which is nearest to its own.
        let smooth = first.iter().find(|(kind, _)| *kind == ErrorModel::SmoothOutput);
        let near = smooth.map_or(&start, |(_, estimate)| &estimate.point).clone();
        let at_output = |estimates: &[(ErrorModel, Estimate)]| {
            let outputs = estimates.iter().filter(|(kind, _)| *kind != ErrorModel::Force);
            outputs.map(|(_, estimate)| evidence(estimate)).fold(f64::NEG_INFINITY, f64::max)
        };
        let advantage =
            |nested: &&FittedSet<'a>| Some(evidence(nested.estimate(ErrorModel::Force)?) - at_output(&nested.under));
        let advantage = nested.iter().filter_map(advantage).fold(0.0, f64::max);
        // A set that fits worse than one it contains has not been fitted yet.
        let is_behind = |(kind, estimate): &(ErrorModel, Estimate)| {
            let smaller = nested.iter().filter_map(|smaller| smaller.estimate(*kind));
            smaller.into_iter().any(|smaller| smaller.log_likelihood - WORSE >= estimate.log_likelihood)
        };
        if at_output(&first) + advantage <= least && !first.iter().any(is_behind) {
            set.under = first;
            return;
        }
        first.extend(from(ErrorModel::Force, &near, errors_of(ErrorModel::Force)));
        let best = |kind: ErrorModel| {
            let own = first.iter().find(|(of, _)| *of == kind).map(|(_, estimate)| estimate);
            let mut found: Vec<(ErrorModel, Estimate)> = Vec::new();
            for (_, other) in first.iter().filter(|(of, _)| *of != kind && kind != ErrorModel::Force) {
                if own.is_none_or(|own| are_apart(&estimation, own, other, APART)) {
                    found.extend(from(kind, &other.point, own.map(|own| &own.errors)));
                }
            }
            let mut best = first
                .iter()
                .filter(|(of, _)| *of == kind)
                .cloned()
                .chain(found)
                .max_by(|a, b| evidence(&a.1).total_cmp(&evidence(&b.1)));
            for smaller in nested {
                let Some(theirs) = smaller.estimate(kind) else { continue };
                if best.as_ref().is_some_and(|best| best.1.log_likelihood > theirs.log_likelihood - WORSE) {
                    continue;
                }
                // A very short lag may be too stiff to be simulated.
                let again = [FAINT, 0.0]
                    .into_iter()
                    .find_map(|share| from(kind, &self.faintly(set, smaller, theirs, share)?, Some(&theirs.errors)));
                if let Some(again) = again {
                    let is_better = |best: &(ErrorModel, Estimate)| again.1.log_likelihood > best.1.log_likelihood;
                    if best.as_ref().is_none_or(is_better) {
                        best = Some(again);
                    }
                }
            }
            best
        };
        let kinds: Vec<ErrorModel> = first.iter().map(|(kind, _)| *kind).collect();
        let mut under: Vec<(ErrorModel, Estimate)> = kinds.par_iter().filter_map(|&kind| best(kind)).collect();
        // Correlated errors are more patient with a poor start than least squares is, which then is a start for them.
        let mut least_squares = set.least_squares.clone();
        let most = under.iter().map(|(_, estimate)| evidence(estimate)).fold(f64::NEG_INFINITY, f64::max);
        for _ in 0..if most > least - HOPELESS { TURNS } else { 0 } {
            let likeliest = under.iter().max_by(|a, b| evidence(&a.1).total_cmp(&evidence(&b.1)));
            let again = likeliest.and_then(|(_, likeliest)| estimation.least_squares(likeliest.point.clone()));
            let Some(again) = again.filter(|again| again.log_likelihood > least_squares.log_likelihood) else { break };
            let gain = again.log_likelihood - least_squares.log_likelihood;
            least_squares = again;
            if gain <= WORSE {
                break;
            }
            let restarted = |own: (ErrorModel, Estimate)| {
                let again = from(own.0, &least_squares.point, None);
                again.filter(|(_, again)| evidence(again) > evidence(&own.1)).unwrap_or(own)
            };
            under = under.into_par_iter().map(restarted).collect();
        }
        set.is_settled = least_squares.converged;
        (set.under, set.least_squares) = (under, least_squares);
    }

    /// Returns a set without the declared terms that its effects make superfluous, and their positions among the
    /// parameters of the study: factors that may be 0, are no larger than their uncertainty, and without which the
    /// evidence is larger.
    pub fn without_terms(&self, set: &FittedSet<'a>) -> (FittedSet<'a>, Vec<usize>) {
        let (mut set, mut fixed) = (set.clone(), Vec::new());
        for k in 0..if set.key.is_empty() { 0 } else { self.subject.globals.len() } {
            let Some((kind, estimate)) = set.likeliest().cloned() else { break };
            let ([low, high], value) = (set.fit.globals[k].bounds, set.least_squares.point.globals[k]);
            let may_be_zero = low <= 0.0 && high >= 0.0 || self.subject.is_log(k) && low > 0.0;
            if !may_be_zero || value > low && value.abs() > UNCERTAIN * estimate.deviations[k] {
                continue;
            }
            let all: Vec<usize> = fixed.iter().copied().chain([k]).collect();
            let mut start = set.start_at(&set.least_squares.point);
            start.tuners[k] = 0.0;
            let pieces = pieces::pieces(self.subject, |role| role == Role::Calibration);
            let Start { tuners, locals, added } = start;
            let (fit, point, variant) = problem(self.subject, &added, pieces, &tuners, locals, &all, self.simulations);
            let estimation = super::fitted_set::estimation(self.subject, &fit, &variant, &added, &self.nominal, &point);
            let Some(least_squares) = estimation.least_squares(point) else { continue };
            let Some(under) = estimation.under(kind, least_squares.point.clone(), Some(&estimate.errors), None) else {
                continue;
            };
            if evidence(&under) > evidence(&estimate) {
                fixed = all;
                let key = set.key.clone();
                let under = vec![(kind, under)];
                let is_settled = least_squares.converged;
                let contradicted = OnceLock::new();
                set = FittedSet { key, added, fit, variant, least_squares, is_settled, under, contradicted };
            }
        }
        (set, fixed)
    }

    /// Returns the optimum of a smaller set with the further effects of a set added at a share of their strength.
    fn faintly(&self, set: &FittedSet<'a>, smaller: &FittedSet<'a>, theirs: &Estimate, share: f64) -> Option<Point> {
        let known = smaller.start_at(&theirs.point);
        let own = set.start_at(&set.least_squares.point);
        let mut start = Start { added: Vec::new(), ..known.clone() };
        for added in own.added {
            let same = known.added.iter().find(|known| known.candidate.index == added.candidate.index);
            let same = same.filter(|same| same_choices(same, &added));
            start.added.push(same.cloned().unwrap_or_else(|| {
                let first = &added.candidate.effect.parameters()[0];
                let mut faint = added.clone();
                match first.null_value {
                    Some(null) if null.is_finite() => faint.strengths[0] = null + share * (faint.strengths[0] - null),
                    Some(_) => faint.strengths[0] /= share,
                    None => {}
                }
                faint.strengths[0] = faint.strengths[0].clamp(first.bounds[0], first.bounds[1]);
                faint
            }));
        }
        Some(self.problem(&start).1)
    }
}

/// Returns true if the parameters that no fit moves have the same values.
fn same_choices(a: &crate::fit::Added, b: &crate::fit::Added) -> bool {
    let parameters = a.candidate.effect.parameters().iter().enumerate();
    parameters.filter(|(_, p)| p.fixed || p.grid.jumps()).all(|(k, _)| a.strengths[k] == b.strengths[k])
}

/// Returns true if a shared parameter of two estimates differs by more than so many standard errors.
pub fn are_apart(estimation: &Estimation<'_>, a: &Estimate, b: &Estimate, errors: f64) -> bool {
    let globals = a.point.globals.iter().zip(&b.point.globals).zip(a.deviations.iter().zip(&b.deviations));
    let apart = |((x, y), (s, t)): ((&f64, &f64), (&f64, &f64))| (x - y).abs() > errors * s.max(*t);
    estimation.fit.globals.len() == a.point.globals.len() && globals.into_iter().any(apart)
}

/// Returns the chance of a count of candidates, in nats for each effect.
pub fn price(candidates: usize) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let count = candidates.max(1) as f64;
    math::ln(count)
}
