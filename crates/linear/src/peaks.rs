//! Sensitivity peaks of a feedback loop, and bandwidths.

use mops_math as math;
use mops_math::complex;

use super::bounded_response::{BoundedResponse, Closed, Span};
use super::search::{highest, passes};
use super::{Complex, Loop, StateSpace};

impl Loop {
    /// Returns the maximum sensitivity, `Ms = max |1/(1 + L)|`, over all frequencies from 0 to infinity.
    ///
    /// # Errors
    /// If the closed loop is not stable.
    pub fn peak_sensitivity(&self) -> Result<f64, String> {
        self.peak(Closed::SENSITIVITY)
    }

    /// Returns the maximum complementary sensitivity, `Mt = max |L/(1 + L)|`, over all frequencies from 0 to infinity.
    ///
    /// # Errors
    /// If the closed loop is not stable.
    pub fn peak_complementary(&self) -> Result<f64, String> {
        self.peak(Closed::COMPLEMENTARY)
    }

    /// Returns the disk margin: see [`super::disk_margin`]. A delay is treated exactly.
    ///
    /// # Errors
    /// If the closed loop is not stable.
    pub fn disk_margin(&self, skew: f64) -> Result<f64, String> {
        Ok(1.0 / self.peak(Closed::sensitivity_plus(0.5 * (skew - 1.0)))?)
    }

    fn peak(&self, what: Closed) -> Result<f64, String> {
        if !self.is_stable() {
            return Err("the closed loop is not stable".to_owned());
        }
        // At infinite frequency L equals D. With a delay it turns on a circle about 0, and the gain is largest on the
        // real axis.
        let end = self.system.d[(0, 0)];
        let ends = if self.system.delay > 0.0 { [end, -end] } else { [end, end] };
        let (peak, _) = highest(&self.response, |_, l| what.gain(l), |span| span.closed(what))?;
        Ok(ends.iter().fold(peak, |peak, end| peak.max(what.gain(Complex::new(*end, 0.0)))))
    }

    /// Returns the closed-loop bandwidth, rad/s: the lowest angular frequency at which `|T|` is 3 dB (a factor of
    /// `sqrt 2`) below its value at 0, with `T = L/(1 + L)`.
    ///
    /// # Errors
    /// If the closed loop is not stable, or if the gain is 0 at frequency 0 or never falls by 3 dB.
    pub fn closed_loop_bandwidth(&self) -> Result<f64, String> {
        if !self.is_stable() {
            return Err("the closed loop is not stable".to_owned());
        }
        let gain = |l: Complex| Closed::COMPLEMENTARY.gain(l);
        let level = three_decibels_below(gain(self.at(0.0)))?;
        let v = first_below(&self.response, level, |l| math::ln(gain(l)), |span| span.closed(Closed::COMPLEMENTARY));
        Ok(self.system.frequency(v?))
    }
}

/// Returns the bandwidth, rad/s, of a system with one input and one output. The bandwidth is the lowest angular
/// frequency at which the gain is 3 dB (a factor of `sqrt 2`) below its value at frequency 0.
///
/// # Errors
/// If the gain at frequency 0 is 0 or infinite, or never falls by 3 dB.
pub fn bandwidth(system: &StateSpace) -> Result<f64, String> {
    // A delay changes no gain.
    let response = BoundedResponse::new(&StateSpace { delay: 0.0, ..system.clone() })?;
    let level = three_decibels_below(complex::norm(response.at(0.0)))?;
    Ok(system.frequency(first_below(&response, level, |l| math::ln(complex::norm(l)), Span::gain)?))
}

/// Returns the logarithm of the gain 3 dB below that at frequency 0.
fn three_decibels_below(start: f64) -> Result<f64, String> {
    if start > 0.0 && start.is_finite() {
        Ok(math::ln(start) - 0.5 * std::f64::consts::LN_2)
    } else if !start.is_finite() {
        let way_out = "an integrator has no bandwidth; use `of = \"closed-loop\"`";
        Err(format!("the gain at frequency 0 is infinite: {way_out}"))
    } else {
        Err(format!("the gain at frequency 0 is {start}, so that the bandwidth is undefined"))
    }
}

/// Returns the lowest frequency at which a value falls below a level.
fn first_below(
    of: &BoundedResponse,
    level: f64,
    value: impl Fn(Complex) -> f64,
    bounds: impl Fn(&Span) -> [f64; 2],
) -> Result<f64, String> {
    let mut first = None;
    passes(
        of,
        |l| value(l) - level,
        |span| bounds(span).map(|bound| bound - level),
        |frequency, rises| {
            first = (!rises).then_some(frequency);
            rises
        },
    )?;
    first
        .ok_or_else(|| "the gain never falls 3 dB below its value at frequency 0: the bandwidth is infinite".to_owned())
}
