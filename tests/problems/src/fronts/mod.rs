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

    use crate::{Answer, Suite};

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
