//! Problems with a front: `zdt`, `dtlz`, `wfg` and `constrained-fronts`. Hypervolumes follow from closed forms or from
//! a front of many points.

mod constrained;
mod definition;
mod dtlz;
mod wfg;
mod zdt;

pub(crate) use constrained::SUITE as CONSTRAINED;
pub(crate) use dtlz::SUITE as DTLZ;
pub(crate) use wfg::SUITE as WFG;
pub(crate) use zdt::SUITE as ZDT;

#[cfg(test)]
mod tests {
    use mops_core::front::hypervolume;
    use mops_math as math;
    use rand::Rng;

    use crate::{Answer, Problem, Suite};

    #[test]
    fn no_point_of_a_front_dominates_another_and_all_lie_within_the_reference() {
        for Suite { problems, .. } in [super::ZDT, super::DTLZ, super::WFG, super::CONSTRAINED] {
            for problem in problems() {
                let Answer::Front { reference, points, hypervolume: known } = &problem.answer else { panic!() };
                let front = points(200);
                assert!(front.len() >= 100, "{}: {}", problem.name, front.len());
                assert_eq!(super::definition::best_of(&front).len(), front.len(), "{}", problem.name);
                assert!(front.iter().all(|f| f.iter().zip(reference).all(|(f, r)| f <= r)), "{}", problem.name);
                let sampled = hypervolume(&front.concat(), reference);
                assert!(
                    sampled <= known * (1.0 + 1e-9) && sampled > 0.9 * known,
                    "{}: {sampled} {known}",
                    problem.name
                );
            }
        }
    }

    /// Returns the outputs that a random descent passes on its way to the front: changes of single variables, large and
    /// small ones, that lower the weighted maximum of the objectives above their smallest values on the front.
    fn descent(problem: &Problem, front: &[Vec<f64>], weights: &[f64], random: &mut impl Rng) -> Vec<Vec<f64>> {
        let m = weights.len();
        let least: Vec<f64> = (0..m).map(|i| front.iter().map(|f| f[i]).fold(f64::INFINITY, f64::min)).collect();
        let worst = |y: &[f64]| (0..m).map(|i| weights[i] * (y[i] - least[i])).fold(f64::NEG_INFINITY, f64::max);
        let violation = |y: &[f64]| y[m..].iter().map(|c| c.max(0.0)).sum::<f64>();
        let is_better = |y: &[f64], than: &[f64]| {
            let [new, old] = [violation(y), violation(than)];
            new < old || (new == old && worst(y) <= worst(than))
        };
        let mut x: Vec<f64> = problem.bounds.iter().map(|[l, h]| l + (h - l) * random.random::<f64>()).collect();
        let mut passed = vec![problem.functions.values(&x)];
        for _ in 0..STEPS {
            let k = random.random_range(0..x.len());
            let [low, high] = problem.bounds[k];
            let step = math::powf(10.0, -5.0 * random.random::<f64>()) * (high - low);
            let mut next = x.clone();
            next[k] = (x[k] + step * (2.0 * random.random::<f64>() - 1.0)).clamp(low, high);
            let y = problem.functions.values(&next);
            if is_better(&y, &passed[passed.len() - 1]) {
                passed.push(y);
                x = next;
            }
        }
        passed.retain(|y| violation(y) == 0.0);
        passed
    }

    /// Number of steps of a descent.
    const STEPS: usize = 30_000;

    /// Distance from the front, relative to the range of each objective on it, within which descents end: 0.02 for most
    /// problems, 0.083 for those with one variable for several terms.
    const NEAR: f64 = 0.1;

    /// Distance for WFG1, whose objectives change with the power 0.02 of its variables.
    const NEAR_OF_WFG1: f64 = 0.25;

    /// Distance by which a point may lie beyond those of a disconnected front, whose ends are between two points.
    const BETWEEN: f64 = 1e-3;

    #[test]
    fn descents_reach_the_front_and_never_pass_it() {
        let mut random = mops_math::stream(1, "fronts");
        for Suite { problems, .. } in [super::ZDT, super::DTLZ, super::WFG, super::CONSTRAINED] {
            for problem in problems() {
                let Answer::Front { points, .. } = &problem.answer else { panic!() };
                let m = points(2)[0].len();
                // A front of three objectives has about the square of this number of points.
                let front = points(if m == 2 { 2000 } else { 60 });
                let ranges: Vec<f64> = (0..m)
                    .map(|i| {
                        let values = || front.iter().map(|f| f[i]);
                        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
                    })
                    .collect();
                let mut nearest = f64::INFINITY;
                for _ in 0..3 {
                    let weights: Vec<f64> = (0..m).map(|i| (0.2 + random.random::<f64>()) / ranges[i]).collect();
                    let passed = descent(&problem, &front, &weights, &mut random);
                    for y in passed.iter().rev().step_by(10).take(50) {
                        let passes = front.iter().any(|f| (0..m).all(|i| y[i] < f[i] - BETWEEN * ranges[i]));
                        assert!(!passes, "{}: {y:?}", problem.name);
                        let distance = |f: &Vec<f64>| (0..m).map(|i| (y[i] - f[i]) / ranges[i]).fold(0.0, f64::max);
                        nearest = front.iter().map(distance).fold(nearest, f64::min);
                    }
                }
                let near = if problem.name == "WFG1" { NEAR_OF_WFG1 } else { NEAR };
                assert!(nearest < near, "{}: {nearest}", problem.name);
            }
        }
    }
}
