//! Linear systems with internal delays, as systems with one delay.

use nalgebra::DMatrix;

use super::StateSpace;

/// Difference, relative to the sum of all delays, up to which two sums of delays are equal: above the rounding of a few
/// additions.
const EQUAL: f64 = 1e-12;

/// An entry of a matrix that is not 0, as an edge from a variable to one that depends on it, with the delay in between.
struct Edge {
    from: usize,
    to: usize,
    delay: f64,
}

/// Dependences between the variables of a system: states, inputs, outputs and delayed quantities, in this order.
struct Graph {
    edges: Vec<Edge>,
    inputs: std::ops::Range<usize>,
    outputs: std::ops::Range<usize>,
    /// First of the delayed quantities, each of which is followed by its delayed value.
    delayed: usize,
    size: usize,
}

impl StateSpace {
    /// Returns the system whose last inputs are its last outputs, `delays` later (s), as a system with one delay.
    ///
    /// The conversion is exact if every path from an input to an output has the same delay: each variable is then
    /// counted in a time of its own, which is shifted by the delay of the path that leads to it.
    ///
    /// # Errors
    /// If a delay lies in a feedback loop, so that the number of poles is infinite, or if paths from the inputs to the
    /// outputs have different delays.
    ///
    /// # Panics
    /// If the system has fewer inputs or outputs than delays.
    pub fn with_delays(&self, delays: &[f64]) -> Result<Self, String> {
        let (m, p) = (self.inputs.len() - delays.len(), self.outputs.len() - delays.len());
        let delay = Graph::of(self, delays).delay()?;
        let outer = Self {
            b: self.b.columns(0, m).into_owned(),
            c: self.c.rows(0, p).into_owned(),
            d: self.d.view((0, 0), (p, m)).into_owned(),
            inputs: self.inputs[..m].to_vec(),
            outputs: self.outputs[..p].to_vec(),
            delay: self.delay + delay,
            ..self.clone()
        };
        let k = delays.len();
        let (b, c) = (self.b.columns(m, k), self.c.rows(p, k));
        let (into, out) = (self.d.view((p, 0), (k, m)), self.d.view((0, m), (p, k)));
        let within = DMatrix::identity(k, k) - self.d.view((p, m), (k, k));
        let closed = within.try_inverse().ok_or_else(in_loop)?;
        Ok(Self {
            a: &outer.a + b * &closed * c,
            b: &outer.b + b * &closed * into,
            c: &outer.c + out * &closed * c,
            d: &outer.d + out * &closed * into,
            ..outer
        })
    }
}

fn in_loop() -> String {
    "a delay lies in a feedback loop, so that the number of poles is infinite; the loop can be cut with `open`"
        .to_owned()
}

impl Graph {
    fn of(system: &StateSpace, delays: &[f64]) -> Self {
        let (n, k) = (system.order(), delays.len());
        let (m, p) = (system.inputs.len() - k, system.outputs.len() - k);
        let delayed = n + m + p;
        let input = |j: usize| if j < m { n + j } else { delayed + 2 * (j - m) + 1 };
        let output = |i: usize| if i < p { n + m + i } else { delayed + 2 * (i - p) };
        let mut edges = Vec::new();
        let mut add = |matrix: &DMatrix<f64>, from: &dyn Fn(usize) -> usize, to: &dyn Fn(usize) -> usize| {
            for (i, row) in matrix.row_iter().enumerate() {
                let entries = row.iter().enumerate().filter(|(_, entry)| **entry != 0.0);
                edges.extend(entries.map(|(j, _)| Edge { from: from(j), to: to(i), delay: 0.0 }));
            }
        };
        let state = |i: usize| i;
        add(&system.a, &state, &state);
        add(&system.b, &input, &state);
        add(&system.c, &state, &output);
        add(&system.d, &input, &output);
        edges.extend(delays.iter().enumerate().map(|(i, &delay)| Edge {
            from: delayed + 2 * i,
            to: delayed + 2 * i + 1,
            delay,
        }));
        Self { edges, inputs: n..n + m, outputs: n + m..delayed, delayed, size: delayed + 2 * k }
    }

    /// Returns for each variable whether a path leads to it from one of `starts`, or from it to one of them if
    /// `backward`.
    fn reached(&self, starts: impl IntoIterator<Item = usize>, backward: bool) -> Vec<bool> {
        let mut reached = vec![false; self.size];
        let mut open: Vec<usize> = starts.into_iter().collect();
        while let Some(here) = open.pop() {
            if std::mem::replace(&mut reached[here], true) {
                continue;
            }
            open.extend(self.edges.iter().filter_map(|edge| match backward {
                false => (edge.from == here).then_some(edge.to),
                true => (edge.to == here).then_some(edge.from),
            }));
        }
        reached
    }

    /// Returns the delay of all paths from the inputs to the outputs.
    fn delay(&self) -> Result<f64, String> {
        if (self.delayed..self.size).step_by(2).any(|quantity| self.reached([quantity + 1], false)[quantity]) {
            return Err(in_loop());
        }
        let (from, to) = (self.reached(self.inputs.clone(), false), self.reached(self.outputs.clone(), true));
        let counts = |i: usize| from[i] && to[i];
        // Times of the variables, from the first input on; all inputs have one time, and all outputs.
        let Some(first) = self.inputs.clone().find(|&i| counts(i)) else { return Ok(0.0) };
        let chain = |all: &std::ops::Range<usize>| {
            let of: Vec<usize> = all.clone().filter(|&i| counts(i)).collect();
            of.windows(2).map(|pair| Edge { from: pair[0], to: pair[1], delay: 0.0 }).collect::<Vec<_>>()
        };
        let ties = [chain(&self.inputs), chain(&self.outputs)];
        let edges = self.edges.iter().chain(ties.iter().flatten());
        let edges: Vec<&Edge> = edges.filter(|edge| counts(edge.from) && counts(edge.to)).collect();
        let close = EQUAL * self.edges.iter().map(|edge| edge.delay).sum::<f64>();
        let mut times: Vec<Option<f64>> = vec![None; self.size];
        times[first] = Some(0.0);
        let mut open = vec![first];
        while let Some(here) = open.pop() {
            let time = times[here].unwrap_or_default();
            for edge in &edges {
                let (next, after) = match here {
                    _ if edge.from == here => (edge.to, time + edge.delay),
                    _ if edge.to == here => (edge.from, time - edge.delay),
                    _ => continue,
                };
                match times[next] {
                    None => {
                        times[next] = Some(after);
                        open.push(next);
                    }
                    Some(known) if (known - after).abs() <= close => {}
                    Some(_) => {
                        return Err("paths from its inputs to its outputs have different delays; \
                                    choose one input and one output, or cut a loop with `open`"
                            .to_owned());
                    }
                }
            }
        }
        Ok(self.outputs.clone().find_map(|output| times[output]).unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;
    use crate::testing::c;
    use mops_math::complex;

    /// A chain `x1' = -x1 + u`, `x2' = -2 x2 + w1`, `y = w2` with `w1 = x1(t - T1)`, `w2 = x2(t - T2)`; `direct` adds
    /// `u` to `y`.
    fn chain(direct: f64, back: f64) -> StateSpace {
        let a = DMatrix::from_row_slice(2, 2, &[-1.0, back, 0.0, -2.0]);
        let b = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let c = DMatrix::from_row_slice(3, 2, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        let d = DMatrix::from_row_slice(3, 3, &[direct, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        StateSpace::new(a, b, c, d)
    }

    #[test]
    fn delays_in_series_add_up() {
        let system = chain(0.0, 0.0).with_delays(&[0.3, 0.4]).unwrap();
        assert_eq!((system.delay, system.inputs.len(), system.outputs.len()), (0.7, 1, 1));
        let exact = TransferFunction { delay: 0.7, ..TransferFunction::new(vec![1.0], vec![1.0, 3.0, 2.0]) };
        for w in [0.0, 0.5, 3.0, 40.0] {
            let [found, exact] = [&system, &exact.state_space().unwrap()].map(|s| s.response().unwrap().scalar(w));
            assert!(complex::norm(found - exact) <= 1e-14, "{w}: {found} {exact}");
        }
        let mut poles = system.poles().unwrap();
        poles.sort_by(|a, b| a.re.total_cmp(&b.re));
        assert_eq!(poles, [c(-2.0, 0.0), c(-1.0, 0.0)]);
    }

    #[test]
    fn paths_of_equal_sums_of_delays_have_one_delay() {
        // u through 0.1 and 0.2 s, and through 0.3 s: 0.1 + 0.2 differs from 0.3 by rounding.
        let none = DMatrix::zeros(0, 0);
        let d = DMatrix::from_row_slice(
            4,
            4,
            &[0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        );
        let system = StateSpace::new(none.clone(), DMatrix::zeros(0, 4), DMatrix::zeros(4, 0), d);
        let found = system.with_delays(&[0.1, 0.2, 0.3]).unwrap();
        assert!((found.delay - 0.3).abs() < 1e-15 && found.d[(0, 0)] == 2.0);
    }

    #[test]
    fn a_delay_in_a_loop_and_parallel_paths_of_different_delays_are_errors() {
        assert!(chain(0.0, 0.5).with_delays(&[0.3, 0.4]).unwrap_err().contains("in a feedback loop"));
        assert!(chain(1.0, 0.0).with_delays(&[0.3, 0.4]).unwrap_err().contains("different delays"));
        // A quantity that depends on its own past directly.
        let mut echo = chain(0.0, 0.0);
        echo.d[(2, 2)] = 0.5;
        assert!(echo.with_delays(&[0.3, 0.4]).unwrap_err().contains("in a feedback loop"));
        // What reaches no output does not count.
        let mut blind = chain(1.0, 0.0);
        blind.d[(0, 2)] = 0.0;
        assert_eq!(blind.with_delays(&[0.3, 0.4]).unwrap().delay, 0.0);
    }
}
