//! The answers to a folder of cases, and what of them is printed.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;

use mops::Diagnostic;

use mops::terminal::{CommandError, number, print, table};

use crate::diagnosis::{Answer, Cases, Reply, Tools, spelt};

/// Diagnoses every case of a folder, writes the answers, and prints a line for each.
pub(super) fn answer(
    cases: &Path,
    answers: &Path,
    tools: Tools<'_>,
    jobs: usize,
    against: bool,
) -> Result<ExitCode, CommandError> {
    let cases = Cases::find(cases).map_err(Diagnostic::new)?;
    std::fs::create_dir_all(answers).map_err(CommandError::cannot_write(answers))?;
    let refused = Mutex::new(None);
    let replies = cases.run(tools, jobs, against, |reply| {
        if let Err(trouble) = leave(answers, reply) {
            refused.lock().expect("no thread breaks while it holds it").get_or_insert(trouble);
        }
    });
    if let Some(trouble) = refused.into_inner().expect("all threads have ended") {
        return Err(trouble);
    }
    print(&text(&replies))?;
    print(&format!("\nanswers, predictions and studies are in {}\n", answers.display()))?;
    let failed = replies.iter().any(|reply| reply.said.is_err());
    Ok(if failed { ExitCode::from(3) } else { ExitCode::SUCCESS })
}

/// Writes what there is of a case.
fn leave(answers: &Path, reply: &Reply) -> Result<(), CommandError> {
    let write = |name: String, content: &str| {
        let path = answers.join(name);
        std::fs::write(&path, content).map_err(CommandError::cannot_write(&path))
    };
    let name = &reply.name;
    if !reply.study.is_empty() {
        write(format!("{name}.toml"), &reply.study)?;
    }
    let Ok(said) = &reply.said else { return Ok(()) };
    write(format!("{name}.json"), &said.json)?;
    said.predictions.iter().try_for_each(|(file, content)| write(format!("{name}_{file}.csv"), content))
}

fn text(replies: &[Reply]) -> String {
    let beside = |reply: &Reply| reply.brute.as_ref().map_or_else(String::new, brute);
    let rows = replies.iter().map(|reply| match &reply.said {
        Err(why) => {
            let mut cells = vec![reply.name.clone(), "failed".to_owned(), String::new(), why.clone()];
            cells.resize(8, String::new());
            cells.push(beside(reply));
            cells
        }
        Ok(said) => {
            let found = said.answer.found.iter().map(|((effect, place), _)| format!("{effect} at {place}"));
            let found = found.chain(said.answer.unexplained_at.iter().map(|place| format!("something at {place}")));
            let errors = |which: usize| {
                let each: Vec<String> = said.errors.iter().map(|(_, pair)| format!("{:.2}", pair[which])).collect();
                each.join(", ")
            };
            vec![
                reply.name.clone(),
                spelt(said.answer.verdict).to_owned(),
                number(said.answer.probability),
                found.collect::<Vec<_>>().join(" + "),
                errors(0),
                errors(1),
                format!("{:.1}", said.answer.seconds),
                said.answer.simulations.to_string(),
                beside(reply),
            ]
        }
    });
    let title = if replies.iter().any(|reply| reply.brute.is_some()) { "brute force" } else { "" };
    let header = ["case", "verdict", "probability", "found", "error before", "after", "seconds", "simulations", title];
    table(&header, &[2, 6, 7], rows.collect())
}

fn brute(said: &Result<Answer, String>) -> String {
    match said {
        Err(why) => why.clone(),
        Ok(answer) => {
            let found =
                answer.first().map_or_else(|| "none".to_owned(), |(effect, place)| format!("{effect} at {place}"));
            format!("{found}, {:.1} s", answer.seconds)
        }
    }
}
