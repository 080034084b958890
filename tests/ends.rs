//! Ends of searches: the named solvers on shipped studies, and what the output says of a point that is not an optimum.

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

/// Runs a study; returns the result and the text of the terminal.
fn run(study: &str, folder: &Path, more: &[&str]) -> (Value, String) {
    let out = folder.join("out");
    let mut command = cargo_bin_cmd!("mops");
    command.args(["run", study, "--out", out.to_str().unwrap()]).args(more);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let result = serde_json::from_slice(&std::fs::read(out.join("result.json")).unwrap()).unwrap();
    (result, String::from_utf8(output.stdout).unwrap())
}

/// Values of independent programs (SciPy, an own simulator), or the least of all runs.
const OPTIMA: &[(&str, f64)] = &[
    ("pid-design", 0.863_070_4),
    ("pid-design-constrained", 0.735_926_5),
    ("pid-design-multi-case", 3.895_509_8),
    ("furuta-swing", 0.093_45),
    ("furuta-calibration-2-joint", 3.3759),
];

#[test]
#[ignore = "full tier"]
fn each_named_solver_finds_the_optimum_of_the_named_studies() {
    let folder = tempfile::tempdir().unwrap();
    for (study, optimum) in OPTIMA {
        for solver in ["sqp", "pattern-search", "genetic"] {
            let (result, text) = run(study, folder.path(), &["--solver", solver]);
            let objective = result["objective"].as_f64().unwrap();
            assert!(objective < optimum * 1.001, "{solver} on {study}: {objective} {text}");
            assert!(result["evaluations"].as_u64().unwrap() <= 20_000);
        }
    }
}

#[test]
fn a_genetic_search_without_local_ones_is_not_certified() {
    let folder = tempfile::tempdir().unwrap();
    let alone = ["--solver", "genetic", "--max-evaluations", "2000", "--set", "solver.genetic.polish=false"];
    let (result, text) = run("furuta-swing", folder.path(), &alone);
    assert!(result["objective"].as_f64().unwrap() > 0.1, "a genetic search alone is far from the optimum");
    assert_eq!((&result["end"]["point"], &result["pareto"]), (&"descent".into(), &"not-shown".into()), "{text}");
    let first = text.lines().filter(|line| !line.is_empty()).nth(1).unwrap();
    assert!(first.starts_with("Not an optimum"), "{text}");
}

/// A linear criterion that is cut off at 3 from above, as a settling time at the end of a short simulation.
const SATURATED: &str = r#"
[study]
name = "saturated"

[models.plant.equations]
states     = { x = "1" }
parameters = { a = "1", b = "1" }
der        = { x = "-x*1 [1/s]" }
outputs    = { y = { value = "min(3, 5 - a - b)", unit = "1" } }
horizon    = "1 s"

[tuners]
a = { start = 0.3, min = 0, max = 2 }
b = { start = 0.4, min = 0, max = 2 }

[criteria]
peak = { peak = { signal = "y" }, demand = 1 }
"#;

#[test]
fn a_plateau_is_neither_converged_nor_certified() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    std::fs::write(&study, SATURATED).unwrap();
    let alone = ["--solver", "sqp", "--set", "solver.sqp.starts=1"];
    let (result, text) = run(study.to_str().unwrap(), folder.path(), &alone);
    assert_eq!(result["end"]["point"], "plateau", "{text}");
    assert_eq!((&result["stop"], &result["pareto"]), (&"stalled".into(), &"not-shown".into()));
    assert!(text.contains("On a plateau"), "{text}");
    // With starting points in the whole box, the search sees where the criterion falls.
    let (result, text) = run(study.to_str().unwrap(), folder.path(), &["--solver", "sqp"]);
    assert_eq!((&result["end"]["point"], &result["stop"]), (&"stationary".into(), &"converged".into()), "{text}");
    assert!((result["objective"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{text}");
}

/// Paraboloid of two tuners between two limits, `clip(rise + width ((a - a0)^2 + (b - b0)^2), low, high)`.
struct Saturated {
    rise: f64,
    width: f64,
    centre: [f64; 2],
    limits: [f64; 2],
}

impl Saturated {
    fn random(uniform: &mut impl FnMut() -> f64) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * uniform();
        let low = between(0.05, 1.5);
        Self {
            rise: between(-1.0, 1.0),
            width: between(0.2, 3.0),
            centre: [between(-1.0, 3.0), between(-1.0, 3.0)],
            limits: [low, low + between(0.1, 2.0)],
        }
    }

    fn at(&self, [a, b]: [f64; 2]) -> f64 {
        let [a0, b0] = self.centre;
        let squares = (a - a0) * (a - a0) + (b - b0) * (b - b0);
        (self.rise + self.width * squares).clamp(self.limits[0], self.limits[1])
    }

    fn formula(&self) -> String {
        let Self { rise, width, centre: [a, b], limits: [low, high] } = self;
        format!("clip({rise} + {width}*((a - ({a}))^2 + (b - ({b}))^2), {low}, {high})")
    }
}

#[test]
#[ignore = "full tier"]
fn no_search_converges_on_a_plateau_of_saturated_criteria() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    let mut uniform = uniform(7);
    let [mut plateaus, mut slopes] = [0; 2];
    for k in 0..40 {
        let criteria = [Saturated::random(&mut uniform), Saturated::random(&mut uniform)];
        let start = [2.0 * uniform(), 2.0 * uniform()];
        let text = format!(
            "[study]\nname = \"saturated\"\n[models.plant.equations]\nstates = {{ x = \"1\" }}\n\
             parameters = {{ a = \"1\", b = \"1\" }}\nder = {{ x = \"-x*1 [1/s]\" }}\nhorizon = \"0.1 s\"\n\
             outputs = {{ y = {{ value = \"{}\", unit = \"1\" }}, z = {{ value = \"{}\", unit = \"1\" }} }}\n\
             [tuners]\na = {{ start = {}, min = 0, max = 2 }}\nb = {{ start = {}, min = 0, max = 2 }}\n\
             [criteria]\ny = {{ peak = {{ signal = \"y\" }}, demand = 1 }}\nz = {{ peak = {{ signal = \"z\" }}, demand = 1 }}\n",
            criteria[0].formula(),
            criteria[1].formula(),
            start[0],
            start[1],
        );
        std::fs::write(&study, text).unwrap();
        let solver = ["auto", "sqp", "pattern-search", "genetic"][k % 4];
        let more = ["--solver", solver, "--max-evaluations", "1000"];
        let (result, text) = run(study.to_str().unwrap(), folder.path(), &more);
        let at = ["a", "b"].map(|name| {
            let tuner = result["tuners"].as_array().unwrap().iter().find(|tuner| tuner["name"] == name);
            tuner.unwrap()["value"].as_f64().unwrap()
        });
        let objective = |at: [f64; 2]| criteria[0].at(at).max(criteria[1].at(at));
        // 200 random points in a square with a side of 0.002 in the unit box.
        let mut around = (0..200).map(|_| at.map(|u| (u + 4e-3 * (uniform() - 0.5)).clamp(0.0, 2.0)));
        #[allow(clippy::float_cmp)]
        let is_plateau = around.all(|there| objective(there) == objective(at));
        if is_plateau {
            plateaus += 1;
            assert_ne!(result["stop"], "converged", "{k}, {solver}: {text}");
            assert_ne!(result["pareto"], "certified-local", "{k}, {solver}: {text}");
            assert!(text.contains("On a plateau"), "{k}, {solver}: {text}");
        } else {
            slopes += 1;
        }
    }
    assert!(plateaus > 5 && slopes > 5, "{plateaus} and {slopes}");
}

#[test]
fn a_discontinuity_and_ends_that_differ_are_the_first_line() {
    let folder = tempfile::tempdir().unwrap();
    let (result, text) = run("pole-placement-retuning", folder.path(), &["--solver", "sqp"]);
    assert_eq!(result["end"]["point"], "jump", "{text}");
    assert!(result["end"]["doubt"].as_str().unwrap().starts_with("Another basin is likely"), "{text}");
    assert!(result["end"]["optima"].as_u64().unwrap() > 1, "{text}");
}

#[test]
#[ignore = "full tier"]
fn along_a_curved_ridge_of_constraints_every_seed_ends_at_the_optimum() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study.toml");
    // The constraints of its README, which make the settling time smooth.
    let smooth = r#"
peak = { peak          = { signal = "phi" }, usage = "inequality", demand = "30.3 deg" }
dip  = { step-envelope = { signal = "phi", lower = [["1.2 s", "29.7 deg"]] }, usage = "inequality", good = "-0.3 deg", bad = "0 deg" }
"#;
    let shipped = std::fs::read_to_string("studies/pole-placement-retuning/study.toml").unwrap();
    std::fs::write(&study, shipped + smooth).unwrap();
    for seed in ["1", "2", "3", "4", "5"] {
        let (result, text) = run(study.to_str().unwrap(), folder.path(), &["--seed", seed]);
        // 1.11584 by an independent program (SciPy).
        assert!(result["objective"].as_f64().unwrap() < 1.11584 * 1.001, "{seed}: {text}");
    }
}

/// Uniform numbers between 0 and 1, from a linear congruential generator.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Standard normal numbers by the sum of twelve uniform ones.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut uniform = uniform(seed);
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// Writes a study of several records of a first-order lag with free initial states; returns its path.
fn lags(folder: &Path, records: u32, stated_noise: f64) -> String {
    let mut experiments = String::new();
    for record in 0..records {
        let mut noise = noise(u64::from(record) + 1);
        let rows = (0..200).map(|k| f64::from(k) * 0.05).map(|t| {
            let y = 2.0 * (1.0 - mops_math::exp(-t / 3.0)) + 0.05 * noise();
            format!("{t},{y}\n")
        });
        let text = "t [s],y\n".to_owned() + &rows.collect::<String>();
        std::fs::write(folder.join(format!("r{record}.csv")), text).unwrap();
        experiments += &format!(
            "[experiments.r{record}]\nfile = \"r{record}.csv\"\nfree = [\"x\"]\n\
             channels = {{ x = {{ column = \"y\", noise = {stated_noise}, unit = \"1\" }} }}\n"
        );
    }
    let study = folder.join(format!("lags-{records}.toml"));
    let text = format!(
        "[study]\nname = \"lags\"\ntask = \"calibration\"\n\
         [models.m.equations]\nstates = {{ x = \"1\" }}\nparameters = {{ K = \"1\", T = \"s\" }}\nder = {{ x = \"(K - x)/T\" }}\n\
         {experiments}[tuners]\nK = {{ start = 1.0, min = 0.1, max = 10.0, scale = \"log\" }}\n\
         T = {{ start = 1.0, min = 0.1, max = 100.0, scale = \"log\" }}\n\
         [criteria]\ny = {{ normalised-error = {{ signal = \"x\" }} }}\n"
    );
    std::fs::write(&study, text).unwrap();
    study.to_str().unwrap().to_owned()
}

#[test]
fn a_calibration_ends_where_the_residuals_are_noise_whatever_the_number_of_records() {
    let folder = tempfile::tempdir().unwrap();
    let [one, many] = [1, 12].map(|records| run(&lags(folder.path(), records, 0.05), folder.path(), &[]));
    for (result, text) in [&one, &many] {
        assert!(text.contains("noise of the stated level"), "{text}");
        assert_eq!(result["end"]["searches"], 1);
        for (tuner, truth) in [(0, 2.0), (1, 3.0)] {
            let value = result["tuners"][tuner]["value"].as_f64().unwrap();
            assert!((value / truth - 1.0).abs() < 0.05, "{value} {truth}");
        }
    }
    let evaluations = |result: &Value| result["evaluations"].as_u64().unwrap();
    assert!(evaluations(&many.0) <= evaluations(&one.0) + 5, "{} {}", evaluations(&many.0), evaluations(&one.0));
    // Residuals are neither kept nor stored.
    let database = std::fs::metadata(folder.path().join("out/evaluations.sqlite")).unwrap().len();
    assert!(database < 200_000, "{database}");
}

#[test]
fn residuals_above_or_far_below_the_stated_noise_do_not_end_a_calibration() {
    let folder = tempfile::tempdir().unwrap();
    for stated in [0.02, 0.5] {
        let (result, text) = run(&lags(folder.path(), 1, stated), folder.path(), &[]);
        assert!(!text.contains("noise of the stated level"), "{stated}: {text}");
        assert!(result["end"]["searches"].as_u64().unwrap() > 1);
    }
}

#[test]
fn two_points_that_fit_equally_well_are_not_one_optimum() {
    // tau y' = p^2 u - y: the data do not show the sign of p. The stated noise is too small, so that searches go on.
    let folder = tempfile::tempdir().unwrap();
    let mut noise = noise(3);
    let rows = (0..=200).map(|k| {
        let t = 0.1 * f64::from(k);
        format!("{t},1,{}\n", 2.0 * (1.0 - mops_math::exp(-t / 3.0)) + 0.01 * noise())
    });
    std::fs::write(folder.path().join("step.csv"), format!("t[s],u,y\n{}", rows.collect::<String>())).unwrap();
    let study = folder.path().join("study.toml");
    std::fs::write(
        &study,
        "[study]\nname = 'sign'\ntask = 'calibration'
        [models.m.equations]
        states = { y = '1' }
        inputs = { u = '1' }
        parameters = { tau = 's', p = '1' }
        der = { y = \"tau*y' = p^2*u - y\" }
        [tuners]
        tau = { start = 5, min = 0.3, max = 50, scale = 'log' }
        p = { start = 0.5, min = -5, max = 5 }
        [experiments.e]
        file = 'step.csv'
        channels = { y = { column = 'y', noise = 0.004 } }
        inputs = { u = 'u' }
        [criteria]
        y = { normalised-error = { signal = 'y' } }",
    )
    .unwrap();
    let (result, text) = run(study.to_str().unwrap(), folder.path(), &[]);
    let doubt = result["end"]["doubt"].as_str().unwrap_or_else(|| panic!("{text}"));
    assert!(doubt.starts_with("Not unique") && doubt.contains("p = ") && !doubt.contains("tau"), "{doubt}");
    assert!(!text.contains("found 1 optimum"), "{text}");
    // The report says that the residuals exceed the noise.
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("times the stated noise"), "a misfit is not green");
}

#[test]
fn a_bench_that_the_time_limit_cuts_off_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let bench = |limit: &str| {
        let mut command = cargo_bin_cmd!("mops");
        command.args(["bench", "pid-design", "--solver", "nelder-mead,sqp", "--seeds", "1000", "--jobs", "1"]);
        command.args(["--max-evaluations", "200", "--time-limit", limit, "--out", "out"]);
        let output = command.current_dir(folder.path()).output().unwrap();
        let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        (output.status.code().unwrap(), text)
    };
    let (code, text) = bench("0.001");
    assert!(code == 3 && text.contains("the time limit ended the bench after 0 of 2000 runs"), "{text}");
    assert!(text.contains("--time-limit") && !text.contains("constraint"), "{text}");
    let (code, text) = bench("3");
    assert!(code == 0 && text.contains("cut off by the time limit: ") && text.contains("of 2000 runs"), "{text}");
    let page = std::fs::read_to_string(folder.path().join("out/bench.html")).unwrap();
    assert!(page.contains("cut off by the time limit"), "the page says it too");
}

#[test]
fn solvers_are_compared_on_a_study_by_their_success() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bench");
    let mut command = cargo_bin_cmd!("mops");
    command.args(["bench", "pid-design", "--solver", "sqp,nelder-mead", "--seeds", "2", "--max-evaluations", "600"]);
    let output = command.args(["--json", "--out", out.to_str().unwrap()]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let bench: Value = serde_json::from_slice(&output.stdout).unwrap();
    let runs = bench["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    let known = bench["known"].as_f64().unwrap();
    assert!((known / 0.863_070_4 - 1.0).abs() < 1e-3, "{known}");
    for run in runs {
        let objective = run["objective"].as_f64().unwrap();
        assert_eq!(run["success"], objective <= known * 1.001, "{run}");
        assert_eq!(run["arrived"].is_null(), run["success"] == false, "{run}");
        assert!(run["evaluations"].as_u64().unwrap() <= 600);
    }
    let lines = std::fs::read_to_string(out.join("runs.csv")).unwrap().lines().count();
    assert_eq!(lines, 5);
    for file in ["profile.svg", "profile.png", "bench.html"] {
        assert!(out.join(file).exists(), "{file}");
    }
}
