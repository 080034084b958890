//! The account of a diagnosis: candidates by probability, what is said of each effect found, how the parameters moved.

use std::sync::Arc;

use crate::candidate::Candidate;
use crate::diagnosis::{Found, Noticeable, ParameterMove, Prediction, Ranked, Rival, StrengthValue};
use crate::fit::dot;
use crate::plan::separating;
use crate::repaired::Calibrated;
use crate::round::{Round, best_in};
use crate::screen::Screened;
use crate::search::Trial;
use crate::stability::stability;
use crate::subject::Subject;
use crate::weigh::{CLEARLY, Dispersion, criterion, needed_gain, probabilities, weighed};

/// Candidates by probability: those found first, then what else was fitted in each round.
pub fn ranking(rounds: &[Arc<Round<'_>>], last: &Trial<'_>) -> Vec<Ranked> {
    let mut ranked: Vec<Ranked> = Vec::new();
    let mut seen: Vec<(String, String)> = Vec::new();
    let is_added = |t: &Trial<'_>| t.newest().is_some_and(|own| last.added.iter().any(|a| own.is(&a.candidate)));
    for round in rounds {
        let Some(best) = round.trials.first() else { continue };
        // What was tried after the last effect is told by chance, and says nothing.
        let accepted = round.trials.iter().any(is_added);
        if !accepted && !last.added.is_empty() {
            continue;
        }
        let dispersion = Dispersion::of(best);
        let mut criteria = if accepted {
            weighed(&round.trials, &dispersion)
        } else {
            // What the data tell of effects that were not added was not the question.
            round.trials.iter().map(|t| criterion(t, &dispersion)).collect()
        };
        if !accepted {
            // Nothing at all is a rival too, beforehand as likely as all candidates together.
            #[allow(clippy::cast_precision_loss)]
            let candidates = round.screened.len().max(1) as f64;
            criteria.push(criterion(&round.from, &dispersion) - 2.0 * candidates.ln());
        }
        let probabilities = probabilities(&criteria);
        for (trial, probability) in round.trials.iter().zip(probabilities) {
            let Some(a) = trial.added.last() else { continue };
            let key = (a.candidate.effect.name().to_owned(), a.candidate.place());
            if seen.contains(&key) {
                continue;
            }
            seen.push(key.clone());
            let screened = round.screened.iter().find(|s| s.added.candidate.is(&a.candidate));
            let parameters = &mops_core::Model::interface(trial.variant.model.as_ref()).parameters;
            let first = trial.variant.first[trial.added.len() - 1];
            let strengths = a.candidate.effect.strengths().iter().enumerate().map(|(k, s)| StrengthValue {
                name: s.name.to_owned(),
                value: a.strengths[k],
                unit: a.candidate.unit(s, &parameters[first + k].variable.unit),
                std_error: None,
                interval95: None,
            });
            ranked.push(Ranked {
                effect: key.0,
                place: key.1,
                class: a.candidate.effect.class().name().to_owned(),
                probability,
                bic_gain: criterion(&round.from, &dispersion) - criterion(trial, &dispersion),
                strengths: strengths.collect(),
                absorbed: screened.map_or(f64::NAN, |s| s.absorbed),
                normalised: trial.fitted.normalised(),
            });
        }
    }
    let is_found = |r: &Ranked| last.added.iter().any(|a| a.candidate.is_named(&r.effect, &r.place));
    let (mut found, mut others): (Vec<Ranked>, Vec<Ranked>) = ranked.into_iter().partition(is_found);
    others.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    found.append(&mut others);
    found
}

/// What is said of an effect that was added.
pub fn found(
    index: usize,
    last: &Trial<'_>,
    after: &Calibrated<'_>,
    rounds: &[Arc<Round<'_>>],
    ranking: &[Ranked],
) -> Found {
    let a = &last.added[index];
    let (effect, place) = (a.candidate.effect.as_ref(), a.candidate.place());
    let own = ranking.iter().find(|r| r.effect == effect.name() && r.place == place);
    let round = round_of(rounds, |newest| newest.is(&a.candidate));
    let mut rivals = Vec::new();
    if let Some(round) = round {
        let best = &round.trials[0];
        let of = Dispersion::of(best);
        let screened = |t: &Trial<'_>| -> Option<&Screened> {
            let newest = t.newest()?;
            round.screened.iter().find(|s| s.added.candidate.is(newest))
        };
        let criteria = weighed(&round.trials, &of);
        let least = criteria[0];
        let shares = probabilities(&criteria);
        for ((trial, &value), &probability) in round.trials.iter().zip(&criteria).zip(&shares).skip(1) {
            let Some(newest) = trial.newest().filter(|_| value - least < CLEARLY) else { continue };
            let likeness = match (screened(best), screened(trial)) {
                (Some(x), Some(y)) => dot(&x.direction, &y.direction).abs(),
                _ => f64::NAN,
            };
            rivals.push(Rival {
                effect: newest.effect.name().to_owned(),
                place: newest.place(),
                probability,
                bic_behind: value - least,
                likeness,
            });
        }
        rivals.sort_by(|a, b| a.bic_behind.total_cmp(&b.bic_behind));
    }
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
        probability: own.map_or(1.0, |r| r.probability),
        bic_gain: own.map_or(f64::NAN, |r| r.bic_gain),
        indistinguishable: rivals,
        stability: round.and_then(stability),
        place,
    }
}

/// Widens the intervals of strengths to those of another model with the same effects that the data allow as well.
pub fn widen(found: &mut [Found], other: &Calibrated<'_>, last: &Trial<'_>) {
    for (index, found) in found.iter_mut().enumerate() {
        let theirs = other.strengths(index, &last.variant);
        let strengths = last.added[index].candidate.effect.strengths();
        for ((own, theirs), strength) in found.strengths.iter_mut().zip(theirs).zip(strengths) {
            // What no fit moves has no interval of its own.
            let told = |value: &StrengthValue| value.interval95.or(strength.fixed.then_some([value.value; 2]));
            let (Some([from, to]), Some([low, high])) = (told(own), told(&theirs)) else { continue };
            let span = [from.min(low), to.max(high)];
            own.interval95 = (span[0] < span[1]).then_some(span);
        }
    }
}

/// The round in which such an effect did best.
fn round_of<'r, 'a>(rounds: &'r [Arc<Round<'a>>], is: impl Fn(&Candidate) -> bool) -> Option<&'r Round<'a>> {
    best_in(rounds, is).map(|index| rounds[index].as_ref())
}

/// The experiment that would best tell an effect found from the first rival that the data cannot tell from it.
pub fn next_experiment(rounds: &[Arc<Round<'_>>], found: &[Found]) -> Option<String> {
    found.iter().find_map(|found| {
        let rival = found.indistinguishable.first()?;
        let round = round_of(rounds, |newest| newest.is_named(&found.effect, &found.place))?;
        let trial = |t: &&Trial<'_>| t.newest().is_some_and(|newest| newest.is_named(&rival.effect, &rival.place));
        let names =
            [format!("`{}` at {}", found.effect, found.place), format!("`{}` at {}", rival.effect, rival.place)];
        separating(round.trials.first()?, round.trials.iter().find(trial)?, [&names[0], &names[1]])
    })
}

/// The smallest strengths that would have been noticed, of the effects whose size is one number.
pub fn noticeable(rounds: &[Arc<Round<'_>>], subject: &Subject, level: f64) -> Vec<Noticeable> {
    let Some(round) = rounds.first() else { return Vec::new() };
    let needed = (needed_gain(level, round.directions) * Dispersion::of(&round.from).weight()).sqrt();
    let one = |s: &Screened| {
        let candidate = &s.added.candidate;
        let strength = &candidate.effect.strengths()[0];
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
        let tuner = &subject.study.tuners[tuner];
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
