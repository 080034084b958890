//! Parallel coordinates: a vertical axis for every quantity, with its name and its end values.

use mops_content::plot::{Color, ParallelAxis};

use super::axis::Axis;
use super::clip::Frame;
use super::scene::{ADVANCE, Anchor, Mark, SIZE, Scene};

impl Scene {
    /// Draws the axes at x = 0, 1, 2, ..., from 0 to 1.
    pub(super) fn parallel_axes(&mut self, axes: &[ParallelAxis], [x, y]: [&Axis; 2], Frame { from, to }: Frame) {
        let height = |value: f64| to[1] - y.position(value).unwrap_or(value) * (to[1] - from[1]);
        let (foot, head) = (height(0.0), height(1.0));
        let width = (to[0] - from[0]) / axes.len().saturating_sub(1).max(1) as f64;
        // Names that would touch are in two rows.
        let longest = axes.iter().map(|axis| axis.name.chars().count()).max().unwrap_or(0) as f64;
        let rows = if ADVANCE * (longest + 1.0) > width { 2 } else { 1 };
        let room = (rows as f64 * width / ADVANCE) as usize;
        for (i, axis) in axes.iter().enumerate() {
            let px = from[0] + x.position(i as f64).unwrap_or(0.0) * (to[0] - from[0]);
            self.marks.push(Mark::Line {
                points: vec![[px, foot], [px, head]],
                color: Color::Faint,
                width: 1.0,
                dashed: false,
            });
            let mut label = |text: &str, y: f64| {
                // Labels stay within the drawing.
                let half = 0.5 * ADVANCE * text.chars().count() as f64;
                let at = px.clamp(half, (SIZE[0] - half).max(half));
                self.text(text, [at, y], Anchor::Middle, Color::Faint);
            };
            label(&axis.ends[1], head - 9.0);
            label(&axis.ends[0], foot + 10.0);
            label(&shortened(&axis.name, room), foot + 25.0 + 14.0 * (i % rows) as f64);
        }
    }
}

/// Shortens a name to `room` letters (at least 4). The end is kept: the criterion follows the case and distinguishes
/// better.
fn shortened(name: &str, room: usize) -> String {
    let count = name.chars().count();
    if count <= room.max(4) {
        return name.to_owned();
    }
    let end: String = name.chars().skip(count + 1 - room.max(4)).collect();
    format!("\u{2026}{end}")
}

#[cfg(test)]
mod tests {
    use super::shortened;

    #[test]
    fn a_long_name_keeps_its_end() {
        assert_eq!(shortened("nominal, overshoot", 10), "\u{2026}overshoot");
        assert_eq!((shortened("k", 4).as_str(), shortened("Td (s)", 6).as_str()), ("k", "Td (s)"));
    }
}
