//! A function given by a table.

use mops_core::{Failure, Scalar};

/// Straight lines through points `(x_k, y_k)`; outside the table the first and the last line go on.
///
/// Its modes are its lines: a model that simulates with tangents changes from one to the next by an event, because a step
/// across a kink spoils tangents long before it spoils values. The model keeps the number of the line.
#[derive(Debug, Clone)]
pub struct PiecewiseLinear<S> {
    /// Where a line begins, its value there, and its slope.
    lines: Vec<[S; 3]>,
}

impl<S: Scalar> PiecewiseLinear<S> {
    /// The function through `points`; one point alone makes it constant.
    ///
    /// # Errors
    /// No points, or abscissae that do not increase.
    pub fn new(points: &[[S; 2]]) -> Result<Self, Failure> {
        let Some(&[x, y]) = points.first() else {
            return Err(Failure::Undefined("a table needs a point".into()));
        };
        let mut lines = Vec::with_capacity(points.len());
        for pair in points.windows(2) {
            let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
            if x1.value() <= x0.value() {
                let fact = format!("a table runs from left to right, but {} follows {}", x1.value(), x0.value());
                return Err(Failure::Undefined(fact));
            }
            lines.push([x0, y0, (y1 - y0) / (x1 - x0)]);
        }
        if lines.is_empty() {
            lines.push([x, y, S::from(0.0)]);
        }
        Ok(Self { lines })
    }

    /// The value at `x`.
    #[inline]
    pub fn at(&self, x: S) -> S {
        self.on(self.line_at(x), x)
    }

    /// The number of the line over `x`.
    pub fn line_at(&self, x: S) -> usize {
        self.lines[1..].iter().take_while(|line| line[0].value() <= x.value()).count()
    }

    /// The value at `x` on the line of that number, wherever it ends.
    #[inline]
    pub fn on(&self, line: usize, x: S) -> S {
        let [start, value, slope] = self.lines[line];
        value + (x - start) * slope
    }

    /// Not negative while `x` is over the line of that number.
    #[inline]
    pub fn guard(&self, line: usize, x: S) -> S {
        let over = |k: usize| {
            // Rounding at a kink must not lead to and fro.
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

    /// The number of the line that follows when the guard became negative.
    pub fn next(&self, line: usize, x: S) -> usize {
        let middle = if line + 1 < self.lines.len() {
            0.5 * (self.lines[line][0].value() + self.lines[line + 1][0].value())
        } else {
            f64::INFINITY
        };
        if line > 0 && x.value() < middle { line - 1 } else { (line + 1).min(self.lines.len() - 1) }
    }

    /// Whether it is one straight line.
    pub fn is_straight(&self) -> bool {
        self.lines.len() == 1
    }

    /// The first abscissa from `from` on at which it becomes negative; `None` if it never does.
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
