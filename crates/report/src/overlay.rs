//! Lines and regions of a plot beside its curves, in the coordinates of its axes, for the static and the interactive
//! drawing alike.

use mops_content::plot::{Bound, Color, Plot};
use mops_core::criterion::Side;

use super::range::drawable;

/// All values of an axis.
const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Line between two points; straight on the drawing. An infinite coordinate is that of the edge of the frame.
#[derive(Debug, PartialEq)]
pub(super) struct Line<'p> {
    pub(super) name: &'p str,
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
    pub(super) color: Color,
    pub(super) name_color: Color,
    pub(super) dashed: bool,
    /// Names of the curves that it applies to; empty for all.
    pub(super) applies_to: &'p [String],
}

impl Line<'_> {
    pub(super) fn is_vertical(&self) -> bool {
        self.x[0] == self.x[1]
    }
}

/// Region between two lines with the same ends along x. An infinite coordinate is that of the edge of the frame.
#[derive(Debug, PartialEq)]
pub(super) struct Region<'p> {
    pub(super) x: [f64; 2],
    pub(super) lower: [f64; 2],
    pub(super) upper: [f64; 2],
    pub(super) color: Color,
    /// Names of the curves that it applies to; empty for all.
    pub(super) applies_to: &'p [String],
}

/// Returns levels, bounds and vertical lines.
pub(super) fn lines(plot: &Plot) -> Vec<Line<'_>> {
    let levels = plot.levels.iter().filter(|level| drawable(level.value, plot.log_y).is_some());
    let levels = levels.map(|level| demand(&level.name, ALL, [level.value; 2], &[]));
    let bounds = bounds(plot).map(|(bound, x)| demand(&bound.name, x, bound.y, &bound.applies_to));
    let verticals = plot.verticals.iter().filter(|line| drawable(line.value, plot.log_x).is_some());
    let verticals = verticals.map(|line| Line {
        color: Color::Start,
        name_color: Color::Faint,
        dashed: false,
        ..demand(&line.name, [line.value; 2], ALL, &[])
    });
    levels.chain(bounds).chain(verticals).collect()
}

fn demand<'p>(name: &'p str, x: [f64; 2], y: [f64; 2], applies_to: &'p [String]) -> Line<'p> {
    Line { name, x, y, color: Color::Demand, name_color: Color::Demand, dashed: true, applies_to }
}

/// Returns bands and excluded regions, from back to front.
pub(super) fn regions(plot: &Plot) -> Vec<Region<'_>> {
    let bands = plot.bands.iter().map(|band| [band.range[0].min(band.range[1]), band.range[0].max(band.range[1])]);
    let bands = bands.filter(|range| range.iter().all(|v| drawable(*v, plot.log_y).is_some()));
    let bands = bands.map(|[low, high]| Region {
        x: ALL,
        lower: [low; 2],
        upper: [high; 2],
        color: Color::Band,
        applies_to: &[],
    });
    let excluded = bounds(plot).filter_map(|(bound, x)| {
        let [lower, upper] = match bound.excluded? {
            Side::Above => [bound.y, [f64::INFINITY; 2]],
            Side::Below => [[f64::NEG_INFINITY; 2], bound.y],
        };
        Some(Region { x, lower, upper, color: Color::Excluded, applies_to: &bound.applies_to })
    });
    bands.chain(excluded).collect()
}

/// Returns the bounds that can be drawn, with their ends along x.
fn bounds(plot: &Plot) -> impl Iterator<Item = (&Bound, [f64; 2])> {
    let can_be_drawn = |bound: &&Bound| bound.y.iter().all(|v| drawable(*v, plot.log_y).is_some());
    // A logarithmic axis has no zero: a bound that starts there starts at the edge.
    let end = |at: f64, edge: f64| drawable(at, plot.log_x).map_or(edge, |_| at);
    plot.bounds
        .iter()
        .filter(can_be_drawn)
        .map(move |bound| (bound, [end(bound.x[0], ALL[0]), end(bound.x[1], ALL[1])]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_content::plot::{Band, Level};

    #[test]
    fn bounds_levels_and_bands_are_lines_and_regions_up_to_the_edges() {
        let bound = Bound {
            name: "band".into(),
            x: [15.0, f64::INFINITY],
            y: [0.9, 0.9],
            excluded: Some(Side::Below),
            applies_to: vec!["worst".into()],
        };
        let named = |name: &str, value| Level { name: name.into(), value };
        let plot = Plot {
            bounds: vec![bound],
            levels: vec![named("demand", 1.0)],
            verticals: vec![named("crossover", 3.0)],
            bands: vec![Band { name: "noise".into(), range: [0.2, -0.2] }],
            ..Plot::default()
        };
        let lines = lines(&plot);
        let ends: Vec<_> = lines.iter().map(|line| (line.name, line.x, line.y)).collect();
        let bound_x = [15.0, f64::INFINITY];
        assert_eq!(ends, [("demand", ALL, [1.0; 2]), ("band", bound_x, [0.9; 2]), ("crossover", [3.0; 2], ALL)]);
        assert!(lines[1].applies_to == ["worst"] && lines[2].is_vertical() && !lines[2].dashed);
        let regions = regions(&plot);
        assert_eq!((regions[0].lower, regions[0].upper, regions[0].x), ([-0.2; 2], [0.2; 2], ALL));
        assert_eq!((regions[1].lower, regions[1].upper, regions[1].x), ([ALL[0]; 2], [0.9; 2], bound_x));
        // A logarithmic axis has neither zero nor negative values.
        let log = Plot { log_y: true, levels: vec![named("zero", 0.0)], bounds: Vec::new(), ..plot };
        assert!(super::lines(&log).iter().all(Line::is_vertical) && super::regions(&log).is_empty());
    }
}
