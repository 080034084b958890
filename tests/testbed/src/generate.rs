//! Generation of a trial from a plant, the missing effects, a size and a seed.

use crate::bench::{Bench, EXPERIMENTS, Recorded};
use crate::draw::Draw;
use crate::effects::{Effect, Family, Scene, effects};
use crate::law::Spot;
use crate::outside::outside;
use crate::places::{accepted, equivalents, place};
use crate::plants::plants;
use crate::span::{Frame, cosine};
use crate::study::{self, Declared, TASK};
use crate::trial::{Trial, TrueEffect, Truth};

/// Sizes of a benchmark: errors of the refitted baseline model in units of the noise.
pub const SIZES: [f64; 4] = [20.0, 5.0, 2.0, 1.3];

/// Accepted relative deviation from the requested size.
const CLOSE: f64 = 0.05;

/// Cosine similarity, orthogonal to the baseline model's sensitivities, above which the outputs of two effects count as
/// indistinguishable.
const ALIKE: f64 = 0.9;

/// Smallest residual of an effect outside the catalogue after a fit of a few catalogue effects, in units of the noise
/// realisation.
const BEYOND: f64 = 1.12;

/// Missing part of the baseline model.
#[derive(Debug, Clone, Copy)]
pub enum Missing<'a> {
    /// Nothing is missing.
    Nothing,
    /// One or two effects by name, each at a place where it fits: `coulomb-friction`, or `coulomb-friction@joint:q`.
    Effects(&'a [&'a str]),
    /// Effect outside every catalogue, by name.
    Outside(&'a str),
}

/// Generates a trial.
///
/// Returns `None` in these cases:
/// - The plant or the effect is unknown, or the effect does not fit the plant.
/// - The size cannot be reached with a plausible magnitude.
/// - Two effects are indistinguishable.
/// - Effects of the catalogue together approximate an effect outside it.
///
/// The size has no meaning if nothing is missing.
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
    let Recorded { files, floors } = bench.record(&families, &strengths)?;
    // A fit may have ended in a local minimum: the better of two counts.
    let mut cold = None;
    let mut reached = bench.error(&families, &strengths, &mut last)?;
    if let Some(error) = bench.error(&families, &strengths, &mut cold)
        && error < reached
    {
        (reached, last) = (error, cold);
    }
    if !families.is_empty() && (reached / size - 1.0).abs() > CLOSE {
        return None;
    }
    if families.len() == 2 {
        let frame = Frame::new(&bench, &bench.p, &bench.setups[0].start)?;
        let shift = |i: usize| frame.shift((families[i].2.make)(strengths[i]).0, families[i].1);
        if cosine(&shift(0)?, &shift(1)?).abs() > ALIKE {
            return None;
        }
    }
    if let (Missing::Outside(_), Some((p, start))) = (missing, &last) {
        let measured = bench.measured(0, &bench.clean(0, &families, &strengths)?);
        if Frame::new(&bench, p, start)?.left_by_catalogue(&measured) < BEYOND * floors[0].1 {
            return None;
        }
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
            background: None,
            noise_floor: floors,
            base_parameters: plant.parameters.iter().zip(&bench.p).map(|(p, v)| (p.name.to_owned(), *v)).collect(),
        },
        name,
    })
}
