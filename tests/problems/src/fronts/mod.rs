//! Problems with a front: `zdt`, `dtlz`, `wfg` and `constrained-fronts`. Hypervolumes follow from closed forms or from
//! a front of many points.

mod constrained;
mod dtlz;
mod wfg;
mod zdt;

use mops_core::front::{hypervolume, non_dominated};
use mops_language::Dual7;

use crate::{Answer, Functions, Problem, Sense};

pub(crate) use constrained::SUITE as CONSTRAINED;
pub(crate) use dtlz::SUITE as DTLZ;
pub(crate) use wfg::SUITE as WFG;
pub(crate) use zdt::SUITE as ZDT;

/// Plain generic function, for each kind of number.
type Plain = (fn(&[f64]) -> Vec<f64>, fn(&[Dual7]) -> Vec<Dual7>);

/// Points of a front.
type Points = fn(usize) -> Vec<Vec<f64>>;

/// Creates a problem over its bounds, with the initial guess at their centre.
fn problem(name: &str, bounds: Vec<[f64; 2]>, functions: Plain, front: Answer) -> Problem {
    let start: Vec<f64> = bounds.iter().map(|[low, high]| 0.5 * (low + high)).collect();
    Problem { sense: Sense::Each, bounds, ..Problem::new(name, &start, front, Functions::of(functions.0, functions.1)) }
}

/// Creates a front of known hypervolume.
fn known(reference: &[f64], hypervolume: f64, points: Points) -> Answer {
    Answer::Front { reference: reference.to_vec(), hypervolume, points }
}

/// Creates a front whose hypervolume is that of many of its points.
fn sampled(reference: &[f64], count: usize, points: Points) -> Answer {
    known(reference, hypervolume(&points(count).concat(), reference), points)
}

/// Returns the non-dominated points.
fn best_of(points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let m = points.first().map_or(0, Vec::len);
    non_dominated(&points.concat(), m).into_iter().map(|i| points[i].clone()).collect()
}

/// Returns `count` equidistant numbers from `low` to `high`.
#[allow(clippy::cast_precision_loss)]
fn evenly(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| low + (high - low) * i as f64 / (count.max(2) - 1) as f64)
}

#[cfg(test)]
mod tests {
    use mops_core::front::hypervolume;

    use crate::{Answer, Suite};

    #[test]
    fn no_point_of_a_front_dominates_another_and_all_lie_within_the_reference() {
        for Suite { problems, .. } in [super::ZDT, super::DTLZ, super::WFG, super::CONSTRAINED] {
            for problem in problems() {
                let Answer::Front { reference, points, hypervolume: known } = &problem.answer else { panic!() };
                let front = points(200);
                assert!(front.len() >= 100, "{}: {}", problem.name, front.len());
                assert_eq!(super::best_of(&front).len(), front.len(), "{}", problem.name);
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

    #[test]
    fn sampled_points_of_the_box_do_not_dominate_the_front() {
        use rand::Rng;
        let mut random = mops_math::stream(1, "fronts");
        for Suite { problems, .. } in [super::ZDT, super::DTLZ, super::WFG, super::CONSTRAINED] {
            for problem in problems() {
                let Answer::Front { points, .. } = &problem.answer else { panic!() };
                let front = points(300);
                let m = front[0].len();
                for _ in 0..2000 {
                    let x: Vec<f64> =
                        problem.bounds.iter().map(|[l, h]| l + (h - l) * random.random::<f64>()).collect();
                    let outputs = problem.functions.values(&x);
                    let feasible = outputs[m..].iter().all(|c| *c <= 0.0);
                    let better = front.iter().any(|f| f.iter().zip(&outputs).all(|(f, y)| *y < f - 1e-9));
                    assert!(!feasible || !better, "{}: {outputs:?}", problem.name);
                }
            }
        }
    }
}
