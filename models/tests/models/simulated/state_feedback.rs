//! Upright pendulum under state feedback, compared with published figures.

use mops_core::{Case, Model, ModelOptions, Response, model::OperatingPoint};
use mops_math as math;
use mops_models::furuta_2_joint::Furuta2JointOptions;
use mops_models::furuta_linear::FurutaLinearOptions;
use mops_models::furuta_state_feedback::FurutaStateFeedbackOptions;

use super::{check_tangents_by, respond, values as values_of};

/// Lumped parameters of table 4.5 of the thesis before rounding, spring of the arm, damper of the pendulum, setpoint of
/// 30 deg.
const PLANT: [(&str, f64); 7] = [
    ("a", 9.035_24e-4),
    ("b", 1.133_13e-3),
    ("c", 6.309_84e-4),
    ("d", 2.526_663e-2),
    ("c1", 7.4926e-5),
    ("d2", 2.5287e-5),
    ("setpoint", std::f64::consts::FRAC_PI_6),
];
/// Gains for poles at -5, -8, -10, -14, as printed.
const PLACED: [f64; 4] = [-0.1387, -0.0690, -0.7345, -0.1354];
/// Gains of table 5.4 of the thesis.
const RETUNED: [f64; 4] = [-0.033_026_8, -0.021_845_1, -0.318_308, -0.061_468_8];

fn values(gains: [f64; 4]) -> Vec<(&'static str, f64)> {
    PLANT.into_iter().chain(["k1", "k2", "k3", "k4"].into_iter().zip(gains)).collect()
}

fn run(plant: &str, gains: [f64; 4]) -> Response {
    let options = format!("horizon = 5.0\nplant = '{plant}'\ntolerance = {{ relative = 1e-10, absolute = 1e-12 }}");
    let model = toml::from_str::<FurutaStateFeedbackOptions>(&options).unwrap().build().unwrap();
    respond(model.as_ref(), &Case::default(), &values(gains), 5.0)
}

/// Returns the rise time from 10 % to 90 %, the settling time to 0.3 deg, and the largest pendulum angle (deg). Both
/// times are those of the arm, to 30 deg, in s.
fn figures(response: &Response) -> [f64; 3] {
    let arm = response.trace("phi").unwrap();
    let target = 30_f64.to_radians();
    let first = |level: f64| arm.pieces().iter().find_map(|p| arm.crossing(p, level * target)).expect("it rises");
    let mut settled = 0.0;
    for piece in arm.pieces() {
        for level in [0.99, 1.01] {
            settled = arm.crossing(&piece, level * target).map_or(settled, |t: f64| t.max(settled));
        }
    }
    [first(0.9) - first(0.1), settled, response.trace("theta").unwrap().maximum().0.to_degrees()]
}

#[test]
fn the_loop_has_its_published_figures_before_and_after_retuning() {
    // Thesis: 0.41 s, 1.11 s, 5.86 deg and 0.54 s, 1.2 s, 3 deg; further digits from an independent integration
    // (SciPy).
    let rows = [
        ("nonlinear", PLACED, [0.40574, 1.11124, 5.86290], 0.0169),
        ("nonlinear", RETUNED, [0.54462, 1.19512, 3.00033], 0.0047),
        ("linear", PLACED, [0.40805, 1.09725, 5.90134], 0.0169),
        ("linear", RETUNED, [0.54790, 1.46271, 3.00093], 0.0047),
    ];
    for (plant, gains, expected, torque) in rows {
        let response = run(plant, gains);
        // The linear figures are those of the printed, rounded matrices.
        let tolerance = if plant == "linear" { 1e-3 } else { 6e-6 };
        for (value, expected) in figures(&response).into_iter().zip(expected) {
            assert!((value - expected).abs() < tolerance, "{plant} {gains:?}: {value} is not {expected}");
        }
        let u = response.trace("u").unwrap();
        let largest = u.maximum().0.max(-u.minimum().0);
        assert!((largest - torque).abs() < 2e-4, "{largest}");
        assert!(response.events.is_empty(), "the torque never reaches its limit");
    }
}

#[test]
fn a_limited_torque_stays_within_its_limit() {
    let options = "horizon = 5.0\ntolerance = { relative = 1e-13, absolute = 1e-15 }";
    let model = toml::from_str::<FurutaStateFeedbackOptions>(options).unwrap().build().unwrap();
    let limited: Vec<_> = [("limit", 0.016)].into_iter().chain(values(PLACED)).collect();
    let response = respond(model.as_ref(), &Case::default(), &limited, 5.0);
    let u = response.trace("u").unwrap();
    assert!(u.maximum().0 <= 0.016 + 1e-9 && u.minimum().0 >= -0.016 - 1e-9);
    assert_eq!(response.events[0].what, "torque reaches its limit");
    let arm = response.trace("phi").unwrap().last().to_degrees();
    assert!((arm - 30.0).abs() < 1.0, "it gets there all the same: {arm}");
    // Springs and dampers large enough to be visible in differences.
    let elements = [("c1", 1e-2), ("d1", 2e-3), ("c2", 1e-2), ("d2", 2e-3)];
    let damped: Vec<_> = elements.into_iter().chain(limited).collect();
    check_tangents_by(5e-6, model.as_ref(), &Case::default(), &damped, 2.0);
}

#[test]
fn the_linear_pendulum_falls_with_its_unstable_pole() {
    // Poles of A in the thesis: 6.739 is the unstable one, which eventually dominates.
    let model = toml::from_str::<FurutaLinearOptions>("horizon = 2.0").unwrap().build().unwrap();
    let start: Vec<_> = PLANT.into_iter().filter(|(name, _)| *name != "setpoint").chain([("theta0", 1e-3)]).collect();
    let response = respond(model.as_ref(), &Case::default(), &start, 2.0);
    let theta = response.trace("theta").unwrap();
    let pole = math::ln(theta.at(1.9) / theta.at(1.8)) / 0.1;
    assert!((pole - 6.739).abs() < 1e-3, "{pole}");
}

/// Returns `A` (rows of the rates) and `B` of a model upright at rest.
fn linearised(model: &dyn Model, given: &[(&str, f64)]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let parameters = values_of(model, given);
    let states = vec![0.0; model.equation_states().len()];
    let at = OperatingPoint { parameters: &parameters, states: &states, inputs: &[0.0], past: &[], at_rest: false };
    let local = model.local(&at).expect("it can be linearised").expect("it is defined");
    let n = states.len();
    (
        (0..n).map(|i| (0..n).map(|j| local.slopes[(i, j)]).collect()).collect(),
        local.slopes.column(n).as_slice()[..n].to_vec(),
    )
}

#[test]
fn the_linearised_pendula_have_the_matrices_of_the_thesis() {
    let linear = toml::from_str::<FurutaLinearOptions>("").unwrap().build().unwrap();
    let plant: Vec<_> = PLANT.into_iter().filter(|(name, _)| *name != "setpoint").collect();
    let (a, b) = linearised(linear.as_ref(), &plant);
    // Section 5.2; linearised by finite differences, accurate to 2e-4.
    let printed = [[-0.1082, 0.0, -25.4814, 0.0255], [0.0756, 0.0, 45.7597, -0.0458]];
    for (row, printed) in [&a[1], &a[3]].into_iter().zip(printed) {
        for (value, printed) in row.iter().zip(printed) {
            assert!((value - printed).abs() < 2e-4, "{value} is not {printed}");
        }
    }
    assert!((b[1] - 1444.1).abs() < 0.06 && (b[3] + 1008.5).abs() < 0.06, "{b:?}");
    // The rigid bodies with the rounded values of table 4.5.
    let rods = [("J", 0.000464), ("Ja", 0.000227), ("m", 0.015102), ("l", 0.170544)];
    let bodies = toml::from_str::<Furuta2JointOptions>("").unwrap().build().unwrap();
    let (a, b) = linearised(bodies.as_ref(), &rods);
    for (value, printed, digit) in
        [(a[1][2], -25.4826, 6e-5), (a[3][2], 45.7750, 6e-5), (b[1], 1443.7, 0.06), (b[3], -1008.6, 0.06)]
    {
        assert!((value - printed).abs() < digit, "{value} is not {printed}");
    }
}
