//! Generation of trials with a model error in the background.
//!
//! The records have the roles calibration, selection and validation. The effect sets the scale: the background deviates
//! the outputs by 5 to 20 % of what the effect does, and the white noise is 10 to 300 times smaller than the
//! background. Without a background the noise is 10 to 100 times smaller than the effect. All deviations are root mean
//! squares over the calibration record, before any fit.

use mops_math as math;

use crate::background::{Background, Class};
use crate::bench::Bench;
use crate::draw::Draw;
use crate::effects::{Effect, Family, Scene, effects};
use crate::fit::Series;
use crate::law::{Installed, Spot};
use crate::places::{accepted, equivalents, place};
use crate::plants::{disturbed_plants, further_plants};
use crate::simulate::{base_outputs, outputs};
use crate::study::{self, Declared, TASK};
use crate::trial::{Disturbance, Trial, TrueEffect, Truth};

/// Names and roles of the experiments.
const EXPERIMENTS: [(&str, &str); 3] =
    [("calibration", "calibration"), ("selection", "selection"), ("validation", "validation")];

/// Accepted relative deviation from the requested size of the background.
const CLOSE: f64 = 0.1;

/// Effects and model errors of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Setting {
    /// A: nothing is missing, white noise.
    Exact,
    /// B: nothing is missing, a random background.
    Background,
    /// C: one effect, white noise.
    Effect,
    /// D: one effect and a random background.
    EffectAndBackground,
    /// S: nothing else is missing, a background that is the same function of the state in all experiments.
    RepeatingBackground,
}

impl Setting {
    /// All settings.
    pub const ALL: [Self; 5] =
        [Self::Exact, Self::Background, Self::Effect, Self::EffectAndBackground, Self::RepeatingBackground];

    /// Returns the letter of the setting: A, B, C, D or S.
    pub fn letter(self) -> &'static str {
        match self {
            Self::Exact => "A",
            Self::Background => "B",
            Self::Effect => "C",
            Self::EffectAndBackground => "D",
            Self::RepeatingBackground => "S",
        }
    }

    /// Returns true if an effect is missing.
    pub fn lacks_effect(self) -> bool {
        matches!(self, Self::Effect | Self::EffectAndBackground)
    }

    fn class(self) -> Option<Class> {
        match self {
            Self::Exact | Self::Effect => None,
            Self::Background | Self::EffectAndBackground => Some(Class::Random),
            Self::RepeatingBackground => Some(Class::Repeating),
        }
    }
}

/// Effect of a plant with its nominal magnitude.
#[derive(Debug, Clone, Copy)]
pub struct Nominal {
    /// Name of the plant.
    pub plant: &'static str,
    /// Effect and its place, such as `coulomb-friction@joint:q`.
    pub effect: &'static str,
    /// Magnitude, in the unit of the effect's free magnitude.
    size: f64,
    /// Relative frequency.
    pub weight: usize,
}

/// Effects of the plants. Magnitudes are drawn between 0.6 and 1.5 of the nominal ones.
pub const NOMINAL: &[Nominal] = &{
    const fn of(plant: &'static str, effect: &'static str, size: f64, weight: usize) -> Nominal {
        Nominal { plant, effect, size, weight }
    }
    [
        of("driven-pendulum", "coulomb-friction@joint:q", 1.0, 2),
        of("driven-pendulum", "quadratic-drag@joint:q", 0.15, 2),
        of("driven-pendulum", "cubic-stiffness@joint:q", 3.0, 2),
        of("driven-pendulum", "constant-force@joint:q", 1.0, 2),
        of("driven-pendulum", "input-asymmetry@actuator:u", 0.2, 2),
        of("driven-pendulum", "actuator-lag@actuator:u", 0.05, 2),
        of("driven-pendulum", "input-saturation@actuator:u", 0.3, 2),
        of("driven-pendulum", "input-delay@actuator:u", 0.05, 2),
        of("driven-pendulum", "sensor-drift@sensor:q", 0.01, 1),
        of("driven-pendulum", "cogging@joint:q", 1.0, 1),
        of("driven-pendulum", "periodic-disturbance@joint:q", 1.0, 1),
        of("driven-pendulum", "wind-gust@joint:q", 3.0, 1),
        of("two-masses", "coulomb-friction@joint:q1", 4.0, 2),
        of("two-masses", "coulomb-friction@joint:q2", 5.0, 2),
        of("two-masses", "backlash@joint:q1", 0.01, 2),
        of("two-masses", "quadratic-drag@joint:q2", 1.2, 2),
        of("two-masses", "constant-force@joint:q2", 3.0, 2),
        of("two-masses", "actuator-lag@actuator:u", 0.015, 2),
        of("two-masses", "input-saturation@actuator:u", 0.3, 2),
        of("two-masses", "input-delay@actuator:u", 0.012, 2),
        of("two-masses", "sensor-drift@sensor:q1", 0.02, 1),
        of("two-masses", "cogging@joint:q1", 5.0, 1),
        of("two-masses", "periodic-disturbance@joint:q2", 6.0, 1),
        of("two-masses", "wind-gust@joint:q2", 15.0, 1),
        of("cascade", "overflow@process:h1", 25.0, 2),
        of("cascade", "linear-loss@process:h2", 0.6, 2),
        of("cascade", "leak@process:h2", 2.0, 2),
        of("cascade", "input-quadratic@actuator:u", 0.2, 2),
        of("cascade", "constant-force@process:h2", 3.0, 2),
        of("cascade", "actuator-lag@actuator:u", 15.0, 2),
        of("cascade", "input-saturation@actuator:u", 0.2, 2),
        of("cascade", "input-delay@actuator:u", 12.0, 2),
        of("cascade", "sensor-drift@sensor:h2", 0.0006, 1),
        of("cascade", "periodic-disturbance@process:h2", 3.0, 1),
        of("cascade", "wind-gust@process:h2", 7.0, 1),
        of("sampled-drive", "coulomb-friction@joint:q", 1.0, 1),
        of("sled", "coulomb-friction@joint:x", 20.0, 2),
        of("sled", "quadratic-drag@joint:x", 40.0, 2),
        of("sled", "constant-force@joint:x", 15.0, 2),
        of("sled", "cubic-stiffness@joint:x", 200.0, 1),
        of("sled", "actuator-lag@actuator:u", 0.03, 2),
        of("sled", "input-delay@actuator:u", 0.02, 2),
        of("sled", "input-saturation@actuator:u", 0.3, 1),
        of("drop", "quadratic-drag@joint:y", 0.02, 2),
        of("drop", "coulomb-friction@joint:y", 1.0, 1),
        of("drop", "constant-force@joint:y", 1.0, 1),
    ]
};

/// Generates a trial of a plant. `effect` is missing or, in a setting without an effect, sets the scale only.
///
/// Returns `None` if the plant does not have the effect in [`NOMINAL`], if the plant diverges, or if the background
/// does not reach its size with a plausible amplitude.
pub fn disturbed(setting: Setting, plant: &str, effect: &str, seed: u64) -> Option<Trial> {
    let nominal = NOMINAL.iter().find(|nominal| nominal.plant == plant && nominal.effect == effect)?;
    let mut plants = disturbed_plants().iter().chain(further_plants()).copied();
    let plant = plants.find(|p| p.name == plant)?;
    let named = if setting.lacks_effect() { nominal.effect } else { "none" };
    let label = format!("{}-{}-{}", setting.letter(), plant.name, named.replace(['@', ':'], "-"));
    let mut bench = Bench::draw(plant, seed, &label)?;
    bench.experiments = EXPERIMENTS;
    let draw = |what: &str| Draw::new(seed, &format!("{label} {what}"));

    let (chosen, spot) = bench.choose(&effects(), nominal.effect)?;
    let family = {
        let scene = Scene::new(plant, &bench.p, &bench.setups[0], spot, draw("shape 0"))?;
        (chosen.build)(&scene)?
    };
    let magnitude = (nominal.size * draw("magnitude").between(0.6, 1.5)).min(family.bounds.1);
    let case = Case { bench: &bench, effect: (chosen, spot, family), magnitude };
    let plain = [0, 1, 2].map(|e| case.clean(e, false, Vec::new()));
    let [Some(plain), Some(_), Some(_)] = &plain else { return None };
    let of_effect = deviation(&bench, &case.clean(0, true, Vec::new())?, plain)?;

    let mut sizes = draw("sizes");
    let share = sizes.between(0.05, 0.2);
    let (background, amplitude, disturbance, noise) = if let Some(class) = setting.class() {
        let background = Background::draw(&bench, class, &mut draw("background"))?;
        let (amplitude, reached) = case.amplitude(setting, &background, share * of_effect)?;
        let ratio = sizes.log_between(10.0, 300.0);
        let disturbance = Disturbance {
            source: background.source,
            at: background.at.clone(),
            share: reached / of_effect,
            ratio,
            time: background.time,
        };
        (Some(background), amplitude, Some(disturbance), reached / ratio)
    } else {
        (None, 0.0, None, of_effect / sizes.log_between(10.0, 100.0))
    };
    let ideal: Vec<Series> = (0..EXPERIMENTS.len())
        .map(|e| case.with_background(e, setting, background.as_ref(), amplitude))
        .collect::<Option<_>>()?;
    let effect = setting.lacks_effect().then(|| case.truth());
    bench.set_noise(noise);
    let recorded = bench.record_of(|e| Some(ideal[e].clone()))?;
    let mut last = None;
    let size = bench.error_of(&bench.measured(0, &ideal[0]), &mut last)?;

    let effects: Vec<TrueEffect> = effect.into_iter().collect();
    let name = format!("{label}-{seed}");
    let declared = Declared {
        name: &name,
        task: TASK,
        tuners: &bench.guesses,
        noise: &bench.total,
        experiments: &bench.experiments,
    };
    Some(Trial {
        study: study::text(plant, &declared),
        plant: plant.name.to_owned(),
        files: recorded.files,
        truth: Truth {
            equivalents: equivalents(plant, &effects),
            verdict: match (setting.lacks_effect(), &disturbance) {
                (true, _) => "effect",
                (false, None) => "none",
                (false, Some(_)) => "none or unexplained",
            },
            effects,
            size,
            background: disturbance,
            noise_floor: recorded.floors,
            base_parameters: plant.parameters.iter().zip(&bench.p).map(|(p, v)| (p.name.to_owned(), *v)).collect(),
        },
        name,
    })
}

/// Returns the root mean square deviation of outputs, in units of the noise in the definition of the plant; `None` if
/// they are equal.
fn deviation(bench: &Bench, a: &Series, b: &Series) -> Option<f64> {
    let outputs = a.iter().zip(b).zip(bench.plant.outputs);
    let squares =
        outputs.flat_map(|((a, b), output)| a.iter().zip(b).map(move |(a, b)| math::powi((a - b) / output.noise, 2)));
    let mean = squares.sum::<f64>() / (a.len() * a[0].len()) as f64;
    (mean > 0.0 && mean.is_finite()).then(|| mean.sqrt())
}

/// Plant with an effect at a given magnitude.
struct Case<'a> {
    bench: &'a Bench,
    effect: (&'static Effect, Spot, Family),
    magnitude: f64,
}

impl Case<'_> {
    /// Returns the outputs of ideal sensors, with or without the effect.
    fn clean(&self, e: usize, has_effect: bool, mut laws: Vec<Installed>) -> Option<Series> {
        let (bench, (_, spot, family)) = (self.bench, &self.effect);
        if has_effect {
            laws.push(Installed { law: (family.make)(self.magnitude).0, spot: *spot });
        }
        let setup = &bench.setups[e];
        let y = if laws.is_empty() {
            base_outputs(bench.plant, &bench.p, &setup.start, setup, 20)?
        } else {
            outputs(bench.plant, &bench.p, setup, e, &laws)?
        };
        y.iter().flatten().all(|v| v.is_finite()).then_some(y)
    }

    /// Returns the outputs of an experiment without white noise.
    fn with_background(
        &self,
        e: usize,
        setting: Setting,
        background: Option<&Background>,
        amplitude: f64,
    ) -> Option<Series> {
        let laws = background.map(|background| background.laws(e, amplitude)).unwrap_or_default();
        let mut y = self.clean(e, setting.lacks_effect(), laws)?;
        for (o, (y, output)) in y.iter_mut().zip(self.bench.plant.outputs).enumerate() {
            if let Some(noise) = background.and_then(|background| background.noise(e, o)) {
                y.iter_mut().zip(noise).for_each(|(y, n)| *y += amplitude * output.noise * n);
            }
        }
        Some(y)
    }

    /// Returns the amplitude at which the background deviates the outputs by `wanted`, and the deviation reached.
    fn amplitude(&self, setting: Setting, background: &Background, wanted: f64) -> Option<(f64, f64)> {
        let plain = self.with_background(0, setting, None, 0.0)?;
        let mut amplitude = 0.01;
        for _ in 0..8 {
            let y = self.with_background(0, setting, Some(background), amplitude)?;
            let reached = deviation(self.bench, &y, &plain)?;
            if (reached / wanted - 1.0).abs() < 0.02 {
                return Some((amplitude, reached));
            }
            let next = (amplitude * wanted / reached).min(background.most);
            if next == amplitude {
                // The amplitude is at its limit.
                return ((reached / wanted - 1.0).abs() < CLOSE).then_some((amplitude, reached));
            }
            amplitude = next;
        }
        None
    }

    fn truth(&self) -> TrueEffect {
        let (effect, spot, family) = &self.effect;
        TrueEffect {
            class: effect.name.to_owned(),
            formula: effect.name.to_owned(),
            place: place(self.bench.plant, *spot),
            accepted_places: accepted(self.bench.plant, effect.name, *spot),
            strengths: (family.make)(self.magnitude)
                .1
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value))
                .collect(),
        }
    }
}
