//! Report of a run: one HTML page, and its plots as SVG and PNG.

mod axis;
mod bode;
mod calibration;
mod chart;
mod clip;
mod comparison;
mod contour;
mod convergence;
mod criteria;
mod diagnosis;
mod excitation;
mod figures;
mod front;
mod jumps;
mod legend;
mod matrix;
mod nyquist;
mod page;
mod parallel_axes;
mod plot;
mod plot_files;
mod png;
mod range;
mod responses;
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

use std::io;
use std::path::Path;

use mops_core::{Evaluation, Problem, Stop, Task, run::Record};
use mops_outcome::Outcome;

use crate::files::Outputs;
use crate::numbers::FileNames;

pub(crate) use bode::{FrequencyCurve, bode};
pub(crate) use chart::{SCRIPTS, STYLE as CHART_STYLE};
pub(crate) use nyquist::nyquist;
pub use page::page;
pub use plot::{Band, Color, Curve, CurveStyle, Level, ParallelAxis, Plot, Surface, ZAxis};
use plot_files::PlotFiles;
pub(crate) use responses::live;
pub(crate) use sampling::{points, thinned};
pub(crate) use sensitivity::combination;
pub(crate) use side_by_side::{Responses, Rows, comparison_page};

/// Style sheet of all pages.
pub(crate) const STYLE: &str = include_str!("style.css");

/// Content of a report.
pub struct Report<'a> {
    /// Result of the run.
    pub outcome: &'a Outcome,
    /// Solved problem.
    pub problem: &'a Problem,
    /// Evaluation at the reported point.
    pub best: &'a Evaluation,
    /// All points in the order of evaluation; the first is the initial guess.
    pub archive: &'a [Record],
    /// Points of the Pareto front, in the order of the result; empty for other tasks.
    pub front: &'a [Evaluation],
    /// Text of the study file, with its settings.
    pub text: &'a str,
}

impl Report<'_> {
    /// Writes `report.html`, `plots/*.svg` and `plots/*.png` into the folder, which is created if necessary.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        self.write_by(folder, &Outputs::default()).map(|_| ())
    }

    /// Writes as [`Report::write`], but no file that is an input of the command. Returns the number of plots that were not written,
    /// as the run was asked to stop; it is asked before every plot.
    pub(crate) fn write_by(&self, folder: &Path, outputs: &Outputs) -> io::Result<usize> {
        let plots = folder.join("plots");
        outputs.folder(&plots)?;
        let (responses, omitted) = responses::groups(self);
        let convergence = self.searched().then(|| convergence::group(self.problem.study(), self.archive));
        let front = front::group(self);
        let sweep = self.outcome.found.sweep.as_ref().map(|sweep| sweep::group(sweep, self.best_name()));
        let inputs = match &self.outcome.found.excitation {
            Some(found) => Some(&found.inputs),
            None => self.outcome.calibration.as_ref().map(|calibration| &calibration.excitation),
        };
        let excitation = inputs.filter(|inputs| !inputs.is_empty()).map(|inputs| excitation::group(inputs));
        let diagnosis = self.outcome.found.diagnosis.as_ref().map(diagnosis::Plots::of);
        let robustness = robustness::sections(self);
        let uncertainty = self.outcome.found.uncertainty.as_ref().map(uncertainty::group);
        let sections = page::Plots {
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
            [&sections.convergence, &sections.front, &sections.sweep, &sections.excitation, &sections.uncertainty];
        let groups = sections.responses.iter().chain(findings.into_iter().flatten());
        let groups = groups.chain(sections.robustness.iter().map(|section| &section.group));
        let groups = groups.chain(sections.diagnosis.iter().flat_map(diagnosis::Plots::groups));
        let mut names = FileNames::default();
        let figures = groups.flat_map(|group| &group.figures).filter(|figure| figure.on_request.is_none());
        let figures = figures.flat_map(|figure| &figure.plots);
        let all: Vec<(String, &Plot)> = figures.map(|(name, plot)| (names.unique(name), plot)).collect();
        let earlier = PlotFiles::of(&plots, outputs);
        earlier.note(all.iter().map(|(name, _)| name.as_str()))?;
        let mut missing = 0;
        for (i, (name, plot)) in all.iter().enumerate() {
            if self.problem.is_cancelled() {
                missing = all.len() - i;
                break;
            }
            outputs.write(&plots.join(format!("{name}.svg")), plot.svg())?;
            outputs.write(&plots.join(format!("{name}.png")), plot.png()?)?;
        }
        earlier.remove_others(all.iter().take(all.len() - missing).map(|(name, _)| name.as_str()))?;
        outputs.write(&folder.join("report.html"), page::of(self, &sections).into_string())?;
        Ok(missing)
    }

    /// Returns true if the result is that of a single search, so that its convergence can be plotted.
    fn searched(&self) -> bool {
        match self.outcome.task {
            // Each round of a design against worst cases has its own objective.
            Task::Design | Task::Calibration | Task::Pareto => self.outcome.found.robust.is_none(),
            Task::Sensitivity => self.archive.len() > 1,
            Task::Excitation | Task::Sweep | Task::Diagnosis => false,
            Task::WorstCase | Task::MonteCarlo => self.archive.len() > 1,
        }
    }

    /// Returns the name of the reported point: `optimum` only if the solver converged to a feasible point.
    fn best_name(&self) -> &'static str {
        if self.outcome.solver == "none" {
            "initial guess"
        } else if self.outcome.stop == Stop::Converged && self.outcome.feasible {
            "optimum"
        } else {
            "best point"
        }
    }
}
