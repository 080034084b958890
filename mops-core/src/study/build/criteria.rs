//! Criteria in the cases they apply to, and their demands.

use std::sync::Arc;

use super::Models;
use super::jobs::job;
use super::values::converted;
use crate::case::Case;
use crate::criterion::{Criterion, Demand, Usage};
use crate::diagnostic::suggestion;
use crate::model::AnalysisKind;
use crate::study::draft::{CriterionDraft, Mistake};
use crate::study::{Row, Study};
use crate::unit::{Quantity, Unit};

pub(super) fn add_rows(study: &mut Study, name: &str, draft: CriterionDraft) -> Result<(), Mistake> {
    let model = match &draft.model {
        Some(model) => study.models.iter().position(|(n, _)| n == model).ok_or_else(|| {
            Mistake::new("model", format!("the study has no model `{model}`"))
                .with_help(suggestion(model, study.models.iter().map(|(n, _)| n.as_str())))
        })?,
        None if study.models.len() == 1 => 0,
        None => {
            let known: Vec<String> = study.models.iter().map(|(name, _)| format!("model = \"{name}\"")).collect();
            return Err(Mistake::here("the study has several models, and the criterion does not say which it reads")
                .with_help(format!("add {}", known.join(" or "))));
        }
    };
    let interface = study.models[model].1.interface();
    check_sort(draft.criterion.reads(), interface.analysis, &study.models, model)?;
    let criterion: Arc<dyn Criterion> = Arc::from(draft.criterion.bind(interface)?);
    let signals = interface.signals.clone();
    let unit = criterion.unit();
    let demand = demand(&draft, &unit, criterion.natural_demand())?;
    if !(draft.weight.is_finite() && draft.weight > 0.0) {
        return Err(Mistake::new("weight", format!("a weight must be positive, not {}", draft.weight))
            .with_help("usage = \"monitor\" keeps a criterion out of the objective"));
    }
    for case in cases_of(study, &draft)? {
        criterion.suits(&study.cases[case])?;
        let job = job(study, model, case, &criterion.signals(), &signals)?;
        study.rows.push(Row {
            name: name.to_owned(),
            job,
            criterion: Arc::clone(&criterion),
            usage: draft.usage,
            demand,
            weight: draft.weight,
            unit: unit.clone(),
        });
    }
    Ok(())
}

/// Refuses a criterion for a model whose analyses it cannot read.
fn check_sort(reads: AnalysisKind, gives: AnalysisKind, models: &Models, model: usize) -> Result<(), Mistake> {
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
        (Some((other, _)), _) => format!("read another model: model = \"{other}\""),
        (None, AnalysisKind::Linear) => {
            "add a model that is linear: `linearise = { ... }` beside the kind makes one of a simulated model"
                .to_owned()
        }
        (None, AnalysisKind::Time) => "add a model that is simulated".to_owned(),
    };
    Err(Mistake::here(fact).with_help(way_out))
}

fn cases_of(study: &Study, draft: &CriterionDraft) -> Result<Vec<usize>, Mistake> {
    let reads = draft.criterion.reads();
    let measures = |case: &Case| match (draft.criterion.needs_measurement(), &case.experiment, reads) {
        (Some(signal), Some(experiment), AnalysisKind::Time) => experiment.channel(signal).is_some(),
        (Some(signal), Some(experiment), AnalysisKind::Linear) => experiment.response(signal).is_some(),
        (Some(_), None, _) => false,
        // Where only frequency responses were measured, nothing is simulated over time.
        (None, Some(experiment), AnalysisKind::Time) => !experiment.channels.is_empty(),
        (None, ..) => true,
    };
    let signal = draft.criterion.needs_measurement().unwrap_or_default();
    let way_out = match (reads, signal) {
        (_, "") => "name cases without a measurement over frequency, or experiments with `channels`".to_owned(),
        (AnalysisKind::Time, _) => format!("name experiments with `{signal}` among their `channels`"),
        (AnalysisKind::Linear, _) => format!("name experiments with `{signal}` among their `responses`"),
    };
    let chosen: Vec<usize> = match &draft.cases {
        None => (0..study.cases.len()).filter(|&i| measures(&study.cases[i])).collect(),
        Some(wanted) => wanted
            .iter()
            .map(|name| {
                let found = study.cases.iter().position(|c| c.name == *name).ok_or_else(|| {
                    Mistake::new(name, format!("the study has no case `{name}`"))
                        .with_help(suggestion(name, study.cases.iter().map(|c| c.name.as_str())))
                        .within("cases")
                })?;
                if measures(&study.cases[found]) {
                    Ok(found)
                } else {
                    let fact = match signal {
                        "" => {
                            format!("nothing is simulated over time in `{name}`, only frequency responses are measured")
                        }
                        signal => format!("nothing in `{name}` measures `{signal}`"),
                    };
                    Err(Mistake::new(name, fact).with_help(way_out.clone()).within("cases"))
                }
            })
            .collect::<Result<_, _>>()?,
    };
    if chosen.is_empty() {
        let help = match reads {
            AnalysisKind::Time => "add it to the `channels` of an experiment",
            AnalysisKind::Linear => "add it to the `responses` of an experiment with `frequency`",
        };
        return Err(match signal {
            "" => Mistake::here("no case is simulated over time: only frequency responses are measured")
                .with_help("add a case under [cases]"),
            signal => Mistake::new("signal", format!("no experiment measures `{signal}`")).with_help(help),
        });
    }
    Ok(chosen)
}

fn demand(draft: &CriterionDraft, unit: &Unit, natural: Option<f64>) -> Result<Demand, Mistake> {
    let value =
        |key: &str, q: &Option<Quantity>| q.as_ref().map(|q| converted(q, unit).map_err(|m| m.within(key))).transpose();
    let (demand, good, bad) = (value("demand", &draft.demand)?, value("good", &draft.good)?, value("bad", &draft.bad)?);
    match (demand, good, bad) {
        (Some(d), None, None) if d.is_finite() && d > 0.0 => Ok(Demand::Value(d)),
        (Some(d), None, None) => Err(Mistake::new("demand", format!("a demand must be positive, not {d}"))
            .with_help("the value is divided by it; where that does not fit, give `good` and `bad` instead, the values that scale to 0 and to 1")),
        (None, Some(good), Some(bad)) if good.is_finite() && bad.is_finite() && good != bad => Ok(Demand::Pair { good, bad }),
        (None, Some(_), Some(_)) => Err(Mistake::new("bad", "`good` and `bad` must be two different finite values")
            .with_help("`good` scales to 0, `bad` to 1")),
        (Some(_), _, _) => Err(Mistake::new("demand", "a demand and the pair `good`, `bad` exclude each other")
            .with_help("remove one or the other")),
        (None, None, None) if draft.usage == Usage::Monitor => Ok(Demand::None),
        (None, None, None) if natural.is_some() => Ok(natural.map_or(Demand::None, Demand::Value)),
        (None, None, None) => Err(Mistake::here("the criterion has no demand").with_help("add `demand = ...`, or the pair `good` and `bad`")),
        (None, Some(_), None) => Err(Mistake::new("good", "`good` needs `bad` beside it")
            .with_help("add `bad = ...`, the value that scales to 1")),
        (None, None, Some(_)) => Err(Mistake::new("bad", "`bad` needs `good` beside it")
            .with_help("add `good = ...`, the value that scales to 0")),
    }
}
