//! Linear systems from the command line: linearisation, state feedback, several models in a study, frequency responses.

use std::path::Path;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin_cmd;
use mops_math as math;
use serde_json::Value;

fn mops(arguments: &[&str]) -> Command {
    let mut command = cargo_bin_cmd!("mops");
    command.args(arguments);
    command
}

fn study(folder: &Path, text: &str) -> String {
    let path = folder.join("study.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// `A` and `B` of the thesis (section 5.2).
const PENDULUM: &str = "
[study]
name = 'pendulum'
[models.pendulum.state-space]
a = [[0, 1, 0, 0], [-0.1082, 0, -25.4814, 0.0255], [0, 0, 0, 1], [0.0756, 0, 45.7597, -0.0458]]
b = [[0], [1444.1], [0], [-1008.5]]
c = [[1, 0, 0, 0], [0, 0, 1, 0]]
states = ['phi', 'dphi', 'theta', 'dtheta']
outputs = ['phi', 'theta']
[criteria]
slowest = { slowest-pole = { output = 'phi' }, usage = 'monitor' }
";

#[test]
fn the_pendulum_of_the_thesis_gets_the_published_state_feedback_and_plots() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (study(folder.path(), PENDULUM), folder.path().join("out"));
    let placed = mops(&["linearise", &file, "--place=-5,-8,-10,-14", "--out", out.to_str().unwrap()]);
    let printed = { placed }.output().unwrap();
    let text = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.status.success() && text.contains("-0.138746") && text.contains("theta/u"), "{text}");
    let found = json(&out.join("linearised.json"));
    let k = found["feedback"]["k"][0].as_array().unwrap();
    for (k, expected) in k.iter().zip([-0.138_746_07, -0.068_978_83, -0.734_559_28, -0.135_415_5]) {
        assert!((k.as_f64().unwrap() - expected).abs() < 5e-9, "{k} {expected}");
    }
    for plot in ["bode-magnitude", "bode-phase", "nyquist", "root-locus"] {
        for extension in ["svg", "png"] {
            let size = std::fs::metadata(out.join(format!("{plot}-theta-u.{extension}"))).unwrap().len();
            assert!(size > 1000, "{plot}.{extension}");
        }
    }
}

#[test]
fn a_nonlinear_model_is_linearised_at_its_equilibrium() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let at = ["--at", "theta=3", "--equilibrium", "--free", "theta", "--case", "horizontal"];
    let arguments = [&["linearise", "furuta-calibration", "--out", out.to_str().unwrap()], &at[..]].concat();
    let printed = mops(&arguments).output().unwrap();
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    let theta = json(&out.join("linearised.json"))["at"]["states"][2].as_f64().unwrap();
    assert!((theta - std::f64::consts::PI).abs() < 1e-9, "{theta}");
}

#[test]
fn errors_of_linearise_suggest_a_fix() {
    let folder = tempfile::tempdir().unwrap();
    let file = study(folder.path(), PENDULUM);
    for (arguments, fact) in [
        (vec!["--place=-5,-8"], "expected 4 poles, one per state, found 2"),
        (vec!["--place=-5,-8,-1+2i,-3"], "has no conjugate"),
        (vec!["--lqr", "1,1"], "expected 4 weights of states and 1 of inputs"),
        (vec!["--output", "thet"], "did you mean `theta`?"),
        (vec!["--at", "theta=1"], "no such tuner or parameter"),
    ] {
        let output = mops(&[&["linearise", &file], &arguments[..]].concat()).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.replace('\n', " ").contains(fact), "{message}");
    }
}

#[test]
fn errors_in_the_linearisation_of_a_study_have_a_position() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = |linearise: &str, criterion: &str| {
        let text = format!(
            "[study]\nname = 'x'\n[models.a]\npid-loop = {{ plant = {{ poles = [-1] }}, horizon = 5 }}\n\
             linearise = {linearise}\nparameters = {{ k = 1, Ti = 1, Td = 0 }}\n[criteria]\nc = {{ {criterion}, demand = 1 }}\n"
        );
        let output = mops(&["check", &study(folder.path(), &text)]).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap().replace('\n', " ")
    };
    let input = wrong("{ inputs = ['v'] }", "hinf-norm = {}");
    assert!(input.contains("study.toml:5:25") && input.contains("no input `v`"), "{input}");
    let at = wrong("{ at = { x1 = '1 s' } }", "hinf-norm = {}");
    assert!(at.contains("study.toml:5:27"), "{at}");
    let channel = wrong("{ inputs = ['r'] }", "hinf-norm = {}");
    assert!(channel.contains("5 outputs") && channel.contains("add output ="), "{channel}");
    let sort = wrong("{}", "overshoot = { signal = 'y' }");
    assert!(sort.contains("`a` is a linear system"), "{sort}");
}

/// The optimum is from two solvers; margins and peaks there agree with NumPy on a grid of 4e6 frequencies.
#[test]
#[ignore = "full tier"]
fn one_study_combines_a_simulation_and_stability_margins() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = mops(&["run", "multi-model", "--json", "--out", out.to_str().unwrap()]).output().unwrap();
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["feasible"], true);
    let worst = result["worst_scaled"].as_f64().unwrap();
    assert!((worst - 0.631_02).abs() < 2e-4, "{worst}");
    let criteria = result["criteria"].as_array().unwrap();
    let value = |name: &str| criteria.iter().find(|c| c["name"] == name).unwrap()["value"].as_f64().unwrap();
    assert!((value("sensitivity") - 1.4).abs() < 1e-5, "{}", value("sensitivity"));
    assert!(out.join("plots/nominal-margins-magnitude-y-e.svg").is_file());
}

#[test]
fn a_lag_with_delay_is_identified_from_its_frequency_response() {
    let folder = tempfile::tempdir().unwrap();
    let (k, t, l) = (3.0, 0.5, 0.2);
    let mut data = "f [Hz],magnitude [dB],phase [deg]\n".to_owned();
    for i in 0..30 {
        let f = 0.05 * math::powi(1.15, i);
        let w = std::f64::consts::TAU * f;
        let size: f64 = k / (1.0 + math::powi(w * t, 2)).sqrt();
        let phase = (-math::atan(w * t) - w * l).to_degrees();
        data += &format!("{f},{},{phase}\n", 20.0 * math::log10(size));
    }
    std::fs::write(folder.path().join("sweep.csv"), data).unwrap();
    let text = "
[study]
name = 'lag'
task = 'calibration'
[models.lag.transfer-function]
numerator = ['K']
denominator = ['T', 1]
delay = 'L'
units = { T = 's', L = 's' }
[tuners]
K = { start = 1, min = 0.1, max = 10 }
T = { start = 1, min = 0.1, max = 10 }
L = { start = 0, min = 0, max = 1 }
[experiments.sweep]
file = 'sweep.csv'
frequency = 'f'
responses = { y = { magnitude = 'magnitude', phase = 'phase' } }
[criteria]
response = { frequency-fit = { signal = 'y' }, demand = 1 }
";
    let (file, out) = (study(folder.path(), text), folder.path().join("out"));
    let output = mops(&["run", &file, "--json", "--out", out.to_str().unwrap()]).output().unwrap();
    let result: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
    for (tuner, exact) in result["tuners"].as_array().unwrap().iter().zip([k, t, l]) {
        let found = tuner["value"].as_f64().unwrap();
        assert!((found - exact).abs() < 1e-6, "{tuner}");
    }
}

#[test]
fn a_measured_frequency_response_is_converted_to_the_units_of_the_model_or_refused() {
    // One second-order joint, 0.01 w' = u - 0.6 ph: 1/0.6 rad/(N m) at rest.
    let folder = tempfile::tempdir().unwrap();
    let text = "
[study]
name = 'joint'
[models.p.equations]
states = { ph = 'rad', w = 'rad/s' }
inputs = { u = 'N m' }
der = { ph = 'w', w = \"0.01 [kg m2]*w' = u - 0.6 [N m]*ph\" }
[models.p.linearise]
[experiments.sweep]
file = 'sweep.csv'
frequency = 'f'
responses = { ph = { magnitude = 'm', phase = 'p' } }
[criteria]
response = { frequency-fit = { signal = 'ph', input = 'u' }, demand = 1 }
";
    let file = study(folder.path(), text);
    let measured = |unit: &str, size: f64| {
        let data = format!("f [Hz],m [{unit}],p [deg]\n0,{size},0\n");
        std::fs::write(folder.path().join("sweep.csv"), data).unwrap();
        let output = mops(&["run", &file, "--json", "--out", folder.path().join("out").to_str().unwrap()]).output();
        let output = output.unwrap();
        let result: Result<Value, _> = serde_json::from_slice(&output.stdout);
        result.map(|r| r["worst_scaled"].as_f64().unwrap()).map_err(|_| String::from_utf8(output.stderr).unwrap())
    };
    for (unit, size) in
        [("1", 1.0 / 0.6), ("rad/(N m)", 1.0 / 0.6), ("mrad/(N m)", 1e3 / 0.6), ("deg/(N m)", 95.492_966)]
    {
        assert!(measured(unit, size).unwrap() < 1e-12, "{unit}");
    }
    let wrong = measured("rad/V", 1.0).unwrap_err();
    assert!(wrong.contains("expected a response in `rad/(N m)`, found `rad/V`"), "{wrong}");
    assert!(wrong.contains("study.toml:12:15"), "{wrong}");
}

#[test]
fn dry_friction_does_not_contribute_to_an_equilibrium_and_rounding_errors_are_not_printed() {
    let text = "
[study]
name = 'joint'
[models.p.equations]
states = { ph = 'rad', w = 'rad/s' }
inputs = { u = 'N m' }
der = { ph = 'w', w = \"0.01 [kg m2]*w' = u - 0.6 [N m]*sin(ph)\" }
friction.ph = { coulomb = 0.05, viscous = 0.002 }
horizon = '1 s'
[cases]
a = { inputs.u.constant = 0.3 }
[criteria]
p = { peak = { signal = 'ph' }, usage = 'monitor' }
";
    let folder = tempfile::tempdir().unwrap();
    let file = study(folder.path(), text);
    let arguments = ["linearise", &file, "--at", "ph=0.3", "--equilibrium"];
    let found = mops(&[&arguments[..], &["--free", "u", "--lqr", "1,1,1"]].concat()).output().unwrap();
    let text = String::from_utf8(found.stdout).unwrap();
    for part in
        ["0.177312", "note: dry friction of `ph` is ignored", "\n  (100 s)/(s^2 ", "zeros (1/s): 0\n", "u [N m]"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("u/u"), "{text}");
    let fixed = mops(&arguments).output().unwrap();
    let error = String::from_utf8(fixed.stderr).unwrap();
    assert!(error.contains("`ph` still changes by") && error.contains("the input `u` is fixed, --free"), "{error}");
}

#[test]
fn repeated_poles_with_several_inputs_are_placed_or_refused_and_their_sensitivity_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let text = "
[study]
name = 'axis-and-pump'
[models.m.state-space]
a = [[0, 1, 0, 0], [0, -2, 4, 0], [0, -1, -30, 0], [0, 0, 0, -0.05]]
b = [[0, 0], [0, 0], [8, 0], [0, 0.4]]
c = [[1, 0, 0, 0]]
[criteria]
slowest = { slowest-pole = { input = 'u1' }, usage = 'monitor' }
";
    let (file, out) = (study(folder.path(), text), folder.path().join("out"));
    let placed = mops(&["linearise", &file, "--place=-3,-3,-9,-9", "--out", out.to_str().unwrap()]).output().unwrap();
    let printed = String::from_utf8(placed.stdout).unwrap();
    assert!(placed.status.success(), "{}", String::from_utf8_lossy(&placed.stderr));
    for part in [
        "controllability indices 3, 1",
        "sensitivity: a relative change of A and B of 1e-6",
        "linearised.json and 8 plots are in",
    ] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    let feedback = &json(&out.join("linearised.json"))["feedback"];
    assert!(feedback["error"].as_f64().unwrap() < 1e-5, "{feedback}");
    for pole in feedback["poles"].as_array().unwrap() {
        let (re, im) = (pole[0].as_f64().unwrap(), pole[1].as_f64().unwrap());
        assert!(im.abs() < 1e-5 && ((re + 3.0).abs() < 1e-5 || (re + 9.0).abs() < 1e-5), "{pole}");
    }
    let largest = feedback["k"].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
    assert!(largest.map(|k| k.as_f64().unwrap().abs()).fold(0.0, f64::max) < 200.0, "{feedback}");
    // An input without effect: the rank is reported, and all other results.
    std::fs::remove_dir_all(&out).unwrap();
    let file = study(folder.path(), &text.replace("0.4", "0"));
    let refused = mops(&["linearise", &file, "--place=-3,-3,-9,-9", "--out", out.to_str().unwrap()]).output().unwrap();
    let message = String::from_utf8(refused.stderr).unwrap().replace('\n', " ");
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(message.contains("rank 3 of 4") && message.contains("-0.050000"), "{message}");
    assert!(json(&out.join("linearised.json"))["feedback"].is_null());
}

#[test]
fn several_free_axes_have_poles_at_zero_and_all_their_plots() {
    let folder = tempfile::tempdir().unwrap();
    // Four axes: the last one is attached to a spring, the others move freely.
    let text = "
[study]
name = 'stage'
[models.m.state-space]
a = [
  [0, 0, 0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 0, 0, 0, 1],
  [7, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, -3, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 0], [0, 11, 0, -25, 0, 0, 0, 0],
]
b = [[0], [0], [0], [0], [0], ['-40*k'], ['3*k'], ['k']]
c = [[0, 0, 1, 1, 0, 0, 0, 0]]
[tuners]
k = { start = 1, min = -1e6, max = 1e6 }
[criteria]
slowest = { slowest-pole = { of = 'closed-loop' }, usage = 'monitor' }
";
    let (file, out) = (study(folder.path(), text), folder.path().join("out"));
    let printed = mops(&["linearise", &file, "--out", out.to_str().unwrap()]).output().unwrap();
    let shown = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    let poles = shown.split("pole (1/s)").nth(1).unwrap();
    assert_eq!(poles.lines().filter(|line| line.trim_start().starts_with("0  ")).count(), 6, "{shown}");
    assert!(poles.contains("0 + 5i") && poles.contains("0 - 5i"), "{shown}");
    assert!(
        out.join("root-locus-y-u.svg").is_file() && shown.contains("linearised.json and 4 plots are in"),
        "{shown}"
    );
    for k in ["-1e6", "-3.7", "0.01", "4242.4242", "1e6"] {
        let at = mops(&["simulate", &file, "--at", &format!("k={k}")]).output().unwrap();
        assert!(at.status.success(), "{k}: {}", String::from_utf8_lossy(&at.stderr));
    }
}

#[test]
fn the_output_does_not_mention_plots_that_were_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let text = "
[study]
name = 'alone'
[models.m.equations]
states = { x = '1' }
der = { x = '-2*x + 1' }
horizon = 1
[criteria]
x = { final-value = { signal = 'x' }, usage = 'monitor' }
";
    let (file, out) = (study(folder.path(), text), folder.path().join("out"));
    let printed = mops(&["linearise", &file, "--out", out.to_str().unwrap()]).output().unwrap();
    let shown = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.status.success() && shown.contains("without plots, as the system has no input"), "{shown}");
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
}

/// Tank with a free outlet, and spring with zero stiffness at rest.
fn vessel(der: &str) -> String {
    format!(
        "
[study]
name = 'vessel'
[models.m.equations]
states = {{ x = '1' }}
inputs = {{ u = '1' }}
parameters = {{ k = '' }}
der = {{ x = '{der}' }}
outputs = {{ size = 'abs(x)' }}
horizon = 1
[tuners]
k = {{ start = 2, min = 0.1, max = 10 }}
[criteria]
x = {{ final-value = {{ signal = 'x' }}, usage = 'monitor' }}
"
    )
}

#[test]
fn a_linearisation_that_does_not_exist_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for der in
        ["u - k*sqrt(x)", "u - k*x^0.5", "u - k*abs(x)", "u - sign(x)", "max(x, k*x) + u", "k*asin(1 - abs(x)) + u"]
    {
        let refused = mops(&["linearise", &study(folder.path(), &vessel(der))]).output().unwrap();
        let message = String::from_utf8(refused.stderr).unwrap().replace('\n', " ");
        assert_eq!(refused.status.code(), Some(3), "{der}: {message}");
        assert!(
            message.contains("the rate of `x` is not differentiable with respect to `x` at x = 0"),
            "{der}: {message}"
        );
    }
    // At other points, and for smooth equations, the linearisation exists. An output that is not differentiable gets a
    // note.
    for (der, at) in
        [("u - k*sqrt(x)", "x=0.25"), ("u - k*x^1.5", "x=0"), ("u - k*x*abs(x)", "x=0"), ("u - k*abs(x)", "x=-1")]
    {
        let found = mops(&["linearise", &study(folder.path(), &vessel(der)), "--at", at]).output().unwrap();
        let shown = String::from_utf8(found.stdout).unwrap();
        assert!(found.status.success(), "{der}: {}", String::from_utf8_lossy(&found.stderr));
        let rough = at == "x=0" && !der.contains('^');
        assert_eq!(shown.contains("note: `size` is not differentiable with respect to `x`"), rough, "{der}: {shown}");
    }
    // In a study, criteria of the linearisation have no value there.
    let text = vessel("u - k*sqrt(x)")
        .replace("horizon = 1", "horizon = 1\n[models.m.linearise]\noutputs = ['x']")
        .replace("final-value = { signal = 'x' }", "slowest-pole = {}");
    let none = mops(&["simulate", &study(folder.path(), &text)]).output().unwrap();
    let message = String::from_utf8(none.stdout).unwrap() + &String::from_utf8(none.stderr).unwrap();
    assert!(!none.status.success() && message.contains("is not differentiable with respect to `x`"), "{message}");
}

#[test]
fn an_equilibrium_is_found_from_a_start_without_a_slope() {
    let folder = tempfile::tempdir().unwrap();
    // Equilibrium for k = 2, computed by hand.
    for (der, u, expected) in [
        ("u - k*sqrt(x)", "1", 0.25),
        ("u - k*sqrt(x)", "50", 625.0),
        ("u - k*x^0.5", "0.02", 1e-4),
        ("u - k*x^3", "54", 3.0),
        ("u - k*x^3", "-2e-6", -0.01),
        ("u - k*x^5", "64", 2.0),
        ("u - k*x*abs(x)", "18", 3.0),
        ("u - deadzone(k*x, -1, 1)", "3", 2.0),
        ("u - k*max(x - 1, 0)", "4", 3.0),
        ("u + k*ln(x)", "2", 0.367_879_441_171_442_3),
    ] {
        let (file, out) = (study(folder.path(), &vessel(der)), folder.path().join("out"));
        let at = format!("u={u}");
        let arguments =
            ["linearise", &file, "--at", &at, "--equilibrium", "--output", "x", "--out", out.to_str().unwrap()];
        let found = mops(&arguments).output().unwrap();
        assert!(found.status.success(), "{der}: {}", String::from_utf8_lossy(&found.stderr));
        let x = json(&out.join("linearised.json"))["at"]["states"][0].as_f64().unwrap();
        assert!((x - expected).abs() < 1e-7 * expected.abs().max(0.01), "{der} {u}: {x}");
    }
}

#[test]
fn a_parameter_without_a_value_may_be_set_by_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    let text = "[study]\nname = 'x'\n[models.a.equations]\nstates = { x = '1' }\ninputs = { u = '1' }\n\
                parameters = { T = 's' }\nder = { x = '(u - x)/T' }\nhorizon = '1 s'\n";
    std::fs::write(&study, text).unwrap();
    let linearise = |at: &[&str]| {
        let arguments = [&["linearise", study.to_str().unwrap()], at].concat();
        let output = cargo_bin_cmd!("mops").args(&arguments).output().unwrap();
        String::from_utf8([output.stdout, output.stderr].concat()).unwrap()
    };
    let set = linearise(&["--at", "T=500 ms"]);
    assert!(set.lines().any(|line| line.split_whitespace().collect::<Vec<_>>() == ["-2", "1", "2", "0.5"]), "{set}");
    assert!(linearise(&[]).contains("the parameter `T` has no value"));
}

#[test]
fn low_passes_given_in_s_have_gain_one_and_their_bandwidth_at_fast_sampling() {
    // Butterworth filters of order 3 and 6 with cut-off w: products of s^2/w^2 + 2 d s/w + 1, and s/w + 1.
    let third = |w: f64| vec![1.0 / (w * w * w), 2.0 / (w * w), 2.0 / w, 1.0];
    let sixth = |w: f64| {
        let dampings = [1.0, 3.0, 5.0].map(|k| math::sin(std::f64::consts::PI * k / 12.0));
        dampings.iter().fold(vec![1.0], |all, damping| {
            let mut product = vec![0.0; all.len() + 2];
            for (i, x) in all.iter().enumerate() {
                for (j, y) in [1.0 / (w * w), 2.0 * damping / w, 1.0].iter().enumerate() {
                    product[i + j] += x * y;
                }
            }
            product
        })
    };
    let folder = tempfile::tempdir().unwrap();
    for (denominator, hertz, rate) in [(third as fn(f64) -> Vec<f64>, 0.05, 5e3), (sixth, 1.0, 1e3), (sixth, 1.0, 1e4)]
    {
        let below = denominator(std::f64::consts::TAU * hertz);
        let text = format!(
            "[study]\nname = 'filter'\n\
             [models.f.equations]\nstates = {{ x = '1' }}\ninputs = {{ r = '1' }}\nder = {{ x = '(u - x)/1 [s]' }}\nhorizon = 1.0\n\
             clocks.c.every = {:?}\nclocks.c.memory = {{ u = '1' }}\n\
             clocks.c.filter.u = {{ of = 'r', continuous = {{ numerator = [1], denominator = {below:?} }} }}\n\
             [models.lin]\nlike = 'f'\nlinearise = {{ outputs = ['u'] }}\n\
             [criteria]\nhinf = {{ model = 'lin', hinf-norm = {{}}, usage = 'monitor' }}\n\
             bw = {{ model = 'lin', bandwidth = {{}}, unit = 'Hz', usage = 'monitor' }}\n",
            1.0 / rate
        );
        let printed = mops(&["simulate", &study(folder.path(), &text)]).output().unwrap();
        let printed = String::from_utf8(printed.stdout).unwrap();
        let image = rate / std::f64::consts::PI * math::atan(std::f64::consts::PI * hertz / rate);
        for (name, expected) in [("hinf", 1.0), ("bw", image)] {
            let row = printed.lines().find(|line| line.split_whitespace().nth(1) == Some(name)).expect("a row");
            let value = row.split_whitespace().nth(3).and_then(|x| x.parse::<f64>().ok());
            // Six digits are printed.
            assert!(value.is_some_and(|value| (value - expected).abs() < 1e-5 * expected), "at {rate} Hz: {printed}");
        }
    }
}
