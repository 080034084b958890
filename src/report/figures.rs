//! Figures of a page: plots with captions, in groups.

use super::plot::Plot;

/// Group of plots with a heading.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) title: String,
    /// Sentences above the plots.
    pub(super) about: Vec<String>,
    pub(super) figures: Vec<Figure>,
    /// True if every figure takes the full width of the page, and the plots share their range of x.
    pub(super) full_width: bool,
}

/// Column of plots, each with its file name, and the lines of the caption.
#[derive(Debug, Default)]
pub(super) struct Figure {
    pub(super) plots: Vec<(String, Plot)>,
    pub(super) caption: Vec<String>,
    /// Signal of a figure that a page shows on request only, and that is not written as a file.
    pub(super) on_request: Option<String>,
}
