//! `task = "diagnosis"`: finds the physical effect missing from the model.

use std::sync::Arc;
use std::time::Instant;

use mops_core::{Effect, Study, StudyError, Watch, study::DiagnosisTask};
use mops_language::suggestion;
use mops_outcome::diagnosis::Diagnosis;

use crate::search::{Options, SolveError, Solved, evaluate_start};

pub(super) fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let started = Instant::now();
    let mut solved = match search(&study, options, watch) {
        Ok(diagnosis) => {
            let is_stopped = diagnosis.is_stopped;
            let mut solved = of(study, options, diagnosis);
            if is_stopped {
                solved.outcome.stop = watch.halt().into();
            }
            solved
        }
        Err(_) if watch.wants_stop() => interrupted(study, options, watch),
        Err(why) => return Err(why),
    };
    solved.outcome.seconds = started.elapsed().as_secs_f64();
    Ok(solved)
}

/// Runs the diagnosis over the effects selected by the task.
fn search(study: &Study, options: &Options, watch: &dyn Watch) -> Result<Diagnosis, SolveError> {
    let task = &study.tasks().diagnosis;
    let effects = effects(task, &options.effects)?;
    let options = mops_discrepancy::Options { max_effects: task.max_effects, level: task.level };
    mops_discrepancy::diagnose(study, &effects, &options, watch).map_err(SolveError)
}

/// Returns the effects selected by the task. N.B.: names in a study file are checked when the file is read.
fn effects(task: &DiagnosisTask, all: &[Arc<dyn Effect>]) -> Result<Vec<Arc<dyn Effect>>, SolveError> {
    let known = |name: &&String| all.iter().any(|effect| effect.name() == **name);
    if let Some(unknown) = task.effects.iter().flatten().chain(&task.without).find(|name| !known(name)) {
        let help = suggestion(unknown, all.iter().map(|effect| effect.name()));
        return Err(SolveError(
            StudyError::new("diagnosis", format!("there is no effect `{unknown}`")).with_help(help),
        ));
    }
    let left: Vec<_> = all.iter().filter(|effect| task.tries(effect.name())).cloned().collect();
    if left.is_empty() {
        let mistake =
            StudyError::new("without", "no effect is left to try").with_help("exclude fewer effects in `without`");
        return Err(SolveError(mistake.within("diagnosis")));
    }
    Ok(left)
}

/// Returns the outcome of an interrupted diagnosis, without findings.
fn interrupted(study: Study, options: &Options, watch: &dyn Watch) -> Solved {
    let mut solved = evaluate_start(study.without_criteria(), options, watch);
    let outcome = &mut solved.outcome;
    (outcome.solver, outcome.evaluations, outcome.calibration) = ("discrepancy".to_owned(), 0, None);
    outcome.front.clear();
    outcome.warnings.push("the diagnosis was stopped before it reached a verdict".to_owned());
    solved
}

/// Returns the outcome of a diagnosis, with the tuners of the repaired model.
pub(crate) fn of(study: Study, options: &Options, diagnosis: Diagnosis) -> Solved {
    // A diagnosis ignores the criteria: every channel is weighted by its noise level.
    let mut solved = evaluate_start(study.without_criteria(), options, &());
    let outcome = &mut solved.outcome;
    let study = solved.problem.study();
    for (report, tuner) in outcome.tuners.iter_mut().zip(study.tuners()) {
        let moved = diagnosis.parameters.iter().find(|p| p.name == report.name).map(|p| p.after);
        let start = tuner.case.and_then(|case| {
            let of_tuner = |(experiment, parameter, _): &&(String, String, f64)| {
                *experiment == study.cases()[case].name && *parameter == tuner.parameter
            };
            diagnosis.starts.iter().find(of_tuner).map(|(_, _, value)| *value)
        });
        if let Some(value) = moved.or(start) {
            report.value = value;
            report.at_bound = if report.active { tuner.at_bound(value) } else { None };
        }
    }
    (outcome.solver, outcome.evaluations) = ("discrepancy".to_owned(), 0);
    (outcome.simulations, outcome.calibration) = (diagnosis.simulations, None);
    outcome.front.clear();
    outcome.found.diagnosis = Some(diagnosis);
    solved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_task_selects_the_effects_that_are_tried() {
        let all = Options::default().effects;
        let tried = |effects: Option<&[&str]>, without: &[&str]| {
            let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
            let task =
                DiagnosisTask { effects: effects.map(owned), without: owned(without), ..DiagnosisTask::default() };
            effects_of(&task, &all)
        };
        assert_eq!(tried(None, &[]).unwrap().len(), all.len());
        assert_eq!(tried(Some(&["coulomb-friction"]), &[]).unwrap(), ["coulomb-friction"]);
        assert_eq!(tried(None, &["coulomb-friction"]).unwrap().len(), all.len() - 1);
        assert!(tried(None, &["coulomb-fricton"]).unwrap_err().contains("did you mean `coulomb-friction`?"));
        assert!(
            tried(None, &all.iter().map(|e| e.name()).collect::<Vec<_>>()).unwrap_err().contains("no effect is left")
        );
    }

    /// Returns the names of the selected effects.
    fn effects_of(task: &DiagnosisTask, all: &[Arc<dyn Effect>]) -> Result<Vec<&'static str>, String> {
        let left = effects(task, all).map_err(|why| why.to_string())?;
        Ok(left.iter().map(|effect| effect.name()).collect())
    }
}
