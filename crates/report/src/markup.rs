//! Sections as HTML.

use maud::{Markup, html};
use mops_content::figures::{Figure, Group};
use mops_content::section::{Block, Card, Part, Section, Tone};
use mops_content::table::{Cell, Row, Table};

use super::chart;

/// Returns a section of a page.
pub(super) fn of(part: &Section) -> Markup {
    let has_box = part
        .groups()
        .flat_map(|group| &group.figures)
        .flat_map(|figure| &figure.plots)
        .any(|(_, plot)| plot.z_axis.is_some());
    let content = html! {
        (blocks(&part.blocks))
        @if has_box { p class="hint" hidden { "Drag the box, or press Shift and an arrow key, to rotate it." } }
    };
    section(&part.title, content)
}

/// Returns a section with a title.
pub(super) fn section(title: &str, content: Markup) -> Markup {
    let id = title.to_lowercase().replace(' ', "-");
    html! { section aria-labelledby=(id) { h2 id=(id) { (title) } (content) } }
}

/// Returns blocks in their order.
pub(super) fn blocks(blocks: &[Block]) -> Markup {
    html! { @for block in blocks { (self::block(block)) } }
}

fn block(block: &Block) -> Markup {
    match block {
        Block::Heading(text) => html! { h3 { (rich(text)) } },
        Block::Paragraph(parts) => html! { p { (self::parts(parts)) } },
        Block::Findings(words) => html! { ul class="findings" { @for text in words { li { (rich(text)) } } } },
        Block::Lines(lines) => {
            html! { p { @for (i, line) in lines.iter().enumerate() { @if i > 0 { br; } (rich(line)) } } }
        }
        Block::Table(table) => html! {
            @if table.are_points { (hint()) }
            (scrolling(&table.name, self::table(table)))
        },
        Block::Plots(group) => figures(group),
        Block::Card(card) => self::card(card),
        Block::Folded(summary, content) => html! { details { summary { (rich(summary)) } (blocks(content)) } },
    }
}

/// Returns how the points of a front are selected; shown by the script that does it.
fn hint() -> Markup {
    html! {
        p class="hint" hidden {
            "Hover over a point or use the arrow keys; click or press Enter to select it, Escape to deselect. Click a column header "
            "to sort."
        }
    }
}

fn card(card: &Card) -> Markup {
    html! {
        div class="effect" {
            h3 { (rich(&card.title)) }
            @if !card.remark.is_empty() { p class="quiet" { (rich(&card.remark)) } }
            p class="formula" { code { (card.formula) } }
            ul class="findings" { @for item in &card.items { li { (parts(item)) } } }
        }
    }
}

fn table(table: &Table) -> Markup {
    let is_errors = |part: &Part| matches!(part, Part::Errors { .. });
    let has_errors = table.rows.iter().flat_map(|row| &row.cells).flat_map(|cell| &cell.parts).any(is_errors);
    let class = if table.are_points { Some("front") } else { has_errors.then_some("errors") };
    html! {
        table class=[class] {
            thead {
                tr {
                    @for column in &table.columns {
                        th scope="col" class=[column.is_number.then_some("number")] { (column.title) }
                    }
                }
            }
            tbody { @for (i, row) in table.rows.iter().enumerate() { (self::row(table, i, row)) } }
        }
    }
}

fn row(table: &Table, index: usize, row: &Row) -> Markup {
    let mut at = 0;
    let cells = row.cells.iter().map(|cell| {
        let first = at;
        at += cell.width;
        (first, cell)
    });
    let cells: Vec<(usize, &Cell)> = cells.collect();
    html! {
        tr class=[row.is_marked.then_some("marked")] data-point=[table.are_points.then_some(index)] {
            @for (column, cell) in cells {
                @let is_number = table.columns.get(column).is_some_and(|column| column.is_number);
                (self::cell(cell, is_number, column < table.headings))
            }
        }
    }
}

fn cell(cell: &Cell, is_number: bool, is_heading: bool) -> Markup {
    let shade = cell.shade.map(|(tone, share)| (class_of_shade(tone), format!("--share:{:.0}%", 100.0 * share)));
    let judged = match cell.parts.as_slice() {
        [Part::Toned(tone, _)] if is_number => Some(class_of(*tone)),
        _ => None,
    };
    let classes = [
        is_number.then_some("number"),
        shade.as_ref().map(|(class, _)| *class),
        cell.is_quiet.then_some("quiet"),
        judged,
    ];
    let classes: Vec<&str> = classes.into_iter().flatten().collect();
    let class = (!classes.is_empty()).then(|| classes.join(" "));
    let style = shade.map(|(_, style)| style);
    let columns = (cell.width > 1).then_some(cell.width);
    let has_bar = cell.parts.iter().any(|part| matches!(part, Part::Bar(_)));
    let content = if has_bar && cell.parts.len() > 1 {
        html! { span class="scaled" { @for part in &cell.parts { @if let Part::Text(text) = part { span class="number" { (rich(text)) } } @else { (self::part(part)) } } } }
    } else {
        parts(&cell.parts)
    };
    if is_heading {
        html! { th scope="row" class=[class] data-value=[cell.value] { (content) } }
    } else {
        html! { td class=[class] style=[style] colspan=[columns] data-value=[cell.value] { (content) } }
    }
}

fn class_of(tone: Tone) -> &'static str {
    match tone {
        Tone::Good => "met",
        Tone::Mixed => "above",
        Tone::Bad => "missed",
    }
}

fn class_of_shade(tone: Tone) -> &'static str {
    match tone {
        Tone::Good => "shade good",
        Tone::Mixed => "shade mixed",
        Tone::Bad => "shade bad",
    }
}

/// Returns pieces of a text.
pub(super) fn parts(parts: &[Part]) -> Markup {
    html! { @for part in parts { (self::part(part)) } }
}

fn part(part: &Part) -> Markup {
    match part {
        Part::Text(text) => rich(text),
        Part::Strong(text) => html! { strong { (rich(text)) } },
        Part::Small(text) => html! { small { (rich(text)) } },
        Part::Quiet(text) => html! { span class="quiet" { (rich(text)) } },
        Part::Toned(tone, text) => html! { span class=(class_of(*tone)) { (rich(text)) } },
        Part::Code(text) => html! { code { (text) } },
        Part::Line(text) => html! { div { (rich(text)) } },
        Part::Bar(share) => {
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
            html! { span class="share" aria-hidden="true" { span style=(format!("width:{:.1}%", 100.0 * share)) {} } }
        }
        Part::Errors { before, after, noise } => {
            let width = |share: f64| format!("width:{:.1}%", 100.0 * share);
            html! {
                span class="pair" aria-hidden="true" {
                    @if let Some(before) = before { span class="before" style=(width(*before)) {} }
                    span class="after" style=(width(*after)) {}
                    span class="floor" style=(format!("left:{:.1}%", 100.0 * noise)) {}
                }
            }
        }
        Part::Swatch(is_after) => html! { span class=(if *is_after { "swatch after" } else { "swatch before" }) {} },
    }
}

/// Wraps a table for horizontal scrolling on narrow screens.
pub(super) fn scrolling(name: &str, table: Markup) -> Markup {
    html! { div class="wide" role="region" tabindex="0" aria-label=(name) { (table) } }
}

/// Returns a group of plots.
pub(super) fn figures(group: &Group) -> Markup {
    html! {
        @if !group.title.is_empty() { h3 { (rich(&group.title)) } }
        @for sentence in &group.about { p { (rich(sentence)) } }
        @if !group.figures.is_empty() {
            div class=(if group.full_width { "figures full" } else { "figures" }) {
                @for one in &group.figures { (figure(one)) }
            }
        }
    }
}

fn figure(figure: &Figure) -> Markup {
    html! {
        figure data-signal=[&figure.on_request] hidden[figure.on_request.is_some()] {
            @for (_, plot) in &figure.plots { (chart::markup(plot)) }
            @if !figure.caption.is_empty() {
                figcaption { @for (i, line) in figure.caption.iter().enumerate() { @if i > 0 { "; " } (rich(line)) } }
            }
        }
    }
}

/// Returns a text as markup; names between backticks become code.
pub(super) fn rich(text: &str) -> Markup {
    let parts: Vec<&str> = text.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return html! { (text) };
    }
    html! { @for (i, part) in parts.iter().enumerate() { @if i % 2 == 1 { code { (part) } } @else { (part) } } }
}
