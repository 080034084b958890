//! `task = "diagnosis"`: finds the physical effect missing from the model.

pub mod errors;
mod lines;
#[doc(hidden)]
pub mod made_up;
mod predictions;
mod repaired;
mod section;
mod source;
#[cfg(test)]
mod tests_of_files;
pub mod words;

use std::sync::Arc;
use std::time::Instant;

use std::io;

use mops_content::{
    numbers::counted,
    section::{Block, Section, Tone, Verdict},
};
use mops_core::{Effect, Study, StudyError, Watch, task::DiagnosisTask};
use mops_language::{Diagnostic, suggestion};
use mops_outcome::{BlockKind, Outcome, diagnosis::Diagnosis};

pub use predictions::predictions;
pub use repaired::{Original, repaired};
pub use source::source;

use crate::room::{Judgement, Origin, OutputFile, OutputNames, Room, Solution, TaskCommand};
use crate::search::{Options, SolveError, Solved, evaluate_start};

/// `task = "diagnosis"`.
pub struct Search;

impl Room for Search {
    fn title(&self) -> &'static str {
        "Diagnosis"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        perform(study, options, watch)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "diagnose",
            about: "Find the physical effect missing from a calibrated model, add it, and report the errors before and after",
            after_help: "",
            has_solver: false,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<Diagnosis>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        Judgement::Whole(match of.outcome.found.get::<Diagnosis>() {
            Some(found) => Verdict::new(if found.is_sure { Tone::Good } else { Tone::Mixed }, words::verdict(found)),
            None => Verdict::new(Tone::Bad, "No diagnosis: the run was interrupted."),
        })
    }

    fn facts(&self, outcome: &Outcome) -> Vec<(String, String)> {
        outcome.found.get::<Diagnosis>().map_or_else(Vec::new, section::facts)
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        of.outcome.found.get::<Diagnosis>().map_or_else(Vec::new, section::sections)
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        outcome.found.get::<Diagnosis>().map_or_else(Vec::new, |found| lines::blocks(found, outcome.seconds))
    }

    fn has_point(&self) -> bool {
        false
    }

    fn has_convergence(&self, _of: &Solution<'_>) -> bool {
        false
    }

    fn introduction(&self, study: &Study) -> Option<String> {
        let active = study.tuners().iter().filter(|t| t.active).count();
        let experiments = study.cases().iter().filter_map(|case| case.experiment.as_ref());
        let (count, channels) = experiments.fold((0, 0), |(n, m), e| (n + 1, m + e.channels.len()));
        Some(format!(
            "{}: {}, {} with {}; searching for missing effects",
            study.name(),
            counted(active, "tuner"),
            counted(count, "experiment"),
            counted(channels, "channel")
        ))
    }

    fn outputs(&self) -> OutputNames {
        OutputNames { files: &[FINDINGS, REPAIRED, "repaired.rs"], folders: &[("predictions", &["csv"])] }
    }

    fn files(&self, of: &Solution<'_>, origin: &Origin<'_>) -> Vec<OutputFile> {
        let Some(diagnosis) = of.outcome.found.get::<Diagnosis>() else { return Vec::new() };
        let findings = toml::to_string(diagnosis).expect("a diagnosis is a table");
        let mut files = vec![OutputFile::new(FINDINGS, findings)];
        let tables = predictions(diagnosis).into_iter();
        files.extend(tables.map(|(name, table)| OutputFile::new(format!("predictions/{name}.csv"), table)));
        // A study built in Rust has no text to be repaired.
        let Some(text) = origin.text.filter(|_| diagnosis.changes_study()) else { return files };
        let (settings, study, effects) = (origin.own, of.problem.study(), origin.effects);
        let text = repaired(&Original { text, settings, study, effects }, diagnosis, origin.locate);
        files.extend(origin.data());
        let folder = origin.folder.display().to_string();
        let program = origin.is_exported.then(|| source(&text, diagnosis, &folder));
        files.push(OutputFile::new(REPAIRED, text));
        files.extend(program.map(|program| OutputFile::new("repaired.rs", program)));
        files
    }

    fn written_study(&self) -> Option<&'static str> {
        Some(REPAIRED)
    }

    fn can_export(&self) -> bool {
        true
    }

    fn restored_from(&self) -> Option<&'static str> {
        Some(FINDINGS)
    }

    fn restored(&self, study: &Study, options: &Options, content: io::Result<Vec<u8>>) -> Result<Solved, Diagnostic> {
        let refused = |why: String| {
            Diagnostic::new(format!("{FINDINGS} cannot be read: {why}"))
                .with_help("a diagnosis that reached a verdict writes it; `mops diagnose` runs one")
        };
        let text = String::from_utf8(content.map_err(|error| refused(error.to_string()))?);
        let text = text.map_err(|error| refused(error.to_string()))?;
        let found = toml::from_str(&text).map_err(|error: toml::de::Error| refused(error.message().to_owned()))?;
        Ok(of(study.clone(), options, found))
    }
}

/// File with everything that a diagnosis found: TOML has numbers that are not finite, JSON has not.
const FINDINGS: &str = "diagnosis.toml";

/// File of the recalibrated study.
const REPAIRED: &str = "repaired.toml";

fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
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
    let task = &study.options::<DiagnosisTask>().cloned().unwrap_or_default();
    let effects = effects(task, &options.effects)?;
    let options = mops_diagnosis::Options {
        max_effects: task.max_effects,
        level: task.level,
        ..mops_diagnosis::Options::default()
    };
    mops_diagnosis::diagnose(study, &effects, &options, watch).map_err(SolveError)
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
    (outcome.solver, outcome.evaluations, outcome.calibration) = ("diagnosis".to_owned(), 0, None);
    outcome.front.clear();
    outcome.warnings.push("the diagnosis was stopped before it reached a verdict".to_owned());
    solved
}

/// Returns the outcome of a diagnosis, with the tuners of the repaired model.
pub fn of(study: Study, options: &Options, diagnosis: Diagnosis) -> Solved {
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
    (outcome.solver, outcome.evaluations) = ("diagnosis".to_owned(), 0);
    (outcome.simulations, outcome.calibration) = (diagnosis.simulations, None);
    outcome.front.clear();
    outcome.found.add(diagnosis);
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
