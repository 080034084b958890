//! Spectrum and autocorrelation of a residual.

use mops_math as math;

/// Largest number of lags; also limited to a quarter of the samples.
const MOST_LAGS: usize = 100;
/// Bounds of the segment length, in samples; the length is a third of the record within these bounds.
const SEGMENT: [usize; 2] = [32, 512];

/// Returns a residual at evenly spaced times: the sample time, s, and the values. Uneven samples are interpolated
/// linearly. `None` for records shorter than a segment.
pub(super) fn even(times: &[f64], values: &[f64]) -> Option<(f64, Vec<f64>)> {
    let known: Vec<(f64, f64)> =
        times.iter().copied().zip(values.iter().copied()).filter(|p| p.1.is_finite()).collect();
    let mut steps: Vec<f64> = known.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    if known.len() < SEGMENT[0] {
        return None;
    }
    let regular: Vec<f64> = known.iter().map(|p| p.1).collect();
    let spread = steps.iter().fold([f64::INFINITY, 0.0f64], |[low, high], &s| [low.min(s), high.max(s)]);
    steps.sort_by(f64::total_cmp);
    let step = steps[steps.len() / 2];
    if spread[1] - spread[0] < 0.05 * step {
        return Some((step, regular));
    }
    let count = ((known[known.len() - 1].0 - known[0].0) / step) as usize + 1;
    let mut k = 0;
    let at = |i: usize| {
        let time = known[0].0 + i as f64 * step;
        while k + 2 < known.len() && known[k + 1].0 < time {
            k += 1;
        }
        let ((from, low), (to, high)) = (known[k], known[k + 1]);
        low + (high - low) * ((time - from) / (to - from)).clamp(0.0, 1.0)
    };
    (step > 0.0 && count < 10_000_000).then(|| (step, (0..count).map(at).collect()))
}

/// Returns frequencies, Hz, with the power spectrum relative to white noise of standard deviation `noise`.
///
/// Average over segments with a Hann window and 50 % overlap. Source: P. D. Welch, The use of fast Fourier transform
/// for the estimation of power spectra, IEEE Transactions on Audio and Electroacoustics 15 (1967), 70-73.
pub(super) fn spectrum(step: f64, values: &[f64], noise: f64) -> Vec<(f64, f64)> {
    let length = (values.len() / 3).clamp(SEGMENT[0], SEGMENT[1]).min(values.len());
    let window: Vec<f64> = (0..length)
        .map(|i| math::powi(math::sin(std::f64::consts::PI * (i as f64 + 0.5) / length as f64), 2))
        .collect();
    let weight: f64 = window.iter().map(|w| w * w).sum();
    let circle: Vec<(f64, f64)> =
        (0..length).map(|i| math::sin_cos(std::f64::consts::TAU * i as f64 / length as f64)).collect();
    let starts: Vec<usize> = (0..).map(|i| i * (length / 2)).take_while(|s| s + length <= values.len()).collect();
    let power = |k: usize| {
        let of_segment = |&start: &usize| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, w) in window.iter().enumerate() {
                let (sin, cos) = circle[i * k % length];
                re += w * values[start + i] * cos;
                im += w * values[start + i] * sin;
            }
            (re * re + im * im) / weight
        };
        starts.iter().map(of_segment).sum::<f64>() / starts.len() as f64
    };
    (1..=length / 2).map(|k| (k as f64 / (length as f64 * step), power(k) / (noise * noise))).collect()
}

/// Returns lags, s, from one sample on, with the autocorrelation about the mean.
pub(super) fn autocorrelation(step: f64, values: &[f64]) -> Vec<(f64, f64)> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let product = |lag: usize| centred.iter().zip(&centred[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let power = product(0);
    (1..=MOST_LAGS.min(n / 4)).map(|lag| (lag as f64 * step, product(lag) / power)).collect()
}

/// Returns the half-width of the band that contains the autocorrelation of white residuals with probability 0.95.
/// Source: G. E. P. Box, G. M. Jenkins, Time Series Analysis, Forecasting and Control (1976), section 2.1.6.
pub(super) fn band(count: usize) -> f64 {
    1.96 / (count as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(n: usize) -> Vec<f64> {
        // Source: D. E. Knuth, The Art of Computer Programming 2, section 3.3.4, table 1, line 26.
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| 12f64.sqrt() * (next() - 0.5)).collect()
    }

    #[test]
    fn the_spectrum_of_white_noise_is_flat_at_one_and_a_sine_has_a_peak_at_its_frequency() {
        let noise = white(4096);
        let flat = spectrum(0.01, &noise, 1.0);
        let mean = flat.iter().map(|p| p.1).sum::<f64>() / flat.len() as f64;
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
        assert!((flat[flat.len() - 1].0 - 50.0).abs() < 1e-9, "it ends at half the sampling frequency");
        let with_sine: Vec<f64> = noise
            .iter()
            .enumerate()
            .map(|(i, v)| v + math::sin(std::f64::consts::TAU * 7.03 * 0.01 * i as f64))
            .collect();
        let peak = spectrum(0.01, &with_sine, 1.0).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((peak.0 - 7.03).abs() < 0.2 && peak.1 > 30.0, "{peak:?}");
    }

    #[test]
    fn the_autocorrelation_of_an_autoregression_is_geometric_and_white_noise_stays_in_the_band() {
        let noise = white(8000);
        let mut slow = vec![0.0];
        for v in &noise {
            slow.push(0.8 * slow[slow.len() - 1] + v);
        }
        let found = autocorrelation(0.5, &slow);
        for (k, expected) in [(0, 0.8), (1, 0.64), (2, 0.512)] {
            assert!((found[k].1 - expected).abs() < 0.05, "lag {}: {} is not {expected}", k + 1, found[k].1);
        }
        assert_eq!((found[1].0, found.len()), (1.0, MOST_LAGS));
        let outside = autocorrelation(1.0, &noise).iter().filter(|p| p.1.abs() > band(8000)).count();
        assert!(outside <= 12, "{outside} of 100 lags outside a band of 95 %");
    }

    #[test]
    fn gaps_are_interpolated_and_short_records_have_no_spectrum() {
        let times: Vec<f64> = (0..100).filter(|i| !(40..45).contains(i)).map(f64::from).collect();
        let (step, values) = even(&times, &times).unwrap();
        assert_eq!((step, values.len()), (1.0, 100));
        assert!(values.iter().enumerate().all(|(i, v)| (v - i as f64).abs() < 1e-9));
        assert_eq!(even(&times[..10], &times[..10]), None);
    }
}
