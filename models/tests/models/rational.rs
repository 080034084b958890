//! Plants given by matrices whose entries may be parameters, as transfer functions.

use mops_core::{Analysis, Case, Job, Model, ModelOptions};
use mops_linear::StateSpace;
use mops_models::pid_open_loop::PidOpenLoopOptions;

/// Controller with the gain 1 alone: the loop transfer function is that of the plant.
const UNITY: [f64; 5] = [1.0, f64::INFINITY, 0.0, 10.0, 0.0];

fn plant(matrices: &str) -> Box<dyn Model> {
    let options: PidOpenLoopOptions = toml::from_str(&format!("plant = {{ {matrices} }}")).expect("options are right");
    options.build().expect("options make sense")
}

fn linear(analysis: &Analysis) -> &StateSpace {
    analysis.linear().expect("it is a linear system")
}

/// Returns the coefficients of the denominator in ascending powers without the leading 1: the canonical form has them
/// in its last row.
fn denominator(system: &StateSpace) -> Vec<f64> {
    let last = system.a.nrows() - 1;
    system.a.row(last).iter().map(|entry| -entry).collect()
}

#[test]
fn matrices_have_the_transfer_function_of_the_resolvent() {
    // s - A at s = 1 is [0.5 -0.5; 1 4.5].
    let plant = plant("a = [[0.5, 0.5], [-1.0, -3.5]], b = [-1.0, 4.0], c = [5.0, 2.25]");
    let job = Job { case: &Case::default(), parameters: &UNITY, signals: &[], horizon: 0.0 };
    let analysis = plant.analyse(&job).expect("it is defined");
    let system = linear(&analysis);
    assert_eq!(denominator(system), [-1.25, 3.0]);
    // Cramer's rule.
    let x = [(-4.5 + 2.0) / 2.75, (2.0 + 1.0) / 2.75];
    let [above, below] = [system.c.sum(), denominator(system).iter().sum::<f64>() + 1.0];
    assert!((above / below - (5.0 * x[0] + 2.25 * x[1])).abs() < 1e-14);
}

#[test]
fn the_tangents_of_the_coefficients_are_those_of_the_entries() {
    // 1/(s^2 + b s + a), with both derivatives; the entries are -a and -b.
    let plant = plant("a = [[0, 1], ['p', 'q']], b = [0, 1], c = [1, 0]");
    let parameters = [&UNITY[..], &[-2.0, -3.0]].concat();
    let seed = |along: usize| (0..7).map(|i| f64::from(u8::from(i == along))).collect();
    let job = Job { case: &Case::default(), parameters: &parameters, signals: &[], horizon: 0.0 };
    let (analysis, tangents) = plant.tangents(&job, &[seed(5), seed(6)]).expect("it has them").expect("it is defined");
    assert_eq!(denominator(linear(&analysis)), [2.0, 3.0]);
    let tangents: Vec<Vec<f64>> = tangents.iter().map(|tangent| denominator(linear(tangent))).collect();
    assert_eq!(tangents, [[-1.0, 0.0], [0.0, -1.0]]);
}
