//! Linearised models and linear systems, compared with closed forms, differences and each other.

use std::sync::Arc;

use mops_core::{
    Analysis, Case, Input, Job, Model, ModelOptions,
    model::{Linearise, Linearised, OperatingPoint},
};
use mops_language::Quantity;
use mops_linear::{Complex, Loop, StateSpace, TransferFunction};
use mops_math as math;
use mops_math::complex;
use mops_models::furuta::Furuta;
use mops_models::kernel::Tolerance;
use mops_models::pid_loop::PidLoopOptions;
use mops_models::pid_open_loop::PidOpenLoopOptions;
use mops_models::state_space::StateSpaceOptions;
use mops_models::transfer_function::TransferFunctionOptions;

fn model<O: ModelOptions>(options: &str) -> Box<dyn Model> {
    toml::from_str::<O>(options).expect("options are right").build().expect("options make sense")
}

fn system(model: &dyn Model, parameters: &[f64]) -> StateSpace {
    let case = Case::default();
    let job = Job { case: &case, parameters, signals: &[], horizon: 0.0 };
    match model.analyse(&job).expect("it is defined") {
        Analysis::Linear(system) => system,
        Analysis::Time(_) => panic!("it is linear"),
    }
}

/// Lumped parameters from table 4.5 of the thesis before rounding, and the friction of both joints.
const FURUTA: [f64; 12] =
    [9.035_24e-4, 1.133_13e-3, 6.309_84e-4, 2.526_663e-2, 1e-4, 2.5287e-5, 1e-3, 1e-4, 0.0, 0.0, 0.0, 0.0];

#[test]
fn the_furuta_pendulum_upright_is_the_linear_pendulum() {
    let furuta: Arc<dyn Model> = Arc::new(Furuta::model(None, Tolerance::default()));
    let linearised = Linearised::new(furuta, &Linearise::default()).unwrap();
    let found = system(&linearised, &FURUTA);
    // M q'' = f with M = [[a, c], [c, b]], in closed form.
    let [a, b, c, d, ba, bp, ..] = FURUTA;
    let determinant = a * b - c * c;
    let rows = [
        [0.0, 1.0, 0.0, 0.0],
        [0.0, -a * ba / determinant, -c * d / determinant, c * bp / determinant],
        [0.0, 0.0, 0.0, 1.0],
        [0.0, c * ba / determinant, b * d / determinant, -b * bp / determinant],
    ];
    for i in 0..4 {
        for j in 0..4 {
            assert!((found.a[(i, j)] - rows[i][j]).abs() < 1e-12 * (1.0 + rows[i][j].abs()), "{i} {j}: {}", found.a);
        }
    }
    assert!((found.b[(1, 0)] - a / determinant).abs() < 1e-9 && (found.b[(3, 0)] + c / determinant).abs() < 1e-9);
    assert_eq!((found.states.join(" "), found.d[(4, 0)]), ("phi dphi theta dtheta".to_owned(), 1.0));
    // Entries printed in the thesis (section 5.2), from the same parameters before rounding.
    assert!((found.a[(1, 2)] + 25.4814).abs() < 0.002 && (found.b[(1, 0)] - 1444.1).abs() < 0.5);
}

#[test]
fn bearings_rest_without_dry_friction_and_slide_where_they_move() {
    let furuta = model::<mops_models::furuta_2_joint::Furuta2JointOptions>("");
    let value = |p: &mops_core::Parameter| match p.variable.name.as_str() {
        "tau11" => 0.01,
        "tau12" => 0.03,
        "tau22" => 0.004,
        "theta0" => 3.1,
        _ => p.default.unwrap_or(0.02),
    };
    let parameters: Vec<f64> = furuta.interface().parameters.iter().map(value).collect();
    let look = |dphi: f64, at_rest: bool| {
        let states = [0.0, dphi, std::f64::consts::PI, 0.0];
        let at = OperatingPoint { parameters: &parameters, states: &states, inputs: &[0.0], past: &[], at_rest };
        furuta.local(&at).unwrap().unwrap()
    };
    let (resting, forward, backward) = (look(0.0, false), look(2.0, false), look(-2.0, false));
    // The pendulum's friction has no jump at rest and remains; that of the arm at 2 rad/s is 0.05 N m.
    assert_eq!((resting.rates[1].abs() < 1e-12, resting.slopes[(1, 1)]), (true, 0.0));
    assert!(resting.slopes[(3, 3)] < 0.0 && resting.frictionless == ["phi"]);
    assert!((forward.rates[1] + 0.05 * resting.slopes[(1, 4)]).abs() < 1e-9, "{:?}", forward.rates);
    assert!((backward.rates[1] + forward.rates[1]).abs() < 1e-9 && forward.frictionless.is_empty());
    assert!((forward.slopes[(1, 1)] + 0.02 * resting.slopes[(1, 4)]).abs() < 1e-9);
    assert!(look(2.0, true).rates[1].abs() < 1e-12);
    let search = Linearise { equilibrium: true, ..Linearise::default() };
    let found = Linearised::new(Arc::from(furuta), &search).unwrap().at(&Case::default(), &parameters).unwrap();
    assert!((found.states[2] - std::f64::consts::PI).abs() < 1e-9, "{:?}", found.states);
}

#[test]
fn coulomb_friction_of_the_furuta_pendulum_has_its_sign_where_a_joint_moves() {
    let furuta = Furuta::model(None, Tolerance::default());
    let look = |dphi: f64, at_rest: bool| {
        let states = [0.0, dphi, 0.0, 0.0];
        let at = OperatingPoint { parameters: &FURUTA, states: &states, inputs: &[0.0], past: &[], at_rest };
        furuta.local(&at).unwrap().unwrap()
    };
    let (resting, sliding) = (look(0.0, false), look(1.0, false));
    assert_eq!((resting.rates.as_slice(), resting.frictionless.join(" ").as_str()), (&[0.0; 4][..], "phi theta"));
    // Coulomb friction of 1e-3 N m and viscous friction of 1e-4 N m on the arm, equivalent to an input.
    assert!((sliding.rates[1] + 1.1e-3 * resting.slopes[(1, 4)]).abs() < 1e-9 && sliding.frictionless == ["theta"]);
    assert!((look(1.0, true).rates[1] + 1e-4 * resting.slopes[(1, 4)]).abs() < 1e-9);
}

#[test]
fn derivatives_at_any_state_agree_with_central_differences() {
    let furuta = Furuta::model(None, Tolerance::default());
    let (states, inputs) = ([0.3, -1.2, 2.1, 4.0], [0.01]);
    let local = |states: &[f64], inputs: &[f64]| {
        furuta
            .local(&OperatingPoint { parameters: &FURUTA, states, inputs, past: &[], at_rest: false })
            .unwrap()
            .unwrap()
    };
    let here = local(&states, &inputs);
    let h = 1e-5;
    for j in 0..5 {
        let moved = |sign: f64| {
            let (mut x, mut u) = (states, inputs);
            if j < 4 {
                x[j] += sign * h
            } else {
                u[0] += sign * h
            }
            local(&x, &u)
        };
        let (high, low) = (moved(1.0), moved(-1.0));
        for (i, (high, low)) in
            high.rates.iter().chain(&high.signals).zip(low.rates.iter().chain(&low.signals)).enumerate()
        {
            let slope = (high - low) / (2.0 * h);
            assert!((here.slopes[(i, j)] - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{i} {j}");
        }
    }
}

#[test]
fn the_pendulum_finds_its_equilibrium_and_hangs_stably() {
    let furuta: Arc<dyn Model> = Arc::new(Furuta::model(None, Tolerance::default()));
    let at = |value: &str| vec![("theta".to_owned(), Quantity::parse(value).unwrap())];
    let near = Linearise { at: at("2.9 rad"), equilibrium: true, free: vec!["theta".into()], ..Linearise::default() };
    let resting = Linearised::new(furuta, &near).unwrap().at(&Case::default(), &FURUTA).unwrap();
    assert!((resting.states[2] - std::f64::consts::PI).abs() < 1e-12, "{:?}", resting.states);
    assert!(resting.rates.iter().all(|rate| rate.abs() < 1e-10));
    let hanging = resting.system.poles().unwrap();
    assert!(hanging.iter().all(|p| p.re < 1e-9), "{hanging:?}");
}

const PLANT: &str = "plant = { poles = ['a', 'b', 'c'], gain = 1.0 }\n";

#[test]
fn the_linearised_loop_and_the_loop_transfer_function_belong_together() {
    // y/r = L/(1 + L), and y/d = G/(1 + L), at a complex frequency; parameters of table 5.1 of the thesis.
    let closed: Arc<dyn Model> = model::<PidLoopOptions>(&format!("{PLANT}horizon = 60.0\nlimit = [-20, 20]")).into();
    let closed =
        Linearised::new(closed, &Linearise { outputs: Some(vec!["y".into()]), ..Linearise::default() }).unwrap();
    let open = model::<PidOpenLoopOptions>(PLANT);
    let (k, ti, td) = (5.48078, 4.6697, 1.41883);
    let closed = system(&closed, &[k, ti, td, 10.0, 1.0, 1.0, 0.0, 0.2, -4.0, -1.0]);
    let open = system(open.as_ref(), &[k, ti, td, 10.0, 0.0, 0.2, -4.0, -1.0]);
    let s = Complex::new(0.1, 0.9);
    let plant = ((s - 0.2) * (s + 4.0) * (s + 1.0)).inv();
    let l = open.response().unwrap().at(s)[(0, 0)];
    let controller = (s * ti).inv() + s * td / (s * td / 10.0 + 1.0) + 1.0;
    assert!(complex::norm(l - controller * k * plant) < 1e-12);
    let from = closed.response().unwrap().at(s);
    assert!(complex::norm(from[(0, 0)] - l / (l + 1.0)) < 1e-12);
    assert!(complex::norm(from[(0, 1)] - plant / (l + 1.0)) < 1e-12);
}

#[test]
fn without_integral_or_derivative_there_is_no_state_for_it() {
    let open = model::<PidOpenLoopOptions>("plant = { poles = [-1.0, -1.0, -1.0] }");
    let system = system(open.as_ref(), &[4.0, f64::INFINITY, 0.0, 10.0, 0.0]);
    assert_eq!(system.order(), 3);
    assert!((Loop::new(system).unwrap().gain_margin(false).unwrap() - 20.0 * math::log10(2.0)).abs() < 1e-11);
}

#[test]
fn the_same_system_by_matrices_by_coefficients_and_by_roots() {
    let s = Complex::new(0.0, 1.3);
    let at = |system: StateSpace| system.response().unwrap().at(s)[(0, 0)];
    let matrices = model::<StateSpaceOptions>(
        "a = [[0, 1], ['-k/m', '-d/m']]\nb = [[0], ['1/m']]\nc = [[1, 0]]\ndelay = 'L'\nunits = { k = 'N/m', m = 'kg' }",
    );
    assert_eq!(matrices.interface().parameters.iter().map(|p| p.variable.name.as_str()).collect::<String>(), "kmdL");
    let (k, m, d, l) = (8.0, 2.0, 12.0, 0.1);
    let exact = complex::exp(-s * l) / (s * s * m + s * d + k);
    assert!(complex::norm(at(system(matrices.as_ref(), &[k, m, d, l])) - exact) < 1e-14);
    let coefficients = model::<TransferFunctionOptions>("numerator = [1]\ndenominator = ['m', 'd', 'k']\ndelay = 'L'");
    assert!(complex::norm(at(system(coefficients.as_ref(), &[m, d, k, l])) - exact) < 1e-14);
    // s^2 + 6 s + 4 has the roots -3 +- sqrt 5.
    let roots = model::<TransferFunctionOptions>("gain = '1/m'\npoles = ['-3 + sqrt(5)', '-3 - sqrt(5)']\ndelay = 0.1");
    assert!(complex::norm(at(system(roots.as_ref(), &[m])) - exact) < 1e-13);
}

#[test]
fn tangents_of_linear_systems_agree_with_central_differences() {
    let open = model::<PidOpenLoopOptions>(PLANT);
    let parameters = [4.0, 2.0, 1.0, 10.0, 0.2, 0.0, -4.0, -1.0];
    let case = Case::default();
    let seeds: Vec<Vec<f64>> = (0..8).map(|i| (0..8).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let job = Job { case: &case, parameters: &parameters, signals: &[], horizon: 0.0 };
    let (_, tangents) = open.tangents(&job, &seeds).unwrap().unwrap();
    let h = 1e-6;
    for (i, tangent) in tangents.iter().enumerate() {
        let moved = |sign: f64| {
            let mut p = parameters;
            p[i] += sign * h;
            // A delay must not be negative, also here.
            system(open.as_ref(), &p)
        };
        let (high, low, tangent) = (moved(1.0), moved(-1.0), tangent.linear().unwrap());
        for [high, low, tangent] in
            [[&high.a, &low.a, &tangent.a], [&high.b, &low.b, &tangent.b], [&high.c, &low.c, &tangent.c]]
        {
            assert!(((high - low) / (2.0 * h) - tangent).norm() < 1e-6, "{i}");
        }
        assert!(((high.delay - low.delay) / (2.0 * h) - tangent.delay).abs() < 1e-9);
    }
}

#[test]
fn invalid_systems_are_an_error_with_a_remedy() {
    let refused = |options: &str| {
        let parsed = toml::from_str::<StateSpaceOptions>(options).expect("its shape is right");
        parsed.build().err().expect("it makes no sense").to_string()
    };
    let rest = "b = [[0], [1]]\nc = [[1, 0]]";
    assert!(refused(&format!("a = [[0, 1], [2]]\n{rest}")).starts_with("a: expected 2 rows of 2 entries"));
    assert!(refused(&format!("a = [[0, 1], [2, 3]]\nstates = ['x']\n{rest}")).starts_with("states: expected 2 names"));
    assert!(refused(&format!("a = [[0, 1], [2, 'k']]\nunits = {{ q = 'm' }}\n{rest}")).contains("`q`"));
    let order = toml::from_str::<TransferFunctionOptions>("numerator = [1, 2]\ndenominator = [3]").unwrap().build();
    assert!(order.err().unwrap().to_string().contains("order 1"));
    assert!(TransferFunction::new(vec![1.0, 2.0], vec![3.0]).state_space().is_err());
}

#[test]
fn a_delayed_system_over_time_is_its_closed_form_later_and_so_are_its_tangents() {
    // 3 exp(-T s)/(2 s + 1), a step from 0 to 1.5 at 1 s.
    let late = model::<TransferFunctionOptions>(
        "numerator = [3]\ndenominator = [2, 1]\ndelay = 'T'\nunits = { T = 's' }\nhorizon = '9 s'",
    );
    let lag = |t: f64| if t > 0.0 { 3.0 * (1.0 - math::exp(-t / 2.0)) } else { 0.0 };
    let rate = |t: f64| if t > 0.0 { 1.5 * math::exp(-t / 2.0) } else { 0.0 };
    let step = Input::Step { time: 1.0, before: 0.0, after: 1.5 };
    let case = Case { inputs: vec![("u".to_owned(), step)], ..Case::default() };
    let job = Job { case: &case, parameters: &[0.7], signals: &[0], horizon: 9.0 };
    let (analysis, tangents) = late.tangents(&job, &[vec![1.0]]).expect("it has tangents").unwrap();
    for t in (1..90).map(|i| 0.0997 * f64::from(i)) {
        let (y, slope) = (1.5 * lag(t - 1.7), -1.5 * rate(t - 1.7));
        assert!((analysis.trace("y").at(t) - y).abs() < 1e-7, "{t}: {} {y}", analysis.trace("y").at(t));
        assert!((tangents[0].trace("y").at(t) - slope).abs() < 1e-6, "{t}: {} {slope}", tangents[0].trace("y").at(t));
    }

    // A direct part passes the delayed input on: y = x + 2 u(t - 0.3), x' = -x + u(t - 0.3), u = sin(2 t).
    let direct =
        model::<StateSpaceOptions>("a = [[-1]]\nb = [[1]]\nc = [[1]]\nd = [[2]]\ndelay = 0.3\nhorizon = '6 s'");
    let name = direct.interface().inputs[0].name.clone();
    let sine = Input::Sine { amplitude: 1.0, frequency: 1.0 / std::f64::consts::PI, phase: 0.0, offset: 0.0 };
    let case = Case { inputs: vec![(name, sine)], ..Case::default() };
    let job = Job { case: &case, parameters: &[], signals: &[0], horizon: 6.0 };
    let analysis = direct.analyse(&job).unwrap();
    for t in (0..60).map(|i| 0.0997 * f64::from(i)) {
        let s: f64 = (t - 0.3).max(0.0);
        let x = (math::sin(2.0 * s) - 2.0 * math::cos(2.0 * s) + 2.0 * math::exp(-s)) / 5.0;
        let y = x + 2.0 * math::sin(2.0 * s);
        let found = analysis.trace(&direct.interface().signals[0].name).at(t);
        assert!((found - y).abs() < 1e-7, "{t}: {found} {y}");
    }
}
