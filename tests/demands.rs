//! Demands follow the sense of their criterion: each is met, reported as missed, or refused.

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use mops_math as math;
use serde_json::Value;

/// An integrating loop with a lag, `k/(s (s + 1))`: phase margin 51.8 deg at k = 1, bandwidth and crossover near 1
/// rad/s.
const LOOP: &str = r#"
    [study]
    name = "loop"
    [models.loop.transfer-function]
    numerator = ["k"]
    denominator = [1, 1, 0]
    [tuners]
    k = { start = 1.0, min = 0.05, max = 20.0, scale = "log" }
    [criteria]
"#;

/// `y = k exp(a t)/2`, which does not settle at 1 if `a` is positive.
const GROWTH: &str = r#"
    [study]
    name = "growth"
    [models.m.equations]
    states     = { y = "1" }
    parameters = { a = "1/s" }
    der        = { y = "a*y" }
    start      = { y = 0.5 }
    horizon    = "HORIZON"
    [tuners]
    a = { start = 0.4, min = 0.1, max = 2.0 }
    [criteria]
"#;

fn write(folder: &Path, text: &str) -> String {
    let path = folder.join("study.toml");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn run(text: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let study = write(folder.path(), text);
    let out = folder.path().join("out");
    let arguments = ["run", &study, "--json", "--max-evaluations", "300", "--out", out.to_str().unwrap()];
    let output = cargo_bin_cmd!("mops").args(arguments).output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Returns the message of `mops check` for a study that it refuses.
fn refusal(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = cargo_bin_cmd!("mops").args(["check", &write(folder.path(), text)]).output().unwrap();
    assert!(!output.status.success(), "{text}");
    // Lines are wrapped at the width of the terminal.
    String::from_utf8(output.stderr).unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn a_demand_on_a_criterion_to_be_maximised_means_at_least() {
    // Criterion, demand, its number: values are in the unit of the demand.
    for (kind, demand, least) in [
        ("phase-margin", "45 deg", 45.0),
        ("phase-margin", "70 deg", 70.0),
        ("delay-margin", "0.5 s", 0.5),
        ("bandwidth = { of = 'closed-loop' }", "0.5 Hz", 0.5),
        ("damping-ratio = { of = 'closed-loop' }", "0.6", 0.6),
    ] {
        let kind = if kind.contains('=') { kind.to_owned() } else { format!("{kind} = {{}}") };
        for usage in ["minimise", "inequality"] {
            // A constraint needs another criterion to be minimised.
            let other = if usage == "inequality" { "s = { maximum-sensitivity = {}, demand = 2 }" } else { "" };
            let result = run(&format!("{LOOP} c = {{ {kind}, demand = '{demand}', usage = '{usage}' }}\n{other}"));
            let c = &result["criteria"][0];
            assert!(number(&c["value"]) >= least * (1.0 - 1e-6) && c["met"] == true, "{kind} {demand} {usage}: {c}");
            let scaled = 1.0 + (least - number(&c["value"])) / least;
            assert!((number(&c["scaled"]) - scaled).abs() < 1e-9, "{c}");
        }
    }
}

#[test]
fn a_margin_below_its_demand_is_missed() {
    // k is fixed at 5: phase margin 25.2 deg.
    let text = LOOP.replace("start = 1.0, min = 0.05", "start = 5.0, min = 4.999");
    let result = run(&format!("{text} pm = {{ phase-margin = {{}}, demand = '60 deg' }}"));
    let pm = &result["criteria"][0];
    assert!(number(&pm["scaled"]) > 1.0 && pm["met"] == false, "{pm}");
}

#[test]
fn demands_against_the_sense_or_out_of_range_are_refused_with_a_corrected_line() {
    let swapped = refusal(&format!("{LOOP} pm = {{ phase-margin = {{}}, good = '45 deg', bad = '90 deg' }}"));
    assert!(swapped.contains("more is better for this criterion"), "{swapped}");
    for kind in ["gain-margin", "delay-margin", "bandwidth", "damping-ratio"] {
        let swapped = refusal(&format!("{LOOP} c = {{ {kind} = {{}}, good = 0.2, bad = 0.4 }}"));
        assert!(swapped.contains("good = \"0.4") && swapped.contains("bad = \"0.2"), "{kind}: {swapped}");
    }
    let less = refusal(&format!("{LOOP} s = {{ maximum-sensitivity = {{}}, good = 2, bad = 1.2 }}"));
    assert!(less.contains("less is better for this criterion"), "{less}");
    for (key, text) in [("bad", "good = 1.5, bad = -4"), ("good", "good = 90, bad = 0.7"), ("demand", "demand = 45")] {
        let beyond = refusal(&format!("{LOOP} pm = {{ phase-margin = {{}}, {text} }}"));
        assert!(beyond.contains("is outside the range") && beyond.contains(key), "{beyond}");
    }
    let degrees = refusal(&format!("{LOOP} pm = {{ phase-margin = {{}}, demand = 45 }}"));
    assert!(degrees.contains("demand = \"45 deg\""), "{degrees}");
    let target = refusal(&format!("{LOOP} wc = {{ crossover-frequency = {{}}, demand = 2 }}"));
    assert!(target.contains("usage = \"equality\""), "{target}");
    let nothing = refusal(&format!("{LOOP} gm = {{ gain-margin = {{}}, demand = 0 }}"));
    assert!(nothing.contains("other than 0"), "{nothing}");
}

#[test]
fn a_target_is_met_as_an_equality() {
    let result = run(&format!(
        "{LOOP} wc = {{ crossover-frequency = {{}}, demand = '2 rad/s', usage = 'equality' }}\n\
         s = {{ maximum-sensitivity = {{}}, demand = 2 }}"
    ));
    let wc = &result["criteria"][0];
    assert!((number(&wc["value"]) - 2.0).abs() < 1e-4 && wc["met"] == true, "{wc}");
}

#[test]
fn a_level_that_is_never_reached_meets_no_demand_for_any_horizon() {
    for horizon in [0.5_f64, 2.0, 5.0] {
        for demand in [1.0, 5.0, 50.0] {
            for (kind, usage) in
                [("settling-time", "minimise"), ("rise-time", "inequality"), ("delay-time", "minimise")]
            {
                let text = GROWTH.replace("HORIZON", &format!("{horizon} s"));
                // From 0 towards -1: the response moves away from the target.
                let options = "{ signal = 'y', target = -1, from = 0 }";
                let result = run(&format!(
                    "{text} c = {{ {kind} = {options}, demand = '{demand} s', usage = '{usage}' }}\n\
                     d = {{ peak = {{ signal = 'y' }}, demand = 1 }}"
                ));
                let c = &result["criteria"][0];
                assert!(c["value"].is_null() && c["met"] == false, "{horizon} {demand} {kind}: {c}");
                assert!(number(&c["scaled"]) > (horizon / demand).max(1.0), "{horizon} {demand} {kind}: {c}");
                assert!(usage != "inequality" || result["feasible"] == false, "{result}");
            }
        }
    }
}

/// `L = k/(s + 1)` with a gain below 1, and a lag that is at 0.17 at most when the simulation ends.
const NEVER: &str = r#"
    [study]
    name = "never"
    [models.L.transfer-function]
    numerator = ["k"]
    denominator = [1, 1]
    [models.s.equations]
    states = { y = "1" }
    parameters = { k = "1" }
    der = { y = "(1 - y)*k/100 [s]" }
    horizon = "20 s"
    [tuners]
    k = { start = 0.5, min = 0.1, max = 0.9 }
    [criteria]
    wc = { model = "L", crossover-frequency = {}, usage = "monitor" }
    rise = { model = "s", rise-time = { signal = "y", target = 1 }, usage = "monitor" }
    c = { DEMANDED }
"#;

#[test]
fn a_condition_that_is_never_reached_meets_no_demand_in_any_unit() {
    let crossover = "model = 'L', crossover-frequency = {}";
    let of_rise = "model = 's', expression = { value = '2*rise' }";
    let of_crossover = "model = 'L', expression = { value = '3*wc', unit = 'rad/s' }";
    let energy = "model = 's', expression = { value = '2*rise*3 [kW]' }";
    for (criterion, demand) in [
        (crossover, "good = '2 rad/s', bad = '20 rad/s'"),
        (crossover, "good = '2 Hz', bad = '20 Hz'"),
        (crossover, "good = '5 Hz', bad = '1 Hz', usage = 'inequality'"),
        (crossover, "demand = '30 rpm', usage = 'equality'"),
        (of_rise, "demand = '10 min'"),
        (of_rise, "demand = '600 s'"),
        (of_rise, "good = 0, bad = 1, unit = 'h'"),
        (of_crossover, "demand = '1 Hz'"),
        (energy, "demand = '1 kJ'"),
        (energy, "demand = '1 mJ', usage = 'inequality'"),
    ] {
        let other =
            if demand.contains("usage") { "d = { model = 's', peak = { signal = 'y' }, demand = 1 }" } else { "" };
        let text = NEVER.replace("DEMANDED", &format!("{criterion}, {demand}"));
        let result = run(&format!("{text}{other}"));
        let c = &result["criteria"][2];
        assert!(c["value"].is_null() && c["met"] == false, "{criterion} {demand}: {c}");
        assert!((1.0..=2.0).contains(&number(&c["scaled"])), "{criterion} {demand}: {c}");
        assert!(!demand.contains("usage") || result["feasible"] == false, "{result}");
        // The samples of Monte Carlo are counted by the same rule.
        let uncertain = "[uncertain]\nk = { min = 0.1, max = 0.9 }\n[monte-carlo]\nat = 'start'\nsamples = 4\n";
        let task = text.replace("name = \"never\"", "name = \"never\"\ntask = \"monte-carlo\"");
        let found = &run(&format!("{task}{other}\n{uncertain}"))["monte-carlo"]["criteria"][2];
        assert!(found["met"]["count"] == 0 && found["failed"] == 4, "{criterion} {demand}: {found}");
    }
}

#[test]
fn a_solver_finds_a_design_that_settles_from_one_that_does_not() {
    // A lag that must be within 2 % after 5 s; the initial guess is far from that.
    let result = run("[study]\nname = 'lag'\n[models.m.equations]\nstates = { y = '1' }\nparameters = { a = '1/s' }\n\
         der = { y = 'a*(1 - y)' }\nhorizon = '5 s'\n[tuners]\na = { start = 0.01, min = 0.001, max = 10, scale = 'log' }\n\
         [criteria]\ns = { settling-time = { signal = 'y', target = 1 }, demand = '2 s' }\n\
         e = { maximum-rate = { signal = 'y' }, usage = 'inequality', demand = '3 1/s' }");
    let s = &result["criteria"][0];
    assert!((number(&s["value"]) - math::ln(50.0) / 3.0).abs() < 1e-3 && s["met"] == true, "{s}");
}

#[test]
fn ambiguous_demands_and_criteria_of_unstable_systems_are_refused() {
    for (criterion, fact) in [
        ("c = { phase-margin = {}, demand = '60 %' }", "expected an angle, found a share in %"),
        ("c = { damping-ratio = {}, demand = '45 deg' }", "expected a pure number, found an angle in deg"),
        ("c = { maximum-sensitivity = {}, demand = '100 rad' }", "expected a pure number"),
        ("c = { slowest-pole = { of = 'closed-loop' }, demand = 5 }", "5 1/s is outside the range of this criterion"),
        ("c = { slowest-pole = { of = 'closed-loop' }, demand = -5 }", "a demand must be positive, not -5"),
    ] {
        let message = refusal(&format!("{LOOP}{criterion}"));
        assert!(message.contains(fact), "{criterion}: {message}");
    }
    let growth = GROWTH.replace("HORIZON", "5 s");
    for (criterion, fact) in [
        ("c = { peak = { signal = 'y', of = 'minimum' }, demand = 1 }", "demand"),
        (
            "c = { settling-time = { signal = 'y', target = 1, relative-band = 2 }, demand = '3 s' }",
            "for percent write",
        ),
    ] {
        let message = refusal(&format!("{growth}{criterion}"));
        assert!(message.contains(fact), "{criterion}: {message}");
    }
    // An unbounded response does not settle, not even at its own final value.
    let result = run(&format!("{growth}c = {{ settling-time = {{ signal = 'y' }}, demand = '10 s' }}"));
    let criterion = &result["criteria"][0];
    assert!(criterion["value"].is_null() && criterion["met"] == false, "{criterion}");
    // An equality requires the value itself, not at least the value.
    let equal = run(&format!("{LOOP}c = {{ phase-margin = {{}}, demand = 1, usage = 'equality' }}"));
    assert!((number(&equal["criteria"][0]["value"]) - 1.0).abs() < 1e-3 && equal["criteria"][0]["at_least"] != true);
}

#[test]
fn a_simulation_fails_where_a_demanded_criterion_has_no_value_but_not_where_a_monitored_one_has_none() {
    let simulate = |criterion: &str| {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("{}c = {{ {criterion} }}\n", GROWTH.replace("HORIZON", "2 s"));
        let output = cargo_bin_cmd!("mops").args(["simulate", &write(folder.path(), &text)]).output().unwrap();
        assert!(String::from_utf8_lossy(&output.stdout).contains("longer than the simulation"), "{output:?}");
        output.status.code()
    };
    let without_value = "steady-state-error = { signal = 'y', target = 1, window = '50 s' }";
    assert_eq!(simulate(&format!("{without_value}, usage = 'monitor'")), Some(0));
    assert_eq!(simulate(&format!("{without_value}, demand = 1")), Some(3));
    assert_eq!(simulate(&format!("{without_value}, demand = 1, usage = 'inequality'")), Some(3));
}
