//! Legend and markers of a plot.

use std::collections::HashSet;

use mops_content::plot::{Color, CurveStyle, Plot};

use super::clip::{Frame, Point};
use super::scene::{ADVANCE, Anchor, Mark, SIZE, Scene};

impl Scene {
    /// Draws dots; of coinciding dots only one.
    pub(super) fn dots(&mut self, points: impl Iterator<Item = Point>, color: Color) {
        let mut seen = HashSet::new();
        let centres: Vec<Point> = points.filter(|p| seen.insert(p.map(|v| v.round() as i64))).collect();
        // Dots are larger if there are few.
        let radius = if centres.len() < 60 { 2.4 } else { 1.5 };
        self.marks.push(Mark::Dots { centres, color, radius });
    }

    /// Draws a cross.
    pub(super) fn cross(&mut self, at: Point, color: Color) {
        for turn in [-1.0, 1.0] {
            let points = vec![[at[0] - 4.0, at[1] - 4.0 * turn], [at[0] + 4.0, at[1] + 4.0 * turn]];
            self.marks.push(Mark::Line { points, color, width: 1.8, dashed: false });
        }
    }

    /// Draws the legend in rows, the first at `row`. Returns the position of its end.
    pub(super) fn legend(&mut self, plot: &Plot, mut row: f64) -> f64 {
        let bands = plot.bands.iter().map(|band| (band.name.as_str(), Color::Band, CurveStyle::Line));
        let curves = plot.shown().filter(|c| !c.points.is_empty()).map(|c| (c.name.as_str(), c.color, c.style));
        let mut at = 10.0;
        // Curves of one case have one entry, in the style of the last curve, which is on top.
        let mut entries: Vec<(&str, Color, CurveStyle)> = Vec::new();
        for entry in curves.chain(bands).filter(|(name, ..)| !name.is_empty()) {
            match entries.iter_mut().find(|known| known.0 == entry.0) {
                Some(known) => *known = entry,
                None => entries.push(entry),
            }
        }
        for (name, color, style) in entries {
            let width = 46.0 + ADVANCE * name.chars().count() as f64;
            if at + width > SIZE[0] && at > 10.0 {
                (at, row) = (10.0, row + 17.0);
            }
            let (a, b) = ([at, row], [at + 24.0, row]);
            self.marks.push(match (color, style) {
                (Color::Band, _) => {
                    Mark::Box { frame: Frame { from: [at, row - 5.0], to: [at + 24.0, row + 5.0] }, color }
                }
                (_, CurveStyle::Dots) => {
                    Mark::Dots { centres: [4.0, 12.0, 20.0].map(|d| [at + d, row]).to_vec(), color, radius: 2.0 }
                }
                (_, CurveStyle::Crosses) => {
                    [5.0, 19.0].into_iter().for_each(|d| self.cross([at + d, row], color));
                    self.text(name, [at + 30.0, row], Anchor::Start, Color::Faint);
                    at += width;
                    continue;
                }
                (_, style) => Mark::Line { points: vec![a, b], color, width: 1.8, dashed: style == CurveStyle::Dashed },
            });
            self.text(name, [at + 30.0, row], Anchor::Start, Color::Faint);
            at += width;
        }
        if at > 10.0 { row + 8.0 } else { row - 16.0 }
    }
}
