//! Random sampled and continuous loops: as systems with given matrices, and as functions of the frequency in other
//! arithmetic.

use std::f64::consts::PI;

use mops_math as math;
use mops_math::{Stream, complex, stream};
use nalgebra::DMatrix;
use rand::Rng;

use super::on_grid::{Expected, OnGrid};
use crate::reference::{Double, Exact, ExactMatrix, exact, exactly, inverse, product, sum, times};
use crate::testing::random;
use crate::{Clock, Complex, StateSpace, TransferFunction};

/// Returns 10 to a random power.
fn decades(stream: &mut Stream, low: f64, high: f64) -> f64 {
    math::powf(10.0, stream.random_range(low..high))
}

/// Sampled loop: a chain of integrators and lags, a controller with memory in units of its own, and copies of memory.
pub struct Sampled {
    /// Rates of the chain `x1`, `x2`, ...: `A`, lower triangular, and `B`.
    plant: [DMatrix<f64>; 2],
    integrators: usize,
    lowest: f64,
    period: f64,
    /// Proportional gain, derivative time and integral gain per period, relative to the proportional one, filter
    /// constant.
    controller: [f64; 4],
    /// Periods from a sample to the change of the output: by copies of the measurement, of the output, and of the
    /// clock.
    late: [usize; 3],
    /// Copies of memory that nothing reads.
    idle: usize,
    /// Units of memory.
    units: Vec<f64>,
}

impl Sampled {
    pub fn random(seed: u64) -> Self {
        let mut stream = stream(seed, "sampled loop");
        let period = decades(&mut stream, -4.0, 0.0);
        let crossover = decades(&mut stream, -2.5, -0.3) / period;
        let integrators = [0, 1, 1, 2, 2, 3][stream.random_range(0..6)];
        let lags = stream.random_range(usize::from(integrators == 0)..=4 - integrators.min(3));
        let n = integrators + lags;
        let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, 1));
        b[(0, 0)] = 1.0;
        let mut lowest = crossover;
        let equal = stream.random_bool(0.3).then(|| decades(&mut stream, -1.5, 1.5) * crossover);
        for i in 0..n {
            let rate = if i < integrators {
                0.0
            } else {
                equal.unwrap_or_else(|| decades(&mut stream, -1.5, 1.5) * crossover)
            };
            let gain = if i < integrators { 1.0 } else { rate };
            lowest = if rate > 0.0 { lowest.min(rate) } else { lowest };
            a[(i, i)] = -rate;
            if i > 0 {
                a[(i, i - 1)] = gain;
                b[(i, 0)] = if i < integrators && stream.random_bool(0.7) {
                    1.0 / crossover * decades(&mut stream, -0.3, 1.0)
                } else {
                    0.0
                };
            } else {
                b[(0, 0)] = gain;
            }
        }
        let derivative =
            if stream.random_bool(0.6) { decades(&mut stream, -0.3, 0.8) / crossover / period } else { 0.0 };
        let integral = if stream.random_bool(0.5) { crossover * period * decades(&mut stream, -1.5, 0.0) } else { 0.0 };
        let filter = if stream.random_bool(0.4) {
            -math::exp_m1(-crossover * period * decades(&mut stream, 0.3, 1.5))
        } else {
            1.0
        };
        lowest = if integral > 0.0 { lowest.min(integral / period) } else { lowest };
        let copies = stream.random_range(0..=6);
        let path = if stream.random_bool(0.3) { stream.random_range(0..=copies.min(3)) } else { 0 };
        let late = [path, usize::from(stream.random_bool(0.3)), usize::from(stream.random_bool(0.3))];
        let unit = decades(&mut stream, -3.0, 6.0);
        let units = (0..20).map(|_| if seed.is_multiple_of(2) { unit } else { decades(&mut stream, -3.0, 6.0) });
        let units = units.collect();
        let mut found = Self {
            plant: [a, b],
            integrators: integrators + usize::from(integral > 0.0),
            lowest,
            period,
            controller: [1.0, derivative, integral, filter],
            late,
            idle: copies - path,
            units,
        };
        let gain = decades(&mut stream, -0.7, 0.5);
        found.controller[0] = gain / complex::norm(found.response(crossover));
        found
    }

    /// Returns the discrete equivalent of the loop cut at the output of the controller.
    pub fn system(&self) -> Result<StateSpace, String> {
        let [a, b] = &self.plant;
        let [gain, derivative, integral, filter] = self.controller;
        let [path, waiting, late] = self.late;
        let n = a.nrows();
        let has_filter = filter < 1.0;
        // Output, waiting output, last measurement, integral, filter, copies.
        let (output, last, total) = (n, n + 1 + waiting, n + 2 + waiting);
        let filtered = total + usize::from(integral > 0.0);
        let first = filtered + usize::from(has_filter);
        let order = first + path + self.idle;
        let unit = |state: usize| self.units[state - n];
        let form = |state: usize, factor: f64| DMatrix::from_fn(1, order, |_, j| if j == state { factor } else { 0.0 });
        let mut all = DMatrix::zeros(order, order);
        all.view_mut((0, 0), (n, n)).copy_from(a);
        let mut next = |state: usize, value: DMatrix<f64>| all.set_row(state, &(value - form(state, 1.0)).row(0));
        let y = form(n - 1, 1.0);
        for i in 0..path {
            let from = if i == 0 { y.clone() } else { form(first + i - 1, 1.0 / unit(first + i - 1)) };
            next(first + i, from * unit(first + i));
        }
        let measured = if path == 0 { y } else { form(first + path - 1, 1.0 / unit(first + path - 1)) };
        let measured = if has_filter {
            let of = form(filtered, (1.0 - filter) / unit(filtered)) + measured * filter;
            next(filtered, &of * unit(filtered));
            of
        } else {
            measured
        };
        let mut law = &measured * (gain * (1.0 + derivative)) - form(last, gain * derivative / unit(last));
        if integral > 0.0 {
            law += form(total, 1.0 / unit(total));
            next(total, form(total, 1.0) + &measured * (gain * integral * unit(total)));
        }
        next(last, &measured * unit(last));
        let law = -law;
        if waiting == 0 {
            next(output, law * unit(output));
        } else {
            next(output, form(output + 1, unit(output) / unit(output + 1)));
            next(output + 1, law * unit(output + 1));
        }
        for i in 0..self.idle {
            let state = first + path + i;
            let from = if i == 0 { last } else { state - 1 };
            next(state, form(from, unit(state) / unit(from)));
        }
        let mut input = DMatrix::zeros(order, 1);
        input.rows_mut(0, n).copy_from(&(b / unit(output)));
        let system = StateSpace::new(all, input, -form(output, 1.0), DMatrix::zeros(1, 1));
        let delay = late as f64 * self.period;
        system.sampled(&[Clock { memory: n..order, period: self.period, offset: 0.0, delay }], &[], true)
    }

    /// Returns the loop transfer function at a frequency.
    fn response(&self, frequency: f64) -> Complex {
        self.controlled(frequency, self.plant_at(&self.steps(), frequency))
    }

    fn controlled(&self, frequency: f64, plant: Complex) -> Complex {
        let turn = frequency * self.period;
        let half = math::sin(0.5 * turn);
        let change = Complex::new(-2.0 * half * half, math::sin(turn));
        let z = change + 1.0;
        let [gain, derivative, integral, filter] = self.controller;
        let filtered = z * filter / (change + filter);
        let law = change / z * derivative + 1.0 + if integral > 0.0 { change.inv() * integral } else { 0.0.into() };
        let late: usize = self.late.iter().sum();
        plant * filtered * law * gain / z.powu(late as u32)
    }

    /// Returns the changes of the chain over a period, from its states and its input, in double-double numbers.
    fn steps(&self) -> ExactMatrix {
        let [a, b] = &self.plant;
        let n = a.nrows();
        let mut both = DMatrix::zeros(n + 1, n + 1);
        both.view_mut((0, 0), (n, n)).copy_from(&(a / 1024.0));
        both.view_mut((0, n), (n, 1)).copy_from(&(b / 1024.0));
        let period = Double::from(self.period);
        let part: ExactMatrix = exactly(&both).iter().map(|row| row.iter().map(|&x| x * period).collect()).collect();
        let plus = |a: &ExactMatrix, b: &ExactMatrix| -> ExactMatrix {
            a.iter().zip(b).map(|(r, s)| r.iter().zip(s).map(|(&x, &y)| x + y).collect()).collect()
        };
        let (mut power, mut all) = (part.clone(), part.clone());
        for k in 2..40 {
            let factor = Double::from(1.0) / Double::from(f64::from(k));
            power = times(&power, &part).iter().map(|row| row.iter().map(|&x| x * factor).collect()).collect();
            all = plus(&all, &power);
        }
        // (1 + x)^2 - 1
        (0..10).fold(all, |x, _| plus(&times(&x, &x), &plus(&x, &x)))
    }

    fn plant_at(&self, steps: &ExactMatrix, frequency: f64) -> Complex {
        let n = steps.len() - 1;
        let half = math::sin(0.5 * frequency * self.period);
        let change = exact(Complex::new(-2.0 * half * half, math::sin(frequency * self.period)));
        let real = |x: Double| Exact { re: x, im: 0.0.into() };
        let mut x: Vec<Exact> = Vec::new();
        for i in 0..n {
            let driven = (0..i).fold(real(steps[i][n]), |all, j| sum(all, product(real(steps[i][j]), x[j])));
            x.push(product(driven, inverse(sum(change, real(-steps[i][i])))));
        }
        Complex::new(x[n - 1].re.0, x[n - 1].im.0)
    }

    pub fn expected(&self) -> Expected {
        let steps = self.steps();
        let at = |frequency: f64| self.controlled(frequency, self.plant_at(&steps, frequency));
        let ends = [1e-3 * self.lowest, PI / self.period];
        OnGrid { at: &at, integrators: self.integrators, ends, is_sampled: true }.margins()
    }
}

/// Continuous loop in coordinates of a given condition.
pub struct Dense {
    zeros: Vec<Complex>,
    poles: Vec<Complex>,
    gain: f64,
    crossover: f64,
    /// Change of coordinates.
    to: DMatrix<f64>,
}

impl Dense {
    pub fn random(seed: u64, most: f64) -> Self {
        let mut stream = stream(seed, "dense loop");
        let crossover = decades(&mut stream, -3.0, 3.0);
        let integrators = [0, 1, 1, 2, 2][stream.random_range(0..5)];
        let order = stream.random_range(2..=10).max(integrators + 1);
        let mut poles = vec![Complex::new(0.0, 0.0); integrators];
        let equal = stream.random_bool(0.3).then(|| decades(&mut stream, -0.5, 1.5) * crossover);
        while poles.len() < order {
            let size = equal.unwrap_or_else(|| decades(&mut stream, -1.0, 1.5) * crossover);
            if poles.len() + 2 <= order && equal.is_none() && stream.random_bool(0.4) {
                let root = complex::from_polar(size, PI - math::acos(stream.random_range(0.1..0.95)));
                poles.extend([root, root.conj()]);
            } else {
                poles.push(Complex::new(-size, 0.0));
            }
        }
        let count = if integrators == 2 { 1 } else { stream.random_range(0..=(order - 1).min(2)) };
        let zeros = (0..count).map(|_| Complex::new(-crossover * decades(&mut stream, -1.0, 0.5), 0.0)).collect();
        let condition = decades(&mut stream, 0.0, math::log10(most));
        let scale = DMatrix::from_fn(order, order, |i, j| {
            if i == j { math::powf(condition, i as f64 / (order - 1) as f64) } else { 0.0 }
        });
        let to = random(order, order, seed).qr().q() * scale * random(order, order, seed + 1).qr().q();
        let mut found = Self { zeros, poles, gain: 1.0, crossover, to };
        found.gain = decades(&mut stream, -0.7, 0.5) / complex::norm(found.response(crossover));
        found
    }

    /// Returns the system, in random coordinates.
    pub fn system(&self) -> StateSpace {
        let mut chain: Option<StateSpace> = None;
        let mut zeros = self.zeros.iter();
        for pole in self.poles.iter().filter(|pole| pole.im >= 0.0) {
            // In units of time in which the crossover is 1.
            let pole = pole / self.crossover;
            let size = if complex::norm(pole) > 0.0 { complex::norm(pole) } else { 1.0 };
            let above = zeros.next().map_or(vec![size], |zero| vec![1.0, -zero.re / self.crossover]);
            let below = if pole.im > 0.0 { vec![1.0, -2.0 * pole.re, pole.norm_sqr()] } else { vec![1.0, -pole.re] };
            let section = TransferFunction::new(above, below).state_space().unwrap();
            chain = Some(chain.map_or(section.clone(), |chain| chain.series(&section)));
        }
        let mut system = chain.expect("a system with poles");
        let middle = Complex::new(0.0, self.crossover);
        system.a *= self.crossover;
        system.b *= self.crossover;
        let gain =
            complex::norm(self.response(self.crossover)) / complex::norm(system.response().unwrap().at(middle)[(0, 0)]);
        system.c *= gain;
        system.d *= gain;
        let to = exactly(&self.to);
        let back = inverted(&to);
        let rounded = |m: &ExactMatrix| DMatrix::from_fn(m.len(), m[0].len(), |i, j| m[i][j].0);
        StateSpace {
            a: rounded(&times(&times(&to, &exactly(&system.a)), &back)),
            b: rounded(&times(&to, &exactly(&system.b))),
            c: rounded(&times(&exactly(&system.c), &back)),
            ..system
        }
    }

    fn response(&self, frequency: f64) -> Complex {
        let s = Complex::new(0.0, frequency);
        let above: Complex = self.zeros.iter().map(|zero| s - zero).product();
        self.poles.iter().fold(above * self.gain, |value, pole| value / (s - pole))
    }

    /// Returns the margins of the given matrices: their rounding in coordinates of a large condition moves poles.
    pub fn expected(&self, system: &StateSpace) -> Expected {
        let integrators = self.poles.iter().filter(|pole| complex::norm(**pole) == 0.0).count();
        let ends = [1e-4 * self.crossover, 1e4 * self.crossover];
        OnGrid { at: &|w| by_elimination(system, w), integrators, ends, is_sampled: false }.margins()
    }
}

/// Returns `C (jw - A)^-1 B + D` in double-double numbers.
fn by_elimination(system: &StateSpace, frequency: f64) -> Complex {
    let n = system.order();
    let minus_one = Exact { re: Double::from(-1.0), im: 0.0.into() };
    let mut rows: Vec<Vec<Exact>> = (0..n)
        .map(|i| {
            let entry = |j: usize| exact(Complex::new(-system.a[(i, j)], if i == j { frequency } else { 0.0 }));
            (0..n).map(entry).chain([exact(system.b[(i, 0)].into())]).collect()
        })
        .collect();
    for k in 0..n {
        let size = |x: &Exact| math::hypot(x.re.0, x.im.0);
        let pivot = (k..n).max_by(|&i, &j| size(&rows[i][k]).total_cmp(&size(&rows[j][k]))).expect("a row");
        rows.swap(k, pivot);
        let divisor = inverse(rows[k][k]);
        let above: Vec<Exact> = rows[k].iter().map(|&x| product(x, divisor)).collect();
        rows[k].clone_from(&above);
        for row in rows.iter_mut().skip(k + 1) {
            let factor = product(minus_one, row[k]);
            for j in k..=n {
                row[j] = sum(row[j], product(factor, above[j]));
            }
        }
    }
    let mut value = exact(system.d[(0, 0)].into());
    let mut states = vec![exact(0.0.into()); n];
    for i in (0..n).rev() {
        let others = (i + 1..n).fold(exact(0.0.into()), |all, j| sum(all, product(rows[i][j], states[j])));
        states[i] = sum(rows[i][n], product(minus_one, others));
        value = sum(value, product(exact(system.c[(0, i)].into()), states[i]));
    }
    Complex::new(value.re.0, value.im.0)
}

/// Returns the inverse of a matrix by elimination with pivoting.
fn inverted(m: &ExactMatrix) -> ExactMatrix {
    let n = m.len();
    let one = |i: usize, j: usize| Double::from(f64::from(u8::from(i == j)));
    let mut rows: ExactMatrix =
        (0..n).map(|i| m[i].iter().copied().chain((0..n).map(|j| one(i, j))).collect()).collect();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| rows[i][k].0.abs().total_cmp(&rows[j][k].0.abs())).expect("a row");
        rows.swap(k, pivot);
        let above: Vec<Double> = rows[k].iter().map(|&x| x / rows[k][k]).collect();
        rows[k].clone_from(&above);
        for i in (0..n).filter(|&i| i != k) {
            let factor = rows[i][k];
            rows[i].iter_mut().zip(&above).for_each(|(x, &a)| *x = *x - factor * a);
        }
    }
    rows.into_iter().map(|row| row[n..].to_vec()).collect()
}
