//! `task = "sensitivity"`: local sensitivity (tuners and combinations of tuners that the data or the criteria
//! determine), or global sensitivity to the uncertain parameters.

use mops_core::{
    Study, Watch,
    task::{Place, SensitivityMethod, SensitivityTask},
};
use mops_identification::Point;
use mops_outcome::identification::sensitivity_at;

mod global;
mod section;

use mops_content::section::{Block, Section, Tone, Verdict};
use mops_outcome::{BlockKind, Outcome, identification::SensitivityReport};

use crate::identifiability;
use crate::room::{Judgement, Room, Solution, TaskCommand, solve_at};
use crate::search::{Options, SolveError, Solved};
use crate::uncertain::GlobalSensitivityReport;

/// `task = "sensitivity"`.
pub struct Sensitivity;

impl Room for Sensitivity {
    fn title(&self) -> &'static str {
        "Sensitivity"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        perform(study, options, watch)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "sensitivity",
            about: "Compute sensitivities of the criteria to the tuners of a study, at its optimum",
            after_help: "",
            has_solver: true,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<SensitivityReport>(), BlockKind::of::<GlobalSensitivityReport>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let global = of.outcome.found.get::<GlobalSensitivityReport>();
        if let Some((found, words)) = global.and_then(|found| Some((found, found.words.first()?))) {
            let tone = if found.criteria.iter().all(|criterion| criterion.effects.is_empty()) {
                Tone::Bad
            } else if found.failed > 0 {
                Tone::Mixed
            } else {
                Tone::Good
            };
            return Judgement::OfFindings(Verdict::new(tone, words));
        }
        let Some(found) = of.outcome.found.get::<SensitivityReport>() else {
            return Judgement::OfPoint(Verdict::new(Tone::Bad, "The sensitivities could not be computed."));
        };
        let is_sound = found.rank == found.tuners.len() && found.tuners.iter().all(|t| t.trust == "determined");
        let blind = found.tuners.len() - found.rank;
        let words = found.words[..(1 + blind).min(found.words.len())].join(" ");
        Judgement::OfPoint(Verdict::new(if is_sound { Tone::Good } else { Tone::Mixed }, words))
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        let local = of.outcome.found.get::<SensitivityReport>();
        let local = local.map(|found| Section::new(identifiability::title(found), identifiability::blocks(found)));
        let global = of.outcome.found.get::<GlobalSensitivityReport>().map(section::of);
        global.into_iter().chain(local).collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        let local = outcome.found.get::<SensitivityReport>().map(identifiability::lines);
        let global = outcome.found.get::<GlobalSensitivityReport>().map(section::lines);
        local.into_iter().chain(global).flatten().collect()
    }

    fn samples_uncertain(&self, study: &Study) -> bool {
        study.options::<SensitivityTask>().is_some_and(|task| task.method != SensitivityMethod::Local)
    }
}

fn perform(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let task = study.options::<SensitivityTask>().copied().unwrap_or_default();
    let mut solved = solve_at(task.at, study, options, watch)?;
    if task.method != SensitivityMethod::Local {
        global::add(&mut solved, options, watch);
        return Ok(solved);
    }
    // A calibration has already computed the sensitivities.
    let known = solved.outcome.calibration.as_mut().and_then(|calibration| calibration.sensitivity.take());
    let point = if task.at == Place::Optimum { Point::Minimum } else { Point::Elsewhere };
    let found = known.or_else(|| sensitivity_at(&solved.problem, &solved.best.tuners, point, task.zero));
    if found.is_none() && watch.wants_stop() {
        solved.outcome.stop = watch.halt().into();
    } else if found.is_none() {
        let why = "the sensitivities could not be computed: a simulation failed, or no criterion depends on a tuner";
        solved.outcome.warnings.push(why.to_owned());
    }
    if let Some(found) = found {
        solved.outcome.found.add(found);
    }
    Ok(solved)
}
