//! Model with effects at its ports, as a model.

use std::sync::Arc;

use mops_core::effect::{Dimension, ParameterKind, Placement, Port};
use mops_core::model::{State, WithTangents};
use mops_core::plant::{PlantScalar, Ported};
use mops_core::trace::Earlier;
use mops_core::{Analysis, Case, Failure, Interface, Job, Model, Parameter, StudyError, Variable};
use mops_language::{Scalar, Unit};

use super::edges::BLINK;
use super::place::{Place, Site};
use super::plant::{Affected, PlacedEffect};
use crate::kernel::drive::Drive;
use crate::kernel::{Driven, Inputs, Recording, Simulation, Tolerance, shown, tangents_of, wanted};

/// Model with effects.
///
/// If every effect has its null value, the simulation is that of the base model, bit for bit.
pub struct WithEffects {
    pub(super) model: Arc<dyn Model>,
    placements: Vec<Placement>,
    places: Vec<Place>,
    interface: Interface,
    /// Number of states of the model.
    pub(super) states: usize,
    /// State whose equation contains each force.
    balances: Vec<usize>,
    /// State that each signal equals, if any.
    shows: Vec<Option<usize>>,
    max_steps: usize,
    /// Relative tolerance that suffices; 0 for that of the model.
    loosest: f64,
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
                    unit: match parameter.kind {
                        // With the unit 1/s, 5 Hz would be read as 5 rad/s.
                        ParameterKind::Frequency => Unit::known("rad/s"),
                        kind if kind.is_value() && parameter.dimension == Dimension::POSITION => {
                            unit_of_place(&placement.port, placement.companion.as_ref(), of)
                        }
                        ParameterKind::Zero => unit_of_place(&placement.port, None, of).difference().of_unknown_kind(),
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
        let balances = balances(of).filter_map(|state| states.iter().position(|s| s.name == *state)).collect();
        let shows = shown(of, &states);
        let states = states.len();
        let (max_steps, loosest) = (usize::MAX, 0.0);
        Ok(Self { model, placements, places, interface, states, balances, shows, max_steps, loosest })
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

    pub(super) fn tolerance(&self) -> Tolerance {
        let tolerance = self.ported_model().tolerance();
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
    pub(super) fn own(&self) -> usize {
        self.model.interface().parameters.len()
    }

    /// Returns true if an effect may change the response or its tangents.
    fn acts<S: Scalar>(&self, index: usize, parameters: &[S]) -> bool {
        let neutral = self.placements[index].effect.parameters()[0].null_value;
        let first = parameters[self.places[index].parameters];
        neutral.is_none_or(|neutral| first.value() != neutral) || first.tangents().iter().any(|&t| t != 0.0)
    }

    /// Checks that each disturbance of a case acts at a balance of the model.
    pub(super) fn check_disturbances(&self, case: &Case) -> Result<(), Failure> {
        let is_balance = |name: &String| {
            let ports = &self.model.interface().ports;
            ports.iter().any(|port| matches!(port, Port::Process { state, .. } if state == name))
        };
        match case.disturbances.iter().find(|(state, _)| !is_balance(state)) {
            Some((state, _)) => Err(Failure::Undefined(format!("no balance of a state `{state}` for a disturbance"))),
            None => Ok(()),
        }
    }

    /// Returns the indices of the effects that may change the response or its tangents.
    pub(super) fn acting<S: Scalar>(&self, parameters: &[S]) -> Vec<usize> {
        (0..self.placements.len()).filter(|&index| self.acts(index, parameters)).collect()
    }

    fn ported_model(&self) -> &dyn Ported {
        self.model.ported().expect("checked on creation")
    }

    /// Returns the plant with the effects of these indices.
    pub(super) fn affected<'a, S: PlantScalar>(
        &'a self,
        acting: &[usize],
        job: &Job<'_>,
        parameters: &'a [S],
    ) -> Result<Affected<'a, S>, Failure> {
        let plant = S::plant(self.ported_model(), &parameters[..self.own()])?;
        let mut size = self.states;
        let placed = |&index: &usize| {
            let (effect, place) = (&self.placements[index].effect, self.places[index]);
            let first = size;
            size += effect.states();
            PlacedEffect {
                effect: S::bind(effect.as_ref(), &parameters[place.parameters..][..effect.parameters().len()]),
                place,
                states: (first, effect.states()),
                hysteresis: vec![S::from(f64::NAN); effect.hysteresis_states()],
                offsets: place
                    .starts
                    .map_or_else(Vec::new, |at| parameters[at..][..effect.free_starts().len()].to_vec()),
                first_offset: S::from(0.0),
                closed: None,
                inertial: effect.is_inertial(),
            }
        };
        let effects = acting.iter().map(placed).collect();
        let sizes = [self.states, self.model.interface().forces()];
        Ok(Affected::new(plant, effects, sizes, &self.shows, BLINK * job.horizon))
    }

    /// Returns the inputs of a case, with its disturbances; `acting` are the effects.
    pub(super) fn inputs<'a, S: PlantScalar>(
        &self,
        acting: &[usize],
        job: &Job<'a>,
        parameters: &[S],
    ) -> Result<Inputs<'a, S>, Failure> {
        let of = self.model.interface();
        let drives = of.inputs.iter().map(|input| Drive::new(job.case.input(&input.name))).collect();
        // The output of a sensor effect may be rough, so steps end at all samples.
        let at_sensors = acting.iter().any(|&index| matches!(self.places[index].site, Site::Sensor { .. }));
        let inputs = Inputs::new(drives, of.forces()).beginning_at(job.case.begins).at_every_sample(at_sensors);
        if job.case.disturbances.is_empty() {
            return Ok(inputs);
        }
        let of_state = |state: &String| job.case.disturbances.iter().find(|(name, _)| name == state).map(|(_, of)| of);
        let drives = balances(of).map(|state| Drive::new(of_state(state)));
        let per_rate = self.bare_mobilities(job, parameters)?.into_iter().map(|mobility| S::from(1.0) / mobility);
        Ok(inputs.with_forces(drives.zip(per_rate).collect()))
    }

    /// Returns the rate that a unit force at each balance adds to its state at the start, without effects.
    pub(super) fn bare_mobilities<S: PlantScalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Vec<S>, Failure> {
        let bare = Job { case: &Case { disturbances: Vec::new(), ..job.case.clone() }, ..*job };
        let plant = S::plant(self.ported_model(), &parameters[..self.own()])?;
        let mut driven = Driven::new(plant, self.inputs(&[], &bare, parameters)?, &[]);
        let start = driven.begin()?;
        Ok(driven.mobilities(&start, &self.balances))
    }

    /// Returns for each signal the state that it equals, if no effect changes it.
    fn untouched(&self, acting: &[usize]) -> Vec<Option<usize>> {
        let touched = |k: usize| {
            acting.iter().any(|&index| matches!(self.places[index].site, Site::Sensor { signal } if signal == k))
        };
        (0..self.shows.len()).map(|k| self.shows[k].filter(|_| !touched(k))).collect()
    }

    fn simulate<S: PlantScalar>(&self, job: &Job<'_>, parameters: &[S]) -> Result<Recording, Failure> {
        self.check_disturbances(job.case)?;
        let acting = self.acting(parameters);
        let inputs = self.inputs(&acting, job, parameters)?;
        let simulation = Simulation {
            plant: &|| self.affected(&acting, job, parameters),
            inputs: &|| inputs.clone(),
            shows: &self.untouched(&acting),
            tolerance: &self.tolerance(),
        };
        let signals = wanted(job, &self.interface.signals);
        let (recording, plant) = simulation.run(job, &signals)?;
        // What a recorded signal was before the record is not known.
        let earlier = if job.case.experiment.is_some() { Earlier::Extrapolated } else { Earlier::Constant };
        Ok(plant.delayed_sensors(recording, &signals.signals, earlier))
    }
}

/// Returns the names of the states whose equations contain a force, in the order of the forces.
pub(super) fn balances(of: &Interface) -> impl Iterator<Item = &String> {
    of.ports.iter().filter_map(|port| match port {
        Port::Process { state, .. } => Some(state),
        _ => None,
    })
}

/// Returns the unit of the position or the state at which an effect acts, on its temperature scale.
pub(super) fn unit_of_place(port: &Port, companion: Option<&Port>, interface: &Interface) -> Unit {
    let place = match port {
        Port::Joint { .. } | Port::Speed { .. } | Port::Process { .. } => port,
        Port::Actuator { .. } | Port::Sensor { .. } => companion.unwrap_or(port),
    };
    let (Port::Joint { position: name, .. }
    | Port::Speed { state: name, .. }
    | Port::Process { state: name, .. }
    | Port::Actuator { input: name }
    | Port::Sensor { output: name }) = place;
    let mut all = interface.signals.iter().chain(&interface.inputs);
    all.find(|v| v.name == *name).map_or_else(Unit::one, |v| v.unit.clone())
}

/// Returns the absolute temperature at the zero of the scale of a place, in the unit of its differences; `None` if the
/// place is on no scale.
pub(super) fn zero_of_scale(port: &Port, interface: &Interface) -> Option<f64> {
    unit_of_place(port, None, interface).absolute_zero_offset()
}

/// Returns the unit of an effect parameter at a port, as far as the units of the model determine it.
pub(super) fn unit(dimension: Dimension, port: &Port, companion: Option<&Port>, interface: &Interface) -> Unit {
    let of = |name: &str| {
        let all = interface.signals.iter().chain(&interface.inputs);
        all.into_iter().find(|v| v.name == name).map_or_else(Unit::one, |v| v.unit.clone())
    };
    let position_and_speed = |port: &Port| match port {
        Port::Joint { position, velocity, .. } => (of(position), of(velocity)),
        Port::Speed { state, .. } => (of(state).power(1, 1), of(state)),
        Port::Process { state: name, .. } | Port::Actuator { input: name } | Port::Sensor { output: name } => {
            (of(name), of(name).power(1, -1))
        }
    };
    let (output, place) = match port {
        Port::Joint { unit, .. } | Port::Speed { unit, .. } | Port::Process { unit, .. } => (unit.clone(), port),
        Port::Actuator { input: name } | Port::Sensor { output: name } => (Some(of(name)), companion.unwrap_or(port)),
    };
    let (position, speed) = position_and_speed(place);
    let value = match (port, companion) {
        (Port::Joint { .. } | Port::Speed { .. } | Port::Process { .. }, None) => Unit::one(),
        (Port::Joint { .. } | Port::Speed { .. } | Port::Process { .. }, Some(companion)) => {
            position_and_speed(companion).0
        }
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
