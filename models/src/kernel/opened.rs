//! Dynamics opened at the ports of their model: inputs and forces are given anew at every look.

use std::cell::RefCell;

use mops_core::{Instant, Plant, Scalar};

use super::Dynamics;

/// Dynamics whose inputs can be held at values, and that take forces from outside.
pub trait Holds<S: Scalar>: Dynamics<S> {
    /// Holds inputs and forces at these values: inputs in the order of [`mops_core::Interface::inputs`], forces in that of
    /// the processes in [`mops_core::Interface::ports`].
    fn hold(&mut self, u: &[S], w: &[S]);
}

/// A [`Plant`] made of dynamics and of the function that gives its signals.
pub struct Opened<D, X, F> {
    start: X,
    signal: F,
    held: RefCell<Held<D, X>>,
}

struct Held<D, X> {
    dynamics: D,
    x: X,
    dx: X,
}

impl<D, X: Clone, F> Opened<D, X, F> {
    /// The plant that starts at `start`; `signal` gives the value of a signal by its index.
    pub fn new(dynamics: D, start: X, signal: F) -> Self {
        let held = Held { dynamics, x: start.clone(), dx: start.clone() };
        Self { start, signal, held: RefCell::new(held) }
    }
}

impl<D, X> Held<D, X> {
    fn look<S: Scalar>(&mut self, at: &Instant<'_, S>)
    where
        D: Holds<S, State = X>,
        X: AsMut<[S]>,
    {
        self.dynamics.hold(at.u, at.w);
        self.x.as_mut().copy_from_slice(at.x);
    }
}

impl<S: Scalar, D: Holds<S>, F: Fn(&D, usize, f64, &D::State) -> S> Plant<S> for Opened<D, D::State, F> {
    fn start(&self) -> Vec<S> {
        self.start.as_ref().to_vec()
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let mut held = self.held.borrow_mut();
        let held = &mut *held;
        held.look(at);
        held.dynamics.derivative(at.t, &held.x, &mut held.dx);
        dx.copy_from_slice(held.dx.as_ref());
    }

    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        let mut held = self.held.borrow_mut();
        held.look(at);
        (self.signal)(&held.dynamics, signal, at.t, &held.x)
    }

    fn guards(&self) -> usize {
        self.held.borrow().dynamics.guards()
    }

    fn guard(&self, index: usize, at: &Instant<'_, S>) -> S {
        let mut held = self.held.borrow_mut();
        held.look(at);
        held.dynamics.guard(index, at.t, &held.x)
    }

    fn switch(&mut self, index: usize, at: &Instant<'_, S>, x: &mut [S]) -> &str {
        let held = self.held.get_mut();
        held.look(at);
        let what = held.dynamics.switch(index, at.t, &mut held.x);
        x.copy_from_slice(held.x.as_ref());
        what
    }

    fn rest(&mut self, index: usize, at: &Instant<'_, S>, close: f64, x: &mut [S]) -> Result<&str, String> {
        let held = self.held.get_mut();
        held.look(at);
        let what = held.dynamics.rest(index, at.t, close, &mut held.x)?;
        x.copy_from_slice(held.x.as_ref());
        Ok(what)
    }

    fn scale(&self, state: usize) -> Option<f64> {
        self.held.borrow().dynamics.scale(state)
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        let held = self.held.get_mut();
        held.look(at);
        held.dynamics.pass_break(at.t, &mut held.x);
    }
}
