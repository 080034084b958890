//! `task = "design"`: the tuners that minimise the worst scaled criterion, also over uncertain parameters.

mod jumps;
mod look;
mod robust;
mod rounds;
mod searched;
mod section;

use mops_content::numbers::counted;
use mops_content::section::{Block, Part, Section, Tone, Verdict};
use mops_core::Usage;
use mops_core::{Study, Watch};
use mops_outcome::{BlockKind, Outcome};

use crate::derivatives::DerivativesReport;
use crate::room::{Judgement, Room, SCALED, Solution};
use crate::search::{Options, SolveError, Solved};
use crate::uncertain::RobustReport;
use crate::verdict::{changed, missed, used_as};

pub use crate::slopes::{CriterionSlopes, SlopesReport};
pub use look::{AwayReport, JumpReport, JumpsReport, MovedKind, ON_JUMP, WITHIN as JUMPS_WITHIN};
use searched::{is_robust, search_design};

/// `task = "design"`.
pub struct Design;

impl Room for Design {
    fn title(&self) -> &'static str {
        "Design"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        let perform = if is_robust(&study) { robust::perform } else { search_design };
        let mut solved = perform(study.clone(), options, watch)?;
        jumps::add(&mut solved, study, options, watch);
        Ok(solved)
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![
            BlockKind::of::<SlopesReport>(),
            BlockKind::of::<DerivativesReport>(),
            BlockKind::of::<JumpsReport>(),
            BlockKind::of::<RobustReport>(),
        ]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        match of.outcome.found.get::<RobustReport>().and_then(rounds::verdict) {
            Some(verdict) => Judgement::Whole(verdict),
            None => Judgement::OfPoint(verdict(of)),
        }
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        of.outcome.found.get::<RobustReport>().map(rounds::of).into_iter().collect()
    }

    fn details(&self, of: &Solution<'_>) -> Vec<Section> {
        let one_case = of.problem.study().cases().len() == 1;
        let slopes = of.outcome.found.get::<SlopesReport>();
        let slopes = slopes.map(|found| section::sensitivities(found, of.best_name(), one_case));
        slopes.into_iter().chain(of.outcome.found.get::<JumpsReport>().map(section::jumps)).collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        outcome.found.get::<RobustReport>().map_or_else(Vec::new, rounds::lines)
    }

    fn about_criteria(&self, _outcome: &Outcome) -> Vec<Part> {
        let objective = "The objective is the largest weighted scaled value among the minimised criteria.";
        vec![Part::text(format!("{SCALED}{objective}"))]
    }

    fn has_optimality(&self) -> bool {
        true
    }

    // Each round of a design against worst cases has its own objective.
    fn has_convergence(&self, of: &Solution<'_>) -> bool {
        of.outcome.found.get::<RobustReport>().is_none()
    }

    fn samples_uncertain(&self, study: &Study) -> bool {
        is_robust(study)
    }
}

/// Returns the verdict on a feasible design.
fn verdict(of: &Solution<'_>) -> Verdict {
    let outcome = of.outcome;
    let mut text = "Feasible. ".to_owned();
    let minimised = used_as(of, Usage::Minimise);
    if minimised.is_empty() {
        return Verdict::new(Tone::Good, text + "All constraints are satisfied; no criterion is minimised.");
    }
    text.push_str(&changed("The worst scaled value", outcome.start.worst_scaled, outcome.worst_scaled));
    match minimised.iter().filter(|c| c.met == Some(false)).max_by(|a, b| a.scaled.total_cmp(&b.scaled)) {
        None => Verdict::new(Tone::Good, text + "; all demands are met."),
        Some(worst) => {
            let others = minimised.iter().filter(|c| c.met == Some(false)).count() - 1;
            let more = if others > 0 { format!("; {} missed", counted(others, "other demand")) } else { String::new() };
            Verdict::new(Tone::Mixed, format!("{text}. {}{more}.", missed(worst)))
        }
    }
}
