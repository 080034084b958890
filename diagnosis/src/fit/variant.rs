//! Variants: the declared model with effects at chosen strengths, as a least-squares problem.

use std::sync::Arc;

use mops_core::{
    Model, Role,
    effect::{DeclaredTerm, Dimension, EffectParameter, InitialGrid, Port, Scope},
};
use mops_models::WithEffects;

use super::meter::Meter;
use super::pieces::globals;
use super::residuals::{Fit, Global, Piece, Point, Sets};
use crate::candidates::{Candidate, Sizes};
use crate::records::{Local, Subject};

/// Steps of a simulation of a candidate for each sample, beyond which it is too stiff. Basis: an assumption.
const STEPS_PER_SAMPLE: f64 = 6.0;

/// Steps of a simulation of a candidate beyond which it is too stiff, relative to those of the declared model. Basis:
/// an assumption.
const TIMES_DECLARED: f64 = 3.0;

/// Steps of a simulation of a candidate beside these. Basis: an assumption.
const FEW_STEPS: f64 = 1000.0;

/// Multiple of all these for records that no parameter is fitted to. Basis: an assumption.
const OTHER_RECORDS: f64 = 5.0;

/// Largest initial state of an effect, typical sizes of its place. Basis: an effect within the machine moves as far as
/// the machine does; a hidden state that starts farther off describes anything that decays.
const FARTHEST_START: f64 = 2.0;

/// A candidate with strengths to start from.
#[derive(Clone)]
pub struct Added {
    /// The candidate.
    pub candidate: Candidate,
    /// Its strengths.
    pub strengths: Vec<f64>,
    /// Strengths that differ from experiment to experiment: experiment, index of the strength, value.
    pub own: Vec<(usize, usize, f64)>,
    /// Start values of its own states in each piece, with the experiment of that, as far as they are known.
    pub starts: Vec<(usize, Vec<f64>)>,
    /// Typical sizes at its place.
    pub sizes: Sizes,
}

impl Added {
    /// Returns the effect with the values of another one where their parameters have the same name and dimension.
    #[must_use]
    pub fn named_like(&self, other: &Self) -> Self {
        let mut named = self.clone();
        let theirs = other.candidate.effect.parameters();
        for (parameter, strength) in self.candidate.effect.parameters().iter().zip(&mut named.strengths) {
            let same = theirs.iter().position(|p| p.name == parameter.name && p.dimension == parameter.dimension);
            if let Some(same) = same {
                *strength = other.strengths[same].clamp(parameter.bounds[0], parameter.bounds[1]);
            }
        }
        named
    }

    /// Takes what a solution says of the effect `index` of a variant: its strengths, and in the experiments of the fit
    /// those of its own there and the start values of its states.
    pub fn take(&mut self, index: usize, variant: &Variant, fit: &Fit<'_>, point: &Point) {
        let count = self.candidate.effect.parameters().len();
        let in_piece = |m: usize| fit.pieces.iter().position(|p| p.measurement == m);
        let piece = self.candidate.only.and_then(in_piece).unwrap_or(0);
        self.strengths = variant.strengths(fit, point, index, count, piece);
        let first = variant.first[index] + count;
        let free = self.candidate.effect.free_starts().len();
        let starts = |piece: usize| fit.parameters(piece, point)[first..][..free].to_vec();
        self.starts.retain(|(measurement, _)| in_piece(*measurement).is_none());
        self.starts.extend(fit.pieces.iter().enumerate().map(|(k, piece)| (piece.measurement, starts(k))));
        for own in &mut self.own {
            if let Some(piece) = in_piece(own.0) {
                own.2 = variant.strengths(fit, point, index, count, piece)[own.1];
            }
        }
    }

    /// Returns the names of the simpler effects that it is: where a parameter beside the first is at an end, and
    /// determined.
    pub fn simpler(&self, is_open: impl Fn(usize) -> bool) -> Vec<&'static str> {
        let parameters = self.candidate.effect.parameters().iter().zip(&self.strengths).enumerate().skip(1);
        let of = |(k, (parameter, value)): (usize, (&EffectParameter, &f64))| {
            let ends = self.sizes.bounds(parameter);
            let simpler = (0..2).filter(|&end| !parameter.fixed && *value == ends[end] && !is_open(k));
            simpler.flat_map(|end| parameter.simpler[end].iter().copied()).collect::<Vec<_>>()
        };
        parameters.flat_map(of).collect()
    }

    /// Whether its first strength stands at a finite bound that is not neutral: more is no effect but a mistake, as the
    /// gain of a sensor is that is off by half. An actuator may well be at such a limit: dead, or acting one way only.
    pub fn is_at_limit(&self) -> bool {
        let (first, value) = (&self.candidate.effect.parameters()[0], self.strengths[0]);
        let is_limit = |end: &f64| end.is_finite() && first.null_value != Some(*end);
        !matches!(self.candidate.port, Port::Actuator { .. })
            && first.bounds.iter().filter(|e| is_limit(e)).any(|&e| e == value)
    }

    /// Returns the effect at every shape that is tried, at the strengths from which a fit is restarted: multiples of
    /// the typical size, and the declared stiffness for an effect that takes the place of a declared spring.
    pub fn restarts(&self) -> Vec<Self> {
        let effect = self.candidate.effect.as_ref();
        let first = &effect.parameters()[0];
        let shapes = self.sizes.combinations(effect);
        let spring = self.sizes.stiffness.filter(|_| effect.modifies() == Some(DeclaredTerm::Spring));
        let multiples = first.restarts.iter().map(|times| times * self.sizes.of(first.dimension));
        let at = |strength: f64| {
            let strength = strength.clamp(first.bounds[0], first.bounds[1]);
            shapes.iter().map(move |shape| Self { strengths: [&[strength], &shape[1..]].concat(), ..self.clone() })
        };
        multiples.chain(spring).flat_map(at).collect()
    }
}

/// Where the strengths of an added effect stand among the parameters of the model.
#[derive(Clone)]
pub struct Variant {
    /// The model.
    pub model: Arc<WithEffects>,
    /// For each effect added the first of its parameters.
    pub first: Vec<usize>,
}

impl Variant {
    /// The declared model with these effects, to be simulated over pieces of experiments.
    ///
    /// # Panics
    /// If an effect does not fit its place: candidates do.
    pub fn new(subject: &Subject, added: &[Added], pieces: &[Piece]) -> Self {
        let placements = added.iter().enumerate().map(|(i, a)| a.candidate.placed(format!("+{}", i + 1)));
        let model = WithEffects::new(Arc::clone(&subject.model), placements.collect()).expect("candidates fit");
        // By the densest record whichever are looked at: what could be simulated among all can be alone.
        #[allow(clippy::cast_precision_loss)]
        let density = |m: &crate::records::Measurement| {
            let samples = m.series.iter().map(|s| s.times.len()).max().unwrap_or(0);
            samples as f64 / m.horizon.max(f64::MIN_POSITIVE)
        };
        let densest = subject.measurements.iter().map(density).fold(0.0, f64::max);
        let horizon = pieces.iter().map(|piece| piece.horizon).fold(0.0, f64::max);
        let pace = subject.pace.get().copied().unwrap_or(0.0);
        let limit = FEW_STEPS + horizon * (STEPS_PER_SAMPLE * densest + TIMES_DECLARED * pace);
        // Other records are simulated for few candidates.
        let is_other = |piece: &Piece| subject.measurements[piece.measurement].role != Role::Calibration;
        let limit = if pieces.iter().any(is_other) { OTHER_RECORDS * limit } else { limit };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let limit = limit as usize;
        let model = model.with_step_limit(limit).with_tolerance(subject.tolerance);
        let mut next = subject.model.interface().parameters.len();
        let mut first = Vec::new();
        for a in added {
            first.push(next);
            let effect = &a.candidate.effect;
            next += effect.parameters().len() + effect.free_starts().len();
        }
        Self { model: Arc::new(model), first }
    }

    /// The `count` strengths of the effect `index` as a piece has them at a point.
    pub fn strengths(&self, fit: &Fit<'_>, point: &Point, index: usize, count: usize, piece: usize) -> Vec<f64> {
        let parameters = fit.parameters(piece, point);
        parameters[self.first[index]..self.first[index] + count].to_vec()
    }
}

/// Whether a strength is looked for in its logarithm: shapes that cannot be 0, and are not tried there.
fn is_log(strength: &EffectParameter, value: f64) -> bool {
    !matches!(strength.grid, InitialGrid::Plain([0.0]))
        && strength.null_value != Some(0.0)
        && strength.bounds[0] >= 0.0
        && value > 0.0
}

/// What is known of the start values of an effect's states in pieces: those of the same pieces, else those of the
/// beginnings of the experiments.
fn known_starts<'a>(added: &'a Added, pieces: &[Piece]) -> Vec<Option<&'a Vec<f64>>> {
    let of = |index: usize| {
        let measurement = pieces[index].measurement;
        if added.starts.len() == pieces.len() && added.starts[index].0 == measurement {
            return Some(&added.starts[index].1);
        }
        let begins = index == 0 || pieces[index - 1].measurement != measurement;
        added.starts.iter().find(|(m, _)| begins && *m == measurement).map(|(_, values)| values)
    };
    (0..pieces.len()).map(of).collect()
}

/// The problem of fitting a variant to pieces of experiments; `tuners` are the globals of the study and `locals` the
/// start values of the pieces to begin with; those in `fixed` stay where they are.
pub fn problem<'a>(
    subject: &'a Subject,
    added: &[Added],
    mut pieces: Vec<Piece>,
    tuners: &[f64],
    mut locals: Vec<Vec<f64>>,
    fixed: &[usize],
    simulations: &'a Meter<'a>,
) -> (Fit<'a>, Point, Variant) {
    let variant = Variant::new(subject, added, &pieces);
    let mut all = globals(subject);
    for &k in fixed {
        all[k].bounds = [tuners[k]; 2];
    }
    let mut values = tuners.to_vec();
    for (a, &first) in added.iter().zip(&variant.first) {
        let effect = a.candidate.effect.as_ref();
        for (k, strength) in effect.parameters().iter().enumerate() {
            let (parameter, value) = (first + k, a.strengths[k]);
            let typical = a.sizes.of(strength.dimension);
            let scale = if value != 0.0 { value.abs() } else { 0.1 * typical };
            if strength.fixed {
                pieces.iter_mut().for_each(|piece| piece.fixed.push((parameter, value)));
            } else if strength.scope == Scope::Experiment {
                for (piece, locals) in pieces.iter_mut().zip(&mut locals) {
                    let own = a.own.iter().find(|(m, s, _)| *m == piece.measurement && *s == k);
                    let value = own.map_or(value, |own| own.2);
                    piece.locals.push(Local { parameter, bounds: strength.bounds, start: value, scale: 1.0 });
                    locals.push(value);
                }
            } else {
                let log = is_log(strength, value);
                let steps = strength.grid.jumps();
                let scale = match strength.grid {
                    // Half way to the next value that was tried.
                    InitialGrid::Steps => 0.5 * a.sizes.gap_to_next_size(value),
                    InitialGrid::ScaledAndGap(_) => 0.1 * scale,
                    InitialGrid::Jumps(values) => 0.5 * values.iter().copied().fold(0.0, f64::max),
                    _ => scale,
                };
                let bounds = a.sizes.bounds(strength);
                all.push(Global { sets: Sets::Parameter(parameter), bounds, log, scale, steps });
                values.push(value.clamp(bounds[0], bounds[1]));
            }
        }
        if let Some(only) = a.candidate.only {
            let neutral = effect.parameters()[0].null_value.unwrap_or(0.0);
            pieces.iter_mut().filter(|p| p.measurement != only).for_each(|p| p.fixed.push((first, neutral)));
        }
        let known = known_starts(a, &pieces);
        for ((piece, locals), known) in pieces.iter_mut().zip(&mut locals).zip(known) {
            for (state, &dimension) in effect.free_starts().iter().enumerate() {
                let parameter = first + effect.parameters().len() + state;
                let scale = a.sizes.of(dimension);
                // What has no unit is a share of its limit.
                let most = if dimension == Dimension::ONE { 1.0 } else { FARTHEST_START * scale };
                let bounds = [-most, most];
                let start = known.map_or(0.0, |known| known[state].clamp(bounds[0], bounds[1]));
                piece.locals.push(Local { parameter, bounds, start, scale: 0.1 * scale });
                locals.push(start);
            }
        }
    }
    let model: Arc<dyn Model> = Arc::clone(&variant.model) as Arc<dyn Model>;
    let fit = Fit { subject, model, globals: all, pieces, simulations };
    (fit, Point { globals: values, locals }, variant)
}
