//! Writes simulated cases into a folder.
//!
//! - `generate FOLDER [COUNT] [SEED]` draws a mix.
//! - `generate FOLDER one SEED PLANT EFFECTS SIZE` writes a case named by a benchmark, with the effects joined by `+`.
//! - `generate FOLDER all SEED` writes nothing, and prints the sizes that every effect reaches in every plant.

use std::path::Path;
use std::time::Instant;

use mops_testbed::{Draw, Effect, Missing, SIZES, effects, generate, outside, plants};

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = arguments.first().map(Path::new) else {
        eprintln!("generate FOLDER [COUNT | one | all] [SEED] [PLANT EFFECTS SIZE]");
        return Ok(());
    };
    let seed = arguments.get(2).and_then(|s| s.parse().ok()).unwrap_or(1);
    match arguments.get(1).map(String::as_str) {
        Some("all") => all(seed),
        Some("one") => one(folder, seed, arguments.get(3..).unwrap_or_default()),
        count => mix(folder, count.and_then(|c| c.parse().ok()).unwrap_or(40), seed),
    }
}

/// Draws and writes a mix of cases.
fn mix(folder: &Path, count: usize, seed: u64) -> std::io::Result<()> {
    let mut draw = Draw::new(seed, "mix");
    let (mut written, mut tried) = (0, 0);
    while written < count {
        let plant = plants()[written % plants().len()];
        let fitting = |all: Vec<&'static Effect>| -> Vec<&str> {
            all.into_iter().filter(|effect| !(effect.fits)(plant).is_empty()).map(|effect| effect.name).collect()
        };
        let (effects, outside) = (fitting(effects()), fitting(outside()));
        let size = SIZES[draw.below(SIZES.len())];
        let names = [effects[draw.below(effects.len())], effects[draw.below(effects.len())]];
        let missing = match draw.below(10) {
            0 => Missing::Nothing,
            1 => Missing::Outside(outside[draw.below(outside.len())]),
            2 | 3 => Missing::Effects(&names),
            _ => Missing::Effects(&names[..1]),
        };
        tried += 1;
        if let Some(trial) = generate(plant.name, missing, size, seed * 1_000_000 + tried) {
            trial.write(&folder.join(&trial.name))?;
            println!("{:60} reached {:.3}", trial.name, trial.truth.size);
            written += 1;
        }
    }
    Ok(())
}

/// Writes the case of a seed.
fn one(folder: &Path, seed: u64, of: &[String]) -> std::io::Result<()> {
    let [plant, effects, size] = of else {
        return Err(std::io::Error::other("expected PLANT EFFECTS SIZE after the seed"));
    };
    let names: Vec<&str> = effects.split('+').collect();
    let missing = match names[..] {
        ["none"] => Missing::Nothing,
        [outside] if outside.starts_with("outside-") => Missing::Outside(&outside["outside-".len()..]),
        _ => Missing::Effects(&names),
    };
    let size = size.parse().map_err(std::io::Error::other)?;
    let trial = generate(plant, missing, size, seed)
        .ok_or_else(|| std::io::Error::other("this case cannot be generated: check plant, effects and size"))?;
    trial.write(&folder.join(&trial.name))?;
    println!("{:60} reached {:.3}", trial.name, trial.truth.size);
    Ok(())
}

/// Prints a table of the sizes reached.
fn all(seed: u64) -> std::io::Result<()> {
    for plant in plants() {
        for (effect, beyond) in
            effects().into_iter().map(|e| (e, false)).chain(outside().into_iter().map(|e| (e, true)))
        {
            if (effect.fits)(plant).is_empty() {
                continue;
            }
            let start = Instant::now();
            let reached = SIZES.map(|size| {
                let names = [effect.name];
                let missing = if beyond { Missing::Outside(effect.name) } else { Missing::Effects(&names) };
                generate(plant.name, missing, size, seed)
            });
            let shown =
                reached.iter().map(|trial| trial.as_ref().map_or(" -   ".into(), |t| format!("{:5.2}", t.truth.size)));
            let shown: Vec<String> = shown.collect();
            let place = reached.iter().flatten().next().map_or("-", |t| t.truth.effects[0].place.as_str());
            let seconds = start.elapsed().as_secs_f64() / 4.0;
            println!("{:14} {:28} {:14} {} {seconds:6.3} s", plant.name, effect.name, place, shown.join(" "));
        }
    }
    Ok(())
}
