//! Mechanisms: joints coupled by a mass matrix, with bearing friction.

use mops_core::{
    Failure, Instant, Interface, Parameter, Plant, Variable,
    effect::Port,
    model::State,
    plant::{EventInstant, Events, InputRates, LeftOut},
};
use mops_language::{Scalar, Unit};

use super::elements::BearingFriction;
use super::friction::{Contact, Moment, balance};
use super::rests;

/// Rigid bodies of a mechanism with `N` joints: `M(q) q'' = f(t, q, q') - friction`.
pub trait Bodies<S: Scalar, const N: usize> {
    /// Returns the mass matrix (kg m2) and the torques without bearing friction (N m), for inputs `u`, angles `q` (rad)
    /// and speeds `w` (rad/s).
    fn mass_and_force(&self, t: f64, u: &[S], q: &[S; N], w: &[S; N]) -> ([[S; N]; N], [S; N]);
}

/// Names and texts of a joint in the user interface.
#[derive(Debug)]
pub struct Joint {
    /// Name of the angle. The speed has the prefix `d`; the initial values of both have the suffix `0`.
    pub angle: &'static str,
    /// Description of the body that turns.
    pub about: &'static str,
    /// Default of the initial angle, rad.
    pub start: f64,
    /// Event texts: the joint sticks, slides, is driven by its friction, is braked again. The last two apply where the
    /// friction torque changes its sign.
    pub events: [&'static str; 4],
}

/// Returns the interface of a mechanism: angle and speed of each joint as signals and states, and initial states
/// appended to `parameters`.
pub fn interface(joints: &[Joint], mut parameters: Vec<Parameter>, inputs: Vec<Variable>) -> Interface {
    let mut interface = Interface::default();
    for Joint { angle, about, start, .. } in joints {
        let speed = format!("d{angle}");
        let what = [format!("angle of the {about}"), format!("speed of the {about}")];
        for ((name, unit, rate_of), (about, start)) in
            [((*angle).to_owned(), "rad", None), (speed, "rad/s", Some((*angle).to_owned()))]
                .into_iter()
                .zip(what.into_iter().zip([*start, 0.0]))
        {
            let parameter = format!("{name}0");
            parameters.push(Parameter::new(&parameter, unit, format!("initial {about}")).with_default(start));
            interface.signals.push(Variable::new(&name, unit, about));
            interface.states.push(State { name: name.clone(), start: parameter, signal: Some(name), rate_of });
        }
    }
    interface.signals.extend(inputs.iter().cloned());
    Interface { parameters, inputs, ..interface }
}

/// Returns the ports of a mechanism: joints with these angles, whose speeds have the prefix `d`; actuators at the
/// inputs; sensors of angles and speeds.
pub fn ports(angles: &[&str], inputs: &[&str]) -> Vec<Port> {
    let torque = || Some(Unit::known("N m"));
    let of_joint = |angle: &&str| {
        let (name, speed) = ((*angle).to_owned(), format!("d{angle}"));
        let process = Port::Process { name: name.clone(), state: speed.clone(), unit: torque() };
        [Port::Joint { name: name.clone(), position: name, velocity: speed, unit: torque() }, process]
    };
    let sensors = |angle: &&str| [(*angle).to_owned(), format!("d{angle}")].map(|output| Port::Sensor { output });
    let actuator = |input: &&str| Port::Actuator { input: (*input).to_owned() };
    let joints = angles.iter().flat_map(of_joint);
    joints.chain(inputs.iter().map(actuator)).chain(angles.iter().flat_map(sensors)).collect()
}

/// Mechanism with its friction and the contacts of its joints; the state is angle and speed of each joint in turn.
pub struct Mechanism<S, B, const N: usize> {
    bodies: B,
    start: Vec<S>,
    friction: [BearingFriction<S>; N],
    contact: [Contact; N],
    /// Segments of the friction tables on which the joints slide.
    line: [usize; N],
    /// True for a joint that its friction drives at present.
    drives: [bool; N],
    guards: Vec<Guard>,
    events: [[&'static str; 4]; N],
    started: bool,
}

/// Guard of a joint.
#[derive(Debug, Clone, Copy)]
enum Guard {
    /// Contact: the speed in the direction of sliding, or the margin to the break-away torque of a stuck joint.
    Contact(usize),
    /// Segment of the friction table of a sliding joint.
    Line(usize),
    /// Sign of the friction torque: a table below zero is not physical there, which an event reports.
    Sign(usize),
}

impl<S: Scalar, B: Bodies<S, N>, const N: usize> Mechanism<S, B, N> {
    /// Creates a mechanism from its bodies, the friction of its joints, the joints, and their initial angles and
    /// speeds.
    pub fn new(bodies: B, friction: [BearingFriction<S>; N], joints: &[Joint; N], start: &[S]) -> Self {
        let watched = |i: usize| {
            let sign = friction[i].drives_from().map(|_| Guard::Sign(i));
            let contact = (sign.is_some() || !friction[i].is_viscous()).then_some(Guard::Contact(i));
            let line = (!friction[i].table().is_straight()).then_some(Guard::Line(i));
            contact.into_iter().chain(line).chain(sign)
        };
        let guards = (0..N).flat_map(watched).collect();
        let events = std::array::from_fn(|i| joints[i].events);
        // Valid until the first `settle` of a simulation; a joint without dry friction cannot stick.
        let contact = std::array::from_fn(|i| if friction[i].is_viscous() { Contact::Forward } else { Contact::Stuck });
        Self {
            bodies,
            start: start.to_vec(),
            friction,
            contact,
            line: [0; N],
            drives: [false; N],
            guards,
            events,
            started: false,
        }
    }

    /// Returns the contacts of the joints.
    pub fn contact(&self) -> &[Contact; N] {
        &self.contact
    }

    /// Splits the state into angles and speeds.
    fn split(x: &[S]) -> ([S; N], [S; N]) {
        (std::array::from_fn(|i| x[2 * i]), std::array::from_fn(|i| x[2 * i + 1]))
    }

    /// Returns the speed of a joint in its direction of sliding, and its friction torque there.
    fn sliding(&self, i: usize, speed: S) -> (S, S) {
        let forward = match self.contact[i] {
            Contact::Forward => speed,
            Contact::Backward => -speed,
            Contact::Stuck => S::from(0.0),
        };
        (forward, self.friction[i].table().on(self.line[i], forward))
    }

    #[inline]
    fn mass_and_force(&self, at: &Instant<'_, S>, q: &[S; N], w: &[S; N]) -> ([[S; N]; N], [S; N]) {
        let (mass, mut force) = self.bodies.mass_and_force(at.t, at.u, q, w);
        force.iter_mut().zip(at.w).for_each(|(force, &outside)| *force += outside);
        (mass, force)
    }

    /// Computes accelerations and friction torques.
    fn balance(&self, at: &Instant<'_, S>) -> ([S; N], [S; N]) {
        let (q, w) = Self::split(at.x);
        let (mass, force) = self.mass_and_force(at, &q, &w);
        let sliding = std::array::from_fn(|i| self.sliding(i, w[i]).1);
        balance(&mass, &force, &sliding, &self.contact)
    }

    fn find_contacts(&mut self, at: &Instant<'_, S>, wish: &[Contact; N], released: Option<usize>) {
        let (q, w) = Self::split(at.x);
        let (mass, force) = self.mass_and_force(at, &q, &w);
        let mass = mass.map(|row| row.map(Scalar::value));
        let (force, speed) = (force.map(Scalar::value), w.map(Scalar::value));
        let sliding = std::array::from_fn(|i| self.friction[i].sliding(w[i].abs()).value());
        let limit = std::array::from_fn(|i| self.friction[i].limit().value());
        let moment = Moment { mass: &mass, force: &force, sliding: &sliding, limit: &limit, speed: &speed };
        self.contact = moment.contacts(wish, released);
        self.line = std::array::from_fn(|i| self.friction[i].table().line_at(w[i].abs()));
        self.drives = std::array::from_fn(|i| speed[i] != 0.0 && sliding[i] < 0.0);
    }
}

impl<S: Scalar, B: Bodies<S, N>, const N: usize> Plant<S> for Mechanism<S, B, N> {
    fn start(&self) -> Vec<S> {
        self.start.clone()
    }

    #[inline]
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let (acceleration, _) = self.balance(at);
        for i in 0..N {
            dx[2 * i] = at.x[2 * i + 1];
            dx[2 * i + 1] = acceleration[i];
        }
    }

    fn settle(&mut self, at: &Instant<'_, S>) {
        let wish = if self.started { self.contact } else { [Contact::Stuck; N] };
        self.started = true;
        self.find_contacts(at, &wish, None);
    }

    fn linearise(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Result<LeftOut<S>, Failure> {
        let mut frictionless = Vec::new();
        for i in 0..N {
            let speed = at.x[2 * i + 1];
            if rests(at_rest, speed) && !self.friction[i].is_viscous() {
                frictionless.push(2 * i);
                self.friction[i] = BearingFriction::none();
            }
            self.contact[i] = Contact::of(speed.value());
            self.line[i] = self.friction[i].table().line_at(speed.abs());
        }
        Ok(LeftOut { frictionless, ..LeftOut::default() })
    }

    fn events(&self) -> Option<&dyn Events<S>> {
        Some(self)
    }

    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        Some(self)
    }
}

impl<S: Scalar, B: Bodies<S, N>, const N: usize> Events<S> for Mechanism<S, B, N> {
    fn guards(&self) -> usize {
        self.guards.len()
    }

    fn guard(&self, index: usize, at: &Instant<'_, S>, _: InputRates<'_>) -> S {
        let speed = |i: usize| at.x[2 * i + 1];
        match self.guards[index] {
            Guard::Contact(i) if self.contact[i] == Contact::Stuck => {
                self.friction[i].limit() - self.balance(at).1[i].abs()
            }
            Guard::Contact(i) => speed(i) * self.contact[i].sign(),
            Guard::Line(i) | Guard::Sign(i) if self.contact[i] == Contact::Stuck => S::from(1.0),
            Guard::Line(i) => self.friction[i].table().guard(self.line[i], self.sliding(i, speed(i)).0),
            Guard::Sign(i) => {
                let torque = self.sliding(i, speed(i)).1;
                if self.drives[i] { -torque } else { torque }
            }
        }
    }

    fn guard_state(&self, index: usize) -> Option<(usize, f64)> {
        match self.guards[index] {
            Guard::Contact(i) if self.contact[i] != Contact::Stuck => Some((2 * i + 1, self.contact[i].sign())),
            _ => None,
        }
    }

    fn switch(&mut self, index: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
        let at = event.at;
        match self.guards[index] {
            Guard::Line(i) => {
                let (speed, _) = self.sliding(i, x[2 * i + 1]);
                self.line[i] = self.friction[i].table().next(self.line[i], speed);
                ""
            }
            Guard::Sign(i) => {
                self.drives[i] = !self.drives[i];
                self.events[i][if self.drives[i] { 2 } else { 3 }]
            }
            Guard::Contact(i) => {
                let mut wish = self.contact;
                let was_stuck = self.contact[i] == Contact::Stuck;
                if was_stuck {
                    wish[i] = Contact::of(self.balance(&at).1[i].value());
                } else {
                    wish[i] = Contact::Stuck;
                    x[2 * i + 1] = S::from(0.0);
                }
                self.find_contacts(&Instant { x, ..at }, &wish, was_stuck.then_some(i));
                self.events[i][usize::from(self.contact[i] != Contact::Stuck)]
            }
        }
    }
}
