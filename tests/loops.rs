//! Models that take another one as their base, and loops cut at a variable, compared with loops written by hand.

use assert_cmd::cargo::cargo_bin_cmd;
use mops_linear::Complex;
use mops_math as math;
use mops_math::complex;
use serde_json::Value;

#[path = "common/studies.rs"]
mod studies;

use studies::{run, value};

fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    std::fs::write(&study, text).unwrap();
    let output = cargo_bin_cmd!("mops").args(["check", study.to_str().unwrap()]).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{text}");
    String::from_utf8(output.stderr).unwrap()
}

/// Criteria of an open loop in the model `name`.
fn criteria(name: &str) -> String {
    ["phase-margin", "gain-margin", "maximum-sensitivity", "crossover-frequency", "delay-margin"]
        .map(|kind| format!("{name}-{kind} = {{ model = '{name}', {kind} = {{}}, usage = 'monitor' }}\n"))
        .concat()
}

/// Asserts that both models have the same margins in a case.
fn assert_same(result: &Value, case: &str) {
    for kind in ["phase-margin", "gain-margin", "maximum-sensitivity", "crossover-frequency", "delay-margin"] {
        let [cut, by_hand] = ["cut", "by-hand"].map(|name| value(result, case, &format!("{name}-{kind}")));
        assert!((cut - by_hand).abs() <= 1e-9 * by_hand.abs(), "{kind} in {case}: {cut} {by_hand}");
    }
}

#[test]
fn the_margins_of_a_cut_loop_are_those_of_the_loop_written_by_hand() {
    // A motor with a flexible coupling and a cascade of two controllers; the amplifier is limited and its integrator
    // tracks it.
    let servo = "
        [study]
        name = 'servo'
        [models.servo.equations]
        states = { i = 'A', wm = 'rad/s', tw = 'rad', wl = 'rad/s', xv = 'A', xc = 'V' }
        inputs = { r = 'rad/s' }
        parameters = { Jl = 'kg m2' }
        constants = { R = '0.6 ohm', L = '0.8 mH', K = '0.06 N m/A', Jm = '8e-5 kg m2', ks = '8 N m/rad', cs = '4e-3 N m s', kv = '0.05 A s', Tv = '50 ms', kc = '2 V/A', Tc = '5 ms' }
        horizon = '0.5 s'
        let = { ts = 'ks*tw + cs*(wm - wl)', ref = 'kv*(r - wm) + xv', v = 'kc*(ref - i) + xc', u = 'clip(v, -24 [V], 24 [V])', ua = 'u' }
        outputs = { u = { value = 'u', unit = 'V' } }
        [models.servo.equations.der]
        i = \"L*i' = ua - R*i - K*wm\"
        wm = \"Jm*wm' = K*i - ts\"
        tw = 'wm - wl'
        wl = \"Jl*wl' = ts\"
        xv = \"Tv*xv' = kv*(r - wm)\"
        xc = \"Tc*xc' = kc*(ref - i) + u - v\"
        [models.cut]
        like = 'servo'
        open = 'ua'
        [models.by-hand]
        like = 'servo'
        linearise = { inputs = ['uc'], outputs = ['back'] }
        equations.inputs = { uc = 'V' }
        equations.outputs = { back = { value = '-v', unit = 'V' } }
        equations.der = { i = \"L*i' = uc - R*i - K*wm\", xc = \"Tc*xc' = kc*(ref - i)\" }
        [cases]
        light = { Jl = 0.8e-4, inputs.r.step.after = 1.0 }
        heavy = { Jl = 3.2e-4, inputs.r.step.after = 1.0 }
        [criteria]
        peak = { model = 'servo', peak = { signal = 'wl' }, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), &[servo, &criteria("cut"), &criteria("by-hand")].concat());
    assert_same(&result, "light");
    assert_same(&result, "heavy");
}

#[test]
fn the_loop_of_a_pid_controller_is_cut_at_its_output() {
    for (integral, derivative) in [("2 s", "0.4 s"), ("2 s", "0 s"), ("inf", "0.4 s")] {
        let text = format!(
            "[study]\nname = 'pid'
            [models.loop]
            pid-loop = {{ plant = {{ poles = [-1, -0.5, -2], gain = 2 }}, horizon = '20 s', limit = [-4, 4] }}
            parameters = {{ k = 1.2, Ti = '{integral}', Td = '{derivative}' }}
            [models.cut]
            like = 'loop'
            open = 'u'
            [models.by-hand]
            pid-open-loop = {{ plant = {{ poles = [-1, -0.5, -2], gain = 2 }} }}
            parameters = {{ k = 1.2, Ti = '{integral}', Td = '{derivative}' }}
            [criteria]\n{}{}",
            criteria("cut"),
            criteria("by-hand"),
        );
        let folder = tempfile::tempdir().unwrap();
        assert_same(&run(folder.path(), &text), "nominal");
    }
    let sampled = refused(
        "[study]\nname = 'sampled'
        [models.loop]
        pid-loop = { plant = { poles = [-1], gain = 1 }, horizon = '1 s', sample-time = '10 ms' }
        open = 'u'
        parameters = { k = 1, Ti = '1 s', Td = 0 }
        [criteria]\nmargin = { phase-margin = {}, usage = 'monitor' }",
    );
    assert!(sampled.contains("sampled controller") && sampled.contains("`pid` that has `every`"), "{sampled}");
}

#[test]
fn a_limited_controller_of_equations_is_cut_within_its_limits() {
    // P = sat(k (r - T) + k/Ti integral) in front of C T' = P - G (T - Tu): L = k (1 + 1/(Ti s))/(C s + G), by hand.
    let text = "[study]\nname = 'oven'
        [models.loop.equations]
        states = { T = 'degC' }
        inputs = { P = 'kW', r = 'degC' }
        constants = { C = '20 kJ/K', G = '0.5 kW/K', Tu = '15 degC' }
        der = { T = \"C*T' = P - G*(T - Tu)\" }
        start = { T = '15 degC' }
        horizon = '200 s'
        pid.P = { setpoint = 'r', measured = 'T', k = '2 kW/K', Ti = '8 s', limit = [0, 60] }
        [models.cut]
        like = 'loop'
        open = 'P'
        [models.before-the-limit]
        like = 'loop'
        open = 'P_unlimited'
        [models.by-hand]
        transfer-function = { numerator = [16e3, 2e3], denominator = [160e3, 4e3, 0] }
        [cases.a]
        inputs.r = '60 degC'
        [criteria]
        unlimited = { model = 'before-the-limit', phase-margin = {}, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    let margins =
        |name: &str| criteria(name).lines().filter(|line| !line.contains("gain-margin")).collect::<Vec<_>>().join("\n");
    let result = run(folder.path(), &[text, &margins("cut"), "\n", &margins("by-hand")].concat());
    for kind in ["phase-margin", "maximum-sensitivity", "crossover-frequency", "delay-margin"] {
        let [cut, by_hand] = ["cut", "by-hand"].map(|name| value(&result, "a", &format!("{name}-{kind}")));
        assert!((cut - by_hand).abs() <= 1e-8 * by_hand.abs(), "{kind}: {cut} {by_hand}");
    }
    assert!((value(&result, "a", "unlimited") - value(&result, "a", "by-hand-phase-margin")).abs() < 1e-8, "{result}");
}

#[test]
fn a_loop_of_a_shipped_plant_has_no_margins_beyond_a_limit() {
    // The setpoint 1 needs the input 1.
    let text = |limit: f64| {
        format!(
            "[study]\nname = 'limit'
            [models.p.pid-loop]\nplant = {{ poles = [-1], gain = 1 }}\nhorizon = 30\nlimit = [-{limit}, {limit}]
            [models.loop]\nlike = 'p'\nopen = 'u'
            [tuners]\nNd = {{ start = 10, min = 5, max = 20 }}
            [cases.c]\nk = 2\nTi = 1\nTd = 0\ninputs.r.step.after = 1.0
            [criteria]\nmargin = {{ model = 'loop', phase-margin = {{}}, usage = 'monitor' }}
            y = {{ model = 'p', final-value = {{ signal = 'y' }}, demand = 1 }}\n"
        )
    };
    let folder = tempfile::tempdir().unwrap();
    let within = run(folder.path(), &text(1.5));
    assert!((value(&within, "c", "margin") - std::f64::consts::FRAC_PI_2).abs() < 1e-6, "{within}");
    let beyond = run(folder.path(), &text(0.5));
    let margin = &beyond["criteria"].as_array().unwrap()[0];
    assert!(margin["value"].is_null(), "{margin}");
}

#[test]
fn the_margins_of_a_sampled_controller_are_those_of_its_difference_equation() {
    // A limited PI controller with computing time at a tank, A h' = q - kv h, by hand: from the change of q to the next
    // sample of h, and u = k e + s, s(k+1) = s + k T/Ti e.
    let (area, outflow, gain, integral, period, delay) = (0.5, 0.02, 0.05, 20.0, 2.0, 0.5);
    let text = format!(
        "[study]\nname = 'tank'
        [models.tank.equations]
        states = {{ h = 'm' }}
        inputs = {{ q = 'm3/s', r = 'm' }}
        constants = {{ A = '{area} m2', kv = '{outflow} m2/s' }}
        der.h = \"A*h' = q - kv*h\"
        horizon = '200 s'
        pid.q = {{ setpoint = 'r', measured = 'h', k = '{gain} m2/s', Ti = '{integral} s', limit = ['0 m3/s', '0.1 m3/s'], every = '{period} s', delay = '{delay} s' }}
        [models.cut]
        like = 'tank'
        open = 'q'
        [cases.a]
        inputs.r = '1 m'
        [criteria]
        slowest = {{ model = 'cut', slowest-pole = {{ of = 'closed-loop' }}, usage = 'monitor' }}
        still = {{ model = 'tank', peak = {{ signal = 'q' }}, usage = 'monitor' }}
        {}",
        criteria("cut"),
    );
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), &text);
    let decay = |time: f64| math::exp(-outflow / area * time);
    let at = |z: Complex| {
        let left = period - delay;
        let at_change = (1.0 - decay(period)) / outflow / (z - decay(period));
        let sample = (at_change * decay(left) + (1.0 - decay(left)) / outflow) / z;
        sample * gain * ((z - 1.0).inv() * period / integral + 1.0)
    };
    let response = |omega: f64| at(complex::exp(Complex::new(0.0, omega * period)));
    let root = |f: &dyn Fn(Complex) -> f64, mut low: f64, mut high: f64| {
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if (f(response(middle)) > 0.0) == (f(response(low)) > 0.0) { low = middle } else { high = middle }
        }
        low
    };
    let nyquist = std::f64::consts::PI / period;
    let crossover = root(&|l| complex::norm(l) - 1.0, 1e-3, 0.99 * nyquist);
    let turned = complex::arg(-response(crossover));
    // L is real at half of the sampling frequency.
    let end = at(Complex::new(-1.0, 0.0)).re;
    assert!(end < 0.0, "{end}");
    let peak =
        (1..20_000).map(|i| 1.0 / complex::norm(response(nyquist * f64::from(i) / 20_000.0) + 1.0)).fold(1.0, f64::max);
    for (kind, exact, tolerance) in [
        ("crossover-frequency", crossover, 1e-9),
        ("phase-margin", turned, 1e-9),
        ("delay-margin", turned / crossover, 1e-9),
        ("gain-margin", -20.0 * math::log10(-end), 1e-9),
        ("maximum-sensitivity", peak, 1e-6),
    ] {
        let found = value(&result, "a", &format!("cut-{kind}"));
        assert!((found - exact).abs() <= tolerance * exact, "{kind}: {found} {exact}");
    }
    // The return difference vanishes at the slowest pole, whose magnitude is known.
    let size = math::exp(period * value(&result, "a", "slowest"));
    let difference = |angle: f64| complex::norm(at(complex::from_polar(size, angle)) + 1.0);
    let (mut angle, mut step) = (0.0, 0.5 * std::f64::consts::PI);
    while step > 1e-12 {
        let tried = (-4..=4).map(|i| angle + 0.25 * f64::from(i) * step);
        angle = tried.min_by(|a, b| difference(*a).total_cmp(&difference(*b))).unwrap();
        step *= 0.5;
    }
    assert!(difference(angle) < 1e-7, "{angle}: {}", difference(angle));
}

#[test]
fn the_closed_loop_of_a_cut_state_feedback_has_the_poles_that_were_placed() {
    // The gains of pole-placement-retuning place -5, -8, -10 and -14, for the linear plant; the filter of the reference
    // has -20.
    let text = "[study]\nname = 'upright'
        [models.cut]
        furuta-state-feedback = { horizon = '1 s', plant = 'linear' }
        open = 'u'
        [models.cut.parameters]
        a = 9.03524e-4
        b = 1.13313e-3
        c = 6.30984e-4
        d = 2.526663e-2
        c1 = 7.4926e-5
        d2 = 2.5287e-5
        setpoint = '30 deg'
        k1 = -0.13874607
        k2 = -0.06897883
        k3 = -0.73455928
        k4 = -0.1354155
        [criteria]
        slowest = { slowest-pole = { of = 'closed-loop' }, usage = 'monitor' }
        damping = { damping-ratio = { of = 'closed-loop' }, usage = 'monitor' }
        margin = { phase-margin = {}, usage = 'monitor' }";
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), text);
    assert!((value(&result, "nominal", "slowest") + 5.0).abs() < 1e-4, "{result}");
    assert!((value(&result, "nominal", "damping") - 1.0).abs() < 1e-12, "{result}");
    assert!(value(&result, "nominal", "margin") > 0.0, "{result}");
}

#[test]
fn of_several_cut_loops_one_is_read_with_the_others_closed_and_all_have_a_disk_margin() {
    let two = "[study]\nname = 'tanks'
        [models.tanks]
        parameters = { k1 = '2 V/m', k2 = '2 V/m', T1 = '20 s', T2 = '40 s' }
        [models.tanks.equations]
        states = { h1 = 'm', h2 = 'm', i1 = 'V', i2 = 'V' }
        inputs = { r1 = 'm' }
        parameters = { k1 = 'V/m', k2 = 'V/m', T1 = 's', T2 = 's' }
        constants = { b = '0.01 m/(V s)' }
        let = { u1 = 'k1*(r1 - h1) + i1', u2 = 'i2 - k2*h2' }
        outputs = { u1 = { value = 'u1', unit = 'V' } }
        der = { h1 = '-h1/60[s] + b*(0.7*u1 + 0.3*u2)', h2 = '-h2/90[s] + b*(0.4*u1 + 0.6*u2)', i1 = 'k1/T1*(r1 - h1)', i2 = '-k2/T2*h2' }
        horizon = '600 s'
        [models.both]
        like = 'tanks'
        open = ['u1', 'u2']
        [models.by-hand]
        like = 'tanks'
        open = 'u1'
        [criteria]
        together = { model = 'both', disk-margin = {}, usage = 'monitor' }
        cut-disk = { model = 'both', disk-margin = { input = 'u1' }, usage = 'monitor' }
        by-hand-disk = { model = 'by-hand', disk-margin = {}, usage = 'monitor' }\n";
    let one = criteria("cut").replace("model = 'cut'", "model = 'both'").replace("= {},", "= { input = 'u1' },");
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), &[two, &one, &criteria("by-hand")].concat());
    assert_same(&result, "nominal");
    let [together, cut, by_hand] = ["together", "cut-disk", "by-hand-disk"].map(|name| value(&result, "nominal", name));
    assert!((cut - by_hand).abs() < 1e-9 * cut, "{cut} {by_hand}");
    // Largest of the least scaled singular values of S - 1/2 over frequency, by NumPy and SciPy.
    assert!((together - 1.201_062_989).abs() < 1e-8 && together < cut, "{together} {cut}");

    let wrong = |from: &str, to: &str| refused(&[&two.replace(from, to), "\n"].concat());
    let twice = wrong("open = ['u1', 'u2']", "open = ['u1', 'u1']");
    assert!(twice.contains("`u1` is listed twice"), "{twice}");
    let other = wrong("disk-margin = { input = 'u1' }", "disk-margin = { input = 'u1', output = '-u2' }");
    assert!(other.contains("the output of the loop cut at `u1` is `-u1`, not `-u2`"), "{other}");
    let none = wrong("disk-margin = {}", "phase-margin = {}");
    assert!(none.contains("the model has 2 inputs") && none.contains("u1, u2"), "{none}");
}

#[test]
fn a_loop_is_cut_at_the_operating_point_of_the_closed_loop() {
    // J th'' = torque - m sin(th), torque = u + b u^3, u = p (r - th) - d th' + f; at rest th = 1, torque = m sin(1).
    let [inertia, weight, bend, p, d] = [0.02, 1.5, 0.4, 6.0, 0.7];
    let torque = weight * math::sin(1.0);
    // Newton's iteration for u + b u^3 = torque.
    let u = (0..50).fold(torque, |u, _| u - (u + bend * math::powi(u, 3) - torque) / (1.0 + 3.0 * bend * u * u));
    let gain = 1.0 + 3.0 * bend * u * u;
    let text = format!(
        "[study]\nname = 'arm'
        [models.arm.equations]
        states = {{ th = '1', w = '1/s' }}
        constants = {{ J = {inertia}, m = {weight}, b = {bend}, p = {p}, d = {d}, f = {u} }}
        let = {{ u = 'p*(1 - th) - d*w + f', torque = 'u + b*u^3' }}
        der = {{ th = 'w', w = \"J*w' = torque - m*sin(th)\" }}
        horizon = '1 s'
        [models.cut]
        like = 'arm'
        open = 'u'
        [models.by-hand]
        transfer-function = {{ numerator = [{}, {}], denominator = [{inertia}, 0, {}] }}
        [criteria]\n{}{}",
        gain * d,
        gain * p,
        weight * math::cos(1.0),
        criteria("cut"),
        criteria("by-hand"),
    );
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), &text);
    for kind in ["phase-margin", "maximum-sensitivity", "crossover-frequency"] {
        let [cut, by_hand] = ["cut", "by-hand"].map(|name| value(&result, "nominal", &format!("{name}-{kind}")));
        assert!((cut - by_hand).abs() <= 1e-8 * by_hand.abs(), "{kind}: {cut} {by_hand}");
    }
}

#[test]
fn a_loop_through_a_derivative_is_cut_too() {
    // x' = -x + u with u = -k x': L = k s/(s + 1).
    let text = "[study]\nname = 'rate'
        [models.plant.equations]
        states = { x = '1' }
        constants = { k = 3 }
        let = { u = \"-k*x'*1 [s]\" }
        der = { x = \"x'*1 [s] = u - x\" }
        horizon = '1 s'
        [models.cut]
        like = 'plant'
        open = 'u'
        [criteria]
        size = { model = 'cut', hinf-norm = {}, usage = 'monitor' }";
    let folder = tempfile::tempdir().unwrap();
    let size = value(&run(folder.path(), text), "nominal", "size");
    assert!((size - 3.0).abs() < 1e-6, "{size}");
}

#[test]
fn a_base_or_a_cut_that_does_not_exist_is_refused_at_its_place() {
    let model = |keys: &str| {
        format!(
            "[study]\nname = 'x'\n[models.a.equations]\nstates = {{ x = '1' }}\nlet = {{ u = '-x' }}\n\
             der = {{ x = 'u/1 [s]' }}\nhorizon = '1 s'\n[models.b]\n{keys}\n[criteria]\nc = {{ model = 'b', phase-margin = {{}}, demand = 1 }}\n"
        )
    };
    for (keys, place, fact) in [
        ("like = 'c'\nopen = 'u'", "study.toml:9:8", "the study has no model `c`"),
        ("like = 'b'\nopen = 'u'", "study.toml:9:8", "circular `like`: b -> b"),
        ("like = 'a'\nopen = 'v'", "study.toml:10:8", "not at `v`"),
        ("like = 'a'\nopen = 'x'", "study.toml:10:8", "not at `x`"),
        ("like = 'a'\nopen = 'u'\nlinearise = { inputs = ['u'] }", "study.toml:11:24", "its own input and output"),
        (
            "pid-loop = { plant = { poles = [-1] }, horizon = 5 }\nopen = 'y'",
            "study.toml:10:8",
            "at `u` only, not at `y`",
        ),
        ("transfer-function = { poles = [-1] }\nopen = 'u'", "study.toml:10:8", "cannot be cut"),
        (
            "like = 'a'\nopen = 'u'\npid-loop = { plant = { poles = [-1] }, horizon = 5 }",
            "study.toml:11:1",
            "two are given",
        ),
    ] {
        let message = refused(&model(keys)).replace('\n', " ");
        assert!(message.contains(place) && message.contains(fact), "{keys}: {message}");
    }
}

#[test]
fn a_delay_in_the_loop_is_a_delay_of_the_cut_loop() {
    // A tank behind a pipe and a sensor with a dead time: both delays lie in the loop, one is a tuner.
    let text = "
        [study]
        name = 'tank'
        [models.tank.equations]
        states = { h = '1', i = '1' }
        inputs = { r = '1' }
        parameters = { T = 's' }
        constants = { k = 2, Ti = '4 s', A = '3 s' }
        let = { seen = \"delay(h, '0.3 s')\", e = 'r - seen', u = 'k*e + i', q = 'delay(u, T)' }
        der = { h = \"A*h' = q - h\", i = 'k*e/Ti' }
        horizon = '20 s'
        [models.cut]
        like = 'tank'
        open = 'u'
        [models.by-hand]
        transfer-function = { numerator = [8, 2], denominator = [12, 4, 0], delay = '0.7 s' }
        [models.sensor]
        like = 'tank'
        linearise = { inputs = ['r'], outputs = ['h'] }
        [cases]
        slow = { T = '0.4 s', inputs.r.constant = 1.5 }
        [criteria]
        overshoot = { model = 'tank', peak = { signal = 'h' }, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    let values = |time: &str| {
        let text = text.replace("T = '0.4 s'", &format!("T = '{time}'"));
        run(folder.path(), &[&text, &criteria("cut")[..], &criteria("by-hand")].concat())
    };
    let result = values("0.4 s");
    assert_same(&result, "slow");
    let [short, long] = ["0.35 s", "0.45 s"].map(|time| value(&values(time), "slow", "cut-delay-margin"));
    assert!((short - long - 0.1).abs() < 1e-10, "{short} {long}");
    let closed = [text, "size = { model = 'sensor', hinf-norm = {}, usage = 'monitor' }"].concat();
    let study = folder.path().join("closed.toml");
    std::fs::write(&study, closed).unwrap();
    let output = cargo_bin_cmd!("mops").args(["run", study.to_str().unwrap()]).output().unwrap();
    let undefined = [&output.stdout[..], &output.stderr].concat();
    let undefined = String::from_utf8_lossy(&undefined);
    assert!(undefined.contains("a delay lies in a feedback loop"), "{undefined}");
}

#[test]
fn a_transfer_function_and_its_matrices_answer_over_time_too() {
    // 2/(0.5 s + 1) from rest: a step response, and the response to a sine.
    let text = "
        [study]
        name = 'lag'
        [models.lag]
        transfer-function = { numerator = [2], denominator = ['T', 1], units = { T = 's' } }
        [models.step]
        like = 'lag'
        transfer-function.horizon = '3 s'
        [models.matrices]
        state-space = { a = [['-1/T']], b = [['1/T']], c = [[2], [0]], d = [[0], [1]], outputs = ['y', 'u_out'], units = { T = 's' }, horizon = '3 s' }
        [cases]
        step = { T = '500 ms', inputs.u = 1 }
        sine = { T = 0.5, inputs.u.sine = { amplitude = 1, frequency = '1 rad/s' } }
        [criteria]
        margin = { model = 'lag', crossover-frequency = {}, usage = 'monitor' }
        end = { model = 'step', final-value = { signal = 'y' }, usage = 'monitor' }
        same = { model = 'matrices', final-value = { signal = 'y' }, usage = 'monitor' }
        through = { model = 'matrices', final-value = { signal = 'u_out' }, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), text);
    let step = 2.0 * (1.0 - math::exp(-6.0));
    // Particular solution 2/(1 + T^2) (sin t - T cos t) and the decaying part.
    let sine = 2.0 / 1.25 * (math::sin(3.0) - 0.5 * math::cos(3.0) + 0.5 * math::exp(-6.0));
    for (case, expected, input) in [("step", step, 1.0), ("sine", sine, math::sin(3.0))] {
        for name in ["end", "same"] {
            let found = value(&result, case, name);
            assert!((found - expected).abs() < 1e-7, "{name} in {case}: {found} {expected}");
        }
        assert!((value(&result, case, "through") - input).abs() < 1e-12);
        assert!((value(&result, case, "margin") - 2.0 * 3.0f64.sqrt()).abs() < 1e-9);
    }
    let late = text.replace("['T', 1], units", "['T', 1], delay = 1, units").replace("u = 1 }", "u.step.after = 1 }");
    let result = run(folder.path(), &late);
    let late = 2.0 * (1.0 - math::exp(-4.0));
    assert!((value(&result, "step", "end") - late).abs() < 1e-7, "{result}");
}

#[test]
fn signals_of_joined_models_are_compared_in_one_formula() {
    // Two lags with time constants of 1 s and 2 s: their step responses differ by exp(-t/2) - exp(-t).
    let text = "
        [study]
        name = 'pair'
        [models.fast]
        transfer-function = { numerator = ['g'], denominator = ['T1', 1], units = { T1 = 's' }, horizon = '60 s' }
        parameters = { T1 = '1 s' }
        [models.slow]
        transfer-function = { numerator = ['g'], denominator = ['T2', 1], units = { T2 = 's' }, horizon = '60 s' }
        [models.both]
        join = ['fast', 'slow']
        parameters = { T2 = '2 s' }
        [tuners]
        g = { start = 3, min = 1, max = 5 }
        [cases]
        step = { inputs.u = 1 }
        [criteria]
        power = { model = 'both', expression = { value = 'integral((fast_y - slow_y)^2)' }, demand = '1 s' }
        most = { model = 'both', expression = { value = 'maximum(fast_y - slow_y)' }, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    // The common gain is tuned to its bound; both models take it.
    let result = run(folder.path(), text);
    let [power, most] = ["power", "most"].map(|name| value(&result, "step", name));
    assert!((power - 1.0 / 6.0).abs() < 1e-8 && (most - 0.25).abs() < 1e-8, "{power} {most}");

    // A default of one model does not give way to a value of the other.
    let loops = "[study]\nname = 'two'
        [models.loop]
        pid-loop = { plant = { poles = [-1, -2], gain = 2 }, horizon = '9 s' }
        parameters = { k = 1, Ti = '1 s', Td = 0, wp = 0.5 }
        [models.reference-loop]
        like = 'loop'
        parameters = { wp = 1 }
        [models.both]
        join = ['loop', 'reference-loop']
        [criteria]
        off = { model = 'both', expression = { value = 'rms(loop_y - reference_loop_y)' }, usage = 'monitor' }";
    let message = refused(loops);
    assert!(message.contains("`wp` has different values in the models that are joined"), "{message}");
    let message = refused(&loops.replace("parameters = { wp = 1 }", "parameters = { wp = '100 %' }"));
    assert!(message.contains("`wp` has different values"), "{message}");
    let same = run(folder.path(), &loops.replace("parameters = { wp = 1 }", "parameters = { wp = '50 %' }"));
    assert!(value(&same, "nominal", "off").abs() < 1e-15);

    for (from, to, fact) in [
        ("['fast', 'slow']", "['fast', 'slowly']", "the study has no other model `slowly`"),
        ("['fast', 'slow']", "['fast', 'both']", "the study has no other model `both`"),
        ("['fast', 'slow']", "['fast', 'fast']", "`fast` is joined twice"),
        ("['fast', 'slow']", "['fast']", "expected at least two models in `join`, found 1"),
        ("join = ", "open = 'u'\njoin = ", "no keys but `join` and `parameters`"),
        (
            "units = { T2 = 's' }, horizon = '60 s' }",
            "units = { T2 = 's' } }",
            "`slow` is a linear system without simulation",
        ),
        (
            "units = { T2 = 's' }",
            "units = { T2 = 's', g = 'V' }",
            "`g` has the unit `1` in one model and `V` in another",
        ),
        (
            "[models.both]",
            "parameters = { T2 = '1 s', g = 1 }\n[models.third]\nlike = 'slow'\nparameters.g = 2\n[models.both]",
            "",
        ),
    ] {
        if fact.is_empty() {
            let differing = text.replace(from, to).replace("['fast', 'slow']", "['slow', 'third']");
            let message = refused(&differing);
            assert!(message.contains("`g` has different values in the models that are joined"), "{message}");
            continue;
        }
        let message = refused(&text.replace(from, to)).replace('\n', " ");
        assert!(message.contains(fact), "{to}: {message}");
    }
}

#[test]
fn a_study_without_criteria_is_linearised_and_simulated_but_not_solved() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    let text = "[study]\nname = 'plant'\n[models.plant.equations]\nstates = { x = '1', v = '1/s' }\ninputs = { u = '1/s2' }\n\
                parameters = { w = '1/s' }\nder = { x = 'v', v = 'u - w^2*x' }\n[cases]\nslow = { w = 2, horizon = '1 s', inputs.u = 1 }\n";
    std::fs::write(&study, text).unwrap();
    let mops = |arguments: &[&str]| {
        let output = cargo_bin_cmd!("mops").args(arguments).arg(study.to_str().unwrap()).output().unwrap();
        let all = [&output.stdout[..], &output.stderr].concat();
        (output.status.code(), String::from_utf8(all).unwrap())
    };
    let (code, text) = mops(&["linearise", "--place=-1+1i,-1-1i"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("-4") && text.contains("0 + 2i"), "{text}");
    let (code, text) = mops(&["simulate"]);
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = mops(&["check"]);
    assert!(code == Some(0) && text.contains("the study has no criterion"), "{text}");
    for command in ["run", "sensitivity"] {
        let (code, text) = mops(&[command]);
        assert!(code == Some(2) && text.contains("the study has no criterion"), "{command}: {text}");
    }
}

#[test]
fn every_task_has_a_command() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    let text = "[study]\nname = 'lag'\n[models.lag.equations]\nstates = { x = '1' }\nparameters = { k = '1/s', d = '1/s' }\n\
                der = { x = 'k - d*x' }\nhorizon = '2 s'\n[models.lag.parameters]\nd = 1\n[tuners]\nk = { start = 3, min = 1, max = 4 }\n\
                [uncertain]\nd = { min = 0.5, max = 1.5 }\n[sweep]\nx = 'k'\n[monte-carlo]\nsamples = 20\n\
                [criteria]\nend = { final-value = { signal = 'x' }, demand = 2 }\n";
    std::fs::write(&study, text).unwrap();
    for (command, task) in [
        ("sensitivity", "sensitivity"),
        ("sweep", "sweep"),
        ("worst-case", "worst-case"),
        ("monte-carlo", "monte-carlo"),
    ] {
        let out = folder.path().join(command);
        let output = cargo_bin_cmd!("mops")
            .args([command, study.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()])
            .output()
            .unwrap();
        let result: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|e| panic!("{command}: {e}: {}", String::from_utf8_lossy(&output.stderr)));
        assert_eq!(result["task"], task);
    }
}
