//! Initial guess of a run that reuses the points of another run.

use mops_core::{Merit, Problem};

use super::bytes;
use super::database::Points;

/// Returns the best stored point under the demands of the problem, as a point of the unit box. Points outside the
/// bounds, or with other values of inactive tuners, are excluded.
pub(super) fn best(points: &Points, problem: &Problem) -> Option<Vec<f64>> {
    let mut best: Option<(Merit, &Vec<u64>, Vec<f64>)> = None;
    for (key, known) in points {
        if key.len() != problem.study().tuners().len() {
            continue;
        }
        let tuners: Vec<f64> = key.iter().map(|&bits| f64::from_bits(bits)).collect();
        let Some(found) = problem.known(&tuners, known).filter(|found| found.scaled.is_some()) else { continue };
        // Ties are decided by the key, so that the order of the map does not matter.
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

/// Returns the position of a tuner value in the unit interval, exact to the bit: the position that maps to this very
/// value, if one exists.
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
