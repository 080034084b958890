//! From expressions to the graph: resolves names, separates derivatives, and turns kinks and jumps into switches.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use mops_core::StudyError;
use mops_language::{
    Unit,
    expression::{Form, Node, Operator},
    suggestion,
};

use super::definition::{Declared, Definition, Text, under};
use super::graph::{Graph, Id, Level, Op};
use super::key::member;

/// Value of an expression, affine in the derivatives: `rest + sum over states of rate * x'`.
#[derive(Debug, Clone)]
pub struct Affine {
    /// Part without derivatives.
    pub rest: Id,
    /// Coefficients of the derivatives.
    pub rates: BTreeMap<usize, Id>,
}

impl Affine {
    fn of(rest: Id) -> Self {
        Self { rest, rates: BTreeMap::new() }
    }
}

/// Condition that selects a branch, and its mode.
#[derive(Debug, Clone, Copy)]
pub struct Switch {
    /// Mode, 1 while the condition is true.
    pub mode: usize,
    /// Left side of the condition `left > right` or `left >= right`.
    pub left: Id,
    /// Right side of the condition.
    pub right: Id,
    /// True if equality does not satisfy the condition.
    pub strict: bool,
    /// True if the branches differ where they meet.
    pub jumps: bool,
}

/// Pair of arguments that must increase and depend on parameters.
#[derive(Debug, Clone)]
pub struct Order {
    /// Argument that must be smaller.
    pub low: Id,
    /// Argument that must be larger.
    pub high: Id,
    /// True if the arguments must differ.
    pub strict: bool,
    /// Description of the arguments, for a message.
    pub what: String,
}

/// Value that a condition selects.
#[derive(Debug, Clone)]
pub struct Selection {
    /// Value that acts.
    pub taken: Id,
    /// Value that acts where the condition does not hold.
    pub other: Id,
    /// Place, for a message.
    pub what: String,
}

/// Delayed quantity.
#[derive(Debug, Clone)]
pub struct Delayed {
    /// Text that contains it.
    pub text: Text,
    /// Expression of the quantity.
    pub of: Node,
    /// Delay, s.
    pub time: Id,
}

/// Limit on the nesting depth of definitions: each level uses the call stack.
const DEEPEST: usize = 200;

/// Limit on the nesting depth of functions, powers and sums, over all definitions involved. Each level takes some 2 kB
/// of the call stack; a thread has 2 MB.
const DEEPEST_NODE: usize = 600;

#[derive(Debug, Clone, Copy)]
enum Meaning {
    State(usize),
    Input(usize),
    Parameter(usize),
    Constant(f64),
    Let(usize),
}

/// Evaluation of kinks: by their mode, so that a step sees one smooth branch, or as they stand, by the current values.
/// The second applies inside roots, logarithms, powers and divisors, whose branches do not extend beyond the kink:
/// `sqrt(max(h, 0))`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Kinks {
    ByMode,
    AsTheyStand,
    /// Kinks and jumps by the current values, without events: the expression is evaluated at the instants of a clock
    /// only.
    Sampled,
}

impl Kinks {
    /// Returns the evaluation of kinks inside roots, powers and divisors.
    pub fn inside(self) -> Self {
        if self == Self::Sampled { Self::Sampled } else { Self::AsTheyStand }
    }

    /// Returns the evaluation of jumps.
    pub fn of_jumps(self) -> Self {
        if self == Self::Sampled { Self::Sampled } else { Self::ByMode }
    }
}

#[derive(Debug, Clone)]
enum Visit {
    Open,
    Done(Affine),
}

/// Builder of the graph of a definition.
pub struct Lowering<'d> {
    definition: &'d Definition,
    names: HashMap<&'d str, Meaning>,
    lets: HashMap<(usize, Kinks), Visit>,
    /// Graph so far.
    pub graph: Graph,
    /// Switches so far.
    pub switches: Vec<Switch>,
    /// Arguments that must increase, so far.
    pub orders: Vec<Order>,
    /// Values that conditions select.
    pub selections: Vec<Selection>,
    /// Delayed quantities so far.
    pub delays: Vec<Delayed>,
    /// Number of external forces, which are inputs after the declared ones.
    forces: usize,
    /// Number of modes so far.
    pub modes: usize,
    /// Nesting depth of the current node, over all definitions.
    depth: usize,
}

impl<'d> Lowering<'d> {
    /// Collects all names, for a model with this number of external forces.
    ///
    /// # Errors
    /// Duplicate names.
    pub fn new(definition: &'d Definition, forces: usize) -> Result<Self, StudyError> {
        let d = definition;
        let mut names: HashMap<&str, (Meaning, &str)> = HashMap::new();
        let states = d.states.iter().enumerate().map(|(i, q)| (&q.name, Meaning::State(i), "a state", &q.path));
        let inputs = d.inputs.iter().enumerate().map(|(i, q)| (&q.name, Meaning::Input(i), "an input", &q.path));
        let parameters = d.parameters.iter().enumerate();
        let parameters =
            parameters.map(|(i, p)| (&p.quantity.name, Meaning::Parameter(i), "a parameter", &p.quantity.path));
        let constants = d.constants.iter().map(|c| (&c.name, Meaning::Constant(c.value), "a constant", &c.path));
        let lets =
            d.lets.iter().enumerate().map(|(i, (name, text))| (name, Meaning::Let(i), "a definition", &text.path));
        for (name, meaning, what, path) in states.chain(inputs).chain(parameters).chain(constants).chain(lets) {
            if let Some((_, first)) = names.insert(name, (meaning, what)) {
                let fact = if first == what {
                    format!("declared twice as {what}")
                } else {
                    format!("both {first} and {what}")
                };
                return Err(under(
                    path,
                    StudyError::here(format!("`{name}` is {fact}")).with_help("choose another name"),
                ));
            }
        }
        for (output, _) in &d.outputs {
            if let Some((Meaning::State(_) | Meaning::Input(_), what)) = names.get(output.name.as_str()) {
                return Err(under(
                    &output.path,
                    StudyError::here(format!("`{}` is both {what} and an output", output.name)),
                )
                .with_help("states and inputs are signals already"));
            }
        }
        Ok(Self {
            definition,
            names: names.into_iter().map(|(name, (meaning, _))| (name, meaning)).collect(),
            lets: HashMap::new(),
            graph: Graph::default(),
            switches: Vec::new(),
            orders: Vec::new(),
            selections: Vec::new(),
            delays: Vec::new(),
            forces,
            modes: 0,
            depth: 0,
        })
    }

    /// Converts a quantity from its declared unit to the coherent unit.
    pub fn coherent(&mut self, declared: Id, unit: &Unit) -> Id {
        let (factor, zero) = (self.graph.number(unit.factor()), self.graph.number(unit.zero()));
        let scaled = self.graph.mul(declared, factor);
        self.graph.add(scaled, zero)
    }

    /// Converts a quantity from the coherent unit to its declared unit.
    pub fn declared(&mut self, coherent: Id, unit: &Unit) -> Id {
        let (factor, zero) = (self.graph.number(unit.factor()), self.graph.number(unit.zero()));
        let from_zero = self.graph.sub(coherent, zero);
        self.graph.div(from_zero, factor)
    }

    /// Adds a mode.
    pub fn mode(&mut self) -> (usize, Id) {
        self.modes += 1;
        (self.modes - 1, self.graph.add_op(Op::Mode(self.modes - 1)))
    }

    /// Lowers an expression, or the difference `left - right` of the sides of an equation, with the derivatives on the
    /// left.
    pub fn text(&mut self, text: &Text) -> Result<Affine, StudyError> {
        let right = self.node(text, &text.equation.right, Kinks::ByMode)?;
        let Some(left) = &text.equation.left else { return Ok(right) };
        let left = self.node(text, left, Kinks::ByMode)?;
        let (a, b) = if left.rates.is_empty() { (right, left) } else { (left, right) };
        Ok(self.sum(a, b, -1.0))
    }

    /// Lowers an expression that is evaluated at the instants of a clock only.
    pub fn sampled(&mut self, text: &Text) -> Result<Affine, StudyError> {
        self.node(text, &text.equation.right, Kinks::Sampled)
    }

    /// Lowers the expression of a delayed quantity.
    pub fn past(&mut self, delay: usize) -> Result<Affine, StudyError> {
        let Delayed { text, of, .. } = self.delays[delay].clone();
        self.node(&text, &of, Kinks::ByMode)
    }

    /// Lowers an expression without derivatives.
    pub fn value(&mut self, text: &Text) -> Result<Id, StudyError> {
        let affine = self.text(text)?;
        self.without_rates(text, &text.equation.right.span, affine, "here")
    }

    /// Lowers an expression of parameters only; `what` describes its value in a message.
    pub fn fixed(&mut self, text: &Text, what: &str) -> Result<Id, StudyError> {
        let value = self.value(text)?;
        if self.graph.level(value) < Level::Variable {
            return Ok(value);
        }
        let mut variable = None;
        text.equation.right.walk(&mut |node| {
            if let Form::Name(name) = &node.form
                && matches!(
                    self.names.get(name.as_str()),
                    Some(Meaning::State(_) | Meaning::Input(_) | Meaning::Let(_)) | None
                )
            {
                variable = variable.take().or(Some(node.span.clone()));
            }
        });
        let span = variable.unwrap_or_else(|| text.equation.right.span.clone());
        Err(under(
            &text.path,
            StudyError::here(format!("{what} may depend on parameters and constants only"))
                .with_help("states, inputs and time change during a simulation")
                .at(span),
        ))
    }

    pub(super) fn without_rates(
        &self,
        text: &Text,
        span: &Range<usize>,
        affine: Affine,
        place: &str,
    ) -> Result<Id, StudyError> {
        if affine.rates.is_empty() {
            return Ok(affine.rest);
        }
        Err(under(
            &text.path,
            StudyError::here(format!("a derivative is not allowed {place}"))
                .with_help("equations must be linear in the derivatives; rewrite the expression without them")
                .at(span.clone()),
        ))
    }

    /// Lowers a delayed quantity: an input after the declared ones and the forces. Its expression is lowered later, so
    /// that it may depend on itself.
    pub(super) fn delayed(&mut self, text: &Text, arguments: &[Node]) -> Result<Id, StudyError> {
        let [of, time] = arguments else { unreachable!("the parser requires two arguments") };
        let is_same = |delayed: &Delayed| {
            delayed.of.span == of.span && delayed.text.path == text.path && delayed.text.index == text.index
        };
        let known = self.delays.iter().position(is_same);
        let index = known.map_or_else(
            || {
                let affine = self.node(text, time, Kinks::AsTheyStand)?;
                let id = self.without_rates(text, &time.span, affine, "in the time of a `delay`")?;
                if self.graph.level(id) == Level::Variable {
                    let mistake = StudyError::here("the time of a `delay` must not change during a simulation")
                        .with_help("give a time such as \"50 ms\", or an expression of parameters and constants");
                    return Err(under(&text.path, mistake.at(time.span.clone())));
                }
                if let Some(seconds) = self.graph.constant(id).filter(|seconds| *seconds <= 0.0) {
                    let mistake = StudyError::here(format!("expected a positive time, found {seconds} s"));
                    return Err(under(&text.path, mistake.with_help("without a delay, write the quantity alone"))
                        .at(time.span.clone()));
                }
                self.delays.push(Delayed { text: text.clone(), of: of.clone(), time: id });
                Ok(self.delays.len() - 1)
            },
            Ok,
        )?;
        Ok(self.graph.add_op(Op::Input(self.definition.inputs.len() + self.forces + index)))
    }

    fn sum(&mut self, a: Affine, b: Affine, sign: f64) -> Affine {
        let add = |graph: &mut Graph, a, b| if sign > 0.0 { graph.add(a, b) } else { graph.sub(a, b) };
        let rest = add(&mut self.graph, a.rest, b.rest);
        let mut rates = a.rates;
        for (state, factor) in b.rates {
            let before = rates.get(&state).copied().unwrap_or_else(|| self.graph.number(0.0));
            rates.insert(state, add(&mut self.graph, before, factor));
        }
        Affine { rest, rates }
    }

    fn scaled(&mut self, a: Affine, f: impl Fn(&mut Graph, Id) -> Id) -> Affine {
        let rest = f(&mut self.graph, a.rest);
        Affine { rest, rates: a.rates.into_iter().map(|(state, rate)| (state, f(&mut self.graph, rate))).collect() }
    }

    pub(super) fn node(&mut self, text: &Text, node: &Node, kinks: Kinks) -> Result<Affine, StudyError> {
        if self.depth == DEEPEST_NODE {
            let fact = format!("expressions are nested more than {DEEPEST_NODE} deep, including their definitions");
            let mistake = StudyError::here(fact).with_help("split them into parts with less nesting");
            return Err(under(&text.path, mistake.at(node.span.clone())));
        }
        self.depth += 1;
        let found = self.form(text, node, kinks);
        self.depth -= 1;
        let found = found?;
        match self.graph.not_finite.take() {
            None => Ok(found),
            Some(value) => {
                let what = if value.is_nan() { "not a number" } else { "infinite" };
                let mistake = StudyError::here(format!("a constant in this expression is {what}"));
                let mistake =
                    mistake.with_help("correct it; its value does not depend on the state, the time or a parameter");
                Err(under(&text.path, mistake.at(node.span.clone())))
            }
        }
    }

    fn form(&mut self, text: &Text, node: &Node, kinks: Kinks) -> Result<Affine, StudyError> {
        let wrong = |fact: String, help: String| {
            Err(under(&text.path, StudyError::here(fact).with_help(help).at(node.span.clone())))
        };
        Ok(match &node.form {
            Form::Number(value) => Affine::of(self.graph.number(*value)),
            Form::Quantity(value, unit) => Affine::of(self.graph.number(value * unit.factor() + unit.zero())),
            Form::Name(name) => match &text.index {
                Some((index, k)) if index == name => {
                    #[allow(clippy::cast_precision_loss)]
                    let k = *k as f64;
                    Affine::of(self.graph.number(k))
                }
                _ => self.quantity(text, node, name, kinks)?,
            },
            Form::Member(name, index) => {
                let full = member(name, self.index(text, index)?);
                self.quantity(text, node, &full, kinks)?
            }
            Form::Rate(of) => {
                let name = match &of.form {
                    Form::Name(name) => name.clone(),
                    Form::Member(name, index) => member(name, self.index(text, index)?),
                    _ => unreachable!("the parser accepts derivatives of names only"),
                };
                let states = || self.definition.states.iter().map(|s| s.name.as_str());
                let Some(state) = states().position(|state| state == name) else {
                    return wrong(
                        format!("`{name}` has no derivative because it is not a state"),
                        suggestion(&name, states()),
                    );
                };
                if self.definition.is_memory(state) {
                    let help = "it changes at the instants of the clock only".to_owned();
                    return wrong(format!("`{name}` has no derivative because it is the memory of a clock"), help);
                }
                // This factor converts the rate of a state from its declared unit to coherent units.
                let factor = self.definition.states[state].unit.factor();
                Affine { rest: self.graph.number(0.0), rates: BTreeMap::from([(state, self.graph.number(factor))]) }
            }
            Form::Negative(a) => {
                let a = self.node(text, a, kinks)?;
                self.scaled(a, Graph::negative)
            }
            Form::Chain(first, rest) => self.chain(text, first, rest, kinks)?,
            Form::Power(a, b) => self.power(text, [a, b], kinks)?,
            Form::Call(function, arguments) => Affine::of(self.call(text, *function, arguments, kinks)?),
            Form::Compare(..) | Form::All(_) | Form::Any(_) | Form::Not(_) => {
                unreachable!("the parser accepts conditions in `if` only")
            }
            Form::Reduced(..) => unreachable!("the parser accepts reductions in criteria only"),
            Form::Lookup(..) => unreachable!("lookups are replaced when the definition is read"),
        })
    }

    /// Lowers a sum or a product, from left to right. Factors are collected and multiplied at once, with one node of
    /// the graph for each. If multiplied one by one, the factors of every product would be sorted again.
    fn chain(
        &mut self,
        text: &Text,
        first: &Node,
        rest: &[(Operator, Node)],
        kinks: Kinks,
    ) -> Result<Affine, StudyError> {
        let mut result = self.node(text, first, kinks)?;
        let mut read = first.span.clone();
        let mut factors: Vec<Id> = Vec::new();
        let mut varies = self.varies(&result);
        for (operator, node) in rest {
            let kinks = if *operator == Operator::Divide { kinks.inside() } else { kinks };
            let operand = self.node(text, node, kinks)?;
            match operator {
                Operator::Add => result = self.sum(result, operand, 1.0),
                Operator::Subtract => result = self.sum(result, operand, -1.0),
                Operator::Multiply => {
                    varies |= self.varies(&operand);
                    if operand.rates.is_empty() {
                        factors.push(operand.rest);
                    } else {
                        factors.push(self.without_rates(text, &read, result, "in both factors of a product")?);
                        result = operand;
                    }
                }
                Operator::Divide => {
                    let fixed = !self.varies(&operand);
                    let divisor = self.without_rates(text, &node.span, operand, "in a divisor")?;
                    if varies && fixed {
                        let one = self.graph.number(1.0);
                        factors.push(self.graph.div(one, divisor));
                    } else {
                        result = self.product(result, std::mem::take(&mut factors));
                        result = self.scaled(result, |graph, x| graph.div(x, divisor));
                        varies = self.varies(&result);
                    }
                }
            }
            read.end = node.span.end;
        }
        Ok(self.product(result, factors))
    }

    fn product(&mut self, of: Affine, factors: Vec<Id>) -> Affine {
        if factors.is_empty() { of } else { self.scaled(of, |graph, x| graph.product(x, &factors)) }
    }

    /// Returns true if the expression depends on more than parameters.
    fn varies(&self, affine: &Affine) -> bool {
        affine.rates.values().chain([&affine.rest]).any(|&id| self.graph.level(id) == Level::Variable)
    }

    fn power(&mut self, text: &Text, [a, b]: [&Node; 2], kinks: Kinks) -> Result<Affine, StudyError> {
        let exponent = self.node(text, b, kinks)?;
        let exponent = self.without_rates(text, &b.span, exponent, "in an exponent")?;
        let whole = self.graph.constant(exponent).is_some_and(|e| e.fract() == 0.0 && e > 0.0);
        let base = self.node(text, a, if whole { kinks } else { kinks.inside() })?;
        if self.graph.is(exponent, 1.0) {
            return Ok(base);
        }
        let base = self.without_rates(text, &a.span, base, "in a power")?;
        Ok(Affine::of(self.graph.power(base, exponent)))
    }

    fn index(&self, text: &Text, node: &Node) -> Result<i64, StudyError> {
        let mut unknown = None;
        let value = node.evaluate(&|name: &str| match (&text.index, self.names.get(name)) {
            #[allow(clippy::cast_precision_loss)]
            (Some((index, k)), _) if index == name => *k as f64,
            (_, Some(Meaning::Constant(value))) => *value,
            _ => f64::NAN,
        });
        node.walk(&mut |n| {
            if let Form::Name(name) = &n.form
                && text.index.as_ref().is_none_or(|(index, _)| index != name)
                && !matches!(self.names.get(name.as_str()), Some(Meaning::Constant(_)))
            {
                unknown = unknown.take().or(Some(name.clone()));
            }
        });
        #[allow(clippy::cast_possible_truncation)]
        match unknown {
            None if value.fract() == 0.0 && value.abs() < 1e9 => Ok(value as i64),
            None => Err(under(
                &text.path,
                StudyError::here(format!("expected an integer index, found {value}"))
                    .with_help("for example \"T[i]\" = \"T[i-1] - T[i]\"")
                    .at(node.span.clone()),
            )),
            Some(name) => Err(under(
                &text.path,
                StudyError::here(format!("expected an index of numbers and constants, found `{name}`"))
                    .with_help("the index of a family is declared in its key, for example \"T[i]\" = \"T[i-1] - T[i]\"")
                    .at(node.span.clone()),
            )),
        }
    }

    fn quantity(&mut self, text: &Text, node: &Node, name: &str, kinks: Kinks) -> Result<Affine, StudyError> {
        if name == "time" {
            return Ok(Affine::of(self.graph.add_op(Op::Time)));
        }
        let Some(meaning) = self.names.get(name) else {
            let mut known: Vec<&str> = self.names.keys().copied().filter(|name| !name.contains('[')).collect();
            known.extend(["time", "pi"]);
            known.sort_unstable();
            let family = format!("{name}[");
            let (fact, help) = if self.names.keys().any(|known| known.starts_with(&family)) {
                (format!("`{name}` is a family"), format!("name one of its members, for example `{name}[1]`"))
            } else if name.contains('[') {
                let where_ = text.index.as_ref().map_or(String::new(), |(index, k)| format!(" (where {index} is {k})"));
                (
                    format!("there is no `{name}`{where_}"),
                    "give the members at the ends their own equations, for example \"T[1]\" = \"...\"".to_owned(),
                )
            } else {
                (format!("the model has no quantity `{name}`"), suggestion(name, known.iter().copied()))
            };
            return Err(under(&text.path, StudyError::here(fact).with_help(help).at(node.span.clone())));
        };
        let definition: &'d Definition = self.definition;
        let declared = |lowering: &mut Self, op: Op, quantity: &Declared| {
            let id = lowering.graph.add_op(op);
            Affine::of(lowering.coherent(id, &quantity.unit))
        };
        Ok(match *meaning {
            Meaning::State(i) => declared(self, Op::State(i), &definition.states[i]),
            Meaning::Input(i) => declared(self, Op::Input(i), &definition.inputs[i]),
            Meaning::Parameter(i) => declared(self, Op::Parameter(i), &definition.parameters[i].quantity),
            Meaning::Constant(value) => Affine::of(self.graph.number(value)),
            Meaning::Let(i) => match self.lets.get(&(i, kinks)) {
                Some(Visit::Done(affine)) => affine.clone(),
                Some(Visit::Open) => {
                    return Err(under(
                        &text.path,
                        StudyError::here(format!("circular definition of `{name}`"))
                            .with_help("definitions may be in any order, but must not depend on themselves")
                            .at(node.span.clone()),
                    ));
                }
                None => {
                    let open = self.lets.values().filter(|visit| matches!(visit, Visit::Open)).count();
                    if open >= DEEPEST {
                        let fact = format!("definitions are nested more than {DEEPEST} deep");
                        let help = "replace the sum by a family of states, or split it into parts";
                        return Err(under(&text.path, StudyError::here(fact).with_help(help).at(node.span.clone())));
                    }
                    self.lets.insert((i, kinks), Visit::Open);
                    let text = &definition.lets[i].1;
                    let affine = self.node(text, &text.equation.right, kinks)?;
                    self.lets.insert((i, kinks), Visit::Done(affine.clone()));
                    affine
                }
            },
        })
    }
}
