//! The Pareto front of a study, compared with an independent computation.

#[path = "common/result.rs"]
mod result;

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use mops::core::front::hypervolume;
use mops_math as math;
use serde_json::Value;

/// Settling time, s, and overshoot of points of the front of the PID design. Source: independent computation with
/// SciPy, the overshoot minimised for each settling time, rounded to four digits.
const FRONT: [[f64; 2]; 14] = [
    [2.40, 0.4576],
    [3.0, 0.4032],
    [5.0, 0.3164],
    [7.0, 0.2078],
    [9.0, 0.1299],
    [11.0, 0.1033],
    [12.0, 0.0939],
    [13.0, 0.0859],
    [14.0, 0.0792],
    [15.0, 0.07359],
    [17.0, 0.0643],
    [20.0, 0.0532],
    [25.0, 0.0387],
    [29.2, 0.0292],
];

/// Half a unit in the last digit of these values.
const PRINTED: f64 = 5e-5;

fn pareto(folder: &Path, arguments: &[&str]) -> Value {
    let output = cargo_bin_cmd!("mops")
        .args(["pareto", "--json", "--out", folder.to_str().unwrap()])
        .args(arguments)
        .output()
        .unwrap();
    result::read(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Returns settling time and overshoot of the points.
fn points(result: &Value) -> Vec<[f64; 2]> {
    let of =
        |point: &Value| ["nominal/settling", "nominal/overshoot"].map(|key| point["criteria"][key].as_f64().unwrap());
    result["front"].as_array().unwrap().iter().map(of).collect()
}

#[test]
fn the_front_of_the_pid_design_agrees_with_an_independent_computation() {
    let folder = tempfile::tempdir().unwrap();
    let result = pareto(folder.path(), &["pid-pareto"]);
    let history = cargo_bin_cmd!("mops").args(["history", "--json", folder.path().to_str().unwrap()]).output().unwrap();
    let history: Value = serde_json::from_slice(&history.stdout).unwrap();
    assert_eq!(history[0]["evaluations"], result["evaluations"], "evaluations of certificates are included");
    assert_eq!((&result["stop"], &result["task"]), (&"converged".into(), &"pareto".into()));
    let front = points(&result);
    assert!((30..=34).contains(&front.len()), "{}", front.len());
    assert!(front.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] > pair[1][1]), "{front:?}");
    for [settling, overshoot] in &front {
        // No reference point is better in both criteria by more than a thousandth.
        let better = |known: &&[f64; 2]| known[0] < settling * 0.999 && known[1] + PRINTED < overshoot * 0.999;
        assert_eq!(FRONT.iter().find(better), None, "{settling} {overshoot}");
    }
    for known in FRONT {
        let better =
            |[settling, overshoot]: &&[f64; 2]| *settling < known[0] * 0.999 && *overshoot < known[1] * 0.999 - PRINTED;
        assert_eq!(front.iter().find(better), None, "{known:?}");
        // The front has a point nearby, within the spacing of thirty points.
        let near = |p: &[f64; 2]| math::hypot((p[0] - known[0]) / 27.0, (p[1] - known[1]) / 0.43);
        assert!(front.iter().map(near).fold(1.0, f64::min) < 0.05, "{known:?}");
    }
    let reference = [30.0, 0.5];
    let [found, known] = [front.concat(), FRONT.concat()].map(|points| hypervolume(&points, &reference));
    assert!(found > known, "{found} {known}");
    let simulations = result["simulations"].as_u64().unwrap();
    assert!(simulations < 9000, "{simulations}");
}

#[test]
fn knee_nearest_point_and_exchange_rates_agree_with_the_points_of_the_front() {
    let folder = tempfile::tempdir().unwrap();
    let result = pareto(folder.path(), &["pid-pareto", "--points", "12"]);
    let (front, found) = (points(&result), &result["trade_offs"]);
    assert_eq!(found["points"].as_array().unwrap().len(), front.len());
    let worst = |[settling, overshoot]: [f64; 2]| (settling / 15.0).max(overshoot / 0.1);
    let nearest = (0..front.len()).min_by(|&a, &b| worst(front[a]).total_cmp(&worst(front[b]))).unwrap();
    assert_eq!(found["nearest"], nearest);
    assert_eq!(
        result["tuners"][0]["value"], result["front"][nearest]["tuners"]["k"],
        "the reported design is this point"
    );
    // The min-max design has the worst scaled value 0.8630704 (independent computation with SciPy).
    assert!((worst(front[nearest]) - 0.863_070_4).abs() < 2e-4, "{}", worst(front[nearest]));
    // On a convex front the exchange rate given by the multipliers lies between the slopes of the two adjacent secants.
    let rates: Vec<f64> = found["neighbours"].as_array().unwrap().iter().map(|n| n["rate"].as_f64().unwrap()).collect();
    for (pair, i) in front.windows(2).zip(0..) {
        let rate: f64 = (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0]);
        assert!((rates[i] - rate).abs() < 1e-12);
    }
    let weights = |i: usize| {
        found["points"][i]["weights"].as_array().map(|w| w.iter().map(|w| w.as_f64().unwrap()).collect::<Vec<_>>())
    };
    let certified: Vec<(f64, [f64; 2])> = (1..front.len() - 1)
        .filter_map(|i| Some((weights(i)?, [rates[i - 1], rates[i]])))
        .map(|(w, rates)| (-w[0] / w[1], rates))
        .collect();
    assert!(certified.len() >= 3, "some points are certified: {certified:?}");
    for (price, [before, after]) in certified {
        assert!(
            price < 0.0 && price > 2.0 * before.min(after) && price < 0.5 * before.max(after),
            "{price} {before} {after}"
        );
    }
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("<h2 id=\"front\">Front</h2>"), "the page has a section on the front");
}

#[test]
fn a_front_of_few_evaluations_has_points_with_improving_directions_but_none_that_dominates_another() {
    let folder = tempfile::tempdir().unwrap();
    let result = pareto(folder.path(), &["pid-pareto", "--max-evaluations", "100"]);
    let found = &result["trade_offs"];
    let improvable = found["points"].as_array().unwrap().iter().filter(|point| point["pareto"] == "no").count();
    let words = found["words"].as_array().unwrap().iter().map(|line| line.as_str().unwrap()).collect::<Vec<_>>();
    assert!(words[0].contains("The search was cut off by the budget: other points may dominate these."), "{words:?}");
    let last = words.last().unwrap();
    assert!(
        improvable > 0
            && last.contains(&format!("; at {improvable} a step of a thousandth of the box improves one criterion")),
        "{last}"
    );
}

/// For demands equal to a point of the reference front, the optimal worst scaled value is 1.
#[test]
fn a_picked_point_is_optimal_for_its_demands() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    pareto(folder.path(), &["pid-pareto", "--points", "12"]);
    let run = |arguments: &[&str]| cargo_bin_cmd!("mops").args(arguments).output().unwrap();
    for known in FRONT.into_iter().filter(|[settling, _]| [7.0, 9.0, 12.0, 15.0, 20.0].contains(settling)) {
        let demands = [format!("settling={} s", known[0]), format!("overshoot={}", known[1])];
        let picked = run(&["pick", out, "--demand", &demands[0], "--demand", &demands[1]]);
        assert!(picked.status.success(), "{}", String::from_utf8_lossy(&picked.stderr));
        let study = folder.path().join("picked.toml");
        let again = folder.path().join("again");
        let looked = run(&[
            "run",
            study.to_str().unwrap(),
            "--json",
            "--max-evaluations",
            "1",
            "--out",
            again.to_str().unwrap(),
        ]);
        let result: Value = serde_json::from_slice(&looked.stdout).unwrap();
        assert_eq!((&result["task"], &result["study"]), (&"design".into(), &"pid-pareto-picked".into()));
        let worst = result["start"]["worst_scaled"].as_f64().unwrap();
        assert!((worst - 1.0).abs() < 1e-3 + PRINTED / known[1], "{known:?}: {worst}");
    }
}

/// A model whose outputs are functions of its parameters, over two cases: `f` is worst in the case `right` below `p` =
/// 0.5, else in `left`, and `g` does not depend on the case.
const CASES: &str = r#"
[study]
name = "cases"
[models.m.equations]
states = { x = "1" }
parameters = { p = "1", centre = "1" }
der = { x = "-x" }
outputs = { f = { value = "(p - centre)^2 + 1", unit = "1" }, g = { value = "(p - 3)^2 + 1", unit = "1" } }
horizon = "1 s"
[tuners]
p = { start = 0.2, min = -4.0, max = 4.0 }
[cases]
left = { centre = 0.0 }
right = { centre = 1.0 }
[criteria]
f = { final-value = { signal = "f" }, demand = 1.0 }
g = { final-value = { signal = "g" }, demand = 1.0 }
"#;

#[test]
fn the_worst_case_of_a_criterion_is_its_objective() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("own.toml");
    std::fs::write(&study, CASES).unwrap();
    let arguments = [study.to_str().unwrap(), "--points", "10"];
    let result = pareto(folder.path(), &arguments);
    let front = result["front"].as_array().unwrap();
    assert!(front.len() >= 10, "{}", front.len());
    for point in front {
        let p = point["tuners"]["p"].as_f64().unwrap();
        assert!((0.5 - 1e-6..=3.0 + 1e-6).contains(&p), "{p}");
        let objectives = point["objectives"].as_object().unwrap();
        assert_eq!(objectives.keys().collect::<Vec<_>>(), ["f", "g"]);
        assert!((objectives["f"].as_f64().unwrap() - (p * p + 1.0)).abs() < 1e-9);
        assert_eq!(point["criteria"].as_object().unwrap().len(), 4);
    }
    let found = &result["trade_offs"];
    let certified = |point: &&Value| point["pareto"] == "certified-local";
    assert!(found["points"].as_array().unwrap().iter().filter(certified).count() >= front.len() - 1);
    assert_eq!(found["criteria"].as_array().unwrap().iter().map(|c| &c["key"]).collect::<Vec<_>>(), ["f", "g"]);

    // Per case, `right/f` may be better at the cost of `left/f`: the front begins at p = 0.
    let result = pareto(folder.path(), &[&arguments[..], &["--per-case"]].concat());
    let front = result["front"].as_array().unwrap();
    assert_eq!(front[0]["objectives"].as_object().unwrap().len(), 4);
    let least = front.iter().map(|point| point["tuners"]["p"].as_f64().unwrap()).fold(f64::INFINITY, f64::min);
    // The other objectives are lowered within the constraint tolerance, twice: p^2 < 2.1e-6.
    assert!(least.abs() < 1.5e-3, "{least}");
}

#[test]
fn a_front_keeps_its_budget_and_says_why_points_are_missing() {
    let folder = tempfile::tempdir().unwrap();
    let result = pareto(folder.path(), &["pid-pareto", "--points", "40", "--max-evaluations", "400"]);
    assert!(result["evaluations"].as_u64().unwrap() <= 400, "{}", result["evaluations"]);
    let front = result["front"].as_array().unwrap().len();
    let warnings = result["warnings"].to_string();
    let is_reported =
        warnings.contains(&format!("40 points were asked for, the front has {front}: the budget was spent"));
    assert!(is_reported == (front < 40), "{front} {warnings}");
}

/// `d` alone decides the maximum, 2, whatever `a` is; `c = 1 + a` costs nothing.
#[test]
fn a_criterion_that_does_not_decide_the_maximum_is_lowered_at_no_cost() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("own.toml");
    let text = r#"
[study]
name = "slack"
[models.m.equations]
states = { x = "1" }
parameters = { a = "1" }
der = { x = "-x" }
outputs = { c = { value = "1 + a", unit = "1" }, d = { value = "2 + 0*a", unit = "1" } }
horizon = "1 s"
[tuners]
a = { start = 0.5, min = 0.0, max = 1.0 }
[criteria]
c = { final-value = { signal = "c" }, demand = 1.0 }
d = { final-value = { signal = "d" }, demand = 1.0 }
"#;
    std::fs::write(&study, text).unwrap();
    let output = cargo_bin_cmd!("mops")
        .args(["run", study.to_str().unwrap(), "--json", "--out", folder.path().to_str().unwrap()])
        .output()
        .unwrap();
    let result = result::read(&output.stdout).unwrap();
    assert!((result["criteria"][0]["value"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{}", result["criteria"]);
    assert!((result["worst_scaled"].as_f64().unwrap() - 2.0).abs() < 1e-12);
}

/// DTLZ2 with six criteria and eight tuners: the front is the part of the unit sphere with positive coordinates.
/// Source: K. Deb, L. Thiele, M. Laumanns, E. Zitzler, Scalable test problems (2005).
#[test]
fn a_front_of_six_criteria_lies_on_the_sphere() {
    const CRITERIA: usize = 6;
    let folder = tempfile::tempdir().unwrap();
    let objective = |k: usize| {
        let cosines: String = (0..CRITERIA - 1 - k).map(|j| format!("*cos(p{j}*pi/2)")).collect();
        let sine = if k == 0 { String::new() } else { format!("*sin(p{}*pi/2)", CRITERIA - 1 - k) };
        format!("f{k} = {{ value = \"(1 + g){cosines}{sine}\", unit = \"1\" }}")
    };
    let join = |rows: Vec<String>, by: &str| rows.join(by);
    let of_tuners = |row: fn(usize) -> String| (0..8).map(row).collect::<Vec<_>>();
    let text = [
        "[study]\nname = \"sphere\"\nobjective = \"each\"\n[models.m.equations]\nstates = { x = \"1\" }".to_owned(),
        format!("parameters = {{ {} }}", join(of_tuners(|i| format!("p{i} = \"1\"")), ", ")),
        "let = { g = \"(p5 - 0.5)^2 + (p6 - 0.5)^2 + (p7 - 0.5)^2\" }\nder = { x = \"-x\" }\nhorizon = \"1 s\""
            .to_owned(),
        format!("outputs = {{ {} }}\n[tuners]", join((0..CRITERIA).map(objective).collect(), ", ")),
        join(of_tuners(|i| format!("p{i} = {{ start = 0.4, min = 0.0, max = 1.0 }}")), "\n"),
        "[criteria]".to_owned(),
        join(
            (0..CRITERIA)
                .map(|k| format!("c{k} = {{ final-value = {{ signal = \"f{k}\" }}, demand = 1.0 }}"))
                .collect(),
            "\n",
        ),
    ];
    let study = folder.path().join("own.toml");
    std::fs::write(&study, text.join("\n")).unwrap();
    let result = pareto(folder.path(), &[study.to_str().unwrap(), "--points", "30"]);
    let front = result["front"].as_array().unwrap();
    assert!(front.len() >= 30, "{}", front.len());
    for point in front {
        let objectives = point["objectives"].as_object().unwrap().values().map(|f| f.as_f64().unwrap());
        let radius = objectives.map(|f| f * f).sum::<f64>().sqrt();
        assert!((radius - 1.0).abs() < 1e-3, "{radius}");
    }
}
