//! Simulation kernel compared with a hand-written Dormand-Prince method for one plant: a Furuta pendulum over 3 s.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use criterion::Criterion;
use mops::{
    Analysis, Case, Input, Model, Scalar,
    core::{Job, model::Work},
    language::{DIRECTIONS, Dual, Dual7},
    models::{
        furuta::{Furuta, FurutaPlant},
        kernel::{Driven, Inputs, Integrable, Sink, Step, Tolerance, drive::Drive, friction::Contact, integrate},
    },
};

const END: f64 = 3.0;
const ABSOLUTE: f64 = 1e-8;
const TOLERANCE: Tolerance =
    Tolerance { relative: 1e-6, absolute: Some(ABSOLUTE), max_steps: 100_000, ..Tolerance::DEFAULT };
/// Parameters `a`, `b`, `c`, `d`, `ba`, `bp`, `ca`, `cp`, in the units of the model.
const VISCOUS: [f64; 8] = [0.0044, 0.0118, 0.0036, 0.105, 0.002, 0.0003, 0.0, 0.0];
/// Parameters with dry friction: 10 mN m in the arm, 2 mN m in the pendulum.
const DRY: [f64; 8] = [0.0044, 0.0118, 0.0036, 0.105, 0.002, 0.0003, 0.01, 0.002];
/// Initial state `phi`, `phi'`, `theta`, `theta'`.
const START: [f64; 4] = [0.0, 0.0, 1.68, 1.78];
const SAMPLES: usize = 301;

/// Returns the input `u = 0.05 sin 4t`.
fn torque() -> Input {
    Input::Sine { amplitude: 0.05, frequency: 4.0 / TAU, phase: 0.0, offset: 0.0 }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    compare_results();
    let variants = variants();
    let mut group = criterion.benchmark_group("furuta 3 s, rtol 1e-6");
    for (name, run) in &variants {
        group.bench_function(*name, |b| b.iter(run));
    }
    group.finish();
    criterion.final_summary();
    print_ratios(&variants);
}

/// Checks that both methods end in the same state; prints their numbers of right-hand sides.
fn compare_results() {
    let (by_hand, count) = hand_written::simulate(&VISCOUS, START, END);
    let input = torque();
    let (by_kernel, work) = simulate(VISCOUS, &input, &mut ());
    let far = by_hand.iter().zip(&by_kernel).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!(
        "right-hand sides: hand-written {count}, kernel {}; states at the end differ by {far:.1e}",
        work.derivatives
    );
    assert!(far < 1e-4, "{by_hand:?} {by_kernel:?}");
    let mut events = Events(0);
    let (_, work) = simulate(DRY, &input, &mut events);
    println!("with dry friction: {} right-hand sides, {} events", work.derivatives, events.0);
    assert!(events.0 > 0);
}

/// Name and code of a measured variant.
type Variant = (&'static str, Box<dyn Fn() -> f64>);

/// Returns the variants: the hand-written method, then the kernel and the model in several configurations.
fn variants() -> Vec<Variant> {
    let (viscous, sampled, dry) = (analysis(VISCOUS), analysis(VISCOUS), analysis(DRY));
    let tangents: [Dual7; 8] =
        std::array::from_fn(|i| if i < DIRECTIONS { Dual::variable(VISCOUS[i], i) } else { VISCOUS[i].into() });
    let times: Vec<f64> = (0..SAMPLES).map(sample_time).collect();
    vec![
        ("hand-written", Box::new(|| hand_written::simulate(black_box(&VISCOUS), START, END).0[2])),
        ("kernel", Box::new(|| simulate(black_box(VISCOUS), &torque(), &mut ()).0[2])),
        (
            "kernel, 301 samples",
            Box::new(|| {
                let mut samples = Samples { states: Vec::with_capacity(SAMPLES) };
                simulate(black_box(VISCOUS), &torque(), &mut samples);
                samples.states[SAMPLES - 1][2]
            }),
        ),
        ("kernel, dry friction", Box::new(|| simulate(black_box(DRY), &torque(), &mut ()).0[2])),
        ("kernel, 7 tangents", Box::new(move || simulate(black_box(tangents), &torque(), &mut ()).0[2].tangent[0])),
        ("model, traces of all signals", Box::new(move || viscous().trace("theta").last())),
        (
            "model, traces and 301 samples of each",
            Box::new(move || {
                let analysis = sampled();
                let last = |signal: &&str| analysis.trace(signal).sample(&times)[SAMPLES - 1];
                ["phi", "dphi", "theta", "dtheta", "u"].iter().map(last).sum()
            }),
        ),
        ("model, traces, dry friction", Box::new(move || dry().trace("theta").last())),
    ]
}

/// Prints medians over rounds of all variants in turn, so that other load of the machine affects all variants equally.
fn print_ratios(variants: &[Variant]) {
    const ROUNDS: usize = 101;
    const RUNS: u32 = 20;
    let mut rounds: Vec<Vec<f64>> = Vec::new();
    for _ in 0..ROUNDS {
        let time = |(_, run): &Variant| {
            let start = Instant::now();
            for _ in 0..RUNS {
                black_box(run());
            }
            start.elapsed().as_secs_f64() / f64::from(RUNS) * 1e6
        };
        rounds.push(variants.iter().map(time).collect());
    }
    println!("median times, and median ratios to the hand-written method in the same round:");
    for (i, (name, _)) in variants.iter().enumerate() {
        let time = median(rounds.iter().map(|round| round[i]).collect());
        let ratio = median(rounds.iter().map(|round| round[i] / round[0]).collect());
        println!("  {name:40} {time:7.2} us  {ratio:6.3}");
    }
    let ratio = median(rounds.iter().map(|round| round[1] / round[0]).collect());
    println!("ratio kernel/hand-written: {ratio:.2}");
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

/// Simulates the plant of the model with the kernel.
fn simulate<S: Scalar>(
    parameters: [S; 8],
    input: &Input,
    sink: &mut impl for<'p> Sink<S, dyn Integrable<S> + 'p>,
) -> (Vec<S>, Work) {
    let [a, b, c, d, ba, bp, ca, cp] = parameters;
    let start = START.map(S::from);
    let plant = FurutaPlant { a, b, c, d, viscous: [bp, ba], coulomb: [cp, ca], start, contact: [Contact::Forward; 2] };
    let mut driven = Driven::new(plant, Inputs::new(vec![Drive::new(Some(input))], 2), &[]);
    integrate(&mut driven, 0.0, END, &start, &TOLERANCE, sink).expect("the simulation succeeds")
}

/// Returns the analysis by the model as in a study, with traces of all signals.
fn analysis(physical: [f64; 8]) -> impl Fn() -> Analysis {
    let model = Furuta::model(None, TOLERANCE);
    let case = Case { inputs: vec![("u".into(), torque())], ..Case::default() };
    let parameters: Vec<f64> = physical.into_iter().chain(START).collect();
    move || {
        let job = Job { case: &case, parameters: &parameters, signals: &[0, 1, 2, 3, 4], horizon: END };
        model.analyse(&job).expect("the simulation succeeds")
    }
}

/// Counts events.
struct Events(usize);

impl<P: ?Sized> Sink<f64, P> for Events {
    fn step(&mut self, _: &Step<f64>, _: &Driven<'_, f64, P>) {}
    fn event(&mut self, _: f64, _: &str) {
        self.0 += 1;
    }
}

/// Reads the state at 301 times from the dense output.
struct Samples {
    states: Vec<[f64; 4]>,
}

#[allow(clippy::cast_precision_loss)]
fn sample_time(i: usize) -> f64 {
    END * i as f64 / (SAMPLES - 1) as f64
}

impl<P: ?Sized> Sink<f64, P> for Samples {
    fn step(&mut self, step: &Step<f64>, _: &Driven<'_, f64, P>) {
        while self.states.len() < SAMPLES && sample_time(self.states.len()) <= step.start + step.taken {
            let mut x = [0.0; 4];
            step.state((sample_time(self.states.len()) - step.start) / step.taken, &mut x);
            self.states.push(x);
        }
    }
}

/// Hand-written method: plain arrays, one plant, one tolerance; no events, no failures, no dense output.
mod hand_written {
    use super::{ABSOLUTE, TOLERANCE};
    use mops_math as math;

    type State = [f64; 4];

    /// Returns the derivatives of the pendulum with viscous friction for `u = 0.05 sin 4t`; states as in the model.
    fn derivative(&[a, b, c, d, ba, bp, ..]: &[f64; 8], t: f64, &[_, dphi, theta, dtheta]: &State) -> State {
        let u = 0.05 * math::sin(4.0 * t);
        let (sin, cos) = math::sin_cos(theta);
        let (m12, m22) = (c * cos, b + a * sin * sin);
        let f1 = a * dphi * dphi * sin * cos + d * sin - bp * dtheta;
        let f2 = c * dtheta * dtheta * sin - 2.0 * a * dtheta * dphi * sin * cos + u - ba * dphi;
        let determinant = a * m22 - m12 * m12;
        [dphi, (a * f2 - m12 * f1) / determinant, dtheta, (m22 * f1 - m12 * f2) / determinant]
    }

    /// Returns `x + h sum_i c_i k_i`.
    #[inline(always)]
    fn combine<const N: usize>(x: &State, h: f64, terms: [(f64, &State); N]) -> State {
        std::array::from_fn(|j| x[j] + h * terms.iter().map(|(c, k)| c * k[j]).sum::<f64>())
    }

    /// Returns the root mean square of `v` in units of the tolerance at `scale`.
    fn norm(v: &State, scale: &State) -> f64 {
        let ratio = |j: usize| v[j] / (ABSOLUTE + TOLERANCE.relative * scale[j].abs());
        ((0..4).map(|j| math::powi(ratio(j), 2)).sum::<f64>() / 4.0).sqrt()
    }

    /// Returns the state at the end, and the number of right-hand sides.
    ///
    /// Source: DOPRI5 in E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I (1993).
    #[rustfmt::skip]
    pub fn simulate(p: &[f64; 8], mut x: State, end: f64) -> (State, usize) {
        let f = |t: f64, x: &State| derivative(p, t, x);
        let mut t = 0.0;
        let mut k1 = f(t, &x);
        let mut h = initial_step(f, &x, &k1).min(end);
        let mut count = 2;
        let mut last_error = 1e-4_f64;
        let mut rejected = false;
        while t < end {
            let last = t + 1.01 * h >= end;
            if last {
                h = end - t;
            }
            let k2 = f(t + 0.2 * h, &combine(&x, h, [(1.0 / 5.0, &k1)]));
            let k3 = f(t + 0.3 * h, &combine(&x, h, [(3.0 / 40.0, &k1), (9.0 / 40.0, &k2)]));
            let k4 = f(t + 0.8 * h, &combine(&x, h, [(44.0 / 45.0, &k1), (-56.0 / 15.0, &k2), (32.0 / 9.0, &k3)]));
            let k5 = f(t + 8.0 / 9.0 * h, &combine(&x, h, [
                (19372.0 / 6561.0, &k1), (-25360.0 / 2187.0, &k2), (64448.0 / 6561.0, &k3), (-212.0 / 729.0, &k4)]));
            let k6 = f(t + h, &combine(&x, h, [
                (9017.0 / 3168.0, &k1), (-355.0 / 33.0, &k2), (46732.0 / 5247.0, &k3), (49.0 / 176.0, &k4),
                (-5103.0 / 18656.0, &k5)]));
            let next = combine(&x, h, [
                (35.0 / 384.0, &k1), (500.0 / 1113.0, &k3), (125.0 / 192.0, &k4), (-2187.0 / 6784.0, &k5),
                (11.0 / 84.0, &k6)]);
            let k7 = f(t + h, &next);
            count += 6;
            let difference = combine(&[0.0; 4], h, [
                (71.0 / 57600.0, &k1), (-71.0 / 16695.0, &k3), (71.0 / 1920.0, &k4), (-17253.0 / 339_200.0, &k5),
                (22.0 / 525.0, &k6), (-1.0 / 40.0, &k7)]);
            let error = norm(&difference, &std::array::from_fn(|j| x[j].abs().max(next[j].abs())));
            let growth = math::powf(error, 0.2 - 0.04 * 0.75);
            if error > 1.0 {
                h /= (growth / 0.9).min(5.0);
                rejected = true;
                continue;
            }
            t = if last { end } else { t + h };
            (x, k1) = (next, k7);
            let shrink = (growth / math::powf(last_error, 0.04) / 0.9).clamp(0.1, 5.0);
            h /= if rejected { shrink.max(1.0) } else { shrink };
            last_error = error.max(1e-4);
            rejected = false;
        }
        (x, count)
    }

    fn initial_step(f: impl Fn(f64, &State) -> State, x: &State, k1: &State) -> f64 {
        let (d0, d1) = (norm(x, x), norm(k1, x));
        let h0 = 0.01 * d0 / d1;
        let k2 = f(h0, &combine(x, h0, [(1.0, k1)]));
        let d2 = norm(&std::array::from_fn(|j| k2[j] - k1[j]), x) / h0;
        (100.0 * h0).min(math::powf(0.01 / d1.max(d2), 0.2))
    }
}
