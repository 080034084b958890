//! Assignment of registers, the same for all tapes of a model.

use std::collections::HashMap;

use super::bank::Register;
use super::graph::{Graph, Id, Level, Op};

/// Registers of parameters, states, inputs, time, modes and hoisted numbers.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    parameters: usize,
    states: usize,
    inputs: usize,
    modes: usize,
    /// Nodes that are evaluated once per simulation.
    pub hoisted: Vec<Id>,
    /// Registers of the hoisted nodes.
    pub places: HashMap<Id, Register>,
    /// Number of registers of the largest tape.
    pub registers: usize,
}

/// Error of a model that needs more registers than available.
#[derive(Debug)]
pub struct TooLarge;

/// Returns the register with this index.
pub fn register(place: usize) -> Result<Register, TooLarge> {
    Register::try_from(place).map_err(|_| TooLarge)
}

impl Layout {
    /// Creates the layout of a model of this size.
    pub fn new(parameters: usize, states: usize, inputs: usize, modes: usize) -> Result<Self, TooLarge> {
        let registers = parameters + states + inputs + 1 + modes;
        register(registers)?;
        Ok(Self { parameters, states, inputs, modes, registers, ..Self::default() })
    }

    #[allow(clippy::cast_possible_truncation)]
    fn place(place: usize) -> Register {
        place as Register
    }

    /// Returns the register of a parameter.
    pub fn parameter(&self, index: usize) -> Register {
        Self::place(index)
    }

    /// Returns the register of a state.
    #[inline]
    pub fn state(&self, index: usize) -> Register {
        Self::place(self.parameters + index)
    }

    /// Returns the register of an input.
    #[inline]
    pub fn input(&self, index: usize) -> Register {
        Self::place(self.parameters + self.states + index)
    }

    /// Returns the register of time.
    #[inline]
    pub fn time(&self) -> Register {
        Self::place(self.parameters + self.states + self.inputs)
    }

    /// Returns the register of a mode.
    pub fn mode(&self, index: usize) -> Register {
        Self::place(self.parameters + self.states + self.inputs + 1 + index)
    }

    /// Returns the register of a node that all tapes share: a leaf, or a number that is evaluated once per simulation.
    pub fn shared(&mut self, graph: &Graph, id: Id) -> Result<Option<Register>, TooLarge> {
        Ok(Some(match graph.op(id) {
            Op::Parameter(index) => self.parameter(index),
            Op::State(index) => self.state(index),
            Op::Input(index) => self.input(index),
            Op::Time => self.time(),
            Op::Mode(index) => self.mode(index),
            _ if graph.level(id) == Level::Variable => return Ok(None),
            _ => match self.places.get(&id) {
                Some(place) => *place,
                None => {
                    let place = self.parameters + self.states + self.inputs + 1 + self.modes + self.hoisted.len();
                    self.hoisted.push(id);
                    self.places.insert(id, register(place)?);
                    register(place)?
                }
            },
        }))
    }

    /// Returns the first register that each tape uses for its own nodes.
    pub fn first_free(&self) -> usize {
        self.parameters + self.states + self.inputs + 1 + self.modes + self.hoisted.len()
    }
}
