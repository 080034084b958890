//! Models written in the study file: their equations are read and compiled once, and run on a tape of their own.

mod compiled;
mod definition;
mod graph;
mod key;
mod lower;
mod options;
mod program;
mod running;
mod system;

use std::collections::HashMap;

use mops_core::{
    Analysis, AnalysisKind, Failure, Interface, Job, Mistake, Model, ModelOptions, Parameter, Port, Scalar, State,
    Unit, Variable, WithTangents,
};

use crate::kernel::{self, Recording, Simulate, Tolerance, record, wanted};
use compiled::Compiled;
use definition::{Definition, under};
pub use definition::{Target, Text};
use graph::Op;
pub use options::EquationsOptions;
use program::Bank;
use running::{Few, Many, Running};
use system::System;

impl ModelOptions for EquationsOptions {
    const KIND: &'static str = "equations";

    fn build(self) -> Result<Box<dyn Model>, Mistake> {
        Ok(Box::new(Equations::new(&self)?))
    }
}

/// Where a state starts.
#[derive(Debug, Clone, Copy)]
enum Start {
    /// At a parameter.
    Parameter(usize),
    /// At an expression, unless this parameter is given.
    Expression(usize),
}

/// The model of the kind `equations`.
pub struct Equations {
    definition: Definition,
    interface: Interface,
    compiled: Compiled,
    starts: Vec<Start>,
    tolerance: Tolerance,
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

    fn compile(definition: Definition, horizon: Option<f64>, tolerance: Tolerance) -> Result<Self, Mistake> {
        let d = &definition;
        let system = System::new(d)?;
        let (parameters, starts) = parameters(d, &system)?;
        let names: Vec<&str> = d.states.iter().map(|s| s.name.as_str()).collect();
        let compiled = Compiled::new(&system, &names, d.inputs.len(), d.parameters.len())?;
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
            ports: ports(d, &system)?,
            parameters,
            horizon,
            analysis: AnalysisKind::Time,
        };
        Ok(Self { definition, interface, compiled, starts, tolerance })
    }

    /// The same model with one more term at a port: `value` is an expression of the model's quantities, the numbers in it
    /// in their units. In the equation of a state it is added to the right-hand side, before a mass matrix is solved.
    ///
    /// # Errors
    /// A mistake in the expression.
    pub fn with_term(&self, target: Target, value: &str) -> Result<Self, Mistake> {
        let mut definition = self.definition.clone();
        let value = Text::read(Vec::new(), &options::Formula(value.to_owned()), None)?;
        definition.terms.push(definition::Term { target, value });
        Self::compile(definition, self.interface.horizon, self.tolerance)
    }

    /// Which derivative depends on which state: pairs of derivative and state.
    pub fn jacobian_pattern(&self) -> &[(usize, usize)] {
        &self.compiled.pattern
    }

    /// Number of instructions of the tape that gives the derivatives.
    pub fn instructions(&self) -> usize {
        self.compiled.derivative.len()
    }

    fn run<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>>(
        &self,
        job: &Job<'_>,
        parameters: &[S],
        state: impl FnOnce(&[S]) -> X,
    ) -> Result<Recording, Failure> {
        let inputs: Vec<&str> = self.interface.inputs.iter().map(|input| input.name.as_str()).collect();
        let mut dynamics: Running<'_, S, X, B> =
            Running::new(&self.compiled, &inputs, job.case, parameters, self.tolerance);
        let expressions: HashMap<usize, S> = dynamics.starts().into_iter().collect();
        let start = |(s, start): (usize, &Start)| match *start {
            Start::Parameter(parameter) => parameters[parameter],
            // A parameter that nobody gives is no number.
            Start::Expression(parameter) if parameters[parameter].value().is_nan() => expressions[&s],
            Start::Expression(parameter) => parameters[parameter],
        };
        let start: Vec<S> = self.starts.iter().enumerate().map(start).collect();
        let start = state(&start);
        dynamics.check_start(&start)?;
        let output =
            |dynamics: &Running<'_, S, X, B>, signal: usize, t: f64, x: &X| dynamics.signal(signal, t, x.as_ref());
        let signals = wanted(job, &self.interface.signals);
        record(&mut dynamics, start, job.horizon, &self.tolerance, &signals, &output).map_err(|f| dynamics.explain(f))
    }
}

impl Model for Equations {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        kernel::analyse(self, job)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        Some(kernel::tangents(self, job, seeds))
    }
}

impl Simulate for Equations {
    /// Small models run on arrays of known size and registers whose indices need no check: on vectors a simulation takes
    /// half as long again.
    fn simulate<S: Scalar>(&self, job: &Job<'_>, p: &[S]) -> Result<Recording, Failure> {
        fn array<S: Scalar, const N: usize>(x: &[S]) -> [S; N] {
            x.try_into().expect("the size was looked at")
        }
        let few = self.compiled.layout.registers <= 256;
        match self.compiled.states {
            1 if few => self.run::<S, [S; 1], Few<S>>(job, p, array),
            2 if few => self.run::<S, [S; 2], Few<S>>(job, p, array),
            3 if few => self.run::<S, [S; 3], Few<S>>(job, p, array),
            4 if few => self.run::<S, [S; 4], Few<S>>(job, p, array),
            _ if few => self.run::<S, Vec<S>, Few<S>>(job, p, <[S]>::to_vec),
            _ => self.run::<S, Vec<S>, Many<S>>(job, p, <[S]>::to_vec),
        }
    }
}

/// The parameters of the model: those declared, then start values; and where each state starts.
fn parameters(d: &Definition, system: &System) -> Result<(Vec<Parameter>, Vec<Start>), Mistake> {
    let declared = |p: &definition::Settable| Parameter {
        variable: Variable {
            name: p.quantity.name.clone(),
            unit: p.quantity.unit.clone(),
            about: p.quantity.about.clone(),
        },
        default: p.default,
        range: p.range,
    };
    let mut parameters: Vec<Parameter> = d.parameters.iter().map(declared).collect();
    let mut starts = Vec::new();
    for (state, start) in d.states.iter().zip(&system.starts) {
        if let Some(Op::Parameter(index)) = start.map(|id| system.graph.op(id)) {
            starts.push(Start::Parameter(index));
            continue;
        }
        let name = match state.name.split_once('[') {
            Some((family, index)) => format!("{family}0[{index}"),
            None => format!("{}0", state.name),
        };
        if let Some(taken) = d.parameters.iter().find(|p| p.quantity.name == name) {
            let mistake = Mistake::here(format!("the start value of `{}` is a parameter of this name", state.name));
            return Err(under(&taken.quantity.path, mistake).with_help(format!(
                "say start = {{ {} = \"{name}\" }} if it is meant, or take another name",
                state.name
            )));
        }
        let value = start.map_or(Some(0.0), |id| system.graph.constant(id));
        let about = format!("{} at the start", state.name);
        starts.push(match value {
            Some(_) => Start::Parameter(parameters.len()),
            None => Start::Expression(parameters.len()),
        });
        parameters.push(Parameter {
            variable: Variable { name, unit: state.unit.clone(), about },
            default: Some(value.unwrap_or(f64::NAN)),
            range: [f64::NEG_INFINITY, f64::INFINITY],
        });
    }
    Ok((parameters, starts))
}

/// Joints and the equations of all states but positions; inputs; states and outputs.
fn ports(d: &Definition, system: &System) -> Result<Vec<Port>, Mistake> {
    let name = |s: usize| d.states[s].name.clone();
    let given = |position: usize| d.ports.iter().find(|(_, joint, _)| *joint == d.states[position].name);
    for (_, joint, path) in &d.ports {
        if !system.joints.iter().any(|&(position, _)| d.states[position].name == *joint) {
            let names = system.joints.iter().map(|&(position, _)| d.states[position].name.as_str());
            return Err(under(path, Mistake::here(format!("`{joint}` is not the position of a joint")))
                .with_help(mops_core::suggestion(joint, names)));
        }
    }
    let mut ports = Vec::new();
    for s in 0..d.states.len() {
        if system.joints.iter().any(|&(position, _)| position == s) {
            continue;
        }
        let position = system.joints.iter().find(|&&(_, velocity)| velocity == s).map(|&(position, _)| position);
        let place = position.map_or_else(|| name(s), |p| given(p).map_or_else(|| name(p), |(name, ..)| name.clone()));
        if let Some(position) = position {
            ports.push(Port::Joint { name: place.clone(), position: name(position), velocity: name(s) });
        }
        ports.push(Port::Process { name: place, state: name(s) });
    }
    ports.extend(d.inputs.iter().map(|input| Port::Actuator { input: input.name.clone() }));
    let signals = d.states.iter().chain(d.outputs.iter().map(|(output, _)| output));
    ports.extend(signals.map(|signal| Port::Sensor { output: signal.name.clone() }));
    Ok(ports)
}

#[cfg(test)]
mod tests;
