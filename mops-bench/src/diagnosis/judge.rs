//! Comparison of an answer with the truth.

use mops::outcome::diagnosis::Verdict;
use mops_testbed::{Disturbance, Trial, TrueEffect, Truth};

use super::names::{class_of, coordinates, names, strengths};
use super::plan::Kind;
use super::tool::{Answer, Dependence, Named};

/// Estimated parameter of an effect, with its true value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Covered {
    /// Names of the effect and of the parameter.
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Estimate.
    pub value: f64,
    /// Reported 95 % interval.
    pub interval: [f64; 2],
}

impl Covered {
    /// Returns true if the interval contains the true value.
    pub fn covers(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.truth)
    }
}

/// Judgement of an answer.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Judgement {
    /// True if the verdict is correct.
    pub verdict: bool,
    /// True if the decision is correct: the verdict is correct and, if an effect is missing, a true effect or an
    /// equivalent one is ranked first.
    pub decision: bool,
    /// True if a true effect, or an equivalent one, is ranked first at a correct place.
    pub first: bool,
    /// True if a true effect is in the set of indistinguishable effects.
    pub in_set: bool,
    /// True if the place of the first effect is correct.
    pub place: bool,
    /// True if both of two missing effects are found; `None` if fewer than two are missing.
    pub both: Option<bool>,
    /// Estimated parameters of true effects that were found.
    pub covered: Vec<Covered>,
    /// Judgement of the statements on classes, places and coordinates.
    pub stated: Stated,
}

/// Judgement of the statements on classes, places and coordinates, whatever the verdict.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Stated {
    /// True if a true effect, or an equivalent one, is the first one found, claimed or proposed.
    pub name: bool,
    /// For each effect found: true if class and place, or others that the data cannot distinguish, are those of a true
    /// effect or of an equivalent one.
    pub entries: Vec<bool>,
    /// For each effect found: true if the class is that of a true effect or of an equivalent one, at any place.
    pub classes: Vec<bool>,
    /// For each effect found: true if it is a true effect, or an equivalent one, at its place.
    pub names: Vec<bool>,
    /// True if a true effect, or an equivalent one, is among the effects that the data cannot distinguish from the
    /// first one.
    pub in_set: bool,
    /// True if what is missing depends on the stated coordinate; `None` if none is stated, or if it depends on none.
    pub coordinate: Option<bool>,
    /// True if the place of the coordinate is right, that of a background which depends on the state included.
    pub coordinate_place: Option<bool>,
    /// True if the coordinate and its place are right.
    pub coordinate_and_place: Option<bool>,
    /// Estimated declared parameters.
    pub declared: Vec<Covered>,
}

/// Case with its answer and judgement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// Name of the case.
    pub name: String,
    /// Name of the plant.
    pub plant: String,
    /// Kind of the case.
    pub kind: Kind,
    /// Requested size; 0 if nothing is missing. For the kinds with settings: the error of the refitted nominal model,
    /// in units of the noise.
    pub size: f64,
    /// Model error in the background.
    pub background: Option<Disturbance>,
    /// True if the true effects were removed from the catalogue.
    pub is_struck_out: bool,
    /// True effects, by their names in the catalogue, and their places.
    pub truth: Vec<Named>,
    /// Answer of the tool, or the reason why there is none.
    pub answer: Result<Answer, String>,
    /// Judgement of the answer.
    pub judgement: Judgement,
    /// For each additional diagnosis, with shuffled catalogue and another seed: true if it agrees with the first.
    pub agreeing: Vec<bool>,
}

/// Compares an answer with the truth.
pub(crate) fn judge(truth: &Truth, answer: &Answer) -> Judgement {
    let right: &[Verdict] = match truth.verdict {
        "none" => &[Verdict::None],
        "effect" => &[Verdict::Effect],
        "unexplained" => &[Verdict::Unexplained],
        _ => &[Verdict::None, Verdict::Unexplained],
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
    let (verdict, first) = (right.contains(&answer.verdict), answer.first());
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
        decision: verdict && (answer.verdict != Verdict::Effect || first.is_some_and(same)),
        first: first.is_some_and(same),
        in_set: first.is_some() && answer.set.iter().any(same),
        place: place.is_some_and(placed),
        both: (truth.effects.len() > 1).then(|| verdict && truth.effects.iter().all(found)),
        covered: if verdict { covered.collect() } else { Vec::new() },
        stated: stated(truth, answer, same),
    }
}

/// Judges the statements of an answer; `same` recognises true effects and equivalent ones.
fn stated(truth: &Truth, answer: &Answer, same: impl Fn(&Named) -> bool + Copy) -> Stated {
    let of = |names: Vec<&str>| names.into_iter().filter_map(class_of).collect::<Vec<_>>();
    let mut right: Vec<(Vec<&str>, &[String])> =
        truth.effects.iter().map(|e| (of(names(&e.class, &e.strengths)), e.accepted_places.as_slice())).collect();
    right.extend(truth.equivalents.iter().map(|(class, place)| (of(names(class, &[])), std::slice::from_ref(place))));
    // A disturbance of one experiment is stated as such in place of its class.
    let is_class = |classes: &[&str], class: &str| {
        classes.iter().any(|c| *c == class || (*c == "time-varying" && class.starts_with("disturbance")))
    };
    let is_right = |class: &str, place: Option<&String>| {
        right.iter().any(|(classes, places)| is_class(classes, class) && place.is_none_or(|p| places.contains(p)))
    };
    let depends_on = answer.depends_on.as_ref();
    let effects = || truth.effects.iter().filter(|effect| !coordinates(&effect.class).is_empty());
    let repeating = truth.background.as_ref().filter(|background| background.source == "state");
    let is_over =
        |effect: &TrueEffect, found: &Dependence| coordinates(&effect.class).contains(&found.coordinate.as_str());
    let is_at = |effect: &TrueEffect, found: &Dependence| {
        found.places.iter().any(|place| effect.accepted_places.contains(place))
    };
    let of_effects = |judge: &dyn Fn(&TrueEffect, &Dependence) -> bool| {
        let found = depends_on.filter(|_| effects().next().is_some())?;
        Some(effects().any(|effect| judge(effect, found)))
    };
    let of_background = || Some(depends_on?.places.contains(&repeating?.at));
    let declared = answer.declared.iter().filter_map(|(name, value, interval)| {
        let (_, truth) = truth.base_parameters.iter().find(|(known, _)| known == name)?;
        Some(Covered { name: name.clone(), truth: *truth, value: *value, interval: (*interval)? })
    });
    let of_entries = |judge: &dyn Fn(&Named) -> bool| -> Vec<bool> {
        answer.statements.iter().map(|statement| statement.entries.iter().any(judge)).collect()
    };
    Stated {
        name: answer.found.first().is_some_and(|(named, _)| same(named)),
        entries: of_entries(&|(class, place)| is_right(class, Some(place))),
        classes: of_entries(&|(class, _)| is_right(class, None)),
        names: answer.found.iter().map(|(named, _)| same(named)).collect(),
        in_set: answer.set.iter().any(same),
        coordinate: of_effects(&is_over),
        coordinate_place: of_effects(&is_at).or_else(of_background),
        coordinate_and_place: of_effects(&|effect, found| is_over(effect, found) && is_at(effect, found)),
        declared: declared.collect(),
    }
}

impl Row {
    /// Creates the row of a case from its answer.
    pub fn new(trial: &Trial, kind: Kind, size: f64, answer: Result<Answer, String>) -> Self {
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
            background: trial.truth.background.clone(),
            is_struck_out: false,
            truth: truth.collect(),
            judgement: answer.as_ref().map(|answer| judge(&trial.truth, answer)).unwrap_or_default(),
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
            background: None,
            equivalents: vec![("constant-heat-gain".into(), "process:phi".into())],
        }
    }

    #[test]
    fn the_true_effect_at_its_place_is_correct_and_its_parameters_are_compared() {
        let answer = answers::coulomb();
        let right = judge(&truth("coulomb-friction", "joint:phi", "effect"), &answer);
        assert!(right.verdict && right.decision && right.first && right.in_set && right.place);
        assert_eq!((right.covered.len(), right.covered[0].covers()), (1, true));
        let elsewhere = judge(&truth("coulomb-friction", "joint:theta", "effect"), &answer);
        assert!(elsewhere.verdict && !elsewhere.decision && !elsewhere.place && elsewhere.covered.is_empty());
    }

    #[test]
    fn an_indistinguishable_effect_is_in_the_set_and_not_first() {
        let answer = answers::coulomb();
        let close = judge(&truth("stribeck-friction", "joint:phi", "effect"), &answer);
        assert!(!close.first && !close.decision && close.in_set && close.place);
        assert!(answer.set.len() > 1);
    }

    #[test]
    fn an_effect_found_in_a_complete_model_is_a_false_alarm() {
        let none = truth("", "joint:phi", "none");
        assert!(!judge(&none, &answers::coulomb()).decision);
        assert!(judge(&none, &answers::nothing()).decision);
    }

    #[test]
    fn a_statement_is_right_if_one_of_its_entries_is_that_of_the_truth() {
        let mut answer = answers::coulomb();
        let friction = truth("coulomb-friction", "joint:phi", "effect");
        let right = judge(&friction, &answer).stated;
        assert!(right.name && right.in_set && right.entries == [true] && right.classes == [true]);
        // Constant heat gains are equivalent and have another class.
        answer.statements[0].entries = vec![("bias".into(), "process:phi".into())];
        assert_eq!(judge(&friction, &answer).stated.entries, [true]);
        answer.statements[0].entries = vec![("elastic".into(), "joint:phi".into())];
        let wrong = judge(&friction, &answer).stated;
        assert!(wrong.name && wrong.entries == [false] && wrong.classes == [false]);
        answer.statements[0].entries.push(("dissipative".into(), "joint:theta".into()));
        let elsewhere = judge(&friction, &answer).stated;
        assert!(elsewhere.entries == [false] && elsewhere.classes == [true]);
    }

    #[test]
    fn a_coordinate_is_judged_with_its_place_where_what_is_missing_has_one() {
        let mut answer = answers::unexplained();
        let over = |coordinate: &str, place: &str| {
            Some(Dependence { coordinate: coordinate.into(), places: vec![place.into()] })
        };
        let friction = truth("coulomb-friction", "joint:phi", "effect");
        assert_eq!(judge(&friction, &answer).stated.coordinate, None);
        for (coordinate, place, right, right_place) in [
            ("speed", "joint:phi", true, true),
            ("speed", "joint:theta", true, false),
            ("input", "joint:phi", false, true),
        ] {
            answer.depends_on = over(coordinate, place);
            let stated = judge(&friction, &answer).stated;
            assert_eq!((stated.coordinate, stated.coordinate_place), (Some(right), Some(right_place)));
            assert_eq!(stated.coordinate_and_place, Some(right && right_place));
        }
        // A bias has no coordinate; a background that depends on the state has a place only.
        assert_eq!(judge(&truth("sensor-bias", "joint:phi", "effect"), &answer).stated.coordinate_place, None);
        let mut repeating = truth("", "joint:phi", "none");
        let background = Disturbance { source: "state", at: "joint:phi".into(), share: 0.1, ratio: 20.0, time: None };
        repeating.background = Some(background);
        let stated = judge(&repeating, &answer).stated;
        assert_eq!((stated.coordinate, stated.coordinate_place), (None, Some(true)));
    }

    #[test]
    fn with_only_a_background_any_verdict_but_an_effect_is_right() {
        let background = truth("", "joint:phi", "none");
        let background = Truth { verdict: "none or unexplained", ..background };
        assert!(
            judge(&background, &answers::nothing()).decision && judge(&background, &answers::unexplained()).decision
        );
        assert!(!judge(&background, &answers::coulomb()).decision);
    }

    #[test]
    fn an_effect_not_in_the_catalogue_needs_the_verdict_and_its_place_is_judged_separately() {
        let answer = answers::unexplained();
        let there = judge(&truth("unknown", "joint:x", "unexplained"), &answer);
        assert!(there.decision && there.place);
        let elsewhere = judge(&truth("unknown", "joint:phi", "unexplained"), &answer);
        assert!(elsewhere.decision && !elsewhere.place);
    }
}
