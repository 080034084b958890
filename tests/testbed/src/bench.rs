//! Plant with random parameters, experiments and noise, to which effects are added and which produces data.

use std::fmt::Write;

use mops_math as math;

use crate::draw::Draw;
use crate::effects::{Effect, Family};
use crate::fit::{Series, fit};
use crate::law::{Installed, Spot};
use crate::places::place;
use crate::plant::{Plant, Setup};
use crate::simulate::{base_outputs, outputs};
use crate::strength::find;

/// Names and roles of the experiments.
pub const EXPERIMENTS: [(&str, &str); 3] =
    [("calibration", "calibration"), ("validation_1", "selection"), ("validation_2", "selection")];

/// Parameters and initial states at the end of a fit.
pub type Fitted = Option<(Vec<f64>, Vec<f64>)>;

/// Effects at their places, with free magnitudes.
pub type Choice<'a> = [(&'a Effect, Spot, Family)];

/// Data recorded in the experiments.
pub struct Recorded {
    /// Names and contents of the data files.
    pub files: Vec<(String, String)>,
    /// Root mean square of the noise realisation, relative to the declared noise level, by experiment.
    pub floors: Vec<(String, f64)>,
}

/// Plant with random parameters, experiments and noise.
pub struct Bench {
    pub plant: &'static Plant,
    seed: u64,
    label: String,
    pub p: Vec<f64>,
    pub guesses: Vec<(f64, f64, f64)>,
    pub setups: Vec<Setup>,
    /// Standard deviation of the white noise, by output.
    white: Vec<f64>,
    /// Standard deviation of the noise including quantisation, by output.
    pub total: Vec<f64>,
    /// White noise, by experiment, output and sample.
    noise: Vec<Series>,
    /// Names and roles of the experiments.
    pub experiments: [(&'static str, &'static str); 3],
}

impl Bench {
    /// Draws everything except effects.
    pub fn draw(plant: &'static Plant, seed: u64, label: &str) -> Option<Self> {
        let draw = |what: &str| Draw::new(seed, &format!("{label} {what}"));
        let mut numbers = draw("parameters");
        let p: Vec<f64> = plant.parameters.iter().map(|p| p.nominal * math::exp(numbers.between(-0.3, 0.3))).collect();
        // Initial guesses are 20 to 60 % too high or too low; bounds are a factor of 10 to 40 away from them.
        let mut off = draw("guesses");
        let guesses = p.iter().map(|p| {
            let guess = rounded(p * (1.0 + off.sign() * off.between(0.2, 0.6)));
            (guess, rounded(guess / off.log_between(10.0, 40.0)), rounded(guess * off.log_between(10.0, 40.0)))
        });
        let guesses = guesses.collect();
        let setups: Vec<Setup> =
            (0..EXPERIMENTS.len()).map(|e| (plant.setup)(&mut draw(&format!("experiment {e}")), e)).collect();
        let mut sizes = draw("noise sizes");
        let white: Vec<f64> = plant.outputs.iter().map(|o| o.noise * math::exp(sizes.between(-0.5, 0.5))).collect();
        let total = plant.outputs.iter().zip(&white).map(|(o, s)| (s * s + o.lsb * o.lsb / 12.0).sqrt()).collect();
        let noise = setups.iter().enumerate().map(|(e, setup)| {
            let mut normal = draw(&format!("noise {e}"));
            white.iter().map(|s| (0..setup.samples).map(|_| s * normal.normal()).collect()).collect()
        });
        let noise = noise.collect();
        let experiments = EXPERIMENTS;
        Some(Self { plant, seed, label: label.to_owned(), p, guesses, setups, white, total, noise, experiments })
    }

    /// Scales the white noise so that its standard deviation is `level` times that of the outputs' definitions.
    pub fn set_noise(&mut self, level: f64) {
        for (o, output) in self.plant.outputs.iter().enumerate() {
            let factor = level * output.noise / self.white[o];
            self.white[o] *= factor;
            self.total[o] = math::hypot(self.white[o], output.lsb / 12.0_f64.sqrt());
            self.noise.iter_mut().flat_map(|series| &mut series[o]).for_each(|v| *v *= factor);
        }
    }

    /// Returns an effect by name, at a place where it fits.
    pub fn choose(&self, among: &[&'static Effect], name: &str) -> Option<(&'static Effect, Spot)> {
        let (name, at) = name.split_once('@').map_or((name, None), |(name, at)| (name, Some(at)));
        let fitting = among.iter().filter(|effect| effect.name == name);
        let choices = fitting.flat_map(|effect| (effect.fits)(self.plant).into_iter().map(move |spot| (*effect, spot)));
        let choices: Vec<_> = choices.filter(|(_, spot)| at.is_none_or(|at| at == place(self.plant, *spot))).collect();
        let mut draw = Draw::new(self.seed, &format!("{} place {name}", self.label));
        (!choices.is_empty()).then(|| choices[draw.below(choices.len())])
    }

    /// Returns the outputs of ideal sensors.
    pub fn clean(&self, e: usize, families: &Choice<'_>, strengths: &[f64]) -> Option<Series> {
        let installed = families.iter().zip(strengths);
        let installed: Vec<Installed> =
            installed.map(|((_, spot, family), e)| Installed { law: (family.make)(*e).0, spot: *spot }).collect();
        let y = if installed.is_empty() {
            base_outputs(self.plant, &self.p, &self.setups[e].start, &self.setups[e], 8)?
        } else {
            outputs(self.plant, &self.p, &self.setups[e], e, &installed)?
        };
        y.iter().flatten().all(|v| v.is_finite()).then_some(y)
    }

    /// Returns the outputs of the sensors with noise and quantisation.
    pub fn measured(&self, e: usize, clean: &Series) -> Series {
        let show = |o: usize, y: f64| {
            let lsb = self.plant.outputs[o].lsb;
            if lsb > 0.0 { (y / lsb).round() * lsb } else { y }
        };
        let noisy = clean.iter().zip(&self.noise[e]).enumerate();
        noisy.map(|(o, (y, n))| y.iter().zip(n).map(|(y, n)| show(o, y + n)).collect()).collect()
    }

    /// Returns the error of the baseline model refitted to the calibration experiment. The fit starts from the last
    /// fit, or from the true values.
    pub fn error(&self, families: &Choice<'_>, strengths: &[f64], last: &mut Fitted) -> Option<f64> {
        self.error_of(&self.measured(0, &self.clean(0, families, strengths)?), last)
    }

    /// Returns the error of the baseline model refitted to measurements of the calibration experiment.
    pub fn error_of(&self, measured: &Series, last: &mut Fitted) -> Option<f64> {
        let setup = &self.setups[0];
        let refit = |from: (&[f64], &[f64])| fit(self.plant, setup, measured, &self.total, from);
        let mut best = last.as_ref().and_then(|(p, x)| refit((p, x)));
        if best.is_none() {
            best = refit((&self.p, &setup.start));
        }
        let best = best?;
        *last = Some((best.parameters, best.start));
        Some(best.error)
    }

    /// Returns the magnitudes at which the size is reached, and the end of the last fit. Of two effects, each
    /// contributes an equal share on its own.
    pub fn strengths(&self, families: &Choice<'_>, size: f64) -> Option<(Vec<f64>, Fitted)> {
        let mut last = None;
        let floor = self.error(&[], &[], &mut last)?;
        if families.is_empty() {
            return Some((Vec::new(), last));
        }
        let share = (floor * floor + (size * size - floor * floor) / families.len() as f64).sqrt();
        let mut alone = Vec::new();
        for i in 0..families.len() {
            let one = &families[i..=i];
            let bounds = one[0].2.bounds;
            last = None;
            alone.push(find(bounds, 0.02 * bounds.1, (share, floor), |e| self.error(one, &[e], &mut last))?);
        }
        if families.len() == 1 {
            return Some((alone, last));
        }
        let scaled = |c: f64| -> Vec<f64> {
            alone.iter().zip(families).map(|(e, family)| (c * e).min(family.2.bounds.1)).collect()
        };
        last = None;
        let factor = find((0.2, 5.0), 1.0, (size, floor), |c| self.error(families, &scaled(c), &mut last))?;
        Some((scaled(factor), last))
    }

    /// Returns the data files and the noise in them.
    pub fn record(&self, families: &Choice<'_>, strengths: &[f64]) -> Option<Recorded> {
        self.record_of(|e| self.clean(e, families, strengths))
    }

    /// Returns the data files and the noise in them, from the outputs of ideal sensors in each experiment.
    pub fn record_of(&self, clean: impl Fn(usize) -> Option<Series>) -> Option<Recorded> {
        let (mut files, mut floors) = (Vec::new(), Vec::new());
        for (e, (name, _)) in self.experiments.iter().enumerate() {
            let clean = clean(e)?;
            let measured = self.measured(e, &clean);
            // An effect may drive another experiment far away: such an experiment would not be realistic.
            let base = base_outputs(self.plant, &self.p, &self.setups[e].start, &self.setups[e], 4)?;
            let span = |y: &[f64]| y.iter().fold(0.0_f64, |m, v| m.max((v - y[0]).abs()));
            if measured.iter().zip(&base).any(|(y, b)| span(y) > 20.0 * span(b)) {
                return None;
            }
            let squares = measured.iter().zip(&clean).zip(&self.total);
            let squares = squares.flat_map(|((m, y), s)| m.iter().zip(y).map(move |(m, y)| math::powi((m - y) / s, 2)));
            let count = self.setups[e].samples * clean.len();
            floors.push(((*name).to_owned(), (squares.sum::<f64>() / count as f64).sqrt()));
            files.push((format!("{name}.csv"), self.csv(e, &measured)));
        }
        Some(Recorded { files, floors })
    }

    fn csv(&self, e: usize, measured: &Series) -> String {
        let (plant, setup) = (self.plant, &self.setups[e]);
        let header = plant.inputs.iter().map(|(name, _)| (*name).to_owned());
        let measures = plant.outputs.iter().map(|output| format!("{}_m", plant.states[output.state].0));
        let columns: Vec<String> = ["t".to_owned()].into_iter().chain(header).chain(measures).collect();
        let mut s = columns.join(",") + "\n";
        let digits: Vec<usize> = self.white.iter().map(|s| (3.0 - math::log10(*s)).ceil().max(0.0) as usize).collect();
        for k in 0..setup.samples {
            let t = (k as f64 * setup.dt * 1e9).round() / 1e9;
            write!(s, "{t}").expect("writing to a string cannot fail");
            for u in &setup.inputs {
                write!(s, ",{:.6}", u[k]).expect("writing to a string cannot fail");
            }
            for (y, digits) in measured.iter().zip(&digits) {
                write!(s, ",{:.*}", *digits, y[k]).expect("writing to a string cannot fail");
            }
            s.push('\n');
        }
        s
    }
}

/// Rounds to three digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().expect("a formatted number is valid")
}
