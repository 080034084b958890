//! Inputs of cases and recordings as they come: waveforms against closed forms, and data files of other forms.

use std::f64::consts::TAU;
use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use mops_math as math;
use serde_json::Value;

#[path = "common/studies.rs"]
mod studies;

use studies::{run, value};

/// Returns standard output and standard error of `mops check`.
fn check(folder: &Path, text: &str) -> String {
    printed("check", folder, text)
}

/// Returns standard output and standard error of a command on a study.
fn printed(command: &str, folder: &Path, text: &str) -> String {
    let study = folder.join("study.toml");
    std::fs::write(&study, text).unwrap();
    let output = cargo_bin_cmd!("mops").current_dir(folder).args([command, "study.toml"]).output().unwrap();
    let all = [&output.stdout[..], &output.stderr].concat();
    String::from_utf8(all).unwrap()
}

/// A study of an integrator `x' = u` with a case for each input.
fn integrators(cases: &[(&str, &str)], horizon: f64) -> String {
    let cases: String = cases.iter().map(|(name, input)| format!("{name} = {{ inputs.u{input} }}\n")).collect();
    format!(
        "[study]\nname = 'inputs'\n[models.plant.equations]\nstates = {{ x = '1' }}\ninputs = {{ u = '1/s' }}\n\
         der = {{ x = 'u' }}\nhorizon = '{horizon} s'\n[cases]\n{cases}\
         [criteria]\nend = {{ final-value = {{ signal = 'x' }}, usage = 'monitor' }}\n"
    )
}

/// Integral of a function from 0 to `end` by Simpson's rule over many intervals.
fn integral(f: impl Fn(f64) -> f64, end: f64) -> f64 {
    let n = 20_000;
    let h = end / f64::from(n);
    (0..n).map(|k| h / 6.0 * (f(h * f64::from(k)) + 4.0 * f(h * (f64::from(k) + 0.5)) + f(h * f64::from(k + 1)))).sum()
}

#[test]
fn every_waveform_has_its_integral() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("u.csv"), "t[s],u[1/min]\n0,60\n1,120\n3,0\n").unwrap();
    // The phase is the integral of the frequency.
    let chirp = |from: f64, to: f64, t: f64| integral(|s| math::sin(TAU * (from + 0.5 * (to - from) * s / t) * s), t);
    let logarithmic = |from: f64, to: f64, t: f64| {
        let rate = math::ln(to / from) / t;
        integral(|s| math::sin(TAU * from / rate * (math::exp(rate * s) - 1.0)), t)
    };
    let sine = |w: f64, phase: f64| (math::cos(phase) - math::cos(w * 10.0 + phase)) / w;
    let expected: Vec<(&str, &str, f64)> = vec![
        ("number", " = 2.5", 25.0),
        ("quantity", " = '30 1/min'", 5.0),
        ("step", ".step = { time = 4, before = 1, after = 3 }", 22.0),
        ("ramp", ".ramp = { time = 2, duration = '4 s', before = 1, after = 3 }", 2.0 + 8.0 + 12.0),
        ("pulse", ".pulse = { time = 1, width = 0.5, value = 3, before = 1 }", 11.0),
        ("train", ".pulse = { time = 1, width = 0.5, value = 3, before = 1, period = 2 }", 15.0),
        ("doublet", ".doublet = { time = 1, width = 2, amplitude = 3, offset = 0.5 }", 5.0),
        ("half", ".doublet = { time = 7, width = 2, amplitude = 3 }", 3.0),
        ("sine", ".sine = { amplitude = 2, frequency = '0.3 Hz', phase = 1 }", 2.0 * sine(TAU * 0.3, 1.0)),
        ("chirp", ".chirp = { amplitude = 1, from = 0.2, to = 2 }", chirp(0.2, 2.0, 10.0)),
        (
            "late",
            ".chirp = { amplitude = 2, from = 0.2, to = 1, time = 3, duration = 4, offset = 1 }",
            10.0 + 2.0 * chirp(0.2, 1.0, 4.0),
        ),
        ("log", ".chirp = { amplitude = 1, from = 0.2, to = 2, sweep = 'logarithmic' }", logarithmic(0.2, 2.0, 10.0)),
        // 7 intervals of 1 s: the sequence of three stages has one more upper value.
        ("prbs", ".prbs = { amplitude = 2, interval = 1, stages = 3, time = 2, offset = 0.1 }", 1.0 + 2.0 + 2.0),
        ("zero", ".table = { time = [1, 2, 4], value = [1, 5, 0], hold = 'zero' }", 1.0 + 1.0 + 10.0),
        ("first", ".table = { time = [1, 2, 4], value = [1, 5, 0] }", 1.0 + 3.0 + 5.0),
        ("file", ".file = { path = 'u.csv', column = 'u', hold = 'first' }", 1.5 + 2.0),
        (
            "sum",
            " = [1, { step = { time = 4, after = 2 } }, { sine = { amplitude = 2, frequency = '0.3 Hz' } }]",
            10.0 + 12.0 + 2.0 * sine(TAU * 0.3, 0.0),
        ),
    ];
    let cases: Vec<(&str, &str)> = expected.iter().map(|(name, input, _)| (*name, *input)).collect();
    let found = run(folder.path(), &integrators(&cases, 10.0));
    for (name, _, expected) in expected {
        let found = value(&found, name, "end");
        assert!((found - expected).abs() < 1e-7 * (1.0 + expected.abs()), "{name}: {found}, not {expected}");
    }
    // Breaks of the parts of a sum that agree up to rounding are one: these pulses cover each other's pauses.
    let whole = " = [{ pulse = { period = '0.3 s', width = '0.1 s', value = 1 } }, \
                 { pulse = { time = '0.1 s', period = '0.3 s', width = '0.2 s', value = 1 } }]";
    let text = integrators(&[("whole", whole)], 3.0)
        + "most = { peak = { signal = 'u' }, usage = 'monitor' }\nleast = { expression = { value = 'minimum(u)' }, usage = 'monitor' }\n";
    let found = run(folder.path(), &text);
    assert_eq!((value(&found, "whole", "most"), value(&found, "whole", "least")), (1.0, 1.0));
    // Sines of 1, 2, .., 5 Hz have no mean over whole periods; what remains is the offset.
    let multisine = ".multisine = { amplitude = 1, from = 1, to = 5, count = 5, offset = 0.2 }";
    let found = run(folder.path(), &integrators(&[("many", multisine)], 3.0));
    assert!((value(&found, "many", "end") - 0.6).abs() < 1e-7);
}

#[test]
fn a_criterion_reads_a_window_as_if_the_simulation_began_there() {
    // x' = -x + u + d: a setpoint step at 0 s and a disturbance at 20 s share a simulation.
    let text = "[study]\nname = 'window'\n[models.plant.equations]\nstates = { x = 'rad' }\ninputs = { u = 'rad', d = 'rad' }\n\
                der = { x = \"1 [s]*x' = u + d - x\" }\nhorizon = '40 s'\n\
                [cases]\nboth = { inputs.u.step.after = 1, inputs.d.step = { time = 20, after = 0.5 } }\n\
                [criteria]\n\
                first = { settling-time = { signal = 'x', target = 1, from = 0, band = 0.02 }, until = '20 s', demand = '5000 ms' }\n\
                second = { settling-time = { signal = 'x', target = 1.5, from = 1, band = 0.02 }, from = '20 s', usage = 'monitor' }\n\
                late = { peak = { signal = 'x' }, from = '21 s', until = '22 s', unit = 'deg', usage = 'monitor' }\n\
                area = { iae = { signal = 'x', target = 1.5 }, from = 20, usage = 'monitor' }\n\
                sum = { expression = { value = 'first + 2*second' }, usage = 'monitor' }\n\
                most = { expression = { value = 'maximum(x)', unit = 'deg' }, from = 10, until = 20, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), text);
    let found = |name: &str| value(&result, "both", name);
    let settled = -math::ln(0.02);
    // Asked in milliseconds, answered in milliseconds.
    assert!((found("first") - 1e3 * settled).abs() < 1e-3, "{}", found("first"));
    let recovered = math::ln(0.5 / 0.02);
    assert!((found("second") - recovered).abs() < 1e-6, "{}", found("second"));
    let degrees = 360.0 / TAU;
    assert!((found("late") - degrees * (1.5 - 0.5 * math::exp(-2.0))).abs() < 1e-5, "{}", found("late"));
    assert!((found("area") - 0.5 * (1.0 - math::exp(-20.0))).abs() < 1e-6, "{}", found("area"));
    assert!((found("sum") - settled - 2.0 * recovered).abs() < 1e-5, "{}", found("sum"));
    assert!((found("most") - degrees * (1.0 - math::exp(-20.0))).abs() < 1e-5, "{}", found("most"));
    let row = result["criteria"].as_array().unwrap().iter().find(|row| row["name"] == "first").unwrap();
    assert_eq!((row["unit"].as_str(), row["demand"].as_f64()), (Some("ms"), Some(5000.0)));
    for (change, fact) in [
        ("from = '21 s', until = '22 s'\u{2192}from = '21 s', until = '20 s'", "is not after `from`"),
        ("from = '21 s', until = '22 s'\u{2192}from = '-1 s'", "before the start"),
        ("until = '22 s'\u{2192}until = '41 s'", "is after the end of the simulation at 40 s in case `both`"),
        ("until = 20, usage\u{2192}until = 400, usage", "is after the end of the simulation"),
        ("unit = 'deg', usage\u{2192}unit = 'm', usage", "not in `m`"),
        ("first + 2*second\u{2192}sum + 1 [s]", "circular reference"),
        ("first + 2*second\u{2192}first + late", "same dimension"),
        ("first + 2*second\u{2192}third", "neither another criterion"),
    ] {
        let (from, to) = change.split_once('\u{2192}').unwrap();
        let message = check(folder.path(), &text.replace(from, to)).replace('\n', " ");
        assert!(message.contains(fact), "{change}: {message}");
    }
}

#[test]
fn a_formula_has_the_derivatives_of_its_parts() {
    // The minimum of k^2/1 + 1/k^2 over the gain, through a signal, a parameter and another criterion, lies at k = 1.
    let text = "[study]\nname = 'formula'\n[models.plant.equations]\nstates = { x = '1' }\nparameters = { k = '1/s' }\n\
                der = { x = 'k' }\nhorizon = '1 s'\n[tuners]\nk = { start = 3, min = 0.1, max = 10 }\n[criteria]\n\
                end = { final-value = { signal = 'x' }, usage = 'monitor' }\n\
                cost = { expression = { value = 'end*final(x) + 1/(k*1 [s])^2' }, demand = 1 }\n";
    let folder = tempfile::tempdir().unwrap();
    for solver in ["auto", "sqp"] {
        let result = run(folder.path(), &text.replace("[criteria]", &format!("[solver]\n{solver} = {{}}\n[criteria]")));
        let k = result["tuners"][0]["value"].as_f64().unwrap();
        assert!((k - 1.0).abs() < 1e-3, "{solver}: {k}");
    }
}

#[test]
fn a_wrong_input_is_refused_at_its_key() {
    let folder = tempfile::tempdir().unwrap();
    for (input, place, fact) in [
        (".ramp = { duration = 0, after = 1 }", "study.toml:9:38", "above 0 s"),
        (".pulse = { width = 2, value = 1, period = 1 }", "9:", "not longer than the pulse"),
        (".table = { time = [1, 1], value = [0, 1] }", "9:", "must increase"),
        (".table = { time = [1, 2], value = [0] }", "9:", "2 numbers"),
        (".prbs = { amplitude = 1, interval = 1, stages = 19 }", "9:", "from 2 to 18"),
        (".chirp = { amplitude = 1, from = 0, to = 1 }", "9:", "above 0 Hz"),
        (" = '3 kg'", "9:", "expected"),
        (" = [1, { step = { after = '2 kg' } }]", "9:43", "expected"),
        (" = { sine = { amplitude = 1, frequency = 1 }, constant = 2 }", "9:", "exactly one"),
        (".file = { path = 'none.csv', column = 'u' }", "9:", "no data file"),
        (".prbs = { amplitude = 1, interval = '1 ns' }", "9:", "more than 1000000 changes"),
        (".sign = { after = 1 }", "9:", "unknown key `sign`"),
    ] {
        let message = check(folder.path(), &integrators(&[("one", input)], 10.0)).replace('\n', " ");
        assert!(message.contains(place) && message.contains(fact), "{input}: {message}");
    }
}

/// A study that identifies the gain of `x' = k u` from these experiments.
fn gain(experiments: &str) -> String {
    format!(
        "[study]\nname = 'gain'\ntask = 'calibration'\n[models.plant.equations]\nstates = {{ x = 'rad' }}\n\
         inputs = {{ u = 'rad/s' }}\nparameters = {{ k = '1' }}\nder = {{ x = 'k*u' }}\n\
         [tuners]\nk = {{ start = 0.5, min = 0.1, max = 10 }}\n{experiments}\
         [criteria]\nx = {{ fit = {{ signal = 'x' }}, demand = 1e-3 }}\n"
    )
}

fn found_gain(folder: &Path, experiments: &str) -> f64 {
    let result = run(folder, &gain(experiments));
    result["tuners"][0]["value"].as_f64().unwrap()
}

/// Writes `x = 2 t` for `u = 1`, sampled every 0.1 s for 4 s, with a row per time.
fn record(folder: &Path, name: &str, header: &str, row: impl Fn(f64) -> String) {
    let rows: String = (0..=40).map(|k| row(f64::from(k) * 0.1) + "\n").collect();
    std::fs::write(folder.join(name), format!("{header}\n{rows}")).unwrap();
}

#[test]
fn recordings_are_read_as_they_come() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Time stamps across midnight; the second second begins at 00:00:00.
    let of_day = |t: f64| {
        let ms = (t * 1e3).round() as u64;
        if ms < 1000 {
            format!("2024-05-17T23:59:59.{ms:03}Z")
        } else {
            format!("2024-05-18 00:00:{:02}.{:03}Z", ms / 1000 - 1, ms % 1000)
        }
    };
    record(folder, "stamps.csv", "when,x[rad],u[rad/s]", |t| format!("{},{},1", of_day(t), 2.0 * t));
    record(folder, "blanks.txt", "  t [s]   x (rad)  u (rad/s)", |t| format!("  {t:.1}   {:.2}   1.0", 2.0 * t));
    record(folder, "untimed.csv", "x[rad],u[rad/s]", |t| format!("{},1", 2.0 * t));
    record(folder, "gaps.csv", "t[s],x[rad],u[rad/s]", |t| {
        format!("{t},{},{}", 2.0 * t, if (t - 1.05).abs() < 0.5 { String::new() } else { "1".into() })
    });
    record(folder, "wrapped.csv", "t[s],x[rad],u[rad/s]", |t| format!("{t},{},1", (2.0 * t).rem_euclid(TAU)));
    record(folder, "swing_1.csv", "t[s],x[rad],u[rad/s]", |t| format!("{t},{},1", 2.0 * t));
    record(folder, "swing_2.csv", "t[s],x[rad],u[rad/s]", |t| format!("{t},{},2", 4.0 * t));
    // The input from a faster logger, started two seconds earlier on the same clock.
    let fast: String =
        (0..=600).map(|k| format!("{},{}\n", f64::from(k) * 0.01 - 2.0, if k < 200 { 0 } else { 1 })).collect();
    std::fs::write(folder.join("fast.csv"), format!("t[s],u[rad/s]\n{fast}")).unwrap();
    let plain = "channels = { x = 'x' }\ninputs = { u = 'u' }\nfree = ['x']\n";
    for (name, experiment) in [
        ("stamps", format!("file = 'stamps.csv'\n{plain}")),
        ("blanks", format!("file = 'blanks.txt'\n{plain}")),
        ("untimed", format!("file = 'untimed.csv'\nsample-time = '100 ms'\n{plain}")),
        ("gaps", format!("file = 'gaps.csv'\n{plain}")),
        ("wrapped", "file = 'wrapped.csv'\nchannels = { x = { column = 'x', unwrap = true } }\ninputs = { u = 'u' }\n".into()),
        ("pattern", format!("files = 'swing_*.csv'\n{plain}")),
        ("windows", format!("file = 'swing_1.csv'\nwindows = '1 s'\n{plain}")),
        ("rates", "file = 'blanks.txt'\nchannels = { x = 'x' }\ninputs = { u = { file = 'fast.csv', column = 'u' } }\n".into()),
        ("late", "file = 'fast.csv'\nfrom = 0\nchannels = { x = { file = 'swing_1.csv', column = 'x' } }\ninputs = { u = 'u' }\n".into()),
    ] {
        let found = found_gain(folder, &format!("[experiments.e]\n{experiment}"));
        assert!((found - 2.0).abs() < 1e-6, "{name}: {found}");
    }
    let names = |experiment: &str| {
        let result = run(folder, &gain(&format!("[experiments.e]\n{experiment}")));
        let rows = result["criteria"].as_array().unwrap().clone();
        rows.iter().map(|row| row["case"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names(&format!("files = 'swing_*.csv'\n{plain}")), ["e-swing_1", "e-swing_2"]);
    assert_eq!(names(&format!("file = 'swing_1.csv'\nwindows = '1.2 s'\n{plain}")), ["e-1", "e-2", "e-3"]);
}

#[test]
fn what_a_recording_suggests_is_a_note_and_what_it_lacks_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    record(folder, "wrapped.csv", "t[s],x[rad],u[rad/s]", |t| format!("{t},{},1", (2.0 * t).rem_euclid(TAU)));
    record(folder, "gaps.csv", "t[s],x[rad],u[rad/s]", |t| {
        format!("{t},{},{}", 2.0 * t, if (t - 1.05).abs() < 0.5 { String::new() } else { "1".into() })
    });
    record(folder, "epoch.csv", "time,x[rad],u[rad/s]", |t| format!("{},{},1", 1_714_730_390_000.0 + 1e3 * t, 2.0 * t));
    record(folder, "stamps.csv", "when,x[rad]", |t| format!("2024-05-17T10:00:{:04.1},{}", t, 2.0 * t));
    let checked = |experiment: &str| check(folder, &gain(&format!("[experiments.e]\n{experiment}")));
    let plain = "channels = { x = 'x' }\ninputs = { u = 'u' }\n";
    assert!(checked(&format!("file = 'wrapped.csv'\n{plain}")).contains("steps by about a turn at 3.2 s"));
    let confirmed = "file = 'wrapped.csv'\nchannels = { x = { column = 'x', unwrap = false } }\ninputs = { u = 'u' }\n";
    assert!(!checked(confirmed).contains("turn"));
    assert!(checked(&format!("file = 'gaps.csv'\n{plain}")).contains("has 10 missing samples"));
    for (experiment, fact) in [
        (plain.to_owned(), "`file` is missing"),
        (format!("files = 'none_*.csv'\n{plain}"), "no data file matches"),
        (format!("file = 'gaps.csv'\nfiles = '*.csv'\n{plain}"), "both `file` and `files`"),
        (format!("file = 'gaps.csv'\nwindows = '20 s'\n{plain}"), "more than twice as long"),
        (format!("file = 'gaps.csv'\nwindows = '0 s'\n{plain}"), "less than two samples"),
        (format!("file = 'gaps.csv'\nsample-time = '1 s'\ntime = 't'\n{plain}"), "both `time` and `sample-time`"),
        (format!("file = 'gaps.csv'\nsample-time = '0.2 s'\n{plain}"), "but `t` of the file increases by 0.1 s"),
        (format!("file = 'gaps.csv'\ntime-unit = 'ms'\n{plain}"), "the header of `t` has the unit `s`, not `ms`"),
        (format!("file = 'epoch.csv'\n{plain}"), "no dates as s since 1970"),
        (
            "file = 'gaps.csv'\nchannels = { x = 'x' }\ninputs = { u = { column = 'u', hold = 'first' } }\n".to_owned(),
            "missing sample at 0.6",
        ),
        (
            "file = 'gaps.csv'\nchannels = { x = { column = 'x', file = 'stamps.csv' } }\ninputs = { u = 'u' }\n"
                .to_owned(),
            "no common clock",
        ),
    ] {
        let message = checked(&experiment).replace('\n', " ");
        assert!(message.contains(fact), "{experiment}: {message}");
    }
}

#[test]
fn a_grid_is_a_case_for_every_combination_and_patterns_choose_among_them() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[study]\nname = 'grid'\n[models.plant.equations]\nstates = { x = '1' }\ninputs = { u = '1/s' }\n\
                parameters = { k = '1', m = 'kg' }\nder = { x = 'k*u*m/1 [kg]' }\nhorizon = '1 s'\n\
                [cases]\nrun = { grid = { k = [1, 2], m = ['1 kg', '500 g'] }, inputs.u = 1 }\nlast = { k = 5, m = 1, inputs.u = 1 }\n\
                [criteria]\nall = { final-value = { signal = 'x' }, usage = 'monitor' }\n\
                heavy = { final-value = { signal = 'x' }, cases = ['run-*-m=1kg'], usage = 'monitor' }\n";
    let result = run(folder.path(), text);
    for (case, expected) in [
        ("run-k=1-m=1kg", 1.0),
        ("run-k=1-m=500g", 0.5),
        ("run-k=2-m=1kg", 2.0),
        ("run-k=2-m=500g", 1.0),
        ("last", 5.0),
    ] {
        assert!((value(&result, case, "all") - expected).abs() < 1e-9, "{case}");
    }
    assert_eq!(value(&result, "run-k=2-m=1kg", "heavy"), value(&result, "run-k=2-m=1kg", "all"));
    assert_eq!(result["criteria"].as_array().unwrap().len(), 7);
    let wrong = check(folder.path(), &text.replace("run-*-m=1kg", "walk-*"));
    assert!(wrong.contains("no case matches `walk-*`"), "{wrong}");
    let double = check(folder.path(), &text.replace("k = [1, 2], m", "k = [], m"));
    assert!(double.contains("`k` has no values"), "{double}");
}

#[test]
fn a_robust_loss_keeps_a_gain_that_single_wrong_samples_would_bend() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // x = 2 t, with an alternating error of 0.01 and three outliers.
    let wrong = |k: u32| if k % 13 == 7 { 5.0 } else { 0.01 * if k.is_multiple_of(2) { 1.0 } else { -1.0 } };
    let rows: String =
        (0..=40).map(|k| format!("{},{},1\n", f64::from(k) * 0.1, 0.2 * f64::from(k) + wrong(k))).collect();
    std::fs::write(folder.join("wrong.csv"), format!("t[s],x[rad],u[rad/s]\n{rows}")).unwrap();
    let experiment = "[experiments.e]\nfile = 'wrong.csv'\nchannels = { x = { column = 'x', noise = 0.01 } }\ninputs = { u = 'u' }\n";
    let of = |loss: &str| {
        let text = gain(experiment).replace(
            "fit = { signal = 'x' }, demand = 1e-3",
            &format!("normalised-error = {{ signal = 'x', loss = '{loss}' }}"),
        );
        run(folder, &text)["tuners"][0]["value"].as_f64().unwrap()
    };
    assert!((of("squares") - 2.0).abs() > 0.1);
    assert!((of("huber") - 2.0).abs() < 0.01, "{}", of("huber"));
    assert!((of("student") - 2.0).abs() < 0.002, "{}", of("student"));
    let robust = gain(experiment)
        .replace("fit = { signal = 'x' }, demand = 1e-3", "normalised-error = { signal = 'x', loss = 'huber' }");
    assert!(!check(folder, &robust).contains("outliers"), "its loss is robust already");
    let printed = check(folder, &gain(experiment));
    assert!(printed.contains("3 samples of `x` in `e` (the first at 0.7 s) are outliers"), "{printed}");
}

#[test]
fn a_tuner_has_a_separate_value_in_named_experiments_only() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, slope) in [("a_1", 2.0), ("a_2", 2.0), ("b", 3.0)] {
        record(folder, &format!("{name}.csv"), "t[s],x[rad],u[rad/s]", |t| format!("{t},{},1", slope * t));
    }
    let experiment = |name: &str| {
        format!("[experiments.{name}]\nfile = '{name}.csv'\nchannels = {{ x = 'x' }}\ninputs = {{ u = 'u' }}\n")
    };
    let experiments = ["a_1", "a_2", "b"].map(experiment).concat();
    let text = gain(&experiments).replace("max = 10 }", "max = 10, per-case = ['b*'] }");
    let result = run(folder, &text);
    let tuners: Vec<(String, f64)> = result["tuners"]
        .as_array()
        .unwrap()
        .iter()
        .map(|t| (t["name"].as_str().unwrap().to_owned(), t["value"].as_f64().unwrap()))
        .collect();
    assert_eq!(tuners.len(), 2, "{tuners:?}");
    assert!(tuners[0].0 == "k" && (tuners[0].1 - 2.0).abs() < 1e-6, "{tuners:?}");
    assert!(tuners[1].0 == "b/k" && (tuners[1].1 - 3.0).abs() < 1e-6, "{tuners:?}");
    let wrong = check(folder, &text.replace("['b*']", "['c']"));
    assert!(wrong.contains("there is no case or experiment `c`"), "{wrong}");
}

#[test]
fn a_study_written_for_a_data_file_runs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // A lag of order 2, w = 3, z = 0.4, with noise from a fixed sequence; columns with awkward names.
    let (mut x, mut v, h) = (0.0, 0.0, 0.001);
    let mut rows = String::new();
    for k in 0..8000 {
        let t = f64::from(k) * h;
        let u = if ((t / 1.7) as u64).is_multiple_of(2) { 1.0 } else { -0.5 };
        if k % 20 == 0 {
            rows += &format!("{t:.2};{u};{:.5}\n", x + 1e-3 * math::sin(1e3 * t * t));
        }
        let a = 9.0 * (2.0 * u - x) - 2.4 * v;
        v += h * a;
        x += h * v;
    }
    std::fs::write(folder.join("log.csv"), format!("t [s];motor voltage (V);speed (left) [rpm]\n{rows}")).unwrap();
    let study = folder.join("first");
    let mops = |arguments: &[&str]| {
        let output = cargo_bin_cmd!("mops").args(arguments).current_dir(folder).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        output
    };
    mops(&["new", "first", "--from-data", "log.csv"]);
    assert!(study.join("log.csv").is_file());
    let output = mops(&["run", "first/study.toml", "--json"]);
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let value = |name: &str| {
        let all = result["tuners"].as_array().unwrap();
        all.iter().find(|t| t["name"] == name).unwrap_or_else(|| panic!("{result}"))["value"].as_f64().unwrap()
    };
    assert!((value("w_speed__left") - 3.0).abs() < 0.01 && (value("z_speed__left") - 0.4).abs() < 0.01);
    assert!((value("k_speed__left_motor_voltage") - 2.0).abs() < 0.01, "{result}");
    for template in ["pid", "equations", "state-feedback"] {
        mops(&["new", template, "--template", template]);
        mops(&["check", &format!("{template}/study.toml")]);
    }
    let refused = cargo_bin_cmd!("mops")
        .args(["new", "x", "--from-data", "log.csv", "--inputs", "u"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no column `u`"));
    assert!(!folder.join("x").exists());
}

#[test]
fn data_are_summarised_at_rest_and_plotted() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // At rest with errors of 0.01 and -0.01 until 5 s, then a ramp; the first sample is wrong.
    let rows: String = (0..200)
        .map(|k| {
            let t = 0.05 * f64::from(k);
            let x = if k == 0 { 9.0 } else { (t - 5.0).max(0.0) + if k % 2 == 0 { 0.01 } else { -0.01 } };
            format!("{},{x}\n", 1_763_990_000.0 + t)
        })
        .collect();
    std::fs::write(folder.join("log.csv"), format!("t[s],x[V]\n{rows}")).unwrap();
    let mops = |arguments: &[&str]| {
        let output = cargo_bin_cmd!("mops").args(arguments).current_dir(folder).output().unwrap();
        String::from_utf8([&output.stdout[..], &output.stderr].concat()).unwrap()
    };
    let summary = mops(&["data", "log.csv"]);
    assert!(summary.contains("`x`: the first sample (9) lies far from the next one (-0.01): skip = 1"), "{summary}");
    assert!(summary.contains("for 9.95"), "{summary}");
    let rest = mops(&["data", "log.csv", "--rest", "1763990001", "1763990004"]);
    assert!(rest.contains("0.0100") || rest.contains("0.01008"), "{rest}");
    assert!(mops(&["data", "log.csv", "--rest", "1", "2"]).contains("has 0 samples"));
    assert!(mops(&["data", "log.csv", "--plot", "x.svg"]).contains("wrote x.svg"));
    assert!(std::fs::read_to_string(folder.join("x.svg")).unwrap().contains("<svg"));
    assert!(mops(&["data", "log.csv", "--plot", "x.gif"]).contains("neither .svg nor .png"));
}

/// Returns a study whose input in `unit` is a sum of these terms.
fn summed(unit: &str, terms: &[&str]) -> String {
    format!(
        "[study]\nname = 'room'\n[models.room.equations]\nstates = {{ T = '{unit}' }}\ninputs = {{ To = '{unit}' }}\n\
         der = {{ T = '(To - T)/1 [s]' }}\nstart = {{ T = '20 degC' }}\nhorizon = '40 s'\n\
         [cases]\nc = {{ inputs.To = [{}] }}\n\
         [criteria]\nend = {{ final-value = {{ signal = 'To' }}, usage = 'monitor' }}\n",
        terms.join(", ")
    )
}

#[test]
fn a_sum_of_temperatures_has_one_temperature_wherever_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), "time [s],A [K],F [degF],n\n0,293.15,68,20\n40,293.15,68,20\n")
        .unwrap();
    // At 40 s, the sine of 1/160 Hz is at its amplitude.
    let sine = "{ sine = { amplitude = '9 degF', frequency = '0.00625 Hz' } }";
    let step = "{ step = { time = '1 s', after = '5 K' } }";
    let file = |column: &str| format!("{{ file = {{ path = 'log.csv', column = '{column}' }} }}");
    let (kelvin, fahrenheit, plain) = (file("A"), file("F"), file("n"));
    for unit in ["K", "degC", "degF"] {
        for terms in [
            vec!["'20 degC'", step],
            vec!["{ constant = '68 degF' }", sine],
            vec!["{ step = { before = '0 degC', after = '20 degC' } }", "'10 K'", "{ constant = '-5 K' }"],
            vec!["'293.15 K'", sine],
            vec![&kelvin, sine],
            vec![&fahrenheit, step],
            vec!["'20 degC'", "{ table = { time = [0, 10], value = ['0 K', '5 K'] } }"],
            vec!["{ sine = { amplitude = '5 K', frequency = '0.00625 Hz', offset = '68 degF' } }"],
            vec!["'20 degC'", "'2 K'", "'3 K'"],
        ] {
            for first in 0..terms.len() {
                let mut turned = terms.clone();
                turned.rotate_left(first);
                let found = value(&run(folder.path(), &summed(unit, &turned)), "c", "end");
                let expected = match unit {
                    "K" => 298.15,
                    "degC" => 25.0,
                    _ => 77.0,
                };
                assert!((found - expected).abs() < 1e-6, "{unit} {turned:?}: {found}");
            }
        }
    }
    // Numbers without a unit, and columns without one, are in that of the input.
    for terms in [["20", step], [step, "20"], [&plain, step], [step, &plain], ["20", "{ step = { after = 5 } }"]] {
        assert!((value(&run(folder.path(), &summed("degC", &terms)), "c", "end") - 25.0).abs() < 1e-6, "{terms:?}");
    }
}

#[test]
fn a_sum_of_two_temperatures_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (unit, terms, help) in [
        ("K", ["'20 degC'", "{ step = { after = '5 degC' } }"], "one term in degC, and the differences in K"),
        ("degC", ["'20 degC'", "{ step = { after = '86 degF' } }"], "one term in degC, and the differences in K"),
        ("degC", ["'293.15 K'", "{ step = { after = '5 K' } }"], "one term in degC, and the differences in K"),
        ("degF", ["20", "'5 degC'"], "one term in degF, and the differences in degR"),
    ] {
        for terms in [terms, [terms[1], terms[0]]] {
            std::fs::write(folder.path().join("study.toml"), summed(unit, &terms)).unwrap();
            let output =
                cargo_bin_cmd!("mops").current_dir(folder.path()).args(["check", "study.toml"]).output().unwrap();
            let message = String::from_utf8(output.stderr).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(
                output.status.code() == Some(2) && message.contains("may be the temperature"),
                "{terms:?}: {message}"
            );
            assert!(message.contains(help) && message.contains("study.toml:10:"), "{terms:?}: {message}");
        }
    }
}

#[test]
fn a_formula_in_a_window_leaves_other_criteria_their_own() {
    // x = t: the peak of its own window from 5 to 8 s is 8, the maximum from 1 s on 10, the kink of the absolute value
    // no extremum.
    let text = integrators(&[("one", " = 1")], 10.0)
        + "ph = { peak = { signal = 'x' }, from = 5, until = 8, usage = 'monitor' }\n\
           late = { expression = { value = 'ph + maximum(x)' }, from = 1, usage = 'monitor' }\n\
           kink = { expression = { value = 'minimum(abs(x - 3.3))' }, usage = 'monitor' }\n\
           jump = { expression = { value = 'integral(sign(x - 3.3))/1 [s]' }, usage = 'monitor' }\n";
    let folder = tempfile::tempdir().unwrap();
    let result = run(folder.path(), &text);
    assert!((value(&result, "one", "late") - 18.0).abs() < 1e-9);
    assert!(value(&result, "one", "kink").abs() < 1e-8, "{}", value(&result, "one", "kink"));
    assert!((value(&result, "one", "jump") - 3.4).abs() < 1e-9, "{}", value(&result, "one", "jump"));
}

#[test]
fn an_input_is_interpolated_to_the_end_of_an_experiment() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // y = u = t; the logger of the input is ten times slower.
    let rows =
        |step: f64, count: u32| (0..=count).map(|k| format!("{0},{0}\n", step * f64::from(k))).collect::<String>();
    std::fs::write(folder.join("fast.csv"), format!("t[s],y[V]\n{}", rows(0.1, 100))).unwrap();
    std::fs::write(folder.join("slow.csv"), format!("t[s],u[V]\n{}", rows(1.0, 10))).unwrap();
    std::fs::write(folder.join("late.csv"), "t[s],y[V]\n1000,0\n1001,1\n1002,2\n").unwrap();
    let study = |experiment: &str| {
        format!(
            "[study]\nname = 'line'\ntask = 'calibration'\n[models.plant.equations]\nstates = {{ x = 'V' }}\n\
             inputs = {{ u = 'V' }}\nparameters = {{ k = '1' }}\nder = {{ x = '0 [V/s]' }}\noutputs = {{ y = {{ value = 'k*u', unit = 'V' }} }}\n\
             [tuners]\nk = {{ start = 0.5, min = 0.1, max = 10 }}\n[experiments.e]\n{experiment}\n\
             [criteria]\ny = {{ rmse = {{ signal = 'y' }}, demand = 1 }}\n"
        )
    };
    let error = |experiment: &str| {
        let result = run(folder, &study(experiment));
        let rows = result["criteria"].as_array().unwrap();
        rows.iter().map(|row| row["value"].as_f64().unwrap()).fold(0.0, f64::max)
    };
    let slow = "channels = { y = 'y' }\ninputs = { u = { column = 'u', file = 'slow.csv', hold = 'first' } }\n";
    for experiment in [
        format!("file = 'fast.csv'\nto = '4.5 s'\n{slow}"),
        format!("file = 'fast.csv'\nfrom = '0.7 s'\n{slow}"),
        format!("file = 'fast.csv'\nwindows = '1.9 s'\n{slow}"),
    ] {
        let error = error(&experiment);
        assert!(error < 1e-6, "{experiment}: {error}");
    }
    let none = check(folder, &study(&format!("file = 'late.csv'\n{slow}")));
    assert!(none.contains("`u` ends 990 s before the experiment starts"), "{none}");
    let early = check(folder, &study(&format!("file = 'fast.csv'\n{}", slow.replace("hold", "shift = '-5 s', hold"))));
    assert!(early.contains("input `u` of `e` ends at 5 s, and the experiment at 10 s"), "{early}");
}

#[test]
fn a_window_ends_at_a_pause_of_the_record() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let rows: String = (0..=40)
        .map(|k| 0.1 * f64::from(k) + if k > 20 { 98.0 } else { 0.0 })
        .map(|t| format!("{t},{},1\n", 2.0 * t))
        .collect();
    std::fs::write(folder.join("pause.csv"), format!("t[s],x[rad],u[rad/s]\n{rows}")).unwrap();
    let experiment = "[experiments.e]\nfile = 'pause.csv'\nwindows = '0.5 s'\nchannels = { x = 'x' }\ninputs = { u = 'u' }\nfree = ['x']\n";
    let printed = check(folder, &gain(experiment));
    assert!(printed.contains("e-8") && !printed.contains("98.") && !printed.contains("98 s"), "{printed}");
    assert!((found_gain(folder, experiment) - 2.0).abs() < 1e-6);
    let short = check(folder, &gain(&experiment.replace("0.5 s", "0.05 s")));
    assert!(short.contains("less than two samples"), "{short}");
}

#[test]
fn an_unstable_plant_in_closed_loop_is_calibrated_in_windows() {
    // x'' = a x - d x' + b u, unstable, with u of a sampled controller kept over 20 ms. The matrix exponential is a
    // Taylor series.
    let [a, d, b, step] = [9.0, 0.4, 4.0, 0.02];
    let rate = |x: [f64; 2], u: f64| [x[1], a * x[0] - d * x[1] + b * u];
    let next = |x: [f64; 2], u: f64| {
        let mut term = rate(x, u);
        let mut sum = [x[0] + step * term[0], x[1] + step * term[1]];
        let mut factor = step;
        for k in 2..20 {
            term = rate(term, 0.0);
            factor *= step / f64::from(k);
            sum = [sum[0] + factor * term[0], sum[1] + factor * term[1]];
        }
        sum
    };
    let (mut x, mut seed) = ([0.1, 0.0], 1_u64);
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(seed >> 33).unwrap()) / f64::from(1u32 << 31)
    };
    let mut text = "t [s],x [rad],u [V]\n".to_owned();
    for k in 0..1000 {
        let t = step * f64::from(k);
        // Sum of twelve uniform numbers: nearly normal.
        let noise = 0.002 * ((0..12).map(|_| random()).sum::<f64>() - 6.0);
        let wanted = 0.1 * math::sin(0.9 * t).signum() + 0.05 * math::sin(5.0 * t);
        let u = -6.0 * (x[0] - wanted) - 1.8 * x[1];
        text += &format!("{t:.4},{:.6},{u:.8}\n", x[0] + noise);
        x = next(x, u);
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("run.csv"), text).unwrap();
    let study = "
        [study]
        name = 'unstable'
        task = 'calibration'
        [models.plant.equations]
        states = { x = 'rad', v = 'rad/s' }
        inputs = { u = 'V' }
        parameters = { a = '1/s2', d = '1/s', b = 'rad/(V s2)' }
        der = { x = 'v', v = 'a*x - d*v + b*u' }
        [tuners]
        a = { start = 5, min = 1, max = 50 }
        d = { start = 0.1, min = 0, max = 5 }
        b = { start = 2, min = 0.5, max = 20 }
        [experiments.run]
        file = 'run.csv'
        windows = '1 s'
        free = ['x', 'v']
        channels = { x = 'x' }
        inputs = { u = 'u' }
        [criteria]
        fit = { normalised-error = { signal = 'x' } }
        [sensors]
        x = { noise = '0.002 rad' }";
    let result = run(folder.path(), study);
    let found = |name: &str| -> [f64; 2] {
        let all = result["calibration"]["parameters"].as_array().unwrap();
        let found = all.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("{all:?}"));
        ["value", "std_error"].map(|key| found[key].as_f64().unwrap_or_else(|| panic!("{found}")))
    };
    for (name, exact) in [("a", a), ("d", d), ("b", b)] {
        let [value, error] = found(name);
        assert!((value - exact).abs() < 3.5 * error && error < 0.1 * exact, "{name}: {value} +- {error}");
    }
    // A finding common to all windows is reported once.
    let shown = printed("run", folder.path(), study);
    assert!(shown.contains("`u` of `run-*` looks smooth") && !shown.contains("`u` of `run-1`"), "{shown}");
    assert_eq!(shown.matches("persistently exciting").count(), 2, "{shown}");
    assert_eq!(shown.matches("Ljung-Box").count(), 1, "{shown}");
}

#[test]
fn a_window_after_the_end_of_the_simulation_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = integrators(&[("a", " = 1")], 5.0).replace("usage = 'monitor' }", "usage = 'monitor', from = '7 s' }");
    let message = check(folder.path(), &text);
    assert!(message.contains("`from` at 7 s is not before the end of the simulation at 5 s in case `a`"), "{message}");
}

#[test]
fn a_recorded_input_before_the_start_of_an_experiment_reaches_its_delays() {
    // y' = u(t - 2 s) - y; u steps at 3 s and y follows from 5 s on.
    let folder = tempfile::tempdir().unwrap();
    let row = |i: u32| {
        let t = f64::from(i) * 0.1;
        let y = if t > 5.0 { 1.0 - math::exp(5.0 - t) } else { 0.0 };
        format!("{t},{},{y}\n", f64::from(u8::from(i >= 30)))
    };
    let rows: String = (0..=100).map(row).collect();
    std::fs::write(folder.path().join("rec.csv"), format!("t,u,y\n{rows}")).unwrap();
    let equations = |der: &str, more: &str| {
        format!(
            "[models.m.equations]\nstates = {{ y = '1' }}\ninputs = {{ u = '1' }}\nparameters = {{ k = '1/s', T = 's' }}\n\
             der = {{ y = '{der}' }}\n{more}\n[tuners]\nk = {{ start = 1.0, min = 0.1, max = 10.0 }}\n\
             T = {{ start = 2.0, min = 0.1, max = 5.0 }}"
        )
    };
    let models = [
        equations("k*(delay(u, T) - y)", ""),
        equations("k*(delay(delay(u, 0.75*T), 0.25*T) - y)", ""),
        equations("k*(delay(u - y, T) + delay(y, T) - y)", ""),
        equations(
            "k*(u - y) + 0*T*k^2",
            "[models.m.effects]\nd = { input-delay = { place = 'actuator:u' } }\n[models.m.parameters]\n'd.delay' = '2 s'",
        ),
    ];
    for model in &models {
        for part in ["from = 2.0", "from = 3.0", "from = 3.5", "from = 4.5", "windows = '2 s'\nfree = ['y']"] {
            let text = format!(
                "[study]\nname = 'past'\ntask = 'calibration'\n{model}\n[experiments.e]\nfile = 'rec.csv'\ntime = 't'\n\
                 channels = {{ y = {{ column = 'y', noise = 0.001 }} }}\ninputs = {{ u = {{ column = 'u', hold = 'zero' }} }}\n{part}\n\
                 [criteria]\nf = {{ normalised-error = {{ signal = 'y' }} }}\n"
            );
            std::fs::write(folder.path().join("study.toml"), text).unwrap();
            let arguments = ["run", "study.toml", "--json", "--max-evaluations", "1"];
            let output = cargo_bin_cmd!("mops").current_dir(folder.path()).args(arguments).output().unwrap();
            let result: Value = serde_json::from_slice(&output.stdout)
                .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
            for experiment in result["calibration"]["experiments"].as_array().unwrap() {
                let rmse = experiment["channels"][0]["rmse"].as_f64().unwrap();
                assert!(rmse < 1e-5, "{part}: {rmse} in {} of {model}", experiment["name"]);
            }
        }
    }
}
