//! Model with effects at its ports. The result is a model, whose parameters are those of the base model and of the
//! effects.

mod along;
mod command;
mod contacts;
mod dynamics;
mod edges;
mod sensors;

use std::sync::Arc;

use mops_core::{
    Analysis, Case, Dimension, Earlier, Failure, InitialGrid, Interface, Job, Model, Opening, Parameter, ParameterKind,
    Placement, Port, Scalar, State, StudyError, Unit, Variable, WithTangents,
};

use crate::kernel::{Recording, Tolerance, record, tangents_of, wanted};
pub use along::{Moment, Sliding};

/// Model with effects.
///
/// If every effect has its null value, the simulation is that of the base model, bit for bit.
pub struct WithEffects {
    model: Arc<dyn Model>,
    placements: Vec<Placement>,
    places: Vec<Place>,
    interface: Interface,
    max_steps: usize,
    /// Relative tolerance that suffices; 0 for that of the model.
    loosest: f64,
}

/// Place of an effect, as indices, and the indices of its parameters and initial states among the parameters.
#[derive(Debug, Clone, Copy)]
struct Place {
    site: Site,
    companion: Option<Site>,
    parameters: usize,
    starts: Option<usize>,
}

/// Port, as indices of states, inputs, signals, and forces `w`.
#[derive(Debug, Clone, Copy)]
enum Site {
    Joint { w: usize, position: usize, velocity: usize },
    Process { w: usize, state: usize },
    Actuator { input: usize },
    Sensor { signal: usize },
}

impl WithEffects {
    /// Adds effects to a model.
    ///
    /// # Errors
    /// The model has no ports, a port does not exist, or the effect does not act there; or two effects have the same
    /// name. The path of the mistake starts with the name of the effect.
    pub fn new(model: Arc<dyn Model>, placements: Vec<Placement>) -> Result<Self, StudyError> {
        // Effects are added to those that the model already has.
        let before = model.augmented().map(|(model, placements)| (Arc::clone(model), placements.to_vec()));
        let (model, placements) = match before {
            Some((model, before)) => (model, [before, placements].concat()),
            None => (model, placements),
        };
        let of = model.interface();
        if model.ported().is_none() {
            let fact = "this model does not support effects: its equations are not open";
            return Err(StudyError::here(fact).with_help("`mops check` lists the places of the models in a study"));
        }
        let mut interface = of.clone();
        let mut places = Vec::new();
        let states = model.equation_states();
        for (index, placement) in placements.iter().enumerate() {
            let Placement { name, effect, .. } = placement;
            let sites = Site::of_both(placement, of, &states).map_err(|mistake| mistake.within(name))?;
            let mut before = placements[..index].iter().filter(|before| before.port == placement.port);
            if let Some(stairs) = before.find(|before| !effect.can_follow(before.effect.as_ref())) {
                let fact = format!("`{}` cannot follow the staircase of `{}`", effect.name(), stairs.effect.name());
                return Err(StudyError::new("place", fact).with_help("declare the quantisation after it").within(name));
            }
            let parameters = interface.parameters.len();
            for parameter in effect.parameters() {
                let variable = Variable {
                    name: format!("{name}.{}", parameter.name),
                    unit: match parameter.grid {
                        // With the unit 1/s, 5 Hz would be read as 5 rad/s.
                        InitialGrid::Frequencies(_) => Unit::known("rad/s"),
                        _ if parameter.kind.is_value() && parameter.dimension == Dimension::POSITION => {
                            unit_of_place(&placement.port, placement.companion.as_ref(), of)
                        }
                        _ if parameter.kind == ParameterKind::Zero => {
                            unit_of_place(&placement.port, None, of).difference().of_unknown_kind()
                        }
                        _ => unit(parameter.dimension, &placement.port, placement.companion.as_ref(), of),
                    },
                    about: parameter.about.to_owned(),
                };
                if interface.parameters.iter().any(|p| p.variable.name == variable.name) {
                    let fact = format!("the model already has a parameter `{}`", variable.name);
                    return Err(StudyError::new(name, fact).with_help("give the effect another name"));
                }
                let default = match parameter.kind {
                    ParameterKind::Zero => zero_of_scale(&placement.port, of),
                    _ => parameter.null_value,
                };
                interface.parameters.push(Parameter {
                    variable,
                    default,
                    range: parameter.bounds,
                    infinite: default == Some(f64::INFINITY),
                });
            }
            let starts = (!effect.free_starts().is_empty()).then_some(interface.parameters.len());
            for (k, &dimension) in effect.free_starts().iter().enumerate() {
                let parameter = format!("{name}.start{}", k + 1);
                let variable = Variable {
                    name: parameter.clone(),
                    unit: unit(dimension, &placement.port, placement.companion.as_ref(), of),
                    about: "initial state of the effect, relative to its equilibrium".to_owned(),
                };
                let range = [f64::NEG_INFINITY, f64::INFINITY];
                interface.parameters.push(Parameter { variable, default: Some(0.0), range, infinite: false });
                let name = format!("{name}.{}", k + 1);
                interface.states.push(State { name, start: parameter, signal: None, rate_of: None });
            }
            places.push(Place { site: sites.0, companion: sites.1, parameters, starts });
        }
        Ok(Self { model, placements, places, interface, max_steps: usize::MAX, loosest: 0.0 })
    }

    /// Limits the number of steps: a simulation that needs more fails. Some parameter values make effects stiff.
    #[must_use]
    pub fn with_step_limit(mut self, max_steps: usize) -> Self {
        self.max_steps = max_steps;
        self
    }

    /// Loosens the relative tolerance to a value, where that of the model is tighter.
    #[must_use]
    pub fn with_tolerance(mut self, relative: f64) -> Self {
        self.loosest = relative;
        self
    }

    fn tolerance(&self, open: &dyn mops_core::Open) -> Tolerance {
        let tolerance = open.tolerance();
        Tolerance {
            max_steps: tolerance.max_steps.min(self.max_steps),
            relative: tolerance.relative.max(self.loosest),
            ..tolerance
        }
    }

    /// Returns the model without effects.
    pub fn model(&self) -> &Arc<dyn Model> {
        &self.model
    }

    /// Returns the effects.
    pub fn placements(&self) -> &[Placement] {
        &self.placements
    }

    /// Returns the number of parameters of the base model.
    fn own(&self) -> usize {
        self.model.interface().parameters.len()
    }

    /// Returns true if an effect may change the response or its tangents.
    fn acts<S: Scalar>(&self, index: usize, parameters: &[S]) -> bool {
        let neutral = self.placements[index].effect.parameters()[0].null_value;
        let first = parameters[self.places[index].parameters];
        neutral.is_none_or(|neutral| first.value() != neutral) || first.tangents().iter().any(|&t| t != 0.0)
    }

    /// Checks that each disturbance of a case acts at a balance of the model.
    fn check_disturbances(&self, case: &Case) -> Result<(), Failure> {
        let is_balance = |name: &String| {
            let ports = &self.model.interface().ports;
            ports.iter().any(|port| matches!(port, Port::Process { state, .. } if state == name))
        };
        match case.disturbances.iter().find(|(state, _)| !is_balance(state)) {
            Some((state, _)) => Err(Failure::Undefined(format!("no balance of a state `{state}` for a disturbance"))),
            None => Ok(()),
        }
    }

    fn simulate<S: Opening>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        self.check_disturbances(job.case)?;
        let open = self.model.ported().expect("checked on creation");
        let plant = S::open(open, &parameters[..self.own()])?;
        let acting: Vec<usize> = (0..self.placements.len()).filter(|&i| self.acts(i, parameters)).collect();
        let mut dynamics = self.driven(plant, &acting, job, parameters);
        let start = dynamics.start(parameters)?;
        let signals = wanted(job, &self.interface.signals);
        let initial: Vec<S> = job.signals.iter().map(|&signal| dynamics.measured(signal, 0.0, &start)).collect();
        let mut recording = record(&mut dynamics, &start, job.horizon, &self.tolerance(open), &signals)?;
        recording.set_initial(&initial);
        // What a recorded signal was before the record is not known.
        let earlier = if job.case.experiment.is_some() { Earlier::Extrapolated } else { Earlier::Constant };
        Ok(dynamics.delayed_sensors(recording, &signals.signals, earlier))
    }
}

impl Site {
    /// Returns the place of an effect, and its second port.
    fn of_both(
        placement: &Placement,
        interface: &Interface,
        states: &[Variable],
    ) -> Result<(Self, Option<Self>), StudyError> {
        let Placement { effect, port, companion, .. } = placement;
        let kind = |port: &Port| port.kind(&interface.ports);
        let site = |key: &str, port: &Port| {
            Self::of(port, interface, states)
                .ok_or_else(|| StudyError::new(key, format!("the model has no place {port}")))
        };
        if !kind(port).is_some_and(|kind| effect.ports().contains(&kind)) {
            let names: Vec<&str> = effect.ports().iter().map(|kind| kind.name()).collect();
            let fact = format!("`{}` does not act at {port}", effect.name());
            return Err(StudyError::new("place", fact).with_help(format!("the effect acts at: {}", names.join(", "))));
        }
        let here = site("place", port)?;
        let there = match (effect.second_port(), companion) {
            (None, None) => None,
            (Some(wanted), Some(companion)) if kind(companion) == Some(wanted) => Some(site("companion", companion)?),
            (Some(wanted), given) => {
                let (key, what) = if given.is_some() { ("companion", "another") } else { ("place", "a") };
                let fact = format!("`{}` needs {what} second place of kind {}", effect.name(), wanted.name());
                let such = interface.ports.iter().find(|port| kind(port) == Some(wanted));
                let help = such.map_or_else(
                    || format!("the model has no {}", wanted.name()),
                    |port| format!("for example companion = \"{port}\""),
                );
                return Err(StudyError::new(key, fact).with_help(help));
            }
            (None, Some(_)) => {
                let fact = format!("`{}` has no second place", effect.name());
                return Err(StudyError::new("companion", fact).with_help("remove `companion`"));
            }
        };
        Ok((here, there))
    }

    fn of(port: &Port, interface: &Interface, states: &[Variable]) -> Option<Self> {
        let state = |name: &str| states.iter().position(|s| s.name == name);
        let force = |name: &str| {
            let processes = interface.ports.iter().filter_map(|port| match port {
                Port::Process { state, .. } => Some(state),
                _ => None,
            });
            processes.into_iter().position(|state| state == name)
        };
        if !interface.ports.contains(port) {
            return None;
        }
        Some(match port {
            Port::Joint { position, velocity, .. } => {
                Self::Joint { w: force(velocity)?, position: state(position)?, velocity: state(velocity)? }
            }
            Port::Process { state: name, .. } => Self::Process { w: force(name)?, state: state(name)? },
            Port::Actuator { input } => {
                Self::Actuator { input: interface.inputs.iter().position(|i| i.name == *input)? }
            }
            Port::Sensor { output } => {
                Self::Sensor { signal: interface.signals.iter().position(|s| s.name == *output)? }
            }
        })
    }
}

/// Returns the unit of the position or the state at which an effect acts, on its temperature scale.
fn unit_of_place(port: &Port, companion: Option<&Port>, interface: &Interface) -> Unit {
    let place = match port {
        Port::Joint { .. } | Port::Process { .. } => port,
        Port::Actuator { .. } | Port::Sensor { .. } => companion.unwrap_or(port),
    };
    let (Port::Joint { position: name, .. }
    | Port::Process { state: name, .. }
    | Port::Actuator { input: name }
    | Port::Sensor { output: name }) = place;
    let mut all = interface.signals.iter().chain(&interface.inputs);
    all.find(|v| v.name == *name).map_or_else(Unit::one, |v| v.unit.clone())
}

/// Returns the absolute temperature at the zero of the scale of a place, in the unit of its differences; `None` if the place is on
/// no scale.
fn zero_of_scale(port: &Port, interface: &Interface) -> Option<f64> {
    let unit = unit_of_place(port, None, interface);
    (unit.zero() != 0.0).then(|| unit.zero() / unit.factor())
}

/// Returns the unit of an effect parameter at a port, as far as the units of the model determine it.
fn unit(dimension: Dimension, port: &Port, companion: Option<&Port>, interface: &Interface) -> Unit {
    let of = |name: &str| {
        let all = interface.signals.iter().chain(&interface.inputs);
        all.into_iter().find(|v| v.name == name).map_or_else(Unit::one, |v| v.unit.clone())
    };
    let position_and_speed = |port: &Port| match port {
        Port::Joint { position, velocity, .. } => (of(position), of(velocity)),
        Port::Process { state: name, .. } | Port::Actuator { input: name } | Port::Sensor { output: name } => {
            (of(name), of(name).power(1, -1))
        }
    };
    let (output, place) = match port {
        Port::Joint { unit, .. } | Port::Process { unit, .. } => (unit.clone(), port),
        Port::Actuator { input: name } | Port::Sensor { output: name } => (Some(of(name)), companion.unwrap_or(port)),
    };
    let (position, speed) = position_and_speed(place);
    let value = match (port, companion) {
        (Port::Joint { .. } | Port::Process { .. }, None) => Unit::one(),
        (Port::Joint { .. } | Port::Process { .. }, Some(companion)) => position_and_speed(companion).0,
        _ => position_and_speed(port).0,
    };
    let output = output.unwrap_or_else(Unit::one);
    let powers = [
        (&output, dimension.output),
        (&position, dimension.position),
        (&speed, dimension.speed),
        (&value, dimension.value),
        (&Unit::known("s"), dimension.time),
    ];
    Unit::product(&powers.map(|(unit, power)| (unit, power.into())))
}

impl Model for WithEffects {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn notes(&self) -> Vec<String> {
        self.model.notes()
    }

    fn augmented(&self) -> Option<(&Arc<dyn Model>, &[Placement])> {
        Some((&self.model, &self.placements))
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        if !job.case.disturbances.is_empty() || (0..self.placements.len()).any(|i| self.acts(i, job.parameters)) {
            return self.simulate(job, job.parameters).map(|recording| Analysis::Time(recording.response));
        }
        self.model.analyse(&Job { parameters: &job.parameters[..self.own()], ..*job })
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        let neutral = |i: usize| {
            let first = self.places[i].parameters;
            !self.acts(i, job.parameters) && seeds.iter().all(|seed| seed[first] == 0.0)
        };
        if seeds.is_empty() {
            return Some(self.analyse(job).map(|analysis| (analysis, Vec::new())));
        }
        if job.case.disturbances.is_empty() && (0..self.placements.len()).all(neutral) {
            let own: Vec<Vec<f64>> = seeds.iter().map(|seed| seed[..self.own()].to_vec()).collect();
            return self.model.tangents(&Job { parameters: &job.parameters[..self.own()], ..*job }, &own);
        }
        Some(tangents_of(|parameters| self.simulate(job, parameters), job.parameters, seeds))
    }
}

#[cfg(test)]
mod tests;
