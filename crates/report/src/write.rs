//! Writing of a report: its page and its plots.

use std::io;
use std::path::Path;

use mops_content::{numbers::FileNames, plot::Plot};
use mops_output::Outputs;
use mops_tasks::calibration;

use crate::content::Report;
use crate::draw::Draw;
use crate::plot_files::PlotFiles;
use crate::{convergence, page, responses};

impl Report<'_> {
    /// Writes `report.html`, `plots/*.svg` and `plots/*.png` into the folder, which is created if necessary.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        self.write_by(folder, &Outputs::default()).map(|_| ())
    }

    /// Writes as [`Report::write`], but no file that is an input of the command. Returns the number of plots that were
    /// not written, as the run was asked to stop; it is asked before every plot.
    ///
    /// # Errors
    /// As [`Report::write`].
    pub fn write_by(&self, folder: &Path, outputs: &Outputs) -> io::Result<usize> {
        let plots = folder.join("plots");
        outputs.folder(&plots)?;
        let of = &self.solution;
        let (responses, omitted) = responses::groups(self);
        let convergence = self.room.has_convergence(of).then(|| convergence::group(of.problem.study(), of.archive));
        let content = page::Content {
            findings: self.room.findings(of),
            details: self.room.details(of),
            responses,
            omitted,
            convergence,
            calibration: calibration::sections(of.outcome),
        };
        let mut names = FileNames::default();
        let figures = content.groups().flat_map(|group| &group.figures).filter(|figure| figure.on_request.is_none());
        let figures = figures.flat_map(|figure| &figure.plots);
        let all: Vec<(String, &Plot)> = figures.map(|(name, plot)| (names.unique(name), plot)).collect();
        let earlier = PlotFiles::of(&plots, outputs);
        earlier.note(all.iter().map(|(name, _)| name.as_str()))?;
        let mut missing = 0;
        for (i, (name, plot)) in all.iter().enumerate() {
            if of.problem.is_cancelled() {
                missing = all.len() - i;
                break;
            }
            outputs.write(&plots.join(format!("{name}.svg")), plot.svg())?;
            outputs.write(&plots.join(format!("{name}.png")), plot.png()?)?;
        }
        earlier.remove_others(all.iter().take(all.len() - missing).map(|(name, _)| name.as_str()))?;
        outputs.write(&folder.join("report.html"), page::of(self, &content).into_string())?;
        Ok(missing)
    }
}
