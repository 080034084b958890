//! Where an effect that was found stands among its rivals: all that was tried in its place, with the other effects in.

use std::sync::Arc;

use crate::base;
use crate::fit::dot;
use crate::round::{Round, best_in};
use crate::screen::Screened;
use crate::search::{Search, Trial};
use crate::weigh::{CLEARLY, Dispersion, criterion, probabilities, weighed};
use mops_core::diagnosis::Rival;

/// An effect found beside what was tried in its place.
pub struct Standing<'r, 'a> {
    /// The round in which it was tried.
    pub round: &'r Round<'a>,
    /// Its index among the models fitted there.
    pub own: usize,
    /// How much the criterion falls by adding each of these.
    pub gains: Vec<f64>,
    /// Probability of each.
    pub probabilities: Vec<f64>,
    /// Minus twice the logarithm of the evidence of each.
    criteria: Vec<f64>,
}

impl<'r, 'a> Standing<'r, 'a> {
    /// Of one of the effects of a model; `None` where nothing was tried beside it.
    pub fn of(search: &Search<'a>, rounds: &'r [Arc<Round<'a>>], last: &Trial<'a>, index: usize) -> Option<Self> {
        let (round, own) = place_in(rounds, last, index)?;
        let of = Dispersion::of(&round.trials[own]);
        let criteria = weighed(&round.trials, &of);
        let gained = gained(search, &round.from, &round.trials[own]);
        let whole = criterion(&round.trials[own], &of);
        let gains = round.trials.iter().map(|trial| gained + whole - criterion(trial, &of)).collect();
        let probabilities = probabilities(&criteria);
        Some(Self { round, own, gains, probabilities, criteria })
    }

    /// Its probability.
    pub fn probability(&self) -> f64 {
        self.probabilities[self.own]
    }

    /// Effects that do better, or are not clearly behind; the best first.
    pub fn rivals(&self) -> Vec<Rival> {
        let screened = |trial: &Trial<'_>| -> Option<&Screened> {
            let newest = trial.newest()?;
            self.round.screened.iter().find(|s| s.added.candidate.is(newest))
        };
        let own = screened(&self.round.trials[self.own]);
        let rival = |index: usize| {
            let trial = &self.round.trials[index];
            let newest = trial.newest()?;
            let likeness = own.zip(screened(trial)).map_or(f64::NAN, |(x, y)| dot(&x.direction, &y.direction).abs());
            Some(Rival {
                effect: newest.effect.name().to_owned(),
                place: newest.place(),
                probability: self.probabilities[index],
                bic_behind: self.behind(index),
                likeness,
            })
        };
        self.close().into_iter().filter_map(rival).collect()
    }

    /// The model with the first of the rivals in its place.
    pub fn rival(&self) -> Option<&Trial<'a>> {
        Some(&self.round.trials[*self.close().first()?])
    }

    /// Indices of the models of rivals, the best first.
    fn close(&self) -> Vec<usize> {
        let is_close = |&index: &usize| index != self.own && self.behind(index) < CLEARLY;
        let mut close: Vec<usize> = (0..self.criteria.len()).filter(is_close).collect();
        close.sort_by(|&a, &b| self.behind(a).total_cmp(&self.behind(b)));
        close
    }

    fn behind(&self, index: usize) -> f64 {
        self.criteria[index] - self.criteria[self.own]
    }
}

/// The round that held an effect against its rivals with the other effects in, and its index there; else that in which it did
/// best.
fn place_in<'r, 'a>(rounds: &'r [Arc<Round<'a>>], last: &Trial<'a>, index: usize) -> Option<(&'r Round<'a>, usize)> {
    let own = &last.added[index].candidate;
    let is_own = |trial: &Trial<'_>| trial.newest().is_some_and(|newest| newest.is(own)) && trial.has_same_set(last);
    let held = rounds.iter().find_map(|round| Some((round.as_ref(), round.trials.iter().position(is_own)?)));
    held.or_else(|| best_in(rounds, |newest| newest.is(own)).map(|index| (rounds[index].as_ref(), 0)))
}

/// By how much the criterion of a model falls by what was added to another; over the windows of that, where it cannot be
/// followed over whole records.
pub fn gained<'a>(search: &Search<'a>, from: &Trial<'a>, with: &Trial<'a>) -> f64 {
    let gain = |with: &Trial<'_>| {
        let of = Dispersion::of(with);
        criterion(from, &of) - criterion(with, &of)
    };
    if from.windows == with.windows {
        return gain(with);
    }
    let tuners = &with.fitted.point.globals[..search.subject.globals.len()];
    let locals = base::first_locals(&search.pieces(from.windows));
    let in_windows = search.trial(&with.added, tuners, locals, from.windows, 40);
    gain(in_windows.as_ref().unwrap_or(with))
}
