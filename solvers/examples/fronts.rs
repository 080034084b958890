//! How good a front nsga2 and nsga3 find: `fronts zdt nsga2 250 11` lets them run for 250 generations under 11 seeds. The
//! members of the last generation are measured, and as many points of all that were evaluated.

use std::time::{Duration, Instant};

use mops_core::front::{hypervolume, inverted_generational_distance, non_dominated, thinned};
use mops_core::{Budget, Run, Solver};
use mops_problems::{Answer, Posed, Problem, Slope};
use mops_solvers::evolution::{Evolution, Survival};
use mops_solvers::nsga2::Nsga2Options;
use mops_solvers::nsga3::Nsga3Options;

/// Hypervolume and distance of the members, hypervolume of the archive, and the time it took.
struct Found {
    members: f64,
    distance: f64,
    archive: f64,
    time: Duration,
}

fn main() {
    // Inside the pool, as the program runs: outside it every batch would wake another thread.
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(all);
}

fn all() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [suite, kind, generations, seeds] = arguments.as_slice() else { panic!("fronts SUITE KIND GENERATIONS SEEDS") };
    let (generations, seeds) = (generations.parse().expect("a number"), seeds.parse().expect("a number"));
    let suite = mops_problems::suites().into_iter().find(|s| s.name == *suite).expect("a suite");
    println!(
        "{:8} {:>9} {:>8} {:>9} {:>9} {:>9} {:>8}",
        "", "volume", "sd", "of front", "archive", "distance", "seconds"
    );
    for problem in (suite.problems)() {
        let found: Vec<Found> = (1..=seeds)
            .map(|seed| match kind.as_str() {
                "nsga2" => {
                    run(&problem, Nsga2Options { generations, ..Default::default() }.search(), generations, seed)
                }
                _ => run(&problem, Nsga3Options { generations, ..Default::default() }.search(), generations, seed),
            })
            .collect();
        let Answer::Front { hypervolume, .. } = problem.answer else { continue };
        let (mean, deviation) = spread(&found.iter().map(|f| f.members).collect::<Vec<_>>());
        let (archive, _) = spread(&found.iter().map(|f| f.archive).collect::<Vec<_>>());
        let (distance, _) = spread(&found.iter().map(|f| f.distance).collect::<Vec<_>>());
        let (time, _) = spread(&found.iter().map(|f| f.time.as_secs_f64()).collect::<Vec<_>>());
        println!(
            "{:8} {mean:9.5} {deviation:8.5} {hypervolume:9.5} {archive:9.5} {distance:9.5} {time:8.4}",
            problem.name
        );
    }
}

#[allow(clippy::cast_precision_loss)]
fn spread(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len().max(2) - 1) as f64;
    (mean, square.sqrt())
}

fn run<S: Survival>(problem: &Problem, mut solver: Evolution<S>, generations: usize, seed: u64) -> Found {
    let posed = Posed::new(problem, Slope::Exact).with_seed(seed);
    let mut run = Run::new(&posed, Budget { evaluations: 1_000_000 }, &());
    let began = Instant::now();
    run.solve(&mut solver as &mut dyn Solver, &posed.start());
    let time = began.elapsed();
    let members = solver.members().expect("it has begun");
    assert!(run.archive().len() <= (generations + 1) * members.len() + 1);
    let Answer::Front { reference, points, .. } = &problem.answer else { panic!("a problem with a front") };
    let m = reference.len();
    let feasible = (0..members.len()).filter(|&i| members.violations[i] == 0.0);
    let objectives: Vec<f64> = feasible.flat_map(|i| members.row(i).to_vec()).collect();
    let of = |indices: Vec<usize>, all: &[f64]| -> Vec<f64> {
        indices.into_iter().flat_map(|i| all[i * m..(i + 1) * m].to_vec()).collect()
    };
    let best = of(non_dominated(&objectives, m), &objectives);
    let front: Vec<f64> = run.front().into_iter().flat_map(|i| run.archive()[i].objectives.clone()).collect();
    let archive = of(thinned(&front, m, members.len()), &front);
    Found {
        members: hypervolume(&best, reference),
        distance: inverted_generational_distance(&best, m, &points(1000)),
        archive: hypervolume(&archive, reference),
        time,
    }
}
