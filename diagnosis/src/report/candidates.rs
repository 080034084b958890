//! Candidate effects by probability, and the alternatives of an effect that was found.

use mops_outcome::diagnosis::{NamedBy, Ranked, Rival, Rule};

use super::{Findings, first_of_each, parameters};
use crate::estimation::Errors;
use crate::selection::{Conclusion, FittedSet, Key, STRONG, Screening, without};

/// Candidates that were screened but not fitted, listed after the others.
const SCREENED: usize = 20;

impl<'a> Findings<'_, 'a> {
    /// Returns the candidates that were fitted: the effects found first, then by probability and evidence; then those
    /// that were only screened.
    pub(super) fn ranked(&self) -> Vec<Ranked> {
        let (sets, verdict) = (&self.sets, &self.verdict);
        let mut indices: Vec<usize> = sets.sets.iter().flat_map(|set| set.key.iter().copied()).collect();
        indices.sort_unstable();
        indices.dedup();
        let mut all: Vec<(bool, Ranked)> = indices.into_iter().filter_map(|k| self.fitted(k)).collect();
        let order = |value: f64| if value.is_nan() { f64::NEG_INFINITY } else { value };
        all.sort_by(|(a_found, a), (b_found, b)| {
            b_found
                .cmp(a_found)
                .then(order(b.probability).total_cmp(&order(a.probability)))
                .then(order(b.bic_gain).total_cmp(&order(a.bic_gain)))
        });
        let screened = sets.screened.iter().take(SCREENED).map(|screened| {
            let added = &screened.guesses[0];
            Ranked {
                effect: added.candidate.effect.name().to_owned(),
                place: added.candidate.place(),
                class: added.candidate.effect.class().name().to_owned(),
                probability: f64::NAN,
                bic_gain: f64::NAN,
                strengths: parameters::of_candidate(sets.refit.subject, added),
                absorbed: screened.absorbed,
                normalised: f64::NAN,
                failed: Some(Rule::Evidence),
            }
        });
        let mut ranked: Vec<Ranked> = all.into_iter().map(|(_, ranked)| ranked).chain(screened).collect();
        if verdict.conclusion == Conclusion::None {
            ranked.iter_mut().for_each(|ranked| ranked.failed = ranked.failed.or(Some(Rule::Probability)));
        }
        first_of_each(ranked, |ranked| (ranked.effect.clone(), ranked.place.clone()))
    }

    /// Returns a candidate in the most probable set that holds it, and whether that is the set found.
    fn fitted(&self, index: usize) -> Option<(bool, Ranked)> {
        let (sets, verdict) = (&self.sets, &self.verdict);
        let own = verdict.set.contains(&index).then(|| sets.get(&verdict.set)).flatten();
        let set = own.or_else(|| sets.sets.iter().find(|set| set.key.contains(&index)))?;
        let position = set.added.iter().position(|added| added.candidate.index == index)?;
        let candidate = &set.added[position].candidate;
        let smaller = set.key.iter().position(|k| *k == index).and_then(|k| sets.get(&without(&set.key, k)));
        let screened = sets.screened.iter().find(|screened| screened.index == index);
        Some((
            own.is_some(),
            Ranked {
                effect: candidate.effect.name().to_owned(),
                place: candidate.place(),
                class: candidate.effect.class().name().to_owned(),
                probability: self.probability_of(index),
                bic_gain: smaller.map_or(f64::NAN, |smaller| 2.0 * (set.log_evidence() - smaller.log_evidence())),
                strengths: parameters::strengths(set, position),
                absorbed: screened.map_or(f64::NAN, |screened| screened.absorbed),
                normalised: set.error().unwrap_or(f64::NAN),
                failed: self.failed(set, index),
            },
        ))
    }

    /// Returns the rule that a candidate failed in its most probable set; `None` if it is claimed.
    fn failed(&self, set: &FittedSet<'a>, index: usize) -> Option<Rule> {
        let (sets, verdict) = (&self.sets, &self.verdict);
        if verdict.set.contains(&index) {
            let entry = crate::selection::entry(sets, &sets.refit.candidates[index]);
            let is_claimed = verdict.stated.iter().any(|stated| stated.entry == entry && stated.is_claimed);
            return match verdict.conclusion {
                Conclusion::Effect if is_claimed => None,
                Conclusion::None => Some(Rule::Probability),
                _ if verdict.is_refused => Some(Rule::Curve),
                _ => Some(Rule::Claim),
            };
        }
        match self.forecasts.is_passed(&set.key) {
            Some(true) if verdict.named_by == NamedBy::LeastSquares => Some(Rule::Error),
            Some(true) => Some(Rule::Probability),
            Some(false) => Some(Rule::Forecast),
            None => Some(Rule::Evidence),
        }
    }

    /// Returns the alternatives at the place of an effect of a set, the most probable first.
    pub(super) fn rivals(&self, set: &FittedSet<'a>, index: usize) -> Vec<Rival> {
        let sets = &self.sets;
        let candidates = &sets.refit.candidates;
        let Some(at) = set.key.iter().position(|k| *k == index) else { return Vec::new() };
        let rest: Key = without(&set.key, at);
        let usable = sets.sets.iter().filter(|other| !self.verdict.excluded.contains(&other.key));
        let others = usable.filter_map(|other| {
            let new = other.key.iter().find(|k| !rest.contains(k))?;
            let is_alternative = other.key.len() == set.key.len()
                && rest.iter().all(|k| other.key.contains(k))
                && *new != index
                && candidates[*new].port == candidates[index].port;
            let behind = 2.0 * (sets.log_posterior(set) - sets.log_posterior(other));
            (is_alternative && behind < STRONG).then_some((*new, behind))
        });
        let others: Vec<(usize, f64)> = others.collect();
        let Some(parent) = sets.get(&rest).filter(|_| !others.is_empty()) else { return Vec::new() };
        let white = [Errors::White];
        let wanted: Vec<usize> = others.iter().map(|(k, _)| *k).chain([index]).collect();
        let screened = Screening::new(parent, &white).map_or_else(Vec::new, |view| view.screen(candidates, &wanted));
        let response = |k: usize| screened.iter().find(|screened| screened.index == k);
        let rival = |(k, behind): (usize, f64)| Rival {
            effect: candidates[k].effect.name().to_owned(),
            place: candidates[k].place(),
            probability: self.probability_of(k),
            bic_behind: behind,
            cosine: response(k).zip(response(index)).map_or(f64::NAN, |(a, b)| a.cosine(b)),
        };
        others.into_iter().map(rival).collect()
    }
}
