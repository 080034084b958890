//! Growth: effects are added one at a time, or two at once, as long as chance would not do as well; then what the others
//! make superfluous goes, and each is held against its rivals.

use mops_core::{Mistake, Watch};

use crate::diagnose::{Options, UNEXPLAINED};
use crate::search::{Round, Search, Trial};
use crate::variant::Added;
use crate::weigh::{Dispersion, by_chance, criterion};

/// How much better a criterion must be for a rival to take the place of an effect. Source: R. E. Kass, A. E. Raftery, Bayes
/// Factors, JASA 90 (1995), section 3.2: strong evidence.
const CLEARLY: f64 = 6.0;

/// Effects exchanged at most before the next is added.
const EXCHANGES: usize = 3;

/// A model that grew, and how.
pub struct Growth<'a> {
    /// Where it ended.
    pub last: Trial<'a>,
    /// What was tried: first for the first effect, and so on, or for each effect with the others in.
    pub rounds: Vec<Round<'a>>,
    /// Probability of a residual as structured as the declared model's if nothing were missing.
    pub p_value: f64,
}

impl<'a> Search<'a> {
    /// Adds effects to the declared model.
    ///
    /// # Errors
    /// The user ended it.
    #[allow(clippy::cast_precision_loss)]
    pub fn grow(&self, declared: &Trial<'a>, options: &Options, watch: &dyn Watch) -> Result<Growth<'a>, Mistake> {
        let begun = |last| Growth { last, rounds: Vec::new(), p_value: 1.0 };
        let mut growth = self.onward(begun(declared.clone()), options, watch)?;
        if growth.last.added.is_empty() || options.max_effects < 2 {
            return Ok(growth);
        }
        let explains = |whole: &Trial<'_>| whole.fitted.normalised() <= UNEXPLAINED;
        let mut best = self.whole(&growth.last);
        if best.as_ref().is_some_and(explains) {
            return Ok(growth);
        }
        // Where the best first step led nowhere, another may lead on.
        let ways = self.other_ways(declared, &growth);
        for (tried, way) in ways.iter().enumerate() {
            watch.stage("other ways, as something is left", 0.75 + 0.05 * (tried + 1) as f64 / ways.len() as f64);
            let other = self.onward(begun(self.over_or_in_windows(way)), options, watch)?.last;
            let Some(other) = self.whole(&other) else { continue };
            let of = Dispersion::of(&other);
            if best.as_ref().is_none_or(|best| criterion(&other, &of) < criterion(best, &of) - CLEARLY) {
                growth.last = other.clone();
                if explains(&other) {
                    break;
                }
                best = Some(other);
            }
        }
        Ok(growth)
    }

    /// Single effects to begin with again, best first: runners-up of the first round, and what a fit that begins where the
    /// study does finds.
    fn other_ways(&self, declared: &Trial<'a>, growth: &Growth<'a>) -> Vec<Trial<'a>> {
        const WAYS: usize = 4;
        let Some(first) = growth.rounds.first() else { return Vec::new() };
        let mut ways = self.afresh(declared, first);
        ways.extend(first.trials.iter().cloned());
        ways.sort_by(|a, b| a.score().total_cmp(&b.score()));
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
    fn onward(&self, begun: Growth<'a>, options: &Options, watch: &dyn Watch) -> Result<Growth<'a>, Mistake> {
        let mut growth = begun;
        // The round after the present one, where it was looked at already.
        let mut ahead: Option<Round<'a>> = None;
        let most = options.max_effects;
        while growth.last.added.len() < most {
            let count = growth.last.added.len();
            if watch.wants_stop() {
                return Err(Mistake::here("the diagnosis was interrupted"));
            }
            watch.stage(&format!("search for effect {}", count + 1), 0.1 + 0.7 * count as f64 / most as f64);
            let Some(round) = ahead.take().or_else(|| self.round(&growth.last)) else { break };
            if count == 0 {
                // Of the screening itself: its gains are those of single directions.
                growth.p_value = round.screened.first().map_or(1.0, |s| by_chance(s.gain, round.independent));
            }
            let likely = |trial: &&Trial<'a>| chance(&growth.last, trial, round.directions) <= options.level;
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
                (None, Some(pair)) => (self.over_or_in_windows(pair), None),
                (None, None) => {
                    growth.rounds.push(round);
                    break;
                }
            };
            (growth.last, ahead) = next;
            growth.rounds.push(round);
            // What one effect stood in for may have its place once the next is in.
            if let Some(better) = self.exchanges(&growth.last, watch) {
                (growth.last, ahead) = (better, None);
            }
        }
        Ok(growth)
    }

    /// The best single effect with the round that follows it, where that was looked at; or a pair, where it beats that with
    /// the best that can be added to it.
    fn either(&self, single: &Trial<'a>, pair: Option<&Trial<'a>>) -> (Trial<'a>, Option<Round<'a>>) {
        let single = self.over_or_in_windows(single);
        let Some(pair) = pair else { return (single, None) };
        let second = self.round(&single);
        let rival = second.as_ref().and_then(|second| second.trials.first());
        let of = Dispersion::of(pair);
        let alone = rival.map_or(f64::INFINITY, |rival| criterion(rival, &of)).min(criterion(&single, &of));
        if criterion(pair, &of) < alone - 2.0 { (self.over_or_in_windows(pair), None) } else { (single, second) }
    }

    /// The same over whole records, without what is superfluous, each effect held against its rivals.
    pub fn settle(&self, growth: Growth<'a>, options: &Options, watch: &dyn Watch) -> Growth<'a> {
        watch.stage("what can be left out", 0.82);
        let Growth { last, mut rounds, p_value } = growth;
        let mut last = self.over_whole(&last).unwrap_or(last);
        if last.added.len() > 1 {
            last = self.pruned(last, options.level);
        }
        while last.added.len() > 1 && last.windows == 1 {
            let Some((one, round)) = self.merged(&last) else { break };
            last = one;
            rounds.insert(0, round);
        }
        if last.added.len() < 2 || last.windows > 1 {
            return Growth { last, rounds, p_value };
        }
        watch.stage("each effect against its rivals", 0.86);
        let (exchanged, rounds) = self.exchanged(&last);
        Growth { last: exchanged.unwrap_or(last), rounds, p_value }
    }

    /// The model with one effect in place of two at the same port that it does the work of, as an asymmetric friction does that
    /// of a Coulomb friction and a constant force; and the round that it is from.
    fn merged(&self, last: &Trial<'a>) -> Option<(Trial<'a>, Round<'a>)> {
        let of = Dispersion::of(last);
        let most = criterion(last, &of) + CLEARLY;
        for i in 0..last.added.len() {
            for j in i + 1..last.added.len() {
                if last.added[i].candidate.port != last.added[j].candidate.port {
                    continue;
                }
                let others = last.added.iter().enumerate().filter(|(k, _)| *k != i && *k != j).map(|(_, a)| a.clone());
                let Some(without) = self.from(last, &others.collect::<Vec<_>>(), 40) else { continue };
                let Some(round) = self.round(&self.over_or_in_windows(&without)) else { continue };
                let one = round.trials.first().filter(|t| t.windows == 1 && criterion(t, &of) <= most).cloned();
                if let Some(one) = one {
                    return Some((one, round));
                }
            }
        }
        None
    }

    /// The model after effects were exchanged, one after the other, as long as something is left; `None` where none was.
    fn exchanges(&self, last: &Trial<'a>, watch: &dyn Watch) -> Option<Trial<'a>> {
        let mut better: Option<Trial<'a>> = None;
        for _ in 0..EXCHANGES {
            let last = better.as_ref().unwrap_or(last);
            if last.added.len() < 2 || last.windows > 1 || last.fitted.normalised() <= UNEXPLAINED {
                break;
            }
            watch.stage("each effect against its rivals", 0.5);
            let Some(next) = self.exchanged(last).0 else { break };
            better = Some(next);
        }
        better
    }

    /// The model with another in place of one of its effects, where that is clearly better; and the rounds in which each was
    /// held against its rivals.
    fn exchanged(&self, last: &Trial<'a>) -> (Option<Trial<'a>>, Vec<Round<'a>>) {
        let rounds: Vec<Round<'a>> = (0..last.added.len()).filter_map(|index| self.rivals(last, index)).collect();
        let of = Dispersion::of(last);
        let better = rounds.iter().filter_map(|round| round.trials.first());
        let better = better.min_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
        let exchanged = better.filter(|b| criterion(b, &of) < criterion(last, &of) - CLEARLY).cloned();
        (exchanged, rounds)
    }

    /// The round for one of the effects with the others in.
    fn rivals(&self, last: &Trial<'a>, index: usize) -> Option<Round<'a>> {
        let without = self.over_or_in_windows(&self.without(last, index)?);
        let mut round = self.round(&without)?;
        round.trials.retain(|t| t.windows == last.windows);
        let own = &last.added[index];
        // The effect itself stands where the whole model ended, not where a new fit from nothing may have stopped; but with
        // the others in, another shape of it may do better.
        let others = last.added.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, a)| a);
        let order: Vec<_> = others.chain([own]).cloned().collect();
        round.trials.extend(self.from(last, &order, 10));
        let of = Dispersion::of(last);
        round.trials.sort_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
        let mut seen = 0;
        round.trials.retain(|t| {
            let same = t.added.last().is_some_and(|a| a.candidate.is(&own.candidate));
            seen += usize::from(same);
            !same || seen == 1
        });
        Some(round)
    }
}

/// Probability that effects do as well by chance, chosen among so many directions.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_wrap, clippy::cast_possible_truncation)]
fn chance(from: &Trial<'_>, with: &Trial<'_>, directions: f64) -> f64 {
    let dispersion = Dispersion::of(with);
    let worth = (with.fitted.count as f64 / dispersion.repeats).max(2.0).ln();
    let added = (with.added.len() - from.added.len()) as i32;
    let gain = criterion(from, &dispersion) - criterion(with, &dispersion) + f64::from(added) * worth;
    by_chance(gain, directions.powi(added))
}
