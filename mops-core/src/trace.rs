//! Simulated signals over time: a polynomial per step of the integrator.
//!
//! Criteria read traces, not samples, so that a peak or a settling time does not depend on the step size.

use mops_language::Scalar;

/// A signal as a piecewise quartic over consecutive segments, with jumps allowed between them.
///
/// On segment `i`, from `knots[i]` to `knots[i + 1]`, let `t = knots[i] + s (knots[i + 1] - knots[i])` with `s` in [0,
/// 1]. The value at `t` is `c0 + c1 s + c2 s^2 + c3 s^3 + c4 s^4`: the degree of the dense output of a 5th-order
/// Runge-Kutta step. At a jump, including a jump at its end, the trace has the later value.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    knots: Vec<f64>,
    segments: Vec<[f64; 5]>,
    /// Value at the end, if it differs from the value of the last segment.
    jumped: Option<f64>,
    /// Value just before the start, if it differs from the value there.
    initial: Option<f64>,
    /// Derivatives of the knots, if the trace is the derivative of another one whose knots vary; otherwise empty.
    moves: Vec<f64>,
}

/// Course of a trace before its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Earlier {
    /// Constant, at the value just before the start.
    Constant,
    /// Extrapolated with the first and second derivatives at the start: that of a recording, of which it is not known.
    Extrapolated,
}

/// Weights of the values at [`Trace::NODES`] in their quartic at the first of [`Trace::CHECKS`]: Lagrange's basis.
/// Reversed, they apply at the same distance from the end.
const WEIGHTS: [f64; 5] = {
    let mut weights = [1.0; 5];
    let (mut i, mut k) = (0, 0);
    while i < 5 {
        if k != i {
            weights[i] *= (Trace::CHECKS[0] - Trace::NODES[k]) / (Trace::NODES[i] - Trace::NODES[k]);
        }
        (i, k) = if k == 4 { (i + 1, 0) } else { (i, k + 1) };
    }
    weights
};

/// A monotone part of a trace: times and values at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Time at the start and the end, s.
    pub time: [f64; 2],
    /// Value at the start and the end.
    pub value: [f64; 2],
    segment: usize,
    within: [f64; 2],
}

impl Trace {
    /// Positions `s` within a segment at which [`Trace::push`] expects samples.
    pub const NODES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

    /// Positions within a segment, near the extrema of the interpolation error, at which the quartic through values at
    /// [`Trace::NODES`] is compared with the signal. An irrational fraction avoids periods that coincide with the
    /// nodes.
    pub const CHECKS: [f64; 2] = [0.112_701_665_379_258_3, 1.0 - 0.112_701_665_379_258_3];

    /// Returns the largest deviation of the quartic through `values` at [`Trace::NODES`] from the values at
    /// [`Trace::CHECKS`]; NaN if a value is not finite.
    pub fn deviation(values: [f64; 5], checks: [f64; 2]) -> f64 {
        let quartic = |node: &dyn Fn(usize) -> usize| -> f64 {
            WEIGHTS.iter().enumerate().map(|(k, weight)| weight * values[node(k)]).sum()
        };
        let [a, b] = [quartic(&|k| k) - checks[0], quartic(&|k| 4 - k) - checks[1]].map(f64::abs);
        if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
    }

    /// Creates an empty trace that starts at `start`, with capacity for `segments`.
    pub fn starting_at(start: f64, segments: usize) -> Self {
        let mut knots = Vec::with_capacity(segments + 1);
        knots.push(start);
        Self { knots, segments: Vec::with_capacity(segments), ..Self::default() }
    }

    /// Appends the segment from the last knot to `end` that interpolates `samples` at [`Trace::NODES`].
    pub fn push(&mut self, end: f64, samples: [f64; 5]) {
        self.push_polynomial(end, Self::quartic(samples));
    }

    /// Returns the coefficients of `s^0 ... s^4` of the quartic through `samples` at [`Trace::NODES`].
    pub fn quartic<S: Scalar>(samples: [S; 5]) -> [S; 5] {
        let [a, b, c, d] = [1, 2, 3, 4].map(|i| samples[i] - samples[0]);
        // Newton's forward differences on the nodes k/4, expanded in powers of s.
        [
            samples[0],
            a * 16.0 - b * 12.0 + c * (16.0 / 3.0) - d,
            (b * 228.0 - a * 208.0 - c * 112.0 + d * 22.0) / 3.0,
            a * 96.0 - b * 128.0 + c * (224.0 / 3.0) - d * 16.0,
            (b * 192.0 - a * 128.0 - c * 128.0 + d * 32.0) / 3.0,
        ]
    }

    /// Appends the segment from the last knot to `end` with the given coefficients of `s^0 ... s^4`.
    pub fn push_polynomial(&mut self, end: f64, coefficients: [f64; 5]) {
        if self.knots.last().is_some_and(|&last| end > last) {
            self.knots.push(end);
            self.segments.push(coefficients);
        }
    }

    /// Sets the value after a jump at the end of the trace.
    pub fn jump_at_end(&mut self, value: f64) {
        self.jumped = Some(value);
    }

    /// Sets the derivatives of the knots of the trace that this one is the derivative of, for derivatives at given
    /// times of which the times increase. They vary linearly between these times, and vanish at both ends of the trace.
    ///
    /// At a jump or a corner whose time varies, the derivative at a fixed time is that of one side, and a criterion
    /// needs the other part: the derivative of the time. NaN means that several instants with different derivatives
    /// coincide.
    pub fn move_knots(&mut self, of_times: &[(f64, f64)]) {
        if of_times.iter().all(|&(_, moves)| moves == 0.0) {
            return;
        }
        let (start, end) = (self.start(), self.end());
        let mut ahead = of_times.iter().copied().filter(|&(t, _)| t > start && t < end).peekable();
        let mut last = (start, 0.0);
        let moves = self.knots.iter().map(|&knot| {
            while let Some(reached) = ahead.next_if(|&(t, _)| t <= knot) {
                last = reached;
            }
            let next = ahead.peek().copied().unwrap_or((end, 0.0));
            let share = if next.0 > last.0 { (knot - last.0) / (next.0 - last.0) } else { 0.0 };
            last.1 + share * (next.1 - last.1)
        });
        self.moves = moves.collect();
    }

    /// Returns the start time of the trace, s.
    pub fn start(&self) -> f64 {
        self.knots.first().copied().unwrap_or(0.0)
    }

    /// Returns the end time of the trace, s.
    pub fn end(&self) -> f64 {
        self.knots.last().copied().unwrap_or(0.0)
    }

    /// Returns the start and end times of the segments, s.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Returns the trace delayed by `time` (s, not negative), with the same end.
    #[must_use]
    pub fn delayed(&self, time: f64, earlier: Earlier) -> Self {
        let (start, end) = (self.start(), self.end());
        let mut late = Self::starting_at(start, self.segments.len() + 1);
        if earlier == Earlier::Constant {
            late.push_polynomial((start + time).min(end), [self.initial(), 0.0, 0.0, 0.0, 0.0]);
        } else if let (Some(c), Some(knot)) = (self.segments.first(), self.knots.get(1)) {
            let (h, length) = (knot - start, (start + time).min(end) - start);
            let (slope, bend) = (c[1] / h, c[2] / (h * h));
            let before = [c[0] - slope * time + bend * time * time, length * (slope - 2.0 * bend * time)];
            late.push_polynomial((start + time).min(end), [before[0], before[1], bend * length * length, 0.0, 0.0]);
        }
        for (segment, c) in self.segments.iter().enumerate() {
            let (from, to) = (self.knots[segment] + time, self.knots[segment + 1] + time);
            if from >= end {
                break;
            }
            let part = ((end - from) / (to - from)).min(1.0);
            let mut scale = 1.0;
            let cut = c.map(|c| {
                let scaled = c * scale;
                scale *= part;
                scaled
            });
            late.push_polynomial(to.min(end), cut);
        }
        late
    }

    /// Returns the derivative of [`Trace::delayed`], where `tangent` is the derivative of the trace and `late` that of
    /// `time`.
    #[must_use]
    pub fn delayed_along(&self, tangent: &Self, (time, late): (f64, f64), earlier: Earlier) -> Self {
        let mut along = tangent.delayed(time, earlier);
        for (d, rate) in along.segments.iter_mut().zip(self.delayed(time, earlier).derivative().segments) {
            d.iter_mut().zip(rate).for_each(|(d, rate)| *d -= late * rate);
        }
        let moves = |(i, knot): (usize, &f64)| (knot + time, tangent.moves.get(i).unwrap_or(&0.0) + late);
        along.move_knots(&tangent.knots.iter().enumerate().map(moves).collect::<Vec<_>>());
        along
    }

    /// Returns the part between two times, on a clock that starts at the first of them, or at the start of the trace if
    /// that is later.
    #[must_use]
    pub fn between(&self, from: f64, until: f64) -> Self {
        let (from, until) = (from.max(self.start()), until.min(self.end()));
        let mut part = Self::starting_at(0.0, self.segments.len());
        if !self.moves.is_empty() {
            part.moves.push(0.0);
        }
        for (segment, c) in self.segments.iter().enumerate() {
            let (t0, t1) = (self.knots[segment], self.knots[segment + 1]);
            if t1 <= from || t0 >= until {
                continue;
            }
            if from <= t0 && t1 <= until {
                part.push_polynomial(t1 - from, *c);
            } else {
                let [low, high] = [from.max(t0), until.min(t1)].map(|t| (t - t0) / (t1 - t0));
                part.push(until.min(t1) - from, Self::NODES.map(|s| polynomial(c, low + s * (high - low))));
            }
            if !self.moves.is_empty() && part.moves.len() < part.knots.len() {
                part.moves.push(if t1 < until { self.moves[segment + 1] } else { 0.0 });
            }
        }
        part.jumped = self.jumped.filter(|_| until >= self.end());
        part.set_initial(if from > self.start() { self.before(from) } else { self.initial() });
        part
    }

    /// Returns true if the trace has no segment.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// Returns the value at time `t`; outside the trace, the value at the nearer end.
    pub fn at(&self, t: f64) -> f64 {
        let segment = self.segment_at(t);
        self.value_on(segment, t)
    }

    /// Returns the value just before `t`.
    pub fn before(&self, t: f64) -> f64 {
        if t <= self.start() {
            return self.initial();
        }
        let segment = self.knots.partition_point(|&knot| knot < t).saturating_sub(1);
        let segment = segment.min(self.segments.len().saturating_sub(1));
        let Some(c) = self.segments.get(segment) else { return f64::NAN };
        let (t0, t1) = (self.knots[segment], self.knots[segment + 1]);
        polynomial(c, ((t - t0) / (t1 - t0)).clamp(0.0, 1.0))
    }

    /// Returns the values at increasing times, in one pass.
    pub fn sample(&self, times: &[f64]) -> Vec<f64> {
        let mut segment = 0;
        times
            .iter()
            .map(|&t| {
                while segment + 1 < self.segments.len() && self.knots[segment + 1] <= t {
                    segment += 1;
                }
                self.value_on(segment, t)
            })
            .collect()
    }

    /// Returns the value at the start.
    pub fn first(&self) -> f64 {
        self.segments.first().map_or(f64::NAN, |c| c[0])
    }

    /// Returns the value just before the start: that of a response to inputs that jump at the start, before they do.
    pub fn initial(&self) -> f64 {
        self.initial.unwrap_or_else(|| self.first())
    }

    /// Sets the value just before the start.
    pub fn set_initial(&mut self, value: f64) {
        self.initial = Some(value).filter(|value| *value != self.first());
    }

    /// Returns the value at the end.
    pub fn last(&self) -> f64 {
        self.jumped.unwrap_or_else(|| self.segments.last().map_or(f64::NAN, |c| c.iter().sum()))
    }

    /// Returns the value, first derivative (per s) and second derivative (per s^2) at the end of the last segment.
    pub fn motion_at_end(&self) -> [f64; 3] {
        let Some(c) = self.segments.last() else { return [f64::NAN; 3] };
        let h = self.knots[self.segments.len()] - self.knots[self.segments.len() - 1];
        let rate = c[1] + 2.0 * c[2] + 3.0 * c[3] + 4.0 * c[4];
        let curvature = 2.0 * c[2] + 6.0 * c[3] + 12.0 * c[4];
        [c.iter().sum(), rate / h, curvature / (h * h)]
    }

    /// Returns the monotone pieces, in order of time: every extremum and every jump lies at the ends of pieces.
    pub fn pieces(&self) -> Vec<Piece> {
        let mut pieces = Vec::with_capacity(self.segments.len());
        for segment in 0..self.segments.len() {
            self.pieces_of(segment, |piece| pieces.push(piece));
        }
        pieces
    }

    /// Returns the last monotone piece with a property.
    pub fn last_piece(&self, has: impl Fn(&Piece) -> bool) -> Option<Piece> {
        let mut last = None;
        for segment in (0..self.segments.len()).rev() {
            self.pieces_of(segment, |piece| {
                if has(&piece) {
                    last = Some(piece);
                }
            });
            if last.is_some() {
                break;
            }
        }
        last
    }

    /// Passes on the monotone pieces of a segment, in order of time.
    #[inline(always)]
    fn pieces_of(&self, segment: usize, mut add: impl FnMut(Piece)) {
        let c = &self.segments[segment];
        let (t0, t1) = (self.knots[segment], self.knots[segment + 1]);
        let h = t1 - t0;
        let mut add = |from: f64, to: f64| {
            add(Piece {
                time: [t0 + from * h, if to == 1.0 { t1 } else { t0 + to * h }],
                value: [polynomial(c, from), polynomial(c, to)],
                segment,
                within: [from, to],
            });
        };
        let mut from = 0.0;
        for extremum in cubic_roots([c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4]]) {
            if extremum > from {
                add(from, extremum);
                from = extremum;
            }
        }
        add(from, 1.0);
    }

    /// Returns the time within a monotone piece at which the trace crosses `level`; `None` if it does not.
    pub fn crossing(&self, piece: &Piece, level: f64) -> Option<f64> {
        let [low, high] = piece.value;
        if (low - level) * (high - level) > 0.0 || low == high {
            return None;
        }
        let c = &self.segments[piece.segment];
        let s = bisect(piece.within[0], piece.within[1], |s| polynomial(c, s) - level);
        let (t0, t1) = (self.knots[piece.segment], self.knots[piece.segment + 1]);
        Some(t0 + s * (t1 - t0))
    }

    /// Returns the largest value, and the first time at which it is reached.
    pub fn maximum(&self) -> (f64, f64) {
        self.extremum(|new, old| new > old)
    }

    /// Returns the smallest value, and the first time at which it is reached.
    pub fn minimum(&self) -> (f64, f64) {
        self.extremum(|new, old| new < old)
    }

    fn extremum(&self, better: impl Fn(f64, f64) -> bool) -> (f64, f64) {
        let mut best = (self.first(), self.start());
        for (segment, c) in self.segments.iter().enumerate() {
            // The value changes by at most the sum of the coefficients within a segment.
            let reach: f64 = c[1..].iter().map(|c| c.abs()).sum();
            if !better(c[0] + reach, best.0) && !better(c[0] - reach, best.0) {
                continue;
            }
            self.pieces_of(segment, |piece| {
                for (value, time) in piece.value.into_iter().zip(piece.time) {
                    if better(value, best.0) {
                        best = (value, time);
                    }
                }
            });
        }
        match self.jumped {
            Some(value) if better(value, best.0) => (value, self.end()),
            _ => best,
        }
    }

    /// Returns the first time at which the trace is at or beyond `level` in the direction `rising`.
    pub fn first_reaching(&self, level: f64, rising: bool) -> Option<f64> {
        let reached = |value: f64| if rising { value >= level } else { value <= level };
        for piece in self.pieces() {
            if reached(piece.value[0]) {
                return Some(piece.time[0]);
            }
            if reached(piece.value[1]) {
                return Some(self.crossing(&piece, level).unwrap_or(piece.time[1]));
            }
        }
        None
    }

    /// Returns the integral of `f(t, y)` over the trace, by five-point Gauss-Legendre quadrature on each segment. The
    /// quadrature is exact for `t^a y^b` with `a + 4 b <= 9`.
    pub fn integral(&self, f: impl Fn(f64, f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for (segment, c) in self.segments.iter().enumerate() {
            let (t0, h) = (self.knots[segment], self.knots[segment + 1] - self.knots[segment]);
            sum += gauss(0.0, 1.0, |s| f(t0 + s * h, polynomial(c, s))) * h;
        }
        sum
    }

    /// Returns true if the trace is finite throughout.
    pub fn is_finite(&self) -> bool {
        self.segments.iter().all(|c| c.iter().all(|c| c.is_finite())) && self.jumped.is_none_or(f64::is_finite)
    }

    /// Returns the integral of `f(t, |y - level|)` by the quadrature of [`Trace::integral`]. Segments are split at
    /// crossings of `level`, so that the kink of the absolute value costs no accuracy.
    pub fn integral_of_deviation(&self, level: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for piece in self.pieces() {
            let c = &self.segments[piece.segment];
            let (t0, h) = (self.knots[piece.segment], self.knots[piece.segment + 1] - self.knots[piece.segment]);
            let middle = self.crossing(&piece, level).map_or(piece.within[1], |t| ((t - t0) / h).clamp(0.0, 1.0));
            for (from, to) in [(piece.within[0], middle), (middle, piece.within[1])] {
                sum += gauss(from, to, |s| f(t0 + s * h, (polynomial(c, s) - level).abs())) * h;
            }
        }
        sum
    }

    /// Returns the derivative with respect to time, as a trace.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let segments = self
            .segments
            .iter()
            .zip(self.knots.windows(2))
            .map(|(c, knot)| {
                let h = knot[1] - knot[0];
                [c[1] / h, 2.0 * c[2] / h, 3.0 * c[3] / h, 4.0 * c[4] / h, 0.0]
            })
            .collect();
        Self { knots: self.knots.clone(), segments, ..Self::default() }
    }

    /// Returns `y + distance tangent`, for a tangent on the same segments. Knots that vary are moved along their
    /// derivatives, and with them jumps and corners: on a segment from `a` to `b`, whose derivatives are `a'` and `b'`,
    /// the value at the position `s` changes by the tangent and by `y' (a' + s (b' - a'))`.
    #[must_use]
    pub fn moved(&self, tangent: &Self, distance: f64) -> Self {
        debug_assert_eq!(self.knots, tangent.knots, "a tangent has the segments of its trace");
        let add = |c: &[f64; 5], d: &[f64; 5]| std::array::from_fn(|i| c[i] + distance * d[i]);
        let jumped = self.jumped.map(|value| value + distance * tangent.last());
        let initial = self.initial.map(|value| value + distance * tangent.initial());
        if tangent.moves.is_empty() {
            let segments = self.segments.iter().zip(&tangent.segments).map(|(c, d)| add(c, d)).collect();
            return Self { knots: self.knots.clone(), segments, jumped, initial, moves: Vec::new() };
        }
        let (start, end) = (self.start(), self.end());
        let mut moved = Self { jumped, initial, ..Self::starting_at(start, self.segments.len()) };
        for (segment, (c, d)) in self.segments.iter().zip(&tangent.segments).enumerate() {
            let (length, [from, to]) =
                (self.knots[segment + 1] - self.knots[segment], [tangent.moves[segment], tangent.moves[segment + 1]]);
            let rate = [0.0, c[1], 2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 0.0];
            let carried: [f64; 5] = std::array::from_fn(|i| (rate[i + 1] * from + rate[i] * (to - from)) / length);
            let knot = if segment + 1 == self.segments.len() { end } else { self.knots[segment + 1] + distance * to };
            moved.push_polynomial(knot.min(end), add(c, &std::array::from_fn(|i| d[i] + carried[i])));
        }
        moved
    }

    /// Returns the largest distance in either direction by which [`Trace::moved`] at most halves the length of each
    /// segment; infinity if no segment becomes shorter, NaN if the derivatives of the knots are not known.
    pub fn room(&self, tangent: &Self) -> f64 {
        if tangent.moves.iter().any(|moves| moves.is_nan()) {
            return f64::NAN;
        }
        let lengths = self.knots.windows(2).map(|knots| knots[1] - knots[0]);
        let changes = tangent.moves.windows(2).map(|moves| (moves[1] - moves[0]).abs());
        lengths.zip(changes).map(|(length, change)| 0.5 * length / change).fold(f64::INFINITY, f64::min)
    }

    /// Returns the largest jump between consecutive segments, in absolute value.
    pub fn largest_jump(&self) -> f64 {
        self.segments.windows(2).map(|s| (s[1][0] - s[0].iter().sum::<f64>()).abs()).fold(0.0, f64::max)
    }

    fn segment_at(&self, t: f64) -> usize {
        self.knots.partition_point(|&knot| knot <= t).saturating_sub(1).min(self.segments.len().saturating_sub(1))
    }

    fn value_on(&self, segment: usize, t: f64) -> f64 {
        let Some(c) = self.segments.get(segment) else { return f64::NAN };
        let (t0, t1) = (self.knots[segment], self.knots[segment + 1]);
        if let Some(value) = self.jumped.filter(|_| t >= self.end()) {
            return value;
        }
        polynomial(c, ((t - t0) / (t1 - t0)).clamp(0.0, 1.0))
    }
}

fn polynomial(c: &[f64; 5], s: f64) -> f64 {
    (((c[4] * s + c[3]) * s + c[2]) * s + c[1]) * s + c[0]
}

/// Returns the integral of `f` from `a` to `b` by the five-point Gauss-Legendre rule (degree 9).
/// Source: M. Abramowitz, I. Stegun, Handbook of Mathematical Functions (1964), table 25.4.
fn gauss(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    const NODES: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let mut sum = NODES[0].1 * f(middle);
    for (x, w) in &NODES[1..] {
        sum += w * (f(middle - half * x) + f(middle + half * x));
    }
    sum * half
}

/// Returns the roots of `c0 + c1 s + c2 s^2 + c3 s^3` strictly inside (0, 1), increasing.
///
/// A cubic is monotone between the roots of its derivative. Bisection there finds every sign change and needs no
/// special case for vanishing leading coefficients.
fn cubic_roots(c: [f64; 4]) -> impl Iterator<Item = f64> {
    let mut roots = [f64::NAN; 3];
    let inside = |roots: [f64; 3]| roots.into_iter().filter(|s| *s > 0.0 && *s < 1.0);
    // Most segments are so short relative to the curvature of the signal that their derivative keeps its sign: a
    // polynomial lies within the convex hull of its Bernstein coefficients.
    let bernstein = [c[0], c[0] + c[1] / 3.0, c[0] + (2.0 * c[1] + c[2]) / 3.0, c[0] + c[1] + c[2] + c[3]];
    if bernstein.iter().all(|b| *b > 0.0) || bernstein.iter().all(|b| *b < 0.0) {
        return inside(roots);
    }
    let f = |s: f64| ((c[3] * s + c[2]) * s + c[1]) * s + c[0];
    // Roots of c1 + 2 c2 s + 3 c3 s^2, in the form without cancellation.
    let (qa, qb, qc) = (3.0 * c[3], c[2], c[1]);
    let discriminant = qb * qb - qa * qc;
    let mut turning = [1.0, 1.0];
    if discriminant > 0.0 {
        let q = -(qb + discriminant.sqrt().copysign(qb));
        turning = [q / qa, qc / q].map(|s| if s > 0.0 && s < 1.0 { s } else { 1.0 });
        turning.sort_by(f64::total_cmp);
    }
    let ends = [0.0, turning[0], turning[1], 1.0];
    for i in 0..3 {
        let (from, to) = (ends[i], ends[i + 1]);
        if from < to && f(from) * f(to) < 0.0 {
            roots[i] = bisect(from, to, f);
        }
    }
    inside(roots)
}

/// Returns a zero of `f` between `a` and `b`, at which `f` has opposite signs or is zero. Uses the Illinois variant of
/// false position, to the last bits. Source: M. Dowell, P. Jarratt, BIT 11 (1971) 168-174.
fn bisect(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut fa, mut fb) = (f(a), f(b));
    if fa == 0.0 {
        return a;
    }
    if fb == 0.0 {
        return b;
    }
    for _ in 0..100 {
        let c = (a * fb - b * fa) / (fb - fa);
        let c = if c > a.min(b) && c < a.max(b) { c } else { 0.5 * (a + b) };
        let fc = f(c);
        if fc == 0.0 || (b - a).abs() <= 1e-15 {
            return c;
        }
        if fc * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            fa *= 0.5;
        }
        (b, fb) = (c, fc);
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    /// `sin t` over [0, 10] in 200 segments.
    fn sine() -> Trace {
        let mut trace = Trace::starting_at(0.0, 200);
        for i in 0..200 {
            let (from, h) = (f64::from(i) * 0.05, 0.05);
            trace.push(from + h, Trace::NODES.map(|s| math::sin(from + s * h)));
        }
        trace
    }

    #[test]
    fn a_quartic_is_reproduced_to_rounding() {
        let f = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t - 4.0 * math::powi(t, 3) + 5.0 * math::powi(t, 4);
        let mut trace = Trace::starting_at(0.0, 1);
        trace.push(2.0, Trace::NODES.map(|s| f(2.0 * s)));
        for i in 0..=20 {
            let t = 0.1 * f64::from(i);
            assert!((trace.at(t) - f(t)).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn a_delayed_trace_is_extrapolated_before_its_start() {
        let parabola = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t;
        let mut trace = Trace::starting_at(0.0, 2);
        trace.push_polynomial(0.4, [1.0, -0.8, 3.0 * 0.16, 0.0, 0.0]);
        trace.push_polynomial(1.0, [parabola(0.4), 0.4 * 0.6, 3.0 * 0.36, 0.0, 0.0]);
        for delay in [0.0, 0.3, 0.7, 5.0] {
            let late = trace.delayed(delay, Earlier::Extrapolated);
            assert_eq!((late.start(), late.end()), (0.0, 1.0));
            for t in [0.0, 0.1, 0.35, 0.72, 1.0] {
                assert!((late.at(t) - parabola(t - delay)).abs() < 1e-12 * (1.0 + delay * delay), "{delay} {t}");
            }
        }
    }

    #[test]
    fn extrema_and_crossings_are_those_of_the_curve_not_of_the_samples() {
        let trace = sine();
        let (peak, time) = trace.maximum();
        // The two maxima within [0, 10] are equal up to rounding.
        let phase = time % std::f64::consts::TAU;
        assert!((peak - 1.0).abs() < 1e-10 && (phase - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{peak} {time}");
        let time = trace.first_reaching(0.5, true).unwrap();
        assert!((time - std::f64::consts::FRAC_PI_6).abs() < 1e-9, "{time}");
        assert_eq!(trace.first_reaching(1.5, true), None);
    }

    #[test]
    fn integrals_agree_with_closed_forms() {
        let trace = sine();
        assert!((trace.integral(|_, y| y) - (1.0 - math::cos(10.0))).abs() < 1e-9);
        assert!((trace.integral(|_, y| y * y) - (5.0 - math::sin(20.0) / 4.0)).abs() < 1e-9);
        // |sin| over [0, 10]: three half waves of area 2 and the rest.
        let exact = 6.0 + (1.0 - math::cos(10.0 - 3.0 * std::f64::consts::PI));
        assert!((trace.integral_of_deviation(0.0, |_, e| e) - exact).abs() < 1e-9);
    }

    #[test]
    fn the_derivative_and_jumps_are_seen() {
        let trace = sine();
        assert!((trace.derivative().at(1.0) - math::cos(1.0)).abs() < 1e-5);
        let mut step = Trace::starting_at(0.0, 2);
        step.push(1.0, [0.0; 5]);
        step.push(2.0, [3.0; 5]);
        assert_eq!((step.largest_jump(), step.at(0.999), step.at(1.0), step.at(9.0)), (3.0, 0.0, 3.0, 3.0));
    }

    #[test]
    fn before_its_start_a_delayed_trace_is_constant_if_that_is_known() {
        let mut trace = sine();
        trace.set_initial(-2.0);
        let late = trace.delayed(1.5, Earlier::Constant);
        assert_eq!((late.at(0.0), late.at(1.4), late.initial()), (-2.0, -2.0, -2.0));
        assert!((late.at(2.5) - math::sin(1.0)).abs() < 1e-9);
    }

    /// Trace that rises with slope `a` until it reaches `b`, and is 0 from then on, until 5 s.
    fn sawtooth(a: f64, b: f64) -> Trace {
        let mut trace = Trace::starting_at(0.0, 3);
        trace.push_polynomial(b / a, [0.0, b, 0.0, 0.0, 0.0]);
        trace.push_polynomial(0.5 * (5.0 + b / a), [0.0; 5]);
        trace.push_polynomial(5.0, [0.0; 5]);
        trace
    }

    #[test]
    fn a_jump_moves_along_the_derivative_of_its_time() {
        let (a, b) = (0.7, 0.9);
        let trace = sawtooth(a, b);
        // Derivatives with respect to a: t before the jump, whose time is b/a; with respect to b: 0.
        let mut along_a = Trace::starting_at(0.0, 3);
        along_a.push_polynomial(trace.knots()[1], [0.0, b / a, 0.0, 0.0, 0.0]);
        along_a.push_polynomial(trace.knots()[2], [0.0; 5]);
        along_a.push_polynomial(5.0, [0.0; 5]);
        let mut along_b = trace.clone();
        along_b.segments.iter_mut().for_each(|c| *c = [0.0; 5]);
        along_a.move_knots(&[(b / a, -b / (a * a))]);
        along_b.move_knots(&[(b / a, 1.0 / a)]);
        let h = 1e-5;
        let slope = |along: &Trace, of: &dyn Fn(&Trace) -> f64| {
            (of(&trace.moved(along, h)) - of(&trace.moved(along, -h))) / (2.0 * h)
        };
        let (peak, area) = (|y: &Trace| y.maximum().0, |y: &Trace| y.integral(|_, y| y));
        let near = |found: f64, exact: f64| assert!((found - exact).abs() < 1e-8, "{found} {exact}");
        near(slope(&along_a, &peak), 0.0);
        near(slope(&along_b, &peak), 1.0);
        // The area is b^2/(2 a).
        near(slope(&along_a, &area), -b * b / (2.0 * a * a));
        near(slope(&along_b, &area), b / a);
        let window = |along: &Trace| slope(along, &|y| y.between(1.0, 4.0).integral(|_, y| y));
        assert_eq!(along_b.between(1.0, 4.0).knots().len(), trace.between(1.0, 4.0).knots().len());
        near(window(&along_b), b / a);
    }

    #[test]
    fn an_initial_value_differs_from_the_first_one() {
        let mut trace = sine();
        assert_eq!((trace.initial(), trace.before(0.0)), (0.0, 0.0));
        trace.set_initial(-2.0);
        assert_eq!((trace.initial(), trace.before(0.0), trace.first()), (-2.0, -2.0, 0.0));
        // Of a part, it is the value just before it.
        assert_eq!(trace.between(0.0, 1.0).initial(), -2.0);
        let mut step = Trace::starting_at(0.0, 2);
        step.push(1.0, [0.0; 5]);
        step.push(2.0, [3.0; 5]);
        assert_eq!((step.between(1.0, 2.0).first(), step.between(1.0, 2.0).initial()), (3.0, 0.0));
    }

    #[test]
    fn a_jump_at_the_end_has_the_later_value() {
        let ramp = |slope: f64, end: f64| {
            let mut trace = Trace::starting_at(0.0, 1);
            trace.push_polynomial(2.0, [1.0, 2.0 * slope, 0.0, 0.0, 0.0]);
            trace.jump_at_end(end);
            trace
        };
        let (trace, tangent) = (ramp(1.0, 7.0), ramp(0.5, -3.0));
        assert_eq!((trace.at(2.0), trace.last(), trace.at(3.0)), (7.0, 7.0, 7.0));
        assert_eq!(trace.sample(&[1.0, 2.0]), [2.0, 7.0]);
        assert_eq!((trace.maximum(), trace.minimum()), ((7.0, 2.0), (1.0, 0.0)));
        assert_eq!(trace.at(1.999_999), 2.999_999);
        assert_eq!(trace.moved(&tangent, 0.1).last(), 6.7);
    }

    #[test]
    fn roots_of_cubics_inside_the_unit_interval_are_found_in_order() {
        // (s - 0.2)(s - 0.5)(s - 0.9)
        let roots: Vec<f64> = cubic_roots([-0.09, 0.73, -1.6, 1.0]).collect();
        assert_eq!(roots.len(), 3);
        for (root, exact) in roots.iter().zip([0.2, 0.5, 0.9]) {
            assert!((root - exact).abs() < 1e-12, "{roots:?}");
        }
        assert_eq!(cubic_roots([1.0, 0.0, 0.0, 0.0]).count(), 0);
    }
}
