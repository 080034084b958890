//! Tables on the terminal.

use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};

/// Formats a number to six significant digits, without trailing zeros.
pub fn number(value: f64) -> String {
    mops_content::numbers::significant(value, 6)
}

/// Formats a table: a header, then rows; the columns whose indices are in `numeric` are aligned to the right.
pub fn table(header: &[&str], numeric: &[usize], rows: Vec<Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(header.iter().map(Cell::new));
    for row in rows {
        table.add_row(row);
    }
    for &column in numeric {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
}
