//! Margins of a feedback loop: how far its loop transfer function stays from -1.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;

use super::norms::{level_frequencies, maximise};
use super::system::{above, beside};
use super::{Complex, FrequencyResponse, StateSpace, hinf_norm, zeros};

/// Where the response of a loop passes something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Angular frequency, rad/s; 0 and infinity are crossings too where the response ends on the negative real axis.
    pub frequency: f64,
    /// The loop transfer function there.
    pub response: Complex,
}

/// A loop transfer function L with unity negative feedback around it, its delay included.
///
/// Crossings are found as eigenvalues on the imaginary axis and made exact by bisection; with a delay the phase crossovers
/// are found by following the response with small steps of its phase. Whether the closed loop is stable is exact with a
/// delay too: roots can cross the imaginary axis only where `|L| = 1`, whatever the delay. Source: K. Walton, J. E.
/// Marshall, Direct method for TDS stability analysis, IEE Proceedings D 134 (1987) 101-107.
#[derive(Debug, Clone)]
pub struct Loop {
    system: StateSpace,
    response: FrequencyResponse,
    /// Where `|L| = 1`, by rising frequency.
    pub gain_crossovers: Vec<Crossing>,
    /// Whether the closed loop is stable.
    pub is_stable: bool,
}

impl Loop {
    /// The loop with this transfer function.
    ///
    /// # Errors
    /// Several inputs or outputs; an entry that is not finite; a loop without a solution.
    pub fn new(system: StateSpace) -> Result<Self, String> {
        if system.inputs.len() != 1 || system.outputs.len() != 1 {
            return Err("a loop transfer function has one input and one output".to_owned());
        }
        if !(system.delay >= 0.0 && system.delay.is_finite()) {
            return Err(format!("a delay must not be negative, but is {} s", system.delay));
        }
        let response = system.response()?;
        let mut found = Self { system, response, gain_crossovers: Vec::new(), is_stable: false };
        found.gain_crossovers = crossings(&found.system, &found.response, 1.0)?;
        found.is_stable = found.stability()?;
        Ok(found)
    }

    /// The loop transfer function at an angular frequency, rad/s.
    pub fn at(&self, frequency: f64) -> Complex {
        self.response.scalar(frequency)
    }

    /// The angular frequency, rad/s, from which on the gain of the closed loop `T = L/(1 + L)` is more than 3 dB below that
    /// at frequency 0.
    ///
    /// # Errors
    /// A closed loop that is not stable; a gain that starts at 0, or never falls so far.
    pub fn closed_loop_bandwidth(&self) -> Result<f64, String> {
        if !self.is_stable {
            return Err("the closed loop is not stable".to_owned());
        }
        if self.system.delay == 0.0 {
            return bandwidth(&self.system.complementary_sensitivity()?);
        }
        let points = self.followed()?;
        let gain = |l: Complex| (l / (l + 1.0)).norm();
        let at_zero = self.at(0.0);
        let start = if at_zero.is_finite() { gain(at_zero) } else { 1.0 };
        let level = start * 0.5f64.sqrt();
        let fall = points.windows(2).find(|p| gain(p[0].1) >= level && gain(p[1].1) < level);
        let fall = fall.ok_or_else(never_falls)?;
        Ok(bisect(|w| gain(self.at(w)) - level, fall[0].0, fall[1].0))
    }

    /// Where L is real and negative.
    ///
    /// # Errors
    /// An entry that is not finite.
    pub fn phase_crossovers(&self) -> Result<Vec<Crossing>, String> {
        let sine = |response: Complex| response.im / response.norm();
        let mut found = if self.system.delay == 0.0 {
            // Im L(j w) = 0 where L(s) - L(-s) vanishes.
            let StateSpace { a, b, c, .. } = &self.system;
            let n = a.nrows();
            let mut both = DMatrix::zeros(2 * n, 2 * n);
            both.view_mut((0, 0), (n, n)).copy_from(a);
            both.view_mut((n, n), (n, n)).copy_from(&-a);
            let difference = StateSpace::new(both, above(b, b), beside(c, c), DMatrix::zeros(1, 1));
            let near = |z: &&Complex| z.im > 0.0 && z.re.abs() <= 1e-4 * z.norm();
            exact(&self.response, zeros(&difference)?.iter().filter(near).map(|z| z.im).collect(), sine)
        } else {
            let points = self.followed()?;
            let turned = points.windows(2).filter(|p| p[0].1.re < 0.0 && p[0].1.im * p[1].1.im <= 0.0);
            let exact = turned.map(|p| bisect(|w| sine(self.at(w)), p[0].0, p[1].0));
            exact.map(|frequency| Crossing { frequency, response: self.at(frequency) }).collect()
        };
        found.retain(|crossing| crossing.response.re < 0.0);
        let (start, end) = (self.at(0.0), self.system.d[(0, 0)]);
        if start.is_finite() && start.re < 0.0 {
            found.insert(0, Crossing { frequency: 0.0, response: start });
        }
        // With a delay the response turns around a circle at infinite frequency, and meets the axis on both sides.
        let end = if self.system.delay > 0.0 { -end.abs() } else { end };
        if end < 0.0 {
            found.push(Crossing { frequency: f64::INFINITY, response: Complex::new(end, 0.0) });
        }
        Ok(found)
    }

    /// Whether the closed loop is stable.
    fn stability(&self) -> Result<bool, String> {
        let without = StateSpace { delay: 0.0, ..self.system.clone() };
        let unstable = without.complementary_sensitivity()?.poles()?.iter().filter(|p| p.re >= 0.0).count();
        let delay = self.system.delay;
        if delay == 0.0 {
            return Ok(unstable == 0);
        }
        if self.system.d[(0, 0)].abs() >= 1.0 {
            return Ok(false);
        }
        let mut unstable = unstable as f64;
        for Crossing { frequency, .. } in &self.gain_crossovers {
            // As the delay grows from 0, a pair of roots crosses here whenever it has turned L to -1: into the right
            // half plane where |L| falls with frequency, out of it where it rises.
            let at = |w: f64| self.at(w).norm();
            let rises = at(frequency * (1.0 + 1e-6)) > at(frequency * (1.0 - 1e-6));
            let first = angle_to_minus_one(self.at(*frequency) * Complex::from_polar(1.0, frequency * delay));
            let turns = ((frequency * delay - first) / TAU).floor() + 1.0;
            unstable += if rises { -2.0 } else { 2.0 } * turns.max(0.0);
        }
        Ok(unstable <= 0.0)
    }

    /// Points of the response, so close that neither its angle nor that of 1 + L turns by much from one to the next.
    fn followed(&self) -> Result<Vec<(f64, Complex)>, String> {
        let corners: Vec<f64> =
            self.system.poles()?.iter().chain(&zeros(&self.system)?).map(|z| z.norm()).filter(|w| *w > 0.0).collect();
        let delay = self.system.delay;
        let all = || corners.iter().copied().chain((delay > 0.0).then(|| 1.0 / delay));
        let low = 1e-3 * all().fold(f64::INFINITY, f64::min);
        let mut high = 1e3 * all().fold(0.0, f64::max);
        if !low.is_finite() {
            return Ok(Vec::new());
        }
        // Where the gain is that of a thousandth nothing is decided any more.
        while high > 1e-3 * low && self.at(0.5 * high).norm() < 1e-3 {
            high *= 0.5;
        }
        let mut grid: Vec<f64> = Vec::new();
        let mut omega = low;
        while omega < high && grid.len() < 50_000 {
            grid.push(omega);
            omega = (omega * 1.05).min(omega + if delay > 0.0 { 0.1 / delay } else { f64::INFINITY });
        }
        // Sharp resonances get points of their own.
        grid.extend(self.system.poles()?.iter().filter(|p| p.im > low).map(|p| p.im));
        grid.push(high);
        grid.sort_by(f64::total_cmp);
        let mut points = vec![(grid[0], self.at(grid[0]))];
        for &omega in &grid[1..] {
            self.refine((omega, self.at(omega)), 24, &mut points);
        }
        points.retain(|(_, response)| response.is_finite());
        Ok(points)
    }

    /// Adds a point, and between the last one and it as many as are needed.
    fn refine(&self, to: (f64, Complex), depth: u32, points: &mut Vec<(f64, Complex)>) {
        let from = *points.last().expect("there is a first point");
        let turn = |a: Complex, b: Complex| (b / a).ln().norm();
        let far = turn(from.1, to.1).max(turn(from.1 + 1.0, to.1 + 1.0));
        if depth > 0 && far > 0.2 {
            let middle = 0.5 * (from.0 + to.0);
            self.refine((middle, self.at(middle)), depth - 1, points);
            self.refine(to, depth - 1, points);
        } else {
            points.push(to);
        }
    }

    /// The phase margin: the smallest turn of L, either way, with which a point of it meets -1, rad; infinite where `|L|`
    /// never is 1. Negative where the closed loop is unstable.
    pub fn phase_margin(&self) -> f64 {
        let turns = self.gain_crossovers.iter().map(|c| (-c.response).arg().abs());
        self.signed(turns.fold(f64::INFINITY, f64::min))
    }

    /// The gain margin: the smallest factor above 1 by which L may be multiplied until it meets -1, in dB; infinite where
    /// none does. Negative where the closed loop is unstable: the smallest change of the gain, either way, with which L
    /// meets -1. With `both` a stable loop is judged by the smallest change either way too, for loops that become unstable
    /// with less gain.
    ///
    /// # Errors
    /// As [`Loop::phase_crossovers`].
    pub fn gain_margin(&self, both: bool) -> Result<f64, String> {
        let gains = self.phase_crossovers()?.into_iter().map(|c| -20.0 * c.response.norm().log10());
        let margin = if self.is_stable && !both {
            gains.filter(|&gain| gain >= 0.0).fold(f64::INFINITY, f64::min)
        } else {
            gains.map(f64::abs).fold(f64::INFINITY, f64::min)
        };
        Ok(self.signed(margin))
    }

    /// The delay margin: the smallest further delay that makes the closed loop unstable, s; infinite where none does.
    /// Negative where it is unstable: what the delay would have to lose.
    pub fn delay_margin(&self) -> f64 {
        let delays = self.gain_crossovers.iter().map(|c| {
            let turn = angle_to_minus_one(c.response);
            (if self.is_stable { turn } else { TAU - turn }) / c.frequency
        });
        self.signed(delays.fold(f64::INFINITY, f64::min))
    }

    /// The largest sensitivity, `Ms = max |1/(1 + L)|`.
    ///
    /// # Errors
    /// A closed loop that is not stable.
    pub fn peak_sensitivity(&self) -> Result<f64, String> {
        self.peak(StateSpace::sensitivity, |l| (l + 1.0).inv().norm(), |d| 1.0 / (1.0 - d))
    }

    /// The largest complementary sensitivity, `Mt = max |L/(1 + L)|`.
    ///
    /// # Errors
    /// A closed loop that is not stable.
    pub fn peak_complementary(&self) -> Result<f64, String> {
        self.peak(StateSpace::complementary_sensitivity, |l| (l / (l + 1.0)).norm(), |d| d / (1.0 - d))
    }

    fn peak(
        &self,
        closed: impl Fn(&StateSpace) -> Result<StateSpace, String>,
        gain: impl Fn(Complex) -> f64,
        at_infinity: impl Fn(f64) -> f64,
    ) -> Result<f64, String> {
        if !self.is_stable {
            return Err("the closed loop is not stable".to_owned());
        }
        if self.system.delay == 0.0 {
            return Ok(hinf_norm(&closed(&self.system)?)?.gain);
        }
        let points = self.followed()?;
        let gains: Vec<f64> = points.iter().map(|p| gain(p.1)).collect();
        let ends = [gains.first(), gains.last()].into_iter().flatten().copied();
        let tops = (1..gains.len().max(1) - 1).filter(|&i| gains[i] >= gains[i - 1] && gains[i] >= gains[i + 1]);
        let highest = gains.iter().copied().fold(0.0, f64::max);
        let tops = tops.filter(|&i| gains[i] > 0.8 * highest).map(|i| {
            let top = maximise(|w| gain(self.at(w)), points[i - 1].0, points[i + 1].0);
            gain(self.at(top)).max(gains[i])
        });
        Ok(tops.chain(ends).fold(at_infinity(self.system.d[(0, 0)].abs()), f64::max))
    }

    fn signed(&self, margin: f64) -> f64 {
        if self.is_stable { margin } else { -margin }
    }
}

/// The bandwidth: the lowest angular frequency, rad/s, at which the gain of a system with one input and one output is 3 dB
/// (a factor of `sqrt 2`) below that at frequency 0.
///
/// # Errors
/// A gain at frequency 0 that is 0 or infinite, or that is never so far below.
pub fn bandwidth(system: &StateSpace) -> Result<f64, String> {
    let response = system.response()?;
    let start = response.scalar(0.0).norm();
    if !(start > 0.0 && start.is_finite()) {
        return Err(format!("the gain at frequency 0 is {start}: there is no bandwidth"));
    }
    let found = crossings(system, &response, start * 0.5f64.sqrt())?;
    found.first().map(|crossing| crossing.frequency).ok_or_else(never_falls)
}

fn never_falls() -> String {
    "the gain is never 3 dB below that at frequency 0: the bandwidth is infinite".to_owned()
}

/// Frequencies above 0 at which the gain passes a level, rising.
fn crossings(system: &StateSpace, response: &FrequencyResponse, level: f64) -> Result<Vec<Crossing>, String> {
    let candidates = level_frequencies(system, level)?;
    Ok(exact(response, candidates, |response| response.norm().ln() - level.ln()))
}

/// Makes candidates exact: `passed` changes its sign there. Those at which it does not are dropped.
fn exact(response: &FrequencyResponse, candidates: Vec<f64>, passed: impl Fn(Complex) -> f64) -> Vec<Crossing> {
    let f = |omega: f64| passed(response.scalar(omega));
    let mut found: Vec<f64> = Vec::new();
    for candidate in candidates.into_iter().filter(|w| *w > 0.0 && w.is_finite()) {
        for width in [1e-9, 1e-7, 1e-5, 1e-3] {
            let (low, high) = (candidate * (1.0 - width), candidate * (1.0 + width));
            if f(low) * f(high) <= 0.0 {
                found.push(bisect(f, low, high));
                break;
            }
        }
    }
    found.sort_by(f64::total_cmp);
    found.dedup_by(|b, a| (*b - *a) <= 1e-9 * *a);
    found.into_iter().map(|frequency| Crossing { frequency, response: response.scalar(frequency) }).collect()
}

/// The lag, from 0 to 2 pi, that turns a response to the negative real axis.
fn angle_to_minus_one(response: Complex) -> f64 {
    (response.arg() + PI).rem_euclid(TAU)
}

/// Where `f` changes its sign between `low` and `high`.
pub(super) fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rises = f(high) >= 0.0;
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (f(middle) >= 0.0) == rises {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;
    use crate::linear::testing::assert_near;

    fn loop_of(numerator: &[f64], denominator: &[f64], delay: f64) -> Loop {
        let g = TransferFunction { numerator: numerator.to_vec(), denominator: denominator.to_vec(), delay };
        Loop::new(g.state_space().unwrap()).unwrap()
    }

    #[test]
    fn the_third_order_lag_has_its_closed_form() {
        // 4/(s + 1)^3: real at w = sqrt 3, where it is -1/2; |L| = 1 at w^2 = 4^(2/3) - 1.
        let l = loop_of(&[4.0], &[1.0, 3.0, 3.0, 1.0], 0.0);
        assert!(l.is_stable);
        let crossing = &l.phase_crossovers().unwrap();
        assert_eq!(crossing.len(), 1, "{crossing:?}");
        assert_near(crossing[0].frequency, 3.0f64.sqrt(), 1e-12);
        assert_near(crossing[0].response.re, -0.5, 1e-12);
        let w = (4.0f64.powf(2.0 / 3.0) - 1.0).sqrt();
        assert_near(l.gain_crossovers[0].frequency, w, 1e-12);
        assert_near(l.gain_margin(false).unwrap(), 20.0 * 2.0f64.log10(), 1e-11);
        assert_near(l.phase_margin(), PI - 3.0 * w.atan(), 1e-12);
        assert_near(l.delay_margin(), (PI - 3.0 * w.atan()) / w, 1e-12);
    }

    #[test]
    fn an_unstable_loop_has_negative_margins_that_pass_zero_at_the_limit() {
        // k/(s + 1)^3 is stable up to k = 8.
        let at = |k: f64| loop_of(&[k], &[1.0, 3.0, 3.0, 1.0], 0.0);
        assert!(at(7.999).is_stable && !at(8.001).is_stable);
        assert!(at(7.999).phase_margin() > 0.0 && at(7.999).phase_margin() < 1e-3);
        assert!(at(8.001).phase_margin() < 0.0 && at(8.001).phase_margin() > -1e-3);
        assert!(at(8.001).delay_margin() < 0.0 && at(8.001).delay_margin() > -1e-3);
    }

    #[test]
    fn the_delayed_integrator_is_stable_up_to_a_quarter_turn() {
        // exp(-s T)/s: stable for T < pi/2, phase margin pi/2 - T, delay margin the same, as |L| = 1 at 1 rad/s.
        for delay in [0.1, 1.0, 1.57] {
            let l = loop_of(&[1.0], &[1.0, 0.0], delay);
            assert!(l.is_stable, "{delay}");
            assert_near(l.phase_margin(), 0.5 * PI - delay, 1e-12);
            assert_near(l.delay_margin(), 0.5 * PI - delay, 1e-12);
            let first = l.phase_crossovers().unwrap()[0];
            assert_near(first.frequency, 0.5 * PI / delay, 1e-10);
            assert_near(first.response.re, -delay / (0.5 * PI), 1e-10);
        }
        assert!(!loop_of(&[1.0], &[1.0, 0.0], 1.58).is_stable);
    }

    #[test]
    fn a_loop_may_become_stable_by_a_delay() {
        // 0.2/(s^2 - 0.1 s + 1), unstable: a delay of a few seconds turns the phase so that feedback damps.
        let at = |delay: f64| loop_of(&[0.2], &[1.0, -0.1, 1.0], delay).is_stable;
        let found: Vec<bool> = [0.0, 2.0, 4.5, 7.0].iter().map(|&d| at(d)).collect();
        // By counting encirclements on a fine grid.
        let counted: Vec<bool> = [0.0, 2.0, 4.5, 7.0].iter().map(|&d| encirclements(d) == -2).collect();
        assert_eq!(found, counted);
        assert!(found.contains(&true) && found.contains(&false), "{found:?}");
    }

    /// Clockwise encirclements of -1 by `0.2 exp(-s T)/(s^2 - 0.1 s + 1)`, whose two poles are unstable.
    fn encirclements(delay: f64) -> i32 {
        let l = |w: f64| {
            let s = Complex::new(0.0, w);
            (-s * delay).exp() * 0.2 / (s * s - s * 0.1 + 1.0)
        };
        let points = (-400_000..400_000).map(|i| l(f64::from(i) * 1e-3) + 1.0);
        let mut turn = 0.0;
        let mut last: Option<Complex> = None;
        for p in points {
            turn -= last.map_or(0.0, |last| (p / last).arg());
            last = Some(p);
        }
        (turn / TAU).round() as i32
    }

    #[test]
    fn peaks_have_their_closed_form() {
        // L = w^2/(s (s + 2 z w)): T is the second-order system, Mt = 1/(2 z sqrt(1 - z^2)).
        let (z, w) = (0.3, 2.0);
        let l = loop_of(&[w * w], &[1.0, 2.0 * z * w, 0.0], 0.0);
        assert_near(l.peak_complementary().unwrap(), 1.0 / (2.0 * z * f64::sqrt(1.0 - z * z)), 1e-9);
        // |S|^2 = x (x + 4 z^2)/((1 - x)^2 + 4 z^2 x) with x = (w/w0)^2.
        let s2 = |x: f64| x * (x + 4.0 * z * z) / ((1.0 - x) * (1.0 - x) + 4.0 * z * z * x);
        assert_near(l.peak_sensitivity().unwrap(), s2(maximise(s2, 0.5, 3.0)).sqrt(), 1e-9);
    }

    #[test]
    fn an_unstable_plant_may_lose_less_gain_than_it_may_gain() {
        // 2 (s + 3)/((s - 1)(s + 10)): -0.6 at frequency 0, so unstable; with the gain 4 it is -1.2 and stable.
        let at = |k: f64| loop_of(&[k, 3.0 * k], &[1.0, 9.0, -10.0], 0.0);
        assert!(!at(2.0).is_stable && at(4.0).is_stable);
        assert_near(at(4.0).gain_margin(true).unwrap(), 20.0 * 1.2f64.log10(), 1e-11);
        assert_eq!(at(4.0).gain_margin(false).unwrap(), f64::INFINITY);
        assert_near(at(2.0).gain_margin(false).unwrap(), 20.0 * 0.6f64.log10(), 1e-11);
    }

    #[test]
    fn the_bandwidth_has_its_closed_form_with_and_without_delay() {
        // 1/(T s + 1): 1/T. The closed loop of an integrator k/s: k.
        let lag = TransferFunction::new(vec![3.0], vec![0.5, 1.0]).state_space().unwrap();
        assert_near(bandwidth(&lag).unwrap(), 2.0, 1e-12);
        assert_near(loop_of(&[7.0], &[1.0, 0.0], 0.0).closed_loop_bandwidth().unwrap(), 7.0, 1e-11);
        // k exp(-s T)/s: |j w exp(j w T) + k|^2 = 2 k^2, that is w^2 - 2 k w sin(w T) = k^2.
        let w = loop_of(&[1.0], &[1.0, 0.0], 0.3).closed_loop_bandwidth().unwrap();
        assert_near(w * w - 2.0 * w * (0.3 * w).sin(), 1.0, 1e-9);
        let lead = TransferFunction::new(vec![2.0, 1.0], vec![1.0, 1.0]).state_space().unwrap();
        assert!(bandwidth(&lead).unwrap_err().contains("never"));
    }

    #[test]
    fn a_vanishing_delay_changes_no_peak() {
        let with = |delay| loop_of(&[4.0], &[1.0, 3.0, 3.0, 1.0], delay);
        for of in [Loop::peak_sensitivity, Loop::peak_complementary] {
            let (exact, late) = (of(&with(0.0)).unwrap(), of(&with(1e-9)).unwrap());
            assert_near(late, exact, 1e-6);
        }
        assert!(loop_of(&[9.0], &[1.0, 3.0, 3.0, 1.0], 0.0).peak_sensitivity().is_err());
    }

    #[test]
    fn a_loop_that_never_reaches_gain_one_has_no_finite_margin() {
        let l = loop_of(&[0.5], &[1.0, 1.0], 0.2);
        assert_eq!((l.phase_margin(), l.delay_margin()), (f64::INFINITY, f64::INFINITY));
    }
}
