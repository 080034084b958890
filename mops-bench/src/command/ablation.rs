//! `mops-bench ablation`: the diagnosis with one setting after the other halved and doubled.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use mops::{
    Diagnostic,
    terminal::{CommandError, Progress, print, table},
};

use super::files::write;
use crate::diagnosis::settings;
use crate::parallel::each;

/// Factors that a setting is multiplied by.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Kinds of cases: nothing missing, a background, an effect, both.
const KINDS: &str = "A,B,C,D";

/// Arguments of `mops-bench ablation`.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Settings, separated by commas [default: all].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    settings: Vec<String>,
    /// Number of cases of each of the kinds A to D.
    #[arg(long, default_value_t = 14, value_name = "NUMBER")]
    per_kind: usize,
    /// Longest time of a case with the settings as they are, in seconds; longer ones are left out.
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    longest: f64,
    /// Seed of the cases.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of parallel benchmarks, each on one thread [default: all cores].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Folder for the table.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Answer to a case, as far as it is compared.
#[derive(Clone, PartialEq)]
struct Answer {
    verdict: String,
    named: String,
    at: String,
    claimed: String,
    /// True if class and place, or that nothing is missing, are right.
    is_right: bool,
    /// True if something is claimed that is not missing.
    is_wrong_claim: bool,
    simulations: f64,
    seconds: f64,
}

type Answers = BTreeMap<String, Answer>;

/// Runs the command.
pub(super) fn ablation(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let names: Vec<String> = if arguments.settings.is_empty() { settings::names() } else { arguments.settings.clone() };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.map_or(cores, usize::from);
    let base = answers(arguments, None, &[], jobs)?;
    let cases: Vec<String> =
        base.iter().filter(|(_, answer)| answer.seconds <= arguments.longest).map(|(name, _)| name.clone()).collect();
    let base: Answers = base.into_iter().filter(|(name, _)| cases.contains(name)).collect();
    let changes: Vec<String> = names.iter().flat_map(|name| FACTORS.map(|factor| format!("{name}={factor}"))).collect();
    let progress = Progress::of_cases(true);
    let compared =
        each(&changes, jobs, &progress, |change| Some((change.clone(), answers(arguments, Some(change), &cases, 1))));
    progress.finish();
    let mut lines: Vec<(usize, Vec<String>)> = vec![(usize::MAX, line("as they are", &base, &base))];
    for (change, answers) in compared {
        let answers = answers?;
        lines.push((changed(&answers, &base), line(&change, &answers, &base)));
    }
    lines.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    let header = ["settings", "answers changed", "right", "wrong claims", "simulations"];
    let text = table(&header, &[1, 2, 3, 4], lines.into_iter().map(|(_, line)| line).collect());
    write(&arguments.out, "ablation.txt", &text)?;
    print(&format!("{} cases\n\n{text}", cases.len())).map(|()| ExitCode::SUCCESS)
}

/// Returns the number of cases with another answer.
fn changed(answers: &Answers, base: &Answers) -> usize {
    let same =
        |a: &Answer, b: &Answer| (&a.verdict, &a.named, &a.at, &a.claimed) == (&b.verdict, &b.named, &b.at, &b.claimed);
    base.iter().filter(|(name, before)| answers.get(*name).is_none_or(|after| !same(after, before))).count()
}

fn line(name: &str, answers: &Answers, base: &Answers) -> Vec<String> {
    let count = |is: fn(&Answer) -> bool| answers.values().filter(|answer| is(answer)).count();
    let simulations = |of: &Answers| of.values().map(|answer| answer.simulations).sum::<f64>();
    vec![
        name.to_owned(),
        changed(answers, base).to_string(),
        count(|answer| answer.is_right).to_string(),
        count(|answer| answer.is_wrong_claim).to_string(),
        format!("{:.2}", simulations(answers) / simulations(base)),
    ]
}

/// Returns the answers of a diagnosis benchmark in a process of its own, with another setting.
fn answers(arguments: &Arguments, change: Option<&str>, only: &[String], jobs: usize) -> Result<Answers, Diagnostic> {
    let folder = arguments.out.join(change.unwrap_or("as-they-are").replace('=', "-"));
    let cannot_run = |error: std::io::Error| Diagnostic::new(format!("cannot run the benchmark: {error}"));
    let program = std::env::current_exe().map_err(cannot_run)?;
    let mut command = Command::new(program);
    command.args(["diagnosis", "--quiet", "--kinds", KINDS]).arg("--out").arg(&folder);
    command.args(["--per-kind", &arguments.per_kind.to_string(), "--seed", &arguments.seed.to_string()]);
    command.args(["--jobs", &jobs.to_string()]);
    if let Some(change) = change {
        command.args(["--scale", change]);
    }
    if !only.is_empty() {
        command.args(["--only", &only.join(",")]);
    }
    let output = command.stdout(Stdio::null()).output().map_err(cannot_run)?;
    if !output.status.success() {
        return Err(Diagnostic::new(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
    }
    read(&folder.join("cases.csv"))
}

/// Reads answers from the table of a benchmark.
fn read(path: &Path) -> Result<Answers, Diagnostic> {
    let failed = |error: csv::Error| Diagnostic::new(format!("cannot read {}: {error}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    let mut answers = Answers::new();
    for record in reader.records() {
        let record = record.map_err(failed)?;
        let cell = |name: &str| {
            let position = header.iter().position(|h| h == name).expect("the table has this column");
            record.get(position).unwrap_or_default().to_owned()
        };
        let number = |name: &str| cell(name).parse().unwrap_or(f64::NAN);
        let right = cell("class and place right");
        let is_claimed: Vec<bool> = cell("claimed").split('+').map(|claimed| claimed == "true").collect();
        let claims = cell("verdict") == "effect";
        let wrong = right.split('+').zip(&is_claimed).any(|(right, claimed)| *claimed && right != "true");
        let is_missing = !cell("effects").is_empty();
        answers.insert(
            cell("case"),
            Answer {
                verdict: cell("verdict"),
                named: cell("named"),
                at: cell("named at"),
                claimed: cell("claimed"),
                is_right: if is_missing { right.starts_with("true") } else { !claims },
                is_wrong_claim: claims && wrong,
                simulations: number("simulations"),
                seconds: number("seconds"),
            },
        );
    }
    Ok(answers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_read_from_the_table_and_changes_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cases.csv");
        let header = "case,effects,verdict,named,named at,claimed,class and place right,simulations,seconds\n";
        let rows = "a,,unexplained,,,,,10,1\nb,lag,effect,lag+pulse,input:u+joint:q,true+true,true+false,30,2.5\n";
        std::fs::write(&path, format!("{header}{rows}")).unwrap();
        let base = read(&path).unwrap();
        assert!(base["a"].is_right && !base["a"].is_wrong_claim && base["b"].is_right && base["b"].is_wrong_claim);
        let mut other = base.clone();
        other.get_mut("a").unwrap().verdict = "none".to_owned();
        other.get_mut("b").unwrap().simulations = 70.0;
        assert_eq!(line("fires=2", &other, &base), ["fires=2", "1", "2", "1", "2.00"]);
    }
}
