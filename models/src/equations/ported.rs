//! A model from text, opened at its ports.

use mops_core::{Along, Failure, Open, Plant, Port, Scalar, Tolerance};

use super::bank::Large;
use super::compiled::Compiled;
use super::running::Running;
use super::system::System;
use super::{Equations, Many};
use crate::kernel::drive::Drive;
use crate::kernel::{Holds, Opened};

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
        let signal =
            |running: &Running<'_, S, Vec<S>, Many<S>>, signal: usize, t: f64, x: &Vec<S>| running.signal(signal, t, x);
        Ok(Box::new(Opened::new(running, start, signal)))
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

impl<S: Scalar> Holds<S> for Running<'_, S, Vec<S>, Many<S>> {
    fn hold(&mut self, u: &[S], w: &[S]) {
        self.hold_drives(u.iter().chain(w).copied());
    }
}
