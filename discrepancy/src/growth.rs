//! Growth: effects are added one at a time, or two at once, as long as chance would not do as well; then what the others
//! make superfluous goes, and each is held against its rivals.

use std::cmp::Ordering;
use std::sync::Arc;

use mops_core::Watch;
use mops_core::math;
use rayon::prelude::*;

use crate::diagnose::{Options, UNEXPLAINED};
use crate::round::{Round, best_first, best_in};
use crate::screen::Screened;
use crate::search::{Search, Trial};
use crate::variant::Added;
use crate::weigh::{CLEARLY, Dispersion, by_chance, criterion};
use mops_core::diagnosis::{Change, Step};

/// How often effects are held against their rivals at most while a model grows.
const EXCHANGES: usize = 4;

/// How often the effects of a model that has grown are exchanged at most as it is settled.
const SETTLINGS: u32 = 3;

/// A model that grew, and how.
pub struct Growth<'a> {
    /// Where it ended.
    pub last: Trial<'a>,
    /// What was tried: first for the first effect, and so on, or for each effect with the others in.
    pub rounds: Vec<Arc<Round<'a>>>,
    /// The models on the way.
    pub steps: Vec<Step>,
    /// Models with other shapes of the same effects that the data allow as well.
    pub allowed: Vec<Trial<'a>>,
    /// Probability of a residual as structured as the declared model's if nothing were missing.
    pub p_value: f64,
}

impl<'a> Growth<'a> {
    fn begun(last: Trial<'a>) -> Self {
        Self { last, rounds: Vec::new(), steps: Vec::new(), allowed: Vec::new(), p_value: 1.0 }
    }

    /// What is done next, and what was found so far.
    fn stage(&self, next: &str) -> String {
        let names: Vec<&str> = self.last.added.iter().map(|a| a.candidate.effect.name()).collect();
        let left = self.last.fitted.normalised();
        let found = if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
        format!("{next}; so far {found} ({left:.2} times the noise left)")
    }

    /// Whether the first round ended at the model that there is now.
    fn begins_with_last(&self) -> bool {
        let best = self.rounds.first().and_then(|round| round.trials.first());
        best.is_some_and(|best| best.has_same_set(&self.last))
    }

    /// Goes on to another model.
    fn step(&mut self, did: Change, to: Trial<'a>) {
        let name = |a: &Added| format!("{} at {}", a.candidate.effect.name(), a.candidate.place());
        let effects = to.added.iter().map(name).collect();
        self.steps.push(Step { did, effects, windows: to.windows, normalised: to.fitted.normalised() });
        self.last = to;
    }
}

impl<'a> Search<'a> {
    /// Adds effects to the declared model.
    #[allow(clippy::cast_precision_loss)]
    pub fn grow(&self, declared: &Trial<'a>, options: &Options, watch: &dyn Watch) -> Growth<'a> {
        let mut growth = self.onward(Growth::begun(declared.clone()), options, watch);
        if growth.last.added.is_empty() || options.max_effects < 2 {
            return growth;
        }
        let best = self.whole(&growth.last);
        if best.as_ref().is_some_and(|whole| whole.fitted.normalised() <= UNEXPLAINED) {
            return growth;
        }
        // Where the best first step led nowhere, another may lead on.
        watch.stage("other ways, as something is left", 0.76);
        let ways = self.other_ways(declared, &growth);
        let ways: Vec<Trial<'a>> = ways.iter().map(|way| self.over_or_in_windows(way)).collect();
        let leads = |way: &&Trial<'a>| way.windows == 1 && way.fitted.normalised() <= UNEXPLAINED;
        let mut further: Vec<Trial<'a>> = ways.iter().filter(leads).cloned().collect();
        if further.is_empty() {
            // With the effect that helps each most.
            let round = |way: &Trial<'a>| match &best {
                Some(best) => self.round_against(way, best),
                None => self.round(way),
            };
            further = ways.iter().filter_map(|way| self.whole(round(way)?.trials.first()?)).collect();
        }
        let way = least(&further, &Dispersion::WHITE).filter(|way| is_clearly_better(way, best.as_ref()));
        let Some(way) = way else { return growth };
        growth.step(Change::Restarted, way.clone());
        let other = self.onward(Growth::begun(way.clone()), options, watch);
        if is_clearly_better(&other.last, Some(way)) {
            growth.steps.extend(other.steps);
            growth.last = other.last;
        }
        growth
    }

    /// Single effects to begin with again, best first: runners-up of the first round, and what a fit that begins where the
    /// study does finds.
    fn other_ways(&self, declared: &Trial<'a>, growth: &Growth<'a>) -> Vec<Trial<'a>> {
        const WAYS: usize = 4;
        let Some(first) = growth.rounds.first() else { return Vec::new() };
        let mut ways = self.afresh(declared, first);
        ways.extend(first.trials.iter().cloned());
        best_first(&mut ways);
        let mut chosen: Vec<Trial<'a>> = Vec::new();
        for way in ways {
            let is = |a: &Added| way.added[0].candidate.is(&a.candidate);
            let taken = growth.last.added.iter().any(is) || chosen.iter().any(|c| is(&c.added[0]));
            if !taken && chosen.len() < WAYS {
                chosen.push(way);
            }
        }
        chosen
    }

    /// Adds effects to a model that may have some.
    #[allow(clippy::cast_precision_loss)]
    fn onward(&self, begun: Growth<'a>, options: &Options, watch: &dyn Watch) -> Growth<'a> {
        let mut growth = begun;
        let mut exchanges = EXCHANGES;
        let most = options.max_effects;
        while growth.last.added.len() < most {
            let count = growth.last.added.len();
            watch.stage(
                &growth.stage(&format!("search for effect {}", count + 1)),
                0.1 + 0.7 * count as f64 / most as f64,
            );
            let Some(round) = self.round(&growth.last) else { break };
            if count == 0 {
                // Of the screening itself: its gains are those of single directions.
                growth.p_value = round.screened.first().map_or(1.0, |s| by_chance(s.gain, round.independent));
            }
            let likely = |trial: &&Trial<'a>| chance(&growth.last, trial, round.directions) <= self.limits.level;
            let single = round.trials.first().filter(likely);
            let left = single.unwrap_or(&growth.last).fitted.normalised();
            let pairs = if count == 0 && most > 1 && left > UNEXPLAINED {
                watch.stage("pairs of effects", 0.3);
                self.pairs(&growth.last, &round)
            } else {
                Vec::new()
            };
            let pair = pairs.first().filter(likely);
            let next = match (single, pair) {
                (Some(single), pair) => self.either(single, pair),
                // Two together may do what neither does alone.
                (None, Some(pair)) => self.over_or_in_windows(pair),
                (None, None) => {
                    growth.rounds.push(round);
                    break;
                }
            };
            let next = self.unstuck(next);
            growth.rounds.push(round.with(&next));
            growth.step(Change::Added, next);
            // What one effect stood in for may have its place once the next is in.
            while let Some(better) = self.exchange(&growth.last, &mut exchanges, watch) {
                growth.step(Change::Swapped, better);
            }
        }
        growth
    }

    /// The best single effect; or a pair, where it beats that with the best that can be added to it.
    fn either(&self, single: &Trial<'a>, pair: Option<&Trial<'a>>) -> Trial<'a> {
        let single = self.over_or_in_windows(single);
        let Some(pair) = pair else { return single };
        let pair = self.over_or_in_windows(pair);
        let second = self.round(&single);
        let rival = second.as_ref().and_then(|second| second.trials.first());
        let of = Dispersion::of(&pair);
        // What cannot be followed over whole records has lost against what can.
        let beats = |than: &Trial<'a>| match pair.windows.cmp(&than.windows) {
            Ordering::Equal => criterion(&pair, &of) < criterion(than, &of) - 2.0,
            other => other == Ordering::Less,
        };
        if beats(&single) && rival.is_none_or(beats) { pair } else { single }
    }

    /// The same over whole records, without what is superfluous, each effect held against its rivals.
    pub fn settle(&self, growth: Growth<'a>, watch: &dyn Watch) -> Growth<'a> {
        let mut growth = growth;
        let was_whole = growth.last.windows == 1;
        let whole = self.over_whole(&growth.last);
        growth.last = whole.map_or(growth.last, |whole| if was_whole { whole } else { self.unstuck(whole) });
        for settling in 0..=SETTLINGS {
            watch.stage(&growth.stage("what can be left out"), 0.8 + 0.03 * f64::from(settling));
            if let Some(pruned) = self.pruned(&growth.last, self.limits.level) {
                growth.step(Change::Eliminated, pruned);
            }
            while let Some(better) = self.forecasting_better(&growth.last) {
                growth.step(Change::Eliminated, better);
            }
            while growth.last.added.len() > 1 && growth.last.windows == 1 {
                let Some((one, round)) = self.merged(&growth.last) else { break };
                growth.step(Change::Substituted, one);
                growth.rounds.insert(0, round);
            }
            let is_settled = match growth.last.added.len() {
                0 => true,
                // Its own round weighed it as white residuals do.
                1 => Dispersion::of(&growth.last).repeats == 1.0 && growth.begins_with_last(),
                _ => false,
            };
            if is_settled || growth.last.windows > 1 {
                break;
            }
            watch.stage(&growth.stage("each effect against its rivals"), 0.81 + 0.03 * f64::from(settling));
            let exchanged;
            (exchanged, growth.rounds) = self.exchanged(&growth.last);
            // The last look is for the rivals of what is there.
            let Some(better) = exchanged.filter(|_| settling < SETTLINGS) else { break };
            // Beside another effect, what was needed may be superfluous.
            growth.step(Change::Swapped, better);
        }
        watch.stage("other shapes of what was found", 0.88);
        self.reshape(growth)
    }

    /// The growth with the best shapes of its effects, and what else the data allow of them.
    fn reshape(&self, mut growth: Growth<'a>) -> Growth<'a> {
        let reshaped;
        (reshaped, growth.allowed) = self.shapes(growth.last.clone());
        if reshaped.fitted.chi2 < growth.last.fitted.chi2 {
            growth.rounds = self.held_against_rivals(&reshaped);
            growth.step(Change::Reshaped, reshaped);
        }
        growth
    }

    /// The model with one effect in place of two at the same port that it does the work of, as an asymmetric friction does that
    /// of a Coulomb friction and a constant force; and the round that it is from.
    fn merged(&self, last: &Trial<'a>) -> Option<(Trial<'a>, Arc<Round<'a>>)> {
        let of = Dispersion::of(last);
        let most = criterion(last, &of) + CLEARLY;
        for i in 0..last.added.len() {
            for j in i + 1..last.added.len() {
                if last.added[i].candidate.port != last.added[j].candidate.port {
                    continue;
                }
                let others = last.added.iter().enumerate().filter(|(k, _)| *k != i && *k != j).map(|(_, a)| a.clone());
                let Some(without) = self.from(last, &others.collect::<Vec<_>>(), 40) else { continue };
                let Some(round) = self.round_against(&self.over_or_in_windows(&without), last) else { continue };
                let one = round.trials.first().filter(|t| t.windows == 1 && criterion(t, &of) <= most).cloned();
                if let Some(one) = one {
                    return Some((one, round));
                }
            }
        }
        None
    }

    /// The growth with what declared terms its effects make superfluous, at zero; beside it the model without them.
    pub fn reduce(&self, mut growth: Growth<'a>) -> (Growth<'a>, Trial<'a>, Vec<usize>) {
        let (reduced, held) = self.without_declared(growth.last.clone());
        let Some(simpler) = self.restated(&growth, &reduced, &held) else { return (growth, reduced, held) };
        growth.rounds = self.held_against_rivals(&simpler);
        growth.step(Change::Swapped, simpler);
        growth = self.reshape(growth);
        let (reduced, held) = self.without_declared(growth.last.clone());
        (growth, reduced, held)
    }

    /// The model with declared terms back in that an effect made superfluous, and with a simpler one in the place of that, where
    /// it is not clearly worse. Else a constant beside a declared loss is told as a loss towards elsewhere.
    fn restated(&self, growth: &Growth<'a>, reduced: &Trial<'a>, held: &[usize]) -> Option<Trial<'a>> {
        if held.is_empty() {
            return None;
        }
        let of = Dispersion::of(reduced);
        // What they were held at is one more unknown each.
        #[allow(clippy::cast_precision_loss)]
        let terms = held.len() as f64 * of.worth(reduced.fitted.count);
        let mut tuners = reduced.fitted.point.globals[..self.subject.globals.len()].to_vec();
        held.iter().for_each(|&k| tuners[k] = self.subject.start()[k]);
        let mut trials: Vec<Trial<'a>> = Vec::new();
        for (index, own) in reduced.added.iter().enumerate() {
            let Some(round) = best_in(&growth.rounds, |newest| newest.is(&own.candidate)) else { continue };
            let others = [&reduced.added[..index], &reduced.added[index + 1..]].concat();
            let beside = self.candidates(&others);
            let simpler = |s: &&Screened| {
                let candidate = &s.added.candidate;
                candidate.has_fewer_strengths_than(&own.candidate) && beside.iter().any(|free| free.is(candidate))
            };
            let fit = |s: &Screened| {
                let added = [others.as_slice(), &[self.neutral_start(&s.added)]].concat();
                let anew = self.trial(&added, &tuners, self.own_locals(reduced), reduced.windows, 40)?;
                // As its round knows it, where that leaves less.
                let known = growth.rounds[round].trials.iter().find(|known| known.has_effects_of(&anew));
                let known = known.filter(|known| known.windows == anew.windows && known.fitted.chi2 < anew.fitted.chi2);
                Some(known.cloned().unwrap_or(anew))
            };
            let screened: Vec<&Screened> = growth.rounds[round].screened.iter().filter(simpler).collect();
            trials.par_extend(screened.into_par_iter().filter_map(fit));
        }
        trials.retain(|trial| criterion(trial, &of) + terms < criterion(reduced, &of) + CLEARLY);
        least(&trials, &of).cloned()
    }

    /// The model with one of its effects exchanged, as long as something is left and not too many were.
    fn exchange(&self, last: &Trial<'a>, left: &mut usize, watch: &dyn Watch) -> Option<Trial<'a>> {
        if *left == 0 || last.added.len() < 2 || last.windows > 1 || last.fitted.normalised() <= UNEXPLAINED {
            return None;
        }
        *left -= 1;
        watch.stage("each effect against its rivals", 0.5);
        self.exchanged(last).0
    }

    /// The model with another in place of one of its effects, where that is better, or clearly better where it is another fit of
    /// the same effects; and the rounds in which each was held against its rivals.
    fn exchanged(&self, last: &Trial<'a>) -> (Option<Trial<'a>>, Vec<Arc<Round<'a>>>) {
        let rounds = self.held_against_rivals(last);
        let of = Dispersion::of(last);
        let better = least(rounds.iter().filter_map(|round| round.trials.first()), &of);
        let margin = |b: &Trial<'_>| if b.has_same_set(last) { CLEARLY } else { 0.0 };
        let exchanged = better.filter(|b| criterion(b, &of) < criterion(last, &of) - margin(b)).cloned();
        (exchanged, rounds)
    }

    /// For each effect of a model the round in which it is held against its rivals, with the others in.
    pub fn held_against_rivals(&self, last: &Trial<'a>) -> Vec<Arc<Round<'a>>> {
        (0..last.added.len()).filter_map(|index| self.rivals(last, index).map(Arc::new)).collect()
    }

    /// The round for one of the effects with the others in.
    fn rivals(&self, last: &Trial<'a>, index: usize) -> Option<Round<'a>> {
        /// Share of the gain, to first order, from which on another effect counts as near.
        const NEAR: f64 = 0.9;
        let without = self.over_or_in_windows(&self.without(last, index)?);
        let mut round = Round::clone(&*self.round_against(&without, last)?);
        let own = &last.added[index];
        let others = last.added.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, a)| a.clone());
        let others: Vec<Added> = others.collect();
        let with = |own: &Added| [others.as_slice(), std::slice::from_ref(own)].concat();
        // The effect itself stands where the whole model ended, not where a new fit from nothing may have stopped; but with
        // the others in, another shape of it may do better.
        let mut trials: Vec<Trial<'a>> = self.from(last, &with(own), 10).into_iter().collect();
        // What is simpler begins there too, whatever a linear view from afar says of it.
        let simpler = round.screened.iter().filter(|s| s.added.candidate.is_simpler_than(&own.candidate));
        trials.extend(simpler.filter_map(|s| self.from(last, &with(&s.added.begun_like(own)), 40)));
        // As does what the linear view had as near, and a short fit may have lost, as a declared term must go for it.
        let own_gain = round.screened.iter().find(|s| s.added.candidate.is(&own.candidate)).map(|s| s.gain);
        let near = |s: &&Screened| {
            let candidate = &s.added.candidate;
            candidate.port == own.candidate.port
                && !own.candidate.has_fewer_strengths_than(candidate)
                && own_gain.is_some_and(|gain| s.gain > NEAR * gain)
                && !round.trials.iter().filter_map(Trial::newest).any(|tried| tried.is(candidate))
        };
        let lost: Vec<&Screened> = round.screened.iter().filter(near).take(self.limits.finalists).collect();
        trials.extend(lost.par_iter().filter_map(|s| self.from(last, &with(&s.added), 40)).collect::<Vec<_>>());
        for (rank, trial) in std::mem::take(&mut round.trials).into_iter().enumerate() {
            // As does what was looked at in windows alone.
            if trial.windows == last.windows {
                trials.push(trial);
            } else if rank < self.limits.finalists {
                trials.extend(self.from(last, &trial.added, 40));
            }
        }
        let of = Dispersion::of(last);
        trials.sort_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
        for trial in trials.into_iter().filter(|trial| trial.is_physical() || trial.has_same_set(last)) {
            let newest = trial.newest();
            if !round.trials.iter().filter_map(Trial::newest).any(|known| newest.is_some_and(|n| n.is(known))) {
                round.trials.push(trial);
            }
        }
        Some(round)
    }
}

/// The model of the least criterion.
pub(crate) fn least<'t, 'a: 't>(
    trials: impl IntoIterator<Item = &'t Trial<'a>>,
    of: &Dispersion,
) -> Option<&'t Trial<'a>> {
    trials.into_iter().min_by(|a, b| criterion(a, of).total_cmp(&criterion(b, of)))
}

/// Whether a model is better than another, as its own residuals weigh them; than none it is.
fn is_clearly_better(trial: &Trial<'_>, than: Option<&Trial<'_>>) -> bool {
    let of = Dispersion::of(trial);
    than.is_none_or(|than| criterion(trial, &of) < criterion(than, &of) - CLEARLY)
}

/// Probability that effects do as well by chance, chosen among so many directions.
#[allow(clippy::cast_possible_wrap, clippy::cast_possible_truncation)]
fn chance(from: &Trial<'_>, with: &Trial<'_>, directions: f64) -> f64 {
    let dispersion = Dispersion::of(with);
    let worth = dispersion.worth(with.fitted.count);
    let added = (with.added.len() - from.added.len()) as i32;
    let gain = criterion(from, &dispersion) - criterion(with, &dispersion) + f64::from(added) * worth;
    by_chance(gain, math::powi(directions, added))
}
