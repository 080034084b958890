//! The command line of `mops-bench`.

mod ablation;
mod diagnosis;
mod files;
mod folder;
mod kinds;
mod suite;
mod tables;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use mops::Catalogue;
use mops::terminal::print;

/// Benchmarks of mops: solvers on problems with known solutions, the diagnosis on simulated experiments.
#[derive(Parser)]
#[command(
    name = "mops-bench",
    version,
    max_term_width = 100,
    after_help = "\
Start with:
  mops-bench minimax --solver sqp --solver auto --out bench    two solvers on a suite; open bench/index.html
  mops-bench minimax --against bench/results.json              compared with stored results
  mops-bench diagnosis --cases 20 --none 10                    the diagnosis on simulated experiments
  mops-bench diagnosis --kinds A,B,C,D,S --per-kind 20         the same with model errors in the background

Exit status: 0 done; 2 the command line is wrong; 3 the benchmark failed; 4 interrupted, with the finished cases kept."
)]
struct Arguments {
    #[command(subcommand)]
    benchmark: Benchmark,
}

#[derive(Subcommand)]
enum Benchmark {
    /// Find missing effects in simulated experiments: rates, reliability of probabilities, coverage of intervals, time.
    ///
    /// The experiments come from a simulator that shares no code with models and effects. Parameters of the plants and
    /// places of the effects are random. The size of an effect is the error of the refitted nominal model in units of
    /// the noise.
    ///
    /// Ctrl-C ends the benchmark and keeps the finished cases.
    Diagnosis(diagnosis::Arguments),
    /// Repeat the diagnosis of simulated experiments with one setting after the other halved and doubled.
    Ablation(ablation::Arguments),
    /// Print the JSON schema of case.json, the format of the cases of `diagnosis --folder`.
    Schema,
    /// Print the Markdown table of figures stored with `--csv`.
    Table {
        /// CSV file.
        file: PathBuf,
    },
    #[command(flatten)]
    Suite(suite::Chosen),
}

/// Parses the command line and runs the benchmark.
pub(crate) fn main(catalogue: &Catalogue) -> ExitCode {
    let done = match Arguments::parse().benchmark {
        Benchmark::Diagnosis(arguments) => diagnosis::bench(catalogue, &arguments),
        Benchmark::Ablation(arguments) => ablation::ablation(&arguments),
        Benchmark::Schema => print(&crate::diagnosis::schema()).map(|()| ExitCode::SUCCESS),
        Benchmark::Table { file } => suite::markdown(&file),
        Benchmark::Suite(chosen) => suite::bench(catalogue, &chosen),
    };
    done.unwrap_or_else(|error| error.report())
}
