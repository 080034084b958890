//! The simulator compared with closed forms.

use mops_math as math;

use mops_testbed::{Dry, Installed, Law, Plant, Setup, Spot, base_states, outputs, plants};

fn plant(name: &str) -> &'static Plant {
    plants().iter().find(|plant| plant.name == name).expect("the plant exists")
}

/// Returns an experiment of about 1 s with one constant input.
fn setup(dt: f64, samples: usize, start: &[f64], input: impl Fn(usize) -> f64) -> Setup {
    Setup { dt, samples, start: start.to_vec(), inputs: vec![(0..samples).map(input).collect()] }
}

fn run(plant: &Plant, p: &[f64], setup: &Setup, law: Law, spot: Spot) -> Vec<f64> {
    outputs(plant, p, setup, 0, &[Installed { law, spot }]).expect("the simulation does not diverge").remove(0)
}

fn dry(slide: f64, hold: f64) -> Law {
    Law { dry: Some(Box::new(move |_, _| Dry { slide, hold })), ..Law::default() }
}

#[test]
fn a_dropped_ball_with_quadratic_drag_falls_as_the_logarithm_of_a_hyperbolic_cosine() {
    let (k, g) = (0.05, 9.81_f64);
    let law = Law { force: Some(Box::new(move |at| -k * at.v * at.v.abs())), ..Law::default() };
    let y = run(plant("ball"), &[0.0], &setup(0.01, 151, &[20.0, 0.0], |_| 0.0), law, Spot::Place(0));
    for (i, y) in y.iter().enumerate() {
        let t = 0.01 * i as f64;
        let exact = 20.0 - math::ln(math::cosh(t * (g * k).sqrt())) / k;
        assert!((y - exact).abs() < 1e-9, "{y} at {t} s, not {exact}");
    }
}

#[test]
fn a_shaft_with_dry_friction_stops_where_its_energy_is_used_up_and_rests_to_the_last_bit() {
    let (inertia, speed, torque) = (0.002, 3.0, 0.013);
    let q = run(
        plant("servo"),
        &[inertia, 0.0],
        &setup(0.01, 100, &[0.5, speed], |_| 0.0),
        dry(torque, torque),
        Spot::Place(0),
    );
    let (stop, angle) = (inertia * speed / torque, 0.5 + inertia * speed * speed / (2.0 * torque));
    for (i, q) in q.iter().enumerate() {
        let t = (0.01 * i as f64).min(stop);
        assert!((q - (0.5 + speed * t - 0.5 * torque / inertia * t * t)).abs() < 1e-10);
    }
    assert!((q[99] - angle).abs() < 1e-10);
    let rest = (stop / 0.01).ceil() as usize + 1;
    assert!(q[rest..].iter().all(|&at| at == q[99]), "the shaft creeps");
}

#[test]
fn stiction_breaks_away_at_its_level_and_slides_at_the_lower_one() {
    // 0.052 N m/A: 0.1 A is below the breakaway level of 0.006 N m, 0.12 A above it.
    let (inertia, slide, hold) = (0.002, 0.003, 0.006);
    let current = |k: usize| if k < 50 { 0.1 } else { 0.12 };
    let q =
        run(plant("servo"), &[inertia, 0.0], &setup(0.01, 81, &[0.2, 0.0], current), dry(slide, hold), Spot::Place(0));
    assert!(q[..=50].iter().all(|&q| q == 0.2), "the joint moves below the breakaway level");
    let exact = 0.2 + 0.5 * (0.052 * 0.12 - slide) / inertia * math::powi(0.3, 2);
    assert!((q[80] - exact).abs() < 1e-10, "{} instead of {exact}", q[80]);
}

#[test]
fn a_spring_with_dry_friction_loses_the_same_amplitude_in_every_half_swing() {
    // m x'' = -k x - c sgn v: the amplitude decreases by 2 c/k per half swing, until c balances k x.
    let (m, k, c, start) = (1.0, 100.0_f64, 0.5, 0.0473);
    let half = std::f64::consts::PI * (m / k).sqrt();
    let x =
        run(plant("spring"), &[m, 0.0, k], &setup(half / 50.0, 401, &[start, 0.0], |_| 0.0), dry(c, c), Spot::Place(0));
    let turns = [start, -(start - 2.0 * c / k), start - 4.0 * c / k, -(start - 6.0 * c / k), start - 8.0 * c / k];
    for (i, turn) in turns.iter().enumerate().take(5) {
        assert!((x[50 * i] - turn).abs() < 1e-7, "half swing {i}: {} instead of {turn}", x[50 * i]);
    }
    assert_eq!(x[300], x[400]);
}

#[test]
fn a_swing_without_friction_takes_the_time_of_the_elliptic_integral() {
    // T = 2 pi sqrt(L/g)/agm(1, cos(th0/2)).
    let (length, start) = (0.7_f64, 2.2_f64);
    let (mut a, mut b) = (1.0, math::cos(start / 2.0));
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
    }
    let period = std::f64::consts::TAU * (length / 9.81).sqrt() / a;
    let th = run(
        plant("pendulum"),
        &[length, 0.0],
        &setup(period / 200.0, 601, &[start, 0.0], |_| 0.0),
        Law::default(),
        Spot::Place(0),
    );
    for turn in [200, 400, 600] {
        assert!((th[turn] - start).abs() < 1e-8, "{}", th[turn]);
        assert!((th[turn - 100] + start).abs() < 1e-8);
    }
}

#[test]
fn pendulums_on_arms_and_trolleys_keep_their_energy_without_friction() {
    let all = [0, 1, 2, 3];
    let (a, b, c, d) = (0.005, 0.009, 0.004, 0.24);
    let free = setup(0.01, 400, &[1.2, 0.3, 0.1, -0.8], |_| 0.0);
    let x = base_states(plant("furuta-driven"), &[a, b, c, d, 0.0, 0.0], &free.start, &free, (20, &all)).unwrap();
    let energy = |k: usize| {
        let (th, thd, phd) = (x[0][k], x[1][k], x[3][k]);
        0.5 * a * thd * thd
            + c * thd * phd * math::cos(th)
            + 0.5 * (b + a * math::powi(math::sin(th), 2)) * phd * phd
            + d * math::cos(th)
    };
    assert!((0..400).all(|k| (energy(k) / energy(0) - 1.0).abs() < 1e-7));

    let (trolley, load, length) = (2.0, 0.8, 0.6);
    let free = setup(0.01, 400, &[0.0, 0.3, 1.1, 0.0], |_| 0.0);
    let x = base_states(plant("crane"), &[trolley, load, length, 0.0], &free.start, &free, (20, &all)).unwrap();
    let energy = |k: usize| {
        let (v, th, w) = (x[1][k], x[2][k], x[3][k]);
        let across = v + length * w * math::cos(th);
        let up = length * w * math::sin(th);
        0.5 * trolley * v * v + 0.5 * load * (across * across + up * up) - load * 9.81 * length * math::cos(th)
    };
    assert!((0..400).all(|k| (energy(k) - energy(0)).abs() < 1e-7));
}

#[test]
fn a_fractional_delay_ends_a_step_where_the_command_changes() {
    let (inertia, delay) = (0.002, 0.0234);
    let step = setup(0.01, 60, &[0.0, 0.0], |k| if k < 10 { 0.0 } else { 0.3 });
    let q = run(plant("servo"), &[inertia, 0.0], &step, Law { delay, ..Law::default() }, Spot::Actuator(0));
    for (k, q) in q.iter().enumerate() {
        let t = (0.01 * k as f64 - 0.1 - delay).max(0.0);
        assert!((q - 0.5 * 0.052 * 0.3 / inertia * t * t).abs() < 1e-10);
    }
}

#[test]
fn a_delayed_sensor_shows_earlier_values() {
    let fall = setup(0.01, 80, &[5.0, 3.0], |_| 0.0);
    let y = run(plant("ball"), &[0.0], &fall, Law { delay: 0.0377, ..Law::default() }, Spot::Sensor(0));
    // The flight starts one delay before the first sample.
    for (k, y) in y.iter().enumerate() {
        let t = 0.01 * k as f64;
        assert!((y - (5.0 + 3.0 * t - 0.5 * 9.81 * t * t)).abs() < 1e-5);
    }
}

#[test]
fn a_leaking_mass_accelerates_with_the_logarithm_of_the_remaining_mass() {
    let (mass, rate, force) = (3.0, 0.8, 5.0);
    let law = Law { parameters: Some(Box::new(move |t, p| p[0] -= rate * t)), ..Law::default() };
    let x = run(plant("axis"), &[mass, 0.0], &setup(0.01, 201, &[0.0, 0.0], |_| force), law, Spot::Place(0));
    // v = F/r ln(m0/m), x its integral.
    let left = mass - rate * 2.0;
    let exact = force / (rate * rate) * (rate * 2.0 + left * math::ln(left / mass));
    assert!((x[200] - exact).abs() < 1e-9, "{} instead of {exact}", x[200]);
}

#[test]
fn a_first_order_lag_answers_a_step_with_an_exponential() {
    let time = 0.2;
    let lag = Law {
        states: vec![0.0],
        rates: Some(Box::new(move |at, dz| dz[0] = (at.q - at.z[0]) / time)),
        actuate: Some(Box::new(|at, _| at.z[0])),
        ..Law::default()
    };
    let q = run(plant("servo"), &[0.002, 0.0], &setup(0.01, 101, &[0.0, 0.0], |_| 0.3), lag, Spot::Actuator(0));
    let t = 1.0_f64;
    let exact = 0.052 * 0.3 / 0.002 * (0.5 * t * t - time * t + time * time * (1.0 - math::exp(-t / time)));
    assert!((q[100] - exact).abs() < 1e-8);
}
