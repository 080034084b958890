//! Linearisation along a simulation: response of the states and signals of a model with effects to small forces at the
//! ports.

use mops_core::{Cancellation, DIRECTIONS, Dual, Dual7, Failure, Job, Opening, Scalar};
use nalgebra::DMatrix;

use super::WithEffects;
use super::dynamics::Driven;
use crate::kernel::{Sink, Step, integrate};

/// Instant of a simulation with its linearisation `dx' = A dx + B db`, `dy = C dx + D db`. The vector `b` contains the
/// commanded inputs, then the forces.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Time, s.
    pub t: f64,
    /// States of the plant, then those of the effects.
    pub x: Vec<f64>,
    /// Rates of the states.
    pub rates: Vec<f64>,
    /// Commanded inputs.
    pub u: Vec<f64>,
    /// Requested signals.
    pub y: Vec<f64>,
    /// Joints with dry friction.
    pub sliding: Vec<Sliding>,
    /// State matrix `A`. A stuck joint creeps: it slides with a friction proportional to the speed that reaches the largest
    /// holding force at 1e-4 of its typical speed. A joint that takes no force could never break loose.
    pub a: DMatrix<f64>,
    /// Input matrix `B`.
    pub b: DMatrix<f64>,
    /// Output matrix `C`.
    pub c: DMatrix<f64>,
    /// Feedthrough matrix `D`.
    pub d: DMatrix<f64>,
}

/// Joint with dry friction at an instant.
#[derive(Debug, Clone, Copy)]
pub struct Sliding {
    /// Speed, as a state.
    pub velocity: usize,
    /// 1 if the joint slides forward, -1 if backward, 0 if it is stuck.
    pub direction: f64,
    /// How many times it has come to rest so far.
    pub rests: usize,
}

/// States at chosen times, with the mode of the step.
struct Looks<'t> {
    times: &'t [f64],
    cancellation: &'t Cancellation,
    next: usize,
    sliding: Vec<Sliding>,
    found: Vec<Look>,
}

struct Look {
    t: f64,
    x: Vec<f64>,
    u: Vec<f64>,
    /// External forces.
    w: Vec<f64>,
    contacts: super::contacts::Contacts,
    sliding: Vec<Sliding>,
    /// Contact and hysteresis state of each effect.
    effects: Vec<(Option<bool>, Vec<f64>)>,
}

impl<'a> Sink<f64, Driven<'a, f64>> for Looks<'_> {
    fn ends(&self, _: f64) -> Option<Failure> {
        self.cancellation.requested().map(|_| Failure::Cancelled)
    }

    fn step(&mut self, step: &Step<f64>, dynamics: &Driven<'a, f64>) {
        let end = step.start + step.taken;
        let before = std::mem::take(&mut self.sliding);
        let now = dynamics.contacts.directions().enumerate().map(|(k, (velocity, direction))| {
            let rests =
                before.get(k).map_or(0, |was| was.rests + usize::from(direction == 0.0 && was.direction != 0.0));
            Sliding { velocity, direction, rests }
        });
        self.sliding = now.collect();
        let mut x = vec![0.0; dynamics.size()];
        while self.next < self.times.len() && self.times[self.next] <= end + 1e-9 * (1.0 + end.abs()) {
            let t = self.times[self.next];
            let s = if step.taken > 0.0 { ((t - step.start) / step.taken).clamp(0.0, 1.0) } else { 1.0 };
            step.state(s, &mut x);
            self.found.push(Look {
                t,
                x: x.clone(),
                u: dynamics.commanded(t.clamp(step.start, end)),
                w: dynamics.disturbed(t.clamp(step.start, end)),
                contacts: dynamics.contacts.clone(),
                sliding: self.sliding.clone(),
                effects: dynamics.actors.iter().map(|actor| (actor.closed, actor.memory.clone())).collect(),
            });
            self.next += 1;
        }
    }
}

impl WithEffects {
    /// Linearises the model at increasing times along a simulation, for the signals of the job.
    ///
    /// # Errors
    /// The failure of the simulation.
    pub fn along(&self, job: &Job<'_>, times: &[f64]) -> Result<Vec<Moment>, Failure> {
        self.check_disturbances(job.case)?;
        let open = self.model.ported().expect("checked on creation");
        let acting: Vec<usize> = (0..self.placements.len()).filter(|&i| self.acts(i, job.parameters)).collect();
        let plant = f64::open(open, &job.parameters[..self.own()])?;
        let mut dynamics = self.driven(plant, &acting, job, job.parameters);
        let start = dynamics.start(job.parameters)?;
        let mut looks = Looks {
            times,
            cancellation: &job.case.cancellation,
            next: 0,
            sliding: Vec::new(),
            found: Vec::with_capacity(times.len()),
        };
        let end = times.last().copied().unwrap_or(job.horizon).max(job.horizon);
        integrate(&mut dynamics, 0.0, end, &start, &self.tolerance(open), &mut looks)?;

        let parameters: Vec<Dual7> = job.parameters.iter().map(|&p| p.into()).collect();
        let plant = Dual7::open(open, &parameters[..self.own()])?;
        let mut tangent = self.driven(plant, &acting, job, &parameters);
        tangent.start(&parameters)?;
        let forces = self.model.interface().forces();
        let looks = looks.found;
        let typical = |state: usize| {
            #[allow(clippy::cast_precision_loss)]
            let count = looks.len().max(1) as f64;
            (looks.iter().map(|look| look.x[state] * look.x[state]).sum::<f64>() / count).sqrt()
        };
        let speeds: Vec<f64> = (0..dynamics.size()).map(typical).collect();
        Ok(looks.iter().map(|look| moment(&mut tangent, look, &speeds, forces, job.signals)).collect())
    }
}

impl WithEffects {
    /// Returns the rate that a unit force at each balance adds to its state at the beginning of a simulation.
    ///
    /// # Errors
    /// The model cannot start.
    pub fn mobilities(&self, job: &Job<'_>) -> Result<Vec<f64>, Failure> {
        let open = self.model.ported().expect("checked on creation");
        let plant = f64::open(open, &job.parameters[..self.own()])?;
        let mut dynamics = self.driven(plant, &[], job, job.parameters);
        dynamics.start(job.parameters)?;
        Ok(dynamics.mobilities())
    }
}

/// Share of its typical speed at which a stuck joint creeps under the largest force that holds it.
const CREEP: f64 = 1e-4;

fn moment(tangent: &mut Driven<'_, Dual7>, look: &Look, speeds: &[f64], forces: usize, signals: &[usize]) -> Moment {
    let (n, inputs) = (look.x.len(), look.u.len());
    let columns = n + inputs + forces;
    let mut slopes = DMatrix::zeros(n + signals.len(), columns);
    let (mut rates, mut y) = (vec![0.0; n], vec![0.0; signals.len()]);
    let constant = |values: &[f64]| values.iter().map(|&v| Dual7::from(v)).collect::<Vec<_>>();
    tangent.take(&look.contacts, &look.effects);
    let held = tangent.holding(look.t, &constant(&look.x), &constant(&look.u));
    let held_rates = (!held.is_empty()).then(|| {
        tangent.command(look.u.iter().map(|&u| u.into()), look.w.iter().map(|&w| w.into()));
        tangent.look(look.t, &constant(&look.x), &constant(&vec![0.0; forces]), &[]).0
    });
    tangent.take(&look.contacts.sliding(), &look.effects);
    for first in (0..columns).step_by(DIRECTIONS) {
        let seeded = |(j, &value): (usize, &f64)| {
            let direction = j.wrapping_sub(first);
            if direction < DIRECTIONS { Dual::variable(value, direction) } else { Dual::from(value) }
        };
        let zeros = vec![0.0; forces];
        let all: Vec<Dual7> = look.x.iter().chain(&look.u).chain(&zeros).enumerate().map(seeded).collect();
        let (x, rest) = all.split_at(n);
        let (u, w) = rest.split_at(inputs);
        tangent.command(u.iter().copied(), look.w.iter().map(|&w| w.into()));
        let (dx, outputs) = tangent.look(look.t, x, w, signals);
        for (i, row) in dx.iter().chain(&outputs).enumerate() {
            for j in first..columns.min(first + DIRECTIONS) {
                slopes[(i, j)] = row.tangents()[j - first];
            }
        }
        rates.iter_mut().zip(&dx).for_each(|(r, d)| *r = d.value());
        y.iter_mut().zip(&outputs).for_each(|(y, o)| *y = o.value());
    }
    if let Some(held_rates) = held_rates {
        rates.iter_mut().zip(&held_rates).for_each(|(r, d)| *r = d.value());
    }
    for (w, velocity, most) in held {
        let slope = most / (CREEP * speeds[velocity]);
        if slope.is_finite() {
            let forward = tangent.forward(w);
            for i in 0..n {
                let creep = slope * forward * slopes[(i, n + inputs + w)];
                slopes[(i, velocity)] -= creep;
            }
        }
    }
    Moment {
        t: look.t,
        sliding: look.sliding.clone(),
        x: look.x.clone(),
        rates,
        u: look.u.clone(),
        y,
        a: slopes.view((0, 0), (n, n)).into_owned(),
        b: slopes.view((0, n), (n, inputs + forces)).into_owned(),
        c: slopes.view((n, 0), (signals.len(), n)).into_owned(),
        d: slopes.view((n, n), (signals.len(), inputs + forces)).into_owned(),
    }
}
