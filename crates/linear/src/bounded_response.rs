//! Bounds of a frequency response over ranges of frequencies; unlike a grid, they miss no peak or crossing.

use mops_math as math;
use mops_math::complex;
use nalgebra::DMatrix;

use super::eigen::eigenvalues_as_given;
use super::extended::{Entry, Extended, Real, extended, solved};
use super::zeros::zeros_as_given;
use super::{Complex, StateSpace, eigenvalues, zeros};

/// Gain below which a response counts as zero: -200 dB.
const FAINT: f64 = 1e-10;

/// Number of decades above the highest and below the lowest corner frequency that are always searched.
const BEYOND: i32 = 4;

/// Largest relative error of the pole-zero form, beside the response that the matrices give: above the error of a pole
/// that is 0 up to the rounding of the matrices. Wrong poles or zeros cause errors of the magnitude of the response.
const INACCURATE: f64 = 1e-6;

/// Part of the sum of the magnitudes of the terms of a response that the rounding of the given matrices may cause.
const NOISE: f64 = 1e-11;

/// Number of points at which the pole-zero form is compared with the matrices.
const POINTS: u32 = 5;

/// Rounding error of bounds, rad or relative gain: far above that of a sum over some hundred poles and zeros.
const ROUNDING: f64 = 1e-12;

/// Single-input, single-output response `L(j w)` by its poles and zeros, which also bound its change between
/// frequencies.
#[derive(Debug, Clone)]
pub(super) struct BoundedResponse {
    /// Zeros with weight 1, poles with weight -1.
    roots: Vec<(Complex, f64)>,
    /// Numerators and poles of the factors.
    factors: Vec<(Numerator, Complex)>,
    gain: f64,
    delay: f64,
    /// Lowest and highest corner frequency, rad/s.
    corners: [f64; 2],
}

/// Numerator of a factor of the response: `s - zero`, or a constant frequency.
#[derive(Debug, Clone, Copy)]
enum Numerator {
    Zero(Complex),
    Constant(f64),
}

impl BoundedResponse {
    /// Computes the bounded response of a system with one input and one output.
    ///
    /// Poles and zeros are those of the given matrices to all digits, so that their products are accurate where the
    /// sums in `C (s - A)^-1 B` cancel.
    ///
    /// # Errors
    /// If an entry is not finite, or if poles and zeros do not reproduce the response.
    pub fn new(system: &StateSpace) -> Result<Self, String> {
        // Sums that the rounding of the matrices explains count as zero, and so do poles. In coordinates of a large
        // condition this may be found of one of two poles at 0 only, which the response shows: then the numbers count
        // as they stand.
        Self::by_roots(system, zeros(system)?, eigenvalues(&system.a)?)
            .or_else(|_| Self::by_roots(system, zeros_as_given(system)?, eigenvalues_as_given(&system.a)?))
    }

    /// Computes the bounded response from zeros and poles.
    fn by_roots(system: &StateSpace, zeros: Vec<Complex>, poles: Vec<Complex>) -> Result<Self, String> {
        let delay = system.delay;
        let sizes =
            zeros.iter().chain(&poles).map(|root| complex::norm(*root)).chain((delay > 0.0).then(|| 1.0 / delay));
        let sizes: Vec<f64> = sizes.filter(|size| *size > 0.0 && size.is_finite()).collect();
        let (low, high) =
            (sizes.iter().copied().fold(f64::INFINITY, f64::min), sizes.iter().copied().fold(0.0, f64::max));
        let corners = if sizes.is_empty() { [1.0, 1.0] } else { [low, high] };
        let middle = corners[0].sqrt() * corners[1].sqrt();
        let numerators =
            zeros.iter().map(|zero| Numerator::Zero(*zero)).chain(std::iter::repeat(Numerator::Constant(middle)));
        let factors = numerators.zip(poles.iter().copied()).collect();
        let roots =
            zeros.into_iter().map(|zero| (zero, 1.0)).chain(poles.into_iter().map(|pole| (pole, -1.0))).collect();
        let mut found = Self { roots, factors, gain: 1.0, delay, corners };
        found.gain = found.gain_of(system)?;
        Ok(found)
    }

    /// Returns the response at an angular frequency, rad/s.
    pub fn at(&self, omega: f64) -> Complex {
        let s = Complex::new(0.0, omega);
        let rational = self.factored(s) * self.gain;
        if self.delay == 0.0 { rational } else { rational * complex::exp(-s * self.delay) }
    }

    /// Returns the product of the factors.
    fn factored(&self, s: Complex) -> Complex {
        let factor = |(numerator, pole): &(Numerator, Complex)| match numerator {
            Numerator::Zero(zero) => (s - zero) / (s - pole),
            Numerator::Constant(omega) => Complex::new(*omega, 0.0) / (s - pole),
        };
        self.factors.iter().map(factor).product()
    }

    /// Returns the number of poles and zeros.
    pub fn order(&self) -> usize {
        self.roots.len()
    }

    /// Returns the lowest and highest corner frequency, rad/s.
    pub fn corners(&self) -> [f64; 2] {
        self.corners
    }

    /// Returns the largest distance of a response from its bounds, rad or relative gain, due to rounding.
    pub fn inaccuracy(&self) -> f64 {
        ROUNDING
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

    /// Returns the factor between the response that the matrices of the system give and the product of the factors.
    ///
    /// # Errors
    /// If it is not the same at all points.
    fn gain_of(&self, system: &StateSpace) -> Result<f64, String> {
        let [low, high] = self.corners;
        // Points of the positive real axis: on the imaginary axis a pole and its mirror image have the same distance.
        // They begin below the lowest corner and end above the highest, off both: a sampled loop may have its only zero
        // there.
        let [first, last] = [0.37 * low, 2.9 * high];
        let point = |i: u32| first * math::powf(last / first, f64::from(i) / f64::from(POINTS - 1));
        let values: Vec<(Extended, Extended, f64)> = (0..POINTS)
            .filter_map(|i| {
                by_matrices(system, point(i)).map(|(value, terms)| (value, self.factored_at(point(i)), terms))
            })
            .collect();
        // Where the fewest terms cancel.
        let clear = |(value, _, terms): &&(Extended, Extended, f64)| value.size() / terms;
        let Some((value, factored, _)) = values.iter().max_by(|a, b| clear(a).total_cmp(&clear(b))) else {
            return Ok(0.0);
        };
        if *value == Extended::ZERO {
            return Ok(0.0);
        }
        let gain = *value / *factored;
        let agrees = |(value, factored, terms): &(Extended, Extended, f64)| {
            (*value - *factored * gain).size() <= INACCURATE * value.size() + NOISE * terms
        };
        if values.iter().all(agrees) {
            Ok(gain.value())
        } else {
            Err("the poles and zeros of the system are too inaccurate to bound its response".to_owned())
        }
    }

    /// Returns the product of the factors at a real point.
    fn factored_at(&self, s: f64) -> Extended {
        // Complex roots come in conjugate pairs, of which the upper one stands for both.
        let distance = |root: Complex| {
            let along = Extended::from(s) - Extended::from(root.re);
            match root.im {
                im if im < 0.0 => Extended::from(1.0),
                0.0 => along,
                im => along * along + Extended::from(im) * Extended::from(im),
            }
        };
        self.factors.iter().fold(Extended::from(1.0), |value, (numerator, pole)| {
            let above = match numerator {
                Numerator::Zero(zero) => distance(*zero),
                Numerator::Constant(omega) => Extended::from(*omega),
            };
            value * above / distance(*pole)
        })
    }
}

/// Returns `C (s - A)^-1 B + D` of a system with one input and one output at a real point, with twice the digits, and
/// the sum of the magnitudes of its terms; `None` at a pole.
fn by_matrices(system: &StateSpace, s: f64) -> Option<(Extended, f64)> {
    let n = system.order();
    let entry = |i: usize, j: usize| Extended::from(if i == j { s } else { 0.0 }) - Extended::from(system.a[(i, j)]);
    let states = solved(DMatrix::from_fn(n, n, entry), extended(&system.b))?;
    let direct = Extended::from(system.d[(0, 0)]);
    let each = (0..n).map(|i| Extended::from(system.c[(0, i)]) * states[(i, 0)]);
    Some(each.fold((direct, direct.size()), |(value, terms), term| (value + term, terms + term.size())))
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

/// Returns the bounds of `|1 + z|` over `z` of these sizes, whose angles from the negative real axis have these
/// magnitudes, rad.
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
        // |a + b z| = |b| |z| without a, and |a| |1 + z b/a| with it; with a negative ratio the angles are the
        // supplements.
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
        // ln(a + b L) changes by ln(1 + t (exp(e) - 1)), t = b L/(a + b L), if ln L changes by e. Returns t and the
        // bound of the part that is not linear.
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
