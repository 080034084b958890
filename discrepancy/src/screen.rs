//! Screening: the trace of every candidate in the residuals, what the unknowns absorb taken out, against the residuals.
//!
//! A score (Lagrange multiplier) test: source: C. R. Rao, Linear Statistical Inference and its Applications, 2nd edition
//! (1973), section 6e.3.

use mops_core::math;
use mops_core::{EffectParameter, InitialGrid, Port, Scope};
use mops_models::WithEffects;
use rayon::prelude::*;

use crate::candidate::{Candidate, Sizes};
use crate::fit::{Fit, Fitted, Piece, Residuals, dot};
use crate::trace_of::{View, relative_sizes, sizes, sizes_by_samples};
use crate::trajectory::Trajectory;
use crate::variant::Added;

/// A fitted model as a screening sees it.
pub struct Scene {
    /// The motion in each piece.
    pub trajectories: Vec<Trajectory>,
    /// Residuals of each piece one after the other.
    pub residuals: Vec<f64>,
    /// Where the residuals of each piece begin.
    pub begins: Vec<usize>,
    /// Orthonormal directions that the unknowns can absorb.
    pub basis: Vec<Direction>,
    /// Residuals and slopes of each piece.
    pub slopes: Vec<Residuals>,
}

/// Other values of shapes that no fit moves, or hardly, are fitted too: so many, of which the gain is at least this share of
/// the best.
const OTHERS: usize = 2;
const NEAR: f64 = 0.3;

/// A screened candidate.
#[derive(Clone)]
pub struct Screened {
    /// The candidate with the best strengths tried.
    pub added: Added,
    /// The same with other values of shapes that no fit moves, where these do not do much worse.
    pub others: Vec<Added>,
    /// By how much the sum of squares falls, to first order.
    pub gain: f64,
    /// Share of its trace that the unknowns absorb.
    pub absorbed: f64,
    /// How the residuals pull at it: the scalar product with its direction, turned round.
    pub pull: f64,
    /// Whether it has one sign only.
    pub one_sided: bool,
    /// The first strength that lowers the sum of squares by one, where what it adds is proportional to it.
    pub unit_gain: Option<f64>,
    /// Its trace with that taken out, of length 1.
    pub direction: Vec<f64>,
    /// Directions that were looked in, as many as independent ones: neighbouring shapes look alike.
    pub directions: f64,
}

impl Scene {
    /// The scene of a fit; `None` where a simulation fails.
    pub fn new(fit: &Fit<'_>, model: &WithEffects, fitted: &Fitted) -> Option<Self> {
        let all = fit.slopes(&fitted.point)?;
        let pieces: Vec<usize> = (0..fit.pieces.len()).collect();
        let trajectories: Option<Vec<Trajectory>> =
            pieces.par_iter().map(|&piece| Trajectory::new(fit, model, piece, &fitted.point).ok()).collect();
        let mut begins = vec![0];
        for piece in &all {
            begins.push(begins[begins.len() - 1] + piece.r.len());
        }
        let residuals = all.iter().flat_map(|piece| piece.r.iter().copied()).collect();
        let basis = basis(&all, &begins, fit.globals.len());
        Some(Self { trajectories: trajectories?, residuals, basis, begins, slopes: all })
    }

    /// A trace without what the unknowns absorb.
    pub fn project(&self, trace: &[f64]) -> Vec<f64> {
        let mut left = trace.to_vec();
        self.basis.iter().for_each(|q| q.take_out_of(&mut left, 0));
        left
    }
}

/// A direction of length 1 in the residuals, 0 outside of a part.
pub struct Direction {
    /// Where the part begins.
    pub begin: usize,
    /// The direction there.
    pub values: Vec<f64>,
}

impl Direction {
    /// Takes the direction out of a vector, whose first element is that at `begin`.
    fn take_out_of(&self, vector: &mut [f64], begin: usize) {
        let part = &mut vector[self.begin - begin..][..self.values.len()];
        let along = dot(&self.values, part);
        part.iter_mut().zip(&self.values).for_each(|(v, q)| *v -= along * q);
    }
}

/// An orthonormal basis of the slopes, by the modified Gram-Schmidt method with a second pass; what is left of a column
/// that depends on others is dropped. Locals, of which each moves its own piece alone, come first: so they stay short.
fn basis(all: &[Residuals], begins: &[usize], globals: usize) -> Vec<Direction> {
    let mut basis: Vec<Direction> = Vec::new();
    for (piece, &begin) in all.iter().zip(begins) {
        let first = basis.len();
        for local in &piece.j[globals..] {
            let rest = rest(&basis[first..], begin, local.clone());
            basis.extend(rest);
        }
    }
    for g in 0..globals {
        let column = all.iter().flat_map(|piece| piece.j[g].iter().copied()).collect();
        let rest = rest(&basis, 0, column);
        basis.extend(rest);
    }
    basis
}

/// What a column adds to a basis.
fn rest(basis: &[Direction], begin: usize, mut column: Vec<f64>) -> Option<Direction> {
    let before = dot(&column, &column).sqrt();
    for _ in 0..2 {
        basis.iter().for_each(|q| q.take_out_of(&mut column, begin));
    }
    let left = dot(&column, &column).sqrt();
    (left > 1e-7 * before).then(|| {
        column.iter_mut().for_each(|c| *c /= left);
        Direction { begin, values: column }
    })
}

/// Candidates as screened, and what chance does.
pub struct Screening {
    /// The best first.
    pub screened: Vec<Screened>,
    /// The best gain in each of the draws of white noise.
    pub by_chance: Vec<f64>,
}

impl Screening {
    /// Independent directions that the draws look like: where nothing is missing, the best gain `g` of `n` directions has the
    /// distribution `(1 - exp(-g/2))^n`, of which this is the likeliest `n`; `None` without draws.
    #[allow(clippy::cast_precision_loss)]
    pub fn independent(&self) -> Option<f64> {
        let logarithms: f64 = self.by_chance.iter().map(|gain| math::ln_1p(-math::exp(-0.5 * gain))).sum();
        // At least one: where all signs are wrong, draws gain nothing.
        (logarithms < 0.0).then(|| (-(self.by_chance.len() as f64) / logarithms).max(1.0))
    }
}

/// Screens candidates, and the same on draws of white noise in place of the residuals, of which the unknowns absorb as much.
pub fn screen(
    candidates: &[Candidate],
    fit: &Fit<'_>,
    model: &WithEffects,
    scene: &Scene,
    draws: &[Vec<f64>],
) -> Screening {
    let draws: Vec<Vec<f64>> = draws.iter().map(|draw| scene.project(draw)).collect();
    let looked: Vec<(Option<Screened>, Vec<f64>)> = candidates
        .par_iter()
        .filter_map(|candidate| {
            let sizes = sizes_for(candidate, model, &fit.pieces, &scene.trajectories)?;
            best_of(candidate, &sizes, fit, model, scene, &draws)
        })
        .collect();
    let mut by_chance = vec![0.0_f64; draws.len()];
    for (_, gains) in &looked {
        by_chance.iter_mut().zip(gains).for_each(|(best, gain)| *best = best.max(*gain));
    }
    let mut screened: Vec<Screened> = looked.into_iter().filter_map(|(screened, _)| screened).collect();
    screened.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Screening { screened, by_chance }
}

/// Typical sizes for a candidate: at its port, between two joints relative to each other; of a joint that is the companion of an
/// actuator or sensor the position and speed.
pub fn sizes_for(
    candidate: &Candidate,
    model: &WithEffects,
    pieces: &[Piece],
    trajectories: &[Trajectory],
) -> Option<Sizes> {
    let own = match &candidate.companion {
        Some(other @ Port::Joint { .. }) if candidate.effect.mutual() => {
            relative_sizes(&candidate.port, other, model, pieces, trajectories)?
        }
        _ => sizes(&candidate.port, model, pieces, trajectories)?,
    };
    let own = sizes_by_samples(own, candidate, model, pieces);
    match (&candidate.port, &candidate.companion) {
        (Port::Actuator { .. } | Port::Sensor { .. }, Some(joint @ Port::Joint { .. })) => {
            let Sizes { position, speed, .. } = sizes(joint, model, pieces, trajectories)?;
            Some(Sizes { position, speed, ..own })
        }
        _ => Some(own),
    }
}

/// Strengths with their trace in a piece.
type Tried<'a> = (&'a Vec<f64>, Vec<f64>);

/// A group of strengths in each piece.
type Traces<'a> = Vec<Vec<Tried<'a>>>;

/// In every piece the trace that is most like what is left there, and its strengths; `None` where there is none.
fn likest<'a, 'b>(traces: &'b Traces<'a>, left: &[f64], begins: &[usize]) -> Option<Vec<&'b Tried<'a>>> {
    let one = |(piece, traces): (usize, &'b Vec<Tried<'a>>)| {
        let r = &left[begins[piece]..begins[piece + 1]];
        let likeness = |t: &[f64]| -dot(t, r) / dot(t, t).sqrt().max(1e-300);
        traces.iter().max_by(|a, b| likeness(&a.1).total_cmp(&likeness(&b.1)))
    };
    traces.iter().enumerate().map(one).collect()
}

/// A trace without what the unknowns absorb.
struct Left {
    trace: Vec<f64>,
    size: f64,
    rest: f64,
}

impl Left {
    fn of(scene: &Scene, chosen: &[&Tried<'_>]) -> Option<Self> {
        let total: Vec<f64> = chosen.iter().flat_map(|(_, trace)| trace.iter().copied()).collect();
        let trace = scene.project(&total);
        let (size, rest) = (dot(&total, &total), dot(&trace, &trace));
        (size.is_finite() && rest > 1e-10 * size && rest > 1e-6).then_some(Self { trace, size, rest })
    }

    /// How the residuals pull, by which factor that wants the strengths, and what the sum of squares falls by.
    fn against(&self, residuals: &[f64], first: &EffectParameter, strength: f64) -> (f64, f64, f64) {
        let along = -dot(&self.trace, residuals);
        let wanted = along / self.rest;
        let factor = if is_linear(first) {
            // As far as physics allows: none of the wrong sign.
            (wanted * strength).clamp(first.bounds[0], first.bounds[1]) / strength
        } else {
            wanted.clamp(0.0, 1.5)
        };
        (along, factor, 2.0 * factor * along - factor * factor * self.rest)
    }
}

fn is_linear(strength: &EffectParameter) -> bool {
    matches!(strength.grid, InitialGrid::Linear)
}

/// The best of the strengths tried of a candidate, and the best gains on the draws.
#[allow(clippy::cast_precision_loss)]
fn best_of(
    candidate: &Candidate,
    sizes: &Sizes,
    fit: &Fit<'_>,
    model: &WithEffects,
    scene: &Scene,
    draws: &[Vec<f64>],
) -> Option<(Option<Screened>, Vec<f64>)> {
    let effect = candidate.effect.as_ref();
    let own: Vec<usize> =
        (0..effect.parameters().len()).filter(|&k| effect.parameters()[k].scope == Scope::Experiment).collect();
    let is_fixed = |&k: &usize| effect.parameters()[k].fixed || effect.parameters()[k].grid.jumps();
    let fixed: Vec<usize> = (0..effect.parameters().len()).filter(is_fixed).collect();
    let mut found: Vec<Screened> = Vec::new();
    let mut by_chance = vec![0.0_f64; draws.len()];
    let combinations = sizes.combinations(effect);
    let resolved = effect.parameters().iter().filter(|s| s.grid == InitialGrid::Frequencies);
    let resolved = resolved.map(|s| sizes.values(s.dimension, s.grid, s.bounds).len()).max().unwrap_or(0);
    let periods = u32::try_from(resolved).unwrap_or(u32::MAX);
    // Combinations that differ in what each experiment has of its own come together.
    let shared = |c: &[f64]| -> Vec<u64> {
        c.iter().enumerate().filter(|(k, _)| !own.contains(k)).map(|(_, v)| v.to_bits()).collect()
    };
    let pieces = fit.pieces.iter().zip(&scene.trajectories);
    let views: Option<Vec<View<'_>>> = pieces.map(|(piece, along)| View::new(candidate, model, piece, along)).collect();
    let views = views?;
    let first = &effect.parameters()[0];
    for group in combinations.chunk_by(|a, b| !own.is_empty() && shared(a) == shared(b)) {
        let traces = views.iter().map(|view| group.iter().filter_map(|s| Some((s, view.trace(s)?))).collect());
        let traces: Traces<'_> = traces.collect();
        let Some(chosen) = likest(&traces, &scene.residuals, &scene.begins) else { continue };
        let Some(left) = Left::of(scene, &chosen) else { continue };
        for (draw, best) in draws.iter().zip(&mut by_chance) {
            let gain = |left: &Left| left.against(draw, first, group[0][0]).2;
            let gain = if group.len() == 1 {
                gain(&left)
            } else {
                likest(&traces, draw, &scene.begins)
                    .and_then(|own| Left::of(scene, &own))
                    .map_or(0.0, |left| gain(&left))
            };
            *best = best.max(gain);
        }
        let (along, factor, gain) = left.against(&scene.residuals, first, group[0][0]);
        // The best of each shape that no fit moves, or hardly.
        let same = |s: &Screened| fixed.iter().all(|&k| s.added.strengths[k] == group[0][k]);
        let before = found.iter().position(same);
        if before.is_some_and(|k| found[k].gain >= gain) {
            continue;
        }
        let mut strengths = group[0].clone();
        let unit_gain = is_linear(first).then(|| strengths[0].abs() / left.rest.sqrt());
        if is_linear(first) && factor != 0.0 {
            strengths[0] *= factor;
        }
        let of_piece = |(piece, (s, _)): (&Piece, &&Tried<'_>)| {
            own.iter().map(|&k| (piece.measurement, k, s[k])).collect::<Vec<_>>()
        };
        let own_strengths = fit.pieces.iter().zip(&chosen).flat_map(of_piece).collect();
        let length = left.rest.sqrt();
        let now = Screened {
            others: Vec::new(),
            added: Added {
                candidate: candidate.clone(),
                strengths,
                own: own_strengths,
                starts: Vec::new(),
                sizes: *sizes,
                expected: None,
            },
            gain,
            absorbed: 1.0 - left.rest / left.size,
            pull: along / length,
            one_sided: !is_linear(first) || first.bounds[0] >= 0.0,
            unit_gain,
            direction: left.trace.iter().map(|l| l / length).collect(),
            directions: (combinations.len() as f64).sqrt().max(f64::from(periods) / 2.0),
        };
        match before {
            Some(k) => found[k] = now,
            None => found.push(now),
        }
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut found = found.into_iter();
    let best = found.next().map(|best| {
        let near = found.filter(|other| other.gain > NEAR * best.gain).take(OTHERS);
        Screened { others: near.map(|other| other.added).collect(), ..best }
    });
    Some((best, by_chance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_directions_are_told_as_the_best_gain_was_drawn_from() {
        for n in [3.0, 200.0] {
            // Quantiles of the best of n gains: (1 - exp(-g/2))^n = u.
            let quantile = |k: usize| -2.0 * math::ln(1.0 - math::powf((k as f64 + 0.5) / 400.0, 1.0 / n));
            let screening = Screening { screened: Vec::new(), by_chance: (0..400).map(quantile).collect() };
            let told = screening.independent().expect("there are draws");
            assert!((told - n).abs() < 0.02 * n, "{told}");
        }
        assert!(Screening { screened: Vec::new(), by_chance: Vec::new() }.independent().is_none());
    }
}
