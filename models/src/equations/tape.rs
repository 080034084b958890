//! From the graph to tapes: each node once, sums of products fused, sine with cosine, registers reused.

use std::collections::HashMap;

use mops_language::expression::Function;

use super::bank::Register;
use super::graph::{Graph, Id, Op};
use super::layout::{Layout, TooLarge, register};
use super::program::{Instruction, Program};

/// Compiles tapes that share a layout: first all that run during the simulation, then the one that runs before it.
pub fn compile(graph: &Graph, layout: &mut Layout, wanted: &[Vec<Id>]) -> Result<(Program, Vec<Program>), TooLarge> {
    // All shared registers must be known before the first temporary register is assigned.
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

/// Tape under construction.
struct Tape<'g> {
    graph: &'g Graph,
    layout: &'g mut Layout,
    roots: &'g [Id],
    /// True for the tape that computes the hoisted numbers.
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

    /// Finds the shared registers that the tape needs.
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
            // A result is used to the end.
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

    /// Counts the uses of each node.
    fn count(&mut self, root: Id) {
        let mut stack = vec![root];
        while let Some(id) = stack.pop() {
            let uses = self.uses.entry(id).or_insert(0);
            *uses += 1;
            let first = *uses == 1;
            let leaf = matches!(self.home(id), Ok(Some(_)));
            if !first || leaf {
                continue;
            }
            if let Op::Solution(block, _) = self.graph.op(id) {
                if self.solved.contains(&block) {
                    continue;
                }
                self.solved.push(block);
            }
            stack.extend(self.graph.operands(id));
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

    /// Removes one use of a node; after the last use its register is free.
    fn release(&mut self, id: Id) {
        let uses = self.uses.get_mut(&id).expect("every use was counted");
        *uses -= 1;
        let last = *uses == 0;
        let leaf = matches!(self.home(id), Ok(Some(_))) || matches!(self.graph.op(id), Op::Solution(..));
        if last && !leaf {
            self.free.extend(self.done.get(&id));
        }
    }

    /// Returns the factors of a product that is used once only and needs no register of its own.
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

    /// Returns the register of a node, if already assigned.
    fn register(&mut self, id: Id) -> Result<Option<Register>, TooLarge> {
        Ok(self.home(id)?.or_else(|| self.done.get(&id).copied()))
    }

    /// Computes a node; each user of the register releases it.
    ///
    /// Operands are computed first, with an explicit stack: a sum is nested as deep as it is long.
    fn emit(&mut self, id: Id) -> Result<Register, TooLarge> {
        let mut stack = vec![(id, self.needs(id).into_iter())];
        while let Some((top, needs)) = stack.last_mut() {
            let top = *top;
            if self.register(top)?.is_some() {
                stack.pop();
                continue;
            }
            match needs.next() {
                Some(need) => stack.push((need, self.needs(need).into_iter())),
                None => {
                    stack.pop();
                    if stack.is_empty() {
                        return self.make(top);
                    }
                    self.make(top)?;
                }
            }
        }
        Ok(self.register(id)?.expect("it had one before"))
    }

    /// Returns the nodes whose registers the instruction of a node reads, in order of computation. A node with a
    /// register needs none, and the tape has no uses of its operands.
    fn needs(&mut self, id: Id) -> Vec<Id> {
        if matches!(self.register(id), Ok(Some(_)) | Err(_)) {
            return Vec::new();
        }
        match self.graph.op(id) {
            Op::Add(a, b) | Op::Sub(a, b) => match (self.product(a), self.product(b)) {
                (Some(a), Some(b)) => [a, b].concat(),
                (Some([p, q]), None) => vec![p, q, b],
                (None, Some([p, q])) => vec![p, q, a],
                (None, None) => vec![a, b],
            },
            Op::Mul(_, b) if self.is_minus(id) => vec![b],
            _ => self.graph.operands(id),
        }
    }

    /// Computes a node from its operands.
    fn make(&mut self, id: Id) -> Result<Register, TooLarge> {
        use Instruction as I;
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
                // The factor -1 is counted as a use, but needs no register.
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

    /// Computes the operands, then adds the instruction.
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

    /// Computes a function; sine and cosine of the same angle are computed together.
    fn function(&mut self, function: Function, a: Id) -> Result<Register, TooLarge> {
        use Instruction as I;
        let other = match function {
            Function::Sin => Some(Function::Cos),
            Function::Cos => Some(Function::Sin),
            _ => None,
        };
        let other = other.and_then(|other| self.graph.find(Op::Function(other, a)));
        let other = other.filter(|id| self.uses.contains_key(id));
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

    /// Returns an unknown of a block, which is solved on first use; its registers are not reused.
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
