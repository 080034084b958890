//! Commands of tasks: each runs a study with another task than its own.

use std::process::ExitCode;

use clap::{ArgAction, ArgMatches, Args, Command, FromArgMatches};
use mops_core::Catalogue;
use mops_tasks::{TaskCommand, room};

use super::run::{CommonOptions, Search, SolverOptions, execute};
use crate::terminal::CommandError;

/// Parsed command of a task.
pub(super) struct OfTask {
    common: CommonOptions,
    solver: Option<SolverOptions>,
    /// Settings that the command makes in the study.
    settings: Vec<String>,
}

/// Returns the commands of the tasks, each with the word of its task.
fn commands(catalogue: &Catalogue) -> impl Iterator<Item = (&'static str, TaskCommand)> {
    catalogue.tasks.iter().filter_map(|kind| Some((kind.name, room(kind).command()?)))
}

/// Adds the commands of the tasks to a program, after its first command.
pub(super) fn add_commands(program: Command, catalogue: &Catalogue) -> Command {
    let count = commands(catalogue).count();
    let mut places = (0..1).chain(count + 1..);
    let mut program = program.mut_subcommands(|command| command.display_order(places.next().unwrap_or(usize::MAX)));
    for (i, (_, command)) in commands(catalogue).enumerate() {
        let mut added = CommonOptions::augment_args(Command::new(command.name));
        if command.has_solver {
            added = SolverOptions::augment_args(added);
        }
        // Not what the groups of options are about.
        added = added.about(command.about).long_about(command.about).display_order(i + 1);
        if !command.after_help.is_empty() {
            added = added.after_help(command.after_help);
        }
        for option in command.options {
            let arg = clap::Arg::new(option.name).long(option.name).help(option.about);
            added = added.arg(match option.value {
                Some(value) => arg.value_name(value),
                None => arg.action(ArgAction::SetTrue),
            });
        }
        program = program.subcommand(added);
    }
    program
}

/// Returns the command of a task that was given, if it is one.
pub(super) fn parsed(catalogue: &Catalogue, matches: &ArgMatches) -> Option<OfTask> {
    let (name, matches) = matches.subcommand()?;
    let (word, command) = commands(catalogue).find(|(_, command)| command.name == name)?;
    let mut settings = vec![format!("study.task=\"{word}\"")];
    for option in command.options {
        match option.value {
            Some(_) => {
                let value = matches.get_one::<String>(option.name);
                settings.extend(value.map(|value| format!("{}={value}", option.key)));
            }
            None => settings.extend(matches.get_flag(option.name).then(|| format!("{}=true", option.key))),
        }
    }
    let exit = |error: clap::Error| -> CommonOptions { error.exit() };
    let common = CommonOptions::from_arg_matches(matches).unwrap_or_else(exit);
    let solver = command.has_solver.then(|| match SolverOptions::from_arg_matches(matches) {
        Ok(solver) => solver,
        Err(error) => error.exit(),
    });
    Some(OfTask { common, solver, settings })
}

impl OfTask {
    /// Performs the task.
    pub(super) fn perform(&self, catalogue: &Catalogue) -> Result<ExitCode, CommandError> {
        let search = Search { settings: &self.settings, solver_options: self.solver.as_ref() };
        execute(catalogue, &self.common, &search)
    }
}
