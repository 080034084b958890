//! `mops-bench diagnosis`: detection of missing effects, over simulated experiments or a folder of cases.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use mops::core::suggestion;
use mops::{Catalogue, Diagnostic};

use mops::terminal::{CommandError, Progress, print};

use super::{folder, tables, write};
use crate::diagnosis::{self, Beside, Kind, Plan, Tools};

/// Options of `mops-bench diagnosis`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Cases that lack one effect: effects take turns, then sizes.
    #[arg(long, default_value_t = 200)]
    cases: usize,
    /// Cases that lack two effects.
    #[arg(long, default_value_t = 20)]
    two: usize,
    /// Cases that lack nothing.
    #[arg(long, default_value_t = 100)]
    none: usize,
    /// Cases that lack what no catalogue has.
    #[arg(long, default_value_t = 20)]
    outside: usize,
    /// Plants, separated by commas; all where absent.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    plants: Vec<String>,
    /// Effects, as the test bed calls them, separated by commas; all where absent.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    effects: Vec<String>,
    /// Errors of the refitted base model, in units of the noise.
    #[arg(long, value_delimiter = ',', value_name = "NUMBERS", default_values_t = mops_testbed::SIZES)]
    sizes: Vec<f64>,
    /// Seed of the cases, and of the diagnosis.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only the cases of these names, as `cases.csv` of an earlier run with the same options spells them; their studies and
    /// data go to the folder too. Choose another folder than that of the earlier run, whose tables would be lost.
    #[arg(long, value_delimiter = ',', value_name = "NAMES", conflicts_with = "folder")]
    only: Vec<String>,
    /// Number of cases that run at once, each on one thread; all cores where absent.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder for a page and tables of all cases and of the strengths found.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Put another tool beside the diagnosis.
    #[arg(long, value_name = "TOOL")]
    against: Option<Rival>,
    /// Diagnose every case so many times more, with other orders of the catalogue and other seeds, and count what agrees.
    #[arg(long, value_name = "NUMBER", default_value_t = 0, conflicts_with = "folder")]
    orders: u64,
    /// Try no more effects than are missing: what the intervals are worth, without the search.
    #[arg(long, conflicts_with = "folder")]
    told: bool,
    /// Diagnose the cases of a folder instead: a folder each, with case.json and data.
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Where the answers to these go; `answers` where absent.
    #[arg(long, value_name = "DIR", requires = "folder")]
    answers: Option<PathBuf>,
    /// Show no progress.
    #[arg(long)]
    quiet: bool,
}

/// Another tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rival {
    /// The model refitted with every effect in turn, and the least BIC believed.
    BruteForce,
}

pub(super) fn bench(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.map_or(cores, usize::from);
    let against = arguments.against.is_some();
    if let Some(cases) = &arguments.folder {
        let progress = Progress::of_cases(!arguments.quiet);
        let tools = Tools { catalogue, watch: &progress, seed: arguments.seed };
        let answers = arguments.answers.as_deref().unwrap_or(Path::new("answers"));
        let done = folder::answer(cases, answers, tools, jobs, against);
        progress.finish();
        return done;
    }
    let plan = plan(arguments)?;
    let named = plan.named();
    if let Some(unknown) = plan.only.iter().find(|name| !named.iter().any(|trial| trial.name == **name)) {
        let fact = format!("these options make no case `{unknown}`");
        return Err(Diagnostic::new(fact)
            .with_help("repeat the options of the run that has it in its cases.csv")
            .into());
    }
    let progress = Progress::of_cases(!arguments.quiet);
    let tools = Tools { catalogue, watch: &progress, seed: arguments.seed };
    let beside = Beside { brute_force: against, orders: arguments.orders, told: arguments.told };
    let results = diagnosis::run(&plan, tools, jobs, beside);
    progress.finish();
    let text = tables::all(&results);
    print(&text)?;
    if let Some(folder) = &arguments.out {
        write(folder, "cases.csv", &diagnosis::csv(&results.rows))?;
        write(folder, "strengths.csv", &diagnosis::strengths(&results.rows))?;
        if against {
            write(folder, "brute-force.csv", &diagnosis::csv(&results.brute))?;
        }
        for trial in named {
            let folder = folder.join(&trial.name);
            write(&folder, "study.toml", &trial.study)?;
            trial.files.iter().try_for_each(|(name, content)| write(&folder, name, content))?;
        }
        write(folder, "index.html", &diagnosis::page(&text, &tables::stated(&results.rows)))?;
    }
    Ok(progress.status())
}

/// What is asked for, names checked.
fn plan(arguments: &Arguments) -> Result<Plan, Diagnostic> {
    let all_plants: Vec<&str> = mops_testbed::plants().iter().map(|plant| plant.name).collect();
    let all_effects: Vec<&str> = mops_testbed::effects().iter().map(|effect| effect.name).collect();
    let counts = [
        (Kind::One, arguments.cases),
        (Kind::Two, arguments.two),
        (Kind::Nothing, arguments.none),
        (Kind::Outside, arguments.outside),
    ];
    if let Some(size) = arguments.sizes.iter().find(|&&size| !(size > 1.0 && size.is_finite())) {
        let fact = format!("a base model that lacks something has an error above 1, not {size}");
        return Err(Diagnostic::new(fact).with_help("`--sizes 20,5,2,1.3`"));
    }
    Ok(Plan {
        plants: chosen(&arguments.plants, &all_plants, "plant")?,
        effects: chosen(&arguments.effects, &all_effects, "effect")?,
        sizes: arguments.sizes.clone(),
        counts,
        seed: arguments.seed,
        only: arguments.only.clone(),
    })
}

/// The names asked for; all where none are.
fn chosen(asked: &[String], all: &[&str], what: &str) -> Result<Vec<String>, Diagnostic> {
    if let Some(unknown) = asked.iter().find(|name| !all.contains(&name.as_str())) {
        let fact = format!("the test bed has no {what} `{unknown}`");
        return Err(Diagnostic::new(fact).with_help(suggestion(unknown, all.iter().copied())));
    }
    let mut names: Vec<String> =
        if asked.is_empty() { all.iter().map(|&n| n.to_owned()).collect() } else { asked.to_vec() };
    let mut seen = Vec::new();
    names.retain(|name| {
        !seen.contains(name) && {
            seen.push(name.clone());
            true
        }
    });
    Ok(names)
}
