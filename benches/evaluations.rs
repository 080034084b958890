//! Evaluations per second of shipped studies, on one and on two threads.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput};
use mops::core::{Oracle, Problem, Run, run::Budget};
use mops_math as math;
use rayon::{ThreadPool, ThreadPoolBuilder};

const STUDIES: [&str; 3] = ["pid-design", "pid-design-multi-case", "furuta-swing"];
const POINTS: u32 = 200;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = criterion.benchmark_group("200 points of the box");
    group.throughput(Throughput::Elements(u64::from(POINTS)));
    for name in STUDIES {
        let problem = shipped(name);
        let points = points(problem.shape().dimension());
        for threads in [1, 2] {
            let pool = pool(threads);
            let id = BenchmarkId::new(name, format!("{threads} threads"));
            group.bench_function(id, |b| b.iter(|| pool.install(|| evaluate(&problem, &points))));
        }
    }
    group.finish();
    criterion.final_summary();
    print_ratios();
    print_derivatives();
}

/// Prints median times of the derivatives at the initial guess on one thread, exact and by central differences in turn.
fn print_derivatives() {
    let pool = pool(1);
    for name in STUDIES {
        let problem = shipped(name);
        let start = problem.start();
        let derivatives = |exact: bool| {
            let run = Run::new(&problem, Budget { evaluations: usize::MAX }, &());
            let mut run = if exact { run } else { run.by_differences() };
            let clock = Instant::now();
            let found = pool.install(|| run.linearise(&start, 1e-4));
            assert!(black_box(found).is_ok_and(|found| found.is_some()), "the initial guess can be simulated");
            clock.elapsed().as_secs_f64() * 1e6
        };
        let rounds: Vec<[f64; 2]> = (0..101).map(|_| [true, false].map(derivatives)).collect();
        let [exact, differences] = [0, 1].map(|i| median(rounds.iter().map(|round| round[i]).collect()));
        let ratio = median(rounds.iter().map(|[exact, differences]| differences / exact).collect());
        println!(
            "{name:22} derivatives for {:2} tuners: {exact:6.0} us exact, {differences:6.0} us by differences, \
             ratio differences / exact: {ratio:.2}",
            start.len()
        );
    }
}

/// Prints medians over rounds on one and two threads in turn, so that other load of the machine affects both equally.
fn print_ratios() {
    let pools = [pool(1), pool(2)];
    for name in STUDIES {
        let problem = shipped(name);
        let points = points(problem.shape().dimension());
        let mut rounds = Vec::new();
        for _ in 0..31 {
            rounds.push(pools.each_ref().map(|pool| {
                let start = Instant::now();
                pool.install(|| evaluate(&problem, &points));
                f64::from(POINTS) / start.elapsed().as_secs_f64()
            }));
        }
        let [one, two] = [0, 1].map(|i| median(rounds.iter().map(|round| round[i]).collect()));
        let ratio = median(rounds.iter().map(|[one, two]| two / one).collect());
        let failed = points.iter().filter(|point| problem.evaluate(point).scaled.is_none()).count();
        println!(
            "{name:22} {one:6.0} evaluations/s on 1 thread ({:.0} us each), {two:6.0} on 2, ratio 2 threads / 1 thread: \
             {ratio:.2}; {failed} of {POINTS} fail",
            1e6 / one
        );
    }
}

/// Evaluates all points in a new run, which has none of them in its cache.
fn evaluate(problem: &Problem, points: &[Vec<f64>]) {
    let mut run = Run::new(problem, Budget { evaluations: usize::MAX }, &());
    black_box(run.evaluate(points)).expect("the budget suffices");
}

/// Returns fixed points spread over the unit box: the R-sequence.
///
/// Source: M. Roberts, The unreasonable effectiveness of quasirandom sequences (2018).
fn points(dimension: usize) -> Vec<Vec<f64>> {
    // Positive root of g^(d + 1) = g + 1.
    #[allow(clippy::cast_precision_loss)]
    let root = (0..60).fold(2.0_f64, |g, _| math::powf(1.0 + g, 1.0 / (dimension + 1) as f64));
    let coordinate = |i: u32, j: i32| (0.5 + f64::from(i) * math::powi(root, -1 - j)).fract();
    (0..POINTS).map(|i| (0..).take(dimension).map(|j| coordinate(i, j)).collect()).collect()
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started")
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

fn shipped(name: &str) -> Problem {
    let study = mops::studies::shipped().into_iter().find(|study| study.name == name).expect("it is shipped");
    let file = mops::file::read_shipped(&mops::catalogue(), &study, &[]).expect("it is right");
    Problem::new(Arc::new(file.study))
}
