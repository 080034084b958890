//! Nyquist plot of a loop transfer function.

use mops_content::plot::{Color, Curve, CurveStyle, Plot};
use mops_linear::Complex;
use mops_math as math;
use mops_math::complex;

use super::bode::FrequencyCurve;

/// Returns the plot of a response at increasing frequencies, in the neighbourhood of -1, and of the static gain if that
/// is moderate. With the maximum sensitivity Ms it has the circle of radius 1/Ms about -1, which the curve touches.
pub fn nyquist(response: &FrequencyCurve, peak: Option<f64>, name: &str) -> Plot {
    let FrequencyCurve { values, static_gain, .. } = response;
    let limit = if static_gain.is_finite() { static_gain.clamp(1.5, 8.0) * 1.1 } else { 3.0 };
    let shown = |sign: f64| -> Vec<(f64, f64)> {
        let inside = |z: &Complex| complex::norm(*z) <= limit;
        values.iter().map(|z| if inside(z) { (z.re, sign * z.im) } else { (f64::NAN, f64::NAN) }).collect()
    };
    let circle = |centre: f64, radius: f64| -> Vec<(f64, f64)> {
        let angles = (0..=200).map(|i| math::sin_cos(std::f64::consts::TAU * f64::from(i) / 200.0));
        angles.map(|(sin, cos)| (centre + radius * cos, radius * sin)).collect()
    };
    let curve =
        |name: &str, points, style, color| Curve { name: name.into(), points, style, color, ..Curve::default() };
    let mut curves = vec![
        curve("unit circle", circle(0.0, 1.0), CurveStyle::Line, Color::Grid),
        curve("negative frequencies", shown(-1.0), CurveStyle::Dashed, Color::Start),
        curve("positive frequencies", shown(1.0), CurveStyle::Line, Color::Result),
        curve("-1", vec![(-1.0, 0.0)], CurveStyle::Crosses, Color::Demand),
    ];
    if let Some(peak) = peak.filter(|peak| peak.is_finite()) {
        let name = format!("Ms = {}", mops_content::numbers::significant(peak, 3));
        curves.insert(1, curve(&name, circle(-1.0, 1.0 / peak), CurveStyle::Line, Color::Measured));
    }
    Plot {
        title: format!("Nyquist curve of {name}"),
        x_label: "real part".into(),
        y_label: "imaginary part".into(),
        curves,
        equal: true,
        ..Plot::default()
    }
}
