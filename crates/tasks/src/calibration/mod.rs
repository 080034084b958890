//! `task = "calibration"`: fits the tuners to measurements.

mod report;
mod section;
mod uncertainty;
mod verdict;

use mops_content::numbers::number;
use mops_content::section::{Block, Part};
use mops_core::{Study, Watch};
use mops_outcome::{BlockKind, Outcome};

use crate::room::{Judgement, Room, Solution, TaskCommand};
use crate::search::{Extras, Options, SolveError, Solved, search_for};

pub use report::{BandReport, BootstrapParameter, BootstrapReport, ProfileReport, UncertaintyReport};
pub use section::{Around, bands, lines, sections};

/// `task = "calibration"`.
pub struct Calibration;

impl Room for Calibration {
    fn title(&self) -> &'static str {
        "Calibration"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        let mut solved = search_for(Extras { twin: true, ..Extras::default() }, study, options, watch)?;
        uncertainty::add(&mut solved, watch);
        Ok(solved)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "calibrate",
            about: "Estimate the tuners of a study from its experiments, whatever its task",
            after_help: "",
            has_solver: true,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<UncertaintyReport>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        Judgement::OfPoint(verdict::verdict(of))
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        outcome.found.get::<UncertaintyReport>().map_or_else(Vec::new, section::lines_of_uncertainty)
    }

    fn judges_demands(&self) -> bool {
        false
    }

    fn about_criteria(&self, outcome: &Outcome) -> Vec<Part> {
        let sum = "The objective is the sum of the scaled values (value / demand) of the calibration data: ";
        let mut parts = vec![Part::text(sum), Part::Strong(number(outcome.objective))];
        if outcome.solver != "none" {
            parts.push(Part::text(format!(", at the initial guess {}", number(outcome.start.objective))));
        }
        parts.push(Part::text(". "));
        parts
    }

    fn has_convergence(&self, _of: &Solution<'_>) -> bool {
        true
    }
}
