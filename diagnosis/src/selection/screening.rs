//! Screening: to first order, how much each candidate and each pair of candidates would explain.

use mops_core::effect::{InitialGrid, Scope};
use rayon::prelude::*;

use super::fitted_set::FittedSet;
use crate::candidates::Candidate;
use crate::estimation::{Channels, Errors};
use crate::fit::{Added, Piece, Point, dot};

use crate::motion::{Trajectory, View, sizes_for};

/// Guesses of a candidate that are kept beside the best one. Basis: an assumption.
const OTHER_GUESSES: usize = 2;

/// Share of the best guess's gain that another guess must have to be kept. Basis: an assumption.
const NEAR_GUESS: f64 = 0.3;

/// Screened candidate.
#[derive(Clone)]
pub struct Screened {
    /// Index of the candidate.
    pub index: usize,
    /// The candidate with the likeliest of the initial guesses, then with other values of the parameters that no fit
    /// moves.
    pub guesses: Vec<Added>,
    /// Gain in log-likelihood under each error model, nats.
    pub gains: Vec<f64>,
    /// Share of the squared response in white noise that the unknowns absorb.
    pub absorbed: f64,
    /// First parameter for which the gain under the likelier correlated error model is half a nat, if the response is
    /// in proportion to it.
    pub detectable: Option<f64>,
    /// For each error model the direction of the response.
    directions: Vec<Direction>,
    /// True if the product must be negative: strengths have one sign.
    is_one_sided: bool,
}

impl Screened {
    /// Returns the cosine of the responses of two candidates in white noise, without what the unknowns take up.
    pub fn cosine(&self, other: &Self) -> f64 {
        dot(&self.directions[0].values, &other.directions[0].values).abs()
    }

    /// Joins what was screened of the same candidate at another point: the likelier of both leads.
    fn join(&mut self, mut other: Self) {
        if other.correlated() > self.correlated() {
            std::mem::swap(self, &mut other);
        }
        self.gains[0] = self.gains[0].max(other.gains[0]);
        self.guesses.truncate(OTHER_GUESSES);
        self.guesses.push(other.guesses.swap_remove(0));
    }

    /// Returns the largest gain under the correlated error models.
    pub fn correlated(&self) -> f64 {
        correlated(&self.gains).1
    }
}

/// Returns the position and the value of the largest gain under the correlated error models, which follow the white
/// one; alone that counts.
fn correlated(gains: &[f64]) -> (usize, f64) {
    let counted = gains.iter().copied().enumerate().skip(usize::from(gains.len() > 1));
    counted.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// Response of a candidate under an error model, of length 1, without what the unknowns take up.
#[derive(Clone)]
struct Direction {
    values: Vec<f64>,
    /// Scalar product with the residuals.
    along: f64,
}

/// Residuals whitened by an error model, and the directions that the unknowns take up.
struct Projection<'e> {
    errors: &'e Errors,
    residuals: Vec<f64>,
    basis: Vec<Vec<f64>>,
}

/// View of a fitted set for a screening.
pub struct Screening<'s> {
    set: &'s FittedSet<'s>,
    channels: Channels,
    trajectories: Vec<Trajectory>,
    projections: Vec<Projection<'s>>,
    begins: Vec<usize>,
}

/// Share of a column beyond which it is new.
const NEW: f64 = 1e-7;

/// Share of the squared length of a response that the unknowns must leave.
const LEFT: f64 = 1e-9;

impl<'s> Screening<'s> {
    /// Looks at a set at its optimum by least squares, under error models at the outputs; `None` if a simulation fails.
    pub fn new(set: &'s FittedSet<'s>, errors: &'s [Errors]) -> Option<Self> {
        Self::at(set, &set.least_squares.point, errors)
    }

    /// Looks at a set at a point.
    pub fn at(set: &'s FittedSet<'s>, point: &Point, errors: &'s [Errors]) -> Option<Self> {
        let fit = &set.fit;
        let slopes = fit.slopes(point)?;
        let trajectories = set.trajectories(point)?;
        let mut begins = vec![0];
        for piece in &slopes {
            begins.push(begins[begins.len() - 1] + piece.r.len());
        }
        let channels = Channels::new(&fit.pieces);
        let estimation = set.estimation(&[]);
        let free = estimation.free();
        let at_bounds = estimation.at_bounds(point);
        let projection = |errors: &'s Errors| {
            // In white noise, what stands at a bound takes up nothing: it cannot move. A correlated error takes up most
            // itself: without the unknowns at bounds, all candidates would look alike.
            let takes_up = |at: usize| !(matches!(errors, Errors::White) && at_bounds[at]);
            let total = begins[begins.len() - 1];
            let mut columns = vec![vec![0.0; total]; free.len() + 1];
            for (index, piece) in slopes.iter().enumerate() {
                let range = begins[index]..begins[index + 1];
                let (at, mut parts): (Vec<usize>, Vec<Vec<f64>>) =
                    estimation.moving(&free, index, piece).chain([(free.len(), piece.r.clone())]).unzip();
                errors.whiten(&fit.pieces[index], &channels, index, &mut parts);
                for (at, part) in at.into_iter().zip(parts) {
                    columns[at][range.clone()].copy_from_slice(&part);
                }
            }
            let mut residuals = columns.pop().expect("the residuals are last");
            let mut basis: Vec<Vec<f64>> = Vec::new();
            for (_, mut column) in columns.into_iter().enumerate().filter(|(at, _)| takes_up(*at)) {
                let before = dot(&column, &column).sqrt();
                for _ in 0..2 {
                    basis.iter().for_each(|q| take_out(q, &mut column));
                }
                let left = dot(&column, &column).sqrt();
                if left > NEW * before {
                    column.iter_mut().for_each(|c| *c /= left);
                    basis.push(column);
                }
            }
            basis.iter().for_each(|q| take_out(q, &mut residuals));
            Projection { errors, residuals, basis }
        };
        let projections = errors.iter().map(projection).collect();
        Some(Self { set, channels, trajectories, projections, begins })
    }

    /// Returns for each error model the log-likelihood of what the unknowns leave of the residuals, up to a constant.
    fn bases(&self) -> Vec<f64> {
        self.projections.iter().map(|p| -0.5 * dot(&p.residuals, &p.residuals)).collect()
    }

    /// Screens candidates by index, the best first, at this point and at another one of the same set: each where it
    /// explains more.
    pub fn screen_with(&self, other: &Self, candidates: &[Candidate], wanted: &[usize]) -> Vec<Screened> {
        let bases = [self, other].map(Self::bases);
        let of = |screening: &Self, own: &[f64], theirs: &[f64]| {
            let mut screened = screening.screen(candidates, wanted);
            for (k, (own, theirs)) in own.iter().zip(theirs).enumerate() {
                let behind = (theirs - own).max(0.0);
                screened.iter_mut().for_each(|s| s.gains[k] = (s.gains[k] - behind).max(0.0));
            }
            screened
        };
        let mut all = of(self, &bases[0], &bases[1]);
        for there in of(other, &bases[1], &bases[0]) {
            match all.iter_mut().find(|here| here.index == there.index) {
                Some(here) => here.join(there),
                None => all.push(there),
            }
        }
        all.sort_by(|a, b| b.correlated().total_cmp(&a.correlated()));
        all
    }

    /// Screens candidates by index, the best first.
    pub fn screen(&self, candidates: &[Candidate], wanted: &[usize]) -> Vec<Screened> {
        let of = |&index: &usize| self.screened(index, &candidates[index]);
        let mut all: Vec<Screened> = wanted.par_iter().filter_map(of).collect();
        all.sort_by(|a, b| b.correlated().total_cmp(&a.correlated()));
        all
    }

    /// Screens one candidate; `None` if the unknowns take up all that it does.
    fn screened(&self, index: usize, candidate: &Candidate) -> Option<Screened> {
        let (fit, model) = (&self.set.fit, &self.set.variant.model);
        let effect = candidate.effect.as_ref();
        let sizes = sizes_for(candidate, model, &fit.pieces, &self.trajectories, fit.subject.settings.coverage)?;
        let parameters = effect.parameters();
        let own: Vec<usize> = (0..parameters.len()).filter(|&k| parameters[k].scope == Scope::Experiment).collect();
        let fixed: Vec<usize> =
            (0..parameters.len()).filter(|&k| parameters[k].fixed || parameters[k].grid.jumps()).collect();
        let shared = |c: &[f64]| -> Vec<u64> {
            c.iter().enumerate().filter(|(k, _)| !own.contains(k)).map(|(_, v)| v.to_bits()).collect()
        };
        let views = fit.pieces.iter().zip(&self.trajectories);
        let views: Vec<View<'_>> =
            views.map(|(piece, along)| View::new(candidate, model, piece, along)).collect::<Option<_>>()?;
        let first = &parameters[0];
        let is_linear = matches!(first.grid, InitialGrid::Linear);
        let combinations = sizes.combinations(effect);
        // Guesses, each the best of its fixed parameters: gains, score, strengths, those of each piece, directions.
        let mut found: Vec<Screened> = Vec::new();
        for group in combinations.chunk_by(|a, b| !own.is_empty() && shared(a) == shared(b)) {
            let traces: Vec<Vec<(&Vec<f64>, Vec<f64>)>> =
                views.iter().map(|view| group.iter().filter_map(|s| Some((s, view.trace(s)?))).collect()).collect();
            let mut gains = Vec::new();
            let mut directions = Vec::new();
            let mut factors = Vec::new();
            let mut lengths = Vec::new();
            let mut absorbed = 0.0;
            let mut chosen: Vec<&Vec<f64>> = Vec::new();
            for projection in &self.projections {
                let Some((strengths, total)) = self.likeliest(projection, &traces) else { break };
                let size = dot(&total, &total);
                let Some((length, direction)) = projection.left(total) else { break };
                if gains.is_empty() {
                    absorbed = 1.0 - length * length / size;
                }
                lengths.push(length);
                let along = dot(&direction, &projection.residuals);
                let wanted = -along / length;
                let factor = if is_linear {
                    let strength = group[0][0];
                    (wanted * strength).clamp(first.bounds[0], first.bounds[1]) / strength
                } else {
                    wanted.clamp(0.0, 1.5)
                };
                // `-2 f l along - f^2 l^2`, halved.
                gains.push((-factor * length * along - 0.5 * factor * factor * length * length).max(0.0));
                factors.push(factor);
                directions.push(Direction { values: direction, along });
                chosen = strengths;
            }
            if gains.len() < self.projections.len() {
                continue;
            }
            let mut strengths = group[0].clone();
            let (k, gain) = correlated(&gains);
            if is_linear && factors[k] != 0.0 {
                strengths[0] *= factors[k];
            }
            let same = |s: &Screened| fixed.iter().all(|&k| s.guesses[0].strengths[k] == strengths[k]);
            let before = found.iter().position(same);
            if before.is_some_and(|k| found[k].correlated() >= gain) {
                continue;
            }
            let of_piece = |(piece, s): (&Piece, &&Vec<f64>)| {
                own.iter().map(|&k| (piece.measurement, k, s[k])).collect::<Vec<_>>()
            };
            let guess = Added {
                candidate: candidate.clone(),
                strengths,
                own: fit.pieces.iter().zip(&chosen).flat_map(of_piece).collect(),
                starts: Vec::new(),
                sizes,
            };
            let is_one_sided = !is_linear || first.bounds[0] >= 0.0;
            let detectable = is_linear.then(|| group[0][0].abs() / lengths[k]);
            let now = Screened { index, guesses: vec![guess], gains, absorbed, detectable, directions, is_one_sided };
            match before {
                Some(k) => found[k] = now,
                None => found.push(now),
            }
        }
        found.sort_by(|a, b| b.correlated().total_cmp(&a.correlated()));
        let mut found = found.into_iter();
        let mut best = found.next()?;
        let near = NEAR_GUESS * best.correlated();
        best.guesses.extend(found.filter(|o| o.correlated() > near).take(OTHER_GUESSES).map(|o| o.guesses[0].clone()));
        Some(best)
    }

    /// Returns in every record the response that is likest to the residuals, whitened, and its parameters.
    fn likeliest<'t>(
        &self,
        projection: &Projection<'_>,
        traces: &[Vec<(&'t Vec<f64>, Vec<f64>)>],
    ) -> Option<(Vec<&'t Vec<f64>>, Vec<f64>)> {
        let mut total = Vec::with_capacity(projection.residuals.len());
        let mut strengths = Vec::with_capacity(traces.len());
        for (index, traces) in traces.iter().enumerate() {
            let mut white: Vec<Vec<f64>> = traces.iter().map(|(_, trace)| trace.clone()).collect();
            projection.errors.whiten(&self.set.fit.pieces[index], &self.channels, index, &mut white);
            let r = &projection.residuals[self.begins[index]..self.begins[index + 1]];
            let similarity = |t: &[f64]| -dot(t, r) / dot(t, t).sqrt().max(f64::MIN_POSITIVE);
            let best = (0..white.len()).max_by(|&a, &b| similarity(&white[a]).total_cmp(&similarity(&white[b])))?;
            strengths.push(traces[best].0);
            total.extend_from_slice(&white[best]);
        }
        Some((strengths, total))
    }
}

impl Projection<'_> {
    /// Returns the length of what the unknowns leave of a whitened response, and its direction; `None` if next to
    /// nothing is left.
    fn left(&self, mut response: Vec<f64>) -> Option<(f64, Vec<f64>)> {
        let size = dot(&response, &response);
        for _ in 0..2 {
            self.basis.iter().for_each(|q| take_out(q, &mut response));
        }
        let rest = dot(&response, &response);
        if !(size.is_finite() && rest > LEFT * size && rest > 1e-6) {
            return None;
        }
        let length = rest.sqrt();
        response.iter_mut().for_each(|r| *r /= length);
        Some((length, response))
    }
}

/// Takes a direction of length 1 out of a vector.
fn take_out(direction: &[f64], vector: &mut [f64]) {
    let along = dot(direction, vector);
    if along != 0.0 {
        vector.iter_mut().zip(direction).for_each(|(v, q)| *v -= along * q);
    }
}

/// Returns the gain of a pair in log-likelihood, by its normal equations: the larger one of the correlated error
/// models. A strength of one sign whose sign would be wrong stays out.
pub fn pair_gain(a: &Screened, b: &Screened) -> f64 {
    let of = |(a_direction, b_direction): (&Direction, &Direction)| {
        let (cosine, pa, pb) = (dot(&a_direction.values, &b_direction.values), a_direction.along, b_direction.along);
        let rest = 1.0 - cosine * cosine;
        if rest < 1e-6 {
            return 0.0;
        }
        // Factors of the directions that minimise the sum of squares.
        let (fa, fb) = (-(pa - cosine * pb) / rest, -(pb - cosine * pa) / rest);
        if a.is_one_sided && fa < 0.0 || b.is_one_sided && fb < 0.0 {
            return 0.0;
        }
        0.5 * (pa * pa + pb * pb - 2.0 * cosine * pa * pb) / rest
    };
    a.directions.iter().zip(&b.directions).skip(1).map(of).fold(0.0, f64::max)
}
