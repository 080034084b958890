//! State of a twin, and its rates.

use super::law::{At, Law};
use super::laws::law;
use super::plants::Body;
use super::{Command, Declared, Site};

/// Maximum number of states of a plant with its effects, and of its signals.
pub(super) const SIZE: usize = 12;
/// Maximum number of effects, and of their guards.
pub(super) const FEW: usize = 4;

/// States of the plant, then those of its effects.
pub(super) type State = [f64; SIZE];

/// Mode of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mode {
    /// No dry friction.
    Free,
    /// Sliding in this direction, 1 or -1.
    Slides(f64),
    /// At rest.
    Rests,
}

/// Effect with its law.
pub(super) struct Installed {
    pub(super) law: Law,
    pub(super) site: Site,
    companion: Option<Site>,
    /// True for a law of the relative position and speed.
    is_relative: bool,
    /// Index of the first own state.
    own: usize,
}

/// Quantities at a state.
#[derive(Clone, Copy)]
pub(super) struct Now {
    /// Rates of all states.
    pub(super) dx: State,
    /// Force on the mass of each joint, without dry friction.
    pub(super) net: [f64; FEW],
    /// Signals behind the sensor effects, without delays.
    pub(super) signals: State,
    /// Value that each effect receives.
    pub(super) received: [f64; FEW],
    /// Output of each effect.
    pub(super) outputs: [f64; FEW],
    /// Guards of all effects; 1 beyond their number.
    pub(super) guards: [f64; FEW],
    /// Command that reaches the plant.
    u: f64,
}

/// Simulation of a plant with effects.
pub(super) struct Twin<'a> {
    pub(super) body: &'a Body,
    command: &'a Command<'a>,
    pub(super) effects: Vec<Installed>,
    /// Number of states of the plant and its effects.
    pub(super) n: usize,
    /// Time, s.
    pub(super) t: f64,
    pub(super) x: State,
    pub(super) modes: [Mode; FEW],
    /// Output of each effect at the end of the last step.
    pub(super) last: [f64; FEW],
    /// Start and end of the span within which the command is smooth, s; both negative before the start.
    span: [f64; 2],
}

impl<'a> Twin<'a> {
    /// Creates a twin at rest just before time 0.
    pub(super) fn new(body: &'a Body, effects: &[Declared<'_>], command: &'a Command<'a>) -> Self {
        let mut n = body.states.len();
        let mut modes = [Mode::Free; FEW];
        let mut installed = Vec::new();
        for Declared { name, site, companion, is_mutual, parameters } in effects {
            let mut law = law(name, parameters).unwrap_or_else(|| panic!("{name} has no law"));
            let is_relative = *is_mutual && law.onward == 0.0;
            if is_relative {
                law.onward = -1.0;
            }
            if let (Some(_), Site::Joint(j)) = (&law.dry, *site) {
                modes[j] = Mode::Rests;
            }
            let own = n;
            n += law.states;
            installed.push(Installed { law, site: *site, companion: *companion, is_relative, own });
        }
        let guards: usize = installed.iter().map(|effect| effect.law.guards.len()).sum();
        assert!(n <= SIZE && effects.len() <= FEW && guards <= FEW, "the plant exceeds the fixed array sizes");
        let mut x = [0.0; SIZE];
        x[..body.states.len()].copy_from_slice(body.start);
        let (last, span) = ([f64::NAN; FEW], [-1.0; 2]);
        let mut twin = Self { body, command, effects: installed, n, t: 0.0, x, modes, last, span };
        // An effect starts in the state that fits what the effects before it pass on.
        for i in 0..twin.effects.len() {
            let now = twin.now();
            let before = twin.x;
            let (at, effect) = (twin.at(i, 0.0, 0.0, &before, &now), &twin.effects[i]);
            let mut z = before[effect.own..effect.own + effect.law.states].to_vec();
            if let Some(begin) = &effect.law.begin {
                begin(&at, &mut z);
            }
            let own = effect.own;
            twin.x[own..own + z.len()].copy_from_slice(&z);
        }
        twin.last = twin.now().outputs;
        twin
    }

    /// Returns the delay of the command, s.
    pub(super) fn delay(&self) -> f64 {
        self.effects.iter().filter(|effect| effect.site == Site::Actuator).map(|effect| effect.law.delay).sum()
    }

    /// Returns the delay of every signal, s.
    pub(super) fn sensor_delays(&self) -> State {
        let mut delays = [0.0; SIZE];
        for effect in &self.effects {
            if let Site::Sensor(i) = effect.site {
                delays[i] += effect.law.delay;
            }
        }
        delays
    }

    /// Starts a span within which the command is smooth.
    pub(super) fn enter(&mut self, from: f64, until: f64) {
        (self.t, self.span) = (from, [from, until]);
        self.last = self.now().outputs;
        self.decide();
    }

    /// Returns the quantities at the present state.
    pub(super) fn now(&self) -> Now {
        self.evaluate(self.t, 0.0, &self.x)
    }

    /// Returns the delayed command; within a span, its limits from inside.
    fn commanded(&self, t: f64) -> f64 {
        let [from, until] = self.span;
        let inside = if until < 0.0 { -1.0 } else { t.clamp(from + 1e-12, until - 1e-12) - self.delay() };
        if inside < 0.0 { self.command.before } else { (self.command.value)(inside) }
    }

    /// Returns position and speed at a place, or its value and 0.
    fn located(&self, site: Option<Site>, x: &State, u: f64) -> (f64, f64) {
        match site {
            None => (0.0, 0.0),
            Some(Site::Joint(j)) => (x[self.body.joints[j].q], x[self.body.joints[j].v]),
            Some(Site::Process(i)) => (x[i], 0.0),
            Some(Site::Sensor(i)) if i < self.body.states.len() => (x[i], 0.0),
            Some(Site::Actuator | Site::Sensor(_)) => (u, 0.0),
        }
    }

    /// Returns the state at the place of an effect.
    pub(super) fn at<'s>(&'s self, i: usize, t: f64, elapsed: f64, x: &'s State, now: &Now) -> At<'s> {
        let Installed { law, site, companion, is_relative, own } = &self.effects[i];
        let (mut q, mut v) = self.located(Some(*site), x, now.u);
        let (other, other_speed) = self.located(*companion, x, now.u);
        if *is_relative {
            (q, v) = (q - other, v - other_speed);
        }
        let z = &x[*own..own + law.states];
        At { t, value: now.received[i], q, v, other, other_speed, z, last: self.last[i], elapsed }
    }

    /// Passes a value through the effects of an actuator or a sensor, in the order of their declaration.
    fn pass(&self, site: Site, (t, elapsed): (f64, f64), x: &State, value: f64, now: &mut Now) -> f64 {
        let mut value = value;
        for i in (0..self.effects.len()).filter(|&i| self.effects[i].site == site) {
            now.received[i] = value;
            value = self.output(i, (t, elapsed), x, now);
        }
        value
    }

    /// Returns the output of an effect; writes its rates and its guards.
    fn output(&self, i: usize, (t, elapsed): (f64, f64), x: &State, now: &mut Now) -> f64 {
        let at = self.at(i, t, elapsed, x, now);
        let Installed { law, own, .. } = &self.effects[i];
        if let Some(rates) = &law.rates {
            rates(&at, &mut now.dx[*own..own + law.states]);
        }
        let first: usize = self.effects[..i].iter().map(|effect| effect.law.guards.len()).sum();
        for (k, guard) in law.guards.iter().enumerate() {
            now.guards[first + k] = guard(&at);
        }
        now.outputs[i] = law.output.as_ref().map_or(0.0, |output| output(&at));
        now.outputs[i]
    }

    /// Returns the quantities at a state.
    pub(super) fn evaluate(&self, t: f64, elapsed: f64, x: &State) -> Now {
        let (body, n) = (self.body, self.body.states.len());
        let commanded = self.commanded(t);
        let mut now = Now {
            dx: [0.0; SIZE],
            net: [0.0; FEW],
            signals: [0.0; SIZE],
            received: [0.0; FEW],
            outputs: [0.0; FEW],
            guards: [1.0; FEW],
            u: commanded,
        };
        now.u = self.pass(Site::Actuator, (t, elapsed), x, commanded, &mut now);
        let mut sides = [0.0; SIZE];
        (body.sides)(&x[..n], now.u, &mut sides);
        let equation = |site: Site| match site {
            Site::Joint(j) => Some(body.joints[j].v),
            Site::Process(i) => Some(i),
            _ => None,
        };
        for i in 0..self.effects.len() {
            let Some(place) = equation(self.effects[i].site) else { continue };
            let force = self.output(i, (t, elapsed), x, &mut now);
            sides[place] += force;
            if let Some(second) = self.effects[i].companion.and_then(equation) {
                sides[second] += self.effects[i].law.onward * force;
            }
        }
        let mut inertias = [1.0; SIZE];
        inertias[..n].copy_from_slice(body.inertias);
        for (j, joint) in body.joints.iter().enumerate() {
            now.net[j] = sides[joint.v];
            let here = || self.effects.iter().filter(move |effect| effect.site == Site::Joint(j));
            let added: f64 = here().map(|effect| effect.law.added).sum();
            let lost: f64 = here().map(|effect| effect.law.lost).sum();
            let full = inertias[joint.v] + added;
            inertias[joint.v] = full - (lost * t).min(0.95 * full);
            match self.modes[j] {
                Mode::Free => (),
                Mode::Rests => sides[joint.v] = 0.0,
                Mode::Slides(way) => sides[joint.v] -= way * self.levels(j, way, t, x, &now).slide,
            }
        }
        for i in 0..n {
            now.dx[i] = sides[i] / inertias[i];
            now.signals[i] = self.pass(Site::Sensor(i), (t, elapsed), x, x[i], &mut now);
        }
        now.signals[n] = self.pass(Site::Sensor(n), (t, elapsed), x, now.u, &mut now);
        now
    }
}
