//! Functions of expressions in the graph; at a kink or a jump, a switch selects the branch.

use mops_core::StudyError;
use mops_language::expression::{Comparison, Form, Function, Node};

use super::definition::{Text, under};
use super::graph::{Id, Level, Op};
use super::lower::{Kinks, Lowering, Order, Selection, Switch};

impl Lowering<'_> {
    pub(super) fn call(
        &mut self,
        text: &Text,
        function: Function,
        arguments: &[Node],
        kinks: Kinks,
    ) -> Result<Id, StudyError> {
        let inner = match function {
            Function::Sqrt | Function::Ln | Function::Log10 | Function::Asin | Function::Acos => kinks.inside(),
            _ => kinks,
        };
        if function == Function::Delay {
            return self.delayed(text, arguments);
        }
        if function == Function::If {
            return self.pieces(text, arguments, kinks);
        }
        let mut values = Vec::with_capacity(arguments.len());
        for argument in arguments {
            let affine = self.node(text, argument, inner)?;
            let place = format!("in `{}`", function.name());
            values.push(self.without_rates(text, &argument.span, affine, &place)?);
        }
        self.in_order(text, function, arguments, &values)?;
        let x = values[0];
        let one = self.graph.number(1.0);
        let zero = self.graph.number(0.0);
        Ok(match function {
            Function::Atan2 => self.graph.atan2(x, values[1]),
            Function::Abs => {
                let positive = self.at_least(x, zero, kinks);
                let minus = self.graph.negative(x);
                self.graph.choose(positive, x, minus)
            }
            Function::Sign if self.graph.level(x) < Level::Variable => {
                let minus = self.graph.number(-1.0);
                let (up, down) =
                    (self.graph.holds(Comparison::Greater, x, zero), self.graph.holds(Comparison::Less, x, zero));
                let below = self.graph.choose(down, minus, zero);
                self.graph.choose(up, one, below)
            }
            Function::Sign => {
                let minus = self.graph.number(-1.0);
                let positive = self.condition(Comparison::AtLeast, x, zero, true, kinks.of_jumps());
                self.graph.choose(positive, one, minus)
            }
            Function::Min | Function::Max => {
                let mut best = x;
                for &other in &values[1..] {
                    let (a, b) = if function == Function::Max { (best, other) } else { (other, best) };
                    let first = self.at_least(a, b, kinks);
                    best = self.select(text, function, first, [best, other]);
                }
                best
            }
            Function::Clip | Function::Deadzone => {
                let (low, high) = (values[1], values[2]);
                let (above, below) = (self.at_least(x, low, kinks), self.at_least(high, x, kinks));
                if function == Function::Clip {
                    let upper = self.select(text, function, below, [x, high]);
                    return Ok(self.select(text, function, above, [upper, low]));
                }
                // A dead zone is no limit.
                let (over, under) = (self.graph.sub(x, high), self.graph.sub(x, low));
                let upper = self.graph.choose(below, zero, over);
                self.graph.choose(above, upper, under)
            }
            Function::Table => self.table(text, x, &values[1..], kinks),
            smooth => self.graph.function(smooth, x),
        })
    }

    /// Checks that limits and the x values of a table increase. Numbers and constants out of order are an error. Those
    /// that depend on parameters are checked at the start of a simulation.
    fn in_order(&mut self, text: &Text, function: Function, nodes: &[Node], values: &[Id]) -> Result<(), StudyError> {
        let (places, strict): (Vec<usize>, bool) = match function {
            Function::Clip | Function::Deadzone => (vec![1, 2], false),
            Function::Table => ((1..values.len()).step_by(2).collect(), true),
            _ => return Ok(()),
        };
        let what = if strict { "the x values" } else { "the limits" };
        for pair in places.windows(2) {
            let (low, high) = (values[pair[0]], values[pair[1]]);
            let wrong = |low: f64, high: f64| low > high || strict && low == high;
            match (self.graph.constant(low), self.graph.constant(high)) {
                (Some(a), Some(b)) if wrong(a, b) => {
                    let fact = format!("{what} of `{}` must increase, found {b} after {a}", function.name());
                    let mistake = StudyError::here(fact).with_help("write the smaller value first");
                    return Err(under(&text.path, mistake.at(nodes[pair[1]].span.clone())));
                }
                (Some(_), Some(_)) => {}
                _ if self.graph.level(low).max(self.graph.level(high)) < Level::Variable => {
                    let place = text.path.join(".");
                    let what = format!("{what} of `{}` in {place}", function.name());
                    self.orders.push(Order { low, high, strict, what });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds `table(x, x1, y1, ..)`: segments are selected from the left.
    fn table(&mut self, text: &Text, x: Id, points: &[Id], kinks: Kinks) -> Id {
        let lines = points.len() / 2 - 1;
        let mut value = None;
        let mut was_flat = false;
        for k in (0..lines).rev() {
            let [x1, y1, x2, y2] = [points[2 * k], points[2 * k + 1], points[2 * k + 2], points[2 * k + 3]];
            let (rise, run) = (self.graph.sub(y2, y1), self.graph.sub(x2, x1));
            let slope = self.graph.div(rise, run);
            let (step, offset) = (self.graph.mul(slope, x), self.graph.mul(slope, x1));
            let level = self.graph.sub(y1, offset);
            let line = self.graph.add(step, level);
            value = Some(match value {
                None => line,
                Some(further) => {
                    let here = self.at_least(x2, x, kinks);
                    // Only a segment without slope opens a loop.
                    match was_flat || self.graph.is(slope, 0.0) {
                        true => self.select(text, Function::Table, here, [line, further]),
                        false => self.graph.choose(here, line, further),
                    }
                }
            });
            was_flat = self.graph.is(slope, 0.0);
        }
        value.expect("the parser requires two points")
    }

    /// Adds `if(condition, a, .., otherwise)`.
    fn pieces(&mut self, text: &Text, arguments: &[Node], kinks: Kinks) -> Result<Id, StudyError> {
        let branch = |lowering: &mut Self, node: &Node| {
            let affine = lowering.node(text, node, kinks)?;
            lowering.without_rates(text, &node.span, affine, "in `if`")
        };
        let (otherwise, pairs) = arguments.split_last().expect("the parser requires three arguments");
        let mut value = branch(self, otherwise)?;
        for pair in pairs.chunks_exact(2).rev() {
            let here = branch(self, &pair[1])?;
            value = self.decide(text, &pair[0], [here, value], kinks.of_jumps())?;
        }
        Ok(value)
    }

    /// Adds a selection: `a` if the condition is true, else `b`.
    fn decide(&mut self, text: &Text, condition: &Node, [a, b]: [Id; 2], kinks: Kinks) -> Result<Id, StudyError> {
        match &condition.form {
            Form::Compare(comparison, left, right) => {
                let mut side = |node: &Node| {
                    let affine = self.node(text, node, kinks)?;
                    self.without_rates(text, &node.span, affine, "in a condition")
                };
                let (left, right) = (side(left)?, side(right)?);
                let condition = self.condition(*comparison, left, right, true, kinks);
                Ok(self.select(text, Function::If, condition, [a, b]))
            }
            Form::All(conditions) => conditions.iter().rev().try_fold(a, |a, of| self.decide(text, of, [a, b], kinks)),
            Form::Any(conditions) => conditions.iter().rev().try_fold(b, |b, of| self.decide(text, of, [a, b], kinks)),
            Form::Not(inner) => self.decide(text, inner, [b, a], kinks),
            _ => unreachable!("the parser requires a condition"),
        }
    }

    /// Adds a selection of a function: `a` if `condition` is positive, else `b`. One that varies is noted, as it may
    /// open a loop.
    fn select(&mut self, text: &Text, function: Function, condition: Id, [a, b]: [Id; 2]) -> Id {
        let taken = self.graph.choose(condition, a, b);
        if self.graph.level(condition) == Level::Variable && a != b {
            let other = self.graph.choose(condition, b, a);
            let what = format!("`{}` in {}", function.name(), text.path.join("."));
            self.selections.push(Selection { taken, other, what });
        }
        taken
    }

    /// Adds the kink at which `a` and `b` meet: positive if `a >= b`.
    fn at_least(&mut self, a: Id, b: Id, kinks: Kinks) -> Id {
        self.condition(Comparison::AtLeast, a, b, false, kinks)
    }

    /// Adds a node that is positive if the condition is true: the mode of a switch, unless the condition depends on
    /// parameters only.
    fn condition(&mut self, comparison: Comparison, a: Id, b: Id, jumps: bool, kinks: Kinks) -> Id {
        if kinks == Kinks::Sampled || self.graph.level(a).max(self.graph.level(b)) < Level::Variable {
            return self.graph.holds(comparison, a, b);
        }
        let (left, right, strict) = match comparison {
            Comparison::Greater => (a, b, true),
            Comparison::AtLeast => (a, b, false),
            Comparison::Less => (b, a, true),
            Comparison::AtMost => (b, a, false),
        };
        let same = |s: &&mut Switch| s.left == left && s.right == right && (s.strict == strict || !jumps);
        let mode = match self.switches.iter_mut().find(same) {
            Some(switch) => {
                switch.jumps |= jumps;
                switch.mode
            }
            None => {
                let (mode, _) = self.mode();
                self.switches.push(Switch { mode, left, right, strict, jumps });
                mode
            }
        };
        match kinks {
            Kinks::ByMode => self.graph.add_op(Op::Mode(mode)),
            _ => self.graph.holds(comparison, a, b),
        }
    }
}
