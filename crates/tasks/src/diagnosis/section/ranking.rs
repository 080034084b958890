//! Tables of candidate effects, steps of the search, parameter shifts and detection limits.

use mops_content::{
    numbers::{number, percent, significant, with_unit},
    section::{Block, Part},
    table::{Cell, Row, Table, numbers, text},
};
use mops_outcome::diagnosis::{Diagnosis, Ranked};

use crate::diagnosis::words;

/// Number of effects in the first table; a folded second table has the others.
const SHOWN: usize = 10;

/// Returns the ranking, with marks on indistinguishable effects.
pub(super) fn blocks(diagnosis: &Diagnosis) -> Vec<Block> {
    let (first, others) = diagnosis.ranked.split_at(SHOWN.min(diagnosis.ranked.len()));
    let about = "Candidate effects fitted at each place, together with those already accepted. Absorbed: the part of the effect's output \
                 signature that parameters and initial states can mimic. Without a probability: no set of effects with this candidate \
                 has more evidence than the nominal model and a better forecast.";
    let mut blocks = vec![Block::text(about), Block::Table(table("Ranking", diagnosis, first))];
    if !others.is_empty() {
        let rest = Block::Table(table("Ranking, continued", diagnosis, others));
        blocks.push(Block::Folded(format!("{} more candidates", others.len()), vec![rest]));
    }
    blocks
}

fn table(name: &str, diagnosis: &Diagnosis, ranked: &[Ranked]) -> Table {
    let columns = [
        text("effect"),
        text("place"),
        text("probability"),
        text(""),
        numbers("BIC gain"),
        text("parameters"),
        numbers("error / noise"),
        numbers("absorbed"),
        text("result"),
    ];
    let rows = ranked.iter().map(|effect| {
        let known = |value: f64, shown: fn(f64) -> String| if value.is_finite() { shown(value) } else { String::new() };
        let mark = mark(diagnosis, effect);
        let probability = known(effect.probability, words::probability);
        let strengths = effect.strengths.iter().map(|strength| Part::Line(words::strength(strength)));
        let cells = vec![
            Cell::with_remark(&effect.effect, &effect.class),
            effect.place.clone().into(),
            Cell::new([Part::text(probability), Part::Bar(effect.probability)]),
            mark.unwrap_or_default().into(),
            known(effect.bic_gain, |gain| significant(gain, 4)).into(),
            Cell::new(strengths),
            known(effect.normalised, words::times).into(),
            words::share(effect.absorbed).into(),
            effect.failed.map_or("claimed", words::failed).into(),
        ];
        Row { cells, is_marked: mark.is_some() }
    });
    Table::new(name, columns).rows(rows)
}

/// Returns the relation of a candidate to the effects found.
fn mark(diagnosis: &Diagnosis, effect: &Ranked) -> Option<&'static str> {
    let is = |name: &str, place: &str| name == effect.effect && place == effect.place;
    if diagnosis.found.iter().any(|found| is(&found.effect, &found.place)) {
        return Some("added");
    }
    let mut rivals = diagnosis.found.iter().flat_map(|found| &found.indistinguishable);
    let rival = rivals.find(|rival| is(&rival.effect, &rival.place))?;
    Some(match rival.bic_behind {
        behind if behind <= -words::BARE_MENTION => "more likely",
        behind if behind < words::BARE_MENTION => "indistinguishable",
        _ => "not excluded",
    })
}

/// Returns the table of the models along the search.
pub(super) fn steps(diagnosis: &Diagnosis) -> Vec<Block> {
    let rows = diagnosis.steps.iter().map(|step| -> Vec<Cell> {
        vec![step.did.name().into(), step.effects.join(", ").into(), words::times(step.normalised).into()]
    });
    let columns = [text("step"), text("effects in the model"), numbers("error / noise")];
    vec![Block::Table(Table::new("Steps of the search", columns).rows(rows))]
}

/// Returns the table of parameter shifts.
pub(super) fn parameters(diagnosis: &Diagnosis) -> [Block; 2] {
    let columns = [
        text("parameter"),
        numbers("nominal model"),
        numbers("recalibrated model"),
        numbers("95 % interval"),
        text("unit"),
        numbers("change"),
        numbers("change / standard error"),
    ];
    let rows = diagnosis.parameters.iter().map(|p| -> Vec<Cell> {
        let interval = p.interval95.map(|ends| ends.map(|end| significant(end, 4)));
        let open = if p.at_bound { "at a bound" } else { "not determined" };
        let change = if p.before == 0.0 { String::new() } else { percent(p.after / p.before - 1.0) };
        vec![
            p.name.clone().into(),
            number(p.before).into(),
            Cell::strong(number(p.after)),
            interval.map_or_else(|| open.to_owned(), |[low, high]| format!("{low} to {high}")).into(),
            p.unit.clone().into(),
            change.into(),
            p.std_error.map_or_else(String::new, |error| significant((p.after - p.before) / error, 2)).into(),
        ]
    });
    let about = "The shift is the bias that the missing effect had caused.";
    [Block::text(about), Block::Table(Table::new("Parameters", columns).rows(rows))]
}

/// Returns the table of detection limits.
pub(super) fn noticeable(diagnosis: &Diagnosis) -> [Block; 2] {
    let rows = diagnosis.noticeable.iter().map(|effect| -> Vec<Cell> {
        let limit = with_unit(effect.strength.value, &effect.strength.unit);
        vec![
            effect.effect.clone().into(),
            words::at(&effect.place).into(),
            format!("{} = {limit}", effect.strength.name).into(),
        ]
    });
    let columns = [text("effect"), text("place"), numbers("detection limit")];
    let about = "Smallest parameter of each effect that would have been detected. A smaller effect may be present.";
    [Block::text(about), Block::Table(Table::new("Detection limits", columns).rows(rows))]
}
