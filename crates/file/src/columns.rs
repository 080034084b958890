//! Columns of a data file, with errors at their place in the study.

use mops_data::{Column, DataFile};
use mops_language::{Diagnostic, Unit};

use super::reading::UNIT_HELP;
use super::tree::Node;

/// Returns the node of a key that was read from a table.
pub(super) fn entry<'t>(node: &Node<'t>, table: &str, key: &str) -> Node<'t> {
    node.child(table).and_then(|table| table.child(key)).expect("it was just read")
}

/// Returns a column; an error for a missing one has the location in the study.
pub(super) fn column_at<'f>(place: &Node<'_>, file: &'f DataFile, name: &str) -> Result<Column<'f>, Diagnostic> {
    file.column(name).map_err(|error| {
        let located = place.diagnostic(error.message);
        Diagnostic { help: error.help, ..located }
    })
}

/// Returns the unit of a column from the header of the file; `key` overrides it in the study.
pub(super) fn unit_of_header(
    place: &Node<'_>,
    file: &DataFile,
    column: &str,
    unit: &str,
    key: &str,
) -> Result<Unit, Diagnostic> {
    Unit::parse(unit).map_err(|_| {
        let name = &file.source.name;
        place
            .diagnostic(format!("unknown unit `{unit}` of `{column}` in the header of {name}"))
            .with_help(format!("set {key} = \"...\" here; {UNIT_HELP}"))
    })
}
