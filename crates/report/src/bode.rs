//! Bode plots of linear systems.

use std::f64::consts::PI;

use mops_linear::{Complex, StateSpace, zeros};
use mops_math as math;
use mops_math::complex;

use mops_content::plot::{Curve, Plot};

/// Response of a system with one input and one output at the frequencies of a plot.
#[derive(Debug, Clone)]
pub struct FrequencyCurve {
    /// Angular frequencies, rad/s, increasing.
    pub(crate) omegas: Vec<f64>,
    /// Complex values of the response.
    pub(crate) values: Vec<Complex>,
    /// Magnitude at frequency 0; infinite with an integrator.
    pub(crate) static_gain: f64,
}

impl FrequencyCurve {
    /// Returns the response at frequencies that show the corners, the resonances and the delay of the system.
    ///
    /// # Errors
    /// If the response, the poles or the zeros cannot be computed.
    pub fn of(system: &StateSpace) -> Result<Self, String> {
        let response = system.response()?;
        let omegas = frequencies(system)?;
        let values = omegas.iter().map(|&omega| response.scalar(omega)).collect();
        Ok(Self { omegas, values, static_gain: complex::norm(response.scalar(0.0)) })
    }

    /// Returns the points of the magnitude, dB.
    pub(crate) fn magnitude(&self) -> Vec<(f64, f64)> {
        let decibel = |g: &Complex| 20.0 * math::log10(complex::norm(*g));
        self.omegas.iter().copied().zip(self.values.iter().map(decibel)).collect()
    }

    /// Returns the points of the unwrapped phase, deg.
    pub(crate) fn phase(&self) -> Vec<(f64, f64)> {
        self.omegas.iter().copied().zip(unwrapped(&self.values)).collect()
    }
}

/// Returns angular frequencies, rad/s, from two decades below the lowest corner frequency to two decades above the
/// highest. They are dense around sharp resonances. A delay limits the highest frequency, and a sampled system ends at
/// half of the sampling frequency.
pub(super) fn frequencies(system: &StateSpace) -> Result<Vec<f64>, String> {
    let corners = [system.poles()?, system.in_seconds(zeros(system)?)].concat();
    let largest = corners.iter().map(|z| complex::norm(*z)).fold(0.0, f64::max);
    let sizes = corners.iter().map(|z| complex::norm(*z)).filter(|size| *size > 1e-9 * largest);
    let sizes = || sizes.clone().chain((system.delay > 0.0).then(|| 1.0 / system.delay));
    let (low, high) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    let (low, mut high) = if low.is_finite() { (1e-2 * low, 1e2 * high) } else { (1e-2, 1e2) };
    if system.delay > 0.0 {
        // Beyond that, the phase of the delay only wraps around.
        high = high.min((3.0 * corners.iter().map(|z| complex::norm(*z)).fold(0.0, f64::max)).max(6.0 / system.delay));
    }
    if let Some(period) = system.period {
        high = PI / period;
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

/// Returns the plots of magnitude and phase of responses, each with a curve that has its name and style.
pub fn bode(name: &str, responses: &[(Curve, &FrequencyCurve)]) -> [Plot; 2] {
    let of = |title: &str, y_label: &str, points: &dyn Fn(&FrequencyCurve) -> Vec<(f64, f64)>| Plot {
        title: format!("{title} of {name}"),
        x_label: "frequency (rad/s)".into(),
        y_label: y_label.into(),
        curves: responses.iter().map(|(curve, response)| Curve { points: points(response), ..curve.clone() }).collect(),
        log_x: true,
        degrees: title == "phase",
        ..Plot::default()
    };
    [of("magnitude", "magnitude (dB)", &FrequencyCurve::magnitude), of("phase", "phase (deg)", &FrequencyCurve::phase)]
}

/// Returns the unwrapped phase, deg.
pub(super) fn unwrapped(values: &[Complex]) -> Vec<f64> {
    let mut last = values.first().map_or(0.0, |g| complex::arg(*g));
    let mut phase = Vec::with_capacity(values.len());
    for (i, value) in values.iter().enumerate() {
        last += if i == 0 { 0.0 } else { complex::arg(value / values[i - 1]) };
        phase.push(last.to_degrees());
    }
    phase
}

#[cfg(test)]
mod tests {
    use mops_linear::TransferFunction;

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
