//! Drawing of plots.

use std::io;

use mops_content::plot::Plot;

use crate::scene::Scene;
use crate::{png, svg};

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
