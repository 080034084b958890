//! The report of a run: one HTML page, and its plots as SVG and PNG.

mod axis;
mod bode;
mod calibration;
mod clip;
mod comparison;
mod contour;
mod convergence;
mod criteria;
mod diagnosis;
mod excitation;
mod figures;
mod front;
mod legend;
mod matrix;
mod page;
mod parallel_axes;
mod plot;
mod plot_files;
mod png;
mod range;
mod robustness;
mod sampling;
mod scene;
mod sensitivity;
mod side_by_side;
mod slopes;
mod space;
mod surface;
mod svg;
mod sweep;
#[cfg(test)]
mod tests;
mod tuners;
mod uncertainty;
mod verdict;

use std::fs;
use std::io;
use std::path::Path;

use mops_core::{Evaluation, Outcome, Problem, Record, Stop, Task};
use mops_discrepancy::Diagnosis;

use crate::files;
use crate::numbers::FileNames;

pub(crate) use bode::{FrequencyCurve, bode, frequencies};
pub use page::page;
pub use plot::{Band, Color, Curve, CurveStyle, Level, ParallelAxis, Plot, Surface, ZAxis};
use plot_files::PlotFiles;
pub(crate) use sampling::points;
pub(crate) use sensitivity::combination;
pub(crate) use side_by_side::{Responses, Rows, comparison_page};

/// The style sheet of all pages.
pub(crate) const STYLE: &str = include_str!("style.css");

/// Everything a report shows.
pub struct Report<'a> {
    /// The result.
    pub outcome: &'a Outcome,
    /// The problem that was solved.
    pub problem: &'a Problem,
    /// The evaluation that the outcome reports.
    pub best: &'a Evaluation,
    /// All points, in the order of their evaluation; the first is the start.
    pub archive: &'a [Record],
    /// Points of the front, in the order of the result; empty where none was looked for.
    pub front: &'a [Evaluation],
    /// What the model lacks, where that was searched.
    pub diagnosis: Option<&'a Diagnosis>,
    /// The study file with its settings.
    pub text: &'a str,
}

impl Report<'_> {
    /// Writes `report.html`, `plots/*.svg` and `plots/*.png` into the folder, which is made if it is not there.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let plots = folder.join("plots");
        fs::create_dir_all(&plots)?;
        let (responses, omitted) = figures::responses(self);
        let convergence = self.searched().then(|| convergence::group(self.problem.study(), self.archive));
        let front = front::group(self);
        let sweep = self.outcome.found.sweep.as_ref().map(|sweep| sweep::group(sweep, self.best_name()));
        let inputs = match &self.outcome.found.excitation {
            Some(found) => Some(&found.inputs),
            None => self.outcome.calibration.as_ref().map(|calibration| &calibration.excitation),
        };
        let excitation = inputs.filter(|inputs| !inputs.is_empty()).map(|inputs| excitation::group(inputs));
        let diagnosis = self.diagnosis.map(diagnosis::Plots::of);
        let robustness = robustness::sections(self);
        let uncertainty = self.outcome.found.uncertainty.as_ref().map(uncertainty::group);
        let pictures = page::Plots {
            responses,
            omitted,
            convergence,
            front,
            sweep,
            excitation,
            diagnosis,
            robustness,
            uncertainty,
        };
        let findings =
            [&pictures.convergence, &pictures.front, &pictures.sweep, &pictures.excitation, &pictures.uncertainty];
        let groups = pictures.responses.iter().chain(findings.into_iter().flatten());
        let groups = groups.chain(pictures.robustness.iter().map(|section| &section.group));
        let groups = groups.chain(pictures.diagnosis.iter().flat_map(diagnosis::Plots::groups));
        let mut names = FileNames::default();
        let figures = groups.flat_map(|group| &group.figures).flat_map(|figure| &figure.plots);
        let all: Vec<(String, &Plot)> = figures.map(|(name, plot)| (names.unique(name), plot)).collect();
        let earlier = PlotFiles::of(&plots);
        earlier.note(all.iter().map(|(name, _)| name.as_str()))?;
        for (name, plot) in &all {
            files::write(&plots.join(format!("{name}.svg")), plot.svg())?;
            plot.write_png(&plots.join(format!("{name}.png")))?;
        }
        earlier.remove_others(all.iter().map(|(name, _)| name.as_str()))?;
        files::write(&folder.join("report.html"), page::of(self, &pictures).into_string())
    }

    /// Whether a search stands behind the result, and nothing but it.
    fn searched(&self) -> bool {
        match self.outcome.task {
            // The rounds of a design against worst cases have objectives of their own.
            Task::Design | Task::Calibration | Task::Pareto => self.outcome.found.robust.is_none(),
            Task::Sensitivity => self.archive.len() > 1,
            Task::Excitation | Task::Sweep | Task::Diagnosis => false,
            Task::WorstCase | Task::MonteCarlo => self.archive.len() > 1,
        }
    }

    /// What the reported point is called: an optimum only if the solver showed one.
    fn best_name(&self) -> &'static str {
        if self.outcome.solver == "none" {
            "start"
        } else if self.outcome.stop == Stop::Converged && self.outcome.feasible {
            "optimum"
        } else {
            "best point"
        }
    }
}
