//! The task of a study file, and the tables with the options of tasks.

use mops_core::{
    Catalogue,
    catalogue::{TaskKind, schema_once},
    study::{StudyBuilder, StudyError},
    task::Task,
};
use mops_language::Diagnostic;

use super::tree::Node;
use super::uncertain;

/// Returns the names of the tables of tasks.
pub(super) fn tables(catalogue: &Catalogue) -> Vec<&'static str> {
    std::iter::once(uncertain::TABLE).chain(catalogue.tasks.iter().map(|kind| kind.table)).collect()
}

/// Returns notes on tables of other tasks, which are not used.
pub(super) fn unused(root: &Node<'_>, catalogue: &Catalogue, task: &Task) -> Vec<String> {
    let is_unused = |kind: &&TaskKind| root.child(kind.table).is_some() && kind.name != task.name();
    let unused = catalogue.tasks.iter().filter(is_unused);
    unused.map(|kind| format!("[{}] is not used by the task \"{}\"", kind.table, task.name())).collect()
}

/// Reads the tables of all tasks, and makes `word` the task of the draft; without a word it stays.
pub(super) fn read(
    root: &Node<'_>,
    catalogue: &Catalogue,
    word: Option<&str>,
    draft: &mut StudyBuilder,
) -> Result<(), Diagnostic> {
    let mut known: Vec<Task> =
        std::iter::once(std::mem::take(&mut draft.task)).chain(draft.options.drain(..)).collect();
    let word = word.map_or_else(|| known[0].name(), |word| kind_of(catalogue, word).map_or("", |kind| kind.name));
    for kind in &catalogue.tasks {
        let Some(node) = root.child(kind.table) else { continue };
        let task = node.read_with(&schema_once(kind.schema), kind.read)?;
        task.check_effects(&catalogue.effects).map_err(|mistake| root.locate(&mistake))?;
        known.retain(|other| other.name() != kind.name);
        known.push(task);
    }
    draft.task = match known.iter().position(|task| task.name() == word) {
        Some(at) => known.remove(at),
        None => absent(catalogue, word).map_err(|mistake| root.locate(&mistake))?,
    };
    draft.options = known;
    Ok(())
}

fn kind_of<'c>(catalogue: &'c Catalogue, word: &str) -> Option<&'c TaskKind> {
    catalogue.tasks.iter().find(|kind| kind.name == word)
}

/// Returns a task without options.
fn absent(catalogue: &Catalogue, word: &str) -> Result<Task, StudyError> {
    let kind = kind_of(catalogue, word).expect("the schema admits the words of the catalogue alone");
    (kind.absent)().ok_or_else(|| {
        StudyError::new("task", format!("the study has no table [{}]", kind.table))
            .with_help(kind.example)
            .within("study")
    })
}
