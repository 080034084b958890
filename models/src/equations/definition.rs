//! Definition of a model: its tables, with every family expanded and every expression parsed.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use mops_core::StudyError;
use mops_language::{
    Quantity, Unit,
    expression::{Equation, Form, Node, equation},
    suggestion,
};
use mops_linear::OWN;

use super::key::{Index, Key, member};
use super::options::{EquationsOptions, Formula};

/// Expression or equation, with its path in the study.
#[derive(Debug, Clone)]
pub struct Text {
    /// Keys from the options to the expression.
    pub path: Vec<String>,
    /// Parsed expression or equation.
    pub equation: Arc<Equation>,
    /// Name and value of the index, within a family.
    pub index: Option<(String, i64)>,
}

/// State, input or signal.
#[derive(Debug, Clone)]
pub struct Declared {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: Unit,
    /// True if no unit was declared: the unit is then the coherent one that the equations require.
    pub open: bool,
    /// Description.
    pub about: String,
    /// Section and key of the declaration.
    pub path: Vec<String>,
}

/// Parameter of the model.
#[derive(Debug, Clone)]
pub struct Settable {
    /// Name, unit and description.
    pub quantity: Declared,
    /// Default value.
    pub default: Option<f64>,
    /// Lower and upper bound.
    pub range: [f64; 2],
}

/// Constant of the model.
#[derive(Debug, Clone)]
pub struct Constant {
    /// Name.
    pub name: String,
    /// Value in the coherent unit.
    pub value: f64,
    /// Unit, if one was declared.
    pub unit: Option<Unit>,
    /// Section and key of the declaration.
    pub path: Vec<String>,
}

impl Constant {
    /// Returns true for a constant of the section `constants`; the others stand for numbers of other sections.
    pub fn is_declared(&self) -> bool {
        self.path.first().is_some_and(|section| section == "constants")
    }
}

/// Friction of a joint.
#[derive(Debug, Clone)]
pub struct Friction {
    /// Position or speed of the joint.
    pub of: String,
    /// Path in the study.
    pub path: Vec<String>,
    /// Dry friction.
    pub coulomb: Option<Text>,
    /// Viscous friction.
    pub viscous: Option<Text>,
    /// Ratio of break-away to sliding friction.
    pub peak: Option<Text>,
}

/// Event that occurs when its guard becomes negative.
#[derive(Debug, Clone)]
pub struct When {
    /// Name.
    pub name: String,
    /// Guard of the event.
    pub guard: Text,
    /// New values of states.
    pub resets: Vec<(String, Text)>,
    /// Values of states at which accumulating events end.
    pub at_rest: Vec<(String, Text)>,
}

/// Clock whose memory changes at fixed instants only.
#[derive(Debug, Clone)]
pub struct Clock {
    /// Memory, as states.
    pub memory: Range<usize>,
    /// Period, first instant, and time between an instant and the change of the memory, as far as given.
    pub times: [Option<Text>; 3],
    /// New values of the memory.
    pub next: Vec<Text>,
}

/// Definition of a model, checked as far as each table allows on its own.
#[derive(Debug, Clone, Default)]
pub struct Definition {
    /// States, in order: the continuous ones, then the memory of the clocks.
    pub states: Vec<Declared>,
    /// Number of continuous states.
    pub continuous: usize,
    /// Typical sizes of the states, if declared.
    pub scales: Vec<Option<f64>>,
    /// Inputs, in order.
    pub inputs: Vec<Declared>,
    /// Parameters, in order.
    pub parameters: Vec<Settable>,
    /// Constants.
    pub constants: Vec<Constant>,
    /// Named expressions.
    pub lets: Vec<(String, Text)>,
    /// Equations of the derivatives, by state.
    pub der: BTreeMap<String, Text>,
    /// Entries of the mass matrix: row, column, expression.
    pub mass: Vec<(String, String, Text)>,
    /// Further signals.
    pub outputs: Vec<(Declared, Text)>,
    /// Initial values, by state.
    pub start: BTreeMap<String, Text>,
    /// Friction elements.
    pub friction: Vec<Friction>,
    /// Events.
    pub when: Vec<When>,
    /// Clocks.
    pub clocks: Vec<Clock>,
    /// Number of cut loops, whose inputs and outputs are the last ones, in order.
    pub cuts: usize,
    /// Names of joints: name, position, path in the study.
    pub ports: Vec<(String, String, Vec<String>)>,
}

/// Prepends keys to the path of a mistake.
pub fn under(path: &[String], mistake: StudyError) -> StudyError {
    path.iter().rev().fold(mistake, |mistake, key| mistake.within(key))
}

pub fn path(keys: &[&str]) -> Vec<String> {
    keys.iter().map(|key| (*key).to_owned()).collect()
}

impl Text {
    /// Parses a formula that has this path.
    pub(super) fn read(path: Vec<String>, formula: &Formula, index: Option<(String, i64)>) -> Result<Self, StudyError> {
        let read = equation(&formula.0);
        let equation =
            read.map_err(|wrong| under(&path, StudyError::here(wrong.message).with_help(HELP).at(wrong.span)))?;
        Ok(Self { path, equation: Arc::new(equation), index })
    }

    /// Parses an expression; an equation is an error.
    fn expression(path: Vec<String>, formula: &Formula, index: Option<(String, i64)>) -> Result<Self, StudyError> {
        let text = Self::read(path, formula, index)?;
        match &text.equation.left {
            Some(left) => Err(under(
                &text.path,
                StudyError::here("expected an expression, found an equation")
                    .with_help("only `der` takes equations; a comparison is written `>=` or `<=`")
                    .at(left.span.start..text.equation.right.span.end),
            )),
            None => Ok(text),
        }
    }
}

impl Text {
    /// Returns true if the text consists only of numbers without units; pi is in rad.
    pub(super) fn is_bare(&self) -> bool {
        let mut bare = self.equation.left.is_none();
        self.equation.right.walk(&mut |node| {
            bare &= match node.form {
                Form::Number(number) => number != PI,
                Form::Name(_) | Form::Member(..) | Form::Rate(_) | Form::Quantity(..) => false,
                _ => true,
            };
        });
        bare
    }
}

/// Way out of a mistake in an expression.
pub const HELP: &str = "see `mops describe equations` for the syntax of expressions";

impl Definition {
    /// Reads the tables.
    ///
    /// # Errors
    /// The first wrong key, unit or expression, with its path.
    pub fn read(options: &EquationsOptions) -> Result<Self, StudyError> {
        let mut d = Self::default();
        for (key, state) in &options.states.0 {
            let states = declared("states", key, &state.0.unit, state.0.about.as_deref())?;
            let scale = state.0.scale.as_ref().map(|scale| scale.to(&states[0].unit.difference())).transpose();
            let wrong = |why| under(&path(&["states", key, "scale"]), StudyError::here(why));
            let scale = scale.map_err(wrong)?;
            if let Some(scale) = scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
                return Err(wrong(format!("expected a positive size, found {scale}")));
            }
            d.scales.extend(states.iter().map(|_| scale));
            d.states.extend(states);
        }
        d.continuous = d.states.len();
        for (name, clock) in &options.clocks.0 {
            let first = d.states.len();
            for (key, memory) in &clock.memory.0 {
                let place = path(&["clocks", name, "memory", key]);
                let memory = declared_at(place, key, &memory.0.unit, memory.0.about.as_deref())?;
                d.scales.extend(memory.iter().map(|_| None));
                d.states.extend(memory);
            }
            let memory = first..d.states.len();
            d.clocks.push(Clock { memory, times: [None, None, None], next: Vec::new() });
        }
        if d.states.is_empty() {
            return Err(
                StudyError::new("states", "the model has no state").with_help("for example states = { x = \"m\" }")
            );
        }
        for (key, input) in &options.inputs.0 {
            d.inputs.extend(declared("inputs", key, &input.0.unit, input.0.about.as_deref())?);
        }
        for (key, parameter) in &options.parameters.0 {
            let parameter = &parameter.0;
            // A parameter without a declared unit has the unit of its values, if they have one.
            let given = [&parameter.default, &parameter.min, &parameter.max].into_iter().flatten();
            let given = given.filter_map(|quantity| quantity.unit.as_ref()).next().map(ToString::to_string);
            let unit = given.filter(|_| parameter.unit.trim().is_empty()).unwrap_or_else(|| parameter.unit.clone());
            for quantity in declared("parameters", key, &unit, parameter.about.as_deref())? {
                let value = |name: &str, given: &Option<Quantity>| {
                    let value = given.as_ref().map(|q| q.to(&quantity.unit)).transpose();
                    value.map_err(|why| {
                        under(
                            &path(&["parameters", key, name]),
                            StudyError::here(why).with_help(counts_in(&quantity.unit)),
                        )
                    })
                };
                let default = value("default", &parameter.default)?;
                let min = value("min", &parameter.min)?.unwrap_or(f64::NEG_INFINITY);
                let max = value("max", &parameter.max)?.unwrap_or(f64::INFINITY);
                let place = |name: &str| path(&["parameters", key, name]);
                if min.is_nan() || max.is_nan() || min >= max {
                    let fact = format!("expected a smallest value below the largest, found {min} and {max}");
                    return Err(under(&place("max"), StudyError::here(fact)).with_help("correct `min` and `max`"));
                }
                if let Some(value) = default.filter(|value| !value.is_finite() || !(min..=max).contains(value)) {
                    let fact = format!("expected a finite default from {min} to {max}, found {value}");
                    return Err(
                        under(&place("default"), StudyError::here(fact)).with_help("correct it, or `min` and `max`")
                    );
                }
                d.parameters.push(Settable { quantity, default, range: [min, max] });
            }
        }
        for (key, constant) in &options.constants.0 {
            let place = path(&["constants", key]);
            let names = Key::parse(key).and_then(|key| key.declared()).map_err(|m| under(&place, m))?;
            let unit = constant.unit.clone();
            let value = unit.as_ref().map_or(constant.number, |unit| constant.number * unit.factor() + unit.zero());
            let one = |name| Constant { name, value, unit: unit.clone(), path: place.clone() };
            d.constants.extend(names.into_iter().map(one));
        }
        for (key, output) in &options.outputs.0 {
            let unit = output.0.unit.as_deref().unwrap_or_default();
            let [declared] = <[Declared; 1]>::try_from(declared("outputs", key, unit, output.0.about.as_deref())?)
                .map_err(|_| under(&path(&["outputs", key]), StudyError::here("an output must be a single signal")))?;
            let text = Text::expression(declared.path.clone(), &output.0.value, None)?;
            d.outputs.push((declared, text));
        }
        d.read_definitions(options)?;
        d.read_mass(options)?;
        d.read_elements(options)?;
        d.read_clocks(options)?;
        Ok(d)
    }

    /// Returns all expressions and equations.
    pub fn texts_mut(&mut self) -> Vec<&mut Text> {
        let mut all: Vec<&mut Text> = self.lets.iter_mut().map(|(_, text)| text).collect();
        all.extend(self.der.values_mut());
        all.extend(self.mass.iter_mut().map(|(.., text)| text));
        all.extend(self.outputs.iter_mut().map(|(_, text)| text));
        all.extend(self.start.values_mut());
        for Friction { coulomb, viscous, peak, .. } in &mut self.friction {
            all.extend([coulomb, viscous, peak].into_iter().flatten());
        }
        for When { guard, resets, at_rest, .. } in &mut self.when {
            all.push(guard);
            all.extend(resets.iter_mut().chain(at_rest).map(|(_, text)| text));
        }
        for Clock { times, next, .. } in &mut self.clocks {
            all.extend(times.iter_mut().flatten().chain(next));
        }
        all
    }

    fn state_names(&self) -> Vec<String> {
        self.states.iter().map(|state| state.name.clone()).collect()
    }

    /// Returns true if the state is the memory of a clock, by its index.
    pub fn is_memory(&self, state: usize) -> bool {
        state >= self.continuous
    }

    fn read_definitions(&mut self, options: &EquationsOptions) -> Result<(), StudyError> {
        for (key, formula) in &options.definitions.0 {
            let place = path(&["let", key]);
            let parsed = Key::parse(key).map_err(|m| under(&place, m))?;
            let names = parsed.declared().map_err(|m| under(&place, m))?;
            let first = match parsed.index {
                Index::Range(_, from, _) => from,
                _ => 0,
            };
            for (name, k) in names.into_iter().zip(first..) {
                let index = match &parsed.index {
                    Index::Range(Some(index), ..) => Some((index.clone(), k)),
                    _ => None,
                };
                self.lets.push((name, Text::expression(place.clone(), formula, index)?));
            }
        }
        let states = self.state_names();
        let states: Vec<&str> = states.iter().map(String::as_str).collect();
        let (continuous, memory) = states.split_at(self.continuous);
        if let Some((key, _)) =
            options.der.0.iter().find(|(key, _)| memory.contains(&key.as_str()) && !continuous.contains(&key.as_str()))
        {
            let fact = format!("`{key}` is the memory of a clock, which has no derivative");
            return Err(under(&path(&["der", key]), StudyError::here(fact)).with_help("give its new value in `next`"));
        }
        self.der = by_state(&["der"], &options.der.0, continuous, Text::read)?;
        self.start = by_state(&["start"], &options.start.0, &states, Text::expression)?;
        for state in &self.states[..self.continuous] {
            if !self.der.contains_key(&state.name) {
                return Err(under(
                    &state.path,
                    StudyError::here(format!("state `{}` has no equation", state.name))
                        .with_help(format!("add it to `der`, for example \"{}\" = \"...\"", state.name)),
                ));
            }
        }
        Ok(())
    }

    fn read_mass(&mut self, options: &EquationsOptions) -> Result<(), StudyError> {
        let mut states = self.state_names();
        states.truncate(self.continuous);
        for (key, formula) in &options.mass.0 {
            let place = path(&["mass", key]);
            let (row, column) = key.split_once(',').ok_or_else(|| {
                under(&place, StudyError::here(format!("expected a row and a column, found `{key}`")))
                    .with_help("write two states separated by a comma: \"w,w\" = \"J\"")
            })?;
            let (row, column) = (row.trim().to_owned(), column.trim().to_owned());
            for name in [&row, &column] {
                if !states.contains(name) {
                    return Err(under(&place, StudyError::here(format!("the model has no state `{name}`")))
                        .with_help(suggestion(name, states.iter().map(String::as_str))));
                }
            }
            self.mass.push((row, column, Text::expression(place, formula, None)?));
        }
        Ok(())
    }

    fn read_elements(&mut self, options: &EquationsOptions) -> Result<(), StudyError> {
        for (of, friction) in &options.friction.0 {
            let read = |key: &str, formula: &Option<Formula>| {
                formula.as_ref().map(|f| Text::expression(path(&["friction", of, key]), f, None)).transpose()
            };
            self.friction.push(Friction {
                of: of.clone(),
                path: path(&["friction", of]),
                coulomb: read("coulomb", &friction.coulomb)?,
                viscous: read("viscous", &friction.viscous)?,
                peak: read("peak", &friction.peak)?,
            });
        }
        let states = self.state_names();
        for (name, when) in &options.when.0 {
            let guard = Text::expression(path(&["when", name, "guard"]), &when.guard, None)?;
            let values = |table: &str, entries: &[(String, Formula)]| {
                let value = |(state, formula): &(String, Formula)| {
                    let place = path(&["when", name, table, state]);
                    if !states.contains(state) {
                        return Err(under(&place, StudyError::here(format!("the model has no state `{state}`")))
                            .with_help(suggestion(state, states.iter().map(String::as_str))));
                    }
                    Ok((state.clone(), Text::expression(place, formula, None)?))
                };
                entries.iter().map(value).collect::<Result<Vec<_>, _>>()
            };
            let (resets, at_rest) = (values("reset", &when.reset.0)?, values("at-rest", &when.at_rest.0)?);
            self.when.push(When { name: name.clone(), guard, resets, at_rest });
        }
        for (name, port) in &options.ports.0 {
            self.ports.push((name.clone(), port.joint.clone(), path(&["ports", name, "joint"])));
        }
        Ok(())
    }
}

impl Definition {
    /// Cuts the loop at a named expression, which has this unit unless an output declares it, or at the memory of a
    /// clock: an input of this name acts in its place; the output that follows the others is minus the expression.
    ///
    /// # Errors
    /// There is no such variable.
    pub fn cut(&mut self, variable: &str, unit: Option<Unit>) -> Result<(), StudyError> {
        if let Some(state) = (self.continuous..self.states.len()).find(|&state| self.states[state].name == variable) {
            self.cut_memory(state);
            return Ok(());
        }
        let Some(index) = self.lets.iter().position(|(name, _)| name == variable) else {
            let fact = format!(
                "the loop can be cut at a named expression of `let` or at the memory of a clock, not at `{variable}`"
            );
            let memory = self.states[self.continuous..].iter().map(|state| state.name.as_str());
            let names = self.lets.iter().map(|(name, _)| name.as_str()).chain(memory);
            return Err(StudyError::here(fact).with_help(suggestion(variable, names)));
        };
        if let Some(state) = self.continuous_state_within(index).filter(|_| !self.clocks.is_empty()) {
            let fact = format!(
                "`{variable}` follows the state `{state}` between the instants of the clocks, so that the loop cut there is not \
                 time-invariant"
            );
            let memory: Vec<String> =
                self.states[self.continuous..].iter().map(|state| format!("`{}`", state.name)).collect();
            return Err(
                StudyError::here(fact).with_help(format!("cut it at the memory of a clock: {}", memory.join(", ")))
            );
        }
        let (name, text) = self.lets.remove(index);
        let shown = self.outputs.iter().position(|(output, _)| output.name == name);
        let shown = shown.map(|k| self.outputs.remove(k).0.unit);
        let unit = shown.or(unit).map_or_else(Unit::one, |unit| unit.difference());
        self.add_cut(&name, &unit, text);
        Ok(())
    }

    /// Returns the name of a continuous state on which a named expression depends, by others if need be.
    fn continuous_state_within(&self, index: usize) -> Option<&str> {
        let mut seen = vec![false; self.lets.len()];
        let mut open = vec![index];
        let mut found = None;
        while let Some(index) = open.pop() {
            if std::mem::replace(&mut seen[index], true) {
                continue;
            }
            self.lets[index].1.equation.right.walk(&mut |node| {
                let Form::Name(name) = &node.form else { return };
                found = found.or_else(|| self.states[..self.continuous].iter().find(|state| state.name == *name));
                open.extend(self.lets.iter().position(|(other, _)| other == name));
            });
        }
        found.map(|state| state.name.as_str())
    }

    /// Cuts the loop at the memory of a clock, which keeps its value under another name. Its own next value is computed
    /// from it, for example by an increment; all others use the input.
    fn cut_memory(&mut self, state: usize) {
        let declared = &mut self.states[state];
        let (name, unit, path) = (declared.name.clone(), declared.unit.difference(), declared.path.clone());
        let own = format!("{OWN}{name}");
        declared.name.clone_from(&own);
        if let Some(start) = self.start.remove(&name) {
            self.start.insert(own.clone(), start);
        }
        let assigned = self.when.iter_mut().flat_map(|when| when.resets.iter_mut().chain(&mut when.at_rest));
        assigned.filter(|(state, _)| *state == name).for_each(|(state, _)| state.clone_from(&own));
        let clock = self.clocks.iter_mut().find(|clock| clock.memory.contains(&state)).expect("memory of a clock");
        let mut rename = |node: &Node| (node.form == Form::Name(name.clone())).then(|| Form::Name(own.clone()));
        let text = &mut clock.next[state - clock.memory.start];
        let mut equation = (*text.equation).clone();
        equation.right.replace(&mut rename);
        text.equation = Arc::new(equation);
        let right = Node { form: Form::Name(own), span: 0..name.len() };
        self.add_cut(&name, &unit, Text { path, equation: Arc::new(Equation { left: None, right }), index: None });
    }

    /// Adds the input of a cut loop, and minus the expression as its output.
    fn add_cut(&mut self, name: &str, unit: &Unit, mut text: Text) {
        let declared = |name: String, about: &str| Declared {
            name,
            unit: unit.clone(),
            open: false,
            about: about.to_owned(),
            path: text.path.clone(),
        };
        let input = declared(name.to_owned(), "input of the cut loop");
        let output = declared(format!("-{name}"), "output of the cut loop");
        let right = text.equation.right.clone();
        let span = right.span.clone();
        let right = Node { form: Form::Negative(Box::new(right)), span };
        text.equation = Arc::new(Equation { left: None, right });
        self.inputs.push(input);
        self.outputs.push((output, text));
        self.cuts += 1;
    }

    fn read_clocks(&mut self, options: &EquationsOptions) -> Result<(), StudyError> {
        let names = self.state_names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        for (clock, (name, given)) in self.clocks.iter_mut().zip(&options.clocks.0) {
            let memory = &names[clock.memory.clone()];
            let mut next = by_state(&["clocks", name, "next"], &given.next.0, memory, Text::expression)?;
            let next = memory.iter().map(|memory| {
                next.remove(*memory).ok_or_else(|| {
                    let fact = format!("the memory `{memory}` has no new value");
                    let help = format!("add it to `next`, for example {memory} = \"...\"");
                    under(&path(&["clocks", name, "next"]), StudyError::here(fact)).with_help(help)
                })
            });
            clock.next = next.collect::<Result<_, _>>()?;
            if memory.is_empty() {
                let place = path(&["clocks", name, "memory"]);
                return Err(under(&place, StudyError::here("the clock has no memory"))
                    .with_help("declare what it computes, for example memory = { u = \"V\" }"));
            }
            let time = |key: &str, formula: Option<&Formula>| {
                formula.map(|f| Text::expression(path(&["clocks", name, key]), f, None)).transpose()
            };
            clock.times = [
                time("every", Some(&given.every))?,
                time("offset", given.offset.as_ref())?,
                time("delay", given.delay.as_ref())?,
            ];
        }
        Ok(())
    }
}

fn counts_in(unit: &Unit) -> String {
    format!("a number without a unit is read in `{unit}`")
}

fn declared(section: &str, key: &str, unit: &str, about: Option<&str>) -> Result<Vec<Declared>, StudyError> {
    declared_at(path(&[section, key]), key, unit, about)
}

fn declared_at(place: Vec<String>, key: &str, unit: &str, about: Option<&str>) -> Result<Vec<Declared>, StudyError> {
    let names = Key::parse(key).and_then(|key| key.declared()).map_err(|m| under(&place, m))?;
    let open = unit.trim().is_empty();
    let unit = Unit::parse(unit).map_err(|why| {
        under(&place, StudyError::here(why))
            .with_help("units are s, m, kg, rad, N, V, A, K and products such as \"kg m2\"")
    })?;
    let declare = |name| {
        let about = about.unwrap_or_default().to_owned();
        Declared { name, unit: unit.clone(), open, about, path: place.clone() }
    };
    Ok(names.into_iter().map(declare).collect())
}

/// Collects texts by state: first from keys that name states, then from keys that apply to all remaining members of a
/// family.
fn by_state(
    section: &[&str],
    entries: &[(String, Formula)],
    states: &[&str],
    read: impl Fn(Vec<String>, &Formula, Option<(String, i64)>) -> Result<Text, StudyError>,
) -> Result<BTreeMap<String, Text>, StudyError> {
    let mut texts: BTreeMap<String, Text> = BTreeMap::new();
    let mut rest = Vec::new();
    for (key, formula) in entries {
        let place = path(&[section, &[key]].concat());
        let parsed = Key::parse(key).map_err(|m| under(&place, m))?;
        let members: Vec<(String, Option<(String, i64)>)> = match &parsed.index {
            Index::None => vec![(parsed.name.clone(), None)],
            Index::One(k) => vec![(member(&parsed.name, *k), None)],
            Index::Range(index, from, to) => {
                let one = |k| (member(&parsed.name, k), index.clone().map(|index| (index, k)));
                (*from..=*to).map(one).collect()
            }
            Index::Rest(index) => {
                rest.push((parsed.name.clone(), index.clone(), place, formula));
                continue;
            }
        };
        for (name, index) in members {
            if !states.contains(&name.as_str()) {
                return Err(under(&place, StudyError::here(format!("the model has no state `{name}`")))
                    .with_help(suggestion(&name, states.iter().copied())));
            }
            let text = read(place.clone(), formula, index)?;
            if texts.insert(name.clone(), text).is_some() {
                return Err(under(&place, StudyError::here(format!("`{name}` is defined twice")))
                    .with_help("the members given by different keys must not overlap"));
            }
        }
    }
    for (family, index, place, formula) in rest {
        let all = states.iter().filter_map(|state| {
            let inner = state.strip_prefix(family.as_str())?.strip_prefix('[')?.strip_suffix(']')?;
            Some((*state, inner.parse::<i64>().ok()?))
        });
        let all: Vec<(&str, i64)> = all.collect();
        if all.is_empty() {
            return Err(under(&place, StudyError::here(format!("the model has no states `{family}[..]`")))
                .with_help(format!("declare them, for example states = {{ \"{family}[1..100]\" = \"K\" }}")));
        }
        for (name, k) in all {
            if !texts.contains_key(name) {
                texts.insert(name.to_owned(), read(place.clone(), formula, Some((index.clone(), k)))?);
            }
        }
    }
    Ok(texts)
}
