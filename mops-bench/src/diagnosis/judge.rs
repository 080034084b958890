//! An answer beside the truth.

use mops::discrepancy::Verdict;
use mops_testbed::{Trial, TrueEffect, Truth};

use super::names::{names, strengths};
use super::plan::Kind;
use super::tool::{Answer, Named};

/// A true strength, and what was said of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Covered {
    /// Effect and strength.
    pub name: String,
    /// Its true value.
    pub truth: f64,
    /// Its value.
    pub value: f64,
    /// The interval stated.
    pub interval: [f64; 2],
}

impl Covered {
    /// Whether the interval holds the truth.
    pub fn holds(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.truth)
    }
}

/// How an answer stands beside the truth.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Judgement {
    /// The verdict is right.
    pub verdict: bool,
    /// The decision is right: the verdict, and with an effect a true one, or one that no data could tell from it, first.
    pub decision: bool,
    /// A true effect, or one that no data could tell from it, is first, at a place that is right.
    pub first: bool,
    /// A true effect is in the set of what the data cannot tell apart.
    pub in_set: bool,
    /// The place named first is right.
    pub place: bool,
    /// Both effects are found, where there are two.
    pub both: Option<bool>,
    /// Strengths of true effects that were found.
    pub covered: Vec<Covered>,
}

/// A case with the answer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// Name of the case.
    pub name: String,
    /// Its plant.
    pub plant: String,
    /// What is missing.
    pub kind: Kind,
    /// Size asked for; 0 where nothing is missing.
    pub size: f64,
    /// True effects as the catalogue calls them, and their places.
    pub truth: Vec<Named>,
    /// What the tool says, or why it says nothing.
    pub answer: Result<Answer, String>,
    /// How that stands beside the truth.
    pub judgement: Judgement,
    /// Whether each further diagnosis, with another order of the catalogue and another seed, says the same.
    pub agreeing: Vec<bool>,
}

/// Judges an answer.
pub(crate) fn judge(truth: &Truth, answer: &Answer) -> Judgement {
    let right = match truth.verdict {
        "none" => Verdict::None,
        "effect" => Verdict::Effect,
        _ => Verdict::Unexplained,
    };
    let is = |effect: &TrueEffect, named: &Named| {
        names(&effect.class, &effect.strengths).contains(&named.0.as_str()) && effect.accepted_places.contains(&named.1)
    };
    let true_one = |named: &Named| truth.effects.iter().any(|effect| is(effect, named));
    let alike = |named: &Named| {
        truth
            .equivalents
            .iter()
            .any(|(class, place)| names(class, &[]).contains(&named.0.as_str()) && *place == named.1)
    };
    let same = |named: &Named| true_one(named) || alike(named);
    let placed = |place: &String| {
        truth.effects.iter().any(|effect| effect.accepted_places.contains(place))
            || truth.equivalents.iter().any(|(_, p)| p == place)
    };
    let (verdict, first) = (answer.verdict == right, answer.first());
    let place = match answer.verdict {
        Verdict::Unexplained => answer.unexplained_at.as_ref(),
        _ => first.map(|(_, place)| place),
    };
    let found = |effect: &TrueEffect| answer.found.iter().any(|(named, _)| is(effect, named));
    let covered = answer.strengths.iter().filter_map(|(index, name, value, interval)| {
        let named = &answer.found[*index].0;
        let effect = truth.effects.iter().find(|effect| is(effect, named))?;
        let (_, truth) = strengths(effect).into_iter().find(|(known, _)| known == name)?;
        let (name, interval) = (format!("{} {name}", named.0), (*interval)?);
        truth.is_finite().then_some(Covered { name, truth, value: *value, interval })
    });
    Judgement {
        verdict,
        decision: verdict && (right != Verdict::Effect || first.is_some_and(same)),
        first: first.is_some_and(same),
        in_set: first.is_some() && answer.set.iter().any(same),
        place: place.is_some_and(placed),
        both: (truth.effects.len() > 1).then(|| verdict && truth.effects.iter().all(found)),
        covered: if verdict { covered.collect() } else { Vec::new() },
    }
}

impl Row {
    /// A case with its answer.
    pub fn new(trial: &Trial, kind: Kind, size: f64, answer: Result<Answer, String>) -> Self {
        let nothing = Judgement {
            verdict: false,
            decision: false,
            first: false,
            in_set: false,
            place: false,
            both: None,
            covered: Vec::new(),
        };
        let truth = trial.truth.effects.iter();
        let truth = truth.map(|e| {
            let name = if e.class == "unknown" { e.formula.as_str() } else { names(&e.class, &e.strengths)[0] };
            (name.to_owned(), e.place.clone())
        });
        Self {
            name: trial.name.clone(),
            plant: trial.plant.clone(),
            kind,
            size,
            truth: truth.collect(),
            judgement: answer.as_ref().map_or(nothing, |answer| judge(&trial.truth, answer)),
            answer,
            agreeing: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::answers;

    fn truth(class: &str, place: &str, verdict: &'static str) -> Truth {
        let name = place.split_once(':').unwrap().1;
        let effect = TrueEffect {
            class: class.into(),
            formula: class.into(),
            place: place.into(),
            accepted_places: vec![format!("process:{name}"), format!("joint:{name}")],
            strengths: vec![("torque".into(), 0.0125)],
        };
        Truth {
            effects: if verdict == "none" { Vec::new() } else { vec![effect] },
            verdict,
            size: 5.0,
            noise_floor: Vec::new(),
            base_parameters: Vec::new(),
            equivalents: vec![("constant-heat-gain".into(), "process:phi".into())],
        }
    }

    #[test]
    fn the_true_effect_at_its_place_is_right_and_its_strength_is_compared() {
        let answer = answers::coulomb();
        let right = judge(&truth("coulomb-friction", "joint:phi", "effect"), &answer);
        assert!(right.verdict && right.decision && right.first && right.in_set && right.place);
        assert_eq!((right.covered.len(), right.covered[0].holds()), (1, true));
        let elsewhere = judge(&truth("coulomb-friction", "joint:theta", "effect"), &answer);
        assert!(elsewhere.verdict && !elsewhere.decision && !elsewhere.place && elsewhere.covered.is_empty());
    }

    #[test]
    fn what_the_data_cannot_tell_apart_is_in_the_set_and_not_first() {
        let answer = answers::coulomb();
        let close = judge(&truth("stribeck-friction", "joint:phi", "effect"), &answer);
        assert!(!close.first && !close.decision && close.in_set && close.place);
        assert!(answer.set.len() > 1);
    }

    #[test]
    fn an_effect_named_where_nothing_is_missing_is_a_false_alarm() {
        let none = truth("", "joint:phi", "none");
        assert!(!judge(&none, &answers::coulomb()).decision);
        assert!(judge(&none, &answers::nothing()).decision);
    }

    #[test]
    fn what_no_catalogue_has_needs_the_verdict_and_the_place_is_judged_apart() {
        let answer = answers::unexplained();
        let there = judge(&truth("unknown", "joint:x", "unexplained"), &answer);
        assert!(there.decision && there.place);
        let elsewhere = judge(&truth("unknown", "joint:phi", "unexplained"), &answer);
        assert!(elsewhere.decision && !elsewhere.place);
    }
}
