//! Test signals that are sampled inputs or sums of sines.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

use super::{Hold, Input};

/// Numbers of stages of the shift registers of [`Input::prbs`].
pub const PRBS_STAGES: RangeInclusive<usize> = 2..=18;

/// Stages whose sum modulo 2 is fed back, so that a register with 2, 3, .., 18 stages has the longest period.
///
/// Source: P. Alfke, Efficient shift registers, LFSR counters, and long pseudo-random sequence generators, Xilinx
/// application note XAPP 052 (1996), table 3.
const TAPS: [&[usize]; 17] = [
    &[2, 1],
    &[3, 2],
    &[4, 3],
    &[5, 3],
    &[6, 5],
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
];

/// Largest number of samples of a waveform.
const MOST: usize = 1_000_000;

fn too_many() -> String {
    format!("the input has more than {MOST} changes until the end of the simulation")
}

/// Returns the number of intervals of this length that start from `start` to `until`, both included.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn intervals(start: f64, length: f64, until: f64) -> Result<usize, String> {
    let count = ((until - start) / length * (1.0 + 1e-12)).floor().max(0.0) + 1.0;
    if count > MOST as f64 { Err(too_many()) } else { Ok(count as usize) }
}

/// Returns an input that is constant between these times, with `before` until the first of them.
fn levels(before: f64, changes: impl IntoIterator<Item = (f64, f64)>) -> Input {
    let (mut times, mut values): (Vec<f64>, Vec<f64>) = changes.into_iter().unzip();
    times.insert(0, times[0] - 1.0);
    values.insert(0, before);
    Input::Sampled { times, values, hold: Hold::Zero }
}

impl Input {
    /// Returns a ramp: `before` until `start` (s), then linear to `after`, which is reached after `duration` (s,
    /// positive).
    pub fn ramp(start: f64, duration: f64, before: f64, after: f64) -> Self {
        Self::Sampled { times: vec![start, start + duration], values: vec![before, after], hold: Hold::First }
    }

    /// Returns a pulse: `high` for `width` (s, positive) from `start` on, else `low`. With a `period` (s, longer than
    /// the width) it repeats until the time `until`.
    ///
    /// # Errors
    /// If it has too many changes.
    pub fn pulse(
        start: f64,
        width: f64,
        [low, high]: [f64; 2],
        period: Option<f64>,
        until: f64,
    ) -> Result<Self, String> {
        let count = period.map_or(Ok(1), |period| intervals(start, period, until))?;
        let pulse = |k: usize| {
            let begin = start + k as f64 * period.unwrap_or(0.0);
            [(begin, high), (begin + width, low)]
        };
        Ok(levels(low, (0..count).flat_map(pulse)))
    }

    /// Returns a doublet: `offset + amplitude` for `width` (s, positive) from `start` on, then `offset - amplitude` for
    /// as long, else `offset`.
    pub fn doublet(start: f64, width: f64, amplitude: f64, offset: f64) -> Self {
        let changes = [(start, offset + amplitude), (start + width, offset - amplitude), (start + 2.0 * width, offset)];
        levels(offset, changes)
    }

    /// Returns a pseudo-random binary sequence: `offset + amplitude` or `offset - amplitude` in intervals of `interval`
    /// (s, positive) from `start` on until the time `until`, `offset` before.
    ///
    /// The sequence is that of a shift register with this number of stages, all 1 at the start. It repeats after
    /// `2^stages - 1` intervals, in which the upper value occurs once more than the lower one. Its spectrum is nearly
    /// constant up to a third of `1/interval`.
    ///
    /// Source: L. Ljung, System Identification, 2nd edition (1999), section 13.3.
    ///
    /// # Errors
    /// If it has too many changes.
    ///
    /// # Panics
    /// If the number of stages is not in [`PRBS_STAGES`].
    pub fn prbs(
        start: f64,
        interval: f64,
        stages: usize,
        amplitude: f64,
        offset: f64,
        until: f64,
    ) -> Result<Self, String> {
        let count = intervals(start, interval, until)?;
        let bits = sequence(stages).enumerate().take(count);
        let change = |(k, bit): (usize, bool)| {
            (start + k as f64 * interval, if bit { offset + amplitude } else { offset - amplitude })
        };
        Ok(levels(offset, bits.map(change)))
    }

    /// Returns a multisine: sines of these frequencies (Hz), each with this amplitude, around `offset`. Schroeder's
    /// phases `-pi k (k - 1)/n` of the k-th of n sines keep the peaks low if the frequencies are evenly spaced.
    ///
    /// Source: M. R. Schroeder, Synthesis of low-peak-factor signals and binary sequences with low autocorrelation,
    /// IEEE Transactions on Information Theory 16 (1970) 85-89.
    pub fn multisine(frequencies: &[f64], amplitude: f64, offset: f64) -> Self {
        let count = frequencies.len() as f64;
        let sine = |(k, &frequency): (usize, &f64)| {
            let phase = (-PI * (k as f64 + 1.0) * k as f64 / count).rem_euclid(TAU);
            Self::Sine { amplitude, frequency, phase, offset: if k == 0 { offset } else { 0.0 } }
        };
        Self::Sum(frequencies.iter().enumerate().map(sine).collect())
    }
}

/// Returns the output of the last stage of a shift register, without end.
fn sequence(stages: usize) -> impl Iterator<Item = bool> {
    let taps = TAPS[stages - PRBS_STAGES.start()];
    let mut register = vec![true; stages];
    std::iter::from_fn(move || {
        let out = register[stages - 1];
        let fed_back = taps.iter().fold(false, |sum, &tap| sum ^ register[tap - 1]);
        register.rotate_right(1);
        register[0] = fed_back;
        Some(out)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_register_has_the_longest_period() {
        for stages in PRBS_STAGES {
            let period = (1 << stages) - 1;
            let bits: Vec<bool> = sequence(stages).take(2 * period).collect();
            assert_eq!(bits[..period], bits[period..], "{stages}");
            assert_eq!(bits[..period].iter().filter(|bit| **bit).count(), 1 << (stages - 1), "{stages}");
            // All states but zero occur: every window of that length is different.
            let mut windows: Vec<&[bool]> = (0..period).map(|k| &bits[k..k + stages]).collect();
            windows.sort_unstable();
            windows.dedup();
            assert_eq!(windows.len(), period, "{stages}");
        }
    }

    #[test]
    fn pulses_and_doublets_have_their_levels() {
        let pulse = Input::pulse(1.0, 0.5, [2.0, 3.0], Some(2.0), 6.0).unwrap();
        assert_eq!([0.0, 1.0, 1.4, 1.5, 3.2, 3.6, 5.1].map(|t| pulse.at(t)), [2.0, 3.0, 3.0, 2.0, 3.0, 2.0, 3.0]);
        let doublet = Input::doublet(0.0, 1.0, 0.5, 4.0);
        assert_eq!([-0.1, 0.0, 0.9, 1.0, 1.9, 2.0].map(|t| doublet.at(t)), [4.0, 4.5, 4.5, 3.5, 3.5, 4.0]);
        assert!(Input::pulse(0.0, 1e-9, [0.0, 1.0], Some(1e-8), 1.0).unwrap_err().contains("more than"));
        let ramp = Input::ramp(1.0, 2.0, 3.0, 7.0);
        assert_eq!([0.0, 1.0, 1.5, 3.0, 9.0].map(|t| ramp.at(t)), [3.0, 3.0, 4.0, 7.0, 7.0]);
    }

    #[test]
    fn schroeders_phases_keep_the_peak_low() {
        let frequencies: Vec<f64> = (1..=20).map(f64::from).collect();
        let multisine = Input::multisine(&frequencies, 1.0, 0.0);
        let values: Vec<f64> = (0..4000).map(|k| multisine.at(f64::from(k) / 4000.0)).collect();
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / 4000.0).sqrt();
        let peak = values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        // The crest factor of one sine is 1.41; with equal phases it would be above 4.
        assert!((rms - 10f64.sqrt()).abs() < 1e-9 && peak / rms < 2.0, "{}", peak / rms);
    }
}
