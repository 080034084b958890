//! Drawing of a plot: lines, dots, rectangles and texts with their coordinates, for SVG and PNG alike.

use mops_content::plot::Color;

use super::clip::{Frame, Point};
use super::view::{Point3, View};

/// Width and height of every plot; one unit is a CSS pixel.
pub(super) const SIZE: Point = [560.0, 300.0];
/// Font size.
pub(super) const LETTER: f64 = 12.0;
/// Mean width of a letter.
pub(super) const ADVANCE: f64 = 0.6 * LETTER;

/// Element of a drawing.
#[derive(Debug, Clone)]
pub(super) enum Mark {
    Line {
        points: Vec<Point>,
        color: Color,
        width: f64,
        dashed: bool,
    },
    Dots {
        centres: Vec<Point>,
        color: Color,
        radius: f64,
    },
    Box {
        frame: Frame,
        color: Color,
    },
    /// Filled polygon.
    Area {
        points: Vec<Point>,
        color: Color,
    },
    /// Box of a fixed colour, independent of the colour scheme.
    Cell {
        frame: Frame,
        rgb: [u8; 3],
    },
    /// Text. `at` is at mid-height; horizontally at the left end, middle or right end, according to `anchor`.
    Text {
        text: String,
        at: Point,
        anchor: Anchor,
        size: f64,
        color: Color,
        upwards: bool,
    },
    /// Marks of a point of a front: a line or a dot.
    FrontPoint {
        point: usize,
        marks: Vec<Self>,
    },
    /// Mark in the box of a three-dimensional plot: its points in the box, and the mark in the initial view.
    InSpace {
        points: Vec<Point3>,
        mark: Box<Self>,
    },
}

/// Part of a text that its position refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Drawing: all marks, from back to front.
#[derive(Debug, Clone, Default)]
pub(super) struct Scene {
    pub(super) marks: Vec<Mark>,
    /// View of the box of [`Mark::InSpace`].
    pub(super) view: Option<View>,
}

impl Scene {
    /// Draws a text; none if it is empty.
    pub(super) fn text(&mut self, text: &str, at: Point, anchor: Anchor, color: Color) {
        if !text.is_empty() {
            let size = if color == Color::Text { LETTER + 1.0 } else { LETTER };
            self.marks.push(Mark::Text { text: text.to_owned(), at, anchor, size, color, upwards: false });
        }
    }
}
