//! Compiled model: one tape for the derivatives, and small tapes for guards, resets and signals.

use mops_core::StudyError;
use mops_linear::{self as linear, column_groups};

use super::graph::{Id, Level, Op};
use super::layout::Layout;
use super::program::Program;
use super::system::{self, Contact, System};
use super::tape::compile;

/// Source of a signal.
#[derive(Debug)]
pub enum Signal {
    /// A state.
    State(usize),
    /// An input.
    Input(usize),
    /// A computed signal.
    Tape(Program),
}

/// Condition that switches branches.
#[derive(Debug)]
pub struct Switch {
    /// Mode: 1 while the condition is true.
    pub mode: usize,
    /// True if equality does not satisfy the condition.
    pub strict: bool,
    /// True if the branches differ where they meet.
    pub jumps: bool,
    /// Computes the difference of the sides of the condition, and its right side.
    pub sides: Program,
}

/// Joint with dry friction.
#[derive(Debug)]
pub struct Joint {
    /// States and modes.
    pub contact: Contact,
    /// Computes the torque that the stuck joint requires, its break-away torque, its sliding friction and its
    /// acceleration.
    pub balance: Program,
    /// True if the friction depends on parameters only.
    pub is_fixed: bool,
    /// Event text when the joint comes to rest.
    pub sticks: String,
    /// Event text when the joint breaks away.
    pub slides: String,
}

/// Event defined by the user.
#[derive(Debug)]
pub struct Happening {
    /// Name of the event.
    pub name: String,
    /// Computes the guard.
    pub guard: Program,
    /// States that the event resets; computes their new values.
    pub resets: (Vec<usize>, Program),
    /// States with a rest value; computes the values at which accumulating events end. Empty if the study gives none.
    pub at_rest: (Vec<usize>, Program),
    /// Event text when the states come to rest.
    pub rests: String,
    /// Event text when the states leave rest.
    pub leaves: String,
}

/// Compiled model.
#[derive(Debug)]
pub struct Compiled {
    /// Number of states.
    pub states: usize,
    /// Typical sizes of the states, if declared.
    pub scales: Vec<Option<f64>>,
    /// Number of parameters of the equations, excluding those that are only initial values.
    pub parameters: usize,
    /// True if the equations contain external forces, as inputs after the others.
    pub takes_forces: bool,
    /// Assignment of registers.
    pub layout: Layout,
    /// Tape that runs once per simulation, when the parameters are known.
    pub setup: Program,
    /// Computes the derivatives.
    pub derivative: Program,
    /// Signals.
    pub signals: Vec<Signal>,
    /// Conditions.
    pub switches: Vec<Switch>,
    /// Arguments that must increase: description and whether strictly; computes pairs of low and high.
    pub orders: (Vec<(String, bool)>, Program),
    /// Places of the values that conditions select, with the rates and delayed quantities that they act on; computes
    /// each value and the other one.
    pub selections: (Vec<(String, Vec<usize>)>, Program),
    /// Joints with dry friction.
    pub joints: Vec<Joint>,
    /// Events.
    pub happenings: Vec<Happening>,
    /// Clocks, with the program for the new values of their memory.
    pub clocks: Vec<(linear::Clock, Program)>,
    /// Computes the delayed quantities, which are inputs after all others.
    pub delayed: Program,
    /// Computes the delays, s.
    pub delays: Program,
    /// States whose initial values are expressions; computes these values.
    pub starts: (Vec<usize>, Program),
    /// Computes the entries of the matrices of equations solved together.
    pub matrices: Vec<Program>,
    /// Pairs of derivative and state in which the derivative depends on the state.
    pub pattern: Vec<(usize, usize)>,
    /// Groups of columns of the Jacobian that share no row.
    pub columns: Vec<Vec<Column>>,
}

/// Column of the Jacobian, and its rows.
pub type Column = (usize, Vec<usize>);

/// Groups the columns of the Jacobian so that no two columns of a group share a row.
fn grouped(pattern: &[(usize, usize)], states: usize) -> Vec<Vec<Column>> {
    let mut rows = vec![Vec::new(); states];
    for &(row, column) in pattern {
        rows[column].push(row);
    }
    let columns = |group: Vec<usize>| group.into_iter().map(|column| (column, rows[column].clone())).collect();
    column_groups(&rows).into_iter().map(columns).collect()
}

impl Compiled {
    /// Compiles a model with these names of states and these numbers of inputs, external forces and parameters.
    ///
    /// # Errors
    /// The model needs more than 65536 registers.
    pub fn new(
        system: &System,
        names: &[&str],
        [inputs, forces]: [usize; 2],
        parameters: usize,
    ) -> Result<Self, StudyError> {
        let graph = &system.graph;
        let mut wanted: Vec<Vec<Id>> = vec![system.derivatives.clone()];
        let mut graph = graph.clone();
        for switch in &system.switches {
            wanted.push(vec![graph.sub(switch.left, switch.right), switch.right]);
        }
        wanted.push(system.orders.iter().flat_map(|order| [order.low, order.high]).collect());
        let places = system.acting_selections();
        wanted.push(places.iter().flat_map(|(selection, _)| [selection.taken, selection.other]).collect());
        for c in &system.contacts {
            wanted.push(vec![c.torque, c.limit, c.coulomb, system.derivatives[c.velocity]]);
        }
        for happening in &system.happenings {
            wanted.push(vec![happening.guard]);
            wanted.push(happening.resets.iter().map(|(_, id)| *id).collect());
            wanted.push(happening.at_rest.iter().map(|(_, id)| *id).collect());
        }
        wanted.extend(system.clocks.iter().map(|(_, next)| next.clone()));
        wanted.push(system.delays.iter().map(|(of, _)| *of).collect());
        wanted.push(system.delays.iter().map(|(_, time)| *time).collect());
        let starts: Vec<(usize, Id)> =
            system.starts.iter().enumerate().filter_map(|(s, start)| Some((s, (*start)?))).collect();
        wanted.push(starts.iter().map(|(_, id)| *id).collect());
        wanted.extend(system.matrices.iter().cloned());
        wanted.extend(system.signals.iter().map(|&id| vec![id]));

        let too_large = |_| {
            StudyError::new("states", "the model needs more than 65536 registers")
                .with_help("write a model of this size in Rust")
        };
        let mut layout = Layout::new(parameters, names.len(), inputs + forces + system.delays.len(), system.modes)
            .map_err(too_large)?;
        let (setup, programs) = compile(&graph, &mut layout, &wanted).map_err(too_large)?;
        let mut programs = programs.into_iter();
        let mut next = || programs.next().expect("every request has a tape");
        let derivative = next();
        let switches =
            system.switches.iter().map(|s| Switch { mode: s.mode, strict: s.strict, jumps: s.jumps, sides: next() });
        let switches = switches.collect();
        let orders = (system.orders.iter().map(|order| (order.what.clone(), order.strict)).collect(), next());
        let places = places.into_iter().map(|(selection, rates)| (selection.what.clone(), rates)).collect();
        let selections = (places, next());
        let joint = |contact: &Contact, balance| Joint {
            contact: *contact,
            balance,
            is_fixed: [contact.coulomb, contact.limit].iter().all(|&id| graph.level(id) <= Level::Parameter),
            sticks: format!("{} sticks", names[contact.position]),
            slides: format!("{} slides", names[contact.position]),
        };
        let joints = system.contacts.iter().map(|contact| joint(contact, next())).collect();
        let states = |values: &[(usize, Id)]| values.iter().map(|(state, _)| *state).collect();
        let happening = |h: &system::Happening| Happening {
            name: h.name.clone(),
            guard: next(),
            resets: (states(&h.resets), next()),
            at_rest: (states(&h.at_rest), next()),
            rests: format!("{}: at rest", h.name),
            leaves: format!("{}: leaves rest", h.name),
        };
        let happenings = system.happenings.iter().map(happening).collect();
        let clocks = system.clocks.iter().map(|(clock, _)| (clock.clone(), next())).collect();
        let (delayed, delays) = (next(), next());
        let starts = (starts.iter().map(|(s, _)| *s).collect(), next());
        let matrices = system.matrices.iter().map(|_| next()).collect();
        let signals = system
            .signals
            .iter()
            .map(|&id| {
                let tape = next();
                match graph.op(id) {
                    Op::State(state) => Signal::State(state),
                    // Forces and delayed quantities come after the declared inputs.
                    Op::Input(input) if input < inputs => Signal::Input(input),
                    _ => Signal::Tape(tape),
                }
            })
            .collect();
        let rows = system.derivatives.iter().enumerate();
        let pattern: Vec<(usize, usize)> =
            rows.flat_map(|(row, &id)| graph.states_of(id).into_iter().map(move |s| (row, s))).collect();
        let columns = grouped(&pattern, names.len());
        Ok(Self {
            states: names.len(),
            scales: system.scales.clone(),
            parameters,
            takes_forces: forces > 0,
            layout,
            setup,
            derivative,
            signals,
            switches,
            orders,
            selections,
            joints,
            happenings,
            clocks,
            delayed,
            delays,
            starts,
            matrices,
            pattern,
            columns,
        })
    }
}
