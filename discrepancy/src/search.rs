//! The search: which effects, one after the other, bring the residuals down to the noise.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use mops_core::{Effect, Role, Trials, stream};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::base;
use crate::candidate::{Candidate, candidates};
use crate::fit::{Fit, Fitted, Known, Piece, dot};
use crate::screen::{Scene, Screened, screen};
use crate::subject::Subject;
use crate::variant::{Added, Variant, problem};
use crate::weigh::{Dispersion, by_chance, criterion};
use crate::windows::cut;

/// Residuals, in units of the noise, up to which a linear view of them is trusted.
const NEARLY_LINEAR: f64 = 6.0;

/// A model that was fitted to calibration and selection data together.
#[derive(Clone)]
pub struct Trial<'a> {
    /// Effects, with the strengths fitted.
    pub added: Vec<Added>,
    /// Windows that each record is cut into; 1: none.
    pub windows: usize,
    /// The problem.
    pub fit: Fit<'a>,
    /// Its model.
    pub variant: Variant,
    /// The solution.
    pub fitted: Fitted,
}

/// What the search is asked.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Candidates that are fitted in each round.
    pub refits: usize,
    /// Those of them that are fitted to the end.
    pub finalists: usize,
}

/// The search in a subject.
pub struct Search<'a> {
    /// The subject.
    pub subject: &'a Subject,
    /// The catalogue.
    pub effects: &'a [Arc<dyn Effect>],
    /// Limits.
    pub limits: Limits,
    /// Counts simulations.
    pub simulations: &'a AtomicUsize,
}

/// Candidates of one round: as screened, and the best of them as fitted.
pub struct Round<'a> {
    /// As screened, best first.
    pub screened: Vec<Screened>,
    /// As fitted, best first.
    pub trials: Vec<Trial<'a>>,
    /// Directions that were looked in, as many as independent ones.
    pub directions: f64,
    /// The same as white noise in place of the residuals shows it, where that was tried.
    pub independent: f64,
    /// The criterion of what the round began with.
    pub before: f64,
    /// Residuals and slopes of what the round began with.
    known: Known,
}

/// Draws of white noise in place of residuals.
const DRAWS: usize = 40;

fn white(count: usize) -> Vec<Vec<f64>> {
    let mut random = stream(0, "white");
    (0..DRAWS).map(|_| (0..count).map(|_| StandardNormal.sample(&mut random)).collect()).collect()
}

impl<'a> Search<'a> {
    /// Pieces that choose between models: calibration and selection data, each record in so many windows.
    fn pieces(&self, windows: usize) -> Vec<Piece> {
        let whole = base::pieces(self.subject, |role| role != Role::Validation);
        if windows == 1 {
            return whole;
        }
        let cut = |p: &Piece| {
            cut(p.measurement, &self.subject.measurements[p.measurement], self.subject.model.as_ref(), windows)
        };
        whole.iter().flat_map(cut).collect()
    }

    /// The trial in windows: the fewest in which its residuals are small enough for a linear view of them.
    pub fn in_windows(&self, trial: Trial<'a>) -> Trial<'a> {
        let mut best = trial;
        for windows in [2, 4, 8] {
            if best.fitted.normalised() < NEARLY_LINEAR {
                break;
            }
            let pieces = self.pieces(windows);
            let tuners = best.fitted.point.globals[..self.subject.globals.len()].to_vec();
            let locals = base::first_locals(&pieces);
            if let Some(next) = self.trial(&best.added, &tuners, locals, windows, 40) {
                best = next;
            }
        }
        best
    }

    /// The trial over whole records; `None` where that cannot be simulated.
    pub fn over_whole(&self, trial: &Trial<'a>) -> Option<Trial<'a>> {
        let pieces = self.pieces(1);
        let mut locals = base::first_locals(&pieces);
        for (piece, locals) in pieces.iter().zip(&mut locals) {
            let first = trial.fit.pieces.iter().position(|p| p.measurement == piece.measurement)?;
            for (local, value) in piece.locals.iter().zip(locals) {
                let window = &trial.fit.pieces[first];
                if let Some(k) = window.locals.iter().position(|l| l.parameter == local.parameter) {
                    *value = trial.fitted.point.locals[first][k].clamp(local.bounds[0], local.bounds[1]);
                }
            }
        }
        let tuners = &trial.fitted.point.globals[..self.subject.globals.len()];
        self.trial(&trial.added, tuners, locals, 1, 40)
    }

    /// The same where the trial is over whole records already.
    pub fn whole(&self, trial: &Trial<'a>) -> Option<Trial<'a>> {
        if trial.windows == 1 { Some(trial.clone()) } else { self.over_whole(trial) }
    }

    /// Fits start values alone, from `locals` and with the globals held: the experiments that parameters do not come from.
    pub fn starts(
        &self,
        added: &[Added],
        tuners: &[f64],
        pieces: Vec<Piece>,
        locals: Vec<Vec<f64>>,
        iterations: usize,
    ) -> Option<(Fit<'a>, Fitted)> {
        let (mut fit, point, _) = problem(self.subject, added, pieces, tuners, locals, &[], self.simulations);
        for (global, &value) in fit.globals.iter_mut().zip(&point.globals) {
            global.bounds = [value; 2];
        }
        let fitted = fit.solve(point, iterations)?;
        Some((fit, fitted))
    }

    /// The declared model, fitted to all data that may choose; `tuners` come from calibration data, with the `locals` of
    /// these experiments.
    pub fn declared(&self, calibrated: &Fitted) -> Option<Trial<'a>> {
        let pieces = self.pieces(1);
        let mut locals = base::first_locals(&pieces);
        let mut calibration = calibrated.point.locals.iter();
        let tuners = &calibrated.point.globals;
        for (piece, locals) in pieces.iter().zip(&mut locals) {
            if self.subject.measurements[piece.measurement].role == Role::Calibration {
                locals.clone_from(calibration.next().expect("one for every calibration experiment"));
            } else if let Some((_, fitted)) = self.starts(&[], tuners, vec![piece.clone()], vec![locals.clone()], 40) {
                locals.clone_from(&fitted.point.locals[0]);
            }
        }
        self.trial(&[], tuners, locals, 1, 40)
    }

    /// Fits a variant to all data that may choose.
    pub fn trial(
        &self,
        added: &[Added],
        tuners: &[f64],
        locals: Vec<Vec<f64>>,
        windows: usize,
        iterations: usize,
    ) -> Option<Trial<'a>> {
        let pieces = self.pieces(windows);
        let (fit, point, variant) = problem(self.subject, added, pieces, tuners, locals, &[], self.simulations);
        let fitted = fit.solve(point, iterations)?;
        Some(Trial { added: added.to_vec(), windows, fit, variant, fitted }.read())
    }

    /// Screens the whole catalogue against what a trial leaves, and fits the best.
    pub fn round(&self, from: &Trial<'a>) -> Option<Round<'a>> {
        let scene = Scene::new(&from.fit, &from.variant.model, &from.fitted)?;
        // What chance does is asked of the declared model alone.
        let draws = if from.added.is_empty() { white(scene.residuals.len()) } else { Vec::new() };
        let screening = screen(&self.candidates(&from.added), &from.fit, &from.variant.model, &scene, &draws);
        let (independent, screened) = (screening.independent(), screening.screened);
        let gaining = screened.iter().take_while(|s| s.gain > 0.0).count();
        let mut chosen: Vec<usize> = (0..gaining.min(self.limits.refits)).collect();
        // Of every place the best, so that no place is lost for a bad linearisation.
        for (i, s) in screened.iter().enumerate().take(gaining) {
            let same = |k: &usize| screened[*k].added.candidate.port == s.added.candidate.port;
            if chosen.len() < 2 * self.limits.refits
                && chosen.iter().filter(|k| same(k)).count() < 2
                && !chosen.contains(&i)
            {
                chosen.push(i);
            }
        }
        // And what is simpler of the same kind at the same place, as a shape may do no more than take up noise.
        for (i, s) in screened.iter().enumerate().take(gaining) {
            let simpler = |k: &usize| s.added.candidate.is_simpler_than(&screened[*k].added.candidate);
            if !chosen.contains(&i) && chosen.iter().any(simpler) {
                chosen.push(i);
            }
        }
        let known = Known { point: from.fitted.point.clone(), all: scene.slopes };
        let started: Vec<Trial<'a>> = chosen
            .into_par_iter()
            .filter_map(|i| self.beside(from, &known, &[self.neutral_start(&screened[i].added)], 5))
            .collect();
        let mut trials = self.race(started);
        if from.windows > 1 {
            // Windows forgive what whole records do not: these decide, where they can be fitted.
            let wholes: Vec<Trial<'a>> = trials[..trials.len().min(self.limits.finalists)]
                .par_iter()
                .filter_map(|t| self.over_whole(t))
                .collect();
            if wholes.iter().any(|t| t.fitted.normalised() < NEARLY_LINEAR) {
                trials = wholes;
                trials.sort_by(|a, b| a.score().total_cmp(&b.score()));
            }
        }
        let directions = screened.iter().map(|s| s.directions).sum();
        let independent = independent.unwrap_or(directions);
        Some(Round { screened, trials, directions, independent, before: from.score(), known })
    }

    /// The best candidates of a round, fitted from where the study begins: the fit of the model without them may have ended
    /// where no effect can help it.
    pub fn afresh(&self, from: &Trial<'a>, round: &Round<'a>) -> Vec<Trial<'a>> {
        const MOST: usize = 24;
        let tuners = self.subject.start();
        let locals = base::first_locals(&self.pieces(from.windows));
        let chosen = &round.screened[..round.screened.len().min(MOST)];
        let fit = |s: &Screened| self.trial(std::slice::from_ref(&s.added), &tuners, locals.clone(), from.windows, 8);
        self.race(chosen.par_iter().filter_map(fit).collect())
    }

    /// Pairs of candidates that do well together, whatever they do alone: a friction may only show, with the right sign, when
    /// another effect is in. Chosen by the normal equations of two traces, then fitted.
    pub fn pairs(&self, from: &Trial<'a>, round: &Round<'a>) -> Vec<Trial<'a>> {
        const FEW: usize = 60;
        let few = &round.screened[..round.screened.len().min(FEW)];
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for i in 0..few.len() {
            for j in i + 1..few.len() {
                let (a, b) = (&few[i], &few[j]);
                let dry = dry(&a.added.candidate) && dry(&b.added.candidate);
                if a.added.candidate.port == b.added.candidate.port && dry {
                    continue;
                }
                let likeness = dot(&a.direction, &b.direction);
                let rest = 1.0 - likeness * likeness;
                if rest < 1e-3 {
                    continue;
                }
                let (p, q) = (a.pull, b.pull);
                let (x, y) = ((p - likeness * q) / rest, (q - likeness * p) / rest);
                if (a.one_sided && x <= 0.0) || (b.one_sided && y <= 0.0) {
                    continue;
                }
                pairs.push((x * p + y * q, i, j));
            }
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<(usize, usize)> = pairs.iter().take(self.limits.refits).map(|&(_, i, j)| (i, j)).collect();
        // One and the same effect in two places: joints of a kind have bearings of a kind.
        let twins = pairs.iter().filter(|&&(_, i, j)| {
            let (a, b) = (&few[i].added.candidate, &few[j].added.candidate);
            a.effect.name() == b.effect.name() && a.effect.rarity() == 0
        });
        for &(_, i, j) in twins.take(4) {
            if !chosen.contains(&(i, j)) {
                chosen.push((i, j));
            }
        }
        let started: Vec<Trial<'a>> = chosen
            .into_par_iter()
            .filter_map(|(i, j)| {
                self.beside(from, &round.known, &[&few[i], &few[j]].map(|s| self.neutral_start(&s.added)), 6)
            })
            .collect();
        self.race(started)
    }

    /// Those that lead after a few steps go on, and the best of them to the end; best first.
    fn race(&self, mut trials: Vec<Trial<'a>>) -> Vec<Trial<'a>> {
        for (count, iterations) in [(self.limits.finalists, 8), (3, 40)] {
            trials.sort_by(|a, b| a.score().total_cmp(&b.score()));
            let rest = trials.split_off(trials.len().min(count));
            trials = trials.into_par_iter().filter_map(|trial| trial.continued(iterations)).collect();
            trials.extend(rest);
        }
        trials.sort_by(|a, b| a.score().total_cmp(&b.score()));
        trials
    }

    /// An effect as a fit begins with it: from where nothing has changed every step leads downwards.
    fn neutral_start(&self, added: &Added) -> Added {
        let mut added = added.clone();
        let first = &added.candidate.effect.strengths()[0];
        if let (Trials::Linear, Some(neutral)) = (first.trials, first.neutral) {
            added.strengths[0] = neutral;
        }
        added
    }

    /// The trial without one of its effects, fitted again.
    pub fn without(&self, trial: &Trial<'a>, index: usize) -> Option<Trial<'a>> {
        let mut added = trial.added.clone();
        added.remove(index);
        self.from(trial, &added, 40)
    }

    /// Start values of the pieces of a trial, those of effects left out.
    fn own_locals(&self, trial: &Trial<'a>) -> Vec<Vec<f64>> {
        let own = self.pieces(trial.windows);
        let locals = own.iter().zip(&trial.fitted.point.locals);
        locals.map(|(piece, values)| values[..piece.locals.len()].to_vec()).collect()
    }

    /// Fits a variant from where another ended.
    pub fn from(&self, from: &Trial<'a>, added: &[Added], iterations: usize) -> Option<Trial<'a>> {
        let tuners = &from.fitted.point.globals[..self.subject.globals.len()];
        self.trial(added, tuners, self.own_locals(from), from.windows, iterations)
    }

    /// The trial with effects that are at first neutral, where that is so: nothing is simulated twice.
    fn beside(&self, from: &Trial<'a>, known: &Known, more: &[Added], iterations: usize) -> Option<Trial<'a>> {
        let tuners = &from.fitted.point.globals[..self.subject.globals.len()];
        let added = [from.added.as_slice(), more].concat();
        let (pieces, locals) = (self.pieces(from.windows), self.own_locals(from));
        let (fit, point, variant) = problem(self.subject, &added, pieces, tuners, locals, &[], self.simulations);
        let neutral = |a: &Added| a.candidate.effect.strengths()[0].neutral == Some(a.strengths[0]);
        let fitted = if more.iter().all(neutral) {
            fit.solve_beside(point, known, iterations)?
        } else {
            fit.solve(point, iterations)?
        };
        Some(Trial { added, windows: from.windows, fit, variant, fitted }.read())
    }

    /// The trial in the form in which the search goes on: over whole records where their residuals are small enough for a
    /// linear view, else in windows.
    pub fn over_or_in_windows(&self, trial: &Trial<'a>) -> Trial<'a> {
        match self.whole(trial) {
            Some(whole) if whole.fitted.normalised() < NEARLY_LINEAR => whole,
            Some(whole) => {
                let windows = self.in_windows(whole);
                // A trial that was in windows stays there: a fit of whole records that failed has nothing to tell.
                if trial.windows > 1 && trial.fitted.normalised() <= windows.fitted.normalised() {
                    return trial.clone();
                }
                windows
            }
            None => trial.clone(),
        }
    }

    /// The trial without effects that the others make superfluous.
    pub fn pruned(&self, mut trial: Trial<'a>, level: f64) -> Trial<'a> {
        let mut index = 0;
        while trial.added.len() > 1 && index < trial.added.len() {
            let Some(without) = self.without(&trial, index) else {
                index += 1;
                continue;
            };
            let dispersion = Dispersion::of(&trial);
            let loss = (without.fitted.chi2 - trial.fitted.chi2) / dispersion.weight();
            if by_chance(loss, 30.0) > level {
                trial = without;
                index = 0;
            } else {
                index += 1;
            }
        }
        trial
    }

    /// The trial with declared terms at zero that the effects make superfluous, and which tuners those are: factors that
    /// may be zero, and are no larger than their uncertainty.
    #[allow(clippy::cast_precision_loss)]
    pub fn without_declared(&self, trial: Trial<'a>) -> (Trial<'a>, Vec<usize>) {
        let mut held = Vec::new();
        let mut trial = trial;
        if trial.added.is_empty() {
            return (trial, held);
        }
        let mut covariance = trial.fit.covariance(&trial.fitted);
        for k in 0..self.subject.globals.len() {
            let global = &trial.fit.globals[k];
            let value = trial.fitted.point.globals[k];
            let error = covariance[(k, k)].max(0.0).sqrt();
            let at_least = value <= global.bounds[0] * (1.0 + 1e-9);
            let zero = global.bounds[0] <= 0.0 || (global.log && global.bounds[0] > 0.0);
            if !(zero && (at_least || value.abs() < 2.0 * error)) {
                continue;
            }
            let mut tuners = trial.fitted.point.globals[..self.subject.globals.len()].to_vec();
            tuners[k] = global.bounds[0].max(0.0);
            let (own, locals) = (self.pieces(trial.windows), self.own_locals(&trial));
            let all: Vec<usize> = held.iter().copied().chain([k]).collect();
            let made = problem(self.subject, &trial.added, own, &tuners, locals, &all, self.simulations);
            let Some(fitted) = made.0.solve(made.1, 40) else { continue };
            let weight = Dispersion::of(&trial).weight();
            if (fitted.chi2 - trial.fitted.chi2) / weight < (fitted.count as f64).ln() {
                held = all;
                let (added, windows) = (trial.added.clone(), trial.windows);
                trial = Trial { added, windows, fit: made.0, variant: made.2, fitted }.read();
                covariance = trial.fit.covariance(&trial.fitted);
            }
        }
        (trial, held)
    }

    pub fn candidates(&self, added: &[Added]) -> Vec<Candidate> {
        let interface = self.subject.model.interface();
        let of = &self.subject.measurements;
        let mut measured: Vec<String> = of.iter().flat_map(|m| m.series.iter().map(|s| s.name.clone())).collect();
        measured.sort();
        measured.dedup();
        let calibration: Vec<usize> = (0..of.len()).filter(|&i| of[i].role == Role::Calibration).collect();
        let taken = |c: &Candidate| {
            added.iter().any(|a| a.candidate.is(c) || (a.candidate.port == c.port && dry(&a.candidate) && dry(c)))
        };
        let all = candidates(self.effects, interface, &measured, &calibration);
        all.into_iter().filter(|c| !taken(c)).collect()
    }
}

/// Whether an effect is dry friction: a joint has one at most.
fn dry(c: &Candidate) -> bool {
    c.effect.act(&first_values(c)).friction(&still(), &vec![0.0; c.effect.states()]).is_some()
}

/// Any strengths: to ask an effect what it is.
fn first_values(c: &Candidate) -> Vec<f64> {
    c.effect.strengths().iter().map(|s| 1.0_f64.clamp(s.bounds[0], s.bounds[1])).collect()
}

fn still() -> mops_core::At<'static, f64> {
    mops_core::At { t: 0.0, value: 0.0, q: 0.0, v: 1.0, a: 0.0, mobility: 1.0, other: 0.0, other_speed: 0.0, u: &[] }
}

impl<'a> Trial<'a> {
    /// Takes the strengths from the solution.
    fn read(mut self) -> Self {
        for (index, a) in self.added.iter_mut().enumerate() {
            let count = a.candidate.effect.strengths().len();
            let in_piece = |m: usize| self.fit.pieces.iter().position(|p| p.measurement == m);
            let (variant, fit, point) = (&self.variant, &self.fit, &self.fitted.point);
            let piece = a.candidate.only.and_then(in_piece).unwrap_or(0);
            a.strengths = variant.strengths(fit, point, index, count, piece);
            for own in &mut a.own {
                if let Some(piece) = in_piece(own.0) {
                    own.2 = variant.strengths(fit, point, index, count, piece)[own.1];
                }
            }
        }
        self
    }

    /// Fitted further.
    fn continued(self, iterations: usize) -> Option<Self> {
        let fitted = self.fit.resume(&self.fitted, iterations)?;
        Some(Self { fitted, ..self }.read())
    }

    /// Number of unknowns that its effects bring in.
    pub fn unknowns(&self) -> usize {
        self.fitted.point.globals.len() - self.fit.subject.globals.len()
    }

    /// Its [`criterion`] for white residuals of the size of the noise.
    pub fn score(&self) -> f64 {
        criterion(self, &Dispersion::WHITE)
    }
}
