//! Model as a graph: equations solved for the derivatives, friction, events, signals and initial values.

use std::collections::{BTreeMap, BTreeSet};

use mops_core::StudyError;
use mops_language::{expression::Form, suggestion};
use mops_linear as linear;

use super::definition::{self, Definition, Text, under};
use super::graph::{Block, Graph, Id, Op};
use super::lower::{Affine, Lowering, Order, Selection, Switch};

/// Equation `sum of coefficients * derivatives = force`.
#[derive(Debug, Clone)]
struct Row {
    coefficients: BTreeMap<usize, Id>,
    force: Id,
}

/// Dry friction of a joint.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// Position, as a state.
    pub position: usize,
    /// Speed, as a state.
    pub velocity: usize,
    /// Mode: 1 forward, -1 backward, 0 stuck.
    pub direction: usize,
    /// Mode: 1 while stuck.
    pub stuck: usize,
    /// Sliding friction.
    pub coulomb: Id,
    /// Break-away friction.
    pub limit: Id,
    /// Friction torque while the joint is stuck.
    pub torque: Id,
}

/// Event that occurs when its guard becomes negative.
#[derive(Debug, Clone)]
pub struct Happening {
    /// Name of the event.
    pub name: String,
    /// Guard of the event.
    pub guard: Id,
    /// New values of states.
    pub resets: Vec<(usize, Id)>,
    /// Values of states at which accumulating events end.
    pub at_rest: Vec<(usize, Id)>,
}

/// Model as a graph.
#[derive(Debug)]
pub struct System {
    /// Expression graph.
    pub graph: Graph,
    /// Conditions that switch branches.
    pub switches: Vec<Switch>,
    /// Arguments that must increase.
    pub orders: Vec<Order>,
    /// Values that conditions select.
    pub selections: Vec<Selection>,
    /// Number of modes.
    pub modes: usize,
    /// Typical sizes of the states, if declared.
    pub scales: Vec<Option<f64>>,
    /// Derivatives of the states.
    pub derivatives: Vec<Id>,
    /// Signals: states, outputs, inputs.
    pub signals: Vec<Id>,
    /// Joints with dry friction.
    pub contacts: Vec<Contact>,
    /// Events.
    pub happenings: Vec<Happening>,
    /// Clocks, with the new values of their memory.
    pub clocks: Vec<(linear::Clock, Vec<Id>)>,
    /// Delayed quantities, which are inputs after all others, and their delays, s.
    pub delays: Vec<(Id, Id)>,
    /// Initial values given in the study.
    pub starts: Vec<Option<Id>>,
    /// Joints, as pairs of position and speed.
    pub joints: Vec<(usize, usize)>,
    /// Matrices of equations that are solved together, row by row.
    pub matrices: Vec<Vec<Id>>,
}

impl System {
    /// Builds the graph of a definition. `opened` states get an additional input, after the declared ones, on the
    /// right-hand sides of their equations.
    ///
    /// # Errors
    /// Unknown names, circular definitions, or equations that do not determine the derivatives.
    pub fn new(definition: &Definition, opened: &[usize]) -> Result<Self, StudyError> {
        let d = definition;
        let mut l = Lowering::new(d, opened.len())?;
        let state = |name: &str| d.states.iter().position(|s| s.name == name).expect("names of states were checked");
        let row_of = |s: usize| match d.is_memory(s) {
            true => Ok(Row { coefficients: BTreeMap::from([(s, l.graph.number(1.0))]), force: l.graph.number(0.0) }),
            false => row(&mut l, d, s, &d.der[&d.states[s].name]),
        };
        let mut rows: Vec<Row> = (0..d.states.len()).map(row_of).collect::<Result<_, _>>()?;
        let massive: BTreeSet<usize> = d.mass.iter().map(|(row, ..)| state(row)).collect();
        for &row in &massive {
            let text = &d.der[&d.states[row].name];
            if text.equation.left.is_some() || rows[row].coefficients.len() > 1 {
                let fact = "the equation contains derivatives and also has a row in `mass`";
                return Err(under(&text.path, StudyError::here(fact))
                    .with_help("give the derivatives either in the equation or in `mass`"));
            }
            rows[row].coefficients.clear();
        }
        for (row, column, text) in &d.mass {
            let value = l.value(text)?;
            let column = state(column);
            let factor = l.graph.number(d.states[column].unit.factor());
            let value = l.graph.mul(value, factor);
            rows[state(row)].coefficients.insert(column, value);
        }
        for row in &mut rows {
            row.coefficients.retain(|_, c| !l.graph.is(*c, 0.0));
        }
        let joints = joints(&l.graph, d, &rows);
        for (k, &state) in opened.iter().enumerate() {
            let force = l.graph.add_op(Op::Input(d.inputs.len() + k));
            rows[state].force = l.graph.add(rows[state].force, force);
        }
        let mut contacts = friction(&mut l, d, &joints, &mut rows)?;
        let mut matrices = Vec::new();
        let derivatives = solve(&mut l.graph, d, &rows, &contacts, &mut matrices)?;
        for contact in &mut contacts {
            let row = &rows[contact.velocity];
            let mut torque = row.force;
            for (&column, &coefficient) in &row.coefficients {
                let part = l.graph.mul(coefficient, derivatives[column]);
                torque = l.graph.sub(torque, part);
            }
            contact.torque = torque;
        }
        let mut signals: Vec<Id> = (0..d.states.len()).map(|s| l.graph.add_op(Op::State(s))).collect();
        for (output, text) in &d.outputs {
            let affine = l.text(text)?;
            let value = with_rates(&mut l.graph, affine, &derivatives);
            signals.push(l.declared(value, &output.unit));
        }
        signals.extend((0..d.inputs.len()).map(|i| l.graph.add_op(Op::Input(i))));
        let mut happenings = Vec::new();
        for when in &d.when {
            let affine = l.text(&when.guard)?;
            let guard = with_rates(&mut l.graph, affine, &derivatives);
            let mut values = |texts: &[(String, Text)]| {
                let value = |(name, text): &(String, Text)| {
                    let (affine, state) = (l.text(text)?, state(name));
                    let value = with_rates(&mut l.graph, affine, &derivatives);
                    Ok((state, l.declared(value, &d.states[state].unit)))
                };
                texts.iter().map(value).collect::<Result<Vec<_>, StudyError>>()
            };
            let (resets, at_rest) = (values(&when.resets)?, values(&when.at_rest)?);
            happenings.push(Happening { name: when.name.clone(), guard, resets, at_rest });
        }
        let clocks =
            d.clocks.iter().map(|clock| self::clock(&mut l, d, clock, &derivatives)).collect::<Result<_, _>>()?;
        let start = |l: &mut Lowering<'_>, s: usize| {
            let (name, unit) = (&d.states[s].name, &d.states[s].unit);
            let value = d.start.get(name).map(|text| {
                if let Form::Quantity(number, own) = &text.equation.right.form
                    && let Some(number) = own.convert(*number, unit)
                {
                    return Ok(l.graph.number(number));
                }
                let value = l.fixed(text, &format!("the initial value of `{name}`"))?;
                // A number without a unit is in the unit of the state.
                Ok(if text.is_bare() { value } else { l.declared(value, unit) })
            });
            value.transpose()
        };
        let starts = (0..d.states.len()).map(|s| start(&mut l, s)).collect::<Result<_, _>>()?;
        let mut delays = Vec::new();
        lower_delays(&mut l, &derivatives, &mut delays)?;
        // Unused definitions are checked too, but their switches and delays are discarded.
        let (switches, orders, selections, modes) = (l.switches.len(), l.orders.len(), l.selections.len(), l.modes);
        for (_, text) in &d.lets {
            l.text(text)?;
        }
        lower_delays(&mut l, &derivatives, &mut delays.clone())?;
        l.switches.truncate(switches);
        l.orders.truncate(orders);
        l.selections.truncate(selections);
        l.modes = modes;
        let Lowering { graph, switches, orders, selections, modes, .. } = l;
        Ok(Self {
            graph,
            switches,
            orders,
            selections,
            modes,
            scales: d.scales.clone(),
            derivatives,
            signals,
            contacts,
            happenings,
            clocks,
            delays,
            starts,
            joints,
            matrices,
        })
    }

    /// Returns the selections that act on rates, on new values of memory or on delayed quantities, with the numbers of
    /// these: those of the states, then the delayed quantities.
    pub fn acting_selections(&self) -> Vec<(&Selection, Vec<usize>)> {
        let of_memory = self.clocks.iter().flat_map(|(clock, next)| clock.memory.clone().zip(next.iter().copied()));
        let first = self.derivatives.len();
        let delayed = self.delays.iter().enumerate().map(|(k, &(of, _))| (first + k, of));
        let roots = self.derivatives.iter().copied().enumerate().chain(of_memory).chain(delayed);
        let mut all: Vec<(&Selection, Vec<usize>)> = self.selections.iter().map(|of| (of, Vec::new())).collect();
        for (rate, id) in roots.filter(|_| !self.selections.is_empty()) {
            let below = self.graph.below(id);
            all.iter_mut().filter(|(of, _)| below[of.taken.index()]).for_each(|(_, rates)| rates.push(rate));
        }
        all.retain(|(_, rates)| !rates.is_empty());
        all
    }
}

/// Substitutes the derivatives in an affine expression.
fn with_rates(graph: &mut Graph, affine: Affine, derivatives: &[Id]) -> Id {
    affine.rates.into_iter().fold(affine.rest, |sum, (state, rate)| {
        let part = graph.mul(rate, derivatives[state]);
        graph.add(sum, part)
    })
}

fn row(l: &mut Lowering<'_>, d: &Definition, state: usize, text: &Text) -> Result<Row, StudyError> {
    let affine = l.text(text)?;
    let own = l.graph.number(d.states[state].unit.factor());
    if text.equation.left.is_none() {
        let mut coefficients: BTreeMap<usize, Id> = BTreeMap::from([(state, own)]);
        for (column, rate) in affine.rates {
            let before = coefficients.get(&column).copied().unwrap_or_else(|| l.graph.number(0.0));
            coefficients.insert(column, l.graph.sub(before, rate));
        }
        return Ok(Row { coefficients, force: affine.rest });
    }
    if affine.rates.is_empty() {
        let name = &d.states[state].name;
        return Err(under(&text.path, StudyError::here("the equation contains no derivative")).with_help(format!(
            "write the derivative of `{name}` as `{name}'`; without `=` the expression is the derivative"
        )));
    }
    Ok(Row { coefficients: affine.rates, force: l.graph.negative(affine.rest) })
}

/// Returns the pairs of states in which the second is the derivative of the first, each in its own unit.
fn joints(graph: &Graph, d: &Definition, rows: &[Row]) -> Vec<(usize, usize)> {
    let pair = |(position, row): (usize, &Row)| {
        let own = |state: usize, id: Id| graph.is(id, d.states[state].unit.factor());
        let alone = row.coefficients.len() == 1 && row.coefficients.get(&position).is_some_and(|&c| own(position, c));
        let velocity = match graph.op(row.force) {
            Op::State(velocity) => Some(velocity),
            Op::Mul(factor, state) => match graph.op(state) {
                Op::State(velocity) if own(velocity, factor) => Some(velocity),
                _ => None,
            },
            _ => None,
        };
        velocity
            .filter(|&velocity| alone && velocity != position && !d.is_memory(velocity))
            .map(|velocity| (position, velocity))
    };
    rows.iter().enumerate().filter_map(pair).collect()
}

/// Lowers the delayed quantities that are not in the list yet, and those that they depend on.
fn lower_delays(l: &mut Lowering<'_>, derivatives: &[Id], delays: &mut Vec<(Id, Id)>) -> Result<(), StudyError> {
    while delays.len() < l.delays.len() {
        let affine = l.past(delays.len())?;
        let value = with_rates(&mut l.graph, affine, derivatives);
        delays.push((value, l.delays[delays.len()].time));
    }
    Ok(())
}

/// Lowers a clock.
fn clock(
    l: &mut Lowering<'_>,
    d: &Definition,
    clock: &definition::Clock,
    derivatives: &[Id],
) -> Result<(linear::Clock, Vec<Id>), StudyError> {
    let next = clock.memory.clone().zip(&clock.next).map(|(memory, text)| {
        let affine = l.sampled(text)?;
        let value = with_rates(&mut l.graph, affine, derivatives);
        Ok(l.declared(value, &d.states[memory].unit))
    });
    let next = next.collect::<Result<_, StudyError>>()?;
    let mut time = |text: &Option<Text>, range: [f64; 2], expected: &str| -> Result<f64, StudyError> {
        let Some(text) = text else { return Ok(0.0) };
        let id = l.value(text)?;
        let fact = match l.graph.constant(id) {
            Some(time) if time.is_finite() && time >= range[0] && time <= range[1] => return Ok(time),
            Some(time) => format!("expected {expected}, found {time} s"),
            None => format!("expected {expected}, found an expression that is not constant"),
        };
        let help = "a time such as \"10 ms\", or an expression of constants";
        Err(under(&text.path, StudyError::here(fact).at(text.equation.right.span.clone())).with_help(help))
    };
    let [every, offset, delay] = &clock.times;
    let period = time(every, [f64::MIN_POSITIVE, f64::INFINITY], "a positive period")?;
    let offset = time(offset, [0.0, f64::INFINITY], "a first instant of at least 0")?;
    let delay = time(delay, [0.0, period], &format!("a delay between 0 and the period of {period} s"))?;
    Ok((linear::Clock { memory: clock.memory.clone(), period, offset, delay }, next))
}

/// Limit on the number of joints with dry friction: three contacts of every joint at rest are tried, in all
/// combinations.
const MOST_CONTACTS: usize = 8;

fn friction(
    l: &mut Lowering<'_>,
    d: &Definition,
    joints: &[(usize, usize)],
    rows: &mut [Row],
) -> Result<Vec<Contact>, StudyError> {
    let mut contacts: Vec<Contact> = Vec::new();
    for friction in &d.friction {
        if let (Some(peak), None) = (&friction.peak, &friction.coulomb) {
            return Err(under(&peak.path, StudyError::here("`peak` is a ratio to `coulomb`, which is not given"))
                .with_help("add `coulomb`, or remove `peak`"));
        }
        let names = |s: usize| d.states[s].name.as_str();
        let joint = joints.iter().find(|&&(q, v)| names(q) == friction.of || names(v) == friction.of);
        let Some(&(position, velocity)) = joint else {
            return Err(under(
                &friction.path,
                StudyError::here(format!("friction needs a joint, `{}` is not a joint", friction.of)),
            )
            .with_help(match joints.is_empty() {
                true => {
                    "a joint is a state whose derivative is another state, for example der = { q = \"v\" }".to_owned()
                }
                false => suggestion(&friction.of, joints.iter().map(|&(q, _)| names(q))),
            }));
        };
        if let Some(viscous) = &friction.viscous {
            let factor = l.value(viscous)?;
            let speed = l.graph.add_op(Op::State(velocity));
            let speed = l.coherent(speed, &d.states[velocity].unit);
            let force = l.graph.mul(factor, speed);
            rows[velocity].force = l.graph.sub(rows[velocity].force, force);
        }
        let Some(coulomb) = &friction.coulomb else { continue };
        if contacts.iter().any(|c| c.velocity == velocity) {
            return Err(under(
                &friction.path,
                StudyError::here(format!("duplicate dry friction of `{}`", friction.of)),
            )
            .with_help("position and speed name the same joint: keep one of them"));
        }
        let coulomb = l.value(coulomb)?;
        let limit = match &friction.peak {
            Some(peak) => {
                let peak = l.value(peak)?;
                l.graph.mul(coulomb, peak)
            }
            None => coulomb,
        };
        let ((direction, _), (stuck, _)) = (l.mode(), l.mode());
        if contacts.len() == MOST_CONTACTS {
            let fact = format!(
                "at most {MOST_CONTACTS} joints can have dry friction, as all combinations of contacts are tried"
            );
            return Err(
                under(&friction.path, StudyError::here(fact)).with_help("keep `coulomb` for joints that come to rest")
            );
        }
        contacts.push(Contact { position, velocity, direction, stuck, coulomb, limit, torque: coulomb });
    }
    Ok(contacts)
}

/// Solves for the derivatives; rows with common derivatives are solved together.
fn solve(
    graph: &mut Graph,
    d: &Definition,
    rows: &[Row],
    contacts: &[Contact],
    matrices: &mut Vec<Vec<Id>>,
) -> Result<Vec<Id>, StudyError> {
    let zero = graph.number(0.0);
    let mut derivatives = vec![zero; rows.len()];
    for group in groups(rows) {
        if let Some(lost) = undetermined(rows, &group) {
            let name = &d.states[lost].name;
            return Err(under(
                &d.der[name].path,
                StudyError::here(format!("the equations do not determine the derivative of `{name}`")),
            )
            .with_help("write as many independent equations as there are derivatives in them"));
        }
        let n = group.len();
        let mut matrix = vec![zero; n * n];
        let mut right = vec![zero; n];
        for (i, &state) in group.iter().enumerate() {
            let contact = contacts.iter().find(|c| c.velocity == state);
            right[i] = rows[state].force;
            for (j, column) in group.iter().enumerate() {
                matrix[i * n + j] = rows[state].coefficients.get(column).copied().unwrap_or(zero);
            }
            if let Some(contact) = contact {
                let direction = graph.add_op(Op::Mode(contact.direction));
                let stuck = graph.add_op(Op::Mode(contact.stuck));
                let kept = graph.mul(contact.coulomb, direction);
                let sliding = graph.sub(right[i], kept);
                right[i] = graph.choose(stuck, zero, sliding);
                for j in 0..n {
                    let unit = graph.number(if i == j { 1.0 } else { 0.0 });
                    matrix[i * n + j] = graph.choose(stuck, unit, matrix[i * n + j]);
                }
            }
        }
        let solved = match n {
            1 => vec![graph.div(right[0], matrix[0])],
            2 => two(graph, &matrix, &right).to_vec(),
            _ => {
                graph.blocks.push(Block { matrix: matrix.clone(), right });
                (0..n).map(|k| graph.add_op(Op::Solution(graph.blocks.len() - 1, k))).collect()
            }
        };
        matrices.push(matrix);
        for (&state, value) in group.iter().zip(solved) {
            derivatives[state] = value;
        }
    }
    Ok(derivatives)
}

/// Solves two equations by their determinant.
fn two(graph: &mut Graph, matrix: &[Id], right: &[Id]) -> [Id; 2] {
    let mut cross = |a, b, c, d| {
        let (ab, cd) = (graph.times(a, b), graph.times(c, d));
        graph.sub(ab, cd)
    };
    let determinant = cross(matrix[0], matrix[3], matrix[1], matrix[2]);
    let first = cross(matrix[3], right[0], matrix[1], right[1]);
    let second = cross(matrix[0], right[1], matrix[2], right[0]);
    let one = graph.number(1.0);
    let inverse = graph.div(one, determinant);
    [graph.times(first, inverse), graph.times(second, inverse)]
}

/// Groups the states whose rows share derivatives, in order.
fn groups(rows: &[Row]) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..rows.len()).collect();
    fn root(group: &[usize], mut s: usize) -> usize {
        while group[s] != s {
            s = group[s];
        }
        s
    }
    for (state, row) in rows.iter().enumerate() {
        for &column in row.coefficients.keys() {
            let (a, b) = (root(&group, state), root(&group, column));
            group[a.max(b)] = a.min(b);
        }
    }
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for state in 0..rows.len() {
        groups.entry(root(&group, state)).or_default().push(state);
    }
    groups.into_values().collect()
}

/// Returns a state of the group whose derivative no equation determines, whatever the coefficients; uses augmenting
/// paths.
fn undetermined(rows: &[Row], group: &[usize]) -> Option<usize> {
    fn assign(
        rows: &[Row],
        column: usize,
        group: &[usize],
        seen: &mut Vec<usize>,
        taken: &mut BTreeMap<usize, usize>,
    ) -> bool {
        for &row in group {
            if rows[row].coefficients.contains_key(&column) && !seen.contains(&row) {
                seen.push(row);
                let free = match taken.get(&row) {
                    None => true,
                    Some(&other) => assign(rows, other, group, seen, taken),
                };
                if free {
                    taken.insert(row, column);
                    return true;
                }
            }
        }
        false
    }
    let mut taken = BTreeMap::new();
    group.iter().copied().find(|&column| !assign(rows, column, group, &mut Vec::new(), &mut taken))
}
