//! Models written in the study file: their equations are read and compiled once, and run on a tape of their own.

mod bank;
mod bounds;
mod branches;
mod compiled;
mod definition;
mod dimensions;
mod graph;
mod happenings;
mod interface;
mod key;
mod layout;
mod lower;
mod modes;
mod options;
mod program;
mod running;
mod system;
mod tape;

use std::collections::HashMap;
use std::sync::OnceLock;

use mops_core::{
    AnalysisKind, Failure, Interface, Mistake, Model, ModelOptions, Plant, Port, Scalar, State, Unit, Variable,
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

    fn build(self) -> Result<Box<dyn Model>, Mistake> {
        Ok(Box::new(Simulated::new(Equations::new(&self)?)))
    }
}

/// The model of the kind `equations`.
pub struct Equations {
    definition: Definition,
    interface: Interface,
    compiled: Compiled,
    starts: Vec<Start>,
    tolerance: Tolerance,
    /// How numbers without units were read.
    notes: Vec<String>,
    /// The same with an input more in every equation that is a port; made at the first need.
    opened: OnceLock<Compiled>,
}

impl Equations {
    /// Reads, checks and compiles the equations.
    ///
    /// # Errors
    /// The first mistake, with the key it is under and its place in the expression.
    pub fn new(options: &EquationsOptions) -> Result<Self, Mistake> {
        options.tolerance.check()?;
        let horizon = options.horizon.as_ref().map(|q| q.to(&Unit::known("s"))).transpose();
        let horizon = horizon.map_err(|why| Mistake::new("horizon", why))?;
        Self::compile(Definition::read(options)?, horizon, options.tolerance)
    }

    fn compile(mut definition: Definition, horizon: Option<f64>, tolerance: Tolerance) -> Result<Self, Mistake> {
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
            analysis: AnalysisKind::Time,
        };
        let notes = measured.notes;
        Ok(Self { definition, interface, compiled, starts, tolerance, notes, opened: OnceLock::new() })
    }

    /// Which derivative depends on which state: pairs of derivative and state.
    pub fn jacobian_pattern(&self) -> &[(usize, usize)] {
        &self.compiled.pattern
    }

    /// Number of instructions of the tape that gives the derivatives.
    pub fn instructions(&self) -> usize {
        self.compiled.derivative.len()
    }

    /// The equations with an input more in every equation that is a port.
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
            let system = System::new(d, &ports).expect("it was read before");
            Compiled::new(&system, &names, [d.inputs.len(), ports.len()], d.parameters.len())
                .expect("a few inputs more do not make it too large")
        })
    }

    /// The plant; where its numbers fit into few registers, these need no check of their indices.
    fn running<'a, S: Scalar>(&'a self, compiled: &'a Compiled, parameters: &'a [S]) -> Box<dyn Plant<S> + 'a> {
        if compiled.layout.registers <= FEW {
            Box::new(self.started::<S, Small<S>>(Running::new(compiled, parameters, self.tolerance), parameters))
        } else {
            Box::new(self.started::<S, Large<S>>(Running::new(compiled, parameters, self.tolerance), parameters))
        }
    }

    /// The plant at its start: states are those of parameters, or of expressions where the parameter is no number, as nobody
    /// gives it.
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

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(self.running(&self.compiled, parameters))
    }

    fn open_plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<impl Plant<S>, Failure> {
        Ok(self.running(self.opened(), parameters))
    }
}

#[cfg(test)]
mod tests;
