//! The account of a diagnosis: candidates by probability, what is said of each effect found, how the parameters moved.

use std::collections::HashSet;
use std::sync::Arc;

use mops_core::Role;
use mops_core::math;

use crate::candidate::Candidate;
use crate::plan::separating;
use crate::repaired::Calibrated;
use crate::round::Round;
use crate::screen::Screened;
use crate::search::{Search, Trial};
use crate::stability::stability;
use crate::standing::{Standing, gained};
use crate::subject::Subject;
use crate::weigh::{Dispersion, criterion, needed_gain, probabilities};
use mops_core::diagnosis::{Found, HeldBack, Noticeable, ParameterMove, Prediction, Ranked, StrengthValue};

/// Candidates by probability: those found first, in their order, then what else was tried in their places; where nothing was
/// found, what was tried first.
pub fn ranking<'a>(
    search: &Search<'a>,
    standings: &[Option<Standing<'_, 'a>>],
    rounds: &[Arc<Round<'a>>],
) -> Vec<Ranked> {
    if !standings.is_empty() {
        let standings = || standings.iter().flatten();
        let found: Vec<Ranked> =
            standings().filter_map(|s| ranked(s.round, s.own, s.probability(), s.gains[s.own])).collect();
        let tried = |s: &Standing<'_, '_>| {
            let one = |k: usize| ranked(s.round, k, s.probabilities[k], s.gains[k]);
            (0..s.round.trials.len()).filter_map(one).collect::<Vec<_>>()
        };
        let mut others: Vec<Ranked> = standings().flat_map(tried).collect();
        others.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        return once_each(found.into_iter().chain(others));
    }
    let Some(round) = rounds.first() else { return Vec::new() };
    let Some(best) = round.trials.first() else { return Vec::new() };
    let dispersion = Dispersion::of(best);
    // What the data tell of effects that were not added was not the question.
    let mut criteria: Vec<f64> = round.trials.iter().map(|t| criterion(t, &dispersion)).collect();
    // Nothing at all is a rival too, beforehand as likely as all candidates together.
    #[allow(clippy::cast_precision_loss)]
    let candidates = round.screened.len().max(1) as f64;
    let nothing = criteria[0] + gained(search, &round.from, best);
    criteria.push(nothing - 2.0 * math::ln(candidates));
    let probabilities = probabilities(&criteria);
    let one = |k: usize| ranked(round, k, probabilities[k], nothing - criteria[k]);
    let mut all: Vec<Ranked> = (0..round.trials.len()).filter_map(one).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    once_each(all.into_iter())
}

/// Of every effect at a place the first.
fn once_each(all: impl Iterator<Item = Ranked>) -> Vec<Ranked> {
    let mut seen: HashSet<(String, String)> = HashSet::new();
    all.filter(|r| seen.insert((r.effect.clone(), r.place.clone()))).collect()
}

/// What is said of one of the models of a round.
fn ranked(round: &Round<'_>, index: usize, probability: f64, bic_gain: f64) -> Option<Ranked> {
    let trial = &round.trials[index];
    let a = trial.added.last()?;
    let screened = round.screened.iter().find(|s| s.added.candidate.is(&a.candidate));
    let parameters = &mops_core::Model::interface(trial.variant.model.as_ref()).parameters;
    let first = trial.variant.first[trial.added.len() - 1];
    let strengths = a.candidate.effect.parameters().iter().enumerate().map(|(k, s)| StrengthValue {
        name: s.name.to_owned(),
        value: a.strengths[k],
        unit: a.candidate.unit(s, &parameters[first + k].variable.unit),
        std_error: None,
        interval95: None,
    });
    Some(Ranked {
        effect: a.candidate.effect.name().to_owned(),
        place: a.candidate.place(),
        class: a.candidate.effect.class().name().to_owned(),
        probability,
        bic_gain,
        strengths: strengths.collect(),
        absorbed: screened.map_or(f64::NAN, |s| s.absorbed),
        normalised: trial.fitted.normalised(),
    })
}

/// What is said of an effect that was added.
pub fn found(index: usize, last: &Trial<'_>, after: &Calibrated<'_>, standing: Option<&Standing<'_, '_>>) -> Found {
    let a = &last.added[index];
    let (effect, place) = (a.candidate.effect.as_ref(), a.candidate.place());
    let tail = place.split_once(':').map_or(place.as_str(), |(_, name)| name);
    // A gust in another experiment, say.
    let namesakes = last.added[..index].iter().filter(|b| b.candidate.is_named(effect.name(), &place));
    let number = match namesakes.count() {
        0 => String::new(),
        before => format!("-{}", before + 1),
    };
    Found {
        effect: effect.name().to_owned(),
        name: format!("{tail}-{}{number}", effect.name()),
        companion: a.candidate.companion.as_ref().map(ToString::to_string),
        only: a.candidate.only.map(|only| last.fit.subject.measurements[only].name.clone()),
        class: effect.class().name().to_owned(),
        formula: effect.formula().to_owned(),
        strengths: after.strengths(index, &last.variant),
        probability: standing.map_or(1.0, Standing::probability),
        bic_gain: standing.map_or(f64::NAN, |s| s.gains[s.own]),
        indistinguishable: standing.map_or_else(Vec::new, Standing::rivals),
        stability: standing.and_then(|s| stability(s.round, s.own)),
        held_back: Vec::new(),
        place,
    }
}

/// What an effect does for data that were held back, beside the others of the model that `after` is, without the declared terms
/// `held`; empty where the model without it cannot be followed over whole records.
pub fn held_back<'a>(
    search: &Search<'a>,
    after: &Calibrated<'a>,
    standing: &Standing<'_, 'a>,
    held: &[usize],
) -> Vec<HeldBack> {
    let mut from = standing.round.from.clone();
    if from.windows > 1 || from.added.len() + 1 != after.added.len() {
        return Vec::new();
    }
    held.iter().for_each(|&k| from.fitted.point.globals[k] = after.fitted.point.globals[k]);
    let Some(without) = search.calibrate(&from, held) else { return Vec::new() };
    let told = |role| {
        let [without, with] = [&without, after].map(|model| model.error_on(role, search.subject));
        Some(HeldBack { role, without: without?, with: with? })
    };
    [Role::Selection, Role::Validation].into_iter().filter_map(told).collect()
}

/// Widens the intervals of strengths to those of another model with the same effects that the data allow as well.
pub fn widen(found: &mut [Found], other: &Calibrated<'_>, last: &Trial<'_>) {
    for (index, found) in found.iter_mut().enumerate() {
        let theirs = other.strengths(index, &last.variant);
        let strengths = last.added[index].candidate.effect.parameters();
        for ((own, theirs), strength) in found.strengths.iter_mut().zip(theirs).zip(strengths) {
            // What no fit moves has no interval of its own.
            let told = |value: &StrengthValue| value.interval95.or(strength.fixed.then_some([value.value; 2]));
            let (Some([from, to]), Some([low, high])) = (told(own), told(&theirs)) else { continue };
            let span = [from.min(low), to.max(high)];
            own.interval95 = (span[0] < span[1]).then_some(span);
        }
    }
}

/// The experiment that would best tell an effect found from the first rival that the data cannot tell from it.
pub fn next_experiment(standings: &[Option<Standing<'_, '_>>]) -> Option<String> {
    standings.iter().flatten().find_map(|standing| {
        let (own, rival) = (&standing.round.trials[standing.own], standing.rival()?);
        let name = |newest: &Candidate| format!("`{}` at {}", newest.effect.name(), newest.place());
        separating(own, rival, [&name(own.newest()?), &name(rival.newest()?)])
    })
}

/// The smallest strengths that would have been noticed, of the effects whose size is one number.
pub fn noticeable(rounds: &[Arc<Round<'_>>], subject: &Subject, level: f64) -> Vec<Noticeable> {
    let Some(round) = rounds.first() else { return Vec::new() };
    let needed = (needed_gain(level, round.directions) * Dispersion::of(&round.from).weight()).sqrt();
    let one = |s: &Screened| {
        let candidate = &s.added.candidate;
        let strength = &candidate.effect.parameters()[0];
        let model = crate::variant::Variant::new(subject, std::slice::from_ref(&s.added), &[]);
        let parameter = &mops_core::Model::interface(model.model.as_ref()).parameters[model.first[0]];
        Some(Noticeable {
            effect: candidate.effect.name().to_owned(),
            place: candidate.place(),
            strength: StrengthValue {
                name: strength.name.to_owned(),
                value: s.unit_gain.filter(|n| n.is_finite())? * needed,
                unit: candidate.unit(strength, &parameter.variable.unit),
                std_error: None,
                interval95: None,
            },
        })
    };
    let mut all: Vec<&Screened> = round.screened.iter().filter(|s| s.added.candidate.effect.rarity() == 0).collect();
    all.sort_by_key(|s| s.added.candidate.place());
    all.into_iter().filter_map(one).collect()
}

pub fn moves(subject: &Subject, before: &Calibrated<'_>, after: &Calibrated<'_>) -> Vec<ParameterMove> {
    let one = |(k, &tuner): (usize, &usize)| {
        let tuner = &subject.study.tuners()[tuner];
        let variance = after.covariance[(k, k)];
        ParameterMove {
            name: tuner.name.clone(),
            unit: tuner.unit.to_string(),
            before: before.tuners[k],
            after: after.tuners[k],
            std_error: (variance > 0.0).then(|| variance.sqrt()),
        }
    };
    subject.globals.iter().enumerate().map(one).collect()
}

/// Tuners at a bound, but for those of declared terms that went: a bound may be what is missing.
pub fn at_bounds(subject: &Subject, before: &Calibrated<'_>, after: &Calibrated<'_>, held: &[usize]) -> Vec<String> {
    let one = |k: usize| {
        let tuner = &subject.study.tuners()[subject.globals[k]];
        let [declared, repaired] = [before, after].map(|model| tuner.at_bound(model.tuners[k]));
        let (side, of) = match (declared, repaired) {
            (Some(side), Some(_)) => (side, "of the declared and of the repaired model"),
            (Some(side), None) => (side, "of the declared model"),
            (None, Some(side)) => (side, "of the repaired model"),
            (None, None) => return None,
        };
        let bound = tuner.unit.amount(tuner.bounds[usize::from(side == "upper")]);
        Some(format!("`{}` {of} sits at its {side} bound {bound}: is the range wide enough?", tuner.name))
    };
    (0..subject.globals.len()).filter(|k| !held.contains(k)).filter_map(one).collect()
}

pub fn predictions(subject: &Subject, before: &Calibrated<'_>, after: &Calibrated<'_>) -> Vec<Prediction> {
    let mut all = Vec::new();
    for (index, m) in subject.measurements.iter().enumerate() {
        for (k, s) in m.series.iter().enumerate() {
            all.push(Prediction {
                experiment: m.name.clone(),
                role: m.role,
                signal: s.name.clone(),
                unit: s.unit.clone(),
                noise: s.noise,
                times: s.times.clone(),
                measured: s.values.clone(),
                before: before.experiments[index].predicted[k].clone(),
                after: after.experiments[index].predicted[k].clone(),
            });
        }
    }
    all
}

/// Start values of every experiment in the repaired model, those of effects under the names by which these are told.
pub fn starts(subject: &Subject, after: &Calibrated<'_>, found: &[Found]) -> Vec<(String, String, f64)> {
    // The variant numbers its effects from 1: `+1.start1`.
    let told = |name: &String| {
        let (number, own) = name.strip_prefix('+')?.split_once('.')?;
        let found = found.get(number.parse::<usize>().ok()?.checked_sub(1)?)?;
        Some(format!("{}.{own}", found.name))
    };
    let of = |(m, said): (&crate::subject::Measurement, &crate::repaired::Prognosis)| {
        let one = |(name, value): &(String, f64)| (m.name.clone(), told(name).unwrap_or_else(|| name.clone()), *value);
        said.starts.iter().map(one).collect::<Vec<_>>()
    };
    subject.measurements.iter().zip(&after.experiments).flat_map(of).collect()
}
