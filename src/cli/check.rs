//! `mops check`: reads a study and its data, and runs nothing.

use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, Demand, Grid, ParameterSource, Scale, uncertain_reports};

use super::families::folded;
use super::places::places;
use super::study::{StudyArguments, open};
use super::tables::{number, table};
use super::{Trouble, print};
use crate::solve::suits;

/// What is checked.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
}

pub(super) fn check(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, Trouble> {
    let file = open(catalogue, &arguments.study)?;
    let study = &file.study;
    suits(study, &file.solver).map_err(|why| file.locate(&why.0))?;
    let mut text = format!("{}: ok\n\n", study.name);
    let start = study.start();
    let tuners = study.tuners.iter().zip(&start).map(|(t, &start)| {
        let [low, high] = t.bounds.map(|bound| if bound.is_finite() { number(bound) } else { String::new() });
        let kind = match (&t.tie, t.active, &t.grid, t.scale) {
            (Some(_), ..) => "tied".to_owned(),
            (_, false, ..) => "inactive".to_owned(),
            (_, _, Grid::Integer, _) => "integer".to_owned(),
            (_, _, Grid::List(values), _) => {
                format!("one of {}", values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "))
            }
            (_, _, _, Scale::Log) => "log".to_owned(),
            _ => String::new(),
        };
        vec![t.name.clone(), number(start), low, high, t.unit.to_string(), kind]
    });
    text += &table(&["tuner", "start", "min", "max", "unit", ""], &[1, 2, 3], folded(tuners.collect(), 0));
    let rows = study.rows.iter().map(|row| {
        let plan = &study.jobs[row.job];
        let usage = format!("{:?}", row.usage).to_lowercase();
        vec![study.key(row), study.models[plan.model].0.clone(), usage, demand(row.demand), row.unit.to_string()]
    });
    text += &format!("\n{}", table(&["criterion", "model", "usage", "demand", "unit"], &[3], rows.collect()));
    let fixed = study.jobs.iter().flat_map(|job| {
        let names = &study.models[job.model].1.interface().parameters;
        names.iter().zip(&job.parameters).filter_map(move |(p, source)| match source {
            ParameterSource::Constant(value) => Some(vec![
                study.cases[job.case].name.clone(),
                p.variable.name.clone(),
                number(*value),
                p.variable.unit.to_string(),
            ]),
            ParameterSource::Tuner { .. } => None,
        })
    });
    text += &format!("\n{}", table(&["case", "fixed parameter", "value", "unit"], &[2], folded(fixed.collect(), 1)));
    if !study.tasks.uncertain.is_empty() {
        text += &super::robustness::parameters(&uncertain_reports(&study.over_uncertain(&start)));
    }
    let models = study.models.iter().map(|(name, model)| vec![name.clone(), places(model.interface())]);
    let models: Vec<_> = models.filter(|row| !row[1].is_empty()).collect();
    if !models.is_empty() {
        text += &format!("\n{}", table(&["model", "places for effects"], &[], models));
    }
    for warning in &study.warnings {
        text += &format!("\nwarning: {warning}\n");
    }
    for note in &study.notes {
        text += &format!("\nnote: {note}\n");
    }
    print(&text);
    Ok(ExitCode::SUCCESS)
}

fn demand(demand: Demand) -> String {
    match demand {
        Demand::Value(value) => number(value),
        Demand::Pair { good, bad } => format!("{} .. {}", number(good), number(bad)),
        Demand::None => String::new(),
    }
}
