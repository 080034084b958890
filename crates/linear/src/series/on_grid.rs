//! Margins of a loop from values of L on a dense grid, and its stability by the argument principle.

use std::f64::consts::{PI, TAU};

use mops_math as math;
use mops_math::complex;

use crate::Complex;
use crate::margins::by_grid::bisect;

/// Ratio of successive frequencies of a grid.
const RATIO: f64 = 1.01;

/// Loop transfer function as a function of the frequency, rad/s, with what the argument principle needs.
pub struct OnGrid<'a> {
    pub at: &'a dyn Fn(f64) -> Complex,
    /// Number of poles at s = 0 or z = 1; all others are stable.
    pub integrators: usize,
    /// Lowest and highest frequency, rad/s. Of a sampled loop, the highest is half of the sampling frequency.
    pub ends: [f64; 2],
    pub is_sampled: bool,
}

/// Margins of a loop.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    /// Number of unstable closed-loop poles.
    pub unstable: i64,
    /// Smallest distance of L from -1.
    pub distance: f64,
    /// Gain margin, dB; infinite if L never meets the negative real axis below 1.
    pub gain: f64,
    /// Phase margin, rad.
    pub phase: f64,
    /// Largest sensitivity.
    pub peak: f64,
    /// Highest gain crossover, rad/s; 0 without one.
    pub crossover: f64,
}

impl OnGrid<'_> {
    /// Returns the margins.
    pub fn margins(&self) -> Expected {
        let grid = self.grid();
        let values: Vec<Complex> = grid.iter().map(|&w| (self.at)(w)).collect();
        let pairs = || grid.windows(2).zip(values.windows(2));
        let turn: f64 = values.windows(2).map(|l| complex::arg((l[1] + 1.0) / (l[0] + 1.0))).sum();
        // Around the poles at 0, or from the real response at 0 to that of the first frequency.
        let start = if self.integrators > 0 { 0.0 } else { complex::arg((values[0] + 1.0) / (values[0].re + 1.0)) };
        let unstable = (-(2.0 * (turn + start) - self.integrators as f64 * PI) / TAU).round() as i64;
        let (mut gain, mut phase, mut crossover) = (f64::INFINITY, f64::INFINITY, 0.0f64);
        let mut meets = |l: Complex| {
            let size = complex::norm(l);
            if size < 1.0 {
                gain = gain.min(-20.0 * math::log10(size));
            }
        };
        for (w, l) in pairs() {
            let outside = |l: Complex| complex::norm(l) >= 1.0;
            if outside(l[0]) != outside(l[1]) {
                let at = bisect(w, |w| outside((self.at)(w)) == outside(l[0]));
                phase = phase.min(complex::arg(-(self.at)(at)).abs());
                crossover = at;
            }
            if l[0].re < 0.0 && l[1].re < 0.0 && (l[0].im >= 0.0) != (l[1].im >= 0.0) {
                let at = bisect(w, |w| ((self.at)(w).im >= 0.0) == (l[0].im >= 0.0));
                meets((self.at)(at));
            }
        }
        let end = values[values.len() - 1];
        if self.is_sampled && end.re < 0.0 {
            meets(Complex::new(end.re, 0.0));
        }
        if self.integrators == 0 && values[0].re < 0.0 {
            meets(Complex::new(values[0].re, 0.0));
        }
        let peak = self.peak(&grid, &values);
        Expected { unstable, distance: 1.0 / peak, gain, phase, peak, crossover }
    }

    fn grid(&self) -> Vec<f64> {
        let [low, high] = self.ends;
        let mut grid = vec![low];
        let mut w = low;
        while w < high {
            let step = (RATIO - 1.0) * if self.is_sampled { w.min(0.3 * high) } else { w };
            w = (w + step).min(high);
            grid.push(w);
        }
        grid
    }

    /// Returns the largest sensitivity, refined between neighbours of the grid.
    fn peak(&self, grid: &[f64], values: &[Complex]) -> f64 {
        let sensitivity = |l: Complex| 1.0 / complex::norm(l + 1.0);
        let all: Vec<f64> = values.iter().map(|l| sensitivity(*l)).collect();
        let mut best = all.iter().copied().fold(if self.is_sampled { 0.0 } else { 1.0 }, f64::max);
        for i in 1..grid.len() - 1 {
            if all[i] >= all[i - 1] && all[i] >= all[i + 1] && all[i] > 0.9 * best {
                let (mut low, mut high) = (grid[i - 1], grid[i + 1]);
                for _ in 0..60 {
                    let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                    if sensitivity((self.at)(a)) >= sensitivity((self.at)(b)) { high = b } else { low = a }
                }
                best = best.max(sensitivity((self.at)(0.5 * (low + high))));
            }
        }
        best
    }
}
