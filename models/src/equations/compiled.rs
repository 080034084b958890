//! A model ready to run: one tape for the derivatives, and small ones for guards, resets and signals.

use mops_core::Mistake;

use super::graph::{Id, Op};
use super::layout::Layout;
use super::program::Program;
use super::system::{Contact, System};
use super::tape::compile;
use crate::kernel::groups;

/// Where a signal comes from.
#[derive(Debug)]
pub enum Signal {
    /// It is a state.
    State(usize),
    /// It is an input.
    Input(usize),
    /// It is computed.
    Tape(Program),
}

/// A condition that switches branches.
#[derive(Debug)]
pub struct Switch {
    /// Mode: 1 while it holds.
    pub mode: usize,
    /// Whether equality does not count.
    pub strict: bool,
    /// Whether the branches differ where they meet.
    pub jumps: bool,
    /// Gives the difference of the sides of the condition, and its right side.
    pub sides: Program,
}

/// Dry friction.
#[derive(Debug)]
pub struct Joint {
    /// States and modes.
    pub contact: Contact,
    /// Gives the torque that holds it, what breaks it away, friction while it slides, and its acceleration.
    pub balance: Program,
    /// What is reported where it comes to rest.
    pub sticks: String,
    /// What is reported where it breaks away.
    pub slides: String,
}

/// An event of the user's.
#[derive(Debug)]
pub struct Happening {
    /// Its name.
    pub name: String,
    /// Gives its guard.
    pub guard: Program,
    /// Gives the new values of these states.
    pub resets: (Vec<usize>, Program),
    /// Gives the values of these states where its events accumulate; no states where nothing is known of a rest.
    pub at_rest: (Vec<usize>, Program),
    /// What is reported where it comes to rest.
    pub rests: String,
    /// What is reported where it leaves its rest.
    pub leaves: String,
}

/// A compiled model.
#[derive(Debug)]
pub struct Compiled {
    /// Number of states.
    pub states: usize,
    /// Their typical sizes, where they are declared.
    pub scales: Vec<Option<f64>>,
    /// Number of parameters of the equations, without those that only are start values.
    pub parameters: usize,
    /// Whether forces from outside enter its equations, as inputs after the others.
    pub takes_forces: bool,
    /// Registers.
    pub layout: Layout,
    /// Runs once in a simulation, when parameters are known.
    pub setup: Program,
    /// Gives the derivatives.
    pub derivative: Program,
    /// Signals.
    pub signals: Vec<Signal>,
    /// Conditions.
    pub switches: Vec<Switch>,
    /// What must rise for a message and whether strictly; gives pairs of low and high.
    pub orders: (Vec<(String, bool)>, Program),
    /// Joints with dry friction.
    pub joints: Vec<Joint>,
    /// Events.
    pub happenings: Vec<Happening>,
    /// Gives the start values that are expressions; their states.
    pub starts: (Vec<usize>, Program),
    /// Gives the entries of matrices; their sizes.
    pub matrices: Vec<Program>,
    /// Which state a derivative depends on: derivative, state.
    pub pattern: Vec<(usize, usize)>,
    /// Columns of the Jacobian in groups that share no row: column, its rows.
    pub columns: Vec<Vec<Column>>,
}

/// A column of the Jacobian, and its rows.
pub type Column = (usize, Vec<usize>);

/// Groups of columns of which no two meet in a row.
fn grouped(pattern: &[(usize, usize)], states: usize) -> Vec<Vec<Column>> {
    let mut rows = vec![Vec::new(); states];
    for &(row, column) in pattern {
        rows[column].push(row);
    }
    let columns = |group: Vec<usize>| group.into_iter().map(|column| (column, rows[column].clone())).collect();
    groups(&rows).into_iter().map(columns).collect()
}

impl Compiled {
    /// Compiles a model whose states have these names, with a number of inputs, of forces from outside, and of parameters.
    ///
    /// # Errors
    /// A model with more than 65536 numbers at a time.
    pub fn new(
        system: &System,
        names: &[&str],
        [inputs, forces]: [usize; 2],
        parameters: usize,
    ) -> Result<Self, Mistake> {
        let graph = &system.graph;
        let mut wanted: Vec<Vec<Id>> = vec![system.derivatives.clone()];
        let mut graph = graph.clone();
        for switch in &system.switches {
            wanted.push(vec![graph.sub(switch.left, switch.right), switch.right]);
        }
        wanted.push(system.orders.iter().flat_map(|order| [order.low, order.high]).collect());
        for c in &system.contacts {
            wanted.push(vec![c.torque, c.limit, c.coulomb, system.derivatives[c.velocity]]);
        }
        for happening in &system.happenings {
            wanted.push(vec![happening.guard]);
            wanted.push(happening.resets.iter().map(|(_, id)| *id).collect());
            wanted.push(happening.at_rest.iter().map(|(_, id)| *id).collect());
        }
        let starts: Vec<(usize, Id)> =
            system.starts.iter().enumerate().filter_map(|(s, start)| Some((s, (*start)?))).collect();
        wanted.push(starts.iter().map(|(_, id)| *id).collect());
        wanted.extend(system.matrices.iter().cloned());
        wanted.extend(system.signals.iter().map(|&id| vec![id]));

        let too_large = |_| {
            Mistake::new("states", "the model needs more than 65536 numbers at a time")
                .with_help("a model of this size is written in Rust")
        };
        let mut layout = Layout::new(parameters, names.len(), inputs + forces, system.modes).map_err(too_large)?;
        let (setup, programs) = compile(&graph, &mut layout, &wanted).map_err(too_large)?;
        let mut programs = programs.into_iter();
        let mut next = || programs.next().expect("there is a tape for everything wanted");
        let derivative = next();
        let switches =
            system.switches.iter().map(|s| Switch { mode: s.mode, strict: s.strict, jumps: s.jumps, sides: next() });
        let switches = switches.collect();
        let orders = (system.orders.iter().map(|order| (order.what.clone(), order.strict)).collect(), next());
        let joint = |contact: &Contact, balance| Joint {
            contact: *contact,
            balance,
            sticks: format!("{} sticks", names[contact.position]),
            slides: format!("{} slides", names[contact.position]),
        };
        let joints = system.contacts.iter().map(|contact| joint(contact, next())).collect();
        let states = |values: &[(usize, Id)]| values.iter().map(|(state, _)| *state).collect();
        let happening = |h: &super::system::Happening| Happening {
            name: h.name.clone(),
            guard: next(),
            resets: (states(&h.resets), next()),
            at_rest: (states(&h.at_rest), next()),
            rests: format!("{}: at rest", h.name),
            leaves: format!("{}: leaves its rest", h.name),
        };
        let happenings = system.happenings.iter().map(happening).collect();
        let starts = (starts.iter().map(|(s, _)| *s).collect(), next());
        let matrices = system.matrices.iter().map(|_| next()).collect();
        let signals = system
            .signals
            .iter()
            .map(|&id| {
                let tape = next();
                match graph.op(id) {
                    Op::State(state) => Signal::State(state),
                    Op::Input(input) => Signal::Input(input),
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
            joints,
            happenings,
            starts,
            matrices,
            pattern,
            columns,
        })
    }
}
