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

#[cfg(test)]
mod tests {
    use crate::common::testing::{measured, simulated, undefined_in};
    use crate::rmse::Rmse;

    #[test]
    fn a_measurement_that_was_not_simulated_is_not_compared() {
        let rmse = Rmse { signal: "y".into() };
        let simulation = simulated(1.0, |t| t);
        let long = measured(&[0.0, 1.0, 2.0], &[0.0; 3], None);
        assert_eq!(
            undefined_in(&long, &rmse, &simulation),
            "`y` is measured from 0 s to 2 s but simulated from 0 s to 1 s"
        );
        let other = mops_core::Case { name: "swing".into(), ..mops_core::Case::default() };
        assert_eq!(undefined_in(&other, &rmse, &simulation), "`swing` does not measure `y`");
    }
}
