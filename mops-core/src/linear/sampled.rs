//! Sampled systems: discrete equivalents of systems with clocks.
//!
//! A sampled system is represented by its bilinear image, the system in
//!
//! ```text
//! w = 2/T (z - 1)/(z + 1)
//! ```
//!
//! with the sampling period T. The image has the same stability, and at `j 2/T tan(omega T/2)` the response of the sampled
//! system at `omega`, so that the methods for continuous systems apply exactly, and only frequencies are converted.
//!
//! Source: K. J. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd edition (1997), sections 2.3 (sampling), 3.2 (stability).

use std::ops::Range;

use nalgebra::DMatrix;

use super::exponential::exponential_m1;
use super::{Complex, StateSpace};
use crate::math::{self, complex};

/// Clock: some states, its memory, change at its instants only.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// Indices of the states that are its memory.
    pub memory: Range<usize>,
    /// Time between two instants, s, above 0.
    pub period: f64,
    /// First instant, s.
    pub offset: f64,
    /// Time between an instant and the change of the memory, s, from 0 to the period.
    pub delay: f64,
}

/// Times that differ by less than this part of a period are one instant: above the rounding of multiples of a period.
const SAME_INSTANT: f64 = 1e-9;

/// Entries of a matrix that are smaller than this part of the sum of the magnitudes of their terms are rounding errors.
const ROUNDING: f64 = 1e-14;

/// Largest number of periods of the slowest clock after which all clocks must meet again.
const MOST_PERIODS: u32 = 100;

/// Prefix of the name of a value that a clock has computed and not applied yet.
pub const NEXT: &str = "next ";

/// Prefix of the name of memory at which a loop is cut: the value that its clock has computed.
pub const OWN: &str = "own ";

/// What happens at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Act {
    /// Values that a clock computed before reach its memory.
    Arrive(usize),
    /// A clock computes new values of its memory.
    Tick(usize),
}

/// Discrete equivalent between two instants, with the changes since the first one.
struct Equivalent<'a> {
    /// Continuous system; the rows of memory are its changes at an instant.
    system: &'a StateSpace,
    clocks: &'a [Clock],
    /// First of the values that a clock with a delay has computed and not applied yet.
    pending: Vec<usize>,
    /// Number of states and pending values; the inputs follow.
    order: usize,
}

impl StateSpace {
    /// Returns the discrete equivalent of a system with clocks, for inputs that are constant between its instants. The rows of
    /// memory in `A` and `B` are the changes at an instant of its clock.
    ///
    /// Without a cut, its instants are those of the slowest clock, or every few of them, so that all clocks repeat. Inputs change at an
    /// instant, and outputs are read after the clocks due at this instant have computed. For a cut loop, whose outputs
    /// depend on the memory of one clock only, the instants are those at which this memory changes: the outputs are read, and
    /// the inputs take their place.
    ///
    /// # Errors
    /// If the system has a delay of its own, if the equivalent is not time-invariant, or has a pole at z = -1.
    pub fn sampled(&self, clocks: &[Clock], is_cut: bool) -> Result<Self, String> {
        if self.delay != 0.0 {
            return Err("a system with clocks and a delay has no discrete equivalent".to_owned());
        }
        let mut order = self.order();
        let pending = clocks.iter().map(|clock| {
            let first = order;
            order += if clock.delay > 0.0 { clock.memory.len() } else { 0 };
            first
        });
        let pending = pending.collect();
        Equivalent { system: self, clocks, pending, order }.sampled(is_cut)
    }

    /// Returns the angular frequency, rad/s, of a point `j v` of the imaginary axis; of a continuous system, `v` itself.
    pub(super) fn frequency(&self, v: f64) -> f64 {
        self.period.map_or(v, |period| 2.0 / period * math::atan(0.5 * period * v))
    }

    /// Returns the point `j v` of the imaginary axis that belongs to an angular frequency, rad/s. The response of a sampled system
    /// repeats above half of the sampling frequency.
    pub(super) fn on_axis(&self, frequency: f64) -> f64 {
        on_axis(self.period, frequency)
    }

    /// Returns the z of a pole or zero of the bilinear image; infinite for a zero at `2/T`.
    pub fn z(root: Complex, period: f64) -> Complex {
        (root * (0.5 * period) + 1.0) / (-root * (0.5 * period) + 1.0)
    }

    /// Returns poles or zeros of `A`, 1/s; those of a sampled system as `ln(z)/T`, without the poles and zeros at z = 0 or infinity.
    pub fn in_seconds(&self, roots: Vec<Complex>) -> Vec<Complex> {
        let Some(period) = self.period else { return roots };
        let logarithm = |z: Complex| Complex::new(math::ln(complex::norm(z)), complex::arg(z)) / period;
        let finite = roots.into_iter().map(|root| logarithm(Self::z(root, period)));
        finite.filter(|s| s.is_finite()).collect()
    }

    /// Returns the matrices of `x[k+1] = A x[k] + B u[k]`, `y[k] = C x[k] + D u[k]` of a sampled system; `None` for a continuous
    /// one.
    pub fn difference_equation(&self) -> Option<Self> {
        let half = 0.5 * self.period?;
        let n = self.order();
        let one = DMatrix::<f64>::identity(n, n);
        let inverse = (&one - &self.a * half).try_inverse()?;
        let b = &inverse * &self.b * (2.0 * half);
        let c = sum_of_products(&DMatrix::zeros(self.outputs.len(), n), &self.c, &inverse);
        let d = sum_of_products(&self.d, &c, &(&self.b * half));
        let a = without_rounding((&one + &self.a * half) * inverse);
        Some(Self { a, b, c, d, period: None, ..self.clone() })
    }
}

/// Returns the point `j v` of the imaginary axis that belongs to an angular frequency, rad/s.
pub(super) fn on_axis(period: Option<f64>, frequency: f64) -> f64 {
    period.map_or(frequency, |period| 2.0 / period * math::tan(0.5 * period * frequency))
}

impl Equivalent<'_> {
    fn sampled(&self, is_cut: bool) -> Result<StateSpace, String> {
        let base = if is_cut { self.clock_of_cut()? } else { self.slowest() };
        let (period, first) = self.grid(&self.clocks[base], is_cut)?;
        let (n, m) = (self.order, self.system.inputs.len());
        let mut groups = self.groups(period, first);
        let mut change = DMatrix::zeros(n + m, n + m);
        let mut output = DMatrix::zeros(self.system.outputs.len(), n + m);
        output.columns_mut(0, self.system.order()).copy_from(&self.system.c);
        output.columns_mut(n, m).copy_from(&self.system.d);
        if groups.first().is_some_and(|(time, _)| *time == 0.0) {
            let (_, acts) = groups.remove(0);
            // The inputs of a cut loop change with the memory whose place they take: before the clocks compute if its values arrive.
            let arrives = self.clocks[base].delay > 0.0;
            let (before, after) = acts.into_iter().partition(|act| is_cut && !(arrives && matches!(act, Act::Tick(_))));
            groups.push((period, before));
            change = self.acts(&after);
            if !is_cut {
                output = &output + &output * &change;
            }
        }
        let mut time = 0.0;
        for (at, acts) in groups.iter().map(|(at, acts)| (*at, acts.as_slice())).chain([(period, &[][..])]) {
            if at > time {
                change = then(&change, &self.flow(at - time));
                time = at;
            }
            change = then(&change, &self.acts(acts));
        }
        let (difference, input) = (change.view((0, 0), (n, n)), change.view((0, n), (n, m)));
        let names = self.clocks.iter().filter(|clock| clock.delay > 0.0).flat_map(|clock| clock.memory.clone());
        let names = names.map(|state| format!("{NEXT}{}", self.system.states[state]));
        let system = StateSpace {
            b: input.into_owned(),
            c: output.columns(0, n).into_owned(),
            d: output.columns(n, m).into_owned(),
            states: self.system.states.iter().cloned().chain(names).collect(),
            period: Some(period),
            ..self.system.clone()
        };
        bilinear(&difference.into_owned(), system, period)
    }

    /// Returns the clock on whose memory the outputs of cut loops depend.
    fn clock_of_cut(&self) -> Result<usize, String> {
        let mut found: Option<usize> = None;
        let StateSpace { c, d, outputs, .. } = self.system;
        for (i, output) in outputs.iter().enumerate() {
            let name = output.trim_start_matches('-');
            let used = |state: usize| c[(i, state)] != 0.0;
            let clocks: Vec<usize> =
                (0..self.clocks.len()).filter(|&k| self.clocks[k].memory.clone().any(used)).collect();
            let memory = |state: usize| self.clocks.iter().any(|clock| clock.memory.contains(&state));
            let is_continuous = (0..self.system.order()).any(|state| used(state) && !memory(state));
            if is_continuous || d.row(i).iter().any(|direct| *direct != 0.0) {
                return Err(format!(
                    "`{name}` changes between the instants of the clocks, so that the loop cut there is not time-invariant; cut it at \
                     the memory of a clock"
                ));
            }
            let [clock] = clocks[..] else {
                match clocks.len() {
                    0 => continue,
                    _ => {
                        return Err(format!(
                            "`{name}` depends on several clocks; cut the loop at the memory of one clock"
                        ));
                    }
                }
            };
            let grid = |k: usize| (self.clocks[k].period, self.clocks[k].offset + self.clocks[k].delay);
            match found {
                Some(other) if grid(other) != grid(clock) => {
                    return Err(
                        "the loops are cut at clocks with different instants; cut one loop at a time".to_owned()
                    );
                }
                _ => found = Some(clock),
            }
        }
        Ok(found.unwrap_or_else(|| self.slowest()))
    }

    /// Returns the name of the first memory of a clock.
    fn name(&self, clock: &Clock) -> &str {
        self.system.states[clock.memory.start].trim_start_matches(OWN)
    }

    fn slowest(&self) -> usize {
        let period = |k: &usize| self.clocks[*k].period;
        (0..self.clocks.len()).rev().max_by(|a, b| period(a).total_cmp(&period(b))).expect("a system with clocks")
    }

    /// Returns the period of the equivalent and its first instant, s.
    fn grid(&self, base: &Clock, is_cut: bool) -> Result<(f64, f64), String> {
        let whole =
            |time: f64, period: f64| (time / period - (time / period).round()).abs() <= SAME_INSTANT * time / period;
        let repeats = |period: f64| self.clocks.iter().find(|clock| !whole(period, clock.period));
        if is_cut {
            let first = base.offset + base.delay;
            return match repeats(base.period) {
                None => Ok((base.period, first)),
                Some(other) => Err(format!(
                    "the loop cut at the clock of `{}` varies periodically, as its period is no multiple of that of the clock of \
                     `{}`; cut it at the memory of the slowest clock",
                    self.name(base),
                    self.name(other)
                )),
            };
        }
        let mut periods = (1..=MOST_PERIODS).map(|count| f64::from(count) * base.period);
        let found = periods.find(|period| repeats(*period).is_none());
        found.map(|period| (period, base.offset)).ok_or_else(|| {
            format!(
                "the clocks do not meet again within {MOST_PERIODS} periods of that of `{}`, the slowest one",
                self.name(base)
            )
        })
    }

    /// Returns what happens from the first instant on within a period, by time after this instant.
    fn groups(&self, period: f64, first: f64) -> Vec<(f64, Vec<Act>)> {
        let within = |time: f64| {
            let time = (time - first).rem_euclid(period);
            if time >= period * (1.0 - SAME_INSTANT) || time <= period * SAME_INSTANT { 0.0 } else { time }
        };
        let mut all = Vec::new();
        for (k, clock) in self.clocks.iter().enumerate() {
            for i in 0..(period / clock.period).round() as u32 {
                let tick = clock.offset + f64::from(i) * clock.period;
                all.push((within(tick), Act::Tick(k)));
                if clock.delay > 0.0 {
                    all.push((within(tick + clock.delay), Act::Arrive(k)));
                }
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut groups: Vec<(f64, Vec<Act>)> = Vec::new();
        for (time, act) in all {
            match groups.last_mut() {
                Some((last, acts)) if time - *last <= SAME_INSTANT * period => acts.push(act),
                _ => groups.push((time, vec![act])),
            }
        }
        groups.iter_mut().for_each(|(_, acts)| acts.sort());
        groups
    }

    /// Returns the change of states, pending values and inputs at an instant: first values arrive, then all clocks compute at once.
    fn acts(&self, acts: &[Act]) -> DMatrix<f64> {
        let size = self.order + self.system.inputs.len();
        let mut arrived = DMatrix::zeros(size, size);
        let mut computed = arrived.clone();
        for act in acts {
            match *act {
                Act::Arrive(k) => {
                    for (i, state) in self.clocks[k].memory.clone().enumerate() {
                        arrived[(state, self.pending[k] + i)] += 1.0;
                        arrived[(state, state)] -= 1.0;
                    }
                }
                Act::Tick(k) => {
                    for (i, state) in self.clocks[k].memory.clone().enumerate() {
                        let row = if self.clocks[k].delay > 0.0 { self.pending[k] + i } else { state };
                        self.write_rates(&mut computed, state, row);
                        if row != state {
                            // The change of the memory, hence its next value minus the pending one.
                            computed[(row, state)] += 1.0;
                            computed[(row, row)] -= 1.0;
                        }
                    }
                }
            }
        }
        then(&arrived, &computed)
    }

    /// Writes the row of a state of `A` and `B` to a row of a larger matrix.
    fn write_rates(&self, matrix: &mut DMatrix<f64>, state: usize, row: usize) {
        let (n, m) = (self.system.order(), self.system.inputs.len());
        matrix.view_mut((row, 0), (1, n)).copy_from(&self.system.a.row(state));
        matrix.view_mut((row, self.order), (1, m)).copy_from(&self.system.b.row(state));
    }

    /// Returns the change of states, pending values and inputs over a time without instants, s.
    fn flow(&self, time: f64) -> DMatrix<f64> {
        let size = self.order + self.system.inputs.len();
        let mut rates = DMatrix::zeros(size, size);
        let is_memory = |state: usize| self.clocks.iter().any(|clock| clock.memory.contains(&state));
        (0..self.system.order()).filter(|&state| !is_memory(state)).for_each(|s| self.write_rates(&mut rates, s, s));
        exponential_m1(&(rates * time))
    }
}

/// Returns `A + B C`, with 0 for entries that are rounding errors of their terms.
fn sum_of_products(a: &DMatrix<f64>, b: &DMatrix<f64>, c: &DMatrix<f64>) -> DMatrix<f64> {
    let (sum, terms) = (a + b * c, a.abs() + b.abs() * c.abs());
    sum.zip_map(&terms, |sum, terms| if sum.abs() <= ROUNDING * terms { 0.0 } else { sum })
}

/// Sets entries to 0 that are small beside others of their row and of their column.
fn without_rounding(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let rows: Vec<f64> = matrix.row_iter().map(|row| row.amax()).collect();
    let columns: Vec<f64> = matrix.column_iter().map(|column| column.amax()).collect();
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        let entry = matrix[(i, j)];
        if entry.abs() <= 10.0 * ROUNDING * rows[i].min(columns[j]) { 0.0 } else { entry }
    })
}

/// Returns the change of two changes in succession. Changes instead of transition matrices keep the distance of slow poles from 1.
fn then(first: &DMatrix<f64>, second: &DMatrix<f64>) -> DMatrix<f64> {
    first + second + second * first
}

/// Returns the bilinear image of a sampled system, with the given `A - 1` and the other matrices of its difference equation.
fn bilinear(difference: &DMatrix<f64>, of: StateSpace, period: f64) -> Result<StateSpace, String> {
    let n = difference.nrows();
    let sum = difference + DMatrix::identity(n, n) * 2.0;
    let inverse = sum.try_inverse().filter(|inverse| inverse.iter().all(|x| x.is_finite()));
    let inverse = inverse.ok_or("a pole of the sampled system lies at z = -1, at half of the sampling frequency")?;
    let rate = 2.0 / period;
    let b = &inverse * &of.b;
    Ok(StateSpace {
        a: &inverse * difference * rate,
        d: &of.d - &of.c * &b,
        c: &of.c * &inverse * 2.0,
        b: b * rate,
        ..of
    })
}

#[cfg(test)]
mod tests;
