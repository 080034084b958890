//! `mops-bench SUITE`: solvers on problems with known solutions.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};
use mops::{Catalogue, Diagnostic, core::catalogue::SolverChoice, language::suggestion};
use mops_problems::{Answer, Slope};

use mops::terminal::{CommandError, Progress, number, print, table};

use super::files::write;
use crate::solvers::figures::{self, Figure};
use crate::solvers::{self, Plan, Results, Row, Score, Suite, data_profile, published, spreads, suites};

/// Options of the benchmark of a suite.
#[derive(Args)]
pub(super) struct Arguments {
    /// Solver to measure; several are separated by commas or given one by one.
    #[arg(long = "solver", value_name = "SOLVER", default_value = "auto", value_delimiter = ',')]
    solvers: Vec<String>,
    /// Provide exact gradients instead of finite differences.
    #[arg(long)]
    gradients: bool,
    /// Number of runs of each problem, with seeds 1, 2, ...
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Budget of a run, as a multiple of n + 1 evaluations for n variables [default: usual budget of the suite].
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    budget: Option<u32>,
    /// Relative noise added to all values; results are judged without it.
    #[arg(long, default_value_t = 0.0, value_name = "NUMBER")]
    noise: f64,
    /// Problems, separated by commas [default: all].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    problems: Vec<String>,
    /// Number of problems solved in parallel [default: all cores]; 1 gives the most accurate times.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder for results.json and a page with profiles.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Compare with the results.json of an earlier benchmark.
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// Add the figures of each solver to a CSV file, or replace those of the same suite, solver, gradients and noise.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// List the problems with known solutions and sources, without running them.
    #[arg(long)]
    list: bool,
    /// Show no progress.
    #[arg(long)]
    quiet: bool,
}

/// Selected suite; each suite is a command.
pub(super) struct Chosen {
    suite: Suite,
    arguments: Arguments,
}

impl Subcommand for Chosen {
    fn augment_subcommands(command: Command) -> Command {
        let one = |suite: &Suite| Arguments::augment_args(Command::new(suite.name)).about(suite.about);
        command.subcommands(suites().iter().map(one))
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        suites().iter().any(|suite| suite.name == name)
    }
}

impl FromArgMatches for Chosen {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, rest) = matches.subcommand().ok_or_else(missing)?;
        let suite = suites().into_iter().find(|suite| suite.name == name).ok_or_else(missing)?;
        Ok(Self { suite, arguments: Arguments::from_arg_matches(rest)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

pub(super) fn bench(catalogue: &Catalogue, chosen: &Chosen) -> Result<ExitCode, CommandError> {
    let Chosen { suite, arguments } = chosen;
    if arguments.list {
        let rows = suite
            .subjects()
            .into_iter()
            .map(|subject| vec![subject.name().to_owned(), solution(&subject), subject.source().to_owned()]);
        let of_suite = mops_problems::suites().into_iter().find(|known| known.name == suite.name);
        let of_suite = of_suite.map_or_else(String::new, |known| format!("\nSource of the suite: {}\n", known.source));
        print(&(table(&["problem", "known solution", "source"], &[], rows.collect()) + &of_suite))?;
        return Ok(ExitCode::SUCCESS);
    }
    let before = arguments.against.as_deref().map(|path| read(path, suite)).transpose()?;
    let known = arguments.csv.as_deref().map(known_figures).transpose()?;
    check_options(suite, arguments)?;
    let plan = Plan {
        suite: *suite,
        solvers: arguments.solvers.iter().map(|name| solver(catalogue, name.trim())).collect::<Result<_, _>>()?,
        slope: if arguments.gradients { Slope::Exact } else { Slope::Differences },
        seeds: arguments.seeds,
        budget: arguments.budget.map(|budget| usize::try_from(budget).unwrap_or(usize::MAX)),
        noise: arguments.noise,
        only: problems(suite, &arguments.problems)?,
    };
    if let Some(idle) = plan.idle(catalogue) {
        let help = format!("`mops describe {}` lists the problems that it accepts", idle.kind);
        return Err(Diagnostic::new(format!("`{}` accepts none of these problems", idle.kind)).with_help(help).into());
    }
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder).map_err(CommandError::cannot_write(folder))?;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let progress = Progress::of_cases(!arguments.quiet);
    let results = solvers::run(catalogue, &plan, arguments.jobs.map_or(cores, usize::from), &progress);
    progress.finish();
    let text = text(&results, before.as_ref());
    print(&text)?;
    if let (Some(path), Some(known)) = (&arguments.csv, known) {
        let gradients =
            if suite.subjects().iter().any(solvers::Subject::is_study) { "own" } else { results.slopes.as_str() };
        let new = figures::figures(&results, gradients, &figures::today());
        let all = figures::updated(known, new);
        std::fs::write(path, figures::write(&all)).map_err(CommandError::cannot_write(path))?;
    }
    if let Some(folder) = &arguments.out {
        let json = serde_json::to_string_pretty(&results).expect("numbers and names can be written");
        write(folder, "results.json", &(json + "\n"))?;
        let mut all = vec![(String::new(), &results)];
        all.extend(before.as_ref().map(|before| ("before".to_owned(), before)));
        write(folder, "index.html", &solvers::page(&text, &all))?;
    }
    Ok(progress.status())
}

/// Formats the known solution of a problem: minima, with the tuners at the optimum of a study, or the hypervolume of a
/// front.
fn solution(subject: &solvers::Subject) -> String {
    let list = |values: &[f64]| values.iter().copied().map(number).collect::<Vec<_>>().join(", ");
    match subject.answer() {
        Answer::Unknown => String::new(),
        Answer::Front { hypervolume, .. } => format!("hypervolume {}", number(hypervolume)),
        Answer::Minima(minima) => match subject.tuners() {
            [] => list(&minima),
            tuners => format!("{} at {}", list(&minima), list(tuners)),
        },
    }
}

/// Reads a CSV file of figures; one that does not exist has none.
fn known_figures(path: &Path) -> Result<Vec<Figure>, Diagnostic> {
    match std::fs::read_to_string(path) {
        Ok(text) => figures::read(&text).map_err(|error| Diagnostic::new(format!("{}: {error}", path.display()))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(Diagnostic::new(format!("{} cannot be read: {error}", path.display()))),
    }
}

/// Prints the Markdown table of a CSV file of figures.
pub(super) fn markdown(path: &Path) -> Result<ExitCode, CommandError> {
    if !path.exists() {
        return Err(Diagnostic::new(format!("there is no file {}", path.display()))
            .with_help("`mops-bench SUITE --csv FILE` writes one")
            .into());
    }
    print(&figures::markdown(&known_figures(path)?))?;
    Ok(ExitCode::SUCCESS)
}

fn solver(catalogue: &Catalogue, name: &str) -> Result<SolverChoice, Diagnostic> {
    let kind = catalogue.solvers.iter().find(|kind| kind.name == name);
    let unknown = || {
        let help = suggestion(name, catalogue.solvers.iter().map(|kind| kind.name));
        Diagnostic::new(format!("there is no solver `{name}`")).with_help(help)
    };
    Ok(kind.ok_or_else(unknown)?.default_choice())
}

fn problems(suite: &Suite, asked: &[String]) -> Result<Vec<String>, Diagnostic> {
    let all: Vec<String> = suite.subjects().iter().map(|subject| subject.name().to_owned()).collect();
    let asked: Vec<String> = asked.iter().map(|name| name.trim().to_owned()).collect();
    match asked.iter().find(|name| !all.contains(name)) {
        None => Ok(asked),
        Some(unknown) => {
            let help = suggestion(unknown, all.iter().map(String::as_str));
            Err(Diagnostic::new(format!("`{}` has no problem `{unknown}`", suite.name)).with_help(help))
        }
    }
}

/// Checks that the suite supports the options: studies have fixed gradients and noise, and fronts are not measured
/// under noise.
fn check_options(suite: &Suite, arguments: &Arguments) -> Result<(), Diagnostic> {
    let is_noisy = arguments.noise != 0.0;
    let subjects = suite.subjects();
    let wrong = if is_noisy && !(arguments.noise > 0.0 && arguments.noise < 1.0) {
        Diagnostic::new(format!("expected a relative noise between 0 and 1, found {}", arguments.noise))
    } else if subjects.iter().any(solvers::Subject::is_study) && (arguments.gradients || is_noisy) {
        Diagnostic::new(format!("`{}` has studies, which define gradients and noise themselves", suite.name))
            .with_help("remove `--gradients` and `--noise`")
    } else if is_noisy && subjects.iter().any(solvers::Subject::has_front) {
        Diagnostic::new(format!("`{}` has Pareto fronts, which are not measured under noise", suite.name))
            .with_help("remove `--noise`")
    } else {
        return Ok(());
    };
    Err(wrong)
}

fn read(path: &Path, suite: &Suite) -> Result<Results, Diagnostic> {
    let mistake = |why: String| Diagnostic::new(format!("{}: {why}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| mistake(error.to_string()))?;
    let unread = |error: serde_json::Error| mistake(format!("not the results of a solver benchmark: {error}"));
    let results: Results = serde_json::from_str(&text).map_err(unread)?;
    if results.suite != suite.name {
        return Err(mistake(format!("expected results of `{}`, found results of `{}`", suite.name, results.suite)));
    }
    Ok(results)
}

fn text(results: &Results, before: Option<&Results>) -> String {
    let has_fronts = results.rows.iter().any(|row| row.front.is_some());
    let mut text = if has_fronts { fronts(results, before) } else { minima(results, before) };
    for (results, which) in [(Some(results), "These"), (before, "The earlier")] {
        if results.is_some_and(|results| results.interrupted) {
            text.push_str(&format!("{which} results are incomplete: the benchmark was interrupted.\n"));
        }
    }
    text
}

/// Formats the reached objectives with the known minima, and a summary of each solver.
fn minima(results: &Results, before: Option<&Results>) -> String {
    let seeds = results.rows.iter().any(|row| row.seed > 1);
    let mut header = vec!["problem", "solver", "n", "m", "f*", "reached", "violation", "to 1e-3", "to solved"];
    header.extend(["all", "ms", "solved"]);
    let earlier = before.map(|before| match before.solvers()[..] {
        [only] => format!("before, {only}"),
        _ => "before".to_owned(),
    });
    header.extend(earlier.as_deref());
    let rows = results.rows.iter().map(|row| cells(row, seeds, before)).collect();
    let mut text = table(&header, &[2, 3, 4, 5, 6, 7, 8, 9, 10, 12], rows);
    let fine = results.accuracy;
    let suite = suites().into_iter().find(|suite| suite.name == results.suite);
    let is_relative = suite.is_some_and(|suite| suite.relative);
    let reached = if is_relative {
        format!(
            "a feasible point has all but 1e-3, and {fine:e}, of the reduction from the start to f*, the least value of all \
             solvers"
        )
    } else {
        format!(
            "a point with violation at most 1e-6 (which may be below f*) is at most 1e-3, and {fine:e} or the tolerance of the \
             problem's source, above f*, relative to max(1, |f*|)"
        )
    };
    let slopes = |results: &Results| match results.slopes.as_str() {
        "exact" => "exact gradients (dual numbers), not counted as evaluations",
        _ => "gradients by finite differences",
    };
    let noise = if results.noise > 0.0 {
        format!("; relative noise of {} on all values, judged without noise", results.noise)
    } else {
        String::new()
    };
    let has_studies = suite.is_some_and(|suite| suite.subjects().iter().any(solvers::Subject::is_study));
    let gradients = if has_studies { "gradients as in the studies" } else { slopes(results) };
    text.push_str(&format!("\nTo 1e-3, to solved: evaluations until {reached}; {gradients}{noise}.\n"));
    if let Some(before) = before.filter(|before| before.slopes != results.slopes || before.noise != results.noise) {
        text.push_str(&format!("Before: {}, relative noise of {}.\n", slopes(before), before.noise));
    }
    for (name, results) in [(Some(results), ""), (before, "before: ")].into_iter().filter_map(|(r, n)| Some((n, r?))) {
        for solver in results.solvers() {
            text.push_str(&summary(name, results, solver));
        }
        if is_relative {
            text.push_str(&shares(name, results));
        }
    }
    text
}

/// Formats the shares of problems solved within 10, 30 and 100 simplex gradients.
fn shares(name: &str, results: &Results) -> String {
    let mut text = String::new();
    for solver in results.solvers() {
        let of = |count: fn(&Row) -> Option<usize>| {
            let profile = data_profile(&Score::of(results, solver, count));
            let within =
                |gradients: f64| profile.iter().rfind(|(x, _)| *x <= gradients).map_or(0.0, |(_, share)| *share);
            [10.0, 30.0, 100.0].map(|gradients| format!("{:.2}", within(gradients))).join(" / ")
        };
        text.push_str(&format!(
            "{name}{solver}: share solved within 10 / 30 / 100 simplex gradients: {} to 1e-3, {} to {:e} of the best \
             reduction\n",
            of(|row| row.to_rough),
            of(|row| row.to_fine),
            results.accuracy
        ));
    }
    text
}

/// Formats the results for Pareto fronts, one line for every problem, over all seeds.
fn fronts(results: &Results, before: Option<&Results>) -> String {
    let mut header = vec!["problem", "solver", "seeds", "evaluations", "volume", "sd", "of front", "all points"];
    header.extend(["distance", "sd", "pymoo volume", "distance"]);
    header.extend(before.map(|_| "before"));
    let earlier = before.map(spreads).unwrap_or_default();
    let row = |spread: solvers::Spread| {
        let (volume, distance) = published(&spread.problem).unzip();
        let figure = |value: Option<f64>, digits: usize| match value.filter(|value| value.is_finite()) {
            Some(value) => format!("{value:.digits$}"),
            None => "-".to_owned(),
        };
        let published = [figure(volume, 5), figure(distance.flatten(), 4)];
        let mut cells = vec![
            spread.problem.clone(),
            spread.solver.clone(),
            spread.seeds.to_string(),
            spread.evaluations.to_string(),
            format!("{:.5}", spread.hypervolume[0]),
            format!("{:.5}", spread.hypervolume[1]),
            format!("{:.5}", spread.known),
            format!("{:.5}", spread.archive),
            figure(Some(spread.distance[0]), 5),
            figure(Some(spread.distance[1]), 5),
        ];
        cells.extend(published);
        let same = earlier.iter().find(|e| e.problem == spread.problem && e.solver == spread.solver);
        cells.extend(before.map(|_| same.map_or(String::new(), |e| format!("{:.5}", e.hypervolume[0]))));
        cells
    };
    let mut text =
        table(&header, &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], spreads(results).into_iter().map(row).collect());
    text.push_str(
        "\nVolume, distance: hypervolume and inverted generational distance of the last generation, mean and standard \
         deviation (sd) over seeds; all points: hypervolume of all evaluated points. pymoo: NSGA-II with 100 members and 250 \
         generations; for three objectives NSGA-III with 92 members (DTLZ1: 400 generations).\n",
    );
    for solver in results.solvers() {
        text.push_str(&summary("", results, solver));
    }
    text
}

fn cells(row: &Row, seeds: bool, before: Option<&Results>) -> Vec<String> {
    let count = |count: Option<usize>| count.map_or("-".to_owned(), |count| count.to_string());
    let name = if seeds { format!("{} ({})", row.problem, row.seed) } else { row.problem.clone() };
    let mut cells = vec![
        name,
        row.solver.clone(),
        row.variables.to_string(),
        row.rows.to_string(),
        row.known.map_or("-".to_owned(), number),
        number(row.reached),
        if row.violation > 0.0 { format!("{:.1e}", row.violation) } else { "0".to_owned() },
        count(row.to_rough),
        count(row.to_fine),
        row.evaluations.to_string(),
        format!("{:.2}", 1e3 * row.seconds),
        match (row.known, row.solved) {
            (None, _) => "-",
            (_, true) => "yes",
            (_, false) => "no",
        }
        .to_owned(),
    ];
    cells.extend(before.map(|before| before.same(row).map_or_else(String::new, |old| count(old.to_fine))));
    cells
}

#[allow(clippy::cast_precision_loss)]
fn summary(name: &str, results: &Results, solver: &str) -> String {
    let of = results.summary(solver);
    let count = |count: Option<f64>| count.map_or("-".to_owned(), number);
    let claims = if of.false_claims > 0 {
        format!(", {} converged to a point that violates a constraint", of.false_claims)
    } else {
        String::new()
    };
    if of.judged == 0 {
        return format!(
            "{name}{}: {} runs, not judged (no single known minimum); {:.2} s, solver overhead {:.0} ns per \
             evaluation{claims}\n",
            of.solver, of.runs, of.seconds, of.nanoseconds
        );
    }
    format!(
        "{name}{}: {} of {} solved ({:.1} %), median evaluations of successful runs {} to 1e-3 and {} to solved; {:.2} s \
         in total, solver overhead {:.0} ns per evaluation{claims}\n",
        of.solver,
        of.solved,
        of.judged,
        100.0 * of.solved as f64 / of.judged as f64,
        count(of.median_rough),
        count(of.median_fine),
        of.seconds,
        of.nanoseconds,
    )
}
