//! Comparison of a simulated signal with its measurement.

use mops_core::{Analysis, Case, case::Channel};

use super::trace;

/// Measured channel and the deviation of the simulation from it.
pub struct Comparison<'a> {
    /// Measured channel.
    pub channel: &'a Channel,
    /// Simulated minus measured value of each sample.
    pub differences: Vec<f64>,
}

impl Comparison<'_> {
    /// Returns the number of samples.
    #[allow(clippy::cast_precision_loss)]
    pub fn count(&self) -> f64 {
        self.differences.len() as f64
    }

    /// Returns the sum of the squares of the differences.
    pub fn sum_of_squares(&self) -> f64 {
        self.differences.iter().map(|d| d * d).sum()
    }
}

/// Returns the derivative of the differences of [`compare`] along a tangent of the simulation; `compare` must have
/// succeeded.
pub fn compared_slopes<'a>(case: &'a Case, along: &Analysis, signal: &str) -> Result<(&'a Channel, Vec<f64>), String> {
    let experiment = case.experiment.as_ref();
    let channel = experiment.and_then(|experiment| experiment.channel(signal)).expect("`compare` finds the channel");
    let slopes = along.trace(signal).sample(&channel.times);
    if slopes.iter().all(|slope| slope.is_finite()) {
        Ok((channel, slopes))
    } else {
        Err(format!("the derivative of `{signal}` is not finite throughout"))
    }
}

/// Compares the simulated signal with its measurement at the sample times.
pub fn compare<'a>(case: &'a Case, analysis: &Analysis, signal: &str) -> Result<Comparison<'a>, String> {
    let experiment = case.experiment.as_ref();
    let channel = experiment
        .and_then(|experiment| experiment.channel(signal))
        .ok_or_else(|| format!("`{}` does not measure `{signal}`", case.name))?;
    let simulated = trace(analysis, signal)?;
    let (Some(first), Some(last)) = (channel.times.first(), channel.times.last()) else {
        return Err(format!("the measurement of `{signal}` has no samples"));
    };
    // A trace has no values beyond its ends; times that agree up to rounding count as equal.
    let rounding = 1e-9 * (simulated.end() - simulated.start());
    if *first < simulated.start() - rounding || *last > simulated.end() + rounding {
        return Err(format!(
            "`{signal}` is measured from {first} s to {last} s but simulated from {} s to {} s",
            simulated.start(),
            simulated.end()
        ));
    }
    let differences = simulated.sample(&channel.times).iter().zip(&channel.values).map(|(y, m)| y - m).collect();
    Ok(Comparison { channel, differences })
}
