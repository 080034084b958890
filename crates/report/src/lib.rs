//! Reports: one HTML page of a solved study, and its plots as SVG and PNG.
//!
//! [`Report`] writes the files of a run. [`Draw`] draws any plot, [`page()`] wraps any HTML in the style of the
//! reports.
//!
//! | module | content |
//! |---|---|
//! | `page` | the sections of a report in their order |
//! | `content`, `write` | what a report rests on, and the files that it writes |
//! | `criteria`, `tuners`, `matrix` | tables of a report |
//! | `responses`, `comparison`, `front` | plots of the simulations: at the start and at the result, of a front, of a live page |
//! | `convergence` | the best point over the number of evaluations |
//! | `bode`, `nyquist` | plots of linear systems |
//! | `side_by_side` | the page of a comparison of runs |
//! | `markup` | sections of `mops-content` as HTML |
//! | `chart` | data of interactive plots, which `charts.js` draws with uPlot |
//! | `layout` | from a plot to a scene; its parts are in `axis`, `range`, `clip`, `legend`, `surface`, `parallel_axes` and `space` |
//! | `scene`, `view` | a drawing as marks, in a box as seen from a viewpoint; `svg` and `png` draw it |
//! | `plot_files` | the files of the plots, of which those of earlier runs are removed |

mod axis;
mod bode;
mod chart;
mod clip;
mod comparison;
mod content;
mod convergence;
mod criteria;
mod draw;
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
mod write;

pub use bode::{FrequencyCurve, bode};
pub use chart::{SCRIPTS as CHART_SCRIPTS, STYLE as CHART_STYLE};
pub use content::Report;
pub use convergence::live as live_convergence;
pub use draw::Draw;
pub use nyquist::nyquist;
pub use page::{STYLE, page};
pub use responses::live as live_responses;
pub use side_by_side::{Responses, Rows, comparison_page};
