//! Model error in the background: what a plant or its sensors do besides the model and its missing effects.
//!
//! Sources, each a deterministic function of the seed:
//!
//! - `force`: at every balance a smooth stationary Gaussian force `a F_j g(t)`, another realisation in every
//!   experiment, with `E[g(t) g(t + s)] = exp(-s^2/(2 L^2))` and the nominal force `F_j`, the root mean square of the
//!   net force.
//! - `drift`: one parameter becomes `p (1 + a g(t))`, with such a `g` of longer correlation time.
//! - `coloured`: correlated noise of every sensor, `E[n(t) n(t + s)] = a^2 exp(-|s|/L)`.
//! - `state`: at one balance a force `a F_j g(x)`, with one smooth random function `g` of the state for all
//!   experiments.
//!
//! `a` is the amplitude of the source.

use std::f64::consts::TAU;
use std::sync::Arc;

use mops_math as math;

use crate::bench::Bench;
use crate::draw::Draw;
use crate::effects::Scene;
use crate::law::{Installed, Law, Spot};
use crate::places::place;
use crate::simulate::base_states;

/// Number of waves of a random function.
const WAVES: usize = 60;
/// Number of waves of a random function of the state, and the standard deviation of their wave numbers, per standard
/// deviation of a state.
const STATE_WAVES: (usize, f64) = (40, 1.2);
/// Points of a tabulated function of time per sample.
const POINTS: f64 = 10.0;

/// Class of background.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// `force`, `drift` or `coloured`, with probabilities 0.6, 0.2 and 0.2.
    Random,
    /// `state`.
    Repeating,
}

/// Background with a free amplitude.
pub struct Background {
    /// Name of the source.
    pub source: &'static str,
    /// Place of the force, or drifting parameter; empty otherwise.
    pub at: String,
    /// Correlation time, s.
    pub time: Option<f64>,
    /// Largest amplitude.
    pub most: f64,
    part: Part,
}

enum Part {
    /// Places, nominal forces and realisations, by experiment.
    Force(Vec<Vec<(usize, f64, Arc<Table>)>>),
    /// Index of the parameter, and realisations by experiment.
    Drift(usize, Vec<Arc<Table>>),
    /// Noise of unit variance, by experiment, output and sample.
    Coloured(Vec<Vec<Vec<f64>>>),
    /// Place, nominal force and function of the state.
    State(usize, f64, Arc<OfState>),
}

impl Background {
    /// Draws a background; `None` if the baseline model diverges.
    ///
    /// Correlation times are log-uniform: 4 samples to a tenth of the shortest record for forces, 2 samples to a
    /// twentieth for sensors. They are uniform between a sixth and a half of that record for a drifting parameter.
    pub fn draw(bench: &Bench, class: Class, draw: &mut Draw) -> Option<Self> {
        let (plant, setups) = (bench.plant, &bench.setups);
        let dt = setups[0].dt;
        let shortest = setups.iter().map(crate::plant::Setup::duration).fold(f64::INFINITY, f64::min);
        let nominal = |j: usize| {
            let scene = Scene::new(plant, &bench.p, &setups[0], Spot::Place(j), Draw::new(0, ""))?;
            Some(scene.force)
        };
        let source = draw.between(0.0, 1.0);
        let background = |source, at, time, part| Self { source, at, time, most: 0.6, part };
        if class == Class::Repeating {
            let j = draw.below(plant.places.len());
            let all: Vec<usize> = (0..plant.states.len()).collect();
            let states = base_states(plant, &bench.p, &setups[0].start, &setups[0], (4, &all))?;
            let function = Arc::new(OfState::draw(draw, &states));
            let at = place(plant, Spot::Place(j));
            return Some(background("state", at, None, Part::State(j, nominal(j)?, function)));
        }
        if source < 0.6 {
            let time = draw.log_between(4.0 * dt, 0.1 * shortest);
            let of_experiment = |setup: &crate::plant::Setup, draw: &mut Draw| {
                let force = |j| Some((j, nominal(j)?, Arc::new(Table::draw(draw, time, setup.duration(), dt))));
                (0..plant.places.len()).map(force).collect::<Option<Vec<_>>>()
            };
            let forces = setups.iter().map(|setup| of_experiment(setup, draw)).collect::<Option<_>>()?;
            return Some(background("force", String::new(), Some(time), Part::Force(forces)));
        }
        if source < 0.8 {
            let (time, i) = (draw.between(shortest / 6.0, shortest / 2.0), draw.below(bench.p.len()));
            let tables = setups.iter().map(|setup| Arc::new(Table::draw(draw, time, setup.duration(), dt))).collect();
            return Some(background("drift", plant.parameters[i].name.into(), Some(time), Part::Drift(i, tables)));
        }
        let time = draw.log_between(2.0 * dt, 0.05 * shortest);
        let series = setups
            .iter()
            .map(|setup| plant.outputs.iter().map(|_| coloured(draw, math::exp(-dt / time), setup.samples)).collect());
        let part = Part::Coloured(series.collect());
        Some(Self { most: f64::INFINITY, ..background("coloured", String::new(), Some(time), part) })
    }

    /// Returns the laws that act in an experiment at an amplitude.
    pub fn laws(&self, experiment: usize, amplitude: f64) -> Vec<Installed> {
        let force =
            |j: usize, force| Installed { law: Law { force: Some(force), ..Law::default() }, spot: Spot::Place(j) };
        match &self.part {
            Part::Force(forces) => {
                let forces = forces[experiment].iter().cloned();
                forces.map(|(j, size, g)| force(j, Box::new(move |at| amplitude * size * g.at(at.t)))).collect()
            }
            Part::Drift(i, tables) => {
                let (i, g) = (*i, Arc::clone(&tables[experiment]));
                let parameters = Box::new(move |t: f64, p: &mut [f64]| p[i] *= 1.0 + amplitude * g.at(t));
                vec![Installed { law: Law { parameters: Some(parameters), ..Law::default() }, spot: Spot::Place(0) }]
            }
            Part::State(j, size, g) => {
                let (size, g) = (*size, Arc::clone(g));
                vec![force(*j, Box::new(move |at| amplitude * size * g.at(at.x)))]
            }
            Part::Coloured(_) => Vec::new(),
        }
    }

    /// Returns the noise of a sensor in an experiment at unit amplitude, if the source is in the sensors.
    pub fn noise(&self, experiment: usize, output: usize) -> Option<&[f64]> {
        match &self.part {
            Part::Coloured(series) => Some(&series[experiment][output]),
            _ => None,
        }
    }
}

/// Draws a stationary first-order autoregressive series of unit variance.
fn coloured(draw: &mut Draw, decay: f64, samples: usize) -> Vec<f64> {
    let mut value = draw.normal();
    (0..samples)
        .map(|_| {
            let now = value;
            value = decay * value + (1.0 - decay * decay).sqrt() * draw.normal();
            now
        })
        .collect()
}

/// Tabulated function of time, linear between its points and constant outside.
struct Table {
    step: f64,
    values: Vec<f64>,
}

impl Table {
    /// Draws a smooth function: a sum of waves with random phases and normally distributed frequencies. Over phases and
    /// frequencies its covariance is `exp(-s^2/(2 time^2))`.
    fn draw(draw: &mut Draw, time: f64, duration: f64, dt: f64) -> Self {
        let waves: Vec<(f64, f64)> = (0..WAVES).map(|_| (draw.normal() / time, draw.between(0.0, TAU))).collect();
        let (step, scale) = (dt / POINTS, (2.0 / WAVES as f64).sqrt());
        let value = |k: usize| waves.iter().map(|(w, phase)| math::cos(w * step * k as f64 + phase)).sum::<f64>();
        let points = (duration / step).ceil() as usize + 2;
        Self { step, values: (0..points).map(|k| scale * value(k)).collect() }
    }

    fn at(&self, t: f64) -> f64 {
        let position = (t / self.step).clamp(0.0, (self.values.len() - 1) as f64);
        let k = (position as usize).min(self.values.len() - 2);
        self.values[k] + (position - k as f64) * (self.values[k + 1] - self.values[k])
    }
}

/// Smooth random function of the state, of zero mean and unit variance over its phases.
struct OfState {
    waves: Vec<(Vec<f64>, f64)>,
}

impl OfState {
    /// Draws the function, with states in units of their standard deviation about their mean.
    fn draw(draw: &mut Draw, states: &[Vec<f64>]) -> Self {
        let scales: Vec<(f64, f64)> = states
            .iter()
            .map(|x| {
                let mean = x.iter().sum::<f64>() / x.len() as f64;
                let square = x.iter().map(|x| math::powi(x - mean, 2)).sum::<f64>() / x.len() as f64;
                (mean, square.sqrt() + 1e-9)
            })
            .collect();
        let waves = (0..STATE_WAVES.0).map(|_| {
            let numbers: Vec<f64> = scales.iter().map(|(_, scale)| STATE_WAVES.1 * draw.normal() / scale).collect();
            let offset: f64 = numbers.iter().zip(&scales).map(|(w, (mean, _))| w * mean).sum();
            (numbers, draw.between(0.0, TAU) - offset)
        });
        Self { waves: waves.collect() }
    }

    fn at(&self, x: &[f64]) -> f64 {
        let value = |(numbers, phase): &(Vec<f64>, f64)| {
            math::cos(numbers.iter().zip(x).map(|(w, x)| w * x).sum::<f64>() + phase)
        };
        (2.0 / self.waves.len() as f64).sqrt() * self.waves.iter().map(value).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns mean and standard error of the products of values `lag` apart, over realisations.
    fn covariance(series: &[Vec<f64>], lag: usize) -> (f64, f64) {
        let of_one = |s: &Vec<f64>| {
            let products: Vec<f64> = s.iter().zip(&s[lag..]).map(|(a, b)| a * b).collect();
            products.iter().sum::<f64>() / products.len() as f64
        };
        let all: Vec<f64> = series.iter().map(of_one).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let square = all.iter().map(|c| math::powi(c - mean, 2)).sum::<f64>() / all.len() as f64;
        (mean, (square / all.len() as f64).sqrt())
    }

    #[test]
    fn a_random_force_has_the_covariance_of_a_gaussian_in_the_lag() {
        let (time, dt) = (1.5, 0.5);
        let mut draw = Draw::new(3, "force");
        let series: Vec<Vec<f64>> = (0..300)
            .map(|_| {
                let table = Table::draw(&mut draw, time, 60.0, dt);
                (0..120).map(|k| table.at(dt * f64::from(k))).collect()
            })
            .collect();
        for lag in [0, 2, 3, 6, 12] {
            let exact = math::exp(-0.5 * math::powi(lag as f64 * dt / time, 2));
            let (mean, error) = covariance(&series, lag);
            assert!((mean - exact).abs() < 4.0 * error && error < 0.02, "lag {lag}: {mean}, not {exact}");
        }
    }

    #[test]
    fn coloured_noise_has_the_covariance_of_an_exponential_in_the_lag() {
        let mut draw = Draw::new(3, "colour");
        let decay = math::exp(-0.2);
        let series: Vec<Vec<f64>> = (0..300).map(|_| coloured(&mut draw, decay, 200)).collect();
        for lag in [0, 1, 5, 15] {
            let exact = math::exp(-0.2 * lag as f64);
            let (mean, error) = covariance(&series, lag);
            assert!((mean - exact).abs() < 4.0 * error && error < 0.02, "lag {lag}: {mean}, not {exact}");
        }
    }

    fn bench() -> Bench {
        Bench::draw(crate::plants::disturbed_plants()[1], 1, "test").expect("the plant does not diverge")
    }

    fn at(experiment: usize, t: f64) -> crate::law::At<'static> {
        crate::law::At { t, experiment, q: 0.1, v: 0.2, x: &[0.1, 0.2, 0.15, 0.1], u: &[0.3], z: &[] }
    }

    /// Returns the force of the first law of a background in an experiment.
    fn force(background: &Background, experiment: usize, t: f64) -> f64 {
        background.laws(experiment, 0.1)[0].law.force.as_ref().expect("it is a force")(&at(experiment, t))
    }

    #[test]
    fn a_random_force_differs_between_experiments_and_a_function_of_the_state_does_not() {
        let (bench, mut draw) = (bench(), Draw::new(5, "test"));
        let state = Background::draw(&bench, Class::Repeating, &mut draw).expect("it can be drawn");
        assert_eq!(force(&state, 0, 1.0), force(&state, 2, 3.0));
        let is_force = |b: &Background| b.source == "force";
        let mut all = std::iter::repeat_with(|| Background::draw(&bench, Class::Random, &mut draw).unwrap());
        let random = all.find(is_force).expect("most are forces");
        assert!(force(&random, 0, 1.0) != force(&random, 1, 1.0) && force(&random, 0, 1.0) != force(&random, 0, 3.0));
        // Every balance has its force.
        assert_eq!(random.laws(0, 0.1).len(), 2);
    }

    #[test]
    fn sources_have_their_probabilities_and_correlation_times_their_ranges() {
        let (bench, mut draw) = (bench(), Draw::new(7, "test"));
        let (dt, shortest) = (0.02, 249.0 * 0.02);
        let draws: Vec<Background> =
            (0..200).map(|_| Background::draw(&bench, Class::Random, &mut draw).unwrap()).collect();
        for (source, probability, low, high) in [
            ("force", 0.6_f64, 4.0 * dt, shortest / 10.0),
            ("drift", 0.2, shortest / 6.0, shortest / 2.0),
            ("coloured", 0.2, 2.0 * dt, shortest / 20.0),
        ] {
            let own: Vec<&Background> = draws.iter().filter(|b| b.source == source).collect();
            let error = (probability * (1.0 - probability) / 200.0).sqrt();
            assert!((own.len() as f64 / 200.0 - probability).abs() < 4.0 * error, "{} of {source}", own.len());
            assert!(own.iter().all(|b| b.time.is_some_and(|time| (low..=high).contains(&time))), "{source}");
        }
    }

    #[test]
    fn a_function_of_the_state_has_unit_variance_and_the_correlation_length_of_its_waves() {
        let mut draw = Draw::new(3, "state");
        // One state of mean 2 and standard deviation 1: a shift of s has the covariance exp(-(1.2 s)^2/2).
        let states = vec![vec![1.0, 3.0]];
        let functions: Vec<OfState> = (0..400).map(|_| OfState::draw(&mut draw, &states)).collect();
        for shift in [0.0, 0.5, 1.0] {
            let products: Vec<f64> = functions.iter().map(|g| g.at(&[2.3]) * g.at(&[2.3 + shift])).collect();
            let mean = products.iter().sum::<f64>() / 400.0;
            let exact = math::exp(-0.5 * math::powi(1.2 * shift, 2));
            // Var(ab) = 1 + c^2 for normal a and b.
            let error = ((1.0 + exact * exact) / 400.0_f64).sqrt();
            assert!((mean - exact).abs() < 4.0 * error, "{shift}: {mean}, not {exact}");
        }
    }
}
