//! The whole way from a study to a diagnosis.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use mops_core::{Effect, Mistake, Role, Study, Watch};

use crate::base;
use crate::diagnosis::{
    Diagnosis, Found, Noticeable, ParameterMove, Prediction, Ranked, Rival, StrengthValue, Verdict,
};
use crate::fit::dot;
use crate::held_out::predictive_gain;
use crate::locate::{Located, locate};
use crate::plan::separating;
use crate::repaired::Calibrated;
use crate::screen::{Scene, Screened};
use crate::search::{Limits, Round, Search, Trial};
use crate::stopgap::stopgap;
use crate::subject::Subject;
use crate::weigh::{Dispersion, by_chance, criterion, probabilities};

/// What a diagnosis is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Largest number of effects that are added.
    pub max_effects: usize,
    /// Probability of adding an effect where nothing is missing.
    pub level: f64,
    /// Seed of the random starts.
    pub seed: u64,
}

/// Residuals, in units of the noise, above which the best model does not explain the data.
const UNEXPLAINED: f64 = 1.1;

/// How many times the number of unknowns the sum of squares over calibration data may rise where all data are fitted: were
/// the model right, it would rise by about that number.
const CONTRADICTED: f64 = 4.0;

/// Share by which a free signal must lower the error on samples left out to count as something that is missing.
const FORETOLD: f64 = 0.1;

/// The same of its forecasts of selection data, with parameters from calibration data: these are uncertain.
const MISTAKEN: f64 = 1.5;

/// Finds what the model of a calibration study lacks.
///
/// # Errors
/// A study that cannot be diagnosed, a model that cannot be fitted at all, or an interruption.
pub fn diagnose(
    study: &Study,
    effects: &[Arc<dyn Effect>],
    options: &Options,
    watch: &dyn Watch,
) -> Result<Diagnosis, Mistake> {
    let subject = Subject::new(study)?;
    let simulations = AtomicUsize::new(0);
    let limits = Limits { refits: 10, finalists: 5 };
    let search = Search { subject: &subject, effects, limits, simulations: &simulations };
    let lost = || {
        Mistake::new("tuners", "the declared model cannot be simulated from anywhere near the start values")
            .with_help("`mops simulate` shows what happens there; start nearer to what is plausible")
    };
    watch.stage("fit of the declared model", 0.02);
    let calibrated = base::fit(&subject, options.seed, &simulations).ok_or_else(lost)?;
    let declared = search.declared(&calibrated).ok_or_else(lost)?;
    let before = search.calibrate(&declared, &[]).ok_or_else(lost)?;

    let mut rounds: Vec<Round<'_>> = Vec::new();
    let mut p_value = 1.0;
    let base = search.over_or_in_windows(&declared);
    watch.stage("where the residual comes from", 0.08);
    let scene = Scene::new(&base.fit, &base.variant.model, &base.fitted);
    let located = scene.as_ref().map_or_else(Vec::new, |scene| locate(&base.fit, &base.variant.model, scene));
    let mut current = base.clone();
    // The round after the present one, where it was looked at already.
    let mut ahead: Option<Round<'_>> = None;
    #[allow(clippy::cast_precision_loss)]
    for k in 0..options.max_effects {
        if watch.wants_stop() {
            return Err(Mistake::here("the diagnosis was interrupted"));
        }
        if current.added.len() >= options.max_effects {
            break;
        }
        watch.stage(&format!("search for effect {}", k + 1), 0.1 + 0.7 * k as f64 / options.max_effects as f64);
        let Some(round) = ahead.take().or_else(|| search.round(&current)) else { break };
        let Some(best) = round.trials.first() else { break };
        let dispersion = Dispersion::of(best);
        let worth = (best.fitted.count as f64 / dispersion.repeats).max(2.0).ln();
        let gain = criterion(&current, &dispersion) - criterion(best, &dispersion) + worth;
        let chance = by_chance(gain, round.directions);
        if k == 0 {
            // Of the screening itself: its gains are those of single directions.
            p_value = round.screened.first().map_or(1.0, |s| by_chance(s.gain, round.directions));
        }
        if chance > options.level {
            rounds.push(round);
            break;
        }
        let pairs = if k == 0 && options.max_effects > 1 && best.fitted.normalised() > UNEXPLAINED {
            watch.stage("pairs of effects", 0.3);
            search.pairs(&current, &round)
        } else {
            Vec::new()
        };
        let next = search.over_or_in_windows(best);
        // A pair is taken where it beats the best single effect with the best that can be added to it.
        if let Some(pair) = pairs.first() {
            let second = search.round(&next);
            let rival = second.as_ref().and_then(|second| second.trials.first());
            let of = Dispersion::of(pair);
            let alone = rival.map_or(f64::INFINITY, |rival| criterion(rival, &of)).min(criterion(&next, &of));
            if criterion(pair, &of) < alone - 2.0 {
                current = search.over_or_in_windows(pair);
                rounds.push(round);
                continue;
            }
            ahead = second;
        }
        current = next;
        rounds.push(round);
    }
    watch.stage("what can be left out", 0.82);
    let mut last = search.over_whole(&current).unwrap_or(current);
    if last.added.len() > 1 {
        last = search.pruned(last, options.level);
    }
    if last.added.len() > 1 && last.windows == 1 {
        // Each effect once more against its rivals, with the others in: what the ranking tells, and a chance to exchange it.
        watch.stage("each effect against its rivals", 0.86);
        let mut given = Vec::new();
        for index in 0..last.added.len() {
            let Some(without) = search.without(&last, index) else { continue };
            let Some(mut round) = search.round(&without) else { continue };
            let mut order: Vec<_> = without.added.clone();
            order.push(last.added[index].clone());
            let same = |t: &Trial<'_>| t.added.last().is_some_and(|a| a.candidate.is(&last.added[index].candidate));
            round.trials.retain(|t| !same(t));
            // The effect itself stands where the whole model ended, not where a new fit from nothing may have stopped.
            round.trials.extend(search.from(&last, &order, 10));
            let of = Dispersion::of(&last);
            round.trials.sort_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
            given.push(round);
        }
        let of = Dispersion::of(&last);
        let better = given.iter().filter_map(|round| round.trials.first());
        let better = better.min_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
        if let Some(better) = better.filter(|b| criterion(b, &of) < criterion(&last, &of) - 6.0 && b.windows == 1) {
            last = better.clone();
        }
        rounds = given;
    }
    let (mut last, held) = search.without_declared(last);
    watch.stage("the repaired model", 0.9);
    let mut after = search.calibrate(&last, &held).ok_or_else(lost)?;

    let mut notes = subject.notes.clone();
    let left = if last.fitted.normalised() > UNEXPLAINED { left(&last, &mut notes) } else { 0.0 };
    // A bad forecast counts where calibration data alone contradict what all data together want; else it only shows how
    // little they determine.
    let mistaken = !last.added.is_empty()
        && forecast(&after, &subject) > MISTAKEN
        && contradiction(&last, &after) > CONTRADICTED * after.covariance.nrows() as f64;
    let missed = left > FORETOLD || mistaken;
    let verdict = match (last.added.is_empty(), missed) {
        (_, true) => Verdict::Unexplained,
        (true, false) => Verdict::None,
        (false, false) => Verdict::Effect,
    };
    let mut unexplained = None;
    if verdict == Verdict::Unexplained {
        unexplained = located.first().and_then(Located::unexplained);
        for place in located.iter().take(2) {
            let Some((table, found)) = stopgap(&search, &base, place) else { continue };
            let Some(table) = search.over_whole(&table) else { continue };
            let Some(calibrated) = search.calibrate(&table, &[]) else { continue };
            let now = forecast(&after, &subject);
            let better = if last.added.is_empty() {
                table.fitted.chi2 < last.fitted.chi2
            } else {
                now > MISTAKEN && forecast(&calibrated, &subject) < now
            };
            if better {
                (after, last, unexplained) = (calibrated, table, Some(found));
            }
        }
    }
    let is_table = |index: &usize| last.added[*index].candidate.effect.name() == "table";
    let ranking = ranking(&rounds, &last);
    let dispersion = Dispersion::of(&last);
    let found: Vec<Found> = (0..last.added.len())
        .filter(|index| !is_table(index))
        .map(|index| found(index, &last, &after, &rounds, &ranking, &dispersion))
        .collect();
    let next_experiment = rounds.iter().zip(&found).find_map(|(round, found)| {
        let rival = found.indistinguishable.first()?;
        let trial = |t: &&Trial<'_>| {
            let last = t.added.last();
            last.is_some_and(|a| a.candidate.effect.name() == rival.effect && a.candidate.place() == rival.place)
        };
        let names =
            [format!("`{}` at {}", found.effect, found.place), format!("`{}` at {}", rival.effect, rival.place)];
        separating(round.trials.first()?, round.trials.iter().find(trial)?, [&names[0], &names[1]])
    });
    let names = |k: &usize| study.tuners[subject.globals[*k]].parameter.clone();
    let removed = held.iter().map(|k| crate::diagnosis::Removed { term: names(k), place: String::new() }).collect();
    let probability = match verdict {
        // Nothing at all was weighed among the others.
        Verdict::None => 1.0 - ranking.iter().map(|r| r.probability).sum::<f64>(),
        Verdict::Effect => found.iter().map(|f| f.probability).product(),
        Verdict::Unexplained => 0.9,
    };
    Ok(Diagnosis {
        verdict,
        probability,
        p_value,
        found,
        removed,
        ranked: ranking,
        unexplained,
        next_experiment,
        before: search.errors(&before),
        after: search.errors(&after),
        parameters: moves(&subject, &before, &after),
        noticeable: if verdict == Verdict::None { noticeable(&rounds, &subject) } else { Vec::new() },
        evidence: located.into_iter().map(|l| l.evidence).collect(),
        predictions: predictions(&subject, &before, &after),
        notes,
        starts: starts(&subject, &after),
        simulations: simulations.load(Ordering::Relaxed),
    })
}

/// By how much the sum of squares over calibration data is larger where all data were fitted than where these alone were.
fn contradiction(last: &Trial<'_>, after: &Calibrated) -> f64 {
    let own = |measurement: usize| last.fit.subject.measurements[measurement].role == Role::Calibration;
    let together = last.fit.pieces.iter().zip(&last.fitted.residuals).filter(|(piece, _)| own(piece.measurement));
    let together: f64 = together.map(|(_, residuals)| dot(residuals, residuals)).sum();
    (together - after.chi2) / after.square
}

/// By which share a free signal at the likeliest place would lower the error that a model leaves on samples left out.
fn left(last: &Trial<'_>, notes: &mut Vec<String>) -> f64 {
    let model = &last.variant.model;
    let Some(scene) = Scene::new(&last.fit, model, &last.fitted) else { return 1.0 };
    let Some(place) = locate(&last.fit, model, &scene).into_iter().next() else { return 0.0 };
    let gain = predictive_gain(&place, &last.fit, model, &scene);
    if gain > 0.0 {
        notes.push(format!(
            "{:.2} times the noise is left; a free signal at {} would lower the error on samples left out by {:.0} %",
            last.fitted.normalised(),
            place.evidence.place,
            100.0 * gain
        ));
    }
    gain
}

/// Root mean square of the normalised errors on selection data; 0 without such data.
#[allow(clippy::cast_precision_loss)]
fn forecast(after: &Calibrated, subject: &Subject) -> f64 {
    let errors = after.errors(&subject.measurements);
    let squares: Vec<f64> = errors.iter().filter(|e| e.role == Role::Selection).map(|e| e.normalised.powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Candidates by probability: those found first, then what else was fitted in each round.
fn ranking(rounds: &[Round<'_>], last: &Trial<'_>) -> Vec<Ranked> {
    let mut ranked: Vec<Ranked> = Vec::new();
    let mut seen: Vec<(String, String)> = Vec::new();
    let is_added =
        |t: &Trial<'_>| t.added.last().is_some_and(|a| last.added.iter().any(|b| a.candidate.is(&b.candidate)));
    for round in rounds {
        let Some(best) = round.trials.first() else { continue };
        // What was tried after the last effect is told by chance, and says nothing.
        let accepted = round.trials.iter().any(is_added);
        if !accepted && !last.added.is_empty() {
            continue;
        }
        let dispersion = Dispersion::of(best);
        let mut criteria: Vec<f64> = round.trials.iter().map(|t| criterion(t, &dispersion)).collect();
        if !accepted {
            // Nothing at all is a rival too, beforehand as likely as all candidates together.
            #[allow(clippy::cast_precision_loss)]
            let candidates = round.screened.len().max(1) as f64;
            criteria.push(round.before / dispersion.weight() - 2.0 * candidates.ln());
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
                bic_gain: (round.before - criterion(trial, &Dispersion::WHITE)) / dispersion.weight(),
                strengths: strengths.collect(),
                absorbed: screened.map_or(f64::NAN, |s| s.absorbed),
                normalised: [Some(trial.fitted.normalised()), None],
                fitted: true,
            });
        }
    }
    let is_found =
        |r: &Ranked| last.added.iter().any(|a| a.candidate.effect.name() == r.effect && a.candidate.place() == r.place);
    let (mut found, mut others): (Vec<Ranked>, Vec<Ranked>) = ranked.into_iter().partition(is_found);
    others.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    found.append(&mut others);
    found
}

/// What is said of an effect that was added.
fn found(
    index: usize,
    last: &Trial<'_>,
    after: &Calibrated,
    rounds: &[Round<'_>],
    ranking: &[Ranked],
    dispersion: &Dispersion,
) -> Found {
    let a = &last.added[index];
    let (effect, place) = (a.candidate.effect.as_ref(), a.candidate.place());
    let own = ranking.iter().find(|r| r.effect == effect.name() && r.place == place);
    let round = rounds
        .iter()
        .find(|round| round.trials.first().and_then(|t| t.added.last()).is_some_and(|b| b.candidate.is(&a.candidate)));
    let mut rivals = Vec::new();
    if let Some(round) = round {
        let best = &round.trials[0];
        let of = Dispersion::of(best);
        let least = criterion(best, &of);
        let screened = |t: &Trial<'_>| -> Option<&Screened> {
            let last = t.added.last()?;
            round.screened.iter().find(|s| s.added.candidate.is(&last.candidate))
        };
        let criteria: Vec<f64> = round.trials.iter().map(|t| criterion(t, &of)).collect();
        let shares = probabilities(&criteria);
        for ((trial, &value), &probability) in round.trials.iter().zip(&criteria).zip(&shares).skip(1) {
            let Some(b) = trial.added.last().filter(|_| value - least < 6.0) else { continue };
            let likeness = match (screened(best), screened(trial)) {
                (Some(x), Some(y)) => dot(&x.direction, &y.direction).abs(),
                _ => f64::NAN,
            };
            rivals.push(Rival {
                effect: b.candidate.effect.name().to_owned(),
                place: b.candidate.place(),
                probability,
                bic_behind: value - least,
                likeness,
            });
        }
    }
    let tail = place.split_once(':').map_or(place.as_str(), |(_, name)| name);
    Found {
        effect: effect.name().to_owned(),
        name: format!("{tail}-{}", effect.name()),
        companion: a.candidate.companion.as_ref().map(ToString::to_string),
        class: effect.class().name().to_owned(),
        formula: effect.formula().to_owned(),
        strengths: after.strengths(index, &last.variant, dispersion.repeats),
        probability: own.map_or(1.0, |r| r.probability),
        bic_gain: own.map_or(f64::NAN, |r| r.bic_gain),
        indistinguishable: rivals,
        place,
    }
}

/// The smallest strengths that would have been noticed, of the effects whose size is one number.
fn noticeable(rounds: &[Round<'_>], subject: &Subject) -> Vec<Noticeable> {
    let Some(round) = rounds.first() else { return Vec::new() };
    let one = |s: &Screened| {
        let candidate = &s.added.candidate;
        let strength = &candidate.effect.strengths()[0];
        let model = crate::variant::Variant::new(subject, std::slice::from_ref(&s.added));
        let parameter = &mops_core::Model::interface(model.model.as_ref()).parameters[model.first[0]];
        Some(Noticeable {
            effect: candidate.effect.name().to_owned(),
            place: candidate.place(),
            strength: StrengthValue {
                name: strength.name.to_owned(),
                value: s.noticed.filter(|n| n.is_finite())?,
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

fn moves(subject: &Subject, before: &Calibrated, after: &Calibrated) -> Vec<ParameterMove> {
    let one = |(k, &tuner): (usize, &usize)| {
        let tuner = &subject.study.tuners[tuner];
        let variance = after.covariance[(k, k)] * after.square;
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

fn predictions(subject: &Subject, before: &Calibrated, after: &Calibrated) -> Vec<Prediction> {
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

/// Start values of every experiment in the repaired model.
fn starts(subject: &Subject, after: &Calibrated) -> Vec<(String, String, f64)> {
    let of = |(m, said): (&crate::subject::Measurement, &crate::repaired::Prognosis)| {
        said.starts.iter().map(|(name, value)| (m.name.clone(), name.clone(), *value)).collect::<Vec<_>>()
    };
    subject.measurements.iter().zip(&after.experiments).flat_map(of).collect()
}
