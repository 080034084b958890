//! The command line: what can be typed, and which file does it.

mod check;
mod compare;
mod data;
mod describe;
mod diagnose;
mod diagnosis;
mod effect;
mod families;
mod findings;
mod history;
mod keep;
mod linear_plots;
mod linearise;
mod list;
mod new;
mod pareto;
mod past;
mod pick;
mod places;
mod remains;
mod report;
mod robustness;
mod run;
mod schema;
mod simulate;
mod study;
mod tables;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use mops_core::Catalogue;

use crate::terminal::{CommandError, print};

/// Multi-objective parameter synthesis: design controllers and identify models from measurements.
///
/// A study (a TOML file, or the name of a shipped one) names models, cases, tuners and criteria with their demands; mops
/// chooses the tuners so that the worst scaled criterion is as small as it can be.
#[derive(Parser)]
#[command(
    name = "mops",
    version,
    max_term_width = 100,
    after_help = "\
Begin with:
  mops list                      what is there
  mops run pid-design            run a shipped study; open results/pid-design/report.html
  mops new my-loop               write a commented study to start from
  mops describe settling-time    what a kind computes, and its options

Exit status: 0 done; 1 done, but a constraint is violated; 2 the study, its data or the command line is wrong; 3 the run
failed; 4 a signal ended it, with the best so far written."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Folder of studies to know by name, each a folder with study.toml; beside those in the variable MOPS_STUDIES.
    #[arg(long = "studies", value_name = "DIR", global = true, help_heading = "Global options")]
    studies: Vec<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    /// Solve a study and write result.json, report.html, plots and evaluations.
    Run(run::Arguments),
    /// Find the front of a design study: the designs that no other is better than in every criterion.
    Pareto(pareto::Arguments),
    /// Pick the point of a finished front for other demands, and write a study that starts there.
    Pick(pick::Arguments),
    /// Find the physical effect that the model of a calibration lacks, add it, and report before and after.
    Diagnose(diagnose::Arguments),
    /// List the runs below a folder: study, date, worst scaled value, evaluations.
    History(history::Arguments),
    /// Show runs side by side: tuners, criteria, differences in percent; and a page with their responses.
    Compare(compare::Arguments),
    /// Write the report of a run again, from what it left; of a run that was killed, as far as it came.
    Report(report::Arguments),
    /// Check a study and its data without running anything.
    Check(check::Arguments),
    /// List the kinds of model, criterion and solver, the effects a model may lack, and the shipped studies.
    List(list::Arguments),
    /// Describe a kind, an effect, a shipped study, or a signal list of a model: formula, options, units, source.
    Describe(describe::Arguments),
    /// Write a commented study to start from, or a copy of a shipped one.
    New(new::Arguments),
    /// Simulate a study once at given values: table of criteria, CSV and plots.
    Simulate(simulate::Arguments),
    /// Linearise a model of a study: A, B, C, D, poles, zeros, transfer functions, plots, state feedback.
    Linearise(linearise::Arguments),
    /// Show what is in a data file: columns, units, ranges, gaps, sample time, noise.
    Data(data::Arguments),
    /// Print the JSON schema of study files, for completion in an editor.
    Schema,
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// Parses the command line and does what it asks.
pub(crate) fn main(catalogue: Catalogue) -> ExitCode {
    let Arguments { command, studies } = Arguments::parse();
    let of_environment = std::env::var_os("MOPS_STUDIES").unwrap_or_default();
    let folders = std::env::split_paths(&of_environment).filter(|path| !path.as_os_str().is_empty()).chain(studies);
    match study::with_folders(catalogue, &folders.collect::<Vec<_>>()) {
        Ok(catalogue) => perform(&catalogue, command),
        Err(mistake) => CommandError::from(mistake).report(),
    }
}

fn perform(catalogue: &Catalogue, command: Command) -> ExitCode {
    let outcome = match command {
        Command::Run(arguments) => run::run(catalogue, &arguments),
        Command::Pareto(arguments) => pareto::pareto(catalogue, &arguments),
        Command::Pick(arguments) => pick::pick(catalogue, &arguments),
        Command::Diagnose(arguments) => diagnose::diagnose(catalogue, &arguments),
        Command::History(arguments) => history::history(catalogue, &arguments),
        Command::Compare(arguments) => compare::compare(catalogue, &arguments),
        Command::Report(arguments) => report::report(catalogue, &arguments),
        Command::Check(arguments) => check::check(catalogue, &arguments),
        Command::List(arguments) => list::list(catalogue, &arguments),
        Command::Describe(arguments) => describe::describe(catalogue, &arguments),
        Command::New(arguments) => new::new(catalogue, &arguments),
        Command::Simulate(arguments) => simulate::simulate(catalogue, &arguments),
        Command::Linearise(arguments) => linearise::linearise(catalogue, &arguments),
        Command::Data(arguments) => data::data(&arguments),
        Command::Schema => schema::schema(catalogue),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "mops", &mut script);
            print(&String::from_utf8_lossy(&script)).map(|()| ExitCode::SUCCESS)
        }
    };
    outcome.unwrap_or_else(|error| error.report())
}
