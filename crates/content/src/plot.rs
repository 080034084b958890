//! Plots: curves, levels, bands and surfaces, without a renderer.

use mops_core::criterion::Side;

/// Colour of a mark, by its meaning. The page and the style sheet map it to light and dark schemes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Color {
    /// Titles and labels.
    Text,
    /// Axes and their numbers.
    Faint,
    /// Grid and frame.
    Grid,
    /// Result of the study.
    #[default]
    Result,
    /// Initial guess.
    Start,
    /// Measurements.
    Measured,
    /// Demands.
    Demand,
    /// Expected range.
    Band,
    /// Region excluded by a demand.
    Excluded,
    /// Index of one of several curves of equal rank, from 0.
    Series(usize),
}

/// Style of a curve.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CurveStyle {
    /// Solid line.
    #[default]
    Line,
    /// Dashed line.
    Dashed,
    /// Dot at every point.
    Dots,
    /// Cross at every point.
    Crosses,
}

/// Curve of a plot. Non-finite points are omitted; a line has a gap there.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Name in the legend; not listed if empty.
    pub name: String,
    /// Points `(x, y)`.
    pub points: Vec<(f64, f64)>,
    /// Style of the points.
    pub style: CurveStyle,
    /// Colour of the points.
    pub color: Color,
    /// Index of the front point of the curve; a page highlights the curve if the point is selected.
    pub front_point: Option<usize>,
    /// True if the curve may leave the frame: it widens the range at most to three times that of the other curves.
    pub may_leave: bool,
    /// Point at which the curve was computed, such as `initial guess`, if the name is that of a case.
    pub variant: String,
    /// True if the curve is only shown on request, in a page.
    pub hidden: bool,
}

/// Horizontal or vertical line, such as a demand. A horizontal line widens the range at most to three times that of the
/// curves; beyond that it is not shown.
#[derive(Debug, Clone, Default)]
pub struct Level {
    /// Label at its right or upper end; may be empty.
    pub name: String,
    /// Value along y, or along x.
    pub value: f64,
}

/// Bound of the curves, such as a part of an envelope: a straight line with the excluded region beyond. Its line widens
/// the range as a [`Level`] does.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Label at its right end; may be empty.
    pub name: String,
    /// Start and end along x; may be infinite.
    pub x: [f64; 2],
    /// Values at the start and the end.
    pub y: [f64; 2],
    /// Excluded side, drawn as a region.
    pub excluded: Option<Side>,
    /// Names of the curves that it applies to; empty for all. Otherwise its region is only drawn in a page that hides
    /// all other curves.
    pub applies_to: Vec<String>,
}

/// Range of values behind the curves, such as the noise level.
#[derive(Debug, Clone, Default)]
pub struct Band {
    /// Name in the legend.
    pub name: String,
    /// Lower and upper end.
    pub range: [f64; 2],
}

/// Surface over a grid, drawn as colours behind the curves.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Name of the values, with their unit.
    pub label: String,
    /// Grid points along x, increasing; at least two.
    pub x: Vec<f64>,
    /// Grid points along y, increasing; at least two.
    pub y: Vec<f64>,
    /// Values, `y.len()` rows of `x.len()` numbers. Non-finite values are left blank.
    pub values: Vec<Vec<f64>>,
    /// True for a logarithmic colour scale; values that are not positive are then left blank.
    pub log: bool,
}

/// Vertical axis of a three-dimensional plot.
#[derive(Debug, Clone, Default)]
pub struct ZAxis {
    /// Quantity and unit along the axis.
    pub label: String,
    /// Values along the axis: for every curve, one per point.
    pub values: Vec<Vec<f64>>,
}

/// Vertical axis of parallel coordinates. Curves have values from 0 at the lower to 1 at the upper end.
#[derive(Debug, Clone, Default)]
pub struct ParallelAxis {
    /// Quantity and unit along the axis.
    pub name: String,
    /// Labels of the lower and the upper end.
    pub ends: [String; 2],
}

/// Plot. Curves are drawn in their order, the last on top.
#[derive(Debug, Clone, Default)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Quantity and unit along x, such as `time (s)`.
    pub x_label: String,
    /// Quantity and unit along y.
    pub y_label: String,
    /// Curves.
    pub curves: Vec<Curve>,
    /// Horizontal lines.
    pub levels: Vec<Level>,
    /// Bounds with excluded regions.
    pub bounds: Vec<Bound>,
    /// Ranges behind the curves.
    pub bands: Vec<Band>,
    /// Range of x to be included; the range of the curves if `None`.
    pub x_range: Option<[f64; 2]>,
    /// True if x is logarithmic; values that are not positive are then omitted.
    pub log_x: bool,
    /// True if y is logarithmic; values that are not positive are then omitted.
    pub log_y: bool,
    /// Vertical lines.
    pub verticals: Vec<Level>,
    /// Range of x to be shown, if it is a part of the whole. A page can show the whole.
    pub window: Option<[f64; 2]>,
    /// True for equal scales along x and y, so that a circle is round.
    pub equal: bool,
    /// True if y is an angle in degrees, with ticks at multiples of 45.
    pub degrees: bool,
    /// True for a plot that supplements another, such as a residual; a page draws it lower.
    pub supplement: bool,
    /// Surface behind the curves; its grid determines the ranges of x and y.
    pub surface: Option<Surface>,
    /// Vertical axis of a three-dimensional plot, in which all curves are dots.
    pub z_axis: Option<ZAxis>,
    /// Axes of parallel coordinates at x = 0, 1, 2, ..., in place of the x and y axes.
    pub parallel_axes: Vec<ParallelAxis>,
}

impl Plot {
    /// Returns the curves that are not hidden.
    pub fn shown(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|curve| !curve.hidden)
    }

    /// Returns a description for screen readers: the range of every curve.
    pub fn description(&self) -> String {
        let mut text = format!("{} over {}.", self.y_label, self.x_label);
        for curve in self.shown() {
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
