//! Figures of a page: plots with captions, in groups.

use crate::plot::Plot;

/// Group of plots with a heading.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// Heading; may be empty.
    pub title: String,
    /// Sentences above the plots.
    pub about: Vec<String>,
    /// Figures, in their order.
    pub figures: Vec<Figure>,
    /// True if every figure takes the full width of the page, and the plots share their range of x.
    pub full_width: bool,
}

/// Column of plots, each with its file name, and the lines of the caption.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// Plots from top to bottom, each with the name of its file.
    pub plots: Vec<(String, Plot)>,
    /// Lines of the caption.
    pub caption: Vec<String>,
    /// Signal of a figure that a page shows on request only, and that is not written as a file.
    pub on_request: Option<String>,
}
