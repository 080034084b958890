//! Which register holds what, the same for all tapes of a model.

use std::collections::HashMap;

use super::bank::Register;
use super::graph::{Graph, Id, Level, Op};

/// Where parameters, states, inputs, time, modes and hoisted numbers stand.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    parameters: usize,
    states: usize,
    inputs: usize,
    modes: usize,
    /// Nodes that are computed once in a simulation.
    pub hoisted: Vec<Id>,
    /// Their registers.
    pub places: HashMap<Id, Register>,
    /// Registers in use by the largest tape.
    pub registers: usize,
}

/// A model too large for the registers there are.
#[derive(Debug)]
pub struct TooLarge;

/// The register at a place.
pub fn register(place: usize) -> Result<Register, TooLarge> {
    Register::try_from(place).map_err(|_| TooLarge)
}

impl Layout {
    /// The layout of a model of this size.
    pub fn new(parameters: usize, states: usize, inputs: usize, modes: usize) -> Result<Self, TooLarge> {
        let registers = parameters + states + inputs + 1 + modes;
        register(registers)?;
        Ok(Self { parameters, states, inputs, modes, registers, ..Self::default() })
    }

    #[allow(clippy::cast_possible_truncation)]
    fn place(place: usize) -> Register {
        place as Register
    }

    /// The register of a parameter.
    pub fn parameter(&self, index: usize) -> Register {
        Self::place(index)
    }

    /// The register of a state.
    #[inline]
    pub fn state(&self, index: usize) -> Register {
        Self::place(self.parameters + index)
    }

    /// The register of an input.
    #[inline]
    pub fn input(&self, index: usize) -> Register {
        Self::place(self.parameters + self.states + index)
    }

    /// The register of time.
    #[inline]
    pub fn time(&self) -> Register {
        Self::place(self.parameters + self.states + self.inputs)
    }

    /// The register of a mode.
    pub fn mode(&self, index: usize) -> Register {
        Self::place(self.parameters + self.states + self.inputs + 1 + index)
    }

    /// The register of a node that all tapes share: a leaf, or a number that is computed once in a simulation.
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

    /// The first register that tapes have to themselves.
    pub fn first_free(&self) -> usize {
        self.parameters + self.states + self.inputs + 1 + self.modes + self.hoisted.len()
    }
}
