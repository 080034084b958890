//! A model from text, opened at its ports.

use std::cell::RefCell;

use mops_core::{Along, Failure, Instant, Open, Plant, Port, Scalar, Tolerance};

use super::bank::Large;
use super::compiled::Compiled;
use super::running::Running;
use super::system::System;
use super::{Equations, Many};
use crate::kernel::Dynamics;
use crate::kernel::drive::Drive;

impl Equations {
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
            Compiled::new(&system, &names, d.inputs.len() + ports.len(), d.parameters.len())
                .expect("a few inputs more do not make it too large")
        })
    }

    fn plant<'a, S: Scalar>(&'a self, parameters: &'a [S]) -> Result<Box<dyn Plant<S> + 'a>, Failure> {
        let model = self.opened();
        let ports = self.interface.ports.iter().filter(|port| matches!(port, Port::Process { .. })).count();
        let drives = vec![Drive::held(S::from(0.0)); self.definition.inputs.len() + ports];
        let running: Running<'_, S, Vec<S>, Large<S>> = Running::new(model, drives, parameters, self.tolerance);
        let start = self.start(&running, parameters);
        running.check_start(&start)?;
        Ok(Box::new(Opened {
            start,
            at: RefCell::new(Held { running, x: Vec::new(), dx: vec![S::from(0.0); model.states] }),
        }))
    }
}

impl Open for Equations {
    fn open<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure> {
        self.plant(parameters)
    }

    fn open_along<'a>(&'a self, parameters: &'a [Along]) -> Result<Box<dyn Plant<Along> + 'a>, Failure> {
        self.plant(parameters)
    }

    fn tolerance(&self) -> Tolerance {
        self.tolerance
    }
}

/// A running model whose inputs and forces are set anew at every look.
struct Opened<'a, S> {
    start: Vec<S>,
    at: RefCell<Held<'a, S>>,
}

struct Held<'a, S> {
    running: Running<'a, S, Vec<S>, Many<S>>,
    x: Vec<S>,
    dx: Vec<S>,
}

impl<S: Scalar> Held<'_, S> {
    fn look(&mut self, at: &Instant<'_, S>) {
        self.running.hold(at.u.iter().chain(at.w).copied());
        self.x.clear();
        self.x.extend_from_slice(at.x);
    }
}

impl<S: Scalar> Plant<S> for Opened<'_, S> {
    fn start(&self) -> Vec<S> {
        self.start.clone()
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let mut held = self.at.borrow_mut();
        let held = &mut *held;
        held.look(at);
        held.running.derivative(at.t, &held.x, &mut held.dx);
        dx.copy_from_slice(&held.dx);
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        let mut held = self.at.borrow_mut();
        held.look(at);
        held.running.signal(signal, at.t, &held.x)
    }

    fn shows(&self, signal: usize) -> Option<usize> {
        self.at.borrow().running.shows(signal)
    }

    fn guards(&self) -> usize {
        self.at.borrow().running.guards()
    }

    fn guard(&self, index: usize, at: &Instant<'_, S>) -> S {
        let mut held = self.at.borrow_mut();
        held.look(at);
        held.running.guard(index, at.t, &held.x)
    }

    fn switch(&mut self, index: usize, at: &Instant<'_, S>, x: &mut [S]) -> &str {
        let held = self.at.get_mut();
        held.look(at);
        let what = held.running.switch(index, at.t, &mut held.x);
        x.copy_from_slice(&held.x);
        what
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        let held = self.at.get_mut();
        held.look(at);
        held.running.pass_break(at.t, &mut held.x);
    }
}
