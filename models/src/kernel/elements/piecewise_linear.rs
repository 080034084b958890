//! Piecewise linear function given by a table.

use mops_core::Failure;
use mops_language::Scalar;

/// Piecewise linear function through points `(x_k, y_k)`, extrapolated by the first and the last line segment.
///
/// Each segment is a mode. A model that is simulated with tangents changes segments by events, because a step across a
/// kink degrades tangents long before it degrades values. The model stores the index of the segment.
#[derive(Debug, Clone)]
pub struct PiecewiseLinear<S> {
    /// Segments: start abscissa, value there, and slope.
    lines: Vec<[S; 3]>,
}

impl<S: Scalar> PiecewiseLinear<S> {
    /// Creates the function through `points`; a single point gives a constant.
    ///
    /// # Errors
    /// No points, or abscissae that do not increase.
    pub fn new(points: &[[S; 2]]) -> Result<Self, Failure> {
        let Some(&[x, y]) = points.first() else {
            return Err(Failure::Undefined("a table needs at least one point".into()));
        };
        let mut lines = Vec::with_capacity(points.len());
        for pair in points.windows(2) {
            let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
            if x1.value() <= x0.value() {
                let fact = format!("the abscissae of a table must increase, found {} after {}", x1.value(), x0.value());
                return Err(Failure::Undefined(fact));
            }
            lines.push([x0, y0, (y1 - y0) / (x1 - x0)]);
        }
        if lines.is_empty() {
            lines.push([x, y, S::from(0.0)]);
        }
        Ok(Self { lines })
    }

    /// Returns the value at `x`.
    #[inline]
    pub fn at(&self, x: S) -> S {
        self.on(self.line_at(x), x)
    }

    /// Returns the index of the segment that contains `x`.
    pub fn line_at(&self, x: S) -> usize {
        self.lines[1..].iter().take_while(|line| line[0].value() <= x.value()).count()
    }

    /// Returns the value at `x` on the segment `line`, extrapolated beyond its ends.
    #[inline]
    pub fn on(&self, line: usize, x: S) -> S {
        let [start, value, slope] = self.lines[line];
        value + (x - start) * slope
    }

    /// Returns the guard: not negative while `x` is on the segment `line`.
    #[inline]
    pub fn guard(&self, line: usize, x: S) -> S {
        let over = |k: usize| {
            // Rounding at a kink must not cause chattering.
            let kink = self.lines[k][0];
            (x - kink, kink.value().abs() * 1e-10)
        };
        let above = (line > 0).then(|| over(line)).map(|(distance, slack)| distance + slack);
        let below = (line + 1 < self.lines.len()).then(|| over(line + 1)).map(|(distance, slack)| -distance + slack);
        match (above, below) {
            (Some(above), Some(below)) if above.value() < below.value() => above,
            (_, Some(below)) => below,
            (Some(above), None) => above,
            (None, None) => S::from(1.0),
        }
    }

    /// Returns the index of the next segment after the guard became negative.
    pub fn next(&self, line: usize, x: S) -> usize {
        let middle = if line + 1 < self.lines.len() {
            0.5 * (self.lines[line][0].value() + self.lines[line + 1][0].value())
        } else {
            f64::INFINITY
        };
        if line > 0 && x.value() < middle { line - 1 } else { (line + 1).min(self.lines.len() - 1) }
    }

    /// Returns true if the function is one straight line.
    pub fn is_straight(&self) -> bool {
        self.lines.len() == 1
    }

    /// Returns the first abscissa, at `from` or above, at which the function becomes negative; `None` if it never does.
    pub fn becomes_negative(&self, from: f64) -> Option<f64> {
        let line = |k: usize| self.lines[k].map(Scalar::value);
        if self.at(S::from(from)).value() < 0.0 {
            return Some(from);
        }
        (0..self.lines.len()).find_map(|k| {
            let end = if k + 1 < self.lines.len() { line(k + 1)[0] } else { f64::INFINITY };
            let [start, value, slope] = line(k);
            let zero = start - value / slope;
            (slope < 0.0 && zero >= from && zero < end).then_some(zero)
        })
    }
}
