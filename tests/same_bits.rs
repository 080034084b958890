//! Equal bits on processors with and without fused multiply-add and wide registers.
//!
//! The C library chooses its kernels by the processor when a program is loaded; an environment variable disables
//! features. A run that calls one of its elementary functions then has other bits. Code that queries the processor
//! itself is not covered.

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;

/// Processor features with kernels of their own in the GNU C library, by the names before and after version 2.33.
const MASKED: &str = "glibc.cpu.hwcaps=-AVX2,-AVX,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable,-AVX512F_Usable";

/// Runs a study into a folder; returns result.json without the line of `seconds`, and evaluations.csv.
fn run(study: &str, more: &[&str], out: &Path, tunables: Option<&str>) -> [String; 2] {
    let mut command = cargo_bin_cmd!("mops");
    command.args(["run", study, "--quiet", "--out"]).arg(out).args(more).env_remove("GLIBC_TUNABLES");
    if let Some(tunables) = tunables {
        command.env("GLIBC_TUNABLES", tunables);
    }
    let output = command.output().expect("mops can be started");
    assert!(matches!(output.status.code(), Some(0 | 1)), "{study}: {}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap_or_default();
    let clockless =
        |text: String| text.lines().filter(|line| !line.contains("\"seconds\"")).collect::<Vec<_>>().join("\n");
    [clockless(read("result.json")), read("evaluations.csv")]
}

/// Studies that together use every elementary function of solvers, models, criteria, estimates and noise, with small
/// budgets.
#[test]
fn a_processor_without_fused_products_gives_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    for (index, (study, more)) in [
        // Time domain, with the solvers that `auto` takes; normal numbers; the solvers of argmin.
        ("pid-design", &["--max-evaluations", "300"][..]),
        ("pid-design", &["--solver", "cma-es", "--max-evaluations", "300"]),
        ("pid-design", &["--solver", "differential-evolution", "--max-evaluations", "200"]),
        ("pid-design", &["--solver", "simulated-annealing", "--max-evaluations", "200"]),
        ("pid-design", &["--solver", "particle-swarm", "--max-evaluations", "200"]),
        ("pid-design", &["--solver", "nelder-mead", "--max-evaluations", "200"]),
        ("pid-design", &["--solver", "l-bfgs", "--max-evaluations", "200"]),
        ("pid-design", &["--solver", "pattern-search", "--max-evaluations", "200"]),
        ("pid-design-constrained", &["--max-evaluations", "100"]),
        ("pid-pareto", &["--max-evaluations", "200"]),
        // Frequency responses, eigenvalues and Riccati equations.
        ("multi-model", &["--max-evaluations", "60"]),
        ("pole-placement-retuning", &["--max-evaluations", "60"]),
        ("mops-bench/control/absorber-hinf.toml", &["--max-evaluations", "60"]),
        // Least squares with tangents, standard errors and their quantiles.
        ("furuta-calibration", &["--max-evaluations", "15"]),
        ("step-identification", &["--max-evaluations", "30"]),
        ("mops-bench/control/misra1a.toml", &[]),
        ("tank-level", &["--max-evaluations", "60"]),
        // Quantiles of uncertain parameters, intervals of shares.
        ("pid-robust", &["--set", "study.task=\"monte-carlo\"", "--set", "monte-carlo.samples=40"]),
    ]
    .into_iter()
    .enumerate()
    {
        let here = run(study, more, &folder.path().join(format!("{index} here")), None);
        let there = run(study, more, &folder.path().join(format!("{index} there")), Some(MASKED));
        assert!(here[0].len() > 100, "{study}: a result was written");
        for (name, [a, b]) in
            ["result.json", "evaluations.csv"].into_iter().zip([[&here[0], &there[0]], [&here[1], &there[1]]])
        {
            let other = a.lines().zip(b.lines()).find(|(a, b)| a != b);
            assert!(a == b, "{study} {more:?}, {name}: {other:?}");
        }
    }
}

/// Elementary functions of the C library whose last digit IEEE 754 does not specify.
#[cfg(target_os = "linux")]
const ROUNDED: [&str; 27] = [
    "sin", "cos", "tan", "sincos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "exp", "exp2", "exp10", "expm1", "log", "log2", "log10", "log1p", "pow", "cbrt", "hypot", "lgamma", "tgamma",
];

/// Returns the symbols that a 64-bit ELF file imports from libraries.
///
/// Source: System V Application Binary Interface, edition 4.1, chapter 4: section headers, symbol table.
#[cfg(target_os = "linux")]
fn imported(file: &[u8]) -> Vec<String> {
    let number = |at: usize, bytes: usize| file[at..at + bytes].iter().rev().fold(0, |n, b| n << 8 | usize::from(*b));
    // Kind, offset, size and linked section of every section header.
    let (headers, size, count) = (number(0x28, 8), number(0x3a, 2), number(0x3c, 2));
    let section = |index: usize| {
        let at = headers + index * size;
        [number(at + 4, 4), number(at + 0x18, 8), number(at + 0x20, 8), number(at + 0x28, 4)]
    };
    let dynamic = (0..count).map(section).find(|[kind, ..]| *kind == 11).expect("a table of dynamic symbols");
    let [_, names, ..] = section(dynamic[3]);
    let symbols = (dynamic[1]..dynamic[1] + dynamic[2]).step_by(24);
    let undefined = symbols.filter(|at| number(at + 6, 2) == 0).map(|at| names + number(at, 4));
    undefined.map(|at| file[at..].iter().take_while(|b| **b != 0).map(|b| char::from(*b)).collect()).collect()
}

/// The two remaining functions do not affect results: SQLite uses `log` for ranks of a full-text search, indicatif uses
/// `pow` for the remaining time of a progress bar.
#[cfg(target_os = "linux")]
#[test]
fn the_program_links_no_elementary_function_that_affects_results() {
    let symbols = imported(&std::fs::read(assert_cmd::cargo::cargo_bin!("mops")).unwrap());
    assert!(symbols.iter().any(|name| name == "malloc"), "symbols are read: {symbols:?}");
    let mut asked: Vec<&str> = symbols.iter().map(String::as_str).filter(|name| ROUNDED.contains(name)).collect();
    asked.sort_unstable();
    assert!(asked.iter().all(|name| ["log", "pow"].contains(name)), "{asked:?}");
}
