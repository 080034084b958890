//! Excitation signals of experiments, rounded to the six decimal places of the data file.

use std::f64::consts::TAU;

use mops_math as math;

use crate::draw::Draw;

/// Rounds to the resolution of the data file.
fn shown(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values.map(|v| (v * 1e6).round() / 1e6).collect()
}

/// Multisine of four to seven sines with random phases and frequencies (Hz) between two limits, with root mean square
/// `rms`.
pub fn multisine(draw: &mut Draw, samples: usize, dt: f64, (low, high): (f64, f64), rms: f64) -> Vec<f64> {
    let n = 4 + draw.below(4);
    let lines: Vec<_> = (0..n).map(|_| (TAU * draw.log_between(low, high), draw.between(0.0, TAU))).collect();
    let amplitude = rms * (2.0 / n as f64).sqrt();
    shown((0..samples).map(|k| lines.iter().map(|(w, phase)| amplitude * math::sin(w * k as f64 * dt + phase)).sum()))
}

/// Random levels between two values, each with a random duration between two times, s.
pub fn steps(draw: &mut Draw, samples: usize, dt: f64, (short, long): (f64, f64), (low, high): (f64, f64)) -> Vec<f64> {
    let (mut level, mut left) = (draw.between(low, high), 0.0);
    shown((0..samples).map(|_| {
        if left <= 0.0 {
            level = draw.between(low, high);
            left = draw.between(short, long);
        }
        left -= dt;
        level
    }))
}

/// Sine with linearly increasing frequency, Hz.
pub fn chirp(draw: &mut Draw, samples: usize, dt: f64, (low, high): (f64, f64), amplitude: f64) -> Vec<f64> {
    let (phase, end) = (draw.between(0.0, TAU), samples as f64 * dt);
    shown((0..samples).map(|k| {
        let t = k as f64 * dt;
        amplitude * math::sin(phase + TAU * (low * t + (high - low) * t * t / (2.0 * end)))
    }))
}

/// Multisine, steps or chirp, with values of about `size`.
pub fn any(draw: &mut Draw, samples: usize, dt: f64, band: (f64, f64), size: f64) -> Vec<f64> {
    match draw.below(3) {
        0 => multisine(draw, samples, dt, band, size * 0.7),
        1 => steps(draw, samples, dt, (0.3 / band.1.max(band.0), 0.6 / band.0), (-size, size)),
        _ => chirp(draw, samples, dt, band, size),
    }
}

/// Slow variation about a mean, such as an outdoor temperature over days: a daily sine and a random walk.
pub fn weather(draw: &mut Draw, samples: usize, dt: f64, mean: f64, swing: f64) -> Vec<f64> {
    let (phase, mut walk) = (draw.between(0.0, TAU), 0.0);
    let kick = 0.15 * swing * (dt / 3600.0).sqrt();
    shown((0..samples).map(|k| {
        walk += kick * draw.normal() - walk * dt / 40_000.0;
        mean + walk + swing * math::sin(TAU * k as f64 * dt / 86_400.0 + phase)
    }))
}

/// Returns the number of samples of a record: twice `samples` for calibration, which is experiment 0.
pub fn length(experiment: usize, samples: usize) -> usize {
    if experiment == 0 { 2 * samples } else { samples }
}

/// Excitation with root mean square 1 within a band of frequencies, Hz: sines and filtered steps for calibration, sines
/// of larger size for selection, filtered steps for validation.
pub fn record(draw: &mut Draw, experiment: usize, (samples, dt): (usize, f64), band: (f64, f64)) -> Vec<f64> {
    let unit = |v: Vec<f64>| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        let spread = (v.iter().map(|v| math::powi(v - mean, 2)).sum::<f64>() / v.len() as f64).sqrt();
        v.into_iter().map(|v| v / spread).collect::<Vec<f64>>()
    };
    let sines = |draw: &mut Draw| {
        let lines: Vec<(f64, f64)> =
            (0..7).map(|_| (TAU * draw.log_between(band.0, band.1), draw.between(0.0, TAU))).collect();
        let sum = |k: usize| lines.iter().map(|(w, phase)| math::cos(w * k as f64 * dt + phase)).sum();
        unit((0..samples).map(sum).collect())
    };
    let filtered = |draw: &mut Draw| {
        let (decay, mut level, mut left, mut y) = (math::exp(-TAU * band.1 * dt), 0.0, 0, 0.0);
        let step = |_| {
            if left == 0 {
                if draw.chance(0.9) {
                    level = draw.between(-1.7, 1.7);
                }
                left = (3.0 * draw.between(0.15, 0.6) / (band.1 * dt)) as usize + 2;
            }
            left -= 1;
            y = decay * y + (1.0 - decay) * level;
            y
        };
        unit((0..samples).map(step).collect())
    };
    match experiment {
        0 => {
            let (a, b) = (sines(draw), filtered(draw));
            unit(a.iter().zip(&b).map(|(a, b)| 0.6 * a + 0.8 * b).collect())
        }
        1 => sines(draw).into_iter().map(|v| 1.15 * v).collect(),
        _ => filtered(draw),
    }
}

/// Returns `factor u + offset`, limited to a range.
pub fn scaled(u: &[f64], factor: f64, offset: f64, limits: Option<(f64, f64)>) -> Vec<f64> {
    let (low, high) = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    shown(u.iter().map(|u| (factor * u + offset).clamp(low, high)))
}
