//! `mops check`: reads a study and its data, and runs nothing.

use std::process::ExitCode;

use clap::Args;
use mops_core::{Catalogue, ParameterSource};

use super::study::{StudyArguments, open};
use super::tables::{number, table};
use super::{Trouble, print};

/// What is checked.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    study: StudyArguments,
}

pub(super) fn check(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, Trouble> {
    let file = open(catalogue, &arguments.study)?;
    let study = &file.study;
    let mut text = format!("{}: ok\n\n", study.name);
    let tuners = study.tuners.iter().map(|t| {
        let [low, high] = t.bounds.map(number);
        let state = if t.tie.is_some() {
            "tied"
        } else if t.active {
            ""
        } else {
            "inactive"
        };
        vec![t.name.clone(), number(t.start), low, high, t.unit.to_string(), state.to_owned()]
    });
    text += &table(&["tuner", "start", "min", "max", "unit", ""], &[1, 2, 3], tuners.collect());
    let rows = study.rows.iter().map(|row| {
        let plan = &study.jobs[row.job];
        let usage = format!("{:?}", row.usage).to_lowercase();
        vec![
            study.key(row),
            study.models[plan.model].0.clone(),
            usage,
            row.demand.limit().map_or_else(String::new, number),
            row.unit.to_string(),
        ]
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
    text += &format!("\n{}", table(&["case", "fixed parameter", "value", "unit"], &[2], fixed.collect()));
    for warning in &study.warnings {
        text += &format!("\nwarning: {warning}\n");
    }
    print(&text);
    Ok(ExitCode::SUCCESS)
}
