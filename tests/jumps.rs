//! Jumps of criteria near a design: where they are found, what is reported beyond them, and whether the suggested line
//! avoids them.

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

/// Runs a study of one model; returns the result.
fn run(model: &str, more: &str) -> Value {
    let text = format!(
        "[study]\nname = 'jump'\n[models.m.equations]\nstates = {{ x = {{ unit = 'm', scale = '2 m' }} }}\nder = {{ x = '0 m/s' }}\n\
         {model}\nhorizon = 1.0\n[tuners]\nk = {{ start = 2.0, min = 1.0, max = 5.0 }}\n[criteria]\n\
         c = {{ final-value = {{ signal = 'y' }}, demand = 1.5 }}\n{more}\n[solver.genetic]\n"
    );
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    std::fs::write(&study, &text).unwrap();
    let out = folder.path().join("out");
    let arguments =
        ["run", study.to_str().unwrap(), "--json", "--max-evaluations", "3000", "--out", out.to_str().unwrap()];
    let output = cargo_bin_cmd!("mops").args(arguments).output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// A study with the constant `m` = 4.
fn with_output(y: &str) -> Value {
    run(&format!("parameters = {{ k = '1' }}\nconstants = {{ m = 4.0 }}\noutputs = {{ y = '{y}' }}"), "")
}

fn doubt(result: &Value) -> &str {
    result["end"]["doubt"].as_str().unwrap_or_default()
}

#[test]
fn an_optimum_on_a_jump_is_reported_with_what_comes_beyond() {
    // The least value is 1 at k m = 12; beyond, y is 3.
    let result = with_output("1 + 0.1*(3 - k) + if(k*m > 12.0, 2, 0)");
    assert!((result["objective"].as_f64().unwrap() - 1.0 / 1.5).abs() < 1e-3, "{result}");
    assert_eq!(result["end"]["point"], "jump");
    let found = result["jumps"]["found"].as_array().unwrap();
    for name in ["k", "m"] {
        let jump = found.iter().find(|jump| jump["name"] == name).unwrap_or_else(|| panic!("{name}: {found:?}"));
        assert!(jump["distance"].as_f64().unwrap() < 1e-3 && jump["misses"] == true, "{jump}");
        assert!((jump["there"].as_f64().unwrap() - 3.0).abs() < 0.01, "{jump}");
    }
    let text = doubt(&result);
    assert!(text.contains("Beside a jump: with tuner `k` at 3") && text.contains("its demand is missed"), "{text}");
    // A point of the search that keeps its demand with 1 % more: k m < 12/1.01.
    let away = &result["jumps"]["away"]["tuners"][0][1];
    assert!(away.as_f64().unwrap() < 3.0 - 0.03, "{away}");
}

#[test]
fn the_line_that_is_given_designs_against_the_jump() {
    let parts = "parameters = { k = '1' }\nconstants = { m = 4.0 }\noutputs = { y = '1 + 0.1*(3 - k) + if(k*m > 12.0, 2 + (k*m - 12), 0)' }";
    let first = run(parts, "");
    let text = doubt(&first);
    let line = text.split("under [uncertain], `").nth(1).and_then(|rest| rest.split('`').next()).unwrap();
    let second = run(parts, &format!("[uncertain]\n{line}\n[robust]"));
    assert_eq!(second["jumps"]["found"].as_array().unwrap().len(), 0, "{line}: {second}");
    let k = second["tuners"][0]["value"].as_f64().unwrap();
    assert!(k < 3.0 - 0.03 && k > 2.9, "{line}: {k}");
}

#[test]
fn a_jump_of_a_constant_or_an_initial_value_is_located() {
    // At 0.5 % of m, and at 0.5 % of the scale of x, whose initial value is 0.
    for (condition, name, value) in [("m > 4.02", "m", 4.02), ("x > 0.01 [m]", "x0", 0.01), ("m < 3.98", "m", 3.98)] {
        let result = with_output(&format!("1 + (k - 3)^2 + if({condition}, 2, 0)"));
        let jump = &result["jumps"]["found"][0];
        assert_eq!(jump["name"], name, "{condition}: {result}");
        let [distance, beyond] = [&jump["distance"], &jump["beyond"]].map(|number| number.as_f64().unwrap());
        assert!((0.005..0.005 * 1.06).contains(&distance), "{condition}: {jump}");
        assert!((beyond - value).abs() < 0.05 * 0.02, "{condition}: {jump}");
        assert!(doubt(&result).contains("instead of"), "{condition}: {}", doubt(&result));
    }
}

#[test]
fn a_steep_change_and_a_kink_are_no_jumps() {
    for y in ["(k - 3)^2 + exp(50*(m - 4))", "(k - 3)^2 + 1 + 40*max(m - 4, 0)", "(k - 3)^2 + 1 + 3*sqrt(abs(m - 4))"] {
        let result = with_output(y);
        assert_eq!(result["jumps"]["found"].as_array().unwrap().len(), 0, "{y}: {}", result["jumps"]);
    }
}

#[test]
fn a_jump_to_a_better_value_or_within_the_demand_raises_no_doubt() {
    for (jump, found) in [("if(m > 4.02, -0.5, 0)", 0), ("if(m > 4.02, 0.3, 0)", 1)] {
        let result = with_output(&format!("1 + (k - 3)^2 + {jump}"));
        assert_eq!(result["jumps"]["found"].as_array().unwrap().len(), found, "{jump}");
        assert_eq!(doubt(&result), "", "{jump}");
    }
}

#[test]
fn the_look_takes_at_most_a_twentieth_of_the_evaluations() {
    let result = with_output("1 + (k - 3)^2 + if(m > 4.02, 2, 0)");
    let [look, all] = [&result["jumps"]["evaluations"], &result["evaluations"]].map(|n| n.as_u64().unwrap());
    assert!(look > 0 && 20 * look <= all, "{look} of {all}");
}

#[test]
fn a_strong_curvature_is_no_kink() {
    // The optimum is at the kink of y, where s has its minimum.
    let result = run(
        "parameters = { k = '1' }\noutputs = { y = '1 + abs(k - 2.5)/4', s = '0.5 + 30*((k - 2.5)/4)^2' }",
        "s = { final-value = { signal = 's' }, demand = 1.5 }",
    );
    assert!((result["tuners"][0]["value"].as_f64().unwrap() - 2.5).abs() < 1e-3, "{result}");
    let slopes = result["slopes"]["criteria"].as_array().unwrap();
    let sides = |name: &str| &slopes.iter().find(|of| of["key"].as_str().unwrap().ends_with(name)).unwrap()["sides"];
    assert!(sides("/s").is_null(), "{}", sides("/s"));
    let [left, right] = [0, 1].map(|side| sides("/c")[0][side].as_f64().unwrap());
    assert!((left + 1.0 / 1.5).abs() < 1e-6 && (right - 1.0 / 1.5).abs() < 1e-6, "{left} {right}");
}

/// Runs a study of outputs of the tuners a and b with a solver.
fn solve(outputs: &str, criteria: &str, task: &str) -> Value {
    let text = format!(
        "[study]\nname = 'jump'\n[models.m.equations]\nstates = {{ s = '1' }}\nparameters = {{ a = '1', b = '1' }}\nder = {{ s = '0' }}\n\
         outputs = {{ {outputs} }}\nhorizon = 1.0\n[tuners]\na = {{ start = 0.3, min = -2.0, max = 2.0 }}\n{criteria}\n[solver.genetic]\n"
    );
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    std::fs::write(&study, &text).unwrap();
    let arguments = [task, study.to_str().unwrap(), "--json", "--max-evaluations", "2000"];
    let output = cargo_bin_cmd!("mops").args(arguments).current_dir(folder.path()).output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

const B: &str =
    "b = { start = 0.2, min = -2.0, max = 2.0 }\n[criteria]\ny = { final-value = { signal = 'y' }, demand = 10 }";

#[test]
fn a_tuner_that_is_not_active_is_moved_as_a_constant() {
    let fixed = "b = { start = 1.0, min = -2.0, max = 2.0, active = false }\n[criteria]\ny = { final-value = { signal = 'y' }, demand = 1 }";
    let result = solve("y = '0.1 + (a - 1)^2 + if(b > 1.005, 5, 0)'", fixed, "run");
    let jump = &result["jumps"]["found"][0];
    assert!(jump["name"] == "b" && jump["misses"] == true, "{}", result["jumps"]);
    assert!(doubt(&result).contains("`b = { tolerance = 0.01 }`"), "{}", doubt(&result));
}

#[test]
fn no_line_against_a_jump_is_given_where_a_tolerance_is_no_part_of_the_value() {
    let criteria =
        "b = { start = 0.2, min = -2.0, max = 2.0 }\n[criteria]\ny = { final-value = { signal = 'y' }, demand = 1 }";
    let result = solve("y = '0.1 + a^2 + (b - 1)^2 + if(a > 0.005, 5, 0)'", criteria, "run");
    let text = doubt(&result);
    assert!(text.contains("Beside a jump: with tuner `a`") && !text.contains("To design against it"), "{text}");
}

#[test]
fn no_tuner_is_without_effect_at_a_stationary_point_or_a_kink() {
    for y in ["5 + 10*(a - 1)^2 + 100*(b - 1)^2", "5 + 10*abs(a - b) + 10*abs(b - 1) + a"] {
        let result = solve(&format!("y = '{y}'"), B, "sensitivity");
        let words = result["sensitivity"]["words"].to_string();
        assert!(!words.contains("has no effect") && !words.contains("can be estimated"), "{words}");
        assert!(words.contains("but a step of 10 % has an effect"), "{words}");
    }
}

#[test]
fn a_kink_at_which_both_sides_rise_alike_is_not_without_effect() {
    let result = solve("y = '5 + 10*abs(a - 1) + 10*abs(b - 1)'", B, "run");
    let words = result["end"]["words"].to_string();
    assert!(!words.contains("has no effect"), "{words}");
}
