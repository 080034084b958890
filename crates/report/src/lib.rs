//! Reports: one HTML page of a solved study, and its plots as SVG and PNG.
//!
//! [`Report`] writes the files of a run. [`Draw`] draws any plot, [`page()`] wraps any HTML in the style of the
//! reports.
//!
//! | module | content |
//! |---|---|
//! | `page` | the sections of a report in their order |
//! | `criteria`, `tuners`, `matrix` | tables of a report |
//! | `responses`, `comparison`, `front` | plots of the simulations: at the start and at the result, of a front, of a live page |
//! | `convergence` | the best point over the number of evaluations |
//! | `bode`, `nyquist` | plots of linear systems |
//! | `side_by_side` | the page of a comparison of runs |
//! | `markup` | sections of `mops-content` as HTML |
//! | `chart` | data of interactive plots, which `charts.js` draws with uPlot |
//! | `overlay` | lines and regions beside the curves, for both drawings of a plot |
//! | `layout` | from a plot to a scene; its parts are in `axis`, `range`, `clip`, `legend`, `surface`, `parallel_axes` and `space` |
//! | `scene`, `view` | a drawing as marks, in a box as seen from a viewpoint; `svg` and `png` draw it |
//! | `plot_files` | the files of the plots, of which those of earlier runs are removed |

mod axis;
mod bode;
mod chart;
mod clip;
mod comparison;
mod convergence;
mod criteria;
mod front;
mod layout;
mod legend;
mod markup;
mod matrix;
mod nyquist;
mod overlay;
mod page;
mod parallel_axes;
mod plot_files;
mod png;
mod range;
mod responses;
mod scene;
mod side_by_side;
mod space;
mod surface;
mod svg;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_of_diagnosis;
mod tuners;
mod view;

use std::io;
use std::path::Path;

use mops_content::{numbers::FileNames, plot::Plot};
use mops_output::Outputs;
use mops_tasks::{Room, Solution, Solved, calibration};

pub use bode::{FrequencyCurve, bode};
pub use chart::{SCRIPTS as CHART_SCRIPTS, STYLE as CHART_STYLE};
pub use convergence::live as live_convergence;
pub use nyquist::nyquist;
pub use page::page;
use plot_files::PlotFiles;
pub use responses::live as live_responses;
use scene::Scene;
pub use side_by_side::{Responses, Rows, comparison_page};

/// Style sheet of all pages.
pub const STYLE: &str = include_str!("style.css");

/// Content of a report.
pub struct Report<'a> {
    /// Result of the run, with what it rests on.
    pub solution: Solution<'a>,
    /// What performed the task.
    pub room: &'a dyn Room,
    /// Text of the study file, with its settings.
    pub text: &'a str,
}

impl<'a> Report<'a> {
    /// Creates the report of a solved study; `text` is that of its file, with its settings.
    pub fn new(solved: &'a Solved, room: &'a dyn Room, text: &'a str) -> Self {
        Self { solution: solved.into(), room, text }
    }
}

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

    /// Returns the name of the reported point: `optimum` only if the solver converged to a feasible point.
    fn best_name(&self) -> &'static str {
        self.solution.best_name()
    }
}

/// Drawing of a plot.
pub trait Draw {
    /// Returns the plot as an SVG document, which can be embedded in a page. Every element also has a class (`result`,
    /// `start`, ...), so that the style sheet of a page can change its colours.
    fn svg(&self) -> String;

    /// Returns the plot as a PNG file, with two pixels per unit of the SVG.
    ///
    /// # Errors
    /// If a mark cannot be drawn.
    fn png(&self) -> io::Result<Vec<u8>>;
}

impl Draw for Plot {
    fn svg(&self) -> String {
        svg::document(&Scene::of(self), &self.title, &self.description())
    }

    fn png(&self) -> io::Result<Vec<u8>> {
        png::document(&Scene::of(self))
    }
}
