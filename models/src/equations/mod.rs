//! Models written in the study file: their equations are read and compiled once, and run on a tape of their own.

mod bank;
mod bounds;
mod branches;
mod compiled;
mod definition;
mod graph;
mod happenings;
mod interface;
mod key;
mod layout;
mod lower;
mod modes;
mod options;
mod ported;
mod program;
mod running;
mod system;
mod tape;

use std::collections::HashMap;
use std::sync::OnceLock;

use mops_core::{
    Analysis, AnalysisKind, Failure, Interface, Job, Local, Mistake, Model, ModelOptions, Open, OperatingPoint, Scalar,
    State, Unit, Variable, WithTangents,
};

use crate::kernel::drive::Drive;
use crate::kernel::{self, Recording, Simulate, Tolerance, rates_and_signals, record, wanted};
use bank::{Bank, Large as Many, Small};
use compiled::Compiled;
use definition::Definition;
pub use definition::{Target, Text};
use interface::{Start, parameters, ports};
pub use options::EquationsOptions;
use running::Running;
use system::System;

impl ModelOptions for EquationsOptions {
    const KIND: &'static str = "equations";

    fn build(self) -> Result<Box<dyn Model>, Mistake> {
        Ok(Box::new(Equations::new(&self)?))
    }
}

/// Registers of a model that fits into few, without tangents.
type Few = Small<f64>;

/// The model of the kind `equations`.
pub struct Equations {
    definition: Definition,
    interface: Interface,
    compiled: Compiled,
    starts: Vec<Start>,
    tolerance: Tolerance,
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

    fn compile(definition: Definition, horizon: Option<f64>, tolerance: Tolerance) -> Result<Self, Mistake> {
        let d = &definition;
        let system = System::new(d, &[])?;
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
        Ok(Self { definition, interface, compiled, starts, tolerance, opened: OnceLock::new() })
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

    /// Values of the states at the start: of parameters, or of expressions where the parameter is no number, as nobody
    /// gives it.
    fn start<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>>(
        &self,
        dynamics: &Running<'_, S, X, B>,
        parameters: &[S],
    ) -> Vec<S> {
        let expressions: HashMap<usize, S> = dynamics.starts().into_iter().collect();
        let start = |(s, start): (usize, &Start)| match *start {
            Start::Expression(parameter) if parameters[parameter].value().is_nan() => expressions[&s],
            Start::Parameter(parameter) | Start::Expression(parameter) => parameters[parameter],
        };
        self.starts.iter().enumerate().map(start).collect()
    }

    /// The dynamics with constant inputs.
    fn held<'a, S: Scalar>(&'a self, at: &OperatingPoint<'a, S>) -> Running<'a, S, Vec<S>, Many<S>> {
        let drives = at.inputs.iter().map(|&u| Drive::held(u)).collect();
        Running::new(&self.compiled, drives, at.parameters, self.tolerance)
    }

    fn run<S: Scalar, X: AsRef<[S]> + AsMut<[S]> + Clone, B: Bank<S>>(
        &self,
        job: &Job<'_>,
        parameters: &[S],
        state: impl FnOnce(&[S]) -> X,
    ) -> Result<Recording, Failure> {
        let drives = self.interface.inputs.iter().map(|input| Drive::new(job.case.input(&input.name))).collect();
        let mut dynamics: Running<'_, S, X, B> = Running::new(&self.compiled, drives, parameters, self.tolerance);
        let start = state(&self.start(&dynamics, parameters));
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
        self.values(job).map(|recording| Analysis::Time(recording.response))
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        Some(kernel::tangents(self, job, seeds))
    }

    fn equation_states(&self) -> Vec<Variable> {
        self.interface.signals[..self.compiled.states].to_vec()
    }

    fn start_values(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let drives = self.interface.inputs.iter().map(|_| Drive::held(0.0)).collect();
        let dynamics: Running<'_, f64, Vec<f64>, Many<f64>> =
            Running::new(&self.compiled, drives, parameters, self.tolerance);
        Some(self.start(&dynamics, parameters))
    }

    fn local(&self, at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
        Some(kernel::local(self, at))
    }

    fn ported(&self) -> Option<&dyn Open> {
        Some(self)
    }
}

impl kernel::Equations for Equations {
    /// At time 0; joints at rest without dry friction.
    fn equations<S: Scalar>(&self, at: &OperatingPoint<'_, S>) -> Result<[Vec<S>; 2], Failure> {
        let mut dynamics = self.held(at);
        dynamics.look(at);
        let output = |dynamics: &Running<'_, S, Vec<S>, Many<S>>, signal: usize, t: f64, x: &Vec<S>| {
            dynamics.signal(signal, t, x)
        };
        Ok(rates_and_signals(&dynamics, &at.states.to_vec(), self.interface.signals.len(), &output))
    }

    fn frictionless(&self, at: &OperatingPoint<'_>) -> Vec<String> {
        let positions = self.held(at).look(at);
        positions.into_iter().map(|position| self.interface.signals[position].name.clone()).collect()
    }
}

impl Simulate for Equations {
    fn simulate<S: Scalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        self.run::<S, Vec<S>, Many<S>>(job, parameters, <[S]>::to_vec)
    }
}

impl Equations {
    /// Without tangents small models run on arrays of known size, and on registers whose indices need no check: on vectors
    /// a simulation takes half as long again. The operations are the same, and so are the bits.
    fn values(&self, job: &Job<'_>) -> Result<Recording, Failure> {
        fn array<const N: usize>(x: &[f64]) -> [f64; N] {
            x.try_into().expect("the size was looked at")
        }
        let few = self.compiled.layout.registers <= 256;
        match self.compiled.states {
            1 if few => self.run::<f64, [f64; 1], Few>(job, job.parameters, array),
            2 if few => self.run::<f64, [f64; 2], Few>(job, job.parameters, array),
            3 if few => self.run::<f64, [f64; 3], Few>(job, job.parameters, array),
            4 if few => self.run::<f64, [f64; 4], Few>(job, job.parameters, array),
            _ if few => self.run::<f64, Vec<f64>, Few>(job, job.parameters, <[f64]>::to_vec),
            _ => self.simulate(job, job.parameters),
        }
    }
}

#[cfg(test)]
mod tests;
