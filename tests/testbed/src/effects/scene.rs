//! Signal ranges at the place of an effect, and effects with a free magnitude.

use std::cell::RefCell;

use mops_math as math;

use crate::draw::Draw;
use crate::law::{Law, Spot};
use crate::plant::{Place, Plant, Setup};
use crate::simulate::base_states;

/// Place in a plant during the calibration experiment, without any effect.
pub struct Scene<'a> {
    /// Plant.
    pub plant: &'a Plant,
    /// True parameters.
    pub p: &'a [f64],
    /// Calibration experiment.
    pub setup: &'a Setup,
    /// Place.
    pub spot: Spot,
    /// Smallest and largest position, state or command.
    pub range: (f64, f64),
    /// Largest speed.
    pub speed: f64,
    /// Root mean square of the net force, or of the net flow.
    pub force: f64,
    /// Force per acceleration, or capacity.
    pub inertia: f64,
    /// Typical angular frequency, rad/s.
    pub omega: f64,
    draw: RefCell<Draw>,
}

/// Complete effect with the names and values of its parameters.
pub type Made = (Law, Vec<(&'static str, f64)>);

/// Effect with a fixed random shape and a free magnitude.
pub struct Family {
    /// Smallest and largest plausible magnitude.
    pub bounds: (f64, f64),
    /// Builds the effect at a magnitude, with the names and values of its parameters.
    pub make: Box<dyn Fn(f64) -> Made>,
}

impl Family {
    /// Creates a family with magnitudes up to a maximum.
    pub fn up_to(high: f64, make: impl Fn(f64) -> Made + 'static) -> Option<Self> {
        let sensible = high.is_finite() && high > 0.0;
        sensible.then(|| Self { bounds: (high * 1e-6, high), make: Box::new(make) })
    }
}

impl<'a> Scene<'a> {
    /// Computes the signal ranges at a place; `None` if the baseline model diverges.
    pub fn new(plant: &'a Plant, p: &'a [f64], setup: &'a Setup, spot: Spot, draw: Draw) -> Option<Self> {
        let n = plant.states.len();
        let all: Vec<usize> = (0..n).collect();
        let states = base_states(plant, p, &setup.start, setup, (4, &all))?;
        let (mut speeds, mut forces, mut inertia) = (Vec::new(), Vec::new(), 1.0);
        let (state, equation) = match spot {
            Spot::Place(j) => (Some(plant.places[j].state()), Some((j, plant.places[j].equation()))),
            Spot::Sensor(o) => (Some(plant.outputs[o].state), None),
            Spot::Actuator(_) => (None, None),
        };
        let (mut dx, mut pushed, mut w) = (vec![0.0; n], vec![0.0; n], [0.0; 4]);
        for k in 0..setup.samples {
            let x: Vec<f64> = states.iter().map(|s| s[k]).collect();
            let u: Vec<f64> = setup.inputs.iter().map(|u| u[k]).collect();
            (plant.rates)(&x, &u, p, &w, &mut dx);
            if let Some(state) = state {
                speeds.push(dx[state]);
            }
            if let Some((j, equation)) = equation {
                w[j] = 1.0;
                (plant.rates)(&x, &u, p, &w, &mut pushed);
                w[j] = 0.0;
                inertia = 1.0 / (pushed[equation] - dx[equation]);
                forces.push(dx[equation] * inertia);
            }
        }
        let values = match spot {
            Spot::Actuator(i) => &setup.inputs[i],
            _ => &states[state.expect("a place or sensor has a state")],
        };
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64).sqrt();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread = (values.iter().map(|v| math::powi(v - mean, 2)).sum::<f64>() / values.len() as f64).sqrt();
        let omega = if speeds.is_empty() { 1.0 } else { rms(&speeds) / spread.max(1e-12) };
        let speed = speeds.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let draw = RefCell::new(draw);
        Some(Self { plant, p, setup, spot, range: (low, high), speed, force: rms(&forces), inertia, omega, draw })
    }

    /// Returns half the range of positions.
    pub fn reach(&self) -> f64 {
        0.5 * (self.range.1 - self.range.0)
    }

    /// Returns the largest absolute command or position.
    pub fn peak(&self) -> f64 {
        self.range.0.abs().max(self.range.1.abs())
    }

    /// Returns a random position between two fractions of the range.
    pub fn within(&self, low: f64, high: f64) -> f64 {
        let c = self.between(low, high);
        self.range.0 + c * (self.range.1 - self.range.0)
    }

    /// Returns the joint at the place.
    pub fn joint(&self) -> Option<Place> {
        match self.spot {
            Spot::Place(j) => Some(self.plant.places[j]),
            _ => None,
        }
    }

    /// Returns the position about which springs are symmetric.
    pub fn rest(&self) -> f64 {
        match self.joint() {
            Some(Place::Joint { rest, .. }) => rest,
            _ => 0.0,
        }
    }

    /// Returns true if the position, of a joint or behind a sensor, is an angle.
    pub fn is_angle(&self) -> bool {
        let state = match self.spot {
            Spot::Place(j) => self.plant.places[j].state(),
            Spot::Sensor(o) => self.plant.outputs[o].state,
            Spot::Actuator(_) => return false,
        };
        self.plant.states[state].1 == "rad"
    }

    /// Draws from the uniform distribution between two numbers.
    pub fn between(&self, low: f64, high: f64) -> f64 {
        self.draw.borrow_mut().between(low, high)
    }

    /// Draws 1 or -1.
    pub fn sign(&self) -> f64 {
        self.draw.borrow_mut().sign()
    }

    /// Draws an integer below `n`.
    pub fn below(&self, n: usize) -> usize {
        self.draw.borrow_mut().below(n)
    }

    /// Returns true with the given probability.
    pub fn chance(&self, probability: f64) -> bool {
        self.draw.borrow_mut().chance(probability)
    }
}
