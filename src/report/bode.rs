//! Bode plots of linear systems.

use mops_core::linear::{Complex, zeros};
use mops_core::math::{self, complex};
use mops_core::{Analysis, Failure, StateSpace};

use super::plot::{Color, Curve, CurveStyle, Plot};

/// Frequency response at the frequencies of a plot.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrequencyCurve<'a> {
    /// Name in the legend.
    pub(crate) name: String,
    /// Complex values of the response.
    pub(crate) values: &'a [Complex],
    /// Style of its curves.
    pub(crate) style: CurveStyle,
    /// Color of its curves.
    pub(crate) color: Color,
}

/// Returns angular frequencies, rad/s, from two decades below the lowest corner frequency to two decades above the highest.
/// They are dense around sharp resonances. A delay limits the highest frequency.
pub(crate) fn frequencies(system: &StateSpace) -> Result<Vec<f64>, String> {
    let corners = [system.poles()?, zeros(system)?].concat();
    let largest = corners.iter().map(|z| complex::norm(*z)).fold(0.0, f64::max);
    let sizes = corners.iter().map(|z| complex::norm(*z)).filter(|size| *size > 1e-9 * largest);
    let sizes = || sizes.clone().chain((system.delay > 0.0).then(|| 1.0 / system.delay));
    let (low, high) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let (low, mut high) = if low.is_finite() { (1e-2 * low, 1e2 * high) } else { (1e-2, 1e2) };
    if system.delay > 0.0 {
        // Beyond that, the phase of the delay only wraps around.
        high = high.min((3.0 * corners.iter().map(|z| complex::norm(*z)).fold(0.0, f64::max)).max(6.0 / system.delay));
    }
    const COUNT: usize = 1200;
    let step = math::ln(high / low) / COUNT as f64;
    let mut omegas: Vec<f64> = (0..=COUNT).map(|i| low * math::exp(step * i as f64)).collect();
    for resonance in corners.iter().filter(|z| z.im > 0.0) {
        let width = resonance.re.abs().max(1e-6 * resonance.im);
        omegas.extend((-60..=60).map(|i| resonance.im + 0.1 * f64::from(i) * width));
    }
    omegas.retain(|&omega| omega >= low && omega <= high);
    omegas.sort_by(f64::total_cmp);
    Ok(omegas)
}

/// Returns the plots of magnitude and phase of responses at the same frequencies.
pub(crate) fn bode(omegas: &[f64], responses: &[FrequencyCurve<'_>], name: &str) -> [Plot; 2] {
    let of = |title: &str, y_label: &str, y: &dyn Fn(&[Complex]) -> Vec<f64>| Plot {
        title: format!("{title} of {name}"),
        x_label: "frequency (rad/s)".into(),
        y_label: y_label.into(),
        curves: responses
            .iter()
            .map(|response| Curve {
                name: response.name.clone(),
                points: omegas.iter().copied().zip(y(response.values)).collect(),
                style: response.style,
                color: response.color,
                may_leave: response.color == Color::Start,
                ..Curve::default()
            })
            .collect(),
        log_x: true,
        degrees: title == "phase",
        ..Plot::default()
    };
    let decibel = |values: &[Complex]| values.iter().map(|g| 20.0 * math::log10(complex::norm(*g))).collect();
    [of("magnitude", "magnitude (dB)", &decibel), of("phase", "phase (deg)", &unwrapped)]
}

/// Returns the unwrapped phase, deg.
fn unwrapped(values: &[Complex]) -> Vec<f64> {
    let mut last = values.first().map_or(0.0, |g| complex::arg(*g));
    let mut phase = Vec::with_capacity(values.len());
    for (i, value) in values.iter().enumerate() {
        last += if i == 0 { 0.0 } else { complex::arg(value / values[i - 1]) };
        phase.push(last.to_degrees());
    }
    phase
}

/// Returns the Bode plots from every input to one output, at the initial guess and at the reported point.
pub(super) fn compared(
    start: &Result<Analysis, Failure>,
    best: (&Result<Analysis, Failure>, &str),
    output: &str,
    case: &str,
) -> Vec<(String, Plot)> {
    let system = |analysis: &Result<Analysis, Failure>| analysis.as_ref().ok()?.linear().cloned();
    let (start, found) = (system(start), system(best.0));
    let Some(shown) = found.as_ref().or(start.as_ref()) else { return Vec::new() };
    let Some(place) = shown.outputs.iter().position(|name| name == output) else { return Vec::new() };
    let mut plots = Vec::new();
    for (input, name) in shown.inputs.iter().enumerate() {
        let Ok(omegas) = frequencies(&shown.channel(input, place)) else { continue };
        let values = |system: &Option<StateSpace>| -> Vec<Complex> {
            let response = system.as_ref().and_then(|system| system.channel(input, place).response().ok());
            response.map_or_else(Vec::new, |response| omegas.iter().map(|&omega| response.scalar(omega)).collect())
        };
        let (first, last) = (values(&start), values(&found));
        let responses = [
            FrequencyCurve {
                name: "initial guess".into(),
                values: &first,
                style: CurveStyle::Dashed,
                color: Color::Start,
            },
            FrequencyCurve { name: best.1.into(), values: &last, style: CurveStyle::Line, color: Color::Result },
        ];
        let drawn: Vec<FrequencyCurve<'_>> =
            responses.into_iter().filter(|response| !response.values.is_empty()).collect();
        let [magnitude, phase] = bode(&omegas, &drawn, &format!("{output}/{name} in case {case}"));
        plots.extend([(format!("magnitude-{output}-{name}"), magnitude), (format!("phase-{output}-{name}"), phase)]);
    }
    plots
}

#[cfg(test)]
mod tests {
    use mops_core::linear::TransferFunction;

    use super::*;

    #[test]
    fn the_unwrapped_phase_of_a_delay_is_a_straight_line() {
        let late = TransferFunction { delay: 2.0, ..TransferFunction::new(vec![1.0], vec![1.0]) };
        let response = late.state_space().unwrap().response().unwrap();
        let omegas: Vec<f64> = (0..200).map(|i| 0.1 * f64::from(i)).collect();
        let values: Vec<Complex> = omegas.iter().map(|&omega| response.scalar(omega)).collect();
        for (phase, omega) in unwrapped(&values).iter().zip(&omegas) {
            assert!((phase + (2.0 * omega).to_degrees()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_sharp_resonance_is_among_the_frequencies() {
        let needle = TransferFunction::new(vec![1.0], vec![1.0, 1e-4, 100.0]).state_space().unwrap();
        let omegas = frequencies(&needle).unwrap();
        let response = needle.response().unwrap();
        let highest = omegas.iter().map(|&omega| complex::norm(response.scalar(omega))).fold(0.0, f64::max);
        assert!((highest * 1e-3 - 1.0).abs() < 1e-3, "{highest}");
        assert!(omegas.windows(2).all(|pair| pair[0] <= pair[1]));
    }
}
