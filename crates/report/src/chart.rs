//! Interactive plots of a page: data for the script `charts.js`, which draws them with uPlot in place of the SVG.

use super::Draw;
use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use mops_content::{
    plot::{Color, Curve, CurveStyle, Plot},
    sampling::thinned,
};
use mops_language::plain::escaped;

use super::axis::DEGREES;
use super::clip::{Point, simplified};
use super::overlay::{Line, Region, lines, regions};
use super::range::{drawable, x_range, y_range};
use super::svg::class;

/// Style sheet and scripts of pages with interactive plots. uPlot 1.6.32: <https://github.com/leeoniya/uPlot>, MIT
/// licence.
pub const STYLE: &str = include_str!("../assets/uPlot.min.css");
/// Scripts of pages with interactive plots.
pub const SCRIPTS: [&str; 3] =
    [include_str!("../assets/uPlot.iife.min.js"), include_str!("elements.js"), include_str!("charts.js")];

/// Largest distance of a simplified line from the original, as a share of the ranges of the axes. At a magnification of
/// 20 it is less than a quarter of a pixel of a plot 1000 pixels wide.
const TOLERANCE: f64 = 1e-5;

/// Returns the plot as an SVG, with the data of the interactive plot if it is one of curves over x.
pub(super) fn markup(plot: &Plot) -> Markup {
    html! {
        @if is_chart(plot) {
            div class="chart" {
                (PreEscaped(plot.svg()))
                script type="application/json" { (PreEscaped(text(plot).replace('<', "\\u003c"))) }
            }
        } @else {
            div class="wide" { (PreEscaped(plot.svg())) }
        }
    }
}

/// Returns the data of an interactive plot as text, in which escaped characters are shown as in the other text of the
/// page.
fn text(plot: &Plot) -> String {
    escaped(&data(plot).to_string(), |c| format!("\\\\{}", &c.escape_unicode().to_string()[1..])).into_owned()
}

/// Returns true if the plot has curves over x that no other part of the page refers to.
fn is_chart(plot: &Plot) -> bool {
    let is_plane = plot.surface.is_none() && plot.z_axis.is_none() && plot.parallel_axes.is_empty() && !plot.equal;
    let of_front = plot.curves.iter().any(|curve| curve.front_point.is_some());
    is_plane && !of_front && y_range(plot).is_some()
}

/// Returns the data of an interactive plot.
pub(super) fn data(plot: &Plot) -> Value {
    let whole = x_range(&Plot { window: None, ..plot.clone() }).unwrap_or([0.0, 1.0]);
    let height = y_range(&Plot { window: None, ..plot.clone() }).unwrap_or([0.0, 1.0]);
    let size = [whole[1] - whole[0], height[1] - height[0]];
    let curves: Vec<Value> =
        plot.curves.iter().filter(|c| !c.points.is_empty()).map(|c| curve(plot, c, size)).collect();
    let line = |line: &Line<'_>| {
        json!({
            "name": line.name, "x": line.x.map(number), "y": line.y.map(number), "dashed": line.dashed,
            "color": class(line.color), "nameColor": class(line.name_color), "of": line.applies_to,
        })
    };
    let region = |region: &Region<'_>| {
        json!({
            "x": region.x.map(number), "lower": region.lower.map(number), "upper": region.upper.map(number),
            "color": class(region.color), "of": region.applies_to,
        })
    };
    json!({
        "title": plot.title, "about": plot.description(),
        "x": plot.x_label, "y": plot.y_label,
        "logX": plot.log_x, "logY": plot.log_y, "steps": plot.degrees.then_some(DEGREES), "supplement": plot.supplement,
        "range": plot.x_range.map(|range| range.map(number)), "window": plot.window.map(|window| window.map(number)),
        "curves": curves,
        "lines": lines(plot).iter().map(line).collect::<Vec<_>>(),
        "regions": regions(plot).iter().map(region).collect::<Vec<_>>(),
    })
}

fn curve(plot: &Plot, curve: &Curve, size: [f64; 2]) -> Value {
    let (style, is_line) = match curve.style {
        CurveStyle::Line => ("line", true),
        CurveStyle::Dashed => ("dashed", true),
        CurveStyle::Dots => ("dots", false),
        CurveStyle::Crosses => ("crosses", false),
    };
    let points = match (is_line, curve.points.is_sorted_by(|a, b| a.0 <= b.0)) {
        (true, _) => fewer(plot, &curve.points, size),
        (false, true) => thinned(curve.points.clone()),
        (false, false) => curve.points.clone(),
    };
    let [mut xs, mut ys] = [Vec::with_capacity(points.len()), Vec::with_capacity(points.len())];
    for (x, y) in points {
        if drawable(x, plot.log_x).is_some() {
            xs.push(number(x));
            ys.push(drawable(y, plot.log_y).map_or(Value::Null, |_| number(y)));
        }
    }
    let color = if curve.color == Color::Grid { class(Color::Start) } else { class(curve.color) };
    json!({
        "name": curve.name, "variant": curve.variant, "style": style, "color": color, "hidden": curve.hidden,
        "mayLeave": curve.may_leave, "x": xs, "y": ys,
    })
}

/// Returns a line without the points that change it by less than [`TOLERANCE`]; gaps stay.
fn fewer(plot: &Plot, points: &[(f64, f64)], size: [f64; 2]) -> Vec<(f64, f64)> {
    let place = |p: &(f64, f64)| -> Option<Point> {
        Some([drawable(p.0, plot.log_x)? / size[0], drawable(p.1, plot.log_y)? / size[1]])
    };
    let mut kept = Vec::new();
    let mut rest = points;
    while !rest.is_empty() {
        let run = rest.iter().take_while(|p| place(p).is_some()).count();
        if run == 0 {
            kept.push((rest[0].0, f64::NAN));
            rest = &rest[1..];
            continue;
        }
        let places: Vec<Point> = rest[..run].iter().filter_map(place).collect();
        let chosen = simplified(&places, TOLERANCE);
        let mut next = chosen.iter().peekable();
        for (place, point) in places.iter().zip(rest) {
            if next.next_if(|p| *p == place).is_some() {
                kept.push(*point);
            }
        }
        rest = &rest[run..];
    }
    kept
}

/// Returns a number with seven significant digits; `null` if it is not finite.
fn number(value: f64) -> Value {
    let short: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    // Whole numbers without a fraction are shorter.
    #[allow(clippy::cast_possible_truncation)]
    if short.fract() == 0.0 && short.abs() < 1e15 { json!(short as i64) } else { json!(short) }
}

#[cfg(test)]
mod tests {
    use mops_math as math;

    use super::*;

    fn plot(points: Vec<(f64, f64)>) -> Plot {
        Plot { curves: vec![Curve { points, ..Curve::default() }], ..Plot::default() }
    }

    fn numbers(value: &Value) -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap_or(f64::NAN)).collect()
    }

    #[test]
    fn a_simplified_curve_differs_less_than_a_pixel_at_high_magnification() {
        let points: Vec<(f64, f64)> = (0..=4000).map(|i| f64::from(i) * 0.01).map(|t| (t, math::sin(t))).collect();
        let found = data(&plot(points.clone()));
        let (xs, ys) = (numbers(&found["curves"][0]["x"]), numbers(&found["curves"][0]["y"]));
        assert!(xs.len() < points.len() && xs.len() == ys.len(), "{}", xs.len());
        for (t, y) in points {
            let k = xs.partition_point(|x| *x < t).clamp(1, xs.len() - 1);
            let s = (t - xs[k - 1]) / (xs[k] - xs[k - 1]);
            // The distance is that across the line, whose largest slope is 40/2.1 in shares of the ranges.
            assert!((ys[k - 1] + s * (ys[k] - ys[k - 1]) - y).abs() < 2.1 * TOLERANCE * 20.0, "{t}");
        }
    }

    #[test]
    fn gaps_and_jumps_stay_and_numbers_are_short() {
        let found =
            data(&plot(vec![(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 1.0 / 3.0), (4.0, 1e300)]));
        assert_eq!(found["curves"][0]["x"], json!([0, 1, 1, 2, 3, 4]));
        assert_eq!(found["curves"][0]["y"], json!([0, 0, 2, null, 0.3333333, null]));
        assert!(!is_chart(&Plot { equal: true, ..plot(vec![(0.0, 1.0), (1.0, 2.0)]) }) && !is_chart(&plot(Vec::new())));
    }
}
