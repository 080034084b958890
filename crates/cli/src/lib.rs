//! The command line of `mops`.
//!
//! [`main`] parses the arguments of a program with a catalogue and performs its command. A command has the module of
//! its name; the commands of tasks are in `tasks`.
//!
//! | module | content |
//! |---|---|
//! | [`terminal`] | error messages, tables, progress, Ctrl-C: for other programs too |
//! | `study`, `home` | opening of studies, and where they are |
//! | `reading` | folders whose files a study may read |
//! | `run_files`, `default_folder` | files of a run, and their folder without `--out` |
//! | `past_run`, `resume` | earlier runs, and their stored evaluations |
//! | `tables`, `blocks`, `families` | tables on the terminal: criteria and tuners, content of a report, names such as `T[1]` to `T[100]` |
//! | `effect`, `places` | effects, and the places of a model where they can act |
//! | `linear_plots` | plots of a linear system |
//! | `reference` | test of the generated part of the pages in `docs/reference` |

mod bench;
mod blocks;
mod check;
mod compare;
mod data;
mod default_folder;
mod describe;
mod effect;
mod families;
mod history;
mod home;
mod linear_plots;
mod linearise;
mod list;
mod new;
mod past_run;
mod pick;
mod places;
mod reading;
#[cfg(test)]
mod reference;
mod report;
mod resume;
mod run;
mod run_files;
mod schema;
mod simulate;
mod study;
mod tables;
mod tasks;
pub mod terminal;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use mops_core::Catalogue;

use crate::terminal::{CommandError, print, show_each_panic_once};

/// Multi-objective parameter synthesis: design controllers and identify models from measurements.
///
/// A study (a TOML file, or the name of a shipped study) defines models, cases, tuners (the parameters to be chosen)
/// and criteria with demands. mops chooses the tuners that minimise the worst scaled criterion (value / demand).
#[derive(Parser)]
#[command(
    name = "mops",
    version,
    max_term_width = 100,
    after_help = "\
Start with:
  mops list                      list models, criteria, solvers, effects and studies
  mops run pid-design            run a shipped study; open results/pid-design/report.html
  mops new my-loop               write a commented study template
  mops describe settling-time    show the definition and the options of a kind

Exit status: 0 done; 1 done, but a constraint is violated; 2 error in the study, its data or the command line; 3 the run \
failed; 4 stopped by a signal, with the best point saved."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    globals: Globals,
}

/// Options of every command.
#[derive(Args)]
struct Globals {
    /// Folder that contains studies, one subfolder with study.toml each; adds to the folders in MOPS_STUDIES.
    #[arg(long = "studies", value_name = "DIR", global = true, help_heading = "Global options")]
    studies: Vec<PathBuf>,
    /// Let studies read data files in this folder and below. Without it a study reads its own folder and below, which
    /// makes it safe to open one from an untrusted source.
    #[arg(long = "allow-read", value_name = "DIR", global = true, help_heading = "Global options")]
    readable: Vec<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    /// Solve a study and write result.json, report.html, plots and evaluations.
    #[command(display_order = 0)]
    Run(run::Arguments),
    /// Select the point of a Pareto front for new demands, and write a study that starts there.
    Pick(pick::Arguments),
    /// Compare solvers on a study, over several seeds: successes, evaluations, time, profile.
    Bench(bench::Arguments),
    /// List the runs below a folder: study, date, worst scaled value, evaluations.
    History(history::Arguments),
    /// Compare runs side by side: tuners, criteria, differences in percent, and a page with their responses.
    Compare(compare::Arguments),
    /// Rewrite the report of a run from its stored evaluations, also of an unfinished run.
    Report(report::Arguments),
    /// Check a study and its data without running anything.
    Check(check::Arguments),
    /// List models, criteria, solvers, effects and shipped studies.
    List(list::Arguments),
    /// Describe a kind of model, criterion or solver, an effect, a study or a table of study files.
    Describe(describe::Arguments),
    /// Write a commented study template, or a copy of a shipped study.
    New(new::Arguments),
    /// Simulate a study once at given values: table of criteria, CSV files and plots.
    Simulate(simulate::Arguments),
    /// Linearise a model of a study: A, B, C, D, poles, zeros, transfer functions, plots, state feedback.
    Linearise(linearise::Arguments),
    /// Summarise a data file: columns, units, ranges, gaps, sample time, noise level.
    Data(data::Arguments),
    /// Print the JSON schema of study files, for completion in an editor, or of result.json.
    Schema(schema::Arguments),
    /// Print a completion script for a shell.
    Completions {
        /// Shell.
        shell: clap_complete::Shell,
    },
}

/// Package of the program that has no code of its own.
const PACKAGE: &str = "mops";

/// Parses the command line of a program and runs the command. A program of another package than `mops`, whatever its
/// name, has code of its own: its version names that of mops too, and its digest is part of the identity of runs.
pub fn main(mut catalogue: Catalogue, [package, name]: [&'static str; 2], version: &'static str) -> ExitCode {
    show_each_panic_once();
    let mut program = Arguments::command().name(name).version(version);
    let has_own_code = package != PACKAGE;
    if has_own_code {
        program = program.version(format!("{version} (mops {})", env!("CARGO_PKG_VERSION")).leak() as &str);
    }
    program = tasks::add_commands(program, &catalogue);
    let matches = program.clone().get_matches();
    let of_task = tasks::parsed(&catalogue, &matches);
    let Globals { studies, readable } = Globals::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let command = || match Arguments::from_arg_matches(&matches) {
        Ok(arguments) => arguments.command,
        Err(error) => error.exit(),
    };
    if has_own_code {
        catalogue.program = match study::digest_of_program() {
            Ok(digest) => Some(digest),
            Err(mistake) => return CommandError::from(mistake).report(),
        };
    }
    catalogue.readable.extend(readable);
    let of_environment = std::env::var_os("MOPS_STUDIES").unwrap_or_default();
    let folders = std::env::split_paths(&of_environment).filter(|path| !path.as_os_str().is_empty()).chain(studies);
    match study::with_folders(catalogue, &folders.collect::<Vec<_>>()) {
        Ok(catalogue) => match of_task {
            Some(command) => command.perform(&catalogue).unwrap_or_else(|error| error.report()),
            None => perform(&catalogue, command(), program),
        },
        Err(mistake) => CommandError::from(mistake).report(),
    }
}

fn perform(catalogue: &Catalogue, command: Command, mut program: clap::Command) -> ExitCode {
    let outcome = match command {
        Command::Run(arguments) => run::run(catalogue, &arguments),
        Command::Pick(arguments) => pick::pick(catalogue, &arguments),
        Command::Bench(arguments) => bench::bench(catalogue, &arguments),
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
        Command::Schema(arguments) => schema::schema(catalogue, &arguments),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            let name = program.get_name().to_owned();
            clap_complete::generate(shell, &mut program, name, &mut script);
            print(&String::from_utf8_lossy(&script)).map(|()| ExitCode::SUCCESS)
        }
    };
    outcome.unwrap_or_else(|error| error.report())
}
