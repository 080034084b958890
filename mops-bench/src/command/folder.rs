//! Answers to a folder of cases, as files and as a table.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;

use mops::Diagnostic;

use mops::terminal::{CommandError, number, print, table};

use crate::diagnosis::{Answer, Cases, Reply, Tools, spelt};

/// Diagnoses every case of a folder, writes the answers and prints a table.
pub(super) fn answer(
    cases: &Path,
    answers: &Path,
    tools: Tools<'_>,
    jobs: usize,
    against: bool,
) -> Result<ExitCode, CommandError> {
    let cases = Cases::find(cases).map_err(Diagnostic::new)?;
    std::fs::create_dir_all(answers).map_err(CommandError::cannot_write(answers))?;
    let first_error = Mutex::new(None);
    let replies = cases.run(tools, jobs, against, |reply| {
        if let Err(error) = write_answer(answers, reply) {
            first_error.lock().expect("no thread panics while it locks the error").get_or_insert(error);
        }
    });
    if let Some(error) = first_error.into_inner().expect("all threads have ended") {
        return Err(error);
    }
    print(&text(&replies))?;
    print(&format!("\nanswers, predictions and studies are in {}\n", answers.display()))?;
    let failed = replies.iter().any(|reply| reply.answer.is_err());
    Ok(if failed { ExitCode::from(3) } else { ExitCode::SUCCESS })
}

/// Writes the study and, if there is one, the answer of a case.
fn write_answer(answers: &Path, reply: &Reply) -> Result<(), CommandError> {
    let write = |name: String, content: &str| {
        let path = answers.join(name);
        std::fs::write(&path, content).map_err(CommandError::cannot_write(&path))
    };
    let name = &reply.name;
    if !reply.study.is_empty() {
        write(format!("{name}.toml"), &reply.study)?;
    }
    let Ok(answer) = &reply.answer else { return Ok(()) };
    write(format!("{name}.json"), &answer.json)?;
    answer.predictions.iter().try_for_each(|(file, content)| write(format!("{name}_{file}.csv"), content))
}

fn text(replies: &[Reply]) -> String {
    let brute_cell = |reply: &Reply| reply.brute.as_ref().map_or_else(String::new, brute);
    let rows = replies.iter().map(|reply| match &reply.answer {
        Err(why) => {
            let mut cells = vec![reply.name.clone(), "failed".to_owned(), String::new(), why.clone()];
            cells.resize(8, String::new());
            cells.push(brute_cell(reply));
            cells
        }
        Ok(answer) => {
            let found = answer.summary.found.iter().map(|((effect, place), _)| format!("{effect} at {place}"));
            let found = found.chain(answer.summary.unexplained_at.iter().map(|place| format!("unknown at {place}")));
            let errors = |which: usize| {
                let each: Vec<String> = answer.errors.iter().map(|(_, pair)| format!("{:.2}", pair[which])).collect();
                each.join(", ")
            };
            vec![
                reply.name.clone(),
                spelt(answer.summary.verdict).to_owned(),
                number(answer.summary.probability),
                found.collect::<Vec<_>>().join(" + "),
                errors(0),
                errors(1),
                format!("{:.1}", answer.summary.seconds),
                answer.summary.simulations.to_string(),
                brute_cell(reply),
            ]
        }
    });
    let title = if replies.iter().any(|reply| reply.brute.is_some()) { "brute force" } else { "" };
    let header = ["case", "verdict", "probability", "found", "error before", "after", "seconds", "simulations", title];
    table(&header, &[2, 6, 7], rows.collect())
}

fn brute(answer: &Result<Answer, String>) -> String {
    match answer {
        Err(why) => why.clone(),
        Ok(answer) => {
            let found =
                answer.first().map_or_else(|| "none".to_owned(), |(effect, place)| format!("{effect} at {place}"));
            format!("{found}, {:.1} s", answer.seconds)
        }
    }
}
