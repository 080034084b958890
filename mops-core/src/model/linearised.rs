//! Linearisation of a model, itself a model: with the same parameters, at an operating point, between chosen inputs and
//! outputs.

use std::fmt;
use std::sync::Arc;

use mops_language::{Quantity, suggestion};
use mops_linear::{Balance, Clock, NoEquilibrium, StateSpace, equilibrium};
use nalgebra::{DMatrix, DVector};

use super::roughness::Point;
use crate::case::Case;
use crate::error::StudyError;
use crate::failure::Failure;
use crate::model::{Analysis, AnalysisKind, Cut, Interface, Job, Local, Model, OperatingPoint, Variable};
use crate::plant::Selected;

/// Options of a linearisation: operating point, inputs and outputs.
#[derive(Debug, Clone, Default)]
pub struct Linearise {
    /// Inputs; `None` for all.
    pub inputs: Option<Vec<String>>,
    /// Outputs, which are signals of the model; `None` for all.
    pub outputs: Option<Vec<String>>,
    /// Values of states and inputs at the operating point. Other states have their initial values, other inputs the
    /// values of the case.
    pub at: Vec<(String, Quantity)>,
    /// True if the operating point is moved to an equilibrium. The states and inputs in `at` stay fixed, and so do all
    /// other inputs.
    pub equilibrium: bool,
    /// States and inputs that the search may vary although they would be fixed.
    pub free: Vec<String>,
}

/// Linearisation of a model: for given parameters, the linear system of the deviations from the operating point.
#[derive(Clone)]
pub struct Linearised {
    model: Arc<dyn Model>,
    interface: Interface,
    states: Vec<Variable>,
    /// Indices of the inputs in the model.
    inputs: Vec<usize>,
    outputs: Vec<usize>,
    /// Given values of the states, then of the inputs.
    given: Vec<Option<f64>>,
    /// Index of the parameter that sets the initial value, for each state.
    starts: Vec<Option<usize>>,
    /// True for each state, then input, that the equilibrium search may vary; `None` without a search.
    free: Option<Vec<bool>>,
    /// Input and signal of each cut loop, by their indices: the operating point is that of the closed loops.
    cut: Vec<[usize; 2]>,
}

/// A linear system and its operating point.
#[derive(Debug, Clone)]
pub struct Resting {
    /// Linear system of the deviations.
    pub system: StateSpace,
    /// Values of the states.
    pub states: Vec<f64>,
    /// Values of all inputs of the model.
    pub inputs: Vec<f64>,
    /// Rates of change of the states at the operating point, those of memory on average over a period of its clock;
    /// zero at an equilibrium.
    pub rates: Vec<f64>,
    /// Joints whose dry friction is omitted, as names of their positions.
    pub frictionless: Vec<String>,
    /// Derivatives that do not exist at the operating point.
    pub rough: Vec<Rough>,
}

/// A rate or an output that is not differentiable at an operating point: a jump, a kink or an infinite derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Rough {
    /// State whose rate is affected, or the output.
    pub of: String,
    /// True for the rate of a state.
    pub is_rate: bool,
    /// State or input with respect to which the derivative does not exist.
    pub along: String,
    /// Value of this state or input, in its unit.
    pub at: f64,
}

/// A variable that the equations compute for themselves, by its column in [`Local::slopes`]: the value of a row, times
/// a sign.
struct Tie {
    column: usize,
    row: usize,
    sign: f64,
}

/// Largest number of Newton steps to the values of tied variables. Ties are linear unless a delayed quantity depends on
/// another.
const NEWTON: usize = 50;

/// Difference of a tied variable from its computed value that counts as rounding, relative to the variable, or to 1 if
/// it is less.
const ROUNDING: f64 = 1e-12;

/// Difference of a tied variable from its computed value that counts as rounding if a step does not halve it.
const CLOSE: f64 = 1e-6;

/// Way out for a sampled model without a discrete equivalent.
const WRITE_EQUATIONS: &str =
    "write its equations, with a clock or a `pid` that has `every`: they have a discrete equivalent";

/// Returns the derivatives of tied variables minus their computed values.
fn tied(slopes: &DMatrix<f64>, ties: &[Tie]) -> DMatrix<f64> {
    let entry = |k: usize, l: usize| f64::from(u8::from(k == l)) - ties[k].sign * slopes[(ties[k].row, ties[l].column)];
    DMatrix::from_fn(ties.len(), ties.len(), entry)
}

fn singular() -> Failure {
    Failure::Undefined("the algebraic loop through the cut variable or the delays is singular".into())
}

impl fmt::Display for Rough {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { of, is_rate, along, at } = self;
        let what = if *is_rate { "the rate of " } else { "" };
        write!(
            f,
            "{what}`{of}` is not differentiable with respect to `{along}` at {along} = {at}: jump, kink or infinite derivative"
        )
    }
}

impl Linearised {
    /// Creates the linearisation of a model.
    ///
    /// # Errors
    /// Returns an error if the model has no equations that can be linearised, for unknown names and for quantities in a
    /// wrong unit.
    pub fn new(model: Arc<dyn Model>, options: &Linearise) -> Result<Self, StudyError> {
        if let Some(why) = model.not_linear() {
            return Err(StudyError::here(why).with_help(WRITE_EQUATIONS));
        }
        let states = model.equation_states();
        let of = model.interface();
        if states.is_empty() {
            let (fact, way_out) = match of.analysis {
                AnalysisKind::Time if model.augmented().is_some() => {
                    ("a model with effects cannot be linearised", "linearise the model without `effects`")
                }
                AnalysisKind::Time => (
                    "a linearisation needs the derivatives of the equations, which this model does not provide",
                    "write the equations in a study file (kind `equations`), or in Rust as a `PlantModel`",
                ),
                AnalysisKind::Linear => ("this model is already linear", "remove `linearise`"),
            };
            return Err(StudyError::here(fact).with_help(way_out));
        }
        let inputs = chosen("inputs", options.inputs.as_deref(), &of.inputs, "input")?;
        let outputs = chosen("outputs", options.outputs.as_deref(), &of.signals, "signal")?;
        let places: Vec<&Variable> = states.iter().chain(&of.inputs).collect();
        let place = |name: &str| {
            places.iter().position(|v| v.name == name).ok_or_else(|| {
                StudyError::new(name, format!("the model has no state or input `{name}`"))
                    .with_help(suggestion(name, places.iter().map(|v| v.name.as_str())))
            })
        };
        let mut given = vec![None; places.len()];
        for (name, quantity) in &options.at {
            let index = place(name).map_err(|m| m.within("at"))?;
            let value = quantity.to(&places[index].unit).map_err(|why| StudyError::new(name, why).within("at"))?;
            if !value.is_finite() {
                return Err(
                    StudyError::new(name, format!("expected a finite value for `{name}`, found {value}")).within("at")
                );
            }
            given[index] = Some(value);
        }
        if !options.equilibrium && !options.free.is_empty() {
            return Err(StudyError::new("free", "`free` applies only to the search for an equilibrium")
                .with_help("add equilibrium = true, or remove `free`"));
        }
        let mut free: Vec<bool> = (0..places.len()).map(|i| i < states.len() && given[i].is_none()).collect();
        for name in &options.free {
            free[place(name).map_err(|m| m.within("free"))?] = true;
        }
        if options.equilibrium && !free.contains(&true) {
            return Err(StudyError::new(
                "equilibrium",
                "every state and input is fixed, so that the search has no variables",
            )
            .with_help("remove one from `at`, or add one to `free`"));
        }
        let start_of = |state: &Variable| {
            let start = &of.states.iter().find(|s| s.name == state.name)?.start;
            of.parameters.iter().position(|p| p.variable.name == *start)
        };
        let starts = states.iter().map(start_of).collect();
        let interface = Interface {
            signals: outputs.iter().map(|&i| of.signals[i].clone()).collect(),
            parameters: of.parameters.clone(),
            inputs: inputs.iter().map(|&i| of.inputs[i].clone()).collect(),
            analysis: AnalysisKind::Linear,
            ..Interface::default()
        };
        let free = options.equilibrium.then_some(free);
        Ok(Self { model, interface, states, inputs, outputs, given, starts, free, cut: Vec::new() })
    }

    /// Creates the linearised loop transfer function of a model whose loops are cut at variables. Its operating point
    /// is that of the closed loops.
    ///
    /// # Errors
    /// Returns an error if a loop cannot be cut there, or for the reasons of [`Self::new`].
    pub fn opened(model: &dyn Model, variables: &[String], options: Linearise) -> Result<Self, StudyError> {
        let twice = variables.iter().enumerate().find(|(i, variable)| variables[..*i].contains(variable));
        if let Some((_, variable)) = twice {
            return Err(
                StudyError::new("open", format!("`{variable}` is listed twice")).with_help("remove one of them")
            );
        }
        if variables.is_empty() {
            return Err(StudyError::new("open", "`open` is empty").with_help("name a variable, or omit `open`"));
        }
        if let Some(key) = [("inputs", &options.inputs), ("outputs", &options.outputs)].iter().find(|o| o.1.is_some()) {
            let fact = "a cut loop has its own input and output";
            return Err(StudyError::new(key.0, fact).with_help("remove it, or `open`").within("linearise"));
        }
        if let Some(why) = model.not_linear() {
            return Err(StudyError::new("open", why).with_help(WRITE_EQUATIONS));
        }
        let Some(cut) = model.cut(variables) else {
            return Err(StudyError::new("open", "the loop of this kind of model cannot be cut")
                .with_help("write its equations (kind `equations`), and remove `effects`"));
        };
        let Cut { model, ends } = cut.map_err(|mistake| mistake.within("open"))?;
        let at = options.at.iter().map(|(name, _)| ("at", name)).chain(options.free.iter().map(|name| ("free", name)));
        if let Some((key, variable)) = at.into_iter().find(|(_, name)| variables.contains(name)) {
            let fact = "the value of the variable at which the loop is cut follows from the closed loop";
            return Err(StudyError::new(variable, fact).with_help("remove it").within(key).within("linearise"));
        }
        let of = model.interface();
        let inputs = ends.iter().map(|[input, _]| of.inputs[*input].name.clone()).collect();
        let outputs = ends.iter().map(|[_, signal]| of.signals[*signal].name.clone()).collect();
        let options = Linearise { inputs: Some(inputs), outputs: Some(outputs), ..options };
        let linearised = Self::new(model, &options).map_err(|mistake| mistake.within("linearise"))?;
        let interface = Interface { is_cut: true, ..linearised.interface };
        Ok(Self { cut: ends, interface, ..linearised })
    }

    /// Returns what the equations compute for themselves: the inputs of cut loops, and quantities that do not change
    /// have their present values.
    fn ties(&self, delays: usize) -> Vec<Tie> {
        let (n, of) = (self.states.len(), self.model.interface());
        let cut = self.cut.iter().map(|[input, signal]| Tie { column: n + input, row: n + signal, sign: -1.0 });
        let delayed =
            (0..delays).map(|k| Tie { column: n + of.inputs.len() + k, row: n + of.signals.len() + k, sign: 1.0 });
        cut.chain(delayed).collect()
    }

    /// Evaluates the equations at a point of states, inputs and delayed quantities, after it has moved to where its
    /// ties hold.
    fn local(&self, parameters: &[f64], point: &mut [f64], ties: &[Tie]) -> Result<Local, Failure> {
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON {
            let here = self.evaluate(parameters, point)?;
            let values = [&here.rates[..], &here.signals, &here.past].concat();
            let off = DVector::from_fn(ties.len(), |k, _| point[ties[k].column] - ties[k].sign * values[ties[k].row]);
            let relative = |(tie, off): (&Tie, &f64)| off.abs() / point[tie.column].abs().max(1.0);
            let most = ties.iter().zip(off.iter()).map(relative).fold(0.0, f64::max);
            // Rounding within the values may exceed that of a value, and is not reduced by a further step.
            if most <= ROUNDING || (most <= CLOSE && most > 0.5 * last) {
                return Ok(here);
            }
            last = most;
            let step = tied(&here.slopes, ties).lu().solve(&off).ok_or_else(singular)?;
            ties.iter().zip(step.iter()).for_each(|(tie, step)| point[tie.column] -= step);
        }
        Err(Failure::Undefined("the loop through the cut variable or the delays has no constant solution".into()))
    }

    /// Evaluates the equations at a point of states, inputs and delayed quantities, as they are given.
    fn evaluate(&self, parameters: &[f64], point: &[f64]) -> Result<Local, Failure> {
        let (states, others) = point.split_at(self.states.len());
        let (inputs, past) = others.split_at(self.model.interface().inputs.len());
        let at = OperatingPoint { parameters, states, inputs, past, at_rest: self.free.is_some() };
        self.model.local(&at).expect("a model with equations gives them")
    }

    /// Returns the rates and their slopes with respect to states and inputs, while the ties hold. `point` lacks the
    /// delayed quantities.
    fn balance(&self, parameters: &[f64], point: &[f64], ties: &[Tie], delays: usize) -> Result<Balance, String> {
        let n = self.states.len();
        let mut point = [point, &vec![0.0; delays]].concat();
        let reason = |failure: Failure| failure.to_string();
        let Local { rates, slopes, .. } = self.local(parameters, &mut point, ties).map_err(reason)?;
        let mut closed = slopes.rows(0, n).into_owned();
        if !ties.is_empty() {
            let [columns, rows] =
                [|tie: &Tie| tie.column, |tie: &Tie| tie.row].map(|of| ties.iter().map(of).collect::<Vec<_>>());
            let mut computed = slopes.select_rows(&rows);
            computed.row_iter_mut().zip(ties).for_each(|(mut row, tie)| row *= tie.sign);
            // A tied variable has no value of its own.
            columns.iter().for_each(|&column| computed.column_mut(column).fill(0.0));
            let moved = tied(&slopes, ties).lu().solve(&computed).ok_or_else(|| reason(singular()))?;
            closed += closed.select_columns(&columns) * moved;
        }
        Ok(Balance { rates, slopes: closed.columns(0, point.len() - delays).into_owned() })
    }

    /// Returns the states of the model.
    pub fn states(&self) -> &[Variable] {
        &self.states
    }

    /// Returns the linear system at given parameters, with its operating point.
    ///
    /// # Errors
    /// Returns an error if the model is not defined for the parameters, or if there is no equilibrium.
    pub fn at(&self, case: &Case, parameters: &[f64]) -> Result<Resting, Failure> {
        let of = self.model.interface();
        let n = self.states.len();
        let computed = self.model.start_values(parameters);
        let start = |index: usize| match (index < n).then(|| self.starts[index]) {
            Some(_) if computed.is_some() => computed.as_ref().map_or(0.0, |values| values[index]),
            Some(Some(parameter)) => parameters[parameter],
            Some(None) => 0.0,
            None => case.input(&of.inputs[index - n].name).map_or(0.0, |input| input.at(0.0)),
        };
        let mut point: Vec<f64> =
            self.given.iter().enumerate().map(|(i, given)| given.unwrap_or_else(|| start(i))).collect();
        let delays = self.model.delays(parameters)?;
        let ties = self.ties(delays.len());
        if let Some(free) = &self.free {
            let balance = |point: &[f64]| self.balance(parameters, point, &ties, delays.len());
            point = equilibrium(balance, &point, free).map_err(|why| Failure::Undefined(self.restless(&why)))?;
        }
        point.resize(point.len() + delays.len(), 0.0);
        let here = self.local(parameters, &mut point, &ties)?;
        let clocks = self.model.clocks(parameters)?;
        let rough = self.rough(&point, &here, &clocks, |point| self.evaluate(parameters, point).ok());
        let Local { mut rates, slopes, frictionless, selected, exceeded, .. } = here;
        if let Some(place) = exceeded {
            return Err(Failure::Undefined(format!(
                "{place} at the operating point, which no linear model within it describes; choose an operating point within the limits"
            )));
        }
        // A selected value that does not follow the cut variable, where the other one would, opens the loop to the
        // rates that nothing else connects with it, whatever other rates follow, such as that of anti-windup.
        let opens = |of: &Selected<Vec<f64>>| {
            self.cut.iter().map(|[input, _]| n + input).any(|cut| {
                let is_cut_off = |&row: &usize| slopes[(row, cut)] == 0.0;
                of.taken[cut] == 0.0 && of.other[cut] != 0.0 && of.rates.iter().any(is_cut_off)
            })
        };
        if let Some(Selected { place, .. }) = selected.iter().find(|of| opens(of)) {
            return Err(Failure::Undefined(format!(
                "a limit is active at the operating point ({place}), so that the loop is open there and has no margins; choose an \
                 operating point within the limits"
            )));
        }
        let system = self.system(&slopes, &delays, &clocks).map_err(Failure::Undefined)?;
        if !self.cut.is_empty()
            && let Some(open) = system.without_path().map_err(Failure::Undefined)?
        {
            let variable = &self.interface.inputs[open].name;
            return Err(Failure::Undefined(format!(
                "there is no loop through `{variable}` at the operating point: nothing that it acts on acts on it again, or a limit \
                 is reached there"
            )));
        }
        for clock in &clocks {
            rates[clock.memory.clone()].iter_mut().for_each(|change| *change /= clock.period);
        }
        let mut inputs = point.split_off(n);
        inputs.truncate(of.inputs.len());
        Ok(Resting { system, states: point, inputs, rates, frictionless, rough })
    }

    /// Returns the rates and outputs of the system that are not differentiable at a point.
    fn rough(
        &self,
        point: &[f64],
        here: &Local,
        clocks: &[Clock],
        local: impl Fn(&[f64]) -> Option<Local>,
    ) -> Vec<Rough> {
        let n = self.states.len();
        let values = |at: &Local| [&at.rates[..], &at.signals, &at.past].concat();
        let of = self.model.interface();
        let delayed = |first: usize| first..first + here.past.len();
        let rows = (0..n).chain(self.outputs.iter().map(|i| n + i)).chain(delayed(n + of.signals.len()));
        let columns = (0..n).chain(self.inputs.iter().map(|j| n + j)).chain(delayed(n + of.inputs.len()));
        let changes: Vec<_> = clocks.iter().map(|clock| clock.memory.clone()).collect();
        let at = Point { x: point, values: &values(here), slopes: &here.slopes, changes: &changes };
        let find = |point: &[f64]| local(point).map(|local| values(&local));
        let found = at.rough(find, &rows.collect::<Vec<_>>(), &columns.collect::<Vec<_>>());
        let name = |index: usize, others: &[Variable]| {
            let mut all = self.states.iter().chain(others).map(|v| v.name.clone());
            all.nth(index).unwrap_or_else(|| "a delayed quantity".to_owned())
        };
        let rough = |(row, column)| Rough {
            of: name(row, &of.signals),
            is_rate: row < n,
            along: name(column, &of.inputs),
            at: point[column],
        };
        found.into_iter().map(rough).collect()
    }

    /// Returns the reason why there is no equilibrium, and a remedy.
    fn restless(&self, why: &NoEquilibrium) -> String {
        let NoEquilibrium::Restless { state, rate } = why else { return why.to_string() };
        let Variable { name, unit, .. } = &self.states[*state];
        let unit = unit.power(1, -1);
        let mut text = format!(
            "no equilibrium found: at the end of the search `{name}` still changes by {rate:.3e} {unit}, most of all states"
        );
        let free = self.free.as_deref().unwrap_or_default();
        let fixed = |from: usize, names: &[Variable]| -> Vec<String> {
            names.iter().enumerate().filter(|(i, _)| !free[from + i]).map(|(_, v)| format!("`{}`", v.name)).collect()
        };
        let inputs = fixed(self.states.len(), &self.model.interface().inputs);
        let states = fixed(0, &self.states);
        match (inputs.as_slice(), states.as_slice()) {
            ([], []) => {}
            ([], states) => text += &format!("; the state {} is fixed", states.join(", ")),
            (inputs, _) => {
                text += &format!("; the input {} is fixed, --free lets the search vary it", inputs.join(", "))
            }
        }
        text
    }

    /// Returns the linear system between the chosen inputs and outputs.
    ///
    /// # Errors
    /// If it is not a system with one delay, or without a discrete equivalent, see [`StateSpace::with_delays`] and
    /// [`StateSpace::sampled`].
    fn system(&self, slopes: &DMatrix<f64>, delays: &[f64], clocks: &[Clock]) -> Result<StateSpace, String> {
        let (n, of) = (self.states.len(), self.model.interface());
        let names = |variables: &[Variable]| variables.iter().map(|v| v.name.clone()).collect::<Vec<_>>();
        let indices = |chosen: &[usize], all: usize| -> Vec<usize> {
            chosen.iter().map(|i| n + i).chain((0..delays.len()).map(|k| n + all + k)).collect()
        };
        let columns = indices(&self.inputs, of.inputs.len());
        let rows = indices(&self.outputs, of.signals.len());
        let past = vec![String::new(); delays.len()];
        let system = StateSpace {
            a: slopes.view((0, 0), (n, n)).into_owned(),
            b: slopes.rows(0, n).select_columns(&columns),
            c: slopes.columns(0, n).select_rows(&rows),
            d: slopes.select_rows(&rows).select_columns(&columns),
            states: names(&self.states),
            inputs: [names(&self.interface.inputs), past.clone()].concat(),
            outputs: [names(&self.interface.signals), past].concat(),
            delay: 0.0,
            period: None,
        };
        match (clocks.is_empty(), delays.is_empty()) {
            (false, _) => system.sampled(clocks, delays, !self.cut.is_empty()),
            (true, false) => system.with_delays(delays),
            (true, true) => Ok(system),
        }
    }
}

impl Model for Linearised {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn constants(&self) -> Vec<(Variable, f64)> {
        self.model.constants()
    }

    fn with_constant(&self, name: &str, value: f64) -> Option<Arc<dyn Model>> {
        Some(Arc::new(Self { model: self.model.with_constant(name, value)?, ..self.clone() }))
    }

    fn notes(&self) -> Vec<String> {
        self.model.notes()
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        let resting = self.at(job.case, job.parameters)?;
        match resting.rough.first() {
            Some(rough) => {
                Err(Failure::Undefined(format!("the model cannot be linearised at the operating point: {rough}")))
            }
            None => Ok(Analysis::Linear(resting.system)),
        }
    }
}

/// Returns the indices of the named variables; of all variables without names.
fn chosen(key: &str, names: Option<&[String]>, known: &[Variable], what: &str) -> Result<Vec<usize>, StudyError> {
    let Some(names) = names else { return Ok((0..known.len()).collect()) };
    let find = |name: &String| {
        known.iter().position(|v| v.name == *name).ok_or_else(|| {
            StudyError::new(name, format!("the model has no {what} `{name}`"))
                .with_help(suggestion(name, known.iter().map(|v| v.name.as_str())))
                .within(key)
        })
    };
    if names.is_empty() {
        return Err(StudyError::new(key, format!("`{key}` is empty"))
            .with_help(format!("list at least one {what}, or omit `{key}` for all")));
    }
    names.iter().map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Parameter, State};
    use mops_math as math;
    use mops_math::complex;

    /// A pendulum with torque u: `angle'' = g sin(angle) - u`, angle 0 upright.
    struct Pendulum(Interface);

    impl Model for Pendulum {
        fn interface(&self) -> &Interface {
            &self.0
        }
        fn analyse(&self, _: &Job<'_>) -> Result<Analysis, Failure> {
            unreachable!("only used for linearisation")
        }
        fn equation_states(&self) -> Vec<Variable> {
            vec![Variable::new("angle", "rad", ""), Variable::new("speed", "rad/s", "")]
        }
        fn local(&self, at: &OperatingPoint<'_>) -> Option<Result<Local, Failure>> {
            let (g, [angle, speed], u) = (at.parameters[0], [at.states[0], at.states[1]], at.inputs[0]);
            let slopes =
                [[0.0, 1.0, 0.0], [g * math::cos(angle), 0.0, -1.0], [math::cos(angle), 0.0, 0.0], [0.0, 1.0, 0.0]];
            Some(Ok(Local {
                rates: vec![speed, g * math::sin(angle) - u],
                signals: vec![math::sin(angle), speed],
                slopes: DMatrix::from_fn(4, 3, |i, j| slopes[i][j]),
                past: Vec::new(),
                frictionless: Vec::new(),
                selected: Vec::new(),
                exceeded: None,
            }))
        }
    }

    fn pendulum() -> Arc<dyn Model> {
        Arc::new(Pendulum(Interface {
            signals: vec![Variable::new("side", "1", ""), Variable::new("speed", "rad/s", "")],
            parameters: vec![Parameter::new("g", "1/s2", ""), Parameter::new("angle0", "rad", "")],
            states: vec![State { name: "angle".into(), start: "angle0".into(), signal: None, rate_of: None }],
            inputs: vec![Variable::new("u", "1/s2", "")],
            ..Interface::default()
        }))
    }

    fn quantity(text: &str) -> Quantity {
        Quantity::parse(text).unwrap()
    }

    #[test]
    fn the_operating_point_is_given_or_else_the_initial_value() {
        let by_start = Linearised::new(pendulum(), &Linearise::default()).unwrap();
        let resting = by_start.at(&Case::default(), &[9.0, 0.5]).unwrap();
        assert_eq!((resting.states[0], resting.system.a[(1, 0)]), (0.5, 9.0 * math::cos(0.5)));
        let at = vec![("angle".into(), quantity("180 deg"))];
        let outputs = Some(vec!["side".into()]);
        let hanging = Linearised::new(pendulum(), &Linearise { at, outputs, ..Linearise::default() }).unwrap();
        let Analysis::Linear(system) = hanging
            .analyse(&Job { case: &Case::default(), parameters: &[9.0, 0.5], signals: &[], horizon: 0.0 })
            .unwrap()
        else {
            panic!("it is linear")
        };
        assert_eq!(
            (system.a[(1, 0)], system.c[(0, 0)], system.outputs.as_slice()),
            (-9.0, -1.0, &["side".to_owned()][..])
        );
        assert!(system.poles().unwrap().iter().all(|p| (complex::norm(*p) - 3.0).abs() < 1e-14 && p.re == 0.0));
    }

    #[test]
    fn an_equilibrium_keeps_given_values_and_moves_only_free_inputs() {
        let at = vec![("angle".into(), quantity("0.4"))];
        let trim = Linearise { at: at.clone(), equilibrium: true, free: vec!["u".into()], ..Linearise::default() };
        let resting = Linearised::new(pendulum(), &trim).unwrap().at(&Case::default(), &[9.0, 0.0]).unwrap();
        assert!((resting.inputs[0] - 9.0 * math::sin(0.4)).abs() < 1e-12 && resting.states[0] == 0.4);
        let fixed = Linearise { at, equilibrium: true, ..Linearise::default() };
        let failure = Linearised::new(pendulum(), &fixed).unwrap().at(&Case::default(), &[9.0, 0.0]).unwrap_err();
        assert!(matches!(&failure, Failure::Undefined(why) if why.contains("no equilibrium")), "{failure}");
        // Newton's method stops at zero speed, with the gravity torque unbalanced.
        assert!(failure.to_string().contains("`speed` still changes by 3.505e0"), "{failure}");
        assert!(failure.to_string().ends_with("the input `u` is fixed, --free lets the search vary it"), "{failure}");
    }

    #[test]
    fn names_and_units_that_do_not_fit_are_mistakes_at_their_keys() {
        let wrong = |options: Linearise| Linearised::new(pendulum(), &options).err().unwrap().to_string();
        let at = |name: &str, value: &str| vec![(name.to_owned(), quantity(value))];
        assert_eq!(
            wrong(Linearise { at: at("angel", "1"), ..Linearise::default() }),
            "at.angel: the model has no state or input `angel`; did you mean `angle`?"
        );
        assert!(
            wrong(Linearise { at: at("angle", "1 s"), ..Linearise::default() })
                .starts_with("at.angle: expected a quantity in")
        );
        assert!(wrong(Linearise { inputs: Some(vec!["v".into()]), ..Linearise::default() }).starts_with("inputs.v: "));
        assert!(wrong(Linearise { free: vec!["u".into()], ..Linearise::default() }).starts_with("free: "));
    }
}
