//! The integrator: classical Runge-Kutta of order 4 with fixed steps, and dry friction with exact rest.
//!
//! A joint with dry friction slides one way, slides the other way or rests. While it slides the direction in the formula
//! is that of the mode, so that a step is smooth; where a step passes zero speed, the crossing is located (regula falsi on
//! the length of the step), the speed set to exactly 0, and the joint rests if the force that holds it is within the
//! breakaway level, else it slides on. While it rests, the force that keeps its acceleration at 0 is solved for, and it
//! breaks away at the end of the step in which that force leaves the level. Inputs are held; delayed inputs end steps.

use crate::law::{At, Installed, Spot};
use crate::plant::{Place, Plant, Setup};

/// Steps per sample of a plant with effects.
pub const STEPS: usize = 20;
/// Largest number of states, of the plant and of its effects.
const SIZE: usize = 16;
/// Largest number of places, inputs, outputs.
const FEW: usize = 4;
/// Largest number of parameters.
const MANY: usize = 8;

type State = [f64; SIZE];

/// Clean outputs of the base model, by output and sample; `None` where it diverges. `steps` per sample.
pub fn base_outputs(plant: &Plant, p: &[f64], start: &[f64], setup: &Setup, steps: usize) -> Option<Vec<Vec<f64>>> {
    let outputs: Vec<usize> = plant.outputs.iter().map(|output| output.state).collect();
    base_states(plant, p, start, setup, (steps, &outputs))
}

/// The same for some states; `None` where it diverges.
pub fn base_states(
    plant: &Plant,
    p: &[f64],
    start: &[f64],
    setup: &Setup,
    (steps, states): (usize, &[usize]),
) -> Option<Vec<Vec<f64>>> {
    let n = plant.states.len();
    let h = setup.dt / steps as f64;
    let w = [0.0; FEW];
    let mut x = [0.0; SIZE];
    x[..n].copy_from_slice(start);
    let mut out: Vec<Vec<f64>> = states.iter().map(|_| Vec::with_capacity(setup.samples)).collect();
    let mut u = [0.0; FEW];
    let inputs = plant.inputs.len();
    for k in 0..setup.samples {
        for (y, &state) in out.iter_mut().zip(states) {
            y.push(x[state]);
        }
        if k + 1 == setup.samples {
            break;
        }
        for i in 0..inputs {
            u[i] = setup.inputs[i][k];
        }
        for _ in 0..steps {
            x = runge_kutta(&x, n, h, |_, x, dx| (plant.rates)(&x[..n], &u, p, &w, dx));
        }
        if !x[..n].iter().all(|v| v.abs() < 1e9) {
            return None;
        }
    }
    Some(out)
}

/// Clean outputs of the plant with effects, by output and sample; `None` where it diverges.
pub fn outputs(
    plant: &Plant,
    p: &[f64],
    setup: &Setup,
    experiment: usize,
    effects: &[Installed],
) -> Option<Vec<Vec<f64>>> {
    World::new(plant, p, setup, experiment, effects).run()
}

/// One step of the classical method of order 4 over `n` states; `rates(fraction, x, dx)`.
fn runge_kutta(x: &State, n: usize, h: f64, rates: impl Fn(f64, &State, &mut [f64])) -> State {
    let (mut k1, mut k2, mut k3, mut k4) = ([0.0; SIZE], [0.0; SIZE], [0.0; SIZE], [0.0; SIZE]);
    let ahead = |k: &State, c: f64| {
        let mut y = *x;
        for i in 0..n {
            y[i] += c * h * k[i];
        }
        y
    };
    rates(0.0, x, &mut k1);
    rates(0.5, &ahead(&k1, 0.5), &mut k2);
    rates(0.5, &ahead(&k2, 0.5), &mut k3);
    rates(1.0, &ahead(&k3, 1.0), &mut k4);
    let mut y = *x;
    for i in 0..n {
        y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
    y
}

/// What a joint with dry friction does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    /// No dry friction here.
    Free,
    /// It slides in this direction, 1 or -1.
    Slides(f64),
    /// It rests.
    Rests,
}

struct World<'a> {
    plant: &'a Plant,
    p: &'a [f64],
    setup: &'a Setup,
    experiment: usize,
    effects: &'a [Installed],
    /// Where each effect's own states begin.
    own: Vec<usize>,
    /// States of plant and effects.
    n: usize,
    /// Commands that act now, delays included.
    u: [f64; FEW],
    modes: [Mode; FEW],
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
        assert!(n <= SIZE && p.len() <= MANY && plant.places.len() <= FEW, "sizes are small");
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
        cuts.extend([0.0, setup.dt]);
        cuts.sort_by(f64::total_cmp);
        let before = late(false).fold(0.0, f64::max);

        // What a delayed measurement shows at first has happened before.
        let mut past: Vec<(f64, State)> = Vec::new();
        self.commands(0.0);
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
            for cut in cuts.windows(2) {
                let length = cut[1] - cut[0];
                self.commands(t + 0.5 * (cut[0] + cut[1]));
                self.settle(t + cut[0], &mut x);
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

    fn at<'s>(&'s self, effect: usize, t: f64, x: &'s State) -> At<'s> {
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

    fn settle(&self, t: f64, x: &mut State) {
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

    /// Derivatives; the forces that hold resting joints are left in `held`.
    fn rates(&self, t: f64, x: &State, dx: &mut [f64], held: &mut [f64; FEW]) {
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
        *held = [0.0; FEW];
        if !self.modes[..m].contains(&Mode::Rests) {
            return;
        }
        // Accelerations are affine in w: two sweeps of elimination suffice for one resting joint, and converge for two.
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
                held[j] += force;
                rates(&w, dx);
            }
        }
        for j in (0..m).filter(|&j| resting(j)) {
            dx[self.plant.places[j].equation()] = 0.0;
        }
    }

    /// The levels at a joint for a direction, of all effects there.
    fn hold(&self, j: usize, t: f64, x: &State, way: f64) -> f64 {
        let here = self.effects.iter().enumerate().filter(|(_, e)| e.spot == Spot::Place(j));
        here.filter_map(|(i, e)| e.law.dry.as_ref().map(|dry| dry(&self.at(i, t, x), way).hold)).sum()
    }

    /// Modes at the start.
    fn begin(&mut self, t: f64, x: &State) {
        for j in 0..self.plant.places.len() {
            let speed = x[self.plant.places[j].equation()];
            if self.modes[j] != Mode::Free && speed != 0.0 {
                self.modes[j] = Mode::Slides(speed.signum());
            }
        }
        self.break_away(t, x);
    }

    /// Lets joints go that rest under more than the level.
    fn break_away(&mut self, t: f64, x: &State) {
        for j in 0..self.plant.places.len() {
            if self.modes[j] == Mode::Rests {
                let (mut dx, mut held) = ([0.0; SIZE], [0.0; FEW]);
                self.rates(t, x, &mut dx, &mut held);
                let way = -held[j].signum();
                if held[j].abs() > self.hold(j, t, x, way) {
                    self.modes[j] = Mode::Slides(way);
                }
            }
        }
    }

    fn step(&self, t: f64, x: &State, h: f64) -> State {
        runge_kutta(x, self.n, h, |c, x, dx| self.rates(t + c * h, x, dx, &mut [0.0; FEW]))
    }

    /// Advances by `h`, through what joints with dry friction do.
    fn advance(&mut self, t: f64, x: State, h: f64) -> State {
        let (mut x, mut t, mut left) = (x, t, h);
        for _ in 0..12 {
            let y = self.step(t, &x, left);
            let turned = (0..self.plant.places.len()).filter_map(|j| match self.modes[j] {
                Mode::Slides(way) if way * y[self.plant.places[j].equation()] < 0.0 => {
                    Some((j, self.crossing(j, t, &x, left, &y)))
                }
                _ => None,
            });
            let first = turned.min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((j, length)) = first else {
                x = y;
                t += left;
                break;
            };
            if length > 0.0 {
                x = self.step(t, &x, length);
                x[self.plant.places[j].equation()] = 0.0;
            }
            self.modes[j] = Mode::Rests;
            if length <= 0.0 {
                continue; // It would turn back at once: it rests to the end of this step.
            }
            t += length;
            left -= length;
            self.break_away(t, &x);
            if left <= 1e-9 * h {
                break;
            }
        }
        self.break_away(t, &x);
        self.settle(t, &mut x);
        x
    }

    /// Length of the step at whose end the speed of joint `j` is 0.
    fn crossing(&self, j: usize, t: f64, x: &State, h: f64, end: &State) -> f64 {
        let equation = self.plant.places[j].equation();
        let (mut low, mut high) = ((0.0, x[equation]), (h, end[equation]));
        if low.1 == 0.0 {
            return 0.0;
        }
        let mut last = 0;
        for _ in 0..30 {
            let middle = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let speed = self.step(t, x, middle)[equation];
            if speed.abs() < 1e-12 * (low.1.abs() + high.1.abs()) || high.0 - low.0 < 1e-12 * h {
                return middle;
            }
            // Illinois: the end that stays twice counts half.
            if speed * low.1 > 0.0 {
                low = (middle, speed);
                if last == 1 {
                    high.1 *= 0.5;
                }
                last = 1;
            } else {
                high = (middle, speed);
                if last == -1 {
                    low.1 *= 0.5;
                }
                last = -1;
            }
        }
        high.0
    }
}

/// A state at an earlier time, on straight lines between steps.
fn earlier(past: &[(f64, State)], t: f64, state: usize) -> f64 {
    let i = past.partition_point(|(at, _)| *at <= t).clamp(1, past.len() - 1);
    let ((t0, x0), (t1, x1)) = (&past[i - 1], &past[i]);
    x0[state] + (x1[state] - x0[state]) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
}
