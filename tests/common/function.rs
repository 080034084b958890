//! A model given by a function, and the criterion that reads its values.

use mops::{
    Analysis, Case, Criterion, CriterionSpec, Failure, Interface, Model, Parameter, StudyError, Trace, Unit, Value,
    Variable,
    core::{Job, Response},
};

/// Model with constant signals `fi = f(x)[i]`; without a value the simulation diverges.
pub struct Function {
    interface: Interface,
    f: fn(&[f64]) -> Option<Vec<f64>>,
}

impl Function {
    /// Creates a model with this number of values and these parameters.
    pub fn new(parameters: &[&str], values: usize, f: fn(&[f64]) -> Option<Vec<f64>>) -> Self {
        let interface = Interface {
            signals: (0..values).map(|i| Variable::new(format!("f{i}"), "1", "value")).collect(),
            parameters: parameters.iter().map(|name| Parameter::new(*name, "1", "coordinate")).collect(),
            horizon: Some(1.0),
            ..Interface::default()
        };
        Self { interface, f }
    }
}

impl Model for Function {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let values = (self.f)(job.parameters).ok_or(Failure::Diverged(0.5))?;
        let trace = |&i: &usize| {
            let mut trace = Trace::starting_at(0.0, 1);
            trace.push(1.0, Trace::NODES.map(|_| values[i]));
            (self.interface.signals[i].name.clone(), trace)
        };
        Ok(Analysis::Time(Response { traces: job.signals.iter().map(trace).collect(), ..Response::default() }))
    }
}

/// Final value of a signal.
#[derive(Clone)]
pub struct End(pub String);

impl CriterionSpec for End {
    fn bind(&self, _: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(self.clone()))
    }
}

impl Criterion for End {
    fn unit(&self) -> Unit {
        Unit::one()
    }
    fn signals(&self) -> Vec<String> {
        vec![self.0.clone()]
    }
    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        Ok(analysis.trace(&self.0).last().into())
    }
}
