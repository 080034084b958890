//! A round of the search: the whole catalogue screened against what a model leaves, and the best of it fitted.

use std::sync::Arc;

use mops_core::{InitialGrid, Port, math, stream};
use rayon::prelude::*;

use crate::base;
use crate::candidate::Candidate;
use crate::diagnose::UNEXPLAINED;
use crate::fit::{Known, dot};
use crate::screen::{Scene, Screened, screen};
use crate::search::{NEARLY_LINEAR, SAME, Search, Trial};
use crate::variant::{Added, problem};
use crate::weigh::{CLEARLY, Dispersion, by_chance};

/// Candidates of one round: as screened, and the best of them as fitted.
#[derive(Clone)]
pub struct Round<'a> {
    /// As screened, best first.
    pub screened: Arc<Vec<Screened>>,
    /// As fitted, best first.
    pub trials: Vec<Trial<'a>>,
    /// Directions that were looked in, as many as independent ones.
    pub directions: f64,
    /// The same as white noise in place of the residuals shows it, where that was tried.
    pub independent: f64,
    /// What the round began with.
    pub from: Trial<'a>,
    /// Residuals and slopes of what it began with.
    known: Arc<Known>,
    /// The sum of squares that its models were to reach; infinite where all of them matter.
    goal: f64,
}

/// Draws of white noise in place of residuals.
const DRAWS: usize = 40;

/// Iterations with which every candidate begins: the first needs no slopes but its own.
const LOOK: usize = 2;

/// How many times more than its screening says, to first order, a candidate may gain.
const AMPLE: f64 = 2.0;

/// How many times more than its screening says a candidate may gain that is to reach what another model leaves; among those
/// that were first in some 30 experiments of the test bed 1 to 3.6 times, and 8 once.
const FARTHEST: f64 = 10.0;

/// How much more than that, in units of the noise as it repeats, it may leave: what weighing may take away in the end
/// ([`crate::weigh::weighed`]), and what unknowns are worth.
const ALLOWANCE: f64 = 80.0;

/// How many times more than a model that explains the data one may leave that still goes on beside it.
const FAR: f64 = 3.0;

/// Sorts by [`Trial::score`].
pub(crate) fn best_first(trials: &mut [Trial<'_>]) {
    trials.sort_by(|a, b| a.score().total_cmp(&b.score()));
}

/// Which models may still rival the best one: where that explains the data, those that do not leave much more.
fn nearness(best: Option<&Trial<'_>>) -> impl Fn(&Trial<'_>) -> bool + use<> {
    let least = best.map_or(f64::INFINITY, |best| best.fitted.normalised());
    move |trial| least > UNEXPLAINED || trial.fitted.normalised() <= FAR * least
}

impl<'a> Round<'a> {
    /// The round with a better fit of one of its models; as it is where it has none with these effects.
    pub fn with(self: Arc<Self>, better: &Trial<'a>) -> Arc<Self> {
        let is_worse = |t: &Trial<'a>| t.has_effects_of(better) && t.fitted.chi2 > better.fitted.chi2;
        let Some(index) = self.trials.iter().position(is_worse) else { return self };
        let mut round = Self::clone(&self);
        round.trials[index] = better.clone();
        best_first(&mut round.trials);
        Arc::new(round)
    }
}

/// The index of the round in which such an effect did best.
pub(crate) fn best_in(rounds: &[Arc<Round<'_>>], is: impl Fn(&Candidate) -> bool) -> Option<usize> {
    rounds.iter().position(|round| round.trials.first().and_then(Trial::newest).is_some_and(&is))
}

fn white(count: usize) -> Vec<Vec<f64>> {
    let mut random = stream(0, "white");
    (0..DRAWS).map(|_| (0..count).map(|_| math::normal(&mut random)).collect()).collect()
}

impl<'a> Search<'a> {
    /// The round that begins with a trial; what was found in it once is not looked for again.
    pub fn round(&self, from: &Trial<'a>) -> Option<Arc<Round<'a>>> {
        self.round_towards(from, f64::INFINITY)
    }

    /// The same where models matter that leave little more than another, which may be in fewer windows: of every place the
    /// best, and those others that screening does not show to be far from that.
    pub fn round_against(&self, from: &Trial<'a>, rival: &Trial<'a>) -> Option<Arc<Round<'a>>> {
        let goal = rival.fitted.chi2 + ALLOWANCE * Dispersion::of(rival).weight();
        self.round_towards(from, if from.windows < rival.windows { f64::INFINITY } else { goal })
    }

    fn round_towards(&self, from: &Trial<'a>, goal: f64) -> Option<Arc<Round<'a>>> {
        let looked = || self.looked.lock().expect("no thread panics with it");
        let serves = |round: &&Arc<Round<'a>>| round.goal * (1.0 + SAME) >= goal && round.from.is_like(from);
        if let Some(round) = looked().iter().find(serves) {
            return Some(Arc::clone(round));
        }
        let round = Arc::new(self.look(from, goal)?);
        looked().push(Arc::clone(&round));
        Some(round)
    }

    /// Screens the whole catalogue against what a trial leaves, and fits the best.
    fn look(&self, from: &Trial<'a>, goal: f64) -> Option<Round<'a>> {
        let scene = Scene::new(&from.fit, &from.variant.model, &from.fitted)?;
        // What chance does is asked of the declared model alone.
        let draws = if from.added.is_empty() { white(scene.residuals.len()) } else { Vec::new() };
        let screening = screen(&self.candidates(&from.added), &from.fit, &from.variant.model, &scene, &draws);
        let (independent, screened) = (screening.independent(), screening.screened);
        let gaining = screened.iter().take_while(|s| s.gain > 0.0).count();
        let mut chosen: Vec<usize> = (0..gaining.min(self.limits.refits)).collect();
        // Of every place the best, as long as they are few, so that no place is lost for a bad linearisation.
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
        let directions = screened.iter().map(|s| s.directions).sum();
        if !from.added.is_empty() && from.fitted.normalised() <= UNEXPLAINED {
            // Beside others that explain the data an effect matters only where it may be added.
            let weight = Dispersion::of(from).weight();
            chosen.retain(|&i| by_chance(AMPLE * screened[i].gain / weight, directions) <= self.limits.level);
        }
        let mut places: Vec<&Port> = Vec::new();
        chosen.retain(|&i| {
            let Screened { added, gain, .. } = &screened[i];
            let is_best = !places.contains(&&added.candidate.port);
            places.push(&added.candidate.port);
            // Of what is not proportional to its strength, the screening knows less.
            let is_linear = added.candidate.effect.parameters()[0].grid == InitialGrid::Linear;
            is_best || !is_linear || from.fitted.chi2 - FARTHEST * gain <= goal
        });
        let shapes = chosen.iter().flat_map(|&i| std::iter::once(&screened[i].added).chain(&screened[i].others));
        let shapes: Vec<&Added> = shapes.collect();
        let look = |added: &&Added| self.beside(from, &known, &[self.neutral_start(added)], LOOK);
        let mut looked: Vec<Trial<'a>> = shapes.par_iter().filter_map(look).collect();
        best_first(&mut looked);
        let mut trials: Vec<Trial<'a>> = Vec::new();
        for trial in looked {
            // Of every candidate the best shape.
            if !trials.iter().any(|t| trial.newest().is_some_and(|own| t.newest().is_some_and(|n| n.is(own)))) {
                trials.push(trial);
            }
        }
        let mut trials = self.finals(from, self.race(trials));
        trials.retain(Trial::is_physical);
        self.simplify(&mut trials, &screened);
        let independent = independent.unwrap_or(directions);
        let (screened, known) = (Arc::new(screened), Arc::new(known));
        Some(Round { screened, trials, directions, independent, from: from.clone(), known, goal })
    }

    /// Those that may rival the best, begun again where they have stuck; over whole records where they are in windows, which
    /// forgive what those do not. One with restarts counts as stuck where it leaves clearly more than the best, too.
    fn finals(&self, from: &Trial<'a>, trials: Vec<Trial<'a>>) -> Vec<Trial<'a>> {
        let finalists = &trials[..trials.len().min(self.limits.finalists)];
        let is_simpler = |t: &Trial<'a>| finalists.iter().any(|than| t.is_simpler_than(than));
        let near = nearness(trials.first());
        let is_worth = |(rank, t): (usize, &Trial<'a>)| if rank < finalists.len() { near(t) } else { is_simpler(t) };
        let worth: Vec<bool> = trials.iter().enumerate().map(is_worth).collect();
        let clearly = |best: &Trial<'a>| best.fitted.chi2 + CLEARLY * Dispersion::of(best).weight();
        let most = trials.first().map_or(f64::INFINITY, clearly);
        let (chosen, rest): (Vec<_>, Vec<_>) = trials.into_iter().zip(worth).partition(|(_, worth)| *worth);
        let restarts = |trial: &Trial<'a>| trial.newest().is_some_and(Candidate::has_restarts);
        let is_behind = |trial: &Trial<'a>| trial.fitted.normalised() > UNEXPLAINED || trial.fitted.chi2 > most;
        // All that are restarted are so beside the same.
        let short =
            chosen.iter().any(|(t, _)| restarts(t) && is_behind(t)).then(|| self.in_short_windows(from.clone()));
        let again = |(trial, _): (Trial<'a>, bool)| match &short {
            Some(short) if restarts(&trial) && is_behind(&trial) => self.restarted(short, trial),
            _ if from.windows > 1 && !restarts(&trial) => self.begun_again(from, trial),
            _ => trial,
        };
        let chosen: Vec<Trial<'a>> = chosen.into_par_iter().map(again).collect();
        let wholes: Vec<Trial<'a>> = match from.windows {
            1 => Vec::new(),
            _ => chosen.par_iter().filter_map(|t| self.over_whole(t)).collect(),
        };
        let mut trials = if wholes.iter().any(|t| t.fitted.normalised() < NEARLY_LINEAR) {
            wholes
        } else {
            chosen.into_iter().chain(rest.into_iter().map(|(trial, _)| trial)).collect()
        };
        best_first(&mut trials);
        trials
    }

    /// The trial; or, where it leaves something and that leaves less, its newest effect begun anew beside what the round began
    /// with, as strong as it was found and twice as strong: where a step changes much, a fit from nothing may have stuck.
    fn begun_again(&self, from: &Trial<'a>, trial: Trial<'a>) -> Trial<'a> {
        const ITERATIONS: usize = 40;
        let Some(stuck) = trial.added.last().cloned() else { return trial };
        let mut best = trial;
        for newest in stuck.as_strong_and_twice() {
            if best.fitted.normalised() <= UNEXPLAINED {
                break;
            }
            let again = self.from(from, &[from.added.as_slice(), &[newest]].concat(), ITERATIONS);
            best = again.filter(|again| again.fitted.chi2 < best.fitted.chi2).unwrap_or(best);
        }
        best
    }

    /// The trial; or, where that leaves less over whole records, its newest effect restarted at every shape beside what the round
    /// began with, `short`: in short windows where longer ones leave too much.
    fn restarted(&self, short: &Trial<'a>, trial: Trial<'a>) -> Trial<'a> {
        let Some(stuck) = trial.added.last() else { return trial };
        let begun = |newest| self.from(short, &[short.added.as_slice(), &[newest]].concat(), LOOK);
        let again = self.race(stuck.restarts().into_par_iter().filter_map(begun).collect()).into_iter().next();
        if short.windows == 1 {
            return again.filter(|again| again.fitted.chi2 < trial.fitted.chi2).unwrap_or(trial);
        }
        let whole = again.and_then(|again| self.over_whole(&again));
        let Some(whole) = whole.filter(|whole| whole.fitted.normalised() < NEARLY_LINEAR) else { return trial };
        match self.over_whole(&trial) {
            Some(before) if before.fitted.chi2 <= whole.fitted.chi2 => trial,
            _ => whole,
        }
    }

    /// Where the best explains the data, fits what is simpler once more, from where that ended: records with stops have minima
    /// at which the simpler one of two effects may have stayed.
    fn simplify(&self, trials: &mut Vec<Trial<'a>>, screened: &[Screened]) {
        let Some(best) = trials.first().filter(|best| best.fitted.normalised() <= UNEXPLAINED) else { return };
        let Some((own, others)) = best.added.split_last() else { return };
        let near = nearness(Some(best));
        let is_simpler = |s: &&Screened| s.added.candidate.is_simpler_than(&own.candidate);
        let simpler: Vec<&Screened> = screened.iter().filter(is_simpler).collect();
        let fit = |s: &&Screened| {
            let begun = self.from(best, &[others, &[s.added.begun_like(own)]].concat(), LOOK)?;
            if near(&begun) { begun.continued(40).filter(Trial::is_physical) } else { None }
        };
        for one in simpler.par_iter().filter_map(fit).collect::<Vec<_>>() {
            let same = |t: &Trial<'a>| t.newest().zip(one.newest()).is_some_and(|(a, b)| a.is(b));
            match trials.iter_mut().find(|t| same(t)) {
                Some(before) if one.windows == before.windows && one.fitted.chi2 < before.fitted.chi2 => *before = one,
                Some(_) => {}
                None => trials.push(one),
            }
        }
        best_first(trials);
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
                let dry = a.added.candidate.is_dry_friction() && b.added.candidate.is_dry_friction();
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
                self.beside(from, &round.known, &[&few[i], &few[j]].map(|s| self.neutral_start(&s.added)), LOOK + 1)
            })
            .collect();
        self.race(started)
    }

    /// Those that lead after a few steps go on, and the best of them to the end; best first, without those that end at a limit.
    ///
    /// Source: K. Jamieson, A. Talwalkar, Non-stochastic best arm identification and hyperparameter optimization, AISTATS
    /// (2016), for halving; here of every place one stays for the first heat, and what is simpler than one that goes on.
    fn race(&self, mut trials: Vec<Trial<'a>>) -> Vec<Trial<'a>> {
        let few = self.limits.finalists;
        for (heat, (count, iterations)) in [(2 * few, 3), (few, 8), (3, 40)].into_iter().enumerate() {
            let (is_first, is_last) = (heat == 0, heat == 2);
            best_first(&mut trials);
            if is_last {
                // A step may have gone too far; by now it is what the data want.
                trials.retain(Trial::is_physical);
            }
            let mut places: Vec<String> = Vec::new();
            let near = nearness(trials.first());
            let (mut on, mut rest) = (Vec::new(), Vec::new());
            for trial in trials {
                let place = trial.newest().map_or_else(String::new, Candidate::place);
                let leads = on.len() < count
                    || (is_first && !places.contains(&place))
                    || on.iter().any(|than| trial.is_simpler_than(than));
                places.push(place);
                if leads && (!is_last || near(&trial)) { on.push(trial) } else { rest.push(trial) }
            }
            trials = on.into_par_iter().filter_map(|trial| trial.continued(iterations)).collect();
            trials.extend(rest);
        }
        trials.retain(Trial::is_physical);
        best_first(&mut trials);
        trials
    }

    /// An effect as a fit begins with it: from where nothing has changed every step leads downwards.
    pub(crate) fn neutral_start(&self, added: &Added) -> Added {
        let mut added = added.clone();
        let first = &added.candidate.effect.parameters()[0];
        if let (InitialGrid::Linear, Some(neutral)) = (first.grid, first.null_value) {
            added.strengths[0] = neutral;
        }
        added
    }

    /// The trial with effects that are at first neutral, where that is so: nothing is simulated twice.
    fn beside(&self, from: &Trial<'a>, known: &Known, more: &[Added], iterations: usize) -> Option<Trial<'a>> {
        let tuners = &from.fitted.point.globals[..self.subject.globals.len()];
        let added = [from.added.as_slice(), more].concat();
        let (pieces, locals) = (self.pieces(from.windows), self.own_locals(from));
        let (fit, point, variant) = problem(self.subject, &added, pieces, tuners, locals, &[], self.simulations);
        let neutral = |a: &Added| a.candidate.effect.parameters()[0].null_value == Some(a.strengths[0]);
        let fitted = if more.iter().all(neutral) {
            fit.solve_beside(point, known, iterations)?
        } else {
            fit.solve(point, iterations)?
        };
        Some(Trial { added, windows: from.windows, fit, variant, fitted }.read())
    }
}
