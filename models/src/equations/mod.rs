//! Models written in the study file: equations that are parsed and compiled once, and evaluated as a tape of
//! instructions.

mod bank;
mod bounds;
mod branches;
mod clocks;
mod compiled;
mod controllers;
mod definition;
mod dimensions;
mod filters;
mod graph;
mod happenings;
mod interface;
mod key;
mod layout;
mod lower;
mod modes;
mod options;
mod phase;
mod program;
mod running;
mod system;
mod tables;
mod tape;
mod ticking;

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use mops_core::{
    Failure, Interface, Model, ModelOptions, Plant, StudyError, Variable,
    effect::Port,
    model::{Cut, State},
};
use mops_language::{
    Scalar, Unit,
    files::{Files, Folder},
};

use crate::kernel::{PlantModel, Simulated, Tolerance};
use bank::{Bank, FEW, Large, Small};
use compiled::Compiled;
use definition::Definition;
pub use definition::Text;
use interface::{Start, parameters, ports};
pub use options::EquationsOptions;
use running::Running;
use system::System;

impl ModelOptions for EquationsOptions {
    const KIND: &'static str = "equations";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        self.build_with(&Folder::default())
    }

    fn build_with(self, files: &dyn Files) -> Result<Box<dyn Model>, StudyError> {
        Ok(Box::new(Simulated::new(Equations::with_files(&self, files)?)))
    }
}

/// Model of the kind `equations`.
pub struct Equations {
    definition: Definition,
    interface: Interface,
    compiled: Compiled,
    starts: Vec<Start>,
    tolerance: Tolerance,
    /// Readings of numbers without units.
    notes: Vec<String>,
    /// Compiled equations with an additional input in every equation that is a port; created on first use.
    opened: OnceLock<Compiled>,
}

impl Equations {
    /// Parses, checks and compiles the equations.
    ///
    /// # Errors
    /// The first mistake, with its key and its position in the expression.
    pub fn new(options: &EquationsOptions) -> Result<Self, StudyError> {
        Self::with_files(options, &Folder::default())
    }

    /// Parses, checks and compiles the equations, with the files of their lookup tables.
    ///
    /// # Errors
    /// The first mistake, with its key and its position in the expression.
    pub fn with_files(options: &EquationsOptions, files: &dyn Files) -> Result<Self, StudyError> {
        options.tolerance.check()?;
        let horizon = options.horizon.as_ref().map(|q| q.to(&Unit::known("s"))).transpose();
        let horizon = horizon.map_err(|why| StudyError::new("horizon", why))?;
        if let Some((key, constant)) = options.constants.0.iter().find(|(_, constant)| !constant.number.is_finite()) {
            let fact = format!("a constant must be finite, not {}", constant.number);
            return Err(definition::under(&definition::path(&["constants", key]), StudyError::here(fact)));
        }
        let expanded = filters::expanded(controllers::expanded(options.clone())?)?;
        let model = Definition::read(&expanded).and_then(|mut definition| {
            tables::replace(&mut definition, options, files)?;
            Self::compile(definition, horizon, options.tolerance)
        });
        let mut model = model.map_err(|mistake| controllers::at_its_key(mistake, options))?;
        model.notes.extend(filters::notes(options));
        Ok(model)
    }

    fn compile(mut definition: Definition, horizon: Option<f64>, tolerance: Tolerance) -> Result<Self, StudyError> {
        let system = System::new(&definition, &[])?;
        let measured = dimensions::check(&definition, &system.joints)?;
        measured.declare(&mut definition);
        let d = &definition;
        let (parameters, starts) = parameters(d, &system)?;
        let names: Vec<&str> = d.states.iter().map(|s| s.name.as_str()).collect();
        let compiled = Compiled::new(&system, &names, [d.inputs.len(), 0], d.parameters.len())?;
        let variable =
            |q: &definition::Declared| Variable { name: q.name.clone(), unit: q.unit.clone(), about: q.about.clone() };
        let signals = d.states.iter().chain(d.outputs.iter().map(|(output, _)| output)).chain(&d.inputs);
        let state = |(s, start): (usize, &Start)| {
            let (Start::Parameter(parameter) | Start::Expression(parameter)) = *start;
            let position = system.joints.iter().find(|(_, velocity)| *velocity == s).map(|(position, _)| *position);
            State {
                name: names[s].to_owned(),
                start: parameters[parameter].variable.name.clone(),
                signal: Some(names[s].to_owned()),
                rate_of: position.map(|position| names[position].to_owned()),
            }
        };
        let interface = Interface {
            signals: signals.map(variable).collect(),
            states: starts.iter().enumerate().map(state).collect(),
            inputs: d.inputs.iter().map(variable).collect(),
            ports: ports(d, &system, &measured.forces)?,
            parameters,
            horizon,
            ..Interface::default()
        };
        let notes = measured.notes;
        Ok(Self { definition, interface, compiled, starts, tolerance, notes, opened: OnceLock::new() })
    }

    /// Returns the coherent unit of a named expression; `None` if there is no such expression.
    fn unit_of_let(&self, name: &str) -> Result<Option<Unit>, StudyError> {
        let mut definition = self.definition.clone();
        let Some((_, text)) = definition.lets.iter().find(|(known, _)| known == name).cloned() else { return Ok(None) };
        let output = definition::Declared {
            name: format!("-{name}"),
            unit: Unit::one(),
            open: true,
            about: String::new(),
            path: text.path.clone(),
        };
        definition.outputs.push((output, text));
        let system = System::new(&definition, &[])?;
        dimensions::check(&definition, &system.joints)?.declare(&mut definition);
        Ok(definition.outputs.last().map(|(output, _)| output.unit.clone()))
    }

    /// Returns the pairs of derivative and state in which the derivative depends on the state.
    pub fn jacobian_pattern(&self) -> &[(usize, usize)] {
        &self.compiled.pattern
    }

    /// Returns the number of instructions of the tape that computes the derivatives.
    pub fn instructions(&self) -> usize {
        self.compiled.derivative.len()
    }

    /// Returns the compiled equations with an additional input in every equation that is a port.
    fn opened(&self) -> &Compiled {
        self.opened.get_or_init(|| {
            let d = &self.definition;
            let state = |name: &String| d.states.iter().position(|s| s.name == *name);
            let process = |port: &Port| match port {
                Port::Process { state: name, .. } => state(name),
                _ => None,
            };
            let ports: Vec<usize> = self.interface.ports.iter().filter_map(process).collect();
            let names: Vec<&str> = d.states.iter().map(|s| s.name.as_str()).collect();
            let system = System::new(d, &ports).expect("it was compiled before");
            Compiled::new(&system, &names, [d.inputs.len(), ports.len()], d.parameters.len())
                .expect("a few more inputs fit")
        })
    }

    /// Returns the plant. With few registers, their indices need no bounds check.
    fn running<'a, S: Scalar>(&'a self, compiled: &'a Compiled, parameters: &'a [S]) -> Box<dyn Plant<S> + 'a> {
        if compiled.layout.registers <= FEW {
            Box::new(self.started::<S, Small<S>>(Running::new(compiled, parameters, self.tolerance), parameters))
        } else {
            Box::new(self.started::<S, Large<S>>(Running::new(compiled, parameters, self.tolerance), parameters))
        }
    }

    /// Sets the initial states: those of parameters, or of expressions if the parameter is NaN because it was not
    /// given.
    fn started<'a, S: Scalar, B: Bank<S>>(&self, plant: Running<'a, S, B>, parameters: &[S]) -> Running<'a, S, B> {
        let expressions: HashMap<usize, S> = plant.starts().into_iter().collect();
        let start = |(s, start): (usize, &Start)| match *start {
            Start::Expression(parameter) if parameters[parameter].value().is_nan() => expressions[&s],
            Start::Parameter(parameter) | Start::Expression(parameter) => parameters[parameter],
        };
        plant.starting_at(self.starts.iter().enumerate().map(start).collect())
    }
}

impl PlantModel for Equations {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn states(&self) -> Vec<Variable> {
        self.interface.signals[..self.compiled.states].to_vec()
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    fn cut(&self, variables: &[String]) -> Option<Result<Cut, StudyError>> {
        let mut definition = self.definition.clone();
        let cut = variables.iter().try_for_each(|variable| {
            let unit = self.unit_of_let(variable)?;
            definition.cut(variable, unit)
        });
        let model = cut.and_then(|()| Self::compile(definition, self.interface.horizon, self.tolerance));
        Some(model.map(|model| {
            let Definition { states, outputs, inputs, .. } = &model.definition;
            let first = [inputs.len(), states.len() + outputs.len()].map(|end| end - variables.len());
            let ends = (0..variables.len()).map(|i| first.map(|first| first + i)).collect();
            Cut { ends, model: Arc::new(Simulated::new(model)) }
        }))
    }

    fn constants(&self) -> Vec<(Variable, f64)> {
        let declared = self.definition.constants.iter().filter(|constant| constant.is_declared());
        let variable = |constant: &definition::Constant| {
            let unit = constant.unit.clone().unwrap_or_else(Unit::one);
            let value = (constant.value - unit.zero()) / unit.factor();
            (Variable { name: constant.name.clone(), unit, about: String::new() }, value)
        };
        declared.map(variable).collect()
    }

    fn with_constant(&self, name: &str, value: f64) -> Option<Arc<dyn Model>> {
        let mut definition = self.definition.clone();
        let mut declared = definition.constants.iter_mut().filter(|constant| constant.is_declared());
        let constant = declared.find(|constant| constant.name == name)?;
        constant.value = constant.unit.as_ref().map_or(value, |unit| value * unit.factor() + unit.zero());
        let model = Self::compile(definition, self.interface.horizon, self.tolerance).ok()?;
        Some(Arc::new(Simulated::new(model)))
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(self.running(&self.compiled, parameters))
    }

    fn ported_plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(self.running(self.opened(), parameters))
    }
}
