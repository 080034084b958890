//! The search: which effects, one after the other, bring the residuals down to the noise.

use std::sync::{Arc, Mutex};

use mops_core::{Effect, EffectParameter, Role, Scope, math, stream};

use crate::base;
use crate::candidate::Candidate;
use crate::diagnose::UNEXPLAINED;
use crate::fit::{Fit, Fitted, Piece, dot};
use crate::meter::Meter;
use crate::repaired::Calibrated;
use crate::round::Round;
use crate::subject::{Local, Subject};
use crate::variant::{Added, Variant, problem};
use crate::weigh::{Dispersion, criterion};
use crate::windows::cut;

/// Residuals, in units of the noise, up to which a linear view of them is trusted.
pub(crate) const NEARLY_LINEAR: f64 = 6.0;

/// Residuals, in units of the noise, up to which a linear view still ranks effects better than none would.
const FAIRLY_LINEAR: f64 = 20.0;

/// Windows of a record that are tried however short they are.
const FEW_WINDOWS: usize = 8;

/// Samples per start value of the model in each of more windows.
const SAMPLES_PER_START: usize = 4;

/// Residuals of windows, in units of the noise, up to which a model is brought to whole records by windows that grow.
const WORTH_STRETCHING: f64 = 1.5;

/// Share by which the sums of squares of fits that are taken for the same may differ.
pub(crate) const SAME: f64 = 1e-5;

/// How many times larger than expected the residuals of an experiment are where its fit went astray.
pub(crate) const ASTRAY: f64 = 2.0;

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
    /// Those of them that are fitted nearly to the end.
    pub finalists: usize,
    /// Probability of adding an effect where nothing is missing.
    pub level: f64,
}

impl Limits {
    /// The usual ones.
    pub fn at(level: f64) -> Self {
        Self { refits: 10, finalists: 5, level }
    }
}

/// The search in a subject.
pub struct Search<'a> {
    /// The subject.
    pub subject: &'a Subject,
    /// The catalogue.
    pub effects: &'a [Arc<dyn Effect>],
    /// Limits.
    pub limits: Limits,
    /// Counts simulations, and ends them.
    pub simulations: &'a Meter<'a>,
    /// Rounds that were looked at.
    pub(crate) looked: Mutex<Vec<Arc<Round<'a>>>>,
}

impl<'a> Search<'a> {
    /// A search that begins.
    pub fn new(
        subject: &'a Subject,
        effects: &'a [Arc<dyn Effect>],
        limits: Limits,
        simulations: &'a Meter<'a>,
    ) -> Self {
        Self { subject, effects, limits, simulations, looked: Mutex::default() }
    }

    /// Pieces that choose between models: calibration and selection data, each record in so many windows.
    pub(crate) fn pieces(&self, windows: usize) -> Vec<Piece> {
        let whole = base::pieces(self.subject, |role| role != Role::Validation);
        if windows == 1 {
            return whole;
        }
        let cut = |p: &Piece| {
            cut(p.measurement, &self.subject.measurements[p.measurement], self.subject.model.as_ref(), windows)
        };
        whole.iter().flat_map(cut).collect()
    }

    /// The trial in windows: the fewest in which its residuals are small enough for a linear view of them. Where start values of
    /// the windows would make up for all that the declared model lacks, it stays in fewer, whose larger residuals tell of it.
    pub fn in_windows(&self, trial: Trial<'a>) -> Trial<'a> {
        self.cut_into(&[2, 4, 8], trial)
    }

    /// The same in windows so short that a contact begins or ends in each, as long as samples suffice: what acts over longer
    /// times is made up for by their start values.
    pub fn in_short_windows(&self, trial: Trial<'a>) -> Trial<'a> {
        self.cut_into(&[16, 32], trial)
    }

    fn cut_into(&self, counts: &[usize], trial: Trial<'a>) -> Trial<'a> {
        let mut best = trial;
        for &windows in counts {
            if best.fitted.normalised() < NEARLY_LINEAR {
                break;
            }
            let pieces = self.pieces(windows);
            let samples = |piece: &Piece| piece.series.iter().map(|s| s.times.len()).sum::<usize>();
            let is_short = |piece: &Piece| samples(piece) < SAMPLES_PER_START * piece.locals.len();
            if windows > FEW_WINDOWS && pieces.iter().any(is_short) {
                break;
            }
            let tuners = best.fitted.point.globals[..self.subject.globals.len()].to_vec();
            let locals = base::first_locals(&pieces);
            if let Some(next) = self.trial(&best.added, &tuners, locals, windows, 40) {
                let hides_all = next.fitted.normalised() <= UNEXPLAINED && best.added.is_empty();
                if hides_all && best.fitted.normalised() <= FAIRLY_LINEAR {
                    break;
                }
                best = next;
            }
        }
        best
    }

    /// The trial over whole records; `None` where that cannot be simulated.
    pub fn over_whole(&self, trial: &Trial<'a>) -> Option<Trial<'a>> {
        let enough = ASTRAY * trial.fitted.normalised();
        let mut best = self.stretched(trial, 1);
        if trial.fitted.normalised() > WORTH_STRETCHING {
            return best;
        }
        let mut part = Some(trial.clone());
        while best.as_ref().is_none_or(|best| best.fitted.normalised() >= enough) {
            // What fits windows may lie too far from what fits whole records for one step.
            part = part.filter(|part| part.windows > 2).and_then(|part| self.stretched(&part, part.windows / 2));
            let Some(part) = &part else { return best.map(|best| self.begun_anew(best, enough)) };
            best = closer(best, self.stretched(part, 1));
        }
        best
    }

    /// The trial over whole records with other start values in the experiments that it leaves more than `enough` of.
    #[allow(clippy::cast_precision_loss)]
    fn begun_anew(&self, whole: Trial<'a>, enough: f64) -> Trial<'a> {
        let tuners = &whole.fitted.point.globals[..self.subject.globals.len()];
        let mut locals = self.own_locals(&whole);
        for ((piece, residuals), locals) in self.pieces(1).iter().zip(&whole.fitted.residuals).zip(&mut locals) {
            if dot(residuals, residuals) > enough * enough * residuals.len() as f64
                && let Some((_, found)) = self.begun(&whole.added, tuners, piece, vec![locals.clone()], enough)
            {
                *locals = found.point.locals[0][..piece.locals.len()].to_vec();
            }
        }
        let anew = self.trial(&whole.added, tuners, locals, 1, 40);
        anew.filter(|anew| anew.fitted.chi2 < whole.fitted.chi2).unwrap_or(whole)
    }

    /// Start values of an experiment, everything else held, from several beginnings; where all of these leave more than
    /// `enough`, from others around the first guess, as where a sensor that saturates says nothing of the first moments.
    pub fn begun(
        &self,
        added: &[Added],
        tuners: &[f64],
        piece: &Piece,
        beginnings: Vec<Vec<f64>>,
        enough: f64,
    ) -> Option<(Fit<'a>, Fitted)> {
        const DRAWN: usize = 12;
        /// Standard deviation of those, in scales of the start values.
        const SPREAD: f64 = 3.0;
        let mut random = stream(0, "beginnings");
        let mut draw = |local: &Local| {
            let z = math::normal(&mut random);
            (local.start + SPREAD * local.scale * z).clamp(local.bounds[0], local.bounds[1])
        };
        let given = beginnings.len();
        let drawn = (0..DRAWN).map(|_| piece.locals.iter().map(&mut draw).collect());
        let mut best: Option<(Fit<'a>, Fitted)> = None;
        for (tried, start) in beginnings.into_iter().chain(drawn).enumerate() {
            if tried >= given && best.as_ref().is_some_and(|(_, best)| best.normalised() <= enough) {
                break;
            }
            let Some(found) = self.starts(added, tuners, vec![piece.clone()], vec![start], 60) else { continue };
            if best.as_ref().is_none_or(|(_, best)| found.1.chi2 < best.chi2) {
                best = Some(found);
            }
        }
        best
    }

    /// The trial with fewer windows, each begun where one of those that it holds began.
    fn stretched(&self, trial: &Trial<'a>, windows: usize) -> Option<Trial<'a>> {
        let pieces = self.pieces(windows);
        let mut locals = base::first_locals(&pieces);
        for (piece, locals) in pieces.iter().zip(&mut locals) {
            let begins_with = |p: &Piece| {
                p.measurement == piece.measurement && (p.case.begins - piece.case.begins).abs() < 1e-6 * p.horizon
            };
            let Some(first) = trial.fit.pieces.iter().position(begins_with) else { continue };
            for (local, value) in piece.locals.iter().zip(locals) {
                let window = &trial.fit.pieces[first];
                if let Some(k) = window.locals.iter().position(|l| l.parameter == local.parameter) {
                    *value = trial.fitted.point.locals[first][k].clamp(local.bounds[0], local.bounds[1]);
                }
            }
        }
        let tuners = &trial.fitted.point.globals[..self.subject.globals.len()];
        self.trial(&trial.added, tuners, locals, windows, 40)
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
        let whole = self.trial(&[], tuners, locals, 1, 40);
        let enough = ASTRAY * calibrated.normalised();
        if whole.as_ref().is_some_and(|whole| whole.fitted.normalised() <= enough) {
            return whole;
        }
        // What fits the calibration data may be out of step in other records.
        closer(whole, self.through_windows(&[], tuners))
    }

    /// A variant fitted to all data that may choose, in windows that grow to whole records.
    fn through_windows(&self, added: &[Added], tuners: &[f64]) -> Option<Trial<'a>> {
        let windows = self.trial(added, tuners, base::first_locals(&self.pieces(8)), 8, 40)?;
        [4, 2, 1].into_iter().try_fold(windows, |part, windows| self.stretched(&part, windows))
    }

    /// A model fitted to all data that may choose, from where its fit to calibration data alone ended.
    pub fn led_by(&self, calibrated: &Calibrated<'a>) -> Option<Trial<'a>> {
        let starts = calibrated.experiments.iter().zip(&self.subject.measurements);
        let own = starts.filter(|(_, m)| m.role != Role::Validation);
        let own = own.map(|(said, m)| said.starts[..m.locals.len()].iter().map(|(_, value)| *value).collect());
        self.trial(&calibrated.added, &calibrated.tuners, own.collect(), 1, 40)
    }

    /// A trial over whole records that leaves something, where that is less after a fit in windows, or to calibration data
    /// alone.
    pub fn unstuck(&self, trial: Trial<'a>) -> Trial<'a> {
        let is_stuck = |trial: &Trial<'a>| trial.windows == 1 && trial.fitted.normalised() > UNEXPLAINED;
        if !is_stuck(&trial) {
            return trial;
        }
        let tuners = &trial.fitted.point.globals[..self.subject.globals.len()];
        let through = self.through_windows(&trial.added, tuners);
        let best = through.filter(|through| through.fitted.chi2 < trial.fitted.chi2).unwrap_or(trial);
        if !is_stuck(&best) {
            return best;
        }
        let led = self.calibrate(&best, &[]).and_then(|calibrated| self.led_by(&calibrated));
        led.filter(|led| led.fitted.chi2 < best.fitted.chi2).unwrap_or(best)
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

    /// Start values of the pieces of a trial, those of effects left out.
    pub(crate) fn own_locals(&self, trial: &Trial<'a>) -> Vec<Vec<f64>> {
        let own = self.pieces(trial.windows);
        let locals = own.iter().zip(&trial.fitted.point.locals);
        locals.map(|(piece, values)| values[..piece.locals.len()].to_vec()).collect()
    }

    /// Fits a variant from where another ended.
    pub fn from(&self, from: &Trial<'a>, added: &[Added], iterations: usize) -> Option<Trial<'a>> {
        let tuners = &from.fitted.point.globals[..self.subject.globals.len()];
        self.trial(added, tuners, self.own_locals(from), from.windows, iterations)
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

    /// Candidates beside effects that are in.
    pub fn candidates(&self, added: &[Added]) -> Vec<Candidate> {
        let taken = |c: &Candidate| {
            added.iter().any(|a| {
                a.candidate.is(c)
                    || (a.candidate.port == c.port && a.candidate.is_dry_friction() && c.is_dry_friction())
            })
        };
        self.subject.candidates(self.effects).into_iter().filter(|c| !taken(c)).collect()
    }
}

/// That of two fits to the same data which leaves less.
fn closer<'a>(a: Option<Trial<'a>>, b: Option<Trial<'a>>) -> Option<Trial<'a>> {
    a.into_iter().chain(b).min_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2))
}

impl<'a> Trial<'a> {
    /// Takes the strengths from the solution.
    pub(crate) fn read(mut self) -> Self {
        for (index, added) in self.added.iter_mut().enumerate() {
            added.take(index, &self.variant, &self.fit, &self.fitted.point);
        }
        self
    }

    /// Fitted further.
    pub(crate) fn continued(self, iterations: usize) -> Option<Self> {
        let fitted = self.fit.resume(&self.fitted, iterations)?;
        Some(Self { fitted, ..self }.read())
    }

    /// Whether it is the same model of the same pieces, and leaves as much but for a small share.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.windows == other.windows
            && self.has_effects_of(other)
            && (self.fitted.chi2 - other.fitted.chi2).abs() <= SAME * self.fitted.chi2
    }

    /// Whether it has the same effects in the same order.
    pub(crate) fn has_effects_of(&self, other: &Self) -> bool {
        let mut pairs = self.added.iter().zip(&other.added);
        self.added.len() == other.added.len() && pairs.all(|(a, b)| a.candidate.is(&b.candidate))
    }

    /// Whether it has the same effects, in any order.
    pub(crate) fn has_same_set(&self, other: &Self) -> bool {
        let has = |b: &Added| self.added.iter().any(|a| a.candidate.is(&b.candidate));
        self.added.len() == other.added.len() && other.added.iter().all(has)
    }

    /// The effect that was added last; `None` in the declared model.
    pub fn newest(&self) -> Option<&Candidate> {
        self.added.last().map(|added| &added.candidate)
    }

    /// Whether its newest effect is simpler than that of another.
    pub(crate) fn is_simpler_than(&self, than: &Self) -> bool {
        self.newest().zip(than.newest()).is_some_and(|(own, other)| own.is_simpler_than(other))
    }

    /// Whether none of its effects is at its limit: where the data want more than physics allows, it is not what they lack.
    pub fn is_physical(&self) -> bool {
        !self.added.iter().any(Added::is_at_limit)
    }

    /// Number of unknowns that its effects bring in for each experiment anew: phases, say, and where their states begin.
    pub fn own_unknowns(&self) -> usize {
        let free = |s: &&EffectParameter| s.scope == Scope::Experiment && !s.fixed;
        let of = |effect: &dyn Effect| effect.parameters().iter().filter(free).count() + effect.free_starts().len();
        self.added.iter().map(|a| of(a.candidate.effect.as_ref())).sum()
    }

    /// Number of unknowns that its effects bring in for all experiments together.
    pub fn unknowns(&self) -> usize {
        self.fitted.point.globals.len() - self.fit.subject.globals.len()
    }

    /// Its [`criterion`] for white residuals of the size of the noise.
    pub fn score(&self) -> f64 {
        criterion(self, &Dispersion::WHITE)
    }
}
