//! Tapes evaluated on bounds: the range of a guard over a part of a step.

use mops_language::{
    Scalar,
    enclosure::{Enclosure, Interval},
};

use super::bank::{Bank, Register};
use super::program::{Instruction, Program};

impl Program {
    /// Runs the tape on enclosures.
    pub fn enclose(&self, r: &mut [Enclosure]) {
        use Instruction as I;
        let at = usize::from;
        // A product with itself is never negative.
        let product = |r: &[Enclosure], a, b| if a == b { r[at(a)].square() } else { r[at(a)] * r[at(b)] };
        for instruction in &self.instructions {
            let (to, value) = match *instruction {
                I::Set(o, k) => (o, Enclosure::from(self.numbers[at(k)])),
                I::Copy(o, a) => (o, r[at(a)]),
                I::Add(o, a, b) => (o, r[at(a)] + r[at(b)]),
                I::Sub(o, a, b) => (o, r[at(a)] - r[at(b)]),
                I::Mul(o, a, b) => (o, product(r, a, b)),
                I::Div(o, a, b) => (o, r[at(a)] / r[at(b)]),
                I::Neg(o, a) => (o, -r[at(a)]),
                I::MulAdd(o, a, b, c) => (o, product(r, a, b) + r[at(c)]),
                I::MulSub(o, a, b, c) => (o, product(r, a, b) - r[at(c)]),
                I::SubMul(o, a, b, c) => (o, r[at(c)] - product(r, a, b)),
                I::Dot(o, a, b, c, d) => (o, product(r, a, b) + product(r, c, d)),
                I::Cross(o, a, b, c, d) => (o, product(r, a, b) - product(r, c, d)),
                I::SinCos(s, c, a) => {
                    let angle = r[at(a)];
                    r[at(s)] = angle.sin();
                    (c, angle.cos())
                }
                I::Sin(o, a) => (o, r[at(a)].sin()),
                I::Cos(o, a) => (o, r[at(a)].cos()),
                I::Sqrt(o, a) => (o, r[at(a)].function(mops_language::expression::Function::Sqrt)),
                I::Function(f, o, a) => (o, r[at(a)].function(f)),
                I::Power(o, a, b) => (o, r[at(a)].power(r[at(b)])),
                I::Atan2(o, a, b) => (o, r[at(a)].atan2(r[at(b)])),
                I::Holds(comparison, o, a, b) => (o, r[at(a)].holds(comparison, r[at(b)])),
                I::Choose(o, c, a, b) => (o, r[at(c)].choose(r[at(a)], r[at(b)])),
                I::Solve(start, n) => {
                    solve(r, at(start), at(n));
                    continue;
                }
            };
            r[at(to)] = value;
        }
    }
}

/// Solves linear equations by elimination, in place. The pivot has the largest guaranteed magnitude; the result is
/// unknown if none is certain to be nonzero.
fn solve(r: &mut [Enclosure], start: usize, n: usize) {
    let cell = |i: usize, j: usize| start + i * n + j;
    let right = |i: usize| start + n * n + i;
    let certain = |e: Enclosure| if e.value.contains(0.0) { 0.0 } else { e.value.low.abs().min(e.value.high.abs()) };
    for k in 0..n {
        let pivot =
            (k + 1..n).fold(k, |best, i| if certain(r[cell(i, k)]) > certain(r[cell(best, k)]) { i } else { best });
        if certain(r[cell(pivot, k)]) == 0.0 {
            (0..n).for_each(|i| r[right(i)] = Enclosure::UNKNOWN);
            return;
        }
        if pivot != k {
            (k..n).for_each(|j| r.swap(cell(k, j), cell(pivot, j)));
            r.swap(right(k), right(pivot));
        }
        for i in k + 1..n {
            if r[cell(i, k)] == Enclosure::from(0.0) {
                continue;
            }
            let factor = r[cell(i, k)] / r[cell(k, k)];
            for j in k + 1..n {
                r[cell(i, j)] = r[cell(i, j)] - factor * r[cell(k, j)];
            }
            r[right(i)] = r[right(i)] - factor * r[right(k)];
        }
    }
    for i in (0..n).rev() {
        let sum = (i + 1..n).fold(r[right(i)], |sum, j| sum - r[cell(i, j)] * r[right(j)]);
        r[right(i)] = sum / r[cell(i, i)];
    }
}

/// Creates registers with bounds from a bank, whose numbers of parameters, modes and hoisted nodes are used.
pub fn registers<S: Scalar>(bank: &impl Bank<S>, count: usize) -> Vec<Enclosure> {
    let number = |register: usize| {
        let register = Register::try_from(register).expect("registers were counted with this type");
        Enclosure::from(bank.get(register).value())
    };
    (0..count).map(number).collect()
}

/// Returns `-x` if `negative`, else `x`.
pub fn signed(negative: bool, x: Enclosure) -> Enclosure {
    if negative { -x } else { x }
}

/// Returns `x` with a number added.
pub fn moved(x: Enclosure, by: f64) -> Enclosure {
    Enclosure { value: x.value + Interval::point(by), rate: x.rate }
}
