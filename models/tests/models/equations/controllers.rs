//! PID controllers of a model, compared with the compiled loop `pid-loop`.

use mops_core::ModelOptions;
use mops_models::pid_loop::PidLoopOptions;

use super::*;

/// Returns the traces of `y` and `u` of `2/((s + 1)(s + 0.5)(s + 2))`, with the loop written by hand in Rust.
fn compiled(keys: &str, parameters: &[(&str, f64)]) -> [mops_core::Trace; 2] {
    let text = format!("horizon = '20 s'\nplant = {{ poles = [-1, -0.5, -2], gain = 2 }}\n{keys}{TIGHT}");
    let model = toml::from_str::<PidLoopOptions>(&text).unwrap().build().unwrap();
    let of = model.interface();
    let value = |p: &mops_core::Parameter| {
        let given = parameters.iter().find(|(name, _)| *name == p.variable.name).map(|(_, value)| *value);
        given.or(p.default).unwrap()
    };
    let values: Vec<f64> = of.parameters.iter().map(value).collect();
    let signals = ["y", "u"].map(|name| of.signal_index(name).unwrap());
    let inputs = vec![
        ("r".to_owned(), Input::Step { time: 0.0, before: 0.0, after: 1.0 }),
        ("d".to_owned(), Input::Step { time: 9.03, before: 0.0, after: -0.7 }),
    ];
    let case = Case { inputs, ..Case::default() };
    let job = Job { case: &case, parameters: &values, signals: &signals, horizon: 20.0 };
    let analysis = model.analyse(&job).unwrap();
    ["y", "u"].map(|name| analysis.trace(name).clone())
}

/// Returns the plant with a controller of these keys.
fn plant(pid: &str) -> String {
    format!(
        "states = {{ x = '1', y = '1', z = '1' }}\ninputs = {{ r = '1', d = '1', u = '1' }}\n\
         parameters = {{ k = '', Ti = 's', Td = 's' }}\n\
         der = {{ z = '2*(u + d)/1 [s] - 2*z/1 [s]', x = '(z - 0.5*x)/1 [s]', y = '(x - y)/1 [s]' }}\n\
         pid.u = {{ setpoint = 'r', measured = 'y', k = 'k', {pid} }}"
    )
}

fn assert_same(keys: &str, pid: &str, [k, ti, td]: [f64; 3]) {
    let own = model(&plant(pid));
    let known = |name: &str| own.interface().parameters.iter().any(|p| p.variable.name == name);
    let mut given = vec![("k", k), ("Ti", ti), ("Td", td), ("x0", 0.0), ("y0", 0.0), ("z0", 0.0)];
    given.extend(["u0", "u_integral0", "u_filtered0", "u_derivative0", "u_last0"].map(|name| (name, 0.0)));
    given.retain(|(name, _)| known(name));
    let (r, d) =
        (Input::Step { time: 0.0, before: 0.0, after: 1.0 }, Input::Step { time: 9.03, before: 0.0, after: -0.7 });
    let response = respond(&own, &[("r", r), ("d", d)], &given, 20.0);
    let [y, u] = compiled(keys, &[("k", k), ("Ti", ti), ("Td", td)]);
    for t in (1..200).map(|i| 0.0997 * f64::from(i)) {
        let off = [at(&response, "y", t) - y.at(t), at(&response, "u", t) - u.at(t)];
        assert!(off.iter().all(|off| off.abs() < 3e-7), "{pid} at {t}: {off:?}");
    }
}

#[test]
fn a_controller_in_the_study_file_is_the_compiled_one() {
    assert_same("", "Ti = 'Ti', Td = 'Td'", [3.0, 2.0, 0.4]);
    assert_same("", "Ti = 'Ti', Td = 'Td'", [3.0, 2.0, 0.0]);
    assert_same("", "Ti = 'Ti'", [3.0, 2.0, 0.0]);
    assert_same("", "Td = 'Td'", [3.0, f64::INFINITY, 0.4]);
}

#[test]
fn anti_windup_is_that_of_the_compiled_one() {
    assert_same("limit = [-0.5, 1.3]", "Ti = 'Ti', Td = 'Td', limit = [-0.5, 1.3]", [3.0, 2.0, 0.4]);
    assert_same("limit = [-0.5, 1.3]", "Ti = 'Ti', limit = [-0.5, '1.3']", [3.0, 2.0, 0.0]);
}

#[test]
fn a_sampled_controller_is_the_compiled_one() {
    let sampled = "sample-time = '100 ms'";
    assert_same(sampled, "Ti = 'Ti', Td = 'Td', every = '100 ms'", [3.0, 2.0, 0.4]);
    let late = "sample-time = '100 ms'\ndelay = '30 ms'\nlimit = [-0.5, 1.3]";
    assert_same(late, "Ti = 'Ti', Td = 'Td', every = '100 ms', delay = '30 ms', limit = [-0.5, 1.3]", [3.0, 2.0, 0.4]);
    assert_same(sampled, "every = '100 ms'", [3.0, f64::INFINITY, 0.0]);
}

#[test]
fn units_weights_and_a_feedforward_are_those_of_the_formula() {
    // x' = u/J without a measured value: u = k (wp r - x) + f; x tends to (k wp r + f)/k.
    let text = "states = { x = 'deg' }\ninputs = { r = 'deg' }\nparameters = { k = 'V/rad' }\n\
                constants = { f = '500 mV', J = '1 V s/rad' }\nder = { x = 'u/J' }\n\
                pid.u = { setpoint = 'r', measured = 'x', k = 'k', wp = 0.8, feedforward = 'f', unit = 'mV' }";
    let response = respond(&model(text), &[("r", Input::Constant(90.0))], &[("k", 2.0), ("x0", 0.0)], 20.0);
    let end = 0.8 * 90.0 + (0.5f64 / 2.0).to_degrees();
    assert!((at(&response, "x", 20.0) - end).abs() < 1e-6, "{}", at(&response, "x", 20.0));
    assert!((at(&response, "u", 1e-9) - 1e3 * (2.0 * 72f64.to_radians() + 0.5)).abs() < 1e-3);
}

#[test]
fn plain_numbers_are_in_the_unit_of_their_quantity() {
    // Setpoint in deg as the measured state, limits in mV as the input; at first the output is at its limit.
    let text = |setpoint: &str, measured: &str| {
        format!(
            "states = {{ x = 'deg' }}\ninputs = {{ u = 'mV' }}\nconstants = {{ J = '1 V s/rad' }}\nder = {{ x = 'u/J' }}\n\
             pid.u = {{ setpoint = {setpoint}, measured = '{measured}', k = '2 V/rad', Ti = 4, limit = [-500, 500] }}"
        )
    };
    let response = respond(&model(&text("90", "x")), &[], &[("x0", 0.0), ("u_integral0", 0.0)], 60.0);
    assert!((at(&response, "u", 1e-9) - 500.0).abs() < 1e-9 && (at(&response, "x", 60.0) - 90.0).abs() < 1e-3);
    let bare = read(&text("90", "1*x")).err().expect("a mistake").to_string();
    assert!(bare.starts_with("pid.u.setpoint: the setpoint 90 has no unit"), "{bare}");
    // Without any unit, time is a number too.
    let pure = "states = { x = '1' }\ninputs = { u = '1' }\nder = { x = 'u - x' }\n\
                pid.u = { setpoint = 1, measured = 'x', k = 2, Ti = 1, Td = 0.1 }";
    let given = [("x0", 0.0), ("u_integral0", 0.0), ("u_filtered0", 0.0)];
    assert!((at(&respond(&model(pure), &[], &given, 60.0), "x", 60.0) - 1.0).abs() < 1e-6);
}

#[test]
fn mistakes_are_at_the_keys_of_the_controller() {
    let mistake = |pid: &str| read(&plant(pid)).err().expect("a mistake").to_string();
    let unknown = mistake("Ti = 'Tii'");
    assert!(unknown.starts_with("pid.u.Ti: ") && unknown.contains("Tii"), "{unknown}");
    let syntax = mistake("Td = 'Td*'");
    assert!(syntax.starts_with("pid.u.Td: "), "{syntax}");
    let wrong = mistake("Ti = '2 m'");
    assert!(wrong.starts_with("pid.u"), "{wrong}");
    let twice = mistake("unit = 'V'");
    assert!(twice.starts_with("pid.u.unit: the controller replaces the input `u`"), "{twice}");
    let late = mistake("delay = '1 ms'");
    assert!(late.starts_with("pid.u.delay: a delay needs a sampled controller"), "{late}");
    for (pid, key, fact) in [
        ("Ti = '-1 s'", "Ti", "above 0"),
        ("Ti = '50 mm'", "Ti", "expected a quantity in s, found mm"),
        ("Td = '1 s', Nd = 0", "Nd", "above 0"),
        ("Ti = 'Ti', Tt = '1 s'", "Tt", "only with an integral part and a limit"),
        ("limit = ['-1 V', '1 V']", "limit", "expected a quantity in 1, found V"),
    ] {
        let wrong = mistake(pid);
        assert!(wrong.starts_with(&format!("pid.u.{key}: ")) && wrong.contains(fact), "{wrong}");
    }
    let elsewhere =
        |name: &str| read(&plant("unit = '1'").replace("pid.u", name)).err().expect("a mistake").to_string();
    assert!(elsewhere("pid.uu").starts_with("pid.uu: no equation contains the output `uu`"), "{}", elsewhere("pid.uu"));
    assert!(elsewhere("pid.x").starts_with("pid.x: `x` is a state"), "{}", elsewhere("pid.x"));
    let never = mistake("every = '0 ms'");
    assert!(never.starts_with("pid.u.every: "), "{never}");
    let own = plant("Ti = 'Ti'") + "\nlet = { u_last = 'yy' }";
    let own = read(&own).err().expect("a mistake").to_string();
    assert!(own.starts_with("let.u_last: "), "{own}");
    let text = plant("Ti = 'Ti'").replace(", u = '1' }", " }");
    let bare = read(&text).err().expect("a mistake").to_string();
    assert!(bare.starts_with("pid.u: the output `u` of the controller has no unit"), "{bare}");
}
