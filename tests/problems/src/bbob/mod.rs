//! `bbob`: 24 noiseless functions, shifted and rotated: separable (1 to 5), moderate (6 to 9), ill-conditioned (10 to
//! 14), multimodal with a global structure (15 to 19) and without (20 to 24).

mod functions;
mod instance;
#[cfg(test)]
mod published;
mod transform;

use mops_language::Scalar;
use mops_math as math;
use mops_math::stream;
use rand::Rng;

use crate::{Formula, Functions, Problem, Suite};
use instance::Matrix;

pub(crate) const SUITE: Suite = Suite {
    name: "bbob",
    about: "the 24 noiseless functions of BBOB in 5 dimensions, five instances each, relative to their minimum",
    source: "N. Hansen, S. Finck, R. Ros, A. Auger, INRIA RR-6829 (2009)",
    accuracy: 1e-8,
    budget: |n| 5000 * n,
    problems: || (1..=24).flat_map(|function| (1..=5).map(move |i| bbob(function, i, 5))).collect(),
};

/// Creates function `function` (1 to 24), instance `instance`, in `n` dimensions (2 to 40), over [-5, 5]^n.
///
/// The initial guess is uniform in [-4, 4]^n. The minimum is 0: the [`offset`] of the original definition would only
/// cost digits.
///
/// # Panics
/// If there is no such function, or fewer than two dimensions.
pub fn bbob(function: u32, instance: u32, n: usize) -> Problem {
    let mut random = stream(u64::from(instance), &format!("bbob {function} {n}"));
    let start: Vec<f64> = (0..n).map(|_| random.random_range(-4.0..4.0)).collect();
    let name = format!("f{function} i{instance} n{n}");
    let formula = Instance::new(function, instance, n);
    Problem { bounds: vec![[-5.0, 5.0]; n], ..Problem::new(&name, &start, 0.0, Functions::with(formula)) }
}

/// Returns the offset of a function in the original definition: its minimum.
pub fn offset(function: u32, instance: u32) -> f64 {
    instance::least_value(seed(function, instance))
}

/// Returns the seed of a function; two functions share the seed of another.
fn seed(function: u32, instance: u32) -> i64 {
    let shared = match function {
        4 => 3,
        18 => 17,
        other => other,
    };
    i64::from(shared) + 10_000 * i64::from(instance)
}

/// Data of an instance.
struct Instance {
    function: u32,
    optimum: Vec<f64>,
    /// Rotations on the side of the function and on the side of the point. A function with a single rotation has
    /// either.
    r: Matrix,
    q: Matrix,
    peaks: Vec<Peak>,
}

/// Peak of Gallagher's functions, in rotated coordinates.
struct Peak {
    height: f64,
    at: Vec<f64>,
    scales: Vec<f64>,
}

impl Instance {
    fn new(function: u32, instance: u32, n: usize) -> Self {
        assert!((1..=24).contains(&function) && n >= 2, "expected a function from 1 to 24 and at least two dimensions");
        let seed = seed(function, instance);
        let q = instance::rotation(n, seed);
        let signs = |size: f64, draws: Vec<f64>, middle: f64| -> Vec<f64> {
            draws.into_iter().map(|u| if u < middle { -size } else { size }).collect()
        };
        let optimum = match function {
            4 => {
                let mut optimum = instance::optimum(n, seed);
                optimum.iter_mut().step_by(2).for_each(|x| *x = x.abs());
                optimum
            }
            12 => instance::optimum(n, seed + 1_000_000),
            20 => signs(0.5 * 4.209_687_463_7, instance::uniform(n, seed), 0.5),
            24 => signs(1.25, instance::normal(n, seed), 0.0),
            _ => instance::optimum(n, seed),
        };
        let peaks = match function {
            21 => peaks(101, &q, seed),
            22 => peaks(21, &q, seed),
            _ => Vec::new(),
        };
        Self { function, optimum, r: instance::rotation(n, seed + 1_000_000), q, peaks }
    }
}

/// Returns the indices that sort random numbers.
fn permutation(count: usize, seed: i64) -> Vec<usize> {
    let draws = instance::uniform(count, seed);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| draws[a].total_cmp(&draws[b]));
    order
}

/// Returns peaks of heights from 1.1 to 9.1 and one of 10, with condition numbers up to 1000, in random order.
#[allow(clippy::cast_precision_loss)]
fn peaks(count: usize, q: &Matrix, seed: i64) -> Vec<Peak> {
    let n = q.len();
    let (width, centre, best_condition) =
        if count == 101 { (10.0, 5.0, 1000.0_f64.sqrt()) } else { (9.8, 4.9, 1000.0) };
    let conditions = permutation(count - 1, seed);
    let draws = instance::uniform(n * count, seed);
    let peak = |i: usize| {
        let last = (count - 2) as f64;
        let condition = if i == 0 { best_condition } else { math::powf(1000.0, conditions[i - 1] as f64 / last) };
        let nearer = if i == 0 { 0.8 } else { 1.0 };
        let at: Vec<f64> = (0..n).map(|k| nearer * (width * draws[i * n + k] - centre)).collect();
        let order = permutation(n, seed + 1000 * i64::try_from(i).expect("few peaks"));
        Peak {
            height: if i == 0 { 10.0 } else { 1.1 + 8.0 * (i - 1) as f64 / last },
            at: transform::rotated(q, &at),
            scales: order.iter().map(|&k| math::powf(condition, transform::share(k, n) - 0.5)).collect(),
        }
    };
    (0..count).map(peak).collect()
}

impl Formula for Instance {
    fn at<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        vec![self.height(x)]
    }
}

#[cfg(test)]
mod tests {
    use super::published::PUBLISHED;
    use super::*;

    #[test]
    fn values_are_those_of_the_reference_implementation() {
        let wrong = PUBLISHED.iter().filter_map(|&(function, instance, x, expected)| {
            let value = bbob(function, instance, x.len()).functions.values(x)[0] + offset(function, instance);
            let error = (value - expected).abs() / expected.abs().max(1.0);
            (error > 1e-11).then(|| format!("f{function} i{instance}: {value} {expected}"))
        });
        assert_eq!(wrong.collect::<Vec<_>>(), Vec::<String>::new());
    }

    #[test]
    fn the_least_value_is_zero_where_the_optimum_is_known() {
        for function in (1..=18).filter(|f| ![5, 8, 9].contains(f)).chain([20, 23, 24]) {
            let instance = Instance::new(function, 1, 5);
            let value = instance.height(&instance.optimum);
            assert!(value.abs() < 1e-10, "f{function}: {value}");
        }
    }

    #[test]
    fn slopes_agree_with_differences_where_the_function_is_smooth() {
        for function in [1, 2, 3, 6, 8, 9, 10, 12, 15, 17, 20, 21, 22, 24] {
            let problem = bbob(function, 2, 3);
            let slopes = &problem.functions.slopes(&problem.start)[0];
            for j in 0..3 {
                let at = |h: f64| {
                    let mut x = problem.start.clone();
                    x[j] += h;
                    problem.functions.values(&x)[0]
                };
                let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                let scale = slopes[j].abs().max(1e-3 * at(0.0).abs()).max(1.0);
                assert!((slopes[j] - difference).abs() < 1e-4 * scale, "f{function}: {} {difference}", slopes[j]);
            }
        }
    }
}
