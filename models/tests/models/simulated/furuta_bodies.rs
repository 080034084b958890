//! Pendula with two and three joints, compared with a Newton-Euler derivation and published trajectories.

use std::f64::consts::PI;

use mops_core::{Case, Instant, Model, ModelOptions, Response, Trace};
use mops_math as math;
use mops_models::furuta_2_joint::Furuta2JointOptions;
use mops_models::furuta_3_joint::Furuta3JointOptions;
use nalgebra::{DMatrix, DVector};

use super::{check_tangents_by, respond, values};

/// Inertias J and Ja (kg m2), mass (kg), distance of the centre of mass and length of the arm (m), gravity (m/s2).
type Rods = [f64; 6];

/// Parameters of table 4.5 of the thesis.
const TWO_RODS: Rods = [0.000464, 0.000227, 0.015102, 0.170544, 0.245, 9.81];
const TWO_FRICTION: [(&str, f64); 6] = [
    ("tau11", 0.005485),
    ("tau21", 0.001670),
    ("tau12", 0.005420),
    ("tau22", 0.001443),
    ("peak1", 1.249996),
    ("peak2", 1.228720),
];

/// Parameters of table 4.6 of the thesis.
const THREE_RODS: Rods = [0.001082, 0.001656, 0.040414, 0.238454, 0.245, 9.81];
const SPRING: f64 = 3.81909;
const DAMPER: f64 = 0.010007;
const THREE_FRICTION: [(&str, f64); 13] = [
    ("tau11", 0.005055),
    ("tau21", 0.004626),
    ("tau12", 0.034065),
    ("tau22", 0.003449),
    ("tau01", 0.010220),
    ("tau05", 0.020867),
    ("point0", 0.130807),
    ("point1", 0.468552),
    ("point2", 9.011384),
    ("peak1", 1.000119),
    ("peak2", 1.228720),
    ("c", SPRING),
    ("d", DAMPER),
];

const TOLERANCE: &str = "tolerance = { relative = 1e-12, absolute = 1e-14 }";

fn two() -> Box<dyn Model> {
    toml::from_str::<Furuta2JointOptions>(TOLERANCE).unwrap().build().unwrap()
}

fn three() -> Box<dyn Model> {
    toml::from_str::<Furuta3JointOptions>(TOLERANCE).unwrap().build().unwrap()
}

fn named(rods: Rods) -> [(&'static str, f64); 6] {
    let [inertia, arm, m, l, r, g] = rods;
    [("J", inertia), ("Ja", arm), ("m", m), ("l", l), ("r", r), ("g", g)]
}

fn start([phi, dphi, theta, dtheta]: [f64; 4]) -> [(&'static str, f64); 4] {
    [("phi0", phi), ("dphi0", dphi), ("theta0", theta), ("dtheta0", dtheta)]
}

/// Pendulum with frictionless bearings and `N` joints, on which torques act.
struct Bodies<const N: usize> {
    model: Box<dyn Model>,
    parameters: Vec<f64>,
}

fn two_bodies(rods: Rods) -> Bodies<2> {
    Bodies { parameters: values(two().as_ref(), &[&named(rods)[..], &start([0.0; 4])].concat()), model: two() }
}

fn three_bodies(rods: Rods, spring: f64, damper: f64) -> Bodies<3> {
    let tilt = [("c", spring), ("d", damper), ("psi0", 0.0), ("dpsi0", 0.0)];
    let given = [&named(rods)[..], &tilt, &start([0.0; 4])].concat();
    Bodies { parameters: values(three().as_ref(), &given), model: three() }
}

impl<const N: usize> Bodies<N> {
    /// Returns the accelerations under these torques at angles `q` and speeds `w`.
    fn accelerations(&self, q: &[f64; N], w: &[f64; N], torques: &[f64]) -> DVector<f64> {
        let ported = self.model.ported().expect("torques can act on its joints");
        let mut plant = ported.plant(&self.parameters).expect("it is defined");
        let x: Vec<f64> = q.iter().zip(w).flat_map(|(&q, &w)| [q, w]).collect();
        let at = Instant { t: 0.0, x: &x, u: &[0.0], w: torques };
        plant.settle(&at);
        let mut rates = x.clone();
        plant.rates(&at, &mut rates);
        DVector::from_fn(N, |i, _| rates[2 * i + 1])
    }

    /// Returns the mass matrix and the torques without bearing friction. A unit torque on a joint adds a column of the
    /// inverse mass matrix to the accelerations.
    fn mass_and_force(&self, q: &[f64; N], w: &[f64; N]) -> (DMatrix<f64>, DVector<f64>) {
        let free = self.accelerations(q, w, &[0.0; N]);
        let mut inverse = DMatrix::zeros(N, N);
        for joint in 0..N {
            let mut torques = vec![0.0; N];
            torques[joint] = 1.0;
            inverse.set_column(joint, &(self.accelerations(q, w, &torques) - &free));
        }
        let mass = inverse.try_inverse().expect("the mass matrix is regular");
        let force = &mass * free;
        (mass, force)
    }
}

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
}

#[test]
fn mass_matrix_and_forces_have_their_published_values() {
    // REFERENCE: the Lagrange equations evaluated at this point by a computer algebra system.
    let (q, w) = ([0.1, 2.0, 0.05], [0.5, -3.0, 0.7]);
    let (mass, force) = two_bodies(TWO_RODS).mass_and_force(&[q[0], q[1]], &[w[0], w[1]]);
    for (value, expected) in [
        (mass[(0, 0)], 0.001_880_320_659),
        (mass[(0, 1)], -0.000_262_593_271),
        (mass[(1, 1)], 0.000_903_245_535),
        (-force[0], -0.004_138_623_169),
        (-force[1], -0.022_889_042_734),
    ] {
        near(value, expected, 1e-12);
    }
    let (mass, force) = three_bodies(THREE_RODS, SPRING, DAMPER).mass_and_force(&q, &w);
    for (value, expected) in [
        (mass[(0, 0)], 0.007_113_936_166),
        (mass[(0, 1)], -0.001_051_520_25),
        (mass[(0, 2)], -0.003_180_681_636),
        (mass[(1, 1)], 0.003_371_509_731),
        (mass[(1, 2)], 0.0),
        (mass[(2, 2)], 0.003_379_952_573),
        (-force[0], -0.016_451_722_21),
        (-force[1], -0.085_810_116_664),
        (-force[2], 0.196_638_150_566),
    ] {
        near(value, expected, 1e-12);
    }
}

type Vector = [f64; 3];

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn times(factor: f64, a: Vector) -> Vector {
    a.map(|x| factor * x)
}

/// Returns `a` rotated by `angle` about `axis` (Rodrigues' formula).
fn turned(a: Vector, axis: Vector, angle: f64) -> Vector {
    let (sin, cos) = math::sin_cos(angle);
    plus(plus(times(cos, a), times(sin, cross(axis, a))), times((1.0 - cos) * dot(axis, a), axis))
}

/// Returns the joint torques for accelerations `a`, by the Newton-Euler recursion in world coordinates. The axis y
/// points up and the arm along -x. The pendulum turns about the arm's x by theta, then about its own z by psi; its rod
/// is along its y.
fn newton_euler([inertia, arm, m, l, r, g]: Rods, q: Vector, w: Vector, a: Vector) -> Vector {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let axis1 = y;
    let axis2 = turned(x, y, q[0]);
    let axis3 = turned(turned(z, y, q[0]), axis2, q[1]);
    let along = |v: Vector| turned(turned(turned(v, y, q[0]), axis2, q[1]), axis3, q[2]);
    // Forward recursion: angular velocities and accelerations, then the acceleration of the centre of mass.
    let (w1, a1) = (times(w[0], axis1), times(a[0], axis1));
    let w2 = plus(w1, times(w[1], axis2));
    let a2 = plus(a1, plus(times(a[1], axis2), cross(w1, times(w[1], axis2))));
    let w3 = plus(w2, times(w[2], axis3));
    let a3 = plus(a2, plus(times(a[2], axis3), cross(w2, times(w[2], axis3))));
    let end = times(-r, axis2);
    let centre = times(l, along(y));
    let acceleration =
        plus(plus(cross(a1, end), cross(w1, cross(w1, end))), plus(cross(a3, centre), cross(w3, cross(w3, centre))));
    // Backward recursion: the force at the centre of mass, the moment about it, and the joint torques.
    let force = times(m, plus(acceleration, times(g, y)));
    let spin = |v: Vector| {
        let (ex, ez) = (along(x), along(z));
        plus(times(inertia * dot(v, ex), ex), times(inertia * dot(v, ez), ez))
    };
    let about_centre = plus(spin(a3), cross(w3, spin(w3)));
    let about_pivot = plus(about_centre, cross(centre, force));
    let about_origin = plus(about_pivot, cross(end, force));
    [dot(axis1, about_origin) + arm * a[0], dot(axis2, about_pivot), dot(axis3, about_pivot)]
}

#[test]
fn the_equations_agree_with_newton_and_euler_in_any_state() {
    let bodies = three_bodies(THREE_RODS, 0.0, 0.0);
    let planar = two_bodies(TWO_RODS);
    // Kronecker sequence: 1000 points distributed over the box of states.
    let spread = |k: usize, i: usize| {
        let step = [2.0_f64, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0][i].sqrt();
        #[allow(clippy::cast_precision_loss)]
        let place = (k as f64 * step).fract();
        2.0 * place - 1.0
    };
    for k in 1..=1000 {
        let q: Vector = std::array::from_fn(|i| PI * spread(k, i));
        let w: Vector = std::array::from_fn(|i| 10.0 * spread(k, 3 + i));
        let a: Vector = std::array::from_fn(|i| 100.0 * spread(k, 6 + i));
        let expected = newton_euler(THREE_RODS, q, w, a);
        let (mass, force) = bodies.mass_and_force(&q, &w);
        for i in 0..3 {
            // The torques are of the order of 1 N m.
            near(dot([0, 1, 2].map(|j| mass[(i, j)]), a) - force[i], expected[i], 1e-12);
        }
        let (q, w, a) = ([q[0], q[1], 0.0], [w[0], w[1], 0.0], [a[0], a[1], 0.0]);
        let expected = newton_euler(TWO_RODS, q, w, a);
        let (mass, force) = planar.mass_and_force(&[q[0], q[1]], &[w[0], w[1]]);
        for i in 0..2 {
            near(mass[(i, 0)] * a[0] + mass[(i, 1)] * a[1] - force[i], expected[i], 1e-12);
        }
    }
}

/// Returns kinetic and potential energy at `t`, J: half `w' M w`, height of the centre of mass, and spring. The columns
/// of the Newton-Euler mass matrix are the torques of unit accelerations at rest.
fn energy(rods: Rods, spring: f64, response: &Response, t: f64) -> f64 {
    let read = |name: &str| response.trace(name).map_or(0.0, |trace| trace.at(t));
    let q = [read("phi"), read("theta"), read("psi")];
    let w = [read("dphi"), read("dtheta"), read("dpsi")];
    let [inertia, arm, m, l, r, g] = rods;
    let weightless = [inertia, arm, m, l, r, 0.0];
    0.5 * dot(w, newton_euler(weightless, q, [0.0; 3], w))
        + m * g * l * math::cos(q[1]) * math::cos(q[2])
        + 0.5 * spring * q[2] * q[2]
}

#[test]
fn without_friction_the_pendula_keep_their_energy() {
    let begin = start([-0.0026, -0.036, 1.6775, 1.64]);
    let planar: Vec<_> = named(TWO_RODS).into_iter().chain(begin).collect();
    let response = respond(two().as_ref(), &Case::default(), &planar, 3.0);
    check_energy(TWO_RODS, 0.0, &response);
    let spatial: Vec<_> = named(THREE_RODS).into_iter().chain(begin).chain([("psi0", 0.05), ("c", SPRING)]).collect();
    let response = respond(three().as_ref(), &Case::default(), &spatial, 3.0);
    check_energy(THREE_RODS, SPRING, &response);
    assert!(response.trace("psi").unwrap().maximum().0 > 0.02, "the tilt takes part");
}

/// Checks that the energy drift over 3 s is below 1e-9 of `m g l`.
fn check_energy(rods: Rods, spring: f64, response: &Response) {
    let [_, _, m, l, _, g] = rods;
    let first = energy(rods, spring, response, 0.0);
    for i in 0..=300 {
        let drift = (energy(rods, spring, response, f64::from(i) * 0.01) - first) / (m * g * l);
        assert!(drift.abs() < 1e-9, "{drift:e} after {i} hundredths of a second");
    }
}

/// Returns times and values of the turning points of a trace, from `from` on.
fn turning_points(trace: &Trace, from: f64) -> Vec<(f64, f64)> {
    let pieces: Vec<_> = trace.pieces().into_iter().filter(|p| (p.value[1] - p.value[0]).abs() > 1e-12).collect();
    let turns = |pair: &[mops_core::trace::Piece]| {
        let [before, after] = [&pair[0], &pair[1]].map(|p| p.value[1] > p.value[0]);
        (before != after && pair[0].time[1] > from).then_some((pair[0].time[1], pair[0].value[1]))
    };
    pieces.windows(2).filter_map(turns).collect()
}

/// Published turning points of theta, range of the arm, and final values.
struct Swing {
    turns: &'static [(f64, f64)],
    arm: [f64; 2],
    end: &'static [(&'static str, f64)],
}

fn check_swing(response: &Response, swing: &Swing) {
    let turns = turning_points(response.trace("theta").unwrap(), 0.3);
    assert_eq!(turns.len(), swing.turns.len(), "{turns:?}");
    // Published as samples at 0.01 s: the turning point is up to one sample away.
    for ((t, _), &(sample, expected)) in turns.into_iter().zip(swing.turns) {
        near(t, sample, 0.0101);
        near(response.trace("theta").unwrap().at(sample), expected, 6e-5);
    }
    let arm = response.trace("phi").unwrap();
    near(arm.minimum().0, swing.arm[0], 6e-4);
    near(arm.maximum().0, swing.arm[1], 6e-4);
    for &(signal, expected) in swing.end {
        near(response.trace(signal).unwrap().last(), expected, 3e-6);
    }
}

#[test]
fn two_joints_swing_as_published() {
    let swing = |begin| {
        let values: Vec<_> = named(TWO_RODS).into_iter().chain(TWO_FRICTION).chain(start(begin)).collect();
        respond(two().as_ref(), &Case::default(), &values, 3.0)
    };
    let calibration = swing([-0.071575, -0.083589, 1.671170, 1.870203]);
    check_swing(
        &calibration,
        &Swing {
            turns: &[(0.57, 4.5030), (1.18, 1.9920), (1.77, 4.0800), (2.34, 2.4388), (2.90, 3.6188)],
            arm: [-0.4270, 0.4302],
            end: &[("phi", -0.111_863_77), ("theta", 3.564_126_66)],
        },
    );
    let validation = swing([-0.100236, -1.620246, -1.940164, -7.661688]);
    check_swing(
        &validation,
        &Swing {
            turns: &[(0.50, -5.2366), (1.25, -1.2451), (1.96, -4.8574), (2.64, -1.6017)],
            arm: [-1.111, -0.100],
            end: &[("phi", -0.984_041_67), ("theta", -3.297_631_23)],
        },
    );
    // The friction table of the pendulum falls below zero at 7.357 rad/s: 0.001670/(0.001670 - 0.001443).
    let event =
        validation.events.iter().find(|e| e.what.starts_with("pendulum driven")).expect("the event is reported");
    near(validation.trace("dtheta").unwrap().at(event.time).abs(), 0.001670 / 0.000227, 1e-6);
}

#[test]
fn three_joints_swing_as_published() {
    let swing = |begin| {
        let values: Vec<_> = named(THREE_RODS).into_iter().chain(THREE_FRICTION).chain(start(begin)).collect();
        respond(three().as_ref(), &Case::default(), &values, 3.0)
    };
    let calibration = swing([-0.002626, -0.0362232, 1.677478, 1.640014]);
    check_swing(
        &calibration,
        &Swing {
            turns: &[(0.58, 4.4754), (1.20, 2.0295), (1.78, 4.0354), (2.33, 2.4525), (2.89, 3.6213)],
            arm: [-0.4423, 0.4994],
            end: &[("phi", -0.136_635_70), ("theta", 3.557_918_71), ("psi", -0.005_361_12)],
        },
    );
    let tilt = calibration.trace("psi").unwrap();
    near(tilt.maximum().0.max(-tilt.minimum().0), 0.063, 6e-4);
    let validation = swing([-0.106993, -1.340885, -1.785922, -10.443861]);
    check_swing(
        &validation,
        &Swing {
            turns: &[(0.50, -5.3564), (1.29, -1.3145), (1.97, -4.6428), (2.61, -1.8298)],
            arm: [-1.245, -0.107],
            end: &[("phi", -1.060_337_48), ("theta", -3.570_398_74), ("psi", -0.014_539_54)],
        },
    );
    let tilt = validation.trace("psi").unwrap();
    near(tilt.maximum().0.max(-tilt.minimum().0), 0.214, 6e-4);
}

#[test]
fn tangents_of_the_pendula_are_their_derivatives() {
    let begin = start([-0.071575, -0.083589, 1.671170, 1.870203]);
    let values: Vec<_> = named(TWO_RODS).into_iter().chain(TWO_FRICTION).chain(begin).collect();
    check_tangents_by(1e-5, two().as_ref(), &Case::default(), &values, 3.0);
    let values: Vec<_> = named(THREE_RODS).into_iter().chain(THREE_FRICTION).chain(begin).collect();
    check_tangents_by(1e-5, three().as_ref(), &Case::default(), &values, 3.0);
}
