//! Margins and peaks of random loops against an independent computation: products of poles and zeros on a dense grid,
//! closed-loop poles by the argument principle.

use std::f64::consts::{LN_10, PI, TAU};

use mops_math as math;
use mops_math::{complex, stream};
use proptest::prelude::*;
use rand::Rng;

use crate::testing::c;
use crate::{Complex, Loop, TransferFunction};

/// Number of grid frequencies from which on a loop is skipped.
const MOST: usize = 200_000;

/// Loop given by zeros, poles, gain and delay.
#[derive(Debug, Clone)]
struct Factored {
    zeros: Vec<Complex>,
    poles: Vec<Complex>,
    gain: f64,
    delay: f64,
}

impl Factored {
    /// Returns a random loop: corners over three decades, at most one integrator, some loops unstable, half of them
    /// with a delay.
    fn random(seed: u64) -> Self {
        let mut stream = stream(seed, "loop");
        let mut root = |left: bool| {
            let size = math::exp(stream.random_range(-1.0..2.0) * LN_10);
            if stream.random_bool(0.5) {
                vec![c(if left { -size } else { size }, 0.0)]
            } else {
                let damping: f64 = stream.random_range(0.05..0.95);
                let z = complex::from_polar(size, PI - math::acos(damping)) * if left { 1.0 } else { -1.0 };
                vec![z, z.conj()]
            }
        };
        let mut poles: Vec<Complex> = (0..3).flat_map(|_| root(true)).collect();
        let mut zeros = root(!seed.is_multiple_of(5));
        if seed.is_multiple_of(7) {
            poles.extend(root(false));
        }
        if seed.is_multiple_of(3) {
            zeros.clear();
        }
        if seed.is_multiple_of(4) {
            poles.push(c(0.0, 0.0));
        }
        let delay = if seed.is_multiple_of(2) { math::exp(stream.random_range(-2.0..1.0) * LN_10) } else { 0.0 };
        let bare = Self { zeros, poles, gain: 1.0, delay };
        // A gain of 1/30 to 30 at a frequency among the corners.
        let omega = math::exp(stream.random_range(-1.0..2.0) * LN_10);
        let gain = math::exp(stream.random_range(-1.5..1.5) * LN_10) / complex::norm(bare.at(omega));
        Self { gain, ..bare }
    }

    fn at(&self, omega: f64) -> Complex {
        let s = c(0.0, omega);
        let above: Complex = self.zeros.iter().map(|z| s - z).product();
        let below: Complex = self.poles.iter().map(|p| s - p).product();
        above / below * self.gain * complex::exp(-s * self.delay)
    }

    fn system(&self) -> Loop {
        use crate::transfer::polynomial;
        let numerator = polynomial(&self.zeros).iter().map(|c| c * self.gain).collect();
        let g = TransferFunction { numerator, denominator: polynomial(&self.poles), delay: self.delay };
        Loop::new(g.state_space().unwrap()).unwrap()
    }

    /// Returns frequencies, at most [`MOST`], between which neither L nor its distance from -1 turns by much.
    fn grid(&self) -> Vec<f64> {
        let mut grid = Vec::new();
        let mut omega: f64 = 1e-7;
        while grid.len() < MOST {
            grid.push(omega);
            if omega > 1e4 && complex::norm(self.at(omega)) < 1e-7 {
                break;
            }
            let step = if self.delay > 0.0 { 0.05 / self.delay } else { f64::INFINITY };
            omega += (0.002 * omega).min(step);
        }
        grid
    }

    /// Returns the number of unstable closed-loop poles when L is multiplied by `gain`.
    fn unstable(&self, gain: f64, values: &[Complex]) -> i64 {
        let turn: f64 = values.windows(2).map(|l| complex::arg((l[1] * gain + 1.0) / (l[0] * gain + 1.0))).sum();
        self.count(turn, gain, values[0])
    }

    /// Returns the number of unstable closed-loop poles from the turn of 1 + L over a grid; `first` is L at its first
    /// frequency.
    fn count(&self, turn: f64, gain: f64, first: Complex) -> i64 {
        // Turn around a pole at 0, or from frequency 0, where the response is real, to the first grid frequency.
        let integrators = self.poles.iter().filter(|p| complex::norm(**p) == 0.0).count() as f64;
        let at_zero = c(complex::norm(first).copysign(first.re), 0.0);
        let start = if integrators > 0.0 { 0.0 } else { complex::arg((first * gain + 1.0) / (at_zero * gain + 1.0)) };
        let poles = self.poles.iter().filter(|p| p.re > 0.0).count() as f64;
        (poles - (2.0 * (turn + start) - integrators * PI) / TAU).round() as i64
    }

    /// Returns the frequencies at which `|L| = 1`, located on a grid.
    fn crossovers(&self, grid: &[f64], values: &[Complex]) -> Vec<f64> {
        let passes = |l: &[Complex]| (complex::norm(l[0]) >= 1.0) != (complex::norm(l[1]) >= 1.0);
        let pairs = grid.windows(2).zip(values.windows(2)).filter(|(_, l)| passes(l));
        pairs
            .map(|(w, l)| bisect(w, |omega| (complex::norm(self.at(omega)) >= 1.0) == (complex::norm(l[0]) >= 1.0)))
            .collect()
    }

    /// Returns the number of unstable poles when L is turned by a lead, rad, at all frequencies except the very lowest.
    fn unstable_with_lead(&self, lead: f64, values: &[Complex]) -> i64 {
        let ramp: f64 = (0..2000)
            .map(|i| {
                let at = |i: i32| values[0] * complex::from_polar(1.0, lead * f64::from(i) / 2000.0) + 1.0;
                complex::arg(at(i + 1) / at(i))
            })
            .sum();
        let turned: Vec<Complex> = values.iter().map(|l| l * complex::from_polar(1.0, lead)).collect();
        self.count(
            ramp + turned.windows(2).map(|l| complex::arg((l[1] + 1.0) / (l[0] + 1.0))).sum::<f64>(),
            1.0,
            values[0],
        )
    }

    /// Returns the gains at which L meets -1.
    fn gains(&self, grid: &[f64], values: &[Complex]) -> Vec<f64> {
        let mut gains = Vec::new();
        for (w, l) in grid.windows(2).zip(values.windows(2)) {
            if l[0].re < 0.0 && (l[0].im >= 0.0) != (l[1].im >= 0.0) {
                let omega = bisect(w, |omega| (self.at(omega).im >= 0.0) == (l[0].im >= 0.0));
                gains.push(1.0 / complex::norm(self.at(omega)));
            }
        }
        let start = self.at(0.0);
        if start.is_finite() && start.re < 0.0 {
            gains.push(1.0 / complex::norm(start));
        }
        gains.sort_by(f64::total_cmp);
        gains
    }
}

/// Returns the end of the subrange in which `like_low` is true.
pub fn bisect(range: &[f64], like_low: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (range[0], range[1]);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if like_low(middle) { low = middle } else { high = middle }
    }
    low
}

/// Returns the magnitude of the change nearest to 0 next to which no pole is unstable.
///
/// The forty nearest of the given changes are tried, at each of which stability may change. Returns as error the
/// largest magnitude that was tried.
fn nearest(mut changes: Vec<f64>, unstable: impl Fn(f64) -> i64) -> Result<f64, f64> {
    changes.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let beside = |x: f64| {
        let far = |sign: f64| {
            let next = changes.iter().copied().filter(|y| (y - x) * sign > 1e-9).map(|y| (y - x).abs());
            x + sign * 0.5 * next.fold(1e-3, f64::min)
        };
        unstable(far(1.0)) == 0 || unstable(far(-1.0)) == 0
    };
    let tried = &changes[..changes.len().min(40)];
    let farthest = |sign: f64| changes.iter().map(|x| x * sign).fold(0.0, f64::max);
    let all = if tried.len() < changes.len() { tried[39].abs() } else { farthest(1.0).min(farthest(-1.0)) };
    tried.iter().copied().find(|&x| beside(x)).map(f64::abs).ok_or(all)
}

/// Returns true if a margin is minus the nearest change found, or beyond all that were tried.
fn agrees(margin: &Result<f64, String>, nearest: Result<f64, f64>) -> bool {
    match (margin, nearest) {
        (Ok(margin), Ok(change)) => (margin + change).abs() <= 1e-6 * (1.0 + change),
        (Ok(margin), Err(tried)) => -margin >= tried,
        (Err(_), Ok(change)) => change > 200.0,
        (Err(_), Err(_)) => true,
    }
}

fn decibel(gain: f64) -> f64 {
    20.0 * math::log10(gain)
}

/// Returns the highest value of a function on a grid, refined between grid neighbours.
fn highest(grid: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let values: Vec<f64> = grid.iter().map(|&w| f(w)).collect();
    let mut best = values.iter().copied().fold(0.0, f64::max);
    for i in 1..grid.len() - 1 {
        if values[i] >= values[i - 1] && values[i] >= values[i + 1] && values[i] > 0.9 * best {
            let (mut low, mut high) = (grid[i - 1], grid[i + 1]);
            for _ in 0..60 {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                if f(a) >= f(b) { high = b } else { low = a }
            }
            best = best.max(f(0.5 * (low + high)));
        }
    }
    best
}

proptest! {
    #![proptest_config(mops_tiers::property(250))]

    #[test]
    fn margins_and_peaks_are_those_of_a_dense_grid(seed in 0u64..1_000_000_000) {
        let factored = Factored::random(seed);
        let found = factored.system();
        let grid = factored.grid();
        prop_assume!(grid.len() < MOST);
        let values: Vec<Complex> = grid.iter().map(|&w| factored.at(w)).collect();
        let unstable = factored.unstable(1.0, &values);
        prop_assert_eq!(found.unstable, Some(unstable as usize), "{:?}", factored);
        let gains = factored.gains(&grid, &values);
        if unstable == 0 {
            let exact = gains.iter().copied().filter(|g| *g > 1.0).fold(f64::INFINITY, f64::min);
            let margin = found.gain_margin(false).unwrap();
            // The grid ends at -140 dB.
            prop_assert!((margin - decibel(exact)).abs() < 1e-6 || margin.min(decibel(exact)) > 130.0,
                "{} {} {:?}", margin, decibel(exact), factored);
            let closed = |l: Complex| complex::norm(l / (l + 1.0));
            let start = if factored.at(0.0).is_finite() { closed(factored.at(0.0)) } else { 1.0 };
            let crossovers = factored.crossovers(&grid, &values);
            let lags = crossovers.iter().map(|&w| (w, complex::arg(-factored.at(w))));
            let phase = lags.clone().map(|(_, lag)| lag.abs()).fold(f64::INFINITY, f64::min);
            let delay = lags.map(|(w, lag)| lag.rem_euclid(TAU) / w).fold(f64::INFINITY, f64::min);
            let same = |a: f64, b: f64| a == b || (a - b).abs() < 1e-6 * (1.0 + b);
            prop_assert!(same(found.phase_margin().unwrap(), phase), "{} {:?}", phase, factored);
            prop_assert!(same(found.delay_margin().unwrap(), delay), "{} {:?}", delay, factored);
            let mt = highest(&grid, |w| closed(factored.at(w))).max(start);
            let ms = highest(&grid, |w| complex::norm((factored.at(w) + 1.0).inv())).max(1.0);
            let (t, s) = (found.peak_complementary().unwrap(), found.peak_sensitivity().unwrap());
            prop_assert!((t / mt - 1.0).abs() < 1e-6, "{} {} {:?}", t, mt, factored);
            prop_assert!((s / ms - 1.0).abs() < 1e-6, "{} {} {:?}", s, ms, factored);
        } else {
            let gains = gains.iter().map(|g| decibel(*g)).collect();
            let gain = nearest(gains, |g| factored.unstable(math::powf(10.0, g / 20.0), &values));
            let margin = found.gain_margin(false);
            prop_assert!(agrees(&margin, gain), "gain {:?} {:?} {:?}", margin, gain, factored);
            let lags: Vec<(f64, f64)> =
                factored.crossovers(&grid, &values).iter().map(|&w| (w, complex::arg(-factored.at(w)))).collect();
            let leads = lags.iter().flat_map(|(_, lag)| (-9..=9).map(move |k| TAU * f64::from(k) - lag)).collect();
            let phase = nearest(leads, |lead| factored.unstable_with_lead(lead, &values));
            let margin = found.phase_margin();
            prop_assert!(agrees(&margin, phase), "phase {:?} {:?} {:?}", margin, phase, factored);
            // Remaining or additional delays; the margin may require a lead instead.
            let delays = lags.iter().flat_map(|(w, lag)| (-9..=9).map(move |k| (lag + TAU * f64::from(k)) / w));
            let delays = delays.filter(|more| factored.delay + more > 0.0).collect();
            let delay = nearest(delays, |more| {
                let late = Factored { delay: (factored.delay + more).max(0.0), ..factored.clone() };
                late.unstable(1.0, &grid.iter().map(|&w| late.at(w)).collect::<Vec<_>>())
            });
            let margin = found.delay_margin();
            let leads = margin.as_ref().is_ok_and(|margin| -margin > factored.delay);
            prop_assert!(leads || agrees(&margin, delay), "delay {:?} {:?} {:?}", margin, delay, factored);
        }
    }
}
