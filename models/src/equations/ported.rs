//! A model from text, opened at its ports.

use std::cell::RefCell;

use mops_core::enclosure::Enclosure;
use mops_core::{Along, Failure, Instant, Open, Plant, Port, Scalar, Span, Tolerance};

use super::Equations;
use super::bank::{Bank, Large, Small};
use super::compiled::{Compiled, Signal};
use super::running::Running;
use super::system::System;
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
        if model.layout.registers <= 256 {
            self.ported::<S, Small<S>>(Running::new(model, drives, parameters, self.tolerance), parameters)
        } else {
            self.ported::<S, Large<S>>(Running::new(model, drives, parameters, self.tolerance), parameters)
        }
    }

    fn ported<'a, S: Scalar, B: Bank<S> + 'a>(
        &self,
        running: Running<'a, S, Vec<S>, B>,
        parameters: &[S],
    ) -> Result<Box<dyn Plant<S> + 'a>, Failure> {
        let start = self.start(&running, parameters);
        running.check_start(&start)?;
        Ok(Box::new(Ported { x: RefCell::new(start.clone()), start, running: RefCell::new(running) }))
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

/// The equations as a plant. Rates, which are asked for most, take inputs and forces straight into their registers.
struct Ported<'a, S, B> {
    start: Vec<S>,
    running: RefCell<Running<'a, S, Vec<S>, B>>,
    /// A state to look at guards with.
    x: RefCell<Vec<S>>,
}

impl<S: Scalar, B: Bank<S>> Ported<'_, S, B> {
    fn hold(&self, at: &Instant<'_, S>) {
        self.running.borrow_mut().hold_drives(at.u.iter().chain(at.w).copied());
    }
}

impl<S: Scalar, B: Bank<S>> Plant<S> for Ported<'_, S, B> {
    fn start(&self) -> Vec<S> {
        self.start.clone()
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        self.running.borrow().open_rates(at, dx);
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        let model = self.running.borrow().model;
        if let Signal::State(state) = &model.signals[signal] {
            return at.x[*state];
        }
        self.hold(at);
        self.running.borrow().signal(signal, at.t, at.x)
    }

    fn guards(&self) -> usize {
        self.running.borrow().guards()
    }

    fn guard(&self, index: usize, at: &Instant<'_, S>) -> S {
        self.hold(at);
        let mut x = self.x.borrow_mut();
        x.copy_from_slice(at.x);
        self.running.borrow().guard(index, at.t, &x)
    }

    fn switch(&mut self, index: usize, at: &Instant<'_, S>, x: &mut [S]) -> &str {
        self.hold(at);
        let next = self.x.get_mut();
        next.copy_from_slice(at.x);
        let what = self.running.get_mut().switch(index, at.t, next);
        x.copy_from_slice(next);
        what
    }

    fn has_bounds(&self) -> bool {
        true
    }

    fn enclose_guard(&self, index: usize, over: &Span<'_>) -> Enclosure {
        self.running.borrow().enclose(index, over.time, over.x, over.u.iter().chain(over.w).copied())
    }

    fn rest(&mut self, index: usize, at: &Instant<'_, S>, close: f64, x: &mut [S]) -> Result<&str, String> {
        self.hold(at);
        let next = self.x.get_mut();
        next.copy_from_slice(at.x);
        let what = self.running.get_mut().rest(index, at.t, close, next)?;
        x.copy_from_slice(next);
        Ok(what)
    }

    fn scale(&self, state: usize) -> Option<f64> {
        self.running.borrow().scale(state)
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        self.hold(at);
        let x = self.x.get_mut();
        x.copy_from_slice(at.x);
        self.running.get_mut().pass_break(at.t, x);
    }
}
