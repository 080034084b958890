//! Scene as a PNG: strokes with anti-aliasing by distance, letters in the bundled font, so that no system font is
//! needed.

use std::io;
use std::sync::Once;

use mops_content::plot::Color;
use mops_math as math;
use plotters::backend::{BitMapBackend, DrawingBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontStyle, FontTransform, IntoFont, RGBColor, TextStyle, WHITE, register_font};

use super::clip::{Point, distance};
use super::scene::{Anchor, Mark, SIZE, Scene};
use super::svg::rgb;

/// Pixels per unit of the scene.
const SCALE: f64 = 2.0;
const FONT: &str = "DejaVu Sans";
/// Line height of DejaVu Sans (ascender to descender), which plotters calls the size of a font, in units of the em.
const LINE: f64 = 1.164;

/// Returns the bytes of the file.
pub(super) fn document(scene: &Scene) -> io::Result<Vec<u8>> {
    static FONT_ONCE: Once = Once::new();
    FONT_ONCE.call_once(|| {
        // Fails only if the bytes are not a font.
        let _ = register_font(FONT, FontStyle::Normal, include_bytes!("../assets/DejaVuSans.ttf"));
    });
    let [width, height] = SIZE.map(|length| (SCALE * length) as u32);
    let mut pixels = vec![0; 3 * (width * height) as usize];
    let mut paper = BitMapBackend::with_buffer(&mut pixels, (width, height));
    paper.draw_rect((0, 0), (width as i32, height as i32), &WHITE, true).map_err(failed)?;
    for mark in &scene.marks {
        draw(&mut paper, mark)?;
    }
    paper.present().map_err(failed)?;
    drop(paper);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut image = encoder.write_header()?;
    image.write_image_data(&pixels)?;
    image.finish()?;
    Ok(bytes)
}

fn failed(error: impl std::error::Error) -> io::Error {
    io::Error::other(error.to_string())
}

fn draw(paper: &mut BitMapBackend<'_>, mark: &Mark) -> io::Result<()> {
    match mark {
        Mark::FrontPoint { marks, .. } => marks.iter().try_for_each(|mark| draw(paper, mark)),
        Mark::InSpace { mark, .. } => draw(paper, mark),
        Mark::Line { points, color, width, dashed } => {
            let parts = if *dashed { dashes(points, 6.0, 4.0) } else { vec![points.clone()] };
            let segments: Vec<[Point; 2]> =
                parts.iter().flat_map(|part| part.windows(2).map(|w| [w[0], w[1]])).collect();
            stroke(paper, &segments, 0.5 * width, *color)
        }
        Mark::Dots { centres, color, radius } => {
            let segments: Vec<[Point; 2]> = centres.iter().map(|&c| [c, c]).collect();
            stroke(paper, &segments, *radius, *color)
        }
        Mark::Box { frame, color } => {
            let pixel = |p: Point| ((SCALE * p[0]).round() as i32, (SCALE * p[1]).round() as i32);
            paper.draw_rect(pixel(frame.from), pixel(frame.to), &rgb_color(*color), true).map_err(failed)
        }
        Mark::Area { points, color } => {
            let pixel = |p: &Point| ((SCALE * p[0]).round() as i32, (SCALE * p[1]).round() as i32);
            paper.fill_polygon(points.iter().map(pixel), &rgb_color(*color)).map_err(failed)
        }
        Mark::Cell { frame, rgb: [r, g, b] } => {
            let pixel = |p: Point| ((SCALE * p[0]).round() as i32, (SCALE * p[1]).round() as i32);
            paper.draw_rect(pixel(frame.from), pixel(frame.to), &RGBColor(*r, *g, *b), true).map_err(failed)
        }
        Mark::Text { text, at, anchor, size, color, upwards } => {
            let h_pos = match anchor {
                Anchor::Start => HPos::Left,
                Anchor::Middle => HPos::Center,
                Anchor::End => HPos::Right,
            };
            let font = (FONT, LINE * SCALE * size).into_font();
            let font = if *upwards { font.transform(FontTransform::Rotate270) } else { font };
            let rgb = rgb_color(*color);
            let style = TextStyle::from(font).color(&rgb).pos(Pos::new(h_pos, VPos::Top));
            // plotters places the baseline half a font size below the top; ours is 0.35 em below the middle.
            let lift = SCALE * size * (0.35 - 0.5 * LINE);
            let [x, y] = at.map(|v| SCALE * v);
            let [x, y] = if *upwards { [x + lift, y] } else { [x, y + lift] };
            paper.draw_text(text, &style, (x.round() as i32, y.round() as i32)).map_err(failed)
        }
    }
}

fn rgb_color(color: Color) -> RGBColor {
    let [r, g, b] = rgb(color);
    RGBColor(r, g, b)
}

/// Paints the pixels within `half` of the segments, with anti-aliasing at the edge.
fn stroke(paper: &mut BitMapBackend<'_>, segments: &[[Point; 2]], half: f64, color: Color) -> io::Result<()> {
    let half = SCALE * half;
    // From pixel corners to pixel centres.
    let segments: Vec<[Point; 2]> = segments.iter().map(|s| s.map(|p| p.map(|v| SCALE * v - 0.5))).collect();
    let reach = |points: &[Point], i: usize| {
        let (low, high) = points.iter().fold((f64::MAX, 0.0f64), |(low, high), p| (low.min(p[i]), high.max(p[i])));
        let end = (high + half + 2.0).min(SCALE * SIZE[i]) as usize;
        ((low - half - 1.0).max(0.0) as usize).min(end)..end
    };
    let ends = segments.as_flattened();
    let (columns, rows) = (reach(ends, 0), reach(ends, 1));
    let mut cover = vec![0.0f64; columns.len() * rows.len()];
    for [a, b] in &segments {
        for y in reach(&[*a, *b], 1) {
            let row = &mut cover[(y - rows.start) * columns.len()..];
            for x in reach(&[*a, *b], 0) {
                let inside = (half + 0.5 - distance([x as f64, y as f64], *a, *b)).clamp(0.0, 1.0);
                let cell = &mut row[x - columns.start];
                *cell = cell.max(inside);
            }
        }
    }
    for (i, &part) in cover.iter().enumerate().filter(|(_, part)| **part > 0.0) {
        let at = ((columns.start + i % columns.len()) as i32, (rows.start + i / columns.len()) as i32);
        paper.draw_pixel(at, rgb_color(color).mix(part).to_backend_color()).map_err(failed)?;
    }
    Ok(())
}

/// Returns the parts of a dashed line.
fn dashes(points: &[Point], on: f64, off: f64) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = points.first().map(|p| vec![*p]).into_iter().collect();
    let (mut drawing, mut left) = (true, on);
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let length = math::hypot(b[0] - a[0], b[1] - a[1]);
        let mut at = 0.0;
        while length - at > left {
            at += left;
            let p = [a[0] + at / length * (b[0] - a[0]), a[1] + at / length * (b[1] - a[1])];
            if drawing {
                parts.last_mut().expect("a drawn line has a part").push(p);
            } else {
                parts.push(vec![p]);
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
        left -= length - at;
        if drawing {
            parts.last_mut().expect("a drawn line has a part").push(b);
        }
    }
    parts
}
