//! From a plant, what is missing, a size and a seed to a trial.

use std::fmt::Write;

use crate::draw::Draw;
use crate::effects::{Effect, Family, Scene, effects};
use crate::fit::{Series, fit};
use crate::law::{Installed, Spot};
use crate::outside::outside;
use crate::plant::{Place, Plant, Setup};
use crate::plants::plants;
use crate::simulate::{base_outputs, outputs};
use crate::strength::find;
use crate::study::{self, Declared, TASK};
use crate::trial::{Trial, TrueEffect, Truth};

/// Sizes of a benchmark: errors of the refitted base model in units of the noise.
pub const SIZES: [f64; 4] = [20.0, 5.0, 2.0, 1.3];

/// Relative difference from the wanted size that is accepted.
const CLOSE: f64 = 0.05;

/// Parameters and start values where a fit ended.
type Fitted = Option<(Vec<f64>, Vec<f64>)>;

/// Names and roles of the experiments.
const EXPERIMENTS: [(&str, &str); 3] =
    [("calibration", "calibration"), ("validation_1", "selection"), ("validation_2", "selection")];

/// What the base model lacks.
#[derive(Debug, Clone, Copy)]
pub enum Missing<'a> {
    /// Nothing.
    Nothing,
    /// One or two effects by name, each at a place where it fits: `coulomb-friction`, or `coulomb-friction@joint:q`.
    Effects(&'a [&'a str]),
    /// Something that no catalogue has, by name.
    Outside(&'a str),
}

/// A trial; `None` where the plant or the effect is not known, the effect does not fit the plant, or the size cannot be
/// reached with a strength that makes sense. Nothing missing has no size.
pub fn generate(plant: &str, missing: Missing<'_>, size: f64, seed: u64) -> Option<Trial> {
    let plant = plants().iter().copied().find(|p| p.name == plant)?;
    let label = match missing {
        Missing::Nothing => "none".to_owned(),
        Missing::Effects(names) => names.join("+"),
        Missing::Outside(name) => format!("outside-{name}"),
    };
    let label = format!("{}-{}", plant.name, label.replace(['@', ':'], "-"));
    let bench = Bench::draw(plant, seed, &label)?;
    let wanted: Vec<(&Effect, Spot)> = match missing {
        Missing::Nothing => Vec::new(),
        Missing::Effects(names) => names.iter().map(|name| bench.choose(&effects(), name)).collect::<Option<_>>()?,
        Missing::Outside(name) => vec![bench.choose(&outside(), name)?],
    };
    if let [(a, at), (b, there)] = wanted[..]
        && (a.name, at) == (b.name, there)
    {
        return None;
    }
    let families = wanted.iter().enumerate().map(|(i, &(effect, spot))| {
        let draw = Draw::new(seed, &format!("{label} shape {i}"));
        let scene = Scene::new(plant, &bench.p, &bench.setups[0], spot, draw)?;
        Some((effect, spot, (effect.build)(&scene)?))
    });
    let families: Vec<(&Effect, Spot, Family)> = families.collect::<Option<_>>()?;
    let (strengths, mut last) = bench.strengths(&families, size)?;
    let (files, noise_floor) = bench.files(&families, &strengths)?;
    // A fit may have ended in a valley of its own: the better of two counts.
    let warm = bench.error(&families, &strengths, &mut last)?;
    let reached = bench.error(&families, &strengths, &mut None).map_or(warm, |cold| cold.min(warm));
    if !families.is_empty() && (reached / size - 1.0).abs() > CLOSE {
        return None;
    }
    let true_effects: Vec<TrueEffect> = families
        .iter()
        .zip(&strengths)
        .map(|((effect, spot, family), e)| TrueEffect {
            class: if matches!(missing, Missing::Outside(_)) { "unknown".into() } else { effect.name.into() },
            formula: effect.name.to_owned(),
            place: place(plant, *spot),
            accepted_places: accepted(plant, effect.name, *spot),
            strengths: (family.make)(*e).1.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
        })
        .collect();
    let verdict = match missing {
        Missing::Nothing => "none",
        Missing::Effects(_) => "effect",
        Missing::Outside(_) => "unexplained",
    };
    let name = if families.is_empty() { format!("{label}-{seed}") } else { format!("{label}-{size}-{seed}") };
    let declared =
        Declared { name: &name, task: TASK, tuners: &bench.guesses, noise: &bench.total, experiments: &EXPERIMENTS };
    Some(Trial {
        study: study::text(plant, &declared),
        plant: plant.name.to_owned(),
        files,
        truth: Truth {
            equivalents: equivalents(plant, &true_effects),
            effects: true_effects,
            verdict,
            size: reached,
            noise_floor,
            base_parameters: plant.parameters.iter().zip(&bench.p).map(|(p, v)| (p.name.to_owned(), *v)).collect(),
        },
        name,
    })
}

/// A plant with drawn parameters, experiments and noise.
struct Bench {
    plant: &'static Plant,
    seed: u64,
    label: String,
    p: Vec<f64>,
    guesses: Vec<(f64, f64, f64)>,
    setups: Vec<Setup>,
    /// Standard deviation of the white noise, by output.
    white: Vec<f64>,
    /// The same with quantisation.
    total: Vec<f64>,
    /// White noise, by experiment, output and sample.
    noise: Vec<Series>,
}

impl Bench {
    fn draw(plant: &'static Plant, seed: u64, label: &str) -> Option<Self> {
        let draw = |what: &str| Draw::new(seed, &format!("{label} {what}"));
        let mut numbers = draw("parameters");
        let p: Vec<f64> = plant.parameters.iter().map(|p| p.nominal * numbers.between(-0.3, 0.3).exp()).collect();
        // Guesses are 20 to 60 % off, either way; bounds are a factor of 10 to 40 away from them.
        let mut off = draw("guesses");
        let guesses = p.iter().map(|p| {
            let guess = rounded(p * (1.0 + off.sign() * off.between(0.2, 0.6)));
            (guess, rounded(guess / off.log_between(10.0, 40.0)), rounded(guess * off.log_between(10.0, 40.0)))
        });
        let guesses = guesses.collect();
        let setups: Vec<Setup> =
            (0..EXPERIMENTS.len()).map(|e| (plant.setup)(&mut draw(&format!("experiment {e}")), e)).collect();
        let mut sizes = draw("noise sizes");
        let white: Vec<f64> = plant.outputs.iter().map(|o| o.noise * sizes.between(-0.5, 0.5).exp()).collect();
        let total = plant.outputs.iter().zip(&white).map(|(o, s)| (s * s + o.lsb * o.lsb / 12.0).sqrt()).collect();
        let noise = setups.iter().enumerate().map(|(e, setup)| {
            let mut normal = draw(&format!("noise {e}"));
            white.iter().map(|s| (0..setup.samples).map(|_| s * normal.normal()).collect()).collect()
        });
        let noise = noise.collect();
        Some(Self { plant, seed, label: label.to_owned(), p, guesses, setups, white, total, noise })
    }

    /// An effect by name, at a place where it fits.
    fn choose(&self, among: &[&'static Effect], name: &str) -> Option<(&'static Effect, Spot)> {
        let (name, at) = name.split_once('@').map_or((name, None), |(name, at)| (name, Some(at)));
        let fitting = among.iter().filter(|effect| effect.name == name);
        let choices = fitting.flat_map(|effect| (effect.fits)(self.plant).into_iter().map(move |spot| (*effect, spot)));
        let choices: Vec<_> = choices.filter(|(_, spot)| at.is_none_or(|at| at == place(self.plant, *spot))).collect();
        let mut draw = Draw::new(self.seed, &format!("{} place {name}", self.label));
        (!choices.is_empty()).then(|| choices[draw.below(choices.len())])
    }

    fn clean(&self, e: usize, families: &[(&Effect, Spot, Family)], strengths: &[f64]) -> Option<Series> {
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

    /// What the sensors show.
    fn measured(&self, e: usize, clean: &Series) -> Series {
        let show = |o: usize, y: f64| {
            let lsb = self.plant.outputs[o].lsb;
            if lsb > 0.0 { (y / lsb).round() * lsb } else { y }
        };
        let noisy = clean.iter().zip(&self.noise[e]).enumerate();
        noisy.map(|(o, (y, n))| y.iter().zip(n).map(|(y, n)| show(o, y + n)).collect()).collect()
    }

    /// Error of the base model refitted to the calibration experiment. Begins where the last fit ended, or at the truth.
    fn error(&self, families: &[(&Effect, Spot, Family)], strengths: &[f64], last: &mut Fitted) -> Option<f64> {
        let measured = self.measured(0, &self.clean(0, families, strengths)?);
        let setup = &self.setups[0];
        let refit = |from: (&[f64], &[f64])| fit(self.plant, setup, &measured, &self.total, from);
        let mut best = last.as_ref().and_then(|(p, x)| refit((p, x)));
        if best.is_none() {
            best = refit((&self.p, &setup.start));
        }
        let best = best?;
        *last = Some((best.parameters, best.start));
        Some(best.error)
    }

    /// Strengths at which the size is reached, and where the last fit ended; with two effects each alone has an equal share.
    fn strengths(&self, families: &[(&Effect, Spot, Family)], size: f64) -> Option<(Vec<f64>, Fitted)> {
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

    /// The data files, and how large the noise in them is.
    #[expect(clippy::type_complexity, reason = "two lists by experiment")]
    fn files(
        &self,
        families: &[(&Effect, Spot, Family)],
        strengths: &[f64],
    ) -> Option<(Vec<(String, String)>, Vec<(String, f64)>)> {
        let (mut files, mut floors) = (Vec::new(), Vec::new());
        for (e, (name, _)) in EXPERIMENTS.iter().enumerate() {
            let clean = self.clean(e, families, strengths)?;
            let measured = self.measured(e, &clean);
            // An effect may throw another experiment far off: that would be no experiment.
            let base = base_outputs(self.plant, &self.p, &self.setups[e].start, &self.setups[e], 4)?;
            let span = |y: &[f64]| y.iter().fold(0.0_f64, |m, v| m.max((v - y[0]).abs()));
            if measured.iter().zip(&base).any(|(y, b)| span(y) > 20.0 * span(b)) {
                return None;
            }
            let squares = measured.iter().zip(&clean).zip(&self.total);
            let squares = squares.flat_map(|((m, y), s)| m.iter().zip(y).map(move |(m, y)| ((m - y) / s).powi(2)));
            let count = self.setups[e].samples * clean.len();
            floors.push(((*name).to_owned(), (squares.sum::<f64>() / count as f64).sqrt()));
            files.push((format!("{name}.csv"), self.csv(e, &measured)));
        }
        Some((files, floors))
    }

    fn csv(&self, e: usize, measured: &Series) -> String {
        let (plant, setup) = (self.plant, &self.setups[e]);
        let header = plant.inputs.iter().map(|(name, _)| (*name).to_owned());
        let measures = plant.outputs.iter().map(|output| format!("{}_m", plant.states[output.state].0));
        let columns: Vec<String> = ["t".to_owned()].into_iter().chain(header).chain(measures).collect();
        let mut s = columns.join(",") + "\n";
        let digits: Vec<usize> = self.white.iter().map(|s| (3.0 - s.log10()).ceil().max(0.0) as usize).collect();
        for k in 0..setup.samples {
            let t = (k as f64 * setup.dt * 1e9).round() / 1e9;
            write!(s, "{t}").expect("a string takes everything");
            for u in &setup.inputs {
                write!(s, ",{:.6}", u[k]).expect("a string takes everything");
            }
            for (y, digits) in measured.iter().zip(&digits) {
                write!(s, ",{:.*}", *digits, y[k]).expect("a string takes everything");
            }
            s.push('\n');
        }
        s
    }
}

/// Three digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().expect("it was just written")
}

/// The place, as results spell it.
fn place(plant: &Plant, spot: Spot) -> String {
    match spot {
        Spot::Place(j) => {
            let kind = if matches!(plant.places[j], Place::Joint { .. }) { "joint" } else { "process" };
            format!("{kind}:{}", plant.states[plant.places[j].state()].0)
        }
        Spot::Actuator(i) => format!("actuator:{}", plant.inputs[i].0),
        Spot::Sensor(o) => format!("sensor:{}", plant.states[plant.outputs[o].state].0),
    }
}

/// Places that are right answers: the equation under any of its names, and both sides of a coupling.
fn accepted(plant: &Plant, effect: &str, spot: Spot) -> Vec<String> {
    let equation = |j: usize| {
        let name = plant.states[plant.places[j].state()].0;
        ["process", "joint", "extra_state"].map(|kind| format!("{kind}:{name}"))
    };
    match spot {
        Spot::Place(j) if effect == "backlash" && plant.traits.coupling.is_some() => {
            [equation(j), equation(1 - j)].concat()
        }
        Spot::Place(j) => equation(j).to_vec(),
        Spot::Actuator(i) => ["actuator", "extra_state"].map(|kind| format!("{kind}:{}", plant.inputs[i].0)).to_vec(),
        Spot::Sensor(_) => vec![place(plant, spot)],
    }
}

/// What is the same up to parameters and start values of the base model, by its equations.
fn equivalents(plant: &Plant, effects: &[TrueEffect]) -> Vec<(String, String)> {
    let [effect] = effects else { return Vec::new() };
    let groups: &[&[(&str, &str)]] = match plant.name {
        // A shift of x is a force k x, and a force is a shift of the command.
        "spring" => &[&[("sensor-bias", "sensor:x"), ("constant-force", "joint:x"), ("input-bias", "actuator:u")]],
        "torsion" => &[&[("sensor-bias", "sensor:q"), ("constant-force", "joint:q")]],
        "axis" => &[&[("constant-force", "joint:x"), ("input-bias", "actuator:u")]],
        "servo" => &[&[("constant-force", "joint:q"), ("input-bias", "actuator:i")]],
        "drive" => &[&[("constant-force", "joint:q1"), ("input-bias", "actuator:u")]],
        "crane" => &[&[("constant-force", "joint:x"), ("input-bias", "actuator:u")]],
        "furuta-driven" => &[&[("constant-force", "joint:ph"), ("input-bias", "actuator:u")]],
        "tanks" => &[&[("constant-force", "process:h1"), ("input-bias", "actuator:u")]],
        "room" => &[&[
            ("constant-heat-gain", "process:T"),
            ("input-bias", "actuator:P"),
            ("input-bias", "actuator:To"),
            ("sensor-bias", "sensor:T"),
        ]],
        "jacket" => &[
            &[("constant-heat-gain", "process:Tj"), ("input-bias", "actuator:P")],
            &[("constant-heat-gain", "process:T"), ("input-bias", "actuator:Ti")],
        ],
        "circuit" => &[&[("constant-force", "process:V1"), ("input-bias", "actuator:u")]],
        _ => &[],
    };
    let same = |(class, place): &(&str, &str)| *class == effect.class && *place == effect.place;
    let group = groups.iter().find(|group| group.iter().any(same));
    let others = group.into_iter().flat_map(|group| group.iter()).filter(|pair| !same(pair));
    others.map(|(class, place)| ((*class).to_owned(), (*place).to_owned())).collect()
}
