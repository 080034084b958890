//! Studies of the gallery give the known answers of their README: closed forms, published values, and results of
//! independent simulations.

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use assert_cmd::cargo::cargo_bin_cmd;
use mops::{
    linear::Complex,
    math::{self, complex},
};
use serde_json::Value;

#[path = "common/studies.rs"]
#[allow(dead_code)]
mod studies;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/gallery").join(name)
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found} instead of {expected}");
}

/// Returns the result of a run.
fn run(name: &str, more: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let mut command = cargo_bin_cmd!("mops");
    command.arg("run").arg(file(name)).args(["--json", "--out"]).arg(folder.path().join("out")).args(more);
    serde_json::from_slice(&command.output().unwrap().stdout).unwrap()
}

/// Returns a criterion of a study at given start values of the tuners.
fn at_start(name: &str, tuners: &[&str]) -> impl Fn(&str, &str) -> f64 + use<> {
    let settings: Vec<&str> = tuners.iter().flat_map(|setting| ["--set", setting]).collect();
    let result = run(name, &[&["--max-evaluations", "1"], settings.as_slice()].concat())["start"].clone();
    move |case, criterion| studies::value(&result, case, criterion)
}

/// Returns the content of linearised.json.
fn linearised(name: &str, arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let mut command = cargo_bin_cmd!("mops");
    command.arg("linearise").arg(file(name)).args(arguments).arg("--out").arg(folder.path());
    command.assert().success();
    serde_json::from_slice(&std::fs::read(folder.path().join("linearised.json")).unwrap()).unwrap()
}

/// Returns complex numbers of a JSON list.
fn roots(list: &Value) -> Vec<Complex> {
    let number = |pair: &Value| Complex::new(pair[0].as_f64().unwrap(), pair[1].as_f64().unwrap());
    list.as_array().unwrap().iter().map(number).collect()
}

fn contains(list: &[Complex], expected: Complex) {
    let distance = list.iter().map(|z| complex::norm(z - expected)).fold(f64::INFINITY, f64::min);
    assert!(distance < 1e-6 * complex::norm(expected), "{expected} in {list:?}");
}

/// The gain crossover of a PI controller with a lag is the root of a quadratic equation in w^2; the ITAE is that of the
/// method of steps, order 8, tolerance 1e-11.
#[test]
fn the_heat_exchanger_has_the_margins_of_its_closed_form() {
    let (kc, ti, tau, dead) = (1.2341, 24.558, 21.3, 14.7);
    let found = at_start("heat-exchanger/study.toml", &["tuners.Kc.start=1.2341", "tuners.Ti.start=24.558"]);
    let (a, b) = (tau * tau * ti * ti, ti * ti * (1.0 - kc * kc));
    let w: f64 = ((-b + f64::sqrt(b * b + 4.0 * a * kc * kc)) / (2.0 * a)).sqrt();
    let margin = 0.5 * PI + math::atan(ti * w) - math::atan(tau * w) - dead * w;
    near(found("step", "phase-margin"), margin.to_degrees(), 1e-9);
    near(found("step", "delay-margin"), margin / w, 1e-9);
    near(found("load", "itae"), 954.419, 1e-6);
    assert!(found("inflow-F=1", "peak") < 1e-8, "the feedforward cancels the inflow");
}

/// At constant current, the force on the ball falls with the square of the gap: `x'' = 2 g/xe x`.
#[test]
fn the_levitated_ball_has_the_poles_of_its_closed_form() {
    let found = roots(&linearised("magnetic-levitation/study.toml", &["--model", "plant"])["poles"]);
    let pole = f64::sqrt(2.0 * 9.81 / 6e-3);
    [pole, -pole].into_iter().for_each(|pole| contains(&found, Complex::new(pole, 0.0)));
}

/// Margins of the sampled loop, from matrix exponentials, and the period at which its spectral radius is 1.
#[test]
fn the_levitated_ball_has_the_margins_of_its_sampled_loop() {
    let gains = ["tuners.kp.start=0.28", "tuners.ki.start=2.05", "tuners.kd.start=0.00444"];
    let found = at_start("magnetic-levitation/study.toml", &gains);
    near(found("rest", "sensitivity"), 2.006784, 1e-6);
    near(found("rest", "delay-margin"), 5.950745, 1e-6);
    near(found("push", "recovery"), 155.9927, 1e-5);
    for (period, is_stable) in [("10.659 ms", true), ("10.660 ms", false)] {
        let period = format!("models.digital.equations.constants.T={period}");
        let found = at_start("magnetic-levitation/study.toml", &[&gains[..], &[&period]].concat());
        assert_eq!(found("rest", "delay-margin") > 0.0, is_stable, "{period}");
    }
}

/// Gains of the Control Tutorials for MATLAB and Simulink, inverted pendulum, state-space methods.
#[test]
fn the_cart_pole_has_the_published_gains() {
    let published =
        [("1,0,1,0,1", [-1.0, -1.6567, 18.6854, 3.4594]), ("5000,0,100,0,1", [-70.7107, -37.8345, 105.5298, 20.9238])];
    for (weights, gains) in published {
        let arguments = ["--model", "plant", "--case", "rest", "--lqr", weights];
        let found = linearised("cart-pole/study.toml", &arguments)["feedback"]["k"][0].clone();
        for (k, gain) in gains.into_iter().enumerate() {
            let found = found[k].as_f64().unwrap();
            assert!((found - gain).abs() < 6e-5, "{found} {gain}");
        }
    }
}

/// `(1 + s T3)(1 + s T4) = (1 - g1)(1 - g2)/(g1 g2)`. Source: K. H. Johansson, IEEE Transactions on Control Systems
/// Technology 8 (2000) 456-465, section III.
#[test]
#[allow(clippy::approx_constant)] // A pump gain of 3.14 cm3/s/V.
fn the_quadruple_tank_has_the_zeros_of_its_closed_form_in_both_phases() {
    let [a13, a24, o13, o24, g] = [28.0, 32.0, 0.071, 0.057, 981.0];
    for (case, k, share, volt) in [("step1", [3.33, 3.35], [0.7, 0.6], 3.0), ("plus", [3.14, 3.29], [0.43, 0.34], 3.15)]
    {
        // Outflow of an upper tank at rest, and its time constant A sqrt(2 h/g)/a with sqrt(2 g h) = outflow/a.
        let constant = |area: f64, outlet: f64, flow: f64| area * flow / (outlet * outlet * g);
        let t3 = constant(a13, o13, (1.0 - share[1]) * k[1] * volt);
        let t4 = constant(a24, o24, (1.0 - share[0]) * k[0] * volt);
        let eta = (1.0 - share[0]) * (1.0 - share[1]) / (share[0] * share[1]);
        let half: f64 = (t3 + t4) / (2.0 * t3 * t4);
        let root = f64::sqrt(half * half - (1.0 - eta) / (t3 * t4));
        let found = roots(&linearised("quadruple-tank/study.toml", &["--model", "zeros", "--case", case])["poles"]);
        [-half + root, -half - root].into_iter().for_each(|zero| contains(&found, Complex::new(zero, 0.0)));
    }
}

/// Loop of the book's design: filter and controller, evaluated at single frequencies; R. W. Erickson, D. Maksimovic,
/// Fundamentals of Power Electronics, section 9.5.4.
#[test]
fn the_buck_converter_has_the_margin_of_its_loop() {
    let found = at_start("buck-converter/study.toml", &[]);
    let at = |f: f64| {
        let s = Complex::new(0.0, TAU * f);
        let one = Complex::new(1.0, 0.0);
        let lag = |f: f64| one + s / (TAU * f);
        let filter = one / (one + s * 50e-6 / 3.0 + s * s * 50e-6 * 500e-6);
        let controller = (one + Complex::new(TAU * 500.0, 0.0) / s) * lag(1.7e3) / lag(14.5e3) * 3.7;
        filter * controller * 28.0 / (3.0 * 4.0)
    };
    let (mut low, mut high) = (1e3, 2e4);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if complex::norm(at(middle)) > 1.0 { low = middle } else { high = middle }
    }
    near(found("rest", "crossover"), low * 1e-3, 1e-9);
    near(found("rest", "margin"), complex::arg(-at(low)).to_degrees(), 1e-9);
    // An exact simulation of the switched circuit, with matrix exponentials from one instant to the next.
    near(found("rest", "i-ripple"), 1.39297, 1e-5);
    near(found("rest", "v-ripple"), 3.48252, 1e-5);
}

/// The shaft between motor and load makes zeros of the motor speed at the roots of `Jl s^2 + cs s + ks`. The values of
/// the sampled controller are those of difference equations with an exact hold of the drive.
#[test]
fn the_servo_has_the_antiresonance_of_its_load_and_the_response_of_its_sampled_controller() {
    let arguments = ["--model", "drive", "--at", "Jl=0.4", "--input", "e", "--output", "wm"];
    let found = roots(&linearised("servo/study.toml", &arguments)["channels"][0]["zeros"]);
    let (inertia, damping, stiffness) = (0.4e-4, 2e-3, 14.0);
    let half: f64 = damping / (2.0 * inertia);
    contains(&found, Complex::new(-half, f64::sqrt(stiffness / inertia - half * half)));
    let sampled = at_start("servo/sampled.toml", &[]);
    near(sampled("step-Jl=0.4", "settling"), 60.213, 1e-5);
    near(sampled("step-Jl=0.4", "current"), 10.835, 2e-5);
    near(sampled("load-Jl=0.4", "recovery"), 28.843, 1e-5);
    near(sampled("load-Jl=0.4", "deflection"), 62.661, 1e-5);
    // From the transition matrix of the sampled loop over a period, with and without the cut.
    near(sampled("load-Jl=0.2", "sensitivity"), 1.917_992_7, 1e-6);
    near(sampled("load-Jl=0.4", "sensitivity"), 1.984_783_2, 1e-6);
    near(sampled("load-Jl=0.4", "phase"), 29.2458, 1e-5);
    near(sampled("load-Jl=0.4", "gain"), 8.38292, 1e-5);
}

/// Optima of Nelder-Mead (heat exchanger) and of differential evolution (buck converter) in SciPy, and the tables of
/// the READMEs.
#[test]
#[ignore = "full tier"]
fn the_designs_end_at_the_stated_optima() {
    let best = |name: &str| run(name, &[])["worst_scaled"].as_f64().unwrap();
    near(best("heat-exchanger/study.toml"), 0.952822, 1e-5);
    near(best("buck-converter/study.toml"), 0.6924, 1e-3);
    near(best("quadruple-tank/study.toml"), 0.726655, 1e-4);
    near(best("quadruple-tank/plus.toml"), 0.58388, 1e-4);
    near(best("magnetic-levitation/study.toml"), 0.765784, 1e-4);
    near(best("servo/study.toml"), 0.90283, 1e-4);
    near(best("cart-pole/study.toml"), 0.77993, 1e-3);
}
