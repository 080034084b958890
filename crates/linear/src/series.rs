//! Margins of 2,000 random loops, sampled ones with memory in units of its own and continuous ones in dense
//! coordinates, against an independent computation: L in double-double numbers or by its factors, on a dense grid, and
//! the argument principle.
//!
//! The quick tier tries 20 loops, the full tier 200;
//! `MOPS_LOOPS=2000 cargo test -p mops-core --lib series -- --nocapture` all.

mod on_grid;
mod random_loop;

use on_grid::Expected;
use random_loop::{Dense, Sampled};

use super::{Loop, StateSpace};

/// Number of loops, the larger part of them sampled.
const LOOPS: u32 = 2_000;

/// Share of loops without a value that is allowed: 2 of 2,000.
const WITHOUT: u64 = 1_000;

/// Largest condition of the coordinates of continuous loops.
const CONDITION: f64 = 1e3;

/// Distance of L from -1 below which a loop is not compared: rounding of the matrices decides.
const CLOSE: f64 = 1e-3;

/// Largest error of a margin, relative to a value, or absolute below 1.
const ERROR: f64 = 1e-6;

enum Verdict {
    Right,
    /// Too close to the stability limit.
    Skipped,
    Without(String),
    Wrong(String),
}

/// Compares the margins of a system with the expected ones.
fn compare(system: Result<StateSpace, String>, expected: &Expected) -> Verdict {
    if expected.distance < CLOSE {
        return Verdict::Skipped;
    }
    let found = match system.and_then(Loop::new) {
        Ok(found) => found,
        Err(why) => return Verdict::Without(why),
    };
    if found.unstable != Some(expected.unstable as usize) {
        return Verdict::Wrong(format!("{:?} unstable poles, expected {}", found.unstable, expected.unstable));
    }
    let crossover = found.gain_crossovers.last().map_or(0.0, |crossing| crossing.frequency);
    let mut pairs = vec![("crossover", Ok(crossover), expected.crossover)];
    if expected.unstable == 0 {
        pairs.push(("phase", found.phase_margin(), expected.phase));
        pairs.push(("gain", found.gain_margin(false), expected.gain));
        pairs.push(("peak", found.peak_sensitivity(), expected.peak));
    }
    for (name, value, expected) in pairs {
        match value {
            Err(why) => return Verdict::Without(format!("{name}: {why}")),
            // A grid ends where L is small, and a crossing there is none of a finite margin.
            Ok(value) if name == "gain" && value.min(expected) > 60.0 => {}
            Ok(value) if value == expected => {}
            Ok(value) if (value - expected).abs() <= ERROR * (1.0 + expected.abs()) => {}
            Ok(value) => return Verdict::Wrong(format!("{name} {value}, expected {expected}")),
        }
    }
    Verdict::Right
}

#[test]
fn margins_of_random_loops_are_those_of_their_response_on_a_grid() {
    let number = |text: String| text.parse::<u64>().expect("MOPS_LOOPS is a number");
    let count = std::env::var("MOPS_LOOPS").map_or_else(|_| u64::from(mops_tiers::cases(LOOPS / 10)), number);
    let (mut right, mut skipped, mut without, mut wrong) = (0, 0, Vec::new(), Vec::new());
    let first = std::env::var("MOPS_LOOPS_FROM").map_or(0, number);
    for seed in first..first + count {
        let verdict = if seed % 4 == 3 {
            let of = Dense::random(seed, CONDITION);
            let system = of.system();
            let expected = of.expected(&system);
            compare(Ok(system), &expected)
        } else {
            let of = Sampled::random(seed);
            compare(of.system(), &of.expected())
        };
        match verdict {
            Verdict::Right => right += 1,
            Verdict::Skipped => skipped += 1,
            Verdict::Without(why) => without.push(format!("{seed}: {why}")),
            Verdict::Wrong(why) => wrong.push(format!("{seed}: {why}")),
        }
    }
    println!("{count} loops: {right} right, {skipped} at the stability limit");
    println!("{} without a value: {without:#?}", without.len());
    println!("{} wrong: {wrong:#?}", wrong.len());
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(without.len() as u64 <= count / WITHOUT, "{without:#?}");
}
