//! Expression graph without repetition: constants folded, common subexpressions shared, products in canonical order.

use std::collections::HashMap;

use mops_language::expression::{Comparison, Function, functions};
use mops_math as math;

/// Index of a node of the graph; nodes come after their operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(u32);

impl Id {
    /// Returns the index of the node.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Operation of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Op {
    /// Number, by its bits.
    Constant(u64),
    /// Parameter of the model.
    Parameter(usize),
    /// State of the model.
    State(usize),
    /// Input of the model.
    Input(usize),
    /// Time, s.
    Time,
    /// Number that events change: 1 or 0 of a switch, or the direction of a contact.
    Mode(usize),
    /// Sum `a + b`.
    Add(Id, Id),
    /// Difference `a - b`.
    Sub(Id, Id),
    /// Product `a b`.
    Mul(Id, Id),
    /// Quotient `a / b`.
    Div(Id, Id),
    /// Power `a^b`.
    Power(Id, Id),
    /// Smooth function of one argument.
    Function(Function, Id),
    /// Angle of the point (second, first).
    Atan2(Id, Id),
    /// Comparison: 1 if it is true for the current values, else 0.
    Holds(Comparison, Id, Id),
    /// Selection: the second operand if the first is positive, else the third.
    Choose(Id, Id, Id),
    /// Unknown of a block of linear equations, by block and index.
    Solution(usize, usize),
}

/// Dependence of a node on quantities that vary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing: the node is a number.
    Constant,
    /// Parameters only: the node is evaluated once per simulation.
    Parameter,
    /// States, inputs, time or modes.
    Variable,
}

/// Block of linear equations, `matrix unknowns = right`.
#[derive(Debug, Clone)]
pub struct Block {
    /// Coefficients, row by row.
    pub matrix: Vec<Id>,
    /// Right-hand sides.
    pub right: Vec<Id>,
}

/// Limit on the number of factors up to which a nested product is expanded; a larger product remains a single factor. A
/// chain of `n` definitions that each square the previous one has `2^n` factors. Models written by hand do not reach
/// the limit.
const TAKEN_APART: usize = 1000;

/// Expression graph.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    nodes: Vec<(Op, Level)>,
    known: HashMap<Op, Id>,
    /// Last constant computed that is infinite or not a number, also one within a product.
    pub not_finite: Option<f64>,
    /// Blocks of linear equations.
    pub blocks: Vec<Block>,
}

impl Graph {
    /// Returns the operation of a node.
    pub fn op(&self, id: Id) -> Op {
        self.nodes[id.index()].0
    }

    /// Returns the dependence of a node.
    pub fn level(&self, id: Id) -> Level {
        self.nodes[id.index()].1
    }

    /// Returns the operands of a node.
    pub fn operands(&self, id: Id) -> Vec<Id> {
        match self.op(id) {
            Op::Constant(_) | Op::Parameter(_) | Op::State(_) | Op::Input(_) | Op::Time | Op::Mode(_) => Vec::new(),
            Op::Function(_, a) => vec![a],
            Op::Add(a, b) | Op::Sub(a, b) | Op::Mul(a, b) | Op::Div(a, b) | Op::Power(a, b) => vec![a, b],
            Op::Atan2(a, b) | Op::Holds(_, a, b) => vec![a, b],
            Op::Choose(a, b, c) => vec![a, b, c],
            Op::Solution(block, _) => {
                self.blocks[block].matrix.iter().chain(&self.blocks[block].right).copied().collect()
            }
        }
    }

    /// Returns the value of a node that is a number.
    pub fn constant(&self, id: Id) -> Option<f64> {
        if let Op::Constant(bits) = self.op(id) { Some(f64::from_bits(bits)) } else { None }
    }

    /// Returns true if the node is this number.
    pub fn is(&self, id: Id, number: f64) -> bool {
        self.constant(id) == Some(number)
    }

    /// Adds a node without simplification.
    pub fn add_op(&mut self, op: Op) -> Id {
        if let Some(&id) = self.known.get(&op) {
            return id;
        }
        let level = match op {
            Op::Constant(_) => Level::Constant,
            Op::Parameter(_) => Level::Parameter,
            Op::State(_) | Op::Input(_) | Op::Time | Op::Mode(_) | Op::Solution(..) => Level::Variable,
            _ => Level::Constant,
        };
        let id = Id(u32::try_from(self.nodes.len()).expect("a model has fewer nodes"));
        self.nodes.push((op, level));
        let below = self.operands(id).into_iter().map(|o| self.level(o)).max().unwrap_or(level);
        self.nodes[id.index()].1 = level.max(below);
        self.known.insert(op, id);
        id
    }

    /// Adds a number.
    pub fn number(&mut self, value: f64) -> Id {
        // -0.0 and 0.0 are the same number here.
        self.not_finite = if value.is_finite() { self.not_finite } else { Some(value) };
        self.add_op(Op::Constant((value + 0.0).to_bits()))
    }

    fn fold(&mut self, a: Id, b: Id, f: impl Fn(f64, f64) -> f64) -> Option<Id> {
        let value = f(self.constant(a)?, self.constant(b)?);
        Some(self.number(value))
    }

    /// Adds the sum `a + b`.
    pub fn add(&mut self, a: Id, b: Id) -> Id {
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        match (self.negated(a), self.negated(b)) {
            (_, Some(b)) => self.sub(a, b),
            (Some(a), None) => self.sub(b, a),
            _ => self.fold(a, b, |a, b| a + b).unwrap_or_else(|| self.add_op(Op::Add(a, b))),
        }
    }

    /// Adds the difference `a - b`.
    pub fn sub(&mut self, a: Id, b: Id) -> Id {
        if self.is(b, 0.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return self.negative(b);
        }
        if a == b {
            return self.number(0.0);
        }
        // Offsets of temperature scales cancel exactly, without rounding.
        if let Op::Add(x, p) = self.op(a)
            && p == b
            && self.constant(p).is_some()
        {
            return x;
        }
        if let (Op::Add(x, p), Op::Add(y, q)) = (self.op(a), self.op(b))
            && p == q
            && self.constant(p).is_some()
        {
            return self.sub(x, y);
        }
        match self.negated(b) {
            Some(b) => self.add(a, b),
            None => self.fold(a, b, |a, b| a - b).unwrap_or_else(|| self.add_op(Op::Sub(a, b))),
        }
    }

    /// Returns `x` if the node is `-x`.
    fn negated(&mut self, id: Id) -> Option<Id> {
        match self.op(id) {
            Op::Mul(minus, x) if self.is(minus, -1.0) => Some(x),
            _ => None,
        }
    }

    /// Adds the negative `-a`.
    pub fn negative(&mut self, a: Id) -> Id {
        if let Op::Sub(x, y) = self.op(a) {
            return self.sub(y, x);
        }
        let minus = self.number(-1.0);
        self.mul(minus, a)
    }

    /// Adds the product `a b`, ordered by [`Graph::product`].
    pub fn mul(&mut self, a: Id, b: Id) -> Id {
        self.product(a, &[b])
    }

    /// Adds the product of all factors. Factors that depend on parameters only are combined. The others are put in a
    /// fixed order, the newest nodes first, so that products share common parts.
    pub fn product(&mut self, first: Id, rest: &[Id]) -> Id {
        let factors: Vec<Id> = std::iter::once(&first).chain(rest).flat_map(|&id| self.factors(id)).collect();
        let (mut variable, fixed): (Vec<Id>, Vec<Id>) =
            factors.into_iter().partition(|&f| self.level(f) == Level::Variable);
        let (numbers, mut fixed): (Vec<Id>, Vec<Id>) =
            fixed.into_iter().partition(|&f| self.level(f) == Level::Constant);
        let number: f64 = numbers.iter().filter_map(|&n| self.constant(n)).product();
        if number == 0.0 {
            return self.number(0.0);
        }
        fixed.sort_unstable();
        variable.sort_unstable_by(|a, b| b.cmp(a));
        let product = |graph: &mut Self, list: Vec<Id>| list.into_iter().reduce(|a, b| graph.add_op(Op::Mul(a, b)));
        let number = (number != 1.0).then(|| self.number(number));
        let fixed = product(self, fixed);
        let fixed = product(self, number.into_iter().chain(fixed).collect());
        let variable = product(self, variable);
        product(self, fixed.into_iter().chain(variable).collect()).unwrap_or_else(|| self.number(1.0))
    }

    /// Adds the product `a b` without expanding factors: a factor that is evaluated anyway is kept.
    pub fn times(&mut self, a: Id, b: Id) -> Id {
        if self.constant(a).or(self.constant(b)).is_some() { self.mul(a, b) } else { self.add_op(Op::Mul(a, b)) }
    }

    /// Returns the factors of a product, in order. A node that is no product, or has too many factors, is its only
    /// factor.
    fn factors(&self, product: Id) -> Vec<Id> {
        let (mut found, mut stack) = (Vec::new(), vec![product]);
        while let Some(id) = stack.pop() {
            match self.op(id) {
                Op::Mul(..) if found.len() + stack.len() > TAKEN_APART => return vec![product],
                Op::Mul(a, b) => stack.extend([b, a]),
                _ => found.push(id),
            }
        }
        found
    }

    /// Returns the node with this operation, if there is one.
    pub fn find(&self, op: Op) -> Option<Id> {
        self.known.get(&op).copied()
    }

    /// Adds the quotient `a / b`. Division by a number or a parameter becomes a product with the inverse, which is
    /// evaluated once.
    pub fn div(&mut self, a: Id, b: Id) -> Id {
        if self.is(b, 1.0) {
            return a;
        }
        // A conversion to coherent units that is undone here cancels exactly.
        if let Op::Mul(factor, x) = self.op(a)
            && factor == b
            && self.constant(b).is_some_and(|b| b != 0.0)
        {
            return x;
        }
        let (up, down) = (self.level(a), self.level(b));
        if up == Level::Variable && down < Level::Variable {
            let one = self.number(1.0);
            let inverse = self.div(one, b);
            return self.mul(a, inverse);
        }
        self.fold(a, b, |a, b| a / b).unwrap_or_else(|| self.add_op(Op::Div(a, b)))
    }

    /// Adds the power `a^b`; small integer powers become products.
    pub fn power(&mut self, a: Id, b: Id) -> Id {
        let one = self.number(1.0);
        match self.constant(b) {
            Some(exponent) if exponent.fract() == 0.0 && exponent.abs() <= 4.0 => {
                let times = |graph: &mut Self, count: i32| (0..count).fold(one, |product, _| graph.mul(product, a));
                #[allow(clippy::cast_possible_truncation)]
                let product = times(self, exponent.abs() as i32);
                if exponent < 0.0 { self.div(one, product) } else { product }
            }
            Some(0.5) => self.function(Function::Sqrt, a),
            _ => self.fold(a, b, functions::power).unwrap_or_else(|| self.add_op(Op::Power(a, b))),
        }
    }

    /// Adds a smooth function of one argument.
    pub fn function(&mut self, function: Function, a: Id) -> Id {
        match (function, self.constant(a)) {
            (_, Some(value)) => self.number(function.evaluate(&[value])),
            (Function::Tan, None) => {
                let (sin, cos) = (self.function(Function::Sin, a), self.function(Function::Cos, a));
                self.div(sin, cos)
            }
            _ => self.add_op(Op::Function(function, a)),
        }
    }

    /// Adds the angle of the point (second, first).
    pub fn atan2(&mut self, a: Id, b: Id) -> Id {
        self.fold(a, b, math::atan2).unwrap_or_else(|| self.add_op(Op::Atan2(a, b)))
    }

    /// Adds a comparison: 1 if it is true, else 0.
    pub fn holds(&mut self, comparison: Comparison, a: Id, b: Id) -> Id {
        let folded = self.fold(a, b, |a, b| f64::from(u8::from(comparison.holds(a, b))));
        folded.unwrap_or_else(|| self.add_op(Op::Holds(comparison, a, b)))
    }

    /// Adds a selection: `a` if `condition` is positive, else `b`.
    pub fn choose(&mut self, condition: Id, a: Id, b: Id) -> Id {
        match self.constant(condition) {
            _ if a == b => a,
            Some(value) => {
                if value > 0.0 {
                    a
                } else {
                    b
                }
            }
            None => self.add_op(Op::Choose(condition, a, b)),
        }
    }

    /// Returns the states that a node depends on, in order.
    pub fn states_of(&self, id: Id) -> Vec<usize> {
        let below = self.below(id);
        let nodes = self.nodes.iter().zip(below).filter(|(_, below)| *below);
        let states = nodes.filter_map(|((op, _), _)| if let Op::State(state) = op { Some(*state) } else { None });
        states.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
    }

    /// Returns true for each node that a node depends on, itself included.
    pub fn below(&self, id: Id) -> Vec<bool> {
        let mut seen = vec![false; self.nodes.len()];
        let mut stack = vec![id];
        while let Some(id) = stack.pop() {
            if !std::mem::replace(&mut seen[id.index()], true) {
                stack.extend(self.operands(id));
            }
        }
        seen
    }
}
