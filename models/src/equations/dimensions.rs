//! Dimensional analysis of the whole model: checks every expression and determines missing units.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use mops_core::StudyError;
use mops_language::{
    Unit,
    expression::{
        Form, Node,
        units::{Conflict, Dimensions, Measure, Open, Quantities},
    },
};

use super::definition::{Declared, Definition, Text, under};
use super::key::member;

/// Units determined from the equations.
#[derive(Debug)]
pub struct Measured {
    /// Units of the terms in the equations of the states.
    pub forces: Vec<Unit>,
    /// Readings of numbers and quantities without units.
    pub notes: Vec<String>,
    /// Units of states, inputs, parameters and constants that were declared without a unit.
    names: HashMap<String, Unit>,
    /// Units of the outputs.
    outputs: Vec<Unit>,
}

impl Measured {
    /// Assigns units to the quantities that were declared without a unit.
    pub fn declare(&self, d: &mut Definition) {
        let parameters = d.parameters.iter_mut().map(|p| &mut p.quantity);
        for quantity in d.states.iter_mut().chain(&mut d.inputs).chain(parameters) {
            if let Some(unit) = self.names.get(&quantity.name) {
                quantity.unit = unit.clone();
            }
        }
        for ((output, _), unit) in d.outputs.iter_mut().zip(&self.outputs) {
            output.unit = unit.clone();
        }
    }
}

/// Checks the dimensions of every expression of the model; `joints` are pairs of a position and its speed.
///
/// # Errors
/// The first part with a wrong dimension, with its position.
pub fn check(d: &Definition, joints: &[(usize, usize)]) -> Result<Measured, StudyError> {
    let mut model = Model::new(d);
    for (_, text) in &d.lets {
        model.measure(text)?;
    }
    let force = |(s, state): (usize, &Declared)| match d.is_memory(s) {
        true => Ok(model.rate(&state.name)),
        false => model.force(&state.name),
    };
    let forces = d.states.iter().enumerate().map(force).collect::<Result<Vec<_>, _>>()?;
    let state = |name: &String| d.states.iter().position(|s| s.name == *name).expect("names of states were checked");
    for (row, column, text) in &d.mass {
        let mass = forces[state(row)].times(&model.rate(column), -1.0);
        model.fits(&mass, text, "a mass times a derivative must have the dimension of the equation")?;
    }
    for (k, (_, text)) in d.outputs.iter().enumerate() {
        model.fits(&model.outputs[k].clone(), text, "an output must have the dimension of its unit")?;
    }
    for (input, (_, text)) in d.inputs.iter().rev().zip(d.outputs.iter().rev()).take(d.cuts) {
        model.fits(&model.names[&input.name].clone(), text, "the loop is cut at a quantity of one dimension")?;
    }
    for (state, text) in d.start.iter().filter(|(_, text)| !text.is_bare()) {
        model.fits(&model.names[state].clone(), text, "an initial value must have the dimension of its state")?;
    }
    for friction in &d.friction {
        let of = state(&friction.of);
        let Some(&(_, velocity)) = joints.iter().find(|(q, v)| *q == of || *v == of) else { continue };
        let force = &forces[velocity];
        let viscous = force.times(&model.names[&d.states[velocity].name], -1.0);
        let wanted = [
            (&friction.coulomb, force, "dry friction must have the dimension of the terms of the equation"),
            (
                &friction.viscous,
                &viscous,
                "viscous friction times the speed must have the dimension of the terms of the equation",
            ),
            (&friction.peak, &Measure::pure(), "a ratio must be a pure number"),
        ];
        for (text, measure, rule) in wanted {
            text.as_ref().map_or(Ok(()), |text| model.fits(measure, text, rule))?;
        }
    }
    for when in &d.when {
        model.measure(&when.guard)?;
        for (state, text) in when.resets.iter().chain(&when.at_rest) {
            model.fits(
                &model.names[state].clone(),
                text,
                "the new value of a state must have the dimension of the state",
            )?;
        }
    }
    for clock in &d.clocks {
        for (memory, text) in clock.memory.clone().zip(&clock.next) {
            let memory = model.names[&d.states[memory].name].clone();
            model.fits(&memory, text, "the new value of a memory must have the dimension of the memory")?;
        }
        for text in clock.times.iter().flatten() {
            let time = if has_units(text) { Measure::declared("time", &Unit::known("s")) } else { model.time.clone() };
            model.fits(&time, text, "the time must have the dimension of a time")?;
        }
    }
    Ok(model.measured(&forces))
}

/// Quantities of a model and their dimensions.
struct Model<'d> {
    definition: &'d Definition,
    dimensions: Dimensions,
    /// Dimensions of states, inputs, parameters, constants, and of definitions once determined.
    names: HashMap<String, Measure>,
    outputs: Vec<Measure>,
    lets: HashMap<&'d str, &'d Text>,
    /// Definitions being determined; with a dimension once they were met in their own delayed value.
    visited: HashMap<String, Option<Measure>>,
    constants: HashMap<&'d str, f64>,
    time: Measure,
    /// Numbers read in coherent units, by path, position and text.
    counted: BTreeMap<(String, usize, String), Open>,
}

/// Returns true if all quantities of the model are declared as pure numbers; time is then a pure number, too.
fn is_dimensionless(d: &Definition) -> bool {
    let frictions = d.friction.iter().flat_map(|f| [&f.coulomb, &f.viscous, &f.peak]).flatten();
    let events = d
        .when
        .iter()
        .flat_map(|w| std::iter::once(&w.guard).chain(w.resets.iter().chain(&w.at_rest).map(|(_, text)| text)));
    let texts = d.lets.iter().map(|(_, text)| text).chain(d.der.values()).chain(d.start.values());
    let texts = texts.chain(d.outputs.iter().map(|(_, text)| text)).chain(d.mass.iter().map(|(.., text)| text));
    let clocks = d.clocks.iter().flat_map(|clock| &clock.next);
    if texts.chain(frictions).chain(events).chain(clocks).any(has_units) {
        return false;
    }
    let outputs = d.outputs.iter().map(|(output, _)| output);
    let parameters = d.parameters.iter().map(|p| &p.quantity);
    let mut declared = d.states.iter().chain(&d.inputs).chain(parameters).chain(outputs).map(|q| &q.unit);
    let is_one = |unit: &Unit| unit.to_string() == "1";
    declared.all(is_one) && d.constants.iter().filter_map(|c| c.unit.as_ref()).all(is_one)
}

impl<'d> Model<'d> {
    fn new(d: &'d Definition) -> Self {
        let mut dimensions = Dimensions::default();
        let pure = is_dimensionless(d);
        let mut measure = |name: &str, unit: &Unit, open: bool| {
            if open && !pure { dimensions.open(name) } else { Measure::declared(name, unit) }
        };
        let parameters = d.parameters.iter().map(|p| &p.quantity);
        let mut names = HashMap::new();
        for q in d.states.iter().chain(&d.inputs).chain(parameters) {
            names.insert(q.name.clone(), measure(&q.name, &q.unit, q.open));
        }
        for c in &d.constants {
            let unit = c.unit.clone().unwrap_or_else(Unit::one);
            names.insert(c.name.clone(), measure(&c.name, &unit, c.unit.is_none()));
        }
        let outputs = d.outputs.iter().map(|(q, _): &(Declared, Text)| measure(&q.name, &q.unit, q.open)).collect();
        Self {
            definition: d,
            names,
            outputs,
            lets: d.lets.iter().map(|(name, text)| (name.as_str(), text)).collect(),
            visited: HashMap::new(),
            constants: d.constants.iter().map(|c| (c.name.as_str(), c.value)).collect(),
            time: if pure { Measure::pure() } else { Measure::declared("time", &Unit::known("s")) },
            counted: BTreeMap::new(),
            dimensions,
        }
    }

    fn rate(&self, state: &str) -> Measure {
        self.names[state].rate(&self.time)
    }

    fn within<T>(&mut self, text: &Text, f: impl FnOnce(&mut Dimensions, &mut Within<'_, 'd>) -> T) -> T {
        // The dimensions are moved into the closure, which may determine the dimensions of quantities that the
        // expression names.
        let mut dimensions = std::mem::take(&mut self.dimensions);
        let found = f(&mut dimensions, &mut Within { model: self, text });
        self.dimensions = dimensions;
        found
    }

    fn measure(&mut self, text: &Text) -> Result<Measure, StudyError> {
        self.within(text, |dimensions, within| dimensions.measure(within, &text.equation.right))
    }

    fn fits(&mut self, what: &Measure, text: &Text, rule: &str) -> Result<(), StudyError> {
        self.within(text, |dimensions, within| dimensions.fits(within, what, &text.equation.right, rule))
    }

    /// Determines the dimension of the terms in the equation of a state.
    fn force(&mut self, state: &str) -> Result<Measure, StudyError> {
        let text = &self.definition.der[state];
        if let Some(left) = &text.equation.left {
            return self.within(text, |dimensions, within| dimensions.equate(within, [left, &text.equation.right]));
        }
        let has_mass = self.definition.mass.iter().any(|(row, ..)| row == state);
        let force = if has_mass { self.dimensions.open(&format!("der.{state}")) } else { self.rate(state) };
        self.fits(&force, text, "a derivative must have the dimension of its state divided by time")?;
        Ok(force)
    }

    fn measured(&self, forces: &[Measure]) -> Measured {
        let d = self.definition;
        let unit = |measure: &Measure| Unit::coherent(&self.dimensions.of(measure));
        let force = |(state, force): (&Declared, &Measure)| {
            let (rate, coherent) = (state.unit.difference().power(1, -1), unit(force));
            if rate.is_coherent() && rate.is_compatible(&coherent) { rate } else { coherent }
        };
        let open =
            self.names.iter().filter(|(name, measure)| measure.is_loose() && !self.lets.contains_key(name.as_str()));
        let names: HashMap<String, Unit> = open.map(|(name, measure)| (name.clone(), unit(measure))).collect();
        let output =
            |((q, _), measure): (&(Declared, Text), &Measure)| if q.open { unit(measure) } else { q.unit.clone() };
        let measured = |unit: &Unit| !unit.dimension().is_none();
        let numbers = self.counted.iter().map(|((place, _, number), open)| {
            (format!("{number} in {{}} ({place})"), Unit::coherent(&self.dimensions.found(open)))
        });
        let numbers =
            numbers.filter(|(_, unit)| measured(unit)).map(|(text, unit)| text.replace("{}", &unit.to_string()));
        let mut without: Vec<String> =
            names.iter().filter(|(_, unit)| measured(unit)).map(|(name, unit)| format!("`{name}` in {unit}")).collect();
        without.sort();
        let notes = [
            ("numbers without a unit, read in SI units", numbers.collect::<Vec<_>>()),
            ("units derived from the equations", without),
        ];
        let notes = notes.into_iter().filter(|(_, list)| !list.is_empty());
        Measured {
            forces: d.states.iter().zip(forces).map(force).collect(),
            notes: notes.map(|(what, list)| format!("{what}: {}", list.join(", "))).collect(),
            outputs: d.outputs.iter().zip(&self.outputs).map(output).collect(),
            names,
        }
    }
}

/// Expression within the model.
struct Within<'m, 'd> {
    model: &'m mut Model<'d>,
    text: &'m Text,
}

impl Quantities for Within<'_, '_> {
    type Error = StudyError;

    fn measure(&mut self, dimensions: &mut Dimensions, node: &Node) -> Result<Measure, StudyError> {
        let name = match &node.form {
            Form::Name(name) => name.clone(),
            Form::Member(name, index) => member(name, self.index(index)),
            Form::Rate(of) => {
                let state = self.measure(dimensions, of)?;
                return Ok(state.rate(&self.model.time));
            }
            _ => unreachable!("only names are looked up"),
        };
        if self.text.index.as_ref().is_some_and(|(index, _)| *index == name) {
            return Ok(Measure::pure());
        }
        if name == "time" {
            return Ok(self.model.time.clone());
        }
        if let Some(known) = self.model.names.get(&name) {
            return Ok(known.clone());
        }
        if let Some(visited) = self.model.visited.get_mut(&name) {
            return Ok(visited.get_or_insert_with(|| dimensions.open(&name)).clone());
        }
        let text = self.model.lets[name.as_str()];
        self.model.visited.insert(name.clone(), None);
        let right = &text.equation.right;
        let mut measure = dimensions.measure(&mut Within { model: &mut *self.model, text }, right)?;
        if let Some(own) = self.model.visited.remove(&name).flatten() {
            self.model.names.insert(name.clone(), own.clone());
            let rule = "a definition must have the dimension of its delayed value";
            dimensions.fits(&mut Within { model: &mut *self.model, text }, &own, right, rule)?;
            measure = own;
        }
        self.model.names.insert(name, measure.clone());
        Ok(measure)
    }

    fn constant(&self, name: &str) -> Option<f64> {
        match &self.text.index {
            #[allow(clippy::cast_precision_loss)]
            Some((index, k)) if index == name => Some(*k as f64),
            _ => self.model.constants.get(name).copied().or_else(|| {
                let text = *self.model.lets.get(name)?;
                text.is_bare().then(|| text.equation.right.evaluate(&|_: &str| f64::NAN))
            }),
        }
    }

    fn counts(&mut self, number: String, place: Range<usize>, dimension: Open) {
        self.model.counted.insert((self.text.path.join("."), place.start, number), dimension);
    }

    fn refuse(&self, Conflict { span, fact, help }: Conflict) -> StudyError {
        under(&self.text.path, StudyError::here(fact).with_help(help).at(span))
    }
}

impl Within<'_, '_> {
    /// Evaluates the index of a member, which was checked when the expression was lowered.
    #[allow(clippy::cast_possible_truncation)]
    fn index(&self, node: &Node) -> i64 {
        node.evaluate(&|name: &str| self.constant(name).unwrap_or(f64::NAN)) as i64
    }
}

/// Returns true if a number in the text has a unit other than that of a pure number.
fn has_units(text: &Text) -> bool {
    let mut found = false;
    for side in text.equation.left.iter().chain(std::iter::once(&text.equation.right)) {
        side.walk(&mut |node| {
            found |= matches!(&node.form, Form::Quantity(_, unit) if !unit.dimension().is_none());
        });
    }
    found
}
