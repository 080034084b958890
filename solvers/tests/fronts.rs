//! Fronts computed by `weighted-chebyshev`, `nsga2` and `nsga3`, compared with known fronts.

use mops_core::{
    Run, Stop,
    front::{hypervolume, inverted_generational_distance, thinned},
    run::Budget,
};
use mops_math as math;
use mops_problems::{Answer, Posed, Slope};
use mops_solvers::{
    evolution::{Evolution, Survival},
    nsga2::Nsga2Options,
    nsga3::Nsga3Options,
};

/// Hypervolume of the whole front of a run, relative to the known hypervolume, for every problem of a suite.
fn shares<S: Survival>(suite: &str, search: impl Fn() -> Evolution<S>) -> Vec<(String, f64)> {
    let suite = mops_problems::suites().into_iter().find(|s| s.name == suite).unwrap();
    let share = |problem: mops_problems::Problem| {
        let Answer::Front { reference, hypervolume: known, .. } = &problem.answer else { panic!("{}", problem.name) };
        let posed = Posed::new(&problem, Slope::Exact);
        let mut run = Run::new(&posed, Budget { evaluations: 30_000 }, &());
        run.solve(&mut search(), &posed.start());
        let front: Vec<f64> = run.front().into_iter().flat_map(|i| run.archive()[i].objectives.clone()).collect();
        let found = hypervolume(&front, reference) / known;
        (problem.name.clone(), found)
    };
    (suite.problems)().into_iter().map(share).collect()
}

/// Sampling error of the known hypervolume of a front.
const SAMPLING: f64 = 1e-3;

#[test]
fn nsga2_comes_near_the_fronts_of_two_objectives_and_finds_nothing_beyond() {
    for suite in ["zdt", "constrained-fronts"] {
        for (name, share) in shares(suite, || Nsga2Options::default().search()) {
            assert!((0.96..=1.0 + SAMPLING).contains(&share), "{name}: {share}");
        }
    }
}

#[test]
fn nsga3_comes_near_the_fronts_of_three_objectives_and_finds_nothing_beyond() {
    for (name, share) in shares("dtlz", || Nsga3Options::default().search()) {
        // The bias of DTLZ6 outlasts 250 generations. On DTLZ4 the members may gather on one edge, as in the worst runs
        // of K. Deb, H. Jain (2014), Table III.
        let least = match name.as_str() {
            "DTLZ6" => 0.0,
            "DTLZ4" => 0.5,
            _ => 0.9,
        };
        assert!((least..=1.0 + SAMPLING).contains(&share), "{name}: {share}");
    }
}

/// Returns evenly spread points of a known front, and all of its points.
fn known_front(problem: &mops_problems::Problem, count: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let Answer::Front { points, .. } = &problem.answer else { panic!("{}", problem.name) };
    let all = points(4000);
    let m = all[0].len();
    let even = thinned(&all.concat(), m, count).into_iter().map(|i| all[i].clone()).collect();
    (even, all)
}

#[test]
fn weighted_chebyshev_spreads_thirty_exact_points_over_fronts_of_two_objectives() {
    for (suite, names) in
        [("zdt", &["ZDT1", "ZDT2", "ZDT3", "ZDT6"][..]), ("constrained-fronts", &["BNH", "SRN", "TNK", "OSY"])]
    {
        let suite = mops_problems::suites().into_iter().find(|s| s.name == suite).unwrap();
        for problem in (suite.problems)().into_iter().filter(|problem| names.contains(&problem.name.as_str())) {
            let Answer::Front { reference, .. } = &problem.answer else { panic!("{}", problem.name) };
            let posed = Posed::new(&problem, Slope::Exact);
            let mut run = Run::new(&posed, Budget { evaluations: 8000 }, &());
            let stop = run.solve(&mut *weighted_chebyshev(), &posed.start());
            assert_eq!(stop, Stop::Converged, "{}", problem.name);
            let rows: Vec<Vec<f64>> = run.front().into_iter().map(|i| run.archive()[i].objectives.clone()).collect();
            assert!((28..=32).contains(&rows.len()), "{}: {}", problem.name, rows.len());
            let (even, all) = known_front(&problem, rows.len());
            let share = hypervolume(&rows.concat(), reference) / hypervolume(&even.concat(), reference);
            assert!((0.99..1.01).contains(&share), "{}: {share}", problem.name);
            // The distance to the front is about the spacing of its points.
            let off = inverted_generational_distance(&all.concat(), 2, &rows);
            let size = all[0].iter().zip(&all[all.len() - 1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 5e-3 * size, "{}: {off}", problem.name);
        }
    }
}

#[test]
fn weighted_chebyshev_spreads_points_over_a_sphere() {
    let suite = mops_problems::suites().into_iter().find(|s| s.name == "dtlz").unwrap();
    let problem = (suite.problems)().into_iter().find(|problem| problem.name == "DTLZ2").unwrap();
    let posed = Posed::new(&problem, Slope::Exact);
    let mut run = Run::new(&posed, Budget { evaluations: 8000 }, &());
    run.solve(&mut *weighted_chebyshev(), &posed.start());
    let rows: Vec<Vec<f64>> = run.front().into_iter().map(|i| run.archive()[i].objectives.clone()).collect();
    assert!(rows.len() >= 28, "{}", rows.len());
    for row in &rows {
        assert!((row.iter().map(|f| f * f).sum::<f64>() - 1.0).abs() < 1e-4, "{row:?}");
    }
    // Every direction of the octant has a point nearby: the triangles of 28 weights have sides of up to 0.4.
    let (_, all) = known_front(&problem, 1);
    let far = |at: &Vec<f64>| {
        let square = |row: &Vec<f64>| row.iter().zip(at).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>();
        rows.iter().map(square).fold(f64::INFINITY, f64::min).sqrt()
    };
    let farthest = all.iter().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
    assert!(far(farthest) < 0.35, "{farthest:?}: {}", far(farthest));
}

/// At the ends of this front, a criterion is zero on whole faces of the box.
#[test]
fn weighted_chebyshev_finds_a_sphere_from_any_start() {
    let suite = mops_problems::suites().into_iter().find(|s| s.name == "dtlz").unwrap();
    let problem = (suite.problems)().into_iter().find(|problem| problem.name == "DTLZ2").unwrap();
    let posed = Posed::new(&problem, Slope::Exact);
    let n = posed.start().len();
    for k in 0..8_u32 {
        // Fractions of multiples of the golden ratio.
        let start: Vec<f64> =
            (0..u32::try_from(n).unwrap()).map(|j| (0.618 * f64::from(1 + k + 5 * j)).fract()).collect();
        let mut run = Run::new(&posed, Budget { evaluations: 8000 }, &());
        run.solve(&mut *weighted_chebyshev(), &start);
        let rows: Vec<Vec<f64>> = run.front().into_iter().map(|i| run.archive()[i].objectives.clone()).collect();
        assert!(rows.len() >= 30, "{k}: {}", rows.len());
        let off = |row: &Vec<f64>| (row.iter().map(|f| f * f).sum::<f64>() - 1.0).abs() > 1e-3;
        assert_eq!(rows.iter().find(|row| off(row)), None, "{k}");
    }
}

fn weighted_chebyshev() -> Box<dyn mops_core::Solver> {
    let kind = mops_solvers::kinds().into_iter().find(|kind| kind.name == "weighted-chebyshev").unwrap();
    kind.default_choice().make()
}
