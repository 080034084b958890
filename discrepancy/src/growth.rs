//! Growth: effects are added one at a time, or two at once, as long as chance would not do as well; then what the others
//! make superfluous goes, and each is held against its rivals.

use mops_core::{Mistake, Watch};

use crate::diagnose::{Options, UNEXPLAINED};
use crate::search::{Round, Search, Trial};
use crate::weigh::{Dispersion, by_chance, criterion};

/// How much better a criterion must be for a rival to take the place of an effect. Source: R. E. Kass, A. E. Raftery, Bayes
/// Factors, JASA 90 (1995), section 3.2: strong evidence.
const CLEARLY: f64 = 6.0;

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
        let mut growth = Growth { last: declared.clone(), rounds: Vec::new(), p_value: 1.0 };
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
        let Growth { last, rounds, p_value } = growth;
        let mut last = self.over_whole(&last).unwrap_or(last);
        if last.added.len() > 1 {
            last = self.pruned(last, options.level);
        }
        if last.added.len() < 2 || last.windows > 1 {
            return Growth { last, rounds, p_value };
        }
        watch.stage("each effect against its rivals", 0.86);
        let rounds: Vec<Round<'a>> = (0..last.added.len()).filter_map(|index| self.rivals(&last, index)).collect();
        let of = Dispersion::of(&last);
        let better = rounds.iter().filter_map(|round| round.trials.first()).filter(|t| t.windows == 1);
        let better = better.min_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
        let exchanged = better.filter(|b| criterion(b, &of) < criterion(&last, &of) - CLEARLY).cloned();
        Growth { last: exchanged.unwrap_or(last), rounds, p_value }
    }

    /// The round for one of the effects with the others in.
    fn rivals(&self, last: &Trial<'a>, index: usize) -> Option<Round<'a>> {
        let without = self.without(last, index)?;
        let mut round = self.round(&without)?;
        let own = &last.added[index];
        let same = |t: &Trial<'_>| t.added.last().is_some_and(|a| a.candidate.is(&own.candidate));
        round.trials.retain(|t| !same(t));
        // The effect itself stands where the whole model ended, not where a new fit from nothing may have stopped.
        let others = last.added.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, a)| a);
        let order: Vec<_> = others.chain([own]).cloned().collect();
        round.trials.extend(self.from(last, &order, 10));
        let of = Dispersion::of(last);
        round.trials.sort_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
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
