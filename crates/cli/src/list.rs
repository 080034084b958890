//! `mops list`: lists the content of the catalogue.

use std::process::ExitCode;

use mops_core::{Catalogue, catalogue::CatalogueStudy};

use crate::terminal::{CommandError, print, table};
use clap::{Args, ValueEnum};

use super::study::text_of;

/// Arguments of `mops list`.
#[derive(Args)]
pub(super) struct Arguments {
    /// List only this part of the catalogue.
    what: Option<Sort>,
}

/// Part of the catalogue.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Sort {
    Studies,
    Models,
    Criteria,
    Solvers,
    Effects,
    Tasks,
}

pub(super) fn list(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let first_line = |schema: schemars::Schema| {
        let about = schema.as_value().get("description").and_then(|d| d.as_str()).unwrap_or_default();
        first_statement(about)
    };
    let row = |name: &str, about: String| vec![format!("  {name}"), about];
    let studies = catalogue.studies.iter().map(|study| {
        let about = match study {
            CatalogueStudy::Built(built) => built.about().to_owned(),
            _ => {
                let readme = text_of(study, "README.md").unwrap_or_default();
                readme.lines().next().unwrap_or_default().trim_start_matches('#').trim().to_owned()
            }
        };
        row(study.name(), about)
    });
    let models = catalogue.models.iter().map(|k| row(k.name, first_line((k.schema)())));
    let criteria = catalogue.criteria.iter().map(|k| row(k.name, first_line((k.schema)())));
    let solvers = catalogue.solvers.iter().map(|k| row(k.name, first_line((k.schema)())));
    let effects = catalogue.effects.iter().map(|effect| row(effect.name(), first_statement(effect.about())));
    let tasks = catalogue.tasks.iter().map(|task| row(task.name, first_statement(task.about)));
    let tables = [
        (Sort::Studies, "studies (mops run NAME)", studies.collect()),
        (Sort::Models, "models", models.collect()),
        (Sort::Criteria, "criteria", criteria.collect()),
        (Sort::Solvers, "solvers", solvers.collect::<Vec<_>>()),
        (Sort::Effects, "effects (mops diagnose STUDY)", effects.collect()),
        (Sort::Tasks, "tasks (task = \"NAME\" in [study])", tasks.collect()),
    ];
    let wanted = tables.into_iter().filter(|(sort, ..)| arguments.what.is_none_or(|what| what == *sort));
    let text: Vec<String> = wanted.map(|(_, title, rows)| table(&[title, ""], &[], rows)).collect();
    print(&format!(
        "{}\nFor details: mops describe NAME, also for the tables of a study file: study, models, tuners, cases,\n\
         experiments, criteria, solver.\n",
        text.join("\n")
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the text up to the end of its first statement; punctuation between backticks is skipped.
fn first_statement(text: &str) -> String {
    let paragraph = text.split("\n\n").next().unwrap_or_default().replace('\n', " ");
    let mut quoted = false;
    let end = paragraph.char_indices().find(|(i, c)| {
        quoted ^= *c == '`';
        !quoted && matches!(c, '.' | ';' | ':') && paragraph[i + 1..].chars().next().is_none_or(|next| next == ' ')
    });
    paragraph[..end.map_or(paragraph.len(), |(i, _)| i)].to_owned()
}

#[cfg(test)]
mod tests {
    use super::first_statement;

    #[test]
    fn a_statement_ends_at_punctuation_outside_formulas() {
        assert_eq!(first_statement("`sup { t : |y| > 1. }`, in s. More\n\nEven more"), "`sup { t : |y| > 1. }`, in s");
        assert_eq!(first_statement("A solver: it\nsolves"), "A solver");
    }
}
