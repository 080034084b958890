//! Bounds of a frequency response over ranges of frequencies; unlike a grid, they miss no peak or crossing.

use super::{Complex, FrequencyResponse, StateSpace, eigenvalues, zeros};
use crate::math::{self, complex};

/// Gain below which a response counts as zero: -200 dB.
const FAINT: f64 = 1e-10;

/// Number of decades above the highest and below the lowest corner frequency that are always searched.
const BEYOND: i32 = 4;

/// Largest relative gain error of the pole-zero form with which poles and zeros are used as bounds.
///
/// Rounding causes far smaller errors; wrong zeros cause errors of the magnitude of the gain.
const INACCURATE: f64 = 1e-3;

/// Ratio of a response to the sum of its terms' magnitudes below which the response is inaccurate (cancellation).
const LOST: f64 = 1e-10;

/// Rounding error of bounds, rad or relative gain: far above that of a sum over some hundred poles and zeros.
const ROUNDING: f64 = 1e-12;

/// Single-input, single-output response `L(j w)` with its poles and zeros, which bound its change between frequencies.
#[derive(Debug, Clone)]
pub(super) struct BoundedResponse {
    response: FrequencyResponse,
    /// Zeros with weight 1, poles with weight -1.
    roots: Vec<(Complex, f64)>,
    delay: f64,
    /// Lowest and highest corner frequency, rad/s.
    corners: [f64; 2],
    /// Value of [`BoundedResponse::inaccuracy`].
    inaccuracy: f64,
}

impl BoundedResponse {
    /// Computes the bounded response of a system with one input and one output.
    ///
    /// # Errors
    /// If an entry is not finite, or if poles and zeros do not reproduce the response, so that they give no bounds.
    pub fn new(system: &StateSpace) -> Result<Self, String> {
        let zeros = zeros(system)?.into_iter().map(|z| (z, 1.0));
        let roots: Vec<(Complex, f64)> = zeros.chain(eigenvalues(&system.a)?.into_iter().map(|p| (p, -1.0))).collect();
        let delay = system.delay;
        let sizes = roots.iter().map(|(root, _)| complex::norm(*root)).chain((delay > 0.0).then(|| 1.0 / delay));
        let sizes: Vec<f64> = sizes.filter(|size| *size > 0.0 && size.is_finite()).collect();
        let (low, high) =
            (sizes.iter().copied().fold(f64::INFINITY, f64::min), sizes.iter().copied().fold(0.0, f64::max));
        let corners = if sizes.is_empty() { [1.0, 1.0] } else { [low, high] };
        let mut found = Self { response: system.response()?, roots, delay, corners, inaccuracy: ROUNDING };
        found.inaccuracy += found.check()?;
        Ok(found)
    }

    /// Returns the response at an angular frequency, rad/s.
    pub fn at(&self, omega: f64) -> Complex {
        self.response.on_axis(omega)[(0, 0)]
    }

    /// Returns the number of poles and zeros.
    pub fn order(&self) -> usize {
        self.roots.len()
    }

    /// Returns the lowest and highest corner frequency, rad/s.
    pub fn corners(&self) -> [f64; 2] {
        self.corners
    }

    /// Returns the largest distance of a response from its bounds, rad or relative gain, due to rounding and to errors
    /// of poles and zeros.
    pub fn inaccuracy(&self) -> f64 {
        self.inaccuracy
    }

    /// Returns ranges that cover all relevant frequencies, from 0 upwards.
    ///
    /// They end where the response is negligible, or has reached its value at infinite frequency.
    pub fn spans(&self) -> Vec<Span> {
        let decade = |power: i32| math::powi(10.0, power);
        let start = self.corners[0] * decade(-BEYOND);
        let mut spans = vec![self.over(0.0, start)];
        let end = self.corners[1] * decade(BEYOND);
        let mut low = start;
        let mut last = f64::INFINITY;
        loop {
            let gain = complex::norm(self.at(low));
            let settled = low >= end && (gain <= FAINT || gain >= 0.99 * last);
            if settled || !gain.is_finite() && low >= end || low > f64::MAX.sqrt() {
                return spans;
            }
            last = if low >= end { gain } else { last };
            spans.push(self.over(low, 10.0 * low));
            low *= 10.0;
        }
    }

    /// Returns the response over the frequencies from `low` to `high`.
    pub fn over(&self, low: f64, high: f64) -> Span {
        let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
        let mut slope = Complex::new(0.0, -self.delay * half);
        let (mut rest, mut gain, mut turn, mut far) = (0.0, [0.0, 0.0], 0.0, 0.0);
        let mut turned = 0.0;
        for &(root, sign) in &self.roots {
            let distance = Complex::new(-root.re, center - root.im);
            let x = half / complex::norm(distance);
            if x <= 0.5 {
                // ln(1 + u) = u + r with |r| <= |u|^2/(2 (1 - |u|)). The imaginary part of r is small if u is nearly
                // real: |Im u^k| <= k |sin arg u| |u|^k.
                slope += Complex::new(0.0, sign * half) / distance;
                let curved = x * x / (1.0 - x);
                rest += 0.5 * curved;
                turned += curved * (root.re.abs() / complex::norm(distance)).min(0.5);
            } else {
                let (change, angle) = whole_change(root, [low, center, high]);
                let change = if sign > 0.0 { change } else { [-change[1], -change[0]] };
                gain = [gain[0] + change[0], gain[1] + change[1]];
                turn += angle;
                far += math::hypot(change[0].abs().max(change[1].abs()), angle);
            }
        }
        let near = slope.re.abs() + rest;
        Span {
            low,
            high,
            response: self.at(center),
            slope,
            rest: rest + far,
            gain: [gain[0] - near, gain[1] + near],
            turn: turn + slope.im.abs() + turned,
        }
    }

    /// Compares the change of the gain between frequencies with that of the pole-zero form.
    ///
    /// Returns the largest difference, relative to the gain.
    fn check(&self) -> Result<f64, String> {
        let [low, high] = self.corners;
        let mut largest = 0.0f64;
        let mut before: Option<f64> = None;
        let steps = math::log10(high / low).ceil().max(1.0);
        for i in 0..=(2.0 * steps) as i32 {
            // Frequencies between the corners, offset to avoid round numbers.
            let omega = 1.07 * low * math::powf(10.0, 0.5 * f64::from(i));
            let s = Complex::new(0.0, omega);
            let rational: f64 = self.roots.iter().map(|(root, sign)| sign * math::ln(complex::norm(s - root))).sum();
            let gain = complex::norm(self.at(omega));
            // A response that is the rounding error of a sum carries no information.
            let lost = gain <= LOST * self.response.terms(s);
            if lost || !(gain > FAINT && gain.is_finite() && rational.is_finite()) {
                continue;
            }
            let expected = rational - math::ln(gain);
            largest = largest.max(before.map_or(0.0, |last| (expected - last).abs()));
            if largest > INACCURATE {
                return Err("the poles and zeros of the system are too inaccurate to bound its response".to_owned());
            }
            before = Some(expected);
        }
        Ok(largest)
    }
}

/// Returns bounds of the change of `ln |j w - root|` from the centre frequency to any other, and of the change of its
/// angle.
///
/// The distance is convex in w, and the angle monotone.
fn whole_change(root: Complex, [low, center, high]: [f64; 3]) -> ([f64; 2], f64) {
    let from = |omega: f64| Complex::new(-root.re, omega - root.im);
    let middle = from(center);
    let (first, last) = (complex::norm(from(low)), complex::norm(from(high)));
    let least = if (low..=high).contains(&root.im) { root.re.abs() } else { first.min(last) };
    let angle = |omega: f64| {
        let other = from(omega);
        if complex::norm(other) == 0.0 { 0.0 } else { complex::arg(other * middle.conj()).abs() }
    };
    let change = [least, first.max(last)].map(|distance| math::ln(distance / complex::norm(middle)));
    (change, angle(low).max(angle(high)))
}

/// Bounds of a response over a range of frequencies: `ln L` is its value at the centre, plus a part linear in the
/// frequency, plus a remainder.
#[derive(Debug, Clone)]
pub(super) struct Span {
    /// Lowest angular frequency, rad/s.
    pub low: f64,
    /// Highest angular frequency, rad/s.
    pub high: f64,
    /// Value of L at the centre.
    pub response: Complex,
    /// Linear part of `ln L` at the upper end.
    slope: Complex,
    /// Bound of the remainder of `ln L`, as a complex number.
    rest: f64,
    /// Bounds of the change of `ln |L|`.
    gain: [f64; 2],
    /// Bound of the phase change of L, rad.
    turn: f64,
}

/// Transfer function `(a + b L)/(1 + L)` of the closed loop with unity negative feedback.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Closed {
    /// Value without feedback, where L is 0.
    a: f64,
    /// Value at infinite L.
    b: f64,
}

impl Closed {
    /// Sensitivity `S = 1/(1 + L)`.
    pub const SENSITIVITY: Self = Self { a: 1.0, b: 0.0 };

    /// Complementary sensitivity `T = L/(1 + L)`.
    pub const COMPLEMENTARY: Self = Self { a: 0.0, b: 1.0 };

    /// Sensitivity plus a constant.
    pub fn sensitivity_plus(constant: f64) -> Self {
        Self { a: 1.0 + constant, b: constant }
    }

    /// Returns the gain for a value of L.
    pub fn gain(self, l: Complex) -> f64 {
        if l.is_finite() { complex::norm((l * self.b + self.a) / (l + 1.0)) } else { self.b.abs() }
    }
}

/// Returns the bounds of `|1 + z|` over `z` of these sizes, whose angles from the negative real axis have these magnitudes, rad.
fn distance_from_minus_one([low, high]: [f64; 2], [least, most]: [f64; 2]) -> [f64; 2] {
    let distance = |size: f64, angle: f64| {
        let sine = math::sin(0.5 * angle);
        if size.is_finite() { (math::powi(size - 1.0, 2) + 4.0 * size * sine * sine).sqrt() } else { f64::INFINITY }
    };
    [distance(math::cos(least).clamp(low, high), least), distance(low, most).max(distance(high, most))]
}

impl Span {
    /// Returns the centre frequency, rad/s.
    pub fn center(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Returns two halves, split at the geometric mean if the ends are far apart.
    pub fn split(&self, of: &BoundedResponse) -> [Self; 2] {
        let middle = match () {
            () if self.low == 0.0 => 0.1 * self.high,
            () if self.high > 4.0 * self.low => (self.low * self.high).sqrt(),
            () => self.center(),
        };
        [of.over(self.low, middle), of.over(middle, self.high)]
    }

    /// Returns bounds of `ln |L|`.
    pub fn gain(&self) -> [f64; 2] {
        let here = math::ln(complex::norm(self.response));
        [here + self.gain[0], here + self.gain[1]]
    }

    /// Returns bounds of the angle from the negative real axis to L, rad: 0 where L is real and negative, and -pi to pi
    /// if unbounded.
    pub fn angle(&self) -> [f64; 2] {
        use std::f64::consts::PI;
        let here = complex::arg(-self.response);
        if self.turn < PI { [here - self.turn, here + self.turn] } else { [-PI, PI] }
    }

    /// Returns bounds of the logarithm of the closed-loop gain.
    pub fn closed(&self, of: Closed) -> [f64; 2] {
        let (around, along) = (self.by_sector(of), self.by_slope(of));
        [around[0].max(along[0]), around[1].min(along[1])]
    }

    /// Returns bounds of the closed loop from bounds of the gain and the angle of L.
    fn by_sector(&self, of: Closed) -> [f64; 2] {
        use std::f64::consts::PI;
        let [low, high] = self.gain().map(math::exp);
        // Where L is large, (a + b L)/(1 + L) is (b + a/L)/(1 + 1/L), and 1/L has the opposite angle.
        let is_large = of.b != 0.0 && (of.a == 0.0 || complex::norm(self.response) > 1.0);
        let ([low, high], [a, b]) =
            if is_large { ([1.0 / high, 1.0 / low], [of.b, of.a]) } else { ([low, high], [of.a, of.b]) };
        if !(low >= 0.0 && high >= low) {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let angle = complex::arg(-self.response).abs();
        let [least, most] = [(angle - self.turn).max(0.0), (angle + self.turn).min(PI)];
        let [nearest, farthest] = distance_from_minus_one([low, high], [least, most]);
        // |a + b z| = |b| |z| without a, and |a| |1 + z b/a| with it; with a negative ratio the angles are the supplements.
        let [least, most] = if a * b < 0.0 { [PI - most, PI - least] } else { [least, most] };
        let above = if a == 0.0 {
            [b.abs() * low, b.abs() * high]
        } else {
            let ratio = (b / a).abs();
            distance_from_minus_one(
                [low, high].map(|size| if ratio == 0.0 { 0.0 } else { ratio * size }),
                [least, most],
            )
            .map(|distance| a.abs() * distance)
        };
        let bounds = [above[0] / farthest, above[1] / nearest].map(math::ln);
        [
            if bounds[0].is_nan() { f64::NEG_INFINITY } else { bounds[0] },
            if bounds[1].is_nan() { f64::INFINITY } else { bounds[1] },
        ]
    }

    /// Returns bounds of the closed loop from its linear part and the bound of the remainder.
    fn by_slope(&self, of: Closed) -> [f64; 2] {
        let l = self.response;
        let size = complex::norm(self.slope) + self.rest;
        let growth = math::exp_m1(size);
        // ln(a + b L) changes by ln(1 + t (exp(e) - 1)), t = b L/(a + b L), if ln L changes by e. Returns t and the bound of
        // the part that is not linear.
        let part = |a: f64, b: f64| {
            let t = l * b / (l * b + a);
            let u = complex::norm(t) * growth;
            let curved = complex::norm(t) * (growth - size) + 0.5 * u * u / (1.0 - u);
            (t, if u.is_nan() || u > 0.9 { f64::INFINITY } else { curved })
        };
        // ln L itself changes by e.
        let (above, of_above) = if of.a == 0.0 { (Complex::new(1.0, 0.0), 0.0) } else { part(of.a, of.b) };
        let (below, of_below) = part(1.0, 1.0);
        let slope = above - below;
        let change = (slope * self.slope).re.abs() + self.rest * complex::norm(slope) + of_above + of_below;
        if !change.is_finite() {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let here = math::ln(of.gain(l));
        [here - change, here + change]
    }
}
