//! Simulation of a plant with effects through an experiment.

use super::step::{FEW, MANY, SIZE, STEPS, State, sample};
use crate::law::{At, Installed, Spot};
use crate::plant::{Place, Plant, Setup};

/// Returns the noise-free outputs of the plant with effects, by output and sample; `None` if it diverges.
pub fn outputs(
    plant: &Plant,
    p: &[f64],
    setup: &Setup,
    experiment: usize,
    effects: &[Installed],
) -> Option<Vec<Vec<f64>>> {
    World::new(plant, p, setup, experiment, effects).run()
}

/// Simulation of a plant with effects.
pub(super) struct World<'a> {
    pub(super) plant: &'a Plant,
    p: &'a [f64],
    setup: &'a Setup,
    experiment: usize,
    pub(super) effects: &'a [Installed],
    /// Index of each effect's first own state.
    own: Vec<usize>,
    /// Number of states of plant and effects.
    pub(super) n: usize,
    /// Commands that act now, delays included.
    u: [f64; FEW],
    pub(super) modes: [Mode; FEW],
}

impl<'a> World<'a> {
    fn new(plant: &'a Plant, p: &'a [f64], setup: &'a Setup, experiment: usize, effects: &'a [Installed]) -> Self {
        let mut n = plant.states.len();
        let mut own = Vec::new();
        let mut modes = [Mode::Free; FEW];
        for effect in effects {
            own.push(n);
            n += effect.law.states.len();
            if let (Some(_), Spot::Place(j)) = (&effect.law.dry, effect.spot) {
                modes[j] = Mode::Rests;
            }
        }
        assert!(n <= SIZE && p.len() <= MANY && plant.places.len() <= FEW, "the plant exceeds the fixed array sizes");
        Self { plant, p, setup, experiment, effects, own, n, u: [0.0; FEW], modes }
    }

    fn run(mut self) -> Option<Vec<Vec<f64>>> {
        let (plant, setup) = (self.plant, self.setup);
        let mut x = [0.0; SIZE];
        x[..plant.states.len()].copy_from_slice(&setup.start);
        for (effect, &own) in self.effects.iter().zip(&self.own) {
            x[own..own + effect.law.states.len()].copy_from_slice(&effect.law.states);
        }
        let late = |actuator: bool| {
            self.effects.iter().filter(move |e| matches!(e.spot, Spot::Actuator(_)) == actuator).map(|e| e.law.delay)
        };
        // Offsets within a sample at which a delayed command changes.
        let mut cuts: Vec<f64> = late(true).map(|delay| delay % setup.dt).filter(|&r| r > 1e-9 * setup.dt).collect();
        cuts.extend(plant.traits.sampled.map(|sampled| sampled.delay * setup.dt));
        cuts.extend([0.0, setup.dt]);
        cuts.sort_by(f64::total_cmp);
        let before = late(false).fold(0.0, f64::max);

        // The first values of a delayed measurement lie before the first sample.
        let mut past: Vec<(f64, State)> = Vec::new();
        self.commands(0.0);
        for (i, effect) in self.effects.iter().enumerate() {
            if let Some(begin) = &effect.law.begin {
                let plant = x;
                begin(&self.at(i, 0.0, &plant), &mut x[self.own[i]..][..effect.law.states.len()]);
            }
        }
        self.settle(-before, &mut x);
        self.begin(-before, &x);
        if before > 0.0 {
            let steps = (before / setup.dt * STEPS as f64).ceil();
            for i in 0..steps as usize {
                past.push((-before * (1.0 - i as f64 / steps), x));
                x = self.advance(-before * (1.0 - i as f64 / steps), x, before / steps);
            }
        }
        let mut out: Vec<Vec<f64>> = plant.outputs.iter().map(|_| Vec::with_capacity(setup.samples)).collect();
        for k in 0..setup.samples {
            let t = k as f64 * setup.dt;
            self.commands(t);
            self.settle(t, &mut x);
            if before > 0.0 {
                past.push((t, x));
            }
            self.measure(t, &x, &past, &mut out);
            if k + 1 == setup.samples {
                break;
            }
            let mut pending = sample(plant, k, &x, &self.u, self.p);
            for cut in cuts.windows(2) {
                let length = cut[1] - cut[0];
                self.commands(t + 0.5 * (cut[0] + cut[1]));
                if let Some((_, memory)) = pending.take_if(|(delay, _)| cut[0] >= *delay * setup.dt) {
                    x[plant.continuous()..plant.states.len()].copy_from_slice(&memory);
                }
                self.settle(t + cut[0], &mut x);
                self.break_away(t + cut[0], &x);
                let steps = (length / setup.dt * STEPS as f64).ceil();
                for i in 0..steps as usize {
                    let at = t + cut[0] + length * i as f64 / steps;
                    if before > 0.0 && (i > 0 || cut[0] > 0.0) {
                        past.push((at, x));
                    }
                    x = self.advance(at, x, length / steps);
                }
            }
            if !x[..self.n].iter().all(|v| v.abs() < 1e9) {
                return None;
            }
        }
        Some(out)
    }

    /// Reads the commands that act at a time; before the first sample the first one acts.
    fn commands(&mut self, t: f64) {
        for i in 0..self.plant.inputs.len() {
            let late = self.effects.iter().filter(|e| e.spot == Spot::Actuator(i)).map(|e| e.law.delay).sum::<f64>();
            let k = ((t - late) / self.setup.dt + 1e-9).floor().max(0.0) as usize;
            self.u[i] = self.setup.inputs[i][k.min(self.setup.samples - 1)];
        }
    }

    pub(super) fn at<'s>(&'s self, effect: usize, t: f64, x: &'s State) -> At<'s> {
        let plant = self.plant;
        let (q, v) = match self.effects[effect].spot {
            Spot::Place(j) => match plant.places[j] {
                Place::Joint { q, v, .. } => (x[q], x[v]),
                Place::Process { x: i } => (x[i], 0.0),
            },
            Spot::Actuator(i) => (self.u[i], 0.0),
            Spot::Sensor(o) => {
                let state = plant.outputs[o].state;
                (x[state], plant.speed_of(state).map_or(0.0, |v| x[v]))
            }
        };
        let z = &x[self.own[effect]..][..self.effects[effect].law.states.len()];
        At { t, experiment: self.experiment, q, v, x: &x[..plant.states.len()], u: &self.u, z }
    }

    pub(super) fn settle(&self, t: f64, x: &mut State) {
        for (i, effect) in self.effects.iter().enumerate() {
            if let Some(settle) = &effect.law.settle {
                let before = *x;
                settle(&self.at(i, t, &before), &mut x[self.own[i]..][..effect.law.states.len()]);
            }
        }
    }

    fn measure(&self, t: f64, x: &State, past: &[(f64, State)], out: &mut [Vec<f64>]) {
        for (o, output) in self.plant.outputs.iter().enumerate() {
            let mut y = x[output.state];
            for (i, effect) in self.effects.iter().enumerate().filter(|(_, e)| e.spot == Spot::Sensor(o)) {
                if effect.law.delay > 0.0 {
                    y = earlier(past, t - effect.law.delay, output.state);
                }
                if let Some(sense) = &effect.law.sense {
                    y = sense(&self.at(i, t, x), y);
                }
            }
            out[o].push(y);
        }
    }

    /// Computes the derivatives, and the forces that keep joints at rest.
    pub(super) fn rates(&self, t: f64, x: &State, dx: &mut [f64], fixed: &mut [f64; FEW]) {
        let (n, m) = (self.plant.states.len(), self.plant.places.len());
        let (mut u, mut w, mut p) = (self.u, [0.0; FEW], [0.0; MANY]);
        p[..self.p.len()].copy_from_slice(self.p);
        for (i, effect) in self.effects.iter().enumerate() {
            let (law, at) = (&effect.law, self.at(i, t, x));
            if let (Some(actuate), Spot::Actuator(j)) = (&law.actuate, effect.spot) {
                u[j] = actuate(&at, u[j]);
            }
            if let Some(parameters) = &law.parameters {
                parameters(t, &mut p);
            }
            if let Some(rates) = &law.rates {
                rates(&at, &mut dx[self.own[i]..][..law.states.len()]);
            }
            let Spot::Place(j) = effect.spot else { continue };
            if let Some(force) = &law.force {
                let force = force(&at);
                w[j] += force;
                for &(other, factor) in &law.also {
                    w[other] += factor * force;
                }
            }
            if let (Some(dry), Mode::Slides(way)) = (&law.dry, self.modes[j]) {
                w[j] -= way * dry(&at, way).slide;
            }
        }
        let rates = |w: &[f64; FEW], dx: &mut [f64]| (self.plant.rates)(&x[..n], &u, &p[..self.p.len()], w, dx);
        rates(&w, dx);
        *fixed = [0.0; FEW];
        if !self.modes[..m].contains(&Mode::Rests) {
            return;
        }
        // Accelerations are affine in w: one sweep of elimination suffices for one resting joint; for more, the sweeps
        // converge.
        let resting = |j: usize| self.modes[j] == Mode::Rests;
        let mut moved = [0.0; SIZE];
        for _ in 0..if (0..m).filter(|&j| resting(j)).count() > 1 { 40 } else { 1 } {
            for j in (0..m).filter(|&j| resting(j)) {
                let equation = self.plant.places[j].equation();
                let mut pushed = w;
                pushed[j] += 1.0;
                rates(&pushed, &mut moved);
                let force = -dx[equation] / (moved[equation] - dx[equation]);
                w[j] += force;
                fixed[j] += force;
                rates(&w, dx);
            }
        }
        for j in (0..m).filter(|&j| resting(j)) {
            dx[self.plant.places[j].equation()] = 0.0;
        }
    }
}

/// Returns a state at an earlier time, linearly interpolated between steps.
fn earlier(past: &[(f64, State)], t: f64, state: usize) -> f64 {
    let i = past.partition_point(|(at, _)| *at <= t).clamp(1, past.len() - 1);
    let ((t0, x0), (t1, x1)) = (&past[i - 1], &past[i]);
    x0[state] + (x1[state] - x0[state]) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
}

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
