//! The report of a search: from sets of effects and a verdict to a diagnosis.

mod candidates;
mod next_experiment;
mod parameters;
mod records;
mod removed;

use std::collections::BTreeMap;

use mops_core::{Role, effect::Port};
use mops_math as math;
use mops_outcome::diagnosis::{
    Alignment, Change, Dependence, Diagnosis, ExperimentError, ForecastOf, Found, HeldOut, LatentInput, Noticeable,
    Step, StrengthValue, Unexplained, Verdict, WiderRange, WiderRanges,
};

use self::records::Records;
use crate::estimation::CLEARLY;
use crate::fit::Added;
use crate::latent::latent_inputs;
use crate::selection::{
    Conclusion, FittedSet, FittedSets, Forecasts, Key, Stated, Verdict as Decision, WORSE, entry, price, without,
};

/// Ratio from which the noise of a sensor is another than the study has, and error of a held-out record from which a
/// verdict is not sure, noises. Basis: the studies.
const WRONG_NOISE: f64 = 1.5;

/// Sets of effects with the verdict.
pub struct Findings<'r, 'a> {
    /// Declared model without the effects that the study gives.
    pub nominal: FittedSet<'a>,
    /// Recorded inputs that act at other times than the study says.
    pub alignment: Vec<Alignment>,
    /// Free curves on the declared model, the one with the largest gain first.
    pub curves: Vec<Dependence>,
    /// Sets of effects.
    pub sets: FittedSets<'r, 'a>,
    /// Forecasts of the sets that were tested.
    pub forecasts: Forecasts,
    /// Verdict.
    pub verdict: Decision,
    /// True if the search was stopped before its end.
    pub is_stopped: bool,
}

impl<'a> Findings<'_, 'a> {
    /// Returns the diagnosis.
    pub fn diagnosis(&self) -> Diagnosis {
        let Self { sets, verdict, .. } = self;
        let nothing = Key::new();
        let chosen = if verdict.conclusion == Conclusion::None { &nothing } else { &verdict.set };
        let declared = self.better_declared().unwrap_or(&self.nominal);
        let set = sets.get(chosen).expect("a set that passed was fitted");
        let (set, terms) = sets.refit.without_terms(set);
        let set = &set;
        let (before, after) = (Records::new(declared), Records::new(set));

        let mut made = Diagnosis::default();
        made.alignment.clone_from(&self.alignment);
        made.verdict = match verdict.conclusion {
            Conclusion::Effect => Verdict::Effect,
            Conclusion::Unexplained => Verdict::Unexplained,
            Conclusion::None => Verdict::None,
        };
        made.found = (0..set.added.len()).map(|index| self.found(set, index)).collect();
        made.removed = removed::removed(sets, declared, &terms);
        made.probability = self.probability(&made.found);
        // Twice the log-likelihood ratio is chi-squared with two degrees of freedom.
        made.p_value = math::exp(-verdict.lack_of_fit).min(1.0);
        made.depends_on = self.significant(&self.curves);
        made.remaining = self.significant(&verdict.remaining).filter(|_| !set.key.is_empty());
        made.forecast_of =
            if self.forecasts.are_of_other_records() { ForecastOf::Selection } else { ForecastOf::EndOfRecords };
        made.is_first = verdict.is_first || verdict.conclusion == Conclusion::None;
        made.named_by = verdict.named_by;
        made.wider = self.wider().filter(|_| verdict.is_range);
        made.is_stopped = self.is_stopped;
        made.converged = set.least_squares.converged;
        let aligned = sets.get(&nothing).filter(|_| !self.alignment.is_empty()).map(Records::new);
        made.explained_share =
            explained_share(aligned.as_ref().unwrap_or(&before), &after).filter(|_| !set.added.is_empty());
        if made.verdict == Verdict::Unexplained {
            made.unexplained = made.depends_on.as_ref().map(unexplained);
        }
        made.ranked = self.ranked();
        made.next_experiment = self.next_experiment(sets.get(chosen).unwrap_or(set));
        made.steps = self.steps();
        made.before = before.errors();
        made.after = after.errors();
        made.parameters = before.moves(&after);
        if made.verdict == Verdict::None {
            made.noticeable = self.noticeable();
        }
        made.places = first_of_each(self.curves.clone(), |curve| curve.place.clone());
        made.latent = self.latent([sets.declared(), sets.get(chosen).unwrap_or(set)], &made);
        made.predictions = before.predictions(&after);
        let names: Vec<String> = made.found.iter().map(|found| found.name.clone()).collect();
        made.starts = after.starts(&names);
        let notes = sets.refit.subject.all_notes().into_iter();
        let at_bounds = before.at_bounds(&after, &terms);
        made.is_sure = !after.is_at_bound(&terms) && self.is_sure(&made);
        made.notes = notes.chain(at_bounds).chain(self.notes(set, &made)).collect();
        made.simulations = sets.refit.simulations.count();
        made
    }

    /// Returns the declared model at a better optimum than that of its first fit, if the search found one.
    fn better_declared(&self) -> Option<&FittedSet<'a>> {
        let found = self.sets.get(&Key::new()).filter(|set| set.added.is_empty() && self.alignment.is_empty())?;
        let first = self.nominal.least_squares.log_likelihood;
        (found.least_squares.log_likelihood > first + WORSE).then_some(found)
    }

    /// Returns the ranges that the declared model leaves where they are wider.
    fn wider(&self) -> Option<WiderRanges> {
        let (refit, subject) = (self.sets.refit, self.sets.refit.subject);
        let widened = refit.widened.as_ref()?;
        let range = |&(k, end, value): &(usize, f64, f64)| {
            let tuner = &subject.study.tuners()[subject.globals[k]];
            WiderRange { parameter: tuner.name.clone(), unit: tuner.unit.to_string(), end, value }
        };
        Some(WiderRanges { ranges: widened.moved.iter().map(range).collect(), error: widened.error })
    }

    /// Returns the curve with the largest gain if it is significant.
    fn significant(&self, curves: &[Dependence]) -> Option<Dependence> {
        let fires = self.sets.refit.subject.settings.fires;
        curves.first().filter(|curve| curve.gain >= fires).cloned()
    }

    /// Returns a note if the first fit of the declared model ended in a worse optimum than the search found.
    fn other_optimum(&self) -> Option<String> {
        let (declared, subject) = (self.better_declared()?, self.sets.refit.subject);
        let value = |(&k, value): (&usize, &f64)| {
            let tuner = &subject.study.tuners()[k];
            let short = format!("{value:.3e}").parse().unwrap_or(*value);
            format!("{} = {}", tuner.name, tuner.unit.amount(short))
        };
        let values: Vec<String> =
            subject.globals.iter().zip(&declared.least_squares.point.globals).map(value).collect();
        let values = values.join(", ");
        Some(format!("the first fit of the declared model ended in a worse optimum: start at {values}"))
    }

    /// Returns true if nothing speaks against the verdict.
    fn is_sure(&self, made: &Diagnosis) -> bool {
        let is_supported = match made.verdict {
            Verdict::Effect => {
                made.is_first
                    && !self.verdict.is_contradicted
                    && made.found.iter().all(|found| found.claimed || found.given)
                    && made.explains_most()
            }
            Verdict::None => true,
            Verdict::Unexplained => false,
        };
        let is_held_out = |error: &&ExperimentError| error.role != Role::Calibration;
        let is_close = made.after.iter().filter(is_held_out).all(|error| error.normalised <= WRONG_NOISE);
        is_supported && is_close && made.converged && !made.is_stopped
    }

    /// Returns the probability of the verdict: of class and place of the least certain claim, or that nothing is
    /// missing; NaN if something is missing that is not explained.
    fn probability(&self, found: &[Found]) -> f64 {
        match self.verdict.conclusion {
            Conclusion::Effect => {
                let claimed = found.iter().filter(|found| found.claimed).map(|found| found.class_probability);
                claimed.fold(1.0, f64::min)
            }
            Conclusion::None => self.verdict.nothing * (1.0 - self.sets.refit.subject.settings.other),
            Conclusion::Unexplained => f64::NAN,
        }
    }

    /// Returns the posterior probability that an effect is missing; NaN if no set that holds it passed, more is missing
    /// than what these describe, or something else than the probability of its class decides against a claim.
    fn probability_of(&self, index: usize) -> f64 {
        let entry = entry(&self.sets, &self.sets.refit.candidates[index]);
        let is_unstated = |stated: &Stated| stated.entry == entry && stated.probability.is_nan();
        let is_open = self.verdict.is_refused || self.verdict.is_description;
        if is_open || self.verdict.stated.iter().any(is_unstated) {
            return f64::NAN;
        }
        let holding: Vec<f64> =
            self.verdict.passed.iter().filter(|(key, _)| key.contains(&index)).map(|(_, weight)| *weight).collect();
        if holding.is_empty() {
            f64::NAN
        } else {
            holding.iter().sum::<f64>() * (1.0 - self.sets.refit.subject.settings.other)
        }
    }

    fn found(&self, set: &FittedSet<'a>, index: usize) -> Found {
        let (sets, added) = (&self.sets, &set.added[index]);
        let (effect, place) = (added.candidate.effect.as_ref(), added.candidate.place());
        let position = added.candidate.index;
        let entry = entry(sets, &added.candidate);
        let stated = self.verdict.stated.iter().find(|stated| stated.entry == entry);
        let smaller = set.key.iter().position(|k| *k == position).and_then(|k| sets.get(&without(&set.key, k)));
        // The set was fitted with all declared terms.
        let fitted = sets.get(&set.key).unwrap_or(set);
        Found {
            effect: effect.name().to_owned(),
            name: name(set, index),
            companion: added.candidate.companion.as_ref().map(ToString::to_string),
            only: added.candidate.only.map(|only| sets.refit.subject.measurements[only].name.clone()),
            class: effect.class().name().to_owned(),
            formula: effect.formula().to_owned(),
            strengths: parameters::strengths(set, index),
            given: !set.key.contains(&position),
            probability: self.probability_of(position),
            class_probability: stated.map_or(f64::NAN, |stated| stated.probability),
            alike: stated.map_or_else(Vec::new, |stated| {
                stated.alike.iter().map(|entry| format!("{} at {}", entry.class, entry.place)).collect()
            }),
            claimed: self.verdict.conclusion == Conclusion::Effect && stated.is_some_and(|stated| stated.is_claimed),
            bic_gain: smaller.map_or(f64::NAN, |smaller| 2.0 * (fitted.log_evidence() - smaller.log_evidence())),
            indistinguishable: self.rivals(fitted, position),
            held_out: if set.key.len() > 1 { self.held_out(set, smaller) } else { Vec::new() },
            place,
        }
    }

    /// Returns the errors on held-out records with and without an effect.
    fn held_out(&self, set: &FittedSet<'a>, smaller: Option<&FittedSet<'a>>) -> Vec<HeldOut> {
        let Some(smaller) = smaller else { return Vec::new() };
        let of = |role| {
            let error = |set: &FittedSet<'a>| Forecasts::error_on(set, role);
            Some(HeldOut { role, without: error(smaller)?, with: error(set)? })
        };
        [Role::Selection, Role::Validation].into_iter().filter_map(of).collect()
    }

    /// Returns the experiment that would best separate the set from the most probable one with other classes or places,
    /// or from the first alternative at the same place.
    fn next_experiment(&self, set: &FittedSet<'a>) -> Option<String> {
        let entries = |set: &FittedSet<'a>| {
            let mut all: Vec<_> = set.added.iter().map(|added| entry(&self.sets, &added.candidate)).collect();
            all.sort();
            all
        };
        let is_rival = |other: &&FittedSet<'a>| {
            !other.key.is_empty() && other.key != set.key && other.key.len() <= set.key.len().max(1)
        };
        let rivals: Vec<&FittedSet<'a>> = self.sets.sets.iter().filter(is_rival).collect();
        let own = entries(set);
        let apart = rivals.iter().find(|other| entries(other) != own);
        let rival = apart.into_iter().chain(rivals.first()).next()?;
        if set.key.is_empty() {
            return None;
        }
        let names = |set: &FittedSet<'a>, other: &FittedSet<'a>| {
            let of = |added: &Added| format!("`{}` at {}", added.candidate.effect.name(), added.candidate.place());
            let is_common =
                |added: &&Added| other.added.iter().any(|same| same.candidate.index == added.candidate.index);
            let own: Vec<String> = set.added.iter().filter(|added| !is_common(added)).map(of).collect();
            if own.is_empty() { "the model without it".to_owned() } else { own.join(" with ") }
        };
        next_experiment::separating(set, rival, [&names(set, rival), &names(rival, set)])
    }

    /// Returns the course of what is missing at the places of the effects found; without any, but with a lack of fit,
    /// at the place with the largest gain. `sets` are the declared model and a repaired one.
    fn latent(&self, sets: [&FittedSet<'a>; 2], made: &Diagnosis) -> Vec<LatentInput> {
        let at_effects = sets[1].added.iter().map(|added| added.candidate.place());
        let is_open = sets[1].added.is_empty() && made.verdict != Verdict::None;
        let first = made.places.first().filter(|_| is_open).map(|curve| curve.place.clone());
        let wanted: Vec<String> = at_effects.chain(first).collect();
        let ports = &self.sets.refit.subject.model.interface().ports;
        let ports: Vec<&Port> = ports.iter().filter(|port| wanted.contains(&port.to_string())).collect();
        latent_inputs(&ports, sets, &self.sets.refit.nominal)
    }

    /// Returns the sets that were the most probable one after the other.
    fn steps(&self) -> Vec<Step> {
        let mut last: Key = Key::new();
        let mut steps = Vec::new();
        for key in &self.sets.history {
            let Some(set) = self.sets.get(key) else { continue };
            let contains = |larger: &Key, smaller: &Key| smaller.iter().all(|k| larger.contains(k));
            let did = match () {
                () if contains(key, &last) => Change::Added,
                () if contains(&last, key) => Change::Eliminated,
                () if key.len() == last.len() && key.iter().any(|k| last.contains(k)) => Change::Swapped,
                () if key.len() < last.len() => Change::Substituted,
                () => Change::Restarted,
            };
            let of = |added: &Added| format!("{} at {}", added.candidate.effect.name(), added.candidate.place());
            let effects = set.added.iter().map(of).collect();
            steps.push(Step { did, effects, normalised: set.error().unwrap_or(f64::NAN) });
            last.clone_from(key);
        }
        steps
    }

    /// Returns the detection limits of the effects that are linear in their first parameter and no special events.
    fn noticeable(&self) -> Vec<Noticeable> {
        let sets = &self.sets;
        let needed: f64 = (2.0_f64 * (price(sets.refit.candidates.len()) + CLEARLY)).sqrt();
        let of = |screened: &crate::selection::Screened| {
            let added = &screened.guesses[0];
            let strengths = parameters::of_candidate(sets.refit.subject, added);
            let first = strengths.into_iter().next()?;
            Some(Noticeable {
                effect: added.candidate.effect.name().to_owned(),
                place: added.candidate.place(),
                strength: StrengthValue { value: screened.detectable.filter(|d| d.is_finite())? * needed, ..first },
            })
        };
        let usual = sets.screened.iter().filter(|s| s.guesses[0].candidate.effect.rarity() == 0);
        let mut all: Vec<Noticeable> = usual.filter_map(of).collect();
        all.sort_by(|a, b| a.place.cmp(&b.place));
        all
    }

    fn notes(&self, set: &FittedSet<'a>, made: &Diagnosis) -> Vec<String> {
        let mut notes = Vec::new();
        if self.is_stopped {
            notes.push("the search was stopped: sets of effects that were not fitted may explain more".to_owned());
        }
        if !made.converged {
            notes.push("a fit by least squares did not converge".to_owned());
        }
        if made.forecast_of == ForecastOf::EndOfRecords {
            notes.push(
                "no selection record: forecasts were tested on the ends of the calibration records only".to_owned(),
            );
        }
        notes.extend(self.other_optimum());
        if self.verdict.is_contradicted {
            notes.push("selection records contradict the model with the effects found: more is missing".to_owned());
        }
        if made.verdict == Verdict::Effect && !made.is_first {
            notes.push("a set of higher evidence forecasts worse than a smaller one".to_owned());
        }
        notes.extend(wrong_noise(set));
        if let Some((_, likeliest)) = set.likeliest() {
            for (k, moved) in made.parameters.iter().enumerate() {
                let apart = (likeliest.point.globals[k] - moved.after).abs();
                if moved.std_error.is_some_and(|error| apart > CLEARLY * error) {
                    notes.push(format!("the model still lacks something that moves `{}`", moved.name));
                }
            }
        }
        notes
    }
}

/// Returns notes on sensors whose noise is another than the study has.
fn wrong_noise(set: &FittedSet<'_>) -> Vec<String> {
    let wrong = set.noises().into_iter().filter(|(_, ratio)| math::ln(*ratio).abs() > math::ln(WRONG_NOISE));
    wrong.map(|(signal, ratio)| format!("the noise of `{signal}` is about {ratio:.2} times its noise level")).collect()
}

/// Returns the name of an effect in the augmented model.
fn name(set: &FittedSet<'_>, index: usize) -> String {
    let added = &set.added[index];
    let (effect, place) = (added.candidate.effect.as_ref(), added.candidate.place());
    let tail = place.split_once(':').map_or(place.as_str(), |(_, name)| name);
    // A gust in another experiment, say.
    let namesakes = set.added[..index].iter().filter(|other| other.candidate.is_named(effect.name(), &place));
    match namesakes.count() {
        0 => format!("{tail}-{}", effect.name()),
        before => format!("{tail}-{}-{}", effect.name(), before + 1),
    }
}

fn unexplained(curve: &Dependence) -> Unexplained {
    Unexplained { place: curve.place.clone(), over: curve.coordinate.clone(), table: curve.curve.clone() }
}

/// Returns the share of the squared error of the declared model that a repaired one removes from validation records,
/// else from selection records.
fn explained_share(before: &Records<'_, '_>, after: &Records<'_, '_>) -> Option<f64> {
    let share = |role| {
        let [before, after] = [before, after].map(|records| records.sum_of_squares(role));
        Some(1.0 - after? / before?).filter(|share| share.is_finite())
    };
    share(Role::Validation).or_else(|| share(Role::Selection))
}

/// Returns for each key the value that comes first.
fn first_of_each<K: Ord, T>(all: Vec<T>, key: impl Fn(&T) -> K) -> Vec<T> {
    let mut seen: BTreeMap<K, ()> = BTreeMap::new();
    all.into_iter().filter(|value| seen.insert(key(value), ()).is_none()).collect()
}
