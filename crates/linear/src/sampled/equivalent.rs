//! Discrete equivalent of a system with clocks and delays: what happens within a period, as matrices.

use nalgebra::{DMatrix, RowDVector};

use super::{Clock, NEXT, OWN};
use crate::StateSpace;
use crate::exponential::exponential_m1;

/// Times that differ by less than this part of a period are one instant: above the rounding of multiples of a period.
const SAME_INSTANT: f64 = 1e-9;

/// Largest number of periods of the slowest clock after which all clocks must meet again.
const MOST_PERIODS: u32 = 100;

/// Largest number of values that wait in the queue of a delay.
const MOST_WAITING: u32 = 200;

/// What happens at an instant, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Act {
    /// Values that a clock has computed before reach its memory.
    Arrive(usize),
    /// A delayed value takes effect.
    Deliver(usize),
    /// A clock computes new values of its memory.
    Tick(usize),
    /// The value of a quantity enters the queue of its delay.
    Push(usize),
}

/// Queue of the values of a delayed quantity.
struct Line {
    /// Index of the delayed value; the values that wait follow, the newest first.
    value: usize,
    /// Number of values that wait at the first instant, and largest number.
    waiting: usize,
    most: usize,
}

/// Changes of states, pending values, delayed values and inputs within a period.
pub(super) struct Equivalent<'a> {
    /// Continuous system; the rows of memory are its changes at an instant.
    system: &'a StateSpace,
    clocks: &'a [Clock],
    /// First of the values that a clock with a delay has computed and not applied yet.
    pending: Vec<usize>,
    lines: Vec<Line>,
    /// Number of delayed quantities.
    delayed: usize,
    /// Number of states, pending values and values of queues; the inputs follow.
    order: usize,
    /// Period, s.
    period: f64,
}

impl<'a> Equivalent<'a> {
    /// Creates the equivalent of a system, with its number of delayed quantities.
    pub(super) fn new(system: &'a StateSpace, clocks: &'a [Clock], delayed: usize) -> Self {
        let mut order = system.order();
        let pending = clocks.iter().map(|clock| {
            let first = order;
            order += if clock.delay > 0.0 { clock.memory.len() } else { 0 };
            first
        });
        let pending = pending.collect();
        Self { system, clocks, pending, lines: Vec::new(), delayed, order, period: 0.0 }
    }

    /// Returns the matrix `A - 1`, and the system with the other matrices of the difference equation.
    pub(super) fn of(mut self, delays: &[f64], is_cut: bool) -> Result<(DMatrix<f64>, StateSpace), String> {
        let base = if is_cut { self.clock_of_cut()? } else { self.slowest() };
        let (period, first) = self.grid(&self.clocks[base], is_cut)?;
        self.period = period;
        let mut groups = self.groups(first, delays, is_cut)?;
        let (n, m) = (self.order, self.inputs());
        // Changes since the first instant. Unlike transition matrices they keep the distance of slow poles from 1.
        let mut change = DMatrix::zeros(n + m, n + m);
        let mut output = self.outputs();
        let mut waiting: Vec<usize> = self.lines.iter().map(|line| line.waiting).collect();
        if groups.first().is_some_and(|(time, _)| *time == 0.0) {
            let (_, acts) = groups.remove(0);
            // The inputs of a cut loop change with the memory whose place they take: before the clocks compute if its
            // values arrive.
            let arrives = self.clocks[base].delay > 0.0;
            let is_before = |act: &Act| match act {
                Act::Arrive(_) | Act::Deliver(_) => is_cut,
                Act::Tick(_) => is_cut && !arrives,
                Act::Push(_) => false,
            };
            let (before, after) = acts.into_iter().partition(is_before);
            groups.push((period, before));
            self.act(&mut change, &after, &mut waiting);
            if !is_cut {
                output = &output + &output * &change;
            }
        }
        let mut time = 0.0;
        for (at, acts) in groups.iter().map(|(at, acts)| (*at, acts.as_slice())).chain([(period, &[][..])]) {
            if at > time {
                self.flow(&mut change, at - time);
                time = at;
            }
            self.act(&mut change, acts, &mut waiting);
        }
        let named = |names: &[String], count: usize| names[..count].to_vec();
        let system = StateSpace {
            a: DMatrix::zeros(0, 0),
            b: change.view((0, n), (n, m)).into_owned(),
            c: output.columns(0, n).into_owned(),
            d: output.columns(n, m).into_owned(),
            states: self.names(),
            inputs: named(&self.system.inputs, m),
            outputs: named(&self.system.outputs, self.system.outputs.len() - self.delayed),
            delay: 0.0,
            period: Some(period),
        };
        Ok((change.view((0, 0), (n, n)).into_owned(), system))
    }

    /// Returns the number of inputs that are not delayed quantities.
    fn inputs(&self) -> usize {
        self.system.inputs.len() - self.delayed
    }

    fn names(&self) -> Vec<String> {
        let pending = self.clocks.iter().filter(|clock| clock.delay > 0.0).flat_map(|clock| clock.memory.clone());
        let pending = pending.map(|state| format!("{NEXT}{}", self.system.states[state]));
        let delayed = self.lines.iter().enumerate().flat_map(|(l, line)| {
            let waiting = (1..=line.most).map(move |i| format!("delay {}, {i}", l + 1));
            std::iter::once(format!("delay {}", l + 1)).chain(waiting)
        });
        self.system.states.iter().cloned().chain(pending).chain(delayed).collect()
    }

    /// Returns true if a state is the memory of a clock.
    fn is_memory(&self, state: usize) -> bool {
        self.clocks.iter().any(|clock| clock.memory.contains(&state))
    }

    /// Returns the clocks on whose memory a row of `C` depends, or `None` if it depends on continuous states too.
    fn clocks_of(&self, row: usize) -> Option<Vec<usize>> {
        let used = |state: usize| self.system.c[(row, state)] != 0.0;
        if (0..self.system.order()).any(|state| used(state) && !self.is_memory(state)) {
            return None;
        }
        Some((0..self.clocks.len()).filter(|&k| self.clocks[k].memory.clone().any(used)).collect())
    }

    /// Returns the clock on whose memory the outputs of cut loops depend.
    fn clock_of_cut(&self) -> Result<usize, String> {
        let mut found: Option<usize> = None;
        for (i, output) in self.system.outputs.iter().enumerate().take(self.system.outputs.len() - self.delayed) {
            let name = output.trim_start_matches('-');
            let clocks = self.clocks_of(i).filter(|_| self.system.d.row(i).iter().all(|direct| *direct == 0.0));
            let clock = match clocks.as_deref() {
                None => {
                    return Err(format!(
                        "`{name}` changes between the instants of the clocks, so that the loop cut there is not time-invariant; cut \
                         it at the memory of a clock"
                    ));
                }
                Some([]) => continue,
                Some([clock]) => *clock,
                Some(_) => {
                    return Err(format!("`{name}` depends on several clocks; cut the loop at the memory of one clock"));
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

    /// Returns the time after the last first instant, s.
    fn within(&self, time: f64) -> f64 {
        let time = time.rem_euclid(self.period);
        if time >= self.period * (1.0 - SAME_INSTANT) || time <= self.period * SAME_INSTANT { 0.0 } else { time }
    }

    /// Returns the instants of a clock within a period.
    fn ticks(&self, clock: &Clock, first: f64) -> Vec<f64> {
        let count = (self.period / clock.period).round() as u32;
        (0..count).map(|i| self.within(clock.offset - first + f64::from(i) * clock.period)).collect()
    }

    /// Returns what happens from the first instant on within a period, by time after this instant. Creates the queues.
    fn groups(&mut self, first: f64, delays: &[f64], is_cut: bool) -> Result<Vec<(f64, Vec<Act>)>, String> {
        let mut all = Vec::new();
        for (k, clock) in self.clocks.iter().enumerate() {
            for tick in self.ticks(clock, first) {
                all.push((tick, Act::Tick(k)));
                if clock.delay > 0.0 {
                    all.push((self.within(tick + clock.delay), Act::Arrive(k)));
                }
            }
        }
        for (l, &delay) in delays.iter().enumerate() {
            let pushes = self.pushes(l, first, delay)?;
            let mut waiting = 0.0;
            for &push in &pushes {
                let end = self.within(push + delay);
                let periods = ((push + delay - end) / self.period).round();
                // Values that take effect at the first instant of a cut loop do so before its inputs change.
                waiting += if end == 0.0 && is_cut { periods - 1.0 } else { periods };
                all.extend([(push, Act::Push(l)), (end, Act::Deliver(l))]);
            }
            let most = waiting as usize + pushes.len();
            if waiting > f64::from(MOST_WAITING) {
                return Err(format!(
                    "the delay of {delay:e} s is longer than {MOST_WAITING} changes of the delayed quantity"
                ));
            }
            self.lines.push(Line { value: self.order, waiting: waiting as usize, most });
            self.order += 1 + most;
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut groups: Vec<(f64, Vec<Act>)> = Vec::new();
        for (time, act) in all {
            match groups.last_mut() {
                Some((last, acts)) if time - *last <= SAME_INSTANT * self.period => acts.push(act),
                _ => groups.push((time, vec![act])),
            }
        }
        groups.iter_mut().for_each(|(_, acts)| {
            acts.sort();
            acts.dedup();
        });
        Ok(groups)
    }

    /// Returns the times within a period at which the value of a delayed quantity is needed: its changes if it depends
    /// on memory and inputs only, or the instants of the clocks that read it, `delay` earlier.
    fn pushes(&self, line: usize, first: f64, delay: f64) -> Result<Vec<f64>, String> {
        let StateSpace { b, d, .. } = self.system;
        let (column, row) = (self.inputs() + line, self.system.outputs.len() - self.delayed + line);
        let nested = (0..self.delayed).any(|other| d[(row, self.inputs() + other)] != 0.0);
        let follows_inputs = (0..self.inputs()).any(|input| d[(row, input)] != 0.0);
        let acts_between = (0..self.system.order()).any(|state| !self.is_memory(state) && b[(state, column)] != 0.0)
            || (0..self.system.outputs.len() - self.delayed).any(|output| d[(output, column)] != 0.0);
        let mut times: Vec<f64> = match self.clocks_of(row).filter(|_| !nested) {
            Some(clocks) => {
                let changes = clocks.iter().flat_map(|&k| {
                    let Clock { delay, .. } = self.clocks[k];
                    self.ticks(&self.clocks[k], first).into_iter().map(move |tick| tick + delay)
                });
                changes.chain(follows_inputs.then_some(0.0)).map(|time| self.within(time)).collect()
            }
            None if !nested && !acts_between => {
                let reads = |clock: &&Clock| clock.memory.clone().any(|state| b[(state, column)] != 0.0);
                let readers = self.clocks.iter().filter(reads);
                readers.flat_map(|clock| self.ticks(clock, first)).map(|tick| self.within(tick - delay)).collect()
            }
            None => {
                return Err("a delayed quantity that changes between the instants of the clocks, and acts between them, has no \
                            discrete equivalent; delay the memory of a clock, or what a clock reads"
                    .to_owned());
            }
        };
        // A quantity that does not change is 0, as all are deviations.
        if times.is_empty() {
            times.push(0.0);
        }
        times.sort_by(f64::total_cmp);
        times.dedup_by(|a, b| *a - *b <= SAME_INSTANT * self.period);
        Ok(times)
    }

    /// Returns the outputs as functions of states, pending values, delayed values and inputs.
    fn outputs(&self) -> DMatrix<f64> {
        let StateSpace { c, d, outputs, .. } = self.system;
        let (p, m) = (outputs.len() - self.delayed, self.inputs());
        let mut all = DMatrix::zeros(p, self.order + m);
        all.columns_mut(0, c.ncols()).copy_from(&c.rows(0, p));
        all.columns_mut(self.order, m).copy_from(&d.view((0, 0), (p, m)));
        for (l, line) in self.lines.iter().enumerate() {
            all.column_mut(line.value).copy_from(&d.view((0, m + l), (p, 1)));
        }
        all
    }

    /// Adds the changes at an instant, and updates the numbers of values that wait in each queue.
    fn act(&self, change: &mut DMatrix<f64>, acts: &[Act], waiting: &mut [usize]) {
        // New values of one kind are computed from those before.
        for kind in acts.chunk_by(|a, b| std::mem::discriminant(a) == std::mem::discriminant(b)) {
            let mut new: Vec<(usize, RowDVector<f64>)> = Vec::new();
            for act in kind {
                match *act {
                    Act::Arrive(k) => {
                        let memory = self.clocks[k].memory.clone().enumerate();
                        new.extend(memory.map(|(i, state)| (state, value(change, self.pending[k] + i))));
                    }
                    Act::Deliver(l) => {
                        let place = self.lines[l].value;
                        new.push((place, value(change, place + waiting[l])));
                        waiting[l] -= 1;
                    }
                    Act::Tick(k) => {
                        for (i, state) in self.clocks[k].memory.clone().enumerate() {
                            let row = if self.clocks[k].delay > 0.0 { self.pending[k] + i } else { state };
                            let next = self.row(&self.system.a, &self.system.b, state);
                            new.push((row, value(change, state) + self.applied(&next, change)));
                        }
                    }
                    Act::Push(l) => {
                        let Line { value: place, most, .. } = self.lines[l];
                        let quantity = self.system.outputs.len() - self.delayed + l;
                        let pushed = self.row(&self.system.c, &self.system.d, quantity);
                        new.push((place + 1, self.applied(&pushed, change)));
                        new.extend((2..=most).map(|i| (place + i, value(change, place + i - 1))));
                        waiting[l] += 1;
                    }
                }
            }
            for (row, mut value) in new {
                value[row] -= 1.0;
                change.set_row(row, &value);
            }
        }
    }

    /// Returns a row of the matrices of the system, over the variables of [`Self::places`].
    fn row(&self, states: &DMatrix<f64>, inputs: &DMatrix<f64>, row: usize) -> RowDVector<f64> {
        RowDVector::from_iterator(
            states.ncols() + inputs.ncols(),
            states.row(row).iter().chain(inputs.row(row).iter()).copied(),
        )
    }

    /// Returns the places of states, inputs and delayed values, as the columns of the matrices of the system.
    fn places(&self) -> Vec<usize> {
        let inputs = self.order..self.order + self.inputs();
        (0..self.system.order()).chain(inputs).chain(self.lines.iter().map(|line| line.value)).collect()
    }

    /// Returns the value of a row of the matrices of the system.
    fn applied(&self, row: &RowDVector<f64>, change: &DMatrix<f64>) -> RowDVector<f64> {
        let places = self.places();
        let mut sum = row * change.select_rows(&places);
        places.iter().zip(row.iter()).for_each(|(&place, factor)| sum[place] += factor);
        sum
    }

    /// Adds the changes over a time without instants, s.
    fn flow(&self, change: &mut DMatrix<f64>, time: f64) {
        let places = self.places();
        let mut rates = DMatrix::zeros(places.len(), places.len());
        for state in (0..self.system.order()).filter(|&state| !self.is_memory(state)) {
            rates.set_row(state, &self.row(&self.system.a, &self.system.b, state));
        }
        let added = exponential_m1(&(rates * time));
        let moved: Vec<RowDVector<f64>> =
            (0..self.system.order()).map(|state| self.applied(&added.row(state).into_owned(), change)).collect();
        for (state, moved) in moved.iter().enumerate() {
            let mut row = change.row_mut(state);
            row += moved;
        }
    }
}

/// Returns the value of a variable as function of all at the first instant.
fn value(change: &DMatrix<f64>, place: usize) -> RowDVector<f64> {
    let mut value = change.row(place).into_owned();
    value[place] += 1.0;
    value
}
