//! Units in a study: converted if possible, otherwise refused with their position.

use std::path::Path;

use assert_cmd::Command;
use mops::math;
use serde_json::Value;

fn mops(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::cargo_bin("mops").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
    (output.status.code().unwrap(), text)
}

/// Writes a study with a data file into a new folder.
fn study(text: &str, data: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("study.toml"), text).unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    folder
}

fn result(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("out/result.json")).unwrap()).unwrap()
}

/// Returns the values of the criteria at the initial guess, by name.
fn values(text: &str, data: &str) -> Vec<(String, f64, String)> {
    let folder = study(text, data);
    let (code, output) = mops(folder.path(), &["run", "study.toml", "--max-evaluations", "1", "--out", "out"]);
    assert!(code <= 1, "{output}");
    let of = |criterion: &Value| {
        let text = |key: &str| criterion[key].as_str().unwrap().to_owned();
        (text("name"), criterion["value"].as_f64().unwrap_or(f64::NAN), text("unit"))
    };
    result(folder.path())["criteria"].as_array().unwrap().iter().map(of).collect()
}

#[test]
fn the_angle_of_a_decelerating_motor_is_the_integral_of_its_speed_in_any_unit() {
    // (1 - exp(-1)) times the angle of one second at 100 rpm, in deg: 379.
    let text = |criterion: &str| {
        format!(
            "[study]\nname = 'motor'\n[models.m.equations]\nstates = {{ w = 'rpm', x = 'deg' }}\nparameters = {{ k = '1/s' }}\n\
             der = {{ x = 'w', w = '-k*w' }}\nstart = {{ w = '100 rpm' }}\nhorizon = '1 s'\n\
             [tuners]\nk = {{ start = 1, min = 0.5, max = 2 }}\n[criteria]\nf = {{ {criterion} }}\n"
        )
    };
    // The answer is in the unit of the question.
    let degrees = 600.0 * (1.0 - math::exp(-1.0));
    for (demand, unit, per_degree) in [
        ("demand = 600", "deg", 1.0),
        ("demand = '10 rad'", "rad", 1f64.to_radians()),
        ("demand = 10, unit = 'rad'", "rad", 1f64.to_radians()),
    ] {
        let found = values(&text(&format!("final-value = {{ signal = 'x' }}, {demand}")), "");
        assert!((found[0].1 - degrees * per_degree).abs() < 1e-5, "{found:?}");
        assert_eq!(found[0].2, unit);
    }
}

const ROOM: &str = "
[study]
name = 'room'
[models.room.equations]
states     = { T = 'STATE' }
inputs     = { To = 'INPUT' }
parameters = { k = '1/s', Tb = 'BASE' }
der        = { T = 'k*(To - T) + k*(Tb - T)' }
start      = { T = '20 degC' }
horizon    = '1 h'
[tuners]
k  = { start = 1e-3, min = 1e-5, max = 1e-1, scale = 'log' }
Tb = { start = '20 degC', min = '10 degC', max = '30 degC' }
[cases]
rest = { inputs.To.constant = '20 degC' }
[criteria]
end  = { steady-state-error = { signal = 'T', target = '20 degC' }, demand = '1 K' }
top  = { peak = { signal = 'T' }, demand = '25 degC' }
";

#[test]
fn a_room_in_equilibrium_stays_there_on_every_temperature_scale() {
    for state in ["K", "degC", "degF"] {
        for (input, base) in [("K", "degC"), ("degC", "K"), ("degF", "degF")] {
            let text = ROOM.replace("STATE", state).replace("INPUT", input).replace("BASE", base);
            let found = values(&text, "");
            let (end, top) = (&found[0], &found[1]);
            assert!(end.1.abs() < 1e-9, "{state} {input} {base}: {found:?}");
            let level = match state {
                "K" => 293.15,
                "degC" => 20.0,
                _ => 68.0,
            };
            assert!((top.1 - level).abs() < 1e-9 && top.2 == state && end.2 == "K", "{found:?}");
        }
    }
}

#[test]
fn recorded_temperatures_are_converted_and_their_noise_is_a_difference() {
    let text = |state: &str, noise: &str, tuner: &str| {
        format!(
            "[study]\nname = 'cooling'\ntask = 'calibration'\n[models.cup.equations]\nstates = {{ T = '{state}' }}\n\
             parameters = {{ k = '1/s', Ta = '{state}' }}\nder = {{ T = 'k*(Ta - T)' }}\nstart = {{ T = '80 degC' }}\n\
             [tuners]\nk = {{ start = 0.01, min = 1e-3, max = 0.1 }}\nTa = {{ {tuner} }}\n\
             [experiments.e]\nfile = 'data.csv'\nchannels = {{ T = {{ column = 'T', noise = {noise} }} }}\n\
             [criteria]\nT = {{ normalised-error = {{ signal = 'T' }} }}\n"
        )
    };
    // The error is 0.5 K everywhere: one standard deviation.
    let data = |unit: &str, factor: f64, zero: f64| {
        let row = |k: i32| {
            let t = 10.0 * f64::from(k);
            format!("{t},{}\n", (20.5 + 60.0 * math::exp(-0.01 * t)) * factor + zero)
        };
        format!("t [s],T [{unit}]\n{}", (0..20).map(row).collect::<String>())
    };
    let files = [data("degC", 1.0, 0.0), data("K", 1.0, 273.15), data("degF", 1.8, 32.0)];
    for state in ["K", "degC", "degF"] {
        for (file, own) in files.iter().zip(["0.5", "0.5", "0.9"]) {
            for noise in [own, "'0.5 K'", "'0.5 degC'", "'0.9 degF'"] {
                for tuner in
                    ["start = '20 degC', min = '0 degC', max = '300 K'", "start = 20, min = 0, max = 30, unit = 'degC'"]
                {
                    let found = values(&text(state, noise, tuner), file);
                    assert!((found[0].1 - 1.0).abs() < 1e-6, "{state} {noise} {tuner}: {found:?}");
                }
            }
        }
    }
}

const SERVO: &str = "
[study]
name = 'servo'
[models.m.equations]
states     = { i = 'A', w = 'rad/s' }
inputs     = { u = 'V' }
parameters = { k = 'V' }
constants  = { R = '0.6 ohm', L = '0.8 mH', Kt = '0.06 N m/A', J = '80 kg mm2' }
der        = { i = \"L*i' = u + k - R*i - Kt*w\", w = \"J*w' = Kt*i\" }
horizon    = '50 ms'
[tuners]
k = { start = 1, min = 0.1, max = 10 }
[criteria]
w = { final-value = { signal = 'w' }, demand = '1 rad/s' }
";

#[test]
fn constants_are_converted_and_a_wrong_unit_is_refused_at_the_equation() {
    let plain = SERVO.replace("0.8 mH", "0.8e-3 H").replace("80 kg mm2", "8e-5 kg m2");
    let (found, same) = (values(SERVO, ""), values(&plain, ""));
    assert!((found[0].1 - same[0].1).abs() < 1e-9, "{found:?} {same:?}");
    for (from, to, place) in [
        ("0.8 mH", "0.8 kg", "study.toml:9:"),
        ("0.8 mH", "0.8 mF", "study.toml:9:"),
        ("0.06 N m/A", "0.06 N/A", "study.toml:9:"),
        ("80 kg mm2", "80 kg mm", "study.toml:9:"),
        ("0.6 ohm", "0.6 V", "study.toml:9:"),
        ("k = 'V'", "k = 'A'", "study.toml:9:"),
        ("u = 'V'", "u = 'mA'", "study.toml:9:"),
        ("Kt*i\"", "Kt*i + k\"", "study.toml:9:"),
        ("J*w' = Kt*i", "J*w' = Kt*u", "study.toml:9:"),
        ("w = 'rad/s'", "w = 'm/s'", "study.toml:9:"),
    ] {
        let folder = study(&SERVO.replace(from, to), "");
        let (code, output) = mops(folder.path(), &["check", "study.toml"]);
        assert!(code == 2 && output.contains(place) && output.contains("expected a quantity in"), "{to}: {output}");
    }
}

#[test]
fn check_lists_numbers_without_units_inferred_units_and_frequencies_in_rad_per_second() {
    let text = "[study]\nname = 'm'\n[models.m.equations]\nstates = { h = 'm', v = 'm/s' }\nparameters = { c = '', f = 'rad/s' }\n\
                der = { h = 'v', v = '-9.81 - c*v*abs(v) + 1 [m/s2]*sin(f*time)' }\nhorizon = '1 s'\n\
                [tuners]\nc = { start = 0.1, min = 0, max = 1 }\nf = { start = '5 Hz', min = '1 Hz', max = '10 Hz' }\n\
                [criteria]\nh = { model-tracking = { signal = 'h', target = -1.0, frequency = '2 Hz', damping = 0.7 }, demand = '1 m' }\n";
    let folder = study(text, "");
    let (code, output) = mops(folder.path(), &["check", "study.toml"]);
    assert_eq!(code, 0, "{output}");
    for part in ["-9.81 in m/s2 (der.v)", "`c` in 1/m", "31.4159", "`frequency` of 2 Hz is 12.56637"] {
        assert!(output.contains(part), "{part}: {output}");
    }
}

#[test]
fn ties_are_computed_and_checked_in_coherent_units() {
    let text = |tie: &str| {
        format!(
            "[study]\nname = 'm'\n[models.m.equations]\nstates = {{ x = 'm' }}\nparameters = {{ a = 'ms', b = 's', v = 'mm/s' }}\n\
             der = {{ x = 'v' }}\noutputs = {{ b = {{ value = 'b', unit = 's' }} }}\nhorizon = '1 s'\n\
             [tuners]\na = {{ start = 20, min = 1, max = 100 }}\nv = {{ start = 3, min = 1, max = 10 }}\nb = {{ tie = '{tie}' }}\n\
             [criteria]\nb = {{ final-value = {{ signal = 'b' }}, demand = '1 s' }}\n"
        )
    };
    for (tie, value) in
        [("2*a", 0.04), ("a + 5 [ms]", 0.025), ("6 [mm]/v", 2.0), ("a*v/3 [mm/s]", 0.02), ("1 min", 60.0)]
    {
        assert!((values(&text(tie), "")[0].1 - value).abs() < 1e-12, "{tie}");
    }
    for (tie, fact) in [
        ("2*v", "expected a quantity in s, found one in m/s"),
        ("a + v", "expected a quantity in s, found one in m/s"),
        ("a + 5", "a number without a unit next to `a`, which is in ms"),
        ("exp(a)", "`exp` takes a pure number, found a quantity in s"),
    ] {
        let folder = study(&text(tie), "");
        let (code, output) = mops(folder.path(), &["check", "study.toml"]);
        assert!(code == 2 && output.contains(fact), "{tie}: {output}");
    }
}

#[test]
fn parameters_of_linear_systems_are_converted_and_their_entries_checked() {
    let text = |k: &str, entry: &str| {
        format!(
            "[study]\nname = 'm'\n[models.m.state-space]\na = [[0, 1], ['{entry}', '-d/m']]\nb = [[0], ['1/m']]\nc = [[1, 0]]\n\
             units = {{ k = '{k}', m = 'kg', d = 'N s/m' }}\n[models.m.parameters]\nm = '2000 g'\nd = 1\n\
             [tuners]\nk = {{ start = '8 kN/m', min = '1 N/m', max = '9 kN/m' }}\n\
             [criteria]\nw = {{ hinf-norm = {{}}, demand = 1 }}\n"
        )
    };
    let (a, b) = (values(&text("N/m", "-k/m"), ""), values(&text("kN/m", "-k/m"), ""));
    assert!((a[0].1 - b[0].1).abs() < 1e-12 * a[0].1, "{a:?} {b:?}");
    let folder = study(&text("kN/m", "-(k + m)"), "");
    let (code, output) = mops(folder.path(), &["check", "study.toml"]);
    assert!(code == 2 && output.contains("expected a quantity in N/m, found one in kg"), "{output}");
}

#[test]
fn a_frequency_in_hertz_is_one_in_rad_per_second_in_ties_and_cases_too() {
    let text = "[study]\nname = 'm'\n[models.m.equations]\nstates = { x = '1' }\nparameters = { f = 'rad/s', w = 'rad/s' }\n\
                der = { x = '0' }\noutputs = { y = 'w' }\nhorizon = '1 s'\n\
                [tuners]\nf = { start = 5, min = 1, max = 10, unit = 'Hz' }\nw = { tie = 'f' }\n\
                [criteria]\ny = { final-value = { signal = 'y' }, demand = 1 }\n";
    assert!((values(text, "")[0].1 - 10.0 * std::f64::consts::PI).abs() < 1e-12);
}

#[test]
fn a_case_gives_each_model_its_parameter_in_the_unit_of_the_model() {
    let text = |second: &str| {
        let model = |unit: &str| {
            format!(
                "equations = {{ states = {{ x = '1' }}, parameters = {{ k = '{unit}' }}, der = {{ x = '0' }}, \
                 outputs = {{ y = {{ value = 'k', unit = '{unit}' }} }}, horizon = '1 s' }}\n"
            )
        };
        let criterion =
            |model: &str| format!("{model} = {{ model = '{model}', final-value = {{ signal = 'y' }}, demand = 1 }}\n");
        format!(
            "[study]\nname = 'm'\n[models.a]\n{}[models.b]\n{}[tuners]\nd = {{ start = 1, min = 0, max = 2 }}\n\
             [cases]\nc = {{ k = '8 kN/m' }}\n[criteria]\n{}{}",
            model("N/m"),
            model(second),
            criterion("a"),
            criterion("b")
        )
        .replace("parameters = {", "parameters = { d = '1',")
    };
    let found = values(&text("kN/m"), "");
    assert!((found[0].1 - 8000.0).abs() < 1e-9 && (found[1].1 - 8.0).abs() < 1e-12, "{found:?}");
    let folder = study(&text("s"), "");
    let (code, output) = mops(folder.path(), &["check", "study.toml"]);
    assert!(code == 2 && output.contains("`k` is in N/m in one model and in s in another"), "{output}");
}

#[test]
fn a_temperature_input_that_is_not_driven_is_reported() {
    let text = "[study]\nname = 'm'\n[models.m.equations]\nstates = { T = 'degC' }\ninputs = { Ta = 'degC', Q = 'W' }\n\
                parameters = { k = '1/s' }\nconstants = { C = '1 J/K' }\nder = { T = 'k*(Ta - T) + Q/C' }\nhorizon = '1 s'\n\
                [tuners]\nk = { start = 1, min = 0.1, max = 2 }\n[cases]\ncold = { }\nwarm = { inputs.Ta.constant = '18 degC' }\n\
                [criteria]\ny = { final-value = { signal = 'T' }, demand = 1 }\n";
    let folder = study(text, "");
    let (code, output) = mops(folder.path(), &["check", "study.toml"]);
    assert!(
        code == 0 && output.contains("warning: input `Ta` is not driven and stays at 0 degC, in cold\n"),
        "{output}"
    );
    assert_eq!(output.matches("is not driven").count(), 1, "{output}");
}

#[test]
fn unity_feedback_requires_equal_dimensions_and_converts_units() {
    let text = |unit: &str, input: &str, law: &str| {
        format!(
            "[study]\nname = 'loop'\n[models.m]\nlinearise = {{ inputs = ['u'], outputs = ['w'] }}\n[models.m.equations]\n\
             states = {{ w = '{unit}' }}\ninputs = {{ u = '{input}' }}\nparameters = {{ T = 's' }}\nder = {{ w = \"{law}\" }}\nhorizon = '1 s'\n\
             [tuners]\nT = {{ start = 0.5, min = 0.1, max = 2 }}\n\
             [criteria]\nw = {{ crossover-frequency = {{}}, usage = 'monitor' }}\n"
        )
    };
    for (unit, input) in
        [("rad/s", "rad/s"), ("rpm", "rad/s"), ("deg/s", "rpm"), ("mm", "m"), ("V", "mV"), ("K", "degC")]
    {
        // 2/(T s + 1) has the gain 1 at sqrt(3)/T, T = 0.5 s.
        let found = values(&text(unit, input, "T*w' = 2*u - w"), "")[0].1;
        assert!((found - 2.0 * 3.0f64.sqrt()).abs() < 1e-9, "{unit} {input}: {found}");
    }
    for (unit, input, gain) in [("rad/s", "V", "1 [rad/s/V]"), ("rpm", "V", "1 [rpm/V]"), ("m", "N", "1 [mm/N]")] {
        let folder = study(&text(unit, input, &format!("T*w' = {gain}*u - w")), "");
        let (code, output) = mops(folder.path(), &["check", "study.toml"]);
        assert!(code == 2 && output.contains("unity feedback cannot close a loop from `u` in"), "{output}");
    }
}

/// Returns a loop `k/s` and an axis with the angular speed `w`, its frequency `f` and a rate `r`; all are 5 1/s for `k`
/// = 5.
fn speeds(criterion: &str) -> String {
    format!(
        "[study]\nname = 'speeds'\n[models.L.transfer-function]\nnumerator = ['k']\ndenominator = [1, 0]\n\
         [models.axis.equations]\nstates = {{ x = '1' }}\nparameters = {{ k = '1' }}\nder = {{ x = '0 [1/s]' }}\nhorizon = 1\n\
         outputs = {{ w = {{ value = 'k*1 [rad/s]', unit = 'rad/s' }}, f = {{ value = 'k*1 [Hz]', unit = 'Hz' }}, \
         r = {{ value = 'k*1 [1/s]', unit = '1/s' }} }}\n\
         [tuners]\nk = {{ start = 5, min = 4.999, max = 5.001 }}\n[criteria]\n\
         bw = {{ model = 'L', bandwidth = {{ of = 'closed-loop' }}, demand = '1 Hz' }}\nc = {{ {criterion} }}\n"
    )
}

#[test]
fn cycles_and_angles_of_a_demand_are_those_of_the_quantity_whatever_the_unit() {
    let bandwidth = "model = 'L', bandwidth = { of = 'closed-loop' }";
    let peak = |signal: &str| format!("model = 'axis', peak = {{ signal = '{signal}' }}");
    let [speed, frequency, rate] = ["w", "f", "r"].map(peak);
    // Value and scaled value in the unit of the answer.
    for (criterion, demand, expected, limit) in [
        (bandwidth, "demand = '1 Hz', unit = '1/s'", 5.0, std::f64::consts::TAU),
        (bandwidth, "demand = '1 Hz', unit = '1/min'", 300.0, 60.0 * std::f64::consts::TAU),
        (bandwidth, "demand = '1 1/s', unit = 'Hz'", 5.0 / std::f64::consts::TAU, 1.0 / std::f64::consts::TAU),
        (bandwidth, "good = '10 1/s', bad = '1 Hz'", 5.0 / std::f64::consts::TAU, 1.0),
        (bandwidth, "good = '10 Hz', bad = '1 1/s'", 5.0, 1.0),
        (bandwidth, "demand = '60 rpm', unit = '1/s'", 5.0, std::f64::consts::TAU),
        (&speed, "demand = '1 Hz', unit = '1/min'", 300.0, 60.0 * std::f64::consts::TAU),
        (&speed, "good = '1 1/s', bad = '10 Hz'", 5.0 / std::f64::consts::TAU, 10.0),
        (&frequency, "demand = '1 rad/s', unit = '1/s'", 5.0, 1.0 / std::f64::consts::TAU),
        (&frequency, "demand = '60 rpm', unit = '1/min'", 300.0, 60.0),
        (&rate, "demand = '1 Hz', unit = '1/min'", 300.0, 60.0),
        (&rate, "demand = '1 rad/s'", 5.0, 1.0),
    ] {
        let text = speeds(&format!("{criterion}, {demand}"));
        let folder = study(&text, "");
        let (code, output) = mops(folder.path(), &["run", "study.toml", "--max-evaluations", "1", "--out", "out"]);
        assert!(code <= 1, "{output}");
        let c = &result(folder.path())["criteria"][1];
        let number = |key: &str| c[key].as_f64().unwrap_or(f64::NAN);
        assert!((number("value") / expected - 1.0).abs() < 1e-9, "{criterion} {demand}: {c}");
        let found = [number("demand"), number("bad")].into_iter().find(|number| !number.is_nan()).unwrap_or(f64::NAN);
        assert!((found / limit - 1.0).abs() < 1e-9, "{criterion} {demand}: {c}");
    }
    // A formula reads the bandwidth in rad/s, although it is shown in Hz.
    let formula = values(&speeds("model = 'L', expression = { value = '2*bw', unit = 'rad/s' }, demand = 1"), "");
    assert!((formula[1].1 - 10.0).abs() < 1e-9, "{formula:?}");
}

#[test]
fn cycles_beside_angles_are_refused_for_a_quantity_that_may_count_either() {
    for (criterion, message) in [
        ("model = 'axis', peak = { signal = 'r' }, good = '1 Hz', bad = '1 rad/s'", "the quantity counts neither"),
        ("model = 'axis', peak = { signal = 'r' }, demand = '60 rpm', unit = 'Hz'", "the quantity counts neither"),
        ("model = 'axis', expression = { value = 'maximum(w)' }, demand = '1 Hz'", "the value may count angles"),
        (
            "model = 'axis', expression = { value = 'maximum(w)' }, good = 0, bad = '60 rpm'",
            "the value may count cycles",
        ),
        (
            "model = 'axis', expression = { value = 'maximum(f)' }, demand = 1, unit = 'Hz'",
            "the value may count angles",
        ),
    ] {
        let folder = study(&speeds(criterion), "");
        let (code, output) = mops(folder.path(), &["check", "study.toml"]);
        let output = output.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(code == 2 && output.contains(message), "{criterion}: {output}");
    }
    let stated = "model = 'axis', expression = { value = 'maximum(w)', unit = 'rad/s' }, demand = '1 Hz'";
    assert!((values(&speeds(stated), "")[1].1 - 5.0 / std::f64::consts::TAU).abs() < 1e-9);
}

#[test]
fn a_tuner_in_another_unit_has_the_angles_of_its_parameter() {
    let text = |tuner: &str| {
        format!(
            "[study]\nname = 'm'\n[models.m.equations]\nstates = {{ x = 'rad' }}\nparameters = {{ w = 'rad/s' }}\n\
             der = {{ x = 'w' }}\nhorizon = '1 s'\n[tuners]\nw = {{ {tuner} }}\n\
             [criteria]\nend = {{ final-value = {{ signal = 'x' }}, demand = '1 rad' }}\n"
        )
    };
    for tuner in ["unit = '1/s'", "unit = '1/min'", "unit = 'rad/s'", "unit = 'Hz'"] {
        let found = values(&text(&format!("start = '1 Hz', min = '0.5 Hz', max = '2 Hz', {tuner}")), "");
        assert!((found[0].1 / std::f64::consts::TAU - 1.0).abs() < 1e-9, "{tuner}: {found:?}");
    }
}

#[test]
fn ratios_of_a_temperature_on_a_scale_are_refused() {
    let text = |unit: &str, rest: &str| {
        format!(
            "[study]\nname = 'm'\ntask = 'monte-carlo'\n[models.m.equations]\nstates = {{ T = '{unit}' }}\n\
             parameters = {{ Ta = '{unit}', Tb = '{unit}' }}\nder = {{ T = '(Ta - T)/1 [s] + (Tb - T)/1 [s]' }}\n\
             start = {{ T = '20 degC' }}\nhorizon = '1 s'\n[cases]\nc = {{ Tb = '20 degC' }}\n\
             [criteria]\nend = {{ final-value = {{ signal = 'T' }}, demand = '300 K' }}\n{rest}"
        )
    };
    let tuner =
        |scale: &str| format!("[tuners]\nTa = {{ start = '20 degC', min = '10 degC', max = '30 degC'{scale} }}\n");
    let uncertain = |of: &str| format!("{}[uncertain]\nTb = {{ {of} }}\n[monte-carlo]\nat = 'start'\n", tuner(""));
    let median = uncertain("log-normal = { median = '20 degC', deviation = 0.1 }");
    let interval = uncertain("log-normal = { interval = ['10 degC', '30 degC'] }");
    let logarithmic =
        tuner(", scale = 'log'") + "[uncertain]\nTb = { normal = { mean = '20 degC', deviation = '1 K' } }\n";
    for (rest, key) in [(&median, "log-normal"), (&interval, "log-normal"), (&logarithmic, "scale")] {
        for unit in ["degC", "degF", "K"] {
            let folder = study(&text(unit, rest), "");
            let (code, output) = mops(folder.path(), &["check", "study.toml"]);
            let output = output.split_whitespace().collect::<Vec<_>>().join(" ");
            match unit {
                "K" => assert_eq!(code, 0, "{key}: {output}"),
                _ => assert!(code == 2 && output.contains("depends on the zero of the scale"), "{key}: {output}"),
            }
        }
    }
}

#[test]
fn common_notations_of_units_are_read() {
    let text = "[study]\nname = 'm'\n[models.m.equations]\nstates = { x = 'J' }\nparameters = { E = 'J' }\nder = { x = 'E/1[s]' }\nhorizon = '1 s'\n\
                [tuners]\nE = { start = '2 Wh', min = '1 Wh', max = '1 kWh' }\n[criteria]\ny = { final-value = { signal = 'x' }, demand = 'DEMAND' }\n";
    let found = &values(&text.replace("DEMAND", "1 Wh"), "")[0];
    assert!((found.1 - 2.0).abs() < 1e-9 && found.2 == "Wh", "{found:?}");
    let refused = |demand: &str| {
        let folder = study(&text.replace("DEMAND", demand), "");
        mops(folder.path(), &["check", "study.toml"])
    };
    for (demand, message) in [
        ("0,8 kJ", "`0,8 kJ` has a decimal comma; write \"0.8 kJ\""),
        (&format!("1 {}m{}", "(".repeat(30_000), ")".repeat(30_000)), "the unit has 60001 characters"),
    ] {
        let (code, output) = refused(demand);
        assert!(code == 2 && output.contains(message), "{}", &output[..output.len().min(2000)]);
    }
}

const OVEN: &str = "
[study]
name = 'oven'
[models.o.equations]
states     = { T = 'SCALE', v = 'K/s' }
inputs     = { r = 'SCALE' }
parameters = { z = { unit = '1', default = 0.3 }, Tr = 'SCALE' }
der        = { T = 'v', v = '(r - T)/1 [s2] - 2*z*v/1 [s]' }
start      = { T = '20 degC' }
horizon    = '30 s'
[models.o.parameters]
Tr = '30 degC'
[tuners]
z = { start = 0.3, min = 0.1, max = 2.0 }
[cases]
on = { inputs.r.step = { before = '20 degC', after = '60 degC' } }
[criteria]
c = { CRITERION }
";

#[test]
fn a_demand_of_a_formula_on_a_temperature_scale_is_refused_and_one_in_kelvin_is_a_difference() {
    let text = |scale: &str, criterion: &str| OVEN.replace("SCALE", scale).replace("CRITERION", criterion);
    let refused = |scale: &str, value: &str, limits: &str| {
        let folder = study(&text(scale, &format!("expression = {{ value = '{value}' }}, {limits}")), "");
        let (code, output) = mops(folder.path(), &["check", "study.toml"]);
        assert!(code == 2 && output.contains("has a zero of its own"), "{scale} {value} {limits}: {output}");
    };
    let swing = "maximum(T) - minimum(T)";
    for value in [swing, "rms(T - r)", "maximum(T)", "mean(T - Tr)", "integral(T)/30 [s]"] {
        refused("degC", value, "demand = '3 degC'");
    }
    for scale in ["degC", "degF", "K"] {
        for limits in ["demand = '3 degF'", "good = '1 degC', bad = '3 K'", "good = 1, bad = '3 degF'"] {
            refused(scale, swing, limits);
        }
        // 40 K (1 + exp(-pi 0.3/sqrt(1 - 0.3^2))).
        let expected = 40.0 * (1.0 + math::exp(-std::f64::consts::PI * 0.3 / 0.91f64.sqrt()));
        for (demand, factor, unit) in
            [("demand = 3", 1.0, "K"), ("good = '1 K', bad = 3", 1.0, "K"), ("demand = '5.4 degR'", 1.8, "degR")]
        {
            let found = &values(&text(scale, &format!("expression = {{ value = '{swing}' }}, {demand}")), "")[0];
            assert!((found.1 - factor * expected).abs() < 1e-4 && found.2 == unit, "{scale} {demand}: {found:?}");
        }
    }
}

#[test]
fn a_difference_of_temperatures_takes_degc_as_kelvin_and_a_temperature_as_itself() {
    let text = |criterion: &str| OVEN.replace("SCALE", "degC").replace("CRITERION", criterion);
    for (criterion, shown) in [
        ("overshoot = { signal = 'T', target = '60 degC', absolute = true }, demand = '3 degC'", " 3  K"),
        ("steady-state-error = { signal = 'T', target = '60 degC' }, good = '1 degC', bad = '3 degC'", "1 .. 3  K"),
        ("peak = { signal = 'T' }, demand = '100 degC'", "100  degC"),
    ] {
        let (code, output) = mops(study(&text(criterion), "").path(), &["check", "study.toml"]);
        assert!(code == 0 && output.contains(shown), "{criterion}: {output}");
    }
}

#[test]
fn a_share_of_a_temperature_on_a_scale_is_refused() {
    let text = OVEN
        .replace("SCALE", "degC")
        .replace("CRITERION", "peak = { signal = 'T' }, demand = '100 degC'")
        .replace("[models.o.parameters]\nTr = '30 degC'\n", "")
        .replace("[tuners]\n", "[tuners]\nTr = { start = '30 degC', min = '20 degC', max = '40 degC' }\n")
        + "[uncertain]\nTr = { tolerance = 0.05 }\n[robust]\n";
    let (code, output) = mops(study(&text, "").path(), &["check", "study.toml"]);
    assert!(code == 2 && output.contains("depends on the zero of the scale"), "{output}");
}

#[test]
fn setpoint_weights_on_a_temperature_scale_are_refused() {
    let text = |scale: &str, pid: &str| {
        format!(
            "[study]\nname = 'p'\n[models.m.equations]\nstates = {{ T = '{scale}' }}\ninputs = {{ P = 'W', r = '{scale}' }}\n\
             parameters = {{ kp = {{ unit = 'W/K', default = 10.0 }} }}\nconstants = {{ C = '100 J/K', G = '1 W/K', Ta = '20 degC' }}\n\
             der = {{ T = '(P - G*(T - Ta))/C' }}\nstart = {{ T = '20 degC' }}\nhorizon = '100 s'\npid.P = {{ k = 'kp', Ti = '20 s', {pid} }}\n\
             [tuners]\nkp = {{ start = 10, min = 1, max = 20 }}\n[cases]\na = {{ inputs.r.constant = '60 degC' }}\n\
             [criteria]\nx = {{ peak = {{ signal = 'P' }}, demand = '1 W' }}\n"
        )
    };
    let plain = "setpoint = 'r', measured = 'T'";
    let check = |scale: &str, pid: &str| mops(study(&text(scale, pid), "").path(), &["check", "study.toml"]);
    for (scale, signals, weights) in [
        ("degC", plain, "wp = 0.5"),
        ("degF", plain, "wp = 'kp/20 [W/K]'"),
        ("degC", plain, "wd = 0, Td = '1 s'"),
        ("degC", "setpoint = '60 degC', measured = 'T'", "wp = 0"),
    ] {
        let (code, output) = check(scale, &format!("{signals}, {weights}"));
        assert!(code == 2 && output.contains("depends on the zero of the scale"), "{scale} {weights}: {output}");
    }
    assert_eq!(check("degC", &format!("{plain}, wp = 1, wd = 0")).0, 0);
    // A difference has one meaning on all scales.
    let of = |scale: &str| values(&text(scale, "setpoint = 'r - Ta', measured = 'T - Ta', wp = 0.5"), "")[0].1;
    assert!((of("degC") - of("K")).abs() < 1e-3 && of("degC") >= 200.0, "{} {}", of("degC"), of("K"));
}

#[test]
fn radiation_has_the_absolute_zero_of_the_scale_of_its_state() {
    let text = |scale: &str, values: &str| {
        format!(
            "[study]\nname = 'r'\n[models.m.equations]\nstates = {{ T = '{scale}' }}\nparameters = {{ C = {{ unit = 'J/K', default = 100.0 }} }}\n\
             der = {{ T = \"C*T' = 0 [W]\" }}\nstart = {{ T = '400 degC' }}\nhorizon = '1000 s'\n\
             [models.m.effects.rad.radiation-loss]\nplace = 'process:T'\n[models.m.parameters]\n{values}\n\
             [tuners]\nC = {{ start = 100, min = 10, max = 1000 }}\n[criteria]\nT = {{ final-value = {{ signal = 'T' }}, demand = '1 {scale}' }}\n"
        )
    };
    let k = "'rad.k' = 1e-9\n'rad.around' = '20 degC'\n";
    let known = values(&text("K", &format!("{k}'rad.zero' = 0")), "")[0].1;
    assert!(known > 300.0 && known < 600.0, "{known}");
    for (scale, zero, around) in [
        ("degC", "", "20 degC"),
        ("degC", "'rad.zero' = '273.15 K'", "293.15 K"),
        ("degC", "'rad.zero' = 273.15", "68 degF"),
        ("K", "'rad.zero' = 0", "293.15 K"),
    ] {
        let found = &values(&text(scale, &format!("{}{zero}", k.replace("20 degC", around))), "")[0];
        let kelvin = if scale == "K" { found.1 } else { found.1 + 273.15 };
        assert!((kelvin - known).abs() < 1e-3, "{scale} {zero}: {found:?} {known}");
    }
    let folder = study(&text("degC", &format!("{k}'rad.zero' = '0 degC'")), "");
    let (code, output) = mops(folder.path(), &["check", "study.toml"]);
    assert!(code == 2 && output.contains("has a zero of its own"), "{output}");
}

#[test]
fn a_definition_without_a_unit_gets_one_where_it_is_defined() {
    let text = "[study]\nname = 'm'\n[models.m.equations]\nstates = { x = 'rad' }\nparameters = { k = '1/s' }\nconstants = { th = '20 deg' }\n\
                let = { g = '3', s = 'g + th' }\nder = { x = 'k*(s - x)' }\nhorizon = '1 s'\n\
                [tuners]\nk = { start = 1, min = 0.1, max = 2 }\n[criteria]\ny = { final-value = { signal = 'x' }, demand = 1 }\n";
    let (code, output) = mops(study(text, "").path(), &["check", "study.toml"]);
    let output = output.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(code == 2 && output.contains("give `g` a unit where it is defined, as in \"3 [1]\""), "{output}");
}
