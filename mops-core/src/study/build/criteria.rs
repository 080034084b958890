//! Criteria in their cases, and their demands.

use std::sync::Arc;

use mops_language::{Quantity, Unit, suggestion};

use super::jobs::job;
use super::models::Models;
use super::values::converted;
use crate::case::Case;
use crate::criterion::{BindContext, Criterion, CriterionSpec, Demand, InUnit, Other, Sense, Usage};
use crate::model::AnalysisKind;
use crate::study::draft::CriterionBuilder;
use crate::study::{Row, Study, StudyError, matches_pattern};

pub(super) fn add_rows(study: &mut Study, name: &str, draft: CriterionBuilder) -> Result<(), StudyError> {
    let model = match &draft.model {
        Some(model) => study.models.iter().position(|(n, _)| n == model).ok_or_else(|| {
            StudyError::new("model", format!("the study has no model `{model}`"))
                .with_help(suggestion(model, study.models.iter().map(|(n, _)| n.as_str())))
        })?,
        None if study.models.len() == 1 => 0,
        None => {
            let known: Vec<String> = study.models.iter().map(|(name, _)| format!("model = \"{name}\"")).collect();
            return Err(StudyError::here("the study has several models: the criterion needs `model`")
                .with_help(format!("add {}", known.join(" or "))));
        }
    };
    let interface = study.models[model].1.interface();
    let reads = draft.criterion.reads().unwrap_or(interface.analysis);
    check_sort(reads, interface.analysis, &study.models, model)?;
    let others = others(study, model, draft.criterion.as_ref());
    let window = window(&draft, reads)?;
    let bound = draft.criterion.bind_in(interface, &BindContext { others: &others, window });
    let criterion = bound.map_err(|mistake| match draft.kind {
        Some(kind) => mistake.within(kind),
        None => mistake,
    })?;
    // Bare numbers are in the unit that the study states for the criterion, or else in that of its kind.
    let bare = draft.unit.clone().unwrap_or_else(|| criterion.unit());
    let criterion = in_unit(criterion, &draft)?;
    let criterion: Arc<dyn Criterion> = Arc::from(criterion);
    let unit = criterion.unit();
    let demand = demand(&draft, &bare, &unit, criterion.as_ref())?;
    if let Some(assumption) = criterion.assumption() {
        study.notes.push(format!("`{name}`: {assumption}"));
    }
    if !(draft.weight.is_finite() && draft.weight > 0.0) {
        return Err(StudyError::new("weight", format!("a weight must be positive, not {}", draft.weight))
            .with_help("usage = \"monitor\" keeps a criterion out of the objective"));
    }
    let mut cases = cases_of(study, &draft, reads)?;
    for (name, _) in &others {
        let has_other = |case: &usize| {
            let is_other = |row: &Row| row.name == *name && study.jobs[row.job].model == model;
            study.rows.iter().any(|row| is_other(row) && study.jobs[row.job].case == *case)
        };
        if let (Some(case), true) = (cases.iter().find(|case| !has_other(case)), draft.cases.is_some()) {
            let fact = format!("`{name}` is not evaluated in case `{}`", study.cases[*case].name);
            return Err(StudyError::new("cases", fact).with_help("list cases in which it is"));
        }
        cases.retain(has_other);
    }
    for case in cases {
        criterion.suits(&study.cases[case])?;
        let job = job(study, model, case, &criterion.signals())?;
        let interface = study.models[model].1.interface();
        let end = study.cases[case].horizon.or(interface.horizon).unwrap_or(f64::INFINITY);
        if let Some([from, _]) = window.filter(|[from, _]| *from >= end) {
            let case = &study.cases[case].name;
            let fact =
                format!("`from` at {from} s is not before the end of the simulation at {end} s in case `{case}`");
            let help = "give an earlier time, a longer `horizon`, or the cases for which it applies in `cases`";
            return Err(StudyError::new("from", fact).with_help(help));
        }
        if let Some([_, until]) = window.filter(|[_, until]| until.is_finite() && *until > end * (1.0 + SAME)) {
            let case = &study.cases[case].name;
            let fact = format!("`until` at {until} s is after the end of the simulation at {end} s in case `{case}`");
            let help = "omit it to read up to the end, or give a longer `horizon`, or the cases for which it applies in `cases`";
            return Err(StudyError::new("until", fact).with_help(help));
        }
        study.rows.push(Row {
            name: name.to_owned(),
            job,
            criterion: Arc::clone(&criterion),
            usage: draft.usage,
            demand,
            reversed: false,
            weight: draft.weight,
            unit: unit.clone(),
        });
    }
    Ok(())
}

/// Relative difference of two times that rounding explains.
const SAME: f64 = 1e-9;

/// Returns the criteria of the model that a criterion refers to.
fn others(study: &Study, model: usize, of: &dyn CriterionSpec) -> Vec<Other> {
    let find = |name: String| {
        let row = study.rows.iter().find(|row| row.name == name && study.jobs[row.job].model == model)?;
        Some((name, Arc::clone(&row.criterion)))
    };
    of.names().into_iter().filter_map(find).collect()
}

/// Returns start and end of the part of the simulation that a criterion reads, s, if the study restricts it.
fn window(draft: &CriterionBuilder, reads: AnalysisKind) -> Result<Option<[f64; 2]>, StudyError> {
    let second = Unit::known("s");
    let time = |key: &str, given: &Option<Quantity>| {
        given.as_ref().map(|given| converted(given, &second).map_err(|m| m.within(key))).transpose()
    };
    let (from, until) = (time("from", &draft.from)?, time("until", &draft.until)?);
    if from.is_none() && until.is_none() {
        return Ok(None);
    }
    if reads == AnalysisKind::Linear {
        let key = if from.is_some() { "from" } else { "until" };
        return Err(StudyError::new(key, "a linear system has no times").with_help(format!("remove `{key}`")));
    }
    let (from, until) = (from.unwrap_or(0.0), until.unwrap_or(f64::INFINITY));
    if from.is_nan() || from < 0.0 {
        let fact = format!("`from` is at {from} s, before the start of the simulation");
        return Err(StudyError::new("from", fact).with_help("give a time from 0 s on"));
    }
    if until.is_nan() || until <= from {
        let fact = format!("`until` at {until} s is not after `from` at {from} s");
        return Err(StudyError::new("until", fact).with_help("give a later time"));
    }
    Ok(Some([from, until]))
}

/// Converts a criterion to the unit in which the study asks.
fn in_unit(criterion: Box<dyn Criterion>, draft: &CriterionBuilder) -> Result<Box<dyn Criterion>, StudyError> {
    if let Some(unit) = draft.unit.as_ref() {
        let fail = |why| StudyError::new("unit", why).with_help("give a unit of the same dimension");
        return Ok(Box::new(InUnit::new(criterion, unit).map_err(fail)?));
    }
    let asked = [&draft.demand, &draft.bad, &draft.good].into_iter().flatten().find_map(|q| q.unit.as_ref());
    let own = criterion.unit();
    // Another dimension and an ambiguous unit are refused with the demand; a temperature on another scale is converted
    // with it.
    let is_certain = |unit: &&Unit| {
        unit.is_compatible(&own) && unit.zero() == own.zero() && unit.ambiguity_in(&own).is_none()
            // Angles and other pure numbers are refused with the demand, too.
            && !(own.dimension().is_none() && own.is_angle() != unit.is_angle())
    };
    // Hz beside rad/s is only known to contradict 1/s if the answer is in rad/s.
    let is_other = |unit: &&Unit| **unit != own || (unit.is_angle() && !own.is_angle());
    match asked.filter(is_other).filter(is_certain) {
        Some(unit) => Ok(Box::new(InUnit::new(criterion, unit).map_err(StudyError::here)?)),
        None => Ok(criterion),
    }
}

/// Rejects a criterion for a model whose analyses it cannot read.
fn check_sort(reads: AnalysisKind, gives: AnalysisKind, models: &Models, model: usize) -> Result<(), StudyError> {
    if reads == gives {
        return Ok(());
    }
    let name = &models[model].0;
    let fact = match gives {
        AnalysisKind::Time => format!("this criterion reads a linear system, but `{name}` is simulated over time"),
        AnalysisKind::Linear => format!("this criterion reads a simulation over time, but `{name}` is a linear system"),
    };
    let other = models.iter().find(|(_, model)| model.interface().analysis == reads);
    let way_out = match (other, reads) {
        (Some((other, _)), _) => format!("choose another model: model = \"{other}\""),
        (None, AnalysisKind::Linear) => {
            "add a linear model: `linearise = { ... }` next to the kind linearises a simulated model".to_owned()
        }
        (None, AnalysisKind::Time) => "add a model that is simulated".to_owned(),
    };
    Err(StudyError::here(fact).with_help(way_out))
}

fn cases_of(study: &Study, draft: &CriterionBuilder, reads: AnalysisKind) -> Result<Vec<usize>, StudyError> {
    let measures = |case: &Case| match (draft.criterion.needs_measurement(), &case.experiment, reads) {
        (Some(signal), Some(experiment), AnalysisKind::Time) => experiment.channel(signal).is_some(),
        (Some(signal), Some(experiment), AnalysisKind::Linear) => experiment.response(signal).is_some(),
        (Some(_), None, _) => false,
        // Experiments with frequency responses only are not simulated over time.
        (None, Some(experiment), AnalysisKind::Time) => !experiment.channels.is_empty(),
        (None, ..) => true,
    };
    let signal = draft.criterion.needs_measurement().unwrap_or_default();
    let way_out = match (reads, signal) {
        (_, "") => "list cases without frequency responses, or experiments with `channels`".to_owned(),
        (AnalysisKind::Time, _) => format!("list experiments with `{signal}` among their `channels`"),
        (AnalysisKind::Linear, _) => format!("list experiments with `{signal}` among their `responses`"),
    };
    let chosen: Vec<usize> = match &draft.cases {
        None => (0..study.cases.len()).filter(|&i| measures(&study.cases[i])).collect(),
        Some(wanted) => {
            let mut chosen: Vec<usize> = Vec::new();
            for name in wanted {
                let found = named(study, name).map_err(|mistake| mistake.within("cases"))?;
                // A pattern chooses among the cases that the criterion can read.
                let able: Vec<usize> = found.iter().copied().filter(|&case| measures(&study.cases[case])).collect();
                if able.is_empty() {
                    let fact = match signal {
                        "" => {
                            format!("`{name}` has frequency responses only and is not simulated over time")
                        }
                        signal => format!("`{name}` does not measure `{signal}`"),
                    };
                    return Err(StudyError::new(name, fact).with_help(way_out.clone()).within("cases"));
                }
                chosen.extend(able.into_iter().filter(|case| !chosen.contains(case)).collect::<Vec<_>>());
            }
            chosen
        }
    };
    if chosen.is_empty() {
        let help = match reads {
            AnalysisKind::Time => "add it to the `channels` of an experiment",
            AnalysisKind::Linear => "add it to the `responses` of an experiment with `frequency`",
        };
        return Err(match signal {
            "" => StudyError::here("no case is simulated over time: all have frequency responses only")
                .with_help("add a case under [cases]"),
            signal => StudyError::new("signal", format!("no experiment measures `{signal}`")).with_help(help),
        });
    }
    Ok(chosen)
}

/// Returns the cases with a name, or whose names match a pattern.
fn named(study: &Study, name: &str) -> Result<Vec<usize>, StudyError> {
    let found: Vec<usize> =
        (0..study.cases.len()).filter(|&case| matches_pattern(name, &study.cases[case].name)).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let all = study.cases.iter().map(|c| c.name.as_str());
    let fact = match name.contains('*') {
        true => format!("no case matches `{name}`"),
        false => format!("the study has no case `{name}`"),
    };
    Err(StudyError::new(name, fact).with_help(suggestion(name, all)))
}

/// Returns the demand of a criterion in its unit, checked against the sense and the range of its kind. Numbers without
/// a unit are in `bare`.
fn demand(draft: &CriterionBuilder, bare: &Unit, unit: &Unit, criterion: &dyn Criterion) -> Result<Demand, StudyError> {
    let value = |key: &str, given: &Option<Quantity>| {
        given.as_ref().map_or(Ok(()), |q| refuse_mixed_angles(key, q, unit))?;
        let in_unit = |q: &Quantity| match q.unit {
            None if bare != unit => Quantity { unit: Some(bare.clone()), ..q.clone() },
            _ => q.clone(),
        };
        let value = given.as_ref().map(|q| converted(&in_unit(q), unit).map_err(|m| m.within(key))).transpose()?;
        let is_bare = given.as_ref().is_some_and(|q| q.unit.is_none());
        value.map(|value| in_range(key, value, is_bare, unit, criterion.range())).transpose()
    };
    let (demand, good, bad) = (value("demand", &draft.demand)?, value("good", &draft.good)?, value("bad", &draft.bad)?);
    let equal = draft.usage == Usage::Equality;
    match (demand, good, bad) {
        (Some(d), None, None) => {
            Demand::of(d, criterion.sense(), equal).ok_or_else(|| impossible(d, criterion.sense()))
        }
        (None, Some(good), Some(bad)) if !(good.is_finite() && bad.is_finite() && good != bad) => {
            Err(StudyError::new("bad", "`good` and `bad` must be two different finite values")
                .with_help("`good` scales to 0, `bad` to 1"))
        }
        (None, Some(good), Some(bad)) => {
            let against = match criterion.sense() {
                Sense::Less => good > bad,
                Sense::More => good < bad,
                Sense::Target | Sense::Open => false,
            };
            if against && !equal {
                let better = if criterion.sense() == Sense::More { "more" } else { "less" };
                let (good, bad) = (unit.amount(bad), unit.amount(good));
                return Err(StudyError::new(
                    "good",
                    format!("`good` and `bad` are swapped: {better} is better for this criterion"),
                )
                .with_help(format!("write good = \"{good}\", bad = \"{bad}\"")));
            }
            Ok(Demand::Pair { good, bad })
        }
        (Some(_), _, _) => Err(StudyError::new("demand", "`demand` and the pair `good`, `bad` are mutually exclusive")
            .with_help("remove one or the other")),
        (None, None, None) if draft.usage == Usage::Monitor => Ok(Demand::None),
        (None, None, None) => match criterion.natural_demand() {
            Some(natural) => Ok(Demand::AtMost(natural)),
            None => Err(StudyError::here("the criterion has no demand")
                .with_help("add `demand = ...`, or the pair `good` and `bad`")),
        },
        (None, Some(_), None) => {
            Err(StudyError::new("good", "`good` requires `bad`")
                .with_help("add `bad = ...`, the value that scales to 1"))
        }
        (None, None, Some(_)) => {
            Err(StudyError::new("bad", "`bad` requires `good`")
                .with_help("add `good = ...`, the value that scales to 0"))
        }
    }
}

/// Returns the error for a demand that is invalid under the sense of its kind.
fn impossible(demand: f64, sense: Sense) -> StudyError {
    let pair = "`good` and `bad`, the values that scale to 0 and to 1";
    let (fact, way_out) = match sense {
        Sense::Target if demand.is_finite() && demand != 0.0 => (
            "a single demand is ambiguous, because neither less nor more is better for this criterion".to_owned(),
            format!("set usage = \"equality\" for exactly this value, or give {pair}"),
        ),
        Sense::More => (
            format!("expected a demand other than 0, found {demand}"),
            format!("the distance to the demand is divided by its absolute value; give {pair} instead"),
        ),
        _ => (
            format!("a demand must be positive, not {demand}"),
            format!("the value is divided by the demand; otherwise give {pair} instead"),
        ),
    };
    StudyError::new("demand", fact).with_help(way_out)
}

/// Rejects an angle for a value that is not an angle, and a share for an angle. Both are pure numbers, but certainly a
/// mistake.
fn refuse_mixed_angles(key: &str, quantity: &Quantity, unit: &Unit) -> Result<(), StudyError> {
    let Some(given) = quantity.unit.as_ref().filter(|given| given.dimension().is_none() && given.to_string() != "1")
    else {
        return Ok(());
    };
    if !unit.dimension().is_none() || given.is_angle() == unit.is_angle() {
        return Ok(());
    }
    let fact = match given.is_angle() {
        true => format!("expected a pure number, found an angle in {given}"),
        false => format!("expected an angle, found a share in {given}"),
    };
    let way_out = if given.is_angle() { "write a pure number" } else { "write an angle, such as \"45 deg\"" };
    Err(StudyError::new(key, fact).with_help(way_out))
}

/// Rejects a value outside the range of the kind.
fn in_range(key: &str, value: f64, is_bare: bool, unit: &Unit, [low, high]: [f64; 2]) -> Result<f64, StudyError> {
    if value.is_nan() || (low..=high).contains(&value) {
        return Ok(value);
    }
    let amount = |x: f64| unit.amount((1e6 * x).round() / 1e6);
    let range = format!("{} to {}", amount(low), amount(high));
    let fact = format!("{} is outside the range of this criterion, {range}", unit.amount(value));
    let degrees = Unit::known("deg");
    let as_degrees = degrees.factor_to(unit).filter(|_| is_bare && unit.is_angle()).map(|factor| value * factor);
    let way_out = match as_degrees.filter(|angle| (low..=high).contains(angle)) {
        Some(_) => format!("if these are degrees, write {key} = \"{value} deg\""),
        None => "give a value within the range".to_owned(),
    };
    Err(StudyError::new(key, fact).with_help(way_out))
}
