//! Content of a report on the terminal.

use mops_content::section::{Block, Part};
use mops_content::table::Table;

use crate::terminal::table as aligned;

/// Formats blocks, each after an empty line; findings follow their heading directly.
pub(super) fn text(blocks: &[Block]) -> String {
    let mut text = String::new();
    let mut is_below_heading = false;
    for block in blocks {
        if !(is_below_heading && matches!(block, Block::Findings(_) | Block::Table(_))) {
            text.push('\n');
        }
        text += &formatted(block);
        is_below_heading = matches!(block, Block::Heading(_));
    }
    text
}

fn formatted(block: &Block) -> String {
    match block {
        Block::Heading(title) => format!("{title}\n"),
        Block::Paragraph(parts) => parts.iter().map(Part::plain).collect::<String>() + "\n",
        Block::Findings(words) => sentences(words),
        Block::Lines(lines) => lines.iter().map(|line| line.replace('`', "") + "\n").collect(),
        Block::Table(content) => table(content),
        // Plots are in the report.
        Block::Plots(_) => String::new(),
        Block::Card(card) => {
            let items = card.items.iter().map(|item| item.iter().map(Part::plain).collect::<String>());
            format!("{}\n{}\n{}", card.title, card.formula, sentences(&items.collect::<Vec<_>>()))
        }
        Block::Folded(summary, blocks) => format!("{summary}\n{}", text(blocks)),
    }
}

/// Formats sentences as a list.
pub(super) fn sentences(words: &[String]) -> String {
    words.iter().map(|words| format!("- {words}\n")).collect()
}

fn table(content: &Table) -> String {
    let header: Vec<&str> = content.columns.iter().map(|column| column.title.as_str()).collect();
    let numeric: Vec<usize> = (0..header.len()).filter(|&i| content.columns[i].is_number).collect();
    let rows = content.rows.iter().map(|row| row.cells.iter().map(|cell| cell.plain()).collect());
    aligned(&header, &numeric, rows.collect())
}
