//! `mops-bench diagnosis`: detection of missing effects, over simulated experiments or a folder of cases.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use mops::{Catalogue, Diagnostic, diagnosis::Settings, language::suggestion};
use mops_testbed::Setting;

use mops::terminal::{CommandError, Progress, print};

use super::files::write;
use super::{folder, tables};
use crate::diagnosis::{self, Comparisons, Kind, Plan, Tools, settings as by_name};

/// Options of `mops-bench diagnosis`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Number of cases with one missing effect, cycling through the effects, then through the sizes.
    #[arg(long, default_value_t = 200)]
    cases: usize,
    /// Number of cases with two missing effects.
    #[arg(long, default_value_t = 20)]
    two: usize,
    /// Number of cases without a missing effect.
    #[arg(long, default_value_t = 100)]
    none: usize,
    /// Number of cases with a missing effect that is not in the catalogue.
    #[arg(long, default_value_t = 20)]
    outside: usize,
    /// Kinds of cases with another noise and with a model error in the background, in place of the four above.
    ///
    /// A: nothing is missing, white noise. B: nothing is missing, a model error in the background: a random force, a
    /// drifting parameter or correlated noise of a sensor. C: one missing effect, white noise. D: one missing effect
    /// and a background of 5 to 20 % of its size. S: a background that is the same function of the state in all
    /// experiments. Records are for calibration, selection and validation.
    #[arg(long, value_delimiter = ',', value_name = "KINDS", ignore_case = true,
          conflicts_with_all = ["cases", "two", "none", "outside", "sizes", "folder"])]
    kinds: Vec<Letter>,
    /// Number of cases of each of these kinds.
    #[arg(long, default_value_t = 120, value_name = "NUMBER", requires = "kinds")]
    per_kind: usize,
    /// Give the records of selection the role of validation: ends of the calibration records are forecast.
    #[arg(long, requires = "kinds")]
    without_selection: bool,
    /// Plants, separated by commas [default: all; with `--kinds` driven-pendulum, two-masses and cascade].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    plants: Vec<String>,
    /// Effects, by their names in the test bed, separated by commas [default: all].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    effects: Vec<String>,
    /// Sizes of the effects: errors of the refitted nominal model, in units of the noise.
    #[arg(long, value_delimiter = ',', value_name = "NUMBERS", default_values_t = mops_testbed::SIZES)]
    sizes: Vec<f64>,
    /// Seed of the cases and of the diagnosis.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Run only the cases with these names, as listed in cases.csv of an earlier run with the same options.
    ///
    /// Their studies and data are also written to the folder. Use another folder than that of the earlier run, as its
    /// tables would be overwritten.
    #[arg(long, value_delimiter = ',', value_name = "NAMES", conflicts_with = "folder")]
    only: Vec<String>,
    /// Number of parallel cases, each on one thread [default: all cores].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder for a page and for tables of the cases and of the estimated effect parameters.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Compare the diagnosis with another tool.
    #[arg(long, value_name = "TOOL")]
    against: Option<Rival>,
    /// Number of additional diagnoses of each case, with shuffled catalogue and other seeds, to count equal findings.
    #[arg(long, value_name = "NUMBER", default_value_t = 0, conflicts_with = "folder")]
    orders: u64,
    /// Try only the missing effects, to measure the coverage of intervals without the search.
    #[arg(long = "told", conflicts_with = "folder")]
    known_effects: bool,
    /// Remove the missing effects, under all accepted names, from the catalogue, to count wrong claims.
    #[arg(long, conflicts_with_all = ["folder", "known_effects"])]
    without_truth: bool,
    /// Multiply settings of the diagnosis by a factor, separated by commas, to see what depends on them.
    #[arg(long, value_delimiter = ',', value_name = "NAME=FACTOR")]
    scale: Vec<String>,
    /// Diagnose the cases in a folder instead, each a folder with case.json and data files.
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Folder for the answers to these cases [default: answers].
    #[arg(long, value_name = "DIR", requires = "folder")]
    answers: Option<PathBuf>,
    /// Show no progress.
    #[arg(long)]
    quiet: bool,
}

/// Tool for comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rival {
    /// Refit of the model with each effect in turn; selection of the smallest BIC.
    BruteForce,
}

/// Kind of a case, by its letter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
enum Letter {
    #[value(name = "A")]
    A,
    #[value(name = "B")]
    B,
    #[value(name = "C")]
    C,
    #[value(name = "D")]
    D,
    #[value(name = "S")]
    S,
}

impl Letter {
    fn kind(self) -> Kind {
        Kind::Setting(match self {
            Self::A => Setting::Exact,
            Self::B => Setting::Background,
            Self::C => Setting::Effect,
            Self::D => Setting::EffectAndBackground,
            Self::S => Setting::RepeatingBackground,
        })
    }
}

pub(super) fn bench(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.map_or(cores, usize::from);
    let against = arguments.against.is_some();
    let settings = &arguments.scale.iter().try_fold(Settings::default(), scaled)?;
    if let Some(cases) = &arguments.folder {
        let progress = Progress::of_cases(!arguments.quiet);
        let tools = Tools { catalogue, watch: &progress, seed: arguments.seed, settings };
        let answers = arguments.answers.as_deref().unwrap_or(Path::new("answers"));
        let done = folder::answer(cases, answers, tools, jobs, against);
        progress.finish();
        return done;
    }
    let plan = plan(arguments)?;
    let named = plan.named();
    if let Some(unknown) = plan.only.iter().find(|name| !named.iter().any(|trial| trial.name == **name)) {
        let fact = format!("no case `{unknown}` with these options");
        return Err(Diagnostic::new(fact)
            .with_help("repeat the options of the run whose cases.csv lists the case")
            .into());
    }
    let progress = Progress::of_cases(!arguments.quiet);
    let tools = Tools { catalogue, watch: &progress, seed: arguments.seed, settings };
    let comparisons = Comparisons {
        brute_force: against,
        orders: arguments.orders,
        known_effects: arguments.known_effects,
        without_truth: arguments.without_truth,
    };
    let results = diagnosis::run(&plan, tools, jobs, comparisons);
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

/// Returns the settings of the diagnosis with another one multiplied by its factor.
fn scaled(settings: Settings, change: &String) -> Result<Settings, Diagnostic> {
    let parts = change.split_once('=').and_then(|(name, factor)| Some((name, factor.parse::<f64>().ok()?)));
    let Some((name, factor)) = parts.filter(|(_, factor)| factor.is_finite()) else {
        return Err(
            Diagnostic::new(format!("expected NAME=FACTOR, found `{change}`")).with_help("for example `fires=2`")
        );
    };
    by_name::scaled(&settings, name, factor).ok_or_else(|| {
        let names = by_name::names();
        Diagnostic::new(format!("the diagnosis has no setting `{name}`"))
            .with_help(suggestion(name, names.iter().map(String::as_str)))
    })
}

/// Returns the plan of the benchmark, with names checked.
fn plan(arguments: &Arguments) -> Result<Plan, Diagnostic> {
    let (plants, further) = if arguments.kinds.is_empty() {
        (mops_testbed::plants(), &[][..])
    } else {
        (mops_testbed::disturbed_plants(), mops_testbed::further_plants())
    };
    let names = |plants: &[&mops_testbed::Plant]| plants.iter().map(|plant| plant.name).collect::<Vec<&str>>();
    let all_effects: Vec<&str> = mops_testbed::effects().iter().map(|effect| effect.name).collect();
    let counts = if arguments.kinds.is_empty() {
        vec![
            (Kind::One, arguments.cases),
            (Kind::Two, arguments.two),
            (Kind::Nothing, arguments.none),
            (Kind::Outside, arguments.outside),
        ]
    } else {
        let mut kinds = arguments.kinds.clone();
        kinds.sort();
        kinds.dedup();
        kinds.into_iter().map(|letter| (letter.kind(), arguments.per_kind)).collect()
    };
    if let Some(size) = arguments.sizes.iter().find(|&&size| !(size > 1.0 && size.is_finite())) {
        let fact = format!("expected sizes above 1 (errors of the nominal model, in units of the noise), found {size}");
        return Err(Diagnostic::new(fact).with_help("for example `--sizes 20,5,2,1.3`"));
    }
    Ok(Plan {
        plants: chosen(&arguments.plants, (&names(plants), &names(further)), "plant")?,
        effects: chosen(&arguments.effects, (&all_effects, &[]), "effect")?,
        sizes: arguments.sizes.clone(),
        counts,
        without_selection: arguments.without_selection,
        seed: arguments.seed,
        only: arguments.only.clone(),
    })
}

/// Returns the requested names without duplicates; all but the further names if none are requested.
fn chosen(asked: &[String], (all, further): (&[&str], &[&str]), what: &str) -> Result<Vec<String>, Diagnostic> {
    let known = || all.iter().chain(further).copied();
    if let Some(unknown) = asked.iter().find(|name| known().all(|known| known != name.as_str())) {
        let fact = format!("the test bed has no {what} `{unknown}`");
        return Err(Diagnostic::new(fact).with_help(suggestion(unknown, known())));
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
