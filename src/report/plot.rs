//! A plot over one axis: curves, levels and bands, drawn as SVG for pages and as PNG for everything else.

use std::io;
use std::path::Path;

use super::scene::Scene;
use super::{png, svg};

/// What a mark stands for; this gives it its colour, on white paper and on a dark page.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Color {
    /// Titles and labels.
    Text,
    /// Numbers at the axes.
    Faint,
    /// Grid and frame.
    Grid,
    /// What the study found.
    #[default]
    Result,
    /// What it started from.
    Start,
    /// What was measured.
    Measured,
    /// What is asked for.
    Demand,
    /// The range that is expected.
    Band,
    /// One of several curves of equal rank, counted from 0.
    Series(usize),
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CurveStyle {
    /// A solid line.
    #[default]
    Line,
    /// A dashed line.
    Dashed,
    /// A dot for every point.
    Dots,
    /// A cross for every point.
    Crosses,
}

/// Points with a name. Points that are not finite are left out; a line has a gap there.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Name in the legend; without one it does not appear there.
    pub name: String,
    /// The points.
    pub points: Vec<(f64, f64)>,
    /// How they are drawn.
    pub style: CurveStyle,
    /// What they stand for.
    pub color: Color,
    /// The point of a front that it belongs to, by index: a page marks it where that point is chosen.
    pub front_point: Option<usize>,
    /// Whether the curve may leave the picture: it widens the shown range to three times that of the others at most.
    pub may_leave: bool,
}

/// A horizontal line, such as a demand. It widens the shown range to three times that of the curves at most; farther
/// away it is not shown.
#[derive(Debug, Clone, Default)]
pub struct Level {
    /// Label at its right end; may be empty.
    pub name: String,
    /// Where it lies.
    pub value: f64,
}

/// A range of values behind the curves, such as that of noise.
#[derive(Debug, Clone, Default)]
pub struct Band {
    /// Name in the legend.
    pub name: String,
    /// Lower and upper end.
    pub range: [f64; 2],
}

/// Heights over a grid, drawn as colours behind the curves.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Name of the height, with its unit.
    pub label: String,
    /// Places along x, increasing; at least two.
    pub x: Vec<f64>,
    /// Places along y, increasing; at least two.
    pub y: Vec<f64>,
    /// Heights: a row for every place along y, with a number for every place along x. Those that are not finite are left
    /// blank.
    pub values: Vec<Vec<f64>>,
    /// Whether heights are told apart by their logarithms; those that are not positive are then left blank.
    pub log: bool,
}

/// A third axis, upwards, for points in space.
#[derive(Debug, Clone, Default)]
pub struct ZAxis {
    /// Quantity and unit along it.
    pub label: String,
    /// For every curve the values that belong to its points.
    pub values: Vec<Vec<f64>>,
}

/// An upright axis of parallel coordinates, on which curves run from 0 at its foot to 1 at its head.
#[derive(Debug, Clone, Default)]
pub struct ParallelAxis {
    /// The quantity.
    pub name: String,
    /// What stands at its foot and at its head.
    pub ends: [String; 2],
}

/// A plot. Curves are drawn in their order, the last on top.
#[derive(Debug, Clone, Default)]
pub struct Plot {
    /// What is shown.
    pub title: String,
    /// Quantity and unit along x, such as `time (s)`.
    pub x_label: String,
    /// Quantity and unit along y.
    pub y_label: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Horizontal lines.
    pub levels: Vec<Level>,
    /// Ranges behind the curves.
    pub bands: Vec<Band>,
    /// Shown range of x; that of the curves where absent.
    pub x_range: Option<[f64; 2]>,
    /// Whether x is logarithmic; values that are not positive are then left out.
    pub log_x: bool,
    /// Whether y is logarithmic; values that are not positive are then left out.
    pub log_y: bool,
    /// Where a faint line runs from top to bottom.
    pub vertical: Option<f64>,
    /// Whether a unit is as long along x as along y, so that a circle is round.
    pub equal: bool,
    /// Whether y is an angle in degrees: ticks stand at multiples of 45.
    pub degrees: bool,
    /// A surface behind the curves; its grid is then what is shown of x and y.
    pub surface: Option<Surface>,
    /// A third axis: the points of all curves are then dots in a box.
    pub z_axis: Option<ZAxis>,
    /// Axes of parallel coordinates, at x = 0, 1, 2, ..., instead of the others.
    pub parallel_axes: Vec<ParallelAxis>,
}

impl Plot {
    /// The plot as an SVG document, which may stand in a page as it is. Every element also carries a class (`result`,
    /// `start`, ...), so that the style sheet of a page can change its colours.
    pub fn svg(&self) -> String {
        svg::document(&Scene::of(self), &self.title, &self.description())
    }

    /// Writes the plot as a PNG of two pixels per unit of the SVG.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_png(&self, path: &Path) -> io::Result<()> {
        png::write(&Scene::of(self), path)
    }

    /// What a reader who cannot see the plot is told: the range of every curve.
    fn description(&self) -> String {
        let mut text = format!("{} over {}.", self.y_label, self.x_label);
        for curve in &self.curves {
            let values = || curve.points.iter().map(|(_, y)| *y).filter(|y| y.is_finite());
            if let (Some(low), Some(high), Some(last)) =
                (values().reduce(f64::min), values().reduce(f64::max), values().next_back())
            {
                let [low, high, last] = [low, high, last].map(crate::numbers::number);
                text.push_str(&format!(" {}: from {low} to {high}, {last} at the end.", curve.name));
            }
        }
        text
    }
}
