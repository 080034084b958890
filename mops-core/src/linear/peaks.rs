//! Peaks of the sensitivities of a feedback loop, and bandwidths.

use super::bounded_response::{BoundedResponse, Closed, Span};
use super::search::{highest, passes};
use super::{Complex, Loop, StateSpace};
use crate::math::{self, complex};

impl Loop {
    /// The largest sensitivity, `Ms = max |1/(1 + L)|`, over all frequencies from 0 to infinity.
    ///
    /// # Errors
    /// A closed loop that is not stable.
    pub fn peak_sensitivity(&self) -> Result<f64, String> {
        self.peak(Closed::Sensitivity)
    }

    /// The largest complementary sensitivity, `Mt = max |L/(1 + L)|`, over all frequencies from 0 to infinity.
    ///
    /// # Errors
    /// A closed loop that is not stable.
    pub fn peak_complementary(&self) -> Result<f64, String> {
        self.peak(Closed::Complementary)
    }

    fn peak(&self, what: Closed) -> Result<f64, String> {
        if !self.is_stable() {
            return Err("the closed loop is not stable".to_owned());
        }
        // At infinite frequency L is D, and turns around a circle with a delay.
        let end = self.system.d[(0, 0)];
        let end = if self.system.delay > 0.0 { -end.abs() } else { end };
        let (peak, _) = highest(&self.response, |l| what.gain(l), |span| span.closed(what))?;
        Ok(peak.max(what.gain(Complex::new(end, 0.0))))
    }

    /// The lowest angular frequency, rad/s, at which the gain of the closed loop `T = L/(1 + L)` is 3 dB (a factor of
    /// `sqrt 2`) below that at frequency 0.
    ///
    /// # Errors
    /// A closed loop that is not stable; a gain that starts at 0, or never falls so far.
    pub fn closed_loop_bandwidth(&self) -> Result<f64, String> {
        if !self.is_stable() {
            return Err("the closed loop is not stable".to_owned());
        }
        let gain = |l: Complex| Closed::Complementary.gain(l);
        let level = three_decibels_below(gain(self.at(0.0)))?;
        first_below(&self.response, level, |l| math::ln(gain(l)), |span| span.closed(Closed::Complementary))
    }
}

/// The bandwidth: the lowest angular frequency, rad/s, at which the gain of a system with one input and one output is 3 dB
/// (a factor of `sqrt 2`) below that at frequency 0.
///
/// # Errors
/// A gain at frequency 0 that is 0 or infinite, or that is never so far below.
pub fn bandwidth(system: &StateSpace) -> Result<f64, String> {
    // A delay changes no gain.
    let response = BoundedResponse::new(&StateSpace { delay: 0.0, ..system.clone() })?;
    let level = three_decibels_below(complex::norm(response.at(0.0)))?;
    first_below(&response, level, |l| math::ln(complex::norm(l)), Span::gain)
}

/// The logarithm of a gain that is 3 dB below that at frequency 0.
fn three_decibels_below(start: f64) -> Result<f64, String> {
    if start > 0.0 && start.is_finite() {
        Ok(math::ln(start) - 0.5 * std::f64::consts::LN_2)
    } else if !start.is_finite() {
        let way_out = "a system with an integrator has no bandwidth, but its closed loop has: of = \"closed-loop\"";
        Err(format!("the gain at frequency 0 is infinite: {way_out}"))
    } else {
        Err(format!("the gain at frequency 0 is {start}: there is no bandwidth"))
    }
}

/// The lowest frequency at which a value falls below a level.
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
    first.ok_or_else(|| "the gain is never 3 dB below that at frequency 0: the bandwidth is infinite".to_owned())
}
