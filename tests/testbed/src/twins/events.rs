//! Integration steps that end where a law jumps, and where dry friction sticks or breaks away.

use super::Site;
use super::record::Record;
use super::state::{FEW, Mode, Now, State, Twin};
use crate::law::Dry;

/// Distance in time within which a step passes a jump of a law, s.
const ACROSS: f64 = 1e-10;

/// Size of a guard up to which the state is at the edge.
const ROUNDING: f64 = 1e-13;

/// Maximum number of events within a step.
const MOST: usize = 100;

/// Event within a step.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    /// A guard changes its sign.
    Crosses,
    /// A joint comes to rest.
    Stops(usize),
    /// A joint breaks away.
    Breaks(usize),
}

impl Twin<'_> {
    /// Returns the sums of the levels of all dry frictions at a joint, for a direction.
    pub(super) fn levels(&self, j: usize, way: f64, t: f64, x: &State, now: &Now) -> Dry {
        let mut sum = Dry { slide: 0.0, hold: 0.0 };
        for (i, effect) in self.effects.iter().enumerate().filter(|(_, effect)| effect.site == Site::Joint(j)) {
            if let Some(dry) = &effect.law.dry {
                let level = dry(&self.at(i, t, 0.0, x, now), way);
                sum = Dry { slide: sum.slide + level.slide, hold: sum.hold + level.hold };
            }
        }
        sum
    }

    /// Returns true if the force on a joint at rest exceeds the breakaway level.
    fn breaks(&self, j: usize, t: f64, x: &State, now: &Now) -> bool {
        let force = now.net[j];
        force.abs() > self.levels(j, force.signum(), t, x, now).hold
    }

    /// Decides whether joints without speed rest, and in which direction others slide.
    pub(super) fn decide(&mut self) {
        let now = self.now();
        for (j, joint) in self.body.joints.iter().enumerate() {
            if self.modes[j] == Mode::Free {
                continue;
            }
            let speed = self.x[joint.v];
            let way = if speed == 0.0 { now.net[j].signum() } else { speed.signum() };
            let rests = speed == 0.0 && !self.breaks(j, self.t, &self.x, &now);
            self.modes[j] = if rests { Mode::Rests } else { Mode::Slides(way) };
        }
    }

    /// Advances by a length of time, s, through all events, and records the signals.
    pub(super) fn advance(&mut self, length: f64, record: &mut Record) {
        let end = self.t + length;
        for events in 0.. {
            let left = end - self.t;
            if left <= 1e-13 {
                break;
            }
            assert!(events < MOST, "events accumulate at {} s", self.t);
            let guards = self.now().guards;
            match self.attempt(&guards, left) {
                Ok(step) => self.accept(left, step),
                Err(event) => self.pass_event(event, (&guards, left), record),
            }
            record.push(self);
        }
        self.t = end;
    }

    /// Passes the first event within a step that has one.
    fn pass_event(&mut self, event: Event, (guards, left): (&[f64; FEW], f64), record: &mut Record) {
        let (mut low, mut high, mut event) = (0.0, left, event);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match self.attempt(guards, middle) {
                Ok(_) => low = middle,
                Err(earlier) => (high, event) = (middle, earlier),
            }
        }
        match event {
            Event::Crosses => {
                if low > ACROSS {
                    self.step(low - ACROSS);
                    record.push(self);
                }
                self.step((2.0 * ACROSS).min(left));
            }
            Event::Stops(j) => {
                self.step(high);
                self.x[self.body.joints[j].v] = 0.0;
                self.decide();
            }
            Event::Breaks(j) => {
                self.step(high);
                let way = self.now().net[j].signum();
                self.modes[j] = Mode::Slides(way);
            }
        }
    }

    /// Returns the end of a step of this length, or an event that the step passes.
    fn attempt(&self, guards: &[f64; FEW], h: f64) -> Result<(State, Now), Event> {
        let x = self.ahead(h);
        let t = self.t + h;
        let now = self.evaluate(t, h, &x);
        for (j, joint) in self.body.joints.iter().enumerate() {
            match self.modes[j] {
                Mode::Slides(way) if way * x[joint.v] < 0.0 => return Err(Event::Stops(j)),
                Mode::Rests if self.breaks(j, t, &x, &now) => return Err(Event::Breaks(j)),
                _ => (),
            }
        }
        let crosses = guards.iter().zip(&now.guards).any(|(a, b)| a.abs() > ROUNDING && a * b < 0.0);
        if crosses { Err(Event::Crosses) } else { Ok((x, now)) }
    }

    /// Takes the end of a step.
    fn accept(&mut self, h: f64, (x, now): (State, Now)) {
        self.x = x;
        self.t += h;
        self.last = now.outputs;
    }

    /// Does one step, whatever happens in it.
    fn step(&mut self, h: f64) {
        let x = self.ahead(h);
        let now = self.evaluate(self.t + h, h, &x);
        self.accept(h, (x, now));
    }

    /// Returns the state after a step of the classical Runge-Kutta method.
    fn ahead(&self, h: f64) -> State {
        let rates = |c: f64, x: &State| self.evaluate(self.t + c * h, c * h, x).dx;
        let along = |k: &State, c: f64| {
            let mut y = self.x;
            for i in 0..self.n {
                y[i] += c * h * k[i];
            }
            y
        };
        let k1 = rates(0.0, &self.x);
        let k2 = rates(0.5, &along(&k1, 0.5));
        let k3 = rates(0.5, &along(&k2, 0.5));
        let k4 = rates(1.0, &along(&k3, 1.0));
        let mut y = self.x;
        for i in 0..self.n {
            y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
        y
    }
}
