//! `bbob`: 24 noiseless functions, shifted and turned: separable (1 to 5), moderate (6 to 9), ill-conditioned (10 to 14),
//! multimodal with a global structure (15 to 19) and without (20 to 24).

mod functions;
mod instance;
mod transform;

use mops_core::{Scalar, stream};
use rand::Rng;

use crate::{Formula, Functions, Problem, Suite};
use instance::Matrix;

pub(crate) const SUITE: Suite = Suite {
    name: "bbob",
    about: "the 24 noiseless functions of BBOB in 5 dimensions, five instances each, as heights above the least value",
    source: "N. Hansen, S. Finck, R. Ros, A. Auger, INRIA RR-6829 (2009)",
    accuracy: 1e-8,
    problems: || (1..=24).flat_map(|function| (1..=5).map(move |i| bbob(function, i, 5))).collect(),
};

/// Function `function` (1 to 24), instance `instance`, in `n` dimensions (2 to 40), over [-5, 5]^n. The start is uniform in
/// [-4, 4]^n. Its least value is 0: what the original adds to it ([`offset`]) would only cost digits.
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

/// What the original definition adds to a function: its least value.
pub fn offset(function: u32, instance: u32) -> f64 {
    instance::least_value(seed(function, instance))
}

/// Two functions share the seed of another.
fn seed(function: u32, instance: u32) -> i64 {
    let shared = match function {
        4 => 3,
        18 => 17,
        other => other,
    };
    i64::from(shared) + 10_000 * i64::from(instance)
}

/// The data of an instance.
struct Instance {
    function: u32,
    optimum: Vec<f64>,
    /// The rotation next to the function, and the one next to the point. A function with one rotation has either.
    r: Matrix,
    q: Matrix,
    peaks: Vec<Peak>,
}

/// A peak of Gallagher's functions, in turned coordinates.
struct Peak {
    height: f64,
    at: Vec<f64>,
    scales: Vec<f64>,
}

impl Instance {
    fn new(function: u32, instance: u32, n: usize) -> Self {
        assert!((1..=24).contains(&function) && n >= 2, "functions 1 to 24, at least two dimensions");
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

/// Indices that sort random numbers.
fn permutation(count: usize, seed: i64) -> Vec<usize> {
    let draws = instance::uniform(count, seed);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| draws[a].total_cmp(&draws[b]));
    order
}

/// Peaks of heights from 1.1 to 9.1 and one of 10, with conditions up to 1000, in random order.
#[allow(clippy::cast_precision_loss)]
fn peaks(count: usize, q: &Matrix, seed: i64) -> Vec<Peak> {
    let n = q.len();
    let (width, centre, best_condition) =
        if count == 101 { (10.0, 5.0, 1000.0_f64.sqrt()) } else { (9.8, 4.9, 1000.0) };
    let conditions = permutation(count - 1, seed);
    let draws = instance::uniform(n * count, seed);
    let peak = |i: usize| {
        let last = (count - 2) as f64;
        let condition = if i == 0 { best_condition } else { 1000.0_f64.powf(conditions[i - 1] as f64 / last) };
        let nearer = if i == 0 { 0.8 } else { 1.0 };
        let at: Vec<f64> = (0..n).map(|k| nearer * (width * draws[i * n + k] - centre)).collect();
        let order = permutation(n, seed + 1000 * i64::try_from(i).expect("few peaks"));
        Peak {
            height: if i == 0 { 10.0 } else { 1.1 + 8.0 * (i - 1) as f64 / last },
            at: transform::rotated(q, &at),
            scales: order.iter().map(|&k| condition.powf(transform::share(k, n) - 0.5)).collect(),
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
#[allow(clippy::excessive_precision)] // the digits as published
mod tests {
    use super::*;

    /// Values of the reference implementation: function, instance, point, value.
    /// Source: COCO, code-experiments/test/regression-test/data/regression_test_2data_for_suite_bbob.py.
    const PUBLISHED: &[(u32, u32, &[f64], f64)] = &[
        (
            1,
            1,
            &[13.382317228473649, 10.13915864997532, -12.670622241727648, 21.616498180472121, 47.318782398113612],
            3409.8428938036641,
        ),
        (
            2,
            3,
            &[
                0.34260653999354285,
                -0.098678241710591114,
                0.064055335384277629,
                0.17033148399456044,
                -0.00060252627393624146,
                -0.030956819753924333,
                0.11595488850617267,
                0.10352020860549199,
                -0.38291440201788246,
                -0.36997726990845931,
            ],
            15772336.783852827,
        ),
        (
            3,
            5,
            &[-3.935925244121302, 0.69265347381153974, 2.2202776942786882, 0.51633141218739387, 1.9092298603252029],
            901.99087633734507,
        ),
        (
            4,
            1,
            &[
                -0.27274711930265672,
                -1.7323072286189416,
                -0.59051812044358831,
                1.1513995553020884,
                0.039743062782827375,
                1.9399764817648582,
                -1.0691844497400784,
                2.342911487711183,
                1.231824268399095,
                0.89427272062847618,
            ],
            -166.09388640027845,
        ),
        (5, 5, &[0.13575375752784852, -0.18542552177416743, -0.20005936334009852], 35.812595161846545),
        (
            6,
            3,
            &[-13.970673659422706, -1.0206948487510619, 3.6770626809236622, -4.1208665865535909, -1.6407017247730142],
            32263.786884340625,
        ),
        (7, 3, &[-0.15589564659987321, -1.0591918840804744], 1136.0032451796758),
        (9, 4, &[-0.1312288906422803, 0.30606056563875489], -90.099326082029492),
        (
            10,
            4,
            &[
                0.087737128344651791,
                0.070882560261262773,
                -0.26893700171717499,
                -0.16726862231649739,
                0.34037932037835633,
                0.017274513419106848,
                -0.24240584993463521,
                -0.26186461438430941,
                0.071612855995699082,
                0.3181100173496238,
                0.2599025844540751,
                -0.26277327229276892,
                -0.16107254881731989,
                -0.01412235234359435,
                -0.24213936654894913,
                0.0041103053493564811,
                -0.05931152305679771,
                -0.31626793218910831,
                -0.14799614357000671,
                0.057068051841757408,
            ],
            9363065.020960886,
        ),
        (
            11,
            4,
            &[
                -0.5440304062592517,
                -0.66581036479101141,
                -0.19209640780203416,
                0.57562982055464307,
                -0.40543081397694386,
            ],
            812189.02268257306,
        ),
        (
            12,
            1,
            &[-4.2278959721652356, -1.6885127570788971, -1.4775704769442872, 1.9373072892887242, -0.95335302992566706],
            156461914.77699107,
        ),
        (13, 4, &[-0.48527734685953461, 0.14582002833024926], 1158.4171691629858),
        (
            14,
            3,
            &[
                0.06720362243865885,
                -0.72676370601228213,
                1.558085877942013,
                0.15076227086943253,
                1.9101074499015021,
                -1.7326189045889875,
                0.56252757175730106,
                0.12599417173904215,
                -2.63321737903606,
                0.59281394873295201,
            ],
            112.13340304247183,
        ),
        (
            15,
            5,
            &[
                -0.89319975499017157,
                2.0030210815907084,
                -0.036003622572198496,
                -1.901876477691667,
                2.9267201678314692,
                1.6103760700854057,
                0.66128554000190409,
                -2.9271907451121604,
                -5.4771273892496817,
                2.5739082453831661,
            ],
            164.12629748459159,
        ),
        (
            16,
            1,
            &[
                4.4902050543853571,
                7.5047932738821164,
                -3.5555615146332227,
                -4.3292029801932195,
                1.8467130069479889,
                -3.8299962019875129,
                2.2002880747616422,
                -3.4871378643186968,
                4.3150367713006501,
                3.79228151118381,
            ],
            181.87051648429971,
        ),
        (17, 4, &[0.32598204350746929, -0.12240041586110581], 64.360558825508548),
        (18, 1, &[0.0090382986014505735, 0.30236885032987804, -1.2088300912574275], 96.111343882177493),
        (
            19,
            2,
            &[
                1.5657791034241229,
                0.10930405165583502,
                0.37863861929176051,
                -5.144732009363806,
                3.6120114690235079,
                -6.4636391405477553,
                10.672361818228318,
                -3.639874498721396,
                2.2581396494056474,
                6.5424864117997759,
            ],
            409.93314374036737,
        ),
        (
            21,
            1,
            &[3.6472217223054555, -3.9785310018064211, -3.7791315682464774, -9.2294643938015017, 1.7179725043474665],
            142.31188369733121,
        ),
        (21, 2, &[-0.0060400531773042799, 0.18134741311175115, 0.063260617424276924], 12.918395773565544),
        (
            23,
            4,
            &[
                0.054664465076689969,
                0.0038247183269724473,
                0.0050028076042338086,
                -0.01160979023506252,
                0.24351156140149319,
            ],
            -210.07597929189794,
        ),
        (24, 2, &[-29.374959365636979, -12.309192201539119, -44.054881355911938], 21731895.747123357),
    ];

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
