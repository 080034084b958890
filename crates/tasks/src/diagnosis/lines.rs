//! Diagnosis on the terminal: verdict, effects found, errors before and after, indistinguishable effects.

use mops_content::numbers::{precise, significant};
use mops_content::section::Block;
use mops_content::table::{Cell, Table, numbers, text};
use mops_outcome::diagnosis::{Diagnosis, Verdict};

use super::{errors, words};

/// Number of ranked effects that are printed.
const SHOWN: usize = 6;

/// Returns the result of a diagnosis that took a number of seconds.
pub(super) fn blocks(diagnosis: &Diagnosis, seconds: f64) -> Vec<Block> {
    let has_verdict = diagnosis.verdict != Verdict::None;
    let mut blocks = vec![Block::text(words::verdict(diagnosis))];
    if !diagnosis.found.is_empty() {
        blocks.push(Block::Table(found(diagnosis)));
    }
    let removed = |term| Block::text(format!("term removed from the model: {}", words::term(term)));
    blocks.extend(diagnosis.removed.iter().map(removed));
    if !diagnosis.before.is_empty() {
        blocks.push(Block::Table(errors_table(diagnosis)));
    }
    let remarks: Vec<String> =
        diagnosis.found.iter().flat_map(words::remarks).map(|text| text.replace('`', "")).collect();
    if !remarks.is_empty() {
        blocks.push(Block::Findings(remarks));
    }
    if has_verdict && !diagnosis.ranked.is_empty() {
        blocks.push(Block::Table(ranking(diagnosis)));
        if diagnosis.ranked.len() > SHOWN {
            blocks.push(Block::text(format!("... and {} more, in the report", diagnosis.ranked.len() - SHOWN)));
        }
    }
    if !diagnosis.parameters.is_empty() && has_verdict {
        blocks.push(Block::Table(parameters(diagnosis)));
    }
    if !diagnosis.noticeable.is_empty() {
        blocks.push(Block::Table(noticeable(diagnosis)));
    }
    blocks.extend(diagnosis.next_experiment.iter().map(|next| Block::text(format!("next experiment: {next}"))));
    if !diagnosis.notes.is_empty() {
        blocks.push(Block::Lines(diagnosis.notes.iter().map(|note| format!("note: {note}")).collect()));
    }
    let [probability, chance] = [words::probability(diagnosis.probability), words::chance(diagnosis.p_value)];
    blocks.push(Block::text(format!(
        "probability {} {probability}; p-value without a missing effect {chance}; {} simulations, {seconds:.2} s",
        words::of_what(diagnosis),
        diagnosis.simulations
    )));
    blocks
}

fn found(diagnosis: &Diagnosis) -> Table {
    let mut rows = Vec::new();
    for found in &diagnosis.found {
        for (i, strength) in found.strengths.iter().enumerate() {
            // Cells common to all rows are filled in the first only.
            let once = |text: String| if i == 0 { text } else { String::new() };
            let [low, high] = words::ends(strength.interval95, strength.at_bound, 3);
            let row = [
                once(found.effect.clone()),
                once(found.places()),
                strength.name.clone(),
                significant(strength.value, 4),
                low,
                high,
                strength.unit.clone(),
                once(words::probability(found.probability)),
                once(words::probability(found.class_probability)),
                once(words::status(found).to_owned()),
            ];
            rows.push(row.map(Cell::from).to_vec());
        }
    }
    let columns = [
        text("effect found"),
        text("place"),
        text("parameter"),
        numbers("value"),
        numbers("95 % from"),
        numbers("to"),
        text("unit"),
        numbers("probability"),
        numbers("class and place"),
        text(""),
    ];
    Table::new("Effects found", columns).rows(rows)
}

fn errors_table(diagnosis: &Diagnosis) -> Table {
    let lines = errors::lines(diagnosis);
    let rows = lines.iter().map(|line| {
        let mut row = vec![line.experiment.name.clone(), line.experiment.role.name().to_owned(), line.label()];
        if line.channel.is_some() {
            row.extend(line.raw.map(|value| significant(value, 4)));
            row.extend([significant(line.noise, 4), line.unit.to_owned()]);
        }
        row.resize(7, String::new());
        row.extend(line.scaled.map(words::times));
        row.into_iter().map(Cell::from).collect::<Vec<_>>()
    });
    let columns = [
        text("experiment"),
        text("role"),
        text("channel"),
        numbers("before"),
        numbers("after"),
        numbers("noise"),
        text("unit"),
        numbers("before/noise"),
        numbers("after/noise"),
    ];
    Table::new("Errors before and after", columns).rows(rows)
}

fn ranking(diagnosis: &Diagnosis) -> Table {
    let rows = diagnosis.ranked.iter().take(SHOWN).map(|ranked| {
        let strengths: Vec<String> = ranked.strengths.iter().map(words::strength).collect();
        let row = [
            ranked.effect.clone(),
            ranked.place.clone(),
            if ranked.probability.is_finite() { words::probability(ranked.probability) } else { String::new() },
            if ranked.bic_gain.is_finite() { significant(ranked.bic_gain, 4) } else { "screened".to_owned() },
            words::share(ranked.absorbed),
            ranked.failed.map_or("claimed", words::failed).to_owned(),
            strengths.join(", "),
        ];
        row.map(Cell::from).to_vec()
    });
    let columns = [
        text("candidate"),
        text("place"),
        numbers("probability"),
        numbers("BIC gain"),
        numbers("absorbed"),
        text("result"),
        text("parameters"),
    ];
    Table::new("Candidates", columns).rows(rows)
}

fn parameters(diagnosis: &Diagnosis) -> Table {
    let rows = diagnosis.parameters.iter().map(|p| {
        let [low, high] = words::ends(p.interval95, p.at_bound, 4);
        let change =
            if p.before == 0.0 { String::new() } else { format!("{:+.1} %", 100.0 * (p.after / p.before - 1.0)) };
        let row = [p.name.clone(), precise(p.before), precise(p.after), low, high, p.unit.clone(), change];
        row.map(Cell::from).to_vec()
    });
    let columns = [
        text("parameter"),
        numbers("before"),
        numbers("after"),
        numbers("95 % from"),
        numbers("to"),
        text("unit"),
        numbers("change"),
    ];
    Table::new("Parameters", columns).rows(rows)
}

fn noticeable(diagnosis: &Diagnosis) -> Table {
    let rows = diagnosis.noticeable.iter().map(|n| {
        let strength = &n.strength;
        let least = significant(strength.value, 3);
        let row = [n.effect.clone(), n.place.clone(), strength.name.clone(), least, strength.unit.clone()];
        row.map(Cell::from).to_vec()
    });
    let columns = [text("detectable effect"), text("place"), text("parameter"), numbers("at least"), text("unit")];
    Table::new("Detection limits", columns).rows(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::made_up;

    #[test]
    fn a_found_effect_comes_with_its_strength_and_the_errors_beside_the_noise() {
        insta::assert_debug_snapshot!(plain(&blocks(&made_up::coulomb(), 4.2)));
    }

    #[test]
    fn nothing_missing_says_from_where_on_it_would_have_been_noticed() {
        insta::assert_debug_snapshot!(plain(&blocks(&made_up::nothing(), 4.2)));
    }

    /// Returns the texts of blocks; tables with their cells joined.
    fn plain(blocks: &[Block]) -> Vec<String> {
        let of_table = |table: &Table| -> Vec<String> {
            let header = table.columns.iter().map(|column| column.title.clone()).collect::<Vec<_>>();
            let rows = table.rows.iter().map(|row| row.cells.iter().map(Cell::plain).collect::<Vec<_>>());
            std::iter::once(header).chain(rows).map(|cells| cells.join(" | ")).collect()
        };
        let of = |block: &Block| match block {
            Block::Table(table) => of_table(table),
            Block::Findings(words) | Block::Lines(words) => words.clone(),
            Block::Paragraph(parts) => vec![parts.iter().map(|part| part.plain()).collect()],
            other => vec![format!("{other:?}")],
        };
        blocks.iter().flat_map(of).collect()
    }
}
