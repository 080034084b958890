//! From the graph to a tape: flat instructions on registers, run at every stage of every step.

use std::collections::HashMap;

use mops_core::Scalar;
use mops_core::expression::{Comparison, Function, functions};

use super::graph::{Graph, Id, Level, Op};

/// Place of a number while a tape runs.
pub type Register = u16;

/// One step of a tape. The first register is the one written; sums of products are one instruction, as most of the time
/// goes into fetching instructions, not into arithmetic.
#[rustfmt::skip]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Instruction {
    /// The number at this place of the tape's list.
    Set(Register, Register),
    Copy(Register, Register),
    Add(Register, Register, Register),
    Sub(Register, Register, Register),
    Mul(Register, Register, Register),
    Div(Register, Register, Register),
    Neg(Register, Register),
    /// `a b + c`.
    MulAdd(Register, Register, Register, Register),
    /// `a b - c`.
    MulSub(Register, Register, Register, Register),
    /// `c - a b`.
    SubMul(Register, Register, Register, Register),
    /// `a b + c d`.
    Dot(Register, Register, Register, Register, Register),
    /// `a b - c d`.
    Cross(Register, Register, Register, Register, Register),
    /// Sine and cosine of the third.
    SinCos(Register, Register, Register),
    Sin(Register, Register),
    Cos(Register, Register),
    Sqrt(Register, Register),
    Function(Function, Register, Register),
    Power(Register, Register, Register),
    Atan2(Register, Register, Register),
    Holds(Comparison, Register, Register, Register),
    /// The third where the second is positive, else the fourth.
    Choose(Register, Register, Register, Register),
    /// Linear equations of this many unknowns: the matrix from the register on, row by row, then the right-hand sides,
    /// in whose place the solution is written.
    Solve(Register, u16),
}

/// Numbers by register.
pub trait Bank<S> {
    /// A bank with room for this many.
    fn with(count: usize) -> Self;
    /// The number in a register.
    fn get(&self, register: Register) -> S;
    /// Writes a register.
    fn set(&mut self, register: Register, value: S);
}

/// Room for 256 registers: an index cannot be out of range, so none is checked.
pub struct Small<S>(Box<[S; 256]>);

/// Any number of registers.
pub struct Large<S>(Vec<S>);

#[allow(clippy::cast_possible_truncation)]
impl<S: Scalar> Bank<S> for Small<S> {
    fn with(count: usize) -> Self {
        assert!(count <= 256, "the size was looked at");
        Self(Box::new([S::from(0.0); 256]))
    }
    #[inline(always)]
    fn get(&self, register: Register) -> S {
        self.0[usize::from(register as u8)]
    }
    #[inline(always)]
    fn set(&mut self, register: Register, value: S) {
        self.0[usize::from(register as u8)] = value;
    }
}

impl<S: Scalar> Bank<S> for Large<S> {
    fn with(count: usize) -> Self {
        Self(vec![S::from(0.0); count])
    }
    #[inline(always)]
    fn get(&self, register: Register) -> S {
        self.0[usize::from(register)]
    }
    #[inline(always)]
    fn set(&mut self, register: Register, value: S) {
        self.0[usize::from(register)] = value;
    }
}

/// A tape, and where its results stand after it ran.
#[derive(Debug, Clone, Default)]
pub struct Program {
    instructions: Vec<Instruction>,
    numbers: Vec<f64>,
    /// Registers of the results, in the order they were asked for.
    pub results: Vec<Register>,
}

impl Program {
    /// Number of instructions.
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
                I::Function(f, o, a) => r.set(o, f.smooth(r.get(a)).expect("only smooth functions are compiled to it")),
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

/// Elimination with row pivoting, in place.
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

/// Where parameters, states, inputs, time, modes and hoisted numbers stand, the same for all tapes of a model.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    parameters: usize,
    states: usize,
    inputs: usize,
    modes: usize,
    hoisted: Vec<Id>,
    places: HashMap<Id, Register>,
    /// Registers in use by the largest tape.
    pub registers: usize,
}

/// A model too large for the registers there are.
#[derive(Debug)]
pub struct TooLarge;

fn register(place: usize) -> Result<Register, TooLarge> {
    Register::try_from(place).map_err(|_| TooLarge)
}

impl Layout {
    /// The layout of a model of this size.
    pub fn new(parameters: usize, states: usize, inputs: usize, modes: usize) -> Result<Self, TooLarge> {
        let registers = parameters + states + inputs + 1 + modes;
        register(registers)?;
        Ok(Self { parameters, states, inputs, modes, registers, ..Self::default() })
    }

    #[allow(clippy::cast_possible_truncation)]
    fn place(place: usize) -> Register {
        place as Register
    }

    /// The register of a parameter.
    pub fn parameter(&self, index: usize) -> Register {
        Self::place(index)
    }

    /// The register of a state.
    #[inline]
    pub fn state(&self, index: usize) -> Register {
        Self::place(self.parameters + index)
    }

    /// The register of an input.
    #[inline]
    pub fn input(&self, index: usize) -> Register {
        Self::place(self.parameters + self.states + index)
    }

    /// The register of time.
    #[inline]
    pub fn time(&self) -> Register {
        Self::place(self.parameters + self.states + self.inputs)
    }

    /// The register of a mode.
    pub fn mode(&self, index: usize) -> Register {
        Self::place(self.parameters + self.states + self.inputs + 1 + index)
    }

    /// The register of a node that all tapes share: a leaf, or a number that is computed once in a simulation.
    fn shared(&mut self, graph: &Graph, id: Id) -> Result<Option<Register>, TooLarge> {
        Ok(Some(match graph.op(id) {
            Op::Parameter(index) => self.parameter(index),
            Op::State(index) => self.state(index),
            Op::Input(index) => self.input(index),
            Op::Time => self.time(),
            Op::Mode(index) => self.mode(index),
            _ if graph.level(id) == Level::Variable => return Ok(None),
            _ => match self.places.get(&id) {
                Some(place) => *place,
                None => {
                    let place = self.parameters + self.states + self.inputs + 1 + self.modes + self.hoisted.len();
                    self.hoisted.push(id);
                    self.places.insert(id, register(place)?);
                    register(place)?
                }
            },
        }))
    }

    fn first_free(&self) -> usize {
        self.parameters + self.states + self.inputs + 1 + self.modes + self.hoisted.len()
    }
}

/// Compiles tapes that share a layout: first all that run in the loop, then the one that runs before it.
pub fn compile(graph: &Graph, layout: &mut Layout, wanted: &[Vec<Id>]) -> Result<(Program, Vec<Program>), TooLarge> {
    // All places that tapes share must be known before the first temporary register is given away.
    for roots in wanted {
        Tape::new(graph, layout, roots, false).gather()?;
    }
    let programs =
        wanted.iter().map(|roots| Tape::new(graph, layout, roots, false).compile()).collect::<Result<_, _>>()?;
    let hoisted = layout.hoisted.clone();
    let mut setup = Tape::new(graph, layout, &hoisted, true);
    for &id in &hoisted {
        setup.count(id);
    }
    for &id in &hoisted {
        let from = setup.emit(id)?;
        let to = setup.layout.places[&id];
        setup.program.instructions.push(Instruction::Copy(to, from));
    }
    Ok((setup.finish(), programs))
}

/// A tape in the making.
struct Tape<'g> {
    graph: &'g Graph,
    layout: &'g mut Layout,
    roots: &'g [Id],
    /// Whether it is the tape that computes the hoisted numbers.
    setup: bool,
    uses: HashMap<Id, usize>,
    done: HashMap<Id, Register>,
    solved: Vec<usize>,
    free: Vec<Register>,
    next: usize,
    program: Program,
}

impl<'g> Tape<'g> {
    fn new(graph: &'g Graph, layout: &'g mut Layout, roots: &'g [Id], setup: bool) -> Self {
        let next = layout.first_free();
        Self {
            graph,
            layout,
            roots,
            setup,
            uses: HashMap::new(),
            done: HashMap::new(),
            solved: Vec::new(),
            free: Vec::new(),
            next,
            program: Program::default(),
        }
    }

    /// Finds the shared places that the tape needs.
    fn gather(mut self) -> Result<(), TooLarge> {
        let mut stack = self.roots.to_vec();
        while let Some(id) = stack.pop() {
            *self.uses.entry(id).or_insert(0) += 1;
            if self.uses[&id] > 1 || self.layout.shared(self.graph, id)?.is_some() {
                continue;
            }
            stack.extend(self.graph.operands(id));
        }
        Ok(())
    }

    fn compile(mut self) -> Result<Program, TooLarge> {
        for &root in self.roots {
            self.count(root);
            // A result stays to the end.
            *self.uses.get_mut(&root).expect("just counted") += 1;
        }
        for &root in self.roots {
            let register = self.emit(root)?;
            self.program.results.push(register);
        }
        Ok(self.finish())
    }

    fn finish(self) -> Program {
        self.layout.registers = self.layout.registers.max(self.next);
        self.program
    }

    fn home(&mut self, id: Id) -> Result<Option<Register>, TooLarge> {
        if self.setup && !matches!(self.graph.op(id), Op::Parameter(_)) {
            return Ok(None);
        }
        self.layout.shared(self.graph, id)
    }

    /// Counts how often each node is used.
    fn count(&mut self, id: Id) {
        let uses = self.uses.entry(id).or_insert(0);
        *uses += 1;
        let first = *uses == 1;
        let leaf = matches!(self.home(id), Ok(Some(_)));
        if !first || leaf {
            return;
        }
        if let Op::Solution(block, _) = self.graph.op(id) {
            if self.solved.contains(&block) {
                return;
            }
            self.solved.push(block);
        }
        for operand in self.graph.operands(id) {
            self.count(operand);
        }
    }

    fn take(&mut self) -> Result<Register, TooLarge> {
        match self.free.pop() {
            Some(register) => Ok(register),
            None => {
                self.next += 1;
                register(self.next - 1)
            }
        }
    }

    /// One use less: after the last, the register is free again.
    fn release(&mut self, id: Id) {
        let uses = self.uses.get_mut(&id).expect("every use was counted");
        *uses -= 1;
        let last = *uses == 0;
        let leaf = matches!(self.home(id), Ok(Some(_))) || matches!(self.graph.op(id), Op::Solution(..));
        if last && !leaf {
            self.free.extend(self.done.get(&id));
        }
    }

    /// The two factors of a product that nothing else uses: it needs no register of its own.
    fn product(&mut self, id: Id) -> Option<[Id; 2]> {
        match self.graph.op(id) {
            Op::Mul(a, b) => {
                let alone = self.uses[&id] == 1 && !self.done.contains_key(&id);
                let plain = !self.is_minus(id) && !matches!(self.home(id), Ok(Some(_)));
                (alone && plain).then_some([a, b])
            }
            _ => None,
        }
    }

    fn is_minus(&self, id: Id) -> bool {
        matches!(self.graph.op(id), Op::Mul(a, _) if self.graph.is(a, -1.0))
    }

    /// Computes a node; the register is released by whoever uses it.
    fn emit(&mut self, id: Id) -> Result<Register, TooLarge> {
        use Instruction as I;
        if let Some(register) = self.home(id)? {
            return Ok(register);
        }
        if let Some(&register) = self.done.get(&id) {
            return Ok(register);
        }
        let register = match self.graph.op(id) {
            Op::Constant(bits) => {
                let place = register(self.program.numbers.len())?;
                self.program.numbers.push(f64::from_bits(bits));
                let o = self.take()?;
                self.program.instructions.push(I::Set(o, place));
                o
            }
            Op::Add(a, b) => match (self.product(a), self.product(b)) {
                (Some([p, q]), Some([s, t])) => {
                    self.instruction(&[p, q, s, t], |o, r| I::Dot(o, r[0], r[1], r[2], r[3]))?
                }
                (Some([p, q]), None) => self.instruction(&[p, q, b], |o, r| I::MulAdd(o, r[0], r[1], r[2]))?,
                (None, Some([p, q])) => self.instruction(&[p, q, a], |o, r| I::MulAdd(o, r[0], r[1], r[2]))?,
                (None, None) => self.instruction(&[a, b], |o, r| I::Add(o, r[0], r[1]))?,
            },
            Op::Sub(a, b) => match (self.product(a), self.product(b)) {
                (Some([p, q]), Some([s, t])) => {
                    self.instruction(&[p, q, s, t], |o, r| I::Cross(o, r[0], r[1], r[2], r[3]))?
                }
                (Some([p, q]), None) => self.instruction(&[p, q, b], |o, r| I::MulSub(o, r[0], r[1], r[2]))?,
                (None, Some([p, q])) => self.instruction(&[p, q, a], |o, r| I::SubMul(o, r[0], r[1], r[2]))?,
                (None, None) => self.instruction(&[a, b], |o, r| I::Sub(o, r[0], r[1]))?,
            },
            Op::Mul(_, b) if self.is_minus(id) => {
                // The factor -1 was counted too; it needs no register.
                self.instruction(&[b], |o, r| I::Neg(o, r[0]))?
            }
            Op::Mul(a, b) => self.instruction(&[a, b], |o, r| I::Mul(o, r[0], r[1]))?,
            Op::Div(a, b) => self.instruction(&[a, b], |o, r| I::Div(o, r[0], r[1]))?,
            Op::Power(a, b) => self.instruction(&[a, b], |o, r| I::Power(o, r[0], r[1]))?,
            Op::Atan2(a, b) => self.instruction(&[a, b], |o, r| I::Atan2(o, r[0], r[1]))?,
            Op::Holds(c, a, b) => self.instruction(&[a, b], |o, r| I::Holds(c, o, r[0], r[1]))?,
            Op::Choose(c, a, b) => self.instruction(&[c, a, b], |o, r| I::Choose(o, r[0], r[1], r[2]))?,
            Op::Function(function, a) => self.function(function, a)?,
            Op::Solution(block, unknown) => return self.solution(block, unknown),
            Op::Parameter(_) | Op::State(_) | Op::Input(_) | Op::Time | Op::Mode(_) => {
                unreachable!("leaves have a register")
            }
        };
        self.done.insert(id, register);
        Ok(register)
    }

    /// Computes the operands, then the instruction.
    fn instruction(
        &mut self,
        operands: &[Id],
        make: impl Fn(Register, &[Register]) -> Instruction,
    ) -> Result<Register, TooLarge> {
        let mut registers = Vec::with_capacity(operands.len());
        for &operand in operands {
            registers.push(self.emit(operand)?);
        }
        for &operand in operands {
            self.release(operand);
        }
        let o = self.take()?;
        self.program.instructions.push(make(o, &registers));
        Ok(o)
    }

    /// A function; sine and cosine of the same angle are computed at once.
    fn function(&mut self, function: Function, a: Id) -> Result<Register, TooLarge> {
        use Instruction as I;
        let other = match function {
            Function::Sin => Some(Function::Cos),
            Function::Cos => Some(Function::Sin),
            _ => None,
        };
        let other =
            other.and_then(|other| self.uses.keys().copied().find(|&id| self.graph.op(id) == Op::Function(other, a)));
        let Some(other) = other else {
            return self.instruction(&[a], |o, r| match function {
                Function::Sin => I::Sin(o, r[0]),
                Function::Cos => I::Cos(o, r[0]),
                Function::Sqrt => I::Sqrt(o, r[0]),
                _ => I::Function(function, o, r[0]),
            });
        };
        let angle = self.emit(a)?;
        let (mine, its) = (self.take()?, self.take()?);
        let (sin, cos) = if function == Function::Sin { (mine, its) } else { (its, mine) };
        self.program.instructions.push(I::SinCos(sin, cos, angle));
        self.release(a);
        self.release(a);
        self.done.insert(other, its);
        Ok(mine)
    }

    /// An unknown of a block, which is solved at the first need; its registers are not used again.
    fn solution(&mut self, block: usize, unknown: usize) -> Result<Register, TooLarge> {
        let graph = self.graph;
        let block_of = &graph.blocks[block];
        let n = block_of.right.len();
        let operands: Vec<Id> = block_of.matrix.iter().chain(&block_of.right).copied().collect();
        for &operand in &operands {
            self.emit(operand)?;
        }
        let start = self.next;
        self.next += n * n + n;
        register(self.next)?;
        for (k, &operand) in operands.iter().enumerate() {
            let from = self.emit(operand)?;
            self.program.instructions.push(Instruction::Copy(register(start + k)?, from));
        }
        for &operand in &operands {
            self.release(operand);
        }
        self.program.instructions.push(Instruction::Solve(register(start)?, register(n)?));
        for id in self.uses.keys().copied().collect::<Vec<_>>() {
            if let Op::Solution(of, k) = graph.op(id)
                && of == block
            {
                self.done.insert(id, register(start + n * n + k)?);
            }
        }
        register(start + n * n + unknown)
    }
}
