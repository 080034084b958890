//! Check of a draft: every name, size, bound and unit, before anything runs.

mod cases;
mod criteria;
mod jobs;
mod models;
mod ties;
mod tuners;
mod values;

use std::collections::HashSet;
use std::sync::Arc;

use crate::case::{Case, Role};
use crate::criterion::{Loss, Usage};
use crate::model::{AnalysisKind, Interface, Model};
use crate::study::draft::{CaseBuilder, CriterionBuilder, StudyBuilder};
use crate::study::{JobPlan, Study, StudyError, uncertain};
use cases::{assumed_units, build_case, outliers, with_sensors};
use criteria::add_rows;
use jobs::{complete, job};
use tuners::{build_tuner, check_use, free_start, tie_tuners};
use values::{check_horizon, fixed_values, section};

impl StudyBuilder {
    /// Checks all names, sizes, bounds and units.
    ///
    /// # Errors
    /// Returns the first error, with the path of keys to its location.
    pub fn build(self) -> Result<Study, StudyError> {
        build(self)
    }
}

fn build(draft: StudyBuilder) -> Result<Study, StudyError> {
    if draft.models.is_empty() {
        return Err(StudyError::new("models", "the study has no model")
            .with_help("add a table such as [models.loop.pid-loop]; `mops list` shows the kinds"));
    }
    distinct("models", draft.models.iter().map(|(name, _)| name))?;
    distinct("tuners", draft.tuners.iter().map(|(name, _)| name))?;
    distinct("cases", draft.cases.iter().map(|case| &case.name))?;
    distinct("criteria", draft.criteria.iter().map(|(name, _)| name))?;
    let mut models: Vec<(String, Arc<dyn Model>)> = Vec::new();
    let mut fixed = Vec::new();
    for (name, draft) in draft.models {
        let Interface { signals, parameters, states, inputs, horizon, .. } = draft.model.interface();
        let within = |mistake: StudyError| mistake.within(&name).within("models");
        distinct("signals", signals.iter().map(|signal| &signal.name)).map_err(within)?;
        distinct("parameters", parameters.iter().map(|parameter| &parameter.variable.name)).map_err(within)?;
        distinct("states", states.iter().map(|state| &state.name)).map_err(within)?;
        distinct("inputs", inputs.iter().map(|input| &input.name)).map_err(within)?;
        check_horizon(*horizon).map_err(within)?;
        fixed.push(fixed_values(&draft.parameters, parameters).map_err(|m| within(m.within("parameters")))?);
        models.push((name, Arc::from(draft.model)));
    }
    let mut warnings = Vec::new();
    let drafts = if draft.cases.is_empty() {
        vec![CaseBuilder { name: "nominal".into(), ..CaseBuilder::default() }]
    } else {
        draft.cases
    };
    distinct("sensors", draft.sensors.iter().map(|(signal, _)| signal))?;
    let drafts = with_sensors(drafts, &draft.sensors, &models).map_err(|m| m.within("sensors"))?;
    let cases: Vec<Case> = drafts
        .iter()
        .map(|case| build_case(case, &models, &mut warnings).map_err(|m| m.within(&case.name).within(section(case))))
        .collect::<Result<_, _>>()?;

    check_use(&draft.tuners, &models)?;
    let mut tuners = Vec::new();
    for (name, tuner) in &draft.tuners {
        build_tuner(name, tuner, &models, &cases, &mut tuners).map_err(|m| m.within(name).within("tuners"))?;
    }
    tie_tuners(&draft.tuners, &mut tuners, &models)?;
    for (index, (case, case_draft)) in cases.iter().zip(&drafts).enumerate() {
        for free in case_draft.measured.iter().flat_map(|m| &m.free) {
            let tuner = free_start(free, index, case, &models)
                .map_err(|m| m.within("free").within(&case.name).within("experiments"))?;
            tuners.push(tuner);
        }
    }

    let is_measured = cases.iter().any(|case| case.experiment.is_some());
    let objective = draft.objective.unwrap_or_else(|| draft.task.objective(is_measured));
    let mut notes = assumed_units(&drafts, &models);
    for (name, model) in &models {
        notes.extend(model.notes().into_iter().map(|note| format!("`{name}`: {note}")));
    }
    let mut study = Study {
        name: draft.name,
        task: draft.task,
        options: draft.options,
        uncertain: Vec::new(),
        objective,
        seed: draft.seed,
        models,
        fixed,
        cases,
        tuners,
        rows: Vec::new(),
        jobs: Vec::new(),
        notes,
        warnings,
    };
    let without = draft.criteria.is_empty();
    let order: Vec<String> = draft.criteria.iter().map(|(name, _)| name.clone()).collect();
    for (name, criterion) in in_order(draft.criteria)? {
        add_rows(&mut study, &name, criterion).map_err(|m| m.within(&name).within("criteria"))?;
    }
    study.rows.sort_by_key(|row| order.iter().position(|name| *name == row.name));
    for (model, case, signals) in study.task.signals(&study) {
        job(&mut study, model, case, &signals)?;
    }
    for index in 0..study.jobs.len() {
        let JobPlan { model, case, .. } = study.jobs[index];
        let completed =
            complete(&study, model, case).map_err(|m| m.within(&drafts[case].name).within(section(&drafts[case])))?;
        let job = &mut study.jobs[index];
        (job.horizon, job.parameters) = completed;
    }
    // Without a criterion, every model is simulated in every case, where it can be.
    if without && study.task.needs_criteria() {
        study
            .warnings
            .push("the study has no criterion: it can be simulated and linearised, but not solved".to_owned());
        for model in 0..study.models.len() {
            study
                .jobs
                .extend((0..study.cases.len()).filter_map(|case| study.plan(model, case).ok()).collect::<Vec<_>>());
        }
    }
    let outlying = outliers_that_count(&study);
    study.warnings.extend(outlying);
    refuse_forgotten_inputs(&study, &drafts)?;
    let cold = temperatures_of_nothing(&study);
    study.warnings.extend(cold);
    let chooses = study.task.chooses_tuners();
    if chooses && study.rows.iter().all(|row| row.usage == Usage::Monitor) {
        let fact =
            "nothing to minimise: every criterion has usage monitor, so that the tuners keep their initial guess";
        study.warnings.push(fact.to_owned());
    }
    if chooses {
        refuse_validation_alone(&study)?;
    }
    study.rows.sort_by_key(|row| study.jobs[row.job].case);
    study.uncertain = uncertain::check(draft.uncertain, &study)?;
    study.task.check(&study, true)?;
    study.options.iter().try_for_each(|options| options.check(&study, false))?;
    if let Some(note) = study.task.ignores_uncertain().filter(|_| !study.uncertain.is_empty()) {
        study.notes.push(note.to_owned());
    }
    Ok(study)
}

/// Orders criteria so that each follows those that it refers to.
fn in_order(mut left: Vec<(String, CriterionBuilder)>) -> Result<Vec<(String, CriterionBuilder)>, StudyError> {
    let mut ordered = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let waits = |(name, criterion): &(String, CriterionBuilder)| {
            criterion.criterion.names().iter().any(|other| other == name || left.iter().any(|(left, _)| left == other))
        };
        let Some(next) = left.iter().position(|criterion| !waits(criterion)) else {
            let names: Vec<String> = left.iter().map(|(name, _)| format!("`{name}`")).collect();
            let fact = format!("circular reference between the criteria {}", names.join(", "));
            return Err(StudyError::new(&left[0].0, fact).within("criteria").with_help("remove one reference"));
        };
        ordered.push(left.remove(next));
    }
    Ok(ordered)
}

/// Refuses a study whose criteria all belong to experiments for validation, or are monitored: no tuner would have an
/// effect.
fn refuse_validation_alone(study: &Study) -> Result<(), StudyError> {
    let mut used = study.rows.iter().filter(|row| row.usage != Usage::Monitor);
    let Some(case) = used.clone().next().map(|row| study.case_of(row)) else { return Ok(()) };
    if used.any(|row| study.case_of(row).role() == Role::Calibration) {
        return Ok(());
    }
    let fact = "no criterion counts, as those that are not monitored belong to experiments for validation only";
    Err(StudyError::new("role", fact)
        .within(&case.name)
        .within("experiments")
        .with_help("remove `role` from the experiments that the tuners are fitted to"))
}

/// Refuses an experiment that does not give an input of a model, although its data files have columns that it does not
/// use.
fn refuse_forgotten_inputs(study: &Study, drafts: &[CaseBuilder]) -> Result<(), StudyError> {
    for job in &study.jobs {
        let (case, draft) = (&study.cases[job.case], &drafts[job.case]);
        let Some(measured) = draft.measured.as_ref().filter(|measured| !measured.unused.is_empty()) else { continue };
        let interface = study.models[job.model].1.interface();
        if interface.analysis == AnalysisKind::Linear {
            continue;
        }
        let is_given = |name: &str| case.input(name).is_some();
        if let Some(input) = interface.inputs.iter().find(|input| !is_given(&input.name)) {
            let columns: Vec<String> = measured.unused.iter().map(|column| format!("`{column}`")).collect();
            let [shown, more] = match columns.split_at_checked(MOST_COLUMNS) {
                Some((shown, rest)) if !rest.is_empty() => [shown.join(", "), format!(" and {} others", rest.len())],
                _ => [columns.join(", "), String::new()],
            };
            let files = if columns.len() == 1 { "column" } else { "columns" };
            let fact = format!(
                "the input `{}` is not given, but the data file has the {files} {shown}{more}, which nothing uses",
                input.name
            );
            let column = measured.unused[0].split(" [").next().unwrap_or_default();
            let column = if columns.len() == 1 { column } else { "..." };
            let help = format!(
                "add `{0} = \"{column}\"` to `inputs` of the experiment, or `{0} = 0` if it is 0 throughout",
                input.name
            );
            return Err(StudyError::new("inputs", fact).within(&case.name).within(section(draft)).with_help(help));
        }
    }
    Ok(())
}

/// Largest number of columns that a message lists.
const MOST_COLUMNS: usize = 8;

/// Returns warnings about outliers in the channels of experiments, except those that robust losses alone read.
fn outliers_that_count(study: &Study) -> Vec<String> {
    let losses = |case: usize, signal: &str| -> Vec<Loss> {
        let rows = study.rows.iter().filter(|row| study.jobs[row.job].case == case);
        let samples = rows.filter_map(|row| row.criterion.samples(&study.cases[case]));
        samples.filter(|samples| samples.signal == signal).map(|samples| samples.loss).collect()
    };
    let mut warnings = Vec::new();
    for (index, case) in study.cases.iter().enumerate() {
        for channel in case.experiment.iter().flat_map(|experiment| &experiment.channels) {
            let found = losses(index, &channel.signal);
            if found.is_empty() || found.contains(&Loss::Squares) {
                warnings.extend(outliers(&case.name, channel));
            }
        }
    }
    warnings
}

/// Returns warnings for undriven inputs on a temperature scale: they stay at the zero of the scale, which is rarely
/// intended.
fn temperatures_of_nothing(study: &Study) -> Vec<String> {
    let mut found: Vec<(String, Vec<&str>)> = Vec::new();
    for job in &study.jobs {
        let case = &study.cases[job.case];
        for input in &study.models[job.model].1.interface().inputs {
            if input.unit.zero() == 0.0 || case.input(&input.name).is_some() {
                continue;
            }
            let fact = format!("input `{}` is not driven and stays at 0 {}", input.name, input.unit);
            match found.iter_mut().find(|(known, _)| *known == fact) {
                Some((_, cases)) if cases.contains(&case.name.as_str()) => {}
                Some((_, cases)) => cases.push(&case.name),
                None => found.push((fact, vec![&case.name])),
            }
        }
    }
    found.into_iter().map(|(fact, cases)| format!("{fact}, in {}", cases.join(", "))).collect()
}

/// Checks that names are given and differ; those of a study file always differ.
fn distinct<'n>(table: &str, names: impl Iterator<Item = &'n String>) -> Result<(), StudyError> {
    let mut known = HashSet::new();
    for name in names {
        if name.is_empty() {
            return Err(StudyError::here("a name is empty").within(table).with_help("name every entry"));
        }
        if !known.insert(name) {
            return Err(StudyError::new(name, format!("duplicate name `{name}`"))
                .within(table)
                .with_help("rename one of them: studies and results use these names"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_and_duplicate_names_are_refused_with_their_table() {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        assert!(distinct("tuners", names(&["k", "Ti"]).iter()).is_ok());
        let twice = distinct("tuners", names(&["k", "k"]).iter()).unwrap_err();
        assert!(twice.to_string().starts_with("tuners.k: duplicate name `k`"), "{twice}");
        assert!(distinct("cases", names(&[""]).iter()).unwrap_err().to_string().contains("empty"));
    }
}
