//! The known point at which a run begins that uses the points of another.

use mops_core::{Merit, Problem};

use super::bytes;
use super::database::Points;

/// The point of the unit box at which the best known point under the demands of the problem lies, of those that the problem
/// can reach: within the bounds, and with its values of the tuners that are kept.
pub(super) fn best(points: &Points, problem: &Problem) -> Option<Vec<f64>> {
    let mut best: Option<(Merit, &Vec<u64>, Vec<f64>)> = None;
    for (key, known) in points {
        if key.len() != problem.study().tuners().len() {
            continue;
        }
        let tuners: Vec<f64> = key.iter().map(|&bits| f64::from_bits(bits)).collect();
        let Some(found) = problem.known(&tuners, known).filter(|found| found.scaled.is_some()) else { continue };
        // Of equals the one with the smaller key, whatever the order of a map.
        let wins = best.as_ref().is_none_or(|(merit, of, _)| {
            found.merit.is_better_than(merit) || (!merit.is_better_than(&found.merit) && key < *of)
        });
        if wins {
            let point: Vec<f64> = problem.active().iter().map(|&i| position(problem, i, tuners[i])).collect();
            if bytes::key(&problem.tuners_at(&point)) == *key {
                best = Some((found.merit, key, point));
            }
        }
    }
    Some(best?.2)
}

/// The place of a tuner's value within its bounds, to the bit: the place from which that very value comes, if there is one.
fn position(problem: &Problem, tuner: usize, value: f64) -> f64 {
    let tuner = &problem.study().tuners()[tuner];
    let near = tuner.position_of(value);
    let (mut up, mut down) = (near, near);
    for _ in 0..64 {
        for place in [up, down] {
            if (0.0..=1.0).contains(&place) && tuner.value_at(place) == value {
                return place;
            }
        }
        (up, down) = (up.next_up(), down.next_down());
    }
    near
}
