//! Scene as an SVG document: light colours as attributes for standalone use, and classes for the colours of a page.

use std::fmt::Write as _;

use maud::{Markup, html};
use mops_content::plot::Color;
use mops_language::plain::plain;

use super::clip::Point;
use super::scene::{Anchor, Mark, SIZE, Scene};
use super::view::View;

/// Returns the document, with a title and a description for screen readers.
pub(super) fn document(scene: &Scene, title: &str, description: &str) -> String {
    let [width, height] = SIZE;
    let markup = html! {
        svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox={ "0 0 " (width) " " (height) } width=(width)
            height=(height) data-view=[view(scene)] role="img" aria-label=(plain(title)) font-family="DejaVu Sans, Verdana, Arial, sans-serif"
            stroke-linecap="round" stroke-linejoin="round" {
            title { (plain(title)) }
            desc { (plain(description)) }
            rect class="paper" width=(width) height=(height) fill="#ffffff" {}
            @for mark in &scene.marks { (element(mark)) }
        }
    };
    markup.into_string()
}

/// Returns the view of a three-dimensional plot for the script of the page: azimuth, elevation, scale, centre.
fn view(scene: &Scene) -> Option<String> {
    let View { azimuth, elevation, scale, centre: [x, y] } = scene.view?;
    Some(format!("{azimuth} {elevation} {scale} {x} {y}"))
}

fn element(mark: &Mark) -> Markup {
    match mark {
        Mark::InSpace { points, mark } => {
            let points: Vec<String> = points.as_flattened().iter().map(|v| format!("{v:.4}")).collect();
            html! { g data-space=(points.join(" ")) { (element(mark)) } }
        }
        Mark::Line { points, color, width, dashed } => html! {
            path class=(class(*color)) d=(line(points)) fill="none" stroke=(hex(*color)) stroke-width=(width)
                stroke-dasharray=[dashed.then_some("6 4")] {}
        },
        Mark::FrontPoint { point, marks } => {
            let is_dot = |mark: &Mark| matches!(mark, Mark::Dots { .. });
            let kind = match marks.as_slice() {
                [Mark::InSpace { mark, .. }] if is_dot(mark) => "dot",
                [mark] if is_dot(mark) => "dot",
                _ => "line",
            };
            html! { g class=(kind) data-point=(point) { @for mark in marks { (element(mark)) } } }
        }
        Mark::Area { points, color } => html! {
            path class=(class(*color)) d={ (line(points)) "Z" } fill=(hex(*color)) stroke="none" {}
        },
        // A zero-length line with round ends is the shortest dot.
        Mark::Dots { centres, color, radius } => html! {
            path class=(class(*color)) d=(dots(centres)) fill="none" stroke=(hex(*color)) stroke-width=(2.0 * radius) {}
        },
        Mark::Box { frame, color } => html! {
            rect class=(class(*color)) x=(short(frame.from[0])) y=(short(frame.from[1]))
                width=(short(frame.to[0] - frame.from[0])) height=(short(frame.to[1] - frame.from[1])) fill=(hex(*color)) {}
        },
        Mark::Cell { frame, rgb: [r, g, b] } => html! {
            rect x=(short(frame.from[0])) y=(short(frame.from[1])) width=(short(frame.to[0] - frame.from[0]))
                height=(short(frame.to[1] - frame.from[1])) fill=(format!("#{r:02x}{g:02x}{b:02x}"))
                shape-rendering="crispEdges" {}
        },
        Mark::Text { text, at: [x, y], anchor, size, color, upwards } => {
            // The middle of the letters is about a third of the font size above the baseline.
            let place = if *upwards {
                format!("translate({} {}) rotate(-90)", short(x + 0.35 * size), short(*y))
            } else {
                format!("translate({} {})", short(*x), short(y + 0.35 * size))
            };
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            html! {
                text class=(class(*color)) transform=(place) text-anchor=(anchor) font-size=(size) fill=(hex(*color)) { (plain(text)) }
            }
        }
    }
}

fn line(points: &[Point]) -> String {
    let mut path = String::new();
    for (i, p) in points.iter().enumerate() {
        let _ = write!(path, "{}{} {}", if i == 0 { 'M' } else { 'L' }, short(p[0]), short(p[1]));
    }
    path
}

fn dots(centres: &[Point]) -> String {
    let mut path = String::new();
    for p in centres {
        let _ = write!(path, "M{} {}h0", short(p[0]), short(p[1]));
    }
    path
}

/// Rounds a coordinate to a tenth of a unit.
fn short(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

/// Returns the class of a colour in the style sheet of a page.
pub(super) fn class(color: Color) -> String {
    match color {
        Color::Text => "text".to_owned(),
        Color::Faint => "faint".to_owned(),
        Color::Grid => "grid".to_owned(),
        Color::Result => "result".to_owned(),
        Color::Start => "start".to_owned(),
        Color::Measured => "measured".to_owned(),
        Color::Demand => "demand".to_owned(),
        Color::Band => "band".to_owned(),
        Color::Excluded => "excluded".to_owned(),
        Color::Series(i) => format!("series{}", i % SERIES.len()),
    }
}

/// Colours of curves of equal rank, distinguishable with any colour vision.
/// Source: M. Okabe, K. Ito, Color Universal Design (2008), darkened for lines on white.
const SERIES: [[u8; 3]; 6] = [[0, 92, 170], [200, 80, 0], [0, 125, 90], [165, 70, 130], [60, 140, 190], [140, 110, 0]];

/// Returns red, green and blue of a colour on a white background.
pub(super) fn rgb(color: Color) -> [u8; 3] {
    match color {
        Color::Text => [27, 31, 36],
        Color::Faint => [80, 88, 98],
        Color::Grid => [222, 226, 231],
        Color::Result => SERIES[0],
        Color::Start => [130, 136, 144],
        Color::Measured => [200, 90, 20],
        Color::Demand => [170, 25, 45],
        Color::Band => [226, 236, 246],
        Color::Excluded => [250, 233, 235],
        Color::Series(i) => SERIES[i % SERIES.len()],
    }
}

fn hex(color: Color) -> String {
    let [r, g, b] = rgb(color);
    format!("#{r:02x}{g:02x}{b:02x}")
}
