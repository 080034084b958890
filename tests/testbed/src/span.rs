//! Substitution between effects: outputs as vectors, orthogonal to the sensitivities of the baseline model.

use mops_math as math;

use crate::bench::Bench;
use crate::draw::Draw;
use crate::effects::{Scene, effects};
use crate::law::{Installed, Law, Spot};
use crate::plant::Setup;
use crate::simulate::{base_outputs, outputs};

/// Integration steps per sample of the baseline model.
const STEPS: usize = 4;
/// Number of random shapes per effect of the catalogue.
const SHAPES: usize = 2;
/// Examined magnitudes, relative to the largest one.
const STRENGTHS: [f64; 2] = [0.02, 0.2];
/// Maximum number of effects that substitute for another together.
const TOGETHER: usize = 3;

/// Calibration outputs around a baseline model, in units of the noise.
pub struct Frame<'a> {
    bench: &'a Bench,
    p: &'a [f64],
    setup: Setup,
    base: Vec<f64>,
    /// Orthonormal basis of the sensitivities with respect to parameters and initial states.
    absorbed: Vec<Vec<f64>>,
}

impl<'a> Frame<'a> {
    /// Linearises the baseline model around parameters and initial states; `None` if it diverges.
    pub fn new(bench: &'a Bench, p: &'a [f64], start: &[f64]) -> Option<Self> {
        let setup = Setup { start: start.to_vec(), ..bench.setups[0].clone() };
        let run = |p: &[f64], start: &[f64]| Some(weigh(bench, &base_outputs(bench.plant, p, start, &setup, STEPS)?));
        let base = run(p, start)?;
        let mut absorbed = Vec::new();
        for j in 0..p.len() + start.len() {
            let (mut p, mut start) = (p.to_vec(), start.to_vec());
            let moved = if j < p.len() { &mut p[j] } else { &mut start[j - bench.p.len()] };
            *moved += 1e-6 * if j < bench.p.len() { *moved } else { moved.abs().max(0.1) };
            add(&mut absorbed, minus(&run(&p, &start)?, &base));
        }
        Some(Self { bench, p, setup, base, absorbed })
    }

    /// Returns the change of the outputs due to an effect, orthogonal to the baseline sensitivities; `None` if it
    /// diverges.
    pub fn shift(&self, law: Law, spot: Spot) -> Option<Vec<f64>> {
        let y = outputs(self.bench.plant, self.p, &self.setup, 0, &[Installed { law, spot }])?;
        let shift = off(&self.absorbed, minus(&weigh(self.bench, &y), &self.base));
        shift.iter().all(|v| v.is_finite()).then_some(shift)
    }

    /// Returns the root mean square residual, in units of the noise, after the best few catalogue effects are fitted to
    /// a measurement.
    ///
    /// Orthogonal matching pursuit over all effects at all places, with random shapes and linear magnitudes.
    pub fn left_by_catalogue(&self, measured: &[Vec<f64>]) -> f64 {
        let mut rest = off(&self.absorbed, minus(&weigh(self.bench, measured), &self.base));
        let mut candidates = self.catalogue();
        for _ in 0..TOGETHER {
            let along = |v: &Vec<f64>| math::powi(dot(v, &rest), 2) / dot(v, v).max(1e-300);
            let Some(best) =
                (0..candidates.len()).max_by(|&a, &b| along(&candidates[a]).total_cmp(&along(&candidates[b])))
            else {
                break;
            };
            let mut direction = Vec::new();
            add(&mut direction, candidates.swap_remove(best));
            rest = off(&direction, rest);
            candidates = candidates.into_iter().map(|v| off(&direction, v)).collect();
        }
        (dot(&rest, &rest) / rest.len() as f64).sqrt()
    }

    fn catalogue(&self) -> Vec<Vec<f64>> {
        let mut found = Vec::new();
        for effect in effects() {
            for spot in (effect.fits)(self.bench.plant) {
                for shape in 0..SHAPES {
                    let draw = Draw::new(shape as u64, &format!("stand-in {}", effect.name));
                    let scene = Scene::new(self.bench.plant, self.p, &self.setup, spot, draw);
                    let Some(family) = scene.and_then(|scene| (effect.build)(&scene)) else { continue };
                    for share in STRENGTHS {
                        let law = (family.make)(share * family.bounds.1).0;
                        found.extend(self.shift(law, spot));
                    }
                }
            }
        }
        found
    }
}

/// Returns the cosine between two vectors.
pub fn cosine(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b) / (dot(a, a) * dot(b, b)).sqrt().max(1e-300)
}

fn weigh(bench: &Bench, y: &[Vec<f64>]) -> Vec<f64> {
    y.iter().zip(&bench.total).flat_map(|(y, s)| y.iter().map(move |y| y / s)).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Removes the components along orthonormal directions, twice to reduce rounding errors.
fn off(directions: &[Vec<f64>], mut v: Vec<f64>) -> Vec<f64> {
    for direction in directions.iter().chain(directions) {
        let along = dot(direction, &v);
        v.iter_mut().zip(direction).for_each(|(v, d)| *v -= along * d);
    }
    v
}

/// Adds the direction of a vector to an orthonormal basis, unless it is contained in its span.
fn add(directions: &mut Vec<Vec<f64>>, v: Vec<f64>) {
    let before = dot(&v, &v);
    let v = off(directions, v);
    let size = dot(&v, &v);
    if size > 1e-16 * before && size > 0.0 {
        directions.push(v.iter().map(|v| v / size.sqrt()).collect());
    }
}
