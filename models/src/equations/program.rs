//! Tape: a flat list of instructions on registers, run at every stage of every step.

use mops_language::{
    Scalar,
    expression::{Comparison, Function, functions},
};

use super::bank::{Bank, Register};

/// Instruction of a tape; writes the first register. Sums of products are one instruction, because most of the time is
/// spent fetching instructions.
#[rustfmt::skip]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Instruction {
    /// Number at an index of the list of the tape.
    Set(Register, Register),
    Copy(Register, Register),
    Add(Register, Register, Register),
    Sub(Register, Register, Register),
    Mul(Register, Register, Register),
    Div(Register, Register, Register),
    Neg(Register, Register),
    /// Sum `a b + c`.
    MulAdd(Register, Register, Register, Register),
    /// Difference `a b - c`.
    MulSub(Register, Register, Register, Register),
    /// Difference `c - a b`.
    SubMul(Register, Register, Register, Register),
    /// Sum `a b + c d`.
    Dot(Register, Register, Register, Register, Register),
    /// Difference `a b - c d`.
    Cross(Register, Register, Register, Register, Register),
    /// Sine (first) and cosine (second) of the third.
    SinCos(Register, Register, Register),
    Sin(Register, Register),
    Cos(Register, Register),
    Sqrt(Register, Register),
    Function(Function, Register, Register),
    Power(Register, Register, Register),
    Atan2(Register, Register, Register),
    Holds(Comparison, Register, Register, Register),
    /// Selection: the third if the second is positive, else the fourth.
    Choose(Register, Register, Register, Register),
    /// Linear equations with this number of unknowns. The matrix starts at the register, row by row, followed by the
    /// right-hand sides, which the solution overwrites.
    Solve(Register, u16),
}

/// Tape, with the registers of its results.
#[derive(Debug, Clone, Default)]
pub struct Program {
    /// Instructions, in order.
    pub instructions: Vec<Instruction>,
    /// Numbers that [`Instruction::Set`] reads.
    pub numbers: Vec<f64>,
    /// Registers of the results, in the order of the request.
    pub results: Vec<Register>,
}

impl Program {
    /// Returns the number of instructions.
    pub fn len(&self) -> usize {
        self.instructions.len()
    }

    /// Runs the tape.
    #[inline]
    pub fn run<S: Scalar, B: Bank<S>>(&self, r: &mut B) {
        use Instruction as I;
        for instruction in &self.instructions {
            match *instruction {
                I::Set(o, k) => r.set(o, S::from(self.numbers[usize::from(k)])),
                I::Copy(o, a) => r.set(o, r.get(a)),
                I::Add(o, a, b) => r.set(o, r.get(a) + r.get(b)),
                I::Sub(o, a, b) => r.set(o, r.get(a) - r.get(b)),
                I::Mul(o, a, b) => r.set(o, r.get(a) * r.get(b)),
                I::Div(o, a, b) => r.set(o, r.get(a) / r.get(b)),
                I::Neg(o, a) => r.set(o, -r.get(a)),
                I::MulAdd(o, a, b, c) => r.set(o, r.get(a) * r.get(b) + r.get(c)),
                I::MulSub(o, a, b, c) => r.set(o, r.get(a) * r.get(b) - r.get(c)),
                I::SubMul(o, a, b, c) => r.set(o, r.get(c) - r.get(a) * r.get(b)),
                I::Dot(o, a, b, c, d) => r.set(o, r.get(a) * r.get(b) + r.get(c) * r.get(d)),
                I::Cross(o, a, b, c, d) => r.set(o, r.get(a) * r.get(b) - r.get(c) * r.get(d)),
                I::SinCos(s, c, a) => {
                    let (sin, cos) = r.get(a).sin_cos();
                    r.set(s, sin);
                    r.set(c, cos);
                }
                I::Sin(o, a) => r.set(o, r.get(a).sin()),
                I::Cos(o, a) => r.set(o, r.get(a).cos()),
                I::Sqrt(o, a) => r.set(o, functions::sqrt(r.get(a))),
                I::Function(f, o, a) => {
                    r.set(o, f.smooth(r.get(a)).expect("only smooth functions are compiled to this instruction"))
                }
                I::Power(o, a, b) => r.set(o, functions::power(r.get(a), r.get(b))),
                I::Atan2(o, a, b) => r.set(o, functions::atan2(r.get(a), r.get(b))),
                I::Holds(comparison, o, a, b) => {
                    let holds = comparison.holds(r.get(a).value(), r.get(b).value());
                    r.set(o, S::from(f64::from(u8::from(holds))));
                }
                I::Choose(o, c, a, b) => r.set(o, if r.get(c).value() > 0.0 { r.get(a) } else { r.get(b) }),
                I::Solve(start, n) => solve(r, start, n),
            }
        }
    }
}

/// Solves linear equations by Gaussian elimination with row pivoting, in place.
fn solve<S: Scalar, B: Bank<S>>(r: &mut B, start: Register, n: u16) {
    let at = |i: u16, j: u16| start + i * n + j;
    let right = |i: u16| start + n * n + i;
    for k in 0..n {
        let size = |r: &B, i: u16| r.get(at(i, k)).value().abs();
        let pivot = (k + 1..n).fold(k, |best, i| if size(r, i) > size(r, best) { i } else { best });
        if pivot != k {
            for j in k..n {
                let (a, b) = (r.get(at(k, j)), r.get(at(pivot, j)));
                r.set(at(k, j), b);
                r.set(at(pivot, j), a);
            }
            let (a, b) = (r.get(right(k)), r.get(right(pivot)));
            r.set(right(k), b);
            r.set(right(pivot), a);
        }
        for i in k + 1..n {
            if r.get(at(i, k)).value() == 0.0 && r.get(at(i, k)).tangents().iter().all(|&d| d == 0.0) {
                continue;
            }
            let factor = r.get(at(i, k)) / r.get(at(k, k));
            for j in k + 1..n {
                r.set(at(i, j), r.get(at(i, j)) - factor * r.get(at(k, j)));
            }
            r.set(right(i), r.get(right(i)) - factor * r.get(right(k)));
        }
    }
    for i in (0..n).rev() {
        let sum = (i + 1..n).fold(r.get(right(i)), |sum, j| sum - r.get(at(i, j)) * r.get(right(j)));
        r.set(right(i), sum / r.get(at(i, i)));
    }
}
